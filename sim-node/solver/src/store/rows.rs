//! Particles in rows.
//!
//! A row is a sequence of fields of equal length: x, y, z of the positions, the inverse masses, x, y, z of the
//! displacements, then fields that only some scenes have. Its constraints follow. So a constraint between two
//! rows, or between two parts of one, combines eight columns with eight others, without indices.

pub(crate) mod ends;
mod forces;
mod layout;
mod measure;
pub(crate) mod particles;
pub(crate) mod paths;
mod states;

pub(crate) use forces::RowForces;
pub(crate) use layout::{LINE_LENGTH, RowLayout, STATE_FIELDS};

use crate::kernels::huge_pages::refill;
use crate::kernels::lanes::axes;

/// Memory in whole cache lines.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
struct CacheLine([f32; LINE_LENGTH]);

/// Rows in memory.
#[derive(Debug, Clone)]
pub(crate) struct Rows {
    pub(crate) layout: RowLayout,
    lines: Vec<CacheLine>,
    pub(crate) forces: RowForces,
}

/// The state fields of a row.
pub(crate) struct RowState<'a> {
    pub(crate) x: [&'a mut [f32]; 3],
    pub(crate) w: &'a mut [f32],
    pub(crate) d: [&'a mut [f32]; 3],
}

impl<'a> RowState<'a> {
    fn new(row: &'a mut [f32], stride: usize) -> Self {
        let mut rest = row;
        let mut next = || {
            let (field, others) = std::mem::take(&mut rest).split_at_mut(stride);
            rest = others;
            field
        };
        let x = [next(), next(), next()];
        Self { x, w: next(), d: [next(), next(), next()] }
    }
}

impl Rows {
    /// Makes rows without memory.
    pub(crate) fn new(layout: RowLayout) -> Self {
        Self { layout, lines: Vec::new(), forces: RowForces::default() }
    }

    /// Allocates the fields of the layout. All numbers are 0 afterwards, and no particle has a tether.
    pub(crate) fn allocate(&mut self) {
        let RowLayout { rows, length, stride, .. } = self.layout;
        refill(&mut self.lines, rows * length / LINE_LENGTH, CacheLine([0.0; LINE_LENGTH]));
        for slot in 0..self.layout.fields.scene.tethers {
            for row in 0..rows {
                for column in 0..stride {
                    let index = self.particle_index([row, column]);
                    self.set_tether_length(index, slot, f32::INFINITY);
                }
            }
        }
    }

    pub(crate) fn numbers(&self) -> &[f32] {
        bytemuck::cast_slice(&self.lines)
    }

    pub(crate) fn numbers_mut(&mut self) -> &mut [f32] {
        bytemuck::cast_slice_mut(&mut self.lines)
    }

    /// The layout, all numbers, and the forces.
    pub(crate) fn split_mut(&mut self) -> (&RowLayout, &mut [f32], &mut RowForces) {
        let Self { layout, lines, forces } = self;
        (layout, bytemuck::cast_slice_mut(lines), forces)
    }

    /// The state of a row.
    pub(crate) fn state_mut(&mut self, row: usize) -> RowState<'_> {
        let RowLayout { length, stride, .. } = self.layout;
        RowState::new(&mut self.numbers_mut()[row * length..][..length], stride)
    }

    /// Index, among all numbers, of the x position of a particle.
    pub(crate) fn particle_index(&self, [row, column]: [usize; 2]) -> usize {
        row * self.layout.length + column
    }

    /// Where the x displacement of a particle is among all numbers.
    pub(crate) fn displacement_place(&self, index: usize) -> usize {
        index + 4 * self.layout.stride
    }

    /// Vector of a particle in fields `field`, `field` + 1 and `field` + 2.
    #[inline(always)]
    fn vector(&self, index: usize, field: usize) -> [f32; 3] {
        let numbers = self.numbers();
        axes(|axis| numbers[index + (field + axis) * self.layout.stride])
    }

    fn set_vector(&mut self, index: usize, field: usize, vector: [f32; 3]) {
        let stride = self.layout.stride;
        let numbers = self.numbers_mut();
        for (axis, value) in vector.into_iter().enumerate() {
            numbers[index + (field + axis) * stride] = value;
        }
    }

    #[inline(always)]
    pub(crate) fn position(&self, index: usize) -> [f32; 3] {
        self.vector(index, 0)
    }

    #[inline(always)]
    pub(crate) fn inverse_mass(&self, index: usize) -> f32 {
        self.numbers()[index + 3 * self.layout.stride]
    }

    #[inline(always)]
    pub(crate) fn displacement(&self, index: usize) -> [f32; 3] {
        self.vector(index, 4)
    }

    /// Displacement before any constraint or contact; 0 in a scene without bounces.
    pub(crate) fn predicted(&self, index: usize) -> [f32; 3] {
        let has_bounces = self.layout.fields.scene.bounces;
        if has_bounces { self.vector(index, STATE_FIELDS) } else { [0.0; 3] }
    }

    pub(crate) fn set_position(&mut self, index: usize, position: [f32; 3]) {
        self.set_vector(index, 0, position);
    }

    pub(crate) fn set_displacement(&mut self, index: usize, displacement: [f32; 3]) {
        self.set_vector(index, 4, displacement);
    }

    /// Sets the position of a tether's root at the end of the substep.
    pub(crate) fn set_root(&mut self, index: usize, slot: usize, root: [f32; 3]) {
        self.set_vector(index, self.layout.root_at(slot), root);
    }

    /// Sets the length of a tether; infinite for no tether.
    pub(crate) fn set_tether_length(&mut self, index: usize, slot: usize, length: f32) {
        let stride = self.layout.stride;
        let at = index + (self.layout.root_at(slot) + 3) * stride;
        let numbers = self.numbers_mut();
        (numbers[at], numbers[at + stride]) = (length, length * length);
    }
}
