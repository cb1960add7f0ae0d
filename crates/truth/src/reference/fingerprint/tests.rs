//! Truths of a few pixels: the cache's contents are right as long as these are.

use std::fmt::Write as _;

use glam::{DAffine3, DVec3, Vec3};

use super::MODEL;
use crate::reference::{CameraView, Mode, Reference, Smith, TruthOptions};
use afterlight_scene::{
    AlphaMode, Brdf, Camera, Environment, Falloff, Light, LightKind, Material, Mesh, Object, Scene,
};

/// The value of `MODEL` that the figures of [`GOLDEN`] belong to.
const OF_MODEL: u64 = 2;
/// One row per light: the picture's [`figure`] with each reflection model, in nits. The last row holds the figures of [`others`].
#[rustfmt::skip]
const GOLDEN: &[f64] = &[
    1.5154553021906008, 2.440318271040219, 2.676863235154888, 2.438427146363847,
    0.4004361027236783, 0.5652244824556217, 0.584836129619825, 0.49244690054788154,
    1.282043307745757, 1.9824768648114681, 2.0615525066136304, 1.6675363827632965,
    0.5274207620814128, 0.7693875716622612, 0.7972830171825548, 0.661082525426938,
    0.19771715695155187, 0.24238257628807047, 0.25440581016325553, 0.23969887446172977,
    0.22003745098921162, 0.28371350057041794, 0.2886845790923805, 0.28371338759220327,
    0.4050096623274436, 0.4048894802765538, 0.41338727467335135, 0.4141771680988945,
];

fn quad(corners: [[f64; 3]; 4]) -> Mesh {
    let mut mesh = Mesh::from_points("quad", &corners.map(DVec3::from));
    mesh.indices = vec![0, 1, 2, 0, 2, 3];
    mesh.compute_normals();
    mesh
}

/// A floor, and above it a smaller quad that shades some of it.
fn scene(kind: LightKind) -> Scene {
    let floor = quad([[-3.0, 0.0, 3.0], [3.0, 0.0, 3.0], [3.0, 0.0, -3.0], [-3.0, 0.0, -3.0]]);
    let shade = quad([[-0.5, 0.6, 0.5], [0.5, 0.7, 0.5], [0.5, 0.8, -0.5], [-0.5, 0.6, -0.5]]);
    let material = Material {
        base_color: Vec3::new(0.7, 0.5, 0.3),
        metallic: 0.3,
        roughness: 0.4,
        specular: Vec3::new(0.3, 0.2, 0.1),
        shininess: 12.0,
        emissive: Vec3::new(0.01, 0.0, 0.0),
        alpha: 0.6,
        two_sided: true,
        ..Material::default()
    };
    let object = |mesh| Object::new("", mesh, mesh, DAffine3::IDENTITY);
    let color = Vec3::new(1.0, 0.9, 0.8);
    let light = Light { color, intensity: 20.0, casts_shadow: true, ..Light::of(kind) };
    let (ambient, ground) = (Vec3::new(0.1, 0.2, 0.3), Some(Vec3::splat(0.05)));
    Scene {
        meshes: vec![floor, shade],
        objects: vec![object(0), object(1)],
        materials: vec![material.clone(), material],
        lights: vec![light],
        environment: Environment { ambient, ground, background: Vec3::splat(0.5) },
        camera: Camera::looking_at(DVec3::new(0.5, 1.5, 3.0), DVec3::new(0.0, 0.3, 0.0), DVec3::Y),
        ..Scene::default()
    }
}

/// One of each kind and each fall-off.
fn lights() -> [LightKind; 6] {
    let position = DVec3::new(0.8, 2.0, 0.6);
    let point = |range, falloff| LightKind::Point { position, range, falloff };
    let direction = DVec3::new(-0.3, -1.0, -0.2).normalize();
    [
        LightKind::Directional { direction },
        point(None, Falloff::InverseSquare),
        point(Some(6.0), Falloff::Quadratic),
        point(Some(9.0), Falloff::Polynomial { constant: 1.0, linear: 0.5, quadratic: 0.25 }),
        LightKind::Spot {
            position,
            direction,
            inner_angle_degrees: 20.0,
            outer_angle_degrees: 40.0,
            range: Some(8.0),
            falloff: Falloff::InverseSquare,
        },
        LightKind::Beam { position, direction, radius: 0.9, edge: 0.5, range: Some(8.0) },
    ]
}

/// Weighted mean of a picture's values, each with a different weight.
fn figure(scene: &Scene, brdf: Option<Brdf>, mode: Mode) -> f64 {
    let view = CameraView { camera: scene.camera, size: [8, 6] };
    let options = TruthOptions { mode, smith: Smith::HeightCorrelated };
    let truth = Reference::new(scene).expect("a scene").with_brdf(brdf).render(&view, &options, &|_, _| {});
    let weighted = truth.radiance.iter().flatten().enumerate().map(|(index, value)| value * (index + 1) as f64);
    weighted.sum::<f64>() / 10_440.0
}

/// A light with a size, through pixels' centres and by several samples a pixel; a surface behind one that blends, and behind glass.
fn others() -> [f64; 4] {
    let [_, lamp, ..] = lights();
    let mut soft = scene(lamp);
    soft.lights[0].size = 0.3;
    let behind = |alpha_mode| {
        let mut scene = scene(lamp);
        scene.materials[1].alpha_mode = alpha_mode;
        figure(&scene, None, Mode::Point)
    };
    [
        figure(&soft, None, Mode::Point),
        figure(&soft, None, Mode::Converged { samples: 5 }),
        behind(AlphaMode::Blend),
        behind(AlphaMode::Glass),
    ]
}

#[test]
fn truths_are_those_of_the_model_that_caches_are_named_after() {
    let brdfs = [Brdf::CookTorrance, Brdf::Phong, Brdf::BlinnPhong, Brdf::Lambert];
    let of_light = |light: LightKind| brdfs.map(|brdf| figure(&scene(light), Some(brdf), Mode::Point));
    let found: Vec<f64> = lights().into_iter().flat_map(of_light).chain(others()).collect();
    let is_same = |(found, golden): (&f64, &f64)| (found - golden).abs() <= 1e-9 * golden.abs();
    let is_all = found.len() == GOLDEN.len() && found.iter().zip(GOLDEN).all(is_same);
    let rows = found.chunks(4).fold(String::new(), |mut text, row| {
        let row: Vec<String> = row.iter().map(f64::to_string).collect();
        let _ = writeln!(text, "    {},", row.join(", "));
        text
    });
    let what = "truths are not what they were, and caches would go on with the old ones";
    assert!(
        is_all && OF_MODEL == MODEL,
        "{what}: raise MODEL (it is {MODEL}), and renew OF_MODEL and these figures:\n{rows}"
    );
    assert!(found.iter().enumerate().all(|(index, figure)| *figure > 0.0 && !found[..index].contains(figure)));
}
