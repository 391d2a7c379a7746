//! A tree of boxes over the triangles of a mesh (bounding volume hierarchy).

use std::ops::ControlFlow;

use super::triangle::Triangle;
use crate::contacts::bounds::Bounds;

/// Largest number of triangles in a leaf.
const LEAF: usize = 4;

/// The triangles of a mesh in the order of the leaves, and the boxes above them.
#[derive(Debug, Default)]
pub(super) struct TriangleTree {
    pub(super) triangles: Vec<Triangle>,
    /// Each node before its children.
    nodes: Vec<Node>,
}

#[derive(Debug)]
struct Node {
    bounds: Bounds,
    /// The node behind all nodes below this one.
    next: u32,
    /// The triangles of a leaf; none of a node with children.
    triangles: [u32; 2],
}

impl TriangleTree {
    /// Builds the tree: each node is divided at the median across its longest side.
    pub(super) fn new(triangles: Vec<Triangle>) -> Self {
        let mut tree = Self { triangles, nodes: Vec::new() };
        let mut items: Vec<_> = (0_u32..).zip(&tree.triangles).map(Item::new).collect();
        if !items.is_empty() {
            tree.divide(&mut items, 0);
        }
        let sorted = items.iter().map(|item| tree.triangles[item.triangle as usize].clone());
        tree.triangles = sorted.collect();
        tree
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
        let center = std::array::from_fn(|axis| 0.5 * (bounds.min[axis] + bounds.max[axis]));
        Self { triangle: index, bounds, center }
    }
}

fn longest_axis(bounds: &Bounds) -> usize {
    let length = |axis: usize| bounds.max[axis] - bounds.min[axis];
    let longer = |a, b| if length(b) > length(a) { b } else { a };
    longer(longer(0, 1), 2)
}
