//! Hides the symbols of other crates in libcatenary.so, so that it exports only the names of its header.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-cdylib-link-arg=-Wl,--exclude-libs,ALL");
}
