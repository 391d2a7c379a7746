//! A command with its outcome.

use std::time::Duration;

use anyhow::{Context, bail};
use serde::Serialize;
use sim_contract::{Action, COMMANDS_BUFFERED, Client, Outcome};
use sim_host::clock::monotonic_ns;

use super::explanation;
use crate::args::CtlArgs;
use crate::output;
use crate::output::Exit;

/// An outcome in JSON: the command with its result.
#[derive(Serialize)]
struct OutcomeRow {
    index: u64,
    step: u64,
    status: &'static str,
    reason: &'static str,
    /// A load began another run.
    #[serde(skip_serializing_if = "is_false")]
    new_run: bool,
    #[serde(flatten)]
    action: Action,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_false(value: &bool) -> bool {
    !value
}

/// Sends the commands of a verb, and prints the outcome of the first one that is rejected, or else of the
/// first one. Waits for the last step of `step`.
pub(super) fn send(
    client: &mut Client,
    args: &CtlArgs,
    actions: &[Action],
) -> anyhow::Result<Exit> {
    let outcome = request_all(client, args, actions)?;
    if let Action::Step { count } = outcome.command.action()
        && outcome.is_applied()
    {
        wait_for_steps(client, args, &outcome, count)?;
    }
    let row = OutcomeRow {
        index: outcome.index,
        step: outcome.step,
        status: if outcome.is_applied() { "applied" } else { "rejected" },
        reason: outcome.reason_name(),
        new_run: outcome.begins_run(),
        action: outcome.command.action(),
    };
    let (step, reason) = (row.step, row.reason);
    if args.json {
        output::json(&row)?;
    } else if outcome.is_applied() {
        let what = match row.action {
            Action::Rewind { to_step: Some(to_step), .. } => {
                format!(": the state of step {to_step}")
            }
            Action::Load { .. } if row.new_run => {
                " as the end of its run: the scene begins a new run at \
                 step 0, because it has another rate"
                    .to_owned()
            }
            _ => String::new(),
        };
        output::line(&format!("applied at step {step}{what}"))?;
    } else {
        let explanation = explanation::explain(client, args.timeout(), &outcome)
            .map_or_else(String::new, |explanation| format!(": {explanation}"));
        output::line(&format!("rejected at step {step}: {reason}{explanation}"))?;
    }
    if !outcome.is_applied() {
        return Ok(Exit::Rejected);
    }
    if let Some(hint) = explanation::hint(client, args.timeout(), &row.action) {
        output::note(&format!("hint: {hint}"));
    }
    Ok(Exit::Done)
}

/// Sends the first command, and if it is applied the others, which append to its motion: several at a time, because the
/// outcome of each takes a step. Returns the first rejection, or else the outcome of the first command, whose step
/// is the first step that shows the motion.
fn request_all(client: &mut Client, args: &CtlArgs, actions: &[Action]) -> anyhow::Result<Outcome> {
    let (first, others) = actions.split_first().context("there is nothing to send")?;
    let begun = client.request(*first, args.timeout())?;
    if !begun.is_applied() {
        return Ok(begun);
    }
    for actions in others.chunks(COMMANDS_BUFFERED / 2) {
        let mut sent = Vec::with_capacity(actions.len());
        for action in actions {
            sent.push(client.send(*action)?);
        }
        for sequence in sent {
            let outcome = client.outcome(sequence, args.timeout())?;
            if !outcome.is_applied() {
                return Ok(outcome);
            }
        }
    }
    Ok(begun)
}

/// Time between two checks whether a replay has ended.
const END_CHECK_PERIOD: Duration = Duration::from_millis(100);

/// Waits until the steps are made, so that a query after this call shows them. Without `--timeout`,
/// waits as long as the node makes steps.
fn wait_for_steps(
    client: &mut Client,
    args: &CtlArgs,
    outcome: &Outcome,
    count: u32,
) -> anyhow::Result<()> {
    let last = outcome.step + u64::from(count) - 1;
    let silence_max = args.timeout() + period(client, args.timeout())?;
    let is_replay = outcome.is_of_replay();
    let mut since_ns = monotonic_ns();
    loop {
        let passed = Duration::from_nanos(monotonic_ns() - since_ns);
        let remaining = silence_max.saturating_sub(passed);
        if remaining.is_zero() {
            break;
        }
        match client.next_snapshot(remaining.min(END_CHECK_PERIOD))? {
            Some(snapshot) if snapshot.header().step >= last => return Ok(()),
            Some(_) if args.timeout.is_none() => since_ns = monotonic_ns(),
            None if is_replay => refuse_end(client, last)?,
            _ => {}
        }
    }
    if !client.is_owner_alive() {
        bail!("the node ended before step {last}");
    }
    bail!(
        "step {last} has not come in time: the node is still stepping (`ctl pause` ends that, a \
         longer --timeout waits for it)"
    )
}

/// Returns an error if the replay stands at its end, before `last`.
fn refuse_end(client: &mut Client, last: u64) -> anyhow::Result<()> {
    if let Some(status) = client.status(Duration::ZERO)?
        && status.is_at_end()
        && status.step < last
    {
        bail!(
            "the replay has ended at step {}, its last snapshot, before step {last}",
            status.step
        );
    }
    Ok(())
}

/// Wall-clock time between two steps, which is long at a small time scale.
fn period(client: &mut Client, timeout: Duration) -> anyhow::Result<Duration> {
    let Some(status) = client.status(timeout)? else { return Ok(Duration::ZERO) };
    let seconds = 1.0 / (f64::from(status.rate_hz) * status.time_scale);
    Ok(Duration::try_from_secs_f64(seconds).unwrap_or(Duration::ZERO))
}
