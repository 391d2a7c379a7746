//! The topics: those of a recording, and `/scene`.
//!
//! A message is encoded only if a client subscribes to its topic. Messages wait in a short queue for
//! each client, in which new ones replace old ones: a slow client misses some and delays nobody.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use foxglove::messages::{FrameTransform, PointCloud, SceneUpdate};
use foxglove::{Context, Encode, FoxgloveError, PartialMetadata, RawChannel, Schema, SinkId};
use recording::{
    CollidersRow, DrawnMesh, Message, MessageEncoder, OutcomeRow, RunDescription, SCENE_TOPIC,
    SceneDrawing, StatusRow, StepRow, SurfaceRow, TearsRow, Topic, TopicFormat, TopologyRow, Up,
    encode_transform, scene_format,
};
use sim_host::clock::{SECOND_NS, monotonic_ns, realtime_ns};

use crate::sink::{State, Topology, Torn};
use crate::source::recording_times::RecordingTimes;
use crate::wire::{Colliders, Scene};

/// Topics with the messages of a recording.
const TOPICS: [Topic; 9] = [
    Topic::Tf,
    Topic::Topology,
    Topic::Surface,
    Topic::Colliders,
    Topic::Tears,
    Topic::Outcomes,
    Topic::Status,
    Topic::Steps,
    Topic::Particles,
];
/// Time between two messages on `/scene`. Each is twice as large as the particles and encoded anew.
const SCENE_PERIOD_NS: u64 = SECOND_NS / 10;
/// Time after which `/scene` has everything again. A slow client may have missed the message with the meshes.
const WHOLE_SCENE_PERIOD_NS: u64 = 2 * SECOND_NS;
/// New subscriptions that wait for the source: more than all topics of all clients.
const NEW_SUBSCRIPTIONS_MAX: usize = 256;

/// Publishes on the topics.
#[derive(Debug)]
pub(super) struct Publisher {
    channels: [Arc<RawChannel>; TOPICS.len()],
    scene: Arc<RawChannel>,
    /// Times of the recording on show, which are those of the messages.
    recording: Option<RecordingTimes>,
    state: Mutex<PublisherState>,
    /// Subscriptions whose clients have not received the earlier messages of the topic.
    new_subscriptions: Mutex<Vec<NewSubscription>>,
    /// The next state must be sent even if it was sent before.
    is_state_due: AtomicBool,
    /// The next state must be drawn on `/scene`, whenever the last one was.
    is_scene_due: AtomicBool,
    /// A new client needs everything on `/scene`.
    is_whole_scene_due: AtomicBool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct NewSubscription {
    topic: Topic,
    sink: SinkId,
}

#[derive(Debug, Default)]
struct PublisherState {
    encoder: MessageEncoder,
    load: Option<PublishedLoad>,
    /// The state that was sent last.
    shown: Option<StateId>,
    next_scene_ns: u64,
    next_whole_scene_ns: u64,
    /// Number of messages that were encoded on `/particles` and `/scene`.
    encoded_count: u64,
    /// Earlier messages for late subscribers.
    topology: Option<TopologyRow>,
    surface: Option<SurfaceRow>,
    colliders: Option<CollidersRow>,
    torn: Option<TearsRow>,
    status: Option<StatusRow>,
    step: Option<StepRow>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct StateId {
    epoch: u32,
    step: u64,
}

#[derive(Debug)]
struct PublishedLoad {
    run_id: String,
    origin: [f64; 3],
    up: Up,
    rate_hz: u32,
    /// Time of step 0 in ns since 1970, if the node had never paused.
    epoch_ns: u64,
    drawing: SceneDrawing,
}

impl PublishedLoad {
    /// Time of a step, as in recordings.
    fn time_ns(&self, step: u64) -> u64 {
        self.epoch_ns.saturating_add(RunDescription::duration_ns(step, self.rate_hz))
    }
}

/// Need of a redrawn `/scene`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SceneNeed {
    /// A client subscribes to it; it needs a state.
    State,
    /// Nobody subscribes to it.
    Nothing,
}

impl Publisher {
    pub(super) fn new(
        context: &Arc<Context>,
        recording: Option<RecordingTimes>,
    ) -> Result<Self, FoxgloveError> {
        let mut channels = Vec::new();
        for topic in TOPICS {
            let builder = context.channel_builder(topic.name());
            let builder = builder.message_encoding(TopicFormat::for_topic(topic).encoding);
            channels.push(builder.schema(schema(topic)).build_raw()?);
        }
        let Ok(channels) = channels.try_into() else { unreachable!("one channel for each topic") };
        Ok(Self {
            channels,
            scene: context
                .channel_builder(SCENE_TOPIC)
                .message_encoding(scene_format().encoding)
                .schema(SceneUpdate::get_schema())
                .build_raw()?,
            recording,
            state: Mutex::default(),
            new_subscriptions: Mutex::default(),
            is_state_due: AtomicBool::new(false),
            is_scene_due: AtomicBool::new(false),
            is_whole_scene_due: AtomicBool::new(false),
        })
    }

    fn state(&self) -> MutexGuard<'_, PublisherState> {
        // Every change under this lock is complete wherever a panic could occur.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn new_subscriptions(&self) -> MutexGuard<'_, Vec<NewSubscription>> {
        self.new_subscriptions.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn channel(&self, topic: Topic) -> Option<&RawChannel> {
        let index = TOPICS.iter().position(|one| *one == topic)?;
        Some(&self.channels[index])
    }

    fn has_subscribers(&self, topic: Topic) -> bool {
        self.channel(topic).is_some_and(RawChannel::has_sinks)
    }

    /// Returns whether a client waits for a state.
    pub(super) fn is_state_awaited(&self) -> bool {
        self.has_subscribers(Topic::Particles)
            || self.has_subscribers(Topic::Steps)
            || self.scene.has_sinks()
            || !self.new_subscriptions().is_empty()
    }

    #[cfg(test)]
    pub(super) fn encoded_count(&self) -> u64 {
        self.state().encoded_count
    }

    /// Notes a new subscription. The client receives the earlier messages with the next state.
    pub(super) fn add_subscription(&self, topic: &str, sink: Option<SinkId>) {
        if topic == SCENE_TOPIC {
            self.is_whole_scene_due.store(true, Ordering::Relaxed);
            self.is_scene_due.store(true, Ordering::Relaxed);
        }
        self.is_state_due.store(true, Ordering::Relaxed);
        let mut subscriptions = self.new_subscriptions();
        if let (Some(topic), Some(sink)) = (Topic::from_name(topic), sink)
            && subscriptions.len() < NEW_SUBSCRIPTIONS_MAX
            && !subscriptions.contains(&NewSubscription { topic, sink })
        {
            subscriptions.push(NewSubscription { topic, sink });
        }
    }

    /// Forgets the new subscriptions to a topic whose message has just been sent to everybody.
    fn settle(&self, topic: Topic) {
        self.new_subscriptions().retain(|subscription| subscription.topic != topic);
    }

    /// Draws the next state on `/scene`, even if it was drawn before.
    pub(super) fn redraw_scene(&self) -> SceneNeed {
        self.is_scene_due.store(true, Ordering::Relaxed);
        if self.scene.has_sinks() { SceneNeed::State } else { SceneNeed::Nothing }
    }

    /// Time of a message: now for a live one, that of its step for a recorded one.
    fn metadata(&self, step_time_ns: u64) -> PartialMetadata {
        let time_ns = if self.recording.is_some() { step_time_ns } else { realtime_ns() };
        PartialMetadata::with_log_time(time_ns)
    }

    /// Sends bytes to all subscribers, or to one.
    fn send_bytes(&self, topic: Topic, bytes: &[u8], time_ns: u64, sink: Option<SinkId>) {
        if let Some(channel) = self.channel(topic) {
            channel.log_with_meta_to_sink(bytes, self.metadata(time_ns), sink);
        }
    }

    /// Encodes a row and sends it to all subscribers, or to one.
    fn send(&self, state: &mut PublisherState, row: &Message, sink: Option<SinkId>) {
        let time_ns = state.load.as_ref().map_or(0, |load| load.time_ns(row.step()));
        // Every row has a JSON form.
        if let Ok(bytes) = state.encoder.encode(row, time_ns) {
            self.send_bytes(row.topic(), bytes, time_ns, sink);
        }
    }

    fn send_transform(&self, load: &PublishedLoad, step: u64, sink: Option<SinkId>) {
        let time_ns = load.time_ns(step);
        let bytes = encode_transform(time_ns, load.origin, load.up);
        self.send_bytes(Topic::Tf, &bytes, time_ns, sink);
    }

    /// Begins a new load.
    pub(super) fn begin_load(&self, scene: &Scene) {
        let mut state = self.state();
        let run_id = &scene.text.run_id;
        let before = state.load.as_ref().filter(|load| load.run_id == *run_id);
        let load = PublishedLoad {
            run_id: run_id.clone(),
            origin: scene.origin,
            up: Up::from_name(&scene.text.up).unwrap_or_default(),
            rate_hz: scene.rate_hz,
            epoch_ns: match (self.recording, before) {
                (Some(times), _) => times.epoch_ns,
                (None, Some(before)) => before.epoch_ns,
                (None, None) => {
                    let age_ns = RunDescription::duration_ns(scene.stamp.step, scene.rate_hz);
                    realtime_ns().saturating_sub(age_ns)
                }
            },
            drawing: drawing(scene),
        };
        if self.has_subscribers(Topic::Tf) {
            self.send_transform(&load, scene.stamp.step, None);
            self.settle(Topic::Tf);
        }
        state.load = Some(load);
        (state.topology, state.surface) = (None, None);
        state.colliders = None;
        state.torn = None;
        state.step = None;
        self.is_scene_due.store(true, Ordering::Relaxed);
    }

    /// Publishes the constraints and triangles of the load.
    pub(super) fn publish_topology(&self, topology: &Topology<'_>) {
        let Topology { header, constraints, bends, triangles } = *topology;
        let mut state = self.state();
        let (topology, surface) =
            (TopologyRow::new(header, constraints, bends), SurfaceRow::new(header, triangles));
        if self.has_subscribers(Topic::Topology) {
            self.send(&mut state, &Message::Topology(topology.clone()), None);
            self.settle(Topic::Topology);
        }
        if self.has_subscribers(Topic::Surface) {
            self.send(&mut state, &Message::Surface(surface.clone()), None);
            self.settle(Topic::Surface);
        }
        (state.topology, state.surface) = (Some(topology), Some(surface));
    }

    /// Publishes the poses of the colliders. The next picture has them.
    pub(super) fn publish_colliders(&self, colliders: &Colliders) {
        let mut state = self.state();
        let Some(load) = &mut state.load else { return };
        load.drawing.set_colliders(&colliders.colliders);
        // A shape of a later contract has no row.
        let row = CollidersRow::new(colliders.stamp.step, &colliders.colliders);
        if let Some(row) = row.clone().filter(|_| self.has_subscribers(Topic::Colliders)) {
            self.send(&mut state, &Message::Colliders(row), None);
            self.settle(Topic::Colliders);
        }
        state.colliders = row;
    }

    /// Publishes a change of the list of torn constraints.
    pub(super) fn publish_torn(&self, torn: &Torn<'_>) {
        let mut state = self.state();
        let Some(load) = &mut state.load else { return };
        load.drawing.set_torn(torn.all);
        self.is_scene_due.store(true, Ordering::Relaxed);
        let row = |torn_list| TearsRow::new(torn.stamp.step, torn_list);
        let new = &torn.all[torn.known_count..];
        if self.has_subscribers(Topic::Tears) && !new.is_empty() {
            self.send(&mut state, &Message::Tears(row(new)), None);
        }
        state.torn = (!torn.all.is_empty()).then(|| row(torn.all));
    }

    /// Publishes an outcome. Late subscribers do not receive it.
    pub(super) fn publish_outcome(&self, row: &OutcomeRow) {
        if self.has_subscribers(Topic::Outcomes) {
            self.send(&mut self.state(), &Message::Outcome(row.clone()), None);
            self.settle(Topic::Outcomes);
        }
    }

    /// Publishes the status of the node and keeps it for late subscribers.
    pub(super) fn publish_status(&self, row: &StatusRow) {
        let mut state = self.state();
        if self.has_subscribers(Topic::Status) {
            self.send(&mut state, &Message::Status(row.clone()), None);
            self.settle(Topic::Status);
        }
        state.status = Some(row.clone());
    }

    /// Publishes a state: its step and particles once, and the picture at most ten times a second.
    pub(super) fn publish_state(&self, shown: &State<'_>) {
        self.publish_state_at(monotonic_ns(), shown);
    }

    /// Publishes a state at a time of the monotonic clock.
    pub(super) fn publish_state_at(&self, now_ns: u64, shown: &State<'_>) {
        let mut state = self.state();
        let state = &mut *state;
        self.publish_step(state, shown.row);
        self.serve_new_subscriptions(state, shown.row.step);
        let Some(load) = &mut state.load else { return };
        let time_ns = load.time_ns(shown.row.step);
        let id = StateId { epoch: shown.epoch, step: shown.row.step };
        let before = state.shown.replace(id);
        let is_new = before != Some(id);
        let is_state_due = self.is_state_due.swap(false, Ordering::Relaxed);
        if (is_new || is_state_due) && self.has_subscribers(Topic::Particles) {
            let bytes = state.encoder.encode_particles(shown.particles, time_ns);
            self.send_bytes(Topic::Particles, bytes, time_ns, None);
            state.encoded_count += 1;
        }
        if !self.scene.has_sinks() {
            return;
        }
        let is_scene_due = self.is_scene_due.swap(false, Ordering::Relaxed);
        if is_scene_due || (is_new && now_ns >= state.next_scene_ns) {
            // Viewers forget their entities when a recording is sought.
            let is_sought = before.is_some_and(|before| id.step < before.step);
            let is_whole = self.is_whole_scene_due.swap(false, Ordering::Relaxed)
                || is_sought
                || now_ns >= state.next_whole_scene_ns;
            let message = if is_whole {
                state.next_whole_scene_ns = now_ns + WHOLE_SCENE_PERIOD_NS;
                load.drawing.encode(time_ns, shown.particles)
            } else {
                load.drawing.encode_changes(time_ns, shown.particles)
            };
            self.scene.log_with_meta(&message, self.metadata(time_ns));
            state.next_scene_ns = now_ns + SCENE_PERIOD_NS;
            state.encoded_count += 1;
        }
    }

    /// Publishes a step, unless it is already known, and keeps it for late subscribers.
    fn publish_step(&self, state: &mut PublisherState, row: StepRow) {
        let is_known = state.step.is_some_and(|known| known.step == row.step);
        if !is_known && self.has_subscribers(Topic::Steps) {
            self.send(state, &Message::Step(row), None);
            self.settle(Topic::Steps);
        }
        state.step = Some(row);
    }

    /// Sends the earlier messages to the clients that have subscribed since the last state.
    fn serve_new_subscriptions(&self, state: &mut PublisherState, step: u64) {
        let subscriptions = std::mem::take(&mut *self.new_subscriptions());
        for NewSubscription { topic, sink } in subscriptions {
            let row = match topic {
                Topic::Tf => {
                    if let Some(load) = &state.load {
                        self.send_transform(load, step, Some(sink));
                    }
                    continue;
                }
                Topic::Topology => state.topology.clone().map(Message::Topology),
                Topic::Surface => state.surface.clone().map(Message::Surface),
                Topic::Colliders => state.colliders.clone().map(Message::Colliders),
                Topic::Tears => state.torn.clone().map(Message::Tears),
                Topic::Status => state.status.clone().map(Message::Status),
                Topic::Steps => state.step.map(Message::Step),
                _ => None,
            };
            if let Some(row) = row {
                self.send(state, &row, Some(sink));
            }
        }
    }
}

/// Creates the drawing of a load.
fn drawing(scene: &Scene) -> SceneDrawing {
    let bounds = scene.bounds();
    SceneDrawing::new(DrawnMesh {
        ends: scene.ends.clone(),
        triangles: scene.triangles.clone(),
        collider_meshes: scene.collider_meshes.clone(),
        bounds: [bounds.min, bounds.max],
    })
}

/// The schema of a topic: the library's own where it has one, otherwise that of recordings.
fn schema(topic: Topic) -> Option<Schema> {
    match topic {
        Topic::Tf => FrameTransform::get_schema(),
        Topic::Particles => PointCloud::get_schema(),
        _ => {
            let schema = TopicFormat::for_topic(topic).schema;
            Some(Schema::new(schema.name, schema.encoding, schema.data))
        }
    }
}
