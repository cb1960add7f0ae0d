//! Scenes made of formulas, for tests, benchmarks and the first picture: `builtin:NAME?key=value&key=value`. This module needs the feature `readers`.
//!
//! Equal names and parameters make equal scenes, byte for byte. All of them are this project's own work, CC0.

mod checks;
mod cornell;
mod field;
mod hall;
mod layers;
mod paint;
mod params;
mod seaweed;
pub mod shapes;
mod spheres;
pub mod stage;

pub use params::{Kind, Parameter};

use params::Params;

use super::suggest::unknown;
use super::{Error, Scene};

/// A built-in scene.
pub struct Builtin {
    /// As it stands after the prefix.
    pub name: &'static str,
    /// A sentence on the scene.
    pub about: &'static str,
    /// The parameters that it takes.
    pub parameters: &'static [Parameter],
    build: fn(&Params) -> Scene,
}

/// Every built-in scene.
pub const CATALOGUE: &[&Builtin] = &[
    &hall::HALL,
    &spheres::SPHERES,
    &field::FIELD,
    &layers::LAYERS,
    &cornell::CORNELL,
    &seaweed::SEAWEED,
    &checks::QUAD,
    &checks::TRIANGLE,
    &checks::OVERLAP,
    &checks::ORIENTATION,
];

/// The prefix that tells a built-in scene from a file.
pub const PREFIX: &str = "builtin:";

/// Builds `builtin:NAME?key=value&…`, with or without the prefix.
///
/// # Errors
/// [`Error::Builtin`] for an unknown name, an unknown parameter or a value out of its range; `list` answers with the names.
pub fn open(spec: &str) -> Result<Scene, Error> {
    let spec = spec.strip_prefix(PREFIX).unwrap_or(spec);
    let (name, query) = spec.split_once('?').unwrap_or((spec, ""));
    let Some(builtin) = CATALOGUE.iter().find(|builtin| builtin.name == name) else {
        let names: Vec<_> = CATALOGUE.iter().map(|builtin| builtin.name).collect();
        return Err(Error::Builtin(if name == "list" || name.is_empty() {
            format!("built-in scenes: {}", names.join(", "))
        } else {
            unknown("built-in scene", name, &names)
        }));
    };
    let mut scene = (builtin.build)(&Params::parse(name, builtin.parameters, query)?);
    scene.name = format!("{PREFIX}{spec}");
    Ok(scene)
}

/// The catalogue as text, for `--help` and the documentation: each scene, its parameters and their ranges.
pub fn list() -> String {
    let mut text = String::new();
    for builtin in CATALOGUE {
        text += &format!("builtin:{}  {}\n", builtin.name, builtin.about);
        for parameter in builtin.parameters {
            text += &format!("    {}  {} ({})\n", parameter.name, parameter.about, parameter.range());
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mesh;

    #[test]
    #[ignore = "test-all: every built-in scene and kind of plan once more, and random files of which the corpora have the worst"]
    fn every_scene_holds_together_and_comes_out_the_same_twice() {
        for builtin in CATALOGUE {
            let scene = open(builtin.name).unwrap();
            assert!(scene.triangle_count() > 0 && !scene.bounds().is_empty(), "{}", builtin.name);
            for object in &scene.objects {
                assert!(object.material < scene.materials.len() && object.mesh < scene.meshes.len());
            }
            for material in &scene.materials {
                assert!(material.textures().all(|(_, texture)| texture < scene.textures.len()), "{}", material.name);
            }
            for mesh in &scene.meshes {
                assert!(mesh.indices.iter().all(|&index| (index as usize) < mesh.positions.len()), "{}", mesh.name);
                assert!(mesh.positions.iter().flatten().chain(mesh.normals.iter().flatten()).all(|x| x.is_finite()));
                assert_eq!(mesh.normals.len(), mesh.positions.len());
            }
            let again = open(builtin.name).unwrap();
            assert!(again.textures == scene.textures && again.meshes.len() == scene.meshes.len(), "{}", builtin.name);
            for (one, other) in again.meshes.iter().zip(&scene.meshes) {
                let vertices = |mesh: &Mesh| (mesh.positions.clone(), mesh.normals.clone(), mesh.uvs.clone());
                assert!(vertices(one) == vertices(other) && one.indices == other.indices, "{}", one.name);
            }
            let [again, scene] =
                [again, scene].map(|scene| Scene { meshes: Vec::new(), textures: Vec::new(), ..scene });
            assert_eq!(format!("{again:?}"), format!("{scene:?}"), "{}", builtin.name);
        }
    }

    #[test]
    fn a_wrong_name_or_parameter_is_answered_with_a_suggestion() {
        let says = |spec: &str| open(spec).unwrap_err().to_string();
        assert!(says("builtin:feild").contains("did you mean \"field\""));
        assert!(says("builtin:field?light=3").contains("did you mean \"lights\""));
        assert!(says("builtin:field?lights=-3").contains("whole number from 0"));
        assert!(says("builtin:quad?albedo=nan").contains("number from 0 to 1"));
        assert!(says("builtin:field?lights").contains("key=value"));
        assert!(says("builtin:field?lights=1&lights=2").contains("twice"));
        assert!(says("builtin:list").contains("hall, spheres"));
        assert!(says("builtin:cornell?x=1").contains("no parameters"));
    }
}
