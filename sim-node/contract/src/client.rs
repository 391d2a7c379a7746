//! The client API: reads snapshots and sends commands.

pub(crate) mod arrivals;
pub(crate) mod change;
mod latch;
pub(crate) mod loaded_scene;
pub(crate) mod lockstep;
pub(crate) mod membership;
pub(crate) mod repeats;
pub(crate) mod request;
pub(crate) mod restoring;
pub(crate) mod state;
pub(crate) mod tap;
pub(crate) mod views;
pub(crate) mod watch;

use std::mem;
use std::time::Duration;

use sim_messages::{
    Action, BendState, CLIENT_ID_END, ColliderState, CollidersHeader, ConstraintState, LoadHeader,
    NodeStatus, Outcome, ParameterState, ParametersHeader, ParticleState, Reason, SnapshotHeader,
    TearsHeader, Torn, TornConstraint, Triangle, allowed_indices,
};

use crate::client::latch::{ForcesReader, Latch, Search};
use crate::client::lockstep::{LockstepError, Member};
use crate::client::request::{Commander, RequestError, random_client_id};
use crate::client::views::{Bends, Colliders, Forces, Parameters, Snapshot, Surface, Topology};
use crate::client::watch::Watch;
use crate::endpoint::Endpoint;
use crate::ports::reader::{ReadError, Reader};
use crate::ports::service::{
    BENDS, COLLIDERS, PARAMETERS, PARTICLES, SCENE, STATUS, SURFACE, ServiceError, TEARS, TOPOLOGY,
};
use crate::ports::services::{AttachError, Attachment};

/// A program's connection to a simulation: reads snapshots, sends commands.
///
/// Each method connects to its services when it is first called, so a program that only reads takes
/// no place from the clients that send commands, and vice versa. A client outlives the owner: when a
/// new owner claims the name, reading continues, with another `run_id` in the headers.
/// Messages of processes that do not own the name are ignored.
///
/// Timeouts are upper limits. A method that waits returns `None` early if the owner goes meanwhile;
/// [`Client::is_owner_alive`] distinguishes that from silence.
#[derive(Debug)]
pub struct Client {
    id: u64,
    watch: Watch,
    particles: Option<Reader<ParticleState, SnapshotHeader>>,
    topology: Option<Latch<ConstraintState, LoadHeader>>,
    bends: Option<Latch<BendState, LoadHeader>>,
    surface: Option<Latch<Triangle, LoadHeader>>,
    scene: Option<Latch<u8, LoadHeader>>,
    tears: Option<Latch<TornConstraint, TearsHeader>>,
    parameters: Option<Latch<ParameterState, ParametersHeader>>,
    colliders: Option<Latch<ColliderState, CollidersHeader>>,
    forces: Option<ForcesReader>,
    status: Option<StatusReader>,
    commander: Option<Commander>,
    member: Option<Member>,
    // Dropped last: the ports belong to its services and its node.
    attachment: Attachment,
}

/// Longest wait of a dropped client for the outcomes of its commands.
const DROP_TIMEOUT: Duration = Duration::from_millis(200);

impl Client {
    /// Attaches to a running simulation with a random client id.
    ///
    /// # Errors
    /// No simulation runs there, it has another version of the contract, or `/dev/shm` is full.
    pub fn attach(endpoint: &Endpoint) -> Result<Self, AttachError> {
        Self::attach_as(endpoint, random_client_id()?)
    }

    /// Attaches as the client `client_id`. Only clients with this id can move the particles
    /// that it grabs. Several processes may use [`crate::CONSOLE_CLIENT_ID`]; any other id belongs to one
    /// process at a time.
    ///
    /// # Errors
    /// Same as [`Client::attach`], or the id is not below [`crate::CLIENT_ID_END`].
    pub fn attach_as(endpoint: &Endpoint, client_id: u64) -> Result<Self, AttachError> {
        if client_id >= CLIENT_ID_END {
            return Err(AttachError::ClientId { client_id });
        }
        let attachment = Attachment::to(endpoint)?;
        Ok(Self {
            id: client_id,
            watch: Watch::default(),
            particles: None,
            topology: None,
            bends: None,
            surface: None,
            scene: None,
            tears: None,
            parameters: None,
            colliders: None,
            forces: None,
            status: None,
            commander: None,
            member: None,
            attachment,
        })
    }

    /// Returns the id in this client's commands.
    pub fn client_id(&self) -> u64 {
        self.id
    }

    /// Returns the oldest unread snapshot, or waits for the next one. The first call returns the
    /// latest published snapshot. A reader more than [`crate::SNAPSHOTS_BUFFERED`] snapshots behind
    /// misses some; `snapshot_index` in the header shows it.
    ///
    /// # Errors
    /// The program already holds [`crate::BORROWED_SAMPLES_MAX`] snapshots, a malformed one arrived,
    /// the service has no place for another reader, or `/dev/shm` none for the reader's memory.
    pub fn next_snapshot(&mut self, timeout: Duration) -> Result<Option<Snapshot>, ReadError> {
        let reader = open_particles(&mut self.particles, &self.attachment)?;
        self.watch.wait_for(&self.attachment, timeout, || Ok(reader.next()?.map(Snapshot)))
    }

    /// Returns the newest unread snapshot and skips those before it, or waits for the next one.
    ///
    /// # Errors
    /// Same as [`Client::next_snapshot`].
    pub fn latest_snapshot(&mut self, timeout: Duration) -> Result<Option<Snapshot>, ReadError> {
        let reader = open_particles(&mut self.particles, &self.attachment)?;
        self.watch.wait_for(&self.attachment, timeout, || Ok(reader.newest()?.map(Snapshot)))
    }

    /// Returns the newest topology. Waits only if none was published yet. It belongs to the snapshots
    /// with the same `run_id` and `topology_revision`.
    ///
    /// # Errors
    /// A malformed message arrived, the service has no place for another reader, or `/dev/shm` none for
    /// the reader's memory.
    pub fn topology(&mut self, timeout: Duration) -> Result<Option<Topology>, ReadError> {
        let Attachment { services, source, .. } = &self.attachment;
        let create = || Latch::create(&services.topology, &TOPOLOGY, source);
        let latch = get_or_create(&mut self.topology, create)?;
        self.watch.wait_for(&self.attachment, timeout, || {
            Ok(latch.newest(&self.attachment)?.map(|sample| Topology {
                header: *sample.user_header(),
                constraints: sample.payload().to_vec(),
            }))
        })
    }

    /// Returns the newest bends, like [`Client::topology`]. A scene without bends has an empty list.
    ///
    /// # Errors
    /// Same as [`Client::topology`].
    pub fn bends(&mut self, timeout: Duration) -> Result<Option<Bends>, ReadError> {
        let Attachment { services, source, .. } = &self.attachment;
        let create = || Latch::create(&services.bends, &BENDS, source);
        let latch = get_or_create(&mut self.bends, create)?;
        self.watch.wait_for(&self.attachment, timeout, || {
            Ok(latch.newest(&self.attachment)?.map(|sample| Bends {
                header: *sample.user_header(),
                bends: sample.payload().to_vec(),
            }))
        })
    }

    /// Returns the newest surface, like [`Client::topology`]. A scene without triangles has an empty
    /// surface.
    ///
    /// # Errors
    /// Same as [`Client::topology`].
    pub fn surface(&mut self, timeout: Duration) -> Result<Option<Surface>, ReadError> {
        let Attachment { services, source, .. } = &self.attachment;
        let create = || Latch::create(&services.surface, &SURFACE, source);
        let latch = get_or_create(&mut self.surface, create)?;
        self.watch.wait_for(&self.attachment, timeout, || {
            Ok(latch.newest(&self.attachment)?.map(|sample| Surface {
                header: *sample.user_header(),
                triangles: sample.payload().to_vec(),
            }))
        })
    }

    /// Returns the newest scene as TOML, like [`Client::topology`].
    ///
    /// # Errors
    /// Same as [`Client::topology`], or the text is not UTF-8.
    pub fn scene(&mut self, timeout: Duration) -> Result<Option<String>, ReadError> {
        let Attachment { services, source, .. } = &self.attachment;
        let create = || Latch::create(&services.scene, &SCENE, source);
        let latch = get_or_create(&mut self.scene, create)?;
        let bytes = self.watch.wait_for(&self.attachment, timeout, || {
            Ok(latch.newest(&self.attachment)?.map(|sample| sample.payload().to_vec()))
        })?;
        bytes.map(String::from_utf8).transpose().map_err(|error| ReadError::Malformed {
            service: self.attachment.session.service_name(&SCENE),
            detail: error.to_string(),
        })
    }

    /// Returns all torn constraints, with their causes. Waits only if
    /// no list was published yet; an owner publishes an empty list with the load. Returns an empty
    /// list after `timeout`.
    ///
    /// # Errors
    /// Same as [`Client::topology`].
    pub fn torn(&mut self, timeout: Duration) -> Result<Torn, ReadError> {
        let Attachment { services, source, .. } = &self.attachment;
        let create = || Latch::create(&services.tears, &TEARS, source);
        let latch = get_or_create(&mut self.tears, create)?;
        let torn = self.watch.wait_for(&self.attachment, timeout, || {
            Ok(latch.newest(&self.attachment)?.map(|sample| Torn {
                header: *sample.user_header(),
                constraints: sample.payload().to_vec(),
            }))
        })?;
        Ok(torn.unwrap_or_default())
    }

    /// Returns the newest values of all parameters. Waits only if none were published yet.
    ///
    /// # Errors
    /// Same as [`Client::topology`].
    pub fn parameters(&mut self, timeout: Duration) -> Result<Option<Parameters>, ReadError> {
        let Attachment { services, source, .. } = &self.attachment;
        let create = || Latch::create(&services.parameters, &PARAMETERS, source);
        let latch = get_or_create(&mut self.parameters, create)?;
        self.watch.wait_for(&self.attachment, timeout, || {
            Ok(latch.newest(&self.attachment)?.map(|sample| Parameters {
                header: *sample.user_header(),
                values: ParameterState::to_values(sample.payload()),
            }))
        })
    }

    /// Returns the colliders in their newest poses. Waits only if none were published yet. Returns an
    /// empty list after `timeout`.
    ///
    /// # Errors
    /// Same as [`Client::topology`].
    pub fn colliders(&mut self, timeout: Duration) -> Result<Colliders, ReadError> {
        let Attachment { services, source, .. } = &self.attachment;
        let create = || Latch::create(&services.colliders, &COLLIDERS, source);
        let latch = get_or_create(&mut self.colliders, create)?;
        let colliders = self.watch.wait_for(&self.attachment, timeout, || {
            Ok(latch.newest(&self.attachment)?.map(|sample| Colliders {
                header: *sample.user_header(),
                colliders: sample.payload().to_vec(),
            }))
        })?;
        Ok(colliders.unwrap_or_default())
    }

    /// Returns the newest forces on colliders, anchors and fixed particles. Waits only if none have arrived.
    ///
    /// The owner computes them only while a client reads them, so the first call waits for the next step, and a
    /// paused node has none for a reader that comes then. From the first call on, each step costs the owner a
    /// little more time. In the lockstep, call it once with no timeout before the first turn.
    ///
    /// # Errors
    /// Same as [`Client::topology`].
    pub fn forces(&mut self, timeout: Duration) -> Result<Option<Forces>, ReadError> {
        let create = || ForcesReader::create(&self.attachment);
        let reader = get_or_create(&mut self.forces, create)?;
        self.watch.wait_for(&self.attachment, timeout, || reader.newest())
    }

    /// Returns the forces of the step of a snapshot, which are published before it. `None` if there are none: the
    /// snapshot is from before the first call, or more than [`crate::SNAPSHOTS_BUFFERED`] steps old, or forces of a later
    /// step were read. Call it for snapshots in their order.
    ///
    /// # Errors
    /// Same as [`Client::topology`].
    pub fn forces_of(
        &mut self,
        snapshot: &SnapshotHeader,
        timeout: Duration,
    ) -> Result<Option<Forces>, ReadError> {
        let create = || ForcesReader::create(&self.attachment);
        let reader = get_or_create(&mut self.forces, create)?;
        let search = self.watch.wait_for(&self.attachment, timeout, || reader.of_step(snapshot))?;
        Ok(match search {
            Some(Search::Found(forces)) => Some(forces),
            Some(Search::Passed) | None => None,
        })
    }

    /// Returns the newest unread status, or waits for the next one.
    ///
    /// # Errors
    /// The service has no place for another reader, or `/dev/shm` none for the reader's memory.
    pub fn status(&mut self, timeout: Duration) -> Result<Option<NodeStatus>, ReadError> {
        let create = || StatusReader::create(&self.attachment);
        let reader = get_or_create(&mut self.status, create)?;
        self.watch.wait_for(&self.attachment, timeout, || {
            reader.receive()?;
            Ok(reader.take_unread())
        })
    }

    /// Sends a command without waiting for its outcome. Returns its sequence number. Only the outcome
    /// proves that the command took effect; see [`Client::next_outcome`].
    ///
    /// # Errors
    /// No owner receives commands, [`crate::COMMANDS_BUFFERED`] commands of this client are waiting, or
    /// `/dev/shm` is full.
    pub fn send(&mut self, action: Action) -> Result<u64, RequestError> {
        let commander = open_commander(&mut self.commander, &self.attachment, self.id)?;
        commander.send(&self.attachment, action)
    }

    /// Sends a command and waits for its outcome, applied or rejected.
    ///
    /// # Errors
    /// Same as [`Client::send`], or no outcome arrived within `timeout`. Then the effect of the command
    /// is unknown, and the error states whether the owner is alive, or that outcomes were missed.
    ///
    /// In its turn of the lockstep, a member would wait for itself, so the request is refused.
    pub fn request(&mut self, action: Action, timeout: Duration) -> Result<Outcome, RequestError> {
        self.check_turn()?;
        let commander = open_commander(&mut self.commander, &self.attachment, self.id)?;
        let missed_before = commander.missed_count();
        let sequence = commander.send(&self.attachment, action)?;
        let outcome = self.wait_for_outcome(sequence, missed_before, timeout);
        self.forget(sequence);
        outcome
    }

    /// Waits for the outcome of a command that [`Client::send`] has sent. After a timeout, it can be called
    /// again: a program that must react to something else waits in short parts.
    ///
    /// # Errors
    /// Same as [`Client::request`].
    pub fn outcome(&mut self, sequence: u64, timeout: Duration) -> Result<Outcome, RequestError> {
        self.check_turn()?;
        let commander = open_commander(&mut self.commander, &self.attachment, self.id)?;
        let missed_before = commander.missed_count();
        self.wait_for_outcome(sequence, missed_before, timeout)
    }

    /// Returns the outcome of a sent command if it has arrived, also in this client's turn of the lockstep.
    ///
    /// # Errors
    /// Same as [`Client::status`].
    pub fn arrived_outcome(&mut self, sequence: u64) -> Result<Option<Outcome>, ReadError> {
        self.commander.as_mut().map_or(Ok(None), |commander| commander.outcome_for(sequence))
    }

    /// Returns `true` in this client's turn of the lockstep, in which the node answers no request.
    pub fn is_in_turn(&self) -> bool {
        self.member.as_ref().is_some_and(Member::is_in_turn)
    }

    /// Refuses a request that the node would answer only after this client's turn.
    fn check_turn(&self) -> Result<(), RequestError> {
        if self.is_in_turn() { Err(RequestError::InTurn) } else { Ok(()) }
    }

    fn wait_for_outcome(
        &mut self,
        sequence: u64,
        missed_before: u64,
        timeout: Duration,
    ) -> Result<Outcome, RequestError> {
        let commander = open_commander(&mut self.commander, &self.attachment, self.id)?;
        let poll = || commander.outcome_for(sequence);
        if let Some(outcome) = self.watch.wait_for(&self.attachment, timeout, poll)? {
            return Ok(outcome);
        }
        Err(match commander.missed_count() - missed_before {
            0 => RequestError::timeout(&self.attachment, sequence, timeout),
            missed_count => RequestError::OutcomesMissed { sequence, timeout, missed_count },
        })
    }

    /// Ignores a late outcome of a command.
    fn forget(&mut self, sequence: u64) {
        if let Some(commander) = &mut self.commander {
            commander.forget(sequence);
        }
    }

    /// Returns the remedy of a rejection in words, for an error message: that of [`Outcome::remedy`], or the allowed
    /// indices of the loaded scene. Only the scene itself names its anchors.
    ///
    /// Without an answer of the owner within `timeout`, there are no indices.
    pub fn remedy(&mut self, outcome: &Outcome, timeout: Duration) -> Option<String> {
        let count = match outcome.reason()? {
            Reason::UnknownParticle => self.load_header(timeout)?.particle_count as usize,
            Reason::UnknownConstraint => self.load_header(timeout)?.count as usize,
            Reason::UnknownCollider => {
                let colliders = self.colliders(timeout).ok()?;
                // Without an answer, the list is that of no run.
                (colliders.header.run_id != 0).then_some(colliders.colliders.len())?
            }
            _ => return outcome.remedy(),
        };
        Some(allowed_indices(count))
    }

    /// Returns the header of the newest topology without a copy of the constraints.
    fn load_header(&mut self, timeout: Duration) -> Option<LoadHeader> {
        let Attachment { services, source, .. } = &self.attachment;
        let create = || Latch::create(&services.topology, &TOPOLOGY, source);
        let latch = get_or_create(&mut self.topology, create).ok()?;
        let header = self.watch.wait_for(&self.attachment, timeout, || {
            Ok(latch.newest(&self.attachment)?.map(|sample| *sample.user_header()))
        });
        header.ok()?
    }

    /// Returns the next outcome of this client's commands, in the order of application. Outcomes that
    /// [`Client::request`] returned are left out. A client that has sent no command receives none.
    ///
    /// # Errors
    /// Same as [`Client::status`].
    pub fn next_outcome(&mut self, timeout: Duration) -> Result<Option<Outcome>, ReadError> {
        let commander = &mut self.commander;
        self.watch.wait_for(&self.attachment, timeout, || match commander {
            Some(commander) => commander.next_outcome(),
            None => Ok(None),
        })
    }

    /// Returns the newest snapshot that the node waits for this member at, or waits for it. Call
    /// [`Client::ready`] after handling it. `None` if none was published within `timeout`: the node is
    /// paused, or waits for another member or for its deadline, or is gone.
    ///
    /// # Errors
    /// Same as [`Client::next_snapshot`], or the client has not joined.
    pub fn next_turn(&mut self, timeout: Duration) -> Result<Option<Snapshot>, LockstepError> {
        let member = self.member.as_mut().ok_or(LockstepError::NotJoined)?;
        let reader = open_particles(&mut self.particles, &self.attachment)?;
        let snapshot = self.watch.wait_for(&self.attachment, timeout, || {
            Ok(reader.newest()?.map(Snapshot).filter(|one| member.takes_part(one.header())))
        })?;
        if let Some(snapshot) = &snapshot {
            // A status that names a member dropped in its turn precedes the next snapshot.
            // One that cannot be read does not take the turn.
            let status = self.status.as_mut().and_then(|reader| reader.receive().ok().flatten());
            member.begin_turn(snapshot.header(), status);
        }
        Ok(snapshot)
    }

    /// Ends the turn that [`Client::next_turn`] has begun. The commands of this client for the next step
    /// must have been sent before.
    ///
    /// # Errors
    /// The client has not joined, or there is no memory.
    pub fn ready(&mut self) -> Result<(), LockstepError> {
        self.member.as_mut().ok_or(LockstepError::NotJoined)?.ready()
    }

    /// Leaves the lockstep, if this client is a member. The node goes on without it.
    pub fn leave_lockstep(&mut self) {
        self.member = None;
    }

    /// Returns `true` if the process that owns the name is alive. Reads the file system: call it a few
    /// times per second at most.
    pub fn is_owner_alive(&self) -> bool {
        self.attachment.owner().is_some()
    }

    /// Returns `true` if the last owner of the name was killed, and `false` if it has ended by itself or is
    /// alive. As costly as [`Client::is_owner_alive`].
    pub fn was_owner_killed(&self) -> bool {
        self.attachment.session.is_lock_left() && !self.is_owner_alive()
    }
}

impl Drop for Client {
    /// Leaves the lockstep. Then waits briefly for the outcomes of sent commands, because commands that the
    /// owner has not received vanish with their client.
    fn drop(&mut self) {
        self.member = None;
        let Some(commander) = &mut self.commander else {
            return;
        };
        if commander.awaits_outcomes() && self.attachment.owner().is_some() {
            // On a timeout or an error, these commands are lost either way.
            let _ = self.watch.wait_for(&self.attachment, DROP_TIMEOUT, || {
                commander.receive_outcomes()?;
                Ok((!commander.awaits_outcomes()).then_some(()))
            });
        }
    }
}

/// A reader of the status that keeps the newest one.
#[derive(Debug)]
struct StatusReader {
    reader: Reader<NodeStatus>,
    newest: Option<NodeStatus>,
    is_unread: bool,
}

impl StatusReader {
    fn create(attachment: &Attachment) -> Result<Self, ServiceError> {
        let reader = Reader::create(&attachment.status, &STATUS, &attachment.source)?;
        Ok(Self { reader, newest: None, is_unread: false })
    }

    /// Returns the newest status that has arrived, read or not.
    fn receive(&mut self) -> Result<Option<&NodeStatus>, ReadError> {
        if let Some(status) = self.reader.newest_value()? {
            (self.newest, self.is_unread) = (Some(status), true);
        }
        Ok(self.newest.as_ref())
    }

    fn take_unread(&mut self) -> Option<NodeStatus> {
        self.newest.filter(|_| mem::take(&mut self.is_unread))
    }

    /// Lets the newest status be read once more.
    fn read_again(&mut self) {
        self.is_unread = true;
    }
}

fn open_particles<'a>(
    reader: &'a mut Option<Reader<ParticleState, SnapshotHeader>>,
    attachment: &Attachment,
) -> Result<&'a mut Reader<ParticleState, SnapshotHeader>, ServiceError> {
    let Attachment { services, source, .. } = attachment;
    get_or_create(reader, || Reader::create(&services.particles, &PARTICLES, source))
}

fn open_commander<'a>(
    commander: &'a mut Option<Commander>,
    attachment: &Attachment,
    client_id: u64,
) -> Result<&'a mut Commander, ServiceError> {
    get_or_create(commander, || Commander::create(attachment, client_id))
}

/// Returns the value in `slot`, created on first use.
fn get_or_create<T, E>(
    slot: &mut Option<T>,
    create: impl FnOnce() -> Result<T, E>,
) -> Result<&mut T, E> {
    match slot {
        Some(value) => Ok(value),
        None => Ok(slot.insert(create()?)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::owner::Owner;
    use crate::owner::load::Load;
    use crate::ports::port::Service;
    use crate::ports::service::OUTCOMES;
    use crate::ports::session::{Access, Session};
    use crate::ports::writer::{Capacity, Writer};
    use crate::testing::TestDomain;
    use sim_messages::Command;

    const OWNED: u64 = 7;
    const FOREIGN: u64 = 8;

    fn create_owner(endpoint: &Endpoint) -> Owner {
        let header = LoadHeader { run_id: OWNED, ..LoadHeader::default() };
        Owner::create(endpoint, &Load { header, ..Load::default() }).unwrap()
    }

    #[test]
    fn messages_of_processes_that_do_not_own_the_name_are_ignored() {
        let domain = TestDomain::new();
        let owner = create_owner(&domain.endpoint());
        let mut client = Client::attach_as(&domain.endpoint(), 3).unwrap();
        let sequence = client.send(Action::Pause).unwrap();
        let session = Session::join(&domain.endpoint()).unwrap();
        let (capacity, config) = (Capacity { len_max: 1, samples: 2 }, session.config());
        // One reader for each kind of service.
        let mut read_nothing = || {
            assert!(client.next_snapshot(Duration::ZERO).unwrap().is_none());
            assert_eq!(client.status(Duration::ZERO).unwrap(), None);
            assert_eq!(client.topology(Duration::ZERO).unwrap(), None);
            assert_eq!(client.arrived_outcome(sequence).unwrap(), None);
        };
        read_nothing();

        // The messages of a writer vanish with it, so the writers live until the end.
        let service: Service<ParticleState, SnapshotHeader> =
            session.service(&PARTICLES, Access::Open).unwrap();
        let particles = Writer::create(config, &service, capacity).unwrap();
        let header = SnapshotHeader { run_id: FOREIGN, ..SnapshotHeader::default() };
        particles.write(header, |_| ParticleState::default()).unwrap();

        let service: Service<ConstraintState, LoadHeader> =
            session.service(&TOPOLOGY, Access::Open).unwrap();
        let topology = Writer::create(config, &service, capacity).unwrap();
        let header = LoadHeader { run_id: FOREIGN, ..LoadHeader::default() };
        topology.write(header, |_| unreachable!()).unwrap();

        let service = session.service(&STATUS, Access::Open).unwrap();
        let status = Writer::of_values(config, &service, &STATUS).unwrap();
        status.send_value(NodeStatus { run_id: FOREIGN, ..NodeStatus::default() }).unwrap();

        let service = session.service(&OUTCOMES, Access::Open).unwrap();
        let outcomes = Writer::of_values(config, &service, &OUTCOMES).unwrap();
        let command = Command::new(3, sequence, Action::Pause);
        outcomes.send_value(Outcome::new(0, 1, command, Ok(()))).unwrap();
        read_nothing();

        owner.publish_status(&NodeStatus { run_id: OWNED, ..NodeStatus::default() }).unwrap();
        owner.refresh();
        assert_eq!(client.status(Duration::ZERO).unwrap().unwrap().run_id, OWNED);
        assert_eq!(client.topology(Duration::ZERO).unwrap().unwrap().header.run_id, OWNED);
    }
}
