//! Which objects lie wholly behind others: a coarse picture of the largest opaque objects, drawn on the CPU for each frame.
//!
//! The picture's cells are several pixels wide, and what it says of a cell holds for every point of it. A mesh covers a cell if it covers the
//! middle and none of its outline's edges comes near the cell: from inside to outside one has to cross an edge that has no triangle, or one that
//! faces the other way, on its far side. Edges that two triangles share by the same positions are no outline, and rasterization leaves no gap
//! there. So meshes hide across their triangles' edges, and yet nothing shows through that the frame itself would not show. The depth of
//! a cell is the farthest of all triangles of the mesh that come near it. An object is hidden if its box is behind each cell that it comes
//! near. Where meshes meet, there is an outline; what is behind it stays.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::{DMat3, DVec2, DVec3, Vec3};

use super::{Depth, World, WorldObject};
use crate::scene::{Aabb, Camera, Scene};

/// Cells across the picture at most (twice as many take twice the time and find 1% more), and pixels across a cell at least.
const COLUMNS: u32 = 128;
const LEAST_CELL: u32 = 4;
/// Pixels around an outline or a box in which nothing is taken for sure: vertices are rounded to parts of a pixel, samples lie beside centres.
const SLACK_PIXELS: f64 = 2.0;
/// What is drawn into the picture: objects that cover this share of it or more, the largest first, until one of the sums is reached: objects,
/// triangles, and pictures' worth of cells.
const LEAST_SHARE: f64 = 0.002;
const MOST_OBJECTS: usize = 128;
const MOST_TRIANGLES: usize = 16384;
const MOST_CELLS: usize = 12;
/// Meshes of more triangles hide nothing.
const LARGEST_MESH: usize = 4096;
/// By so much an object is behind what hides it, in reversed depth: as a share, and absolutely, as depths are interpolated over large
/// triangles with the rounding of their largest value.
const DEPTH_SHARE: f64 = 1e-3;
const DEPTH_SLACK: f64 = 4e-6;

/// The meshes that can hide something, by their index in the scene.
#[derive(Debug, Clone, Default)]
pub(super) struct Occluders {
    meshes: BTreeMap<usize, OccluderMesh>,
}

/// Triangles that share positions, not vertices.
#[derive(Debug, Clone)]
struct OccluderMesh {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// For each edge of each triangle, which goes from its corner to the next, the one other triangle that has it in the opposite direction.
    neighbours: Vec<[Option<u32>; 3]>,
}

impl OccluderMesh {
    fn of(mesh: &crate::scene::Mesh) -> Self {
        let mut places = HashMap::new();
        let mut positions = Vec::new();
        let mut place = |index: u32| {
            let position = mesh.positions[index as usize];
            // The same bits come out at the same place.
            *places.entry(position.map(f32::to_bits)).or_insert_with(|| {
                positions.push(Vec3::from(position));
                (positions.len() - 1) as u32
            })
        };
        let corners = mesh.indices.as_chunks::<3>().0.iter().map(|triangle| triangle.map(&mut place));
        let triangles: Vec<[u32; 3]> = corners.filter(|[a, b, c]| a != b && b != c && c != a).collect();
        let mut edges: HashMap<(u32, u32), Vec<u32>> = HashMap::new();
        for (index, triangle) in triangles.iter().enumerate() {
            for corner in 0..3 {
                edges.entry((triangle[corner], triangle[(corner + 1) % 3])).or_default().push(index as u32);
            }
        }
        let neighbour = |from: u32, to: u32| match (edges.get(&(from, to)), edges.get(&(to, from))) {
            // Of edges with more triangles it is not known which belong together.
            (Some(own), Some(other)) if own.len() == 1 && other.len() == 1 => Some(other[0]),
            _ => None,
        };
        let neighbours =
            triangles.iter().map(|&[a, b, c]| [neighbour(a, b), neighbour(b, c), neighbour(c, a)]).collect();
        Self { positions, triangles, neighbours }
    }
}

impl Occluders {
    pub(super) fn of(scene: &Scene, objects: &[WorldObject]) -> Self {
        let can_hide = |object: &&WorldObject| is_opaque(object) && object.triangles <= LARGEST_MESH;
        let meshes: BTreeSet<usize> = objects.iter().filter(can_hide).map(|object| object.mesh).collect();
        Self { meshes: meshes.into_iter().map(|mesh| (mesh, OccluderMesh::of(&scene.meshes[mesh]))).collect() }
    }
}

fn is_opaque(object: &WorldObject) -> bool {
    // What deforms is not where its mesh is.
    !object.transparent && !object.key.masked && object.deform.is_none()
}

/// How far from the camera something is certain to hide whatever is behind, for each cell of the picture.
pub(super) struct Picture {
    view: View,
    /// Metres along the view; infinite where nothing is certain.
    hidden_from: Vec<f64>,
}

/// From the world to cells, x to the right and y down.
struct View {
    axes: DMat3,
    camera: Camera,
    depth: Depth,
    /// Cells a unit of x or y over w.
    scale: f64,
    center: DVec2,
    columns: usize,
    rows: usize,
    /// Cells around what is uncertain.
    slack: f64,
}

/// A rectangle of cells, both ends included.
#[derive(Debug, Clone, Copy)]
struct Cells {
    columns: (usize, usize),
    rows: (usize, usize),
}

impl Cells {
    fn width(&self) -> usize {
        self.columns.1 - self.columns.0 + 1
    }

    fn count(&self) -> usize {
        self.width() * (self.rows.1 - self.rows.0 + 1)
    }
}

impl View {
    fn of(camera: &Camera, depth: &Depth, size: [u32; 2]) -> Self {
        let columns = (size[0] / LEAST_CELL).clamp(1, COLUMNS);
        let [width, height] = size.map(f64::from);
        let pixels = width / f64::from(columns);
        Self {
            axes: DMat3::from_cols(camera.right(), -camera.up(), camera.forward()).transpose(),
            camera: *camera,
            depth: *depth,
            scale: height * 0.5 / camera.half_height() / pixels,
            center: DVec2::new(width, height) * 0.5 / pixels,
            columns: columns as usize,
            rows: (height / pixels).ceil() as usize,
            slack: SLACK_PIXELS / pixels,
        }
    }

    /// In metres, z along the view.
    fn place(&self, point: DVec3) -> DVec3 {
        self.axes * (point - self.camera.position)
    }

    /// Something of a place that is linear over the picture of a triangle, and larger the nearer it is.
    fn nearness(&self, place: DVec3) -> f64 {
        if self.camera.is_orthographic() { -place.z } else { place.z.recip() }
    }

    /// The distance along the view that has it.
    fn distance(&self, nearness: f64) -> f64 {
        if self.camera.is_orthographic() { -nearness } else { nearness.recip() }
    }

    /// In cells; only of what is before the near plane.
    fn cell(&self, place: DVec3) -> DVec2 {
        place.truncate() * (self.scale / self.camera.w(place.z)) + self.center
    }

    /// The cells from one place to another with the slack around them, if any is in the picture.
    fn range(&self, low: DVec2, high: DVec2) -> Option<Cells> {
        let axis = |low: f64, high: f64, count: usize| {
            let (low, high) = ((low - self.slack).floor(), (high + self.slack).floor());
            let is_inside = high >= 0.0 && low < count as f64;
            is_inside.then(|| (low.max(0.0) as usize, high.min((count - 1) as f64) as usize))
        };
        Some(Cells { columns: axis(low.x, high.x, self.columns)?, rows: axis(low.y, high.y, self.rows)? })
    }

    /// Whether a box may come near so many cells: of the sphere around it, which is sooner known than of its corners.
    fn may_cover(&self, bounds: &Aabb, least: f64) -> bool {
        let (middle, radius) = (self.place(bounds.center()), bounds.radius());
        let [near, far] = [middle.z - radius, middle.z + radius].map(|z| self.camera.w(z));
        if middle.z - radius < self.camera.near {
            return true;
        }
        let length = |at: f64| {
            let (low, high) = (at - radius, at + radius);
            ((high / near).max(high / far) - (low / near).min(low / far)) * self.scale + 2.0 * self.slack + 2.0
        };
        length(middle.x) * length(middle.y) >= least
    }

    /// The cells that a box comes near, and the distance of its nearest point; none where it is not wholly before the near plane.
    fn footprint(&self, bounds: &Aabb) -> Option<(Option<Cells>, f64)> {
        let places = bounds.corners().map(|corner| self.place(corner));
        let nearest = places.iter().map(|place| place.z).fold(f64::INFINITY, f64::min);
        if nearest < self.camera.near {
            return None;
        }
        let cells = places.map(|place| self.cell(place));
        let low = cells.into_iter().fold(DVec2::INFINITY, DVec2::min);
        let high = cells.into_iter().fold(DVec2::NEG_INFINITY, DVec2::max);
        Some((self.range(low, high), nearest))
    }
}

impl Picture {
    /// Of the objects that a camera may see.
    pub(super) fn of(
        world: &World,
        occluders: &Occluders,
        (camera, depth): (&Camera, &Depth),
        size: [u32; 2],
        seen: impl Iterator<Item = usize>,
    ) -> Self {
        let view = View::of(camera, depth, size);
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
        // Whether the triangle's front is seen; none where it is not drawn, or not wholly before the near plane.
        let facing = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|corner| places[corner as usize]);
            let is_before = a.z.min(b.z).min(c.z) > view.camera.near * (1.0 + 1e-6);
            let ray = if view.camera.is_orthographic() { DVec3::Z } else { a };
            // Y and z turned over: a right-handed view all the same.
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

    /// Whether anything is certain to be hidden anywhere.
    pub(super) fn hides_something(&self) -> bool {
        self.hidden_from.iter().any(|from| from.is_finite())
    }

    /// Whether no point of the box can be seen.
    pub(super) fn hides(&self, bounds: &Aabb) -> bool {
        // Its middle is in one of the cells that it comes near, and no nearer than its nearest point.
        let middle = self.view.place(bounds.center());
        if middle.z >= self.view.camera.near {
            let cell = self.view.cell(middle);
            let (column, row) = (cell.x as usize, cell.y as usize);
            let is_inside = cell.min_element() >= 0.0 && column < self.view.columns && row < self.view.rows;
            if is_inside && self.hidden_from[row * self.view.columns + column] >= middle.z {
                return false;
            }
        }
        // What is not before the near plane or comes near no cell is not decided here.
        let Some((Some(cells), nearest)) = self.view.footprint(bounds) else { return false };
        let depth = self.view.depth.of_distance(nearest) * (1.0 + DEPTH_SHARE) + DEPTH_SLACK;
        (cells.rows.0..=cells.rows.1).all(|row| {
            let row = row * self.view.columns;
            let own = &self.hidden_from[row + cells.columns.0..=row + cells.columns.1];
            own.iter().all(|&from| depth < self.view.depth.of_distance(from))
        })
    }
}

/// What one mesh does to the cells around it.
struct Sketch {
    at: Cells,
    slack: f64,
    cells: Vec<Sketched>,
}

#[derive(Debug, Clone, Copy)]
struct Sketched {
    /// A triangle covers its middle.
    is_covered: bool,
    /// An edge of the outline comes near it.
    is_outline: bool,
    /// The least of all triangles that come near it.
    nearness: f64,
}

impl Sketch {
    fn new(at: Cells, slack: f64) -> Self {
        Self {
            at,
            slack,
            cells: vec![Sketched { is_covered: false, is_outline: false, nearness: f64::INFINITY }; at.count()],
        }
    }

    /// Calls `each` for the cells of a row from one place to another.
    fn fill(&mut self, row: usize, (low, high): (f64, f64), mut each: impl FnMut(usize, &mut Sketched)) {
        let (first, last) = self.at.columns;
        let (low, high) = (low.floor().max(first as f64), high.floor().min(last as f64));
        if low > high {
            return;
        }
        let start = (row - self.at.rows.0) * self.at.width();
        for column in low as usize..=high as usize {
            each(column, &mut self.cells[start + column - first]);
        }
    }

    /// Rows that a span of y comes near.
    fn rows(&self, low: f64, high: f64) -> std::ops::Range<usize> {
        let (first, last) = self.at.rows;
        let row = |y: f64| y.clamp(first as f64, (last + 1) as f64) as usize;
        row((low - self.slack).floor())..row((high + self.slack).floor() + 1.0)
    }

    /// A triangle whose corners are so near ([`View::nearness`]).
    fn triangle(&mut self, points: [DVec2; 3], nearness: [f64; 3]) {
        let [a, b, c] = points;
        let slack = self.slack;
        let area = (b - a).perp_dot(c - a);
        let (db, dc) = (nearness[1] - nearness[0], nearness[2] - nearness[0]);
        let slope = DVec2::new(db * (c - a).y - dc * (b - a).y, dc * (b - a).x - db * (c - a).x) / area;
        let least = nearness.into_iter().fold(f64::INFINITY, f64::min);
        // To a cell's farthest corner, with the slack.
        let reach = (slope.x.abs() + slope.y.abs()) * (0.5 + slack);
        let edges = [(a, b), (b, c), (c, a)];
        let (low, high) = (a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y));
        for row in self.rows(low, high) {
            let top = row as f64;
            let Some(near) = span(&edges, top - slack, top + 1.0 + slack) else { continue };
            self.fill(row, (near.0 - slack, near.1 + slack), |column, cell| {
                let middle = DVec2::new(column as f64 + 0.5, top + 0.5);
                let here = nearness[0] + slope.dot(middle - a) - reach;
                // Of a triangle that is seen from its edge the slope says nothing.
                let here = if area.abs() > 1e-6 { here.max(least) } else { least };
                cell.nearness = cell.nearness.min(here);
            });
            if let Some((left, right)) = span(&edges, top + 0.5, top + 0.5) {
                // Only middles between both ends.
                self.fill(row, ((left - 0.5).ceil(), right - 0.5), |_, cell| cell.is_covered = true);
            }
        }
    }

    fn outline(&mut self, from: DVec2, to: DVec2) {
        let slack = self.slack;
        for row in self.rows(from.y.min(to.y), from.y.max(to.y)) {
            let top = row as f64;
            if let Some((left, right)) = span(&[(from, to)], top - slack, top + 1.0 + slack) {
                self.fill(row, (left - slack, right + slack), |_, cell| cell.is_outline = true);
            }
        }
    }
}

/// From where to where along x lines lie between two y.
fn span(lines: &[(DVec2, DVec2)], low: f64, high: f64) -> Option<(f64, f64)> {
    let mut found: Option<(f64, f64)> = None;
    for &(a, b) in lines {
        // Always in the same direction, so that two triangles find the same place on the edge that they share.
        let (a, b) = if (a.y, a.x) <= (b.y, b.x) { (a, b) } else { (b, a) };
        if b.y < low || a.y > high {
            continue;
        }
        let at = |y: f64| if a.y == b.y { a.x } else { a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)).clamp(0.0, 1.0) };
        let ends = if a.y == b.y { (a.x, b.x) } else { (at(low), at(high)) };
        let (left, right) = (ends.0.min(ends.1), ends.0.max(ends.1));
        found = Some(found.map_or((left, right), |(l, r)| (l.min(left), r.max(right))));
    }
    found
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DQuat};
    use proptest::prelude::*;

    use super::*;
    use crate::plan::{
        FramePlan, MANY_OBJECTS,
        samples::{self, vector},
    };
    use crate::scene::builtin::shapes::{self, MeshBuilder};
    use crate::scene::{Keep, Material, Mesh, Object, OptionalPart, Projection, Settings};
    use crate::visible::Visible;

    const SIZE: [u32; 2] = [640, 360];

    /// Objects of these meshes, in the materials of their numbers: one-sided, two-sided.
    fn scene(objects: Vec<(MeshBuilder, usize, DAffine3)>) -> Scene {
        let two_sided = Material { two_sided: true, ..Material::default() };
        let mut scene = Scene { materials: vec![Material::default(), two_sided], ..Scene::default() };
        for (index, (mesh, material, place)) in objects.into_iter().enumerate() {
            scene.meshes.push(mesh.finish(&format!("mesh {index}")));
            scene.objects.push(Object::new(format!("object {index}"), index, material, place));
        }
        scene
    }

    fn world(scene: &Scene) -> (World, FramePlan) {
        let settings = Settings { size: SIZE, ..Settings::default() };
        let plan = FramePlan::of(scene, &settings, &samples::software()).expect("a plan");
        (World::of(scene, &settings, &plan, 1.0), plan)
    }

    fn picture(scene: &Scene, camera: &Camera) -> (World, Picture) {
        let (world, plan) = world(scene);
        let occluders = Occluders::of(scene, &world.objects);
        let depth = Depth::of(&world, &plan, camera);
        let picture = Picture::of(&world, &occluders, (camera, &depth), SIZE, 0..world.objects.len());
        (world, picture)
    }

    /// Share of the cells that hide something.
    fn covered(picture: &Picture) -> f64 {
        picture.hidden_from.iter().filter(|from| from.is_finite()).count() as f64 / picture.hidden_from.len() as f64
    }

    /// Where a ray first meets a mesh, if the triangle is drawn from that side.
    fn hit(mesh: &Mesh, place: &DAffine3, two_sided: bool, from: DVec3, ray: DVec3, near: f64) -> Option<f64> {
        let at =
            |index: u32| place.transform_point3(mesh.origin + Vec3::from(mesh.positions[index as usize]).as_dvec3());
        let mirrored = place.matrix3.determinant() < 0.0;
        let distance = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(at);
            let normal = (b - a).cross(c - a);
            let along = normal.dot(ray);
            if along == 0.0 || (((along < 0.0) == mirrored) && !two_sided) {
                return None;
            }
            let t = normal.dot(a - from) / along;
            let point = from + ray * t;
            let inside = |p: DVec3, q: DVec3| (q - p).cross(point - p).dot(normal) >= 0.0;
            (t > near && inside(a, b) && inside(b, c) && inside(c, a)).then_some(t)
        };
        mesh.indices.as_chunks::<3>().0.iter().filter_map(distance).min_by(f64::total_cmp)
    }

    fn mesh(kind: usize) -> MeshBuilder {
        match kind {
            0 => shapes::cuboid([1.0, 1.0, 0.2]),
            1 => shapes::sphere(0.5, 12),
            2 => shapes::torus(0.4, 0.15, 10),
            3 => shapes::cone(0.5, 1.0, 9),
            _ => shapes::plane([1.0, 1.0]),
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]
        #[test]
        fn what_a_ray_through_any_part_of_a_pixel_meets_first_is_not_hidden(
            objects in proptest::collection::vec((0..5usize, 0..2usize, vector(6.0), vector(3.0), [0.1..7.0, 0.1..7.0, 0.1..7.0f64], any::<bool>()), 2..24),
            position in vector(9.0), target in vector(2.0), fov in 20.0..110.0f64, parallel in any::<bool>(),
            rays in proptest::collection::vec((0.0..=1.0f64, 0.0..=1.0f64), 400),
        ) {
            prop_assume!(position.distance(target) > 0.1);
            let object = |(kind, material, at, turn, size, mirrored): (usize, usize, DVec3, DVec3, [f64; 3], bool)| {
                let size = DVec3::from(size) * if mirrored { DVec3::new(-1.0, 1.0, 1.0) } else { DVec3::ONE };
                (mesh(kind), material, DAffine3::from_scale_rotation_translation(size, DQuat::from_scaled_axis(turn), at))
            };
            let scene = scene(objects.into_iter().map(object).collect());
            let projection = if parallel { Projection::orthographic(fov * 0.1) } else { Projection::perspective(fov) };
            let camera = Camera { projection, near: 0.1, ..Camera::looking_at(position, target, DVec3::Y) };
            let (world, picture) = picture(&scene, &camera);
            let hidden: Vec<bool> = world.objects.iter().map(|object| picture.hides(&object.bounds)).collect();
            let half_y = camera.half_height();
            let half_x = half_y * f64::from(SIZE[0]) / f64::from(SIZE[1]);
            for (x, y) in rays {
                let aside = camera.right() * half_x * (2.0 * x - 1.0) + camera.up() * half_y * (1.0 - 2.0 * y);
                let (from, ray) = match parallel {
                    true => (position + aside, camera.forward()),
                    false => (position, camera.forward() + aside),
                };
                let hits = scene.objects.iter().enumerate().filter_map(|(index, object)| {
                    let two_sided = scene.materials[object.material].two_sided;
                    Some((hit(&scene.meshes[object.mesh], &object.transform, two_sided, from, ray, 0.1)?, index))
                });
                let first = hits.min_by(|a, b| a.0.total_cmp(&b.0));
                if let Some((_, first)) = first {
                    prop_assert!(!hidden[first], "object {first} is seen at {x}, {y}");
                }
                // The ray's own length along the view is 1.
                let cell = picture.view.cell(picture.view.place(from + ray)).floor().max(DVec2::ZERO);
                let (column, row) = ((cell.x as usize).min(picture.view.columns - 1), (cell.y as usize).min(picture.view.rows - 1));
                let hidden_from = picture.hidden_from[row * picture.view.columns + column];
                let distance = first.map_or(f64::INFINITY, |(distance, _)| distance);
                let is_right = hidden_from.is_infinite() || distance <= hidden_from * (1.0 + 1e-9);
                prop_assert!(is_right, "{distance} {hidden_from} at {x}, {y}");
            }
        }
    }

    fn at(x: f64, y: f64, z: f64) -> DAffine3 {
        DAffine3::from_translation(DVec3::new(x, y, z))
    }

    fn camera() -> Camera {
        Camera { position: DVec3::ZERO, near: 0.1, ..Camera::default() }
    }

    #[test]
    fn a_wall_hides_across_the_edges_of_its_triangles_and_not_past_its_outline() {
        let wall = || shapes::cuboid([6.0, 6.0, 0.5]);
        let small = || shapes::sphere(0.2, 8);
        let scene = scene(vec![
            (wall(), 0, at(0.0, 0.0, -6.0)),
            // On the diagonal of the wall's front, and beside that; before the wall; half beside it; behind the camera.
            (small(), 0, at(0.0, 0.0, -9.0)),
            (small(), 0, at(1.5, 0.7, -20.0)),
            (small(), 0, at(0.0, 0.0, -4.0)),
            (small(), 0, at(4.5, 0.0, -9.0)),
            (small(), 0, at(0.0, 0.0, 5.0)),
        ]);
        let (world, picture) = picture(&scene, &camera());
        let hidden: Vec<bool> = world.objects.iter().map(|object| picture.hides(&object.bounds)).collect();
        assert_eq!(hidden, [false, true, true, false, false, false]);
        assert!(covered(&picture) > 0.3, "{}", covered(&picture));
    }

    #[test]
    fn only_sides_that_are_drawn_hide_and_what_has_holes_or_is_seen_through_does_not() {
        let behind = || (shapes::sphere(0.2, 8), 0, at(0.0, 0.0, -9.0));
        let turned = at(0.0, 0.0, -6.0) * DAffine3::from_rotation_x(-std::f64::consts::FRAC_PI_2);
        let front = at(0.0, 0.0, -6.0) * DAffine3::from_rotation_x(std::f64::consts::FRAC_PI_2);
        let mirrored = front * DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        let hides = |material: usize, place: DAffine3, change: &dyn Fn(&mut Scene)| {
            let mut scene = scene(vec![(shapes::plane([6.0, 6.0]), material, place), behind()]);
            change(&mut scene);
            let (world, picture) = picture(&scene, &camera());
            picture.hides(&world.objects[1].bounds)
        };
        let same = |_: &mut Scene| {};
        assert!(hides(0, front, &same) && !hides(0, turned, &same), "a one-sided sheet");
        assert!(hides(1, front, &same) && hides(1, turned, &same), "a two-sided one");
        assert!(hides(0, mirrored, &same), "a mirrored front is a front");
        assert!(!hides(0, front, &|scene| scene.materials[0] = samples::glass()), "glass");
        let with_holes = |scene: &mut Scene| {
            scene.materials.push(samples::masked());
            samples::add_textures(scene);
            scene.objects[0].material = 2;
        };
        assert!(!hides(0, front, &with_holes), "a mask");
    }

    #[test]
    fn meshes_that_meet_do_not_hide_across_the_gap_and_one_mesh_with_a_gap_does_not_either() {
        let quad = |mesh: &mut MeshBuilder, left: f64, right: f64| {
            let corners = [[left, -3.0], [right, -3.0], [right, 3.0], [left, 3.0]];
            mesh.quad(corners.map(|[x, y]| DVec3::new(x, y, 0.0)), shapes::WHOLE_IMAGE);
        };
        for gap in [1e-7, 1e-3, 0.0] {
            let mut both = MeshBuilder::new();
            quad(&mut both, -3.0, 0.0);
            quad(&mut both, gap, 3.0);
            let scene = scene(vec![(both, 0, at(0.0, 0.0, -6.0)), (shapes::sphere(0.2, 8), 0, at(0.0, 0.0, -9.0))]);
            let (world, picture) = picture(&scene, &camera());
            assert_eq!(picture.hides(&world.objects[1].bounds), gap == 0.0, "{gap} m");
        }
    }

    #[test]
    fn only_large_scenes_leave_out_what_is_hidden() {
        let many = |count: usize| {
            let wall = (shapes::cuboid([6.0, 6.0, 0.5]), 0, at(0.0, 0.0, -6.0));
            let small = (1..count).map(|_| (shapes::cuboid([0.2; 3]), 0, at(0.0, 0.0, -9.0)));
            scene(std::iter::once(wall).chain(small).collect())
        };
        let occluded = |scene: &Scene, keep: Keep| {
            let settings = Settings { size: SIZE, keep, ..Settings::default() };
            let plan = FramePlan::of(scene, &settings, &samples::software()).expect("a plan");
            let visible = Visible::of(&World::of(scene, &settings, &plan, 1.0), &camera(), &plan);
            assert_eq!(visible.draws.len() + visible.occluded, scene.objects.len());
            visible.occluded
        };
        assert_eq!(occluded(&many(MANY_OBJECTS), Keep::NONE), MANY_OBJECTS - 1);
        assert_eq!(occluded(&many(MANY_OBJECTS - 1), Keep::NONE), 0);
        assert_eq!(occluded(&many(MANY_OBJECTS), Keep::NONE.with(OptionalPart::OccludedObjects)), 0);
    }
}
