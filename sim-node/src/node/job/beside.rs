//! The loop's side of a job: it starts the work, and takes the result over at a boundary.

use sim_contract::{Action, Stop, Text};
use sim_solver::{Keyframe, Plan};

use super::scene::load;
use super::work::Work;
use super::{Done, Job};
use crate::node::Node;
use crate::node::history::Target;
use crate::node::inbox::Request;

impl Node {
    /// Returns `true` if the loop goes on while the work of a command is done.
    ///
    /// A node that does not keep time, or that waits for members of the lockstep, does the work at once, so
    /// that the step at which a command is applied does not depend on the time that the work takes.
    pub(in crate::node) fn works_beside(&self) -> bool {
        self.options.waits_for_time && !self.lockstep.has_members()
    }

    /// Starts to load a scene. The further commands of the client wait for it. The error is for people.
    pub(in crate::node) fn begin_load(
        &mut self,
        request: &Request,
        source: Text,
    ) -> Result<(), String> {
        let (overrides, rate_hz) = (self.options.overrides(), self.scene.solver.rate_hz);
        self.begin_job("load", request, move || {
            Done::Scene(load(source.as_str(), overrides, rate_hz).map(Box::new))
        })
    }

    fn begin_job(
        &mut self,
        name: &str,
        request: &Request,
        work: impl FnOnce() -> Done + Send + 'static,
    ) -> Result<(), String> {
        let work = self.cpus.lend(|| Work::start(name, work))?;
        self.inbox.hold(request.received.command.client_id);
        self.job = Some(Job { request: request.clone(), work });
        Ok(())
    }

    /// Returns the job whose work is done. If a member has joined meanwhile, it waits for the work.
    pub(in crate::node) fn finish_job(&mut self, stop: &Stop) -> Option<(Request, Done)> {
        let job = self.job.as_ref()?;
        let done = if self.works_beside() { job.work.poll() } else { job.work.wait(stop) };
        let done = done?;
        self.inbox.release();
        self.job.take().map(|job| (job.request, done))
    }

    /// Starts the work of a command beside the loop. Returns the command if it is cheap, or if nobody
    /// waits for the loop.
    pub(in crate::node) fn prepare_beside(&mut self, request: Request) -> Option<Request> {
        if !self.works_beside() || !self.progress.is_stepping() {
            return Some(request);
        }
        let Some(plan) = self.plan(&request) else { return Some(request) };
        if self.job.is_some() {
            self.inbox.hold(request.received.command.client_id);
            self.inbox.put_back(request);
            return None;
        }
        let spare = self.spare.take();
        let prepare = || Done::Constraints(Box::new(plan.prepare(spare)));
        match self.begin_job("prepare", &request, prepare) {
            Ok(()) => None,
            // Without a thread, the command does the work itself.
            Err(_) => Some(request),
        }
    }

    fn plan(&self, request: &Request) -> Option<Plan> {
        match request.received.command.action() {
            Action::Rewind { to_step, back_steps } => {
                let state = self.history.find(self.step, Target { to_step, back_steps }).ok()?;
                self.solver.plan_state(&state.keyframe())
            }
            Action::Restore { .. } => {
                let state = request.state.as_ref()?;
                let is_own = state.scene_hash == self.publisher.scene_hash();
                let bytes = state.keyframe.as_ref().filter(|_| is_own)?;
                self.solver.plan_state(&Keyframe::decode(bytes).ok()?)
            }
            action => self.solver.plan(&action),
        }
    }
}
