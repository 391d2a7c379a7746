//! The end of the program, shared by the source and the servers.

use std::sync::Arc;

use tokio::sync::watch;

/// A flag that is set once, when everything has to end. Clones share the flag.
#[derive(Debug, Clone)]
pub struct Shutdown(Arc<watch::Sender<bool>>);

impl Default for Shutdown {
    fn default() -> Self {
        Self(Arc::new(watch::Sender::new(false)))
    }
}

impl Shutdown {
    /// Sets the flag.
    pub fn begin(&self) {
        self.0.send_replace(true);
    }

    /// Returns whether the flag is set.
    pub fn has_begun(&self) -> bool {
        *self.0.borrow()
    }

    /// Waits until the flag is set.
    pub async fn begun(&self) {
        let mut flag = self.0.subscribe();
        // `self` keeps the sender, so waiting cannot fail.
        let _flag = flag.wait_for(|has_begun| *has_begun).await;
    }
}
