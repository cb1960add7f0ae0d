//! Deformed meshes and the boxes around them.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DAffine3, DQuat, DVec3, Vec3};
use proptest::prelude::*;

use super::{moved, node};
use crate::motion::*;
use crate::{Aabb, Mesh};

/// Two joints a metre apart, the second one turned; a strip of vertices whose weights go from one to the other.
pub(super) fn strip(weights: &[f32]) -> (Mesh, Motion) {
    let points: Vec<_> = (0..weights.len()).map(|index| DVec3::new(index as f64, 0.0, 0.0)).collect();
    let mut mesh = Mesh::from_points("strip", &points);
    mesh.normals = vec![[0.0, 0.0, 1.0]; points.len()];
    let influences = Influences {
        per_vertex: 4,
        joints: [0, 1, 0, 0].repeat(points.len()),
        weights: weights.iter().flat_map(|&second| [1.0 - second, second, 0.0, 0.0]).collect(),
    };
    mesh.influences = Some(influences);
    let turned = Placement { rotation: DQuat::from_rotation_z(FRAC_PI_2), ..moved(DVec3::X) };
    let nodes = vec![node(None, Placement::default()), node(Some(0), turned)];
    let inverse_bind = vec![DAffine3::IDENTITY, DAffine3::from_translation(DVec3::NEG_X)];
    let skin = Skin { name: "arm".into(), joints: vec![0, 1], inverse_bind };
    (mesh, Motion { nodes, skins: vec![skin], ..Motion::default() })
}

fn place(mesh: &Mesh, vertex: usize) -> DVec3 {
    mesh.origin + Vec3::from(mesh.positions[vertex]).as_dvec3()
}

#[test]
fn joints_blend_linearly_with_weights_that_need_not_sum_to_one() {
    let (mut mesh, motion) = strip(&[0.0, 1.0, 1.0, 0.5]);
    let mut joints = Vec::new();
    motion.pose(&Playing::default()).joint_matrices(&motion, 0, &DAffine3::IDENTITY, &mut joints);
    let expected = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::new(2.0, 1.0, 0.0)];
    // A vertex with almost no weight moves like one with full weight; a vertex with no weight follows its first joint.
    for factor in [1.0, 0.98, 1e-30, f32::MIN_POSITIVE / 64.0] {
        let influences = mesh.influences.as_mut().expect("has joints");
        influences.weights = [[1.0, 0.0], [0.0, 1.0], [0.0, 1.0], [0.5, 0.5]]
            .iter()
            .flat_map(|[a, b]| [a * factor, b * factor, 0.0, 0.0])
            .collect();
        let deformed = deform(&mesh, &[], Some(&joints));
        for (vertex, expected) in expected.iter().enumerate() {
            assert!(place(&deformed, vertex).distance(*expected) < 1e-6, "{factor} {vertex}: {deformed:?}");
        }
        assert!(deformed.is_plain());
    }
    mesh.influences.as_mut().expect("has joints").weights.fill(0.0);
    assert_eq!(place(&deform(&mesh, &[], Some(&joints)), 2), DVec3::new(2.0, 0.0, 0.0));
}

#[test]
fn far_from_the_origin_a_deformed_mesh_keeps_its_shape() {
    let (mesh, mut motion) = strip(&[0.0, 0.25, 0.5, 1.0]);
    let mut near = Vec::new();
    motion.pose(&Playing::default()).joint_matrices(&motion, 0, &DAffine3::IDENTITY, &mut near);
    let far = DVec3::new(3e8, -1e7, 5e6);
    motion.nodes[0].local = Local::Parts(moved(far));
    let mut joints = Vec::new();
    motion.pose(&Playing::default()).joint_matrices(&motion, 0, &DAffine3::IDENTITY, &mut joints);
    let (near, deformed) = (deform(&mesh, &[], Some(&near)), deform(&mesh, &[], Some(&joints)));
    for vertex in 0..4 {
        assert!((place(&deformed, vertex) - far).distance(place(&near, vertex)) < 3e-7);
    }
    // Nothing is far away in a frame that is itself at `far`.
    motion.pose(&Playing::default()).joint_matrices(&motion, 0, &DAffine3::from_translation(far), &mut joints);
    assert!(place(&deform(&mesh, &[], Some(&joints)), 3).distance(place(&near, 3)) < 3e-7);
}

#[test]
fn normals_stay_across_their_triangles_whatever_the_joint_does() {
    let mut mesh = Mesh::from_points("triangle", &[DVec3::ZERO, DVec3::X, DVec3::new(0.2, 1.0, 0.5)]);
    mesh.indices = vec![0, 1, 2];
    mesh.compute_normals();
    mesh.tangents = vec![[1.0, 0.0, 0.0, 1.0]; 3];
    mesh.influences = Some(Influences { per_vertex: 4, joints: vec![0; 12], weights: [1.0, 0.0, 0.0, 0.0].repeat(3) });
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -0.8, 1.9);
    for scale in [DVec3::new(1e-6, 1e6, 1.0), DVec3::new(-1.0, 2.0, 0.5), DVec3::splat(1e-70)] {
        let joint = DAffine3::from_scale_rotation_translation(scale, turn, DVec3::ZERO);
        let deformed = deform(&mesh, &[], Some(&[joint]));
        let [a, b, c] = [0, 1, 2].map(|vertex| joint.transform_point3(place(&mesh, vertex)));
        let side = (b - a) / (b - a).abs().max_element();
        let other = (c - a) / (c - a).abs().max_element();
        let expected = side.cross(other).normalize().as_vec3();
        assert!(
            Vec3::from(deformed.normals[0]).distance(expected) < 1e-5,
            "{scale}: {:?} {expected}",
            deformed.normals
        );
        let [x, y, z, sign] = deformed.tangents[0];
        assert!(Vec3::new(x, y, z).distance(side.normalize().as_vec3()) < 1e-6 && sign == 1.0);
    }
    // Flat joints have no inverse, but normals exist nevertheless.
    let flat = DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.0));
    assert_eq!(deform(&mesh, &[], Some(&[flat])).normals[0], [0.0, 0.0, 1.0]);
    let nothing = deform(&mesh, &[], Some(&[DAffine3::from_scale(DVec3::ZERO)]));
    assert_eq!(nothing.normals, mesh.normals);
}

#[test]
fn shapes_add_up_before_joints_turn_them() {
    let (mut mesh, motion) = strip(&[0.0, 1.0]);
    mesh.uvs = vec![[0.0, 1.0]; 2];
    mesh.colors = vec![[0.5; 4]; 2];
    let up = Morph {
        positions: vec![[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]],
        normals: vec![[1.0, 0.0, -1.0]; 2],
        uvs: vec![[0.5, 0.0]; 2],
        colors: vec![[1.0, 0.25, 0.0, 0.0]; 2],
        ..Morph::default()
    };
    mesh.morphs = vec![up, Morph { positions: vec![[0.0, 0.0, -1.0]; 2], ..Morph::default() }];
    let mut joints = Vec::new();
    motion.pose(&Playing::default()).joint_matrices(&motion, 0, &DAffine3::IDENTITY, &mut joints);
    let deformed = deform(&mesh, &[1.0, 0.5], Some(&joints));
    assert!(place(&deformed, 0).distance(DVec3::new(0.0, 0.0, 0.5)) < 1e-7);
    // The second vertex is moved along its joint's Y, which points along -X.
    assert!(place(&deformed, 1).distance(DVec3::new(0.0, 0.0, -0.5)) < 1e-7);
    assert_eq!((deformed.uvs[0], deformed.colors[0]), ([0.5, 1.0], [1.0, 0.75, 0.5, 0.5]));
    assert!(Vec3::from(deformed.normals[0]).distance(Vec3::X) < 1e-7);
    assert!(Vec3::from(deformed.normals[1]).distance(Vec3::Y) < 1e-7);
}

fn vector(reach: f64) -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-reach..reach).prop_map(DVec3::from)
}

fn rotation() -> impl Strategy<Value = DQuat> {
    (vector(1.0), -PI..PI).prop_map(|(axis, angle)| DQuat::from_axis_angle(axis.normalize_or(DVec3::Y), angle))
}

fn joint() -> impl Strategy<Value = DAffine3> {
    let scale = prop::array::uniform3(prop_oneof![-3.0..3.0, Just(1e-6), Just(1e6), Just(0.0)]);
    (scale, rotation(), vector(100.0)).prop_map(|(scale, rotation, translation)| {
        DAffine3::from_scale_rotation_translation(scale.into(), rotation, translation)
    })
}

prop_compose! {
    /// A cloud of vertices, each on up to four of some joints, with shapes.
    fn cloud()(
        joints in prop::collection::vec(joint(), 1..9),
        points in prop::collection::vec((vector(5.0), prop::array::uniform4((0u16..8, prop_oneof![Just(0.0f32), 0.0f32..1.0]))), 1..40),
        shapes in prop::collection::vec(prop::collection::vec(vector(2.0), 40), 0..4),
        weights in prop::collection::vec(-2.0..2.0f64, 4),
        far in prop_oneof![Just(DVec3::ZERO), vector(1e7)],
    ) -> (Mesh, Vec<DAffine3>, Vec<f64>) {
        let places: Vec<_> = points.iter().map(|(place, _)| *place + far).collect();
        let mut mesh = Mesh::from_points("cloud", &places);
        let count = joints.len() as u16;
        let influences = points.iter().flat_map(|(_, own)| own);
        mesh.influences = Some(Influences {
            per_vertex: 4,
            joints: influences.clone().map(|(joint, _)| joint % count).collect(),
            weights: influences.map(|(_, weight)| *weight).collect(),
        });
        mesh.morphs = shapes.iter().map(|shape| Morph {
            positions: shape[..points.len()].iter().map(|offset| offset.as_vec3().to_array()).collect(),
            ..Morph::default()
        }).collect();
        (mesh, joints, weights)
    }
}

proptest! {
    #[test]
    fn a_box_of_joints_and_shapes_holds_every_vertex_and_little_more((mesh, joints, weights) in cloud()) {
        let deformed = deform(&mesh, &weights, Some(&joints));
        let bounds = DeformBounds::of(&mesh, true).bounds(&joints, &weights);
        // The box is no larger than the box that each vertex can reach by any of its joints and by the shapes in any direction.
        let shaped = deform(&mesh, &weights, None);
        let reach: f64 = weights.iter().zip(&mesh.morphs).map(|(weight, _)| 2.0 * weight.abs()).sum();
        let around = Aabb { min: shaped.bounds.min - 2.0 * reach, max: shaped.bounds.max + 2.0 * reach };
        let largest = joints.iter().fold(Aabb::EMPTY, |all, joint| all.union(&around.transformed(joint)));
        // Joints scale the rounding errors that places have in f64 before they are moved.
        let terms = joints.iter().map(|own| own.matrix3.to_cols_array().map(f64::abs).into_iter().fold(0.0, f64::max));
        let rounded = 1e-14 * terms.fold(1.0, f64::max) * around.min.abs().max(around.max.abs()).max_element();
        let outside = (bounds.min - deformed.bounds.min).max(deformed.bounds.max - bounds.max).max_element();
        prop_assert!(outside <= rounded, "{outside} of {:?} beside {bounds:?}", deformed.bounds);
        let slack = DVec3::splat(1e-5 * largest.size().max_element() + 1e-6 + rounded);
        let largest = Aabb { min: largest.min - slack, max: largest.max + slack };
        prop_assert_eq!(bounds.union(&largest), largest);
    }

    #[test]
    fn the_mean_of_a_mesh_is_that_of_its_vertices((mesh, joints, weights) in cloud()) {
        let deformed = deform(&mesh, &weights, Some(&joints));
        let count = deformed.positions.len() as f64;
        let mean = deformed.origin + deformed.positions.iter().map(|&own| Vec3::from(own).as_dvec3()).sum::<DVec3>() / count;
        let bounds = DeformBounds::of(&mesh, true);
        let found = bounds.mean(&joints, &weights);
        // Vertices are f32 about the middle of their box; in sums, far motions by joints cancel.
        let largest = bounds.bounds(&joints, &weights);
        let slack = 1e-6 * (largest.size().max_element() + 1e-3 * largest.max.abs().max(largest.min.abs()).max_element());
        prop_assert!(found.distance(mean) <= slack, "{found} for {mean}");
    }

    #[test]
    fn a_box_of_one_joint_without_shapes_is_that_of_its_vertices((mut mesh, joints, _) in cloud(), turn in rotation()) {
        mesh.morphs.clear();
        mesh.influences.as_mut().expect("has joints").joints.fill(0);
        let joints = vec![DAffine3::from_quat(turn); joints.len()];
        let bounds = DeformBounds::of(&mesh, true).bounds(&joints, &[]);
        let deformed = deform(&mesh, &[], Some(&joints));
        prop_assert_eq!(bounds.union(&deformed.bounds), bounds);
        // A turned box is at most as wide as its diagonal.
        prop_assert!(bounds.size().max_element() <= mesh.bounds.size().length() * (1.0 + 1e-4) + 1e-6);
    }
}
