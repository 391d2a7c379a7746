//! Warnings about particles.

use sim_scene::model::Model;
use sim_scene::scene::{Scene, Shape};

use crate::contacts::obstacle::SolidsAtLoad;

/// Distance from the scene's origin, in m, beyond which f32 positions make a scene at rest jitter.
const NEAR_ORIGIN: f32 = 100.0;
/// Standard gravity in m/s^2. A scene in a smaller unit has a greater one.
const GRAVITY: f32 = 9.81;
/// Ratio of masses beyond which small steps converge visibly slower.
const MASS_RATIO_LARGE: f32 = 1e3;

pub(super) fn none(model: &Model) -> Option<String> {
    model.particles.is_empty().then(|| "the scene has no particles".to_owned())
}

pub(super) fn far_from_origin(scene: &Scene, model: &Model) -> Option<String> {
    let coordinates = model.particles.iter().flat_map(|one| one.position);
    let farthest =
        coordinates.fold(0.0, |most: f32, one| if one.abs() > most { one.abs() } else { most });
    let [x, y, z] = scene.gravity;
    let unit_scale = (x * x + y * y + z * z).sqrt() / GRAVITY;
    let near = NEAR_ORIGIN * if unit_scale > 1.0 { unit_scale } else { 1.0 };
    let has_mesh = scene.generators.iter().any(|one| matches!(one.shape, Shape::Obj(_)));
    let cure = if has_mesh {
        "give a mesh in another unit a `scale`, such as 0.01 for centimetres, and put the distance of a mesh in \
         the scene's unit into `origin`"
    } else {
        "put the distance into `origin`"
    };
    (farthest > near).then(|| {
        format!(
            "a coordinate reaches {farthest} {unit} from the origin: beyond {near:.0} {unit} a \
             scene at rest jitters; {cure}",
            unit = scene.unit
        )
    })
}

pub(super) fn unequal_masses(model: &Model) -> Option<String> {
    let masses = || model.particles.iter().map(|one| one.mass);
    let heaviest = masses().fold(0.0, |most: f32, one| if one > most { one } else { most });
    let lightest = masses().fold(f32::INFINITY, |least, one| if one < least { one } else { least });
    (heaviest / lightest > MASS_RATIO_LARGE).then(|| {
        format!(
            "masses range from {lightest} to {heaviest} kg: constraints between light and heavy \
             particles converge slowly; use more substeps"
        )
    })
}

pub(super) fn pinned_and_anchored(scene: &Scene, model: &Model) -> Option<String> {
    let anchored = scene.anchors.iter().flat_map(|anchor| &anchor.particles);
    let mut both = anchored.filter(|particle| model.particles[**particle as usize].pinned);
    let particle = both.next()?;
    Some(format!("particle {particle} is pinned and follows an anchor: the pin has no effect"))
}

/// By particle: true if it is pinned or follows an anchor.
fn are_fixed(scene: &Scene, model: &Model) -> Vec<bool> {
    let mut is_fixed: Vec<_> = model.particles.iter().map(|particle| particle.pinned).collect();
    for particle in scene.anchors.iter().flat_map(|anchor| &anchor.particles) {
        is_fixed[*particle as usize] = true;
    }
    is_fixed
}

/// Particles of a shape, or explicit ones, that start where particles of others do.
#[derive(Default)]
struct Coincident {
    count: u32,
    /// The first of them, and the other particle at its place.
    first: Option<[u32; 2]>,
    is_any_free: bool,
}

/// Warns of particles that start where explicit particles or particles of other shapes do: one sentence for the
/// explicit ones, and one for each shape. Particles that a constraint joins where they are may coincide, and so may
/// fixed ones.
pub(super) fn coincident(scene: &Scene, model: &Model) -> Vec<String> {
    let explicit_count = scene.particles.len() as u64;
    let counts = scene.generators.iter().map(|one| one.shape.particle_count());
    let counts: Vec<_> = std::iter::once(explicit_count).chain(counts).collect();
    let ends: Vec<_> = counts
        .iter()
        .scan(0, |end, count| {
            *end += count;
            Some(*end)
        })
        .collect();
    let block = |particle: u32| ends.partition_point(|end| *end <= u64::from(particle));
    let mut is_joined = vec![false; model.particles.len()];
    for [a, b] in model.pairs().filter(|[a, b]| model.distance(*a, *b) == 0.0) {
        (is_joined[a as usize], is_joined[b as usize]) = (true, true);
    }
    let is_fixed = are_fixed(scene, model);
    let place = |particle: &u32| {
        model.particles[*particle as usize].position.map(|axis| (axis + 0.0).to_bits())
    };
    let mut particles: Vec<_> = (0..model.particle_count()).collect();
    particles.sort_unstable_by_key(|particle| (place(particle), *particle));
    let mut found: Vec<_> = counts.iter().map(|_| Coincident::default()).collect();
    for group in particles.chunk_by(|a, b| place(a) == place(b)) {
        let (first, others) = (group[0], group[1..].iter().copied());
        let is_explicit = block(first) == 0;
        let are_apart = |other: u32| is_explicit || block(other) != block(first);
        for other in others.filter(|other| are_apart(*other) && !is_joined[*other as usize]) {
            let coincident = &mut found[block(other)];
            coincident.count += 1;
            let pair = [other, first];
            coincident.first = coincident.first.map(|one| one.min(pair)).or(Some(pair));
            coincident.is_any_free |= pair.iter().any(|one| !is_fixed[*one as usize]);
        }
    }
    let found = found.into_iter().zip(counts).enumerate();
    found.filter_map(|(block, (one, count))| coincident_sentence(block, &one, count)).collect()
}

/// `count` is the number of particles of the block, of which the first one is that of the explicit particles.
fn coincident_sentence(block: usize, one: &Coincident, count: u64) -> Option<String> {
    let [other, first] = one.first.filter(|_| one.is_any_free)?;
    let particles = match (block.checked_sub(1), one.count) {
        (None, 1) => "1 particle starts".to_owned(),
        (None, number) => format!("{number} particles start"),
        (Some(index), number) if u64::from(number) == count => {
            format!("generate[{index}]: all of its {number} particles start")
        }
        (Some(index), 1) => format!("generate[{index}]: 1 of its {count} particles starts"),
        (Some(index), number) => {
            format!("generate[{index}]: {number} of its {count} particles start")
        }
    };
    Some(format!(
        "{particles} where another one does (particle {other} where particle {first} is), and nothing holds them \
         together: move them apart, or join each two by a constraint"
    ))
}

/// A free particle inside a collider at load.
struct Inside {
    particle: usize,
    collider: usize,
    depth: f32,
}

/// Names the deepest particle, because it is pushed farthest.
pub(super) fn inside_collider(scene: &Scene, model: &Model) -> Option<String> {
    let is_fixed = are_fixed(scene, model);
    let free = (0..is_fixed.len()).filter(|particle| !is_fixed[*particle]);
    let is_planar = scene.dimensions == 2;
    let colliders: Vec<_> =
        scene.colliders.iter().map(|one| SolidsAtLoad::new(one, is_planar)).collect();
    let inside: Vec<_> = free.filter_map(|one| deepest_collider(&colliders, model, one)).collect();
    let Inside { particle, collider, depth } =
        inside.iter().rev().max_by(|a, b| a.depth.total_cmp(&b.depth))?;
    let count = match inside.len() {
        1 => "1 particle starts".to_owned(),
        count => format!("{count} particles start"),
    };
    Some(format!(
        "{count} inside a collider; the deepest is particle {particle}, {depth} {unit} inside \
         collider {collider}: the first step pushes it out at once",
        unit = scene.unit
    ))
}

/// Returns the collider that a particle is deepest inside of; the first of several.
fn deepest_collider(colliders: &[SolidsAtLoad], model: &Model, particle: usize) -> Option<Inside> {
    let position = model.particles[particle].position;
    let depths = colliders.iter().enumerate().filter_map(|(collider, one)| {
        Some(Inside { particle, collider, depth: one.depth(position)? })
    });
    depths.reduce(|deepest, one| if one.depth > deepest.depth { one } else { deepest })
}
