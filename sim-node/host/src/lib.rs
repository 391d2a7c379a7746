//! A process on its host: its console, its signals, its clocks, and the files that it reads and writes.
//!
//! Programs and libraries that touch the operating system share this crate. It knows no message and no service.
#![forbid(unsafe_code)]

pub mod clock;
pub mod console;
mod file_lock;
mod mesh_format;
mod part_file;
mod signals;
mod text_file;

pub use file_lock::{is_being_written, is_in_place, is_locked, kind_of_non_file};
pub use part_file::error::{PartFileError, explain_write_error};
pub use part_file::{Existing, PartFile, part_path};
pub use signals::{Stop, report_bus_errors, report_file_size_limit};
pub use text_file::{TextFileError, read_scene_file, to_text};
