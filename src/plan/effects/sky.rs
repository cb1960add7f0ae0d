//! The parts of a scene's sky that frames have.

use glam::{DVec3, Vec3};

use crate::plan::checks::out_of_range;
use crate::plan::effect::{Effect, EffectRequest, Hdr, LightReaders, Variation};
use crate::plan::parts::{Part, part};
use crate::plan::{FramePlan, PartGroup, PlanError, Shading, Uploads};
use crate::scene::{CastsShadow, Scene, Settings, Sky, SkyCube, SkyImage, SunDisc};

/// The scene's sky is seen, or lights surfaces.
pub(crate) const EFFECT: Effect = Effect {
    name: "a sky",
    is_asked_for: |scene, _| scene.sky.is_some(),
    not_by_compute: Some("they cannot draw a sky"),
    // A sky that is only seen changes no light.
    is_in: |plans| plans.sky.is_some_and(|sky| sky.lights),
    hdr: Some(Hdr::Adds("light of the sky is added before tone mapping")),
    needs_light_buffer: LightReaders::AsDrawn,
    uploads: |plans| Uploads { textures: plans.sky.is_some(), ..Uploads::default() },
    uploads_as: |one, other| one.sky == other.sky,
    absence: |own| if own.scene.sky.is_none() { "the scene has none" } else { "this view needs none" },
    parts: |_, _, plan| parts(plan).map(|part| part.of(PartGroup::Lights)).into(),
    check: |request| {
        if let Some(wrong) = out_of_range(request.settings, "sky-") {
            return EFFECT.refuse(wrong);
        }
        let Some(sky) = SkyPlan::of(request) else { return Ok(()) };
        EFFECT.check_path(request.path)?;
        let most = request.device.max_extent;
        if sky.edge > most { Err(PlanError::Sky(sky.edge, most)) } else { Ok(()) }
    },
    variations: &[
        Variation::with("under a sky", put_under_sky, |_| {}),
        Variation::with("under a sky with shadows", put_under_sky, |settings| settings.sky_shadows = Some(2)),
    ],
    ..Effect::PLAIN
};

/// A sky that is brighter to one side, with a sun.
fn put_under_sky(scene: &mut Scene) {
    let image = SkyImage::of("half bright", 32, |to| DVec3::splat(1.0 + to.x));
    let sun = SunDisc { direction: DVec3::Y, degrees: 0.5, radiance: Vec3::splat(1e5) };
    let sky =
        Sky { image: image.into(), rotation_degrees: 30.0, nits: 10.0, lights: true, shown: true, sun: Some(sun) };
    scene.sky = Some(sky);
}

/// The sky of a plan's frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkyPlan {
    /// Edge of a cube face in texels.
    pub edge: u32,
    /// It is drawn as the background.
    pub shown: bool,
    /// A sun is drawn into it.
    pub sun: bool,
    /// It lights surfaces.
    pub lights: bool,
    /// Directions for each texel of the specular lobes' light; 0 where it lights nothing.
    pub samples: u32,
    /// The mean and the brightest value of its image.
    pub image: (Vec3, f32),
}

impl SkyPlan {
    /// Returns `None` if the sky is neither visible nor lights surfaces.
    pub(super) fn of(request: &EffectRequest) -> Option<Self> {
        let EffectRequest { scene, settings, shading, .. } = *request;
        let Shading::Light { light_only } = shading else { return None };
        let sky = scene.sky.as_ref()?;
        let lights = lights(sky, settings);
        let shown = sky.shown && !light_only;
        (lights || shown).then(|| Self {
            edge: SkyCube::edge_of(&sky.image),
            shown,
            sun: shown && sky.sun.is_some(),
            lights,
            samples: if lights { settings.sky_samples } else { 0 },
            image: (sky.image.mean().as_vec3(), sky.image.brightest()),
        })
    }

    /// Bytes of the cube with its levels, and of the prefiltered light for surfaces.
    pub fn bytes(&self) -> [u64; 2] {
        let faces = |edge: u32, levels: u32| (0..levels).map(|level| 6 * 8 * u64::from((edge >> level).pow(2))).sum();
        let light = faces(256, 6) + faces(16, 1) + 8 * 64 * 64;
        [faces(self.edge, self.edge.ilog2() + 1), if self.lights { light } else { 0 }]
    }
}

/// The default number of directions a frame. With fewer frames, edges of single shadows would be visible (docs/SKY.md).
fn usual_directions(frames: u32) -> u32 {
    match frames {
        0..8 => 0,
        8..32 => 16,
        _ => 8,
    }
}

/// The number of sky directions that light a frame, each with a shadow map; 0 if the sky lights nothing or nothing occludes it.
pub(crate) fn sky_directions(scene: &Scene, settings: &Settings) -> u32 {
    let frames = super::frames(settings).max(settings.samples);
    let wanted = settings.sky_shadows.unwrap_or(usual_directions(frames));
    let is_hidden = || scene.objects.iter().any(|object| object.casts_shadow != CastsShadow::No);
    // The longest search comes last.
    let is_lit = || scene.sky.as_ref().is_some_and(|sky| lights(sky, settings) && sky.image.brightest() > 0.0);
    if wanted > 0 && settings.shadows.enabled && is_hidden() && is_lit() { wanted } else { 0 }
}

/// Returns true if a sky lights surfaces.
pub(super) fn lights(sky: &Sky, settings: &Settings) -> bool {
    sky.lights && settings.sky_light && sky.nits > 0.0
}

impl FramePlan {
    /// Returns true if the sky lights surfaces.
    pub fn is_lit_by_sky(&self) -> bool {
        self.effects.sky.is_some_and(|sky| sky.lights)
    }

    /// Returns true if the sky's light arrives by directions that have a shadow each.
    pub fn has_sky_shadows(&self) -> bool {
        self.shadow.as_ref().is_some_and(|shadow| shadow.sky.is_some())
    }

    /// Returns true if AMBIENT adds the sky's light to LIGHTING's.
    pub fn adds_ambient(&self) -> bool {
        self.is_lit_by_sky() && !self.is_forward()
    }
}

/// The cube of the sky, and the light of it that surfaces collect.
fn parts(plan: &FramePlan) -> [Part; 2] {
    let Some(sky) = &plan.effects.sky else {
        let why = plan.reasons.lack_of(EFFECT.name);
        return [part("sky", false, why, 0), part("light of the sky", false, why, 0)];
    };
    let [cube, light] = sky.bytes();
    let faces = format!("6 faces of {0}x{0} half floats, in all levels", sky.edge);
    let collected = match sky.lights {
        true => format!("computed once, from {} directions a texel", sky.samples),
        false => "the sky lights nothing".into(),
    };
    [part("sky", true, faces, cube), part("light of the sky", sky.lights, collected, light)]
}
