//! The loop's side of a job: it starts the work, and takes the result over at a boundary.

use sim_contract::{Action, COMMANDS_PER_STEP_MAX, Text};
use sim_host::Stop;
use sim_solver::{Keyframe, Plan};

use super::{Done, Job, Work, load};
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
        let (preparer, disposal) = (self.publisher.preparer(), self.disposal.take());
        self.begin_job("load", std::slice::from_ref(request), move || {
            // Its memory counts as free for this load.
            disposal.into_iter().for_each(Work::join);
            Done::Scene(load(source.as_str(), overrides, rate_hz, &preparer).map(Box::new))
        })?;
        self.inbox.hold(request.received.command.client_id);
        Ok(())
    }

    /// Drops something large beside the loop.
    pub(in crate::node) fn dispose(&mut self, replaced: impl Send + 'static) {
        let start = || Work::start("dispose", || drop(replaced));
        // Without a thread it was dropped here.
        self.disposal = self.cpus.lend(start).ok();
    }

    fn begin_job(
        &mut self,
        name: &str,
        requests: &[Request],
        work: impl FnOnce() -> Done + Send + 'static,
    ) -> Result<(), String> {
        let work = Some(self.cpus.lend(|| Work::start(name, work))?);
        self.job = Some(Job { requests: requests.to_vec(), work });
        Ok(())
    }

    /// Returns the job whose work is done. If a member has joined meanwhile, it waits for the work.
    pub(in crate::node) fn finish_job(&mut self, stop: &Stop) -> Option<(Vec<Request>, Done)> {
        let job = self.job.as_ref()?;
        let done = match &job.work {
            None => Done::Nothing,
            Some(work) if self.works_beside() => work.poll()?,
            Some(work) => work.wait(stop)?,
        };
        self.inbox.release();
        self.job.take().map(|job| (job.requests, done))
    }

    /// Returns `true` for a command whose work the loop cannot wait for.
    pub(in crate::node) fn is_long(&self, request: &Request) -> bool {
        self.works_beside()
            && self.progress.is_stepping()
            && self.plan(std::slice::from_ref(request)).is_some()
    }

    /// Makes a long command, and the further ones of its client, wait for their job.
    pub(in crate::node) fn put_aside(&mut self, request: Request) {
        let client_id = request.received.command.client_id;
        self.inbox.hold(client_id);
        self.inbox.put_back(request);
        self.waiting.get_or_insert(client_id);
    }

    /// Starts the job of the first client that waits for one, unless another job is under way. Settings
    /// that follow each other are one job, because a client may send them faster than they are derived.
    pub(in crate::node) fn begin_next_job(&mut self) {
        let Some(client_id) = self.waiting.take().filter(|_| self.job.is_none()) else { return };
        let requests = self.inbox.next_settings(client_id, COMMANDS_PER_STEP_MAX / 2);
        let is_begun = self.plan(&requests).is_some_and(|plan| {
            let spare = self.spare.take();
            let prepare = || Done::Constraints(Box::new(plan.prepare(spare)));
            self.begin_job("prepare", &requests, prepare).is_ok()
        });
        if !is_begun {
            // They cancel each other out, or no thread could be started.
            self.job = Some(Job { requests, work: None });
        }
    }

    fn plan(&self, requests: &[Request]) -> Option<Plan> {
        let first = requests.first()?;
        match first.received.command.action() {
            Action::Rewind { to_step, back_steps } => {
                let state = self.history.find(self.step, Target { to_step, back_steps }).ok()?;
                self.solver.plan_state(&self.history.keyframe(state))
            }
            Action::Restore { .. } => {
                let state = first.state.as_deref()?.as_ref().ok()?;
                let is_own = state.scene_hash == self.publisher.scene_hash();
                let bytes = state.keyframe.as_ref().filter(|_| is_own)?;
                self.solver.plan_state(&Keyframe::decode(bytes).ok()?)
            }
            _ => self.solver.plan(requests.iter().map(|one| one.received.command.action())),
        }
    }
}
