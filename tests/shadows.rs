//! Shadows against geometry: what the sun reaches is worked out in f64 by casting rays at boxes.

mod common;

use std::f64::consts::PI;

use afterlight::frame::Picture;
use afterlight::scene::builtin::shapes;
use afterlight::scene::{AlphaMode, Camera, ColorSpace, Falloff, Material, Scene, Settings, ShadowSettings, Texture};
use common::gpu::{nits, on_gpu, places};
use common::stage::{add, directional, exact, gbuffer, lambert, plane, point, rectangle, spot, stage, sun};
use glam::{DAffine3, DVec3};

const SIZE: (u32, u32) = (96, 72);
const LUX: f32 = 3.0;
const ALBEDO: f32 = 0.5;
/// The floor is 8 m square, so the map's edge is at most 8 sqrt(3) m, a fourth of an octave more, in 1024 texels.
const MAP: u32 = 1024;
const TEXEL: f64 = 8.0 * 1.733 * 1.19 / (MAP as f64 - 7.0);
/// Within so many metres of a shadow's edge nothing is asserted: the filter's 2 texels, the normal offset's 1.5, and what
/// a bias of 1.5 texels' slope moves the edge by.
const BORDER: f64 = 6.0 * TEXEL;

/// A block over a floor.
#[derive(Clone, Copy)]
struct Block {
    low: DVec3,
    high: DVec3,
}

const BLOCK: Block = Block { low: DVec3::new(-0.75, 1.25, -0.6), high: DVec3::new(0.75, 1.75, 0.6) };

impl Block {
    fn grown(&self, by: f64) -> Self {
        Self { low: self.low - by, high: self.high + by }
    }

    /// Whether a ray meets the block.
    fn stops(&self, from: DVec3, direction: DVec3) -> bool {
        let (a, b) = ((self.low - from) / direction, (self.high - from) / direction);
        let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
        enter <= leave && leave > 0.0
    }
}

/// A floor y = 0, eight metres square, and a block over it, seen from above at a slant.
fn floor_and_block(towards: DVec3, offset: DVec3) -> Scene {
    let mut scene = stage();
    let at = |place: DVec3| DAffine3::from_translation(place + offset);
    add(&mut scene, shapes::plane([8.0, 8.0]), lambert(ALBEDO), at(DVec3::ZERO));
    let block = shapes::cuboid((BLOCK.high - BLOCK.low).to_array());
    add(&mut scene, block, lambert(ALBEDO), at((BLOCK.high + BLOCK.low) * 0.5));
    scene.lights = vec![sun(towards, LUX)];
    let eye = DVec3::new(1.0, 4.0, 6.5) + offset;
    scene.camera = Camera { fov_y_degrees: 50.0, ..Camera::looking_at(eye, offset, DVec3::Y) };
    scene
}

fn settings(text: &str) -> Settings {
    let shadows = ShadowSettings { size: MAP, ..ShadowSettings::default() };
    Settings { shadows, gbuffer: gbuffer(text), ..exact(SIZE.0, SIZE.1) }
}

/// The ray through a pixel's centre.
fn ray(camera: &Camera, x: u32, y: u32) -> DVec3 {
    let tan = (camera.fov_y_degrees.to_radians() * 0.5).tan();
    let [width, height] = [SIZE.0, SIZE.1].map(f64::from);
    let across = ((f64::from(x) + 0.5) * 2.0 / width - 1.0) * width / height;
    let down = (f64::from(y) + 0.5) * 2.0 / height - 1.0;
    camera.forward() + (camera.right() * across - camera.up() * down) * tan
}

/// The pixels that see the floor, and where, relative to its middle.
fn floor_pixels(scene: &Scene, offset: DVec3) -> Vec<((u32, u32), DVec3)> {
    let eye = scene.camera.position - offset;
    let mut pixels = Vec::new();
    for y in 0..SIZE.1 {
        for x in 0..SIZE.0 {
            let ray = ray(&scene.camera, x, y);
            let place = eye - ray * (eye.y / ray.y);
            // The block's outline on the screen is not looked at.
            if ray.y < 0.0 && place.abs().max_element() < 3.9 && !BLOCK.grown(0.05).stops(eye, ray) {
                pixels.push(((x, y), place));
            }
        }
    }
    pixels
}

/// Counts lit and shadowed pixels of the floor after having held each against the block's shadow.
fn assert_shadow(picture: &Picture, scene: &Scene, towards: DVec3, offset: DVec3) -> (usize, usize) {
    let towards = towards.normalize();
    let full = f64::from(LUX * ALBEDO) * towards.y / PI;
    // Along the floor a slanting sun stretches the border.
    let border = BORDER / towards.y;
    let (mut lit, mut dark) = (0, 0);
    for ((x, y), place) in floor_pixels(scene, offset) {
        let found = nits(picture, x, y).x / full;
        if BLOCK.grown(-border).stops(place, towards) {
            assert_eq!(found, 0.0, "({x}, {y}), {place}: light in the shadow of the sun at {towards}");
            dark += 1;
        } else if !BLOCK.grown(border).stops(place, towards) {
            // 8 bits of albedo: see `a_format`'s bounds in gbuffer.rs.
            assert!((found - 1.0).abs() < 0.008, "({x}, {y}), {place}: {found} of the light under {towards}");
            lit += 1;
        }
    }
    (lit, dark)
}

const SUNS: [DVec3; 4] =
    [DVec3::new(0.0, 1.0, 0.0), DVec3::new(0.4, 1.0, 0.3), DVec3::new(-0.9, 1.0, 0.2), DVec3::new(-0.5, 0.8, -1.0)];

#[test]
fn a_block_casts_the_shadow_that_rays_find() {
    on_gpu(|gpu| {
        for layout in ["lean", "float32"] {
            for towards in SUNS {
                let scene = floor_and_block(towards, DVec3::ZERO);
                let picture = gpu.draw(&scene, &settings(layout));
                let (lit, dark) = assert_shadow(&picture, &scene, towards, DVec3::ZERO);
                assert!(lit > 1000 && dark > 50, "{towards}: {lit} lit, {dark} dark");
            }
        }
    });
}

#[test]
fn a_shadow_is_as_good_far_from_the_origin() {
    on_gpu(|gpu| {
        let offset = DVec3::new(1e6, -1e6, 1e6);
        let scene = floor_and_block(SUNS[1], offset);
        let (lit, dark) = assert_shadow(&gpu.draw(&scene, &settings("lean")), &scene, SUNS[1], offset);
        assert!(lit > 1000 && dark > 50, "{lit} lit, {dark} dark");
    });
}

#[test]
fn what_the_camera_does_not_see_still_casts_its_shadow() {
    on_gpu(|gpu| {
        let mut scene = floor_and_block(SUNS[2], DVec3::ZERO);
        // Below the block, which is behind and above the camera, looking at its shadow.
        let camera = Camera::looking_at(DVec3::new(0.9, 0.6, 0.0), DVec3::new(1.2, 0.0, 0.0), DVec3::Y);
        scene.camera = Camera { fov_y_degrees: 40.0, near: 0.01, ..camera };
        let mut renderer = gpu.renderer(&scene, &settings("lean"));
        renderer.render(&scene.camera).unwrap_or_else(|error| panic!("{error}"));
        let picture = renderer.read_back().unwrap_or_else(|error| panic!("{error}"));
        let drawn = renderer.wait().unwrap_or_else(|error| panic!("{error}")).drawn;
        assert_eq!(drawn.culled, 1, "the block");
        let (_, dark) = assert_shadow(&picture, &scene, SUNS[2], DVec3::ZERO);
        assert!(dark > 1000, "{dark}");
    });
}

#[test]
fn a_surface_does_not_shade_itself_at_any_angle() {
    on_gpu(|gpu| {
        for degrees in [0.0f64, 20.0, 45.0, 60.0, 75.0, 85.0] {
            let towards = DVec3::new(degrees.to_radians().sin(), degrees.to_radians().cos(), 0.15);
            let mut scene = floor_and_block(towards, DVec3::ZERO);
            scene.objects.truncate(1);
            for layout in ["lean", "fat", "float32"] {
                let lit = gpu.draw(&scene, &settings(layout));
                let unshadowed = Settings {
                    shadows: ShadowSettings { enabled: false, ..ShadowSettings::default() },
                    ..settings(layout)
                };
                let bare = gpu.draw(&scene, &unshadowed);
                for (x, y) in places(&lit) {
                    let (found, expected) = (nits(&lit, x, y), nits(&bare, x, y));
                    assert_eq!(found, expected, "acne at ({x}, {y}) under {degrees} degrees, {layout}");
                }
            }
        }
    });
}

#[test]
fn a_ball_does_not_shade_its_bright_side() {
    on_gpu(|gpu| {
        let towards = DVec3::new(0.3, 0.5, 1.0).normalize();
        let mut scene = stage();
        add(&mut scene, shapes::sphere(0.8, 96), lambert(ALBEDO), DAffine3::IDENTITY);
        scene.lights = vec![sun(towards, LUX)];
        let off = ShadowSettings { enabled: false, ..ShadowSettings::default() };
        for layout in ["lean", "float32"] {
            let shaded = gpu.draw(&scene, &settings(layout));
            let bare = gpu.draw(&scene, &Settings { shadows: off, ..settings(layout) });
            // A facet of 96 around is 3.8 degrees wide; towards the terminator facets do shade each other.
            let bright = f64::from(LUX * ALBEDO) / PI * 0.3;
            let lit = |&(x, y): &(u32, u32)| nits(&bare, x, y).x > bright;
            assert!(places(&bare).filter(lit).count() > 500);
            for (x, y) in places(&bare).filter(lit) {
                assert_eq!(nits(&shaded, x, y), nits(&bare, x, y), "({x}, {y}), {layout}");
            }
        }
    });
}

#[test]
fn without_shadows_everything_is_lit() {
    on_gpu(|gpu| {
        let full = f64::from(LUX * ALBEDO) * SUNS[1].normalize().y / PI;
        let switched_off = ShadowSettings { enabled: false, ..ShadowSettings::default() };
        let mut uncast = floor_and_block(SUNS[1], DVec3::ZERO);
        uncast.lights = vec![directional(SUNS[1], LUX)];
        let cast = floor_and_block(SUNS[1], DVec3::ZERO);
        for (scene, shadows) in [(&uncast, ShadowSettings::default()), (&cast, switched_off)] {
            let settings = Settings { shadows, ..settings("lean") };
            assert!(gpu.renderer(scene, &settings).plan().shadow.is_none());
            let picture = gpu.draw(scene, &settings);
            for ((x, y), place) in floor_pixels(scene, DVec3::ZERO) {
                let found = nits(&picture, x, y).x / full;
                assert!((found - 1.0).abs() < 0.008, "({x}, {y}), {place}: {found}");
            }
        }
    });
}

#[test]
fn only_the_sun_is_shadowed() {
    on_gpu(|gpu| {
        let mut scene = floor_and_block(SUNS[1], DVec3::ZERO);
        let alone = gpu.draw(&scene, &settings("float32"));
        let lamps =
            [point(DVec3::Y * 3.0, 9.0, None, Falloff::InverseSquare), directional(DVec3::new(0.1, 1.0, 0.0), 1.0)];
        scene.lights = lamps.to_vec();
        let others = gpu.draw(&scene, &settings("float32"));
        // The sun is listed last, and still is the one that casts.
        scene.lights.push(sun(SUNS[1], LUX));
        scene.lights.push(spot(DVec3::Y * 5.0, 0.0, 10.0, 20.0));
        let all = gpu.draw(&scene, &settings("float32"));
        for (x, y) in places(&all) {
            let (found, expected) = (nits(&all, x, y), nits(&alone, x, y) + nits(&others, x, y));
            assert!((found - expected).abs().max_element() <= 1e-6 * expected.max_element(), "({x}, {y})");
        }
    });
}

/// A texture whose left half is a hole.
fn half_a_hole() -> Texture {
    let texels = (0..64 * 64).flat_map(|index| [255, 255, 255, if index % 64 < 32 { 0 } else { 255 }]).collect();
    Texture { name: "half a hole".into(), size: [64, 64], color_space: ColorSpace::Srgb, texels }
}

#[test]
fn a_masked_surface_casts_the_shadow_of_what_is_left_of_it() {
    on_gpu(|gpu| {
        // The wall z = 0 in the light that comes along the view, and a masked sheet before it, beside the view.
        let towards = DVec3::new(1.5, 0.0, 1.0);
        let mut scene = plane(lambert(1.0), vec![sun(towards, LUX)]);
        scene.textures.push(half_a_hole());
        let material = Material {
            base_color_texture: Some(0),
            alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
            two_sided: true,
            ..lambert(1.0)
        };
        add(&mut scene, rectangle([0.5, -2.0], [2.5, 2.0], 1.0), material, DAffine3::IDENTITY);
        scene.camera.near = 1.1;
        let picture = gpu.draw(&scene, &Settings { size: [64, 64], ..settings("lean") });
        // Along the light a metre above the wall is 1.5 m to the right: the hole's shadow would begin at x = -1, the sheet's at 0.
        for (x, y) in places(&picture) {
            let place = common::stage::seen(picture.size, x, y).x;
            let found = nits(&picture, x, y).x;
            if place < -0.1 {
                assert!(found > 0.1, "({x}, {y}): light falls through the hole");
            } else if place > 0.1 && place < 0.9 {
                assert_eq!(found, 0.0, "({x}, {y}): the sheet casts a shadow");
            }
        }
    });
}
