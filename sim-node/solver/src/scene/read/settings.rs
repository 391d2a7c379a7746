//! The table `[solver]`.

use std::ops::Range;

use serde::Deserialize;
use sim_types::{Method, Parameter};

use super::limits::FileLimits;
use super::reader::Reader;
use super::value::{Number, Spanned, TableKeys, Whole, Word};
use crate::scene::definition::settings::{
    ConstraintOrder, PASSES_MAX, RATE_HZ_MAX, SolverSettings, TETHERS_MAX,
};
use crate::scene::error::SceneError;

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FileSolver {
    rate_hz: Option<Whole>,
    substeps: Option<Whole>,
    iterations: Option<Whole>,
    pub(super) method: Option<Word>,
    order: Option<Word>,
    damping: Option<Number>,
    relaxation: Option<Number>,
    tethers: Option<Spanned<FileTethers>>,
    max_speed: Option<Number>,
    max_stretch: Option<Number>,
    tear_stretch: Option<Number>,
    tear_distance: Option<Number>,
    tear_force: Option<Number>,
}

impl TableKeys for FileSolver {}

/// The tethers of each particle: whether it has one, or their number.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(
    untagged,
    expecting = "is neither true, false nor a whole number (allowed: true, false, 0 to 4)"
)]
enum FileTethers {
    Word(bool),
    Count(i64),
}

impl FileSolver {
    /// Place of the counts of passes, for an error about the work of a step; the start of the text if
    /// both are the defaults.
    pub(super) fn place_of_passes(&self) -> Range<usize> {
        let passes = self.iterations.as_ref().or(self.substeps.as_ref());
        passes.map_or(0..0, Whole::span)
    }
}

impl Reader<'_> {
    /// Returns the method, which decides the meaning of other keys.
    pub(super) fn method(&self, file: &FileSolver) -> Result<Method, SceneError> {
        let names = Method::ALL.map(|method| (method.name(), method));
        let method = file.method.as_ref().map(|word| self.word("solver.method", word, &names));
        Ok(method.transpose()?.unwrap_or_default())
    }

    fn tethers(&self, file: Option<&Spanned<FileTethers>>) -> Result<u32, SceneError> {
        let Some(tethers) = file else { return Ok(0) };
        match tethers.get_ref() {
            FileTethers::Word(has_tethers) => Ok(if *has_tethers { TETHERS_MAX } else { 0 }),
            FileTethers::Count(count) => {
                self.whole("solver.tethers", &tethers.with(*count), 0..=TETHERS_MAX)
            }
        }
    }

    /// Checks the table `[solver]`.
    pub(super) fn solver(&self, file: &FileSolver) -> Result<SolverSettings, SceneError> {
        let default = SolverSettings::default();
        let whole = |key: &str, value: Option<&Whole>, default, max| {
            let value = value.map(|value| self.whole(&format!("solver.{key}"), value, 1..=max));
            Ok(value.transpose()?.unwrap_or(default))
        };
        let number = |value: Option<&Number>, parameter: Parameter, default| {
            let field = format!("solver.{}", parameter.name());
            let value = value.map(|value| self.ranged(&field, value, parameter.info().range));
            Ok(value.transpose()?.unwrap_or(default))
        };
        let order = file.order.as_ref();
        let order = order.map(|word| self.word("solver.order", word, &ConstraintOrder::NAMES));
        let limits = FileLimits {
            max_stretch: file.max_stretch.as_ref(),
            tear_stretch: file.tear_stretch.as_ref(),
            tear_distance: file.tear_distance.as_ref(),
            tear_force: file.tear_force.as_ref(),
        };
        Ok(SolverSettings {
            rate_hz: whole("rate_hz", file.rate_hz.as_ref(), default.rate_hz, RATE_HZ_MAX)?,
            substeps: whole("substeps", file.substeps.as_ref(), default.substeps, PASSES_MAX)?,
            iterations: whole(
                "iterations",
                file.iterations.as_ref(),
                default.iterations,
                PASSES_MAX,
            )?,
            method: self.method,
            order: order.transpose()?.unwrap_or_default(),
            damping: number(file.damping.as_ref(), Parameter::Damping, default.damping)?,
            relaxation: number(
                file.relaxation.as_ref(),
                Parameter::Relaxation,
                default.relaxation,
            )?,
            tethers: self.tethers(file.tethers.as_ref())?,
            max_speed: number(file.max_speed.as_ref(), Parameter::MaxSpeed, default.max_speed)?,
            limits: self.limits(|key| format!("solver.{key}"), &limits)?,
        })
    }
}
