//! The play in which calls fail: a scene is drawn from the first call of Vulkan to the last, in stages.

use std::fmt;
use std::sync::Arc;

use afterlight::frame::{self, Picture, Renderer};
use afterlight::gpu::{self, Device, DeviceChoice, Instance, InstanceOptions, Validation};
use afterlight::scene::{ColorSpace, LightPath, OpenOptions, Sampler, Scene, Settings, SyncApi, Texture, open};

/// A part of the play. The calls that are made in it are its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PlayStage {
    StartUp,
    Upload,
    Frame,
    ReadBack,
    Settings,
    Presentation,
    Resize,
    Shutdown,
}

impl PlayStage {
    pub const ALL: [PlayStage; 8] = [
        PlayStage::StartUp,
        PlayStage::Upload,
        PlayStage::Frame,
        PlayStage::ReadBack,
        PlayStage::Settings,
        PlayStage::Presentation,
        PlayStage::Resize,
        PlayStage::Shutdown,
    ];
}

impl fmt::Display for PlayStage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            PlayStage::StartUp => "start-up",
            PlayStage::Upload => "upload",
            PlayStage::Frame => "a frame",
            PlayStage::ReadBack => "read-back",
            PlayStage::Settings => "settings",
            PlayStage::Presentation => "presentation",
            PlayStage::Resize => "resize",
            PlayStage::Shutdown => "shutdown",
        })
    }
}

/// A play: a scene with the settings that it is drawn with, presented or not.
pub struct Play {
    scene: Scene,
    settings: Settings,
    /// Settings with other passes.
    others: Settings,
    /// Settings with the other synchronization API, for devices that have it.
    by_2: Option<Settings>,
    presents: bool,
    validation: Validation,
}

const SIZE: [u32; 2] = [32, 18];

fn checkers() -> Texture {
    let texels = [[255; 4], [0, 0, 0, 255], [0, 0, 0, 255], [255; 4]].concat().into();
    let (name, sampler) = ("checkers".into(), Sampler::DEFAULT);
    Texture { name, size: [2, 2], color_space: ColorSpace::Linear, sampler, texels }
}

impl Play {
    /// All of it, under validation, with a sampler and texels to upload.
    pub fn whole() -> Self {
        Self::new(true, presents(), Validation::Synchronization)
    }

    /// Plays without presentation, and without layers that allocate memory: each allocation is the driver's or the loader's.
    pub fn bare() -> Self {
        Self::new(false, false, Validation::Off)
    }

    fn new(textured: bool, presents: bool, validation: Validation) -> Self {
        let mut scene = open("builtin:spheres", &OpenOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        if textured {
            scene.textures.push(checkers());
            scene.meshes.iter_mut().for_each(|mesh| mesh.uvs.resize(mesh.positions.len(), [0.0; 2]));
            scene.materials.iter_mut().for_each(|material| material.base_color_texture = Some(0));
        }
        let settings = Settings { size: SIZE, samples: 1, anisotropy: 1, ..scene.settings.decide() };
        let settings = Settings { light_path: LightPath::Loop, ..settings };
        let others = Settings { light_path: LightPath::Compute, ..settings.clone() };
        let by_2 = textured.then(|| Settings { sync: SyncApi::Two, ..settings.clone() });
        Self { scene, settings, others, by_2, presents, validation }
    }

    pub fn start(&self) -> gpu::Result<Arc<Device>> {
        let options = InstanceOptions { validation: self.validation, ..InstanceOptions::default() };
        let (extensions, of_devices): (&[_], &[_]) = match self.presents {
            #[cfg(feature = "window")]
            true => (&gpu::HEADLESS, &[c"VK_KHR_swapchain"]),
            _ => (&[], &[]),
        };
        let instance = Instance::with_extensions(&options, extensions)?;
        Device::with_extensions(&instance, &DeviceChoice::Auto, of_devices)
    }

    /// Draws the pictures of all stages but the first and the last, and calls `ended` after each stage.
    pub fn draw(&self, device: &Arc<Device>, ended: &mut dyn FnMut(PlayStage)) -> Result<Vec<Picture>, frame::Error> {
        let mut pictures = Vec::new();
        {
            let mut renderer = Renderer::new(device, &self.scene, &self.settings)?;
            ended(PlayStage::Upload);
            (0..3).try_for_each(|_| renderer.render(&self.scene.camera))?;
            renderer.wait()?;
            ended(PlayStage::Frame);
            pictures.push(renderer.read_back()?);
            ended(PlayStage::ReadBack);
        }
        {
            let mut renderer = Renderer::new(device, &self.scene, &self.others)?;
            pictures.push(renderer.picture(&self.scene.camera, || {})?);
        }
        if let Some(by_2) = &self.by_2 {
            // A device that lacks the API, or does not open with it, draws the same by the other.
            let has_both = device.physical.newer.synchronization2.is_ok();
            let by_2 = if has_both { by_2 } else { &self.settings };
            let mut renderer = Renderer::new(device, &self.scene, by_2)?;
            pictures.push(renderer.picture(&self.scene.camera, || {})?);
        }
        ended(PlayStage::Settings);
        #[cfg(feature = "window")]
        if self.presents {
            self.present(device, ended, &mut pictures)?;
        }
        Ok(pictures)
    }

    #[cfg(feature = "window")]
    fn present(
        &self,
        device: &Arc<Device>,
        ended: &mut dyn FnMut(PlayStage),
        pictures: &mut Vec<Picture>,
    ) -> Result<(), frame::Error> {
        use afterlight::frame::Presenter;
        use afterlight::gpu::{Surface, Vsync};

        let surface = Surface::headless(device)?;
        let mut presenter = Presenter::new(device, surface, &self.scene, &self.settings, Vsync::On)?;
        for (settings, size, stage) in [
            (&self.settings, SIZE, PlayStage::Presentation),
            (&self.settings, [SIZE[0] + 7, SIZE[1] + 5], PlayStage::Resize),
            (&self.others, SIZE, PlayStage::Settings),
        ] {
            if stage == PlayStage::Settings {
                presenter.change(false);
            }
            pictures.push(self.show(device, &mut presenter, (settings, size))?);
            ended(stage);
        }
        Ok(())
    }

    /// Three frames as a window shows them, and the picture of the last: a frame that cannot be shown is fitted and shown again.
    #[cfg(feature = "window")]
    fn show(
        &self,
        device: &Device,
        presenter: &mut frame::Presenter,
        (settings, size): (&Settings, [u32; 2]),
    ) -> Result<Picture, frame::Error> {
        use afterlight::frame::Outcome;
        use afterlight::gpu::{Fit, Surface};

        presenter.fit(&self.scene, settings, size)?;
        let (mut shown, mut tries) = (0, 0);
        while shown < 3 {
            tries += 1;
            assert!(tries < 20, "frames are not shown again");
            let outcome = presenter.draw(&self.scene.camera, shown == 2, None)?;
            let fit = match outcome {
                Outcome::Shown(fit) => {
                    shown += 1;
                    fit
                }
                Outcome::Nothing(fit) => fit,
            };
            if fit == Fit::SurfaceLost {
                presenter.lose_surface();
                presenter.replace_surface(Surface::headless(device)?)?;
            }
            if fit != Fit::Exact {
                presenter.fit(&self.scene, settings, size)?;
                shown = 0;
            }
        }
        presenter.picture()
    }
}

/// Returns true if surfaces without a display can be made.
fn presents() -> bool {
    #[cfg(feature = "window")]
    return Instance::with_extensions(&InstanceOptions::default(), &gpu::HEADLESS).is_ok();
    #[cfg(not(feature = "window"))]
    false
}
