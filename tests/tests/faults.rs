//! A short schedule of random faults. `cargo faults` performs longer ones.

use integration_tests::faults;

#[test]
fn random_faults_damage_nothing_lose_nothing_silently_and_leave_nothing_behind() {
    let summary = faults::run(3, 80, |_, _| true);
    assert!(summary.recordings > 0 && summary.snapshots > 0, "{summary:?}");
}
