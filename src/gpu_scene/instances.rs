//! The placing and the looks of instances: rows of their maps and their looks, written for each frame in the order in which they are drawn.

use std::sync::Arc;

use ash::vk;
use bytemuck::Pod;
use glam::Vec4;

use super::{GpuScene, LOOK, NUMBER, ROWS};
use crate::gpu::{self, Buffer, Device, Location, MemoryKind};
use crate::plan::{FramePlan, Shading, TriangleCode};
use crate::scene::Camera;
use crate::visible::{MapDraw, Visible, World};

/// The instances of one frame in flight.
pub struct Instances {
    /// Three rows for each instance, from the mesh to the world around the camera.
    pub(super) rows: GrowingBuffer,
    /// Four rows for each caster, from the mesh to a map's clip space, one map after another. Absent without shadow maps.
    casters: Option<GrowingBuffer>,
    /// The number of each instance's object plus 1, in the view of triangles. If triangles are looked up: the code of the instance's first triangle,
    /// minus that triangle's first vertex.
    numbers: Option<GrowingBuffer>,
    /// The look of each instance, and of each caster, if the plan has looks.
    pub(super) looks: Option<GrowingBuffer>,
    caster_looks: Option<GrowingBuffer>,
}

/// A buffer that grows with its content.
pub(super) struct GrowingBuffer {
    pub name: String,
    pub usage: vk::BufferUsageFlags,
    pub buffer: Option<Buffer>,
}

impl Instances {
    /// Makes the empty buffers of a frame in flight.
    pub fn new(index: usize, plan: &FramePlan) -> Self {
        // TILED also reads them as storage buffers, if it is told the instance of each pixel.
        let looked_up = plan.triangles.map_or(vk::BufferUsageFlags::empty(), |_| vk::BufferUsageFlags::STORAGE_BUFFER);
        let usage = vk::BufferUsageFlags::VERTEX_BUFFER | looked_up;
        let list = |name: &str| GrowingBuffer { name: format!("{name} of frame {index}"), usage, buffer: None };
        Self {
            rows: list("instances"),
            casters: plan.shadow.is_some().then(|| list("casters")),
            numbers: (plan.shading == Shading::ShowTriangle || plan.triangles.is_some())
                .then(|| list("numbers of instances")),
            looks: plan.has_looks().then(|| list("looks of instances")),
            caster_looks: plan.has_caster_looks().then(|| list("looks of casters")),
        }
    }

    /// Writes the instances of a frame. The frame that used the buffers before must be done.
    ///
    /// # Errors
    /// When mapped memory cannot be flushed, or there is none for a longer list.
    pub fn write(
        &mut self,
        device: &Arc<Device>,
        (world, plan, scene): (&World, &FramePlan, &GpuScene),
        (visible, camera): (&Visible, &Camera),
        maps: &[MapDraw],
    ) -> gpu::Result<()> {
        self.rows.write(device, &visible.rows(world, camera))?;
        if let Some(casters) = &mut self.casters {
            let rows: Vec<[Vec4; 4]> = maps.iter().flat_map(|map| visible.caster_rows(world, map)).collect();
            casters.write(device, &rows)?;
        }
        if let Some(numbers) = &mut self.numbers {
            let number = |&object: &u32| world.objects[object as usize].number as u32 + 1;
            let own = match plan.triangles {
                Some(code) => codes(code, world, scene, visible),
                None => visible.instances.iter().map(number).collect(),
            };
            numbers.write(device, &own)?;
        }
        if let Some(looks) = &mut self.looks {
            looks.write(device, &visible.looks(world))?;
        }
        if let Some(looks) = &mut self.caster_looks {
            let of_map = |map| visible.caster_looks(world, map);
            looks.write(device, &maps.iter().flat_map(of_map).collect::<Vec<_>>())?;
        }
        Ok(())
    }

    /// Binds the streams of instances that pipelines of the surfaces read.
    pub fn bind(&self, device: &Device, cmd: vk::CommandBuffer) {
        self.rows.bind(device, cmd, ROWS);
        if let Some(numbers) = &self.numbers {
            numbers.bind(device, cmd, NUMBER);
        }
        if let Some(looks) = &self.looks {
            looks.bind(device, cmd, LOOK);
        }
    }

    /// Binds the streams of casters.
    pub fn bind_casters(&self, device: &Device, cmd: vk::CommandBuffer) {
        if let Some(casters) = &self.casters {
            casters.bind(device, cmd, ROWS);
        }
        if let Some(looks) = &self.caster_looks {
            looks.bind(device, cmd, LOOK);
        }
    }
}

/// By place: the code of the instance's first triangle, less the vertex with which that begins, so that the next triangle's vertex leads to the next code. Both
/// wrap.
fn codes(code: TriangleCode, world: &World, scene: &GpuScene, visible: &Visible) -> Vec<u32> {
    let mut codes = vec![0; visible.instances.len()];
    for draw in visible.draws.iter().chain(&visible.shaded) {
        let object = &world.objects[draw.object];
        // The plan has the mesh of each object that a pass draws, and its levels.
        let Some(range) = scene.level(object.mesh, object.deform, draw.level) else { continue };
        let begin = range.begin.wrapping_add_signed(range.vertex_offset);
        for place in draw.instances() {
            codes[place as usize] = place.unbounded_shl(code.bits).wrapping_sub(begin);
        }
    }
    codes
}

impl GrowingBuffer {
    /// Writes a list, into a longer buffer where it no longer fits. Nothing uses the old one: its frame is done.
    pub fn write<T: Pod>(&mut self, device: &Arc<Device>, list: &[T]) -> gpu::Result<()> {
        let needed = size_of_val(list) as u64;
        if needed == 0 {
            return Ok(());
        }
        let buffer = match self.buffer.take() {
            Some(buffer) if buffer.size >= needed => buffer,
            _ => {
                let size = needed.next_power_of_two();
                Buffer::new(device, &self.name, size, self.usage, Location::Upload, MemoryKind::Uniform)?
            }
        };
        // Kept where the write fails: a set may go on naming it.
        self.buffer.insert(buffer).write(0, list)
    }

    /// Binds it, if it ever held something.
    fn bind(&self, device: &Device, cmd: vk::CommandBuffer, stream: u32) {
        let Some(buffer) = &self.buffer else { return };
        // SAFETY: the buffer was created with VERTEX_BUFFER usage and lives until its frame is done and written anew.
        unsafe { device.raw.cmd_bind_vertex_buffers(cmd, stream, &[buffer.raw], &[0]) };
    }
}
