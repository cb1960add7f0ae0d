//! A tree of boxes, to ask whether any of many touches something.

use super::Reach;
use crate::scene::Aabb;

/// Boxes by where they are: a binary tree, cut at the median of the longest axis.
#[derive(Debug, Clone, Default)]
pub struct BoxTree {
    /// A node, then its first half, then its second.
    nodes: Vec<Node>,
}

#[derive(Debug, Clone)]
struct Node {
    bounds: Aabb,
    /// Its number, of a leaf's box.
    item: usize,
    /// The node after all that are below this one. A leaf has none below.
    end: usize,
}

impl BoxTree {
    /// Of these boxes, which are numbered in their order; empty ones hold nothing and are left out.
    pub fn of(boxes: impl IntoIterator<Item = Aabb>) -> Self {
        let mut boxes: Vec<(usize, Aabb)> =
            boxes.into_iter().enumerate().filter(|(_, bounds)| !bounds.is_empty()).collect();
        let mut tree = Self { nodes: Vec::with_capacity(2 * boxes.len()) };
        if !boxes.is_empty() {
            tree.add(&mut boxes);
        }
        tree
    }

    fn add(&mut self, boxes: &mut [(usize, Aabb)]) {
        let bounds = boxes.iter().fold(Aabb::EMPTY, |all, (_, bounds)| all.union(bounds));
        let own = self.nodes.len();
        self.nodes.push(Node { bounds, item: boxes[0].0, end: own + 1 });
        if boxes.len() > 1 {
            let (axis, middle) = (bounds.size().max_position(), boxes.len() / 2);
            boxes.select_nth_unstable_by(middle, |a, b| a.1.center()[axis].total_cmp(&b.1.center()[axis]));
            let (first, second) = boxes.split_at_mut(middle);
            self.add(first);
            self.add(second);
            self.nodes[own].end = self.nodes.len();
        }
    }

    /// The boxes for which the test holds, by their numbers. What holds for a box must hold for each box around it.
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

    /// Whether any of the boxes comes into a sphere.
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
    }
}
