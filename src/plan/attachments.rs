//! Advice for devices with too few attachments for a G-buffer: the fewest changes of settings with which the device draws the scene. Each combination
//! is tried, so that no advice leads to another refusal.

use super::effect::Effect;
use super::{PlanError, effects};
use crate::scene::{GbufferChoice, LightPath, Scene, Settings, Transparency, View};

/// A G-buffer of more attachments than a subpass of the device can have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TooFew {
    /// Attachments of the G-buffer.
    pub needed: u32,
    /// Attachments that a subpass of the device can have.
    pub most: u32,
    /// The part of the frame that needs a G-buffer, with its verb.
    pub who: String,
    /// A colon and the options with which the device draws the scene; empty if no options help.
    pub advice: String,
}

impl TooFew {
    pub(super) fn new(needed: u32, most: u32) -> Self {
        Self { needed, most, who: "this frame needs".into(), advice: String::new() }
    }
}

/// The reason why a frame without a chosen light path is lit as it is drawn.
pub(super) fn reason(error: &PlanError) -> String {
    match error {
        PlanError::ColorAttachments(TooFew { needed, most, .. }) => {
            format!("a G-buffer needs {needed} colour attachments in one subpass, and the device has {most}")
        }
        PlanError::InputAttachments(TooFew { needed, most, .. }) => {
            format!("a G-buffer is read through {needed} input attachments, and the device has {most}")
        }
        other => other.to_string(),
    }
}

/// A change of one setting.
struct SettingChange {
    option: &'static str,
    /// The part of the frame that is left out, if it reads a G-buffer.
    leaves_out: Option<&'static Effect>,
    apply: fn(&mut Settings),
}

/// The changes that have an effect on these settings; changes that alter the picture least come first.
fn changes(scene: &Scene, settings: &Settings) -> Vec<SettingChange> {
    let change = |option, leaves_out, apply| SettingChange { option, leaves_out, apply };
    let asked_for =
        |is_meant: fn(&Effect) -> bool| effects::asked_for(scene, settings).filter(move |own| is_meant(own));
    let without = |effect: &'static Effect| {
        let (option, apply) = effect.off?;
        Some(change(option, effect.reads_gbuffer.map(|_| effect), apply))
    };
    let readers = asked_for(|own| own.reads_gbuffer.is_some())
        .filter(|own| own.view.as_ref().is_none_or(|own| own.view != settings.view));
    let namers = || asked_for(|own| own.names_many_buffers);
    let of_surfaces = [
        (
            settings.gbuffer != GbufferChoice::default(),
            change("--gbuffer lean", None, |own| own.gbuffer = GbufferChoice::default()),
        ),
        (
            !super::lacks_gbuffer(settings.light_path),
            change("--light-path forward", None, |own| own.light_path = LightPath::Forward),
        ),
    ];
    let unsorted = (settings.transparency != Transparency::Oit && namers().next().is_some())
        .then(|| change("--transparency oit", None, |own| own.transparency = Transparency::Oit));
    let of_surfaces = of_surfaces.into_iter().filter_map(|(alters, change)| alters.then_some(change));
    of_surfaces.chain(readers.filter_map(without)).chain(unsorted).chain(namers().filter_map(without)).collect()
}

/// Adds to an error of [`TooFew`] who needs the G-buffer, and the options that do without it. `draws` tries settings.
pub(super) fn advise(
    error: PlanError,
    scene: &Scene,
    settings: &Settings,
    draws: impl Fn(&Settings) -> bool,
) -> PlanError {
    let changes = changes(scene, settings);
    let chosen = |set: u32| changes.iter().enumerate().filter(move |(bit, _)| set >> bit & 1 == 1).map(|(_, own)| own);
    let with = |set: u32| {
        let mut changed = settings.clone();
        chosen(set).for_each(|change| (change.apply)(&mut changed));
        changed
    };
    let of_size = |size| (0..1u32 << changes.len()).filter(move |set| set.count_ones() == size);
    let ways: Vec<u32> = (1..=changes.len() as u32)
        .map(|size| of_size(size).filter(|&set| draws(&with(set))).collect::<Vec<_>>())
        .find(|ways| !ways.is_empty())
        .unwrap_or_default();
    let left_out: Vec<&Effect> =
        ways.first().map_or(Vec::new(), |&set| chosen(set).filter_map(|own| own.leaves_out).collect());
    let who = match left_out[..] {
        [one] if !one.is_plural => format!("{} needs", one.name),
        [_, ..] => format!("{} need", left_out.iter().map(|own| own.name).collect::<Vec<_>>().join(" and ")),
        [] if ways.is_empty() && settings.view != View::Final => format!("the view {} needs", settings.view),
        [] => "this frame needs".to_owned(),
    };
    let options = |&set: &u32| format!("`{}`", chosen(set).map(|own| own.option).collect::<Vec<_>>().join(" "));
    let ways = ways.iter().map(options).collect::<Vec<_>>().join(", or ");
    let advice = if ways.is_empty() { ways } else { format!(": choose {ways}") };
    let told = |few: TooFew| TooFew { who, advice, ..few };
    match error {
        PlanError::ColorAttachments(few) => PlanError::ColorAttachments(told(few)),
        PlanError::InputAttachments(few) => PlanError::InputAttachments(told(few)),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::samples::{self, material, point, textured};
    use super::super::{Capabilities, FramePlan};
    use super::*;
    use crate::scene::{AmbientOcclusion, Brdf, Emitter, Falloff, GbufferPreset, Reflections};

    /// A scene whose G-buffer has five targets: albedo, normals, materials, specular and emissive light.
    fn scene() -> Scene {
        let glowing = crate::scene::Material { emissive: Vec3::ONE, ..textured(Brdf::Phong) };
        let mut scene = samples::scene(vec![glowing, material(Brdf::CookTorrance)], vec![point(Falloff::Quadratic)]);
        scene.environment.ambient = Vec3::ONE;
        scene
    }

    /// A device of four attachments.
    fn four() -> Capabilities {
        Capabilities { max_color_attachments: 4, max_input_attachments: 4, ..samples::software() }
    }

    fn refused(scene: &Scene, settings: &Settings, device: &Capabilities) -> String {
        FramePlan::of(scene, settings, device).expect_err("must be refused").to_string()
    }

    const HAS_4: &str = "a G-buffer of 5 colour attachments in one subpass, and the device has 4";

    #[test]
    fn the_error_names_what_needs_the_gbuffer_and_each_option_that_it_advises_draws() {
        let (plain, path) = (Settings::default(), |light_path| Settings { light_path, ..Settings::default() });
        let with_ao = |own: Settings| Settings { ao: AmbientOcclusion::Bitmask, ..own };
        let with_reflections = |own: Settings| Settings { reflections: Reflections::Screen, ..own };
        let fat = GbufferChoice { preset: GbufferPreset::Fat, ..GbufferChoice::default() };
        assert!(FramePlan::of(&scene(), &plain, &four()).is_ok_and(|plan| plan.is_forward()));
        for (settings, says) in [
            (with_ao(plain.clone()), format!("ambient occlusion needs {HAS_4}: choose `--ao off`")),
            (with_reflections(plain.clone()), format!("reflections need {HAS_4}: choose `--reflections off`")),
            (
                with_reflections(with_ao(plain.clone())),
                format!("ambient occlusion and reflections need {HAS_4}: choose `--ao off --reflections off`"),
            ),
            // The path that this advice once named, and the path that the following refusal named.
            (with_ao(path(LightPath::Forward)), format!("ambient occlusion needs {HAS_4}: choose `--ao off`")),
            (
                with_ao(path(LightPath::Loop)),
                format!("ambient occlusion needs {HAS_4}: choose `--light-path forward --ao off`"),
            ),
            (path(LightPath::Loop), format!("this frame needs {HAS_4}: choose `--light-path forward`")),
            (Settings { view: View::Albedo, ..plain.clone() }, format!("the view albedo needs {HAS_4}")),
            (Settings { view: View::Ao, ..plain.clone() }, format!("the view ao needs {HAS_4}")),
            (Settings { view: View::Reflections, ..plain.clone() }, format!("the view reflections needs {HAS_4}")),
            (Settings { view: View::Albedo, ..path(LightPath::Forward) }, format!("the view albedo needs {HAS_4}")),
        ] {
            assert_eq!(refused(&scene(), &settings, &four()), says);
        }
        let few = Capabilities { max_color_attachments: 8, ..four() };
        let text = refused(&scene(), &with_ao(plain.clone()), &few);
        assert_eq!(
            text,
            "ambient occlusion needs a G-buffer of 5 input attachments in one subpass, and the device has 4: choose `--ao off`"
        );
        // Where the device has enough of them, the advice of the path holds.
        let text = refused(&scene(), &with_ao(path(LightPath::Forward)), &samples::device());
        assert!(text.ends_with("the light path forward has none: choose another, as loop"), "{text}");
        // Several ways of one length are all named.
        let text = refused(&scene(), &with_ao(Settings { gbuffer: fat, ..plain }), &four());
        assert!(
            text.ends_with("has 4: choose `--gbuffer lean --ao off`, or `--light-path forward --ao off`"),
            "{text}"
        );
    }

    #[test]
    fn particles_that_the_forward_path_cannot_draw_are_part_of_the_advice() {
        let emits = Scene { emitters: vec![Emitter::default()], ..scene() };
        let (auto, few) = (Settings::default(), |storage_buffers| Capabilities { storage_buffers, ..four() });
        let mirrored = Settings { reflections: Reflections::Screen, ..Settings::default() };
        let mut advices = Vec::new();
        for buffers in (1..=8).rev() {
            if FramePlan::of(&emits, &auto, &few(buffers)).is_ok() {
                continue;
            }
            let text = refused(&emits, &auto, &few(buffers));
            assert!(text.starts_with("particles: a shader names "), "{text}");
            let own = text.split_once("choose ").expect("advice").1.to_owned();
            let text = refused(&emits, &mirrored, &few(buffers));
            let also = text.split_once("reflections need ").and_then(|(_, why)| why.split_once(": choose "));
            advices.push((own, also.expect("advice").1.to_owned()));
        }
        let both = "`--reflections off --transparency oit`, or `--reflections off --particles off`";
        let expected = [
            ("--transparency oit, which takes one less, or --particles off", both),
            ("--particles off", "`--reflections off --particles off`"),
        ];
        advices.dedup();
        assert_eq!(advices, expected.map(|(own, also)| (own.to_owned(), also.to_owned())));
    }
}
