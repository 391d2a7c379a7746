//! Lists that several workers fill.

use super::box_tree::Search;
use crate::store::workers::Workers;

/// Number of parts for each worker where some parts take longer than others.
const PARTS_PER_WORKER: usize = 8;

/// Divides items whose work differs into parts of this length, of which each worker does several.
pub(super) fn parts<'a, P>(all: &'a [P], workers: &Workers) -> (&'a [P], usize) {
    (all, all.len().div_ceil(PARTS_PER_WORKER * workers.count()).max(1))
}

/// Items that the workers find, in the order in which one worker would find them.
#[derive(Debug, Clone)]
pub(super) struct Gathered<T> {
    pub(super) items: Vec<T>,
    count_max: usize,
    /// What each worker has found. Empty with one worker.
    shares: Vec<Share<T>>,
}

/// What a worker has found.
#[derive(Debug, Clone)]
struct Share<T> {
    items: Vec<T>,
    /// By part: the number of items at its end.
    ends: Vec<usize>,
}

/// A list with a largest number of items.
pub(super) struct Room<'a, T> {
    items: &'a mut Vec<T>,
    count_max: usize,
}

impl<T> Room<'_, T> {
    /// Adds an item. Breaks if there is no room for it.
    #[inline(always)]
    pub(super) fn add(&mut self, item: T) -> Search {
        if self.items.len() == self.count_max {
            return Search::Break(());
        }
        self.items.push(item);
        Search::Continue(())
    }
}

impl<T> Default for Gathered<T> {
    fn default() -> Self {
        Self::new(0)
    }
}

impl<T> Gathered<T> {
    /// Makes an empty list for one worker, with room for `count_max` items.
    pub(super) fn new(count_max: usize) -> Self {
        Self { items: Vec::with_capacity(count_max), count_max, shares: Vec::new() }
    }

    /// Makes room for what each of these workers finds.
    pub(super) fn set_worker_count(&mut self, count: usize) {
        let count = if count > 1 { count } else { 0 };
        self.shares.resize_with(count, || Share {
            items: Vec::with_capacity(self.count_max + 1),
            ends: Vec::with_capacity(PARTS_PER_WORKER),
        });
    }
}

impl<T: Copy + Send> Gathered<T> {
    /// Lets the workers add what they find in the parts of `all`, each of this length, and appends it in the order of the
    /// parts. Breaks, with the first items that have room, if there are too many.
    ///
    /// # Panics
    /// If there are more than [`PARTS_PER_WORKER`] parts for each worker.
    pub(super) fn extend<P: Sync>(
        &mut self,
        workers: &mut Workers,
        (all, part_length): (&[P], usize),
        find: impl Fn(&[P], &mut Room<'_, T>) -> Search + Sync,
    ) -> Search {
        let Self { items, count_max, shares } = self;
        let part_count = all.len().div_ceil(part_length);
        let worker_count = shares.len().min(part_count);
        if worker_count <= 1 {
            return find(all, &mut Room { items, count_max: *count_max });
        }
        assert!(part_count <= PARTS_PER_WORKER * worker_count, "too many parts");
        // One item more than fits tells that there are too many.
        let room = *count_max - items.len() + 1;
        workers.for_each(
            shares[..worker_count].iter_mut().enumerate(),
            |(worker, share), _| {
                // Neighbouring parts, which often take equally long, go to different workers.
                share.find_in(
                    all.chunks(part_length).skip(*worker).step_by(worker_count),
                    room,
                    &find,
                );
            },
            |_| {},
        );
        for part in 0..part_count {
            let found = shares[part % worker_count].of_part(part / worker_count);
            let fitting = found.len().min(*count_max - items.len());
            items.extend_from_slice(&found[..fitting]);
            if fitting < found.len() {
                return Search::Break(());
            }
        }
        Search::Continue(())
    }
}

impl<T: Copy> Share<T> {
    fn find_in<'a, P: 'a>(
        &mut self,
        parts: impl Iterator<Item = &'a [P]>,
        room: usize,
        find: &impl Fn(&[P], &mut Room<'_, T>) -> Search,
    ) {
        self.items.clear();
        self.ends.clear();
        for part in parts {
            // Without room, the parts behind this one find nothing, and are not needed.
            let _end = find(part, &mut Room { items: &mut self.items, count_max: room });
            self.ends.push(self.items.len());
        }
    }

    fn of_part(&self, part: usize) -> &[T] {
        let start = part.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.items[start..self.ends[part]]
    }
}
