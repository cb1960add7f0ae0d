//! The share of a light that arrives at a point: fall-off by distance, and the cones of spots.

use glam::DVec3;
use nalgebra::Vector3;

use super::real::{Real, length, unit, vector};
use afterlight_scene::{Falloff, Light, LightKind};

/// Least distance, part of the model: 1 cm. Nearer than that a point light grows no brighter.
pub const MIN_DISTANCE: f64 = 0.01;
/// Least value of a polynomial's denominator, part of the model.
pub const MIN_POLYNOMIAL: f64 = 1e-4;
/// Least difference of the cosines of a cone's inner and outer angle, part of the model (KHR_lights_punctual's own).
pub const MIN_CONE: f64 = 0.001;
/// Least soft edge of a beam, part of the model, as a share of its radius.
pub const MIN_EDGE: f64 = 0.001;

/// Unit direction from a point of the world to a light, and how far away it is in metres: infinity for a directional one, for a beam how far
/// before its disc the point lies. Direction and distance are zero at a lamp itself.
pub fn to_light(light: &Light, point: DVec3) -> (DVec3, f64) {
    match light.kind {
        LightKind::Directional { direction } => (-direction, f64::INFINITY),
        LightKind::Point { position, .. } | LightKind::Spot { position, .. } => {
            let offset = position - point;
            let distance = length(&vector::<f64>(offset));
            (if distance > 0.0 { offset / distance } else { DVec3::ZERO }, distance)
        }
        LightKind::Beam { position, direction, .. } => (-direction, (point - position).dot(direction).max(0.0)),
    }
}

/// Returns the unit direction from a point of the world to a light, and the share of the light's intensity that arrives there, cone and all: lux
/// for each candela, or for each lux of a directional light.
pub fn arriving(light: &Light, point: DVec3) -> (DVec3, f64) {
    let arriving = arriving_at::<f64>(light, point, &Vector3::zeros());
    (super::real::widened(arriving.direction), arriving.strength)
}

/// The light that arrives at a point, in the arithmetic of the model.
pub(super) struct Arriving<R: Real> {
    /// Unit vector towards the light; zero at the light itself.
    pub direction: Vector3<R>,
    /// The share of the light's intensity that arrives.
    pub strength: R,
}

/// `point` is relative to `eye`: the light is moved there in f64 before anything is rounded, as the renderer does.
pub(super) fn arriving_at<R: Real>(light: &Light, eye: DVec3, point: &Vector3<R>) -> Arriving<R> {
    match light.kind {
        LightKind::Directional { direction } => Arriving { direction: vector(-direction), strength: R::one() },
        LightKind::Point { position, range, falloff } => from_place(falloff, range, vector(position - eye), point),
        LightKind::Spot { position, direction, inner_angle_degrees, outer_angle_degrees, range, falloff } => {
            let mut arriving = from_place(falloff, range, vector(position - eye), point);
            let cosine = -vector::<R>(direction).dot(&arriving.direction);
            arriving.strength *= cone(cosine, [inner_angle_degrees, outer_angle_degrees]);
            arriving
        }
        LightKind::Beam { position, direction, radius, edge, range } => {
            let (axis, from_disc) = (vector::<R>(direction), point - vector::<R>(position - eye));
            let along = axis.dot(&from_disc);
            // The cross product does not cancel far along the axis.
            let beside = length(&axis.cross(&from_disc)) / R::of(radius);
            let before = if along > R::zero() { R::one() } else { R::zero() };
            let end = range.map_or(R::one(), |range| window(along / R::of(range)));
            Arriving { direction: -axis, strength: before * disc(beside, edge) * end }
        }
    }
}

fn from_place<R: Real>(falloff: Falloff, range: Option<f64>, position: Vector3<R>, point: &Vector3<R>) -> Arriving<R> {
    let offset = position - point;
    let distance = length(&offset);
    let direction = unit(&offset).unwrap_or_else(Vector3::zeros);
    Arriving { direction, strength: weakened(falloff, range.map(R::of), distance) }
}

/// A fall-off at a distance, in metres like the range. Zero from the range on.
pub fn weakened<R: Real>(falloff: Falloff, range: Option<R>, distance: R) -> R {
    let share_of_range = range.map_or(R::zero(), |range| distance / range);
    match falloff {
        Falloff::InverseSquare => inverse_square(distance) * window(share_of_range),
        Falloff::Quadratic => (R::one() - share_of_range * share_of_range).max(R::zero()),
        Falloff::Polynomial { .. } if share_of_range >= R::one() => R::zero(),
        Falloff::Polynomial { constant, linear, quadratic } => {
            let [constant, linear, quadratic] = [constant, linear, quadratic].map(|term| R::of(f64::from(term)));
            R::one() / (constant + distance * (linear + distance * quadratic)).max(R::of(MIN_POLYNOMIAL))
        }
    }
}

/// 1 / d^2, no nearer than [`MIN_DISTANCE`].
fn inverse_square<R: Real>(distance: R) -> R {
    distance.max(R::of(MIN_DISTANCE)).powi(-2)
}

/// sat(1 - (d/r)^4)^2: draws an inverse square to zero at its range (Karis 2013, "Real Shading in Unreal Engine 4").
fn window<R: Real>(share_of_range: R) -> R {
    (R::one() - share_of_range.powi(4)).max(R::zero()).powi(2)
}

/// Share of a spot's light at the cosine of an angle from its axis: full up to the inner angle, none from the outer on
/// (KHR_lights_punctual, "Inner and Outer Cone Angles").
fn cone<R: Real>(cosine: R, angles_degrees: [f64; 2]) -> R {
    let [inner, outer] = angles_degrees.map(|degrees| degrees.to_radians().cos());
    let share = (cosine - R::of(outer)) / R::of((inner - outer).max(MIN_CONE));
    share.max(R::zero()).min(R::one()).powi(2)
}

/// Share of a beam's light at a distance from its axis, as a share of its radius: full up to the soft edge, and within that the square of the
/// remaining share of the edge, as in a spot's cone.
fn disc<R: Real>(beside: R, edge: f64) -> R {
    ((R::one() - beside) / R::of(edge.max(MIN_EDGE))).max(R::zero()).min(R::one()).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    const POLYNOMIAL: Falloff = Falloff::Polynomial { constant: 1.0, linear: 0.5, quadratic: 2.0 };

    fn close(found: f64, expected: f64) {
        assert!((found - expected).abs() <= 1e-14 * expected.abs(), "{found} is not {expected}");
    }

    #[test]
    fn an_inverse_square_grows_no_brighter_within_a_centimetre() {
        for (distance, expected) in [(2.0, 0.25), (0.5, 4.0), (0.01, 1e4), (0.001, 1e4), (0.0, 1e4), (1e200, 0.0)] {
            close(weakened(Falloff::InverseSquare, None, distance), expected);
        }
    }

    #[test]
    fn the_window_is_full_at_the_light_and_shut_from_the_range_on() {
        // Half way: (1 - 1/16)^2.
        close(weakened(Falloff::InverseSquare, Some(4.0), 2.0), 0.25 * 0.878_906_25);
        for distance in [4.0, 4.000_001, 1e9] {
            assert_eq!(weakened(Falloff::InverseSquare, Some(4.0), distance), 0.0);
        }
        assert!(weakened(Falloff::InverseSquare, Some(4.0), 3.99) > 0.0);
    }

    #[test]
    fn a_quadratic_is_1_at_the_light_and_0_from_its_range_on() {
        for (distance, expected) in [(0.0, 1.0), (1.5, 0.75), (3.0, 0.0), (7.0, 0.0)] {
            close(weakened(Falloff::Quadratic, Some(3.0), distance), expected);
        }
    }

    #[test]
    fn a_polynomial_is_cut_off_at_its_range_and_never_above_its_guard() {
        close(weakened(POLYNOMIAL, None, 2.0), 0.1);
        close(weakened(POLYNOMIAL, Some(2.5), 2.0), 0.1);
        assert_eq!(weakened(POLYNOMIAL, Some(2.0), 2.0), 0.0);
        let falls = Falloff::Polynomial { constant: 0.0, linear: 0.0, quadratic: 1.0 };
        close(weakened(falls, None, 0.0), 1.0 / MIN_POLYNOMIAL);
    }

    fn spot(inner: f64, outer: f64) -> Light {
        Light {
            name: "spot".into(),
            ..Light::of(LightKind::Spot {
                position: DVec3::Y,
                direction: DVec3::NEG_Y,
                inner_angle_degrees: inner,
                outer_angle_degrees: outer,
                range: None,
                falloff: Falloff::Quadratic,
            })
        }
    }

    /// Share of the light of a spot one metre above, at an angle of `degrees` from its axis.
    fn at(light: &Light, degrees: f64) -> f64 {
        arriving(light, DVec3::X * degrees.to_radians().tan()).1
    }

    #[test]
    fn a_cone_is_full_inside_shut_outside_and_falls_by_the_square_of_the_cosines_share() {
        let light = spot(20.0, 40.0);
        for (degrees, expected) in [(0.0, 1.0), (19.9, 1.0), (40.1, 0.0), (80.0, 0.0)] {
            assert_eq!(at(&light, degrees), expected, "{degrees}");
        }
        let [inner, middle, outer] = [20f64, 30.0, 40.0].map(|degrees| degrees.to_radians().cos());
        assert!((at(&light, 30.0) - ((middle - outer) / (inner - outer)).powi(2)).abs() < 1e-14);
    }

    #[test]
    fn a_cone_without_a_margin_ends_within_its_guard_and_one_of_180_degrees_is_a_sphere() {
        let light = spot(30.0, 30.0);
        // cos 30 degrees + 0.001 is at 29.885 degrees.
        assert_eq!([at(&light, 29.8), at(&light, 30.01)], [1.0, 0.0]);
        let sphere = spot(180.0, 180.0);
        for point in [DVec3::ZERO, DVec3::X * 50.0, DVec3::new(0.3, 1.5, 0.2)] {
            assert_eq!(arriving(&sphere, point).1, 1.0);
        }
    }

    #[test]
    fn a_light_is_found_where_it_is_and_a_directional_one_infinitely_far_off() {
        let lamp = spot(20.0, 40.0);
        assert_eq!(to_light(&lamp, DVec3::new(0.0, -3.0, 0.0)), (DVec3::Y, 4.0));
        assert_eq!(to_light(&lamp, DVec3::Y), (DVec3::ZERO, 0.0));
        let sun = Light { kind: LightKind::Directional { direction: DVec3::NEG_Z }, ..lamp };
        assert_eq!(to_light(&sun, DVec3::X), (DVec3::Z, f64::INFINITY));
        assert_eq!(arriving(&sun, DVec3::X), (DVec3::Z, 1.0));
    }
}
