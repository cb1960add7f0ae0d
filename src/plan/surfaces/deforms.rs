//! Deformed meshes: their objects, and the places of their vertices on the device.

use std::collections::BTreeMap;

use super::meshes::first_vertex;
use super::{MeshPlan, Streams};
use crate::scene::{Mesh, Object, Scene};

/// A mesh whose vertices SKIN writes for each pose, for all objects that have it with the same skin and shapes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlannedDeform {
    /// Index into the scene's objects, of the first that has it.
    pub object: usize,
    /// Index into the scene's meshes, of the mesh that it deforms.
    pub mesh: usize,
    /// The first vertex, in each stream of deformed vertices.
    pub first_vertex: u32,
    /// The first joint in a frame's palette, if it has a skin.
    pub first_joint: Option<u32>,
    /// The first weight among all weights of a frame, if its mesh has shapes.
    pub first_weight: Option<u32>,
}

/// All deformed meshes of a plan.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DeformPlan {
    /// The deformed meshes, in the order of their first objects.
    pub meshes: Vec<PlannedDeform>,
    /// Objects of the scene in its order, each with the place of its mesh in [`DeformPlan::meshes`].
    pub objects: Vec<(usize, usize)>,
    /// Vertices of all deformed meshes; each has a position.
    pub vertices: u64,
    /// The streams that pipelines read of any deformed mesh.
    pub streams: Streams,
    /// SKIN keeps the positions of the previous pose, behind all streams.
    pub keeps_positions: bool,
    /// Joints of all palettes.
    pub joints: u64,
    /// Weights of shapes of all meshes.
    pub weights: u64,
    known: BTreeMap<Deformation, usize>,
}

/// A mesh, its skin, and the node whose weights its shapes have.
type Deformation = (usize, Option<usize>, Option<usize>);

fn deformation(object: &Object, mesh: &Mesh) -> Deformation {
    let skin = object.skin.filter(|_| mesh.influences.is_some());
    (object.mesh, skin, object.node.filter(|_| !mesh.morphs.is_empty()))
}

impl DeformPlan {
    /// An object that a pass draws, with the streams that pipelines read of it.
    pub(super) fn push(&mut self, scene: &Scene, index: usize, streams: Streams) {
        let object = &scene.objects[index];
        let mesh = &scene.meshes[object.mesh];
        self.streams = self.streams.union(streams);
        if let Some(&place) = self.known.get(&deformation(object, mesh)) {
            self.objects.push((index, place));
            return;
        }
        self.known.insert(deformation(object, mesh), self.meshes.len());
        self.objects.push((index, self.meshes.len()));
        let joints = joints_of(scene, object, mesh).unwrap_or(0) as u64;
        let shapes = mesh.morphs.len() as u64;
        self.vertices = first_vertex(self.vertices, mesh);
        self.meshes.push(PlannedDeform {
            object: index,
            mesh: object.mesh,
            first_vertex: self.vertices as u32,
            first_joint: (joints > 0).then_some(self.joints as u32),
            first_weight: (shapes > 0).then_some(self.weights as u32),
        });
        self.vertices += mesh.positions.len() as u64;
        self.joints += joints;
        self.weights += shapes;
    }

    /// The place of the deformed mesh of an object of the scene.
    pub fn find(&self, object: usize) -> Option<usize> {
        let found = self.objects.binary_search_by_key(&object, |&(own, _)| own);
        found.ok().map(|place| self.objects[place].1)
    }

    /// Bytes of the vertices that SKIN writes, or that lie beside them.
    pub fn vertex_bytes(&self) -> u64 {
        self.vertices * (MeshPlan::stride(self.streams) + if self.keeps_positions { 12 } else { 0 })
    }

    /// Bytes that the CPU writes for each frame: a palette row is four floats, and a joint has three.
    pub fn pose_bytes(&self) -> u64 {
        48 * self.joints + 16 * self.weights.div_ceil(4)
    }
}

/// The number of joints that move an object's mesh; `None` for one without a skin that its mesh was made for.
fn joints_of(scene: &Scene, object: &Object, mesh: &Mesh) -> Option<usize> {
    mesh.influences.as_ref()?;
    scene.motion.skins.get(object.skin?).map(|skin| skin.joints.len())
}
