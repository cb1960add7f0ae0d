//! Ambient occlusion in screen space: a depth buffer that is marched in f64. A pass converges to it with its number of samples.
//!
//! The hemisphere is cut into slices, planes through the line of sight. Each slice is a line of the picture, and each of its pixels is a place that
//! hides the angles from its front to its back, which is taken to lie [`THICKNESS`] radii further along the line of sight. (O. Therrien, Y. Levesque
//! and G. Gilet, "Screen Space Indirect Lighting with Visibility Bitmask", 2023, have that in bits.) The first place to hide an angle, from the
//! middle outwards, is taken to be the nearest in it, and hides as much as [`hidden`] gives for its distance. Angles are weighted by the cosine to
//! the normal and by the density of slices (J. Jimenez et al., "Practical Real-Time Strategies for Accurate Indirect Occlusion", 2016).

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec2, DVec3};

use super::CameraView;
use super::occlusion::hidden;
use super::rays::CameraRays;

/// The assumed thickness of visible surfaces, in radii: the one with the least error on the pictures of docs/AO.md.
pub const THICKNESS: f64 = 0.5;

/// The least cosine between a normal and the line of sight.
const LEAST_FACING: f64 = 0.01;

/// A picture of distances.
#[derive(Debug, Clone, Copy)]
pub struct DepthBuffer<'a> {
    /// The camera, and the size of the picture.
    pub view: CameraView,
    /// Distances along the view in metres, rows from the top; infinite where nothing is seen.
    pub distances: &'a [f64],
}

/// The radius and the fineness of the march.
#[derive(Debug, Clone, Copy)]
pub struct March {
    /// Metres.
    pub radius: f64,
    /// Thickness of surfaces, in radii.
    pub thickness: f64,
    /// Slices of half a turn.
    pub slices: u32,
}

impl March {
    /// As fine as a truth is: 64 slices, whose angles a hemisphere of twice 64 sectors has.
    pub fn fine(radius: f64) -> Self {
        Self { radius, thickness: THICKNESS, slices: 64 }
    }
}

/// A half-plane's share of the hemisphere, by the angle from the line of sight: a plane through `view`, which leads to the eye, and `across`.
struct Slice {
    view: DVec3,
    across: DVec3,
    beside: DVec3,
    /// Of the normal in the plane, and how long that is there and beside it.
    gamma: f64,
    weight: f64,
    lean: f64,
}

impl DepthBuffer<'_> {
    /// Share of the light from everywhere that arrives at the surface of a pixel, which has this unit normal; 1 where nothing is seen.
    pub fn visibility(&self, pixel: [u32; 2], normal: DVec3, march: &March) -> f64 {
        let lens = CameraRays::of(&self.view);
        let middle = DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])) + 0.5;
        let Some(place) = self.place(&lens, middle) else { return 1.0 };
        let to_eye = lens.eye_from(place);
        // A normal that a normal map turns away from the eye is bent until its surface is seen edge-on.
        let normal = (normal + to_eye * (LEAST_FACING - normal.dot(to_eye)).max(0.0)).normalize();
        let (x, y) = to_eye.any_orthonormal_pair();
        let (mut open, mut whole) = (0.0, 0.0);
        for index in 0..march.slices {
            let across = DVec2::from_angle(PI * (f64::from(index) + 0.5) / f64::from(march.slices));
            let slice = Slice::of(to_eye, x * across.x + y * across.y, normal);
            // A step of one pixel along the line that the plane is seen as.
            let nudge = march.radius.min(lens.distance(place)) * 1e-3;
            let step = (lens.seen_at(place + slice.across * nudge) - lens.seen_at(place)).normalize_or_zero();
            let reach = |from: DVec3| (lens.seen_at(from) - middle).length();
            let most = reach(place + slice.across * march.radius).max(reach(place - slice.across * march.radius));
            let mut left = vec![[0.0, slice.whole()]];
            let mut hides = 0.0;
            for side in [1.0, -1.0] {
                for count in 1..=(most.ceil() as u64).min(1 << 14) {
                    let at = middle + step * (side * count as f64);
                    let Some(other) = self.place(&lens, at.floor() + 0.5) else { continue };
                    let front = other - place;
                    let share = hidden(front.length(), march.radius);
                    if share > 0.0 {
                        let back = front - to_eye * (march.thickness * march.radius);
                        hides += share * cut(&mut left, slice.interval(front, back));
                    }
                }
            }
            open += slice.weight * (slice.whole() - hides);
            whole += slice.weight * slice.whole();
        }
        if whole > 0.0 { (open / whole).clamp(0.0, 1.0) } else { 1.0 }
    }

    /// Returns the visible point at a place of the picture, relative to the camera.
    fn place(&self, lens: &CameraRays, at: DVec2) -> Option<DVec3> {
        let [width, height] = self.view.size;
        let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < f64::from(width) && at.y < f64::from(height);
        let distance = *self.distances.get(at.y as usize * width as usize + at.x as usize).filter(|_| inside)?;
        distance.is_finite().then(|| lens.place(at, distance))
    }
}

impl Slice {
    fn of(view: DVec3, across: DVec3, normal: DVec3) -> Self {
        let (along, aside) = (normal.dot(view), normal.dot(across));
        let beside = across.cross(view);
        let (gamma, weight) = (aside.atan2(along), along.hypot(aside).max(1e-12));
        Self { view, across, beside, gamma, weight, lean: normal.dot(beside) }
    }

    /// The integral of cos(t - gamma) |sin t| from 0 to an angle.
    fn integral(&self, angle: f64) -> f64 {
        let from_zero = (self.gamma.cos() - (2.0 * angle - self.gamma).cos()) / 4.0 + angle * self.gamma.sin() / 2.0;
        from_zero * angle.signum()
    }

    /// Returns the part of the slice's hemisphere before a direction of the plane; the hemisphere's angles are from gamma - 90 to gamma + 90 degrees.
    fn before(&self, direction: DVec3) -> f64 {
        // The middle of a pixel lies beside the line: it is moved into the plane along the surface, on which a step of 1 beside it rises by this.
        let rise = direction.dot(self.beside) * self.lean / self.weight;
        let (sin, cos) = self.gamma.sin_cos();
        let angle = (direction.dot(self.across) + rise * sin).atan2(direction.dot(self.view) + rise * cos);
        let low = self.gamma - FRAC_PI_2;
        self.integral(angle.clamp(low, self.gamma + FRAC_PI_2)) - self.integral(low)
    }

    fn whole(&self) -> f64 {
        self.gamma.cos() + self.gamma * self.gamma.sin()
    }

    fn interval(&self, front: DVec3, back: DVec3) -> [f64; 2] {
        let (front, back) = (self.before(front), self.before(back));
        [front.min(back), front.max(back)]
    }
}

/// Removes an interval from the remaining ones. Returns the length that was removed.
fn cut(left: &mut Vec<[f64; 2]>, [from, until]: [f64; 2]) -> f64 {
    let mut taken = 0.0;
    let mut rest = Vec::with_capacity(left.len() + 1);
    for &[low, high] in left.iter() {
        taken += (high.min(until) - low.max(from)).max(0.0);
        rest.extend([[low, high.min(from)], [low.max(until), high]].into_iter().filter(|[low, high]| low < high));
    }
    *left = rest;
    taken
}
