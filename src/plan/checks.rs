//! Settings that do not go together, or not with the device.

use ash::vk;

use super::{Capabilities, FramePlan, Gbuffer, GeometryKey, PlanError, Refusal, TextureSource, TooFew, effects};
use crate::scene::{Camera, LightPath, MSAA, SETTINGS, Scene, Settings, View};

/// The name of all that smooths edges, in refusals.
pub(super) const ANTI_ALIASING: &str = "anti-aliasing";

/// Bytes that a work group of TILED shares with several samples a pixel (`shaders/tiled.wgsl`): lists of lights, and the light of 256 samples.
pub(super) const TILE_SHARED_BYTES: u32 = 8192;

pub(super) fn check_size([width, height]: [u32; 2], device: &Capabilities) -> Result<(), PlanError> {
    match width == 0 || height == 0 || width.max(height) > device.max_extent {
        true => Err(PlanError::Size(width, height, device.max_extent)),
        false => Ok(()),
    }
}

/// The first of the settings whose key begins so that is out of its range, in a sentence.
pub(super) fn out_of_range(settings: &Settings, prefix: &str) -> Option<String> {
    let said = settings.patch();
    SETTINGS.iter().filter(|setting| setting.key.starts_with(prefix)).find_map(|setting| {
        let text = setting.text(&said)?;
        setting.read(&text).err().map(|why| format!("{} is {text}: it {why}", setting.title))
    })
}

/// `locations` are the colour locations of GEOMETRY.
pub(super) fn check_attachments(
    locations: u32,
    gbuffer: Option<&Gbuffer>,
    msaa: u32,
    device: &Capabilities,
) -> Result<(), PlanError> {
    if locations > device.max_color_attachments {
        return Err(PlanError::ColorAttachments(TooFew::new(locations, device.max_color_attachments)));
    }
    // Depth or position, and the other targets; with several samples depth in any case.
    let depth = |gbuffer: &Gbuffer| gbuffer.position.is_none() || msaa > 1;
    let read = gbuffer.map_or(0, |gbuffer| gbuffer.formats().count() as u32 + u32::from(depth(gbuffer)));
    if read > device.max_input_attachments {
        return Err(PlanError::InputAttachments(TooFew::new(read, device.max_input_attachments)));
    }
    Ok(())
}

/// Refuses textures that have to be decoded where the library cannot decode them.
pub(super) fn check_blocks(scene: &Scene, plan: &FramePlan) -> Result<(), PlanError> {
    let of_effects = plan.effects.present().flat_map(|effect| (effect.textures)(&plan.effects));
    let undecodable = plan.textures.images.iter().chain(of_effects).find_map(|image| match image.source {
        TextureSource::Scene(index) if image.blocks.is_none() => {
            let texture = scene.textures.get(index).filter(|texture| !texture.is_readable())?;
            Some(PlanError::Blocks(texture.name.clone(), image.compressed?))
        }
        _ => None,
    });
    undecodable.map_or(Ok(()), Err)
}

/// Refuses surfaces whose pipelines name more images than a shader can: textures of the material, images of the sky and its light, and two of shadow
/// maps if surfaces are lit as they are drawn.
pub(super) fn check_sampled_images(plan: &FramePlan, device: &Capabilities) -> Result<(), PlanError> {
    let sky = plan.effects.sky.map_or(0, |own| u32::from(own.shown) + 3 * u32::from(own.lights));
    let images = |key: &GeometryKey| {
        let textures = key.textures.slots().count() as u32;
        let maps = if plan.shadow.is_some() && key.forward.is_some() { 2 } else { 0 };
        (textures + sky + maps, textures)
    };
    let most = device.sampled_images;
    let worst = plan.keys().chain(&plan.lobes).map(images).max().filter(|&(needed, _)| needed > most);
    let Some((needed, textures)) = worst else { return Ok(()) };
    let why = format!(
        "the {textures} textures of a material, the sky and shadow maps are {needed} images in one shader, and this device's name at most {most}: leave out --sky, or ask for --light-path loop or --shadows off"
    );
    Err(Refusal::of("surfaces", why))
}

/// Anti-aliasing and effects work on pictures, and views show values.
pub(super) fn check_antialiasing(settings: &Settings, lit: bool) -> Result<(), PlanError> {
    let refuse = |why: String| Err(Refusal::of(ANTI_ALIASING, why));
    let view = settings.view;
    if settings.samples == 0 {
        return refuse("a picture of 0 samples has no light: samples must be at least 1".into());
    }
    if settings.samples > 1 && !lit {
        return refuse(format!("the view {view} shows values that have no mean: draw it with 1 sample"));
    }
    let Some(effect) = settings.first_effect() else { return Ok(()) };
    if !lit {
        return refuse(format!("{effect} would change the values that the view {view} shows: draw it without"));
    }
    if settings.output.is_linear() {
        return refuse(format!(
            "{effect} works on a tone-mapped picture, and a linear one (.exr) is not: draw it without"
        ));
    }
    if settings.samples > 1 {
        return refuse(format!("{effect} needs --samples 1: samples are averaged after it"));
    }
    Ok(())
}

/// Refuses multisampling with integer G-buffer formats and with light paths that add lights draw by draw, as these shade one sample a pixel.
pub(super) fn check_msaa(
    settings: &Settings,
    gbuffer: Option<&Gbuffer>,
    light_path: LightPath,
    device: &Capabilities,
) -> Result<(), PlanError> {
    let refuse = |why: String| Err(Refusal::of(ANTI_ALIASING, why));
    let (msaa, view) = (settings.msaa, settings.view);
    if msaa == 1 {
        return match view {
            View::Complexity => {
                refuse("the view complexity shows where samples of a pixel differ: ask for several, as --msaa 4".into())
            }
            _ => Ok(()),
        };
    }
    if !msaa.is_power_of_two() || device.msaa & msaa == 0 {
        let counts = MSAA.into_iter().filter(|count| device.msaa & count != 0).map(|count| count.to_string());
        let counts = counts.collect::<Vec<_>>().join(", ");
        return refuse(format!("this device cannot draw {msaa} samples a pixel; it can draw {counts}"));
    }
    if !effects::averages_samples(view) && view != View::Complexity {
        return refuse(format!("the view {view} shows the values of one sample: draw it without multisampling"));
    }
    if settings.samples > 1 {
        let samples = settings.samples;
        return refuse(format!("{samples} jittered frames smooth what multisampling would: choose one of them"));
    }
    if gbuffer.is_some_and(|gbuffer| gbuffer.normal == vk::Format::R16G16_UINT) {
        return refuse(
            "normals in integers are not multisampled: choose another format, as --gbuffer lean,normal=rgb10a2".into(),
        );
    }
    let others = "choose loop, clustered or forward";
    match light_path {
        LightPath::PerLight | LightPath::Volumes => {
            refuse(format!("the light path {light_path} shades one sample a pixel: {others}"))
        }
        LightPath::Compute if device.sampled_msaa & msaa == 0 => refuse(format!(
            "the light path compute reads {msaa} samples a pixel as textures, and this device has no such textures of every format: {others}"
        )),
        LightPath::Visibility if device.numbered_msaa & msaa == 0 => refuse(format!(
            "the light path visibility reads {msaa} samples a pixel as textures, and this device has no such textures of integers: {others}"
        )),
        LightPath::Compute | LightPath::Visibility if device.shared_memory < TILE_SHARED_BYTES => refuse(format!(
            "the light path {light_path} shares {TILE_SHARED_BYTES} bytes among the invocations of a work group, and this device has {}: {others}",
            device.shared_memory
        )),
        _ => Ok(()),
    }
}

impl FramePlan {
    /// Refuses a camera of another kind than the one that the plan was made for.
    ///
    /// # Errors
    /// When its projection is of the other kind, or one of its numbers is out of range.
    pub fn check_camera(&self, camera: &Camera) -> Result<(), PlanError> {
        if let Some(fault) = camera.fault() {
            return Err(PlanError::Change(format!("the camera: {fault}")));
        }
        if camera.is_orthographic() == self.orthographic {
            return Ok(());
        }
        let [own, planned] = [camera.is_orthographic(), self.orthographic].map(|parallel| match parallel {
            true => "orthographic",
            false => "perspective",
        });
        Err(PlanError::Change(format!("this camera is {own}, and the frames are planned for a {planned} one")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::samples;

    #[test]
    fn a_device_whose_shaders_name_few_images_draws_as_many_as_that() {
        let scenes = samples::scenes();
        let (_, scene) = scenes.iter().find(|(name, _)| *name == "shadowed-lamps").expect("a sample");
        let on = |sampled_images: u32, light_path: LightPath| {
            let settings = Settings { light_path, ..Settings::default() };
            FramePlan::of(scene, &settings, &Capabilities { sampled_images, ..samples::device() })
        };
        let textures =
            on(16, LightPath::Loop).expect("a plan").textures.sets.values().map(|own| own.len() as u32).max();
        let textures = textures.expect("a textured material");
        assert!(textures > 0 && on(textures, LightPath::Loop).is_ok());
        let refused = on(textures - 1, LightPath::Loop).expect_err("too few").to_string();
        assert!(
            refused.contains(&format!("at most {}", textures - 1)) && refused.contains("--shadows off"),
            "{refused}"
        );
        // Lit as they are drawn they name shadow maps, too.
        assert!(on(textures + 1, LightPath::Forward).is_err() && on(textures + 2, LightPath::Forward).is_ok());
    }
}
