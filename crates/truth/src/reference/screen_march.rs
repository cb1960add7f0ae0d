//! Reflections in screen space: a lit picture and its depth buffer, marched in f64, pixel by pixel. A pass converges to them with its numbers of
//! directions and steps.

use glam::{DVec2, DVec3};

use super::depth_march::DepthBuffer;
use super::light::Collector;
use super::rays::CameraRays;
use super::reflections;

/// The margin of the picture in which reflections fade out, as a part of its width and height.
pub const FADE: f64 = 0.03125;

/// A picture of a perspective camera that rays are marched through.
#[derive(Debug, Clone, Copy)]
pub struct ScreenMarch<'a> {
    /// Distances along the view.
    pub depth: DepthBuffer<'a>,
    /// Unit normals of the surface that each pixel shows.
    pub normals: &'a [DVec3],
    /// Light of each pixel, in any unit.
    pub light: &'a [DVec3],
    /// Metres that surfaces extend behind their visible side.
    pub thickness: f64,
}

impl ScreenMarch<'_> {
    /// Returns the pixel that a ray meets which leaves the surface of another, whose normal is `normal`.
    pub fn met(&self, pixel: [u32; 2], normal: DVec3, direction: DVec3) -> Option<[u32; 2]> {
        let [width, height] = self.depth.view.size;
        let lens = CameraRays::of(&self.depth.view);
        let middle = DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])) + 0.5;
        let place = self.place(&lens, pixel)?;
        let beside = lens.place(middle + DVec2::X, lens.distance(place));
        let start = place + normal * (beside - place).length();
        // In the picture and by the reciprocal of the distance a ray is straight.
        let (w, by) = (lens.distance(start), lens.distance(direction));
        let first = lens.seen_at(start).extend(1.0 / w);
        let ahead = start + direction * (0.5 * w / direction.length());
        // After half of its distance the ray is still before the camera: any such place gives its line in the picture.
        let step =
            (lens.seen_at(ahead).extend(1.0 / lens.distance(ahead)) - first) * (lens.distance(ahead) / w).signum();
        let longest = step.x.abs().max(step.y.abs());
        if w <= 0.0 || longest <= 1e-12 {
            return None;
        }
        let step = step / longest;
        let (mut x, mut y) = (i64::from(pixel[0]), i64::from(pixel[1]));
        let near = self.depth.view.camera.near;
        let end = if by > 0.0 {
            -first.z / step.z
        } else if step.z > 0.0 {
            (1.0 / near - first.z) / step.z
        } else {
            f64::INFINITY
        };
        let until = |x: i64, y: i64| {
            let side = |at: i64, step: f64, from: f64| match step {
                0.0 => f64::INFINITY,
                _ => ((at + i64::from(step > 0.0)) as f64 - from) / step,
            };
            [side(x, step.x, first.x), side(y, step.y, first.y)]
        };
        let next = |x: &mut i64, y: &mut i64| {
            let [across, down] = until(*x, *y);
            if across < down {
                *x += step.x.signum() as i64
            } else {
                *y += step.y.signum() as i64
            }
            across.min(down)
        };
        let mut at = next(&mut x, &mut y).max(0.0);
        while at < end && (0..i64::from(width)).contains(&x) && (0..i64::from(height)).contains(&y) {
            let here = [x as u32, y as u32];
            let leaves = next(&mut x, &mut y).min(end);
            let index = here[1] as usize * width as usize + here[0] as usize;
            let seen = self.depth.distances[index];
            // Reciprocals: the nearest is the largest.
            let [one, other] = [first.z + step.z * at, first.z + step.z * leaves];
            let (nearest, farthest) = (one.max(other), one.min(other).max(0.0));
            let is_met = seen.is_finite() && farthest * seen <= 1.0 && 1.0 <= nearest * (seen + self.thickness);
            if is_met && self.normals[index].dot(direction) < 0.0 {
                return Some(here);
            }
            at = leaves;
        }
        None
    }

    /// Returns the visible point of a pixel, relative to the camera.
    fn place(&self, lens: &CameraRays, pixel: [u32; 2]) -> Option<DVec3> {
        let index = pixel[1] as usize * self.depth.view.size[0] as usize + pixel[0] as usize;
        let distance = *self.depth.distances.get(index).filter(|own| own.is_finite())?;
        Some(lens.place(DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])) + 0.5, distance))
    }

    /// Returns the visible point of a pixel, relative to the camera; derives the camera's rays itself.
    pub fn place_of(&self, pixel: [u32; 2]) -> Option<DVec3> {
        self.place(&CameraRays::of(&self.depth.view), pixel)
    }

    /// Returns the weight of a pixel that a ray meets, 0 to 1: it falls towards the picture's edges.
    pub fn confidence(&self, pixel: [u32; 2]) -> f64 {
        let size = DVec2::from(self.depth.view.size.map(f64::from));
        let there = DVec2::from(pixel.map(f64::from)) + 0.5;
        (there.min(size - there) / size / FADE).min_element().clamp(0.0, 1.0)
    }

    /// Returns the light of others that a pixel mirrors along these directions, and the share of its lobe that meets some.
    pub fn mirrored(&self, pixel: [u32; 2], lobe: &Collector, points: &[DVec2]) -> (DVec3, f64) {
        reflections::gathered(lobe, points, &mut |direction| {
            let met = self.met(pixel, lobe.normal, direction)?;
            let index = met[1] as usize * self.depth.view.size[0] as usize + met[0] as usize;
            Some((self.light[index], self.confidence(met)))
        })
    }
}
