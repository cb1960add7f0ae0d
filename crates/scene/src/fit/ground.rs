//! A ground that is seen only by the shadows and the occlusion that fall on it: it sends the background's light wherever nothing is in the way.

use glam::{DAffine3, DVec3, Vec3};

use crate::sky::Studio;
use crate::{Aabb, Brdf, CastsShadow, Material, Mesh, Object, Playing, Scene};

/// The ground's albedo if the studio is the only light: the code 186 of 8-bit sRGB, which a G-buffer keeps exactly. If a model's own lights are
/// exposed for, too, the albedo is code 214.
pub const ALBEDO: f32 = 0.4910208;
pub const ALBEDO_BESIDE_LIGHTS: f32 = 0.672_443_2;
/// Corners of the disc.
const CORNERS: u32 = 64;
/// The disc's radius over the model's: a fitted camera sees no end of it.
const REACH: f64 = 16.0;
/// The ground's depth below the model's lowest point, as a share of the model's radius, so that it does not z-fight with a flat underside.
const BELOW: f64 = 1e-3;

/// Radiance of a ground of this albedo, and so of the background, in nits, in a studio of strength 1.
pub fn radiance(albedo: f32) -> f32 {
    albedo * Studio::get().ground_white as f32
}

/// Puts a ground of this albedo below a model in the studio.
pub fn add(scene: &mut Scene, albedo: f32) {
    let bounds = moved_bounds(scene);
    let radius = bounds.radius();
    if bounds.is_empty() || !radius.is_finite() || radius <= 0.0 {
        return;
    }
    let center = DVec3 { y: bounds.min.y - BELOW * radius, ..bounds.center() };
    let corner = |index: u32| {
        let (sin, cos) = (f64::from(index) / f64::from(CORNERS) * std::f64::consts::TAU).sin_cos();
        DVec3::new(cos, 0.0, -sin) * (REACH * radius)
    };
    let points: Vec<DVec3> = std::iter::once(DVec3::ZERO).chain((0..CORNERS).map(corner)).collect();
    let indices = (0..CORNERS).flat_map(|index| [0, 1 + index, 1 + (index + 1) % CORNERS]).collect();
    let normals = vec![[0.0, 1.0, 0.0]; points.len()];
    let mesh = Mesh { indices, normals, ..Mesh::from_points("ground", &points) };
    let material = Material {
        name: "ground".into(),
        base_color: Vec3::splat(albedo),
        brdf: Brdf::Lambert,
        metallic: 0.0,
        ..Material::default()
    };
    scene.fitted.ground = Some(scene.objects.len());
    scene.objects.push(Object {
        casts_shadow: CastsShadow::No,
        ..Object::new("ground", scene.meshes.len(), scene.materials.len(), DAffine3::from_translation(center))
    });
    scene.meshes.push(mesh);
    scene.materials.push(material);
}

/// Takes a [fitted](crate::FittedParts::ground) ground away again.
pub fn remove(scene: &mut Scene) {
    let Some(own) = scene.fitted.ground.take().filter(|own| own + 1 == scene.objects.len()) else { return };
    let object = scene.objects.remove(own);
    if object.mesh + 1 == scene.meshes.len() && object.material + 1 == scene.materials.len() {
        scene.meshes.pop();
        scene.materials.pop();
    }
}

/// The box around the model at moments of its clips.
fn moved_bounds(scene: &Scene) -> Aabb {
    let clips = scene.motion.usual_clips();
    let duration = scene.motion.duration(&clips);
    let times = if duration > 0.0 { super::MOMENTS } else { 1 };
    let at = |index: u32| duration * f64::from(index) / f64::from(times);
    let moment = |index| scene.at(&Playing { clips: clips.clone(), ..Playing::at(at(index)) }).model_bounds();
    (0..times).map(moment).fold(Aabb::EMPTY, |all, own| all.union(&own))
}
