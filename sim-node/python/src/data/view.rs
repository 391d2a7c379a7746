//! NumPy arrays that view particles without a copy.

use bytemuck::cast_slice;
use numpy::ndarray::{ArrayView1, ArrayView2, s};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use sim_contract::ParticleState;

use crate::data::snapshot::Snapshot;

/// Number of 4-byte fields of a particle.
const FIELDS: usize = size_of::<ParticleState>() / 4;

/// Returns the first of three fields of each particle as a read-only array of the shape (particles, 3).
pub(crate) fn vectors<'py>(
    owner: &Bound<'py, Snapshot>,
    field: usize,
) -> Bound<'py, PyArray2<f32>> {
    let snapshot = owner.get();
    let memory = snapshot.memory();
    let particles = memory.particles();
    let fields = ArrayView2::from_shape((particles.len(), FIELDS), cast_slice(particles))
        .unwrap_or_else(|_| unreachable!("a particle has {FIELDS} fields"));
    let vectors = fields.slice(s![.., field..field + 3]);
    // SAFETY: the owner holds the particles, in one place and unchanged, until it is dropped, and the
    // array holds the owner.
    let array = unsafe { PyArray2::borrow_from_array(&vectors, owner.clone().into_any()) };
    // NumPy does not let a program undo this, because the array does not own its memory. A write would
    // end the process: the memory is mapped for reading only.
    array.readwrite().make_nonwriteable();
    array
}

/// Returns a field of each particle as a read-only array of the shape (particles,).
pub(crate) fn numbers<'py, T: numpy::Element + bytemuck::AnyBitPattern>(
    owner: &Bound<'py, Snapshot>,
    field: usize,
) -> Bound<'py, PyArray1<T>> {
    let snapshot = owner.get();
    let memory = snapshot.memory();
    let particles = memory.particles();
    let fields: ArrayView1<'_, T> = ArrayView1::from(cast_slice(particles));
    let numbers = fields.slice(s![field..;FIELDS]);
    // SAFETY: the owner holds the particles, in one place and unchanged, until it is dropped, and the
    // array holds the owner.
    let array = unsafe { PyArray1::borrow_from_array(&numbers, owner.clone().into_any()) };
    // As above.
    array.readwrite().make_nonwriteable();
    array
}
