//! Polygons back to back: of the same corners, and turned away from each other, as a page that has something else on its back. Each is seen
//! from its own side, which coplanar faces that are drawn from both sides cannot show.

use std::collections::HashSet;
use std::hash::{DefaultHasher, Hash, Hasher};

use glam::DVec3;
use rayon::prelude::*;

use super::polygon::newell_normal;

/// A direction that few polygons are parallel to, by which the two sides of a plane differ.
const ASKEW: DVec3 = DVec3::new(0.412_87, 0.581_93, 0.700_61);

/// Returns the places of polygons that lie back to back with another of the file.
pub(super) fn backed(meshes: &[tobj::Mesh]) -> HashSet<u64> {
    let keys_of = |mesh| polygons(mesh).filter_map(move |corners| key(mesh, corners));
    let mut keys: Vec<u64> = meshes.par_iter().flat_map_iter(keys_of).collect();
    keys.par_sort_unstable();
    keys.windows(2).filter(|pair| pair[0] ^ pair[1] == 1).map(|pair| pair[0] >> 1).collect()
}

/// Takes a mesh's polygons at these places out of it.
pub(super) fn take(mesh: &mut tobj::Mesh, backed: &HashSet<u64>) -> Option<tobj::Mesh> {
    let is_backed = |corners: &[u32]| key(mesh, corners).is_some_and(|key| backed.contains(&(key >> 1)));
    let sides: Vec<bool> = polygons(mesh).map(is_backed).collect();
    if !sides.contains(&true) {
        return None;
    }
    let of_side = |side: bool| {
        let own = || polygons(mesh).zip(&sides).filter(|(_, own)| **own == side).map(|(corners, _)| corners);
        let indices: Vec<u32> = own().flatten().copied().collect();
        let arities: Vec<u32> = own().map(|corners| corners.len() as u32).collect();
        let are_triangles = arities.iter().all(|&arity| arity == 3);
        (indices, if are_triangles { Vec::new() } else { arities })
    };
    let (taken, others) = (of_side(true), of_side(false));
    let mut sheets = mesh.clone();
    (sheets.indices, sheets.face_arities) = taken;
    (mesh.indices, mesh.face_arities) = others;
    Some(sheets)
}

/// The corners of each polygon.
pub(super) fn polygons(mesh: &tobj::Mesh) -> impl Iterator<Item = &[u32]> {
    let arities = &mesh.face_arities;
    let count = if arities.is_empty() { mesh.indices.len() / 3 } else { arities.len() };
    let mut rest = mesh.indices.as_slice();
    (0..count).map(move |face| {
        let arity = arities.get(face).map_or(3, |&arity| arity as usize);
        let (corners, later) = rest.split_at(arity.min(rest.len()));
        rest = later;
        corners
    })
}

/// A number of the polygon's corners, whatever their order; the last bit is the side that it faces. A polygon without an area has none.
fn key(mesh: &tobj::Mesh, corners: &[u32]) -> Option<u64> {
    let points: Vec<DVec3> = corners.iter().map(|&corner| point(mesh, corner)).collect();
    let facing = newell_normal(&points).dot(ASKEW);
    let place = points.iter().fold(0_u64, |sum, point| {
        let mut hasher = DefaultHasher::new();
        // Adding zero makes -0 the same place as 0.
        (*point + DVec3::ZERO).to_array().map(f64::to_bits).hash(&mut hasher);
        sum.wrapping_add(hasher.finish())
    });
    (facing != 0.0).then_some(place << 1 | u64::from(facing > 0.0))
}

fn point(mesh: &tobj::Mesh, corner: u32) -> DVec3 {
    let at = corner as usize * 3;
    mesh.positions.get(at..at + 3).map_or(DVec3::ZERO, DVec3::from_slice)
}
