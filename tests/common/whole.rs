//! Checks that a file is whole, by its kind.

pub fn is_picture(bytes: &[u8]) -> bool {
    image::load_from_memory(bytes).is_ok()
}

pub fn is_json(bytes: &[u8]) -> bool {
    serde_json::from_slice::<serde_json::Value>(bytes).is_ok()
}

pub fn is_json_lines(bytes: &[u8]) -> bool {
    bytes.ends_with(b"\n") && bytes[..bytes.len() - 1].split(|byte| *byte == b'\n').all(is_json)
}

pub fn is_document(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    text.trim_end().ends_with("</svg>") || text.trim_end().ends_with("</html>")
}

pub fn is_xml(bytes: &[u8]) -> bool {
    std::str::from_utf8(bytes).is_ok_and(|text| roxmltree::Document::parse(text).is_ok())
}

/// Settings as `tune` writes them.
pub fn is_toml(bytes: &[u8]) -> bool {
    std::str::from_utf8(bytes).is_ok_and(|text| text.contains("[settings]") && text.parse::<toml::Table>().is_ok())
}

/// Results as `ci` writes them.
pub fn is_csv(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    text.ends_with('\n') && text.lines().all(|line| line.split(',').count() == 3)
}

/// A binary glTF with as many bytes as its header says, and a whole document in it.
pub fn is_glb(bytes: &[u8]) -> bool {
    let number = |at: usize| bytes.get(at..at + 4).map(|four| u32::from_le_bytes([four[0], four[1], four[2], four[3]]));
    let json = number(12).and_then(|length| bytes.get(20..20 + length as usize));
    bytes.starts_with(b"glTF") && number(8) == u32::try_from(bytes.len()).ok() && json.is_some_and(is_json)
}

/// Figures of a device, under their checksum.
pub fn is_calibration(bytes: &[u8]) -> bool {
    afterlight::gpu::decode_device_file(bytes.to_vec()).is_some_and(|figures| is_json(&figures))
}
