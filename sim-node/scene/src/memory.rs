//! The memory that a scene takes, estimated from its text before anything of its size is allocated.

use thiserror::Error;

use super::definition::Scene;
use super::definition::settings::ConstraintOrder;
use super::definition::settings::ContactMode;
use super::generate::{Generator, Shape};
use super::model::ModelSize;

// Largest memory of a solver with one thread for each element, in bytes, also while it is built and while forces are
// measured. A test compares the sum with the memory of scenes of every kind.

/// A particle, outside of what is counted below.
const PARTICLE_BYTES: u64 = 200;
/// A place in the rows of a sheet.
const SHEET_PLACE_BYTES: u64 = 62;
const ROPE_PLACE_BYTES: u64 = 32;
/// Numbers in a cache line.
const LINE_LENGTH: u64 = 16;
/// A generated sheet or rope, however small.
const PATCH_BYTES: u64 = 1700;
const SHEET_CONSTRAINT_BYTES: u64 = 60;
/// A constraint of a sheet in the order of the file.
const LISTED_CONSTRAINT_BYTES: u64 = 75;
const LOOSE_CONSTRAINT_BYTES: u64 = 120;
const SHEET_BEND_BYTES: u64 = 125;
const LOOSE_BEND_BYTES: u64 = 400;
const TRIANGLE_BYTES: u64 = 20;
/// A triangle in a scene with wind.
const WINDY_TRIANGLE_BYTES: u64 = 65;
/// A tether of a particle.
const TETHER_BYTES: u64 = 130;
/// A particle that touches others, with its room for pairs.
const PARTICLE_CONTACT_BYTES: u64 = 450;
const SURFACE_CONTACT_BYTES: u64 = 1300;
const SURFACE_TRIANGLE_BYTES: u64 = 60;
/// The path of a particle that touches others, or of a place of the padding.
const PATH_BYTES: u64 = 50;
/// A particle that can touch a mesh, in each thread.
const NEAR_MESH_BYTES: u64 = 250;
/// A particle that can touch a body.
const NEAR_BODY_BYTES: u64 = 270;
/// A triangle of a collider, with the tree above it.
const MESH_TRIANGLE_BYTES: u64 = 1300;
/// Room for the pairs of one particle that several threads find, all together.
const SHARED_PARTICLE_CONTACT_BYTES: u64 = 520;
const SHARED_SURFACE_CONTACT_BYTES: u64 = 1950;

/// Part of the estimate that is added to it, for what the allocator takes and for scenes unlike those measured.
const MARGIN_PART: u64 = 8;
/// Added besides, for the program and its threads.
const MARGIN_BYTES: u64 = 8 << 20;

// Size of an element in a message.
const PARTICLE_MESSAGE_BYTES: u64 = 32;
const CONSTRAINT_MESSAGE_BYTES: u64 = 24;
const BEND_MESSAGE_BYTES: u64 = 64;
const TRIANGLE_MESSAGE_BYTES: u64 = 12;

/// Size of a piece in which memory is reserved. The system refuses one that is larger than all of its memory, although
/// a program that touches only a part of it would run.
const PIECE_BYTES: u64 = 256 << 20;

/// Largest memory to read a byte of text, beyond a fixed amount: of many short tables.
const BYTES_PER_BYTE: usize = 100;
/// Largest memory to read a text of any size, in bytes.
const READING_BYTES_MAX: usize = 240 << 20;

/// Returns the largest memory to read a text of this size, in bytes.
pub(super) fn reading_bytes(size_bytes: usize) -> u64 {
    (BYTES_PER_BYTE * size_bytes + (1 << 20)).min(READING_BYTES_MAX) as u64
}

/// Error of a scene that the process cannot run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error(
    "not enough memory: the scene takes about {needed_mib} MiB more; free memory, raise the limit of the process \
     (`ulimit -v`), or make the scene smaller"
)]
pub struct NotEnoughMemory {
    /// Memory that the scene takes, beside the memory that the process has already.
    pub needed_mib: u64,
}

/// Checks that the process can get this much more memory.
///
/// # Errors
/// It cannot. An allocation that fails would abort it.
pub fn check_memory(needed_bytes: u64) -> Result<(), NotEnoughMemory> {
    // The memory of WebAssembly never shrinks, so a reservation would keep it.
    if cfg!(target_family = "wasm") {
        return Ok(());
    }
    // Reserved and given back, but never touched, so that it costs nothing.
    let reserve = |piece_bytes: u64| {
        let mut piece = Vec::<u8>::new();
        let length = usize::try_from(piece_bytes).unwrap_or(usize::MAX);
        piece.try_reserve_exact(length).is_ok().then_some(piece)
    };
    let pieces = (0..needed_bytes / PIECE_BYTES).map(|_| PIECE_BYTES);
    let pieces: Option<Vec<_>> = pieces.chain([needed_bytes % PIECE_BYTES]).map(reserve).collect();
    match pieces {
        Some(_) => Ok(()),
        None => Err(NotEnoughMemory { needed_mib: needed_bytes.div_ceil(1 << 20) }),
    }
}

/// Returns the further memory that several threads take to find contacts. One thread needs none of it.
pub fn thread_bytes(scene: ThreadedScene, threads: usize) -> u64 {
    let near_meshes = if scene.has_meshes { NEAR_MESH_BYTES * threads as u64 } else { 0 };
    let shares = match scene.contact_mode {
        ContactMode::Off => 0,
        ContactMode::Particles => SHARED_PARTICLE_CONTACT_BYTES,
        ContactMode::Surfaces => SHARED_SURFACE_CONTACT_BYTES,
    };
    with_margin(scene.particle_count as u64 * (near_meshes + shares))
}

/// Properties of a running scene on which the memory of its threads depends.
#[derive(Debug, Clone, Copy)]
pub struct ThreadedScene {
    /// Number of particles.
    pub particle_count: usize,
    /// The parts that touch each other.
    pub contact_mode: ContactMode,
    /// True if a collider is a mesh.
    pub has_meshes: bool,
}

fn with_margin(bytes: u64) -> u64 {
    bytes + bytes / MARGIN_PART + MARGIN_BYTES
}

impl Scene {
    /// Checks that the process can get the memory of a solver of this scene, and of something beside it.
    ///
    /// # Errors
    /// It cannot. Building the solver would abort it.
    pub fn check_memory(&self, beside_bytes: u64) -> Result<(), NotEnoughMemory> {
        check_memory(self.memory_bytes() + beside_bytes)
    }

    /// Returns the memory that a solver of this scene takes with one thread: at least what it needs at any time, and an
    /// eighth and 8 MiB more, where an allocator and scenes unlike the measured ones have room. Without this margin, the estimate is
    /// 0.95 to 1.2 times the need, and up to 1.6 times the need of sheets without constraints and of meshes with tethers.
    pub fn memory_bytes(&self) -> u64 {
        let explicit = self.particles.len() as u64 * (PARTICLE_BYTES + self.particle_bytes())
            + self.constraints.len() as u64 * LOOSE_CONSTRAINT_BYTES
            + self.bends.len() as u64 * LOOSE_BEND_BYTES;
        let generated: u64 = self.generators.iter().map(|one| self.generator_bytes(one)).sum();
        let meshes = self.colliders.iter().filter_map(|collider| collider.mesh.as_ref());
        let triangles: usize = meshes.map(|mesh| mesh.triangles.len()).sum();
        with_margin(explicit + generated + triangles as u64 * MESH_TRIANGLE_BYTES)
    }

    /// Returns the size of all particles, constraints, bends and triangles in messages, in bytes.
    pub fn published_bytes(&self) -> u64 {
        let ModelSize { constraints, bends, triangles } = self.model_size();
        self.particle_count() * PARTICLE_MESSAGE_BYTES
            + constraints as u64 * CONSTRAINT_MESSAGE_BYTES
            + bends as u64 * BEND_MESSAGE_BYTES
            + triangles as u64 * TRIANGLE_MESSAGE_BYTES
    }

    /// Returns the memory to expand the scene into its elements, in bytes. They take less than twice their messages.
    pub(super) fn model_bytes(&self) -> u64 {
        2 * self.published_bytes()
    }

    fn generator_bytes(&self, Generator { shape, .. }: &Generator) -> u64 {
        let is_listed = self.solver.order == ConstraintOrder::Listed;
        let places = place_count(shape);
        let (patch, place, constraint, bend) = match shape {
            Shape::Rope(_) => {
                (PATCH_BYTES, ROPE_PLACE_BYTES, SHEET_CONSTRAINT_BYTES, LOOSE_BEND_BYTES)
            }
            Shape::Cloth(_) | Shape::Mesh(_) => {
                (PATCH_BYTES, SHEET_PLACE_BYTES, SHEET_CONSTRAINT_BYTES, SHEET_BEND_BYTES)
            }
            _ => (0, 0, LOOSE_CONSTRAINT_BYTES, LOOSE_BEND_BYTES),
        };
        let constraint =
            if is_listed { constraint.max(LISTED_CONSTRAINT_BYTES) } else { constraint };
        let wind = if self.wind.is_some() { WINDY_TRIANGLE_BYTES } else { 0 };
        let contact = match self.contact.mode {
            ContactMode::Surfaces => SURFACE_TRIANGLE_BYTES,
            ContactMode::Off | ContactMode::Particles => 0,
        };
        let path = if self.contact.mode == ContactMode::Off { 0 } else { PATH_BYTES };
        patch
            + shape.particle_count() * (PARTICLE_BYTES + self.particle_bytes() - path)
            + places * (place + path)
            + shape.constraint_count() * constraint
            + shape.bend_count() * bend
            + shape.triangle_count() * (TRIANGLE_BYTES + wind + contact)
    }

    /// Memory of a particle for contacts and tethers.
    fn particle_bytes(&self) -> u64 {
        let contact = match self.contact.mode {
            ContactMode::Off => 0,
            ContactMode::Particles => PARTICLE_CONTACT_BYTES + PATH_BYTES,
            ContactMode::Surfaces => SURFACE_CONTACT_BYTES + PATH_BYTES,
        };
        let tethers = u64::from(self.solver.tethers) * TETHER_BYTES;
        let has_meshes = self.colliders.iter().any(|collider| collider.mesh.is_some());
        let near_mesh = if has_meshes { NEAR_MESH_BYTES } else { 0 };
        let has_bodies = self.colliders.iter().any(|collider| collider.body.is_some());
        contact + tethers + near_mesh + if has_bodies { NEAR_BODY_BYTES } else { 0 }
    }
}

/// Number of places for the particles of a shape. A row of a sheet has whole cache lines, and one more.
fn place_count(shape: &Shape) -> u64 {
    let row_places = |columns: u32| u64::from(columns).next_multiple_of(LINE_LENGTH) + LINE_LENGTH;
    match shape {
        Shape::Cloth(cloth) | Shape::Mesh(cloth) => {
            row_places(cloth.columns) * u64::from(cloth.rows)
        }
        Shape::Rope(rope) => row_places(rope.count),
        Shape::Web(_) | Shape::Bridge(_) | Shape::Ragdoll(_) | Shape::Obj(_) => {
            shape.particle_count()
        }
    }
}
