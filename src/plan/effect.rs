//! The declaration of an effect, written once, in the effect's own file. [`super::effects`] lists them, and plan, refusals and reasons follow from that list.
//!
//! Besides the declaration, an effect has a field of `EffectPlans`, a line of `EFFECTS` and public names in `types`, all in the same table. Its
//! settings are in the table of settings. Each of its passes has a module in `src/passes/mod.rs` and a line in the order of a frame. `aberration.rs`
//! is a small effect, which works on the finished picture. `reflections.rs` works on light, and has a view, refusals and targets.

use super::{
    Capabilities, EffectPlans, FramePlan, OwnTarget, Part, PlanError, PlannedTexture, Refusal, RefusalReason, Shading,
    Target, Uploads, is_tiled, lacks_gbuffer,
};
use crate::scene::{LightPath, Scene, Settings, View};

/// Something that frames do beside lighting surfaces, where settings or the scene ask for it.
pub struct Effect {
    /// The name by which sentences call it.
    pub name: &'static str,
    /// The name is plural in sentences: they are, not it is.
    pub is_plural: bool,

    /// Returns true if frames would have it on a light path that can draw it.
    pub is_asked_for: fn(&Scene, &Settings) -> bool,
    /// Leaves it out.
    pub off: Option<Off>,
    /// The view that shows it alone.
    pub view: Option<EffectView>,
    /// Returns true if frames with these plans of effects have it.
    pub is_in: fn(&EffectPlans) -> bool,
    /// Why frames have none.
    pub absence: fn(&Absence) -> &'static str,

    /// Why no light path can draw it that writes the tone-mapped picture itself: a clause that begins with `they`.
    pub not_by_compute: Option<&'static str>,
    /// Why no light path without a G-buffer can draw it.
    pub reads_gbuffer: Option<&'static str>,
    /// Why GEOMETRY stores the G-buffer for it.
    pub stores_gbuffer: Option<&'static str>,
    /// True if its shaders name many buffers: the advice for devices that allow few offers to leave it out.
    pub names_many_buffers: bool,
    /// Refuses the settings, light paths and devices that it does not go with. The settings table checks ranges, and effects on the finished picture
    /// (`on_picture` in their rows) need no check of light paths, samples and outputs here.
    pub check: fn(&EffectRequest) -> Result<(), PlanError>,
    /// Refuses devices that are too small for a whole plan.
    pub check_plan: fn(&FramePlan, &Capabilities) -> Result<(), PlanError>,

    /// Why it needs an HDR target.
    pub hdr: Option<Hdr>,
    /// How it is blended, if it is blended like transparent surfaces.
    pub blended: Option<Blended>,
    /// Changes the light of the picture before it is tone-mapped.
    pub changes_light: bool,
    /// Would blur the views of other effects, so that they leave it out.
    pub spreads: bool,
    /// Changes pixels without surfaces, so that a picture without background cannot have it.
    pub shines_beyond: bool,
    /// The number of jittered frames that it averages, each for a part of the pixel.
    pub frames: fn(&Settings) -> u32,

    /// Says why every light reaches all pixels under these settings; `None` if the effect adds no such reason.
    pub reaches_all_lights: fn(&Settings) -> Option<&'static str>,
    /// The lights that frames with the effect need in pixels without surfaces.
    pub lit_air: fn(&FramePlan) -> LitAir,
    /// The shaders of its frames that have no code for lights in a uniform buffer.
    pub needs_light_buffer: LightReaders,
    /// True if a compute shader of it looks up the sky's light.
    pub computes_with_sky: bool,
    /// Says why the CPU lists the objects that move by themselves; `None` if the effect does not need that. Deformed meshes then also keep the
    /// previous frame's vertices.
    pub lists_moving: fn(&EffectPlans) -> Option<&'static str>,

    /// The effect's targets. `src/plan/targets.rs` has the targets of no effect.
    pub targets: &'static [OwnTarget],
    /// The effect's textures, in addition to the materials'.
    pub textures: fn(&EffectPlans) -> &[PlannedTexture],
    /// The number of its storage buffers that every shader which lights names, in the frame's set.
    pub frame_buffers: fn(&FramePlan) -> u32,
    /// The effect's uploads before the first frame.
    pub uploads: fn(&EffectPlans) -> Uploads,
    /// Returns true if the effect's data on the device for one plan also serves the other.
    pub uploads_as: fn(&EffectPlans, &EffectPlans) -> bool,

    /// Lists the effect's own lines for `inspect`, such as its targets. Passes are listed elsewhere.
    pub parts: fn(&Scene, &Settings, &FramePlan) -> Vec<Part>,
    /// Why a report does not sweep the setting with this key, which is one of the effect's.
    pub unswept: fn(&str, &Scene, &FramePlan) -> Option<&'static str>,
    /// True if the report sets it aside before it takes a frame's error apart, because no part of the error stands for it.
    pub is_set_aside: bool,
    /// Variants with separate passes or dependency rows, from which the tests' sample plans and the laboratory's mutants are made.
    pub variations: &'static [Variation],

    /// The effect's passes that draw into the light or the picture, by their names in dependency rows, such as `reflect-resolve`.
    pub draws: &'static [&'static str],
    /// Former names of dependency rows to or from the effect's passes.
    pub former_rows: &'static [FormerRow],
}

/// A change that adds something to a plain frame. Sample plans and the laboratory's mutants have each variation, alone and with others.
#[derive(Debug, Clone, Copy)]
pub struct Variation {
    /// The name in words, such as `lit fog`.
    pub name: &'static str,
    /// Adds to a scene whatever the variation needs.
    pub scene: fn(&mut Scene),
    /// Asks for it.
    pub settings: fn(&mut Settings),
    /// It is tried with one other variation at most, as views are.
    pub is_alone: bool,
    /// Sets of other variations, by name, that it is tried with in frames with non-default passes, barriers, layouts or queues.
    pub carried_with: &'static [&'static [&'static str]],
}

impl Variation {
    /// A variation that every scene can have.
    pub const fn of(name: &'static str, settings: fn(&mut Settings)) -> Self {
        Self::with(name, |_| {}, settings)
    }

    /// A variation that needs something of the scene.
    pub const fn with(name: &'static str, scene: fn(&mut Scene), settings: fn(&mut Settings)) -> Self {
        Self { name, scene, settings, is_alone: false, carried_with: &[] }
    }

    /// A view of the effect.
    pub const fn view(name: &'static str, scene: fn(&mut Scene), settings: fn(&mut Settings)) -> Self {
        Self { is_alone: true, ..Self::with(name, scene, settings) }
    }

    /// Sets [`Self::carried_with`].
    pub const fn carried_with(self, sets: &'static [&'static [&'static str]]) -> Self {
        Self { carried_with: sets, ..self }
    }
}

/// A former name of a dependency row, and its current names, of which the first one that a plan has replaces it. `*` stands for the last pass that
/// drew light or the picture before the row.
pub type FormerRow = (&'static str, &'static [&'static str]);

/// An option that leaves an effect out, and its change of settings.
pub type Off = (&'static str, fn(&mut Settings));

impl Effect {
    /// The defaults of a declaration.
    pub const PLAIN: Self = Self {
        name: "",
        is_plural: false,
        is_asked_for: |_, _| false,
        off: None,
        view: None,
        is_in: |_| false,
        absence: |_| NOT_ASKED_FOR,
        not_by_compute: None,
        reads_gbuffer: None,
        stores_gbuffer: None,
        names_many_buffers: false,
        check: |_| Ok(()),
        check_plan: |_, _| Ok(()),
        hdr: None,
        blended: None,
        changes_light: false,
        spreads: false,
        shines_beyond: false,
        frames: |_| 1,
        reaches_all_lights: |_| None,
        lit_air: |_| LitAir::None,
        needs_light_buffer: LightReaders::None,
        computes_with_sky: false,
        lists_moving: |_| None,
        targets: &[],
        textures: |_| &[],
        frame_buffers: |_| 0,
        uploads: |_| Uploads::default(),
        uploads_as: |_, _| true,
        parts: |_, _, _| Vec::new(),
        unswept: |_, _, _| None,
        is_set_aside: false,
        variations: &[],
        draws: &[],
        former_rows: &[],
    };

    /// The error of settings that it does not go with.
    pub fn refuse<T>(&self, why: impl Into<String>) -> Result<T, PlanError> {
        Err(Refusal::of(self.name, why))
    }

    /// Refuses light paths that cannot draw it.
    pub fn check_path(&self, path: LightPath) -> Result<(), PlanError> {
        let why = match path {
            _ if self.not_by_compute.is_some() && is_tiled(path) => RefusalReason::WritesPicture(path),
            _ if self.reads_gbuffer.is_some() && lacks_gbuffer(path) => RefusalReason::NoGbuffer(path),
            _ => return Ok(()),
        };
        Err(PlanError::Refused(Refusal { what: self.name, why }))
    }
}

/// The reason against an effect that no setting turns on.
pub const NOT_ASKED_FOR: &str = "not asked for";

/// A view of an effect.
pub struct EffectView {
    pub view: View,
    pub shows: Shows,
    /// The view shows no light of the picture, so everything that would change that light is left out.
    pub is_alone: bool,
    /// Turns the settings that are asked for into the ones that are planned.
    pub plan: fn(&mut Settings),
}

/// The content of an effect's view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shows {
    /// Light, whose samples can be averaged.
    Light,
    /// Values of one sample, found while the picture is lit.
    Values,
    /// A G-buffer value, independent of lights, in a target that the effect's pass writes.
    Gbuffer {
        target: Target,
        /// What the target holds after the effect, in a sentence.
        content: &'static str,
        /// VIEW's code for it (`shaders/view.wgsl`).
        code: u32,
    },
}

/// The lights that shine into the air.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum LitAir {
    None,
    Directional,
    All,
    /// All, and shadows fall on the air wherever the camera looks.
    Shadowed,
}

/// Shaders that read lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LightReaders {
    None,
    /// The shaders that light surfaces as they draw them.
    AsDrawn,
    /// The shaders of the effect itself.
    Own,
}

/// An effect that is blended over the light as transparent surfaces are.
pub struct Blended {
    /// Why it needs an HDR target.
    pub hdr: &'static str,
    /// Says why weighted blending does not sum it up.
    pub unsummed: fn(&EffectPlans) -> &'static str,
    /// The most layers that it blends over a pixel.
    pub layers: fn(&EffectPlans) -> u32,
}

/// Why an effect needs an HDR target, in a sentence without a full stop.
pub enum Hdr {
    /// The effect adds its light to LIGHTING's. Forward paths add it as they draw surfaces.
    Adds(&'static str),
    /// It blends over the light before that is tone-mapped.
    Blends(&'static str),
    /// It reads the light of other pixels.
    Reads(&'static str),
}

/// Settings of frames that lack an effect.
pub struct Absence<'a> {
    pub scene: &'a Scene,
    /// The settings as they were given.
    pub asked: &'a Settings,
    /// The settings that the plan was made by.
    pub planned: &'a Settings,
}

/// The facts by which effects are chosen and refused.
pub struct EffectRequest<'a> {
    pub scene: &'a Scene,
    /// The settings that are planned.
    pub settings: &'a Settings,
    /// The view that was asked for; another may be planned in its place.
    pub view: View,
    pub shading: Shading,
    /// Never `Auto`.
    pub path: LightPath,
    pub device: &'a Capabilities,
}
