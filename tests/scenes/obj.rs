//! The meaning of OBJ and MTL files, feature by feature, on small files; and Crytek's Sponza as the real one.

use std::fs;
use std::path::Path;

use afterlight::scene::{AlphaMode, ColorSpace, Error, Imported, Mesh, TextureSlot, Wrap, obj};
use image::{Rgba, RgbaImage};
use tempfile::TempDir;

pub const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n";

/// A folder with `model.obj` and other files.
pub fn folder(obj: &str, others: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("model.obj"), obj).unwrap();
    for (name, text) in others {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

pub fn load(folder: &TempDir) -> Result<Imported, Error> {
    obj::load(&folder.path().join("model.obj"), &obj::LoadOptions::default())
}

pub fn load_text(obj: &str) -> Imported {
    load(&folder(obj, &[])).unwrap()
}

fn error_of(obj: &str) -> String {
    load(&folder(obj, &[])).unwrap_err().to_string()
}

/// A triangle whose material has these statements.
pub fn with_material(folder: &TempDir, statements: &str) -> Imported {
    fs::write(folder.path().join("model.obj"), format!("mtllib m.mtl\n{TRIANGLE}")).unwrap();
    fs::write(folder.path().join("m.mtl"), format!("newmtl m\n{statements}\n")).unwrap();
    load(folder).unwrap()
}

pub fn write_image(folder: &TempDir, name: &str, size: u32, texel: impl Fn(u32, u32) -> [u8; 4]) {
    RgbaImage::from_fn(size, size, |x, y| Rgba(texel(x, y))).save(folder.path().join(name)).unwrap();
}

fn corners(mesh: &Mesh) -> impl Iterator<Item = ([f32; 3], [f32; 3])> {
    mesh.indices.iter().map(|&i| (mesh.positions[i as usize], mesh.normals[i as usize]))
}

#[test]
fn a_file_without_a_face_to_draw_is_refused_with_its_first_fault() {
    for (text, expected) in [
        ("v 0 0 nan\n", "model.obj:1: `nan` is not a finite number"),
        ("v 0 0 0\nv 0 1e39 0\n", "model.obj:2: 1e39 is out of range: at most 1e15"),
        ("v 0 0 0\r\nv 0 1e38 0\r\n", "model.obj:2: 1e38 is out of range: at most 1e15"),
        ("v 0 0 0\nv 1e999 0 0\n", "model.obj:2: `1e999` is not a finite number"),
        ("v 0 0\n", "model.obj:1: `v` has 2 numbers instead of 3"),
        ("vn 0 x 0\n", "model.obj: has no faces to draw (0 vertices, 0 lines, 0 points)"),
        ("v 0 0 0\nf 1 1 2\n", "model.obj:2: index 2 is out of range: the file has 1 vertices"),
        ("v 0 0 0\n\nf 1 1 -2\n", "model.obj:3: index -2 is out of range: 1 have been defined so far"),
        ("v 0 0 0\nf 0 1 1\n", "model.obj:2: index 0 in `0`: OBJ counts from 1"),
        ("v 0 0 0\nf 1 one 1\n", "model.obj:2: `one` is not an index"),
        ("v 0 0 0\nf 1 nan 1\nv 0 nan 0\n", "model.obj:2: `nan` is not an index"),
        ("v 0 0 0\nf 1/1/1/1 1 1\n", "model.obj: has no triangle with an area (1 without)"),
        ("v 0 0 0\nf 1 99999999999999999999 1\n", "model.obj:2: `99999999999999999999` is not an index"),
        ("", "model.obj: has no faces to draw (0 vertices, 0 lines, 0 points)"),
        ("v 0 0 0\np 1\n", "model.obj: has no faces to draw (1 vertices, 0 lines, 1 points)"),
        ("v 0 0 0\nv 1 1 1\nf 1 2 1\n", "model.obj: has no triangle with an area (1 without)"),
    ] {
        let error = error_of(text);
        assert!(error.ends_with(expected), "{text:?}: {error}");
    }
}

#[test]
fn what_cannot_be_read_is_named() {
    let folder = folder("", &[]);
    for path in [folder.path().to_owned(), folder.path().join("none.obj")] {
        let error = obj::load(&path, &obj::LoadOptions::default()).unwrap_err();
        assert!(
            matches!(error, Error::Read { .. }) && error.to_string().contains(&path.display().to_string()),
            "{error}"
        );
    }
}

#[test]
fn negative_indices_continued_lines_and_crlf_are_read() {
    let text = "v 0 0 0\r\nv 1 0 0 \\\r\n\r\nv 0 1 \\\r\n 0\r\nf -3 \\\r\n -2 -1 # done\r\n";
    let imported = load_text(text);
    assert_eq!(imported.meshes[0].indices.len(), 3);
    assert_eq!(imported.warnings, Vec::<String>::new());
}

#[test]
fn each_group_and_material_is_a_mesh() {
    let face = "f 1 2 3\n";
    let text = format!(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\n{face}o house\n{face}g wall\n{face}usemtl red\n{face}g roof\n{face}g wall\n{face}"
    );
    let imported = load_text(&text);
    let names: Vec<_> =
        imported.objects.iter().map(|o| (o.name.as_str(), imported.materials[o.material].name.as_str())).collect();
    let expected = [
        ("", "default"),
        ("house", "default"),
        ("house/wall", "default"),
        ("house/wall", "red"),
        ("house/roof", "red"),
    ];
    assert_eq!(names, expected);
    assert_eq!(imported.meshes[3].indices.len(), 6);
}

#[test]
fn smoothing_groups_decide_where_no_normals_are() {
    // A roof of two faces at 90 degrees over a common ridge.
    let roof = "v 0 0 0\nv 1 0 0\nv 1 1 -1\nv 0 1 -1\nv 1 0 -2\nv 0 0 -2\n";
    let faces = "f 1 2 3 4\nf 4 3 5 6\n";
    let ridge = |smoothing: &str| {
        let imported = load_text(&format!("{roof}{smoothing}{faces}"));
        let mesh = &imported.meshes[0];
        let normals: Vec<_> = corners(mesh).filter(|(p, _)| p[1] > 0.0).map(|(_, n)| n).collect();
        normals.iter().all(|n| n[1] > 0.99)
    };
    assert!(ridge("s 1\n") && ridge("s on\n"));
    assert!(!ridge("s off\n") && !ridge("s 0\n") && !ridge(""));
    assert!(
        !load_text(&format!("{roof}s 1\nf 1 2 3 4\ns 2\nf 4 3 5 6\n")).meshes[0].normals.iter().any(|n| n[1] > 0.99)
    );
}

#[test]
fn without_smoothing_groups_gentle_edges_are_smooth() {
    // Two faces at 40 degrees.
    let text = "v 0 0 0\nv 1 0 0\nv 1 0 -1\nv 0 0 -1\nv 1 -0.84 -2\nv 0 -0.84 -2\nf 1 2 3 4\nf 4 3 5 6\n";
    let imported = load_text(text);
    assert_eq!(imported.meshes[0].positions.len(), 6);
}

#[test]
fn normals_are_normalized_and_those_of_no_length_computed() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 7\nvn 0 0 0\nf 1//1 2//1 3//2\n";
    assert_eq!(load_text(text).meshes[0].normals, vec![[0.0, 0.0, 1.0]; 3]);
}

#[test]
fn a_model_far_from_zero_keeps_its_shape() {
    let text = "v 5000000.001 0 0\nv 5000000.002 0 0\nv 5000000.001 0.001 0\nf 1 2 3\n";
    let mesh = &load_text(text).meshes[0];
    let width = f64::from(mesh.positions[1][0] - mesh.positions[0][0]);
    assert!((width - 0.001).abs() < 1e-6, "{width}");
    assert!((mesh.origin.x - 5_000_000.001_5).abs() < 1e-8);
}

#[test]
fn v_runs_down_from_the_upper_left_corner() {
    assert_eq!(load_text(TRIANGLE).meshes[0].uvs, [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]);
}

#[test]
fn libraries_may_be_several_and_have_spaces() {
    let obj = format!("mtllib one.mtl my two.mtl none.mtl\n{TRIANGLE}usemtl B\nf 1 2 3\n");
    let folder = folder(&obj, &[("one.mtl", "newmtl m\nKd 1 0 0\n"), ("My Two.mtl", "newmtl b\nKd 0 1 0\n")]);
    let imported = load(&folder).unwrap();
    let colors: Vec<_> = imported.materials.iter().map(|m| m.base_color.to_array()).collect();
    assert_eq!(colors, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(imported.warnings.len(), 1);
    assert!(
        imported.warnings[0].ends_with("model.obj:1: material library `none.mtl` is missing"),
        "{:?}",
        imported.warnings
    );
}

#[test]
fn phong_becomes_metallic_roughness() {
    let folder = folder("", &[]);
    let material = |text: &str| with_material(&folder, text).materials[0].clone();
    let phong = material("Ka 0.1 0.1 0.1\nKd 0.5 0.5 0.5\nKs 0.2 0.3 0.4\nNs 30\nKe 5 0 0");
    assert_eq!(phong.base_color.to_array(), [0.5; 3]);
    assert_eq!(phong.specular.to_array(), [0.2, 0.3, 0.4]);
    assert_eq!(phong.emissive.to_array(), [5.0, 0.0, 0.0]);
    assert_eq!((phong.shininess, phong.metallic), (30.0, 0.0));
    assert!((phong.roughness - 0.5).abs() < 1e-6 && (phong.ambient - 0.2).abs() < 1e-6);
    let metal = material("Kd 1 1 1\nNs 30\nPr 0.3\nPm 0.9");
    assert_eq!((metal.roughness, metal.metallic), (0.3, 0.9));
    for (text, opacity) in [("d 0.5", 0.5), ("Tr 0.25", 0.75), ("Tr 1\nd 0.5", 0.5)] {
        let material = material(text);
        assert_eq!((material.alpha, material.alpha_mode), (opacity, AlphaMode::Blend), "{text}");
    }
    for text in ["d 0", "Tr 1", "d -1"] {
        let imported = with_material(&folder, text);
        let material = &imported.materials[0];
        assert_eq!((material.alpha, material.alpha_mode), (1.0, AlphaMode::Opaque), "{text}");
        assert!(imported.warnings[0].contains("would leave nothing to see, drawn opaque"), "{:?}", imported.warnings);
    }
    assert_eq!(with_material(&folder, "d 1\nTr 1").warnings, Vec::<String>::new());
}

#[test]
fn maps_are_found_and_options_taken_off() {
    let folder = folder("", &[]);
    write_image(&folder, "Wall 1.png", 2, |_, _| [10, 20, 30, 255]);
    let imported = with_material(&folder, "Kd 0 0 0\nmap_Kd -s 2 3 1 -o 0.5 0 0 -clamp on .\\wall 1.PNG");
    let material = &imported.materials[0];
    assert_eq!((material.base_color.to_array(), material.alpha_mode), ([1.0; 3], AlphaMode::Opaque));
    assert_eq!(imported.textures[0].rgba8(0)[..4], [10, 20, 30, 255]);
    assert_eq!(imported.textures[0].color_space, ColorSpace::Srgb);
    assert_eq!(imported.meshes[0].uvs, [[0.5, 1.0], [2.5, 1.0], [0.5, -2.0]]);
    assert_eq!(imported.textures[0].sampler.wrap, [Wrap::Clamp; 2]);
    assert_eq!(imported.warnings, Vec::<String>::new());
    let imported = with_material(&folder, "map_Kd none.png");
    assert!(
        imported.warnings[0].contains("m.mtl:2: material `m`: texture `none.png` is missing"),
        "{:?}",
        imported.warnings
    );
    assert!(imported.textures.is_empty());
}

#[test]
fn masks_go_into_alpha() {
    let folder = folder("", &[]);
    write_image(&folder, "c.png", 2, |_, _| [90, 90, 90, 255]);
    write_image(&folder, "mask.png", 4, |x, _| if x < 2 { [0, 0, 0, 255] } else { [255; 4] });
    write_image(&folder, "leaf.png", 2, |x, _| [50, 90, 50, if x == 0 { 0 } else { 255 }]);
    let imported = with_material(&folder, "map_Kd c.png\nmap_d mask.png");
    assert_eq!(imported.materials[0].alpha_mode, AlphaMode::Mask { cutoff: 0.5 });
    assert_eq!((imported.textures.len(), imported.textures[0].size), (1, [4, 4]));
    let alpha: Vec<_> = imported.textures[0].rgba8(0).chunks(4).take(4).map(|t| (t[0], t[3])).collect();
    assert_eq!(alpha, [(90, 0), (90, 0), (90, 255), (90, 255)]);
    for text in ["map_Kd leaf.png", "map_Kd leaf.png\nmap_d leaf.png", "map_d leaf.png"] {
        let imported = with_material(&folder, text);
        assert_eq!(imported.materials[0].alpha_mode, AlphaMode::Mask { cutoff: 0.5 }, "{text}");
        assert_eq!(imported.textures[0].rgba8(0)[3], 0, "{text}");
    }
    assert_eq!(with_material(&folder, "map_Kd c.png\nmap_d c.png").materials[0].alpha_mode, AlphaMode::Opaque);
}

#[test]
fn bump_maps_are_normals_or_heights() {
    let folder = folder("", &[]);
    write_image(&folder, "n.png", 4, |_, _| [128, 128, 255, 255]);
    write_image(&folder, "h.png", 4, |x, _| [(x * 60) as u8, (x * 60) as u8, (x * 60) as u8, 255]);
    for text in ["bump -bm 0.2 n.png", "map_Bump -bm 0.2 n.png", "norm -bm 0.2 n.png"] {
        let imported = with_material(&folder, text);
        assert_eq!(imported.materials[0].normal_scale, 0.2, "{text}");
        assert_eq!(imported.textures[0].rgba8(0)[..4], [128, 128, 255, 255], "{text}");
        assert_eq!(imported.meshes[0].tangents.len(), 3, "{text}");
    }
    let imported = with_material(&folder, "bump -bm 0.5 h.png");
    assert_eq!(imported.materials[0].normal_scale, 1.0);
    assert!(imported.textures[0].rgba8(0)[4] < 100, "uphill to the right leans left");
    let imported = with_material(&folder, "map_Kd h.png\nbump h.png");
    assert_eq!((imported.materials[0].normal_texture, imported.meshes[0].tangents.len()), (None, 0));
    assert!(imported.warnings[0].contains("h.png is the colour map too"), "{:?}", imported.warnings);
}

#[test]
fn roughness_metalness_shininess_emission_and_specular_maps_are_packed() {
    let folder = folder("", &[]);
    write_image(&folder, "grey.png", 1, |_, _| [51, 51, 51, 255]);
    write_image(&folder, "white.png", 2, |_, _| [255; 4]);
    let imported = with_material(&folder, "map_Pr grey.png\nmap_Pm white.png\nmap_Ke white.png\nmap_Ks white.png");
    let material = &imported.materials[0];
    assert_eq!((material.roughness, material.metallic), (1.0, 1.0));
    assert_eq!((material.emissive.to_array(), material.specular.to_array()), ([1.0; 3], [1.0; 3]));
    let packed = &imported.textures[material.metallic_roughness_texture.unwrap()];
    assert_eq!(
        (packed.size, packed.color_space, &packed.rgba8(0)[..4]),
        ([2, 2], ColorSpace::Linear, &[0, 51, 255, 255][..])
    );
    assert_eq!(
        material.textures().map(|(slot, _)| slot).collect::<Vec<_>>(),
        [TextureSlot::MetallicRoughness, TextureSlot::Emissive, TextureSlot::Specular]
    );
    assert_eq!(imported.textures.len(), 2, "the same image in the same colour space is there once");
    let imported = with_material(&folder, "Ns 150\nmap_Ns grey.png");
    // (2 / (0.2 * 150 + 2))^(1/4) = 0.5
    assert_eq!((imported.textures[0].rgba8(0)[1], imported.materials[0].roughness), (128, 1.0));
    // The Phong models take it as it is: a fifth of their power.
    let material = &imported.materials[0];
    let share = &imported.textures[material.shininess_texture.expect("its own")];
    assert_eq!((share.rgba8(0)[1], share.color_space, material.shininess), (51, ColorSpace::Linear, 150.0));
}

#[test]
fn sponza_is_whole() {
    let Some(scenes) = crate::common::scenes_dir() else { return };
    let path = scenes.join("crytek_sponza/sponza.obj");
    let imported = obj::load(&path, &obj::LoadOptions::default()).unwrap();
    let triangles: usize = imported.meshes.iter().map(|mesh| mesh.indices.len() / 3).sum();
    assert_eq!(triangles, 279_163 - 24);
    // The documents have the number that is drawn: 24 triangles of the file have no area.
    let told = format!("{},{:03} triangles", triangles / 1000, triangles % 1000);
    for name in ["benches/README.md", "docs/FIGURES.md", "docs/LIGHT_PATHS.md"] {
        let text = fs::read_to_string(Path::new(env!("AFTERLIGHT_ROOT")).join(name)).unwrap();
        assert!(text.contains(&told), "{name} should say {told}");
    }
    assert_eq!((imported.materials.len(), imported.textures.len(), imported.meshes.len()), (26, 33, 394));
    let masked: Vec<_> = imported.materials.iter().filter(|m| m.is_masked()).map(|m| m.name.as_str()).collect();
    assert_eq!(masked, ["leaf", "Material__57", "chain"]);
    let bumped = imported.materials.iter().filter(|m| m.normal_texture.is_some()).count();
    assert_eq!(bumped, 8);
    // Crytek's maps have green pointing down, whole models are told by their vote.
    let turned = imported.warnings.iter().any(|warning| warning.starts_with("normal maps (8,"));
    assert!(turned && imported.warnings.len() == 3, "{:#?}", imported.warnings);
    assert_original_names_are_warned_about(&scenes);
}

/// Crytek's own MTL has backslash paths to images that are not there.
fn assert_original_names_are_warned_about(scenes: &Path) {
    let folder = folder(&format!("mtllib m.mtl\n{}", TRIANGLE.replace("usemtl m", "usemtl leaf")), &[]);
    fs::copy(scenes.join("crytek_sponza/sponza_original.mtl"), folder.path().join("m.mtl")).unwrap();
    let warnings = load(&folder).unwrap().warnings;
    assert!(warnings[0].contains("texture `textures\\sponza_thorn_diff.tga` is missing"), "{warnings:?}");
}

#[test]
fn progress_is_told() {
    let folder = folder("", &[]);
    write_image(&folder, "c.png", 1, |_, _| [255; 4]);
    with_material(&folder, "map_Kd c.png");
    let steps = std::sync::Mutex::new(Vec::new());
    let progress = |step: obj::Progress| steps.lock().unwrap().push((step.what, step.done, step.total));
    obj::load(&folder.path().join("model.obj"), &obj::LoadOptions { progress: Some(&progress) }).unwrap();
    let mut steps = steps.into_inner().unwrap();
    steps.sort_unstable();
    assert_eq!(steps, [("meshes", 1, 1), ("textures", 1, 1)]);
}

#[test]
fn backs_are_left_out_only_where_normals_say_which_side_is_the_front() {
    let positions = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let two_sided = |faces: &str| load_text(&format!("{positions}{faces}")).materials[0].two_sided;
    assert!(two_sided("f 1 2 3\n"), "no normals: nobody knows");
    assert!(!two_sided("vn 0 0 1\nf 1//1 2//1 3//1\n"), "wound as its normals say");
    assert!(two_sided("vn 0 0 -1\nf 1//1 2//1 3//1\n"), "wound against them");
}
