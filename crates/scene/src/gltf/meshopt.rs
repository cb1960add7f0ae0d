//! EXT_meshopt_compression, and KHR_meshopt_compression, which has one filter and one version of a codec more.

use meshoptimizer_rs::codec::{
    decode_filter_color, decode_filter_exp, decode_filter_oct, decode_filter_quat, decode_index_buffer,
    decode_index_sequence, decode_vertex_buffer,
};
use meshoptimizer_rs::{Error, Workspace};

use super::json_extensions::Meshopt;

/// The most bytes that a compressed one can stand for: version 1 spends two bits on the 256 equal bytes of a block.
const MOST_OF_ONE: usize = 1024;

/// Decompresses a view.
pub(super) fn decode(packed: &Meshopt, source: &[u8]) -> Result<Vec<u8>, String> {
    let (count, stride) = (packed.count.0, packed.byte_stride.0);
    let most = source.len().saturating_mul(MOST_OF_ONE);
    if count.checked_mul(stride).is_none_or(|bytes| bytes > most) {
        return Err(format!("its {} compressed bytes cannot hold {count} elements of {stride} bytes", source.len()));
    }
    let mut workspace = Workspace::default();
    let decoded = match packed.mode.as_str() {
        "ATTRIBUTES" => decode_vertex_buffer(count, stride, source, &mut workspace),
        "TRIANGLES" => decode_index_buffer(count, stride, source, &mut workspace),
        "INDICES" => decode_index_sequence(count, stride, source, &mut workspace),
        mode => return Err(format!("is compressed by the unknown mode `{}`", mode.escape_debug())),
    };
    let failed = |what: &str, error: Error| format!("its {what} cannot be decompressed: {error}");
    let mut bytes = decoded.map_err(|error| failed("data", error))?;
    let filter = match packed.filter.as_deref().unwrap_or("NONE") {
        "NONE" => return Ok(bytes),
        _ if packed.mode != "ATTRIBUTES" => return Err("has a filter, which is for attributes only".into()),
        "OCTAHEDRAL" => decode_filter_oct,
        "QUATERNION" => decode_filter_quat,
        "EXPONENTIAL" => decode_filter_exp,
        "COLOR" => decode_filter_color,
        other => return Err(format!("has the unknown filter `{}`", other.escape_debug())),
    };
    filter(&mut bytes, count, stride, &mut workspace).map_err(|error| failed("filter", error))?;
    Ok(bytes)
}
