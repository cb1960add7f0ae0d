//! Ambient occlusion: the decision whether frames find on the screen the share of ambient light that surfaces nearby occlude, and by which method.

use std::fmt;

use ash::vk;
use glam::Vec3;

use crate::plan::effect::{Effect, EffectRequest, EffectView, NOT_ASKED_FOR, Shows, Variation};
use crate::plan::parts::line_of_target;
use crate::plan::{FramePlan, OwnTarget, PlanError, Target, TargetName};
use crate::scene::{AmbientOcclusion, AoResolution, Scene, Settings, View, counted};
use crate::shaders::view::host::SHOW_OCCLUSION;

/// AO's output: a share of the light from everywhere in 10 bits, and 22 of the depth of its pixel.
pub const VISIBILITY: Target = Target::FromDepth(TargetName(0, "Visibility"));

/// Surfaces hide light from everywhere from each other.
pub(crate) const EFFECT: Effect = Effect {
    name: "ambient occlusion",
    is_asked_for: is_used,
    off: Some(("--ao off", |settings| settings.ao = AmbientOcclusion::Off)),
    view: Some(EffectView {
        view: View::Ao,
        shows: Shows::Gbuffer {
            target: Target::Albedo,
            content: "The share of light from everywhere that arrives",
            code: SHOW_OCCLUSION,
        },
        is_alone: false,
        plan: |_| {},
    }),
    changes_light: true,
    unswept: |key, _, plan| {
        (key.starts_with("ao") && !plan.has_ao())
            .then_some("no ambient occlusion was asked for, or nothing would show it")
    },
    reads_gbuffer: Some("ambient occlusion reads a G-buffer"),
    stores_gbuffer: Some("AO reads the depth and the normals around each pixel"),
    is_in: |plans| plans.ao.is_some(),
    absence: |own| match own.planned.view {
        _ if own.planned.ao == AmbientOcclusion::Off => NOT_ASKED_FOR,
        View::Final | View::Lighting | View::Ambient => {
            "no light comes from everywhere but that of a sky with shadows of its own, and it weakens no other"
        }
        _ => "this view does not show it",
    },
    targets: &[OUTPUT],
    parts: |_, _, plan| vec![line_of_target(plan, EFFECT.name, &OUTPUT, "AO hands it to AO_DENOISE")],
    check,
    variations: &[
        Variation::with("occluded", light_from_everywhere, |settings| settings.ao = AmbientOcclusion::Bitmask),
        Variation::view("view of occlusion", light_from_everywhere, |settings| {
            (settings.ao, settings.view) = (AmbientOcclusion::Bitmask, View::Ao);
        }),
    ],
    former_rows: &[
        ("gbuffer-to-ao", &["geometry-to-ao"]),
        ("visibility-to-denoise", &["visibility-to-ao-denoise"]),
        ("occlusion-to-lighting", &["ao-denoise-to-lighting"]),
        ("occlusion-to-tiled", &["albedo-to-tiled"]),
        ("ao-to-transparent", &["ao-denoise-to-transparent"]),
    ],
    ..Effect::PLAIN
};

const OUTPUT: OwnTarget = OwnTarget {
    target: VISIBILITY,
    noun: "visibility",
    line: Some("visibility"),
    // Mandatory to store to.
    format: |plan| plan.has_ao().then_some(vk::Format::R32_UINT),
    extent: |plan| plan.size.map(|edge| edge.div_ceil(scale(plan))),
    bytes_per_pixel: |plan| 4 / scale(plan).pow(2),
};

fn scale(plan: &FramePlan) -> u32 {
    plan.effects.ao.map_or(1, |ao| ao.scale)
}

/// Adds ambient light, which AO weakens.
fn light_from_everywhere(scene: &mut Scene) {
    scene.environment.ambient = Vec3::splat(0.1);
}

/// The parameters of AO, all fixed in its pipelines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AoPlan {
    /// Never `Off`.
    pub method: AmbientOcclusion,
    /// Samples of the depth buffer for each pixel that AO evaluates.
    pub samples: u32,
    /// Metres beyond which nothing is hidden.
    pub radius: f32,
    /// AO evaluates one pixel of each square with this edge.
    pub scale: u32,
}

/// Maximum samples of a slice: sixteen to each side. AO_DENOISE averages sixteen slices in any case, so more steps pay before more slices do.
const SAMPLES_OF_A_SLICE: u32 = 32;

/// The text in `inspect`, such as `bitmask within 0.5 m, 16 samples in 1 slice, at each pixel`.
impl fmt::Display for AoPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} within {} m, {}", self.method, self.radius, counted(self.samples, "sample"))?;
        if let (AmbientOcclusion::Bitmask, [count, _]) = (self.method, self.slices()) {
            write!(f, " in {}", counted(count, "slice"))?;
        }
        f.write_str(if self.scale == 1 { ", at each pixel" } else { ", at one of four pixels" })
    }
}

impl AoPlan {
    /// `None` where frames find no ambient occlusion.
    pub(super) fn of(request: &EffectRequest) -> Option<Self> {
        let &Settings { ao: method, ao_radius: radius, ao_samples: samples, ao_resolution, .. } = request.settings;
        let scale = if ao_resolution == AoResolution::Half { 2 } else { 1 };
        is_used(request.scene, request.settings).then_some(Self { method, samples, radius, scale })
    }

    /// Slices of the hemisphere, and steps to each of their two sides.
    pub fn slices(&self) -> [u32; 2] {
        let slices = self.samples.div_ceil(SAMPLES_OF_A_SLICE).max(1);
        [slices, (self.samples / (2 * slices)).max(1)]
    }
}

fn check(request: &EffectRequest) -> Result<(), PlanError> {
    let &Settings { ao: method, ao_radius: radius, ao_samples: samples, msaa, .. } = request.settings;
    if method == AmbientOcclusion::Off {
        return Ok(());
    }
    if !(RADII.0..=RADII.1).contains(&radius) {
        return EFFECT.refuse(format!("a radius of {radius} m: it must be {} to {} m", RADII.0, RADII.1));
    }
    if samples == 0 || samples > MOST_SAMPLES {
        return EFFECT.refuse(format!("{samples} samples of the depth buffer: choose 1 to {MOST_SAMPLES}"));
    }
    if !is_used(request.scene, request.settings) {
        return Ok(());
    }
    EFFECT.check_path(request.path)?;
    if msaa > 1 {
        return EFFECT.refuse(format!(
            "{method} looks at one depth a pixel, and with --msaa {msaa} there are several: choose --samples"
        ));
    }
    Ok(())
}

/// The least and the greatest radius in metres.
const RADII: (f32, f32) = (0.001, 1000.0);
/// The most samples, few enough that no driver's watchdog fires.
const MOST_SAMPLES: u32 = 256;

/// Returns true if the picture would show AO.
fn is_used(scene: &Scene, settings: &Settings) -> bool {
    settings.ao != AmbientOcclusion::Off
        && match settings.view {
            View::Final | View::Lighting | View::Ambient => {
                let sky = scene.sky.as_ref().is_some_and(|sky| super::sky::lights(sky, settings));
                // A sky with shadow maps is occluded by these, not by AO.
                scene.environment.is_lit() || sky && super::sky::sky_directions(scene, settings) == 0
            }
            view => view == View::Ao,
        }
}

impl FramePlan {
    /// Returns true if frames find ambient occlusion.
    pub fn has_ao(&self) -> bool {
        self.effects.ao.is_some()
    }

    /// Returns true if the passes of ambient occlusion run on the compute queue.
    pub fn computes_beside(&self) -> bool {
        self.queues.compute && self.has_ao()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::samples;
    use crate::scene::Brdf;
    use glam::Vec3;

    #[test]
    fn off_it_leaves_no_trace_and_on_it_parts_the_render_pass() {
        let mut scene = samples::scene(vec![samples::textured(Brdf::Lambert)], vec![samples::sun()]);
        scene.environment.ambient = Vec3::ONE;
        let off = samples::plan(&scene, &samples::deferred());
        let numbers = Settings { ao_radius: 3.0, ao_samples: 64, ..samples::deferred() };
        assert!(off.has_structure_of(&samples::plan(&scene, &numbers)));
        assert!(!off.has_ao() && !off.stores_gbuffer && off.format_of(VISIBILITY).is_none());
        let half = Settings { ao: AmbientOcclusion::Bitmask, ao_resolution: AoResolution::Half, ..numbers };
        let on = samples::plan(&scene, &Settings { size: [33, 20], ..half });
        assert!(on.has_ao() && on.stores_gbuffer);
        assert_eq!((on.extent_of(VISIBILITY), on.extent_of(Target::Depth)), ([17, 10], [33, 20]));
        // 4 bytes for one pixel of four.
        assert_eq!((on.bytes_of(VISIBILITY), off.bytes_of(VISIBILITY)), (1, 0));
    }

    #[test]
    fn samples_go_into_steps_first_and_then_into_slices() {
        let slices = |samples| AoPlan { method: AmbientOcclusion::Bitmask, samples, radius: 1.0, scale: 1 }.slices();
        assert_eq!([1, 4, 16, 32, 64, 256].map(slices), [[1, 1], [1, 2], [1, 8], [1, 16], [2, 16], [8, 16]]);
    }
}
