//! The input and the output of readers of model files.

use std::path::PathBuf;

use glam::DAffine3;

use super::motion::FirstIndices;
use super::{
    ChannelTarget, Environment, Light, Material, Mesh, Motion, NamedCamera, Object, Scene, SettingsPatch, Texture,
    TextureSlot,
};

/// Options for loading a model. They need the feature `readers`.
#[derive(Default, Clone, Copy)]
pub struct LoadOptions<'a> {
    /// Called with the progress of long work, from several threads.
    pub progress: Option<&'a (dyn Fn(Progress) + Sync)>,
}

impl LoadOptions<'_> {
    /// Tells the caller that `done` of `total` units of `what` are done.
    pub fn report(&self, what: &'static str, done: usize, total: usize) {
        if let Some(progress) = self.progress {
            progress(Progress { what, done, total });
        }
    }
}

/// A step of loading: `done` of `total` units of `what`. Needs the feature `readers`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// The units that are counted, as "meshes".
    pub what: &'static str,
    /// Units that are done.
    pub done: usize,
    /// Units in all.
    pub total: usize,
}

/// A model file's content. Indices point into the lists here. Needs the feature `readers`.
#[derive(Debug, Clone, Default)]
pub struct Imported {
    /// The meshes.
    pub meshes: Vec<Mesh>,
    /// The objects; each has one of the meshes and one of the materials.
    pub objects: Vec<Object>,
    /// The materials.
    pub materials: Vec<Material>,
    /// The textures of the materials.
    pub textures: Vec<Texture>,
    /// The sources of light.
    pub lights: Vec<Light>,
    /// The cameras of its file.
    pub cameras: Vec<NamedCamera>,
    /// The file's nodes, skins, shapes and clips.
    pub motion: Motion,
    /// The surroundings of a file that this program has exported. They apply to a bare model only: a scene file has its own.
    pub surroundings: Option<Surroundings>,
    /// Oddities and how each was handled, a line each.
    pub warnings: Vec<String>,
    /// The files that it was read from.
    pub files: Vec<PathBuf>,
}

/// The environment and the settings of an exported scene. They need the feature `readers`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surroundings {
    /// Ambient light and background.
    pub environment: Environment,
    /// True if the file gives the ambient light, even if it is black. If false, and the file has no lights, the exported scene was lit by something
    /// that the file lacks.
    pub is_lit: bool,
    /// The given settings, and the exposure.
    pub settings: SettingsPatch,
}

impl Imported {
    /// Adds everything to a scene, its objects, lights and cameras moved by `transform`.
    pub fn append_to(mut self, scene: &mut Scene, transform: DAffine3) {
        self.give_assets(scene);
        self.place(scene, &[transform]);
    }

    /// Drops its lights, and the channels that move them.
    pub(super) fn drop_lights(&mut self) {
        self.lights.clear();
        self.motion.light_nodes.clear();
        for clip in &mut self.motion.clips {
            clip.channels.retain(|channel| !matches!(channel.target, ChannelTarget::Light(..)));
        }
    }

    /// Moves the assets that all copies of the model share into a scene: meshes, materials, textures, warnings and files. Objects and clips of the
    /// model then use the scene's indices.
    pub(super) fn give_assets(&mut self, scene: &mut Scene) {
        let first_texture = scene.textures.len();
        let (first_mesh, first_material) = (scene.meshes.len(), scene.materials.len());
        for material in &mut self.materials {
            for slot in TextureSlot::ALL {
                if let Some(texture) = material.texture_mut(slot) {
                    *texture += first_texture;
                }
            }
        }
        for object in &mut self.objects {
            object.mesh += first_mesh;
            object.material += first_material;
        }
        self.motion.move_materials(first_material);
        scene.meshes.append(&mut self.meshes);
        scene.textures.append(&mut self.textures);
        scene.materials.append(&mut self.materials);
        scene.warnings.append(&mut self.warnings);
        scene.files.append(&mut self.files);
    }

    /// Adds copies to a scene that has the model's assets. If skin joints are the model's only nodes, all copies share them. Otherwise each copy has
    /// separate nodes, moved by the same clips.
    pub(super) fn place(&self, scene: &mut Scene, places: &[DAffine3]) {
        let hang_on_joints = self.objects.iter().all(|object| object.node.is_none() || object.skin.is_some());
        let of_others = self.motion.light_nodes.iter().chain(self.cameras.iter().map(|own| &own.node));
        let shows_cells = !self.motion.moved_cells().is_empty();
        let share_joints = places.len() > 1 && hang_on_joints && of_others.flatten().next().is_none() && !shows_cells;
        let first_clip = scene.motion.clips.len();
        let mut joints = None;
        for (copy, place) in places.iter().enumerate() {
            let moved = joints.unwrap_or_else(|| {
                let at = if share_joints { DAffine3::IDENTITY } else { *place };
                self.add_motion(scene, at, (copy > 0).then_some(first_clip))
            });
            joints = share_joints.then_some(moved);
            self.add_objects(scene, place, moved, share_joints);
        }
    }

    /// Adds the nodes of a copy. If `clips` is given, its channels are merged into the clips of an earlier copy, which begin at that index.
    fn add_motion(&self, scene: &mut Scene, place: DAffine3, clips: Option<usize>) -> Moved {
        let root = (!self.motion.nodes.is_empty()).then_some(scene.motion.nodes.len());
        let skin = scene.motion.skins.len();
        let first =
            FirstIndices { light: scene.lights.len(), camera: scene.cameras.len(), object: scene.objects.len() };
        scene.motion.append(self.motion.clone(), place, first);
        if let Some(first_clip) = clips {
            scene.motion.merge_clips(first_clip, self.motion.clips.len());
        }
        Moved { root, skin }
    }

    fn add_objects(&self, scene: &mut Scene, place: &DAffine3, Moved { root, skin }: Moved, share_joints: bool) {
        // The copy's nodes are below a root node with the model's transform. So joints have that transform too, unless copies share them.
        let stands = |object: &Object| object.skin.is_some() && !share_joints;
        let node = |node: Option<usize>| node.zip(root).map(|(node, root)| root + 1 + node);
        scene.objects.extend(self.objects.iter().map(|object| Object {
            transform: if stands(object) { object.transform } else { *place * object.transform },
            node: node(object.node),
            skin: object.skin.map(|own| own + skin),
            ..object.clone()
        }));
        scene.lights.extend(self.lights.iter().map(|light| light.clone().transformed(place)));
        scene.cameras.extend(self.cameras.iter().map(|own| NamedCamera {
            camera: own.camera.transformed(place),
            node: node(own.node),
            ..own.clone()
        }));
    }
}

/// The indices of a copy's root node and first skin in the scene.
#[derive(Debug, Clone, Copy)]
struct Moved {
    /// The root node of the copy's nodes, if it has any.
    root: Option<usize>,
    /// The number of its first skin.
    skin: usize,
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn what_is_appended_keeps_pointing_at_its_own() {
        let imported = Imported {
            meshes: vec![Mesh::default()],
            objects: vec![Object::new("a", 0, 0, DAffine3::IDENTITY)],
            materials: vec![Material { normal_texture: Some(0), ..Material::default() }],
            textures: vec![Texture {
                name: "n".into(),
                size: [1, 1],
                color_space: crate::ColorSpace::Linear,
                sampler: Default::default(),
                texels: vec![0; 4].into(),
            }],
            warnings: vec!["odd".into()],
            files: vec!["a.obj".into()],
            ..Imported::default()
        };
        let mut scene = Scene::default();
        imported.clone().append_to(&mut scene, DAffine3::IDENTITY);
        imported.append_to(&mut scene, DAffine3::from_translation(DVec3::X));
        let second = &scene.objects[1];
        assert_eq!((second.mesh, second.material, second.transform.translation), (1, 1, DVec3::X));
        assert_eq!(scene.materials[1].normal_texture, Some(1));
        assert_eq!((scene.textures.len(), scene.warnings.len(), scene.files.len()), (2, 2, 2));
    }
}
