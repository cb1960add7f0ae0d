//! That every number of a scene is one, and every direction goes somewhere: what a reader lets pass, or what code puts together, may still
//! overflow or divide by nothing.

use glam::{DAffine3, DVec3, Vec3};

use super::{AlphaMode, Camera, Falloff, Light, LightKind, Material, Mesh, Scene};

impl Scene {
    /// Checks that all numbers are finite: of meshes, objects, materials, lights, the environment and the camera; and that directions of lights
    /// have a length.
    ///
    /// A plan does so ([`crate::plan::FramePlan::of`]); what draws without one asks itself.
    ///
    /// # Errors
    /// A sentence that names the scene, the first thing in it with a number that is infinite or none, and which of its values that is.
    pub fn check_finite(&self) -> Result<(), String> {
        self.check_numbers().map_err(|what| if self.name.is_empty() { what } else { format!("{}: {what}", self.name) })
    }

    fn check_numbers(&self) -> Result<(), String> {
        let wrong =
            |what: &str, index: usize, name: &str, fault: String| Err(format!("{what} {index} (`{name}`): {fault}"));
        let infinite = |value: &str| format!("{value} is not finite");
        for (index, mesh) in self.meshes.iter().enumerate() {
            if let Some(value) = of_mesh(mesh) {
                return wrong("mesh", index, &mesh.name, infinite(&value));
            }
        }
        for (index, object) in self.objects.iter().enumerate() {
            if !fits(&object.transform) {
                return wrong("object", index, &object.name, infinite("its transform"));
            }
        }
        for (index, material) in self.materials.iter().enumerate() {
            if let Some(value) = of_material(material) {
                return wrong("material", index, &material.name, infinite(value));
            }
        }
        for (index, light) in self.lights.iter().enumerate() {
            if let Some(fault) = light.fault() {
                return wrong("light", index, &light.name, fault);
            }
        }
        let environment = &self.environment;
        let all = [environment.ambient, environment.ground(), environment.background];
        if !all.iter().all(|light| light.is_finite()) {
            return Err("the environment's light is not finite".into());
        }
        let Camera { position, rotation, projection: _, near } = self.camera;
        if !(position.is_finite() && rotation.is_finite() && self.camera.half_height().is_finite() && near.is_finite())
        {
            return Err("a number of the camera is not finite".into());
        }
        Ok(())
    }
}

/// Finite, also as f32.
pub(crate) fn fits(transform: &DAffine3) -> bool {
    let columns = transform.matrix3.to_cols_array();
    columns.iter().all(|value| (*value as f32).is_finite()) && transform.translation.is_finite()
}

/// The first number of a mesh that is none.
fn of_mesh(mesh: &Mesh) -> Option<String> {
    fn first<const N: usize>(what: &str, values: &[[f32; N]]) -> Option<String> {
        // Without a way out, compilers look at several numbers at once; most meshes have none to find.
        if !values.as_flattened().iter().fold(false, |found, number| found | !number.is_finite()) {
            return None;
        }
        let vertex = values.iter().position(|value| !value.iter().all(|number| number.is_finite()))?;
        Some(format!("the {what} of vertex {vertex}"))
    }
    if !mesh.origin.is_finite() {
        return Some("its origin".into());
    }
    first("position", &mesh.positions)
        .or_else(|| first("normal", &mesh.normals))
        .or_else(|| first("texture coordinate", &mesh.uvs))
        .or_else(|| first("tangent", &mesh.tangents))
}

fn of_material(material: &Material) -> Option<&'static str> {
    let cutoff = if let AlphaMode::Mask { cutoff } = material.alpha_mode { cutoff } else { 0.0 };
    let colors =
        [("base_color", material.base_color), ("specular", material.specular), ("emissive", material.emissive)];
    let numbers = [
        ("alpha", material.alpha),
        ("alpha_cutoff", cutoff),
        ("metallic", material.metallic),
        ("roughness", material.roughness),
        ("shininess", material.shininess),
        ("ambient", material.ambient),
        ("normal_scale", material.normal_scale),
    ];
    let color = colors.into_iter().find(|(_, color)| !color.is_finite()).map(|(name, _)| name);
    color.or_else(|| numbers.into_iter().find(|(_, number)| !number.is_finite()).map(|(name, _)| name))
}

impl Light {
    /// The first of its values that is infinite or no number, or a direction without a length, in words.
    pub(crate) fn fault(&self) -> Option<String> {
        let reach = |range: Option<f64>, falloff: Falloff| {
            let terms = match falloff {
                Falloff::Polynomial { constant, linear, quadratic } => Vec3::new(constant, linear, quadratic),
                Falloff::InverseSquare | Falloff::Quadratic => Vec3::ZERO,
            };
            [("range", range.unwrap_or(0.0).is_finite()), ("falloff", terms.is_finite())]
        };
        let place = |position: DVec3| ("position", position.is_finite());
        let toward = |direction: DVec3| ("direction", direction.is_finite());
        let mut all = vec![
            ("color", self.color.is_finite()),
            ("intensity", self.intensity.is_finite()),
            ("size", self.size.is_finite()),
            // What is uploaded is their product.
            ("color times intensity", (self.color * self.intensity).is_finite()),
        ];
        match self.kind {
            LightKind::Directional { direction } => all.push(toward(direction)),
            LightKind::Point { position, range, falloff } => {
                all.push(place(position));
                all.extend(reach(range, falloff));
            }
            LightKind::Spot { position, direction, inner_angle_degrees, outer_angle_degrees, range, falloff } => {
                all.extend([place(position), toward(direction)]);
                all.push(("cone", inner_angle_degrees.is_finite() && outer_angle_degrees.is_finite()));
                all.extend(reach(range, falloff));
            }
        }
        let infinite = all.into_iter().find(|(_, finite)| !finite).map(|(name, _)| format!("{name} is not finite"));
        infinite.or_else(|| match self.kind {
            LightKind::Directional { direction } | LightKind::Spot { direction, .. } if direction == DVec3::ZERO => {
                Some("its direction has no length".into())
            }
            _ => None,
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::builtin;
    use super::*;

    fn checks() -> Scene {
        builtin::open("builtin:spheres").unwrap()
    }

    #[test]
    fn what_is_not_finite_is_named_with_its_place() {
        assert_eq!(checks().check_finite(), Ok(()));
        type Change = fn(&mut Scene, f32);
        let changes: [(Change, &str); 10] = [
            (|scene, bad| scene.meshes[0].positions[7][1] = bad, "the position of vertex 7 is not finite"),
            (|scene, bad| scene.meshes[0].normals[2][0] = bad, "the normal of vertex 2 is not finite"),
            (|scene, bad| scene.meshes[0].uvs[3][0] = bad, "the texture coordinate of vertex 3 is not finite"),
            (|scene, bad| scene.meshes[0].origin.x = f64::from(bad), "its origin is not finite"),
            (|scene, bad| scene.objects[1].transform.matrix3.x_axis.z = f64::from(bad), "object 1 ("),
            (|scene, bad| scene.materials[1].roughness = bad, "roughness is not finite"),
            (|scene, bad| scene.materials[1].emissive = Vec3::new(0.0, bad, 0.0), "emissive is not finite"),
            (|scene, bad| scene.lights[0].intensity = bad, "light 0 ("),
            (|scene, bad| scene.environment.background.x = bad, "the environment's light"),
            (|scene, bad| scene.camera.near = f64::from(bad), "the camera is not finite"),
        ];
        for (change, expected) in changes {
            for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let mut scene = checks();
                change(&mut scene, bad);
                let error = scene.check_finite().unwrap_err();
                assert!(error.contains(expected), "{error}");
            }
        }
    }

    #[test]
    fn a_direction_without_a_length_is_found() {
        let directed = |direction| {
            let mut scene = checks();
            scene.lights[0].kind = LightKind::Directional { direction };
            scene.check_finite()
        };
        assert_eq!(directed(DVec3::Y * 5e-324), Ok(()));
        let error = directed(DVec3::new(0.0, -0.0, 0.0)).expect_err("refused");
        assert!(error.contains(": light 0 (") && error.ends_with("its direction has no length"), "{error}");
    }

    #[test]
    fn a_product_that_overflows_is_found_too() {
        let mut scene = checks();
        scene.lights[0].color = Vec3::splat(1e20);
        scene.lights[0].intensity = 1e20;
        assert!(scene.check_finite().unwrap_err().contains("color times intensity"));
        let mut scene = checks();
        scene.objects[0].transform.matrix3.y_axis.y = 1e39;
        assert!(scene.check_finite().unwrap_err().contains("its transform"));
    }
}
