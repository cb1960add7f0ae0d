//! The scene that is uploaded.

use crate::scene::{Scene, Texels};

/// A scene that stays as it is, or that goes while it is uploaded.
pub enum UploadSource<'a> {
    /// Others need it, too.
    Kept(&'a Scene),
    /// Staged data is freed at once, so that the peak of memory is one scene and not two: on devices whose memory is the process's own.
    Taken(&'a mut Scene),
}

impl<'a> From<&'a Scene> for UploadSource<'a> {
    fn from(scene: &'a Scene) -> Self {
        Self::Kept(scene)
    }
}

impl<'a> From<&'a mut Scene> for UploadSource<'a> {
    fn from(scene: &'a mut Scene) -> Self {
        Self::Taken(scene)
    }
}

impl UploadSource<'_> {
    /// Returns the scene, or its remainder once data has been freed.
    pub fn scene(&self) -> &Scene {
        match self {
            Self::Kept(scene) => scene,
            Self::Taken(scene) => scene,
        }
    }

    /// Frees meshes and the sky, if the scene was given up.
    pub(super) fn forget_all_but_textures(&mut self) {
        if let Self::Taken(scene) = self {
            (scene.meshes, scene.sky) = (Vec::new(), None);
        }
    }

    /// Frees a texture's texels, if the scene was given up.
    pub(super) fn forget_texels(&mut self, texture: usize) {
        if let Self::Taken(scene) = self {
            scene.textures[texture].texels = Texels::Rgba8(Vec::new());
        }
    }

    /// Frees all textures, including textures that no plan uploads, if the scene was given up.
    pub(super) fn forget_textures(&mut self) {
        if let Self::Taken(scene) = self {
            scene.textures = Vec::new();
        }
    }
}
