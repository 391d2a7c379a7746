//! The threads of a solver, with their kernels and scratch memory.

use crate::constraints::bends::block::BendBlock;
use crate::constraints::projection_block::ProjectionBlock;
use crate::contacts::contact::reaction::{ReactionRoom, Reactions};
use crate::contacts::contact::{ContactRoom, Contacts};
use crate::kernels::Kernels;
use crate::kernels::worker_pool::{RunningStep, WORKERS_MAX, WorkerPool};

/// The threads, the kernels that they run, and the scratch memory of each.
#[derive(Debug, Clone)]
pub(crate) struct Workers {
    pub(crate) kernels: Kernels,
    pool: WorkerPool,
    scratches: Vec<WorkerScratch>,
}

/// Scratch memory of one worker, in cache lines of its own, because each worker writes its own constantly.
#[derive(Debug, Clone, Default)]
#[repr(align(128))]
pub(crate) struct WorkerScratch {
    pub(crate) contacts: Contacts,
    pub(crate) block: Box<ProjectionBlock>,
    pub(crate) bends: Box<BendBlock>,
}

impl Workers {
    pub(crate) fn new(kernels: Kernels, count: usize) -> Self {
        let pool = WorkerPool::new(count);
        let scratches = vec![WorkerScratch::default(); pool.worker_count()];
        Self { kernels, pool, scratches }
    }

    pub(crate) fn count(&self) -> usize {
        self.pool.worker_count()
    }

    /// Prepares for the jobs of a step, which ends when the result is dropped.
    pub(crate) fn begin_step(&mut self) -> RunningStep {
        self.pool.begin_step()
    }

    /// Number of items per part when `count` items are divided among the workers. No part but the last one is shorter
    /// than `min`, because a worker needs a microsecond to begin.
    pub(crate) fn part_length(&self, count: usize, min: usize) -> usize {
        count.div_ceil(self.count()).max(min)
    }

    /// Makes room for contacts.
    pub(crate) fn reserve_contacts(&mut self, room: ContactRoom) {
        for scratch in &mut self.scratches {
            scratch.contacts = Contacts::new(room);
        }
    }

    /// Makes room for reactions, or forgets them.
    pub(crate) fn reserve_reactions(&mut self, room: ReactionRoom) {
        for scratch in &mut self.scratches {
            scratch.contacts.reactions = Reactions::new(room);
        }
    }

    /// The reactions that each worker has summed.
    pub(crate) fn reactions(&mut self) -> impl Iterator<Item = &mut Reactions> {
        self.scratches.iter_mut().map(|scratch| &mut scratch.contacts.reactions)
    }

    /// Scratch memory of the calling thread.
    pub(crate) fn own_scratch(&mut self) -> &mut WorkerScratch {
        &mut self.scratches[0]
    }

    /// Runs `work` on every part, each with the scratch memory of a worker, then `finish` on every
    /// part in order. With a single worker or part, the calling thread does everything. Otherwise parts run side by side,
    /// so one may wait for a milestone of another.
    ///
    /// # Panics
    /// If there are more parts than workers.
    pub(crate) fn for_each<P: Send>(
        &mut self,
        mut parts: impl Iterator<Item = P>,
        work: impl Fn(&mut P, &mut WorkerScratch) + Sync,
        mut finish: impl FnMut(P),
    ) {
        let (first, second) = (parts.next(), parts.next());
        let is_alone = self.count() == 1 || second.is_none();
        let parts = first.into_iter().chain(second).chain(parts);
        if is_alone {
            for mut part in parts {
                work(&mut part, &mut self.scratches[0]);
                finish(part);
            }
            return;
        }
        let mut pairs = [const { None }; WORKERS_MAX];
        let (mut count, mut scratches) = (0, self.scratches.iter_mut());
        for (part, pair) in parts.zip(&mut pairs) {
            let scratch = scratches.next();
            assert!(scratch.is_some(), "more parts than workers");
            *pair = scratch.map(|scratch| (part, scratch));
            count += 1;
        }
        let pairs = &mut pairs[..count];
        self.pool.for_each(pairs, |pair| {
            if let Some((part, scratch)) = pair {
                work(part, scratch);
            }
        });
        for (part, _) in pairs.iter_mut().filter_map(Option::take) {
            finish(part);
        }
    }
}
