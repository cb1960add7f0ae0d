//! Skies of scene files: pictures and their faults, cubes, atmospheres.

use afterlight::scene::{LightKind, OpenOptions, Scene, SkyOrigin, Up, file, open};
use glam::DVec3;
use image::{ImageBuffer, Rgb, Rgb32FImage};
use tempfile::TempDir;

use super::read;

/// Every key: an atmosphere, and in its place a picture or the faces of a cube.
pub const SKIES: &str = "\
[sky]
atmosphere = { elevation_degrees = 30, azimuth_degrees = 90, sun = true, haze = 2, ground = 0.1, altitude = 100 }
rotation_degrees = 0
strength = 10000
lights = true
---
[sky]
file = 'sky.exr'
---
[sky]
studio = true
---
[sky]
faces = ['0.exr', '1.exr', '2.exr', '3.exr', '4.exr', '5.exr']
";

fn picture(folder: &TempDir, name: &str, size: [u32; 2], value: impl Fn(u32, u32) -> [f32; 3]) {
    let picture: Rgb32FImage = ImageBuffer::from_fn(size[0], size[1], |x, y| Rgb(value(x, y)));
    picture.save(folder.path().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
}

#[test]
fn panoramas_are_read_from_exr_and_hdr() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["sky.exr", "sky.hdr"] {
        // Brighter to the right, which is +X in the middle of the right half.
        picture(&folder, name, [8, 4], |x, _| if x >= 4 { [4.0, 2.0, 1.0] } else { [0.5; 3] });
        let scene =
            read(&folder, &format!("[sky]\nfile = '{name}'\nstrength = 10\nrotation_degrees = 90\nlights = false"))
                .unwrap();
        let sky = scene.sky.expect("a sky");
        assert!(!sky.lights && sky.image.origin == SkyOrigin::Panorama(folder.path().join(name)));
        assert_eq!(scene.files, [folder.path().join(name)]);
        // Turned by a quarter, the light at +X lies at -Z.
        assert!(
            (sky.radiance(DVec3::NEG_Z) - DVec3::new(40.0, 20.0, 10.0)).length() < 0.2,
            "{}",
            sky.radiance(DVec3::NEG_Z)
        );
    }
}

#[test]
fn the_faces_of_a_cube_lie_where_vulkan_has_them() {
    let folder = tempfile::tempdir().unwrap();
    let colors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 0.0], [0.0, 1.0, 1.0], [1.0, 0.0, 1.0]];
    for (index, color) in colors.into_iter().enumerate() {
        picture(&folder, &format!("{index}.exr"), [16, 16], |_, _| color);
    }
    let text = SKIES.split("---").last().unwrap();
    let scene = read(&folder, text).unwrap();
    let sky = scene.sky.expect("a sky");
    let directions = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    for (direction, color) in directions.into_iter().zip(colors) {
        let found = sky.radiance((direction + DVec3::new(0.1, 0.07, 0.12)).normalize());
        assert!((found - DVec3::from(color.map(f64::from))).length() < 1e-6, "{direction}: {found}");
    }
    let wrong = read(&folder, "[sky]\nfaces = ['0.exr', '1.exr']").unwrap_err();
    assert!(wrong.contains("scene.toml:2") && wrong.contains("+X, -X"), "{wrong}");
    picture(&folder, "5.exr", [8, 8], |_, _| [1.0; 3]);
    let wrong = read(&folder, text).unwrap_err();
    assert!(wrong.contains("5.exr") && wrong.contains("of one size"), "{wrong}");
}

#[test]
fn a_studio_stands_about_a_model_and_is_written_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("tile.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 1\nf 1 2 3\n").unwrap();
    let path = folder.path().join("tile.obj");
    let bare = open(path.to_str().unwrap(), &OpenOptions::default()).unwrap();
    let model = file::Model { path: &path, scale: 1.0, up: Up::Y, scene: None, variant: None };
    let written = file::to_toml(file::Origin::Model(model), &bare, &bare.camera, &bare.settings);
    let again = read(&folder, &written).unwrap_or_else(|error| panic!("{error}: {written}"));
    assert_eq!((again.sky, again.environment, again.lights), (bare.sky, bare.environment, bare.lights), "{written}");
    assert_eq!((again.settings, again.objects.len()), (bare.settings, 2), "{written}");
    let ground = |scene: &Scene| scene.materials.last().map(|own| (own.name.clone(), own.base_color));
    assert_eq!(again.fitted.ground, Some(1));
    assert_eq!(ground(&read(&folder, &written).unwrap()).unwrap().0, "ground");
    // Light that a file brings replaces everything that was fitted to its base.
    let lit =
        read(&folder, "base = 'tile.obj'\n[[lights]]\nkind = 'directional'\ndirection = [0, -1, 0]\nintensity = 10\n")
            .unwrap();
    assert_eq!((lit.lights.len(), lit.objects.len(), lit.sky.is_none(), lit.settings.exposure), (1, 1, true, None));
    let beside = "base = 'tile.obj'\n[[models]]\npath = 'tile.obj'\ntranslation = [0, -3, 0]\n";
    let lamp = "[[lights]]\nkind = 'directional'\ndirection = [0, -1, 0]\nintensity = 10\n";
    let two = read(&folder, &format!("{beside}{lamp}")).unwrap();
    assert_eq!((two.lights.len(), two.objects.len(), two.fitted.ground), (1, 2, None));
    // The ground lies below both.
    let two = read(&folder, beside).unwrap();
    assert_eq!((two.objects.len(), two.fitted.ground), (3, Some(2)));
    assert!(two.objects[2].transform.translation.y < -3.0);
    let dark = read(&folder, "base = 'tile.obj'\nbase_lights = false").unwrap();
    assert!(dark.lights.is_empty() && dark.sky.is_none() && dark.objects.len() == 1);
}

#[test]
fn an_atmosphere_brings_its_sun_where_that_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let scene = read(&folder, SKIES.split("---").next().unwrap()).unwrap();
    assert!(
        matches!(scene.lights[..], [ref light] if matches!(light.kind, LightKind::Directional { .. }) && light.casts_shadow)
    );
    let sun = scene.sky.as_ref().and_then(|sky| sky.sun).expect("a sun");
    let LightKind::Directional { direction } = scene.lights[0].kind else { panic!("no directional light") };
    assert!((sun.direction + direction).length() < 1e-12);
    assert!((sun.direction - DVec3::new(0.75f64.sqrt(), 0.5, 0.0)).length() < 1e-12, "{}", sun.direction);
    assert!(scene.check().is_ok());
    // A night sky has no sun.
    let night = read(&folder, "[sky]\natmosphere = { elevation_degrees = -20, sun = true }").unwrap();
    assert!(night.lights.is_empty() && night.sky.is_some_and(|sky| sky.sun.is_none()));
}

#[test]
fn pictures_that_are_no_sky_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    picture(&folder, "one.exr", [1, 1], |_, _| [1.0; 3]);
    picture(&folder, "square.exr", [4, 4], |_, _| [1.0; 3]);
    picture(&folder, "wide.hdr", [16384, 8192 / 4096], |_, _| [1.0; 3]);
    std::fs::write(folder.path().join("broken.exr"), b"v/1\x01 and nothing more").unwrap();
    std::fs::write(folder.path().join("broken.hdr"), b"#?RADIANCE\n\n-Y 4 +X 8\n").unwrap();
    // Twice the height is 4, in 32 bits.
    std::fs::write(folder.path().join("high.hdr"), b"#?RADIANCE\n\n-Y 2147483650 +X 4\n").unwrap();
    std::fs::write(folder.path().join("sky.png"), b"").unwrap();
    for (text, words) in [
        ("[sky]\nfile = 'one.exr'", "it is 1x1: an equirectangular picture of a sky is twice as wide as high"),
        ("[sky]\nfile = 'square.exr'", "it is 4x4"),
        ("[sky]\nfile = 'wide.hdr'", "it is 16384x2"),
        ("[sky]\nfile = 'high.hdr'", "it is 4x2147483650"),
        ("[sky]\nfile = 'broken.exr'", "broken.exr"),
        ("[sky]\nfile = 'broken.hdr'", "broken.hdr"),
        ("[sky]\nfile = 'sky.png'", "Radiance HDR (.hdr) and OpenEXR (.exr)"),
        ("[sky]\nfile = 'none.hdr'", "none.hdr"),
        ("[sky]\nfile = 'one.exr'\natmosphere = {}", "one of file, faces, atmosphere and studio"),
        ("[sky]\n", "one of file, faces, atmosphere and studio"),
        ("[sky]\natmosphere = { elevation_degrees = 91 }", "from -90 to 90 degrees"),
        ("[sky]\natmosphere = { haze = -1 }", "from 0 to 100"),
        ("[sky]\natmosphere = { haze = nan }", "from 0 to 100"),
        ("[sky]\natmosphere = { ground = 2 }", "from 0 to 1"),
        ("[sky]\natmosphere = { altitude = 1e6 }", "from 0 to 50000 metres"),
        ("[sky]\natmosphere = {}\nstrength = -1", "from 0 to 1e9"),
        ("[sky]\natmosphere = {}\nrotation_degrees = inf", "from -1e6 to 1e6"),
        ("[sky]\nfle = 'a'", "did you mean \"file\"?"),
    ] {
        let error = read(&folder, text).unwrap_err();
        assert!(error.contains(words) && error.contains("scene.toml"), "{text:?}: {error}");
    }
}

#[test]
fn values_that_are_no_light_are_mended_with_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let odd = [f32::NAN, f32::INFINITY, -1.0, 1e38, f32::NEG_INFINITY, 3.0, 0.5, -0.0];
    picture(&folder, "odd.exr", [8, 4], |x, _| [odd[x as usize]; 3]);
    let scene = read(&folder, "[sky]\nfile = 'odd.exr'").unwrap();
    let sky = scene.sky.as_ref().expect("a sky");
    let row: Vec<f32> = sky.image.texels[..8].iter().map(|texel| texel[0]).collect();
    assert_eq!(row, [0.0, 1e6, 0.0, 1e6, 0.0, 3.0, 0.5, 0.0]);
    assert!(scene.check().is_ok());
    let told = scene.warnings.join("\n");
    assert!(told.contains("negative or no number") && told.contains("above 1e6"), "{told}");
}
