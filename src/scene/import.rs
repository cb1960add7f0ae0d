//! What a reader of model files is asked for and hands over.

use std::path::PathBuf;

use glam::DAffine3;

use super::motion::First;
use super::{Light, Material, Mesh, Motion, NamedCamera, Object, Scene, Texture, TextureSlot};

/// How to load a model.
#[derive(Default, Clone, Copy)]
pub struct LoadOptions<'a> {
    /// Told how far long work has come; called from several threads.
    pub progress: Option<&'a (dyn Fn(Progress) + Sync)>,
}

impl LoadOptions<'_> {
    pub(crate) fn report(&self, what: &'static str, done: usize, total: usize) {
        if let Some(progress) = self.progress {
            progress(Progress { what, done, total });
        }
    }
}

/// A step of loading: `done` of `total` units of `what`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// What is counted.
    pub what: &'static str,
    /// Units that are done.
    pub done: usize,
    /// Units in all.
    pub total: usize,
}

/// A model file's content. Indices point into the lists here.
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
    /// Where it can be seen from.
    pub cameras: Vec<NamedCamera>,
    /// What moves in it.
    pub motion: Motion,
    /// What was odd and how it was handled, a line each.
    pub warnings: Vec<String>,
    /// The files that it was read from.
    pub files: Vec<PathBuf>,
}

impl Imported {
    /// Adds everything to a scene, its objects, lights and cameras moved by `transform`.
    pub fn append_to(self, scene: &mut Scene, transform: DAffine3) {
        let (first_mesh, first_material) = (scene.meshes.len(), scene.materials.len());
        let (first_texture, first_camera) = (scene.textures.len(), scene.cameras.len());
        let first_skin = scene.motion.skins.len();
        // Nodes hang on one of their own that stands where the model does.
        let root = (!self.motion.nodes.is_empty()).then_some(scene.motion.nodes.len());
        let node = |node: Option<usize>| node.zip(root).map(|(node, root)| root + 1 + node);
        scene.meshes.extend(self.meshes);
        scene.textures.extend(self.textures);
        scene.materials.extend(self.materials.into_iter().map(|mut material| {
            for slot in TextureSlot::ALL {
                if let Some(texture) = material.texture_mut(slot) {
                    *texture += first_texture;
                }
            }
            material
        }));
        scene.objects.extend(self.objects.into_iter().map(|object| Object {
            mesh: object.mesh + first_mesh,
            material: object.material + first_material,
            transform: transform * object.transform,
            node: node(object.node),
            skin: object.skin.map(|skin| skin + first_skin),
            ..object
        }));
        scene.motion.append(
            self.motion,
            transform,
            First { light: scene.lights.len(), camera: first_camera, material: first_material },
        );
        scene.lights.extend(self.lights.into_iter().map(|light| light.transformed(&transform)));
        scene.cameras.extend(self.cameras.into_iter().map(|own| NamedCamera {
            camera: own.camera.transformed(&transform),
            node: node(own.node),
            ..own
        }));
        scene.warnings.extend(self.warnings);
        scene.files.extend(self.files);
    }
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
                color_space: crate::scene::ColorSpace::Linear,
                sampler: Default::default(),
                texels: vec![0; 4],
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
