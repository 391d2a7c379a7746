//! Effect of a pass on one stick, and of passes and substeps on a hanging rope.

use crate::experiment::{self, Rates};
use crate::table::{Column, Origin, Table};

/// Numbers of passes over the stick.
const PASSES: [u32; 4] = [1, 2, 4, 8];

/// The stick in the tutorial's figure: its length, compressed, and its rest length.
const STICK: [f64; 2] = [100.0, 320.0];

/// Links of the rope. As many particles move.
const LINKS: u32 = 20;

/// Length of a link, m.
const LINK: f64 = 0.05;

/// Passes and substeps of the rope. Each pair has the same cost.
const SHARES: [[u32; 2]; 6] = [[20, 1], [10, 2], [5, 4], [4, 5], [2, 10], [1, 20]];

/// Time after which the rope is at rest with a damping of 2/s, s.
const SETTLED_S: u32 = 40;

/// Computes the tables of the lesson.
pub(crate) fn tables() -> Vec<Table> {
    vec![stick(), rope()]
}

/// Returns each end's share of a correction, by inverse mass. A pinned end (0) has none.
fn weighted(inverse_masses: [f64; 2]) -> [f64; 2] {
    inverse_masses.map(|w| w / (inverse_masses[0] + inverse_masses[1]))
}

/// Returns the fraction of the stick's error that remains after passes that move each end by its
/// share of the error.
fn residual(shares: [f64; 2], passes: u32) -> f64 {
    let [length, rest] = STICK;
    let mut ends = [0.0, length];
    for _ in 0..passes {
        let error = ends[1] - ends[0] - rest;
        ends = [ends[0] + shares[0] * error, ends[1] - shares[1] * error];
    }
    (ends[1] - ends[0] - rest) / (length - rest)
}

/// First end of the stick in the solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FirstEnd {
    Free,
    Pinned,
}

/// Returns the fraction of the error that remains in the solver, after one substep.
fn solver_residual(end: FirstEnd, passes: u32) -> f64 {
    let [length, rest] = STICK;
    let is_pinned = end == FirstEnd::Pinned;
    let rates = Rates { iterations: passes, ..Rates::plain(60) };
    let text = format!(
        "gravity = [0, 0, 0]\n{rates}[[particle]]\nposition = [0, 0, 0]\npinned = {is_pinned}\n\
         [[particle]]\nposition = [{length}, 0, 0]\n\
         [[constraint]]\nparticles = [0, 1]\nrest_length = {rest}\n"
    );
    let solver = experiment::stepped(&text, 1);
    let corrected = experiment::coordinate(&solver, 1, 0) - experiment::coordinate(&solver, 0, 0);
    (corrected - rest) / (length - rest)
}

/// Tabulates one stick under each rule.
fn stick() -> Table {
    let by = |shares: [f64; 2]| PASSES.map(|passes| residual(shares, passes));
    let in_solver = |end: FirstEnd| PASSES.map(|passes| solver_residual(end, passes));
    let column = |origin, name, text| Column::new(origin, name, text).decimals(6);
    Table::new("stick", "one compressed stick: fraction of its error that remains")
        .column(Column::new(Origin::Given, "passes", "over the stick").cells(PASSES))
        .column(
            column(Origin::Loop, "half_free", "half the error to each end, both free")
                .cells(by([0.5, 0.5])),
        )
        .column(
            column(Origin::Loop, "half_pinned", "half the error to the free end, the other end pinned")
                .cells(by([0.0, 0.5])),
        )
        .column(
            column(Origin::Law, "law_pinned", "0.5^n after n passes, for half_pinned")
                .cells(PASSES.map(|passes| 0.5_f64.powf(f64::from(passes)))),
        )
        .column(
            column(Origin::Loop, "mass_pinned", "shares by inverse masses 0 and 1")
                .cells(by(weighted([0.0, 1.0]))),
        )
        .column(
            column(Origin::Loop, "mass_1_3", "shares by inverse masses 1 and 3, both free")
                .cells(by(weighted([1.0, 3.0]))),
        )
        .column(column(Origin::Solver, "solver_free", "both free").cells(in_solver(FirstEnd::Free)))
        .column(column(Origin::Solver, "solver_pinned", "one end pinned").cells(in_solver(FirstEnd::Pinned)))
        .column(
            column(Origin::Law, "law", "0, for all but half_pinned: one pass is exact")
                .cells([0.0; PASSES.len()]),
        )
        .note(
            "The tutorial \"A verlet integrator under 100 lines\" (Motecraft) says that each pass covers \
             half of the distance, and that four passes look right for one stick. But its own code gives half of the error to each of the two ends, \
             which is all of it: one pass is exact. More passes are for sticks that share particles.",
        )
        .note(
            "If one end is pinned, the same code moves only the free end, and only by half. It leaves \
             0.5^n, which is 6 % after four passes. Shares by inverse mass give the whole correction \
             to the end that can move.",
        )
}

/// Returns the length of a rope that hangs at rest minus the length of its links, m.
fn stretch(rates: Rates) -> f64 {
    let length = f64::from(LINKS) * LINK;
    let text = format!(
        "{rates}damping = 2\n[[generate]]\nshape = \"rope\"\ncount = {}\nfrom = [0, 0, 0]\n\
         to = [0, -{length}, 0]\npinned = \"first\"\n",
        LINKS + 1
    );
    let solver = experiment::stepped(&text, SETTLED_S * rates.rate_hz);
    -experiment::coordinate(&solver, LINKS as usize, 1) - length
}

/// Returns g h^2 N^2 / (2 P), m.
fn stretch_law(rates: Rates) -> f64 {
    let (n, h) = (f64::from(LINKS), rates.h());
    9.81 * h * h * n * n / (2.0 * f64::from(rates.iterations))
}

/// Tabulates the rope for pairs of passes and substeps of equal cost.
fn rope() -> Table {
    let rates = SHARES.map(|[iterations, substeps]| Rates { rate_hz: 60, substeps, iterations });
    let measured = rates.map(stretch);
    let percent = measured.iter().map(|stretch| 100.0 * stretch / (f64::from(LINKS) * LINK));
    let column = |origin, name, text| Column::new(origin, name, text).decimals(3);
    Table::new("rope", "a rope of 1 m with 20 rigid links, hanging at rest, 60 Hz; stretch in mm")
    .column(
        Column::new(Origin::Given, "passes", "P, over all links in each substep")
            .cells(rates.map(|rates| rates.iterations)),
    )
    .column(
        Column::new(Origin::Given, "substeps", "per step; passes x substeps is the cost")
            .cells(rates.map(|rates| rates.substeps)),
    )
    .column(
        column(Origin::Solver, "stretch", "measured at the lowest particle, mm")
            .cells(measured.iter().map(|stretch| 1000.0 * stretch)),
    )
    .column(column(Origin::Solver, "percent", "stretch, percent of the length").cells(percent))
    .column(
        column(Origin::Law, "law", "g h^2 N^2 / (2 P), mm; exact for N >> P")
            .cells(rates.map(|rates| 1000.0 * stretch_law(rates))),
    )
    .note(
        "In each substep every particle falls by g h^2, and each pass carries the pull of the pin a \
         little further down. The stretch is inversely proportional to the number of passes, but \
         proportional to the square of the substep. At the same cost, 20 substeps of one pass leave \
         about a twentieth of the stretch that one substep of 20 passes leaves.",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::assert_all_near;

    #[test]
    fn each_rule_agrees_with_its_closed_form() {
        let table = stick();
        let halves = [1.0 / 2.0, 1.0 / 4.0, 1.0 / 16.0, 1.0 / 256.0];
        for name in ["half_pinned", "law_pinned"] {
            assert_all_near(name, &halves, &table.numbers(name), 1e-12);
        }
        for name in ["half_free", "mass_pinned", "mass_1_3", "law"] {
            assert_all_near(name, &[0.0; 4], &table.numbers(name), 1e-12);
        }
        for name in ["solver_free", "solver_pinned"] {
            assert_all_near(name, &[0.0; 4], &table.numbers(name), 1e-6);
        }
    }

    #[test]
    fn shares_by_inverse_mass_keep_the_center_of_mass() {
        // 1 kg and 3 kg: the light end moves three times as far.
        let shares = weighted([1.0, 1.0 / 3.0]);
        assert_all_near("shares", &[0.75, 0.25], &shares, 1e-12);
    }

    #[test]
    fn the_law_of_the_rope_is_proportional_to_the_square_of_the_substep() {
        // A particle falls by g (1/60)^2 = 2.725 mm in its first step.
        let table = rope();
        let step = 9.81 / 3.6;
        let expected = [10.0, 5.0, 2.5, 2.0, 1.0, 0.5].map(|times| step * times);
        assert_all_near("law", &expected, &table.numbers("law"), 1e-9);
    }

    #[test]
    fn the_stretch_of_the_rope_follows_the_law() {
        let table = rope();
        let (stretches, law) = (table.numbers("stretch"), table.numbers("law"));
        let ratios: Vec<_> = stretches.iter().zip(&law).map(|(one, law)| one / law).collect();
        assert_all_near("measured / law", &[1.0; 6], &ratios, 0.12);
        let percent: Vec<_> = stretches.iter().map(|stretch| stretch / 10.0).collect();
        assert_all_near("percent", &percent, &table.numbers("percent"), 1e-9);
    }
}
