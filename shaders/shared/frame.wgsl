// The data of a frame that every pass has. World positions are relative to the camera: its place in the world is subtracted in f64 before anything
// becomes f32.
#define_import_path afterlight::frame
#import afterlight::air::{Air}

struct Frame {
    // Camera-relative world to clip space. Reversed Z: depth is near / distance, 0 at infinity; orthographic, it falls from 1 at `near` to 0 by
    // the distance.
    clip_from_world: mat4x4<f32>,
    // The ray through a pixel is ray_center + x ray_x + y ray_y for x, y in -1..1 (y down); its length along the view axis is 1. Orthographic, this
    // is where it begins, and all rays go forward.
    ray_center: vec3<f32>,
    near: f32,
    ray_x: vec3<f32>,
    // Factor from nits to the unit in which light is stored and tone-mapped.
    exposure: f32,
    ray_y: vec3<f32>,
    // 2 / width and 2 / height.
    pixel_width: f32,
    // Radiance from everywhere: the mean of sky and ground.
    ambient: vec3<f32>,
    pixel_height: f32,
    // Half of the sky's excess over the ground.
    ambient_tilt: vec3<f32>,
    // The distance by which a shadow lookup moves along the geometric normal, in texels of the map at that place.
    shadow_normal_offset: f32,
    // Edge of a layer of maps in texels.
    shadow_size: f32,
    // Lights are sorted: the first `directional_count` are directional.
    directional_count: u32,
    light_count: u32,
    // The number of lights, from the first, that meet every pixel in a loop; the light path deals with the others.
    looped_count: u32,
    // The direction of the camera's view, a unit vector.
    forward: vec3<f32>,
    // The number of lights, from the first, that reach everywhere; the froxels have lists of the others.
    global_count: u32,
    // Froxels across and down.
    cluster_columns: u32,
    cluster_rows: u32,
    // The numbers of layers of shadow maps, and of maps.
    shadow_layers: u32,
    shadow_view_count: u32,
    // The camera relative to the centre of the scene, and the scene's radius: for the views.
    camera_in_scene: vec3<f32>,
    scene_radius: f32,
    // Metres along the view from an orthographic depth of 1 to one of 0.
    depth_range: f32,
    // The distance of the eye before an orthographic camera, in metres along the view: for the views.
    eye_ahead: f32,
    // Cosine and sine of the angle that takes directions of the world to the sky's own, about +Y.
    sky_turn: vec2<f32>,
    // Towards the sun that is drawn into the sky.
    sun_direction: vec3<f32>,
    // Factor from the sky's texels to nits.
    sky_scale: f32,
    // Radiance of the sun's disc, in nits.
    sun_radiance: vec3<f32>,
    // The sine of the disc's angular radius.
    sun_sine: f32,
    // The place in each pixel that this frame looks through, in pixels from its centre: random numbers differ by it.
    jitter: vec2<f32>,
    air: Air,
}

// The camera's rays are parallel.
override ORTHOGRAPHIC: bool = false;

@group(0) @binding(0) var<uniform> frame: Frame;

// A place of the picture, where w is 1.
fn across(pixel: vec2<f32>) -> vec3<f32> {
    let x = pixel.x * frame.pixel_width - 1.0;
    let y = pixel.y * frame.pixel_height - 1.0;
    return frame.ray_center + frame.ray_x * x + frame.ray_y * y;
}

// The direction of the ray through the centre of a pixel, one metre long along the view axis.
fn view_ray(pixel: vec2<f32>) -> vec3<f32> {
    if ORTHOGRAPHIC {
        return frame.forward;
    }
    return across(pixel);
}

// Turns a direction of the world into the sky's own.
fn to_sky(direction: vec3<f32>) -> vec3<f32> {
    let turn = frame.sky_turn;
    return vec3(direction.x * turn.x - direction.z * turn.y, direction.y, direction.x * turn.y + direction.z * turn.x);
}

// ANCHOR: place-of-a-pixel
// The distance along the view axis at a depth, in metres. A perspective camera has no far plane: depth = near / distance.
fn distance_at(depth: f32) -> f32 {
    if ORTHOGRAPHIC {
        return frame.near + (1.0 - depth) * frame.depth_range;
    }
    return frame.near / depth;
}

// The depth at a distance along the view axis.
fn depth_at(distance: f32) -> f32 {
    if ORTHOGRAPHIC {
        return 1.0 - (distance - frame.near) / frame.depth_range;
    }
    return frame.near / distance;
}

// The place at a depth, relative to the camera, in metres.
fn position_at(pixel: vec2<f32>, depth: f32) -> vec3<f32> {
    return place_at(pixel, distance_at(depth));
}

// The place at a distance along the view axis.
fn place_at(pixel: vec2<f32>, distance: f32) -> vec3<f32> {
    if ORTHOGRAPHIC {
        return across(pixel) + frame.forward * distance;
    }
    return across(pixel) * distance;
// ANCHOR_END: place-of-a-pixel
}
