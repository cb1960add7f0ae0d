//! Attributes and indices, and the meshes that are made of them.

use glam::{DVec3, Vec3};
use serde_json::json;

use super::{GltfBuilder, push};
use crate::{CastsShadow, Imported, Mesh, Object};

fn mesh(file: &GltfBuilder) -> Mesh {
    file.read().meshes.remove(0)
}

#[test]
fn a_triangle_without_normals_is_flat_and_counter_clockwise() {
    let found = mesh(&GltfBuilder::triangle());
    assert_eq!((found.positions.len(), &found.indices), (3, &vec![0, 1, 2]));
    assert_eq!(found.normals, [[0.0, 0.0, 1.0]; 3]);
    assert!(found.uvs.is_empty() && found.tangents.is_empty() && found.colors.is_empty() && found.morphs.is_empty());
}

#[test]
fn normalized_and_plain_integers_and_strides_are_read() {
    let mut file = GltfBuilder::new();
    // Positions of signed bytes, 4 bytes apart, normalized.
    let view = file.view(&[0i8, 0, 0, 9, 127, 0, 0, 9, 0, -128, -127, 9].map(|byte| byte as u8));
    file.json["bufferViews"][view]["byteStride"] = json!(4);
    let accessor = json!({"bufferView": view, "componentType": 5120, "normalized": true, "count": 3, "type": "VEC3"});
    let position = push(&mut file.json["accessors"], accessor);
    file.json["meshes"] = json!([{"primitives": [{"attributes": {"POSITION": position}}]}]);
    assert_eq!(mesh(&file).positions, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, -1.0, -1.0]]);
    file.json["accessors"][position]["normalized"] = json!(false);
    assert_eq!(mesh(&file).positions[2], [0.0, -128.0, -127.0]);
}

#[test]
fn accessors_without_a_view_are_zeros_under_what_is_sparse() {
    let mut file = GltfBuilder::triangle();
    let (indices, values) = (
        file.view(&[1, 2]),
        file.view(&[[2.0f32, 0.0, 0.0], [0.0, 3.0, 0.0]].map(|v| v.map(f32::to_le_bytes)).as_flattened().concat()),
    );
    let sparse = json!({"count": 2, "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": values}});
    let accessor =
        push(&mut file.json["accessors"], json!({"componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse}));
    file.attribute("POSITION", accessor);
    assert_eq!(mesh(&file).positions, [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]]);
}

#[test]
fn all_modes_are_triangles_or_strokes() {
    let mut file = GltfBuilder::new();
    let corners = [[0.0f32, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|[x, y]| [x, y, 0.0]);
    let position = file.floats("VEC3", corners.as_flattened());
    let modes: Vec<_> = (0..7).map(|mode| json!({"attributes": {"POSITION": position}, "mode": mode})).collect();
    file.json["meshes"] = json!([{"primitives": modes}]);
    let found = file.read();
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    let meshes: Vec<&Mesh> = found.objects.iter().map(|own| &found.meshes[own.mesh]).collect();
    assert!(meshes[..4].iter().all(|mesh| mesh.is_strokes) && meshes[4..].iter().all(|mesh| !mesh.is_strokes));
    let strokes: Vec<usize> = meshes.iter().map(|mesh| mesh.strokes().count()).collect();
    assert_eq!(strokes, [4, 2, 4, 3, 0, 0, 0]);
    let triangles: Vec<usize> = meshes.iter().map(|mesh| mesh.indices.len() / 3).collect();
    assert_eq!(triangles, [8, 4, 8, 6, 1, 2, 2]);
    let ends = |mesh: &Mesh| -> Vec<[[f32; 3]; 2]> {
        mesh.strokes().map(|ends| ends.map(|end| mesh.positions[end])).collect()
    };
    assert_eq!(ends(meshes[0])[1], [corners[1]; 2]);
    assert_eq!(ends(meshes[2]), [[0, 1], [1, 2], [2, 3], [3, 0]].map(|own| own.map(|end: usize| corners[end])));
    // Points and lines without normals are unlit, and a one-pixel line has no width that could cast a shadow.
    let is_unlit = |own: &Object| found.materials[own.material].unlit;
    assert_eq!(found.objects.iter().map(is_unlit).collect::<Vec<_>>(), [true, true, true, true, false, false, false]);
    assert!(found.objects[..4].iter().all(|own| own.casts_shadow == CastsShadow::No));
}

#[test]
fn lines_keep_their_attributes_and_are_lit_by_their_normals() {
    let mut file = GltfBuilder::new();
    let position = file.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0]);
    let normal = file.floats("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    let color = file.floats("VEC3", &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    let attributes = json!({"POSITION": position, "NORMAL": normal, "COLOR_0": color});
    file.json["meshes"] = json!([{"primitives": [{"attributes": attributes, "mode": 3}]}]);
    let found = file.read();
    let mesh = &found.meshes[0];
    assert_eq!(mesh.positions.len(), 12);
    for [first, last] in mesh.strokes() {
        assert_eq!(mesh.positions[first][0] + 1.0, mesh.positions[last][0]);
        let red = |vertex: usize| 1.0 - mesh.positions[vertex][0].min(1.0);
        assert_eq!([first, last].map(|vertex| mesh.colors[vertex][0]), [first, last].map(red));
    }
    assert_eq!(mesh.normals[0], [0.0, 0.0, 1.0]);
    assert_eq!(mesh.normals[7], [0.0, 1.0, 0.0]);
    assert!(
        found.warnings[0].contains("normals have no length or are not finite, taken for +Y"),
        "{:?}",
        found.warnings
    );
    assert!(!found.materials[found.objects[0].material].unlit);
}

#[test]
fn lines_of_a_skin_and_of_shapes_keep_both_ends_together() {
    let mut file = GltfBuilder::new();
    let position = file.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    let moved = file.floats("VEC3", &[0.0, 1.0, 0.0, 0.0, 3.0, 0.0]);
    let targets = json!([{"POSITION": moved}]);
    let primitive = json!({"attributes": {"POSITION": position}, "mode": 1, "targets": targets});
    file.json["meshes"] = json!([{"primitives": [primitive], "weights": [0.5]}]);
    let found = file.read();
    let mesh = &found.meshes[0];
    let place = |vertex: usize| mesh.origin + Vec3::from(mesh.positions[vertex]).as_dvec3();
    assert_eq!(place(0), DVec3::new(0.0, 0.5, 0.0));
    assert_eq!(place(1), DVec3::new(1.0, 1.5, 0.0));
    assert_eq!(mesh.strokes_fault(), None);
}

#[test]
fn equal_primitives_of_several_nodes_and_meshes_are_one_mesh() {
    let mut file = GltfBuilder::triangle();
    let primitive = file.json["meshes"][0]["primitives"][0].clone();
    file.json["materials"] = json!([{"name": "a"}, {"name": "b"}]);
    let mut dressed = primitive.clone();
    dressed["material"] = json!(1);
    file.json["meshes"] = json!([{"primitives": [primitive.clone(), dressed]}, {"primitives": [primitive]}]);
    file.json["nodes"] =
        json!([{"children": [1, 2]}, {"mesh": 0, "translation": [5, 0, 0]}, {"mesh": 1, "scale": [-1, 1, 1]}]);
    let Imported { objects, meshes, materials, motion, .. } = file.read();
    assert_eq!((objects.len(), meshes.len(), materials.len()), (3, 1, 2));
    assert_eq!(objects[0].transform.translation, DVec3::new(5.0, 0.0, 0.0));
    assert!(objects[2].transform.matrix3.determinant() < 0.0 && motion.is_empty());
}

#[test]
fn positions_are_exact_and_recentred_only_far_from_zero() {
    let mut file = GltfBuilder::triangle();
    assert_eq!(mesh(&file).origin, DVec3::ZERO);
    let base = 4_194_304.0f32;
    let position = file.floats("VEC3", &[base, 0.0, 0.0, base + 1.0, 0.0, 0.0, base, 0.5, 0.0]);
    file.attribute("POSITION", position);
    let found = mesh(&file);
    assert!(found.origin.x > 4e6 && found.bounds.contains_all(&found));
    let place = |vertex: usize| found.origin + Vec3::from(found.positions[vertex]).as_dvec3();
    assert_eq!((place(1) - place(0), place(0).x), (DVec3::X, f64::from(base)));
}

impl crate::Aabb {
    fn contains_all(&self, mesh: &Mesh) -> bool {
        self.union(&mesh.compute_bounds()) == *self
    }
}

#[test]
fn odd_normals_tangents_and_colours_are_mended_with_a_warning() {
    let mut file = GltfBuilder::triangle();
    let normal = file.floats("VEC3", &[0.0, 0.0, 0.0, 0.0, 0.0, 2.0, f32::NAN, 0.0, 1.0]);
    let color = file.floats("VEC4", &[1.0, 0.5, 0.0, 1.0, f32::INFINITY, 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 1.0]);
    file.attribute("NORMAL", normal).attribute("COLOR_0", color);
    let found = file.read();
    assert_eq!(found.meshes[0].normals, [[0.0, 0.0, 1.0]; 3]);
    assert_eq!(found.meshes[0].colors, [[1.0, 0.5, 0.0, 1.0], [1.0; 4], [0.0, 0.0, 0.0, 1.0]]);
    assert_eq!(found.warnings.len(), 3, "{:?}", found.warnings);
    assert!(found.warnings.iter().all(|warning| warning.contains(": mesh 0, primitive 0: ")));
}

#[test]
fn colours_of_three_shorts_have_alpha_one() {
    let mut file = GltfBuilder::triangle();
    let color = file.shorts("VEC3", 3, &[65535, 0, 0, 0, 65535, 0, 0, 0, 65535]);
    file.json["accessors"][color]["normalized"] = json!(true);
    file.attribute("COLOR_0", color);
    assert_eq!(mesh(&file).colors[1], [0.0, 1.0, 0.0, 1.0]);
}

#[test]
fn colours_of_whole_numbers_that_are_not_marked_are_shares_of_the_largest() {
    let mut file = GltfBuilder::triangle();
    let wide = file.shorts("VEC3", 3, &[65535, 0, 0, 0, 65535, 0, 0, 0, 65535]);
    let narrow = file.accessor("VEC4", 5121, 3, &[255, 0, 0, 255, 0, 51, 0, 255, 0, 0, 255, 102]);
    let flags = file.accessor("VEC4", 5121, 3, &[1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1]);
    for (accessor, second, third, odd) in [
        (wide, [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0], 1),
        (narrow, [0.0, 0.2, 0.0, 1.0], [0.0, 0.0, 1.0, 0.4], 1),
        (flags, [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0], 0),
    ] {
        file.attribute("COLOR_0", accessor);
        let found = file.read();
        assert_eq!(found.meshes[0].colors[1..], [second, third]);
        let told =
            found.warnings.iter().filter(|own| own.contains("COLOR_0: its whole numbers are not marked as normalized"));
        assert_eq!((told.count(), found.warnings.len()), (odd, odd), "{:?}", found.warnings);
    }
}

#[test]
fn instances_are_objects() {
    let mut file = GltfBuilder::triangle();
    let translation = file.floats("VEC3", &[1.0, 0.0, 0.0, 2.0, 0.0, 0.0]);
    let scale = file.floats("VEC3", &[1.0, 1.0, 1.0, 3.0, 3.0, 3.0]);
    file.json["nodes"][0]["translation"] = json!([0, 7, 0]);
    file.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": translation, "SCALE": scale}}});
    let found = file.read();
    assert_eq!((found.objects.len(), found.meshes.len()), (2, 1));
    let last = &found.objects[1].transform;
    assert_eq!((last.translation, last.matrix3.x_axis.x), (DVec3::new(2.0, 7.0, 0.0), 3.0));
}

#[test]
fn static_weights_of_shapes_are_blended_in() {
    let mut file = GltfBuilder::triangle();
    let more = file.floats("VEC3", &[0.0, 0.0, 4.0, 0.0, 0.0, 4.0, 0.0, 0.0, 4.0]);
    file.primitive("targets", json!([{"POSITION": more}]));
    assert_eq!(place(&mesh(&file), 0), DVec3::ZERO);
    file.json["meshes"][0]["weights"] = json!([0.25]);
    assert_eq!(place(&mesh(&file), 0), DVec3::new(0.0, 0.0, 1.0));
    file.json["nodes"][0]["weights"] = json!([0.5]);
    let found = file.read();
    assert_eq!(place(&found.meshes[0], 2), DVec3::new(0.0, 1.0, 2.0));
    assert!(found.meshes[0].morphs.is_empty() && found.motion.is_empty() && found.objects[0].node.is_none());
}

#[test]
fn shapes_and_instances_that_cannot_be_read_cost_themselves_alone() {
    let mut file = GltfBuilder::triangle();
    let (good, short) = (file.floats("VEC3", &[0.0, 0.0, 4.0].repeat(3)), file.floats("VEC3", &[0.0, 9.0, 0.0]));
    file.primitive("targets", json!([{"POSITION": short}, {"POSITION": good, "NORMAL": 77}, {}]));
    file.json["meshes"][0]["weights"] = json!([1, 0.25, 1, 1, 1]);
    let found = file.read();
    assert_eq!(place(&found.meshes[0], 0), DVec3::new(0.0, 0.0, 1.0));
    assert!(
        found.warnings[0].contains("target 0: POSITION has 1 elements, but POSITION has 3: left out"),
        "{:?}",
        found.warnings
    );
    let mut file = GltfBuilder::triangle();
    let translation = file.floats("VEC3", &[1.0, 0.0, 0.0, f32::NAN, 0.0, 0.0, 3.0, 0.0, 0.0]);
    let scale = file.floats("VEC3", &[1.0; 6]);
    let attributes = json!({"TRANSLATION": translation, "SCALE": scale, "ROTATION": 99});
    file.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": attributes}});
    let found = file.read();
    assert_eq!(found.objects.iter().map(|own| own.transform.translation.x).collect::<Vec<_>>(), [1.0]);
    for words in [
        "instances: ROTATION: accessor 99 does not exist",
        "different counts: the first 2",
        "the transform of instance 1",
    ] {
        assert!(found.warnings.iter().any(|own| own.contains(words)), "{words}: {:?}", found.warnings);
    }
}

fn place(mesh: &Mesh, vertex: usize) -> DVec3 {
    mesh.origin + Vec3::from(mesh.positions[vertex]).as_dvec3()
}

/// A triangle on two joints that stand still.
fn hung() -> GltfBuilder {
    let mut file = GltfBuilder::triangle();
    let joints = file.shorts("VEC4", 3, &[0, 1, 9, 9, 0, 1, 9, 9, 1, 0, 9, 9]);
    let weights = file.floats("VEC4", &[1.0, 0.0, 0.0, 0.0, 0.25, 0.25, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0]);
    file.attribute("JOINTS_0", joints).attribute("WEIGHTS_0", weights);
    file.json["skins"] = json!([{"joints": [1, 2]}]);
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    file.json["nodes"] = json!([
        {"mesh": 0, "skin": 0, "translation": [100, 0, 0]},
        {"children": [2], "translation": [0, 0, 2]},
        {"translation": [0, 10, 0]},
    ]);
    file
}

#[test]
fn a_skin_whose_joints_stand_still_is_hung_on_them() {
    let found = hung().read();
    assert!(found.motion.is_empty() && found.meshes[0].influences.is_none() && found.objects[0].skin.is_none());
    let place = |vertex| place(&found.meshes[0], vertex);
    // Joints place the mesh; its own node is ignored.
    assert_eq!(
        (place(0), place(1), place(2)),
        (DVec3::new(0.0, 0.0, 2.0), DVec3::new(1.0, 5.0, 2.0), DVec3::new(0.0, 11.0, 2.0))
    );
}

#[test]
fn joints_that_mirror_leave_fronts_in_front() {
    let mut file = hung();
    file.json["nodes"][1]["scale"] = json!([1, 1, -2]);
    let found = file.read();
    let (mesh, transform) = (&found.meshes[0], found.objects[0].transform);
    let corners = [0, 1, 2].map(|vertex| transform.transform_point3(place(mesh, vertex)));
    assert_eq!(corners, [DVec3::new(0.0, 0.0, 2.0), DVec3::new(1.0, 5.0, 2.0), DVec3::new(0.0, 11.0, 2.0)]);
    // The object mirrors, so the triangle's front lies along its normal, which is here reversed along z.
    assert!(transform.matrix3.determinant() < 0.0);
    assert_eq!(transform.matrix3 * Vec3::from(mesh.normals[0]).as_dvec3(), DVec3::NEG_Z);
}

#[test]
fn shapes_that_move_on_joints_that_stand_still_stay_in_the_space_of_their_mesh() {
    let mut file = hung();
    let more = file.floats("VEC3", &[1.0; 9]);
    file.primitive("targets", json!([{"POSITION": more}]));
    let (times, weights) = (file.floats("SCALAR", &[0.0, 1.0]), file.floats("SCALAR", &[0.0, 1.0]));
    file.json["animations"] = json!([{
        "samplers": [{"input": times, "output": weights}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}],
    }]);
    let found = file.read();
    assert_eq!((found.objects[0].skin, found.motion.skins.len()), (Some(0), 1));
    assert_eq!((place(&found.meshes[0], 0), found.meshes[0].morphs.len()), (DVec3::ZERO, 1));
}
