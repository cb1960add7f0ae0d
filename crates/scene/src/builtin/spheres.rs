//! A grid of spheres: rougher to the right, more metallic to the top.

use glam::{DVec3, Vec3};

use super::params::{Parameter, Params};
use super::stage::{SceneBuilder, translation};
use super::{Builtin, shapes};
use crate::{Brdf, Camera, Environment, Falloff, Light, LightKind, Material, Projection, Scene};

pub(super) const SPHERES: Builtin = Builtin {
    name: "spheres",
    about: "Spheres of roughness (columns) by metalness (rows) under three lights.",
    parameters: &[
        Parameter::integer("rows", [1, 64], 5, "steps of metalness, from 0 below to 1 above"),
        Parameter::integer("columns", [1, 64], 8, "steps of roughness, from 0 at the left to 1 at the right"),
        Parameter {
            name: "brdf",
            about: "the reflection model; Phong models get Ns = 2 / roughness^4 - 2",
            kind: super::Kind::Brdf { default: Brdf::CookTorrance },
        },
    ],
    build,
};

fn build(params: &Params) -> Scene {
    let (rows, columns, brdf) = (params.integer("rows"), params.integer("columns"), params.brdf("brdf"));
    let mut stage = SceneBuilder::default();
    let share = |index: usize, count: usize| if count > 1 { index as f32 / (count - 1) as f32 } else { 0.5 };
    let plain = stage.material(Material { name: "floor".into(), base_color: Vec3::splat(0.18), ..Material::default() });
    let mesh = stage.mesh("sphere", shapes::sphere(0.45, 64), plain);
    let (width, height) = (columns as f64, rows as f64);
    for row in 0..rows {
        for column in 0..columns {
            let (metallic, roughness) = (share(row, rows), share(column, columns));
            let base_color = Vec3::new(0.95, 0.45, 0.15);
            let material = stage.material(Material {
                name: format!("metallic {metallic:.2} roughness {roughness:.2}"),
                brdf,
                base_color,
                metallic,
                roughness,
                specular: Vec3::splat(0.04).lerp(base_color, metallic),
                shininess: (2.0 / roughness.max(0.1).powi(4) - 2.0).max(0.0),
                ..Material::default()
            });
            let x = column as f64 - (width - 1.0) * 0.5;
            let y = row as f64 - (height - 1.0) * 0.5;
            stage.place(mesh, material, translation(x, y, 0.0));
        }
    }
    let floor = stage.mesh("floor", shapes::plane([width * 6.0 + 40.0; 2]), plain);
    stage.place(floor, plain, translation(0.0, -height * 0.5 - 0.1, 0.0));
    let reach = width.max(height * 16.0 / 9.0);
    for (name, place, color, strength) in [
        ("key", DVec3::new(-0.5, 0.6, 0.8), Vec3::new(1.0, 0.95, 0.88), 900.0),
        ("fill", DVec3::new(0.7, 0.1, 0.7), Vec3::new(0.6, 0.75, 1.0), 350.0),
        ("rim", DVec3::new(0.1, 0.9, -0.5), Vec3::ONE, 500.0),
    ] {
        stage.light(Light {
            name: name.into(),
            color,
            intensity: strength * (reach * reach) as f32,
            ..Light::of(LightKind::Point { position: place * reach, range: None, falloff: Falloff::InverseSquare })
        });
    }
    stage.scene.environment =
        Environment { ambient: Vec3::splat(120.0), background: Vec3::new(25.0, 30.0, 40.0), ground: None };
    let distance = (reach * 0.5 / (16.0 / 9.0) + 0.4) / 20f64.to_radians().tan();
    stage.scene.camera = Camera {
        projection: Projection::perspective(40.0),
        ..Camera::looking_at(DVec3::new(0.0, 0.15 * height, distance), DVec3::new(0.0, -0.05, 0.0), DVec3::Y)
    };
    stage.scene
}
