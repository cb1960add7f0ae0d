//! The parts of a random scene.

use fastrand::Rng;
use glam::Vec3;

use super::draw::RandomSource;
use afterlight::scene::{AlphaMode, Brdf, GbufferPreset, HdrFormat, LightPath, ShadowFilter, Transparency};

/// Random numbers that a scene takes.
pub const NUMBERS: usize = 63;

/// A floor, a ball above it and lamps above that, as they are at their extremes. [`Extremes::PLAIN`] has nothing of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremes {
    // The material of floor and ball.
    pub brdf: Brdf,
    pub base_color: Vec3,
    pub roughness: f32,
    pub metallic: f32,
    pub specular: Vec3,
    pub shininess: f32,
    pub alpha: f32,
    /// The alpha mode of the ball alone.
    pub alpha_mode: AlphaMode,
    pub two_sided: bool,
    /// Emitted radiance over the lamps' lux.
    pub glow: f32,
    /// The texel of an even normal map.
    pub bump: Option<[u8; 4]>,
    pub normal_scale: f32,
    /// Repetitions of a texture of waves in a metre.
    pub repeats: Option<f64>,

    // Places.
    /// Metres to a scene unit.
    pub scale: f64,
    /// Metres from the origin to everything.
    pub offset: f64,
    /// The camera's position in scene units. It looks at the ball.
    pub eye: [f64; 3],
    pub fov_y_degrees: f64,
    /// The distance of the near plane, in scene units.
    pub near: f64,
    /// Scale of the ball along its axes: mirrored below zero, flat at zero.
    pub stretch: [f64; 3],

    // Lights.
    pub lamps: u32,
    pub lamp_color: Vec3,
    /// The distance of the lamps from the floor, in units, and the light of each on the floor below, in lux.
    pub distance: f64,
    pub lux: f64,
    pub falloff: Falling,
    /// The range of lamps, in units.
    pub range: Option<f64>,
    /// Inner and outer angle in degrees.
    pub cone: Option<[f64; 2]>,
    /// The size of lamps, in units.
    pub size: f64,
    pub sun_lux: f64,
    /// Radiance over the lamps' lux.
    pub ambient: f32,
    pub background: f32,
    pub shadows: bool,

    // Settings.
    /// The exposure in stops above the exposure for the light on the floor; `None` is metered.
    pub stops: Option<f32>,
    pub size_in_pixels: [u32; 2],
    pub gbuffer: GbufferPreset,
    pub light_path: LightPath,
    pub depth_prepass: Option<bool>,
    pub hdr_format: HdrFormat,
    pub transparency: Transparency,
    pub shadow_filter: ShadowFilter,
    pub msaa: u32,
    pub samples: u32,
    /// True for an orthographic camera, which shows as much at the distance of its target.
    pub parallel: bool,
}

/// The fall-off of lamps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Falling {
    InverseSquare,
    Quadratic,
    /// Constant, linear and quadratic factor are the same.
    Polynomial,
}

impl Extremes {
    pub const PLAIN: Self = Self {
        brdf: Brdf::CookTorrance,
        base_color: Vec3::splat(0.5),
        roughness: 0.5,
        metallic: 0.0,
        specular: Vec3::splat(0.5),
        shininess: 1.0,
        alpha: 1.0,
        alpha_mode: AlphaMode::Opaque,
        two_sided: false,
        glow: 0.0,
        bump: None,
        normal_scale: 1.0,
        repeats: None,
        scale: 1.0,
        offset: 0.0,
        eye: EYES[0],
        fov_y_degrees: 60.0,
        near: 0.01,
        stretch: [1.0; 3],
        lamps: 1,
        lamp_color: Vec3::ONE,
        distance: 2.0,
        lux: 1.0,
        falloff: Falling::InverseSquare,
        range: None,
        cone: None,
        size: 0.0,
        sun_lux: 0.0,
        ambient: 0.1,
        background: 0.0,
        shadows: false,
        stops: None,
        size_in_pixels: SIZES[0],
        gbuffer: GbufferPreset::Float32,
        light_path: LightPath::Auto,
        depth_prepass: None,
        hdr_format: HdrFormat::Rgba16f,
        transparency: Transparency::Sorted,
        shadow_filter: ShadowFilter::None,
        msaa: 1,
        samples: 1,
        parallel: false,
    };

    /// The scene of a seed.
    pub fn wild(seed: u64) -> Self {
        let mut rng = Rng::with_seed(seed);
        Self::drawn(&mut || rng.f64())
    }

    /// The scene of [`NUMBERS`] numbers from 0 up to 1, all of which 0 is a plain one.
    pub fn drawn(next: &mut dyn FnMut() -> f64) -> Self {
        let mut draw = RandomSource(next);
        let plain = Self::PLAIN;
        let scene = Self {
            brdf: draw.pick(&[Brdf::CookTorrance, Brdf::Phong, Brdf::BlinnPhong, Brdf::Lambert]),
            base_color: draw.color(0.5),
            roughness: draw.share(0.5),
            metallic: draw.share(0.0),
            specular: draw.color(0.5),
            shininess: draw.pick(&[1.0, 0.0, 1.0, 1.0]) * draw.decades(-3.0, 6.0) as f32,
            alpha: draw.share(1.0),
            alpha_mode: draw.pick(ALPHA_MODES),
            two_sided: draw.chance(0.3),
            glow: draw.sometimes(0.2, |draw| draw.decades(-6.0, 6.0) as f32).unwrap_or(0.0),
            bump: draw.sometimes(0.4, |draw| draw.pick(BUMPS)),
            normal_scale: draw.pick(&[1.0, 0.0, -1.0, 1e-6, 1e6]),
            repeats: draw.sometimes(0.2, |draw| draw.decades(-3.0, 6.0)),
            scale: draw.decades(-6.0, 6.0),
            offset: draw.sometimes(0.5, |draw| draw.decades(-1.0, 8.0)).unwrap_or(0.0),
            eye: draw.pick(EYES),
            fov_y_degrees: fov(draw.between(0.0, 1.0)),
            near: plain.near * draw.decades(-4.0, 2.0),
            stretch: [draw.pick(STRETCHES), draw.pick(STRETCHES), draw.pick(STRETCHES)],
            lamps: draw.pick(&[1, 1, 2, 3, 40]),
            lamp_color: draw.color(1.0),
            distance: plain.distance * draw.decades(-4.0, 4.0),
            lux: draw.decades(-8.0, 12.0),
            falloff: draw.pick(&[Falling::InverseSquare, Falling::Quadratic, Falling::Polynomial]),
            range: draw.sometimes(0.4, |draw| draw.pick(&[1.0, 1.0, 1.0, 0.0]) * draw.decades(-6.0, 6.0)),
            cone: draw.sometimes(0.4, |draw| {
                let outer = 180.0 * f64::from(draw.share(0.5));
                [outer * f64::from(draw.share(0.5)), outer]
            }),
            size: draw.sometimes(0.3, |draw| draw.decades(-3.0, 2.0)).unwrap_or(0.0),
            sun_lux: draw.sometimes(0.4, |draw| draw.decades(-8.0, 12.0)).unwrap_or(0.0),
            ambient: draw.share(0.1),
            background: draw.share(0.0),
            shadows: draw.chance(0.3),
            stops: draw.sometimes(0.8, |draw| draw.pick(&[1.0, -1.0]) * draw.between(0.0, 20.0) as f32),
            size_in_pixels: draw.pick(SIZES),
            gbuffer: draw.pick(&[GbufferPreset::Float32, GbufferPreset::Fat, GbufferPreset::Lean]),
            light_path: draw.pick(LIGHT_PATHS),
            depth_prepass: draw.pick(&[None, Some(false), Some(true)]),
            hdr_format: draw.pick(&[HdrFormat::Rgba16f, HdrFormat::B10g11r11, HdrFormat::Rgba32f]),
            transparency: draw.pick(&[Transparency::Sorted, Transparency::Oit]),
            shadow_filter: draw.pick(SHADOW_FILTERS),
            msaa: draw.pick(&[1, 1, 4]),
            samples: draw.pick(&[1, 1, 1, 2]),
            parallel: draw.chance(0.2),
        };
        scene.agreed()
    }

    /// Without combinations that a plan refuses (docs/LIGHT_PATHS.md).
    fn agreed(self) -> Self {
        let blends = matches!(self.light_path, LightPath::PerLight | LightPath::Volumes);
        let is_transparent = matches!(self.alpha_mode, AlphaMode::Blend | AlphaMode::Glass);
        let light_path = match self.light_path {
            LightPath::Compute | LightPath::Visibility if is_transparent => LightPath::Clustered,
            path => path,
        };
        let is_single = blends || matches!(light_path, LightPath::Compute | LightPath::Visibility);
        let hdr_format = match self.hdr_format {
            HdrFormat::B10g11r11 if blends => HdrFormat::Rgba16f,
            format => format,
        };
        let msaa = if is_single { 1 } else { self.msaa };
        let depth_prepass = self.depth_prepass.filter(|_| light_path != LightPath::ForwardNaive);
        // The quadratic fall-off ends at a range.
        let range = self.range.or((self.falloff == Falling::Quadratic).then_some(10.0));
        let samples = if msaa > 1 { 1 } else { self.samples };
        let agreed = Self { light_path, hdr_format, msaa, depth_prepass, range, samples, ..self };
        if self.gbuffer == GbufferPreset::Lean { agreed.without_faint_colors() } else { agreed }
    }

    /// Takes a G-buffer of 32-bit floats, and removes everything that errs by design: narrow highlights, texels and edges of shadows that are smaller
    /// than a pixel, several samples where the truth has one, light in few bits, clipping kilometres away, and faces that coincide.
    pub fn tamed(self) -> Self {
        let stretch = self.stretch.map(|along| along.clamp(-4.0, 4.0));
        let is_flat = stretch.iter().any(|along| along.abs() < 0.1);
        // A pixel that sees it all has vertices on a grid as coarse as the ball's faces.
        let size_in_pixels = if self.size_in_pixels == [1, 1] { SIZES[0] } else { self.size_in_pixels };
        Self {
            roughness: self.roughness.max(0.3),
            shininess: self.shininess.min(30.0),
            alpha_mode: AlphaMode::Opaque,
            two_sided: self.two_sided && !is_flat,
            repeats: None,
            stretch,
            shadows: false,
            size_in_pixels,
            gbuffer: GbufferPreset::Float32,
            hdr_format: HdrFormat::Rgba32f,
            msaa: 1,
            samples: 1,
            ..self
        }
    }

    /// Takes a lean G-buffer, whose Phong exponents have 8 bits as well.
    pub fn leaned(self) -> Self {
        let lean = Self { shininess: self.shininess.max(1.0), gbuffer: GbufferPreset::Lean, ..self };
        lean.without_faint_colors()
    }

    /// 8 bits round very faint colours to black.
    fn without_faint_colors(self) -> Self {
        let held = |color: Vec3| Vec3::from(color.to_array().map(|channel| if channel < 0.05 { 0.0 } else { channel }));
        Self { base_color: held(self.base_color), specular: held(self.specular), ..self }
    }
}

/// A field of view in degrees: from 60 up to 179, or down to a tenth of a degree.
fn fov(number: f64) -> f64 {
    let number = 2.0 * number;
    if number < 1.0 { 60.0 + 119.0 * number } else { 60.0 * (1.0f64 / 600.0).powf(number - 1.0) }
}

const ALPHA_MODES: &[AlphaMode] = &[
    AlphaMode::Opaque,
    AlphaMode::Opaque,
    AlphaMode::Mask { cutoff: 0.5 },
    AlphaMode::Mask { cutoff: 0.0 },
    AlphaMode::Mask { cutoff: 1.0 },
    AlphaMode::Blend,
    AlphaMode::Glass,
];

/// Neutral; no vector at all, or nearly; down, along an axis, and steep.
const BUMPS: &[[u8; 4]] = &[
    [128, 128, 255, 255],
    [128, 128, 128, 255],
    [127, 128, 127, 255],
    [0, 0, 0, 255],
    [255, 255, 255, 255],
    [128, 128, 0, 255],
    [255, 128, 128, 255],
    [180, 90, 230, 255],
];

/// Two metres up; a hair above the floor, and below it; nearly straight above, far off, and within the ball.
const EYES: &[[f64; 3]] =
    &[[0.1, 2.0, 4.0], [0.1, 0.01, 4.0], [0.1, -1.0, 2.0], [0.1, 8.0, 0.2], [30.0, 20.0, -10.0], [0.1, 1.0, 0.1]];

const STRETCHES: &[f64] = &[1.0, 1.0, 4.0, 0.25, -1.0, 1e-6, 1e6, 0.0];

const SIZES: &[[u32; 2]] = &[[64, 36], [64, 36], [33, 17], [7, 3], [1, 1], [1, 64], [64, 1]];

const LIGHT_PATHS: &[LightPath] = &[
    LightPath::Auto,
    LightPath::Loop,
    LightPath::PerLight,
    LightPath::Volumes,
    LightPath::Clustered,
    LightPath::Compute,
    LightPath::Forward,
    LightPath::ForwardNaive,
];

const SHADOW_FILTERS: &[ShadowFilter] = &[
    ShadowFilter::None,
    ShadowFilter::Box2,
    ShadowFilter::Box3,
    ShadowFilter::Box5,
    ShadowFilter::Poisson,
    ShadowFilter::Pcss,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_make_a_plain_scene_and_every_number_is_used() {
        let mut count = 0;
        let plain = Extremes::drawn(&mut || {
            count += 1;
            0.0
        });
        assert_eq!((plain, count), (Extremes::PLAIN, NUMBERS));
        for seed in 0..200 {
            let mut rng = Rng::with_seed(seed);
            let mut count = 0;
            Extremes::drawn(&mut || {
                count += 1;
                rng.f64()
            });
            assert_eq!(count, NUMBERS, "{seed}");
        }
    }

    #[test]
    fn seeds_make_different_scenes_and_always_the_same() {
        for seed in 0..100 {
            assert_eq!(Extremes::wild(seed), Extremes::wild(seed));
            assert_ne!(Extremes::wild(seed), Extremes::wild(seed + 1));
        }
    }
}
