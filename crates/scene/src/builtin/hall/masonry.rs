//! Stonework: columns, arches with thickness and mouldings, walls with openings, vaults.

use std::f64::consts::PI;

use glam::{DAffine3, DVec2, DVec3};

use crate::builtin::shapes::{MeshBuilder, Vertex, cuboid};

/// An arched opening in a wall that stands in the XY plane around x = 0: half-round, from `springing` up.
#[derive(Clone, Copy)]
pub(super) struct Arch {
    pub width: f64,
    pub radius: f64,
    pub springing: f64,
    pub top: f64,
    pub thickness: f64,
}

/// Steps around a half circle.
const ARC: usize = 24;

impl Arch {
    /// The wall around the opening above the springing, with both faces and the soffit. Jambs below are not part of it.
    pub fn wall(&self) -> MeshBuilder {
        let mut mesh = MeshBuilder::new();
        for (side, normal) in [(1.0, DVec3::Z), (-1.0, DVec3::NEG_Z)] {
            let z = self.thickness * 0.5 * side;
            let face =
                |x: f64, y: f64| Vertex { position: DVec3::new(x * side, y, z), normal, uv: DVec2::new(x * side, -y) };
            // Seen from its front, from the curve up, left to right.
            mesh.grid([ARC, 4], |u, v| {
                let angle = PI * (1.0 - u);
                let (x, y) = (self.radius * angle.cos(), self.springing + self.radius * angle.sin());
                face(x, y + (self.top - y) * v)
            });
            for (from, to) in [(-self.width * 0.5, -self.radius), (self.radius, self.width * 0.5)] {
                mesh.grid([1, 1], |u, v| {
                    face(from + (to - from) * u, self.springing + (self.top - self.springing) * v)
                });
            }
        }
        self.soffit(&mut mesh);
        mesh
    }

    fn soffit(&self, mesh: &mut MeshBuilder) {
        mesh.grid([ARC, 1], |u, v| {
            let (sin, cos) = (PI * u).sin_cos();
            let z = self.thickness * (0.5 - v);
            Vertex {
                position: DVec3::new(self.radius * cos, self.springing + self.radius * sin, z),
                normal: DVec3::new(-cos, -sin, 0.0),
                uv: DVec2::new(u * PI * self.radius, z),
            }
        });
        // The undersides of the wall beside the arch, which capitals do not cover wholly.
        let z = self.thickness * 0.5;
        for (from, to) in [(-self.width * 0.5, -self.radius), (self.radius, self.width * 0.5)] {
            let y = self.springing;
            mesh.quad_metric([(from, -z), (to, -z), (to, z), (from, z)].map(|(x, z)| DVec3::new(x, y, z)));
        }
    }

    /// The moulding around the opening on both faces of the wall.
    pub fn archivolt(&self) -> MeshBuilder {
        // (radius beyond the opening's, how far it stands out), from the outside in.
        let profile = [
            (0.32, 0.0),
            (0.29, 0.07),
            (0.19, 0.07),
            (0.17, 0.045),
            (0.05, 0.045),
            (0.03, 0.09),
            (0.0, 0.09),
            (0.0, 0.0),
        ];
        let mut one = MeshBuilder::new();
        for pair in profile.windows(2) {
            let [(outer, low), (inner, high)] = [pair[0], pair[1]];
            let along = DVec2::new(inner - outer, high - low).normalize_or(DVec2::X);
            one.grid([ARC, 1], |u, v| {
                let (sin, cos) = (PI * u).sin_cos();
                let radius = self.radius + outer + (inner - outer) * v;
                let z = self.thickness * 0.5 + low + (high - low) * v;
                // Of the profile's direction (radial, out), turned a quarter towards the viewer.
                let (radial, out) = (along.y, -along.x);
                Vertex {
                    position: DVec3::new(radius * cos, self.springing + radius * sin, z),
                    normal: DVec3::new(radial * cos, radial * sin, out).normalize_or(DVec3::Z),
                    uv: DVec2::new(u * PI * radius, -v * 0.1 - outer),
                }
            });
        }
        let mut both = one.clone();
        both.append(&one, &DAffine3::from_rotation_y(PI));
        both
    }
}

/// A column on the floor: square plinth, moulded base, shaft with entasis, bell capital and abacus. `height` includes them.
pub(super) struct Column {
    pub height: f64,
    pub radius: f64,
    pub segments: usize,
}

impl Column {
    /// Plinth, base, capital and abacus.
    pub fn mouldings(&self) -> MeshBuilder {
        let r = self.radius;
        let mut mesh = MeshBuilder::new();
        let slab = |width: f64, height: f64| cuboid([width, height, width]);
        mesh.at(&slab(r * 2.9, r * 0.4), 0.0, r * 0.2, 0.0);
        let base = [
            (1.42, 0.4),
            (1.46, 0.48),
            (1.46, 0.58),
            (1.38, 0.68),
            (1.22, 0.72),
            (1.15, 0.8),
            (1.2, 0.88),
            (1.26, 0.93),
            (1.26, 1.02),
            (1.16, 1.1),
            (1.0, 1.14),
        ];
        mesh.lathe(&base.map(|(radius, y)| (radius * r, y * r)), self.segments);
        let top = self.height;
        let capital = [
            (0.86, -2.1),
            (0.98, -2.08),
            (0.98, -1.96),
            (0.9, -1.92),
            (0.92, -1.6),
            (1.0, -1.2),
            (1.16, -0.85),
            (1.42, -0.58),
            (1.5, -0.5),
            (1.44, -0.4),
        ];
        mesh.lathe(&capital.map(|(radius, y)| (radius * r, top + y * r)), self.segments);
        mesh.at(&slab(r * 2.8, r * 0.22), 0.0, top - r * 0.31, 0.0);
        mesh.at(&slab(r * 3.1, r * 0.2), 0.0, top - r * 0.1, 0.0);
        mesh
    }

    pub fn shaft(&self) -> MeshBuilder {
        let r = self.radius;
        let (low, high) = (r * 1.12, self.height - r * 2.06);
        let profile: Vec<(f64, f64)> = (0..=6)
            .map(|step| {
                let t = f64::from(step) / 6.0;
                // A sixth narrower above, most of it in the upper part.
                (r * (1.0 - 0.14 * t * t), low + (high - low) * t)
            })
            .collect();
        let mut mesh = MeshBuilder::new();
        mesh.lathe(&profile, self.segments);
        mesh
    }
}

/// A band along X whose section in (y, z out of the wall) stands against a wall that faces +Z.
pub(super) fn band(length: f64, section: &[(f64, f64)]) -> MeshBuilder {
    let mut mesh = MeshBuilder::new();
    let half = length * 0.5;
    for pair in section.windows(2) {
        let [(low_y, low_z), (high_y, high_z)] = [pair[0], pair[1]];
        mesh.quad_metric([
            DVec3::new(-half, low_y, low_z),
            DVec3::new(half, low_y, low_z),
            DVec3::new(half, high_y, high_z),
            DVec3::new(-half, high_y, high_z),
        ]);
    }
    mesh
}

/// A wall face in the XY plane, from (x, y) to (x, y), that faces +Z at `z`.
pub(super) fn face(low: [f64; 2], high: [f64; 2], z: f64) -> MeshBuilder {
    let mut mesh = MeshBuilder::new();
    mesh.quad_metric(
        [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]].map(|[x, y]| DVec3::new(x, y, z)),
    );
    mesh
}
