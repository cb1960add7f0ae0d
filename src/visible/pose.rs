//! Poses of the scene's motion: they place the objects that nodes carry, and give SKIN its inputs for deformed ones.

use std::sync::Arc;

use glam::{DAffine3, DMat4, DVec3};

use super::World;
use super::world::SortableTriangle;
use crate::plan::FramePlan;
use crate::scene::{Aabb, CastsShadow, DeformBounds, Mesh, Motion, Pose, Scene, deform, deform_frame};

/// SKIN's input: the joints and weights of all deformed objects, in the order of the plan.
#[derive(Debug, Clone, Default)]
pub struct WorldPose {
    /// A different number for each pose; 0 without a pose.
    pub revision: u64,
    /// Rows of each joint's map, from the mesh's f32 vertices to the object's own space.
    pub joints: Vec<[[f32; 4]; 3]>,
    /// Weights of the shapes.
    pub weights: Vec<f32>,
    /// The scene's numbers of lights and of materials that clips or nodes change.
    pub lights: Arc<[usize]>,
    pub materials: Arc<[usize]>,
    /// The scene's numbers of objects whose cells clips change.
    pub cells: Arc<[usize]>,
    deforms: Vec<Deform>,
    /// Indices into `World::objects` of undeformed objects that nodes carry, each with its node.
    carried: Vec<(usize, usize)>,
}

/// A deformed mesh.
#[derive(Debug, Clone)]
struct Deform {
    /// Indices into `World::objects` of its objects, each with the transform that moves it away from its joints.
    objects: Vec<(usize, DAffine3)>,
    node: Option<usize>,
    skin: Option<usize>,
    /// The origin of the mesh's vertices.
    origin: DVec3,
    bounds: Arc<DeformBounds>,
    /// The first joint and weight among all joints and weights, and the number of weights.
    first_joint: usize,
    first_weight: usize,
    shapes: usize,
    /// The mesh, if its triangles are sorted for each frame.
    sorted: Option<Arc<Mesh>>,
}

impl WorldPose {
    /// `sorts` returns true for objects of the scene whose triangles are sorted.
    pub(super) fn of(
        scene: &Scene,
        plan: &FramePlan,
        object_of: &[Option<usize>],
        sorts: impl Fn(usize) -> bool,
    ) -> Self {
        let planned = &plan.meshes.deforms;
        let mut bounds: Vec<Option<Arc<DeformBounds>>> = vec![None; scene.meshes.len()];
        let mut objects = vec![(Vec::new(), false); planned.meshes.len()];
        for &(object, place) in &planned.objects {
            objects[place].1 |= sorts(object);
            objects[place].0.extend(object_of[object].map(|own| (own, scene.objects[object].transform)));
        }
        let deforms = planned.meshes.iter().zip(objects).map(|(own, (objects, is_sorted))| {
            let (object, mesh) = (&scene.objects[own.object], &scene.meshes[own.mesh]);
            let bounds =
                bounds[own.mesh].get_or_insert_with(|| Arc::new(DeformBounds::of(mesh, own.first_joint.is_some())));
            Deform {
                objects,
                node: object.node,
                skin: own.first_joint.and(object.skin),
                origin: mesh.origin,
                bounds: Arc::clone(bounds),
                first_joint: own.first_joint.unwrap_or(0) as usize,
                first_weight: own.first_weight.unwrap_or(0) as usize,
                shapes: own.first_weight.map_or(0, |_| mesh.morphs.len()),
                sorted: is_sorted.then(|| Arc::new(mesh.clone())),
            }
        });
        let deforms = deforms.collect();
        let nodes =
            scene.objects.iter().map(|object| object.node.filter(|_| !scene.deforms(object) && object.skin.is_none()));
        let carried = object_of.iter().zip(nodes).filter_map(|(own, node)| own.zip(node));
        Self {
            revision: 0,
            joints: vec![[[0.0; 4]; 3]; planned.joints as usize],
            weights: vec![0.0; planned.weights as usize],
            lights: scene.motion.moved_lights().into_iter().collect(),
            materials: scene.motion.moved_materials().into_iter().collect(),
            cells: scene.motion.moved_cells().into_iter().collect(),
            deforms,
            carried: carried.collect(),
        }
    }
}

/// The place of a deformed mesh in a pose.
struct PosedMesh {
    /// The map from SKIN's output to the world, or to the place from which objects move it.
    transform: DAffine3,
    bounds: Aabb,
    /// True if SKIN's output changes.
    is_new: bool,
    /// The triangles, before `transform`.
    triangles: Option<Vec<SortableTriangle>>,
}

impl World {
    /// Moves everything that nodes carry to its place in a pose.
    pub fn pose(&mut self, motion: &Motion, pose: &Pose) {
        self.moment = pose.time();
        for place in 0..self.pose.carried.len() {
            let (index, node) = self.pose.carried[place];
            let (origin, bounds) = self.objects[index].mesh_place;
            let transform = pose.world(node);
            let place = bounds.transformed(&transform);
            self.stand(index, transform * DAffine3::from_translation(origin), place, false);
        }
        let deforms = std::mem::take(&mut self.pose.deforms);
        let mut joints = Vec::new();
        let mut is_new = self.pose.revision == 0;
        for (index, deform) in deforms.iter().enumerate() {
            let stand = deform.stand(&mut self.pose, (motion, pose), &mut joints);
            is_new |= stand.is_new;
            for (object, own) in &deform.objects {
                let (transform, bounds) = match deform.skin {
                    Some(_) if *own != DAffine3::IDENTITY => (*own * stand.transform, stand.bounds.transformed(own)),
                    _ => (stand.transform, stand.bounds),
                };
                self.stand(*object, transform, bounds, stand.is_new);
            }
            if let Some(triangles) = stand.triangles {
                self.deformed_triangles.insert(index, triangles);
            }
        }
        self.pose.deforms = deforms;
        self.pose.revision += u64::from(is_new);
    }

    /// Puts an object somewhere else, or leaves it if nothing of it is new.
    pub(super) fn stand(&mut self, index: usize, transform: DAffine3, bounds: Aabb, deforms: bool) {
        let object = &mut self.objects[index];
        if !deforms && object.transform == transform {
            return;
        }
        let stood = std::mem::replace(&mut object.transform, transform);
        self.previous.leave(index, stood);
        let mirrored = transform.matrix3.determinant() < 0.0;
        let mirrors = std::mem::replace(&mut object.key.mirrored, mirrored) != mirrored;
        let before = std::mem::replace(&mut object.bounds, bounds);
        object.revision += 1;
        self.generation += 1;
        let casts = object.casts != CastsShadow::No;
        let changes = self.changes.get_or_insert_default();
        changes.moved.push(index as u32);
        changes.rearranged |= mirrors;
        if casts {
            changes.boxes.extend([before, bounds]);
        }
    }
}

impl Deform {
    fn stand(&self, own: &mut WorldPose, (motion, pose): (&Motion, &Pose), joints: &mut Vec<DAffine3>) -> PosedMesh {
        let mut is_new = false;
        let weights = self.node.map_or(&[][..], |node| pose.weights(node));
        let told = &mut own.weights[self.first_weight..][..self.shapes];
        for (told, weight) in
            told.iter_mut().zip(weights.iter().map(|&weight| weight as f32).chain(std::iter::repeat(0.0)))
        {
            is_new |= *told != weight;
            *told = weight;
        }
        let Some(skin) = self.skin else {
            let transform = self.node.map_or(DAffine3::IDENTITY, |node| pose.world(node));
            let bounds = self.bounds.bounds(&[], weights).transformed(&transform);
            let triangles = self.triangles(weights, None, &DAffine3::from_translation(-self.origin));
            let transform = transform * DAffine3::from_translation(self.origin);
            return PosedMesh { transform, bounds, is_new, triangles };
        };
        joints.clear();
        pose.joint_matrices(motion, skin, &DAffine3::IDENTITY, joints);
        let bounds = self.bounds.bounds(joints, weights);
        // Vertices lie about a place near them, so that f32 is enough wherever the skeleton is; and are mirrored where the joints are, so that
        // fronts stay fronts.
        let (near, frame) = (near(&bounds, self.bounds.mean(joints, weights)), deform_frame(joints));
        let transform = DAffine3::from_translation(near) * frame;
        let from_world = frame * DAffine3::from_translation(-near);
        for (told, joint) in own.joints[self.first_joint..].iter_mut().zip(joints.iter()) {
            let rows = rows(&(from_world * *joint * DAffine3::from_translation(self.origin)));
            is_new |= *told != rows;
            *told = rows;
        }
        let triangles = self.triangles(weights, Some(joints), &from_world);
        PosedMesh { transform, bounds, is_new, triangles }
    }

    /// The triangles of a mesh that is sorted, deformed on the CPU as well: SKIN's vertices come back to nobody.
    fn triangles(
        &self,
        weights: &[f64],
        joints: Option<&[DAffine3]>,
        from: &DAffine3,
    ) -> Option<Vec<SortableTriangle>> {
        let mesh = deform(self.sorted.as_deref()?, weights, joints);
        Some(SortableTriangle::all(&mesh, &(*from * DAffine3::from_translation(mesh.origin))))
    }
}

/// A place near a mesh, from its box and the mean of its vertices: on a grid as fine as the mesh is small, of a metre at most, so that it stays while
/// the mesh moves a little, and differences from it lose no digit of f64.
fn near(bounds: &Aabb, mean: DVec3) -> DVec3 {
    let edge = bounds.size().max_element();
    let step = if edge > 0.0 { edge.log2().floor().exp2().min(1.0) } else { 1.0 };
    let near = (mean / step).round() * step;
    if near.is_finite() { near } else { bounds.center().round() }
}

fn rows(map: &DAffine3) -> [[f32; 4]; 3] {
    let rows = DMat4::from(*map).transpose().as_mat4();
    [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| row.to_array())
}
