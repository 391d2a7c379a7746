//! A process that uses iceoryx2 without this contract's client, and writes random bytes into the services
//! `ready` and `restore` as fast as it can: `foreign-writer PREFIX ROOT PARTICLE_COUNT`. It ends at a signal.
//!
//! It is an example target because only this package names iceoryx2. Tests start it.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "only tests run it, and read its output"
)]

use iceoryx2::prelude::{
    Config, FileName, NodeBuilder, Path, SemanticString, SignalHandlingMode, ipc,
};
use sim_contract::{ParticleState, Ready, RestoreHeader};
use sim_host::Stop;

/// Bytes that look like a keyframe behind the particles.
const KEYFRAME_SIZE_BYTES: usize = 200;

/// Random numbers (xorshift64): the crate needs no generator otherwise.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// Returns 32 random bits.
    fn next_u32(&mut self) -> u32 {
        let [a, b, c, d, ..] = self.next().to_le_bytes();
        u32::from_le_bytes([a, b, c, d])
    }

    fn ready(&mut self) -> Ready {
        let [client_id, run_id, step] = [self.next(), self.next(), self.next()];
        Ready { client_id, run_id, step, every: self.next_u32(), tag: self.next_u32() }
    }

    /// Returns random numbers, or every second time a header that fits its payload.
    fn restore_header(&mut self, particle_count: usize, size_bytes: usize) -> RestoreHeader {
        let [client_id, sequence, scene_hash] = [self.next(), self.next(), self.next()];
        let random = RestoreHeader {
            client_id,
            sequence,
            scene_hash,
            size_bytes: self.next(),
            particle_count: self.next_u32(),
            contents: self.next_u32(),
        };
        if self.next().is_multiple_of(2) {
            return random;
        }
        RestoreHeader {
            client_id: 7,
            sequence: 1,
            size_bytes: size_bytes as u64,
            particle_count: u32::try_from(particle_count).unwrap(),
            contents: 1 + self.next_u32() % 2,
            ..random
        }
    }
}

fn configuration(prefix: &str, root: &str) -> Config {
    let mut config = Config::default();
    config.global.prefix = FileName::new(prefix.as_bytes()).unwrap();
    config.global.set_root_path(&Path::new(root.as_bytes()).unwrap());
    // iceoryx2 would wait forever for a connection that a killed process has left half created.
    config.global.node.cleanup_dead_nodes_on_creation = false;
    config.global.node.cleanup_dead_nodes_on_destruction = false;
    config.global.service.cleanup_dead_nodes_on_open = false;
    config
}

fn main() {
    let stop = Stop::install().unwrap();
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    let [prefix, root, particle_count] = &arguments[..] else {
        panic!("usage: foreign-writer PREFIX ROOT PARTICLE_COUNT");
    };
    let particle_count: usize = particle_count.parse().unwrap();
    let size_bytes = particle_count * size_of::<ParticleState>() + KEYFRAME_SIZE_BYTES;
    let node = NodeBuilder::new()
        .config(&configuration(prefix, root))
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<ipc::Service>()
        .unwrap();
    let ready = node.service_builder(&"sim/ready".try_into().unwrap());
    let ready = ready.publish_subscribe::<Ready>().open().unwrap();
    let restore = node.service_builder(&"sim/restore".try_into().unwrap());
    let restore =
        restore.publish_subscribe::<[u8]>().user_header::<RestoreHeader>().open().unwrap();
    let members = ready.publisher_builder().create().unwrap();
    let states = restore.publisher_builder().initial_max_slice_len(size_bytes).create().unwrap();
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    eprintln!("ready");
    while !stop.is_requested() {
        members.send_copy(random.ready()).unwrap();
        let mut sample = states.loan_slice_uninit(size_bytes).unwrap();
        *sample.user_header_mut() = random.restore_header(particle_count, size_bytes);
        let sample = sample.write_from_fn(|_| random.next().to_le_bytes()[0]);
        sample.send().unwrap();
    }
}
