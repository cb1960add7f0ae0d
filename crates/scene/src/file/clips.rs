//! `[[clips]]`: keys that move models, lights and the camera.

use std::collections::HashSet;

use glam::{DQuat, DVec3};

use super::models::ModelMaterials;
use super::node::{
    CONE_ANGLE, COORDINATE, FACTOR, FIELD_OF_VIEW, KeyedValue, LENGTH, NumberRange, RADIUS, STRENGTH, TIME, Table,
};
use super::{place, schema};
use crate::suggest::unknown;
use crate::{
    CameraValue, Channel, ChannelTarget, Clip, Error, Interpolation, LightValue, Local, MAX_ATLAS_EDGE, NamedCamera,
    Placement, Scene, motion, unit,
};

/// The most degrees between two keys of a turn: quaternions take the shorter way.
const MOST_TURN: f64 = 90.0;
/// The most keys that a turn of whole turns is cut into.
const MOST_KEYS: usize = 100_000;

/// The property that a key moves.
#[derive(Clone, Copy, PartialEq)]
enum Property {
    Translation,
    Rotation,
    Scale,
    Light(LightValue),
    Camera(CameraValue),
    Cell,
}

/// A property by its word, and the limit of its values.
struct AnimatedProperty {
    word: &'static str,
    property: Property,
    limit: NumberRange,
    /// Of the file's unit in the scene's: degrees in radians, a height in half a height.
    unit: f64,
}

const DEGREES: f64 = std::f64::consts::PI / 180.0;

const MODEL: &[AnimatedProperty] = &[
    AnimatedProperty { word: "translation", property: Property::Translation, limit: COORDINATE, unit: 1.0 },
    AnimatedProperty { word: "rotation", property: Property::Rotation, limit: COORDINATE, unit: 1.0 },
    AnimatedProperty { word: "scale", property: Property::Scale, limit: FACTOR, unit: 1.0 },
    AnimatedProperty { word: "cell", property: Property::Cell, limit: FACTOR, unit: 1.0 },
];

const LIGHT: &[AnimatedProperty] = &[
    AnimatedProperty { word: "translation", property: Property::Translation, limit: COORDINATE, unit: 1.0 },
    AnimatedProperty { word: "rotation", property: Property::Rotation, limit: COORDINATE, unit: 1.0 },
    AnimatedProperty { word: "color", property: Property::Light(LightValue::Color), limit: STRENGTH, unit: 1.0 },
    AnimatedProperty {
        word: "intensity",
        property: Property::Light(LightValue::Intensity),
        limit: STRENGTH,
        unit: 1.0,
    },
    AnimatedProperty { word: "range", property: Property::Light(LightValue::Range), limit: RADIUS, unit: 1.0 },
    AnimatedProperty {
        word: "inner_angle_degrees",
        property: Property::Light(LightValue::InnerAngle),
        limit: CONE_ANGLE,
        unit: DEGREES,
    },
    AnimatedProperty {
        word: "outer_angle_degrees",
        property: Property::Light(LightValue::OuterAngle),
        limit: CONE_ANGLE,
        unit: DEGREES,
    },
];

const CAMERA: &[AnimatedProperty] = &[
    AnimatedProperty { word: "translation", property: Property::Translation, limit: COORDINATE, unit: 1.0 },
    AnimatedProperty { word: "rotation", property: Property::Rotation, limit: COORDINATE, unit: 1.0 },
    AnimatedProperty {
        word: "fov_y_degrees",
        property: Property::Camera(CameraValue::FovY),
        limit: FIELD_OF_VIEW,
        unit: DEGREES,
    },
    AnimatedProperty {
        word: "orthographic_height",
        property: Property::Camera(CameraValue::HalfHeight),
        limit: LENGTH,
        unit: 0.5,
    },
    AnimatedProperty { word: "near", property: Property::Camera(CameraValue::Near), limit: LENGTH, unit: 1.0 },
];

/// The names of models that some clip moves.
pub(super) fn moved_models(root: &Table) -> Result<HashSet<String>, Error> {
    let mut names = HashSet::new();
    for clip in root.list("clips")? {
        for channel in clip.table(schema::CLIP)?.list("channels")? {
            let table = channel.table(schema::CHANNEL)?;
            // A cell moves without a node.
            if table.read("property", KeyedValue::string)? == Some("cell") {
                continue;
            }
            let target = table.read("target", KeyedValue::string)?;
            names.extend(target.and_then(|target| target.strip_prefix("models.")).map(str::to_owned));
        }
    }
    Ok(names)
}

/// Adds the clips of the file. Models have their nodes already; lights from `first_light` on are the file's own, and the last of a name counts.
pub(super) fn add(root: &Table, scene: &mut Scene, models: &[ModelMaterials], first_light: usize) -> Result<(), Error> {
    let mut stage = AnimatedScene { scene, models, first_light };
    for (index, node) in root.list("clips")?.iter().enumerate() {
        let table = node.table(schema::CLIP)?;
        let name = table.read("name", KeyedValue::string)?.map_or_else(|| format!("clip {index}"), str::to_owned);
        let mut channels: Vec<Channel> = Vec::new();
        for node in table.list("channels")? {
            for channel in stage.channels(&node)? {
                if channels.iter().any(|other| other.target == channel.target) {
                    return Err(node.wrong("another channel of this clip moves the same"));
                }
                channels.push(channel);
            }
        }
        stage.scene.motion.clips.push(Clip { name, channels });
    }
    Ok(())
}

/// The scene whose things clips move.
struct AnimatedScene<'a> {
    scene: &'a mut Scene,
    models: &'a [ModelMaterials<'a>],
    first_light: usize,
}

impl AnimatedScene<'_> {
    /// A channel of the file: one for each thing that has its target's name.
    fn channels(&mut self, node: &KeyedValue) -> Result<Vec<Channel>, Error> {
        let table = node.table(schema::CHANNEL)?;
        let need = |key: &str| table.get(key).ok_or_else(|| table.wrong(&format!("needs {key}")));
        let (target, property) = (need("target")?, need("property")?);
        let name = target.string()?;
        let forms = match name.split_once('.') {
            Some(("models", _)) => MODEL,
            Some(("lights", _)) => LIGHT,
            None if name == "camera" => CAMERA,
            _ => return Err(target.wrong("must be \"models.NAME\", \"lights.NAME\" or \"camera\"")),
        };
        let words: Vec<&str> = forms.iter().map(|form| form.word).collect();
        let word = property.string()?;
        let form = forms.iter().find(|form| form.word == word);
        let form = form.ok_or_else(|| property.wrong(unknown("property", word, &words)))?;
        let keys = Keyframes::read(&table, form)?;
        let targets = self.targets(&target, form.property)?;
        let channel = |target| Channel {
            target,
            times: keys.times.clone(),
            values: keys.values.clone(),
            interpolation: keys.interpolation,
        };
        Ok(targets.into_iter().map(channel).collect())
    }

    fn targets(&mut self, target: &KeyedValue, property: Property) -> Result<Vec<ChannelTarget>, Error> {
        let name = target.string()?;
        if let Some(name) = name.strip_prefix("models.") {
            let own = self.models.iter().filter(|model| model.name == Some(name));
            let targets: Vec<ChannelTarget> = match property {
                Property::Cell => own.flat_map(|model| model.objects.clone().map(ChannelTarget::Cell)).collect(),
                _ => own.filter_map(|model| of_node(property, model.node?)).collect(),
            };
            return match targets.is_empty() {
                true => Err(target.wrong("no model of this file has this name")),
                false => Ok(targets),
            };
        }
        if let Some(name) = name.strip_prefix("lights.") {
            let lights = &self.scene.lights[self.first_light..];
            let Some(light) = lights.iter().rposition(|light| light.name == name) else {
                let names: Vec<&str> = lights.iter().map(|light| light.name.as_str()).collect();
                return Err(target.wrong(unknown("light of this file", name, &names)));
            };
            return self.of_light(target, self.first_light + light, property);
        }
        let camera = self.camera();
        Ok(match property {
            Property::Camera(value) => vec![ChannelTarget::Camera(camera, value)],
            other => {
                let node = self.node_of_camera(camera);
                of_node(other, node).into_iter().collect()
            }
        })
    }

    fn of_light(&mut self, target: &KeyedValue, light: usize, property: Property) -> Result<Vec<ChannelTarget>, Error> {
        if let Property::Light(value) = property {
            return Ok(vec![ChannelTarget::Light(light, value)]);
        }
        let form = self.scene.lights[light].kind.form();
        if property == Property::Translation && form.place.is_none() {
            return Err(target.wrong("a directional light has no place: it has a rotation"));
        }
        if property == Property::Rotation && form.direction.is_none() {
            return Err(target.wrong("this light shines all around: it has no rotation"));
        }
        let nodes = &mut self.scene.motion.light_nodes;
        nodes.resize(nodes.len().max(light + 1), None);
        let node = match nodes[light] {
            Some(node) => node,
            None => {
                let direction = form.direction.and_then(unit).unwrap_or(DVec3::NEG_Z);
                let rotation = DQuat::from_rotation_arc(DVec3::NEG_Z, direction);
                let translation = form.place.unwrap_or(DVec3::ZERO);
                let node = self.node(self.scene.lights[light].name.clone(), translation, rotation);
                self.scene.motion.light_nodes[light] = Some(node);
                node
            }
        };
        Ok(of_node(property, node).into_iter().collect())
    }

    /// Returns the index of the scene's camera in the list of cameras that clips move, and adds it if it is missing.
    fn camera(&mut self) -> usize {
        let cameras = &mut self.scene.cameras;
        *self.scene.looks_through.get_or_insert_with(|| {
            cameras.push(NamedCamera { name: "camera".into(), camera: self.scene.camera, node: None });
            cameras.len() - 1
        })
    }

    fn node_of_camera(&mut self, camera: usize) -> usize {
        if let Some(node) = self.scene.cameras[camera].node {
            return node;
        }
        let own = &self.scene.cameras[camera];
        let (name, position, rotation) = (own.name.clone(), own.camera.position, own.camera.rotation);
        let node = self.node(name, position, rotation);
        self.scene.cameras[camera].node = Some(node);
        node
    }

    fn node(&mut self, name: String, translation: DVec3, rotation: DQuat) -> usize {
        let local = Local::Parts(Placement { translation, rotation, scale: DVec3::ONE });
        self.scene.motion.nodes.push(motion::Node { name, parent: None, local, weights: Vec::new() });
        self.scene.motion.nodes.len() - 1
    }
}

fn of_node(property: Property, node: usize) -> Option<ChannelTarget> {
    match property {
        Property::Translation => Some(ChannelTarget::Translation(node)),
        Property::Rotation => Some(ChannelTarget::Rotation(node)),
        Property::Scale => Some(ChannelTarget::Scale(node)),
        Property::Light(_) | Property::Camera(_) | Property::Cell => None,
    }
}

/// Keys as a channel has them.
struct Keyframes {
    times: Vec<f64>,
    values: Vec<f64>,
    interpolation: Interpolation,
}

impl Keyframes {
    fn read(table: &Table, form: &AnimatedProperty) -> Result<Self, Error> {
        let need = |key: &str| table.get(key).ok_or_else(|| table.wrong(&format!("needs {key}")));
        let times = times(&need("times")?)?;
        let values = need("values")?;
        let interpolation = match table.read("interpolation", |node| node.word(&["step", "linear", "cubic"]))? {
            Some("step") => Interpolation::Step,
            Some("linear" | "cubic") if form.property == Property::Cell => {
                return Err(table.wrong("a cell changes from key to key at once: its interpolation is \"step\""));
            }
            None if form.property == Property::Cell => Interpolation::Step,
            Some("cubic") => Interpolation::CubicSpline,
            _ => Interpolation::Linear,
        };
        let tangents = ["in_tangents", "out_tangents"].map(|key| table.get(key));
        if let Some(node) = tangents.iter().flatten().next().filter(|_| interpolation != Interpolation::CubicSpline) {
            return Err(node.wrong("goes with interpolation = \"cubic\""));
        }
        if let Some(axis) = table.get("axis") {
            if form.property != Property::Rotation || interpolation == Interpolation::CubicSpline {
                return Err(axis.wrong("goes with a rotation that is stepped or linear"));
            }
            let degrees = list(&values, times.len(), |node| Ok(vec![node.number(COORDINATE)?]))?.concat();
            return turns(&times, &degrees, axis.direction()?, interpolation).ok_or_else(|| {
                values
                    .wrong(format!("the turns take more than {MOST_KEYS} keys: a step has at most {MOST_TURN} degrees"))
            });
        }
        let values = list(&values, times.len(), |node| value(node, form))?;
        if interpolation != Interpolation::CubicSpline {
            return Ok(Self { times, values: values.concat(), interpolation });
        }
        let values = aligned(values, form.property);
        let width = values.first().map_or(0, Vec::len);
        let smooth = smooth(&times, &values);
        let mut sides = Vec::new();
        for node in &tangents {
            sides.push(match node {
                Some(node) => list(node, times.len(), |node| tangent(node, width, form.unit))?,
                None => smooth.clone(),
            });
        }
        let all = values.iter().zip(&sides[0]).zip(&sides[1]);
        let values = all.flat_map(|((value, arriving), leaving)| [&arriving[..], value, leaving].concat()).collect();
        Ok(Self { times, values, interpolation })
    }
}

fn times(node: &KeyedValue) -> Result<Vec<f64>, Error> {
    let mut times: Vec<f64> = Vec::new();
    for item in node.list()? {
        let time = item.number(TIME)?;
        if let Some(before) = times.last().filter(|before| **before >= time) {
            return Err(item.wrong(format!("must be after the {before} before it")));
        }
        times.push(time);
    }
    if times.is_empty() { Err(node.wrong("must have a time for each key")) } else { Ok(times) }
}

/// One item for each key.
fn list(
    node: &KeyedValue,
    keys: usize,
    read: impl Fn(&KeyedValue) -> Result<Vec<f64>, Error>,
) -> Result<Vec<Vec<f64>>, Error> {
    let items = node.list()?;
    if items.len() != keys {
        return Err(node.wrong(format!("has {} items for {keys} times: expected as many", items.len())));
    }
    items.iter().map(read).collect()
}

/// The value of a key, as the tables of models, lights and the camera have it.
fn value(node: &KeyedValue, form: &AnimatedProperty) -> Result<Vec<f64>, Error> {
    match form.property {
        Property::Translation => node.point().map(|point| point.to_array().to_vec()),
        Property::Scale => place::scale(node).map(|scale| scale.to_array().to_vec()),
        Property::Rotation => match node.list() {
            Ok(parts) if parts.len() == 4 => {
                let rotation = DQuat::from_array(node.numbers(COORDINATE, "[x, y, z, w]")?);
                match rotation.length() < 1e-12 {
                    true => Err(node.wrong("must not be zero")),
                    false => Ok(rotation.normalize().to_array().to_vec()),
                }
            }
            _ => place::rotation(node).map(|rotation| rotation.to_array().to_vec()),
        },
        Property::Light(LightValue::Color) => node.color(form.limit).map(|color| color.as_dvec3().to_array().to_vec()),
        Property::Cell => Ok(vec![f64::from(node.integer(0..=MAX_ATLAS_EDGE * MAX_ATLAS_EDGE - 1)?)]),
        Property::Light(_) | Property::Camera(_) => Ok(vec![node.number(form.limit)? * form.unit]),
    }
}

/// A change a second of each value.
fn tangent(node: &KeyedValue, width: usize, unit: f64) -> Result<Vec<f64>, Error> {
    if width == 1 {
        return Ok(vec![node.number(COORDINATE)? * unit]);
    }
    let parts = node.list()?;
    if parts.len() != width {
        return Err(node.wrong(format!("must be {width} numbers a second, as many as its value has")));
    }
    parts.iter().map(|part| part.number(COORDINATE)).collect()
}

/// A rotation and its negative are one: each is that which is nearer to the one before it, so that cubics do not go around.
fn aligned(mut values: Vec<Vec<f64>>, property: Property) -> Vec<Vec<f64>> {
    if property == Property::Rotation {
        for index in 1..values.len() {
            let dot: f64 = values[index - 1].iter().zip(&values[index]).map(|(a, b)| a * b).sum();
            if dot < 0.0 {
                values[index].iter_mut().for_each(|part| *part = -*part);
            }
        }
    }
    values
}

/// At each key the change a second from the key before it to the one after it, as of a Catmull-Rom spline.
fn smooth(times: &[f64], values: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let last = times.len() - 1;
    let slope = |index: usize| {
        let (before, after) = (index.saturating_sub(1), (index + 1).min(last));
        let seconds = times[after] - times[before];
        let change = |(from, to): (&f64, &f64)| if seconds > 0.0 { (to - from) / seconds } else { 0.0 };
        values[before].iter().zip(&values[after]).map(change).collect()
    };
    (0..=last).map(slope).collect()
}

/// Rotations about an axis by degrees, with keys between them where they are far apart: quaternions know no whole turns.
fn turns(times: &[f64], degrees: &[f64], axis: DVec3, interpolation: Interpolation) -> Option<Keyframes> {
    let mut keys = Keyframes { times: Vec::new(), values: Vec::new(), interpolation };
    let mut add = |time: f64, degrees: f64| {
        keys.times.push(time);
        // The remainder is exact, also of many turns.
        keys.values.extend(DQuat::from_axis_angle(axis, (degrees % 720.0).to_radians()).to_array());
        keys.times.len() <= MOST_KEYS
    };
    for (index, (&time, &angle)) in times.iter().zip(degrees).enumerate() {
        if let Some(next) = degrees.get(index + 1).filter(|_| interpolation == Interpolation::Linear) {
            let steps = ((next - angle).abs() / MOST_TURN).ceil().max(1.0);
            if steps > MOST_KEYS as f64 {
                return None;
            }
            for step in 0..steps as u32 {
                let share = f64::from(step) / steps;
                let at = time + (times[index + 1] - time) * share;
                if !add(at, angle + (next - angle) * share) {
                    return None;
                }
            }
        } else if !add(time, angle) {
            return None;
        }
    }
    Some(keys)
}
