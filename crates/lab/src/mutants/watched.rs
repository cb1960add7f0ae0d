//! A device that one mode of the synchronization layer watches, and the layer's messages about frames on it.

use std::ffi::CStr;
use std::sync::Arc;

use super::experiment::{self, PresentPath};
use afterlight::frame::rows::Rows;
use afterlight::frame::{self, Picture};
use afterlight::gpu::{self, Device, DeviceChoice, Instance, InstanceOptions, Message, Validation};
use afterlight::scene::{Scene, Settings};

/// Extensions of the instance and of the device.
pub type WatchedExtensions = (&'static [&'static CStr], &'static [&'static CStr]);
/// No extensions: enough for frames that are not presented.
pub const NO_EXTENSIONS: WatchedExtensions = (&[], &[]);

/// A device under the layer.
pub struct LayerDevice {
    instance: Arc<Instance>,
    device: Arc<Device>,
}

/// Frames that were drawn.
pub struct Drawn {
    /// Of straight frames the last that was copied, of presented ones the first.
    pub picture: Picture,
    /// The layer's messages about them.
    pub messages: Vec<Message>,
    /// The number of messages that were not kept.
    pub more: u64,
}

impl LayerDevice {
    /// Opens a device under the layer, with its heuristic of accesses by shaders or without. `None` where the layer has no heuristic.
    pub fn open(choice: &DeviceChoice, heuristic: bool, extensions: WatchedExtensions) -> gpu::Result<Option<Self>> {
        let validation = Validation::Synchronization;
        let options = InstanceOptions { validation, sync_shader_heuristic: heuristic, ..InstanceOptions::default() };
        let instance = Instance::with_extensions(&options, extensions.0)?;
        if instance.sync_shader_heuristic() != heuristic {
            return Ok(None);
        }
        let device = Device::with_extensions(&instance, choice, extensions.1)?;
        Ok(Some(Self { instance, device }))
    }

    /// Opens a device without the layer: nothing is said of its frames.
    pub fn without_layer(choice: &DeviceChoice) -> gpu::Result<Self> {
        let instance = Instance::new(&InstanceOptions::default())?;
        let device = Device::new(&instance, choice)?;
        Ok(Self { instance, device })
    }

    /// The layer's version, packed as Vulkan packs it.
    pub fn layer(&self) -> u32 {
        self.instance.validation_layer().unwrap_or_default()
    }

    /// The device that frames are drawn on.
    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// Draws frames with these dependencies, presented in this way if any, and returns the layer's messages about them.
    ///
    /// # Safety
    /// As of [`frame::Renderer::with_rows`].
    ///
    /// # Errors
    /// As [`experiment::draw`] and [`experiment::present`].
    pub unsafe fn draw(
        &self,
        scene: &Scene,
        settings: &Settings,
        rows: Rows,
        path: Option<PresentPath>,
    ) -> Result<Drawn, frame::Error> {
        self.instance.take_messages();
        // SAFETY: the caller's promise.
        let picture = unsafe {
            match path {
                #[cfg(feature = "present")]
                Some(path) => experiment::present(&self.device, scene, settings, rows, path),
                _ => experiment::draw(&self.device, scene, settings, rows),
            }
        }?;
        let more = self.instance.message_log().dropped();
        let ours = self.instance.take_messages().into_iter().filter(Message::is_about_this_program);
        Ok(Drawn { picture, messages: ours.collect(), more })
    }
}
