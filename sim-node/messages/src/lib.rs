//! The messages of a simulation, as plain data with a fixed layout, and the limits of every queue.
//!
//! `sim-contract` carries them through shared memory, and `recording` through files. This crate names no
//! service of iceoryx2 and no operating system, so it compiles for every target. The words of `sim-types` that
//! messages contain are part of it.
#![forbid(unsafe_code)]

mod collider;
mod command;
mod forces;
mod limits;
mod lockstep;
mod parameters;
mod remedy;
mod restore;
mod snapshot;
mod status;
mod tears;
mod topology;
mod update;

pub use collider::{ColliderState, CollidersHeader};
pub use command::{
    CONSOLE_CLIENT_ID, Command, OUTCOME_FLAG_CONTROL, OUTCOME_FLAG_DISCONNECTED,
    OUTCOME_FLAG_NEW_RUN, Outcome, OutcomeStatus,
};
pub use forces::{ForceKind, ForceRow, ForcesHeader};
pub use limits::*;
pub use lockstep::{MemberChange, MemberChangeKind, MemberChanges, Ready};
pub use parameters::{ParameterState, ParametersHeader};
pub use restore::{GivenState, MalformedState, ReceivedState, RestoreHeader, scene_hash};
pub use sim_types::{
    ACTIONS, Action, ActionInfo, Affects, BlockValue, CLIENT_ID_END, COLLIDERS_MAX, COORDINATE_MAX,
    ColliderFields, ColliderShape, ConstraintKind, ELEMENTS_MAX, FieldForm, FieldInfo,
    GRAB_OVER_S_DEFAULT, KindFilter, MOTION_POINTS_MAX, Method, MovedObject, NumberRange,
    OVER_S_MAX, OffMeaning, PARAMETERS, Parameter, ParameterInfo, ParameterValue, ParameterValues,
    Part, ParticleFlags, Parts, PathError, PathPart, PathPoint, PlainF32, PointFault, Reason,
    RestoreContents, SCENE_SIZE_BYTES_MAX, SETTINGS_COUNT, STEP_WORK_MAX, Setting, Slider,
    StopFlag, TearCause, Text, TextError, ValueForm, allowed_indices, json_hash, printable,
    printable_line,
};
pub use snapshot::{ParticleState, SnapshotFlags, SnapshotHeader};
pub use status::{MemberStatus, NodeStatus, StatusFlags};
pub use tears::{TearsHeader, Torn, TornConstraint};
pub use topology::{BendState, ConstraintState, KeyframeHeader, LoadHeader, Triangle};
pub use update::Update;
