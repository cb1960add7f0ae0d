//! The sun's shadow map: an orthographic view fitted to what the camera sees, and snapped to its texels.

use glam::{DAffine3, DMat3, DVec3, DVec4, Vec4};

use super::World;
use crate::scene::{Aabb, Camera, LightKind};

/// Texels around the fitted area, so that the filter finds neighbours.
const MARGIN: f64 = 3.0;

/// The light's axes are fixed in the world and the map's corner lies on a multiple of a texel, so that edges of shadows do
/// not swim when the camera moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SunView {
    /// Rows: the map's u and v axis and the light's direction, in world space.
    axes: DMat3,
    /// World-space corner of the map: u and v of its first texel, depth of its near plane.
    corner: DVec3,
    /// Edge of a texel, metres.
    pub texel: f64,
    /// Edge of the map, texels.
    size: f64,
    /// From the near plane to the far plane, metres.
    depth: f64,
}

impl SunView {
    /// Fits the map to the part of the `seen` boxes that lies inside the camera's view. `None` when nothing is seen.
    pub(super) fn fit(
        world: &World,
        camera: &Camera,
        aspect: f64,
        size: u32,
        seen: impl Iterator<Item = Aabb>,
    ) -> Option<Self> {
        let LightKind::Directional { direction } = World::sun_of(&world.lights)?.kind else { return None };
        let up = if direction.y.abs() < 0.99 { DVec3::Y } else { DVec3::Z };
        let right = direction.cross(up).try_normalize()?;
        // Right-handed with v downwards, as Vulkan's clip space. As rows, so the columns of the transpose.
        let axes = DMat3::from_cols(right, direction.cross(right), direction).transpose();
        let to_light = DAffine3::from_mat3(axes);
        let (mut receivers, mut far) = (Aabb::EMPTY, camera.near);
        for bounds in seen {
            receivers = receivers.union(&bounds.transformed(&to_light));
            let farthest = bounds.corners().map(|corner| (corner - camera.position).dot(camera.forward()));
            far = farthest.into_iter().fold(far, f64::max);
        }
        let volume = Aabb::of_points(view_corners(camera, aspect, far).map(|corner| axes * corner));
        let fitted = receivers.intersection(&volume);
        if fitted.is_empty() {
            return None;
        }
        let casters = world.bounds.transformed(&to_light);
        // In steps of a quarter of a power of two, so that a turning camera seldom changes the texel's size.
        let edge = fitted.size().truncate().max_element().max(1e-6 * world.bounds.radius()).max(1e-30);
        let edge = ((edge.log2() * 4.0).ceil() * 0.25).exp2();
        let texel = edge / (f64::from(size) - 2.0 * MARGIN - 1.0).max(1.0);
        let snap = |low: f64| (low / texel).floor() * texel - MARGIN * texel;
        // A little room before and behind, so that what touches a plane is inside.
        let slack = 1e-3 * casters.size().z.max(edge);
        let near = casters.min.z - slack;
        Some(Self {
            axes,
            corner: DVec3::new(snap(fitted.min.x), snap(fitted.min.y), near),
            texel,
            size: f64::from(size),
            depth: fitted.max.z + slack - near,
        })
    }

    /// Whether the box can stand between the sun and anything in the map.
    pub(super) fn may_shadow(&self, bounds: &Aabb) -> bool {
        let in_light = bounds.transformed(&DAffine3::from_mat3(self.axes));
        let edge = self.texel * self.size;
        in_light.max.x >= self.corner.x
            && in_light.min.x <= self.corner.x + edge
            && in_light.max.y >= self.corner.y
            && in_light.min.y <= self.corner.y + edge
            && in_light.min.z <= self.corner.z + self.depth
    }

    /// Rows of the map from world space to u and v in texels and depth in 0..1.
    fn rows(&self) -> [DVec4; 3] {
        let axes = self.axes.transpose();
        let row = |axis: DVec3, corner: f64, unit: f64| (axis / unit).extend(-corner / unit);
        [
            row(axes.x_axis, self.corner.x, self.texel),
            row(axes.y_axis, self.corner.y, self.texel),
            row(axes.z_axis, self.corner.z, self.depth),
        ]
    }

    /// Rows of the map from camera-relative world space to u and v in texels and depth in 0..1.
    pub fn texel_rows(&self, camera: &Camera) -> [Vec4; 3] {
        self.rows().map(|row| {
            let (axis, offset) = (row.truncate(), row.w);
            axis.extend(offset + axis.dot(camera.position)).as_vec4()
        })
    }

    /// Rows of the map from a mesh to the light's clip space.
    pub fn clip_rows(&self, transform: &DAffine3) -> [Vec4; 3] {
        let [u, v, depth] = self.rows();
        let to_clip = |row: DVec4| row * (2.0 / self.size) - DVec4::W;
        [to_clip(u), to_clip(v), depth].map(|row| {
            let axis = row.truncate();
            let linear = transform.matrix3.transpose() * axis;
            linear.extend(row.w + axis.dot(transform.translation)).as_vec4()
        })
    }
}

/// Corners of the view volume between the near plane and a distance along the view.
fn view_corners(camera: &Camera, aspect: f64, far: f64) -> [DVec3; 8] {
    let tan_y = (camera.fov_y_degrees.to_radians() * 0.5).tan();
    let (right, up) = (camera.right() * tan_y * aspect, camera.up() * tan_y);
    std::array::from_fn(|i| {
        let distance = if i & 1 == 0 { camera.near } else { far };
        let x = if i & 2 == 0 { -1.0 } else { 1.0 };
        let y = if i & 4 == 0 { -1.0 } else { 1.0 };
        camera.position + (camera.forward() + right * x + up * y) * distance
    })
}

#[cfg(test)]
mod tests {
    use glam::DQuat;
    use proptest::prelude::*;

    use super::*;
    use crate::plan::{FramePlan, Visible, samples};
    use crate::scene::{Light, Material, Object, Scene, Settings};

    const ASPECT: f64 = 16.0 / 9.0;

    /// A scene of boxes under a sun, as a plan's world sees it.
    fn world(boxes: &[(DVec3, DVec3)], direction: DVec3) -> (World, FramePlan) {
        let mut scene: Scene = samples::scene(vec![Material::default(); boxes.len()], Vec::new());
        scene.lights = vec![Light { kind: LightKind::Directional { direction }, ..samples::sun() }];
        // The mesh of the samples is the unit square; here it stands for the unit cube that its box says.
        scene.meshes[0].bounds = Aabb { min: DVec3::ZERO, max: DVec3::ONE };
        let place = |object: &mut Object, (center, size): &(DVec3, DVec3)| {
            object.transform = DAffine3::from_scale_rotation_translation(*size, DQuat::IDENTITY, *center - *size * 0.5);
        };
        scene.objects.iter_mut().zip(boxes).for_each(|(object, at)| place(object, at));
        let settings = Settings { size: [1600, 900], ..Settings::default() };
        let plan = FramePlan::of(&scene, &settings, &samples::device()).expect("a plan");
        (World::of(&scene, &settings, &plan, 1.0), plan)
    }

    fn vector(range: f64) -> impl Strategy<Value = DVec3> {
        [-range..range, -range..range, -range..range].prop_map(DVec3::from)
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
            fov_y_degrees,
            ..Camera::looking_at(position, target, DVec3::Y)
        })
    }

    /// u, v in texels and depth.
    fn map(sun: &SunView, point: DVec3) -> DVec3 {
        DVec3::from(sun.rows().map(|row| row.truncate().dot(point) + row.w))
    }

    fn in_view(camera: &Camera, point: DVec3) -> bool {
        let offset = point - camera.position;
        let distance = offset.dot(camera.forward());
        let tan_y = (camera.fov_y_degrees.to_radians() * 0.5).tan();
        distance >= camera.near
            && offset.dot(camera.up()).abs() <= distance * tan_y
            && offset.dot(camera.right()).abs() <= distance * tan_y * ASPECT
    }

    proptest! {
        #[test]
        fn all_that_the_camera_sees_lies_in_the_map_with_room_for_the_filter(
            boxes in boxes(), sun in direction(), camera in camera(),
            inside in proptest::collection::vec([0.0..1.0, 0.0..1.0, 0.0..1.0f64], 32),
        ) {
            let (world, plan) = world(&boxes, sun);
            let Some(view) = Visible::of(&world, &camera, &plan).sun else { return Ok(()) };
            let size = view.size;
            for object in &world.objects {
                for point in inside.iter().map(|&t| object.bounds.min + DVec3::from(t) * object.bounds.size()) {
                    let at = map(&view, point);
                    // Nothing of the world lies before the near plane, or it would cast no shadow.
                    prop_assert!(at.z >= 0.0, "{at}");
                    if in_view(&camera, point) {
                        prop_assert!(at.z <= 1.0, "{at}");
                        let uv = at.truncate();
                        // 3x3 texels around it, and the offset along the normal.
                        prop_assert!(uv.min_element() >= 2.0 && uv.max_element() <= size - 2.0, "{at} of {size}");
                    }
                }
            }
        }

        #[test]
        fn what_stands_between_the_sun_and_the_map_is_a_caster(
            boxes in boxes(), sun in direction(), camera in camera(), inside in [0.0..1.0, 0.0..1.0, 0.0..1.0f64],
        ) {
            let (world, plan) = world(&boxes, sun);
            let visible = Visible::of(&world, &camera, &plan);
            let Some(view) = visible.sun else { return Ok(()) };
            for (index, object) in world.objects.iter().enumerate() {
                let at = map(&view, object.bounds.min + DVec3::from(inside) * object.bounds.size());
                let reaches = at.truncate().min_element() > 0.0 && at.truncate().max_element() < view.size && at.z < 1.0;
                let is_caster = visible.casters.iter().any(|draw| draw.object == index);
                prop_assert!(is_caster || !reaches, "{at}");
            }
        }

        #[test]
        fn a_moving_camera_does_not_move_texels_over_the_world(
            boxes in boxes(), sun in direction(), camera in camera(), step in vector(0.05), point in vector(30.0),
        ) {
            let (world, plan) = world(&boxes, sun);
            let mut sizes: Vec<f64> = Vec::new();
            let mut fraction: Option<(f64, DVec3)> = None;
            for i in 0..12 {
                let moved = Camera { position: camera.position + step * f64::from(i), ..camera };
                let Some(view) = Visible::of(&world, &moved, &plan).sun else { continue };
                let corner = view.corner.truncate() / view.texel;
                prop_assert!((corner - corner.round()).abs().max_element() < 1e-6, "{corner}");
                // In steps of a quarter of a power of two.
                let steps = (view.texel * (view.size - 2.0 * MARGIN - 1.0)).log2() * 4.0;
                prop_assert!((steps - steps.round()).abs() < 1e-6, "{steps}");
                let here = map(&view, point);
                if let Some((texel, before)) = fraction && texel == view.texel {
                    let slid = (here - before).truncate();
                    prop_assert!((slid - slid.round()).abs().max_element() < 1e-5, "{slid}");
                }
                fraction = Some((view.texel, here));
                sizes.push(view.texel);
            }
            sizes.dedup();
            // A path of 0.6 m in a scene of tens of metres.
            prop_assert!(sizes.len() <= 8, "{sizes:?}");
        }

        #[test]
        fn lookups_and_the_map_agree_on_every_point(
            boxes in boxes(), sun in direction(), camera in camera(),
            turn in vector(3.0), scale in [0.1..3.0, 0.1..3.0, -3.0..-0.1f64], shift in vector(20.0), vertex in vector(3.0),
        ) {
            let (world, plan) = world(&boxes, sun);
            let Some(view) = Visible::of(&world, &camera, &plan).sun else { return Ok(()) };
            let rotation = DQuat::from_scaled_axis(turn);
            let transform = DAffine3::from_scale_rotation_translation(scale.into(), rotation, shift);
            let point = transform.transform_point3(vertex);
            let value = |row: Vec4, p: DVec3| {
                let row = row.as_dvec4();
                let terms = row.truncate() * p;
                (terms.element_sum() + row.w, terms.abs().element_sum() + row.w.abs())
            };
            let (texel_rows, clip_rows) = (view.texel_rows(&camera), view.clip_rows(&transform));
            let exact = map(&view, point);
            for (axis, unit) in [view.size, view.size, 1.0].into_iter().enumerate() {
                let (texel, texel_terms) = value(texel_rows[axis], point - camera.position);
                let (clip, clip_terms) = value(clip_rows[axis], vertex);
                // Rows were rounded to f32: 2^-24 of each term.
                prop_assert!((texel - exact[axis]).abs() <= 6e-8 * texel_terms + 1e-9, "{texel} {exact}");
                let (mapped, rounding) = if axis == 2 {
                    (texel, 6e-8 * (clip_terms + texel_terms))
                } else {
                    (texel / unit * 2.0 - 1.0, 6e-8 * (clip_terms + 2.0 * texel_terms / unit + 1.0))
                };
                prop_assert!((clip - mapped).abs() <= rounding + 1e-9, "axis {axis}: {clip} {mapped}");
            }
        }
    }

    #[test]
    fn the_map_is_right_handed_and_deeper_away_from_the_sun() {
        let (world, plan) = world(&[(DVec3::ZERO, DVec3::ONE)], DVec3::NEG_Y);
        let camera = Camera::looking_at(DVec3::new(0.0, 2.0, 4.0), DVec3::ZERO, DVec3::Y);
        let view = Visible::of(&world, &camera, &plan).sun.expect("the box is seen");
        assert!(map(&view, DVec3::new(0.0, -0.5, 0.0)).z > map(&view, DVec3::new(0.0, 0.5, 0.0)).z);
        assert!(view.axes.determinant() > 0.0, "{}", view.axes.determinant());
    }

    #[test]
    fn where_nothing_is_seen_there_is_no_map() {
        let (world, plan) = world(&[(DVec3::ZERO, DVec3::ONE)], DVec3::NEG_Y);
        let away = Camera::looking_at(DVec3::Z * 5.0, DVec3::Z * 10.0, DVec3::Y);
        let visible = Visible::of(&world, &away, &plan);
        assert!(visible.sun.is_none() && visible.casters.is_empty() && visible.draws.is_empty());
        assert_eq!(visible.culled, 1);
    }
}
