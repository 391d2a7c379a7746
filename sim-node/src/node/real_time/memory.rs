//! Memory that is never paged out.

use rustix::mm::{MlockAllFlags, mlockall};
use rustix::process::{Resource, getrlimit};
use rustix::thread::{CapabilitySet, capabilities};

use super::refused::Refused;

/// Locks the memory of the process, and all that it will touch.
///
/// Without `ONFAULT`, the system would fill every page of the shared memory, which is sized for sixteen
/// slow readers.
pub(super) fn lock() -> Result<(), Refused> {
    let refused = |reason| Refused { property: "locked memory", reason, cure: cure() };
    // Under a limit, later allocations would fail, such as that of a load.
    if let Some(limit_bytes) = limit_bytes() {
        let text = format!("this process may lock {} KiB only", limit_bytes >> 10);
        return Err(refused(text));
    }
    mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE | MlockAllFlags::ONFAULT)
        .map_err(|error| refused(error.to_string()))
}

/// Returns the limit on locked memory, which does not concern a privileged process.
fn limit_bytes() -> Option<u64> {
    let is_privileged = capabilities(None)
        .is_ok_and(|capabilities| capabilities.effective.contains(CapabilitySet::IPC_LOCK));
    if is_privileged { None } else { getrlimit(Resource::Memlock).current }
}

fn cure() -> String {
    "allow it with `ulimit -l unlimited` (/etc/security/limits.d: `memlock`), with `setcap \
     cap_sys_nice,cap_ipc_lock+ep` on this program, or in Docker with `--ulimit memlock=-1`"
        .to_owned()
}
