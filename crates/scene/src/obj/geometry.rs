//! Makes meshes of tobj's objects: cuts polygons, makes missing normals, joins parts that are alike, and splits off faces that lie back to back.

use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::normals::{Faces, corner_normals};
use super::polygon::{newell_normal, triangulate};
use super::scan::{FaceKey, Scan};
use super::sheets;
use crate::mesh::triangle_normal;
use crate::texture::srgb_decode;
use crate::uvs::wrapped;
use crate::{Error, LoadOptions, Mesh};

/// A mesh, with the indices of its group and its material in the scan's tables.
pub(super) struct GroupMesh {
    pub group: usize,
    pub material: usize,
    pub mesh: Mesh,
    /// True if its normals are the file's.
    pub has_own_normals: bool,
    /// True if its faces lie back to back with others.
    pub is_sheet: bool,
}

/// All meshes, with the faults that were found.
#[derive(Default)]
pub(super) struct ObjGeometry {
    pub groups: Vec<GroupMesh>,
    /// Triangles without area, which are left out.
    pub degenerate: usize,
    /// Polygons that are fans because cutting took too long: the index of each one's part, and its number of corners.
    pub fans: Vec<(usize, usize)>,
}

/// The attributes that a material needs of its meshes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MaterialNeeds {
    pub tangents: bool,
    /// Scale and offset of texture coordinates, before V is turned over.
    pub uv_scale: DVec2,
    pub uv_offset: DVec2,
    /// A map ends at its edges (`-clamp on`).
    pub is_clamped: bool,
}

impl Default for MaterialNeeds {
    fn default() -> Self {
        Self { tangents: false, uv_scale: DVec2::ONE, uv_offset: DVec2::ZERO, is_clamped: false }
    }
}

/// Reads the scanned text with tobj.
///
/// # Errors
/// `Error::Content` if tobj refuses a text that the scan accepted.
pub(super) fn parse(path: &Path, text: &str) -> Result<Vec<tobj::Mesh>, Error> {
    let options = tobj::LoadOptions { single_index: true, ..tobj::LoadOptions::default() };
    let parsed = tobj::load_obj_buf(&mut text.as_bytes(), &options, |_| Ok(Default::default()));
    let (models, _) = parsed.map_err(|cause| Error::Content {
        path: path.to_owned(),
        line: None,
        what: format!("cannot be parsed: {cause}"),
    })?;
    Ok(models.into_iter().map(|model| model.mesh).collect())
}

/// Makes meshes, one for each group and material, and another one for faces that lie back to back. `needs` is indexed by material.
pub(super) fn build(
    scan: &Scan,
    mut parsed: Vec<tobj::Mesh>,
    needs: &[MaterialNeeds],
    options: &LoadOptions,
) -> ObjGeometry {
    // If the file gives all normals, nearly all materials are one-sided.
    let backed = match scan.parts.iter().all(|part| part.has_normals) {
        true => HashSet::new(),
        false => sheets::backed(&parsed),
    };
    let taken: Vec<Option<tobj::Mesh>> = match backed.is_empty() {
        true => Vec::new(),
        false => parsed.iter_mut().map(|mesh| sheets::take(mesh, &backed)).collect(),
    };
    let whole = parsed.into_iter().enumerate().map(|(index, mesh)| (index, false, mesh));
    let taken = taken.into_iter().enumerate().filter_map(|(index, mesh)| Some((index, true, mesh?)));
    let mut places = HashMap::new();
    let mut joined: Vec<Vec<(usize, bool, tobj::Mesh)>> = Vec::new();
    for (index, is_sheet, mesh) in whole.chain(taken) {
        let Some(&FaceKey { group, material, .. }) = scan.parts.get(index) else { continue };
        let place = *places.entry((group, material, is_sheet)).or_insert_with(|| {
            joined.push(Vec::new());
            joined.len() - 1
        });
        joined[place].push((index, is_sheet, mesh));
    }
    let (done, total) = (AtomicUsize::new(0), joined.len());
    let finished: Vec<ObjGeometry> = joined
        .into_par_iter()
        .map(|parts| {
            let (first, is_sheet, _) = parts[0];
            let FaceKey { group, material, .. } = scan.parts[first];
            let mut vertices = MeshDraft { is_sheet, ..MeshDraft::default() };
            let mut fans = Vec::new();
            for (index, _, mesh) in parts {
                let own = vertices.append(&scan.parts[index], mesh, &scan.colors);
                fans.extend(own.into_iter().map(|corners| (index, corners)));
            }
            let has_own_normals = !vertices.has_made_normals;
            let (mesh, degenerate) = vertices.into_mesh(&scan.groups[group], &needs[material]);
            options.report("meshes", done.fetch_add(1, Ordering::Relaxed) + 1, total);
            let own = GroupMesh { group, material, mesh, has_own_normals, is_sheet };
            ObjGeometry { groups: vec![own], degenerate, fans }
        })
        .collect();
    let mut all = ObjGeometry::default();
    for ObjGeometry { groups, degenerate, fans } in finished {
        all.groups.extend(groups.into_iter().filter(|group| !group.mesh.indices.is_empty()));
        all.degenerate += degenerate;
        all.fans.extend(fans);
    }
    all
}

/// A mesh in the making, before it is recentred.
#[derive(Default)]
struct MeshDraft {
    points: Vec<DVec3>,
    normals: Vec<DVec3>,
    /// The texture coordinates of the file, with V up. Zero for parts without any.
    uvs: Vec<DVec2>,
    has_uvs: bool,
    has_made_normals: bool,
    /// True if its faces lie back to back.
    is_sheet: bool,
    /// Linear colours; empty if the file has none.
    colors: Vec<[f32; 4]>,
    indices: Vec<u32>,
}

impl MeshDraft {
    /// Adds a part. `colors` holds the colours of the file's vertices, if it has any. Returns the corner counts of polygons that are fans because
    /// cutting took too long.
    fn append(&mut self, part: &FaceKey, mesh: tobj::Mesh, colors: &[[f32; 3]]) -> Vec<usize> {
        let points: Vec<DVec3> = mesh.positions.as_chunks().0.iter().map(|&p| DVec3::from_array(p)).collect();
        let uvs: Vec<DVec2> = match part.has_uvs {
            true => mesh.texcoords.as_chunks().0.iter().map(|&uv| DVec2::from_array(uv)).collect(),
            false => vec![DVec2::ZERO; points.len()],
        };
        self.has_uvs |= part.has_uvs;
        let Triangulation { triangles, normals: face_normals, fans } = triangulation(&points, &mesh);
        // tobj passes the vertices' numbers through as red.
        let numbers = mesh.vertex_color.as_chunks::<3>().0.iter().map(|&[number, ..]| number as usize);
        let own_colors: Vec<[f32; 4]> =
            numbers.filter_map(|number| colors.get(number)).map(|own| linear(*own)).collect();
        let normals = mesh.normals.as_chunks().0.iter().map(|&n| DVec3::from_array(n).normalize_or_zero());
        let normals: Vec<DVec3> = if part.has_normals { normals.collect() } else { Vec::new() };
        // If no normal has a length, the file has no normals.
        if normals.iter().any(|normal| *normal != DVec3::ZERO) {
            let base = self.points.len() as u32;
            self.normals.extend(normals);
            self.colors.extend(own_colors);
            self.points.extend(points);
            self.uvs.extend(uvs);
            self.indices.extend(triangles.as_flattened().iter().map(|index| base + index));
            return fans;
        }
        self.has_made_normals = true;
        let (triangles, is_sheet) = (&triangles, self.is_sheet);
        let faces = Faces { points: &points, triangles, normals: &face_normals, is_sheet };
        let normals = corner_normals(&faces, part.smoothing);
        let mut made = HashMap::with_capacity(points.len());
        for (&vertex, &normal) in triangles.as_flattened().iter().zip(normals.as_flattened()) {
            let index = *made.entry((vertex, normal.as_vec3().to_array().map(f32::to_bits))).or_insert_with(|| {
                self.points.push(points[vertex as usize]);
                self.uvs.push(uvs[vertex as usize]);
                self.colors.extend(own_colors.get(vertex as usize));
                self.normals.push(normal);
                (self.points.len() - 1) as u32
            });
            self.indices.push(index);
        }
        fans
    }

    fn into_mesh(self, name: &str, needs: &MaterialNeeds) -> (Mesh, usize) {
        let mut mesh = Mesh::from_points(name, &self.points);
        mesh.indices = self.indices;
        let degenerate = mesh.remove_degenerate_triangles();
        if self.normals.contains(&DVec3::ZERO) {
            // The file gave a normal of length 0, so the triangles' normals are used.
            mesh.compute_normals();
        } else {
            mesh.normals = vec![[0.0; 3]; self.normals.len()];
        }
        for (out, normal) in mesh.normals.iter_mut().zip(&self.normals).filter(|(_, normal)| **normal != DVec3::ZERO) {
            *out = normal.as_vec3().to_array();
        }
        mesh.colors = self.colors;
        if self.has_uvs {
            let placed = self.uvs.iter().map(|&uv| uv * needs.uv_scale + needs.uv_offset);
            let turned_over: Vec<DVec2> = placed.map(|uv| DVec2::new(uv.x, 1.0 - uv.y)).collect();
            mesh.uvs = match needs.is_clamped {
                // A clamped picture does not repeat: coordinates moved by a whole number would show its edge.
                true => turned_over.iter().map(|uv| uv.as_vec2().to_array()).collect(),
                false => wrapped(&turned_over, &mesh.indices),
            };
            if needs.tangents {
                mesh.compute_tangents();
            }
        }
        (mesh, degenerate)
    }
}

/// An opaque colour, from sRGB.
fn linear(color: [f32; 3]) -> [f32; 4] {
    let [red, green, blue] = color.map(|channel| srgb_decode(f64::from(channel)) as f32);
    [red, green, blue, 1.0]
}

/// A parsed mesh's triangles.
#[derive(Default)]
struct Triangulation {
    triangles: Vec<[u32; 3]>,
    /// The unit normal of each triangle's polygon; zero if the polygon has no area.
    normals: Vec<DVec3>,
    /// The corner count of each polygon that is a fan because cutting took too long.
    fans: Vec<usize>,
}

fn triangulation(points: &[DVec3], mesh: &tobj::Mesh) -> Triangulation {
    let mut cut = Triangulation::default();
    if mesh.face_arities.is_empty() {
        cut.triangles = mesh.indices.as_chunks::<3>().0.to_vec();
        let normal = |t: &[u32; 3]| triangle_normal(&t.map(|i| points[i as usize])).unwrap_or_default();
        cut.normals = cut.triangles.iter().map(normal).collect();
        return cut;
    }
    let mut outline = Vec::new();
    for corners in sheets::polygons(mesh) {
        outline.clear();
        outline.extend(corners.iter().map(|&i| points[i as usize]));
        let normal = newell_normal(&outline).normalize_or_zero();
        let is_whole = triangulate(&outline, |triangle| {
            cut.triangles.push(triangle.map(|corner| corners[corner]));
            cut.normals.push(normal);
        });
        if !is_whole {
            cut.fans.push(corners.len());
        }
    }
    cut
}
