//! The particles of a row, and the stages of single particles on them.

use glam::Vec3;

use super::layout::{RowLayout, TETHER_FIELDS};
use crate::constraints::separation::RestLength;
use crate::constraints::tether_pull::{Tethered, tether_excess};
use crate::contacts::path::{LanePath, SubstepPath};
use crate::kernels::lanes::{Lanes8, Wide, axes, lane_groups, lane_groups_mut};
use crate::step::particle_block::ParticleBlock;
use crate::step::prediction::Prediction;
use crate::store::layout::SceneFields;

/// The displacements that tethers have taken from eight particles, axis by axis.
pub(crate) type TetherPulls = [Lanes8; 3];

/// The particles of a row, with the fields that only some scenes have.
pub(crate) struct RowParticles<'a> {
    x: [&'a mut [Lanes8]; 3],
    w: &'a [Lanes8],
    d: [&'a mut [Lanes8]; 3],
    predicted: Option<[&'a mut [Lanes8]; 3]>,
    wind: Option<[&'a [Lanes8]; 3]>,
    /// For each tether of a particle: the position of the root at the end of the substep, the largest
    /// distance to it, and its square.
    tethers: &'a [f32],
    /// For each tether of a particle and eight columns: what it has taken in this step. Empty if nobody asks for it.
    tether_pulls: &'a mut [TetherPulls],
    /// Length of a field in numbers.
    stride: usize,
    /// Index of the first particle.
    first: usize,
}

impl<'a> RowParticles<'a> {
    #[inline(always)]
    pub(crate) fn new(
        numbers: &'a mut [f32],
        layout: &RowLayout,
        row: usize,
        tether_pulls: &'a mut [TetherPulls],
    ) -> Self {
        let (stride, count) = (layout.stride, layout.columns.div_ceil(8));
        let mut numbers = numbers;
        let rest = &mut numbers;
        let SceneFields { bounces, wind, tethers, .. } = layout.fields.scene;
        let x = next_vector(rest, stride, count);
        let w = &*next_field(rest, stride, count);
        let d = next_vector(rest, stride, count);
        let predicted = if bounces { Some(next_vector(rest, stride, count)) } else { None };
        let wind = if wind { Some(next_vector(rest, stride, count)) } else { None };
        let wind = wind.map(|[x, y, z]| [&*x, &*y, &*z]);
        let wind = wind.filter(|_| layout.fields.is_wind_used);
        let tethers = &numbers[..TETHER_FIELDS * tethers * stride];
        let first = layout.first + row * layout.columns;
        Self { x, w, d, predicted, wind, tethers, tether_pulls, stride, first }
    }
}

/// Splits a field off the numbers of a row. (As a closure it would compile to a call.)
#[inline(always)]
#[allow(clippy::mut_mut, reason = "it shortens the slice")]
fn next_field<'a>(rest: &mut &'a mut [f32], stride: usize, count: usize) -> &'a mut [Lanes8] {
    let (field, others) = std::mem::take(rest).split_at_mut(stride);
    *rest = others;
    lane_groups_mut(field, 0, count)
}

#[inline(always)]
#[allow(clippy::mut_mut, reason = "it shortens the slice")]
fn next_vector<'a>(rest: &mut &'a mut [f32], stride: usize, count: usize) -> [&'a mut [Lanes8]; 3] {
    let x = next_field(rest, stride, count);
    let y = next_field(rest, stride, count);
    [x, y, next_field(rest, stride, count)]
}

#[inline(always)]
fn load<W: Wide>(fields: &[&mut [Lanes8]; 3], group: usize) -> [W; 3] {
    let [x, y, z] = fields;
    [W::load(&x[group], 0), W::load(&y[group], 0), W::load(&z[group], 0)]
}

#[inline(always)]
fn store<W: Wide>(vectors: [W; 3], fields: &mut [&mut [Lanes8]; 3], group: usize) {
    let ([x, y, z], [to_x, to_y, to_z]) = (vectors, fields);
    x.store(&mut to_x[group], 0);
    y.store(&mut to_y[group], 0);
    z.store(&mut to_z[group], 0);
}

fn vector(axes: &[&mut [Lanes8]; 3], index: usize) -> Vec3 {
    let (group, lane) = (index / 8, index % 8);
    Vec3::new(axes[0][group][lane], axes[1][group][lane], axes[2][group][lane])
}

fn set_vector(axes: &mut [&mut [Lanes8]; 3], index: usize, vector: Vec3) {
    for (axis, number) in axes.iter_mut().zip(vector.to_array()) {
        axis[index / 8][index % 8] = number;
    }
}

/// Adds the displacements that tethers have taken from eight particles to their sums.
#[inline(always)]
fn add_pulls<W: Wide>(sums: &mut TetherPulls, excess: [W; 3]) {
    for (sum, excess) in sums.iter_mut().zip(excess) {
        (W::load(sum, 0) + excess).store(sum, 0);
    }
}

impl ParticleBlock for RowParticles<'_> {
    fn group_count(&self) -> usize {
        self.w.len()
    }

    fn first(&self) -> usize {
        self.first
    }

    fn inverse_mass(&self, index: usize) -> f32 {
        self.w[index / 8][index % 8]
    }

    fn path(&self, index: usize) -> SubstepPath {
        SubstepPath { start: vector(&self.x, index), displacement: vector(&self.d, index) }
    }

    fn predicted(&self, index: usize) -> Vec3 {
        self.predicted.as_ref().map_or(Vec3::ZERO, |predicted| vector(predicted, index))
    }

    fn set_displacement(&mut self, index: usize, displacement: Vec3) {
        set_vector(&mut self.d, index, displacement);
    }

    #[inline(always)]
    fn paths<W: Wide>(&self, group: usize) -> LanePath<W> {
        LanePath { start: load(&self.x, group), displacement: load(&self.d, group) }
    }

    #[inline(always)]
    fn inverse_masses<W: Wide>(&self, group: usize) -> W {
        W::load(&self.w[group], 0)
    }

    #[inline(always)]
    fn predicted_lanes<W: Wide>(&self, group: usize) -> [W; 3] {
        match &self.predicted {
            Some(predicted) => load(predicted, group),
            None => [W::splat(0.0); 3],
        }
    }

    #[inline(always)]
    fn set_displacements<W: Wide>(&mut self, group: usize, displacements: [W; 3]) {
        store(displacements, &mut self.d, group);
    }

    #[inline(always)]
    fn set_paths<W: Wide>(&mut self, group: usize, paths: &LanePath<W>) {
        store(paths.start, &mut self.x, group);
        store(paths.displacement, &mut self.d, group);
    }

    #[inline(always)]
    fn predict<W: Wide>(&mut self, prediction: &Prediction) {
        for group in 0..self.w.len() {
            let load = |field: &[Lanes8]| W::load(&field[group], 0);
            let before = axes(|axis| load(self.d[axis]));
            let wind = match &self.wind {
                Some(wind) => axes(|axis| load(wind[axis])),
                None => [W::splat(0.0); 3],
            };
            let after = prediction.predict(before, wind, load(self.w));
            for (axis, after) in after.into_iter().enumerate() {
                after.store(&mut self.d[axis][group], 0);
                if let Some(predicted) = &mut self.predicted {
                    after.store(&mut predicted[axis][group], 0);
                }
            }
        }
    }

    #[inline(always)]
    fn pull_to_roots<W: Wide>(&mut self) {
        let count = self.w.len();
        let tethers = self.tethers.chunks_exact(TETHER_FIELDS * self.stride);
        for (slot, tether) in tethers.enumerate() {
            let field = |index: usize| lane_groups(tether, index * self.stride, count);
            let root = [field(0), field(1), field(2)];
            let (length, square) = (field(3), field(4));
            for group in 0..count {
                let load = |field: &[Lanes8]| W::load(&field[group], 0);
                let start = axes(|axis| load(self.x[axis]) - load(root[axis]));
                let before = axes(|axis| load(self.d[axis]));
                let excess = tether_excess(Tethered {
                    start,
                    displacement: before,
                    limit: RestLength { length: load(length), square: load(square) },
                    inverse_mass: load(self.w),
                });
                let Some(excess) = excess else { continue };
                for axis in 0..3 {
                    (before[axis] - excess[axis]).store(&mut self.d[axis][group], 0);
                }
                if !self.tether_pulls.is_empty() {
                    add_pulls(&mut self.tether_pulls[slot * count + group], excess);
                }
            }
        }
    }

    #[inline(always)]
    fn advance<W: Wide>(&mut self) {
        for axis in 0..3 {
            for (x, d) in self.x[axis].iter_mut().zip(self.d[axis].iter()) {
                (W::load(x, 0) + W::load(d, 0)).store(x, 0);
            }
        }
    }
}
