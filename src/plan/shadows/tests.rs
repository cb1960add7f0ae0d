use std::collections::BTreeSet;

use glam::DVec3;

use super::*;
use crate::plan::samples;
use crate::scene::{Falloff, Keep, LightKind, Material, OptionalPart};

fn three() -> ShadowSettings {
    ShadowSettings { cascades: 3, ..ShadowSettings::default() }
}

fn lamp(position: DVec3, range: Option<f64>) -> Light {
    let kind = LightKind::Point { position, range, falloff: Falloff::InverseSquare };
    Light { kind, casts_shadow: true, ..samples::sun() }
}

/// Narrow enough for one map.
fn spot() -> Light {
    let kind = LightKind::Spot {
        position: DVec3::X,
        direction: DVec3::Y,
        inner_angle_degrees: 0.0,
        outer_angle_degrees: 20.0,
        range: None,
        falloff: Falloff::InverseSquare,
    };
    Light { kind, casts_shadow: true, ..samples::sun() }
}

fn tiles_on(device: &Capabilities, lights: Vec<Light>, shadows: ShadowSettings) -> (Option<ShadowPlan>, Vec<String>) {
    let scene = samples::scene(vec![Material::default()], lights);
    let settings = Settings { shadows, keep: Keep::NONE.with(OptionalPart::IdleLights), ..Settings::default() };
    ShadowPlan::of(&scene, &settings, (&LightOrder::of(&scene, &settings), 0, false), device)
}

fn tiles_of(lights: Vec<Light>, shadows: ShadowSettings) -> (Option<ShadowPlan>, Vec<String>) {
    tiles_on(&samples::device(), lights, shadows)
}

#[test]
fn maps_do_not_overlap_and_fill_layers_before_new_ones_are_taken() {
    let lights = vec![lamp(DVec3::X, None), spot(), samples::sun(), lamp(DVec3::Z, None)];
    let (plan, warnings) = tiles_of(lights, three());
    let plan = plan.expect("maps");
    assert!(warnings.is_empty(), "{warnings:?}");
    // Three cascades, then 13 quarters.
    assert_eq!((plan.tiles.len(), plan.layers), (16, 3 + 4));
    let mut taken = BTreeSet::new();
    for tile in &plan.tiles {
        assert!(tile.layer < plan.layers && tile.x.max(tile.y) + tile.edge <= plan.size, "{tile:?}");
        let edge = plan.size / 2;
        let quarters = (0..tile.edge / edge).flat_map(|x| (0..tile.edge / edge).map(move |y| (x, y)));
        for (x, y) in quarters {
            assert!(taken.insert((tile.layer, tile.x / edge + x, tile.y / edge + y)), "{tile:?}");
        }
    }
}

#[test]
fn when_the_budget_is_spent_the_most_important_lights_have_maps_and_the_others_are_named() {
    let named = |name: &str, light: Light, intensity: f32| Light { name: name.into(), intensity, ..light };
    let lights = vec![
        named("dim", lamp(DVec3::X, None), 1.0),
        named("bright", lamp(DVec3::X, None), 100.0),
        named("sun", samples::sun(), 0.1),
        named("tiny", spot(), 0.01),
        named("dark", lamp(DVec3::X, None), 0.0),
        Light { casts_shadow: false, ..named("bare", lamp(DVec3::X, None), 1e9) },
    ];
    // Layers of 4 MiB: three cascades, then two layers for six faces, of which two tiles are left.
    let budget = |budget| ShadowSettings { size: 1024, budget, ..three() };
    let names = |plan: &Option<ShadowPlan>| -> Vec<String> {
        plan.iter().flat_map(|plan| plan.lights.iter().map(|light| light.name.clone())).collect()
    };
    let (plan, warnings) = tiles_of(lights.clone(), budget(20));
    assert_eq!(names(&plan), ["sun", "bright", "tiny"]);
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].starts_with("the light dim is without the shadow"), "{warnings:?}");
    assert!(warnings[0].contains("20 MiB") && warnings[0].contains("5 layers of 1024"), "{warnings:?}");
    assert!(plan.is_some_and(|plan| plan.bytes() == 20 << 20));
    // Not even all cascades.
    let (plan, warnings) = tiles_of(lights.clone(), budget(8));
    assert_eq!(
        plan.as_ref().map(|plan| (plan.lights[0].projection, plan.layers)),
        Some((MapProjection::Cascades(2), 2))
    );
    assert!(warnings.iter().any(|line| line.contains("sun is with fewer cascades")), "{warnings:?}");
    assert!(warnings.iter().any(|line| line.starts_with("each of the 3 lights bright, dim, tiny")), "{warnings:?}");
    let (plan, warnings) = tiles_of(lights, budget(1));
    assert!(plan.is_none() && warnings.len() == 1 && warnings[0].contains("no layer"), "{warnings:?}");
}

#[test]
fn there_are_no_more_maps_than_the_shader_has_room_for() {
    let lights: Vec<Light> = (0..40).map(|i| lamp(DVec3::X * f64::from(i), None)).collect();
    let (plan, warnings) = tiles_of(lights, ShadowSettings { size: 32, ..three() });
    assert_eq!(plan.map(|plan| plan.lights.len()), Some(MAX_SHADOW_VIEWS / 6));
    assert!(warnings[0].contains("and 14 more is without") && warnings[0].contains("128 maps"), "{warnings:?}");
}

#[test]
fn what_a_light_is_short_of_is_named() {
    let shadows = |budget| ShadowSettings { size: 32, budget, ..three() };
    let suns = |count| (0..count).map(|_| samples::sun()).collect::<Vec<_>>();
    // Three cascades each, of which the last sun has fewer: there is budget for thousands.
    let count = MAX_SHADOW_VIEWS / 3 + 1;
    let (plan, warnings) = tiles_of(suns(count), shadows(256));
    let last = plan.and_then(|plan| plan.lights.last().map(|light| light.projection));
    assert_eq!(last, Some(MapProjection::Cascades((MAX_SHADOW_VIEWS % 3) as u32)));
    assert!(warnings.len() == 1 && warnings[0].contains("fewer cascades"), "{warnings:?}");
    assert!(warnings[0].contains("maps are the most") && !warnings[0].contains("budget"), "{warnings:?}");
    // The device's layers, of which there are fewer than the budget would pay.
    let device = Capabilities { max_layers: 4, ..samples::device() };
    let (plan, warnings) = tiles_on(&device, suns(2), shadows(256));
    assert_eq!(plan.map(|plan| plan.layers), Some(4));
    assert!(warnings.len() == 1 && warnings[0].contains("device") && warnings[0].contains("4 layers"), "{warnings:?}");
    assert!(!warnings[0].contains("budget"), "{warnings:?}");
}

/// Plans maps under a sky that lights from `directions` directions.
fn tiles_under_sky(lights: Vec<Light>, directions: u32, budget: u32) -> (Option<ShadowPlan>, Vec<String>) {
    let scene = samples::scene(vec![Material::default()], lights);
    let shadows = ShadowSettings { size: 1024, budget, ..three() };
    let settings = Settings { shadows, ..Settings::default() };
    ShadowPlan::of(&scene, &settings, (&LightOrder::of(&scene, &settings), directions, false), &samples::device())
}

#[test]
fn directions_of_the_sky_have_a_quarter_each_of_what_lights_leave() {
    let (plan, warnings) = tiles_under_sky(vec![samples::sun(), spot()], 8, 64);
    let plan = plan.expect("maps");
    // Three cascades, a quarter for the spot, and eight more.
    assert_eq!((plan.sky_views(), plan.layers, plan.tiles.len()), (4..12, 3 + 3, 12));
    assert!(warnings.is_empty() && plan.tiles[4..].iter().all(|tile| tile.edge == 512), "{warnings:?}");
    // Layers of 4 MiB, of which the sun takes three and the spot and seven directions two.
    let (plan, warnings) = tiles_under_sky(vec![samples::sun(), spot()], 8, 20);
    assert_eq!(plan.map(|plan| (plan.lights.len(), plan.sky_views())), Some((2, 4..11)));
    assert!(warnings.len() == 1 && warnings[0].starts_with("7 of 8 directions of the sky"), "{warnings:?}");
    // Alone, and without room.
    let (plan, _) = tiles_under_sky(Vec::new(), 8, 64);
    assert_eq!(plan.map(|plan| (plan.lights.len(), plan.sky_views(), plan.layers)), Some((0, 0..8, 2)));
    let (plan, warnings) = tiles_under_sky(Vec::new(), 8, 1);
    assert!(plan.is_none() && warnings[0].contains("no layer"), "{warnings:?}");
}

#[test]
fn the_sky_has_shadows_in_pictures_of_many_frames_and_where_asked_for() {
    let mut scene = samples::scene(vec![Material::default()], vec![samples::sun()]);
    let image = crate::scene::SkyImage::of("even", 4, |_| DVec3::ONE).into();
    let sky = crate::scene::Sky { image, rotation_degrees: 0.0, nits: 1.0, lights: true, shown: true, sun: None };
    let directions = |scene: &Scene, settings: Settings| {
        samples::plan(scene, &settings).shadow.map_or(0, |shadow| shadow.sky_views().len())
    };
    let (one, many) = (samples::deferred(), Settings { samples: 8, ..samples::deferred() });
    assert_eq!(directions(&scene, many.clone()), 0, "there is no sky");
    scene.sky = Some(sky.clone());
    assert_eq!((directions(&scene, one.clone()), directions(&scene, many.clone())), (0, 16));
    let most = Settings { samples: 32, ..samples::deferred() };
    assert_eq!(directions(&scene, most), 8);
    assert_eq!(directions(&scene, Settings { taa: true, ..one.clone() }), 16);
    assert_eq!(directions(&scene, Settings { sky_shadows: Some(3), ..one }), 3);
    assert_eq!(directions(&scene, Settings { sky_shadows: Some(0), ..many.clone() }), 0);
    assert_eq!(directions(&scene, Settings { sky_light: false, ..many.clone() }), 0, "it lights nothing");
    // A plan without lights that have maps leaves their code out.
    scene.lights.clear();
    let plan = samples::plan(&scene, &many);
    assert!(plan.has_sky_shadows() && !plan.has_light_maps() && !plan.has_directional_shadows());
    scene.objects.iter_mut().for_each(|object| object.casts_shadow = CastsShadow::No);
    assert_eq!(directions(&scene, many), 0, "nothing hides any of it");
}
