//! A scene as Mitsuba 3 reads it, so that another renderer, by other people, can be asked for the same picture.
//!
//! Only features that both renderers compute by the same formulas are written: opaque lambert surfaces, and white metals, whose Fresnel term is 1 by
//! any formula; lights without size or range that cast shadows; no light from everywhere. Everything else is refused.
//!
//! Three differences are left to the scene's author. A spot's fall-off between its inner and outer angle differs. The back of a one-sided surface is
//! black in Mitsuba and missing here. Mitsuba's GGX has separable masking and shadowing, as `--smith separable` has it.

use std::fmt::Write as _;

use afterlight::scene::{
    AlphaMode, Brdf, Camera, CastsShadow, Falloff, Light, Material, Object, Outline, Projection, Scene,
};
use glam::{DMat3, DVec3, Vec3};

/// The files of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Export {
    /// `scene.xml`, which names the meshes.
    pub scene: String,
    /// Wavefront models in world space, by their file's name.
    pub meshes: Vec<(String, String)>,
}

/// The scene that is looked at, and how.
pub struct MitsubaScene<'a> {
    pub scene: &'a Scene,
    pub camera: Camera,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// A reflection model in place of all materials' own.
    pub brdf: Option<Brdf>,
}

/// Writes the scene, in direct light alone and with a box for a pixel's filter.
pub fn export(shot: &MitsubaScene) -> Result<Export, String> {
    let scene = shot.scene;
    if scene.environment.is_lit() {
        return Err("ambient light cannot be expressed: set the environment's `ambient` to 0".into());
    }
    if let Some(why) = scene.emitters_refusal() {
        return Err(why.into());
    }
    if scene.sky.is_some() {
        return Err("a sky cannot be expressed: leave it out by `--sky none`".into());
    }
    if scene.environment.background != Vec3::ZERO {
        return Err("a background cannot be expressed: set the environment's `background` to 0".into());
    }
    let mut text = String::from("<scene version=\"3.0.0\">\n");
    text += "  <integrator type=\"path\">\n    <integer name=\"max_depth\" value=\"2\"/>\n    \
             <boolean name=\"hide_emitters\" value=\"true\"/>\n  </integrator>\n";
    text += &sensor(&shot.camera, shot.size)?;
    for (index, material) in scene.materials.iter().enumerate() {
        let is_worn = scene.objects.iter().any(|object| object.material == index);
        if is_worn {
            text += &bsdf(index, material, shot.brdf.unwrap_or(material.brdf))?;
        }
    }
    let mut meshes = Vec::new();
    for (index, object) in scene.objects.iter().enumerate() {
        let name = format!("object-{index}.obj");
        meshes.push((name.clone(), mesh(scene, object)?));
        let _ = write!(
            text,
            "  <shape type=\"obj\">\n    <string name=\"filename\" value=\"{name}\"/>\n    \
             <ref id=\"material-{}\"/>\n  </shape>\n",
            object.material
        );
    }
    for light in &scene.lights {
        text += &emitter(light)?;
    }
    text += "</scene>\n";
    Ok(Export { scene: text, meshes })
}

fn triple(vector: DVec3) -> String {
    format!("{}, {}, {}", vector.x, vector.y, vector.z)
}

fn look_at(from: DVec3, direction: DVec3, up: DVec3) -> String {
    let (origin, target, up) = (triple(from), triple(from + direction), triple(up));
    format!(
        "    <transform name=\"to_world\">\n      \
         <lookat origin=\"{origin}\" target=\"{target}\" up=\"{up}\"/>\n    </transform>\n"
    )
}

fn sensor(camera: &Camera, [width, height]: [u32; 2]) -> Result<String, String> {
    let place = look_at(camera.position, camera.forward(), camera.up());
    let near = camera.near;
    let Projection::Perspective { fov_y_degrees: fov } = camera.projection else {
        return Err("an orthographic camera cannot be expressed".into());
    };
    Ok(format!(
        "  <sensor type=\"perspective\">\n    <float name=\"fov\" value=\"{fov}\"/>\n    \
         <string name=\"fov_axis\" value=\"y\"/>\n    <float name=\"near_clip\" value=\"{near}\"/>\n{place}    \
         <sampler type=\"independent\"/>\n    <film type=\"hdrfilm\">\n      \
         <integer name=\"width\" value=\"{width}\"/>\n      <integer name=\"height\" value=\"{height}\"/>\n      \
         <string name=\"pixel_format\" value=\"rgb\"/>\n      <string name=\"component_format\" value=\"float32\"/>\n      \
         <rfilter type=\"box\"/>\n    </film>\n  </sensor>\n"
    ))
}

fn bsdf(index: usize, material: &Material, brdf: Brdf) -> Result<String, String> {
    let refused = |what: &str| Err(format!("material \"{}\": {what} cannot be expressed", material.name));
    if material.textures().next().is_some() {
        return refused("a texture");
    }
    if material.unlit {
        return refused("an unlit surface");
    }
    if material.is_emissive() {
        return refused("emitted light");
    }
    if material.has_lobes(brdf) {
        return refused("a sheen, a film, an anisotropy, diffuse transmission or glass that bends light");
    }
    if material.alpha_mode != AlphaMode::Opaque {
        return refused("an `alpha_mode` other than \"opaque\"");
    }
    let model = match brdf {
        Brdf::Lambert => {
            let albedo = triple(material.base_color.as_dvec3());
            format!("<bsdf type=\"diffuse\">\n        <rgb name=\"reflectance\" value=\"{albedo}\"/>\n      </bsdf>")
        }
        Brdf::CookTorrance if material.metallic == 1.0 && material.base_color == Vec3::ONE => {
            let alpha = f64::from(material.roughness).powi(2);
            format!(
                "<bsdf type=\"roughconductor\">\n        <string name=\"material\" value=\"none\"/>\n        \
                 <string name=\"distribution\" value=\"ggx\"/>\n        <float name=\"alpha\" value=\"{alpha}\"/>\n      \
                 </bsdf>"
            )
        }
        Brdf::CookTorrance => {
            return refused("a Fresnel term, so `cook-torrance` without `metallic` 1 and a white `base_color`");
        }
        Brdf::Phong | Brdf::BlinnPhong => return refused("a Phong model"),
    };
    let id = format!("material-{index}");
    Ok(match material.two_sided {
        true => format!("  <bsdf type=\"twosided\" id=\"{id}\">\n      {model}\n  </bsdf>\n"),
        false => format!("  {}\n", model.replacen("<bsdf ", &format!("<bsdf id=\"{id}\" "), 1)),
    })
}

/// The object's triangles in world space with their corners' normals.
fn mesh(scene: &Scene, object: &Object) -> Result<String, String> {
    if object.casts_shadow != CastsShadow::Yes || !object.receives_shadow {
        return Err(format!("object \"{}\": one that casts or receives no shadow cannot be expressed", object.name));
    }
    let mesh = &scene.meshes[object.mesh];
    if mesh.is_strokes {
        return Err(format!("mesh \"{}\": points and lines cannot be expressed", mesh.name));
    }
    if mesh.colors.iter().any(|color| *color != [1.0; 4]) {
        return Err(format!("mesh \"{}\": colours of vertices cannot be expressed", mesh.name));
    }
    let along = object.transform.matrix3;
    let mirrored = along.determinant() < 0.0;
    let [x, y, z] = [along.row(0), along.row(1), along.row(2)];
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)).transpose();
    let normals = if mirrored { -cofactors } else { cofactors };
    let mut text = String::new();
    for &position in &mesh.positions {
        let point = object.transform.transform_point3(mesh.origin + Vec3::from(position).as_dvec3());
        let _ = writeln!(text, "v {} {} {}", point.x, point.y, point.z);
    }
    for &normal in &mesh.normals {
        // Plus zero: -0 becomes 0.
        let normal = (normals * Vec3::from(normal).as_dvec3()).normalize_or(DVec3::Y) + DVec3::ZERO;
        let _ = writeln!(text, "vn {} {} {}", normal.x, normal.y, normal.z);
    }
    for &[a, b, c] in mesh.indices.as_chunks::<3>().0 {
        let [a, b, c] = if mirrored { [a + 1, c + 1, b + 1] } else { [a + 1, b + 1, c + 1] };
        let _ = writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}");
    }
    Ok(text)
}

fn emitter(light: &Light) -> Result<String, String> {
    let refused = |what: &str| Err(format!("light \"{}\": {what} cannot be expressed", light.name));
    if light.size > 0.0 {
        return refused("a size, and soft shadows with it,");
    }
    if !light.casts_shadow {
        return refused("light that casts no shadow");
    }
    let form = light.kind.form();
    if form.range.is_some() {
        return refused("a range");
    }
    if form.falloff.is_some_and(|falloff| falloff != Falloff::InverseSquare) {
        return refused("a fall-off other than \"inverse-square\"");
    }
    let strength = triple(light.color.as_dvec3() * f64::from(light.intensity));
    Ok(match (form.place, form.direction, form.outline) {
        (None, Some(direction), _) => format!(
            "  <emitter type=\"directional\">\n    <rgb name=\"irradiance\" value=\"{strength}\"/>\n    \
             <vector name=\"direction\" value=\"{}\"/>\n  </emitter>\n",
            triple(direction)
        ),
        (Some(position), None, _) => format!(
            "  <emitter type=\"point\">\n    <rgb name=\"intensity\" value=\"{strength}\"/>\n    \
             <point name=\"position\" value=\"{}\"/>\n  </emitter>\n",
            triple(position)
        ),
        (Some(position), Some(direction), Outline::Cone { inner, outer }) => format!(
            "  <emitter type=\"spot\">\n    <rgb name=\"intensity\" value=\"{strength}\"/>\n    \
             <float name=\"beam_width\" value=\"{inner}\"/>\n    \
             <float name=\"cutoff_angle\" value=\"{outer}\"/>\n{}  </emitter>\n",
            look_at(position, direction, direction.any_orthonormal_vector())
        ),
        _ => return refused(&format!("a {} light", form.name)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight::scene::{LightKind, Mesh};
    use glam::DAffine3;

    fn scene() -> Scene {
        let mut mesh = Mesh::from_points("m", &[DVec3::ZERO, DVec3::X, DVec3::Y]);
        mesh.indices = vec![0, 1, 2];
        mesh.compute_normals();
        let light = Light {
            name: "lamp".into(),
            color: Vec3::new(1.0, 0.5, 0.25),
            intensity: 8.0,
            casts_shadow: true,
            ..Light::of(LightKind::Point { position: DVec3::Z, range: None, falloff: Falloff::InverseSquare })
        };
        Scene {
            objects: vec![Object::new("one", 0, 0, DAffine3::from_translation(DVec3::new(0.0, 0.0, -2.0)))],
            meshes: vec![mesh],
            materials: vec![Material { brdf: Brdf::Lambert, ..Material::default() }],
            lights: vec![light],
            ..Scene::default()
        }
    }

    fn exported(scene: &Scene) -> Result<Export, String> {
        export(&MitsubaScene { scene, camera: scene.camera, size: [8, 4], brdf: None })
    }

    #[test]
    fn a_scene_has_its_places_in_the_world_and_its_lights_in_candela() {
        let export = exported(&scene()).expect("it can be expressed");
        let (name, mesh) = &export.meshes[0];
        assert!(export.scene.contains(&format!("value=\"{name}\"")), "{}", export.scene);
        assert!(export.scene.contains("name=\"intensity\" value=\"8, 4, 2\""), "{}", export.scene);
        assert!(
            mesh.contains("v 1 0 -2\n") && mesh.contains("vn 0 0 1\n") && mesh.contains("f 1//1 2//2 3//3"),
            "{mesh}"
        );
    }

    #[test]
    fn a_mirrored_object_keeps_its_front() {
        let mut scene = scene();
        scene.objects[0].transform = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        let mesh = &exported(&scene).expect("it can be expressed").meshes[0].1;
        assert!(
            mesh.contains("v -1 0 0\n") && mesh.contains("vn 0 0 1\n") && mesh.contains("f 1//1 3//3 2//2"),
            "{mesh}"
        );
    }

    #[test]
    fn a_white_metal_is_a_conductor_whose_alpha_is_the_square_of_the_roughness() {
        let mut scene = scene();
        let metal =
            Material { metallic: 1.0, base_color: Vec3::ONE, roughness: 0.5, two_sided: true, ..Material::default() };
        scene.materials[0] = metal;
        let text = exported(&scene).expect("it can be expressed").scene;
        assert!(text.contains("roughconductor") && text.contains("name=\"alpha\" value=\"0.25\""), "{text}");
        assert!(text.contains("<bsdf type=\"twosided\" id=\"material-0\">"), "{text}");
    }

    #[test]
    fn what_cannot_be_expressed_is_refused_by_name() {
        let refused = |change: &dyn Fn(&mut Scene), word: &str| {
            let mut changed = scene();
            change(&mut changed);
            let said = exported(&changed).expect_err(word);
            assert!(said.contains(word) && said.contains("cannot be expressed"), "{said}");
        };
        refused(&|scene| scene.environment.ambient = Vec3::ONE, "ambient");
        refused(&|scene| scene.environment.background = Vec3::ONE, "background");
        refused(&|scene| scene.materials[0].brdf = Brdf::Phong, "Phong");
        refused(&|scene| scene.materials[0].brdf = Brdf::CookTorrance, "Fresnel");
        refused(&|scene| scene.materials[0].base_color_texture = Some(0), "texture");
        refused(&|scene| scene.materials[0].emissive = Vec3::ONE, "emitted");
        refused(&|scene| scene.materials[0].alpha_mode = AlphaMode::Blend, "alpha_mode");
        refused(&|scene| scene.materials[0].alpha_mode = AlphaMode::Coat, "alpha_mode");
        refused(&|scene| scene.materials[0].unlit = true, "unlit");
        refused(&|scene| scene.meshes[0].colors = vec![[0.5; 4]; 3], "mesh \"m\": colours of vertices");
        refused(&|scene| scene.objects[0].receives_shadow = false, "object \"one\"");
        refused(&|scene| scene.lights[0].size = 0.1, "size");
        refused(&|scene| scene.lights[0].casts_shadow = false, "light \"lamp\"");
        let kind = |range, falloff| LightKind::Point { position: DVec3::Z, range, falloff };
        refused(&|scene| scene.lights[0].kind = kind(Some(3.0), Falloff::InverseSquare), "range");
        let polynomial = Falloff::Polynomial { constant: 1.0, linear: 0.0, quadratic: 0.0 };
        refused(&|scene| scene.lights[0].kind = kind(None, polynomial), "fall-off");
        let (position, direction) = (DVec3::Z, DVec3::NEG_Z);
        let beam = LightKind::Beam { position, direction, radius: 1.0, edge: 0.1, range: None };
        refused(&|scene| scene.lights[0].kind = beam, "a beam light");
    }
}
