//! Surfaces that let light through diffusely (KHR_materials_diffuse_transmission): light at the back, with its shadows, worked out by hand.

use std::f64::consts::PI;

use crate::common::compare::assert_identical;
use crate::common::gpu::{nits, on_gpu, places};
use crate::common::stage::{add, beam, directional, exact, lambert, plane, point, rectangle, seen, spot, sun};
use afterlight::scene::{
    AlphaMode, CastsShadow, DiffuseTransmission, Environment, Falloff, Light, LightPath, Material, Scene, Settings,
    Transparency,
};
use glam::{DAffine3, DQuat, DVec3, Vec3};

const EDGE: u32 = 33;
const TINT: Vec3 = Vec3::new(0.75, 0.5, 0.25);
const PATHS: [LightPath; 6] = [
    LightPath::Loop,
    LightPath::Clustered,
    LightPath::PerLight,
    LightPath::Volumes,
    LightPath::Forward,
    LightPath::ForwardNaive,
];
/// As in `pixels.rs`: single precision through a handful of operations.
const SINGLE: f64 = 1e-5;

/// A leaf without a highlight, so that its light is lambert's alone.
fn leaf(strength: f32) -> Material {
    Material {
        base_color: Vec3::new(0.2, 0.6, 0.4),
        reflectance: Vec3::ZERO,
        grazing: 0.0,
        diffuse_transmission: DiffuseTransmission { strength, color: TINT },
        ..Material::default()
    }
}

/// The plane z = 0 as a leaf, in these lights.
fn foliage(strength: f32, lights: Vec<Light>) -> Scene {
    plane(leaf(strength), lights)
}

fn on(light_path: LightPath) -> Settings {
    Settings { light_path, ..exact(EDGE, EDGE) }
}

const BEHIND: DVec3 = DVec3::new(0.6, 0.0, -0.8);

#[test]
fn a_leaf_that_is_lit_from_behind_has_the_tint_of_what_it_lets_through_on_every_path() {
    on_gpu(|gpu| {
        for path in PATHS {
            for strength in [0.5f32, 1.0] {
                let picture = gpu.draw(&foliage(strength, vec![sun(BEHIND, 10.0)]), &on(path));
                let expected = TINT.as_dvec3() * (10.0 * 0.8 / PI * f64::from(strength));
                for (x, y) in places(&picture) {
                    let off = (nits(&picture, x, y) / expected - 1.0).abs().max_element();
                    assert!(off < SINGLE, "{path} {strength}: {} at ({x}, {y})", nits(&picture, x, y));
                }
            }
        }
    });
}

#[test]
fn light_in_front_does_not_come_through_and_what_comes_through_is_not_reflected() {
    on_gpu(|gpu| {
        let lit = |strength| foliage(strength, vec![sun(DVec3::new(0.6, 0.0, 0.8), 10.0)]);
        for path in PATHS {
            // All of the base lets light through: nothing is left that reflects.
            let none = gpu.draw(&lit(1.0), &on(path));
            assert!(places(&none).all(|(x, y)| nits(&none, x, y) == DVec3::ZERO), "{path}");
            let some = gpu.draw(&lit(0.25), &on(path));
            let expected = leaf(0.0).base_color.as_dvec3() * (10.0 * 0.8 / PI * 0.75);
            let off = |(x, y)| (nits(&some, x, y) / expected - 1.0).abs().max_element();
            assert!(places(&some).map(off).fold(0.0, f64::max) < SINGLE, "{path}");
            // A metal lets nothing through, whatever it says.
            let metal = Material { metallic: 1.0, ..leaf(1.0) };
            let dark = gpu.draw(&plane(metal, vec![sun(BEHIND, 10.0)]), &on(path));
            assert!(places(&dark).all(|(x, y)| nits(&dark, x, y) == DVec3::ZERO), "{path}");
        }
    });
}

/// Lights that hang behind the plane, one of each kind.
fn lamps() -> [(&'static str, Light); 4] {
    // The helper's spot light looks along -Z.
    let behind = |own: Light| {
        let mut own = own;
        if let afterlight::scene::LightKind::Spot { direction, .. } = &mut own.kind {
            *direction = DVec3::Z;
        }
        own
    };
    let place = DVec3::new(0.2, -0.1, -1.5);
    [
        ("point", point(place, 20.0, None, Falloff::InverseSquare)),
        ("ranged point", point(place, 20.0, Some(3.0), Falloff::InverseSquare)),
        ("spot", behind(spot(place, 20.0, 10.0, 40.0))),
        ("beam", beam(place, DVec3::Z, 20.0, [0.5, 0.3], None)),
    ]
}

/// Mirrored at the plane a lamp lights a lambert plane in front as it lights through a leaf that lets all through.
#[test]
fn each_kind_of_light_comes_through_as_its_mirror_image_is_reflected() {
    on_gpu(|gpu| {
        for (name, lamp) in lamps() {
            for casts_shadow in [false, true] {
                let own = Light { casts_shadow, ..lamp.clone() };
                let mut mirrored = own.clone();
                mirrored.kind = mirror(&own.kind);
                let white = Material { base_color: TINT, ..leaf(0.0) };
                for path in PATHS {
                    let through = gpu.draw(&foliage(1.0, vec![own.clone()]), &on(path));
                    let reflected = gpu.draw(&plane(white.clone(), vec![mirrored.clone()]), &on(path));
                    let brightest = places(&reflected).map(|(x, y)| nits(&reflected, x, y).max_element());
                    let brightest = brightest.fold(0.0, f64::max);
                    assert!(brightest > 0.1, "{name}: nothing is lit");
                    for (x, y) in places(&through) {
                        let off = (nits(&through, x, y) - nits(&reflected, x, y)).abs().max_element() / brightest;
                        assert!(off < SINGLE, "{name}, {path}, shadows {casts_shadow}: {off} at ({x}, {y})");
                    }
                }
            }
        }
    });
}

/// Mirrors a light at the plane z = 0.
fn mirror(kind: &afterlight::scene::LightKind) -> afterlight::scene::LightKind {
    use afterlight::scene::LightKind::{Beam, Directional, Point, Spot};
    let mut own = *kind;
    let over = |v: &mut DVec3| v.z = -v.z;
    match &mut own {
        Point { position, .. } => over(position),
        Directional { direction } => over(direction),
        Spot { position, direction, .. } | Beam { position, direction, .. } => {
            over(position);
            over(direction);
        }
    }
    own
}

/// A leaf before whose back a block hangs, in the sun from behind.
fn shaded(casts: CastsShadow) -> Scene {
    let mut scene = foliage(1.0, vec![sun(DVec3::new(0.0, 0.3, -1.0), 10.0)]);
    scene.objects[0].casts_shadow = casts;
    add(&mut scene, rectangle([-0.3, -0.3], [0.3, 0.3], 0.0), lambert(0.5), turned(-0.5));
    scene
}

/// Turned about, so that it faces -Z, and moved.
fn turned(z: f64) -> DAffine3 {
    DAffine3::from_rotation_translation(DQuat::from_rotation_y(PI), DVec3::Z * z)
}

#[test]
fn a_leaf_is_dark_where_its_back_is_in_shadow_and_does_not_shade_itself() {
    on_gpu(|gpu| {
        let expected = TINT.as_dvec3() * (10.0 / DVec3::new(0.0, 0.3, 1.0).length() / PI);
        for casts in [CastsShadow::Yes, CastsShadow::Front, CastsShadow::No] {
            let scene = shaded(casts);
            for path in PATHS {
                let picture = gpu.draw(&scene, &on(path));
                for (x, y) in places(&picture) {
                    let at = seen(picture.size, x, y);
                    // The block's shadow: 0.5 before the plane, the light 0.3 from above a metre.
                    let inside = (at.x.abs() - 0.3).max((at.y + 0.15).abs() - 0.3);
                    let found = nits(&picture, x, y);
                    if inside < -0.05 {
                        assert_eq!(found, DVec3::ZERO, "{casts:?}, {path}: lit in the shadow at ({x}, {y})");
                    } else if inside > 0.05 {
                        let off = (found / expected - 1.0).abs().max_element();
                        assert!(off < SINGLE, "{casts:?}, {path}: {found}, not {expected} at ({x}, {y})");
                    }
                }
            }
        }
    });
}

/// A wall right before the leaf, on the eye's side of it, keeps no light from its back; and one behind it keeps all.
#[test]
fn what_stands_before_a_leaf_throws_no_shadow_on_its_back() {
    on_gpu(|gpu| {
        let lit = |z: f64| {
            let mut scene = foliage(1.0, vec![sun(DVec3::NEG_Z, 10.0)]);
            // Beside what the camera sees of the leaf's middle, and as wide as that on the other side.
            add(&mut scene, rectangle([0.25, -4.0], [4.0, 4.0], z), lambert(0.5), DAffine3::IDENTITY);
            gpu.draw(&scene, &on(LightPath::Clustered))
        };
        let expected = TINT.as_dvec3() * (10.0 / PI);
        let (before, behind) = (lit(0.3), lit(-0.3));
        let left = nits(&before, EDGE / 4, EDGE / 2);
        assert!((left / expected - 1.0).abs().max_element() < SINGLE, "{left}");
        assert_eq!(nits(&before, EDGE - 2, EDGE / 2), DVec3::ZERO, "the wall's own front is lit from nowhere");
        assert_eq!(nits(&behind, EDGE - 2, EDGE / 2), DVec3::ZERO);
        assert_eq!(nits(&behind, EDGE / 4, EDGE / 2), nits(&before, EDGE / 4, EDGE / 2));
    });
}

#[test]
fn ambient_light_comes_through_from_the_other_half_sphere() {
    on_gpu(|gpu| {
        let (sky, ground) = (Vec3::new(1.0, 2.0, 4.0), Vec3::new(0.5, 0.25, 0.125));
        let mut scene = foliage(0.75, vec![]);
        scene.environment = Environment { ambient: sky, ground: Some(ground), ..Environment::default() };
        // The plane leans back by 30 degrees: n.y = 1/2.
        scene.objects[0].transform = DAffine3::from_rotation_x(-PI / 6.0);
        let (mean, tilt) = ((sky + ground).as_dvec3() / 2.0, (sky - ground).as_dvec3() / 2.0);
        let (front, behind) = (mean + tilt * 0.5, mean - tilt * 0.5);
        let all = leaf(0.0).base_color.as_dvec3() * 0.25 * front + TINT.as_dvec3() * 0.75 * behind;
        // A dielectric that reflects nothing has a lobe of this ambient light all the same, in the fit: none facing the eye, where both reflectances are 0.
        for path in PATHS {
            let picture = gpu.draw(&scene, &on(path));
            let found = nits(&picture, EDGE / 2, EDGE / 2);
            assert!((found / all - 1.0).abs().max_element() < SINGLE, "{path}: {found}, not {all}");
        }
    });
}

#[test]
fn a_pane_that_lets_light_through_does_so_where_it_is_sorted_and_by_its_alpha() {
    on_gpu(|gpu| {
        for (alpha_mode, share) in [(AlphaMode::Blend, 0.5), (AlphaMode::Glass, 0.5)] {
            let pane = Material { alpha: 0.5, alpha_mode, ..leaf(1.0) };
            let lit = |material: &Material| plane(material.clone(), vec![sun(BEHIND, 10.0)]);
            let sorted = Settings { transparency: Transparency::Sorted, ..on(LightPath::Clustered) };
            let picture = gpu.draw(&lit(&pane), &sorted);
            let expected = TINT.as_dvec3() * (10.0 * 0.8 / PI * share);
            let found = nits(&picture, EDGE / 2, EDGE / 2);
            assert!((found / expected - 1.0).abs().max_element() < SINGLE, "{alpha_mode:?}: {found}, not {expected}");
            // Sums have no lobes: the pane is one that reflects its base color and is dark from behind.
            let summed = Settings { transparency: Transparency::Oit, ..sorted };
            let opaque = Material { diffuse_transmission: DiffuseTransmission::NONE, ..pane.clone() };
            assert_identical(&gpu.draw(&lit(&pane), &summed), &gpu.draw(&lit(&opaque), &summed), "summed");
        }
    });
}

#[test]
fn a_leaf_of_strength_zero_is_the_same_picture_as_one_without_the_extension() {
    on_gpu(|gpu| {
        let lights = vec![directional(DVec3::new(0.2, 0.1, 1.0), 3.0), sun(BEHIND, 5.0)];
        let zero = foliage(0.0, lights.clone());
        let none = plane(Material { diffuse_transmission: DiffuseTransmission::NONE, ..leaf(0.0) }, lights);
        for path in [LightPath::Clustered, LightPath::Compute] {
            assert_identical(&gpu.draw(&zero, &on(path)), &gpu.draw(&none, &on(path)), &path.to_string());
        }
    });
}
