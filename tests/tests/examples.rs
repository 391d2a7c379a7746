//! The examples in Rust, C and C++ and the commands of the pages in `docs` work against a running node, and report errors
//! as text.

mod bodies;
mod c_and_cpp;
mod docs;
mod rust;
