//! Pipelines that were given up and may be asked for again: other settings and back, one renderer after another on a device.
//!
//! A driver compiles a pipeline for milliseconds to seconds. A dropped pipeline is therefore kept for a while, and the next request for the same
//! content gets it: the same shaders, constants and states, and a layout and a render pass that are compatible because they were made of the same
//! parts. It is never shared: at any time it has one owner, or none. The layouts that it was made with may be gone by then, which needs
//! VK_KHR_maintenance4: without that nothing is kept.

use std::collections::{HashMap, VecDeque};
use std::fmt::Debug;
use std::sync::{Mutex, MutexGuard, PoisonError};

use ash::vk::{self, Handle};

use super::device::Device;
use super::owned::{Destroy, ObjectId};

/// The hash of everything that an object was made of.
pub(super) type ContentHash = blake3::Hash;

/// The most pipelines that are kept. The hall's frame has six.
const MOST: usize = 128;

/// The pipelines that a device keeps for reuse.
#[derive(Default)]
pub(super) struct Reuse(Mutex<ReuseState>);

#[derive(Default)]
struct ReuseState {
    /// The contents of the layouts and render passes that pipelines are made with.
    contents: HashMap<(vk::ObjectType, u64), ContentHash>,
    /// The dropped pipelines, oldest first.
    kept: VecDeque<(ContentHash, vk::Pipeline, ObjectId)>,
}

impl Reuse {
    fn lock(&self) -> MutexGuard<'_, ReuseState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes the content that an object was made of, as `parts` say.
    pub(super) fn note<H: Destroy>(&self, object: H, parts: impl Debug) {
        self.lock().contents.insert((H::TYPE, object.as_raw()), content_of(parts));
    }

    /// The content noted for an object, if any was.
    pub(super) fn content<H: Handle>(&self, object: H) -> Option<ContentHash> {
        self.lock().contents.get(&(H::TYPE, object.as_raw())).copied()
    }

    /// Forgets an object before it is destroyed: another one may get its handle.
    pub(super) fn forget(&self, object_type: vk::ObjectType, raw: u64) {
        self.lock().contents.remove(&(object_type, raw));
    }

    /// A pipeline of this content that nobody owns.
    pub(super) fn take(&self, content: ContentHash) -> Option<(vk::Pipeline, ObjectId)> {
        let kept = &mut self.lock().kept;
        let index = kept.iter().rposition(|(own, ..)| *own == content)?;
        kept.remove(index).map(|(_, raw, id)| (raw, id))
    }
}

/// The hash of a description. Numbers and flags are written whole.
pub(super) fn content_of(parts: impl Debug) -> ContentHash {
    blake3::hash(format!("{parts:?}").as_bytes())
}

impl Device {
    /// Keeps a pipeline that its owner gave up. The oldest goes if there are too many.
    pub(super) fn keep(&self, content: ContentHash, raw: vk::Pipeline, id: ObjectId) {
        self.registry.mark_retired(id);
        let too_many = {
            let kept = &mut self.reuse.lock().kept;
            kept.push_back((content, raw, id));
            if kept.len() > MOST { kept.pop_front() } else { None }
        };
        if let Some((_, raw, id)) = too_many {
            self.retire(raw, id, None);
        }
    }

    /// Retires all that is kept.
    pub(super) fn give_up_kept(&self) {
        let kept = std::mem::take(&mut self.reuse.lock().kept);
        for (_, raw, id) in kept {
            self.retire(raw, id, None);
        }
    }
}
