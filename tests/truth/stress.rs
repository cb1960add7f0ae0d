//! Mistakes that are planted are found by the catalogue of extreme cases, and scenes that nobody thought of stay finite.

use crate::common::gpu::{Gpu, on_gpu};
use crate::common::tries_all;
use afterlight::scene::{Channel, ChannelTarget, Environment, Local, Placement, Scene};
use afterlight_lab::stress::catalogue::random::{Extremes, NUMBERS};
use afterlight_lab::stress::{self, Case, Check, StressOutcome, StressResult, SweepValues, ValueFinding, catalogue};
use glam::{DQuat, DVec4, Vec3};
use half::{bf16, f16};
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

/// The values of a case that are not as claimed, in words.
pub fn told(verdict: &StressResult) -> String {
    let broken = verdict.findings.iter().filter(|finding| !finding.is_as_claimed(&verdict.case));
    let lines: Vec<String> = broken.map(|finding| format!("{}: {:?}", finding.value, finding.outcome)).collect();
    format!("{} of {:?}:\n{}", verdict.case.name, verdict.case.bound, lines.join("\n"))
}

/// The worst of a case whose scenes are spoiled before they are drawn.
fn spoiled(gpu: &Gpu, name: &str, spoil: &dyn Fn(&mut Scene)) -> StressResult {
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
fn light_below_zero_and_light_that_is_no_number_are_not_even_drawn() {
    on_gpu(|gpu| {
        let painted = |color: Vec3| {
            spoiled(gpu, "lights/distance", &|scene| scene.lights.iter_mut().for_each(|light| light.color = color))
        };
        for (color, fault) in [
            (Vec3::NAN, "is not finite"),
            (Vec3::splat(f32::INFINITY), "is not finite"),
            (Vec3::new(-1.0, 1.0, 1.0), "is negative"),
        ] {
            let found = painted(color);
            let words = format!("light 0 (`lamp`): color {fault}");
            assert!(!found.passes());
            for finding in &found.findings {
                assert!(
                    matches!(&finding.outcome, StressOutcome::Refused(why) if *why == words),
                    "{:?}",
                    finding.outcome
                );
            }
        }
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

/// Plants a mistake.
type Spoil<'a> = &'a dyn Fn(&mut Scene);

/// Each case that moves one value, with a mistake that its truth must find, and without.
#[test]
fn mistakes_of_what_moves_are_found() {
    let channels = |scene: &mut Scene, change: &dyn Fn(&mut Channel)| {
        scene.motion.clips.iter_mut().flat_map(|clip| &mut clip.channels).for_each(change);
    };
    let places = |scene: &mut Scene, change: &dyn Fn(&mut Placement)| {
        for node in &mut scene.motion.nodes {
            if let Local::Parts(own) = &mut node.local {
                change(own);
            }
        }
    };
    let to_f32 = |scene: &mut Scene| places(scene, &|own| own.translation = own.translation.as_vec3().as_dvec3());
    let light_joints_are_none = |scene: &mut Scene| {
        let all = scene.meshes.iter_mut().filter_map(|mesh| mesh.influences.as_mut()).flat_map(|own| &mut own.weights);
        all.for_each(|weight| *weight = if *weight < 1e-4 { 0.0 } else { *weight });
    };
    let a_joint_is_straight = |scene: &mut Scene| {
        let middle = scene.motion.clips[0].channels.len() / 2;
        scene.motion.clips[0].channels.remove(middle);
    };
    // Quaternions are taken as they are, so that the way is the longer one.
    let the_long_way = |scene: &mut Scene| {
        channels(scene, &|own| {
            if let (ChannelTarget::Rotation(_), [x, y, z, w, a, b, c, d]) = (own.target, own.values.as_slice()) {
                let (from, to) = (DQuat::from_xyzw(*x, *y, *z, *w), DQuat::from_xyzw(*a, *b, *c, *d));
                let half = DQuat::from_vec4((DVec4::from(from) + DVec4::from(to)).normalize());
                own.values.splice(4..4, half.to_array());
                own.times.insert(1, 0.5 * (own.times[0] + own.times[1]));
            }
        });
    };
    let times_are_f32 = |scene: &mut Scene| {
        channels(scene, &|own| own.times.iter_mut().for_each(|time| *time = f64::from(*time as f32)));
    };
    let scales_are_coarse = |scene: &mut Scene| {
        places(scene, &|own| own.scale = own.scale.to_array().map(|axis| bf16::from_f64(axis).to_f64()).into());
    };
    let spoils: [(&str, f64, Spoil); 8] = [
        ("motion/far-joints", 1e8, &to_f32),
        ("motion/weights", 1e-5, &light_joints_are_none),
        ("motion/chain", 1000.0, &a_joint_is_straight),
        ("motion/opposite-turns", 90.0, &the_long_way),
        ("motion/late-keys", 1e6, &times_are_f32),
        ("motion/node-scale", 1e-6, &scales_are_coarse),
        ("motion/node-stretch", 1e6, &scales_are_coarse),
        ("motion/size", 1e-6, &scales_are_coarse),
    ];
    assert_eq!(
        spoils.map(|(name, ..)| name).to_vec(),
        catalogue::named("motion").iter().map(|own| own.name).collect::<Vec<_>>()
    );
    on_gpu(|gpu| {
        for (name, value, spoil) in spoils {
            let [case] = catalogue::named(name)[..] else { panic!("no case {name}") };
            assert!(case.claims(value), "{name}");
            let one = || {
                let mut values = case.values.all();
                values.retain(|own| *own == value);
                Case { values: SweepValues::List(Vec::leak(values)), claim: [value; 2], ..case }
            };
            let tried = |spoil: &dyn Fn(&mut Scene)| {
                stress::run_spoiled(&gpu.device, &one(), false, spoil).unwrap_or_else(|error| panic!("{name}: {error}"))
            };
            let (right, wrong) = (tried(&|_| {}), tried(spoil));
            assert!(right.passes(), "{}", told(&right));
            assert!(!wrong.passes(), "{name} does not find its mistake: {:?}", wrong.findings[0].outcome);
            let is_drawn = matches!(wrong.findings[0].outcome, StressOutcome::Measured(_));
            assert!(is_drawn, "{name}: {:?}", wrong.findings[0].outcome);
        }
    });
}

#[test]
fn a_picture_of_nothing_is_not_taken_for_one_of_the_scene() {
    on_gpu(|gpu| {
        let found = spoiled(gpu, "targets/width", &|scene| scene.objects.clear());
        // A device may refuse the largest, which is beyond the claim.
        let mut claimed = found.findings.iter().filter(|finding| found.case.claims(finding.value));
        assert!(claimed.all(|finding| matches!(finding.outcome, StressOutcome::Measured(_))));
        assert!(!found.passes(), "{}", told(&found));
    });
}

#[test]
fn random_scenes_in_the_dark_are_not_sane() {
    on_gpu(|gpu| {
        let darken = |scene: &mut Scene| {
            scene.lights.clear();
            scene.environment = Environment::default();
            scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
        };
        let found = spoiled(gpu, "random/wild", &darken);
        let black = found.findings.iter().filter(|finding| !finding.holds(&found.case)).count();
        assert!(black * 3 > found.findings.len(), "{black} of {}", found.findings.len());
    });
}

#[test]
fn scenes_that_nobody_thought_of_are_sane_and_tame_ones_near_the_truth() {
    on_gpu(|gpu| {
        let held = |name: &str, scene: Extremes| {
            let [case] = catalogue::named(name)[..] else { panic!("no case {name}") };
            let subject = scene.subject();
            let compare = if let Check::Sane(_) = case.check { stress::sane } else { stress::compare };
            let outcome = match compare(&gpu.device, &subject, &subject.scene) {
                Ok((errors, _)) => StressOutcome::Measured(errors),
                Err(stress::StressError::Refused(why)) => StressOutcome::Refused(why),
                Err(error) => panic!("{error}"),
            };
            let finding = ValueFinding { value: 0.0, outcome, evidence: None };
            prop_assert!(finding.holds(&case), "{name}: {:?} of {scene:#?}", finding.outcome);
            Ok(())
        };
        // Each scene takes a run of the device, so there are few, and always the same. `stress random --seeds` has others.
        let cases = if tries_all() { 100 } else { 4 };
        let mut runner = TestRunner::new_with_rng(
            Config { cases, failure_persistence: None, max_shrink_iters: 400, ..Config::default() },
            proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha),
        );
        let numbers = prop::collection::vec(0..=u16::MAX, NUMBERS);
        let outcome = runner.run(&numbers, |numbers| {
            let mut numbers = numbers.into_iter().map(|number| f64::from(number) / 65536.0);
            let wild = Extremes::drawn(&mut || numbers.next().unwrap_or(0.0));
            held("random/wild", wild)?;
            held("random/tame", wild.tamed())?;
            held("random/tame-lean", wild.tamed().leaned())
        });
        outcome.unwrap_or_else(|failure| panic!("{failure}"));
    });
}
