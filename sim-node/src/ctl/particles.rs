//! `ctl particles`, `ctl nearest` and `ctl hash`: the newest snapshot.

use anyhow::{Context, bail};
use serde::Serialize;
use sim_contract::{Client, ParticleFlags, ParticleState, Snapshot};

use crate::args::CtlArgs;
use crate::output;
use crate::output::{Align, Table};

/// A particle in JSON.
#[derive(Serialize)]
struct ParticleRow {
    index: usize,
    position: [f32; 3],
    velocity: [f32; 3],
    inverse_mass: f32,
    flags: Vec<&'static str>,
}

impl ParticleRow {
    fn new(index: usize, particle: &ParticleState) -> Self {
        let flags = ParticleFlags::NAMES.iter().filter(|(bit, _)| particle.flags & bit != 0);
        Self {
            index,
            position: particle.position,
            velocity: particle.velocity,
            inverse_mass: particle.inverse_mass,
            flags: flags.map(|(_, name)| *name).collect(),
        }
    }

    /// Cells for people: rounded.
    fn cells(&self) -> [String; 9] {
        let [x, y, z] = self.position.map(|number| format!("{number:.4}"));
        let [vx, vy, vz] = self.velocity.map(|number| format!("{number:.4}"));
        let inverse_mass = format!("{:.4}", self.inverse_mass);
        [self.index.to_string(), x, y, z, vx, vy, vz, inverse_mass, self.flags.join(" ")]
    }
}

/// Particles of one snapshot in JSON.
#[derive(Serialize)]
struct ParticleRows {
    step: u64,
    particles: Vec<ParticleRow>,
}

/// Prints the particles with these indices, or all of them.
pub(super) fn print(client: &mut Client, args: &CtlArgs, indices: &[u32]) -> anyhow::Result<()> {
    let snapshot = latest_snapshot(client, args)?;
    let states = snapshot.particles();
    let row = |index: usize| {
        let state = states.get(index).with_context(|| match states.len() {
            0 => "the scene has no particles".to_owned(),
            count => format!("the scene has no particle {index} (allowed: 0 to {})", count - 1),
        });
        state.map(|state| ParticleRow::new(index, state))
    };
    let particles: Vec<_> = if indices.is_empty() {
        (0..states.len()).map(row).collect::<anyhow::Result<_>>()?
    } else {
        indices.iter().map(|index| row(*index as usize)).collect::<anyhow::Result<_>>()?
    };
    let step = snapshot.header().step;
    if args.json {
        return output::json(&ParticleRows { step, particles });
    }
    let number = |title| (title, Align::Right);
    let mut table = Table::new([
        number("particle"),
        number("x (m)"),
        number("y (m)"),
        number("z (m)"),
        number("vx (m/s)"),
        number("vy (m/s)"),
        number("vz (m/s)"),
        number("1/mass (1/kg)"),
        ("flags", Align::Left),
    ]);
    for particle in &particles {
        table.add(particle.cells());
    }
    output::text(&format!("step {step}\n{}", table.text()))
}

/// The particle nearest to a point, in JSON.
#[derive(Serialize)]
struct NearestRow {
    step: u64,
    index: usize,
    position: [f32; 3],
    distance: f64,
}

/// Prints the particle nearest to a point; of several, the one with the lowest index.
pub(super) fn print_nearest(
    client: &mut Client,
    args: &CtlArgs,
    point: [f32; 3],
) -> anyhow::Result<()> {
    let snapshot = latest_snapshot(client, args)?;
    let (index, distance) =
        nearest(snapshot.particles(), point).context("the scene has no particles")?;
    let position = snapshot.particles()[index].position;
    let step = snapshot.header().step;
    if args.json {
        return output::json(&NearestRow { step, index, position, distance });
    }
    let [x, y, z] = position;
    output::line(&format!(
        "particle {index} at {x:.4} {y:.4} {z:.4}, {distance:.4} m away (step {step})"
    ))
}

/// Index of the nearest particle and its distance in m; `None` without particles.
fn nearest(particles: &[ParticleState], point: [f32; 3]) -> Option<(usize, f64)> {
    let squared_distance = |particle: &ParticleState| -> f64 {
        let offsets =
            particle.position.iter().zip(point).map(|(a, b)| f64::from(*a) - f64::from(b));
        offsets.map(|offset| offset * offset).sum()
    };
    let distances = particles.iter().map(squared_distance).enumerate();
    let (index, squared) = distances.min_by(|(_, one), (_, other)| one.total_cmp(other))?;
    Some((index, squared.sqrt()))
}

/// A state hash in JSON.
#[derive(Serialize)]
struct HashRow {
    step: u64,
    state_hash: String,
}

/// Prints the state hash of the newest snapshot.
pub(super) fn print_hash(client: &mut Client, args: &CtlArgs) -> anyhow::Result<()> {
    let snapshot = latest_snapshot(client, args)?;
    let (step, hash) = (snapshot.header().step, snapshot.header().state_hash);
    let row = HashRow { step, state_hash: format!("{hash:016x}") };
    if args.json {
        return output::json(&row);
    }
    output::line(&format!("step {} state hash {}", row.step, row.state_hash))
}

fn latest_snapshot(client: &mut Client, args: &CtlArgs) -> anyhow::Result<Snapshot> {
    match client.latest_snapshot(args.timeout())? {
        Some(snapshot) => Ok(snapshot),
        None => bail!("the node published no snapshot within {:?}; is it stopped?", args.timeout()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn particle(x: f32) -> ParticleState {
        ParticleState { position: [x, 0.0, 0.0], ..ParticleState::default() }
    }

    #[test]
    fn the_nearest_particle_is_the_first_one_at_the_smallest_distance() {
        let particles = [particle(5.0), particle(1.0), particle(3.0)];
        assert_eq!(nearest(&particles, [2.0, 0.0, 0.0]), Some((1, 1.0)));
        assert_eq!(nearest(&particles, [6.0, 0.0, 1.0]), Some((0, 2.0_f64.sqrt())));
        assert_eq!(nearest(&[], [0.0; 3]), None);
    }

    #[test]
    fn flags_have_names_and_cells_are_rounded() {
        let state = ParticleState {
            position: [0.123_456, -1.0, 0.0],
            velocity: [1.0, 2.0, 3.0],
            inverse_mass: 0.0,
            flags: ParticleFlags::PINNED | ParticleFlags::GRABBED,
        };
        let row = ParticleRow::new(7, &state);
        let cells = [
            "7",
            "0.1235",
            "-1.0000",
            "0.0000",
            "1.0000",
            "2.0000",
            "3.0000",
            "0.0000",
            "pinned grabbed",
        ];
        assert_eq!(row.cells(), cells);
    }
}
