//! What clients subscribe to: the topics of a recording, and `/scene`.
//!
//! Nothing is encoded for a topic that nobody subscribes to. Messages wait in a short queue for each
//! client, in which new ones replace old ones: a slow client misses some, and delays nobody.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use foxglove::messages::SceneUpdate;
use foxglove::{Channel, Context, FoxgloveError, PartialMetadata, RawChannel, Schema, SinkId};
use recorder::{Message, MessageEncoder, TearsRow, Topic, TopicFormat, encode_transform};
use sim_contract::clock::{SECOND_NS, monotonic_ns, realtime_ns};
use sim_contract::{ParticleState, TearCause};

use super::desk::Desk;
use super::picture::Picture;
use super::playback::{Recording, step_ns};
use crate::message::{OutcomeText, ToPage};
use crate::wire::Scene;

/// The topics that are sent as they are recorded.
const TOPICS: [Topic; 6] =
    [Topic::Tf, Topic::Tears, Topic::Outcomes, Topic::Status, Topic::Steps, Topic::Particles];
const SCENE_TOPIC: &str = "/scene";
/// Time from a picture to the next. One is twice the size of the particles, and made anew each time.
const SCENE_PERIOD_NS: u64 = SECOND_NS / 10;
/// Greetings that wait for the source at most: all topics of all clients.
const GREETINGS_MAX: usize = 256;

/// What clients subscribe to.
#[derive(Debug)]
pub(crate) struct Publisher {
    channels: [Arc<RawChannel>; TOPICS.len()],
    scene: Channel<SceneUpdate>,
    desk: Arc<Desk>,
    /// Where a recording is shown: its times are those of the messages.
    recording: Option<Recording>,
    state: Mutex<State>,
    /// Subscriptions that have not been given what was said before they came.
    greetings: Mutex<Vec<(Topic, SinkId)>>,
    /// Whether the state is wanted even if it was shown.
    is_frame_due: AtomicBool,
    /// The same for the picture, whenever the last one was.
    is_scene_due: AtomicBool,
}

/// What is on show.
#[derive(Debug, Default)]
struct State {
    encoder: MessageEncoder,
    load: Option<Load>,
    /// Load and step of the state that was sent last.
    shown: Option<(u32, u64)>,
    next_scene_ns: u64,
    /// How many states and pictures were encoded.
    encoded_count: u64,
    /// What a late subscriber is given.
    torn: Option<Torn>,
    status: Option<Message>,
    step: Option<Message>,
}

#[derive(Debug)]
struct Load {
    epoch: u32,
    run_id: String,
    origin: [f64; 3],
    rate_hz: u32,
    /// When step 0 would have been, in ns since 1970, had the node never paused.
    epoch_ns: u64,
    picture: Picture,
}

/// All that is torn.
#[derive(Debug)]
struct Torn {
    /// Since when it is all.
    step: u64,
    constraints: Vec<u32>,
    /// May be shorter: not known then.
    causes: Vec<u8>,
}

impl Torn {
    /// The message that tells of what stands at `first` and behind it.
    fn row(&self, first: usize) -> Message {
        let cause = |place: usize| {
            self.causes.get(place).and_then(|cause| TearCause::from_number((*cause).into()))
        };
        let name = |cause: Option<TearCause>| cause.map_or("unknown", TearCause::name);
        let places = first..self.constraints.len();
        let causes = places.map(|place| name(cause(place)).to_owned()).collect();
        let constraints = self.constraints[first..].to_vec();
        Message::Tears(TearsRow { step: self.step, constraints, causes })
    }
}

impl Load {
    /// The time of a step, as recordings have it.
    fn time_ns(&self, step: u64) -> u64 {
        self.epoch_ns.saturating_add(step_ns(step, self.rate_hz))
    }
}

impl Publisher {
    pub(super) fn new(
        context: &Arc<Context>,
        desk: Arc<Desk>,
        recording: Option<Recording>,
    ) -> Result<Self, FoxgloveError> {
        let mut channels = Vec::new();
        for topic in TOPICS {
            let TopicFormat { encoding, schema } = TopicFormat::for_topic(topic);
            let schema = schema.map(|one| Schema::new(one.name, one.encoding, one.data));
            let builder = context.channel_builder(topic.name()).message_encoding(encoding);
            channels.push(builder.schema(schema).build_raw()?);
        }
        let Ok(channels) = channels.try_into() else { unreachable!("one channel for each topic") };
        Ok(Self {
            channels,
            scene: context.channel_builder(SCENE_TOPIC).build(),
            desk,
            recording,
            state: Mutex::default(),
            greetings: Mutex::default(),
            is_frame_due: AtomicBool::new(false),
            is_scene_due: AtomicBool::new(false),
        })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Every change of the state is complete at every point where a panic could come.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn channel(&self, topic: Topic) -> Option<&RawChannel> {
        let place = TOPICS.iter().position(|one| *one == topic)?;
        Some(&self.channels[place])
    }

    fn is_heard(&self, topic: Topic) -> bool {
        self.channel(topic).is_some_and(RawChannel::has_sinks)
    }

    /// Whether anybody waits for a state.
    pub(crate) fn is_awaiting(&self) -> bool {
        self.is_heard(Topic::Particles)
            || self.is_heard(Topic::Steps)
            || self.scene.has_sinks()
            || !self.greetings.lock().unwrap_or_else(PoisonError::into_inner).is_empty()
    }

    /// How many states and pictures were encoded.
    #[cfg(test)]
    pub(super) fn encoded_count(&self) -> u64 {
        self.state().encoded_count
    }

    /// Somebody subscribed: it gets what was said before, with the next state.
    pub(super) fn greet(&self, topic: &str, sink: Option<SinkId>) {
        if topic == SCENE_TOPIC {
            self.is_scene_due.store(true, Ordering::Relaxed);
        }
        self.is_frame_due.store(true, Ordering::Relaxed);
        let mut greetings = self.greetings.lock().unwrap_or_else(PoisonError::into_inner);
        if let (Some(topic), Some(sink)) = (Topic::from_name(topic), sink)
            && greetings.len() < GREETINGS_MAX
            && !greetings.contains(&(topic, sink))
        {
            greetings.push((topic, sink));
        }
    }

    /// Sends bytes to all who subscribed, or to one. `time_ns`: of the step, since 1970.
    fn log(&self, channel: &RawChannel, bytes: &[u8], time_ns: u64, sink: Option<SinkId>) {
        channel.log_with_meta_to_sink(bytes, self.metadata(time_ns), sink);
    }

    /// When a message was made: a live one now, one of a recording at its step.
    fn metadata(&self, time_ns: u64) -> PartialMetadata {
        PartialMetadata::with_log_time(self.recording.map_or_else(realtime_ns, |_| time_ns))
    }

    /// Another load is on show.
    pub(crate) fn begin(&self, scene: &Scene) {
        let mut state = self.state();
        let text = &scene.text;
        let before = state.load.as_ref().filter(|load| load.run_id == text.run_id);
        let now_ns = realtime_ns().saturating_sub(step_ns(scene.stamp.step, scene.rate_hz));
        let load = Load {
            epoch: scene.stamp.epoch,
            run_id: text.run_id.clone(),
            origin: scene.origin,
            rate_hz: scene.rate_hz,
            epoch_ns: match (self.recording, before) {
                (Some(recording), _) => recording.epoch_ns,
                (None, Some(before)) => before.epoch_ns,
                (None, None) => now_ns,
            },
            picture: Picture::new(scene),
        };
        self.desk.set_epoch(load.epoch);
        if let Some(channel) = self.channel(Topic::Tf) {
            let time_ns = load.time_ns(scene.stamp.step);
            if channel.has_sinks() {
                self.log(channel, &encode_transform(time_ns, load.origin), time_ns, None);
                self.settle(Topic::Tf);
            }
        }
        state.load = Some(load);
        state.torn = None;
        state.step = None;
        self.is_scene_due.store(true, Ordering::Relaxed);
    }

    /// Takes the list of all that is torn; what stands before `first` was known.
    pub(crate) fn set_torn(&self, step: u64, torn: &[u32], causes: &[u8], first: usize) {
        let mut state = self.state();
        let Some(load) = &mut state.load else { return };
        load.picture.set_torn(torn);
        self.is_scene_due.store(true, Ordering::Relaxed);
        let torn = Torn { step, constraints: torn.to_vec(), causes: causes.to_vec() };
        if self.is_heard(Topic::Tears) && first < torn.constraints.len() {
            self.send(&mut state, &torn.row(first), None);
        }
        state.torn = (!torn.constraints.is_empty()).then_some(torn);
    }

    /// Says something on a topic of recordings. It is made only where somebody hears it, or where
    /// late subscribers are told as well.
    pub(crate) fn say(&self, topic: Topic, make: impl FnOnce() -> Message) {
        let is_latched = matches!(topic, Topic::Status | Topic::Steps);
        let is_heard = self.is_heard(topic);
        if !is_heard && !is_latched {
            return;
        }
        let message = make();
        let mut state = self.state();
        // A state that is shown again was said already, and late subscribers are given it.
        let is_known = topic == Topic::Steps
            && state.step.as_ref().is_some_and(|before| before.step() == message.step());
        if is_heard && !is_known {
            self.send(&mut state, &message, None);
            self.settle(topic);
        }
        match topic {
            Topic::Status => state.status = Some(message),
            Topic::Steps => state.step = Some(message),
            _ => {}
        }
    }

    /// Encodes a message and sends it, to all or to one.
    fn send(&self, state: &mut State, message: &Message, sink: Option<SinkId>) {
        let time_ns = state.load.as_ref().map_or(0, |load| load.time_ns(message.step()));
        let Some(channel) = self.channel(message.topic()) else { return };
        // Every row has a JSON form.
        if let Ok(bytes) = state.encoder.encode(message, time_ns) {
            self.log(channel, bytes, time_ns, sink);
        }
    }

    /// Shows a state: particles each time, the picture as often as it is made.
    pub(crate) fn show(&self, step: u64, particles: &[ParticleState]) {
        self.show_at(monotonic_ns(), step, particles);
    }

    /// The same at that time of the monotonic clock.
    pub(super) fn show_at(&self, now_ns: u64, step: u64, particles: &[ParticleState]) {
        let mut state = self.state();
        let state = &mut *state;
        self.serve_greetings(state, step);
        let Some(load) = &state.load else { return };
        let time_ns = load.time_ns(step);
        let is_new = state.shown.replace((load.epoch, step)) != Some((load.epoch, step));
        let is_frame_due = self.is_frame_due.swap(false, Ordering::Relaxed);
        if let Some(channel) = self.channel(Topic::Particles)
            && (is_new || is_frame_due)
            && channel.has_sinks()
        {
            self.log(channel, state.encoder.encode_particles(particles, time_ns), time_ns, None);
            state.encoded_count += 1;
        }
        if !self.scene.has_sinks() {
            return;
        }
        let is_scene_due = self.is_scene_due.swap(false, Ordering::Relaxed);
        if is_scene_due || (is_new && now_ns >= state.next_scene_ns) {
            let picture = load.picture.draw(time_ns, particles);
            self.scene.log_with_meta(&picture, self.metadata(time_ns));
            state.next_scene_ns = now_ns + SCENE_PERIOD_NS;
            state.encoded_count += 1;
        }
    }

    /// All who subscribed to a topic were told: none of them is late any more.
    fn settle(&self, topic: Topic) {
        let mut greetings = self.greetings.lock().unwrap_or_else(PoisonError::into_inner);
        greetings.retain(|(other, _)| *other != topic);
    }

    /// Gives late subscribers what was said before they came.
    fn serve_greetings(&self, state: &mut State, step: u64) {
        let greetings = {
            let mut greetings = self.greetings.lock().unwrap_or_else(PoisonError::into_inner);
            std::mem::take(&mut *greetings)
        };
        for (topic, sink) in greetings {
            let said = match topic {
                Topic::Tf => {
                    if let (Some(channel), Some(load)) = (self.channel(topic), &state.load) {
                        let time_ns = load.time_ns(step);
                        let bytes = encode_transform(time_ns, load.origin);
                        self.log(channel, &bytes, time_ns, Some(sink));
                    }
                    continue;
                }
                Topic::Tears => state.torn.as_ref().map(|torn| torn.row(0)),
                Topic::Status => state.status.take(),
                Topic::Steps => state.step.take(),
                _ => continue,
            };
            let Some(message) = said else { continue };
            self.send(state, &message, Some(sink));
            match topic {
                Topic::Tears => {}
                Topic::Status => state.status = Some(message),
                _ => state.step = Some(message),
            }
        }
    }

    /// Hears what pages are told, as far as it concerns clients. Whether a state is wanted for it.
    pub(crate) fn hear(&self, message: &ToPage) -> bool {
        match message {
            ToPage::Parameters(parameters) => self.desk.set_parameters(parameters.values),
            // The last picture may be older than the state at which everything stops.
            ToPage::Node(node) if node.is_paused => {
                self.is_scene_due.store(true, Ordering::Relaxed);
                return self.scene.has_sinks();
            }
            ToPage::Playback(playback) => {
                self.desk.set_playback(*playback);
                if !playback.is_playing {
                    self.is_scene_due.store(true, Ordering::Relaxed);
                    return self.scene.has_sinks();
                }
            }
            _ => {}
        }
        false
    }

    /// Gives the outcome of a command to the client that asked.
    pub(crate) fn answer(&self, outcome: &OutcomeText) {
        self.desk.answer(outcome);
    }
}
