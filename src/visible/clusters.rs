//! Froxels: the view cut into tiles of pixels and slices of depth, with the list of lights that reach into each.
//!
//! (Olsson, Billeter, Assarsson 2012, "Clustered Deferred and Forward Shading".) A slice comes from the bits of the reversed depth, half an octave
//! each, so that the CPU and every shader agree on it exactly; where depth is linear, slices are equally thick. Lists are in the order of the lights,
//! so that sums round like a loop over all lights.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::DepthMapping;
use crate::plan::{Grid, Reach, SLICES, TILE};
use crate::scene::Camera;
use crate::shaders::shared::clusters::SLICE_SHIFT;

/// Pixels, and a share of the distance, that are added to a light's reach for the rounding of f32 and the jitter of samples.
const SLACK_PIXELS: f64 = 1.0;
const SLACK: f64 = 1e-5;

/// Maximum entries of all lists together: 64 MiB, half the size that every device allows a storage buffer.
const MOST_ENTRIES: usize = 16 << 20;

/// The lists of one frame.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Clusters {
    /// The first entry in `lights` and the number of entries of each cluster: columns first, then rows, then slices.
    pub heads: Vec<[u32; 2]>,
    /// Indices of lights, ascending within a cluster.
    pub lights: Vec<u32>,
}

impl DepthMapping {
    /// The slice of a reversed depth, as the shader computes it.
    pub fn slice_of(&self, depth: f32) -> u32 {
        let depth = depth.clamp(0.0, 1.0);
        let slice = match self {
            Self::Reciprocal { .. } => (1f32.to_bits() - depth.to_bits()) >> SLICE_SHIFT,
            Self::Linear { .. } => ((1.0 - depth) * SLICES as f32) as u32,
        };
        slice.min(SLICES - 1)
    }

    /// Distances along the view at which a slice begins and ends, with some slack.
    fn slice_bounds(&self, slice: u32) -> (f64, f64) {
        let is_last = slice + 1 == SLICES;
        match self {
            Self::Reciprocal { .. } => {
                let edge = |slice: u32| f64::from(f32::from_bits(1f32.to_bits() - (slice << SLICE_SHIFT)));
                let end = if is_last { f64::INFINITY } else { self.distance(edge(slice + 1)) };
                (self.distance(edge(slice)) * (1.0 - SLACK), end * (1.0 + SLACK))
            }
            Self::Linear { .. } => {
                let edge = |slice: u32| 1.0 - f64::from(slice) / f64::from(SLICES);
                let end = if is_last { f64::INFINITY } else { self.distance(edge(slice + 1) - SLACK) };
                (self.distance(edge(slice) + SLACK), end)
            }
        }
    }
}

/// Finds the lights that reach each cluster. `reaches` are spheres in the world; the result has the indices from `first` on.
///
/// If the lists would exceed `MOST_ENTRIES`, lists gain nothing, and all clusters share one list of all lights.
pub fn bin(reaches: &[Reach], first: u32, (camera, depth): (&Camera, &DepthMapping), size: [u32; 2]) -> Clusters {
    bin_within(reaches, first, (camera, depth), size, MOST_ENTRIES)
}

fn bin_within(
    reaches: &[Reach],
    first: u32,
    (camera, depth): (&Camera, &DepthMapping),
    size: [u32; 2],
    most: usize,
) -> Clusters {
    let view = ClusterView::of(camera, depth, size);
    let spheres: Vec<LightSphere> =
        (first..).zip(reaches).filter_map(|(light, reach)| LightSphere::seen(light, reach, camera, &view)).collect();
    let room = Room { entries: AtomicUsize::new(0), most };
    let slices: Vec<ClusterSlice> =
        (0..SLICES).into_par_iter().map(|slice| ClusterSlice::of(slice, &spheres, &view, &room)).collect();
    if room.is_full() {
        let all = reaches.len() as u32;
        return Clusters { heads: vec![[0, all]; view.grid.clusters()], lights: (first..first + all).collect() };
    }
    let mut clusters = Clusters { heads: Vec::with_capacity(view.grid.clusters()), lights: Vec::new() };
    for slice in slices {
        let before = clusters.lights.len() as u32;
        clusters.heads.extend(slice.heads.iter().map(|&[start, count]| [start + before, count]));
        clusters.lights.extend(slice.lights);
    }
    clusters
}

/// The number of entries so far, of all slices, and its limit.
struct Room {
    entries: AtomicUsize,
    most: usize,
}

impl Room {
    fn is_full(&self) -> bool {
        self.entries.load(Ordering::Relaxed) > self.most
    }
}

/// The picture's geometry, with y down as rows of pixels go.
struct ClusterView<'a> {
    grid: Grid,
    camera: &'a Camera,
    depth: &'a DepthMapping,
    axes: DMat3,
    /// Pixels a unit of x or y over w, and the pixel of the axis.
    scale: f64,
    center: [f64; 2],
}

impl<'a> ClusterView<'a> {
    fn of(camera: &'a Camera, depth: &'a DepthMapping, size: [u32; 2]) -> Self {
        let scale = f64::from(size[1]) * 0.5 / camera.half_height();
        Self {
            grid: Grid::of(size),
            camera,
            depth,
            axes: DMat3::from_cols(camera.right(), -camera.up(), camera.forward()).transpose(),
            scale,
            center: axis_pixel(camera, size, scale),
        }
    }

    /// Tiles that an interval of x or y touches between two distances, if any.
    fn tiles(&self, axis: usize, (low, high): (f64, f64), (near, far): (f64, f64), count: u32) -> Option<(u32, u32)> {
        let ends = (self.camera.w(near), self.camera.w(far));
        let (low, high) = screen_span((low, high), ends, self.scale, self.center[axis]);
        let (from, to) = ((low / f64::from(TILE)).floor(), (high / f64::from(TILE)).floor());
        if to < 0.0 || from >= f64::from(count) {
            return None;
        }
        // Clamped: no cast overflows, also from infinity.
        Some((from.max(0.0) as u32, to.min(f64::from(count - 1)) as u32))
    }
}

/// The pixel of a camera's axis, to the right and down, in a picture with `scale` pixels a unit of x over w.
pub(super) fn axis_pixel(camera: &Camera, size: [u32; 2], scale: f64) -> [f64; 2] {
    let [width, height] = size.map(f64::from);
    [width * 0.5 - camera.shift.x * scale, height * 0.5 + camera.shift.y * scale]
}

/// The pixels that an interval of x or y covers anywhere between two distances, whose w is given, with a pixel of slack. `scale` is in pixels a
/// unit of x over w, `center` the pixel of the axis.
pub(super) fn screen_span((low, high): (f64, f64), (near, far): (f64, f64), scale: f64, center: f64) -> (f64, f64) {
    // x / w is least where x is negative and near, or positive and far.
    let low = low / if low < 0.0 { near } else { far };
    let high = high / if high > 0.0 { near } else { far };
    (low * scale + center - SLACK_PIXELS, high * scale + center + SLACK_PIXELS)
}

/// A light's sphere relative to the camera: x to the right, y down, z along the view.
struct LightSphere {
    light: u32,
    center: DVec3,
    radius: f64,
}

impl LightSphere {
    fn seen(light: u32, reach: &Reach, camera: &Camera, view: &ClusterView) -> Option<Self> {
        let center = view.axes * (reach.center - camera.position);
        let radius = reach.radius + SLACK * (reach.radius + center.length());
        (center.z + radius > view.camera.near).then_some(Self { light, center, radius })
    }
}

/// The lists of the clusters of one slice.
struct ClusterSlice {
    heads: Vec<[u32; 2]>,
    lights: Vec<u32>,
}

impl ClusterSlice {
    fn of(slice: u32, spheres: &[LightSphere], view: &ClusterView, room: &Room) -> Self {
        let (begin, end) = view.depth.slice_bounds(slice);
        let mut entries: Vec<(u32, u32)> = Vec::new();
        for sphere in spheres {
            let before = entries.len();
            sphere.touch(begin, end, view, |cluster| entries.push((cluster, sphere.light)));
            room.entries.fetch_add(entries.len() - before, Ordering::Relaxed);
            if room.is_full() {
                break;
            }
        }
        // ANCHOR: stable-lists
        // A counting sort is stable: lights stay in order within their cluster.
        let clusters = (view.grid.columns * view.grid.rows) as usize;
        let mut heads = vec![[0u32; 2]; clusters];
        entries.iter().for_each(|&(cluster, _)| heads[cluster as usize][1] += 1);
        let mut start = 0;
        for head in &mut heads {
            head[0] = start;
            start += head[1];
        }
        let mut next: Vec<u32> = heads.iter().map(|head| head[0]).collect();
        let mut lights = vec![0; entries.len()];
        for (cluster, light) in entries {
            let place = &mut next[cluster as usize];
            lights[*place as usize] = light;
            *place += 1;
        }
        Self { heads, lights }
        // ANCHOR_END: stable-lists
    }
}

impl LightSphere {
    /// Calls `add` for each cluster of a slice that the sphere may reach into.
    fn touch(&self, begin: f64, end: f64, view: &ClusterView, mut add: impl FnMut(u32)) {
        let (near, far) = (begin.max(self.center.z - self.radius), end.min(self.center.z + self.radius));
        if near > far {
            return;
        }
        let near = near.max(view.camera.near * (1.0 - SLACK));
        // The sphere's largest cross-section within the slice.
        let off = self.center.z - self.center.z.clamp(begin, end);
        let squared = self.radius * self.radius - off * off;
        if !squared.is_finite() {
            (0..view.grid.columns * view.grid.rows).for_each(add);
            return;
        }
        let radius = squared.max(0.0).sqrt();
        let span = |center: f64, radius: f64| (center - radius, center + radius);
        let Some((top, bottom)) = view.tiles(1, span(self.center.y, radius), (near, far), view.grid.rows) else {
            return;
        };
        for row in top..=bottom {
            // The part of the sphere between the planes above and below this row of tiles.
            let away = self.distance_to_row(row, view);
            let left = (self.radius * self.radius - away * away).min(squared);
            if left < 0.0 {
                continue;
            }
            let across = span(self.center.x, left.sqrt());
            let Some((from, to)) = view.tiles(0, across, (near, far), view.grid.columns) else { continue };
            (from..=to).for_each(|column| add(row * view.grid.columns + column));
        }
    }

    /// Returns the distance of the centre, in metres, from the wedge of a row of tiles (from the slab, if orthographic); 0 inside.
    fn distance_to_row(&self, row: u32, view: &ClusterView) -> f64 {
        let edge = |pixel: f64| (pixel - view.center[1]) / view.scale;
        let top = edge(f64::from(row * TILE) - SLACK_PIXELS);
        let bottom = edge(f64::from((row + 1) * TILE) + SLACK_PIXELS);
        let (w, slope) = (view.camera.w(self.center.z), view.camera.w(1.0) - view.camera.w(0.0));
        let above = (top * w - self.center.y) / (top * slope).hypot(1.0);
        let below = (self.center.y - bottom * w) / (bottom * slope).hypot(1.0);
        above.max(below).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::plan::samples::vector;
    use crate::scene::Projection;

    #[test]
    fn slices_cover_every_depth_and_end_where_the_next_begins() {
        for depth in [DepthMapping::Reciprocal { near: 0.25 }, DepthMapping::Linear { begin: 0.25, end: 60.0 }] {
            for slice in 0..SLICES {
                let (begin, end) = depth.slice_bounds(slice);
                let inside = |distance: f64| depth.slice_of(depth.of_distance(distance) as f32);
                // Within the slack of both ends.
                let slack = 4e-5 * end.clamp(60.0, 1e9);
                assert_eq!((inside(begin + slack), inside((end - slack).min(1e30))), (slice, slice), "{depth:?}");
                let next = depth.slice_bounds((slice + 1).min(SLICES - 1)).0;
                assert!(slice + 1 == SLICES || (next <= end && end - next < slack), "{depth:?} {next} {end}");
            }
            assert_eq!((depth.slice_of(1.0), depth.slice_of(0.0), depth.slice_of(2.0)), (0, SLICES - 1, 0));
        }
    }

    proptest! {
        /// A point in a light's sphere that the camera sees finds the light in its cluster's list.
        #[test]
        fn no_light_is_missing_where_it_reaches(
            position in vector(20.0), target in vector(5.0), fov in 10.0..140.0f64, parallel in any::<bool>(), width in 1..700u32,
            height in 1..500u32, lights in proptest::collection::vec((vector(15.0), 0.01..8.0f64), 1..24),
            pixels in proptest::collection::vec((0.0..1.0f64, 0.0..1.0f64, -1.0..9.0f64), 64), far in 0..2i32,
        ) {
            let shift = DVec3::splat(1e6 * f64::from(far));
            prop_assume!(position.distance(target) > 0.01);
            let projection = if parallel { Projection::orthographic(fov * 0.1) } else { Projection::perspective(fov) };
            let camera = Camera { projection, near: 0.05, ..Camera::looking_at(position + shift, target + shift, DVec3::Y) };
            let depths = match parallel {
                true => DepthMapping::Linear { begin: 0.05, end: 30.0 },
                false => DepthMapping::Reciprocal { near: 0.05 },
            };
            let reaches: Vec<Reach> =
                lights.iter().map(|&(center, radius)| Reach { center: center + shift, radius }).collect();
            let clusters = bin(&reaches, 7, (&camera, &depths), [width, height]);
            let grid = Grid::of([width, height]);
            prop_assert_eq!(clusters.heads.len(), grid.clusters());
            for (x, y, log) in pixels {
                let (x, y) = (x * f64::from(width), y * f64::from(height));
                let distance = camera.near * log.exp2().max(1.0);
                let half = camera.half_height() * camera.w(distance);
                let across = (x * 2.0 / f64::from(width) - 1.0) * half * f64::from(width) / f64::from(height);
                let down = (y * 2.0 / f64::from(height) - 1.0) * half;
                let point = camera.position + camera.forward() * distance + camera.right() * across - camera.up() * down;
                let slice = depths.slice_of(depths.of_distance(distance) as f32);
                let cluster = (slice * grid.rows + y as u32 / TILE) * grid.columns + x as u32 / TILE;
                let [first, count] = clusters.heads[cluster as usize];
                let list = &clusters.lights[first as usize..(first + count) as usize];
                prop_assert!(list.windows(2).all(|pair| pair[0] < pair[1]), "{list:?}");
                for (light, reach) in (7..).zip(&reaches) {
                    let inside = point.distance(reach.center) < reach.radius;
                    prop_assert!(!inside || list.contains(&light), "{point} {reach:?} {list:?}");
                }
            }
        }
    }

    #[test]
    fn too_many_entries_become_one_list_of_all() {
        let camera = Camera { position: DVec3::ZERO, near: 0.1, ..Camera::default() };
        let reaches: Vec<Reach> = (0..9).map(|i| Reach { center: DVec3::X * f64::from(i), radius: 1e3 }).collect();
        let depth = DepthMapping::Reciprocal { near: 0.1 };
        let all = bin_within(&reaches, 4, (&camera, &depth), [640, 360], 1000);
        assert_eq!(all.lights, (4..13).collect::<Vec<_>>());
        assert_eq!(all.heads, vec![[0, 9]; Grid::of([640, 360]).clusters()]);
        let apart = bin_within(&reaches, 4, (&camera, &depth), [640, 360], usize::MAX);
        assert!(apart.lights.len() > 1000);
    }

    #[test]
    fn a_small_light_is_in_few_lists_and_one_behind_the_camera_in_none() {
        let camera = Camera { position: DVec3::ZERO, near: 0.1, ..Camera::default() };
        let lamp = |z: f64, radius| Reach { center: DVec3::new(0.0, 0.0, z), radius };
        let entries =
            |reach| bin(&[reach], 0, (&camera, &DepthMapping::Reciprocal { near: 0.1 }), [1280, 720]).lights.len();
        let few = entries(lamp(-10.0, 0.1));
        assert!((1..=16).contains(&few), "{few}");
        assert_eq!(entries(lamp(10.0, 5.0)), 0);
        assert_eq!(entries(lamp(0.0, f64::INFINITY)), Grid::of([1280, 720]).clusters());
    }
}
