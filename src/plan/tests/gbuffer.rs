//! Targets of the G-buffer, their formats and their channels.

use super::*;

fn gbuffer_of(brdf: Brdf, choice: GbufferChoice, device: &Capabilities) -> Gbuffer {
    let keep = Keep::NONE.with(OptionalPart::MaterialTarget);
    let settings = Settings { gbuffer: choice, keep, ..samples::deferred() };
    let plan = FramePlan::of(&scene(vec![material(brdf)], vec![sky()]), &settings, device).expect("a plan");
    plan.gbuffer.expect("a G-buffer")
}

#[test]
fn the_presets_spend_16_36_and_68_bytes_a_pixel() {
    let bytes = |choice| {
        // In a shadow every channel of the material target is needed where a normal map bends the shading normal.
        let bumpy = Material { normal_texture: Some(0), ..material(CT) };
        let settings = Settings { gbuffer: preset(choice), ..samples::deferred() };
        plan_with(&scene(vec![bumpy], vec![sun()]), &settings).gbuffer_bytes_per_pixel()
    };
    assert_eq!(bytes(GbufferPreset::Lean), 4 + 4 + 4 + 4);
    assert_eq!(bytes(GbufferPreset::Fat), 4 * 8 + 4);
    assert_eq!(bytes(GbufferPreset::Float32), 4 * 16 + 4);
}

#[test]
fn the_presets_have_their_formats() {
    let formats = |choice| gbuffer_of(CT, preset(choice), &device());
    let lean = formats(GbufferPreset::Lean);
    assert_eq!((lean.albedo, lean.normal), (vk::Format::R8G8B8A8_SRGB, vk::Format::R16G16_UNORM));
    assert_eq!((lean.material, lean.position), (Some(vk::Format::R8G8B8A8_UNORM), None));
    assert_eq!((lean.normal_encoding, lean.geometric_steps()), (NormalEncoding::Octahedral, 255.0));
    for (choice, format) in [
        (GbufferPreset::Fat, vk::Format::R16G16B16A16_SFLOAT),
        (GbufferPreset::Float32, vk::Format::R32G32B32A32_SFLOAT),
    ] {
        let all = formats(choice);
        assert_eq!((all.albedo, all.normal, all.material, all.position), (format, format, Some(format), Some(format)));
        assert_eq!((all.normal_encoding, all.specular), (NormalEncoding::Signed, None));
    }
}

#[test]
fn a_target_can_be_overridden_and_the_others_stay() {
    let base = preset(GbufferPreset::Fat);
    let half = vk::Format::R16G16B16A16_SFLOAT;
    let normal = gbuffer_of(CT, GbufferChoice { normal: Some(TargetChoice::Rgb10a2), ..base }, &device());
    assert_eq!(
        (normal.normal, normal.normal_encoding),
        (vk::Format::A2B10G10R10_UNORM_PACK32, NormalEncoding::HalfEncoded)
    );
    assert_eq!((normal.albedo, normal.position), (half, Some(half)));
    let albedo = gbuffer_of(CT, GbufferChoice { albedo: Some(TargetChoice::Rgba8), ..base }, &device());
    assert_eq!((albedo.albedo, albedo.material), (vk::Format::R8G8B8A8_SRGB, Some(half)));
    let material = gbuffer_of(CT, GbufferChoice { material: Some(TargetChoice::Rgba8), ..base }, &device());
    assert_eq!((material.albedo, material.material), (half, Some(vk::Format::R8G8B8A8_UNORM)));
    let position = gbuffer_of(CT, GbufferChoice { position: Some(TargetChoice::Depth), ..base }, &device());
    assert_eq!((position.position, position.normal), (None, half));
}

#[test]
fn without_normalized_16_bit_targets_octahedral_normals_are_integers() {
    let plain = Capabilities { unorm_2x16_attachment: false, ..device() };
    let lean = gbuffer_of(CT, GbufferChoice::default(), &plain);
    assert_eq!((lean.normal, lean.normal_encoding), (vk::Format::R16G16_UINT, NormalEncoding::Octahedral));
    assert_eq!(lean.bytes_per_pixel(), 16);
    // It can also be asked for.
    let asked =
        gbuffer_of(CT, GbufferChoice { normal: Some(TargetChoice::Oct16Uint), ..GbufferChoice::default() }, &device());
    assert_eq!(asked.normal, vk::Format::R16G16_UINT);
    let half = gbuffer_of(CT, preset(GbufferPreset::Fat), &plain);
    assert_eq!(half.normal, vk::Format::R16G16B16A16_SFLOAT);
}

#[test]
fn specular_is_stored_for_phong_and_where_brdfs_differ() {
    let specular = |materials: &[Brdf]| {
        let all = materials.iter().map(|&brdf| material(brdf)).collect();
        plan(&scene(all, vec![sky()])).gbuffer.expect("a G-buffer").specular.is_some()
    };
    assert!(specular(&[Brdf::Phong]) && specular(&[Brdf::BlinnPhong]));
    assert!(!specular(&[CT]) && !specular(&[Brdf::Lambert]) && !specular(&[CT, CT]));
    assert!(specular(&[CT, Brdf::Lambert]) && specular(&[CT, Brdf::Phong]));
}

#[test]
fn the_brdf_is_a_constant_where_all_materials_or_the_user_agree() {
    let mixed = scene(vec![material(CT), material(Brdf::Phong)], vec![sky()]);
    assert_eq!(plan(&mixed).brdf, PlannedBrdf::PerPixel);
    assert_eq!(plan(&scene(vec![material(CT); 3], vec![])).brdf, PlannedBrdf::One(CT));
    let settings = Settings { brdf: Some(Brdf::BlinnPhong), ..samples::deferred() };
    let overridden = plan_with(&mixed, &settings);
    assert_eq!(
        (overridden.brdf, overridden.brdf_override),
        (PlannedBrdf::One(Brdf::BlinnPhong), Some(Brdf::BlinnPhong))
    );
    assert!(overridden.geometry.iter().all(|key| key.phong));
    // A material that nothing is made of does not count.
    let mut unused = scene(vec![material(CT)], vec![sky()]);
    unused.materials.push(material(Brdf::Phong));
    assert_eq!(plan(&unused).brdf, PlannedBrdf::One(CT));
}

#[test]
fn lambert_without_a_shadow_stores_no_material() {
    let has = |brdf, light, seen| {
        view(&scene(vec![material(brdf)], vec![light]), seen).gbuffer.is_some_and(|gbuffer| gbuffer.material.is_some())
    };
    assert!(!has(Brdf::Lambert, sky(), View::Final));
    assert!(!has(Brdf::Lambert, sun(), View::Final), "the shading normal is the geometric one");
    assert!(has(CT, sky(), View::Final));
    assert!(has(Brdf::Lambert, sky(), View::Roughness) && has(Brdf::Lambert, sky(), View::Metallic));
    assert!(!has(Brdf::Lambert, sky(), View::Albedo));
}

#[test]
fn the_material_target_has_the_channels_that_the_scene_needs() {
    let metal = Material { metallic: 1.0, ..material(CT) };
    let bumpy = |brdf| Material { normal_texture: Some(0), ..material(brdf) };
    let formats = |material: &Material, light: Light| {
        [GbufferPreset::Lean, GbufferPreset::Fat, GbufferPreset::Float32].map(|choice| {
            let settings = Settings { gbuffer: preset(choice), ..samples::deferred() };
            plan_with(&scene(vec![material.clone()], vec![light.clone()]), &settings).gbuffer.expect("one").material
        })
    };
    let one = [vk::Format::R8_UNORM, vk::Format::R16_SFLOAT, vk::Format::R32_SFLOAT].map(Some);
    let two = [vk::Format::R8G8_UNORM, vk::Format::R16G16_SFLOAT, vk::Format::R32G32_SFLOAT].map(Some);
    let four = [vk::Format::R8G8B8A8_UNORM, vk::Format::R16G16B16A16_SFLOAT, vk::Format::R32G32B32A32_SFLOAT].map(Some);
    assert_eq!((formats(&material(CT), sky()), formats(&metal, sky())), (one, two));
    assert_eq!((formats(&material(CT), sun()), formats(&metal, sun())), (one, two));
    assert_eq!((formats(&bumpy(CT), sky()), formats(&bumpy(CT), sun())), (one, four));
    assert_eq!(formats(&bumpy(Brdf::Lambert), sun()), four);
    // A surface that no shadow falls on says so in the geometric normal's place.
    let mut lit = scene(vec![material(CT); 2], vec![sun()]);
    lit.objects[0].receives_shadow = false;
    assert_eq!(plan(&lit).gbuffer.expect("one").material, four[0]);
    // An override makes a dielectric of a metal.
    let phong = Settings { brdf: Some(Brdf::Phong), ..samples::deferred() };
    assert_eq!(plan_with(&scene(vec![metal], vec![sky()]), &phong).gbuffer.expect("one").material, one[0]);
}
