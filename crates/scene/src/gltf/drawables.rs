//! The primitives that are drawn at each node, with the meshes that are made for them, as few as can be.

use std::collections::{BTreeMap, HashMap};

use glam::DAffine3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::accessor::Accessors;
use super::buffers::Buffers;
use super::instances;
use super::json::{Attributes, Document, Primitive, Whole, entry, gathered, named};
use super::json_extensions::Draco;
use super::materials::{self, DrawnMaterial};
use super::movement::{self, Joints, Movement};
use super::nodes::{self, Nodes};
use super::primitive::{Needs, PrimitiveInput, Shapes};
use super::source::PrimitiveSource;
use crate::{LoadOptions, Mesh, unknown};

/// The most objects of a file.
pub(super) const MOST_OBJECTS: usize = 4_000_000;
/// The most vertices and indices of all meshes together, before any is made.
const MOST_NUMBERS: usize = 1 << 28;

/// The parts of a file that drawables are made from.
pub(super) struct Sources<'a> {
    pub document: &'a Document,
    pub buffers: &'a Buffers<'a>,
    pub accessors: &'a Accessors<'a>,
    pub nodes: &'a Nodes,
    pub movement: &'a Movement,
}

/// A primitive at a node.
pub(super) struct Drawable {
    pub node: usize,
    /// Index in [`Drawables::orders`].
    pub order: usize,
    /// Material of the file.
    pub material: Option<usize>,
    /// The skin of the file that moves it.
    pub skin: Option<usize>,
    /// The skin of the file in whose pose its mesh is made, as nothing moves it.
    pub posed: Option<usize>,
    /// True if clips move the weights of its shapes.
    pub blends: bool,
    /// Index in [`Drawables::instances`]: 0, a single instance at the node itself, if the node lists none.
    pub instances: usize,
    /// Points and lines without normals, which are unlit.
    pub unlit: bool,
    /// Points and lines, which cast no shadow.
    pub strokes: bool,
}

/// A mesh to be made: a primitive, and the needs that the mesh must meet.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct MeshOrder {
    mesh: usize,
    primitive: usize,
    needs: Needs,
}

/// Everything that is drawn.
#[derive(Default)]
pub(super) struct Drawables {
    pub list: Vec<Drawable>,
    pub orders: Vec<MeshOrder>,
    /// Used materials, by material of the file.
    pub dresses: BTreeMap<Option<usize>, DrawnMaterial>,
    /// Used skins, by skin of the file.
    pub skins: BTreeMap<usize, Joints>,
    /// Sets of instances, which drawables name by their index; the first is one in the node itself.
    pub instances: Vec<Vec<DAffine3>>,
    pub warnings: Vec<String>,
    /// Faults of primitives, each with its place.
    faults: Vec<(String, String)>,
    objects: usize,
    /// For each primitive in order, whether its mesh is too large to be read.
    too_large: Vec<bool>,
}

/// The parts of a primitive that decide its mesh: where they are equal, two primitives share one.
type PrimitiveKey<'a> = (&'a Attributes, Option<Whole>, Option<Whole>, &'a Vec<Attributes>, Option<&'a Draco>);

fn primitive_key(primitive: &Primitive) -> PrimitiveKey<'_> {
    let Primitive { attributes, indices, mode, targets, extensions, .. } = primitive;
    (attributes, *indices, *mode, targets, extensions.draco.as_ref())
}

/// Collects everything that the chosen scene draws. `variant` names a look of the file's materials.
pub(super) fn collect(sources: &Sources, variant: Option<&str>) -> Result<Drawables, String> {
    let document = sources.document;
    let variant = variant.map(|name| variant_called(document, name)).transpose()?;
    let mut drawables = Drawables { instances: vec![vec![DAffine3::IDENTITY]], ..Drawables::default() };
    let mut first: HashMap<PrimitiveKey, (usize, usize)> = HashMap::new();
    let mut orders: HashMap<MeshOrder, usize> = HashMap::new();
    for &index in &sources.nodes.shown {
        let node = &document.nodes[index];
        let Some(mesh) = node.mesh else { continue };
        let within = |what: String| format!("{}: {what}", nodes::name(&document.nodes, index));
        let json = match entry("mesh", &document.meshes, mesh) {
            Ok(json) => json,
            Err(what) => {
                drawables.warnings.push(within(what));
                continue;
            }
        };
        let instances = drawables.instances_of(sources, index).map_err(within)?;
        drawables.objects = drawables.objects.saturating_add(json.primitives.len().saturating_mul(instances.1));
        if drawables.objects > MOST_OBJECTS {
            return Err(format!("makes more than {MOST_OBJECTS} objects"));
        }
        let skin = drawables.skin_of(sources, index);
        for (number, primitive) in json.primitives.iter().enumerate() {
            let material = material_of(document, primitive, variant).unwrap_or_else(|what| {
                let place = format!("{}, primitive {number}", named("mesh", mesh.0, json.name.as_ref()));
                drawables.faults.push((place, format!("{what}, drawn with the default one")));
                None
            });
            let (needs, skin) = drawables.needs(sources, index, (material, primitive, skin));
            let (of_mesh, of_primitive) = *first.entry(primitive_key(primitive)).or_insert((mesh.0, number));
            let order = MeshOrder { mesh: of_mesh, primitive: of_primitive, needs };
            let (posed, blends) = (order.needs.posed, order.needs.shapes == Shapes::Kept);
            let order = *orders.entry(order).or_insert_with_key(|order| {
                drawables.orders.push(order.clone());
                drawables.orders.len() - 1
            });
            let skin = skin.filter(|_| posed.is_none());
            let strokes = is_strokes(primitive);
            let unlit = strokes && !primitive.attributes.contains_key("NORMAL");
            let instances = instances.0;
            let drawable = Drawable { node: index, order, material, skin, posed, blends, instances, unlit, strokes };
            drawables.list.push(drawable);
        }
    }
    drawables.count_numbers(sources);
    Ok(drawables)
}

impl Drawables {
    /// The set of a node's instances, and how many they are.
    fn instances_of(&mut self, sources: &Sources, index: usize) -> Result<(usize, usize), String> {
        let nodes = &sources.document.nodes;
        let Some(json) = &nodes[index].extensions.instances else { return Ok((0, 1)) };
        let mut warnings = Vec::new();
        let places = instances::read(json, sources.accessors, &mut warnings)?;
        self.warnings.extend(warnings.iter().map(|what| format!("{}: {what}", nodes::name(nodes, index))));
        let count = places.len();
        self.instances.push(places);
        Ok((self.instances.len() - 1, count))
    }

    /// The skin of a node, if a mesh can hang on it.
    fn skin_of(&mut self, sources: &Sources, node: usize) -> Option<usize> {
        let index = sources.document.nodes[node].skin?.0;
        if let std::collections::btree_map::Entry::Vacant(vacant) = self.skins.entry(index) {
            match movement::skin(sources.document, sources.accessors, index, sources.movement) {
                Ok(joints) => {
                    vacant.insert(joints);
                }
                Err(what) => {
                    let node = nodes::name(&sources.document.nodes, node);
                    self.warnings.push(format!("{node}: {what}, drawn without it"));
                    return None;
                }
            }
        }
        Some(index)
    }

    /// Returns the needs of objects at a node for a primitive's mesh, and the skin that moves the mesh.
    fn needs(
        &mut self,
        sources: &Sources,
        node: usize,
        (material, primitive, skin): (Option<usize>, &Primitive, Option<usize>),
    ) -> (Needs, Option<usize>) {
        if !self.dresses.contains_key(&material) {
            let dress = materials::read(sources.document, material, sources.movement, &mut self.warnings);
            self.dresses.insert(material, dress);
        }
        let dress = &self.dresses[&material];
        let hangs = primitive.attributes.contains_key("JOINTS_0") && primitive.attributes.contains_key("WEIGHTS_0");
        if skin.is_some() && !hangs {
            let node = nodes::name(&sources.document.nodes, node);
            self.warnings.push(format!("{node}: a primitive of its mesh has no joints, drawn without its skin"));
        }
        let skin = skin.filter(|_| hangs).and_then(|index| Some((index, self.skins.get(&index)?)));
        let shapes = shapes(sources, node, primitive);
        let is_unlit = is_strokes(primitive) && !primitive.attributes.contains_key("NORMAL");
        let is_still = |joints: &Joints| !joints.moves && shapes != Shapes::Kept;
        let needs = Needs {
            uv_sets: dress.uv_sets,
            repeats: dress.repeats,
            tangents: dress.tangents && !is_unlit,
            anisotropic: dress.anisotropic && !is_unlit,
            joints: skin.map(|(_, joints)| joints.joints.len()),
            posed: skin.filter(|(_, joints)| is_still(joints)).map(|(index, _)| index),
            shapes,
        };
        (needs, skin.map(|(index, _)| index))
    }

    /// Leaves out meshes that would fill a memory: a few bytes of JSON can ask for the same data many times.
    fn count_numbers(&mut self, sources: &Sources) {
        let mut numbers = 0usize;
        for order in &self.orders {
            let primitive = &sources.document.meshes[order.mesh].primitives[order.primitive];
            let accessors = primitive.attributes.get("POSITION").into_iter().chain(&primitive.indices);
            let count = |accessor: &Whole| sources.accessors.count(*accessor);
            let own = accessors.map(count).fold(0, usize::saturating_add);
            let is_too_large = numbers.saturating_add(own) > MOST_NUMBERS;
            if is_too_large {
                let what = format!("the meshes up to it have more than {MOST_NUMBERS} vertices and indices together");
                self.faults.push((order.name(sources), format!("{what}: left out")));
            } else {
                numbers += own;
            }
            self.too_large.push(is_too_large);
        }
    }

    /// Makes all meshes, in parallel. One of which nothing is drawn is none, and so is one that cannot be made, with a warning.
    pub fn build(&self, sources: &Sources, options: &LoadOptions) -> (Vec<Option<Mesh>>, Vec<String>) {
        let poses: BTreeMap<usize, Vec<DAffine3>> =
            self.skins.iter().map(|(&index, joints)| (index, joints.pose(sources.nodes))).collect();
        let done = AtomicUsize::new(0);
        let build = |(order, is_too_large): (&MeshOrder, &bool)| {
            let json = &sources.document.meshes[order.mesh];
            let primitive = &json.primitives[order.primitive];
            let name =
                json.name.clone().filter(|name| !name.is_empty()).unwrap_or_else(|| format!("mesh {}", order.mesh));
            let pose = order.needs.posed.and_then(|skin| poses.get(&skin)).map_or(&[][..], Vec::as_slice);
            let source = if *is_too_large {
                return (None, Vec::new());
            } else {
                PrimitiveSource::open(sources.document, sources.buffers, sources.accessors, primitive)
            };
            let built = source.and_then(|source| {
                PrimitiveInput { name: &name, mesh: json, source, needs: &order.needs, pose }.build()
            });
            options.report("meshes", done.fetch_add(1, Ordering::Relaxed) + 1, self.orders.len());
            let place = || order.name(sources);
            match built {
                Ok(built) => (built.mesh, built.warnings.into_iter().map(|what| (place(), what)).collect()),
                Err(what) => (None, vec![(place(), format!("{what}: left out"))]),
            }
        };
        let built: Vec<(Option<Mesh>, Vec<_>)> = self.orders.par_iter().zip(&self.too_large).map(build).collect();
        let (meshes, faults): (Vec<_>, Vec<_>) = built.into_iter().unzip();
        let faults = self.faults.iter().cloned().chain(faults.into_iter().flatten());
        (meshes, gathered(faults.collect(), ""))
    }
}

impl MeshOrder {
    /// Returns its primitive's name in messages.
    fn name(&self, sources: &Sources) -> String {
        let json = &sources.document.meshes[self.mesh];
        format!("{}, primitive {}", named("mesh", self.mesh, json.name.as_ref()), self.primitive)
    }
}

/// Returns true for points and lines. Compressed primitives are always triangles.
fn is_strokes(primitive: &Primitive) -> bool {
    primitive.mode.is_some_and(|mode| mode.0 < 4) && primitive.extensions.draco.is_none()
}

/// Returns whether the morph targets of a primitive at a node are dropped, applied, or kept.
fn shapes(sources: &Sources, node: usize, primitive: &Primitive) -> Shapes {
    if primitive.targets.is_empty() {
        return Shapes::None;
    }
    if sources.movement.weights[node] {
        return Shapes::Kept;
    }
    let weights = weights(sources.document, node, primitive.targets.len());
    if weights.iter().all(|&weight| weight == 0.0) {
        return Shapes::None;
    }
    Shapes::Fixed(weights.into_iter().map(f64::to_bits).collect())
}

/// Returns the weight of each shape of a node's mesh when nothing moves.
pub(super) fn weights(document: &Document, node: usize, shapes: usize) -> Vec<f64> {
    let node = &document.nodes[node];
    let of_mesh = || document.meshes.get(node.mesh?.0)?.weights.as_ref();
    let mut weights = node.weights.as_ref().or_else(of_mesh).cloned().unwrap_or_default();
    weights.resize(shapes, 0.0);
    weights.iter_mut().filter(|weight| !weight.is_finite()).for_each(|weight| *weight = 0.0);
    weights
}

fn variant_called(document: &Document, name: &str) -> Result<usize, String> {
    let variants = document.extensions.variants.as_ref().map_or(&[][..], |own| &own.variants);
    let names: Vec<&str> = variants.iter().map(|variant| variant.name.as_str()).collect();
    let found = names.iter().position(|own| *own == name);
    found.ok_or_else(|| match names.is_empty() {
        true => format!("has no variants, so that there is no {name:?}"),
        false => unknown("variant", name, &names),
    })
}

fn material_of(document: &Document, primitive: &Primitive, variant: Option<usize>) -> Result<Option<usize>, String> {
    let mappings = primitive.extensions.variants.as_ref().map_or(&[][..], |own| &own.mappings);
    let of_variant = |variant: usize| mappings.iter().find(|mapping| mapping.variants.contains(&Whole(variant)));
    let material = variant.and_then(of_variant).and_then(|mapping| mapping.material).or(primitive.material);
    if let Some(material) = material {
        entry("material", &document.materials, material)?;
    }
    Ok(material.map(|material| material.0))
}
