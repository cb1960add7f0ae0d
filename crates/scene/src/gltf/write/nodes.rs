//! Objects, cameras and lights as nodes, and the meshes that they show.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};
use serde_json::{Value, json};

use super::materials::{CoatedMaterial, MaterialTable};
use super::placing::{Placing, aimed, placing, turned};
use super::{DocumentBuilder, number};
use crate::{Camera, Light, LightKind, Mesh, Object, Outline, Projection, Scene, unit};

/// Modes of primitives.
const POINTS: usize = 0;
const LINES: usize = 1;

/// The parts of a scene that become nodes.
pub(super) struct NodeWriter<'a> {
    pub scene: &'a Scene,
    pub materials: &'a MaterialTable,
    /// Width over height of the picture.
    pub aspect: f64,
}

impl NodeWriter<'_> {
    /// Writes objects, then cameras, then lights. `exposure` goes with the first camera.
    pub fn write(&self, document: &mut DocumentBuilder, exposure: Value) {
        let mut primitives = HashMap::new();
        let mut meshes: HashMap<(usize, CoatedMaterial), usize> = HashMap::new();
        for (object, worn) in self.scene.objects.iter().zip(&self.materials.worn) {
            let Some(worn) = *worn else { continue };
            let mesh = *meshes.entry((object.mesh, worn)).or_insert_with(|| {
                let own = &self.scene.meshes[object.mesh];
                let shared = primitives.entry(object.mesh).or_insert_with(|| primitive(own, document));
                let mut primitive = shared.clone();
                primitive["material"] = json!(self.materials.number(worn));
                document.push("meshes", json!({ "name": own.name, "primitives": [primitive] }))
            });
            self.object(object, mesh, document);
        }
        let mut exposure = Some(exposure);
        for own in &self.scene.cameras {
            let mut camera = self.camera(&own.camera);
            camera["name"] = own.name.as_str().into();
            if let Some(exposure) = exposure.take() {
                camera["extras"] = exposure;
            }
            let number = document.push("cameras", camera);
            let keys = turned(own.camera.position, own.camera.rotation);
            root(document, keys, json!({ "name": own.name, "camera": number }));
        }
        self.scene.lights.iter().for_each(|own| light(own, document));
    }

    /// Vertices are told from their mesh's origin: the node stands there.
    fn object(&self, object: &Object, mesh: usize, document: &mut DocumentBuilder) {
        let origin = self.scene.meshes[object.mesh].origin;
        let transform = object.transform * DAffine3::from_translation(origin);
        let shown = json!({ "name": object.name, "mesh": mesh });
        match placing(&transform) {
            Placing::One(keys) => root(document, keys, shown),
            Placing::Two(outer, inner) => {
                let child = document.push("nodes", merged(inner, shown));
                root(document, outer, json!({ "children": [child] }));
            }
        }
    }

    /// With a far plane behind all that is there: an orthographic camera of glTF has one, and some readers refuse a perspective one without. The
    /// reader here knows none.
    fn camera(&self, camera: &Camera) -> Value {
        let (near, far) = (camera.near, self.farthest(camera).max(2.0 * camera.near));
        match camera.projection {
            Projection::Perspective { fov_y_degrees } => {
                let (yfov, aspect) = (fov_y_degrees.to_radians(), self.aspect);
                let lens = json!({ "yfov": yfov, "aspectRatio": aspect, "znear": near, "zfar": far });
                json!({ "type": "perspective", "perspective": lens })
            }
            Projection::Orthographic { height } => {
                let half = height * 0.5;
                let lens = json!({ "xmag": half * self.aspect, "ymag": half, "znear": near, "zfar": far });
                json!({ "type": "orthographic", "orthographic": lens })
            }
        }
    }

    fn farthest(&self, camera: &Camera) -> f64 {
        let along = |corner: DVec3| (corner - camera.position).dot(camera.forward());
        1.01 * self.scene.bounds().corners().map(along).into_iter().fold(0.0, f64::max)
    }
}

/// A node without a parent.
fn root(document: &mut DocumentBuilder, keys: Value, more: Value) {
    let node = document.push("nodes", merged(keys, more));
    document.roots.push(node);
}

fn merged(mut keys: Value, more: Value) -> Value {
    if let (Value::Object(keys), Value::Object(more)) = (&mut keys, more) {
        keys.extend(more);
    }
    keys
}

/// A mesh's vertices and triangles, without a material.
fn primitive(mesh: &Mesh, document: &mut DocumentBuilder) -> Value {
    if mesh.is_strokes {
        let (ends, mode) = ends(mesh);
        let mut json = vertices(&ends, document);
        json["mode"] = mode.into();
        return json;
    }
    let mut json = vertices(mesh, document);
    json["indices"] = document.binary.indices(&mesh.indices).into();
    json
}

/// The ends of lines, two each, or points, with the primitive's mode.
fn ends(mesh: &Mesh) -> (Mesh, usize) {
    let are_points = mesh.strokes().all(|[first, second]| mesh.positions[first] == mesh.positions[second]);
    let vertices: Vec<usize> =
        mesh.strokes().flat_map(|own| own.into_iter().take(if are_points { 1 } else { 2 })).collect();
    fn of<T: Copy>(values: &[T], vertices: &[usize]) -> Vec<T> {
        if values.is_empty() { Vec::new() } else { vertices.iter().map(|&vertex| values[vertex]).collect() }
    }
    let own = Mesh {
        positions: of(&mesh.positions, &vertices),
        normals: of(&mesh.normals, &vertices),
        uvs: of(&mesh.uvs, &vertices),
        tangents: of(&mesh.tangents, &vertices),
        uvs_1: of(&mesh.uvs_1, &vertices),
        colors: of(&mesh.colors, &vertices),
        ..Mesh::default()
    };
    (own, if are_points { POINTS } else { LINES })
}

/// The attributes of a mesh's vertices.
fn vertices(mesh: &Mesh, document: &mut DocumentBuilder) -> Value {
    let binary = &mut document.binary;
    let mut attributes = json!({ "POSITION": binary.vertices(&mesh.positions, true) });
    attributes["NORMAL"] = binary.vertices(&mesh.normals, false).into();
    let mut more = |semantic: &str, values: Option<usize>| {
        if let Some(values) = values {
            attributes[semantic] = values.into();
        }
    };
    let some = |is_there: bool| is_there.then_some(());
    more("TANGENT", some(!mesh.tangents.is_empty()).map(|()| binary.vertices(&mesh.tangents, false)));
    // The second set counts from the first, which must be there.
    let blank = vec![[0.0; 2]; if mesh.uvs.is_empty() && !mesh.uvs_1.is_empty() { mesh.positions.len() } else { 0 }];
    let uvs = if blank.is_empty() { &mesh.uvs } else { &blank };
    more("TEXCOORD_0", some(!uvs.is_empty()).map(|()| binary.vertices(uvs, false)));
    more("TEXCOORD_1", some(!mesh.uvs_1.is_empty()).map(|()| binary.vertices(&mesh.uvs_1, false)));
    more("COLOR_0", some(!mesh.colors.is_empty()).map(|()| binary.vertices(&mesh.colors, false)));
    json!({ "attributes": attributes })
}

/// Writes a light by KHR_lights_punctual. The light's extras hold the values that the extension lacks and this program's reader looks at.
fn light(light: &Light, document: &mut DocumentBuilder) {
    let form = light.kind.form();
    let extension = document.uses("KHR_lights_punctual");
    let mut json = json!({
        "name": light.name,
        "type": form.name,
        "color": light.color.to_array().map(number),
        "intensity": number(light.intensity),
        "extras": { "afterlight": { "casts_shadow": light.casts_shadow, "size": light.size } },
    });
    if let Some(range) = form.range {
        json["range"] = range.into();
    }
    if let Outline::Cone { inner, outer } = form.outline {
        json["spot"] = json!({ "innerConeAngle": inner.to_radians(), "outerConeAngle": outer.to_radians() });
    }
    document.lights.push(json);
    let place = form.place.unwrap_or(DVec3::ZERO);
    let keys = match light.kind {
        LightKind::Point { .. } => turned(place, glam::DQuat::IDENTITY),
        _ => aimed(place, form.direction.and_then(unit).unwrap_or(DVec3::NEG_Z)),
    };
    let number = document.lights.len() - 1;
    root(document, keys, json!({ "name": light.name, "extensions": { extension: { "light": number } } }));
}
