//! Ear clipping of outlines with many corners, whose corners lie in a grid: a corner near an ear is found without looking at all others.

use glam::DVec2;

use super::polygon::turn;

/// An outline, counter-clockwise, that loses its ears.
struct Outline<'a> {
    points: &'a [DVec2],
    /// The corners before and behind each that is left.
    before: Vec<usize>,
    behind: Vec<usize>,
    left: usize,
    is_left: Vec<bool>,
    grid: Grid,
}

/// Reflex and straight corners by cell. A convex corner lies in an ear only together with one of these.
struct Grid {
    low: DVec2,
    cell: DVec2,
    edge: usize,
    corners: Vec<Vec<usize>>,
}

impl Grid {
    fn new(points: &[DVec2], is_blunt: impl Fn(usize) -> bool) -> Self {
        let (low, high) = points
            .iter()
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), &point| (low.min(point), high.max(point)));
        // About a corner a cell.
        let edge = points.len().isqrt().max(1);
        let cell = ((high - low) / edge as f64).max(DVec2::splat(f64::MIN_POSITIVE));
        let mut grid = Self { low, cell, edge, corners: vec![Vec::new(); edge * edge] };
        for (corner, &point) in points.iter().enumerate().filter(|(corner, _)| is_blunt(*corner)) {
            let [x, y] = grid.cell_of(point);
            grid.corners[y * edge + x].push(corner);
        }
        grid
    }

    fn cell_of(&self, point: DVec2) -> [usize; 2] {
        let at = (point - self.low) / self.cell;
        [at.x, at.y].map(|at| (at as usize).min(self.edge - 1))
    }
}

impl Outline<'_> {
    fn is_ear(&self, corner: usize) -> bool {
        let ear = [self.before[corner], corner, self.behind[corner]].map(|corner| self.points[corner]);
        let [a, b, c] = ear;
        if turn(a, b, c) <= 0.0 {
            return false;
        }
        let is_outside = |&other: &usize| {
            let p = self.points[other];
            // On the edge counts as inside: a triangle that touches another corner would leave a sliver behind.
            !self.is_left[other]
                || ear.contains(&p)
                || turn(a, b, p) < 0.0
                || turn(b, c, p) < 0.0
                || turn(c, a, p) < 0.0
        };
        let [first, last] = [self.grid.cell_of(a.min(b).min(c)), self.grid.cell_of(a.max(b).max(c))];
        if (last[0] - first[0] + 1) * (last[1] - first[1] + 1) > self.left {
            let mut others = std::iter::successors(Some(self.behind[corner]), |&other| Some(self.behind[other]));
            return others.by_ref().take(self.left - 1).all(|other| is_outside(&other));
        }
        (first[1]..=last[1]).all(|row| {
            let cells = &self.grid.corners[row * self.grid.edge..][first[0]..=last[0]];
            cells.iter().flatten().all(is_outside)
        })
    }

    /// Removes a corner and returns its triangle.
    fn cut(&mut self, corner: usize) -> [usize; 3] {
        let (before, behind) = (self.before[corner], self.behind[corner]);
        (self.behind[before], self.before[behind]) = (behind, before);
        self.is_left[corner] = false;
        self.left -= 1;
        [before, corner, behind]
    }
}

/// Cuts an outline into triangles, always corners - 2 of them.
pub(super) fn clip_many_ears(points: &[DVec2], mut emit: impl FnMut([usize; 3])) {
    let count = points.len();
    let beside = |corner: usize| [points[(corner + count - 1) % count], points[corner], points[(corner + 1) % count]];
    let is_blunt = |corner: usize| {
        let [a, b, c] = beside(corner);
        turn(a, b, c) <= 0.0
    };
    let mut outline = Outline {
        points,
        before: (0..count).map(|corner| (corner + count - 1) % count).collect(),
        behind: (0..count).map(|corner| (corner + 1) % count).collect(),
        left: count,
        is_left: vec![true; count],
        grid: Grid::new(points, is_blunt),
    };
    let (mut corner, mut tries) = (0, 0);
    while outline.left > 3 {
        // Without an ear, as in a polygon that crosses itself, any corner will do: the outline is not a shape anyway.
        if tries < outline.left && !outline.is_ear(corner) {
            (corner, tries) = (outline.behind[corner], tries + 1);
            continue;
        }
        let triangle = outline.cut(corner);
        emit(triangle);
        // Going on behind the ear spreads the triangles, instead of a fan of slivers from one corner.
        (corner, tries) = (outline.behind[triangle[2]], 0);
    }
    emit([outline.before[corner], corner, outline.behind[corner]]);
}
