//! Stiffness as a share per pass, as k', and as compliance: what each depends on.

use super::experiment::{self, Rates};
use super::table::{Column, Origin, Table};

/// Shares of the error that a stick is to take away.
const STIFFNESSES: [f64; 3] = [0.9, 0.6, 0.3];

/// Passes of the first table.
const PASSES: [u32; 5] = [1, 4, 8, 16, 30];

/// Step rates of the loaded sticks, Hz.
const RATES_HZ: [u32; 4] = [30, 60, 120, 240];

/// Substeps of the loaded sticks.
const SUBSTEPS: [u32; 3] = [1, 4, 20];

/// Passes of the compliant stick.
const ITERATIONS: [u32; 3] = [1, 3, 10];

/// Compliance of the stick, m/N.
const COMPLIANCE: f64 = 1e-3;

/// When a loaded stick has come to rest under a damping of 4/s, s.
const SETTLED_S: u32 = 12;

/// The tables of the lesson.
pub(super) fn tables() -> anyhow::Result<Vec<Table>> {
    Ok(vec![passes()?, compliance()?, rate()?])
}

/// k' = 1 - (1 - k)^(1/n): the share of each of n passes.
fn per_pass(k: f64, passes: u32) -> f64 {
    1.0 - (1.0 - k).powf(1.0 / f64::from(passes))
}

/// Share of a stick's error that is left after some passes, each of which takes a share of it.
fn residual(share: f64, passes: u32) -> f64 {
    (0..passes).fold(1.0, |error, _| error - share * error)
}

/// The same in the solver, after one substep: a stick of 1 m, pulled out to 3 m.
fn solved_residual(k: f64, passes: u32) -> anyhow::Result<f64> {
    let rates = Rates { iterations: passes, ..Rates::plain(60) };
    let text = format!(
        "gravity = [0, 0, 0]\n{rates}method = \"pbd\"\n[[particle]]\nposition = [0, 0, 0]\npinned = true\n\
         [[particle]]\nposition = [3, 0, 0]\n\
         [[constraint]]\nparticles = [0, 1]\nrest_length = 1\nstiffness = {k}\n"
    );
    Ok((experiment::coordinate(&experiment::stepped(&text, 1)?, 1, 0) - 1.0) / 2.0)
}

/// k and k' over the number of passes.
fn passes() -> anyhow::Result<Table> {
    let pairs = || STIFFNESSES.into_iter().flat_map(|k| PASSES.map(|passes| (k, passes)));
    let by = |form: fn(f64, u32) -> f64| pairs().map(move |(k, passes)| form(k, passes));
    let solved = pairs().map(|(k, passes)| solved_residual(k, passes));
    let solved = solved.collect::<anyhow::Result<Vec<_>>>()?;
    let column = |origin, name, text| Column::new(origin, name, text).decimals(6);
    Ok(Table::new("passes", "one stick of stiffness k: share of its error left after N passes")
        .column(Column::new(Origin::Given, "k", "stiffness").decimals(1).cells(by(|k, _| k)))
        .column(Column::new(Origin::Given, "N", "passes").cells(pairs().map(|(_, passes)| passes)))
        .column(
            column(Origin::Law, "k'", "1 - (1 - k)^(1/N), the share of each pass")
                .cells(by(per_pass)),
        )
        .column(
            column(Origin::Loop, "with_k'", "left after N passes that each take k'")
                .cells(by(|k, passes| residual(per_pass(k, passes), passes))),
        )
        .column(column(Origin::Solver, "solver", "method = \"pbd\", iterations = N").cells(solved))
        .column(
            column(Origin::Law, "law_k'", "1 - k, whatever N, of the two before")
                .cells(by(|k, _| 1.0 - k)),
        )
        .column(
            column(Origin::Loop, "with_k", "left after N passes that each take k")
                .cells(by(residual)),
        )
        .column(
            column(Origin::Law, "law_k", "(1 - k)^N")
                .cells(by(|k, passes| (1.0 - k).powf(f64::from(passes)))),
        )
        .note(
            "With the raw k in each pass, more passes are another material: 0.3 leaves 70 % after \
             one and nothing after 30. k' is worked out from N so that N of them leave 1 - k. N \
             counts the passes of one substep.",
        ))
}

/// Elongation at rest of a stick of 0.1 m under 1 kg, mm; the keys are those of the stick.
fn elongation(rates: Rates, settings: &str, keys: &str) -> anyhow::Result<f64> {
    // A short stick, as an f32 resolves its small elongations better.
    let length = 0.1;
    let text = format!(
        "{rates}damping = 4\n{settings}[[particle]]\nposition = [0, 0, 0]\npinned = true\n\
         [[particle]]\nposition = [0, -{length}, 0]\nmass = 1\n\
         [[constraint]]\nparticles = [0, 1]\nrest_length = {length}\n{keys}\n"
    );
    let solver = experiment::stepped(&text, SETTLED_S * rates.rate_hz)?;
    Ok(1000.0 * (-experiment::coordinate(&solver, 1, 1) - length))
}

/// The rates and substeps of the loaded sticks.
fn loads() -> impl Iterator<Item = Rates> {
    let substeps = |rate_hz| SUBSTEPS.map(|substeps| Rates { substeps, ..Rates::plain(rate_hz) });
    RATES_HZ.into_iter().flat_map(substeps)
}

/// A table with the rate and the substeps of each load.
fn by_load(name: &'static str, title: &'static str) -> Table {
    Table::new(name, title)
        .column(
            Column::new(Origin::Given, "rate", "steps a second")
                .cells(loads().map(|rates| rates.rate_hz)),
        )
        .column(
            Column::new(Origin::Given, "substeps", "of a step")
                .cells(loads().map(|rates| rates.substeps)),
        )
}

/// Compliance over rate, substeps and passes.
fn compliance() -> anyhow::Result<Table> {
    let names = [
        ("passes_1", "with 1 pass a substep, mm"),
        ("passes_3", "with 3 passes, mm"),
        ("passes_10", "with 10 passes, mm"),
    ];
    let mut table =
        by_load("compliance", "1 kg on a stick of compliance 0.001 m/N: elongation at rest in mm");
    for (iterations, (name, text)) in ITERATIONS.into_iter().zip(names) {
        let keys = format!("compliance = {COMPLIANCE}");
        let found = loads().map(|rates| elongation(Rates { iterations, ..rates }, "", &keys));
        let found = found.collect::<anyhow::Result<Vec<_>>>()?;
        table = table.column(Column::new(Origin::Solver, name, text).decimals(4).cells(found));
    }
    let law = loads().map(|_| 1000.0 * 1.0 * 9.81 * COMPLIANCE);
    Ok(table
        .column(
            Column::new(Origin::Law, "law", "m g x compliance, mm, in every row")
                .decimals(4)
                .cells(law),
        )
        .note(
            "Compliance is 1 / stiffness in N/m, a property of the material: force x compliance is \
             the elongation at every rate and for any number of substeps and passes.",
        ))
}

/// Stiffness over rate and substeps.
fn rate() -> anyhow::Result<Table> {
    let names = [
        ("k_0.9", "solver, stiffness 0.9, mm", "law_0.9"),
        ("k_0.6", "solver, stiffness 0.6, mm", "law_0.6"),
        ("k_0.3", "solver, stiffness 0.3, mm", "law_0.3"),
    ];
    let mut table = by_load("rate", "1 kg on a stick of stiffness k: elongation at rest in mm");
    for (k, (name, text, law)) in STIFFNESSES.into_iter().zip(names) {
        let keys = format!("stiffness = {k}");
        let found = loads().map(|rates| elongation(rates, "method = \"pbd\"\n", &keys));
        let found = found.collect::<anyhow::Result<Vec<_>>>()?;
        let expected = loads().map(|rates| 1000.0 * 9.81 * rates.h() * rates.h() * (1.0 - k) / k);
        table =
            table.column(Column::new(Origin::Solver, name, text).decimals(5).cells(found)).column(
                Column::new(Origin::Law, law, "g h^2 (1 - k) / k, mm").decimals(5).cells(expected),
            );
    }
    Ok(table.note(
        "k makes passes comparable, but not rates: every substep adds g h^2 to the error and takes \
         away k of it, so that a stick of the same k is four times as stiff at twice the rate, and \
         the mass does not matter. At one h, a compliance of h^2 (1 - k) / (k m) does the same. The last rows are near \
         what 32 bits resolve at 0.1 m.",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lesson::experiment::assert_all_near;

    #[test]
    fn k_prime_is_the_nth_root() {
        // Multiplying 1 - k' with itself N times gives 1 - k; k' of 8 passes as printed elsewhere.
        let table = passes().unwrap();
        let (k, n, found) = (table.numbers("k"), table.numbers("N"), table.numbers("k'"));
        for row in 0..found.len() {
            let mut left = 1.0;
            let mut count = 0.0;
            while count < n[row] {
                left *= 1.0 - found[row];
                count += 1.0;
            }
            assert_all_near("(1 - k')^N", &[1.0 - k[row]], &[left], 1e-12);
        }
        let eighths = [found[2], found[7], found[12]];
        assert_all_near("k' of 8", &[0.250_106, 0.108_220, 0.043_605], &eighths, 1e-6);
    }

    #[test]
    fn k_prime_leaves_one_minus_k_and_raw_k_its_power() {
        let table = passes().unwrap();
        let left: Vec<_> = [0.1, 0.4, 0.7].iter().flat_map(|left| [*left; 5]).collect();
        assert_all_near("with k'", &left, &table.numbers("with_k'"), 1e-12);
        assert_all_near("law k'", &left, &table.numbers("law_k'"), 1e-12);
        assert_all_near("solver", &left, &table.numbers("solver"), 1e-5);
        let powers: Vec<_> =
            left.chunks(5).flat_map(|left| [1, 4, 8, 16, 30].map(|n| left[0].powi(n))).collect();
        assert_all_near("with k", &powers, &table.numbers("with_k"), 1e-12);
        assert_all_near("law k", &powers, &table.numbers("law_k"), 1e-12);
    }

    #[test]
    fn a_compliant_stick_is_as_long_as_its_load_says_in_every_row() {
        let table = compliance().unwrap();
        for (name, tolerance) in
            [("law", 1e-12), ("passes_1", 0.01), ("passes_3", 0.01), ("passes_10", 0.01)]
        {
            assert_all_near(name, &[9.81; 12], &table.numbers(name), tolerance);
        }
    }

    #[test]
    fn a_stick_of_stiffness_k_is_as_long_as_its_substep_says() {
        // At rest, what a substep falls is what it takes away: (x + g h^2) (1 - k) = x.
        let table = rate().unwrap();
        for (k, name, law) in
            [(0.9, "k_0.9", "law_0.9"), (0.6, "k_0.6", "law_0.6"), (0.3, "k_0.3", "law_0.3")]
        {
            let law = table.numbers(law);
            for (rates, x) in loads().zip(&law) {
                let fallen = 9810.0 / f64::from(rates.rate_hz * rates.substeps).powi(2);
                assert_all_near("balance", &[*x], &[(x + fallen) * (1.0 - k)], 1e-9);
            }
            for (found, law) in table.numbers(name).into_iter().zip(law) {
                // A thousandth, and a few times the resolution at 0.1 m, 7e-6 mm.
                assert_all_near(name, &[law], &[found], 1e-3 * law + 5e-5);
            }
        }
    }
}
