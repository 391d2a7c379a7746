//! Domains for tests.

use std::ops::Deref;

use crate::scratch_domain::ScratchDomain;

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
