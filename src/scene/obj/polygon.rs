//! Polygons into triangles.

use glam::{DVec2, DVec3};

/// More corners than this are cut as a fan: clipping ears takes time with their square.
const MOST_EARS: usize = 4096;

/// Newell's normal: the area-weighted normal of a closed polygon, planar or not; its length is twice the area.
pub(super) fn newell_normal(points: &[DVec3]) -> DVec3 {
    let Some(&base) = points.first() else { return DVec3::ZERO };
    // Relative to a corner, so that a polygon far from zero does not cancel away.
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(&a, &b)| (a - base).cross(b - base)).sum()
}

/// Cuts a polygon into triangles of its corners, keeping its winding. Convex ones become a fan (a quad is cut along its
/// shorter diagonal, as MikkTSpace advises), concave ones lose their ears. Always yields corners - 2 triangles.
pub(super) fn triangulate(points: &[DVec3], mut emit: impl FnMut([usize; 3])) {
    let count = points.len();
    if count <= 3 {
        if count == 3 {
            emit([0, 1, 2]);
        }
        return;
    }
    let flat = project(points);
    let is_convex = (0..count).all(|i| turn(flat[(i + count - 1) % count], flat[i], flat[(i + 1) % count]) >= 0.0);
    let first =
        if count == 4 && is_convex && points[1].distance_squared(points[3]) < points[0].distance_squared(points[2]) {
            1
        } else {
            0
        };
    if is_convex || count > MOST_EARS {
        (1..count - 1).for_each(|i| emit([first, (first + i) % count, (first + i + 1) % count]));
    } else {
        clip_ears(&flat, emit);
    }
}

/// The polygon in the plane that it covers most of, counter-clockwise.
fn project(points: &[DVec3]) -> Vec<DVec2> {
    let normal = newell_normal(points);
    let u = normal.normalize_or(DVec3::Z).any_orthonormal_vector();
    let v = normal.normalize_or(DVec3::Z).cross(u);
    points.iter().map(|&p| p - points[0]).map(|p| DVec2::new(p.dot(u), p.dot(v))).collect()
}

/// Twice the signed area of a triangle: positive when it turns left.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - b)
}

fn clip_ears(points: &[DVec2], mut emit: impl FnMut([usize; 3])) {
    let mut left: Vec<usize> = (0..points.len()).collect();
    let mut start = 0;
    while left.len() > 3 {
        let count = left.len();
        let corner = |i: usize| [left[(i + count - 1) % count], left[i % count], left[(i + 1) % count]];
        // Without an ear, as in a polygon that crosses itself, any corner will do: the outline is not a shape anyway.
        let ear = (start..start + count).find(|&i| is_ear(points, &left, corner(i))).unwrap_or(start);
        emit(corner(ear));
        left.remove(ear % count);
        // Going on behind the ear spreads the triangles, instead of a fan of slivers from one corner.
        start = (ear + 1) % left.len();
    }
    emit([left[0], left[1], left[2]]);
}

/// Returns true if the corner sticks out and nothing else of the outline lies in it.
fn is_ear(points: &[DVec2], left: &[usize], [a, b, c]: [usize; 3]) -> bool {
    let [pa, pb, pc] = [a, b, c].map(|i| points[i]);
    turn(pa, pb, pc) > 0.0
        && left.iter().map(|&i| points[i]).filter(|&p| p != pa && p != pb && p != pc).all(|p| {
            // On the edge counts as inside: a triangle that touches another corner would leave a sliver behind.
            turn(pa, pb, p) < 0.0 || turn(pb, pc, p) < 0.0 || turn(pc, pa, p) < 0.0
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(points: &[DVec3]) -> (usize, f64) {
        let (mut count, mut sum) = (0, 0.0);
        triangulate(points, |[a, b, c]| {
            count += 1;
            let doubled = (points[b] - points[a]).cross(points[c] - points[a]);
            assert!(doubled.dot(newell_normal(points)) >= 0.0, "a triangle is turned over");
            sum += doubled.length() / 2.0;
        });
        (count, sum)
    }

    fn outline(points: &[[f64; 2]]) -> Vec<DVec3> {
        // In a slanted plane, so that the projection has something to do.
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
}
