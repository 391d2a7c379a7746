//! The messages, services and client API shared by `sim-node` and every process beside it.
//!
//! A node publishes each state in shared memory, as one [`SnapshotHeader`] and a slice of
//! [`ParticleState`]s. Any process reads them without a copy and sends [`Action`]s back. Sending is
//! not delivery: only the [`Outcome`] proves that a command took effect, and at which step.
//!
//! - [`Client`] reads snapshots and sends commands.
//! - [`Tap`] reads everything, as a sequence of coherent [`State`]s.
//! - [`Domain`] lists the nodes of a domain.
//! - [`Owner`] publishes everything and receives the commands: the node, or a replay.
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
//! if outcome.is_applied() {
//!     println!("pinned at step {}", outcome.step);
//! } else {
//!     println!("rejected: {}", outcome.reason_name());
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Services
//! The name of a service begins with the name of the simulation, as in `sim/particles`. Late
//! subscribers receive the latest message of every service except commands, outcomes and wake.
//!
//! | service | payload; header | written |
//! |---|---|---|
//! | particles | [`ParticleState`]s; [`SnapshotHeader`] | after every step; with `--every n` after every n-th, and the last one before a pause |
//! | keyframe | bytes; [`KeyframeHeader`] | per load, when a reader joins, after commands except `move`, and every second: the state that particles lack |
//! | scene, topology, bends, surface | TOML, [`ConstraintState`]s, [`BendState`]s, [`Triangle`]s; [`LoadHeader`] | once per load |
//! | colliders | [`ColliderState`]s; [`CollidersHeader`] | per load, on a change, and each step while one moves |
//! | tears | [`TornConstraint`]s; [`TearsHeader`] | per load, on a tear and on a reset: all constraints torn since |
//! | parameters | [`ParameterState`]s; [`ParametersHeader`] | per load and on a change: all values |
//! | forces | [`ForceRow`]s; [`ForcesHeader`] | after every step while a client reads them: the impulses on colliders, anchors and fixed particles |
//! | commands | [`Command`] | by clients |
//! | outcomes | [`Outcome`] | for every command |
//! | status | [`NodeStatus`] | ten times a second, and after a change of the lockstep |
//! | wake | [`Wake`] events | after a snapshot, load, tear, outcome or status, and when the owner goes |
//!
//! This crate knows no solver, and no other crate knows iceoryx2.
#![deny(unsafe_code)]

mod client;
mod domain;
mod endpoint;
mod owner;
mod ports;
pub mod testing;

pub use client::Client;
pub use client::change::{Change, LostChanges};
pub use client::loaded_scene::LoadedScene;
pub use client::lockstep::LockstepError;
pub use client::request::{OwnerState, RequestError};
pub use client::restoring::SentState;
pub use client::state::State;
pub use client::tap::Tap;
pub use client::views::{Bends, Colliders, Forces, Parameters, Snapshot, Surface, Topology};
pub use domain::Domain;
pub use domain::config_file::{ConfigFile, ConfigFileError};
pub use domain::nodes::{ListedNode, NodeAnswer};
pub use endpoint::{DOMAIN_VARIABLE, Endpoint, EndpointError, NAME_DEFAULT};
pub use owner::Owner;
pub use owner::error::OwnerError;
pub use owner::load::Load;
pub use owner::preparation::{LoadPreparer, ReplacedMemory};
pub use ports::connection::{ConnectionId, ReceivedCommand};
pub use ports::domain::root::RootError;
pub use ports::leftovers::on_request::{Leftover, LeftoverKind};
pub use ports::memory::MemoryError;
pub use ports::reader::ReadError;
pub use ports::service::ServiceError;
pub use ports::services::AttachError;
pub use ports::wake::Wake;
pub use ports::writer::PublishError;
pub use sim_messages::*;
pub use testing::ScratchDomain;
