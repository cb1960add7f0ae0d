//! Objects, lights, cameras and their motion, assembled from the parts that were read.

use std::collections::BTreeMap;

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::animation::{FileAnimation, Keys};
use super::drawables::{self, Drawable, Drawables, Sources};
use super::json::{Document, named};
use super::materials::Pending;
use super::nodes;
use super::pointer::{self, Aim};
use super::{cameras, lights, strokes};
use crate::check::fits;
use crate::{
    CastsShadow, Channel, ChannelTarget, Clip, Imported, Local, Material, Mesh, NamedCamera, Node, Object, Placement,
    Skin,
};

/// The scene so far, with the indices in it of the file's parts.
#[derive(Default)]
pub(super) struct Assembly {
    pub imported: Imported,
    /// Nodes of the motion, by node of the file.
    moving: BTreeMap<usize, usize>,
    /// Nodes of the motion with the weights of a skinned mesh's shapes, by node of the file. They have no transform: the skin places the mesh.
    weights: BTreeMap<usize, usize>,
    /// Nodes of the instances of a moving node, by node of the file.
    copies: BTreeMap<usize, Vec<usize>>,
    /// Skins of the motion, by skin of the file.
    skins: BTreeMap<usize, usize>,
    /// Materials of the scene, each with its coat, by material of the file.
    materials: BTreeMap<Option<usize>, (usize, Option<usize>)>,
    /// Materials that draw points and lines without normals, by material of the scene.
    unlit: BTreeMap<usize, usize>,
    /// Lights and cameras of the scene, by light and by camera of the file.
    lights: BTreeMap<usize, Vec<usize>>,
    cameras: BTreeMap<usize, Vec<usize>>,
}

impl Assembly {
    /// Takes the materials; a texture by request is at its number.
    pub fn dress(
        &mut self,
        drawables: &mut Drawables,
        texture: impl Fn(&super::textures::TextureRequest) -> Option<usize>,
    ) {
        let take = |pending: Pending, materials: &mut Vec<Material>| {
            let mut material = pending.material;
            for (slot, request) in &pending.requests {
                *material.texture_mut(*slot) = texture(request);
            }
            materials.push(material);
            materials.len() - 1
        };
        for (index, dress) in std::mem::take(&mut drawables.dresses) {
            let base = take(dress.base, &mut self.imported.materials);
            let coat = dress.coat.map(|coat| take(coat, &mut self.imported.materials));
            self.materials.insert(index, (base, coat));
        }
    }

    /// Lists the nodes of the motion: nodes that clips move and that place something, joints, and the ancestors of both.
    pub fn nodes(&mut self, sources: &Sources, drawables: &Drawables) {
        let (nodes, movement) = (sources.nodes, sources.movement);
        let mut is_needed = vec![false; nodes.world.len()];
        let mut blends = vec![false; nodes.world.len()];
        for drawable in &drawables.list {
            let is_placed_by_node = drawable.skin.is_none() && drawable.posed.is_none();
            is_needed[drawable.node] |= is_placed_by_node && (movement.places[drawable.node] || drawable.blends);
            blends[drawable.node] |= drawable.blends;
            let joints = drawable.skin.and_then(|skin| drawables.skins.get(&skin));
            joints.into_iter().flat_map(|own| &own.joints).for_each(|&joint| is_needed[joint] = true);
        }
        for &node in &nodes.shown {
            let json = &sources.document.nodes[node];
            is_needed[node] |= movement.places[node] && (json.camera.is_some() || json.extensions.light.is_some());
        }
        for &node in nodes.order.iter().rev() {
            if let (true, Some(parent)) = (is_needed[node], nodes.parent[node]) {
                is_needed[parent] = true;
            }
        }
        for &node in nodes.order.iter().filter(|&&node| is_needed[node]) {
            let parent = nodes.parent[node].and_then(|parent| self.moving.get(&parent).copied());
            let is_moved = movement.places[node];
            let local = match nodes.local[node] {
                // The specification has no clip move a matrix; one that does moves its parts.
                Local::Fixed(transform) if is_moved => Local::Parts(parts(&transform)),
                local => local,
            };
            let weights = if blends[node] { weights_of(sources.document, node) } else { Vec::new() };
            let index = self.push_node(sources.document, node, parent, local, weights);
            self.moving.insert(node, index);
        }
        for drawable in drawables.list.iter().filter(|own| own.blends && own.skin.is_some()) {
            if !self.weights.contains_key(&drawable.node) {
                let weights = weights_of(sources.document, drawable.node);
                let local = Local::Fixed(DAffine3::IDENTITY);
                let index = self.push_node(sources.document, drawable.node, None, local, weights);
                self.weights.insert(drawable.node, index);
            }
        }
    }

    fn push_node(
        &mut self,
        document: &Document,
        node: usize,
        parent: Option<usize>,
        local: Local,
        weights: Vec<f64>,
    ) -> usize {
        let name = document.nodes[node].name.clone().unwrap_or_default();
        self.imported.motion.nodes.push(Node { name, parent, local, weights });
        self.imported.motion.nodes.len() - 1
    }

    /// Lists skins and objects. `meshes` are by order.
    pub fn objects(
        &mut self,
        sources: &Sources,
        drawables: &Drawables,
        meshes: Vec<Option<Mesh>>,
        warnings: &mut Vec<String>,
    ) {
        for drawable in &drawables.list {
            let Some(index) = drawable.skin.filter(|index| !self.skins.contains_key(index)) else { continue };
            let json = &sources.document.skins[index];
            let own = &drawables.skins[&index];
            self.skins.insert(index, self.imported.motion.skins.len());
            self.imported.motion.skins.push(Skin {
                name: json.name.clone().unwrap_or_default(),
                joints: own.joints.iter().map(|joint| self.moving[joint]).collect(),
                inverse_bind: own.inverse_bind.clone(),
            });
        }
        let mut numbers = Vec::with_capacity(meshes.len());
        for mesh in meshes {
            numbers.push(mesh.is_some().then_some(self.imported.meshes.len()));
            self.imported.meshes.extend(mesh);
        }
        for drawable in &drawables.list {
            if let Some(mesh) = numbers[drawable.order] {
                self.place(sources, drawables, (drawable, mesh), warnings);
            }
        }
    }

    /// The objects of a drawable: one for each instance, and one more for each that has a coat.
    fn place(
        &mut self,
        sources: &Sources,
        drawables: &Drawables,
        (drawable, mesh): (&Drawable, usize),
        warnings: &mut Vec<String>,
    ) {
        let name = nodes::object_name(sources.document, drawable.node);
        let (mut base, mut coat) = self.materials[&drawable.material];
        if drawable.unlit {
            (base, coat) = (self.unlit(base, warnings), None);
        }
        let casts_shadow = if drawable.strokes { CastsShadow::No } else { CastsShadow::Yes };
        let frame = drawable.posed.and_then(|skin| drawables.skins.get(&skin)).map(|own| own.frame(sources.nodes));
        let frame = frame.or(drawable.skin.map(|_| DAffine3::IDENTITY));
        let is_free = frame.is_some();
        let places = &drawables.instances[if is_free { 0 } else { drawable.instances }];
        let copies = if is_free { None } else { self.copies_of(sources, drawable, places) };
        for (number, instance) in places.iter().enumerate() {
            let transform = frame.unwrap_or_else(|| sources.nodes.world[drawable.node] * *instance);
            if !fits(&transform) {
                let name = nodes::name(&sources.document.nodes, drawable.node);
                warnings.push(format!("{name}: an instance's transform in the world is not finite: left out"));
                continue;
            }
            let own = if is_free {
                self.weights.get(&drawable.node)
            } else {
                copies.as_ref().and_then(|own| own.get(number))
            };
            let node = own.copied();
            let skin = drawable.skin.and_then(|skin| self.skins.get(&skin).copied());
            let object = Object { node, skin, casts_shadow, ..Object::new(name.clone(), mesh, base, transform) };
            let lacquer = coat.map(|material| Object { material, casts_shadow: CastsShadow::No, ..object.clone() });
            self.imported.objects.push(object);
            self.imported.objects.extend(lacquer);
        }
    }

    /// The material that draws points and lines of a material without light, as they have no normals.
    fn unlit(&mut self, base: usize, warnings: &mut Vec<String>) -> usize {
        let materials = &mut self.imported.materials;
        *self.unlit.entry(base).or_insert_with(|| {
            if let Some(lost) = strokes::lost_of_unlit(&materials[base]) {
                warnings.push(lost);
            }
            let unlit = strokes::unlit(&materials[base]);
            materials.iter().position(|other| *other == unlit).unwrap_or_else(|| {
                materials.push(unlit);
                materials.len() - 1
            })
        })
    }

    /// The nodes by which a drawable's instances move: the drawable's own, or one in it for each; none where nothing moves them.
    fn copies_of(&mut self, sources: &Sources, drawable: &Drawable, places: &[DAffine3]) -> Option<Vec<usize>> {
        let moves = drawable.blends || sources.movement.places[drawable.node];
        let parent = self.moving.get(&drawable.node).copied().filter(|_| moves)?;
        if drawable.instances == 0 {
            return Some(vec![parent]);
        }
        let nodes = &mut self.imported.motion.nodes;
        let copies = self.copies.entry(drawable.node).or_insert_with(|| {
            let weights = nodes[parent].weights.clone();
            let first = nodes.len();
            nodes.extend(places.iter().map(|place| Node {
                name: String::new(),
                parent: Some(parent),
                local: Local::Fixed(*place),
                weights: weights.clone(),
            }));
            (first..nodes.len()).collect()
        });
        Some(copies.clone())
    }

    /// Lists lights and cameras of the nodes that are shown.
    pub fn lights_and_cameras(&mut self, sources: &Sources, warnings: &mut Vec<String>) {
        let document = sources.document;
        let of_file = document.extensions.lights.as_ref().map_or(&[][..], |own| &own.lights);
        for &node in &sources.nodes.shown {
            let json = &document.nodes[node];
            let (world, moves) = (sources.nodes.world[node], self.moving.get(&node).copied());
            let moves = moves.filter(|_| sources.movement.places[node]);
            let left_out = |what: String| format!("{}: {what}, left out", nodes::name(&document.nodes, node));
            if let Some(index) = json.extensions.light.as_ref().and_then(|own| Some(own.light?.0)) {
                let found = of_file
                    .get(index)
                    .ok_or_else(|| format!("light {index} does not exist: the file has {}", of_file.len()));
                match found.and_then(|own| lights::light(index, own)) {
                    Ok(mut light) => {
                        if light.name.is_empty() {
                            light.name = nodes::object_name(document, node);
                        }
                        self.lights.entry(index).or_default().push(self.imported.lights.len());
                        self.imported.lights.push(light.transformed(&world));
                        self.imported.motion.light_nodes.push(moves);
                    }
                    Err(what) => warnings.push(left_out(what)),
                }
            }
            if let Some(index) = json.camera.map(|own| own.0) {
                let found = document
                    .cameras
                    .get(index)
                    .ok_or_else(|| format!("camera {index} does not exist: the file has {}", document.cameras.len()));
                match found.and_then(|own| cameras::camera(index, own)) {
                    Ok((camera, odd)) => {
                        warnings.extend(odd);
                        self.cameras.entry(index).or_default().push(self.imported.cameras.len());
                        let name = self.camera_name(document, node, index);
                        let camera = camera.transformed(&world);
                        self.imported.cameras.push(NamedCamera { name, camera, node: moves });
                    }
                    Err(what) => warnings.push(left_out(what)),
                }
            }
        }
        if self.imported.motion.light_nodes.iter().all(Option::is_none) {
            self.imported.motion.light_nodes.clear();
        }
    }

    /// Returns the name of a camera for `--camera`: its own, its node's or its number, whichever no other camera has.
    fn camera_name(&self, document: &Document, node: usize, index: usize) -> String {
        let set = |name: &Option<String>| name.clone().filter(|name| !name.is_empty());
        let names =
            [set(&document.cameras[index].name), set(&document.nodes[node].name), Some(format!("camera {index}"))];
        let is_free = |name: &String| self.imported.cameras.iter().all(|other| other.name != *name);
        let free = names.into_iter().flatten().find(is_free);
        free.unwrap_or_else(|| format!("camera {}", named("of node", node, document.nodes[node].name.as_ref())))
    }

    /// Lists the clips, each channel with the target that it moves in the scene, if it has one.
    pub fn clips(&mut self, takes: Vec<FileAnimation>) {
        for FileAnimation { name, keys } in takes {
            let mut clip = Clip { name, channels: Vec::new() };
            for Keys { aim, times, values, interpolation } in keys {
                for target in self.targets(aim) {
                    let (times, values) = (times.clone(), values.clone());
                    clip.channels.push(Channel { target, times, values, interpolation });
                }
            }
            if !clip.channels.is_empty() {
                self.imported.motion.clips.push(clip);
            }
        }
    }

    fn targets(&self, aim: Aim) -> Vec<ChannelTarget> {
        let of_node =
            |node: usize, target: fn(usize) -> ChannelTarget| self.moving.get(&node).map(|&node| target(node));
        let several = |list: Option<&Vec<usize>>, target: &dyn Fn(usize) -> ChannelTarget| -> Vec<ChannelTarget> {
            list.into_iter().flatten().map(|&index| target(index)).collect()
        };
        match aim {
            Aim::Translation(node) => of_node(node, ChannelTarget::Translation).into_iter().collect(),
            Aim::Rotation(node) => of_node(node, ChannelTarget::Rotation).into_iter().collect(),
            Aim::Scale(node) => of_node(node, ChannelTarget::Scale).into_iter().collect(),
            Aim::Weights(node) => {
                let own = self.moving.get(&node).into_iter().chain(self.weights.get(&node));
                let all = own.chain(self.copies.get(&node).into_iter().flatten());
                let has_shapes = |&&own: &&usize| !self.imported.motion.nodes[own].weights.is_empty();
                all.filter(has_shapes).map(|&own| ChannelTarget::Weights(own)).collect()
            }
            Aim::Light(light, value) => several(self.lights.get(&light), &|index| ChannelTarget::Light(index, value)),
            Aim::Camera(camera, value) => {
                several(self.cameras.get(&camera), &|index| ChannelTarget::Camera(index, value))
            }
            Aim::Material(material, value) => {
                let base = self.materials.get(&Some(material)).map(|&(base, _)| base);
                let unlit = base.and_then(|base| self.unlit.get(&base).copied()).filter(|unlit| base != Some(*unlit));
                base.into_iter().chain(unlit).map(|own| ChannelTarget::Material(own, value)).collect()
            }
        }
    }
}

/// The weights that a node's shapes have at rest.
fn weights_of(document: &Document, node: usize) -> Vec<f64> {
    drawables::weights(document, node, pointer::shapes(document, node))
}

fn parts(transform: &DAffine3) -> Placement {
    let (scale, rotation, translation) = transform.to_scale_rotation_translation();
    match rotation.is_finite() {
        true => Placement { translation, rotation, scale },
        false => flat_parts(&transform.matrix3, translation),
    }
}

/// The parts of a map that flattens some axis: the other axes give the rotation, and if none is left, any rotation will do.
fn flat_parts(matrix: &DMat3, translation: DVec3) -> Placement {
    let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    let mut axes = columns.map(DVec3::normalize_or_zero);
    for index in 0..3 {
        if axes[index] == DVec3::ZERO {
            axes[index] = axes[(index + 1) % 3].cross(axes[(index + 2) % 3]).normalize_or_zero();
        }
    }
    let [x, y, z] = axes;
    let rotation = match axes.iter().position(|axis| *axis != DVec3::ZERO) {
        None => DQuat::IDENTITY,
        Some(only) if axes.iter().filter(|axis| **axis != DVec3::ZERO).count() == 1 => {
            DQuat::from_rotation_arc(DVec3::AXES[only], axes[only])
        }
        Some(_) => DQuat::from_mat3(&DMat3::from_cols(x, y, z)).normalize(),
    };
    Placement { translation, rotation, scale: DVec3::from(columns.map(DVec3::length)) }
}
