//! `ctl forces`: the forces on colliders, anchors and fixed particles.

use anyhow::bail;
use serde::Serialize;
use sim_contract::{
    Client, ColliderShape, ColliderState, ForceKind, ForceRow, Forces, NodeStatus, ParticleFlags,
    ParticleState,
};

use crate::args::CtlArgs;
use crate::output;
use crate::output::{Align, Table};

/// The forces of a step in JSON.
#[derive(Debug, Serialize)]
struct ForcesReport {
    step: u64,
    rate_hz: u32,
    colliders: Vec<ForceReport>,
    anchors: Vec<ForceReport>,
    particles: Vec<ForceReport>,
}

/// The force on one of them in JSON.
#[derive(Debug, Serialize)]
struct ForceReport {
    index: u32,
    /// Of a collider.
    #[serde(skip_serializing_if = "Option::is_none")]
    shape: Option<&'static str>,
    /// Of a particle.
    #[serde(skip_serializing_if = "Option::is_none")]
    flags: Option<Vec<&'static str>>,
    /// In N.
    force: [f64; 3],
    /// In N m; not of a particle.
    #[serde(skip_serializing_if = "Option::is_none")]
    torque: Option<[f64; 3]>,
    /// Of a collider.
    #[serde(skip_serializing_if = "Option::is_none")]
    contacts: Option<u32>,
}

/// Prints the forces of the next step.
pub(super) fn print(client: &mut Client, args: &CtlArgs) -> anyhow::Result<()> {
    let Some(forces) = client.forces(args.timeout())? else {
        bail!(
            "the node published no forces within {:?}: {}",
            args.timeout(),
            missing(client.status(args.timeout())?.as_ref())
        );
    };
    let colliders = client.colliders(args.timeout())?.colliders;
    let snapshot = client.latest_snapshot(args.timeout())?;
    let particles = snapshot.as_ref().map_or(&[][..], |snapshot| snapshot.particles());
    let report = ForcesReport::new(&forces, &colliders, particles);
    if args.json { output::json(&report) } else { output::text(&report.text()) }
}

/// Returns the reason why a node has published no forces.
fn missing(status: Option<&NodeStatus>) -> &'static str {
    match status {
        Some(status) if status.is_replay() && status.is_paused() => {
            "the replay is paused, and forces are those of a step; run `ctl step` while this waits, or `ctl resume`. \
             Only a recording made with `recorder record --forces` has them"
        }
        Some(status) if status.is_replay() => "the recording has none (`recorder record --forces`)",
        Some(status) if status.is_paused() => {
            "it is paused, and forces are those of a step; run `ctl step` while this waits, or `ctl resume`"
        }
        _ => "is it stopped?",
    }
}

impl ForcesReport {
    fn new(forces: &Forces, colliders: &[ColliderState], particles: &[ParticleState]) -> Self {
        let report = |row: &ForceRow| ForceReport {
            index: row.index,
            shape: None,
            flags: None,
            force: forces.force(row),
            torque: Some(forces.torque(row)),
            contacts: None,
        };
        let collider = |row: &ForceRow| {
            let collider = colliders.get(row.index as usize);
            let shape = collider.and_then(|one| ColliderShape::from_number(one.shape));
            let shape = shape.map(ColliderShape::name);
            ForceReport { shape, contacts: Some(row.contacts), ..report(row) }
        };
        let particle = |row: &ForceRow| {
            let flags = particles.get(row.index as usize).map_or(0, |particle| particle.flags);
            let names = ParticleFlags::NAMES.iter().filter(|(bit, _)| flags & bit != 0);
            let flags = Some(names.map(|(_, name)| *name).collect());
            ForceReport { flags, torque: None, ..report(row) }
        };
        Self {
            step: forces.header.step,
            rate_hz: forces.header.rate_hz,
            colliders: forces.of_kind(ForceKind::Collider).map(collider).collect(),
            anchors: forces.of_kind(ForceKind::Anchor).map(report).collect(),
            particles: forces.of_kind(ForceKind::Particle).map(particle).collect(),
        }
    }

    fn text(&self) -> String {
        let number = |title| (title, Align::Right);
        let mut table = Table::new([
            ("on", Align::Left),
            number("fx (N)"),
            number("fy (N)"),
            number("fz (N)"),
            number("tx (N m)"),
            number("ty (N m)"),
            number("tz (N m)"),
            number("contacts"),
            ("", Align::Left),
        ]);
        let kinds = [
            ("collider", &self.colliders),
            ("anchor", &self.anchors),
            ("particle", &self.particles),
        ];
        for (kind, rows) in kinds {
            for row in rows {
                table.add(row.cells(kind));
            }
        }
        if kinds.iter().all(|(_, rows)| rows.is_empty()) {
            return format!(
                "step {}: no forces, because the scene has no collider and no anchor, and no particle is \
                 pinned or grabbed\n",
                self.step
            );
        }
        format!("step {}\n{}", self.step, table.text())
    }
}

impl ForceReport {
    /// Cells for people: rounded.
    fn cells(&self, kind: &str) -> [String; 9] {
        let rounded = |number: f64| format!("{number:.4}");
        let [fx, fy, fz] = self.force.map(rounded);
        let [tx, ty, tz] = self.torque.map_or_else(Default::default, |torque| torque.map(rounded));
        let contacts = self.contacts.map_or_else(String::new, |count| count.to_string());
        let words = self.shape.into_iter().chain(self.flags.iter().flatten().copied());
        let words = words.collect::<Vec<_>>().join(" ");
        [format!("{kind} {}", self.index), fx, fy, fz, tx, ty, tz, contacts, words]
    }
}

#[cfg(test)]
mod tests {
    use sim_contract::{ForcesHeader, StatusFlags};

    use super::*;

    fn forces() -> Forces {
        let row = |kind: ForceKind, index, contacts| ForceRow {
            kind: kind as u32,
            index,
            impulse: [0.0, -0.5, 0.25],
            angular_impulse: [0.125, 0.0, 0.0],
            contacts,
            spare: 0,
        };
        let rows = vec![
            row(ForceKind::Collider, 0, 7),
            row(ForceKind::Anchor, 0, 0),
            ForceRow { angular_impulse: [0.0; 3], ..row(ForceKind::Particle, 1, 0) },
        ];
        Forces { header: ForcesHeader { step: 9, rate_hz: 100, count: 3, run_id: 1 }, rows }
    }

    fn report() -> ForcesReport {
        let sphere =
            ColliderState { shape: ColliderShape::Sphere as u32, ..ColliderState::default() };
        let pinned = ParticleState { flags: ParticleFlags::PINNED, ..ParticleState::default() };
        ForcesReport::new(&forces(), &[sphere], &[ParticleState::default(), pinned])
    }

    #[test]
    fn a_force_is_the_impulse_of_a_step_times_its_rate() {
        let lines = [
            "step 9",
            "on          fx (N)    fy (N)   fz (N)  tx (N m)  ty (N m)  tz (N m)  contacts",
            "collider 0  0.0000  -50.0000  25.0000   12.5000    0.0000    0.0000         7  sphere",
            "anchor 0    0.0000  -50.0000  25.0000   12.5000    0.0000    0.0000",
            "particle 1  0.0000  -50.0000  25.0000                                          pinned",
        ];
        assert_eq!(report().text().lines().collect::<Vec<_>>(), lines);
        let force = serde_json::json!([0.0, -50.0, 25.0]);
        let torque = serde_json::json!([12.5, 0.0, 0.0]);
        let expected = serde_json::json!({
            "step": 9,
            "rate_hz": 100,
            "colliders":
                [{"index": 0, "shape": "sphere", "force": force, "torque": torque, "contacts": 7}],
            "anchors": [{"index": 0, "force": force, "torque": torque}],
            "particles": [{"index": 1, "flags": ["pinned"], "force": force}],
        });
        assert_eq!(serde_json::to_value(report()).unwrap(), expected);
    }

    #[test]
    fn a_scene_in_which_nothing_is_fixed_has_no_forces() {
        let report = ForcesReport::new(&Forces::default(), &[], &[]);
        assert_eq!(
            report.text(),
            "step 0: no forces, because the scene has no collider and no anchor, and no particle is pinned or \
             grabbed\n"
        );
    }

    #[test]
    fn a_node_without_forces_is_explained() {
        let status = |flags| NodeStatus { flags, ..NodeStatus::default() };
        assert!(missing(Some(&status(StatusFlags::PAUSED))).contains("ctl step"));
        assert!(missing(Some(&status(StatusFlags::REPLAY))).contains("the recording has none"));
        let paused = missing(Some(&status(StatusFlags::REPLAY | StatusFlags::PAUSED)));
        assert!(paused.contains("is paused") && paused.contains("`ctl resume`"), "{paused}");
        assert_eq!(missing(Some(&status(0))), missing(None));
    }
}
