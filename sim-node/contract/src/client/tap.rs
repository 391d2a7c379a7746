//! The tap: reads everything that an owner publishes.

use std::num::NonZeroU32;
use std::sync::Arc;
use std::time::Duration;

use sim_host::clock::monotonic_ns;
use sim_messages::{
    BendState, COMMANDS_PER_STEP_MAX, ColliderState, CollidersHeader, ConstraintState, ForceRow,
    ForcesHeader, KeyframeHeader, LoadHeader, NodeStatus, OUTCOMES_BUFFERED, Outcome,
    ParameterState, ParametersHeader, ParticleState, SnapshotHeader, TearsHeader, TornConstraint,
    Triangle, UPDATES_BUFFERED, Update,
};

use crate::client::arrivals::{Arrivals, Copied};
use crate::client::change::LostChanges;
use crate::client::lockstep::{LockstepError, Member};
use crate::client::repeats::Repeats;
use crate::client::request::random_client_id;
use crate::client::state::{State, StateAssembler};
use crate::client::watch::listen;
use crate::endpoint::Endpoint;
use crate::ports::reader::{Drained, ReadError, Reader, Sample};
use crate::ports::service::{
    BENDS, COLLIDERS, FORCES, KEYFRAME, OUTCOMES, PARAMETERS, PARTICLES, SCENE, STATUS, SURFACE,
    ServiceError, TEARS, TOPOLOGY,
};
use crate::ports::services::{AttachError, Attachment};
use crate::ports::wake::WakeListener;

/// Most reads of every service for one state. Each read receives at most one buffer.
const READS_MAX: usize = 8;

const _: () = {
    let every = Tap::LOCKSTEP_EVERY.get() as usize;
    assert!(2 * every * COMMANDS_PER_STEP_MAX <= OUTCOMES_BUFFERED);
    assert!(2 * every <= UPDATES_BUFFERED);
};

/// A snapshot.
#[derive(Debug)]
enum Held {
    Shared(Sample<ParticleState, SnapshotHeader>),
    /// From another host.
    Copied(Copied),
}

impl Held {
    fn header(&self) -> &SnapshotHeader {
        match self {
            Self::Shared(sample) => sample.user_header(),
            Self::Copied(copied) => &copied.header,
        }
    }

    fn particles(&self) -> &[ParticleState] {
        match self {
            Self::Shared(sample) => sample.payload(),
            Self::Copied(copied) => &copied.particles,
        }
    }
}

/// Longest wait for the next event while a snapshot from another host waits for other messages.
const ARRIVAL_POLL: Duration = Duration::from_millis(10);

/// Reads everything that an owner publishes, as a sequence of coherent states. The particles are not
/// copied. Messages of processes that do not own the name are ignored, and so are repeated ones.
///
/// Behind a network tunnel, each state comes at least 50 ms late, because it waits for messages that the
/// tunnel delivers after it, and is copied.
#[derive(Debug)]
pub struct Tap {
    listener: WakeListener,
    outcomes: Reader<Outcome>,
    status: Reader<NodeStatus>,
    colliders: Reader<ColliderState, CollidersHeader>,
    tears: Reader<TornConstraint, TearsHeader>,
    parameters: Reader<ParameterState, ParametersHeader>,
    scene: Reader<u8, LoadHeader>,
    topology: Reader<ConstraintState, LoadHeader>,
    bends: Reader<BendState, LoadHeader>,
    surface: Reader<Triangle, LoadHeader>,
    /// Only of a tap that reads them.
    forces: Option<Reader<ForceRow, ForcesHeader>>,
    keyframe: Reader<u8, KeyframeHeader>,
    particles: Reader<ParticleState, SnapshotHeader>,
    assembler: StateAssembler,
    repeats: Repeats,
    /// The snapshots that have arrived from another host, and wait for other messages.
    arrivals: Arrivals,
    /// A keyframe has arrived.
    has_keyframe: bool,
    /// The snapshot of the newest state.
    held: Option<Held>,
    /// The held snapshot has arrived before its load.
    is_early: bool,
    errors: Vec<ReadError>,
    /// The membership in the lockstep, if it has joined.
    member: Option<Member>,
    // Dropped last: the ports belong to its services and its node.
    attachment: Arc<Attachment>,
}

impl Tap {
    /// Attaches to a running simulation. Subscribes to the outcomes first and to the particles last, so
    /// that it misses no message that belongs to a snapshot.
    ///
    /// # Errors
    /// No simulation runs there, it has another version of the contract, a service has no place for
    /// another reader, or `/dev/shm` is full.
    pub fn attach(endpoint: &Endpoint) -> Result<Self, AttachError> {
        let attachment = Attachment::to(endpoint)?;
        Ok(Self::subscribe(attachment, None)?)
    }

    /// Attaches as a member of the lockstep: the owner waits in every step, [`Tap::LOCKSTEP_EVERY`], until
    /// [`Tap::ready`] is called. So the tap misses nothing at any rate, as long
    /// as it is ready in time: a node goes on without a member after its `--lockstep-timeout`, 2 s by default,
    /// and a replay after 10 s. A node with `--every` waits only at published steps. The tap joins before it
    /// subscribes, and again with each turn, also at the next owner of the name.
    ///
    /// # Errors
    /// Same as [`Tap::attach`], or the lockstep has no place for another member.
    pub fn attach_in_lockstep(endpoint: &Endpoint) -> Result<Self, LockstepError> {
        let attachment = Attachment::to(endpoint)?;
        let mut member = Member::create(&attachment, random_client_id()?, Self::LOCKSTEP_EVERY)?;
        member.join()?;
        Ok(Self::subscribe(attachment, Some(member))?)
    }

    /// Distance of the steps at which a tap in the lockstep takes part. In one step, an owner publishes at most
    /// [`crate::COMMANDS_PER_STEP_MAX`] outcomes, and one message of each other service; the tap can hold
    /// [`crate::OUTCOMES_BUFFERED`] and [`crate::UPDATES_BUFFERED`]. Half of each stays free, for messages
    /// between the steps.
    pub const LOCKSTEP_EVERY: NonZeroU32 = NonZeroU32::MIN;

    fn subscribe(attachment: Attachment, member: Option<Member>) -> Result<Self, ServiceError> {
        let attachment = Arc::new(attachment);
        let (services, owner) = (&attachment.services, &attachment.source);
        // Fields are evaluated in the order written here.
        let tap = Self {
            listener: listen(&services.wake)?,
            outcomes: Reader::create(&services.outcomes, &OUTCOMES, owner)?,
            status: Reader::create(&attachment.status, &STATUS, owner)?,
            colliders: Reader::create(&services.colliders, &COLLIDERS, owner)?,
            tears: Reader::create(&services.tears, &TEARS, owner)?,
            parameters: Reader::create(&services.parameters, &PARAMETERS, owner)?,
            scene: Reader::create(&services.scene, &SCENE, owner)?,
            topology: Reader::create(&services.topology, &TOPOLOGY, owner)?,
            bends: Reader::create(&services.bends, &BENDS, owner)?,
            surface: Reader::create(&services.surface, &SURFACE, owner)?,
            forces: None,
            keyframe: Reader::create(&services.keyframe, &KEYFRAME, owner)?,
            particles: Reader::create(&services.particles, &PARTICLES, owner)?,
            assembler: StateAssembler::default(),
            repeats: Repeats::default(),
            arrivals: Arrivals::default(),
            has_keyframe: false,
            held: None,
            is_early: false,
            errors: Vec::new(),
            member,
            attachment: Arc::clone(&attachment),
        };
        attachment.request_latched();
        Ok(tap)
    }

    /// Reads the forces, too, from a step on that follows soon: [`Update::Forces`], and [`Change::Forces`] in the
    /// states. They cost the node a little time in each step, so no tap reads them unasked.
    ///
    /// # Errors
    /// The service has no place for another reader, or `/dev/shm` is full.
    ///
    /// [`Change::Forces`]: crate::Change::Forces
    pub fn read_forces(&mut self) -> Result<(), ServiceError> {
        let Attachment { services, source, .. } = &*self.attachment;
        self.forces = Some(Reader::create(&services.forces, &FORCES, source)?);
        Ok(())
    }

    /// Ends the reading of the forces. Without another reader, the owner stops computing them.
    pub fn end_forces(&mut self) {
        self.forces = None;
    }

    /// Returns the oldest unread state with everything that belongs to it; `None` if all were read. A
    /// reader more than [`crate::SNAPSHOTS_BUFFERED`] states behind misses some.
    ///
    /// `on_message` receives every other message as it arrives. A message can arrive before its state
    /// is published, such as an outcome of a paused node.
    pub fn next_state(&mut self, on_message: impl FnMut(&Update<'_>)) -> Option<State<'_>> {
        if self.attachment.is_far() {
            return self.next_far_state(on_message);
        }
        let arrived = self.particles.next().map(|sample| self.unless_repeated(sample));
        self.assemble(arrived, on_message)
    }

    /// Returns the newest unread state and skips those before it; `None` if all were read. Its changes
    /// are all changes since the last returned state. `on_message` is the same as in
    /// [`Tap::next_state`].
    pub fn latest_state(&mut self, on_message: impl FnMut(&Update<'_>)) -> Option<State<'_>> {
        if self.attachment.is_far() {
            return self.latest_far_state(on_message);
        }
        let arrived = self.particles.newest().map(|sample| self.unless_repeated(sample));
        self.assemble(arrived, on_message)
    }

    fn unless_repeated(
        &mut self,
        sample: Option<Sample<ParticleState, SnapshotHeader>>,
    ) -> Option<Held> {
        sample.filter(|one| !self.repeats.is_repeated_snapshot(one.user_header())).map(Held::Shared)
    }

    /// Returns the next state from another host.
    fn next_far_state(&mut self, mut on_message: impl FnMut(&Update<'_>)) -> Option<State<'_>> {
        self.receive_far(&mut on_message);
        let assembler = &self.assembler;
        let arrived = self.arrivals.next(monotonic_ns(), |header| assembler.has_load(header));
        self.assemble(Ok(arrived.map(Held::Copied)), on_message)
    }

    fn latest_far_state(&mut self, mut on_message: impl FnMut(&Update<'_>)) -> Option<State<'_>> {
        self.receive_far(&mut on_message);
        let now_ns = monotonic_ns();
        let (arrivals, assembler) = (&mut self.arrivals, &self.assembler);
        let has_load = |header: &SnapshotHeader| assembler.has_load(header);
        let arrived = std::iter::from_fn(|| arrivals.next(now_ns, has_load)).last();
        self.assemble(Ok(arrived.map(Held::Copied)), on_message)
    }

    /// Receives the snapshots from another host, then the other messages, and asks for what is missing.
    fn receive_far(&mut self, on_message: &mut impl FnMut(&Update<'_>)) {
        while self.arrivals.has_place() {
            match self.particles.next() {
                Ok(Some(one)) if self.repeats.is_repeated_snapshot(one.user_header()) => {}
                Ok(Some(sample)) => {
                    self.arrivals.add(sample.user_header(), sample.payload(), monotonic_ns());
                }
                Ok(None) => break,
                Err(error) => self.errors.push(error),
            }
        }
        self.receive_updates(on_message);
        let lacks_load = |header| !self.assembler.has_load(header);
        if !self.has_keyframe || self.arrivals.first().is_some_and(lacks_load) {
            self.attachment.request_latched();
        }
    }

    /// Reads the messages up to a snapshot and assembles its state. An owner publishes the particles of
    /// a step last, so the messages that belong to a snapshot have arrived before it.
    fn assemble(
        &mut self,
        arrived: Result<Option<Held>, ReadError>,
        mut on_message: impl FnMut(&Update<'_>),
    ) -> Option<State<'_>> {
        self.receive_updates(&mut on_message);
        match arrived {
            // A reader that attaches in the moment of a snapshot can receive it before the load, and a
            // paused node publishes no other.
            Ok(None) if self.is_early => {}
            Ok(sample) => self.held = sample,
            Err(error) => {
                self.held = None;
                self.errors.push(error);
            }
        }
        let held = self.held.as_ref()?;
        self.is_early = !self.assembler.has_load(held.header());
        if self.is_early {
            return None;
        }
        if let Some(member) = &mut self.member
            && member.takes_part(held.header())
        {
            member.begin_turn(held.header(), None);
        }
        self.assembler.assemble(held.header(), held.particles())
    }

    /// Receives all messages except snapshots. A repeated one is for readers behind a tunnel.
    fn receive_updates(&mut self, on_message: &mut impl FnMut(&Update<'_>)) {
        let mut assembler = std::mem::take(&mut self.assembler);
        let mut repeats = std::mem::take(&mut self.repeats);
        let mut arrivals = std::mem::take(&mut self.arrivals);
        let mut has_keyframe = self.has_keyframe;
        for _ in 0..READS_MAX {
            let drained = self.drain_updates(|update| {
                if !repeats.is_repeated(&update) {
                    has_keyframe |= matches!(update, Update::Keyframe(..));
                    arrivals.note(&update);
                    on_message(&update);
                    assembler.add(&update);
                }
            });
            self.errors.extend(drained.errors);
            if drained.count == 0 {
                break;
            }
        }
        self.assembler = assembler;
        self.repeats = repeats;
        self.arrivals = arrivals;
        self.has_keyframe = has_keyframe;
    }

    /// Lets the owner go on, if it waits for this tap. Call it when all states were read. A tap that is no
    /// member has nothing to do.
    ///
    /// # Errors
    /// There is no memory.
    pub fn ready(&mut self) -> Result<(), LockstepError> {
        self.member.as_mut().map_or(Ok(()), Member::ready)
    }

    /// Removes and returns the errors of messages that could not be read.
    pub fn drain_errors(&mut self) -> Vec<ReadError> {
        std::mem::take(&mut self.errors)
    }

    /// Returns the numbers of changes that were dropped because their state did not arrive.
    pub fn lost_changes(&self) -> LostChanges {
        self.assembler.lost_changes()
    }

    /// Passes the unread messages of all services except `particles` to `sink`: at most one buffer of
    /// each service, oldest first. Drops malformed messages and returns their errors.
    fn drain_updates(&mut self, mut sink: impl FnMut(Update<'_>)) -> Drained {
        let mut drained = Drained::default();
        let result = &mut drained;
        self.scene.drain(result, |header, bytes| sink(Update::Scene(header, bytes)));
        self.topology.drain(result, |header, items| sink(Update::Topology(header, items)));
        self.bends.drain(result, |header, items| sink(Update::Bends(header, items)));
        self.surface.drain(result, |header, items| sink(Update::Surface(header, items)));
        self.colliders.drain(result, |header, items| sink(Update::Colliders(header, items)));
        self.tears.drain(result, |header, items| sink(Update::Tears(header, items)));
        self.parameters.drain(result, |header, states| {
            sink(Update::Parameters(header, &ParameterState::to_values(states)));
        });
        if let Some(forces) = &self.forces {
            forces.drain(result, |header, rows| sink(Update::Forces(header, rows)));
        }
        self.keyframe.drain(result, |header, bytes| sink(Update::Keyframe(header, bytes)));
        self.outcomes.drain_values(result, |outcome| sink(Update::Outcome(outcome)));
        self.status.drain_values(result, |status| sink(Update::Status(status)));
        drained
    }

    /// Waits until the owner wakes its readers, a signal arrives, or `timeout` has passed. An event since
    /// the last wait ends it at once.
    pub fn wait(&self, timeout: Duration) {
        let is_near = self.arrivals.is_empty();
        self.listener.wait(if is_near { timeout } else { timeout.min(ARRIVAL_POLL) });
    }

    /// Returns `true` if the process that owns the name is alive. Reads the file system: call it a few
    /// times per second at most.
    pub fn is_owner_alive(&self) -> bool {
        self.attachment.owner().is_some()
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::owner::Owner;
    use crate::owner::load::Load;
    use crate::ports::domain;
    use crate::ports::leftovers::lock::OwnerLock;
    use crate::ports::port::Service;
    use crate::ports::session::{Access, Session};
    use crate::ports::source::Source;
    use crate::ports::writer::{Capacity, Writer};
    use crate::testing::TestDomain;

    fn create_owner(endpoint: &Endpoint, run_id: u64) -> Owner {
        let load =
            Load { header: LoadHeader { run_id, ..LoadHeader::default() }, ..Load::default() };
        Owner::create(endpoint, &load).unwrap()
    }

    fn publish(owner: &Owner, run_id: u64, step: u64) {
        let header = SnapshotHeader { run_id, step, ..SnapshotHeader::default() };
        owner.publish_particles(&header, |_| ParticleState::default()).unwrap();
    }

    /// Returns the runs and steps of all unread states.
    fn read_all(tap: &mut Tap) -> Vec<(u64, u64)> {
        let next = || tap.next_state(|_| {}).map(|state| (state.header.run_id, state.header.step));
        std::iter::from_fn(next).collect()
    }

    #[test]
    fn messages_of_processes_that_do_not_own_the_name_are_ignored() {
        let domain = TestDomain::new();
        let owner = create_owner(&domain.endpoint(), 7);
        let mut tap = Tap::attach(&domain.endpoint()).unwrap();
        owner.refresh();
        let session = Session::join(&domain.endpoint()).unwrap();
        let service: Service<ParticleState, SnapshotHeader> =
            session.service(&PARTICLES, Access::Open).unwrap();
        let capacity = Capacity { len_max: 1, samples: 8 };
        let stranger = Writer::create(session.config(), &service, capacity).unwrap();
        let intrude = |header: SnapshotHeader| {
            stranger.send_elements(header, 1, |_| ParticleState::default()).unwrap();
        };
        publish(&owner, 7, 1);
        let run_of_the_owner = SnapshotHeader { run_id: 7, step: 50, ..SnapshotHeader::default() };
        intrude(SnapshotHeader { particle_count: 1, ..run_of_the_owner });
        intrude(SnapshotHeader { run_id: 8, particle_count: 1, ..SnapshotHeader::default() });
        // Not even a message with a wrong length counts, because the owner has lost none.
        intrude(SnapshotHeader { particle_count: 3, ..SnapshotHeader::default() });
        publish(&owner, 7, 2);
        assert_eq!(read_all(&mut tap), [(7, 1), (7, 2)]);
        assert_eq!(tap.drain_errors(), []);
    }

    #[test]
    fn messages_of_a_process_that_calls_itself_the_owner_without_its_lock_are_ignored() {
        let domain = TestDomain::new();
        let owner = create_owner(&domain.endpoint(), 7);
        owner.refresh();
        // The lock then names another process than the one that publishes.
        let config = domain::configuration(Some(domain.name())).unwrap();
        let rename = |process_id: u32| {
            for path in OwnerLock::paths(&config, domain.endpoint().name()) {
                fs::write(path, format!("{process_id}\n")).unwrap();
            }
        };
        let mut tap = Tap::attach(&domain.endpoint()).unwrap();
        let mut attachment = Attachment::to(&domain.endpoint()).unwrap();
        rename(1);
        let lock = attachment.session.lock_place();
        attachment.source = Arc::new(Source::new(&attachment.status, lock));
        let mut other = Tap::subscribe(attachment, None).unwrap();
        owner.refresh();
        publish(&owner, 7, 1);
        assert_eq!((read_all(&mut tap), read_all(&mut other)), (vec![(7, 1)], vec![]));
        let error = Tap::attach(&domain.endpoint()).unwrap_err();
        assert!(matches!(error, AttachError::NoServices { process_id: Some(1), .. }), "{error}");
        rename(std::process::id());
        assert!(Tap::attach(&domain.endpoint()).is_ok());
    }

    #[test]
    fn a_snapshot_that_arrives_before_its_load_is_read_after_it() {
        let domain = TestDomain::new();
        let owner = create_owner(&domain.endpoint(), 7);
        let mut tap = Tap::attach(&domain.endpoint()).unwrap();
        // Sending connects the new reader of `particles`, but not yet those of the load.
        publish(&owner, 7, 0);
        assert_eq!(read_all(&mut tap), []);
        owner.refresh();
        assert_eq!(read_all(&mut tap), [(7, 0)]);
        assert_eq!(read_all(&mut tap), [], "once");
    }

    #[test]
    fn unread_states_of_an_earlier_owner_precede_those_of_the_next() {
        let domain = TestDomain::new();
        let first = create_owner(&domain.endpoint(), 7);
        let mut tap = Tap::attach(&domain.endpoint()).unwrap();
        first.refresh();
        publish(&first, 7, 1);
        drop(first);
        let second = create_owner(&domain.endpoint(), 8);
        publish(&second, 8, 0);
        assert_eq!(read_all(&mut tap), [(7, 1), (8, 0)]);
    }
}
