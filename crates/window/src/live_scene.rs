//! The scene of a window, with the user's changes.

use super::controls::PanelValues;
use super::player::Player;
use afterlight::scene::{Aabb, Camera, Light, Output, Projection, Scene, Settings, View, metered_ev100};

/// The scene that is drawn, of which a user may change more than the camera.
pub struct LiveScene {
    pub scene: Scene,
    pub settings: Settings,
    /// The playback of its clips.
    pub player: Player,
    /// Roughness of each material as it was read.
    own_roughness: Vec<f32>,
    /// Bounds of the scene while no clip plays.
    bounds: Aabb,
    /// EV100.
    pub(super) exposure: f32,
    roughness: Option<f32>,
    /// The scene's own settings as they were read.
    own: Own,
}

/// The scene's own settings, before any change on the panels.
#[derive(Debug, Clone, PartialEq)]
struct Own {
    settings: Settings,
    exposure: f32,
    lights: Vec<Light>,
    camera: Camera,
}

impl LiveScene {
    pub fn new(scene: Scene, settings: Settings) -> Self {
        let own_roughness = scene.materials.iter().map(|material| material.roughness).collect();
        // It does not follow lights that are changed later.
        let exposure = settings.exposure.unwrap_or_else(|| metered_ev100(&scene));
        let own = Own { settings: settings.clone(), exposure, lights: scene.lights.clone(), camera: scene.camera };
        Self {
            bounds: scene.model_bounds(),
            player: Player::default(),
            scene,
            settings: Settings { exposure: Some(exposure), ..settings },
            own_roughness,
            exposure,
            roughness: None,
            own,
        }
    }

    /// Returns the same scene read again: a change on the panels stays, unless the files now have another value in its place.
    pub(super) fn renewed(&self, scene: Scene, settings: Settings) -> Self {
        let player = self.player.renewed(&scene.motion);
        let mut new = Self { player, ..Self::new(scene, settings) };
        if new.own.settings == self.own.settings {
            new.settings = self.settings.clone();
        }
        new.settings.view = self.settings.view;
        if new.own.exposure == self.own.exposure {
            new.exposure = self.exposure;
        }
        new.settings.exposure = Some(new.exposure);
        if new.own.lights == self.own.lights {
            new.scene.lights.clone_from(&self.scene.lights);
        }
        new.set_roughness(self.roughness);
        new
    }

    /// Lets plans be made for a camera as near as this one: textures have no finer levels than a plan's camera sees. One that zooms in is expected to
    /// come nearer still.
    pub(super) fn come_near(&mut self, camera: &Camera) {
        let planned = &mut self.scene.camera.projection;
        match (camera.projection, *planned) {
            (Projection::Orthographic { height: own }, Projection::Orthographic { height }) if own < height => {
                *planned = Projection::orthographic(own * 0.25);
            }
            _ => {}
        }
    }

    /// The camera that the scene came with.
    pub(super) fn own_camera(&self) -> &Camera {
        &self.own.camera
    }

    /// As they are: no light is changed.
    pub(super) fn values(&self) -> PanelValues {
        PanelValues {
            settings: self.settings.clone(),
            exposure: self.exposure,
            lights: Vec::new(),
            roughness: self.roughness,
        }
    }

    pub(super) fn set(&mut self, values: PanelValues, lights: Vec<Light>) {
        (self.settings, self.exposure, self.scene.lights) = (values.settings, values.exposure, lights);
        self.set_roughness(values.roughness);
    }

    /// The scene as it is at the moment that is shown.
    pub(super) fn still(&self) -> Scene {
        self.scene.at(&self.player.playing).into_owned()
    }

    /// The box around all objects.
    pub(super) fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Returns true if materials are not as rough as they came.
    pub(super) fn has_other_roughness(&self) -> bool {
        self.roughness.is_some()
    }

    pub(super) fn set_roughness(&mut self, roughness: Option<f32>) {
        self.roughness = roughness;
        for (material, own) in self.scene.materials.iter_mut().zip(&self.own_roughness) {
            material.roughness = roughness.unwrap_or(*own);
        }
    }

    /// Returns the settings for a picture of this size whose light is in nits. FXAA is off, as it smooths tone-mapped colours only.
    pub fn in_nits(&self, size: [u32; 2]) -> Settings {
        Settings { size, output: Output::Nits, ..self.settings.without_effects() }
    }

    /// Returns the settings with the next view, or the previous one.
    pub(super) fn turned(&self, back: bool) -> Settings {
        let views = View::NAMES;
        let now = views.iter().position(|&(_, view)| view == self.settings.view).unwrap_or(0);
        let next = (now + if back { views.len() - 1 } else { 1 }) % views.len();
        Settings { view: views[next].1, ..self.settings.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight::scene::{LightPath, OpenOptions, open};

    #[test]
    fn what_was_changed_stays_until_the_files_say_something_else_of_it() {
        let scene = open("builtin:spheres", &OpenOptions::default()).expect("is built in");
        let mut changed = LiveScene::new(scene.clone(), Settings::default());
        changed.settings = Settings { fxaa: true, view: View::Depth, ..changed.settings.clone() };
        changed.exposure += 2.0;
        changed.scene.lights[0].intensity *= 3.0;
        changed.set_roughness(Some(0.25));

        let same = changed.renewed(scene.clone(), Settings::default());
        assert_eq!(
            (same.values(), &same.scene.lights),
            (
                PanelValues {
                    settings: Settings { exposure: Some(changed.exposure), ..changed.settings.clone() },
                    ..changed.values()
                },
                &changed.scene.lights
            )
        );
        assert!(same.scene.materials.iter().all(|material| material.roughness == 0.25));

        let mut other = scene.clone();
        other.lights[0].intensity *= 100.0;
        let settings = Settings { light_path: LightPath::Compute, ..Settings::default() };
        let new = changed.renewed(other.clone(), settings);
        assert_eq!(new.scene.lights, other.lights);
        assert_eq!(
            (new.settings.light_path, new.settings.fxaa, new.settings.view),
            (LightPath::Compute, false, View::Depth)
        );
        assert_eq!(new.exposure, metered_ev100(&other), "metered anew, as its lights are others");
        assert!(new.exposure > changed.own.exposure + 1.0);
    }
}
