//! The rules that every connection keeps, whichever protocol it speaks.

pub(crate) mod guard;
pub(crate) mod rate_limit;
