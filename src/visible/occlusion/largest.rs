//! The objects that cover the most of a picture: what the device draws first, to find out what is hidden behind them.

use super::view::{Cells, View};
use crate::scene::{Aabb, Camera};
use crate::visible::frustum::Frustum;
use crate::visible::{Depth, World};

/// What is drawn: objects whose boxes cover this share of the picture or more, the largest first, until one of the sums is reached.
const LEAST_SHARE: f64 = 0.004;
const MOST_OBJECTS: usize = 512;
const MOST_TRIANGLES: usize = 65536;

/// The places in the world's list of what hides others the most, in the order of the list.
pub(in crate::visible) fn largest(
    world: &World,
    (camera, frustum, depth): (&Camera, &Frustum, &Depth),
    size: [u32; 2],
) -> Vec<usize> {
    let (view, list) = (View::of(camera, depth, size), &world.instances);
    let all = Cells { columns: (0, view.columns - 1), rows: (0, view.rows - 1) };
    let least = LEAST_SHARE * all.count() as f64;
    let covers = |place: usize| {
        let object = &world.objects[list.object(place)];
        // A mask's holes are known where it is shaded.
        if object.transparent || object.key.masked {
            return None;
        }
        let cells = match view.footprint(&object.bounds) {
            Some((cells, _)) => cells?.count(),
            None => all.count(),
        };
        (cells as f64 >= least).then_some((cells, place, object.triangles))
    };
    let may_cover = |bounds: &Aabb, largest| view.is_large(bounds, largest, least) && frustum.may_see(bounds);
    let mut found: Vec<_> = list.places_where(may_cover).filter_map(covers).collect();
    // Of equally large ones the first in the list.
    found.sort_unstable_by_key(|&(cells, place, _)| (std::cmp::Reverse(cells), place));
    let mut triangles = 0;
    let fits = |&(_, _, own): &(usize, usize, usize)| {
        let is_in = triangles + own <= MOST_TRIANGLES;
        triangles += if is_in { own } else { 0 };
        is_in
    };
    let mut places: Vec<usize> = found.into_iter().filter(fits).take(MOST_OBJECTS).map(|(_, place, _)| place).collect();
    places.sort_unstable();
    places
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DQuat, DVec3};
    use proptest::prelude::*;

    use super::*;
    use crate::plan::FramePlan;
    use crate::plan::samples::{self, vector};
    use crate::scene::{Culling, Settings};

    proptest! {
        #[test]
        fn what_covers_much_of_the_picture_is_found_wherever_it_is_in_the_tree(
            objects in proptest::collection::vec((vector(20.0), 0.01..3.0f64), 1..200),
            turn in vector(3.0), parallel in any::<bool>(),
        ) {
            let mut scene = samples::scene(vec![crate::scene::Material::default()], vec![samples::sky()]);
            let first = scene.objects[0].clone();
            scene.objects = objects.iter().map(|&(place, size)| {
                let transform = DAffine3::from_scale_rotation_translation(DVec3::splat(size), DQuat::from_scaled_axis(place), place);
                crate::scene::Object { transform, ..first.clone() }
            }).collect();
            let projection = if parallel { crate::scene::Projection::orthographic(10.0) } else { scene.camera.projection };
            scene.camera = Camera { projection, rotation: DQuat::from_scaled_axis(turn), ..scene.camera };
            let settings = Settings { culling: Culling::Gpu, ..Settings::default() };
            let plan = FramePlan::of(&scene, &settings, &samples::device()).expect("a plan");
            let world = World::of(&scene, &settings, &plan, 1.0);
            let (frustum, depth) = (Frustum::of(&scene.camera, 16.0 / 9.0), Depth::of(&world, &plan, &scene.camera));
            let found = largest(&world, (&scene.camera, &frustum, &depth), [1280, 720]);
            let view = View::of(&scene.camera, &depth, [1280, 720]);
            let least = LEAST_SHARE * (view.columns * view.rows) as f64;
            let list = &world.instances;
            let is_large = |&place: &usize| {
                let bounds = &world.objects[list.object(place)].bounds;
                let is_seen = match view.footprint(bounds) {
                    Some((cells, _)) => cells.is_some_and(|cells| cells.count() as f64 >= least),
                    None => true,
                };
                is_seen && frustum.may_see(bounds) && view.is_large(bounds, bounds.radius(), least)
            };
            prop_assert_eq!(found, (0..list.opaque_count()).filter(is_large).collect::<Vec<_>>());
        }
    }
}
