//! The declaration of a pass, written once, in the pass's own file. Attachments, references, layouts, labels, times, the proof of dependencies, the graph
//! and the window's steps follow from the list of a plan's passes ([`crate::frame::list`]).

use std::fmt;

use ash::vk;

use super::object::Make;
use crate::gpu::sync::{Layouts, SyncVersion, Use};
use crate::plan::{BufferName, FramePlan, Target};
use crate::scene::Settings;

/// A pass of the frame.
pub struct Pass {
    /// Name in rows, captures and reports: the file's name in capitals.
    pub name: Endpoint,
    /// Name of the pass's time in tables. Passes that do the same work in different frames share a name, so that they can be compared.
    pub time: &'static str,
    /// The work of the pass, in a few words.
    pub what: &'static str,
    /// Decides whether a plan's frames have the pass.
    pub presence: fn(&FramePlan) -> Presence,
    /// Resources that the pass reads and writes, in frames that have it.
    pub touches: fn(&FramePlan) -> Vec<ResourceUse>,
    /// Changes settings so that they leave the pass out; `None` for a pass that no single setting decides.
    pub leave_out: Option<fn(&mut Settings)>,
    /// Makes the pass's object; `None` for a pass that is recorded outside of the renderer's own part of a frame.
    pub make: Option<Make>,
}

impl Pass {
    /// The uses of the pass in a plan's frames, as [`Pass::touches`] declares them.
    pub fn uses(&self, plan: &FramePlan) -> Vec<ResourceUse> {
        (self.touches)(plan).into_iter().map(|touch| touch.in_frames_of(plan)).collect()
    }
}

/// The presence of a pass in a plan's frames, or its absence, with the reason, as `inspect` prints it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Presence {
    In(String),
    Out(String),
}

impl Presence {
    /// `In` if `is_in`, with the reason `why`; otherwise `Out` with `why_not`.
    pub fn when(is_in: bool, why: &str, why_not: &str) -> Self {
        if is_in { Self::In(why.into()) } else { Self::Out(why_not.into()) }
    }

    /// `In` if the plan has the part, with the part's own description as the reason.
    pub fn of(part: Option<&impl fmt::Display>, why_not: &str) -> Self {
        part.map_or_else(|| Self::Out(why_not.into()), |own| Self::In(own.to_string()))
    }

    pub fn is_in(&self) -> bool {
        matches!(self, Self::In(_))
    }
}

/// The place of a use: a pass, or something outside the frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Endpoint {
    name: &'static str,
    is_pass: bool,
}

impl Endpoint {
    /// Before or after the span that a row belongs to, in this frame or another.
    pub const OUTSIDE: Self = Self::beside("OUTSIDE");
    /// Copies out of staging buffers, and blits from level to level of a texture.
    pub const UPLOAD: Self = Self::beside("UPLOAD");
    /// The clear that the shadow maps' image begins with.
    pub const CLEAR: Self = Self::beside("CLEAR");
    /// Every pass that draws the scene's meshes with its textures.
    pub const DRAWS: Self = Self::beside("DRAWS");
    /// The presentation engine.
    pub const PRESENTATION: Self = Self::beside("PRESENTATION");
    /// Everything that one submission does on the device.
    pub const DEVICE: Self = Self::beside("DEVICE");
    /// The CPU.
    pub const HOST: Self = Self::beside("HOST");

    /// The place of the pass with this name.
    pub const fn pass(name: &'static str) -> Self {
        Self { name, is_pass: true }
    }

    /// A place outside the passes of a frame.
    pub const fn beside(name: &'static str) -> Self {
        Self { name, is_pass: false }
    }

    /// Returns true if it is a pass, which the list of a frame's passes may have.
    pub const fn is_pass(self) -> bool {
        self.is_pass
    }

    /// Returns the name in capitals, as rows and reports print it: `LIGHTING`.
    pub const fn name(self) -> &'static str {
        self.name
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// A resource that passes touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Resource {
    Target(Target),
    /// An image of the swapchain, where the picture itself is not drawn into one.
    SwapchainImage,
    /// The image that ENCODE reads, where the picture itself is kept.
    ShownImage,
    /// An image with a part for each shadow map.
    Maps(MapImage),
    /// Textures of the scene, and its sky.
    Textures,
    /// The sky's prefiltered diffuse and specular light.
    SkyLight,
    /// Vertices of the scene's meshes, and of light volumes.
    Vertices,
    /// The rest pose of deformed meshes.
    RestMeshes,
    /// Vertices that SKIN writes.
    DeformedVertices,
    Indices,
    /// The outputs of CULL, ARRANGE and FILL: rows of instances, and the indirect commands that draw them.
    CulledInstances,
    /// The number of instances that ARRANGE found visible, for the CPU: one for each frame in flight.
    FoundCounts,
    /// The least depths of squares of the picture, which PYRAMID writes.
    DepthPyramid,
    /// Buffers that passes of an effect write and read. Frames share them.
    Buffers(BufferName),
    /// A buffer that this frame writes for the next one.
    Kept(BufferName),
    /// The buffer that the previous frame wrote for this one.
    KeptBefore(BufferName),
    /// The CPU's data for each frame: camera, lights, lists, instances, sorted indices.
    FrameData,
    /// The buffer that the picture is copied to for the CPU.
    ReadBack,
    /// Textures of a window's panels.
    PanelTextures,
    /// Buffers from which uploads are copied.
    Staging,
}

/// The images of shadow maps. A map is a part of each of them. Each map is drawn in a separate render pass, and kept for later frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum MapImage {
    Depth,
    /// The share of light that transparent surfaces let through.
    Tints,
}

impl Resource {
    /// The depth of all shadow maps.
    pub const SHADOW_MAPS: Self = Self::Maps(MapImage::Depth);
    /// The tints of all shadow maps.
    pub const SHADOW_TINTS: Self = Self::Maps(MapImage::Tints);
}

impl MapImage {
    /// A part of it, as sentences call it.
    pub fn noun(self) -> &'static str {
        match self {
            Self::Depth => "a shadow map",
            Self::Tints => "the tints of a shadow map",
        }
    }
}

impl fmt::Display for Resource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Target(Target::Redrawn(_)) => "picture",
            Self::Target(target) => return f.write_str(&target.to_string().to_lowercase()),
            Self::SwapchainImage => "swapchain image",
            Self::ShownImage => "shown image",
            Self::Maps(MapImage::Depth) => "shadow maps",
            Self::Maps(MapImage::Tints) => "shadow tints",
            Self::Textures => "textures",
            Self::SkyLight => "light of the sky",
            Self::Vertices => "vertices",
            Self::RestMeshes => "meshes at rest",
            Self::DeformedVertices => "deformed vertices",
            Self::Indices => "indices",
            Self::CulledInstances => "culled instances",
            Self::FoundCounts => "counts of instances",
            Self::DepthPyramid => "pyramid of depths",
            Self::Buffers(own) | Self::Kept(own) => own.0,
            Self::KeptBefore(own) => return write!(f, "{} of the frame before", own.0),
            Self::FrameData => "frame data",
            Self::ReadBack => "read-back buffer",
            Self::PanelTextures => "panel textures",
            Self::Staging => "staging buffers",
        })
    }
}

/// One way in which a pass uses a resource.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ResourceUse {
    pub resource: Resource,
    pub how: UseKind,
    /// Stages and accesses. An attachment that is blended, or depth that is written, shows here.
    pub uses: Use,
    /// The layouts of the frame's images.
    pub layouts: Layouts,
    /// The layout that an attachment has throughout the rendering that the use is in, where that is not the use's own.
    pub throughout: Option<vk::ImageLayout>,
    /// Invocations for one sample read the other samples of their pixel as well.
    pub all_samples: bool,
    /// What the pass does with the resource, in words that follow its name: the reason of the rows by which it waits.
    pub why: &'static str,
}

/// The role in which a pass uses a resource.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UseKind {
    /// An input attachment, read at the own pixel. Bindings in their order have the `InputAttachmentIndex` 0, 1, ...
    Input {
        binding: u32,
    },
    /// A colour attachment at a location of the shader's outputs.
    Color {
        location: u32,
        first: ContentsIfFirst,
    },
    /// The depth attachment.
    Depth {
        first: ContentsIfFirst,
    },
    /// The resolve target of the samples that the subpass draws.
    Resolve,
    /// An image that shaders load or sample anywhere, also at the pixel's neighbours. So no subpass can read its own render pass's output this way.
    Sampled {
        binding: u32,
    },
    /// An image that a compute shader stores to.
    Storage {
        binding: u32,
    },
    CopiedFrom,
    CopiedTo,
    /// Shown by presentation.
    Presented,
    /// A buffer.
    Buffer,
}

/// The contents of an attachment where this use is the first of the frame. They do not count after another one: then the attachment is loaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ContentsIfFirst {
    /// The value that [`crate::frame`] clears the target to.
    Clear,
    /// Anything: it writes every pixel that is read afterwards.
    Undefined,
}

impl ResourceUse {
    /// With several samples a pixel, an invocation touches only its own sample.
    pub const fn new(resource: Resource, how: UseKind, uses: Use) -> Self {
        let layouts = Layouts::Optimal;
        Self { resource, how, uses, layouts, throughout: None, all_samples: false, why: "" }
    }

    const fn target(target: Target, how: UseKind, uses: Use) -> Self {
        Self::new(Resource::Target(target), how, uses)
    }

    /// Reads its own pixel of an attachment.
    pub const fn input(binding: u32, target: Target, uses: Use) -> Self {
        Self::target(target, UseKind::Input { binding }, uses)
    }

    /// Where `all`, an invocation reads all samples of its pixel, whichever of them it draws.
    pub const fn of_all_samples(self, all: bool) -> Self {
        Self { all_samples: all, ..self }
    }

    /// Returns true if both use the same resource in the same way, whatever their reasons.
    pub fn is_use_of(&self, other: &Self) -> bool {
        self.because("") == other.because("")
    }

    /// Sets the reason for which the pass uses the resource.
    pub const fn because(self, why: &'static str) -> Self {
        Self { why, ..self }
    }

    /// Draws into an attachment, or blends over it where `uses` reads.
    pub const fn color(location: u32, target: Target, first: ContentsIfFirst, uses: Use) -> Self {
        Self::target(target, UseKind::Color { location, first }, uses)
    }

    /// Tests against depth, and writes it where `uses` writes.
    pub const fn depth(first: ContentsIfFirst, uses: Use) -> Self {
        Self::depth_of(Target::Depth, first, uses)
    }

    /// Variant of [`Self::depth`] for this depth target.
    pub const fn depth_of(target: Target, first: ContentsIfFirst, uses: Use) -> Self {
        Self::target(target, UseKind::Depth { first }, uses)
    }

    /// Has the render pass resolve samples into an attachment after the subpass.
    pub const fn resolve(target: Target, uses: Use) -> Self {
        Self::target(target, UseKind::Resolve, uses)
    }

    /// Loads or samples a target, its pixel's neighbours too.
    pub const fn sampled(binding: u32, target: Target, uses: Use) -> Self {
        Self::target(target, UseKind::Sampled { binding }, uses)
    }

    /// Stores to a target.
    pub const fn storage(binding: u32, target: Target, uses: Use) -> Self {
        Self::target(target, UseKind::Storage { binding }, uses)
    }

    /// Reads a resource that is not a target in a shader, or writes it if `uses` writes.
    pub const fn resource(resource: Resource, uses: Use) -> Self {
        let how = match resource {
            Resource::Maps(_) | Resource::Textures | Resource::SkyLight | Resource::PanelTextures => {
                UseKind::Sampled { binding: 0 }
            }
            _ => UseKind::Buffer,
        };
        Self::new(resource, how, uses)
    }

    pub fn writes(&self) -> bool {
        self.uses.writes().access != vk::AccessFlags2::empty()
    }

    /// Returns true if it is an attachment of the render pass.
    pub fn is_attachment(&self) -> bool {
        matches!(self.how, UseKind::Input { .. } | UseKind::Color { .. } | UseKind::Depth { .. } | UseKind::Resolve)
    }

    /// Returns true if the resource is an image of depths.
    pub fn is_depth(&self) -> bool {
        matches!(self.resource, Resource::Target(Target::Depth | Target::Occluders) | Resource::SHADOW_MAPS)
    }

    /// The load operation's use, for an attachment: depth in EARLY_FRAGMENT_TESTS, colour in COLOR_ATTACHMENT_OUTPUT.
    pub(crate) fn load(&self) -> Use {
        use vk::{AccessFlags2 as A, PipelineStageFlags2 as S};
        match self.is_depth() {
            true => Use::new(S::EARLY_FRAGMENT_TESTS, A::DEPTH_STENCIL_ATTACHMENT_READ),
            false => Use::new(S::COLOR_ATTACHMENT_OUTPUT, A::COLOR_ATTACHMENT_READ),
        }
    }

    /// Adapts the use to a plan: its layouts, and the masks of its API.
    pub(crate) fn in_frames_of(self, plan: &FramePlan) -> Self {
        let uses = match plan.sync {
            SyncVersion::One => self.uses.coarse(),
            SyncVersion::Two => self.uses.of_shaders(matches!(self.how, UseKind::Sampled { .. })),
        };
        Self { uses, layouts: plan.layouts, ..self }
    }

    /// The layout that it needs; `UNDEFINED` for a buffer.
    pub fn layout(&self) -> vk::ImageLayout {
        self.throughout.unwrap_or_else(|| self.layouts.of(self.optimal_layout()))
    }

    fn optimal_layout(&self) -> vk::ImageLayout {
        let is_depth = self.is_depth();
        match self.how {
            UseKind::Color { .. } | UseKind::Resolve => vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            // TINT, which only reads, keeps SHADOW's layout, so that it is the end of the render pass that changes it back: for all of the layer, of which the map is a part. After a
            // change between subpasses layer 1.3.239 takes readers of the rest for unordered.
            UseKind::Depth { .. } if self.writes() || self.resource == Resource::SHADOW_MAPS => {
                vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL
            }
            // LIGHTING tests against depth and reads it as an input at once.
            UseKind::Depth { .. } => vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL,
            UseKind::Input { .. } | UseKind::Sampled { .. } if is_depth => {
                vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL
            }
            UseKind::Input { .. } | UseKind::Sampled { .. } => vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
            UseKind::Storage { .. } => vk::ImageLayout::GENERAL,
            UseKind::CopiedFrom => vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            UseKind::CopiedTo => vk::ImageLayout::TRANSFER_DST_OPTIMAL,
            UseKind::Presented => vk::ImageLayout::PRESENT_SRC_KHR,
            UseKind::Buffer => vk::ImageLayout::UNDEFINED,
        }
    }

    /// Returns the usage flags that the image needs.
    pub fn usage(&self) -> vk::ImageUsageFlags {
        match self.how {
            UseKind::Input { .. } => vk::ImageUsageFlags::INPUT_ATTACHMENT,
            UseKind::Color { .. } | UseKind::Resolve => vk::ImageUsageFlags::COLOR_ATTACHMENT,
            UseKind::Depth { .. } => vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
            UseKind::Sampled { .. } => vk::ImageUsageFlags::SAMPLED,
            UseKind::Storage { .. } => vk::ImageUsageFlags::STORAGE,
            UseKind::CopiedFrom => vk::ImageUsageFlags::TRANSFER_SRC,
            UseKind::CopiedTo => vk::ImageUsageFlags::TRANSFER_DST,
            UseKind::Presented | UseKind::Buffer => vk::ImageUsageFlags::empty(),
        }
    }
}
