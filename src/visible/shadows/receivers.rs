//! The casters that a map needs in a frame, because their shadows fall on something visible.
//!
//! Visible receivers of shadows are boxes; large boxes are cut into pieces, and pieces out of view are dropped. Each map has a coarse grid over its
//! texels, which stores for each cell the farthest depth at which a visible receiver may sample it. A caster is needed if its box covers a cell with
//! a receiver behind the box's nearest depth.

use glam::DVec2;

use super::views::{Caster, ShadowView};
use crate::plan::ShadowPlan;
use crate::plan::box_tree::BoxTree;
use crate::scene::{Aabb, Camera, Projection, ShadowFilter, ShadowSettings};
use crate::visible::World;
use crate::visible::active_lights::Misplacement;
use crate::visible::frustum::Frustum;

/// Cells of a map's grid along an axis.
const CELLS: usize = 64;
/// Boxes are cut, `MOST_CUTS` times at most, until their pieces are no longer than this share of their distance from the camera, or of the height
/// of an orthographic view.
const PIECE: f64 = 0.15;
const MOST_CUTS: u32 = 9;
/// Pieces of all boxes together; once they are reached, the remaining boxes stay whole.
const MOST_PIECES: usize = 2048;
/// The slack of depths for the rounding of f32: absolute for linear depths, otherwise a share.
const DEPTH_SLACK: f64 = 1e-5;

/// The visible receivers of shadows.
#[derive(Debug, Clone)]
pub struct Receivers {
    pieces: Vec<Piece>,
    tree: BoxTree,
    filter: FilterReach,
}

#[derive(Debug, Clone)]
struct Piece {
    bounds: Aabb,
    /// The begin and the end along the view.
    along: (f64, f64),
}

/// The distance from a point at which the shadow map is sampled for it.
#[derive(Debug, Clone, Copy)]
struct FilterReach {
    /// The offset along the normal, in texels.
    offset: f64,
    /// True if a texel may be compared with a depth far from the point's own, because the filter follows the point's plane, which may be edge-on.
    is_slanting: bool,
}

impl FilterReach {
    fn of(plan: &ShadowPlan, settings: &ShadowSettings) -> Self {
        let is_slanting = match plan.filter {
            ShadowFilter::None | ShadowFilter::Box2 | ShadowFilter::Box3 | ShadowFilter::Box5 => false,
            ShadowFilter::Poisson | ShadowFilter::Pcss => true,
        };
        Self { offset: plan.normal_offset(settings), is_slanting }
    }
}

impl Receivers {
    /// Cuts the boxes that the camera sees, the nearest first.
    pub(in crate::visible) fn of(
        boxes: impl Iterator<Item = Aabb>,
        (camera, frustum): (&Camera, &Frustum),
        beside: &Misplacement,
        plan: &ShadowPlan,
        settings: &ShadowSettings,
    ) -> Self {
        let mut whole = Vec::new();
        for bounds in boxes {
            cut(bounds, MOST_CUTS, (camera, frustum), &mut whole);
        }
        let forward = camera.forward();
        let piece = |bounds: Aabb| {
            let by = beside.at(bounds.center().distance(camera.position) + bounds.radius());
            let bounds = Aabb { min: bounds.min - by, max: bounds.max + by };
            let (at, half) = ((bounds.center() - camera.position).dot(forward), forward.abs().dot(bounds.size() * 0.5));
            Piece { bounds, along: (at - half, at + half) }
        };
        let pieces: Vec<Piece> = whole.into_iter().map(piece).collect();
        let tree = BoxTree::of(pieces.iter().map(|piece| piece.bounds));
        Self { pieces, tree, filter: FilterReach::of(plan, settings) }
    }

    /// The pieces that sample a map.
    fn in_map<'a>(&'a self, view: &'a ShadowView) -> impl Iterator<Item = &'a Piece> {
        // The offset moves a point sideways, and along a slanting ray by as much again.
        let texels = 2.0 * self.filter.offset + 1.0;
        let own = self.tree.each(move |bounds| view.may_hold(bounds, texels)).map(|index| &self.pieces[index]);
        own.filter(|piece| piece.along.1 >= view.begin && piece.along.0 <= view.end)
    }

    /// Returns true if any receiver samples a map.
    pub(in crate::visible) fn look_into(&self, view: &ShadowView) -> bool {
        self.in_map(view).next().is_some()
    }

    /// The map's casters that shadow something visible.
    pub(in crate::visible) fn needed(&self, world: &World, plan: &ShadowPlan, view: &ShadowView) -> Vec<Caster> {
        let margin = 2.0 * plan.margin(view.tile.edge, &world.shadows) + 2.0;
        let mut grid = ReceiverGrid::new(view);
        for piece in self.in_map(view) {
            grid.add(&Footprint::of(view, &piece.bounds), margin, &self.filter);
        }
        let is_needed =
            |caster: &&Caster| grid.looks_behind(&Footprint::of(view, &world.objects[caster.object].bounds));
        view.casters.iter().filter(is_needed).copied().collect()
    }
}

/// Halves a box until its pieces are small in the view, and drops pieces out of view.
fn cut(bounds: Aabb, cuts: u32, (camera, frustum): (&Camera, &Frustum), pieces: &mut Vec<Aabb>) {
    if !frustum.may_see(&bounds) {
        return;
    }
    let size = bounds.size();
    let (axis, edge) = (size.max_position(), size.max_element());
    let usual = match camera.projection {
        Projection::Perspective { .. } => camera.position.clamp(bounds.min, bounds.max).distance(camera.position),
        Projection::Orthographic { height } => height,
    };
    if cuts == 0 || edge <= PIECE * usual || pieces.len() >= MOST_PIECES {
        pieces.push(bounds);
        return;
    }
    let middle = bounds.center()[axis];
    let (mut first, mut second) = (bounds, bounds);
    (first.max[axis], second.min[axis]) = (middle, middle);
    cut(first, cuts - 1, (camera, frustum), pieces);
    cut(second, cuts - 1, (camera, frustum), pieces);
}

/// The part of a map that a box covers.
struct Footprint {
    /// In texels of the layer; infinite where the box comes beside or behind the light.
    low: DVec2,
    high: DVec2,
    /// Reversed depths: of the box's nearest and farthest corner.
    nearest: f64,
    farthest: f64,
}

impl Footprint {
    fn of(view: &ShadowView, bounds: &Aabb) -> Self {
        let mut own = Self {
            low: DVec2::INFINITY,
            high: DVec2::NEG_INFINITY,
            nearest: f64::NEG_INFINITY,
            farthest: f64::INFINITY,
        };
        for corner in bounds.corners() {
            let [u, v, depth, w] = view.rows.map(|row| row.truncate().dot(corner) + row.w);
            if w <= 0.0 {
                // Depth falls as 1 / w, and wraps around at w = 0.
                (own.low, own.high, own.nearest) = (DVec2::NEG_INFINITY, DVec2::INFINITY, f64::INFINITY);
                continue;
            }
            let at = DVec2::new(u, v) / w;
            (own.low, own.high) = (own.low.min(at), own.high.max(at));
            (own.nearest, own.farthest) = (own.nearest.max(depth / w), own.farthest.min(depth / w));
        }
        own
    }
}

/// The farthest depth, reversed, with which a visible receiver compares in each cell of a map.
struct ReceiverGrid<'a> {
    view: &'a ShadowView,
    /// Texels of a cell.
    cell: f64,
    farthest: Vec<f64>,
}

impl<'a> ReceiverGrid<'a> {
    fn new(view: &'a ShadowView) -> Self {
        Self { view, cell: f64::from(view.tile.edge) / CELLS as f64, farthest: vec![f64::INFINITY; CELLS * CELLS] }
    }

    /// The cells that a footprint touches, with `margin` texels around it.
    fn cells(&self, footprint: &Footprint, margin: f64) -> impl Iterator<Item = usize> + use<> {
        let tile = self.view.tile;
        let cell = |texel: f64, first: u32| (texel - f64::from(first)) / self.cell;
        let range = |low: f64, high: f64, first: u32| {
            let (low, high) = (cell(low - margin, first).floor(), cell(high + margin, first).floor());
            // Clamped: no cast overflows, also from infinity. A footprint beside the map touches no cell.
            (low.clamp(0.0, CELLS as f64) as usize)..((high + 1.0).clamp(0.0, CELLS as f64) as usize)
        };
        let columns = range(footprint.low.x, footprint.high.x, tile.x);
        let rows = range(footprint.low.y, footprint.high.y, tile.y);
        rows.flat_map(move |row| columns.clone().map(move |column| row * CELLS + column))
    }

    /// Adds a visible receiver.
    fn add(&mut self, footprint: &Footprint, margin: f64, filter: &FilterReach) {
        let view = self.view;
        let farthest = if filter.is_slanting {
            f64::NEG_INFINITY
        } else if view.is_perspective() {
            footprint.farthest * (1.0 - 2.0 * filter.offset * view.texel - DEPTH_SLACK).max(0.0)
        } else {
            // The depth of a step of one texel.
            footprint.farthest - filter.offset * view.texel * view.rows[2].truncate().length() - DEPTH_SLACK
        };
        for cell in self.cells(footprint, margin) {
            self.farthest[cell] = self.farthest[cell].min(farthest);
        }
    }

    /// Returns true if a visible receiver may lie in the shadow of a box, by the grid's resolution.
    fn looks_behind(&self, caster: &Footprint) -> bool {
        // A texel around it, for the rounding of its triangles.
        self.cells(caster, 1.0).any(|cell| self.farthest[cell] <= caster.nearest)
    }
}
