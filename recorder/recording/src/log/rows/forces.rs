//! The row of `/forces`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim_messages::{ForceKind, ForceRow, PlainF32};

/// Three numbers, which JSON stores bit for bit.
type Vector = [PlainF32; 3];

/// The impulses of a step. A force is an impulse times the rate.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ForcesRow {
    /// The step in which the impulses acted.
    pub step: u64,
    /// By collider index.
    pub colliders: Vec<ColliderForceRow>,
    /// By anchor index.
    pub anchors: Vec<AnchorForceRow>,
    /// Indices of the pinned, grabbed and anchored particles.
    pub particles: Vec<u32>,
    /// Impulse of the constraints, bends and tethers of each of these particles, in N s.
    #[schemars(with = "Vec<[f32; 3]>")]
    pub impulses: Vec<Vector>,
}

/// The impulse on a collider.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ColliderForceRow {
    /// Of the particles in contact, in N s.
    #[schemars(with = "[f32; 3]")]
    pub impulse: Vector,
    /// About the center, in N m s.
    #[schemars(with = "[f32; 3]")]
    pub angular_impulse: Vector,
    /// Largest number of particles in contact in one substep.
    pub contacts: u32,
}

/// The impulse on an anchor: the sum of those on its particles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AnchorForceRow {
    /// In N s.
    #[schemars(with = "[f32; 3]")]
    pub impulse: Vector,
    /// About the center of the anchor, in N m s.
    #[schemars(with = "[f32; 3]")]
    pub angular_impulse: Vector,
}

impl ForcesRow {
    /// Returns the row of a published message, or `None` if an owner would publish it otherwise: in another
    /// order, or with a kind of another version.
    pub fn new(step: u64, rows: &[ForceRow]) -> Option<Self> {
        let mut all = Self { step, ..Self::default() };
        for row in rows {
            let impulse = row.impulse.map(PlainF32);
            let angular_impulse = row.angular_impulse.map(PlainF32);
            match row.kind()? {
                ForceKind::Collider => {
                    let contacts = row.contacts;
                    all.colliders.push(ColliderForceRow { impulse, angular_impulse, contacts });
                }
                ForceKind::Anchor => all.anchors.push(AnchorForceRow { impulse, angular_impulse }),
                ForceKind::Particle => {
                    all.particles.push(row.index);
                    all.impulses.push(impulse);
                }
            }
        }
        (all.rows() == rows).then_some(all)
    }

    /// Returns the rows as they were published.
    pub fn rows(&self) -> Vec<ForceRow> {
        let row = |kind: ForceKind, index, impulse: Vector| ForceRow {
            kind: kind as u32,
            index,
            impulse: impulse.map(|number| number.0),
            ..ForceRow::default()
        };
        let colliders = (0..).zip(&self.colliders).map(|(index, one)| ForceRow {
            angular_impulse: one.angular_impulse.map(|number| number.0),
            contacts: one.contacts,
            ..row(ForceKind::Collider, index, one.impulse)
        });
        let anchors = (0..).zip(&self.anchors).map(|(index, one)| ForceRow {
            angular_impulse: one.angular_impulse.map(|number| number.0),
            ..row(ForceKind::Anchor, index, one.impulse)
        });
        let particles = self.particles.iter().zip(&self.impulses);
        let particles = particles.map(|(index, one)| row(ForceKind::Particle, *index, *one));
        colliders.chain(anchors).chain(particles).collect()
    }

    /// Returns the problem of a row that no recorder writes.
    pub(crate) fn problem(&self) -> Option<&'static str> {
        if self.particles.len() != self.impulses.len() {
            return Some("its particles and impulses differ in number");
        }
        let is_ascending = self.particles.is_sorted_by(|one, next| one < next);
        (!is_ascending).then_some("its particles are not in ascending order")
    }

    /// Approximate heap size.
    pub(crate) fn size_bytes(&self) -> usize {
        size_of_val(self.colliders.as_slice())
            + size_of_val(self.anchors.as_slice())
            + size_of_val(self.particles.as_slice())
            + size_of_val(self.impulses.as_slice())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows() -> Vec<ForceRow> {
        let row = |kind: ForceKind, index| ForceRow {
            kind: kind as u32,
            index,
            impulse: [0.1, -0.0, 1e-40],
            ..ForceRow::default()
        };
        let angular_impulse = [1.0, -2.0, 0.3];
        vec![
            ForceRow { angular_impulse, contacts: 3, ..row(ForceKind::Collider, 0) },
            ForceRow { angular_impulse, ..row(ForceKind::Collider, 1) },
            ForceRow { angular_impulse, ..row(ForceKind::Anchor, 0) },
            row(ForceKind::Particle, 0),
            row(ForceKind::Particle, 13),
        ]
    }

    #[test]
    fn forces_survive_a_round_trip_through_json_bit_for_bit() {
        let text = serde_json::to_string(&ForcesRow::new(12, &rows()).unwrap()).unwrap();
        let expected = r#"{"step":12,"colliders":[{"impulse":[0.1,-0.0,1e-40],"angular_impulse":[1.0,-2.0,0.3],"contacts":3},"#;
        assert!(text.starts_with(expected), "{text}");
        let end = r#"],"particles":[0,13],"impulses":[[0.1,-0.0,1e-40],[0.1,-0.0,1e-40]]}"#;
        assert!(text.ends_with(end), "{text}");
        let read: ForcesRow = serde_json::from_str(&text).unwrap();
        let (read, written) = (read.rows(), rows());
        assert_eq!(
            bytemuck::cast_slice::<_, u8>(&read),
            bytemuck::cast_slice::<ForceRow, u8>(&written)
        );
    }

    #[test]
    fn rows_in_another_order_or_of_another_kind_make_no_row() {
        let mut swapped = rows();
        swapped.swap(1, 2);
        assert_eq!(ForcesRow::new(12, &swapped), None);
        let mut unknown = rows();
        unknown[4].kind = 3;
        assert_eq!(ForcesRow::new(12, &unknown), None);
        let mut missing = rows();
        missing.remove(0);
        assert_eq!(ForcesRow::new(12, &missing), None);
    }

    #[test]
    fn particles_are_ascending_and_each_has_an_impulse() {
        let row = |particles: &[u32], count| ForcesRow {
            particles: particles.to_vec(),
            impulses: vec![[PlainF32(0.5); 3]; count],
            ..ForcesRow::default()
        };
        assert_eq!(row(&[0, 13], 2).problem(), None);
        assert!(row(&[0, 13], 1).problem().unwrap().contains("differ in number"));
        assert!(row(&[13, 13], 2).problem().unwrap().contains("ascending"));
    }
}
