//! Proves that a recording re-simulates bit for bit.

mod checks;
mod coverage;
mod difference;
mod events;
mod finding;
mod load;
mod past_states;
mod read_ahead;
mod report;
mod resimulation;
mod side_rows;
mod snapshot_numbers;
mod state;

use std::io::Read;
use std::sync::atomic::AtomicBool;
use std::thread;

use crate::log::LogReader;
use crate::recorded_scene::scene_to_simulate;
pub use checks::{StepRange, VerifyError, VerifyOptions};
use checks::{Verification, check_header};
pub use difference::{
    Difference, SnapshotDifference, distance, first_difference, snapshot_difference,
};
pub use finding::{NotIdentical, SnapshotFinding, StepGap};
pub use report::{Verdict, VerifyReport};
pub use resimulation::{Resimulation, ResimulationError};

/// Snapshots between two calls of `on_progress`.
const SNAPSHOTS_PER_UPDATE: u64 = 64;

/// Re-simulates a recording and compares everything that a recorder writes, up to the first difference.
///
/// Calls `on_progress` periodically, with the number of bytes that are read. Ends early, even within a
/// step, if `stop` becomes true.
///
/// # Errors
/// If the file cannot be read, or has no complete state to start from. A difference is no error, but part
/// of the report.
pub fn verify<R: Read + Send>(
    log: LogReader<R>,
    options: VerifyOptions,
    stop: &AtomicBool,
    on_progress: impl FnMut(u64),
) -> Result<VerifyReport, VerifyError> {
    let scene = scene_to_simulate(&log, "`recorder verify`")?;
    let log = log.with_audit();
    let header = check_header(&log, &scene);
    // The reading thread ends when the verification is dropped, at the latest after its batch.
    thread::scope(|threads| {
        let verification = Verification::start(threads, log, &scene, options)?;
        report(verification, header, stop, on_progress)
    })
}

/// Compares the states, unless the header differs, and returns the report.
fn report(
    mut verification: Verification,
    header: SnapshotFinding,
    stop: &AtomicBool,
    on_progress: impl FnMut(u64),
) -> Result<VerifyReport, VerifyError> {
    let mut report = VerifyReport::new();
    match header {
        SnapshotFinding::Identical => {
            compare_states(&mut verification, &mut report, stop, on_progress)?;
            report.gaps = verification.gaps();
        }
        finding => _ = report.add(finding, 0),
    }
    report.end.clone_from(&verification.frames.seen.end);
    if verification.simulation.is_none() && report.verdict == Verdict::Identical {
        return Err(match verification.coverage.last_step {
            Some(step) => VerifyError::NoStateUpTo { step },
            None => VerifyError::NoKeyframe { end: report.incomplete_end().cloned() },
        });
    }
    report.lost = verification.numbers.lost(verification.frames.seen.closing.as_deref());
    report.not_covered = verification.coverage.not_covered();
    report.skipped = verification.coverage.skipped;
    Ok(report)
}

/// Compares every snapshot, up to the first finding, and then the end of the file.
fn compare_states(
    verification: &mut Verification,
    report: &mut VerifyReport,
    stop: &AtomicBool,
    mut on_progress: impl FnMut(u64),
) -> Result<(), VerifyError> {
    let mut count = 0;
    while let Some((step, finding)) = verification.next(stop)? {
        count += 1;
        if count % SNAPSHOTS_PER_UPDATE == 0 {
            on_progress(verification.frames.seen.intact_count);
        }
        if report.is_empty() {
            report.first_step = step;
        }
        if !report.add(finding, step) {
            return Ok(());
        }
    }
    verification.finish_coverage();
    if verification.simulation.is_some() && verification.coverage.last_step.is_none() {
        let finding = verification.check_end();
        report.add_end(finding);
    }
    Ok(())
}
