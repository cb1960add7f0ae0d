//! Whole scenes: their moments, the choice of clips, and faults that the check refuses.

use std::borrow::Cow;
use std::f64::consts::FRAC_PI_2;

use glam::{DAffine3, DQuat, DVec3, Vec3};

use super::deforming::strip;
use super::{channel, moved, node};
use crate::motion::*;
use crate::{Camera, Light, LightKind, Mesh, NamedCamera, Object, Scene, builtin};

/// A scene in which everything that can move does.
fn moving() -> Scene {
    let mut scene = builtin::open("builtin:spheres?rows=1&columns=2").unwrap();
    let (mesh, mut motion) = strip(&[0.0, 0.5, 1.0]);
    let mesh_index = scene.meshes.len();
    scene.meshes.push(Mesh { indices: vec![0, 1, 2], ..mesh });
    motion.nodes.push(node(None, moved(DVec3::Y)));
    for _ in 0..2 {
        let object = Object::new("arm", mesh_index, 0, DAffine3::IDENTITY);
        scene.objects.push(Object { node: Some(0), skin: Some(0), ..object });
    }
    scene.objects[0].node = Some(2);
    scene.lights = vec![Light::of(LightKind::Directional { direction: DVec3::X }); 2];
    motion.light_nodes = vec![None, Some(2)];
    let camera = Camera::default();
    scene.cameras = vec![NamedCamera { name: "eye".into(), camera, node: Some(2) }];
    scene.looks_through = Some(0);
    let line = |target, values: &[f64]| channel(target, Interpolation::Linear, &[0.0, 2.0], values);
    let channels = vec![
        line(ChannelTarget::Translation(2), &[0.0, 1.0, 0.0, 4.0, 1.0, 0.0]),
        line(ChannelTarget::Light(0, LightValue::Intensity), &[1.0, -3.0]),
        line(ChannelTarget::Camera(0, CameraValue::FovY), &[FRAC_PI_2, 2.0 * FRAC_PI_2]),
        line(ChannelTarget::Material(0, MaterialValue::BaseColor), &[0.0, 0.0, 0.0, 1.0, 2.0, 1.0, 0.5, 1.0]),
        line(ChannelTarget::Material(0, MaterialValue::EmissiveStrength), &[0.0, 8.0]),
    ];
    scene.materials[0].emissive = Vec3::ONE;
    motion.clips = vec![
        Clip { name: "all".into(), channels },
        Clip {
            name: "later".into(),
            channels: vec![line(ChannelTarget::Translation(2), &[0.0, 0.0, 0.0, 0.0, 8.0, 0.0])],
        },
    ];
    scene.motion = motion;
    scene
}

#[test]
fn a_scene_at_a_time_has_everything_where_its_clips_put_it() {
    let scene = moving();
    scene.check().unwrap();
    let first = Playing { clips: ClipChoice::Only(vec![0]), ..Playing::at(1.0) };
    let then = scene.at(&first);
    then.check().unwrap();
    let place = DVec3::new(2.0, 1.0, 0.0);
    assert_eq!(then.objects[0].transform, DAffine3::from_translation(place));
    assert_eq!((then.camera.position, then.cameras[0].camera.position), (place, place));
    let Camera { projection: crate::Projection::Perspective { fov_y_degrees }, .. } = then.camera else {
        panic!("{:?}", then.camera)
    };
    assert!((fov_y_degrees - 135.0).abs() < 1e-9);
    // Values are clamped: a negative intensity becomes 0, and a colour channel is at most 1.
    assert_eq!(then.lights[0].intensity, 0.0);
    assert_eq!(then.lights[1].kind, LightKind::Directional { direction: DVec3::NEG_Z });
    assert_eq!(
        (then.materials[0].base_color, then.materials[0].emissive),
        (Vec3::new(1.0, 0.5, 0.25), Vec3::splat(4.0))
    );
    assert!(then.motion.is_empty() && then.meshes.iter().all(Mesh::is_plain) && then.looks_through.is_none());
    // Each deformed object has a separate mesh.
    let [.., a, b] = &then.objects[..] else { panic!("no objects") };
    assert!(a.mesh != b.mesh && then.meshes[a.mesh].bounds.max.y > 0.9);
    // Later clips win, and no clip is rest.
    let height = |clips| scene.at(&Playing { clips, ..Playing::at(1.0) }).objects[0].transform.translation;
    assert_eq!(height(ClipChoice::All), DVec3::new(0.0, 4.0, 0.0));
    assert_eq!(height(ClipChoice::Only(vec![1, 0])), place);
    assert_eq!(height(ClipChoice::None), DVec3::Y);
    assert!(matches!(then.at(&first), Cow::Borrowed(_)));
}

#[test]
fn a_pose_made_into_another_is_the_same() {
    let scene = moving();
    let mut pose = scene.motion.pose(&Playing::at(0.3));
    scene.motion.pose_into(&Playing::at(1.7), &mut pose);
    assert_eq!(pose, scene.motion.pose(&Playing::at(1.7)));
}

#[test]
fn clips_are_chosen_by_name_and_by_number() {
    let motion = moving().motion;
    let choose = |names: &[&str]| motion.choose(&names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>());
    // The second clip moves the same target as the first.
    assert_eq!(choose(&[]).unwrap(), ClipChoice::Only(vec![0]));
    let mut renamed = motion.clone();
    renamed.clips[0].name = "walk".into();
    assert_eq!(renamed.choose(&["all".into()]).unwrap(), ClipChoice::Only(vec![0, 1]));
    assert_eq!(choose(&["none"]).unwrap(), ClipChoice::None);
    assert_eq!(choose(&["later", "0"]).unwrap(), ClipChoice::Only(vec![1, 0]));
    let error = choose(&["latr"]).unwrap_err().to_string();
    assert_eq!(error, "unknown clip \"latr\": did you mean \"later\"? (possible: all, later, none)");
    assert!(Motion::default().choose(&["x".into()]).unwrap_err().to_string().contains("no clips"));
    assert_eq!((motion.duration(&ClipChoice::All), motion.duration(&ClipChoice::None)), (2.0, 0.0));
}

#[test]
fn each_fault_of_what_moves_has_its_sentence() {
    type MotionEdit<'a> = &'a dyn Fn(&mut Scene);
    let arm = |scene: &Scene| scene.meshes.len() - 1;
    let changes: &[(MotionEdit, &str)] = &[
        (
            &|scene| scene.motion.nodes[0].parent = Some(1),
            "node 0 (`own`): its parent is number 1: parents come before",
        ),
        (
            &|scene| scene.motion.nodes[1].local = Local::Parts(moved(DVec3::NAN)),
            "node 1 (`own`): its translation is not",
        ),
        (
            &|scene| {
                let rotation = DQuat::from_array([0.0; 4]);
                scene.motion.nodes[2].local = Local::Parts(Placement { rotation, ..Placement::default() });
            },
            "node 2 (`own`): its rotation is a quaternion of length 0",
        ),
        (&|scene| scene.motion.skins[0].joints.clear(), "skin 0 (`arm`): it has no joints"),
        (&|scene| scene.motion.skins[0].joints[1] = 77, "skin 0 (`arm`): its joint is number 77"),
        (&|scene| scene.motion.skins[0].inverse_bind.truncate(1), "it has 1 inverse bind matrices for 2 joints"),
        (
            &|scene| scene.motion.clips[0].channels[1].times = vec![0.0, 0.0],
            "clip 0 (`all`): channel 1: key 1 is at 0 s, which is not after the 0 s before it",
        ),
        (&|scene| scene.motion.clips[0].channels[1].times[1] = f64::NAN, "the time of key 1 is not finite"),
        (&|scene| scene.motion.clips[0].channels[0].values[4] = f64::NAN, "channel 0: a value of key 1 is NaN"),
        (
            &|scene| scene.motion.clips[0].channels[0].values.truncate(5),
            "it has 5 values for 2 keys: expected 3 for each",
        ),
        (
            &|scene| scene.motion.clips[1].channels[0].target = ChannelTarget::Scale(9),
            "clip 1 (`later`): channel 0: its node is",
        ),
        (&|scene| scene.motion.clips[1].channels[0].target = ChannelTarget::Weights(0), "which has none"),
        (
            &|scene| scene.motion.nodes[2].local = Local::Fixed(DAffine3::IDENTITY),
            "it moves node 2 (`own`), which stands by one transform",
        ),
        (
            &|scene| {
                let twice = scene.motion.clips[1].channels[0].clone();
                scene.motion.clips[1].channels.push(twice);
            },
            "clip 1 (`later`): two of its channels move Translation(2)",
        ),
        (&|scene| scene.motion.light_nodes = vec![None; 9], "there are nodes for 9 lights, but the scene has 2"),
        (&|scene| scene.motion.light_nodes[1] = Some(9), "light 1 (``): its node is number 9"),
        (&|scene| scene.cameras[0].node = Some(9), "camera 0 (`eye`): its node is number 9"),
        (&|scene| scene.looks_through = Some(1), "what it looks through: its camera is number 1"),
        (&|scene| scene.objects[0].node = Some(9), "): its node is number 9, but the scene has 3"),
        (&|scene| scene.objects[0].skin = Some(0), "it has a skin, but its mesh 0 (`sphere`) has no joints"),
        (
            &|scene| {
                let arm = arm(scene);
                scene.meshes[arm].influences.as_mut().unwrap().joints[3] = 2;
            },
            "(`strip`) hangs on joint 2, but its skin (`arm`) has 2",
        ),
        (
            &|scene| {
                let arm = arm(scene);
                scene.meshes[arm].influences.as_mut().unwrap().weights[4] = 0.9;
            },
            "the weights of vertex 1 are [0.9, 0.5, 0.0, 0.0]: expected none below 0, and a sum of 1",
        ),
        (
            &|scene| scene.meshes[0].morphs = vec![Morph { positions: vec![[0.0; 3]], ..Morph::default() }],
            "mesh 0 (`sphere`): shape 0 (``): it has 1 positions for",
        ),
        (&|scene| scene.meshes[0].colors = vec![[0.0; 4]], "mesh 0 (`sphere`): it has 1 colours for"),
    ];
    for (change, expected) in changes {
        let mut scene = moving();
        change(&mut scene);
        let error = scene.check().expect_err(expected).to_string();
        assert!(error.contains(expected) && !error.contains('\n'), "{error}\nexpected: {expected}");
        // A scene that the check refuses still gives no panic.
        let _ = scene.at(&Playing::at(0.5));
    }
}

#[test]
fn a_material_is_changed_while_a_clip_plays_and_as_it_was_without() {
    let scene = moving();
    let at_rest = Playing { clips: ClipChoice::None, ..Playing::at(0.5) };
    assert_eq!(scene.motion.moved_materials().into_iter().collect::<Vec<_>>(), [0]);
    assert_eq!(scene.motion.pose(&Playing::at(0.5)).material(&scene, 0).emissive, Vec3::splat(2.0));
    assert_eq!(scene.motion.pose(&at_rest).material(&scene, 0), scene.materials[0]);
}
