//! Measures the server with pages that have no screen: frame rate, age of the frames, and CPU time.
//!
//! `cargo run --release -p viewer-bridge --example measure -- HOST:PORT PAGES SECONDS [PID]`. With the
//! process id of the server, prints its share of a core.
#![allow(clippy::print_stdout, reason = "the results are for the user")]

use std::fs;
use std::net::TcpStream;
use std::thread;

use anyhow::Context;
use sim_host::clock::{SECOND_NS, monotonic_ns, sleep_until};
use tungstenite::Message;
use viewer_bridge::wire::Kind;

/// Ticks of `/proc/PID/stat` per second.
const TICKS_PER_SECOND: f64 = 100.0;

/// Frames that one page received.
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
            thread::spawn(move || receive_frames(&host, end_ns))
        })
        .collect();
    for thread in threads {
        let received = thread.join().map_err(|_| anyhow::anyhow!("a page panicked"))??;
        print(received, seconds);
    }
    sleep_until(end_ns);
    if let (Some(id), Some(before)) = (process, ticks_before) {
        let used_s = (cpu_ticks(id)? - before) / TICKS_PER_SECOND;
        let elapsed_s = (monotonic_ns() - begin_ns) as f64 / SECOND_NS as f64;
        println!("server: {:.2} % of a core", 100.0 * used_s / elapsed_s);
    }
    Ok(())
}

/// Receives frames until the end, and acknowledges each at once.
fn receive_frames(host: &str, end_ns: u64) -> anyhow::Result<Received> {
    let stream = TcpStream::connect(host).with_context(|| format!("connecting to {host}"))?;
    stream.set_nodelay(true)?;
    let (mut socket, _) = tungstenite::client(format!("ws://{host}/socket"), stream)?;
    socket.send(Message::text(r#"{"type":"hello","protocol":3}"#))?;
    let mut received = Received::default();
    while monotonic_ns() < end_ns {
        let Message::Binary(bytes) = socket.read()? else { continue };
        let now_ns = monotonic_ns();
        let kind = u16::from_le_bytes(field(&bytes, 0)?);
        if kind == Kind::FrameF32 as u16 || kind == Kind::FrameU16 as u16 {
            let number = u32::from_le_bytes(field(&bytes, 72)?);
            let published_ns = u64::from_le_bytes(field(&bytes, 80)?);
            received.frame_count += 1;
            received.size_bytes += bytes.len();
            received.ages_ns.push(now_ns.saturating_sub(published_ns));
            socket.send(Message::text(format!(r#"{{"type":"ack","frame":{number}}}"#)))?;
        }
    }
    Ok(received)
}

/// Returns the bytes of a field of a message, at the offset that `PROTOCOL.md` gives.
fn field<const N: usize>(bytes: &[u8], at: usize) -> anyhow::Result<[u8; N]> {
    let field = bytes.get(at..at + N).context("a message is too short")?;
    Ok(field.try_into()?)
}

fn print(mut received: Received, seconds: u64) {
    received.ages_ns.sort_unstable();
    let percentile_ms = |percent: usize| {
        let place = received.ages_ns.len().saturating_sub(1) * percent / 100;
        received.ages_ns.get(place).map_or(f64::NAN, |age| *age as f64 / 1e6)
    };
    let per_second = |count: usize| count as f64 / seconds as f64;
    println!(
        "{:.1} frames/s, {:.2} MB/s, age p50 {:.2} ms p90 {:.2} ms p99 {:.2} ms",
        per_second(received.frame_count),
        per_second(received.size_bytes) / 1e6,
        percentile_ms(50),
        percentile_ms(90),
        percentile_ms(99),
    );
}

/// User and system time of a process, in ticks.
fn cpu_ticks(id: &str) -> anyhow::Result<f64> {
    let stat = fs::read_to_string(format!("/proc/{id}/stat"))?;
    let fields: Vec<_> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let ticks = |place: usize| -> anyhow::Result<f64> {
        Ok(fields.get(place).context("/proc/PID/stat is too short")?.parse()?)
    };
    // Fields 14 and 15 of the whole line; two fields precede the bracket.
    Ok(ticks(11)? + ticks(12)?)
}
