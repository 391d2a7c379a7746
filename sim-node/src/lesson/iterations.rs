//! What a pass does to one stick, and what passes and substeps do to a hanging rope.

use super::experiment::{self, Rates};
use super::table::{Column, Origin, Table};

/// Passes over the one stick.
const PASSES: [u32; 4] = [1, 2, 4, 8];

/// The stick of the tutorial's figure: pushed together to 100, rest length 320.
const STICK: [f64; 2] = [100.0, 320.0];

/// Links of the rope; as many particles move.
const LINKS: u32 = 20;

/// Length of a link, m.
const LINK: f64 = 0.05;

/// Passes and substeps of the rope: the same cost in each row.
const SHARES: [[u32; 2]; 6] = [[20, 1], [10, 2], [5, 4], [4, 5], [2, 10], [1, 20]];

/// When the rope has come to rest under a damping of 2/s, s.
const SETTLED_S: u32 = 40;

/// The tables of the lesson.
pub(super) fn tables() -> anyhow::Result<Vec<Table>> {
    Ok(vec![stick()?, rope()?])
}

/// By inverse masses: each end takes its share, a pinned one (0) none.
fn weighted(inverse_masses: [f64; 2]) -> [f64; 2] {
    inverse_masses.map(|w| w / (inverse_masses[0] + inverse_masses[1]))
}

/// Share of the stick's error that is left after some passes which move each end by its share.
fn residual(shares: [f64; 2], passes: u32) -> f64 {
    let [length, rest] = STICK;
    let mut ends = [0.0, length];
    for _ in 0..passes {
        let error = ends[1] - ends[0] - rest;
        ends = [ends[0] + shares[0] * error, ends[1] - shares[1] * error];
    }
    (ends[1] - ends[0] - rest) / (length - rest)
}

/// The same of a stick in the solver, after one substep of some passes.
fn solved_residual(is_pinned: bool, passes: u32) -> anyhow::Result<f64> {
    let [length, rest] = STICK;
    let rates = Rates { iterations: passes, ..Rates::plain(60) };
    let text = format!(
        "gravity = [0, 0, 0]\n{rates}[[particle]]\nposition = [0, 0, 0]\npinned = {is_pinned}\n\
         [[particle]]\nposition = [{length}, 0, 0]\n\
         [[constraint]]\nparticles = [0, 1]\nrest_length = {rest}\n"
    );
    let solver = experiment::stepped(&text, 1)?;
    let found = experiment::coordinate(&solver, 1, 0) - experiment::coordinate(&solver, 0, 0);
    Ok((found - rest) / (length - rest))
}

/// One stick under each rule.
fn stick() -> anyhow::Result<Table> {
    let by = |shares: [f64; 2]| PASSES.map(|passes| residual(shares, passes));
    let solved = |is_pinned: bool| {
        let residuals = PASSES.into_iter().map(|passes| solved_residual(is_pinned, passes));
        residuals.collect::<anyhow::Result<Vec<_>>>()
    };
    let column = |origin, name, text| Column::new(origin, name, text).decimals(6);
    Ok(Table::new("stick", "one stick, pushed together: share of its error that is left")
        .column(Column::new(Origin::Given, "passes", "over the one stick").cells(PASSES))
        .column(
            column(Origin::Loop, "half_free", "half of the error to each end, both free")
                .cells(by([0.5, 0.5])),
        )
        .column(
            column(Origin::Loop, "half_pinned", "half to the free end, the other one pinned")
                .cells(by([0.0, 0.5])),
        )
        .column(
            column(Origin::Law, "law_pinned", "0.5^n after n passes, of half_pinned")
                .cells(PASSES.map(|passes| 0.5_f64.powf(f64::from(passes)))),
        )
        .column(
            column(Origin::Loop, "mass_pinned", "by inverse masses 0 and 1")
                .cells(by(weighted([0.0, 1.0]))),
        )
        .column(
            column(Origin::Loop, "mass_1_3", "by inverse masses 1 and 3, both free")
                .cells(by(weighted([1.0, 3.0]))),
        )
        .column(column(Origin::Solver, "solver_free", "both free").cells(solved(false)?))
        .column(column(Origin::Solver, "solver_pinned", "one end pinned").cells(solved(true)?))
        .column(
            column(Origin::Law, "law", "0: one pass is exact, of all but half_pinned")
                .cells([0.0; PASSES.len()]),
        )
        .note(
            "A tutorial lets each pass go half of the way, so that four passes look right for one \
             stick. Its own code gives half of the error to each of two ends, which is all of it: \
             exact after one pass. More passes are for sticks that share particles.",
        )
        .note(
            "With one end pinned, the same code moves the free end by half and leaves 0.5^n: 6 % \
             after four passes. Inverse masses give all of it to the end that can move.",
        ))
}

/// How much longer than its links a rope hangs at rest, m.
fn stretch(rates: Rates) -> anyhow::Result<f64> {
    let length = f64::from(LINKS) * LINK;
    let text = format!(
        "{rates}damping = 2\n[[generate]]\nshape = \"rope\"\ncount = {}\nfrom = [0, 0, 0]\n\
         to = [0, -{length}, 0]\npinned = \"first\"\n",
        LINKS + 1
    );
    let solver = experiment::stepped(&text, SETTLED_S * rates.rate_hz)?;
    Ok(-experiment::coordinate(&solver, LINKS as usize, 1) - length)
}

/// g h^2 N^2 / (2 P), m.
fn stretch_law(rates: Rates) -> f64 {
    let (n, h) = (f64::from(LINKS), rates.h());
    9.81 * h * h * n * n / (2.0 * f64::from(rates.iterations))
}

/// The rope at equal cost.
fn rope() -> anyhow::Result<Table> {
    let rates = SHARES.map(|[iterations, substeps]| Rates { rate_hz: 60, substeps, iterations });
    let measured = rates.into_iter().map(stretch).collect::<anyhow::Result<Vec<_>>>()?;
    let percent = measured.iter().map(|stretch| 100.0 * stretch / (f64::from(LINKS) * LINK));
    let column = |origin, name, text| Column::new(origin, name, text).decimals(3);
    Ok(Table::new(
        "rope",
        "a rope of 20 rigid links and 1 m, hanging at rest, 60 Hz; stretch in mm",
    )
    .column(
        Column::new(Origin::Given, "passes", "P, over all links in a substep")
            .cells(rates.map(|rates| rates.iterations)),
    )
    .column(
        Column::new(Origin::Given, "substeps", "of a step; passes x substeps is the cost")
            .cells(rates.map(|rates| rates.substeps)),
    )
    .column(
        column(Origin::Solver, "stretch", "measured at the lowest particle, mm")
            .cells(measured.iter().map(|stretch| 1000.0 * stretch)),
    )
    .column(column(Origin::Solver, "percent", "of the length").cells(percent))
    .column(
        column(Origin::Law, "law", "g h^2 N^2 / (2 P), mm; exact for long ropes, N >> P")
            .cells(rates.map(|rates| 1000.0 * stretch_law(rates))),
    )
    .note(
        "Each substep lets every particle fall by g h^2, and each pass carries the pull of the \
             pin a little further down. Passes come in once, the length of a substep squared: \
             for the same cost, 20 substeps of one pass leave about a twentieth of what 20 passes leave.",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lesson::experiment::assert_all_near;

    #[test]
    fn each_rule_leaves_what_its_closed_form_says() {
        let table = stick().unwrap();
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
    fn shares_by_inverse_masses_keep_the_center_of_mass() {
        // 1 kg and 3 kg: the light end goes three times as far.
        let shares = weighted([1.0, 1.0 / 3.0]);
        assert_all_near("shares", &[0.75, 0.25], &shares, 1e-12);
    }

    #[test]
    fn the_law_of_the_rope_goes_with_the_square_of_the_substep() {
        // g (1/60)^2 = 2.725 mm is what a particle falls in a step from rest.
        let table = rope().unwrap();
        let step = 9.81 / 3.6;
        let expected = [10.0, 5.0, 2.5, 2.0, 1.0, 0.5].map(|times| step * times);
        assert_all_near("law", &expected, &table.numbers("law"), 1e-9);
    }

    #[test]
    fn the_rope_stretches_as_the_law_says() {
        let table = rope().unwrap();
        let (found, law) = (table.numbers("stretch"), table.numbers("law"));
        let ratios: Vec<_> = found.iter().zip(&law).map(|(found, law)| found / law).collect();
        assert_all_near("measured / law", &[1.0; 6], &ratios, 0.12);
        let percent: Vec<_> = found.iter().map(|found| found / 10.0).collect();
        assert_all_near("percent", &percent, &table.numbers("percent"), 1e-9);
    }
}
