//! The decision of a plan from settings, device and scene alone, each step from the previous ones.

use ash::vk;

use super::effect::EffectRequest;
use super::gbuffer::GbufferNeeds;
use super::lights::{LightingPlan, adds_lights};
use super::output::{Blending, OutputChain};
use super::reasons::either;
use super::shadows::shadow_reason;
use super::surfaces::{FilteredTextures, SurfacePlan};
use super::{
    Capabilities, EffectPlans, FramePlan, Gbuffer, MeshPlan, OitTargets, PlanError, Reasons, Shading, SurfaceRules,
    Uploads, attachments, carriers, checks, culling, effects, geometry_locations, is_forward, is_tiled, lacks_gbuffer,
    lens, occlusion, parts, visibility,
};
use crate::scene::{GbufferChoice, Keep, LightPath, OptionalPart, Output, Scene, Settings, Transparency, View};

/// The choices by settings, device and scene. Pipelines, meshes and textures follow from them.
struct Choices {
    shading: Shading,
    lighting: LightingPlan,
    surfaces: SurfacePlan,
    gbuffer: Option<Gbuffer>,
    stores_gbuffer: bool,
    effects: EffectPlans,
    chain: OutputChain,
}

impl Choices {
    /// `view`: the view that was asked for.
    fn of(scene: &Scene, settings: &Settings, device: &Capabilities, view: View) -> Result<Self, PlanError> {
        checks::check_size(settings.size, device)?;
        let shading = Shading::of(settings.view, device)?;
        let mut lighting = LightingPlan::of(scene, settings, device, shading)?;
        let request = EffectRequest { scene, settings, view, shading, path: lighting.path, device };
        effects::check(&request)?;
        let surfaces = SurfacePlan::of(scene, settings, lighting.path)?;
        let rules = SurfaceRules::of(settings, shading, &lighting, lighting.shadow.as_ref(), &surfaces);
        let effects = EffectPlans::of(&request, &rules, lighting.lights.any());
        // The view of the complexity compares the values that LIGHTING would read, so they must be stored as for LIGHTING.
        let shadowed = lighting.shadow.is_some()
            || (settings.view == View::Complexity && shadow_reason(scene, settings, &lighting.order.order).is_ok());
        let gbuffer = (!lacks_gbuffer(lighting.path) && shading.reads_gbuffer()).then(|| {
            let stored = GbufferNeeds {
                brdf: surfaces.brdf,
                metal: surfaces.opaque_metal,
                reflectance: surfaces.reflectance,
                geometric_normal: shadowed && surfaces.two_normals,
                view: settings.view,
                keep: settings.keep,
            };
            Gbuffer::choose(&settings.gbuffer, stored, device)
        });
        checks::check_antialiasing(settings, shading.is_lit())?;
        lens::check(scene, settings)?;
        checks::check_msaa(settings, gbuffer.as_ref(), lighting.path, device)?;
        let as_drawn = is_forward(lighting.path) || surfaces.transparency.is_some() || effects.lobes.is_some();
        // TILED has no code for lights in a uniform buffer where it looks surfaces up, or each of several samples.
        let tiled_buffer =
            lighting.path == LightPath::Visibility || lighting.path == LightPath::Compute && settings.msaa > 1;
        lighting.lights.uniform &= !tiled_buffer && !effects.need_light_buffer(as_drawn);
        let integers = gbuffer.as_ref().is_some_and(|gbuffer| gbuffer.normal == vk::Format::R16G16_UINT);
        // Multisampling and integer normals are rare: LIGHTING has no variant with lights by fours for them.
        lighting.lights.by_fours &= settings.msaa == 1 && !integers;
        let [by_effects, filters] = effects.hdr(lighting.path).map(|why| why.is_some());
        let blending = Blending {
            lit: shading.is_lit(),
            tiled: is_tiled(lighting.path),
            emissive: surfaces.emissive,
            adds_lights: adds_lights(lighting.path, &lighting.lights),
            transparent: surfaces.transparency.is_some(),
            by_effects,
            filters,
        };
        let chain = OutputChain::of(settings, device, blending)?;
        let triangles = lighting.path == LightPath::Visibility;
        let locations = geometry_locations(gbuffer.as_ref(), shading, (surfaces.emissive, triangles));
        checks::check_attachments(locations, gbuffer.as_ref(), settings.msaa, device)?;
        // With a G-buffer that the next pass reads at its own pixel, depth with it. Some effects read its neighbours.
        let stores_gbuffer = gbuffer.is_some()
            && !is_tiled(lighting.path)
            && settings.view != View::Complexity
            && (settings.keep.has(OptionalPart::StoredGbuffer)
                || effects.present().any(|effect| effect.stores_gbuffer.is_some()));
        Ok(Self { shading, lighting, surfaces, gbuffer, stores_gbuffer, effects, chain })
    }
}

impl FramePlan {
    /// Decides on the parts of the frame.
    ///
    /// # Errors
    /// When the device does not support the settings, a view shows something that the scene lacks, or [`Scene::check`] finds a fault.
    pub fn of(scene: &Scene, settings: &Settings, device: &Capabilities) -> Result<Self, PlanError> {
        scene.check()?;
        let (asked, view) = (settings, settings.view);
        let settings = effects::effective_settings(asked);
        let settings = settings.as_ref();
        let mut plan = Self::decide(scene, settings, device, view)?;
        plan.reasons = plan.reasons.clone().with_absences(scene, asked, settings, &plan);
        let mut parts = parts::list(scene, settings, &plan);
        if plan.keep != Keep::NONE {
            let lean = Settings { keep: Keep::NONE, ..settings.clone() };
            let needed = parts::list(scene, &lean, &Self::decide(scene, &lean, device, view)?);
            parts::note_kept_parts(&mut parts, &needed);
        }
        plan.reasons.parts = parts;
        Ok(plan)
    }

    /// Decides everything but the descriptions of parts, for a scene that has been checked. `view` is the view that was asked for; another one may be
    /// planned in its place.
    ///
    /// If fragment shaders of the path that `Auto` chooses name too many resources for the device, the path is `loop`, which names the fewest.
    ///
    /// If the device has too few attachments for the G-buffer and no light path was asked for, surfaces are lit as they are drawn. If that path fails
    /// as well, the error names the part that needs the G-buffer and the options that avoid it.
    fn decide(scene: &Scene, settings: &Settings, device: &Capabilities, view: View) -> Result<Self, PlanError> {
        let of = |settings: &Settings| {
            let of = |settings: &Settings| Self::decide_as_asked(scene, settings, device, view);
            match of(settings) {
                Err(PlanError::FragmentResources(path, needed, most)) if settings.light_path == LightPath::Auto => {
                    let light_path = format!(
                        "{path} names {needed} storage buffers and colour attachments in a fragment shader, and the device has room for {most}"
                    );
                    let plan = of(&Settings { light_path: LightPath::Loop, ..settings.clone() })?;
                    Ok(Self { reasons: Reasons { light_path, ..plan.reasons }, ..plan })
                }
                decided => decided,
            }
        };
        let along = |light_path| Settings { light_path, ..settings.clone() };
        let error = match of(settings) {
            Err(error @ (PlanError::ColorAttachments(_) | PlanError::InputAttachments(_))) => error,
            // Other paths are no way out where the device cannot have their G-buffer.
            Err(error) if error.lacks_gbuffer() => match of(&along(LightPath::Loop)) {
                Err(few @ (PlanError::ColorAttachments(_) | PlanError::InputAttachments(_))) => few,
                _ => return Err(error),
            },
            decided => return decided,
        };
        let falls_back = |settings: &Settings| {
            settings.light_path == LightPath::Auto && settings.gbuffer == GbufferChoice::default()
        };
        if falls_back(settings) {
            match of(&along(LightPath::Forward)) {
                Ok(plan) => {
                    let light_path = attachments::reason(&error);
                    return Ok(Self { reasons: Reasons { light_path, ..plan.reasons }, ..plan });
                }
                Err(error) if error.lacks_gbuffer() => {}
                Err(error) => return Err(error),
            }
        }
        Err(attachments::advise(error, scene, settings, |changed| {
            let forward = Settings { light_path: LightPath::Forward, ..changed.clone() };
            of(changed).is_ok() || falls_back(changed) && of(&forward).is_ok()
        }))
    }

    fn decide_as_asked(
        scene: &Scene,
        settings: &Settings,
        device: &Capabilities,
        view: View,
    ) -> Result<Self, PlanError> {
        let Choices { shading, lighting, surfaces, gbuffer, stores_gbuffer, effects, chain } =
            Choices::of(scene, settings, device, view)?;
        let shadow = lighting.shadow.clone();
        let rules = SurfaceRules::of(settings, shading, &lighting, shadow.as_ref(), &surfaces);
        let pipelines = rules.pipelines(scene);
        let lists_moving = effects.list_moving();
        let mut meshes = MeshPlan::of(scene, &rules);
        meshes.deforms.keeps_positions = lists_moving.is_some() && !meshes.deforms.meshes.is_empty();
        let rules = SurfaceRules { lod: if meshes.has_levels() { rules.lod } else { 0.0 }, ..rules };
        let FilteredTextures { textures, anisotropy, places_by_shaders, footprint, warning } =
            FilteredTextures::of(scene, settings, device, &rules);
        let depth_prepass = lighting.has_prepass(settings, shading);
        let triangles = match lighting.path {
            LightPath::Visibility => Some(visibility::choose(scene, &rules, (&meshes, &textures), device)?),
            _ => None,
        };
        let culling = match lists_moving {
            _ if triangles.is_some() => Err("the CPU culls: `visibility` needs its list of instances".into()),
            Some(why) => Err(why.into()),
            None => {
                culling::choose(scene, settings, device, &rules, shading, (depth_prepass, lighting.shadow.is_some()))
            }
        };
        let hiding = occlusion::choose(scene, settings, &culling, (&rules, &pipelines.geometry), shading);
        let refused_culling = culling::warning(settings, &culling);
        let volumes = lighting.path == LightPath::Volumes && adds_lights(lighting.path, &lighting.lights);
        let plan = Self {
            size: settings.size,
            shading,
            stores_gbuffer,
            gbuffer,
            triangles,
            shadow: lighting.shadow,
            emissive: surfaces.emissive,
            transparency: surfaces.transparency,
            sums: (surfaces.transparency == Some(Transparency::Oit)).then(|| OitTargets::of(device)),
            transparent_triangles: pipelines.transparent_triangles,
            hdr: chain.hdr,
            output: chain.output,
            presented: None,
            encoding: None,
            swaps_red_and_blue: false,
            tone_mapping: chain.tone_mapping,
            exposes: settings.output != Output::Nits,
            samples: settings.samples,
            resolve: settings.resolve,
            on_picture: settings.effects(),
            msaa: settings.msaa,
            brdf: surfaces.brdf,
            reflectance: surfaces.reflectance,
            metal: surfaces.metal,
            textbook: settings.textbook,
            orthographic: scene.camera.is_orthographic(),
            brdf_override: settings.brdf,
            lights: lighting.lights,
            light_order: lighting.order,
            depth_prepass,
            culls_on_device: culling.is_ok(),
            hides_on_device: hiding.is_ok(),
            lod: rules.lod,
            lists_as_drawn: true,
            passes: settings.passes,
            sync: carriers::sync(settings, device)?,
            queues: carriers::queues(settings, device)?,
            layouts: carriers::layouts(settings, device)?,
            light_path: lighting.path,
            geometry: pipelines.geometry,
            lobes: pipelines.lobes,
            transparent: pipelines.transparent,
            streams: meshes.streams(),
            uploads: Uploads::of(&meshes, &textures, volumes).and(effects.uploads()),
            effects,
            meshes,
            textures,
            materials: surfaces.materials,
            anisotropy,
            places_by_shaders,
            footprint,
            lazily_allocated: device.lazily_allocated,
            software: device.software,
            keep: settings.keep,
            reasons: Reasons {
                light_path: lighting.reason,
                culling: either(culling),
                hiding: either(hiding),
                warnings: lighting
                    .shadow_warnings
                    .iter()
                    .cloned()
                    .chain(warning)
                    .chain(refused_culling)
                    .chain(lens::warning(settings))
                    .collect(),
                shadow_warnings: lighting.shadow_warnings,
                ..Reasons::default()
            },
        };
        checks::check_blocks(scene, &plan)?;
        effects::check_plan(&plan, device)?;
        carriers::check_passes(&plan, device)?;
        checks::check_sampled_images(&plan, device)?;
        plan.within_fragment_resources(device)
    }
}
