//! The triangles of an animated glTF file at a time of a clip, evaluated in f64 straight from the specification's formulas. This evaluation shares no
//! code with the program and reads only the features of a handful of models: floats and unsigned integers, TRS and matrices, skins of four weights,
//! morph targets of positions, triangles. Anything else in a file ends in a panic.

use std::fs;
use std::path::Path;

use glam::{DMat4, DQuat, DVec3, DVec4};
use serde_json::Value;

/// A file with its buffers.
pub struct PlainGltf {
    json: Value,
    buffers: Vec<Vec<u8>>,
}

/// A triangle in the world.
pub struct Placed {
    pub corners: [DVec3; 3],
    /// True if its back is seen as well.
    pub two_sided: bool,
}

/// The local transforms and the weights of all nodes at a time.
struct Moment {
    locals: Vec<DMat4>,
    weights: Vec<Vec<f64>>,
}

fn number(value: &Value) -> usize {
    value.as_u64().expect("an unsigned integer") as usize
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn floats(value: &Value) -> Option<Vec<f64>> {
    Some(value.as_array()?.iter().map(|own| own.as_f64().expect("a number")).collect())
}

fn quaternion(value: &[f64]) -> DVec4 {
    DVec4::from_slice(value).normalize()
}

impl PlainGltf {
    pub fn read(path: &Path) -> Self {
        let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        if bytes.starts_with(b"glTF") {
            let chunk = |at: usize| {
                let length = u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize;
                &bytes[at + 8..at + 8 + length]
            };
            let json = chunk(12);
            let own = chunk(20 + json.len()).to_vec();
            return Self { json: serde_json::from_slice(json).expect("JSON"), buffers: vec![own] };
        }
        let json: Value = serde_json::from_slice(&bytes).expect("JSON");
        let beside = |buffer: &Value| path.with_file_name(buffer["uri"].as_str().expect("a file"));
        let buffers = list(&json["buffers"]).iter().map(|own| fs::read(beside(own)).expect("a buffer")).collect();
        Self { json, buffers }
    }

    /// The elements of an accessor.
    fn accessor(&self, index: &Value) -> Vec<Vec<f64>> {
        let accessor = &self.json["accessors"][number(index)];
        assert!(accessor["sparse"].is_null(), "a sparse accessor");
        let view = &self.json["bufferViews"][number(&accessor["bufferView"])];
        let width = match accessor["type"].as_str() {
            Some("SCALAR") => 1,
            Some("VEC2") => 2,
            Some("VEC3") => 3,
            Some("VEC4") => 4,
            Some("MAT4") => 16,
            other => panic!("type {other:?}"),
        };
        let (bytes, parse): (usize, fn(&[u8]) -> f64) = match accessor["componentType"].as_u64() {
            Some(5121) => (1, |own| f64::from(own[0])),
            Some(5123) => (2, |own| f64::from(u16::from_le_bytes([own[0], own[1]]))),
            Some(5126) => (4, |own| f64::from(f32::from_le_bytes([own[0], own[1], own[2], own[3]]))),
            other => panic!("component type {other:?}"),
        };
        let offset = |own: &Value| own["byteOffset"].as_u64().unwrap_or(0) as usize;
        let first = offset(view) + offset(accessor);
        let stride = view["byteStride"].as_u64().map_or(width * bytes, |stride| stride as usize);
        let buffer = &self.buffers[number(&view["buffer"])];
        let element = |index: usize| {
            let at = first + index * stride;
            (0..width).map(|own| parse(&buffer[at + own * bytes..][..bytes])).collect()
        };
        (0..number(&accessor["count"])).map(element).collect()
    }

    pub fn clips(&self) -> usize {
        list(&self.json["animations"]).len()
    }

    /// The last key of a clip, in seconds.
    pub fn duration(&self, clip: usize) -> f64 {
        let samplers = list(&self.json["animations"][clip]["samplers"]);
        samplers.iter().flat_map(|own| self.accessor(&own["input"])).map(|time| time[0]).fold(0.0, f64::max)
    }

    /// The value of a sampler at a time (appendix C of the specification).
    fn sample(&self, sampler: &Value, time: f64, rotates: bool) -> Vec<f64> {
        let times: Vec<f64> = self.accessor(&sampler["input"]).iter().map(|time| time[0]).collect();
        let values = self.accessor(&sampler["output"]).concat();
        let cubic = sampler["interpolation"] == "CUBICSPLINE";
        let width = values.len() / times.len() / if cubic { 3 } else { 1 };
        // The i-th value of a key: of a spline its arriving tangent, its value and its leaving tangent.
        let part = |key: usize, i: usize| &values[(key * if cubic { 3 } else { 1 } + i) * width..][..width];
        let at = |key: usize| part(key, usize::from(cubic)).to_vec();
        let next = times.iter().position(|key| *key > time).unwrap_or(times.len());
        if next == 0 || next == times.len() {
            return at(next.saturating_sub(1));
        }
        let (a, b) = (at(next - 1), at(next));
        let seconds = times[next] - times[next - 1];
        let t = (time - times[next - 1]) / seconds;
        let mix = |from: &[f64], to: &[f64], x: f64, y: f64| from.iter().zip(to).map(|(a, b)| a * x + b * y).collect();
        if sampler["interpolation"] == "STEP" {
            a
        } else if cubic {
            let (leaving, arriving) = (part(next - 1, 2), part(next, 0));
            let (t2, t3) = (t * t, t * t * t);
            let keys: Vec<f64> = mix(&a, &b, 2.0 * t3 - 3.0 * t2 + 1.0, -2.0 * t3 + 3.0 * t2);
            let tangents: Vec<f64> = mix(leaving, arriving, seconds * (t3 - 2.0 * t2 + t), seconds * (t3 - t2));
            mix(&keys, &tangents, 1.0, 1.0)
        } else if rotates {
            let (a, b) = (quaternion(&a), quaternion(&b));
            let b = if a.dot(b) < 0.0 { -b } else { b };
            let angle = a.dot(b).min(1.0).acos();
            let (x, y) = if angle < 1e-4 { (1.0 - t, t) } else { (((1.0 - t) * angle).sin(), (t * angle).sin()) };
            (a * x + b * y).normalize().to_array().to_vec()
        } else {
            mix(&a, &b, 1.0 - t, t)
        }
    }

    /// Returns a node's translation, rotation, scale or weights at a time of a clip, if the clip moves them.
    fn moved(&self, clip: Option<usize>, node: usize, path: &str, time: f64) -> Option<Vec<f64>> {
        let clip = &self.json["animations"][clip?];
        let own = |channel: &&Value| {
            channel["target"]["node"].as_u64() == Some(node as u64) && channel["target"]["path"] == path
        };
        let channel = list(&clip["channels"]).iter().find(own)?;
        Some(self.sample(&clip["samplers"][number(&channel["sampler"])], time, path == "rotation"))
    }

    fn moment(&self, clip: Option<usize>, time: f64) -> Moment {
        let nodes = list(&self.json["nodes"]).iter().enumerate();
        let (locals, weights) = nodes
            .map(|(index, node)| {
                let value = |path: &str| self.moved(clip, index, path, time).or_else(|| floats(&node[path]));
                let translation = value("translation").map_or(DVec3::ZERO, |own| DVec3::from_slice(&own));
                let rotation = value("rotation").map_or(DVec4::W, |own| quaternion(&own));
                let scale = value("scale").map_or(DVec3::ONE, |own| DVec3::from_slice(&own));
                let parts = DMat4::from_scale_rotation_translation(scale, DQuat::from_vec4(rotation), translation);
                let local = floats(&node["matrix"]).map_or(parts, |own| DMat4::from_cols_slice(&own));
                let mesh = node["mesh"].as_u64().map(|mesh| &self.json["meshes"][mesh as usize]);
                let weights = value("weights").or_else(|| floats(&mesh?["weights"]));
                (local, weights.unwrap_or_default())
            })
            .unzip();
        Moment { locals, weights }
    }

    fn parent(&self, node: usize) -> Option<usize> {
        let has = |own: &Value| list(&own["children"]).iter().any(|child| number(child) == node);
        list(&self.json["nodes"]).iter().position(has)
    }

    fn world(&self, moment: &Moment, node: usize) -> DMat4 {
        let above = self.parent(node).map_or(DMat4::IDENTITY, |parent| self.world(moment, parent));
        above * moment.locals[node]
    }

    /// All triangles at a time of a clip, or at rest.
    pub fn triangles(&self, clip: Option<usize>, time: f64) -> Vec<Placed> {
        let moment = self.moment(clip, time);
        let mut placed = Vec::new();
        for (index, node) in list(&self.json["nodes"]).iter().enumerate() {
            let Some(mesh) = node["mesh"].as_u64() else { continue };
            let world = self.world(&moment, index);
            let joints = node["skin"].as_u64().map(|skin| self.joints(skin as usize, &moment));
            for primitive in list(&self.json["meshes"][mesh as usize]["primitives"]) {
                assert_eq!(primitive["mode"].as_u64().unwrap_or(4), 4, "triangles only");
                let points = self.points(primitive, &moment.weights[index], &world, joints.as_deref());
                let two_sided = primitive["material"]
                    .as_u64()
                    .is_some_and(|material| self.json["materials"][material as usize]["doubleSided"] == true);
                let indices: Vec<usize> = match &primitive["indices"] {
                    Value::Null => (0..points.len()).collect(),
                    indices => self.accessor(indices).iter().map(|own| own[0] as usize).collect(),
                };
                let corners = indices.as_chunks::<3>().0.iter().map(|three| three.map(|own| points[own]));
                placed.extend(corners.map(|corners| Placed { corners, two_sided }));
            }
        }
        placed
    }

    /// Returns the matrices of a skin, from the mesh to the world, by joint.
    fn joints(&self, skin: usize, moment: &Moment) -> Vec<DMat4> {
        let skin = &self.json["skins"][skin];
        let binds = self.accessor(&skin["inverseBindMatrices"]);
        let joints = list(&skin["joints"]).iter().zip(&binds);
        joints.map(|(joint, bind)| self.world(moment, number(joint)) * DMat4::from_cols_slice(bind)).collect()
    }

    /// The vertices of a primitive in the world.
    fn points(&self, primitive: &Value, weights: &[f64], world: &DMat4, joints: Option<&[DMat4]>) -> Vec<DVec3> {
        let of =
            |attributes: &Value, name: &str| (!attributes[name].is_null()).then(|| self.accessor(&attributes[name]));
        let mut points: Vec<DVec3> =
            self.accessor(&primitive["attributes"]["POSITION"]).iter().map(|own| DVec3::from_slice(own)).collect();
        for (target, weight) in list(&primitive["targets"]).iter().zip(weights) {
            let more = of(target, "POSITION").unwrap_or_default();
            points.iter_mut().zip(more).for_each(|(point, more)| *point += *weight * DVec3::from_slice(&more));
        }
        let hung = of(&primitive["attributes"], "JOINTS_0").zip(of(&primitive["attributes"], "WEIGHTS_0"));
        let (Some(joints), Some((indices, shares))) = (joints, hung) else {
            return points.iter().map(|point| world.transform_point3(*point)).collect();
        };
        let blended = |(vertex, point): (usize, &DVec3)| {
            let sum: f64 = shares[vertex].iter().sum();
            let own = indices[vertex].iter().zip(&shares[vertex]);
            own.map(|(joint, share)| joints[*joint as usize].transform_point3(*point) * (share / sum)).sum()
        };
        points.iter().enumerate().map(blended).collect()
    }
}
