//! Repetition of the latched messages, for readers behind a network tunnel.
//!
//! A tunnel gives a late reader only what is published after it has joined. So such a reader asks for the
//! latched messages, and the owner publishes them again. Readers on this host receive them twice.

use std::cell::{Cell, RefCell};
use std::error::Error;

use bytemuck::Pod;
use iceoryx2::prelude::{Config, ZeroCopySend};

use crate::owner::load::LoadWriters;
use crate::ports::port::{Header, Service};
use crate::ports::reader::{ReadError, Reader, Sample};
use crate::ports::service::{
    BENDS, COLLIDERS, FORCES, KEYFRAME, PARAMETERS, PARTICLES, SCENE, SURFACE, ServiceSpec, TEARS,
    TOPOLOGY,
};
use crate::ports::services::Services;
use crate::ports::writer::Writer;

/// Messages of a repetition, in the order of publication: one at a time, because each costs the loop a part
/// of a millisecond, and longer if it is large.
const MESSAGE_COUNT: usize = 10;

/// Progress of the repetition.
#[derive(Debug, Default)]
pub(super) struct Repetition {
    /// Index of the next message; `None` if no request is open.
    next: Cell<Option<usize>>,
    answered_count: Cell<usize>,
    /// A snapshot was published since the request.
    has_new_snapshot: Cell<bool>,
}

impl Repetition {
    /// Begins a repetition, unless one is in progress. A reader that missed some of it asks again.
    pub(super) fn request(&self) {
        if self.next.get().is_none() {
            self.next.set(Some(0));
            self.has_new_snapshot.set(false);
        }
    }

    /// Notes that a snapshot was published: no reader needs the one before it.
    pub(super) fn on_snapshot(&self) {
        self.has_new_snapshot.set(true);
    }

    pub(super) fn is_due(&self) -> bool {
        self.next.get().is_some()
    }

    pub(super) fn answered_count(&self) -> usize {
        self.answered_count.get()
    }

    /// Publishes the next message. A message for which there is no place or no memory is left out: the reader
    /// asks again.
    pub(super) fn publish_next(&self, services: &Services, writers: &LoadWriters) {
        let Some(index) = self.next.get() else { return };
        let config = &services.config;
        let _left_out = match index {
            0 => replace(&writers.scene, config, &services.scene, &SCENE),
            1 => replace(&writers.topology, config, &services.topology, &TOPOLOGY),
            2 => replace(&writers.bends, config, &services.bends, &BENDS),
            3 => replace(&writers.surface, config, &services.surface, &SURFACE),
            4 => repeat(&writers.colliders, &services.colliders, &COLLIDERS),
            5 => repeat(&writers.tears, &services.tears, &TEARS),
            6 => repeat(&writers.parameters, &services.parameters, &PARAMETERS),
            _ if self.has_new_snapshot.get() => Ok(()),
            // The owner is paused.
            7 => writers
                .forces
                .borrow()
                .iter()
                .try_for_each(|writer| repeat(writer, &services.forces, &FORCES)),
            8 => repeat(&writers.keyframe, &services.keyframe, &KEYFRAME),
            _ => repeat(&writers.particles, &services.particles, &PARTICLES),
        };
        let is_last = index + 1 == MESSAGE_COUNT;
        self.next.set((!is_last).then_some(index + 1));
        self.answered_count.set(self.answered_count.get() + usize::from(is_last));
    }
}

/// Publishes the latched message again with its writer, which has memory for several messages.
fn repeat<T, H>(
    writer: &Writer<T, H>,
    service: &Service<T, H>,
    spec: &ServiceSpec,
) -> Result<(), Box<dyn Error>>
where
    T: Pod + ZeroCopySend,
    H: Header,
{
    if let Some(message) = latched(writer, service, spec)? {
        let elements = message.payload();
        writer.write(*message.user_header(), |index| elements[index])?;
    }
    Ok(())
}

/// Publishes the latched message again with a new writer, because a reader may hold the only message of the
/// old one for as long as it likes.
fn replace<T, H>(
    writer: &RefCell<Writer<T, H>>,
    config: &Config,
    service: &Service<T, H>,
    spec: &ServiceSpec,
) -> Result<(), Box<dyn Error>>
where
    T: Pod + ZeroCopySend,
    H: Header,
{
    let mut writer = writer.borrow_mut();
    if let Some(message) = latched(&writer, service, spec)? {
        let elements = message.payload();
        let new = Writer::create(config, service, writer.capacity())?;
        new.write(*message.user_header(), |index| elements[index])?;
        *writer = new;
    }
    Ok(())
}

/// Reads the latched message of a writer as a late reader does.
fn latched<T, H>(
    writer: &Writer<T, H>,
    service: &Service<T, H>,
    spec: &ServiceSpec,
) -> Result<Option<Sample<T, H>>, ReadError>
where
    T: Pod + ZeroCopySend,
    H: Header,
{
    let reader = Reader::of_every_publisher(service, spec)?;
    writer.refresh();
    reader.newest()
}

#[cfg(test)]
mod tests {
    use sim_messages::{
        BendState, ConstraintState, LoadHeader, ParameterValues, Ready, SnapshotHeader, Triangle,
    };

    use crate::client::tap::Tap;
    use crate::owner::Owner;
    use crate::owner::load::Load;
    use crate::ports::reader::Reader;
    use crate::ports::service::{BENDS, READY, SCENE, SURFACE, TEARS, TOPOLOGY};
    use crate::ports::services::Services;
    use crate::ports::session::{Access, Session};
    use crate::ports::writer::Writer;
    use crate::testing::TestDomain;

    const BENT: BendState = BendState {
        particles: [0, 1, 2, 1],
        coefficients: [1.0, -2.0, 1.0, 0.0],
        geometry: 0.5,
        rigidity: 0.25,
        rest: 0.0,
        shape: 0,
        block: 0,
    };

    const LOAD: Load<'_> = Load {
        header: LoadHeader {
            run_id: 7,
            step: 0,
            scene_hash: 0,
            origin: [0.0; 3],
            topology_revision: 3,
            count: 0,
            particle_count: 0,
            rate_hz: 240,
            method: 0,
            spare: 0,
        },
        scene: b"version = 1",
        constraints: &[ConstraintState { a: 0, b: 1, rest_length: 1.0, compliance: 0.0, kind: 0 }],
        bends: &[BENT],
        triangles: &[Triangle { corners: [0, 1, 2] }],
        collider_count: 0,
        keyframe_size_bytes_max: 0,
        parameters: ParameterValues::DEFAULT,
    };

    fn refresh_all(owner: &Owner) {
        (0..super::MESSAGE_COUNT).for_each(|_| owner.refresh());
    }

    #[test]
    fn latched_messages_come_again_on_request_and_a_tap_ignores_them() {
        let domain = TestDomain::new();
        let owner = Owner::create(&domain.endpoint(), &LOAD).unwrap();
        let mut tap = Tap::attach(&domain.endpoint()).unwrap();
        let snapshot = SnapshotHeader { run_id: 7, topology_revision: 3, ..Default::default() };
        owner.refresh();
        owner.publish_particles(&snapshot, |_| unreachable!()).unwrap();
        assert!(tap.next_state(|_| {}).is_some());

        // Readers that have received everything, like a tunnel that is there first.
        let session = Session::join(&domain.endpoint()).unwrap();
        let services = Services::access(&session, Access::Open).unwrap();
        let scene = Reader::of_every_publisher(&services.scene, &SCENE).unwrap();
        let topology = Reader::of_every_publisher(&services.topology, &TOPOLOGY).unwrap();
        let bends = Reader::of_every_publisher(&services.bends, &BENDS).unwrap();
        let surface = Reader::of_every_publisher(&services.surface, &SURFACE).unwrap();
        let tears = Reader::of_every_publisher(&services.tears, &TEARS).unwrap();
        refresh_all(&owner);
        let first = topology.next().unwrap().unwrap();
        for is_none in [
            scene.newest().unwrap().is_none(),
            bends.newest().unwrap().is_none(),
            surface.newest().unwrap().is_none(),
            tears.newest().unwrap().is_none(),
        ] {
            assert!(!is_none, "the latched message");
        }
        refresh_all(&owner);
        assert!(topology.next().unwrap().is_none(), "nothing without a request");

        let requests = Writer::of_values(&services.config, &services.ready, &READY).unwrap();
        for _ in 0..3 {
            requests.send_value(Ready { tag: Ready::REPEAT_TAG, ..Ready::default() }).unwrap();
            owner.receive_ready(|_, _| panic!("a request joins nothing"));
            refresh_all(&owner);
            assert_eq!(scene.next().unwrap().unwrap().payload(), LOAD.scene);
            let again = topology.next().unwrap().unwrap();
            assert_eq!(again.user_header(), first.user_header());
            assert_eq!(again.payload(), LOAD.constraints);
            assert_eq!(bends.next().unwrap().unwrap().payload(), LOAD.bends);
            assert_eq!(surface.next().unwrap().unwrap().payload(), LOAD.triangles);
            assert_eq!(tears.next().unwrap().unwrap().payload(), []);
        }
        assert_eq!(owner.keyframe_reader_count(), 1 + 3, "each far reader needs a keyframe");
        let mut messages = Vec::new();
        assert!(tap.next_state(|update| messages.push(format!("{update:?}"))).is_none());
        assert_eq!(messages, [""; 0]);
    }
}
