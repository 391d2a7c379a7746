//! Torn sides of triangles, and of the paths of bends.

/// Counts the torn sides of triangles, or of the paths of bends.
///
/// A side is a pair of particles. It is torn if constraints join the two particles, and all of them are torn: one
/// of several constraints between the same particles still holds the side. A side without a constraint does not tear.
///
/// A triangle with a torn side has no area: wind does not push it, nothing touches it, and it is not drawn. A bend
/// with a torn side has no effect.
#[derive(Debug, Clone, Default)]
pub struct TornSides {
    /// By constraint: index of its first owner in `owners`, and at the end the length of `owners`. Empty without sides.
    starts: Vec<u32>,
    /// By constraint: the triangles or bends of which the constraint is a side, ascending.
    owners: Vec<u32>,
    /// Constraints of the sides with several constraints, ascending, each with the index of its side in `intact_counts`.
    duplicates: Vec<(u32, u32)>,
    /// By side with several constraints: number of its intact constraints.
    intact_counts: Vec<u32>,
    /// By triangle or bend: number of torn sides.
    torn_counts: Vec<u8>,
}

impl TornSides {
    /// Finds the constraints on the sides of triangles. `ends` are the particles of each constraint; no constraint is torn.
    pub fn of_triangles(
        ends: impl Iterator<Item = [u32; 2]>,
        triangles: impl ExactSizeIterator<Item = [u32; 3]>,
    ) -> Self {
        let owner_count = triangles.len();
        let sides = (0_u32..).zip(triangles).flat_map(|(triangle, [a, b, c])| {
            [[a, b], [b, c], [c, a]].map(|side| (triangle, side))
        });
        Self::new(ends, owner_count, sides)
    }

    /// Finds the constraints on sides, each with the index of its triangle or bend.
    #[allow(clippy::cast_possible_truncation, reason = "at most 2^24 constraints and triangles")]
    pub(crate) fn new(
        ends: impl Iterator<Item = [u32; 2]>,
        owner_count: usize,
        sides: impl Iterator<Item = (u32, [u32; 2])>,
    ) -> Self {
        if owner_count == 0 {
            return Self::default();
        }
        let mut pairs: Vec<_> = ends.map(ascending).zip(0_u32..).collect();
        pairs.sort_unstable();
        let mut links: Vec<_> = sides
            .flat_map(|(owner, side)| {
                let side = ascending(side);
                let first = pairs.partition_point(|(pair, _)| *pair < side);
                let joining = pairs[first..].iter().take_while(move |(pair, _)| *pair == side);
                joining.map(move |(_, constraint)| (*constraint, owner))
            })
            .collect();
        links.sort_unstable();
        let mut all = Self { torn_counts: vec![0; owner_count], ..Self::default() };
        let mut end = 0;
        all.starts.push(0);
        for constraint in 0..pairs.len() as u32 {
            end += links[end..].iter().take_while(|(one, _)| *one == constraint).count();
            all.starts.push(end as u32);
        }
        all.owners.extend(links.iter().map(|(_, owner)| *owner));
        for group in pairs.chunk_by(|(a, _), (b, _)| a == b) {
            if group.len() > 1 && !all.owners(group[0].1).is_empty() {
                let side = all.intact_counts.len() as u32;
                all.duplicates.extend(group.iter().map(|(_, constraint)| (*constraint, side)));
                all.intact_counts.push(group.len() as u32);
            }
        }
        all.duplicates.sort_unstable();
        all
    }

    /// Counts a constraint that has torn or is restored. Returns true if its side is torn or restored with it.
    pub fn follow(&mut self, constraint: u32, is_torn: bool) -> bool {
        if let Ok(place) = self.duplicates.binary_search_by_key(&constraint, |(one, _)| *one) {
            let intact_count = &mut self.intact_counts[self.duplicates[place].1 as usize];
            let had_others = *intact_count > u32::from(is_torn);
            *intact_count = if is_torn { *intact_count - 1 } else { *intact_count + 1 };
            if had_others {
                return false;
            }
        }
        for place in self.places(constraint) {
            let torn_count = &mut self.torn_counts[self.owners[place] as usize];
            *torn_count = if is_torn { *torn_count + 1 } else { *torn_count - 1 };
        }
        true
    }

    /// Replaces the torn constraints. `torn` names each one once.
    pub fn set_torn(&mut self, torn: impl Iterator<Item = u32>) {
        self.torn_counts.fill(0);
        self.intact_counts.fill(0);
        for (_, side) in &self.duplicates {
            self.intact_counts[*side as usize] += 1;
        }
        for constraint in torn {
            self.follow(constraint, true);
        }
    }

    /// Returns true if a triangle or bend has no torn side.
    #[inline]
    pub fn is_whole(&self, owner: u32) -> bool {
        self.torn_counts[owner as usize] == 0
    }

    /// The triangles or bends of which a constraint is a side.
    pub fn owners(&self, constraint: u32) -> &[u32] {
        &self.owners[self.places(constraint)]
    }

    fn places(&self, constraint: u32) -> std::ops::Range<usize> {
        let index = constraint as usize;
        self.starts.get(index..index + 2).map_or(0..0, |ends| ends[0] as usize..ends[1] as usize)
    }
}

fn ascending([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles with a common side, which has two constraints. The side from 2 to 3 has none.
    fn sides() -> TornSides {
        let ends = [[0, 1], [2, 0], [1, 2], [2, 1], [1, 3], [7, 8]];
        TornSides::of_triangles(ends.into_iter(), [[0, 1, 2], [3, 2, 1]].into_iter())
    }

    fn are_whole(sides: &TornSides) -> [bool; 2] {
        [0, 1].map(|triangle| sides.is_whole(triangle))
    }

    #[test]
    fn a_side_is_torn_with_the_last_of_its_constraints() {
        let mut sides = sides();
        assert!(!sides.follow(3, true));
        assert_eq!(are_whole(&sides), [true, true]);
        assert!(sides.follow(2, true));
        assert_eq!(are_whole(&sides), [false, false]);
        assert!(sides.follow(3, false));
        assert_eq!(are_whole(&sides), [true, true]);
        assert!(!sides.follow(2, false));
        assert_eq!(sides.owners(2), [0, 1]);
    }

    #[test]
    fn a_triangle_is_whole_again_only_without_torn_sides() {
        let mut sides = sides();
        sides.set_torn([0, 1, 5].into_iter());
        assert_eq!(are_whole(&sides), [false, true]);
        assert!(sides.follow(0, false));
        assert_eq!(are_whole(&sides), [false, true]);
        sides.set_torn([4].into_iter());
        assert_eq!(are_whole(&sides), [true, false]);
        sides.set_torn([2, 3].into_iter());
        assert_eq!(are_whole(&sides), [false, false]);
        sides.set_torn([].into_iter());
        assert_eq!(are_whole(&sides), [true, true]);
    }

    #[test]
    fn without_triangles_there_is_nothing_to_tear() {
        let mut sides = TornSides::of_triangles([[0, 1]].into_iter(), [].into_iter());
        sides.set_torn([0].into_iter());
        assert!(sides.owners(0).is_empty());
    }
}
