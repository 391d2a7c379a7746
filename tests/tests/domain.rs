//! A domain as its user sees it: the list of its nodes, the state of one over time, and the checks of
//! `doctor`.

mod doctor;
mod ps;
mod watch;
