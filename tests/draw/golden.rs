//! Every built-in scene and every view, as they looked when they were last looked at. AFTERLIGHT_BLESS=1 keeps the pictures that are drawn now where they
//! look otherwise.

mod models;

use crate::common::golden::{LARGEST_MEAN, SAME_WITHIN, check, flip_error};
use crate::common::gpu::{Gpu, on_gpu};
use crate::common::scenes::sprites;
use crate::common::some_of;
use crate::common::stage::{open, own, view};
use afterlight::frame::{Error, Renderer};
use afterlight::scene::builtin::CATALOGUE;
use afterlight::scene::{
    AmbientOcclusion, Atmosphere, Brdf, Fog, Playing, Reflections, Scene, Settings, ShadowFilter, SkyChoice, Tonemap,
    Transparency, View, put_sky,
};

const SIZE: (u32, u32) = (256, 144);

/// Draws and compares; goes on after a difference, so that one run reports them all.
struct Album<'a> {
    gpu: &'a Gpu,
    wrong: Vec<String>,
}

impl Album<'_> {
    /// Draws and compares a picture of several consecutive frames that end at this time.
    fn over_time(&mut self, name: &str, scene: &Scene, settings: &Settings, time: f64) {
        let mut renderer: Renderer = self.gpu.renderer(scene, settings);
        let show = |renderer: &mut Renderer, seconds: f64| {
            renderer.pose(scene, &scene.motion.pose(&Playing::at(time + seconds)))?;
            Ok::<_, Error>(scene.camera)
        };
        let result = renderer
            .picture_while(show, || ())
            .map_err(|error| format!("{name}: {error}"))
            .and_then(|picture| check(name, &picture, &self.gpu.device.physical));
        self.wrong.extend(result.err());
    }

    /// Without anisotropy: each driver has its own way to choose places on a texture.
    fn compare(&mut self, name: &str, scene: &Scene, settings: &Settings) {
        let mut renderer: Renderer = self.gpu.renderer(scene, &Settings { anisotropy: 1, ..settings.clone() });
        let picture = renderer.render(&scene.camera).and_then(|()| renderer.read_back());
        let result = picture
            .map_err(|error| format!("{name}: {error}"))
            .and_then(|picture| check(name, &picture, &self.gpu.device.physical));
        self.wrong.extend(result.err());
    }
}

fn album(fill: impl FnOnce(&mut Album)) {
    on_gpu(|gpu| {
        let mut album = Album { gpu, wrong: Vec::new() };
        fill(&mut album);
        assert!(album.wrong.is_empty(), "{}", album.wrong.join("\n"));
    });
}

/// Fewer objects and lights than the default, which is a benchmark's.
const FIELD: &str = "builtin:field?objects=60&lights=24&range=12";

#[test]
fn every_built_in_scene_looks_as_it_did() {
    album(|album| {
        for builtin in CATALOGUE {
            let name = format!("builtin:{}", builtin.name);
            let scene = open(if builtin.name == "field" { FIELD } else { &name });
            album.compare(builtin.name, &scene, &own(&scene, SIZE.0, SIZE.1));
        }
    });
}

#[test]
fn a_sky_and_its_light_look_as_they_did() {
    album(|album| {
        for (name, path) in
            [("gallery-sky", "assets/gallery/sky.toml"), ("gallery-sky-alone", "assets/gallery/sky-alone.toml")]
        {
            let scene = open(path);
            album.compare(name, &scene, &Settings { samples: 1, ..own(&scene, SIZE.0, SIZE.1) });
        }
        // Mirrors of all roughness.
        let mut spheres = open("builtin:spheres");
        spheres.lights.clear();
        put_sky(&mut spheres, &SkyChoice::Atmosphere(Some(Atmosphere::sun_at(20.0, 150.0)))).expect("a sky");
        album.compare("spheres-sky", &spheres, &Settings { exposure: None, ..own(&spheres, SIZE.0, SIZE.1) });
    });
}

#[test]
fn sprites_of_an_atlas_look_as_they_did() {
    album(|album| {
        let scene = sprites();
        album.compare("sprites", &scene, &Settings { exposure: Some(0.5), ..own(&scene, SIZE.0, SIZE.1) });
    });
}

#[test]
fn every_view_looks_as_it_did() {
    album(|album| {
        let hall = open("builtin:hall");
        let field = open(FIELD);
        // One frame has no vectors.
        let own = [View::Final, View::Complexity, View::Particles, View::Velocity];
        let shown = |view: &View| !own.contains(view) && album.gpu.shows(*view);
        // `make test-all` compares the others, too.
        let views: Vec<_> = some_of(View::NAMES.iter().filter(|(_, view)| shown(view)), 2).collect();
        for (name, shown) in views {
            album.compare(&format!("hall-{name}"), &hall, &view(&hall, SIZE.0, SIZE.1, *shown));
        }
        // The hall has little of these: metals, layers, lights with a range.
        for (name, shown) in [
            ("metallic", View::Metallic),
            ("roughness", View::Roughness),
            ("overdraw", View::Overdraw),
            ("lights-per-pixel", View::LightsPerPixel),
        ] {
            album.compare(&format!("field-{name}"), &field, &view(&field, SIZE.0, SIZE.1, shown));
        }
    });
}

#[test]
fn every_model_and_every_tone_mapper_looks_as_it_did() {
    album(|album| {
        for brdf in [Brdf::Phong, Brdf::BlinnPhong, Brdf::Lambert] {
            let scene = open(&format!("builtin:spheres?brdf={brdf}"));
            album.compare(&format!("spheres-{brdf}"), &scene, &own(&scene, SIZE.0, SIZE.1));
        }
        let scene = open("builtin:spheres");
        for tonemap in [Tonemap::Agx, Tonemap::Aces, Tonemap::None] {
            let settings = Settings { tonemap, ..own(&scene, SIZE.0, SIZE.1) };
            album.compare(&format!("spheres-{tonemap}"), &scene, &settings);
        }
    });
}

/// The scenes of assets/gallery, once each: every light path draws the same, which tests/light/light_paths.rs sees to.
#[test]
fn every_picture_of_the_gallery_looks_as_it_did() {
    album(|album| {
        let gallery = |name: &str| open(&format!("assets/gallery/{name}.toml"));
        let names = [
            "ambient",
            "hemisphere",
            "emissive",
            "directional",
            "several-directional",
            "point",
            "spot",
            "beam",
            "temperature",
            "fall-offs",
            "cascades",
            "soft-shadows",
        ];
        // `make test-all` compares all of them, and all filters.
        for name in some_of(names, 3) {
            let scene = gallery(name);
            album.compare(&format!("gallery-{name}"), &scene, &own(&scene, SIZE.0, SIZE.1));
        }
        let scene = gallery("filters");
        for (name, filter) in some_of(ShadowFilter::NAMES, 2) {
            let mut settings = own(&scene, SIZE.0, SIZE.1);
            settings.shadows.filter = *filter;
            album.compare(&format!("gallery-filter-{name}"), &scene, &settings);
        }
        let scene = gallery("transparency");
        for (name, transparency) in Transparency::NAMES {
            let settings = Settings { transparency: *transparency, ..own(&scene, SIZE.0, SIZE.1) };
            album.compare(&format!("gallery-transparency-{name}"), &scene, &settings);
        }
        let scene = gallery("emissive");
        album.compare("gallery-bloom", &scene, &Settings { bloom: 0.2, ..own(&scene, SIZE.0, SIZE.1) });
        let scene = gallery("sky");
        let fogged = Settings { fog: Fog::Height, fog_density: 0.1, fog_height: 2.0, ..own(&scene, SIZE.0, SIZE.1) };
        album.compare("gallery-fog", &scene, &fogged);
        let scene = gallery("fog");
        let lit = Settings { fog_froxels: [48, 27, 32], ..own(&scene, SIZE.0, SIZE.1) };
        album.compare("gallery-fog-lit", &scene, &lit);
        let scene = gallery("edges");
        let base = own(&scene, SIZE.0, SIZE.1);
        album.compare("gallery-edges-fxaa", &scene, &Settings { fxaa: true, ..base.clone() });
        album.compare("gallery-edges-msaa", &scene, &Settings { msaa: 4, ..base.clone() });
        album.compare("gallery-vignette-and-grain", &scene, &Settings { vignette: 1.0, grain: 0.2, ..base });
        album.over_time("gallery-edges-taa", &scene, &Settings { taa: true, ..own(&scene, SIZE.0, SIZE.1) }, 0.0);
        let scene = gallery("taa");
        album.over_time("gallery-taa-velocity", &scene, &view(&scene, SIZE.0, SIZE.1, View::Velocity), 0.6);
        let smoke = gallery("particles").into_still(&Playing::at(20.0));
        let once = Settings { samples: 1, ..own(&smoke, SIZE.0, SIZE.1) };
        album.compare("gallery-particles", &smoke, &once);
        let weighted = Settings { transparency: Transparency::Oit, ..once.clone() };
        album.compare("gallery-particles-oit", &smoke, &weighted);
        album.compare("gallery-particles-view", &smoke, &Settings { view: View::Particles, ..once });
        let hall = open("builtin:hall");
        let occluded = Settings { ao: AmbientOcclusion::Bitmask, ..own(&hall, SIZE.0, SIZE.1) };
        album.compare("hall-bitmask", &hall, &occluded);
        let scene = gallery("reflections");
        let mirrored = Settings { reflections: Reflections::Screen, samples: 1, ..own(&scene, SIZE.0, SIZE.1) };
        album.compare("gallery-reflections", &scene, &mirrored);
        album.compare("gallery-reflections-view", &scene, &Settings { view: View::Reflections, ..mirrored });
        album.compare("hall-bitmask-view", &hall, &Settings { view: View::Ao, ..occluded });
    });
}

/// Hundreds of meshes, cut-out leaves, two models and a sun of the sky: once as on a late afternoon.
#[test]
fn the_harbour_looks_as_it_did() {
    album(|album| {
        for name in ["harbour", "harbour-evening"] {
            let scene = open(&format!("assets/{name}.toml"));
            let still = scene.at(&Playing::at(2.0));
            album.compare(name, &still, &own(&still, 128, 72));
        }
    });
}

/// The comparison itself notices the differences that it must.
#[test]
fn five_percent_of_light_and_a_pixel_aside_are_noticed() {
    on_gpu(|gpu| {
        for spec in ["builtin:spheres", "builtin:hall", "builtin:cornell", FIELD] {
            let mut scene = open(spec);
            let settings =
                Settings { exposure: Some(afterlight::scene::metered_ev100(&scene)), ..own(&scene, SIZE.0, SIZE.1) };
            let rgb = |scene: &Scene, settings: &Settings| {
                let picture = gpu.draw(scene, settings);
                let rgb = crate::common::gpu::bytes(&picture)
                    .chunks_exact(4)
                    .flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]);
                image::RgbImage::from_raw(SIZE.0, SIZE.1, rgb.collect()).unwrap_or_default()
            };
            let good = rgb(&scene, &settings);
            let brighter =
                Settings { exposure: settings.exposure.map(|ev100| ev100 - 1.05f32.log2()), ..settings.clone() };
            let (mean, _) = flip_error(&good, &rgb(&scene, &brighter));
            assert!(mean > LARGEST_MEAN, "{spec}, 5% more light: {mean}");
            let pixel = 2.0 * scene.camera.half_height() / f64::from(SIZE.1);
            scene.camera.rotation *= glam::DQuat::from_rotation_y(pixel);
            let (mean, _) = flip_error(&good, &rgb(&scene, &settings));
            assert!(mean > LARGEST_MEAN, "{spec}, a pixel aside: {mean}");
        }
    });
}

/// The allowance ends where it says: the room for another processor's reciprocals is no room for mistakes.
#[test]
fn what_no_channel_exceeds_is_the_same_and_a_code_more_is_not() {
    let (width, height) = SIZE;
    // Greys all over, and every other pixel brighter or darker by `codes` in one channel.
    let grey = image::RgbImage::from_fn(width, height, |x, y| image::Rgb([((x * 7 + y * 13) % 200 + 20) as u8; 3]));
    let shifted = |codes: u8| {
        let mut image = grey.clone();
        for (x, y, pixel) in image.enumerate_pixels_mut().filter(|(x, y, _)| (x + y) % 2 == 0) {
            let channel = &mut pixel.0[(x % 3) as usize];
            *channel = if y % 2 == 0 { *channel + codes } else { *channel - codes };
        }
        flip_error(&grey, &image).0
    };
    assert_eq!(shifted(SAME_WITHIN), 0.0);
    assert!(shifted(SAME_WITHIN + 1) > 0.0);
    assert!(shifted(3 * SAME_WITHIN) > LARGEST_MEAN, "{}", shifted(3 * SAME_WITHIN));
}
