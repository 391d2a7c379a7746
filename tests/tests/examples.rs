//! The examples in Rust, C and C++ and the README's commands work against a running node, and report errors
//! as text.

mod bodies;
mod c_and_cpp;
mod readme;
mod rust;
