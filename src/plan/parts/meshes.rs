//! Vertices and indices.

use std::collections::BTreeSet;

use super::{Part, part};
use crate::plan::{FramePlan, Shading};
use crate::scene::{HAS_LEVELS, OptionalPart, Scene, Settings, counted};

/// Vertices and indices on the device, by stream.
pub(super) fn geometry(scene: &Scene, plan: &FramePlan) -> Vec<Part> {
    let planned = &plan.meshes;
    let rules = plan.surface_rules();
    let needed: BTreeSet<usize> =
        scene.objects.iter().filter(|object| rules.needs_mesh(scene, object)).map(|object| object.mesh).collect();
    let unused = scene.meshes.len() - needed.len();
    let keeps_unused = plan.keep.has(OptionalPart::UnusedMeshes) && unused > 0;
    let unused = match unused {
        0 => "no mesh of the scene is unused".into(),
        count => format!("no pass draws {count} of {}", counted(scene.meshes.len(), "mesh")),
    };
    let stream = |name: &str, optional: OptionalPart, vertices: u64, stride: u64, (yes, no): (&str, &str)| {
        let reason = match (vertices, plan.keep.has(optional)) {
            (0, _) => no.to_string(),
            (_, true) => "padded for all vertices".into(),
            (some, false) if some == planned.vertices => yes.to_string(),
            (some, false) => format!("{yes}: {some} of {} vertices have them", planned.vertices),
        };
        part(name, vertices > 0, reason, stride * vertices).is(optional)
    };
    let wide = match (planned.indices_32, plan.keep.has(OptionalPart::WideIndices)) {
        (0, _) => "no mesh has more vertices than 16 bits can number".into(),
        (_, true) => "kept for all meshes".into(),
        (_, false) => "of meshes with more than 65536 vertices".to_string(),
    };
    let narrow = match (planned.vertices, planned.indices_16) {
        (0, _) => "no mesh is drawn",
        (_, 1..) => "of meshes with at most 65536 vertices",
        _ if plan.keep.has(OptionalPart::WideIndices) => "all indices are kept at 32 bits",
        _ => "every mesh has more than 65536 vertices",
    };
    let positions = match planned.vertices {
        0 => "no mesh is drawn",
        _ => "every pass that draws meshes reads them",
    };
    vec![
        part("vertex positions", planned.vertices > 0, positions, 12 * planned.vertices),
        part("16-bit indices", planned.indices_16 > 0, narrow, 2 * planned.indices_16),
        part("32-bit indices", planned.indices_32 > 0, wide, 4 * planned.indices_32).is(OptionalPart::WideIndices),
        // Unused meshes' bytes are counted above and below.
        part("unused meshes", keeps_unused, unused, 0).is(OptionalPart::UnusedMeshes),
        stream("vertex normals", OptionalPart::Normals, planned.normals, 12, ("shading reads them", "nothing shades")),
        stream("vertex UVs", OptionalPart::Uvs, planned.uvs, 8, ("textures are sampled", "no texture is sampled")),
        stream(
            "vertex tangents",
            OptionalPart::Tangents,
            planned.tangents,
            16,
            ("a normal map is sampled", "no normal map is sampled"),
        ),
        stream(
            "second vertex UVs",
            OptionalPart::SecondUvs,
            planned.second_uvs,
            8,
            ("a texture uses them", "no texture uses them"),
        ),
        stream(
            "vertex colours",
            OptionalPart::VertexColors,
            planned.colors,
            16,
            ("they multiply base colours", "no drawn mesh has other colours than white"),
        ),
        looks(plan),
    ]
}

fn looks(plan: &FramePlan) -> Part {
    let reason = match (plan.has_looks(), plan.keep.has(OptionalPart::Looks)) {
        (true, true) => "kept for all objects: 8 bytes an instance, beside the 48 of its place",
        (true, false) => "objects have a tint or an atlas cell, or may be selected: 8 bytes an instance",
        (false, _) => "no object has a tint, atlas cell or selection",
    };
    // Each frame writes the looks of the instances that it draws.
    part("looks of instances", plan.has_looks(), reason, 0).is(OptionalPart::Looks)
}

/// Levels of detail, whose bytes are counted with the indices.
pub(super) fn levels(settings: &Settings, plan: &FramePlan) -> Part {
    let leveled: Vec<_> = plan.meshes.meshes.iter().map(|mesh| mesh.levels.len()).filter(|&count| count > 0).collect();
    let reason = match plan.shading {
        _ if plan.lod > 0.0 => format!(
            "objects are off by at most {} pixels: {} of {}, {} KiB of indices",
            plan.lod,
            counted(leveled.iter().sum::<usize>(), "level"),
            counted(leveled.len(), "mesh"),
            plan.meshes.level_bytes().div_ceil(1024)
        ),
        _ if settings.lod <= 0.0 => "not asked for: meshes are drawn in full".into(),
        _ if !HAS_LEVELS => {
            "meshes are drawn in full: the library lacks its feature `readers`, which makes levels".into()
        }
        Shading::ShowTriangle => "the view shows the triangles of the meshes themselves".into(),
        _ => "no opaque mesh can be simplified enough to pay".into(),
    };
    part("levels of detail", plan.lod > 0.0, reason, 0)
}
