//! Bounds the memory for parsing before most of it is allocated.
//!
//! A parsed table needs more than a kilobyte, whatever it holds, so a text of 16 MiB could ask for several
//! gigabytes.

use toml_parser::Source;
use toml_parser::parser::{Event, EventKind, RecursionGuard, parse_document};

use crate::scene::error::{Place, SceneError};

/// Most memory that parsing may need, in MiB. The longest texts that describe a scene need up to 1.1 GiB.
const COST_MAX_MIB: usize = 1280;
/// Deepest nesting, as in the TOML parser itself.
const DEPTH_MAX: u32 = 80;

/// Refuses a text that needs too much memory to parse, whether or not it is a scene.
pub(super) fn check_parse_cost(place: &Place<'_>) -> Result<(), SceneError> {
    let cost_mib = cost_bytes(place.text) >> 20;
    if cost_mib <= COST_MAX_MIB {
        return Ok(());
    }
    let problem =
        format!("needs {cost_mib} MiB to parse its tables and lists (allowed: {COST_MAX_MIB} MiB)");
    Err(place.error(0..0, "scene", problem))
}

/// Estimates the memory that parsing needs, in bytes. The parser goes on after an error, and so does
/// the estimate.
fn cost_bytes(text: &str) -> usize {
    let tokens = Source::new(text).lex().into_vec();
    let mut cost_bytes = tokens.len() * TOKEN_BYTES;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scene;

    fn refusal(text: &str) -> Option<SceneError> {
        check_parse_cost(&Place { text, label: "f" }).err()
    }

    /// The longest complete texts with the most tables, lists and short numbers.
    #[test]
    fn every_complete_text_of_the_allowed_size_can_be_parsed() {
        let point = "[[particle]]\nposition = [0, 0, 0]\n";
        let waypoint = "[[anchor]]\nparticles = [0]\npath = [{ time = 0 }]\n";
        let pair = format!("{point}[[particle]]\nposition = [1, 0, 0]\n");
        let constraint = "[[constraint]]\nparticles = [0, 1]\n";
        let mesh = "[[generate]]\nshape = \"obj\"\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\n\
            faces = [[0, 1, 2]]\n";
        let plane = "[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = 0\n";
        let pinned =
            "[[generate]]\nshape = \"rope\"\ncount = 2\nfrom = [0, 0, 0]\nto = [1, 0, 0]\n";
        for text in [
            point.to_owned(),
            format!("{point}{waypoint}"),
            format!("{pair}{constraint}"),
            mesh.to_owned(),
            plane.to_owned(),
            pinned.to_owned(),
        ] {
            let text = format!("version = 1\n{text}");
            let complete = Scene::from_toml(&text, "f").unwrap().to_toml();
            let cost = cost_bytes(&complete) as f64 / complete.len() as f64;
            let longest_mib = cost * sim_types::SCENE_SIZE_BYTES_MAX as f64 / f64::from(1 << 20);
            assert!(longest_mib < COST_MAX_MIB as f64, "{longest_mib} MiB: {complete}");
        }
    }

    #[test]
    fn a_text_that_would_need_gigabytes_is_refused_although_it_is_no_scene() {
        let tables = "[[generate]]\n".repeat(1_000_000);
        let keys = "a.b.c.d.e=1\n".repeat(300_000);
        let lists = format!("a = [{}]", "[],".repeat(5_000_000));
        let nested = format!("a = [{}]", "[[[[1]]]],".repeat(1_500_000));
        for text in [&tables, &keys, &lists, &nested] {
            assert!(refusal(text).is_some());
            // The parser recovers from these errors.
            assert!(refusal(&format!("x = 1 [\n{text}")).is_some());
            assert!(refusal(&format!("[a\n{text}")).is_some());
        }
        assert_eq!(refusal("version = 1\nname = \"[[a]]\"\n"), None);
        let deep = "[".repeat(1_000_000);
        assert_eq!(refusal(&format!("a = {deep}")), None);
    }
}
