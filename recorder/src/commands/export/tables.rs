//! Tables as CSV: a row per particle and snapshot, or the energy of each snapshot.

use std::io::Write;

use anyhow::Context;
use recording::EnergyRow;
use sim_contract::ParticleState;
use sim_solver::EnergyMeter;

use super::snapshots::Snapshots;

const PARTICLE_COLUMNS: &str = "step,time_s,particle,x,y,z,vx,vy,vz,inverse_mass,flags";

/// Writes the table. Numbers have as many digits as their bits need, so reading gives the same bits.
pub(crate) fn write_particles(
    snapshots: &Snapshots<'_>,
    out: &mut dyn Write,
) -> anyhow::Result<()> {
    writeln!(out, "{PARTICLE_COLUMNS}")?;
    snapshots.for_each(|state| {
        let (step, time_s) = (state.row.step, snapshots.run_time_s(state.row.step));
        for (index, particle) in state.particles.iter().enumerate() {
            let ParticleState { position: [x, y, z], velocity: [vx, vy, vz], .. } = particle;
            let ParticleState { inverse_mass, flags, .. } = particle;
            writeln!(
                out,
                "{step},{time_s:?},{index},{x:?},{y:?},{z:?},{vx:?},{vy:?},{vz:?},\
                 {inverse_mass:?},{flags}"
            )?;
        }
        Ok(())
    })
}

const ENERGY_COLUMNS: &str = "step,time_s,kinetic,potential,elastic,total";

/// Writes the table. Numbers have as many digits as their bits need, so reading gives the same bits.
pub(crate) fn write_energy(snapshots: &Snapshots<'_>, out: &mut dyn Write) -> anyhow::Result<()> {
    let scene = snapshots.scene.context("the recording has no readable scene")?;
    let mut meter = EnergyMeter::new(scene);
    writeln!(out, "{ENERGY_COLUMNS}")?;
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
