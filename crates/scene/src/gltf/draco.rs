//! KHR_draco_mesh_compression.

use std::panic::{AssertUnwindSafe, catch_unwind};

use draco_core::{DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};

/// The most that one primitive may become. Draco spends next to nothing on equal values, so that the size of its data says nothing.
const MOST_POINTS: u64 = 1 << 26;
const MOST_BYTES: u64 = 1 << 30;

/// Decompresses a primitive.
pub(super) fn decode(bytes: &[u8]) -> Result<Mesh, String> {
    // The decoder checks its input; it is young, and a slip of it must not take the program along.
    let decoded = catch_unwind(AssertUnwindSafe(|| decode_checked(bytes)));
    let mesh = decoded.unwrap_or_else(|_| Err("the decoder failed".into()));
    mesh.map_err(|why| format!("its Draco data cannot be decompressed: {why}"))
}

/// Decodes by the decoder's own checks alone, without a guard against panics.
pub(super) fn decode_checked(bytes: &[u8]) -> Result<Mesh, String> {
    let limits = DecodeLimits::default();
    let limits = limits.with_max_points(MOST_POINTS).with_max_faces(MOST_POINTS).with_max_decoded_bytes(MOST_BYTES);
    let mut mesh = Mesh::new();
    let decoded = MeshDecoder::new().decode(&mut DecoderBuffer::new(bytes).with_limits(limits), &mut mesh);
    decoded.map(|()| mesh).map_err(|error| error.to_string().replace(['\n', '\r'], " "))
}

/// Corners of its triangles.
pub(super) fn indices(mesh: &Mesh) -> Vec<u32> {
    mesh.faces().iter().flat_map(|face| face.map(|point| point.0)).collect()
}

/// Numbers of an attribute by its id, for each point, as they are stored.
pub(super) struct DracoAttribute {
    pub numbers: Vec<f32>,
    /// Numbers of an element.
    pub width: usize,
    /// The largest number of its type, if that is of whole numbers.
    pub largest: Option<f32>,
}

/// Returns an attribute by its id.
pub(super) fn read_attribute(mesh: &Mesh, id: usize) -> Result<DracoAttribute, String> {
    let attribute = u32::try_from(id).ok().and_then(|id| mesh.attribute_by_unique_id(id));
    let attribute = attribute.ok_or_else(|| format!("its Draco data has no attribute {id}"))?;
    let width = usize::from(attribute.num_components());
    let largest = match attribute.data_type() {
        DataType::Int8 => Some(127.0),
        DataType::Uint8 => Some(255.0),
        DataType::Int16 => Some(32767.0),
        DataType::Uint16 => Some(65535.0),
        _ => None,
    };
    Ok(DracoAttribute { numbers: attribute.read_f32s(mesh.num_points(), width), width, largest })
}

/// Returns an attribute of this many numbers an element.
pub(super) fn of_width(mesh: &Mesh, id: usize, width: usize) -> Result<DracoAttribute, String> {
    let own = read_attribute(mesh, id)?;
    match own.width == width {
        true => Ok(own),
        false => Err(format!(
            "attribute {id} of its Draco data has {} numbers an element, but its accessor {width}",
            own.width
        )),
    }
}
