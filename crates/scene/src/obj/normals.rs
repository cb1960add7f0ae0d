//! Normals for faces without normals.

use std::collections::HashMap;

use glam::DVec3;

use super::scan::Smoothing;
use crate::mesh::corner_angle;

/// In a file without smoothing statements, edges up to 60 degrees are smooth: round things look round, boxes stay boxes.
const CREASE_COSINE: f64 = 0.5;

/// In a smoothing group, triangles back to back lie on different sides of a sheet.
const OTHER_SIDE: f64 = -0.9;

/// The crease test compares all pairs of triangles around a vertex. It is skipped for vertices of more triangles than this.
const MOST_PAIRS: usize = 1024;

/// Triangles of one part: corners into `points`, and the normal of the polygon that each was cut from (zero if it has none).
pub(super) struct Faces<'a> {
    pub points: &'a [DVec3],
    pub triangles: &'a [[u32; 3]],
    pub normals: &'a [DVec3],
    /// True if triangles lie back to back.
    pub is_sheet: bool,
}

/// A unit normal for each corner of each triangle. Smooth ones are weighted by the corner's angle, across texture seams too.
pub(super) fn corner_normals(faces: &Faces, smoothing: Smoothing) -> Vec<[DVec3; 3]> {
    let least_cosine = match smoothing {
        Smoothing::Off => return faces.normals.iter().map(|normal| [normal.normalize_or(DVec3::Y); 3]).collect(),
        Smoothing::Group(_) if faces.is_sheet => OTHER_SIDE,
        Smoothing::Group(_) => f64::NEG_INFINITY,
        Smoothing::Unstated => CREASE_COSINE,
    };
    let welded = weld(faces.points);
    let around = triangles_around(faces, &welded);
    let smooth: Vec<DVec3> =
        around.iter().map(|near| near.iter().map(|&(t, angle)| faces.normals[t] * angle).sum()).collect();
    let corner_normal = |triangle: usize, vertex: u32| {
        let (own, place) = (faces.normals[triangle], welded[vertex as usize]);
        let near = &around[place];
        let sum = if least_cosine < -1.0 || near.len() > MOST_PAIRS {
            smooth[place]
        } else {
            let is_near = |other: DVec3| other.dot(own) >= least_cosine;
            near.iter().filter(|(t, _)| is_near(faces.normals[*t])).map(|&(t, angle)| faces.normals[t] * angle).sum()
        };
        sum.try_normalize().unwrap_or_else(|| own.normalize_or(DVec3::Y))
    };
    faces.triangles.iter().enumerate().map(|(t, corners)| corners.map(|vertex| corner_normal(t, vertex))).collect()
}

/// Numbers the points so that points at the same place have the same number.
fn weld(points: &[DVec3]) -> Vec<usize> {
    let mut places = HashMap::with_capacity(points.len());
    points
        .iter()
        .map(|&point| {
            let next = places.len();
            // Adding zero makes -0 the same place as 0.
            *places.entry((point + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert(next)
        })
        .collect()
}

/// For each place, the triangles that have a corner there and its angle.
fn triangles_around(faces: &Faces, welded: &[usize]) -> Vec<Vec<(usize, f64)>> {
    let mut around = vec![Vec::new(); welded.iter().max().map_or(0, |&last| last + 1)];
    for (t, corners) in faces.triangles.iter().enumerate() {
        let points = corners.map(|vertex| faces.points[vertex as usize]);
        for (corner, &vertex) in corners.iter().enumerate() {
            around[welded[vertex as usize]].push((t, corner_angle(&points, corner)));
        }
    }
    around
}
