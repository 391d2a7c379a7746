//! Energy: one row per snapshot.

use std::io::Write;

use anyhow::Context;
use recording::EnergyRow;
use sim_solver::EnergyMeter;

use crate::export::snapshots::Snapshots;

const COLUMNS: &str = "step,time_s,kinetic,potential,elastic,total";

/// Writes the table. Numbers have as many digits as their bits need, so reading gives the same bits.
pub(crate) fn write(snapshots: &Snapshots<'_>, out: &mut dyn Write) -> anyhow::Result<()> {
    let scene = snapshots.scene.context("the recording has no readable scene")?;
    let mut meter = EnergyMeter::new(scene);
    writeln!(out, "{COLUMNS}")?;
    snapshots.for_each(|state| {
        let step = state.row.step;
        let energy = state.energy(&mut meter).with_context(|| {
            format!("the state of step {step} has no energy: its parameters were not recorded, or it is not one of the scene")
        })?;
        let (time_s, total) = (snapshots.run_time_s(step), energy.total());
        let EnergyRow { kinetic, potential, elastic } = energy;
        writeln!(out, "{step},{time_s:?},{kinetic:?},{potential:?},{elastic:?},{total:?}")?;
        Ok(())
    })
}
