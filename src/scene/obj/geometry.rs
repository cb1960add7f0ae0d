//! tobj's objects into meshes: polygons cut, normals made where there are none, alike parts joined.

use std::collections::HashMap;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::normals::{Faces, corner_normals};
use super::polygon::{newell_normal, triangulate};
use super::scan::{Part, Scan};
use crate::scene::mesh::triangle_normal;
use crate::scene::texture::srgb_decode;
use crate::scene::uvs::wrapped;
use crate::scene::{Error, LoadOptions, Mesh};

/// A mesh and what it belongs to in the scan's tables.
pub(super) struct Group {
    pub group: usize,
    pub material: usize,
    pub mesh: Mesh,
    /// True if its normals are the file's.
    pub has_own_normals: bool,
}

/// The attributes that a material wants of its meshes.
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
/// `Error::Content` should tobj refuse what the scan let pass.
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

/// Meshes, one for each group and material, and how many triangles without area were left out. `needs` is by material.
pub(super) fn build(
    scan: &Scan,
    parsed: Vec<tobj::Mesh>,
    needs: &[MaterialNeeds],
    options: &LoadOptions,
) -> (Vec<Group>, usize) {
    let mut places = HashMap::new();
    let mut joined: Vec<Vec<(Part, tobj::Mesh)>> = Vec::new();
    for (&part, mesh) in scan.parts.iter().zip(parsed) {
        let place = *places.entry((part.group, part.material)).or_insert_with(|| {
            joined.push(Vec::new());
            joined.len() - 1
        });
        joined[place].push((part, mesh));
    }
    let (done, total) = (AtomicUsize::new(0), joined.len());
    let finished: Vec<(Group, usize)> = joined
        .into_par_iter()
        .map(|parts| {
            let Part { group, material, .. } = parts[0].0;
            let mut vertices = Vertices::default();
            parts.into_iter().for_each(|(part, mesh)| vertices.append(&part, mesh, &scan.colors));
            let has_own_normals = !vertices.has_made_normals;
            let (mesh, degenerate) = vertices.into_mesh(&scan.groups[group], &needs[material]);
            options.report("meshes", done.fetch_add(1, Ordering::Relaxed) + 1, total);
            (Group { group, material, mesh, has_own_normals }, degenerate)
        })
        .collect();
    let degenerate = finished.iter().map(|(_, count)| count).sum();
    let groups = finished.into_iter().map(|(group, _)| group).filter(|group| !group.mesh.indices.is_empty());
    (groups.collect(), degenerate)
}

/// A mesh in the making, before it is recentred.
#[derive(Default)]
struct Vertices {
    points: Vec<DVec3>,
    normals: Vec<DVec3>,
    /// As in the file, V up. Zero where a part has none.
    uvs: Vec<DVec2>,
    has_uvs: bool,
    has_made_normals: bool,
    /// Linear; empty where the file has none.
    colors: Vec<[f32; 4]>,
    indices: Vec<u32>,
}

impl Vertices {
    /// Adds a part. `colors` holds the colours of the file's vertices, if it has any.
    fn append(&mut self, part: &Part, mesh: tobj::Mesh, colors: &[[f32; 3]]) {
        let points: Vec<DVec3> = mesh.positions.as_chunks().0.iter().map(|&p| DVec3::from_array(p)).collect();
        let uvs: Vec<DVec2> = match part.has_uvs {
            true => mesh.texcoords.as_chunks().0.iter().map(|&uv| DVec2::from_array(uv)).collect(),
            false => vec![DVec2::ZERO; points.len()],
        };
        self.has_uvs |= part.has_uvs;
        let (triangles, face_normals) = cut(&points, &mesh);
        // tobj hands through the vertices' numbers as red.
        let numbers = mesh.vertex_color.as_chunks::<3>().0.iter().map(|&[number, ..]| number as usize);
        let own_colors: Vec<[f32; 4]> =
            numbers.filter_map(|number| colors.get(number)).map(|own| linear(*own)).collect();
        let normals = mesh.normals.as_chunks().0.iter().map(|&n| DVec3::from_array(n).normalize_or_zero());
        let normals: Vec<DVec3> = if part.has_normals { normals.collect() } else { Vec::new() };
        // Where no normal has a length, the file has none.
        if normals.iter().any(|normal| *normal != DVec3::ZERO) {
            let base = self.points.len() as u32;
            self.normals.extend(normals);
            self.colors.extend(own_colors);
            self.points.extend(points);
            self.uvs.extend(uvs);
            self.indices.extend(triangles.as_flattened().iter().map(|index| base + index));
            return;
        }
        self.has_made_normals = true;
        let faces = Faces { points: &points, triangles: &triangles, normals: &face_normals };
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
    }

    fn into_mesh(self, name: &str, needs: &MaterialNeeds) -> (Mesh, usize) {
        let mut mesh = Mesh::from_points(name, &self.points);
        mesh.indices = self.indices;
        let degenerate = mesh.remove_degenerate_triangles();
        if self.normals.contains(&DVec3::ZERO) {
            // The file gave a normal of no length: the triangles' normals are better than none.
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
                // Other repeats of a picture that has one only are its edges.
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

/// A parsed mesh's triangles, and for each the unit normal of its polygon (zero when that has no area).
fn cut(points: &[DVec3], mesh: &tobj::Mesh) -> (Vec<[u32; 3]>, Vec<DVec3>) {
    if mesh.face_arities.is_empty() {
        let triangles = mesh.indices.as_chunks::<3>().0.to_vec();
        let normal = |t: &[u32; 3]| triangle_normal(&t.map(|i| points[i as usize])).unwrap_or_default();
        let normals = triangles.iter().map(normal).collect();
        return (triangles, normals);
    }
    let (mut triangles, mut normals) = (Vec::new(), Vec::new());
    let mut rest = mesh.indices.as_slice();
    let mut outline = Vec::new();
    for &arity in &mesh.face_arities {
        let (corners, later) = rest.split_at((arity as usize).min(rest.len()));
        rest = later;
        outline.clear();
        outline.extend(corners.iter().map(|&i| points[i as usize]));
        let normal = newell_normal(&outline).normalize_or_zero();
        triangulate(&outline, |triangle| {
            triangles.push(triangle.map(|corner| corners[corner]));
            normals.push(normal);
        });
    }
    (triangles, normals)
}
