//! Configuration files of iceoryx2.

use std::fs;
use std::io;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use iceoryx2::config::ConfigCreationError;
use iceoryx2::prelude::{Config, FilePath, SemanticString};
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
    /// iceoryx2 cannot read the text.
    #[error(
        "it is not a configuration of iceoryx2; IOX2_LOG_LEVEL=debug prints the line and the reason"
    )]
    Invalid,
}

impl ConfigFile {
    /// Reads a file as iceoryx2 does: a missing key has its default. Returns `None` if there is no file.
    ///
    /// # Errors
    /// The file cannot be read, or iceoryx2 would ignore it because it is invalid.
    pub fn read(path: &Path) -> Result<Option<Self>, ConfigFileError> {
        let metadata = match fs::metadata(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            metadata => metadata.map_err(|error| ConfigFileError::Unreadable(error.to_string()))?,
        };
        if !metadata.is_file() || metadata.len() > SIZE_BYTES_MAX {
            let problem = format!("it is not a file of at most {SIZE_BYTES_MAX} bytes");
            return Err(ConfigFileError::Unreadable(problem));
        }
        let name = FilePath::new(path.as_os_str().as_bytes())
            .map_err(|error| ConfigFileError::Unreadable(format!("{error:?}")))?;
        match Config::from_file(&name) {
            Ok(config) => {
                let prefix = config.global.prefix.to_string();
                Ok(Some(Self { prefix, root: root::path(&config) }))
            }
            Err(ConfigCreationError::UnableToDeserializeContents) => Err(ConfigFileError::Invalid),
            Err(error) => Err(ConfigFileError::Unreadable(format!("{error:?}"))),
        }
    }
}

/// Returns the keys of a configuration that Catenary sets, as the text of a file. iceoryx2 has defaults for
/// all other keys.
pub(crate) fn to_text(config: &Config) -> String {
    let Config { global, defaults, .. } = config;
    let (services, events) = (&defaults.publish_subscribe, &defaults.event);
    format!(
        r"[global]
root-path = {:?}
prefix = {:?}

[global.creation-timeout]
secs = {}
nanos = {}

[global.node]
cleanup-dead-nodes-on-creation = {}
cleanup-dead-nodes-on-destruction = {}

[global.service]
cleanup-dead-nodes-on-open = {}

[defaults.publish-subscribe]
max-publishers = {}
max-subscribers = {}
max-nodes = {}
subscriber-max-buffer-size = {}
subscriber-max-borrowed-samples = {}
publisher-history-size = {}

[defaults.event]
max-notifiers = {}
max-listeners = {}
max-nodes = {}
",
        root::path(config).to_string_lossy(),
        global.prefix.to_string(),
        global.creation_timeout.as_secs(),
        global.creation_timeout.subsec_nanos(),
        global.node.cleanup_dead_nodes_on_creation,
        global.node.cleanup_dead_nodes_on_destruction,
        global.service.cleanup_dead_nodes_on_open,
        services.max_publishers,
        services.max_subscribers,
        services.max_nodes,
        services.subscriber_max_buffer_size,
        services.subscriber_max_borrowed_samples,
        services.publisher_history_size,
        events.max_notifiers,
        events.max_listeners,
        events.max_nodes,
    )
}

#[cfg(test)]
mod tests {
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
        let (_scratch, path) = file_with(&outside.iceoryx2_toml());
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
            assert!(matches!(error, ConfigFileError::Invalid), "{error}");
        }
        let unreadable = ConfigFile::read(path.parent().unwrap()).unwrap_err();
        assert!(matches!(unreadable, ConfigFileError::Unreadable(_)), "{unreadable}");
    }
}
