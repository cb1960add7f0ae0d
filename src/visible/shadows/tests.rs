mod idle;
mod materials;

use std::sync::Arc;

use glam::{DAffine3, DMat3, DQuat, DVec3, Vec4};
use proptest::prelude::*;

use super::views::*;
use super::*;
use crate::plan::{
    Capabilities, FramePlan, MapProjection,
    samples::{self, vector},
};
use crate::scene::{
    Aabb, Camera, CastsShadow, Falloff, Keep, Light, LightKind, Material, Object, OptionalPart, Projection, Scene,
    Settings, ShadowFilter, ShadowSettings,
};
use crate::visible::{Visible, World};

const ASPECT: f64 = 16.0 / 9.0;

/// A scene of boxes under some lights.
fn scene(boxes: &[(DVec3, DVec3)], lights: Vec<Light>) -> Scene {
    let mut scene: Scene = samples::scene(vec![Material::default(); boxes.len()], lights);
    // The mesh of the samples is the unit square; here it stands for the unit cube that its box says.
    scene.meshes[0].bounds = Aabb { min: DVec3::ZERO, max: DVec3::ONE };
    let place = |object: &mut Object, (center, size): &(DVec3, DVec3)| {
        object.transform = DAffine3::from_scale_rotation_translation(*size, DQuat::IDENTITY, *center - *size * 0.5);
    };
    scene.objects.iter_mut().zip(boxes).for_each(|(object, at)| place(object, at));
    scene
}

/// Most of these tests are about maps, whether or not anything is seen in them.
fn settings(shadows: ShadowSettings) -> Settings {
    let keep = Keep::NONE.with(OptionalPart::IdleLights).with(OptionalPart::IdleCasters);
    Settings { size: [1600, 900], shadows, keep, ..Settings::default() }
}

/// Three cascades: a first one, a last one, and one between; and a lookup that reaches far.
fn three() -> ShadowSettings {
    let filter = ShadowFilter::Box3;
    ShadowSettings { cascades: 3, filter, normal_offset: 2.0, ..ShadowSettings::default() }
}

fn planned(scene: &Scene, shadows: ShadowSettings, device: &Capabilities) -> (World, FramePlan) {
    let settings = settings(shadows);
    let plan = FramePlan::of(scene, &settings, device).expect("a plan");
    (World::of(scene, &settings, &plan, 1.0), plan)
}

fn sun(direction: DVec3) -> Light {
    Light { kind: LightKind::Directional { direction }, ..samples::sun() }
}

fn lamp(position: DVec3, range: Option<f64>) -> Light {
    let kind = LightKind::Point { position, range, falloff: Falloff::InverseSquare };
    Light { kind, casts_shadow: true, ..samples::sun() }
}

fn beam(position: DVec3, direction: DVec3, radius: f64) -> Light {
    let kind = LightKind::Beam { position, direction, radius, edge: 0.0, range: Some(30.0) };
    Light { kind, casts_shadow: true, ..samples::sun() }
}

fn spot(position: DVec3, direction: DVec3, outer_angle_degrees: f64) -> Light {
    let falloff = Falloff::InverseSquare;
    let kind =
        LightKind::Spot { position, direction, inner_angle_degrees: 0.0, outer_angle_degrees, range: None, falloff };
    Light { kind, casts_shadow: true, ..samples::sun() }
}

/// As a plan's world sees it, on a device that can or cannot clamp depth.
fn world(boxes: &[(DVec3, DVec3)], direction: DVec3, depth_clamp: bool) -> (World, FramePlan) {
    let device = Capabilities { depth_clamp, ..samples::device() };
    planned(&scene(boxes, vec![sun(direction)]), three(), &device)
}

fn direction() -> impl Strategy<Value = DVec3> {
    vector(1.0).prop_filter_map("too short", |v| (v.length() > 0.1).then(|| v.normalize()))
}

fn boxes() -> impl Strategy<Value = Vec<(DVec3, DVec3)>> {
    let size = [0.0..8.0, 0.0..8.0, 0.01..8.0].prop_map(DVec3::from);
    proptest::collection::vec((vector(30.0), size), 1..6)
}

fn camera() -> impl Strategy<Value = Camera> {
    (vector(40.0), vector(10.0), 20.0..100.0f64).prop_map(|(position, target, fov_y_degrees)| Camera {
        projection: Projection::perspective(fov_y_degrees),
        ..Camera::looking_at(position, target, DVec3::Y)
    })
}

/// Returns the cube face that a ray from the light goes through, by its longest axis, as the shader's `cube_face`.
fn face_of(ray: DVec3) -> usize {
    let axis = ray.abs().max_position();
    2 * axis + usize::from(ray[axis] < 0.0)
}

/// u, v in texels of the layer and depth, and w.
fn map(view: &ShadowView, point: DVec3) -> (DVec3, f64) {
    let [u, v, depth, w] = view.rows.map(|row| row.truncate().dot(point) + row.w);
    (DVec3::new(u, v, depth) / w, w)
}

/// Texels between a point and the nearest edge of the map; negative outside.
fn room(view: &ShadowView, at: DVec3) -> f64 {
    let low = at.truncate() - DVec3::new(f64::from(view.tile.x), f64::from(view.tile.y), 0.0).truncate();
    low.min(f64::from(view.tile.edge) - low).min_element()
}

/// The distance along the view, of a point that the camera sees.
fn seen_at(camera: &Camera, point: DVec3) -> Option<f64> {
    let offset = point - camera.position;
    let distance = offset.dot(camera.forward());
    let tan_y = camera.half_height();
    let inside = distance >= camera.near
        && offset.dot(camera.up()).abs() <= distance * tan_y
        && offset.dot(camera.right()).abs() <= distance * tan_y * ASPECT;
    inside.then_some(distance)
}

/// The cascades that the shader looks up for a surface so far away: one, or two where they blend.
fn cascades_at(views: &[Option<Arc<ShadowView>>], distance: f64) -> Vec<Option<Arc<ShadowView>>> {
    let end = |view: &Option<Arc<ShadowView>>| view.as_ref().map_or(0.0, |view| view.end);
    let blend = |view: &Option<Arc<ShadowView>>| view.as_ref().map_or(0.0, |view| view.blend);
    let last = views.len() - 1;
    let index = (0..last).find(|&index| distance <= end(&views[index])).unwrap_or(last);
    let mut found = vec![views[index].clone()];
    if index < last && distance > blend(&views[index]) {
        found.push(views[index + 1].clone());
    }
    found
}

proptest! {
    #[test]
    fn all_that_the_camera_sees_lies_in_its_cascade_with_room_for_the_filter(
        boxes in boxes(), sun in direction(), camera in camera(), clamp: bool,
        inside in proptest::collection::vec([0.0..1.0, 0.0..1.0, 0.0..1.0f64], 32),
    ) {
        let (world, plan) = world(&boxes, sun, clamp);
        let views = Visible::of(&world, &camera, &plan).shadows;
        for object in &world.objects {
            for point in inside.iter().map(|&t| object.bounds.min + DVec3::from(t) * object.bounds.size()) {
                let Some(distance) = seen_at(&camera, point) else { continue };
                for view in cascades_at(&views, distance) {
                    let view = view.expect("something is seen in this cascade");
                    let (at, w) = map(&view, point);
                    prop_assert!(w == 1.0 && (0.0..=1.0).contains(&at.z), "{at}");
                    // 3x3 texels around it, and the offset along the normal.
                    prop_assert!(room(&view, at) >= 2.0, "{at}");
                }
            }
        }
    }

    #[test]
    fn without_clamping_nothing_lies_before_the_near_plane(
        boxes in boxes(), sun in direction(), camera in camera(),
    ) {
        let (world, plan) = world(&boxes, sun, false);
        for view in Visible::of(&world, &camera, &plan).shadows.iter().flatten() {
            for corner in world.objects.iter().flat_map(|object| object.bounds.corners()) {
                prop_assert!(map(view, corner).0.z <= 1.0);
            }
        }
    }

    #[test]
    fn what_stands_between_a_light_and_its_map_is_a_caster(
        boxes in boxes(), to in direction(), camera in camera(), lamp_at in vector(20.0), angle in 1.0..60.0f64,
        inside in [0.0..1.0, 0.0..1.0, 0.0..1.0f64], clamp: bool,
    ) {
        let device = Capabilities { depth_clamp: clamp, ..samples::device() };
        let lights = vec![sun(to), lamp(lamp_at, Some(30.0)), spot(lamp_at, to, angle), beam(lamp_at, to, angle)];
        let (world, plan) = planned(&scene(&boxes, lights), three(), &device);
        for view in Visible::of(&world, &camera, &plan).shadows.iter().flatten() {
            for (index, object) in world.objects.iter().enumerate() {
                let point = object.bounds.min + DVec3::from(inside) * object.bounds.size();
                let (at, w) = map(view, point);
                let in_range = view.reach.is_none_or(|(place, range)| place.distance(point) <= range);
                let reaches = w > 0.0 && room(view, at) > 0.0 && at.z > 0.0 && in_range;
                let is_caster = view.casters.iter().any(|caster| caster.object == index);
                prop_assert!(is_caster || !reaches, "{at}");
            }
        }
    }

    #[test]
    fn a_beam_sees_all_that_it_lights_in_one_map_with_room_for_the_filter(
        boxes in boxes(), at in vector(20.0), to in direction(), radius in 0.01..9.0f64, range in proptest::option::of(0.1..50.0f64),
        beside in 0.0..1.0f64, turn in 0.0..6.2f64, inside in [0.0..1.0, 0.0..1.0, 0.0..1.0f64],
    ) {
        let kind = LightKind::Beam { position: at, direction: to, radius, edge: 0.0, range };
        let light = Light { kind, casts_shadow: true, ..samples::sun() };
        let (world, plan) = planned(&scene(&boxes, vec![light]), three(), &samples::device());
        let shadow = plan.shadow.as_ref().expect("a map");
        let view = lamp_views(&world, shadow, &[], &Changes::default()).pop().flatten().expect("a beam has a map");
        prop_assert!(!view.clamps && !view.is_perspective());
        // As far along it as points of what there is.
        for object in &world.objects {
            let point = object.bounds.min + DVec3::from(inside) * object.bounds.size();
            let along = (point - at).dot(to);
            let (side, up) = to.any_orthonormal_pair();
            let lit = at + to * along + (side * turn.cos() + up * turn.sin()) * (radius * beside);
            if along > 1e-6 && along < range.unwrap_or(f64::INFINITY) {
                let (found, w) = map(&view, lit);
                prop_assert!(w == 1.0 && found.z > 0.0 && found.z < 1.0, "{found}");
                prop_assert!(room(&view, found) >= 2.0, "{found} of {:?}", view.tile);
            }
        }
    }

    #[test]
    fn a_point_light_sees_every_direction_in_one_face_and_a_spot_its_whole_cone(
        lamp_at in vector(20.0), to in direction(), ray in direction(), angle in 0.1..60.0f64, far in 0.1..50.0f64,
    ) {
        let point = lamp_at + ray * far;
        let lights = vec![lamp(lamp_at, None), spot(lamp_at, to, angle)];
        let (world, plan) = planned(&scene(&[(DVec3::ZERO, DVec3::ONE)], lights), three(), &samples::device());
        let shadow = plan.shadow.as_ref().expect("maps");
        let views = &Visible::of(&world, &Camera::default(), &plan).shadows;
        for light in &shadow.lights {
            let own = &views[light.first_view..light.first_view + light.projection.views()];
            let (face, lit) = match light.projection {
                MapProjection::Cube => (face_of(ray), true),
                _ => (0, to.angle_between(ray).to_degrees() <= angle),
            };
            if lit {
                let view = own[face].as_ref().expect("a map");
                let (at, w) = map(view, point);
                prop_assert!(w > 0.0 && at.z > 0.0 && at.z < 1.0, "{at} {w}");
                prop_assert!(room(view, at) >= 2.9, "{at} of {:?}", view.tile);
                // Similar triangles: a texel's edge grows with the distance along the axis.
                let (next, _) = map(view, point + view.rows[0].truncate().reject_from(view.rows[3].truncate()).normalize() * view.texel * w);
                prop_assert!(((next - at).x - 1.0).abs() < 1e-6, "{at} {next}");
            }
        }
    }

    #[test]
    fn a_walking_and_turning_camera_does_not_move_texels_over_the_world(
        boxes in boxes(), sun in direction(), camera in camera(), step in vector(0.5), turn in vector(0.4), point in vector(30.0),
        walks: bool, turns: bool, cascades in 1..=4u32, clamp: bool,
    ) {
        let device = Capabilities { depth_clamp: clamp, ..samples::device() };
        let shadows = ShadowSettings { cascades, ..three() };
        let (world, plan) = planned(&scene(&boxes, vec![self::sun(sun)]), shadows, &device);
        let sphere = |camera: &Camera| camera.position.distance(world.bounds.center()) <= world.bounds.radius();
        for cascade in 0..cascades as usize {
            let mut before: Option<(Arc<ShadowView>, Camera)> = None;
            for i in 0..24 {
                let (walked, turned) = (f64::from(i) * f64::from(u8::from(walks)), f64::from(i) * f64::from(u8::from(turns)));
                let ahead = DQuat::from_scaled_axis(turn * turned) * camera.forward();
                let place = camera.position + step * walked;
                let moved = Camera { projection: camera.projection, ..Camera::looking_at(place, place + ahead, DVec3::Y) };
                let Some(view) = Visible::of(&world, &moved, &plan).shadows[cascade].clone() else { continue };
                let (origin, _) = map(&view, DVec3::ZERO);
                let corner = origin.truncate();
                prop_assert!((corner - corner.round()).abs().max_element() < 1e-6, "{corner}");
                if let Some((before, place)) = &before {
                    // The size is the same while the camera only turns, and while it walks inside the sphere around the scene.
                    if !walks || (sphere(&moved) && sphere(place)) {
                        prop_assert_eq!((view.texel, view.end, view.blend), (before.texel, before.end, before.blend));
                    }
                    if view.texel == before.texel {
                        let slid = (map(&view, point).0 - map(before, point).0).truncate();
                        prop_assert!((slid - slid.round()).abs().max_element() < 1e-5, "{slid}");
                    }
                }
                before = Some((view, moved));
            }
        }
    }

    #[test]
    fn a_map_of_the_whole_scene_stays_wherever_the_camera_is(
        boxes in boxes(), sun in direction(), a in camera(), b in camera(), clamp: bool,
    ) {
        let device = Capabilities { depth_clamp: clamp, ..samples::device() };
        let shadows = ShadowSettings { cascades: 1, ..three() };
        let (world, plan) = planned(&scene(&boxes, vec![self::sun(sun)]), shadows, &device);
        let views = [a, b].map(|camera| Visible::of(&world, &camera, &plan).shadows);
        // A slice as long as the scene is as wide as it; a narrow view from inside may need less.
        if let [Some(a), Some(b)] = [&views[0][0], &views[1][0]] {
            let whole = world.bounds.transformed(&DAffine3::from_mat3(light_axes(sun))).size().truncate().max_element();
            let usable = f64::from(a.tile.edge) - 2.0 * plan.shadow.as_ref().map_or(0.0, |shadow| shadow.margin(a.tile.edge, &world.shadows)) - 1.0;
            for view in [a, b] {
                prop_assert!(view.texel * usable <= whole.max(1e-6 * world.radius) * (1.0 + 1e-9), "{} {whole}", view.texel * usable);
            }
            let is_whole = |view: &ShadowView| view.texel * usable >= whole * (1.0 - 1e-9);
            if is_whole(a) && is_whole(b) {
                prop_assert!(a.lies_as(b) && a.casters == b.casters);
            }
        }
    }

    #[test]
    fn the_sphere_around_a_slice_holds_its_corners_and_touches_them(
        camera in camera(), begin in 0.01..20.0f64, long in 0.01..50.0f64,
    ) {
        let end = begin + long;
        let sphere = Sphere::around(&camera, ASPECT, begin, end);
        let distances = view_corners(&camera, ASPECT, begin, end).map(|corner| corner.distance(sphere.center));
        let farthest = distances.into_iter().fold(0.0, f64::max);
        prop_assert!((farthest / sphere.radius - 1.0).abs() < 1e-9, "{distances:?} {}", sphere.radius);
    }

    #[test]
    fn a_widened_box_holds_what_moved_and_grows_in_steps(boxes in boxes(), to in vector(200.0)) {
        let all = |boxes: &[(DVec3, DVec3)]| Aabb::of_points(boxes.iter().flat_map(|(c, s)| [*c - *s * 0.5, *c + *s * 0.5]));
        let at_first = all(&boxes);
        let mut moved = boxes.clone();
        moved[0].0 = to;
        let (bounds, wide) = (all(&moved), widened(&at_first, &all(&moved)));
        prop_assert!(wide.union(&bounds) == wide && wide.union(&at_first) == wide, "{wide:?}");
        let by = (at_first.min.x - wide.min.x) / at_first.radius();
        prop_assert!(((1.0 + by).log2() * 4.0 - ((1.0 + by).log2() * 4.0).round()).abs() < 1e-6, "{by}");
        prop_assert_eq!(widened(&at_first, &boxes[..1].iter().fold(at_first, |all, _| all)), at_first);
    }

    #[test]
    fn lookups_and_the_map_agree_on_every_point(
        boxes in boxes(), to in direction(), camera in camera(), lamp_at in vector(20.0),
        turn in vector(3.0), scale in [0.1..3.0, 0.1..3.0, -3.0..-0.1f64], shift in vector(20.0), vertex in vector(3.0),
    ) {
        let lights = vec![sun(to), lamp(lamp_at, None), spot(lamp_at, to, 30.0)];
        let (world, plan) = planned(&scene(&boxes, lights), three(), &samples::device());
        let rotation = DQuat::from_scaled_axis(turn);
        let transform = DAffine3::from_scale_rotation_translation(scale.into(), rotation, shift);
        let point = transform.transform_point3(vertex);
        // The value of a row, and the error of rounding it to f32: 2^-24 of each term.
        let value = |row: Vec4, p: DVec3| {
            let row = row.as_dvec4();
            let terms = row.truncate() * p;
            (terms.element_sum() + row.w, 6e-8 * (terms.abs().element_sum() + row.w.abs()))
        };
        for view in Visible::of(&world, &camera, &plan).shadows.iter().flatten() {
            let exact = view.rows.map(|row| row.truncate().dot(point) + row.w);
            let (texel_rows, clip_rows) = (view.texel_rows(&camera), view.clip_rows(&transform));
            let edge = f64::from(view.tile.edge);
            let corner = [view.tile.x, view.tile.y].map(f64::from);
            for axis in 0..4 {
                let (texel, rounding) = value(texel_rows[axis], point - camera.position);
                prop_assert!((texel - exact[axis]).abs() <= rounding + 1e-9, "row {axis}: {texel} {exact:?}");
                let (clip, rounding) = value(clip_rows[axis], vertex);
                let mapped = match axis {
                    0 | 1 => (exact[axis] - corner[axis] * exact[3]) * 2.0 / edge - exact[3],
                    _ => exact[axis],
                };
                prop_assert!((clip - mapped).abs() <= rounding + 1e-9, "row {axis}: {clip} {mapped}");
            }
        }
    }

    #[test]
    fn splits_ascend_from_near_to_far(
        near in 1e-3..10.0f64, factor in 1.0..1e6f64, lambda in 0.0..=1.0f32, count in 1..=4u32,
    ) {
        let far = near * factor;
        let ends: Vec<f64> = (1..=count).map(|index| split(near, far, lambda, index, count)).collect();
        prop_assert!(ends.windows(2).all(|pair| pair[0] <= pair[1]) && ends[0] > 0.0, "{ends:?}");
        prop_assert!((ends[ends.len() - 1] / far - 1.0).abs() < 1e-9, "{ends:?} {far}");
    }
}

#[test]
fn cascades_reach_as_far_from_anywhere_inside_a_scene_and_follow_the_camera_in_steps_outside() {
    let extent = Aabb { min: DVec3::splat(-10.0), max: DVec3::splat(10.0) };
    let radius = extent.radius();
    let end = |distance: f64| farthest(&extent, &Camera { position: DVec3::X * distance, ..Camera::default() });
    for distance in [0.0, 0.3 * radius, 0.99 * radius] {
        assert_eq!(end(distance), 2.0 * radius, "{distance}");
    }
    for distance in [1.01 * radius, 3.0 * radius, 100.0 * radius] {
        let (end, needed) = (end(distance), distance + radius);
        let quarters = 4.0 * end.log2();
        assert!((quarters - quarters.round()).abs() < 1e-9, "{end}");
        assert!(end >= needed && end < 1.19 * needed, "{end}, {needed}");
    }
}

#[test]
fn maps_are_right_handed_and_deeper_away_from_the_light() {
    let lights = vec![sun(DVec3::NEG_Y), lamp(DVec3::Y * 3.0, None), spot(DVec3::Y * 3.0, DVec3::NEG_Y, 30.0)];
    let scene = scene(&[(DVec3::ZERO, DVec3::ONE)], lights);
    let (world, plan) = planned(&scene, three(), &samples::device());
    let camera = Camera::looking_at(DVec3::new(0.0, 2.0, 4.0), DVec3::ZERO, DVec3::Y);
    let views = Visible::of(&world, &camera, &plan).shadows;
    let down = |view: &&Arc<ShadowView>| map(view, DVec3::Y).1 > 0.0 && view.rows[1].y.abs() < view.rows[0].length();
    assert!(views.iter().flatten().filter(down).count() >= 3);
    for view in views.iter().flatten() {
        // An orthographic map has no axis in its w; there the depth falls along it.
        let axis = match view.rows[3].truncate() {
            DVec3::ZERO => -view.rows[2].truncate(),
            axis => axis,
        };
        let axes = DMat3::from_cols(view.rows[0].truncate(), view.rows[1].truncate(), axis);
        assert!(axes.determinant() > 0.0, "{:?}", view.rows);
        let along = axis.normalize();
        let start = camera.position.reject_from(along) + along * 50.0;
        let (near, far) = (map(view, start).0.z, map(view, start + along).0.z);
        assert!(far < near, "{near} {far}");
    }
}

#[test]
fn where_nothing_is_seen_there_is_no_cascade() {
    let (world, plan) = world(&[(DVec3::ZERO, DVec3::ONE)], DVec3::NEG_Y, true);
    let away = Camera::looking_at(DVec3::Z * 5.0, DVec3::Z * 10.0, DVec3::Y);
    let visible = Visible::of(&world, &away, &plan);
    assert!(visible.shadows.len() == 3 && visible.shadows.iter().all(Option::is_none) && visible.draws.is_empty());
    assert_eq!(visible.culled, 1);
}

#[test]
fn what_stands_close_to_a_lamp_in_a_huge_scene_is_behind_its_near_plane() {
    for (radius, range) in [(1e5, None), (1e5, Some(5e4)), (1e-3, None)] {
        let boxes = [(DVec3::ZERO, DVec3::splat(radius)), (DVec3::splat(radius * 0.1), DVec3::splat(radius * 0.01))];
        for depth_clamp in [true, false] {
            let lights = vec![lamp(DVec3::ZERO, range), spot(DVec3::ZERO, DVec3::Y, 40.0)];
            let device = Capabilities { depth_clamp, ..samples::device() };
            let (world, plan) = planned(&scene(&boxes, lights), three(), &device);
            let views = Visible::of(&world, &Camera::default(), &plan).shadows;
            // Over each lamp, by a hundred-thousandth of the scene's extent and by a part that is larger.
            for above in [1e-5, 5e-6, 1e-6].map(|share| DVec3::Y * share * radius) {
                let over = views.iter().flatten().filter(|view| map(view, above).1 > 0.99 * above.y);
                assert_eq!(over.clone().count(), 2);
                for view in over {
                    let depth = map(view, above).0.z;
                    assert!(depth > 0.0 && depth < 1.0, "{depth} {} m above the lamp", above.y);
                }
            }
        }
    }
}

#[test]
fn which_lights_have_maps_does_not_depend_on_where_a_frame_is_drawn_from() {
    let scene = scene(&[(DVec3::ZERO, DVec3::ONE)], samples::shadowed_lamps());
    let (world, plan) = planned(&scene, three(), &samples::device());
    let views = |x: f64| {
        let camera = Camera::looking_at(DVec3::new(x, 2.0, 4.0), DVec3::ZERO, DVec3::Y);
        Visible::of(&world, &camera, &plan).shadows
    };
    // Even the content of lamps' maps does not change.
    assert!(views(1.0)[3..].iter().zip(&views(-9.0)[3..]).all(|(a, b)| a == b && a.is_some()));
}

#[test]
fn only_maps_in_which_something_moved_are_drawn_again() {
    let boxes = [(DVec3::ZERO, DVec3::ONE), (DVec3::X * 4.0, DVec3::ONE), (DVec3::X * -9.0, DVec3::ONE)];
    let lights = vec![sun(DVec3::NEG_Y), lamp(DVec3::X * 2.0, Some(3.0))];
    let scene = scene(&boxes, lights.clone());
    let (mut world, plan) = planned(&scene, three(), &samples::device());
    let camera = Camera::looking_at(DVec3::new(0.0, 8.0, 20.0), DVec3::ZERO, DVec3::Y);
    let mut cache = ShadowCache::default();
    let mut redrawn = |world: &mut World, camera: &Camera| {
        world.refresh(&plan);
        let visible = Visible::of(world, camera, &plan);
        let stale = cache.stale(world, plan.shadow.as_ref().expect("maps"), camera, &visible);
        cache.keep(world, camera, &visible, &stale);
        let cascades = stale.iter().filter(|draw| draw.map < 3).count();
        (cascades, stale.len() - cascades, visible.shadows[..3].iter().flatten().count())
    };
    let (first, faces, seen) = redrawn(&mut world, &camera);
    assert_eq!((first, faces), (seen, 6), "at first there is nothing");
    assert_eq!(redrawn(&mut world, &camera), (0, 0, seen), "a still frame");
    // Out of the lamp's range.
    let moved = |index: usize, by: DVec3| DAffine3::from_translation(by) * scene.objects[index].transform;
    world.move_object(2, &moved(2, DVec3::X * 0.01)).expect("an object");
    let (cascades, faces, _) = redrawn(&mut world, &camera);
    assert!(cascades >= 1 && faces == 0, "{cascades} {faces}");
    // Inside the lamp's face towards -X, and beyond its edges.
    world.move_object(0, &moved(0, DVec3::X * 0.01)).expect("an object");
    let (_, faces, _) = redrawn(&mut world, &camera);
    assert!((1..6).contains(&faces), "{faces}");
    // A light that moves redraws all of its faces; a light that only changes its strength redraws none.
    world.set_light(1, &lamp(DVec3::X * 2.1, Some(3.0))).expect("a light");
    assert_eq!(redrawn(&mut world, &camera).1, 6);
    world.set_light(1, &Light { intensity: 5.0, ..lamp(DVec3::X * 2.1, Some(3.0)) }).expect("a light");
    assert_eq!(redrawn(&mut world, &camera), (0, 0, seen));
}

#[test]
fn maps_in_which_nothing_moved_are_kept_and_the_others_are_as_if_all_were_made_anew() {
    let boxes: Vec<(DVec3, DVec3)> =
        (0..6).map(|i| (DVec3::new(f64::from(i) * 3.0 - 8.0, 0.0, 1.0), DVec3::ONE)).collect();
    let lights =
        vec![lamp(DVec3::X * -6.0, Some(3.0)), lamp(DVec3::X * 6.0, None), spot(DVec3::Y * 4.0, DVec3::X, 20.0)];
    let scene = scene(&boxes, lights);
    let (mut world, plan) = planned(&scene, three(), &samples::device());
    let shadow = plan.shadow.as_ref().expect("maps");
    let camera = Camera::default();
    let mut before = Visible::of(&world, &camera, &plan).shadows;
    let mut kept_by_moves = Vec::new();
    for (object, to) in [(0, DVec3::X * -9.0), (5, DVec3::Y * 5.0), (2, DVec3::Z * -2.0), (3, DVec3::splat(40.0))] {
        let transform = DAffine3::from_translation(to) * scene.objects[object].transform;
        world.move_object(object, &transform).expect("an object");
        world.refresh(&plan);
        let after = Visible::of(&world, &camera, &plan).shadows;
        assert_eq!(after, lamp_views(&world, shadow, &[], &Changes::default()));
        let kept = before.iter().zip(&after).filter(|pair| match pair {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            _ => false,
        });
        kept_by_moves.push(kept.count());
        before = after;
    }
    assert!(kept_by_moves.iter().all(|&kept| (3..13).contains(&kept)), "{kept_by_moves:?}");
    // A light that changes has its own made anew; that nothing is asked for keeps all.
    world.set_light(0, &lamp(DVec3::X * -5.0, Some(3.0))).expect("a light");
    world.refresh(&plan);
    let after = Visible::of(&world, &camera, &plan).shadows;
    assert_eq!(after, lamp_views(&world, shadow, &[], &Changes::default()));
    let anew = before.iter().zip(&after).filter(|(a, b)| !Arc::ptr_eq(a.as_ref().unwrap(), b.as_ref().unwrap()));
    assert_eq!(anew.count(), 6);
}

#[test]
fn a_change_that_needs_another_plan_is_told_and_what_is_not_there_is_an_error() {
    let scene = scene(&[(DVec3::ZERO, DVec3::ONE)], vec![lamp(DVec3::X, None)]);
    let (mut world, _) = planned(&scene, three(), &samples::device());
    assert!(world.move_object(1, &DAffine3::IDENTITY).is_err());
    let mirror = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    assert!(!world.move_object(0, &mirror).expect("an object"));
    for light in [lamp(DVec3::X, Some(1.0)), sun(DVec3::X), Light { casts_shadow: false, ..lamp(DVec3::X, None) }] {
        assert!(!world.set_light(0, &light).expect("a light"), "{light:?}");
    }
    assert!(world.set_light(1, &lamp(DVec3::X, None)).is_err());
    // A light that goes dark stays in place, and may shine again.
    for light in [Light { intensity: 0.0, ..lamp(DVec3::X, None) }, lamp(DVec3::Y, None)] {
        assert!(world.set_light(0, &light).expect("a light"));
    }
}

#[test]
fn an_object_that_casts_none_is_in_no_map() {
    let mut scene = scene(&[(DVec3::ZERO, DVec3::ONE), (DVec3::Y, DVec3::ONE)], samples::shadowed_lamps());
    scene.objects[1].casts_shadow = CastsShadow::No;
    let (world, plan) = planned(&scene, three(), &samples::device());
    let camera = Camera::looking_at(DVec3::new(0.0, 2.0, 4.0), DVec3::ZERO, DVec3::Y);
    let views = Visible::of(&world, &camera, &plan).shadows;
    let casters: Vec<usize> =
        views.iter().flatten().flat_map(|view| view.casters.iter().map(|caster| caster.object)).collect();
    assert!(!casters.is_empty() && !casters.contains(&1), "{casters:?}");
}

#[test]
fn casters_come_in_the_order_of_how_far_from_the_light_they_reach() {
    // The tower's middle is nearer to the light than the hut's, and its foot is farther.
    let boxes = [(DVec3::ZERO, DVec3::new(1.0, 10.0, 1.0)), (DVec3::new(3.0, -2.0, 0.0), DVec3::ONE)];
    let above = DVec3::Y * 15.0;
    for light in [sun(-DVec3::Y), spot(above, -DVec3::Y, 40.0), lamp(above, None), beam(above, -DVec3::Y, 6.0)] {
        let (world, plan) = planned(&scene(&boxes, vec![light.clone()]), three(), &samples::device());
        let camera = Camera::looking_at(DVec3::new(0.0, 2.0, 20.0), DVec3::ZERO, DVec3::Y);
        let views = Visible::of(&world, &camera, &plan).shadows;
        let orders = views.iter().flatten().map(|view| view.casters.iter().map(|caster| caster.object).collect());
        let orders: Vec<Vec<usize>> = orders.filter(|order: &Vec<usize>| order.len() == 2).collect();
        assert!(!orders.is_empty() && orders.iter().all(|order| *order == [1, 0]), "{light:?}: {orders:?}");
    }
}

#[test]
fn a_ground_that_reaches_beyond_all_casters_leaves_their_order() {
    let ground = (DVec3::new(0.0, -0.1, 0.0), DVec3::new(1000.0, 0.1, 1000.0));
    let boxes = [(DVec3::new(6.0, 1.0, 0.0), DVec3::ONE), (DVec3::new(3.0, 1.0, 0.0), DVec3::ONE), ground];
    for light in [lamp(DVec3::Y, None), spot(DVec3::Y, DVec3::X, 40.0)] {
        let (world, plan) = planned(&scene(&boxes, vec![light.clone()]), three(), &samples::device());
        let camera = Camera::looking_at(DVec3::new(0.0, 2.0, 20.0), DVec3::ZERO, DVec3::Y);
        let views = Visible::of(&world, &camera, &plan).shadows;
        let orders = views.iter().flatten().map(|view| view.casters.iter().map(|caster| caster.object).collect());
        let orders: Vec<Vec<usize>> = orders.filter(|order: &Vec<usize>| order.len() == 3).collect();
        assert_eq!(orders, [[1, 0, 2]], "{light:?}");
    }
}

/// A map each, which holds the whole scene, is kept while its direction stays, and is drawn anew when another takes its place.
#[test]
fn directions_of_the_sky_see_all_of_the_scene_and_are_drawn_when_they_change() {
    let mut scene = scene(&[(DVec3::ZERO, DVec3::ONE), (DVec3::X * 4.0, DVec3::ONE)], Vec::new());
    let image = crate::scene::SkyImage::of("even", 8, |_| DVec3::ONE).into();
    scene.sky =
        Some(crate::scene::Sky { image, rotation_degrees: 0.0, nits: 1.0, lights: true, shown: true, sun: None });
    let settings = Settings { sky_shadows: Some(4), ..settings(three()) };
    let plan = samples::plan(&scene, &settings);
    let mut world = World::of(&scene, &settings, &plan, 1.0);
    let camera = Camera::looking_at(DVec3::new(2.0, 2.0, 12.0), DVec3::new(2.0, 0.0, 0.0), DVec3::Y);
    let shadow = plan.shadow.as_ref().expect("maps");
    let mut cache = ShadowCache::default();
    let mut frame = |world: &World| {
        let visible = Visible::of(world, &camera, &plan);
        let draws = cache.stale(world, shadow, &camera, &visible);
        cache.keep(world, &camera, &visible, &draws);
        (visible, draws.len())
    };
    let (visible, drawn) = frame(&world);
    assert_eq!((visible.shadows.len(), drawn, frame(&world).1), (4, 4, 0));
    for (view, direction) in visible.shadows.iter().flatten().zip(&world.sky_directions) {
        assert_eq!(view.casters.len(), 2);
        let toward = view.texel_rows(&camera)[2].truncate().as_dvec3().normalize();
        assert!(toward.distance(direction.to_light) < 1e-6, "{toward} {}", direction.to_light);
        for corner in [world.bounds.min, world.bounds.max] {
            assert!(room(view, map(view, corner).0) > 0.0, "{corner}");
        }
    }
    world.aim_sky(&plan, 1);
    assert_eq!((frame(&world).1, frame(&world).1), (4, 0));
}
