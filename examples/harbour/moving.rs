//! The clips: boats and a buoy on the sea, flags and a vane in the wind, a crane, the lighthouse's lens, and gulls.

use std::f64::consts::TAU;

use glam::{DAffine3, DQuat, DVec2, DVec3};
use serde_json::json;

use super::glb::{Glb, NodeChannel, Target};
use super::model::{Model, at, colour, smooth, turned};
use super::shore::{EAST, LIGHT, PIER, PIER_DECK, QUAY};
use super::{CHURCH, boats, houses, put, things};

/// Clips in the order of the file.
#[derive(Default)]
pub struct Clips(pub Vec<(&'static str, Vec<NodeChannel>)>);

impl Clips {
    fn add(&mut self, name: &'static str, channel: NodeChannel) {
        match self.0.iter_mut().find(|(other, _)| *other == name) {
            Some((_, channels)) => channels.push(channel),
            None => self.0.push((name, vec![channel])),
        }
    }
}

/// Keys of a swing about X and Z that closes after `seconds`.
fn rocking(node: usize, rest: DQuat, seconds: f64, (roll, pitch): (f64, f64), phase: f64) -> NodeChannel {
    let steps = 16;
    let times: Vec<f64> = (0..=steps).map(|i| seconds * f64::from(i) / f64::from(steps)).collect();
    let values = times
        .iter()
        .flat_map(|time| {
            let turn = time / seconds * TAU + phase;
            (rest
                * DQuat::from_rotation_x((roll * turn.sin()).to_radians())
                * DQuat::from_rotation_z((pitch * (turn + 1.1).sin()).to_radians()))
            .to_array()
        })
        .collect();
    NodeChannel { target: Target::Rotation(node), times, values }
}

fn heaving(node: usize, rest: DVec3, seconds: f64, by: f64, phase: f64) -> NodeChannel {
    let steps = 16;
    let times: Vec<f64> = (0..=steps).map(|i| seconds * f64::from(i) / f64::from(steps)).collect();
    let values = times
        .iter()
        .flat_map(|time| (rest + DVec3::Y * by * (time / seconds * TAU + phase).sin()).to_array())
        .collect();
    NodeChannel { target: Target::Translation(node), times, values }
}

/// Places of the boats, and the directions of their bows in degrees from +X to -Z.
const FISHING: (DVec3, f64) = (DVec3::new(-11.8, 0.0, 3.0), 176.0);
const SAILING: (DVec3, f64) = (DVec3::new(0.5, 0.0, 11.0), 28.0);

pub fn put_boats(file: &mut Glb, clips: &mut Clips) {
    let fishing = file.mesh("fishing boat", &boats::fishing_boat(), &[]);
    let sailing = file.mesh("sailing boat", &boats::sailing_boat(), &[]);
    let dinghy = file.mesh("dinghy", &boats::dinghy(), &[]);
    let fleet = [
        ("fishing boat", fishing, FISHING.0, FISHING.1, 5.0, (2.2, 0.7), 0.0),
        ("sailing boat", sailing, SAILING.0, SAILING.1, 4.0, (3.0, 0.9), 1.7),
        ("second sailing boat", sailing, DVec3::new(22.5, 0.0, 4.8), 172.0, 4.0, (2.6, 0.8), 3.9),
        ("dinghy", dinghy, DVec3::new(11.6, 0.0, 13.4), 98.0, 3.0, (3.4, 1.5), 0.6),
        ("second dinghy", dinghy, DVec3::new(4.6, 0.0, 1.6), 186.0, 3.0, (3.0, 1.2), 2.4),
        ("far fishing boat", fishing, DVec3::new(-35.0, 0.0, 2.8), 3.0, 5.0, (1.8, 0.6), 2.2),
    ];
    for (name, mesh, place, degrees, seconds, swing, phase) in fleet {
        let frame = turned(place.x, place.y, place.z, degrees);
        let node = file.node(name, None, frame);
        file.put(mesh, Some(node), DAffine3::IDENTITY);
        clips.add("sea", rocking(node, DQuat::from_rotation_y(degrees.to_radians()), seconds, swing, phase));
        clips.add("sea", heaving(node, place, seconds, 0.05, phase + 0.8));
    }
    // A buoy.
    let mut buoy = Model::new();
    let band = |out: DVec3| if (0.05..0.45).contains(&out.y) { colour(0xe4dccc) } else { colour(0xa84a2c) };
    buoy.blob("paint", (DVec3::Y * 0.12, DVec3::new(0.42, 0.4, 0.42)), (20, 24), |_| 0.0, band);
    buoy.tint = DVec3::splat(0.2);
    let ring: Vec<DVec3> = (0..=12)
        .map(|i| (f64::from(i) / 12.0 * TAU).sin_cos())
        .map(|(sin, cos)| DVec3::new(sin * 0.09, 0.58 + cos * 0.09, 0.0))
        .collect();
    buoy.tube("iron", &ring, (0.022, 0.022), 6);
    let mesh = file.mesh("buoy", &buoy, &[]);
    let place = DVec3::new(7.6, 0.0, 21.5);
    let node = file.node("buoy", None, at(place.x, place.y, place.z));
    file.put(mesh, Some(node), DAffine3::IDENTITY);
    clips.add("sea", rocking(node, DQuat::IDENTITY, 3.0, (6.0, 4.0), 0.4));
    // Ropes from the boats to the quay.
    let mut ropes = Model::new();
    ropes.tint = colour(0xc8b088);
    for (from, to) in [
        (DVec3::new(-16.6, 1.55, 2.9), DVec3::new(-20.4, QUAY + 0.35, -0.8)),
        (DVec3::new(-6.7, 1.2, 2.5), DVec3::new(-4.1, QUAY + 0.35, -0.8)),
        (DVec3::new(18.2, 0.95, 5.3), DVec3::new(19.9, QUAY + 0.35, -0.8)),
        (DVec3::new(26.6, 0.8, 4.2), DVec3::new(27.4, QUAY + 0.35, -0.8)),
        (DVec3::new(11.5, 0.55, 11.9), DVec3::new(12.95, PIER_DECK + 0.2, 9.75)),
    ] {
        let path: Vec<DVec3> =
            (0..=8).map(|i| f64::from(i) / 8.0).map(|t| from.lerp(to, t) - DVec3::Y * 0.9 * t * (1.0 - t)).collect();
        ropes.tube("rope", &path, (0.022, 0.022), 5);
    }
    put(file, "ropes", &ropes, DAffine3::IDENTITY);
}

/// A pole with a flag of two shapes, a quarter of a wave apart: weights that go round let the wave run.
pub fn put_flags(file: &mut Glb, clips: &mut Clips) {
    let mut raise = |name: &str, foot: DVec3, tall: f64, size: DVec2, stripes: &[u32], seconds: f64, wind: f64| {
        let stripes: Vec<DVec3> = stripes.iter().map(|&hex| colour(hex)).collect();
        let shape = |amount: f64, phase: f64| things::flag(size, &stripes, (amount, phase));
        let mesh = file.mesh(name, &shape(0.0, 0.0), &[shape(0.3, 0.0), shape(0.3, TAU * 0.25)]);
        let mut pole = Model::new();
        pole.tint = colour(0xe8e4da);
        pole.tube("paint", &[DVec3::ZERO, DVec3::Y * tall], (0.07, 0.035), 8);
        pole.blob("gold", (DVec3::Y * tall, DVec3::splat(0.09)), (10, 6), |_| 0.0, |_| DVec3::ONE);
        put(file, &format!("{name}'s pole"), &pole, at(foot.x, foot.y, foot.z));
        let node = file.put(mesh, None, turned(foot.x, foot.y + tall - 0.15, foot.z, wind));
        let times: Vec<f64> = (0..=12).map(|i| seconds * f64::from(i) / 12.0).collect();
        let values =
            times.iter().flat_map(|time| [(time / seconds * TAU).cos(), (time / seconds * TAU).sin()]).collect();
        clips.add("wind", NodeChannel { target: Target::Weights(node), times, values });
    };
    raise(
        "harbour's flag",
        DVec3::new(-1.2, QUAY, -2.2),
        8.0,
        DVec2::new(2.4, 1.5),
        &[0x1c4a7c, 0xf2efe6, 0xb02a22],
        1.6,
        12.0,
    );
    raise(
        "pier's pennant",
        DVec3::new(PIER.0 + 1.5, PIER_DECK, PIER.1 - 0.3),
        5.0,
        DVec2::new(1.5, 0.8),
        &[0xe0a828, 0x2c5c4a],
        1.2,
        18.0,
    );
}

pub fn put_machines(file: &mut Glb, clips: &mut Clips) {
    let whole = |times: Vec<f64>, degrees: Vec<f64>, node: usize, base: f64| NodeChannel {
        target: Target::Rotation(node),
        values: degrees
            .iter()
            .flat_map(|degrees| DQuat::from_rotation_y((base + degrees).to_radians()).to_array())
            .collect(),
        times,
    };
    // The crane swings from the quay to the boat and back.
    let place = at(CRANE.x, CRANE.y, CRANE.z);
    put(file, "crane's foot", &things::crane_foot(), place);
    let mesh = file.mesh("crane", &things::crane(), &[]);
    let node = file.node("crane", None, place);
    file.put(mesh, Some(node), DAffine3::IDENTITY);
    let swing: Vec<f64> =
        (0..=20).map(|i| f64::from(i) / 20.0).map(|t| -20.0 + 55.0 * (0.5 - 0.5 * (t * TAU).cos())).collect();
    clips.add("crane", whole((0..=20).map(|i| f64::from(i) * 0.8).collect(), swing, node, 0.0));
    // The weather vane follows gusts.
    let mesh = file.mesh("weather vane", &things::vane(), &[]);
    let top = CHURCH + houses::VANE + DVec3::Y * 0.7;
    let node = file.node("weather vane", None, at(top.x, top.y, top.z));
    file.put(mesh, Some(node), DAffine3::IDENTITY);
    let gusts: Vec<f64> =
        (0..=24).map(|i| f64::from(i) / 24.0 * TAU).map(|t| 14.0 + 22.0 * t.sin() + 9.0 * (3.0 * t).sin()).collect();
    clips.add("wind", whole((0..=24).map(|i| f64::from(i) * 0.5).collect(), gusts, node, 0.0));
    // The lens turns with two beams.
    let mesh = file.mesh("lens", &things::lens(), &[]);
    let node = file.node("lens", None, at(LIGHT.x, LIGHT.y + houses::LENS, LIGHT.z));
    file.put(mesh, Some(node), DAffine3::IDENTITY);
    for (name, degrees) in [("beam", 0.0), ("beam behind", 180.0)] {
        let light = json!({"name": name, "type": "spot", "color": [1.0, 0.86, 0.62], "intensity": 60000.0, "range": 220.0,
            "spot": {"innerConeAngle": 0.04, "outerConeAngle": 0.09}});
        file.light(Some(node), turned(0.0, 0.0, 0.0, degrees), light);
    }
    clips.add(
        "lighthouse",
        whole((0..=8).map(f64::from).collect(), (0..=8).map(|i| f64::from(i) * -45.0).collect(), node, 40.0),
    );
}

const CRANE: DVec3 = DVec3::new(-22.5, QUAY, -2.6);

pub fn put_gulls(file: &mut Glb, clips: &mut Clips) {
    let mesh = file.mesh("gull", &things::gull(0.0), &[things::gull(0.34)]);
    let flock = [
        (DVec3::new(-4.0, 9.5, 8.0), 7.0, 9.0, 0.0),
        (DVec3::new(-3.0, 11.0, 6.0), 9.0, 11.0, 0.35),
        (DVec3::new(10.0, 8.0, 12.0), 5.5, 8.0, 0.6),
        (DVec3::new(20.0, 12.5, 2.0), 10.0, 12.0, 0.15),
        (DVec3::new(-18.0, 12.0, 4.0), 8.0, 10.0, 0.8),
        (DVec3::new(30.0, 15.0, -4.0), 12.0, 14.0, 0.5),
        (DVec3::new(4.0, 6.5, 16.0), 6.0, 9.0, 0.9),
        (DVec3::new(-14.0, 7.0, 12.0), 5.0, 8.0, 0.25),
        (DVec3::new(45.0, 19.0, -10.0), 9.0, 11.0, 0.7),
    ];
    for (i, (middle, radius, seconds, phase)) in flock.into_iter().enumerate() {
        let pivot = file.node(&format!("gull {i}"), None, at(middle.x, middle.y, middle.z));
        // Every other one flies the other way; it leans into its turn.
        let way: f64 = if i % 2 == 0 { 1.0 } else { -1.0 };
        let ahead = if way > 0.0 { 0.0 } else { 180.0 };
        let lean = turned(0.0, 0.0, 0.0, ahead) * DAffine3::from_rotation_x((way * -22_f64).to_radians());
        let node = file.put(mesh, Some(pivot), at(0.0, 0.0, radius) * lean);
        let times: Vec<f64> = (0..=8).map(|k| seconds * f64::from(k) / 8.0).collect();
        let turns =
            (0..=8).flat_map(|k| DQuat::from_rotation_y(way * (f64::from(k) / 8.0 + phase) * TAU).to_array()).collect();
        clips.add("gulls", NodeChannel { target: Target::Rotation(pivot), times, values: turns });
        // Beats, then a glide.
        let beats = 24;
        let times: Vec<f64> = (0..=beats * 4).map(|k| seconds * f64::from(k) / f64::from(beats * 4)).collect();
        let count = f64::from(beats) / 9.0 * seconds / 3.0;
        let weights = times
            .iter()
            .map(|time| {
                let t = time / seconds;
                let glide = smooth(0.5, 0.6, t) * (1.0 - smooth(0.92, 1.0, t));
                (1.0 - glide) * (t * TAU * count.round()).sin() + 0.35 * glide
            })
            .collect();
        clips.add("gulls", NodeChannel { target: Target::Weights(node), times, values: weights });
    }
    // One stands on a post.
    let sitting = file.mesh("gull at rest", &resting(), &[]);
    file.put(sitting, None, turned(PIER.0 - 1.57, PIER_DECK + 1.27, 18.6, 215.0));
    file.put(sitting, None, turned(EAST - 0.2, QUAY + 0.2, -0.3, 300.0));
}

/// Wings folded, on two legs.
fn resting() -> Model {
    let mut gull = Model::new();
    let (white, grey) = (colour(0xf4f4f0), colour(0xb4b8bc));
    gull.blob(
        "feather",
        (DVec3::ZERO, DVec3::new(0.24, 0.1, 0.095)),
        (12, 8),
        |out| 0.2 * out.x.max(0.0),
        move |out| if out.y > 0.1 { grey } else { white },
    );
    gull.blob("feather", (DVec3::new(0.2, 0.13, 0.0), DVec3::new(0.08, 0.085, 0.06)), (10, 6), |_| 0.0, move |_| white);
    gull.tint = colour(0xe0a030);
    gull.tube("feather", &[DVec3::new(0.26, 0.13, 0.0), DVec3::new(0.36, 0.11, 0.0)], (0.02, 0.004), 5);
    for side in [-0.04, 0.04] {
        gull.tube("feather", &[DVec3::new(0.0, -0.08, side), DVec3::new(0.0, -0.25, side)], (0.01, 0.01), 4);
    }
    gull.tint = colour(0x2a2a2c);
    gull.tube("feather", &[DVec3::new(-0.15, 0.03, 0.0), DVec3::new(-0.38, 0.0, 0.0)], (0.05, 0.008), 6);
    gull
}
