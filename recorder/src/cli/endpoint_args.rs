//! The options that select a simulation.

use clap::error::ErrorKind;
use sim_contract::{DOMAIN_VARIABLE, Endpoint, NAME_DEFAULT};

/// The name and the domain of a simulation.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct EndpointArgs {
    /// Name of the simulation. Its services are NAME/particles, NAME/commands and so on
    #[arg(long, default_value = NAME_DEFAULT, value_name = "NAME", allow_hyphen_values = true,
        value_parser = Endpoint::parse_name)]
    name: String,
    /// Domain, which separates services from others on this host
    /// [env: CATENARY_DOMAIN] [default: that of iceoryx2]
    #[arg(long, value_name = "DOMAIN", allow_hyphen_values = true,
        value_parser = Endpoint::parse_domain)]
    domain: Option<String>,
}

impl EndpointArgs {
    /// Returns the endpoint. Without `--domain`, the variable `CATENARY_DOMAIN` gives the domain. Exits
    /// with code 2 if its value is invalid.
    pub(crate) fn endpoint(&self) -> Endpoint {
        let variable = std::env::var_os(DOMAIN_VARIABLE);
        let variable = variable.map(|value| value.to_string_lossy().into_owned());
        self.endpoint_with(variable.as_deref()).unwrap_or_else(|problem| {
            clap::Error::raw(ErrorKind::ValueValidation, problem + "\n").exit()
        })
    }

    fn endpoint_with(&self, variable: Option<&str>) -> Result<Endpoint, String> {
        let variable = variable.filter(|_| self.domain.is_none());
        let domain = self.domain.as_deref().or(variable);
        Endpoint::of_options(domain, &self.name).map_err(|error| match variable {
            // clap has validated the options, so the variable is wrong.
            Some(value) => {
                format!("invalid value '{value}' for the variable {DOMAIN_VARIABLE}: {error}")
            }
            None => error.to_string(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_invalid_variable_is_blamed_and_the_option_overrides_it() {
        let args = EndpointArgs { name: "sim".to_owned(), domain: None };
        let problem = args.endpoint_with(Some("No/Good")).unwrap_err();
        let expected = "invalid value 'No/Good' for the variable CATENARY_DOMAIN: ";
        assert!(problem.starts_with(expected), "{problem}");
        assert_eq!(args.endpoint_with(Some("")), args.endpoint_with(None));
        let option = EndpointArgs { domain: Some("mine".to_owned()), ..args };
        let expected = Endpoint::new(Some("mine"), "sim").unwrap();
        assert_eq!(option.endpoint_with(Some("No/Good")), Ok(expected));
    }
}
