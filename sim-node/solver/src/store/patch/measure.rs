//! The measurement of forces in a sheet.

use glam::DVec3;

use super::Patch;
use super::band_forces::SheetForces;
use crate::constraints::families::Family;
use crate::kernels::lanes::{Lanes8, axes, lane_groups};
use crate::store::pulls::{Pull, Pulls};
use crate::store::rows::RowLayout;
use crate::store::rows::particles::TetherPulls;

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

    /// Sets the root of a tether.
    pub(crate) fn set_tether_receiver(&mut self, place: [usize; 2], slot: usize, receiver: u32) {
        let [row, column] = place;
        let RowLayout { columns, ref fields, .. } = self.rows.layout;
        let group = (row * fields.scene.tethers + slot) * columns.div_ceil(8) + column / 8;
        self.forces.tether_receivers[group][column % 8] = Some(receiver);
    }

    /// Moves the impulses of a step, times the length of a substep, to those of the fixed particles.
    pub(crate) fn take_pulls(&mut self, impulses: &mut [DVec3]) {
        let Self { rows, forces, .. } = self;
        let layout = &rows.layout;
        forces.pulls.take(impulses);
        let length = forces.tether_length;
        let rows = rows.numbers().chunks_exact(layout.length);
        let count = layout.columns.div_ceil(8);
        for group in 0..length {
            // Tethers of a column often have one root.
            let (mut sums, mut last) = ([[0.0; 8]; 3], &[None; 8]);
            let pulls = forces.tether_pulls[group..].iter_mut().step_by(length);
            let receivers = forces.tether_receivers[group..].iter().step_by(length);
            for (row, (pulls, receivers)) in rows.clone().zip(pulls.zip(receivers)) {
                // Many are slack in all of a step.
                if is_zero(pulls) {
                    continue;
                }
                if receivers != last {
                    add_lanes(&sums, last, impulses);
                    (sums, last) = ([[0.0; 8]; 3], receivers);
                }
                let inverse_masses = lane_groups(row, 3 * layout.stride, count)[group % count];
                for (sum, pulls) in sums.iter_mut().zip(std::mem::take(pulls)) {
                    add_momenta(sum, &pulls, &inverse_masses);
                }
            }
            add_lanes(&sums, last, impulses);
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
        self.rows.particle_index(place) + 4 * self.rows.layout.stride
    }
}

#[inline(always)]
fn is_zero(pulls: &TetherPulls) -> bool {
    let all = pulls.as_flattened().iter();
    all.fold(0, |bits, number| bits | number.to_bits()) == 0
}

/// Adds mass times displacement. Particles of inverse mass 0 have none.
#[inline(always)]
fn add_momenta(sums: &mut Lanes8, displacements: &Lanes8, inverse_masses: &Lanes8) {
    for ((sum, displacement), inverse_mass) in
        sums.iter_mut().zip(displacements).zip(inverse_masses)
    {
        let momentum = displacement / inverse_mass;
        *sum += if *inverse_mass > 0.0 { momentum } else { 0.0 };
    }
}

/// Adds the momenta of eight tethers to those of their roots.
fn add_lanes(momenta: &TetherPulls, receivers: &[Option<u32>; 8], impulses: &mut [DVec3]) {
    for (lane, receiver) in receivers.iter().enumerate() {
        if let Some(receiver) = receiver {
            let momentum = axes(|axis| f64::from(momenta[axis][lane]));
            impulses[*receiver as usize] += DVec3::from_array(momentum);
        }
    }
}
