//! A binary glTF file of models, textures, lights and clips. Normals and tints have 8 bits (KHR_mesh_quantization); vertices and triangles are
//! packed (EXT_meshopt_compression).

use glam::{DAffine3, DQuat, DVec3};
use meshoptimizer_rs::Workspace;
use meshoptimizer_rs::codec::{IndexEncoding, VertexEncoding, encode_index_buffer, encode_vertex_buffer};
use serde_json::{Map, Value, json};

use super::model::{Model, Part};
use super::paint::EncodedImage;

/// One property of a node that a clip moves, with its keys.
pub struct NodeChannel {
    pub target: Target,
    pub times: Vec<f64>,
    /// All components of the first key, then those of the next.
    pub values: Vec<f64>,
}

pub enum Target {
    Rotation(usize),
    Translation(usize),
    Weights(usize),
    /// A property of the file, by KHR_animation_pointer.
    Pointer(String),
}

#[derive(Default)]
pub struct Glb {
    bytes: Vec<u8>,
    /// The size of the packed data when unpacked.
    unpacked: usize,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    roots: Vec<usize>,
    images: Vec<Value>,
    textures: Vec<Value>,
    names: Vec<String>,
    materials: Vec<Value>,
    material_names: Vec<String>,
    lights: Vec<Value>,
    animations: Vec<Value>,
}

/// Rounds, so that the last bits of other mathematics libraries do not show.
fn tidy(value: f64) -> f64 {
    let rounded = (value * 1e6).round() / 1e6;
    if rounded == 0.0 { 0.0 } else { rounded }
}

fn numbers(values: &[f64]) -> Value {
    values.iter().map(|&value| tidy(value)).collect()
}

impl Glb {
    pub fn pictures(&mut self, pictures: &[EncodedImage]) {
        for picture in pictures {
            let view = self.view(&picture.bytes);
            self.images.push(json!({"name": picture.name, "mimeType": picture.mime, "bufferView": view}));
            self.textures.push(json!({"source": self.images.len() - 1}));
            self.names.push(picture.name.clone());
        }
    }

    /// The number of a texture.
    pub fn texture(&self, name: &str) -> usize {
        self.names.iter().position(|other| other == name).expect("a texture that was painted")
    }

    pub fn material(&mut self, name: &str, mut material: Value) {
        material["name"] = name.into();
        self.materials.push(material);
        self.material_names.push(name.into());
    }

    pub fn material_number(&self, name: &str) -> usize {
        self.material_names.iter().position(|other| other == name).expect("a material of the harbour")
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        self.bytes.extend_from_slice(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    /// Packs elements of so many bytes.
    fn packed(&mut self, bytes: &[u8], stride: usize) -> usize {
        let encoding = VertexEncoding::new(0, 2).expect("a version that the extension has");
        let small = encode_vertex_buffer(bytes, bytes.len() / stride, stride, encoding, &mut Workspace::default());
        self.packed_view(&small.expect("whole elements"), bytes.len(), stride, "ATTRIBUTES")
    }

    fn packed_view(&mut self, small: &[u8], whole: usize, stride: usize, mode: &str) -> usize {
        let number = self.view(small);
        let mut view = self.views[number].take();
        view["byteStride"] = stride.into();
        view["count"] = (whole / stride).into();
        view["mode"] = mode.into();
        let mut outer = json!({"buffer": 1, "byteOffset": self.unpacked, "byteLength": whole});
        if mode == "ATTRIBUTES" {
            outer["byteStride"] = stride.into();
        }
        outer["extensions"] = json!({"EXT_meshopt_compression": view});
        self.views[number] = outer;
        self.unpacked += whole.next_multiple_of(4);
        number
    }

    fn accessor(&mut self, view: usize, accessor: Value) -> usize {
        let mut accessor = accessor;
        accessor["bufferView"] = view.into();
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Floats of half a millimetre each, which pack well, and their bounds.
    fn positions(&mut self, points: &[DVec3]) -> usize {
        let rounded: Vec<[f32; 3]> =
            points.iter().map(|point| ((*point * 2048.0).round() / 2048.0 + 0.0).as_vec3().to_array()).collect();
        let bytes: Vec<u8> = rounded.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
        let view = self.packed(&bytes, 12);
        let axis = |axis: usize| rounded.iter().map(move |point| point[axis]);
        let min: Vec<f32> = (0..3).map(|i| axis(i).fold(f32::INFINITY, f32::min)).collect();
        let max: Vec<f32> = (0..3).map(|i| axis(i).fold(f32::NEG_INFINITY, f32::max)).collect();
        let accessor = json!({"componentType": 5126, "count": points.len(), "type": "VEC3", "min": min, "max": max});
        self.accessor(view, accessor)
    }

    fn normals(&mut self, normals: &[DVec3]) -> usize {
        let bytes: Vec<u8> = normals
            .iter()
            .flat_map(|normal| (*normal * 127.0).round().to_array())
            .collect::<Vec<f64>>()
            .chunks(3)
            .flat_map(|normal| [normal[0] as i8 as u8, normal[1] as i8 as u8, normal[2] as i8 as u8, 0])
            .collect();
        let view = self.packed(&bytes, 4);
        self.accessor(view, json!({"componentType": 5120, "normalized": true, "count": normals.len(), "type": "VEC3"}))
    }

    fn floats(&mut self, values: &[f64], kind: &str, width: usize) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|&value| (tidy(value) as f32).to_le_bytes()).collect();
        let view = self.packed(&bytes, width * 4);
        let count = values.len() / width;
        let mut accessor = json!({"componentType": 5126, "count": count, "type": kind});
        if kind == "SCALAR" && width == 1 {
            let as_stored = |value: f64| f64::from(tidy(value) as f32);
            accessor["min"] = json!([values.iter().copied().map(as_stored).fold(f64::INFINITY, f64::min)]);
            accessor["max"] = json!([values.iter().copied().map(as_stored).fold(f64::NEG_INFINITY, f64::max)]);
        }
        self.accessor(view, accessor)
    }

    /// Writes a model once; each of `shapes` is the same model with other points, to be blended in.
    pub fn mesh(&mut self, name: &str, model: &Model, shapes: &[Model]) -> usize {
        let mut primitives = Vec::new();
        for (material, part) in &model.parts {
            let mut attributes = Map::new();
            attributes.insert("POSITION".into(), self.positions(&part.points).into());
            attributes.insert("NORMAL".into(), self.normals(&part.normals).into());
            let textured = self.materials[self.material_number(material)].to_string().contains("Texture");
            if textured {
                let uvs: Vec<f64> =
                    part.uvs.iter().flat_map(|uv| uv.to_array()).map(|uv| (uv * 4096.0).round() / 4096.0).collect();
                attributes.insert("TEXCOORD_0".into(), self.floats(&uvs, "VEC2", 2).into());
            }
            if part.tints.iter().any(|tint| *tint != DVec3::ONE) {
                let bytes: Vec<u8> = part
                    .tints
                    .iter()
                    .flat_map(|tint| tint.extend(1.0).to_array())
                    .map(|channel| (channel.clamp(0.0, 1.0) * 255.0).round() as u8)
                    .collect();
                let view = self.packed(&bytes, 4);
                let accessor =
                    json!({"componentType": 5121, "normalized": true, "count": part.tints.len(), "type": "VEC4"});
                attributes.insert("COLOR_0".into(), self.accessor(view, accessor).into());
            }
            let indices = self.indices(part);
            let mut primitive =
                json!({"attributes": attributes, "indices": indices, "material": self.material_number(material)});
            if !shapes.is_empty() {
                let targets: Vec<Value> = shapes
                    .iter()
                    .map(|shape| {
                        let other = &shape.parts[material];
                        let moves: Vec<DVec3> = other.points.iter().zip(&part.points).map(|(a, b)| a - b).collect();
                        // A difference of normals may be longer than 1: floats hold it.
                        let turns: Vec<f64> =
                            other.normals.iter().zip(&part.normals).flat_map(|(a, b)| (a - b).to_array()).collect();
                        json!({"POSITION": self.positions(&moves), "NORMAL": self.floats(&turns, "VEC3", 3)})
                    })
                    .collect();
                primitive["targets"] = targets.into();
            }
            primitives.push(primitive);
        }
        let mut mesh = json!({"name": name, "primitives": primitives});
        if !shapes.is_empty() {
            mesh["weights"] = vec![0.0; shapes.len()].into();
        }
        self.meshes.push(mesh);
        self.meshes.len() - 1
    }

    fn indices(&mut self, part: &Part) -> usize {
        let indices: Vec<u32> = part.triangles.iter().flatten().copied().collect();
        assert!(part.points.len() < 65536, "indices have 16 bits");
        let small =
            encode_index_buffer(&indices, IndexEncoding::DEFAULT, &mut Workspace::default()).expect("whole triangles");
        let view = self.packed_view(&small, indices.len() * 2, 2, "TRIANGLES");
        self.accessor(view, json!({"componentType": 5123, "count": indices.len(), "type": "SCALAR"}))
    }

    /// A place for others.
    pub fn node(&mut self, name: &str, parent: Option<usize>, place: DAffine3) -> usize {
        let (scale, rotation, translation) = place.to_scale_rotation_translation();
        let mut node = json!({"name": name});
        if translation != DVec3::ZERO {
            node["translation"] = numbers(&translation.to_array());
        }
        if rotation.dot(DQuat::IDENTITY).abs() < 1.0 - 1e-15 {
            node["rotation"] = numbers(&rotation.to_array());
        }
        if (scale - DVec3::ONE).length() > 1e-9 {
            node["scale"] = numbers(&scale.to_array());
        }
        self.nodes.push(node);
        let number = self.nodes.len() - 1;
        match parent {
            Some(parent) => self.child(parent, number),
            None => self.roots.push(number),
        }
        number
    }

    fn child(&mut self, parent: usize, child: usize) {
        match self.nodes[parent]["children"].as_array_mut() {
            Some(children) => children.push(child.into()),
            None => self.nodes[parent]["children"] = json!([child]),
        }
    }

    /// A mesh at a place; the node that holds the mesh is returned.
    pub fn put(&mut self, mesh: usize, parent: Option<usize>, place: DAffine3) -> usize {
        let name = self.meshes[mesh]["name"].as_str().expect("a name").to_owned();
        let number = self.node(&name, parent, place);
        self.nodes[number]["mesh"] = mesh.into();
        number
    }

    /// A mesh at many places, each with a turn about Y in radians and a size (EXT_mesh_gpu_instancing).
    pub fn scatter(&mut self, mesh: usize, places: &[(DVec3, f64, f64)]) {
        let name = self.meshes[mesh]["name"].as_str().expect("a name").to_owned();
        let number = self.node(&name, None, DAffine3::IDENTITY);
        let moves: Vec<f64> = places.iter().flat_map(|(place, ..)| place.to_array()).collect();
        let turns: Vec<f64> = places.iter().flat_map(|&(_, turn, _)| DQuat::from_rotation_y(turn).to_array()).collect();
        let sizes: Vec<f64> = places.iter().flat_map(|&(.., size)| [size; 3]).collect();
        let attributes = json!({
            "TRANSLATION": self.floats(&moves, "VEC3", 3),
            "ROTATION": self.floats(&turns, "VEC4", 4),
            "SCALE": self.floats(&sizes, "VEC3", 3),
        });
        self.nodes[number]["mesh"] = mesh.into();
        self.nodes[number]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": attributes}});
    }

    pub fn light(&mut self, parent: Option<usize>, place: DAffine3, light: Value) {
        let name = light["name"].as_str().expect("a name").to_owned();
        let number = self.node(&name, parent, place);
        self.nodes[number]["extensions"] = json!({"KHR_lights_punctual": {"light": self.lights.len()}});
        self.lights.push(light);
    }

    pub fn clip(&mut self, name: &str, channels: Vec<NodeChannel>) {
        let (mut samplers, mut list) = (Vec::new(), Vec::new());
        for channel in channels {
            let (kind, width, target) = match &channel.target {
                Target::Rotation(node) => ("VEC4", 4, json!({"node": node, "path": "rotation"})),
                Target::Translation(node) => ("VEC3", 3, json!({"node": node, "path": "translation"})),
                Target::Weights(node) => ("SCALAR", 1, json!({"node": node, "path": "weights"})),
                Target::Pointer(pointer) => (
                    "VEC2",
                    2,
                    json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}),
                ),
            };
            let input = self.floats(&channel.times, "SCALAR", 1);
            let output = self.floats(&channel.values, kind, width);
            samplers.push(json!({"input": input, "output": output, "interpolation": "LINEAR"}));
            list.push(json!({"sampler": samplers.len() - 1, "target": target}));
        }
        self.animations.push(json!({"name": name, "samplers": samplers, "channels": list}));
    }

    /// The file.
    pub fn finish(mut self, name: &str) -> Vec<u8> {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let document = json!({
            "asset": {"version": "2.0", "generator": "examples/harbour of Afterlight", "copyright": "CC0"},
            "extensionsUsed": ["EXT_mesh_gpu_instancing", "EXT_meshopt_compression", "KHR_animation_pointer", "KHR_lights_punctual", "KHR_materials_emissive_strength",
                "KHR_materials_ior", "KHR_mesh_quantization", "KHR_texture_transform"],
            "extensionsRequired": ["EXT_mesh_gpu_instancing", "EXT_meshopt_compression", "KHR_mesh_quantization"],
            "extensions": {"KHR_lights_punctual": {"lights": self.lights}},
            "scene": 0,
            "scenes": [{"name": name, "nodes": self.roots}],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
            "textures": self.textures,
            "images": self.images,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": self.bytes.len()}, {"byteLength": self.unpacked, "extensions": {"EXT_meshopt_compression": {"fallback": true}}}],
            "animations": self.animations,
        });
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut file = Vec::new();
        let words = |file: &mut Vec<u8>, words: [u32; 2]| file.extend(words.iter().flat_map(|word| word.to_le_bytes()));
        file.extend(b"glTF");
        words(&mut file, [2, (12 + 8 + text.len() + 8 + self.bytes.len()) as u32]);
        words(&mut file, [text.len() as u32, 0x4e4f_534a]);
        file.extend(text);
        words(&mut file, [self.bytes.len() as u32, 0x004e_4942]);
        file.extend(self.bytes);
        file
    }
}
