//! The buffers of CULL, ARRANGE and FILL: all opaque objects as instances, and the rows of the visible ones with the commands that draw them.

mod groups;

use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::{Mat4, UVec2, Vec2, Vec3, Vec4};

pub use self::groups::CulledState;
use self::groups::Groups;
use super::GpuScene;
use crate::gpu::{self, Buffer, DescriptorPool, Device, Location, MemoryKind, SetLayout, SetWriter, binding};
use crate::plan::{CULL_BUFFERS, FramePlan};
use crate::scene::MOST_LEVELS;
use crate::shaders::{cull, fill, group_edge, pyramid, shared};
use crate::visible::{CullView, InstanceList, InstanceTransform, LevelChoice, PackedLook, STEPS, World};

/// Instances of a group, and invocations of a work group of CULL and of FILL.
const LANES: usize = shared::culling::LANES as usize;
const _: () = assert!(LANES == cull::WORKGROUP_SIZE[0] as usize && LANES == fill::WORKGROUP_SIZE[0] as usize);
/// Edge of the part of the picture that a work group of PYRAMID sees, in pixels: 8 for each invocation. It finds squares of four sizes.
const TILE: u32 = 8 * group_edge(pyramid::WORKGROUP_SIZE);
const TILE_SQUARES: u64 = 64 + 16 + 4 + 1;
/// The share of the instances that have moved since a frame's buffers were written from which on all are written at once: one by one takes eight
/// times as long for each.
const MANY_MOVES: f64 = 1.0 / 8.0;
/// Work groups of a row of a dispatch: every device takes as many.
const COLUMNS: u32 = 65535;
/// Words of a command, of an instance's rows, and of its look.
const COMMAND: usize = size_of::<vk::DrawIndexedIndirectCommand>() / 4;
const ROWS: usize = 12;
const LOOK: usize = size_of::<PackedLook>() / 4;

/// `Cull` of `shaders/shared/culling.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Uniform {
    planes: [Vec4; 5],
    camera: Vec3,
    slack: f32,
    camera_rest: Vec3,
    begin: f32,
    forward: Vec3,
    scale: f32,
    groups: u32,
    slots: u32,
    commands: u32,
    columns: u32,
    counts_at: u32,
    totals_at: u32,
    draws_at: u32,
    rows_at: u32,
    looks_at: u32,
    levels_at: u32,
    allowed: f32,
    is_orthographic: u32,
    clip_from_world: Mat4,
    picture: Vec2,
    tiles: UVec2,
}

/// `Bounds` of `shaders/cull.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct BoxRecord {
    center: Vec3,
    _first: f32,
    half: Vec3,
    _second: f32,
}

const _: () = assert!(CULL_BUFFERS as usize == BINDINGS.len() - 1);

// Of each step of depth and level of detail, `shaders/cull.wgsl` has a place.
const _: () = assert!(STEPS * (MOST_LEVELS + 1) == 544);

const _: () = {
    use crate::shaders::cull::structs::{bounds as box_record, cull as wgsl, instance_transform};
    use std::mem::offset_of;
    assert!(size_of::<Uniform>() == wgsl::SIZE);
    assert!(offset_of!(Uniform, planes) == wgsl::PLANES);
    assert!(offset_of!(Uniform, camera) == wgsl::CAMERA);
    assert!(offset_of!(Uniform, slack) == wgsl::SLACK);
    assert!(offset_of!(Uniform, camera_rest) == wgsl::CAMERA_REST);
    assert!(offset_of!(Uniform, begin) == wgsl::BEGIN);
    assert!(offset_of!(Uniform, forward) == wgsl::FORWARD);
    assert!(offset_of!(Uniform, scale) == wgsl::SCALE);
    assert!(offset_of!(Uniform, groups) == wgsl::GROUPS);
    assert!(offset_of!(Uniform, slots) == wgsl::SLOTS);
    assert!(offset_of!(Uniform, commands) == wgsl::COMMANDS);
    assert!(offset_of!(Uniform, columns) == wgsl::COLUMNS);
    assert!(offset_of!(Uniform, counts_at) == wgsl::COUNTS_AT);
    assert!(offset_of!(Uniform, totals_at) == wgsl::TOTALS_AT);
    assert!(offset_of!(Uniform, draws_at) == wgsl::DRAWS_AT);
    assert!(offset_of!(Uniform, rows_at) == wgsl::ROWS_AT);
    assert!(offset_of!(Uniform, looks_at) == wgsl::LOOKS_AT);
    assert!(offset_of!(Uniform, levels_at) == wgsl::LEVELS_AT);
    assert!(offset_of!(Uniform, allowed) == wgsl::ALLOWED);
    assert!(offset_of!(Uniform, is_orthographic) == wgsl::IS_ORTHOGRAPHIC);
    assert!(offset_of!(Uniform, clip_from_world) == wgsl::CLIP_FROM_WORLD);
    assert!(offset_of!(Uniform, picture) == wgsl::PICTURE);
    assert!(offset_of!(Uniform, tiles) == wgsl::TILES);
    assert!(size_of::<BoxRecord>() == box_record::SIZE);
    assert!(offset_of!(BoxRecord, half) == box_record::HALF);
    assert!(size_of::<InstanceTransform>() == instance_transform::SIZE);
};

/// The offsets, in words, of the parts of the buffer that CULL, ARRANGE and FILL write.
#[derive(Debug, Clone, Copy, Default)]
struct CullingLayout {
    groups: usize,
    /// Counts of a step: one for each level of each group.
    slots: usize,
    /// Commands of a step: one for each level of each batch.
    commands: usize,
    levels_at: usize,
    counts_at: usize,
    totals_at: usize,
    draws_at: usize,
    rows_at: usize,
    looks_at: usize,
    words: usize,
}

impl CullingLayout {
    fn of(list: &InstanceList, own: &Groups, has_looks: bool) -> Self {
        let &Groups { count: groups, slots, commands, levels_at, .. } = own;
        let counts_at = groups * LANES;
        let totals_at = counts_at + slots * STEPS;
        let draws_at = totals_at + STEPS;
        let rows_at = draws_at + STEPS * commands * COMMAND;
        let looks_at = rows_at + list.opaque_count() * ROWS;
        let words = looks_at + if has_looks { list.opaque_count() * LOOK } else { 0 };
        Self { groups, slots, commands, levels_at, counts_at, totals_at, draws_at, rows_at, looks_at, words }
    }
}

/// The buffers of the passes that cull on the device, and the sets that name them.
pub struct CullingBuffers {
    pub set_layout: SetLayout,
    /// Output of the passes, which draws read. All frames share it.
    pub culled: Buffer,
    /// The depths that PYRAMID writes and CULL reads, if the device culls hidden objects. Frames share the buffer.
    pub pyramid: Option<Buffer>,
    /// Width and height of the picture.
    size: [u32; 2],
    has_levels: bool,
    inputs: Vec<CullingInputs>,
    layout: CullingLayout,
    pub states: Vec<CulledState>,
    /// Arrangement number of the instance list that `layout` and `states` describe; none at first.
    arranged: Option<u64>,
    _pool: DescriptorPool,
}

/// The CPU's data for a frame in flight.
struct CullingInputs {
    index: usize,
    uniform: Buffer,
    groups: Option<Buffer>,
    transforms: Option<Buffer>,
    boxes: Option<Buffer>,
    /// The looks of the instances, if the plan has looks.
    looks: Option<Buffer>,
    has_looks: bool,
    /// The number of visible instances, by step of depth: ARRANGE writes it, and the CPU reads it when the frame is done.
    found: Buffer,
    set: vk::DescriptorSet,
    /// The list that the buffers hold, and the number of its moves that are in them.
    holds: Option<(u64, usize)>,
}

/// Of `shaders/shared/culling.wgsl` and the passes' own.
const BINDINGS: [vk::DescriptorType; 8] = {
    let mut kinds = [vk::DescriptorType::STORAGE_BUFFER; 8];
    kinds[0] = vk::DescriptorType::UNIFORM_BUFFER;
    kinds
};

/// Bindings; only some plans have looks or the pyramid.
const LOOKS: u32 = 5;
const PYRAMID: u32 = 6;
const FOUND: u32 = 7;

impl CullingBuffers {
    /// Makes the buffers of `frames` frames in flight; none if the plan does not cull on the device.
    ///
    /// # Errors
    /// When there is no memory for it.
    pub fn new(device: &Arc<Device>, plan: &FramePlan, frames: usize) -> gpu::Result<Option<Self>> {
        if !plan.culls_on_device {
            return Ok(None);
        }
        let has_looks = plan.has_looks();
        let is_in = |index: &u32| match *index {
            LOOKS => has_looks,
            PYRAMID => plan.hides_on_device,
            _ => true,
        };
        let bindings: Vec<_> = (0..BINDINGS.len() as u32)
            .filter(is_in)
            .map(|index| binding(index, BINDINGS[index as usize], vk::ShaderStageFlags::COMPUTE))
            .collect();
        let set_layout = SetLayout::new(device, "culling", &bindings)?;
        let count = frames as u32;
        let kinds = [
            (vk::DescriptorType::UNIFORM_BUFFER, count),
            (vk::DescriptorType::STORAGE_BUFFER, (bindings.len() as u32 - 1) * count),
        ];
        let pool = DescriptorPool::new(device, "culling", count, &kinds)?;
        let inputs = |index| {
            let size = size_of::<Uniform>() as u64;
            Ok(CullingInputs {
                index,
                uniform: upload_buffer(
                    device,
                    &format!("culling of frame {index}"),
                    size,
                    vk::BufferUsageFlags::UNIFORM_BUFFER,
                )?,
                groups: None,
                transforms: None,
                boxes: None,
                looks: None,
                has_looks,
                found: found_buffer(device, index)?,
                set: pool.allocate(&format!("culling of frame {index}"), set_layout.raw)?,
                holds: None,
            })
        };
        Ok(Some(Self {
            inputs: (0..frames).map(inputs).collect::<gpu::Result<_>>()?,
            culled: culled_buffer(device, 4)?,
            pyramid: pyramid_buffer(device, plan)?,
            size: plan.size,
            has_levels: plan.meshes.has_levels(),
            set_layout,
            layout: CullingLayout::default(),
            states: Vec::new(),
            arranged: None,
            _pool: pool,
        }))
    }

    /// The world is another, whatever its list says of itself.
    pub fn forget(&mut self) {
        self.arranged = None;
        self.inputs.iter_mut().for_each(|own| own.holds = None);
    }

    /// Makes the objects of the picture's size anew. Frames in flight keep the old one until they are done.
    ///
    /// # Errors
    /// When there is no memory for it.
    pub fn resize(&mut self, device: &Arc<Device>, plan: &FramePlan) -> gpu::Result<()> {
        (self.pyramid, self.size) = (pyramid_buffer(device, plan)?, plan.size);
        self.forget();
        Ok(())
    }

    /// Writes the data of a frame in flight. The frame that used its buffers before must be done.
    ///
    /// # Errors
    /// When there is no memory for it, or a shader cannot see all of it at once.
    pub fn write(
        &mut self,
        device: &Arc<Device>,
        place: usize,
        (world, scene): (&World, &GpuScene),
        (view, levels, clip_from_world): (&CullView, Option<&LevelChoice>, Mat4),
    ) -> gpu::Result<()> {
        let list = &world.instances;
        let own = &mut self.inputs[place];
        let holds = own.holds.filter(|(arranged, _)| *arranged == list.arranged());
        match holds {
            Some((_, known)) => {
                let moved = &list.moves()[known..];
                match moved.len() as f64 > MANY_MOVES * list.opaque_count() as f64 {
                    true => own.write_instances(device, world)?,
                    false => {
                        for place in moved.iter().map(|&place| place as usize).filter(|&own| own < list.opaque_count())
                        {
                            own.write_at(world, place)?;
                        }
                    }
                }
            }
            None => {
                let groups = Groups::of(world, scene);
                let extent = CullingLayout::of(list, &groups, own.has_looks);
                check(device, extent.words)?;
                if self.arranged != Some(list.arranged()) {
                    // Frames in flight keep the old one until they are done.
                    if self.culled.size < extent.words as u64 * 4 {
                        self.culled = culled_buffer(device, extent.words)?;
                    }
                    (self.layout, self.states, self.arranged) = (extent, groups.states, Some(list.arranged()));
                }
                own.write_all(device, world, &groups.words)?;
                own.name(device, &self.culled, self.pyramid.as_ref());
            }
        }
        own.holds = Some((list.arranged(), list.moves().len()));
        let at = |words: usize| words as u32;
        let CullingLayout {
            groups, slots, commands, levels_at, counts_at, totals_at, draws_at, rows_at, looks_at, ..
        } = self.layout;
        let uniform = Uniform {
            planes: view.planes,
            camera: view.camera.large,
            slack: view.slack,
            camera_rest: view.camera.rest,
            begin: view.begin,
            forward: view.forward,
            scale: view.scale,
            groups: at(groups),
            slots: at(slots),
            commands: at(commands),
            columns: COLUMNS,
            counts_at: at(counts_at),
            totals_at: at(totals_at),
            draws_at: at(draws_at),
            rows_at: at(rows_at),
            looks_at: at(looks_at),
            levels_at: at(levels_at),
            allowed: levels.map_or(0.0, |levels| levels.allowed),
            is_orthographic: u32::from(levels.is_some_and(|levels| levels.is_orthographic)),
            clip_from_world,
            picture: Vec2::from(self.size.map(|edge| edge as f32)),
            tiles: UVec2::from(tiles(self.size)),
        };
        own.uniform.write(0, &[uniform])
    }

    /// The set of a frame in flight.
    pub fn set(&self, place: usize) -> vk::DescriptorSet {
        self.inputs[place].set
    }

    /// Returns the counters that ARRANGE writes for the CPU in a frame in flight.
    pub fn found_buffer(&self, place: usize) -> &Buffer {
        &self.inputs[place].found
    }

    /// Returns the number of instances that were visible in a frame in flight that is done.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn found(&self, place: usize) -> gpu::Result<usize> {
        let buffer = &self.inputs[place].found;
        let count = |bytes: &[u8; 4]| u32::from_ne_bytes(*bytes) as usize;
        buffer.read_with(0, buffer.size, |bytes| bytes.as_chunks::<4>().0.iter().map(count).sum())
    }

    /// Work groups across and down, a work group for each group of instances.
    pub fn groups(&self) -> [u32; 2] {
        let groups = self.layout.groups as u32;
        [groups.min(COLUMNS), groups.div_ceil(COLUMNS)]
    }

    /// Returns the offset of a step's command, in bytes.
    pub fn command(&self, step: usize, command: u32) -> u64 {
        ((self.layout.draws_at + (step * self.layout.commands + command as usize) * COMMAND) * 4) as u64
    }

    /// Work groups of PYRAMID across and down.
    pub fn tiles(&self) -> [u32; 2] {
        tiles(self.size)
    }

    /// Returns true if it culls occluded objects.
    pub fn hides(&self) -> bool {
        self.pyramid.is_some()
    }

    /// Returns true if meshes have levels of detail.
    pub fn has_levels(&self) -> bool {
        self.has_levels
    }

    /// Returns true if instances have looks.
    pub fn has_looks(&self) -> bool {
        self.inputs.iter().any(|own| own.has_looks)
    }

    /// Binds the instances as streams of vertices.
    pub fn bind(&self, device: &Device, cmd: vk::CommandBuffer) {
        let rows = (super::ROWS, self.layout.rows_at);
        let looks = self.has_looks().then_some((super::LOOK, self.layout.looks_at));
        for (stream, start) in [Some(rows), looks].into_iter().flatten() {
            // SAFETY: the buffer was created with VERTEX_BUFFER usage and outlives the frame; its rows and looks begin within it.
            unsafe { device.raw.cmd_bind_vertex_buffers(cmd, stream, &[self.culled.raw], &[start as u64 * 4]) };
        }
    }
}

impl CullingInputs {
    fn write_at(&mut self, world: &World, place: usize) -> gpu::Result<()> {
        if let (Some(transforms), Some(boxes)) = (&self.transforms, &self.boxes) {
            transforms
                .write((place * size_of::<InstanceTransform>()) as u64, &world.instances.transforms()[place..=place])?;
            boxes.write((place * size_of::<BoxRecord>()) as u64, &[box_record(world, place)])?;
        }
        if let Some(looks) = &self.looks {
            looks.write((place * size_of::<PackedLook>()) as u64, &[world.look_at(place)])?;
        }
        Ok(())
    }

    fn write_all(&mut self, device: &Arc<Device>, world: &World, groups: &[u32]) -> gpu::Result<()> {
        let index = self.index;
        write_list(device, &mut self.groups, &format!("instance groups of frame {index}"), groups)?;
        self.write_instances(device, world)
    }

    /// Writes the placing and the looks of all instances.
    fn write_instances(&mut self, device: &Arc<Device>, world: &World) -> gpu::Result<()> {
        let (count, index) = (world.instances.opaque_count(), self.index);
        let boxes: Vec<BoxRecord> = (0..count).map(|place| box_record(world, place)).collect();
        write_list(
            device,
            &mut self.transforms,
            &format!("instances of frame {index}"),
            &world.instances.transforms()[..count],
        )?;
        write_list(device, &mut self.boxes, &format!("instances' boxes of frame {index}"), &boxes)?;
        if self.has_looks {
            let looks: Vec<PackedLook> = (0..count).map(|place| world.look_at(place)).collect();
            write_list(device, &mut self.looks, &format!("instances' looks of frame {index}"), &looks)?;
        }
        Ok(())
    }

    /// Binds the buffers in the descriptor set. The frame that used it must be done.
    fn name(&self, device: &Device, culled: &Buffer, pyramid: Option<&Buffer>) {
        let mut writer = SetWriter::new().uniform_buffer(0, &self.uniform, self.uniform.size);
        let lists = [
            (1, self.groups.as_ref()),
            (2, Some(culled)),
            (3, self.transforms.as_ref()),
            (4, self.boxes.as_ref()),
            (LOOKS, self.looks.as_ref()),
            (PYRAMID, pyramid),
            (FOUND, Some(&self.found)),
        ];
        for (binding, buffer) in lists {
            if let Some(buffer) = buffer {
                writer = writer.storage_buffer(binding, buffer, buffer.size);
            }
        }
        writer.update(device, self.set);
    }
}

/// A box in f32 about the list's place, no smaller than it is.
fn box_record(world: &World, place: usize) -> BoxRecord {
    let (center, half) = world.instances.box_of(&world.objects[world.instances.object(place)].bounds);
    BoxRecord { center, _first: 0.0, half, _second: 0.0 }
}

fn check(device: &Device, words: usize) -> gpu::Result<()> {
    let (asked, limit) = (words as u64 * 4, u64::from(device.physical.limits.max_storage_buffer_range));
    match asked > limit {
        true => Err(gpu::Error::TooLarge { what: "instances that are culled on the device".into(), asked, limit }),
        false => Ok(()),
    }
}

fn culled_buffer(device: &Arc<Device>, words: usize) -> gpu::Result<Buffer> {
    let usage = vk::BufferUsageFlags::STORAGE_BUFFER
        | vk::BufferUsageFlags::VERTEX_BUFFER
        | vk::BufferUsageFlags::INDIRECT_BUFFER;
    Buffer::new(device, "culled instances", words as u64 * 4, usage, Location::Device, MemoryKind::Geometry)
}

fn found_buffer(device: &Arc<Device>, index: usize) -> gpu::Result<Buffer> {
    let (name, bytes) = (format!("instances found in frame {index}"), STEPS as u64 * 4);
    Buffer::new(device, &name, bytes, vk::BufferUsageFlags::STORAGE_BUFFER, Location::ReadBack, MemoryKind::ReadBack)
}

fn tiles(size: [u32; 2]) -> [u32; 2] {
    size.map(|edge| edge.div_ceil(TILE))
}

/// The pyramid's buffer, if the plan culls occluded objects on the device.
fn pyramid_buffer(device: &Arc<Device>, plan: &FramePlan) -> gpu::Result<Option<Buffer>> {
    let [across, down] = tiles(plan.size).map(u64::from);
    let (bytes, usage) = (across * down * TILE_SQUARES * 4, vk::BufferUsageFlags::STORAGE_BUFFER);
    let make = || Buffer::new(device, "pyramid of depths", bytes, usage, Location::Device, MemoryKind::Attachment);
    plan.hides_on_device.then(make).transpose()
}

fn upload_buffer(device: &Arc<Device>, name: &str, size: u64, usage: vk::BufferUsageFlags) -> gpu::Result<Buffer> {
    Buffer::new(device, name, size, usage, Location::Upload, MemoryKind::Uniform)
}

/// Writes a list, into a longer buffer where it does not fit. A buffer of a shader holds something.
fn write_list<T: Pod>(device: &Arc<Device>, own: &mut Option<Buffer>, name: &str, list: &[T]) -> gpu::Result<()> {
    let needed = (size_of_val(list) as u64).max(256);
    let buffer = match own.take() {
        Some(buffer) if buffer.size >= needed => buffer,
        _ => upload_buffer(device, name, needed.next_power_of_two(), vk::BufferUsageFlags::STORAGE_BUFFER)?,
    };
    // Kept where the write fails: the set goes on naming it.
    let buffer = own.insert(buffer);
    if list.is_empty() { Ok(()) } else { buffer.write(0, list) }
}
