//! Motion: joints far away, of next to no weight and in long chains, rotations whose keys nearly oppose each other, late keys, and nodes of
//! extreme scales. The truth is a scene that stands still: the same one near the origin, or where a closed form has everything.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::{float32, lamp, sphere_on_floor};
use afterlight::scene::builtin::shapes::{self, MeshBuilder};
use afterlight::scene::builtin::stage::SceneBuilder;
use afterlight::scene::{
    Channel, ChannelTarget, Clip, Influences, Interpolation, Local, Mesh, Node, Placement, Playing, Scene,
    SettingsPatch, Skin, deform, metered_ev100,
};

/// The bound of `space/size` and its kin: SKIN adds roundings of f32 to places and normals, each of 6e-8, which count where light grazes.
const BOUND: Bound = Bound { worst: 2e-4, mean: 1e-6 };
/// The bound of `space/mirrored`: light and eye graze a ring somewhere.
const OF_RING: Bound = Bound { worst: 2e-3, mean: 2e-6 };

pub const CASES: &[Case] = &[
    case(
        "motion/far-joints",
        "a skeleton so far from the origin, with a mesh that was bound at the origin and one that was bound there; the truth stays near",
    )
    .over(SweepValues::Decades(0, 15), "m")
    // From 1e10 m on f64 itself rounds turned places by more than a micrometre.
    .claim([1.0, 1e9], BOUND)
    .check(Check::Placed(far_joints, 0.01)),
    case("motion/weights", "a tube that leans because a joint with at most such a weight has moved by its inverse")
        .over(SweepValues::List(&[1e-45, 1e-42, 1e-40, 1e-38, 1e-36, 1e-30, 1e-20, 1e-12, 1e-9, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0]), "")
        // Smaller weights are no normal numbers of f32, and drivers may flush them to 0.
        .claim([1e-36, 1.0], BOUND)
        .check(Check::Placed(weights, 0.01)),
    case("motion/chain", "a tube on so many joints in a chain that bend it to an arc; the truth has its closed form")
        .over(SweepValues::List(&[1.0, 10.0, 100.0, 1000.0, 10_000.0, 65_535.0]), "")
        .claim([1.0, 65_535.0], BOUND)
        .check(Check::Placed(chain, 0.01)),
    case(
        "motion/opposite-turns",
        "a turn by so much between two keys whose quaternions have opposite signs, three tenths of the way",
    )
    .over(SweepValues::List(&[1e-12, 1e-9, 1e-6, 1e-3, 1.0, 90.0, 179.0, 179.999, 180.0]), "degrees")
    // Half a turn may go either way.
    .claim([1e-12, 179.999], OF_RING)
    .check(Check::Placed(opposite_turns, 0.01)),
    case("motion/late-keys", "keys so late, and a moment between them, in the clip's second round")
        .over(SweepValues::Decades(0, 15), "s")
        // f64 knows times to 1e-16 of them, here to 2e-7 of the second in which all moves by a metre.
        .claim([1.0, 1e9], OF_RING)
        .check(Check::Placed(late_keys, 0.01)),
    case("motion/node-scale", "a node that scales by so much a bent tube and a torus that are as much too small")
        .over(SweepValues::Decades(-12, 12), "")
        .claim([1e-12, 1e12], OF_RING)
        .check(Check::Placed(node_scale, 0.01)),
    case("motion/node-stretch", "a node that scales x by so much, and z by its inverse, over a skinned tube drawn the other way")
        .over(SweepValues::Decades(-12, 12), "")
        .claim([1e-12, 1e12], BOUND)
        .check(Check::Placed(node_stretch, 0.01)),
    case("motion/size", "scene, camera, near plane and lamp so many times as large by a node's scale, beside the origin")
        .over(SweepValues::Decades(-12, 12), "")
        .claim([1e-6, 1e12], OF_RING)
        .check(Check::Placed(size, 0.01)),
];

/// Seconds from the first key of a clip to its last.
const SECONDS: f64 = 2.0;
/// A moment between them that f32 would round.
const SHARE: f64 = 0.3;

/// Tubes are as high as that, and as wide.
const HEIGHT: f64 = 1.5;
const RADIUS: f64 = 0.2;
/// The bend of a tube by its joints from bottom to top, in radians: so little that a clip turns a single joint by less than half a turn.
const BEND: f64 = 0.9;

fn moment() -> Playing {
    Playing { looped: false, ..Playing::at(SHARE * SECONDS) }
}

/// Exposed as the truth is, since frames of a scene that moves are metered at rest.
fn subject(scene: Scene, playing: Playing, truth: Scene) -> Subject {
    let settings = SettingsPatch { exposure: Some(metered_ev100(&truth)), ..float32() };
    Subject { playing: Some(playing), truth: Some(truth), ..Subject::with(scene, settings) }
}

/// The floor alone, under a lamp. The materials are matt (0) and shiny (1).
fn floor() -> SceneBuilder {
    let mut stage = sphere_on_floor();
    stage.scene.objects.truncate(1);
    stage.light(lamp(DVec3::new(1.25, 2.0, 1.0), 1000.0));
    stage
}

const SHINY: usize = 1;

fn tube() -> MeshBuilder {
    let mut tube = MeshBuilder::new();
    let wall: Vec<_> = (0..=40).map(|ring| (RADIUS, HEIGHT * f64::from(ring) / 40.0)).collect();
    tube.lathe(&[&[(0.0, 0.0)], &wall[..], &[(0.0, HEIGHT)]].concat(), 32);
    tube
}

fn at(translation: DVec3) -> Placement {
    Placement { translation, ..Placement::default() }
}

fn node(stage: &mut SceneBuilder, parent: Option<usize>, place: Placement) -> usize {
    let nodes = &mut stage.scene.motion.nodes;
    nodes.push(Node { name: "node".into(), parent, local: Local::Parts(place), weights: Vec::new() });
    nodes.len() - 1
}

/// Adds a channel to the scene's one clip.
fn keys(stage: &mut SceneBuilder, target: ChannelTarget, times: [f64; 2], values: &[f64]) {
    let clips = &mut stage.scene.motion.clips;
    if clips.is_empty() {
        clips.push(Clip { name: "clip".into(), channels: Vec::new() });
    }
    let (times, values) = (times.to_vec(), values.to_vec());
    clips[0].channels.push(Channel { target, times, values, interpolation: Interpolation::Linear });
}

/// For each vertex of a tube on the origin the two joints beside it, and the share of the upper one.
fn shares(mesh: &Mesh, joints: usize) -> Vec<([u16; 2], f64)> {
    let last = joints.saturating_sub(1);
    let of = |position: &[f32; 3]| {
        let y = (mesh.origin.y + f64::from(position[1])) / HEIGHT * joints as f64;
        let below = (y.max(0.0) as usize).min(last);
        ([below as u16, (below + 1).min(last) as u16], (y - below as f64).clamp(0.0, 1.0))
    };
    mesh.positions.iter().map(of).collect()
}

fn influences(shares: &[([u16; 2], f64)]) -> Influences {
    let joints = shares.iter().flat_map(|&([below, above], _)| [below, above, 0, 0]).collect();
    let weights = shares.iter().flat_map(|&(_, share)| [1.0 - share as f32, share as f32, 0.0, 0.0]).collect();
    Influences { per_vertex: 4, joints, weights }
}

/// A tube on a chain of joints.
#[derive(Clone, Copy)]
struct Tube {
    joints: usize,
    /// The node below which the chain begins.
    parent: Option<usize>,
    /// The place of its foot there, in the node's metres.
    foot: DVec3,
    /// The tube's place when it was bound.
    bound_at: DVec3,
    /// A metre of the scene, in units of meshes and nodes.
    metre: DVec3,
    /// The angle by which all joints together turn it about Z.
    bend: f64,
    /// The distance by which all joints together move its top to the right.
    lean: f64,
}

impl Tube {
    const PLAIN: Self = Self {
        joints: 8,
        parent: None,
        foot: DVec3::ZERO,
        bound_at: DVec3::ZERO,
        metre: DVec3::ONE,
        bend: BEND,
        lean: 0.0,
    };

    fn add(&self, stage: &mut SceneBuilder) {
        let &Self { joints, parent, foot, bound_at, metre, bend, lean } = self;
        let mut shape = MeshBuilder::new();
        shape.append(&tube(), &(DAffine3::from_translation(bound_at) * DAffine3::from_scale(metre)));
        let mesh = stage.mesh("tube", shape, SHINY);
        stage.scene.meshes[mesh].influences = Some(influences(&shares(&tube().finish("tube"), joints)));
        let (step, first) = (HEIGHT / joints as f64, stage.scene.motion.nodes.len());
        let mut below = parent;
        for joint in 0..joints {
            let place = if joint == 0 { foot } else { DVec3::new(lean / joints as f64, step, 0.0) };
            let own = node(stage, below, at(place * metre));
            turn(stage, own, bend / joints as f64);
            below = Some(own);
        }
        let bind = |joint: usize| DAffine3::from_translation(DVec3::NEG_Y * (step * metre.y * joint as f64) - bound_at);
        let inverse_bind = (0..joints).map(bind).collect();
        let joints = (first..first + joints).collect();
        stage.scene.motion.skins.push(Skin { name: "tube".into(), joints, inverse_bind });
        stage.place(mesh, SHINY, DAffine3::IDENTITY);
        stage.hang(first, Some(stage.scene.motion.skins.len() - 1));
    }
}

/// Turns a node about Z by `radians` at the moment that is drawn.
fn turn(stage: &mut SceneBuilder, node: usize, radians: f64) {
    let ends = [0.0, radians / SHARE].map(|angle| DQuat::from_rotation_z(angle).to_array());
    keys(stage, ChannelTarget::Rotation(node), [0.0, SECONDS], &ends.concat());
}

/// A ring that a node carries.
fn ring(stage: &mut SceneBuilder, node: usize, metre: DVec3) {
    let mut shape = MeshBuilder::new();
    shape.append(&shapes::torus(0.4, 0.15, 32), &DAffine3::from_scale(metre));
    let mesh = stage.mesh("ring", shape, SHINY);
    stage.place(mesh, SHINY, DAffine3::IDENTITY);
    stage.hang(node, None);
}

fn far_joints(metres: f64) -> Subject {
    let build = |metres: f64| {
        let place = DVec3::new(metres, -metres / 2.0, metres / 4.0).round();
        let mut stage = floor();
        let root = node(&mut stage, None, at(place));
        Tube { parent: Some(root), foot: DVec3::new(-0.5, 0.0, 0.0), ..Tube::PLAIN }.add(&mut stage);
        let there = place + DVec3::new(1.0, 0.0, -0.25);
        Tube { foot: there, bound_at: there, bend: -BEND, ..Tube::PLAIN }.add(&mut stage);
        move_rest(&mut stage.scene, place);
        stage.scene
    };
    subject(build(metres), moment(), build(0.0).into_still(&moment()))
}

/// Moves everything that no joint moves.
fn move_rest(scene: &mut Scene, by: DVec3) {
    scene.objects[0].transform.translation += by;
    for light in &mut scene.lights {
        if let Some(position) = light.kind.place_mut() {
            *position += by;
        }
    }
    scene.camera.position += by;
}

/// The top leans by 0.6 m at any weight. A linear blend of joints that only move leaves normals as they are.
fn weights(most: f64) -> Subject {
    const LEAN: f64 = 0.6;
    let mut stage = floor();
    let mesh = stage.mesh("tube", tube(), SHINY);
    let plain = stage.scene.meshes[mesh].clone();
    let share = |position: &[f32; 3]| (plain.origin.y + f64::from(position[1])) / HEIGHT;
    let hung: Vec<_> = plain.positions.iter().map(|position| ([0, 1], share(position) * most)).collect();
    let own = influences(&hung);
    // The truth uses the weights as rounded to f32.
    let leant: Vec<DVec3> = (0..plain.positions.len())
        .map(|vertex| {
            let [rest, moved] = [0, 1].map(|joint| f64::from(own.weights[vertex * 4 + joint]));
            let place = plain.origin + glam::Vec3::from(plain.positions[vertex]).as_dvec3();
            place + DVec3::X * (LEAN / most * (moved / (rest + moved)))
        })
        .collect();
    stage.scene.meshes[mesh].influences = Some(own);
    let joints = vec![node(&mut stage, None, at(DVec3::ZERO)), node(&mut stage, None, at(DVec3::X * (LEAN / most)))];
    let inverse_bind = vec![DAffine3::IDENTITY; 2];
    stage.scene.motion.skins.push(Skin { name: "two".into(), joints, inverse_bind });
    stage.place(mesh, SHINY, DAffine3::IDENTITY);
    stage.hang(0, Some(0));
    let still = Mesh {
        normals: plain.normals.clone(),
        indices: plain.indices.clone(),
        uvs: plain.uvs.clone(),
        ..Mesh::from_points("tube", &leant)
    };
    let truth = standing(&stage.scene, still);
    subject(stage.scene, moment(), truth)
}

/// The scene with this mesh in place of the one that moves, which is its last.
fn standing(scene: &Scene, still: Mesh) -> Scene {
    let mut truth = scene.clone();
    truth.motion = Default::default();
    if let (Some(mesh), Some(object)) = (truth.meshes.last_mut(), truth.objects.last_mut()) {
        *mesh = still;
        (object.node, object.skin) = (None, None);
    }
    truth
}

/// Joint i is turned by i + 1 parts of the whole, and stands at the end of as many steps, which are a geometric series of complex numbers.
fn chain(joints: f64) -> Subject {
    let mut stage = floor();
    let count = joints as usize;
    Tube { joints: count, ..Tube::PLAIN }.add(&mut stage);
    let (part, step) = (BEND / joints, HEIGHT / joints);
    let joint = |index: usize| {
        let steps = index as f64;
        let (sin, cos) = ((steps + 1.0) * part / 2.0).sin_cos();
        let length = step * (steps * part / 2.0).sin() / (part / 2.0).sin();
        let place = DVec3::new(-sin, cos, 0.0) * length;
        let turned = DAffine3::from_rotation_translation(DQuat::from_rotation_z((steps + 1.0) * part), place);
        turned * DAffine3::from_translation(DVec3::NEG_Y * (step * steps))
    };
    let matrices: Vec<DAffine3> = (0..count).map(joint).collect();
    let still = stage.scene.meshes.last().map(|mesh| deform(mesh, &[], Some(&matrices))).unwrap_or_default();
    let truth = standing(&stage.scene, still);
    subject(stage.scene, moment(), truth)
}

fn opposite_turns(degrees: f64) -> Subject {
    let first = DQuat::from_rotation_x(0.9) * DQuat::from_rotation_y(0.4);
    let by = |share: f64| first * DQuat::from_axis_angle(DVec3::new(0.36, 0.48, 0.8), degrees.to_radians() * share);
    turned(at(DVec3::Y * 0.75), [0.0, SECONDS], [first, -by(1.0)], moment(), by(SHARE))
}

/// A ring whose turn and shift have two keys, and as it is at the moment.
fn turned(place: Placement, times: [f64; 2], ends: [DQuat; 2], playing: Playing, then: DQuat) -> Subject {
    let mut stage = floor();
    let own = node(&mut stage, None, place);
    ring(&mut stage, own, DVec3::ONE);
    let [from, to] = [-0.3, 0.7].map(|x| place.translation + DVec3::X * x);
    keys(&mut stage, ChannelTarget::Rotation(own), times, &ends.map(|end| end.to_array()).concat());
    keys(&mut stage, ChannelTarget::Translation(own), times, &[from, to].map(|end| end.to_array()).concat());
    let mut truth = stage.scene.clone();
    truth.motion = Default::default();
    if let Some(object) = truth.objects.last_mut() {
        object.node = None;
        object.transform = DAffine3::from_rotation_translation(then, from.lerp(to, SHARE));
    }
    subject(stage.scene, playing, truth)
}

fn late_keys(seconds: f64) -> Subject {
    let first = DQuat::from_rotation_x(0.9);
    let by = |share: f64| first * DQuat::from_rotation_z(1.5 * share);
    let times = [seconds + 0.1, seconds + 1.1];
    let second_round = Playing::at(times[1] + times[0] + SHARE);
    turned(at(DVec3::Y * 0.75), times, [first, by(1.0)], second_round, by(SHARE))
}

fn node_scale(factor: f64) -> Subject {
    let build = |factor: f64| {
        let (mut stage, root) = scaled(DVec3::splat(factor), BEND, 0.0);
        let metre = DVec3::splat(1.0 / factor);
        let own = node(&mut stage, Some(root), at(DVec3::new(1.25, 0.5, 0.25) * metre));
        ring(&mut stage, own, metre);
        stage.scene
    };
    subject(build(factor), moment(), build(1.0).into_still(&moment()))
}

/// Joints turn nothing here, since a turn between scales along other axes shears. A ring has no place here either: normals of unskinned meshes are
/// interpolated before the stretch.
fn node_stretch(factor: f64) -> Subject {
    let build = |factor: f64| scaled(DVec3::new(factor, 1.0, 1.0 / factor), 0.0, 0.4).0.scene;
    subject(build(factor), moment(), build(1.0).into_still(&moment()))
}

/// A tube under a node of this scale, smaller by as much, and that node.
fn scaled(scale: DVec3, bend: f64, lean: f64) -> (SceneBuilder, usize) {
    let mut stage = floor();
    let root = node(&mut stage, None, Placement { scale, ..at(DVec3::new(-0.5, 0.0, 0.0)) });
    Tube { parent: Some(root), metre: DVec3::ONE / scale, bend, lean, ..Tube::PLAIN }.add(&mut stage);
    (stage, root)
}

/// Lights grow no stronger within a centimetre, at any size of the lit objects: their intensity keeps a least value.
fn size(factor: f64) -> Subject {
    let mut stage = floor();
    let beside = DVec3::new(0.375, 0.0, -0.375);
    let root = node(&mut stage, None, Placement { scale: DVec3::splat(factor), ..at(beside) });
    Tube { parent: Some(root), foot: DVec3::new(-0.5, 0.0, 0.0), ..Tube::PLAIN }.add(&mut stage);
    let own = node(&mut stage, Some(root), at(DVec3::new(0.75, 0.5, 0.25)));
    ring(&mut stage, own, DVec3::ONE);
    let scene = &mut stage.scene;
    scene.objects[0].transform = DAffine3 { matrix3: DMat3::from_diagonal(DVec3::splat(factor)), translation: beside };
    for light in &mut scene.lights {
        let Some(position) = light.kind.place_mut() else { continue };
        *position = beside + *position * factor;
        light.intensity *= (factor * factor).max(1e-5) as f32;
    }
    scene.camera.position = beside + scene.camera.position * factor;
    scene.camera.near *= factor;
    let truth = stage.scene.at(&moment()).into_owned();
    subject(stage.scene, moment(), truth)
}
