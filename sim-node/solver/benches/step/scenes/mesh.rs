//! A closed surface as a modelling program exports it: a torus of irregular triangles, as OBJ text.

use std::f64::consts::TAU;

/// Vertices around the ring, and around its tube: 10,000.
const AROUND_RING: usize = 125;
const AROUND_TUBE: usize = 80;
/// Radii of the ring and of its tube, in m.
const RING_RADIUS: f64 = 1.0;
const TUBE_RADIUS: f64 = 0.4;
/// Offset of a vertex from its regular place, as a fraction of the distance to the next one.
const JITTER: f64 = 0.3;

/// Numbering of vertices and faces.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Numbering {
    /// Neighbours mostly have close numbers.
    AsBuilt,
    /// Random: neighbours are far apart in memory.
    Shuffled,
}

/// Returns the OBJ text of an upright torus about the z axis.
pub(crate) fn torus(numbering: Numbering) -> String {
    let mut random = Random(1);
    let mut vertices = vertices(&mut random);
    let mut faces = faces(&mut random);
    if matches!(numbering, Numbering::Shuffled) {
        shuffle(&mut vertices, &mut faces, &mut random);
    }
    let mut text = String::new();
    for [x, y, z] in vertices {
        text += &format!("v {x} {y} {z}\n");
    }
    for [a, b, c] in faces {
        text += &format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    }
    text
}

fn vertices(random: &mut Random) -> Vec<[f64; 3]> {
    let mut vertex = |index: usize| {
        let (ring, tube) = (index / AROUND_TUBE, index % AROUND_TUBE);
        let mut angle = |place: usize, count: usize| {
            TAU * (place as f64 + JITTER * (2.0 * random.share() - 1.0)) / count as f64
        };
        let (ring, tube) = (angle(ring, AROUND_RING), angle(tube, AROUND_TUBE));
        let radius = RING_RADIUS + TUBE_RADIUS * tube.cos();
        [radius * ring.cos(), radius * ring.sin(), TUBE_RADIUS * tube.sin()]
    };
    (0..AROUND_RING * AROUND_TUBE).map(&mut vertex).collect()
}

/// Returns two triangles per cell, split along a random diagonal.
fn faces(random: &mut Random) -> Vec<[usize; 3]> {
    let mut faces = Vec::new();
    for ring in 0..AROUND_RING {
        for tube in 0..AROUND_TUBE {
            let at =
                |ring: usize, tube: usize| (ring % AROUND_RING) * AROUND_TUBE + tube % AROUND_TUBE;
            let [a, b] = [at(ring, tube), at(ring + 1, tube)];
            let [c, d] = [at(ring + 1, tube + 1), at(ring, tube + 1)];
            let cell =
                if random.share() < 0.5 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
            faces.extend(cell);
        }
    }
    faces
}

/// Renumbers the vertices and reorders the faces.
fn shuffle(vertices: &mut Vec<[f64; 3]>, faces: &mut [[usize; 3]], random: &mut Random) {
    let mut olds: Vec<_> = (0..vertices.len()).collect();
    random.shuffle(&mut olds);
    let mut news = vec![0; olds.len()];
    for (new, old) in olds.iter().enumerate() {
        news[*old] = new;
    }
    *vertices = olds.iter().map(|old| vertices[*old]).collect();
    for face in faces.iter_mut() {
        *face = face.map(|old| news[old]);
    }
    random.shuffle(faces);
}

/// Reproducible random numbers: a linear congruential generator with the constants of Knuth's MMIX.
struct Random(u64);

impl Random {
    /// Returns a number between 0 and 1.
    fn share(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        // The upper 32 bits, because the lower ones repeat soon.
        (self.0 >> 32) as f64 / 4_294_967_296.0
    }

    /// Shuffles by the method of Fisher and Yates.
    fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "an index from 0 to the last"
            )]
            let other = (self.share() * (last + 1) as f64) as usize;
            items.swap(last, other);
        }
    }
}
