//! The plan as a list that a person reads: each part, in or out, why, and its bytes.

mod camera;
mod lights;
mod meshes;
mod targets;
mod textures;

pub(super) use targets::{bytes_of_target, line_of_target};

use super::{FramePlan, Target, effects, lens};
use crate::scene::{OptionalPart, Scene, Settings, Transparency, counted};

/// Something that a frame can have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// The part's name.
    pub name: String,
    /// The group that it belongs to.
    pub group: PartGroup,
    /// The name for `--plan`, if the part can be kept without need.
    pub optional: Option<OptionalPart>,
    /// True if frames have it.
    pub included: bool,
    /// The reason why it is in or out.
    pub reason: String,
    /// Bytes of device memory; 0 if the part is out. [`FramePlan::cost_of`] computes the cost of keeping it.
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
    // Others say theirs, or it is set where parts are put together.
    Part { name: name.into(), group: PartGroup::Passes, optional: None, included, reason: reason.into(), bytes }
}

impl Part {
    /// Puts it into another group.
    pub(super) fn of(self, group: PartGroup) -> Self {
        Self { group, ..self }
    }

    /// It stays where the settings keep `optional`.
    fn is(self, optional: OptionalPart) -> Self {
        Self { optional: Some(optional), ..self }
    }
}

pub(super) fn list(scene: &Scene, settings: &Settings, plan: &FramePlan) -> Vec<Part> {
    let mut parts = Vec::new();
    let mut add = |group, some: Vec<Part>| parts.extend(some.into_iter().map(|part| part.of(group)));
    let of_effects = |group| effects::parts(scene, settings, plan, (group, false));
    let read_depth = effects::parts(scene, settings, plan, (PartGroup::Targets, true));
    add(PartGroup::Targets, targets::gbuffer(plan, read_depth));
    add(
        PartGroup::Targets,
        vec![
            targets::stored(plan),
            targets::hdr(settings, plan),
            targets::sums(plan),
            targets::samples_of_output(plan),
        ],
    );
    add(PartGroup::Targets, of_effects(PartGroup::Targets));
    add(PartGroup::Passes, vec![transparency(scene, plan)]);
    add(PartGroup::Passes, of_effects(PartGroup::Passes));
    add(PartGroup::Passes, antialiasing(plan).into());
    add(PartGroup::Geometry, meshes::geometry(scene, plan));
    add(PartGroup::Geometry, vec![meshes::levels(settings, plan)]);
    add(PartGroup::Textures, textures::textures(scene, settings, plan));
    add(PartGroup::Lights, lights::shading(scene, settings, plan));
    add(PartGroup::Lights, of_effects(PartGroup::Lights));
    add(PartGroup::Shadows, vec![lights::shadow(scene, settings, plan)]);
    add(PartGroup::Camera, camera::parts(scene, plan));
    add(PartGroup::Camera, lens::parts(scene, settings).into());
    parts
}

/// Updates listed parts to a plan with another output.
pub(super) fn with_output(mut parts: Vec<Part>, plan: &FramePlan) -> Vec<Part> {
    if let Some(own) = parts.iter_mut().find(|part| part.name.starts_with("output (")) {
        let Part { name, bytes, .. } = targets::output(plan);
        (own.name, own.bytes) = (name, bytes);
    }
    let redrawn = effects::targets().filter(|own| own.target.is_picture()).map(|own| (own.line, own.target));
    for (name, target) in redrawn.chain([(Some("samples of the output"), Target::Samples)]) {
        if let Some(own) = parts.iter_mut().find(|part| Some(&*part.name) == name) {
            own.bytes = bytes_of_target(plan, target);
        }
    }
    parts
}

/// Parts that are only there because the settings keep them say so, and why nothing needs them.
pub(super) fn note_kept_parts(parts: &mut [Part], lean: &[Part]) {
    // Parts that frames leave out by camera have their own reason when they stay.
    for part in parts.iter_mut().filter(|part| part.included && part.group != PartGroup::Camera) {
        let needless = lean.iter().find(|own| own.optional.is_some() && own.optional == part.optional && !own.included);
        if let Some(needless) = needless {
            part.reason = format!("kept on request: {}", needless.reason);
        }
    }
}

fn antialiasing(plan: &FramePlan) -> [Part; 2] {
    let many = match plan.samples {
        1 => "a picture is one frame".to_string(),
        samples => format!("{samples} jittered frames make a picture"),
    };
    let multisampling = match plan.msaa {
        1 => "one sample a pixel".to_string(),
        samples if plan.is_forward() => format!("{samples} samples a pixel; each triangle in it is shaded once"),
        samples => {
            let lights = if plan.is_tiled() { "TILED" } else { "LIGHTING" };
            format!("{samples} samples a pixel; where they differ, {lights} shades each")
        }
    };
    [part("accumulated frames", plan.samples > 1, many, 0), part("multisampling", plan.msaa > 1, multisampling, 0)]
}

fn transparency(scene: &Scene, plan: &FramePlan) -> Part {
    let objects = scene.objects.iter().filter(|object| scene.materials[object.material].is_transparent()).count();
    let blended = effects::of(plan).find(|effect| effect.blended.is_some() && objects == 0);
    let reason = match plan.transparency {
        Some(_) if blended.is_some() => {
            format!("no object is transparent, but {} are", blended.map_or("others", |effect| effect.name))
        }
        Some(Transparency::Sorted) => format!("{}, sorted from back to front", counted(objects, "transparent object")),
        Some(Transparency::Oit) => {
            format!("{}, summed up with weights in any order", counted(objects, "transparent object"))
        }
        None if objects > 0 => "this view leaves transparent objects out".into(),
        None => "no object is transparent".into(),
    };
    // Sorted triangles have an index buffer in each of two frames in flight.
    let indices = 2 * plan.sorted_index_bytes();
    let sorted = plan.transparency == Some(Transparency::Sorted);
    part("transparent surfaces", plan.transparency.is_some(), reason, if sorted { indices } else { 0 })
        .is(OptionalPart::Transparent)
}

fn why(present: bool, yes: &str, no: &str) -> String {
    if present { yes.to_string() } else { no.to_string() }
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
