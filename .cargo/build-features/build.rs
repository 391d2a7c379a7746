//! Does nothing: Cargo counts build dependencies only of packages with a build script.

fn main() {}
