//! Shapes in metres, +Y up, fronts counter-clockwise: the harbour is put together from these.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use glam::{DAffine3, DVec2, DVec3};

/// Triangles of one material.
#[derive(Default)]
pub struct Part {
    pub points: Vec<DVec3>,
    pub normals: Vec<DVec3>,
    pub uvs: Vec<DVec2>,
    /// Linear, multiplies the material's base colour.
    pub tints: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
}

/// A mesh under construction. `frame`, `tint` and `grain` apply to shapes that are added next.
pub struct Model {
    pub parts: BTreeMap<&'static str, Part>,
    pub frame: DAffine3,
    pub tint: DVec3,
    /// The direction in which textures run on faces; along the horizon where there is none.
    pub grain: Option<DVec3>,
}

/// Metres that a material's texture covers.
fn tile(material: &str) -> f64 {
    match material {
        "stone" => 3.0,
        "cobble" => 1.6,
        "plaster" => 4.0,
        "roof" => 2.0,
        "wood" => 1.2,
        "brick" => 1.5,
        "rock" => 3.0,
        "ground" => 9.0,
        "water" => 14.0,
        "scrub" => 2.2,
        _ => 1.0,
    }
}

impl Model {
    pub fn new() -> Self {
        Self { parts: BTreeMap::new(), frame: DAffine3::IDENTITY, tint: DVec3::ONE, grain: None }
    }

    /// Adds with another frame, relative to the present one, and puts frame, tint and grain back.
    pub fn within(&mut self, frame: DAffine3, add: impl FnOnce(&mut Self)) {
        let (outer, tint, grain) = (self.frame, self.tint, self.grain);
        self.frame = outer * frame;
        add(self);
        (self.frame, self.tint, self.grain) = (outer, tint, grain);
    }

    fn vertex(&mut self, material: &'static str, point: DVec3, normal: DVec3, uv: DVec2, tint: DVec3) -> u32 {
        let (frame, tint) = (self.frame, self.tint * tint);
        let part = self.parts.entry(material).or_default();
        part.points.push(frame.transform_point3(point));
        part.normals.push((frame.matrix3.inverse().transpose() * normal).normalize_or(DVec3::Y));
        part.uvs.push(uv);
        part.tints.push(tint);
        part.points.len() as u32 - 1
    }

    /// Three vertices, unless they lie on a line.
    fn triangle(&mut self, material: &'static str, corners: [u32; 3]) {
        let part = self.parts.entry(material).or_default();
        let [a, b, c] = corners.map(|corner| part.points[corner as usize]);
        if (b - a).cross(c - a).length() > 1e-8 {
            part.triangles.push(corners);
        }
    }

    /// A flat convex polygon. Its texture is that of its plane, so that neighbours in one plane continue it.
    pub fn face(&mut self, material: &'static str, corners: &[DVec3]) {
        let normal = (corners[1] - corners[0]).cross(corners[corners.len() - 1] - corners[0]).normalize_or(DVec3::Y);
        let along = match self.grain {
            Some(grain) if grain.cross(normal).length() > 0.2 => (grain - normal * grain.dot(normal)).normalize(),
            _ if normal.y.abs() > 0.95 => DVec3::X,
            _ => DVec3::Y.cross(normal).normalize(),
        };
        let up = normal.cross(along);
        let scale = 1.0 / tile(material);
        let all: Vec<u32> = corners
            .iter()
            .map(|&corner| {
                let uv = DVec2::new(corner.dot(along), -corner.dot(up)) * scale;
                self.vertex(material, corner, normal, uv, DVec3::ONE)
            })
            .collect();
        for i in 1..all.len() - 1 {
            self.triangle(material, [all[0], all[i], all[i + 1]]);
        }
    }

    /// A box between two corners.
    pub fn block(&mut self, material: &'static str, min: DVec3, max: DVec3) {
        self.panel(material, min, max);
        self.face(
            material,
            &[DVec3::new(max.x, min.y, min.z), min, DVec3::new(min.x, max.y, min.z), DVec3::new(max.x, max.y, min.z)],
        );
    }

    /// A box without the face to -Z, which lies against something.
    pub fn panel(&mut self, material: &'static str, min: DVec3, max: DVec3) {
        let at = |x: u8, y: u8, z: u8| {
            DVec3::new([min.x, max.x][x as usize], [min.y, max.y][y as usize], [min.z, max.z][z as usize])
        };
        self.face(material, &[at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)]);
        self.face(material, &[at(1, 0, 1), at(1, 0, 0), at(1, 1, 0), at(1, 1, 1)]);
        self.face(material, &[at(0, 0, 0), at(0, 0, 1), at(0, 1, 1), at(0, 1, 0)]);
        self.face(material, &[at(0, 1, 1), at(1, 1, 1), at(1, 1, 0), at(0, 1, 0)]);
        self.face(material, &[at(0, 0, 0), at(1, 0, 0), at(1, 0, 1), at(0, 0, 1)]);
    }

    /// A box about a point, of such a size.
    pub fn block_at(&mut self, material: &'static str, middle: DVec3, size: DVec3) {
        self.block(material, middle - size * 0.5, middle + size * 0.5);
    }

    /// A square beam from one point to another, textured along itself.
    pub fn beam(&mut self, material: &'static str, from: DVec3, to: DVec3, width: f64, height: f64) {
        let along = (to - from).normalize();
        let side = if along.y.abs() > 0.99 { DVec3::X } else { along.cross(DVec3::Y).normalize() };
        let up = side.cross(along);
        let frame = DAffine3::from_mat3_translation(glam::DMat3::from_cols(along, up, side), (from + to) * 0.5);
        self.within(frame, |model| {
            model.grain = Some(DVec3::X);
            model.block_at(material, DVec3::ZERO, DVec3::new(from.distance(to), height, width));
        });
    }

    /// A surface over (u, v) in 0 to 1, with the point and tint of each place; its front is where u x v points.
    pub fn sheet(&mut self, material: &'static str, steps: (usize, usize), at: impl Fn(f64, f64) -> (DVec3, DVec3)) {
        let scale = 1.0 / tile(material);
        let mut rows: Vec<Vec<u32>> = Vec::new();
        let point = |u: f64, v: f64| at(u, v).0;
        // Lengths along the middle lines give even textures.
        let lengths = |count: usize, along: &dyn Fn(f64) -> DVec3| -> Vec<f64> {
            let mut lengths = vec![0.0];
            for i in 0..count {
                let (a, b) = (along(i as f64 / count as f64), along((i + 1) as f64 / count as f64));
                lengths.push(lengths[i] + a.distance(b));
            }
            lengths
        };
        let us = lengths(steps.0, &|u| point(u, 0.5));
        let vs = lengths(steps.1, &|v| point(0.5, v));
        for (j, along_v) in vs.iter().enumerate() {
            let mut row = Vec::new();
            for (i, along_u) in us.iter().enumerate() {
                let (u, v) = (i as f64 / steps.0 as f64, j as f64 / steps.1 as f64);
                let (here, tint) = at(u, v);
                let e = 1e-3;
                // Beside a pole, where all of a row is one point.
                let beside = v.clamp(2.0 * e, 1.0 - 2.0 * e);
                let du = point((u + e).min(1.0), beside) - point((u - e).max(0.0), beside);
                let dv = point(u, beside + e) - point(u, beside - e);
                let normal = du.cross(dv).normalize_or(DVec3::Y);
                row.push(self.vertex(material, here, normal, DVec2::new(*along_u, -along_v) * scale, tint));
            }
            rows.push(row);
        }
        for pair in rows.windows(2) {
            for i in 0..steps.0 {
                self.triangle(material, [pair[0][i], pair[0][i + 1], pair[1][i + 1]]);
                self.triangle(material, [pair[0][i], pair[1][i + 1], pair[1][i]]);
            }
        }
    }

    /// A profile of (radius, height) from below to above that turns about Y. Repeat a pair for a sharp edge.
    pub fn lathe(&mut self, material: &'static str, profile: &[(f64, f64)], sides: usize) {
        let scale = 1.0 / tile(material);
        let widest = profile.iter().map(|&(radius, _)| radius).fold(0.0, f64::max);
        // Whole images around, so that there is no seam.
        let around = (TAU * widest * scale).round().max(1.0);
        let mut length = 0.0;
        for pair in profile.windows(2) {
            let ((r0, y0), (r1, y1)) = (pair[0], pair[1]);
            let slant = DVec2::new(r1 - r0, y1 - y0);
            if slant.length() < 1e-9 {
                continue;
            }
            let normal = DVec2::new(slant.y, -slant.x).normalize();
            let next = length + slant.length();
            let mut rows = [Vec::new(), Vec::new()];
            for side in 0..=sides {
                let turn = side as f64 / sides as f64;
                let (sin, cos) = (turn * TAU).sin_cos();
                let outward = DVec3::new(sin * normal.x, normal.y, cos * normal.x);
                for (row, (radius, y, v)) in rows.iter_mut().zip([(r0, y0, length), (r1, y1, next)]) {
                    let uv = DVec2::new(turn * around, -v * scale);
                    row.push(self.vertex(material, DVec3::new(sin * radius, y, cos * radius), outward, uv, DVec3::ONE));
                }
            }
            for side in 0..sides {
                let [low, high] = &rows;
                if r0 > 1e-9 {
                    self.triangle(material, [low[side], low[side + 1], high[side + 1]]);
                }
                if r1 > 1e-9 {
                    self.triangle(material, [low[side], high[side + 1], high[side]]);
                }
            }
            length = next;
        }
    }

    /// A round rope, rail or branch along points, with a radius at each end.
    pub fn tube(&mut self, material: &'static str, path: &[DVec3], radii: (f64, f64), sides: usize) {
        let scale = 1.0 / tile(material);
        let mut rows: Vec<Vec<u32>> = Vec::new();
        let mut length = 0.0;
        let first = (path[1] - path[0]).normalize_or(DVec3::Y);
        let mut side = if first.y.abs() > 0.9 { DVec3::X } else { DVec3::Y }.cross(first).normalize();
        for (i, &point) in path.iter().enumerate() {
            let (before, after) = (path[i.saturating_sub(1)], path[(i + 1).min(path.len() - 1)]);
            let along = (after - before).normalize_or(DVec3::Y);
            // The frame is carried along, so that it does not twist.
            side = (side - along * side.dot(along)).normalize_or(along.any_orthonormal_vector());
            let up = along.cross(side);
            length += before.distance(point) * f64::from(u8::from(i > 0));
            let part = i as f64 / (path.len() - 1) as f64;
            let radius = radii.0 + (radii.1 - radii.0) * part;
            let row = (0..=sides)
                .map(|k| {
                    let turn = k as f64 / sides as f64;
                    let (sin, cos) = (turn * TAU).sin_cos();
                    let outward = side * cos + up * sin;
                    // Grain runs along.
                    let uv = DVec2::new(length, turn * TAU * radii.0.max(0.05)) * scale;
                    self.vertex(material, point + outward * radius, outward, uv, DVec3::ONE)
                })
                .collect();
            rows.push(row);
        }
        for pair in rows.windows(2) {
            for k in 0..sides {
                self.triangle(material, [pair[0][k], pair[0][k + 1], pair[1][k + 1]]);
                self.triangle(material, [pair[0][k], pair[1][k + 1], pair[1][k]]);
            }
        }
    }

    /// A rounded lump: a sphere of such radii, displaced outwards by `swell` of each direction.
    pub fn blob(
        &mut self,
        material: &'static str,
        (middle, radii): (DVec3, DVec3),
        steps: (usize, usize),
        swell: impl Fn(DVec3) -> f64,
        tint: impl Fn(DVec3) -> DVec3,
    ) {
        self.sheet(material, steps, |u, v| {
            let ((sin, cos), (rise, ring)) = ((u * TAU).sin_cos(), ((v - 0.5) * TAU * 0.5).sin_cos());
            let out = DVec3::new(sin * ring, rise, cos * ring);
            (middle + out * radii * (1.0 + swell(out)), tint(out))
        });
    }
}

/// Moves.
pub fn at(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z))
}

/// Turns about Y, then moves.
pub fn turned(x: f64, y: f64, z: f64, degrees: f64) -> DAffine3 {
    at(x, y, z) * DAffine3::from_rotation_y(degrees.to_radians())
}

/// Numbers that look random and are always the same.
pub struct Dice(u64);

impl Dice {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d_4c95_7f2d)
    }

    /// From 0 to 1.
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// 0 below `low`, 1 above `high`, smooth between.
pub fn smooth(low: f64, high: f64, value: f64) -> f64 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// sRGB as one writes it, to linear.
pub fn colour(hex: u32) -> DVec3 {
    let channel = |shift: u32| {
        let value = f64::from((hex >> shift) & 255) / 255.0;
        if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
    };
    DVec3::new(channel(16), channel(8), channel(0))
}
