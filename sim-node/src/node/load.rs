//! Loads: a scene replaces another one in the same run, or begins a new run if it has another rate.

use std::mem;

use anyhow::Context;
use sim_contract::{Command, OwnerError, Reason, Text};
use sim_host::Stop;
use sim_host::clock::monotonic_ns;
use sim_solver::Applied;

use super::inbox::Request;
use super::job::Done;
use super::job::{Loaded, Refusal};
use super::pace::Pace;
use super::publisher::StepTimes;
use super::publisher::run::Run;
use super::statistics::Statistics;
use super::threads::start_threads;
use super::{Boundary, Node};

impl Node {
    /// Loads a scene. The commands of its client wait for it, and the node goes on if it
    /// [works beside the loop](Self::works_beside).
    pub(super) fn load(
        &mut self,
        request: Request,
        source: Text,
        stop: &Stop,
    ) -> anyhow::Result<()> {
        if self.job.is_some() {
            self.inbox.hold(request.received.command.client_id);
            self.inbox.put_back(request);
            return Ok(());
        }
        if let Err(problem) = self.begin_load(&request, source) {
            let reason = Reason::NoEffectHere;
            return self.answer_load(&request, Err(Refusal { problem, reason }));
        }
        if self.works_beside() {
            return Ok(());
        }
        match self.finish_job(stop) {
            Some((_, Done::Scene(loaded))) => self.answer_load(&request, loaded),
            // This node ends.
            _ => Ok(()),
        }
    }

    /// Puts a loaded scene in place, and logs the outcome.
    pub(super) fn answer_load(
        &mut self,
        request: &Request,
        loaded: Result<Box<Loaded>, Refusal>,
    ) -> anyhow::Result<()> {
        // A fresh status follows, so that `ctl status` shows the effect.
        self.next_status_ns = 0;
        let (step, command) = (self.step + 1, request.received.command);
        let replaced = match loaded {
            Ok(loaded) => self.replace_scene(*loaded, command)?,
            Err(refusal) => Err(refusal),
        };
        match replaced {
            Err(Refusal { problem, reason }) => {
                if let sim_contract::Action::Load { scene } = command.action() {
                    self.warnings.print(&format!("load {scene}: {problem}"));
                }
                self.publisher.add_outcome(step, command, Err(reason));
            }
            Ok(run) => {
                self.grab_connections.on_applied(&request.received);
                self.history.restart(&self.solver);
                self.check_history();
                match run {
                    Run::Same { .. } => {
                        self.publisher.add_outcome(step, command, Ok(Applied::InPlace));
                        self.progress.is_state_due = true;
                    }
                    Run::New { run_id, .. } => self.begin_run(run_id)?,
                }
            }
        }
        Ok(())
    }

    /// Replaces the scene. The inner error is a refusal, and changes nothing; an outer error leaves
    /// neither scene able to continue.
    fn replace_scene(
        &mut self,
        loaded: Loaded,
        command: Command,
    ) -> anyhow::Result<Result<Run, Refusal>> {
        let Loaded { scene, mut solver, messages, begins_run } = loaded;
        start_threads(&mut solver, self.options.threads, &self.cpus);
        let run = if begins_run {
            let run_id = getrandom::u64().context("no random number for the run")?;
            Run::New { run_id, last: self.publisher.last_outcome(self.step + 1, command) }
        } else {
            Run::Same { step: self.step + 1 }
        };
        let time_scale = self.progress.time_scale;
        match self.publisher.load(&messages, &solver, &run, time_scale) {
            Err(error @ OwnerError::Publish(_)) => {
                Err(error).context("publishing the loaded scene")
            }
            Err(error) => {
                self.dispose((scene, solver, messages));
                let (problem, reason) = (error.to_string(), Reason::NoEffectHere);
                Ok(Err(Refusal { problem, reason }))
            }
            Ok(memory) => {
                let scene = mem::replace(&mut self.scene, scene);
                let solver = mem::replace(&mut self.solver, solver);
                let spare = self.spare.take();
                self.dispose((scene, solver, spare, memory, messages));
                Ok(Ok(run))
            }
        }
    }

    /// Begins a run of the new scene with its step 0. A paused node stays paused.
    fn begin_run(&mut self, run_id: u64) -> anyhow::Result<()> {
        let rate_hz = self.scene.solver.rate_hz;
        self.publisher.begin_run(run_id, rate_hz);
        self.lockstep.begin_run();
        self.progress.begin_run();
        let now_ns = monotonic_ns();
        self.pace = Pace::new(rate_hz, now_ns);
        self.pace.set_time_scale(self.progress.time_scale, now_ns);
        self.statistics = Statistics::new(now_ns)?;
        (self.start_ns, self.paused_ns, self.mark_ns) = (now_ns, 0, now_ns);
        self.step = 0;
        self.last_step = self.options.last_step(rate_hz);
        self.met = None;
        self.warnings.note(&format!("scene {} begins a new run at {rate_hz} Hz", self.scene.name));
        self.publisher.publish_step(&self.solver, self.position(), StepTimes::default())?;
        self.keep_state();
        self.boundary = Boundary::OfNewRun;
        Ok(())
    }
}
