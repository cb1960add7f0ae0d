//! A scene at a moment, in which nothing moves any more.

use std::borrow::Cow;

use glam::DAffine3;

use super::{ClipChoice, Motion, Playing, Pose, deform, deform_frame};
use crate::{Mesh, NamedCamera, Object, Scene};

impl Scene {
    /// The scene at a moment: objects, lights, cameras and materials have the places and values that clips give them, deformed objects have separate
    /// plain meshes, and nothing moves in the result. A scene without motion is borrowed unchanged.
    pub fn at(&self, playing: &Playing) -> Cow<'_, Self> {
        if !self.moves() {
            return Cow::Borrowed(self);
        }
        Cow::Owned(self.posed(&self.motion.pose(playing)))
    }

    /// Consumes the scene and returns it at a moment, as [`Scene::at`] does, without a copy of its textures.
    #[must_use]
    pub fn into_still(mut self, playing: &Playing) -> Self {
        if !self.moves() {
            return self;
        }
        let textures = std::mem::take(&mut self.textures);
        Self { textures, ..self.posed(&self.motion.pose(playing)) }
    }

    /// Returns true if anything in the scene can move or be deformed, or its particles go on.
    pub fn moves(&self) -> bool {
        let emits = !self.emitters.is_empty() && self.moment.is_none();
        emits || !(self.motion.is_empty() && self.meshes.iter().all(Mesh::is_plain))
    }

    /// Moves objects, lights and cameras that are attached to nodes to the places of their nodes when no clip plays. Readers that set only nodes end
    /// with this.
    pub fn rest(&mut self) {
        let pose = self.motion.pose(&Playing { clips: ClipChoice::None, ..Playing::default() });
        for object in &mut self.objects {
            object.transform = pose.object_transform(object);
        }
        self.lights = pose.lights(self);
        for index in 0..self.cameras.len() {
            self.cameras[index].camera = pose.camera(self, index);
        }
        if let Some(own) = self.looks_through.and_then(|index| self.cameras.get(index)) {
            self.camera = own.camera;
        }
    }

    /// The scene at a pose of its motion, in which nothing moves.
    pub fn posed(&self, pose: &Pose) -> Self {
        let cameras = self.cameras.iter().enumerate();
        let cameras: Vec<_> = cameras
            .map(|(index, own)| NamedCamera { name: own.name.clone(), camera: pose.camera(self, index), node: None })
            .collect();
        let mut materials = self.materials.clone();
        // The scene may not have been checked.
        for index in self.motion.moved_materials() {
            if let Some(own) = materials.get_mut(index) {
                *own = pose.material(self, index);
            }
        }
        let looks_through = self.looks_through.and_then(|index| cameras.get(index));
        let (meshes, objects) = objects(self, pose);
        Self {
            name: self.name.clone(),
            meshes,
            objects,
            materials,
            textures: self.textures.clone(),
            lights: pose.lights(self),
            environment: self.environment,
            sky: self.sky.clone(),
            camera: looks_through.map_or(self.camera, |own| own.camera),
            cameras,
            looks_through: None,
            motion: Motion::default(),
            emitters: self.emitters.clone(),
            moment: self.moment.or((!self.emitters.is_empty()).then_some(pose.time())),
            fitted: self.fitted,
            settings: self.settings.clone(),
            warnings: self.warnings.clone(),
            files: self.files.clone(),
        }
    }
}

impl Mesh {
    /// Returns true if nothing can deform it.
    pub fn is_plain(&self) -> bool {
        self.influences.is_none() && self.morphs.is_empty()
    }

    /// The mesh without its influences and shapes.
    fn plain(&self) -> Self {
        Self {
            name: self.name.clone(),
            origin: self.origin,
            positions: self.positions.clone(),
            normals: self.normals.clone(),
            uvs: self.uvs.clone(),
            tangents: self.tangents.clone(),
            uvs_1: self.uvs_1.clone(),
            colors: self.colors.clone(),
            influences: None,
            morphs: Vec::new(),
            indices: self.indices.clone(),
            is_strokes: self.is_strokes,
            bounds: self.bounds,
            levels: self.levels.clone(),
        }
    }
}

/// The meshes and objects of a moment. A deformed mesh replaces its original if no other object uses the original.
fn objects(scene: &Scene, pose: &Pose) -> (Vec<Mesh>, Vec<Object>) {
    let mut users = vec![0usize; scene.meshes.len()];
    for object in &scene.objects {
        if let Some(users) = users.get_mut(object.mesh) {
            *users += 1;
        }
    }
    let mut own = Vec::new();
    let mut places: Vec<Option<Mesh>> = vec![None; scene.meshes.len()];
    let mut joints = Vec::new();
    let objects = scene.objects.iter().enumerate().map(|(index, object)| {
        let transform = pose.object_transform(object);
        let look = pose.look(scene, index);
        let mut moved = Object { transform, look, node: None, skin: None, ..object.clone() };
        if let Some((deformed, space)) = deformed(scene, pose, object, &mut joints) {
            moved.transform = transform * space;
            if users[object.mesh] == 1 {
                places[object.mesh] = Some(deformed);
            } else {
                moved.mesh = scene.meshes.len() + own.len();
                own.push(deformed);
            }
        }
        moved
    });
    let objects = objects.collect();
    let of_scene = scene.meshes.iter().zip(places).map(|(mesh, place)| place.unwrap_or_else(|| mesh.plain()));
    (of_scene.chain(own).collect(), objects)
}

/// The object's mesh at this moment, and its space; `None` if nothing deforms it.
fn deformed(scene: &Scene, pose: &Pose, object: &Object, joints: &mut Vec<DAffine3>) -> Option<(Mesh, DAffine3)> {
    let mesh = scene.meshes.get(object.mesh)?;
    let weights = object.node.map(|node| pose.weights(node)).unwrap_or_default();
    let shaped = weights.iter().zip(&mesh.morphs).any(|(weight, _)| *weight != 0.0);
    let skin = object.skin.filter(|_| mesh.influences.is_some());
    let mut space = DAffine3::IDENTITY;
    if let Some(skin) = skin {
        pose.joint_matrices(&scene.motion, skin, &DAffine3::IDENTITY, joints);
        space = deform_frame(joints);
        joints.iter_mut().for_each(|joint| *joint = space * *joint);
    }
    (shaped || skin.is_some()).then(|| (deform(mesh, weights, skin.map(|_| joints.as_slice())), space))
}
