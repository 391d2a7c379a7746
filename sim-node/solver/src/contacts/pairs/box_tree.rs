//! A tree of boxes. Four boxes form a node, four nodes the node above, and so on.

use crate::contacts::bounds::Bounds;
use crate::kernels::Kernels;
use crate::kernels::lanes::{LaneWork, Lanes8, Wide};

/// Number of children of a node.
const ARITY: usize = 4;
/// Largest number of levels: twelve of nodes above 2^24 = 4^12 leaves.
const LEVELS_MAX: usize = 13;

/// Order to go on, or to give a search up.
pub(super) type Search = std::ops::ControlFlow<()>;

/// Boxes, the nodes above them, and so on up to the root.
#[derive(Debug, Clone, Default)]
pub(super) struct BoxTree {
    levels: Vec<Vec<Bounds>>,
    /// The same boxes, to compare all sides of two boxes at once.
    sides: Vec<Vec<Sides>>,
    /// By node: a leaf below it is marked. A search skips pairs without a marked leaf. All are marked at first.
    is_marked: Vec<Vec<bool>>,
}

/// The largest coordinates of a box and 0, and its smallest coordinates with the opposite sign and 0.
#[derive(Debug, Clone, Copy)]
struct Sides(Lanes8);

impl Sides {
    fn new(Bounds { min, max }: &Bounds) -> Self {
        Self([max[0], max[1], max[2], 0.0, -min[0], -min[1], -min[2], 0.0])
    }

    /// True if a box is at most a distance apart from another one on every axis, for which `facing` has
    /// [`facing_sides`]. `moved_out` has the distance where sides are smallest coordinates, and 0 elsewhere.
    #[inline(always)]
    fn are_near<W: Wide>(&self, facing: W, moved_out: W) -> bool {
        W::bits(facing.is_at_most(W::load(&self.0, 0) + moved_out)) == 0xff
    }
}

/// The sides of a box that face those of another one ([`Sides`]); the smallest coordinates are moved out by `distance`.
#[inline(always)]
fn facing_sides(Bounds { min, max }: &Bounds, distance: f32) -> Lanes8 {
    let [x, y, z] = min.map(|min| min - distance);
    [x, y, z, 0.0, -max[0], -max[1], -max[2], 0.0]
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
        assert!(levels.len() <= LEVELS_MAX, "the tree has too many leaves");
        let sides = levels.iter().map(|level| level.iter().map(Sides::new).collect()).collect();
        let is_marked = levels.iter().map(|level| vec![true; level.len()]).collect();
        Self { levels, sides, is_marked }
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
        for (level, sides) in self.levels.iter().zip(&mut self.sides) {
            for (bounds, sides) in level.iter().zip(sides) {
                *sides = Sides::new(bounds);
            }
        }
    }

    /// Marks leaves, and no others.
    pub(super) fn mark(&mut self, is_marked: impl Iterator<Item = bool>) {
        let Some((leaves, nodes)) = self.is_marked.split_first_mut() else { return };
        for (leaf, is_marked) in leaves.iter_mut().zip(is_marked) {
            *leaf = is_marked;
        }
        let mut below = &*leaves;
        for level in nodes {
            for (node, children) in level.iter_mut().zip(below.chunks(ARITY)) {
                *node = children.contains(&true);
            }
            below = level;
        }
    }

    fn root(&self) -> Option<Node> {
        let level = self.levels.len().checked_sub(1)?;
        Some(Node { level, index: 0 })
    }

    #[inline(always)]
    fn bounds(&self, node: Node) -> &Bounds {
        &self.levels[node.level][node.index]
    }

    #[inline(always)]
    fn is_marked(&self, node: Node) -> bool {
        self.is_marked[node.level][node.index]
    }

    #[inline(always)]
    fn children(&self, node: Node) -> impl DoubleEndedIterator<Item = Node> + Clone + use<> {
        let level = node.level - 1;
        let end = self.levels[level].len().min(ARITY * (node.index + 1));
        (ARITY * node.index..end).map(move |index| Node { level, index })
    }
}

/// Two nodes.
pub(super) type NodePair = [Node; 2];

/// Where pairs of leaves are searched: the nodes below a pair of nodes.
pub(super) trait Nesting: Copy + Sync {
    /// The roots; none of empty trees.
    fn root(self) -> Option<NodePair>;

    /// Pushes the pairs of nodes below a pair that are near each other, one of them with a marked leaf. The first of them
    /// comes last.
    fn push_children<W: Wide>(self, pair: NodePair, distance: f32, stack: &mut Stack);
}

/// All pairs of leaves of a tree, each once and with itself, the earlier leaf first.
#[derive(Clone, Copy)]
pub(super) struct Within<'a>(pub(super) &'a BoxTree);

/// All pairs of a leaf of one tree and a leaf of another one.
#[derive(Clone, Copy)]
pub(super) struct Between<'a>(pub(super) [&'a BoxTree; 2]);

/// Pairs of nodes that together hold all pairs of leaves that a search finds, in the order of [`pair_order`].
#[derive(Debug, Clone)]
pub(super) struct SearchRoots {
    pub(super) pairs: Vec<NodePair>,
    spare: Vec<NodePair>,
}

/// Number of pairs from which on [`SearchRoots`] are not divided further.
const ROOTS_WANTED: usize = 128;

impl Default for SearchRoots {
    fn default() -> Self {
        let room = || Vec::with_capacity(ARITY * ARITY * ROOTS_WANTED);
        Self { pairs: room(), spare: room() }
    }
}

impl SearchRoots {
    /// Replaces the pairs by those of a search, with a small part of it below each.
    pub(super) fn find(&mut self, nesting: impl Nesting, distance: f32, kernels: Kernels) {
        self.pairs.clear();
        self.pairs.extend(nesting.root());
        kernels.run(Division { nesting, distance, roots: self });
    }
}

struct Division<'a, N> {
    nesting: N,
    distance: f32,
    roots: &'a mut SearchRoots,
}

impl<N: Nesting> LaneWork for Division<'_, N> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Self { nesting, distance, roots: SearchRoots { pairs, spare } } = self;
        let mut stack = Stack::default();
        // All pairs lie at the same levels.
        while pairs.len() < ROOTS_WANTED && pairs.first().is_some_and(|pair| !are_leaves(*pair)) {
            spare.clear();
            for pair in &*pairs {
                nesting.push_children::<W>(*pair, distance, &mut stack);
                spare.extend(std::iter::from_fn(|| stack.pop()));
            }
            std::mem::swap(pairs, spare);
        }
    }
}

fn are_leaves([a, b]: NodePair) -> bool {
    a.level == 0 && b.level == 0
}

/// Finds the pairs of leaves below some roots that are near each other, at least one of them marked, depth first. They
/// ascend by [`pair_order`].
pub(super) struct PairSearch<'a, N, F> {
    pub(super) nesting: N,
    pub(super) roots: &'a [NodePair],
    pub(super) distance: f32,
    pub(super) accept: &'a mut F,
}

impl<N: Nesting, F: FnMut([u32; 2]) -> Search> LaneWork for PairSearch<'_, N, F> {
    type Output = Search;

    #[inline(always)]
    fn run<W: Wide>(self) -> Search {
        let Self { nesting, roots, distance, accept } = self;
        let mut stack = Stack::default();
        for root in roots {
            stack.push(*root);
            while let Some(pair) = stack.pop() {
                if are_leaves(pair) {
                    accept(pair.map(Node::leaf))?;
                } else {
                    nesting.push_children::<W>(pair, distance, &mut stack);
                }
            }
        }
        Search::Continue(())
    }
}

impl Nesting for Within<'_> {
    fn root(self) -> Option<NodePair> {
        self.0.root().map(|root| [root; 2])
    }

    /// The comparison stands in the body of the loop: in a closure of `filter`, it would be compiled for the baseline
    /// processor.
    #[inline(always)]
    fn push_children<W: Wide>(self, [a, b]: NodePair, distance: f32, stack: &mut Stack) {
        let Self(tree) = self;
        let d = distance;
        let moved_out = W::load(&[0.0, 0.0, 0.0, 0.0, d, d, d, 0.0], 0);
        let rights = tree.children(b);
        for left in tree.children(a).rev() {
            let facing = W::load(&facing_sides(tree.bounds(left), distance), 0);
            let is_marked = tree.is_marked(left);
            for right in rights.clone().rev().take_while(|right| left.index <= right.index) {
                let sides = &tree.sides[right.level][right.index];
                if (is_marked | tree.is_marked(right)) && sides.are_near(facing, moved_out) {
                    stack.push([left, right]);
                }
            }
        }
    }
}

impl Nesting for Between<'_> {
    fn root(self) -> Option<NodePair> {
        let [a, b] = self.0;
        Some([a.root()?, b.root()?])
    }

    /// Only the node at the higher level is replaced by its children.
    #[inline(always)]
    fn push_children<W: Wide>(self, pair: NodePair, distance: f32, stack: &mut Stack) {
        let Self(trees) = self;
        let parent = usize::from(pair[0].level < pair[1].level);
        let d = distance;
        let moved_out = W::load(&[0.0, 0.0, 0.0, 0.0, d, d, d, 0.0], 0);
        let (tree, other_tree, other) = (trees[parent], trees[1 - parent], pair[1 - parent]);
        let facing = W::load(&facing_sides(other_tree.bounds(other), distance), 0);
        let is_marked = other_tree.is_marked(other);
        for child in tree.children(pair[parent]).rev() {
            let sides = &tree.sides[child.level][child.index];
            if (is_marked | tree.is_marked(child)) && sides.are_near(facing, moved_out) {
                let mut near = pair;
                near[parent] = child;
                stack.push(near);
            }
        }
    }
}

/// Pairs of nodes that are near each other. Later pairs lie deeper. A level has at most 16, or 4 in each of two trees.
pub(super) struct Stack {
    pairs: [NodePair; LEVELS_MAX * ARITY * ARITY],
    length: usize,
}

impl Default for Stack {
    fn default() -> Self {
        let none = Node { level: 0, index: 0 };
        Self { pairs: [[none; 2]; LEVELS_MAX * ARITY * ARITY], length: 0 }
    }
}

impl Stack {
    #[inline(always)]
    fn push(&mut self, pair: NodePair) {
        self.pairs[self.length] = pair;
        self.length += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<NodePair> {
        self.length = self.length.checked_sub(1)?;
        Some(self.pairs[self.length])
    }
}

/// A number that ascends over the pairs of leaves of [`PairSearch`]: a pair is two paths from the root down, and
/// at each node the first one counts more.
#[inline(always)]
pub(super) fn pair_order(leaves: [u32; 2]) -> u64 {
    // Two bits for each of the four children, two bits apart.
    let [a, b] = leaves.map(|leaf| {
        let mut bits = u64::from(leaf);
        bits = (bits | bits << 16) & 0x0000_ffff_0000_ffff;
        bits = (bits | bits << 8) & 0x00ff_00ff_00ff_00ff;
        bits = (bits | bits << 4) & 0x0f0f_0f0f_0f0f_0f0f;
        (bits | bits << 2) & 0x3333_3333_3333_3333
    });
    a << 2 | b
}

/// A box in a tree.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    /// 0 for a leaf.
    level: usize,
    index: usize,
}

impl Node {
    #[allow(clippy::cast_possible_truncation, reason = "a tree has at most 2^24 leaves")]
    #[inline(always)]
    fn leaf(self) -> u32 {
        self.index as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Boxes along a line that overlap a dozen others, the last one apart from all.
    fn tree(leaf_count: usize) -> BoxTree {
        let mut tree = BoxTree::new(leaf_count);
        tree.refit(|leaves| {
            for (index, leaf) in leaves.iter_mut().enumerate() {
                let x = if index + 1 == leaf_count { 1e6 } else { index as f32 };
                *leaf = Bounds { min: [x, 0.0, 0.0], max: [x + 6.0, 1.0, 1.0] };
            }
        });
        tree
    }

    /// Searches below each of the roots alone.
    fn found(nesting: impl Nesting, distance: f32, kernels: Kernels) -> Vec<[u32; 2]> {
        let (mut roots, mut pairs) = (SearchRoots::default(), Vec::new());
        roots.find(nesting, distance, kernels);
        for root in &roots.pairs {
            let accept = &mut |pair| {
                pairs.push(pair);
                Search::Continue(())
            };
            let roots = std::slice::from_ref(root);
            assert!(kernels.run(PairSearch { nesting, roots, distance, accept }).is_continue());
        }
        pairs
    }

    #[test]
    fn a_search_finds_all_near_pairs_with_a_mark_in_the_same_order() {
        let count = 4_u32.pow(4) + 37;
        let mut tree = tree(count as usize);
        let near = |[a, b]: [u32; 2]| if b + 1 == count { a == b } else { b - a <= 6 };
        let pairs = || (0..count).flat_map(|a| (a..count).map(move |b| [a, b]));
        for kernels in Kernels::available() {
            tree.mark((0..count).map(|_| true));
            let all = found(Within(&tree), 0.5, kernels);
            assert!(all.is_sorted_by(|a, b| pair_order(*a) < pair_order(*b)), "{kernels:?}");
            let mut sorted = all.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, pairs().filter(|pair| near(*pair)).collect::<Vec<_>>());

            let is_marked: Vec<_> = (0..count).map(|leaf| leaf % 50 == 3).collect();
            tree.mark(is_marked.iter().copied());
            let has_mark = |pair: &[u32; 2]| pair.iter().any(|leaf| is_marked[*leaf as usize]);
            let marked: Vec<_> = all.into_iter().filter(has_mark).collect();
            assert_eq!(found(Within(&tree), 0.5, kernels), marked, "{kernels:?}");
        }
    }

    #[test]
    fn a_search_between_trees_finds_all_near_pairs_with_a_mark() {
        let (long, short) = (4_u32.pow(3) + 37, 29);
        let (mut left, mut right) = (tree(long as usize), tree(short as usize));
        let near = |[a, b]: [u32; 2]| match [a + 1 == long, b + 1 == short] {
            [false, false] => a.abs_diff(b) <= 6,
            alone => alone == [true; 2],
        };
        for kernels in Kernels::available() {
            for marks in [[1, 1], [7, 1000], [1000, 5], [1000, 1000]] {
                let [in_left, in_right] =
                    [(long, marks[0]), (short, marks[1])].map(|(count, every)| {
                        (0..count).map(|leaf| leaf % every == 3 % every).collect::<Vec<_>>()
                    });
                left.mark(in_left.iter().copied());
                right.mark(in_right.iter().copied());
                let mut found = found(Between([&left, &right]), 0.0, kernels);
                found.sort_unstable();
                let has_mark = |[a, b]: [u32; 2]| in_left[a as usize] || in_right[b as usize];
                let pairs = (0..long).flat_map(|a| (0..short).map(move |b| [a, b]));
                let expected: Vec<_> =
                    pairs.filter(|pair| near(*pair) && has_mark(*pair)).collect();
                assert_eq!(found, expected, "{kernels:?}, {marks:?}");
            }
        }
    }
}
