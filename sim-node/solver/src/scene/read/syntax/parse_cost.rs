//! Bounds the memory for parsing before most of it is allocated.
//!
//! A parsed table needs more than a kilobyte, whatever it holds, so a text of 16 MiB could ask for several
//! gigabytes.

use toml_parser::Source;
use toml_parser::parser::{Event, EventKind, RecursionGuard, parse_document};

use super::document::Document;
use crate::scene::error::{Place, SceneError};

/// Most memory for a piece in the parser and for the tables of the pieces before it, in MiB. The longest
/// complete texts of scenes need less than half of it.
const MEMORY_MAX_MIB: usize = 160;
/// Deepest nesting, as in the TOML parser itself.
const DEPTH_MAX: u32 = 80;

/// Refuses a piece that needs too much memory to parse, whether or not it is a part of a scene.
/// `kept_size_bytes` is the size of the tables of the pieces before it.
pub(super) fn check_parse_cost(
    place: &Place<'_>,
    document: &Document<'_>,
    kept_size_bytes: usize,
) -> Result<(), SceneError> {
    let memory_mib = (kept_size_bytes + cost_bytes(&document.text)) >> 20;
    if memory_mib <= MEMORY_MAX_MIB {
        return Ok(());
    }
    let problem = format!(
        "needs {memory_mib} MiB to parse its tables and lists up to here (allowed: {MEMORY_MAX_MIB} \
         MiB; use fewer, with headers such as [[particle]] instead of inline tables)"
    );
    Err(place.error(document.place(0..0), "scene", problem))
}

/// Estimates the memory that parsing needs, in bytes. The parser goes on after an error, and so does
/// the estimate.
fn cost_bytes(text: &str) -> usize {
    let token_count = Source::new(text).lex().count();
    let mut cost_bytes = token_count * TOKEN_BYTES;
    if cost_bytes > MEMORY_MAX_MIB << 20 {
        // The list of tokens alone would need too much.
        return cost_bytes;
    }
    let mut tokens = Vec::with_capacity(token_count);
    tokens.extend(Source::new(text).lex());
    let mut count = |event: Event| cost_bytes += event_bytes(event.kind());
    parse_document(&tokens, &mut RecursionGuard::new(&mut count, DEPTH_MAX), &mut ());
    cost_bytes
}

/// Memory of a token and of the events that it causes, measured, like the numbers below.
const TOKEN_BYTES: usize = 44;

fn event_bytes(event: EventKind) -> usize {
    match event {
        // A dotted key stands for a table.
        EventKind::StdTableOpen
        | EventKind::ArrayTableOpen
        | EventKind::InlineTableOpen
        | EventKind::KeySep => 1400,
        EventKind::ArrayOpen => 300,
        EventKind::SimpleKey => 200,
        EventKind::Scalar => 64,
        _ => 0,
    }
}
