//! The messages, services and client API shared by `sim-node` and every process beside it.
//!
//! A node publishes each state as one [`SnapshotHeader`] and a slice of [`ParticleState`] in
//! shared memory; any process reads it without a copy and sends [`Action`]s back. Sending is not
//! delivery: only the [`Outcome`] proves that a command took effect, and at which step.
//!
//! ```no_run
//! use std::time::Duration;
//! use sim_contract::{Action, Client, Endpoint};
//!
//! let mut client = Client::attach(&Endpoint::default())?;
//! if let Some(snapshot) = client.next_snapshot(Duration::from_secs(1))? {
//!     println!("step {} of {} particles", snapshot.header().step, snapshot.particles().len());
//! }
//! let outcome = client.request(Action::Pin { particle: 3 }, Duration::from_secs(1))?;
//! println!("pinned at step {}", outcome.step);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Services
//! Their names begin with that of the simulation, as `sim/particles`. All but commands, outcomes
//! and wake are latched: who comes late is given the newest message.
//!
//! | service | payload, header | written |
//! |---|---|---|
//! | particles | [`ParticleState`]s, [`SnapshotHeader`] | every step |
//! | keyframe | bytes, [`KeyframeHeader`] | now and then: what particles lack of the state |
//! | scene, topology, surface | TOML, [`ConstraintState`]s, [`Triangle`]s, [`LoadHeader`] | once per load |
//! | colliders | [`ColliderState`]s, [`CollidersHeader`] | per load, on change, each step while one moves |
//! | tears | [`TornConstraint`]s, [`TearsHeader`] | per load and on a tear: all since the load |
//! | parameters | [`ParameterState`]s, [`ParametersHeader`] | per load and on a change: all values |
//! | commands | [`Command`] | by clients |
//! | outcomes | [`Outcome`] | for every command |
//! | status | [`NodeStatus`] | ten times a second |
//! | wake | [`Wake`] events | with each of the above |
//!
//! There is no solver here, and no iceoryx2 outside of this crate.
#![forbid(unsafe_code)]

mod client;
pub mod clock;
mod collider;
mod command;
mod domain;
mod endpoint;
mod latch;
mod limits;
mod load;
mod outcome;
mod owner;
mod parameters;
mod ports;
mod reader;
mod request;
mod service;
mod services;
mod session;
mod snapshot;
mod status;
mod stop;
mod tap;
mod tears;
pub mod testing;
mod topology;
mod views;
mod wake;
mod watch;
mod writer;

pub use client::Client;
pub use collider::{ColliderState, CollidersHeader};
pub use command::{CONSOLE_CLIENT_ID, Command, CommandOptions};
pub use endpoint::{DOMAIN_VARIABLE, Endpoint, EndpointError, NAME_DEFAULT};
pub use limits::*;
pub use load::Load;
pub use outcome::{OUTCOME_FLAG_CONTROL, Outcome, OutcomeStatus};
pub use owner::{Owner, OwnerError};
pub use parameters::{ParameterState, ParametersHeader};
pub use reader::{Drained, ReadError};
pub use request::{OwnerSeen, RequestError};
pub use service::ServiceError;
pub use services::AttachError;
pub use sim_types::{
    Action, COORDINATE_MAX, ColliderShape, ConstraintKind, GRAB_OVER_S_DEFAULT, KindFilter, Method,
    NumberRange, OffMeaning, PARAMETERS, Parameter, ParameterInfo, ParameterValue, ParameterValues,
    ParticleFlags, PerKind, PlainF32, Reason, SETTINGS_COUNT, Setting, TearCause, Text, TextError,
    ValueForm,
};
pub use snapshot::{ParticleState, SnapshotFlags, SnapshotHeader};
pub use status::{NodeStatus, StatusFlags};
pub use stop::Stop;
pub use tap::{Tap, Update};
pub use tears::{TearsHeader, TornConstraint};
pub use topology::{ConstraintState, KeyframeHeader, LoadHeader, Triangle};
pub use views::{Colliders, Parameters, Snapshot, Surface, Topology, Torn};
pub use wake::Wake;
pub use writer::PublishError;

/// The README's programs compile.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct ReadmeDoctests;
