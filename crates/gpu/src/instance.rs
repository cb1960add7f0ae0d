//! The loader and the instance: layers, validation settings, debug messages.

use std::collections::BTreeSet;
use std::ffi::{CStr, c_char};
use std::sync::Arc;

use ash::vk;

use super::error::{Doing, Error, Result};
use super::instrumentation::ROBUST_IS_RIGHT;
use super::message::{Message, MessageLog, messenger_info};
use super::newer::API_VERSION_1_4;
use super::physical::{PhysicalDevice, version_text};
use super::system::{self, VulkanComponent};

/// The most times that devices are listed while their number changes.
const LISTED_AGAIN: usize = 8;

const KHRONOS_VALIDATION: &CStr = c"VK_LAYER_KHRONOS_validation";

/// The checks of the validation layer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Validation {
    /// No layer is loaded by this program.
    #[default]
    Off,
    /// The core checks: valid usage, object lifetimes, threading.
    Core,
    /// The core checks and synchronization, with no limit on how often a message repeats.
    Synchronization,
    /// Checks of memory content at each use: the layer adds code to shaders, and its own passes. They replace the core checks, which cannot be
    /// combined with them. A device is opened with the features that the added code needs; with layers before 1.4.310 with robust buffer access, too.
    GpuAssisted,
    /// The core checks, and advice on uses that are allowed and yet unwise, on some device at least.
    BestPractices,
}

/// Options of an instance.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct InstanceOptions {
    /// The checks of the validation layer. Anything but `Off` needs the layer to be installed.
    pub validation: Validation,
    /// With `Synchronization`, also checks the accesses of shaders, as far as the layer can tell them from shader code
    /// (`syncval_shader_accesses_heuristic`). Layers that do not know the setting are not given it.
    pub sync_shader_heuristic: bool,
    /// Devices have the measurements of earlier runs ([`super::PhysicalDevice::calibration`]). Without, a plan depends on the device and its driver
    /// alone, and on no measurement. It needs the feature `caches`.
    #[cfg(feature = "caches")]
    pub calibrated: bool,
}

/// A layer that the loader found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LayerInfo {
    /// The name, as `VK_LAYER_KHRONOS_validation`.
    pub name: String,
    /// The layer's description of itself.
    pub description: String,
    /// The Vulkan version that it was written for, packed as Vulkan packs it.
    pub spec_version: u32,
    /// The layer's own version number.
    pub implementation_version: u32,
}

/// The system's Vulkan loader, which can be asked without a driver.
#[derive(Debug, Clone)]
pub struct LoaderInfo {
    /// The highest Vulkan version that it knows, packed as Vulkan packs it.
    pub version: u32,
    /// The layers that it finds.
    pub layers: Vec<LayerInfo>,
}

impl LoaderInfo {
    /// Loads the loader and asks it.
    ///
    /// # Errors
    /// [`Error::NoLoader`] with what to install on this system, and [`Error::Unsupported`] for a loader of Vulkan 1.0.
    pub fn find() -> Result<LoaderInfo> {
        let entry = load_entry()?;
        Ok(LoaderInfo { version: loader_version(&entry)?, layers: enumerate_layers(&entry)? })
    }

    /// The version of the validation layer, packed as Vulkan packs it.
    pub fn validation_layer(&self) -> Option<u32> {
        validation_layer(&self.layers)
    }
}

/// A Vulkan instance. It is destroyed when the last device and the last [`PhysicalDevice`] made from it are gone.
pub struct Instance {
    handles: Arc<InstanceHandles>,
    loader_version: u32,
    layers: Vec<LayerInfo>,
    validation: Validation,
    sync_shader_heuristic: bool,
    #[cfg(feature = "caches")]
    calibrated: bool,
    api_version: u32,
    extensions: Vec<&'static CStr>,
}

/// The parts that must outlive every object made from an instance.
pub(super) struct InstanceHandles {
    pub(super) raw: ash::Instance,
    /// The version that it was created for, packed as Vulkan packs it.
    pub(super) api_version: u32,
    pub(super) has_debug_utils: bool,
    messenger: Option<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    // The entry and the log must outlive the instance: the instance uses the entry's functions, and its messenger writes to the log.
    pub(super) entry: ash::Entry,
    log: Arc<MessageLog>,
}

impl Drop for InstanceHandles {
    fn drop(&mut self) {
        if let Some((debug_utils, messenger)) = self.messenger.take() {
            // SAFETY: the messenger was made from this instance and nothing else holds it.
            unsafe { debug_utils.destroy_debug_utils_messenger(messenger, None) };
        }
        // SAFETY: devices hold these handles, so that none is left; `entry` and `log` live until after this.
        unsafe { self.raw.destroy_instance(None) };
    }
}

impl Instance {
    /// Loads the loader and creates an instance for Vulkan 1.1 to 1.4, with debug messages where the system has them.
    ///
    /// # Errors
    /// [`Error::NoLoader`], [`Error::NoDriver`] and [`Error::MissingLayer`], each with what to install on this system;
    /// [`Error::Unsupported`] for a loader of Vulkan 1.0.
    pub fn new(options: &InstanceOptions) -> Result<Arc<Instance>> {
        Instance::with_extensions(options, &[])
    }

    /// As [`Instance::new`], with instance extensions that must exist, such as a window system's surface extensions.
    ///
    /// # Errors
    /// As [`Instance::new`], and [`Error::Unsupported`] naming an extension that is missing.
    pub fn with_extensions(options: &InstanceOptions, required: &[&'static CStr]) -> Result<Arc<Instance>> {
        let entry = load_entry()?;
        let loader_version = loader_version(&entry)?;
        let layers = enumerate_layers(&entry)?;
        let plan = ValidationPlan::new(&entry, options, &layers)?;
        let extensions = Extensions::choose(&entry, &plan, required)?;
        let log = Arc::new(MessageLog::default());
        let api_version = loader_version.min(API_VERSION_1_4);
        let raw = create(&entry, api_version, &plan, &extensions, &log)?;
        let mut handles =
            InstanceHandles { raw, api_version, has_debug_utils: extensions.debug_utils, messenger: None, entry, log };
        if extensions.debug_utils {
            let debug_utils = ash::ext::debug_utils::Instance::new(&handles.entry, &handles.raw);
            // SAFETY: the extension is enabled; the log outlives the messenger, as the handles' drop destroys it first.
            let messenger = unsafe { debug_utils.create_debug_utils_messenger(&messenger_info(&handles.log), None) }
                .doing("vkCreateDebugUtilsMessengerEXT", || "creating the debug messenger")?;
            handles.messenger = Some((debug_utils, messenger));
        }
        let handles = Arc::new(handles);
        Ok(Arc::new(Instance {
            handles,
            loader_version,
            layers,
            validation: options.validation,
            sync_shader_heuristic: plan.shader_heuristic,
            #[cfg(feature = "caches")]
            calibrated: options.calibrated,
            api_version,
            extensions: extensions.names,
        }))
    }

    /// Every device of every driver, in the loader's order, including devices that this program cannot use.
    ///
    /// # Errors
    /// [`Error::NoDriver`] if there is none.
    pub fn physical_devices(&self) -> Result<Vec<PhysicalDevice>> {
        // SAFETY: the instance is alive.
        let list = || unsafe { self.handles.raw.enumerate_physical_devices() };
        let mut found = list();
        // Loaders about 1.3.239 make a list also when they are asked for the number of devices alone, and say so if it was too short.
        for _ in 0..LISTED_AGAIN {
            if found != Err(vk::Result::INCOMPLETE) {
                break;
            }
            found = list();
        }
        let raw = match found {
            // Drivers are there, but none of them could start.
            Err(vk::Result::ERROR_INITIALIZATION_FAILED) => Vec::new(),
            found => found.doing("vkEnumeratePhysicalDevices", || "listing the Vulkan devices")?,
        };
        if raw.is_empty() {
            return Err(no_driver("the drivers found no device"));
        }
        let found = raw.into_iter().map(|raw| PhysicalDevice::query(&self.handles, raw));
        #[cfg(feature = "caches")]
        let found = found.map(|device| Ok(if self.calibrated { device?.with_calibration() } else { device? }));
        found.collect()
    }

    /// All messages so far, oldest first, which are then forgotten.
    pub fn take_messages(&self) -> Vec<Message> {
        self.handles.log.take()
    }

    /// The list that messages go into. It can be kept, and read after the device and the instance are destroyed.
    pub fn message_log(&self) -> Arc<MessageLog> {
        Arc::clone(&self.handles.log)
    }

    /// The highest Vulkan version that the loader knows, packed as Vulkan packs it.
    pub fn loader_version(&self) -> u32 {
        self.loader_version
    }

    /// The Vulkan version that the instance was made for, packed as Vulkan packs it.
    pub fn api_version(&self) -> u32 {
        self.api_version
    }

    /// The layers that the loader found, whether in use or not.
    pub fn layers(&self) -> &[LayerInfo] {
        &self.layers
    }

    /// The version of the validation layer that the loader found, packed as Vulkan packs it.
    pub fn validation_layer(&self) -> Option<u32> {
        validation_layer(&self.layers)
    }

    /// Returns true if it was made with an extension.
    pub fn has_extension(&self, name: &CStr) -> bool {
        self.extensions.contains(&name)
    }

    /// Returns the checks of this instance.
    pub fn validation(&self) -> Validation {
        self.validation
    }

    /// Returns true if the layer's shader heuristic is on: the options ask for it and the layer supports it.
    pub fn sync_shader_heuristic(&self) -> bool {
        self.sync_shader_heuristic
    }

    /// Returns true if objects can be named and messages collected: VK_EXT_debug_utils is in use.
    pub fn has_debug_utils(&self) -> bool {
        self.handles.has_debug_utils
    }

    /// The functions of the instance, for extensions that this module does not wrap.
    pub fn raw(&self) -> &ash::Instance {
        &self.handles.raw
    }

    /// The functions of the loader, for extensions that this module does not wrap.
    pub fn entry(&self) -> &ash::Entry {
        &self.handles.entry
    }
}

fn validation_layer(layers: &[LayerInfo]) -> Option<u32> {
    let name = KHRONOS_VALIDATION.to_string_lossy();
    layers.iter().filter(|layer| layer.name == name).map(|layer| layer.spec_version).max()
}

fn no_driver(reason: &str) -> Error {
    Error::NoDriver { reason: reason.to_owned(), hint: system::hint(VulkanComponent::Driver) }
}

fn load_entry() -> Result<ash::Entry> {
    // SAFETY: loading the system's Vulkan loader runs its initializers, as intended; the entry is kept as long as anything made from it.
    unsafe { ash::Entry::load() }
        .map_err(|error| Error::NoLoader { reason: error.to_string(), hint: system::hint(VulkanComponent::Loader) })
}

fn loader_version(entry: &ash::Entry) -> Result<u32> {
    // SAFETY: a global function without preconditions.
    let version = unsafe { entry.try_enumerate_instance_version() }
        .doing("vkEnumerateInstanceVersion", || "asking the Vulkan loader for its version")?
        .unwrap_or(vk::API_VERSION_1_0);
    if version < vk::API_VERSION_1_1 {
        return Err(Error::Unsupported("the Vulkan loader knows Vulkan 1.0 only; 1.1 or newer is needed".to_owned()));
    }
    Ok(version)
}

fn enumerate_layers(entry: &ash::Entry) -> Result<Vec<LayerInfo>> {
    // SAFETY: a global function without preconditions.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }
        .doing("vkEnumerateInstanceLayerProperties", || "listing the Vulkan layers")?;
    let info = |layer: &vk::LayerProperties| LayerInfo {
        name: fixed_text(&layer.layer_name),
        description: fixed_text(&layer.description),
        spec_version: layer.spec_version,
        implementation_version: layer.implementation_version,
    };
    Ok(layers.iter().map(info).collect())
}

/// Lists the instance extensions of a layer or, without a layer, of the loader and the drivers.
pub(super) fn enumerate_extensions(entry: &ash::Entry, layer: Option<&CStr>) -> Result<BTreeSet<String>> {
    // SAFETY: the layer's name, if any, comes from the list of layers.
    let extensions = unsafe { entry.enumerate_instance_extension_properties(layer) }
        .doing("vkEnumerateInstanceExtensionProperties", || "listing the Vulkan instance extensions")?;
    Ok(extensions.iter().map(|extension| fixed_text(&extension.extension_name)).collect())
}

/// The text in a fixed array, up to its NUL or its end.
pub(super) fn fixed_text(text: &[c_char]) -> String {
    // A `c_char` is signed on x86-64 and unsigned on ARM.
    let bytes: &[u8] = bytemuck::cast_slice(text);
    let text = bytes.split(|&byte| byte == 0).next().unwrap_or_default();
    String::from_utf8_lossy(text).into_owned()
}

/// The interface by which the layer takes its settings.
#[derive(Clone, Copy, PartialEq, Eq)]
enum SettingsInterface {
    /// VK_EXT_layer_settings: layers from 2024 on.
    LayerSettings,
    /// VK_EXT_validation_features: older ones, which have no limit on repeated messages either.
    ValidationFeatures,
    /// Neither: only the core checks can be had.
    None,
}

/// The request to the validation layer, decided against the layer that is installed.
struct ValidationPlan {
    enabled: bool,
    interface: SettingsInterface,
    extensions: BTreeSet<String>,
    checks: Validation,
    shader_heuristic: bool,
    /// Checks on the GPU leave out which descriptors of arrays were used: without robust buffer access the code that 1.4.363 adds for that crashes lavapipe.
    no_used_descriptors: bool,
}

/// Layers from this one on, at the latest, have the settings `gpuav_enable` and `syncval_shader_accesses_heuristic`. A layer warns of a
/// setting that it does not know.
const NEW_SETTINGS: u32 = vk::make_api_version(0, 1, 4, 304);

impl ValidationPlan {
    fn new(entry: &ash::Entry, options: &InstanceOptions, layers: &[LayerInfo]) -> Result<ValidationPlan> {
        let mut plan = ValidationPlan {
            enabled: false,
            interface: SettingsInterface::None,
            extensions: BTreeSet::new(),
            checks: options.validation,
            shader_heuristic: false,
            no_used_descriptors: false,
        };
        if options.validation == Validation::Off {
            return Ok(plan);
        }
        let name = KHRONOS_VALIDATION.to_string_lossy();
        let layer = layers.iter().find(|layer| layer.name == name).ok_or_else(|| Error::MissingLayer {
            layer: name.into_owned(),
            hint: system::hint(VulkanComponent::ValidationLayer),
        })?;
        plan.enabled = true;
        plan.extensions = enumerate_extensions(entry, Some(KHRONOS_VALIDATION))?;
        let has = |name: &CStr| plan.extensions.contains(&*name.to_string_lossy());
        plan.interface = if has(ash::ext::layer_settings::NAME) {
            SettingsInterface::LayerSettings
        } else if has(ash::ext::validation_features::NAME) {
            SettingsInterface::ValidationFeatures
        } else {
            SettingsInterface::None
        };
        let by_name = plan.interface == SettingsInterface::LayerSettings;
        let lacks = match options.validation {
            Validation::Off | Validation::Core => None,
            Validation::Synchronization => (plan.interface == SettingsInterface::None).then_some("synchronization"),
            Validation::BestPractices => (plan.interface == SettingsInterface::None).then_some("best practices"),
            // 1.3.239 takes the request, adds code to shaders, and then lets a write beyond a descriptor's end pass.
            Validation::GpuAssisted => (!by_name || layer.spec_version < NEW_SETTINGS).then_some("on the GPU"),
        };
        if let Some(what) = lacks {
            let (name, version) = (&layer.name, version_text(layer.spec_version));
            return Err(Error::Unsupported(format!(
                "the Vulkan layer {name} {version} is too old to check {what}; {} and newer can",
                version_text(NEW_SETTINGS)
            )));
        }
        plan.shader_heuristic = options.validation == Validation::Synchronization
            && options.sync_shader_heuristic
            && by_name
            && layer.spec_version >= NEW_SETTINGS;
        plan.no_used_descriptors = layer.spec_version >= ROBUST_IS_RIGHT;
        Ok(plan)
    }

    /// The settings passed through VK_EXT_layer_settings.
    fn settings(&self) -> Vec<vk::LayerSettingEXT<'static>> {
        let mut settings = vec![bool_setting(c"enable_message_limit", &vk::FALSE)];
        settings.extend(match self.checks {
            Validation::Off | Validation::Core => Vec::new(),
            Validation::Synchronization => vec![bool_setting(c"validate_sync", &vk::TRUE)],
            Validation::GpuAssisted => {
                let used = c"gpuav_post_process_descriptor_indexing";
                let less = self.no_used_descriptors.then(|| bool_setting(used, &vk::FALSE));
                let own = [bool_setting(c"gpuav_enable", &vk::TRUE), bool_setting(c"validate_core", &vk::FALSE)];
                own.into_iter().chain(less).collect()
            }
            Validation::BestPractices => vec![bool_setting(c"validate_best_practices", &vk::TRUE)],
        });
        settings.extend(self.shader_heuristic.then(|| bool_setting(c"syncval_shader_accesses_heuristic", &vk::TRUE)));
        settings
    }

    /// The features enabled through VK_EXT_validation_features.
    fn enables(&self) -> &'static [vk::ValidationFeatureEnableEXT] {
        match self.checks {
            Validation::Off | Validation::Core | Validation::GpuAssisted => &[],
            Validation::Synchronization => &[vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION],
            Validation::BestPractices => &[vk::ValidationFeatureEnableEXT::BEST_PRACTICES],
        }
    }
}

const COLOR_SPACES: &CStr = ash::ext::swapchain_colorspace::NAME;

/// The instance extensions to enable.
struct Extensions {
    names: Vec<&'static CStr>,
    debug_utils: bool,
    portability: bool,
}

impl Extensions {
    fn choose(entry: &ash::Entry, validation: &ValidationPlan, required: &[&'static CStr]) -> Result<Extensions> {
        let mut available = enumerate_extensions(entry, None)?;
        available.extend(validation.extensions.iter().cloned());
        let has = |name: &CStr| available.contains(&*name.to_string_lossy());
        if let Some(missing) = required.iter().find(|name| !has(name)) {
            return Err(Error::Unsupported(format!("the Vulkan instance lacks {}", missing.to_string_lossy())));
        }
        let debug_utils = has(ash::ext::debug_utils::NAME);
        // Without it, drivers that are Vulkan in part only (MoltenVK) are not listed.
        let portability = has(ash::khr::portability_enumeration::NAME);
        let mut names = required.to_vec();
        names.extend(debug_utils.then_some(ash::ext::debug_utils::NAME));
        names.extend(portability.then_some(ash::khr::portability_enumeration::NAME));
        // Surfaces list their HDR formats only with this extension.
        let shows = required.contains(&ash::khr::surface::NAME);
        names.extend((shows && has(COLOR_SPACES)).then_some(COLOR_SPACES));
        names.extend(match validation.interface {
            SettingsInterface::LayerSettings => Some(ash::ext::layer_settings::NAME),
            SettingsInterface::ValidationFeatures => Some(ash::ext::validation_features::NAME),
            SettingsInterface::None => None,
        });
        names.sort_unstable();
        names.dedup();
        Ok(Extensions { names, debug_utils, portability })
    }
}

fn create(
    entry: &ash::Entry,
    api_version: u32,
    validation: &ValidationPlan,
    extensions: &Extensions,
    log: &MessageLog,
) -> Result<ash::Instance> {
    let application = vk::ApplicationInfo::default()
        .application_name(c"afterlight")
        .engine_name(c"afterlight")
        .api_version(api_version);
    let layer_names: &[*const c_char] = if validation.enabled { &[KHRONOS_VALIDATION.as_ptr()] } else { &[] };
    let extension_names: Vec<*const c_char> = extensions.names.iter().map(|name| name.as_ptr()).collect();
    let mut info = vk::InstanceCreateInfo::default()
        .application_info(&application)
        .enabled_layer_names(layer_names)
        .enabled_extension_names(&extension_names);
    if extensions.portability {
        info = info.flags(vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR);
    }

    // Chained too, so that messages about creating and destroying the instance itself are collected.
    let mut messenger = messenger_info(log);
    if extensions.debug_utils {
        info = info.push_next(&mut messenger);
    }
    let settings = validation.settings();
    let mut layer_settings = vk::LayerSettingsCreateInfoEXT::default().settings(&settings);
    let enables = validation.enables();
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(enables);
    match validation.interface {
        SettingsInterface::LayerSettings => info = info.push_next(&mut layer_settings),
        SettingsInterface::ValidationFeatures if !enables.is_empty() => info = info.push_next(&mut features),
        SettingsInterface::ValidationFeatures | SettingsInterface::None => {}
    }

    // SAFETY: everything that the structures point to lives until the call returns, except the log, which the caller
    // keeps until after the instance is destroyed.
    match unsafe { entry.create_instance(&info, None) } {
        Err(vk::Result::ERROR_INCOMPATIBLE_DRIVER) => Err(no_driver("the loader found none that it can use")),
        // The layer's manifest exists, but its library does not.
        Err(vk::Result::ERROR_LAYER_NOT_PRESENT) => Err(Error::MissingLayer {
            layer: KHRONOS_VALIDATION.to_string_lossy().into_owned(),
            hint: system::hint(VulkanComponent::ValidationLayer),
        }),
        created => created.doing("vkCreateInstance", || "creating the Vulkan instance"),
    }
}

fn bool_setting<'a>(name: &'a CStr, value: &'a vk::Bool32) -> vk::LayerSettingEXT<'a> {
    let mut setting = vk::LayerSettingEXT::default()
        .layer_name(KHRONOS_VALIDATION)
        .setting_name(name)
        .ty(vk::LayerSettingTypeEXT::BOOL32)
        .values(bytemuck::bytes_of(value));
    // ash counts the bytes; Vulkan counts the values.
    setting.value_count = 1;
    setting
}
