//! The crates can be packaged, and completion scripts, man pages and units of systemd agree with the
//! programs.

mod crates;
mod documents;
mod release;
mod units;
