//! Shadows against geometry: rays that are cast at boxes in f64 tell the points that the sun reaches.

use std::f64::consts::PI;

use crate::common::compare::assert_identical;
use crate::common::gpu::{Gpu, bytes, nits, on_gpu, on_gpu_in_both_modes, places};
use crate::common::stage::{add, directional, exact, gbuffer, lambert, plane, point, rectangle, spot, stage, sun};
use crate::common::{one_of, some_in_turn};
use afterlight::frame::{DrawCounts, Picture, Renderer};
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    AlphaMode, Camera, CastsShadow, ColorSpace, Falloff, Keep, Light, LightKind, LightPath, Material, OptionalPart,
    Output, Projection, Scene, Settings, ShadowFilter, ShadowSettings, Texture, View,
};
use glam::{DAffine3, DVec3};

const SIZE: (u32, u32) = (96, 72);
const LUX: f32 = 3.0;
const ALBEDO: f32 = 0.5;
/// A map is never larger than the sphere around the scene: a floor 8 m square and a block up to 1.75 m over it.
const MAP: u32 = 1024;
const TEXEL: f64 = 11.5 / (MAP as f64 - 9.0);
/// The distance from a shadow's edge in metres within which nothing is asserted: the filter's 2 texels, the normal offset's 1.5, and the distance
/// that a bias of 1.5 texels' slope moves the edge.
const BORDER: f64 = 6.0 * TEXEL;

/// A block over a floor.
#[derive(Clone, Copy)]
struct FloorBlock {
    low: DVec3,
    high: DVec3,
}

const BLOCK: FloorBlock = FloorBlock { low: DVec3::new(-0.75, 1.25, -0.6), high: DVec3::new(0.75, 1.75, 0.6) };

impl FloorBlock {
    fn grown(&self, by: f64) -> Self {
        Self { low: self.low - by, high: self.high + by }
    }

    /// Returns true if a ray meets the block.
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
    scene.camera = Camera { projection: Projection::perspective(50.0), ..Camera::looking_at(eye, offset, DVec3::Y) };
    scene
}

fn settings(text: &str) -> Settings {
    let shadows = ShadowSettings { size: MAP, ..ShadowSettings::default() };
    Settings { shadows, gbuffer: gbuffer(text), ..exact(SIZE.0, SIZE.1) }
}

/// The ray through a pixel's centre.
fn ray(camera: &Camera, x: u32, y: u32) -> DVec3 {
    let tan = camera.half_height();
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
        scene.camera = Camera { projection: Projection::perspective(40.0), near: 0.01, ..camera };
        let mut renderer = gpu.renderer(&scene, &settings("lean"));
        renderer.render(&scene.camera).unwrap_or_else(|error| panic!("{error}"));
        let picture = renderer.read_back().unwrap_or_else(|error| panic!("{error}"));
        let drawn = renderer.wait().unwrap_or_else(|error| panic!("{error}")).drawn;
        // Floor and block are drawn into each existing map: one map for each slice in which the camera sees the floor.
        assert!(
            drawn.culled == 1 && drawn.casters > drawn.shadow_maps_drawn,
            "the block is culled, and casts: {drawn:?}"
        );
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
                    // Drawn from a G-buffer as well, which rounds the colour.
                    light_path: LightPath::Loop,
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
            // Drawn from a G-buffer as well, which rounds the colour.
            let bare = Settings { shadows: off, light_path: LightPath::Loop, ..settings(layout) };
            let bare = gpu.draw(&scene, &bare);
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
fn lights_without_a_shadow_shine_as_if_there_were_none() {
    on_gpu(|gpu| {
        let mut scene = floor_and_block(SUNS[1], DVec3::ZERO);
        let alone = gpu.draw(&scene, &settings("float32"));
        let lamps =
            [point(DVec3::Y * 3.0, 9.0, None, Falloff::InverseSquare), directional(DVec3::new(0.1, 1.0, 0.0), 1.0)];
        scene.lights = lamps.to_vec();
        let others = gpu.draw(&scene, &settings("float32"));
        // The sun is listed last, and is the only one that casts.
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
    Texture {
        name: "half a hole".into(),
        size: [64, 64],
        color_space: ColorSpace::Srgb,
        sampler: Default::default(),
        texels,
    }
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
            let place = crate::common::stage::seen(picture.size, x, y).x;
            let found = nits(&picture, x, y).x;
            if place < -0.1 {
                assert!(found > 0.1, "({x}, {y}): light falls through the hole");
            } else if place > 0.1 && place < 0.9 {
                assert_eq!(found, 0.0, "({x}, {y}): the sheet casts a shadow");
            }
        }
    });
}

/// The wall z = 0 in the light of `light`, and a sheet before it at z = 1 that covers x > 0, seen from between them.
fn wall_behind_a_sheet(light: Light, sheet: Material) -> Scene {
    let mut scene = plane(lambert(1.0), vec![Light { casts_shadow: true, ..light }]);
    add(&mut scene, rectangle([0.0, -2.0], [2.5, 2.0], 1.0), sheet, DAffine3::IDENTITY);
    scene.camera.near = 1.1;
    scene
}

/// Lights at z = 3 above the axis, of each kind.
fn above() -> [(&'static str, Light); 4] {
    let place = DVec3::Z * 3.0;
    [
        ("sun", directional(DVec3::Z, 3.0)),
        ("point", point(place, 30.0, None, Falloff::InverseSquare)),
        ("spot", spot(place, 30.0, 30.0, 50.0)),
        ("wide spot", spot(place, 30.0, 70.0, 80.0)),
    ]
}

fn square(shadows: ShadowSettings) -> Settings {
    Settings { shadows, ..exact(64, 64) }
}

/// Share of the light to the left and to the right of the axis, away from it.
fn sides(gpu: &Gpu, scene: &Scene, settings: &Settings) -> (f64, f64) {
    let bare = Settings { shadows: ShadowSettings { enabled: false, ..settings.shadows }, ..settings.clone() };
    let (shaded, bare) = (gpu.draw(scene, settings), gpu.draw(scene, &bare));
    let mean = |right: bool| {
        let own: Vec<f64> = places(&shaded)
            .filter(|&(x, y)| {
                let place = crate::common::stage::seen(shaded.size, x, y);
                place.x.abs() > 0.1 && (place.x > 0.0) == right && nits(&bare, x, y).x > 0.0
            })
            .map(|(x, y)| nits(&shaded, x, y).x / nits(&bare, x, y).x)
            .collect();
        assert!(own.len() > 1000, "{}", own.len());
        own.iter().sum::<f64>() / own.len() as f64
    };
    (mean(false), mean(true))
}

#[test]
fn a_mask_casts_its_holes_in_the_light_of_every_kind() {
    on_gpu(|gpu| {
        for (name, light) in above() {
            let masked = Material {
                base_color_texture: Some(0),
                alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
                two_sided: true,
                ..lambert(1.0)
            };
            let mut scene = wall_behind_a_sheet(light, masked);
            // The sheet covers both sides, with its hole on the left.
            scene.objects[1].transform = DAffine3::from_translation(DVec3::X * -1.25);
            scene.textures.push(half_a_hole());
            let (left, right) = sides(gpu, &scene, &square(ShadowSettings::default()));
            assert_eq!((left, right), (1.0, 0.0), "{name}");
        }
    });
}

#[test]
fn one_sided_casters_cast_with_the_side_that_the_light_sees() {
    on_gpu(|gpu| {
        let turned = DAffine3::from_rotation_y(PI) * DAffine3::from_translation(DVec3::new(-2.5, 0.0, -2.0));
        let mirrored = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)) * DAffine3::from_translation(DVec3::X * -2.5);
        for (name, light) in above() {
            // The sheet's front is turned to +Z, where the light is; turned about its back is; a mirrored front is still the front.
            for (transform, front_is_lit) in [(DAffine3::IDENTITY, true), (turned, false), (mirrored, true)] {
                for (casts, dark) in
                    [(CastsShadow::Yes, true), (CastsShadow::Front, front_is_lit), (CastsShadow::No, false)]
                {
                    let mut scene = wall_behind_a_sheet(light.clone(), lambert(1.0));
                    (scene.objects[1].casts_shadow, scene.objects[1].transform) = (casts, transform);
                    let found = sides(gpu, &scene, &square(ShadowSettings::default()));
                    let expected = (1.0, if dark { 0.0 } else { 1.0 });
                    assert_eq!(found, expected, "{name}, {casts:?}, front to the light: {front_is_lit}");
                }
            }
        }
    });
}

#[test]
#[ignore = "test-all: shadows of one more kind of scene"]
fn an_object_that_receives_no_shadow_is_lit_and_the_others_are_not() {
    on_gpu(|gpu| {
        let lights = above();
        for (turn, layout) in
            ["lean", "fat", "float32", "lean,material=rgba16f", "fat,material=rgba8"].into_iter().enumerate()
        {
            for (name, light) in some_in_turn(&lights.iter().collect::<Vec<_>>(), turn, 2) {
                for receives in [true, false] {
                    let mut scene = wall_behind_a_sheet(light.clone(), lambert(1.0));
                    scene.objects[0].receives_shadow = receives;
                    let settings = Settings { gbuffer: gbuffer(layout), ..square(ShadowSettings::default()) };
                    let found = sides(gpu, &scene, &settings);
                    assert_eq!(
                        found,
                        (1.0, if receives { 0.0 } else { 1.0 }),
                        "{name}, {layout}, receives: {receives}"
                    );
                }
            }
        }
    });
}

#[test]
fn what_stands_before_the_near_plane_casts_as_well() {
    on_gpu(|gpu| {
        // Half the wall's light is taken far away, where no map of the wall reaches.
        for height in [10.0, 300.0, 1e5] {
            let mut scene = plane(lambert(1.0), vec![sun(DVec3::Z, 3.0)]);
            add(&mut scene, rectangle([0.0, -4.0], [9.0, 4.0], height), lambert(1.0), DAffine3::IDENTITY);
            for filter in [ShadowFilter::Box3, ShadowFilter::Pcss] {
                let shadows = ShadowSettings { filter, ..ShadowSettings::default() };
                assert_eq!(sides(gpu, &scene, &square(shadows)), (1.0, 0.0), "{height} m, {filter}");
            }
        }
    });
}

#[test]
#[ignore = "test-all: shadows of one more kind of scene"]
fn what_hangs_close_over_a_lamp_in_a_huge_scene_casts_as_well() {
    on_gpu(|gpu| {
        // Half a metre from the lamps, in a scene of 100 km.
        let place = DVec3::Z * 1.5;
        let lamps = [
            ("point", point(place, 30.0, None, Falloff::InverseSquare)),
            ("point with a range", point(place, 30.0, Some(1e5), Falloff::InverseSquare)),
            ("spot", spot(place, 30.0, 30.0, 58.0)),
            ("wide spot", spot(place, 30.0, 70.0, 80.0)),
        ];
        for (turn, (name, light)) in lamps.into_iter().enumerate() {
            let mut scene = wall_behind_a_sheet(light, lambert(1.0));
            let far = DAffine3::from_translation(DVec3::X * 1e5);
            add(&mut scene, shapes::cuboid([1.0; 3]), lambert(1.0), far);
            for (row, &(filter_name, filter)) in ShadowFilter::NAMES.iter().enumerate() {
                for &size in one_of(&[0.0, 0.001], turn + row) {
                    scene.lights[0].size = size;
                    let shadows = ShadowSettings { filter, ..ShadowSettings::default() };
                    let found = sides(gpu, &scene, &square(shadows));
                    assert_eq!(found, (1.0, 0.0), "{name} of {size} m, {filter_name}");
                }
            }
        }
    });
}

#[test]
fn lights_beyond_the_budget_are_named_and_shine_without_a_shadow() {
    on_gpu(|gpu| {
        let mut scene = wall_behind_a_sheet(above()[0].1.clone(), lambert(1.0));
        scene.lights =
            above().into_iter().map(|(name, light)| Light { name: name.into(), casts_shadow: true, ..light }).collect();
        // Layers of 4 MiB: one for the sun, one for the spot; none for twelve faces.
        let shadows = ShadowSettings { size: 1024, budget: 8, cascades: 1, ..ShadowSettings::default() };
        let renderer = gpu.renderer(&scene, &square(shadows));
        let warnings = renderer.plan().warnings().join("\n");
        assert!(warnings.contains("point, wide spot") && warnings.contains("budget of 8 MiB"), "{warnings}");
        let part = renderer.plan().parts().iter().find(|part| part.name.starts_with("shadow")).expect("a part");
        assert!(
            part.reason.contains("sun (1 map), spot (1 map)") && part.reason.contains(&warnings),
            "{}",
            part.reason
        );
        assert_eq!(part.bytes, 8 << 20);
        let found = gpu.draw(&scene, &square(shadows));
        for light in &mut scene.lights {
            light.casts_shadow = ["sun", "spot"].contains(&light.name.as_str());
        }
        let expected = gpu.draw(&scene, &square(shadows));
        assert_identical(&found, &expected, "as if the others had not asked");
        assert!(gpu.renderer(&scene, &square(shadows)).plan().warnings().is_empty());
    });
}

/// Every kind of light with a shadow over a floor with two blocks.
fn yard() -> Scene {
    let mut scene = floor_and_block(SUNS[1], DVec3::ZERO);
    let small = DAffine3::from_translation(DVec3::new(2.5, 0.5, 1.5));
    add(&mut scene, shapes::cuboid([0.5, 1.0, 0.5]), lambert(ALBEDO), small);
    let place = DVec3::new(-2.0, 3.0, 1.0);
    let kind = LightKind::Spot {
        position: place,
        direction: -place.normalize(),
        inner_angle_degrees: 20.0,
        outer_angle_degrees: 40.0,
        range: None,
        falloff: Falloff::InverseSquare,
    };
    let down = Light { kind, ..spot(place, 20.0, 20.0, 40.0) };
    // The lamp reaches the large block, not the small one.
    let lamp = point(DVec3::new(-0.5, 2.6, 0.2), 8.0, Some(3.0), Falloff::InverseSquare);
    scene.lights.extend([down, lamp].map(|light| Light { casts_shadow: true, ..light }));
    scene
}

fn frame(renderer: &mut Renderer, camera: &Camera) -> (Picture, DrawCounts) {
    renderer.render(camera).unwrap_or_else(|error| panic!("{error}"));
    let drawn = renderer.wait().unwrap_or_else(|error| panic!("{error}")).drawn;
    (renderer.read_back().unwrap_or_else(|error| panic!("{error}")), drawn)
}

#[test]
fn a_map_is_drawn_again_only_when_something_in_it_moved_and_the_picture_is_the_same() {
    on_gpu(|gpu| {
        let scene = yard();
        let settings = |cache| Settings {
            shadows: ShadowSettings { cache, ..settings("lean").shadows },
            // Every map, whether or not anything is seen in it.
            keep: Keep::NONE.with(OptionalPart::IdleCasters),
            ..settings("lean")
        };
        let (mut cached, mut plain) = (gpu.renderer(&scene, &settings(true)), gpu.renderer(&scene, &settings(false)));
        let mut camera = scene.camera;
        let mut both = |what: &str, camera: &Camera, change: &dyn Fn(&mut Renderer)| {
            change(&mut cached);
            change(&mut plain);
            let ((picture, drawn), (expected, all)) = (frame(&mut cached, camera), frame(&mut plain, camera));
            assert_identical(&picture, &expected, what);
            assert_eq!(all.shadow_maps_drawn, all.shadow_maps, "{what}: without the cache all are drawn");
            assert_eq!(drawn.shadow_maps, all.shadow_maps, "{what}");
            println!("{what}: {} of {} maps", drawn.shadow_maps_drawn, drawn.shadow_maps);
            (drawn.shadow_maps_drawn, drawn.shadow_maps)
        };
        let nothing = |_: &mut Renderer| {};
        let (drawn, maps) = both("the first frame", &camera, &nothing);
        assert!(drawn == maps && maps >= 8, "{drawn} of {maps}");
        for _ in 0..3 {
            assert_eq!(both("a still frame", &camera, &nothing).0, 0);
        }
        // The small block stands in the sun's maps and the spot's, and beyond the lamp's range.
        let aside = DAffine3::from_translation(DVec3::new(2.5, 0.5, 1.6));
        let (drawn, maps) = both("the small block moves", &camera, &|renderer| {
            renderer.move_object(&mut scene.clone(), 2, &aside).unwrap_or_else(|error| panic!("{error}"));
        });
        assert!((1..=maps - 6).contains(&drawn), "{drawn} of {maps}");
        // The sun and the spot do not depend on the lamp.
        let mut lamp = scene.lights[2].clone();
        let (drawn, _) = both("the lamp moves", &camera, &|renderer| {
            let mut lamp = lamp.clone();
            lamp.kind = point(DVec3::new(-0.4, 2.6, 0.2), 8.0, Some(3.0), Falloff::InverseSquare).kind;
            renderer.set_light(&mut scene.clone(), 2, &lamp).unwrap_or_else(|error| panic!("{error}"));
        });
        assert_eq!(drawn, 6);
        lamp.kind = point(DVec3::new(-0.4, 2.6, 0.2), 8.0, Some(3.0), Falloff::InverseSquare).kind;
        lamp.intensity = 3.0;
        let (drawn, _) = both("the lamp weakens", &camera, &|renderer| {
            renderer.set_light(&mut scene.clone(), 2, &lamp).unwrap_or_else(|error| panic!("{error}"));
        });
        assert_eq!(drawn, 0);
        for step in 0..4 {
            camera.position += DVec3::new(0.3, 0.05, -0.4);
            let (drawn, _) = both(&format!("the camera moves, {step}"), &camera, &nothing);
            assert!(drawn <= 3, "{drawn}: only cascades follow the camera");
        }
    });
}

#[test]
fn every_filter_gives_a_share_of_the_light() {
    on_gpu(|gpu| {
        let mut scene = yard();
        scene.lights.iter_mut().for_each(|light| light.size = 0.3);
        for &(name, filter) in ShadowFilter::NAMES {
            let shadows = ShadowSettings { filter, size: 256, ..ShadowSettings::default() };
            let mut partly = 0;
            for light in &scene.lights {
                let alone = Scene { lights: vec![light.clone()], ..scene.clone() };
                let settings = Settings { shadows, ..settings("float32") };
                let off = Settings { shadows: ShadowSettings { enabled: false, ..shadows }, ..settings.clone() };
                let (shaded, bare) = (gpu.draw(&alone, &settings), gpu.draw(&alone, &off));
                let (mut dark, mut lit) = (0, 0);
                for (x, y) in places(&shaded).filter(|&(x, y)| nits(&bare, x, y).x > 1e-4) {
                    let share = nits(&shaded, x, y).x / nits(&bare, x, y).x;
                    assert!((0.0..=1.0 + 1e-6).contains(&share), "{name}, {}: {share} at ({x}, {y})", light.name);
                    dark += usize::from(share == 0.0);
                    lit += usize::from(share > 1.0 - 1e-6);
                    partly += usize::from(share > 0.0 && share < 1.0 - 1e-6);
                }
                assert!(dark > 20 && lit > 100, "{name}: {dark} dark, {lit} lit");
            }
            assert_eq!(partly > 0, filter != ShadowFilter::None, "{name}: {partly} pixels are partly lit");
        }
    });
}

#[test]
#[ignore = "test-all: other tests draw the same frames under the layer"]
fn shadows_of_every_kind_are_silent_in_every_light_path_and_view() {
    on_gpu_in_both_modes(|gpu| {
        let scene = yard();
        let base = Settings { output: Output::Srgb8, exposure: Some(2.0), ..settings("lean") };
        let pictures: Vec<Picture> =
            [LightPath::Loop, LightPath::PerLight, LightPath::Volumes, LightPath::Clustered, LightPath::Compute]
                .into_iter()
                .map(|light_path| {
                    let mut renderer = gpu.renderer(&scene, &Settings { light_path, ..base.clone() });
                    let mut camera = scene.camera;
                    for _ in 0..3 {
                        camera.position.x += 0.2;
                        frame(&mut renderer, &camera);
                    }
                    frame(&mut renderer, &camera).0
                })
                .collect();
        for other in &pictures[1..] {
            let off = bytes(&pictures[0]).iter().zip(bytes(other)).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(off <= Some(1), "{off:?}");
        }
        for view in [View::ShadowMap, View::Lighting] {
            let mut renderer = gpu.renderer(&scene, &Settings { view, ..base.clone() });
            let shown = frame(&mut renderer, &scene.camera).0;
            let codes: std::collections::BTreeSet<u8> = bytes(&shown).iter().copied().collect();
            assert!(codes.len() > 20, "{view}: {} codes", codes.len());
        }
    });
}
