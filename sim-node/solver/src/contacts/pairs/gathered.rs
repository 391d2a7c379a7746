//! Lists that several workers fill.

use super::box_tree::Search;
use crate::kernels::worker_pool::WORKERS_MAX;
use crate::store::workers::Workers;

/// Number of parts for each worker of a search, since some parts take longer than others.
const PARTS_PER_WORKER: usize = 4;

/// Fewest roots in a part of a search: a worker needs a microsecond to begin.
const ROOTS_MIN: usize = 4;

/// Smallest capacity of a share: what a worker examines of a short list.
const SHARE_MIN: usize = 512;

/// Scratch memory of workers that need none.
pub(super) const NO_SCRATCHES: [(); WORKERS_MAX] = [(); WORKERS_MAX];

/// Items that the workers find, in the order in which one worker would find them.
#[derive(Debug, Clone)]
pub(super) struct Gathered<T> {
    pub(super) items: Vec<T>,
    count_max: usize,
    /// The items of each worker. Empty with one worker.
    shares: Vec<Share<T>>,
}

/// The items of one worker, in cache lines of its own, because each worker writes its own constantly.
#[derive(Debug, Clone)]
#[repr(align(128))]
struct Share<T> {
    items: Vec<T>,
    count_max: usize,
    /// By part: the number of items at its end.
    ends: Vec<usize>,
    /// It had no room for all.
    is_full: bool,
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

    /// Makes room for what each of these workers finds: twice an equal share.
    pub(super) fn set_worker_count(&mut self, count: usize) {
        self.shares.clear();
        if count > 1 {
            let count_max = (2 * self.count_max.div_ceil(count)).max(SHARE_MIN);
            self.shares.resize_with(count, || Share {
                items: Vec::with_capacity(count_max),
                count_max,
                ends: Vec::with_capacity(PARTS_PER_WORKER),
                is_full: false,
            });
        }
    }
}

impl<T: Copy + Send> Gathered<T> {
    /// Appends what the workers find below the roots of a search, in the order of the roots. Breaks, with the first items
    /// that have room, if there are too many. If a worker has no room for its share, one worker finds all, so nothing depends
    /// on the number of workers. Each worker has a scratch memory, the calling one the first.
    ///
    /// # Panics
    /// If there is no scratch memory for a worker.
    pub(super) fn extend<R: Sync, S: Send>(
        &mut self,
        workers: &mut Workers,
        roots: &[R],
        scratches: &mut [S],
        find: impl Fn(&[R], &mut Room<'_, T>, &mut S) -> Search + Sync,
    ) -> Search {
        let gathered = self.try_extend(workers, roots, scratches, &find);
        gathered.unwrap_or_else(|| find(roots, &mut self.room(), &mut scratches[0]))
    }

    /// The same, but returns `None` and adds nothing if a worker has no room for its share.
    pub(super) fn try_extend<R: Sync, S: Send>(
        &mut self,
        workers: &mut Workers,
        roots: &[R],
        scratches: &mut [S],
        find: impl Fn(&[R], &mut Room<'_, T>, &mut S) -> Search + Sync,
    ) -> Option<Search> {
        let part_length = roots.len().div_ceil(PARTS_PER_WORKER * workers.count()).max(ROOTS_MIN);
        let part_count = roots.len().div_ceil(part_length);
        let worker_count = self.shares.len().min(workers.count()).min(part_count);
        if worker_count <= 1 {
            return Some(find(roots, &mut self.room(), &mut scratches[0]));
        }
        let shares = &mut self.shares[..worker_count];
        workers.for_each(
            shares.iter_mut().zip(&mut *scratches).enumerate(),
            |(worker, (share, scratch)), _| {
                share.clear();
                // Neighbouring parts, which often take equally long, go to different workers.
                for part in roots.chunks(part_length).skip(*worker).step_by(worker_count) {
                    share.add(|room| find(part, room, scratch));
                }
            },
            |_| {},
        );
        let is_one_full = shares.iter().any(|share| share.is_full);
        (!is_one_full).then(|| self.join(part_count, worker_count))
    }

    /// Appends the items that `find` adds for each part of a list, each by one worker: at most one for each item of the
    /// list.
    ///
    /// # Panics
    /// If there are more parts than workers, or too many items.
    pub(super) fn filter<P: Send>(
        &mut self,
        workers: &mut Workers,
        mut parts: impl ExactSizeIterator<Item = P>,
        find: impl Fn(&mut P, &mut Room<'_, T>) -> Search + Sync,
    ) {
        let count = parts.len();
        let end = if count > 1 {
            assert!(count <= self.shares.len(), "more parts than workers");
            workers.for_each(
                self.shares.iter_mut().zip(parts),
                |(share, part), _| {
                    share.clear();
                    share.add(|room| find(part, room));
                    assert!(!share.is_full, "too many items in a part");
                },
                |_| {},
            );
            self.join(count, count)
        } else {
            parts.try_for_each(|mut part| find(&mut part, &mut self.room()))
        };
        assert!(end.is_continue(), "too many items");
    }

    fn room(&mut self) -> Room<'_, T> {
        Room { items: &mut self.items, count_max: self.count_max }
    }

    /// Appends what the workers have found, part by part.
    fn join(&mut self, part_count: usize, worker_count: usize) -> Search {
        let Self { items, count_max, shares } = self;
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

impl<T> Share<T> {
    fn clear(&mut self) {
        self.items.clear();
        self.ends.clear();
        self.is_full = false;
    }

    /// Adds what is found in a part.
    fn add(&mut self, find: impl FnOnce(&mut Room<'_, T>) -> Search) {
        let Self { items, count_max, .. } = self;
        let found = find(&mut Room { items, count_max: *count_max });
        self.is_full |= found.is_break();
        self.ends.push(self.items.len());
    }

    fn of_part(&self, part: usize) -> &[T] {
        let start = part.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.items[start..self.ends[part]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::Kernels;

    /// Adds the numbers below 10,000 that fulfil a condition, as long as there is room.
    fn gather(
        count_max: usize,
        worker_count: usize,
        condition: impl Fn(u32) -> bool + Sync,
    ) -> (Vec<u32>, bool) {
        let roots: Vec<u32> = (0..10_000).collect();
        let mut workers = Workers::new(Kernels::Reference, worker_count);
        let mut found = Gathered::new(count_max);
        found.set_worker_count(worker_count);
        found.items.push(7);
        let scratches = &mut NO_SCRATCHES.clone();
        let end = found.extend(&mut workers, &roots, scratches, |part, found, ()| {
            let mut wanted = part.iter().copied().filter(|one| condition(*one));
            wanted.try_for_each(|one| found.add(one))
        });
        (found.items, end.is_break())
    }

    #[test]
    fn workers_find_what_one_worker_finds_in_the_same_order() {
        // 3,334 of them.
        let thirds = |one: u32| one.is_multiple_of(3);
        for count_max in [1, 2, 1000, 3334, 3335, 3336, 10_000] {
            let expected = gather(count_max, 1, thirds);
            assert_eq!(expected.1, count_max < 3335, "{count_max}");
            for worker_count in [2, 3, 8] {
                let found = gather(count_max, worker_count, thirds);
                assert_eq!(found, expected, "{count_max}, {worker_count}");
            }
        }
    }

    #[test]
    fn one_worker_finds_all_if_another_has_no_room_for_its_share() {
        // The parts of one of eight workers, which has room for 1,000.
        let of_one_worker = |one: u32| (one / 313).is_multiple_of(8);
        let expected = gather(4000, 1, of_one_worker);
        assert_eq!(expected.0.len(), 1 + 4 * 313);
        assert_eq!(gather(4000, 8, of_one_worker), expected);
    }

    #[test]
    fn workers_change_their_parts_and_add_in_order() {
        for worker_count in [1, 2, 3, 8] {
            let mut all: Vec<u32> = (0..100).collect();
            let mut workers = Workers::new(Kernels::Reference, worker_count);
            let mut found = Gathered::new(50);
            found.set_worker_count(worker_count);
            let work = |one: &mut u32, found: &mut Room<'_, u32>| {
                *one += 1;
                if one.is_multiple_of(2) { found.add(*one) } else { Search::Continue(()) }
            };
            let parts = all.chunks_mut(100_usize.div_ceil(worker_count));
            found.filter(&mut workers, parts, |part, found| {
                part.iter_mut().try_for_each(|one| work(one, found))
            });
            assert!(all.iter().copied().eq(1..=100), "{worker_count}");
            let evens = (1..=50).map(|half| 2 * half);
            assert!(found.items.iter().copied().eq(evens), "{worker_count}");
        }
    }
}
