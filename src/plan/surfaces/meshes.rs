//! The meshes on the device, the vertex streams of each, and the width of its indices.

use std::sync::Arc;

use rayon::prelude::*;

use super::{DeformPlan, GeometryKey, NumberedMesh, Streams, SurfaceRules};
use crate::scene::{Keep, Level, Mesh, Object, OptionalPart, STROKE_VERTICES, Scene, TextureSlot};

/// Bits of an index.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum IndexWidth {
    /// The width for meshes of at most 65536 vertices.
    Bits16,
    /// The width for larger meshes, and for all meshes if [`OptionalPart::WideIndices`] is kept.
    Bits32,
}

impl IndexWidth {
    /// Vertices that 16 bits can number. The last one, 0xffff, is an ordinary vertex: it restarts primitives only if `primitiveRestartEnable` is set,
    /// and no pipeline sets it.
    const MOST_OF_16_BITS: usize = 1 << 16;

    fn of(vertices: usize, keep: Keep) -> Self {
        match vertices <= Self::MOST_OF_16_BITS && !keep.has(OptionalPart::WideIndices) {
            true => Self::Bits16,
            false => Self::Bits32,
        }
    }

    /// Bytes of an index: 2 or 4.
    pub fn bytes(self) -> u64 {
        match self {
            Self::Bits16 => 2,
            Self::Bits32 => 4,
        }
    }
}

/// A mesh in the shared buffers.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedMesh {
    /// Index into the scene's meshes.
    pub mesh: usize,
    /// The first vertex in all of its streams; `None` if all of its objects are deformed, so that only its indices are stored.
    pub first_vertex: Option<u32>,
    /// Vertices in each stream.
    pub vertices: u32,
    /// The first index, in the buffer of its width.
    pub first_index: u32,
    /// Three for each triangle.
    pub index_count: u32,
    /// Says which of the two index buffers the mesh lies in.
    pub width: IndexWidth,
    /// Streams that a pipeline reads of it, or that are kept.
    pub streams: Streams,
    /// Levels of detail, the finest first, whose indices follow the mesh's own.
    pub levels: Vec<PlannedLevel>,
}

/// A level of detail, in the index buffer of its mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlannedLevel {
    /// The first index.
    pub first_index: u32,
    /// Three for each triangle.
    pub index_count: u32,
    /// The vertex of the mesh that begins the level's first triangle, if triangles are numbered.
    pub begin: u32,
    /// As [`Level::error`].
    pub error: f64,
}

/// The meshes of a plan. Meshes that need more streams come first, so that each stream ends early and a mesh has the same first vertex in all
/// streams.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MeshPlan {
    /// The meshes in the order of the buffers.
    pub meshes: Vec<PlannedMesh>,
    /// Triangles are identified by their vertices: meshes are stored as [`NumberedMesh`]es.
    pub numbered: bool,
    /// Vertices of all meshes; each has a position.
    pub vertices: u64,
    /// Vertices of the stream of normals: up to the last mesh that needs it.
    pub normals: u64,
    /// Vertices of the stream of texture coordinates, likewise.
    pub uvs: u64,
    /// Vertices of the stream of tangents, likewise.
    pub tangents: u64,
    /// Vertices of the second stream of texture coordinates, likewise.
    pub second_uvs: u64,
    /// Vertices of the stream of colours, likewise.
    pub colors: u64,
    /// Indices in the buffer of 16-bit ones.
    pub indices_16: u64,
    /// Indices in the buffer of 32-bit ones.
    pub indices_32: u64,
    /// The index width of triangles that are sorted for each frame, if some are.
    pub sorted_width: Option<IndexWidth>,
    /// Deformed objects, whose vertices are stored separately.
    pub deforms: DeformPlan,
}

impl MeshPlan {
    pub(in crate::plan) fn of(scene: &Scene, rules: &SurfaceRules) -> Self {
        let (mut streams, keep) = (vec![None::<Streams>; scene.meshes.len()], rules.keep);
        let kept = Streams {
            normals: keep.has(OptionalPart::Normals),
            uvs: keep.has(OptionalPart::Uvs),
            tangents: keep.has(OptionalPart::Tangents),
            second_uvs: keep.has(OptionalPart::SecondUvs),
            colors: keep.has(OptionalPart::VertexColors),
        };
        let mut sorted_width = None;
        let mut deforms = DeformPlan::default();
        let mut deformed = vec![false; scene.meshes.len()];
        let needed = scene.objects.iter().enumerate().filter(|(_, object)| rules.needs_mesh(scene, object));
        for (index, object) in needed {
            if scene.deforms(object) {
                deforms.push(scene, index, streams_of(rules, object).union(kept));
                deformed[object.mesh] = true;
            } else {
                let own = streams[object.mesh].get_or_insert_default();
                *own = own.union(streams_of(rules, object));
            }
            if rules.sorts(scene, object) {
                sorted_width = sorted_width.max(Some(IndexWidth::of(scene.meshes[object.mesh].positions.len(), keep)));
            }
        }
        if keep.has(OptionalPart::UnusedMeshes) {
            let unused = streams.iter_mut().zip(&deformed).filter(|(own, deformed)| own.is_none() && !**deformed);
            unused.for_each(|(own, _)| *own = Some(Streams::default()));
        }
        let mut order: Vec<(usize, Streams)> =
            streams.iter().enumerate().filter_map(|(mesh, own)| own.map(|own| (mesh, own.union(kept)))).collect();
        // Stable: alike ones keep the scene's order.
        order.sort_by_key(|(_, own)| {
            std::cmp::Reverse((own.colors, own.second_uvs, own.tangents, own.uvs, own.normals))
        });
        let levels = levels_of(scene, rules);
        let numbered = numbered(scene, rules, &order, &levels);
        let mut planned = Self { sorted_width, deforms, numbered: rules.looked_up, ..Self::default() };
        for (place, &(mesh, own)) in order.iter().enumerate() {
            let data = &scene.meshes[mesh];
            let vertices = numbered.get(place).map_or(data.positions.len(), |numbered| numbered.sources.len());
            planned.push((mesh, data), vertices, own, keep);
        }
        // Deformed objects share their mesh's indices; their vertices are stored separately.
        for mesh in (0..scene.meshes.len()).filter(|&mesh| deformed[mesh] && streams[mesh].is_none()) {
            let data = &scene.meshes[mesh];
            planned.push_indices((mesh, data), (None, data.positions.len()), Streams::default(), keep);
        }
        planned.add_levels(&levels, &numbered);
        planned
    }

    /// Appends the levels behind the indices of all meshes.
    fn add_levels(&mut self, levels: &[Arc<[Level]>], numbered: &[NumberedMesh]) {
        for (place, planned) in self.meshes.iter_mut().enumerate() {
            let Some(levels) = levels.get(planned.mesh) else { continue };
            let begin = |level: usize| numbered.get(place).map_or(0, |numbered| numbered.levels[level].begin);
            let indices = match planned.width {
                IndexWidth::Bits16 => &mut self.indices_16,
                IndexWidth::Bits32 => &mut self.indices_32,
            };
            for (number, level) in levels.iter().enumerate() {
                let (first_index, index_count) = (*indices as u32, level.indices.len() as u32);
                let begin = begin(number);
                planned.levels.push(PlannedLevel { first_index, index_count, begin, error: level.error });
                *indices += u64::from(index_count);
            }
        }
    }

    /// Returns true if some mesh has levels of detail.
    pub fn has_levels(&self) -> bool {
        self.meshes.iter().any(|mesh| !mesh.levels.is_empty())
    }

    /// Bytes of the indices of all levels of detail.
    pub fn level_bytes(&self) -> u64 {
        let bytes = |mesh: &PlannedMesh| {
            mesh.levels.iter().map(|level| u64::from(level.index_count)).sum::<u64>() * mesh.width.bytes()
        };
        self.meshes.iter().map(bytes).sum()
    }

    fn push(&mut self, mesh: (usize, &Mesh), vertices: usize, streams: Streams, keep: Keep) {
        self.vertices = first_vertex(self.vertices, mesh.1);
        self.push_indices(mesh, (Some(self.vertices as u32), vertices), streams, keep);
        self.vertices += vertices as u64;
        for (needed, end) in [
            (streams.normals, &mut self.normals),
            (streams.uvs, &mut self.uvs),
            (streams.tangents, &mut self.tangents),
            (streams.second_uvs, &mut self.second_uvs),
            (streams.colors, &mut self.colors),
        ] {
            if needed {
                *end = self.vertices;
            }
        }
    }

    fn push_indices(
        &mut self,
        (mesh, data): (usize, &Mesh),
        (first_vertex, vertices): (Option<u32>, usize),
        streams: Streams,
        keep: Keep,
    ) {
        let width = IndexWidth::of(vertices, keep);
        let indices = match width {
            IndexWidth::Bits16 => &mut self.indices_16,
            IndexWidth::Bits32 => &mut self.indices_32,
        };
        let index_count = data.indices.len() as u32;
        let first_index = *indices as u32;
        *indices += u64::from(index_count);
        let (vertices, levels) = (vertices as u32, Vec::new());
        let own = PlannedMesh { mesh, first_vertex, vertices, first_index, index_count, width, streams, levels };
        self.meshes.push(own);
    }

    /// The streams that some mesh has.
    pub fn streams(&self) -> Streams {
        let own = Streams {
            normals: self.normals > 0,
            uvs: self.uvs > 0,
            tangents: self.tangents > 0,
            second_uvs: self.second_uvs > 0,
            colors: self.colors > 0,
        };
        own.union(self.deforms.streams)
    }

    /// Bytes of a vertex with a position and these streams.
    pub(super) fn stride(streams: Streams) -> u64 {
        let count = |present: [bool; 2]| present.into_iter().map(u64::from).sum::<u64>();
        12 * (1 + u64::from(streams.normals))
            + 8 * count([streams.uvs, streams.second_uvs])
            + 16 * count([streams.tangents, streams.colors])
    }

    /// Bytes of both index buffers.
    pub fn index_bytes(&self) -> u64 {
        2 * self.indices_16 + 4 * self.indices_32
    }

    /// Bytes of all vertex and index buffers.
    pub fn bytes(&self) -> u64 {
        let [threes, twos, fours] =
            [self.vertices + self.normals, self.uvs + self.second_uvs, self.tangents + self.colors];
        12 * threes + 8 * twos + 16 * fours + self.deforms.vertex_bytes() + self.index_bytes()
    }
}

/// The first vertex of a mesh behind `others` vertices. Strokes begin at a multiple of a stroke's vertices, so that shaders derive a vertex's corner
/// from its number.
pub(super) fn first_vertex(others: u64, mesh: &Mesh) -> u64 {
    if mesh.is_strokes { others.next_multiple_of(STROKE_VERTICES as u64) } else { others }
}

/// The levels of detail to be drawn, by mesh; empty if levels are off. Transparent meshes are drawn whole, because their triangles are sorted.
/// Deformed meshes are drawn whole, because a level's error holds for the mesh at rest.
fn levels_of(scene: &Scene, rules: &SurfaceRules) -> Vec<Arc<[Level]>> {
    if rules.lod <= 0.0 {
        return Vec::new();
    }
    let mut drawn = vec![false; scene.meshes.len()];
    for object in scene.objects.iter().filter(|object| rules.needs_mesh(scene, object)) {
        drawn[object.mesh] |= !rules.material(object).is_transparent() && !scene.deforms(object);
    }
    let levels = |(mesh, drawn): (&Mesh, bool)| if drawn { mesh.levels_of_detail() } else { Arc::default() };
    scene.meshes.par_iter().zip(drawn).map(levels).collect()
}

/// The meshes in this order, where triangles are told by their vertices; none where they are not.
fn numbered(
    scene: &Scene,
    rules: &SurfaceRules,
    order: &[(usize, Streams)],
    levels: &[Arc<[Level]>],
) -> Vec<NumberedMesh> {
    let own = |&(mesh, _): &(usize, Streams)| {
        NumberedMesh::of(&scene.meshes[mesh], levels.get(mesh).map_or(0, |levels| levels.len()))
    };
    if rules.looked_up { order.par_iter().map(own).collect() } else { Vec::new() }
}

/// The streams that pipelines read of an object's mesh.
fn streams_of(rules: &SurfaceRules, object: &Object) -> Streams {
    let of_shadow = rules.cuts_of(object).map_or_else(Streams::default, |cuts| Streams {
        uvs: cuts.texture.is_some(),
        second_uvs: cuts.extras.second_uvs,
        colors: cuts.extras.colors,
        ..Streams::default()
    });
    if !rules.has_geometry() {
        return of_shadow;
    }
    let key = GeometryKey::of(object, rules);
    of_shadow.union(Streams {
        normals: rules.has_gbuffer() || key.forward.is_some(),
        uvs: !key.textures.is_empty(),
        tangents: key.textures.contains(TextureSlot::Normal),
        second_uvs: key.extras.second_uvs,
        colors: key.extras.colors,
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use glam::DVec3;

    use super::*;
    use crate::plan::samples::{self, keeping, plan};
    use crate::scene::{Brdf, CastsShadow, Material, Settings, View};

    /// A mesh with one triangle; its other vertices belong to no triangle.
    fn mesh_of(vertices: usize) -> Mesh {
        let points: Vec<_> = (0..vertices).map(|i| DVec3::new((i % 2) as f64, (i % 3) as f64, 0.0)).collect();
        let mut mesh = Mesh::from_points("wide", &points);
        mesh.indices = vec![0, 1, vertices as u32 - 1];
        mesh.normals = vec![[0.0, 0.0, 1.0]; vertices];
        mesh
    }

    /// A mesh for each material; the first has three vertices, each other one more than the last.
    fn distinct(materials: Vec<Material>) -> Scene {
        let mut scene = samples::scene(materials, vec![samples::sky()]);
        scene.meshes = (0..scene.materials.len()).map(|index| mesh_of(3 + index)).collect();
        scene.objects.iter_mut().enumerate().for_each(|(index, object)| object.mesh = index);
        scene
    }

    #[test]
    fn sixteen_bits_number_as_many_vertices_as_they_can() {
        for (vertices, width) in [
            (3, IndexWidth::Bits16),
            (65_535, IndexWidth::Bits16),
            (65_536, IndexWidth::Bits16),
            (65_537, IndexWidth::Bits32),
        ] {
            let mut scene = distinct(vec![Material::default()]);
            scene.meshes = vec![mesh_of(vertices)];
            let meshes = plan(&scene, &samples::deferred()).meshes;
            assert_eq!(meshes.meshes[0].width, width, "{vertices}");
            assert_eq!(meshes.index_bytes(), 3 * width.bytes());
            assert!(width == IndexWidth::Bits32 || scene.meshes[0].indices[2] <= u32::from(u16::MAX));
            let wide = Settings { keep: Keep::NONE.with(OptionalPart::WideIndices), ..samples::deferred() };
            let kept = plan(&scene, &wide).meshes;
            assert_eq!((kept.meshes[0].width, kept.indices_16, kept.indices_32), (IndexWidth::Bits32, 0, 3));
        }
    }

    #[test]
    fn buffers_hold_each_mesh_from_its_place_on() {
        let mut scene = distinct(vec![Material::default(); 4]);
        scene.meshes[1] = mesh_of(70_000);
        scene.meshes[3] = mesh_of(70_001);
        let meshes = plan(&scene, &samples::deferred()).meshes;
        let places: Vec<_> = meshes
            .meshes
            .iter()
            .map(|mesh| (mesh.mesh, mesh.first_vertex.expect("drawn as it is"), mesh.first_index))
            .collect();
        assert_eq!(places, [(0, 0, 0), (1, 3, 0), (2, 70_003, 3), (3, 70_008, 3)]);
        assert_eq!((meshes.indices_16, meshes.indices_32), (6, 6));
    }

    #[test]
    fn meshes_whose_triangles_are_numbered_have_the_vertices_that_this_takes() {
        // Three of the many vertices belong to the triangle; of a square's four, two begin none.
        let mut scene = distinct(vec![Material::default(); 2]);
        scene.meshes[1] = mesh_of(70_000);
        let square = samples::scene(vec![Material::default()], vec![samples::sky()]);
        let looked_up = Settings { light_path: crate::scene::LightPath::Visibility, ..Settings::default() };
        for (scene, numbered, not) in [(&scene, vec![3, 3], vec![3, 70_000]), (&square, vec![4], vec![4])] {
            let of = |settings: &Settings| {
                let meshes = plan(scene, settings).meshes;
                let own: Vec<u32> = meshes.meshes.iter().map(|mesh| mesh.vertices).collect();
                assert_eq!(u64::from(own.iter().sum::<u32>()), meshes.vertices);
                (meshes.numbered, own)
            };
            assert_eq!((of(&looked_up), of(&samples::deferred())), ((true, numbered), (false, not)));
        }
    }

    #[test]
    fn meshes_that_nothing_draws_or_casts_are_left_out() {
        let cut_away = Material { alpha: 0.1, ..Material { base_color_texture: None, ..samples::masked() } };
        let mut scene = distinct(vec![Material::default(), cut_away, samples::glass(), Material::default()]);
        scene.objects.truncate(3);
        let of = |settings: &Settings| {
            let meshes = plan(&scene, settings).meshes.meshes;
            meshes.iter().map(|mesh| mesh.mesh).collect::<BTreeSet<_>>().into_iter().collect::<Vec<_>>()
        };
        assert_eq!(of(&Settings::default()), [0, 2], "the second is cut away, the fourth has no object");
        // A view that shows no transparent surfaces needs no mesh of them.
        assert_eq!(of(&Settings { view: View::Normal, ..Settings::default() }), [0]);
        assert_eq!(of(&keeping(&[OptionalPart::UnusedMeshes])), [0, 1, 2, 3]);
        // The view of the maps draws casters alone.
        scene.lights = vec![samples::sun()];
        scene.objects.push(Object::new("floor", 3, 3, Default::default()));
        scene.objects[0].casts_shadow = CastsShadow::No;
        let maps = Settings { view: View::ShadowMap, ..Settings::default() };
        let meshes = plan(&scene, &maps).meshes;
        assert_eq!(meshes.meshes.iter().map(|mesh| mesh.mesh).collect::<Vec<_>>(), [3]);
        assert_eq!(meshes.streams(), Streams::default());
    }

    #[test]
    fn each_stream_ends_with_the_last_mesh_that_needs_it() {
        let mapped = Material { normal_texture: Some(0), ..Material::default() };
        let colored = Material { base_color_texture: Some(0), ..Material::default() };
        let mut scene = distinct(vec![Material::default(), colored, mapped, Material::default()]);
        samples::add_textures(&mut scene);
        let meshes = plan(&scene, &samples::deferred()).meshes;
        // 5 vertices with tangents, 4 with UVs alone, 3 and 6 with neither.
        assert_eq!(meshes.meshes.iter().map(|mesh| mesh.mesh).collect::<Vec<_>>(), [2, 1, 0, 3]);
        assert_eq!((meshes.vertices, meshes.normals, meshes.uvs, meshes.tangents), (18, 18, 9, 5));
        assert_eq!(meshes.bytes(), 18 * 24 + 9 * 8 + 5 * 16 + 4 * 3 * 2);
        for (part, expected) in [(OptionalPart::Tangents, (9, 18)), (OptionalPart::Uvs, (18, 5))] {
            let kept = Settings { keep: Keep::NONE.with(part), ..samples::deferred() };
            let kept = plan(&scene, &kept).meshes;
            // A stream that is kept is whole; the others end as early as they can.
            assert_eq!((kept.uvs, kept.tangents), expected, "{part}");
        }
        let counted = plan(&scene, &Settings { view: View::Overdraw, ..Settings::default() }).meshes;
        assert_eq!(counted.streams(), Streams::default(), "fragments are counted by their positions");
        let kept = Settings { view: View::Overdraw, ..keeping(&[OptionalPart::Normals]) };
        assert_eq!(plan(&scene, &kept).meshes.normals, 18);
    }

    #[test]
    fn what_is_masked_in_a_shadow_map_alone_still_has_uvs() {
        let mut scene = samples::scene(vec![samples::masked()], vec![samples::sun()]);
        let maps = Settings { view: View::ShadowMap, ..Settings::default() };
        assert_eq!(plan(&scene, &maps).meshes.streams(), Streams { uvs: true, ..Streams::default() });
        scene.objects[0].casts_shadow = CastsShadow::No;
        scene.objects.push(Object::new("pane", 0, 0, Default::default()));
        scene.materials.push(samples::material(Brdf::Lambert));
        scene.objects[1].material = 1;
        assert_eq!(plan(&scene, &maps).meshes.streams(), Streams::default(), "it casts no shadow");
    }

    #[test]
    fn sorted_indices_are_as_wide_as_the_largest_transparent_mesh_needs() {
        let mut scene = distinct(vec![Material::default(), samples::glass(), samples::glass()]);
        let width = |scene: &Scene, settings: &Settings| plan(scene, settings).meshes.sorted_width;
        let lean = Settings::default();
        scene.meshes[0] = mesh_of(70_000);
        assert_eq!(width(&scene, &lean), Some(IndexWidth::Bits16), "what is opaque is not sorted");
        scene.meshes[2] = mesh_of(70_000);
        assert_eq!(width(&scene, &lean), Some(IndexWidth::Bits32));
        let oit = Settings { transparency: crate::scene::Transparency::Oit, ..Settings::default() };
        assert_eq!(width(&scene, &oit), None);
    }

    #[test]
    fn strokes_begin_at_a_multiple_of_their_vertices_and_face_the_camera() {
        let two_sided = Material { two_sided: true, ..Material::default() };
        let mut scene = distinct(vec![Material::default(), two_sided]);
        scene.meshes[1] = Mesh::of_strokes("strokes", &[[DVec3::ZERO, DVec3::X]]);
        scene.objects[1].transform = glam::DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        let planned = |scene: &Scene| plan(scene, &Settings::default());
        let plan = planned(&scene);
        let own = plan.meshes.meshes.iter().find(|own| own.mesh == 1).expect("the strokes");
        assert_eq!((own.first_vertex, plan.meshes.vertices), (Some(6), 12));
        let keys: Vec<_> = plan.geometry.iter().filter(|key| key.extras.strokes).collect();
        let [key] = keys[..] else { panic!("{keys:?}") };
        assert!(key.has_extras() && !key.two_sided && !key.mirrored && !key.is_in_prepass());
        // A scene without strokes has no pipeline with their code.
        scene.objects.truncate(1);
        assert!(planned(&scene).keys().all(|key| !key.has_extras()));
    }
}
