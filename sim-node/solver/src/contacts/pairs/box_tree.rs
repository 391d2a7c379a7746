//! A tree of boxes. Four boxes form a node, four nodes the node above, and so on.

use crate::contacts::bounds::Bounds;

/// Number of children of a node.
const ARITY: usize = 4;

/// Order to go on, or to give a search up.
pub(super) type Search = std::ops::ControlFlow<()>;

/// Boxes, the nodes above them, and so on up to the root.
#[derive(Debug, Clone, Default)]
pub(super) struct BoxTree {
    levels: Vec<Vec<Bounds>>,
}

impl BoxTree {
    /// Makes a tree of empty boxes.
    pub(super) fn new(leaf_count: usize) -> Self {
        let mut levels = Vec::new();
        let mut length = leaf_count;
        while length > 0 {
            levels.push(vec![Bounds::EMPTY; length]);
            length = if length > 1 { length.div_ceil(ARITY) } else { 0 };
        }
        Self { levels }
    }

    pub(super) fn leaves(&self) -> &[Bounds] {
        self.levels.first().map_or(&[], Vec::as_slice)
    }

    /// Replaces the leaves by `refit`, and computes the nodes above.
    pub(super) fn refit(&mut self, refit: impl FnOnce(&mut [Bounds])) {
        let Some((leaves, nodes)) = self.levels.split_first_mut() else { return };
        refit(leaves);
        let mut below = &*leaves;
        for level in nodes {
            for (bounds, children) in level.iter_mut().zip(below.chunks(ARITY)) {
                *bounds = children.iter().fold(Bounds::EMPTY, Bounds::union);
            }
            below = level;
        }
    }

    /// Passes every pair of leaves of this tree that are near each other to `accept`, each once and with
    /// itself, the earlier leaf first.
    pub(super) fn search(
        &self,
        distance: f32,
        accept: &mut impl FnMut([u32; 2]) -> Search,
    ) -> Search {
        match self.root() {
            Some(root) => self.search_nodes([root; 2], distance, accept),
            None => Search::Continue(()),
        }
    }

    /// Passes every pair of a leaf of this tree and one of the other tree that are near each other to `accept`.
    pub(super) fn search_between(
        &self,
        other: &Self,
        distance: f32,
        accept: &mut impl FnMut([u32; 2]) -> Search,
    ) -> Search {
        match (self.root(), other.root()) {
            (Some(a), Some(b)) => self.search_nodes_between(other, [a, b], distance, accept),
            _ => Search::Continue(()),
        }
    }

    fn root(&self) -> Option<Node> {
        let level = self.levels.len().checked_sub(1)?;
        Some(Node { level, index: 0 })
    }

    fn bounds(&self, node: Node) -> &Bounds {
        &self.levels[node.level][node.index]
    }

    fn children(&self, node: Node) -> impl Iterator<Item = Node> + use<> {
        let level = node.level - 1;
        let end = self.levels[level].len().min(ARITY * (node.index + 1));
        (ARITY * node.index..end).map(move |index| Node { level, index })
    }

    /// The nodes are of one level, and the first one is not behind the second.
    fn search_nodes(
        &self,
        [a, b]: [Node; 2],
        distance: f32,
        accept: &mut impl FnMut([u32; 2]) -> Search,
    ) -> Search {
        if !self.bounds(a).are_near(self.bounds(b), distance) {
            return Search::Continue(());
        }
        if a.level == 0 {
            return accept([a, b].map(Node::leaf));
        }
        for left in self.children(a) {
            for right in self.children(b).filter(|right| left.index <= right.index) {
                self.search_nodes([left, right], distance, accept)?;
            }
        }
        Search::Continue(())
    }

    fn search_nodes_between(
        &self,
        other: &Self,
        [a, b]: [Node; 2],
        distance: f32,
        accept: &mut impl FnMut([u32; 2]) -> Search,
    ) -> Search {
        if !self.bounds(a).are_near(other.bounds(b), distance) {
            return Search::Continue(());
        }
        if a.level == 0 && b.level == 0 {
            return accept([a, b].map(Node::leaf));
        }
        if a.level >= b.level {
            for child in self.children(a) {
                self.search_nodes_between(other, [child, b], distance, accept)?;
            }
        } else {
            for child in other.children(b) {
                self.search_nodes_between(other, [a, child], distance, accept)?;
            }
        }
        Search::Continue(())
    }
}

/// A box in a tree.
#[derive(Debug, Clone, Copy)]
struct Node {
    /// 0 for a leaf.
    level: usize,
    index: usize,
}

impl Node {
    #[allow(clippy::cast_possible_truncation, reason = "a tree has at most 2^24 leaves")]
    fn leaf(self) -> u32 {
        self.index as u32
    }
}
