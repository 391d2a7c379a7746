//! Where a simulation is found: a domain of the host and a name within it.

use std::fmt;

use thiserror::Error;

/// The name of a simulation unless told otherwise.
pub const NAME_DEFAULT: &str = "sim";
/// The environment variable that stands for `--domain`.
pub const DOMAIN_VARIABLE: &str = "CATENARY_DOMAIN";

/// Longest name of a domain, in characters: it is part of a socket path of at most 107 bytes.
const DOMAIN_LENGTH_MAX: usize = 24;
/// Longest name of a simulation, in characters: service names hold 255.
const NAME_LENGTH_MAX: usize = 64;

/// The address of a simulation: a domain and a name. Programs meet where both are equal.
///
/// The default domain is iceoryx2's own configuration, so `iox2 service list` shows the services.
/// A named domain is separate from it and from every other one: its processes and files are not
/// seen elsewhere. Joining either sets the log level of iceoryx2 to errors, unless the variable
/// `IOX2_LOG_LEVEL` says otherwise.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Endpoint {
    domain: Option<String>,
    name: String,
}

/// Why an endpoint was refused.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum EndpointError {
    /// The domain is empty, too long, or has a character that file names should not have.
    #[error(
        "'{domain}' is no name of a domain (allowed: 1 to {DOMAIN_LENGTH_MAX} of a-z, 0-9, '_', '-')"
    )]
    Domain {
        /// What was given.
        domain: String,
    },
    /// The name is empty, too long, or has a character that service names should not have.
    #[error(
        "'{name}' is no name of a simulation (allowed: 1 to {NAME_LENGTH_MAX} of A-Z, a-z, 0-9, '_', '-', '.')"
    )]
    Name {
        /// What was given.
        name: String,
    },
    /// An option stands at the end of the command line, without its value.
    #[error("{option} needs a value (for example {option} {example})")]
    MissingValue {
        /// `--domain` or `--name`.
        option: &'static str,
        /// A value that would be accepted.
        example: &'static str,
    },
}

impl Default for Endpoint {
    fn default() -> Self {
        Self { domain: None, name: NAME_DEFAULT.to_owned() }
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.domain {
            Some(domain) => write!(formatter, "'{}' in domain '{domain}'", self.name),
            None => write!(formatter, "'{}' in the default domain", self.name),
        }
    }
}

impl Endpoint {
    /// The simulation `name` in `domain`; `None` is iceoryx2's own domain.
    ///
    /// # Errors
    /// A domain that is not 1 to 24 of `a-z 0-9 _ -`, a name that is not 1 to 64 of
    /// `A-Z a-z 0-9 _ - .`.
    pub fn new(domain: Option<&str>, name: &str) -> Result<Self, EndpointError> {
        if let Some(domain) = domain
            && !is_domain(domain)
        {
            return Err(EndpointError::Domain { domain: domain.to_owned() });
        }
        if !is_name(name) {
            return Err(EndpointError::Name { name: name.to_owned() });
        }
        Ok(Self { domain: domain.map(str::to_owned), name: name.to_owned() })
    }

    /// As [`Endpoint::new`], of the options `--domain` and `--name` of a program: there an empty
    /// domain, as an empty variable gives it, counts as absent.
    ///
    /// # Errors
    /// As [`Endpoint::new`].
    pub fn from_options(domain: Option<&str>, name: &str) -> Result<Self, EndpointError> {
        Self::new(domain.filter(|domain| !domain.is_empty()), name)
    }

    /// The value of an option `--domain`, if it is one.
    ///
    /// # Errors
    /// As [`Endpoint::from_options`].
    pub fn parse_domain(text: &str) -> Result<String, EndpointError> {
        Self::from_options(Some(text), NAME_DEFAULT).map(|_| text.to_owned())
    }

    /// The value of an option `--name`, if it is one.
    ///
    /// # Errors
    /// As [`Endpoint::new`].
    pub fn parse_name(text: &str) -> Result<String, EndpointError> {
        Self::new(None, text).map(|_| text.to_owned())
    }

    /// Reads `--domain` and `--name` from the command line and `CATENARY_DOMAIN` from the
    /// environment (the option wins, and an empty variable counts as absent). Also returns the
    /// other arguments, in order and without the program's name. For programs that are too small
    /// for an argument parser.
    ///
    /// # Errors
    /// As [`Endpoint::new`], or an option without its value.
    pub fn from_env_and_args() -> Result<(Self, Vec<String>), EndpointError> {
        Self::parse(std::env::var(DOMAIN_VARIABLE).ok(), std::env::args().skip(1))
    }

    fn parse(
        variable: Option<String>,
        mut arguments: impl Iterator<Item = String>,
    ) -> Result<(Self, Vec<String>), EndpointError> {
        let mut domain = variable.filter(|domain| !domain.is_empty());
        let mut name = None;
        let mut others = Vec::new();
        while let Some(argument) = arguments.next() {
            let (option, value) = match argument.split_once('=') {
                Some((option, value)) => (option, Some(value.to_owned())),
                None => (argument.as_str(), None),
            };
            let mut required = |option, example| {
                value
                    .clone()
                    .or_else(|| arguments.next())
                    .ok_or(EndpointError::MissingValue { option, example })
            };
            match option {
                "--domain" => domain = Some(required("--domain", "lab")?),
                "--name" => name = Some(required("--name", NAME_DEFAULT)?),
                _ => others.push(argument),
            }
        }
        let endpoint = Self::new(domain.as_deref(), name.as_deref().unwrap_or(NAME_DEFAULT))?;
        Ok((endpoint, others))
    }

    /// The name of the simulation; its services are called `<name>/...`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The domain; `None` is iceoryx2's own.
    pub fn domain(&self) -> Option<&str> {
        self.domain.as_deref()
    }

    /// The options that lead another program here, for messages.
    pub(crate) fn options(&self) -> String {
        let domain = self.domain.iter().map(|domain| format!(" --domain {domain}"));
        let name = (self.name != NAME_DEFAULT).then(|| format!(" --name {}", self.name));
        domain.chain(name).collect()
    }
}

fn is_domain(domain: &str) -> bool {
    let is_allowed = |byte: u8| matches!(byte, b'a'..=b'z' | b'0'..=b'9' | b'_' | b'-');
    (1..=DOMAIN_LENGTH_MAX).contains(&domain.len()) && domain.bytes().all(is_allowed)
}

fn is_name(name: &str) -> bool {
    let is_allowed = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-' | b'.');
    (1..=NAME_LENGTH_MAX).contains(&name.len()) && name.bytes().all(is_allowed)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(
        variable: Option<&str>,
        arguments: &[&str],
    ) -> Result<(Endpoint, Vec<String>), EndpointError> {
        let arguments = arguments.iter().map(|argument| (*argument).to_owned());
        Endpoint::parse(variable.map(str::to_owned), arguments)
    }

    #[test]
    fn the_default_is_sim_in_the_domain_of_iceoryx2() {
        assert_eq!(parse(None, &[]).unwrap().0, Endpoint::default());
        assert_eq!(Endpoint::default().to_string(), "'sim' in the default domain");
        assert_eq!(Endpoint::default().options(), "");
    }

    #[test]
    fn options_are_taken_out_of_the_arguments_wherever_they_stand() {
        let (endpoint, others) =
            parse(None, &["7", "--domain", "lab", "--name=left", "x"]).unwrap();
        assert_eq!(endpoint, Endpoint::new(Some("lab"), "left").unwrap());
        assert_eq!(others, ["7", "x"]);
        assert_eq!(endpoint.options(), " --domain lab --name left");
        assert_eq!(endpoint.to_string(), "'left' in domain 'lab'");
    }

    #[test]
    fn the_variable_gives_the_domain_and_the_option_wins_over_it() {
        assert_eq!(parse(Some("lab"), &[]).unwrap().0.domain(), Some("lab"));
        assert_eq!(parse(Some("lab"), &["--domain", "home"]).unwrap().0.domain(), Some("home"));
        assert_eq!(parse(Some(""), &[]).unwrap().0.domain(), None);
    }

    #[test]
    fn wrong_names_are_refused_with_what_is_allowed() {
        let long = "x".repeat(25);
        for domain in ["", "Lab", "a/b", "..", "a b", "é", long.as_str()] {
            let error = Endpoint::new(Some(domain), "sim").unwrap_err().to_string();
            assert!(error.contains("1 to 24 of a-z, 0-9, '_', '-'"), "{error}");
        }
        let long = "x".repeat(65);
        for name in ["", "a/b", "a b", "é", "a\0", long.as_str()] {
            let error = Endpoint::new(None, name).unwrap_err().to_string();
            assert!(error.contains("1 to 64 of A-Z, a-z, 0-9, '_', '-', '.'"), "{error}");
        }
    }

    #[test]
    fn an_option_without_its_value_is_an_error() {
        let error = parse(None, &["--domain"]).unwrap_err().to_string();
        assert_eq!(error, "--domain needs a value (for example --domain lab)");
    }
}
