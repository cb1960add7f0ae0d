//! Files with faults: each is an error of one line that names the fault, and no change of bytes ends in a panic.

use proptest::prelude::*;
use serde_json::{Value, json};

use super::{Builder, push};
use crate::scene::gltf::{GltfOptions, load};

#[test]
fn counts_offsets_and_numbers_beyond_what_is_there_are_named() {
    type Change = fn(&mut Value);
    let changes: [(Change, &str); 14] = [
        (
            |json| json["accessors"][0]["count"] = json!(4),
            "accessor 0: its 4 elements of 12 bytes from byte 0 on reach past",
        ),
        (|json| json["accessors"][0]["count"] = json!(u64::MAX), "meshes have more than 268435456 vertices"),
        (|json| json["accessors"][0]["count"] = json!(0), "accessor 0: has no elements"),
        (|json| json["accessors"][0]["byteOffset"] = json!(u64::MAX), "reach past"),
        (|json| json["accessors"][0]["bufferView"] = json!(7), "buffer view 7 does not exist: the file has 1"),
        (|json| json["accessors"][0]["componentType"] = json!(5124), "component type is 5124"),
        (|json| json["accessors"][0]["type"] = json!("VEC2"), "its type is VEC2, not VEC3"),
        (|json| json["bufferViews"][0]["byteStride"] = json!(4), "lie 4 bytes apart"),
        (
            |json| json["bufferViews"][0]["byteLength"] = json!(1u64 << 60),
            "reaches from byte 0 to 1152921504606846976 of buffer 0",
        ),
        (|json| json["bufferViews"][0]["buffer"] = json!(1), "buffer 1 does not exist"),
        (|json| json["buffers"] = json!([{"byteLength": 1000}]), "should have 1000 bytes, but only 36 are there"),
        (|json| json["meshes"][0]["primitives"][0]["attributes"] = json!({}), "mesh 0, primitive 0: has no POSITION"),
        (|json| json["meshes"][0]["primitives"][0]["mode"] = json!(9), "its mode is 9"),
        (|json| json["nodes"][0]["mesh"] = json!(3), "node 0 (`it`): mesh 3 does not exist"),
    ];
    for (change, words) in changes {
        let mut file = Builder::triangle();
        change(&mut file.json);
        let error = file.error();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn attributes_of_other_lengths_and_wild_indices_are_named() {
    let mut file = Builder::triangle();
    let normal = file.floats("VEC3", &[0.0, 0.0, 1.0]);
    file.attribute("NORMAL", normal);
    assert!(file.error().contains("NORMAL has 1 elements, but POSITION has 3"));
    let mut file = Builder::triangle();
    let indices = file.shorts("SCALAR", 3, &[0, 1, 3]);
    file.primitive("indices", json!(indices));
    assert!(file.error().contains("index 2 is 3, but there are only 3 vertices"));
    let mut file = Builder::triangle();
    let position = file.floats("VEC3", &[0.0, f32::NAN, 0.0]);
    file.attribute("POSITION", position);
    assert!(file.error().contains("the POSITION of vertex 0 is not finite"));
}

#[test]
fn what_asks_for_a_memory_is_refused() {
    let mut file = Builder::triangle();
    let zeros =
        push(&mut file.json["accessors"], json!({"componentType": 5126, "count": 4_000_000_000u64, "type": "VEC3"}));
    file.attribute("POSITION", zeros);
    assert!(file.error().contains("meshes have more than") || file.error().contains("and no view"), "{}", file.error());
    let mut file = Builder::triangle();
    let primitive = file.json["meshes"][0]["primitives"][0].clone();
    file.json["meshes"] = json!([{"primitives": vec![primitive; 4000]}]);
    file.json["nodes"] = json!((0..4000).map(|_| json!({"mesh": 0})).collect::<Vec<_>>());
    file.json["scenes"][0]["nodes"] = json!((0..4000).collect::<Vec<_>>());
    assert!(file.error().contains("makes more than 4000000 objects"), "{}", file.error());
}

#[test]
fn a_uri_that_leads_out_is_refused_and_data_is_read() {
    let mut file = Builder::triangle();
    file.json["buffers"] = json!([{"byteLength": 36, "uri": "../x.bin"}]);
    assert!(file.error().contains("buffer 0: `../x.bin` leads out"), "{}", file.error());
    let image = "http://example.com/a.png";
    file.json["buffers"] = Value::Null;
    file.json.as_object_mut().expect("a map").remove("buffers");
    file.json["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
    file.json["textures"] = json!([{"source": 0}]);
    file.json["images"] = json!([{"uri": image}]);
    file.primitive("material", json!(0));
    let warnings = file.read().warnings;
    assert!(
        warnings.iter().any(|warning| warning.contains("image 0: `http://example.com/a.png` has a scheme")),
        "{warnings:?}"
    );
}

/// A file with something of everything.
fn whole() -> Vec<u8> {
    let mut file = Builder::triangle();
    let more = file.floats("VEC3", &[0.0, 0.0, 4.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0]);
    let joints = file.shorts("VEC4", 3, &[0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0]);
    let weights = file.floats("VEC4", &[1.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    let (uv, normal) =
        (file.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]), file.floats("VEC3", &[0.0, 0.0, 1.0].repeat(3)));
    let (times, turns) = (file.floats("SCALAR", &[0.0, 1.0]), file.floats("VEC4", &[0.0, 0.0, 0.0, 1.0].repeat(2)));
    let indices = file.shorts("SCALAR", 3, &[0, 1, 2]);
    file.attribute("JOINTS_0", joints)
        .attribute("WEIGHTS_0", weights)
        .attribute("NORMAL", normal)
        .attribute("TEXCOORD_0", uv);
    file.primitive("targets", json!([{"POSITION": more}]))
        .primitive("material", json!(0))
        .primitive("indices", json!(indices));
    let sparse = json!({"count": 1, "indices": {"bufferView": 0, "componentType": 5121}, "values": {"bufferView": 1}});
    file.json["accessors"][0]["sparse"] = sparse;
    file.json["skins"] = json!([{"joints": [1, 2]}]);
    file.json["nodes"] = json!([{"mesh": 0, "skin": 0, "weights": [0.5]}, {"children": [2]}, {"camera": 0}]);
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    file.json["cameras"] = json!([{"orthographic": {"ymag": 1, "znear": 1}}]);
    file.json["materials"] =
        json!([{"normalTexture": {"index": 0}, "extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 1}}}]);
    file.json["textures"] = json!([{"source": 0}]);
    file.json["images"] = json!([{"bufferView": 0}]);
    let channel = json!({"sampler": 0, "target": {"node": 2, "path": "rotation"}});
    file.json["animations"] = json!([{"channels": [channel], "samplers": [{"input": times, "output": turns}]}]);
    file.glb()
}

/// Reads bytes, which may be anything.
fn survives(bytes: &[u8]) -> bool {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.glb");
    std::fs::write(&path, bytes).expect("written");
    match load(&path, &GltfOptions::default()) {
        Ok(found) => {
            let scene_of = |found: crate::scene::Imported| {
                let mut scene = crate::scene::Scene::default();
                found.append_to(&mut scene, glam::DAffine3::IDENTITY);
                scene
            };
            // A file that is read can be drawn.
            assert_eq!(scene_of(found).check().map_err(|error| error.to_string()), Ok(()));
            true
        }
        Err(error) => {
            assert!(!error.to_string().contains('\n'), "{error}");
            false
        }
    }
}

#[test]
fn a_file_with_everything_is_read_and_one_cut_anywhere_is_not() {
    let bytes = whole();
    assert!(survives(&bytes));
    for length in 0..bytes.len() {
        assert!(!survives(&bytes[..length]), "{length}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn changed_bytes_end_in_a_scene_or_an_error(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let mut bytes = whole();
        for (place, byte) in changes {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        survives(&bytes);
    }

    #[test]
    fn changed_digits_end_in_a_scene_or_an_error(changes in prop::collection::vec((any::<prop::sample::Index>(), b'0'..=b'9'), 1..4)) {
        let mut bytes = whole();
        let digits: Vec<usize> = (20..bytes.len()).filter(|&at| bytes[at].is_ascii_digit()).collect();
        for (place, digit) in changes {
            bytes[*place.get(&digits)] = digit;
        }
        survives(&bytes);
    }
}
