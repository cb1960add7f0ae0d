//! The objects that cover the most of a picture: the device draws them first, as occluders of the others.

use super::view::OcclusionView;
use crate::scene::{Aabb, Camera};
use crate::visible::frustum::Frustum;
use crate::visible::{DepthMapping, World};

/// The occluders are the objects that cover at least this share of the picture, the largest first, up to these numbers of objects and triangles. A
/// larger object is left out if it has too many triangles.
const LEAST_SHARE: f64 = 0.004;
const MOST_OBJECTS: usize = 128;
const MOST_TRIANGLES: usize = 32768;
/// Objects that are considered, as some may hide nothing.
const MOST_TRIED: usize = 4 * MOST_OBJECTS;

/// The places in the world's list of the best occluders, in the order of the list. The size of an object is the square around its box's sphere.
pub(in crate::visible) fn largest(
    world: &World,
    (camera, frustum, depth): (&Camera, &Frustum, &DepthMapping),
    size: [u32; 2],
) -> Vec<usize> {
    let (view, list) = (OcclusionView::of(camera, depth, size), &world.instances);
    let least = LEAST_SHARE * (view.columns * view.rows) as f64;
    let size = |bounds: &Aabb, largest: f64| {
        let size = view.size(bounds, largest);
        (size >= least && frustum.may_see(bounds)).then_some(size)
    };
    let mut triangles = 0;
    let hides = |place: &usize| {
        let object = &world.objects[list.object(*place)];
        // The holes of a mask are known only when it is shaded.
        let is_in = !object.transparent && !object.key.masked && triangles + object.triangles <= MOST_TRIANGLES;
        triangles += if is_in { object.triangles } else { 0 };
        is_in
    };
    let mut places: Vec<usize> = list.largest_first(size).take(MOST_TRIED).filter(hides).take(MOST_OBJECTS).collect();
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
            let (frustum, depth) = (Frustum::of(&scene.camera, 16.0 / 9.0), DepthMapping::of(&world, &plan, &scene.camera));
            let found = largest(&world, (&scene.camera, &frustum, &depth), [1280, 720]);
            let view = OcclusionView::of(&scene.camera, &depth, [1280, 720]);
            let least = LEAST_SHARE * (view.columns * view.rows) as f64;
            let list = &world.instances;
            let size = |place: usize| {
                let bounds = &world.objects[list.object(place)].bounds;
                let size = view.size(bounds, bounds.radius());
                (size >= least && frustum.may_see(bounds)).then_some(size)
            };
            let mut sizes: Vec<f64> = (0..list.opaque_count()).filter_map(size).collect();
            sizes.sort_by(|a, b| b.total_cmp(a));
            sizes.truncate(MOST_OBJECTS);
            let mut own: Vec<f64> = found.into_iter().map(|place| size(place).expect("it is large")).collect();
            own.sort_by(|a, b| b.total_cmp(a));
            prop_assert_eq!(own, sizes);
        }
    }
}
