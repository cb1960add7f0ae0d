//! Light sources, in the units of KHR_lights_punctual.

use glam::{DVec3, Vec3};

/// A light. Its radiometric strength is `color * intensity`.
#[derive(Debug, Clone, PartialEq)]
pub struct Light {
    pub name: String,
    pub kind: LightKind,
    /// Linear RGB, not negative.
    pub color: Vec3,
    /// Lux for a directional light, candela for point and spot. Not negative.
    pub intensity: f32,
    pub casts_shadow: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightKind {
    /// `direction` is where the light travels to; unit length.
    Directional { direction: DVec3 },
    /// Beyond `range`, in metres, the light is zero; `None` reaches everywhere.
    Point { position: DVec3, range: Option<f64>, falloff: Falloff },
    /// `direction` as above. Angles are measured from the axis, 0 <= inner <= outer <= 180 degrees.
    Spot {
        position: DVec3,
        direction: DVec3,
        inner_angle_degrees: f64,
        outer_angle_degrees: f64,
        range: Option<f64>,
        falloff: Falloff,
    },
}

/// How light weakens with the distance d. DESIGN: `sat(1-(d/r)^4)^2` windows it when there is a range r.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Falloff {
    /// 1 / d^2, windowed as KHR_lights_punctual recommends when there is a range.
    #[default]
    InverseSquare,
    /// max(1 - (d/r)^2, 0); needs a range.
    Quadratic,
    /// 1 / (constant + linear d + quadratic d^2), cut at the range when there is one. Coefficients are not negative and not
    /// all zero.
    Polynomial { constant: f32, linear: f32, quadratic: f32 },
}
