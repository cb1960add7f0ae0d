//! Odd and bad OBJ files of other projects: each ends in a scene or in a clear error, and nothing ends in a panic.

use std::fs;
use std::path::{Path, PathBuf};

use afterlight::scene::{Imported, obj};

/// The outcome that a file must have.
enum Expected {
    /// So many triangles, and warnings that contain these words.
    Triangles(usize, &'static [&'static str]),
    /// An error that names the file and contains these words.
    Error(&'static str),
}
use Expected::{Error, Triangles};

const TABLE: &[(&str, Expected)] = &[
    ("assimp/WusonOBJ.obj", Triangles(3732, &[])),
    ("assimp/box_UTF16BE.obj", Triangles(12, &[])),
    ("assimp/box_mat_with_spaces.obj", Triangles(12, &[])),
    ("assimp/concave_polygon.obj", Triangles(64, &[])),
    ("assimp/cube_usemtl.obj", Triangles(12, &["`mtl3` is not defined"])),
    ("assimp/cube_with_vertexcolors_uni.obj", Triangles(12, &[])),
    ("assimp/mtl_different_folder.obj", Triangles(12, &["texture `image.jpg` is missing"])),
    ("assimp/number_formats.obj", Error("no triangle with an area")),
    ("assimp/point_cloud.obj", Error("no faces")),
    ("assimp/regr_3429812.obj", Triangles(4, &["`Km`"])),
    ("assimp/spider.obj", Triangles(1368 - 56, &["without area (56)"])),
    ("assimp/testmixed.obj", Triangles(12, &["lines (6) and points (24)", "`Default` is not defined"])),
    ("obj2gltf/box-complex-material-alpha/box-complex-material-alpha.obj", Triangles(12, &[])),
    ("obj2gltf/box-external-resources-in-root/box-external-resources-in-root.obj", Triangles(12, &[])),
    ("obj2gltf/box-incomplete-attributes/box-incomplete-normals.obj", Triangles(12, &["index 2 is out of range"])),
    ("obj2gltf/box-incomplete-attributes/box-incomplete-positions.obj", Error(":29: index 2 is out of range")),
    ("obj2gltf/box-incomplete-attributes/box-incomplete-uvs.obj", Triangles(12, &["index 2 is out of range"])),
    ("obj2gltf/box-missing-attributes/box-missing-attributes.obj", Triangles(12, &["has none of them"])),
    ("obj2gltf/box-missing-texture/box-missing-texture.obj", Triangles(12, &["`/cesium.png` is missing"])),
    ("obj2gltf/box-mixed-attributes/box-mixed-attributes.obj", Triangles(12, &[])),
    ("obj2gltf/box-mtllib/box-mtllib.obj", Triangles(12, &[])),
    ("obj2gltf/box-multiple-materials/box-multiple-materials.obj", Triangles(12, &[])),
    ("obj2gltf/box-no-materials/box-no-materials.obj", Triangles(36, &[])),
    ("obj2gltf/box-objects-groups-materials/box-objects-groups-materials.obj", Triangles(36, &[])),
    ("obj2gltf/box-objects/box-objects.obj", Triangles(36, &[])),
    ("obj2gltf/box-positions-only/box-positions-only.obj", Triangles(12, &[])),
    ("obj2gltf/box-rotated/box-rotated.obj", Triangles(64, &[])),
    ("obj2gltf/box-shared-textures-2/box-shared-textures-2.obj", Triangles(12, &[])),
    ("obj2gltf/box-texture-options/box-texture-options.obj", Triangles(12, &[])),
    ("obj2gltf/box-transparent/box-transparent.obj", Triangles(12, &["opacity 0 "])),
    ("obj2gltf/box-uncleaned/box-uncleaned.obj", Triangles(12, &[])),
    ("obj2gltf/box-unnormalized/box-unnormalized.obj", Triangles(12, &["a normal without a length"])),
    ("obj2gltf/box-uvs/box-uvs.obj", Triangles(12, &[])),
    ("obj2gltf/box-with-tabs/box-with-tabs.obj", Triangles(12, &[])),
    ("obj2gltf/box/box.obj", Triangles(12, &[])),
    ("tinyobjloader/catmark_torus_creases0.obj", Triangles(64, &["has none of them", "`t`"])),
    ("tinyobjloader/cornell_box.obj", Triangles(36, &[])),
    ("tinyobjloader/cube-vertex-w-component.obj", Triangles(12, &[])),
    ("tinyobjloader/cube.obj", Triangles(12, &[])),
    ("tinyobjloader/invalid-relative-texture-index.obj", Error(":2: index 1 is out of range")),
    ("tinyobjloader/issue-138.obj", Triangles(12, &[])),
    ("tinyobjloader/issue-161-inconsistent-f.obj", Triangles(12, &[])),
    ("tinyobjloader/issue-177.obj", Triangles(12, &[])),
    ("tinyobjloader/issue-235-usemtl-then-o.obj", Triangles(2, &[])),
    ("tinyobjloader/issue-246-usemtl-whitespace.obj", Triangles(1, &[])),
    ("tinyobjloader/issue-295-trianguation-failure.obj", Triangles(28, &[])),
    ("tinyobjloader/issue-319-003.obj", Triangles(8 - 2, &["without area (2)"])),
    ("tinyobjloader/issue-356-leading-spaces-newmtl.obj", Error("no faces")),
    ("tinyobjloader/issue-95-2.obj", Triangles(1, &[])),
    ("tinyobjloader/leading-decimal-dot-issue-201.obj", Triangles(1, &["`Kt`"])),
    ("tinyobjloader/line-prim.obj", Error("no faces to draw (8 vertices, 2 lines, 0 points)")),
    ("tinyobjloader/missing_material_file.obj", Triangles(36, &["`white` and 4 more"])),
    (
        "tinyobjloader/mtllib-multiple-files-issue-112.obj",
        Triangles(1, &["`invalid-file-aaa.mtl` is missing", "`invalid-file-bbb.mtl` is missing", "`tmp.png`"]),
    ),
    ("tinyobjloader/norm-texopt.obj", Triangles(1, &["texture `normalmap.jpg` is missing"])),
    ("tinyobjloader/points-prim.obj", Error("no faces")),
    ("tinyobjloader/skin-weight.obj", Triangles(12, &["line 13: `vw`"])),
    ("tinyobjloader/smoothing-normal.obj", Triangles(6, &[])),
    (
        "tinyobjloader/texture-filename-with-whitespace.obj",
        Triangles(12, &["texture `texture 01.png` is missing", "texture `bump 01.png` is missing"]),
    ),
    ("tinyobjloader/tr-and-d-issue-43.obj", Triangles(400, &[])),
    ("tinyobjloader/usemtl-issue-68.obj", Triangles(400, &[])),
    ("tobj/cornell_box.obj", Triangles(36, &["`crazy_unknown`", "`this diffuse texture has spaces.jpg` is missing"])),
    ("tobj/invalid_index.obj", Triangles(1, &["line 12: index 7 is out of range: the file has 6 vertices"])),
    ("tobj/quad.obj", Triangles(5, &[])),
    ("tobj/triangle.obj", Triangles(1, &[])),
    ("trimesh/cube.OBJ", Triangles(12, &[])),
    ("trimesh/cubevt.obj", Triangles(12, &["has none of them"])),
    ("trimesh/emptyIO/obj_empty.obj", Error("no faces")),
    ("trimesh/emptyIO/obj_wireframe.obj", Error("12 lines")),
    ("trimesh/face_in_group_name_mid_file.obj", Triangles(2, &["has none of them"])),
    ("trimesh/jacked.obj", Triangles(12, &["library `nonexistent.mtl` is missing", "`material0` is not defined"])),
    ("trimesh/nancolor.obj", Triangles(12, &["vertex colours (1) have a number that is none"])),
    ("trimesh/noimg.obj", Triangles(1000, &["`material_0` is not defined"])),
    ("trimesh/notenoughindices.obj", Triangles(1, &["lines (1)", "`surface.mtl` is missing"])),
    ("trimesh/polygonfaces.obj", Triangles(3, &["`surface.mtl` is missing"])),
    ("trimesh/textured_tetrahedron.obj", Triangles(4, &[])),
    ("trimesh/wallhole.obj", Triangles(53, &["`00.mtl` is missing", "without area (13)"])),
];

#[test]
fn each_file_ends_in_a_scene_or_a_clear_error() {
    let Some(folder) = crate::common::scenes_dir().map(|scenes| scenes.join("odd_obj")) else { return };
    let mut files = Vec::new();
    obj_files(&folder, &mut files);
    assert_eq!(files.len(), TABLE.len(), "files without an expectation, or the other way round");
    for (name, expected) in TABLE {
        let path = folder.join(name);
        match (obj::load(&path, &obj::LoadOptions::default()), expected) {
            (Ok(imported), Triangles(count, warnings)) => {
                assert_eq!(triangle_count(&imported), *count, "{name}");
                assert_sound(&imported, name);
                for expected in *warnings {
                    let found = imported.warnings.iter().any(|warning| warning.contains(expected));
                    assert!(found, "{name}: no warning has {expected:?}: {:#?}", imported.warnings);
                }
                let is_unexpected = |warning: &&String| warnings.is_empty() && !warning.contains("is not defined");
                assert_eq!(imported.warnings.iter().find(is_unexpected), None, "{name}");
            }
            (Err(error), Error(words)) => {
                let text = error.to_string();
                assert!(text.contains(&path.display().to_string()) && text.contains(words), "{name}: {text}");
                assert!(!text.contains('\n'), "{name}: {text}");
            }
            (Ok(_), Error(_)) => panic!("{name}: loaded, though it should not"),
            (Err(error), Triangles(..)) => panic!("{name}: {error}"),
        }
    }
}

#[test]
fn a_file_cut_short_anywhere_does_not_panic() {
    let Some(folder) = crate::common::scenes_dir().map(|scenes| scenes.join("odd_obj")) else { return };
    let copy = tempfile::tempdir().unwrap();
    let mut files = Vec::new();
    obj_files(&folder, &mut files);
    for file in files.iter().filter(|file| fs::metadata(file).is_ok_and(|data| data.len() < 4096)) {
        let bytes = fs::read(file).unwrap();
        for length in (0..bytes.len()).step_by(41) {
            let path = copy.path().join("cut.obj");
            fs::write(&path, &bytes[..length]).unwrap();
            if let Ok(imported) = obj::load(&path, &obj::LoadOptions::default()) {
                assert_sound(&imported, &format!("{} cut at {length}", file.display()));
            }
        }
    }
}

fn triangle_count(imported: &Imported) -> usize {
    imported.objects.iter().map(|object| imported.meshes[object.mesh].indices.len() / 3).sum()
}

/// Asserts the promises that every scene makes of its parts.
fn assert_sound(imported: &Imported, name: &str) {
    assert!(triangle_count(imported) > 0, "{name}: nothing to draw");
    for object in &imported.objects {
        assert!(object.mesh < imported.meshes.len() && object.material < imported.materials.len(), "{name}");
    }
    for material in &imported.materials {
        assert!(material.textures().all(|(_, texture)| texture < imported.textures.len()), "{name}");
    }
    for texture in &imported.textures {
        assert_eq!(texture.rgba8(0).len(), 4 * texture.size[0] as usize * texture.size[1] as usize, "{name}");
    }
    for mesh in &imported.meshes {
        let count = mesh.positions.len();
        assert_eq!(mesh.normals.len(), count, "{name}");
        assert!(mesh.uvs.is_empty() || mesh.uvs.len() == count, "{name}");
        assert!(mesh.tangents.is_empty() || mesh.tangents.len() == count, "{name}");
        assert!(mesh.indices.iter().all(|&index| (index as usize) < count), "{name}");
        for normal in &mesh.normals {
            let length = normal.iter().map(|n| n * n).sum::<f32>().sqrt();
            assert!((length - 1.0).abs() < 1e-5, "{name}: normal of length {length}");
        }
        assert!(mesh.tangents.iter().flatten().chain(mesh.uvs.iter().flatten()).all(|n| n.is_finite()), "{name}");
        assert_eq!(mesh.bounds, mesh.compute_bounds(), "{name}");
    }
}

fn obj_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            obj_files(&path, files);
        } else if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj")) {
            files.push(path);
        }
    }
}
