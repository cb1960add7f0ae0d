//! Occlusion culling on the CPU: a coarse picture of the largest opaque objects, drawn on the CPU for each frame.
//!
//! The picture's cells are several pixels wide, and the depth of a cell holds for every point of it. A mesh covers a cell if it covers the middle and
//! no edge of its outline comes near the cell. An outline edge has on its other side no triangle, or one that faces the other way, so leaving the
//! mesh always crosses the outline. Edges that two triangles share by the same positions are no outline, as rasterization leaves no gap at them. So
//! meshes hide across their triangles' edges, and yet hide nothing that the frame itself would show. The depth of a cell is the farthest of all
//! triangles of the mesh that come near it. An object is hidden if its box is behind each cell that it comes near. Two meshes that meet have an
//! outline there: objects behind it are drawn.

mod largest;
mod mesh;
mod sketch;
mod view;

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec2, DVec3};

pub(super) use self::largest::largest;
use self::mesh::OccluderMesh;
use self::sketch::Sketch;
use self::view::{Cells, OcclusionView};
use super::{DepthMapping, World, WorldObject};
use crate::plan::FramePlan;
use crate::scene::{Aabb, Camera, Scene};
use crate::shaders::cull::host as cull;

/// The picture gets objects that cover at least this share of it, the largest first, up to these numbers of objects, triangles, and pictures' worth
/// of cells.
const LEAST_SHARE: f64 = 0.002;
const MOST_OBJECTS: usize = 128;
const MOST_TRIANGLES: usize = 16384;
const MOST_CELLS: usize = 12;
/// Meshes of more triangles hide nothing.
const LARGEST_MESH: usize = 4096;
/// The least distance of a hidden object behind its occluder, in reversed depth: as a share, and absolutely, as depths are interpolated over large
/// triangles with the rounding of their largest value.
const DEPTH_SHARE: f64 = 1e-3;
const DEPTH_SLACK: f64 = 4e-6;
// The device has the nearest f32 of both; these stay f64, as all of this arithmetic does.
const _: () = assert!(DEPTH_SHARE as f32 == cull::DEPTH_SHARE && DEPTH_SLACK as f32 == cull::DEPTH_SLACK);

/// The meshes that can hide something, by their index in the scene.
#[derive(Debug, Clone, Default)]
pub(super) struct Occluders {
    meshes: BTreeMap<usize, OccluderMesh>,
}

impl Occluders {
    pub(super) fn of(scene: &Scene, plan: &FramePlan, objects: &[WorldObject]) -> Self {
        // A level of detail covers different pixels than its mesh.
        let leveled = plan.meshes.meshes.iter().filter(|mesh| !mesh.levels.is_empty());
        let leveled: BTreeSet<usize> = leveled.map(|mesh| mesh.mesh).collect();
        let can_hide = |object: &&WorldObject| {
            is_opaque(object) && object.triangles <= LARGEST_MESH && !leveled.contains(&object.mesh)
        };
        let meshes: BTreeSet<usize> = objects.iter().filter(can_hide).map(|object| object.mesh).collect();
        Self { meshes: meshes.into_iter().map(|mesh| (mesh, OccluderMesh::of(&scene.meshes[mesh]))).collect() }
    }
}

fn is_opaque(object: &WorldObject) -> bool {
    // A deformed object is not where its mesh is.
    !object.transparent && !object.key.masked && object.deform.is_none()
}

/// The coarse picture: for each of its cells, the distance behind which everything is certain to be hidden.
pub(super) struct OcclusionBuffer {
    view: OcclusionView,
    /// Metres along the view; infinite if nothing is certain.
    hidden_from: Vec<f64>,
}

impl OcclusionBuffer {
    /// Draws the largest of the objects that a camera may see.
    pub(super) fn of(
        world: &World,
        occluders: &Occluders,
        (camera, depth): (&Camera, &DepthMapping),
        size: [u32; 2],
        seen: impl Iterator<Item = usize>,
    ) -> Self {
        let view = OcclusionView::of(camera, depth, size);
        let all = Cells { columns: (0, view.columns - 1), rows: (0, view.rows - 1) };
        let least = LEAST_SHARE * all.count() as f64;
        let candidate = |index: usize| {
            let object = &world.objects[index];
            if !view.may_cover(&object.bounds, least) {
                return None;
            }
            let mesh = occluders.meshes.get(&object.mesh).filter(|_| is_opaque(object))?;
            let cells = match view.footprint(&object.bounds) {
                Some((cells, _)) => cells?,
                None => all,
            };
            (cells.count() as f64 >= least).then_some((index, mesh, cells))
        };
        let mut candidates: Vec<_> = seen.filter_map(candidate).collect();
        // Stable: of equally large ones the nearest first.
        candidates.sort_by_key(|(_, _, cells)| std::cmp::Reverse(cells.count()));
        let mut picture = Self { hidden_from: vec![f64::INFINITY; all.count()], view };
        let (mut triangles, mut cells) = (0, 0);
        for (index, mesh, own) in candidates.into_iter().take(MOST_OBJECTS) {
            triangles += mesh.triangles.len();
            cells += own.count();
            if triangles > MOST_TRIANGLES || cells > MOST_CELLS * all.count() {
                break;
            }
            picture.draw(&world.objects[index], mesh, own);
        }
        picture
    }

    fn draw(&mut self, object: &WorldObject, mesh: &OccluderMesh, cells: Cells) {
        let view = &self.view;
        let places: Vec<DVec3> = mesh
            .positions
            .iter()
            .map(|position| view.place(object.transform.transform_point3(position.as_dvec3())))
            .collect();
        let corners: Vec<DVec2> = places.iter().map(|&place| view.cell(place)).collect();
        // True if the camera sees the triangle's front; `None` if it is culled or not wholly beyond the near plane.
        let facing = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|corner| places[corner as usize]);
            let is_before = a.z.min(b.z).min(c.z) > view.camera.near * (1.0 + 1e-6);
            let ray = if view.camera.is_orthographic() { DVec3::Z } else { a };
            // Both y and z are flipped, so the view is still right-handed.
            let front = ((b - a).cross(c - a).dot(ray) < 0.0) != object.key.mirrored;
            (is_before && (front || object.key.two_sided)).then_some(front)
        };
        let faces: Vec<Option<bool>> = mesh.triangles.iter().map(facing).collect();
        let mut sketch = Sketch::new(cells, view.slack);
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            if faces[index].is_none() {
                continue;
            }
            let points = triangle.map(|corner| corners[corner as usize]);
            sketch.triangle(points, triangle.map(|corner| view.nearness(places[corner as usize])));
            for edge in 0..3 {
                let neighbour = mesh.neighbours[index][edge].map(|other| faces[other as usize]);
                if neighbour != Some(faces[index]) {
                    sketch.outline(points[edge], points[(edge + 1) % 3]);
                }
            }
        }
        let columns = self.view.columns;
        for (own, cell) in sketch.cells.iter().enumerate() {
            if cell.is_covered && !cell.is_outline {
                let (row, column) = (cells.rows.0 + own / cells.width(), cells.columns.0 + own % cells.width());
                let hidden_from = &mut self.hidden_from[row * columns + column];
                *hidden_from = hidden_from.min(self.view.distance(cell.nearness));
            }
        }
    }

    /// Returns true if anything is certain to be hidden anywhere.
    pub(super) fn hides_something(&self) -> bool {
        self.hidden_from.iter().any(|from| from.is_finite())
    }

    /// Returns true if no point of the box can be seen.
    pub(super) fn hides(&self, bounds: &Aabb) -> bool {
        // Early-out: the middle is in one of the cells that the box comes near, and no nearer than its nearest point.
        let middle = self.view.place(bounds.center());
        if middle.z >= self.view.camera.near {
            let cell = self.view.cell(middle);
            let (column, row) = (cell.x as usize, cell.y as usize);
            let is_inside = cell.min_element() >= 0.0 && column < self.view.columns && row < self.view.rows;
            if is_inside && self.hidden_from[row * self.view.columns + column] >= middle.z {
                return false;
            }
        }
        // Boxes that are not wholly beyond the near plane, or come near no cell, count as not hidden.
        let Some((Some(cells), nearest)) = self.view.footprint(bounds) else { return false };
        let depth = self.view.depth.of_distance(nearest) * (1.0 + DEPTH_SHARE) + DEPTH_SLACK;
        (cells.rows.0..=cells.rows.1).all(|row| {
            let row = row * self.view.columns;
            let own = &self.hidden_from[row + cells.columns.0..=row + cells.columns.1];
            own.iter().all(|&from| depth < self.view.depth.of_distance(from))
        })
    }
}

#[cfg(test)]
mod tests;
