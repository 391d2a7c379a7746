//! What third parties use: reading snapshots and sending commands.

pub(crate) mod request;
pub(crate) mod state;
pub(crate) mod tap;
pub(crate) mod views;
pub(crate) mod watch;

use std::time::Duration;

use crate::client::request::{Commander, RequestError};
use crate::client::views::{Colliders, Parameters, Snapshot, Surface, Topology, Torn};
use crate::client::watch::Watch;
use crate::endpoint::Endpoint;
use crate::messages::collider::{ColliderState, CollidersHeader};
use crate::messages::command::CONSOLE_CLIENT_ID;
use crate::messages::outcome::Outcome;
use crate::messages::parameters::to_values;
use crate::messages::parameters::{ParameterState, ParametersHeader};
use crate::messages::snapshot::{ParticleState, SnapshotHeader};
use crate::messages::status::NodeStatus;
use crate::messages::tears::{TearsHeader, TornConstraint};
use crate::messages::topology::{ConstraintState, LoadHeader, Triangle};
use crate::ports::latch::Latch;
use crate::ports::reader::{ReadError, SliceReader, ValueReader};
use crate::ports::service::{
    COLLIDERS, PARAMETERS, PARTICLES, SCENE, STATUS, SURFACE, ServiceError, TEARS, TOPOLOGY,
};
use crate::ports::services::{AttachError, Attachment};
use crate::ports::session::Session;
use sim_types::Action;

/// A program's connection to a simulation: reads snapshots, sends commands.
///
/// Each method takes its place at the services when it is first called: a program that only
/// watches takes none of those who command, and the other way round. A client survives the owner:
/// when a new one takes the name, reading goes on, with another `run_id` in the headers.
///
/// Timeouts are upper limits. A method that waits returns earlier, with `None`, if the owner goes
/// meanwhile; [`Client::is_owner_alive`] tells that from silence.
#[derive(Debug)]
pub struct Client {
    id: u64,
    watch: Watch,
    particles: Option<SliceReader<ParticleState, SnapshotHeader>>,
    topology: Option<Latch<ConstraintState, LoadHeader>>,
    surface: Option<Latch<Triangle, LoadHeader>>,
    scene: Option<Latch<u8, LoadHeader>>,
    tears: Option<Latch<TornConstraint, TearsHeader>>,
    parameters: Option<Latch<ParameterState, ParametersHeader>>,
    colliders: Option<Latch<ColliderState, CollidersHeader>>,
    status: Option<ValueReader<NodeStatus>>,
    commander: Option<Commander>,
    // Services and node go last.
    attachment: Attachment,
}

/// How long dropping a client waits for the outcomes of what it sent.
const FAREWELL_TIMEOUT: Duration = Duration::from_millis(200);

impl Client {
    /// Attaches to a running simulation as a client of its own, with a random id.
    ///
    /// # Errors
    /// No simulation runs there, or one of another version of the contract.
    pub fn attach(endpoint: &Endpoint) -> Result<Self, AttachError> {
        let random = getrandom::u64()
            .map_err(|error| AttachError::NoRandomNumber { detail: error.to_string() })?;
        // Below 2^53 it is exact in JSON.
        Self::attach_as(endpoint, (random >> 11).max(CONSOLE_CLIENT_ID + 1))
    }

    /// Attaches as the client `client_id`, below 2^53: what it grabs, only a client of that id can
    /// move. [`CONSOLE_CLIENT_ID`] may be used by several processes, any other by one at a time.
    ///
    /// # Errors
    /// As [`Client::attach`].
    pub fn attach_as(endpoint: &Endpoint, client_id: u64) -> Result<Self, AttachError> {
        let attachment = Attachment::open(Session::join(endpoint)?)?;
        Ok(Self {
            id: client_id,
            watch: Watch::default(),
            particles: None,
            topology: None,
            surface: None,
            scene: None,
            tears: None,
            parameters: None,
            colliders: None,
            status: None,
            commander: None,
            attachment,
        })
    }

    /// The id that this client's commands carry.
    pub fn client_id(&self) -> u64 {
        self.id
    }

    /// The oldest snapshot that was not read yet, or the next one. The first call gives the latest
    /// one that was published. Whoever is more than [`crate::SNAPSHOTS_BUFFERED`] behind misses
    /// some: the step in the header tells.
    ///
    /// # Errors
    /// More than [`crate::BORROWED_SAMPLES_MAX`] snapshots are held, or a malformed one came.
    pub fn next_snapshot(&mut self, timeout: Duration) -> Result<Option<Snapshot>, ReadError> {
        let reader = open_particles(&mut self.particles, &self.attachment)?;
        self.watch.wait_for(&self.attachment, timeout, || Ok(reader.next()?.map(Snapshot)))
    }

    /// The newest snapshot, those before it are skipped; waits for the next one if all were read.
    ///
    /// # Errors
    /// As [`Client::next_snapshot`].
    pub fn latest_snapshot(&mut self, timeout: Duration) -> Result<Option<Snapshot>, ReadError> {
        let reader = open_particles(&mut self.particles, &self.attachment)?;
        self.watch.wait_for(&self.attachment, timeout, || Ok(reader.newest()?.map(Snapshot)))
    }

    /// The newest topology; waits only if there has been none. It belongs to the snapshots with
    /// its `run_id` and `topology_revision`.
    ///
    /// # Errors
    /// A malformed message, or no place at the service.
    pub fn topology(&mut self, timeout: Duration) -> Result<Option<Topology>, ReadError> {
        let service = &self.attachment.services.topology;
        let latch = lazily(&mut self.topology, || Latch::create(service, &TOPOLOGY))?;
        self.watch.wait_for(&self.attachment, timeout, || {
            Ok(latch.newest()?.map(|sample| Topology {
                header: *sample.user_header(),
                constraints: sample.payload().to_vec(),
            }))
        })
    }

    /// The newest surface, as [`Client::topology`]. A scene without triangles has an empty one.
    ///
    /// # Errors
    /// As [`Client::topology`].
    pub fn surface(&mut self, timeout: Duration) -> Result<Option<Surface>, ReadError> {
        let service = &self.attachment.services.surface;
        let latch = lazily(&mut self.surface, || Latch::create(service, &SURFACE))?;
        self.watch.wait_for(&self.attachment, timeout, || {
            Ok(latch.newest()?.map(|sample| Surface {
                header: *sample.user_header(),
                triangles: sample.payload().to_vec(),
            }))
        })
    }

    /// The newest scene as TOML, as [`Client::topology`].
    ///
    /// # Errors
    /// As [`Client::topology`]; also text that is not UTF-8.
    pub fn scene(&mut self, timeout: Duration) -> Result<Option<String>, ReadError> {
        let service = &self.attachment.services.scene;
        let latch = lazily(&mut self.scene, || Latch::create(service, &SCENE))?;
        let bytes = self.watch.wait_for(&self.attachment, timeout, || {
            Ok(latch.newest()?.map(|sample| sample.payload().to_vec()))
        })?;
        bytes.map(String::from_utf8).transpose().map_err(|error| ReadError::Malformed {
            service: self.attachment.session.service_name(&SCENE),
            detail: error.to_string(),
        })
    }

    /// All constraints torn since the load, with their causes, however late this client came. Waits
    /// only if there has been no list at all: an owner publishes the first one, an empty one, with
    /// the load. Empty if none came within `timeout`.
    ///
    /// # Errors
    /// As [`Client::topology`].
    pub fn torn(&mut self, timeout: Duration) -> Result<Torn, ReadError> {
        let service = &self.attachment.services.tears;
        let latch = lazily(&mut self.tears, || Latch::create(service, &TEARS))?;
        let torn = self.watch.wait_for(&self.attachment, timeout, || {
            Ok(latch.newest()?.map(|sample| Torn {
                header: *sample.user_header(),
                constraints: sample.payload().to_vec(),
            }))
        })?;
        Ok(torn.unwrap_or_default())
    }

    /// Returns the newest values of all parameters. Waits only if none were published yet.
    ///
    /// # Errors
    /// As [`Client::topology`].
    pub fn parameters(&mut self, timeout: Duration) -> Result<Option<Parameters>, ReadError> {
        let service = &self.attachment.services.parameters;
        let latch = lazily(&mut self.parameters, || Latch::create(service, &PARAMETERS))?;
        self.watch.wait_for(&self.attachment, timeout, || {
            Ok(latch.newest()?.map(|sample| Parameters {
                header: *sample.user_header(),
                values: to_values(sample.payload()),
            }))
        })
    }

    /// The colliders as they stand, each in its newest pose; waits only if they have never been
    /// published. Empty if they were not within `timeout`.
    ///
    /// # Errors
    /// As [`Client::topology`].
    pub fn colliders(&mut self, timeout: Duration) -> Result<Colliders, ReadError> {
        let service = &self.attachment.services.colliders;
        let latch = lazily(&mut self.colliders, || Latch::create(service, &COLLIDERS))?;
        let colliders = self.watch.wait_for(&self.attachment, timeout, || {
            Ok(latch.newest()?.map(|sample| Colliders {
                header: *sample.user_header(),
                colliders: sample.payload().to_vec(),
            }))
        })?;
        Ok(colliders.unwrap_or_default())
    }

    /// The newest status that was not read yet, or the next one.
    ///
    /// # Errors
    /// No place at the service.
    pub fn status(&mut self, timeout: Duration) -> Result<Option<NodeStatus>, ReadError> {
        let service = &self.attachment.status;
        let reader = lazily(&mut self.status, || ValueReader::create(service, &STATUS))?;
        self.watch.wait_for(&self.attachment, timeout, || reader.newest())
    }

    /// Sends a command without waiting for its outcome, and returns its sequence number. That it
    /// was sent proves nothing: only its outcome does, see [`Client::next_outcome`].
    ///
    /// # Errors
    /// Nobody takes commands, or this client has [`crate::COMMANDS_BUFFERED`] waiting already.
    pub fn send(&mut self, action: Action) -> Result<u64, RequestError> {
        let commander = open_commander(&mut self.commander, &self.attachment, self.id)?;
        commander.send(&self.attachment, action)
    }

    /// Sends a command and waits for its outcome, which may be that it was rejected.
    ///
    /// # Errors
    /// As [`Client::send`], or no outcome within `timeout`: then what became of the command is not
    /// known, and the error says whether the owner is alive.
    pub fn request(&mut self, action: Action, timeout: Duration) -> Result<Outcome, RequestError> {
        let commander = open_commander(&mut self.commander, &self.attachment, self.id)?;
        let sequence = commander.send(&self.attachment, action)?;
        let poll = || commander.take_outcome_of(sequence);
        if let Some(outcome) = self.watch.wait_for(&self.attachment, timeout, poll)? {
            return Ok(outcome);
        }
        commander.give_up(sequence);
        Err(RequestError::timeout(&self.attachment, sequence, timeout))
    }

    /// The next outcome of a command that this client sent and has not been told the outcome of,
    /// in the order of application.
    ///
    /// # Errors
    /// No place at the service.
    pub fn next_outcome(&mut self, timeout: Duration) -> Result<Option<Outcome>, ReadError> {
        let commander = &mut self.commander;
        self.watch.wait_for(&self.attachment, timeout, || match commander {
            Some(commander) => commander.take_outcome(),
            None => Ok(None),
        })
    }

    /// Whether the process that owns the name is alive. Looks into the file system: meant for a
    /// few calls per second.
    pub fn is_owner_alive(&self) -> bool {
        self.attachment.owner().is_some()
    }
}

impl Drop for Client {
    /// Waits a moment for the outcomes of what was sent: a client that goes at once takes its
    /// commands with it.
    fn drop(&mut self) {
        let Some(commander) = &mut self.commander else {
            return;
        };
        if commander.awaits_outcomes() && self.attachment.owner().is_some() {
            // Whatever it ends with, nothing more can be done for these commands.
            let _ = self.watch.wait_for(&self.attachment, FAREWELL_TIMEOUT, || {
                commander.collect()?;
                Ok((!commander.awaits_outcomes()).then_some(()))
            });
        }
    }
}

fn open_particles<'a>(
    reader: &'a mut Option<SliceReader<ParticleState, SnapshotHeader>>,
    attachment: &Attachment,
) -> Result<&'a mut SliceReader<ParticleState, SnapshotHeader>, ServiceError> {
    lazily(reader, || SliceReader::create(&attachment.services.particles, &PARTICLES))
}

fn open_commander<'a>(
    commander: &'a mut Option<Commander>,
    attachment: &Attachment,
    client_id: u64,
) -> Result<&'a mut Commander, ServiceError> {
    lazily(commander, || Commander::create(attachment, client_id))
}

/// What is in `place`, created if there is nothing.
fn lazily<T, E>(place: &mut Option<T>, create: impl FnOnce() -> Result<T, E>) -> Result<&mut T, E> {
    match place {
        Some(present) => Ok(present),
        None => Ok(place.insert(create()?)),
    }
}
