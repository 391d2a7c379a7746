//! Pages without a screen: how many frames they get, how old these are, and what the server takes.
//!
//! `cargo run --release -p viewer-bridge --example measure -- HOST:PORT PAGES SECONDS [PID]`, with
//! the process id of the server for its share of a core.
#![allow(clippy::print_stdout, reason = "it talks to the user")]

use std::fs;
use std::net::TcpStream;
use std::thread;

use anyhow::Context;
use sim_contract::clock::{SECOND_NS, monotonic_ns, sleep_until};
use tungstenite::Message;
use viewer_bridge::wire::{self, decode};

/// Ticks of `/proc/PID/stat` per second.
const TICKS_PER_SECOND: f64 = 100.0;

/// What one page got.
#[derive(Debug, Default)]
struct Received {
    frame_count: usize,
    size_bytes: usize,
    ages_ns: Vec<u64>,
}

fn main() -> anyhow::Result<()> {
    let args: Vec<_> = std::env::args().skip(1).collect();
    let [host, pages, seconds, rest @ ..] = args.as_slice() else {
        anyhow::bail!("usage: measure HOST:PORT PAGES SECONDS [PID]");
    };
    let (pages, seconds): (usize, u64) = (pages.parse()?, seconds.parse()?);
    let process = rest.first();
    let ticks_before = process.map(|id| cpu_ticks(id)).transpose()?;
    let begin_ns = monotonic_ns();
    let end_ns = begin_ns + seconds * SECOND_NS;
    let threads: Vec<_> = (0..pages)
        .map(|_| {
            let host = host.clone();
            thread::spawn(move || look(&host, end_ns))
        })
        .collect();
    for thread in threads {
        let received = thread.join().map_err(|_| anyhow::anyhow!("a page panicked"))??;
        show(received, seconds);
    }
    sleep_until(end_ns);
    if let (Some(id), Some(before)) = (process, ticks_before) {
        let used_s = (cpu_ticks(id)? - before) / TICKS_PER_SECOND;
        let passed_s = (monotonic_ns() - begin_ns) as f64 / SECOND_NS as f64;
        println!("the server took {:.2} % of a core", 100.0 * used_s / passed_s);
    }
    Ok(())
}

/// Acknowledges every frame at once until the end.
fn look(host: &str, end_ns: u64) -> anyhow::Result<Received> {
    let stream = TcpStream::connect(host).with_context(|| format!("connecting to {host}"))?;
    stream.set_nodelay(true)?;
    let (mut socket, _) = tungstenite::client(format!("ws://{host}/socket"), stream)?;
    socket.send(Message::text(r#"{"type":"hello","protocol":2}"#))?;
    let mut received = Received::default();
    while monotonic_ns() < end_ns {
        let Message::Binary(bytes) = socket.read()? else { continue };
        let now_ns = monotonic_ns();
        if let wire::Message::Frame(frame) = decode(&bytes)? {
            let head = frame.head;
            received.frame_count += 1;
            received.size_bytes += bytes.len();
            received.ages_ns.push(now_ns.saturating_sub(head.publish_monotonic_ns));
            socket.send(Message::text(format!(r#"{{"type":"ack","frame":{}}}"#, head.number)))?;
        }
    }
    Ok(received)
}

fn show(mut received: Received, seconds: u64) {
    received.ages_ns.sort_unstable();
    let at = |part: usize| {
        let place = received.ages_ns.len().saturating_sub(1) * part / 100;
        received.ages_ns.get(place).map_or(f64::NAN, |age| *age as f64 / 1e6)
    };
    let per_second = |count: usize| count as f64 / seconds as f64;
    println!(
        "{:.1} frames/s, {:.2} MB/s, from publication to here p50 {:.2} ms p90 {:.2} ms p99 {:.2} ms",
        per_second(received.frame_count),
        per_second(received.size_bytes) / 1e6,
        at(50),
        at(90),
        at(99),
    );
}

/// User and system time of a process, in ticks.
fn cpu_ticks(id: &str) -> anyhow::Result<f64> {
    let stat = fs::read_to_string(format!("/proc/{id}/stat"))?;
    let fields: Vec<_> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let ticks = |place: usize| -> anyhow::Result<f64> {
        Ok(fields.get(place).context("a short stat")?.parse()?)
    };
    // Fields 14 and 15 of the whole line; two of them stand before the bracket.
    Ok(ticks(11)? + ticks(12)?)
}
