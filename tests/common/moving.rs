//! A scene in which everything moves: a tube that bends by joints, the same through glass, a ball that blends between shapes, a box that turns
//! and mirrors itself, and a lamp on a node, over a floor.

use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    AlphaMode, Channel, ChannelTarget, Clip, ColorSpace, Influences, Interpolation, Local, Material, Mesh, Morph,
    Motion, Node, Object, Placement, Scene, Skin, Texture,
};
use glam::{DAffine3, DQuat, DVec3, Vec3};

use super::stage::{add, lambert, plane, spot, sun};

/// Joints of the tube.
pub const JOINTS: usize = 6;

fn node(name: &str, parent: Option<usize>, translation: DVec3) -> Node {
    let local = Local::Parts(Placement { translation, ..Placement::default() });
    Node { name: name.into(), parent, local, weights: Vec::new() }
}

fn channel(target: ChannelTarget, times: &[f64], values: &[f64]) -> Channel {
    Channel { target, times: times.into(), values: values.into(), interpolation: Interpolation::Linear }
}

/// Hangs each vertex on the two joints beside it along Y, of `JOINTS` that stand a fifth of `height` apart from y = 0 on.
fn hang(mesh: &mut Mesh, height: f64) {
    let mut own = Influences { per_vertex: 4, joints: Vec::new(), weights: Vec::new() };
    for position in &mesh.positions {
        let y = (mesh.origin.y + f64::from(position[1])) / height * (JOINTS - 1) as f64;
        let below = y.floor().clamp(0.0, (JOINTS - 2) as f64);
        let share = (y - below).clamp(0.0, 1.0) as f32;
        own.joints.extend([below as u16, below as u16 + 1, 0, 0]);
        own.weights.extend([1.0 - share, share, 0.0, 0.0]);
    }
    mesh.influences = Some(own);
}

/// The scene at `place`, so that tests can stand it far from the origin.
pub fn moving(place: DVec3) -> Scene {
    let mut scene = plane(lambert(0.6), vec![sun(DVec3::new(0.5, 0.4, 1.0), 3.0), spot(DVec3::Z, 4.0, 20.0, 40.0)]);
    scene.objects[0].transform = DAffine3::from_translation(place - DVec3::Z * 0.6);
    scene.camera.position += place + DVec3::Z;
    scene.lights[1].casts_shadow = true;
    if let Some(position) = scene.lights[1].kind.place_mut() {
        *position = place + DVec3::new(0.6, 0.5, 1.0);
    }
    let bumps = Texture {
        name: "bumps".into(),
        size: [4, 4],
        color_space: ColorSpace::Linear,
        sampler: Default::default(),
        texels: (0..16u32)
            .flat_map(|i| [(100 + 50 * (i % 2)) as u8, (150 - 40 * (i / 4 % 2)) as u8, 240, 255])
            .collect(),
    };
    scene.textures.push(bumps);
    let bumpy = Material { normal_texture: Some(0), ..lambert(0.8) };
    let height = 1.0;
    let mut tube = shapes::MeshBuilder::new();
    let wall: Vec<_> = (0..=20).map(|ring| (0.12, height * f64::from(ring) / 20.0)).collect();
    tube.lathe(&[&[(0.0, 0.0)], &wall[..], &[(0.0, height)]].concat(), 24);
    add(&mut scene, tube, bumpy, DAffine3::IDENTITY);
    let mesh = scene.meshes.last_mut().expect("just added");
    mesh.compute_tangents();
    hang(mesh, height);
    let tube = scene.meshes.len() - 1;
    let glass =
        Material { alpha: 0.4, alpha_mode: AlphaMode::Blend, base_color: Vec3::new(0.9, 0.3, 0.2), ..lambert(0.5) };
    scene.materials.push(glass);
    scene.objects.push(Object::new("glass tube", tube, scene.materials.len() - 1, DAffine3::IDENTITY));
    add(&mut scene, shapes::sphere(0.2, 16), lambert(0.7), DAffine3::IDENTITY);
    let ball = scene.meshes.last_mut().expect("just added");
    let stretched = |scale: Vec3| ball.positions.iter().map(|&p| (Vec3::from(p) * scale).to_array()).collect();
    ball.morphs = vec![
        Morph { name: "tall".into(), positions: stretched(Vec3::new(0.0, 1.0, 0.0)), ..Morph::default() },
        Morph { name: "wide".into(), positions: stretched(Vec3::new(0.8, -0.4, 0.0)), ..Morph::default() },
    ];
    add(&mut scene, shapes::cuboid([0.25; 3]), lambert(0.5), DAffine3::IDENTITY);
    scene.motion = motion(place, height);
    let ends = [(1, None, Some(0)), (2, None, Some(1)), (3, Some(2), None), (4, Some(3), None)];
    for (object, node, skin) in ends {
        (scene.objects[object].node, scene.objects[object].skin) = (node, skin);
    }
    scene.motion.light_nodes = vec![None, Some(4)];
    let rest = scene
        .motion
        .pose(&afterlight::scene::Playing { clips: afterlight::scene::ClipChoice::None, ..Default::default() });
    for index in [3, 4] {
        scene.objects[index].transform = rest.object_transform(&scene.objects[index]);
    }
    scene.name = "moving".into();
    scene
}

fn motion(place: DVec3, height: f64) -> Motion {
    let step = height / (JOINTS - 1) as f64;
    let mut nodes = vec![node("place", None, place), node("other tube", Some(0), DVec3::new(0.55, -0.5, 0.1))];
    nodes.push(Node { weights: vec![0.25, 0.0], ..node("ball", Some(0), DVec3::new(-0.6, 0.45, 0.2)) });
    nodes.push(node("box", Some(0), DVec3::new(0.3, 0.5, 0.0)));
    nodes.push(node("lamp", Some(0), DVec3::new(0.0, 0.4, 1.2)));
    let mut channels = vec![
        channel(ChannelTarget::Weights(2), &[0.0, 1.0, 2.0], &[0.0, 0.0, 1.0, 0.25, 0.0, 1.0]),
        channel(ChannelTarget::Scale(3), &[0.0, 2.0], &[1.0, 1.0, 1.0, -1.5, 1.0, 0.5]),
        channel(ChannelTarget::Translation(4), &[0.0, 2.0], &[-0.5, 0.4, 1.2, 0.6, -0.2, 1.0]),
    ];
    let turned = |axis: DVec3, angle: f64| DQuat::from_axis_angle(axis, angle).to_array();
    let quarter = [turned(DVec3::Z, 0.0), turned(DVec3::new(0.6, 0.8, 0.0), 2.0)].concat();
    channels.push(channel(ChannelTarget::Rotation(3), &[0.0, 2.0], &quarter));
    let mut skins = Vec::new();
    for (tube, parent, start) in [(0, 0, DVec3::new(-0.2, -0.7, 0.1)), (1, 1, DVec3::ZERO)] {
        let first = nodes.len();
        for joint in 0..JOINTS {
            let (parent, at) = if joint == 0 { (parent, start) } else { (first + joint - 1, DVec3::Y * step) };
            nodes.push(node(&format!("joint {joint} of tube {tube}"), Some(parent), at));
            let bent = [turned(DVec3::Z, 0.0), turned(DVec3::new(0.3, 0.2, 1.0).normalize(), 0.35)].concat();
            channels.push(channel(ChannelTarget::Rotation(first + joint), &[0.0, 2.0], &bent));
        }
        let bind = |joint: usize| DAffine3::from_translation(DVec3::NEG_Y * (step * joint as f64));
        skins.push(Skin {
            name: format!("tube {tube}"),
            joints: (first..first + JOINTS).collect(),
            inverse_bind: (0..JOINTS).map(bind).collect(),
        });
    }
    Motion { nodes, skins, clips: vec![Clip { name: "dance".into(), channels }], light_nodes: Vec::new() }
}

/// Seconds that the clip lasts.
pub const SECONDS: f64 = 2.0;
