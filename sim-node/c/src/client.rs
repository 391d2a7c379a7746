//! Attaching and detaching.

use std::ffi::c_char;
use std::mem::MaybeUninit;

use sim_contract::{CONTRACT_VERSION, Client, Endpoint};

use crate::attached::{ClientHandle, keep, remove, with_client};
use crate::outcome::{CatenaryResult, Failure, guard};
use crate::pointers::{check_place, text, write};

/// Attaches to a running node with a random client id.
///
/// `name` is the name of the node; null for "sim". `domain` is its domain; null for the environment
/// variable CATENARY_DOMAIN, and without it for iceoryx2's own domain.
///
/// On success, `*client` is the client. Pass it to `catenary_detach` at the end.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_attach(
    name: *const c_char,
    domain: *const c_char,
    client: Option<&mut MaybeUninit<*mut ClientHandle>>,
) -> CatenaryResult {
    guard(|| {
        check_place(client.as_deref(), "client")?;
        let attached = Client::attach(&endpoint(name, domain)?)?;
        write(client, keep(attached), "client")
    })
}

/// Attaches like `catenary_attach`, as the client `client_id`, below 2^53. Only clients with this id can
/// move the particles that it grabs. Members of a lockstep with fixed ids produce the same states in
/// every run. Several processes may use 0; any other id belongs to one process at a time.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_attach_as(
    name: *const c_char,
    domain: *const c_char,
    client_id: u64,
    client: Option<&mut MaybeUninit<*mut ClientHandle>>,
) -> CatenaryResult {
    guard(|| {
        check_place(client.as_deref(), "client")?;
        let attached = Client::attach_as(&endpoint(name, domain)?, client_id)?;
        write(client, keep(attached), "client")
    })
}

fn endpoint(name: *const c_char, domain: *const c_char) -> Result<Endpoint, Failure> {
    let (name, domain) = (text(name, "name")?, text(domain, "domain")?);
    Endpoint::from_options(domain.as_deref(), name.as_deref())
        .map_err(|error| Failure::misuse(error.to_string()))
}

/// Detaches a client: leaves the lockstep, and waits at most 0.2 s for the outcomes of sent commands. The
/// node releases the particles that the client has grabbed.
///
/// Snapshots that the program holds stay valid until they are released; all other data of the client
/// ends here. If another thread is in a call of the client, it is detached at the end of that call.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_detach(client: *mut ClientHandle) -> CatenaryResult {
    guard(|| remove(client))
}

/// Writes the id in this client's commands and in their outcomes.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_client_id(
    client: *const ClientHandle,
    client_id: Option<&mut MaybeUninit<u64>>,
) -> CatenaryResult {
    with_client(client, |attached| write(client_id, attached.client.client_id(), "client_id"))
}

/// Returns `CATENARY_OK` if the node lives, and `CATENARY_GONE` if it has ended. Reads the file system:
/// call it a few times per second at most.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_check_node(client: *const ClientHandle) -> CatenaryResult {
    with_client(client, |attached| attached.check_node())
}

/// Returns the contract version of this library. A program compares it with `CATENARY_CONTRACT_VERSION`
/// of the header that it was compiled with: layouts are equal if they are. Nodes of another version are
/// refused by `catenary_attach`.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_contract_version() -> u32 {
    CONTRACT_VERSION
}
