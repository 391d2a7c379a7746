//! Writes the seeds of the fuzz targets into the folder `corpus`: the scenes of the targets and the
//! built-in ones, and the parts of the recordings that the command line names, in the order of
//! `fuzz::simulation::SCENES`.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use fuzz::mcap_file::{END_OF_CHUNK, SEPARATOR, with_messages};
use fuzz::simulation::SCENES;
use recording::{FrameReader, LogReader, Message, MessageEncoder, TimedCommand, parse_commands};
use sim_contract::{Action, Command};
use sim_solver::builtin;

const COMMANDS: &str = include_str!("../commands.jsonl");
const MESH: &str =
    "# A square.\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\ng left\nf 1 2 3\no right\nf -4/1 3//2 4\n";
/// Messages of a page that are not actions of the node.
const PAGE_MESSAGES: [&str; 10] = [
    r#"{"type":"hello","protocol":1,"token":"abc","format":"u16"}"#,
    r#"{"type":"ack","frame":7}"#,
    r#"{"kind":"brush","eye":[0,0,1],"ray":[0,0,-1],"radius":0.1,"delta":[0.1,0,0],"over_s":0.1,"cap":0.5}"#,
    r#"{"id":1,"kind":"cut_constraints","epoch":1,"constraints":[1,2,3]}"#,
    r#"{"kind":"seek","step":10}"#,
    r#"{"kind":"loop","is_on":true}"#,
    r#"{"kind":"ghost","name":"changed"}"#,
    r#"{"kind":"lift","epoch":1,"object":"collider","index":0}"#,
    r#"{"kind":"carry","object":"collider","index":0,"offset":[0.1,0,0],"over_s":0.02}"#,
    r#"{"kind":"throw","object":"anchor","index":0,"velocity":[1,0,0]}"#,
];
/// Steps of a recording whose messages form one seed.
const STEPS_PER_SEED: usize = 3;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

fn main() -> Result<()> {
    let commands = parse_commands(COMMANDS, "commands.jsonl")?;
    write_texts(&commands)?;
    for (scene, path) in std::env::args().skip(1).enumerate() {
        let (scene, path) = (u8::try_from(scene)?, PathBuf::from(path));
        write_commands(scene, &commands)?;
        write_keyframes(scene, &path)?;
        write_recording(scene, &path)?;
    }
    Ok(())
}

/// Writes a seed of a target.
fn write(target: &str, name: &str, bytes: &[u8]) -> Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target);
    fs::create_dir_all(&folder)?;
    Ok(fs::write(folder.join(name), bytes)?)
}

fn write_texts(commands: &[TimedCommand]) -> Result<()> {
    for (number, text) in SCENES.iter().enumerate() {
        write("scene", &format!("seed-{number}"), text.as_bytes())?;
    }
    for name in builtin::names() {
        write("scene", name, builtin::text(name).unwrap_or_default().as_bytes())?;
    }
    write("mesh", "seed", MESH.as_bytes())?;
    write("command_file", "seed", COMMANDS.as_bytes())?;
    for (number, line) in COMMANDS.lines().enumerate() {
        write("command_file", &format!("line-{number}"), line.as_bytes())?;
    }
    for (number, text) in PAGE_MESSAGES.iter().enumerate() {
        write("page_message", &format!("page-{number}"), text.as_bytes())?;
    }
    for (number, action) in
        commands.iter().map(|one| one.action).chain(Action::samples()).enumerate()
    {
        let text = serde_json::to_string(&action)?;
        write("page_message", &format!("published-{number}"), text.as_bytes())?;
        let text = text.replace("\"kind\"", "\"type\"");
        write("page_message", &format!("command-{number}"), text.as_bytes())?;
    }
    Ok(())
}

/// Writes all commands of the file as one seed, with a step after each, and each as a seed of its own.
fn write_commands(scene: u8, commands: &[TimedCommand]) -> Result<()> {
    let mut all = vec![scene];
    for (number, one) in commands.iter().enumerate() {
        let command = Command::new(one.client_id, one.sequence, one.action);
        let bytes = bytemuck::bytes_of(&command);
        all.extend_from_slice(bytes);
        write("command", &format!("{scene}-{number}"), &[&[scene][..], bytes].concat())?;
    }
    write("command", &format!("{scene}-all"), &all)
}

/// Writes each state that has its keyframe.
fn write_keyframes(scene: u8, path: &Path) -> Result<()> {
    let mut frames = FrameReader::new(LogReader::open(path)?);
    while let Some(frame) = frames.next_frame()? {
        if let Some(keyframe) = frame.own_keyframe() {
            let particles = bytemuck::cast_slice(frame.payload());
            let seed = [&[scene][..], particles, keyframe].concat();
            write("keyframe", &format!("{scene}-{}", frame.row.step), &seed)?;
        }
    }
    Ok(())
}

/// Writes the file, also without checksums, and its messages in groups of a few steps.
fn write_recording(scene: u8, path: &Path) -> Result<()> {
    let mut bytes = fs::read(path)?;
    write("recording", &scene.to_string(), &bytes)?;
    clear_checksums(&mut bytes);
    write("recording", &format!("{scene}-unchecked"), &bytes)?;
    let mut log = LogReader::open(path)?;
    let mut encoder = MessageEncoder::default();
    let (mut seed, mut steps, mut number) = (Vec::new(), 0, 0);
    while let Some(logged) = log.next_message()? {
        let message = &logged.message;
        let is_snapshot = matches!(message, Message::Particles { .. });
        let end = if is_snapshot { END_OF_CHUNK } else { 0 };
        let topic = u8::try_from(message.topic().index())? | end;
        seed.extend_from_slice(&[topic, u8::try_from(message.step())?]);
        seed.extend_from_slice(encoder.encode(message, logged.publish_time_ns)?);
        seed.extend_from_slice(SEPARATOR);
        steps += usize::from(is_snapshot);
        if is_snapshot && steps % STEPS_PER_SEED == 0 {
            check_messages(&seed)?;
            write("recording_messages", &format!("{scene}-{number}"), &std::mem::take(&mut seed))?;
            number += 1;
        }
    }
    Ok(())
}

/// Checks that the file with the messages of a seed has its snapshots.
fn check_messages(seed: &[u8]) -> Result<()> {
    let file = with_messages(seed);
    let mut frames = FrameReader::new(LogReader::new(file.as_slice())?);
    for _ in 0..STEPS_PER_SEED {
        frames.next_frame()?.ok_or("a snapshot of the seed is missing")?;
    }
    Ok(())
}

/// Sets the checksums of an uncompressed file to 0, which switches them off.
fn clear_checksums(file: &mut [u8]) {
    const MAGIC_SIZE_BYTES: usize = 8;
    const HEADER_SIZE_BYTES: usize = 9;
    let mut start = MAGIC_SIZE_BYTES;
    while let Some((header, body)) =
        file.get_mut(start..).and_then(|rest| rest.split_first_chunk_mut::<HEADER_SIZE_BYTES>())
    {
        let [opcode, length @ ..] = *header;
        let Ok(length) = usize::try_from(u64::from_le_bytes(length)) else { return };
        let Some(body) = body.get_mut(..length) else { return };
        let checksum = match opcode {
            0x06 => 24..28,
            0x0f => 0..4,
            0x02 => 16..20,
            0x09 => length - 4..length,
            _ => 0..0,
        };
        body[checksum].fill(0);
        start += HEADER_SIZE_BYTES + length;
    }
}
