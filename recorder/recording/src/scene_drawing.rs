//! `/scene`: the drawing of sticks, surface and colliders.

mod solids;

use prost::Message as _;
use sim_messages::{ColliderState, ParticleState, TornConstraint};
use sim_solver::TornSides;
use sim_solver::scene::ColliderMeshes;

use crate::log::WORLD_FRAME;
use crate::log::encoding::protobuf::timestamp;
use crate::log::encoding::scene_messages::{
    Color, LINE_LIST, LinePrimitive, Point3, SceneEntity, SceneUpdate, TriangleListPrimitive,
};
use solids::{IDENTITY, PlaneExtent};

/// Name of the topic, whose format is that of [`scene_format`](crate::scene_format).
pub const SCENE_TOPIC: &str = "/scene";
/// Width of a stick in pixels, at any distance.
const STICK_WIDTH_PX: f64 = 1.5;
const STICK_COLOR: Color = Color { r: 0.45, g: 0.6, b: 0.75, a: 1.0 };
const SURFACE_COLOR: Color = Color { r: 0.72, g: 0.2, b: 0.18, a: 0.85 };

/// The constraints and triangles of a load.
#[derive(Debug, Clone, Default)]
pub struct DrawnMesh {
    /// Particles of each constraint.
    pub ends: Vec<[u32; 2]>,
    /// Particles of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Triangles of the colliders that are meshes.
    pub collider_meshes: ColliderMeshes,
    /// Least and greatest coordinates of the first state, which planes extend beyond.
    pub bounds: [[f32; 3]; 2],
}

/// The drawing of a load: its constraints and triangles, without the torn ones, and its colliders.
#[derive(Debug, Default)]
pub struct SceneDrawing {
    mesh: DrawnMesh,
    is_torn: Vec<bool>,
    /// The sides of the triangles. A triangle with a torn side is not drawn.
    sides: TornSides,
    colliders: Vec<ColliderState>,
    /// The last encoded message had the meshes where they are.
    are_meshes_known: bool,
    plane_extent: PlaneExtent,
}

impl SceneDrawing {
    /// Creates the drawing of a load without torn constraints.
    pub fn new(mesh: DrawnMesh) -> Self {
        Self {
            is_torn: vec![false; mesh.ends.len()],
            sides: TornSides::of_triangles(
                mesh.ends.iter().copied(),
                mesh.triangles.iter().copied(),
            ),
            colliders: Vec::new(),
            are_meshes_known: false,
            plane_extent: PlaneExtent::around(mesh.bounds),
            mesh,
        }
    }

    /// Replaces the colliders.
    pub fn set_colliders(&mut self, colliders: &[ColliderState]) {
        self.are_meshes_known &= solids::have_same_meshes(&self.colliders, colliders);
        self.colliders = colliders.to_vec();
    }

    /// Replaces the list of torn constraints.
    pub fn set_torn(&mut self, torn: &[TornConstraint]) {
        self.is_torn.fill(false);
        for one in torn {
            if let Some(is_torn) = self.is_torn.get_mut(one.constraint as usize) {
                *is_torn = true;
            }
        }
        let torn = (0_u32..).zip(&self.is_torn).filter(|(_, is_torn)| **is_torn);
        self.sides.set_torn(torn.map(|(constraint, _)| constraint));
    }

    /// Draws a state as a message on `/scene`. The entities have the same ids each time, so each replaces
    /// its predecessor. `time_ns` is the time of the step, in nanoseconds since 1970.
    pub fn encode(&mut self, time_ns: u64, particles: &[ParticleState]) -> Vec<u8> {
        self.are_meshes_known = true;
        let mut update = self.draw(time_ns, particles);
        update.entities.push(self.draw_meshes(time_ns));
        update.encode_to_vec()
    }

    /// Draws a state like [`Self::encode`], for a viewer that has received the messages before. It leaves out
    /// the meshes unless they have moved: an entity without a lifetime stays until another one of its id
    /// replaces it.
    pub fn encode_changes(&mut self, time_ns: u64, particles: &[ParticleState]) -> Vec<u8> {
        if self.are_meshes_known {
            self.draw(time_ns, particles).encode_to_vec()
        } else {
            self.encode(time_ns, particles)
        }
    }

    fn draw_meshes(&self, time_ns: u64) -> SceneEntity {
        let triangles = solids::draw_meshes(&self.colliders, &self.mesh.collider_meshes);
        SceneEntity { triangles, ..entity("meshes", time_ns) }
    }

    fn draw(&self, time_ns: u64, particles: &[ParticleState]) -> SceneUpdate {
        let has_place = |particle: &u32| {
            let particle = particles.get(*particle as usize);
            particle.is_some_and(|one| one.position.iter().all(|axis| axis.is_finite()))
        };
        let is_left = |constraint: u32| !self.is_torn[constraint as usize];
        let sticks = remaining(&self.mesh.ends, is_left, has_place);
        let is_whole = |triangle| self.sides.is_whole(triangle);
        let triangles = remaining(&self.mesh.triangles, is_whole, has_place);
        let points = points(particles);
        let surface = TriangleListPrimitive {
            pose: Some(IDENTITY),
            points: if triangles.is_empty() { Vec::new() } else { points.clone() },
            color: Some(SURFACE_COLOR),
            indices: triangles,
        };
        let sticks = LinePrimitive {
            r#type: LINE_LIST,
            pose: Some(IDENTITY),
            thickness: STICK_WIDTH_PX,
            scale_invariant: true,
            points: if sticks.is_empty() { Vec::new() } else { points },
            color: Some(STICK_COLOR),
            indices: sticks,
        };
        let mut colliders = entity("colliders", time_ns);
        solids::draw(&self.colliders, self.plane_extent, &mut colliders);
        SceneUpdate {
            entities: vec![
                SceneEntity { lines: vec![sticks], ..entity("sticks", time_ns) },
                SceneEntity { triangles: vec![surface], ..entity("surface", time_ns) },
                colliders,
            ],
        }
    }
}

/// Returns the particles of the elements that are left and whose particles all have a finite position.
fn remaining<const N: usize>(
    elements: &[[u32; N]],
    is_left: impl Fn(u32) -> bool,
    has_place: impl Fn(&u32) -> bool,
) -> Vec<u32> {
    let elements = (0_u32..).zip(elements);
    let left =
        elements.filter(|(index, element)| is_left(*index) && element.iter().all(&has_place));
    left.flat_map(|(_, element)| *element).collect()
}

/// Converts the positions. A position that is not finite keeps its index but is not drawn.
fn points(particles: &[ParticleState]) -> Vec<Point3> {
    let finite = |axis: f32| if axis.is_finite() { f64::from(axis) } else { 0.0 };
    let positions = particles.iter().map(|particle| particle.position.map(finite));
    positions.map(|[x, y, z]| Point3 { x, y, z }).collect()
}

fn entity(id: &str, time_ns: u64) -> SceneEntity {
    SceneEntity {
        timestamp: Some(timestamp(time_ns)),
        frame_id: WORLD_FRAME.to_owned(),
        id: id.to_owned(),
        ..SceneEntity::default()
    }
}

#[cfg(test)]
mod tests {
    use sim_messages::ColliderShape;
    use sim_solver::scene::ColliderMesh;

    use super::*;

    fn particles() -> Vec<ParticleState> {
        let at =
            |x: f32, y: f32| ParticleState { position: [x, y, 0.0], ..ParticleState::default() };
        vec![at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0), at(1.0, 1.0)]
    }

    fn drawing() -> SceneDrawing {
        SceneDrawing::new(DrawnMesh {
            ends: vec![[0, 1], [1, 2], [2, 3], [2, 1], [0, 1]],
            triangles: vec![[0, 1, 2], [3, 2, 1]],
            ..DrawnMesh::default()
        })
    }

    fn indices(update: &SceneUpdate) -> (&[u32], &[u32]) {
        (&update.entities[0].lines[0].indices, &update.entities[1].triangles[0].indices)
    }

    #[test]
    fn sticks_and_triangles_are_drawn_at_the_particles() {
        let update = drawing().draw(1_500_000_000, &particles());
        assert_eq!(
            indices(&update),
            (&[0, 1, 1, 2, 2, 3, 2, 1, 0, 1][..], &[0, 1, 2, 3, 2, 1][..])
        );
        let point = update.entities[0].lines[0].points[3];
        assert_eq!((point.x, point.y, point.z), (1.0, 1.0, 0.0));
        assert_eq!(update.entities[0].frame_id, "world");
    }

    #[test]
    fn torn_constraints_and_triangles_with_a_torn_side_are_not_drawn() {
        let mut drawing = drawing();
        let torn = |list: &[u32]| {
            list.iter().map(|one| TornConstraint::new(*one, None)).collect::<Vec<_>>()
        };
        drawing.set_torn(&torn(&[2, 99]));
        let sticks = &[0, 1, 1, 2, 2, 1, 0, 1][..];
        assert_eq!(indices(&drawing.draw(0, &particles())), (sticks, &[0, 1, 2][..]));
        // The other constraints between the same particles still hold these sides.
        drawing.set_torn(&torn(&[3, 4, 4]));
        let all = &[0, 1, 2, 3, 2, 1][..];
        assert_eq!(indices(&drawing.draw(0, &particles())), (&[0, 1, 1, 2, 2, 3][..], all));
        drawing.set_torn(&torn(&[1, 3]));
        assert_eq!(indices(&drawing.draw(0, &particles())).1.len(), 0, "the common side");
        drawing.set_torn(&[]);
        assert_eq!(indices(&drawing.draw(0, &particles())).1.len(), 6);
    }

    #[test]
    fn changes_have_the_meshes_only_after_a_motion() {
        let mesh = ColliderMesh {
            vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2]],
            is_solid: false,
        };
        let collider_meshes = [(1, mesh)].into();
        let mut drawing = SceneDrawing::new(DrawnMesh { collider_meshes, ..DrawnMesh::default() });
        let rotation = [0.0, 0.0, 0.0, 1.0];
        let with = |shape: ColliderShape, x: f32| {
            let center = [x, 0.0, 0.0];
            ColliderState { shape: shape as u32, center, rotation, ..ColliderState::default() }
        };
        let colliders =
            |ball, mesh| [with(ColliderShape::Sphere, ball), with(ColliderShape::Mesh, mesh)];
        let meshes = |message: Vec<u8>| {
            let entities = SceneUpdate::decode(message.as_slice()).unwrap().entities;
            assert_eq!(entities.iter().filter(|one| one.id == "colliders").count(), 1);
            let found = entities.into_iter().find(|one| one.id == "meshes");
            found.map(|entity| entity.triangles[0].pose.unwrap().position.unwrap().x)
        };
        drawing.set_colliders(&colliders(0.0, 5.0));
        assert_eq!(meshes(drawing.encode_changes(0, &[])), Some(5.0));
        assert_eq!(meshes(drawing.encode_changes(1, &[])), None);
        drawing.set_colliders(&colliders(1.0, 5.0));
        assert_eq!(meshes(drawing.encode_changes(2, &[])), None, "only the ball has moved");
        assert_eq!(meshes(drawing.encode(3, &[])), Some(5.0), "whole messages have everything");
        drawing.set_colliders(&colliders(1.0, 6.0));
        assert_eq!(meshes(drawing.encode_changes(4, &[])), Some(6.0));
        // The next load has no mesh, so it replaces the entity by an empty one.
        let message = SceneDrawing::default().encode_changes(5, &[]);
        let entities = SceneUpdate::decode(message.as_slice()).unwrap().entities;
        assert!(entities.iter().any(|one| one.id == "meshes" && one.triangles.is_empty()));
    }

    #[test]
    fn elements_of_a_particle_that_is_not_finite_are_not_drawn() {
        let mut particles = particles();
        particles[3].position[1] = f32::NAN;
        let update = drawing().draw(0, &particles);
        assert_eq!(indices(&update), (&[0, 1, 1, 2, 2, 1, 0, 1][..], &[0, 1, 2][..]));
        assert!(update.entities[0].lines[0].points.iter().all(|point| point.y.is_finite()));
    }
}
