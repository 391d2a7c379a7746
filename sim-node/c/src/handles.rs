//! Values that a C program knows by a handle.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The values of one type that C programs hold. A handle is a number that this process never uses again,
/// so a handle that was released, or that never existed, is found out.
#[derive(Debug)]
pub(crate) struct Handles<T> {
    values: Mutex<BTreeMap<usize, T>>,
}

/// The next handle of any type. No handle is 0, the null pointer of C.
static NEXT: AtomicUsize = AtomicUsize::new(1);

impl<T> Handles<T> {
    pub(crate) const fn new() -> Self {
        Self { values: Mutex::new(BTreeMap::new()) }
    }

    /// Keeps a value, and returns its handle.
    pub(crate) fn insert(&self, value: T) -> usize {
        let handle = NEXT.fetch_add(1, Ordering::Relaxed);
        self.values().insert(handle, value);
        handle
    }

    /// Removes a value; `None` if there is none.
    pub(crate) fn remove(&self, handle: usize) -> Option<T> {
        self.values().remove(&handle)
    }

    fn values(&self) -> MutexGuard<'_, BTreeMap<usize, T>> {
        // A map is whole after any panic.
        self.values.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T: Clone> Handles<T> {
    /// Returns a copy of a value; `None` if there is none.
    pub(crate) fn get(&self, handle: usize) -> Option<T> {
        self.values().get(&handle).cloned()
    }
}
