//! Projection into the coarse picture that a camera has of a scene.

use glam::{DMat3, DVec2, DVec3};

use crate::scene::{Aabb, Camera};
use crate::visible::DepthMapping;
use crate::visible::clusters::axis_pixel;

/// Maximum cells across the picture (twice as many take twice the time and find 1% more), and minimum pixels across a cell.
const COLUMNS: u32 = 128;
const LEAST_CELL: u32 = 4;
/// Pixels around an outline or a box in which nothing is certain: vertices are rounded to fractions of a pixel, and samples lie beside pixel centres.
const SLACK_PIXELS: f64 = 2.0;

/// The mapping from the world to cells, x to the right and y down.
pub(super) struct OcclusionView {
    axes: DMat3,
    pub(super) camera: Camera,
    pub(super) depth: DepthMapping,
    /// Cells per unit of x or y over w.
    scale: f64,
    center: DVec2,
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// The most cells by which a place may be off.
    pub(super) slack: f64,
}

/// A rectangle of cells, both ends included.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cells {
    pub(super) columns: (usize, usize),
    pub(super) rows: (usize, usize),
}

impl Cells {
    pub(super) fn width(&self) -> usize {
        self.columns.1 - self.columns.0 + 1
    }

    pub(super) fn count(&self) -> usize {
        self.width() * (self.rows.1 - self.rows.0 + 1)
    }
}

impl OcclusionView {
    pub(super) fn of(camera: &Camera, depth: &DepthMapping, size: [u32; 2]) -> Self {
        let columns = (size[0] / LEAST_CELL).clamp(1, COLUMNS);
        let [width, height] = size.map(f64::from);
        let pixels = width / f64::from(columns);
        let scale = height * 0.5 / camera.half_height();
        Self {
            axes: DMat3::from_cols(camera.right(), -camera.up(), camera.forward()).transpose(),
            camera: *camera,
            depth: *depth,
            scale: scale / pixels,
            center: DVec2::from(axis_pixel(camera, size, scale)) / pixels,
            columns: columns as usize,
            rows: (height / pixels).ceil() as usize,
            slack: SLACK_PIXELS / pixels,
        }
    }

    /// A point in view space, in metres, z along the view.
    pub(super) fn place(&self, point: DVec3) -> DVec3 {
        self.axes * (point - self.camera.position)
    }

    /// A measure that is linear over a triangle's image, and larger for nearer places.
    pub(super) fn nearness(&self, place: DVec3) -> f64 {
        if self.camera.is_orthographic() { -place.z } else { place.z.recip() }
    }

    /// The distance along the view with this nearness.
    pub(super) fn distance(&self, nearness: f64) -> f64 {
        if self.camera.is_orthographic() { -nearness } else { nearness.recip() }
    }

    /// A place in cells; valid only beyond the near plane.
    pub(super) fn cell(&self, place: DVec3) -> DVec2 {
        place.truncate() * (self.scale / self.camera.w(place.z)) + self.center
    }

    /// The cells from one place to another with slack around them, if any are in the picture.
    pub(super) fn range(&self, low: DVec2, high: DVec2) -> Option<Cells> {
        let axis = |low: f64, high: f64, count: usize| {
            let (low, high) = ((low - self.slack).floor(), (high + self.slack).floor());
            let is_inside = high >= 0.0 && low < count as f64;
            is_inside.then(|| (low.max(0.0) as usize, high.min((count - 1) as f64) as usize))
        };
        Some(Cells { columns: axis(low.x, high.x, self.columns)?, rows: axis(low.y, high.y, self.rows)? })
    }

    /// Returns true if a box may come near at least `least` cells. It tests the sphere around the box, which is faster than its corners.
    pub(super) fn may_cover(&self, bounds: &Aabb, least: f64) -> bool {
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

    /// The size in cells of the square around a sphere of this radius, at the nearest distance of a box, in the middle of the picture.
    pub(super) fn size(&self, bounds: &Aabb, radius: f64) -> f64 {
        let half = self.camera.forward().abs().dot(bounds.size() * 0.5);
        let nearest = self.place(bounds.center()).z - half;
        let diameter = 2.0 * radius * self.scale / self.camera.w(nearest.max(self.camera.near));
        diameter * diameter
    }

    /// The cells that a box comes near, and the distance of its nearest point; `None` if it is not wholly beyond the near plane.
    pub(super) fn footprint(&self, bounds: &Aabb) -> Option<(Option<Cells>, f64)> {
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
