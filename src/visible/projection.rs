//! A camera's projection: the map to clip space, and the way of places on the picture from one frame to the next.

use glam::{DAffine3, DMat4, DVec3, DVec4, Mat4, Vec4};

use super::{DepthMapping, Eye};
use crate::scene::Camera;

/// Rotation into the camera and projection with reversed Z. Perspective: an infinite far plane, z = near, w = distance. Orthographic: w = 1, and z
/// falls with the distance. Y is turned over, because Vulkan's clip space has it downwards. `offset` moves the picture, in clip space, where w
/// is 1.
pub fn clip_from_world(
    camera: &Camera,
    depth: &DepthMapping,
    [half_x, half_y]: [f64; 2],
    [offset_x, offset_y]: [f64; 2],
) -> DMat4 {
    let forward = camera.forward();
    let (z, w) = match *depth {
        DepthMapping::Reciprocal { near } => (DVec4::W * near, forward.extend(0.0)),
        DepthMapping::Linear { begin, end } => ((-forward).extend(end) / (end - begin), DVec4::W),
    };
    let (right, down) = ((camera.right() / half_x).extend(0.0), (-camera.up() / half_y).extend(0.0));
    DMat4::from_cols(right - w * offset_x, down - w * offset_y, z, w).transpose()
}

/// A frame's projection without its jitter, in f64 because the differences between frames are small.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameProjection {
    camera: Camera,
    depth: DepthMapping,
    /// The map from camera-relative world space to pixels from the upper left corner, depth, and w.
    pixels: DMat4,
}

/// Rows of maps from a mesh to the values that VELOCITY interpolates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProjectionRows {
    /// Pixels to the right times w, pixels down times w, and w.
    pub place: [Vec4; 3],
    /// Metres along the view.
    pub distance: Vec4,
}

impl FrameProjection {
    /// The projection of a picture with `size` pixels.
    pub fn of(eye: &Eye, depth: &DepthMapping, size: [u32; 2]) -> Self {
        let camera = eye.camera;
        let [width, height] = size.map(f64::from);
        let half_y = camera.half_height();
        let half = [half_y * width / height, half_y];
        let clip = clip_from_world(&camera, depth, half, [camera.shift.x / half[0], -camera.shift.y / half[1]]);
        // From -1..1 to 0..size, times w.
        let on_picture = DMat4::from_cols(
            DVec4::X * (width / 2.0),
            DVec4::Y * (height / 2.0),
            DVec4::Z,
            DVec4::new(width / 2.0, height / 2.0, 0.0, 1.0),
        );
        Self { camera, depth: *depth, pixels: on_picture * clip }
    }

    /// Returns the map from a place on the picture of another frame and its depth (x, y, depth, 1) to the same of this one, times w. The identity is
    /// subtracted, so that small motions lose nothing in f32: the map from a frame to itself is all zeros.
    pub fn moved_from(&self, other: &Self) -> Mat4 {
        if self == other {
            return Mat4::ZERO;
        }
        let between = DMat4::from_translation(other.camera.position - self.camera.position);
        (self.pixels * between * other.pixels.inverse() - DMat4::IDENTITY).as_mat4()
    }

    /// The rows for a mesh with the transform `stand`.
    pub fn rows(&self, stand: &DAffine3) -> ProjectionRows {
        let mut around = *stand;
        around.translation -= self.camera.position;
        let rows = (self.pixels * DMat4::from(around)).transpose();
        let forward = self.camera.forward();
        let along = |axis: DVec3| axis.dot(forward);
        let matrix = around.matrix3;
        ProjectionRows {
            place: [rows.x_axis, rows.y_axis, rows.w_axis].map(|row| row.as_vec4()),
            distance: DVec4::new(
                along(matrix.x_axis),
                along(matrix.y_axis),
                along(matrix.z_axis),
                along(around.translation),
            )
            .as_vec4(),
        }
    }

    /// The shaders' parameters: metres along the view at a depth of 1, and, for a linear depth, from there to a depth of 0.
    pub fn depths(&self) -> [f32; 2] {
        match self.depth {
            DepthMapping::Reciprocal { near } => [near as f32, 0.0],
            DepthMapping::Linear { begin, end } => [begin as f32, (end - begin) as f32],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Aabb;

    fn eye(camera: Camera) -> Eye {
        Eye::of(&camera, &Aabb::EMPTY)
    }

    fn place(sight: &FrameProjection, world: DVec3) -> DVec3 {
        let own = sight.pixels * (world - sight.camera.position).extend(1.0);
        own.truncate() / own.w
    }

    #[test]
    fn places_of_one_frame_become_those_of_the_one_before_wherever_the_camera_is() {
        for far in [0.0, 1e7] {
            let at = DVec3::new(far, 3.0, -far);
            let size = [1920, 1080];
            let depth = DepthMapping::Reciprocal { near: 0.05 };
            let sight = |position: DVec3, to: DVec3| {
                FrameProjection::of(&eye(Camera::looking_at(position, to, DVec3::Y)), &depth, size)
            };
            let before = sight(at, at + DVec3::new(0.2, -0.1, -1.0));
            let now = sight(at + DVec3::new(0.03, 0.01, -0.05), at + DVec3::new(0.25, -0.12, -1.1));
            let change = before.moved_from(&now);
            assert_eq!(before.moved_from(&before), Mat4::ZERO);
            for offset in [DVec3::new(0.1, 0.2, -0.5), DVec3::new(1.0, -2.0, -7.0), DVec3::new(-300.0, 100.0, -2000.0)]
            {
                let (was, is) = (place(&before, at + offset), place(&now, at + offset));
                let changed = change * is.extend(1.0).as_vec4();
                let w = f64::from(1.0 + changed.w);
                let come = DVec3::new(
                    (is.x * f64::from(changed.w) - f64::from(changed.x)) / w,
                    (is.y * f64::from(changed.w) - f64::from(changed.y)) / w,
                    0.0,
                );
                let error = (come - (is - was)).truncate().length();
                assert!(error < 1e-3, "{far} {offset}: {come} and {}, {error}", is - was);
            }
        }
    }
}
