//! Pictures from every G-buffer agree within bounds that follow from the formats.
//!
//! The picture is linear and shows one triangle, whose position and shading normal are known at every pixel. Each pixel and each light gets its own
//! bound, from `common::truth` and from how far the light model can move when its input moves by a format's rounding.

use std::f64::consts::FRAC_1_SQRT_2;

use crate::common::compare::assert_identical;
use crate::common::gpu::{Gpu, nits, on_gpu, places};
use crate::common::stage::{add, exact, gbuffer, lambert, point, stage};
use crate::common::truth::radiance;
use afterlight::frame::Picture;
use afterlight::gpu::vk;
use afterlight::plan::{Gbuffer, NormalEncoding};
use afterlight::scene::builtin::shapes::MeshBuilder;
use afterlight::scene::{Brdf, Camera, Falloff, Light, Material, Projection, Scene, Settings, TARGETS};
use glam::{DAffine3, DVec2, DVec3, Vec3};

/// Edge of the pictures: 4225 different normals.
const EDGE: u32 = 65;

/// A step of a half float, relative: 10 bits of mantissa and the hidden one. Vulkan says that a value between two that a float holds
/// becomes one or the other, and lavapipe truncates: half a step, 4.9e-4, holds on drivers that round to the nearest only.
const HALF: f64 = 1.0 / 1024.0;

/// The greatest distance of a value that a format holds from the value that was written.
#[derive(Debug, Clone, Copy, Default)]
struct Rounding {
    /// Codes of 8-bit sRGB.
    albedo_codes: f64,
    /// Relative.
    albedo: f64,
    /// Radians.
    normal: f64,
    /// Relative to the distance to the camera.
    position: f64,
    /// Absolute, for metallic and roughness.
    material: f64,
    /// Relative, for metallic and roughness.
    material_relative: f64,
}

impl Rounding {
    fn of(formats: &Gbuffer) -> Self {
        let mut rounding = Self::default();
        match formats.albedo {
            // Half a code, and the tenth that Vulkan leaves an sRGB conversion.
            vk::Format::R8G8B8A8_SRGB => rounding.albedo_codes = 0.6,
            vk::Format::R16G16B16A16_SFLOAT => rounding.albedo = HALF,
            _ => {}
        }
        rounding.normal = match (formats.normal_encoding, formats.normal) {
            // Half a step of 1/32767 in each of two coordinates: FRAC_1_SQRT_2 / 32767. The map back to the octahedron stretches that by
            // sqrt(3) at most ((1, 1) becomes (1, 1, -2)), and projecting to the sphere by sqrt(3) in the middle of a face: 0.0037 degrees.
            (NormalEncoding::Octahedral, _) => 3.0 * FRAC_1_SQRT_2 / 32767.0,
            // Half a step of 1/127 by the same derivation: 0.96 degrees.
            (NormalEncoding::Octahedral8, _) => 3.0 * FRAC_1_SQRT_2 / 127.0,
            // Half a step of 2/255 in each of three coordinates: 0.39 degrees.
            (NormalEncoding::HalfEncoded, vk::Format::R8G8B8A8_UNORM) => 3f64.sqrt() / 255.0,
            // Half a step of 2/1023 in each of three coordinates, all across the normal: 0.097 degrees (0.096 where
            // the worst direction lies on codes).
            (NormalEncoding::HalfEncoded, _) => 3f64.sqrt() / 1023.0,
            // Components from 0.5 to 1 err by a step of 2^-11 each. Three at once are near (1, 1, 1) / sqrt(3), and the part across of
            // an error (1, 1, -1) is sqrt(8/3): 0.046 degrees, of which rounding to the nearest leaves half, 0.023.
            (_, vk::Format::R16G16B16A16_SFLOAT) => (8f64 / 3.0).sqrt() / 2048.0,
            _ => 0.0,
        };
        rounding.position = match formats.position {
            // Each component relative to itself, so the vector to its length.
            Some(vk::Format::R16G16B16A16_SFLOAT) => HALF,
            Some(_) => 0.0,
            // The precision of a rasterizer's interpolated depth within 100 units.
            None => 3e-6,
        };
        match formats.material {
            // Half a code, and the tenth that a normalized conversion may be off.
            Some(vk::Format::R8_UNORM | vk::Format::R8G8_UNORM | vk::Format::R8G8B8A8_UNORM) => {
                rounding.material = 0.6 / 255.0;
            }
            Some(vk::Format::R16_SFLOAT | vk::Format::R16G16_SFLOAT | vk::Format::R16G16B16A16_SFLOAT) => {
                rounding.material_relative = HALF;
            }
            _ => {}
        }
        rounding
    }

    /// The largest relative change of a linear albedo.
    fn albedo_change(&self, albedo: f64) -> f64 {
        let code = 255.0 * if albedo <= 0.003_130_8 { 12.92 * albedo } else { 1.055 * albedo.powf(1.0 / 2.4) - 0.055 };
        let encoded = (code + self.albedo_codes) / 255.0;
        // The curve is convex: a step up is the larger.
        let moved = if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) };
        moved / albedo - 1.0 + self.albedo
    }
}

/// A lit point and one light.
struct Place {
    point: DVec3,
    normal: DVec3,
    eye: DVec3,
    light: DVec3,
}

/// The largest relative change of the light that a lambert surface reflects, albedo left out: albedo / pi * N.L / d^2.
///
/// N.L is a product of unit vectors, so it moves by the angle by which either turns; the light's direction turns by shift / d and
/// its strength moves by 2 shift / d.
fn lambert_change(place: &Place, rounding: &Rounding) -> f64 {
    let to_light = place.light - place.point;
    let n_dot_l = place.normal.dot(to_light.normalize());
    // Derivatives that go by 1 / N.L say little where light only grazes.
    assert!(n_dot_l > 0.1, "{}: light at a cosine of {n_dot_l}", place.point);
    let shift = rounding.position * place.eye.distance(place.point) / to_light.length();
    (rounding.normal + shift) / n_dot_l + 2.0 * shift
}

/// The largest relative change of the light that Cook-Torrance reflects, albedo left out. Base and lobe are sums of positive terms, so the change of
/// their sum is no more than the greater of theirs; the sum of both bounds is safe.
fn cook_torrance_change(material: &Material, place: &Place, rounding: &Rounding) -> f64 {
    let alpha = f64::from(material.roughness).powi(2);
    let (to_light, to_eye) = (place.light - place.point, place.eye - place.point);
    let (light, view) = (to_light.normalize(), to_eye.normalize());
    let n_dot_v = place.normal.dot(view);
    let v_dot_h = (light + view).length() * 0.5;
    // Angles by which the directions to light and eye turn, and the half vector between them, whose length before it is normalized is 2 V.H.
    let shift = rounding.position * to_eye.length();
    let (turn_light, turn_view) = (shift / to_light.length(), shift / to_eye.length());
    let turn_half = (turn_light + turn_view) / (2.0 * v_dot_h);
    // ln D = -2 ln(cos^2 alpha^2 + sin^2) + constant, of slope 4 t / (alpha^2 + t^2) at most with t = tan of the angle of N and H: 2 / alpha.
    let distribution = (rounding.normal + turn_half) * 2.0 / alpha;
    // V N.L = 0.5 / (S(N.V) + N.V S(N.L) / N.L) is concave in N.L and 0 at 0, and falls with N.V no faster than 1 / N.V.
    let visibility = (rounding.normal + turn_view) / n_dot_v;
    // Schlick's (1 - V.H)^5, relative to F >= F0 in the lobe and to 1 - F = (1 - F0)(1 - schlick) in the base.
    let turn_schlick = 5.0 * (1.0 - v_dot_h).powi(4) * (turn_light + turn_view) * 0.5;
    let schlick = (1.0 - v_dot_h).powi(5);
    let f0 = DVec3::splat(0.04).lerp(material.base_color.as_dvec3(), f64::from(material.metallic));
    let fresnel = turn_schlick / f0.min_element() + turn_schlick / (1.0 - schlick);
    // Lambert's bound covers N.L, in the base as in V N.L, and the light's strength.
    lambert_change(place, rounding) + distribution + visibility + fresnel + material_change(material, rounding)
}

/// The part of metallic and roughness.
fn material_change(material: &Material, rounding: &Rounding) -> f64 {
    let (metallic, roughness) = (f64::from(material.metallic), f64::from(material.roughness));
    let step = |value: f64| rounding.material + rounding.material_relative * value;
    // alpha = roughness^2. The slope of D in ln alpha is 2 - 4 cos^2 alpha^2 / (cos^2 alpha^2 + sin^2), from -2 at the peak to 2 beside it. The slope
    // of V is from -1 to 0, since the slope of S = sqrt(x^2 (1 - alpha^2) + alpha^2) is from 0 to 1.
    let alpha = ((1.0 + step(roughness) / roughness).powi(2) - 1.0) * 3.0;
    // F0 = 0.04 + metallic (albedo - 0.04): relative to F0 in the lobe, to 1 - F0 in the base, which has 1 - metallic besides.
    let albedo = material.base_color.as_dvec3();
    let f0 = DVec3::splat(0.04).lerp(albedo, metallic);
    let moved = (albedo - 0.04).abs() * step(metallic);
    let base = step(metallic) / (1.0 - metallic) + (moved / (1.0 - f0)).max_element();
    alpha + (moved / f0).max_element() + base
}

/// A material on the triangle, and the distance that it is seen from.
struct Case {
    material: Material,
    distance: f64,
    /// Both pictures are computed in single precision, good to this each (`tests/draw/pixels.rs`).
    single: f64,
}

/// Corners of a triangle that holds all that the camera sees of z = 0, with normals that are bent every way.
const CORNERS: [([f64; 2], [f64; 3]); 3] =
    [([-2.0, -2.0], [-0.3, -0.4, 1.0]), ([6.0, -2.0], [0.9, 0.1, 1.0]), ([-2.0, 6.0], [0.1, 0.8, 1.0])];

/// The shading normal of a point: interpolated between the corners', then normalized.
fn normal_at(point: DVec3) -> DVec3 {
    let [origin, right, up] = CORNERS.map(|(corner, _)| DVec2::from(corner));
    let share = (point.truncate() - origin) / DVec2::new(right.x - origin.x, up.y - origin.y);
    let [a, b, c] = CORNERS.map(|(_, normal)| DVec3::from(normal).normalize());
    (a * (1.0 - share.x - share.y) + b * share.x + c * share.y).normalize()
}

impl Case {
    fn lambert(distance: f64) -> Self {
        Self { material: Material { base_color: ALBEDO, ..lambert(1.0) }, distance, single: 1e-5 }
    }

    fn cook_torrance(distance: f64) -> Self {
        // Neither metallic nor roughness is a code of 8 bits or a half float.
        let material = Material { base_color: ALBEDO, metallic: 0.3, roughness: 0.451, ..Material::default() };
        Self { material, distance, single: 1e-4 }
    }

    fn scene(&self) -> Scene {
        let mut scene = stage();
        let mut mesh = MeshBuilder::new();
        let corners = CORNERS.map(|(corner, normal)| {
            mesh.vertex(DVec2::from(corner).extend(0.0), DVec3::from(normal).normalize(), DVec2::ZERO)
        });
        mesh.triangle(corners);
        add(&mut scene, mesh, self.material.clone(), DAffine3::IDENTITY);
        let lamp = |x, y, z, candela| point(DVec3::new(x, y, z), candela, None, Falloff::InverseSquare);
        scene.lights = vec![lamp(0.5, 0.25, 1.5, 3.0), lamp(1.5, 2.0, 2.5, 10.0)];
        scene.camera = self.camera();
        scene
    }

    /// Looks at the origin slantwise, so that depth differs from pixel to pixel, and from however far sees as much of the triangle.
    fn camera(&self) -> Camera {
        let position = DVec3::new(0.5, 0.3, 1.0).normalize() * self.distance;
        let fov_y_degrees = 2.0 * (0.8 / self.distance).atan().to_degrees();
        Camera {
            projection: Projection::perspective(fov_y_degrees),
            near: 0.125,
            ..Camera::looking_at(position, DVec3::ZERO, DVec3::Y)
        }
    }

    /// Returns the point where the ray through a pixel's centre meets the triangle.
    fn seen(&self, x: u32, y: u32) -> DVec3 {
        let camera = self.camera();
        let [across, down] = [x, y].map(|pixel| (f64::from(pixel) + 0.5) * 2.0 / f64::from(EDGE) - 1.0);
        let ray = camera.forward() + (camera.right() * across - camera.up() * down) * (0.8 / self.distance);
        camera.position - ray * (camera.position.z / ray.z)
    }

    /// Returns the greatest difference, in nits, of a pixel from the same pixel of a G-buffer that rounds nothing.
    fn bound(&self, rounding: &Rounding, lights: &[Light], point: DVec3) -> DVec3 {
        let (normal, eye) = (normal_at(point), self.camera().position);
        let mut bound = DVec3::ZERO;
        for light in lights {
            let afterlight::scene::LightKind::Point { position, .. } = light.kind else { continue };
            let place = Place { point, normal, eye, light: position };
            let moved = match self.material.brdf {
                Brdf::Lambert => lambert_change(&place, rounding),
                _ => cook_torrance_change(&self.material, &place, rounding),
            };
            // F0 follows the albedo by metallic at most, and the base by |1 - albedo metallic / (1 - F0)| < 1 here: neither changes more than the
            // albedo does. A twentieth covers terms of second order.
            let albedo = self.material.base_color.as_dvec3().to_array().map(|albedo| rounding.albedo_change(albedo));
            let relative = (DVec3::from(albedo) + moved) * 1.05 + 2.0 * self.single;
            bound += relative * radiance(&self.material, std::slice::from_ref(light), point, normal, eye);
        }
        bound
    }

    /// Draws with a G-buffer and holds it against the bound. Lossy formats must make a difference: else they were not used.
    fn assert_within(&self, gpu: &Gpu, reference: &Picture, name: &str) {
        let scene = self.scene();
        let settings = Settings { gbuffer: gbuffer(name), ..exact(EDGE, EDGE) };
        let plan = gpu.renderer(&scene, &settings).plan().clone();
        let formats = plan.gbuffer.unwrap_or_else(|| panic!("{name}: no G-buffer"));
        let rounding = Rounding::of(&formats);
        let picture = gpu.draw(&scene, &settings);
        let mut worst = 0.0f64;
        for (x, y) in places(&picture) {
            let difference = (nits(&picture, x, y) - nits(reference, x, y)).abs();
            let bound = self.bound(&rounding, &scene.lights, self.seen(x, y));
            assert!(
                difference.is_finite() && difference.cmple(bound).all(),
                "{name} ({x}, {y}): {difference} > {bound}"
            );
            worst = worst.max((difference / bound).max_element());
        }
        let model = self.material.brdf;
        eprintln!("{model} at {} m, {name}: {worst:.3} of the bound", self.distance);
        // Asks the name and not the plan, which might have left the override out.
        let unread = model == Brdf::Lambert && name.contains("material=");
        let exact = name == "float32" || name.ends_with("=rgba32f") || unread;
        assert_eq!(worst == 0.0, exact, "{model} {name}: {worst} of the bound, {rounding:?}");
    }

    /// The picture of 32-bit floats, which is the light model at the known places and normals.
    fn reference(&self, gpu: &Gpu) -> Picture {
        let scene = self.scene();
        let picture = gpu.draw(&scene, &exact(EDGE, EDGE));
        for (x, y) in places(&picture) {
            let point = self.seen(x, y);
            let (normal, eye) = (normal_at(point), self.camera().position);
            let expected = radiance(&self.material, &scene.lights, point, normal, eye);
            let error = (nits(&picture, x, y) / expected - 1.0).abs().max_element();
            // A place has the single precision of its distance, 3e-6 of it at the most, and counts 4 times at half a metre.
            assert!(error < self.single + 3e-6 * self.distance, "({x}, {y}): off by {error}");
        }
        picture
    }
}

const ALBEDO: Vec3 = Vec3::new(0.61, 0.37, 0.13);

/// 32-bit floats with one target in each other format that it takes.
fn overrides() -> impl Iterator<Item = String> {
    TARGETS.iter().flat_map(|(target, formats)| formats.iter().map(move |format| format!("float32,{target}={format}")))
}

#[test]
fn a_picture_is_within_what_each_format_rounds() {
    on_gpu(|gpu| {
        for case in [Case::lambert(2.0), Case::cook_torrance(2.0)] {
            let reference = case.reference(gpu);
            for name in ["lean", "fat", "float32"].map(String::from).into_iter().chain(overrides()) {
                case.assert_within(gpu, &reference, &name);
            }
        }
    });
}

#[test]
fn positions_far_away_are_within_what_depth_and_half_floats_round() {
    on_gpu(|gpu| {
        for case in [Case::lambert(90.0), Case::cook_torrance(90.0), Case::lambert(9.0)] {
            let reference = case.reference(gpu);
            for name in ["float32,position=depth", "float32,position=rgba32f"] {
                case.assert_within(gpu, &reference, name);
            }
        }
        let case = Case::lambert(9.0);
        case.assert_within(gpu, &case.reference(gpu), "float32,position=rgba16f");
    });
}

#[test]
fn octahedral_normals_in_unsigned_integers_give_the_same_picture() {
    on_gpu(|gpu| {
        for case in [Case::lambert(2.0), Case::cook_torrance(2.0)] {
            let scene = case.scene();
            for base in ["lean", "float32"] {
                let settings =
                    |normal| Settings { gbuffer: gbuffer(&format!("{base},normal={normal}")), ..exact(EDGE, EDGE) };
                let (unorm, uint) = (settings("oct16"), settings("oct16-uint"));
                let format = |settings| gpu.renderer(&scene, settings).plan().gbuffer.map(|formats| formats.normal);
                if format(&unorm) == format(&uint) {
                    eprintln!("SKIPPED: the device has no R16G16_UNORM targets; both are R16G16_UINT");
                    continue;
                }
                // Both write the same 65536 codes, and both rebuild the same floats from them.
                assert_identical(&gpu.draw(&scene, &unorm), &gpu.draw(&scene, &uint), base);
            }
        }
    });
}
