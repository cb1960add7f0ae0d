// The places of the samples of a pixel.
#define_import_path afterlight::multisampling

// Offset of a sample from the pixel's centre, in pixels: "Standard sample locations" of the Vulkan specification, for 2, 4 and 8 samples. The mean of
// the samples is the centre.
fn sample_offset(sample: u32, count: u32) -> vec2<f32> {
    var sixteenths = array(
        vec2(4.0, 4.0), vec2(-4.0, -4.0),
        vec2(-2.0, -6.0), vec2(6.0, -2.0), vec2(-6.0, 2.0), vec2(2.0, 6.0),
        vec2(1.0, -3.0), vec2(-1.0, 3.0), vec2(5.0, 1.0), vec2(-3.0, -5.0),
        vec2(-5.0, 5.0), vec2(-7.0, -1.0), vec2(3.0, 7.0), vec2(7.0, -7.0),
    );
    return sixteenths[count - 2u + sample] / 16.0;
}
