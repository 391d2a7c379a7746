//! What is encoded, for whom, and how often: the publisher with subscribers of its own, no server.

use std::sync::{Arc, Mutex, Weak};

use foxglove::{ChannelId, Context, FoxgloveError, Metadata, RawChannel, Sink, SinkId};
use recorder::{Message, StepRow, Topic};
use sim_contract::clock::SECOND_NS;
use sim_contract::{ParticleState, SnapshotHeader};

use super::desk::Desk;
use super::publisher::Publisher;
use super::{FoxgloveOptions, Recording};
use crate::wire::{Scene, Stamp};

/// A subscriber that keeps what it is given.
struct Listener {
    id: SinkId,
    channels: Mutex<Vec<(String, ChannelId)>>,
    /// Topic, time and size of each message.
    heard: Mutex<Vec<(String, u64, usize)>>,
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
        let message = (channel.topic().to_owned(), metadata.log_time, bytes.len());
        self.heard.lock().unwrap().push(message);
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
    fn new(recording: Option<Recording>) -> Self {
        let context = Context::new();
        let options = FoxgloveOptions {
            listen: "127.0.0.1:0".parse().unwrap(),
            origins: Vec::new(),
            takes_commands: false,
            recording,
        };
        let desk = Arc::new(Desk::new(Weak::new(), &options));
        let publisher = Publisher::new(&context, desk, recording).unwrap();
        Self { context, publisher }
    }

    fn begin(&self, epoch: u32) {
        let stamp = Stamp { epoch, step: 0 };
        let (positions, ends) = (vec![[0.0; 3]; 2], vec![[0, 1]]);
        let rate_hz = 100;
        self.publisher.begin(&Scene { stamp, rate_hz, positions, ends, ..Scene::default() });
    }

    fn show(&self, now_ns: u64, step: u64) {
        self.publisher.show_at(now_ns, step, &[ParticleState::default(); 2]);
    }

    fn listen(&self, topics: &[&str]) -> Arc<Listener> {
        let listener = Arc::new(Listener {
            id: SinkId::next(),
            channels: Mutex::default(),
            heard: Mutex::default(),
        });
        self.context.add_sink(Arc::<Listener>::clone(&listener));
        for topic in topics {
            let channels = listener.channels.lock().unwrap();
            let (_, channel) = channels.iter().find(|(name, _)| name == topic).unwrap();
            self.context.subscribe_channels(listener.id, &[*channel]);
            self.publisher.greet(topic, Some(listener.id));
        }
        listener
    }
}

impl Listener {
    fn topics(&self) -> Vec<String> {
        self.heard.lock().unwrap().drain(..).map(|(topic, ..)| topic).collect()
    }
}

#[test]
fn nothing_is_encoded_for_nobody() {
    let bench = Bench::new(None);
    bench.begin(1);
    assert!(!bench.publisher.is_awaiting());
    bench.publisher.say(Topic::Outcomes, || panic!("a message is made for nobody"));
    (0..100).for_each(|step| bench.show(step * SECOND_NS, step));
    assert_eq!(bench.publisher.encoded_count(), 0);
    let listener = bench.listen(&["/tf", "/status"]);
    bench.show(SECOND_NS, 100);
    assert_eq!((bench.publisher.encoded_count(), listener.topics()), (0, vec!["/tf".to_owned()]));
    bench.context.remove_sink(listener.id);
    bench.show(2 * SECOND_NS, 101);
    assert!(!bench.publisher.is_awaiting());
}

#[test]
fn a_state_is_sent_once_and_the_picture_ten_times_a_second() {
    let bench = Bench::new(None);
    let listener = bench.listen(&["/particles", "/scene"]);
    bench.begin(1);
    for step in 0..60 {
        bench.show(step * SECOND_NS / 60, step);
        // The hub shows a state again to pages that come.
        bench.show(step * SECOND_NS / 60, step);
    }
    let topics = listener.topics();
    let count = |topic: &str| topics.iter().filter(|one| *one == topic).count();
    assert_eq!((count("/particles"), count("/scene")), (60, 10));
    assert_eq!(bench.publisher.encoded_count(), 70);
}

#[test]
fn a_late_subscriber_is_given_the_state_though_nothing_moves() {
    let bench = Bench::new(None);
    bench.begin(1);
    bench.publisher.set_torn(3, &[0], &[3], 0);
    let say_step = || {
        bench.publisher.say(Topic::Steps, || {
            let header = SnapshotHeader { step: 3, ..bytemuck::Zeroable::zeroed() };
            Message::Step(StepRow::from(&header))
        });
    };
    say_step();
    bench.show(0, 3);
    let first = bench.listen(&["/particles", "/scene", "/tears", "/steps", "/tf"]);
    say_step();
    bench.show(1, 3);
    let mut heard = first.topics();
    heard.sort();
    assert_eq!(heard, ["/particles", "/scene", "/steps", "/tears", "/tf"]);
    let second = bench.listen(&["/tears"]);
    bench.show(2, 3);
    assert_eq!(second.topics(), ["/tears"]);
    assert!(!first.topics().iter().any(|topic| topic == "/tears"));
    // A load has no tears of the one before.
    bench.begin(2);
    let third = bench.listen(&["/tears"]);
    bench.show(3, 0);
    assert_eq!(third.topics(), Vec::<String>::new());
}

#[test]
fn messages_of_a_recording_have_its_times() {
    let epoch_ns = 7 * SECOND_NS;
    let recording = Recording { epoch_ns, rate_hz: 100, first_step: 0, last_step: 100 };
    let bench = Bench::new(Some(recording));
    let listener = bench.listen(&["/particles"]);
    bench.begin(1);
    bench.show(0, 50);
    let heard = listener.heard.lock().unwrap().clone();
    let size = heard[0].2;
    assert_eq!(heard, [("/particles".to_owned(), epoch_ns + SECOND_NS / 2, size)]);
    assert!(size > 64);
}
