//! Stiffness as a share per pass, as k' and as compliance, and the settings that each depends on.

use crate::experiment::{self, Rates};
use crate::table::{Column, Origin, Table};

/// Stiffnesses k: the shares of the error that a stick should correct.
const STIFFNESSES: [f64; 3] = [0.9, 0.6, 0.3];

/// Numbers of passes in the first table.
const PASSES: [u32; 5] = [1, 4, 8, 16, 30];

/// Step rates of the loaded sticks, Hz.
const RATES_HZ: [u32; 4] = [30, 60, 120, 240];

/// Substeps of the loaded sticks.
const SUBSTEPS: [u32; 3] = [1, 4, 20];

/// Numbers of passes over the compliant stick.
const ITERATIONS: [u32; 3] = [1, 3, 10];

/// Compliance of the stick, m/N.
const COMPLIANCE: f64 = 1e-3;

/// Time after which a loaded stick is at rest with a damping of 4/s, s.
const SETTLED_S: u32 = 12;

/// Computes the tables of the lesson.
pub(crate) fn tables() -> Vec<Table> {
    vec![passes(), compliance(), rate()]
}

/// Returns k' = 1 - (1 - k)^(1/n), the share of each of n passes.
fn share_per_pass(k: f64, passes: u32) -> f64 {
    1.0 - (1.0 - k).powf(1.0 / f64::from(passes))
}

/// Returns the fraction of a stick's error that remains after passes that each correct a share.
fn residual(share: f64, passes: u32) -> f64 {
    (0..passes).fold(1.0, |error, _| error - share * error)
}

/// Returns the fraction of the error that remains in the solver, after one substep, for a stick of
/// 1 m that is stretched to 3 m.
fn solver_residual(k: f64, passes: u32) -> f64 {
    let rates = Rates { iterations: passes, ..Rates::plain(60) };
    let text = format!(
        "gravity = [0, 0, 0]\n{rates}method = \"pbd\"\n[[particle]]\nposition = [0, 0, 0]\npinned = true\n\
         [[particle]]\nposition = [3, 0, 0]\n\
         [[constraint]]\nparticles = [0, 1]\nrest_length = 1\nstiffness = {k}\n"
    );
    (experiment::coordinate(&experiment::stepped(&text, 1), 1, 0) - 1.0) / 2.0
}

/// Tabulates k and k' over the number of passes.
fn passes() -> Table {
    let pairs = || STIFFNESSES.into_iter().flat_map(|k| PASSES.map(|passes| (k, passes)));
    let by = |form: fn(f64, u32) -> f64| pairs().map(move |(k, passes)| form(k, passes));
    let column = |origin, name, text| Column::new(origin, name, text).decimals(6);
    Table::new("passes", "one stick of stiffness k: fraction of its error after N passes")
        .column(Column::new(Origin::Given, "k", "stiffness").decimals(1).cells(by(|k, _| k)))
        .column(Column::new(Origin::Given, "N", "passes").cells(pairs().map(|(_, passes)| passes)))
        .column(
            column(Origin::Law, "k'", "1 - (1 - k)^(1/N), the share of each pass")
                .cells(by(share_per_pass)),
        )
        .column(
            column(Origin::Loop, "with_k'", "remains after N passes that each correct the share k'")
                .cells(by(|k, passes| residual(share_per_pass(k, passes), passes))),
        )
        .column(
            column(Origin::Solver, "solver", "method = \"pbd\", iterations = N")
                .cells(by(solver_residual)),
        )
        .column(
            column(Origin::Law, "law_k'", "1 - k for every N, for the two columns before it")
                .cells(by(|k, _| 1.0 - k)),
        )
        .column(
            column(Origin::Loop, "with_k", "remains after N passes that each correct the share k")
                .cells(by(residual)),
        )
        .column(
            column(Origin::Law, "law_k", "(1 - k)^N")
                .cells(by(|k, passes| (1.0 - k).powf(f64::from(passes)))),
        )
        .note(
            "If every pass corrects the raw k, the number of passes changes the material: 0.3 leaves \
             70 % after one pass and nothing after 30. k' is computed from N so that N passes leave \
             1 - k. N counts the passes of one substep.",
        )
}

/// Keys of a loaded stick's scene.
#[derive(Debug, Clone, Copy)]
struct StickKeys<'a> {
    /// Lines for the table `[solver]`.
    solver: &'a str,
    /// Lines for the constraint.
    constraint: &'a str,
}

/// Returns the elongation at rest of a stick of 0.1 m under 1 kg, mm.
fn elongation(rates: Rates, keys: StickKeys<'_>) -> f64 {
    let StickKeys { solver, constraint } = keys;
    // The stick is short because f32 resolves small elongations better near 0.
    let length = 0.1;
    let text = format!(
        "{rates}damping = 4\n{solver}[[particle]]\nposition = [0, 0, 0]\npinned = true\n\
         [[particle]]\nposition = [0, -{length}, 0]\nmass = 1\n\
         [[constraint]]\nparticles = [0, 1]\nrest_length = {length}\n{constraint}\n"
    );
    let solver = experiment::stepped(&text, SETTLED_S * rates.rate_hz);
    1000.0 * (-experiment::coordinate(&solver, 1, 1) - length)
}

/// Returns the rates and substeps of the loaded sticks.
fn loads() -> impl Iterator<Item = Rates> {
    let substeps = |rate_hz| SUBSTEPS.map(|substeps| Rates { substeps, ..Rates::plain(rate_hz) });
    RATES_HZ.into_iter().flat_map(substeps)
}

/// Starts a table with the rate and the substeps of each loaded stick.
fn by_load(name: &'static str, title: &'static str) -> Table {
    Table::new(name, title)
        .column(
            Column::new(Origin::Given, "rate", "steps per second")
                .cells(loads().map(|rates| rates.rate_hz)),
        )
        .column(
            Column::new(Origin::Given, "substeps", "per step")
                .cells(loads().map(|rates| rates.substeps)),
        )
}

/// Tabulates the elongation of a compliant stick over rate, substeps and passes.
fn compliance() -> Table {
    let names = [
        ("passes_1", "with 1 pass per substep, mm"),
        ("passes_3", "with 3 passes, mm"),
        ("passes_10", "with 10 passes, mm"),
    ];
    let constraint = format!("compliance = {COMPLIANCE}");
    let keys = StickKeys { solver: "", constraint: &constraint };
    let mut table =
        by_load("compliance", "1 kg on a stick of compliance 0.001 m/N: elongation at rest in mm");
    for (iterations, (name, text)) in ITERATIONS.into_iter().zip(names) {
        let elongations = loads().map(|rates| elongation(Rates { iterations, ..rates }, keys));
        let column = Column::new(Origin::Solver, name, text).decimals(4);
        table = table.column(column.cells(elongations));
    }
    let law = loads().map(|_| 1000.0 * 1.0 * 9.81 * COMPLIANCE);
    table
        .column(
            Column::new(Origin::Law, "law", "m g x compliance, mm, in every row")
                .decimals(4)
                .cells(law),
        )
        .note(
            "Compliance is 1 / (stiffness in N/m), a property of the material. The elongation is \
             force x compliance at every rate and for any number of substeps and passes.",
        )
}

/// Tabulates the elongation of sticks of a given stiffness k over rate and substeps.
fn rate() -> Table {
    let names = [
        ("k_0.9", "stiffness 0.9, mm", "law_0.9"),
        ("k_0.6", "stiffness 0.6, mm", "law_0.6"),
        ("k_0.3", "stiffness 0.3, mm", "law_0.3"),
    ];
    let mut table = by_load("rate", "1 kg on a stick of stiffness k: elongation at rest in mm");
    for (k, (name, text, law)) in STIFFNESSES.into_iter().zip(names) {
        let constraint = format!("stiffness = {k}");
        let keys = StickKeys { solver: "method = \"pbd\"\n", constraint: &constraint };
        let elongations = loads().map(|rates| elongation(rates, keys));
        let expected = loads().map(|rates| 1000.0 * 9.81 * rates.h() * rates.h() * (1.0 - k) / k);
        table = table
            .column(Column::new(Origin::Solver, name, text).decimals(5).cells(elongations))
            .column(
                Column::new(Origin::Law, law, "g h^2 (1 - k) / k, mm").decimals(5).cells(expected),
            );
    }
    table.note(
        "k' makes numbers of passes comparable, but not rates. Every substep adds g h^2 to the error \
         and removes the share k of it. A stick of the same k is therefore four times as stiff at \
         twice the rate, whatever its mass. At a given h, a compliance of h^2 (1 - k) / (k m) has \
         the same effect. The last rows are close to the resolution of f32 at 0.1 m.",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::assert_all_near;

    #[test]
    fn k_prime_is_the_nth_root() {
        // (1 - k')^N is 1 - k. The tutorials print k' for 8 passes.
        let table = passes();
        let (k, n, shares) = (table.numbers("k"), table.numbers("N"), table.numbers("k'"));
        for row in 0..shares.len() {
            let mut left = 1.0;
            let mut count = 0.0;
            while count < n[row] {
                left *= 1.0 - shares[row];
                count += 1.0;
            }
            assert_all_near("(1 - k')^N", &[1.0 - k[row]], &[left], 1e-12);
        }
        let eighths = [shares[2], shares[7], shares[12]];
        assert_all_near("k' of 8", &[0.250_106, 0.108_220, 0.043_605], &eighths, 1e-6);
    }

    #[test]
    fn k_prime_leaves_one_minus_k_and_raw_k_leaves_its_nth_power() {
        let table = passes();
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
    fn the_elongation_of_a_compliant_stick_depends_on_its_load_only() {
        let table = compliance();
        for (name, tolerance) in
            [("law", 1e-12), ("passes_1", 0.01), ("passes_3", 0.01), ("passes_10", 0.01)]
        {
            assert_all_near(name, &[9.81; 12], &table.numbers(name), tolerance);
        }
    }

    #[test]
    fn the_elongation_of_a_stick_of_stiffness_k_depends_on_its_substep() {
        // At rest, a substep corrects as much as it falls: (x + g h^2) (1 - k) = x.
        let table = rate();
        for (k, name, law) in
            [(0.9, "k_0.9", "law_0.9"), (0.6, "k_0.6", "law_0.6"), (0.3, "k_0.3", "law_0.3")]
        {
            let law = table.numbers(law);
            for (rates, x) in loads().zip(&law) {
                let fallen = 9810.0 / f64::from(rates.rate_hz * rates.substeps).powi(2);
                assert_all_near("balance", &[*x], &[(x + fallen) * (1.0 - k)], 1e-9);
            }
            for (elongation, law) in table.numbers(name).into_iter().zip(law) {
                // A thousandth, plus a few times the resolution of f32 at 0.1 m, 7e-6 mm.
                assert_all_near(name, &[law], &[elongation], 1e-3 * law + 5e-5);
            }
        }
    }
}
