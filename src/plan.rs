//! What a scene needs on a device: decided once, before anything is created.
//!
//! [`FramePlan::of`] is pure. Attachments, pipelines, specialization, dependency rows and commands are derived from the plan
//! and nothing else decides. What changes with the camera is a [`Visible`], computed for each frame.

mod boxes;
mod clusters;
mod cost;
mod frustum;
mod gbuffer;
mod geometry;
mod light_path;
mod lit;
mod meshes;
mod parts;
#[cfg(test)]
pub(crate) mod samples;
mod shadows;
#[cfg(test)]
mod tests;
mod uploads;
mod visible;
mod volumes;

pub use clusters::{Clusters, Grid, SLICES, TILE, slice_of};
pub use cost::Cost;
pub use gbuffer::{Gbuffer, NormalEncoding, format_bytes};
pub use geometry::{ForwardKey, GeometryKey, Opacity, Streams, TextureMask};
pub use light_path::{Reach, steepest};
pub use lit::Lit;
pub use meshes::{IndexWidth, MeshPlan, PlannedMesh};
pub use parts::{Part, PartGroup};
pub use shadows::{Caster, MAX_SHADOW_VIEWS, Projection, ShadowCache, ShadowLight, ShadowPlan, ShadowView, Tile};
pub use uploads::Uploads;
pub use visible::{Draw, LightWork, SortedDraw, Visible, World, WorldObject};
pub use volumes::{LightRect, VolumeRecord, cone_mesh, sphere_mesh};

use std::collections::BTreeSet;

use ash::vk;

use crate::scene::{
    Brdf, CastsShadow, Falloff, HdrFormat, Keep, LightKind, LightPath, MSAA, Object, Resolve, Scene, Settings, Tonemap,
    Transparency, View,
};

/// What the device can do, as far as a plan depends on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capabilities {
    /// Largest edge of an attachment in pixels.
    pub max_extent: u32,
    /// Colour attachments of one subpass.
    pub max_color_attachments: u32,
    /// Input attachments of one subpass.
    pub max_input_attachments: u32,
    /// Layers of an image.
    pub max_layers: u32,
    /// Depth can be clamped instead of clipped.
    pub depth_clamp: bool,
    /// R16G16_UNORM can be a colour attachment; not mandatory in Vulkan.
    pub unorm_2x16_attachment: bool,
    /// R32G32B32A32_SFLOAT and R32_SFLOAT blend; not mandatory in Vulkan.
    pub float32_blends: bool,
    /// B10G11R11_UFLOAT_PACK32 blends; not mandatory in Vulkan.
    pub packed_float_blends: bool,
    /// Samples a pixel that every attachment can have, as bits (2 for 2, 4 for 4), at their standard places and shaded one by one.
    pub msaa: u32,
    /// There is memory that only exists while a tile needs it.
    pub lazily_allocated: bool,
    /// Invocations of a compute work group.
    pub compute_invocations: u32,
    /// The device is a CPU.
    pub software: bool,
}

/// A frame that cannot be planned. One line that names the setting and the limit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    #[error("the size {0}x{1} is not possible on this device: each edge must be 1 to {2} pixels")]
    Size(u32, u32, u32),
    #[error("a shadow map of {0} texels is not possible on this device: the limit is {1}")]
    ShadowSize(u32, u32),
    #[error(
        "this G-buffer needs {0} colour attachments in one subpass and the device has {1}: choose fewer targets, as `--gbuffer lean`"
    )]
    ColorAttachments(u32, u32),
    #[error(
        "this G-buffer is read through {0} input attachments and the device has {1}: choose fewer targets, as `--gbuffer lean`"
    )]
    InputAttachments(u32, u32),
    #[error(
        "this device cannot blend into the HDR format {0}: choose `--hdr-format rgba16f`, into which every device can"
    )]
    HdrFormat(HdrFormat),
    #[error("the light path {0} has no G-buffer to show: leave --light-path out to see this view")]
    NoGbuffer(LightPath),
    #[error("the light path {0} adds lights by blending into 32-bit floats, which this device cannot: try clustered")]
    NoFloatBlending(LightPath),
    #[error(
        "compute writes the finished picture by itself, so that FXAA has nothing to read: choose another light path, or --samples"
    )]
    ComputeWithFxaa,
    #[error(
        "the light path compute needs work groups of {0} invocations, and this device has at most {1}: try clustered"
    )]
    WorkGroup(u32, u32),
    #[error(
        "the light path {0} adds lights into 32-bit floats, so that the HDR format {1} does not apply: leave it out"
    )]
    BlendedFormat(LightPath, HdrFormat),
    #[error("a light cut-off is certified against half a step of 8 bits, and a linear picture has none: leave it off")]
    CutoffWithoutSteps,
    #[error("there is no shadow map to show: {0}")]
    NoShadowMap(String),
    #[error("anti-aliasing: {0}")]
    AntiAliasing(String),
    #[error("{0}")]
    Change(String),
    #[error("forward-naive has no depth pre-pass, which is what it is there to show: choose `--light-path forward`")]
    NaivePrepass,
    #[error(
        "the light path compute writes the finished picture, and transparent surfaces would have to come after it: choose `--light-path clustered`"
    )]
    ComputeWithTransparency,
}

/// Formats of the targets of weighted blending.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sums {
    /// Colour of the layers, weighted and added up; alpha is the share of the picture that they leave.
    pub accumulation: vk::Format,
    /// Their weights, added up.
    pub weights: vk::Format,
}

impl Sums {
    pub const SINGLE: Self = Self { accumulation: vk::Format::R32G32B32A32_SFLOAT, weights: vk::Format::R32_SFLOAT };
    /// Mandatory to blend. The share that is left is exact to 1/2048, which is 1% of what a pane of alpha 0.04 hides.
    pub const HALF: Self = Self { accumulation: vk::Format::R16G16B16A16_SFLOAT, weights: vk::Format::R16_SFLOAT };
}

/// What the subpass after GEOMETRY does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shading {
    /// Lights every pixel.
    Light {
        /// With albedo 1.
        light_only: bool,
    },
    /// Shows a G-buffer value.
    ShowGbuffer(View),
    ShowOverdraw,
    ShowShadowMap,
}

/// Where scene light becomes display light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ToneMapping {
    /// Inside LIGHTING: no HDR target, no TONEMAP subpass.
    InLighting(Tonemap),
    /// A subpass of its own, because something is blended before it.
    Subpass(Tonemap),
    /// On the CPU: the output holds exposed light, of which many frames make one picture.
    AfterFrames(Tonemap),
    /// Not at all: the output holds nits, or a view.
    Absent,
}

/// Which reflection models LIGHTING evaluates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlannedBrdf {
    /// The same for all materials, so a constant.
    One(Brdf),
    /// Stored for each pixel.
    PerPixel,
}

impl PlannedBrdf {
    /// As the shaders' constant BRDF has it (`shaders/shared/shading.wgsl`).
    pub fn constant(self) -> u32 {
        match self {
            Self::One(brdf) => brdf as u32,
            Self::PerPixel => 4,
        }
    }
}

/// Kinds of light that LIGHTING has code for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PlannedLights {
    pub directional: bool,
    pub punctual: bool,
    pub spot: bool,
    /// The index of the one fall-off that all have (`shaders/shared/lights.wgsl`), 3 where they differ.
    pub falloff: u32,
    /// Some light has a range.
    pub ranged: bool,
    /// Some light reaches only so far, by its range or the certified cut-off.
    pub bounded: bool,
    /// Some point or spot light reaches everywhere.
    pub unbounded: bool,
    pub ambient: bool,
    /// Few enough for a uniform buffer.
    pub uniform: bool,
}

impl PlannedLights {
    /// Whether there is a buffer of lights.
    pub fn any(&self) -> bool {
        self.directional || self.punctual
    }
}

/// The structure of all frames of a scene with some settings on some device.
#[derive(Debug, Clone, PartialEq)]
pub struct FramePlan {
    pub size: [u32; 2],
    pub shading: Shading,
    /// Absent for the views that read none.
    pub gbuffer: Option<Gbuffer>,
    /// The shadow maps of all lights that have some.
    pub shadow: Option<ShadowPlan>,
    /// Emissive light is written by GEOMETRY and LIGHTING adds to it.
    pub emissive: bool,
    /// How transparent surfaces are laid over the lit ones, where some are drawn.
    pub transparency: Option<Transparency>,
    /// What weighted blending sums up, where it is chosen.
    pub sums: Option<Sums>,
    /// Of all transparent objects: no pixel has more layers.
    pub transparent_triangles: u32,
    /// An attachment of its own between LIGHTING and the output.
    pub hdr: Option<vk::Format>,
    pub output: vk::Format,
    pub tone_mapping: ToneMapping,
    /// Jittered frames that make one picture.
    pub samples: u32,
    pub resolve: Resolve,
    /// A pass after the main one smooths edges.
    pub fxaa: bool,
    /// Samples of each attachment but the output.
    pub msaa: u32,
    pub brdf: PlannedBrdf,
    /// Every material's, whatever it says itself.
    pub brdf_override: Option<Brdf>,
    pub lights: PlannedLights,
    /// Depth of opaque surfaces is drawn first, so that each pixel is shaded once.
    pub depth_prepass: bool,
    /// Never `Auto`.
    pub light_path: LightPath,
    /// Why it is this one.
    pub light_path_reason: String,
    /// One pipeline of GEOMETRY each, or of FORWARD.
    pub geometry: BTreeSet<GeometryKey>,
    /// One pipeline of TRANSPARENT each.
    pub transparent: BTreeSet<GeometryKey>,
    /// The vertex streams that there are.
    pub streams: Streams,
    /// Meshes on the device.
    pub meshes: MeshPlan,
    pub uploads: Uploads,
    pub lazily_allocated: bool,
    /// What stays although nothing needs it.
    pub keep: Keep,
    parts: Vec<Part>,
    warnings: Vec<String>,
}

/// Tone-mapped pictures: 8 bits a channel, encoded by the hardware.
pub const OUTPUT_SRGB: vk::Format = vk::Format::R8G8B8A8_SRGB;
/// The same bytes, encoded by a compute shader: sRGB formats cannot be stored to.
pub const OUTPUT_PLAIN: vk::Format = vk::Format::R8G8B8A8_UNORM;
/// Half floats hold what the eye can tell apart and blend everywhere.
pub const HDR: vk::Format = vk::Format::R16G16B16A16_SFLOAT;
pub const DEPTH: vk::Format = vk::Format::D32_SFLOAT;
/// Counts fragments in steps of 1/255; mandatory to blend.
pub const COUNT: vk::Format = vk::Format::R8_UNORM;

/// Lights that fit into the least uniform buffer that a device must have; `shaders/shared/lights.wgsl` has the same number.
pub const UNIFORM_LIGHTS: usize = 256;

impl FramePlan {
    /// Decides what exists.
    ///
    /// # Errors
    /// When the device cannot do what the settings ask for, or a view shows what the scene does not have.
    pub fn of(scene: &Scene, settings: &Settings, device: &Capabilities) -> Result<Self, Error> {
        let [width, height] = settings.size;
        if width == 0 || height == 0 || width.max(height) > device.max_extent {
            return Err(Error::Size(width, height, device.max_extent));
        }
        let shading = shading(settings.view);
        let lit = matches!(shading, Shading::Light { .. });
        let (shadow, warnings) = Self::plan_shadow(scene, settings, device, shading)?;
        let (transparent, drawn): (BTreeSet<usize>, BTreeSet<usize>) = scene
            .objects
            .iter()
            .map(|object| object.material)
            .partition(|&index| scene.materials[index].is_transparent());
        let material = |&index: &usize| &scene.materials[index];
        let transparency = (settings.view == View::Final && !transparent.is_empty()).then_some(settings.transparency);
        let lights = planned_lights(scene, settings, shading);
        let (light_path, light_path_reason) = light_path::choose(scene, settings, &lights, device)?;
        let forward = is_forward(light_path);
        if settings.depth_prepass == Some(true) && light_path == LightPath::ForwardNaive {
            return Err(Error::NaivePrepass);
        }
        // Where there is no G-buffer, what surfaces emit is added as they are drawn.
        let emissive =
            !forward && settings.view == View::Final && drawn.iter().any(|index| material(index).is_emissive());
        let brdf = planned_brdf(drawn.iter().map(|index| settings.brdf.unwrap_or(material(index).brdf)));
        let complexity = settings.view == View::Complexity;
        // What is compared must be what LIGHTING would read.
        let shadowed = shadow.is_some() || (complexity && shadow_reason(scene, settings).is_ok());
        let gbuffer = (!forward && matches!(shading, Shading::Light { .. } | Shading::ShowGbuffer(_)))
            .then(|| Gbuffer::choose(&settings.gbuffer, brdf, shadowed, settings.view, device));
        check_antialiasing(settings, lit)?;
        // What is averaged from frame to frame must not be cut off before.
        let linear = settings.hdr_output || settings.samples > 1;
        let adds = adds_lights(light_path, &lights);
        check_msaa(settings, gbuffer.as_ref(), light_path, device)?;
        // Samples are averaged before they are tone-mapped, and so kept until then.
        let averaged = lit && settings.msaa > 1 && settings.resolve == Resolve::Linear && !linear;
        let (hdr, output) = match (lit, linear, emissive || adds || transparency.is_some() || averaged) {
            (_, true, true) if !device.float32_blends => (None, HDR),
            (_, true, _) => (None, vk::Format::R32G32B32A32_SFLOAT),
            // Adding to fewer bits truncates: a share of the light is lost with each light.
            (true, false, true) if adds => (Some(vk::Format::R32G32B32A32_SFLOAT), OUTPUT_SRGB),
            (true, false, true) => (Some(hdr_format(settings.hdr_format, device)?), OUTPUT_SRGB),
            _ => (None, OUTPUT_SRGB),
        };
        let tiled = light_path == LightPath::Compute;
        if tiled && transparency.is_some() {
            return Err(Error::ComputeWithTransparency);
        }
        // Compute writes the picture by itself; surfaces' own light comes to it in a target of its own.
        let (hdr, output) = match (tiled, linear) {
            (true, true) => (emissive.then_some(output), vk::Format::R32G32B32A32_SFLOAT),
            (true, false) => (hdr, OUTPUT_PLAIN),
            (false, _) => (hdr, output),
        };
        let tone_mapping = match (lit, settings.hdr_output, hdr) {
            (true, false, Some(_)) if !tiled => ToneMapping::Subpass(settings.tonemap),
            (true, false, _) if settings.samples > 1 => ToneMapping::AfterFrames(settings.tonemap),
            (true, false, _) => ToneMapping::InLighting(settings.tonemap),
            _ => ToneMapping::Absent,
        };
        let mut plan = Self {
            size: settings.size,
            shading,
            gbuffer,
            shadow,
            emissive,
            transparency,
            sums: (transparency == Some(Transparency::Oit)).then_some(if device.float32_blends {
                Sums::SINGLE
            } else {
                Sums::HALF
            }),
            transparent_triangles: 0,
            hdr,
            output,
            tone_mapping,
            samples: settings.samples,
            resolve: settings.resolve,
            fxaa: settings.fxaa,
            msaa: settings.msaa,
            brdf,
            brdf_override: settings.brdf,
            lights,
            // Counting and depth alone gain nothing from it.
            depth_prepass: settings.depth_prepass.unwrap_or(light_path == LightPath::Forward)
                && matches!(shading, Shading::Light { .. } | Shading::ShowGbuffer(_)),
            light_path,
            light_path_reason,
            geometry: BTreeSet::new(),
            transparent: BTreeSet::new(),
            streams: Streams::default(),
            meshes: MeshPlan::default(),
            uploads: Uploads::default(),
            lazily_allocated: device.lazily_allocated,
            keep: settings.keep,
            parts: Vec::new(),
            warnings,
        };
        plan.check_attachments(device)?;
        if shading != Shading::ShowShadowMap {
            plan.plan_pipelines(scene, settings);
        }
        plan.meshes = MeshPlan::of(scene, settings, &plan);
        plan.streams = plan.meshes.streams();
        plan.uploads = Uploads::of(scene, settings, &plan);
        plan.parts = parts::list(scene, settings, &plan);
        Ok(plan)
    }

    fn plan_pipelines(&mut self, scene: &Scene, settings: &Settings) {
        let mut triangles = 0;
        let plan = &*self;
        let drawn: Vec<&Object> = scene.objects.iter().filter(|object| plan.draws(scene, object)).collect();
        for object in drawn {
            let key = GeometryKey::of(scene, object, settings, self);
            if !scene.materials[object.material].is_transparent() {
                self.geometry.insert(key);
            } else {
                self.transparent.insert(key);
                triangles += scene.meshes[object.mesh].indices.len() / 3;
            }
        }
        self.transparent_triangles = u32::try_from(triangles).unwrap_or(u32::MAX);
    }

    /// Whether an object of the scene is in the world of the plan's frames.
    pub(crate) fn draws(&self, scene: &Scene, object: &Object) -> bool {
        let material = &scene.materials[object.material];
        let left_out = material.is_transparent() && self.transparency.is_none();
        !visible::is_cut_away(material) && !left_out && !scene.meshes[object.mesh].indices.is_empty()
    }

    /// Whether a pass draws an object's mesh.
    fn needs_mesh(&self, scene: &Scene, object: &Object) -> bool {
        let casts = self.shadow.is_some()
            && object.casts_shadow != CastsShadow::No
            && !scene.materials[object.material].is_transparent();
        self.draws(scene, object) && (self.has_geometry() || casts)
    }

    /// Whether an object's triangles are sorted for each frame.
    fn sorts(&self, scene: &Scene, object: &Object) -> bool {
        let transparent = scene.materials[object.material].is_transparent();
        transparent && self.transparency == Some(Transparency::Sorted) && self.draws(scene, object)
    }

    /// Bytes of one frame's buffer of sorted indices.
    pub fn sorted_index_bytes(&self) -> u64 {
        self.meshes.sorted_width.map_or(0, |width| 3 * width.bytes() * u64::from(self.transparent_triangles))
    }

    fn plan_shadow(
        scene: &Scene,
        settings: &Settings,
        device: &Capabilities,
        shading: Shading,
    ) -> Result<(Option<ShadowPlan>, Vec<String>), Error> {
        let none = (None, Vec::new());
        let wanted = matches!(shading, Shading::Light { .. } | Shading::ShowShadowMap);
        if let Err(why) = shadow_reason(scene, settings) {
            return if shading == Shading::ShowShadowMap { Err(Error::NoShadowMap(why)) } else { Ok(none) };
        }
        if !wanted {
            return Ok(none);
        }
        if settings.shadows.size == 0 || settings.shadows.size > device.max_extent {
            return Err(Error::ShadowSize(settings.shadows.size, device.max_extent));
        }
        let (plan, warnings) = ShadowPlan::of(scene, settings, device);
        if plan.is_none() && shading == Shading::ShowShadowMap {
            return Err(Error::NoShadowMap(warnings.join("; ")));
        }
        Ok((plan, warnings))
    }

    fn check_attachments(&self, device: &Capabilities) -> Result<(), Error> {
        let needed = self.geometry_locations();
        if needed > device.max_color_attachments {
            return Err(Error::ColorAttachments(needed, device.max_color_attachments));
        }
        // Depth or position, and the other targets; with several samples depth in any case.
        let depth = |gbuffer: &Gbuffer| gbuffer.position.is_none() || self.msaa > 1;
        let read =
            self.gbuffer.as_ref().map_or(0, |gbuffer| gbuffer.formats().count() as u32 + u32::from(depth(gbuffer)));
        if read > device.max_input_attachments {
            return Err(Error::InputAttachments(read, device.max_input_attachments));
        }
        Ok(())
    }

    /// Colour locations of GEOMETRY. They are fixed (`shaders/geometry.wgsl`), so the highest in use counts.
    pub fn geometry_locations(&self) -> u32 {
        match &self.gbuffer {
            None => u32::from(self.shading == Shading::ShowOverdraw),
            Some(gbuffer) if gbuffer.position.is_some() => 6,
            Some(gbuffer) if gbuffer.specular.is_some() => 5,
            Some(_) if self.emissive => 4,
            Some(gbuffer) if gbuffer.material.is_some() => 3,
            Some(_) => 2,
        }
    }

    /// Each part that a frame can have: in or out, why, and its bytes.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// Whether lights are added one by one, by blending in LIGHTING.
    pub fn adds_lights(&self) -> bool {
        adds_lights(self.light_path, &self.lights)
    }

    /// Whether a compute pass lights a stored G-buffer, so that the main pass ends with GEOMETRY.
    pub fn is_tiled(&self) -> bool {
        self.light_path == LightPath::Compute
    }

    /// Whether surfaces are lit while they are rasterized: there is no G-buffer.
    pub fn is_forward(&self) -> bool {
        is_forward(self.light_path)
    }

    /// Whether LIGHTING blends over what is in its target.
    pub fn blends_light(&self) -> bool {
        self.emissive || self.adds_lights()
    }

    /// Whether a directional light has shadow maps. lavapipe runs both sides of every branch, so that a lookup which no light needs is left out
    /// by a constant.
    pub fn has_directional_shadows(&self) -> bool {
        self.has_shadows_of(|projection| matches!(projection, Projection::Cascades(_)))
    }

    /// Whether a point or spot light has shadow maps.
    pub fn has_punctual_shadows(&self) -> bool {
        self.has_shadows_of(|projection| !matches!(projection, Projection::Cascades(_)))
    }

    fn has_shadows_of(&self, kind: impl Fn(Projection) -> bool) -> bool {
        self.shadow.as_ref().is_some_and(|shadow| shadow.lights.iter().any(|light| kind(light.projection)))
    }

    /// Whether each froxel has a list of lights.
    pub fn has_clusters(&self) -> bool {
        let forward = match self.light_path {
            LightPath::Clustered | LightPath::Forward => true,
            // What is transparent is lit as it is drawn, whatever lights the rest.
            LightPath::ForwardNaive => false,
            _ => self.transparency.is_some(),
        };
        forward && self.lights.bounded
    }

    /// Whether LIGHTING goes over the lists of the froxels.
    pub fn lights_by_clusters(&self) -> bool {
        self.light_path == LightPath::Clustered && self.lights.bounded
    }

    /// What was asked for and is not there, a line each.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Bytes of G-buffer and depth that GEOMETRY writes for each pixel; emissive light not counted.
    pub fn gbuffer_bytes_per_pixel(&self) -> u32 {
        self.gbuffer.as_ref().map_or(0, Gbuffer::bytes_per_pixel) * self.msaa
    }

    /// The samples of each attachment but the output, as Vulkan has them.
    pub fn sample_count(&self) -> vk::SampleCountFlags {
        vk::SampleCountFlags::from_raw(self.msaa)
    }

    /// Whether the output's own light is written sample by sample, which the render pass then resolves.
    pub fn resolves_output(&self) -> bool {
        self.msaa > 1 && self.hdr.is_none() && matches!(self.shading, Shading::Light { .. })
    }

    /// Whether LIGHTING, or VIEW in its place, leaves out the sky by a depth test. A view of all samples writes the output, which has one,
    /// and so cannot test against their depth.
    pub fn lighting_tests_depth(&self) -> bool {
        self.has_geometry() && self.shading != Shading::ShowGbuffer(View::Complexity)
    }

    /// Where light is cut off before it is stored: below the largest value of its format, which is 65504 for half floats and 65024 (red, green)
    /// and 64512 (blue) for packed ones; single ones end beyond what a finite scene reaches. Half of that where transparent surfaces
    /// may add their highlights to it.
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

    /// The format that light is added up in.
    pub fn light_format(&self) -> vk::Format {
        self.hdr.unwrap_or(self.output)
    }

    /// The pipelines of all passes that draw surfaces.
    pub fn keys(&self) -> impl Iterator<Item = &GeometryKey> {
        self.geometry.iter().chain(&self.transparent)
    }

    /// Whether GEOMETRY exists: all but the view of the shadow map.
    pub fn has_geometry(&self) -> bool {
        self.shading != Shading::ShowShadowMap
    }

    pub fn has_tonemap_subpass(&self) -> bool {
        matches!(self.tone_mapping, ToneMapping::Subpass(_))
    }
}

fn check_antialiasing(settings: &Settings, lit: bool) -> Result<(), Error> {
    let refuse = |why: String| Err(Error::AntiAliasing(why));
    let view = settings.view;
    if settings.samples == 0 {
        return refuse("a picture of 0 samples has no light: samples must be at least 1".into());
    }
    if settings.samples > 1 && !lit {
        return refuse(format!("the view {view} shows values that have no mean: draw it with 1 sample"));
    }
    if settings.fxaa && !lit {
        return refuse(format!("FXAA would blur the values that the view {view} shows: draw it without"));
    }
    if settings.fxaa && settings.hdr_output {
        return refuse("FXAA works on a tone-mapped picture, and a linear one (.exr) is not: use --samples".into());
    }
    if settings.fxaa && settings.samples > 1 {
        return refuse(format!(
            "{} samples are averaged after FXAA could smooth anything: choose one",
            settings.samples
        ));
    }
    Ok(())
}

/// The format asked for, which must blend.
fn hdr_format(asked: HdrFormat, device: &Capabilities) -> Result<vk::Format, Error> {
    let (format, blends) = match asked {
        HdrFormat::Rgba16f => (HDR, true),
        HdrFormat::B10g11r11 => (vk::Format::B10G11R11_UFLOAT_PACK32, device.packed_float_blends),
        HdrFormat::Rgba32f => (vk::Format::R32G32B32A32_SFLOAT, device.float32_blends),
    };
    if blends { Ok(format) } else { Err(Error::HdrFormat(asked)) }
}

/// Multisampling goes with every layout of floats, and with the paths that rasterize what they light or light a G-buffer in one draw.
fn check_msaa(
    settings: &Settings,
    gbuffer: Option<&Gbuffer>,
    light_path: LightPath,
    device: &Capabilities,
) -> Result<(), Error> {
    let refuse = |why: String| Err(Error::AntiAliasing(why));
    let (msaa, view) = (settings.msaa, settings.view);
    if msaa == 1 {
        return match view {
            View::Complexity => {
                refuse("the view complexity shows where samples of a pixel differ: ask for several, as --msaa 4".into())
            }
            _ => Ok(()),
        };
    }
    if !msaa.is_power_of_two() || device.msaa & msaa == 0 {
        let counts = MSAA.into_iter().filter(|count| device.msaa & count != 0).map(|count| count.to_string());
        let counts = counts.collect::<Vec<_>>().join(", ");
        return refuse(format!("this device cannot draw {msaa} samples a pixel; it can draw {counts}"));
    }
    if !matches!(view, View::Final | View::Lighting | View::Complexity) {
        return refuse(format!("the view {view} shows the values of one sample: draw it without multisampling"));
    }
    if settings.samples > 1 {
        let samples = settings.samples;
        return refuse(format!("{samples} jittered frames smooth what multisampling would: choose one of them"));
    }
    if gbuffer.is_some_and(|gbuffer| gbuffer.normal == vk::Format::R16G16_UINT) {
        return refuse(
            "normals in integers are not multisampled: choose another format, as --gbuffer lean,normal=rgb10a2".into(),
        );
    }
    if matches!(light_path, LightPath::PerLight | LightPath::Volumes | LightPath::Compute) {
        return refuse(format!(
            "the light path {light_path} shades one sample a pixel: choose loop, clustered or forward"
        ));
    }
    Ok(())
}

fn shading(view: View) -> Shading {
    match view {
        View::Final => Shading::Light { light_only: false },
        View::Lighting => Shading::Light { light_only: true },
        View::Overdraw => Shading::ShowOverdraw,
        View::ShadowMap => Shading::ShowShadowMap,
        other => Shading::ShowGbuffer(other),
    }
}

/// Why there are no shadow maps.
fn shadow_reason(scene: &Scene, settings: &Settings) -> Result<(), String> {
    if !settings.shadows.enabled {
        return Err("shadows are switched off".into());
    }
    let mut planned = World::sorted(scene, settings).into_iter().map(|index| &scene.lights[index]);
    let asking = planned.find(|light| light.casts_shadow);
    match asking {
        None => Err("no light casts a shadow".into()),
        Some(light) if scene.objects.iter().all(|object| object.casts_shadow == CastsShadow::No) => {
            Err(format!("nothing can stand between {} and anything", light.name))
        }
        Some(_) => Ok(()),
    }
}

fn planned_brdf(all: impl Iterator<Item = Brdf>) -> PlannedBrdf {
    let distinct: BTreeSet<Brdf> = all.collect();
    match distinct.len() {
        0 => PlannedBrdf::One(Brdf::Lambert),
        1 => PlannedBrdf::One(*distinct.first().expect("there is one")),
        _ => PlannedBrdf::PerPixel,
    }
}

/// The number of a fall-off in `shaders/shared/lights.wgsl`.
pub fn falloff_index(falloff: Falloff) -> u32 {
    match falloff {
        Falloff::InverseSquare => 0,
        Falloff::Quadratic => 1,
        Falloff::Polynomial { .. } => 2,
    }
}

fn is_forward(path: LightPath) -> bool {
    matches!(path, LightPath::Forward | LightPath::ForwardNaive)
}

/// Full-screen or cut to what a light reaches: each is a draw of its own.
fn adds_lights(path: LightPath, lights: &PlannedLights) -> bool {
    match path {
        LightPath::PerLight => lights.punctual,
        LightPath::Volumes => lights.bounded,
        _ => false,
    }
}

fn planned_lights(scene: &Scene, settings: &Settings, shading: Shading) -> PlannedLights {
    if shading == Shading::ShowGbuffer(View::Complexity) {
        // What is compared is what LIGHTING would read, and ambient light has occlusion stored.
        return PlannedLights { ambient: scene.environment.is_lit(), ..Default::default() };
    }
    if !matches!(shading, Shading::Light { .. } | Shading::ShowGbuffer(View::LightsPerPixel)) {
        return PlannedLights::default();
    }
    let mut lights = PlannedLights { ambient: scene.environment.is_lit(), ..Default::default() };
    let mut falloffs = BTreeSet::new();
    let planned = World::sorted(scene, settings);
    lights.uniform = planned.len() <= UNIFORM_LIGHTS;
    for light in planned.into_iter().map(|index| &scene.lights[index]) {
        let bounded = light_path::bounded(light, settings);
        lights.bounded |= bounded;
        lights.unbounded |= !bounded && !matches!(light.kind, LightKind::Directional { .. });
        match light.kind {
            LightKind::Directional { .. } => lights.directional = true,
            LightKind::Point { falloff, range, .. } => {
                lights.punctual = true;
                lights.ranged |= range.is_some();
                falloffs.insert(falloff_index(falloff));
            }
            LightKind::Spot { falloff, range, .. } => {
                (lights.punctual, lights.spot) = (true, true);
                lights.ranged |= range.is_some();
                falloffs.insert(falloff_index(falloff));
            }
        }
    }
    lights.falloff = if falloffs.len() == 1 { *falloffs.first().expect("there is one") } else { 3 };
    lights
}
