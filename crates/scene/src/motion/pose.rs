//! Poses: each object's place at one moment, and the values that clips have changed.

use glam::{DAffine3, DQuat, DVec3};

use super::{Channel, ChannelTarget, Local, Motion, Placement, Playing, values};
use crate::{Camera, Light, Look, Material, Object, Scene, unit};

/// The most values that a light, a camera or a material has of one kind.
const MOST: usize = 4;

/// A moment of a scene: the transforms of its nodes, their shape weights, and the values of lights, cameras and materials that clips have changed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pose {
    worlds: Vec<DAffine3>,
    /// The weights of all nodes, one node after another. Node `node` has `first_weights[node]..first_weights[node + 1]`.
    weights: Vec<f64>,
    first_weights: Vec<usize>,
    /// The changed values, in the order of the clips: the last one of a target counts.
    values: Vec<(ChannelTarget, [f64; MOST])>,
    /// The cells that clips set, with the object's index, in ascending order of it.
    cells: Vec<(usize, u32)>,
    /// The time in seconds, for particles, which no clip moves.
    time: f64,
    /// The nodes' placements; the allocation is kept for the next moment.
    placements: Vec<Placement>,
}

impl Motion {
    /// Returns the pose at a moment. If several clips move the same target, the later one wins.
    pub fn pose(&self, playing: &Playing) -> Pose {
        let mut pose = Pose::default();
        self.pose_into(playing, &mut pose);
        pose
    }

    /// Writes the pose at a moment into an existing pose. It allocates nothing if the pose has been used for this motion before.
    pub fn pose_into(&self, playing: &Playing, pose: &mut Pose) {
        pose.rest(self);
        pose.time = playing.time;
        for clip in self.playing(&playing.clips) {
            let time = playing.time_in(clip);
            clip.channels.iter().for_each(|channel| pose.apply(channel, time));
        }
        pose.settle_cells();
        pose.place(self);
    }
}

impl Pose {
    /// The moment, in seconds.
    pub fn time(&self) -> f64 {
        self.time
    }

    fn rest(&mut self, motion: &Motion) {
        self.placements.clear();
        self.placements.extend(motion.nodes.iter().map(|node| match node.local {
            Local::Parts(placement) => placement,
            Local::Fixed(_) => Placement::default(),
        }));
        self.weights.clear();
        self.first_weights.clear();
        for node in &motion.nodes {
            self.first_weights.push(self.weights.len());
            self.weights.extend_from_slice(&node.weights);
        }
        self.first_weights.push(self.weights.len());
        self.values.clear();
        self.cells.clear();
    }

    fn apply(&mut self, channel: &Channel, time: f64) {
        match channel.target {
            ChannelTarget::Translation(node) => {
                if let (Some(place), Some(value)) = (self.placements.get_mut(node), vector(channel, time)) {
                    place.translation = value;
                }
            }
            ChannelTarget::Rotation(node) => {
                let mut value = [0.0; 4];
                if let (Some(place), true) = (self.placements.get_mut(node), channel.sample(time, &mut value)) {
                    place.rotation = DQuat::from_array(value);
                }
            }
            ChannelTarget::Scale(node) => {
                if let (Some(place), Some(value)) = (self.placements.get_mut(node), vector(channel, time)) {
                    place.scale = value;
                }
            }
            ChannelTarget::Weights(node) => {
                let ends = self.first_weights.get(node).zip(self.first_weights.get(node + 1));
                if let Some((&from, &to)) = ends {
                    // The number of keyed values may differ from the node's if the scene was not checked.
                    let count = (to - from).min(channel.width());
                    channel.sample(time, &mut self.weights[from..from + count]);
                }
            }
            ChannelTarget::Cell(object) => {
                let mut value = [0.0];
                if channel.sample(time, &mut value) {
                    // The cast saturates: negative values become 0.
                    self.cells.push((object, value[0] as u32));
                }
            }
            target @ (ChannelTarget::Light(..) | ChannelTarget::Camera(..) | ChannelTarget::Material(..)) => {
                let mut value = [0.0; MOST];
                let count = values::count(target).min(MOST);
                if channel.sample(time, &mut value[..count]) {
                    self.values.push((target, value));
                }
            }
        }
    }

    /// Makes the last clip that moves a cell win, and sorts the cells by object for the search.
    fn settle_cells(&mut self) {
        self.cells.reverse();
        self.cells.sort_by_key(|(object, _)| *object);
        self.cells.dedup_by_key(|(object, _)| *object);
    }

    fn place(&mut self, motion: &Motion) {
        self.worlds.clear();
        for (index, node) in motion.nodes.iter().enumerate() {
            let local = match node.local {
                Local::Parts(_) => self.placements[index].to_affine(),
                Local::Fixed(transform) => transform,
            };
            // A parent that comes later, in a scene that was not checked, counts as none.
            let parent = node.parent.and_then(|parent| self.worlds.get(parent));
            let world = parent.map_or(local, |parent| *parent * local);
            self.worlds.push(world);
        }
    }

    /// Returns true if the pose fits this motion, judged by the number of nodes; false for an empty pose.
    pub fn is_of(&self, motion: &Motion) -> bool {
        !self.worlds.is_empty() && self.worlds.len() == motion.nodes.len()
    }

    /// Returns the transform from a node's space to the world; the identity for a node that does not exist.
    pub fn world(&self, node: usize) -> DAffine3 {
        self.worlds.get(node).copied().unwrap_or(DAffine3::IDENTITY)
    }

    /// Returns the weight of each shape of a node's meshes; empty where they have none.
    pub fn weights(&self, node: usize) -> &[f64] {
        let ends = self.first_weights.get(node).zip(self.first_weights.get(node + 1));
        ends.and_then(|(&from, &to)| self.weights.get(from..to)).unwrap_or_default()
    }

    /// Replaces `out` by a matrix for each joint of a skin, from mesh space where the mesh was bound to `frame`, a space of the world:
    /// frame^-1 * world(joint) * inverse bind (glTF 2.0, "Skins").
    pub fn joint_matrices(&self, motion: &Motion, skin: usize, frame: &DAffine3, out: &mut Vec<DAffine3>) {
        out.clear();
        let Some(skin) = motion.skins.get(skin) else { return };
        let back = frame.inverse();
        let joints = skin.joints.iter().zip(&skin.inverse_bind);
        out.extend(joints.map(|(&joint, bind)| back * (self.world(joint) * *bind)));
    }

    /// Returns the transform of an object from its mesh, or from its joints: the world transform of its node, or its own transform if it has a skin
    /// or no node.
    pub fn object_transform(&self, object: &Object) -> DAffine3 {
        let node = object.node.filter(|_| object.skin.is_none());
        node.and_then(|node| self.worlds.get(node)).copied().unwrap_or(object.transform)
    }

    /// The scene's lights at this moment, clamped to valid ranges.
    pub fn lights(&self, scene: &Scene) -> Vec<Light> {
        (0..scene.lights.len()).map(|index| self.light(scene, index)).collect()
    }

    /// A light at this moment, by its index in [`Scene::lights`].
    pub fn light(&self, scene: &Scene, index: usize) -> Light {
        let mut light = scene.lights[index].clone();
        let node = scene.motion.light_nodes.get(index).copied().flatten();
        if let Some(world) = node.and_then(|node| self.worlds.get(node)) {
            hang(&mut light, world);
        }
        for (target, value) in &self.values {
            if let &ChannelTarget::Light(own, kind) = target
                && own == index
            {
                values::set_light(&mut light, kind, value);
            }
        }
        values::settle(&mut light);
        light
    }

    /// A material at this moment, by its index in [`Scene::materials`], clamped to valid ranges.
    pub fn material(&self, scene: &Scene, index: usize) -> Material {
        let changes = self.values.iter().filter_map(|(target, value)| match *target {
            ChannelTarget::Material(own, kind) if own == index => Some((kind, value)),
            _ => None,
        });
        values::changed_material(&scene.materials[index], changes)
    }

    /// The look of an object at this moment, by its index in [`Scene::objects`]; `None` if it never has one.
    pub fn look(&self, scene: &Scene, index: usize) -> Option<Look> {
        let look = scene.objects.get(index).and_then(|object| object.look);
        match self.cells.binary_search_by_key(&index, |(object, _)| *object) {
            Ok(place) => Some(Look { cell: self.cells[place].1, ..look.unwrap_or_default() }),
            Err(_) => look,
        }
    }

    /// A camera at this moment, by its index in [`Scene::cameras`]; for an invalid index, the scene's own camera.
    pub fn camera(&self, scene: &Scene, index: usize) -> Camera {
        let Some(named) = scene.cameras.get(index) else { return scene.camera };
        let mut camera = named.camera;
        if let Some(world) = named.node.and_then(|node| self.worlds.get(node)) {
            let at_zero = Camera { position: DVec3::ZERO, rotation: DQuat::IDENTITY, ..camera };
            camera = at_zero.transformed(world);
        }
        for (target, value) in &self.values {
            if let &ChannelTarget::Camera(own, kind) = target
                && own == index
            {
                values::set_camera(&mut camera, kind, value);
            }
        }
        camera
    }
}

fn vector(channel: &Channel, time: f64) -> Option<DVec3> {
    let mut value = [0.0; 3];
    channel.sample(time, &mut value).then(|| DVec3::from(value))
}

/// Moves a light to its node. If the node's scale is 0, the light keeps its direction.
fn hang(light: &mut Light, world: &DAffine3) {
    if let Some(place) = light.kind.place_mut() {
        *place = world.translation;
    }
    if let Some(direction) = light.kind.direction_mut() {
        *direction = unit(world.transform_vector3(DVec3::NEG_Z)).unwrap_or(*direction);
    }
}
