//! A structured patch: a cloth or a rope, row by row, without indices between its numbers.
//!
//! A row is a sequence of fields of equal length: x, y, z of the positions, the inverse masses, x,
//! y, z of the displacements, then fields that only some scenes have, then the constraints that
//! begin in the row, family by family. A constraint between two rows combines eight columns of one
//! row with eight of the other; columns of constraints within a row are separated in registers.

mod band;
mod band_forces;
mod bend_layout;
mod bends;
mod ends;
mod measure;
mod paths;
mod row;
mod row_layout;
mod span;
mod wind;

use std::ops::Range;

use band::{Band, PassSweep, SweepWork};
use band_forces::SheetForces;
use bend_layout::BendLayout;
use row_layout::{LINE_LENGTH, RowLayout, STATE_FIELDS};
use span::Span;
use wind::SheetWindWork;

use super::layout::Layout;
use super::publish::{PublishedMotion, publish};
use super::survey::FamilySoftness;
use super::workers::{WorkerScratch, Workers};
use crate::constraints::bends::families::BendFamily;
use crate::constraints::column_writer::{ColumnOrder, ColumnWriter};
use crate::constraints::families::{Family, Sheet};
use crate::constraints::fields::Pass;
use crate::constraints::parameters::ConstraintParameters;
use crate::kernels::Kernels;
use crate::kernels::huge_pages::refill;
use crate::kernels::lanes::axes;
use crate::state::particles::Particle;
use crate::step::schedule::{Schedule, ScheduledStage};
use crate::step::substep::SubstepInputs;
use crate::step::wind::WindStep;

/// Memory in whole cache lines.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
struct CacheLine([f32; LINE_LENGTH]);

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
    layout: RowLayout,
    lines: Vec<CacheLine>,
    column_order: ColumnOrder,
    schedule: Schedule,
    forces: SheetForces,
}

/// The state fields of a row.
struct RowState<'a> {
    x: [&'a mut [f32]; 3],
    w: &'a mut [f32],
    d: [&'a mut [f32]; 3],
}

impl<'a> RowState<'a> {
    fn new(row: &'a mut [f32], stride: usize) -> Self {
        let mut rest = row;
        let mut next = || {
            let (field, others) = std::mem::take(&mut rest).split_at_mut(stride);
            rest = others;
            field
        };
        let x = [next(), next(), next()];
        Self { x, w: next(), d: [next(), next(), next()] }
    }
}

impl Patch {
    /// Makes an empty patch with these families, in the order of projection.
    pub(crate) fn new(sheet: Sheet, families: &SheetFamilies) -> Self {
        Self {
            sheet,
            layout: RowLayout::new(&sheet, &families.constraints, &families.bends),
            lines: Vec::new(),
            column_order: ColumnOrder::default(),
            schedule: Schedule::default(),
            forces: SheetForces::default(),
        }
    }

    /// Sets the fields in use, and the softness of each family.
    pub(crate) fn use_fields(&mut self, layout: Layout, softness: &FamilySoftness) {
        for block in &mut self.layout.families {
            block.softness = softness[block.family as usize].unwrap_or_default();
        }
        self.layout.set_fields(layout.of_sheet());
        let families = &self.layout.families;
        let groups = 0..2 * families.len();
        let reaches = groups.map(|group| families[group / 2].family.reach());
        let bends = self.layout.bends.groups.iter().map(|group| group.family.reach());
        self.schedule.rebuild(layout.optional_stages(), &reaches, &bends);
    }

    /// Allocates the fields of the layout. Every constraint and bend is inactive afterwards, and no
    /// particle has a tether.
    pub(crate) fn allocate(&mut self) {
        let RowLayout { rows, row_length, stride, constraints_at, family_length, .. } = self.layout;
        refill(&mut self.lines, rows * row_length / LINE_LENGTH, CacheLine([0.0; LINE_LENGTH]));
        self.column_order = ColumnOrder::new(self.layout.fields.constraints);
        for row in 0..rows {
            for family in 0..self.layout.families.len() {
                let first = row * row_length + constraints_at * stride + family * family_length;
                for index in first..first + stride {
                    self.writer().set(index, &ConstraintParameters::INACTIVE);
                }
            }
        }
        for row in 0..rows {
            for family in 0..self.layout.bends.families.len() {
                let BendLayout { at, family_length, .. } = self.layout.bends;
                let first = row * row_length + at + family * family_length;
                for index in first..first + stride {
                    self.set_bend(index, f32::INFINITY);
                }
            }
        }
        for slot in 0..self.layout.fields.scene.tethers {
            for row in 0..rows {
                for column in 0..stride {
                    let index = self.particle_index([row, column]);
                    self.set_tether_length(index, slot, f32::INFINITY);
                }
            }
        }
    }

    /// Index of a constraint for [`Self::writer`].
    pub(crate) fn constraint_index(&self, family: Family, place: [usize; 2]) -> usize {
        self.layout.constraint_index(family, place)
    }

    /// Writer for the constraints, by [`Self::constraint_index`].
    pub(crate) fn writer(&mut self) -> ColumnWriter<'_> {
        let numbers: &mut [f32] = bytemuck::cast_slice_mut(&mut self.lines);
        ColumnWriter::new(numbers, self.layout.stride, self.column_order)
    }

    /// Index of a bend for [`Self::set_bend`].
    pub(crate) fn bend_index(&self, family: BendFamily, place: [usize; 2]) -> usize {
        self.layout.bend_index(family, place)
    }

    /// Sets the scaled compliance of a bend; infinite for one without effect.
    pub(crate) fn set_bend(&mut self, index: usize, scaled_compliance: f32) {
        let numbers: &mut [f32] = bytemuck::cast_slice_mut(&mut self.lines);
        numbers[index] = scaled_compliance;
    }

    fn row(&mut self, row: usize) -> RowState<'_> {
        let RowLayout { row_length, stride, .. } = self.layout;
        let numbers: &mut [f32] = bytemuck::cast_slice_mut(&mut self.lines);
        RowState::new(&mut numbers[row * row_length..][..row_length], stride)
    }

    /// Copies the state at the start of a step, with velocities in the place of displacements.
    pub(crate) fn unpack(&mut self, states: &[Particle]) {
        let first = self.sheet.first as usize;
        let columns = self.layout.columns;
        for row in 0..self.layout.rows {
            let states = &states[first + row * columns..][..columns];
            let RowState { x, w, d } = self.row(row);
            for axis in 0..3 {
                for (number, state) in x[axis].iter_mut().zip(states) {
                    *number = state.position[axis];
                }
                for (number, state) in d[axis].iter_mut().zip(states) {
                    *number = state.velocity[axis];
                }
            }
            for (number, state) in w.iter_mut().zip(states) {
                *number = state.inverse_mass;
            }
        }
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
    ///
    /// Each worker has a band of rows. A second round finishes the seams between them, whose
    /// constraints need rows of two bands.
    fn run_stages(
        &mut self,
        workers: &mut Workers,
        (stages, pass): (&[ScheduledStage], Pass),
        inputs: &SubstepInputs<'_>,
    ) -> bool {
        let (layout, forces) = (&self.layout, &mut self.forces);
        let is_measured = forces.is_measured();
        let numbers: &mut [f32] = bytemuck::cast_slice_mut(&mut self.lines);
        let kernels = workers.kernels;
        let reach = stages.iter().map(|stage| stage.reach).sum();
        let count = layout.band_count(workers.count(), reach);
        let run = |band: Band<'_>, span, scratch: &mut WorkerScratch| {
            let sweep = PassSweep { stages, pass, inputs, scratch };
            if is_measured {
                kernels.run(SweepWork::<true> { band, span, sweep })
            } else {
                kernels.run(SweepWork::<false> { band, span, sweep })
            }
        };
        if count == 1 {
            let band = Band { numbers, first: 0, layout, forces: forces.all(layout) };
            let span = Span::new(0..layout.rows, layout.rows);
            return run(band, span, workers.own_scratch());
        }
        let cuts = (0..=count).map(|band| band * layout.rows / count);
        let spans = cuts
            .clone()
            .zip(cuts.clone().skip(1))
            .map(|(first, last)| (first..last, Span::new(first..last, layout.rows)));
        let seams = cuts.skip(1).take(count - 1);
        let seams = seams.map(|row| (row - reach..row + reach, Span::seam(row)));
        let mut is_marked = false;
        let mut round = |spans: &mut dyn Iterator<Item = (Range<usize>, Span)>| {
            let work = |part: &mut BandPart<'_>, scratch: &mut WorkerScratch| {
                if let Some(band) = part.band.take() {
                    part.is_marked = run(band, part.span.clone(), scratch);
                }
            };
            let whole =
                Band { numbers: &mut *numbers, first: 0, layout, forces: forces.all(layout) };
            let parts = BandPart::split(whole, spans);
            workers.for_each(parts, work, |part| is_marked |= part.is_marked);
        };
        round(&mut spans.into_iter());
        round(&mut seams.into_iter());
        is_marked
    }

    /// Writes the state back. Returns the number of particles that froze.
    pub(crate) fn pack(&mut self, states: &mut [Particle], h: f32) -> u64 {
        let mut frozen_count = 0;
        let first = self.sheet.first as usize;
        let columns = self.layout.columns;
        for row in 0..self.layout.rows {
            let states = &mut states[first + row * columns..][..columns];
            let RowState { x, d, .. } = self.row(row);
            for (column, state) in states.iter_mut().enumerate() {
                let vector = |fields: &[&mut [f32]; 3]| axes(|axis| fields[axis][column]);
                let motion = PublishedMotion { position: vector(&x), displacement: vector(&d), h };
                frozen_count += u64::from(publish(state, motion));
            }
        }
        frozen_count
    }

    /// Index, among all numbers, of the x position of a particle.
    pub(crate) fn particle_index(&self, [row, column]: [usize; 2]) -> usize {
        row * self.layout.row_length + column
    }

    /// Vector of a particle in fields `field`, `field` + 1 and `field` + 2.
    #[inline(always)]
    fn vector(&self, index: usize, field: usize) -> [f32; 3] {
        let numbers: &[f32] = bytemuck::cast_slice(&self.lines);
        axes(|axis| numbers[index + (field + axis) * self.layout.stride])
    }

    fn set_vector(&mut self, index: usize, field: usize, vector: [f32; 3]) {
        let stride = self.layout.stride;
        let numbers: &mut [f32] = bytemuck::cast_slice_mut(&mut self.lines);
        for (axis, value) in vector.into_iter().enumerate() {
            numbers[index + (field + axis) * stride] = value;
        }
    }

    #[inline(always)]
    pub(crate) fn position(&self, index: usize) -> [f32; 3] {
        self.vector(index, 0)
    }

    #[inline(always)]
    pub(crate) fn inverse_mass(&self, index: usize) -> f32 {
        let numbers: &[f32] = bytemuck::cast_slice(&self.lines);
        numbers[index + 3 * self.layout.stride]
    }

    #[inline(always)]
    pub(crate) fn displacement(&self, index: usize) -> [f32; 3] {
        self.vector(index, 4)
    }

    /// Displacement before any constraint or contact, in a scene with colliders.
    pub(crate) fn predicted(&self, index: usize) -> [f32; 3] {
        self.vector(index, STATE_FIELDS)
    }

    pub(crate) fn set_position(&mut self, index: usize, position: [f32; 3]) {
        self.set_vector(index, 0, position);
    }

    pub(crate) fn set_displacement(&mut self, index: usize, displacement: [f32; 3]) {
        self.set_vector(index, 4, displacement);
    }

    /// Computes the velocities that the wind adds in the running substep.
    pub(crate) fn blow(&mut self, kernels: Kernels, wind: &WindStep) {
        let numbers: &mut [f32] = bytemuck::cast_slice_mut(&mut self.lines);
        kernels.run(SheetWindWork { numbers, layout: &self.layout, wind });
    }

    /// Sets the position of a tether's root at the end of the substep.
    pub(crate) fn set_root(&mut self, index: usize, slot: usize, root: [f32; 3]) {
        self.set_vector(index, self.layout.root_at(slot), root);
    }

    /// Sets the length of a tether; infinite for no tether.
    pub(crate) fn set_tether_length(&mut self, index: usize, slot: usize, length: f32) {
        let at = index + (self.layout.root_at(slot) + 3) * self.layout.stride;
        let stride = self.layout.stride;
        let numbers: &mut [f32] = bytemuck::cast_slice_mut(&mut self.lines);
        (numbers[at], numbers[at + stride]) = (length, length * length);
    }
}

/// Rows that one worker processes.
struct BandPart<'a> {
    /// None once they are processed.
    band: Option<Band<'a>>,
    span: Span,
    is_marked: bool,
}

impl<'a> BandPart<'a> {
    /// Splits ascending ranges of rows off a sheet.
    fn split(
        whole: Band<'a>,
        spans: impl Iterator<Item = (Range<usize>, Span)>,
    ) -> impl Iterator<Item = Self> {
        let mut rest = Some(whole);
        spans.map_while(move |(rows, span)| {
            let (_, from) = rest.take()?.split_at(rows.start);
            let (band, others) = from.split_at(rows.end);
            rest = Some(others);
            Some(Self { band: Some(band), span, is_marked: false })
        })
    }
}
