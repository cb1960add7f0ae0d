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
        // As rows, so the columns of the transpose.
        let axes = DMat3::from_cols(right, right.cross(direction), direction).transpose();
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
