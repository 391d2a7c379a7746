//! The stages that a sheet, a crowd or the graph runs in a pass.

use super::stage::Stage;
use crate::constraints::fields::Pass;

/// A stage, and the constraint group on which it runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ScheduledStage {
    pub(crate) stage: Stage,
    /// Group of a grouped stage, 0 for others: half of a family in a sheet, a group of the graph.
    pub(crate) group: usize,
    /// In a sheet, the number of rows from the first particle of a constraint to the last.
    pub(crate) reach: usize,
    /// In a sheet, the number of rows by which the stage follows the first stage.
    pub(crate) lag: usize,
}

/// Stages that run only in scenes that need them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[allow(clippy::struct_excessive_bools, reason = "each tells if one stage runs")]
pub(crate) struct OptionalStages {
    pub(crate) limit_stretch: bool,
    pub(crate) tether: bool,
    /// Contacts of particles with each other or with bodies need all particles at once, so they divide the
    /// sweep.
    pub(crate) divides_sweep: bool,
    pub(crate) contact: bool,
}

impl OptionalStages {
    fn includes(self, stage: Stage, pass: Pass) -> bool {
        match stage {
            Stage::Predict => pass.is_first(),
            Stage::Project | Stage::Bend => true,
            Stage::LimitStretch => pass.is_last() && self.limit_stretch,
            Stage::Tether => pass.is_last() && self.tether,
            Stage::Contact | Stage::Advance => {
                pass.is_last() && !self.divides_sweep && self.ends_with(stage)
            }
            Stage::Drive
            | Stage::Wind
            | Stage::ParticleContact
            | Stage::Tear
            | Stage::Freeze
            | Stage::Hash => false,
        }
    }

    /// True for the stages behind the division of the sweep.
    fn ends_with(self, stage: Stage) -> bool {
        stage == Stage::Advance || (stage == Stage::Contact && self.contact)
    }
}

/// The stages of each pass of a substep, in order.
#[derive(Debug, Clone, Default)]
pub(crate) struct Schedule {
    /// Passes differ only in being the first, the last, both, or neither.
    passes: [Vec<ScheduledStage>; 4],
    /// The stages behind the division; empty without it.
    ending: Vec<ScheduledStage>,
}

impl Schedule {
    /// Replaces the schedule. `constraints` and `bends` have the reach of each of their groups.
    pub(crate) fn rebuild(
        &mut self,
        optional: OptionalStages,
        constraints: &(impl Iterator<Item = usize> + Clone),
        bends: &(impl Iterator<Item = usize> + Clone),
    ) {
        for pass in Pass::all(3).chain(Pass::all(1)) {
            let mut lag = 0;
            let stages = &mut self.passes[place(pass)];
            stages.clear();
            for stage in
                Stage::OF_SUBSTEP.into_iter().filter(|stage| optional.includes(*stage, pass))
            {
                let mut push = |group, reach| {
                    lag += reach;
                    stages.push(ScheduledStage { stage, group, reach, lag });
                };
                match stage {
                    Stage::Project | Stage::LimitStretch => {
                        constraints.clone().enumerate().for_each(|(group, one)| push(group, one));
                    }
                    Stage::Bend => {
                        bends.clone().enumerate().for_each(|(group, one)| push(group, one));
                    }
                    _ => push(0, 0),
                }
            }
        }
        self.ending.clear();
        if optional.divides_sweep {
            let stages = Stage::OF_SUBSTEP.into_iter().filter(|stage| optional.ends_with(*stage));
            let scheduled = |stage| ScheduledStage { stage, group: 0, reach: 0, lag: 0 };
            self.ending.extend(stages.map(scheduled));
        }
    }

    /// The stages behind the division of the sweep; none without it.
    pub(crate) fn ending(&self) -> &[ScheduledStage] {
        &self.ending
    }

    /// The stages of a pass.
    pub(crate) fn of_pass(&self, pass: Pass) -> &[ScheduledStage] {
        &self.passes[place(pass)]
    }
}

fn place(pass: Pass) -> usize {
    usize::from(pass.is_first()) + 2 * usize::from(pass.is_last())
}

#[cfg(test)]
mod tests {
    //! A schedule against the list of stages.
    use super::*;

    fn stages(schedule: &Schedule, pass: Pass) -> Vec<(Stage, usize, usize)> {
        let of_pass = schedule.of_pass(pass).iter();
        of_pass.map(|one| (one.stage, one.group, one.lag)).collect()
    }

    #[test]
    fn passes_run_the_stages_in_order_once_in_a_substep() {
        let mut schedule = Schedule::default();
        let optional = OptionalStages {
            limit_stretch: true,
            tether: true,
            divides_sweep: false,
            contact: true,
        };
        schedule.rebuild(optional, &[1, 0].into_iter(), &[2].into_iter());
        let project = |lag: usize| {
            let constraints = [0, 1].map(|group| (Stage::Project, group, lag + 1));
            [&constraints[..], &[(Stage::Bend, 0, lag + 3)]].concat()
        };
        let end = |lag: usize| {
            let limit = |group| (Stage::LimitStretch, group, lag + 1);
            let particle = |stage| (stage, 0, lag + 1);
            let [tether, contact, advance] =
                [Stage::Tether, Stage::Contact, Stage::Advance].map(particle);
            vec![limit(0), limit(1), tether, contact, advance]
        };
        let begin = vec![(Stage::Predict, 0, 0)];
        let expected = |parts: &[&[(Stage, usize, usize)]]| parts.concat();
        let [first, middle, last] = [0, 1, 2].map(|index| Pass { index, count: 3 });
        assert_eq!(stages(&schedule, first), expected(&[&begin, &project(0)]));
        assert_eq!(stages(&schedule, middle), expected(&[&project(0)]));
        assert_eq!(stages(&schedule, last), expected(&[&project(0), &end(3)]));
        let only = Pass { index: 0, count: 1 };
        assert_eq!(stages(&schedule, only), expected(&[&begin, &project(0), &end(3)]));
    }

    #[test]
    fn a_scene_without_bends_limits_tethers_and_colliders_skips_their_stages() {
        let mut schedule = Schedule::default();
        schedule.rebuild(OptionalStages::default(), &std::iter::once(0), &std::iter::empty());
        let only = Pass { index: 0, count: 1 };
        let expected = [Stage::Predict, Stage::Project, Stage::Advance].map(|stage| (stage, 0, 0));
        assert_eq!(stages(&schedule, only), expected);
    }
}
