//! Axis-aligned boxes.

use crate::kernels::lanes::axes;

/// Smallest and largest coordinate on each axis. An empty box has +infinity and -infinity.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    pub(super) min: [f32; 3],
    pub(super) max: [f32; 3],
}

impl Bounds {
    pub(super) const EMPTY: Self = Self { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };

    pub(super) fn union(self, other: &Self) -> Self {
        let mut union = self;
        for axis in 0..3 {
            union.min[axis] = lesser(other.min[axis], union.min[axis]);
            union.max[axis] = -lesser(-other.max[axis], -union.max[axis]);
        }
        union
    }

    /// The box around points. NaN leaves it as it is.
    pub(super) fn around(points: impl IntoIterator<Item = [f32; 3]>) -> Self {
        let point = |at| Self { min: at, max: at };
        points.into_iter().fold(Self::EMPTY, |all, at| all.union(&point(at)))
    }

    /// The box, larger by `distance` on each side.
    pub(super) fn grown(self, distance: f32) -> Self {
        self.grown_by([distance; 3])
    }

    /// The box, larger by a distance for each axis.
    #[inline(always)]
    pub(super) fn grown_by(self, distance: [f32; 3]) -> Self {
        Self {
            min: axes(|axis| self.min[axis] - distance[axis]),
            max: axes(|axis| self.max[axis] + distance[axis]),
        }
    }

    /// A box that holds every point of this one after `time` displacements, `time` >= 0. `displacements` holds every
    /// displacement.
    #[inline(always)]
    pub(super) fn moved(&self, displacements: &Self, time: f32) -> Self {
        if time == 0.0 {
            // The product with an infinite displacement would be NaN.
            return *self;
        }
        Self {
            min: axes(|axis| self.min[axis] + time * displacements.min[axis]),
            max: axes(|axis| self.max[axis] + time * displacements.max[axis]),
        }
    }

    pub(super) fn contains(&self, point: [f32; 3]) -> bool {
        (0..3).all(|axis| self.min[axis] <= point[axis] && point[axis] <= self.max[axis])
    }

    pub(super) fn contains_box(&self, other: &Self) -> bool {
        self.contains(other.min) && self.contains(other.max)
    }

    /// Sum of the largest coordinate on each axis; 0 for an empty box.
    pub(super) fn magnitude(&self) -> f32 {
        let [x, y, z] = axes(|axis| -lesser(self.min[axis], -self.max[axis]));
        if x + y + z > 0.0 { x + y + z } else { 0.0 }
    }

    pub(super) fn center(&self) -> [f32; 3] {
        axes(|axis| 0.5 * (self.min[axis] + self.max[axis]))
    }

    /// Distance of a point in the box from the nearest side; negative outside.
    pub(super) fn depth_of(&self, point: [f32; 3]) -> f32 {
        let depths =
            axes(|axis| lesser(point[axis] - self.min[axis], self.max[axis] - point[axis]));
        lesser(depths[0], lesser(depths[1], depths[2]))
    }

    /// Square of the distance of a point from the box.
    pub(super) fn square_to(&self, point: [f32; 3]) -> f32 {
        let [x, y, z] = axes(|axis| {
            let (below, above) = (self.min[axis] - point[axis], point[axis] - self.max[axis]);
            let outside = if below > above { below } else { above };
            if outside > 0.0 { outside } else { 0.0 }
        });
        x * x + y * y + z * z
    }

    /// Largest distance of a point of this box from a point of the other one, on each axis.
    #[inline(always)]
    pub(super) fn distances_max(&self, other: &Self) -> [f32; 3] {
        axes(|axis| {
            let (up, down) = (self.max[axis] - other.min[axis], other.max[axis] - self.min[axis]);
            if up > down { up } else { down }
        })
    }

    /// Largest distance of a point of this box from a point of the other one.
    #[inline(always)]
    pub(super) fn distance_max(&self, other: &Self) -> f32 {
        let longest = self.distances_max(other);
        (longest[0] * longest[0] + longest[1] * longest[1] + longest[2] * longest[2]).sqrt()
    }

    /// Returns true if the boxes are at most `distance` apart on every axis.
    #[inline(always)]
    pub(super) fn are_near(&self, other: &Self, distance: f32) -> bool {
        (0..3).all(|axis| {
            self.min[axis] - distance <= other.max[axis]
                && other.min[axis] - distance <= self.max[axis]
        })
    }
}

/// The lesser number; `b` if `a` is NaN.
#[inline(always)]
pub(super) fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
