//! The helper of the steps: instance, validation layer, device, memory, names, owners, PNG. The scene that they draw is in [`scene`].
//!
//! It removes boilerplate and takes no decision: stages, accesses, layouts, load and store operations stand in each step's own file.

pub mod scene;
#[cfg(feature = "window")]
pub mod window;

use std::cell::{Cell, RefCell};
use std::ffi::{CStr, CString, c_void};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};

use ash::ext::{self, debug_utils};
use ash::vk::{self, DebugUtilsMessengerCallbackDataEXT as Data, MemoryPropertyFlags as Properties};
use ash::{Device, Instance};
use vk::{DebugUtilsMessageSeverityFlagsEXT as Severity, DebugUtilsMessageTypeFlagsEXT as Types};

type Messenger = (debug_utils::Instance, vk::DebugUtilsMessengerEXT);
type Destroy<H> = unsafe fn(&Device, H, Option<&vk::AllocationCallbacks<'_>>);
type Destroyer = Box<dyn FnOnce(&Device)>;
type StageInfo = vk::PipelineShaderStageCreateInfo<'static>;
pub type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

const LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";
static MESSAGES: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// An entry point of a shader: its name and its SPIR-V.
pub type Entry = (&'static CStr, &'static [u8]);

/// The entry point `$name` of the step's `shaders.wgsl`.
#[macro_export]
macro_rules! entry {
    ($name:literal) => {{
        let Ok(name) = std::ffi::CStr::from_bytes_with_nul(concat!($name, "\0").as_bytes()) else { panic!() };
        (name, include_bytes!(concat!(env!("OUT_DIR"), "/", env!("CARGO_BIN_NAME"), "/", $name, ".spv")).as_slice())
    }};
}

/// Requirements of a step that not every device meets.
#[derive(Default)]
pub struct Needs<'a> {
    /// The version of Vulkan that the step is written for; 0 means 1.1.
    pub api_version: u32,
    pub instance_extensions: &'a [&'a CStr],
    pub extensions: &'a [&'a CStr],
    /// With newer structures in its chain.
    pub features: vk::PhysicalDeviceFeatures2<'a>,
}

/// A device with one queue. It owns every object that a step makes, and destroys the last one first.
pub struct Gpu {
    pub device: Device,
    pub instance: Instance,
    pub physical: vk::PhysicalDevice,
    pub queue: vk::Queue,
    pub family: u32,
    pub picture: PathBuf,
    without: Option<String>,
    left_out: Cell<bool>,
    debug: Option<(debug_utils::Instance, vk::DebugUtilsMessengerEXT, debug_utils::Device)>,
    objects: RefCell<Vec<Destroyer>>,
    pub entry: ash::Entry,
}

/// A buffer, bound to memory of its own, and that memory as the host sees it, if it does.
#[derive(Clone, Copy)]
pub struct Buffer {
    pub raw: vk::Buffer,
    pub size: u64,
    mapped: Option<*mut u8>,
}

/// An image, bound to memory of its own, with a view of all of it: null for an image that is only copied.
#[derive(Clone, Copy)]
pub struct Image {
    pub raw: vk::Image,
    pub view: vk::ImageView,
    pub range: vk::ImageSubresourceRange,
}

/// Runs a step: opens a device, calls `draw`, destroys all, and prints what went wrong. Anything did if the validation layer has a message.
pub fn run(needs: &Needs, draw: impl FnOnce(&Gpu) -> Result<()>) -> ExitCode {
    let result = Gpu::open(needs).and_then(|gpu| {
        gpu.name("queue", gpu.queue)?;
        draw(&gpu)?;
        match gpu.without.as_ref().filter(|_| !gpu.left_out.get()) {
            Some(name) => Err(format!("--without {name}: this step has nothing of that name").into()),
            None => Ok(()),
        }
    });
    let messages = std::mem::take(&mut *MESSAGES.lock().unwrap_or_else(PoisonError::into_inner));
    let lines: Vec<_> = messages.into_iter().chain(result.err().map(|error| format!("error: {error}"))).collect();
    lines.iter().for_each(|line| eprintln!("{line}"));
    if lines.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

impl Gpu {
    fn open(needs: &Needs) -> Result<Self> {
        let (without, picture) = match std::env::args().skip(1).collect::<Vec<_>>().as_slice() {
            [picture] => (None, picture.into()),
            [flag, name, picture] if flag == "--without" => (Some(name.clone()), picture.into()),
            _ => return Err("usage: STEP [--without NAME] PICTURE.png".into()),
        };
        // SAFETY: loading the system's Vulkan loader runs its initializers, as intended.
        let entry = unsafe { ash::Entry::load() }.map_err(|error| format!("there is no Vulkan loader: {error}"))?;
        let (instance, debug) = instance(&entry, needs)?;
        // SAFETY: the instance is alive, and everything that the structures point to lives until the calls return.
        unsafe {
            let physical = *instance.enumerate_physical_devices()?.first().ok_or("no Vulkan device was found")?;
            let offered = instance.enumerate_device_extension_properties(physical)?;
            let lacks = |name: &&&CStr| !offered.iter().any(|one| one.extension_name_as_c_str() == Ok(**name));
            if let Some(name) = needs.extensions.iter().find(lacks) {
                return Err(format!("this device lacks {}, which the step is about", name.to_string_lossy()).into());
            }
            let families = instance.get_physical_device_queue_family_properties(physical);
            let family = families.iter().position(|family| family.queue_flags.contains(vk::QueueFlags::GRAPHICS));
            let family = family.ok_or("the device has no queue for graphics")? as u32;
            let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0])];
            let extensions: Vec<_> = needs.extensions.iter().map(|name| name.as_ptr()).collect();
            let mut features = needs.features;
            let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_extension_names(&extensions);
            let device = instance.create_device(physical, &info.push_next(&mut features), None)?;
            let debug = debug.map(|(all, messenger)| (all, messenger, debug_utils::Device::new(&instance, &device)));
            let (queue, left_out, objects) = (device.get_device_queue(family, 0), Cell::default(), RefCell::default());
            Ok(Self { device, instance, physical, queue, family, picture, without, left_out, debug, objects, entry })
        }
    }

    /// Returns `value`, or nothing (no bits, `false`, no elements) if the program was started with `--without name`.
    pub fn keep<T: Default>(&self, name: &str, value: T) -> T {
        let is_left_out = self.without.as_deref() == Some(name);
        self.left_out.set(self.left_out.get() || is_left_out);
        if is_left_out { T::default() } else { value }
    }

    /// Names an object for messages and debuggers.
    pub fn name<H: vk::Handle + Copy>(&self, name: &str, object: H) -> Result<H> {
        let name = CString::new(name)?;
        if let Some((_, _, functions)) = &self.debug {
            let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(object).object_name(&name);
            // SAFETY: the object is one of this device's, and alive.
            unsafe { functions.set_debug_utils_object_name(&info)? };
        }
        Ok(object)
    }

    /// Names an object, and has `destroy` called for it at the end.
    pub fn own<H: vk::Handle + Copy + 'static>(&self, name: &str, object: H, destroy: Destroy<H>) -> Result<H> {
        // SAFETY: the device is idle by then, and whatever was made from the object is gone: `Gpu` destroys the last object first.
        self.objects.borrow_mut().push(Box::new(move |device| unsafe { destroy(device, object, None) }));
        self.name(name, object)
    }

    /// Makes a buffer in memory with `properties`.
    pub fn buffer(&self, name: &str, info: &vk::BufferCreateInfo, properties: Properties) -> Result<Buffer> {
        // SAFETY: the buffer is new, and its memory is as large as it needs and stays mapped as long as it lives.
        unsafe {
            let raw = self.own(name, self.device.create_buffer(info, None)?, Device::destroy_buffer)?;
            let memory = self.memory(name, self.device.get_buffer_memory_requirements(raw), &[properties])?;
            self.device.bind_buffer_memory(raw, memory, 0)?;
            let map = || self.device.map_memory(memory, 0, info.size, vk::MemoryMapFlags::empty());
            let mapped = properties.contains(Properties::HOST_VISIBLE).then(map).transpose()?.map(<*mut c_void>::cast);
            Ok(Buffer { raw, size: info.size, mapped })
        }
    }

    /// Makes an image, with a view unless it is only copied, in memory with the first of `properties` that the device offers for it.
    pub fn image(&self, name: &str, info: &vk::ImageCreateInfo, properties: &[Properties]) -> Result<Image> {
        let is_depth = info.usage.contains(vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT);
        let aspect_mask = if is_depth { vk::ImageAspectFlags::DEPTH } else { vk::ImageAspectFlags::COLOR };
        let range = vk::ImageSubresourceRange { aspect_mask, level_count: 1, layer_count: 1, ..Default::default() };
        let view = vk::ImageViewCreateInfo::default().view_type(vk::ImageViewType::TYPE_2D).format(info.format);
        // SAFETY: the image is new, and its memory is as large as it needs.
        unsafe {
            let raw = self.own(name, self.device.create_image(info, None)?, Device::destroy_image)?;
            let memory = self.memory(name, self.device.get_image_memory_requirements(raw), properties)?;
            self.device.bind_image_memory(raw, memory, 0)?;
            let mut image = Image { raw, view: vk::ImageView::null(), range };
            if !(vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST).contains(info.usage) {
                let view = self.device.create_image_view(&view.image(raw).subresource_range(range), None)?;
                image.view = self.own(name, view, Device::destroy_image_view)?;
            }
            Ok(image)
        }
    }

    fn memory(&self, name: &str, needs: vk::MemoryRequirements, wanted: &[Properties]) -> Result<vk::DeviceMemory> {
        // SAFETY: the device is alive.
        let offered = unsafe { self.instance.get_physical_device_memory_properties(self.physical) };
        let suits = |(index, kind): (usize, &vk::MemoryType), wanted: &Properties| {
            needs.memory_type_bits >> index & 1 == 1 && kind.property_flags.contains(*wanted)
        };
        let types = || offered.memory_types_as_slice().iter().enumerate();
        let index = wanted.iter().find_map(|wanted| types().position(|kind| suits(kind, wanted)));
        let index = index.ok_or_else(|| format!("the device has no memory that suits {name}"))? as u32;
        let info = vk::MemoryAllocateInfo::default().allocation_size(needs.size).memory_type_index(index);
        // SAFETY: the type is one of the device's.
        self.own(name, unsafe { self.device.allocate_memory(&info, None)? }, Device::free_memory)
    }

    /// Writes to a buffer that the host sees.
    pub fn write(&self, buffer: &Buffer, bytes: &[u8]) -> Result<()> {
        let mapped = buffer.mapped.filter(|_| bytes.len() as u64 <= buffer.size);
        let mapped = mapped.ok_or("the host does not see this buffer, or it is too small")?;
        // SAFETY: the memory is mapped, has room, and lives as long as `self`.
        unsafe { mapped.copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) };
        Ok(())
    }

    /// Reads a buffer that the host sees.
    pub fn read(&self, buffer: &Buffer) -> Result<Vec<u8>> {
        let mapped = buffer.mapped.ok_or("the host does not see this buffer")?;
        // SAFETY: the memory is mapped, as large, and lives as long as `self`.
        Ok(unsafe { std::slice::from_raw_parts(mapped, buffer.size as usize) }.to_vec())
    }

    /// Makes the stage of a pipeline.
    pub fn stage(&self, stage: vk::ShaderStageFlags, (name, spirv): Entry) -> Result<StageInfo> {
        let code = ash::util::read_spv(&mut std::io::Cursor::new(spirv))?;
        let info = vk::ShaderModuleCreateInfo::default().code(&code);
        // SAFETY: the shader compiler has made and checked the code.
        let module = unsafe { self.device.create_shader_module(&info, None)? };
        let module = self.own(&name.to_string_lossy(), module, Device::destroy_shader_module)?;
        Ok(StageInfo::default().stage(stage).module(module).name(name))
    }

    /// Writes the picture: RGBA, 8 bits a channel, rows from the top.
    pub fn save(&self, size: vk::Extent2D, rgba: &[u8]) -> Result<()> {
        let (path, kind) = (&self.picture, image::ColorType::Rgba8);
        image::save_buffer_with_format(path, rgba, size.width, size.height, kind, image::ImageFormat::Png)
            .map_err(|error| format!("{} cannot be written: {error}", path.display()).into())
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        // SAFETY: nothing is in use once the device is idle or lost, and the last object is destroyed first.
        unsafe {
            let _ = self.device.device_wait_idle();
            self.objects.take().into_iter().rev().for_each(|destroy| destroy(&self.device));
            self.device.destroy_device(None);
            if let Some((functions, messenger, _)) = &self.debug {
                functions.destroy_debug_utils_messenger(*messenger, None);
            }
            self.instance.destroy_instance(None);
        }
    }
}

/// Makes the instance. If the validation layer is installed, it checks core rules and synchronization, and its messages are collected.
fn instance(entry: &ash::Entry, needs: &Needs) -> Result<(Instance, Option<Messenger>)> {
    let application = vk::ApplicationInfo::default().api_version(needs.api_version.max(vk::API_VERSION_1_1));
    let mut extensions: Vec<_> = needs.instance_extensions.iter().map(|name| name.as_ptr()).collect();
    let info = vk::InstanceCreateInfo::default().application_info(&application);
    let messenger = vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(Severity::WARNING | Severity::ERROR)
        .message_type(Types::VALIDATION)
        .pfn_user_callback(Some(collect));
    // Older layers take a list of features, layers from 2024 on settings by name.
    let enables = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enables);
    let set = |name, value: &'static vk::Bool32| vk::LayerSettingEXT {
        value_count: 1,
        p_values: std::ptr::from_ref(value).cast(),
        ..vk::LayerSettingEXT::default().layer_name(LAYER).setting_name(name).ty(vk::LayerSettingTypeEXT::BOOL32)
    };
    let (on, off, shaders) = (&vk::TRUE, &vk::FALSE, c"syncval_shader_accesses_heuristic");
    let settings = [set(c"validate_sync", on), set(c"enable_message_limit", off), set(shaders, on)];
    let mut settings = vk::LayerSettingsCreateInfoEXT::default().settings(&settings);
    // SAFETY: everything that the structures point to lives until the calls return; the messenger's callback needs no data.
    unsafe {
        if !entry.enumerate_instance_layer_properties()?.iter().any(|one| one.layer_name_as_c_str() == Ok(LAYER)) {
            eprintln!("note: without {} nobody checks this program", LAYER.to_string_lossy());
            return Ok((entry.create_instance(&info.enabled_extension_names(&extensions), None)?, None));
        }
        let offered = entry.enumerate_instance_extension_properties(Some(LAYER))?;
        let by_name = offered.iter().any(|one| one.extension_name_as_c_str() == Ok(ext::layer_settings::NAME));
        let interface = if by_name { ext::layer_settings::NAME } else { ext::validation_features::NAME };
        extensions.extend([debug_utils::NAME.as_ptr(), interface.as_ptr()]);
        let layers = [LAYER.as_ptr()];
        let info = info.enabled_layer_names(&layers).enabled_extension_names(&extensions);
        let info = if by_name { info.push_next(&mut settings) } else { info.push_next(&mut features) };
        let instance = entry.create_instance(&info, None)?;
        let functions = debug_utils::Instance::new(entry, &instance);
        let messenger = functions.create_debug_utils_messenger(&messenger, None)?;
        Ok((instance, Some((functions, messenger))))
    }
}

unsafe extern "system" fn collect(_: Severity, _: Types, data: *const Data<'_>, _: *mut c_void) -> vk::Bool32 {
    // SAFETY: Vulkan passes data that is valid for the call, and strings that end with NUL.
    let texts = unsafe { data.as_ref().map(|data| [data.message_id_name_as_c_str(), data.message_as_c_str()]) };
    if let Some(texts) = texts {
        let texts = texts.map(|text| text.unwrap_or_default().to_string_lossy()).join(": ");
        MESSAGES.lock().unwrap_or_else(PoisonError::into_inner).push(texts);
    }
    vk::FALSE
}
