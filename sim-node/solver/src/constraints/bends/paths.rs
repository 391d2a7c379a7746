//! The paths of bends: a bend stops when a constraint of its path tears.

use super::Bend;
use crate::constraints::Constraint;

/// The bends that hang on each constraint.
#[derive(Debug, Clone, Default)]
pub(crate) struct BendPaths {
    /// By constraint: index of its first bend in `bends`. One more entry at the end; empty without bends.
    starts: Vec<u32>,
    bends: Vec<u32>,
}

impl BendPaths {
    /// Finds the constraints between neighbouring particles of each bend.
    pub(crate) fn new(constraints: &[Constraint], bends: &[Bend]) -> Self {
        if bends.is_empty() {
            return Self::default();
        }
        let pairs = sorted_pairs(constraints);
        let links = || (0_u32..).zip(bends).flat_map(|(index, bend)| links_of(&pairs, index, bend));
        let mut starts = vec![0_u32; constraints.len() + 1];
        for link in links() {
            starts[link.constraint as usize + 1] += 1;
        }
        for constraint in 1..starts.len() {
            starts[constraint] += starts[constraint - 1];
        }
        let mut next = starts.clone();
        let mut on_path = vec![0; starts[constraints.len()] as usize];
        for Link { constraint, bend } in links() {
            let place = &mut next[constraint as usize];
            on_path[*place as usize] = bend;
            *place += 1;
        }
        Self { starts, bends: on_path }
    }

    /// Bends whose path contains a constraint.
    pub(crate) fn of(&self, constraint: u32) -> &[u32] {
        let index = constraint as usize;
        match self.starts.get(index..index + 2) {
            Some(ends) => &self.bends[ends[0] as usize..ends[1] as usize],
            None => &[],
        }
    }
}

/// A constraint in the path of a bend.
struct Link {
    constraint: u32,
    bend: u32,
}

/// The particles of a constraint, the lower index first, and its own index.
type Pair = ([u32; 2], u32);

fn sorted_pairs(constraints: &[Constraint]) -> Vec<Pair> {
    let pairs = (0_u32..).zip(constraints);
    let mut pairs: Vec<_> = pairs.map(|(index, one)| (ascending([one.a, one.b]), index)).collect();
    pairs.sort_unstable();
    pairs
}

fn links_of<'a>(pairs: &'a [Pair], index: u32, bend: &'a Bend) -> impl Iterator<Item = Link> + 'a {
    bend.path().iter().flat_map(move |ends| {
        let pair = ascending(ends.map(|end| bend.particles[end]));
        let first = pairs.partition_point(|(one, _)| *one < pair);
        let joining = pairs[first..].iter().take_while(move |(one, _)| *one == pair);
        joining.map(move |(_, constraint)| Link { constraint: *constraint, bend: index })
    })
}

fn ascending([a, b]: [u32; 2]) -> [u32; 2] {
    if a < b { [a, b] } else { [b, a] }
}
