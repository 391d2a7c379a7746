//! `ctl`: commands to a running node, and questions.

mod action;
mod hint;

use anyhow::{Context, bail};
use serde::Serialize;
use sim_contract::{
    Action, CONSOLE_CLIENT_ID, Client, Endpoint, NodeStatus, OUTCOME_FLAG_CONTROL, Outcome,
};

use crate::args::{CtlArgs, CtlVerb};

/// Sends one command, or asks one question.
pub(crate) fn ctl(args: &CtlArgs) -> anyhow::Result<()> {
    let endpoint = Endpoint::from_options(args.domain.as_deref(), &args.name)?;
    let mut client = Client::attach_as(&endpoint, CONSOLE_CLIENT_ID)?;
    match args.verb {
        CtlVerb::Status => status(&mut client, args),
        CtlVerb::Hash => hash(&mut client, args),
        _ => command(&mut client, args, action::of(&args.verb)?),
    }
}

/// An outcome in JSON: the command with what became of it.
#[derive(Serialize)]
struct OutcomeRow {
    index: u64,
    step: u64,
    status: &'static str,
    reason: &'static str,
    #[serde(flatten)]
    action: Action,
}

#[allow(clippy::print_stdout, reason = "the result of the command")]
fn command(client: &mut Client, args: &CtlArgs, action: Action) -> anyhow::Result<()> {
    let outcome: Outcome = client.request(action, args.timeout)?;
    if let Action::Step { count } = action {
        wait_for_steps(client, args, &outcome, count)?;
    }
    let row = OutcomeRow {
        index: outcome.index,
        step: outcome.step,
        status: if outcome.is_applied() { "applied" } else { "rejected" },
        reason: outcome.reason_name(),
        action: outcome.command.action(),
    };
    if args.json {
        println!("{}", serde_json::to_string(&row)?);
    } else if outcome.is_applied() {
        println!("applied at step {}", row.step);
    } else {
        println!(
            "rejected at step {}: {}{}",
            row.step,
            row.reason,
            hint::of(&row.action, &outcome)
        );
    }
    Ok(())
}

/// Waits until the steps are made, so that a question after it is answered from behind them.
fn wait_for_steps(
    client: &mut Client,
    args: &CtlArgs,
    outcome: &Outcome,
    count: u32,
) -> anyhow::Result<()> {
    if !outcome.is_applied() {
        return Ok(());
    }
    let last = outcome.step + u64::from(count) - 1;
    while let Some(snapshot) = client.next_snapshot(args.timeout)? {
        if snapshot.header().step >= last {
            return Ok(());
        }
    }
    // A replay may end before it has shown as many.
    if outcome.flags & OUTCOME_FLAG_CONTROL != 0 {
        return Ok(());
    }
    bail!("the steps up to {last} were begun, but no snapshot came for {:?}", args.timeout)
}

/// A status in JSON.
#[derive(Serialize)]
struct StatusRow {
    scene: String,
    run_id: String,
    process_id: u32,
    step: u64,
    paused: bool,
    rate_hz: u32,
    real_time_factor: f64,
    time_scale: f64,
    particles: u32,
    constraints: u32,
    torn_constraints: u32,
    frozen_particles: u64,
    readers: u32,
    outcomes: u64,
    rejected_commands: u64,
    late_steps: u64,
    skipped_periods: u64,
    wake_late_ns_p50: u64,
    wake_late_ns_p99: u64,
    solve_ns_p50: u64,
    solve_ns_p99: u64,
}

impl StatusRow {
    fn new(status: &NodeStatus) -> Self {
        Self {
            scene: status.scene_name(),
            run_id: format!("{:016x}", status.run_id),
            process_id: status.process_id,
            step: status.step,
            paused: status.is_paused(),
            rate_hz: status.rate_hz,
            real_time_factor: status.real_time_factor,
            time_scale: status.time_scale,
            particles: status.particle_count,
            constraints: status.constraint_count,
            torn_constraints: status.torn_count,
            frozen_particles: status.frozen_count,
            readers: status.reader_count,
            outcomes: status.outcome_count,
            rejected_commands: status.rejected_count,
            late_steps: status.late_steps,
            skipped_periods: status.skipped_periods,
            wake_late_ns_p50: status.wake_late_ns_p50,
            wake_late_ns_p99: status.wake_late_ns_p99,
            solve_ns_p50: status.solve_ns_p50,
            solve_ns_p99: status.solve_ns_p99,
        }
    }
}

#[allow(clippy::print_stdout, reason = "the result of the command")]
fn status(client: &mut Client, args: &CtlArgs) -> anyhow::Result<()> {
    let Some(status) = client.status(args.timeout)? else {
        bail!("the node published no status within {:?}; is it stopped?", args.timeout);
    };
    let row = serde_json::to_value(StatusRow::new(&status))?;
    if args.json {
        println!("{row}");
        return Ok(());
    }
    for (key, value) in row.as_object().context("a status is an object")? {
        println!("{:<18} {}", key, value.to_string().trim_matches('"'));
    }
    Ok(())
}

/// A hash in JSON.
#[derive(Serialize)]
struct HashRow {
    step: u64,
    state_hash: String,
}

#[allow(clippy::print_stdout, reason = "the result of the command")]
fn hash(client: &mut Client, args: &CtlArgs) -> anyhow::Result<()> {
    let Some(snapshot) = client.latest_snapshot(args.timeout)? else {
        bail!("the node published no snapshot within {:?}; is it stopped?", args.timeout);
    };
    let (step, hash) = (snapshot.header().step, snapshot.header().state_hash);
    let row = HashRow { step, state_hash: format!("{hash:016x}") };
    if args.json {
        println!("{}", serde_json::to_string(&row)?);
    } else {
        println!("step {} state hash {}", row.step, row.state_hash);
    }
    Ok(())
}
