//! A structured patch: a cloth or a rope, row by row, without indices between its numbers.

mod band;
mod band_forces;
mod bands;
mod bend_layout;
mod bends;
mod measure;
mod shared_sweep;
mod sheet_layout;
pub(crate) mod sheets;
mod span;
mod wind;

use std::ops::Range;

use sim_scene::constraints::bends::families::BendFamily;
use sim_scene::constraints::families::{Family, Sheet};
use sim_scene::constraints::sides::TornSides;

use band::LentRows;
use band_forces::LentForces;
use bands::Bands;
use bend_layout::BendLayout;
use shared_sweep::SharedSweep;
use sheet_layout::SheetLayout;
use wind::{SheetWindWork, TornCells};

use super::layout::Layout;
use super::rows::{RowLayout, Rows};
use super::survey::FamilySoftness;
use super::workers::Workers;
use crate::constraints::column_writer::{ColumnOrder, ColumnWriter};
use crate::constraints::fields::Pass;
use crate::constraints::parameters::ConstraintParameters;
use crate::kernels::Kernels;
use crate::kernels::lent_slice::LentSlice;
use crate::state::particles::Particle;
use crate::step::schedule::{Schedule, ScheduledStage};
use crate::step::substep::SubstepInputs;
use crate::step::wind::WindStep;

/// The families of a sheet, in the order of projection.
#[derive(Debug, Clone, Default)]
pub(crate) struct SheetFamilies {
    pub(crate) constraints: Vec<Family>,
    pub(crate) bends: Vec<BendFamily>,
}

/// One sheet of particles with its constraints.
#[derive(Debug, Clone)]
pub(crate) struct Patch {
    pub(crate) sheet: Sheet,
    pub(crate) rows: Rows,
    layout: SheetLayout,
    column_order: ColumnOrder,
    schedule: Schedule,
    torn_cells: TornCells,
    /// By row: bit n is set if its projection n has pulls. Empty while nobody asks for forces.
    pull_masks: Vec<u32>,
}

impl Patch {
    /// Makes an empty patch with these families, in the order of projection.
    pub(crate) fn new(sheet: Sheet, families: &SheetFamilies) -> Self {
        let layout = SheetLayout::new(&families.constraints, &families.bends);
        Self {
            sheet,
            rows: Rows::new(layout.rows(&sheet)),
            layout,
            column_order: ColumnOrder::default(),
            schedule: Schedule::default(),
            torn_cells: TornCells::default(),
            pull_masks: Vec::new(),
        }
    }

    /// Sets the fields in use, and the softness of each family.
    pub(crate) fn use_fields(&mut self, layout: Layout, softness: &FamilySoftness) {
        for block in &mut self.layout.families {
            block.softness = softness[block.family as usize].unwrap_or_default();
        }
        self.layout.set_fields(&mut self.rows.layout, layout.of_sheet());
        let families = &self.layout.families;
        let groups = 0..2 * families.len();
        let reaches = groups.map(|group| families[group / 2].family.reach());
        let bends = self.layout.bends.groups.iter().map(|group| group.family.reach());
        self.schedule.rebuild(layout.optional_stages(), &reaches, &bends);
    }

    /// Allocates the fields of the layout. Every constraint and bend is inactive afterwards, and no
    /// particle has a tether.
    pub(crate) fn allocate(&mut self) {
        self.rows.allocate();
        let RowLayout { rows, length, stride, fields, .. } = self.rows.layout;
        if fields.scene.wind {
            self.torn_cells = TornCells::new(&self.rows.layout);
        }
        self.column_order = ColumnOrder::new(fields.constraints);
        let constraints_at = self.rows.layout.constraints_at * stride;
        for row in 0..rows {
            for family in 0..self.layout.families.len() {
                let first = row * length + constraints_at + family * self.layout.family_length;
                for index in first..first + stride {
                    self.writer().set(index, &ConstraintParameters::INACTIVE);
                }
            }
        }
        for row in 0..rows {
            for family in 0..self.layout.bends.families.len() {
                let BendLayout { at, family_length, .. } = self.layout.bends;
                let first = row * length + at + family * family_length;
                for index in first..first + stride {
                    self.set_bend(index, f32::INFINITY);
                }
            }
        }
    }

    /// Index of a constraint for [`Self::writer`].
    pub(crate) fn constraint_index(&self, family: Family, [row, column]: [usize; 2]) -> usize {
        let rows = &self.rows.layout;
        row * rows.length + self.layout.constraint_index(rows, family, column)
    }

    /// Writer for the constraints, by [`Self::constraint_index`].
    pub(crate) fn writer(&mut self) -> ColumnWriter<'_> {
        let (layout, numbers, _) = self.rows.split_mut();
        ColumnWriter::new(numbers, layout.stride, self.column_order)
    }

    /// Index of a bend for [`Self::set_bend`].
    pub(crate) fn bend_index(&self, family: BendFamily, place: [usize; 2]) -> usize {
        let rows = &self.rows.layout;
        place[0] * rows.length + self.layout.bend_index(rows, family, place)
    }

    /// Sets the scaled compliance of a bend; infinite for one without effect.
    pub(crate) fn set_bend(&mut self, index: usize, scaled_compliance: f32) {
        self.rows.numbers_mut()[index] = scaled_compliance;
    }

    /// Copies the state at the start of a step, with velocities in the place of displacements.
    pub(crate) fn unpack(&mut self, states: &[Particle], workers: &mut Workers) {
        self.rows.unpack(&states[self.particles()], workers);
    }

    /// Numbers of the particles.
    fn particles(&self) -> Range<usize> {
        let RowLayout { rows, columns, .. } = self.rows.layout;
        let first = self.sheet.first as usize;
        first..first + rows * columns
    }

    /// Runs the stages of a pass on all rows. Returns true if any constraint was marked as torn.
    pub(crate) fn run_pass(
        &mut self,
        workers: &mut Workers,
        pass: Pass,
        inputs: &SubstepInputs<'_>,
    ) -> bool {
        let schedule = std::mem::take(&mut self.schedule);
        let is_marked = self.run_stages(workers, (schedule.of_pass(pass), pass), inputs);
        self.schedule = schedule;
        is_marked
    }

    /// Runs the stages behind the division of the sweep.
    pub(crate) fn run_ending(&mut self, workers: &mut Workers, inputs: &SubstepInputs<'_>) {
        let schedule = std::mem::take(&mut self.schedule);
        let last = Pass { index: 0, count: 1 };
        self.run_stages(workers, (schedule.ending(), last), inputs);
        self.schedule = schedule;
    }

    /// Runs stages on all rows. Returns true if any constraint was marked as torn.
    fn run_stages(
        &mut self,
        workers: &mut Workers,
        (stages, pass): (&[ScheduledStage], Pass),
        inputs: &SubstepInputs<'_>,
    ) -> bool {
        let sheet = &self.layout;
        let (layout, numbers, forces) = self.rows.split_mut();
        let reach = stages.iter().map(|stage| stage.reach).sum();
        let sweep = SharedSweep {
            bands: Bands::new(layout, workers.count(), reach),
            kernels: workers.kernels,
            is_measured: forces.is_measured,
            rows: LentRows {
                numbers: LentSlice::new(numbers),
                layout,
                sheet,
                forces: LentForces::new(forces, &self.pull_masks, sheet.pull_groups()),
            },
            stages,
            pass,
            inputs,
        };
        sweep.run(workers)
    }

    /// Writes the state back. Returns the number of particles that froze.
    pub(crate) fn pack(&mut self, states: &mut [Particle], h: f32, workers: &mut Workers) -> u64 {
        let particles = self.particles();
        self.rows.pack(&mut states[particles], h, workers)
    }

    /// Takes the triangles with torn sides out of the wind.
    pub(crate) fn follow_triangles(&mut self, triangles: &TornSides) {
        let first = self.sheet.first_triangle;
        self.torn_cells.follow(&self.rows.layout, triangles, first);
    }

    /// Computes the velocities that the wind adds in the running substep.
    pub(crate) fn blow(&mut self, kernels: Kernels, wind: &WindStep) {
        let (layout, numbers, _) = self.rows.split_mut();
        kernels.run(SheetWindWork { numbers, layout, wind, torn: &self.torn_cells });
    }
}
