//! Domains for tests.

use std::fs;
use std::path::PathBuf;
use std::process;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::endpoint::{Endpoint, NAME_DEFAULT};
use crate::ports::domain;

/// A domain of one test. Its files are removed when it is dropped, so drop it after everything that
/// uses it.
#[derive(Debug)]
pub struct TestDomain {
    name: String,
}

impl TestDomain {
    /// Creates a domain with a unique name, made of the process id and a counter.
    pub fn new() -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        Self { name: format!("test-{}-{count}", process::id()) }
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
    /// Never: the name consists of allowed characters.
    #[allow(clippy::expect_used, reason = "the name consists of allowed characters")]
    pub fn endpoint(&self) -> Endpoint {
        Endpoint::new(Some(&self.name), NAME_DEFAULT).expect("a test domain has a valid name")
    }
}

impl Default for TestDomain {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for TestDomain {
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
