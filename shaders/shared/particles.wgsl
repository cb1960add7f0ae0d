// The data of each particle that SIMULATE writes and PARTICLES reads.
#define_import_path afterlight::particles

struct Particle {
    // Of its middle, relative to the camera.
    position: vec3<f32>,
    // Edge of its square in metres; 0 where it is not seen.
    edge: f32,
    // Exposed light, not times alpha; and alpha.
    color: vec4<f32>,
    // Cosine and sine of the angle by which it is turned.
    turn: vec2<f32>,
    // The cell of its texture, and from bit 16 on the texture: 0 for none.
    look: u32,
    // Within so many metres before a surface it fades.
    softness: f32,
}
