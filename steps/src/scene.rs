//! The scene that the steps draw from step 2 on, made by code: a floor with spheres and boxes, 64 point lights, a camera. No Vulkan.
//!
//! World space is right-handed, +Y is up, lengths are metres, colours are linear.

use std::f32::consts::{PI, TAU};

use glam::{DVec3, Vec3, vec3};

/// The place of the camera.
pub const EYE: DVec3 = DVec3::new(0.0, 1.8, 6.2);
/// The place that it looks at.
pub const TARGET: DVec3 = DVec3::new(0.0, 0.2, 0.0);
/// The angle from the top of the picture to its bottom.
pub const FOV_Y_DEGREES: f64 = 40.0;
/// The distance of the near plane. There is no far plane.
pub const NEAR: f64 = 0.1;

/// The direction towards the sun of step 8, of length 1.
pub const SUN: DVec3 = DVec3::new(-0.48, 0.64, -0.6);
/// Lux of the sun on a surface that faces it: red, green, blue.
pub const SUN_LUX: Vec3 = Vec3::new(3.0, 2.8, 2.3);

/// A surface of one material, as indexed triangles whose fronts are counter-clockwise.
#[derive(Default)]
pub struct Shape {
    pub positions: Vec<Vec3>,
    /// Of length 1, one a position.
    pub normals: Vec<Vec3>,
    pub indices: Vec<u32>,
    /// The albedo.
    pub color: Vec3,
    /// Perceptual roughness.
    pub roughness: f32,
    pub metallic: f32,
}

/// A light that shines evenly to all sides.
pub struct Light {
    pub position: Vec3,
    /// The intensity of red, green and blue.
    pub candela: Vec3,
}

/// A vertex: position (3), normal (3), colour (3), roughness, metallic.
pub type Vertex = [f32; 11];

/// All shapes, far ones first: the worst order for a renderer that shades what it draws.
pub fn shapes() -> Vec<Shape> {
    let mut floor = Shape { color: Vec3::splat(0.5), roughness: 0.6, ..Shape::default() };
    floor.quad(Vec3::ZERO, vec3(8.0, 0.0, 0.0), vec3(0.0, 0.0, -8.0));
    let mut shapes = vec![floor];
    for (row, column) in (0..5).flat_map(|row| (0..5).map(move |column| (row, column))) {
        let number = row * 5 + column;
        let mut shape = Shape { color: hue(number as f32 / 25.0) * 0.6 + 0.2, ..Shape::default() };
        shape.roughness = 0.2 + 0.1 * (number % 6) as f32;
        shape.metallic = if number % 3 == 0 { 1.0 } else { 0.0 };
        let place = vec3(column as f32 - 2.0, 0.0, row as f32 - 2.0) * 1.6;
        match number % 2 {
            0 => shape.sphere(place + Vec3::Y * 0.5, 0.5),
            _ => shape.cuboid(place + Vec3::Y * 0.4, 0.4),
        }
        shapes.push(shape);
    }
    shapes
}

/// All shapes in one list of vertices and one of indices.
pub fn mesh() -> (Vec<Vertex>, Vec<u32>) {
    let (mut vertices, mut indices) = (Vec::new(), Vec::new());
    for shape in shapes() {
        indices.extend(shape.indices.iter().map(|index| vertices.len() as u32 + index));
        let (color, rest) = (shape.color, [shape.roughness, shape.metallic]);
        vertices.extend(std::iter::zip(&shape.positions, &shape.normals).map(|(position, normal)| {
            let [x, y, z] = position.to_array();
            [x, y, z, normal.x, normal.y, normal.z, color.x, color.y, color.z, rest[0], rest[1]]
        }));
    }
    (vertices, indices)
}

/// 64 lights between the shapes, of 0.25 to 0.75 candela in each channel.
pub fn lights() -> Vec<Light> {
    let light = |number: u32| {
        let place = vec3((number % 8) as f32 - 3.5, 0.0, (number / 8) as f32 - 3.5) * 1.6;
        let position = place + Vec3::Y * (0.4 + 0.1 * (number * 5 % 8) as f32);
        Light { position, candela: (hue(number as f32 * 0.618) + 0.5) * 0.5 }
    };
    (0..64).map(light).collect()
}

/// A colour on the circle that goes from red over green and blue back to red, for 0 to 1.
fn hue(turn: f32) -> Vec3 {
    vec3(0.0, 2.0, 1.0).map(|third| 0.5 + 0.5 * ((turn + third / 3.0) * TAU).cos())
}

impl Shape {
    /// Adds a rectangle by its middle and half of its sides, which turn counter-clockwise.
    fn quad(&mut self, middle: Vec3, right: Vec3, up: Vec3) {
        let first = self.positions.len() as u32;
        self.positions.extend([middle - right - up, middle + right - up, middle + right + up, middle - right + up]);
        self.normals.extend([right.cross(up).normalize(); 4]);
        self.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
    }

    fn cuboid(&mut self, middle: Vec3, half: f32) {
        let [x, y, z] = [Vec3::X * half, Vec3::Y * half, Vec3::Z * half];
        for (out, right, up) in [(z, x, y), (x, -z, y), (-z, -x, y), (-x, z, y), (y, x, -z), (-y, x, z)] {
            self.quad(middle + out, right, up);
        }
    }

    fn sphere(&mut self, middle: Vec3, radius: f32) {
        const RINGS: u32 = 16;
        const AROUND: u32 = 32;
        for (ring, step) in (0..=RINGS).flat_map(|ring| (0..=AROUND).map(move |step| (ring, step))) {
            let (down, turn) = (ring as f32 / RINGS as f32 * PI, (step % AROUND) as f32 / AROUND as f32 * TAU);
            let normal = vec3(down.sin() * turn.sin(), down.cos(), down.sin() * turn.cos());
            self.positions.push(middle + normal * radius);
            self.normals.push(normal.normalize());
        }
        for (ring, step) in (0..RINGS).flat_map(|ring| (0..AROUND).map(move |step| (ring, step))) {
            let upper = ring * (AROUND + 1) + step;
            let lower = upper + AROUND + 1;
            // At a pole one triangle of each cell has no area.
            let [left, right] = [[upper, lower, lower + 1], [upper, lower + 1, upper + 1]];
            match ring {
                0 => self.indices.extend(left),
                _ if ring == RINGS - 1 => self.indices.extend(right),
                _ => self.indices.extend([left, right].concat()),
            }
        }
    }
}
