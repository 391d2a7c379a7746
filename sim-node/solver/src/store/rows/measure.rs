//! The measurement of forces in rows.

use glam::DVec3;

use super::Rows;
use super::forces::RowForces;
use super::layout::RowLayout;
use super::particles::TetherPulls;
use crate::kernels::lanes::{Lanes8, axes, lane_groups};
use crate::store::pulls::Pulls;

impl Rows {
    /// Measures these pulls in each further step. No tether has a root yet.
    pub(crate) fn measure_forces(&mut self, pulls: Pulls) {
        let RowLayout { rows, columns, ref fields, .. } = self.layout;
        let tether_length = fields.scene.tethers * columns.div_ceil(8);
        self.forces = RowForces {
            is_measured: true,
            pulls,
            tether_pulls: vec![[[0.0; 8]; 3]; rows * tether_length],
            tether_length,
            tether_receivers: vec![[None; 8]; rows * tether_length],
        };
    }

    /// Sets the root of a tether of the particle with this index.
    pub(crate) fn set_tether_receiver(&mut self, index: usize, slot: usize, receiver: u32) {
        let Self { layout, forces, .. } = self;
        let (row, column) = (index / layout.length, index % layout.length);
        let group = row * forces.tether_length + slot * layout.columns.div_ceil(8) + column / 8;
        forces.tether_receivers[group][column % 8] = Some(receiver);
    }

    /// Moves the impulses of a step, times the length of a substep, to those of the fixed particles.
    pub(crate) fn take_pulls(&mut self, impulses: &mut [DVec3]) {
        let (layout, numbers, forces) = self.split_mut();
        forces.pulls.take(impulses);
        let rows = numbers.chunks_exact(layout.length);
        let length = forces.tether_length;
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
