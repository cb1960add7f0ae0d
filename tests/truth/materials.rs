//! Features that only materials of glTF have, on the device against the truth in 64 bits: samplers, vertex colours, UV maps, unlit surfaces,
//! reflectances, coats.

use crate::common::compare::{assert_identical, largest_code_difference};
use crate::common::gpu::{Gpu, nits, on_gpu, places};
use crate::common::some_in_turn;
use crate::common::stage::{add, directional, display, exact, lambert, plane, point, rectangle, stage, sun};
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    AlphaMode, Anisotropy, Brdf, ColorSpace, Environment, Falloff, Filter, Keep, LightPath, Material, Mesh, Object,
    Sampler, Scene, Settings, Sheen, Texture, TextureSlot, ThinFilm, Transparency, UvMap, Wrap,
};
use afterlight_truth::reference::{CameraView, Mode, Reference, Smith, TruthOptions};
use glam::{DAffine3, DVec2, DVec3, Vec3};

const SIZE: [u32; 2] = [97, 97];
const POINT: TruthOptions = TruthOptions { mode: Mode::Point, smith: Smith::HeightCorrelated };
pub const PATHS: [LightPath; 6] = [
    LightPath::Forward,
    LightPath::Loop,
    LightPath::Compute,
    LightPath::Clustered,
    LightPath::Visibility,
    LightPath::PerLight,
];

/// Returns the paths that can draw a scene; in `make test` every third one, beginning with the one whose turn it is, so that each comes up among many scenes.
fn paths(gpu: &Gpu, scene: &Scene, turn: usize) -> Vec<LightPath> {
    let blends = scene.materials.iter().any(|own| own.is_transparent() || own.has_lobes(own.brdf));
    let takes = |&path: &LightPath| !(blends && writes_the_picture(path)) && gpu.takes(path, scene);
    let all: Vec<LightPath> = PATHS.into_iter().filter(takes).collect();
    some_in_turn(&all, turn, 3).collect()
}

/// Returns true if the path writes the picture, so that nothing can come after its lighting.
pub fn writes_the_picture(path: LightPath) -> bool {
    matches!(path, LightPath::Compute | LightPath::Visibility)
}

/// Returns the distances of pixels from the truth, relative to the brightest one, in order.
pub fn differences(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Vec<f64> {
    let picture = gpu.draw(scene, settings);
    let view = CameraView { camera: scene.camera, size: picture.size };
    let truth = Reference::new(scene).expect("a scene").render(&view, &POINT, &|_, _| {});
    let lit = |x: u32, y: u32| DVec3::from_array(truth.radiance[(y * picture.size[0] + x) as usize]);
    let brightest = places(&picture).map(|(x, y)| lit(x, y).max_element()).fold(0.0, f64::max);
    assert!(brightest > 0.0, "{}: the truth is black", scene.name);
    let off = |(x, y)| (nits(&picture, x, y) - lit(x, y)).abs().max_element() / brightest;
    let mut off: Vec<f64> = places(&picture).map(off).collect();
    off.sort_by(f64::total_cmp);
    off
}

/// Half of the pixels are within the first bound, and this share within the second.
pub fn assert_near(gpu: &Gpu, scene: &Scene, settings: &Settings, [half, most]: [f64; 2], share: f64, what: &str) {
    let off = differences(gpu, scene, settings);
    let at = |share: f64| off[((off.len() - 1) as f64 * share) as usize];
    println!("{what}: median {:.1e}, {share} {:.1e}, worst {:.1e}", at(0.5), at(share), at(1.0));
    assert!(at(0.5) <= half && at(share) <= most, "{what}: median {:.1e}, {share} {:.1e}", at(0.5), at(share));
}

pub fn nits_of(path: LightPath) -> Settings {
    // The truth looks at one place a pixel.
    Settings { light_path: path, anisotropy: 1, ..exact(SIZE[0], SIZE[1]) }
}

/// Texels that differ in all channels.
fn texture(sampler: Sampler) -> Texture {
    let texels = (0..16u32).flat_map(|i| [i * 16, 255 - i * 13, i * 97 % 256, 40 + i * 13].map(|code| code as u8));
    Texture { name: "motley".into(), size: [4, 4], color_space: ColorSpace::Linear, sampler, texels: texels.collect() }
}

fn sampled(wrap: [Wrap; 2], filter: Filter) -> Sampler {
    Sampler { wrap, magnify: filter, minify: filter, levels: Some(filter) }
}

/// The plane with a texture of which the camera sees (-1, -1) to (2, 2).
fn papered(material: Material, sampler: Sampler) -> Scene {
    let mut scene = plane(material, vec![directional(DVec3::new(0.3, 0.2, 1.0), 3.0)]);
    scene.meshes[0].uvs.iter_mut().flatten().for_each(|uv| *uv = (*uv - 0.5) * 12.0 + 0.5);
    scene.textures.push(texture(sampler));
    scene
}

pub const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];

#[test]
fn textures_wrap_and_are_magnified_as_their_samplers_say() {
    on_gpu(|gpu| {
        let paper = Material { base_color_texture: Some(0), ..lambert(1.0) };
        for (index, wrap) in WRAPS.into_iter().flat_map(|u| WRAPS.map(|v| [u, v])).enumerate() {
            for filter in [Filter::Nearest, Filter::Linear] {
                let scene = papered(paper.clone(), sampled(wrap, filter));
                let paths = paths(gpu, &scene, index);
                let settings = nits_of(paths[index % paths.len()]);
                // A sampler has 8 bits for the share of a texel at least, and the edges of nearest ones run along pixels.
                let most = if filter == Filter::Nearest { 1e-5 } else { 8e-3 };
                assert_near(gpu, &scene, &settings, [4e-3, most], 0.93, &format!("{wrap:?} {filter:?}"));
            }
        }
    });
}

#[test]
fn textures_of_one_material_have_samplers_of_their_own() {
    on_gpu(|gpu| {
        let own = Material {
            base_color_texture: Some(0),
            emissive_texture: Some(1),
            emissive: Vec3::splat(0.4),
            ..lambert(1.0)
        };
        let mut scene = papered(own, sampled([Wrap::Clamp; 2], Filter::Nearest));
        scene.textures.push(texture(sampled([Wrap::Mirror, Wrap::Repeat], Filter::Linear)));
        for path in paths(gpu, &scene, 0) {
            let what = format!("two samplers, {path}");
            assert_near(gpu, &scene, &nits_of(path), [4e-3, 8e-3], 0.93, &what);
        }
        let [lean, full] = [Keep::NONE, Keep::ALL].map(|keep| {
            gpu.draw(&scene, &Settings { keep, light_path: LightPath::Clustered, ..display(SIZE[0], SIZE[1]) })
        });
        let (codes, place) = largest_code_difference(&lean, &full);
        assert!(codes <= 1, "{codes} codes at {place:?} with everything kept");
    });
}

/// A colour that differs from vertex to vertex, of this alpha on the left and another on the right.
fn paint(mesh: &mut Mesh, alphas: [f32; 2]) {
    let color = |&[x, y, z]: &[f32; 3]| {
        let share = |place: f32| (0.5 + place).clamp(0.0, 1.0);
        let alpha = alphas[0] + (alphas[1] - alphas[0]) * share(x);
        [share(y), 0.25 + 0.5 * share(x), share(z + y), alpha]
    };
    mesh.colors = mesh.positions.iter().map(color).collect();
}

/// A square before the plane, and a light that throws its shadow there.
fn sheet(material: Material) -> Scene {
    let mut scene = plane(lambert(0.6), vec![sun(DVec3::new(0.3, 0.2, 1.0), 3.0)]);
    add(&mut scene, rectangle([-0.5, -0.5], [0.5, 0.5], 0.3), material, DAffine3::IDENTITY);
    paint(&mut scene.meshes[1], [0.1, 0.9]);
    scene
}

#[test]
#[ignore = "test-all: one more light path, output or camera"]
fn colours_of_vertices_multiply_the_base_colour_and_alpha() {
    on_gpu(|gpu| {
        let textured = Material { base_color_texture: Some(0), ..Material::default() };
        let mapped = Material { normal_texture: Some(0), ..textured.clone() };
        let mask = AlphaMode::Mask { cutoff: 0.5 };
        let cut = Material { alpha_mode: mask, ..lambert(0.9) };
        let cases = [
            ("plain", lambert(0.9)),
            ("textured", textured.clone()),
            ("with a normal map", mapped),
            ("unlit", Material { unlit: true, ..lambert(0.9) }),
            ("unlit and textured", Material { unlit: true, ..textured.clone() }),
            ("cut out", cut.clone()),
            ("cut out by a texture as well", Material { alpha_mode: mask, ..textured.clone() }),
            ("blended", Material { alpha_mode: AlphaMode::Blend, ..textured.clone() }),
            ("glass", Material { alpha_mode: AlphaMode::Glass, ..lambert(0.9) }),
        ];
        for (turn, (name, material)) in cases.into_iter().enumerate() {
            let mut scene = sheet(material.clone());
            scene.textures.push(texture(Sampler::DEFAULT));
            for path in paths(gpu, &scene, turn) {
                // The edges of shadows and holes are among the other pixels.
                let bound = if scene.materials[1].textures().next().is_some() { 8e-3 } else { 1e-5 };
                assert_near(gpu, &scene, &nits_of(path), [bound, bound], 0.93, &format!("{name}, {path}"));
            }
        }
        // White ones change nothing and are not there.
        let mut white = sheet(lambert(0.9));
        white.meshes[1].colors.clear();
        let without = gpu.draw(&white, &nits_of(LightPath::Clustered));
        white.meshes[1].colors = vec![[1.0; 4]; white.meshes[1].positions.len()];
        assert_identical(&without, &gpu.draw(&white, &nits_of(LightPath::Clustered)), "white vertices");
        assert!(!gpu.renderer(&white, &nits_of(LightPath::Clustered)).plan().streams.colors);
        white.meshes[1].colors = vec![[0.5; 4]; white.meshes[1].positions.len()];
        assert!(gpu.renderer(&white, &nits_of(LightPath::Clustered)).plan().streams.colors);
    });
}

/// With every slot's texture on the other coordinates, turned, moved and scaled.
fn mapped(base: Material) -> Material {
    let mut material = base;
    for (index, slot) in TextureSlot::ALL.into_iter().enumerate() {
        let turn = 0.3 * index as f64;
        material.uv_maps[slot as usize] = UvMap {
            set: (index % 2) as u8,
            offset: DVec2::new(0.25 * turn, -3.0),
            rotation: turn,
            scale: DVec2::new(0.7, -0.4),
        };
    }
    material
}

#[test]
fn textures_lie_on_meshes_as_their_uv_maps_say() {
    on_gpu(|gpu| {
        let every = |brdf| {
            let mut material = Material {
                brdf,
                roughness: 1.0,
                metallic: 1.0,
                emissive: Vec3::splat(0.3),
                shininess: 20.0,
                specular: if brdf == Brdf::Phong { Vec3::splat(0.4) } else { Vec3::ZERO },
                base_color: Vec3::ONE,
                ..Material::default()
            };
            TextureSlot::ALL.into_iter().for_each(|slot| *material.texture_mut(slot) = Some(0));
            mapped(material)
        };
        let cases = [
            ("lambert", mapped(Material { base_color_texture: Some(0), ..lambert(1.0) })),
            ("cook-torrance", every(Brdf::CookTorrance)),
            ("phong", every(Brdf::Phong)),
            ("blended", Material { alpha_mode: AlphaMode::Blend, ..every(Brdf::CookTorrance) }),
            ("unlit", Material { unlit: true, ..every(Brdf::CookTorrance) }),
        ];
        for (turn, (name, material)) in cases.into_iter().enumerate() {
            let mut scene = papered(material.clone(), sampled([Wrap::Repeat, Wrap::Mirror], Filter::Linear));
            let mesh = &mut scene.meshes[0];
            mesh.uvs_1 = mesh.uvs.iter().map(|[u, v]| [v * 0.5 + 0.1, u * 0.6]).collect();
            mesh.compute_tangents();
            scene.environment.ambient = Vec3::splat(0.2);
            for path in paths(gpu, &scene, turn) {
                let settings = nits_of(path);
                assert_near(gpu, &scene, &settings, [8e-3, 0.03], 0.97, &format!("{name}, {path}"));
            }
        }
    });
}

/// The map of the base colour's slot, in the shadow map as well, against a mesh with such coordinates.
#[test]
fn a_uv_map_is_as_coordinates_that_are_mapped_before() {
    on_gpu(|gpu| {
        let mask = Material {
            base_color_texture: Some(0),
            alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
            two_sided: true,
            ..lambert(0.9)
        };
        for set in [0, 1] {
            let map = UvMap { set, offset: DVec2::new(0.3, -1e6), rotation: 0.5, scale: DVec2::new(1.5, 0.75) };
            let mut own = mask.clone();
            own.uv_maps[TextureSlot::BaseColor as usize] = map;
            let mut scene = sheet(own);
            scene.meshes[1].colors.clear();
            scene.textures.push(texture(Sampler::DEFAULT));
            scene.meshes[1].uvs_1 = scene.meshes[1].uvs.iter().map(|[u, v]| [1.0 - v, u * 0.5]).collect();
            let mut baked = scene.clone();
            let mesh = &mut baked.meshes[1];
            let coordinates = if set == 1 { &mesh.uvs_1 } else { &mesh.uvs };
            // A whole number of images less.
            let rows = UvMap { offset: DVec2::new(0.3, 0.0), ..map }.rows();
            let place =
                |[u, v]: &[f32; 2]| rows.map(|row| row.dot(DVec3::new(f64::from(*u), f64::from(*v), 1.0)) as f32);
            mesh.uvs = coordinates.iter().map(place).collect();
            baked.materials[1] = mask.clone();
            for path in [LightPath::Clustered, LightPath::Forward] {
                let settings = nits_of(path);
                let [mapped, mapped_before] = [&scene, &baked].map(|scene| gpu.draw(scene, &settings));
                let off = |&(x, y): &(u32, u32)| {
                    (nits(&mapped, x, y) - nits(&mapped_before, x, y)).abs().max_element() > 8e-3
                };
                let count = places(&mapped).filter(off).count();
                // Texels beside a hole's edge, by rounding; a sampler has 8 bits for the share of a texel at least.
                assert!(count < 40, "set {set}, {path}: {count} pixels differ");
            }
        }
    });
}

/// A normal map is as steep on an object that its transform enlarges as on a mesh that was that large before.
#[test]
fn a_normal_map_leans_as_far_at_any_scale() {
    on_gpu(|gpu| {
        for scale in [0.25, 6.0] {
            let material = Material { normal_texture: Some(0), base_color: Vec3::ONE, ..lambert(1.0) };
            let mut baked = papered(material, sampled([Wrap::Repeat; 2], Filter::Linear));
            baked.meshes[0].compute_tangents();
            let mut scaled = baked.clone();
            let mesh = &mut scaled.meshes[0];
            mesh.positions.iter_mut().flatten().for_each(|at| *at /= scale as f32);
            mesh.origin /= scale;
            mesh.bounds = mesh.compute_bounds();
            mesh.compute_tangents();
            scaled.objects[0].transform.matrix3 *= scale;
            let reference = |scene: &Scene| {
                let view = CameraView { camera: scene.camera, size: [SIZE[0], SIZE[1]] };
                Reference::new(scene).expect("a scene").render(&view, &POINT, &|_, _| {}).radiance
            };
            let [before, after] = [&baked, &scaled].map(reference);
            let worst = before.as_flattened().iter().zip(after.as_flattened()).map(|(a, b)| (a - b).abs());
            assert!(worst.fold(0.0, f64::max) < 1e-4, "{scale}");
            assert!(before.iter().any(|light| (light[0] - before[0][0]).abs() > 0.01), "the map is not seen");
            assert_near(gpu, &scaled, &nits_of(LightPath::Loop), [8e-3, 0.03], 0.97, &format!("scale {scale}"));
        }
    });
}

/// At the edge of a triangle its texture has the same level as in its middle: pixels of a quad beside the triangle may read no map.
#[test]
fn a_mapped_texture_is_as_sharp_at_edges_as_elsewhere() {
    on_gpu(|gpu| {
        let mut own = Material { base_color_texture: Some(0), ..lambert(0.9) };
        own.uv_maps[0] = UvMap { offset: DVec2::new(0.3, 0.0), rotation: 0.5, ..UvMap::IDENTITY };
        let mut scene = plane(lambert(0.6), vec![directional(DVec3::new(0.3, 0.2, 1.0), 3.0)]);
        add(&mut scene, rectangle([-0.5, -0.5], [0.5, 0.5], 0.3), own, DAffine3::IDENTITY);
        scene.textures.push(texture(Sampler::DEFAULT));
        for path in [LightPath::Clustered, LightPath::Forward] {
            assert_near(gpu, &scene, &nits_of(path), [8e-3, 8e-3], 1.0, &format!("to the edge, {path}"));
        }
    });
}

/// A ball of a material before the plane, in a light of each kind and under a sky.
fn ball(material: Material) -> Scene {
    let lamp = point(DVec3::new(-1.0, 0.8, 1.5), 4.0, Some(5.0), Falloff::InverseSquare);
    let mut scene = plane(lambert(0.4), vec![directional(DVec3::new(0.6, 0.4, 0.7), 2.0), lamp]);
    add(&mut scene, shapes::sphere(0.6, 64), material, DAffine3::from_translation(DVec3::Z * 0.2));
    let ambient = Environment { ambient: Vec3::splat(0.3), ground: Some(Vec3::splat(0.1)), ..Environment::default() };
    Scene { environment: ambient, ..scene }
}

#[test]
fn what_is_unlit_sends_its_colour_and_reflects_nothing() {
    on_gpu(|gpu| {
        let glowing = Material { unlit: true, base_color: Vec3::new(0.9, 0.3, 0.1), ..Material::default() };
        let scene = ball(glowing.clone());
        for path in paths(gpu, &scene, 0) {
            let picture = gpu.draw(&scene, &nits_of(path));
            let middle = nits(&picture, SIZE[0] / 2, SIZE[1] / 2);
            assert!((middle - glowing.base_color.as_dvec3()).abs().max_element() < 1e-6, "{path}: {middle}");
            assert_near(gpu, &scene, &nits_of(path), [1e-5, 1e-4], 0.96, &format!("unlit, {path}"));
            // An unlit surface changes no reflections of others, and ignores a model that stands in for all.
            let other = Settings { brdf: Some(Brdf::Phong), ..nits_of(path) };
            let middle = nits(&gpu.draw(&scene, &other), SIZE[0] / 2, SIZE[1] / 2);
            assert!((middle - glowing.base_color.as_dvec3()).abs().max_element() < 1e-6, "{path}, phong: {middle}");
        }
    });
}

#[test]
#[ignore = "test-all: one more light path, output or camera"]
fn a_dielectric_reflects_as_much_as_it_says() {
    on_gpu(|gpu| {
        let shiny = |reflectance: [f32; 3], grazing, metallic| Material {
            reflectance: reflectance.into(),
            grazing,
            metallic,
            roughness: 0.4,
            base_color: Vec3::new(0.5, 0.2, 0.1),
            ..Material::default()
        };
        let phong = Material { brdf: Brdf::Phong, specular: Vec3::splat(0.4), shininess: 20.0, ..Material::default() };
        let textured = Material { specular_texture: Some(0), ..shiny([0.3; 3], 0.9, 0.0) };
        let cases = [
            ("glass", shiny([0.1; 3], 1.0, 0.0)),
            ("nothing", shiny([0.0; 3], 0.0, 0.0)),
            ("tinted", shiny([0.5, 0.2, 0.05], 0.5, 0.0)),
            ("half a metal", shiny([0.02; 3], 0.3, 0.5)),
            ("a usual metal among others", shiny([0.04; 3], 1.0, 1.0)),
            ("textured", textured),
        ];
        for (turn, (name, material)) in cases.into_iter().enumerate() {
            let mut scene = ball(material.clone());
            scene.textures.push(texture(Sampler::DEFAULT));
            // Other models stand around the ball, and a usual dielectric.
            for (index, other) in
                [phong.clone(), shiny([0.2; 3], 0.7, 0.0), Material::default()].into_iter().enumerate()
            {
                let place = DVec3::new(-0.7 + 0.7 * index as f64, -0.7, 0.3);
                add(&mut scene, shapes::sphere(0.25, 48), other, DAffine3::from_translation(place));
            }
            let bound = if material.specular_texture.is_some() { [1e-4, 4e-3] } else { [1e-5, 3e-4] };
            for path in paths(gpu, &scene, turn) {
                assert_near(gpu, &scene, &nits_of(path), bound, 0.94, &format!("{name}, {path}"));
            }
            // 8 bits a channel.
            let lean = Settings { gbuffer: Default::default(), ..nits_of(LightPath::Clustered) };
            assert_near(gpu, &scene, &lean, [0.01, 0.05], 0.94, &format!("{name}, lean"));
        }
    });
}

fn velvet(color: [f32; 3], roughness: f32) -> Material {
    let base_color = Vec3::new(0.3, 0.1, 0.2);
    Material { base_color, roughness: 0.6, sheen: Sheen { color: color.into(), roughness }, ..Material::default() }
}

#[test]
fn a_sheen_is_that_of_the_truth_on_every_path_that_draws_it() {
    on_gpu(|gpu| {
        let metal = Material { metallic: 1.0, ..velvet([0.5, 0.6, 0.7], 0.5) };
        let textured = Material { sheen_texture: Some(0), ..velvet([0.9; 3], 1.0) };
        let gauze = Material { alpha_mode: AlphaMode::Blend, alpha: 0.5, ..velvet([0.8; 3], 0.6) };
        let cases = [
            ("velvet", velvet([0.9, 0.3, 0.6], 0.3)),
            ("dust", velvet([1.0; 3], 1.0)),
            ("sharp", velvet([0.7; 3], 0.0)),
            ("metal", metal),
            ("textured", textured),
            ("gauze", gauze),
        ];
        for (turn, (name, material)) in cases.into_iter().enumerate() {
            let mut scene = ball(material.clone());
            scene.textures.push(texture(Sampler::DEFAULT));
            scene.environment.ambient = Vec3::new(0.2, 0.3, 0.4);
            add(
                &mut scene,
                shapes::sphere(0.25, 48),
                Material::default(),
                DAffine3::from_translation(DVec3::NEG_Y * 0.7),
            );
            let bound = if material.sheen_texture.is_some() { [2e-4, 6e-3] } else { [1e-4, 3e-3] };
            for path in paths(gpu, &scene, turn) {
                let what = format!("{name}, {path}");
                assert_near(gpu, &scene, &nits_of(path), bound, 0.94, &what);
                // It is seen: without it the picture is another.
                let bare = |mut scene: Scene| {
                    scene.materials.iter_mut().for_each(|material| material.sheen = Sheen::NONE);
                    scene
                };
                let [with, without] =
                    [scene.clone(), bare(scene.clone())].map(|scene| gpu.draw(&scene, &nits_of(path)));
                let moved = places(&with).filter(|&(x, y)| nits(&with, x, y) != nits(&without, x, y)).count();
                assert!(moved > 500, "{what}: {moved} pixels");
            }
        }
    });
}

#[test]
fn a_thin_film_is_that_of_the_truth_on_every_path_that_draws_it() {
    on_gpu(|gpu| {
        let oil = |metallic, roughness| Material {
            base_color: Vec3::new(0.9, 0.7, 0.5),
            metallic,
            roughness,
            film: ThinFilm { strength: 1.0, ior: 1.6, nanometres: [150.0, 450.0] },
            ..Material::default()
        };
        let both = Material { sheen: Sheen { color: Vec3::splat(0.4), roughness: 0.5 }, ..oil(0.3, 0.4) };
        let cases = [
            ("oil on metal", oil(1.0, 0.4)),
            ("oil on plastic", oil(0.0, 0.3)),
            ("textured", Material { film_texture: Some(0), ..oil(1.0, 0.5) }),
            ("under a sheen", both),
        ];
        for (turn, (name, material)) in cases.into_iter().enumerate() {
            let mut scene = ball(material.clone());
            scene.textures.push(texture(Sampler::DEFAULT));
            scene.environment.ambient = Vec3::new(0.2, 0.3, 0.4);
            add(
                &mut scene,
                shapes::sphere(0.25, 48),
                Material::default(),
                DAffine3::from_translation(DVec3::NEG_Y * 0.7),
            );
            let bound = if material.film_texture.is_some() { [5e-4, 1e-2] } else { [1e-4, 3e-3] };
            for path in paths(gpu, &scene, turn) {
                assert_near(gpu, &scene, &nits_of(path), bound, 0.94, &format!("{name}, {path}"));
            }
        }
    });
}

#[test]
fn a_stretched_highlight_is_that_of_the_truth_on_every_path_that_draws_it() {
    on_gpu(|gpu| {
        let brushed = |strength, degrees: f32| Material {
            base_color: Vec3::new(0.9, 0.7, 0.5),
            metallic: 1.0,
            roughness: 0.3,
            anisotropy: Anisotropy { strength, rotation: degrees.to_radians() },
            ..Material::default()
        };
        let film = ThinFilm { strength: 1.0, ior: 1.6, nanometres: [450.0; 2] };
        let cases = [
            ("along", brushed(0.8, 0.0)),
            ("turned plastic", Material { metallic: 0.0, ..brushed(0.6, 35.0) }),
            ("textured", Material { anisotropy_texture: Some(0), ..brushed(1.0, 70.0) }),
            ("bumpy", Material { normal_texture: Some(0), normal_scale: 0.2, ..brushed(0.7, 10.0) }),
            ("under a film", Material { film, ..brushed(0.8, 90.0) }),
        ];
        for (turn, (name, material)) in cases.into_iter().enumerate() {
            let mut scene = ball(material.clone());
            scene.textures.push(texture(Sampler::DEFAULT));
            scene.environment.ambient = Vec3::new(0.2, 0.3, 0.4);
            scene.meshes.iter_mut().for_each(Mesh::compute_tangents);
            add(
                &mut scene,
                shapes::sphere(0.25, 48),
                Material::default(),
                DAffine3::from_translation(DVec3::NEG_Y * 0.7),
            );
            let is_textured = material.textures().next().is_some();
            let bound = if is_textured { [2e-3, 3e-2] } else { [1e-4, 3e-3] };
            for path in paths(gpu, &scene, turn) {
                assert_near(gpu, &scene, &nits_of(path), bound, 0.94, &format!("{name}, {path}"));
            }
            // Without tangents the highlight is as wide in each direction, on the device and in the truth.
            if name == "along" {
                scene.meshes.iter_mut().for_each(|mesh| mesh.tangents.clear());
                let flat = nits_of(LightPath::Loop);
                assert_near(gpu, &scene, &flat, [1e-4, 3e-3], 0.94, "without tangents");
                let with = gpu.draw(&scene, &flat);
                scene.materials.iter_mut().for_each(|own| own.anisotropy = Anisotropy::NONE);
                let without = gpu.draw(&scene, &flat);
                let moved = |(x, y): (u32, u32)| (nits(&with, x, y) - nits(&without, x, y)).abs().max_element();
                assert!(places(&with).map(moved).fold(0.0, f64::max) < 1e-3);
            }
        }
    });
}

/// A coat over the last object of a scene.
fn lacquered(mut scene: Scene, coat: Material) -> Scene {
    let base = scene.objects.last().expect("an object").clone();
    scene.materials.push(Material { alpha_mode: AlphaMode::Coat, ..coat });
    let material = scene.materials.len() - 1;
    scene.objects.push(Object { name: "coat".into(), material, ..base });
    scene
}

#[test]
fn a_coat_lies_on_the_surface_that_it_is_in() {
    on_gpu(|gpu| {
        let base = Material { roughness: 0.6, base_color: Vec3::new(0.6, 0.1, 0.1), ..Material::default() };
        let coat = |alpha, roughness| Material { alpha, roughness, ..Material::default() };
        for (name, coat) in [
            ("smooth", coat(1.0, 0.2)),
            ("half", coat(0.5, 0.3)),
            ("rough", coat(1.0, 0.8)),
            ("glowing, of which nothing is seen", Material { emissive: Vec3::splat(9.0), ..coat(1.0, 0.4) }),
        ] {
            let scene = lacquered(ball(base.clone()), coat);
            for path in [LightPath::Clustered, LightPath::PerLight, LightPath::Forward] {
                for prepass in [false, true] {
                    let settings = Settings { depth_prepass: Some(prepass), ..nits_of(path) };
                    assert_near(gpu, &scene, &settings, [1e-5, 3e-4], 0.94, &format!("{name}, {path}"));
                }
            }
            // One layer over opaque surfaces is the same in any order.
            let oit = Settings { transparency: Transparency::Oit, ..nits_of(LightPath::Clustered) };
            assert_near(gpu, &scene, &oit, [1e-4, 5e-3], 0.94, &format!("{name}, summed"));
        }
    });
}

#[test]
fn every_pixel_of_a_coated_surface_has_its_coat() {
    on_gpu(|gpu| {
        // Turned and far off, so that rounding shows in depths.
        let turn = DAffine3::from_rotation_y(0.7) * DAffine3::from_rotation_x(0.3);
        let mut scene = stage();
        let black = Material { base_color: Vec3::ZERO, roughness: 1.0, ..lambert(0.0) };
        add(&mut scene, shapes::sphere(0.7, 200), black.clone(), DAffine3::from_translation(DVec3::Z * -0.1) * turn);
        let mut scene = lacquered(scene, Material { roughness: 1.0, ..Material::default() });
        scene.environment.ambient = Vec3::ONE;
        for msaa in [1, 4] {
            for (path, prepass) in
                [(LightPath::Clustered, false), (LightPath::Forward, false), (LightPath::Forward, true)]
            {
                let settings = Settings { msaa, depth_prepass: Some(prepass), ..nits_of(path) };
                let picture = gpu.draw(&scene, &settings);
                let far = |&(x, y): &(u32, u32)| {
                    (DVec2::new(f64::from(x), f64::from(y)) - f64::from(SIZE[0] / 2)).length() < 28.0
                };
                let bare = places(&picture).filter(far).filter(|&(x, y)| nits(&picture, x, y).x < 1e-3).count();
                assert_eq!(bare, 0, "{path}, {msaa} samples: pixels without their coat");
            }
        }
    });
}

#[test]
fn a_coat_over_a_pane_lies_over_it() {
    on_gpu(|gpu| {
        let pane = Material { alpha: 0.5, alpha_mode: AlphaMode::Blend, ..lambert(0.8) };
        // The numbers of materials and of objects are in either order.
        let forwards = lacquered(ball(pane), Material { roughness: 0.3, ..Material::default() });
        let mut backwards = forwards.clone();
        backwards.objects.swap(1, 2);
        for scene in [forwards, backwards] {
            assert_near(gpu, &scene, &nits_of(LightPath::Clustered), [1e-5, 3e-4], 0.94, "over a pane");
        }
    });
}

#[test]
fn a_coat_without_alpha_is_not_there() {
    on_gpu(|gpu| {
        let bare = ball(lambert(0.5));
        let with = |alpha| lacquered(bare.clone(), Material { alpha, ..Material::default() });
        let [none, clear] = [bare.clone(), with(0.0)].map(|scene| gpu.draw(&scene, &nits_of(LightPath::Clustered)));
        assert_identical(&none, &clear, "a coat of alpha 0");
    });
}
