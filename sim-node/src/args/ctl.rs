//! The command line of `ctl`.

use std::time::Duration;

use clap::{ArgAction, Args as ClapArgs, Subcommand};
use sim_contract::{ConstraintKind, Endpoint, GRAB_OVER_S_DEFAULT, NAME_DEFAULT, ParameterValue};

#[derive(Debug, ClapArgs)]
#[command(
    arg_required_else_help = true,
    after_help = "A command takes effect at a step boundary, and its outcome names the first step \
        that shows it. All calls of `ctl` act as one client: what one grabs, a later one releases.\n\n\
        Examples:\n  \
        sim-node ctl grab 90 0.5 0.2 0.3\n  \
        sim-node ctl move 90 0.5 0.3 -0.1 --over 0.1\n  \
        sim-node ctl release 90\n  \
        sim-node ctl push 0.5 0.5 0 --radius 0.2 --delta 0 0 -0.01 --limit 0.02\n  \
        sim-node ctl cut-segment --from 0 0.5 0 --to 1 0.5 0\n  \
        sim-node ctl move-collider 0 0 0.1 -0.2\n  \
        sim-node ctl set gravity 0 -1.6 0\n  \
        sim-node ctl set tear_force off\n  \
        sim-node ctl load rope\n  \
        sim-node ctl pause && sim-node ctl step 10 && sim-node ctl hash"
)]
pub(crate) struct CtlArgs {
    #[command(subcommand)]
    pub(crate) verb: CtlVerb,
    /// Wait this long for the node's answer
    #[arg(long, global = true, value_name = "TIME", default_value = "5s",
        value_parser = humantime::parse_duration)]
    pub(crate) timeout: Duration,
    /// Print one JSON object on stdout
    #[arg(long, global = true)]
    pub(crate) json: bool,
    /// Name of the node
    #[arg(long, global = true, default_value = NAME_DEFAULT, value_name = "NAME",
        value_parser = Endpoint::parse_name)]
    pub(crate) name: String,
    /// Domain of the node [default: that of iceoryx2]
    #[arg(long, global = true, env = "CATENARY_DOMAIN", value_name = "DOMAIN",
        value_parser = Endpoint::parse_domain)]
    pub(crate) domain: Option<String>,
}

#[derive(Debug, Subcommand)]
pub(crate) enum CtlVerb {
    /// Hold a particle where it stands.
    Pin {
        /// Index of the particle.
        particle: u32,
    },
    /// Free a pinned particle, from rest.
    Unpin {
        /// Index of the particle.
        particle: u32,
    },
    /// Drive a particle to a target.
    Grab(TargetArgs),
    /// Give a grabbed particle a new target.
    Move(TargetArgs),
    /// Let a grabbed particle go, with the velocity of its last motion.
    Release {
        /// Index of the particle.
        particle: u32,
    },
    /// Give every free particle within a ball a new velocity: DELTA a step.
    Push(PushArgs),
    /// Tear a constraint.
    Cut {
        /// Index of the constraint.
        constraint: u32,
    },
    /// Tear every constraint that has an end within a ball.
    CutRadius(CutRadiusArgs),
    /// Tear every constraint that crosses a strip.
    CutSegment(CutSegmentArgs),
    /// Take an anchor off its path and into a pose, where it stands.
    #[command(
        allow_negative_numbers = true,
        after_help = "Example: sim-node ctl move-anchor 0 0.2 0 -0.1"
    )]
    MoveAnchor {
        /// Index of the anchor.
        anchor: u32,
        #[command(flatten)]
        pose: PoseArgs,
    },
    /// Move a collider into a pose, within one step.
    #[command(
        allow_negative_numbers = true,
        after_help = "Example: sim-node ctl move-collider 0 0 0.1 -0.2 --rotation 0 0.6 0 0.8"
    )]
    MoveCollider {
        /// Index of the collider.
        collider: u32,
        #[command(flatten)]
        pose: PoseArgs,
    },
    /// Give a parameter of the simulation a new value.
    Set(SetArgs),
    /// Replace the scene by another one; the step number goes on.
    Load {
        /// A built-in scene, or a TOML file: a path with / or ending in .toml, that the node can read
        scene: String,
    },
    /// Stop the node at its next step boundary.
    Pause,
    /// Let a paused node go on.
    Resume,
    /// Let a paused node make COUNT steps, and wait until they are made.
    Step {
        /// Steps to make, at least 1.
        #[arg(default_value_t = 1)]
        count: u32,
    },
    /// Make the next state the initial one; the step number goes on.
    Reset,
    /// Print how the node does.
    Status,
    /// Print the step and the state hash of the newest snapshot.
    Hash,
}

#[derive(Debug, ClapArgs)]
#[command(allow_negative_numbers = true)]
pub(crate) struct TargetArgs {
    /// Index of the particle.
    pub(crate) particle: u32,
    /// Target in m, relative to the scene's origin.
    pub(crate) x: f32,
    /// Target in m, relative to the scene's origin.
    pub(crate) y: f32,
    /// Target in m, relative to the scene's origin.
    pub(crate) z: f32,
    /// Seconds to get there, 0 to 0.25, rounded up to whole steps [default: 1/60]
    #[arg(long, value_name = "SECONDS", default_value_t = GRAB_OVER_S_DEFAULT,
        hide_default_value = true)]
    pub(crate) over: f32,
}

/// The centre of a ball, as three arguments.
#[derive(Debug, Clone, Copy, ClapArgs)]
pub(crate) struct CenterArgs {
    /// Centre of the ball in m, relative to the scene's origin.
    x: f32,
    /// Centre of the ball in m, relative to the scene's origin.
    y: f32,
    /// Centre of the ball in m, relative to the scene's origin.
    z: f32,
}

impl CenterArgs {
    pub(crate) fn vector(self) -> [f32; 3] {
        [self.x, self.y, self.z]
    }
}

#[derive(Debug, ClapArgs)]
#[command(
    allow_negative_numbers = true,
    after_help = "Example: sim-node ctl push 0.5 0.5 0 --radius 0.2 --delta 0 0 -0.01 --limit 0.02"
)]
pub(crate) struct PushArgs {
    #[command(flatten)]
    pub(crate) center: CenterArgs,
    /// Radius of the ball in m; what is exactly so far away is outside
    #[arg(long, value_name = "R")]
    pub(crate) radius: f32,
    /// How far the particles go in the next step, in m
    #[arg(long, num_args = 3, action = ArgAction::Set, required = true,
        value_names = ["DX", "DY", "DZ"])]
    pub(crate) delta: Vec<f32>,
    /// Most of each component of DELTA, in m [default: none is too much]
    #[arg(long, value_name = "L")]
    pub(crate) limit: Option<f32>,
}

#[derive(Debug, ClapArgs)]
#[command(
    allow_negative_numbers = true,
    after_help = "Example: sim-node ctl cut-radius 0.5 0.5 0 --radius 0.1"
)]
pub(crate) struct CutRadiusArgs {
    #[command(flatten)]
    pub(crate) center: CenterArgs,
    /// Radius of the ball in m; what is exactly so far away is outside
    #[arg(long, value_name = "R")]
    pub(crate) radius: f32,
}

#[derive(Debug, ClapArgs)]
#[command(
    allow_negative_numbers = true,
    after_help = "Example: sim-node ctl cut-segment --from 0 0.5 0 --to 1 0.5 0 --direction 0 0 1"
)]
pub(crate) struct CutSegmentArgs {
    /// Begin of the segment in m, relative to the scene's origin
    #[arg(long, num_args = 3, action = ArgAction::Set, required = true,
        value_names = ["X", "Y", "Z"])]
    pub(crate) from: Vec<f32>,
    /// End of the segment in m, relative to the scene's origin
    #[arg(long, num_args = 3, action = ArgAction::Set, required = true,
        value_names = ["X", "Y", "Z"])]
    pub(crate) to: Vec<f32>,
    /// Direction in which the segment is extended, both ways and without end
    #[arg(long, num_args = 3, action = ArgAction::Set, default_values = ["0", "0", "1"],
        value_names = ["DX", "DY", "DZ"])]
    pub(crate) direction: Vec<f32>,
}

/// A pose relative to the one at load.
#[derive(Debug, ClapArgs)]
pub(crate) struct PoseArgs {
    /// Translation in m, from its pose at load.
    pub(crate) x: f32,
    /// Translation in m, from its pose at load.
    pub(crate) y: f32,
    /// Translation in m, from its pose at load.
    pub(crate) z: f32,
    /// Rotation from its pose at load, as a quaternion
    #[arg(long, num_args = 4, action = ArgAction::Set, default_values = ["0", "0", "0", "1"],
        value_names = ["QX", "QY", "QZ", "QW"])]
    pub(crate) rotation: Vec<f32>,
}

#[derive(Debug, ClapArgs)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:\n  \
        sim-node ctl set damping 0.5\n  \
        sim-node ctl set gravity 0 -1.6 0\n  \
        sim-node ctl set tear_stretch off\n  \
        sim-node ctl set compliance 1e-4 --kind bend"
)]
pub(crate) struct SetArgs {
    #[arg(
        help = "gravity (m/s^2), wind_velocity (m/s), wind_drag, damping (1/s), max_speed (m/s), \
        substeps, iterations, relaxation, max_stretch and tear_stretch (ratios), tear_distance (m), \
        tear_force (N), compliance (m/N), stiffness, time_scale"
    )]
    pub(crate) parameter: String,
    /// A number, three numbers for a vector, or "off"
    #[arg(num_args = 1..=3, required = true, value_name = "VALUE", value_parser = setting_word)]
    pub(crate) values: Vec<SettingWord>,
    /// Constraints that a compliance or stiffness is for [default: all]
    #[arg(long, value_name = "KIND", value_parser = ["structural", "shear", "bend", "tether"])]
    pub(crate) kind: Option<String>,
}

/// One word of a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum SettingWord {
    Number(f32),
    Off,
}

fn setting_word(text: &str) -> Result<SettingWord, String> {
    if text == "off" {
        return Ok(SettingWord::Off);
    }
    let number = text.parse().map_err(|_| "neither a number nor \"off\"".to_owned());
    number.map(SettingWord::Number)
}

impl SetArgs {
    /// What the words say together.
    pub(crate) fn value(&self) -> Result<ParameterValue, &'static str> {
        use SettingWord::{Number, Off};
        match *self.values {
            [Off] => Ok(ParameterValue::Off),
            [Number(number)] => Ok(ParameterValue::Number(number)),
            [Number(x), Number(y), Number(z)] => Ok(ParameterValue::Vector([x, y, z])),
            _ => Err("VALUE is one number, three numbers for a vector, or \"off\" alone"),
        }
    }

    /// The constraints that it is for.
    pub(crate) fn constraint_kind(&self) -> Option<ConstraintKind> {
        self.kind.as_deref().and_then(ConstraintKind::from_name)
    }
}
