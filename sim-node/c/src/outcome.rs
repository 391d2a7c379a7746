//! Results of calls, and the text of the last failure.

use std::cell::RefCell;
use std::ffi::{CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

use sim_contract::{AttachError, LockstepError, OwnerState, ReadError, RequestError};

/// Result of a call. `catenary_last_error` describes every other result than `CATENARY_OK`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CatenaryResult {
    /// The call has done its work.
    Ok = 0,
    /// The node rejected the command. The outcome has the reason; no bit of the state changed.
    Rejected = 1,
    /// Nothing arrived within the timeout. The node may be paused.
    Timeout = 2,
    /// The node has ended. The client goes on with the next node of the same name.
    Gone = 3,
    /// No node runs under this name in this domain.
    NoNode = 4,
    /// The command was sent, but its outcome did not arrive in time, so its effect is unknown.
    Unanswered = 5,
    /// The command was not sent: no node receives commands, or too many of this client are waiting.
    NotSent = 6,
    /// A mistake of the program: a null or released handle, a wrong argument, or a call out of order.
    Misuse = 7,
    /// A service or its shared memory failed.
    Failed = 8,
    /// A fault of this library. Detach the client.
    Bug = 9,
}

/// Reason why a call did not do its work.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) result: CatenaryResult,
    pub(crate) text: String,
}

impl Failure {
    pub(crate) fn new(result: CatenaryResult, text: impl Into<String>) -> Self {
        Self { result, text: text.into() }
    }

    pub(crate) fn misuse(text: impl Into<String>) -> Self {
        Self::new(CatenaryResult::Misuse, text)
    }

    pub(crate) fn bug() -> Self {
        let text = "a fault of libcatenary stopped the call; its message is on stderr";
        Self::new(CatenaryResult::Bug, text)
    }
}

impl From<AttachError> for Failure {
    fn from(error: AttachError) -> Self {
        let result = match error {
            AttachError::NoNode { .. } | AttachError::NoServices { .. } => CatenaryResult::NoNode,
            AttachError::ClientId { .. } => CatenaryResult::Misuse,
            _ => CatenaryResult::Failed,
        };
        Self::new(result, error.to_string())
    }
}

impl From<ReadError> for Failure {
    fn from(error: ReadError) -> Self {
        let result = match error {
            ReadError::TooManyHeld { .. } => CatenaryResult::Misuse,
            _ => CatenaryResult::Failed,
        };
        Self::new(result, error.to_string())
    }
}

impl From<RequestError> for Failure {
    fn from(error: RequestError) -> Self {
        let result = match error {
            RequestError::Read(error) => return error.into(),
            RequestError::Timeout { .. } | RequestError::OutcomesMissed { .. } => {
                CatenaryResult::Unanswered
            }
            RequestError::InTurn => CatenaryResult::Misuse,
            RequestError::QueueFull { .. } | RequestError::NoReceiver { .. } => {
                CatenaryResult::NotSent
            }
            _ => CatenaryResult::Failed,
        };
        Self::new(result, error.to_string())
    }
}

impl From<LockstepError> for Failure {
    fn from(error: LockstepError) -> Self {
        let result = match error {
            LockstepError::Attach(error) => return error.into(),
            LockstepError::Read(error) => return error.into(),
            LockstepError::NotJoined => CatenaryResult::Misuse,
            LockstepError::NotAdmitted { owner: OwnerState::Gone { .. }, .. } => {
                CatenaryResult::Gone
            }
            LockstepError::NotAdmitted { .. } => CatenaryResult::Timeout,
            _ => CatenaryResult::Failed,
        };
        Self::new(result, error.to_string())
    }
}

thread_local! {
    static LAST_ERROR: RefCell<CString> = RefCell::default();
}

/// Runs a call. A failure becomes the last error of this thread, and so does a panic.
pub(crate) fn guard(call: impl FnOnce() -> Result<(), Failure>) -> CatenaryResult {
    let done = catch_unwind(AssertUnwindSafe(call)).unwrap_or_else(|_| Err(Failure::bug()));
    let Err(Failure { result, text }) = done else { return CatenaryResult::Ok };
    let text = CString::new(text.replace('\0', "\u{fffd}")).unwrap_or_default();
    // A thread that is ending has no text any longer.
    let _ended = LAST_ERROR.try_with(|last| last.replace(text));
    result
}

/// Returns the text of the last failed call of this thread, in UTF-8 and never null: the cause, and the
/// cure where one is known, such as the allowed values of a rejected command. Empty if no call has failed.
///
/// The text is valid until the next failed call of this thread.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_last_error() -> *const c_char {
    LAST_ERROR.try_with(|last| last.borrow().as_ptr()).unwrap_or(c"".as_ptr())
}

#[cfg(test)]
mod tests {
    use std::ffi::CStr;

    use super::*;

    fn last_error() -> String {
        // SAFETY: the text is never null, and no other call of this thread has failed since.
        unsafe { CStr::from_ptr(catenary_last_error()) }.to_str().unwrap().to_owned()
    }

    #[test]
    fn a_panic_becomes_a_result_and_a_success_keeps_the_last_error() {
        assert_eq!(last_error(), "");
        assert_eq!(guard(|| panic!("a fault")), CatenaryResult::Bug);
        assert!(last_error().starts_with("a fault of libcatenary stopped the call"));
        assert_eq!(guard(|| Err(Failure::misuse("a\0b"))), CatenaryResult::Misuse);
        assert_eq!(guard(|| Ok(())), CatenaryResult::Ok);
        assert_eq!(last_error(), "a\u{fffd}b");
    }
}
