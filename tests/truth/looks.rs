//! Objects of one mesh and material that look each in its way, against the truth in 64 bits: cells of atlases, tints, highlights. Cells do not bleed
//! into each other, however far away or askew they are seen.

use crate::common::gpu::{Gpu, nits, on_gpu, places};
use crate::common::some_in_turn;
use crate::common::stage::{add, directional, exact, lambert, open, rectangle, stage, sun};
use crate::materials::{PATHS, WRAPS, assert_near, nits_of, writes_the_picture};
use afterlight::frame::Picture;
use afterlight::scene::{
    AlphaMode, Camera, ColorSpace, Filter, Keep, LightPath, Look, Material, Sampler, Scene, Settings, Texels, Texture,
    UvMap, Wrap,
};
use afterlight_truth::reference::{CameraView, Mode, Reference, Smith, TruthOptions};
use glam::{DAffine3, DVec2, DVec3, Vec3};

/// Returns a texture of cells, each of `width` x `height` texels, by a function of the cell and of the texel in it.
fn atlas(
    [rows, columns]: [u32; 2],
    [width, height]: [u32; 2],
    sampler: Sampler,
    texel: impl Fn(u32, [u32; 2]) -> [u8; 4],
) -> Texture {
    let size = [columns * width, rows * height];
    let at = |index: u32| {
        let [x, y] = [index % size[0], index / size[0]];
        texel(y / height * columns + x / width, [x % width, y % height])
    };
    let texels = (0..size[0] * size[1]).flat_map(at).collect();
    Texture { name: "atlas".into(), size, color_space: ColorSpace::Linear, sampler, texels }
}

fn sampled(wrap: Wrap, filter: Filter) -> Sampler {
    Sampler { wrap: [wrap; 2], magnify: filter, minify: filter, levels: Some(filter) }
}

/// Texels that differ from cell to cell and within a cell.
fn motley(cell: u32, [x, y]: [u32; 2]) -> [u8; 4] {
    let hash = |salt: u32| ((cell * 7919 + x * 131 + y * 31 + salt).wrapping_mul(2_654_435_761) >> 24) as u8;
    [hash(1), hash(2), hash(3), 80 + (hash(4) >> 1)]
}

/// Squares in rows of `across`, all of one mesh and one material, which fill the picture; each as `look` says.
fn squares(across: u32, material: Material, texture: Texture, look: impl Fn(u32) -> Look) -> Scene {
    let mut scene = stage();
    scene.lights = vec![directional(DVec3::new(0.3, 0.2, 1.0), 3.0)];
    scene.textures = vec![texture];
    add(&mut scene, rectangle([-0.5, -0.5], [0.5, 0.5], 0.0), material, DAffine3::IDENTITY);
    // Coordinates from a third before an image to two thirds behind it.
    scene.meshes[0].uvs.iter_mut().flatten().for_each(|uv| *uv = *uv * 2.0 - 1.0 / 3.0);
    let square = scene.objects[0].clone();
    let edge = 2.0 / f64::from(across);
    scene.objects = (0..across * across)
        .map(|index| {
            let mut object = square.clone();
            let [x, y] = [index % across, index / across].map(|at| (f64::from(at) + 0.5) * edge - 1.0);
            object.transform = DAffine3::from_scale_rotation_translation(
                DVec3::splat(edge * 0.9),
                glam::DQuat::IDENTITY,
                DVec3::new(x, -y, 0.0),
            );
            object.look = Some(look(index));
            object
        })
        .collect();
    scene
}

fn paper(atlas: [u32; 2]) -> Material {
    Material { atlas, base_color_texture: Some(0), ..lambert(1.0) }
}

#[test]
#[ignore = "test-all: one more light path, output or camera"]
fn instances_show_their_cells_tints_and_highlights_on_every_light_path() {
    on_gpu(|gpu| {
        let look = |index: u32| Look {
            cell: index * 5 % 12,
            tint: Vec3::new(1.0, 0.02 * (index % 7) as f32, 1.0 / (1.0 + index as f32)),
            selected: index % 3 == 1,
        };
        let blend = |alpha_mode| Material { alpha_mode, alpha: 0.7, ..paper([3, 4]) };
        let glow = Material { emissive: Vec3::new(0.3, 0.1, 0.5), emissive_texture: Some(0), ..paper([3, 4]) };
        let kinds = [
            ("opaque", paper([3, 4])),
            ("unlit", Material { unlit: true, ..paper([3, 4]) }),
            ("glowing", glow),
            ("masked", Material { alpha_mode: AlphaMode::Mask { cutoff: 0.55 }, ..paper([3, 4]) }),
            ("blended", blend(AlphaMode::Blend)),
            ("glass", blend(AlphaMode::Glass)),
        ];
        for (index, wrap) in WRAPS.into_iter().enumerate() {
            for (number, (kind, material)) in kinds.iter().enumerate() {
                let texture = atlas([3, 4], [5, 3], sampled(wrap, Filter::Nearest), motley);
                let scene = squares(4, material.clone(), texture, look);
                let blends = material.is_transparent();
                for path in some_in_turn(&PATHS, index + number, 5) {
                    let path = if blends && writes_the_picture(path) || !gpu.takes(path, &scene) {
                        LightPath::Loop
                    } else {
                        path
                    };
                    let what = format!("{kind}, {wrap:?}, {path}");
                    assert_near(gpu, &scene, &nits_of(path), [1e-5, 2e-5], 0.93, &what);
                }
            }
        }
    });
}

/// Without textures, and without light: an unlit black surface still shows that it is selected.
#[test]
#[ignore = "test-all: one more light path, output or camera"]
fn tints_and_highlights_need_no_texture() {
    on_gpu(|gpu| {
        let texture = atlas([1, 1], [2, 2], Sampler::DEFAULT, motley);
        let look =
            |index: u32| Look { cell: 0, tint: Vec3::splat(1e-3 * index as f32), selected: index.is_multiple_of(2) };
        for (what, material) in [
            ("lambert", lambert(0.8)),
            ("metal", Material { metallic: 1.0, roughness: 0.6, ..Material::default() }),
            ("unlit", Material { unlit: true, ..lambert(0.8) }),
            ("unlit and black", Material { unlit: true, ..lambert(0.0) }),
        ] {
            let scene = squares(3, material, texture.clone(), look);
            for path in [LightPath::Loop, LightPath::Forward, LightPath::Compute, LightPath::Visibility] {
                assert_near(gpu, &scene, &nits_of(path), [2e-5, 2e-4], 0.93, &format!("{what}, {path}"));
            }
        }
    });
}

/// Draws a scene of pure colours. Returns the number of pixels where something is seen, and the greatest value of a channel that is black in the
/// truth, as a share of the pixel's brightest.
fn bleeding(gpu: &Gpu, scene: &Scene, settings: &Settings) -> (usize, f64) {
    bleeding_of(gpu.draw(scene, settings), scene)
}

fn bleeding_of(picture: Picture, scene: &Scene) -> (usize, f64) {
    let view = CameraView { camera: scene.camera, size: picture.size };
    let options = TruthOptions { mode: Mode::Point, smith: Smith::HeightCorrelated };
    let reference = Reference::new(scene).expect("a scene");
    let truth = reference.render(&view, &options, &|_, _| {});
    let (mut seen, mut most) = (0, 0.0f64);
    for (x, y) in places(&picture) {
        let expected = DVec3::from_array(truth.radiance[(y * picture.size[0] + x) as usize]);
        let found = nits(&picture, x, y);
        // Along an edge one of the two sees the background, which is black.
        if expected.max_element() > 0.0 && found.max_element() > 0.0 {
            seen += 1;
            let stray = (0..3).filter(|&channel| expected[channel] == 0.0).map(|channel| found[channel]);
            most = stray.map(|stray| stray / found.max_element()).fold(most, f64::max);
        }
    }
    (seen, most)
}

#[test]
#[ignore = "test-all: one more light path, output or camera"]
fn no_colour_of_another_cell_is_seen_at_any_distance_angle_and_anisotropy() {
    on_gpu(|gpu| {
        // Pure red, green and blue in turn; neighbours differ along rows, columns and diagonals. Edges are no powers of two.
        let pure = |cell: u32, _: [u32; 2]| {
            let mut texel = [0, 0, 0, 255];
            texel[((cell % 5 + 2 * (cell / 5)) % 3) as usize] = 255;
            texel
        };
        for (filter, levels) in [
            (Filter::Linear, Some(Filter::Linear)),
            (Filter::Linear, Some(Filter::Nearest)),
            (Filter::Linear, None),
            (Filter::Nearest, Some(Filter::Nearest)),
        ] {
            for wrap in WRAPS {
                let sampler = Sampler { levels, ..sampled(wrap, filter) };
                let texture = atlas([4, 5], [12, 20], sampler, pure);
                let look = |index: u32| Look { cell: index % 20, ..Look::PLAIN };
                let mut scene = squares(6, paper([4, 5]), texture, look);
                let cameras = [
                    // Magnified; as large as the texels; down to the smallest level; at a low angle; at a lower one from the side.
                    ("near", DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.1, 0.2, 0.0)),
                    ("before it", DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO),
                    ("far", DVec3::new(0.0, 0.0, 60.0), DVec3::ZERO),
                    ("low", DVec3::new(0.0, -1.5, 0.15), DVec3::ZERO),
                    ("aside", DVec3::new(-1.6, 0.4, 0.05), DVec3::new(0.0, 0.1, 0.0)),
                ];
                for (what, eye, target) in cameras {
                    scene.camera = Camera { near: 0.01, ..Camera::looking_at(eye, target, DVec3::new(0.0, 0.8, 0.6)) };
                    for anisotropy in [1, 16] {
                        for light_path in [LightPath::Loop, LightPath::Forward] {
                            let settings = Settings { anisotropy, light_path, ..exact(97, 97) };
                            let (seen, most) = bleeding(gpu, &scene, &settings);
                            let what =
                                format!("{what}, {filter:?}, {levels:?}, {wrap:?}, {anisotropy} times, {light_path}");
                            assert!(seen >= 4, "{what}: nothing is seen");
                            assert!(most == 0.0, "{what}: {most:e} of another cell");
                        }
                    }
                }
            }
        }
    });
}

/// The measure of the test above notices bleeding: cells side by side in one image, each as a part of it, bleed from afar.
#[test]
fn cells_side_by_side_in_one_image_would_bleed() {
    on_gpu(|gpu| {
        let pure = |cell: u32, _: [u32; 2]| [[255, 0, 0, 255], [0, 255, 0, 255]][(cell % 2) as usize];
        let texture = atlas([1, 4], [8, 8], sampled(Wrap::Clamp, Filter::Linear), pure);
        let mut scene = squares(6, paper([1, 4]), texture, |index| Look { cell: index % 4, ..Look::PLAIN });
        scene.camera = Camera::looking_at(DVec3::new(0.0, 0.0, 12.0), DVec3::ZERO, DVec3::Y);
        scene.meshes[0].uvs.iter_mut().flatten().for_each(|uv| *uv = (*uv + 1.0 / 3.0) / 2.0);
        let mut parts = scene.clone();
        for (index, object) in parts.objects.iter_mut().enumerate() {
            let cell = object.look.take().map_or(0, |look| look.cell);
            let mut own = Material { atlas: [1, 1], ..scene.materials[0].clone() };
            let (scale, offset) = (DVec2::new(0.25, 1.0), DVec2::new(0.25 * f64::from(cell), 0.0));
            own.uv_maps[0] = UvMap { scale, offset, ..UvMap::IDENTITY };
            parts.materials.push(own);
            object.material = index + 1;
        }
        let settings = Settings { anisotropy: 1, ..exact(97, 97) };
        let [apart, beside] = [&scene, &parts].map(|drawn| bleeding_of(gpu.draw(drawn, &settings), &scene));
        assert!(apart.0 > 20 && beside.0 > 20, "{apart:?} {beside:?}");
        assert_eq!(apart.1, 0.0);
        assert!(beside.1 > 0.05, "{beside:?}");
    });
}

/// Loaders make levels of every texture, as do files of blocks: of an atlas they mix cells.
#[test]
fn levels_of_a_whole_sheet_are_not_looked_at() {
    on_gpu(|gpu| {
        let texture = atlas([2, 4], [8, 16], sampled(Wrap::Repeat, Filter::Linear), motley);
        let white = |level: u32| vec![255; 4 * (32usize >> level).max(1).pow(2)];
        let levels = std::iter::once(texture.rgba8(0).into_owned()).chain((1..6).map(white)).collect();
        let with_levels = Texture { texels: Texels::Rgba8Levels(levels), ..texture.clone() };
        let draw = |atlas: [u32; 2], texture: &Texture| {
            let look = |index: u32| Look { cell: index % (atlas[0] * atlas[1]), ..Look::PLAIN };
            let mut scene = squares(6, paper(atlas), texture.clone(), look);
            scene.camera = Camera::looking_at(DVec3::new(0.0, 0.0, 12.0), DVec3::ZERO, DVec3::Y);
            gpu.draw(&scene, &exact(97, 97))
        };
        assert!(draw([2, 4], &with_levels) == draw([2, 4], &texture), "levels of the sheet are seen in its cells");
        assert!(draw([1, 1], &with_levels) != draw([1, 1], &texture), "the test sees no level");
    });
}

/// More cells than an array of the device has layers: 65536 of one texel, of all of which some are shown.
#[test]
fn an_atlas_of_256_x_256_cells_shows_each_of_them() {
    on_gpu(|gpu| {
        let sampler = sampled(Wrap::Clamp, Filter::Nearest);
        let texture = atlas([256, 256], [1, 1], sampler, motley);
        // Each seen cell is of another row and column, and the first and the last are among them.
        let look = |index: u32| Look { cell: index * 257, ..Look::PLAIN };
        let scene = squares(16, paper([256, 256]), texture, look);
        assert_eq!(scene.objects[255].look.map(|look| look.cell), Some(65535));
        for path in [LightPath::Loop, LightPath::Forward] {
            assert_near(gpu, &scene, &nits_of(path), [1e-5, 2e-5], 0.85, &format!("65536 cells, {path}"));
        }
    });
}

/// The caster's own cell cuts the holes of its shadow.
#[test]
fn shadows_have_the_holes_of_the_casters_cells() {
    on_gpu(|gpu| {
        // Cell 0 is whole, cell 1 is nothing, cell 2 has a hole on the left, cell 3 on the right.
        let holes = |cell: u32, [x, _]: [u32; 2]| {
            let there = [true, false, x >= 4, x < 4][cell as usize];
            [200, 180, 90, if there { 255 } else { 0 }]
        };
        let texture = atlas([2, 2], [8, 8], sampled(Wrap::Clamp, Filter::Nearest), holes);
        let masked = Material { alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, two_sided: true, ..paper([2, 2]) };
        let look = |index: u32| Look { cell: index, ..Look::PLAIN };
        let mut scene = squares(2, masked, texture, look);
        scene.meshes[0].uvs.iter_mut().flatten().for_each(|uv| *uv = (*uv + 1.0 / 3.0) / 2.0);
        scene.objects.iter_mut().for_each(|object| {
            object.transform = DAffine3::from_translation(DVec3::Z * 0.5) * object.transform;
        });
        add(&mut scene, rectangle([-4.0, -4.0], [4.0, 4.0], 0.0), lambert(0.7), DAffine3::IDENTITY);
        scene.lights = vec![sun(DVec3::new(0.35, 0.3, 1.0), 3.0)];
        for path in [LightPath::Loop, LightPath::Forward] {
            let mut settings = nits_of(path);
            settings.shadows.size = 2048;
            settings.shadows.filter = afterlight::scene::ShadowFilter::None;
            assert_near(gpu, &scene, &settings, [1e-5, 2e-3], 0.9, &format!("shadows of cells, {path}"));
        }
    });
}

/// Looks that a plan keeps without need change nothing: an atlas of one cell draws the same as a plain texture.
#[test]
fn a_plan_with_looks_that_nobody_has_draws_the_same() {
    on_gpu(|gpu| {
        let scene = open("builtin:hall?detail=6");
        let settings = |keep| Settings { keep, ..crate::common::stage::own(&scene, 64, 48) };
        let plain = gpu.draw(&scene, &settings(Keep::NONE));
        let kept = gpu.draw(&scene, &settings(Keep::NONE.with(afterlight::scene::OptionalPart::Looks)));
        let (codes, place) = crate::common::compare::largest_code_difference(&plain, &kept);
        assert!(codes <= 1, "{codes} codes at {place:?}");
    });
}
