//! Thin owners over `ash`: the rules that hold for every Vulkan program, and no decision of a renderer.
//!
//! An owner creates, names and destroys one object. Dropping it hands the object to the device's retire queue, which
//! destroys it once the last submission made so far has completed; so an early `?` never pulls memory from under the
//! GPU. Owners hold an [`Arc<Device>`](Device), and a device holds its instance: owners may be dropped in any order.
//!
//! Helpers fill in `sType` and subresource ranges. They never choose a stage, an access or a layout: these stand at the call, or come to it from the
//! caller's table.
//!
//! **Contract on handles.** Functions here take raw `vk` handles as Vulkan does. A handle must come from a live owner
//! of the same device, and a `vk::CommandBuffer` that is recorded into must be in the recording state, used by one
//! thread at a time. `SAFETY` comments call this "the module's contract". Validation layers check it.
//!
//! Vulkan 1.1 is the baseline; newer features and extensions are used where they exist. One queue does everything.
//!
//! Features of this crate:
//!
//! - `caches`, on by default, reads and writes files. A device's pipelines and measured figures are kept from run to run, in `afterlight` in the user's
//!   cache; [`manifests`] reads the drivers' manifests, by which errors name the file that keeps a driver from being found. Without it the crate reads no file
//!   but `os-release`, for the name of a package to install.
//! - `present` has surfaces and swapchains for a window of any library that gives raw window handles.

#![deny(missing_docs)]

pub mod barrier;
mod buffer;
mod command;
mod descriptor;
mod device;
#[cfg(feature = "caches")]
mod device_file;
mod error;
mod feature_set;
mod functions;
mod image;
#[cfg(feature = "present")]
mod image_formats;
mod instance;
mod instrumentation;
mod journal;
pub mod lack;
#[cfg(feature = "caches")]
pub mod manifests;
mod memory;
mod message;
mod newer;
mod opening;
mod owned;
mod physical;
mod pipeline;
mod pipeline_cache;
mod queries;
pub mod queues;
mod render_pass;
mod reuse;
mod roadmap;
mod sampler;
mod submission;
#[cfg(feature = "present")]
mod surface;
#[cfg(feature = "present")]
mod swapchain;
pub mod sync;
pub mod system;
pub mod upload;

pub use ash::vk;

pub use device::{Device, EnabledFeatures};
pub use error::{Error, Result};
pub use functions::Functions;
pub use instance::{Instance, InstanceOptions, LayerInfo, LoaderInfo, Validation};
pub use journal::{Arguments, Barrier, BarrierPart, Command};
pub use lack::{Lack, Support};
pub use memory::{HeapReport, KindReport, MemoryKind, MemoryReport};
pub use message::{Message, MessageKind, MessageLog, Severity};
pub use physical::{DeviceChoice, NewerFeatures, PhysicalDevice, choose};
pub use roadmap::Roadmap;
pub use submission::{Part, PartWait, SubmitOptions};
#[cfg(feature = "present")]
pub use surface::{HEADLESS, Surface, surface_extensions};
#[cfg(feature = "present")]
pub use swapchain::{Fit, Vsync};

// These take raw handles, and so can be called wrongly: the contract on handles is above.
pub use buffer::Buffer;
pub use command::CommandBuffer;
pub use descriptor::{DescriptorPool, SetLayout, SetLayoutBinding, SetWriter, binding};
#[cfg(feature = "caches")]
pub use device_file::{decode as decode_device_file, encode as encode_device_file};
pub use image::{Image, ImageDesc, format_bytes, is_depth};
#[cfg(feature = "present")]
pub use image_formats::{ImageFormats, ImageWish, image_formats};
pub use memory::Location;
pub use owned::Owned;
pub use pipeline::{
    DepthState, GraphicsPipeline, GraphicsPipelineDesc, PipelinePlace, RenderingPlace, ShaderStage, compute_pipeline,
    pipeline_layout,
};
#[cfg(feature = "caches")]
pub use pipeline_cache::DriverHeader;
pub use queries::Timestamps;
pub use queues::Queue;
pub use render_pass::{
    Framebuffer, MergeFeedback, RecordedPass, RenderPass, RenderPassParts, SubpassDesc, SubpassFeedback, SubpassOrder,
    framebuffer,
};
pub use sampler::OwnedSampler;
pub use submission::Ticket;
#[cfg(feature = "present")]
pub use swapchain::{Acquired, Swapchain, SwapchainDesc, semaphore};
pub use upload::{UploadHandover, UploadOrder, Uploader};
