//! A scene's buffers, textures and descriptor sets on the device: the parts that the plan needs, and no more.

mod air;
mod culling;
mod deformed;
mod directions;
mod instances;
mod lobes;
mod material;
mod records;
mod seen;
mod shadows;
mod sheets;
mod sky;
mod sorted;
mod source;
mod view;

pub use culling::{CulledState, CullingBuffers};
pub use deformed::{Deformed, PoseBuffer, SkinPush};
pub use instances::Instances;
pub use material::{HOLES, Materials, OWN_SAMPLERS, SAMPLER, SetForm};
pub use records::{FrameUniform, LightRecord};
pub use seen::{LOOK_UP, VisibilityLookup};
pub use shadows::{clear as shadow_clear, *};
pub use sheets::Sheets;
pub use sky::{BASE_EDGE, LOBE_EDGE, LOBE_LEVELS, SKY_READ, SkyMaps, TABLE_EDGE};
pub use sorted::SortedIndices;
pub use source::UploadSource;
pub use view::{ViewBuffers, set_layout as view_set_layout};

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use ash::vk;
use bytemuck::Pod;
use rayon::prelude::*;

use crate::gpu::sync::Use;
use crate::gpu::{self, Buffer, Device, Location, MemoryKind, UploadOrder, Uploader};
use crate::plan::{
    Extras, FramePlan, IndexWidth, MeshPlan, NumberedMesh, PlannedDeform, PlannedLevel, PlannedMesh, effects,
};
use crate::scene::{Mesh, Scene};
use crate::visible::{cone_mesh, sphere_mesh};

/// Fetches a vertex.
pub const VERTEX_READ: Use =
    Use::new(vk::PipelineStageFlags2::VERTEX_ATTRIBUTE_INPUT, vk::AccessFlags2::VERTEX_ATTRIBUTE_READ);
/// Fetches an index.
pub const INDEX_READ: Use = Use::new(vk::PipelineStageFlags2::INDEX_INPUT, vk::AccessFlags2::INDEX_READ);
/// Samples a material's texture, in whichever pass.
pub const TEXTURE_READ: Use = Use::new(vk::PipelineStageFlags2::FRAGMENT_SHADER, vk::AccessFlags2::SHADER_SAMPLED_READ);

/// The place of a mesh in the shared buffers.
#[derive(Debug, Clone, Copy)]
pub struct MeshRange {
    pub first_index: u32,
    pub index_count: u32,
    pub vertex_offset: i32,
    /// The vertex of the mesh with which the first triangle begins, where triangles are numbered.
    pub begin: u32,
    pub width: IndexWidth,
    /// SKIN writes the vertices.
    pub deformed: bool,
}

/// The uploaded scene. Each vertex stream has its own buffer, so that a pass binds only the streams that it reads.
pub struct GpuScene {
    positions: Option<Buffer>,
    normals: Option<Buffer>,
    uvs: Option<Buffer>,
    tangents: Option<Buffer>,
    second_uvs: Option<Buffer>,
    colors: Option<Buffer>,
    indices_16: Option<Buffer>,
    indices_32: Option<Buffer>,
    /// Ranges by mesh of the scene; none for meshes that are not on the device.
    meshes: Vec<Option<MeshRange>>,
    /// Levels of detail by mesh of the scene, for meshes that have any.
    levels: BTreeMap<usize, Vec<PlannedLevel>>,
    /// Vertices by deformed object of the plan.
    deforms: Vec<MeshRange>,
    /// Present if the plan deforms objects.
    pub deformed: Option<Deformed>,
    pub materials: Option<Materials>,
    /// Present if frames have a sky.
    pub sky: Option<SkyMaps>,
    /// Textures that an effect draws with, if one has some.
    pub sheets: Option<Sheets>,
    /// Present if the light path draws lights' volumes.
    pub volumes: Option<VolumeMeshes>,
}

/// The volumes of lights, in one buffer: the sphere's corners, then the cone's.
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
pub const COLOR: u32 = 4;
pub const SECOND_UV: u32 = 5;
/// Position, colour and texture coordinates of a stroke's other end, read from the same streams two vertices further on.
pub const OTHER_END: u32 = 6;
pub const OTHER_COLOR: u32 = 7;
pub const OTHER_UV: u32 = 15;
/// Rows of an instance's map: the first of three locations, or four in shadow maps. The rows are consecutive in one stream.
pub const ROWS: u32 = 8;
/// The last of a map's four.
const ROW_W: u32 = 11;
/// The number of an instance's object.
pub const NUMBER: u32 = 12;
/// The look of an instance: red, green and blue of its tint, then its layer of an atlas and whether it is selected.
pub const LOOK: u32 = 13;
/// The position that a vertex of a deformed mesh had in the pose before.
pub const POSITION_BEFORE: u32 = 14;

/// Format of a stream's only attribute.
pub fn stream_format(stream: u32) -> vk::Format {
    match stream {
        POSITION | NORMAL | POSITION_BEFORE => vk::Format::R32G32B32_SFLOAT,
        UV | SECOND_UV => vk::Format::R32G32_SFLOAT,
        NUMBER => vk::Format::R32_UINT,
        // Every device fetches it (Vulkan, "Required Format Support").
        LOOK => vk::Format::R16G16B16A16_UINT,
        _ => vk::Format::R32G32B32A32_SFLOAT,
    }
}

/// The colours of a mesh; white if the mesh has none.
fn colors(mesh: &Mesh) -> Cow<'_, [[f32; 4]]> {
    match mesh.colors.is_empty() {
        true => vec![[1.0; 4]; mesh.positions.len()].into(),
        false => mesh.colors.as_slice().into(),
    }
}

/// Bytes of a vertex in a stream.
fn stride(stream: u32) -> u32 {
    match stream {
        POSITION | NORMAL | POSITION_BEFORE => 12,
        UV | SECOND_UV => 8,
        NUMBER => 4,
        LOOK => 8,
        _ => 16,
    }
}

/// Vertex input state: a binding for each stream, an attribute for each input of the shader.
pub type VertexInputState = (Vec<vk::VertexInputBindingDescription>, Vec<vk::VertexInputAttributeDescription>);

/// Vertex input state for the inputs of a shader, by their locations. Each input is a stream in its own buffer, except for an instance's rows, which
/// share one. Vulkan requires an attribute for each declared input. Inputs that a mesh lacks (see `extras`), and that the shader's constants leave
/// unread, are read from a stream that exists.
pub fn vertex_input(locations: &[u32], extras: Extras) -> VertexInputState {
    let stream_of = |location| match location {
        OTHER_END => POSITION,
        OTHER_UV => UV,
        OTHER_COLOR if extras.colors => COLOR,
        OTHER_COLOR => POSITION,
        COLOR if !extras.colors => POSITION,
        SECOND_UV if !extras.second_uvs => UV,
        LOOK if !extras.looks => ROWS,
        ROWS..=ROW_W => ROWS,
        own => own,
    };
    let streams: BTreeSet<u32> = locations.iter().map(|&location| stream_of(location)).collect();
    let row = stride(ROWS);
    let binding = |stream| {
        let (stride, input_rate) = match stream {
            ROWS => (
                row * locations.iter().filter(|location| (ROWS..=ROW_W).contains(location)).count() as u32,
                vk::VertexInputRate::INSTANCE,
            ),
            NUMBER | LOOK => (stride(stream), vk::VertexInputRate::INSTANCE),
            vertices => (stride(vertices), vk::VertexInputRate::VERTEX),
        };
        vk::VertexInputBindingDescription::default().binding(stream).stride(stride).input_rate(input_rate)
    };
    let attribute = |&location: &u32| {
        let stream = stream_of(location);
        // An unread attribute still needs its declared type, whatever stream it is read from.
        let format = stream_format(if location == LOOK { LOOK } else { stream });
        let offset = match location {
            ROWS..=ROW_W => (location - ROWS) * row,
            OTHER_END | OTHER_COLOR | OTHER_UV if extras.strokes => 2 * stride(stream),
            _ => 0,
        };
        vk::VertexInputAttributeDescription::default().binding(stream).location(location).format(format).offset(offset)
    };
    (streams.into_iter().map(binding).collect(), locations.iter().map(attribute).collect())
}

impl GpuScene {
    /// Submits the uploads, which `order` puts before all that is submitted later.
    ///
    /// # Errors
    /// When there is no memory for it, or the device is lost.
    pub fn new(
        device: &Arc<Device>,
        source: &mut UploadSource,
        plan: &FramePlan,
        order: UploadOrder,
    ) -> gpu::Result<Self> {
        let scene = source.scene();
        let limit = u64::from(device.physical.limits.max_draw_indexed_index_value);
        for planned in &plan.meshes.meshes {
            let asked = u64::from(planned.vertices).saturating_sub(1);
            if asked > limit {
                return Err(gpu::Error::TooLarge {
                    what: format!("the last index of the mesh '{}'", scene.meshes[planned.mesh].name),
                    asked,
                    limit,
                });
            }
        }
        let mut uploader = Uploader::new(device, 32 << 20, order)?;
        let looked_up = plan.triangles.map_or(vk::BufferUsageFlags::empty(), |_| vk::BufferUsageFlags::STORAGE_BUFFER);
        let numbered = numbered(scene, &plan.meshes);
        let mut meshes =
            MeshUpload { device, uploader: &mut uploader, scene, plan: &plan.meshes, numbered: &numbered, looked_up };
        let ranges = meshes.ranges();
        let deform_range = |deform: &PlannedDeform| {
            let vertex_offset = deform.first_vertex as i32;
            ranges[deform.mesh].map(|range| MeshRange { vertex_offset, deformed: true, ..range })
        };
        let deforms = plan.meshes.deforms.meshes.iter().filter_map(deform_range).collect();
        let mut gpu_scene = Self {
            positions: meshes.stream("positions", plan.meshes.vertices, |mesh| mesh.positions.as_slice().into())?,
            normals: meshes.stream("normals", plan.meshes.normals, directions::normals)?,
            uvs: meshes.stream("uvs", plan.meshes.uvs, |mesh| mesh.uvs.as_slice().into())?,
            tangents: meshes.stream("tangents", plan.meshes.tangents, directions::tangents)?,
            second_uvs: meshes.stream("second uvs", plan.meshes.second_uvs, |mesh| mesh.uvs_1.as_slice().into())?,
            colors: meshes.stream("colours", plan.meshes.colors, colors)?,
            indices_16: meshes.indices(IndexWidth::Bits16, plan.meshes.indices_16)?,
            indices_32: meshes.indices(IndexWidth::Bits32, plan.meshes.indices_32)?,
            meshes: ranges,
            levels: levels_of(&plan.meshes),
            deforms,
            deformed: match plan.deforms() {
                true => Some(Deformed::new(device, &mut uploader, scene, &plan.meshes.deforms)?),
                false => None,
            },
            materials: None,
            sky: match (&scene.sky, &plan.effects.sky) {
                (Some(sky), Some(planned)) => Some(SkyMaps::new(device, &mut uploader, sky, planned)?),
                _ => None,
            },
            sheets: Sheets::new(device, &mut uploader, scene, effects::textures(plan))?,
            volumes: match plan.uploads.volumes {
                true => Some(volumes(device, &mut uploader)?),
                false => None,
            },
        };
        drop(numbered);
        // Textures come last and are most of the bytes: each goes when it has been staged, and all else has gone before.
        source.forget_all_but_textures();
        gpu_scene.materials = Materials::new(device, &mut uploader, source, plan)?;
        source.forget_textures();
        uploader.finish()?;
        Ok(gpu_scene)
    }

    /// A mesh of the scene that the plan has on the device, or the vertices of a deformed object with its indices.
    pub fn mesh(&self, mesh: usize, deform: Option<usize>) -> Option<MeshRange> {
        match deform {
            Some(deform) => self.deforms.get(deform).copied(),
            None => self.meshes.get(mesh).copied().flatten(),
        }
    }

    /// Variant of [`Self::mesh`] for one level of detail of a mesh; level 0 is the mesh itself.
    pub fn level(&self, mesh: usize, deform: Option<usize>, level: u8) -> Option<MeshRange> {
        let range = self.mesh(mesh, deform)?;
        let Some(level) = usize::from(level).checked_sub(1) else { return Some(range) };
        let &PlannedLevel { first_index, index_count, begin, .. } = self.levels.get(&mesh)?.get(level)?;
        Some(MeshRange { first_index, index_count, begin, ..range })
    }

    /// Binds the vertex buffers of some streams, of the scene or of deformed objects.
    pub fn bind(&self, device: &Device, cmd: vk::CommandBuffer, streams: &[u32], deformed: bool) {
        for &stream in streams {
            if let Some(own) = self.deformed.as_ref().filter(|_| deformed) {
                if let Some(start) = own.start(stream) {
                    // SAFETY: as below; the stream begins within the buffer.
                    unsafe { device.raw.cmd_bind_vertex_buffers(cmd, stream, &[own.vertices.raw], &[start]) };
                }
                continue;
            }
            let buffer = match stream {
                POSITION => &self.positions,
                NORMAL => &self.normals,
                UV => &self.uvs,
                SECOND_UV => &self.second_uvs,
                COLOR => &self.colors,
                _ => &self.tangents,
            };
            if let Some(buffer) = buffer {
                // SAFETY: the buffer was created with VERTEX_BUFFER usage and lives as long as this scene, which the frame
                // keeps until its submissions are done.
                unsafe { device.raw.cmd_bind_vertex_buffers(cmd, stream, &[buffer.raw], &[0]) };
            }
        }
    }

    /// Binds the index buffer of a width.
    pub fn bind_indices(&self, device: &Device, cmd: vk::CommandBuffer, width: IndexWidth) {
        let indices = match width {
            IndexWidth::Bits16 => &self.indices_16,
            IndexWidth::Bits32 => &self.indices_32,
        };
        if let Some(indices) = indices {
            // SAFETY: as above, with INDEX_BUFFER usage.
            unsafe { device.raw.cmd_bind_index_buffer(cmd, indices.raw, 0, index_type(width)) };
        }
    }
}

/// Levels of detail by mesh of the scene, for meshes that have any.
fn levels_of(plan: &MeshPlan) -> BTreeMap<usize, Vec<PlannedLevel>> {
    let leveled = plan.meshes.iter().filter(|mesh| !mesh.levels.is_empty());
    leveled.map(|mesh| (mesh.mesh, mesh.levels.clone())).collect()
}

/// The meshes of a plan as stored on the device, if their triangles are numbered; none otherwise.
fn numbered(scene: &Scene, plan: &MeshPlan) -> Vec<NumberedMesh> {
    let own = |planned: &PlannedMesh| NumberedMesh::of(&scene.meshes[planned.mesh], planned.levels.len());
    if plan.numbered { plan.meshes.par_iter().map(own).collect() } else { Vec::new() }
}

/// Vulkan's name of a width.
pub fn index_type(width: IndexWidth) -> vk::IndexType {
    match width {
        IndexWidth::Bits16 => vk::IndexType::UINT16,
        IndexWidth::Bits32 => vk::IndexType::UINT32,
    }
}

/// Uploads the meshes as the plan has them.
struct MeshUpload<'a> {
    device: &'a Arc<Device>,
    uploader: &'a mut Uploader,
    scene: &'a Scene,
    plan: &'a MeshPlan,
    /// Meshes in the plan's order; empty if triangles are not numbered.
    numbered: &'a [NumberedMesh],
    /// Extra buffer usage besides drawing.
    looked_up: vk::BufferUsageFlags,
}

impl<'a> MeshUpload<'a> {
    fn ranges(&self) -> Vec<Option<MeshRange>> {
        let mut ranges = vec![None; self.scene.meshes.len()];
        for mesh in &self.plan.meshes {
            let &PlannedMesh { first_index, index_count, width, first_vertex, .. } = mesh;
            let vertex_offset = first_vertex.unwrap_or(0) as i32;
            let range = MeshRange { first_index, index_count, vertex_offset, begin: 0, width, deformed: false };
            ranges[mesh.mesh] = Some(range);
        }
        ranges
    }

    /// The first `vertices` of an attribute, of one mesh after the other. A mesh that lacks it has zeros there: it is read only of meshes
    /// whose materials have textures, and where a part is kept without need.
    fn stream<T: Pod>(
        &mut self,
        name: &str,
        vertices: u64,
        data: impl Fn(&'a Mesh) -> Cow<'a, [T]>,
    ) -> gpu::Result<Option<Buffer>> {
        let stride = size_of::<T>() as u64;
        let usage = vk::BufferUsageFlags::VERTEX_BUFFER | self.looked_up;
        let Some(buffer) = self.buffer(&format!("vertex {name}"), vertices * stride, usage)? else { return Ok(None) };
        for (place, planned) in self.plan.meshes.iter().enumerate() {
            let Some(first) = planned.first_vertex.map(u64::from).filter(|&first| first < vertices) else { continue };
            let offset = first * stride;
            let own = data(&self.scene.meshes[planned.mesh]);
            let turned: Vec<T>;
            let own = match self.numbered.get(place) {
                Some(numbered) if !own.is_empty() => {
                    turned = numbered.sources.iter().map(|&source| own[source as usize]).collect();
                    &turned
                }
                _ => &*own,
            };
            match own {
                [] => self.uploader.buffer(&buffer, offset, &vec![0; planned.vertices as usize * stride as usize])?,
                some => self.uploader.buffer(&buffer, offset, bytemuck::cast_slice(some))?,
            }
        }
        Ok(Some(buffer))
    }

    fn indices(&mut self, width: IndexWidth, count: u64) -> gpu::Result<Option<Buffer>> {
        let name = match width {
            IndexWidth::Bits16 => "indices of 16 bits",
            IndexWidth::Bits32 => "indices of 32 bits",
        };
        let usage = vk::BufferUsageFlags::INDEX_BUFFER | self.looked_up;
        // Shaders read whole words.
        let Some(buffer) = self.buffer(name, (count * width.bytes()).next_multiple_of(4), usage)? else {
            return Ok(None);
        };
        for (place, planned) in self.plan.meshes.iter().enumerate().filter(|(_, mesh)| mesh.width == width) {
            let mesh = &self.scene.meshes[planned.mesh];
            if let Some(numbered) = self.numbered.get(place) {
                self.index_range(&buffer, (width, planned.first_index), &numbered.indices)?;
                for (own, level) in planned.levels.iter().zip(&numbered.levels) {
                    self.index_range(&buffer, (width, own.first_index), &level.indices)?;
                }
                continue;
            }
            self.index_range(&buffer, (width, planned.first_index), &mesh.indices)?;
            if !planned.levels.is_empty() {
                for (own, level) in planned.levels.iter().zip(mesh.levels_of_detail().iter()) {
                    self.index_range(&buffer, (width, own.first_index), &level.indices)?;
                }
            }
        }
        Ok(Some(buffer))
    }

    fn index_range(&mut self, buffer: &Buffer, (width, first): (IndexWidth, u32), indices: &[u32]) -> gpu::Result<()> {
        let offset = u64::from(first) * width.bytes();
        match width {
            IndexWidth::Bits16 => {
                // The plan chose 16 bits because the mesh has no vertex of a higher number.
                let short: Vec<u16> = indices.iter().map(|&index| index as u16).collect();
                self.uploader.buffer(buffer, offset, bytemuck::cast_slice(&short))
            }
            IndexWidth::Bits32 => self.uploader.buffer(buffer, offset, bytemuck::cast_slice(indices)),
        }
    }

    /// Makes a buffer; none for 0 bytes.
    fn buffer(&self, name: &str, bytes: u64, usage: vk::BufferUsageFlags) -> gpu::Result<Option<Buffer>> {
        let usage = usage | vk::BufferUsageFlags::TRANSFER_DST;
        let new = || Buffer::new(self.device, name, bytes, usage, Location::Device, MemoryKind::Geometry);
        (bytes > 0).then(new).transpose()
    }
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
