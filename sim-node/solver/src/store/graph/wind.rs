//! The wind on the triangles of the graph.

use sim_scene::model::Model;

use super::indices::find_particle;
use crate::kernels::lanes::{LaneWork, Lanes8, PackedParticle, Wide};
use crate::kernels::vectors::{lane_of, set_lane, store, sum};
use crate::step::wind::{Corner, WindStep};

/// The triangles between particles of the graph, in the order of the scene.
#[derive(Debug, Clone, Default)]
pub(crate) struct GraphSurface {
    pub(crate) groups: Vec<TriangleGroup>,
    /// By triangle of the graph: its index in the scene.
    triangles: Vec<u32>,
    /// By particle: number of its triangles that have no torn side.
    counts: Vec<f32>,
}

/// Eight triangles. The corners of padding are the particle behind the last one, which nothing moves.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TriangleGroup {
    /// By corner: the particles.
    particles: [[u32; 8]; 3],
    /// By corner: the fractions of the particles' masses that belong to the triangles; 0 for triangles with a torn
    /// side, which gain nothing from the wind.
    shares_max: [Lanes8; 3],
}

impl GraphSurface {
    /// `indices` are those of the particles in the scene.
    pub(crate) fn new(model: &Model, indices: &[u32]) -> Self {
        let find = |particle: u32| find_particle(indices, particle);
        #[allow(clippy::cast_possible_truncation, reason = "at most 2^24 particles")]
        let padding = indices.len() as u32;
        let mut surface = Self { counts: vec![0.0; indices.len()], ..Self::default() };
        for (triangle, corners) in (0_u32..).zip(&model.triangles) {
            let [Some(a), Some(b), Some(c)] = corners.map(find) else { continue };
            let lane = surface.triangles.len() % 8;
            if lane == 0 {
                let particles = [[padding; 8]; 3];
                surface.groups.push(TriangleGroup { particles, shares_max: [[0.0; 8]; 3] });
            }
            let group = surface.triangles.len() / 8;
            for (corner, particle) in [a, b, c].into_iter().enumerate() {
                surface.groups[group].particles[corner][lane] = particle;
            }
            surface.triangles.push(triangle);
        }
        surface.share_masses(|_| true);
        surface
    }

    /// Divides the masses of particles among their triangles without torn sides.
    pub(crate) fn share_masses(&mut self, is_whole: impl Fn(u32) -> bool) {
        let Self { groups, triangles, counts } = self;
        counts.fill(0.0);
        for (group, triangles) in groups.iter().zip(triangles.chunks(8)) {
            for (lane, _) in triangles.iter().enumerate().filter(|(_, one)| is_whole(**one)) {
                for particles in &group.particles {
                    counts[particles[lane] as usize] += 1.0;
                }
            }
        }
        for (group, triangles) in groups.iter_mut().zip(triangles.chunks(8)) {
            for (lane, triangle) in triangles.iter().enumerate() {
                let is_whole = is_whole(*triangle);
                let share = |count: f32| if is_whole { 1.0 / count } else { 0.0 };
                for (particles, shares_max) in group.particles.iter().zip(&mut group.shares_max) {
                    shares_max[lane] = share(counts[particles[lane] as usize]);
                }
            }
        }
    }
}

/// Computes the velocities that the wind adds to the particles of the graph.
pub(crate) struct GraphWindWork<'a> {
    pub(crate) particles: &'a [PackedParticle],
    pub(crate) triangles: &'a [TriangleGroup],
    /// By group of eight particles.
    pub(crate) gains: &'a mut [[Lanes8; 3]],
    pub(crate) wind: &'a WindStep,
}

impl LaneWork for GraphWindWork<'_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        self.gains.fill([[0.0; 8]; 3]);
        for TriangleGroup { particles, shares_max } in self.triangles {
            let [a, b, c] = particles;
            let (a, a_mass) = corner::<W>(self.particles, a);
            let (b, b_mass) = corner::<W>(self.particles, b);
            let (c, c_mass) = corner::<W>(self.particles, c);
            let wind = self.wind.on_triangle([a, b, c]);
            let mut gains = [[[0.0; 8]; 3]; 3];
            store(wind.gain(a_mass, W::load(&shares_max[0], 0)), &mut gains[0]);
            store(wind.gain(b_mass, W::load(&shares_max[1], 0)), &mut gains[1]);
            store(wind.gain(c_mass, W::load(&shares_max[2], 0)), &mut gains[2]);
            // One triangle after the other, because they can have common corners.
            for lane in 0..8 {
                for (particles, gains) in particles.iter().zip(&gains) {
                    let index = particles[lane] as usize;
                    let sums = &mut self.gains[index / 8];
                    let gained = sum(lane_of(sums, index % 8), lane_of(gains, lane));
                    set_lane(sums, index % 8, gained);
                }
            }
        }
    }
}

/// A corner of eight triangles, and the inverse masses of its particles.
#[inline(always)]
fn corner<W: Wide>(particles: &[PackedParticle], indices: &[u32; 8]) -> (Corner<W>, W) {
    let mut packed = [PackedParticle::default(); 8];
    for (packed, index) in packed.iter_mut().zip(indices) {
        *packed = particles[*index as usize];
    }
    let [[x, y, z, w], [dx, dy, dz, _]] = W::columns(&packed);
    (Corner { position: [x, y, z], displacement: [dx, dy, dz] }, w)
}
