//! Range checks of the numbers in a command, before it reaches the source.

use sim_contract::{COORDINATE_MAX, OVER_S_MAX, ParameterValue, Reason, Text};

use super::body_drive::BodyDrive;
use super::from_page::Command;
use crate::limits::{CONSTRAINTS_PER_CUT_MAX, STEPS_AT_ONCE_MAX};

/// Shortest time of a brush stroke, in s.
const BRUSH_OVER_S_MIN: f32 = 1e-3;
/// Longest time of a brush stroke, or between two poses of a carried object, in s.
const FRAME_OVER_S_MAX: f32 = 0.25;
/// Range of `rate`.
const RATES: std::ops::RangeInclusive<f32> = 0.1..=10.0;

/// Checks that the numbers are finite and in range.
///
/// # Errors
/// A number is not finite or out of its range, or a vector has no direction.
#[allow(clippy::too_many_lines, reason = "an arm for each command")]
pub fn check(command: &Command) -> Result<(), Reason> {
    match command {
        Command::Grab { target, over_s, .. } | Command::Move { target, over_s, .. } => {
            points(&[*target])?;
            within(*over_s, 0.0, OVER_S_MAX)
        }
        Command::Carry { offset, over_s, .. } => {
            points(&[*offset])?;
            within(*over_s, 0.0, FRAME_OVER_S_MAX)
        }
        Command::Throw { velocity, .. } => points(&[*velocity]),
        Command::Brush { eye, ray, radius, delta, over_s, cap, stroke: _ } => {
            points(&[*eye, *ray, *delta])?;
            direction(ray)?;
            within(*radius, 0.0, COORDINATE_MAX)?;
            within(*over_s, BRUSH_OVER_S_MIN, FRAME_OVER_S_MAX)?;
            cap.map_or(Ok(()), |cap| within(cap, 0.0, f32::MAX))
        }
        Command::Push { center, radius, delta, limit } => {
            points(&[*center, *delta])?;
            within(*radius, 0.0, COORDINATE_MAX)?;
            limit.map_or(Ok(()), |limit| within(limit, 0.0, f32::MAX))
        }
        Command::Cut { constraints, .. } => at_most(constraints.len(), CONSTRAINTS_PER_CUT_MAX),
        Command::CutSegment { from, to, direction: along } => {
            points(&[*from, *to, *along])?;
            direction(along)
        }
        Command::CutRadius { center, radius } => {
            points(&[*center])?;
            within(*radius, 0.0, COORDINATE_MAX)
        }
        Command::MoveCollider { translation, rotation, over_s, .. }
        | Command::MoveAnchor { translation, rotation, over_s, .. } => {
            points(&[*translation])?;
            numbers(rotation)?;
            direction(rotation)?;
            within(*over_s, 0.0, OVER_S_MAX)
        }
        Command::DriveBody(drive) => drive_body(drive),
        Command::Step { count: 0 } => Err(Reason::OutOfRange),
        Command::Step { count } => {
            at_most(count.unsigned_abs() as usize, STEPS_AT_ONCE_MAX as usize)
        }
        Command::Load { scene } => at_most(scene.len(), Text::SIZE_BYTES_MAX),
        Command::Mark { text } if text.is_empty() => Err(Reason::OutOfRange),
        Command::Mark { text } => at_most(text.len(), Text::SIZE_BYTES_MAX),
        Command::Set { parameter, value, .. } => {
            at_most(parameter.len(), Text::SIZE_BYTES_MAX)?;
            match value {
                ParameterValue::Number(number) => within(*number, f32::MIN, f32::MAX),
                ParameterValue::Vector(vector) => numbers(vector),
                ParameterValue::Off => Ok(()),
            }
        }
        Command::Rate { value } => within(*value, *RATES.start(), *RATES.end()),
        Command::Release { .. }
        | Command::Pin { .. }
        | Command::Unpin { .. }
        | Command::Pause {}
        | Command::Resume {}
        | Command::Reset {}
        | Command::Look { .. }
        | Command::Rewind { .. }
        | Command::Undo { .. }
        | Command::Record {}
        | Command::StopRecording {}
        | Command::Lift { .. }
        | Command::Seek { .. }
        | Command::Ghost { .. }
        | Command::Loop { .. } => Ok(()),
    }
}

fn drive_body(drive: &BodyDrive) -> Result<(), Reason> {
    let BodyDrive { translation, velocity, angular_velocity, force, torque, .. } = drive;
    points(&[*translation, *velocity, *angular_velocity])?;
    if !force.iter().chain(torque).all(|axis| axis.is_finite()) {
        return Err(Reason::NonFinite);
    }
    numbers(&drive.rotation)?;
    direction(&drive.rotation)
}

fn at_most(count: usize, max: usize) -> Result<(), Reason> {
    if count <= max { Ok(()) } else { Err(Reason::OutOfRange) }
}

fn within(number: f32, min: f32, max: f32) -> Result<(), Reason> {
    if !number.is_finite() {
        return Err(Reason::NonFinite);
    }
    if (min..=max).contains(&number) { Ok(()) } else { Err(Reason::OutOfRange) }
}

fn numbers(all: &[f32]) -> Result<(), Reason> {
    all.iter().try_for_each(|number| within(*number, -COORDINATE_MAX, COORDINATE_MAX))
}

fn points(all: &[[f32; 3]]) -> Result<(), Reason> {
    all.iter().try_for_each(|point| numbers(point))
}

/// Checks that a vector has a direction.
fn direction(vector: &[f32]) -> Result<(), Reason> {
    if vector.iter().all(|axis| *axis == 0.0) { Err(Reason::OutOfRange) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::from_page::FromPage;

    fn check_text(text: &str) -> Result<(), Reason> {
        match FromPage::parse(text).unwrap() {
            FromPage::Command { command, .. } => check(&command),
            other => panic!("{other:?} is not a command"),
        }
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        for text in [
            r#"{"type":"grab","particle":1,"target":[0,1e8,0]}"#,
            r#"{"type":"move","particle":1,"target":[0,0,0],"over_s":3601}"#,
            r#"{"type":"move_collider","collider":0,"translation":[0,0,0],"over_s":-1}"#,
            r#"{"type":"brush","eye":[0,0,1],"ray":[0,0,0],"radius":1,"delta":[0,0,0],"over_s":0.1}"#,
            r#"{"type":"brush","eye":[0,0,1],"ray":[0,0,1],"radius":-1,"delta":[0,0,0],"over_s":0.1}"#,
            r#"{"type":"brush","eye":[0,0,1],"ray":[0,0,1],"radius":1,"delta":[0,0,0],"over_s":0}"#,
            r#"{"type":"cut_segment","from":[0,0,0],"to":[1,0,0],"direction":[0,0,0]}"#,
            r#"{"type":"cut_radius","center":[0,0,0],"radius":-0.1}"#,
            r#"{"type":"move_collider","collider":0,"translation":[0,0,0],"rotation":[0,0,0,0]}"#,
            r#"{"type":"drive_body","collider":0,"translation":[0,0,0],"rotation":[0,0,0,0]}"#,
            r#"{"type":"drive_body","collider":0,"translation":[0,2e7,0]}"#,
            r#"{"type":"step","count":0}"#,
            r#"{"type":"step","count":10001}"#,
            r#"{"type":"rate","value":11}"#,
        ] {
            assert_eq!(check_text(text), Err(Reason::OutOfRange), "{text}");
        }
        let ids = vec!["1"; CONSTRAINTS_PER_CUT_MAX + 1].join(",");
        let cut = format!(r#"{{"type":"cut","epoch":1,"constraints":[{ids}]}}"#);
        assert_eq!(check_text(&cut), Err(Reason::OutOfRange));
    }

    #[test]
    fn numbers_that_are_not_finite_are_refused() {
        for text in [
            r#"{"type":"grab","particle":1,"target":[0,1e39,0]}"#,
            r#"{"type":"drive_body","collider":0,"translation":[0,0,0],"torque":[0,0,1e39]}"#,
            r#"{"type":"set","parameter":"gravity","value":[0,"nan",0]}"#,
            r#"{"type":"set","parameter":"damping","value":"inf"}"#,
        ] {
            assert_eq!(check_text(text), Err(Reason::NonFinite), "{text}");
        }
    }

    #[test]
    fn numbers_at_the_ends_of_their_ranges_are_allowed() {
        for text in [
            r#"{"type":"grab","particle":1,"target":[0,1e7,-1e7],"over_s":0}"#,
            r#"{"type":"brush","eye":[0,0,1],"ray":[0,0,-2],"radius":1,"delta":[0,0,0],"over_s":0.1,"cap":0}"#,
            r#"{"type":"set","parameter":"compliance","value":1e20}"#,
            r#"{"type":"set","parameter":"tear_force","value":null}"#,
            r#"{"type":"step","count":-10000}"#,
        ] {
            assert_eq!(check_text(text), Ok(()), "{text}");
        }
    }
}
