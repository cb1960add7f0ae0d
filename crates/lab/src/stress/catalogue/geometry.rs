//! Meshes as no modeller should make them: triangles without area, slivers, normals and texture coordinates of any kind.

use glam::{DAffine3, DVec2, DVec3, Vec3, Vec4};

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::{even_texture, float32, lamp, sphere_on_floor, waves};
use afterlight::scene::builtin::shapes::{self, MeshBuilder, Vertex};
use afterlight::scene::builtin::stage::SceneBuilder;
use afterlight::scene::{Camera, Material, Mesh};

/// The error that rounding in 32 bits leaves; it is worst in pixels at grazing light.
const TIGHT: Bound = Bound { worst: 1e-3, mean: 1e-6 };

pub const CASES: &[Case] = &[
    case("geometry/sliver", "a floor with a strip so wide across it, made of two triangles")
        .over(SweepValues::Decades(-15, 0), "m")
        .claim([1e-15, 1.0], TIGHT)
        .check(Check::Placed(sliver, 0.01)),
    case("geometry/gigantic", "a floor of two triangles so large")
        .over(SweepValues::Decades(1, 15), "m")
        .claim([10.0, 1e4], Bound { worst: 1e-3, mean: 3e-4 })
        .check(Check::Placed(gigantic, 0.01)),
    case("geometry/no-area", "so many triangles without area in the middle of the floor")
        .over(SweepValues::List(&[0.0, 1.0, 2.0, 3.0, 100.0, 10_000.0]), "")
        .claim([0.0, 10_000.0], TIGHT)
        .check(Check::Placed(no_area, 0.005)),
    case("geometry/normal-length", "normals so long, down to none")
        .over(SweepValues::List(&[0.0, 1e-40, 1e-30, 1e-20, 1e-10, 1.0, 1e10, 1e20, 1e30, 1e38]), "")
        .claim([0.0, 1e38], TIGHT)
        .check(Check::Placed(normal_length, 0.01)),
    case(
        "geometry/opposed-normals",
        "normals of two ends of a triangle so far apart; half-way between opposed ones there is none",
    )
    .over(SweepValues::List(&[0.0, 90.0, 150.0, 170.0, 179.0, 179.9, 179.99, 180.0]), "degrees")
    .claim([0.0, 179.0], TIGHT)
    .check(Check::Placed(opposed_normals, 0.01)),
    case("geometry/tangent", "tangents at such an angle to their normals, under a normal map")
        .over(SweepValues::List(&[0.0, 1e-6, 1e-3, 0.1, 1.0, 10.0, 45.0, 90.0]), "degrees")
        .claim([0.0, 90.0], TIGHT)
        .check(Check::Placed(tangent, 0.01)),
    case("geometry/no-tangent", "tangents so long, down to none, under a normal map")
        .over(SweepValues::List(&[0.0, 1e-40, 1e-20, 1e-6, 1.0, 1e6]), "")
        .claim([0.0, 1e6], TIGHT)
        .check(Check::Placed(tangent_length, 0.01)),
    case("geometry/flat-map", "a normal map that has this code everywhere")
        .over(SweepValues::List(&[0.0, 1.0, 64.0, 126.0, 127.0, 128.0, 129.0, 254.0, 255.0]), "")
        .claim([0.0, 255.0], TIGHT)
        .check(Check::Placed(flat_map, 0.01)),
    case("geometry/uv-offset", "texture coordinates so far from zero, with a texture that repeats each two metres")
        .over(SweepValues::Decades(0, 12), "")
        .claim([1.0, 1e9], Bound { worst: 2e-2, mean: 5e-3 })
        .check(Check::Placed(uv_offset, 0.01)),
    case("geometry/uv-span", "a triangle over which a texture repeats so often, seen where a repeat fills the picture")
        .over(SweepValues::Decades(0, 9), "")
        .claim([1.0, 1e4], Bound { worst: 2e-2, mean: 5e-3 })
        .check(Check::Placed(uv_span, 0.01)),
    case(
        "geometry/vertex-at-camera",
        "the corner that all triangles share lies so far before the camera, or behind it",
    )
    .over(SweepValues::List(&[-1.0, -1e-3, -1e-6, -1e-9, 0.0, 1e-9, 1e-6, 1e-3, 1.0]), "m")
    .claim([-1.0, 1.0], TIGHT)
    .check(Check::Placed(vertex_at_camera, 0.02)),
    case("geometry/near-crossing", "a camera so high above a floor that crosses its near plane")
        .over(SweepValues::Decades(-9, 0), "m")
        .claim([1e-9, 1.0], TIGHT)
        .check(Check::Placed(near_crossing, 0.02)),
    case("geometry/indices", "so many vertices before those of the floor in its mesh")
        .over(SweepValues::List(&[0.0, 65_531.0, 65_532.0, 65_533.0, 65_535.0, 65_536.0, 65_537.0, 1e6]), "")
        .claim([0.0, 1e6], TIGHT)
        .check(Check::Placed(indices, 0.005)),
];

fn subject(mut stage: SceneBuilder) -> Subject {
    stage.light(lamp(DVec3::new(1.25, 2.0, 1.0), 1000.0));
    Subject::with(stage.scene, float32())
}

/// The stage with another floor.
fn on_floor(floor: Mesh) -> Subject {
    let mut stage = sphere_on_floor();
    stage.scene.meshes[0] = floor;
    subject(stage)
}

fn flat(x: f64, z: f64) -> Vertex {
    Vertex { position: DVec3::new(x, 0.0, z), normal: DVec3::Y, uv: DVec2::new(x, z) * 0.5 }
}

/// Corner vertices of a strip of the floor, and two triangles between them, of any area.
fn strip(mesh: &mut MeshBuilder, indices: &mut Vec<u32>, from: f64, to: f64) {
    let corners = [(from, 4.0), (to, 4.0), (to, -4.0), (from, -4.0)].map(|(x, z)| flat(x, z));
    let [a, b, c, d] = corners.map(|corner| mesh.vertex(corner.position, corner.normal, corner.uv));
    indices.extend([a, b, c, a, c, d]);
}

/// A floor of strips between these places.
fn strips(places: &[f64]) -> Mesh {
    let (mut mesh, mut indices) = (MeshBuilder::new(), Vec::new());
    places.windows(2).for_each(|ends| strip(&mut mesh, &mut indices, ends[0], ends[1]));
    Mesh { indices, ..mesh.finish("floor") }
}

fn sliver(metres: f64) -> Subject {
    on_floor(strips(&[-4.0, 0.7, 0.7 + metres, 4.0]))
}

fn gigantic(metres: f64) -> Subject {
    on_floor(shapes::plane([metres, metres]).finish("floor"))
}

fn no_area(count: f64) -> Subject {
    let mut floor = strips(&[-4.0, 4.0]);
    for index in 0..count as u32 {
        // A point, a line there and back, and corners in a row.
        floor.indices.extend([[0, 0, 0], [0, 2, 0], [1, 3, 3]][index as usize % 3]);
    }
    let plain = on_floor(strips(&[-4.0, 4.0])).scene;
    Subject { truth: Some(plain), ..on_floor(floor) }
}

fn normal_length(length: f64) -> Subject {
    let mut stage = sphere_on_floor();
    // A ball whose normals point up where they have no length, as the floor's do.
    for normal in stage.scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.normals) {
        *normal = (Vec3::from(*normal) * length as f32).to_array();
    }
    subject(stage)
}

fn opposed_normals(degrees: f64) -> Subject {
    let mut floor = strips(&[-4.0, 4.0]);
    let half = (degrees * 0.5).to_radians();
    for (normal, position) in floor.normals.iter_mut().zip(&floor.positions) {
        let (sine, cosine) = half.sin_cos();
        // Exactly opposed where they are said to be.
        let up = if degrees == 180.0 { 0.0 } else { cosine };
        *normal = DVec3::new(sine * f64::from(position[0].signum()), up, 0.0).as_vec3().to_array();
    }
    on_floor(floor)
}

/// The stage under an even normal map that is not neutral, its tangents after `change`, which gets the normal.
fn under_map(texel: [u8; 4], change: impl Fn(Vec3, Vec4) -> Vec4) -> Subject {
    let mut stage = sphere_on_floor();
    let normal_texture = stage.texture(even_texture(texel));
    stage.scene.materials.iter_mut().for_each(|material| material.normal_texture = normal_texture);
    for mesh in &mut stage.scene.meshes {
        mesh.compute_tangents();
        for (tangent, normal) in mesh.tangents.iter_mut().zip(&mesh.normals) {
            *tangent = change(Vec3::from(*normal), Vec4::from(*tangent)).to_array();
        }
    }
    subject(stage)
}

const SLOPED: [u8; 4] = [180, 90, 230, 255];

fn tangent(degrees: f64) -> Subject {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    under_map(SLOPED, |normal, tangent| (normal * cosine as f32 + tangent.truncate() * sine as f32).extend(tangent.w))
}

fn tangent_length(length: f64) -> Subject {
    under_map(SLOPED, |_, tangent| (tangent.truncate() * length as f32).extend(tangent.w))
}

fn flat_map(code: f64) -> Subject {
    let code = code as u8;
    under_map([code, code, code, 255], |_, tangent| tangent)
}

/// Seen from right above, so close that a texel of waves is larger than a pixel.
fn textured(mesh: Mesh, height: f64) -> Subject {
    let mut stage = SceneBuilder::default();
    let base_color_texture = stage.texture(waves());
    let material = stage.material(Material { base_color_texture, ..Material::default() });
    stage.scene.meshes.push(mesh);
    stage.place(0, material, DAffine3::IDENTITY);
    stage.scene.camera = Camera {
        near: height * 0.1,
        ..Camera::looking_at(DVec3::new(0.1, 1.0, 0.2) * height, DVec3::new(0.1, 0.0, 0.0) * height, DVec3::Y)
    };
    stage.sun(DVec3::new(0.2, -1.0, 0.1), 1000.0, Vec3::ONE, false);
    Subject::with(stage.scene, float32())
}

fn uv_offset(offset: f64) -> Subject {
    let mut mesh = MeshBuilder::new();
    let corners = [(-4.0, 4.0), (4.0, 4.0), (4.0, -4.0), (-4.0, -4.0)].map(|(x, z)| flat(x, z));
    // A whole number of repeats is no change at all.
    let shift = DVec2::new(offset, -offset).round();
    mesh.quad(corners.map(|corner| corner.position), corners.map(|corner| corner.uv + shift));
    textured(mesh.finish("floor"), 1.0)
}

fn uv_span(repeats: f64) -> Subject {
    let mut mesh = MeshBuilder::new();
    let half = repeats * 0.5;
    let corners = [(-half, half), (half, half), (half, -half), (-half, -half)].map(|(x, z)| flat(x, z));
    mesh.quad(corners.map(|corner| corner.position), corners.map(|corner| corner.uv * 2.0));
    textured(mesh.finish("floor"), 0.4)
}

fn vertex_at_camera(metres: f64) -> Subject {
    let mut stage = sphere_on_floor();
    let eye = stage.scene.camera.position;
    let tip = eye + stage.scene.camera.forward() * metres;
    let mut fan = MeshBuilder::new();
    let uv = DVec2::ZERO;
    let rim: Vec<DVec3> = (0..7)
        .map(|index| {
            let (sine, cosine) = (f64::from(index) * std::f64::consts::TAU / 7.0).sin_cos();
            DVec3::new(cosine * 3.0, 0.25, sine * 3.0 - 1.0)
        })
        .collect();
    for index in 0..rim.len() {
        let corners = [tip, rim[index], rim[(index + 1) % rim.len()]];
        let normal = (corners[1] - tip).cross(corners[2] - tip).normalize_or(DVec3::Y);
        let corners = corners.map(|corner| fan.vertex(corner, normal, uv));
        fan.triangle(corners);
    }
    let material =
        stage.material(Material { base_color: Vec3::new(0.3, 0.7, 0.2), two_sided: true, ..Material::default() });
    stage.add("fan", fan, material);
    subject(stage)
}

fn near_crossing(metres: f64) -> Subject {
    let mut stage = sphere_on_floor();
    let eye = DVec3::new(0.25, metres, 3.0);
    // Looks slightly down, so that the near plane cuts the floor before the camera.
    let target = eye + DVec3::new(-0.05, -0.3, -1.0);
    stage.scene.camera = Camera { near: 0.1, ..Camera::looking_at(eye, target, DVec3::Y) };
    subject(stage)
}

fn indices(before: f64) -> Subject {
    let floor = strips(&[-4.0, 4.0]);
    let before = before as usize;
    let shifted = |values: &[[f32; 3]], first: [f32; 3]| [vec![first; before], values.to_vec()].concat();
    let mut indices: Vec<u32> = floor.indices.iter().map(|index| index + before as u32).collect();
    // A triangle without area uses each of the vertices before.
    indices.splice(0..0, (0..before as u32).flat_map(|index| [index; 3]));
    let mesh = Mesh {
        positions: shifted(&floor.positions, [0.0; 3]),
        normals: shifted(&floor.normals, [0.0, 1.0, 0.0]),
        uvs: [vec![[0.0; 2]; before], floor.uvs.clone()].concat(),
        indices,
        ..floor
    };
    on_floor(mesh)
}
