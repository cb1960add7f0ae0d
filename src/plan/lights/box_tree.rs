//! A tree of boxes, to ask which of many touch something.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::Reach;
use crate::scene::Aabb;

/// A binary tree of boxes, split at the median of the longest axis.
#[derive(Debug, Clone, Default)]
pub struct BoxTree {
    /// A node, then its first half, then its second.
    nodes: Vec<BoxNode>,
    /// The leaf of each box, by number; `None` for empty boxes.
    leaves: Vec<Option<u32>>,
}

#[derive(Debug, Clone)]
struct BoxNode {
    bounds: Aabb,
    /// Half the diagonal of the largest box below.
    largest: f64,
    /// The number of the box, in a leaf.
    item: usize,
    /// The index after the last node below this one.
    end: usize,
    /// The parent node; the root is its own parent.
    parent: usize,
}

/// The position of a box relative to a volume that may hold it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Containment {
    Outside,
    Across,
    Inside,
}

impl BoxTree {
    /// Of these boxes, which are numbered in their order; empty ones hold nothing and are left out.
    pub fn of(boxes: impl IntoIterator<Item = Aabb>) -> Self {
        let mut all: Vec<(usize, Aabb)> = boxes.into_iter().enumerate().collect();
        let mut tree = Self { nodes: Vec::with_capacity(2 * all.len()), leaves: vec![None; all.len()] };
        all.retain(|(_, bounds)| !bounds.is_empty());
        if !all.is_empty() {
            tree.add(&mut all, 0);
        }
        tree
    }

    /// The box around all.
    pub fn bounds(&self) -> Aabb {
        self.nodes.first().map_or(Aabb::EMPTY, |node| node.bounds)
    }

    fn add(&mut self, boxes: &mut [(usize, Aabb)], parent: usize) {
        let bounds = boxes.iter().fold(Aabb::EMPTY, |all, (_, bounds)| all.union(bounds));
        let own = self.nodes.len();
        self.nodes.push(BoxNode { bounds, largest: bounds.radius(), item: boxes[0].0, end: own + 1, parent });
        if boxes.len() > 1 {
            let (axis, middle) = (bounds.size().max_position(), boxes.len() / 2);
            boxes.select_nth_unstable_by(middle, |a, b| a.1.center()[axis].total_cmp(&b.1.center()[axis]));
            let (first, second) = boxes.split_at_mut(middle);
            self.add(first, own);
            self.add(second, own);
            self.nodes[own].end = self.nodes.len();
            self.gather(own);
        } else {
            self.leaves[boxes[0].0] = Some(own as u32);
        }
    }

    /// Updates the boxes with these numbers to `bounds`. The tree keeps its structure: queries find the same boxes, but more slowly the farther boxes
    /// have moved. Boxes that were empty stay out.
    pub fn refit(&mut self, moved: impl ExactSizeIterator<Item = usize>, bounds: impl Fn(usize) -> Aabb) {
        // An upper bound of the nodes to update: each moved box updates its ancestors, many of which are shared.
        let ways = moved.len() * self.nodes.len().max(2).ilog2() as usize;
        let leaves: Vec<usize> = moved.filter_map(|item| self.leaves[item]).map(|leaf| leaf as usize).collect();
        for &leaf in &leaves {
            let node = &mut self.nodes[leaf];
            node.bounds = bounds(node.item);
            node.largest = node.bounds.radius();
        }
        if ways > self.nodes.len() {
            (0..self.nodes.len()).rev().for_each(|node| self.gather(node));
            return;
        }
        for mut node in leaves {
            while node != 0 {
                node = self.nodes[node].parent;
                self.gather(node);
            }
        }
    }

    /// Sets a node's `bounds` and `largest` from its two halves.
    fn gather(&mut self, node: usize) {
        let (first, end) = (node + 1, self.nodes[node].end);
        if end > first {
            let second = self.nodes[first].end;
            let [a, b] = [first, second].map(|half| &self.nodes[half]);
            let (bounds, largest) = (a.bounds.union(&b.bounds), a.largest.max(b.largest));
            (self.nodes[node].bounds, self.nodes[node].largest) = (bounds, largest);
        }
    }

    /// The numbers of the boxes that have a size, from the largest to the smallest; equally large ones keep their order in the tree. `size` gets a
    /// box and half the diagonal of the largest box in it, and must not be smaller for an enclosing box.
    pub fn largest_first(&self, size: impl Fn(&Aabb, f64) -> Option<f64>) -> impl Iterator<Item = usize> {
        let sized = move |index: usize| {
            let size = size(&self.nodes[index].bounds, self.nodes[index].largest)?;
            // Floats that are not negative are ordered as their bits are.
            Some((size.max(0.0).to_bits(), Reverse(index)))
        };
        let mut open: BinaryHeap<_> = (0..self.nodes.len().min(1)).filter_map(&sized).collect();
        std::iter::from_fn(move || {
            while let Some((_, Reverse(index))) = open.pop() {
                let first = index + 1;
                if self.nodes[index].end == first {
                    return Some(self.nodes[index].item);
                }
                open.extend([first, self.nodes[first].end].into_iter().filter_map(&sized));
            }
            None
        })
    }

    /// Calls `each` with the numbers of the boxes that are not outside. Boxes within one that is inside are not asked about.
    pub fn sort_out(&self, side: impl Fn(&Aabb) -> Containment, mut each: impl FnMut(usize)) {
        let mut index = 0;
        while let Some(node) = self.nodes.get(index) {
            match side(&node.bounds) {
                Containment::Across if node.end > index + 1 => index += 1,
                Containment::Outside => index = node.end,
                Containment::Across | Containment::Inside => {
                    let below = self.nodes[index..node.end].iter().zip(index + 1..);
                    below.filter(|(node, next)| node.end == *next).for_each(|(leaf, _)| each(leaf.item));
                    index = node.end;
                }
            }
        }
    }

    /// The boxes for which the test holds, by their numbers. A test that holds for a box must hold for each box around it.
    pub fn each(&self, mut test: impl FnMut(&Aabb) -> bool) -> impl Iterator<Item = usize> {
        let mut index = 0;
        std::iter::from_fn(move || {
            while let Some(node) = self.nodes.get(index) {
                if !test(&node.bounds) {
                    index = node.end;
                    continue;
                }
                index += 1;
                if node.end == index {
                    return Some(node.item);
                }
            }
            None
        })
    }

    /// Returns true if any of the boxes comes into a sphere.
    pub fn touches(&self, sphere: &Reach) -> bool {
        self.each(|bounds| sphere.touches(bounds)).next().is_some()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::plan::samples::vector;

    proptest! {
        #[test]
        fn the_tree_finds_what_a_look_at_each_box_finds(
            boxes in proptest::collection::vec((vector(9.0), vector(2.0)), 0..40), center in vector(12.0), radius in 0.0..4.0f64,
        ) {
            let boxes: Vec<Aabb> = boxes.into_iter().map(|(at, size)| Aabb { min: at, max: at + size }).collect();
            let tree = BoxTree::of(boxes.iter().copied());
            let sphere = Reach { center, radius };
            let touched = |bounds: &Aabb| !bounds.is_empty() && center.clamp(bounds.min, bounds.max).distance(center) <= radius;
            let expected: Vec<usize> = (0..boxes.len()).filter(|&index| touched(&boxes[index])).collect();
            let mut found: Vec<usize> = tree.each(|bounds| sphere.touches(bounds)).collect();
            found.sort_unstable();
            prop_assert_eq!(tree.touches(&sphere), !expected.is_empty());
            prop_assert_eq!(found, expected);
        }

        #[test]
        fn a_tree_whose_boxes_have_moved_finds_them_where_they_are(
            boxes in proptest::collection::vec((vector(9.0), vector(2.0)), 1..40), center in vector(12.0), radius in 0.0..4.0f64,
            moves in proptest::collection::vec((0..40usize, vector(20.0)), 0..20),
        ) {
            let mut boxes: Vec<Aabb> = boxes.into_iter().map(|(at, size)| Aabb { min: at, max: at + size.abs() }).collect();
            let mut tree = BoxTree::of(boxes.iter().copied());
            let mut moved = Vec::new();
            for (item, by) in moves.into_iter().filter(|(item, _)| *item < boxes.len()).collect::<Vec<_>>() {
                boxes[item] = Aabb { min: boxes[item].min + by, max: boxes[item].max + by };
                moved.push(item);
            }
            tree.refit(moved.into_iter(), |item| boxes[item]);
            let sphere = Reach { center, radius };
            let expected: Vec<usize> = (0..boxes.len()).filter(|&index| sphere.touches(&boxes[index])).collect();
            let mut found: Vec<usize> = tree.each(|bounds| sphere.touches(bounds)).collect();
            found.sort_unstable();
            prop_assert_eq!(&found, &expected);
            let side = |bounds: &Aabb| match (sphere.touches(bounds), bounds.corners().iter().all(|&corner| corner.distance(center) <= radius)) {
                (_, true) => Containment::Inside,
                (true, false) => Containment::Across,
                (false, false) => Containment::Outside,
            };
            found.clear();
            tree.sort_out(side, |item| found.push(item));
            found.sort_unstable();
            prop_assert_eq!(found, expected);
        }
    }
}
