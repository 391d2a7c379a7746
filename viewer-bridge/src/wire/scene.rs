//! SCENE: everything that does not change until the next load.

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use sim_contract::{ConstraintState, ParticleState, Triangle};
use sim_solver::scene::{ColliderMesh, ColliderMeshes};

use super::frame::Bounds;
use super::writer::{Kind, Stamp, Writer};

/// The bits of a scene's flags.
pub mod scene_flag {
    /// The scene has two dimensions: z is 0.
    pub const PLANAR: u32 = 1;
}

/// A load with the positions of its first state.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scene {
    /// Load and step.
    pub stamp: Stamp,
    /// [`scene_flag`] bits.
    pub flags: u32,
    /// Steps per second.
    pub rate_hz: u32,
    /// Origin of all positions, for display.
    pub origin: [f64; 3],
    /// Positions at the step of the stamp.
    pub positions: Vec<[f32; 3]>,
    /// Ends of the constraints.
    pub ends: Vec<[u32; 2]>,
    /// Rest lengths of the constraints.
    pub rest_lengths: Vec<f32>,
    /// Corners of the triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Kinds of the constraints.
    pub kinds: Vec<u8>,
    /// Compliances of the constraints; their stiffness in a scene of the method pbd.
    pub compliances: Vec<f32>,
    /// Names.
    pub text: SceneText,
    /// Triangles of the colliders that are meshes.
    pub collider_meshes: ColliderMeshes,
}

/// The JSON of a scene.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SceneText {
    /// Name of the scene.
    pub name: String,
    /// Unit of lengths.
    pub unit: String,
    /// Direction of up: "y", "-y" or "z".
    pub up: String,
    /// Number of the run, 16 hexadecimal digits.
    pub run_id: String,
    /// The generated shapes.
    pub shapes: Vec<ShapeText>,
    /// The scene has bends that belong to no shape.
    #[serde(default)]
    pub has_explicit_bends: bool,
    /// The particles of each anchor.
    #[serde(default)]
    pub anchors: Vec<Vec<u32>>,
}

/// A generated shape of a scene, in its JSON.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShapeText {
    /// Name of the shape in scene files.
    pub shape: String,
    /// Index of its first particle.
    pub first: u64,
    /// Number of its particles.
    pub count: u64,
    /// It has bends.
    #[serde(default)]
    pub has_bends: bool,
}

impl Scene {
    /// Copies the geometry from the node's messages. Positions that are not finite become 0.
    pub fn set_geometry(
        &mut self,
        particles: &[ParticleState],
        constraints: &[ConstraintState],
        triangles: &[Triangle],
    ) {
        let finite = |axis: f32| if axis.is_finite() { axis } else { 0.0 };
        self.positions = particles.iter().map(|one| one.position.map(finite)).collect();
        self.ends = constraints.iter().map(|one| [one.a, one.b]).collect();
        self.rest_lengths = constraints.iter().map(|one| one.rest_length).collect();
        self.compliances = constraints.iter().map(|one| one.compliance).collect();
        self.kinds =
            constraints.iter().map(|one| u8::try_from(one.kind).unwrap_or(u8::MAX)).collect();
        self.triangles = triangles.iter().map(|one| one.corners).collect();
    }

    /// Bounding box of the positions.
    pub fn bounds(&self) -> Bounds {
        Bounds::around(self.positions.iter().copied())
    }

    /// Encodes the message.
    ///
    /// # Panics
    /// Never: the names have a JSON form.
    pub fn encode(&self) -> Bytes {
        #[allow(clippy::expect_used, reason = "a miss is a fault of the type")]
        let json = serde_json::to_vec(&self.text).expect("strings have a JSON form");
        let size = 100
            + 12 * self.positions.len()
            + 17 * self.ends.len()
            + 12 * self.triangles.len()
            + json.len()
            + self.collider_meshes.values().map(mesh_size_bytes).sum::<usize>();
        let Bounds { min, max } = self.bounds();
        let mut writer = Writer::new(Kind::Scene, self.stamp, size);
        writer.count(&self.positions);
        writer.count(&self.ends);
        writer.count(&self.triangles);
        writer.u32(self.flags);
        writer.vector(min);
        writer.vector(max);
        writer.u32(self.rate_hz);
        writer.count(&json);
        self.origin.iter().for_each(|axis| writer.f64(*axis));
        self.positions.iter().for_each(|position| writer.vector(*position));
        self.ends.iter().flatten().for_each(|end| writer.u32(*end));
        self.rest_lengths.iter().for_each(|length| writer.f32(*length));
        self.triangles.iter().flatten().for_each(|corner| writer.u32(*corner));
        writer.bytes(&self.kinds);
        writer.pad();
        writer.bytes(&json);
        writer.pad();
        writer.u32(index(self.collider_meshes.len()));
        for (collider, mesh) in &self.collider_meshes {
            writer.u32(index(*collider));
            writer.count(&mesh.vertices);
            writer.count(&mesh.triangles);
            mesh.vertices.iter().for_each(|vertex| writer.vector(*vertex));
            mesh.triangles.iter().flatten().for_each(|corner| writer.u32(*corner));
        }
        self.compliances.iter().for_each(|compliance| writer.f32(*compliance));
        writer.finish()
    }
}

fn mesh_size_bytes(mesh: &ColliderMesh) -> usize {
    12 + 12 * mesh.vertices.len() + 12 * mesh.triangles.len()
}

#[allow(clippy::cast_possible_truncation, reason = "a scene has at most 65,536 colliders")]
fn index(number: usize) -> u32 {
    number as u32
}
