//! The arguments of a C program: pointers, texts and times.

use std::ffi::{CStr, c_char};
use std::mem::MaybeUninit;
use std::slice;
use std::time::Duration;

use crate::outcome::Failure;

/// Copies a text of the program; `None` for a null pointer.
pub(crate) fn text(pointer: *const c_char, name: &str) -> Result<Option<String>, Failure> {
    if pointer.is_null() {
        return Ok(None);
    }
    // SAFETY: the header asks for null, or a text that ends with a zero byte.
    let text = unsafe { CStr::from_ptr(pointer) };
    let text = text.to_str().map_err(|_| Failure::misuse(format!("{name} is not UTF-8")))?;
    Ok(Some(text.to_owned()))
}

/// Copies the numbers of a vector or quaternion; `None` for a null pointer.
pub(crate) fn numbers<const N: usize>(pointer: *const f32) -> Option<[f32; N]> {
    if pointer.is_null() {
        return None;
    }
    // SAFETY: the header asks for null, or N numbers. Nothing else writes them during the call.
    Some(unsafe { pointer.cast::<[f32; N]>().read_unaligned() })
}

/// Borrows an array of the program for the duration of a call. It may be null if it is empty.
pub(crate) fn array<'a, T>(
    pointer: *const T,
    count: usize,
    name: &str,
) -> Result<&'a [T], Failure> {
    if count == 0 {
        return Ok(&[]);
    }
    let is_valid = !pointer.is_null() && pointer.is_aligned();
    if !is_valid || count > isize::MAX as usize / size_of::<T>().max(1) {
        return Err(Failure::misuse(format!(
            "{name} is null or misaligned, or its count is wrong"
        )));
    }
    // SAFETY: the header asks for `count` elements that nothing else writes during the call.
    Ok(unsafe { slice::from_raw_parts(pointer, count) })
}

/// Writes a value to a place of the program.
pub(crate) fn write<T>(
    place: Option<&mut MaybeUninit<T>>,
    value: T,
    name: &str,
) -> Result<(), Failure> {
    place.ok_or_else(|| null(name))?.write(value);
    Ok(())
}

/// Returns an error unless there is a place to write to. For checks before a call has an effect.
pub(crate) fn check_place<T>(place: Option<&MaybeUninit<T>>, name: &str) -> Result<(), Failure> {
    place.map(|_| ()).ok_or_else(|| null(name))
}

fn null(name: &str) -> Failure {
    Failure::misuse(format!("{name} is null"))
}

/// Converts a timeout.
pub(crate) fn timeout(seconds: f64) -> Result<Duration, Failure> {
    Duration::try_from_secs_f64(seconds).map_err(|_| {
        Failure::misuse(format!("{seconds} is no timeout (allowed: finite seconds, 0 or more)"))
    })
}
