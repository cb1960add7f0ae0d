//! A bounding volume hierarchy over triangles.
//!
//! The `bvh` crate builds the tree in f64 on all threads, by the surface area heuristic. The traversal is here: the crate's own traversals return all
//! boxes that are met or keep at most 32 levels, and none takes a bound that shrinks while triangles are met. The boxes are recomputed from the
//! triangles, so that a box without volume, or one too large for the heuristic's sums, still contains its triangles.

use bvh::aabb::{Aabb as CrateBox, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::{Bvh as CrateBvh, BvhNode, BvhNodeBuildArgs};
use glam::DVec3;
use nalgebra::Point3;

use super::intersect::Ray;
use afterlight_scene::Aabb;

/// Marks a child that is a triangle.
const LEAF: u32 = 1 << 31;

/// Two boxes and their contents: the index of a node, or of a triangle with [`LEAF`].
#[derive(Debug, Clone, Copy)]
struct BoxPair {
    boxes: [Aabb; 2],
    children: [u32; 2],
}

/// A tree over boxes that are known by their index.
#[derive(Debug, Default)]
pub struct Bvh {
    /// The first one is the root, unless there is but one box.
    nodes: Vec<BoxPair>,
    count: usize,
}

struct BvhShape {
    bounds: Aabb,
    node: usize,
}

impl Bounded<f64, 3> for BvhShape {
    fn aabb(&self) -> CrateBox<f64, 3> {
        let point = |p: DVec3| Point3::new(p.x, p.y, p.z);
        CrateBox::with_bounds(point(self.bounds.min), point(self.bounds.max))
    }
}

impl BHShape<f64, 3> for BvhShape {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

impl Bvh {
    /// Boxes are finite and fewer than 2^30.
    pub fn of(boxes: impl IntoIterator<Item = Aabb>) -> Self {
        let mut shapes: Vec<BvhShape> =
            boxes.into_iter().map(|bounds| BvhShape { bounds: grown(&bounds), node: 0 }).collect();
        let tree = CrateBvh::build_with_executor(&mut shapes, in_parallel);
        // Inner nodes alone, in their order.
        let mut places = vec![0u32; tree.nodes.len()];
        let mut count = 0;
        for (place, node) in places.iter_mut().zip(&tree.nodes) {
            *place = match *node {
                BvhNode::Leaf { shape_index, .. } => shape_index as u32 | LEAF,
                BvhNode::Node { .. } => {
                    count += 1;
                    count - 1
                }
            };
        }
        let empty = BoxPair { boxes: [Aabb::EMPTY; 2], children: [0; 2] };
        let mut nodes = vec![empty; count as usize];
        // Children come after their parent: from the last to the first, each finds theirs done.
        for (index, node) in tree.nodes.iter().enumerate().rev() {
            let BvhNode::Node { child_l_index, child_r_index, .. } = *node else { continue };
            let children = [places[child_l_index], places[child_r_index]];
            let bounds = |child: u32| match child & LEAF {
                0 => nodes[child as usize].boxes[0].union(&nodes[child as usize].boxes[1]),
                _ => shapes[(child & !LEAF) as usize].bounds,
            };
            nodes[places[index] as usize] = BoxPair { boxes: children.map(bounds), children };
        }
        Self { nodes, count: shapes.len() }
    }

    /// Calls `visit` with each triangle whose box the ray meets between 0 and `limit`, near ones first as far as the tree knows.
    /// `visit` returns the limit from then on: a hit's distance to find the nearest, anything negative to stop.
    pub fn walk(&self, ray: &Ray, mut limit: f64, mut visit: impl FnMut(usize, f64) -> f64) {
        let mut stack = Stack::default();
        match self.count {
            0 => return,
            1 => stack.push((LEAF, 0.0)),
            _ => stack.push((0, 0.0)),
        }
        while let Some((child, entry)) = stack.pop() {
            if entry > limit {
                continue;
            }
            if child & LEAF != 0 {
                limit = visit((child & !LEAF) as usize, limit);
                continue;
            }
            let node = &self.nodes[child as usize];
            let entries = [entry_of(&node.boxes[0], ray, limit), entry_of(&node.boxes[1], ray, limit)];
            let met = |side: usize| entries[side].map(|entry| (node.children[side], entry));
            match [met(0), met(1)] {
                [Some(first), Some(second)] => {
                    let (near, far) = if first.1 <= second.1 { (first, second) } else { (second, first) };
                    stack.push(far);
                    stack.push(near);
                }
                [Some(only), None] | [None, Some(only)] => stack.push(only),
                [None, None] => {}
            }
        }
    }
}

/// A box with a little volume, so that a ray that runs within a face of it lies inside, not on a border of width 0.
fn grown(bounds: &Aabb) -> Aabb {
    let by = DVec3::splat(bounds.min.abs().max(bounds.max.abs()).max_element() * f64::EPSILON + 1e-270);
    Aabb { min: bounds.min - by, max: bounds.max + by }
}

/// As the crate's own executor, which is behind a feature that the project does not turn on.
fn in_parallel(left: BvhNodeBuildArgs<BvhShape, f64, 3>, right: BvhNodeBuildArgs<BvhShape, f64, 3>) {
    if left.node_count() + right.node_count() < 256 {
        left.build();
        right.build();
    } else {
        rayon::join(|| left.build_with_executor(in_parallel), || right.build_with_executor(in_parallel));
    }
}

/// Returns the distance at which a ray enters a box, if that is before `limit`.
fn entry_of(bounds: &Aabb, ray: &Ray, limit: f64) -> Option<f64> {
    let (low, high) = ((bounds.min - ray.origin) * ray.inverse, (bounds.max - ray.origin) * ray.inverse);
    let (near, far) = (low.min(high), low.max(high));
    let entry = near.x.max(near.y).max(near.z).max(0.0);
    // Three roundings at most on either side (Ize, "Robust BVH Ray Traversal", JCGT 2013).
    const SLACK: f64 = 1.0 + 8.0 * f64::EPSILON;
    let exit = far.x.min(far.y).min(far.z) * SLACK;
    (entry <= exit && entry <= limit * SLACK).then_some(entry)
}

/// The nodes still to visit. Trees are seldom deeper than the array; where one is, the rest goes to the heap.
struct Stack {
    first: [(u32, f64); Stack::DEPTH],
    count: usize,
    more: Vec<(u32, f64)>,
}

impl Stack {
    const DEPTH: usize = 64;

    fn push(&mut self, entry: (u32, f64)) {
        if self.count < Self::DEPTH {
            self.first[self.count] = entry;
            self.count += 1;
        } else {
            self.more.push(entry);
        }
    }

    fn pop(&mut self) -> Option<(u32, f64)> {
        self.more.pop().or_else(|| {
            self.count = self.count.checked_sub(1)?;
            Some(self.first[self.count])
        })
    }
}

impl Default for Stack {
    fn default() -> Self {
        Self { first: [(0, 0.0); Self::DEPTH], count: 0, more: Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random_boxes(count: usize, random: &mut fastrand::Rng) -> Vec<Aabb> {
        let mut vector = || DVec3::new(random.f64(), random.f64(), random.f64());
        (0..count)
            .map(|index| {
                let (low, mut size) = (vector() * 10.0, vector() * 0.3);
                // Flat ones, points, and heaps of the same.
                size[index % 3] = 0.0;
                if index % 17 == 0 {
                    Aabb::of_points([DVec3::ONE, DVec3::ONE])
                } else {
                    Aabb { min: low, max: low + size }
                }
            })
            .collect()
    }

    #[test]
    fn the_tree_finds_what_a_search_of_all_boxes_finds() {
        let mut random = fastrand::Rng::with_seed(7);
        for count in [0, 1, 2, 3, 1000] {
            let boxes = random_boxes(count, &mut random);
            let tree = Bvh::of(boxes.iter().copied());
            for turn in 0..200 {
                let mut vector = || DVec3::new(random.f64(), random.f64(), random.f64());
                let (origin, mut direction) = (vector() * 10.0, vector() - 0.5);
                if turn % 5 == 0 {
                    direction = [DVec3::X, DVec3::NEG_Y, DVec3::Z][turn % 3];
                }
                let ray = Ray::new(if turn % 7 == 0 { DVec3::ONE - direction * 2.0 } else { origin }, direction);
                let mut found = Vec::new();
                tree.walk(&ray, 9.0, |index, limit| {
                    found.push(index);
                    limit
                });
                found.sort_unstable();
                let met = |index: &usize| entry_of(&grown(&boxes[*index]), &ray, 9.0).is_some();
                let all: Vec<usize> = (0..count).filter(met).collect();
                let expected = if count == 1 { vec![0] } else { all };
                assert_eq!(found, expected, "{count} {turn}");
            }
        }
    }

    #[test]
    fn a_limit_that_shrinks_ends_the_walk() {
        let boxes = (0..100).map(|i| Aabb::of_points([DVec3::X * f64::from(i), DVec3::X * (f64::from(i) + 0.5)]));
        let tree = Bvh::of(boxes);
        let mut visited = 0;
        tree.walk(&Ray::new(DVec3::NEG_X, DVec3::X), f64::INFINITY, |index, _| {
            visited += 1;
            index as f64 + 1.0
        });
        assert!(visited < 5, "{visited}");
    }

    #[test]
    fn a_tree_of_any_depth_is_walked() {
        // Each box a tenth of the one before: the heuristic parts one at a time.
        let boxes: Vec<Aabb> = (0..250).map(|i| Aabb::of_points([DVec3::ZERO, DVec3::X * 10f64.powi(-i)])).collect();
        let tree = Bvh::of(boxes);
        let mut visited = 0;
        tree.walk(&Ray::new(DVec3::NEG_X, DVec3::X), f64::INFINITY, |_, limit| {
            visited += 1;
            limit
        });
        assert_eq!(visited, 250);
    }
}
