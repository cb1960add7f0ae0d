//! The plan as a list that a person reads: each part, in or out, why, and its bytes.

mod camera;

use std::collections::BTreeSet;

use super::lights::MIXED_FALLOFF;
use super::{
    FramePlan, Gbuffer, Grid, MapProjection, PlannedBrdf, PlannedLights, PlannedTexture, SLICES, Shading, ShadowLight,
    ShadowPlan, Sums, Target, TextureSource, ToneMapping, anisotropy, format_bytes, lacks_gbuffer, lens, shadow_reason,
    taa,
};
use crate::scene::{
    BlockFormat, HdrFormat, OptionalPart, Scene, Settings, SlotForm, TRAITS, TextureSlot, Transparency,
};

/// Something that a frame can have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// The part's name.
    pub name: String,
    /// The group that it belongs to.
    pub group: PartGroup,
    /// Its word for `--plan`, where it can be kept without need.
    pub optional: Option<OptionalPart>,
    /// True if frames have it.
    pub included: bool,
    /// Why it is in or out.
    pub reason: String,
    /// Device memory that it takes; none where it is out. What it would take, [`FramePlan::cost_of`] finds out.
    pub bytes: u64,
}

/// The groups of parts, in the order of reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PartGroup {
    /// Attachments.
    Targets,
    /// Passes and subpasses.
    Passes,
    /// Vertex streams and indices.
    Geometry,
    /// Textures and their levels.
    Textures,
    /// Lights and their lists.
    Lights,
    /// Shadow maps.
    Shadows,
    /// Parts that are decided anew for each frame.
    Camera,
}

impl PartGroup {
    /// As a heading.
    pub fn name(self) -> &'static str {
        match self {
            Self::Targets => "Targets",
            Self::Passes => "Subpasses and passes",
            Self::Geometry => "Geometry",
            Self::Textures => "Textures",
            Self::Lights => "Materials and lights",
            Self::Shadows => "Shadows",
            Self::Camera => "What the camera sees, decided for each frame",
        }
    }
}

pub(super) fn part(name: &str, included: bool, reason: impl Into<String>, bytes: u64) -> Part {
    let bytes = if included { bytes } else { 0 };
    // The group is set where parts are put together.
    Part { name: name.into(), group: PartGroup::Passes, optional: None, included, reason: reason.into(), bytes }
}

impl Part {
    /// It stays where the settings keep `optional`.
    fn is(self, optional: OptionalPart) -> Self {
        Self { optional: Some(optional), ..self }
    }
}

pub(super) fn list(scene: &Scene, settings: &Settings, plan: &FramePlan) -> Vec<Part> {
    let mut parts = Vec::new();
    let mut add = |group, some: Vec<Part>| parts.extend(some.into_iter().map(|part| Part { group, ..part }));
    add(PartGroup::Targets, gbuffer(plan));
    add(
        PartGroup::Targets,
        vec![
            stored(plan),
            hdr(settings, plan),
            sums(plan),
            samples_of_output(plan),
            bloom(plan),
            smoothed(plan),
            taa::part_of(plan),
        ],
    );
    add(PartGroup::Passes, passes(scene, settings, plan));
    add(PartGroup::Geometry, geometry(scene, plan));
    add(PartGroup::Geometry, vec![levels(settings, plan)]);
    add(PartGroup::Textures, textures(scene, settings, plan));
    add(PartGroup::Lights, shading(plan));
    add(PartGroup::Lights, vec![super::fog::parts(plan), super::froxels::parts(plan)]);
    add(PartGroup::Shadows, vec![shadow(scene, settings, plan)]);
    add(PartGroup::Camera, camera::parts(scene, plan));
    add(PartGroup::Camera, lens::parts(scene, settings).into());
    parts
}

/// The same parts of a plan that has another output than when they were listed.
pub(super) fn with_output(mut parts: Vec<Part>, plan: &FramePlan) -> Vec<Part> {
    if let Some(own) = parts.iter_mut().find(|part| part.name.starts_with("output (")) {
        let Part { name, bytes, .. } = output(plan);
        (own.name, own.bytes) = (name, bytes);
    }
    for new in [samples_of_output(plan), smoothed(plan)] {
        if let Some(own) = parts.iter_mut().find(|part| part.name == new.name) {
            own.bytes = new.bytes;
        }
    }
    parts
}

/// Parts that are only there because the settings keep them say so, and why nothing needs them.
pub(super) fn say_what_is_kept(parts: &mut [Part], lean: &[Part]) {
    for part in parts.iter_mut().filter(|part| part.included) {
        let needless = lean.iter().find(|own| own.optional.is_some() && own.optional == part.optional && !own.included);
        if let Some(needless) = needless {
            part.reason = format!("kept on request: {}", needless.reason);
        }
    }
}

fn shadow(scene: &Scene, settings: &Settings, plan: &FramePlan) -> Part {
    let missing = plan.shadow_warnings.iter().map(|warning| format!("; {warning}")).collect::<String>();
    let (reason, bytes) = match (shadow_reason(scene, settings, &plan.light_order.order), &plan.shadow) {
        (Err(reason), kept) => (reason, kept.as_ref().map_or(0, ShadowPlan::bytes)),
        (Ok(()), Some(shadow)) => (shadow_maps(shadow) + &missing, shadow.bytes()),
        (Ok(()), None) if missing.is_empty() => ("this view shows no shadows".into(), 0),
        (Ok(()), None) => (missing.trim_start_matches("; ").into(), 0),
    };
    part("shadow maps", plan.shadow.is_some(), reason, bytes).is(OptionalPart::ShadowMaps)
}

/// Who has how many maps, in which filter: `sun (3 cascades), lamp (6 faces): 10 maps in 5 layers, 3x3`.
fn shadow_maps(shadow: &ShadowPlan) -> String {
    const MOST: usize = 8;
    let one = |light: &ShadowLight| match light.projection {
        MapProjection::Cascades(1) => format!("{} (1 map)", light.name),
        MapProjection::Cascades(count) => format!("{} ({count} cascades)", light.name),
        MapProjection::Single => format!("{} (1 map)", light.name),
        MapProjection::Cube => format!("{} (6 faces)", light.name),
    };
    let mut names = shadow.lights.iter().take(MOST).map(one).collect::<Vec<_>>().join(", ");
    if let Some(more) = shadow.lights.len().checked_sub(MOST).filter(|&more| more > 0) {
        names += &format!(" and {more} more");
    }
    let plural = |count: usize, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
    let (maps, layers) = (plural(shadow.tiles.len(), "map"), plural(shadow.layers as usize, "layer"));
    format!("{names}: {maps} in {layers} of {}x{}, filter {}", shadow.size, shadow.size, shadow.filter)
}

fn output(plan: &FramePlan) -> Part {
    part(&format!("output ({:?})", plan.output), true, "the picture", bytes(plan, Target::Output))
}

fn gbuffer(plan: &FramePlan) -> Vec<Part> {
    let attachment = |name: &str, target: Target, reason: String| {
        let format = plan.format_of(target);
        let name = match format {
            Some(format) => format!("{name} ({format:?})"),
            None => name.to_string(),
        };
        part(&name, format.is_some(), reason, bytes(plan, target))
    };
    let rebuilt = plan.gbuffer.is_some_and(|gbuffer| gbuffer.position.is_none());
    let hides = match (plan.has_geometry(), rebuilt) {
        (false, _) => "nothing is drawn that could hide anything",
        (true, true) => "hides what lies behind; position is rebuilt from it",
        (true, false) => "hides what lies behind",
    };
    let largest = plan.hiding.clone().unwrap_or_else(|why| why);
    let mut parts = vec![
        output(plan),
        attachment("depth", Target::Depth, hides.into()),
        attachment("depth of the largest objects", Target::Occluders, largest),
        attachment(
            "visibility",
            Target::Visibility,
            plan.ao.as_ref().map_or_else(Clone::clone, |_| "AO hands it to AO_DENOISE".into()),
        ),
        attachment(
            "pyramid of depths of the picture",
            Target::Hiz,
            plan.reflections.as_ref().map_or_else(Clone::clone, |_| "REFLECT takes long steps through it".into()),
        ),
        attachment(
            "rays",
            Target::Rays,
            plan.reflections.as_ref().map_or_else(Clone::clone, |_| "REFLECT hands them to REFLECT_RESOLVE".into()),
        ),
    ];
    let Some(gbuffer) = &plan.gbuffer else {
        if plan.shading == Shading::ShowOverdraw {
            parts.push(attachment("fragment count", Target::Count, "the view shows it".into()));
        }
        if plan.shading == Shading::ShowTriangle {
            parts.push(attachment("triangle", Target::Triangle, "the view shows it".into()));
        }
        if let Some(code) = plan.triangles {
            let why = format!("its number in its mesh has {} bits, and that of its instance those above", code.bits);
            parts.push(attachment("triangle", Target::Triangle, why));
        }
        let reason = match plan.triangles {
            Some(_) => "surfaces are looked up by their triangles",
            None if plan.is_forward() => "surfaces are lit as they are drawn",
            None => "this view reads none",
        };
        parts.push(part("G-buffer", false, reason, 0));
        return parts;
    };
    parts.push(attachment("albedo", Target::Albedo, "every light needs it; alpha is ambient occlusion".into()));
    parts.push(attachment("normal", Target::Normal, format!("{:?}", gbuffer.normal_encoding)));
    let material = why(
        gbuffer.material.is_some(),
        "roughness, and what else the channels below say",
        "all materials are lambert, and the shading normal is the geometric one or nothing casts a shadow",
    );
    parts.push(attachment("material", Target::Material, material).is(OptionalPart::MaterialTarget));
    parts.extend(channels(gbuffer));
    let specular = why(
        gbuffer.specular.is_some(),
        "a material has Phong's terms or a reflectance of its own, or materials differ in their BRDF",
        "no material has Phong's terms or a reflectance of its own, and all have the same BRDF",
    );
    parts.push(attachment("specular", Target::Specular, specular).is(OptionalPart::SpecularTarget));
    let position = why(gbuffer.position.is_some(), "asked for", "rebuilt from depth");
    parts.push(attachment("position", Target::Position, position));
    parts
}

/// The channels of the material target that not every scene needs; their bytes are the target's.
fn channels(gbuffer: &Gbuffer) -> [Part; 2] {
    let (metallic, geometric) = (gbuffer.metallic, gbuffer.geometric_normal);
    let metal = if metallic { "a material is a metal, or it is shown" } else { "no material is a metal" };
    let normal = match geometric {
        true => "shadows are biased by it where normal maps bend the other, and it says where no shadow falls",
        false => "nothing casts a shadow, or no normal map bends the shading normal and shadows fall on everything",
    };
    [
        part("metallic channel", metallic, metal, 0).is(OptionalPart::MetallicChannel),
        part("geometric normal channels", geometric, normal, 0).is(OptionalPart::GeometricNormalChannels),
    ]
}

fn hdr(settings: &Settings, plan: &FramePlan) -> Part {
    let reason = match plan.tone_mapping {
        ToneMapping::Subpass(_) if plan.adds_lights() => {
            "lights are added one by one before tone mapping, in 32-bit floats, as half floats would lose light"
        }
        ToneMapping::Subpass(_) if plan.emissive => "emissive light is blended before tone mapping",
        ToneMapping::Subpass(_) if plan.adds_ambient() => "light of the sky is added before tone mapping",
        ToneMapping::Subpass(_) if plan.has_fog() => "fog is blended over the light before tone mapping",
        ToneMapping::Subpass(_) if plan.transparency.is_some() => {
            match plan.transparent.is_empty() && plan.particles.is_some() {
                true => "particles are blended before tone mapping",
                false => "transparent surfaces are blended before tone mapping",
            }
        }
        _ if plan.taa.is_some() => "light is averaged over time before it is tone-mapped",
        _ if plan.reflects() => "REFLECT reads the light of all pixels before it is tone-mapped",
        _ if plan.bloom.is_some() => "light is spread before it is tone-mapped",
        ToneMapping::Subpass(_) => "samples of a pixel are averaged as light before tone mapping",
        ToneMapping::InLighting(_) if plan.is_forward() => "nothing blends over it: FORWARD tone-maps into the output",
        ToneMapping::InLighting(_) if plan.is_tiled() => "compute tone-maps what it lit straight into the output",
        ToneMapping::InLighting(_) => "nothing blends over the lighting: it tone-maps straight into the output",
        ToneMapping::Kept => "light is kept as the tone-mapped frame keeps it, and written without a curve",
        ToneMapping::AfterFrames(_) => "frames are averaged before they are tone-mapped, on the CPU",
        ToneMapping::Absent if matches!(plan.shading, Shading::Light { .. }) => "the output itself is linear",
        ToneMapping::Absent => "a view is not tone-mapped",
    };
    let asked = settings.hdr_format;
    let reason = match plan.hdr {
        Some(format) => format!("{reason}; {format:?}"),
        None if asked != HdrFormat::default() => format!("{reason}, and {asked} has nothing to be the format of"),
        None => reason.to_owned(),
    };
    let name = if plan.is_tiled() { "target of emitted light" } else { "HDR target" };
    part(name, plan.hdr.is_some(), reason, bytes(plan, Target::Hdr)).is(OptionalPart::HdrTarget)
}

fn bloom(plan: &FramePlan) -> Part {
    match &plan.bloom {
        Some(own) => {
            let levels = own.levels(plan.size).len();
            let reason =
                format!("{levels} levels, each half as large as the one before it, four single floats a texel");
            part("levels of bloom", true, reason, own.bytes(plan.size))
        }
        None => part("levels of bloom", false, "no light is spread", 0),
    }
}

fn smoothed(plan: &FramePlan) -> Part {
    let reason = if plan.fxaa { "FXAA draws it" } else { "nothing smooths the picture" };
    part("smoothed picture", plan.fxaa, reason, bytes(plan, Target::Smoothed))
}

/// Of a target, for the whole picture; 0 where there is none.
fn bytes(plan: &FramePlan, target: Target) -> u64 {
    let [width, height] = plan.extent_of(target).map(u64::from);
    let texel = plan.format_of(target).map_or(0, format_bytes) * plan.samples_of(target);
    u64::from(texel) * width * height
}

fn samples_of_output(plan: &FramePlan) -> Part {
    let resolved = match (plan.resolves_output(), plan.msaa) {
        (true, _) => "the render pass resolves what is shown of each sample",
        (false, 1) => "one sample a pixel",
        (false, _) => "TONEMAP resolves, or the view shows all samples at once",
    };
    part("samples of the output", plan.resolves_output(), resolved, bytes(plan, Target::Samples))
}

/// How often passes run. Which there are, they declare themselves.
fn passes(scene: &Scene, settings: &Settings, plan: &FramePlan) -> Vec<Part> {
    [transparency(scene, plan), super::particles::part(scene, settings, plan)]
        .into_iter()
        .chain(antialiasing(plan))
        .collect()
}

fn stored(plan: &FramePlan) -> Part {
    let reason = match plan.has_ao() {
        true => "AO reads the depth and the normals around each pixel",
        false if plan.reflects() => "REFLECT reads the depth and the normals of all pixels",
        false if lacks_gbuffer(plan.light_path) => "there is no G-buffer",
        false if plan.is_tiled() => "the main pass ends with it, and TILED reads it: no other pass comes between",
        false => "no pass between GEOMETRY and LIGHTING reads neighbours: it need not leave the tile",
    };
    part("stored G-buffer", plan.stores_gbuffer, reason, 0).is(OptionalPart::StoredGbuffer)
}

fn antialiasing(plan: &FramePlan) -> [Part; 2] {
    let many = match plan.samples {
        1 => "one frame is a picture".to_string(),
        samples => format!("{samples} jittered frames make a picture"),
    };
    let multisampling = match plan.msaa {
        1 => "one sample a pixel".to_string(),
        samples if plan.is_forward() => format!("{samples} samples a pixel; each triangle in it is shaded once"),
        samples => format!("{samples} samples a pixel; where they differ, LIGHTING shades each"),
    };
    [part("accumulated frames", plan.samples > 1, many, 0), part("multisampling", plan.msaa > 1, multisampling, 0)]
}

fn transparency(scene: &Scene, plan: &FramePlan) -> Part {
    let objects = scene.objects.iter().filter(|object| scene.materials[object.material].is_transparent()).count();
    let reason = match plan.transparency {
        Some(_) if objects == 0 && plan.particles.is_some() => "no object is transparent, but particles are".into(),
        Some(Transparency::Sorted) => format!("{objects} transparent objects, sorted from back to front"),
        Some(Transparency::Oit) => format!("{objects} transparent objects, summed up with weights in any order"),
        None if objects > 0 => "this view leaves transparent objects out".into(),
        None => "no object is transparent".into(),
    };
    // Sorted triangles have an index buffer in each of two frames in flight.
    let indices = 2 * plan.sorted_index_bytes();
    let sorted = plan.transparency == Some(Transparency::Sorted);
    part("transparent surfaces", plan.transparency.is_some(), reason, if sorted { indices } else { 0 })
        .is(OptionalPart::Transparent)
}

fn sums(plan: &FramePlan) -> Part {
    let reason = match plan.sums {
        Some(Sums { accumulation, weights }) => {
            format!(
                "in {accumulation:?} and {weights:?}: what the surfaces send, how much they leave, and their weights"
            )
        }
        None => "transparent surfaces are sorted, or there are none".into(),
    };
    part(
        "sums of transparent surfaces",
        plan.sums.is_some(),
        reason,
        bytes(plan, Target::Accumulation) + bytes(plan, Target::Weights),
    )
}

fn shading(plan: &FramePlan) -> Vec<Part> {
    let count = plan.light_order.order.len();
    // A buffer for each of two frames in flight.
    let slots = count.max(1);
    let brdf = match plan.brdf {
        _ if plan.is_forward() => "a constant of each pipeline that lights what it draws".into(),
        PlannedBrdf::One(brdf) => format!("all materials are {brdf:?}: a constant in LIGHTING"),
        PlannedBrdf::PerPixel if plan.triangles.is_some() => "materials differ: each says its own".into(),
        PlannedBrdf::PerPixel => "materials differ: chosen for each pixel".into(),
    };
    let lights = &plan.lights;
    let kind = |name: &str, present: bool, optional| {
        let reason = if present { "the scene has some" } else { "no such light, or this view needs none" };
        part(name, present, reason, 0).is(optional)
    };
    let froxels = Grid::of(plan.size);
    let lists = match plan.has_clusters() {
        true => format!(
            "{}x{} tiles by {SLICES} slices, and as many entries as lights reach into them",
            froxels.columns, froxels.rows
        ),
        false => "no pass goes over lists of lights".into(),
    };
    let path = format!("light path {}", plan.light_path);
    let traits = TRAITS.iter().map(|own| kind(own.name, lights.traits & own.bit != 0, own.part));
    let emissive = plan.emissive || plan.keys().any(|key| key.forward.is_some_and(|key| key.emissive));
    let mut parts = vec![
        part(&path, matches!(plan.shading, Shading::Light { .. }), plan.light_path_reason.clone(), 0),
        part("BRDF by pixel", plan.brdf == PlannedBrdf::PerPixel && !plan.is_forward(), brdf, 0)
            .is(OptionalPart::BrdfByPixel),
        part("lists of lights by froxel", plan.has_clusters(), lists, 2 * 8 * froxels.clusters() as u64)
            .is(OptionalPart::LightLists),
        part(
            "light buffers",
            lights.any(),
            format!("{count} {} on the scene", if count == 1 { "light shines" } else { "lights shine" }),
            2 * 64 * slots as u64,
        ),
        idle_lights(plan),
        kind("directional lights", lights.directional, OptionalPart::DirectionalLights),
        kind("point and spot lights", lights.punctual, OptionalPart::PunctualLights),
    ];
    parts.extend(traits);
    parts.push(falloffs(lights));
    parts.push(kind("ambient light", lights.ambient, OptionalPart::AmbientLight));
    parts.push(kind("emissive surfaces", emissive, OptionalPart::Emissive));
    parts.extend(sky(plan));
    parts
}

/// The cube of the sky, and what surfaces collect of it.
fn sky(plan: &FramePlan) -> [Part; 2] {
    let Some(sky) = &plan.sky else {
        let why = "the scene has none, or this view needs none";
        return [part("sky", false, why, 0), part("light of the sky", false, why, 0)];
    };
    let [cube, light] = sky.bytes();
    let faces = format!("6 faces of {0}x{0} half floats, in all levels", sky.edge);
    let collected = match sky.lights {
        true => format!("computed once, from {} directions a texel", sky.samples),
        false => "the sky is seen alone".into(),
    };
    [part("sky", true, faces, cube), part("light of the sky", sky.lights, collected, light)]
}

/// Chosen for each light, or a constant.
fn falloffs(lights: &PlannedLights) -> Part {
    let mixed = lights.punctual && lights.falloff == MIXED_FALLOFF;
    let reason = match (lights.punctual, mixed) {
        (false, _) => "no light has one",
        (true, false) => "all lights have the same: a constant",
        (true, true) => "lights differ",
    };
    part("fall-off by light", mixed, reason, 0).is(OptionalPart::Falloffs)
}

/// Of each camera's view more are left out, frame by frame, on a CPU.
fn idle_lights(plan: &FramePlan) -> Part {
    let kept = plan.light_order.needless() > 0;
    let reason = match plan.light_order.idle.count() {
        _ if kept => "asked to stay, whether or not they reach anything".into(),
        0 if plan.light_order.idle.moves => "something moves, and may come into reach of any light".into(),
        0 => "every light reaches some object".into(),
        1 => "1 light reaches no object".into(),
        count => format!("{count} lights reach no object"),
    };
    part("lights that reach nothing", kept, reason, 0).is(OptionalPart::IdleLights)
}

/// Vertices and indices on the device, by stream.
/// Their bytes are those of indices.
fn levels(settings: &Settings, plan: &FramePlan) -> Part {
    let leveled: Vec<_> = plan.meshes.meshes.iter().map(|mesh| mesh.levels.len()).filter(|&count| count > 0).collect();
    let reason = match plan.shading {
        _ if plan.lod > 0.0 => format!(
            "objects are off by at most {} pixels: {} levels of {} meshes, {} KiB of indices",
            plan.lod,
            leveled.iter().sum::<usize>(),
            leveled.len(),
            plan.meshes.level_bytes().div_ceil(1024)
        ),
        _ if settings.lod <= 0.0 => "not asked for: meshes are drawn themselves".into(),
        Shading::ShowTriangle => "the view shows the triangles of the meshes themselves".into(),
        _ => "no mesh that opaque objects have as it is can be simplified, or is worth it".into(),
    };
    part("levels of detail", plan.lod > 0.0, reason, 0)
}

fn geometry(scene: &Scene, plan: &FramePlan) -> Vec<Part> {
    let planned = &plan.meshes;
    let rules = plan.surface_rules();
    let needed: BTreeSet<usize> =
        scene.objects.iter().filter(|object| rules.needs_mesh(scene, object)).map(|object| object.mesh).collect();
    let unused = scene.meshes.len() - needed.len();
    let keeps_unused = plan.keep.has(OptionalPart::UnusedMeshes) && unused > 0;
    let unused = match unused {
        0 => "no mesh of the scene is unused".into(),
        count => format!("no pass draws {count} of {} meshes", scene.meshes.len()),
    };
    let stream = |name: &str, optional: OptionalPart, vertices: u64, stride: u64, (yes, no): (&str, &str)| {
        let reason = match (vertices, plan.keep.has(optional)) {
            (0, _) => no.to_string(),
            (_, true) => "kept for all vertices".into(),
            (some, false) if some == planned.vertices => yes.to_string(),
            (some, false) => format!("{yes}: {some} of {} vertices have it", planned.vertices),
        };
        part(name, vertices > 0, reason, stride * vertices).is(optional)
    };
    let wide = match (planned.indices_32, plan.keep.has(OptionalPart::WideIndices)) {
        (0, _) => "no mesh has more vertices than 16 bits can number".into(),
        (_, true) => "kept for all meshes".into(),
        (_, false) => "of meshes with more than 65536 vertices".to_string(),
    };
    vec![
        part(
            "vertex positions",
            planned.vertices > 0,
            "every pass that draws meshes reads them",
            12 * planned.vertices,
        ),
        part("16-bit indices", planned.indices_16 > 0, "of meshes with at most 65536 vertices", 2 * planned.indices_16),
        part("32-bit indices", planned.indices_32 > 0, wide, 4 * planned.indices_32).is(OptionalPart::WideIndices),
        // Their bytes count above and below.
        part("unused meshes", keeps_unused, unused, 0).is(OptionalPart::UnusedMeshes),
        stream("vertex normals", OptionalPart::Normals, planned.normals, 12, ("shading reads them", "nothing shades")),
        stream("vertex UVs", OptionalPart::Uvs, planned.uvs, 8, ("textures are sampled", "no texture is sampled")),
        stream(
            "vertex tangents",
            OptionalPart::Tangents,
            planned.tangents,
            16,
            ("a normal map is sampled", "no normal map is sampled"),
        ),
        stream(
            "second vertex UVs",
            OptionalPart::SecondUvs,
            planned.second_uvs,
            8,
            ("a texture lies on them", "no texture lies on them"),
        ),
        stream(
            "vertex colours",
            OptionalPart::VertexColors,
            planned.colors,
            16,
            ("they multiply base colours", "no drawn mesh has other colours than white"),
        ),
        looks(plan),
    ]
}

fn looks(plan: &FramePlan) -> Part {
    let reason = match (plan.has_looks(), plan.keep.has(OptionalPart::Looks)) {
        (true, true) => "kept for all objects: 8 bytes an instance, beside the 48 of its place",
        (true, false) => "objects have a tint, a cell of an atlas or may be selected: 8 bytes an instance",
        (false, _) => "no object has one",
    };
    // They are written for each frame, as many as it draws.
    part("looks of instances", plan.has_looks(), reason, 0).is(OptionalPart::Looks)
}

fn why(present: bool, yes: &str, no: &str) -> String {
    if present { yes.to_string() } else { no.to_string() }
}

fn textures(scene: &Scene, settings: &Settings, plan: &FramePlan) -> Vec<Part> {
    let planned = &plan.textures;
    let mut parts = Vec::new();
    // A texture counts in the first slot that it is in.
    let mut counted = BTreeSet::new();
    for slot in TextureSlot::ALL {
        let SlotForm { name, part: optional, .. } = *slot.form();
        let holes = planned.holes.values().filter(|_| slot == TextureSlot::BaseColor);
        let images = planned.sets.values().filter_map(|slots| slots.get(&slot)).chain(holes);
        let images: BTreeSet<usize> = images.copied().collect();
        let own =
            images.iter().filter(|&&image| matches!(planned.images[image].source, TextureSource::Scene(_))).count();
        let reason = match (images.is_empty(), plan.keep.has(optional)) {
            (true, _) => "no drawn material needs one".into(),
            (false, true) => format!("{own} of drawn materials; kept for all, with a neutral texel where one has none"),
            (false, false) => format!("{own} of drawn materials"),
        };
        let bytes = images.iter().filter(|&&image| counted.insert(image)).map(|&image| planned.images[image].bytes());
        let bytes = bytes.sum();
        parts.push(part(name, !images.is_empty(), reason, bytes).is(optional));
    }
    let sampled = planned.sampled();
    let unused: Vec<usize> = (0..planned.images.len()).filter(|image| !sampled.contains(image)).collect();
    let why_unused = match unused.len() {
        0 => format!("{} of the {} in the scene are sampled", sampled.len(), scene.textures.len()),
        count => format!("kept: nothing samples {count} of the {} in the scene", scene.textures.len()),
    };
    let unused_bytes = unused.iter().map(|&image| planned.images[image].bytes()).sum();
    parts.push(part("unused textures", !unused.is_empty(), why_unused, unused_bytes).is(OptionalPart::UnusedTextures));
    parts.push(decoded(plan));
    parts.extend(masks(plan));
    parts.push(anisotropy::part(settings, plan));
    parts
}

/// Returns the part about textures of compressed files: those decoded to texels, and the bytes that the blocks of the others save.
fn decoded(plan: &FramePlan) -> Part {
    let images = || plan.textures.images.iter().filter(|image| image.compressed.is_some());
    let count = |is: &dyn Fn(&PlannedTexture) -> bool| images().filter(|image| is(image)).count();
    let formats = BlockFormat::ALL.map(|format| (count(&|image| image.blocks == Some(format)), format));
    let formats = formats.iter().filter(|(count, _)| *count > 0);
    let formats = formats.map(|(count, format)| format!("{count} in {format}")).collect::<Vec<_>>().join(", ");
    let saved: u64 = images().map(PlannedTexture::saved_bytes).sum();
    let stay = count(&|image| image.blocks.is_some());
    let lacking = count(&|image| image.makes_levels);
    let foreign = count(&|image| image.blocks.is_none() && !image.makes_levels);
    let says = [
        (stay, format!("{stay} stay compressed ({formats}), {saved} bytes less than decoded")),
        (lacking, format!("{lacking} decoded: their files lack smaller levels, which are made")),
        (foreign, format!("{foreign} decoded: the device does not sample their blocks")),
    ];
    let says: Vec<String> = says.into_iter().filter(|(count, _)| *count > 0).map(|(_, says)| says).collect();
    let reason = if says.is_empty() { "no texture is compressed in its file".into() } else { says.join("; ") };
    // Their bytes count with the textures of their slots.
    part("decoded textures", lacking + foreign > 0, reason, 0).is(OptionalPart::DecodedTextures)
}

/// Returns the parts about textures for which factors of materials do as well.
fn masks(plan: &FramePlan) -> [Part; 3] {
    let materials = &plan.materials;
    let constant = materials.constant.len();
    let keeps = |part, count: usize| plan.keep.has(part) && count > 0;
    let why_constant = match constant {
        0 => "every texture of a material differs from texel to texel".into(),
        _ => format!("{constant} textures are of one colour, which their materials' factors can hold"),
    };
    let masked = plan.keys().any(|key| key.discards) || !plan.textures.holes.is_empty();
    let needs = plan.keys().any(|key| key.masked) || !plan.textures.holes.is_empty();
    let why_masked = match (masked, needs) {
        (true, true) => "a material is masked by its texture",
        (true, false) => "kept: every alpha passes",
        (false, _) => "no material is masked",
    };
    let idle = materials.opened + materials.emptied;
    let why_idle = match idle {
        0 => "every mask cuts something and leaves something".into(),
        _ => format!("{} masks cut nothing, {} leave nothing", materials.opened, materials.emptied),
    };
    // Their bytes count with the textures of their slots.
    [
        part("constant textures", keeps(OptionalPart::ConstantTextures, constant), why_constant, 0)
            .is(OptionalPart::ConstantTextures),
        part("alpha masks", masked, why_masked, 0).is(OptionalPart::AlphaMasks),
        part("idle masks", keeps(OptionalPart::OpaqueMasks, idle), why_idle, 0).is(OptionalPart::OpaqueMasks),
    ]
}

#[cfg(test)]
mod tests {
    use crate::plan::samples;

    #[test]
    fn every_part_is_in_or_out_for_a_reason_and_agrees_with_the_plan() {
        for (name, plan) in samples::plans() {
            let starts = |text: &str| plan.parts().iter().find(|part| part.name.starts_with(text));
            assert!(plan.parts().iter().all(|part| !part.reason.is_empty()), "{name}");
            let included = |text| starts(text).is_some_and(|part| part.included);
            assert_eq!(included("shadow maps"), plan.shadow.is_some(), "{name}");
            assert_eq!(included("HDR target"), plan.has_tonemap_subpass(), "{name}");
            assert_eq!(included("transparent surfaces"), plan.transparency.is_some(), "{name}");
            assert_eq!(included("sums"), plan.transparency == Some(crate::scene::Transparency::Oit), "{name}");
            assert_eq!(included("depth"), plan.has_geometry(), "{name}");
            assert_eq!(included("light buffer"), plan.lights.any(), "{name}");
            let mut optional: Vec<_> = plan.parts().iter().filter_map(|part| part.optional).collect();
            optional.sort();
            assert!(optional.windows(2).all(|pair| pair[0] != pair[1]), "{name}: a part is listed twice");
            assert!(plan.parts().iter().all(|part| part.included || part.bytes == 0), "{name}");
            assert_eq!(included("material"), plan.gbuffer.is_some_and(|gbuffer| gbuffer.material.is_some()), "{name}");
        }
    }
}
