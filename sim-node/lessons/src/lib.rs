//! Lessons for teachers and students of physics: tables that are computed when you ask for them.
//!
//! A column holds given values, a closed form, a few lines of plain arithmetic, a measurement in
//! the solver, or the numbers that a tutorial prints. Each lesson puts them side by side.
//!
//! ```
//! use sim_lessons::Lesson;
//!
//! let lesson: Lesson = "dissipation".parse()?;
//! for table in lesson.tables() {
//!     println!("{table}");
//! }
//! # Ok::<(), sim_lessons::UnknownLesson>(())
//! ```
#![forbid(unsafe_code)]

mod dissipation;
mod euler;
mod experiment;
mod f32;
mod iterations;
mod stiffness;
mod table;

use std::str::FromStr;

use thiserror::Error;

pub use table::Table;

/// Subject of a lesson.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lesson {
    /// Explicit Euler, semi-implicit Euler, Verlet and the solver.
    Euler,
    /// Passes over one stick, and passes against substeps.
    Iterations,
    /// Raw k, k' and compliance.
    Stiffness,
    /// Rounding to 32 bits.
    F32,
    /// Energy that the time discretisation removes.
    Dissipation,
}

/// A name that no lesson has.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("there is no lesson '{0}'")]
pub struct UnknownLesson(pub String);

impl Lesson {
    /// All lessons, in the order of the list.
    pub const ALL: [Self; 5] =
        [Self::Euler, Self::Iterations, Self::Stiffness, Self::F32, Self::Dissipation];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Euler => "euler",
            Self::Iterations => "iterations",
            Self::Stiffness => "stiffness",
            Self::F32 => "f32",
            Self::Dissipation => "dissipation",
        }
    }

    /// The lesson in one line, for lists and help texts.
    pub fn summary(self) -> &'static str {
        match self {
            Self::Euler => {
                "The errors of explicit Euler, semi-implicit Euler, Verlet and the solver in one fall"
            }
            Self::Iterations => {
                "What a pass does to one stick, and passes against substeps in a hanging rope"
            }
            Self::Stiffness => {
                "What k, k' and compliance mean, and which of them depend on the passes or the rate"
            }
            Self::F32 => "What rounding to 32 bits does to a long sum, a clock and a velocity",
            Self::Dissipation => {
                "Why a pendulum without damping loses swing, and what substeps do about it"
            }
        }
    }

    /// The tutorials that the lesson speaks of, with their sites where they have one.
    pub fn tutorials(self) -> &'static [&'static str] {
        match self {
            Self::Euler | Self::F32 => {
                &["\"Verlet Integration and Cloth Physics Simulation\", pikuma.com"]
            }
            Self::Iterations => &["\"A verlet integrator under 100 lines\", Motecraft"],
            Self::Stiffness => {
                &["\"Particle Simulator with Springs - Position Based Dynamics (PBD)\", 2026"]
            }
            Self::Dissipation => &[],
        }
    }

    /// Computes the tables of the lesson. This takes up to a few seconds in a debug build.
    pub fn tables(self) -> Vec<Table> {
        match self {
            Self::Euler => euler::tables(),
            Self::Iterations => iterations::tables(),
            Self::Stiffness => stiffness::tables(),
            Self::F32 => f32::tables(),
            Self::Dissipation => dissipation::tables(),
        }
    }
}

impl FromStr for Lesson {
    type Err = UnknownLesson;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let lesson = Self::ALL.into_iter().find(|lesson| lesson.name() == name);
        lesson.ok_or_else(|| UnknownLesson(name.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    //! The texts as a whole. Each lesson checks its numbers against closed forms.

    use super::*;

    #[test]
    fn each_lesson_prints_its_tables() {
        for lesson in Lesson::ALL {
            let tables = lesson.tables();
            let text = tables.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n\n");
            insta::assert_snapshot!(lesson.name(), text);
        }
    }

    #[test]
    fn each_name_parses_to_its_lesson() {
        for lesson in Lesson::ALL {
            assert_eq!(lesson.name().parse(), Ok(lesson));
        }
        assert_eq!("nix".parse::<Lesson>(), Err(UnknownLesson("nix".to_owned())));
    }

    #[test]
    fn every_row_in_csv_has_every_column() {
        for table in Lesson::ALL.into_iter().flat_map(Lesson::tables) {
            let csv = table.to_csv();
            let mut lines = csv.lines().skip(1).map(|line| line.split(',').count());
            let columns = lines.next().unwrap();
            assert!(lines.all(|cells| cells == columns), "{csv}");
        }
    }

    #[test]
    fn every_row_in_json_has_every_column() {
        for table in Lesson::ALL.into_iter().flat_map(Lesson::tables) {
            let json = serde_json::to_value(&table).unwrap();
            let columns = json["columns"].as_array().unwrap();
            for row in json["rows"].as_array().unwrap() {
                assert_eq!(row.as_object().unwrap().len(), columns.len(), "{}", json["name"]);
            }
        }
    }
}
