//! Deformed meshes on the device: their form at rest, which SKIN reads, and the vertices that it writes for passes to draw.

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;

use super::{COLOR, NORMAL, POSITION, POSITION_BEFORE, SECOND_UV, TANGENT, UV, colors, directions, stride};
use crate::gpu::{self, Buffer, Device, Location, MemoryKind, Uploader};
use crate::plan::{DeformPlan, PlannedDeform};
use crate::scene::{Mesh, Scene};
use crate::shaders::skin::{self, host as wgsl, host::NONE};

/// Invocations of a work group.
const GROUP: usize = skin::WORKGROUP_SIZE[0] as usize;
/// Work groups of a row of the dispatch: every device takes as many.
const COLUMNS: u32 = 65535;

/// The most vertex streams.
const STREAMS: usize = 6;

/// The buffers of all deformed objects.
pub struct Deformed {
    /// SKIN's output, which passes draw: streams one after the other.
    pub vertices: Buffer,
    /// SKIN's input.
    pub sources: Buffer,
    /// SKIN's push constants.
    pub push: SkinPush,
    /// The first byte of each stream.
    starts: [Option<u64>; STREAMS],
    /// The first byte of the positions of the pose before, where they are kept.
    before: Option<u64>,
}

/// `Push` of `shaders/skin.wgsl`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct SkinPush {
    columns: u32,
    groups: u32,
    records_at: u32,
    normals_at: u32,
    tangents_at: u32,
    uvs_at: u32,
    colors_at: u32,
    weights_row: u32,
    positions_before_at: u32,
}

const _: () = {
    use crate::shaders::skin::push as wgsl;
    use std::mem::offset_of;
    assert!(size_of::<SkinPush>() == wgsl::SIZE);
    assert!(offset_of!(SkinPush, columns) == wgsl::COLUMNS);
    assert!(offset_of!(SkinPush, groups) == wgsl::GROUPS);
    assert!(offset_of!(SkinPush, records_at) == wgsl::RECORDS_AT);
    assert!(offset_of!(SkinPush, normals_at) == wgsl::NORMALS_AT);
    assert!(offset_of!(SkinPush, tangents_at) == wgsl::TANGENTS_AT);
    assert!(offset_of!(SkinPush, uvs_at) == wgsl::UVS_AT);
    assert!(offset_of!(SkinPush, colors_at) == wgsl::COLORS_AT);
    assert!(offset_of!(SkinPush, weights_row) == wgsl::WEIGHTS_ROW);
    assert!(offset_of!(SkinPush, positions_before_at) == wgsl::POSITIONS_BEFORE_AT);
};

impl SkinPush {
    /// Work groups across and down.
    pub fn groups(&self) -> [u32; 2] {
        [self.groups.min(COLUMNS), self.groups.div_ceil(COLUMNS)]
    }
}

impl Deformed {
    /// Uploads SKIN's input, and the streams that no pose changes.
    ///
    /// # Errors
    /// When there is no memory for it, or a shader cannot see all of it at once.
    pub fn new(device: &Arc<Device>, uploader: &mut Uploader, scene: &Scene, plan: &DeformPlan) -> gpu::Result<Self> {
        let (starts, end) = starts(plan);
        let before = plan.keeps_positions.then_some(end);
        let words = |stream: u32| starts[stream as usize].map_or(NONE, |bytes| (bytes / 4) as u32);
        let sources = SkinInput::of(scene, plan);
        let limit = u64::from(device.physical.limits.max_storage_buffer_range);
        let source_bytes = size_of_val(&sources.words[..]) as u64;
        for (what, asked) in [("deformed vertices", plan.vertex_bytes()), ("deformed meshes at rest", source_bytes)] {
            if asked > limit {
                return Err(gpu::Error::TooLarge { what: what.into(), asked, limit });
            }
        }
        let buffer = |name: &str, bytes: u64, usage: vk::BufferUsageFlags| {
            let usage = usage | vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
            Buffer::new(device, name, bytes, usage, Location::Device, MemoryKind::Geometry)
        };
        let own = Self {
            vertices: buffer("deformed vertices", plan.vertex_bytes(), vk::BufferUsageFlags::VERTEX_BUFFER)?,
            sources: buffer("deformed meshes at rest", source_bytes, vk::BufferUsageFlags::empty())?,
            push: SkinPush {
                columns: COLUMNS,
                groups: sources.groups,
                records_at: sources.groups * 2,
                normals_at: words(NORMAL),
                tangents_at: words(TANGENT),
                uvs_at: words(UV),
                colors_at: words(COLOR),
                weights_row: plan.joints as u32 * 3,
                positions_before_at: before.map_or(NONE, |bytes| (bytes / 4) as u32),
            },
            starts,
            before,
        };
        uploader.buffer(&own.sources, 0, bytemuck::cast_slice(&sources.words))?;
        for deform in &plan.meshes {
            let mesh = &scene.meshes[deform.mesh];
            own.upload(uploader, UV, deform, bytemuck::cast_slice(&mesh.uvs), mesh)?;
            own.upload(uploader, SECOND_UV, deform, bytemuck::cast_slice(&mesh.uvs_1), mesh)?;
            own.upload(uploader, COLOR, deform, bytemuck::cast_slice(&colors(mesh)), mesh)?;
        }
        Ok(own)
    }

    /// A stream that shapes may change and joints do not: as at rest, or zeros of a mesh that lacks it.
    fn upload(
        &self,
        uploader: &mut Uploader,
        stream: u32,
        deform: &PlannedDeform,
        bytes: &[u8],
        mesh: &Mesh,
    ) -> gpu::Result<()> {
        let Some(start) = self.starts[stream as usize] else { return Ok(()) };
        let stride = stride(stream);
        let offset = start + u64::from(deform.first_vertex) * u64::from(stride);
        match bytes.is_empty() {
            true => uploader.buffer(&self.vertices, offset, &vec![0; mesh.positions.len() * stride as usize]),
            false => uploader.buffer(&self.vertices, offset, bytes),
        }
    }

    /// Returns the first byte of a stream; `None` where no pipeline reads it.
    pub fn start(&self, stream: u32) -> Option<u64> {
        if stream == POSITION_BEFORE { self.before } else { self.starts[stream as usize] }
    }
}

fn vertices(scene: &Scene, deform: &PlannedDeform) -> usize {
    scene.meshes[deform.mesh].positions.len()
}

/// The first byte of each stream, and the end of the last one.
fn starts(plan: &DeformPlan) -> ([Option<u64>; STREAMS], u64) {
    let present = |stream: u32| match stream {
        POSITION => true,
        NORMAL => plan.streams.normals,
        UV => plan.streams.uvs,
        TANGENT => plan.streams.tangents,
        COLOR => plan.streams.colors,
        _ => plan.streams.second_uvs,
    };
    let mut end = 0;
    let starts = std::array::from_fn(|stream| {
        let (stream, start) = (stream as u32, end);
        end += if present(stream) { plan.vertices * u64::from(stride(stream)) } else { 0 };
        present(stream).then_some(start)
    });
    (starts, end)
}

/// Everything that SKIN reads of meshes, in words.
struct SkinInput {
    words: Vec<u32>,
    groups: u32,
}

/// The offsets of a mesh's parts among the words.
#[derive(Clone, Copy)]
struct Rest {
    positions: u32,
    normals: u32,
    tangents: u32,
    uvs: u32,
    colors: u32,
    influences: u32,
    per_vertex: u32,
    shapes: u32,
    shape_words: u32,
    changes: u32,
}

impl SkinInput {
    fn of(scene: &Scene, plan: &DeformPlan) -> Self {
        let mut words = Vec::new();
        for (record, deform) in plan.meshes.iter().enumerate() {
            let firsts = (0..vertices(scene, deform)).step_by(GROUP);
            words.extend(firsts.flat_map(|first| [record as u32, first as u32]));
        }
        let groups = words.len() as u32 / 2;
        let records = words.len();
        words.resize(records + plan.meshes.len() * RECORD, 0);
        let mut meshes: BTreeMap<usize, Rest> = BTreeMap::new();
        for (index, deform) in plan.meshes.iter().enumerate() {
            let mesh = &scene.meshes[deform.mesh];
            let rest = *meshes.entry(deform.mesh).or_insert_with(|| Rest::of(&mut words, mesh));
            let skinned = deform.first_joint.is_some();
            let record: [u32; RECORD] = [
                mesh.positions.len() as u32,
                deform.first_vertex,
                rest.positions,
                rest.normals,
                rest.tangents,
                rest.uvs,
                rest.colors,
                if skinned { rest.influences } else { NONE },
                rest.per_vertex,
                deform.first_joint.unwrap_or(0),
                rest.shapes,
                if deform.first_weight.is_some() { mesh.morphs.len() as u32 } else { 0 },
                rest.shape_words,
                deform.first_weight.unwrap_or(0),
                rest.changes,
            ];
            words[records + index * RECORD..][..RECORD].copy_from_slice(&record);
        }
        Self { words, groups }
    }
}

/// Words of a record.
const RECORD: usize = wgsl::RECORD as usize;

impl Rest {
    /// Appends a mesh.
    fn of(words: &mut Vec<u32>, mesh: &Mesh) -> Self {
        let mut append = |floats: &[f32]| {
            let at = words.len() as u32;
            words.extend(floats.iter().map(|value| value.to_bits()));
            if floats.is_empty() { NONE } else { at }
        };
        let positions = append(mesh.positions.as_flattened());
        let normals = append(directions::normals(mesh).as_flattened());
        let tangents = append(directions::tangents(mesh).as_flattened());
        let uvs = append(mesh.uvs.as_flattened());
        let colors = append(colors(mesh).as_flattened());
        let mut influences = NONE;
        if let Some(own) = &mesh.influences {
            influences = words.len() as u32;
            words.extend(own.joints.iter().map(|&joint| u32::from(joint)));
            words.extend(own.weights.iter().map(|weight| weight.to_bits()));
        }
        let shapes = words.len() as u32;
        let (shape_words, changes) = append_shapes(words, mesh);
        let per_vertex = mesh.influences.as_ref().map_or(0, |own| own.per_vertex as u32);
        Self { positions, normals, tangents, uvs, colors, influences, per_vertex, shapes, shape_words, changes }
    }
}

/// Appends the shapes of a mesh: of each, the attributes that any of them changes. Returns the words of one, and the bits of these attributes.
fn append_shapes(words: &mut Vec<u32>, mesh: &Mesh) -> (u32, u32) {
    let any = |is_empty: fn(&crate::scene::Morph) -> bool| !mesh.morphs.iter().all(is_empty);
    let bits =
        [wgsl::SHAPES_POSITIONS, wgsl::SHAPES_NORMALS, wgsl::SHAPES_TANGENTS, wgsl::SHAPES_UVS, wgsl::SHAPES_COLORS];
    let changes = [
        any(|shape| shape.positions.is_empty()),
        any(|shape| shape.normals.is_empty()),
        any(|shape| shape.tangents.is_empty()),
        any(|shape| shape.uvs.is_empty()),
        any(|shape| shape.colors.is_empty()),
    ];
    let count = mesh.positions.len();
    let before = words.len();
    for shape in &mesh.morphs {
        let normals = directions::normal_offsets(mesh, &shape.normals);
        let tangents = directions::tangent_offsets(mesh, &shape.tangents);
        let own = [
            (changes[0], shape.positions.as_flattened(), 3),
            (changes[1], normals.as_flattened(), 3),
            (changes[2], tangents.as_flattened(), 3),
            (changes[3], shape.uvs.as_flattened(), 2),
            (changes[4], shape.colors.as_flattened(), 4),
        ];
        for (_, values, width) in own.into_iter().filter(|(changes, ..)| *changes) {
            words.extend(values.iter().map(|value| value.to_bits()));
            // Zeros for the attributes that this shape does not change.
            words.resize(words.len() + count * width - values.len(), 0);
        }
    }
    let bits = bits.iter().zip(changes).map(|(bit, is_set)| if is_set { *bit } else { 0 }).sum();
    ((words.len() - before).checked_div(mesh.morphs.len()).unwrap_or(0) as u32, bits)
}

/// The CPU's data of a pose for one frame in flight.
pub struct PoseBuffer {
    buffer: Buffer,
    joints: usize,
}

impl PoseBuffer {
    /// With room for all joints and weights of a plan; `None` where nothing is deformed.
    ///
    /// # Errors
    /// When there is no memory for it.
    pub fn new(device: &Arc<Device>, index: usize, plan: &DeformPlan) -> gpu::Result<Option<Self>> {
        if plan.meshes.is_empty() {
            return Ok(None);
        }
        let (name, size) = (format!("pose of frame {index}"), plan.pose_bytes().max(16));
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let buffer = Buffer::new(device, &name, size, usage, Location::Upload, MemoryKind::Uniform)?;
        Ok(Some(Self { buffer, joints: plan.joints as usize }))
    }

    /// The buffer that SKIN reads.
    pub fn buffer(&self) -> &Buffer {
        &self.buffer
    }

    /// Writes joints, as rows, and weights. The frame that used the buffer before must be done.
    ///
    /// # Errors
    /// When mapped memory cannot be flushed.
    pub fn write(&self, joints: &[[[f32; 4]; 3]], weights: &[f32]) -> gpu::Result<()> {
        if !joints.is_empty() {
            self.buffer.write(0, joints)?;
        }
        if weights.is_empty() { Ok(()) } else { self.buffer.write(self.joints as u64 * 48, weights) }
    }
}
