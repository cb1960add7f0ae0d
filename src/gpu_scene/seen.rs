//! The buffers in which the light path `visibility` looks surfaces up: the scene's meshes and textures, and for each frame its instances and materials.

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::instances::GrowingBuffer;
use super::{GpuScene, Instances};
use crate::gpu::sync::{Layouts, Use};
use crate::gpu::{self, Buffer, DescriptorPool, Device, SetLayout, SetLayoutBinding, SetWriter, binding};
use crate::plan::{Extras, FramePlan, GeometryKey, IndexWidth};
use crate::scene::{Brdf, Material, TextureSlot};
use crate::shaders::shared::seen as wgsl;
use crate::visible::{Visible, World, WorldObject};

/// Looks up vertices, indices and textures.
pub const LOOK_UP: Use = Use::new(
    vk::PipelineStageFlags2::COMPUTE_SHADER,
    vk::AccessFlags2::from_raw(
        vk::AccessFlags2::SHADER_SAMPLED_READ.as_raw() | vk::AccessFlags2::SHADER_STORAGE_READ.as_raw(),
    ),
);

/// Bindings of `shaders/shared/seen.wgsl`.
const INSTANCES: u32 = 0;
const ROWS: u32 = 1;
const MATERIALS: u32 = 2;
const POSITIONS: u32 = 3;
const NORMALS: u32 = 4;
const UVS: u32 = 5;
const TANGENTS: u32 = 6;
const SECOND_UVS: u32 = 7;
const COLORS: u32 = 8;
const INDICES_16: u32 = 9;
const INDICES_32: u32 = 10;
const LOOKS: u32 = 11;
const UV_MAPS: u32 = 12;
const TEXTURES: u32 = 13;
const SAMPLERS: u32 = 14;

/// `SeenMaterial` of the shader.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct SeenMaterial {
    base_color: Vec3,
    alpha: f32,
    emissive: Vec3,
    normal_scale: f32,
    specular: Vec3,
    grazing: f32,
    metallic: f32,
    roughness: f32,
    ambient: f32,
    first_uv_map: u32,
    traits: u32,
    slots: [u32; TextureSlot::STORED],
}

const _: () = {
    use crate::shaders::tiled::structs::seen_material as wgsl;
    use std::mem::offset_of;
    assert!(size_of::<SeenMaterial>() == wgsl::SIZE);
    assert!(offset_of!(SeenMaterial, base_color) == wgsl::BASE_COLOR);
    assert!(offset_of!(SeenMaterial, alpha) == wgsl::ALPHA);
    assert!(offset_of!(SeenMaterial, emissive) == wgsl::EMISSIVE);
    assert!(offset_of!(SeenMaterial, normal_scale) == wgsl::NORMAL_SCALE);
    assert!(offset_of!(SeenMaterial, specular) == wgsl::SPECULAR);
    assert!(offset_of!(SeenMaterial, grazing) == wgsl::GRAZING);
    assert!(offset_of!(SeenMaterial, metallic) == wgsl::METALLIC);
    assert!(offset_of!(SeenMaterial, roughness) == wgsl::ROUGHNESS);
    assert!(offset_of!(SeenMaterial, ambient) == wgsl::AMBIENT);
    assert!(offset_of!(SeenMaterial, first_uv_map) == wgsl::FIRST_UV_MAP);
    assert!(offset_of!(SeenMaterial, traits) == wgsl::TRAITS);
    assert!(offset_of!(SeenMaterial, slots) == wgsl::SLOTS);
};

/// The traits of materials with this key.
fn traits(key: GeometryKey, brdf: Brdf) -> u32 {
    let Extras { colors, colored_light, looks, .. } = key.extras;
    let bits = [
        (key.two_sided, wgsl::TWO_SIDED),
        (key.receives, wgsl::RECEIVES),
        (key.phong, wgsl::PHONG),
        (key.reflectance, wgsl::REFLECTANCE),
        (colors, wgsl::COLORED),
        (colored_light, wgsl::COLORED_LIGHT),
        (looks, wgsl::LOOKS),
        (key.mirrored, wgsl::MIRRORED),
    ];
    let own: u32 = bits.iter().filter(|(has, _)| *has).map(|(_, bit)| bit).sum();
    own | key.textures.bits() | ((brdf as u32) << wgsl::BRDF_SHIFT)
}

/// Returns the key by which records differ.
fn state(object: &WorldObject) -> (GeometryKey, (usize, u32)) {
    (object.key, object.material_set())
}

/// The buffers of the frames in flight, and the sets that name them and the looked-up parts of the scene.
pub struct VisibilityLookup {
    /// Set 3 of TILED.
    pub set_layout: SetLayout,
    /// Descriptors of the arrays of textures and of samplers; 0 where no material has a texture.
    pub textures: u32,
    pub samplers: u32,
    frames: Vec<PlaceBuffers>,
    /// An object of each state, and by object its state.
    states: Vec<usize>,
    state_of: Vec<u32>,
    /// Arrangement number of the instance list that the states belong to; none at first.
    arranged: Option<u64>,
    _pool: DescriptorPool,
}

/// The CPU's data for a frame in flight.
struct PlaceBuffers {
    instances: GrowingBuffer,
    materials: GrowingBuffer,
    set: vk::DescriptorSet,
    /// The buffers that the set names, which grow.
    names: Vec<vk::Buffer>,
}

impl VisibilityLookup {
    /// Makes the buffers of `frames` frames in flight; none if the plan looks nothing up.
    ///
    /// # Errors
    /// When there is no memory for it.
    pub fn new(device: &Arc<Device>, plan: &FramePlan, scene: &GpuScene, frames: usize) -> gpu::Result<Option<Self>> {
        if plan.triangles.is_none() {
            return Ok(None);
        }
        let numbered = scene.materials.as_ref().and_then(|materials| materials.numbered());
        let (textures, samplers) = numbered.map_or((0, 0), |own| (own.views.len() as u32, own.samplers.len() as u32));
        let bindings = bindings(textures, samplers);
        let set_layout = SetLayout::new(device, "seen surfaces", &bindings)?;
        let count = frames as u32;
        let kinds = [
            (vk::DescriptorType::STORAGE_BUFFER, (UV_MAPS + 1) * count),
            (vk::DescriptorType::SAMPLED_IMAGE, textures * count),
            (vk::DescriptorType::SAMPLER, samplers * count),
        ];
        let pool = DescriptorPool::new(device, "seen surfaces", count, &kinds)?;
        let place = |index| {
            let list = |name: &str| GrowingBuffer {
                name: format!("{name} of frame {index}"),
                usage: vk::BufferUsageFlags::STORAGE_BUFFER,
                buffer: None,
            };
            Ok(PlaceBuffers {
                instances: list("meshes of instances"),
                materials: list("materials"),
                set: pool.allocate(&format!("seen surfaces of frame {index}"), set_layout.raw)?,
                names: Vec::new(),
            })
        };
        Ok(Some(Self {
            frames: (0..frames).map(place).collect::<gpu::Result<_>>()?,
            set_layout,
            textures,
            samplers,
            states: Vec::new(),
            state_of: Vec::new(),
            arranged: None,
            _pool: pool,
        }))
    }

    /// The set of a frame in flight.
    pub fn set(&self, place: usize) -> vk::DescriptorSet {
        self.frames[place].set
    }

    /// Forgets the states: the world was replaced, and its revision may repeat.
    pub fn forget(&mut self) {
        self.arranged = None;
    }

    /// Writes the data of a frame in flight. The frame that used its buffers before must be done.
    ///
    /// # Errors
    /// When there is no memory for it.
    pub fn write(
        &mut self,
        device: &Arc<Device>,
        place: usize,
        (world, plan, scene): (&World, &FramePlan, &GpuScene),
        visible: &Visible,
        (instances, uv_maps): (&Instances, Option<&Buffer>),
    ) -> gpu::Result<()> {
        self.arrange(world);
        let own = &mut self.frames[place];
        let mut records = vec![[0u32; 4]; visible.instances.len().max(1)];
        for draw in visible.draws.iter().chain(&visible.shaded) {
            let object = &world.objects[draw.object];
            // The plan has the mesh of each object that a pass draws, and its levels.
            let Some(range) = scene.level(object.mesh, object.deform, draw.level) else { continue };
            let narrow = u32::from(range.width == IndexWidth::Bits16);
            let record = [range.first_index, range.vertex_offset as u32, self.state_of[draw.object], narrow];
            records[draw.first as usize..][..draw.count as usize].fill(record);
        }
        own.instances.write(device, &records)?;
        let numbered = scene.materials.as_ref().and_then(|materials| materials.numbered());
        let material = |&index: &usize| {
            let object = &world.objects[index];
            let slots = numbered.map_or_else(Default::default, |own| own.slots(object.material_set()));
            SeenMaterial::of(world, plan, object, slots)
        };
        let mut materials: Vec<SeenMaterial> = self.states.iter().map(material).collect();
        if materials.is_empty() {
            // A set names a buffer, though nothing is drawn.
            materials.push(SeenMaterial::zeroed());
        }
        own.materials.write(device, &materials)?;
        own.name((device, plan.layouts), scene, instances, uv_maps);
        Ok(())
    }

    /// Finds the states of the objects, where their list is another.
    fn arrange(&mut self, world: &World) {
        let arranged = Some(world.instances.arranged());
        if self.arranged == arranged {
            return;
        }
        let mut found = BTreeMap::new();
        self.states.clear();
        self.state_of.clear();
        for (index, object) in world.objects.iter().enumerate() {
            let next = self.states.len() as u32;
            let number = *found.entry(state(object)).or_insert(next);
            if number == next {
                self.states.push(index);
            }
            self.state_of.push(number);
        }
        self.arranged = arranged;
    }
}

fn bindings(textures: u32, samplers: u32) -> Vec<SetLayoutBinding> {
    let compute = vk::ShaderStageFlags::COMPUTE;
    let own = |index| index != UV_MAPS || textures > 0;
    let buffers = (0..=UV_MAPS).filter(|&index| own(index));
    let buffers = buffers.map(|index| binding(index, vk::DescriptorType::STORAGE_BUFFER, compute));
    let arrays =
        [(TEXTURES, vk::DescriptorType::SAMPLED_IMAGE, textures), (SAMPLERS, vk::DescriptorType::SAMPLER, samplers)];
    let arrays = arrays.into_iter().filter(|&(.., count)| count > 0);
    buffers.chain(arrays.map(|(index, kind, count)| binding(index, kind, compute).descriptor_count(count))).collect()
}

impl PlaceBuffers {
    /// Has the set name its buffers, where they are others than before.
    fn name(
        &mut self,
        (device, layouts): (&Device, Layouts),
        scene: &GpuScene,
        instances: &Instances,
        uv_maps: Option<&Buffer>,
    ) {
        let (Some(own), Some(materials)) = (&self.instances.buffer, &self.materials.buffer) else { return };
        // Bindings without a stream name this buffer; the shader never reads them.
        let rows = instances.rows.buffer.as_ref().unwrap_or(own);
        let looks = instances.looks.as_ref().and_then(|looks| looks.buffer.as_ref()).unwrap_or(own);
        let or_own = |buffer: &'_ Option<Buffer>| buffer.as_ref().map_or(own.raw, |buffer| buffer.raw);
        let numbered = scene.materials.as_ref().and_then(|materials| materials.numbered());
        let streams: [(u32, &Option<Buffer>); 8] = [
            (POSITIONS, &scene.positions),
            (NORMALS, &scene.normals),
            (UVS, &scene.uvs),
            (TANGENTS, &scene.tangents),
            (SECOND_UVS, &scene.second_uvs),
            (COLORS, &scene.colors),
            (INDICES_16, &scene.indices_16),
            (INDICES_32, &scene.indices_32),
        ];
        let names: Vec<vk::Buffer> = [own.raw, rows.raw, materials.raw, looks.raw]
            .into_iter()
            .chain(streams.iter().map(|(_, buffer)| or_own(buffer)))
            .collect();
        if self.names == names {
            return;
        }
        let mut writer = SetWriter::new()
            .storage_buffer(INSTANCES, own, ..)
            .storage_buffer(ROWS, rows, ..)
            .storage_buffer(MATERIALS, materials, ..)
            .storage_buffer(LOOKS, looks, ..);
        for (index, buffer) in streams {
            writer = writer.storage_buffer(index, buffer.as_ref().unwrap_or(own), ..);
        }
        if let Some(numbered) = numbered {
            let readable = layouts.of(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
            writer = writer
                .storage_buffer(UV_MAPS, uv_maps.unwrap_or(own), ..)
                .sampled_images(TEXTURES, numbered.views.iter().map(|view| view.raw), readable)
                .samplers(SAMPLERS, numbered.samplers.iter().copied());
        }
        writer.update(device, self.set);
        self.names = names;
    }
}

impl SeenMaterial {
    fn of(world: &World, plan: &FramePlan, object: &WorldObject, slots: [u32; TextureSlot::STORED]) -> Self {
        let material: &Material = &world.materials[object.material];
        let (key, brdf) = (object.key, material.model(plan.brdf_override));
        let shows_emission = key.forward.is_some_and(|forward| forward.emissive);
        let emissive = if shows_emission { material.emissive * world.exposure } else { Vec3::ZERO };
        Self {
            base_color: material.base_color,
            alpha: material.alpha,
            // Cut off here as well: infinity times a black texel would be no number.
            emissive: emissive.min(Vec3::splat(plan.largest_light())),
            normal_scale: material.normal_scale,
            specular: if key.reflectance { material.reflectance } else { material.specular },
            grazing: material.grazing,
            metallic: material.metallic,
            roughness: if key.phong { material.shininess } else { material.roughness },
            ambient: material.ambient,
            first_uv_map: plan.textures.first_uv_map(object.material).unwrap_or(u32::MAX),
            traits: traits(key, brdf),
            slots,
        }
    }
}
