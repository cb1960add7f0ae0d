//! Anti-aliasing over time: the number of frames that are averaged, and the decision whether surfaces move by themselves.

use ash::vk;

use crate::plan::checks::ANTI_ALIASING;
use crate::plan::effect::{Effect, EffectRequest, EffectView, Hdr, NOT_ASKED_FOR, Shows, Variation};
use crate::plan::parts::part;
use crate::plan::{
    BufferName, FramePlan, OwnTarget, Part, PartGroup, PlanError, Refusal, SurfaceRules, Target, TargetName,
    format_bytes,
};
use crate::scene::{Local, Node, Placement, Resolve, Scene, Settings, Tonemap, View};

/// The mean that a frame leaves for the next one.
pub const TAA_MEAN: BufferName = BufferName("mean of frames");

/// The movement of surfaces that move by themselves: pixels to the right and down since the frame before, and how much farther away the surface
/// was then.
pub const VECTORS: Target = Target::OfSurfaces(TargetName(0, "Velocity"));
/// Pixels, of which half floats tell apart a 64th up to 32, a share of a distance, and a flag for a vector; mandatory to draw into.
const VECTOR: vk::Format = vk::Format::R16G16B16A16_SFLOAT;

/// Frames are averaged over time.
pub(crate) const EFFECT: Effect = Effect {
    name: "TAA",
    is_asked_for: |_, settings| settings.taa,
    off: Some(("--taa off", |settings| settings.taa = false)),
    view: Some(EffectView { view: View::Velocity, shows: Shows::Values, is_alone: true, plan: plan_vectors }),
    frames,
    is_set_aside: true,
    unswept: |key, _, plan| {
        let is_own = ["taa-frames", "taa-history", "sharpness"].contains(&key);
        (is_own && plan.effects.taa.is_none()).then_some("frames are not averaged over time")
    },
    is_in: |plans| plans.taa.is_some(),
    lists_moving: |plans| {
        let moves = plans.taa.is_some_and(|taa| taa.moves);
        moves.then_some("the CPU culls: it lists what moves by itself, whose vectors TAA needs")
    },
    hdr: Some(Hdr::Reads("light is averaged over time before it is tone-mapped")),
    absence: |own| if own.asked.taa { "the values that this view shows have no mean" } else { NOT_ASKED_FOR },
    targets: &[OwnTarget {
        target: VECTORS,
        noun: "vectors",
        line: None,
        format: |plan| plan.has_velocity().then_some(VECTOR),
        extent: |plan| plan.size,
        bytes_per_pixel: |_| format_bytes(VECTOR),
    }],
    parts: |_, _, plan| vec![part_of(plan).of(PartGroup::Targets)],
    not_by_compute: Some("they leave no light for TAA to average"),
    check,
    variations: &[
        Variation::of("over time", |settings| settings.taa = true),
        Variation::with("over time and moving", carry, |settings| settings.taa = true),
        Variation::view("view of vectors", carry, |settings| settings.view = View::Velocity),
    ],
    draws: &["sharpen"],
    former_rows: &[
        ("light-to-taa", &["hdr-to-taa", "*-to-taa"]),
        ("depth-to-taa", &["*-to-taa"]),
        ("depth-to-velocity", &["*-to-velocity"]),
        ("history-reuse", &["taa-reuse"]),
    ],
    ..Effect::PLAIN
};

/// Puts the first object on a node, which may move.
fn carry(scene: &mut Scene) {
    let local = Local::Parts(Placement::default());
    let node = Node { name: "carrier".into(), parent: None, local, weights: Vec::new() };
    if let Some(object) = scene.objects.first_mut().filter(|object| object.node.is_none()) {
        object.node = Some(scene.motion.nodes.len());
        scene.motion.nodes.push(node);
    }
}

/// The view of vectors is the lit picture of frames that know where surfaces were, and shows the vectors in its place.
fn plan_vectors(settings: &mut Settings) {
    *settings = Settings {
        view: View::Final,
        taa: true,
        // The frame before, and this one.
        taa_frames: 2,
        sharpness: 0.0,
        tonemap: Tonemap::None,
        ..settings.without_effects()
    };
}

fn check(request: &EffectRequest) -> Result<(), PlanError> {
    let Settings { taa, samples, msaa, .. } = *request.settings;
    if !taa || !request.shading.is_lit() {
        return Ok(());
    }
    EFFECT.check_path(request.path)?;
    let refuse = |why: String| Err(Refusal::of(ANTI_ALIASING, why));
    if samples > 1 {
        return refuse(format!(
            "taa averages frames over time, and --samples {samples} frames of one time: choose one"
        ));
    }
    if msaa > 1 {
        return refuse(format!("taa looks at one depth a pixel, and with --msaa {msaa} there are several: choose one"));
    }
    Ok(())
}

/// The parameters of TAA.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaaPlan {
    /// Frames that [`crate::frame::Renderer::picture`] draws for a picture, the last of which is read back.
    pub frames: u32,
    /// Frames that are averaged at most.
    pub history: u32,
    /// The share of a pixel's difference from its neighbours that SHARPEN adds.
    pub sharpness: f32,
    /// Opaque surfaces can move by themselves, so that VELOCITY draws their vectors.
    pub moves: bool,
    /// Frames are averaged as they are shown, and not as light.
    pub as_shown: bool,
    /// Pictures show the vectors, as values or as colours.
    pub shown: Option<Vectors>,
}

/// The form in which the view of vectors shows them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Vectors {
    /// Red and green are pixels to the right and down, blue is 1 where a surface moves by itself.
    Values,
    /// The colour is the direction, and bright the length.
    Colors,
}

/// The most frames that are averaged: the history counts them in 11 bits.
const MOST: u32 = 1024;
/// Frames that `picture` draws at most.
const MOST_FRAMES: u32 = 4096;

/// Frames that a picture with TAA has, and each of which stands for a part of the pixel; 1 without.
fn frames(settings: &Settings) -> u32 {
    if settings.taa { settings.taa_frames.min(settings.taa_history).clamp(1, MOST) } else { 1 }
}

impl TaaPlan {
    /// Views of values have no mean.
    pub(super) fn of(request: &EffectRequest, rules: &SurfaceRules) -> Option<Self> {
        let EffectRequest { scene, settings, view, shading, .. } = *request;
        if !settings.taa || !shading.is_lit() {
            return None;
        }
        let sharpness = settings.sharpness.clamp(0.0, 1.0);
        let vectors = if settings.output.is_linear() { Vectors::Values } else { Vectors::Colors };
        Some(Self {
            frames: settings.taa_frames.clamp(1, MOST_FRAMES),
            history: settings.taa_history.clamp(1, MOST),
            sharpness: if sharpness.is_nan() { 0.0 } else { sharpness },
            moves: rules.drawn(scene).any(|object| object.moves() && !rules.material(object).is_transparent()),
            as_shown: settings.resolve == Resolve::ToneMapped && !settings.output.is_linear(),
            shown: (view == View::Velocity).then_some(vectors),
        })
    }
}

impl FramePlan {
    /// Frames that are drawn for a picture.
    pub fn frames_a_picture(&self) -> u32 {
        self.effects.taa.map_or(self.samples, |taa| taa.frames)
    }

    /// Returns true if frames are averaged over time.
    pub fn averages_over_time(&self) -> bool {
        self.effects.taa.is_some()
    }

    /// The most frames that are averaged over time; 1 without averaging.
    pub fn averaged_frames(&self) -> u32 {
        self.effects.taa.map_or(1, |taa| taa.history)
    }

    /// Returns true if VELOCITY draws vectors of surfaces that move by themselves.
    pub fn has_velocity(&self) -> bool {
        self.effects.taa.is_some_and(|taa| taa.moves)
    }

    /// Bytes of the history: two frames, of four words a pixel.
    pub fn history_bytes(&self) -> u64 {
        let [width, height] = self.size.map(u64::from);
        self.effects.taa.map_or(0, |_| 2 * 16 * width * height)
    }
}

fn part_of(plan: &FramePlan) -> Part {
    let Some(taa) = plan.effects.taa else {
        return part("history of frames", false, "frames are not averaged over time", 0);
    };
    let reason = format!("two frames, of four words a pixel, of what up to {} frames were averaged to", taa.history);
    part("history of frames", true, reason, plan.history_bytes())
}
