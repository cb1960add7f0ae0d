//! The declaration of an effect, written once, in the effect's own file. [`super::effects`] lists them, and plan, refusals and reasons follow from that list.
//!
//! Beside it an effect has a field of `EffectPlans`, a line of `EFFECTS` and its public names in `types`, all in the same table; its settings, in the table of settings; its
//! passes, each with its module in `src/passes/mod.rs` and its line in the order of a frame. `aberration.rs` is a small one, which works on the finished picture. `reflections.rs` is one that
//! works on light: it has a view, refusals and targets.

use super::{
    Capabilities, EffectPlans, FramePlan, OwnTarget, Part, PlanError, PlannedTexture, Refusal, RefusalReason, Shading,
    Target, Uploads, is_tiled, lacks_gbuffer,
};
use crate::scene::{LightPath, Scene, Settings, View};

/// Something that frames do beside lighting surfaces, where settings or the scene ask for it.
pub struct Effect {
    /// The name by which sentences call it.
    pub name: &'static str,
    /// Sentences say that they are, and not that it is.
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
    /// Refuses the settings, light paths and devices that it does not go with. Ranges of settings are checked by their rows, and what works on the finished picture (`on_picture` of
    /// its row) is refused by light paths, samples and outputs without a word here.
    pub check: fn(&EffectRequest) -> Result<(), PlanError>,
    /// Refuses devices that are too small for a whole plan.
    pub check_plan: fn(&FramePlan, &Capabilities) -> Result<(), PlanError>,

    /// Why it needs an HDR target.
    pub hdr: Option<Hdr>,
    /// It is blended as transparent surfaces are.
    pub blended: Option<Blended>,
    /// Changes the light of the picture before it is tone-mapped.
    pub changes_light: bool,
    /// Would blur the views of other effects, so that they leave it out.
    pub spreads: bool,
    /// Changes what is seen beside surfaces, so that no picture without its background can have it.
    pub shines_beyond: bool,
    /// Jittered frames that it averages to one picture, and each of which stands for a part of the pixel.
    pub frames: fn(&Settings) -> u32,

    /// Says why every light reaches all pixels under these settings; `None` if the effect adds no such reason.
    pub reaches_all_lights: fn(&Settings) -> Option<&'static str>,
    /// The lights that frames which have it need where no surface is seen.
    pub lit_air: fn(&FramePlan) -> LitAir,
    /// The shaders of its frames that have no code for lights in a uniform buffer.
    pub needs_light_buffer: LightReaders,
    /// True if a compute shader of it looks up the sky's light.
    pub computes_with_sky: bool,
    /// Says why the CPU lists the objects that move by themselves; `None` if the effect does not need that. Deformed meshes keep their vertices of the frame
    /// before, too.
    pub lists_moving: fn(&EffectPlans) -> Option<&'static str>,

    /// Its targets. `src/plan/targets.rs` has those that belong to no effect.
    pub targets: &'static [OwnTarget],
    /// Its textures, beside those of materials.
    pub textures: fn(&EffectPlans) -> &[PlannedTexture],
    /// The number of its storage buffers that every shader which lights names, in the frame's set.
    pub frame_buffers: fn(&FramePlan) -> u32,
    /// Its uploads before the first frame.
    pub uploads: fn(&EffectPlans) -> Uploads,
    /// Returns true if its data of one plan can stay on the device for the other.
    pub uploads_as: fn(&EffectPlans, &EffectPlans) -> bool,

    /// Lists the effect's own lines for `inspect`, such as its targets. Passes are listed elsewhere.
    pub parts: fn(&Scene, &Settings, &FramePlan) -> Vec<Part>,
    /// Why a report does not sweep the setting with this key, which is one of the effect's.
    pub unswept: fn(&str, &Scene, &FramePlan) -> Option<&'static str>,
    /// True if the report sets it aside before it takes a frame's error apart, because no part of the error stands for it.
    pub is_set_aside: bool,
    /// The forms of it that have passes or rows of their own: sample plans of tests, and mutants, are made of them.
    pub variations: &'static [Variation],

    /// Its passes that draw into the light or the picture, by the names that rows have of them: `reflect-resolve`.
    pub draws: &'static [&'static str],
    /// Names that rows to its passes, or from them, had formerly.
    pub former_rows: &'static [FormerRow],
}

/// A change that turns a plain frame into one with something more. Sample plans have each variation, alone and with others, and so have the mutants of the laboratory.
#[derive(Debug, Clone, Copy)]
pub struct Variation {
    /// Its name in words: `lit fog`.
    pub name: &'static str,
    /// Gives a scene what it lacks.
    pub scene: fn(&mut Scene),
    /// Asks for it.
    pub settings: fn(&mut Settings),
    /// It is tried with one other variation at most, as views are.
    pub is_alone: bool,
    /// The names of others that it is tried with, set by set, in frames that Vulkan carries in another way than by default.
    pub carried_with: &'static [&'static [&'static str]],
}

impl Variation {
    /// One that every scene can have.
    pub const fn of(name: &'static str, settings: fn(&mut Settings)) -> Self {
        Self::with(name, |_| {}, settings)
    }

    /// One that needs something of the scene.
    pub const fn with(name: &'static str, scene: fn(&mut Scene), settings: fn(&mut Settings)) -> Self {
        Self { name, scene, settings, is_alone: false, carried_with: &[] }
    }

    /// A view of the effect.
    pub const fn view(name: &'static str, scene: fn(&mut Scene), settings: fn(&mut Settings)) -> Self {
        Self { is_alone: true, ..Self::with(name, scene, settings) }
    }

    /// The same with [`Self::carried_with`].
    pub const fn carried_with(self, sets: &'static [&'static [&'static str]]) -> Self {
        Self { carried_with: sets, ..self }
    }
}

/// A former name of a row, with the names of today of which the first that a plan has takes its place. `*` stands for the pass that was the last to draw light or
/// the picture before the row.
pub type FormerRow = (&'static str, &'static [&'static str]);

/// An option that leaves an effect out, and the same as a change of settings.
pub type Off = (&'static str, fn(&mut Settings));

impl Effect {
    /// An effect of which its declaration says nothing else.
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
    /// Nothing of the picture's light is seen in it, so that all that would change that light is left out.
    pub is_alone: bool,
    /// Turns the settings that are asked for into the ones that are planned.
    pub plan: fn(&mut Settings),
}

/// The content of an effect's view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shows {
    /// Light, of which samples have a mean.
    Light,
    /// Values of one sample, found while the picture is lit.
    Values,
    /// A value of the G-buffer, which no light changes: the target that the effect's pass writes, and its content after that.
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
    /// Its light is added to LIGHTING's. Forward paths add it as they draw surfaces.
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
    /// The view that was asked for, in whose place another may be planned.
    pub view: View,
    pub shading: Shading,
    /// Never `Auto`.
    pub path: LightPath,
    pub device: &'a Capabilities,
}
