//! Clips, poses, deformed meshes and their bounds against closed forms, and where numbers are extreme.

mod deforming;
mod scenes;

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DQuat, DVec3};
use proptest::prelude::*;

use super::sample::slerp;
use super::*;

fn channel(target: ChannelTarget, interpolation: Interpolation, times: &[f64], values: &[f64]) -> Channel {
    Channel { target, times: times.to_vec(), values: values.to_vec(), interpolation }
}

fn sampled<const N: usize>(channel: &Channel, time: f64) -> [f64; N] {
    let mut out = [f64::NAN; N];
    assert!(channel.sample(time, &mut out), "{channel:?}");
    out
}

fn node(parent: Option<usize>, placement: Placement) -> Node {
    Node { name: "own".into(), parent, local: Local::Parts(placement), weights: Vec::new() }
}

fn moved(translation: DVec3) -> Placement {
    Placement { translation, ..Placement::default() }
}

fn angle(rotation: [f64; 4]) -> f64 {
    let rotation = DQuat::from_array(rotation);
    2.0 * rotation.xyz().length().atan2(rotation.w.abs())
}

#[test]
fn keys_are_held_stepped_and_drawn_into_lines() {
    let values = [0.0, 10.0, -1.0, 4.0, 20.0, 1.0];
    let line = channel(ChannelTarget::Scale(0), Interpolation::Linear, &[1.0, 3.0], &values);
    assert_eq!(sampled::<3>(&line, -7.0), [0.0, 10.0, -1.0]);
    assert_eq!(sampled::<3>(&line, 1.5), [1.0, 12.5, -0.5]);
    assert_eq!([3.0, 4.0, f64::INFINITY].map(|time| sampled::<3>(&line, time)), [[4.0, 20.0, 1.0]; 3]);
    let steps = Channel { interpolation: Interpolation::Step, ..line.clone() };
    assert_eq!(sampled::<3>(&steps, 2.999), [0.0, 10.0, -1.0]);
    assert_eq!(sampled::<3>(&steps, 3.0), [4.0, 20.0, 1.0]);
    let mut out = [7.0; 4];
    assert!(!line.sample(2.0, &mut out) && !line.sample(f64::NAN, &mut out[..3]) && out == [7.0; 4]);
    let empty = channel(ChannelTarget::Scale(0), Interpolation::Linear, &[], &[]);
    assert!(!empty.sample(0.0, &mut out[..3]));
}

#[test]
fn a_cubic_with_its_tangents_is_that_cubic_whatever_the_keys() {
    let (value, slope) = (|t: f64| t * t * t - 2.0 * t + 1.0, |t: f64| 3.0 * t * t - 2.0);
    let times = [0.0, 0.25, 2.0, 7.0];
    let values: Vec<f64> = times.iter().flat_map(|&t| [slope(t), value(t), slope(t)]).collect();
    let cubic = channel(ChannelTarget::Light(0, LightValue::Intensity), Interpolation::CubicSpline, &times, &values);
    for step in 0..=70 {
        let time = 0.1 * f64::from(step);
        let [found] = sampled(&cubic, time);
        assert!((found - value(time)).abs() < 1e-11, "{time}: {found} {}", value(time));
    }
    // Before the first key and behind the last one stands the value, and no tangent.
    assert_eq!((sampled(&cubic, -1.0), sampled(&cubic, 9.0)), ([value(0.0)], [value(7.0)]));
}

#[test]
fn rotations_turn_evenly_the_shorter_way_and_keep_their_length() {
    let axis = DVec3::new(1.0, 2.0, -0.5).normalize();
    for turn in [1e-12, 1e-7, 1e-3, 1.0, 3.0, PI - 1e-9] {
        let to = DQuat::from_axis_angle(axis, turn);
        // A rotation and its negative are one, and so are quaternions of other lengths.
        for sign in [1.0, -1.0, 1e-200, -1e150] {
            let values = [[0.0, 0.0, 0.0, 1.0], (to * sign).to_array()].concat();
            let line = channel(ChannelTarget::Rotation(0), Interpolation::Linear, &[0.0, 1.0], &values);
            for share in [0.1, 0.5, 0.75] {
                let found = sampled(&line, share);
                assert!((DQuat::from_array(found).length() - 1.0).abs() < 1e-15);
                assert!((angle(found) - share * turn).abs() <= 1e-14 * turn.max(1e-2), "{turn} {sign}: {found:?}");
            }
        }
    }
}

#[test]
fn nearly_opposite_quaternions_turn_by_next_to_nothing_and_not_around() {
    for tiny in [0.0, 1e-17, 1e-12, 1e-8, 1e-5] {
        let from = DQuat::from_axis_angle(DVec3::Y, 0.7);
        let to = -(from * DQuat::from_axis_angle(DVec3::X, tiny));
        for share in [0.0, 0.3, 0.5, 1.0] {
            let found = slerp(from, to, share);
            assert!(found.is_finite() && (found.length() - 1.0).abs() < 1e-15);
            assert!((found.dot(from).abs() - 1.0).abs() < 1e-9, "{tiny} {share}: {found}");
        }
    }
    // Half a turn apart: the middle is a quarter turn, whichever way.
    let middle = slerp(DQuat::IDENTITY, DQuat::from_axis_angle(DVec3::Z, PI), 0.5);
    assert!((angle(middle.to_array()) - FRAC_PI_2).abs() < 1e-12);
}

#[test]
fn a_million_seconds_of_loops_end_where_one_does() {
    let turning = |turns: f64| DQuat::from_rotation_y(TAU * turns).to_array();
    let values = [turning(0.0), turning(0.25), turning(0.5), turning(0.75), turning(1.0)].concat();
    let times = [0.0, 0.75, 1.5, 2.25, 3.0];
    let clip = Clip {
        name: "turn".into(),
        channels: vec![channel(ChannelTarget::Rotation(0), Interpolation::Linear, &times, &values)],
    };
    let motion = Motion { nodes: vec![node(None, Placement::default())], clips: vec![clip], ..Motion::default() };
    let place = |time: f64, looped| {
        motion.pose(&Playing { time, looped, ..Playing::default() }).world(0).transform_vector3(DVec3::X)
    };
    // 999,999 is a multiple of 3, so that this much is left of the last turn.
    for left in [0.0, 0.125, 0.75, 2.9] {
        let expected = DQuat::from_rotation_y(TAU * left / 3.0) * DVec3::X;
        assert!(place(999_999.0 + left, true).distance(expected) < 1e-9, "{left}");
        assert!(place(left - 999_999.0, true).distance(expected) < 1e-9, "{left}");
    }
    assert!(place(1e6, false).distance(DVec3::X) < 1e-12);
    assert!(
        place(1e300, true).is_finite() && place(f64::INFINITY, true).is_finite() && place(f64::NAN, true).is_finite()
    );
}

#[test]
fn a_thousand_joints_in_a_chain_close_their_circle() {
    const COUNT: usize = 1000;
    let step =
        Placement { translation: DVec3::X, rotation: DQuat::from_rotation_z(TAU / COUNT as f64), scale: DVec3::ONE };
    let nodes = (0..=COUNT).map(|index| node(index.checked_sub(1), step)).collect();
    let motion = Motion { nodes, ..Motion::default() };
    let pose = motion.pose(&Playing::default());
    let (first, last) = (pose.world(0), pose.world(COUNT));
    assert!(last.translation.distance(first.translation) < 1e-9, "{last}");
    assert!(last.matrix3.abs_diff_eq(first.matrix3, 1e-11));
}

#[test]
fn scales_from_a_millionth_to_a_million_cancel_along_a_chain() {
    for scale in [1e-6, 1e-3, 1e3, 1e6] {
        let up = Placement { scale: DVec3::splat(scale), ..moved(DVec3::ONE) };
        let down = Placement { scale: DVec3::splat(1.0 / scale), rotation: DQuat::from_rotation_x(0.3), ..up };
        let motion = Motion { nodes: vec![node(None, up), node(Some(0), down)], ..Motion::default() };
        let world = motion.pose(&Playing::default()).world(1);
        assert!(world.matrix3.abs_diff_eq(glam::DMat3::from_rotation_x(0.3), 1e-15), "{scale}: {world}");
        assert_eq!(world.translation, DVec3::splat(1.0 + scale));
    }
}

proptest! {
    #[test]
    fn any_keys_give_finite_rotations(parts in prop::collection::vec(-1e3..1e3f64, 24), time in -1.0..3.0f64) {
        let cubic = channel(ChannelTarget::Rotation(0), Interpolation::CubicSpline, &[0.0, 1.0], &parts);
        let found = DQuat::from_array(sampled(&cubic, time));
        prop_assert!(found.is_normalized());
    }
}
