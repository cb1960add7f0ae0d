//! The light of a bare model.

use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;

use super::{CameraPlace, add_daylight, add_studio, add_studio_beside_lights, fit_exposure, meter};
use crate::sky::{Sky, read_panorama};
use crate::{Error, Scene};

/// Light for a bare model, as a command line asks for it. Needs the feature `readers`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LightChoice {
    /// A photographer's studio alone.
    Studio,
    /// Sun and sky light alone.
    Sun,
    /// The lights of the file.
    File,
    /// The lights of the file, and as much light of the studio.
    Both,
    /// An equirectangular picture alone.
    Picture(PathBuf),
}

impl LightChoice {
    /// Returns true if the file's lights stay.
    pub fn keeps_lights(&self) -> bool {
        matches!(self, Self::File | Self::Both)
    }
}

impl FromStr for LightChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Ok(match text {
            "studio" => Self::Studio,
            "sun" => Self::Sun,
            "file" => Self::File,
            "both" => Self::Both,
            _ => {
                let path = PathBuf::from(text);
                let is_picture = path
                    .extension()
                    .is_some_and(|own| ["hdr", "exr", "pic"].iter().any(|end| own.eq_ignore_ascii_case(end)));
                if !is_picture {
                    return Err("expected studio, sun, file, both, or a picture of surroundings (.hdr, .exr)".into());
                }
                Self::Picture(path)
            }
        })
    }
}

/// Lights a bare model that has a camera. Without a choice a model keeps its lights; one that has none stands in a studio, or, seen from inside, in the sun.
///
/// # Errors
/// [`Error::Read`] for a picture that cannot be read, [`Error::Setting`] for lights of a file that has none.
pub fn light_model(scene: &mut Scene, choice: Option<&LightChoice>, stand: CameraPlace) -> Result<(), Error> {
    let has_own = !scene.lights.is_empty() || scene.environment.is_lit();
    // A file with a camera is a picture that somebody has lit.
    let fitted = match (has_own, stand) {
        (true, CameraPlace::Outside) if scene.fitted.camera => &LightChoice::Both,
        (true, _) => &LightChoice::File,
        (false, CameraPlace::Outside) if !scene.model_bounds().is_empty() => &LightChoice::Studio,
        (false, _) => &LightChoice::Sun,
    };
    let choice = choice.unwrap_or(fitted);
    if choice.keeps_lights() && !has_own {
        let name = &scene.name;
        return Err(Error::Setting(format!(
            "--light: {name} has no light of its own; expected studio, sun or a picture (.hdr, .exr)"
        )));
    }
    match choice {
        LightChoice::Studio => add_studio(scene),
        LightChoice::Sun => {
            add_daylight(scene);
            fit_exposure(scene, stand);
        }
        LightChoice::File => meter(scene),
        LightChoice::Both => add_studio_beside_lights(scene),
        LightChoice::Picture(path) => {
            let image = Arc::new(read_panorama(path, &mut scene.warnings)?);
            scene.files.push(path.clone());
            scene.sky = Some(Sky { image, rotation_degrees: 0.0, nits: 1.0, lights: true, shown: true, sun: None });
            scene.fitted.light = true;
            meter(scene);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin::shapes;
    use crate::sky::Studio;
    use crate::{
        Brdf, Light, LightKind, Material, Object, SkyChoice, SkyImage, SkyOrigin, drop_fitted_light, exposure_scale,
        fit_camera, put_sky,
    };
    use glam::{DAffine3, DVec3, Vec3};

    /// A cube before its fitted camera, with these lights.
    fn cube(lights: Vec<Light>) -> (Scene, CameraPlace) {
        let mut scene = Scene {
            name: "cube".into(),
            meshes: vec![shapes::cuboid([1.0; 3]).finish("cube")],
            materials: vec![Material::default()],
            objects: vec![Object::new("cube", 0, 0, DAffine3::IDENTITY)],
            lights,
            ..Scene::default()
        };
        let stand = fit_camera(&mut scene, 1.5);
        (scene, stand)
    }

    fn lamp(candela: f32) -> Light {
        let kind = LightKind::Point { position: DVec3::new(0.0, 0.0, 2.0), range: None, falloff: Default::default() };
        Light { intensity: candela, ..Light::of(kind) }
    }

    fn lit(lights: Vec<Light>, choice: Option<&str>) -> Result<Scene, Error> {
        let (mut scene, stand) = cube(lights);
        let choice: Option<LightChoice> = choice.map(|text| text.parse().expect("a choice"));
        light_model(&mut scene, choice.as_ref(), stand).map(|()| scene)
    }

    #[test]
    fn words_and_pictures_are_choices_and_nothing_else() {
        assert_eq!("studio".parse(), Ok(LightChoice::Studio));
        assert_eq!("a/b.HDR".parse(), Ok(LightChoice::Picture("a/b.HDR".into())));
        for text in ["", "Studio ", "a.png", "hdr"] {
            assert!(text.parse::<LightChoice>().is_err(), "{text}");
        }
    }

    #[test]
    fn a_model_without_light_stands_in_a_studio_whose_ground_sends_the_background() {
        let scene = lit(Vec::new(), None).expect("lit");
        let ground = &scene.objects[scene.fitted.ground.expect("a ground")];
        let material = &scene.materials[ground.material];
        let Studio { ground_white, .. } = *Studio::get();
        assert_eq!(material.brdf, Brdf::Lambert);
        let sent = f64::from(material.base_color.x) * ground_white;
        assert!((sent - f64::from(scene.environment.background.x)).abs() < 1e-6, "{sent}");
        assert!(scene.fitted.light && scene.fitted.exposure && scene.check().is_ok());
        let scale = exposure_scale(scene.settings.exposure.expect("an exposure"));
        assert!((scale - 1.0).abs() < 1e-5, "{scale}");
        // The model's box is its own.
        assert!(scene.model_bounds().size().distance(DVec3::ONE) < 1e-9 && scene.bounds().size().x > 4.0);
    }

    #[test]
    fn a_file_s_lamp_stays_is_exposed_for_and_can_be_left_out() {
        for candela in [1e-3, 1.0, 1e6] {
            let own = lit(vec![lamp(candela)], Some("file")).expect("lit");
            let (lux, ev100) = (f64::from(candela) / 4.0, own.settings.exposure.expect("an exposure"));
            // The camera stands beside the lamp, and sees from a quarter to two thirds of its light.
            let seen = 2.5 * f64::from(ev100 + 0.882).exp2() / lux;
            assert!((0.25..0.67).contains(&seen), "{candela}: {seen}");
            assert!(own.sky.is_none() && own.lights.len() == 1 && !own.fitted.light);
            // Beside a studio both count for as much.
            let both = lit(vec![lamp(candela)], None).expect("lit");
            let more = both.settings.exposure.expect("an exposure") - ev100;
            assert!((0.5..1.5).contains(&more), "{candela}: {more}");
            assert!(both.lights.len() == 2 && both.sky.is_some() && both.fitted.ground.is_some());
        }
        let error = lit(Vec::new(), Some("file")).expect_err("no light");
        assert!(error.to_string().contains("no light of its own"), "{error}");
    }

    #[test]
    fn another_sky_takes_the_place_of_a_studio_and_lights_of_the_file_stay() {
        for (lights, left) in [(Vec::new(), 1), (vec![lamp(3.0)], 1)] {
            let mut scene = lit(lights, None).expect("lit");
            scene.fitted.is_bare = true;
            put_sky(&mut scene, &SkyChoice::Atmosphere(None)).expect("a sky");
            assert!(scene.fitted.ground.is_none() && scene.objects.len() == 1 && scene.materials.len() == 1);
            assert!(matches!(scene.sky.as_ref().expect("a sky").image.origin, SkyOrigin::Atmosphere(_)));
            assert_eq!((scene.lights.len(), scene.settings.ao), (left, None));
            assert!(scene.fitted.exposure && scene.settings.exposure.is_some());
        }
        let mut scene = lit(Vec::new(), None).expect("lit");
        put_sky(&mut scene, &SkyChoice::Nothing).expect("no sky");
        assert!(scene.fitted.ground.is_none() && scene.objects.len() == 1 && scene.sky.is_none());
        // Sixteen times the light of a bare model's sky is exposed for a sixteenth as long.
        let mut scene = lit(Vec::new(), None).expect("lit");
        scene.fitted.is_bare = true;
        put_sky(&mut scene, &SkyChoice::Atmosphere(None)).expect("a sky");
        scene.lights.clear();
        crate::fit_to_light(&mut scene);
        let before = scene.settings.exposure.expect("an exposure");
        scene.sky.as_mut().expect("a sky").nits *= 16.0;
        crate::fit_to_light(&mut scene);
        assert!((scene.settings.exposure.expect("an exposure") - before - 4.0).abs() < 1e-3);
        // A sky that changes nothing beside a lamp is told.
        for (candela, warnings) in [(1.0, 0), (1e9, 1)] {
            let mut scene = lit(vec![lamp(candela)], None).expect("lit");
            scene.fitted.is_bare = true;
            put_sky(&mut scene, &SkyChoice::Atmosphere(None)).expect("a sky");
            assert_eq!(scene.warnings.len(), warnings, "{candela}: {:?}", scene.warnings);
        }
        let mut scene = lit(Vec::new(), None).expect("lit");
        assert!(drop_fitted_light(&mut scene) && scene.lights.is_empty() && scene.sky.is_none());
        assert!(!drop_fitted_light(&mut scene));
    }

    #[test]
    fn light_from_behind_counts_for_little() {
        let sky = |toward: DVec3| {
            let (mut scene, _) = cube(Vec::new());
            let viewer = scene.camera.position.normalize();
            let image =
                SkyImage::of("it", 64, |to| DVec3::splat(if to.dot(toward * viewer) > 0.9 { 100.0 } else { 1e-3 }));
            scene.sky = Some(Sky {
                image: image.into(),
                rotation_degrees: 0.0,
                nits: 1.0,
                lights: true,
                shown: true,
                sun: None,
            });
            crate::seen_ev100(&scene)
        };
        let [ahead, behind] = [DVec3::ONE, DVec3::NEG_ONE].map(sky);
        assert!(ahead > behind + 3.0, "{ahead} {behind}");
        let mut even = cube(Vec::new()).0;
        even.environment.ambient = Vec3::splat(7.0);
        assert!((crate::seen_ev100(&even) - crate::metered_ev100(&even)).abs() < 1e-6);
    }
}
