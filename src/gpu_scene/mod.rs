//! A scene's buffers, textures and descriptor sets on the device: what the plan needs of it and no more.

mod material;
mod shadows;
mod sorted;
mod view;

pub use material::Materials;
pub use shadows::{ATLAS_LAYOUT, ClearOrder, ShadowAtlas, clear as shadow_clear};
pub use sorted::SortedIndices;
pub use view::{FrameUniform, LightRecord, ViewBuffers, set_layout as view_set_layout};

use std::sync::Arc;

use ash::vk;

use crate::gpu::sync::Use;
use crate::gpu::{self, Buffer, Device, Location, MemoryKind, UploadOrder, Uploader};
use crate::plan::{FramePlan, World, cone_mesh, sphere_mesh};
use crate::scene::{Mesh, Scene};

/// Fetches a vertex.
pub const VERTEX_READ: Use = Use::new(vk::PipelineStageFlags::VERTEX_INPUT, vk::AccessFlags::VERTEX_ATTRIBUTE_READ);
/// Fetches an index.
pub const INDEX_READ: Use = Use::new(vk::PipelineStageFlags::VERTEX_INPUT, vk::AccessFlags::INDEX_READ);
/// Samples a material's texture, in whichever pass.
pub const TEXTURE_READ: Use = Use::new(vk::PipelineStageFlags::FRAGMENT_SHADER, vk::AccessFlags::SHADER_READ);

/// Where a mesh lies in the shared buffers.
#[derive(Debug, Clone, Copy)]
pub struct MeshRange {
    pub first_index: u32,
    pub index_count: u32,
    pub vertex_offset: i32,
}

/// Vertex streams lie in buffers of their own, so that a pass binds only what it reads.
pub struct GpuScene {
    pub positions: Option<Buffer>,
    pub normals: Option<Buffer>,
    pub uvs: Option<Buffer>,
    pub tangents: Option<Buffer>,
    pub indices: Option<Buffer>,
    pub meshes: Vec<MeshRange>,
    pub materials: Option<Materials>,
    /// Where the light path draws lights' volumes.
    pub volumes: Option<VolumeMeshes>,
}

/// The volumes of lights, whose corners lie one after the other: those of a sphere, then those of a cone.
pub struct VolumeMeshes {
    pub corners: Buffer,
    pub sphere: u32,
    pub cone: u32,
}

/// Vertex buffer bindings, as `shaders/geometry.wgsl` numbers its locations.
pub const POSITION: u32 = 0;
pub const NORMAL: u32 = 1;
pub const UV: u32 = 2;
pub const TANGENT: u32 = 3;

/// Format of a stream's only attribute.
pub fn stream_format(stream: u32) -> vk::Format {
    match stream {
        POSITION | NORMAL => vk::Format::R32G32B32_SFLOAT,
        UV => vk::Format::R32G32_SFLOAT,
        _ => vk::Format::R32G32B32A32_SFLOAT,
    }
}

/// Vertex input state for some streams, each in a buffer of its own.
pub fn vertex_input(
    streams: &[u32],
) -> (Vec<vk::VertexInputBindingDescription>, Vec<vk::VertexInputAttributeDescription>) {
    let stride = |stream| match stream {
        POSITION | NORMAL => 12,
        UV => 8,
        _ => 16,
    };
    streams
        .iter()
        .map(|&stream| {
            let binding = vk::VertexInputBindingDescription::default()
                .binding(stream)
                .stride(stride(stream))
                .input_rate(vk::VertexInputRate::VERTEX);
            let attribute = vk::VertexInputAttributeDescription::default()
                .binding(stream)
                .location(stream)
                .format(stream_format(stream));
            (binding, attribute)
        })
        .unzip()
}

impl GpuScene {
    /// Submits the uploads, which `order` puts before all that is submitted later.
    ///
    /// # Errors
    /// When there is no memory for it, or the device is lost.
    pub fn new(
        device: &Arc<Device>,
        scene: &Scene,
        world: &World,
        plan: &FramePlan,
        order: UploadOrder,
    ) -> gpu::Result<Self> {
        let mut uploader = Uploader::new(device, 32 << 20, order)?;
        let streams = &plan.streams;
        let meshes = &scene.meshes;
        let gpu_scene = Self {
            positions: stream(device, &mut uploader, "positions", meshes, 3, |mesh| {
                bytemuck::cast_slice(&mesh.positions)
            })?,
            normals: match streams.normals {
                true => {
                    stream(device, &mut uploader, "normals", meshes, 3, |mesh| bytemuck::cast_slice(&mesh.normals))?
                }
                false => None,
            },
            uvs: match streams.uvs {
                true => stream(device, &mut uploader, "uvs", meshes, 2, |mesh| bytemuck::cast_slice(&mesh.uvs))?,
                false => None,
            },
            tangents: match streams.tangents {
                true => {
                    stream(device, &mut uploader, "tangents", meshes, 4, |mesh| bytemuck::cast_slice(&mesh.tangents))?
                }
                false => None,
            },
            indices: indices(device, &mut uploader, meshes)?,
            meshes: ranges(meshes),
            materials: Materials::new(device, &mut uploader, scene, world, plan)?,
            volumes: match plan.uploads.volumes {
                true => Some(volumes(device, &mut uploader)?),
                false => None,
            },
        };
        uploader.finish()?;
        Ok(gpu_scene)
    }

    /// Binds the vertex and index buffers of some streams.
    pub fn bind(&self, device: &Device, cmd: vk::CommandBuffer, streams: &[u32]) {
        for &stream in streams {
            let buffer = match stream {
                POSITION => &self.positions,
                NORMAL => &self.normals,
                UV => &self.uvs,
                _ => &self.tangents,
            };
            if let Some(buffer) = buffer {
                // SAFETY: the buffer was created with VERTEX_BUFFER usage and lives as long as this scene, which the frame
                // keeps until its submissions are done.
                unsafe { device.raw.cmd_bind_vertex_buffers(cmd, stream, &[buffer.raw], &[0]) };
            }
        }
        if let Some(indices) = &self.indices {
            // SAFETY: as above, with INDEX_BUFFER usage.
            unsafe { device.raw.cmd_bind_index_buffer(cmd, indices.raw, 0, vk::IndexType::UINT32) };
        }
    }
}

fn ranges(meshes: &[Mesh]) -> Vec<MeshRange> {
    let (mut first_index, mut vertex_offset) = (0, 0);
    meshes
        .iter()
        .map(|mesh| {
            let range = MeshRange { first_index, index_count: mesh.indices.len() as u32, vertex_offset };
            first_index += mesh.indices.len() as u32;
            vertex_offset += mesh.positions.len() as i32;
            range
        })
        .collect()
}

/// One attribute of all meshes, one after the other. A mesh that lacks it gets zeros: its UVs and tangents are only read when
/// its material has textures.
fn stream<'a>(
    device: &Arc<Device>,
    uploader: &mut Uploader,
    name: &str,
    meshes: &'a [Mesh],
    components: u64,
    bytes: impl Fn(&'a Mesh) -> &'a [u8],
) -> gpu::Result<Option<Buffer>> {
    let vertices: u64 = meshes.iter().map(|mesh| mesh.positions.len() as u64).sum();
    if vertices == 0 {
        return Ok(None);
    }
    let usage = vk::BufferUsageFlags::VERTEX_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
    let buffer = Buffer::new(
        device,
        &format!("vertex {name}"),
        vertices * components * 4,
        usage,
        Location::Device,
        MemoryKind::Geometry,
    )?;
    let mut offset = 0;
    for mesh in meshes {
        let data = bytes(mesh);
        let size = mesh.positions.len() as u64 * components * 4;
        if data.is_empty() {
            uploader.buffer(&buffer, offset, &vec![0; size as usize])?;
        } else {
            uploader.buffer(&buffer, offset, data)?;
        }
        offset += size;
    }
    Ok(Some(buffer))
}

fn volumes(device: &Arc<Device>, uploader: &mut Uploader) -> gpu::Result<VolumeMeshes> {
    let (sphere, cone) = (sphere_mesh(), cone_mesh());
    let counts = (sphere.len() as u32, cone.len() as u32);
    let data: Vec<[f32; 3]> = sphere.into_iter().chain(cone).collect();
    let usage = vk::BufferUsageFlags::VERTEX_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
    let size = size_of_val(&data[..]) as u64;
    let corners = Buffer::new(device, "light volumes", size, usage, Location::Device, MemoryKind::Geometry)?;
    uploader.buffer(&corners, 0, bytemuck::cast_slice(&data))?;
    Ok(VolumeMeshes { corners, sphere: counts.0, cone: counts.1 })
}

fn indices(device: &Arc<Device>, uploader: &mut Uploader, meshes: &[Mesh]) -> gpu::Result<Option<Buffer>> {
    let count: u64 = meshes.iter().map(|mesh| mesh.indices.len() as u64).sum();
    if count == 0 {
        return Ok(None);
    }
    let usage = vk::BufferUsageFlags::INDEX_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
    let buffer = Buffer::new(device, "indices", count * 4, usage, Location::Device, MemoryKind::Geometry)?;
    let mut offset = 0;
    for mesh in meshes.iter().filter(|mesh| !mesh.indices.is_empty()) {
        uploader.buffer(&buffer, offset, bytemuck::cast_slice(&mesh.indices))?;
        offset += mesh.indices.len() as u64 * 4;
    }
    Ok(Some(buffer))
}
