//! Ears off concave polygons, in nearly linear time: a grid says which corners are near an ear.

use std::collections::VecDeque;

use glam::DVec2;

use super::polygon::turn;

/// The most corners and cells that are looked at in one polygon, about half a second. Only outlines that cross themselves need more.
const MOST_STEPS: u64 = 1 << 27;

/// Cuts a polygon that is counter-clockwise into triangles. Returns false if a fan stands in for the corners that were left after the most steps.
pub(super) fn clip(points: &[DVec2], mut emit: impl FnMut([usize; 3])) -> bool {
    let mut outline = PolygonRing::of(points);
    let mut left = points.len();
    // Corners to look at, each with its shape's number. A corner whose neighbours have changed is queued again, and its old entry is passed over: that
    // spreads the triangles, instead of a fan of slivers from one corner.
    let mut queue: VecDeque<(usize, u32)> = (0..left).map(|corner| (corner, 0)).collect();
    let (mut first, mut is_stuck) = (0, false);
    while left > 3 {
        if outline.steps > MOST_STEPS {
            outline.fan(first, emit);
            return false;
        }
        let ear = match queue.pop_front() {
            Some((corner, shape)) if outline.shapes[corner] == shape && outline.is_ear(corner) => corner,
            Some(_) => {
                outline.steps += 1;
                continue;
            }
            // Without an ear, as in a polygon that crosses itself, any corner will do: the outline is not a shape anyway.
            None if is_stuck => first,
            None => {
                queue = outline.ring(first).map(|corner| (corner, outline.shapes[corner])).collect();
                outline.steps += left as u64;
                is_stuck = true;
                continue;
            }
        };
        let [before, _, after] = outline.corner(ear);
        emit([before, ear, after]);
        outline.remove(ear);
        queue.extend([before, after].map(|corner| (corner, outline.shapes[corner])));
        (left, first, is_stuck) = (left - 1, after, false);
    }
    emit(outline.corner(first));
    true
}

/// The corners that are left of a polygon, as a ring.
struct PolygonRing<'a> {
    points: &'a [DVec2],
    next: Vec<usize>,
    previous: Vec<usize>,
    /// By corner, how often it has got other neighbours; [`GONE`] once it is cut off.
    shapes: Vec<u32>,
    /// True for corners that turn inwards. They alone can lie in an ear, and they never become more.
    is_reflex: Vec<bool>,
    reflex: usize,
    grid: CornerGrid,
    steps: u64,
}

/// No number of a shape.
const GONE: u32 = u32::MAX;

impl<'a> PolygonRing<'a> {
    fn of(points: &'a [DVec2]) -> Self {
        let count = points.len();
        let mut outline = Self {
            points,
            next: (1..count).chain([0]).collect(),
            previous: std::iter::once(count - 1).chain(0..count - 1).collect(),
            shapes: vec![0; count],
            is_reflex: Vec::new(),
            reflex: 0,
            grid: CornerGrid::default(),
            steps: 0,
        };
        outline.is_reflex = (0..count).map(|corner| outline.turns(corner) < 0.0).collect();
        outline.reflex = outline.is_reflex.iter().filter(|&&is_reflex| is_reflex).count();
        outline.grid = CornerGrid::of(points, &outline.is_reflex, outline.reflex);
        outline
    }

    /// A corner between its neighbours.
    fn corner(&self, at: usize) -> [usize; 3] {
        [self.previous[at], at, self.next[at]]
    }

    fn turns(&self, at: usize) -> f64 {
        let [a, b, c] = self.corner(at).map(|corner| self.points[corner]);
        turn(a, b, c)
    }

    /// All corners that are left.
    fn ring(&self, first: usize) -> impl Iterator<Item = usize> {
        let on = move |&at: &usize| Some(self.next[at]).filter(|&next| next != first);
        std::iter::successors(Some(first), on)
    }

    /// Returns true if the corner sticks out and nothing else of the outline lies in it.
    fn is_ear(&mut self, at: usize) -> bool {
        let [a, b, c] = self.corner(at).map(|corner| self.points[corner]);
        if turn(a, b, c) <= 0.0 {
            return false;
        }
        let [from, to] = [a.min(b).min(c), a.max(b).max(c)].map(|place| self.grid.cell(place));
        for row in from[1]..=to[1] {
            let corners = self.grid.corners(row, from[0], to[0]);
            self.steps += (to[0] - from[0] + 1 + corners.len()) as u64;
            let mut others =
                corners.iter().filter(|&&corner| self.is_reflex[corner]).map(|&corner| self.points[corner]);
            // On the edge counts as inside: a triangle that touches another corner would leave a sliver behind.
            let is_inside = |p: DVec2| {
                p != a && p != b && p != c && turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0
            };
            if others.any(is_inside) {
                return false;
            }
        }
        true
    }

    /// Cuts off a corner.
    fn remove(&mut self, at: usize) {
        let [before, _, after] = self.corner(at);
        (self.next[before], self.previous[after], self.shapes[at]) = (after, before, GONE);
        self.shapes[before] += 1;
        self.shapes[after] += 1;
        for corner in [before, at, after] {
            let is_reflex = corner != at && self.turns(corner) < 0.0;
            if std::mem::replace(&mut self.is_reflex[corner], is_reflex) != is_reflex {
                self.reflex = if is_reflex { self.reflex + 1 } else { self.reflex - 1 };
            }
        }
        if self.reflex * 2 < self.grid.places.len() {
            self.grid = CornerGrid::of(self.points, &self.is_reflex, self.reflex);
        }
    }

    fn fan(&self, first: usize, mut emit: impl FnMut([usize; 3])) {
        let mut at = self.next[first];
        while self.next[at] != first {
            emit([first, at, self.next[at]]);
            at = self.next[at];
        }
    }
}

/// Reflex corners of a polygon by cells, about one in each.
#[derive(Default)]
struct CornerGrid {
    least: DVec2,
    /// Cells a unit.
    scale: DVec2,
    size: [usize; 2],
    /// By cell, row by row, where its corners begin in `places`; one more at the end.
    starts: Vec<usize>,
    places: Vec<usize>,
}

impl CornerGrid {
    fn of(points: &[DVec2], is_in: &[bool], count: usize) -> Self {
        let corners = || (0..points.len()).filter(|&corner| is_in[corner]);
        let least = corners().fold(DVec2::INFINITY, |least, corner| least.min(points[corner]));
        let most = corners().fold(DVec2::NEG_INFINITY, |most, corner| most.max(points[corner]));
        let extent = (most - least).max(DVec2::splat(f64::MIN_POSITIVE));
        let cells = count.max(1) as f64;
        let columns = (cells * (extent.x / extent.y)).sqrt().clamp(1.0, cells) as usize;
        let size = [columns, count.div_ceil(columns).max(1)];
        let scale = DVec2::new(size[0] as f64, size[1] as f64) / extent;
        let mut grid = Self { least, scale, size, starts: vec![0; size[0] * size[1] + 1], places: vec![0; count] };
        let index = |grid: &Self, corner: usize| {
            let [column, row] = grid.cell(points[corner]);
            row * size[0] + column
        };
        for corner in corners() {
            let cell = index(&grid, corner);
            grid.starts[cell] += 1;
        }
        let mut sum = 0;
        for start in &mut grid.starts {
            sum += *start;
            *start = sum;
        }
        // Fills each cell from its end, so that `starts` ends up at the cells' starts.
        for corner in corners() {
            let cell = index(&grid, corner);
            grid.starts[cell] -= 1;
            let at = grid.starts[cell];
            grid.places[at] = corner;
        }
        grid
    }

    /// Column and row of the cell that a place is in, or is nearest to.
    fn cell(&self, place: DVec2) -> [usize; 2] {
        let at = (place - self.least) * self.scale;
        [(at.x as usize).min(self.size[0] - 1), (at.y as usize).min(self.size[1] - 1)]
    }

    /// The corners in some columns of a row.
    fn corners(&self, row: usize, first: usize, last: usize) -> &[usize] {
        let row = row * self.size[0];
        &self.places[self.starts[row + first]..self.starts[row + last + 1]]
    }
}
