//! The order of projection: data, fixed at load, and the same for every kernel and thread count.
//!
//! In small substeps the order decides stability: constraints in file order gain energy and blow
//! up; groups without shared particles do not.

use std::ops::Range;

use sim_scene::model::Model;
use sim_scene::scene::ConstraintOrder;

/// Largest number of groups of independent constraints. The rest go into one serial group after
/// them, which only a particle with more than 32 constraints needs, such as the hub of a web.
const GROUPS_MAX: usize = 32;

/// A permutation of the constraints, divided into groups.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ProjectionOrder {
    /// Constraint indices in the order of projection.
    pub(crate) indices: Vec<u32>,
    /// Ranges of `indices`; none is empty.
    pub(crate) groups: Vec<Range<usize>>,
    /// Number of leading groups in which no two constraints share a particle. At most one more
    /// follows; its constraints are projected one after the other.
    pub(crate) independent_count: usize,
}

/// The orders of a scene.
#[derive(Debug, Clone)]
pub(crate) struct ProjectionOrders {
    pub(crate) constraints: ProjectionOrder,
    pub(crate) bends: ProjectionOrder,
}

impl ProjectionOrders {
    pub(crate) fn new(model: &Model, order: ConstraintOrder) -> Self {
        Self {
            constraints: ProjectionOrder::new(model, order),
            bends: ProjectionOrder::of_bends(model, order),
        }
    }

    /// True unless constraints and bends are projected in the order of the file.
    pub(crate) fn has_groups(&self) -> bool {
        self.constraints.independent_count > 0 || self.bends.independent_count > 0
    }
}

impl ProjectionOrder {
    /// The order of the distance constraints.
    ///
    /// In the order in which they were found, first-fit groups of a mesh that is listed face by face can go around each
    /// particle in a circle. A rigid mesh under pressure then gains energy without bound in small substeps.
    fn new(model: &Model, order: ConstraintOrder) -> Self {
        let particles = |index| model.pair(index);
        let particle_count = model.particles.len();
        Self::of(&model.families, particle_count, order, particles, in_reversed_bit_order)
    }

    /// The order of the bends, which follow the constraints.
    fn of_bends(model: &Model, order: ConstraintOrder) -> Self {
        let particles = |index| model.bends[index as usize].particles;
        let particle_count = model.particles.len();
        Self::of(&model.bend_families, particle_count, order, particles, std::convert::identity)
    }

    /// `families` and `particles` are by constraint. `arrange` puts the first-fit groups in order.
    fn of<const N: usize>(
        families: &[Option<u32>],
        particle_count: usize,
        order: ConstraintOrder,
        particles: impl Fn(u32) -> [u32; N],
        arrange: impl FnOnce(Vec<Vec<u32>>) -> Vec<Vec<u32>>,
    ) -> Self {
        match order {
            ConstraintOrder::Listed => Self::from_groups(Vec::new(), indices(families).collect()),
            ConstraintOrder::Grouped => {
                let Grouped { mut independent, family_count, overflow } =
                    group(families, particle_count, particles);
                let first_fit = independent.split_off(family_count);
                independent.extend(arrange(first_fit));
                Self::from_groups(independent, overflow)
            }
        }
    }

    fn from_groups(independent: Vec<Vec<u32>>, serial: Vec<u32>) -> Self {
        let mut order = Self { indices: Vec::new(), groups: Vec::new(), independent_count: 0 };
        for group in independent {
            order.push(group);
        }
        order.independent_count = order.groups.len();
        order.push(serial);
        order
    }

    fn push(&mut self, group: Vec<u32>) {
        if group.is_empty() {
            return;
        }
        let start = self.indices.len();
        self.indices.extend(group);
        self.groups.push(start..self.indices.len());
    }
}

fn indices(families: &[Option<u32>]) -> impl Iterator<Item = u32> {
    (0_u32..).take(families.len())
}

/// Groups declared families first, one half of a family per group. Every other constraint, in
/// index order, goes into the first later group in which none of its particles occurs.
fn group<const N: usize>(
    families: &[Option<u32>],
    particle_count: usize,
    particles: impl Fn(u32) -> [u32; N],
) -> Grouped {
    let family_count = families.iter().flatten().max().map_or(0, |last| *last as usize + 1);
    let mut groups = vec![Vec::new(); family_count];
    let mut overflow = Vec::new();
    // Bit g of a particle: it occurs in first-fit group g, counted after the families.
    let mut occupied = vec![0_u32; particle_count];
    let first_fit_mask = lowest_bits(GROUPS_MAX - family_count);
    for index in indices(families) {
        if let Some(family) = families[index as usize] {
            groups[family as usize].push(index);
            continue;
        }
        let particles = particles(index).map(|particle| particle as usize);
        let taken = particles.iter().fold(0, |taken, particle| taken | occupied[*particle]);
        let free = !taken & first_fit_mask;
        if free == 0 {
            overflow.push(index);
            continue;
        }
        let bit = free.trailing_zeros();
        for particle in particles {
            occupied[particle] |= 1 << bit;
        }
        let group = family_count + bit as usize;
        groups.resize(groups.len().max(group + 1), Vec::new());
        groups[group].push(index);
    }
    Grouped { independent: groups, family_count, overflow }
}

/// Constraints in independent groups, and those that fit into none.
struct Grouped {
    /// Halves of families, then first-fit groups.
    independent: Vec<Vec<u32>>,
    family_count: usize,
    overflow: Vec<u32>,
}

/// Orders groups by the reversed bits of their numbers: 0, 4, 2, 6, 1, 5, 3 for seven of them.
fn in_reversed_bit_order(groups: Vec<Vec<u32>>) -> Vec<Vec<u32>> {
    let mut numbered: Vec<_> = groups.into_iter().enumerate().collect();
    numbered.sort_by_key(|(number, _)| number.reverse_bits());
    numbered.into_iter().map(|(_, group)| group).collect()
}

fn lowest_bits(count: usize) -> u32 {
    if count >= 32 { u32::MAX } else { (1 << count) - 1 }
}

#[cfg(test)]
mod tests {
    //! Independence and completeness of the groups, on structured and on irregular scenes.
    use std::collections::BTreeSet;

    use sim_scene::scene::Scene;

    use super::*;

    fn model(text: &str) -> Model {
        Scene::from_toml(text, "test").unwrap().model()
    }

    fn assert_independent(model: &Model, group: &[u32]) {
        let mut seen = BTreeSet::new();
        for particle in group.iter().flat_map(|index| model.pair(*index)) {
            assert!(seen.insert(particle), "particle {particle} occurs twice in a group");
        }
    }

    fn hub(spokes: usize) -> String {
        let mut text = "version = 1\n[[particle]]\nposition = [0, 0, 0]\n".to_owned();
        for spoke in 1..=spokes {
            text += &format!("[[particle]]\nposition = [{spoke}, 0, 0]\n");
            text += &format!("[[constraint]]\nparticles = [0, {spoke}]\n");
        }
        text
    }

    #[test]
    fn a_cloth_with_all_links_falls_into_twelve_independent_families() {
        let links = "links = [\"structural\", \"shear\", \"bend\"]";
        let cloth = "[[generate]]\nshape = \"cloth\"\ncolumns = 9\nrows = 7\nspacing = 0.1\n";
        // Two patches share their families.
        let model = model(&format!("version = 1\n{cloth}{links}\n{cloth}{links}\n"));
        let order = ProjectionOrder::new(&model, ConstraintOrder::Grouped);
        assert_eq!(order.groups.len(), 12);
        let mut all: Vec<_> = order.indices.clone();
        all.sort_unstable();
        assert_eq!(all, indices(&model.families).collect::<Vec<_>>());
        for group in &order.groups {
            assert_independent(&model, &order.indices[group.clone()]);
        }
    }

    #[test]
    fn a_rope_falls_into_two_groups() {
        let text = "version = 1\n[[generate]]\nshape = \"rope\"\ncount = 6\nfrom = [0, 0, 0]\nto = [1, 0, 0]\n";
        let order = ProjectionOrder::new(&model(text), ConstraintOrder::Grouped);
        assert_eq!((order.indices, order.groups), (vec![0, 2, 4, 1, 3], vec![0..3, 3..5]));
    }

    #[test]
    fn first_fit_groups_that_follow_each_other_are_projected_apart() {
        let order = ProjectionOrder::new(&model(&hub(7)), ConstraintOrder::Grouped);
        assert_eq!(order.indices, [0, 4, 2, 6, 1, 5, 3]);
    }

    #[test]
    fn a_hub_with_many_spokes_overflows_into_one_serial_group() {
        let model = model(&hub(100));
        let order = ProjectionOrder::new(&model, ConstraintOrder::Grouped);
        assert_eq!((order.groups.len(), order.independent_count), (GROUPS_MAX + 1, GROUPS_MAX));
        assert!(order.groups[..GROUPS_MAX].iter().all(|group| group.len() == 1));
        let serial = &order.indices[GROUPS_MAX..];
        assert_eq!(serial, (32..100).collect::<Vec<_>>());
    }

    #[test]
    fn listed_order_is_one_group_in_file_order() {
        let order = ProjectionOrder::new(&model(&hub(5)), ConstraintOrder::Listed);
        assert_eq!(order.independent_count, 0);
        assert_eq!(
            (order.indices, order.groups),
            ((0..5).collect(), std::iter::once(0..5).collect::<Vec<_>>())
        );
    }
}
