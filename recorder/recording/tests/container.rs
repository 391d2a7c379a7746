//! The check and the repair of whole files, on small recordings in memory.

mod check;
mod fixture;
mod repair;
