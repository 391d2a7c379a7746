//! `ctl status`: the state of the node.

use std::str;
use std::time::Duration;

use anyhow::{Context, bail};
use bytemuck::cast_slice;
use serde::Serialize;
use sim_contract::{Client, MemberStatus, NodeStatus, State, Tap};
use sim_host::clock::monotonic_ns;
use sim_solver::{Energy, EnergyMeter, Scene};

use crate::args::CtlArgs;
use crate::output;

/// A status in JSON.
#[derive(Serialize)]
pub(crate) struct StatusRow {
    pub(crate) scene: String,
    pub(crate) run_id: String,
    pub(super) process_id: u32,
    pub(crate) step: u64,
    pub(crate) paused: bool,
    pub(crate) replay: bool,
    pub(crate) rate_hz: u32,
    /// None before the first whole second.
    pub(crate) real_time_factor: Option<f64>,
    time_scale: f64,
    particles: u32,
    constraints: u32,
    pub(super) torn_constraints: u32,
    frozen_particles: u64,
    standing_body_steps: u64,
    pub(crate) readers: u32,
    outcomes: u64,
    pub(super) rejected_commands: u64,
    pub(crate) late_steps: u64,
    skipped_periods: u64,
    wake_late_ns_p50: u64,
    wake_late_ns_p99: u64,
    pub(super) solve_ns_p50: u64,
    pub(super) solve_ns_p99: u64,
    pub(crate) lockstep: Vec<MemberRow>,
}

/// A member of the lockstep.
#[derive(Serialize)]
pub(crate) struct MemberRow {
    client_id: u64,
    every: u32,
    step: u64,
    awaited: bool,
}

impl From<&MemberStatus> for MemberRow {
    fn from(member: &MemberStatus) -> Self {
        let MemberStatus { client_id, every, step, is_awaited } = *member;
        Self { client_id, every, step, awaited: is_awaited != 0 }
    }
}

impl StatusRow {
    pub(crate) fn new(status: &NodeStatus) -> Self {
        Self {
            scene: status.scene_name(),
            run_id: format!("{:016x}", status.run_id),
            process_id: status.process_id,
            step: status.step,
            paused: status.is_paused(),
            replay: status.is_replay(),
            rate_hz: status.rate_hz,
            real_time_factor: measured_factor(status),
            time_scale: status.time_scale,
            particles: status.particle_count,
            constraints: status.constraint_count,
            torn_constraints: status.torn_count,
            frozen_particles: status.frozen_count,
            standing_body_steps: status.standing_body_steps,
            readers: status.reader_count,
            outcomes: status.outcome_count,
            rejected_commands: status.rejected_count,
            late_steps: status.late_steps,
            skipped_periods: status.skipped_periods,
            wake_late_ns_p50: status.wake_late_ns_p50,
            wake_late_ns_p99: status.wake_late_ns_p99,
            solve_ns_p50: status.solve_ns_p50,
            solve_ns_p99: status.solve_ns_p99,
            lockstep: status.members().iter().map(MemberRow::from).collect(),
        }
    }

    /// Real-time factor for people; `None` before one has been measured.
    pub(crate) fn real_time(&self) -> Option<String> {
        self.real_time_factor.map(|factor| format!("x{factor:.3}"))
    }

    /// State for people.
    pub(crate) fn state(&self) -> &'static str {
        match (self.replay, self.paused) {
            (false, false) => "running",
            (false, true) => "paused",
            (true, false) => "replay",
            (true, true) => "replay, paused",
        }
    }

    /// Lines for people: rounded, and with units.
    fn lines(&self) -> Vec<(&'static str, String)> {
        let times = |p50_ns: u64, p99_ns: u64| {
            let micros = |ns: u64| ns as f64 / 1000.0;
            format!("{:.1} µs median, {:.1} µs 99th percentile", micros(p50_ns), micros(p99_ns))
        };
        let frozen = match self.frozen_particles {
            0 => String::new(),
            count => format!(", {count} frozen"),
        };
        let skipped = match self.skipped_periods {
            0 => String::new(),
            count => format!(", {count} periods skipped"),
        };
        let mut lines = vec![
            ("scene", self.scene.clone()),
            ("process", format!("{}, run {}", self.process_id, self.run_id)),
            ("step", format!("{}, {}", self.step, self.state())),
            ("rate", format!("{} Hz, time scale {:.3}", self.rate_hz, self.time_scale)),
            ("real time", self.real_time().unwrap_or_else(|| "not measured yet".to_owned())),
            ("particles", format!("{}{frozen}", self.particles)),
            ("constraints", format!("{}, {} torn", self.constraints, self.torn_constraints)),
            ("commands", format!("{}, {} rejected", self.outcomes, self.rejected_commands)),
            ("readers", self.readers.to_string()),
            ("late", format!("{} steps{skipped}", self.late_steps)),
            ("wake-up delay", times(self.wake_late_ns_p50, self.wake_late_ns_p99)),
            ("step time", times(self.solve_ns_p50, self.solve_ns_p99)),
        ];
        if self.standing_body_steps > 0 {
            lines.push(("bodies", format!("stood in {} steps", self.standing_body_steps)));
        }
        lines.extend(self.lockstep.iter().map(|member| ("lockstep", member.describe())));
        lines
    }
}

/// Returns the factor of the last whole second; `None` for a node that runs, but has made no step in a whole second.
fn measured_factor(status: &NodeStatus) -> Option<f64> {
    let is_measured = status.is_paused() || status.real_time_factor != 0.0;
    is_measured.then_some(status.real_time_factor)
}

impl MemberRow {
    fn describe(&self) -> String {
        let Self { client_id, every, step, awaited } = self;
        let period = if *every > 1 { format!(" every {every} steps,") } else { String::new() };
        let state = if *awaited { "awaited, " } else { "" };
        format!("client {client_id},{period} {state}ready for step {step}")
    }
}

/// A status in JSON, with the energy if it was asked for.
#[derive(Serialize)]
struct Report {
    #[serde(flatten)]
    status: StatusRow,
    #[serde(skip_serializing_if = "Option::is_none")]
    energy: Option<EnergyRow>,
}

/// Longest wait for the newest snapshot. A node that runs has one.
const SNAPSHOT_TIMEOUT: Duration = Duration::from_millis(50);

/// Returns the step of the newest snapshot: a node publishes its status only ten times a second.
fn newest_step(client: &mut Client, status: &NodeStatus) -> u64 {
    let newest = client.latest_snapshot(SNAPSHOT_TIMEOUT).ok().flatten();
    let newest = newest.map(|snapshot| *snapshot.header());
    let step = newest.filter(|header| header.run_id == status.run_id).map(|header| header.step);
    // A replay can go back.
    let step = step.filter(|step| status.is_replay() || *step > status.step);
    step.unwrap_or(status.step)
}

/// Prints the newest status, and the energy of the newest state if it is asked for.
pub(super) fn print(client: &mut Client, args: &CtlArgs, has_energy: bool) -> anyhow::Result<()> {
    let Some(status) = client.status(args.timeout())? else {
        bail!("the node published no status within {:?}; is it stopped?", args.timeout());
    };
    let step = newest_step(client, &status);
    let energy = has_energy.then(|| EnergyRow::read(args)).transpose()?;
    let report = Report { status: StatusRow { step, ..StatusRow::new(&status) }, energy };
    if args.json {
        return output::json(&report);
    }
    let energy = report.energy.iter().map(|energy| ("energy", energy.text()));
    for (key, value) in report.status.lines().into_iter().chain(energy) {
        output::line(&format!("{key:<14} {value}"))?;
    }
    Ok(())
}

/// The energy of a state in JSON.
#[derive(Debug, Serialize)]
pub(super) struct EnergyRow {
    /// The step of the state.
    step: u64,
    #[serde(flatten)]
    energy: Energy,
    /// Unit of the energies: "J", or another one such as "kg cm²/s²".
    unit: String,
}

impl EnergyRow {
    /// Measures the newest state of the node.
    pub(super) fn read(args: &CtlArgs) -> anyhow::Result<Self> {
        let mut tap = Tap::attach(&args.endpoint.endpoint()?)?;
        let begin_ns = monotonic_ns();
        loop {
            if let Some(state) = tap.next_state(|_| {}) {
                return Self::of(&state);
            }
            let passed = Duration::from_nanos(monotonic_ns() - begin_ns);
            let left = args.timeout().saturating_sub(passed);
            if left.is_zero() {
                bail!("the node published no state within {:?}; is it stopped?", args.timeout());
            }
            tap.wait(left);
        }
    }

    fn of(state: &State<'_>) -> anyhow::Result<Self> {
        let text = str::from_utf8(&state.load.scene).context("the scene of the node is no text")?;
        let scene = Scene::from_toml(text, "scene").context("the scene of the node")?;
        let (particles, values) = (cast_slice(state.particles), &state.parameters.values);
        let energy = EnergyMeter::new(&scene).measure(particles, state.torn.indices(), values);
        let energy = energy.context("the newest state is not one of the scene of the node")?;
        Ok(Self { step: state.header.step, energy, unit: scene.energy_unit() })
    }

    /// Text for people.
    pub(super) fn text(&self) -> String {
        let Self { step, energy, unit } = self;
        let Energy { kinetic, potential, elastic } = energy;
        let total = energy.total();
        format!(
            "{total:.6} {unit} in step {step}: {kinetic:.6} kinetic, {potential:.6} potential, {elastic:.6} elastic"
        )
    }
}

#[cfg(test)]
mod tests {
    use sim_contract::StatusFlags;

    use super::*;

    #[test]
    fn a_real_time_factor_is_shown_once_it_is_measured() {
        let text = |real_time_factor, flags| {
            let status = NodeStatus { real_time_factor, flags, ..NodeStatus::default() };
            let lines = StatusRow::new(&status).lines();
            lines.into_iter().find(|(name, _)| *name == "real time").unwrap().1
        };
        assert_eq!(text(0.0, 0), "not measured yet");
        assert_eq!(text(0.5, 0), "x0.500");
        assert_eq!(text(0.0, StatusFlags::PAUSED), "x0.000");
    }
}
