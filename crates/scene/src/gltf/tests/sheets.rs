//! Triangles back to back.

use serde_json::{Value, json};

use super::{GltfBuilder, push};
use crate::Imported;

/// A mesh of primitives on one square, each of these indices and in this material; both have two sides.
fn square(primitives: &[(&[u16], usize)]) -> GltfBuilder {
    let mut file = GltfBuilder::new();
    let position = file.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
    let own: Vec<Value> = primitives
        .iter()
        .map(|(indices, material)| {
            let indices = file.shorts("SCALAR", indices.len(), indices);
            json!({"attributes": {"POSITION": position}, "indices": indices, "material": material})
        })
        .collect();
    file.json["meshes"] = json!([{"primitives": own}]);
    file.json["materials"] = json!([{"name": "page", "doubleSided": true}, {"name": "back", "doubleSided": true}]);
    file
}

/// By object, its material's name, whether it has two sides, and its triangles.
fn drawn(found: &Imported) -> Vec<(&str, bool, usize)> {
    let of = |object: &crate::Object| {
        let material = &found.materials[object.material];
        (material.name.as_str(), material.two_sided, found.meshes[object.mesh].indices.len() / 3)
    };
    found.objects.iter().map(of).collect()
}

#[test]
fn triangles_back_to_back_have_one_side_each_and_others_keep_both() {
    let front: &[u16] = &[0, 1, 2, 0, 2, 3];
    let back: &[u16] = &[2, 1, 0, 3, 2, 0];
    assert_eq!(drawn(&square(&[(front, 0), (back, 1)]).read()), [("page", false, 2), ("back", false, 2)]);
    // Only one triangle of the square has a back face with another material.
    let half = square(&[(front, 0), (&back[..3], 1)]).read();
    assert_eq!(drawn(&half), [("page", true, 1), ("back", false, 1), ("page", false, 1)]);
    // Another diagonal, the same side twice, and another place.
    assert_eq!(drawn(&square(&[(front, 0), (&[1, 0, 3, 1, 3, 2], 1)]).read()), [("page", true, 2), ("back", true, 2)]);
    assert_eq!(drawn(&square(&[(front, 0), (front, 1)]).read()), [("page", true, 2), ("back", true, 2)]);
    let mut apart = square(&[(front, 0)]);
    let other = square(&[(front, 0), (back, 1)]).json["meshes"][0]["primitives"][1].clone();
    let mut other = other;
    other["indices"] = json!(apart.shorts("SCALAR", 6, back));
    push(&mut apart.json["meshes"], json!({"primitives": [other]}));
    apart.json["nodes"] = json!([{"mesh": 0}, {"mesh": 1, "translation": [0, 0, 1]}]);
    apart.json["scenes"] = json!([{"nodes": [0, 1]}]);
    assert_eq!(drawn(&apart.read()), [("page", true, 2), ("back", true, 2)]);
    apart.json["nodes"][1]["translation"] = json!([0, 0, 0]);
    assert_eq!(drawn(&apart.read()), [("page", false, 2), ("back", false, 2)]);
}
