//! glTF files of other projects: the good ones are read without a warning, and each odd one ends in a scene that can be drawn or in a clear error.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use afterlight::scene::{OpenOptions, Scene, open};

/// The outcome that a file must have.
enum Expected {
    /// So many triangles, and warnings that contain these words.
    Triangles(usize, &'static [&'static str]),
    /// An error that contains these words.
    Error(&'static str),
}
use Expected::{Error, Triangles};

/// The odd files that show something, and the odd files whose error must name the fault. All others only have to end in one line.
const TABLE: &[(&str, Expected)] = &[
    (
        "assimp/BoxBadNormals-glTF-Binary/BoxBadNormals.glb",
        Triangles(12, &["(`Mesh`), primitive 0: normals have no length"]),
    ),
    (
        "assimp/BoxWithInfinites-glTF-Binary/BoxWithInfinites.glb",
        Error("mesh 0 (`Mesh`), primitive 0: the POSITION of vertex 0"),
    ),
    ("assimp/IndexOutOfRange/AllIndicesOutOfRange.gltf", Error("index 0 is 65535, but there are only 24 vertices")),
    ("assimp/MissingBin/BoxTextured.gltf", Error("BoxTextured0.bin: No such file")),
    ("assimp/SchemaFailures/sceneWrongType.gltf", Error("BoxTextured0.bin: No such file")),
    ("assimp/glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_01.gltf", Triangles(8, &[])),
    ("assimp/glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_05.gltf", Triangles(2, &[])),
    ("assimp/glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_15.gltf", Triangles(2, &[])),
    ("assimp/simple_skin/quad_skin.glb", Triangles(2, &["more than 8 joints"])),
    ("assimp_gltf1/IncorrectVertexArrays/Cube_v1.gltf", Error("is glTF of version \"1.0\"")),
    ("blender_io/00_no_scene/00_no_scene.gltf", Triangles(12, &[])),
    ("gltf-rs/gltf-json/tests/minimal_accessor_invalid.gltf", Triangles(1, &[])),
    ("gltf-rs/tests/box_sparse.glb", Triangles(12, &[])),
    ("tinygltf/models/BoundsChecking/integer-out-of-bounds.gltf", Error("accessor 0: its 3 elements of 2 bytes")),
    ("tinygltf/models/CubeImageUriSpaces/CubeImageUriMultipleSpaces.gltf", Triangles(12, &[])),
    ("tinygltf/models/Extensions-issue97/test.gltf", Triangles(1, &["not drawn: VENDOR_material_some_ext"])),
    ("tinygltf/models/SparseMorphTargets-issue280/singleBlendshapeCube_sparse.glb", Triangles(12, &[])),
    ("tinygltf/models/regression/unassigned-skeleton.gltf", Triangles(8, &[])),
    ("trimesh/no_indices_3storybuilding.glb", Triangles(72, &[])),
    ("validator/base/data/asset/1_0_version.gltf", Error("version \"1.0\"")),
    (
        "validator/base/data/glb/truncated_chunk_data.glb",
        Error("has a chunk of 28 bytes at byte 12, which reaches past its end"),
    ),
    ("validator/base/data/node/node_loop.gltf", Error("node 0 is its own ancestor")),
    ("validator/base/data/node/node_parent_override.gltf", Error("node 2 is a child of node 0 and of node 1")),
    ("validator/base/data/node/unresolved_child_node.gltf", Error("its child 1 does not exist")),
    ("validator/base/data/root/undefined_used_extensions.gltf", Error("requires the extension KHR_extension")),
    ("validator/base/data/scene/non_root_node.gltf", Error("node 1, which is no root")),
];

/// Time that any file may take, also on a busy machine.
const MOST: Duration = Duration::from_secs(10);

fn read(path: &Path) -> Result<Scene, String> {
    let start = Instant::now();
    let opened = open(&path.to_string_lossy(), &OpenOptions::default()).map_err(|error| error.to_string());
    assert!(start.elapsed() < MOST, "{}: {:?}", path.display(), start.elapsed());
    match &opened {
        Ok(scene) => assert_eq!(scene.check().map_err(|error| error.to_string()), Ok(()), "{}", path.display()),
        Err(error) => {
            assert!(error.contains(&path.display().to_string()) && !error.contains('\n'), "{error}");
        }
    }
    opened
}

#[test]
fn each_odd_file_ends_in_a_scene_or_a_clear_error() {
    let Some(folder) = crate::common::scenes_dir().map(|scenes| scenes.join("odd_gltf")) else { return };
    let files = gltf_files(&folder);
    assert!(files.len() > 200, "only {} files", files.len());
    let opened: Vec<_> = files.iter().map(|file| (file, read(file))).collect();
    for (name, expected) in TABLE {
        let found = opened.iter().find(|(file, _)| **file == folder.join(name));
        let (_, found) = found.unwrap_or_else(|| panic!("{name} is not there"));
        match (found, expected) {
            (Ok(scene), Triangles(count, warnings)) => {
                assert_eq!(scene.triangle_count(), *count, "{name}");
                assert_eq!(scene.warnings.len(), warnings.len(), "{name}: {:?}", scene.warnings);
                for words in *warnings {
                    assert!(
                        scene.warnings.iter().any(|warning| warning.contains(words)),
                        "{name}: {:?}",
                        scene.warnings
                    );
                }
            }
            (Err(error), Error(words)) => assert!(error.contains(words), "{name}: {error}"),
            (Ok(_), Error(_)) => panic!("{name}: read, though it should not"),
            (Err(error), Triangles(..)) => panic!("{name}: {error}"),
        }
    }
}

#[test]
fn good_files_are_read_without_a_warning() {
    let Some(scenes) = crate::common::scenes_dir() else { return };
    let folders = ["gltf", "kenney_city", "zdm2", "dutch_ship_medium"].map(|name| scenes.join(name));
    let files: Vec<PathBuf> = folders.iter().flat_map(|folder| gltf_files(folder)).collect();
    assert!(files.len() > 50, "only {} files", files.len());
    for file in files {
        let scene = read(&file).unwrap_or_else(|error| panic!("{error}"));
        assert!(scene.warnings.is_empty(), "{}: {:?}", file.display(), scene.warnings);
        assert!(scene.triangle_count() > 0, "{}", file.display());
    }
}

#[test]
fn a_scene_and_a_camera_are_chosen_by_name_or_number() {
    let Some(scenes) = crate::common::scenes_dir() else { return };
    let spec = scenes.join("gltf/MultipleScenes/MultipleScenes.gltf");
    let triangles = |scene: Option<&str>| {
        let opened = open(&spec.to_string_lossy(), &OpenOptions { scene, ..OpenOptions::default() });
        opened.map(|scene| scene.triangle_count()).map_err(|error| error.to_string())
    };
    assert_eq!((triangles(Some("0")), triangles(Some("1"))), (Ok(1), Ok(2)));
    assert!(triangles(Some("2")).unwrap_err().contains("unknown scene \"2\""));
    let cameras = read(&scenes.join("gltf/Cameras/Cameras.gltf")).expect("two cameras");
    assert_eq!((cameras.cameras.len(), cameras.camera), (2, cameras.cameras[0].camera));
    assert!(cameras.cameras[1].camera.is_orthographic());
}

#[test]
fn a_million_triangles_that_share_their_spheres_are_few() {
    let Some(scenes) = crate::common::scenes_dir() else { return };
    let file = scenes.join("gltf/MetalRoughSpheresNoTextures/MetalRoughSpheresNoTextures.glb");
    let scene = read(&file).unwrap_or_else(|error| panic!("{error}"));
    assert!(scene.triangle_count() > 1_000_000);
    let own: usize = scene.meshes.iter().map(|mesh| mesh.indices.len() / 3).sum();
    assert!(own < 100_000, "{own} triangles in memory");
}

/// Returns all glTF files below a folder, sorted.
fn gltf_files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    for entry in entries {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            found.extend(gltf_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "gltf" || extension == "glb") {
            found.push(path);
        }
    }
    found.sort();
    found
}
