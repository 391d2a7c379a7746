//! The process of a program: its signals and its output streams.

pub(crate) mod bus_error;
pub mod console;
pub(crate) mod file_size;
pub(crate) mod stop;
