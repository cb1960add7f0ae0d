//! Makes levels of detail.
//!
//! Edges are collapsed by `meshoptimizer-rs`, a port of meshoptimizer's simplifier to Rust (`meshopt` compiles the original, in C++), by the quadrics
//! of Garland and Heckbert (1998), which count normals, texture coordinates and colours as well. Seams of these attributes stay closed. A mesh's open
//! borders stay unchanged, since another mesh may begin there. Each level is made from the one before: the result is closer to the mesh than a level
//! made from the mesh itself (a sphere of 3,968 triangles: 0.11 of its radius for 124 instead of 0.4). The simplifier's own error is a mean over
//! areas. A level's error here is the largest distance, which is measured against the mesh.

use std::sync::{Arc, Mutex, PoisonError};

use bvh::aabb::{Aabb as CrateBox, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::Bvh;
use bvh::point_query::PointDistance;
use glam::{DVec3, Vec3};
use meshoptimizer_rs::{Attributes, Positions, SimplifyOptions, SimplifySettings, Workspace, simplify_with_attributes};
use nalgebra::Point3;
use rayon::prelude::*;

use super::{Level, MOST_LEVELS};
use crate::Mesh;

/// Meshes of fewer triangles have no levels: a draw command costs more than their triangles.
const LEAST_TRIANGLES: usize = 128;
/// A level has at most this share of the triangles of the one before; otherwise that one is the last.
const LARGEST_SHARE: f64 = 0.8;
/// A level whose error is a larger share of the mesh's radius is discarded.
const LARGEST_ERROR: f64 = 0.25;
/// The weight of a normal's difference of length 1, compared with a distance as long as the mesh.
const NORMAL_WEIGHT: f32 = 0.5;
/// The safety factor on a level's measured error: between the sampled points the level may be off by more.
const BETWEEN_SAMPLES: f64 = 1.1;

/// The levels of a mesh, with a hash of the data that they were made from.
#[derive(Debug, Default)]
pub(super) struct LevelCache(Mutex<Option<(blake3::Hash, Arc<[Level]>)>>);

impl LevelCache {
    fn get(&self) -> Option<(blake3::Hash, Arc<[Level]>)> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Clone for LevelCache {
    fn clone(&self) -> Self {
        Self(Mutex::new(self.get()))
    }
}

impl Mesh {
    /// Returns the levels of detail, the finest first. Each has about half of the triangles of the one before; the first has half of the mesh's. The
    /// list is empty for small meshes and for meshes that cannot be simplified. Levels are made once, and again when the mesh has changed.
    pub fn levels_of_detail(&self) -> Arc<[Level]> {
        if self.indices.len() < 3 * LEAST_TRIANGLES || self.is_strokes {
            return Arc::default();
        }
        let key = self.shape_hash();
        if let Some((_, levels)) = self.levels.0.get().filter(|(made_of, _)| *made_of == key) {
            return levels;
        }
        // Not under the lock: threads that wait for the work below may be given other work that needs it.
        let levels: Arc<[Level]> = make(self).into();
        *self.levels.0.0.lock().unwrap_or_else(PoisonError::into_inner) = Some((key, levels.clone()));
        levels
    }

    /// Returns a hash of all data that levels are made from.
    fn shape_hash(&self) -> blake3::Hash {
        let mut hasher = blake3::Hasher::new();
        let mut add = |bytes: &[u8]| {
            hasher.update(&bytes.len().to_le_bytes()).update(bytes);
        };
        add(bytemuck::cast_slice(&self.positions));
        add(bytemuck::cast_slice(&self.normals));
        add(bytemuck::cast_slice(&self.uvs));
        add(bytemuck::cast_slice(&self.uvs_1));
        add(bytemuck::cast_slice(&self.colors));
        add(bytemuck::cast_slice(&self.indices));
        hasher.finalize()
    }
}

fn make(mesh: &Mesh) -> Vec<Level> {
    let (simplifier, surface) = (Simplifier::of(mesh), TriangleTree::of(mesh, &mesh.indices));
    let largest = LARGEST_ERROR * mesh.compute_bounds().radius();
    let mut workspace = Workspace::default();
    let mut levels: Vec<Level> = Vec::new();
    while levels.len() < MOST_LEVELS {
        let before = levels.last().map_or(&mesh.indices, |level| &level.indices);
        let most = (before.len() as f64 * LARGEST_SHARE) as usize;
        let halved = simplifier.halve(mesh, before, &mut workspace).filter(|own| !own.is_empty() && own.len() <= most);
        let Some(indices) = halved else { break };
        let error = deviation(mesh, &surface, &indices).map(|distance| BETWEEN_SAMPLES * distance);
        let Some(error) = error.filter(|&error| error <= largest) else { break };
        levels.push(Level { indices, error: levels.last().map_or(error, |level| level.error.max(error)) });
    }
    levels
}

/// The attributes of a mesh's vertices beside their positions, and the weight of each number.
struct Simplifier {
    attributes: Vec<f32>,
    weights: Vec<f32>,
}

impl Simplifier {
    fn of(mesh: &Mesh) -> Self {
        let mut weights = vec![NORMAL_WEIGHT; 3];
        let sets: Vec<&[[f32; 2]]> =
            [&mesh.uvs, &mesh.uvs_1].into_iter().filter(|set| !set.is_empty()).map(Vec::as_slice).collect();
        for set in &sets {
            // A shift by the mesh's whole extent in texture space weighs as much as a shift by the whole mesh.
            let weight = 1.0 / extent(set).max(f32::MIN_POSITIVE);
            weights.extend([if weight.is_finite() { weight } else { 0.0 }; 2]);
        }
        weights.extend(std::iter::repeat_n(1.0, if mesh.colors.is_empty() { 0 } else { 4 }));
        let mut attributes = Vec::with_capacity(mesh.positions.len() * weights.len());
        for (vertex, normal) in mesh.normals.iter().enumerate() {
            attributes.extend(Vec3::from(*normal).normalize_or_zero().to_array());
            sets.iter().for_each(|set| attributes.extend(set[vertex]));
            attributes.extend(mesh.colors.get(vertex).copied().iter().flatten());
        }
        Self { attributes, weights }
    }

    /// Returns about half of the triangles; `None` if the simplifier refuses the mesh's numbers.
    fn halve(&self, mesh: &Mesh, indices: &[u32], workspace: &mut Workspace) -> Option<Vec<u32>> {
        let (count, width) = (mesh.positions.len(), self.weights.len());
        let attributes = Attributes::from_interleaved(&self.attributes, count, width, width, 0).ok()?;
        let settings = SimplifySettings {
            target_index_count: indices.len() / 6 * 3,
            // The error limit is as large as the mesh, so only the count decides.
            target_error: 1.0,
            options: SimplifyOptions::LOCK_BORDER | SimplifyOptions::SPARSE,
        };
        let positions = Positions::from_packed(&mesh.positions);
        let made = simplify_with_attributes(indices, positions, attributes, &self.weights, None, settings, workspace);
        made.ok().map(|made| made.indices)
    }
}

/// The longer side of the box around coordinates.
fn extent(coordinates: &[[f32; 2]]) -> f32 {
    let side = |axis: usize| {
        let (min, max) = coordinates
            .iter()
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(min, max), own| (min.min(own[axis]), max.max(own[axis])));
        max - min
    };
    side(0).max(side(1))
}

/// The largest distance between a mesh and one of its levels: from each vertex of the mesh to the level, and from the middles of the level's
/// triangles and edges to the mesh.
fn deviation(mesh: &Mesh, surface: &TriangleTree, indices: &[u32]) -> Option<f64> {
    let level = TriangleTree::of(mesh, indices);
    let mut lost = vec![false; mesh.positions.len()];
    mesh.indices.iter().for_each(|&index| lost[index as usize] = true);
    indices.iter().for_each(|&index| lost[index as usize] = false);
    let points: Vec<DVec3> = (0..lost.len()).filter(|&vertex| lost[vertex]).map(|vertex| point(mesh, vertex)).collect();
    let to_level = level.farthest(&points)?;
    let middles = level.triangles.iter().flat_map(|triangle| {
        let [a, b, c] = triangle.corners;
        [(a + b + c) / 3.0, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5]
    });
    Some(to_level.max(surface.farthest(&middles.collect::<Vec<_>>())?))
}

fn point(mesh: &Mesh, vertex: usize) -> DVec3 {
    Vec3::from(mesh.positions[vertex]).as_dvec3()
}

/// Triangles to which distances are measured, in f64.
struct TriangleTree {
    triangles: Vec<BvhTriangle>,
    tree: Bvh<f64, 3>,
}

struct BvhTriangle {
    corners: [DVec3; 3],
    node: usize,
}

impl TriangleTree {
    fn of(mesh: &Mesh, indices: &[u32]) -> Self {
        let triangle =
            |corners: &[u32; 3]| BvhTriangle { corners: corners.map(|own| point(mesh, own as usize)), node: 0 };
        let mut triangles: Vec<_> = indices.as_chunks::<3>().0.iter().map(triangle).collect();
        let tree = Bvh::build(&mut triangles);
        Self { triangles, tree }
    }

    fn distance(&self, point: DVec3) -> Option<f64> {
        let point = Point3::new(point.x, point.y, point.z);
        Some(self.tree.nearest_to(point, &self.triangles)?.1)
    }

    /// The largest distance of any of these points; 0 for no points.
    fn farthest(&self, points: &[DVec3]) -> Option<f64> {
        points.par_iter().map(|&point| self.distance(point)).try_reduce(|| 0.0, |a, b| Some(f64::max(a, b)))
    }
}

impl Bounded<f64, 3> for BvhTriangle {
    fn aabb(&self) -> CrateBox<f64, 3> {
        let [a, b, c] = self.corners;
        let point = |p: DVec3| Point3::new(p.x, p.y, p.z);
        CrateBox::with_bounds(point(a.min(b).min(c)), point(a.max(b).max(c)))
    }
}

impl BHShape<f64, 3> for BvhTriangle {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

impl PointDistance<f64, 3> for BvhTriangle {
    fn distance_squared(&self, point: Point3<f64>) -> f64 {
        let point = DVec3::new(point.x, point.y, point.z);
        point.distance_squared(nearest(&self.corners, point))
    }
}

/// The point of a triangle that is nearest to another (Ericson, Real-Time Collision Detection, 5.1.5).
fn nearest(&[a, b, c]: &[DVec3; 3], point: DVec3) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let along = |corner: DVec3| (ab.dot(point - corner), ac.dot(point - corner));
    let ((ab_a, ac_a), (ab_b, ac_b), (ab_c, ac_c)) = (along(a), along(b), along(c));
    if ab_a <= 0.0 && ac_a <= 0.0 {
        return a;
    }
    if ab_b >= 0.0 && ac_b <= ab_b {
        return b;
    }
    if ac_c >= 0.0 && ab_c <= ac_c {
        return c;
    }
    let beside_ab = ab_a * ac_b - ab_b * ac_a;
    if beside_ab <= 0.0 && ab_a >= 0.0 && ab_b <= 0.0 {
        return a + ab * share(ab_a, ab_a - ab_b);
    }
    let beside_ac = ab_c * ac_a - ab_a * ac_c;
    if beside_ac <= 0.0 && ac_a >= 0.0 && ac_c <= 0.0 {
        return a + ac * share(ac_a, ac_a - ac_c);
    }
    let beside_bc = ab_b * ac_c - ab_c * ac_b;
    let (from_b, from_c) = (ac_b - ab_b, ab_c - ac_c);
    if beside_bc <= 0.0 && from_b >= 0.0 && from_c >= 0.0 {
        return b + (c - b) * share(from_b, from_b + from_c);
    }
    let sum = beside_bc + beside_ac + beside_ab;
    a + ab * share(beside_ac, sum) + ac * share(beside_ab, sum)
}

/// The ratio of two lengths; 0 if the whole is 0, as in triangles without area.
fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 0.0 }
}

#[cfg(test)]
mod tests;
