//! Which objects are deformed on the device, and where their vertices lie.

use super::{MeshPlan, Streams};
use crate::scene::{Mesh, Object, Scene};

/// An object whose vertices SKIN writes for each pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlannedDeform {
    /// Index into the scene's objects.
    pub object: usize,
    /// Index into the scene's meshes, of the mesh that it deforms.
    pub mesh: usize,
    /// Its first vertex in each stream of the deformed ones.
    pub first_vertex: u32,
    /// Its first joint in the palette of a frame, where it has a skin.
    pub first_joint: Option<u32>,
    /// Its first weight among those of a frame, where its mesh has shapes.
    pub first_weight: Option<u32>,
}

/// All deformed objects of a plan.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DeformPlan {
    /// In the order of the scene.
    pub objects: Vec<PlannedDeform>,
    /// Of all of them; each has a position.
    pub vertices: u64,
    /// The streams that some pipeline reads of one of them.
    pub streams: Streams,
    /// Joints of all palettes.
    pub joints: u64,
    /// Weights of shapes of all objects.
    pub weights: u64,
}

impl DeformPlan {
    /// An object that a pass draws, with the streams that pipelines read of it.
    pub(super) fn push(&mut self, scene: &Scene, index: usize, streams: Streams) {
        let object = &scene.objects[index];
        let mesh = &scene.meshes[object.mesh];
        let joints = joints_of(scene, object, mesh).unwrap_or(0) as u64;
        let shapes = mesh.morphs.len() as u64;
        self.objects.push(PlannedDeform {
            object: index,
            mesh: object.mesh,
            first_vertex: self.vertices as u32,
            first_joint: (joints > 0).then_some(self.joints as u32),
            first_weight: (shapes > 0).then_some(self.weights as u32),
        });
        self.vertices += mesh.positions.len() as u64;
        self.streams = self.streams.union(streams);
        self.joints += joints;
        self.weights += shapes;
    }

    /// The place of an object of the scene among the deformed ones.
    pub fn find(&self, object: usize) -> Option<usize> {
        self.objects.binary_search_by_key(&object, |own| own.object).ok()
    }

    /// Bytes of the vertices that SKIN writes, or that lie beside them.
    pub fn vertex_bytes(&self) -> u64 {
        self.vertices * MeshPlan::stride(self.streams)
    }

    /// Bytes of what the CPU writes for each frame: a palette row is four floats, and a joint has three.
    pub fn pose_bytes(&self) -> u64 {
        48 * self.joints + 16 * self.weights.div_ceil(4)
    }
}

/// How many joints move an object's mesh; `None` for one without a skin that its mesh was made for.
fn joints_of(scene: &Scene, object: &Object, mesh: &Mesh) -> Option<usize> {
    mesh.influences.as_ref()?;
    scene.motion.skins.get(object.skin?).map(|skin| skin.joints.len())
}
