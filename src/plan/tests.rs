mod antialiasing;
mod gbuffer;

use glam::Vec3;

use super::samples::{self, device, emissive, masked, material, point, scene, sky, spot, sun, textured};
use super::*;
use crate::scene::{
    AlphaMode, Camera, CastsShadow, Falloff, Filter, Fog, GbufferChoice, GbufferPreset, HdrFormat, Light, Material,
    Output, Projection, Scene, ShadowSettings, TRAITS, TargetChoice, TextureSlot, Tonemap,
};

const CT: Brdf = Brdf::CookTorrance;

fn plan_with(scene: &Scene, settings: &Settings) -> FramePlan {
    FramePlan::of(scene, settings, &device()).unwrap_or_else(|error| panic!("{error}"))
}

fn plan(scene: &Scene) -> FramePlan {
    plan_with(scene, &samples::deferred())
}

fn view(scene: &Scene, view: View) -> FramePlan {
    plan_with(scene, &Settings { view, ..samples::deferred() })
}

fn shadows(enabled: bool, size: u32) -> Settings {
    Settings { shadows: ShadowSettings { enabled, size, ..ShadowSettings::default() }, ..samples::deferred() }
}

/// A G-buffer of a preset, with the default formats.
fn preset(preset: GbufferPreset) -> GbufferChoice {
    GbufferChoice { preset, ..GbufferChoice::default() }
}

#[test]
fn only_shining_lights_that_cast_have_shadow_maps() {
    let maps = |scene: &Scene| plan(scene).shadow.map_or(0, |shadow| shadow.tiles.len());
    let lit = |light: Light| maps(&scene(vec![material(CT)], vec![light]));
    assert_eq!(lit(sun()), 2);
    assert_eq!(lit(sky()), 0);
    assert_eq!(lit(Light { intensity: 0.0, ..sun() }), 0);
    assert_eq!(lit(Light { color: Vec3::ZERO, ..sun() }), 0);
    assert_eq!(lit(point(Falloff::InverseSquare)), 0);
    assert_eq!(lit(Light { casts_shadow: true, ..point(Falloff::InverseSquare) }), 6);
    assert_eq!(lit(Light { casts_shadow: true, ..samples::spot(Falloff::InverseSquare) }), 1);
    assert_eq!(lit(Light { casts_shadow: true, ..samples::beam(None) }), 1);
    assert_eq!(maps(&Scene { lights: vec![sun()], ..Scene::default() }), 0);
    // Nor where no object casts.
    let mut bare = scene(vec![material(CT)], vec![sun()]);
    bare.objects[0].casts_shadow = CastsShadow::No;
    assert_eq!(maps(&bare), 0);
}

#[test]
fn only_where_there_are_shadows_a_pipeline_knows_who_receives_none() {
    for (light, keys) in [(sun(), 2), (sky(), 1)] {
        let mut scene = scene(vec![material(CT), material(CT)], vec![light]);
        scene.objects[1].receives_shadow = false;
        assert_eq!(plan(&scene).geometry.len(), keys);
    }
}

#[test]
fn shadows_follow_the_settings_and_the_view() {
    let sunlit = scene(vec![material(CT)], vec![sun()]);
    assert_eq!(plan_with(&sunlit, &shadows(true, 512)).shadow.map(|shadow| shadow.size), Some(512));
    assert_eq!(plan_with(&sunlit, &shadows(false, 512)).shadow, None);
    // A size that nothing uses cannot be wrong.
    assert_eq!(plan_with(&sunlit, &shadows(false, 0)).shadow, None);
    for seen in samples::views() {
        let shows = matches!(seen, View::Final | View::Lighting | View::ShadowMap);
        assert_eq!(view(&sunlit, seen).shadow.is_some(), shows, "{seen:?}");
    }
}

#[test]
fn the_shadow_map_view_has_nothing_but_the_map() {
    let plan = view(&scene(vec![textured(CT), emissive()], vec![sun()]), View::ShadowMap);
    assert_eq!((plan.shading, plan.shadow.is_some()), (Shading::ShowShadowMap, true));
    assert!(!plan.has_geometry() && plan.geometry.is_empty() && plan.gbuffer.is_none() && plan.hdr.is_none());
    assert!(!plan.emissive && !plan.lights.any() && plan.streams == Streams::default());
    assert_eq!(plan.gbuffer_bytes_per_pixel(), 0);
}

#[test]
fn the_hdr_format_is_the_one_asked_for_or_the_plan_is_refused() {
    let glowing = scene(vec![emissive()], vec![sky()]);
    let asked = |hdr_format, device: &Capabilities| {
        FramePlan::of(&glowing, &Settings { hdr_format, ..samples::deferred() }, device)
    };
    let bytes = |plan: &FramePlan| {
        let part = plan.parts().iter().find(|part| part.name.starts_with("HDR target")).expect("listed");
        part.bytes / u64::from(plan.size[0] * plan.size[1])
    };
    let poor = Capabilities { float32_blends: false, packed_float_blends: false, ..device() };
    for (format, vulkan, size, largest) in [
        (HdrFormat::Rgba16f, HDR, 8, 65_000.0),
        (HdrFormat::B10g11r11, vk::Format::B10G11R11_UFLOAT_PACK32, 4, 64_000.0),
        (HdrFormat::Rgba32f, vk::Format::R32G32B32A32_SFLOAT, 16, 1e30),
    ] {
        let plan = asked(format, &device()).expect("a plan");
        assert_eq!((plan.hdr, plan.largest_light(), bytes(&plan)), (Some(vulkan), largest, size));
        match asked(format, &poor) {
            Ok(plan) => assert_eq!((format, plan.hdr), (HdrFormat::Rgba16f, Some(HDR))),
            Err(error) => assert!(format != HdrFormat::Rgba16f && error.to_string().contains(format.name()), "{error}"),
        }
        // Without a target nothing is refused, and the plan says that there is none.
        let settings = Settings { hdr_format: format, ..samples::deferred() };
        let dull = FramePlan::of(&scene(vec![material(CT)], vec![sky()]), &settings, &poor).expect("a plan");
        let reason = &dull.parts().iter().find(|part| part.name.starts_with("HDR target")).expect("listed").reason;
        assert_eq!(dull.hdr, None);
        assert_eq!(reason.contains(format.name()), format != HdrFormat::Rgba16f, "{reason}");
    }
}

#[test]
fn weighted_sums_are_single_floats_wherever_they_blend() {
    let glass = Material { alpha_mode: AlphaMode::Blend, alpha: 0.5, ..material(CT) };
    let scene = scene(vec![material(CT), glass], vec![sky()]);
    let sums = |transparency, float32_blends, output| {
        let settings = Settings { transparency, output, ..samples::deferred() };
        let device = Capabilities { float32_blends, ..device() };
        FramePlan::of(&scene, &settings, &device).expect("a plan").sums
    };
    for &(_, output) in Output::NAMES {
        assert_eq!(sums(Transparency::Oit, true, output), Some(OitTargets::SINGLE));
        assert_eq!(sums(Transparency::Oit, false, output), Some(OitTargets::HALF));
        assert_eq!(sums(Transparency::Sorted, true, output), None);
    }
}

#[test]
fn emissive_light_brings_the_hdr_target_and_the_tonemap_subpass() {
    let settings = Settings { tonemap: Tonemap::Agx, ..samples::deferred() };
    let glowing = plan_with(&scene(vec![emissive()], vec![sky()]), &settings);
    assert!(glowing.emissive && glowing.has_tonemap_subpass());
    assert_eq!((glowing.hdr, glowing.output), (Some(HDR), OUTPUT_SRGB));
    assert_eq!(glowing.tone_mapping, ToneMapping::Subpass(Tonemap::Agx));
    let dull = plan_with(&scene(vec![material(CT)], vec![sky()]), &settings);
    assert!(!dull.emissive && !dull.has_tonemap_subpass());
    assert_eq!((dull.hdr, dull.tone_mapping), (None, ToneMapping::InLighting(Tonemap::Agx)));
}

#[test]
fn emissive_light_that_is_not_drawn_or_not_shown_is_left_out() {
    // A material that no object has.
    let mut unused = scene(vec![material(CT)], vec![sky()]);
    unused.materials.push(emissive());
    assert!(!plan(&unused).emissive);
    // A texture over emission 0 emits nothing.
    let black = Material { emissive_texture: Some(0), ..material(CT) };
    assert!(!plan(&scene(vec![black], vec![sky()])).emissive);
    let glowing = scene(vec![emissive()], vec![sun()]);
    for seen in samples::views() {
        let plan = view(&glowing, seen);
        assert_eq!(plan.emissive, seen == View::Final, "{seen:?}");
        assert_eq!(plan.hdr.is_some(), seen == View::Final, "{seen:?}");
    }
}

#[test]
fn a_linear_output_is_never_tone_mapped() {
    let single = vk::Format::R32G32B32A32_SFLOAT;
    let settings = Settings { output: Output::Nits, ..samples::deferred() };
    let plain = Capabilities { float32_blends: false, ..device() };
    for (materials, device, output) in [
        (material(CT), device(), single),
        (emissive(), device(), single),
        (material(CT), plain, single),
        // Emission and light must add up, so the target must blend.
        (emissive(), plain, HDR),
    ] {
        let plan = FramePlan::of(&scene(vec![materials], vec![sky()]), &settings, &device).expect("a plan");
        assert_eq!((plan.hdr, plan.output, plan.tone_mapping), (None, output, ToneMapping::Absent));
    }
    let shown = view(&scene(vec![material(CT)], vec![sky()]), View::Normal);
    assert_eq!((shown.output, shown.tone_mapping), (OUTPUT_SRGB, ToneMapping::Absent));
}

#[test]
fn exposed_light_goes_the_way_of_a_tone_mapped_frame_into_floats() {
    let single = vk::Format::R32G32B32A32_SFLOAT;
    let glass = Material { alpha_mode: AlphaMode::Blend, alpha: 0.5, ..material(CT) };
    for (materials, resolve, msaa) in [
        (vec![material(CT)], Resolve::ToneMapped, 1),
        (vec![emissive()], Resolve::ToneMapped, 1),
        (vec![material(CT), glass], Resolve::ToneMapped, 1),
        (vec![material(CT)], Resolve::Linear, 4),
        (vec![material(CT)], Resolve::ToneMapped, 4),
    ] {
        let scene = scene(materials, vec![sky()]);
        let hdr_format = HdrFormat::B10g11r11;
        let shown = Settings { hdr_format, resolve, msaa, ..samples::deferred() };
        let shown_plan = plan_with(&scene, &shown);
        let plan = plan_with(&scene, &Settings { output: Output::Exposed, ..shown });
        assert_eq!((plan.hdr, plan.output), (shown_plan.hdr, single));
        let expected = if plan.hdr.is_some() { ToneMapping::Kept } else { ToneMapping::Absent };
        assert_eq!((plan.tone_mapping, plan.has_tonemap_subpass()), (expected, plan.hdr.is_some()));
        assert_eq!(plan.largest_light(), shown_plan.largest_light());
    }
    let fxaa = Settings { fxaa: true, output: Output::Exposed, ..samples::deferred() };
    let error = FramePlan::of(&scene(vec![material(CT)], vec![sky()]), &fxaa, &device()).expect_err("refused");
    assert!(error.to_string().contains("tone-mapped"), "{error}");
}

#[test]
fn triangles_are_shown_where_the_device_numbers_them_and_nothing_of_a_surface_is_read() {
    let lit = scene(vec![Material { normal_texture: Some(0), ..material(CT) }], vec![sun()]);
    let plan = view(&lit, View::Triangle);
    assert_eq!((plan.gbuffer, plan.shadow.is_none(), plan.geometry_locations()), (None, true, 1));
    assert_eq!((plan.streams.normals, plan.streams.uvs, plan.textures.images.len()), (false, false, 0));
    let settings = Settings { view: View::Triangle, ..Settings::default() };
    let poor = Capabilities { primitive_index: false, ..device() };
    assert_eq!(FramePlan::of(&lit, &settings, &poor), Err(PlanError::NoTriangles));
}

#[test]
fn textures_are_filtered_as_far_as_the_device_goes_and_what_it_lacks_is_told() {
    let textured = scene(vec![Material { base_color_texture: Some(0), ..material(CT) }], vec![sun()]);
    let of = |scene: &Scene, asked, most| {
        let settings = Settings { anisotropy: asked, ..samples::deferred() };
        let plan = FramePlan::of(scene, &settings, &Capabilities { anisotropy: most, ..device() }).expect("a plan");
        (plan.anisotropy, plan.warnings().len())
    };
    assert_eq!((of(&textured, 8, 16), of(&textured, 8, 4), of(&textured, 8, 1)), ((8, 0), (4, 1), (1, 1)));
    assert_eq!(of(&textured, 1, 16), (1, 0));
    let places = |scene: &Scene, slow_anisotropy, asked| {
        let settings = Settings { anisotropy: asked, ..samples::deferred() };
        let plan = FramePlan::of(scene, &settings, &Capabilities { slow_anisotropy, ..device() }).expect("a plan");
        [plan.places_of_samplers(), plan.places_of_shaders()]
    };
    let of_shaders = [(false, 8), (true, 8), (true, 1)].map(|(slow, asked)| places(&textured, slow, asked));
    assert_eq!(of_shaders, [[8, 1], [1, 8], [1, 1]]);
    let mut edged = textured.clone();
    edged.textures[0].sampler.magnify = Filter::Nearest;
    assert_eq!(places(&edged, true, 8), [8, 1], "texels with edges stay sharp");
    let multisampled = |software, asked| {
        let settings = Settings { msaa: 4, anisotropy: asked, ..samples::deferred() };
        let plan = FramePlan::of(&textured, &settings, &Capabilities { software, ..device() }).expect("a plan");
        (plan.anisotropy, plan.warnings().len())
    };
    // Only a part that somebody asked for is missed.
    assert_eq!((multisampled(false, 8), multisampled(true, 8)), ((8, 0), (1, 0)));
    assert_eq!((multisampled(true, 16), multisampled(true, 1)), ((1, 1), (1, 0)));
    // The frames of a picture are the places that a pixel is filtered from, as many as there are frames; then each frame has a part of the pixel.
    let averaged = |scene: &Scene, samples, anisotropy| {
        let settings = Settings { samples, anisotropy, ..samples::deferred() };
        let plan = FramePlan::of(scene, &settings, &device()).expect("a plan");
        (plan.anisotropy, plan.footprint, plan.warnings().len())
    };
    assert_eq!((averaged(&textured, 1, 8), averaged(&textured, 4, 1)), ((8, 1.0, 0), (1, 0.5, 0)));
    assert_eq!((averaged(&textured, 2, 8), averaged(&textured, 32, 8)), ((1, 0.5, 0), (1, 0.0625, 0)));
    assert_eq!(averaged(&scene(vec![material(CT)], vec![sun()]), 32, 8), (1, 1.0, 0));
    // A scene without textures needs no warning.
    assert_eq!(of(&scene(vec![material(CT)], vec![sun()]), 8, 4), (1, 0));
}

#[test]
fn what_is_kept_is_there_without_need() {
    let bare = scene(vec![material(Brdf::Lambert)], vec![Light { casts_shadow: false, ..sun() }]);
    let with = |parts: &[OptionalPart]| {
        let keep = parts.iter().copied().collect();
        // Lists belong to a path that has them.
        plan_with(&bare, &Settings { keep, light_path: LightPath::Clustered, ..samples::deferred() })
    };
    use OptionalPart as P;
    let lean = with(&[]);
    type Has = fn(&FramePlan) -> bool;
    let gbuffer = |plan: &FramePlan| plan.gbuffer.expect("one");
    let kept: [(P, Has); 17] = [
        (P::HdrTarget, |plan| plan.hdr.is_some() && plan.has_tonemap_subpass()),
        (P::Transparent, |plan| plan.transparency.is_some()),
        (P::Emissive, |plan| plan.emissive),
        (P::MaterialTarget, |plan| plan.gbuffer.is_some_and(|own| own.metallic && own.geometric_normal)),
        (P::MetallicChannel, |plan| plan.metal && plan.gbuffer.is_some_and(|own| own.metallic)),
        (P::GeometricNormalChannels, |plan| plan.gbuffer.is_some_and(|own| own.geometric_normal)),
        (P::SpecularTarget, |plan| plan.gbuffer.is_some_and(|own| own.specular.is_some())),
        (P::BrdfByPixel, |plan| plan.brdf == PlannedBrdf::PerPixel),
        (P::AmbientLight, |plan| plan.lights.ambient),
        (P::PunctualLights, |plan| plan.lights.punctual && plan.lights.unbounded),
        (P::SpotCones, |plan| has_trait(plan, P::SpotCones)),
        (P::Beams, |plan| has_trait(plan, P::Beams)),
        (P::Falloffs, |plan| plan.lights.falloff == 3),
        (P::LightRanges, |plan| has_trait(plan, P::LightRanges)),
        (P::LightLists, FramePlan::has_clusters),
        (P::ShadowMaps, |plan| plan.shadow.is_some() && plan.has_directional_shadows()),
        (P::DirectionalLights, |plan| plan.lights.directional),
    ];
    for (part, has) in kept {
        // The scene has a sun, and lights without a fall-off count as mixed.
        let needed = matches!(part, P::DirectionalLights | P::Falloffs);
        assert_eq!((has(&lean), has(&with(&[part]))), (needed, true), "{part}");
    }
    assert_eq!(gbuffer(&lean).material, None);
    let full = plan_with(&bare, &Settings { keep: Keep::ALL, light_path: LightPath::Clustered, ..samples::deferred() });
    for (part, has) in kept {
        assert!(has(&full), "{part}");
    }
}

/// The bit of a feature that shaders have code for.
fn bit(part: OptionalPart) -> u32 {
    TRAITS.iter().find(|own| own.part == part).expect("it is one of lights").bit
}

fn has_trait(plan: &FramePlan, part: OptionalPart) -> bool {
    plan.lights.traits & bit(part) != 0
}

#[test]
fn lighting_has_code_for_the_lights_that_shine_and_no_others() {
    let lights = |lights: Vec<Light>| plan(&scene(vec![material(CT)], lights)).lights;
    assert!(
        !lights(vec![]).any()
            && lights(vec![]) == PlannedLights { falloff: 3, uniform: true, ..PlannedLights::default() }
    );
    let dark = Light { intensity: 0.0, ..spot(Falloff::Quadratic) };
    assert!(!lights(vec![dark.clone()]).any());
    let directional = lights(vec![sky(), dark]);
    assert!(directional.directional && !directional.punctual && directional.traits == 0);
    let lamp = lights(vec![point(Falloff::InverseSquare)]);
    assert!(lamp.any() && !lamp.directional && lamp.punctual && lamp.traits == bit(OptionalPart::LightRanges));
    let spotted = lights(vec![spot(Falloff::InverseSquare)]);
    assert!(spotted.punctual && spotted.traits == bit(OptionalPart::SpotCones));
    let beams = lights(vec![samples::beam(None), point(Falloff::InverseSquare)]);
    assert_eq!(beams.traits, bit(OptionalPart::Beams) | bit(OptionalPart::LightRanges));
    assert!(beams.punctual && beams.falloff == 0, "a beam has no fall-off");
}

#[test]
fn loops_over_many_lights_take_four_at_a_time_where_that_saves_reads() {
    let by_fours = |reads_pushed_places_once, light_path, lights: Vec<Light>| {
        let settings = Settings { light_path, ..samples::deferred() };
        let device = Capabilities { reads_pushed_places_once, ..samples::software() };
        FramePlan::of(&scene(vec![material(CT)], lights), &settings, &device).expect("a plan").lights.by_fours
    };
    let lamps = |count| vec![point(Falloff::InverseSquare); count];
    assert!(by_fours(true, LightPath::Loop, lamps(8)) && !by_fours(true, LightPath::Loop, lamps(7)));
    assert!(!by_fours(false, LightPath::Loop, lamps(8)) && !by_fours(true, LightPath::Loop, vec![sun(); 8]));
    // The places of that many do not fit into push constants.
    assert!(by_fours(true, LightPath::Loop, lamps(4096)) && !by_fours(true, LightPath::Loop, lamps(4097)));
    let with_sun = |count| [vec![sun()], lamps(count)].concat();
    assert!(by_fours(true, LightPath::Loop, with_sun(4095)) && !by_fours(true, LightPath::Loop, with_sun(4096)));
    // Lists have the lights of limited range.
    assert!(!by_fours(true, LightPath::Clustered, lamps(8)) && !by_fours(true, LightPath::PerLight, lamps(8)));
}

#[test]
fn one_falloff_is_a_constant_and_several_are_not() {
    let polynomial = |linear| Falloff::Polynomial { constant: 1.0, linear, quadratic: 0.0 };
    let falloff = |all: &[Falloff]| {
        let lights = all.iter().map(|&falloff| point(falloff)).collect();
        plan(&scene(vec![material(CT)], lights)).lights.falloff
    };
    assert_eq!(falloff(&[Falloff::InverseSquare]), 0);
    assert_eq!(falloff(&[Falloff::Quadratic; 2]), 1);
    // Coefficients are data, the kind is code.
    assert_eq!(falloff(&[polynomial(1.0), polynomial(2.0)]), 2);
    assert_eq!(falloff(&[Falloff::InverseSquare, Falloff::Quadratic]), 3);
    let both = scene(vec![material(CT)], vec![point(Falloff::Quadratic), spot(polynomial(1.0))]);
    assert_eq!(plan(&both).lights.falloff, 3);
}

#[test]
fn ambient_light_is_in_where_there_is_some() {
    let mut lit = scene(vec![textured(CT)], vec![sky()]);
    assert!(!plan(&lit).lights.ambient && !sampled(&plan(&lit), TextureSlot::Occlusion));
    lit.environment.ambient = Vec3::new(0.0, 0.1, 0.0);
    assert!(plan(&lit).lights.ambient && sampled(&plan(&lit), TextureSlot::Occlusion));
}

fn sampled(plan: &FramePlan, slot: TextureSlot) -> bool {
    plan.geometry.iter().any(|key| key.textures.contains(slot))
}

#[test]
fn views_have_lights_only_where_they_show_them() {
    let lit = scene(vec![material(CT)], vec![sun(), point(Falloff::Quadratic)]);
    for seen in samples::views() {
        let shows = matches!(seen, View::Final | View::Lighting | View::LightsPerPixel);
        assert_eq!(view(&lit, seen).lights.any(), shows, "{seen:?}");
    }
}

#[test]
fn a_geometry_pipeline_samples_what_its_brdf_and_view_look_at() {
    use TextureSlot as S;
    let mut lit = scene(vec![textured(CT)], vec![sky()]);
    lit.environment.ambient = Vec3::ONE;
    let slots = |scene: &Scene, seen| {
        let plan = view(scene, seen);
        assert_eq!(plan.geometry.len(), 1);
        // Materials without lobes sample no textures of lobes.
        assert!(!S::ALL.into_iter().any(|s| s.is_of_lobe() && sampled(&plan, s)));
        std::array::from_fn::<_, { S::STORED }, _>(|index| sampled(&plan, S::ALL[index]))
    };
    assert_eq!(slots(&lit, View::Final), [true, true, true, true, false, false, false]);
    assert_eq!(slots(&lit, View::Overdraw), [false; 7]);
    lit.materials[0].emissive = Vec3::ONE;
    assert_eq!(slots(&lit, View::Final), [true, true, true, true, true, false, false]);
    lit.materials[0].brdf = Brdf::Phong;
    assert_eq!(slots(&lit, View::Final), [true, true, false, true, true, true, true]);
    lit.materials[0].brdf = Brdf::Lambert;
    assert_eq!(slots(&lit, View::Final), [true, true, false, true, true, false, false]);
    assert_eq!(slots(&lit, View::Roughness), [true, true, true, false, false, false, false]);
}

#[test]
fn keys_tell_masks_sides_mirrors_and_phong_apart() {
    let only = |scene: &Scene| {
        let plan = plan(scene);
        assert_eq!(plan.geometry.len(), 1);
        *plan.geometry.first().expect("a key")
    };
    let plain = only(&scene(vec![material(CT)], vec![sky()]));
    assert_eq!(
        plain,
        GeometryKey {
            textures: TextureMask::default(),
            own_samplers: false,
            extras: Extras::default(),
            reflectance: false,
            masked: false,
            discards: false,
            two_sided: false,
            mirrored: false,
            phong: false,
            lobes: LobeMask::NONE,
            receives: true,
            forward: None,
        }
    );
    let holes = only(&scene(vec![masked()], vec![sky()]));
    assert!(holes.masked && holes.textures.contains(TextureSlot::BaseColor));
    // Alpha is constant without a texture.
    let even = Material { alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..material(CT) };
    assert!(!only(&scene(vec![even], vec![sky()])).masked);
    assert!(only(&scene(vec![Material { two_sided: true, ..material(CT) }], vec![])).two_sided);
    assert!(only(&scene(vec![material(Brdf::BlinnPhong)], vec![])).phong);
    let mut mirrored = scene(vec![material(CT)], vec![]);
    mirrored.objects[0].transform = glam::DAffine3::from_scale(glam::DVec3::new(1.0, -2.0, 3.0));
    assert!(only(&mirrored).mirrored);
    mirrored.objects[0].transform = glam::DAffine3::from_scale(glam::DVec3::new(-1.0, -2.0, 3.0));
    assert!(!only(&mirrored).mirrored);
    // Equal needs share a pipeline.
    assert_eq!(plan(&scene(vec![material(CT), material(CT), masked()], vec![])).geometry.len(), 2);
}

#[test]
fn vertices_have_the_streams_that_something_reads() {
    let streams = |scene: &Scene, seen| {
        let streams = view(scene, seen).streams;
        (streams.normals, streams.uvs, streams.tangents)
    };
    let plain = scene(vec![material(CT)], vec![sun()]);
    assert_eq!(streams(&plain, View::Final), (true, false, false));
    assert_eq!(streams(&plain, View::Overdraw), (false, false, false));
    let colored = Material { base_color_texture: Some(0), ..material(CT) };
    assert_eq!(streams(&scene(vec![colored.clone()], vec![]), View::Final), (true, true, false));
    let bumpy = Material { normal_texture: Some(1), ..colored };
    assert_eq!(streams(&scene(vec![bumpy], vec![]), View::Final), (true, true, true));
    // SHADOW reads the UVs of meshes with holes.
    assert_eq!(streams(&scene(vec![masked()], vec![sun()]), View::ShadowMap), (false, true, false));
}

#[test]
fn what_cannot_be_is_refused_in_one_line_that_names_it() {
    let lit = scene(vec![material(CT)], vec![sun()]);
    let refuse = |scene: &Scene, settings: &Settings, device: &Capabilities| {
        let error = FramePlan::of(scene, settings, device).expect_err("must be refused");
        let text = error.to_string();
        assert!(!text.contains('\n'), "{text}");
        (error, text)
    };
    for size in [[0, 0], [0, 720], [1280, 0], [16385, 1], [1, 16385], [u32::MAX, u32::MAX]] {
        let (error, text) = refuse(&lit, &Settings { size, ..samples::deferred() }, &device());
        assert_eq!(error, PlanError::Size(size[0], size[1], 16384));
        assert!(text.contains(&format!("{}x{}", size[0], size[1])) && text.contains("16384"), "{text}");
    }
    for size in [0, 16385] {
        assert_eq!(refuse(&lit, &shadows(true, size), &device()).0, PlanError::ShadowSize(size, 16384));
    }
    let few = Capabilities { max_color_attachments: 4, ..device() };
    let fat = Settings { gbuffer: preset(GbufferPreset::Fat), ..samples::deferred() };
    let (error, text) = refuse(&lit, &fat, &few);
    assert!(matches!(error, PlanError::ColorAttachments(TooFew { needed: 6, most: 4, .. })));
    assert!(text.ends_with("has 4: choose `--gbuffer lean`, or `--light-path forward`"), "{text}");
    assert!(FramePlan::of(&lit, &samples::deferred(), &few).is_ok());
    // Nobody asked for a light path, or for these targets: surfaces are lit as they are drawn. Settings that need a G-buffer are refused.
    let none = Capabilities { max_input_attachments: 2, ..samples::software() };
    let (lamps, usual) = (scene(vec![material(CT)], vec![point(Falloff::Quadratic); 2]), Settings::default());
    let planned = FramePlan::of(&lamps, &usual, &none).expect("a plan");
    assert_eq!(planned.light_path, LightPath::Forward);
    assert!(planned.reasons.light_path.contains("input attachments, and the device has 2"));
    let normals = Settings { view: View::Normal, ..usual };
    assert!(matches!(refuse(&lamps, &normals, &none).0, PlanError::InputAttachments(TooFew { most: 2, .. })));
    let map = Settings { view: View::ShadowMap, ..samples::deferred() };
    assert!(refuse(&scene(vec![material(CT)], vec![sky()]), &map, &device()).1.contains("no light casts"));
    let off = Settings { view: View::ShadowMap, ..shadows(false, 64) };
    assert!(refuse(&lit, &off, &device()).1.contains("switched off"));
    assert!(refuse(&Scene { lights: vec![sun()], ..Scene::default() }, &map, &device()).1.contains("sun"));
}

#[test]
fn the_largest_and_the_smallest_size_are_possible() {
    for size in [[1, 1], [16384, 16384]] {
        assert_eq!(plan_with(&scene(vec![material(CT)], vec![]), &Settings { size, ..samples::deferred() }).size, size);
    }
}

// ANCHOR: plan-is-pure
#[test]
fn a_plan_is_pure_and_knows_no_camera() {
    let plans = samples::plans();
    assert!(plans.len() > 1000);
    assert!(plans == samples::plans());
    let mut moved = scene(vec![textured(CT), emissive()], vec![sun(), spot(Falloff::Quadratic)]);
    let before = plan(&moved);
    moved.camera =
        Camera { position: glam::DVec3::splat(1e6), projection: Projection::perspective(20.0), ..Camera::default() };
    assert_eq!(plan(&moved), before);
}
// ANCHOR_END: plan-is-pure

#[test]
fn spread_light_is_planned_where_it_is_asked_for_and_there_is_light() {
    let lit = scene(vec![material(CT)], vec![sky(), point(Falloff::Quadratic)]);
    let off = plan_with(&lit, &samples::deferred());
    // The other settings of an effect that is off change nothing.
    assert_eq!(plan_with(&lit, &Settings { bloom_radius: 0.3, bloom_taps: 2, ..samples::deferred() }), off);
    assert!(off.effects.bloom.is_none() && off.hdr.is_none() && !off.has_tonemap_subpass());
    let with = Settings { bloom: 0.1, ..samples::deferred() };
    let on = plan_with(&lit, &with);
    assert!(on.effects.bloom.is_some() && on.hdr.is_some() && on.has_tonemap_subpass());
    assert_eq!(plan_with(&lit, &Settings { view: View::Normal, ..with.clone() }).effects.bloom, None);
    let all = Settings { view: View::Bloom, ..samples::deferred() };
    assert_eq!(plan_with(&lit, &all).effects.bloom.map(|own| own.strength), Some(1.0));
    // Frames of another size are the same frames.
    let larger = plan_with(&lit, &Settings { size: [4000, 3000], ..with.clone() });
    assert!(on.differs_in_size_only(&larger) && on.effects.bloom == larger.effects.bloom);
    let refused = |settings: Settings| FramePlan::of(&lit, &settings, &device()).expect_err("refused").to_string();
    assert!(refused(Settings { msaa: 4, ..with.clone() }).contains("ask for --resolve linear"));
    assert!(
        refused(Settings { light_path: LightPath::Compute, ..with.clone() })
            .contains("--light-path compute cannot draw bloom")
    );
    plan_with(&lit, &Settings { msaa: 4, resolve: Resolve::Linear, ..with.clone() });
    plan_with(&lit, &Settings { msaa: 4, output: Output::Nits, ..with });
}

#[test]
fn fog_is_planned_where_it_is_asked_for_and_there_is_light() {
    let lit = scene(vec![material(CT)], vec![sky(), point(Falloff::Quadratic)]);
    let off = plan_with(&lit, &samples::deferred());
    // The other settings of an effect that is off change nothing.
    assert_eq!(plan_with(&lit, &Settings { fog_density: 0.3, fog_base: -2.0, ..samples::deferred() }), off);
    assert!(off.effects.fog.is_none() && off.hdr.is_none() && off.lights.uniform);
    let with = Settings { fog: Fog::Height, ..samples::deferred() };
    let on = plan_with(&lit, &with);
    assert!(on.effects.fog.is_some_and(|fog| !fog.alone) && on.hdr.is_some() && !on.lights.uniform);
    for view in [View::Normal, View::Lighting, View::Ambient] {
        assert_eq!(plan_with(&lit, &Settings { view, ..with.clone() }).effects.fog, None, "{view}");
    }
    assert_eq!(plan_with(&lit, &Settings { fog_density: 0.0, ..with.clone() }).effects.fog, None);
    assert!(plan_with(&lit, &Settings { view: View::Fog, ..with.clone() }).effects.fog.is_some_and(|fog| fog.alone));
    assert_eq!(plan_with(&lit, &Settings { view: View::Fog, bloom: 0.5, ..with.clone() }).effects.bloom, None);
    let refused = |settings: Settings| FramePlan::of(&lit, &settings, &device()).expect_err("refused").to_string();
    // The view shows fog even if no fog is asked for.
    assert_eq!(
        plan_with(&lit, &Settings { view: View::Fog, ..samples::deferred() }).effects.fog,
        plan_with(&lit, &Settings { view: View::Fog, ..with.clone() }).effects.fog
    );
    assert!(refused(Settings { light_path: LightPath::Compute, ..with.clone() }).contains("cannot draw fog"));
    for number in [-1.0, f32::NAN, f32::INFINITY, 2e6] {
        let said = refused(Settings { fog_density: number, ..with.clone() });
        assert!(said.starts_with("fog: density is") && said.contains("must be a number from 0"), "{said}");
    }
    assert!(refused(Settings { fog_height: 0.0, ..with.clone() }).starts_with("fog: scale height is 0"));
    assert!(refused(Settings { fog_anisotropy: 1.0, ..with.clone() }).starts_with("fog: phase anisotropy is 1"));
    assert!(refused(Settings { fog_albedo: f32::NAN, ..with.clone() }).starts_with("fog: albedo is NaN"));
    assert!(refused(Settings { fog_base: f32::NEG_INFINITY, ..with }).starts_with("fog: base height is -inf"));
}

#[test]
fn every_variation_of_an_effect_gives_frames_that_have_it() {
    for effect in effects::EFFECTS {
        assert!(!effect.variations.is_empty(), "no sample plan has {}", effect.name);
        for variation in effect.variations {
            let (_, mut scene) = samples::scenes().into_iter().find(|(name, _)| *name == "sunlit").expect("a scene");
            let mut settings = samples::deferred();
            (variation.scene)(&mut scene);
            (variation.settings)(&mut settings);
            let plan = samples::plan(&scene, &settings);
            assert!((effect.is_in)(&plan.effects), "{}: {}", effect.name, variation.name);
        }
    }
}
