// Tiles of the picture, and the lights that may reach one.
#define_import_path afterlight::tile
#import afterlight::frame::{across, frame, ORTHOGRAPHIC}

// Edge of a tile in pixels.
const TILE: u32 = 16u; // host

// The volume of a tile: planes through the eye, or beside it where rays are parallel, their normals pointing inside; and an interval of distances
// along the view.
struct Tile {
    left: vec4<f32>,
    right: vec4<f32>,
    top: vec4<f32>,
    bottom: vec4<f32>,
    begin: f32,
    end: f32,
}

fn tile_of(corner: vec2<f32>) -> Tile {
    // Steps of a tile, from the axes: the difference of two rays would cancel where the field of view is narrow.
    let right = frame.ray_x * (f32(TILE) * frame.pixel_width);
    let down = frame.ray_y * (f32(TILE) * frame.pixel_height);
    let first = across(corner);
    let last = across(corner + f32(TILE));
    var tile: Tile;
    if ORTHOGRAPHIC {
        tile.left = beside(first, right);
        tile.right = beside(last, -right);
        tile.top = beside(first, down);
        tile.bottom = beside(last, -down);
    } else {
        tile.left = inward(cross(first, down), right);
        tile.right = inward(cross(last, down), -right);
        tile.top = inward(cross(first, right), down);
        tile.bottom = inward(cross(last, right), -down);
    }
    return tile;
}

// A plane through the eye. Whichever way the axes turn, `towards` leads inside.
fn inward(normal: vec3<f32>, towards: vec3<f32>) -> vec4<f32> {
    return vec4(normalize(normal) * select(-1.0, 1.0, dot(normal, towards) >= 0.0), 0.0);
}

// A plane through a place, along the view.
fn beside(place: vec3<f32>, towards: vec3<f32>) -> vec4<f32> {
    let normal = normalize(towards);
    return vec4(normal, -dot(normal, place));
}

fn touches(tile: Tile, sphere: vec4<f32>) -> bool {
    let p = vec4(sphere.xyz, 1.0);
    let along = dot(sphere.xyz, frame.forward);
    let side = min(min(dot(tile.left, p), dot(tile.right, p)), min(dot(tile.top, p), dot(tile.bottom, p)));
    return side > -sphere.w && along + sphere.w > tile.begin && along - sphere.w < tile.end;
}
