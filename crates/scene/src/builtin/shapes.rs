//! Meshes out of formulas: counter-clockwise fronts, unit normals that point out, no triangle without area.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DVec2, DVec3};

use crate::uvs::wrapped;
use crate::{Aabb, Mesh};

/// A point of a surface: position, unit normal, texture coordinates ((0, 0) is the image's upper left corner).
#[derive(Debug, Clone, Copy)]
pub struct Vertex {
    /// Position in mesh space, in metres.
    pub position: DVec3,
    /// Normal of length 1.
    pub normal: DVec3,
    /// (0, 0) is the image's upper left corner.
    pub uv: DVec2,
}

/// Collects vertices in f64 and becomes a [`Mesh`] that is recentred on its bounds.
#[derive(Debug, Clone, Default)]
pub struct MeshBuilder {
    vertices: Vec<Vertex>,
    indices: Vec<u32>,
}

impl MeshBuilder {
    /// No vertices and no triangles.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a vertex and returns its index.
    pub fn vertex(&mut self, position: DVec3, normal: DVec3, uv: DVec2) -> u32 {
        self.vertices.push(Vertex { position, normal, uv });
        (self.vertices.len() - 1) as u32
    }

    /// Counter-clockwise. A triangle without area (two corners in one place, as at a pole) is left out.
    pub fn triangle(&mut self, corners: [u32; 3]) {
        let [a, b, c] = corners.map(|corner| self.vertices[corner as usize].position);
        let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
        if (b - a).cross(c - a).length() > 1e-9 * longest {
            self.indices.extend(corners);
        }
    }

    /// Adds a flat quad, counter-clockwise from its lower left corner; `uvs` are the texture coordinates of the corners.
    pub fn quad(&mut self, corners: [DVec3; 4], uvs: [DVec2; 4]) {
        let normal = (corners[2] - corners[0]).cross(corners[3] - corners[1]).normalize_or(DVec3::Y);
        let [a, b, c, d] = std::array::from_fn(|i| self.vertex(corners[i], normal, uvs[i]));
        self.triangle([a, b, c]);
        self.triangle([a, c, d]);
    }

    /// Adds a flat quad whose texture repeats every metre, upright along its first edge.
    pub fn quad_metric(&mut self, corners: [DVec3; 4]) {
        let along = (corners[1] - corners[0]).normalize_or(DVec3::X);
        let normal = (corners[2] - corners[0]).cross(corners[3] - corners[1]).normalize_or(DVec3::Y);
        let upwards = normal.cross(along);
        // Texture coordinates come from the world, so that neighbouring quads continue each other's pattern.
        let uvs = corners.map(|p| DVec2::new(p.dot(along), -p.dot(upwards)));
        self.quad(corners, uvs);
    }

    /// A surface over `steps` cells of the unit square. `at(u, v)` must turn so that dP/du x dP/dv points out.
    pub fn grid(&mut self, steps: [usize; 2], at: impl Fn(f64, f64) -> Vertex) {
        let first = self.vertices.len() as u32;
        let [columns, rows] = steps.map(|count| count.max(1));
        for row in 0..=rows {
            for column in 0..=columns {
                self.vertices.push(at(column as f64 / columns as f64, row as f64 / rows as f64));
            }
        }
        let index = |column: usize, row: usize| first + (row * (columns + 1) + column) as u32;
        for row in 0..rows {
            for column in 0..columns {
                let [a, b] = [index(column, row), index(column + 1, row)];
                let [d, c] = [index(column, row + 1), index(column + 1, row + 1)];
                self.triangle([a, b, c]);
                self.triangle([a, c, d]);
            }
        }
    }

    /// As [`Self::grid`], with normals from the surface's own slope.
    pub fn grid_smooth(&mut self, steps: [usize; 2], at: impl Fn(f64, f64) -> (DVec3, DVec2)) {
        const STEP: f64 = 1e-4;
        self.grid(steps, |u, v| {
            let slope_u = at(u + STEP, v).0 - at(u - STEP, v).0;
            let slope_v = at(u, v + STEP).0 - at(u, v - STEP).0;
            let (position, uv) = at(u, v);
            Vertex { position, normal: slope_u.cross(slope_v).normalize_or(DVec3::Y), uv }
        });
    }

    /// A turned shape about +Y. `profile` holds (radius, height) from the bottom up along the outside; each straight piece of it is
    /// shaded on its own unless it bends by less than 35 degrees. Texture coordinates are metres around the widest place, and
    /// along the profile.
    pub fn lathe(&mut self, profile: &[(f64, f64)], segments: usize) {
        let points: Vec<DVec2> = profile.iter().map(|&(radius, height)| DVec2::new(radius, height)).collect();
        let outward = |piece: usize| {
            let along = (points[piece + 1] - points[piece]).normalize_or(DVec2::Y);
            DVec2::new(along.y, -along.x)
        };
        let around = TAU * points.iter().fold(0.0f64, |widest, p| widest.max(p.x));
        let pieces = points.len().saturating_sub(1);
        let blend = |piece: usize, other: Option<usize>| {
            let own = outward(piece);
            let other = other.filter(|&other| other < pieces).map(outward);
            other.filter(|other| own.dot(*other) > 0.82).map_or(own, |other| (own + other).normalize_or(own))
        };
        let mut along = 0.0;
        for piece in 0..pieces {
            let (low, high) = (points[piece], points[piece + 1]);
            let normals = [blend(piece, piece.checked_sub(1)), blend(piece, Some(piece + 1))];
            let length = low.distance(high);
            let start = along;
            self.grid([segments.max(3), 1], |u, v| {
                let (sin, cos) = if u >= 1.0 { (0.0, 1.0) } else { (u * TAU).sin_cos() };
                let place = low.lerp(high, v);
                let normal = if v < 0.5 { normals[0] } else { normals[1] };
                Vertex {
                    position: DVec3::new(place.x * cos, place.y, -place.x * sin),
                    normal: DVec3::new(normal.x * cos, normal.y, -normal.x * sin),
                    uv: DVec2::new(u * around, -(start + v * length)),
                }
            });
            along += length;
        }
    }

    /// Everything of `other`, moved. Mirroring transforms keep their fronts.
    pub fn append(&mut self, other: &Self, transform: &DAffine3) {
        let first = self.vertices.len() as u32;
        let normals = transform.matrix3.inverse().transpose();
        let mirrored = transform.matrix3.determinant() < 0.0;
        self.vertices.extend(other.vertices.iter().map(|vertex| Vertex {
            position: transform.transform_point3(vertex.position),
            normal: (normals * vertex.normal).normalize_or(DVec3::Y),
            uv: vertex.uv,
        }));
        for triangle in other.indices.chunks_exact(3) {
            let [a, b, c] = [triangle[0], triangle[1], triangle[2]].map(|index| first + index);
            self.indices.extend(if mirrored { [a, c, b] } else { [a, b, c] });
        }
    }

    /// Adds all of another mesh, moved.
    pub fn at(&mut self, other: &Self, x: f64, y: f64, z: f64) {
        self.append(other, &DAffine3::from_translation(DVec3::new(x, y, z)));
    }

    /// Stretches the texture coordinates: a texture that repeats every metre comes to repeat every `1 / factor` metres.
    pub fn scale_uvs(mut self, factor: f64) -> Self {
        self.vertices.iter_mut().for_each(|vertex| vertex.uv *= factor);
        self
    }

    /// Recentred on its bounds, without tangents.
    pub fn finish(self, name: &str) -> Mesh {
        let bounds = Aabb::of_points(self.vertices.iter().map(|vertex| vertex.position));
        let origin = bounds.center();
        let mut mesh = Mesh {
            name: name.into(),
            origin,
            positions: self.vertices.iter().map(|v| (v.position - origin).as_vec3().to_array()).collect(),
            normals: self.vertices.iter().map(|v| v.normal.as_vec3().to_array()).collect(),
            uvs: wrapped(&self.vertices.iter().map(|vertex| vertex.uv).collect::<Vec<_>>(), &self.indices),
            indices: self.indices,
            ..Mesh::default()
        };
        mesh.bounds = mesh.compute_bounds();
        mesh
    }
}

/// The corners' texture coordinates of a whole image on a quad that starts at its lower left.
pub const WHOLE_IMAGE: [DVec2; 4] =
    [DVec2::new(0.0, 1.0), DVec2::new(1.0, 1.0), DVec2::new(1.0, 0.0), DVec2::new(0.0, 0.0)];

/// A rectangle in the XZ plane that faces +Y, centred; the texture lies on it once, its upper edge at -Z.
pub fn plane(size: [f64; 2]) -> MeshBuilder {
    let [x, z] = size.map(|edge| edge * 0.5);
    let mut mesh = MeshBuilder::new();
    let corners = [DVec3::new(-x, 0.0, z), DVec3::new(x, 0.0, z), DVec3::new(x, 0.0, -z), DVec3::new(-x, 0.0, -z)];
    mesh.quad(corners, WHOLE_IMAGE);
    mesh
}

/// A centred box; texture coordinates are metres.
pub fn cuboid(size: [f64; 3]) -> MeshBuilder {
    let half = DVec3::from(size) * 0.5;
    let corner = |x: f64, y: f64, z: f64| half * DVec3::new(x, y, z);
    let mut mesh = MeshBuilder::new();
    for [a, b, c, d] in [
        [(-1., -1., 1.), (1., -1., 1.), (1., 1., 1.), (-1., 1., 1.)],
        [(1., -1., -1.), (-1., -1., -1.), (-1., 1., -1.), (1., 1., -1.)],
        [(1., -1., 1.), (1., -1., -1.), (1., 1., -1.), (1., 1., 1.)],
        [(-1., -1., -1.), (-1., -1., 1.), (-1., 1., 1.), (-1., 1., -1.)],
        [(-1., 1., 1.), (1., 1., 1.), (1., 1., -1.), (-1., 1., -1.)],
        [(-1., -1., -1.), (1., -1., -1.), (1., -1., 1.), (-1., -1., 1.)],
    ] {
        mesh.quad_metric([a, b, c, d].map(|(x, y, z): (f64, f64, f64)| corner(x, y, z)));
    }
    mesh
}

/// A sphere of `segments` meridians and half as many rings; u runs around, v from the north pole down.
pub fn sphere(radius: f64, segments: usize) -> MeshBuilder {
    let segments = segments.max(4);
    let mut mesh = MeshBuilder::new();
    mesh.grid([segments, segments / 2], |u, v| {
        let (sin_u, cos_u) = if u >= 1.0 { (0.0, 1.0) } else { (u * TAU).sin_cos() };
        // The poles are points exactly, not rings of 1e-16.
        let (ring, height) =
            if v <= 0.0 || v >= 1.0 { (0.0, v * 2.0 - 1.0) } else { ((v * PI).sin(), -(v * PI).cos()) };
        let normal = DVec3::new(ring * cos_u, height, -ring * sin_u);
        Vertex { position: normal * radius, normal, uv: DVec2::new(u, 1.0 - v) }
    });
    mesh
}

/// A closed cylinder about +Y, centred.
pub fn cylinder(radius: f64, height: f64, segments: usize) -> MeshBuilder {
    let half = height * 0.5;
    let mut mesh = MeshBuilder::new();
    mesh.lathe(&[(0.0, -half), (radius, -half), (radius, half), (0.0, half)], segments);
    mesh
}

/// A closed cone about +Y, centred, tip up.
pub fn cone(radius: f64, height: f64, segments: usize) -> MeshBuilder {
    let half = height * 0.5;
    let mut mesh = MeshBuilder::new();
    mesh.lathe(&[(0.0, -half), (radius, -half), (0.0, half)], segments);
    mesh
}

/// A ring about +Y: `radius` to the middle of the tube.
pub fn torus(radius: f64, tube: f64, segments: usize) -> MeshBuilder {
    let segments = segments.max(4);
    let mut mesh = MeshBuilder::new();
    mesh.grid([segments, segments / 2], |u, v| {
        let (sin_u, cos_u) = if u >= 1.0 { (0.0, 1.0) } else { (u * TAU).sin_cos() };
        let (sin_v, cos_v) = if v >= 1.0 { (0.0, 1.0) } else { (v * TAU).sin_cos() };
        let normal = DVec3::new(cos_v * cos_u, sin_v, -cos_v * sin_u);
        let ring = DVec3::new(cos_u, 0.0, -sin_u) * radius;
        Vertex { position: ring + normal * tube, normal, uv: DVec2::new(u * TAU * radius, -v * TAU * tube) }
    });
    mesh
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn corners(mesh: &Mesh) -> impl Iterator<Item = [Vec3; 3]> + '_ {
        mesh.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|i| Vec3::from(mesh.positions[i as usize])))
    }

    fn every_shape() -> Vec<(&'static str, Mesh)> {
        vec![
            ("plane", plane([2.0, 3.0]).finish("plane")),
            ("box", cuboid([1.0, 2.0, 3.0]).finish("box")),
            ("sphere", sphere(2.0, 24).finish("sphere")),
            ("cylinder", cylinder(1.0, 2.0, 12).finish("cylinder")),
            ("cone", cone(1.0, 2.0, 12).finish("cone")),
            ("torus", torus(2.0, 0.5, 24).finish("torus")),
        ]
    }

    #[test]
    fn fronts_agree_with_normals_and_no_triangle_is_degenerate() {
        for (name, mesh) in every_shape() {
            assert!(!mesh.indices.is_empty(), "{name}");
            for (triangle, [a, b, c]) in mesh.indices.chunks_exact(3).zip(corners(&mesh)) {
                let face = (b - a).cross(c - a);
                assert!(face.length() > 1e-6, "{name}: {a} {b} {c}");
                for &index in triangle {
                    let normal = Vec3::from(mesh.normals[index as usize]);
                    assert!(normal.is_normalized(), "{name}");
                    assert!(normal.dot(face.normalize()) > 0.3, "{name}: {normal} against {face}");
                }
            }
        }
    }

    #[test]
    fn closed_shapes_enclose_a_positive_volume_of_the_right_size() {
        let volume = |mesh: &Mesh| corners(mesh).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum::<f32>();
        for (name, mesh) in every_shape() {
            let expected = match name {
                "box" => 6.0,
                "sphere" => 33.5,
                "cylinder" => std::f32::consts::TAU,
                "cone" => 2.09,
                "torus" => 9.87,
                _ => continue,
            };
            let found = volume(&mesh);
            assert!((found / expected - 1.0).abs() < 0.1, "{name}: {found} for {expected}");
        }
    }

    #[test]
    fn appending_a_mirrored_shape_keeps_its_front() {
        let mut mesh = MeshBuilder::new();
        mesh.append(&sphere(1.0, 8), &DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)));
        let mesh = mesh.finish("mirrored");
        for [a, b, c] in corners(&mesh) {
            assert!((b - a).cross(c - a).dot(a + b + c) > 0.0);
        }
    }
}
