//! A perspective camera in f64.

use glam::{DMat3, DQuat, DVec3};

/// A pinhole camera that looks along its local -Z, +Y up. The far plane is infinite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    pub position: DVec3,
    /// From camera space to world space.
    pub rotation: DQuat,
    /// Vertical field of view, above 0 and below 180.
    pub fov_y_degrees: f64,
    /// Distance of the near plane, above 0.
    pub near: f64,
}

impl Default for Camera {
    fn default() -> Self {
        Self { position: DVec3::new(0.0, 0.0, 5.0), rotation: DQuat::IDENTITY, fov_y_degrees: 60.0, near: 0.1 }
    }
}

impl Camera {
    /// A camera at `position` that looks at `target`. An `up` parallel to the view, and a target at the position, are mended
    /// by the nearest sensible axis.
    pub fn looking_at(position: DVec3, target: DVec3, up: DVec3) -> Self {
        let back = (position - target).try_normalize().unwrap_or(DVec3::Z);
        let right = up
            .cross(back)
            .try_normalize()
            .filter(|_| up.normalize_or_zero().cross(back).length() > 1e-9)
            .unwrap_or_else(|| back.any_orthonormal_vector());
        let rotation = DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back)).normalize();
        Self { position, rotation, ..Self::default() }
    }

    pub fn forward(&self) -> DVec3 {
        self.rotation * DVec3::NEG_Z
    }

    pub fn right(&self) -> DVec3 {
        self.rotation * DVec3::X
    }

    pub fn up(&self) -> DVec3 {
        self.rotation * DVec3::Y
    }
}
