//! Command lines of the commands of `ctl`: each one is applied by the node and has an outcome.

use std::path::PathBuf;
use std::time::Duration;

use clap::builder::{NonEmptyStringValueParser, PossibleValuesParser, TypedValueParser};
use clap::{ArgAction, Args as ClapArgs, Subcommand};
use sim_contract::{ConstraintKind, GRAB_OVER_S_DEFAULT, MovedObject, OVER_S_MAX, ParameterValue};

use super::parameter::{parameter_name, parameters_help};
use super::value::{index, number, seconds_up_to, time, whole};

#[derive(Debug, Subcommand)]
pub(crate) enum CommandVerb {
    /// Hold a particle at its present position
    #[command(after_help = "Example: sim-node ctl pin 3")]
    Pin {
        /// Index of the particle
        #[arg(value_parser = index)]
        particle: u32,
    },
    /// Free a pinned particle, from rest
    #[command(after_help = "Example: sim-node ctl unpin 3")]
    Unpin {
        /// Index of the particle
        #[arg(value_parser = index)]
        particle: u32,
    },
    /// Grab a particle and drive it to a target
    #[command(after_help = "Example: sim-node ctl grab 90 0.5 -0.2 0.3 --over 0.1")]
    Grab(TargetArgs),
    /// Drive a grabbed particle to a new target
    #[command(after_help = "Example: sim-node ctl move 90 0.6 -0.2 0.3")]
    Move(TargetArgs),
    /// Release a grabbed particle with the velocity of its last motion
    #[command(
        after_help = "Examples:\n  sim-node ctl release 90\n  sim-node ctl release 90 --force"
    )]
    Release {
        /// Index of the particle
        #[arg(value_parser = index)]
        particle: u32,
        /// Release it even if another client has grabbed it
        #[arg(long)]
        force: bool,
    },
    /// Set the velocity of all free particles within a sphere, as a brush does
    Push(PushArgs),
    /// Tear a constraint
    #[command(after_help = "Example: sim-node ctl cut 17")]
    Cut {
        /// Index of the constraint
        #[arg(value_parser = index)]
        constraint: u32,
    },
    /// Tear all constraints with an end within a sphere
    CutRadius(CutRadiusArgs),
    /// Tear all constraints that cross a strip
    CutSegment(CutSegmentArgs),
    /// Move an anchor to a pose and end its path
    #[command(
        allow_negative_numbers = true,
        after_help = "Examples:\n  \
            sim-node ctl move-anchor 0 0.2 0 -0.1\n  \
            sim-node ctl move-anchor 0 0.2 0 -0.1 --over 5s"
    )]
    MoveAnchor {
        /// Index of the anchor
        #[arg(value_parser = index)]
        anchor: u32,
        #[command(flatten)]
        pose: PoseArgs,
        #[command(flatten)]
        over: OverArgs,
    },
    /// Move a collider to a pose
    ///
    /// Without --over, the whole way is made within one step, with the speed that this implies.
    #[command(
        allow_negative_numbers = true,
        after_help = "Examples:\n  \
            sim-node ctl move-collider 0 0 0.1 -0.2 --rotation 0 0.6 0 0.8\n  \
            sim-node ctl move-collider 0 0 0.1 -0.2 --over 5s"
    )]
    MoveCollider {
        /// Index of the collider
        #[arg(value_parser = index)]
        collider: u32,
        #[command(flatten)]
        pose: PoseArgs,
        #[command(flatten)]
        over: OverArgs,
    },
    /// Lead a grabbed particle, an anchor or a collider along points in time
    ///
    /// The file has a point on each line: the time in s after this command, x, y and z, and where it rotates the
    /// quaternion x, y, z, w, separated by commas or spaces. Times ascend. A line that begins with # is a comment. A point
    /// is in m: of a particle relative to the origin of the scene, else relative to the pose at load. The object
    /// moves linearly from where it is, and stays at the last point. At most 2048 points are on their way. Four points
    /// are a command; the printed outcome is the outcome of the first command, or of the first rejected command.
    #[command(after_help = "Examples:\n  \
        sim-node ctl follow collider 0 --path wave.csv\n  \
        sim-node ctl follow particle 90 --path arc.csv")]
    Follow(FollowArgs),
    /// Move a body of another program through the next step
    DriveBody(DriveBodyArgs),
    /// Set a parameter of the simulation
    Set(SetArgs),
    /// Load another scene
    ///
    /// The step number continues, unless the scene has another rate: then a new run begins at step 0.
    #[command(after_help = "Examples:\n  sim-node ctl load rope\n  sim-node ctl load ./my.toml")]
    Load {
        /// Built-in scene, or TOML file that the node can read: a path with / or ending in .toml
        scene: String,
    },
    /// Pause the node at its next step boundary
    Pause,
    /// Resume a paused node
    Resume,
    /// Run COUNT steps of a paused node, and wait for the last one
    ///
    /// With --timeout, the wait ends after this time and that of one step. The node goes on to the last
    /// step all the same, or until `ctl pause`.
    #[command(after_help = "Example: sim-node ctl step 10")]
    Step {
        /// Number of steps, 1 to 4294967295
        #[arg(default_value_t = 1, value_parser = whole::<u32>(1..=u64::from(u32::MAX)))]
        count: u32,
    },
    /// Restore the initial state in the next step; the step number continues
    Reset,
    /// Put an earlier state in place, as the state of the next step; the step number continues
    ///
    /// The state is the nearest kept one at or before the target. `sim-node run --history` sets the memory
    /// for past states: the node keeps every step while it fits, then old states at growing distances.
    /// A replay (`recorder play`) continues at the target, as a new run, and --to-step also goes forward.
    #[command(after_help = "Examples:\n  \
        sim-node ctl rewind 2s\n  \
        sim-node ctl rewind --to-step 480")]
    Rewind(RewindArgs),
    /// Mark the next step in the log with a text; nothing else changes
    ///
    /// The mark is an outcome like that of any other command, so every recording has it. A recorder with
    /// --black-box then writes what it has kept.
    #[command(after_help = "Example: sim-node ctl mark 'the sleeve slips'")]
    Mark {
        /// Text of at most 160 bytes
        #[arg(value_parser = NonEmptyStringValueParser::new())]
        text: String,
    },
}

#[derive(Debug, ClapArgs)]
#[group(required = true, multiple = false)]
pub(crate) struct RewindArgs {
    /// Simulated time to go back, such as 2s or 500ms. Steps that an earlier rewind has left behind do not
    /// count
    #[arg(value_parser = time)]
    pub(crate) time: Option<Duration>,
    /// Step of the run to go back to
    #[arg(long, value_name = "N", value_parser = whole::<u64>(0..=u64::MAX))]
    pub(crate) to_step: Option<u64>,
}

/// A point, as three arguments.
#[derive(Debug, Clone, Copy, ClapArgs)]
pub(crate) struct PointArgs {
    /// Point in m, relative to the origin of the scene
    #[arg(value_parser = number)]
    x: f32,
    /// Point in m, relative to the origin of the scene
    #[arg(value_parser = number)]
    y: f32,
    /// Point in m, relative to the origin of the scene
    #[arg(value_parser = number)]
    z: f32,
}

impl PointArgs {
    pub(crate) fn vector(self) -> [f32; 3] {
        [self.x, self.y, self.z]
    }
}

#[derive(Debug, ClapArgs)]
#[command(allow_negative_numbers = true)]
pub(crate) struct TargetArgs {
    /// Index of the particle
    #[arg(value_parser = index)]
    pub(crate) particle: u32,
    #[command(flatten)]
    pub(crate) target: PointArgs,
    /// Time to the target in seconds, such as 0.1, or with its unit, such as 100ms: at most an hour, rounded up to whole
    /// steps [default: 1/60 s]
    #[arg(long, value_name = "TIME", default_value_t = GRAB_OVER_S_DEFAULT,
        hide_default_value = true, value_parser = seconds_up_to(OVER_S_MAX))]
    pub(crate) over: f32,
}

#[derive(Debug, ClapArgs)]
#[command(
    allow_negative_numbers = true,
    after_help = "Example: sim-node ctl push 0.5 0.5 0 --radius 0.2 --delta 0 0 -0.01 --limit 0.02"
)]
pub(crate) struct PushArgs {
    #[command(flatten)]
    pub(crate) center: PointArgs,
    /// Radius of the sphere in m; a particle at exactly this distance is outside
    #[arg(long, value_name = "R", value_parser = number)]
    pub(crate) radius: f32,
    /// Displacement of the particles in the next step, in m
    #[arg(long, num_args = 3, action = ArgAction::Set, required = true,
        value_names = ["DX", "DY", "DZ"], value_parser = number)]
    pub(crate) delta: Vec<f32>,
    /// Limit on each component of DELTA, in m [default: no limit]
    #[arg(long, value_name = "L", value_parser = number)]
    pub(crate) limit: Option<f32>,
}

#[derive(Debug, ClapArgs)]
#[command(
    allow_negative_numbers = true,
    after_help = "Example: sim-node ctl cut-radius 0.5 0.5 0 --radius 0.1"
)]
pub(crate) struct CutRadiusArgs {
    #[command(flatten)]
    pub(crate) center: PointArgs,
    /// Radius of the sphere in m; a particle at exactly this distance is outside
    #[arg(long, value_name = "R", value_parser = number)]
    pub(crate) radius: f32,
}

#[derive(Debug, ClapArgs)]
#[command(
    allow_negative_numbers = true,
    after_help = "Example: sim-node ctl cut-segment --from 0 0.5 0 --to 1 0.5 0 --direction 0 0 1"
)]
pub(crate) struct CutSegmentArgs {
    /// Start of the segment in m, relative to the origin of the scene
    #[arg(long, num_args = 3, action = ArgAction::Set, required = true,
        value_names = ["X", "Y", "Z"], value_parser = number)]
    pub(crate) from: Vec<f32>,
    /// End of the segment in m, relative to the origin of the scene
    #[arg(long, num_args = 3, action = ArgAction::Set, required = true,
        value_names = ["X", "Y", "Z"], value_parser = number)]
    pub(crate) to: Vec<f32>,
    /// Direction in which the strip extends from the segment, without end to both sides
    #[arg(long, num_args = 3, action = ArgAction::Set, default_values = ["0", "0", "1"],
        value_names = ["DX", "DY", "DZ"], value_parser = number)]
    pub(crate) direction: Vec<f32>,
}

#[derive(Debug, ClapArgs)]
#[command(
    allow_negative_numbers = true,
    after_help = "Example: sim-node ctl drive-body 0 0 0.1 0 --velocity 0 -1.5 0 --force 2 0 0"
)]
pub(crate) struct DriveBodyArgs {
    /// Index of the collider that is the body
    #[arg(value_parser = index)]
    pub(crate) collider: u32,
    #[command(flatten)]
    pub(crate) pose: PoseArgs,
    /// Velocity of its center, in m/s
    #[arg(long, num_args = 3, action = ArgAction::Set, default_values = ["0", "0", "0"],
        value_names = ["VX", "VY", "VZ"], value_parser = number)]
    pub(crate) velocity: Vec<f32>,
    /// Angular velocity, in rad/s
    #[arg(long, num_args = 3, action = ArgAction::Set, default_values = ["0", "0", "0"],
        value_names = ["WX", "WY", "WZ"], value_parser = number)]
    pub(crate) angular_velocity: Vec<f32>,
    /// Force on its center in N, beside gravity and the contacts
    #[arg(long, num_args = 3, action = ArgAction::Set, default_values = ["0", "0", "0"],
        value_names = ["FX", "FY", "FZ"], value_parser = number)]
    pub(crate) force: Vec<f32>,
    /// Torque about its center in N m, beside that of the contacts
    #[arg(long, num_args = 3, action = ArgAction::Set, default_values = ["0", "0", "0"],
        value_names = ["TX", "TY", "TZ"], value_parser = number)]
    pub(crate) torque: Vec<f32>,
}

/// A pose relative to the pose at load.
#[derive(Debug, ClapArgs)]
pub(crate) struct PoseArgs {
    /// Translation from the pose at load, in m
    #[arg(value_parser = number)]
    pub(crate) x: f32,
    /// Translation from the pose at load, in m
    #[arg(value_parser = number)]
    pub(crate) y: f32,
    /// Translation from the pose at load, in m
    #[arg(value_parser = number)]
    pub(crate) z: f32,
    /// Rotation from the pose at load, as a quaternion
    #[arg(long, num_args = 4, action = ArgAction::Set, default_values = ["0", "0", "0", "1"],
        value_names = ["QX", "QY", "QZ", "QW"], value_parser = number)]
    pub(crate) rotation: Vec<f32>,
}

/// The time of a motion.
#[derive(Debug, Clone, Copy, ClapArgs)]
pub(crate) struct OverArgs {
    /// Time to the pose in seconds, such as 0.1, or with its unit, such as 100ms: at most an hour, rounded up to whole
    /// steps [default: one step]
    #[arg(long, value_name = "TIME", default_value_t = 0.0, hide_default_value = true,
        value_parser = seconds_up_to(OVER_S_MAX))]
    pub(crate) over: f32,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct FollowArgs {
    /// Kind of the object
    #[arg(value_parser = moved_object())]
    pub(crate) object: MovedObject,
    /// Index of the particle, anchor or collider
    #[arg(value_parser = index)]
    pub(crate) index: u32,
    /// File with the points
    #[arg(long, value_name = "FILE")]
    pub(crate) path: PathBuf,
    /// Append the points to the motion under way, whose times go on
    #[arg(long)]
    pub(crate) append: bool,
}

/// Parser of the name of an object.
fn moved_object() -> impl TypedValueParser<Value = MovedObject> {
    const ALL: [(&str, MovedObject); 3] = [
        ("particle", MovedObject::Particle),
        ("anchor", MovedObject::Anchor),
        ("collider", MovedObject::Collider),
    ];
    PossibleValuesParser::new(ALL.map(|(name, _)| name)).try_map(|name| {
        let named = ALL.into_iter().find(|(one, _)| *one == name);
        named.map(|(_, object)| object).ok_or("there is no such object")
    })
}

#[derive(Debug, ClapArgs)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:\n  \
        sim-node ctl set damping 0.5\n  \
        sim-node ctl set gravity 0 -1.6 0\n  \
        sim-node ctl set tear_stretch off\n  \
        sim-node ctl set compliance 1e-4 --kind bend\n  \
        sim-node ctl set bending 1e-3 --block 1\n  \
        sim-node ctl set friction 0.3 --collider 2"
)]
pub(crate) struct SetArgs {
    #[arg(help = parameters_help(), value_parser = parameter_name)]
    pub(crate) parameter: String,
    /// A number, three numbers for a vector, or "off"
    #[arg(num_args = 1..=3, required = true, value_name = "VALUE", value_parser = setting_word)]
    pub(crate) values: Vec<SettingWord>,
    /// Kind of constraints that receive the compliance or stiffness [default: all kinds]
    #[arg(long, value_name = "KIND", value_parser = constraint_kind())]
    pub(crate) kind: Option<ConstraintKind>,
    /// Generated block of the scene whose bends receive the bending, counted from 0 [default: all bends]
    #[arg(long, value_name = "N", value_parser = index)]
    pub(crate) block: Option<u32>,
    /// Collider that receives the friction or restitution, counted from 0 [default: all colliders]
    #[arg(long, value_name = "N", value_parser = index)]
    pub(crate) collider: Option<u32>,
}

/// Parser of the name of a kind; the help lists the names.
fn constraint_kind() -> impl TypedValueParser<Value = ConstraintKind> {
    PossibleValuesParser::new(ConstraintKind::ALL.map(ConstraintKind::name))
        .try_map(|name| ConstraintKind::from_name(&name).ok_or("there is no such kind"))
}

/// One word of the value of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum SettingWord {
    Number(f32),
    Off,
}

fn setting_word(text: &str) -> Result<SettingWord, String> {
    if text == "off" {
        return Ok(SettingWord::Off);
    }
    let number = text.parse().map_err(|_| "it must be a number or \"off\"".to_owned());
    number.map(SettingWord::Number)
}

impl SetArgs {
    /// Value that the words form together.
    pub(crate) fn value(&self) -> Result<ParameterValue, &'static str> {
        use SettingWord::{Number, Off};
        match *self.values {
            [Off] => Ok(ParameterValue::Off),
            [Number(number)] => Ok(ParameterValue::Number(number)),
            [Number(x), Number(y), Number(z)] => Ok(ParameterValue::Vector([x, y, z])),
            _ => Err("VALUE must be one number, three numbers for a vector, or \"off\" alone"),
        }
    }
}
