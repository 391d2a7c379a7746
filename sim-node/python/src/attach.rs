//! The attachment to a node, with a wait for one that is not there yet.

use std::time::Duration;

use pyo3::prelude::*;
use sim_contract::{AttachError, Client, Endpoint};
use sim_host::clock::monotonic_ns;

use crate::error::attach_error;
use crate::patience::Patience;

/// Attaches to a node, or waits for it.
pub(crate) fn attach(
    py: Python<'_>,
    endpoint: &Endpoint,
    client_id: Option<u64>,
    timeout_s: f64,
) -> PyResult<Client> {
    let patience = Patience::new(Some(timeout_s))?;
    loop {
        let attached = py.detach(|| match client_id {
            Some(client_id) => Client::attach_as(endpoint, client_id),
            None => Client::attach(endpoint),
        });
        let is_absent =
            matches!(attached, Err(AttachError::NoNode { .. } | AttachError::NoServices { .. }));
        match attached {
            Ok(client) => return Ok(client),
            Err(_) if is_absent && !patience.is_over() => py.detach(|| pause(patience.part())),
            Err(error) => return Err(attach_error(&error)),
        }
        py.check_signals()?;
    }
}

fn pause(time: Duration) {
    let time_ns = u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
    sim_host::clock::sleep_until(monotonic_ns().saturating_add(time_ns));
}
