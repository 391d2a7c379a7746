//! The spheres around sixteen triangles that are neighbours at load.

use super::super::lane_bounds::LaneBounds;
use super::super::tile::{TILE, TileColumn};
use crate::contacts::bounds::Bounds;
use crate::kernels::lanes::{PackedParticle, Wide, axes};
use crate::kernels::vectors::{difference, dot, scaled, sum};

/// The spheres around the triangles of a tile in the middle of the time. Those with NaN are near nothing.
#[derive(Debug, Clone, Copy)]
pub(super) struct TriangleTile {
    /// The centroids, by axis.
    centers: [TileColumn; 3],
    /// Largest distances of a corner from the centroid.
    radii: TileColumn,
    /// Box of all triangles.
    pub(super) bounds: Bounds,
    /// Box of the displacements of all corners.
    pub(super) displacements: Bounds,
}

impl TriangleTile {
    pub(super) const EMPTY: Self = Self {
        centers: [[[f32::NAN; 8]; TILE / 8]; 3],
        radii: [[f32::NAN; 8]; TILE / 8],
        bounds: Bounds::EMPTY,
        displacements: Bounds::EMPTY,
    };

    /// Replaces the spheres by those of triangles after `time` displacements.
    #[inline(always)]
    pub(super) fn refit<W: Wide>(
        &mut self,
        triangles: &[[u32; 3]],
        states: &[PackedParticle],
        time: f32,
    ) {
        let (mut bounds, mut displacements) = (LaneBounds::<W>::empty(), LaneBounds::<W>::empty());
        for (group, triangles) in triangles.chunks(8).enumerate() {
            let mut corners = [[W::splat(0.0); 3]; 3];
            for (index, corner) in corners.iter_mut().enumerate() {
                let slots = triangles.iter().map(|slots| slots[index]);
                let [[x, y, z, _], [dx, dy, dz, _]] = W::columns(&gather(states, slots));
                *corner = sum([x, y, z], scaled([dx, dy, dz], W::splat(time)));
                bounds.include(*corner);
                displacements.include([dx, dy, dz]);
            }
            self.set_spheres(group, corners);
        }
        (self.bounds, self.displacements) = (bounds.around_all(), displacements.around_all());
    }

    #[inline(always)]
    fn set_spheres<W: Wide>(&mut self, group: usize, [a, b, c]: [[W; 3]; 3]) {
        let center = scaled(sum(sum(a, b), c), W::splat(1.0 / 3.0));
        let [a, b, c] = [difference(a, center), difference(b, center), difference(c, center)];
        let square = dot(a, a).max_or_rhs(dot(b, b)).max_or_rhs(dot(c, c));
        square.sqrt().store(&mut self.radii[group], 0);
        for (center, centers) in center.into_iter().zip(&mut self.centers) {
            center.store(&mut centers[group], 0);
        }
    }

    /// Box of all triangles from `time` displacements before to as many after.
    #[inline(always)]
    pub(super) fn path_box(&self, time: f32) -> Bounds {
        let longest = self.displacements.distances_max(&Bounds::around([[0.0; 3]]));
        self.bounds.grown_by(axes(|axis| time * longest[axis]))
    }

    /// The spheres, larger by a distance.
    #[inline(always)]
    pub(super) fn grown<W: Wide>(&self, distance: f32) -> Spheres<W> {
        let mut spheres =
            Spheres { centers: [[W::splat(0.0); 3]; TILE / 8], squares: [W::splat(0.0); TILE / 8] };
        for group in 0..TILE / 8 {
            for axis in 0..3 {
                spheres.centers[group][axis] = W::load(&self.centers[axis][group], 0);
            }
            let radius = W::load(&self.radii[group], 0) + W::splat(distance);
            spheres.squares[group] = radius * radius;
        }
        spheres
    }
}

/// The spheres of a tile, by group.
pub(super) struct Spheres<W> {
    centers: [[W; 3]; TILE / 8],
    /// Squares of the radii.
    squares: [W; TILE / 8],
}

impl<W: Wide> Spheres<W> {
    /// Returns a bit for each sphere that holds a point.
    #[inline(always)]
    pub(super) fn lanes_around(&self, [x, y, z]: [f32; 3]) -> u32 {
        let point = [W::splat(x), W::splat(y), W::splat(z)];
        let mut bits = 0;
        for group in 0..TILE / 8 {
            let apart = difference(self.centers[group], point);
            bits |= W::bits(dot(apart, apart).is_below(self.squares[group])) << (8 * group);
        }
        bits
    }
}

/// Returns the particles with up to eight slots. The lanes behind the last one are NaN.
#[inline(always)]
pub(super) fn gather(
    states: &[PackedParticle],
    slots: impl Iterator<Item = u32>,
) -> [PackedParticle; 8] {
    let mut gathered = [PackedParticle([f32::NAN; 8]); 8];
    for (state, slot) in gathered.iter_mut().zip(slots) {
        *state = states[slot as usize];
    }
    gathered
}
