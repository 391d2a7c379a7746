//! The commands of `ctl`: their arguments are made from the table of actions.

use std::path::PathBuf;
use std::time::Duration;

use clap::builder::{
    NonEmptyStringValueParser, PossibleValuesParser, TypedValueParser, ValueParser,
};
use clap::error::ErrorKind;
use clap::{Arg, ArgAction, ArgGroup, ArgMatches, Command, FromArgMatches, Subcommand};
use serde::Serialize;
use serde_json::{Map, Value};
use sim_contract::{
    ACTIONS, ActionInfo, ConstraintKind, FieldForm, FieldInfo, MovedObject, OVER_S_MAX, PARAMETERS,
    Parameter, ParameterInfo, ParameterValue, PlainF32, ValueForm,
};

use super::value::{index, number, seconds_up_to, time, whole};

/// A command of `ctl` with its arguments.
#[derive(Debug, Clone)]
pub(crate) struct CommandVerb {
    /// Row of the action.
    pub(crate) info: &'static ActionInfo,
    /// JSON form of the action, without the fields that have no argument of the same meaning.
    pub(crate) fields: Map<String, Value>,
    /// File with the points of a `follow`.
    pub(crate) path: Option<PathBuf>,
    /// Time to go back in a `rewind`.
    pub(crate) time: Option<Duration>,
}

/// Details and examples in the help of a command. Its other words come from the table of actions.
struct Words {
    kind: &'static str,
    details: &'static str,
    examples: &'static [&'static str],
}

#[rustfmt::skip]
const WORDS: &[Words] = &[
    Words { kind: "pin", details: "", examples: &["pin 3"] },
    Words { kind: "unpin", details: "", examples: &["unpin 3"] },
    Words { kind: "grab", details: "", examples: &["grab 90 0.5 -0.2 0.3 --over 0.1"] },
    Words { kind: "move", details: "", examples: &["move 90 0.6 -0.2 0.3"] },
    Words { kind: "release", details: "", examples: &["release 90", "release 90 --force"] },
    Words {
        kind: "step",
        details: "Waits for the last step. With --timeout, the wait ends after this time and that of one step. The node \
            goes on to the last step all the same, or until `ctl pause`.",
        examples: &["step 10"],
    },
    Words { kind: "push", details: "", examples: &["push 0.5 0.5 0 --radius 0.2 --delta 0 0 -0.01 --limit 0.02"] },
    Words { kind: "cut", details: "", examples: &["cut 17"] },
    Words { kind: "cut_radius", details: "", examples: &["cut-radius 0.5 0.5 0 --radius 0.1"] },
    Words { kind: "cut_segment", details: "", examples: &["cut-segment --from 0 0.5 0 --to 1 0.5 0 --direction 0 0 1"] },
    Words { kind: "move_anchor", details: "", examples: &["move-anchor 0 0.2 0 -0.1", "move-anchor 0 0.2 0 -0.1 --over 5s"] },
    Words {
        kind: "move_collider",
        details: "Without --over, the whole way is made within one step, with the speed that this implies.",
        examples: &["move-collider 0 0 0.1 -0.2 --rotation 0 0.6 0 0.8", "move-collider 0 0 0.1 -0.2 --over 5s"],
    },
    Words {
        kind: "set",
        details: "",
        examples: &[
            "set damping 0.5", "set gravity 0 -1.6 0", "set tear_stretch off", "set compliance 1e-4 --kind bend",
            "set bending 1e-3 --block 1", "set friction 0.3 --collider 2",
        ],
    },
    Words {
        kind: "load",
        details: "A path has a / or ends in .toml, and the node must be able to read the file. The step number continues, \
            unless the scene has another rate: then a new run begins at step 0.",
        examples: &["load rope", "load ./my.toml"],
    },
    Words {
        kind: "rewind",
        details: "The step number continues. `sim-node run --history` sets the memory for past states: the node keeps \
            every step while it fits, then old states at growing distances. A replay (`recorder play`) continues at the \
            target, as a new run, and --to-step also goes forward.",
        examples: &["rewind 2s", "rewind --to-step 480"],
    },
    Words {
        kind: "mark",
        details: "The mark is an outcome like that of any other command, so every recording has it. A recorder with \
            --black-box then writes what it has kept.",
        examples: &["mark 'the sleeve slips'"],
    },
    Words { kind: "drive_body", details: "", examples: &["drive-body 0 0 0.1 0 --velocity 0 -1.5 0 --force 2 0 0"] },
    Words {
        kind: "follow",
        details: "The file has a point on each line: the time in s after this command, x, y and z, and where it rotates \
            the quaternion x, y, z, w, separated by commas or spaces. Times ascend. A line that begins with # is a \
            comment. A point is in m: of a particle relative to the origin of the scene, else relative to the pose at \
            load. The object moves linearly from where it is. At most 2048 points are on their way. Four points are a \
            command; the printed outcome is the outcome of the first command, or of the first rejected command.",
        examples: &["follow collider 0 --path wave.csv", "follow particle 90 --path arc.csv"],
    },
];

impl Subcommand for CommandVerb {
    fn augment_subcommands(command: Command) -> Command {
        // A restore carries a state, which no command line can.
        command.subcommands(ACTIONS.iter().filter(|info| info.name != "restore").map(subcommand))
    }

    fn augment_subcommands_for_update(command: Command) -> Command {
        Self::augment_subcommands(command)
    }

    fn has_subcommand(name: &str) -> bool {
        action(name).is_some()
    }
}

impl FromArgMatches for CommandVerb {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let named = matches.subcommand().and_then(|(name, given)| Some((action(name)?, given)));
        let (info, given) = named.ok_or_else(|| clap::Error::new(ErrorKind::MissingSubcommand))?;
        let mut fields = Map::from_iter([("kind".to_owned(), info.name.into())]);
        for field in info.fields {
            let value = value(field, given).map_err(|text| {
                let name = format!("sim-node ctl {}", verb(info));
                subcommand(info).bin_name(name).error(ErrorKind::WrongNumberOfValues, text)
            })?;
            fields.extend(value.map(|value| (field.name.to_owned(), value)));
        }
        let path = given.try_get_one::<PathBuf>("path").ok().flatten().cloned();
        let time = given.try_get_one::<Duration>(TIME).ok().flatten().copied();
        Ok(Self { info, fields, path, time })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Name of the argument of a rewind that is no step.
const TIME: &str = "time";

fn action(verb: &str) -> Option<&'static ActionInfo> {
    ACTIONS.iter().find(|info| self::verb(info) == verb)
}

fn verb(info: &ActionInfo) -> String {
    info.name.replace('_', "-")
}

fn subcommand(info: &'static ActionInfo) -> Command {
    let words = WORDS.iter().find(|words| words.kind == info.name);
    let about = imperative(info.meaning);
    let mut command = Command::new(verb(info))
        .allow_negative_numbers(info.fields.iter().any(|field| has_numbers(field.form)))
        .args(info.fields.iter().map(|field| argument(info, field)));
    if let Some(details) = words.map(|words| words.details).filter(|details| !details.is_empty()) {
        command = command.long_about(format!("{about}\n\n{details}"));
    }
    if info.name == "rewind" {
        let group = ArgGroup::new("target").args([TIME, "to_step"]).required(true);
        command = command.group(group);
    }
    let examples = words.map_or(&[][..], |words| words.examples);
    command.about(about).after_help(match examples {
        [] => String::new(),
        [one] => format!("Example: sim-node ctl {one}"),
        all => format!("Examples:\n  sim-node ctl {}", all.join("\n  sim-node ctl ")),
    })
}

/// First sentence of the meaning of an action, which begins with a verb in the third person.
fn imperative(meaning: &str) -> String {
    let sentence = meaning.split_once(". ").map_or(meaning, |(first, _)| first);
    let (verb, rest) = sentence.split_once(' ').unwrap_or((sentence, ""));
    format!("{} {}", verb.strip_suffix('s').unwrap_or(verb), rest.trim_end_matches('.'))
}

fn has_numbers(form: FieldForm) -> bool {
    use FieldForm::{Number, Rotation, Value, Vector};
    matches!(form, Number | Vector | Rotation | Value)
}

/// The argument of a field. An index, a word and the one point that a command is about have no option.
fn argument(info: &ActionInfo, field: &FieldInfo) -> Arg {
    let name = field.argument();
    let arg = Arg::new(field.name).help(help(field)).value_name(name.to_uppercase());
    let is_positional = match field.form {
        FieldForm::Vector => matches!(field.name, "target" | "center" | "translation"),
        FieldForm::Number | FieldForm::Rotation | FieldForm::Flag | FieldForm::Path => false,
        _ => !field.is_optional,
    };
    let axes = |axes: &str| axes_of(if is_positional { "" } else { &name[..1] }, axes);
    let arg = match field.form {
        FieldForm::Whole if field.is_nonzero => {
            arg.value_parser(json(whole::<u32>(1..=u32::MAX.into())))
        }
        FieldForm::Whole => arg.value_parser(json(index)),
        FieldForm::Long => arg.value_parser(json(whole::<u64>(0..=u64::MAX))),
        FieldForm::Number if is_time(field) => {
            let seconds = seconds_up_to(OVER_S_MAX);
            let parser = json(move |text| seconds(text).map(PlainF32));
            arg.value_name("TIME").value_parser(parser)
        }
        FieldForm::Number => arg.value_parser(json(plain_number)),
        FieldForm::Vector => arg.value_names(axes("XYZ")).value_parser(json(plain_number)),
        FieldForm::Rotation => arg.value_names(axes("XYZW")).value_parser(json(plain_number)),
        FieldForm::Flag => arg.action(ArgAction::SetTrue),
        FieldForm::Kind => arg.value_parser(one_of(ConstraintKind::ALL.map(ConstraintKind::name))),
        FieldForm::Object => arg.value_parser(one_of(MovedObject::ALL.map(MovedObject::name))),
        FieldForm::Value => {
            let help = "A number, three numbers for a vector, or \"off\"";
            arg.help(help).num_args(1..=3).value_parser(json(setting_word))
        }
        FieldForm::Path => arg.value_name("FILE").value_parser(ValueParser::path_buf()),
        FieldForm::Text if info.name == "set" => {
            arg.help(parameters_help()).value_parser(json(parameter_name))
        }
        FieldForm::Text | FieldForm::Contents | FieldForm::Hash => {
            arg.value_parser(NonEmptyStringValueParser::new().map(Value::from))
        }
    };
    match (info.name, field.name) {
        ("step", "count") => return arg.default_value("1"),
        ("cut_segment", "direction") => {
            return arg.long(field.name).default_values(["0", "0", "1"]);
        }
        ("rewind", "back_steps") => {
            return Arg::new(TIME).value_name("TIME").value_parser(time).help(
                "Simulated time to go back, such as 2s or 500ms. Steps that an earlier rewind has left behind do not \
                 count",
            );
        }
        _ => {}
    }
    let arg = arg.required(!field.is_optional);
    if is_positional { arg } else { arg.long(name.replace('_', "-")) }
}

/// Names of the numbers of a vector, after the initial of its option.
fn axes_of(initial: &str, axes: &str) -> Vec<String> {
    axes.chars().map(|axis| format!("{}{axis}", initial.to_uppercase())).collect()
}

fn is_time(field: &FieldInfo) -> bool {
    field.form == FieldForm::Number && field.argument() != field.name
}

/// Meaning of a field with its default.
fn help(field: &FieldInfo) -> String {
    let meaning = field.meaning.split(" `None` means").next().unwrap_or_default();
    let unit = if is_time(field) { "; also with a unit, such as 100ms" } else { "" };
    let default = match field.default {
        "" => String::new(),
        default => format!(" [default: {default}]"),
    };
    format!("{}{unit}{default}", meaning.trim_end_matches('.'))
}

/// Parser of a value that becomes a field in JSON.
fn json<T: Serialize>(
    parse: impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static,
) -> ValueParser {
    ValueParser::new(move |text: &str| {
        serde_json::to_value(parse(text)?).map_err(|error| error.to_string())
    })
}

/// Parser of one of the names, which the help lists.
fn one_of<const COUNT: usize>(names: [&'static str; COUNT]) -> ValueParser {
    PossibleValuesParser::new(names).map(Value::from).into()
}

fn plain_number(text: &str) -> Result<PlainF32, String> {
    number(text).map(PlainF32)
}

/// Parses one word of the value of a parameter; `None` is off.
fn setting_word(text: &str) -> Result<Option<PlainF32>, String> {
    if text == "off" {
        return Ok(None);
    }
    let number = plain_number(text).map_err(|_| "it must be a number or \"off\"".to_owned())?;
    Ok(Some(number))
}

/// Value of a field, from the words of its argument.
fn value(field: &FieldInfo, given: &ArgMatches) -> Result<Option<Value>, &'static str> {
    if field.form == FieldForm::Flag {
        return Ok(given.get_flag(field.name).then_some(true.into()));
    }
    let words = given.try_get_many::<Value>(field.name).ok().flatten();
    let words: Vec<_> = words.into_iter().flatten().cloned().collect();
    Ok(match (field.form, words.len()) {
        (_, 0) => None,
        (_, 1) => words.into_iter().next(),
        (FieldForm::Value, _) if words.len() == 2 || words.contains(&Value::Null) => {
            return Err("VALUE must be one number, three numbers for a vector, or \"off\" alone");
        }
        _ => Some(words.into()),
    })
}

/// Parses the name of a parameter. The node judges unknown names; one with a value is two words in one.
fn parameter_name(text: &str) -> Result<String, String> {
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
fn parameters_help() -> String {
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
