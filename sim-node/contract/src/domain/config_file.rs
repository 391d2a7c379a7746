//! Configuration files of iceoryx2.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use iceoryx2::prelude::Config;
use thiserror::Error;

use crate::ports::domain::root;

/// Longest configuration file to read, in bytes: a complete one has less than 4 KiB.
const SIZE_BYTES_MAX: u64 = 1 << 20;

/// The part of a configuration file of iceoryx2 that decides which services its readers see.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConfigFile {
    /// Prefix of all files.
    pub prefix: String,
    /// Root directory.
    pub root: PathBuf,
}

/// Error of a configuration file of iceoryx2.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ConfigFileError {
    /// The file cannot be read.
    #[error("it cannot be read: {0}")]
    Unreadable(String),
    /// The text is no configuration.
    #[error("it is not a configuration of iceoryx2: {0}")]
    Invalid(String),
}

impl ConfigFile {
    /// Reads a file as iceoryx2 does: a missing key has its default. Returns `None` if there is no file.
    ///
    /// # Errors
    /// The file cannot be read, or iceoryx2 would ignore it because it is invalid.
    pub fn read(path: &Path) -> Result<Option<Self>, ConfigFileError> {
        let unreadable = |error: io::Error| ConfigFileError::Unreadable(error.to_string());
        let file = match File::open(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            file => file.map_err(unreadable)?,
        };
        let mut text = String::new();
        file.take(SIZE_BYTES_MAX).read_to_string(&mut text).map_err(unreadable)?;
        let config: Config = toml::from_str(&text)
            .map_err(|error| ConfigFileError::Invalid(error.message().to_owned()))?;
        let prefix = config.global.prefix.to_string();
        Ok(Some(Self { prefix, root: root::path(&config) }))
    }
}

/// Returns a configuration as the text of a file.
pub(crate) fn to_text(config: &Config) -> Result<String, ConfigFileError> {
    toml::to_string(config).map_err(|error| ConfigFileError::Invalid(error.to_string()))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use iceoryx2::prelude::{FilePath, SemanticString};

    use super::*;
    use crate::domain::Domain;
    use crate::ports::domain;
    use crate::testing::TestDomain;

    /// A file in the root of a domain, and the domain.
    fn file_with(text: &str) -> (TestDomain, PathBuf) {
        let domain = TestDomain::new();
        let _root = root::prepare(&domain.root()).unwrap();
        let path = domain.root().join("iceoryx2.toml");
        fs::write(&path, text).unwrap();
        (domain, path)
    }

    #[test]
    fn iceoryx2_reads_the_printed_text_as_the_configuration_of_the_domain() {
        let outside = Domain::new(&TestDomain::new().endpoint()).unwrap();
        let (_scratch, path) = file_with(&outside.iceoryx2_toml().unwrap());
        let name = FilePath::new(path.to_str().unwrap().as_bytes()).unwrap();
        let loaded = Config::from_file(&name).unwrap();
        assert_eq!(loaded, outside.config);
        let read = ConfigFile::read(&path).unwrap().unwrap();
        assert_eq!(read, ConfigFile { prefix: outside.prefix(), root: outside.root() });
        // A text that the default would equal proves nothing.
        assert_ne!(loaded.global, domain::configuration(None).unwrap().global);
    }

    #[test]
    fn a_missing_key_has_its_default_and_an_invalid_file_is_an_error() {
        let (_scratch, path) = file_with("[global]\nprefix = \"x_\"\n");
        let read = ConfigFile::read(&path).unwrap().unwrap();
        assert_eq!((read.prefix.as_str(), read.root), ("x_", PathBuf::from("/tmp/iceoryx2/")));
        assert_eq!(ConfigFile::read(&path.with_extension("none")), Ok(None));
        for text in ["[global]\nprefix = 3\n", "prefix ="] {
            let (_scratch, path) = file_with(text);
            let error = ConfigFile::read(&path).unwrap_err();
            assert!(matches!(error, ConfigFileError::Invalid(_)), "{error}");
        }
        let unreadable = ConfigFile::read(path.parent().unwrap()).unwrap_err();
        assert!(matches!(unreadable, ConfigFileError::Unreadable(_)), "{unreadable}");
    }
}
