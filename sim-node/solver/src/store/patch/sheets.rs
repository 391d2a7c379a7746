//! The sheets that are stored in rows, and the particles in them.

use sim_scene::constraints::bends::families::BendFamily;
use sim_scene::constraints::families::{Family, Sheet};
use sim_scene::model::Model;

use super::SheetFamilies;

/// A particle in a sheet.
pub(crate) struct Found {
    /// Index of the sheet.
    pub(crate) sheet: usize,
    /// Row and column.
    pub(crate) place: [usize; 2],
}

/// Finds the sheet of a particle. Sheets must ascend.
pub(crate) fn find_sheet(sheets: &[Sheet], particle: u32) -> Option<Found> {
    let sheet = sheets.partition_point(|sheet| sheet.first <= particle).checked_sub(1)?;
    Some(Found { sheet, place: sheets[sheet].find(particle)? })
}

/// Number of columns below which the padding of a row is a multiple of its particles.
const COLUMNS_MIN: u32 = 24;
/// Number of rows from which that padding matters. A sheet of 16 million rows with one column would
/// occupy 19 GB; the graph holds it in 2.
const ROWS_OF_NARROW_MAX: u32 = 1 << 16;

/// Returns the sheets that are stored in rows: their particles have only constraints and bends of families,
/// and they are not long and narrow.
pub(crate) fn pure_sheets(model: &Model) -> Vec<Sheet> {
    let mut is_pure = vec![true; model.sheets.len()];
    let constraints = (0_u32..).zip(&model.families).filter(|(_, family)| family.is_none());
    let bends = model.bends.iter().zip(&model.bend_families).filter(|(_, family)| family.is_none());
    let particles = constraints
        .flat_map(|(index, _)| model.pair(index))
        .chain(bends.flat_map(|(bend, _)| bend.particles));
    for particle in particles {
        if let Some(found) = find_sheet(&model.sheets, particle) {
            is_pure[found.sheet] = false;
        }
    }
    let sheets = model.sheets.iter().zip(is_pure);
    let is_padding = |sheet: &Sheet| sheet.columns < COLUMNS_MIN && sheet.rows > ROWS_OF_NARROW_MAX;
    sheets
        .filter(|(sheet, is_pure)| *is_pure && !is_padding(sheet))
        .map(|(sheet, _)| *sheet)
        .collect()
}

/// Returns the particles outside of the sheets, ascending.
pub(crate) fn loose_particles(model: &Model, sheets: &[Sheet]) -> Vec<u32> {
    let all = 0..model.particle_count();
    all.filter(|particle| find_sheet(sheets, *particle).is_none()).collect()
}

/// Returns the families of each sheet.
pub(crate) fn families_of(model: &Model, sheets: &[Sheet]) -> Vec<SheetFamilies> {
    let mut has_family = vec![[false; Family::ALL.len()]; sheets.len()];
    for (index, group) in (0_u32..).zip(&model.families) {
        let found = find_sheet(sheets, model.pair(index)[0]);
        if let (Some(found), Some(group)) = (found, group) {
            has_family[found.sheet][Family::from_group(*group) as usize] = true;
        }
    }
    let mut has_bends = vec![[false; BendFamily::ALL.len()]; sheets.len()];
    for (bend, group) in model.bends.iter().zip(&model.bend_families) {
        let found = find_sheet(sheets, bend.particles[0]);
        if let (Some(found), Some(group)) = (found, group) {
            has_bends[found.sheet][BendFamily::from_group(*group) as usize] = true;
        }
    }
    let families =
        has_family.into_iter().zip(has_bends).map(|(constraints, bends)| SheetFamilies {
            constraints: present(Family::ALL, &constraints),
            bends: present(BendFamily::ALL, &bends),
        });
    families.collect()
}

fn present<T, const N: usize>(all: [T; N], has: &[bool; N]) -> Vec<T> {
    all.into_iter().zip(has).filter(|(_, has)| **has).map(|(one, _)| one).collect()
}
