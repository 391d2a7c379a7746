//! The measurement of forces in a sheet.

use glam::DVec3;

use super::Patch;
use super::band_forces::SheetForces;
use super::row_layout::RowLayout;
use crate::constraints::families::Family;
use crate::kernels::lanes::axes;
use crate::store::pulls::{Pull, Pulls};

impl Patch {
    /// Measures these pulls, and the reactions of colliders, in each further step.
    pub(crate) fn measure_forces(&mut self, pulls: Vec<Pull>, collider_count: usize) {
        let layout = &self.layout;
        let pulls = Pulls::new(pulls, layout.rows * layout.pull_groups());
        self.forces = SheetForces::new(pulls, layout, collider_count);
    }

    pub(crate) fn forget_forces(&mut self) {
        self.forces = SheetForces::default();
    }

    pub(crate) fn forces_mut(&mut self) -> &mut SheetForces {
        &mut self.forces
    }

    /// Sets the root of a tether.
    pub(crate) fn set_tether_receiver(&mut self, place: [usize; 2], slot: usize, receiver: u32) {
        let [row, column] = place;
        let RowLayout { columns, ref fields, .. } = self.layout;
        let index = 8 * (row * fields.scene.tethers + slot) * columns.div_ceil(8) + column;
        self.forces.tether_receivers[index] = Some(receiver);
    }

    /// Adds the impulses, times the length of a substep, to those of the fixed particles.
    pub(crate) fn add_pulls(&self, impulses: &mut [DVec3]) {
        let SheetForces { pulls, tether_pulls, tether_receivers, .. } = &self.forces;
        pulls.add_to(impulses);
        let count = self.layout.columns.div_ceil(8);
        let tethers = tether_pulls.chunks_exact(3 * count);
        for (pulls, receivers) in tethers.zip(tether_receivers.chunks_exact(8 * count)) {
            for (column, receiver) in receivers.iter().enumerate() {
                let Some(receiver) = receiver else { continue };
                let pull = axes(|axis| f64::from(pulls[axis * count + column / 8][column % 8]));
                impulses[*receiver as usize] += DVec3::from_array(pull);
            }
        }
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

    /// Where the x displacement of a particle is among the numbers of the sheet.
    pub(crate) fn displacement_place(&self, place: [usize; 2]) -> usize {
        self.particle_index(place) + 4 * self.layout.stride
    }
}
