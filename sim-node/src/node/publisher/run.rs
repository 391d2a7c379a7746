//! Loads after the first one, in the same run or in a new one.

use sim_contract::{
    Command, KeyframeHeader, OUTCOME_FLAG_NEW_RUN, Outcome, OwnerError, ReplacedMemory,
    SnapshotHeader, Wake,
};
use sim_solver::Solver;

use super::load::{LoadMessages, LoadPlace};
use super::{Publisher, parameter_values};

/// Run of a loaded scene.
#[derive(Debug)]
pub(crate) enum Run {
    /// The run goes on, because the rate is the same.
    Same {
        /// The first step that shows the scene.
        step: u64,
    },
    /// A new run.
    New {
        run_id: u64,
        /// Outcome of the load, which ends the log of the old run.
        last: Box<Outcome>,
    },
}

impl Publisher {
    /// Publishes another scene. A new run begins with [`Self::begin_run`]. Returns the memory of the old
    /// one.
    ///
    /// # Errors
    /// The scene exceeds a limit of the contract or of shared memory; the old one stays published.
    pub(crate) fn load(
        &mut self,
        messages: &LoadMessages,
        solver: &Solver,
        run: &Run,
        time_scale: f64,
    ) -> Result<ReplacedMemory, OwnerError> {
        let (run_id, step, topology_revision) = match *run {
            Run::Same { step } => (self.run_id, step, self.topology_revision + 1),
            Run::New { run_id, .. } => (run_id, 0, 0),
        };
        let parameters = parameter_values(solver, time_scale);
        let place = LoadPlace { run_id, step, topology_revision, parameters: parameters.clone() };
        let Self { owner, outcomes, .. } = self;
        let replaced = owner.load_after(&messages.at(place), |owner| match run {
            Run::Same { .. } => Ok(()),
            // The outcomes of the old run come before anything of the new one.
            Run::New { last, .. } => {
                let mut all = outcomes.drain(..).chain([**last]);
                all.try_for_each(|outcome| owner.publish_outcome(&outcome))?;
                owner.wake(Wake::Outcome);
                Ok(())
            }
        })?;
        self.scene_hash = messages.scene_hash();
        self.parameters = parameters;
        self.topology_revision = topology_revision;
        self.torn = Vec::with_capacity(solver.constraint_count());
        self.since_step = step;
        self.colliders = Vec::with_capacity(solver.collider_count());
        Ok(replaced)
    }

    /// Returns the outcome of a load that begins another run: the last one of this run.
    pub(crate) fn last_outcome(&self, step: u64, command: Command) -> Box<Outcome> {
        let outcome = Outcome::new(self.outcome_count, step, command, Ok(()));
        Box::new(Outcome { run_id: self.run_id, flags: OUTCOME_FLAG_NEW_RUN, ..outcome })
    }

    /// Begins a run, whose scene is published. Publish its step 0 next.
    pub(crate) fn begin_run(&mut self, run_id: u64, rate_hz: u32) {
        (self.run_id, self.rate_hz) = (run_id, rate_hz);
        (self.last, self.keyframe) = (SnapshotHeader::default(), KeyframeHeader::default());
        (self.outcome_count, self.same_state_count, self.rejected_count) = (0, 0, 0);
        self.snapshot_count = 0;
        (self.since_step, self.in_place_step) = (0, 0);
        self.request_keyframe();
    }
}
