//! CSV: one row per particle and snapshot.

use std::io::Write;

use sim_contract::ParticleState;

use crate::export::snapshots::Snapshots;

const COLUMNS: &str = "step,time_s,particle,x,y,z,vx,vy,vz,inverse_mass,flags";

/// Writes the table. Numbers have as many digits as their bits need, so reading gives the same bits.
pub(crate) fn write(snapshots: &Snapshots<'_>, out: &mut dyn Write) -> anyhow::Result<()> {
    writeln!(out, "{COLUMNS}")?;
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
