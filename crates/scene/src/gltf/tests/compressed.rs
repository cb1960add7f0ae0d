//! Compressed geometry and textures, made by other encoders.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::Vec3;
use proptest::prelude::*;
use serde_json::{Value, json};

use super::{GltfBuilder, encoded, push};
use crate::gltf::ktx::KtxHeader;
use crate::gltf::{basis, draco};
use crate::{BlockFormat, Imported, Texels, Texture};

/// Vertices of the grid: 5 x 5, a metre apart, x y / 8 deep.
const GRID: usize = 25;

fn bytes(text: &str) -> Vec<u8> {
    STANDARD.decode(text).expect("base64")
}

fn place(vertex: usize) -> Vec3 {
    let (x, y) = ((vertex % 5) as f32, (vertex / 5) as f32);
    Vec3::new(x, y, x * y / 8.0)
}

/// A grid compressed by Draco; its accessors have no buffer views.
fn dracoed(data: &str) -> GltfBuilder {
    let mut file = GltfBuilder::new();
    let view = file.view(&bytes(data));
    let bare = |kind: &str| json!({"componentType": 5126, "count": GRID, "type": kind});
    for kind in ["VEC3", "VEC3", "VEC2"] {
        push(&mut file.json["accessors"], bare(kind));
    }
    push(&mut file.json["accessors"], json!({"componentType": 5123, "count": 96, "type": "SCALAR"}));
    let ids = json!({"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2});
    let packed = json!({"KHR_draco_mesh_compression": {"bufferView": view, "attributes": ids}});
    let own = json!({"attributes": ids, "indices": 3, "material": 0, "extensions": packed});
    file.json["meshes"] = json!([{"primitives": [own]}]);
    file.json["materials"] = json!([{"normalTexture": {"index": 0}}]);
    file.json["textures"] = json!([{"source": 0}]);
    file.json["images"] = json!([{"uri": "data:,x"}]);
    file.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    file
}

#[test]
fn draco_gives_the_grid_that_went_in() {
    for data in [encoded::EDGEBREAKER, encoded::SEQUENTIAL] {
        let mesh = dracoed(data).read().meshes.remove(0);
        assert_eq!((mesh.positions.len(), mesh.indices.len()), (GRID, 96));
        for ((position, normal), uv) in mesh.positions.iter().zip(&mesh.normals).zip(&mesh.uvs) {
            let found = Vec3::from(*position);
            let expected = place((found.y.round() * 5.0 + found.x.round()) as usize);
            assert!(found.distance(expected) < 1e-3 && normal[2] > 0.999, "{found} {normal:?}");
            assert!((uv[0] * 4.0 - found.x).abs() < 2e-3 && (uv[1] * 4.0 - found.y).abs() < 2e-3, "{found} {uv:?}");
        }
        let area: f32 = mesh
            .indices
            .as_chunks::<3>()
            .0
            .iter()
            .map(|corners| {
                let [a, b, c] = corners.map(|corner| Vec3::from(mesh.positions[corner as usize]).truncate());
                0.5 * (b - a).perp_dot(c - a)
            })
            .sum();
        assert!((area - 16.0).abs() < 1e-2, "{area}");
    }
}

#[test]
fn draco_data_that_is_wrong_is_an_error() {
    let mut file = dracoed(encoded::EDGEBREAKER);
    file.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] =
        json!(9);
    assert!(file.error().contains("its Draco data has no attribute 9"), "{}", file.error());
    file.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] =
        json!(2);
    assert!(file.error().contains("has 2 numbers an element, but its accessor 3"), "{}", file.error());
    file.bytes.truncate(40);
    file.json["bufferViews"][0]["byteLength"] = json!(40);
    assert!(file.error().contains("cannot be decompressed"), "{}", file.error());
}

/// A compressed view with a fallback buffer that does not exist.
fn packed(file: &mut GltfBuilder, data: &str, (count, stride): (usize, usize), mode: &str, filter: &str) -> usize {
    let data = bytes(data);
    let view = file.view(&data);
    let own = &mut file.json["bufferViews"][view];
    let source = json!({
        "buffer": 0, "byteOffset": own["byteOffset"], "byteLength": data.len(), "byteStride": stride, "count": count, "mode": mode, "filter": filter,
    });
    let fallback =
        json!({"buffer": 1, "byteLength": count * stride, "extensions": {"EXT_meshopt_compression": source}});
    *own = fallback;
    view
}

fn accessor(file: &mut GltfBuilder, view: usize, component: u32, count: usize, kind: &str) -> usize {
    let own = json!({"bufferView": view, "componentType": component, "count": count, "type": kind});
    push(&mut file.json["accessors"], own)
}

fn meshopted() -> GltfBuilder {
    let mut file = GltfBuilder::new();
    let view = packed(&mut file, encoded::ATTRIBUTES, (GRID, 8), "ATTRIBUTES", "NONE");
    let position = accessor(&mut file, view, 5123, GRID, "VEC3");
    let view = packed(&mut file, encoded::OCTAHEDRAL, (GRID, 4), "ATTRIBUTES", "OCTAHEDRAL");
    let normal = accessor(&mut file, view, 5120, GRID, "VEC3");
    file.json["accessors"][normal]["normalized"] = json!(true);
    let view = packed(&mut file, encoded::TRIANGLES, (96, 2), "TRIANGLES", "NONE");
    let indices = accessor(&mut file, view, 5123, 96, "SCALAR");
    let attributes = json!({"POSITION": position, "NORMAL": normal});
    file.json["meshes"] = json!([{"primitives": [{"attributes": attributes, "indices": indices}]}]);
    file.json["extensionsRequired"] = json!(["EXT_meshopt_compression", "KHR_mesh_quantization"]);
    file.json["buffers"] = json!([{"byteLength": file.bytes.len()}, {"byteLength": 4096}]);
    file
}

#[test]
fn meshopt_gives_the_grid_that_went_in() {
    let mesh = meshopted().read().meshes.remove(0);
    // Decoding may rotate a triangle's corners.
    assert_eq!(mesh.indices[..6], [0, 1, 5, 5, 1, 6]);
    for vertex in 0..GRID {
        let angle = vertex as f32 / 5.0;
        assert_eq!(Vec3::from(mesh.positions[vertex]), place(vertex) * 1000.0);
        let expected = Vec3::new(angle.sin() * 0.6, angle.cos() * 0.6, 0.8);
        assert!(Vec3::from(mesh.normals[vertex]).distance(expected) < 0.02, "{vertex}");
    }
}

#[test]
fn meshopt_filters_and_sequences_are_undone() {
    let mut file = GltfBuilder::new();
    let view = packed(&mut file, encoded::EXPONENTIAL, (GRID, 12), "ATTRIBUTES", "EXPONENTIAL");
    let position = accessor(&mut file, view, 5126, GRID, "VEC3");
    let view = packed(&mut file, encoded::INDICES, (96, 4), "INDICES", "NONE");
    let indices = accessor(&mut file, view, 5125, 96, "SCALAR");
    let view = packed(&mut file, encoded::QUATERNION, (GRID, 8), "ATTRIBUTES", "QUATERNION");
    let turn = accessor(&mut file, view, 5122, GRID, "VEC4");
    file.json["accessors"][turn]["normalized"] = json!(true);
    file.json["meshes"] = json!([{"primitives": [{"attributes": {"POSITION": position}, "indices": indices}]}]);
    file.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": {"ROTATION": turn}}});
    file.json["buffers"] = json!([{"byteLength": file.bytes.len()}, {"byteLength": 4096}]);
    let Imported { meshes, objects, .. } = file.read();
    assert_eq!((meshes[0].indices.len(), objects.len()), (96, GRID));
    assert!(Vec3::from(meshes[0].positions[2]).distance(place(5)) < 1e-3);
    for (index, object) in objects.iter().enumerate() {
        let turned = object.transform.matrix3.y_axis;
        let angle = 2.0 * index as f64 / 7.0;
        assert!((turned.y - angle.cos()).abs() < 2e-3 && (turned.z - angle.sin()).abs() < 2e-3, "{index}: {turned}");
    }
}

#[test]
fn meshopt_data_that_is_wrong_is_an_error() {
    let change = |key: &str, value: Value| {
        let mut file = meshopted();
        file.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"][key] = value;
        file.error()
    };
    for (key, value, words) in [
        ("mode", json!("X"), "unknown mode `X`"),
        ("filter", json!("X"), "unknown filter `X`"),
        ("count", json!(1u64 << 40), "cannot hold 1099511627776 elements"),
        ("byteStride", json!(7), "cannot be decompressed"),
        ("byteLength", json!(9), "cannot be decompressed"),
    ] {
        let error = change(key, value);
        assert!(error.contains("buffer view 0: ") && error.contains(words), "{error}");
    }
}

/// The texture of an image.
fn texture(image: &str, extension: Option<&str>) -> Texture {
    let mut file = GltfBuilder::triangle();
    let view = file.view(&bytes(image));
    file.json["images"] = json!([{"bufferView": view}]);
    let source = json!({"source": 0});
    file.json["textures"] = match extension {
        Some(name) => json!([{"extensions": {name: source}}]),
        None => json!([source]),
    };
    file.json["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
    file.primitive("material", json!(0));
    let mut found = file.read();
    assert!(found.warnings.iter().all(|warning| warning.contains("texture coordinates")), "{:?}", found.warnings);
    found.textures.remove(0)
}

#[test]
fn webp_and_basis_universal_give_the_texels_that_went_in() {
    for (image, extension, error) in [
        (encoded::WEBP, Some("EXT_texture_webp"), 0),
        (encoded::ETC1S, Some("KHR_texture_basisu"), 8),
        (encoded::UASTC, Some("KHR_texture_basisu"), 2),
    ] {
        let found = texture(image, extension);
        assert_eq!(found.size, [8, 8]);
        let blocks = matches!(&found.texels, Texels::Blocks { format: BlockFormat::Bc7, .. });
        assert_eq!(blocks, extension == Some("KHR_texture_basisu"));
        for (place, texel) in found.rgba8(0).as_chunks::<4>().0.iter().enumerate() {
            let expected = match (place % 8 < 4, place / 8 < 4) {
                (true, true) => [255, 0, 0, 255],
                (true, false) => [0, 255, 0, 255],
                (false, true) => [0, 0, 255, 255],
                (false, false) => [255, 255, 255, 128],
            };
            assert!(
                texel.iter().zip(&expected).all(|(a, b): (&u8, &u8)| a.abs_diff(*b) <= error),
                "{place}: {texel:?}"
            );
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn no_change_of_compressed_bytes_ends_in_a_panic(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..5)) {
        let changed = |data: &str| {
            let mut bytes = bytes(data);
            for (place, byte) in &changes {
                let place = place.index(bytes.len());
                bytes[place] = *byte;
            }
            bytes
        };
        // Calls the decoders directly, so that their own checks are tested without the outer safety net.
        for data in [encoded::EDGEBREAKER, encoded::SEQUENTIAL] {
            let _ = draco::decode_checked(&changed(data));
        }
        for data in [encoded::ETC1S, encoded::UASTC] {
            let changed = changed(data);
            let _ = KtxHeader::of(&changed).and_then(|header| basis::transcode(&changed, &header));
        }
        let mut file = meshopted();
        let mut bytes = std::mem::take(&mut file.bytes);
        for (place, byte) in &changes {
            let place = place.index(bytes.len());
            bytes[place] = *byte;
        }
        file.bytes = bytes;
        let _ = file.read_with(&Default::default());
    }
}
