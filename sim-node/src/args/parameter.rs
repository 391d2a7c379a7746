//! The parameters of `ctl set`: their names, and their values in words.

use sim_contract::{PARAMETERS, Parameter, ParameterInfo, ParameterValue, ValueForm};

/// Parses the name of a parameter. The node judges unknown names; one with a value is two words in one.
pub(super) fn parameter_name(text: &str) -> Result<String, String> {
    let Some((name, value)) = text.split_once('=') else { return Ok(text.to_owned()) };
    let Some(parameter) = Parameter::from_name(name) else {
        return Err("the name of a parameter has no '='".to_owned());
    };
    let info = parameter.info();
    let is_scalar = info.form != ValueForm::Vector;
    let is_valid = is_scalar && value.parse().is_ok_and(|number| info.range.contains(number));
    let value = if is_valid { value.to_owned() } else { example(info) };
    Err(format!(
        "name and value are separate words, as in `ctl set {name} {value}` (allowed: {})",
        info.allowed_values()
    ))
}

/// A value of a parameter: the default, or one in its range.
fn example(info: &ParameterInfo) -> String {
    match info.default {
        ParameterValue::Vector(vector) => vector.map(|number| number.to_string()).join(" "),
        ParameterValue::Number(number) => number.to_string(),
        ParameterValue::Off if info.range.contains(0.5) => "0.5".to_owned(),
        ParameterValue::Off => "2".to_owned(),
    }
}

/// Names of the parameters, with their units.
pub(super) fn parameters_help() -> String {
    let name = |info: &ParameterInfo| match info.unit {
        "" => info.name.to_owned(),
        unit => format!("{} ({unit})", info.name),
    };
    PARAMETERS.iter().map(name).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_behind_an_equals_sign_is_refused_with_an_example_and_the_range() {
        let error = |text| parameter_name(text).unwrap_err();
        assert_eq!(
            error("damping=3"),
            "name and value are separate words, as in `ctl set damping 3` (allowed: a number >= 0, or off \
             for 0)"
        );
        assert!(error("damping=-3").contains("`ctl set damping 0` (allowed: "));
        for info in PARAMETERS {
            let number = example(&info).split(' ').next().unwrap().parse().unwrap();
            assert!(info.range.contains(number), "{}", info.name);
        }
        for vector in ["gravity=1,2,3", "gravity=[1,2,3]", "gravity="] {
            assert!(
                error(vector).contains("`ctl set gravity 0 -9.81 0` (allowed: three numbers, each")
            );
        }
        assert_eq!(error("weight=3"), "the name of a parameter has no '='");
        assert_eq!(parameter_name("weight"), Ok("weight".to_owned()));
    }
}
