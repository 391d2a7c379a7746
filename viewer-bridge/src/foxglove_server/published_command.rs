//! Commands that clients publish: those of the file format, one JSON object per message.

use sim_contract::Action;

use crate::message::{BodyDrive, Command};

/// Topic of published commands.
pub(super) const TOPIC: &str = "/commands";

/// Parses a command. A cut refers to the load on show, `epoch`. The error is for the user.
///
/// # Errors
/// The payload is not JSON, or not a command that clients may publish.
pub fn parse(payload: &[u8], epoch: u32) -> Result<Command, String> {
    let action: Action = serde_json::from_slice(payload).map_err(|error| error.to_string())?;
    Ok(match action {
        Action::Pin { particle } => Command::Pin { particle },
        Action::Unpin { particle } => Command::Unpin { particle },
        Action::Grab { particle, target, over_s } => Command::Grab { particle, target, over_s },
        Action::Move { particle, target, over_s } => Command::Move { particle, target, over_s },
        Action::Release { particle, force: false } => Command::Release { particle },
        // A client of the bridge ends only its own grabs.
        Action::Release { force: true, .. } => {
            return Err("release with force is not accepted here".to_owned());
        }
        Action::Pause => Command::Pause {},
        Action::Resume => Command::Resume {},
        Action::Step { count } => Command::Step { count: i32::try_from(count).unwrap_or(i32::MAX) },
        Action::Reset => Command::Reset {},
        Action::Cut { constraint } => {
            Command::Cut { epoch, constraints: vec![constraint], stroke: None }
        }
        Action::CutRadius { center, radius } => Command::CutRadius { center, radius },
        Action::CutSegment { from, to, direction } => Command::CutSegment { from, to, direction },
        Action::MoveAnchor { anchor, translation, rotation, over_s } => {
            Command::MoveAnchor { anchor, translation, rotation, over_s }
        }
        Action::MoveCollider { collider, translation, rotation, over_s } => {
            Command::MoveCollider { collider, translation, rotation, over_s }
        }
        Action::Set { parameter, value, constraint_kind, block, collider } => {
            let parameter = parameter.as_str().to_owned();
            Command::Set { parameter, value, constraint_kind, block, collider, stroke: None }
        }
        Action::Load { scene } => Command::Load { scene: scene.as_str().to_owned() },
        Action::Mark { text } => Command::Mark { text: text.as_str().to_owned() },
        // No limit and an infinite one are the same.
        Action::Push { center, radius, delta, limit } => {
            let limit = limit.filter(|limit| *limit != f32::INFINITY);
            Command::Push { center, radius, delta, limit }
        }
        Action::Rewind { .. } => return Err("rewind is not accepted here".to_owned()),
        Action::DriveBody {
            collider,
            translation,
            rotation,
            velocity,
            angular_velocity,
            force,
            torque,
        } => Command::DriveBody(BodyDrive {
            collider,
            translation,
            rotation,
            velocity,
            angular_velocity,
            force,
            torque,
        }),
        Action::Follow { .. } => return Err("follow is not accepted here".to_owned()),
        Action::Restore { .. } => return Err("restore is not accepted here".to_owned()),
        Action::Unknown { .. } => return Err("no such command".to_owned()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_commands_are_those_of_the_file_format() {
        let read = |text: &str| parse(text.as_bytes(), 7);
        assert_eq!(read(r#"{"kind":"pin","particle":3}"#), Ok(Command::Pin { particle: 3 }));
        let cut = Command::Cut { epoch: 7, constraints: vec![5], stroke: None };
        assert_eq!(read(r#"{"kind":"cut","constraint":5}"#), Ok(cut));
        let grab = Command::Grab { particle: 1, target: [0.0, 1.0, 2.0], over_s: 0.1 };
        let text = r#"{"kind":"grab","particle":1,"target":[0,1,2],"over_s":0.1}"#;
        assert_eq!(read(text), Ok(grab));
        assert_eq!(read(r#"{"kind":"pause"}"#), Ok(Command::Pause {}));
        let drive = BodyDrive {
            collider: 2,
            translation: [1.0, 0.0, 0.0],
            rotation: [0.0, 1.0, 0.0, 0.0],
            velocity: [2.0, 0.0, 0.0],
            angular_velocity: [3.0, 0.0, 0.0],
            force: [4.0, 0.0, 0.0],
            torque: [5.0, 0.0, 0.0],
        };
        let text = serde_json::to_string(&drive.action()).unwrap();
        assert!(text.contains(r#""force":[4"#) && text.contains(r#""torque":[5"#), "{text}");
        assert_eq!(read(&text), Ok(Command::DriveBody(drive)));
        let push = Command::Push {
            center: [0.0, 1.0, 2.0],
            radius: 0.5,
            delta: [0.1, 0.0, 0.0],
            limit: None,
        };
        let text = r#"{"kind":"push","center":[0,1,2],"radius":0.5,"delta":[0.1,0,0]"#;
        assert_eq!(read(&format!("{text}}}")), Ok(push.clone()));
        assert_eq!(read(&format!(r#"{text},"limit":"inf"}}"#)), Ok(push));
        let mark = Command::Mark { text: "slips".to_owned() };
        assert_eq!(read(r#"{"kind":"mark","text":"slips"}"#), Ok(mark));
    }

    #[test]
    fn other_messages_are_refused_with_the_reason() {
        for text in ["", "[]", "{}", r#"{"kind":"dance"}"#, r#"{"kind":"pin"}"#] {
            assert!(parse(text.as_bytes(), 1).is_err(), "{text}");
        }
        let rewind = br#"{"kind":"rewind","to_step":3}"#;
        assert_eq!(parse(rewind, 1), Err("rewind is not accepted here".to_owned()));
        let release = br#"{"kind":"release","particle":3,"force":true}"#;
        assert_eq!(parse(release, 1), Err("release with force is not accepted here".to_owned()));
    }
}
