//! A tree of boxes over the triangles of a mesh (bounding volume hierarchy).

use std::ops::ControlFlow;

use glam::Vec3;

use super::triangle::{NearestPoint, Triangle};
use crate::contacts::bounds::Bounds;

/// Bound on the rounding of two distances from triangles, relative to the coordinates.
const ROUNDING: f32 = 32.0 * f32::EPSILON;
/// Largest number of triangles in a leaf.
const LEAF: usize = 4;

/// The triangles of a mesh in the order of the leaves, and the boxes above them.
#[derive(Debug, Default)]
pub(super) struct TriangleTree {
    pub(super) triangles: Vec<Triangle>,
    /// Each node before its children.
    nodes: Vec<Node>,
    /// Bound on the rounding of two distances of points in the box of the tree.
    pub(super) rounding: f32,
}

#[derive(Debug)]
struct Node {
    bounds: Bounds,
    /// The node behind all nodes below this one.
    next: u32,
    /// The triangles of a leaf; none of a node with children.
    triangles: [u32; 2],
}

/// The triangle that is nearest to a point.
pub(super) struct NearestTriangle {
    pub(super) triangle: u32,
    pub(super) nearest: NearestPoint,
    /// Square of the distance.
    square: f32,
}

impl TriangleTree {
    /// Builds the tree: each node is divided at the median across its longest side. Also returns, by triangle of the
    /// tree, its index in `triangles`.
    pub(super) fn new(triangles: Vec<Triangle>) -> (Self, Vec<u32>) {
        let mut tree = Self { triangles, nodes: Vec::new(), rounding: 0.0 };
        let mut items: Vec<_> = (0_u32..).zip(&tree.triangles).map(Item::new).collect();
        if !items.is_empty() {
            tree.divide(&mut items, 0);
        }
        let order: Vec<_> = items.iter().map(|item| item.triangle).collect();
        let sorted = order.iter().map(|triangle| tree.triangles[*triangle as usize].clone());
        tree.triangles = sorted.collect();
        tree.rounding = ROUNDING * tree.bounds().magnitude();
        (tree, order)
    }

    /// Adds the node of some items, the first of which has the place `first` in the order.
    #[allow(
        clippy::cast_possible_truncation,
        reason = "a text of 16 MiB has fewer than 2^24 triangles"
    )]
    fn divide(&mut self, items: &mut [Item], first: u32) {
        let bounds = items.iter().fold(Bounds::EMPTY, |all, item| all.union(&item.bounds));
        let node = self.nodes.len();
        let is_leaf = items.len() <= LEAF;
        let end = if is_leaf { first + items.len() as u32 } else { first };
        self.nodes.push(Node { bounds, next: 0, triangles: [first, end] });
        if !is_leaf {
            let axis = longest_axis(&Bounds::around(items.iter().map(|item| item.center)));
            let half = items.len() / 2;
            items.select_nth_unstable_by(half, |a, b| {
                a.center[axis].total_cmp(&b.center[axis]).then(a.triangle.cmp(&b.triangle))
            });
            let (low, high) = items.split_at_mut(half);
            self.divide(low, first);
            self.divide(high, first + half as u32);
        }
        self.nodes[node].next = self.nodes.len() as u32;
    }

    /// Passes the triangles whose leaves meet a box to `visit`, as indices in ascending order.
    pub(super) fn search(
        &self,
        bounds: &Bounds,
        visit: &mut impl FnMut(u32) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            if node.bounds.are_near(bounds, 0.0) {
                let [first, end] = node.triangles;
                (first..end).try_for_each(&mut *visit)?;
                at += 1;
            } else {
                at = node.next as usize;
            }
        }
        ControlFlow::Continue(())
    }

    /// Returns the box around all triangles.
    pub(super) fn bounds(&self) -> Bounds {
        self.nodes.first().map_or(Bounds::EMPTY, |root| root.bounds)
    }

    /// Returns the triangle that is nearest to a point, the first one if several are. `None` for NaN.
    pub(super) fn nearest(&self, point: Vec3) -> Option<NearestTriangle> {
        let mut search = NearestSearch::new(self, point);
        // A leaf that is near, so that most boxes can be left out.
        search.examine(self.leaf_near(point)?.triangles());
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            if node.square_to(point) > search.reach {
                at = node.next as usize;
            } else {
                search.examine(node.triangles());
                at += 1;
            }
        }
        search.found
    }

    /// Returns the nearest of some triangles, if it is certainly nearer than `distance`. If all others are farther, this is
    /// the triangle that [`Self::nearest`] returns.
    pub(super) fn nearest_of(
        &self,
        triangles: &[u32],
        point: Vec3,
        distance: f32,
    ) -> Option<NearestTriangle> {
        let mut search = NearestSearch::new(self, point);
        search.examine(triangles.iter().copied());
        (search.reach < distance * distance).then_some(search.found).flatten()
    }

    /// Returns the leaf to which the nearer child leads at each node.
    fn leaf_near(&self, point: Vec3) -> Option<&Node> {
        let mut at = 0;
        let mut node = self.nodes.first()?;
        while !node.is_leaf() {
            let low = self.nodes.get(at + 1)?;
            let high = self.nodes.get(low.next as usize)?;
            let is_low = low.square_to(point) <= high.square_to(point);
            (at, node) = if is_low { (at + 1, low) } else { (low.next as usize, high) };
        }
        Some(node)
    }
}

/// A search for the triangle that is nearest to a point. The result does not depend on the order in which triangles are
/// examined, nor on those that are certainly farther.
struct NearestSearch<'a> {
    tree: &'a TriangleTree,
    point: Vec3,
    found: Option<NearestTriangle>,
    /// Square of the distance of the found triangle, and more than all rounding.
    reach: f32,
}

impl<'a> NearestSearch<'a> {
    fn new(tree: &'a TriangleTree, point: Vec3) -> Self {
        Self { tree, point, found: None, reach: f32::INFINITY }
    }

    fn examine(&mut self, triangles: impl Iterator<Item = u32>) {
        for triangle in triangles {
            let one = &self.tree.triangles[triangle as usize];
            let Some(nearest) = one.nearest_within(self.point, self.reach, self.tree.rounding)
            else {
                continue;
            };
            let square = nearest.apart.dot(nearest.apart);
            let (limit, before) = self
                .found
                .as_ref()
                .map_or((f32::INFINITY, 0), |found| (found.square, found.triangle));
            if square < limit || (square == limit && triangle < before) {
                self.found = Some(NearestTriangle { triangle, nearest, square });
                let distance = square.sqrt() + self.tree.rounding;
                self.reach = distance * distance;
            }
        }
    }
}

impl Node {
    fn is_leaf(&self) -> bool {
        self.triangles[0] < self.triangles[1]
    }

    fn triangles(&self) -> std::ops::Range<u32> {
        self.triangles[0]..self.triangles[1]
    }

    fn square_to(&self, point: Vec3) -> f32 {
        self.bounds.square_to(point.to_array())
    }
}

/// A triangle during the construction.
struct Item {
    triangle: u32,
    bounds: Bounds,
    center: [f32; 3],
}

impl Item {
    fn new((index, triangle): (u32, &Triangle)) -> Self {
        let bounds = Bounds::around(triangle.corners.map(|corner| corner.to_array()));
        Self { triangle: index, bounds, center: bounds.center() }
    }
}

fn longest_axis(bounds: &Bounds) -> usize {
    let length = |axis: usize| bounds.max[axis] - bounds.min[axis];
    let longer = |a, b| if length(b) > length(a) { b } else { a };
    longer(longer(0, 1), 2)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
mod tests {
    use glam::DVec3;

    use super::*;

    /// Distance of a point from a triangle in f64.
    fn distance(corners: [DVec3; 3], point: DVec3) -> f64 {
        let edges = [0, 1, 2].map(|at| [corners[at], corners[(at + 1) % 3]]);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let is_inside = |[a, b]: &[DVec3; 2]| normal.cross(*b - *a).dot(point - *a) >= 0.0;
        if edges.iter().all(is_inside) {
            return normal.dot(point - corners[0]).abs();
        }
        let to_edge = |[a, b]: [DVec3; 2]| {
            let share = (b - a).dot(point - a) / (b - a).dot(b - a);
            point.distance(a + (b - a) * share.clamp(0.0, 1.0))
        };
        edges.map(to_edge).into_iter().fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn distances_from_needles_are_exact_up_to_the_bound_that_decides_what_is_nearest() {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            2.0 * (state >> 8) as f32 / (1 << 24) as f32 - 1.0
        };
        let mut vector = || Vec3::new(random(), random(), random());
        for round in 0..200_000 {
            let (tip, along) = (vector() * 0.3, vector().normalize() * 0.5);
            // Tips of 1e-1 to 1e-5 rad, and points near them.
            let width = 0.1_f32.powi(1 + round % 5);
            let corners = [tip, tip + along, tip + along + vector() * width];
            let corners = corners.map(|corner| corner.to_array());
            let Some(needle) = Triangle::new(corners, 1e-6) else { continue };
            let (tree, _) = TriangleTree::new(vec![needle]);
            let point = tip - along * (1e-4 * width.sqrt()) + vector() * 1e-6;
            let found = tree.nearest(point).unwrap();
            let corners = corners.map(|corner| Vec3::from_array(corner).as_dvec3());
            let error = f64::from(found.square.sqrt()) - distance(corners, point.as_dvec3());
            assert!(error.abs() < 0.5 * f64::from(tree.rounding), "{corners:?} {point}: {error}");
        }
    }
}
