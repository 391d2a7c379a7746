//! The two methods of solving constraints.

use serde::{Deserialize, Serialize};

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

impl Method {
    /// Both methods, by number.
    pub const ALL: [Self; 2] = [Self::Xpbd, Self::Pbd];

    /// Returns the method with this number.
    pub fn from_number(number: u32) -> Option<Self> {
        Self::ALL.get(number as usize).copied()
    }

    /// Returns the method with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|method| method.name() == name)
    }

    /// Name in scenes and logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Xpbd => "xpbd",
            Self::Pbd => "pbd",
        }
    }
}
