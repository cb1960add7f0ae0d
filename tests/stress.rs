//! The catalogue of extreme cases holds on this driver, mistakes that are planted are found by it, and scenes that nobody thought of stay
//! finite.

mod common;

use std::cell::RefCell;

use afterlight::scene::builtin::shapes;
use afterlight::scene::builtin::stage::Stage;
use afterlight::scene::{
    Brdf, Camera, Environment, Falloff, GbufferChoice, GbufferPreset, Light, LightKind, LightPath, Material, Scene,
    SettingsPatch, ShadowFilter,
};
use afterlight::stress::{self, Evidence, Outcome, Subject, Verdict, catalogue};
use common::gpu::{Gpu, on_gpu};
use glam::{DAffine3, DQuat, DVec3, Vec3};
use half::f16;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

fn told(verdict: &Verdict) -> String {
    let broken = verdict.findings.iter().filter(|finding| !finding.is_as_claimed(&verdict.case));
    let lines: Vec<String> = broken.map(|finding| format!("{}: {:?}", finding.value, finding.outcome)).collect();
    format!("{} of {:?}:\n{}", verdict.case.name, verdict.case.bound, lines.join("\n"))
}

#[test]
fn every_case_holds_as_it_is_claimed() {
    on_gpu(|gpu| {
        let tried: Vec<Verdict> = catalogue::all()
            .iter()
            .map(|case| stress::run(&gpu.device, case, true).unwrap_or_else(|error| panic!("{}: {error}", case.name)))
            .collect();
        let broken: Vec<String> = tried.iter().filter(|verdict| !verdict.passes()).map(told).collect();
        assert!(broken.is_empty(), "{}", broken.join("\n\n"));
    });
}

/// The worst of a case whose scenes are spoiled before they are drawn.
fn spoiled(gpu: &Gpu, name: &str, spoil: &dyn Fn(&mut Scene)) -> Verdict {
    let [case] = catalogue::named(name)[..] else { panic!("no case {name}") };
    stress::run_spoiled(&gpu.device, &case, true, spoil).unwrap_or_else(|error| panic!("{name}: {error}"))
}

#[test]
fn positions_in_half_floats_are_found() {
    on_gpu(|gpu| {
        let halve = |scene: &mut Scene| {
            for position in scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.positions) {
                *position = position.map(|axis| f16::from_f32(axis).to_f32());
            }
        };
        assert!(!spoiled(gpu, "lights/distance", &halve).passes());
    });
}

#[test]
fn light_below_zero_is_drawn_and_found_and_what_is_no_number_is_not_even_drawn() {
    on_gpu(|gpu| {
        let painted = |color: Vec3| {
            spoiled(gpu, "lights/distance", &|scene| scene.lights.iter_mut().for_each(|light| light.color = color))
        };
        for color in [Vec3::NAN, Vec3::splat(f32::INFINITY)] {
            let found = painted(color);
            let words = "light 0 (`lamp`): color is not finite";
            assert!(!found.passes());
            for finding in &found.findings {
                assert!(matches!(&finding.outcome, Outcome::Refused(why) if why == words), "{:?}", finding.outcome);
            }
        }
        // A number like any other to the check of scenes, and to the shaders.
        let found = painted(Vec3::new(-1.0, 1.0, 1.0));
        assert!(!found.passes());
        let negative = found.findings.iter().filter(|finding| !finding.is_sane()).count();
        assert_eq!(negative, found.findings.len(), "{}", told(&found));
        let right = painted(Vec3::ONE);
        assert!(right.passes(), "{}", told(&right));
    });
}

#[test]
fn reflection_models_as_in_textbooks_are_found_in_pictures() {
    on_gpu(|gpu| {
        let textbook = |scene: &mut Scene| scene.settings.textbook = Some(true);
        for name in ["highlights/wide-float32", "highlights/blinn-phong-float32", "highlights/phong-float32"] {
            let found = spoiled(gpu, name, &textbook);
            assert!(!found.passes(), "{}", told(&found));
        }
    });
}

#[test]
fn a_picture_of_nothing_is_not_taken_for_one_of_the_scene() {
    on_gpu(|gpu| {
        let found = spoiled(gpu, "targets/width", &|scene| scene.objects.clear());
        // A device may refuse the largest, which is beyond the claim.
        let mut claimed = found.findings.iter().filter(|finding| found.case.claims(finding.value));
        assert!(claimed.all(|finding| matches!(finding.outcome, Outcome::Measured(_))));
        assert!(!found.passes(), "{}", told(&found));
    });
}

/// What a random scene is made of; decades are powers of ten.
#[derive(Debug, Clone)]
struct Extremes {
    roughness: f32,
    metallic: f32,
    base_color: f32,
    brdf: Brdf,
    shininess: f32,
    /// Metres to a scene unit, and how many of them everything is from the origin.
    scale: f64,
    offset: f64,
    /// Of the lamp, in units, and how bright it makes the floor below, in lux.
    distance: f64,
    lux: f64,
    sun: f64,
    spot: Option<f64>,
    range: Option<f64>,
    shadows: bool,
    fov: f64,
    stops: f32,
    stretch: [f64; 3],
    gbuffer: GbufferPreset,
    light_path: LightPath,
    filter: ShadowFilter,
}

fn decades(first: i32, last: i32) -> impl Strategy<Value = f64> {
    (f64::from(first)..=f64::from(last)).prop_map(|exponent| 10f64.powf(exponent))
}

fn extremes() -> impl Strategy<Value = Extremes> {
    let unit = || prop_oneof![Just(0.0f32), Just(1.0), 0.0f32..=1.0];
    let rough = prop_oneof![Just(0.0f32), decades(-4, 0).prop_map(|value| value as f32)];
    let models = [Brdf::CookTorrance, Brdf::Phong, Brdf::BlinnPhong, Brdf::Lambert];
    let surface = (rough, unit(), unit(), prop::sample::select(models.to_vec()), decades(0, 6));
    let space = (decades(-3, 4), prop_oneof![Just(0.0), decades(0, 7)], 1.0..170.0f64, [-1i32..=1, -1..=1, -1..=1]);
    let lights = (
        decades(-3, 4),
        decades(-6, 9),
        prop_oneof![Just(0.0), decades(-6, 6)],
        prop::option::of(0.0..=180.0f64),
        prop::option::of(decades(-3, 6)),
        prop::bool::weighted(0.3),
        -20.0f32..=20.0,
    );
    let presets = [GbufferPreset::Lean, GbufferPreset::Fat, GbufferPreset::Float32];
    let paths = [LightPath::Auto, LightPath::Loop, LightPath::Clustered, LightPath::Compute, LightPath::Forward];
    let filters = [ShadowFilter::None, ShadowFilter::Box2, ShadowFilter::Poisson, ShadowFilter::Pcss];
    let settings = (
        prop::sample::select(presets.to_vec()),
        prop::sample::select(paths.to_vec()),
        prop::sample::select(filters.to_vec()),
    );
    (surface, space, lights, settings).prop_map(|(surface, space, lights, settings)| Extremes {
        roughness: surface.0,
        metallic: surface.1,
        base_color: surface.2,
        brdf: surface.3,
        shininess: surface.4 as f32,
        scale: space.0,
        offset: space.1,
        fov: space.2,
        stretch: space.3.map(|exponent| 4f64.powi(exponent)),
        distance: lights.0,
        lux: lights.1,
        sun: lights.2,
        spot: lights.3,
        range: lights.4,
        shadows: lights.5,
        stops: lights.6,
        gbuffer: settings.0,
        light_path: settings.1,
        filter: settings.2,
    })
}

impl Extremes {
    fn subject(&self) -> Subject {
        let mut stage = Stage::default();
        let material = stage.material(Material {
            brdf: self.brdf,
            base_color: Vec3::splat(self.base_color),
            metallic: self.metallic,
            roughness: self.roughness,
            specular: Vec3::splat(self.base_color),
            shininess: self.shininess,
            ..Material::default()
        });
        let away = DVec3::splat(self.offset);
        let place = |turn: DQuat, stretch: DVec3, at: DVec3| {
            DAffine3::from_scale_rotation_translation(stretch * self.scale, turn, at * self.scale + away)
        };
        let floor = stage.mesh("floor", shapes::plane([8.0, 8.0]), material);
        stage.place(floor, material, place(DQuat::IDENTITY, DVec3::ONE, DVec3::ZERO));
        let ball = stage.mesh("ball", shapes::sphere(0.5, 24), material);
        stage.place(ball, material, place(DQuat::from_rotation_z(0.5), DVec3::from(self.stretch), DVec3::Y));
        let at = |point: DVec3| point * self.scale + away;
        let position = at(DVec3::new(0.3, self.distance, 0.2));
        let falloff = Falloff::InverseSquare;
        let range = self.range.map(|range| range * self.scale);
        let kind = match self.spot {
            None => LightKind::Point { position, range, falloff },
            Some(angle) => LightKind::Spot {
                position,
                direction: DVec3::NEG_Y,
                inner_angle_degrees: 0.5 * angle,
                outer_angle_degrees: angle,
                range,
                falloff,
            },
        };
        let intensity = (self.lux * (self.distance * self.scale).powi(2)) as f32;
        let lamp =
            Light { name: "lamp".into(), kind, color: Vec3::ONE, intensity, casts_shadow: self.shadows, size: 0.0 };
        stage.light(lamp);
        if self.sun > 0.0 {
            stage.sun(DVec3::new(0.3, -1.0, -0.2), self.sun as f32, Vec3::ONE, self.shadows);
        }
        stage.scene.environment = Environment { ambient: Vec3::splat(0.1 * self.lux as f32), ..Environment::default() };
        stage.scene.camera = Camera {
            fov_y_degrees: self.fov,
            near: 0.01 * self.scale,
            ..Camera::looking_at(at(DVec3::new(0.0, 2.0, 4.0)), at(DVec3::new(0.0, 0.4, 0.0)), DVec3::Y)
        };
        // At 0 stops the lamp's lux on a white floor is mid-grey or so.
        let ev100 = ((self.lux + self.sun).max(1e-30) / 3.0).log2() as f32;
        let settings = SettingsPatch {
            exposure: Some(ev100 + self.stops),
            gbuffer: Some(GbufferChoice { preset: self.gbuffer, ..GbufferChoice::default() }),
            light_path: Some(self.light_path),
            shadow_filter: Some(self.filter),
            shadow_size: Some(256),
            ..SettingsPatch::default()
        };
        Subject::with(stage.scene, settings)
    }

    /// How near to the truth its picture is to be as well, in the mean; `None` where shadow maps have few texels or highlights are narrower than
    /// what 8 bits of roughness say of them.
    fn bound(&self) -> Option<f64> {
        let wide = self.brdf == Brdf::Lambert
            || (self.brdf == Brdf::CookTorrance && self.roughness >= 0.3)
            || (self.brdf != Brdf::CookTorrance && self.shininess < 30.0);
        (wide && !self.shadows).then_some(if self.gbuffer == GbufferPreset::Lean { 0.02 } else { 1e-3 })
    }
}

/// Pixels that are black and should be bright: a shader's last `max` makes black of what is no number.
fn black(evidence: &Evidence) -> usize {
    let most = |light: &[f64; 3]| light.iter().fold(0.0f64, |most, &channel| most.max(channel));
    let brightest = evidence.expected.iter().map(most).fold(0.0, f64::max);
    let pairs = evidence.drawn.iter().zip(&evidence.expected);
    pairs.filter(|(drawn, truth)| drawn.iter().all(|&channel| channel == 0.0) && most(truth) > 0.02 * brightest).count()
}

#[test]
fn scenes_that_nobody_thought_of_stay_finite_and_tame_ones_near_the_truth() {
    on_gpu(|gpu| {
        // A run of the device for each scene, so that few of them; always the same.
        let mut runner = TestRunner::new_with_rng(
            Config { cases: 48, failure_persistence: None, max_shrink_iters: 40, ..Config::default() },
            proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha),
        );
        let compared = RefCell::new((0, 0));
        let outcome = runner.run(&extremes(), |extremes| {
            let subject = extremes.subject();
            let found = stress::compare(&gpu.device, &subject, &subject.scene);
            let (errors, evidence) = match found.unwrap_or_else(|error| panic!("{error}")) {
                Ok(found) => found,
                // Some paths and views do not go together; the plan says so.
                Err(why) => return Err(TestCaseError::reject(why)),
            };
            let mut counts = compared.borrow_mut();
            counts.0 += 1;
            prop_assert_eq!((errors.not_finite, errors.negative), (0, 0));
            if !extremes.shadows {
                prop_assert!(black(&evidence) <= errors.elsewhere, "{} pixels are black: {errors:?}", black(&evidence));
            }
            if let Some(bound) = extremes.bound() {
                counts.1 += 1;
                prop_assert!(errors.mean < bound, "{:?}", errors);
            }
            Ok(())
        });
        outcome.unwrap_or_else(|failure| panic!("{failure}"));
        let (all, tame) = compared.into_inner();
        assert!(all >= 40 && tame >= 8, "{all} scenes, {tame} of them tame: the strategy draws too few");
    });
}
