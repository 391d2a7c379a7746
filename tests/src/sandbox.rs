//! A domain and a scratch folder for one test, removed after it.

use std::fs;
use std::path::PathBuf;

use sim_contract::Endpoint;
use sim_contract::testing::TestDomain;

use crate::signals;

/// A domain that no other test uses, and a folder for files. Dropping it removes both.
#[derive(Debug)]
pub struct Sandbox {
    domain: TestDomain,
    folder: PathBuf,
}

impl Default for Sandbox {
    fn default() -> Self {
        Self::new()
    }
}

impl Sandbox {
    /// Creates a domain and an empty folder.
    ///
    /// # Panics
    /// If the folder cannot be created.
    pub fn new() -> Self {
        signals::receive_in_programs();
        let domain = TestDomain::new();
        let folder = std::env::temp_dir().join(format!("catenary-{}", domain.name()));
        fs::create_dir_all(&folder).expect("a scratch folder");
        Self { domain, folder }
    }

    /// Returns the name of the domain, for `--domain`.
    pub fn domain(&self) -> &str {
        self.domain.name()
    }

    /// Returns the endpoint of a node with the default name.
    pub fn endpoint(&self) -> Endpoint {
        self.domain.endpoint()
    }

    /// Returns the root directory of the domain.
    pub fn root(&self) -> PathBuf {
        self.domain.root()
    }

    /// Returns a path in the folder, as text for command lines.
    ///
    /// # Panics
    /// If the path of the temporary folder is not UTF-8.
    pub fn path(&self, file: &str) -> String {
        self.folder.join(file).to_str().expect("a path in UTF-8").to_owned()
    }

    /// Writes a file into the folder and returns its path.
    ///
    /// # Panics
    /// If the file cannot be written.
    pub fn write(&self, file: &str, content: &str) -> String {
        let path = self.path(file);
        fs::write(&path, content).expect("a scratch file");
        path
    }
}

impl Drop for Sandbox {
    fn drop(&mut self) {
        // A failure to clean up does not fail the test.
        let _left = fs::remove_dir_all(&self.folder);
    }
}
