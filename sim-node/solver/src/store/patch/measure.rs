//! The measurement of forces in a sheet.

use sim_scene::constraints::families::Family;

use super::Patch;
use crate::store::pulls::{Pull, Pulls};
use crate::store::rows::RowForces;

impl Patch {
    /// Measures these pulls in each further step.
    pub(crate) fn measure_forces(&mut self, pulls: Vec<Pull>) {
        let (rows, count) = (self.rows.layout.rows, self.layout.pull_groups());
        let pulls = Pulls::new(pulls, rows * count);
        let mask =
            |row| (0..count).fold(0, |mask, n| mask | u32::from(pulls.has(row * count + n)) << n);
        self.pull_masks = (0..rows).map(mask).collect();
        self.rows.measure_forces(pulls);
    }

    pub(crate) fn forget_forces(&mut self) {
        self.pull_masks = Vec::new();
        self.rows.forces = RowForces::default();
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
