//! Names of numbers in messages.

use std::ffi::{CString, c_char};
use std::sync::OnceLock;

use sim_contract::{PARAMETERS, Reason};

/// Returns a text that lives as long as the process.
fn static_text(names: &'static OnceLock<Vec<CString>>, index: Option<usize>) -> *const c_char {
    let name = index.and_then(|index| names.get()?.get(index));
    name.map_or(c"unknown", CString::as_c_str).as_ptr()
}

/// Returns the name of a reason, such as `not_grabbed`; "unknown" for another number. It is valid as long
/// as the process.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_reason_name(reason: u32) -> *const c_char {
    static NAMES: OnceLock<Vec<CString>> = OnceLock::new();
    NAMES.get_or_init(|| names(Reason::ALL.into_iter().map(Reason::name)));
    let index = Reason::ALL.iter().position(|one| *one as u32 == reason);
    static_text(&NAMES, index)
}

/// Returns the name of a parameter, such as "gravity"; "unknown" for another number. It is valid as long
/// as the process.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_parameter_name(parameter: u32) -> *const c_char {
    static NAMES: OnceLock<Vec<CString>> = OnceLock::new();
    NAMES.get_or_init(|| names(PARAMETERS.iter().map(|info| info.name)));
    static_text(&NAMES, usize::try_from(parameter).ok())
}

fn names(names: impl Iterator<Item = &'static str>) -> Vec<CString> {
    names.map(|name| CString::new(name).unwrap_or_default()).collect()
}
