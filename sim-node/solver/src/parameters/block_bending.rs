//! The bending of generated blocks that have one of their own.

/// By generated block: rigidity that replaces that of its bends. A block without a place has none.
#[derive(Debug, Default)]
pub(crate) struct BlockBending(Vec<Option<f32>>);

impl BlockBending {
    /// Gives `block_count` blocks a place, so that a setting allocates nothing.
    pub(crate) fn with_room_for(block_count: usize) -> Self {
        Self(vec![None; block_count])
    }

    /// Takes over what [`Self::used`] returned.
    pub(crate) fn from_used(used: Vec<Option<f32>>) -> Self {
        Self(used)
    }

    /// Gives exactly `block_count` blocks a place.
    pub(crate) fn make_room_for(&mut self, block_count: usize) {
        self.0.resize(block_count, None);
    }

    /// Returns the places up to the last block with a rigidity.
    pub(crate) fn used(&self) -> &[Option<f32>] {
        let last = self.0.iter().rposition(Option::is_some);
        &self.0[..last.map_or(0, |last| last + 1)]
    }

    /// Rigidity of the bends of a block, if it has one of its own.
    pub(crate) fn get(&self, block: u32) -> Option<f32> {
        self.0.get(block as usize).copied().flatten()
    }

    /// Sets the rigidity of a block that has a place.
    pub(crate) fn set(&mut self, block: u32, rigidity: Option<f32>) {
        self.0[block as usize] = rigidity;
    }

    /// Removes all rigidities. The places stay.
    pub(crate) fn clear(&mut self) {
        self.0.fill(None);
    }

    /// Blocks with a rigidity of their own, ascending.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (u32, f32)> + '_ {
        (0..).zip(&self.0).filter_map(|(block, rigidity)| Some((block, (*rigidity)?)))
    }

    pub(crate) fn size_bytes(&self) -> usize {
        size_of_val(self.0.as_slice())
    }
}

impl Clone for BlockBending {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }

    /// Allocates nothing if `self` has places for all blocks of `source`.
    fn clone_from(&mut self, source: &Self) {
        self.0.clone_from(&source.0);
    }
}

/// Compares every bit of the rigidities, and not the number of places.
impl PartialEq for BlockBending {
    fn eq(&self, other: &Self) -> bool {
        let bits = |rigidity: &Option<f32>| rigidity.map(f32::to_bits);
        self.used().iter().map(bits).eq(other.used().iter().map(bits))
    }
}
