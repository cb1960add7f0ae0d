//! The light path `visibility`: the values that are stored of a pixel, and the lookups that the device must be capable of.

use std::collections::BTreeSet;

use super::{Capabilities, MeshPlan, PlanError, SurfaceRules, TexturePlan, effects};
use crate::scene::{Culling, GbufferChoice, Mesh, Sampler, Scene, Settings};

/// The code of 32 bits for the triangle that a pixel shows: in the low bits its number in its mesh or level of detail, above them the place of its instance in
/// the frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TriangleCode {
    /// The low bits.
    pub bits: u32,
}

/// Buffers that TILED names: the lights, their spheres, and the buffers of `shaders/shared/seen.wgsl`.
const BUFFERS: u32 = 15;
/// Images beside the textures: depth, the triangles, and the shadow maps.
const IMAGES: u32 = 3;
/// Samplers that every device's shaders can name.
const SAMPLERS: usize = 16;
/// Bytes of a vertex in the widest stream.
const WIDEST: u64 = 16;

/// The reason why `auto` does not choose the path where it would choose `compute`. Everything that [`choose`] refuses has a reason here.
pub(super) fn is_out(scene: &Scene, settings: &Settings, device: &Capabilities) -> Option<&'static str> {
    let atlases = scene.materials.iter().map(|material| material.atlas);
    let atlases: BTreeSet<[u32; 2]> = atlases.chain([[1, 1]]).collect();
    let sheets =
        |&[rows, columns]: &[u32; 2]| u64::from((rows * columns).div_ceil(device.max_layers.clamp(1, 1 << 15)));
    // Each texture in each way, and the neutral ones.
    let images = (scene.textures.len() as u64 + 2) * atlases.iter().map(sheets).sum::<u64>();
    let samplers: BTreeSet<Sampler> = scene.textures.iter().map(|texture| texture.sampler).collect();
    let triangles = |mesh: &Mesh| mesh.indices.len() as u64 / 3;
    let largest = scene.meshes.iter().map(triangles).max().unwrap_or(0);
    let bits = bits_of(largest.saturating_sub(1)) + bits_of((2 * scene.objects.len() as u64).saturating_sub(1));
    // At most: a level of detail has up to .8 of the triangles of the one before, and no triangle begins with a vertex of another.
    let times = if settings.lod > 0.0 { 5 } else { 1 };
    let vertices: u64 = scene.meshes.iter().map(|mesh| mesh.positions.len() as u64 + times * triangles(mesh)).sum();
    let indices: u64 = scene.meshes.iter().map(|mesh| times * mesh.indices.len() as u64).sum();
    let limits = [
        (
            !scene.textures.is_empty() && device.non_uniform_textures == 0,
            "the device's shaders cannot index textures (non-uniform indexing)",
        ),
        (
            !scene.textures.is_empty() && images + u64::from(IMAGES) > u64::from(device.non_uniform_textures),
            "the device's shaders cannot index so many textures (non-uniform indexing)",
        ),
        // Neutral textures add the default sampler, hence `>=`.
        (samplers.len() >= SAMPLERS, "textures are sampled in too many ways"),
        (BUFFERS > device.storage_buffers, "the device's shaders can name too few buffers"),
        (
            (WIDEST * vertices).max(4 * indices) > u64::from(device.storage_range),
            "a buffer of the scene is larger than the device's shaders can address",
        ),
        (scene.objects.iter().any(|object| scene.deforms(object)), "some meshes are deformed"),
        (has_strokes(scene), "some meshes are points and lines"),
        (bits > u32::BITS, "triangle and instance numbers do not fit into 32 bits"),
        (settings.culling == Culling::Gpu, "culling on the device is asked for"),
        (device.numbered_msaa & settings.msaa == 0, "the device reads no textures of so many samples of integers"),
        (
            scene.objects.len() >= device.costs.of_pictures(device.software).culling.many_objects(),
            "the device may cull this many objects, which visibility rules out",
        ),
    ];
    let reads_gbuffer = || effects::asked_for(scene, settings).find_map(|effect| effect.reads_gbuffer);
    let laid_out = || (settings.gbuffer != GbufferChoice::default()).then_some("a G-buffer layout is asked for");
    limits.into_iter().find_map(|(out, why)| out.then_some(why)).or_else(reads_gbuffer).or_else(laid_out)
}

fn has_strokes(scene: &Scene) -> bool {
    scene.objects.iter().any(|object| scene.meshes.get(object.mesh).is_some_and(|mesh| mesh.is_strokes))
}

fn bits_of(largest: u64) -> u32 {
    u64::BITS - largest.leading_zeros()
}

/// Returns the layout of triangle codes.
///
/// # Errors
/// When the device's shaders cannot look up surfaces, or the scene exceeds a limit.
pub(super) fn choose(
    scene: &Scene,
    rules: &SurfaceRules,
    (meshes, textures): (&MeshPlan, &TexturePlan),
    device: &Capabilities,
) -> Result<TriangleCode, PlanError> {
    let refuse = |why: String| Err(PlanError::Visibility(why));
    let images = textures.images.iter().map(|image| u64::from(image.sheets(textures.sheet))).sum::<u64>();
    if images > 0 && device.non_uniform_textures == 0 {
        return refuse(
            "shaders of this device cannot index textures (non-uniform indexing, VK_EXT_descriptor_indexing)".into(),
        );
    }
    if images > 0 && images + u64::from(IMAGES) > u64::from(device.non_uniform_textures) {
        let most = device.non_uniform_textures.saturating_sub(IMAGES);
        return refuse(format!(
            "a shader would index {images} textures, and on this device it can index {most} (non-uniform indexing)"
        ));
    }
    let samplers: BTreeSet<Sampler> = textures.images.iter().map(|image| image.sampler).collect();
    if samplers.len() > SAMPLERS {
        return refuse(format!(
            "textures are sampled in {} ways, and a shader names at most {SAMPLERS}",
            samplers.len()
        ));
    }
    let longest = [
        12 * meshes.vertices.max(meshes.normals),
        8 * meshes.uvs.max(meshes.second_uvs),
        WIDEST * meshes.tangents.max(meshes.colors),
        meshes.index_bytes(),
    ];
    let longest = longest.into_iter().max().unwrap_or(0);
    if longest > u64::from(device.storage_range) {
        let most = device.storage_range;
        return refuse(format!(
            "a shader looks into a buffer of {longest} bytes, and on this device sees at most {most}"
        ));
    }
    if BUFFERS > device.storage_buffers {
        return refuse(format!(
            "a shader names {BUFFERS} buffers, and on this device at most {}",
            device.storage_buffers
        ));
    }
    if !meshes.deforms.objects.is_empty() {
        return refuse("some meshes are deformed, and a pixel's triangle is looked up at rest".into());
    }
    if has_strokes(scene) {
        return refuse("some meshes are points and lines, whose triangles have no area to look a pixel up in".into());
    }
    // Twice: once more after a depth pre-pass.
    let instances = 2 * rules.drawn(scene).count() as u64;
    let triangles = meshes.meshes.iter().map(|mesh| u64::from(mesh.index_count / 3)).max().unwrap_or(0);
    let bits = bits_of(triangles.saturating_sub(1));
    let needed = bits + bits_of(instances.saturating_sub(1));
    if needed > u32::BITS {
        return refuse(format!(
            "{triangles} triangles of a mesh and {} objects are numbered by {needed} bits, and a pixel has 32",
            instances / 2
        ));
    }
    Ok(TriangleCode { bits })
}
