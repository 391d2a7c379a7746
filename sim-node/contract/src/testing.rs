//! Domains for tests.

use std::fs;
use std::process;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::endpoint::{Endpoint, NAME_DEFAULT};
use crate::ports::domain;

/// A domain that no other test has, and whose files are removed when it is dropped. Drop it after
/// everything that is in it.
#[derive(Debug)]
pub struct TestDomain {
    name: String,
}

impl TestDomain {
    /// A new domain, called after this process.
    pub fn new() -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        Self { name: format!("test-{}-{count}", process::id()) }
    }

    /// Its name, for `--domain`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The simulation of the default name in it.
    ///
    /// # Panics
    /// Never: its name is one of those allowed.
    #[allow(clippy::expect_used, reason = "the name is made of what is allowed")]
    pub fn endpoint(&self) -> Endpoint {
        Endpoint::new(Some(&self.name), NAME_DEFAULT).expect("the name of a test domain is allowed")
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
                // What another process of the domain removes meanwhile is gone as well.
                let _ = fs::remove_file(entry.path());
            }
        }
        let _ = fs::remove_dir_all(domain::directory(&self.name));
    }
}
