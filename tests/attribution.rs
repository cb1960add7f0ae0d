//! Where a frame's error comes from: planted errors are found in the part that they belong to, and the parts add up to the whole.
#![cfg(feature = "report")]

mod common;

use afterlight::reference::{Mode, Options, Reference, Smith, Truth, View};
use afterlight::report::sweep::attribution::{
    CUT_OFF, HDR, Limits, NOT_EXPLAINED, OTHER_TRIANGLE, OUTPUT, SAMPLING, SWITCHES, Subject, TRANSPARENT, Truths,
    WHOLE, attribute,
};
use afterlight::report::sweep::model::{AttributedPart, Attribution};
use afterlight::scene::{Falloff, HdrFormat, LightPath, Scene, Settings, ShadowSettings};
use common::gpu::{Gpu, on_gpu};
use common::scenes::{one_of_each, with_transparent};
use common::stage::{gbuffer, lambert, open, plane, point};
use glam::DVec3;

const TEXTURES: &str = SWITCHES[0];
const GBUFFER: &str = SWITCHES[1];
const POSITION: &str = SWITCHES[2];
const SHADOWS: &str = SWITCHES[3];
const ARITHMETIC: &str = SWITCHES[4];
const ALL: [&str; 12] = [
    TEXTURES,
    GBUFFER,
    POSITION,
    SHADOWS,
    ARITHMETIC,
    HDR,
    CUT_OFF,
    OUTPUT,
    OTHER_TRIANGLE,
    TRANSPARENT,
    SAMPLING,
    NOT_EXPLAINED,
];

fn small(scene: &Scene) -> Settings {
    Settings { size: [96, 54], ..scene.settings.decide() }
}

/// A scene with its truths.
struct Case<'a> {
    scene: &'a Scene,
    reference: Reference<'a>,
    view: View,
    point: Truth,
    converged: Truth,
}

impl<'a> Case<'a> {
    fn of(scene: &'a Scene) -> Self {
        let reference = Reference::new(scene);
        let view = View { camera: scene.camera, size: small(scene).size };
        let render = |mode| reference.render(&view, &Options { mode, smith: Smith::default() }, &|_, _| ());
        let (point, converged) = (render(Mode::Point), render(Mode::Converged { samples: 8 }));
        Self { scene, reference, view, point, converged }
    }

    fn apart(&self, gpu: &Gpu, settings: &Settings) -> Attribution {
        let subject = Subject { scene: self.scene, reference: &self.reference, settings, view: &self.view, point: 3 };
        let truths = Truths { point: &self.point, converged: &self.converged };
        attribute(&gpu.device, &subject, &truths, &Limits::default()).unwrap_or_else(|error| panic!("{error}"))
    }
}

fn part<'a>(found: &'a Attribution, name: &str) -> &'a AttributedPart {
    found.parts.iter().find(|part| part.name == name).unwrap_or_else(|| panic!("{name} of {:?}", found.parts))
}

/// Root mean square of a part.
fn size(found: &Attribution, name: &str) -> f64 {
    part(found, name).rms
}

/// Whether no part but the named ones has changed by more than a thousandth of the whole.
fn assert_only(changed: &[&str], before: &Attribution, after: &Attribution) {
    for name in ALL.into_iter().filter(|name| !changed.contains(name)) {
        let [before_size, after_size] = [before, after].map(|found| size(found, name));
        let moved = (after_size - before_size).abs();
        assert!(moved < 1e-3 * size(before, WHOLE), "{name}: {before_size} became {after_size}");
    }
}

#[test]
fn parts_add_up_to_the_whole_and_little_is_not_explained() {
    on_gpu(|gpu| {
        let scenes = [open("builtin:hall?detail=6"), open("builtin:cornell"), open("builtin:spheres"), one_of_each()];
        for scene in scenes.iter().chain([&with_transparent(one_of_each())]) {
            let case = Case::of(scene);
            let found = case.apart(gpu, &small(scene));
            assert_eq!((found.point, found.pixels, found.of_pixels), (3, 96 * 54, 96 * 54));
            let (parts, whole) = found.parts.split_at(ALL.len());
            assert_eq!(parts.iter().map(|part| part.name.as_str()).collect::<Vec<_>>(), ALL);
            assert_eq!((whole[0].name.as_str(), whole[0].share), (WHOLE, 1.0));
            let mean: f64 = parts.iter().map(|part| part.mean).sum();
            let share: f64 = parts.iter().map(|part| part.share).sum();
            assert!((mean - whole[0].mean).abs() < 1e-9 && (share - 1.0).abs() < 1e-9, "{mean} {share}");
            // Of 1e-5 of the mean square; what it is there is Ks, which is not measured.
            let rest = size(&found, NOT_EXPLAINED) / whole[0].rms;
            assert!(rest < 0.01, "{}: {rest} of the error is not explained", scene.name);
            let has_transparent = size(&found, TRANSPARENT) > 0.0;
            assert_eq!(has_transparent, scene.materials.iter().any(|material| material.is_transparent()));
        }
    });
}

#[test]
fn a_coarse_gbuffer_is_found_in_quantization_and_a_coarse_place_in_position() {
    on_gpu(|gpu| {
        let scene = open("builtin:spheres");
        let case = Case::of(&scene);
        let with = |formats| case.apart(gpu, &Settings { gbuffer: gbuffer(formats), ..small(&scene) });
        let exact = with("float32");
        // In f64, nothing.
        assert!(size(&exact, GBUFFER) < 1e-12, "{}", size(&exact, GBUFFER));
        for formats in ["float32,normal=rgb10a2", "float32,material=rgba8", "float32,albedo=rgba8"] {
            let coarse = with(formats);
            assert!(size(&coarse, GBUFFER) > 1e-4, "{formats}: {}", size(&coarse, GBUFFER));
            assert_only(&[GBUFFER, OUTPUT, WHOLE], &exact, &coarse);
        }
        let shifted = with("float32,position=rgba16f");
        let sizes = [&exact, &shifted].map(|found| size(found, POSITION));
        assert!(sizes[1] > 1e-4 && sizes[1] > 100.0 * sizes[0], "{sizes:?}");
        assert_only(&[POSITION, OUTPUT, WHOLE], &exact, &shifted);
    });
}

#[test]
fn wrong_biases_are_found_in_shadows() {
    on_gpu(|gpu| {
        let scene = open("builtin:hall?detail=6");
        let case = Case::of(&scene);
        let right = case.apart(gpu, &small(&scene));
        let with = |normal_offset, slope_bias| {
            let shadows = ShadowSettings { normal_offset, slope_bias, ..small(&scene).shadows };
            case.apart(gpu, &Settings { shadows, ..small(&scene) })
        };
        for wrong in [with(0.0, 0.0), with(60.0, 1.5)] {
            let sizes = [&right, &wrong].map(|found| size(found, SHADOWS));
            assert!(sizes[1] > 2.0 * sizes[0], "{sizes:?}");
            // Textures, lit less or more, weigh less or more.
            assert_only(&[SHADOWS, TEXTURES, GBUFFER, OUTPUT, HDR, OTHER_TRIANGLE, WHOLE], &right, &wrong);
            assert!(size(&wrong, GBUFFER) < 0.1 * size(&wrong, SHADOWS));
        }
        let unshadowed = ShadowSettings { enabled: false, ..small(&scene).shadows };
        let bright = case.apart(gpu, &Settings { shadows: unshadowed, ..small(&scene) });
        assert!(part(&bright, SHADOWS).mean > 10.0 * part(&right, SHADOWS).mean.abs());
    });
}

#[test]
fn a_coarse_format_of_light_is_found_in_its_part() {
    on_gpu(|gpu| {
        let scene = open("builtin:cornell");
        let case = Case::of(&scene);
        let with = |hdr_format| case.apart(gpu, &Settings { hdr_format, ..small(&scene) });
        let [exact, half, packed] = [HdrFormat::Rgba32f, HdrFormat::Rgba16f, HdrFormat::B10g11r11].map(with);
        let sizes = [&exact, &half, &packed].map(|found| size(found, HDR));
        assert!(sizes[0] == 0.0 && sizes[1] > 0.0 && sizes[2] > 8.0 * sizes[1], "{sizes:?}");
        assert_only(&[HDR, OUTPUT, WHOLE], &exact, &packed);
        assert_only(&[HDR, OUTPUT, WHOLE], &exact, &half);
    });
}

#[test]
fn a_light_that_is_cut_off_is_found_and_surfaces_lit_as_they_are_drawn_have_no_gbuffer() {
    on_gpu(|gpu| {
        let lamp = |x: f64, candela| point(DVec3::new(x, 0.3, 0.3), candela, None, Falloff::InverseSquare);
        // The second is seen near it, and too dim to be seen far from it.
        let scene = plane(lambert(0.7), vec![lamp(-0.5, 2.0), lamp(0.5, 1e-4)]);
        let case = Case::of(&scene);
        let whole = case.apart(gpu, &Settings { light_path: LightPath::Clustered, ..small(&scene) });
        let cut = Settings { light_path: LightPath::Clustered, light_cutoff: true, ..small(&scene) };
        let cut = case.apart(gpu, &cut);
        assert!(size(&whole, CUT_OFF) == 0.0 && size(&cut, CUT_OFF) > 1e-6, "{}", size(&cut, CUT_OFF));
        assert!(part(&cut, CUT_OFF).mean < 0.0, "less light");
        assert_only(&[CUT_OFF, OUTPUT, WHOLE], &whole, &cut);
        let forward = case.apart(gpu, &Settings { light_path: LightPath::Forward, ..small(&scene) });
        assert!(size(&forward, GBUFFER) < 1e-12, "{}", size(&forward, GBUFFER));
        assert!(size(&whole, GBUFFER) > 1e-5);
    });
}
