//! Images with their memory and a view of all of them.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::vulkan::Allocation;

use super::device::Device;
use super::error::{Doing, Error, Result};
use super::memory::{Location, MemoryKind, MemoryNeed};
use super::owned::Owned;
use super::physical::PhysicalDevice;

/// The description of a two-dimensional, optimally tiled image.
#[derive(Clone, Copy, Debug)]
pub struct ImageDesc<'a> {
    /// The name.
    pub name: &'a str,
    /// The format.
    pub format: vk::Format,
    /// Width and height of level 0 in texels.
    pub extent: vk::Extent2D,
    /// The number of mip levels, from 1.
    pub mip_levels: u32,
    /// The number of array layers, from 1.
    pub layers: u32,
    /// True if the six layers can be viewed as the faces of a cube.
    pub cube: bool,
    /// The samples a texel.
    pub samples: vk::SampleCountFlags,
    /// The usage flags.
    pub usage: vk::ImageUsageFlags,
    /// The format of the view that shaders store through, of the same size; undefined for the image's own format.
    pub stored_as: vk::Format,
    /// The kind of memory it is allocated from.
    pub location: Location,
    /// The category in memory reports.
    pub kind: MemoryKind,
}

impl Default for ImageDesc<'_> {
    /// A colour attachment with one level, layer and sample. The name, format, extent and usage are left to fill in.
    fn default() -> Self {
        ImageDesc {
            name: "",
            format: vk::Format::UNDEFINED,
            extent: vk::Extent2D::default(),
            mip_levels: 1,
            layers: 1,
            cube: false,
            samples: vk::SampleCountFlags::TYPE_1,
            usage: vk::ImageUsageFlags::empty(),
            stored_as: vk::Format::UNDEFINED,
            location: Location::Device,
            kind: MemoryKind::Attachment,
        }
    }
}

/// An image, its memory, and a view of it.
pub struct Image {
    /// The handle. It is valid as long as this owner.
    pub raw: vk::Image,
    /// A view of all levels and layers; for a depth format, of the depth aspect only. Null if the usage allows no view. The view type is `TYPE_2D`
    /// for one layer, `TYPE_2D_ARRAY` for several.
    pub view: vk::ImageView,
    /// The view that shaders store through: like `view`, but possibly in another format.
    pub storage_view: vk::ImageView,
    /// The format.
    pub format: vk::Format,
    /// Width and height of level 0 in texels.
    pub extent: vk::Extent2D,
    /// The number of mip levels.
    pub mip_levels: u32,
    /// The number of array layers.
    pub layers: u32,
    /// The samples a texel.
    pub samples: vk::SampleCountFlags,
    /// The usage flags.
    pub usage: vk::ImageUsageFlags,
    /// The name.
    pub name: String,
    owner: Owned<vk::Image>,
    view_owner: Option<Owned<vk::ImageView>>,
    storage_view_owner: Option<Owned<vk::ImageView>>,
    stored_as: vk::Format,
    memory: Option<Allocation>,
}

/// Images of at least this size get a dedicated device allocation, which is freed with the image. Smaller ones share a block.
const DEDICATED_BYTES: u64 = 4 << 20;

impl Image {
    /// An image in the layout `UNDEFINED`, whose content is undefined.
    ///
    /// # Errors
    /// [`Error::TooLarge`] beyond the device's limits; [`Error::Unsupported`] for a format that cannot do this;
    /// [`Error::OutOfMemory`].
    pub fn new(device: &Arc<Device>, desc: &ImageDesc<'_>) -> Result<Image> {
        check(&device.physical, desc)?;
        let name = desc.name;
        let doing =
            || format!("creating the image '{name}' ({}x{} {:?})", desc.extent.width, desc.extent.height, desc.format);
        let info = create_info(desc);
        // SAFETY: the device is alive and can make such images, as checked; destroyed by its owner, whatever follows.
        let raw = unsafe { device.raw.create_image(&info, None) }.doing("vkCreateImage", doing)?;
        // SAFETY: the image is new.
        let requirements = unsafe { device.raw.get_image_memory_requirements(raw) };
        let mut owner = Owned::new_from(device, name, raw);
        let alone = desc.location == Location::Lazy || requirements.size >= DEDICATED_BYTES;
        let memory = device.memory.allocate(&MemoryNeed {
            name,
            requirements,
            location: desc.location,
            linear: false,
            dedicated_to: alone.then_some(raw),
        })?;
        // SAFETY: the memory was allocated for these requirements, and nothing is bound to it or to the image yet.
        let bound = unsafe { device.raw.bind_image_memory(raw, memory.memory(), memory.offset()) };
        if let Err(error) = bound.doing("vkBindImageMemory", doing) {
            owner.retire_with(Some(memory));
            return Err(error);
        }
        owner.account(desc.kind, requirements.size);
        let mut image = Image {
            raw,
            view: vk::ImageView::null(),
            storage_view: vk::ImageView::null(),
            format: desc.format,
            extent: desc.extent,
            mip_levels: desc.mip_levels,
            layers: desc.layers,
            samples: desc.samples,
            usage: desc.usage,
            name: name.to_owned(),
            owner,
            view_owner: None,
            storage_view_owner: None,
            stored_as: desc.stored_as,
            memory: Some(memory),
        };
        if desc.usage.intersects(VIEWABLE) {
            let kind = if desc.layers > 1 { vk::ImageViewType::TYPE_2D_ARRAY } else { vk::ImageViewType::TYPE_2D };
            let view = image.view_of(name, kind, whole(image.aspect()))?;
            (image.view, image.storage_view) = (view.raw, view.raw);
            image.view_owner = Some(view);
            if desc.stored_as != vk::Format::UNDEFINED {
                let range = whole(image.aspect());
                let view = image.view_as((desc.stored_as, vk::ImageUsageFlags::STORAGE), name, kind, range)?;
                image.storage_view = view.raw;
                image.storage_view_owner = Some(view);
            }
        }
        Ok(image)
    }

    /// A `TYPE_2D` view of one layer with all its levels, for rendering into it.
    ///
    /// # Errors
    /// [`Error::Misuse`] if there is no such layer; running out of memory.
    pub fn layer_view(&self, layer: u32) -> Result<Owned<vk::ImageView>> {
        if layer >= self.layers {
            return Err(Error::Misuse(format!("'{}' has no layer {layer}", self.name)));
        }
        let range = vk::ImageSubresourceRange { base_array_layer: layer, layer_count: 1, ..whole(self.aspect()) };
        self.view_of(&format!("{} layer {layer}", self.name), vk::ImageViewType::TYPE_2D, range)
    }

    /// A `TYPE_2D_ARRAY` view of the whole image, for shaders that index a layer even if there is only one.
    ///
    /// # Errors
    /// Running out of memory.
    pub fn array_view(&self) -> Result<Owned<vk::ImageView>> {
        self.view_of(&format!("{} as an array", self.name), vk::ImageViewType::TYPE_2D_ARRAY, whole(self.aspect()))
    }

    /// A view of any part, under its own name.
    ///
    /// # Errors
    /// Running out of memory.
    pub fn view_of(
        &self,
        name: &str,
        kind: vk::ImageViewType,
        range: vk::ImageSubresourceRange,
    ) -> Result<Owned<vk::ImageView>> {
        // Shaders cannot necessarily store to the image's own format.
        let stays = if self.stored_as == vk::Format::UNDEFINED { self.usage } else { self.usage & !STORAGE };
        self.view_as((self.format, stays), name, kind, range)
    }

    /// A view in a format of the same size, for some of the image's usages.
    fn view_as(
        &self,
        (format, usage): (vk::Format, vk::ImageUsageFlags),
        name: &str,
        kind: vk::ImageViewType,
        range: vk::ImageSubresourceRange,
    ) -> Result<Owned<vk::ImageView>> {
        let device = self.owner.device();
        let mut uses = vk::ImageViewUsageCreateInfo::default().usage(usage);
        let mut info =
            vk::ImageViewCreateInfo::default().image(self.raw).view_type(kind).format(format).subresource_range(range);
        if usage != self.usage {
            info = info.push_next(&mut uses);
        }
        // SAFETY: the image is alive and bound to memory.
        let raw = unsafe { device.raw.create_image_view(&info, None) }
            .doing("vkCreateImageView", || format!("creating the image view '{name}'"))?;
        Ok(Owned::new_from(device, name, raw))
    }

    /// The aspect that shaders and attachments see: depth of a depth format, stencil of a stencil-only one, else colour.
    pub fn aspect(&self) -> vk::ImageAspectFlags {
        let all = self.all_aspects();
        let depth = all & vk::ImageAspectFlags::DEPTH;
        if depth.is_empty() { all } else { depth }
    }

    /// Every aspect of the format, as barriers need them.
    pub fn all_aspects(&self) -> vk::ImageAspectFlags {
        aspects_of(self.format)
    }

    /// Width and height of a mip level in texels.
    pub fn level_extent(&self, level: u32) -> vk::Extent2D {
        let shrunk = |size: u32| size.checked_shr(level).unwrap_or(0).max(1);
        vk::Extent2D { width: shrunk(self.extent.width), height: shrunk(self.extent.height) }
    }
}

/// Every aspect of a format.
pub fn aspects_of(format: vk::Format) -> vk::ImageAspectFlags {
    use vk::ImageAspectFlags as Aspect;
    match format {
        vk::Format::D16_UNORM | vk::Format::X8_D24_UNORM_PACK32 | vk::Format::D32_SFLOAT => Aspect::DEPTH,
        vk::Format::S8_UINT => Aspect::STENCIL,
        vk::Format::D16_UNORM_S8_UINT | vk::Format::D24_UNORM_S8_UINT | vk::Format::D32_SFLOAT_S8_UINT => {
            Aspect::DEPTH | Aspect::STENCIL
        }
        _ => Aspect::COLOR,
    }
}

/// Returns true if attachments of this format are tested and written as depth.
pub fn is_depth(format: vk::Format) -> bool {
    aspects_of(format).contains(vk::ImageAspectFlags::DEPTH)
}

impl Drop for Image {
    fn drop(&mut self) {
        // The view first: nothing looks at an image that is gone.
        drop(self.view_owner.take());
        drop(self.storage_view_owner.take());
        self.owner.retire_with(self.memory.take());
    }
}

impl std::fmt::Debug for Image {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "image '{}' ({}x{} {:?})", self.name, self.extent.width, self.extent.height, self.format)
    }
}

/// The usages of which one is needed for a view (Vulkan 1.3, VUID-VkImageViewCreateInfo-image-04441).
const VIEWABLE: vk::ImageUsageFlags = vk::ImageUsageFlags::from_raw(
    vk::ImageUsageFlags::SAMPLED.as_raw()
        | vk::ImageUsageFlags::STORAGE.as_raw()
        | vk::ImageUsageFlags::COLOR_ATTACHMENT.as_raw()
        | vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT.as_raw()
        | vk::ImageUsageFlags::INPUT_ATTACHMENT.as_raw(),
);

const STORAGE: vk::ImageUsageFlags = vk::ImageUsageFlags::STORAGE;

/// An image that is stored to in another format has views of both, and a usage that only one of them allows.
fn flags(desc: &ImageDesc<'_>) -> vk::ImageCreateFlags {
    let cube = if desc.cube { vk::ImageCreateFlags::CUBE_COMPATIBLE } else { vk::ImageCreateFlags::empty() };
    match desc.stored_as {
        vk::Format::UNDEFINED => cube,
        _ => cube | vk::ImageCreateFlags::MUTABLE_FORMAT | vk::ImageCreateFlags::EXTENDED_USAGE,
    }
}

fn whole(aspect_mask: vk::ImageAspectFlags) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange {
        aspect_mask,
        base_mip_level: 0,
        level_count: vk::REMAINING_MIP_LEVELS,
        base_array_layer: 0,
        layer_count: vk::REMAINING_ARRAY_LAYERS,
    }
}

fn create_info(desc: &ImageDesc<'_>) -> vk::ImageCreateInfo<'static> {
    vk::ImageCreateInfo::default()
        .flags(flags(desc))
        .image_type(vk::ImageType::TYPE_2D)
        .format(desc.format)
        .extent(vk::Extent3D { width: desc.extent.width, height: desc.extent.height, depth: 1 })
        .mip_levels(desc.mip_levels)
        .array_layers(desc.layers)
        .samples(desc.samples)
        .tiling(vk::ImageTiling::OPTIMAL)
        .usage(desc.usage)
        .sharing_mode(vk::SharingMode::EXCLUSIVE)
        .initial_layout(vk::ImageLayout::UNDEFINED)
}

fn check(physical: &PhysicalDevice, desc: &ImageDesc<'_>) -> Result<()> {
    let name = desc.name;
    let (width, height) = (desc.extent.width, desc.extent.height);
    if width == 0 || height == 0 || desc.mip_levels == 0 || desc.layers == 0 {
        return Err(Error::Misuse(format!("the image '{name}' has no texels ({width}x{height})")));
    }
    let within = |what: &str, asked: u32, limit: u32| {
        if asked <= limit {
            return Ok(());
        }
        let what = format!("the {what} of the image '{name}'");
        Err(Error::TooLarge { what, asked: asked.into(), limit: limit.into() })
    };
    let limits = &physical.limits;
    within("width", width, limits.max_image_dimension2_d)?;
    within("height", height, limits.max_image_dimension2_d)?;
    within("number of layers", desc.layers, limits.max_image_array_layers)?;
    within("number of mip levels", desc.mip_levels, mip_count(desc.extent))?;
    let Some(of_format) = physical.image_limits(desc.format, desc.usage, flags(desc))? else {
        return Err(Error::Unsupported(format!(
            "'{}' has no images of format {:?} for {:?}, as '{name}' needs",
            physical.name, desc.format, desc.usage
        )));
    };
    within("width", width, of_format.max_extent.width)?;
    within("height", height, of_format.max_extent.height)?;
    within("number of layers", desc.layers, of_format.max_array_layers)?;
    within("number of mip levels", desc.mip_levels, of_format.max_mip_levels)?;
    if !of_format.sample_counts.contains(desc.samples) {
        let (samples, format) = (desc.samples, desc.format);
        return Err(Error::Unsupported(format!("'{name}' cannot have {samples:?} samples a texel of {format:?}")));
    }
    Ok(())
}

/// The number of levels of a full mip chain, down to one texel.
pub fn mip_count(extent: vk::Extent2D) -> u32 {
    extent.width.max(extent.height).max(1).ilog2() + 1
}

/// Returns true if mip levels of this format can be made by linear blits, as [`super::Uploader::texture`] does.
pub fn can_blit(physical: &PhysicalDevice, format: vk::Format) -> bool {
    physical.format_features(format).contains(
        vk::FormatFeatureFlags::BLIT_SRC
            | vk::FormatFeatureFlags::BLIT_DST
            | vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR,
    )
}

/// The bytes of a texel in a buffer; 0 for compressed and multi-planar formats. By the numbering of `VkFormat`, in which
/// formats of one size follow each other.
pub fn format_bytes(format: vk::Format) -> u32 {
    match format.as_raw() {
        1 | 9..=15 | 127 => 1,
        2..=8 | 16..=22 | 70..=76 | 124 => 2,
        // D16_S8 has no packed form in a buffer, where aspects are copied separately: this is its size on the device.
        23..=36 | 128 => 3,
        37..=69 | 77..=83 | 98..=100 | 122 | 123 | 125 | 126 | 129 => 4,
        130 => 5,
        84..=90 => 6,
        91..=97 | 101..=103 | 110..=112 => 8,
        104..=106 => 12,
        107..=109 | 113..=115 => 16,
        116..=118 => 24,
        119..=121 => 32,
        _ => 0,
    }
}

/// Returns the edge in texels and the bytes of a format's smallest unit: a texel, or a block of BC7 or ETC2. Other compressed formats and
/// multi-planar formats have 0 bytes.
pub(super) fn format_block(format: vk::Format) -> (u32, u32) {
    match format {
        vk::Format::BC7_UNORM_BLOCK
        | vk::Format::BC7_SRGB_BLOCK
        | vk::Format::ETC2_R8G8B8A8_UNORM_BLOCK
        | vk::Format::ETC2_R8G8B8A8_SRGB_BLOCK => (4, 16),
        vk::Format::ETC2_R8G8B8_UNORM_BLOCK
        | vk::Format::ETC2_R8G8B8_SRGB_BLOCK
        | vk::Format::ETC2_R8G8B8A1_UNORM_BLOCK
        | vk::Format::ETC2_R8G8B8A1_SRGB_BLOCK => (4, 8),
        texels => (1, format_bytes(texels)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn format_sizes_are_those_of_the_specification() {
        for (format, bytes) in [
            (vk::Format::R8_UNORM, 1),
            (vk::Format::R5G6B5_UNORM_PACK16, 2),
            (vk::Format::R8G8_UNORM, 2),
            (vk::Format::R8G8B8_SRGB, 3),
            (vk::Format::B8G8R8_UNORM, 3),
            (vk::Format::R8G8B8A8_SRGB, 4),
            (vk::Format::A2B10G10R10_UNORM_PACK32, 4),
            (vk::Format::A2R10G10B10_UNORM_PACK32, 4),
            (vk::Format::R16_SFLOAT, 2),
            (vk::Format::R16G16_UINT, 4),
            (vk::Format::R16G16_SFLOAT, 4),
            (vk::Format::R16G16B16A16_SFLOAT, 8),
            (vk::Format::R32_SFLOAT, 4),
            (vk::Format::R32G32_UINT, 8),
            (vk::Format::R32G32B32_SFLOAT, 12),
            (vk::Format::R32G32B32A32_SFLOAT, 16),
            (vk::Format::B10G11R11_UFLOAT_PACK32, 4),
            (vk::Format::D16_UNORM, 2),
            (vk::Format::D32_SFLOAT, 4),
            (vk::Format::D24_UNORM_S8_UINT, 4),
            (vk::Format::BC7_SRGB_BLOCK, 0),
        ] {
            assert_eq!(format_bytes(format), bytes, "{format:?}");
        }
    }

    #[test]
    fn a_full_mip_chain_ends_at_one_texel() {
        let count = |width, height| mip_count(vk::Extent2D { width, height });
        assert_eq!([count(1, 1), count(2, 1), count(3, 3), count(256, 16), count(257, 1)], [1, 2, 2, 9, 9]);
    }
}
