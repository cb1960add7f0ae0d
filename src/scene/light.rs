//! Light sources, in the units of KHR_lights_punctual.

use glam::{DVec3, Vec3};

/// A light. Its radiometric strength is `color * intensity`.
#[derive(Debug, Clone, PartialEq)]
pub struct Light {
    /// For messages and reports.
    pub name: String,
    /// Where the light comes from.
    pub kind: LightKind,
    /// Linear RGB, not negative.
    pub color: Vec3,
    /// Lux for a directional light, candela for point and spot. Not negative.
    pub intensity: f32,
    /// Whether objects stand in its way.
    pub casts_shadow: bool,
    /// How large the source is, for soft shadows: the angular diameter in degrees of a directional light, the radius in metres of
    /// the others. 0 for a light without a size.
    pub size: f64,
}

/// The shape and place of a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightKind {
    /// `direction` is where the light travels to, of any length but 0.
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

/// The direction with a length of 1; `None` where it has none. Squares of its parts may be more or less than f64 holds. One that has that
/// length, but for rounding, stays as it is.
pub fn unit(direction: DVec3) -> Option<DVec3> {
    match (direction.length_squared() - 1.0).abs() < 1e-14 {
        true => Some(direction),
        false => (direction / direction.abs().max_element()).try_normalize(),
    }
}

impl Light {
    /// With a direction of length 1, where it has one: what formulas take.
    pub(crate) fn aimed(&self) -> Self {
        let mut light = self.clone();
        if let LightKind::Directional { direction } | LightKind::Spot { direction, .. } = &mut light.kind {
            *direction = unit(*direction).unwrap_or(*direction);
        }
        light
    }

    /// Whether it can add anything.
    pub(crate) fn shines(&self) -> bool {
        self.intensity > 0.0 && self.color.max_element() > 0.0
    }
}

/// How light weakens with the distance d, in metres; r is the range.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Falloff {
    /// 1 / max(d^2, 1 cm^2), windowed by `sat(1 - (d/r)^4)^2` when there is a range (Karis 2013, "Real Shading in Unreal
    /// Engine 4"; the window that KHR_lights_punctual recommends is its square root).
    #[default]
    InverseSquare,
    /// max(1 - (d/r)^2, 0); needs a range.
    Quadratic,
    /// 1 / (constant + linear d + quadratic d^2), cut at the range when there is one. Coefficients are not
    /// negative.
    Polynomial { constant: f32, linear: f32, quadratic: f32 },
}

impl Falloff {
    /// Distance in metres beyond which a polynomial light of `intensity` candela brings less than `cutoff` lux: the greatest root
    /// of intensity / (c + l d + q d^2) = cutoff. This is the radius of the volume that such a light is drawn with.
    ///
    /// 0 when it is never that bright; infinity when it never falls below (no linear and no quadratic term, or a cut-off that is
    /// not above 0); `None` for the other fall-offs, whose reach is their range. Never NaN.
    pub fn polynomial_radius(&self, intensity: f64, cutoff: f64) -> Option<f64> {
        let Self::Polynomial { constant, linear, quadratic } = *self else { return None };
        let [c, l, q] = [constant, linear, quadratic].map(|term| f64::from(term).max(0.0));
        if cutoff.is_nan() || cutoff <= 0.0 {
            return Some(f64::INFINITY);
        }
        // q d^2 + l d = excess
        let excess = intensity / cutoff - c;
        if excess.is_nan() || excess <= 0.0 {
            return Some(0.0);
        }
        // The form that does not cancel: 2 excess / (l + sqrt(l^2 + 4 q excess)), right for q = 0 as well. Roots are taken apart
        // so that neither square overflows.
        let root = l.hypot(2.0 * q.sqrt() * excess.sqrt());
        let radius = 2.0 * (excess / (l + root));
        Some(if radius.is_nan() { f64::INFINITY } else { radius })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn radius(constant: f32, linear: f32, quadratic: f32, intensity: f64, cutoff: f64) -> f64 {
        Falloff::Polynomial { constant, linear, quadratic }.polynomial_radius(intensity, cutoff).unwrap()
    }

    #[test]
    fn at_the_radius_the_light_is_as_bright_as_the_cutoff() {
        for (c, l, q) in [(1.0, 0.7, 1.8), (0.0, 0.0, 1.0), (1.0, 0.5, 0.0), (0.0, 2.0, 1e-6), (1e-3, 0.0, 1e6)] {
            let (intensity, cutoff) = (100.0, 0.02);
            let d = radius(c, l, q, intensity, cutoff);
            let there = intensity / (f64::from(c) + f64::from(l) * d + f64::from(q) * d * d);
            assert!((there / cutoff - 1.0).abs() < 1e-9, "{c} {l} {q}: {d} {there}");
        }
    }

    #[test]
    fn a_direction_of_any_length_but_none_has_a_unit_vector() {
        let along = DVec3::new(-0.35, -0.9, 0.3).normalize();
        assert_eq!(unit(along), Some(along));
        for length in [5e-324, 1e-310, 1e-300, 1e-160, 1e-3, 7.0, 1e160, 1e300] {
            let found = unit(along * length).expect("it has a length");
            // What has no digits left is still turned to where its largest part goes.
            assert!(found.distance(along) < if length < 1e-300 { 1.0 } else { 1e-15 }, "{length}: {found}");
            assert!((found.length() - 1.0).abs() < 1e-15);
        }
        assert_eq!([DVec3::ZERO, DVec3::NAN, DVec3::INFINITY].map(unit), [None; 3]);
    }

    #[test]
    fn the_limits_of_the_polynomial_radius_are_not_nan() {
        assert_eq!(radius(1.0, 0.0, 0.0, 5.0, 0.1), f64::INFINITY);
        assert_eq!(radius(1.0, 1.0, 1.0, 0.01, 0.1), 0.0);
        assert_eq!(radius(1.0, 1.0, 1.0, 5.0, 0.0), f64::INFINITY);
        assert_eq!(radius(0.0, 0.0, 0.0, 0.0, 0.0), f64::INFINITY);
        for term in [0.0, f32::MIN_POSITIVE, 1.0, f32::MAX] {
            for intensity in [0.0, f64::MIN_POSITIVE, 1.0, f64::MAX] {
                assert!(!radius(term, term, term, intensity, 1e-300).is_nan());
            }
        }
        assert_eq!(Falloff::InverseSquare.polynomial_radius(1.0, 1.0), None);
    }
}
