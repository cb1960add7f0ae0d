//! Casters that shadow nothing visible, and the lifetime of maps without them.

use super::*;

/// The world and the plan of a scene, first without idle casters, then with them.
fn both(scene: &Scene, shadows: ShadowSettings) -> [(World, FramePlan); 2] {
    [Keep::NONE, Keep::NONE.with(OptionalPart::IdleCasters)].map(|keep| {
        let settings = Settings { keep, ..settings(shadows) };
        let plan = FramePlan::of(scene, &settings, &samples::software()).expect("a plan");
        (World::of(scene, &settings, &plan, 1.0), plan)
    })
}

/// Returns true if the segment between two points meets a box.
fn stands_between(bounds: &Aabb, from: DVec3, to: DVec3) -> bool {
    let ray = to - from;
    let (a, b) = ((bounds.min - from) / ray, (bounds.max - from) / ray);
    let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
    enter.max(0.0) <= leave.min(1.0)
}

proptest! {
    #[test]
    fn what_stands_between_a_light_and_a_point_in_view_is_needed(
        boxes in boxes(), small in proptest::collection::vec((vector(12.0), 0.05..1.0f64), 0..12), to in direction(), camera in camera(),
        lamp_at in vector(12.0), angle in 1.0..80.0f64, filter in 0..ShadowFilter::NAMES.len(), clamp: bool, cascades in 1..=3u32,
        inside in proptest::collection::vec([0.0..=1.0, 0.0..=1.0, 0.0..=1.0f64], 24),
    ) {
        let all: Vec<_> = boxes.into_iter().chain(small.into_iter().map(|(at, edge)| (at, DVec3::splat(edge)))).collect();
        let lights = vec![sun(to), lamp(lamp_at, Some(20.0)), spot(lamp_at, to, angle), beam(lamp_at, to, 0.1 * angle), lamp(-lamp_at, None)];
        let device = Capabilities { depth_clamp: clamp, ..samples::software() };
        let shadows = ShadowSettings { filter: ShadowFilter::NAMES[filter].1, cascades, ..ShadowSettings::default() };
        let settings = Settings { keep: Keep::NONE, ..settings(shadows) };
        let scene = scene(&all, lights);
        let plan = FramePlan::of(&scene, &settings, &device).expect("a plan");
        let world = World::of(&scene, &settings, &plan, 1.0);
        let shadow = plan.shadow.as_ref().expect("maps");
        let visible = Visible::of(&world, &camera, &plan);
        let drawn = |casters: Vec<Caster>| casters.iter().map(|own| own.object).collect::<Vec<_>>();
        let needed: Vec<Option<Vec<usize>>> =
            visible.shadows.iter().map(|view| Some(drawn(visible.needed(&world, shadow, view.as_ref()?)))).collect();
        for (receiver, object) in world.objects.iter().enumerate() {
            for point in inside.iter().map(|&t| object.bounds.min + DVec3::from(t) * object.bounds.size()) {
                let Some(distance) = seen_at(&camera, point) else { continue };
                for own in &shadow.lights {
                    let maps: Vec<usize> = (own.first_view..own.first_view + own.projection.views()).collect();
                    let (place, looked_up) = match world.lights[own.light].kind {
                        LightKind::Directional { direction } => {
                            let views = &visible.shadows[maps[0]..maps[0] + maps.len()];
                            let found = cascades_at(views, distance);
                            let is_found = |map: &usize| found.iter().flatten().any(|view| visible.shadows[*map].as_ref().is_some_and(|own| Arc::ptr_eq(own, view)));
                            (point - direction * 200.0, maps.into_iter().filter(is_found).collect::<Vec<_>>())
                        }
                        LightKind::Point { position, range, .. } => {
                            let ray = point - position;
                            let reached = ray.length() < range.unwrap_or(f64::INFINITY) && ray.length() > 1e-3;
                            (position, if reached { vec![maps[face_of(ray)]] } else { vec![] })
                        }
                        LightKind::Spot { position, direction, outer_angle_degrees, .. } => {
                            let ray = point - position;
                            let reached = ray.angle_between(direction).to_degrees() < outer_angle_degrees && ray.length() > 1e-3;
                            let face = match own.projection {
                                MapProjection::Cube => maps[face_of(ray)],
                                _ => maps[0],
                            };
                            (position, if reached { vec![face] } else { vec![] })
                        }
                        LightKind::Beam { position, direction, radius, range, .. } => {
                            let (ray, along) = (point - position, (point - position).dot(direction));
                            let reached = along > 1e-3 && along < range.unwrap_or(f64::INFINITY) && ray.cross(direction).length() < radius;
                            (point - direction * along, if reached { vec![maps[0]] } else { vec![] })
                        }
                    };
                    for map in looked_up {
                        let found = needed[map].as_ref();
                        prop_assert!(found.is_some(), "{} of {receiver}, map {map}: {point} is seen", own.name);
                        for (caster, other) in world.objects.iter().enumerate() {
                            let is_missing = found.is_some_and(|found| !found.contains(&caster));
                            prop_assert!(
                                !(is_missing && stands_between(&other.bounds, point, place)),
                                "{} of {caster} on {receiver} at {point}, map {map}", own.name
                            );
                        }
                    }
                }
            }
        }
    }
}

/// Blocks on a floor, in rows that lead away.
fn blocks() -> Vec<(DVec3, DVec3)> {
    let mut boxes = vec![(DVec3::new(0.0, -0.1, -40.0), DVec3::new(90.0, 0.2, 90.0))];
    for row in 0..12 {
        for column in 0..12 {
            let at = DVec3::new(f64::from(column) * 7.0 - 38.0, 1.0, f64::from(row) * -7.0);
            boxes.push((at, DVec3::new(2.0, 2.0, 2.0)));
        }
    }
    boxes
}

#[test]
fn casters_behind_the_camera_and_beside_what_it_sees_are_left_out() {
    let lights = vec![sun(DVec3::new(0.3, -1.0, 0.2).normalize()), lamp(DVec3::new(0.0, 6.0, -20.0), Some(60.0))];
    let scene = scene(&blocks(), lights);
    let camera = Camera {
        projection: Projection::perspective(40.0),
        ..Camera::looking_at(DVec3::new(0.0, 4.0, -30.0), DVec3::new(2.0, 0.0, -40.0), DVec3::Y)
    };
    let [lean, kept] = both(&scene, ShadowSettings::default()).map(|(world, plan)| {
        let visible = Visible::of(&world, &camera, &plan);
        let draws = ShadowCache::default().stale(&world, plan.shadow.as_ref().expect("maps"), &camera, &visible);
        let count = |lamp: bool| {
            draws.iter().filter(|draw| (draw.map >= 3) == lamp).map(|draw| draw.casters.len()).sum::<usize>()
        };
        (count(false), count(true), draws.iter().map(|draw| draw.idle).sum::<usize>(), draws.len())
    });
    println!("casters in cascades, in faces, left out, maps: {lean:?}; kept: {kept:?}");
    assert!(lean.0 * 2 < kept.0 && lean.1 * 2 < kept.1 && lean.2 > 0 && kept.2 == 0, "{lean:?} {kept:?}");
    assert!(lean.3 < kept.3, "faces in which nothing is seen are not drawn: {lean:?} {kept:?}");
}

/// Counts the maps, and the casters in them, that are drawn while a camera turns by `degrees` a frame.
fn turning(world: &World, plan: &FramePlan, degrees: f64, frames: u32) -> (usize, usize) {
    let shadow = plan.shadow.as_ref().expect("maps");
    let mut cache = ShadowCache::default();
    let (mut maps, mut casters) = (0, 0);
    for frame in 0..frames {
        let turn = DQuat::from_rotation_y((degrees * f64::from(frame)).to_radians());
        let place = DVec3::new(0.0, 4.0, -40.0);
        let camera = Camera::looking_at(place, place + turn * DVec3::new(0.0, -0.2, -1.0), DVec3::Y);
        let visible = Visible::of(world, &camera, plan);
        let draws = cache.stale(world, shadow, &camera, &visible);
        maps += draws.len();
        casters += draws.iter().map(|draw| draw.casters.len()).sum::<usize>();
        cache.keep(world, &camera, &visible, &draws);
        assert!(cache.stale(world, shadow, &camera, &visible).is_empty(), "the same frame again");
    }
    (maps, casters)
}

#[test]
fn a_turning_camera_draws_no_more_maps_than_with_all_casters() {
    let lamps = [DVec3::new(0.0, 6.0, -20.0), DVec3::new(12.0, 5.0, -45.0)].map(|at| lamp(at, Some(40.0)));
    let lights = [vec![sun(DVec3::new(0.3, -1.0, 0.2).normalize())], lamps.to_vec()].concat();
    let scene = scene(&blocks(), lights);
    for (degrees, frames) in [(0.01, 60), (0.2, 60), (1.0, 60), (6.0, 60), (40.0, 60)] {
        let [lean, kept] = both(&scene, ShadowSettings::default()).map(|(world, plan)| {
            (turning(&world, &plan, degrees, frames), plan.shadow.map_or(0, |shadow| shadow.tiles.len()))
        });
        println!(
            "{degrees} degrees a frame: {} maps with {} casters; kept: {} with {}",
            lean.0.0, lean.0.1, kept.0.0, kept.0.1
        );
        // Each map may be drawn once more, when the camera begins to turn.
        assert!(lean.0.0 <= kept.0.0 + kept.1, "{degrees}: {lean:?} {kept:?}");
        assert!(lean.0.1 <= kept.0.1 + kept.0.1 / 4, "{degrees}: {lean:?} {kept:?}");
    }
}

#[test]
fn a_map_stays_while_what_moves_is_not_in_it_and_not_needed() {
    let boxes = [
        (DVec3::new(0.0, -0.1, 0.0), DVec3::new(40.0, 0.2, 40.0)),
        (DVec3::new(0.0, 1.0, 0.0), DVec3::ONE),
        // Far beside the view, in the lamp's volume.
        (DVec3::new(15.0, 1.0, 0.0), DVec3::ONE),
    ];
    let scene = scene(&boxes, vec![lamp(DVec3::Y * 20.0, Some(60.0))]);
    let camera = Camera {
        projection: Projection::perspective(20.0),
        ..Camera::looking_at(DVec3::new(0.0, 3.0, 8.0), DVec3::ZERO, DVec3::Y)
    };
    let [(mut world, plan), _] = both(&scene, ShadowSettings::default());
    let shadow = plan.shadow.clone().expect("maps");
    let mut cache = ShadowCache::default();
    let mut frame = |world: &mut World, camera: &Camera| {
        world.refresh(&plan);
        let visible = Visible::of(world, camera, &plan);
        let draws = cache.stale(world, &shadow, camera, &visible);
        cache.keep(world, camera, &visible, &draws);
        draws.iter().map(|draw| (draw.casters.len(), draw.idle)).collect::<Vec<_>>()
    };
    let at = |index: usize, by: DVec3| DAffine3::from_translation(by) * scene.objects[index].transform;
    let first = frame(&mut world, &camera);
    assert!(!first.is_empty() && first.iter().any(|&(_, idle)| idle > 0), "{first:?}");
    world.move_object(2, &at(2, DVec3::X * 0.5)).expect("an object");
    assert_eq!(frame(&mut world, &camera), [], "it shadows nothing that is seen");
    // A caster in the map moves, then moves in each frame. A map that lasted gets all casters, a map that did not only the needed ones.
    world.move_object(1, &at(1, DVec3::X * 0.1)).expect("an object");
    let lasted = frame(&mut world, &camera);
    assert!(
        !lasted.is_empty() && lasted.iter().all(|&(_, idle)| idle == 0),
        "a map that lasted gets everything: {lasted:?}"
    );
    world.move_object(1, &at(1, DVec3::X * 0.2)).expect("an object");
    let moving = frame(&mut world, &camera);
    assert!(
        moving.iter().any(|&(_, idle)| idle > 0),
        "one that is drawn in each frame gets what is needed: {moving:?}"
    );
    // The object moves into the view: its map is needed now.
    world.move_object(2, &at(2, DVec3::X * -14.0)).expect("an object");
    assert!(!frame(&mut world, &camera).is_empty());
    assert_eq!(frame(&mut world, &camera), [], "a still frame");
}
