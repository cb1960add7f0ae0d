//! A sky as the six faces of a cube, with mip levels that keep its light.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::SkyImage;

/// The number of faces of a cube, in the order of Vulkan's layers: +X, -X, +Y, -Y, +Z, -Z.
pub const FACES: u32 = 6;

/// The largest edge of a face.
const MOST_EDGE: u32 = 1024;

/// The faces of a sky in all levels.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyCube {
    /// The levels, the largest first; the last one has one texel a face.
    pub levels: Vec<CubeLevel>,
}

/// All faces in one size.
#[derive(Debug, Clone, PartialEq)]
pub struct CubeLevel {
    /// The edge of a face in texels.
    pub edge: u32,
    /// The texels of one face after the other, rows from the top.
    pub texels: Vec<Vec3>,
}

impl SkyCube {
    /// Faces about as fine as the image: a face sees a quarter of its width, where its texels are widest.
    pub fn edge_of(image: &SkyImage) -> u32 {
        (image.size[0] / 3).next_power_of_two().clamp(8, MOST_EDGE)
    }

    /// Resamples the image.
    pub fn of(image: &SkyImage) -> Self {
        let edge = Self::edge_of(image);
        let texel = |index: u32| {
            let (face, place) = (index / (edge * edge), index % (edge * edge));
            let at = |step: u32| (f64::from(step) + 0.5) / f64::from(edge) * 2.0 - 1.0;
            image.look(face_direction(face, at(place % edge), at(place / edge)).normalize()).as_vec3()
        };
        let finest = CubeLevel { edge, texels: (0..FACES * edge * edge).into_par_iter().map(texel).collect() };
        let mut levels = vec![finest];
        while let Some(next) = levels.last().and_then(CubeLevel::halved) {
            levels.push(next);
        }
        Self { levels }
    }
}

impl CubeLevel {
    /// The level with half the edge: each texel is the mean of four, weighted by their solid angles, so that light is neither lost nor won. `None` at
    /// an edge of 1.
    fn halved(&self) -> Option<Self> {
        let (from, edge) = (self.edge, self.edge / 2);
        if edge == 0 {
            return None;
        }
        let texel = |index: u32| {
            let (face, place) = (index / (edge * edge), index % (edge * edge));
            let (column, row) = (place % edge * 2, place / edge * 2);
            let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
            for (column, row) in [(column, row), (column + 1, row), (column, row + 1), (column + 1, row + 1)] {
                let at = |step: u32| (step as f32 + 0.5) / from as f32 * 2.0 - 1.0;
                let weight = (1.0 + at(column) * at(column) + at(row) * at(row)).powf(-1.5);
                sum += self.texels[(face * from * from + row * from + column) as usize] * weight;
                weights += weight;
            }
            sum / weights
        };
        Some(Self { edge, texels: (0..FACES * edge * edge).into_par_iter().map(texel).collect() })
    }
}

/// Returns the direction of a place on a face, of any length: `across` from -1 to 1, as `down` (Vulkan specification, "Cube Map Face Selection").
pub fn face_direction(face: u32, across: f64, down: f64) -> DVec3 {
    match face {
        0 => DVec3::new(1.0, -down, -across),
        1 => DVec3::new(-1.0, -down, across),
        2 => DVec3::new(across, 1.0, down),
        3 => DVec3::new(across, -1.0, -down),
        4 => DVec3::new(across, -down, 1.0),
        _ => DVec3::new(-across, -down, -1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_meet_at_their_edges_and_every_level_has_the_mean_of_the_sky() {
        let image = SkyImage::of("it", 128, |to| DVec3::new(1.0 + to.y, 1.0, if to.x > 0.99 { 100.0 } else { 1.0 }));
        let cube = SkyCube::of(&image);
        assert_eq!(cube.levels.iter().map(|level| level.edge).collect::<Vec<_>>(), [64, 32, 16, 8, 4, 2, 1]);
        for level in &cube.levels {
            let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
            for (texel, index) in level.texels.iter().zip(0..) {
                let place: u32 = index % (level.edge * level.edge);
                let at = |step: u32| (f64::from(step) + 0.5) / f64::from(level.edge) * 2.0 - 1.0;
                let (across, down) = (at(place % level.edge), at(place / level.edge));
                let weight = (1.0 + across * across + down * down).powf(-1.5);
                sum += texel.as_dvec3() * weight;
                weights += weight;
            }
            // A texel's solid angle, taken at its middle, errs by up to 4% of the variation within the texel.
            let off = (sum / weights - image.mean()) / image.mean();
            assert!(off.abs().max_element() < 0.02, "{}: {off}", level.edge);
        }
        // Both faces give the same direction at their shared edge.
        assert_eq!(face_direction(0, -1.0, 0.25).normalize(), face_direction(4, 1.0, 0.25).normalize());
        assert_eq!(face_direction(0, 0.5, -1.0).normalize(), face_direction(2, 1.0, -0.5).normalize());
    }
}
