//! Copies the state of particles to rows at the start of a step, and back at its end.

use super::{RowLayout, RowState, Rows};
use crate::kernels::lanes::{LaneWork, Lanes8, PackedParticle, Wide, axes, map_axes};
use crate::state::particles::Particle;
use crate::store::publish::{PublishedMotion, publish};
use crate::store::workers::Workers;

/// Fewest particles that a worker copies to rows: as many as one worker copies while the others wake for the step.
const UNPACKED_MIN: usize = 32_768;

/// Fewest particles that a worker writes back.
const PACKED_MIN: usize = 4096;

impl Rows {
    /// Copies the state at the start of a step, row by row, with velocities in the place of displacements.
    pub(crate) fn unpack(&mut self, states: &[Particle], workers: &mut Workers) {
        self.unpack_parts(states, workers, UNPACKED_MIN);
    }

    fn unpack_parts(&mut self, states: &[Particle], workers: &mut Workers, count_min: usize) {
        let (layout, numbers, _) = self.split_mut();
        let row_count = workers.part_length(layout.rows, count_min.div_ceil(layout.columns));
        let numbers = numbers.chunks_mut(row_count * layout.length);
        let kernels = workers.kernels;
        workers.for_each(
            numbers.zip(states.chunks(row_count * layout.columns)),
            |(numbers, states), _| kernels.run(UnpackWork { layout, numbers, states }),
            |_| {},
        );
    }

    /// Writes the state back. Returns the number of particles that froze.
    pub(crate) fn pack(&mut self, states: &mut [Particle], h: f32, workers: &mut Workers) -> u64 {
        self.pack_parts((states, h), workers, PACKED_MIN)
    }

    fn pack_parts(
        &mut self,
        (states, h): (&mut [Particle], f32),
        workers: &mut Workers,
        count_min: usize,
    ) -> u64 {
        let (layout, numbers, _) = self.split_mut();
        let row_count = workers.part_length(layout.rows, count_min.div_ceil(layout.columns));
        let numbers = numbers.chunks_mut(row_count * layout.length);
        let parts = numbers.zip(states.chunks_mut(row_count * layout.columns));
        let kernels = workers.kernels;
        let mut frozen_count = 0;
        workers.for_each(
            parts.map(|(numbers, states)| (numbers, states, 0)),
            |(numbers, states, frozen_count), _| {
                *frozen_count = kernels.run(PackWork { layout, numbers, states, h });
            },
            |(_, _, count)| frozen_count += count,
        );
        frozen_count
    }
}

struct UnpackWork<'a> {
    layout: &'a RowLayout,
    numbers: &'a mut [f32],
    states: &'a [Particle],
}

impl LaneWork for UnpackWork<'_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Self { layout, numbers, states } = self;
        let rows = numbers.chunks_exact_mut(layout.length);
        for (row, states) in rows.zip(states.chunks_exact(layout.columns)) {
            let RowState { x, w, d } = RowState::new(row, layout.stride);
            let (groups, rest) = states.as_chunks::<8>();
            for (group, states) in groups.iter().enumerate() {
                let [[x0, x1, x2, mass], [d0, d1, d2, _]] = W::columns(&packed(states));
                for (axis, number) in [x0, x1, x2].into_iter().enumerate() {
                    number.store(lane_group(x[axis], group), 0);
                }
                mass.store(lane_group(w, group), 0);
                for (axis, number) in [d0, d1, d2].into_iter().enumerate() {
                    number.store(lane_group(d[axis], group), 0);
                }
            }
            for (column, state) in (8 * groups.len()..).zip(rest) {
                for axis in 0..3 {
                    x[axis][column] = state.position[axis];
                    d[axis][column] = state.velocity[axis];
                }
                w[column] = state.inverse_mass;
            }
        }
    }
}

/// Writes rows back. The output is the number of particles that froze.
struct PackWork<'a> {
    layout: &'a RowLayout,
    numbers: &'a mut [f32],
    states: &'a mut [Particle],
    h: f32,
}

impl LaneWork for PackWork<'_> {
    type Output = u64;

    #[inline(always)]
    fn run<W: Wide>(self) -> u64 {
        let Self { layout, numbers, states, h } = self;
        let mut frozen_count = 0;
        let rows = numbers.chunks_exact_mut(layout.length);
        for (row, states) in rows.zip(states.chunks_exact_mut(layout.columns)) {
            let RowState { x, d, .. } = RowState::new(row, layout.stride);
            for (group, states) in states.chunks_mut(8).enumerate() {
                let load = |fields: &[&mut [f32]; 3]| {
                    axes(|axis| W::load(&fields[axis].as_chunks().0[group], 0))
                };
                let is_published = <&mut [_; 8]>::try_from(&mut *states)
                    .is_ok_and(|states| publish_finite::<W>(states, [load(&x), load(&d)], h));
                let rest = if is_published { &mut [] } else { states };
                for (column, state) in (8 * group..).zip(rest) {
                    let vector = |fields: &[&mut [f32]; 3]| axes(|axis| fields[axis][column]);
                    let (position, displacement) = (vector(&x), vector(&d));
                    let motion = PublishedMotion { position, displacement, h };
                    frozen_count += u64::from(publish(state, motion));
                }
            }
        }
        frozen_count
    }
}

/// The same as [`publish`] for eight particles if all of them are finite. Otherwise it changes nothing and returns false.
#[inline(always)]
fn publish_finite<W: Wide>(states: &mut [Particle; 8], [x, d]: [[W; 3]; 2], h: f32) -> bool {
    let (h, zero) = (W::splat(h), W::splat(0.0));
    let v = map_axes(d, |axis| axis / h);
    let is_finite = |axis: W| axis.abs().is_below(W::splat(f32::INFINITY));
    let [x_mask, v_mask] =
        [x, v].map(|[a, b, c]| W::both(is_finite(a), W::both(is_finite(b), is_finite(c))));
    if W::bits(W::both(x_mask, v_mask)) != 0xff {
        return false;
    }
    let mut columns = [PackedParticle::default(); 8];
    for axis in 0..3 {
        (x[axis] + zero).store(&mut columns[axis].0, 0);
        (v[axis] + zero).store(&mut columns[4 + axis].0, 0);
    }
    // Columns of columns are particles.
    let [low, high] = W::columns(&columns);
    // Inverse mass and flags.
    let is_kept = W::splat(0.5).is_below(W::load(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], 0));
    for (state, new) in states.iter_mut().zip([low, high].as_flattened()) {
        let mut numbers: Lanes8 = bytemuck::cast(*state);
        W::select(is_kept, W::load(&numbers, 0), *new).store(&mut numbers, 0);
        *state = bytemuck::cast(numbers);
    }
    true
}

/// Eight particles, aligned.
#[inline(always)]
fn packed(states: &[Particle; 8]) -> [PackedParticle; 8] {
    let mut packed = [PackedParticle::default(); 8];
    for (packed, state) in packed.iter_mut().zip(states) {
        *packed = bytemuck::cast(*state);
    }
    packed
}

/// Eight numbers of a field.
#[inline(always)]
fn lane_group(field: &mut [f32], group: usize) -> &mut Lanes8 {
    &mut field.as_chunks_mut().0[group]
}

#[cfg(test)]
mod tests {
    //! Rows against one particle after the other.
    use super::*;
    use crate::kernels::Kernels;

    const H: f32 = 0.1;
    /// Of 13 columns, five are no group of eight.
    const COLUMNS: usize = 13;

    fn states() -> Vec<Particle> {
        let number = |index: usize| ((index * 7919) % 1000) as f32 - 500.0;
        let state = |index: usize| Particle {
            position: axes(|axis| number(8 * index + axis)),
            inverse_mass: number(8 * index + 3),
            velocity: axes(|axis| number(8 * index + 4 + axis)),
            // The last one is a signalling NaN.
            flags: [0, 1, u32::MAX, 0x7f80_0001][index % 4],
        };
        (0..5 * COLUMNS).map(state).collect()
    }

    /// Rows of these states, by this number of workers.
    fn rows_of(states: &[Particle], workers: &mut Workers) -> Rows {
        let mut layout = RowLayout::new(0, [states.len() / COLUMNS, COLUMNS], 16);
        layout.set_fields(crate::store::layout::Layout::default());
        let mut rows = Rows::new(layout);
        rows.allocate();
        rows.unpack_parts(states, workers, 1);
        rows
    }

    fn place(rows: &Rows, index: usize) -> usize {
        rows.particle_index([index / COLUMNS, index % COLUMNS])
    }

    /// Packs the rows, and compares every bit with [`publish`].
    fn assert_published(rows: &mut Rows, before: &[Particle], workers: &mut Workers) -> u64 {
        let mut expected = before.to_vec();
        let mut expected_count = 0;
        for (index, state) in expected.iter_mut().enumerate() {
            let at = place(rows, index);
            let (position, displacement) = (rows.position(at), rows.displacement(at));
            let motion = PublishedMotion { position, displacement, h: H };
            expected_count += u64::from(publish(state, motion));
        }
        let mut after = before.to_vec();
        let count = rows.pack_parts((&mut after, H), workers, 1);
        let bits = bytemuck::cast_slice::<Particle, u32>;
        assert_eq!(bits(&after), bits(&expected), "{workers:?}");
        assert_eq!(count, expected_count);
        count
    }

    fn for_each_workers(mut run: impl FnMut(&mut Workers)) {
        for kernels in Kernels::available() {
            for count in [1, 2, 3] {
                run(&mut Workers::new(kernels, count));
            }
        }
    }

    #[test]
    fn rows_have_the_states_and_give_them_back() {
        for_each_workers(|workers| {
            let before = states();
            let mut rows = rows_of(&before, workers);
            for (index, state) in before.iter().enumerate() {
                let at = place(&rows, index);
                assert_eq!(rows.position(at), state.position);
                assert_eq!(rows.displacement(at), state.velocity);
                assert_eq!(rows.inverse_mass(at), state.inverse_mass);
            }
            let (at, other) = (place(&rows, 1), place(&rows, 17));
            rows.set_position(at, [-0.0, 1.0, -0.0]);
            rows.set_displacement(other, [1.0, -0.0, 0.0]);
            assert_eq!(assert_published(&mut rows, &before, workers), 0);
        });
    }

    #[test]
    fn a_particle_freezes_if_any_number_is_not_finite_or_its_velocity_overflows() {
        for_each_workers(|workers| {
            let before = states();
            for (index, bad) in [
                (0, [f32::NAN, f32::NAN]),
                (9, [f32::INFINITY, f32::NEG_INFINITY]),
                // Not finite as a velocity alone.
                (38, [f32::INFINITY, 1e38]),
            ] {
                for field in 0..6 {
                    let mut rows = rows_of(&before, workers);
                    let at = place(&rows, index);
                    let mut vectors = [rows.position(at), rows.displacement(at)];
                    vectors[field / 3][field % 3] = bad[field / 3];
                    rows.set_position(at, vectors[0]);
                    rows.set_displacement(at, vectors[1]);
                    let count = assert_published(&mut rows, &before, workers);
                    assert_eq!(count, 1, "{index}, {field}");
                }
            }
        });
    }
}
