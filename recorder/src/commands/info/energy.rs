//! The energy of the states of a recording, for `recorder info --energy`.

use std::fmt;
use std::io::Read;
use std::ops::ControlFlow;

use anyhow::Context;
use recorder::{
    EnergyRow, LogReader, RecordedEnergy, SceneState, SceneStateError, recorded_scene, visit_states,
};
use serde::Serialize;

/// The energy at the ends of a recording, and the limits of its sum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct EnergyReport {
    first: StepEnergy,
    last: StepEnergy,
    /// The smallest and the largest sum.
    total_min: f64,
    total_max: f64,
}

/// The energy of the state of a step, in J.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct StepEnergy {
    step: u64,
    #[serde(flatten)]
    energy: EnergyRow,
    total: f64,
}

impl EnergyReport {
    /// Reads or measures the energy of each snapshot.
    pub(super) fn read<R: Read>(log: LogReader<R>) -> anyhow::Result<Self> {
        let mut measured = RecordedEnergy::new(&recorded_scene(&log)?);
        let mut report: Option<Self> = None;
        visit_states(log, 0.., |state: &SceneState| {
            if let Some(energy) = measured.of(state) {
                let (step, total) = (state.row.step, energy.total());
                let last = StepEnergy { step, energy, total };
                let before = report.unwrap_or(Self {
                    first: last,
                    last,
                    total_min: total,
                    total_max: total,
                });
                report = Some(Self {
                    last,
                    total_min: before.total_min.min(total),
                    total_max: before.total_max.max(total),
                    ..before
                });
            }
            Ok::<_, SceneStateError>(ControlFlow::Continue(()))
        })?;
        report.context("no snapshot has an energy: parameters or particles were not recorded")
    }
}

impl fmt::Display for EnergyReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{:<12}{:>14} {:>14} {:>14} {:>14}",
            "energy in J", "kinetic", "potential", "elastic", "total"
        )?;
        for StepEnergy { step, energy: EnergyRow { kinetic, potential, elastic }, total } in
            [self.first, self.last]
        {
            let name = format!("step {step}");
            writeln!(
                f,
                "{name:<12}{kinetic:>14.6} {potential:>14.6} {elastic:>14.6} {total:>14.6}"
            )?;
        }
        write!(f, "{:<12}{:.6} to {:.6}", "total", self.total_min, self.total_max)
    }
}
