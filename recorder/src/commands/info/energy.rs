//! The energy of the states of a recording, for `recorder info --energy`.

use std::fmt;
use std::io::Read;

use anyhow::Context;
use recording::{EnergyRow, FrameReader, LogReader, SceneStates, recorded_scene};
use serde::Serialize;
use sim_solver::{EnergyMeter, Scene};

/// The energy at the ends of a recording, and the limits of its sum.
#[derive(Debug, Serialize)]
pub(super) struct EnergyReport {
    /// Unit of the energies: "J", or another one such as "kg cm²/s²".
    unit: String,
    #[serde(flatten)]
    range: EnergyRange,
}

/// The energy at the ends, and the limits of its sum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct EnergyRange {
    first: StepEnergy,
    last: StepEnergy,
    /// The smallest and the largest sum.
    total_min: f64,
    total_max: f64,
}

/// The energy of the state of a step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct StepEnergy {
    step: u64,
    #[serde(flatten)]
    energy: EnergyRow,
    total: f64,
}

impl EnergyReport {
    /// Reads the energy of each snapshot, or measures it if it was not recorded.
    pub(super) fn read<R: Read>(log: LogReader<R>) -> anyhow::Result<Self> {
        let scene = recorded_scene(&log)?;
        let unit = scene.energy_unit();
        let range =
            if log.selection().has_energy { recorded(log)? } else { measured(log, &scene)? };
        Ok(Self { unit, range: range.context("no snapshot has an energy")? })
    }
}

fn recorded<R: Read>(log: LogReader<R>) -> anyhow::Result<Option<EnergyRange>> {
    let mut frames = FrameReader::new(log);
    let mut range = None;
    while let Some(frame) = frames.next_frame()? {
        if let Some(energy) = frame.row.energy {
            range = Some(EnergyRange::with(range, frame.row.step, energy));
        }
    }
    Ok(range)
}

fn measured<R: Read>(log: LogReader<R>, scene: &Scene) -> anyhow::Result<Option<EnergyRange>> {
    log.selection().require_all_particles("`recorder info --energy`")?;
    let mut meter = EnergyMeter::new(scene);
    let mut range = None;
    let mut states = SceneStates::new(log);
    while let Some(state) = states.next_from(0)? {
        if let Some(energy) = state.energy(&mut meter) {
            range = Some(EnergyRange::with(range, state.row.step, energy));
        }
    }
    Ok(range)
}

impl EnergyRange {
    /// Adds the next step.
    fn with(before: Option<Self>, step: u64, energy: EnergyRow) -> Self {
        let total = energy.total();
        let last = StepEnergy { step, energy, total };
        let before =
            before.unwrap_or(Self { first: last, last, total_min: total, total_max: total });
        Self {
            last,
            total_min: before.total_min.min(total),
            total_max: before.total_max.max(total),
            ..before
        }
    }
}

impl fmt::Display for EnergyReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{:<12}{:>14} {:>14} {:>14} {:>14}",
            format!("in {}", self.unit),
            "kinetic",
            "potential",
            "elastic",
            "total"
        )?;
        for StepEnergy { step, energy: EnergyRow { kinetic, potential, elastic }, total } in
            [self.range.first, self.range.last]
        {
            let name = format!("step {step}");
            writeln!(
                f,
                "{name:<12}{kinetic:>14.6} {potential:>14.6} {elastic:>14.6} {total:>14.6}"
            )?;
        }
        let EnergyRange { total_min, total_max, .. } = self.range;
        write!(f, "{:<12}{total_min:.6} to {total_max:.6}", "total")
    }
}
