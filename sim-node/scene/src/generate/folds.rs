//! Folds of a gathered sheet, such as a curtain on a rail.

use sim_types::{ELEMENTS_MAX, NumberRange};

use crate::fields::{At, Fields, printed};

/// Fullness of gathered sheets: three layers are more than any curtain has.
const FULLNESS: NumberRange =
    NumberRange { min: 1.0, max: 3.0, text: "1 to 3", ..NumberRange::SHARE };
const FULLNESS_DEFAULT: f32 = 2.0;
/// Rounds of the search for the steepness of the folds: each halves its error.
const SEARCH_ROUNDS: u32 = 60;
/// Steepness of the folds at which the sheet turns back by 140 degrees: more than any fullness needs.
const STEEPNESS_MAX: f64 = 3.0;

/// Folds of a gathered sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Folds {
    /// Number of folds across the sheet, at least 1.
    pub count: u32,
    /// Width of the sheet laid flat, as a multiple of its width with the folds; at least 1.
    pub fullness: f32,
}

impl Folds {
    /// Walks the keys of the folds of a sheet, if it has any.
    pub(super) fn walk(folds: &mut Option<Self>, fields: &mut Fields<'_>) {
        let mut count = folds.map(|folds| folds.count);
        let mut fullness = folds.map(|folds| folds.fullness);
        let read = |at: At<'_>| {
            if at.reader.is_planar.get() {
                return at.error("folds need 3 dimensions (allowed: no folds)");
            }
            at.whole(1..=ELEMENTS_MAX).map(Some)
        };
        fields.value("folds", &mut count, read, |count| printed(count.as_ref()?));
        fields.optional_number("fullness", &mut fullness, FULLNESS);
        if fields.find("fullness").is_some() && fields.find("folds").is_none() {
            fields.error("fullness", "fullness needs folds (allowed: both or neither)");
        }
        let fullness = fullness.unwrap_or(FULLNESS_DEFAULT);
        *folds = count.map(|count| Self { count, fullness });
    }

    /// Returns for each column its way along the sheet and out of it, in spacings. Neighbours are one spacing apart.
    ///
    /// The sheet turns evenly from one side to the other and back. With t = tan(angle / 2), its direction is
    /// ((1 - t^2), 2 t) / (1 + t^2): no sine, so that the positions are the same on every machine.
    pub(super) fn places(self, columns: u32) -> Vec<[f64; 2]> {
        let steepness = self.steepness(columns);
        let mut at = [0.0, 0.0];
        let steps = (1..columns).map(|column| {
            let [along, out] = direction(steepness * self.wave(column - 1, columns));
            at = [at[0] + along, at[1] + out];
            at
        });
        std::iter::once([0.0, 0.0]).chain(steps).collect()
    }

    /// Finds the steepness at which the folds have their fullness.
    fn steepness(self, columns: u32) -> f64 {
        let flat = f64::from(columns - 1);
        let width = |steepness: f64| {
            let along = |cell| direction(steepness * self.wave(cell, columns))[0];
            (0..columns - 1).map(along).sum::<f64>()
        };
        let [mut low, mut high] = [0.0, STEEPNESS_MAX];
        for _ in 0..SEARCH_ROUNDS {
            let middle = f64::midpoint(low, high);
            if width(middle) * f64::from(self.fullness) > flat {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    /// The turn of the sheet in a cell between two columns, from -1 to 1: a triangle wave.
    fn wave(self, cell: u32, columns: u32) -> f64 {
        let phase = f64::from(self.count) * (f64::from(cell) + 0.5) / f64::from(columns - 1);
        let place = phase - phase.floor();
        if place < 0.5 { 1.0 - 4.0 * place } else { 4.0 * place - 3.0 }
    }
}

/// The direction whose angle has this tangent of its half.
fn direction(half_tangent: f64) -> [f64; 2] {
    let square = half_tangent * half_tangent;
    [(1.0 - square) / (1.0 + square), 2.0 * half_tangent / (1.0 + square)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gathered_sheet_keeps_its_spacing_and_is_as_narrow_as_its_fullness_says() {
        for (columns, count, fullness) in [(49, 6, 2.0), (25, 4, 1.25), (91, 9, 3.0), (9, 2, 1.0)] {
            let places = Folds { count, fullness }.places(columns);
            assert_eq!(places.len(), columns as usize);
            for pair in places.windows(2) {
                let [along, out] = [0, 1].map(|axis| pair[1][axis] - pair[0][axis]);
                assert!((along.hypot(out) - 1.0).abs() < 1e-12, "{along} {out}");
            }
            let [width, out] = places[columns as usize - 1];
            let flat = f64::from(columns - 1);
            assert!((width * f64::from(fullness) - flat).abs() < 1e-6, "{width} of {flat}");
            // The folds end where they began: each goes out as far as it comes back.
            assert!(out.abs() < 1e-6, "{out}");
            let depths = places.iter().map(|place| place[1]);
            let depth = depths.fold([0.0_f64; 2], |[a, b], out| [a.min(out), b.max(out)]);
            assert_eq!(depth[1] - depth[0] > 0.5, fullness > 1.0, "{depth:?}");
        }
    }

    #[test]
    fn a_sheet_of_one_column_has_no_folds() {
        assert_eq!(Folds { count: 1, fullness: 2.0 }.places(1), [[0.0, 0.0]]);
    }
}
