//! Faults of nodes, skins, clips and deformed meshes, in words that name each by number and name.

use super::{
    Channel, ChannelTarget, Clip, Influences, Interpolation, Local, MaterialValue, Morph, Motion, Skin, values,
};
use crate::check::{dangling, first_of, fits, infinite, not_finite};
use crate::{Mesh, Object, Scene, TextureSlot};

/// The greatest difference of a vertex's sum of weights from 1: readers divide by the sum, and then only f32 rounds.
const SUM_SLACK: f64 = 1e-4;

/// The largest magnitude of a key: products and cubics of keys stay finite.
const MOST: f64 = 1e18;

impl Scene {
    /// Returns the first fault of nodes, skins, clips, and of objects, lights and cameras that hang on them.
    pub fn motion_fault(&self) -> Option<String> {
        let motion = &self.motion;
        let nodes = motion.nodes.len();
        first_node(motion)
            .or_else(|| first_of("skin", &motion.skins, |skin| (&skin.name, skin.fault(nodes))))
            .or_else(|| first_of("clip", &motion.clips, |clip| (&clip.name, clip.fault(self))))
            .or_else(|| self.light_nodes_fault())
            .or_else(|| {
                first_of("camera", &self.cameras, |own| {
                    let node = own.node.and_then(|node| dangling("node", node, nodes));
                    (&own.name, own.camera.fault().or(node))
                })
            })
            .or_else(|| {
                let camera = self.looks_through.and_then(|index| dangling("camera", index, self.cameras.len()));
                camera.map(|fault| format!("what it looks through: {fault}"))
            })
            .or_else(|| first_of("object", &self.objects, |object| (&object.name, object.motion_fault(self))))
    }

    fn light_nodes_fault(&self) -> Option<String> {
        let (nodes, lights) = (&self.motion.light_nodes, self.lights.len());
        if nodes.len() > lights {
            return Some(format!("there are nodes for {} lights, but the scene has {lights}", nodes.len()));
        }
        let of_one = |(index, node): (usize, &Option<usize>)| {
            let fault = dangling("node", (*node)?, self.motion.nodes.len())?;
            Some(format!("light {index} (`{}`): {fault}", self.lights[index].name))
        };
        nodes.iter().enumerate().find_map(of_one)
    }
}

fn first_node(motion: &Motion) -> Option<String> {
    motion.nodes.iter().enumerate().find_map(|(index, node)| {
        let parent = node.parent.filter(|&parent| parent >= index);
        let parent = parent.map(|parent| format!("its parent is number {parent}: parents come before their children"));
        let place = || match node.local {
            Local::Fixed(transform) => (!fits(&transform)).then(|| infinite("its transform")),
            Local::Parts(own) => {
                let parts = [("translation", own.translation.is_finite()), ("scale", own.scale.is_finite())];
                let unfit = parts.into_iter().find(|(_, is_finite)| !is_finite);
                unfit.map(|(what, _)| infinite(&format!("its {what}"))).or_else(|| turn(&own.rotation.to_array()))
            }
        };
        let weights = || (!node.weights.iter().all(|weight| weight.is_finite())).then(|| infinite("a weight of it"));
        let fault = parent.or_else(place).or_else(weights)?;
        Some(format!("node {index} (`{}`): {fault}", node.name))
    })
}

/// A fault of a rotation.
fn turn(parts: &[f64]) -> Option<String> {
    if !parts.iter().all(|part| part.is_finite()) {
        return Some(infinite("its rotation"));
    }
    parts.iter().all(|part| *part == 0.0).then(|| "its rotation is a quaternion of length 0".into())
}

impl Skin {
    fn fault(&self, nodes: usize) -> Option<String> {
        let (joints, binds) = (self.joints.len(), self.inverse_bind.len());
        if joints == 0 {
            return Some("it has no joints".into());
        }
        if joints != binds {
            return Some(format!("it has {binds} inverse bind matrices for {joints} joints: expected as many"));
        }
        let joint = self.joints.iter().find_map(|&joint| dangling("joint", joint, nodes));
        let bind = || {
            let unfit = self.inverse_bind.iter().position(|bind| !fits(bind))?;
            Some(infinite(&format!("its inverse bind matrix {unfit}")))
        };
        joint.or_else(bind)
    }
}

impl Clip {
    fn fault(&self, scene: &Scene) -> Option<String> {
        let faults = self.channels.iter().enumerate();
        let first = faults.filter_map(|(index, channel)| Some((index, channel.fault(scene)?))).next();
        let twice = || {
            let mut targets: Vec<ChannelTarget> = self.channels.iter().map(|channel| channel.target).collect();
            targets.sort_unstable();
            let same = targets.windows(2).find(|pair| pair[0] == pair[1])?;
            Some(format!("two of its channels move {:?}", same[0]))
        };
        first.map(|(index, fault)| format!("channel {index}: {fault}")).or_else(twice)
    }
}

impl Channel {
    fn fault(&self, scene: &Scene) -> Option<String> {
        if let Some(fault) = self.target_fault(scene) {
            return Some(fault);
        }
        let (keys, values) = (self.times.len(), self.values.len());
        if keys == 0 {
            return Some("it has no keys".into());
        }
        let each = self.components(scene) * if self.interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        if values != keys.saturating_mul(each) {
            return Some(format!("it has {values} values for {keys} keys: expected {each} for each"));
        }
        if let Some(key) = self.times.iter().position(|time| !time.is_finite()) {
            return Some(infinite(&format!("the time of key {key}")));
        }
        if let Some(key) = self.times.windows(2).position(|pair| pair[1] <= pair[0]) {
            let (before, time) = (self.times[key], self.times[key + 1]);
            return Some(format!("key {} is at {time} s, which is not after the {before} s before it", key + 1));
        }
        if let Some(at) = self.values.iter().position(|value| value.is_nan() || value.abs() > MOST) {
            return Some(format!("a value of key {} is {}, not from -1e18 to 1e18", at / each, self.values[at]));
        }
        if let ChannelTarget::Cell(object) = self.target
            && let Some(fault) = self.cells_fault(scene, object)
        {
            return Some(fault);
        }
        let middle = if self.interpolation == Interpolation::CubicSpline { 4 } else { 0 };
        let is_turn = matches!(self.target, ChannelTarget::Rotation(_));
        let mut turns = self.values.chunks_exact(each).filter(|_| is_turn).enumerate();
        turns.find_map(|(key, value)| turn(&value[middle..middle + 4]).map(|fault| format!("key {key}: {fault}")))
    }

    /// A fault of the keys of a cell, of an object that there is.
    fn cells_fault(&self, scene: &Scene, object: usize) -> Option<String> {
        if self.interpolation != Interpolation::Step {
            return Some("it moves a cell, which changes at once: expected the interpolation Step".into());
        }
        let material = scene.materials.get(scene.objects.get(object)?.material)?;
        let is_cell = |value: &f64| value.fract() == 0.0 && (0.0..f64::from(material.cells())).contains(value);
        let key = self.values.iter().position(|value| !is_cell(value))?;
        let ([rows, columns], last) = (material.atlas, material.cells().saturating_sub(1));
        let (name, value) = (&material.name, self.values[key]);
        Some(format!(
            "key {key} is cell {value}, but the atlas of material `{name}` is {rows}x{columns}: expected 0 to {last}"
        ))
    }

    fn target_fault(&self, scene: &Scene) -> Option<String> {
        let nodes = &scene.motion.nodes;
        match self.target {
            ChannelTarget::Translation(node) | ChannelTarget::Rotation(node) | ChannelTarget::Scale(node) => {
                match nodes.get(node) {
                    None => dangling("node", node, nodes.len()),
                    Some(own) => matches!(own.local, Local::Fixed(_)).then(|| {
                        format!("it moves node {node} (`{}`), which stands by one transform: it needs parts", own.name)
                    }),
                }
            }
            ChannelTarget::Weights(node) => match nodes.get(node) {
                None => dangling("node", node, nodes.len()),
                Some(own) => own
                    .weights
                    .is_empty()
                    .then(|| format!("it moves the weights of node {node} (`{}`), which has none", own.name)),
            },
            ChannelTarget::Light(light, _) => dangling("light", light, scene.lights.len()),
            ChannelTarget::Cell(object) => dangling("object", object, scene.objects.len()),
            ChannelTarget::Camera(camera, _) => dangling("camera", camera, scene.cameras.len()),
            ChannelTarget::Material(material, value) => {
                let slot = match value {
                    MaterialValue::UvOffset(slot) | MaterialValue::UvRotation(slot) | MaterialValue::UvScale(slot) => {
                        Some(slot)
                    }
                    _ => None,
                };
                let slots = TextureSlot::ALL.len();
                let slot = slot.filter(|&slot| usize::from(slot) >= slots);
                let slot = slot.map(|slot| format!("it moves texture slot {slot}, but there are {slots}"));
                dangling("material", material, scene.materials.len()).or(slot)
            }
        }
    }

    /// Values that its target has.
    fn components(&self, scene: &Scene) -> usize {
        match self.target {
            ChannelTarget::Translation(_) | ChannelTarget::Scale(_) => 3,
            ChannelTarget::Rotation(_) => 4,
            ChannelTarget::Weights(node) => scene.motion.nodes.get(node).map_or(0, |node| node.weights.len()),
            other => values::count(other),
        }
    }
}

impl Object {
    fn motion_fault(&self, scene: &Scene) -> Option<String> {
        let motion = &scene.motion;
        let node = self.node.and_then(|node| dangling("node", node, motion.nodes.len()));
        node.or_else(|| dangling("skin", self.skin?, motion.skins.len())).or_else(|| {
            let (skin, mesh) = (motion.skins.get(self.skin?)?, scene.meshes.get(self.mesh)?);
            let Some(influences) = &mesh.influences else {
                return Some(format!("it has a skin, but its mesh {} (`{}`) has no joints", self.mesh, mesh.name));
            };
            let joint = influences.joints.iter().copied().max().map_or(0, usize::from);
            let count = skin.joints.len();
            (joint >= count).then(|| {
                let mesh = format!("mesh {} (`{}`)", self.mesh, mesh.name);
                format!("its {mesh} hangs on joint {joint}, but its skin (`{}`) has {count}", skin.name)
            })
        })
    }
}

impl Mesh {
    /// A fault of its influences and shapes, and of the values beside them.
    pub fn motion_fault(&self) -> Option<String> {
        let vertices = self.positions.len();
        let lengths = [("second texture coordinates", self.uvs_1.len()), ("colours", self.colors.len())];
        let length = lengths.into_iter().find(|(_, length)| *length != 0 && *length != vertices);
        length
            .map(|(what, length)| format!("it has {length} {what} for {vertices} positions: expected as many, or none"))
            .or_else(|| not_finite("second texture coordinate", &self.uvs_1))
            .or_else(|| not_finite("colour", &self.colors))
            .or_else(|| self.influences.as_ref().and_then(|own| own.fault(vertices)))
            .or_else(|| first_of("shape", &self.morphs, |shape| (&shape.name, shape.fault(vertices))))
    }
}

impl Influences {
    fn fault(&self, vertices: usize) -> Option<String> {
        let (each, joints, weights) = (self.per_vertex, self.joints.len(), self.weights.len());
        if each != 4 && each != 8 {
            return Some(format!("each of its vertices hangs on {each} joints: expected 4 or 8"));
        }
        if [joints, weights] != [vertices * each; 2] {
            return Some(format!(
                "it has {joints} joints and {weights} weights for {vertices} positions: expected {each} of both for each"
            ));
        }
        let unfit = self.weights.chunks_exact(each).position(|own| {
            let sum: f64 = own.iter().map(|&weight| f64::from(weight)).sum();
            own.iter().any(|weight| *weight < 0.0) || (sum - 1.0).abs() > SUM_SLACK || sum.is_nan()
        });
        unfit.map(|vertex| {
            let own = &self.weights[vertex * each..][..each];
            format!("the weights of vertex {vertex} are {own:?}: expected none below 0, and a sum of 1")
        })
    }
}

impl Morph {
    fn fault(&self, vertices: usize) -> Option<String> {
        let lengths = [
            ("positions", self.positions.len()),
            ("normals", self.normals.len()),
            ("tangents", self.tangents.len()),
            ("texture coordinates", self.uvs.len()),
            ("colours", self.colors.len()),
        ];
        let length = lengths.into_iter().find(|(_, length)| *length != 0 && *length != vertices);
        length
            .map(|(what, length)| format!("it has {length} {what} for {vertices} positions: expected as many, or none"))
            .or_else(|| not_finite("position", &self.positions))
            .or_else(|| not_finite("normal", &self.normals))
            .or_else(|| not_finite("tangent", &self.tangents))
            .or_else(|| not_finite("texture coordinate", &self.uvs))
            .or_else(|| not_finite("colour", &self.colors))
    }
}
