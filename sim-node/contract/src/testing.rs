//! Domains for tests and measurements, which exist only as long as the process that creates them.

use std::fs;
use std::ops::Deref;
use std::path::PathBuf;
use std::process;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::endpoint::{Endpoint, NAME_DEFAULT};
use crate::ports::domain;

/// A domain with a unique name, for a test or a measurement. Its files are removed when it is dropped,
/// so drop it after everything that uses it.
#[derive(Debug)]
pub struct ScratchDomain {
    name: String,
}

impl ScratchDomain {
    /// Creates a domain whose name is made of `purpose`, the process id and a counter.
    ///
    /// # Panics
    /// If `purpose` is longer than a few characters, or has one that a domain may not have.
    pub fn new(purpose: &str) -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("{purpose}-{}-{count}", process::id());
        assert!(Endpoint::new(Some(&name), NAME_DEFAULT).is_ok(), "{name} is no valid domain");
        Self { name }
    }

    /// Name of the domain, for `--domain`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Root directory of the domain.
    pub fn root(&self) -> PathBuf {
        domain::directory(&self.name)
    }

    /// Endpoint of the default simulation in this domain.
    ///
    /// # Panics
    /// Never: the name was checked.
    #[allow(clippy::expect_used, reason = "the name was checked")]
    pub fn endpoint(&self) -> Endpoint {
        Endpoint::new(Some(&self.name), NAME_DEFAULT).expect("a checked domain")
    }
}

impl Drop for ScratchDomain {
    fn drop(&mut self) {
        let prefix = domain::prefix(&self.name);
        for entry in fs::read_dir("/dev/shm").into_iter().flatten().flatten() {
            if entry.file_name().as_encoded_bytes().starts_with(prefix.as_bytes()) {
                // Another process of the domain may have removed the file first.
                let _ = fs::remove_file(entry.path());
            }
        }
        let _ = fs::remove_dir_all(self.root());
    }
}

/// A domain of one test. Drop it after everything that uses it.
#[derive(Debug)]
pub struct TestDomain(ScratchDomain);

impl TestDomain {
    /// Creates a domain with a unique name.
    pub fn new() -> Self {
        Self(ScratchDomain::new("test"))
    }
}

impl Default for TestDomain {
    fn default() -> Self {
        Self::new()
    }
}

impl Deref for TestDomain {
    type Target = ScratchDomain;

    fn deref(&self) -> &ScratchDomain {
        &self.0
    }
}
