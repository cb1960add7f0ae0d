// The data of each particle that SIMULATE writes and PARTICLES reads.
#define_import_path afterlight::particles

struct Particle {
    // Position of the particle's middle, relative to the camera.
    position: vec3<f32>,
    // Edge of the particle's square in metres; 0 if it is not seen.
    edge: f32,
    // Exposed light, not times alpha; and alpha.
    color: vec4<f32>,
    // Cosine and sine of the angle by which it is turned.
    turn: vec2<f32>,
    // The cell of its texture, and from bit 16 on the texture: 0 for none.
    look: u32,
    // Metres before a surface within which the particle fades.
    softness: f32,
}
