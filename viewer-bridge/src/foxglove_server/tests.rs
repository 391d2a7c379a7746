//! The publisher encodes what its subscribers need, and no more often. There is no server: the tests
//! subscribe directly.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use foxglove::messages::{FrameTransform, PointCloud, SceneEntity, SceneUpdate, Vector3};
use foxglove::{
    ChannelId, Context, Decode, Encode, FoxgloveError, Metadata, RawChannel, Sink, SinkId,
};
use prost_types::{FileDescriptorProto, FileDescriptorSet};
use recording::{StepRow, Topic, TopicFormat, scene_format};
use serde_json::{Value, json};
use sim_contract::{ColliderShape, ColliderState, ParticleState, TornConstraint};
use sim_host::clock::SECOND_NS;
use sim_solver::scene::ColliderMesh;

use super::publisher::Publisher;
use crate::sink::{State, Torn};
use crate::source::recording_times::RecordingTimes;
use crate::wire::{Colliders, Scene, SceneText, Stamp};

/// A message.
#[derive(Debug, Clone, PartialEq)]
struct Received {
    topic: String,
    log_time_ns: u64,
    bytes: Vec<u8>,
}

/// A subscriber that keeps its messages.
struct Listener {
    id: SinkId,
    channels: Mutex<Vec<(String, ChannelId)>>,
    messages: Mutex<Vec<Received>>,
}

impl Sink for Listener {
    fn id(&self) -> SinkId {
        self.id
    }

    fn log(
        &self,
        channel: &RawChannel,
        bytes: &[u8],
        metadata: &Metadata,
    ) -> Result<(), FoxgloveError> {
        let (topic, log_time_ns) = (channel.topic().to_owned(), metadata.log_time);
        let received = Received { topic, log_time_ns, bytes: bytes.to_vec() };
        self.messages.lock().unwrap().push(received);
        Ok(())
    }

    fn add_channels(&self, channels: &[&Arc<RawChannel>]) -> Option<Vec<ChannelId>> {
        let channels = channels.iter().map(|channel| (channel.topic().to_owned(), channel.id()));
        self.channels.lock().unwrap().extend(channels);
        None
    }

    fn auto_subscribe(&self) -> bool {
        false
    }
}

struct Bench {
    context: Arc<Context>,
    publisher: Publisher,
}

impl Bench {
    fn new(recording: Option<RecordingTimes>) -> Self {
        let context = Context::new();
        let publisher = Publisher::new(&context, recording).unwrap();
        Self { context, publisher }
    }

    fn begin_load(&self, epoch: u32) {
        let stamp = Stamp { epoch, step: 0 };
        let (positions, ends) = (vec![[0.0; 3]; 2], vec![[0, 1]]);
        let rate_hz = 100;
        self.publisher.begin_load(&Scene { stamp, rate_hz, positions, ends, ..Scene::default() });
    }

    fn set_torn(&self, step: u64, torn: &[TornConstraint]) {
        let stamp = Stamp { epoch: 1, step };
        self.publisher.publish_torn(&Torn { stamp, all: torn, known_count: 0 });
    }

    fn show(&self, now_ns: u64, step: u64) {
        let state = State {
            epoch: 1,
            row: StepRow { step, ..StepRow::default() },
            sim_time_s: 0.0,
            flags: 0,
            publish_monotonic_ns: 0,
            particles: &[ParticleState::default(); 2],
            forces: None,
            ghost: None,
        };
        self.publisher.publish_state_at(now_ns, &state);
    }

    fn listen(&self, topics: &[&str]) -> Arc<Listener> {
        let listener = Arc::new(Listener {
            id: SinkId::next(),
            channels: Mutex::default(),
            messages: Mutex::default(),
        });
        self.context.add_sink(Arc::<Listener>::clone(&listener));
        for topic in topics {
            let channels = listener.channels.lock().unwrap();
            let (_, channel) = channels.iter().find(|(name, _)| name == topic).unwrap();
            self.context.subscribe_channels(listener.id, &[*channel]);
            self.publisher.add_subscription(topic, Some(listener.id));
        }
        listener
    }
}

impl Listener {
    fn topics(&self) -> Vec<String> {
        self.messages.lock().unwrap().drain(..).map(|one| one.topic).collect()
    }

    /// Returns the newest message on a topic.
    fn newest(&self, topic: &str) -> Vec<u8> {
        let messages = self.messages.lock().unwrap();
        messages.iter().rfind(|one| one.topic == topic).unwrap().bytes.clone()
    }

    /// Returns the colliders in the newest picture.
    fn drawn_colliders(&self) -> SceneEntity {
        let picture = SceneUpdate::decode(self.newest("/scene").as_slice()).unwrap();
        picture.entities.into_iter().find(|one| one.id == "colliders").unwrap()
    }
}

#[test]
fn nothing_is_encoded_without_subscribers() {
    let bench = Bench::new(None);
    bench.begin_load(1);
    assert!(!bench.publisher.is_state_awaited());
    (0..100).for_each(|step| bench.show(step * SECOND_NS, step));
    assert_eq!(bench.publisher.encoded_count(), 0);
    let listener = bench.listen(&["/tf", "/status"]);
    bench.show(SECOND_NS, 100);
    assert_eq!((bench.publisher.encoded_count(), listener.topics()), (0, vec!["/tf".to_owned()]));
    bench.context.remove_sink(listener.id);
    bench.show(2 * SECOND_NS, 101);
    assert!(!bench.publisher.is_state_awaited());
}

#[test]
fn a_state_is_sent_once_and_the_scene_ten_times_a_second() {
    let bench = Bench::new(None);
    let listener = bench.listen(&["/particles", "/scene", "/steps"]);
    bench.begin_load(1);
    for step in 0..60 {
        bench.show(step * SECOND_NS / 60, step);
        // Sources show a state again for new pages.
        bench.show(step * SECOND_NS / 60, step);
    }
    let topics = listener.topics();
    let count = |topic: &str| topics.iter().filter(|one| *one == topic).count();
    assert_eq!((count("/particles"), count("/scene"), count("/steps")), (60, 10, 60));
    assert_eq!(bench.publisher.encoded_count(), 70);
}

#[test]
fn a_late_subscriber_receives_the_earlier_messages_even_if_nothing_moves() {
    let bench = Bench::new(None);
    bench.begin_load(1);
    bench.set_torn(3, &[TornConstraint::new(0, None)]);
    bench.show(0, 3);
    let first = bench.listen(&["/particles", "/scene", "/tears", "/steps", "/tf"]);
    bench.show(1, 3);
    let mut topics = first.topics();
    topics.sort();
    assert_eq!(topics, ["/particles", "/scene", "/steps", "/tears", "/tf"]);
    let second = bench.listen(&["/tears"]);
    bench.show(2, 3);
    assert_eq!(second.topics(), ["/tears"]);
    assert!(!first.topics().iter().any(|topic| topic == "/tears"));
    // A load does not have the tears of the previous one.
    bench.begin_load(2);
    let third = bench.listen(&["/tears"]);
    bench.show(3, 0);
    assert_eq!(third.topics(), Vec::<String>::new());
}

#[test]
fn recorded_messages_have_the_times_of_the_recording() {
    let epoch_ns = 7 * SECOND_NS;
    let recording = RecordingTimes { epoch_ns, rate_hz: 100, first_step: 0, last_step: 100 };
    let bench = Bench::new(Some(recording));
    let listener = bench.listen(&["/particles"]);
    bench.begin_load(1);
    bench.show(0, 50);
    let messages = listener.messages.lock().unwrap().clone();
    assert_eq!(messages.len(), 1);
    assert_eq!(messages[0].topic, "/particles");
    assert_eq!(messages[0].log_time_ns, epoch_ns + SECOND_NS / 2);
    assert!(messages[0].bytes.len() > 64);
}

#[test]
fn the_transform_turns_the_up_of_the_scene_to_z() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let (origin, place) = ([1.0, 2.0, 3.0], |x, y, z| Vector3 { x, y, z });
    for (up, x, w, expected) in [
        ("y", half, half, place(1.0, -3.0, 2.0)),
        ("-y", -half, half, place(1.0, 3.0, -2.0)),
        ("z", 0.0, 1.0, place(1.0, 2.0, 3.0)),
    ] {
        let bench = Bench::new(None);
        let listener = bench.listen(&["/tf"]);
        let text = SceneText { up: up.to_owned(), ..SceneText::default() };
        bench.publisher.begin_load(&Scene { origin, text, rate_hz: 100, ..Scene::default() });
        let transform = FrameTransform::decode(listener.newest("/tf").as_slice()).unwrap();
        let rotation = transform.rotation.unwrap();
        assert_eq!((rotation.x, rotation.y, rotation.z, rotation.w), (x, 0.0, 0.0, w), "{up}");
        assert_eq!(transform.translation, Some(expected), "{up}");
    }
}

#[test]
fn colliders_are_drawn_where_they_are_and_late_subscribers_receive_them() {
    let bench = Bench::new(None);
    let listener = bench.listen(&["/scene"]);
    bench.begin_load(1);
    let move_to = |step: u64, x: f32| {
        let shape = ColliderShape::Sphere as u32;
        let center = [x, 0.5, 0.0];
        let ball = ColliderState { shape, center, radius: 0.25, ..ColliderState::default() };
        let stamp = Stamp { epoch: 1, step };
        bench.publisher.publish_colliders(&Colliders { stamp, colliders: vec![ball] });
    };
    for (step, x) in [(1, 0.5), (2, 2.0)] {
        move_to(step, x);
        bench.show(step * SECOND_NS, step);
        let ball = listener.drawn_colliders().spheres.remove(0);
        let center = Vector3 { x: f64::from(x), y: 0.5, z: 0.0 };
        assert_eq!(ball.pose.unwrap().position, Some(center));
        assert_eq!(ball.size, Some(Vector3 { x: 0.5, y: 0.5, z: 0.5 }));
    }
    let late = bench.listen(&["/colliders"]);
    bench.show(3 * SECOND_NS, 3);
    let row: Value = serde_json::from_slice(&late.newest("/colliders")).unwrap();
    assert_eq!(row["step"], 2);
    assert_eq!(row["colliders"][0]["center"], json!([2.0, 0.5, 0.0]));
    move_to(4, 3.0);
    assert_eq!(late.topics(), ["/colliders", "/colliders"]);
    // A load without colliders has none of the previous one.
    bench.begin_load(2);
    bench.show(5 * SECOND_NS, 0);
    assert_eq!(listener.drawn_colliders().spheres, []);
    let later = bench.listen(&["/colliders"]);
    bench.show(6 * SECOND_NS, 0);
    assert_eq!(later.topics(), Vec::<String>::new());
}

#[test]
fn the_triangles_of_a_mesh_are_sent_again_only_if_it_moves_or_a_client_may_lack_them() {
    let bench = Bench::new(None);
    let listener = bench.listen(&["/scene"]);
    let mesh =
        ColliderMesh { vertices: vec![[0.0; 3]; 3], triangles: vec![[0, 1, 2]], is_solid: false };
    let collider_meshes = [(0, mesh)].into();
    let scene = Scene { rate_hz: 100, collider_meshes, ..Scene::default() };
    bench.publisher.begin_load(&scene);
    let move_to = |step: u64, x: f32| {
        let (shape, rotation) = (ColliderShape::Mesh as u32, [0.0, 0.0, 0.0, 1.0]);
        let mesh =
            ColliderState { shape, center: [x, 0.0, 0.0], rotation, ..ColliderState::default() };
        let stamp = Stamp { epoch: 1, step };
        bench.publisher.publish_colliders(&Colliders { stamp, colliders: vec![mesh] });
    };
    let has_mesh = |tenths: u64, step: u64| {
        bench.show(tenths * SECOND_NS / 10, step);
        let picture = SceneUpdate::decode(listener.newest("/scene").as_slice()).unwrap();
        picture.entities.iter().any(|one| one.id == "meshes" && one.triangles.len() == 1)
    };
    move_to(0, 0.0);
    assert!(has_mesh(0, 0) && !has_mesh(1, 10) && !has_mesh(2, 20));
    move_to(30, 1.0);
    assert!(has_mesh(3, 30));
    bench.set_torn(40, &[]);
    assert!(!has_mesh(4, 40), "a tear changes no mesh");
    let _late = bench.listen(&["/scene"]);
    assert!(has_mesh(5, 50) && !has_mesh(6, 60));
    assert!(has_mesh(7, 20) && !has_mesh(8, 30), "a seek goes back");
    assert!(!has_mesh(26, 190) && has_mesh(27, 200), "it is repeated after two seconds");
}

/// Returns the files of a set of descriptors by name, with their imports sorted. Options of generators and
/// names for JSON, which follow from those of the fields, are left out.
fn descriptors(data: &[u8]) -> BTreeMap<String, FileDescriptorProto> {
    let set: FileDescriptorSet = prost::Message::decode(data).unwrap();
    let files = set.file.into_iter();
    let plain = files.map(|mut file| {
        file.options = None;
        file.dependency.sort();
        let fields = file.message_type.iter_mut().flat_map(|message| &mut message.field);
        fields.for_each(|field| field.json_name = None);
        (file.name().to_owned(), file)
    });
    plain.collect()
}

/// Exports have the recorder's schemas, and clients receive those of the library.
#[test]
fn the_schemas_of_exports_are_those_of_the_library() {
    for (ours, theirs) in [
        (scene_format(), SceneUpdate::get_schema()),
        (TopicFormat::for_topic(Topic::Particles), PointCloud::get_schema()),
        (TopicFormat::for_topic(Topic::Tf), FrameTransform::get_schema()),
    ] {
        let theirs = theirs.unwrap();
        assert_eq!(ours.schema.name, theirs.name);
        assert_eq!(descriptors(&ours.schema.data), descriptors(&theirs.data));
    }
}
