// The weight of a layer where layers are summed in any order (McGuire and Bavoil 2013); forward.wgsl says why no sum overflows or is lost.
#define_import_path afterlight::weights
#import afterlight::frame::{frame}

// Near surfaces count for more than far ones, as they would if they were sorted; a layer brighter than `peak` / `weight` counts for less, and alone
// on its pixel still has its own colour.
// ANCHOR: weight-of
fn weight_of(color: vec3<f32>, position: vec3<f32>, weight: f32, least: f32, peak: f32) -> f32 {
    let nearness = frame.scene_radius / (frame.scene_radius + length(position));
    let cubed = nearness * nearness * nearness;
    let brightest = max(max(color.r, color.g), max(color.b, 1.0));
    return min(max(cubed * cubed, least) * weight, peak / brightest);
}
// ANCHOR_END: weight-of
