//! Forces of the particles of the graph on colliders and fixed particles.

use super::group::ConstraintGroup;
use crate::kernels::lanes::PackedParticle;
use crate::store::pulls::{Numbers, Pulls};

/// The forces of the graph. Empty while nobody asks for them.
#[derive(Debug, Clone, Default)]
pub(crate) struct GraphForces {
    pub(crate) pulls: Pulls,
    pub(crate) projections: Projections,
    /// By particle and tether: mass times the displacement that the tether has taken.
    pub(crate) tether_pulls: Vec<[f32; 3]>,
    /// By particle and tether: index of the root among the fixed particles.
    pub(crate) tether_receivers: Vec<Option<u32>>,
}

/// Numbers of the projections: one for each group of independent constraints or bends, and one for each member
/// of the other groups.
#[derive(Debug, Clone, Default)]
pub(crate) struct Projections {
    /// By group of constraints.
    pub(super) constraints: Vec<usize>,
    /// By group of bends.
    pub(super) bends: Vec<usize>,
    pub(super) count: usize,
}

impl Projections {
    pub(crate) fn new(constraints: &[ConstraintGroup], bends: &[ConstraintGroup]) -> Self {
        let mut count = 0;
        let mut number = |group: &ConstraintGroup| {
            let first = count;
            count += if group.is_independent { 1 } else { group.count };
            first
        };
        let constraints = constraints.iter().map(&mut number).collect();
        let bends = bends.iter().map(&mut number).collect();
        Self { constraints, bends, count }
    }

    /// Number of the first projection of a group of constraints; 0 while nobody asks for forces.
    pub(crate) fn of_constraints(&self, group: usize) -> usize {
        self.constraints.get(group).copied().unwrap_or(0)
    }

    /// Number of the first projection of a group of bends; 0 while nobody asks for forces.
    pub(crate) fn of_bends(&self, group: usize) -> usize {
        self.bends.get(group).copied().unwrap_or(0)
    }
}

/// The particles that a group moves, and the pulls of its projections.
pub(crate) struct MovedParticles<'a> {
    pub(crate) particles: &'a mut [PackedParticle],
    pub(crate) pulls: &'a mut Pulls,
    /// Number of the first projection.
    pub(crate) first: usize,
}

impl MovedParticles<'_> {
    /// Notes the displacements before the projection with this number in the group.
    #[inline(always)]
    pub(crate) fn note(&mut self, number: usize) {
        if self.pulls.has(self.first + number) {
            self.note_measured(number);
        }
    }

    /// Adds the changes since [`Self::note`].
    #[inline(always)]
    pub(crate) fn add_changes(&mut self, number: usize) {
        if self.pulls.has(self.first + number) {
            self.add_measured_changes(number);
        }
    }

    #[inline(never)]
    fn note_measured(&mut self, number: usize) {
        self.pulls.whole().note(self.first + number, numbers(self.particles));
    }

    #[inline(never)]
    fn add_measured_changes(&mut self, number: usize) {
        self.pulls.whole().add_changes(self.first + number, numbers(self.particles));
    }
}

fn numbers(particles: &[PackedParticle]) -> Numbers<'_> {
    Numbers { part: bytemuck::cast_slice(particles), first: 0, stride: 1 }
}
