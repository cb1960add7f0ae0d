//! Polygons into triangles.

use glam::{DVec2, DVec3};

use super::ears;

/// Newell's normal: the area-weighted normal of a closed polygon, planar or not; its length is twice the area.
pub(super) fn newell_normal(points: &[DVec3]) -> DVec3 {
    let Some(&base) = points.first() else { return DVec3::ZERO };
    // Relative to a corner, so that a polygon far from zero does not cancel away.
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(&a, &b)| (a - base).cross(b - base)).sum()
}

/// Cuts a polygon into triangles of its corners, keeping its winding. Convex ones become a fan (a quad is cut along its
/// shorter diagonal, as MikkTSpace advises), concave ones lose their ears. Always yields corners - 2 triangles. Returns false if the ears
/// took too long to find, so that a fan stands in for the rest.
pub(super) fn triangulate(points: &[DVec3], mut emit: impl FnMut([usize; 3])) -> bool {
    let count = points.len();
    if count <= 3 {
        if count == 3 {
            emit([0, 1, 2]);
        }
        return true;
    }
    let flat = project(points);
    let is_convex = (0..count).all(|i| turn(flat[(i + count - 1) % count], flat[i], flat[(i + 1) % count]) >= 0.0);
    if !is_convex {
        return ears::clip(&flat, emit);
    }
    let first =
        if count == 4 && points[1].distance_squared(points[3]) < points[0].distance_squared(points[2]) { 1 } else { 0 };
    (1..count - 1).for_each(|i| emit([first, (first + i) % count, (first + i + 1) % count]));
    true
}

/// Projects the polygon to the plane in which its area is largest, counter-clockwise.
fn project(points: &[DVec3]) -> Vec<DVec2> {
    let normal = newell_normal(points);
    let u = normal.normalize_or(DVec3::Z).any_orthonormal_vector();
    let v = normal.normalize_or(DVec3::Z).cross(u);
    points.iter().map(|&p| p - points[0]).map(|p| DVec2::new(p.dot(u), p.dot(v))).collect()
}

/// Twice the signed area of a triangle: positive when it turns left.
pub(super) fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(points: &[DVec3]) -> (usize, f64) {
        let (mut count, mut sum) = (0, 0.0);
        triangulate(points, |[a, b, c]| {
            count += 1;
            let doubled = (points[b] - points[a]).cross(points[c] - points[a]);
            // If the corners lie on a line, rounding decides the sign.
            assert!(doubled.dot(newell_normal(points).normalize()) > -1e-6, "a triangle is turned over");
            sum += doubled.length() / 2.0;
        });
        (count, sum)
    }

    fn outline(points: &[[f64; 2]]) -> Vec<DVec3> {
        // The outline lies in a slanted plane, so that the projection is tested.
        let (u, v) = (DVec3::new(1.0, 2.0, 0.5).normalize(), DVec3::new(-2.0, 1.0, 0.0).normalize());
        points.iter().map(|&[x, y]| DVec3::splat(1e4) + u * x + v * y).collect()
    }

    #[test]
    fn concave_polygons_are_covered_once() {
        let l = outline(&[[0., 0.], [2., 0.], [2., 1.], [1., 1.], [1., 2.], [0., 2.]]);
        let arrow = outline(&[[0., 0.], [2., 1.], [0., 2.], [0.5, 1.]]);
        let comb = outline(&[
            [0., 0.],
            [5., 0.],
            [5., 3.],
            [4., 3.],
            [4., 1.],
            [3., 1.],
            [3., 3.],
            [2., 3.],
            [2., 1.],
            [0., 1.],
        ]);
        for (points, expected) in [(l, 3.0), (arrow, 1.5), (comb, 9.0)] {
            let (count, sum) = area(&points);
            assert_eq!(count, points.len() - 2);
            assert!((sum - expected).abs() < 1e-6, "{sum} instead of {expected}");
        }
    }

    #[test]
    fn a_quad_is_cut_along_its_shorter_diagonal() {
        let mut triangles = Vec::new();
        triangulate(&outline(&[[0., 0.], [2., 0.], [3., 1.], [1., 1.]]), |t| triangles.push(t));
        assert_eq!(triangles, [[1, 2, 3], [1, 3, 0]]);
    }

    #[test]
    fn degenerate_polygons_still_end() {
        for points in [
            vec![[0., 0.]; 7],
            vec![[0., 0.], [1., 0.], [2., 0.], [3., 0.], [1.5, 0.]],
            vec![[0., 0.], [1., 1.], [1., 0.], [0., 1.], [0.5, 3.]],
        ] {
            let mut count = 0;
            triangulate(&outline(&points), |_| count += 1);
            assert_eq!(count, points.len() - 2);
        }
    }

    #[test]
    fn a_concave_polygon_of_many_corners_is_covered_once() {
        // A comb of teeth that are a half wide, and a gear.
        const TEETH: usize = 3_000;
        let tooth = |i: usize| {
            let x = i as f64;
            [[x, 1.0], [x, 2.0], [x + 0.5, 2.0], [x + 0.5, 1.0]]
        };
        let mut comb: Vec<[f64; 2]> = (0..TEETH).flat_map(tooth).collect();
        comb.extend([[TEETH as f64, 0.0], [0.0, 0.0]]);
        comb.reverse();
        let gear: Vec<[f64; 2]> = (0..2 * TEETH)
            .map(|i| {
                let (angle, radius) = (i as f64 / TEETH as f64 * std::f64::consts::PI, 1.0 + (i % 2) as f64);
                [radius * angle.cos(), radius * angle.sin()]
            })
            .collect();
        let spoke = 2.0 * (std::f64::consts::PI / TEETH as f64).sin() / 2.0;
        // Below the teeth the comb ends in a triangle half a tooth narrower than the last gap.
        let below = TEETH as f64 - 0.25;
        for (points, expected) in [(comb, TEETH as f64 * 0.5 + below), (gear, 2.0 * TEETH as f64 * spoke)] {
            assert!(triangulate(&outline(&points), |_| ()));
            let (count, sum) = area(&outline(&points));
            assert_eq!(count, points.len() - 2);
            assert!((sum / expected - 1.0).abs() < 1e-6, "{sum} instead of {expected}");
        }
    }

    #[test]
    fn a_fan_stands_in_where_ears_take_too_long_and_that_is_told() {
        // An eight: its smaller circle is inside out, so that it has no ear at all.
        let circle = |radius: f64| {
            let corner = move |i: u32| {
                let angle = f64::from(i) / 20_000.0 * std::f64::consts::TAU;
                [radius * (angle.cos() - 1.0), radius * angle.sin()]
            };
            (0..20_000).map(corner)
        };
        let eight: Vec<[f64; 2]> = circle(2.0).chain(circle(-1.0).map(|[x, y]| [x, -y])).collect();
        let mut count = 0;
        let is_whole = triangulate(&outline(&eight), |_| count += 1);
        assert_eq!((is_whole, count), (false, eight.len() - 2));
    }
}
