//! The parts of space that are far from the surface of a solid, so that most points need no nearest triangle.

use glam::Vec3;

use crate::contacts::bounds::Bounds;

/// Number of cells along the longest side of the solid. A power of two.
const SIDE: usize = 64;
/// Distance of a corner from the center of a cube, relative to its side: sqrt(3/4), and more than its rounding.
const CORNER: f32 = 0.87;

/// Where the points of a cell are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    Inside,
    Outside,
    /// The surface may pass through the cell.
    NearSurface,
}

/// Cubes around a solid.
#[derive(Debug)]
pub(super) struct Cells {
    /// Lowest corner.
    origin: Vec3,
    /// Cells per unit.
    scale: f32,
    /// Bound on the rounding of a height.
    rounding: f32,
    /// By x, then y, then z.
    places: Vec<Place>,
}

/// A cube of cells.
#[derive(Debug, Clone, Copy)]
struct Block {
    /// Its first cell on each axis.
    first: [usize; 3],
    /// Number of cells along each side.
    side: usize,
}

impl Cells {
    /// `height` returns the distance of a point from the surface, negative inside, or `None` if it is unknown. It rounds by
    /// at most `rounding`.
    pub(super) fn new(
        bounds: &Bounds,
        height: &impl Fn(Vec3) -> Option<f32>,
        rounding: f32,
    ) -> Self {
        let origin = Vec3::from_array(bounds.min);
        let longest = (Vec3::from_array(bounds.max) - origin).max_element();
        let places = vec![Place::NearSurface; SIDE * SIDE * SIDE];
        let mut cells = Self { origin, scale: SIDE as f32 / longest, rounding, places };
        // A solid without an extent has no cells.
        if cells.scale.is_finite() {
            cells.fill(Block { first: [0; 3], side: SIDE }, height);
        }
        cells
    }

    /// Returns the place of a point within the bounds of the solid.
    pub(super) fn at(&self, point: Vec3) -> Place {
        let cell = (point - self.origin) * self.scale;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
        let index = |along: f32| (along as usize).min(SIDE - 1);
        self.places[place(cell.to_array().map(index))]
    }

    /// Finds the places of the cells of a block, of all at once if the surface is far from it.
    fn fill(&mut self, block: Block, height: &impl Fn(Vec3) -> Option<f32>) {
        let half = 0.5 * block.side as f32;
        let center = Vec3::from_array(block.first.map(|first| first as f32 + half));
        let reach = CORNER * block.side as f32 / self.scale + self.rounding;
        let found = match height(self.origin + center / self.scale) {
            Some(height) if height > reach => Place::Outside,
            Some(height) if height < -reach => Place::Inside,
            _ => Place::NearSurface,
        };
        if found != Place::NearSurface {
            block.cells().for_each(|cell| self.places[place(cell)] = found);
        } else if block.side > 1 {
            block.octants().for_each(|octant| self.fill(octant, height));
        }
    }
}

impl Block {
    fn cells(self) -> impl Iterator<Item = [usize; 3]> {
        let [x, y, z] = self.first.map(|first| first..first + self.side);
        x.flat_map(move |x| {
            let z = z.clone();
            y.clone().flat_map(move |y| z.clone().map(move |z| [x, y, z]))
        })
    }

    fn octants(self) -> impl Iterator<Item = Self> {
        let side = self.side / 2;
        (0..8).map(move |octant: usize| Self {
            first: [0, 1, 2].map(|axis| self.first[axis] + (octant >> axis & 1) * side),
            side,
        })
    }
}

fn place([x, y, z]: [usize; 3]) -> usize {
    (x * SIDE + y) * SIDE + z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_tell_the_side_of_points_away_from_the_surface_only() {
        let bounds = Bounds { min: [1.0, -0.5, -0.5], max: [3.0, 0.5, 0.5] };
        // A ball at one end of the box.
        let height = |point: Vec3| point.distance(Vec3::new(1.5, 0.0, 0.0)) - 0.5;
        let cells = Cells::new(&bounds, &|point| Some(height(point)), 1e-6);
        let mut counts = [0; 3];
        for index in 0..40 * 40 * 40 {
            let share = [index % 40, index / 40 % 40, index / 1600].map(|part| part as f32 / 39.0);
            let point = Vec3::new(1.0 + 2.0 * share[0], share[1] - 0.5, share[2] - 0.5);
            // A cell is 1/32 long.
            match cells.at(point) {
                Place::Inside => assert!(height(point) < 0.0),
                Place::Outside => assert!(height(point) > 0.0),
                Place::NearSurface => assert!(height(point).abs() < 2.0 * 0.87 / 32.0),
            }
            counts[cells.at(point) as usize] += 1;
        }
        assert!(counts.iter().all(|count| *count > 1000), "{counts:?}");
    }

    #[test]
    fn a_point_of_unknown_height_is_near_the_surface() {
        let bounds = Bounds { min: [0.0; 3], max: [1.0; 3] };
        let cells = Cells::new(&bounds, &|_| None, 1e-6);
        assert_eq!(cells.at(Vec3::splat(0.5)), Place::NearSurface);
    }
}
