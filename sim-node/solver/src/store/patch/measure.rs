//! The measurement of forces in a sheet.

use glam::DVec3;

use super::Patch;
use super::band_forces::SheetForces;
use crate::constraints::families::Family;
use crate::store::pulls::{Pull, Pulls};

impl Patch {
    /// Measures these pulls, and the reactions of colliders, in each further step.
    pub(crate) fn measure_forces(&mut self, pulls: Vec<Pull>, collider_count: usize) {
        let (layout, pull_groups) = (&self.rows.layout, self.layout.pull_groups());
        let pulls = Pulls::new(pulls, layout.rows * pull_groups);
        self.forces = SheetForces::new(pulls, layout, pull_groups, collider_count);
    }

    pub(crate) fn forget_forces(&mut self) {
        self.forces = SheetForces::default();
    }

    pub(crate) fn forces_mut(&mut self) -> &mut SheetForces {
        &mut self.forces
    }

    /// Sets the root of a tether of the particle with this index.
    pub(crate) fn set_tether_receiver(&mut self, index: usize, slot: usize, receiver: u32) {
        self.forces.tethers.set_receiver(&self.rows.layout, (index, slot), receiver);
    }

    /// Moves the impulses of a step, times the length of a substep, to those of the fixed particles.
    pub(crate) fn take_pulls(&mut self, impulses: &mut [DVec3]) {
        self.forces.pulls.take(impulses);
        self.forces.tethers.take(&self.rows, impulses);
    }

    /// Number of the projection of a constraint of a family's group that begins in a row.
    pub(crate) fn projection_of_constraint(&self, group: Option<u32>, row: usize) -> usize {
        let Some(group) = group else {
            unreachable!("a constraint of a sheet belongs to a family")
        };
        let family = self.layout.family_index(Family::from_group(group));
        row * self.layout.pull_groups() + 2 * family + group as usize % 2
    }

    /// Number of the projection of a bend of a family's group that begins in a row.
    pub(crate) fn projection_of_bend(&self, group: Option<u32>, row: usize) -> usize {
        let Some(group) = group else { unreachable!("a bend of a sheet belongs to a family") };
        let layout = &self.layout;
        let number = layout.bends.groups.iter().position(|one| one.number() == group);
        let Some(number) = number else { unreachable!("a bend belongs to a group of its sheet") };
        row * layout.pull_groups() + 2 * layout.families.len() + number
    }
}
