//! The action of each command of `ctl`.

use std::fs;
use std::path::{self, Path};
use std::time::Duration;

use anyhow::{Context, anyhow};
use serde_json::Value;
use sim_contract::{Action, MovedObject, PathError, PathPoint};
use sim_host::clock::SECOND_NS;

use crate::args::CommandVerb;
use crate::scene_source;

/// Actions of a command. `rate_hz` returns the rate of the node.
pub(super) fn from_verb(
    verb: &CommandVerb,
    rate_hz: impl FnOnce() -> anyhow::Result<u32>,
) -> anyhow::Result<Vec<Action>> {
    if let Some(path) = &verb.path {
        return follow(verb, path);
    }
    let mut fields = verb.fields.clone();
    if let Some(Value::String(scene)) = fields.get_mut("scene") {
        *scene = scene_text(scene)?;
    }
    if let Some(time) = verb.time {
        fields.insert("back_steps".to_owned(), steps_in(time, rate_hz()?).into());
    }
    let action = serde_json::from_value(fields.into());
    Ok(vec![action.with_context(|| format!("{} is no command", verb.info.name))?])
}

fn follow(verb: &CommandVerb, path: &Path) -> anyhow::Result<Vec<Action>> {
    let field = |name: &str| verb.fields.get(name).cloned().unwrap_or_default();
    let object: MovedObject = serde_json::from_value(field("object"))?;
    let index = serde_json::from_value(field("object_index"))?;
    let rows = rows(path)?;
    let points: Vec<_> = rows.iter().map(|row| row.point).collect();
    let append = verb.fields.contains_key("append");
    Action::follow(object, index, &points, append).map_err(|error| match error {
        PathError::Point { index, fault } => {
            anyhow!("{}:{}: {fault}", path.display(), rows[index].line)
        }
        PathError::Length { .. } => anyhow!("{}: {error}", path.display()),
    })
}

/// A point in a file.
struct Row {
    line: usize,
    point: PathPoint,
}

/// Reads the points of a path, one on each line.
fn rows(path: &Path) -> anyhow::Result<Vec<Row>> {
    let text = fs::read_to_string(path).with_context(|| format!("{}", path.display()))?;
    let lines = (1..).zip(text.lines().map(str::trim));
    let lines = lines.filter(|(_, text)| !text.is_empty() && !text.starts_with('#'));
    let row = |(line, text): (usize, &str)| {
        let point = point(text).with_context(|| format!("{}:{line}", path.display()))?;
        Ok(Row { line, point })
    };
    lines.map(row).collect()
}

fn point(line: &str) -> anyhow::Result<PathPoint> {
    let words = line.split([',', ' ', '\t']).filter(|word| !word.is_empty());
    let numbers =
        words.map(|word| word.parse().with_context(|| format!("'{word}' is not a number")));
    Ok(PathPoint::from_row(&numbers.collect::<anyhow::Result<Vec<_>>>()?)?)
}

/// Number of steps in a simulated time, rounded up.
fn steps_in(time: Duration, rate_hz: u32) -> u32 {
    let steps = (time.as_nanos() * u128::from(rate_hz)).div_ceil(u128::from(SECOND_NS));
    u32::try_from(steps).unwrap_or(u32::MAX)
}

/// Name of a built-in scene, or absolute path of a file: the node may run in another folder. Checks
/// the scene first, because an outcome has no room for the place of an error.
fn scene_text(source: &str) -> anyhow::Result<String> {
    scene_source::load(source)?;
    if !sim_solver::scene::is_path(source) {
        return Ok(source.to_owned());
    }
    let path = path::absolute(source)
        .with_context(|| format!("{source}: cannot make the path absolute"))?;
    let text = path.to_str().map(str::to_owned);
    text.with_context(|| format!("{}: the path is not UTF-8", path.display()))
}

#[cfg(test)]
mod tests {
    use sim_contract::{ConstraintKind, MovedObject, ParameterValue, Part, Text};

    use super::*;
    use crate::args::{CtlVerb, Verb, try_parse};

    fn actions(line: &str) -> anyhow::Result<Vec<Action>> {
        let words = ["sim-node", "ctl"].into_iter().chain(line.split_whitespace());
        let args = try_parse(words).unwrap_or_else(|error| panic!("{line}: {error}"));
        let Some(Verb::Ctl(ctl)) = args.verb else { panic!("{line}: not ctl") };
        let CtlVerb::Command(verb) = ctl.verb else { panic!("{line}: not a command") };
        from_verb(&verb, || Ok(240))
    }

    fn action(line: &str) -> Action {
        let actions = actions(line).unwrap();
        let [action] = actions[..] else { panic!("{line}: {actions:?}") };
        action
    }

    fn set(name: &str, value: ParameterValue, kind: Option<ConstraintKind>) -> Action {
        Action::set(name, value).for_part(kind.map_or(Part::All, Part::Kind))
    }

    #[test]
    fn pushes_and_cuts_take_negative_numbers_and_have_defaults() {
        let (center, delta) = ([0.5, -0.5, 0.0], [0.0, -1e10, -0.25]);
        let push = |limit| Action::Push { center, radius: 0.2, delta, limit };
        let line = "push 0.5 -0.5 0 --radius 0.2 --delta 0 -1e10 -0.25";
        assert_eq!(action(line), push(None));
        assert_eq!(action(&format!("{line} --limit -1")), push(Some(-1.0)));
        assert_eq!(action("cut 7"), Action::Cut { constraint: 7 });
        let cut = Action::CutRadius { center: [-1.0, -2.0, -3.0], radius: 0.1 };
        assert_eq!(action("cut-radius -1 -2 -3 --radius 0.1"), cut);
        let (from, to) = ([0.0, -0.5, 0.0], [-1.0, 0.5, 0.0]);
        let cut = |direction| Action::CutSegment { from, to, direction };
        let line = "cut-segment --from 0 -0.5 0 --to -1 0.5 0";
        assert_eq!(action(line), cut([0.0, 0.0, 1.0]));
        assert_eq!(action(&format!("{line} --direction 0 -1 0")), cut([0.0, -1.0, 0.0]));
    }

    #[test]
    fn a_pose_is_a_translation_with_an_optional_rotation() {
        let translation = [0.0, 0.1, -0.2];
        let expected = Action::MoveAnchor {
            anchor: 3,
            translation,
            rotation: [0.0, 0.0, 0.0, 1.0],
            over_s: 0.0,
        };
        assert_eq!(action("move-anchor 3 0 0.1 -0.2"), expected);
        let rotation = [0.0, -0.6, 0.0, 0.8];
        let expected = Action::MoveCollider { collider: 2, translation, rotation, over_s: 0.0 };
        assert_eq!(action("move-collider 2 0 0.1 -0.2 --rotation 0 -0.6 0 0.8"), expected);
        let expected = Action::MoveCollider { collider: 2, translation, rotation, over_s: 1800.0 };
        let line = "move-collider 2 0 0.1 -0.2 --rotation 0 -0.6 0 0.8 --over 30min";
        assert_eq!(action(line), expected);
        let body = |angular_velocity, force| Action::DriveBody {
            collider: 2,
            translation,
            rotation,
            velocity: [0.0, -1.5, 0.0],
            angular_velocity,
            force,
            torque: force,
        };
        let line = "drive-body 2 0 0.1 -0.2 --rotation 0 -0.6 0 0.8 --velocity 0 -1.5 0";
        assert_eq!(action(line), body([0.0; 3], [0.0; 3]));
        let line = format!("{line} --angular-velocity 1 -2 3 --force 4 5 -6 --torque 4 5 -6");
        assert_eq!(action(&line), body([1.0, -2.0, 3.0], [4.0, 5.0, -6.0]));
    }

    #[test]
    fn a_path_is_read_from_lines_and_a_wrong_one_names_its_line() {
        let file = std::env::temp_dir().join(format!("catenary-path-{}.csv", std::process::id()));
        let read = |text: &str| {
            fs::write(&file, text).unwrap();
            actions(&format!("follow collider 0 --path {}", file.display()))
        };
        let actions = read("# time x y z\n0, 1, 2, 3\n\n0.5 1 2 3 0 0 0.6 0.8\n").unwrap();
        let first = PathPoint { translation: [1.0, 2.0, 3.0], ..PathPoint::AT_LOAD };
        let second = PathPoint { time: 0.5, rotation: [0.0, 0.0, 0.6, 0.8], ..first };
        let object = MovedObject::Collider;
        assert_eq!(actions, Action::follow(object, 0, &[first, second], false).unwrap());
        for (text, expected) in [
            ("0 1 2 3\n\n0 1 2 3", "csv:3: the time 0 is not after 0 (allowed: ascending times)"),
            ("1 1 2", "csv:1: 3 numbers (allowed: 4, its time in s and x, y, z; or 8,"),
            ("1 1 2 x", "csv:1: 'x' is not a number"),
            ("1 1 2 nan", "csv:1: a number is not finite in 32 bits"),
            ("3601 1 2 3", "csv:1: the time 3601 is out of range (allowed: 0 to 3600 s)"),
            ("# nothing", "csv: a path of 0 points (allowed: 1 to 2048)"),
        ] {
            let error = format!("{:#}", read(text).unwrap_err());
            assert!(error.contains(expected), "{error}");
        }
        fs::remove_file(&file).unwrap();
    }

    #[test]
    fn a_value_is_a_number_a_vector_or_off() {
        let gravity = ParameterValue::Vector([0.0, -1.6, 0.0]);
        assert_eq!(action("set gravity 0 -1.6 0"), set("gravity", gravity, None));
        let number = ParameterValue::Number(-1.0);
        assert_eq!(action("set damping -1 --timeout 1s"), set("damping", number, None));
        assert_eq!(action("set tear_force off"), set("tear_force", ParameterValue::Off, None));
        let number = ParameterValue::Number(1e-4);
        let expected = set("compliance", number, Some(ConstraintKind::Bend));
        assert_eq!(action("set compliance 1e-4 --kind bend"), expected);
        let of_collider = Action::set("friction", 0.3).for_part(Part::Collider(2));
        assert_eq!(action("set friction 0.3 --collider 2"), of_collider);
        let line = ["sim-node", "ctl", "set", "compliance", "1", "--kind", "knot"];
        let error = try_parse(line).unwrap_err().to_string();
        assert!(error.contains("[possible values: structural, shear, bend, tether]"), "{error}");
    }

    #[test]
    fn every_kind_of_constraints_can_be_addressed() {
        for kind in ConstraintKind::ALL {
            let expected = set("compliance", ParameterValue::Number(0.0), Some(kind));
            assert_eq!(action(&format!("set compliance 0 --kind {}", kind.name())), expected);
        }
    }

    #[test]
    fn a_scene_is_a_built_in_name_or_an_absolute_path() {
        let rewind = |to_step, back_steps| Action::Rewind { to_step, back_steps };
        assert_eq!(action("rewind --to-step 12"), rewind(Some(12), None));
        assert_eq!(action("rewind 2s"), rewind(None, Some(480)));
        assert_eq!(action("rewind 5ms"), rewind(None, Some(2)), "rounded up from 1.2 steps");
        assert_eq!(action("load rope"), Action::Load { scene: Text::cut("rope") });
        let Action::Load { scene } = action("load ./scenes/rope.toml") else { panic!("no load") };
        assert!(scene.as_str().starts_with('/') && scene.as_str().ends_with("/scenes/rope.toml"));
        let error = actions("load nix").unwrap_err().to_string();
        assert!(error.starts_with("there is no built-in scene 'nix'"), "{error}");
        let error = format!("{:#}", actions(&format!("mark {}", "x".repeat(161))).unwrap_err());
        assert!(error.ends_with("the text has 161 bytes (allowed: at most 160)"), "{error}");
    }
}
