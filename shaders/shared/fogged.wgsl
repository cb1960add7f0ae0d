// The air before a surface or particle that is blended over a fogged picture.
#define_import_path afterlight::fogged
#import afterlight::frame::{frame, ORTHOGRAPHIC}
#import afterlight::fog::{endless_fog_depth, fog_depth, fog_light, fog_transmittance, FogRay}

// True if the frame has fog and this pipeline draws things that are seen through it. FOG covers opaque surfaces alone.
override FOG: bool = false;

#ifdef LIGHTS
#ifndef UNIFORM_BUFFER
#import afterlight::froxels::{froxel_light}

// The fog has lamps and shadows in it. A variant would double the number of all shaders that light what they draw, so this is a constant. If there
// are no froxels, their binding names the lights, and nothing reads it.
override FROXELS: bool = false;
#endif
#endif

// Fogs a layer at a place relative to the camera; the layer's colour is premultiplied by alpha. The surface behind it is fogged as if the layer did
// not exist: that fog has left the share t of the light behind, and added s, the light scattered on the whole way. Over that a layer of colour c that
// hides the share a has to give t (c + (1 - a) b) + s where the picture has t b + s: blended as t c + a s with its own alpha it does.
fn seen_through_air(world: vec3<f32>, own: vec4<f32>, largest: f32) -> vec4<f32> {
    if !FOG {
        return own;
    }
    let away = select(length(world), dot(world, frame.forward), ORTHOGRAPHIC);
    let direction = select(world / max(away, 1e-30), frame.forward, ORTHOGRAPHIC);
    let aside = select(0.0, (world.y - away * direction.y) * frame.air.rate, ORTHOGRAPHIC);
    let ray = FogRay(direction, 1.0, frame.air.rise + aside);
    let left = fog_transmittance(fog_depth(ray, max(away, 0.0) + frame.eye_ahead));
#ifdef LIGHTS
#ifndef UNIFORM_BUFFER
    if FROXELS {
        let distance = dot(world, frame.forward);
        let clip = frame.clip_from_world * vec4(world, 1.0);
        let pixel = (clip.xy / clip.w + 1.0) / vec2(frame.pixel_width, frame.pixel_height);
        let stretched = FogRay(direction, away / max(distance, 1e-30), ray.rise);
        return vec4(own.rgb * left + froxel_light(pixel, stretched, max(distance, 0.0) + frame.eye_ahead, false, largest) * own.a, own.a);
    }
#endif
#endif
    return vec4(own.rgb * left + fog_light(direction, largest) * ((1.0 - left) * own.a), own.a);
}

// Light from infinitely far away, as the air leaves it. What lamps add to the air is found along the eye's own rays alone.
fn through_all_air(light: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    if !FOG {
        return light;
    }
    let left = fog_transmittance(endless_fog_depth(FogRay(direction, 1.0, frame.air.rise)));
    return light * left + fog_light(direction, 3e38) * (1.0 - left);
}
