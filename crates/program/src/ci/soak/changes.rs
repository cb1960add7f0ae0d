//! Changes the scene of a soak: each time one of settings, lights, objects and the camera, at random.

use afterlight::frame::{self, Changed, Renderer};
use afterlight::gpu;
use afterlight::scene::{
    Camera, GbufferPreset, OptionalPart, Pose, SETTINGS, Scene, Setting, Settings, TARGETS, ValueKind, counted,
};
use fastrand::Rng;
use glam::{DAffine3, DQuat, DVec3, Vec3};

use super::super::examine::{Abort, CaseSetup};

/// Most settings changed at once.
const MOST_SETTINGS: u32 = 3;
/// Edges of pictures, at most.
const MOST_EDGE: u32 = 128;

/// The scene as it has become, and how it came to be.
pub struct SoakScene<'a> {
    home: &'a CaseSetup,
    scene: Scene,
    settings: Settings,
    pub camera: Camera,
    pose: Pose,
    made: u32,
    of_settings: u32,
    refused: u32,
    slow: u32,
}

impl<'a> SoakScene<'a> {
    pub fn of(home: &'a CaseSetup) -> Self {
        let (scene, settings, camera) = (home.scene.clone(), home.settings.clone(), home.scene.camera);
        Self { home, scene, settings, camera, pose: Pose::default(), made: 0, of_settings: 0, refused: 0, slow: 0 }
    }

    /// Returns the number of changes of each kind, in words.
    pub fn summary_line(&self) -> String {
        let Self { made, of_settings, refused, slow, .. } = self;
        format!(
            "{}, {of_settings} of settings; {refused} refused by the plan, and {slow} left as too slow",
            counted(*made, "change")
        )
    }

    /// Brings everything back to where it began.
    pub fn go_home(&mut self, renderer: &mut Renderer) -> Result<(), Abort> {
        self.scene.objects.clone_from(&self.home.scene.objects);
        self.scene.lights.clone_from(&self.home.scene.lights);
        self.settings.clone_from(&self.home.settings);
        self.camera = self.home.scene.camera;
        Ok(renderer.change_settings(&self.scene, &self.settings)?)
    }

    /// Goes home and counts the scene as too slow.
    pub fn leave(&mut self, renderer: &mut Renderer) -> Result<(), Abort> {
        self.slow += 1;
        self.go_home(renderer)
    }

    /// Changes something. If the plan refuses it, everything goes home.
    pub fn change(&mut self, renderer: &mut Renderer, random: &mut Rng) -> Result<(), Abort> {
        self.made += 1;
        let changed = match random.u32(0..16) {
            0 | 1 => self.settings(renderer, random),
            2 => self.arrangement(renderer, random),
            3..=5 => self.light(renderer, random),
            6..=9 => self.object(renderer, random),
            10 if self.scene.moves() => self.moment(renderer, random),
            _ => {
                self.look_elsewhere(random);
                Ok(())
            }
        };
        match changed {
            Err(
                frame::Error::Plan(_) | frame::Error::Gpu(gpu::Error::Unsupported(_) | gpu::Error::TooLarge { .. }),
            ) => {
                self.refused += 1;
                self.go_home(renderer)
            }
            changed => Ok(changed?),
        }
    }

    /// Somewhere in the scene.
    fn place(&self, random: &mut Rng) -> DVec3 {
        let eye = self.home.scene.camera.position;
        let anchors = [eye].into_iter().chain(self.home.scene.objects.iter().map(|own| own.transform.translation));
        let anchors: Vec<DVec3> = anchors.collect();
        let (one, other) = (anchors[random.usize(..anchors.len())], anchors[random.usize(..anchors.len())]);
        one.lerp(other, random.f64()) + direction(random)
    }

    fn settings(&mut self, renderer: &mut Renderer, random: &mut Rng) -> Result<(), frame::Error> {
        self.of_settings += 1;
        let mut patch = self.home.settings.patch();
        for _ in 0..random.u32(1..=MOST_SETTINGS) {
            let setting = &SETTINGS[random.usize(..SETTINGS.len())];
            let text = value(setting, random);
            // All values are of the kind that the row says.
            setting
                .set(&mut patch, Some(&text))
                .map_err(|why| gpu::Error::Misuse(format!("{}={text} {why}", setting.key)))?;
        }
        let settings = Settings { output: self.home.settings.output, ..patch.decide() };
        renderer.change_settings(&self.scene, &settings)?;
        self.settings = settings;
        Ok(())
    }

    /// Adds or removes a light or an object. Clips address objects and lights by index, so the original ones are never removed.
    fn arrangement(&mut self, renderer: &mut Renderer, random: &mut Rng) -> Result<(), frame::Error> {
        let place = self.place(random);
        let first = |count: usize| if self.home.scene.moves() { count } else { 0 };
        let kept = [first(self.home.scene.objects.len()), first(self.home.scene.lights.len())];
        let Scene { objects, lights, .. } = &mut self.scene;
        match random.u32(0..4) {
            0 if !objects.is_empty() => {
                let mut copy = objects[random.usize(..objects.len())].clone();
                (copy.node, copy.skin, copy.transform.translation) = (None, None, place);
                objects.push(copy);
            }
            1 if !lights.is_empty() => {
                let mut copy = lights[random.usize(..lights.len())].clone();
                if let Some(own) = copy.kind.place_mut() {
                    *own = place;
                }
                lights.push(copy);
            }
            2 if objects.len() > kept[0] => _ = objects.remove(random.usize(kept[0]..objects.len())),
            3 if lights.len() > kept[1] => _ = lights.remove(random.usize(kept[1]..lights.len())),
            _ => {}
        }
        renderer.update(&self.scene, Changed::Arrangement)
    }

    /// Moves a light, gives it another colour, or switches it off or on.
    fn light(&mut self, renderer: &mut Renderer, random: &mut Rng) -> Result<(), frame::Error> {
        if self.scene.lights.is_empty() {
            return Ok(());
        }
        let (index, place) = (random.usize(..self.scene.lights.len()), self.place(random));
        let mut light = self.scene.lights[index].clone();
        match random.u32(0..8) {
            0 => light.intensity = if light.intensity > 0.0 { 0.0 } else { 1000.0 },
            1..=3 => light.color = Vec3::new(random.f32(), random.f32(), random.f32()),
            _ => {
                if let Some(own) = light.kind.place_mut() {
                    *own = place;
                }
                if let Some(own) = light.kind.direction_mut() {
                    *own = direction(random);
                }
            }
        }
        renderer.set_light(&mut self.scene, index, &light)
    }

    /// Moves and turns an object, or moves it so far away that it is out of sight.
    fn object(&mut self, renderer: &mut Renderer, random: &mut Rng) -> Result<(), frame::Error> {
        if self.scene.objects.is_empty() {
            return Ok(());
        }
        let index = random.usize(..self.scene.objects.len());
        let distance = if random.u32(0..4) == 0 { 1e4 } else { 0.2 };
        let turn = DQuat::from_rotation_y(random.f64() - 0.5);
        let before = self.scene.objects[index].transform;
        let moved = DAffine3::from_translation(direction(random) * distance) * before * DAffine3::from_quat(turn);
        renderer.move_object(&mut self.scene, index, &moved)
    }

    /// Shows another moment of the clips.
    fn moment(&mut self, renderer: &mut Renderer, random: &mut Rng) -> Result<(), frame::Error> {
        self.scene.motion.pose_into(&self.home.playing.with_time(random.f64() * 10.0), &mut self.pose);
        renderer.pose(&self.scene, &self.pose)
    }

    fn look_elsewhere(&mut self, random: &mut Rng) {
        let home = &self.home.scene.camera;
        self.camera.position = home.position + direction(random);
        self.camera.rotation = DQuat::from_rotation_y(random.f64() - 0.5) * home.rotation;
    }
}

/// A unit vector.
fn direction(random: &mut Rng) -> DVec3 {
    let [x, y, z] = [(); 3].map(|()| random.f64() - 0.5);
    DVec3::new(x, y, z).normalize_or(DVec3::NEG_Y)
}

fn one_of<'a>(texts: &[&'a str], random: &mut Rng) -> &'a str {
    texts[random.usize(..texts.len())]
}

/// A value that the setting may have, as text. Numbers stay near their defaults. Only the lower half of a setting's `tried` values is drawn: the
/// others take most of the time and of the memory.
fn value(setting: &Setting, random: &mut Rng) -> String {
    if !setting.tried.is_empty() {
        return one_of(&setting.tried[..setting.tried.len().div_ceil(2)], random).to_owned();
    }
    match setting.values {
        ValueKind::OnOff | ValueKind::Names(_) | ValueKind::Among(_) => {
            let all = setting.values.all();
            all[random.usize(..all.len())].clone()
        }
        ValueKind::Whole(from, to) => random.u32(from..=to.min(from.saturating_add(256))).to_string(),
        ValueKind::Number(from, to) => {
            let near =
                setting.default().parse::<f32>().map_or(8.0, |default| if default == 0.0 { 1.0 } else { default });
            (2.0 * random.f32() * near).clamp(from, to).to_string()
        }
        ValueKind::Size => format!("{}x{}", random.u32(1..=MOST_EDGE), random.u32(1..=MOST_EDGE)),
        ValueKind::Grid([across, down, deep], _) => {
            let edge = |most: u32, random: &mut Rng| random.u32(1..=most.min(16));
            format!("{}x{}x{}", edge(across, random), edge(down, random), edge(deep, random))
        }
        ValueKind::Aperture => (0.1 * random.f32()).to_string(),
        ValueKind::Layout if random.bool() => {
            GbufferPreset::NAMES[random.usize(..GbufferPreset::NAMES.len())].0.to_owned()
        }
        ValueKind::Layout => {
            let (target, formats) = &TARGETS[random.usize(..TARGETS.len())];
            format!("{target}={}", formats[random.usize(..formats.len())])
        }
        ValueKind::Parts => {
            let names: Vec<&str> = OptionalPart::NAMES.iter().map(|(name, _)| *name).collect();
            one_of(&names, random).to_owned()
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_setting_gets_several_values_that_it_may_have() {
        let mut random = Rng::with_seed(1);
        for setting in SETTINGS {
            let values: BTreeSet<String> = (0..100).map(|_| value(setting, &mut random)).collect();
            assert!(values.len() > 1, "{}: {values:?}", setting.key);
            for text in &values {
                assert!(setting.read(text).is_ok(), "{}={text}", setting.key);
            }
        }
    }
}
