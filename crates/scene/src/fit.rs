//! A camera and light for a model that comes without either.
//!
//! An object is seen from three quarters with all in view that is drawn from there. A model that is a hall is seen from inside: its box is longer than wide,
//! and from a point near one end, at eye height, most rays in the horizontal and the one straight down meet the fronts of surfaces (an
//! object seen from within shows backs or nothing). The camera then stands there and looks along the hall.

#[cfg(feature = "readers")]
mod exposed;
pub(crate) mod ground;
#[cfg(feature = "readers")]
mod light;
mod studio;

use glam::{DQuat, DVec3, Vec3};
use rayon::prelude::*;

use super::{Aabb, Camera, Environment, Light, LightKind, Playing, Projection, Scene, framing};

#[cfg(feature = "readers")]
pub use exposed::{fit_emission, fit_exposure};
pub use ground::remove as remove_ground;
#[cfg(feature = "readers")]
pub use light::{LightChoice, light_model};
#[cfg(feature = "readers")]
use studio::add_studio_beside_lights;
pub use studio::{add_studio, drop_fitted_light, meter};

/// The direction from an object to its camera: three quarters.
const TOWARD_CAMERA: DVec3 = DVec3::new(1.0, 0.62, 1.0);
/// Moments of its clips at which a moving model is looked at.
const MOMENTS: u32 = 6;
/// A hall is at least this many times as long as wide.
const HALL_ELONGATION: f64 = 1.25;
/// Rays around the horizon, and how many of them must meet fronts.
const HORIZON_RAYS: usize = 16;
const HORIZON_HITS: usize = 12;
/// Heights of the eye to try, as shares of the hall's.
const EYE_HEIGHTS: [f64; 2] = [0.16, 0.3];
/// The camera's places along the hall, as shares of its length from either end.
const STANDS: [f64; 3] = [0.1, 0.16, 0.22];
/// Lux of the sun and nits of the sky light that goes with it.
const SUN_LUX: f32 = 100_000.0;
const SKY_NITS: f32 = 9_000.0;

/// The surroundings of a fitted camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraPlace {
    /// The camera stands in front of the model, in the open.
    Outside,
    /// The camera stands within the model's walls, where little of the sun comes.
    Inside,
}

/// Points the scene's camera at everything that is drawn while its clips play; an empty scene keeps its own camera.
pub fn fit_camera(scene: &mut Scene, aspect: f64) -> CameraPlace {
    let still = scene.at(&Playing::default());
    let bounds = still.model_bounds();
    if bounds.is_empty() || !bounds.radius().is_finite() {
        return CameraPlace::Outside;
    }
    let inside = hall_camera(&still, &bounds);
    let stand = if inside.is_some() { CameraPlace::Inside } else { CameraPlace::Outside };
    let camera = inside.unwrap_or_else(|| {
        let clips = scene.motion.usual_clips();
        let duration = scene.motion.duration(&clips);
        let times = if duration > 0.0 { MOMENTS } else { 1 };
        let at = |index: u32| duration * f64::from(index) / f64::from(times);
        let moment = |index| scene.at(&Playing { clips: clips.clone(), ..Playing::at(at(index)) });
        let moments: Vec<_> = (0..times).map(moment).collect();
        framing::frame(&moments, &bounds, TOWARD_CAMERA.normalize(), aspect)
    });
    drop(still);
    (scene.camera, scene.fitted.camera, scene.looks_through) = (camera, true, None);
    stand
}

/// Cameras on a level circle around a scene at rest, as many as asked for, the first from three quarters. Each of them sees everything that is
/// drawn. Returns no cameras for a scene in which nothing is drawn.
pub fn turntable(scene: &Scene, count: u32, aspect: f64) -> Vec<Camera> {
    let still = scene.at(&Playing { clips: scene.motion.usual_clips(), ..Playing::default() });
    let bounds = still.model_bounds();
    if bounds.is_empty() || !bounds.radius().is_finite() {
        return Vec::new();
    }
    let turn = |index: u32| DQuat::from_rotation_y(std::f64::consts::TAU * f64::from(index) / f64::from(count));
    let directions: Vec<DVec3> = (0..count).map(|index| turn(index) * TOWARD_CAMERA.normalize()).collect();
    framing::around(&still, &bounds, &directions, aspect)
}

/// A sun that slants in along the longer side, steep enough for the floor of an open court, and light from the sky.
pub fn add_daylight(scene: &mut Scene) {
    let size = scene.model_bounds().size();
    let (along, across) = if size.x >= size.z { (DVec3::X, DVec3::Z) } else { (DVec3::Z, DVec3::X) };
    let direction = (DVec3::NEG_Y + along * 0.3 + across * 0.22).normalize();
    scene.lights.push(Light {
        name: "sun".into(),
        kind: LightKind::Directional { direction },
        color: Vec3::new(1.0, 0.95, 0.87),
        intensity: SUN_LUX,
        casts_shadow: true,
        // The sun's angular diameter in degrees.
        size: 0.53,
    });
    scene.fitted.light = true;
    scene.environment = Environment {
        ambient: Vec3::new(0.8, 0.92, 1.1) * SKY_NITS,
        background: Vec3::new(0.45, 0.65, 1.0) * SKY_NITS * 2.0,
        ground: None,
    };
}

/// The camera inside, if the model is a hall.
fn hall_camera(scene: &Scene, bounds: &Aabb) -> Option<Camera> {
    let size = bounds.size();
    let (axis, length, width) = if size.x >= size.z { (DVec3::X, size.x, size.z) } else { (DVec3::Z, size.z, size.x) };
    if length < width * HALL_ELONGATION || size.y <= 0.0 {
        return None;
    }
    let surface = TriangleSoup::of(scene);
    let mut best: Option<(f64, Camera)> = None;
    for (height, stand, side) in EYE_HEIGHTS
        .iter()
        .flat_map(|&height| STANDS.iter().flat_map(move |&at| [-1.0, 1.0].map(|side| (height, at, side))))
    {
        let along = axis * side * (0.5 - stand) * length;
        let eye = DVec3::new(bounds.center().x, bounds.min.y + height * size.y, bounds.center().z) + along;
        // Of places with much the same view the first wins: lower, and nearer to the end.
        let least = best.as_ref().map_or(0.0, |(longest, _)| longest * 1.1);
        let Some(view) = surface.view_from(eye, -axis * side, least) else { continue };
        let target = eye - axis * side * length + DVec3::Y * (0.09 * length);
        let camera = Camera { projection: Projection::perspective(60.0), ..Camera::looking_at(eye, target, DVec3::Y) };
        best = Some((view, Camera { near: bounds.radius() * 1e-3, ..camera }));
    }
    best.filter(|(view, _)| *view > 0.33 * length).map(|(_, camera)| camera)
}

/// All triangles in world space, for a handful of rays: no hierarchy pays for itself.
struct TriangleSoup(Vec<[Vec3; 3]>, DVec3);

impl TriangleSoup {
    fn of(scene: &Scene) -> Self {
        let center = scene.bounds().center();
        let triangles = scene.objects.par_iter().flat_map_iter(|object| {
            let mesh = &scene.meshes[object.mesh];
            mesh.indices.as_chunks::<3>().0.iter().map(move |triangle| {
                triangle.map(|index| {
                    let place = mesh.origin + Vec3::from(mesh.positions[index as usize]).as_dvec3();
                    (object.transform.transform_point3(place) - center).as_vec3()
                })
            })
        });
        Self(triangles.collect(), center)
    }

    /// Returns the distance to the first surface along `forward` from a place inside a hall; none outside of one, or if it is not more than `least`.
    /// Each ray is tried on all triangles, so the one that most places fail at comes first, and no more are cast than decide.
    fn view_from(&self, eye: DVec3, forward: DVec3, least: f64) -> Option<f64> {
        let eye = (eye - self.1).as_vec3();
        let (view, _) = self.nearest(eye, forward.as_vec3())?;
        let view = Some(f64::from(view)).filter(|view| *view > least)?;
        let (_, is_floor) = self.nearest(eye, Vec3::NEG_Y)?;
        if !is_floor {
            return None;
        }
        let mut others = (0..HORIZON_RAYS).filter(|index| {
            let (sin, cos) = (*index as f32 / HORIZON_RAYS as f32 * std::f32::consts::TAU).sin_cos();
            !self.nearest(eye, Vec3::new(cos, 0.013, sin)).is_some_and(|(_, is_front)| is_front)
        });
        others.nth(HORIZON_RAYS - HORIZON_HITS).is_none().then_some(view)
    }

    /// Returns the distance of the nearest surface, and true if it shows its front.
    fn nearest(&self, origin: Vec3, direction: Vec3) -> Option<(f32, bool)> {
        let hits = self.0.par_iter().with_min_len(8192).filter_map(|triangle| intersect(origin, direction, triangle));
        hits.min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// Möller and Trumbore 1997; the front is the counter-clockwise side.
fn intersect(origin: Vec3, direction: Vec3, [a, b, c]: &[Vec3; 3]) -> Option<(f32, bool)> {
    let (edge_b, edge_c) = (b - a, c - a);
    let p = direction.cross(edge_c);
    let determinant = edge_b.dot(p);
    let to_origin = origin - a;
    let u = to_origin.dot(p) / determinant;
    let q = to_origin.cross(edge_b);
    let v = direction.dot(q) / determinant;
    let distance = edge_c.dot(q) / determinant;
    // Written so that the NaN of a degenerate triangle is no hit.
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0).then_some((distance, determinant > 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin::{self, shapes};
    use crate::{Material, Object};
    use glam::DAffine3;

    fn scene_of(mesh: shapes::MeshBuilder, transform: DAffine3) -> Scene {
        Scene {
            meshes: vec![mesh.finish("it")],
            materials: vec![Material::default()],
            objects: vec![Object::new("it", 0, 0, transform)],
            ..Scene::default()
        }
    }

    #[test]
    fn a_fitted_camera_has_the_whole_box_in_view_at_any_scale_and_shape() {
        for (size, aspect) in
            [([1.0, 1.0, 1.0], 16.0 / 9.0), ([50.0, 1.0, 3.0], 0.5), ([1e-6, 3e-6, 1e-6], 1.0), ([1e7, 1e6, 1e7], 2.0)]
        {
            let mut scene = scene_of(shapes::cuboid(size), DAffine3::from_translation(DVec3::splat(size[0] * 7.0)));
            fit_camera(&mut scene, aspect);
            let camera = scene.camera;
            let slope = camera.half_height();
            for corner in scene.bounds().corners() {
                let offset = corner - camera.position;
                let depth = offset.dot(camera.forward());
                assert!(depth > camera.near, "{size:?}");
                assert!(offset.dot(camera.up()).abs() <= slope * depth, "{size:?}");
                assert!(offset.dot(camera.right()).abs() <= slope * aspect * depth, "{size:?}");
            }
        }
    }

    #[test]
    fn a_hall_is_seen_from_inside_and_a_solid_from_outside() {
        let long = shapes::cuboid([20.0, 6.0, 8.0]);
        let mut solid = scene_of(long.clone(), DAffine3::IDENTITY);
        fit_camera(&mut solid, 1.5);
        assert!(solid.camera.position.length() > 12.0);
        // A mirrored box has its triangles' order kept here, so that its fronts face in.
        let mut hall = scene_of(long, DAffine3::IDENTITY);
        hall.meshes[0].indices.as_chunks_mut::<3>().0.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        fit_camera(&mut hall, 1.5);
        let inside = hall.camera.position;
        assert!(inside.x.abs() > 5.0 && inside.x.abs() < 10.0 && inside.y < 0.0, "{inside}");
        assert!(hall.camera.forward().x * inside.x < 0.0);
    }

    #[test]
    fn a_model_without_extent_still_gets_a_camera() {
        let mut scene = builtin::open("quad").unwrap();
        scene.meshes[0].positions.iter_mut().for_each(|p| *p = [0.0; 3]);
        scene.meshes[0].bounds = scene.meshes[0].compute_bounds();
        fit_camera(&mut scene, 1.5);
        assert!(scene.camera.near > 0.0 && scene.camera.position.is_finite());
    }
}
