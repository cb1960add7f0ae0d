//! Particles: the room that a frame has for a scene's emitters, and the way in which they are drawn.

use std::fmt;

use glam::DVec3;

use crate::plan::effect::{Blended, Effect, EffectRequest, EffectView, LightReaders, LitAir, Shows, Variation};
use crate::plan::parts::{Part, part};
use crate::plan::{
    BufferName, Capabilities, EffectPlans, FramePlan, PlanError, PlannedTexture, Refusal, RefusalReason, Shading,
    Uploads,
};
use crate::scene::{Emitter, Scene, Settings, Transparency, View, counted};
use crate::shaders::sort::host as sort;

/// The outputs of SIMULATE and SORT: particles, and their order.
pub const PARTICLES: BufferName = BufferName("particles");

/// The scene's emitters send out particles.
pub(crate) const EFFECT: Effect = Effect {
    name: "particles",
    is_plural: true,
    is_asked_for: are_shown,
    off: Some(("--particles off", |settings| settings.particles = false)),
    view: Some(EffectView {
        view: View::Particles,
        shows: Shows::Light,
        is_alone: true,
        // The lit picture, with a count of layers over it, which any order gives.
        plan: |settings| {
            (settings.view, settings.particles, settings.transparency) = (View::Final, true, Transparency::Sorted);
        },
    }),
    blended: Some(Blended {
        hdr: "particles are blended before tone mapping",
        unsummed: |plans| match &plans.particles {
            Some(own) if own.counts => "particles are counted",
            _ => "particles are sorted",
        },
        layers: |plans| plans.particles.as_ref().map_or(0, |own| own.capacity),
    }),
    textures,
    needs_light_buffer: LightReaders::Own,
    uploads: |plans| Uploads::of_textures(textures(plans)),
    uploads_as: |one, other| textures(one) == textures(other),
    unswept: |key, scene, _| (key == "particles" && scene.emitters.is_empty()).then_some("the scene has no emitters"),
    // They float where no object is.
    lit_air: |_| LitAir::All,
    is_in: |plans| plans.particles.is_some(),
    absence: |own| match (own.scene.emitters.is_empty(), own.planned.particles) {
        (true, _) => "the scene has no emitters",
        (false, false) => "switched off by --particles off",
        (false, true) => "this view shows none",
    },
    parts: |_, _, plan| vec![part_of(plan)],
    not_by_compute: Some("they cannot draw particles"),
    names_many_buffers: true,
    check,
    variations: &[
        Variation::with("particles", emit, |_| {}),
        Variation::view("view of particles", emit, |settings| settings.view = View::Particles),
    ],
    check_plan: check_buffers,
    former_rows: &[
        ("particles-reuse", &["simulate-reuse"]),
        ("particles-to-draw", &["sort-to-readers", "simulate-to-readers"]),
    ],
    ..Effect::PLAIN
};

/// So many particles that SORT takes several steps.
fn emit(scene: &mut Scene) {
    let spread = DVec3::splat(0.5);
    let emitter = Emitter { rate: 3000.0, size: vec![0.05], spread, color: vec![[0.5; 4]], ..Emitter::default() };
    scene.emitters = vec![emitter];
}

/// Keys that a work group of SORT has in shared memory.
pub const SORT_BLOCK: u32 = sort::BLOCK;

/// Bytes that a work group of SORT shares: the keys of a block, of two words each.
pub const SORT_SHARED_BYTES: u32 = 8 * SORT_BLOCK;

/// Number of keys that SORT puts into order for this many particles.
pub fn sort_places(count: u32) -> u32 {
    count.next_power_of_two().max(SORT_BLOCK)
}

/// The particles of a plan's frames.
#[derive(Debug, Clone, PartialEq)]
pub struct ParticlePlan {
    /// The most particles that are alive at once.
    pub capacity: u32,
    /// The number of sources.
    pub emitters: u32,
    /// The emitters' textures, each once; empty if all particles are soft discs.
    pub textures: Vec<PlannedTexture>,
    /// The texture of each emitter, by its place in `textures`.
    pub texture_of: Vec<Option<u32>>,
    /// The view of particles: each layer counts alike, and nothing else is drawn.
    pub counts: bool,
}

/// The text in `inspect`, such as `up to 100 particles of 2 emitters`.
impl fmt::Display for ParticlePlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let emitters = counted(self.emitters as usize, "emitter");
        write!(f, "up to {} of {emitters}", counted(self.capacity as usize, "particle"))
    }
}

/// Returns true if a picture shows the scene's particles.
fn are_shown(scene: &Scene, settings: &Settings) -> bool {
    settings.particles && settings.view == View::Final && !scene.emitters.is_empty()
}

fn check(request: &EffectRequest) -> Result<(), PlanError> {
    let EffectRequest { scene, settings, device, .. } = *request;
    let counts = request.view == View::Particles;
    if counts && scene.emitters.is_empty() {
        let why = "the scene has no emitters, so that the view particles has nothing to count";
        return Err(PlanError::Refused(Refusal { what: EFFECT.name, why: RefusalReason::NothingToShow(why.into()) }));
    }
    if !are_shown(scene, settings) || request.shading != LIT {
        return Ok(());
    }
    EFFECT.check_path(request.path)?;
    if settings.msaa > 1 {
        return EFFECT.refuse(
            "they are soft where they meet the one surface of a pixel, and several samples have several: ask for --msaa 1, or --samples",
        );
    }
    if settings.transparency == Transparency::Sorted && !counts && device.shared_memory < SORT_SHARED_BYTES {
        return EFFECT.refuse(format!(
            "to sort them, work groups share {SORT_SHARED_BYTES} bytes, and those of this device at most {}: choose --transparency oit, which needs no order",
            device.shared_memory
        ));
    }
    Ok(())
}

const LIT: Shading = Shading::Light { light_only: false };

/// The textures of a plan's emitters.
fn textures(plans: &EffectPlans) -> &[PlannedTexture] {
    plans.particles.as_ref().map_or(&[], |own| &own.textures)
}

impl ParticlePlan {
    /// Returns `None` if frames draw no particles.
    pub(super) fn of(request: &EffectRequest) -> Option<Self> {
        let EffectRequest { scene, settings, device, .. } = *request;
        if !are_shown(scene, settings) || request.shading != LIT {
            return None;
        }
        let all = scene.particle_textures();
        let place = |own: (usize, [u32; 2])| all.iter().position(|other| *other == own).map(|place| place as u32);
        Some(Self {
            // `Scene::check` has bounded it.
            capacity: scene.most_particles().min(u64::from(u32::MAX)) as u32,
            emitters: scene.emitters.len() as u32,
            textures: all.iter().map(|&own| PlannedTexture::of_sheet(scene, own, device)).collect(),
            texture_of: scene
                .emitters
                .iter()
                .map(|own| own.texture.and_then(|texture| place((texture, own.frames))))
                .collect(),
            counts: request.view == View::Particles,
        })
    }

    /// Places in the buffer of keys: a power of two, which SORT needs, and a block of it at least.
    pub fn places(&self) -> u32 {
        sort_places(self.capacity)
    }

    /// Bytes of particle states, sort keys and textures.
    pub fn bytes(&self) -> u64 {
        let textures: u64 = self.textures.iter().map(PlannedTexture::bytes).sum();
        48 * u64::from(self.capacity) + 8 * u64::from(self.places()) + textures
    }
}

/// Refuses particles whose shaders name more buffers than the device allows: SIMULATE names the frame's buffers, the emitters, the particles and, if
/// they are sorted, their keys.
fn check_buffers(plan: &FramePlan, device: &Capabilities) -> Result<(), PlanError> {
    let sorts = u32::from(plan.sorts_particles());
    let (needed, most) = (plan.frame_buffers() + 2 + sorts, device.storage_buffers);
    if plan.effects.particles.is_none() || needed <= most {
        return Ok(());
    }
    let advice = match needed - sorts <= most {
        true => "--transparency oit, which takes one less, or --particles off",
        false => "--particles off",
    };
    let why = format!("a shader names {needed} buffers for them, and on this device at most {most}: choose {advice}");
    EFFECT.refuse(why)
}

impl FramePlan {
    /// Returns true if particles are drawn from back to front.
    pub fn sorts_particles(&self) -> bool {
        let sorted = self.transparency == Some(Transparency::Sorted);
        self.effects.particles.as_ref().is_some_and(|own| sorted && !own.counts)
    }
}

fn part_of(plan: &FramePlan) -> Part {
    let Some(own) = &plan.effects.particles else {
        return part("particles", false, plan.reasons.lack_of(EFFECT.name), 0);
    };
    let order = match (own.counts, plan.sorts_particles()) {
        (true, _) => "counted",
        (_, true) => "sorted from back to front, after transparent surfaces",
        (_, false) => "summed up with weights in any order",
    };
    let reason = format!("up to {} of {}, {order}", own.capacity, counted(own.emitters, "emitter"));
    part("particles", true, reason, own.bytes())
}
