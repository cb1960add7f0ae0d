//! What one camera sees of a scene: culled, sorted, and the sun's map fitted to it.

use glam::{DAffine3, DVec3};

use super::{FramePlan, GeometryKey, SunView};
use crate::scene::{Aabb, AlphaMode, Camera, Environment, Light, LightKind, Material, Scene, Settings, ShadowSettings};

/// What of a scene a frame looks at again each time. No vertices and no texels.
#[derive(Debug, Clone)]
pub struct World {
    pub objects: Vec<WorldObject>,
    pub materials: Vec<Material>,
    /// Only those that shine: the sun that casts the shadow first, then directional lights, then the others.
    pub lights: Vec<Light>,
    pub environment: Environment,
    pub bounds: Aabb,
    pub shadows: ShadowSettings,
    /// From nits to what is tone-mapped.
    pub exposure: f32,
}

/// An object that can be drawn.
#[derive(Debug, Clone)]
pub struct WorldObject {
    pub mesh: usize,
    pub material: usize,
    /// From the mesh's f32 vertices to the world.
    pub transform: DAffine3,
    pub bounds: Aabb,
    pub key: GeometryKey,
    pub triangles: usize,
}

impl World {
    /// `exposure` is the factor from nits to what is tone-mapped.
    pub fn of(scene: &Scene, settings: &Settings, plan: &FramePlan, exposure: f32) -> Self {
        let objects: Vec<WorldObject> = scene
            .objects
            .iter()
            .filter(|object| !is_cut_away(&scene.materials[object.material]))
            .filter(|object| !scene.meshes[object.mesh].indices.is_empty())
            .map(|object| {
                let mesh = &scene.meshes[object.mesh];
                WorldObject {
                    mesh: object.mesh,
                    material: object.material,
                    transform: object.transform * DAffine3::from_translation(mesh.origin),
                    bounds: object.bounds(&scene.meshes),
                    key: GeometryKey::of(scene, object, settings, plan),
                    triangles: mesh.indices.len() / 3,
                }
            })
            .collect();
        let bounds = objects.iter().fold(Aabb::EMPTY, |all, object| all.union(&object.bounds));
        Self {
            objects,
            materials: scene.materials.clone(),
            lights: Self::sorted(&scene.lights),
            environment: scene.environment,
            bounds,
            shadows: settings.shadows,
            exposure,
        }
    }

    /// Whether a light can add anything.
    pub fn shines(light: &Light) -> bool {
        light.intensity > 0.0 && light.color.max_element() > 0.0
    }

    /// The light whose shadow is drawn: the first directional one that casts any.
    pub fn sun_of(lights: &[Light]) -> Option<&Light> {
        lights.iter().find(|light| {
            light.casts_shadow && Self::shines(light) && matches!(light.kind, LightKind::Directional { .. })
        })
    }

    fn sorted(lights: &[Light]) -> Vec<Light> {
        let sun = Self::sun_of(lights);
        let mut sorted: Vec<&Light> = lights.iter().filter(|light| Self::shines(light)).collect();
        // Stable: lights of a kind keep the scene's order, and with it their sum its rounding.
        sorted.sort_by_key(|light| match light.kind {
            _ if sun.is_some_and(|sun| std::ptr::eq(sun, *light)) => 0,
            LightKind::Directional { .. } => 1,
            _ => 2,
        });
        sorted.into_iter().cloned().collect()
    }

    /// How many of the first lights are directional.
    pub fn directional_count(&self) -> usize {
        self.lights.iter().take_while(|light| matches!(light.kind, LightKind::Directional { .. })).count()
    }
}

/// An alpha below the cut-off that no texture changes: nothing of the object is there.
fn is_cut_away(material: &Material) -> bool {
    match material.alpha_mode {
        AlphaMode::Mask { cutoff } => material.base_color_texture.is_none() && material.alpha < cutoff,
        AlphaMode::Opaque => false,
    }
}

/// A reference to an object to be drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Draw {
    /// Index into [`World::objects`].
    pub object: usize,
}

/// The lists of one frame.
#[derive(Debug, Clone, Default)]
pub struct Visible {
    /// By pipeline, then material, then from near to far, so that early depth tests save the most.
    pub draws: Vec<Draw>,
    /// What the sun's map must hold.
    pub casters: Vec<Draw>,
    pub sun: Option<SunView>,
    pub culled: usize,
}

impl Visible {
    pub fn of(world: &World, camera: &Camera, plan: &FramePlan) -> Self {
        let aspect = f64::from(plan.size[0]) / f64::from(plan.size[1]);
        let frustum = Frustum::of(camera, aspect);
        let mut seen: Vec<(usize, f64)> = world
            .objects
            .iter()
            .enumerate()
            .filter(|(_, object)| frustum.may_see(&object.bounds))
            .map(|(index, object)| (index, (object.bounds.center() - camera.position).length_squared()))
            .collect();
        let rank = |&(index, distance): &(usize, f64)| {
            let object = &world.objects[index];
            (object.key, object.material, distance)
        };
        seen.sort_by(|a, b| {
            let ((key_a, material_a, near_a), (key_b, material_b, near_b)) = (rank(a), rank(b));
            near_a.total_cmp(&near_b).then((key_a, material_a).cmp(&(key_b, material_b))).then(a.0.cmp(&b.0))
        });
        let sun = plan.shadow.and_then(|size| {
            let boxes = seen.iter().map(|&(index, _)| world.objects[index].bounds);
            SunView::fit(world, camera, aspect, size, boxes)
        });
        let casters = sun.as_ref().map(|sun| casters_of(world, sun)).unwrap_or_default();
        Self {
            culled: world.objects.len() - seen.len(),
            draws: seen.into_iter().map(|(object, _)| Draw { object }).collect(),
            casters,
            sun,
        }
    }

    pub fn triangles(&self, world: &World) -> usize {
        self.draws.iter().map(|draw| world.objects[draw.object].triangles).sum()
    }
}

fn casters_of(world: &World, sun: &SunView) -> Vec<Draw> {
    let mut casters: Vec<usize> =
        (0..world.objects.len()).filter(|&index| sun.may_shadow(&world.objects[index].bounds)).collect();
    // Opaque casters first: one pipeline change.
    casters.sort_by_key(|&index| {
        let object = &world.objects[index];
        (object.key.masked, object.material, index)
    });
    casters.into_iter().map(|object| Draw { object }).collect()
}

/// The planes of a view volume without far plane; normals point inside.
struct Frustum {
    planes: [(DVec3, f64); 5],
}

impl Frustum {
    fn of(camera: &Camera, aspect: f64) -> Self {
        let tan_y = (camera.fov_y_degrees.to_radians() * 0.5).tan();
        let tan_x = tan_y * aspect;
        let (forward, right, up) = (camera.forward(), camera.right(), camera.up());
        // A side plane holds the camera and a ray along the frustum's side.
        let side = |normal: DVec3| (normal, -normal.dot(camera.position));
        Self {
            planes: [
                (forward, -forward.dot(camera.position) - camera.near),
                side((forward * tan_x - right).normalize()),
                side((forward * tan_x + right).normalize()),
                side((forward * tan_y - up).normalize()),
                side((forward * tan_y + up).normalize()),
            ],
        }
    }

    /// False only if the box is wholly behind one plane. The slack keeps rounding from cutting what touches a plane.
    fn may_see(&self, bounds: &Aabb) -> bool {
        let slack = 1e-9 * (bounds.center().length() + bounds.radius());
        let (center, half) = (bounds.center(), bounds.size() * 0.5);
        self.planes.iter().all(|(normal, distance)| normal.dot(center) + distance + normal.abs().dot(half) >= -slack)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_box_at(center: DVec3) -> Aabb {
        Aabb { min: center - 0.5, max: center + 0.5 }
    }

    #[test]
    fn a_box_is_seen_in_front_of_the_camera_and_not_behind_or_beside_it() {
        let camera = Camera { position: DVec3::ZERO, ..Camera::default() };
        let frustum = Frustum::of(&camera, 1.0);
        assert!(frustum.may_see(&unit_box_at(DVec3::new(0.0, 0.0, -5.0))));
        assert!(!frustum.may_see(&unit_box_at(DVec3::new(0.0, 0.0, 5.0))));
        assert!(!frustum.may_see(&unit_box_at(DVec3::new(20.0, 0.0, -5.0))));
        assert!(!frustum.may_see(&unit_box_at(DVec3::new(0.0, -20.0, -5.0))));
    }

    #[test]
    fn a_box_around_the_camera_and_one_far_away_are_seen() {
        let camera = Camera { position: DVec3::splat(1e6), ..Camera::default() };
        let frustum = Frustum::of(&camera, 2.0);
        assert!(frustum.may_see(&unit_box_at(camera.position)));
        assert!(frustum.may_see(&unit_box_at(camera.position + DVec3::new(0.0, 0.0, -1e9))));
    }
}
