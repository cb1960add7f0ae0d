//! What a scene needs on a device: decided once, before anything is created.
//!
//! [`FramePlan::of`] is pure. Attachments, pipelines, specialization, dependency rows and commands are derived from the plan
//! and nothing else decides. What changes with the camera is a [`Visible`], computed for each frame.

mod anisotropy;
mod checks;
mod cost;
mod error;
mod gbuffer;
mod geometry;
mod levels;
mod light_culling;
mod light_path;
mod lights;
mod materials;
mod meshes;
mod output;
mod parts;
#[cfg(test)]
pub(crate) mod samples;
mod shadows;
mod surfaces;
mod targets;
#[cfg(test)]
mod tests;
mod textures;
mod uploads;
mod visible;
mod warnings;

pub use cost::Cost;
pub use error::Error;
pub use gbuffer::{Gbuffer, NormalEncoding, format_bytes};
pub use geometry::{ForwardKey, GeometryKey, Opacity, Streams, TextureMask};
pub use levels::least_footprint;
pub use light_culling::ActiveLights;
pub use light_path::{Reach, steepest};
pub use lights::{PlannedLights, UNIFORM_LIGHTS, falloff_index};
pub use materials::EffectiveMaterials;
pub use meshes::{IndexWidth, MeshPlan, PlannedMesh};
pub use output::{Canvas, Encoding, HDR, OUTPUT_PLAIN, OUTPUT_SRGB, ToneMapping, Transfer};
pub use parts::{Part, PartGroup};
pub use shadows::{
    Caster, MAX_SHADOW_VIEWS, MapDraw, MapProjection, Receivers, ShadowCache, ShadowLight, ShadowPlan, ShadowView, Tile,
};
pub use surfaces::PlannedBrdf;
pub use targets::Target;
pub use textures::{PlannedTexture, TexturePlan, TextureSource};
pub use uploads::Uploads;
pub use visible::clusters::{Clusters, Grid, SLICES, TILE};
pub use visible::depth::{Depth, Eye};
pub use visible::volumes::{LightRect, VolumeRecord, cone_mesh, sphere_mesh};
pub use visible::{Draw, LightWork, SortedDraw, Visible, World, WorldObject};

use std::collections::BTreeSet;

use ash::vk;

use checks::{check_antialiasing, check_msaa};
use gbuffer::Stored;
use light_culling::LightOrder;
use lights::{adds_lights, planned_lights};
use output::{Blending, Way};
use surfaces::Surfaces;

use crate::scene::{
    Brdf, CastsShadow, Keep, LightPath, Object, OptionalPart, Output, Resolve, Scene, Settings, Transparency, View,
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
    /// The most that textures can be filtered with; 1 where the device has no anisotropic filtering.
    pub anisotropy: u32,
    /// Shaders are told which triangle of a draw they shade.
    pub primitive_index: bool,
    /// There is memory that only exists while a tile needs it.
    pub lazily_allocated: bool,
    /// Invocations of a compute work group.
    pub compute_invocations: u32,
    /// The device is a CPU.
    pub software: bool,
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
    ShowTriangle,
    ShowShadowMap,
}

impl Shading {
    /// Whether GEOMETRY looks at nothing of a surface but where it is.
    pub fn only_covers(self) -> bool {
        matches!(self, Self::ShowOverdraw | Self::ShowTriangle)
    }
}

/// The structure of all frames of a scene with some settings on some device.
#[derive(Debug, Clone, PartialEq)]
pub struct FramePlan {
    pub size: [u32; 2],
    pub shading: Shading,
    /// Absent for the views that read none.
    pub gbuffer: Option<Gbuffer>,
    /// GEOMETRY has a render pass of its own, which stores the G-buffer for the next one.
    pub stores_gbuffer: bool,
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
    /// What pictures are drawn into, where they are presented.
    pub presented: Option<Canvas>,
    /// They are linear light for ENCODE: those that a window shows so, and those beside them.
    pub encoding: Option<Encoding>,
    /// A compute pass stores red and blue in each other's place, for a swapchain whose images have them so.
    pub swaps_red_and_blue: bool,
    pub tone_mapping: ToneMapping,
    /// Light is exposed before it is stored; that of a picture in nits is not.
    pub exposes: bool,
    /// Jittered frames that make one picture.
    pub samples: u32,
    pub resolve: Resolve,
    /// Settings of what works on the finished picture; all others are as by default.
    pub effects: Settings,
    /// A pass after the main one smooths edges.
    pub fxaa: bool,
    /// Samples of each attachment but the output.
    pub msaa: u32,
    pub brdf: PlannedBrdf,
    /// Some surface is a metal.
    pub metal: bool,
    /// As [`Settings::textbook`] says.
    pub textbook: bool,
    /// Whether frames have an orthographic camera. Pipelines know which.
    pub orthographic: bool,
    /// Every material's, whatever it says itself.
    pub brdf_override: Option<Brdf>,
    pub lights: PlannedLights,
    light_order: LightOrder,
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
    /// What surfaces are drawn with.
    pub materials: EffectiveMaterials,
    /// Meshes on the device.
    pub meshes: MeshPlan,
    /// Textures on the device.
    pub textures: TexturePlan,
    /// How textures are filtered where they are seen at a low angle; 1 where there is none of more than one texel.
    pub anisotropy: u32,
    /// How little of a surface a pixel may cover, in metres, where textures lack levels that would show below it.
    pub footprint: Option<f64>,
    pub uploads: Uploads,
    pub lazily_allocated: bool,
    /// The device is a CPU. Then frames leave out what costs the CPU time to find out: see `seeks`.
    pub software: bool,
    /// What stays although nothing needs it.
    pub keep: Keep,
    parts: Vec<Part>,
    warnings: Vec<String>,
}

pub const DEPTH: vk::Format = vk::Format::D32_SFLOAT;
/// Counts fragments in steps of 1/255; mandatory to blend.
pub const COUNT: vk::Format = vk::Format::R8_UNORM;
/// Numbers of an object and of a triangle; mandatory to draw into.
pub const TRIANGLE: vk::Format = vk::Format::R32G32_UINT;

impl FramePlan {
    /// Decides what exists.
    ///
    /// # Errors
    /// When the device cannot do what the settings ask for, a view shows what the scene does not have, or [`Scene::check`] finds a fault.
    pub fn of(scene: &Scene, settings: &Settings, device: &Capabilities) -> Result<Self, Error> {
        scene.check()?;
        Self::decide(scene, settings, device)
    }

    /// Of a scene that has been checked.
    fn decide(scene: &Scene, settings: &Settings, device: &Capabilities) -> Result<Self, Error> {
        let [width, height] = settings.size;
        if width == 0 || height == 0 || width.max(height) > device.max_extent {
            return Err(Error::Size(width, height, device.max_extent));
        }
        let (shading, keep) = (shading(settings.view), settings.keep);
        if shading == Shading::ShowTriangle && !device.primitive_index {
            return Err(Error::NoTriangles);
        }
        let lit = matches!(shading, Shading::Light { .. });
        let light_order = LightOrder::of(scene, settings);
        let needed = planned_lights(scene, settings, shading, light_order.needed());
        let (light_path, light_path_reason) =
            light_path::choose(scene, settings, &needed, light_order.needed(), device)?;
        let lights = planned_lights(scene, settings, shading, &light_order.order);
        let lights = if lit { lights.kept(keep) } else { lights };
        let (shadow, warnings) = Self::plan_shadow(scene, settings, device, shading, &light_order)?;
        let shadow = shadow.or_else(|| {
            // Shadows that are switched off are not wanted, not just not needed.
            let possible = settings.shadows.enabled && settings.shadows.size <= device.max_extent;
            let kept = lit && lights.any() && possible && keep.has(OptionalPart::ShadowMaps);
            kept.then(|| ShadowPlan::without_lights(settings, device))
        });
        if settings.depth_prepass == Some(true) && light_path == LightPath::ForwardNaive {
            return Err(Error::NaivePrepass);
        }
        let (forward, tiled) = (is_forward(light_path), light_path == LightPath::Compute);
        let materials = EffectiveMaterials::of(scene, settings);
        let surfaces = Surfaces::of(scene, &materials, settings);
        let last = settings.view == View::Final;
        // Where there is no G-buffer, what surfaces emit is added as they are drawn.
        let emissive = !forward && last && (surfaces.emissive || keep.has(OptionalPart::Emissive));
        if tiled && last && surfaces.transparent {
            return Err(Error::ComputeWithTransparency);
        }
        let transparent = last && !tiled && (surfaces.transparent || keep.has(OptionalPart::Transparent));
        let transparency = transparent.then_some(settings.transparency);
        let brdf = match keep.has(OptionalPart::BrdfByPixel) {
            true => PlannedBrdf::PerPixel,
            false => surfaces.brdf,
        };
        // What the view of the complexity compares must be what LIGHTING would read.
        let shadowed = shadow.is_some()
            || (settings.view == View::Complexity && shadow_reason(scene, settings, &light_order.order).is_ok());
        let gbuffer = (!forward && matches!(shading, Shading::Light { .. } | Shading::ShowGbuffer(_))).then(|| {
            let geometric_normal = shadowed && surfaces.two_normals;
            let stored = Stored { brdf, metal: surfaces.metal, geometric_normal, view: settings.view, keep };
            Gbuffer::choose(&settings.gbuffer, stored, device)
        });
        check_antialiasing(settings, lit)?;
        check_msaa(settings, gbuffer.as_ref(), light_path, device)?;
        let adds_lights = adds_lights(light_path, &lights);
        let way = Way::of(settings, device, Blending { lit, tiled, emissive, adds_lights, transparent })?;
        let mut plan = Self {
            size: settings.size,
            shading,
            gbuffer,
            // With a G-buffer that the next pass reads at its own pixel, depth with it.
            stores_gbuffer: gbuffer.is_some()
                && !tiled
                && settings.view != View::Complexity
                && keep.has(OptionalPart::StoredGbuffer),
            shadow,
            emissive,
            transparency,
            sums: (transparency == Some(Transparency::Oit)).then_some(if device.float32_blends {
                Sums::SINGLE
            } else {
                Sums::HALF
            }),
            transparent_triangles: 0,
            hdr: way.hdr,
            output: way.output,
            presented: None,
            encoding: None,
            swaps_red_and_blue: false,
            tone_mapping: way.tone_mapping,
            exposes: settings.output != Output::Nits,
            samples: settings.samples,
            resolve: settings.resolve,
            effects: settings.effects(),
            fxaa: settings.fxaa,
            msaa: settings.msaa,
            brdf,
            metal: surfaces.metal
                || (transparent && surfaces.transparent_metal)
                || keep.has(OptionalPart::MetallicChannel),
            textbook: settings.textbook,
            orthographic: scene.camera.is_orthographic(),
            brdf_override: settings.brdf,
            lights,
            light_order,
            // Counting and depth alone gain nothing from it.
            depth_prepass: settings.depth_prepass.unwrap_or(light_path == LightPath::Forward)
                && matches!(shading, Shading::Light { .. } | Shading::ShowGbuffer(_)),
            light_path,
            light_path_reason,
            geometry: BTreeSet::new(),
            transparent: BTreeSet::new(),
            streams: Streams::default(),
            materials,
            meshes: MeshPlan::default(),
            textures: TexturePlan::default(),
            anisotropy: anisotropy::degree(settings, device),
            footprint: None,
            uploads: Uploads::default(),
            lazily_allocated: device.lazily_allocated,
            software: device.software,
            keep,
            parts: Vec::new(),
            warnings,
        };
        plan.check_attachments(device)?;
        if shading != Shading::ShowShadowMap {
            plan.plan_pipelines(scene, settings);
        }
        plan.meshes = MeshPlan::of(scene, settings, &plan);
        plan.streams = plan.meshes.streams();
        plan.textures = TexturePlan::of(scene, settings, &plan);
        if !plan.textures.have_levels() {
            plan.anisotropy = 1;
        }
        plan.footprint = plan.drops_levels().then(|| least_footprint(&scene.camera, plan.size, plan.anisotropy));
        plan.uploads = Uploads::of(&plan);
        plan.parts = parts::list(scene, settings, &plan);
        if keep != Keep::NONE {
            let lean = Self::decide(scene, &Settings { keep: Keep::NONE, ..settings.clone() }, device)?;
            parts::say_what_is_kept(&mut plan.parts, &lean.parts);
        }
        plan.warn(settings);
        Ok(plan)
    }

    fn plan_pipelines(&mut self, scene: &Scene, settings: &Settings) {
        let mut triangles = 0;
        let plan = &*self;
        let drawn: Vec<&Object> = scene.objects.iter().filter(|object| plan.draws(scene, object)).collect();
        for object in drawn {
            let key = GeometryKey::of(object, settings, self);
            if !self.materials.all[object.material].is_transparent() {
                self.geometry.insert(key);
            } else {
                self.transparent.insert(key);
                triangles += scene.meshes[object.mesh].indices.len() / 3;
            }
        }
        self.transparent_triangles = u32::try_from(triangles).unwrap_or(u32::MAX);
    }

    /// Whether a frame finds out, on the CPU, which of these its camera does not need, and leaves them out. A GPU draws them faster
    /// than that (docs/FIGURES.md).
    pub(crate) fn seeks(&self, part: OptionalPart) -> bool {
        self.software && !self.keep.has(part)
    }

    /// Whether an object of the scene is in the world of the plan's frames.
    pub(crate) fn draws(&self, scene: &Scene, object: &Object) -> bool {
        let material = &self.materials.all[object.material];
        let left_out = material.is_transparent() && self.transparency.is_none();
        !visible::is_cut_away(material) && !left_out && !scene.meshes[object.mesh].indices.is_empty()
    }

    /// Whether a pass draws an object's mesh.
    fn needs_mesh(&self, scene: &Scene, object: &Object) -> bool {
        let casts = self.shadow.is_some()
            && object.casts_shadow != CastsShadow::No
            && !self.materials.all[object.material].is_transparent();
        self.draws(scene, object) && (self.has_geometry() || casts)
    }

    /// Whether an object's triangles are sorted for each frame.
    fn sorts(&self, scene: &Scene, object: &Object) -> bool {
        let transparent = self.materials.all[object.material].is_transparent();
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
        lights: &LightOrder,
    ) -> Result<(Option<ShadowPlan>, Vec<String>), Error> {
        let none = (None, Vec::new());
        let wanted = matches!(shading, Shading::Light { .. } | Shading::ShowShadowMap);
        if let Err(why) = shadow_reason(scene, settings, &lights.order) {
            return if shading == Shading::ShowShadowMap { Err(Error::NoShadowMap(why)) } else { Ok(none) };
        }
        if !wanted {
            return Ok(none);
        }
        if settings.shadows.size == 0 || settings.shadows.size > device.max_extent {
            return Err(Error::ShadowSize(settings.shadows.size, device.max_extent));
        }
        let (plan, warnings) = ShadowPlan::of(scene, settings, lights, device);
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
            None => u32::from(self.shading.only_covers()),
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

    /// The lights that frames have, by the scene's numbers, in the order in which they are added: directional ones, those that reach everywhere,
    /// those of limited reach.
    pub fn light_numbers(&self) -> &[usize] {
        &self.light_order.order
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
        self.lights.directional && self.has_shadows_of(|projection| matches!(projection, MapProjection::Cascades(_)))
    }

    /// Whether a point or spot light has shadow maps.
    pub fn has_punctual_shadows(&self) -> bool {
        self.lights.punctual && self.has_shadows_of(|projection| !matches!(projection, MapProjection::Cascades(_)))
    }

    fn has_shadows_of(&self, kind: impl Fn(MapProjection) -> bool) -> bool {
        let kept = self.keep.has(OptionalPart::ShadowMaps);
        self.shadow.as_ref().is_some_and(|shadow| kept || shadow.lights.iter().any(|light| kind(light.projection)))
    }

    /// Whether each froxel has a list of lights.
    pub fn has_clusters(&self) -> bool {
        let forward = match self.light_path {
            LightPath::Clustered | LightPath::Forward => true,
            // What is transparent is lit as it is drawn, whatever lights the rest.
            LightPath::ForwardNaive => false,
            _ => self.transparency.is_some(),
        };
        forward && self.may_list_lights()
    }

    fn may_list_lights(&self) -> bool {
        self.lights.bounded || (self.lights.any() && self.keep.has(OptionalPart::LightLists))
    }

    /// Whether LIGHTING goes over the lists of the froxels.
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
        matches!(self.tone_mapping, ToneMapping::Subpass(_) | ToneMapping::Kept)
    }
}

fn shading(view: View) -> Shading {
    match view {
        View::Final => Shading::Light { light_only: false },
        View::Lighting => Shading::Light { light_only: true },
        View::Overdraw => Shading::ShowOverdraw,
        View::Triangle => Shading::ShowTriangle,
        View::ShadowMap => Shading::ShowShadowMap,
        other => Shading::ShowGbuffer(other),
    }
}

/// Why there are no shadow maps.
fn shadow_reason(scene: &Scene, settings: &Settings, lights: &[usize]) -> Result<(), String> {
    if !settings.shadows.enabled {
        return Err("shadows are switched off".into());
    }
    let mut planned = lights.iter().map(|&index| &scene.lights[index]);
    let asking = planned.find(|light| light.casts_shadow);
    match asking {
        None => Err("no light casts a shadow".into()),
        Some(light) if scene.objects.iter().all(|object| object.casts_shadow == CastsShadow::No) => {
            Err(format!("nothing can stand between {} and anything", light.name))
        }
        Some(_) => Ok(()),
    }
}

fn is_forward(path: LightPath) -> bool {
    matches!(path, LightPath::Forward | LightPath::ForwardNaive)
}
