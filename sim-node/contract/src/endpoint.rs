//! Address of a simulation: a domain of the host and a name within it.

use std::fmt;

use thiserror::Error;

/// Default name of a node.
pub const NAME_DEFAULT: &str = "sim";
/// Environment variable that replaces an absent `--domain`.
pub const DOMAIN_VARIABLE: &str = "CATENARY_DOMAIN";

/// Longest name of a domain, in characters: it is part of a socket path of at most 107 bytes.
const DOMAIN_LENGTH_MAX: usize = 24;
/// Longest name of a node, in characters: service names hold 255.
const NAME_LENGTH_MAX: usize = 64;

/// The address of a simulation: a domain and a name. Programs meet where both are equal.
///
/// The default domain is iceoryx2's own configuration, so `iox2 service list` shows the services.
/// A named domain is separate from it and from every other domain: its processes and files are
/// visible nowhere else. Joining a domain sets the log level of iceoryx2 to errors, unless the
/// variable `IOX2_LOG_LEVEL` sets another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Endpoint {
    domain: Option<String>,
    name: String,
}

/// Reason why an endpoint is refused.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum EndpointError {
    /// The domain is empty, too long, or contains a character that is not allowed in it.
    #[error(
        "'{domain}' is not a valid domain (allowed: 1 to {DOMAIN_LENGTH_MAX} characters of a-z, 0-9, '_', '-')"
    )]
    Domain {
        /// The refused domain.
        domain: String,
    },
    /// The environment variable [`DOMAIN_VARIABLE`] holds an invalid domain, and no option overrides
    /// it.
    #[error(
        "the environment variable {DOMAIN_VARIABLE} is '{domain}', which is not a valid domain \
         (allowed: 1 to {DOMAIN_LENGTH_MAX} characters of a-z, 0-9, '_', '-')"
    )]
    Variable {
        /// Value of the variable.
        domain: String,
    },
    /// The name is empty, too long, or contains a character that is not allowed in it.
    #[error(
        "'{name}' is not a valid name of a node (allowed: 1 to {NAME_LENGTH_MAX} characters of A-Z, a-z, 0-9, '_', '-', '.')"
    )]
    Name {
        /// The refused name.
        name: String,
    },
    /// An option ends the command line without its value.
    #[error("{option} needs a value (for example {option} {example})")]
    MissingValue {
        /// `--domain` or `--name`.
        option: &'static str,
        /// An acceptable value.
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
    /// Returns the endpoint of the simulation `name` in `domain`; `None` is iceoryx2's own domain.
    ///
    /// # Errors
    /// The domain is not 1 to 24 characters of `a-z 0-9 _ -`, or the name is not 1 to 64 characters of
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

    /// Returns the endpoint for the options `--domain` and `--name` of a program. Without `--domain`, the
    /// environment variable [`DOMAIN_VARIABLE`] gives the domain. An empty variable stands
    /// for iceoryx2's own domain.
    ///
    /// # Errors
    /// Same as [`Endpoint::new`], or the environment variable is not a valid domain.
    pub fn from_options(domain: Option<&str>, name: Option<&str>) -> Result<Self, EndpointError> {
        Self::resolve(domain, domain_variable().as_deref(), name)
    }

    fn resolve(
        domain: Option<&str>,
        variable: Option<&str>,
        name: Option<&str>,
    ) -> Result<Self, EndpointError> {
        if let (None, Some(domain)) = (domain, variable)
            && !(domain.is_empty() || is_domain(domain))
        {
            return Err(EndpointError::Variable { domain: domain.to_owned() });
        }
        let domain = domain.or(variable.filter(|domain| !domain.is_empty()));
        Self::new(domain, name.unwrap_or(NAME_DEFAULT))
    }

    /// Parses the value of an option `--domain`.
    ///
    /// # Errors
    /// Same as [`Endpoint::new`].
    pub fn parse_domain(text: &str) -> Result<String, EndpointError> {
        Self::new(Some(text), NAME_DEFAULT).map(|_| text.to_owned())
    }

    /// Parses the value of an option `--name`.
    ///
    /// # Errors
    /// Same as [`Endpoint::new`].
    pub fn parse_name(text: &str) -> Result<String, EndpointError> {
        Self::new(None, text).map(|_| text.to_owned())
    }

    /// Reads `--domain` and `--name` from the command line, with the rules of
    /// [`Endpoint::from_options`]. Also returns the other arguments in order, without the program's
    /// name. For programs too small for an argument parser.
    ///
    /// # Errors
    /// Same as [`Endpoint::from_options`], or an option without its value.
    pub fn from_env_and_args() -> Result<(Self, Vec<String>), EndpointError> {
        Self::parse(domain_variable().as_deref(), std::env::args().skip(1))
    }

    fn parse(
        variable: Option<&str>,
        mut arguments: impl Iterator<Item = String>,
    ) -> Result<(Self, Vec<String>), EndpointError> {
        let (mut domain, mut name) = (None, None);
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
        Ok((Self::resolve(domain.as_deref(), variable, name.as_deref())?, others))
    }

    /// Name of the node; its services are called `<name>/...`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Domain of the simulation; `None` is iceoryx2's own.
    pub fn domain(&self) -> Option<&str> {
        self.domain.as_deref()
    }

    /// Options that give another program this endpoint, for messages.
    pub fn options(&self) -> String {
        let domain = self.domain.iter().map(|domain| format!(" --domain {domain}"));
        let name = (self.name != NAME_DEFAULT).then(|| format!(" --name {}", self.name));
        domain.chain(name).collect()
    }
}

/// Value of [`DOMAIN_VARIABLE`]; characters that are not UTF-8 make it an invalid domain.
fn domain_variable() -> Option<String> {
    std::env::var_os(DOMAIN_VARIABLE).map(|value| value.to_string_lossy().into_owned())
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
        Endpoint::parse(variable, arguments)
    }

    #[test]
    fn the_default_is_sim_in_the_domain_of_iceoryx2() {
        assert_eq!(parse(None, &[]).unwrap().0, Endpoint::default());
        assert_eq!(Endpoint::default().to_string(), "'sim' in the default domain");
        assert_eq!(Endpoint::default().options(), "");
    }

    #[test]
    fn options_are_removed_from_the_arguments_at_any_position() {
        let (endpoint, others) =
            parse(None, &["7", "--domain", "lab", "--name=left", "x"]).unwrap();
        assert_eq!(endpoint, Endpoint::new(Some("lab"), "left").unwrap());
        assert_eq!(others, ["7", "x"]);
        assert_eq!(endpoint.options(), " --domain lab --name left");
        assert_eq!(endpoint.to_string(), "'left' in domain 'lab'");
    }

    #[test]
    fn the_option_overrides_the_variable() {
        assert_eq!(parse(Some("lab"), &[]).unwrap().0.domain(), Some("lab"));
        assert_eq!(parse(Some("lab"), &["--domain", "home"]).unwrap().0.domain(), Some("home"));
        let error = parse(Some("lab"), &["--domain="]).unwrap_err().to_string();
        assert!(error.starts_with("'' is not a valid domain (allowed: 1 to 24 "), "{error}");
        assert_eq!(parse(Some(""), &[]).unwrap().0.domain(), None);
    }

    #[test]
    fn an_invalid_variable_is_an_error_that_names_it_unless_an_option_overrides_it() {
        assert_eq!(
            parse(Some("Big Lab"), &[]).unwrap_err().to_string(),
            "the environment variable CATENARY_DOMAIN is 'Big Lab', which is not a valid domain \
             (allowed: 1 to 24 characters of a-z, 0-9, '_', '-')"
        );
        let error = parse(Some("Big Lab"), &["--domain", "Lab"]).unwrap_err().to_string();
        assert!(error.starts_with("'Lab' is not a valid domain (allowed: "), "{error}");
        assert_eq!(parse(Some("Big Lab"), &["--domain", "lab"]).unwrap().0.domain(), Some("lab"));
    }

    #[test]
    fn invalid_names_are_refused_with_the_allowed_characters() {
        let long = "x".repeat(25);
        for domain in ["", "Lab", "a/b", "..", "a b", "é", long.as_str()] {
            let error = Endpoint::new(Some(domain), "sim").unwrap_err().to_string();
            assert!(error.contains("1 to 24 characters of a-z, 0-9, '_', '-'"), "{error}");
        }
        let long = "x".repeat(65);
        for name in ["", "a/b", "a b", "é", "a\0", long.as_str()] {
            let error = Endpoint::new(None, name).unwrap_err().to_string();
            assert!(
                error.contains("1 to 64 characters of A-Z, a-z, 0-9, '_', '-', '.'"),
                "{error}"
            );
        }
    }

    #[test]
    fn an_option_without_its_value_is_an_error() {
        let error = parse(None, &["--domain"]).unwrap_err().to_string();
        assert_eq!(error, "--domain needs a value (for example --domain lab)");
    }
}
