//! The plan of a frame: the parts that a scene needs on a device, decided once, before anything is created.
//!
//! [`FramePlan::of`] is pure. Attachments, pipelines, specialization, dependency rows and commands are derived from the plan and nothing else
//! decides. State that changes with the camera or with time is `visible`'s, a module that imports the plan and never the other way round: nothing in
//! this folder is worked out for a frame.
//!
//! [`decision`] makes the plan in this order, each step from the previous ones: [`lights`] and [`shadows`], [`surfaces`], [`gbuffer`], [`output`],
//! then the parts that follow from the surfaces: pipelines, meshes, textures. [`checks`] refuses settings that do not go together, [`reasons`] says
//! why the plan is as it is, [`parts`] puts it into words, and [`cost`] computes its cost.

mod attachments;
mod capabilities;
mod carriers;
mod checks;
mod codes;
mod cost;
mod cost_model;
mod culling;
mod decision;
pub(crate) mod effect;
// The laboratory and the window ask the effects' table.
#[doc(hidden)]
pub mod effects;
mod error;
mod gbuffer;
mod lens;
mod lights;
mod occlusion;
mod output;
mod parts;
mod reasons;
// Plans of each structure, for tests.
#[doc(hidden)]
pub mod samples;
mod shading;
mod shadows;
mod surfaces;
mod targets;
#[cfg(test)]
mod tests;
mod visibility;

pub use attachments::TooFew;
pub use capabilities::Capabilities;
pub use carriers::OtherQueues;
pub(crate) use carriers::RENDERED_COLORS;
pub use cost::Cost;
pub use cost_model::{ABSENT, Basis, COMPARED, CostModel, CullingCost, Load, PathCost};
pub use effect::Variation;
pub use effects::types::*;
pub use effects::{EffectPlans, averages_samples, shows_effect, variations};
pub use error::{PlanError, Refusal, RefusalReason};
pub use gbuffer::{Gbuffer, NormalEncoding, format_bytes};
pub use lights::{PlannedLights, UNIFORM_LIGHTS};
pub use output::{Encoding, HDR, OUTPUT_PLAIN, OUTPUT_SRGB, PresentTarget, ToneMapping, Transfer};
pub use parts::{Part, PartGroup};
pub use reasons::Reasons;
pub use shading::Shading;
pub use shadows::{MapProjection, ShadowLight, ShadowPlan, SkyShadows, Tile};
pub use surfaces::{
    DeformPlan, EffectiveMaterials, Extras, ForwardKey, GeometryKey, IndexWidth, LobeMask, MeshPlan, NumberedMesh,
    Opacity, PlannedBrdf, PlannedDeform, PlannedLevel, PlannedMesh, PlannedTexture, SetSamplers, Streams, TextureMask,
    TexturePlan, TextureSource, Uploads, texture_format,
};
pub use targets::{BufferName, DEPTH, OitTargets, OwnTarget, Target, TargetName};
pub use visibility::TriangleCode;

pub(crate) use culling::CULL_BUFFERS;
#[cfg(test)]
pub(crate) use lights::steepest;
pub(crate) use lights::{Grid, Reach, SLICES, TILE};
pub(crate) use lights::{IdleLights, LightCutoff, LightOrder, box_tree, range_of, shows_all, sphere_of, weakens};
#[cfg(test)]
pub(crate) use occlusion::MANY_OBJECTS;
pub(crate) use shadows::MAX_SHADOW_VIEWS;
pub(crate) use surfaces::{Cuts, SurfaceRules};

use std::collections::BTreeSet;

use ash::vk;

use effect::Blended;
use lights::adds_lights;
use surfaces::anisotropy;

use crate::gpu::sync::{Layouts, SyncVersion};
use crate::scene::{Brdf, Keep, LightPath, OptionalPart, Passes, Resolve, Settings, Transparency, View};

/// The structure of all frames of a scene with some settings on some device.
#[derive(Debug, Clone, PartialEq)]
pub struct FramePlan {
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
    /// Lighting, or a value to show, from [`Settings::view`].
    pub shading: Shading,
    /// Absent for the views that read none.
    pub gbuffer: Option<Gbuffer>,
    /// The G-buffer is stored: an effect samples it after the render pass that draws it, or `--plan stored-gbuffer` ends that render pass after GEOMETRY.
    pub stores_gbuffer: bool,
    /// The layout of the triangle codes that pixels store in place of a G-buffer.
    pub triangles: Option<TriangleCode>,
    /// The shadow maps of all lights that have some.
    pub shadow: Option<ShadowPlan>,
    /// Emissive light is written by GEOMETRY and LIGHTING adds to it.
    pub emissive: bool,
    /// The way in which transparent surfaces are blended; `None` if no transparent surface is drawn.
    pub transparency: Option<Transparency>,
    /// The targets of weighted blending; `None` if it is not used.
    pub sums: Option<OitTargets>,
    /// Triangles of all transparent objects: an upper bound of the layers over a pixel.
    pub transparent_triangles: u32,
    /// The format of the HDR target between LIGHTING and the output; `None` if the output takes the light directly.
    pub hdr: Option<vk::Format>,
    /// The format of [`Target::Output`] and of the finished picture.
    pub output: vk::Format,
    /// The images that presented pictures are drawn into.
    pub presented: Option<PresentTarget>,
    /// The encoding by ENCODE; pictures are then linear light, whether drawn in a window that needs it or copied to one.
    pub encoding: Option<Encoding>,
    /// A compute pass swaps red and blue as it stores them, for a swapchain with BGR images.
    pub swaps_red_and_blue: bool,
    /// The step that applies the tone curve, and the curve.
    pub tone_mapping: ToneMapping,
    /// Light is exposed before it is stored; false for pictures in nits.
    pub exposes: bool,
    /// Jittered frames that make one picture.
    pub samples: u32,
    /// The step at which `samples` and `msaa` are averaged: before the tone curve or after it.
    pub resolve: Resolve,
    /// Settings of the effects on the finished picture; all others are as by default.
    pub on_picture: Settings,
    /// The effects that frames have.
    pub effects: EffectPlans,
    /// Samples of each attachment but the output.
    pub msaa: u32,
    /// The reflection models that lighting evaluates, from the materials that can be drawn.
    pub brdf: PlannedBrdf,
    /// Some surface is a metal.
    pub metal: bool,
    /// Some opaque Cook-Torrance surface reflects otherwise than a usual dielectric: the G-buffer then stores reflectance.
    pub reflectance: bool,
    /// As [`Settings::textbook`] says.
    pub textbook: bool,
    /// True if frames have an orthographic camera. Pipelines know which.
    pub orthographic: bool,
    /// The reflection model that replaces each material's own.
    pub brdf_override: Option<Brdf>,
    /// The kinds of light that shaders have code for.
    pub lights: PlannedLights,
    pub(crate) light_order: LightOrder,
    /// The way in which passes that draw follow each other.
    pub passes: Passes,
    /// The API of barriers, submissions and render passes.
    pub sync: SyncVersion,
    /// The layouts that images are used in.
    pub layouts: Layouts,
    /// The queues beside the first that its frames use.
    pub queues: OtherQueues,
    /// Depth of opaque surfaces is drawn first, so that each pixel is shaded once.
    pub depth_prepass: bool,
    /// Never `Auto`.
    pub light_path: LightPath,
    /// Surfaces that are lit as they are drawn may go over lists of lights; false where the device's fragment shaders name too few buffers for that.
    pub lists_as_drawn: bool,
    /// True if the device finds out which opaque objects are seen.
    pub culls_on_device: bool,
    /// True if it also finds out which of them are hidden.
    pub hides_on_device: bool,
    /// The greatest error of levels of detail, in pixels; 0 where no mesh has any.
    pub lod: f32,
    /// One pipeline of GEOMETRY each, or of FORWARD.
    pub geometry: BTreeSet<GeometryKey>,
    /// One pipeline of LOBES each.
    pub lobes: BTreeSet<GeometryKey>,
    /// One pipeline of TRANSPARENT each.
    pub transparent: BTreeSet<GeometryKey>,
    /// The vertex streams that the plan keeps.
    pub streams: Streams,
    /// The materials that surfaces are drawn with.
    pub materials: EffectiveMaterials,
    /// Meshes on the device.
    pub meshes: MeshPlan,
    /// Textures on the device.
    pub textures: TexturePlan,
    /// Maximum anisotropy: texture samples per pixel at grazing angles; 1 if no texture has more than one texel.
    pub anisotropy: u32,
    /// Shaders place the samples of anisotropic filtering, not samplers.
    pub places_by_shaders: bool,
    /// Edge of the square of a pixel, in pixels, that a frame filters textures for: 1, or less where several frames make a picture.
    pub footprint: f32,
    /// The copies to the device that the first frame waits for.
    pub uploads: Uploads,
    /// The device can keep transient attachments in tile memory alone.
    pub lazily_allocated: bool,
    /// The device is a CPU. Then frames also leave out parts that take the CPU longer to find than a GPU to draw: see `may_leave_out`.
    pub software: bool,
    /// The parts that stay although nothing needs them.
    pub keep: Keep,
    /// Why all this is as it is.
    pub reasons: Reasons,
}

impl FramePlan {
    /// Returns true if frames leave out the elements of `part` that their camera does not need. A GPU draws them faster than the CPU finds them
    /// (docs/FIGURES.md), so only CPU devices do this.
    pub(crate) fn may_leave_out(&self, part: OptionalPart) -> bool {
        self.software && !self.keep.has(part)
    }

    /// Bytes of one frame's buffer of sorted indices.
    pub fn sorted_index_bytes(&self) -> u64 {
        self.meshes.sorted_width.map_or(0, |width| 3 * width.bytes() * u64::from(self.transparent_triangles))
    }

    /// Colour locations of GEOMETRY.
    pub fn geometry_locations(&self) -> u32 {
        geometry_locations(self.gbuffer.as_ref(), self.shading, (self.emissive, self.triangles.is_some()))
    }

    /// The lights of a frame, as indices into the scene's, in the order in which they are added: directional, unbounded, then bounded lights.
    pub fn light_numbers(&self) -> &[usize] {
        &self.light_order.order
    }

    /// Returns true if lights are added one by one, by blending in LIGHTING.
    pub fn adds_lights(&self) -> bool {
        adds_lights(self.light_path, &self.lights)
    }

    /// Returns true if some object's mesh is deformed on the device.
    pub fn deforms(&self) -> bool {
        !self.meshes.deforms.objects.is_empty()
    }

    /// Returns true if frames know which objects have moved since the frame before.
    pub(crate) fn lists_moving(&self) -> bool {
        self.effects.list_moving().is_some()
    }

    /// Returns true if a compute pass lights the surfaces that GEOMETRY stores, so that its render pass ends with it.
    pub fn is_tiled(&self) -> bool {
        is_tiled(self.light_path)
    }

    /// Returns true if surfaces are lit while they are rasterized, without a G-buffer.
    pub fn is_forward(&self) -> bool {
        is_forward(self.light_path)
    }

    /// Returns true if LIGHTING blends over the content of its target.
    pub fn blends_light(&self) -> bool {
        self.emissive || self.adds_lights() || self.effects.add_light(self.light_path)
    }

    /// Returns true if lights have shadow maps, or code for them is kept; the sky may have some besides.
    pub(crate) fn has_light_maps(&self) -> bool {
        self.shadow.as_ref().is_some_and(|shadow| shadow.sky.is_none() || !shadow.lights.is_empty())
    }

    /// Returns true if a directional light has shadow maps. lavapipe runs both sides of every branch, so that a lookup which no light needs is left out
    /// by a constant.
    pub fn has_directional_shadows(&self) -> bool {
        self.lights.directional && self.has_shadows_of(|projection| matches!(projection, MapProjection::Cascades(_)))
    }

    /// Returns true if a point or spot light has shadow maps.
    pub fn has_punctual_shadows(&self) -> bool {
        self.lights.punctual && self.has_shadows_of(|projection| !matches!(projection, MapProjection::Cascades(_)))
    }

    fn has_shadows_of(&self, kind: impl Fn(MapProjection) -> bool) -> bool {
        let kept = self.keep.has(OptionalPart::ShadowMaps);
        self.shadow.as_ref().is_some_and(|shadow| kept || shadow.lights.iter().any(|light| kind(light.projection)))
    }

    /// Returns true if some surfaces are lit as they are drawn.
    pub fn lights_as_drawn(&self) -> bool {
        self.is_forward() || self.transparency.is_some() || self.relights()
    }

    /// Returns true if each froxel has a list of lights.
    pub fn has_clusters(&self) -> bool {
        let forward = match self.light_path {
            LightPath::Clustered => true,
            LightPath::Forward => self.lists_as_drawn,
            // On any light path, transparent surfaces and surfaces with lobes are lit as they are drawn.
            LightPath::ForwardNaive => false,
            // Effects that are blended are lit before they are drawn.
            _ => {
                self.lists_as_drawn
                    && (self.relights() || self.transparency.is_some() && self.blended_alone().is_none())
            }
        };
        forward && self.may_list_lights()
    }

    fn may_list_lights(&self) -> bool {
        self.lights.bounded || (self.lights.any() && self.keep.has(OptionalPart::LightLists))
    }

    /// Returns true if LIGHTING goes over the lists of the froxels.
    pub fn lights_by_clusters(&self) -> bool {
        self.light_path == LightPath::Clustered && self.may_list_lights()
    }

    /// Bytes of G-buffer and depth that GEOMETRY writes for each pixel; emissive light not counted.
    pub fn gbuffer_bytes_per_pixel(&self) -> u32 {
        self.gbuffer.as_ref().map_or(0, Gbuffer::bytes_per_pixel) * self.msaa
    }

    /// The samples of each attachment but the output, as Vulkan has them.
    pub fn sample_count(&self) -> vk::SampleCountFlags {
        vk::SampleCountFlags::from_raw(self.msaa)
    }

    /// Returns true if the output's own light is written sample by sample, which the render pass then resolves. A compute pass resolves by itself.
    pub fn resolves_output(&self) -> bool {
        self.msaa > 1 && self.hdr.is_none() && self.shading.is_lit() && !self.is_tiled()
    }

    /// Returns true if LIGHTING, or VIEW in its place, leaves out the sky by a depth test. A view of all samples writes the output, which has one,
    /// and so cannot test against their depth.
    pub fn lighting_tests_depth(&self) -> bool {
        self.has_geometry() && self.shading != Shading::ShowGbuffer(View::Complexity)
    }

    /// The bound at which light is clamped before it is stored. It lies below the largest value of the format: 65504 for half floats, 65024 (red,
    /// green) and 64512 (blue) for packed ones; 32-bit floats exceed any light of a finite scene. It is halved if transparent surfaces may add
    /// highlights.
    pub fn largest_light(&self) -> f32 {
        match self.light_format() {
            vk::Format::R16G16B16A16_SFLOAT | vk::Format::B10G11R11_UFLOAT_PACK32 if self.transparency.is_some() => {
                32000.0
            }
            vk::Format::R16G16B16A16_SFLOAT => 65000.0,
            vk::Format::B10G11R11_UFLOAT_PACK32 => 64000.0,
            _ => 1e30,
        }
    }

    /// The bound at which TONEMAP and the effects before it clamp light: sums of half floats may have become infinite, and light of this value is
    /// shown as white.
    pub fn largest_shown(&self) -> f32 {
        let single = self.hdr == Some(vk::Format::R32G32B32A32_SFLOAT);
        let linear = matches!(self.tone_mapping, ToneMapping::AfterFrames(_) | ToneMapping::Absent);
        if linear && single { 1e30 } else { 65000.0 }
    }

    /// The format that light is added up in.
    pub fn light_format(&self) -> vk::Format {
        self.hdr.unwrap_or(self.output)
    }

    /// The pipelines of all passes that draw surfaces.
    pub fn keys(&self) -> impl Iterator<Item = &GeometryKey> {
        self.geometry.iter().chain(&self.transparent)
    }

    /// Returns the reason why frames sum up no transparent surfaces.
    pub(crate) fn lack_of_sums(&self) -> &'static str {
        match (self.transparency, self.blended_alone()) {
            (None, _) => "nothing transparent is drawn",
            (Some(_), None) => "transparent surfaces are sorted",
            (Some(_), Some(own)) => (own.unsummed)(&self.effects),
        }
    }

    /// Returns the effect that is blended like transparent surfaces, if the plan has no transparent surfaces.
    fn blended_alone(&self) -> Option<&'static Blended> {
        let blended = self.effects.present().find_map(|effect| effect.blended.as_ref());
        blended.filter(|_| self.transparent.is_empty())
    }

    /// Returns true if GEOMETRY exists: all but the view of the shadow map.
    pub fn has_geometry(&self) -> bool {
        self.shading != Shading::ShowShadowMap
    }

    /// Returns true if frames have TONEMAP, which reads the HDR target: as the last subpass of the light's render pass, or after effects that read
    /// the light in another render pass.
    pub fn has_tonemap_subpass(&self) -> bool {
        let [_, read] = self.effects.hdr(self.light_path);
        matches!(self.tone_mapping, ToneMapping::Subpass(_) | ToneMapping::Kept) || read.is_some()
    }
}

/// Colour locations of GEOMETRY. They are fixed (`shaders/geometry.wgsl`), so the highest in use counts.
fn geometry_locations(gbuffer: Option<&Gbuffer>, shading: Shading, (emissive, triangles): (bool, bool)) -> u32 {
    match gbuffer {
        None => u32::from(shading.only_covers() || triangles),
        Some(gbuffer) if gbuffer.position.is_some() => 6,
        Some(gbuffer) if gbuffer.specular.is_some() => 5,
        Some(_) if emissive => 4,
        Some(gbuffer) if gbuffer.material.is_some() => 3,
        Some(_) => 2,
    }
}

fn is_forward(path: LightPath) -> bool {
    matches!(path, LightPath::Forward | LightPath::ForwardNaive)
}

fn is_tiled(path: LightPath) -> bool {
    matches!(path, LightPath::Compute | LightPath::Visibility)
}

fn lacks_gbuffer(path: LightPath) -> bool {
    is_forward(path) || path == LightPath::Visibility
}
