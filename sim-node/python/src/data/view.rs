//! NumPy arrays that view particles without a copy.

use bytemuck::cast_slice;
use numpy::ndarray::{ArrayView1, ArrayView2, Dimension, s};
use numpy::npyffi::NPY_ARRAY_WRITEABLE;
use numpy::{PyArray, PyArray1, PyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use sim_contract::ParticleState;

use crate::data::snapshot::Snapshot;

/// Number of 4-byte fields of a particle.
const FIELDS: usize = size_of::<ParticleState>() / 4;

/// Returns the particles of a snapshot, which the caller must not use after the owner is dropped.
fn particles<'py>(owner: &Bound<'py, Snapshot>) -> PyResult<&'py [ParticleState]> {
    let particles: *const [ParticleState] = owner.get().with_particles(std::ptr::from_ref)?;
    // SAFETY: the owner holds the particles, in one place and unchanged, until it is dropped. No lock is
    // held while NumPy runs code of Python.
    Ok(unsafe { &*particles })
}

/// Returns the first of three fields of each particle as a read-only array of the shape (particles, 3).
pub(crate) fn vectors<'py>(
    owner: &Bound<'py, Snapshot>,
    field: usize,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let particles = particles(owner)?;
    let fields = ArrayView2::from_shape((particles.len(), FIELDS), cast_slice(particles))
        .unwrap_or_else(|_| unreachable!("a particle has {FIELDS} fields"));
    let vectors = fields.slice(s![.., field..field + 3]);
    // SAFETY: the array holds the owner, which holds the particles.
    let array = unsafe { PyArray2::borrow_from_array(&vectors, owner.clone().into_any()) };
    Ok(read_only(array))
}

/// Returns a field of each particle as a read-only array of the shape (particles,).
pub(crate) fn numbers<'py, T: numpy::Element + bytemuck::AnyBitPattern>(
    owner: &Bound<'py, Snapshot>,
    field: usize,
) -> PyResult<Bound<'py, PyArray1<T>>> {
    let fields: ArrayView1<'_, T> = ArrayView1::from(cast_slice(particles(owner)?));
    // A scene may have no particle.
    let field = field.min(fields.len());
    let numbers = fields.slice(s![field..;FIELDS]);
    // SAFETY: the array holds the owner, which holds the particles.
    let array = unsafe { PyArray1::borrow_from_array(&numbers, owner.clone().into_any()) };
    Ok(read_only(array))
}

/// Forbids writing. NumPy does not let a program undo this, because the array does not own its memory. A write
/// would end the process: the memory is mapped for reading only.
fn read_only<T: numpy::Element, D: Dimension>(
    array: Bound<'_, PyArray<T, D>>,
) -> Bound<'_, PyArray<T, D>> {
    // SAFETY: the array was made just now, so nothing else uses it.
    let array_object = unsafe { &mut *array.as_array_ptr() };
    array_object.fields.flags &= !NPY_ARRAY_WRITEABLE;
    array
}
