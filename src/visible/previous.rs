//! Places in the frame before, of the objects that have moved since.

use std::collections::BTreeMap;

use glam::DAffine3;

use super::{Draw, FrameProjection, Visible, World};

/// The objects that have moved since the last frame, if the plan asks for them.
#[derive(Debug, Clone, Default)]
pub struct PreviousTransforms {
    is_kept: bool,
    /// The previous transforms, by index into [`World::objects`].
    moved: BTreeMap<usize, DAffine3>,
}

/// An instance that has moved, and its previous transform.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MovedDraw {
    /// One instance of its mesh.
    pub draw: Draw,
    pub before: DAffine3,
}

impl PreviousTransforms {
    pub(super) fn new(is_kept: bool) -> Self {
        Self { is_kept, moved: BTreeMap::new() }
    }

    /// An object leaves where it stood.
    pub(super) fn leave(&mut self, index: usize, stood: DAffine3) {
        if self.is_kept {
            self.moved.entry(index).or_insert(stood);
        }
    }

    /// Begins anew, for the frame after one that was drawn.
    pub fn forget(&mut self) {
        self.moved.clear();
    }
}

impl Visible {
    /// The opaque instances of a frame that have moved since the one before.
    pub fn moved(&self, world: &World) -> Vec<MovedDraw> {
        if world.previous.moved.is_empty() {
            return Vec::new();
        }
        let instances = self.draws.iter().flat_map(|draw| {
            draw.instances().map(|first| Draw {
                object: self.instances[first as usize] as usize,
                first,
                count: 1,
                ..*draw
            })
        });
        instances
            .filter_map(|draw| Some(MovedDraw { draw, before: *world.previous.moved.get(&draw.object)? }))
            .collect()
    }
}

/// A frame and the previous one, by which surfaces find their previous places in the picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Reprojection {
    pub current: FrameProjection,
    /// `None` if there is no previous frame, or it showed something else.
    pub previous: Option<FrameProjection>,
    /// No surface and no light has changed, and the camera has not.
    pub still: bool,
    /// The factor from the previous frame's exposure to this one's.
    pub exposed: f32,
    /// The place in each pixel through which this frame looks, in pixels to the right and down from the centre.
    pub jitter: [f64; 2],
    pub moved: Vec<MovedDraw>,
}
