//! A scene as the text of a scene file: its base or model, and everything that can be changed besides its objects.

use std::fmt::Write as _;
use std::path::Path;

use glam::Vec3;
use toml::Value;

use super::super::load::Up;
use super::lights;
use crate::path::lens;
use crate::{Atmosphere, Camera, Environment, Scene, SettingsPatch, Sky, SkyOrigin};

/// The source that a scene was opened from.
#[derive(Debug, Clone, Copy)]
pub enum Origin<'a> {
    /// `builtin:NAME?key=value&…`.
    Builtin(&'a str),
    /// A scene file.
    File(&'a Path),
    /// A bare model.
    Model(Model<'a>),
}

/// A bare model, and the options that it was opened with (see [`OpenOptions`](crate::OpenOptions)).
#[derive(Debug, Clone, Copy)]
pub struct Model<'a> {
    /// The model's file.
    pub path: &'a Path,
    /// Metres of a unit.
    pub scale: f64,
    /// The model's upward axis.
    pub up: Up,
    /// The scene of the file.
    pub scene: Option<&'a str>,
    /// The look of its materials.
    pub variant: Option<&'a str>,
}

/// A file that opens this scene, which was opened from `origin`, as it is now: with its lights, in this light from everywhere, from this camera
/// and with these settings. Paths stay as they are given.
pub fn to_toml(origin: Origin, scene: &Scene, camera: &Camera, settings: &SettingsPatch) -> String {
    let string = |text: &str| Value::String(text.to_owned()).to_string();
    let path = |path: &Path| string(&path.to_string_lossy());
    let mut text = match origin {
        Origin::Builtin(spec) => format!("base = {}\nbase_lights = false\n", string(spec)),
        Origin::File(file) => format!("base = {}\nbase_lights = false\n", path(file)),
        Origin::Model(model) => {
            let turned = if model.up == Up::Z { "rotation = { axis = [1, 0, 0], degrees = -90 }\n" } else { "" };
            let said = |key: &str, name: Option<&str>| {
                name.map_or(String::new(), |name| format!("{key} = {}\n", string(name)))
            };
            let chosen = said("scene", model.scene) + &said("variant", model.variant);
            // All lights stand below.
            let (file, scale) = (path(model.path), model.scale);
            format!("[[models]]\npath = {file}\n{chosen}lights = false\nscale = {scale:?}\n{turned}")
        }
    };
    // No scene has a camera that is shifted: frames that look through a lens have.
    let Camera { position, rotation, projection, near, shift: _ } = camera;
    let (place, turn) = (position.to_array(), rotation.to_array());
    let _ = writeln!(text, "\n# --camera \"{camera}\"\n[camera]\nposition = {place:?}");
    let _ = writeln!(text, "rotation = {{ quaternion = {turn:?} }}\n{}near = {near:?}", lens(projection));
    text += &environment(&scene.environment);
    text += &scene.sky.as_ref().map_or_else(String::new, sky);
    for light in &scene.lights {
        let _ = write!(text, "\n[[lights]]\n{}", lights::to_toml(light));
    }
    let _ = write!(text, "\n{}", settings.to_toml());
    text
}

fn environment(environment: &Environment) -> String {
    let color = |key: &str, color: Vec3| format!("{key} = {:?}\n", color.to_array());
    let Environment { ambient, ground, background } = *environment;
    let from_everywhere = match ground {
        Some(ground) => color("sky", ambient) + &color("ground", ground),
        None => color("ambient", ambient),
    };
    format!("\n[environment]\n{from_everywhere}{}", color("background", background))
}

/// Nothing of one that no file can say: then the base's stays.
fn sky(sky: &Sky) -> String {
    let path = |path: &Path| Value::String(path.to_string_lossy().into_owned()).to_string();
    let of = match &sky.image.origin {
        SkyOrigin::Panorama(file) => format!("file = {}", path(file)),
        SkyOrigin::Faces(files) => format!("faces = [{}]", files.each_ref().map(|file| path(file)).join(", ")),
        SkyOrigin::Atmosphere(air) => {
            let [elevation, azimuth] = air.sun_angles();
            let Atmosphere { haze, ground, altitude, .. } = air;
            format!(
                "atmosphere = {{ elevation_degrees = {elevation:?}, azimuth_degrees = {azimuth:?}, haze = {haze:?}, ground = {ground:?}, \
                 altitude = {altitude:?} }}"
            )
        }
        SkyOrigin::Studio => "studio = true".into(),
        SkyOrigin::Made => return String::new(),
    };
    let Sky { rotation_degrees, nits, lights, .. } = sky;
    format!("\n[sky]\n{of}\nrotation_degrees = {rotation_degrees:?}\nstrength = {nits:?}\nlights = {lights}\n")
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::file::parse;
    use crate::{Falloff, Light, LightKind, OpenOptions, Settings, open};
    use crate::{SkyChoice, put_sky};

    fn lights() -> Vec<Light> {
        let (position, direction) = (DVec3::new(1.0, -2.5, 1e-3), DVec3::new(0.6, -0.8, 0.0));
        let polynomial = Falloff::Polynomial { constant: 1.0, linear: 0.25, quadratic: 3.5 };
        let mut kinds = vec![LightKind::Directional { direction }];
        for (range, falloff) in [
            (None, Falloff::InverseSquare),
            (Some(3.25), Falloff::InverseSquare),
            (Some(7.0), Falloff::Quadratic),
            (None, polynomial),
            (Some(11.0), polynomial),
        ] {
            kinds.push(LightKind::Point { position, range, falloff });
            let (inner_angle_degrees, outer_angle_degrees) = (12.5, 40.0);
            kinds.push(LightKind::Spot {
                position,
                direction,
                inner_angle_degrees,
                outer_angle_degrees,
                range,
                falloff,
            });
            kinds.push(LightKind::Beam { position, direction, radius: 0.75, edge: 0.2, range });
        }
        let light = |(index, kind): (usize, LightKind)| Light {
            name: format!("the \"{index}\"th\n"),
            kind,
            color: Vec3::new(1.0, 0.1, 0.333),
            intensity: 1e3 + index as f32,
            casts_shadow: index % 2 == 0,
            size: 0.25,
        };
        kinds.into_iter().enumerate().map(light).collect()
    }

    #[test]
    fn what_is_written_is_the_scene_that_is_read() {
        let directory = tempfile::tempdir().expect("a folder");
        let model = directory.path().join("a model.obj");
        std::fs::write(&model, "v 0 0 0\nv 1 2 3\nv 0 2 0\nf 1 2 3\n").expect("written");
        let spec = model.to_str().expect("a name");
        let options = OpenOptions { scale: 0.01, up: Up::Z, ..OpenOptions::default() };
        let cases = [
            ("builtin:layers", OpenOptions::default(), Origin::Builtin("builtin:layers")),
            (spec, options, Origin::Model(Model { path: &model, scale: 0.01, up: Up::Z, scene: None, variant: None })),
        ];
        for (spec, options, origin) in cases {
            let mut scene = open(spec, &options).unwrap_or_else(|error| panic!("{error}"));
            scene.lights = lights();
            for ground in [None, Some(Vec3::new(0.0, 0.3, 2e4))] {
                scene.environment = Environment { ambient: Vec3::new(0.1, 2.0, 3e5), ground, background: Vec3::ONE };
                put_sky(&mut scene, &SkyChoice::Atmosphere(Some(Atmosphere::sun_at(12.0, -70.0)))).expect("a sky");
                let camera = Camera {
                    near: 0.07,
                    ..Camera::looking_at(
                        DVec3::new(0.1, 2.0, -3e4),
                        DVec3::new(1.0, 0.0, 7.0),
                        DVec3::new(0.3, 1.0, 0.0),
                    )
                };
                let settings = Settings { fxaa: true, exposure: Some(7.25), samples: 1, ..Settings::default() };
                let text = to_toml(origin, &scene, &camera, &settings.patch());
                let file = directory.path().join("written.toml");
                let read =
                    parse(&text, &file, &OpenOptions::default()).unwrap_or_else(|error| panic!("{error}\n{text}"));
                assert_eq!(read.environment, scene.environment, "{text}");
                let [own, other] = [&read, &scene].map(|scene| scene.sky.clone().expect("a sky"));
                assert_eq!(
                    (own.nits, own.lights, own.rotation_degrees),
                    (other.nits, other.lights, other.rotation_degrees)
                );
                let looked = |sky: &Sky| sky.radiance(DVec3::new(0.6, 0.48, -0.64));
                assert!(looked(&own).distance(looked(&other)) < 1e-3 * looked(&own).length(), "{text}");
                // A rotation is made of length 1 once more, as directions are.
                assert!(read.camera.rotation.angle_between(camera.rotation) < 1e-7, "{text}");
                assert_eq!(Camera { rotation: camera.rotation, ..read.camera }, camera, "{text}");
                assert_eq!(read.settings.decide(), settings, "{text}");
                let (own, other) = (read.bounds(), scene.bounds());
                assert!(
                    own.min.distance(other.min) < 1e-12 && own.max.distance(other.max) < 1e-12,
                    "{own:?} {other:?}"
                );
                assert_eq!(read.lights.len(), scene.lights.len());
                for (read, own) in read.lights.iter().zip(&scene.lights) {
                    assert_eq!(format!("{read:.12?}"), format!("{own:.12?}"), "{text}");
                }
            }
        }
    }
}
