// What every pass of a frame knows. World positions are relative to the camera: its place in the world is subtracted in
// f64 before anything becomes f32.
#define_import_path afterlight::frame

struct Frame {
    // Camera-relative world to clip space. Reversed Z: depth is near / distance, 0 at infinity.
    clip_from_world: mat4x4<f32>,
    // The ray through a pixel is ray_center + x ray_x + y ray_y for x, y in -1..1 (y down); its length along the view axis is 1.
    ray_center: vec3<f32>,
    near: f32,
    ray_x: vec3<f32>,
    // From nits to what is stored and tone-mapped.
    exposure: f32,
    ray_y: vec3<f32>,
    // 2 / width and 2 / height.
    pixel_width: f32,
    // Radiance from everywhere: the mean of sky and ground.
    ambient: vec3<f32>,
    pixel_height: f32,
    // Half of what the sky has more than the ground.
    ambient_tilt: vec3<f32>,
    // How far a shadow lookup moves along the geometric normal, in texels of the map at that place.
    shadow_normal_offset: f32,
    // Edge of a layer of maps in texels.
    shadow_size: f32,
    // Lights are sorted: the first `directional_count` are directional.
    directional_count: u32,
    light_count: u32,
    // The first so many lights meet every pixel in a loop; the light path deals with the others.
    looped_count: u32,
    // Where the camera looks to, a unit vector.
    forward: vec3<f32>,
    // The first so many reach everywhere; the froxels have lists of the others.
    global_count: u32,
    // Froxels across and down.
    cluster_columns: u32,
    cluster_rows: u32,
    // Layers of shadow maps, and how many maps there are.
    shadow_layers: u32,
    shadow_view_count: u32,
    // The camera relative to the centre of the scene, and the scene's radius: for the views.
    camera_in_scene: vec3<f32>,
    scene_radius: f32,
}

@group(0) @binding(0) var<uniform> frame: Frame;

// The ray through the centre of a pixel, one metre long along the view axis.
fn view_ray(pixel: vec2<f32>) -> vec3<f32> {
    let x = pixel.x * frame.pixel_width - 1.0;
    let y = pixel.y * frame.pixel_height - 1.0;
    return frame.ray_center + frame.ray_x * x + frame.ray_y * y;
}

// Where a depth lies, relative to the camera, in metres. Reversed Z with an infinite far plane: depth = near / distance along the view axis.
fn position_at(pixel: vec2<f32>, depth: f32) -> vec3<f32> {
    return view_ray(pixel) * (frame.near / depth);
}
