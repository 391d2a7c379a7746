//! The numbers of a command, at the door.

use sim_contract::ParameterValue;

use crate::limits::{CONSTRAINTS_PER_CUT_MAX, STEPS_AT_ONCE_MAX};
use crate::message::Command;

/// Greatest coordinate, as everywhere in the simulation.
const COORDINATE_MAX: f32 = 1e7;
/// Longest time to a target, in s.
const OVER_S_MAX: f32 = 0.25;
/// Shortest time of a stroke of the brush, in s.
const BRUSH_OVER_S_MIN: f32 = 1e-3;
/// Paces of `rate`.
const RATES: std::ops::RangeInclusive<f32> = 0.1..=10.0;
/// Longest name of a scene or parameter, in bytes: that of the contract.
const NAME_SIZE_BYTES_MAX: usize = sim_contract::Text::SIZE_BYTES_MAX;

/// Why a command is refused here: the word of the reason.
pub(crate) type Refused = &'static str;

/// Whether the numbers are finite and in range.
pub(crate) fn check(command: &Command) -> Result<(), Refused> {
    match command {
        Command::DragBegin { target, over_s, .. } | Command::DragMove { target, over_s, .. } => {
            points(&[*target])?;
            within(*over_s, 0.0, OVER_S_MAX)
        }
        Command::Brush { eye, ray, radius, delta, over_s, cap } => {
            points(&[*eye, *ray, *delta])?;
            direction(ray)?;
            within(*radius, 0.0, COORDINATE_MAX)?;
            within(*over_s, BRUSH_OVER_S_MIN, OVER_S_MAX)?;
            cap.map_or(Ok(()), |cap| within(cap, 0.0, f32::MAX))
        }
        Command::Cut { constraints, .. } => allowed(constraints.len() <= CONSTRAINTS_PER_CUT_MAX),
        Command::CutSegment { from, to, direction: along } => {
            points(&[*from, *to, *along])?;
            direction(along)
        }
        Command::CutRadius { center, radius } => {
            points(&[*center])?;
            within(*radius, 0.0, COORDINATE_MAX)
        }
        Command::MoveCollider { translation, rotation, .. }
        | Command::MoveAnchor { translation, rotation, .. } => {
            points(&[*translation])?;
            numbers(rotation)?;
            direction(rotation)
        }
        Command::Step { count } => {
            allowed(*count != 0 && count.unsigned_abs() <= STEPS_AT_ONCE_MAX)
        }
        Command::Load { scene } => allowed(scene.len() <= NAME_SIZE_BYTES_MAX),
        Command::Set { parameter, value, .. } => {
            allowed(parameter.len() <= NAME_SIZE_BYTES_MAX)?;
            match value {
                ParameterValue::Number(number) => within(*number, f32::MIN, f32::MAX),
                ParameterValue::Vector(vector) => numbers(vector),
                ParameterValue::Off => Ok(()),
            }
        }
        Command::Rate { value } => within(*value, *RATES.start(), *RATES.end()),
        Command::DragEnd { .. }
        | Command::Pin { .. }
        | Command::Unpin { .. }
        | Command::Pause {}
        | Command::Resume {}
        | Command::Reset {}
        | Command::Seek { .. }
        | Command::Loop { .. } => Ok(()),
    }
}

fn allowed(is_allowed: bool) -> Result<(), Refused> {
    if is_allowed { Ok(()) } else { Err("out_of_range") }
}

fn within(number: f32, min: f32, max: f32) -> Result<(), Refused> {
    if !number.is_finite() {
        return Err("non_finite");
    }
    allowed((min..=max).contains(&number))
}

fn numbers(all: &[f32]) -> Result<(), Refused> {
    all.iter().try_for_each(|number| within(*number, -COORDINATE_MAX, COORDINATE_MAX))
}

fn points(all: &[[f32; 3]]) -> Result<(), Refused> {
    all.iter().try_for_each(|point| numbers(point))
}

/// Of any length but 0.
fn direction(vector: &[f32]) -> Result<(), Refused> {
    allowed(vector.iter().any(|axis| *axis != 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::FromPage;

    fn check_text(text: &str) -> Result<(), Refused> {
        match FromPage::parse(text).unwrap() {
            FromPage::Command { command, .. } => check(&command),
            other => panic!("{other:?} is no command"),
        }
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        for text in [
            r#"{"type":"drag_begin","particle":1,"target":[0,1e8,0]}"#,
            r#"{"type":"drag_move","particle":1,"target":[0,0,0],"over_s":0.3}"#,
            r#"{"type":"brush","eye":[0,0,1],"ray":[0,0,0],"radius":1,"delta":[0,0,0],"over_s":0.1}"#,
            r#"{"type":"brush","eye":[0,0,1],"ray":[0,0,1],"radius":-1,"delta":[0,0,0],"over_s":0.1}"#,
            r#"{"type":"brush","eye":[0,0,1],"ray":[0,0,1],"radius":1,"delta":[0,0,0],"over_s":0}"#,
            r#"{"type":"cut_segment","from":[0,0,0],"to":[1,0,0],"direction":[0,0,0]}"#,
            r#"{"type":"cut_radius","center":[0,0,0],"radius":-0.1}"#,
            r#"{"type":"move_collider","collider":0,"translation":[0,0,0],"rotation":[0,0,0,0]}"#,
            r#"{"type":"step","count":0}"#,
            r#"{"type":"step","count":10001}"#,
            r#"{"type":"rate","value":11}"#,
        ] {
            assert_eq!(check_text(text), Err("out_of_range"), "{text}");
        }
        let ids = vec!["1"; CONSTRAINTS_PER_CUT_MAX + 1].join(",");
        let cut = format!(r#"{{"type":"cut","epoch":1,"constraints":[{ids}]}}"#);
        assert_eq!(check_text(&cut), Err("out_of_range"));
    }

    #[test]
    fn numbers_that_are_not_finite_are_refused() {
        for text in [
            r#"{"type":"drag_begin","particle":1,"target":[0,1e39,0]}"#,
            r#"{"type":"set","parameter":"gravity","value":[0,"nan",0]}"#,
            r#"{"type":"set","parameter":"damping","value":"inf"}"#,
        ] {
            assert_eq!(check_text(text), Err("non_finite"), "{text}");
        }
    }

    #[test]
    fn what_the_protocol_shows_is_allowed() {
        for text in [
            r#"{"type":"drag_begin","particle":1,"target":[0,1e7,-1e7],"over_s":0}"#,
            r#"{"type":"brush","eye":[0,0,1],"ray":[0,0,-2],"radius":1,"delta":[0,0,0],"over_s":0.1,"cap":0}"#,
            r#"{"type":"set","parameter":"compliance","value":1e20}"#,
            r#"{"type":"set","parameter":"tear_force","value":null}"#,
            r#"{"type":"step","count":-10000}"#,
        ] {
            assert_eq!(check_text(text), Ok(()), "{text}");
        }
    }
}
