use std::collections::HashMap;

use super::*;
use crate::builtin::shapes::{self, MeshBuilder};

fn meshes() -> Vec<Mesh> {
    let named = |name: &str, shape: MeshBuilder| shape.finish(name);
    let mut bumpy = named("bumpy", shapes::sphere(1.0, 96));
    for (position, normal) in bumpy.positions.iter_mut().zip(&bumpy.normals) {
        let [x, y, z] = position.map(|axis| (7.0 * axis).sin());
        let by = 0.05 * x * y * z;
        *position = std::array::from_fn(|axis| position[axis] + by * normal[axis]);
    }
    vec![
        named("sphere", shapes::sphere(0.5, 64)),
        named("ring", shapes::torus(0.38, 0.14, 56)),
        named("tall ring", shapes::torus(0.3, 0.02, 80)),
        bumpy,
    ]
}

/// Of each edge between two places, how many triangles go along it in either direction.
fn edges(mesh: &Mesh, indices: &[u32]) -> HashMap<[[u32; 3]; 2], [usize; 2]> {
    let mut edges = HashMap::new();
    for triangle in indices.as_chunks::<3>().0 {
        // 0 and -0 are one place.
        let places = triangle.map(|own| mesh.positions[own as usize].map(|axis| (axis + 0.0).to_bits()));
        for (from, to) in [(0, 1), (1, 2), (2, 0)].map(|(from, to)| (places[from], places[to])) {
            let counts: &mut [usize; 2] = edges.entry([from.min(to), from.max(to)]).or_default();
            counts[usize::from(from > to)] += 1;
        }
    }
    edges
}

/// Points spread evenly over the triangles, none of them where errors are measured.
fn samples(mesh: &Mesh, indices: &[u32], random: &mut fastrand::Rng) -> Vec<DVec3> {
    let triangles = indices.as_chunks::<3>().0;
    let each = (20_000 / triangles.len()).max(2);
    let of = |triangle: &[u32; 3], random: &mut fastrand::Rng| {
        let [a, b, c] = triangle.map(|own| point(mesh, own as usize));
        let (u, v) = (random.f64(), random.f64());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        a + (b - a) * u + (c - a) * v
    };
    triangles.iter().flat_map(|triangle| (0..each).map(|_| of(triangle, random)).collect::<Vec<_>>()).collect()
}

#[test]
fn each_level_has_about_half_of_the_triangles_and_is_no_nearer_than_the_one_before() {
    for mesh in meshes() {
        let levels = mesh.levels_of_detail();
        let counts: Vec<usize> =
            std::iter::once(mesh.indices.len()).chain(levels.iter().map(|level| level.indices.len())).collect();
        assert!(levels.len() >= 3, "{}: {counts:?}", mesh.name);
        assert!(counts.windows(2).all(|pair| pair[1] * 10 <= pair[0] * 8), "{}: {counts:?}", mesh.name);
        assert!(levels.windows(2).all(|pair| pair[0].error <= pair[1].error), "{}", mesh.name);
        assert!(levels.iter().all(|level| level.error > 0.0 && level.error < 2.0), "{}", mesh.name);
    }
}

#[test]
fn no_point_of_a_level_or_its_mesh_is_farther_from_the_other_than_the_error_says() {
    let mut random = fastrand::Rng::with_seed(7);
    for mesh in meshes() {
        let surface = TriangleTree::of(&mesh, &mesh.indices);
        for level in mesh.levels_of_detail().iter() {
            let own = TriangleTree::of(&mesh, &level.indices);
            let there = surface.farthest(&samples(&mesh, &level.indices, &mut random)).expect("triangles");
            let back = own.farthest(&samples(&mesh, &mesh.indices, &mut random)).expect("triangles");
            let farthest = there.max(back);
            assert!(farthest <= level.error, "{}: {farthest} of {}", mesh.name, level.error);
            assert!(farthest >= 0.5 * level.error, "{}: no more than {farthest} of {}", mesh.name, level.error);
        }
    }
}

#[test]
fn what_is_closed_stays_closed_over_the_seams_of_its_texture() {
    for mesh in meshes() {
        let is_closed = |indices: &[u32]| edges(&mesh, indices).values().all(|[there, back]| there == back);
        assert!(is_closed(&mesh.indices), "{}", mesh.name);
        for level in mesh.levels_of_detail().iter() {
            assert!(is_closed(&level.indices), "{}: {} triangles", mesh.name, level.indices.len() / 3);
        }
    }
}

#[test]
fn open_borders_stay_as_they_are() {
    let mut builder = MeshBuilder::new();
    builder.grid([32, 32], |u, v| {
        let height = (9.0 * u).sin() * (7.0 * v).cos() * 0.1;
        let (position, normal) = (DVec3::new(u, height, -v), DVec3::Y);
        shapes::Vertex { position, normal, uv: glam::DVec2::new(u, v) }
    });
    let mesh = builder.finish("sheet");
    let border = |indices: &[u32]| {
        let mut open: Vec<_> = edges(&mesh, indices).into_iter().filter(|(_, [there, back])| there != back).collect();
        open.sort();
        open
    };
    let levels = mesh.levels_of_detail();
    assert!(levels.len() >= 2 && border(&mesh.indices).len() == 128);
    assert!(levels.iter().all(|level| border(&level.indices) == border(&mesh.indices)));
}

#[test]
fn triangles_of_levels_face_where_their_normals_point() {
    for mesh in meshes() {
        // The last ones are a handful of triangles, wrong by as much as they are large.
        for level in mesh.levels_of_detail().iter().filter(|level| level.indices.len() >= 3 * 100) {
            let (mut all, mut against) = (0.0, 0.0);
            for triangle in level.indices.as_chunks::<3>().0 {
                let [a, b, c] = triangle.map(|own| point(&mesh, own as usize));
                let area = (b - a).cross(c - a);
                let normal: Vec3 = triangle.iter().map(|&own| Vec3::from(mesh.normals[own as usize])).sum();
                all += area.length();
                against += if area.dot(normal.as_dvec3()) < 0.0 { area.length() } else { 0.0 };
            }
            assert!(against <= 0.01 * all, "{} of {}: {}", mesh.name, level.indices.len() / 3, against / all);
        }
    }
}

#[test]
fn levels_are_made_once_and_again_when_the_mesh_has_changed() {
    let mut mesh = shapes::sphere(0.5, 64).finish("sphere");
    let (first, again) = (mesh.levels_of_detail(), mesh.levels_of_detail());
    assert!(Arc::ptr_eq(&first, &again) && Arc::ptr_eq(&first, &mesh.clone().levels_of_detail()));
    mesh.positions.iter_mut().for_each(|position| position[1] *= 2.0);
    let changed = mesh.levels_of_detail();
    assert!(changed[0].error != first[0].error);
    mesh.indices.truncate(3 * (LEAST_TRIANGLES - 1));
    assert!(mesh.levels_of_detail().is_empty());
}

#[test]
fn a_mesh_of_any_size_has_levels_of_its_size() {
    let usual = shapes::sphere(0.5, 64).finish("sphere");
    let levels = usual.levels_of_detail();
    for exponent in [-60, -20, 20, 60] {
        let scale = 2f32.powi(exponent);
        let mut mesh = usual.clone();
        mesh.positions.iter_mut().flatten().for_each(|axis| *axis *= scale);
        let scaled = mesh.levels_of_detail();
        assert_eq!(scaled.len(), levels.len(), "2^{exponent}");
        for (own, level) in scaled.iter().zip(levels.iter()) {
            assert_eq!(own.indices, level.indices, "2^{exponent}");
            assert!((own.error / f64::from(scale) - level.error).abs() <= 1e-12, "2^{exponent}");
        }
    }
}

#[test]
fn what_cannot_be_simplified_has_no_levels() {
    let far = |position: &mut [f32; 3]| *position = position.map(|axis| axis * 3e38);
    let mut endless = shapes::sphere(1.0, 64).finish("endless");
    endless.positions.iter_mut().for_each(far);
    assert!(endless.levels_of_detail().len() <= MOST_LEVELS);
    // Each triangle by itself: every edge is a border.
    let mut loose = shapes::sphere(0.5, 64).finish("loose");
    let corners: Vec<u32> = loose.indices.clone();
    loose.positions = corners.iter().map(|&own| loose.positions[own as usize].map(|axis| axis * 1.01)).collect();
    loose.positions.chunks_mut(3).enumerate().for_each(|(index, triangle)| {
        triangle.iter_mut().for_each(|corner| corner[0] += index as f32);
    });
    loose.normals = vec![[0.0, 1.0, 0.0]; loose.positions.len()];
    (loose.uvs, loose.tangents) = (Vec::new(), Vec::new());
    loose.indices = (0..loose.positions.len() as u32).collect();
    assert!(loose.levels_of_detail().is_empty());
}

#[test]
fn the_nearest_point_of_a_triangle_is_found_wherever_it_is() {
    let mut random = fastrand::Rng::with_seed(3);
    let mut any = || DVec3::new(random.f64() - 0.5, random.f64() - 0.5, random.f64() - 0.5);
    for _ in 0..200 {
        let (corners, at) = ([any(), any(), any()], any() * 3.0);
        let found = at.distance(nearest(&corners, at));
        let mut least = f64::INFINITY;
        let steps = 60;
        for u in 0..=steps {
            for v in 0..=steps - u {
                let [u, v] = [u, v].map(|step| f64::from(step) / f64::from(steps));
                least =
                    least.min(at.distance(corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v));
            }
        }
        assert!(found <= least + 1e-12 && found >= least - 0.03, "{corners:?} {at}: {found} for {least}");
    }
    for corners in [[DVec3::ONE; 3], [DVec3::ZERO, DVec3::ONE, DVec3::ONE], [DVec3::ZERO, DVec3::ONE, DVec3::ONE * 2.0]]
    {
        assert!(nearest(&corners, DVec3::X).is_finite(), "{corners:?}");
    }
}
