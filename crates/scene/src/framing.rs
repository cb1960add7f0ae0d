//! The surfaces of a scene that are seen from far away in some direction, weighted by how large they look, and the camera that holds them.

use std::borrow::Cow;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{Aabb, AlphaMode, Camera, Object, Projection, Scene};

/// Ratio of the picture's size to the framed part's.
const MARGIN: f64 = 1.2;
/// The share of the drawn area that may lie outside if the rest can then be seen from [`CLOSER`] times as near: a few far triangles do not make the
/// scene a speck.
const OUTLIERS: f64 = 0.01;
const CLOSER: f64 = 1.5;
/// The most triangles that are looked at; in larger scenes, every n-th one.
const MOST: usize = 300_000;

/// The width by which points and lines count beside triangles, as a share of the scene's radius. It is wider than a pixel, or a few points beside a
/// large triangle would be outliers.
const STROKE_WIDTH: f64 = 1.0 / 30.0;

/// Corners of triangles that face a camera, each with a third of the area that the triangle covers.
struct WeightedCorners(Vec<(DVec3, f64)>);

impl WeightedCorners {
    /// Collects the corners seen from `toward_camera`, of length 1, infinitely far away. Backs of one-sided surfaces and wholly clear surfaces are
    /// not drawn.
    fn of(scene: &Scene, toward_camera: DVec3, moments: usize) -> Self {
        let step = scene.triangle_count().div_ceil(MOST / moments).max(1);
        let objects: Vec<&Object> = scene.model_objects().collect();
        let objects = objects.into_par_iter().filter(|object| {
            let material = scene.materials.get(object.material);
            material.is_some_and(|material| {
                matches!(material.alpha_mode, AlphaMode::Opaque | AlphaMode::Glass) || material.alpha > 0.0
            })
        });
        let stroke_width = objects.clone().any(|object| scene.meshes[object.mesh].is_strokes);
        let stroke_width = if stroke_width { STROKE_WIDTH * scene.bounds().radius() } else { 0.0 };
        let corners = objects.flat_map_iter(|object| {
            let mesh = &scene.meshes[object.mesh];
            let two_sided = scene.materials[object.material].two_sided;
            let mirrored = object.transform.matrix3.determinant() < 0.0;
            mesh.indices.as_chunks::<3>().0.iter().step_by(step).flat_map(move |triangle| {
                let place = |index: u32| mesh.origin + Vec3::from(mesh.positions[index as usize]).as_dvec3();
                let [a, b, c] = triangle.map(|index| object.transform.transform_point3(place(index)));
                let facing = (b - a).cross(c - a).dot(toward_camera) * if mirrored { -0.5 } else { 0.5 };
                let area = match mesh.is_strokes {
                    true => 0.5 * stroke_width * ((b - a).reject_from(toward_camera).length() + stroke_width),
                    false if two_sided => facing.abs(),
                    false => facing,
                };
                let is_drawn = area > 0.0 && area.is_finite();
                is_drawn.then_some([a, b, c].map(|corner| (corner, area / 3.0))).into_iter().flatten()
            })
        });
        Self(corners.collect())
    }

    /// The values between which all but so large a share of the area lies, half of it beyond either end.
    fn range(&self, outliers: f64, value: impl Fn(DVec3) -> f64 + Sync) -> (f64, f64) {
        let mut values: Vec<(f64, f64)> = self.0.par_iter().map(|&(point, weight)| (value(point), weight)).collect();
        values.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let outside = 0.5 * outliers * values.iter().map(|(_, weight)| weight).sum::<f64>();
        let end = |mut values: Box<dyn Iterator<Item = &(f64, f64)> + '_>| {
            let mut passed = 0.0;
            values
                .find(|(_, weight)| {
                    passed += weight;
                    passed > outside
                })
                .map_or(0.0, |(value, _)| *value)
        };
        (end(Box::new(values.iter())), end(Box::new(values.iter().rev())))
    }
}

/// A camera of 35 degrees that looks from `toward_camera`, of length 1, at the surfaces drawn from there at all these moments of a scene, from the
/// least distance at which they are in view. `bounds` are the scene's, for one of which nothing is drawn from there.
pub(super) fn frame(moments: &[Cow<Scene>], bounds: &Aabb, toward_camera: DVec3, aspect: f64) -> Camera {
    let drawn: Vec<_> =
        moments.iter().flat_map(|scene| WeightedCorners::of(scene, toward_camera, moments.len()).0).collect();
    let drawn =
        WeightedCorners(if drawn.is_empty() { bounds.corners().map(|corner| (corner, 1.0)).into() } else { drawn });
    let [whole, most] = [0.0, OUTLIERS].map(|outliers| framing(&drawn, outliers, toward_camera, aspect));
    let (camera, radius) = if whole.distance > CLOSER * most.distance { most } else { whole }.place(toward_camera);
    // Reversed depth loses nothing by a near plane that is very near.
    Camera { near: (bounds.radius() * 1e-3).min(radius * 1e-2).max(f64::from(f32::MIN_POSITIVE)), ..camera }
}

/// Cameras of 35 degrees around a scene at rest, from the given directions of length 1. All look at the middle of its box, from the least common
/// distance at which each of them sees everything that is drawn.
pub(super) fn around(scene: &Scene, bounds: &Aabb, directions: &[DVec3], aspect: f64) -> Vec<Camera> {
    let center = bounds.center();
    let [slope_x, slope_y] = slopes(aspect);
    let looking = |toward: DVec3| Camera::looking_at(toward, DVec3::ZERO, DVec3::Y);
    let needed = |&toward: &DVec3| {
        let camera = looking(toward);
        let drawn = WeightedCorners::of(scene, toward, 1);
        let (right, up, forward) = (camera.right(), camera.up(), camera.forward());
        let distance = |&(point, _): &(DVec3, f64)| {
            let offset = point - center;
            (offset.dot(right).abs() / slope_x).max(offset.dot(up).abs() / slope_y) - offset.dot(forward)
        };
        drawn.0.iter().map(distance).fold(0.0, f64::max)
    };
    let least = bounds.radius().max(f64::MIN_POSITIVE);
    let distance = directions.iter().map(needed).fold(1.1 * least, f64::max);
    let near = (least * 1e-3).max(f64::from(f32::MIN_POSITIVE));
    let camera = |&toward: &DVec3| Camera {
        projection: Projection::perspective(DEGREES),
        position: center + toward * distance,
        near,
        ..looking(toward)
    };
    directions.iter().map(camera).collect()
}

/// The field of view of a fitted camera, in degrees.
const DEGREES: f64 = 35.0;

/// The slopes of the rays that hold the framed part: across and up.
fn slopes(aspect: f64) -> [f64; 2] {
    let up = (DEGREES / 2.0).to_radians().tan() / MARGIN;
    [up * if aspect.is_finite() && aspect > 0.0 { aspect } else { 1.0 }, up]
}

/// A camera, and the least distance from which it sees everything that is drawn.
struct Framing {
    camera: Camera,
    center: DVec3,
    radius: f64,
    distance: f64,
}

impl Framing {
    fn place(self, toward_camera: DVec3) -> (Camera, f64) {
        (Camera { position: self.center + toward_camera * self.distance, ..self.camera }, self.radius)
    }
}

fn framing(drawn: &WeightedCorners, outliers: f64, toward_camera: DVec3, aspect: f64) -> Framing {
    let camera = Camera {
        projection: Projection::perspective(DEGREES),
        ..Camera::looking_at(toward_camera, DVec3::ZERO, DVec3::Y)
    };
    let (right, up, forward) = (camera.right(), camera.up(), camera.forward());
    let axes = [right, up, forward].map(|axis| drawn.range(outliers, |point| point.dot(axis)));
    let middle = axes.map(|(low, high)| low * 0.5 + high * 0.5);
    let half = axes.map(|(low, high)| (high - low) * 0.5);
    let center = right * middle[0] + up * middle[1] + forward * middle[2];
    // A point at (x, y, z) from there, before a camera d away and c aside, is in view when |x - c| <= slope (d + z). The two ends of each axis are as near to
    // the picture's edges where c and d are these.
    let slopes = slopes(aspect);
    let held = |axis: DVec3, slope: f64| {
        let end = |side: f64| {
            let (_, needed) = drawn.range(outliers, |point| {
                let offset = point - center;
                side * offset.dot(axis) / slope - offset.dot(forward)
            });
            needed
        };
        let [high, low] = [1.0, -1.0].map(end);
        (axis * (0.5 * slope * (high - low)), 0.5 * (high + low))
    };
    let (across, of_width) = held(right, slopes[0]);
    let (along, of_height) = held(up, slopes[1]);
    let needed = of_width.max(of_height);
    let center = center + across + along;
    let radius = DVec3::from(half).length().max(f64::MIN_POSITIVE);
    // Not within it: a near plane must have room.
    Framing { camera, center, radius, distance: needed.max(half[2] * 1.1) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin::shapes;
    use crate::{Material, fit_camera, turntable};
    use glam::DAffine3;

    /// The extent of a scene's corners on the picture from a camera, as shares of its width and height, and the farthest from the middle.
    fn extent(scene: &Scene, camera: &Camera, aspect: f64) -> ([f64; 2], f64) {
        let slope = camera.half_height();
        let seen = scene.model_bounds().corners().map(|corner| {
            let offset = corner - camera.position;
            let depth = offset.dot(camera.forward());
            [offset.dot(camera.right()) / (slope * aspect * depth), offset.dot(camera.up()) / (slope * depth)]
        });
        let span = |axis: usize| {
            let ends =
                seen.iter().fold([f64::MAX, f64::MIN], |[low, high], own| [low.min(own[axis]), high.max(own[axis])]);
            0.5 * (ends[1] - ends[0])
        };
        let farthest = seen.iter().flatten().fold(0.0, |most: f64, own| most.max(own.abs()));
        ([span(0), span(1)], farthest)
    }

    fn boxed(size: [f64; 3]) -> Scene {
        Scene {
            meshes: vec![shapes::cuboid(size).finish("it")],
            materials: vec![Material::default()],
            objects: vec![Object::new("it", 0, 0, DAffine3::from_translation(DVec3::new(3.0, -2.0, 9.0)))],
            ..Scene::default()
        }
    }

    #[test]
    fn a_fitted_model_fills_four_fifths_of_the_shorter_side() {
        for (size, aspect) in [
            ([1.0; 3], 1.5),
            ([1.0, 9.0, 1.0], 1.5),
            ([9.0, 1.0, 1.0], 1.5),
            ([1.0, 1.0, 6.0], 0.6),
            ([2.0, 1e-9, 2.0], 1.0),
        ] {
            let mut scene = boxed(size);
            fit_camera(&mut scene, aspect);
            let ([across, up], farthest) = extent(&scene, &scene.camera, aspect);
            // Shares of the shorter side, which is the height where pictures are wide.
            let longest = (across * aspect.max(1.0)).max(up * (1.0 / aspect).max(1.0));
            assert!(longest > 0.75 && farthest < 0.9, "{size:?} {aspect}: {across} {up} {farthest}");
        }
    }

    #[test]
    fn a_turntable_goes_once_around_and_holds_the_model_at_every_angle() {
        let scene = boxed([3.0, 1.0, 0.5]);
        let cameras = turntable(&scene, 12, 1.5);
        assert_eq!(cameras.len(), 12);
        let center = scene.model_bounds().center();
        let distance = cameras[0].position.distance(center);
        let mut most: f64 = 0.0;
        for (index, camera) in cameras.iter().enumerate() {
            let (_, farthest) = extent(&scene, camera, 1.5);
            most = most.max(farthest);
            assert!((camera.position.distance(center) - distance).abs() < 1e-9 * distance, "{index}");
            assert!((camera.position.y - cameras[0].position.y).abs() < 1e-9 && farthest < 0.9, "{index}: {farthest}");
        }
        assert!(most > 0.75, "{most}");
        assert!(cameras[0].forward().dot(cameras[6].forward()) < 0.0);
        assert!(turntable(&Scene::default(), 4, 1.0).is_empty());
    }
}
