//! Pending connections: those that are not clients yet.
//!
//! Every connection begins here. It leaves when it becomes a client: a page with a valid `hello`, a
//! Foxglove client with a valid message. A full list still admits a newcomer, because the connection
//! that has been inactive for the longest time makes room. Connections that only wait therefore keep
//! nobody out, however many there are, and clients are never in danger.

use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv6Addr};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tokio::time::sleep;

use crate::limits::EVICTION_PERIOD;

/// The connections of one server that are not clients yet.
#[derive(Debug)]
pub(crate) struct PendingConnections {
    places: Arc<Semaphore>,
    visitors: Mutex<Visitors>,
}

#[derive(Debug, Default)]
struct Visitors {
    by_number: BTreeMap<u64, Visitor>,
    last_number: u64,
    last_activity: u64,
}

#[derive(Debug)]
struct Visitor {
    network: IpAddr,
    /// Rank of its last activity: a larger number is more recent.
    activity: u64,
    /// Dropping it evicts the visitor.
    _eviction: watch::Sender<()>,
}

/// A place among the pending connections. Dropping it makes room for another connection.
#[derive(Debug)]
pub(crate) struct PendingConnection {
    pending: Arc<PendingConnections>,
    number: u64,
    /// Closed when the connection must make room.
    eviction: watch::Receiver<()>,
    _permit: Option<OwnedSemaphorePermit>,
}

impl Visitors {
    fn next_activity(&mut self) -> u64 {
        self.last_activity += 1;
        self.last_activity
    }

    /// Removes the visitor that has been inactive for the longest time, among those of the networks
    /// with the most visitors: one machine cannot evict the connections of all others.
    fn evict(&mut self) -> Option<Visitor> {
        let mut counts = BTreeMap::<IpAddr, usize>::new();
        for visitor in self.by_number.values() {
            *counts.entry(visitor.network).or_default() += 1;
        }
        let count_max = counts.values().max().copied()?;
        let crowded = self.by_number.iter().filter(|(_, one)| counts[&one.network] == count_max);
        let number = *crowded.min_by_key(|(_, visitor)| visitor.activity)?.0;
        self.by_number.remove(&number)
    }
}

impl PendingConnections {
    /// Creates an empty list.
    pub(super) fn new(place_count: usize) -> Arc<Self> {
        let places = Arc::new(Semaphore::new(place_count));
        Arc::new(Self { places, visitors: Mutex::default() })
    }

    fn visitors(&self) -> MutexGuard<'_, Visitors> {
        // Every change under this lock is complete wherever a panic could occur.
        self.visitors.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Evicts one connection. Its task drops it as soon as it runs.
    pub(super) fn make_room(&self) {
        let evicted = self.visitors().evict();
        // Its task wakes after the lock is free.
        drop(evicted);
    }

    /// Returns a place for a connection from this address. Another connection makes room if necessary.
    pub(super) async fn admit(self: &Arc<Self>, address: IpAddr) -> PendingConnection {
        if self.places.available_permits() == 0 {
            self.make_room();
            sleep(EVICTION_PERIOD).await;
        }
        // The semaphore is never closed.
        let permit = Arc::clone(&self.places).acquire_owned().await.ok();
        let (sender, eviction) = watch::channel(());
        let mut visitors = self.visitors();
        visitors.last_number += 1;
        let number = visitors.last_number;
        let activity = visitors.next_activity();
        let visitor = Visitor { network: network(address), activity, _eviction: sender };
        visitors.by_number.insert(number, visitor);
        PendingConnection { pending: Arc::clone(self), number, eviction, _permit: permit }
    }
}

impl PendingConnection {
    /// Notes that the connection does something.
    pub(super) fn note_activity(&self) {
        let mut visitors = self.pending.visitors();
        let activity = visitors.next_activity();
        if let Some(visitor) = visitors.by_number.get_mut(&self.number) {
            visitor.activity = activity;
        }
    }

    /// Waits until the connection must make room.
    pub(crate) async fn evicted(&self) {
        // Nothing is ever sent, so this is the end of the channel.
        let _closed = self.eviction.clone().changed().await;
    }

    /// Works until the connection must make room. Returns `None` in that case.
    pub(crate) async fn while_held<T>(&self, work: impl Future<Output = T>) -> Option<T> {
        tokio::select! {
            biased;
            result = work => Some(result),
            () = self.evicted() => None,
        }
    }
}

impl Drop for PendingConnection {
    fn drop(&mut self) {
        self.pending.visitors().by_number.remove(&self.number);
    }
}

/// Returns the network that one machine is assumed to own: an IPv4 address, or the /64 of an IPv6
/// address.
fn network(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(address) => Ipv6Addr::from_bits(address.to_bits() >> 64 << 64).into(),
        address @ IpAddr::V4(_) => address,
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use futures_util::FutureExt;
    use sim_host::clock::monotonic_ns;

    use super::*;

    /// Admits a connection that needs no other to end first.
    fn admit(pending: &Arc<PendingConnections>, address: &str) -> PendingConnection {
        pending.admit(address.parse().unwrap()).now_or_never().unwrap()
    }

    fn is_evicted(place: &PendingConnection) -> bool {
        place.evicted().now_or_never().is_some()
    }

    #[tokio::test]
    async fn the_longest_inactive_connection_makes_room_for_a_newcomer() {
        let pending = PendingConnections::new(3);
        let places = [(); 3].map(|()| admit(&pending, "127.0.0.1"));
        places[0].note_activity();
        let newcomer = pending.admit("127.0.0.1".parse().unwrap());
        tokio::pin!(newcomer);
        assert!((&mut newcomer).now_or_never().is_none());
        assert_eq!(places.each_ref().map(is_evicted), [false, true, false]);
        // The newcomer enters once the evicted connection is gone.
        let [first, second, third] = places;
        drop(second);
        let newcomer = newcomer.await;
        assert!(![&first, &third, &newcomer].into_iter().any(is_evicted));
        assert!(pending.admit("127.0.0.1".parse().unwrap()).now_or_never().is_none());
        assert!(is_evicted(&third) && !is_evicted(&first));
    }

    #[tokio::test]
    async fn the_network_with_the_most_connections_makes_room() {
        let pending = PendingConnections::new(4);
        let lone = admit(&pending, "10.0.0.1");
        // One machine has a whole /64 of addresses.
        let crowd = ["2001:db8::1", "2001:db8::2", "2001:db8::3"].map(|one| admit(&pending, one));
        assert!(pending.admit("10.0.0.2".parse().unwrap()).now_or_never().is_none());
        assert!(!is_evicted(&lone));
        assert_eq!(crowd.each_ref().map(is_evicted), [true, false, false]);
        assert_eq!(
            network("::ffff:10.0.0.1".parse().unwrap()),
            "10.0.0.1".parse::<IpAddr>().unwrap()
        );
    }

    #[tokio::test]
    async fn evictions_leave_every_connection_time_to_become_a_client() {
        const COUNT: u32 = 10;
        let pending = PendingConnections::new(1);
        let mut place = admit(&pending, "127.0.0.1");
        let start_ns = monotonic_ns();
        for _ in 0..COUNT {
            // The evicted connection ends at once.
            tokio::spawn(async move { place.evicted().await });
            place = pending.admit("127.0.0.1".parse().unwrap()).await;
        }
        let elapsed = Duration::from_nanos(monotonic_ns() - start_ns);
        assert!(elapsed >= COUNT * EVICTION_PERIOD, "{elapsed:?}");
    }

    #[tokio::test]
    async fn a_connection_that_leaves_makes_room_without_an_eviction() {
        let pending = PendingConnections::new(1);
        drop(admit(&pending, "127.0.0.1"));
        let place = admit(&pending, "127.0.0.1");
        assert!(!is_evicted(&place));
        assert_eq!(place.while_held(async { 7 }).now_or_never(), Some(Some(7)));
        pending.make_room();
        assert_eq!(place.while_held(std::future::pending::<()>()).now_or_never(), Some(None));
    }
}
