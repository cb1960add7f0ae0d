//! Triangles back to back: of the same corners, and turned away from each other, as a page that has something else on its back. Each is seen
//! from its own side, which coplanar triangles of materials with two sides cannot show.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::hash::{DefaultHasher, Hash, Hasher};

use glam::{DVec3, Vec3};

use crate::{ChannelTarget, Imported, Material, Mesh, Object};

/// Where objects of a mesh are: the bits of their transforms, and their nodes.
type MeshPlacements = BTreeSet<([u64; 12], Option<usize>)>;

/// Gives triangles that lie back to back materials with one side. A mesh that has other triangles as well is split.
pub(super) fn part(imported: &mut Imported) {
    let mut objects: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (index, object) in imported.objects.iter().enumerate() {
        objects.entry(object.mesh).or_default().push(index);
    }
    // A copy of a material would not move with it.
    let channels = imported.motion.clips.iter().flat_map(|clip| &clip.channels);
    let moving: BTreeSet<usize> = channels
        .filter_map(|channel| match channel.target {
            ChannelTarget::Material(index, _) => Some(index),
            _ => None,
        })
        .collect();
    objects.retain(|&mesh, objects| {
        let is_plain = |object: &Object| {
            object.skin.is_none() && imported.materials[object.material].two_sided && !moving.contains(&object.material)
        };
        let own = &imported.meshes[mesh];
        own.influences.is_none() && own.morphs.is_empty() && objects.iter().all(|&at| is_plain(&imported.objects[at]))
    });
    let mut spaces: HashMap<MeshPlacements, u64> = HashMap::new();
    let mut keys: Vec<(u64, usize, usize)> = Vec::new();
    for (&mesh, objects) in &objects {
        let places = objects.iter().map(|&at| &imported.objects[at]);
        let places = places.map(|own| (own.transform.to_cols_array().map(f64::to_bits), own.node)).collect();
        let next = spaces.len() as u64;
        let space = *spaces.entry(places).or_insert(next);
        keys.extend(keys_of(&imported.meshes[mesh], space).map(|(key, triangle)| (key, mesh, triangle)));
    }
    keys.sort_unstable();
    let mut backed: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
    for run in keys.chunk_by(|a, b| a.0 >> 1 == b.0 >> 1).filter(|run| run[0].0 != run[run.len() - 1].0) {
        for &(_, mesh, triangle) in run {
            backed.entry(mesh).or_default().insert(triangle);
        }
    }
    let mut copies = HashMap::new();
    for (mesh, triangles) in backed {
        let own = split(imported, mesh, &triangles);
        for &at in &objects[&mesh] {
            let material = imported.objects[at].material;
            let one_sided = *copies.entry(material).or_insert_with(|| {
                imported.materials.push(Material { two_sided: false, ..imported.materials[material].clone() });
                imported.materials.len() - 1
            });
            match own {
                Some(own) => {
                    let object = Object { mesh: own, material: one_sided, ..imported.objects[at].clone() };
                    imported.objects.push(object);
                }
                None => imported.objects[at].material = one_sided,
            }
        }
    }
}

/// Moves some triangles of a mesh to a new mesh. Returns none if they are all.
fn split(imported: &mut Imported, mesh: usize, triangles: &BTreeSet<usize>) -> Option<usize> {
    let whole = &mut imported.meshes[mesh];
    if triangles.len() * 3 == whole.indices.len() {
        return None;
    }
    let mut own = whole.clone();
    let corners = |indices: &[u32], is_taken: bool| -> Vec<u32> {
        let all = indices.as_chunks::<3>().0.iter().enumerate();
        all.filter(|(at, _)| triangles.contains(at) == is_taken).flat_map(|(_, corners)| *corners).collect()
    };
    own.indices = corners(&whole.indices, true);
    whole.indices = corners(&whole.indices, false);
    imported.meshes.push(own);
    Some(imported.meshes.len() - 1)
}

/// For each triangle with an area a number of its corners, whatever their order, whose last bit is the side that it faces.
fn keys_of(mesh: &Mesh, space: u64) -> impl Iterator<Item = (u64, usize)> {
    /// A direction that few triangles are parallel to.
    const ASKEW: DVec3 = DVec3::new(0.412_87, 0.581_93, 0.700_61);
    let point = |index: u32| mesh.origin + Vec3::from(mesh.positions[index as usize]).as_dvec3() + DVec3::ZERO;
    mesh.indices.as_chunks::<3>().0.iter().enumerate().filter_map(move |(triangle, corners)| {
        let [a, b, c] = corners.map(point);
        let facing = (b - a).cross(c - a).dot(ASKEW);
        let place = [a, b, c].iter().fold(space, |sum, point| {
            let mut hasher = DefaultHasher::new();
            (space, point.to_array().map(f64::to_bits)).hash(&mut hasher);
            sum.wrapping_add(hasher.finish())
        });
        (facing != 0.0).then_some((place << 1 | u64::from(facing > 0.0), triangle))
    })
}
