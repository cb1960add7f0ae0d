//! The features of a device that the renderer uses.

use std::fmt::Write as _;

use afterlight::frame::capabilities;
use afterlight::gpu::{self, PhysicalDevice, Roadmap, Support, vk};
use afterlight::plan::Capabilities;
use serde::Serialize;

use super::calibration::CalibrationReport;
use crate::table::{TextTable, bytes, version};

/// A format that frames use.
struct FormatUse {
    format: vk::Format,
    needed: vk::FormatFeatureFlags,
    what_for: &'static str,
    /// The consequence on a device without it; `None`: nothing can be drawn there.
    without: Option<&'static str>,
}

const COLOR: vk::FormatFeatureFlags = vk::FormatFeatureFlags::COLOR_ATTACHMENT;
const BLEND: vk::FormatFeatureFlags = vk::FormatFeatureFlags::from_raw(
    vk::FormatFeatureFlags::COLOR_ATTACHMENT.as_raw() | vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND.as_raw(),
);
const SAMPLE: vk::FormatFeatureFlags = vk::FormatFeatureFlags::from_raw(
    vk::FormatFeatureFlags::SAMPLED_IMAGE.as_raw() | vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR.as_raw(),
);
const MIPS: vk::FormatFeatureFlags = vk::FormatFeatureFlags::from_raw(
    vk::FormatFeatureFlags::BLIT_SRC.as_raw() | vk::FormatFeatureFlags::BLIT_DST.as_raw(),
);
const DEPTH: vk::FormatFeatureFlags = vk::FormatFeatureFlags::from_raw(
    vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT.as_raw() | vk::FormatFeatureFlags::SAMPLED_IMAGE.as_raw(),
);

const fn used(
    format: vk::Format,
    needed: vk::FormatFeatureFlags,
    what_for: &'static str,
    without: Option<&'static str>,
) -> FormatUse {
    FormatUse { format, needed, what_for, without }
}

const FORMATS: [FormatUse; 11] = [
    used(vk::Format::D32_SFLOAT, DEPTH, "depth and shadow maps", None),
    used(vk::Format::R8G8B8A8_SRGB, COLOR, "albedo, output", None),
    used(vk::Format::R8G8B8A8_UNORM, COLOR, "material", None),
    used(vk::Format::R8G8B8A8_SRGB, SAMPLE, "textures", None),
    used(vk::Format::R8G8B8A8_SRGB, MIPS, "mip chains", Some("textures have one level")),
    used(vk::Format::R16G16_UNORM, COLOR, "normals", Some("R16G16_UINT is used")),
    used(vk::Format::R16G16_UINT, COLOR, "normals where R16G16_UNORM cannot be drawn to", None),
    used(vk::Format::A2B10G10R10_UNORM_PACK32, COLOR, "normal=rgb10a2", None),
    used(vk::Format::R16G16B16A16_SFLOAT, BLEND, "HDR, --gbuffer fat", Some("what needs it is refused")),
    used(vk::Format::B10G11R11_UFLOAT_PACK32, BLEND, "--hdr-format b10g11r11", Some("that format is refused")),
    used(vk::Format::R32G32B32A32_SFLOAT, COLOR, "--gbuffer float32, EXR", Some("what needs it is refused")),
];

/// Push constants that the renderer counts on, in bytes: Vulkan guarantees as many.
const PUSH_CONSTANT_BYTES: u32 = 128;

/// Everything worth knowing about one device.
#[derive(Debug, Serialize)]
pub struct DeviceReport {
    number: usize,
    name: String,
    kind: String,
    driver: String,
    vulkan: String,
    limits: Vec<DeviceLimit>,
    roadmaps: Vec<RoadmapReport>,
    formats: Vec<FormatSupport>,
    /// The figures that `auto` chooses by.
    calibration: CalibrationReport,
    /// Why nothing can be drawn on it.
    unusable: Option<String>,
}

#[derive(Debug, Serialize)]
struct DeviceLimit {
    name: &'static str,
    value: String,
}

/// A Roadmap milestone of Vulkan beside the device.
#[derive(Debug, Serialize)]
struct RoadmapReport {
    year: u16,
    met: bool,
    /// The number of requirements.
    requirements: usize,
    /// The requirements that the device does not meet.
    missing: Vec<String>,
    /// The milestone's features and extensions that frames use on this device.
    used: Vec<String>,
}

impl RoadmapReport {
    fn of(Roadmap { year, requirements, missing, used }: Roadmap) -> Self {
        Self { year, met: missing.is_empty(), requirements, missing, used }
    }

    /// The verdict with the first names that are missing.
    fn verdict(&self) -> String {
        let all = self.requirements;
        match &self.missing[..] {
            [] => format!("met, all of its {all} requirements"),
            missing => {
                let named = &missing[..missing.len().min(NAMED)];
                let rest = missing.len() - named.len();
                let more = if rest > 0 { format!(" and {rest} more") } else { String::new() };
                format!("no: {}{more} ({} of {all} missing)", named.join(", "), missing.len())
            }
        }
    }

    /// Adds two entries to a table: the verdict, and the names that frames use, broken into lines.
    fn rows(&self, table: &mut TextTable) {
        table.row([format!("Roadmap {}", self.year), self.verdict()]);
        let mut lines: Vec<String> = Vec::new();
        for (index, name) in self.used.iter().enumerate() {
            let comma = if index + 1 < self.used.len() { "," } else { "" };
            match lines.last_mut().filter(|line| line.len() + name.len() < USED_COLUMNS) {
                Some(line) => line.extend([" ", name, comma]),
                None => lines.push(format!("{name}{comma}")),
            }
        }
        if lines.is_empty() {
            lines.push("nothing".into());
        }
        for (index, line) in lines.iter().enumerate() {
            table.row([if index == 0 { "  frames may use" } else { "" }, line]);
        }
    }
}

/// The most missing names that a verdict lists: the rest is in `--json`.
const NAMED: usize = 4;

/// The width to which names of features are set in lines.
const USED_COLUMNS: usize = 110;

/// A format, its use, and the device's support for that use.
#[derive(Debug, Serialize)]
struct FormatSupport {
    format: String,
    used_for: &'static str,
    usable: bool,
    /// The consequence without it; `None`: nothing can be drawn.
    without: Option<&'static str>,
}

impl DeviceReport {
    /// # Errors
    /// When Vulkan cannot be asked.
    pub fn of(number: usize, device: &PhysicalDevice) -> gpu::Result<Self> {
        let format = |used: &FormatUse| FormatSupport {
            format: format!("{:?}", used.format),
            used_for: used.what_for,
            usable: has(device, used),
            without: used.without,
        };
        Ok(Self {
            number,
            name: device.name.clone(),
            kind: format!("{:?}", device.kind),
            driver: format!("{} {}", device.driver_name, device.driver_info),
            vulkan: version(device.api_version),
            limits: limits(device).into_iter().map(|(name, value)| DeviceLimit { name, value }).collect(),
            roadmaps: device.roadmaps()?.into_iter().map(RoadmapReport::of).collect(),
            formats: FORMATS.iter().map(format).collect(),
            calibration: CalibrationReport::of(device),
            unusable: unusable(device),
        })
    }

    pub fn is(&self, number: usize) -> bool {
        self.number == number
    }

    /// Returns a line with the device's name, its driver and their versions.
    pub fn line(&self) -> String {
        let Self { number, name, driver, vulkan, .. } = self;
        format!("device {number}: {name}, driver {driver}, Vulkan {vulkan}")
    }

    pub fn text(&self, is_default: bool) -> String {
        let mark = if is_default { " (used by default)" } else { "" };
        let mut text = format!("Device {}: {}{mark}\n", self.number, self.name);
        let mut table = TextTable::new();
        table.row(["type", &self.kind]).row(["driver", &self.driver]).row(["Vulkan", &self.vulkan]);
        for DeviceLimit { name, value } in &self.limits {
            table.row([name, value.as_str()]);
        }
        self.roadmaps.iter().for_each(|own| own.rows(&mut table));
        text.push_str(&table.render());
        let mut table = TextTable::new();
        for own in &self.formats {
            let state = match (own.usable, own.without) {
                (true, _) => "yes".to_owned(),
                (false, Some(without)) => format!("no: {without}"),
                (false, None) => "NO: nothing can be drawn".to_owned(),
            };
            table.row([own.format.clone(), own.used_for.to_owned(), state]);
        }
        text.push_str(&table.render());
        text.push_str(&self.calibration.text((!is_default).then_some(self.number)));
        if let Some(reason) = &self.unusable {
            let _ = writeln!(text, "  NOT USABLE: {reason}");
        }
        text
    }
}

/// Why nothing can be drawn on the device, if so.
pub fn unusable(device: &PhysicalDevice) -> Option<String> {
    let missing = FORMATS.iter().find(|used| used.without.is_none() && !has(device, used));
    let lacks_format = || missing.map(|used| format!("it cannot use {:?} for {}", used.format, used.what_for));
    device.unusable().or_else(lacks_format)
}

fn has(device: &PhysicalDevice, used: &FormatUse) -> bool {
    device.format_features(used.format).contains(used.needed)
}

fn limits(device: &PhysicalDevice) -> Vec<(&'static str, String)> {
    let limits = &device.limits;
    let yes_no = |has: bool| if has { "yes" } else { "no" }.to_owned();
    let enough = if limits.max_push_constants_size < PUSH_CONSTANT_BYTES { " (too few)" } else { "" };
    let heaps = device.memory.memory_heaps_as_slice().iter().map(|heap| bytes(heap.size));
    let timestamps = match device.timestamp_valid_bits {
        0 => "no: times are of the CPU's clock only".to_owned(),
        bits => format!("{bits} bits of {} ns", limits.timestamp_period),
    };
    vec![
        ("largest picture", format!("{0}x{0}", largest_picture(device))),
        ("colour attachments", limits.max_color_attachments.to_string()),
        ("push constants", format!("{} B{enough}", limits.max_push_constants_size)),
        ("timestamps", timestamps),
        ("memory heaps", heaps.collect::<Vec<_>>().join(", ")),
        ("lazily allocated memory", yes_no(device.has_lazily_allocated_memory())),
        ("anisotropic filtering", anisotropy(&capabilities(device))),
        ("depth clamp", yes_no(device.features.depth_clamp == vk::TRUE)),
        ("the view triangle", yes_no(device.features.geometry_shader == vk::TRUE)),
        ("--passes local-read", local_read(&capabilities(device))),
        ("--sync 2", supported(capabilities(device).synchronization2)),
        ("--layouts unified", supported(capabilities(device).unified_layouts)),
        ("--queues all", queues(&capabilities(device))),
    ]
}

/// Returns "yes", or names the missing feature.
fn supported(own: Support) -> String {
    own.map_or_else(|lack| format!("no: {lack}"), |()| "yes".into())
}

fn queues(device: &Capabilities) -> String {
    match (device.compute_queue, device.transfer_queue) {
        (Ok(()), Ok(())) => "yes".into(),
        (Ok(()), Err(lack)) => format!("for compute: {lack}"),
        (Err(lack), Ok(())) => format!("for uploads: {lack}"),
        (Err(lack), Err(_)) => format!("no: {lack}"),
    }
}

fn local_read(device: &Capabilities) -> String {
    match (device.local_read, device.local_read_depth, device.local_read_samples) {
        (Err(_), ..) => supported(device.local_read),
        (Ok(()), true, true) => "yes".into(),
        (Ok(()), true, false) => "yes, of one sample a pixel".into(),
        (Ok(()), false, true) => "of colour: a G-buffer needs positions".into(),
        (Ok(()), false, false) => "of colour with one sample a pixel: a G-buffer needs positions".into(),
    }
}

fn anisotropy(device: &Capabilities) -> String {
    match (device.anisotropy, device.slow_anisotropy) {
        (1, _) => "no".into(),
        (most, false) => format!("up to {most} taps a pixel"),
        (most, true) => {
            format!("up to {most} taps in the shader: this driver's samplers are slow; Mesa 25's are not")
        }
    }
}

fn largest_picture(device: &PhysicalDevice) -> u32 {
    let limits = &device.limits;
    limits.max_image_dimension2_d.min(limits.max_framebuffer_width).min(limits.max_framebuffer_height)
}
