//! Materials, textures, and their demands on meshes.

use glam::Vec3;
use image::{ImageFormat, RgbaImage};
use serde_json::{Value, json};
use std::io::Cursor;

use super::{Builder, push};
use crate::scene::gltf::GltfOptions;
use crate::scene::{AlphaMode, ColorSpace, Filter, Imported, Sampler, TextureSlot, UvMap, Wrap};

fn png(texels: &[[u8; 4]]) -> Vec<u8> {
    let image = RgbaImage::from_raw(texels.len() as u32, 1, texels.as_flattened().to_vec()).expect("an image");
    let mut bytes = Vec::new();
    image.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).expect("encoded");
    bytes
}

/// A triangle of a material, with two images: (255, 128, 64, 32) and white.
fn dressed(material: Value) -> Builder {
    let mut file = Builder::triangle();
    let uv = file.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let other = file.floats("VEC2", &[2.0, 0.0, 3.0, 0.0, 2.0, 1.0]);
    file.attribute("TEXCOORD_0", uv).attribute("TEXCOORD_1", other).primitive("material", json!(0));
    for texels in [[255, 128, 64, 32], [255; 4]] {
        let view = file.view(&png(&[texels]));
        push(&mut file.json["images"], json!({"bufferView": view, "mimeType": "image/png"}));
    }
    file.json["textures"] = json!([{"source": 0}, {"source": 1}, {"source": 0, "sampler": 0}]);
    file.json["samplers"] = json!([{"magFilter": 9728, "minFilter": 9985, "wrapS": 33071, "wrapT": 33648}]);
    file.json["materials"] = json!([material]);
    file
}

#[test]
fn defaults_are_those_of_the_specification() {
    let found = dressed(json!({})).read().materials.remove(0);
    assert_eq!((found.base_color, found.alpha, found.metallic, found.roughness), (Vec3::ONE, 1.0, 1.0, 1.0));
    assert_eq!((found.alpha_mode, found.two_sided, found.unlit), (AlphaMode::Opaque, false, false));
    assert_eq!((found.reflectance, found.grazing, found.emissive), (Vec3::splat(0.04), 1.0, Vec3::ZERO));
}

#[test]
fn factors_and_extensions_are_read() {
    let found = dressed(json!({
        "name": "m", "doubleSided": true, "alphaMode": "MASK", "alphaCutoff": 0.25, "emissiveFactor": [1, 0.5, 0],
        "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0, "roughnessFactor": 0.5},
        "extensions": {
            "KHR_materials_emissive_strength": {"emissiveStrength": 4}, "KHR_materials_unlit": {}, "KHR_materials_ior": {"ior": 2},
            "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1, 0, 100]},
        },
    }));
    let found = found.read().materials.remove(0);
    assert_eq!((found.name.as_str(), found.two_sided, found.unlit), ("m", true, true));
    assert_eq!((found.alpha, found.alpha_mode), (0.4, AlphaMode::Mask { cutoff: 0.25 }));
    assert_eq!(found.emissive, Vec3::new(4.0, 2.0, 0.0));
    let expected = Vec3::new(1.0 / 18.0, 0.0, 0.5);
    assert!((found.reflectance - expected).length() < 1e-6 && found.grazing == 0.5, "{}", found.reflectance);
}

#[test]
fn textures_have_the_space_and_the_sampler_of_their_use_and_are_shared() {
    let found = dressed(json!({
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 0}},
        "occlusionTexture": {"index": 0, "strength": 0.5}, "emissiveTexture": {"index": 2}, "emissiveFactor": [1, 1, 1],
    }));
    let Imported { materials, textures, warnings, .. } = found.read();
    assert_eq!((textures.len(), warnings.len()), (4, 0));
    let of = |slot: TextureSlot| &textures[materials[0].texture(slot).expect("a texture")];
    assert_eq!(of(TextureSlot::BaseColor).color_space, ColorSpace::Srgb);
    assert_eq!(of(TextureSlot::MetallicRoughness).color_space, ColorSpace::Linear);
    assert_eq!(*of(TextureSlot::BaseColor).rgba8(0), [255, 128, 64, 32]);
    assert_eq!(
        of(TextureSlot::Emissive).sampler,
        Sampler {
            wrap: [Wrap::Clamp, Wrap::Mirror],
            magnify: Filter::Nearest,
            minify: Filter::Linear,
            levels: Some(Filter::Nearest),
        }
    );
    // Full strength of 255 is none.
    assert_eq!(of(TextureSlot::Occlusion).rgba8(0)[0], 255);
}

#[test]
fn occlusion_is_as_strong_as_the_material_says() {
    let mut file = dressed(json!({"occlusionTexture": {"index": 0, "strength": 0.5}}));
    let view = file.view(&png(&[[0, 1, 2, 3]]));
    file.json["images"][0]["bufferView"] = json!(view);
    assert_eq!(*file.read().textures[0].rgba8(0), [128, 1, 2, 3]);
}

#[test]
fn sets_and_transforms_become_maps_and_the_normal_map_has_the_first_set() {
    let transform =
        json!({"KHR_texture_transform": {"offset": [0.5, 0], "rotation": 1.5, "scale": [2, 3], "texCoord": 1}});
    let file = dressed(json!({
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
        "normalTexture": {"index": 1, "scale": 0.5, "extensions": transform},
    }));
    let Imported { materials, meshes, .. } = file.read();
    let UvMap { set, offset, rotation, scale } = materials[0].uv_maps[TextureSlot::Normal as usize];
    assert_eq!((set, offset.x, rotation, scale.y), (0, 0.5, 1.5, 3.0));
    assert_eq!(materials[0].uv_maps[TextureSlot::BaseColor as usize].set, 1);
    assert_eq!((meshes[0].uvs[1], meshes[0].uvs_1[1]), ([3.0, 0.0], [1.0, 0.0]));
    assert_eq!((meshes[0].tangents.len(), materials[0].normal_scale), (3, 0.5));
}

#[test]
fn coordinates_far_from_zero_lose_whole_repeats_only_where_textures_repeat() {
    let mut file = dressed(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    let far = file.floats("VEC2", &[4096.0, 0.0, 4096.5, 0.0, 4096.0, 1.0]);
    file.attribute("TEXCOORD_0", far);
    assert_eq!(file.read().meshes[0].uvs[1], [0.5, 0.0]);
    file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = json!(2);
    assert_eq!(file.read().meshes[0].uvs[1], [4096.5, 0.0]);
}

#[test]
fn transmission_is_glass_and_its_texture_goes_into_alpha() {
    let glass = |own: Value| {
        let base = json!({"baseColorTexture": {"index": 1}, "baseColorFactor": [1, 1, 1, 0.5]});
        dressed(json!({"pbrMetallicRoughness": base, "extensions": {"KHR_materials_transmission": own}})).read()
    };
    let plain = glass(json!({"transmissionFactor": 0.75}));
    assert_eq!((plain.materials[0].alpha_mode, plain.materials[0].alpha), (AlphaMode::Glass, 0.25));
    let Imported { materials, textures, .. } =
        glass(json!({"transmissionFactor": 0.8, "transmissionTexture": {"index": 0}}));
    assert_eq!((materials[0].alpha, &textures[0].rgba8(0)[..]), (1.0, &[255, 255, 255, 51][..]));
    assert_eq!(glass(json!({"transmissionFactor": 0})).materials[0].alpha_mode, AlphaMode::Opaque);
}

#[test]
fn a_coat_is_an_object_of_its_own() {
    let coat = json!({"KHR_materials_clearcoat": {
        "clearcoatFactor": 0.5, "clearcoatTexture": {"index": 0}, "clearcoatRoughnessFactor": 0.1, "clearcoatNormalTexture": {"index": 1},
    }});
    let Imported { materials, objects, textures, meshes, .. } =
        dressed(json!({"name": "m", "extensions": coat})).read();
    assert_eq!((objects.len(), meshes.len(), objects[0].mesh), (2, 1, objects[1].mesh));
    let own = &materials[objects[1].material];
    assert_eq!((own.alpha_mode, own.alpha, own.roughness, own.metallic), (AlphaMode::Coat, 0.5, 0.1, 0.0));
    assert_eq!(*textures[own.base_color_texture.expect("a texture")].rgba8(0), [255; 4]);
    assert!(own.normal_texture.is_some() && materials[objects[0].material].normal_texture.is_none());
    assert_eq!(meshes[0].tangents.len(), 3);
}

#[test]
fn specular_textures_are_merged() {
    let own =
        json!({"KHR_materials_specular": {"specularTexture": {"index": 0}, "specularColorTexture": {"index": 1}}});
    let Imported { materials, textures, .. } = dressed(json!({"extensions": own})).read();
    assert_eq!(*textures[materials[0].specular_texture.expect("a texture")].rgba8(0), [255, 255, 255, 32]);
}

#[test]
fn an_image_that_is_none_is_left_out_by_number_and_name() {
    let mut file = dressed(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    let view = file.view(b"no image at all");
    file.json["images"][0] = json!({"name": "wood", "bufferView": view, "mimeType": "image/png"});
    let found = file.read();
    assert_eq!(found.materials[0].base_color_texture, None);
    assert!(found.warnings[0].contains(": image 0 (`wood`): is not an image"), "{:?}", found.warnings);
    // An image without a decoder may have another in its place.
    file.json["textures"][0] = json!({"source": 1, "extensions": {"EXT_texture_webp": {"source": 0}}});
    assert_eq!(*file.read().textures[0].rgba8(0), [255; 4]);
}

#[test]
fn a_variant_dresses_its_primitives() {
    let mut file = dressed(json!({"name": "a"}));
    file.json["materials"] = json!([{"name": "a"}, {"name": "b"}]);
    file.json["extensions"] = json!({"KHR_materials_variants": {"variants": [{"name": "day"}, {"name": "night"}]}});
    file.primitive("extensions", json!({"KHR_materials_variants": {"mappings": [{"material": 1, "variants": [1]}]}}));
    let of = |variant| {
        let found = file.read_with(&GltfOptions { variant, ..GltfOptions::default() });
        found.map(|found| found.materials[found.objects[0].material].name.clone())
    };
    assert_eq!((of(None), of(Some("day")), of(Some("night"))), (Ok("a".into()), Ok("a".into()), Ok("b".into())));
    assert!(of(Some("nigth")).unwrap_err().contains("did you mean \"night\"?"));
}
