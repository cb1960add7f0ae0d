//! The buffers of a frame's own, with its data for shaders: the camera and the lights, relative to each other.

use std::sync::Arc;

use ash::vk;
use bytemuck::Pod;
use glam::{Vec3, Vec4};

use super::records::{FrameUniform, LightRecord, VolumeData};
use super::sky::DirectionBuffer;
use super::{SkyMaps, air, lobes};
use crate::gpu::{self, Buffer, DescriptorPool, Device, Location, MemoryKind, Owned, SetLayout, SetWriter, binding};
use crate::plan::{FramePlan, Reach};
use crate::scene::{Camera, TextureSlot};
use crate::visible::{LightWork, Visible, World};

/// Set 0 of every pass: the frame, the lights where the plan has any, and the buffers that its light path reads besides.
pub fn set_layout(device: &Arc<Device>, plan: &FramePlan) -> gpu::Result<Owned<vk::DescriptorSetLayout>> {
    let everywhere = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT | vk::ShaderStageFlags::COMPUTE;
    let mut bindings = vec![binding(0, vk::DescriptorType::UNIFORM_BUFFER, everywhere)];
    if plan.lights.any() {
        let stages = vk::ShaderStageFlags::FRAGMENT | vk::ShaderStageFlags::COMPUTE;
        bindings.push(binding(1, lights_kind(plan), stages));
    }
    bindings.extend(
        list_bindings(plan).into_iter().map(|index| binding(index, vk::DescriptorType::STORAGE_BUFFER, everywhere)),
    );
    if !plan.textures.mapped.is_empty() {
        bindings.push(binding(UV_MAPS, vk::DescriptorType::STORAGE_BUFFER, vk::ShaderStageFlags::VERTEX));
    }
    bindings.extend(lobes::bindings(plan).map(|index| binding(index, vk::DescriptorType::STORAGE_BUFFER, everywhere)));
    bindings.extend(air::bindings(plan));
    bindings.extend(super::sky::bindings(plan));
    let is_storage = |own: &&vk::DescriptorSetLayoutBinding<'_>| {
        own.descriptor_type == vk::DescriptorType::STORAGE_BUFFER
            && own.stage_flags.contains(vk::ShaderStageFlags::COMPUTE)
    };
    debug_assert_eq!(bindings.iter().filter(is_storage).count() as u32, plan.frame_buffers());
    SetLayout::new(device, "frame set layout", &bindings)
}

/// Rows of UV maps, as `shaders/shared/material.wgsl` declares them.
const UV_MAPS: u32 = 5;

/// Storage buffers that light paths read beside the lights (`shaders/shared/clusters.wgsl`, `per_light.wgsl`, `tiled.wgsl`).
const CLUSTER_HEADS: u32 = 2;
const CLUSTER_LIGHTS: u32 = 3;
/// Volumes to be drawn, or spheres to be tested.
const VOLUMES: u32 = 4;

fn list_bindings(plan: &FramePlan) -> Vec<u32> {
    let clusters = plan.has_clusters().then_some([CLUSTER_HEADS, CLUSTER_LIGHTS]);
    clusters.into_iter().flatten().chain(plan.lists_volumes().then_some(VOLUMES)).collect()
}

fn lights_kind(plan: &FramePlan) -> vk::DescriptorType {
    match plan.lights.uniform {
        true => vk::DescriptorType::UNIFORM_BUFFER,
        false => vk::DescriptorType::STORAGE_BUFFER,
    }
}

/// The buffers of one frame in flight, written by the CPU each time, and the set that names them.
pub struct ViewBuffers {
    uniform: Buffer,
    lights: Option<Buffer>,
    /// Storage buffers, by binding.
    lists: Vec<(u32, Buffer)>,
    uv_maps: Option<Buffer>,
    sky_directions: Option<DirectionBuffer>,
    lobes: Option<Buffer>,
    /// The picture behind glass that is bound in the set.
    behind_glass: Option<vk::Buffer>,
    index: usize,
    pub set: vk::DescriptorSet,
    _pool: DescriptorPool,
}

impl ViewBuffers {
    pub fn new(
        device: &Arc<Device>,
        index: usize,
        layout: vk::DescriptorSetLayout,
        plan: &FramePlan,
        (world, sky, [light_in_air, behind_glass]): (&World, Option<&SkyMaps>, [Option<&Buffer>; 2]),
    ) -> gpu::Result<Self> {
        let buffer = |name: &str, size: usize, usage| {
            let name = format!("{name} of frame {index}");
            Buffer::new(device, &name, size as u64, usage, Location::Upload, MemoryKind::Uniform)
        };
        // Passes on another queue read it as well. It is small, and the CPU writes it for each frame: nobody hands it over.
        let make = if plan.computes_beside() { Buffer::shared } else { Buffer::new };
        let (name, size) = (format!("camera of frame {index}"), size_of::<FrameUniform>() as u64);
        let usage = vk::BufferUsageFlags::UNIFORM_BUFFER;
        let uniform = make(device, &name, size, usage, Location::Upload, MemoryKind::Uniform)?;
        // Shaders declare a uniform buffer with room for more lights and never read beyond the last one, which is all that is asked of them
        // (VUID-vkCmdDraw-uniformBuffers-06935). A kind of light that is kept without any has one that nobody reads.
        let count = world.lights.len().max(1);
        // The last four lights of a loop may be fewer: the values read of the others are of no consequence.
        let count = if plan.lights.by_fours { count.next_multiple_of(4) } else { count };
        let usage = match plan.lights.uniform {
            true => vk::BufferUsageFlags::UNIFORM_BUFFER,
            false => vk::BufferUsageFlags::STORAGE_BUFFER,
        };
        let lights = match plan.lights.any() {
            true => Some(buffer("lights", count * size_of::<LightRecord>(), usage)?),
            false => None,
        };
        let lists = list_bindings(plan)
            .into_iter()
            .map(|binding| Ok((binding, list_buffer(device, index, binding, LEAST_LIST)?)))
            .collect::<gpu::Result<Vec<_>>>()?;
        let rows = plan.textures.mapped.len() * plan.textures.mapped_slots;
        let uv_maps = match rows {
            0 => None,
            rows => Some(buffer("UV maps", rows * size_of::<[Vec4; 2]>(), vk::BufferUsageFlags::STORAGE_BUFFER)?),
        };
        let lobes = match &plan.effects.lobes {
            None => None,
            Some(own) => {
                let lobes = buffer("lobes", own.bytes() as usize, vk::BufferUsageFlags::STORAGE_BUFFER)?;
                lobes.write(0, lobes::sheen_shares())?;
                Some(lobes)
            }
        };
        let kinds = [
            (vk::DescriptorType::UNIFORM_BUFFER, 3),
            (vk::DescriptorType::STORAGE_BUFFER, 7 + u32::from(air::bindings(plan).is_some())),
            (vk::DescriptorType::SAMPLED_IMAGE, if sky.is_some() { 4 } else { 0 }),
            (vk::DescriptorType::SAMPLER, u32::from(sky.is_some())),
        ];
        let pool = DescriptorPool::new(device, &format!("pool of frame {index}"), 1, &kinds)?;
        let set = pool.allocate(&format!("set of frame {index}"), layout)?;
        let mut writer = SetWriter::new().uniform_buffer(0, &uniform, uniform.size);
        if let Some(lights) = &lights {
            writer = match plan.lights.uniform {
                true => writer.uniform_buffer(1, lights, lights.size),
                false => writer.storage_buffer(1, lights, lights.size),
            };
        }
        for (binding, list) in &lists {
            writer = writer.storage_buffer(*binding, list, list.size);
        }
        if let Some(uv_maps) = &uv_maps {
            writer = writer.storage_buffer(UV_MAPS, uv_maps, uv_maps.size);
        }
        if let Some(lobes) = &lobes {
            writer = lobes::write(lobes, behind_glass, writer);
        }
        writer = air::write(plan, light_in_air, lights.as_ref(), writer);
        if let (Some(sky), Some(planned)) = (sky, &plan.effects.sky) {
            let readable = plan.layouts.of(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
            writer = sky.write(planned, readable, writer);
        }
        let sky_directions = DirectionBuffer::new(device, index, plan)?;
        if let Some(directions) = &sky_directions {
            writer = directions.bind(writer);
        }
        writer.update(device, set);
        Ok(Self {
            uniform,
            lights,
            lists,
            uv_maps,
            sky_directions,
            lobes,
            behind_glass: behind_glass.map(|own| own.raw),
            index,
            set,
            _pool: pool,
        })
    }

    /// The mapping of each texture onto its mesh, if some texture's mapping differs from the mesh's own.
    pub fn uv_maps(&self) -> Option<&Buffer> {
        self.uv_maps.as_ref()
    }

    /// Writes this frame's values. The frame that used the buffers before must be done.
    ///
    /// # Errors
    /// When mapped memory cannot be flushed, or there is none for a longer list.
    pub fn write(
        &mut self,
        uniform: &FrameUniform,
        (world, plan): (&World, &FramePlan),
        visible: &Visible,
        camera: &Camera,
    ) -> gpu::Result<()> {
        self.uniform.write(0, std::slice::from_ref(uniform))?;
        if let Some(uv_maps) = &self.uv_maps {
            uv_maps.write(0, &uv_rows(world, plan))?;
        }
        if let Some(directions) = &self.sky_directions {
            directions.write(&world.sky_directions)?;
        }
        if let Some(lobes) = &self.lobes {
            lobes.write(lobes::ROWS_AT, &lobes::rows(world, plan))?;
        }
        if let Some(lights) = &self.lights {
            let record = |&light: &usize| LightRecord::of(&world.lights[light], world.shadow_codes[light], camera);
            let mut records: Vec<_> = visible.active_lights.lights.iter().map(record).collect();
            if let (true, Some(first)) = (records.is_empty(), world.lights.first()) {
                // One directional light that is all there is, FORWARD adds without counting.
                records.push(LightRecord { color: Vec3::ZERO, ..LightRecord::of(first, 0, camera) });
            }
            // A scene may have none.
            if !records.is_empty() {
                lights.write(0, &records)?;
            }
        }
        if let Some(clusters) = &visible.clusters {
            self.write_list(CLUSTER_HEADS, &clusters.heads)?;
            self.write_list(CLUSTER_LIGHTS, &clusters.lights)?;
        }
        match &visible.lights {
            LightWork::Nothing | LightWork::Draws(_) => Ok(()),
            LightWork::Volumes(volumes) => {
                self.write_list(VOLUMES, &volumes.records.iter().map(VolumeData::from).collect::<Vec<_>>())
            }
            LightWork::Spheres(spheres) => {
                let data = |reach: &Reach| reach.center.as_vec3().extend(reach.radius as f32);
                self.write_list(VOLUMES, &spheres.iter().map(data).collect::<Vec<_>>())
            }
        }
    }

    /// Makes [`Self::rename`] rebind the picture behind glass. Comparing handles is not enough: a new buffer may reuse the handle of a destroyed one.
    #[cfg(feature = "present")]
    pub fn forget_names(&mut self) {
        self.behind_glass = None;
    }

    /// Rebinds the picture behind glass if its buffer has changed, for example with another size. The frame that used the set before must be done.
    pub fn rename(&mut self, device: &Device, [_, behind_glass]: [Option<&Buffer>; 2]) {
        let raw = behind_glass.map(|own| own.raw);
        if let Some(lobes) = self.lobes.as_ref().filter(|_| raw != self.behind_glass) {
            lobes::write(lobes, behind_glass, SetWriter::new()).update(device, self.set);
            self.behind_glass = raw;
        }
    }

    /// Writes a list, into a longer buffer where it no longer fits. Nothing uses the old one: its frame is done.
    fn write_list<T: Pod>(&mut self, binding: u32, list: &[T]) -> gpu::Result<()> {
        let Some((_, buffer)) = self.lists.iter_mut().find(|(own, _)| *own == binding) else { return Ok(()) };
        let needed = size_of_val(list) as u64;
        if needed > buffer.size {
            let device = buffer.device().clone();
            *buffer = list_buffer(&device, self.index, binding, needed.next_power_of_two())?;
            SetWriter::new().storage_buffer(binding, buffer, buffer.size).update(&device, self.set);
        }
        if list.is_empty() { Ok(()) } else { buffer.write(0, list) }
    }
}

/// The records of all materials that have one.
fn uv_rows(world: &World, plan: &FramePlan) -> Vec<[Vec4; 2]> {
    let textures = &plan.textures;
    let record = |&material: &usize| {
        let maps = &world.materials[material].uv_maps;
        let slots = &TextureSlot::ALL[..textures.mapped_slots];
        slots.iter().map(|&slot| textures.uv_rows(material, slot, &maps[slot as usize])).collect::<Vec<_>>()
    };
    textures.mapped.iter().flat_map(record).collect()
}

/// Bytes of a list's first buffer.
const LEAST_LIST: u64 = 4096;

fn list_buffer(device: &Arc<Device>, index: usize, binding: u32, size: u64) -> gpu::Result<Buffer> {
    let name = format!("light list {binding} of frame {index}");
    Buffer::new(device, &name, size, vk::BufferUsageFlags::STORAGE_BUFFER, Location::Upload, MemoryKind::Uniform)
}
