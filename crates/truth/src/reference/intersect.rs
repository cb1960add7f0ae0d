//! A ray against a triangle in f64, without gaps: Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection" (JCGT 2013).
//!
//! A ray through an edge or a corner that triangles share meets exactly one of them: ties go by the direction of the edge, as in rasterizers
//! ("top-left rule"). Otherwise panes would be blended over themselves along the diagonals of their rectangles. Triangles without area and triangles
//! seen edge-on are not met.

use glam::DVec3;

/// A half-line, with the values that tests against all triangles share.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    pub origin: DVec3,
    /// Direction of any length but 0; distances along the ray are in units of this length.
    pub direction: DVec3,
    /// 1 / direction, finite.
    pub(super) inverse: DVec3,
    /// The axis along which the direction is longest, after the two others.
    axes: [usize; 3],
    /// The steps along the two others for a step of 1 along that axis, and that step in lengths of the direction.
    shear: [f64; 3],
}

/// The intersection of a ray with a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Distance in lengths of the ray's direction; may be negative.
    pub distance: f64,
    /// Weights of the corners; they add up to 1.
    pub weights: [f64; 3],
    /// The corners go round counter-clockwise as seen from the ray's origin.
    pub counter_clockwise: bool,
}

impl Ray {
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        let size = direction.abs();
        let longest = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let axes = [(longest + 1) % 3, (longest + 2) % 3, longest];
        let along = direction[longest];
        let shear = [direction[axes[0]] / along, direction[axes[1]] / along, 1.0 / along];
        // A finite stand-in for 1 / 0: zero times infinity would be no number.
        let inverse = direction.map(|d| 1.0 / if d.abs() < 1e-300 { 1e-300f64.copysign(d) } else { d });
        Self { origin, direction, inverse, axes, shear }
    }

    pub fn at(&self, distance: f64) -> DVec3 {
        self.origin + self.direction * distance
    }

    /// The corner as seen along the ray: across it, and along it.
    fn seen(&self, corner: DVec3) -> [f64; 3] {
        let p = corner - self.origin;
        let along = p[self.axes[2]];
        [p[self.axes[0]] - self.shear[0] * along, p[self.axes[1]] - self.shear[1] * along, self.shear[2] * along]
    }

    /// Returns the intersection of the ray's line with the triangle, on either side of the origin.
    pub fn crossing(&self, corners: &[DVec3; 3]) -> Option<Crossing> {
        let [a, b, c] = [self.seen(corners[0]), self.seen(corners[1]), self.seen(corners[2])];
        let areas = [area(b, c), area(c, a), area(a, b)];
        let all_not_negative = areas.iter().all(|&area| area >= 0.0);
        if !all_not_negative && areas.iter().any(|&area| area > 0.0) {
            return None;
        }
        let whole = areas[0] + areas[1] + areas[2];
        if whole == 0.0 || !whole.is_finite() {
            return None;
        }
        let sign = whole.signum();
        let edges = [(b, c), (c, a), (a, b)];
        let owns = |(&area, (from, to)): (&f64, ([f64; 3], [f64; 3]))| {
            area != 0.0 || is_own([(to[0] - from[0]) * sign, (to[1] - from[1]) * sign])
        };
        if !areas.iter().zip(edges).all(owns) {
            return None;
        }
        let weights = [areas[0] / whole, areas[1] / whole, areas[2] / whole];
        let distance = weights[0] * a[2] + weights[1] * b[2] + weights[2] * c[2];
        // The axes keep their order, so that the picture across the ray is mirrored where the ray runs against the longest one.
        let counter_clockwise = (whole > 0.0) == (self.shear[2] < 0.0);
        Some(Crossing { distance, weights, counter_clockwise })
    }
}

/// Twice the signed area between two corners and the ray. Swapping the corners changes its sign and nothing else, to the last bit: so two
/// triangles agree about the edge that they share.
fn area(from: [f64; 3], to: [f64; 3]) -> f64 {
    from[0] * to[1] - from[1] * to[0]
}

/// Of the two triangles at an edge that the ray meets exactly, the one that has it: edges have a direction, and theirs are opposite.
fn is_own([x, y]: [f64; 2]) -> bool {
    y > 0.0 || (y == 0.0 && x < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

    #[test]
    fn distance_weights_and_side_are_those_of_geometry() {
        for turn in 0..3 {
            // Turns the triangle towards each axis.
            let turned = |v: DVec3| DVec3::from_array([0, 1, 2].map(|axis| v[(axis + turn) % 3]));
            let corners = TRIANGLE.map(turned);
            for (from, counter_clockwise) in [(DVec3::new(0.5, 0.25, 3.0), true), (DVec3::new(0.5, 0.25, -2.0), false)]
            {
                let to = DVec3::new(0.25, 0.25, 0.0);
                let ray = Ray::new(turned(from), turned(to - from) * 2.0);
                let crossing = ray.crossing(&corners).expect("meets");
                assert!((crossing.distance - 0.5).abs() < 1e-15, "{crossing:?}");
                assert_eq!(crossing.counter_clockwise, counter_clockwise);
                for (found, expected) in crossing.weights.into_iter().zip([0.5, 0.25, 0.25]) {
                    assert!((found - expected).abs() < 1e-15, "{crossing:?}");
                }
            }
        }
    }

    #[test]
    fn beside_along_and_without_area_nothing_is_met() {
        let down = |x, y| Ray::new(DVec3::new(x, y, 1.0), DVec3::NEG_Z);
        assert_eq!(down(0.6, 0.6).crossing(&TRIANGLE), None);
        assert_eq!(down(-0.1, 0.5).crossing(&TRIANGLE), None);
        assert_eq!(Ray::new(DVec3::NEG_ONE * 0.5, DVec3::X).crossing(&TRIANGLE), None);
        assert_eq!(Ray::new(DVec3::new(-1.0, 0.25, 0.0), DVec3::X).crossing(&TRIANGLE), None);
        assert_eq!(down(0.5, 0.0).crossing(&[DVec3::ZERO, DVec3::X, DVec3::X]), None);
    }

    /// Rays at edges, at corners and elsewhere, from both sides: a fan around a corner is met once, not twice and not never.
    #[test]
    fn what_triangles_share_is_met_exactly_once() {
        let rim: Vec<DVec3> = (0..7)
            .map(|index| {
                let (sine, cosine) = (f64::from(index) * std::f64::consts::TAU / 7.0).sin_cos();
                DVec3::new(cosine, sine, 0.3 * sine * cosine)
            })
            .collect();
        let middle = DVec3::new(0.1, -0.05, 0.02);
        for (eye, jump) in [(DVec3::new(0.3, 0.2, 5.0), 1.0), (DVec3::new(-0.1, 0.4, -4.0), 0.5)] {
            for share in [0.0, jump * 0.25, 0.5, 0.75] {
                for &corner in &rim {
                    let target = middle + (corner - middle) * share;
                    let ray = Ray::new(eye, target - eye);
                    let met = (0..7).filter(|&i| ray.crossing(&[middle, rim[i], rim[(i + 1) % 7]]).is_some()).count();
                    assert_eq!(met, 1, "{eye} {share} {corner}");
                }
            }
        }
    }
}
