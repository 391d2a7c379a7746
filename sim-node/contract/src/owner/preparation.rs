//! Loads that another thread prepares, because taking their memory is too long for the loop of an owner.

use std::fs::File;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::owner::error::OwnerError;
use crate::owner::load::{Capacities, Load, LoadWriters, check_limits, check_memory};
use crate::ports::services::Services;

/// Prepares loads of an owner on any thread; see [`Owner::preparer`](crate::Owner::preparer).
#[derive(Debug, Clone)]
pub struct LoadPreparer(Arc<Mutex<Slot>>);

/// Place of a prepared load. The writers stay here until the owner takes them, because a thread that still
/// held them at the end of the process would leave their files behind.
#[derive(Debug)]
struct Slot {
    /// `None` once the owner is gone.
    services: Option<Arc<Services>>,
    prepared: Option<(Capacities, LoadWriters)>,
}

impl LoadPreparer {
    /// Takes the shared memory of a load: about 0.2 ms for each MiB. The next [`Owner::load`](crate::Owner::load)
    /// of the same sizes needs none of this time. One load is prepared at a time; another one replaces it.
    ///
    /// # Errors
    /// The load exceeds a limit of the contract or of shared memory, or a writer could not be created.
    pub fn prepare(&self, load: &Load<'_>) -> Result<(), OwnerError> {
        let mut slot = self.lock();
        // Its memory counts as free.
        slot.prepared = None;
        if let Some(services) = &slot.services {
            slot.prepared = Some((Capacities::of(load), create_writers(services, load)?));
        }
        Ok(())
    }

    fn lock(&self) -> MutexGuard<'_, Slot> {
        // A panic leaves a slot whose fields are whole.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The owner's side of its preparers. They prepare nothing more once it is dropped.
#[derive(Debug)]
pub(super) struct Preparation(LoadPreparer);

impl Preparation {
    pub(super) fn new(services: Arc<Services>) -> Self {
        let slot = Slot { services: Some(services), prepared: None };
        Self(LoadPreparer(Arc::new(Mutex::new(slot))))
    }

    pub(super) fn preparer(&self) -> LoadPreparer {
        self.0.clone()
    }

    /// Takes the prepared writers if they are of the load's sizes, or creates them.
    pub(super) fn take(
        &self,
        services: &Services,
        load: &Load<'_>,
    ) -> Result<LoadWriters, OwnerError> {
        let prepared = self.0.lock().prepared.take();
        match prepared.filter(|(capacities, _)| *capacities == Capacities::of(load)) {
            Some((_, writers)) => Ok(writers),
            None => create_writers(services, load),
        }
    }
}

impl Drop for Preparation {
    fn drop(&mut self) {
        let mut slot = self.0.lock();
        (slot.services, slot.prepared) = (None, None);
    }
}

fn create_writers(services: &Services, load: &Load<'_>) -> Result<LoadWriters, OwnerError> {
    check_limits(load)?;
    check_memory(load)?;
    Ok(LoadWriters::create(services, load)?)
}

/// The shared memory of a replaced load. Dropping it frees what no reader holds, which takes about 0.1 ms
/// for each MiB, on any thread.
#[derive(Debug)]
#[must_use = "dropping it takes time"]
pub struct ReplacedMemory {
    /// They keep the segments alive after the writers have removed them.
    _segments: Vec<File>,
}

impl ReplacedMemory {
    pub(super) fn of(writers: LoadWriters) -> Self {
        Self { _segments: writers.close() }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::PathBuf;
    use std::thread;

    use sim_messages::{LoadHeader, ParameterValues};

    use super::*;
    use crate::owner::Owner;
    use crate::ports::domain;
    use crate::ports::domain::files::segments;
    use crate::testing::TestDomain;

    fn load(particle_count: u32) -> Load<'static> {
        Load {
            header: LoadHeader { particle_count, ..LoadHeader::default() },
            scene: b"version = 1",
            constraints: &[],
            bends: &[],
            triangles: &[],
            collider_count: 0,
            keyframe_size_bytes_max: 8,
            parameters: ParameterValues::DEFAULT,
        }
    }

    fn files(domain: &TestDomain) -> BTreeSet<PathBuf> {
        let config = domain::configuration(Some(domain.name())).unwrap();
        segments(&config, &config.global.service.data_segment_suffix).collect()
    }

    fn prepare(owner: &Owner, particle_count: u32) {
        let preparer = owner.preparer();
        thread::spawn(move || preparer.prepare(&load(particle_count)).unwrap()).join().unwrap();
    }

    #[test]
    fn a_load_takes_over_what_another_thread_has_prepared() {
        let domain = TestDomain::new();
        let mut owner = Owner::create(&domain.endpoint(), &load(10)).unwrap();
        let old = files(&domain);
        prepare(&owner, 20);
        let both = files(&domain);
        let new: BTreeSet<_> = both.difference(&old).cloned().collect();
        owner.load(&load(20)).unwrap();
        let kept = files(&domain);
        assert_eq!(new.len(), 9);
        assert!(new.is_subset(&kept) && kept.is_subset(&both), "{new:?} {kept:?}");
        assert_eq!(kept.len(), old.len());
    }

    #[test]
    fn the_memory_of_a_prepared_load_that_does_not_come_is_freed() {
        let domain = TestDomain::new();
        let mut owner = Owner::create(&domain.endpoint(), &load(10)).unwrap();
        let count = files(&domain).len();
        prepare(&owner, 20);
        prepare(&owner, 30);
        assert_eq!(files(&domain).len(), count + 9);
        owner.load(&load(20)).unwrap();
        assert_eq!(files(&domain).len(), count);
        prepare(&owner, 40);
        let preparer = owner.preparer();
        drop(owner);
        assert_eq!(files(&domain), BTreeSet::new());
        preparer.prepare(&load(10)).unwrap();
        assert_eq!(files(&domain), BTreeSet::new());
        // Nothing holds the name.
        Owner::create(&domain.endpoint(), &load(10)).unwrap();
    }
}
