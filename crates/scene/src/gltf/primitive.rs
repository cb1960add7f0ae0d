//! Builds a mesh from a primitive, with the attributes that its objects need and no others.

use glam::{DVec2, DVec3, Vec3};

use super::influences;
use super::json::Mesh as JsonMesh;
use super::shapes;
use super::source::PrimitiveSource;
use super::topology::Topology;
use crate::mesh::{STROKE_ENDS, STROKE_VERTICES, stroke_indices, triangle_normal};
use crate::motion::deform;
use crate::{Aabb, Influences, Mesh, Morph, uvs};

/// A mesh is recentred if its centre is more than this multiple of its radius away from the origin: offsets that are added to its positions would
/// lose digits in f32.
const FAR: f64 = 16.0;
/// Stands in for missing normals.
const UP: [f32; 3] = [0.0, 1.0, 0.0];

/// The attributes that objects need of a primitive's mesh.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub(super) struct Needs {
    /// The sets of texture coordinates that become the mesh's first and second.
    pub uv_sets: [Option<usize>; 2],
    /// True for each set of coordinates from which whole repeats may be taken off.
    pub repeats: [bool; 2],
    /// True if its material uses tangents.
    pub tangents: bool,
    /// True if its material is anisotropic.
    pub anisotropic: bool,
    /// The number of joints of the skin that moves it.
    pub joints: Option<usize>,
    pub shapes: Shapes,
    /// The skin that deforms it, if nothing moves the skin: the mesh is then made in that pose.
    pub posed: Option<usize>,
}

/// The form in which a mesh takes over its primitive's morph targets.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub(super) enum Shapes {
    #[default]
    None,
    /// Kept as shapes, since a clip moves their weights.
    Kept,
    /// Blended into the mesh with these constant weights, as bits of f64.
    Fixed(Vec<u64>),
}

/// The name of a primitive in messages, and the parts that its mesh is made of.
pub(super) struct PrimitiveInput<'a> {
    pub name: &'a str,
    pub mesh: &'a JsonMesh,
    pub source: PrimitiveSource<'a>,
    pub needs: &'a Needs,
    /// The transform of each joint from mesh space to the object's space, for the skin in `needs.posed`.
    pub pose: &'a [glam::DAffine3],
}

/// A mesh, and warnings about its data.
pub(super) struct PrimitiveMesh {
    /// `None` if the primitive has no triangle, line or point.
    pub mesh: Option<Mesh>,
    pub warnings: Vec<String>,
}

impl PrimitiveInput<'_> {
    /// Makes the mesh. Attributes that cannot be read are left out, and so are triangles and lines with invalid corners.
    ///
    /// # Errors
    /// Data of which nothing can be drawn.
    pub fn build(&self) -> Result<PrimitiveMesh, String> {
        let mut warnings = Vec::new();
        let positions = self.source.floats::<3>("POSITION", &["VEC3"], 0.0)?.ok_or("has no POSITION")?;
        let topology = Topology::of(self.source.mode())?;
        let (indices, odd) = topology.corners(self.source.indices()?, positions.len())?;
        warnings.extend(odd);
        // Points and lines have two indices each until `opened`.
        let is_strokes = topology.is_strokes();
        let mut mesh = Mesh { name: self.name.into(), positions, indices, is_strokes, ..Mesh::default() };
        leave_out_infinite(&mut mesh, &mut warnings)?;
        if mesh.indices.is_empty() {
            warnings.extend(self.source.take_warnings());
            return Ok(PrimitiveMesh { mesh: None, warnings });
        }
        self.texture_coordinates(&mut mesh, &mut warnings);
        self.colors(&mut mesh, &mut warnings);
        self.normals(&mut mesh, &mut warnings);
        if let Some(joints) = self.needs.joints {
            mesh.influences = Some(influences::read(&self.source, mesh.positions.len(), joints, &mut warnings));
        }
        if self.needs.shapes != Shapes::None {
            mesh.morphs = shapes::read(&self.source, self.mesh, &mesh, self.needs.uv_sets[0], &mut warnings);
        }
        if is_strokes {
            mesh = opened(mesh);
        } else if mesh.normals.is_empty() {
            mesh = flat(mesh);
        }
        self.finish(&mut mesh);
        warnings.extend(self.source.take_warnings());
        Ok(PrimitiveMesh { mesh: (!mesh.indices.is_empty()).then_some(mesh), warnings })
    }

    /// Deforms the parts that nothing moves, and makes the data that follow from positions.
    fn finish(&self, mesh: &mut Mesh) {
        let weights: Vec<f64> = match &self.needs.shapes {
            Shapes::Fixed(weights) => weights.iter().map(|&bits| f64::from_bits(bits)).collect(),
            Shapes::None | Shapes::Kept => Vec::new(),
        };
        if !weights.is_empty() || self.needs.posed.is_some() {
            // Moving joints are applied after the shapes are blended in.
            let influences = mesh.influences.take_if(|_| self.needs.posed.is_none());
            *mesh = Mesh { influences, ..deform(mesh, &weights, self.needs.posed.map(|_| self.pose)) };
        } else {
            recentre(mesh);
        }
        // A triangle without area may get one when the mesh deforms.
        if mesh.morphs.is_empty() && mesh.influences.is_none() {
            mesh.remove_degenerate_triangles();
        }
        if self.needs.tangents && mesh.tangents.is_empty() && !mesh.is_strokes {
            mesh.compute_tangents();
        }
        mesh.bounds = mesh.compute_bounds();
    }

    fn texture_coordinates(&self, mesh: &mut Mesh, warnings: &mut Vec<String>) {
        let mut sets: [Vec<[f32; 2]>; 2] = Default::default();
        for ((set, list), repeats) in self.needs.uv_sets.iter().zip(&mut sets).zip(self.needs.repeats) {
            let Some(set) = set else { continue };
            let semantic = format!("TEXCOORD_{set}");
            let Some(mut found) = self.optional::<2>(&semantic, &["VEC2"], 0.0, mesh, warnings) else {
                warnings.push(
                    "texture coordinates that its material uses are missing, so that its textures show one texel"
                        .into(),
                );
                continue;
            };
            mend(&mut found, [0.0; 2], "texture coordinates are not finite, taken for 0", warnings);
            *list = if repeats && !mesh.is_strokes { near(found, &mesh.indices) } else { found };
        }
        let [first, second] = sets;
        (mesh.uvs, mesh.uvs_1) = (first, second);
        if mesh.uvs.is_empty() && (!mesh.uvs_1.is_empty() || self.needs.uv_sets[0].is_some()) {
            mesh.uvs = vec![[0.0; 2]; mesh.positions.len()];
        }
        if mesh.uvs_1.is_empty() && self.needs.uv_sets[1].is_some() {
            mesh.uvs_1 = vec![[0.0; 2]; mesh.positions.len()];
        }
    }

    /// Reads an attribute with a value for each vertex. An attribute that cannot be read, or has fewer values, is left out.
    fn optional<const N: usize>(
        &self,
        semantic: &str,
        kinds: &[&str],
        missing: f32,
        mesh: &Mesh,
        warnings: &mut Vec<String>,
    ) -> Option<Vec<[f32; N]>> {
        let read = self.source.floats::<N>(semantic, kinds, missing);
        of_each(semantic, read, mesh.positions.len(), warnings)
    }

    fn colors(&self, mesh: &mut Mesh, warnings: &mut Vec<String>) {
        let found = self.optional::<4>("COLOR_0", &["VEC3", "VEC4"], 1.0, mesh, warnings);
        let Some(mut colors) = found else { return };
        mend(&mut colors, [1.0; 4], "vertex colours are not finite, taken for white", warnings);
        if colors.as_flattened().iter().any(|channel| !(0.0..=1.0).contains(channel)) {
            warnings.push("vertex colours are not from 0 to 1, taken for the nearest".into());
            colors.as_flattened_mut().iter_mut().for_each(|channel| *channel = channel.clamp(0.0, 1.0));
        }
        let is_white = colors.iter().all(|color| *color == [1.0; 4]);
        // Shapes may change the colours.
        if !is_white || self.needs.shapes == Shapes::Kept {
            mesh.colors = colors;
        }
    }

    /// Reads normals, and the tangents that belong to them. Without normals tangents are ignored (glTF 2.0, "Meshes").
    fn normals(&self, mesh: &mut Mesh, warnings: &mut Vec<String>) {
        let found = self.optional::<3>("NORMAL", &["VEC3"], 0.0, mesh, warnings);
        let Some(mut normals) = found else { return };
        let unit = |normal: &[f32; 3]| Vec3::from(*normal).as_dvec3().try_normalize();
        let mut is_bad = false;
        for normal in &mut normals {
            let length = Vec3::from(*normal).length_squared();
            // Nearly all vectors have unit length already, and stay unchanged to the last bit.
            if (length - 1.0).abs() > 1e-6 || length.is_nan() {
                match unit(normal) {
                    Some(found) => *normal = found.as_vec3().to_array(),
                    None => (*normal, is_bad) = ([f32::NAN; 3], true),
                }
            }
        }
        mesh.normals = normals;
        if is_bad {
            let instead = if mesh.is_strokes { "taken for +Y" } else { "made from the triangles around" };
            warnings.push(format!("normals have no length or are not finite, {instead}"));
            let given = std::mem::take(&mut mesh.normals);
            if mesh.is_strokes {
                mesh.normals = vec![UP; given.len()];
            } else {
                mesh.compute_normals();
            }
            for (normal, given) in mesh.normals.iter_mut().zip(given) {
                *normal = if given[0].is_nan() { *normal } else { given };
            }
        }
        if self.needs.tangents {
            self.tangents(mesh, warnings);
        }
        // Tangents are computed from triangles' texture coordinates.
        let makes_tangents = self.needs.uv_sets[0].is_some() && !mesh.is_strokes;
        let has_tangents = !mesh.tangents.is_empty() || makes_tangents;
        if self.needs.anisotropic && !has_tangents {
            warnings.push(
                "its material is anisotropic, and it has neither tangents nor a texture to make them of: drawn as rough in each direction".into(),
            );
        }
    }

    fn tangents(&self, mesh: &mut Mesh, warnings: &mut Vec<String>) {
        let found = self.optional::<4>("TANGENT", &["VEC4"], 1.0, mesh, warnings);
        let Some(mut tangents) = found else { return };
        for (tangent, normal) in tangents.iter_mut().zip(&mesh.normals) {
            let [x, y, z, sign] = *tangent;
            let along = Vec3::new(x, y, z).as_dvec3().try_normalize();
            let spans = along.filter(|along| along.cross(Vec3::from(*normal).as_dvec3()).length_squared() > 1e-6);
            let (Some(along), true) = (spans, sign.abs() > 0.0 && sign.is_finite()) else {
                warnings.push("tangents have no length or lie along their normals, made by MikkTSpace".into());
                return;
            };
            // Nearly all tangents have unit length already, and stay unchanged to the last bit.
            let is_unit = (Vec3::new(x, y, z).length_squared() - 1.0).abs() <= 1e-6;
            let [x, y, z] = if is_unit { [x, y, z] } else { along.as_vec3().to_array() };
            *tangent = [x, y, z, sign.signum()];
        }
        mesh.tangents = tangents;
    }
}

/// Replaces values that are not finite by `instead`.
fn mend<const N: usize>(values: &mut [[f32; N]], instead: [f32; N], warning: &str, warnings: &mut Vec<String>) {
    let bad = values.iter_mut().filter(|value| !value.iter().all(|number| number.is_finite()));
    if bad.map(|value| *value = instead).count() > 0 {
        warnings.push(warning.into());
    }
}

/// The values of an attribute, one for each vertex. Surplus values are cut off; an attribute with too few values is left out. A warning says so.
pub(super) fn of_each<T>(
    semantic: &str,
    read: Result<Option<Vec<T>>, String>,
    vertices: usize,
    warnings: &mut Vec<String>,
) -> Option<Vec<T>> {
    let mut found = match read {
        Ok(found) => found?,
        Err(why) => {
            warnings.push(format!("{why}: left out"));
            return None;
        }
    };
    let count = found.len();
    let words = format!("{semantic} has {count} elements, but POSITION has {vertices}");
    if count < vertices {
        warnings.push(format!("{words}: left out"));
        return None;
    }
    if count > vertices {
        warnings.push(format!("{words}: the first are read"));
        found.truncate(vertices);
    }
    Some(found)
}

/// Leaves out triangles, lines and points with a corner whose position is not finite.
fn leave_out_infinite(mesh: &mut Mesh, warnings: &mut Vec<String>) -> Result<(), String> {
    let is_finite = |position: &[f32; 3]| position.iter().all(|number| number.is_finite());
    let Some(vertex) = mesh.positions.iter().position(|position| !is_finite(position)) else { return Ok(()) };
    let what = format!("the POSITION of vertex {vertex} is not finite");
    // The replacement lies within the box of the other positions, and no triangle uses it.
    let instead = mesh.positions.iter().copied().find(is_finite).ok_or_else(|| what.clone())?;
    let corners = if mesh.is_strokes { 2 } else { 3 };
    let kept = mesh.indices.chunks_exact(corners);
    let kept = kept.filter(|corners| corners.iter().all(|&corner| is_finite(&mesh.positions[corner as usize])));
    mesh.indices = kept.flatten().copied().collect();
    mesh.positions.iter_mut().filter(|position| !is_finite(position)).for_each(|position| *position = instead);
    let left_out = if mesh.is_strokes { "points and lines" } else { "triangles" };
    warnings.push(format!("{what}: {left_out} with such corners are left out"));
    Ok(())
}

/// Removes whole repeats from texture coordinates that are far from zero.
fn near(found: Vec<[f32; 2]>, indices: &[u32]) -> Vec<[f32; 2]> {
    if found.iter().flatten().all(|number| number.abs() <= 16.0) {
        return found;
    }
    let wide: Vec<DVec2> = found.iter().map(|&[u, v]| DVec2::new(u.into(), v.into())).collect();
    uvs::wrapped(&wide, indices)
}

/// Makes positions far from the origin relative to a point near them. The point's coordinates are f32, so that most differences are exact.
fn recentre(mesh: &mut Mesh) {
    let bounds = Aabb::of_points(mesh.positions.iter().map(|&position| Vec3::from(position).as_dvec3()));
    if bounds.is_empty() || bounds.center().abs().max_element() <= FAR * bounds.radius() {
        return;
    }
    mesh.origin = bounds.center().as_vec3().as_dvec3();
    for position in &mut mesh.positions {
        *position = (Vec3::from(*position).as_dvec3() - mesh.origin).as_vec3().to_array();
    }
}

/// Gives a mesh without normals the normals of its triangles. Each triangle gets separate vertices.
fn flat(mesh: Mesh) -> Mesh {
    let mut flat = unshared(&mesh, &mesh.indices);
    flat.indices = (0..mesh.indices.len() as u32).collect();
    flat.normals = face_normals(&flat.positions, &[]);
    for morph in &mut flat.morphs {
        // The normals of a shape's own triangles, as differences from the mesh's (glTF 2.0, "Morph Targets").
        let moved = face_normals(&flat.positions, &morph.positions);
        let more = moved.iter().zip(&flat.normals).map(|(&a, &b)| (Vec3::from(a) - Vec3::from(b)).to_array());
        morph.normals = if morph.positions.is_empty() { Vec::new() } else { more.collect() };
        morph.tangents.clear();
    }
    flat
}

/// Makes strokes of points and lines with two indices each. Primitives without normals are unlit, so they get an arbitrary normal.
fn opened(mesh: Mesh) -> Mesh {
    let ends = mesh.indices.as_chunks::<2>().0;
    let vertices: Vec<u32> = ends.iter().flat_map(|own| STROKE_ENDS.map(|end| own[end])).collect();
    let mut strokes = unshared(&mesh, &vertices);
    strokes.is_strokes = true;
    strokes.indices = stroke_indices(vertices.len() / STROKE_VERTICES).collect();
    if strokes.normals.is_empty() {
        strokes.normals = vec![UP; vertices.len()];
        strokes.morphs.iter_mut().for_each(|morph| morph.normals.clear());
    }
    strokes
}

/// Copies these vertices of a mesh, in their order, without indices.
fn unshared(mesh: &Mesh, vertices: &[u32]) -> Mesh {
    let own = |list: &[[f32; 3]]| again(list, vertices);
    let morph = |morph: &Morph| Morph {
        name: morph.name.clone(),
        positions: own(&morph.positions),
        normals: own(&morph.normals),
        tangents: own(&morph.tangents),
        uvs: again(&morph.uvs, vertices),
        colors: again(&morph.colors, vertices),
    };
    Mesh {
        name: mesh.name.clone(),
        positions: own(&mesh.positions),
        normals: own(&mesh.normals),
        uvs: again(&mesh.uvs, vertices),
        tangents: again(&mesh.tangents, vertices),
        uvs_1: again(&mesh.uvs_1, vertices),
        colors: again(&mesh.colors, vertices),
        influences: mesh.influences.as_ref().map(|influences| unshared_influences(influences, vertices)),
        morphs: mesh.morphs.iter().map(morph).collect(),
        ..Mesh::default()
    }
}

/// The values at the corners, one after the other; empty for an absent attribute.
fn again<T: Copy>(values: &[T], indices: &[u32]) -> Vec<T> {
    if values.is_empty() { Vec::new() } else { indices.iter().map(|&index| values[index as usize]).collect() }
}

fn unshared_influences(influences: &Influences, indices: &[u32]) -> Influences {
    let per_vertex = influences.per_vertex;
    let own = |index: &u32| *index as usize * per_vertex..(*index as usize + 1) * per_vertex;
    Influences {
        per_vertex,
        joints: indices.iter().flat_map(|index| influences.joints[own(index)].iter().copied()).collect(),
        weights: indices.iter().flat_map(|index| influences.weights[own(index)].iter().copied()).collect(),
    }
}

/// Returns the normal of each corner's triangle. Each three consecutive corners form a triangle. `more`, unless empty, holds an offset for each
/// corner.
fn face_normals(corners: &[[f32; 3]], more: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let place = |at: usize| {
        let more = more.get(at).map_or(DVec3::ZERO, |&more| Vec3::from(more).as_dvec3());
        Vec3::from(corners[at]).as_dvec3() + more
    };
    let normal = |face: usize| {
        let points = [0, 1, 2].map(|corner| place(face * 3 + corner));
        triangle_normal(&points).unwrap_or(DVec3::Y).as_vec3().to_array()
    };
    (0..corners.len() / 3).flat_map(|face| [normal(face); 3]).collect()
}
