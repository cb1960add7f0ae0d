//! The effect of a hazard on a frame, without Vulkan's terms: one party touches a memory before another is done with it.

use super::program::{Memory, MemoryAccess, Who};
use afterlight::frame::rows::Endpoint;
use afterlight::passes::Resource;
use afterlight::plan::Target;

/// The action of the later use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum LaterAction {
    Read,
    Overwrite,
    ChangeLayout,
    Find,
}

/// A sentence of which the memory is kept apart, so that hazards of several images become one sentence.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Consequence {
    action: LaterAction,
    who: String,
    memory: &'static str,
    /// The fault.
    clause: String,
}

/// Each different sentence once; reads of wrong values come before writes and layout changes that are too soon.
pub fn in_words<'a>(consequences: impl IntoIterator<Item = &'a Consequence>) -> Vec<String> {
    let mut sentences: Vec<(&Consequence, Vec<&str>)> = Vec::new();
    for one in consequences {
        let same = |(own, _): &&mut (&Consequence, Vec<&str>)| {
            (own.action, &own.who, &own.clause) == (one.action, &one.who, &one.clause)
        };
        match sentences.iter_mut().find(same) {
            Some((_, memories)) if memories.contains(&one.memory) => {}
            Some((_, memories)) => memories.push(one.memory),
            None => sentences.push((one, vec![one.memory])),
        }
    }
    sentences.sort_by_key(|(one, _)| one.action);
    sentences.into_iter().map(|(one, memories)| one.sentence(&memories)).collect()
}

impl Consequence {
    /// Of two touches that nothing orders; `overtaken` is a touch that the first, a layout change, does not wait for.
    pub(super) fn of(first: &MemoryAccess, overtaken: Option<&MemoryAccess>, second: &MemoryAccess) -> Self {
        let action = match second {
            touch if touch.is_change() => LaterAction::ChangeLayout,
            touch if touch.is_write() => LaterAction::Overwrite,
            _ => LaterAction::Read,
        };
        let before = blamed(first, overtaken, second);
        let unfinished = |does: &str| format!("that {}{} has not finished {does}", who(before), when(before, second));
        let clause = match before {
            touch if touch.is_change() && second.is_change() => unfinished("changing"),
            touch if touch.is_change() => "before the layout is the right one".to_owned(),
            touch if touch.is_write() => unfinished("writing"),
            _ => unfinished("reading"),
        };
        Self { action, who: who(second), memory: noun(second.memory), clause }
    }

    /// The consequence of an image in another layout than a touch needs.
    pub(super) fn of_layout(found: &str, touch: &MemoryAccess) -> Self {
        let clause = format!("in the layout {found} instead of {:?}", touch.layout);
        Self { action: LaterAction::Find, who: who(touch), memory: noun(touch.memory), clause }
    }

    /// The consequence of a touch by a queue that does not own the memory.
    pub(super) fn of_owner(found: &str, touch: &MemoryAccess) -> Self {
        Self { action: LaterAction::Find, who: who(touch), memory: noun(touch.memory), clause: found.to_owned() }
    }

    fn sentence(&self, memories: &[&str]) -> String {
        let what = match memories {
            [] => String::new(),
            [one] => (*one).to_owned(),
            [most @ .., last] => format!("{} and {last}", most.join(", ")),
        };
        let verb = match self.action {
            LaterAction::Read => "read",
            LaterAction::Overwrite => "overwrite",
            LaterAction::ChangeLayout => "change the layout of",
            LaterAction::Find => "find",
        };
        format!("{} may {verb} {what} {}", self.who, self.clause)
    }
}

/// The earlier use to tell of: `first`, or the use that it overtook if it is a layout change, since a change that waits for nothing is no news to
/// later uses.
pub(super) fn blamed<'a>(
    first: &'a MemoryAccess,
    overtaken: Option<&'a MemoryAccess>,
    second: &MemoryAccess,
) -> &'a MemoryAccess {
    overtaken.filter(|_| first.is_change() && !second.is_change()).unwrap_or(first)
}

fn who(touch: &MemoryAccess) -> String {
    match touch.who {
        Who::At(Endpoint::HOST) => "the CPU".into(),
        Who::At(Endpoint::PRESENTATION) => "presentation".into(),
        Who::At(Endpoint::UPLOAD) => "the upload".into(),
        Who::At(Endpoint::CLEAR) => "the first clear".into(),
        Who::At(Endpoint::DEVICE) => "the dispatch".into(),
        Who::At(place) => place.to_string(),
        Who::Row(name) => format!("the barrier {name}"),
        Who::End(pass) => format!("the end of the {pass}"),
    }
}

/// The frame of the first of two touches, where that is another than the second's.
fn when(first: &MemoryAccess, second: &MemoryAccess) -> &'static str {
    match second.frame.saturating_sub(first.frame) {
        _ if first.frame == 0 => "",
        0 => "",
        1 => " of the last frame",
        _ => " of an earlier frame",
    }
}

pub(super) fn noun(memory: Memory) -> &'static str {
    match memory.resource {
        Resource::Target(target) => match target {
            Target::Depth => "depth",
            Target::Albedo => "albedo",
            Target::Normal => "normals",
            Target::Material => "materials",
            Target::Specular => "specular colours",
            Target::Position => "positions",
            Target::Occluders => "depth of large objects",
            Target::Count => "counts of fragments",
            Target::Triangle => "numbers of triangles",
            Target::Accumulation => "sums of transparent light",
            Target::Weights => "sums of weights",
            Target::Hdr => "light",
            Target::Samples => "samples of light",
            Target::Output => "the picture",
            own => own.own().map_or("a target", |own| own.noun),
        },
        Resource::SwapchainImage => "the window's image",
        Resource::ShownImage => "the image that is encoded",
        Resource::Maps(own) => own.noun(),
        Resource::Textures => "a texture",
        Resource::SkyLight => "light of the sky",
        Resource::Vertices => "vertices",
        Resource::RestMeshes => "meshes at rest",
        Resource::DeformedVertices => "deformed vertices",
        Resource::CulledInstances => "culled instances",
        Resource::FoundCounts => "counts of instances",
        Resource::DepthPyramid => "least depths",
        Resource::Buffers(own) | Resource::Kept(own) | Resource::KeptBefore(own) => own.0,
        Resource::Indices => "indices",
        Resource::Staging => "a staging buffer",
        Resource::FrameData => "cameras and lights",
        Resource::ReadBack => "the copy of the picture",
        Resource::PanelTextures => "a panel's texture",
    }
}
