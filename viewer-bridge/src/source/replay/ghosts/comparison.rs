//! Finds the first step at which two recordings differ.

use std::cmp::Ordering;

use recording::verification::{SnapshotDifference, snapshot_difference};
use recording::{Frame, FrameReader, IndexedLog, LogEnd, ReadError};
use sim_host::Stop;

/// The result of a comparison, up to the first difference.
#[derive(Debug, Default)]
pub(super) struct Compared {
    /// Number of equal steps that both have.
    pub(super) common_steps: u64,
    pub(super) first: Option<FirstDifference>,
    /// Where each file ends that lacks its end; otherwise empty.
    pub(super) ends: [String; 2],
}

/// The first difference.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct FirstDifference {
    pub(super) step: u64,
    /// The particle and the field, for the user.
    pub(super) place: String,
}

/// Compares the hashes and every bit of the particles in the steps that both files have, up to the first
/// difference. `on_step` is called after each, and returns whether to go on.
///
/// # Errors
/// A file cannot be read, or a signal has arrived.
pub(super) fn compare(
    [a, b]: [&IndexedLog; 2],
    stop: &Stop,
    mut on_step: impl FnMut(u64) -> bool,
) -> Result<Compared, ReadError> {
    let [mut a, mut b] = [FrameReader::new(a.reader(stop)?), FrameReader::new(b.reader(stop)?)];
    let mut compared = Compared::default();
    let (mut frame_a, mut frame_b) = (a.next_frame()?, b.next_frame()?);
    while let (Some(one), Some(other)) = (&frame_a, &frame_b) {
        let order = one.row.step.cmp(&other.row.step);
        if order == Ordering::Equal {
            compared.first = difference(one, other);
            if compared.first.is_some() {
                return Ok(compared);
            }
            compared.common_steps += 1;
        }
        if !on_step(one.row.step) {
            return Ok(compared);
        }
        if order != Ordering::Greater {
            frame_a = a.next_frame()?;
        }
        if order != Ordering::Less {
            frame_b = b.next_frame()?;
        }
    }
    compared.ends = [a, b].map(|reader| end_text(reader.end()));
    Ok(compared)
}

fn end_text(end: Option<&LogEnd>) -> String {
    end.filter(|end| **end != LogEnd::Complete).map(ToString::to_string).unwrap_or_default()
}

fn difference(a: &Frame, b: &Frame) -> Option<FirstDifference> {
    let place = match snapshot_difference(a, b)? {
        SnapshotDifference::Particle(found) => {
            format!("particle {}, {}", found.particle, found.field)
        }
        SnapshotDifference::TornConstraints => "the torn constraints".to_owned(),
    };
    Some(FirstDifference { step: a.row.step, place })
}
