//! Materials, textures, and their demands on meshes.

use glam::Vec3;
use image::{ImageFormat, RgbaImage};
use serde_json::{Value, json};
use std::io::Cursor;

use super::{GltfBuilder, push};
use crate::gltf::GltfOptions;
use crate::{
    AlphaMode, Anisotropy, ColorSpace, DiffuseTransmission, Filter, Imported, Refraction, Sampler, Sheen, TextureSlot,
    ThinFilm, UvMap, Wrap,
};

fn png(texels: &[[u8; 4]]) -> Vec<u8> {
    let image = RgbaImage::from_raw(texels.len() as u32, 1, texels.as_flattened().to_vec()).expect("an image");
    let mut bytes = Vec::new();
    image.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).expect("encoded");
    bytes
}

/// A triangle of a material, with two images: (255, 128, 64, 32) and white.
fn dressed(material: Value) -> GltfBuilder {
    let mut file = GltfBuilder::triangle();
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

#[test]
fn a_cut_off_above_1_shows_nothing_and_one_below_0_everything() {
    let of = |cutoff: Value| {
        let mut found = dressed(json!({"alphaMode": "MASK", "alphaCutoff": cutoff})).read();
        let own = found.materials.remove(0);
        (own.alpha, own.alpha_mode, found.warnings.len())
    };
    assert_eq!(of(json!(1.5)), (0.0, AlphaMode::Mask { cutoff: 1.0 }, 1));
    assert_eq!(of(json!(1)), (1.0, AlphaMode::Mask { cutoff: 1.0 }, 0));
    assert_eq!(of(json!(-2)), (1.0, AlphaMode::Mask { cutoff: 0.0 }, 1));
    assert_eq!(of(Value::Null), (1.0, AlphaMode::Mask { cutoff: 0.5 }, 0));
}

#[test]
fn specular_glossiness_is_a_dielectric_of_its_reflectance() {
    let own = |own: Value| json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": own}});
    let mut file = dressed(own(json!({
        "diffuseFactor": [0.5, 0.25, 1, 0.5], "diffuseTexture": {"index": 1}, "specularFactor": [0.5, 0.75, 1], "glossinessFactor": 0.5,
        "specularGlossinessTexture": {"index": 0},
    })));
    file.json["extensionsRequired"] = json!(["KHR_materials_pbrSpecularGlossiness"]);
    file.json["materials"][0]["pbrMetallicRoughness"] =
        json!({"baseColorFactor": [0, 0, 0, 1], "roughnessFactor": 0.1});
    file.json["materials"][0]["alphaMode"] = json!("BLEND");
    let Imported { materials, textures, warnings, .. } = file.read();
    assert_eq!(warnings, Vec::<String>::new());
    let found = &materials[0];
    assert_eq!((found.base_color, found.alpha, found.metallic), (Vec3::new(0.5, 0.25, 1.0), 0.5, 0.0));
    assert_eq!((found.reflectance, found.grazing, found.roughness), (Vec3::new(0.5, 0.75, 1.0), 1.0, 1.0));
    let of = |slot: TextureSlot| &textures[found.texture(slot).expect("a texture")];
    assert_eq!(*of(TextureSlot::BaseColor).rgba8(0), [255; 4]);
    // The colour stays sRGB; its alpha, here 32, is a glossiness: 255 - 0.5 32.
    assert_eq!(*of(TextureSlot::Specular).rgba8(0), [255, 128, 64, 255]);
    assert_eq!(of(TextureSlot::Specular).color_space, ColorSpace::Srgb);
    assert_eq!(*of(TextureSlot::MetallicRoughness).rgba8(0), [255, 239, 0, 255]);
    let plain = dressed(own(json!({"glossinessFactor": 0.2, "specularFactor": [0.04, 0.04, 0.04]}))).read();
    let found = &plain.materials[0];
    assert_eq!((found.base_color, found.metallic, found.roughness), (Vec3::ONE, 0.0, 0.8));
    assert_eq!((found.reflectance, found.grazing), (Vec3::splat(0.04), 1.0));
    // The extension's defaults: a mirror.
    let mirror = dressed(own(json!({}))).read();
    assert_eq!((mirror.materials[0].reflectance, mirror.materials[0].roughness), (Vec3::ONE, 0.0));
}

#[test]
fn values_whose_meaning_is_clear_are_read_by_it() {
    for (given, expected) in [
        ("mask", AlphaMode::Mask { cutoff: 0.5 }),
        (" Blend", AlphaMode::Blend),
        ("opaque", AlphaMode::Opaque),
        ("MASK", AlphaMode::Mask { cutoff: 0.5 }),
    ] {
        let found = dressed(json!({"alphaMode": given})).read();
        assert_eq!((found.materials[0].alpha_mode, found.warnings.len()), (expected, 0), "{given}");
    }
    let odd = dressed(json!({"alphaMode": "glass"})).read();
    assert!(odd.warnings.iter().any(|own| own.contains("its alpha mode `glass` is unknown")), "{:?}", odd.warnings);
    let color = dressed(json!({"pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0.25]}})).read();
    let words = "materials[0].pbrMetallicRoughness.baseColorFactor is [1,0.5,0.25], read as [1,0.5,0.25,1.0]";
    assert!(color.warnings.iter().any(|own| own.contains(words)), "{:?}", color.warnings);
    assert_eq!((color.materials[0].base_color, color.materials[0].alpha), (Vec3::new(1.0, 0.5, 0.25), 1.0));
    let glow = dressed(json!({"emissiveFactor": [1, 0.5, 0.25, 1]})).read();
    assert_eq!(glow.materials[0].emissive, Vec3::new(1.0, 0.5, 0.25));
    assert_eq!(glow.warnings.len(), 1, "{:?}", glow.warnings);
}

#[test]
fn textures_images_and_samplers_that_do_not_exist_cost_themselves_alone() {
    let base =
        |texture: Value| json!({"pbrMetallicRoughness": {"baseColorTexture": texture}, "normalTexture": {"index": 1}});
    for (texture, change, words, textures) in [
        (json!({"index": 9}), json!(null), "texture 9 does not exist: the file has 3, drawn without it", 1),
        (json!({}), json!(null), "a texture of it has no index", 1),
        (json!({"index": 0}), json!({"source": 9}), "texture 0: image 9 does not exist", 1),
        (json!({"index": 0}), json!({}), "texture 0 names no image, drawn without it", 1),
        (
            json!({"index": 0}),
            json!({"source": 0, "sampler": 7}),
            "texture 0: sampler 7 does not exist: the file has 1, sampled as by default",
            2,
        ),
    ] {
        let mut file = dressed(base(texture));
        if !change.is_null() {
            file.json["textures"][0] = change;
        }
        let found = file.read();
        assert!(found.warnings.iter().any(|own| own.contains(words)), "{words}: {:?}", found.warnings);
        assert_eq!((found.textures.len(), found.objects.len()), (textures, 1), "{words}");
    }
    let mut file = dressed(base(json!({"index": 2})));
    file.json["samplers"] = json!([{"magFilter": 1, "minFilter": 2, "wrapS": 10496, "wrapT": 33071}]);
    let found = file.read();
    assert_eq!(found.textures[0].sampler, Sampler { wrap: [Wrap::Repeat, Wrap::Clamp], ..Sampler::DEFAULT });
    assert_eq!(found.warnings.len(), 3, "{:?}", found.warnings);
    assert!(found.warnings[0].contains("wrapS of its sampler is 10496, taken for 10497"), "{:?}", found.warnings);
}

#[test]
fn a_transform_that_no_device_holds_is_none_and_sixteen_bits_are_told() {
    let transform = json!({"KHR_texture_transform": {"scale": [1e300, 1]}});
    let mut file =
        dressed(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions": transform}}}));
    let found = file.read();
    assert_eq!(found.materials[0].uv_maps[TextureSlot::BaseColor as usize], UvMap::IDENTITY);
    assert!(found.warnings[0].contains("transform of its BaseColor texture"), "{:?}", found.warnings);
    let mut bytes = Vec::new();
    let deep = image::ImageBuffer::<image::Rgb<u16>, _>::from_pixel(1, 1, image::Rgb([65535, 32896, 0]));
    deep.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).expect("encoded");
    let view = file.view(&bytes);
    file.json["images"][0]["bufferView"] = json!(view);
    let found = file.read();
    assert_eq!(*found.textures[0].rgba8(0), [255, 128, 0, 255]);
    assert!(found.warnings.iter().any(|own| own.contains("image 0: has 16 bits a channel")), "{:?}", found.warnings);
}

#[test]
fn of_three_sets_those_of_colour_and_emission_are_read_and_the_others_are_named() {
    let mut file = dressed(json!({
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 2}, "metallicRoughnessTexture": {"index": 1, "texCoord": 1}},
        "occlusionTexture": {"index": 1, "texCoord": 0}, "emissiveTexture": {"index": 1, "texCoord": 3}, "emissiveFactor": [1, 1, 1],
    }));
    for (set, start) in [(2, 4.0), (3, 6.0)] {
        let uv = file.floats("VEC2", &[start, 0.0, start + 1.0, 0.0, start, 1.0]);
        file.attribute(&format!("TEXCOORD_{set}"), uv);
    }
    let found = file.read();
    assert_eq!((found.meshes[0].uvs[0], found.meshes[0].uvs_1[0]), ([4.0, 0.0], [6.0, 0.0]));
    let sets = |slot: TextureSlot| found.materials[0].uv_maps[slot as usize].set;
    assert_eq!([sets(TextureSlot::BaseColor), sets(TextureSlot::Emissive), sets(TextureSlot::Occlusion)], [0, 1, 0]);
    let words = "its textures use the sets 0, 1, 2, 3 of texture coordinates, of which 2 and 3 are read: its MetallicRoughness, Occlusion textures lie on set 2 instead";
    assert!(found.warnings.iter().any(|own| own.contains(words)), "{:?}", found.warnings);
}

#[test]
fn a_sheen_is_read_and_its_two_textures_are_one() {
    let sheen = |own: Value| dressed(json!({"extensions": {"KHR_materials_sheen": own}})).read();
    let Imported { materials, textures, warnings, .. } = sheen(json!({
        "sheenColorFactor": [0.5, 0.25, 1], "sheenRoughnessFactor": 0.5,
        "sheenColorTexture": {"index": 2}, "sheenRoughnessTexture": {"index": 0},
    }));
    assert_eq!(warnings, Vec::<String>::new());
    assert_eq!(materials[0].sheen, Sheen { color: Vec3::new(0.5, 0.25, 1.0), roughness: 0.5 });
    let texture = &textures[materials[0].sheen_texture.expect("a texture")];
    assert_eq!((textures.len(), texture.color_space), (1, ColorSpace::Srgb));
    // RGB of the one and alpha of the other.
    assert_eq!(texture.rgba8(0)[3], 32);
    // No colour is no sheen, whatever else is said.
    let none = sheen(json!({"sheenRoughnessFactor": 0.5, "sheenRoughnessTexture": {"index": 0}}));
    assert_eq!((none.materials[0].sheen, none.textures.len()), (Sheen::NONE, 0));
}

#[test]
fn odd_sheens_are_named_and_drawn_as_near_as_can_be() {
    let told = |material: Value| {
        let Imported { materials, warnings, .. } = dressed(material).read();
        (materials[0].sheen, warnings.join("; "))
    };
    let (smooth, said) = told(json!({"extensions": {"KHR_materials_sheen": {"sheenColorFactor": [1, 1, 1]}}}));
    assert_eq!(smooth.roughness, 0.0);
    assert!(said.contains("its sheenRoughnessFactor is 0, below the least of the model, taken for 0.07"), "{said}");
    let bright = json!({"sheenColorFactor": [2, -1, 1], "sheenRoughnessFactor": 7});
    let (bright, said) = told(json!({"extensions": {"KHR_materials_sheen": bright}}));
    assert_eq!(bright, Sheen { color: Vec3::new(1.0, 0.0, 1.0), roughness: 1.0 });
    assert!(said.contains("sheenColorFactor is 2") && said.contains("sheenRoughnessFactor is 7"), "{said}");
    let sheen = json!({"sheenColorFactor": [1, 1, 1], "sheenRoughnessFactor": 0.5});
    for (other, content) in [("KHR_materials_unlit", json!({})), ("KHR_materials_pbrSpecularGlossiness", json!({}))] {
        let (left, said) = told(json!({"extensions": {"KHR_materials_sheen": sheen, other: content}}));
        assert_eq!(left, Sheen::NONE);
        assert!(said.contains(&format!("KHR_materials_sheen does not go with {other} and is left out")), "{said}");
    }
    let apart = json!({
        "sheenColorFactor": [1, 1, 1], "sheenRoughnessFactor": 0.5, "sheenColorTexture": {"index": 0},
        "sheenRoughnessTexture": {"index": 0, "texCoord": 1},
    });
    let (_, said) = told(json!({"extensions": {"KHR_materials_sheen": apart}}));
    assert!(said.contains("sheenRoughnessTexture lies otherwise than sheenColorTexture and is left out"), "{said}");
}

#[test]
fn a_thin_film_is_read_with_its_thickness() {
    let film = |own: Value| dressed(json!({"extensions": {"KHR_materials_iridescence": own}})).read();
    let Imported { materials, textures, warnings, .. } = film(json!({
        "iridescenceFactor": 0.5, "iridescenceIor": 1.8, "iridescenceThicknessMaximum": 600,
        "iridescenceTexture": {"index": 1}, "iridescenceThicknessTexture": {"index": 0},
    }));
    assert_eq!(warnings, Vec::<String>::new());
    assert_eq!(materials[0].film, ThinFilm { strength: 0.5, ior: 1.8, nanometres: [100.0, 600.0] });
    let texture = &textures[materials[0].film_texture.expect("a texture")];
    assert_eq!((textures.len(), texture.color_space), (1, ColorSpace::Linear));
    // Red of the one and green of the other.
    assert_eq!(texture.rgba8(0)[..2], [255, 128]);
    // A film without a thickness texture has its greatest thickness.
    let plain = film(json!({"iridescenceFactor": 1, "iridescenceTexture": {"index": 1}}));
    assert_eq!(plain.materials[0].film, ThinFilm { strength: 1.0, ior: 1.3, nanometres: [400.0; 2] });
    assert_eq!(film(json!({"iridescenceThicknessMaximum": 600})).materials[0].film, ThinFilm::NONE);
}

#[test]
fn odd_thin_films_are_named_and_drawn_as_near_as_can_be() {
    let told = |film: Value| {
        let material = json!({"extensions": {"KHR_materials_iridescence": film}});
        let Imported { materials, warnings, .. } = dressed(material).read();
        (materials[0].film, warnings.join("; "))
    };
    let (none, said) = told(json!({"iridescenceFactor": 1, "iridescenceThicknessMaximum": 0}));
    assert_eq!(none, ThinFilm::NONE);
    assert!(said.contains("is 0 nm thick, drawn without it"), "{said}");
    let (odd, said) = told(json!({"iridescenceFactor": 2, "iridescenceIor": 0.5, "iridescenceThicknessMaximum": -5e9}));
    assert_eq!(odd, ThinFilm::NONE);
    for what in ["iridescenceFactor is 2", "iridescenceIor is 0.5", "iridescenceThicknessMaximum is -5000000000"] {
        assert!(said.contains(what), "{said}");
    }
    let (bound, _) = told(json!({"iridescenceFactor": 2, "iridescenceIor": 0.5}));
    assert_eq!(bound, ThinFilm { strength: 1.0, ior: 1.0, nanometres: [400.0; 2] });
    let apart = json!({
        "iridescenceFactor": 1, "iridescenceTexture": {"index": 0},
        "iridescenceThicknessTexture": {"index": 1, "texCoord": 1},
    });
    let (_, said) = told(apart);
    assert!(said.contains("iridescenceTexture lies otherwise than iridescenceThicknessTexture"), "{said}");
}

#[test]
fn an_anisotropy_is_read_and_its_mesh_has_tangents() {
    let read = |own: Value| dressed(json!({"extensions": {"KHR_materials_anisotropy": own}})).read();
    let own = json!({"anisotropyStrength": 0.5, "anisotropyRotation": 1.5, "anisotropyTexture": {"index": 0}});
    let Imported { materials, textures, warnings, meshes, .. } = read(own);
    assert_eq!((warnings, textures.len()), (Vec::<String>::new(), 1));
    assert_eq!(materials[0].anisotropy, Anisotropy { strength: 0.5, rotation: 1.5 });
    assert_eq!(textures[materials[0].anisotropy_texture.expect("a texture")].color_space, ColorSpace::Linear);
    assert_eq!(meshes[0].tangents.len(), meshes[0].positions.len());
    let none = read(json!({"anisotropyRotation": 1.5, "anisotropyTexture": {"index": 0}}));
    assert_eq!((none.materials[0].anisotropy, none.textures.len()), (Anisotropy::NONE, 0));
    assert!(none.meshes[0].tangents.is_empty());
    let odd = read(json!({"anisotropyStrength": -3, "anisotropyRotation": 1e300}));
    assert_eq!(odd.materials[0].anisotropy, Anisotropy::NONE);
    assert!(odd.warnings.join("; ").contains("anisotropyStrength is -3"), "{:?}", odd.warnings);
}

/// Glass with these extensions beside its transmission.
fn glass(more: Value) -> Imported {
    let mut extensions = json!({"KHR_materials_transmission": {"transmissionFactor": 0.75}});
    for (name, own) in more.as_object().into_iter().flatten() {
        extensions[name] = own.clone();
    }
    dressed(json!({"extensions": extensions})).read()
}

#[test]
fn glass_is_read_with_its_body() {
    let thin = glass(json!({}));
    assert_eq!((thin.warnings, thin.materials[0].refraction), (Vec::<String>::new(), Some(Refraction::THIN)));
    assert_eq!((thin.materials[0].alpha_mode, thin.materials[0].alpha), (AlphaMode::Glass, 0.25));
    let Imported { materials, textures, warnings, .. } = glass(json!({
        "KHR_materials_ior": {"ior": 1.25},
        "KHR_materials_dispersion": {"dispersion": 2},
        "KHR_materials_volume": {
            "thicknessFactor": 3, "thicknessTexture": {"index": 0},
            "attenuationDistance": 0.5, "attenuationColor": [0.5, 1, 0.25],
        },
    }));
    assert_eq!(warnings, Vec::<String>::new());
    let body =
        Refraction { ior: 1.25, thickness: 3.0, color: Vec3::new(0.5, 1.0, 0.25), distance: 0.5, dispersion: 2.0 };
    assert_eq!(materials[0].refraction, Some(body));
    // Half of white is left after the distance, and a quarter after twice that: Beer's law.
    let absorbed = body.absorption();
    assert!(((-absorbed.x * 0.5).exp() - 0.5).abs() < 1e-6 && absorbed.y == 0.0, "{absorbed}");
    // KHR_materials_dispersion: (ior - 1) 0.025 dispersion to either side.
    assert_eq!(body.iors(), [1.2375, 1.25, 1.2625]);
    // Green is the thickness, which the slot has in blue.
    let texture = &textures[materials[0].film_texture.expect("a texture")];
    assert_eq!((texture.color_space, texture.rgba8(0)[..3].to_vec()), (ColorSpace::Linear, vec![255, 255, 128]));
}

#[test]
fn odd_glass_is_named_and_drawn_as_near_as_can_be() {
    let told = |more: Value| {
        let Imported { materials, warnings, .. } = glass(more);
        (materials[0].refraction.expect("glass"), warnings.join("; "))
    };
    let (odd, said) = told(json!({
        "KHR_materials_ior": {"ior": 0.5},
        "KHR_materials_dispersion": {"dispersion": -1},
        "KHR_materials_volume": {"thicknessFactor": -2, "attenuationDistance": -1},
    }));
    assert_eq!(odd, Refraction::THIN);
    for what in ["ior is 0.5", "dispersion is -1", "thicknessFactor is -2", "attenuationDistance is -1"] {
        assert!(said.contains(what), "{what}: {said}");
    }
    let (odd, said) = told(json!({"KHR_materials_volume": {
        "thicknessFactor": 1, "attenuationDistance": 1, "attenuationColor": [-1, 2, 0],
    }}));
    assert_eq!(odd.color, Vec3::new(0.0, 1.0, 0.0));
    assert!(odd.absorption().is_finite() && said.contains("attenuationColor"), "{said}");
    let lone = dressed(json!({"extensions": {
        "KHR_materials_volume": {"thicknessFactor": 1}, "KHR_materials_dispersion": {"dispersion": 1},
    }}));
    let Imported { materials, warnings, .. } = lone.read();
    let said = warnings.join("; ");
    assert_eq!(materials[0].refraction, None);
    assert!(said.contains("a thickness but transmits no light") && said.contains("KHR_materials_dispersion"), "{said}");
    let unlit = glass(json!({"KHR_materials_unlit": {}}));
    assert_eq!(unlit.materials[0].refraction, None);
}

#[test]
fn diffuse_transmission_is_read_and_its_two_textures_are_one() {
    let read = |own: Value| dressed(json!({"extensions": {"KHR_materials_diffuse_transmission": own}})).read();
    let Imported { materials, textures, warnings, .. } = read(json!({
        "diffuseTransmissionFactor": 0.5, "diffuseTransmissionColorFactor": [0.5, 0.25, 1],
        "diffuseTransmissionColorTexture": {"index": 2}, "diffuseTransmissionTexture": {"index": 0},
    }));
    assert_eq!(warnings, Vec::<String>::new());
    let expected = DiffuseTransmission { strength: 0.5, color: Vec3::new(0.5, 0.25, 1.0) };
    assert_eq!(materials[0].diffuse_transmission, expected);
    let texture = &textures[materials[0].diffuse_transmission_texture.expect("a texture")];
    assert_eq!((textures.len(), texture.color_space), (1, ColorSpace::Srgb));
    // RGB of the one and alpha of the other.
    assert_eq!(texture.rgba8(0)[3], 32);
    // Without a colour it is white; without a factor nothing comes through, whatever else is said.
    let white = read(json!({"diffuseTransmissionFactor": 1})).materials[0].diffuse_transmission;
    assert_eq!(white, DiffuseTransmission { strength: 1.0, color: Vec3::ONE });
    let none = read(json!({"diffuseTransmissionColorTexture": {"index": 0}}));
    assert_eq!((none.materials[0].diffuse_transmission, none.textures.len()), (DiffuseTransmission::NONE, 0));
}

#[test]
fn odd_diffuse_transmissions_are_named_and_drawn_as_near_as_can_be() {
    let told = |material: Value| {
        let Imported { materials, warnings, .. } = dressed(material).read();
        (materials[0].diffuse_transmission, warnings.join("; "))
    };
    const NAME: &str = "KHR_materials_diffuse_transmission";
    let bright = json!({"diffuseTransmissionFactor": 3, "diffuseTransmissionColorFactor": [2, -1, 1]});
    let (bright, said) = told(json!({"extensions": {NAME: bright}}));
    assert_eq!(bright, DiffuseTransmission { strength: 1.0, color: Vec3::new(1.0, 0.0, 1.0) });
    assert!(said.contains("diffuseTransmissionFactor is 3"), "{said}");
    assert!(said.contains("diffuseTransmissionColorFactor is 2"), "{said}");
    let leaf = json!({"diffuseTransmissionFactor": 0.5});
    for other in ["KHR_materials_unlit", "KHR_materials_pbrSpecularGlossiness"] {
        let (left, said) = told(json!({"extensions": {NAME: leaf, other: {}}}));
        assert_eq!(left, DiffuseTransmission::NONE);
        assert!(said.contains(&format!("{NAME} does not go with {other} and is left out")), "{said}");
    }
    let apart = json!({
        "diffuseTransmissionFactor": 0.5, "diffuseTransmissionColorTexture": {"index": 0},
        "diffuseTransmissionTexture": {"index": 0, "texCoord": 1},
    });
    let (_, said) = told(json!({"extensions": {NAME: apart}}));
    let words = "diffuseTransmissionTexture lies otherwise than diffuseTransmissionColorTexture and is left out";
    assert!(said.contains(words), "{said}");
}
