//! The two methods of solving constraints.

use serde::{Deserialize, Serialize};

use crate::names::names;

/// Method of solving constraints. It determines the meaning of a constraint's softness.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[repr(u32)]
pub enum Method {
    /// XPBD, with compliance in m/N: the stretch is the same at every rate (Macklin, Mueller, Chentanez
    /// 2016).
    #[default]
    Xpbd = 0,
    /// PBD, with stiffness 0..=1: the share of the error that the iterations of a substep remove
    /// (Mueller et al. 2007).
    Pbd = 1,
}

names!(Method: Xpbd = "xpbd", Pbd = "pbd");
