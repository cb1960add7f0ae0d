//! One file a pass: its uses (constants), its pipelines, and `record`. Passes never know each other.

/// The flags that say which targets a plan's G-buffer has: every shader that writes or reads it has the same (`shaders/shared/gbuffer.wgsl`).
/// `Flags` is the shader's own type.
macro_rules! gbuffer_flags {
    ($plan:expr) => {{
        $plan.gbuffer.as_ref().map_or(Flags::NONE, |gbuffer| {
            Flags::MATERIAL.when(gbuffer.material.is_some())
                | Flags::SPECULAR.when(gbuffer.specular.is_some())
                | Flags::POSITION.when(gbuffer.position.is_some())
                | Flags::NORMAL_UINT.when(gbuffer.normal == vk::Format::R16G16_UINT)
        })
    }};
}

/// The constants of every shader that lights a G-buffer. `constants` are the shader's own ids.
macro_rules! light_constants {
    ($plan:expr) => {{
        let gbuffer = $plan.gbuffer.as_ref();
        [
            (constants::BRDF, $plan.brdf.constant()),
            (constants::TEXTBOOK, u32::from($plan.textbook)),
            (constants::METAL, u32::from($plan.metal)),
            (constants::REFLECTANCE, u32::from($plan.reflectance)),
            (constants::ORTHOGRAPHIC, u32::from($plan.orthographic)),
            (constants::NORMAL_ENCODING, gbuffer.map_or(0, |gbuffer| gbuffer.normal_encoding as u32)),
            (constants::GEOMETRIC_STEPS, gbuffer.map_or(0.0, |gbuffer| gbuffer.geometric_steps()).to_bits()),
            (constants::FALLOFF, $plan.lights.falloff),
            (constants::TRAITS, $plan.lights.traits),
            (constants::SHADOW_FILTER, $plan.shadow.as_ref().map_or(0, |shadow| shadow.filter_code())),
            (constants::PUNCTUAL_SHADOWS, u32::from($plan.has_punctual_shadows())),
            (constants::LARGEST, $plan.largest_light().to_bits()),
            (constants::LIGHT_ONLY, u32::from($plan.shading == Shading::Light { light_only: true })),
        ]
    }};
}

/// The constants of every shader that looks up the sky's light beside shadow maps. `constants` are the shader's own ids.
macro_rules! sky_constants {
    ($plan:expr) => {{
        let sky = $plan.shadow.as_ref().and_then(|shadow| shadow.sky);
        [
            (constants::SKY_SHADOWS, sky.map_or(0, |sky| sky.count)),
            (constants::SKY_MAP, sky.map_or(0, |sky| sky.first_view as u32)),
            (constants::SKY_FILTER, $plan.shadow.as_ref().map_or(0, |shadow| shadow.sky_filter_code())),
            (constants::SKY_LOBE_SHADOWS, u32::from($plan.effects.reflections.is_none())),
        ]
    }};
}

pub mod aberration;
pub mod air;
pub mod ambient;
pub mod ao;
pub mod ao_denoise;
pub mod arrange;
pub mod backdrop;
pub mod bloom;
pub mod composite;
pub mod copy;
pub mod cull;
mod culling;
pub mod depth;
mod depth_only;
pub mod encode;
pub mod fill;
pub mod fog;
pub mod forward;
pub mod fxaa;
pub mod geometry;
pub mod hiz;
pub mod integrate;
pub mod lighting;
pub mod lobes;
pub mod occluders;
pub mod overlay;
pub mod particles;
pub mod per_light;
pub mod prefilter;
pub mod present;
pub mod pyramid;
pub mod reflect;
pub mod reflect_resolve;
pub mod scatter;
pub mod shadow;
pub mod sharpen;
pub mod simulate;
pub mod skin;
pub mod sky;
pub mod sort;
pub mod split;
pub mod taa;
pub mod tiled;
pub mod tint;
pub mod tone;
pub mod tonemap;
pub mod transparent;
pub mod velocity;
pub mod view;

pub mod background;
mod blending;
mod casters;
pub mod curves;
mod declaration;
pub mod object;
mod per_pixel;
mod screen;
mod spirv;
pub mod spread;
mod surface;

pub use declaration::{ContentsIfFirst, Endpoint, MapImage, Pass, Presence, Resource, ResourceUse, UseKind};
pub use object::{Making, PassObject, PassRecorder};
pub use per_pixel::{ImageBinding, PerPixelPass};
pub use screen::InputDescriptor;

use std::ops::Range;

use ash::vk;

use crate::gpu::{self, Device, PipelinePlace, ShaderStage, Timestamps, sync::Use};
use crate::gpu_scene::{
    CulledState, CullingBuffers, GpuScene, INDEX_READ, Instances, SKY_READ, TEXTURE_READ, VERTEX_READ,
};
use crate::plan::{FramePlan, IndexWidth, PresentTarget, Shading, Target, TexturePlan};
use crate::shaders::Variant;
use crate::visible::{Caster, MapDraw, Reprojection, ShadowView, Visible, World, WorldObject};

/// Shaders read the CPU's data for their frame.
pub const FRAME_READ: Use = Use::new(
    vk::PipelineStageFlags2::from_raw(
        vk::PipelineStageFlags2::VERTEX_SHADER.as_raw()
            | vk::PipelineStageFlags2::FRAGMENT_SHADER.as_raw()
            | vk::PipelineStageFlags2::COMPUTE_SHADER.as_raw(),
    ),
    vk::AccessFlags2::SHADER_READ,
);

/// Reads commands, and fetches rows of instances.
pub const CULLED_READ: Use =
    VERTEX_READ.or(Use::new(vk::PipelineStageFlags2::DRAW_INDIRECT, vk::AccessFlags2::INDIRECT_COMMAND_READ));

/// Places outside of frames that work once, in their order, each with its work.
pub const ONCE: [(Endpoint, &str); 3] = [
    (Endpoint::UPLOAD, "once: copies out of staging buffers, and blits from level to level of a texture"),
    (Endpoint::PREFILTER, "once: what surfaces collect of the sky"),
    (Endpoint::CLEAR, "once: the shadow maps' image, which the first frame may look up anywhere"),
];

// The commonest uses, by the stage that has them. Each pass names its own uses by these.

/// Writes colour attachments.
const COLOR_WRITE: Use =
    Use::new(vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT, vk::AccessFlags2::COLOR_ATTACHMENT_WRITE);
/// Loads colour attachments, or reads them to blend.
const COLOR_READ: Use =
    Use::new(vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT, vk::AccessFlags2::COLOR_ATTACHMENT_READ);
/// Blends into colour attachments.
const COLOR_BLEND: Use = COLOR_WRITE.or(COLOR_READ);
/// Reads depth before the fragment shader.
const EARLY_DEPTH_READ: Use =
    Use::new(vk::PipelineStageFlags2::EARLY_FRAGMENT_TESTS, vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ);
/// Writes depth before the fragment shader.
const EARLY_DEPTH_WRITE: Use =
    Use::new(vk::PipelineStageFlags2::EARLY_FRAGMENT_TESTS, vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE);
/// Writes depth after the fragment shader.
const LATE_DEPTH_WRITE: Use =
    Use::new(vk::PipelineStageFlags2::LATE_FRAGMENT_TESTS, vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE);
/// Tests against depth and leaves it: both stages read, since which one does is the implementation's choice.
const DEPTH_COMPARE: Use = EARLY_DEPTH_READ
    .or(Use::new(vk::PipelineStageFlags2::LATE_FRAGMENT_TESTS, vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ));
/// Reads the pixel's own place of input attachments.
const INPUT_READ: Use = Use::new(vk::PipelineStageFlags2::FRAGMENT_SHADER, vk::AccessFlags2::INPUT_ATTACHMENT_READ);
/// Samples images while shading fragments.
const SAMPLED: Use = Use::new(vk::PipelineStageFlags2::FRAGMENT_SHADER, vk::AccessFlags2::SHADER_SAMPLED_READ);

/// Reason for the absence of passes over a window's picture.
pub(crate) const NO_WINDOW: &str = "no window";

/// Reads the frame's camera and lights.
fn frame_data() -> ResourceUse {
    ResourceUse::resource(Resource::FrameData, FRAME_READ)
}

/// Draws the scene's meshes with its textures.
fn meshes(plan: &FramePlan) -> impl Iterator<Item = ResourceUse> {
    let (vertices, textures, deforms) = (plan.uploads.vertices, plan.uploads.textures, plan.deforms());
    let deformed =
        deforms
            .then_some(ResourceUse::resource(Resource::DeformedVertices, VERTEX_READ).because(
                "fetches the vertices that SKIN wrote, in this frame or in an earlier one with the same pose",
            ));
    let of_meshes = [
        ResourceUse::resource(Resource::Vertices, VERTEX_READ),
        ResourceUse::resource(Resource::Indices, INDEX_READ),
        // Rows of instances.
        ResourceUse::resource(Resource::FrameData, VERTEX_READ),
    ];
    let sampled = [ResourceUse::resource(Resource::Textures, TEXTURE_READ)];
    of_meshes.into_iter().filter(move |_| vertices).chain(deformed).chain(sampled.into_iter().filter(move |_| textures))
}

/// Draws the objects that the device found visible, where it culls.
fn culled(plan: &FramePlan) -> Option<ResourceUse> {
    plan.culls_on_device.then(|| {
        ResourceUse::resource(Resource::CulledInstances, CULLED_READ)
            .because("reads its commands and the rows of its instances")
    })
}

/// Looks up shadow maps and their tints, if the plan has them.
fn maps(plan: &FramePlan, uses: Use) -> impl Iterator<Item = ResourceUse> {
    let depth = ResourceUse::resource(Resource::SHADOW_MAPS, uses).because("loads any texel of the shadow maps");
    let tints = ResourceUse::resource(Resource::SHADOW_TINTS, uses).because("names their tints");
    let planned = plan.shadow.as_ref();
    planned.map(|_| depth).into_iter().chain(planned.filter(|own| own.tinted).map(|_| tints))
}

/// Looks up the shadow maps of lights, where they have some.
fn light_maps(plan: &FramePlan, uses: Use) -> impl Iterator<Item = ResourceUse> {
    maps(plan, uses).filter(|_| plan.has_light_maps())
}

/// What shaders look up that light surfaces as they draw them: the sky's light, and the picture behind glass, which all of them name that know of lobes.
fn looked_up(plan: &FramePlan) -> impl Iterator<Item = ResourceUse> {
    sky_light(plan).into_iter().chain(backdrop::touch(plan))
}

/// Looks up the light that surfaces collect of the sky, where it lights them.
fn sky_light(plan: &FramePlan) -> Option<ResourceUse> {
    plan.is_lit_by_sky().then(|| ResourceUse::resource(Resource::SkyLight, SKY_READ))
}

/// The place of the finished picture: the image that PRESENT has copied it into, else its target.
pub fn shown(plan: &FramePlan) -> Resource {
    match plan.presented {
        Some(PresentTarget::EncodeKept(_)) => Resource::ShownImage,
        _ if plan.is_copied_to_be_shown() => Resource::SwapchainImage,
        _ => Resource::Target(plan.picture()),
    }
}

/// Returns the input attachments of the pass after GEOMETRY, in the order of the bindings of `shaders/shared/gbuffer.wgsl`, depth first.
pub fn gbuffer_inputs(plan: &FramePlan) -> Vec<(u32, Target)> {
    match (plan.shading, &plan.gbuffer) {
        (Shading::ShowOverdraw, _) => vec![(0, Target::Count)],
        (Shading::ShowTriangle, _) => vec![(0, Target::Triangle)],
        (_, None) => Vec::new(),
        (_, Some(gbuffer)) => {
            let reads_depth = gbuffer.position.is_none() || plan.msaa > 1;
            let all =
                [Target::Depth, Target::Albedo, Target::Normal, Target::Material, Target::Specular, Target::Position];
            let has = |&(_, target): &(u32, Target)| match target {
                Target::Depth => reads_depth,
                _ => plan.format_of(target).is_some(),
            };
            (0..).zip(all).filter(has).collect()
        }
    }
}

/// The variant of a shader that `flags` name. Tests hold that each plan's flags have one.
pub fn needed<F: Copy + std::fmt::Debug>(
    shader: &str,
    variant: fn(F) -> Option<&'static Variant>,
    flags: F,
) -> gpu::Result<&'static Variant> {
    variant(flags).ok_or_else(|| gpu::Error::Unsupported(format!("{shader}.wgsl has no variant {flags:?}")))
}

/// The compute stage of the variant of a shader that `flags` name, with these constants. Tests hold that each plan's flags have one.
pub fn compute_stage<'a, F: Copy + std::fmt::Debug>(
    shader: &str,
    variant: fn(F) -> Option<&'static Variant>,
    flags: F,
    constants: &'a [(u32, u32)],
) -> gpu::Result<ShaderStage<'a>> {
    let Some(entry) = needed(shader, variant, flags)?.compute() else {
        return Err(gpu::Error::Unsupported(format!("{shader}.wgsl has no compute entry")));
    };
    let stage = vk::ShaderStageFlags::COMPUTE;
    Ok(ShaderStage { spirv: entry.spirv.words(), entry: entry.name, stage, constants })
}

/// The subpass in which a pipeline runs.
pub type Slot = PipelinePlace;

/// Layouts of the sets that passes share.
#[derive(Debug, Clone, Copy)]
pub struct SetLayouts {
    /// Set 0: camera and lights.
    pub frame: vk::DescriptorSetLayout,
    /// Set 2: the shadow maps, where the plan has some.
    pub shadows: Option<vk::DescriptorSetLayout>,
}

/// A shadow map that is drawn anew.
#[derive(Clone, Copy)]
pub struct MapRecording<'a> {
    pub view: &'a ShadowView,
    /// The opaque casters.
    pub casters: &'a [Caster],
    /// Casters that let light through.
    pub tinting: &'a [Caster],
    /// The place of the first caster among the frame's; tinting ones follow.
    pub first: u32,
}

impl<'a> MapRecording<'a> {
    /// Transparent casters come after the others.
    pub fn of(world: &World, draw: &'a MapDraw, view: &'a ShadowView, first: u32) -> Self {
        let opaque = draw.casters.partition_point(|own| !world.objects[own.object].transparent);
        let (casters, tinting) = draw.casters.split_at(opaque);
        Self { view, casters, tinting, first }
    }

    /// The map's part of its layer.
    pub fn area(&self) -> vk::Rect2D {
        let tile = self.view.tile;
        vk::Rect2D {
            offset: vk::Offset2D { x: tile.x as i32, y: tile.y as i32 },
            extent: vk::Extent2D { width: tile.edge, height: tile.edge },
        }
    }
}

/// A tile of an attachment: its place in a grid, and the number of tiles across and down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tile {
    pub at: [u32; 2],
    pub of: [u32; 2],
}

impl Tile {
    /// The part of an area that the tile covers. The tiles of a grid cover the area without a gap and without an overlap.
    pub fn within(self, area: vk::Rect2D) -> vk::Rect2D {
        let edge = |at: u32, of: u32, length: u32| (u64::from(at) * u64::from(length) / u64::from(of)) as u32;
        let lengths = [area.extent.width, area.extent.height];
        let [[x, right], [y, bottom]] =
            [0, 1].map(|axis| [0, 1].map(|next| edge(self.at[axis] + next, self.of[axis], lengths[axis])));
        vk::Rect2D {
            offset: vk::Offset2D { x: area.offset.x + x as i32, y: area.offset.y + y as i32 },
            extent: vk::Extent2D { width: right - x, height: bottom - y },
        }
    }
}

/// The part that two areas share.
fn overlap(a: vk::Rect2D, b: vk::Rect2D) -> vk::Rect2D {
    let axis = |a: (i32, u32), b: (i32, u32)| {
        let (first, end) = (a.0.max(b.0), (a.0 + a.1 as i32).min(b.0 + b.1 as i32));
        (first, (end - first).max(0) as u32)
    };
    let (x, width) = axis((a.offset.x, a.extent.width), (b.offset.x, b.extent.width));
    let (y, height) = axis((a.offset.y, a.extent.height), (b.offset.y, b.extent.height));
    vk::Rect2D { offset: vk::Offset2D { x, y }, extent: vk::Extent2D { width, height } }
}

/// The frame that is being recorded, which every `record` needs.
#[derive(Clone, Copy)]
pub struct FrameContext<'a> {
    pub device: &'a Device,
    pub cmd: vk::CommandBuffer,
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
    /// The index among the frames in flight.
    pub in_flight: usize,
    /// Deformed objects have another pose than in the frame before.
    pub posed: bool,
    /// The index of the swapchain's image that the picture goes to; 0 where nothing is presented.
    pub image: usize,
    /// The swapchain's image that the picture goes to, and its extent.
    pub swapchain_image: Option<(vk::Image, vk::Extent2D)>,
    pub scene: &'a GpuScene,
    pub world: &'a World,
    /// The mapping of textures onto the drawn surfaces.
    pub textures: &'a TexturePlan,
    pub visible: &'a Visible,
    /// Set 0 of every pass: camera and lights.
    pub frame_set: vk::DescriptorSet,
    /// Set 2 of all passes that shade: the shadow maps, where the plan has some.
    pub shadow_set: Option<vk::DescriptorSet>,
    /// Set 3 of TILED, where it looks up the surfaces that pixels show.
    pub seen_set: Option<vk::DescriptorSet>,
    /// The placing of the drawn objects.
    pub instances: &'a Instances,
    /// The placing of opaque objects, where the device finds the visible ones among them.
    pub culling: Option<&'a CullingBuffers>,
    /// The frame before, where frames are averaged over time.
    pub reprojection: Option<&'a Reprojection>,
    /// Shadow maps that this frame draws anew.
    pub stale_maps: &'a [MapDraw],
    /// The one that is being drawn, in the render pass of shadow maps.
    pub map: Option<MapRecording<'a>>,
    /// Records the barrier between two steps of a pass that has several.
    pub between: &'a dyn Fn(),
    /// The frame's own index buffer with [`Visible::sorted_indices`], where the plan sorts triangles.
    pub sorted: Option<(vk::Buffer, vk::IndexType)>,
    /// The only tile to draw, if a torn attachment is simulated.
    pub tile: Option<Tile>,
    /// This frame as seen by the last frame's camera, if stale content is simulated.
    pub earlier: Option<&'a FrameContext<'a>>,
}

impl FrameContext<'_> {
    /// Opens the label of a pass, which debuggers and messages of layers show.
    pub fn begin(&self, pass: &Pass) {
        self.device.begin_label(self.cmd, pass.name.name());
    }

    /// Closes it, and takes the time when all that was recorded so far is done.
    pub fn end(&self, times: &mut Option<Timestamps>, pass: &Pass) {
        self.device.end_label(self.cmd);
        Timestamps::stamp(times, self.cmd, pass.time);
    }

    /// The whole picture.
    pub fn area(&self) -> vk::Rect2D {
        let [width, height] = self.size;
        vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } }
    }

    /// The whole attachment as viewport and scissor: the picture, or the map that is drawn.
    pub fn set_area(&self) {
        self.set_rectangle(self.map.map_or_else(|| self.area(), |map| map.area()));
    }

    /// A part of an attachment as viewport and scissor.
    fn set_rectangle(&self, area: vk::Rect2D) {
        let viewport = vk::Viewport {
            x: area.offset.x as f32,
            y: area.offset.y as f32,
            width: area.extent.width as f32,
            height: area.extent.height as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        };
        let scissor = self.tile.map_or(area, |tile| tile.within(area));
        // SAFETY: `cmd` is being recorded; both states are dynamic in every pipeline.
        unsafe {
            self.device.raw.cmd_set_viewport(self.cmd, 0, &[viewport]);
            self.device.raw.cmd_set_scissor(self.cmd, 0, &[scissor]);
        }
    }

    /// The part of the picture's rectangle that is drawn: all of it, but where a tile alone is.
    fn drawn_part(&self, rectangle: vk::Rect2D) -> vk::Rect2D {
        self.tile.map_or(rectangle, |tile| overlap(tile.within(self.area()), rectangle))
    }

    fn bind_pipeline(&self, pipeline: vk::Pipeline) {
        // SAFETY: `cmd` is being recorded inside the subpass that the pipeline was made for; the pass owns the pipeline and
        // outlives the submission.
        unsafe { self.device.raw.cmd_bind_pipeline(self.cmd, vk::PipelineBindPoint::GRAPHICS, pipeline) };
    }

    fn bind_set(&self, layout: vk::PipelineLayout, index: u32, set: vk::DescriptorSet) {
        // SAFETY: the set was allocated with the layout that the pipeline layout has at this index, and is not written while
        // the frame runs.
        unsafe {
            let point = vk::PipelineBindPoint::GRAPHICS;
            self.device.raw.cmd_bind_descriptor_sets(self.cmd, point, layout, index, &[set], &[]);
        }
    }

    fn push<T: bytemuck::Pod>(&self, layout: vk::PipelineLayout, stages: vk::ShaderStageFlags, push: &T) {
        // SAFETY: the layout has one range of this size for these stages.
        unsafe { self.device.raw.cmd_push_constants(self.cmd, layout, stages, 0, bytemuck::bytes_of(push)) };
    }
}

/// The index buffer that is bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Indices {
    OfScene(IndexWidth),
    /// The frame's own.
    Sorted,
}

/// Draws meshes, and binds another index buffer only where the next mesh needs it.
struct MeshDraws<'a> {
    context: &'a FrameContext<'a>,
    streams: &'a [u32],
    /// True for draws into shadow maps.
    casters: bool,
    bound: Option<Indices>,
    /// True if the bound vertex buffers belong to deformed objects; none if no buffers are bound.
    deformed: Option<bool>,
}

impl<'a> MeshDraws<'a> {
    /// Starts draws with these vertex streams. The first draw binds them, so without a draw nothing is bound.
    fn new(context: &'a FrameContext<'a>, streams: &'a [u32]) -> Self {
        Self { context, streams, casters: false, bound: None, deformed: None }
    }

    /// Starts draws of casters.
    fn of_casters(context: &'a FrameContext<'a>, streams: &'a [u32]) -> Self {
        Self { casters: true, ..Self::new(context, streams) }
    }

    /// Draws instances of a level of an object's mesh, in the order that the frame has sorted its triangles into if they are `sorted`: then this is
    /// their first index.
    fn draw(&mut self, object: &WorldObject, level: u8, sorted: Option<u32>, instances: Range<u32>) {
        // The plan has the mesh of each object that a pass draws, and its levels.
        let Some(range) = self.context.scene.level(object.mesh, object.deform, level) else { return };
        let indices = if sorted.is_some() { Indices::Sorted } else { Indices::OfScene(range.width) };
        let FrameContext { device, cmd, .. } = *self.context;
        if self.deformed.is_none() {
            match self.casters {
                true => self.context.instances.bind_casters(device, cmd),
                false => self.context.instances.bind(device, cmd),
            }
        }
        if self.deformed != Some(range.deformed) {
            self.context.scene.bind(self.context.device, self.context.cmd, self.streams, range.deformed);
            self.deformed = Some(range.deformed);
        }
        if self.bound != Some(indices) {
            self.bind(indices);
        }
        let first_index = sorted.unwrap_or(range.first_index);
        let (first, count) = (instances.start, instances.len() as u32);
        // SAFETY: pipeline, sets and buffers are bound; the ranges lie inside the index buffer (GpuScene made both, or the frame
        // has written its own) and inside the frame's instances.
        unsafe { device.raw.cmd_draw_indexed(cmd, range.index_count, count, first_index, range.vertex_offset, first) };
    }

    /// Draws the objects that the device found visible in a step of depth, by some of its commands.
    fn draw_culled(&mut self, culling: &CullingBuffers, step: usize, state: &CulledState) {
        let FrameContext { device, cmd, scene, .. } = *self.context;
        if self.deformed.is_none() {
            culling.bind(device, cmd);
        }
        if self.deformed != Some(state.deformed) {
            scene.bind(device, cmd, self.streams, state.deformed);
            self.deformed = Some(state.deformed);
        }
        let indices = Indices::OfScene(state.width);
        if self.bound != Some(indices) {
            self.bind(indices);
        }
        let (first, count) = (culling.command(step, state.commands.start), state.commands.len() as u32);
        let stride = size_of::<vk::DrawIndexedIndirectCommand>() as u32;
        // SAFETY: as below; the commands lie in the buffer, and FILL has written them.
        unsafe { device.raw.cmd_draw_indexed_indirect(cmd, culling.culled.raw, first, count, stride) };
    }

    fn bind(&mut self, indices: Indices) {
        let FrameContext { device, cmd, scene, sorted, .. } = *self.context;
        match (indices, sorted) {
            (Indices::OfScene(width), _) => scene.bind_indices(device, cmd, width),
            // SAFETY: the buffer has INDEX_BUFFER usage and lives until the frame that it belongs to is recorded anew.
            (Indices::Sorted, Some((buffer, width))) => unsafe {
                device.raw.cmd_bind_index_buffer(cmd, buffer, 0, width);
            },
            // Only a plan that sorts has such draws.
            (Indices::Sorted, None) => {}
        }
        self.bound = Some(indices);
    }
}
