//! Faces of OBJ files that lie back to back, and faces of very many corners.

use afterlight::scene::Imported;

use super::obj::{folder, load, load_text};

const SQUARE: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n";

/// By object, its material's name, whether it has two sides, and its triangles.
fn drawn(found: &Imported) -> Vec<(&str, bool, usize)> {
    let of = |object: &afterlight::scene::Object| {
        let material = &found.materials[object.material];
        (material.name.as_str(), material.two_sided, found.meshes[object.mesh].indices.len() / 3)
    };
    found.objects.iter().map(of).collect()
}

#[test]
fn faces_back_to_back_have_one_side_each_and_others_keep_both() {
    let folder = folder(
        &format!("mtllib m.mtl\n{SQUARE}v 3 0 0\nusemtl red\nf 1 2 3 4\nf 2 5 3\nusemtl green\nf 2 1 4 3\n"),
        &[("m.mtl", "newmtl red\nKd 1 0 0\nnewmtl green\nKd 0 1 0\n")],
    );
    let found = load(&folder).unwrap();
    assert_eq!(drawn(&found), [("red", true, 1), ("red", false, 2), ("green", false, 2)]);
    assert_eq!(found.warnings, Vec::<String>::new());
    // Each side has its own normals, even if both are in one smoothing group.
    for text in [format!("{SQUARE}f 1 2 3 4\nf 4 3 2 1\n"), format!("{SQUARE}s 1\nf 1 2 3 4\nf 4 3 2 1\n")] {
        let found = load_text(&text);
        assert_eq!(found.meshes[0].indices.len(), 12);
        assert_eq!(found.meshes[0].triangles_up_and_down(), (2, 2), "{text}");
        assert!(!found.materials[found.objects[0].material].two_sided);
    }
    // Two copies of a face that face one way are not back to back.
    assert_eq!(drawn(&load_text(&format!("{SQUARE}f 1 2 3 4\nf 2 3 4 1\n"))).len(), 1);
}

trait Sides {
    /// Triangles whose normals point to +Z, and to -Z.
    fn triangles_up_and_down(&self) -> (usize, usize);
}

impl Sides for afterlight::scene::Mesh {
    fn triangles_up_and_down(&self) -> (usize, usize) {
        let normals = |corners: &[u32; 3]| corners.map(|corner| self.normals[corner as usize]);
        let towards = |z: f32| {
            let all = self.indices.as_chunks::<3>().0.iter().map(normals);
            all.filter(|normals| normals.iter().all(|normal| (normal[2] - z).abs() < 1e-6)).count()
        };
        (towards(1.0), towards(-1.0))
    }
}

#[test]
fn a_concave_face_of_many_corners_covers_its_outline_alone() {
    // A gear of 5,000 teeth: a fan would cover the gaps between them.
    let corners: Vec<[f64; 2]> = (0..10_000)
        .map(|i| {
            let (angle, radius) = (f64::from(i) / 5_000.0 * std::f64::consts::PI, f64::from(1 + i % 2));
            [radius * angle.cos(), radius * angle.sin()]
        })
        .collect();
    let vertices: String = corners.iter().map(|[x, y]| format!("v {x} {y} 0\n")).collect();
    let face: String = (1..=corners.len()).map(|i| format!(" {i}")).collect();
    let found = load_text(&format!("{vertices}f{face}\n"));
    assert_eq!(found.warnings, Vec::<String>::new());
    let mesh = &found.meshes[0];
    let point = |index: u32| mesh.positions[index as usize].map(f64::from);
    let area = |&[a, b, c]: &[u32; 3]| {
        let [a, b, c] = [a, b, c].map(point);
        ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2.0
    };
    let areas: Vec<f64> = mesh.indices.as_chunks::<3>().0.iter().map(area).collect();
    // Of each of the triangles between the middle and two corners: half the product of the radii and the sine.
    let expected = 10_000.0 * (std::f64::consts::PI / 5_000.0).sin();
    assert!((areas.iter().sum::<f64>() / expected - 1.0).abs() < 1e-3);
    assert!(areas.iter().all(|&area| area > -1e-6), "a triangle is turned over");
}

#[test]
fn a_face_that_crosses_itself_too_often_is_named_with_its_line() {
    // An eight: its smaller circle is inside out.
    let circle = |radius: f64, turn: f64| {
        let corner = move |i: u32| {
            let angle = f64::from(i) / 20_000.0 * std::f64::consts::TAU;
            format!("v {} {} 0\n", radius * (angle.cos() - 1.0), turn * angle.sin())
        };
        (0..20_000).map(corner).collect::<String>()
    };
    let vertices = circle(2.0, 2.0) + &circle(-1.0, 1.0);
    let face: String = (1..=40_000).map(|i| format!(" {i}")).collect();
    let found = load_text(&format!("{vertices}f{face}\nf 1 2 3\n"));
    let words = "model.obj:40001: a face of many corners crosses itself";
    assert!(found.warnings.iter().any(|own| own.contains(words)), "{:?}", found.warnings);
}
