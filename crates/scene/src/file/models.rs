//! `[[models]]`: model files, built-in scenes and shapes, placed once or many times.

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::path::Path;

use glam::{DAffine3, DVec3, Vec3};

use super::node::{COORDINATE, KeyedValue, LENGTH, SHARE, Table};
use super::place::{placement, transform};
use super::schema;
use crate::builtin::{self, shapes};
use crate::load::{Chosen, OpenOptions, load_model};
use crate::motion;
use crate::suggest::unknown;
use crate::{CastsShadow, Error, Imported, Local, Look, MAX_ATLAS_EDGE, Material, Object, Scene};

/// The most copies that all models of a file may make together.
const MAX_OBJECTS: usize = 4_000_000;
/// Metres from zero along an axis, as positions may be.
const FARTHEST: f64 = 1e15;

/// A model's path, and the scene and the variant of it.
type TemplateKey = (String, [Option<String>; 2]);

/// Loads models into a scene; the same file named twice is read once.
pub(super) struct Models<'a> {
    pub folder: &'a Path,
    pub options: &'a OpenOptions<'a>,
    templates: HashMap<TemplateKey, Imported>,
    /// Names that clips move.
    moved: HashSet<String>,
}

/// A model's objects wear materials that are known by name only when all have been read.
pub(super) struct ModelMaterials<'a> {
    pub objects: Range<usize>,
    table: Table<'a>,
    pub name: Option<&'a str>,
    /// The node that clips move it by, where one does.
    pub node: Option<usize>,
}

impl<'a> Models<'a> {
    /// `moved` are the names of models that clips move.
    pub fn new(folder: &'a Path, options: &'a OpenOptions<'a>, moved: HashSet<String>) -> Self {
        Self { folder, options, templates: HashMap::new(), moved }
    }

    pub fn add<'n>(&mut self, node: &KeyedValue<'n>, scene: &mut Scene) -> Result<ModelMaterials<'n>, Error> {
        let table = node.table(schema::MODEL)?;
        let sources = ["path", "builtin", "shape"].map(|key| table.get(key));
        if sources.iter().flatten().count() != 1 {
            return Err(table.wrong("needs exactly one of path, builtin, shape"));
        }
        let [path, builtin, shape] = sources;
        if let (None, Some(node)) = (&path, table.get("scene").or(table.get("variant")).or(table.get("lights"))) {
            return Err(node.wrong("goes with the path of a glTF file"));
        }
        let mut model = match (path, builtin, shape) {
            (Some(path), ..) => self.read_file(&table, &path, scene)?,
            (_, Some(builtin), _) => from_builtin(&builtin, scene)?,
            (_, _, Some(shape)) => Imported { objects: from_shape(&shape, scene)?, ..Imported::default() },
            _ => Imported::default(),
        };
        let name = table.read("name", KeyedValue::string)?;
        if let Some(name) = name {
            model.objects.iter_mut().for_each(|object| object.name = name.into());
        }
        shadow(&table, &mut model.objects)?;
        if let Some(movable) = table.read("movable", KeyedValue::boolean)? {
            model.objects.iter_mut().for_each(|object| object.movable = movable);
        }
        if table.read("lights", KeyedValue::boolean)? == Some(false) {
            model.drop_lights();
        }
        let (own, placed) = (transform(&table)?, places(&table)?);
        let offsets: Vec<DAffine3> = placed.iter().map(|(offset, _)| *offset).collect();
        let parts = model.objects.len().max(model.lights.len()).max(model.cameras.len());
        if parts.saturating_mul(offsets.len()).saturating_add(scene.objects.len()) > MAX_OBJECTS {
            return Err(table.wrong(&format!("makes more than {MAX_OBJECTS} objects")));
        }
        let first = scene.objects.len();
        let node = match name.filter(|name| self.moved.contains(*name)) {
            Some(name) => {
                let local = Local::Parts(placement(&table)?);
                scene.motion.nodes.push(motion::Node { name: name.into(), parent: None, local, weights: Vec::new() });
                Some(scene.motion.nodes.len() - 1)
            }
            None => None,
        };
        match node {
            Some(node) => hang(scene, &model, &own, &offsets, node),
            None => model.place(scene, &offsets.iter().map(|offset| own * *offset).collect::<Vec<_>>()),
        }
        let own_looks = LookPatch::read(&table)?;
        for (copy, (_, look)) in scene.objects[first..].chunks_mut(model.objects.len().max(1)).zip(&placed) {
            copy.iter_mut().for_each(|object| object.look = look.or(own_looks).over(object.look));
        }
        // Each transform is in its range, but not the product of several.
        let is_near = |place: DVec3| place.abs().max_element() <= FARTHEST;
        let bounds = scene.objects[first..].iter().map(|object| object.bounds(&scene.meshes));
        if !bounds.filter(|bounds| !bounds.is_empty()).all(|bounds| is_near(bounds.min) && is_near(bounds.max)) {
            return Err(table.wrong(&format!("reaches farther than {FARTHEST:e} metres from zero")));
        }
        Ok(ModelMaterials { objects: first..scene.objects.len(), table, name, node })
    }

    fn read_file(&mut self, table: &Table, node: &KeyedValue, scene: &mut Scene) -> Result<Imported, Error> {
        let name = node.string()?;
        let chosen = Chosen {
            scene: table.read("scene", KeyedValue::string)?,
            variant: table.read("variant", KeyedValue::string)?,
        };
        let key = (name.to_owned(), [chosen.scene, chosen.variant].map(|own| own.map(str::to_owned)));
        if let Some(model) = self.templates.get(&key) {
            return Ok(model.clone());
        }
        let loaded = load_model(&self.folder.join(name), &chosen, self.options);
        let mut model = loaded.map_err(|error| match error {
            // A fault with a line is the model file's; one without was asked for by this node.
            Error::Content { line: Some(_), .. } => error,
            other => node.wrong(other),
        })?;
        model.give_assets(scene);
        self.templates.insert(key, model.clone());
        Ok(model)
    }
}

/// Puts a model at its places, which are `own` times an offset each, on a node that clips move and that stands at `own`. Copies share the clips
/// of the first.
fn hang(scene: &mut Scene, model: &Imported, own: &DAffine3, offsets: &[DAffine3], parent: usize) {
    let first_clip = scene.motion.clips.len();
    for (index, offset) in offsets.iter().enumerate() {
        let (objects, nodes) = (scene.objects.len(), scene.motion.nodes.len());
        model.place(scene, &[*own * *offset]);
        // A model with nodes hangs on a root node, which was appended first.
        if let Some(root) = scene.motion.nodes.get_mut(nodes) {
            (root.parent, root.local) = (Some(parent), Local::Fixed(*offset));
        }
        for (object, before) in scene.objects[objects..].iter_mut().zip(&model.objects) {
            if object.node.is_none() && object.skin.is_none() {
                let local = Local::Fixed(*offset * before.transform);
                let name = object.name.clone();
                scene.motion.nodes.push(motion::Node { name, parent: Some(parent), local, weights: Vec::new() });
                object.node = Some(scene.motion.nodes.len() - 1);
            }
        }
        if index > 0 {
            scene.motion.merge_clips(first_clip, model.motion.clips.len());
        }
    }
}

/// Takes only the objects of a built-in scene, with their motion.
fn from_builtin(node: &KeyedValue, scene: &mut Scene) -> Result<Imported, Error> {
    let built = builtin::open(node.string()?).map_err(|error| node.wrong(error))?;
    let mut motion = built.motion;
    motion.forget_lights();
    motion.forget_cameras();
    let mut imported = Imported {
        meshes: built.meshes,
        objects: built.objects,
        materials: built.materials,
        textures: built.textures,
        lights: Vec::new(),
        cameras: Vec::new(),
        surroundings: None,
        motion,
        warnings: built.warnings,
        files: built.files,
    };
    imported.give_assets(scene);
    Ok(imported)
}

const SHAPES: [&str; 6] = ["plane", "box", "sphere", "cylinder", "cone", "torus"];

fn from_shape(node: &KeyedValue, scene: &mut Scene) -> Result<Vec<Object>, Error> {
    let table = node.table(schema::SHAPE)?;
    let kind = table.get("kind").ok_or_else(|| table.wrong(&format!("needs kind: {}", SHAPES.join(", "))))?;
    let kind = kind.word(&SHAPES)?;
    let used: &[&str] = match kind {
        "plane" | "box" => &["size"],
        "sphere" => &["radius", "segments"],
        "torus" => &["radius", "tube", "segments"],
        _ => &["radius", "height", "segments"],
    };
    let foreign = ["size", "radius", "height", "tube", "segments"].into_iter().filter(|key| !used.contains(key));
    if let Some(node) = foreign.filter_map(|key| table.get(key)).next() {
        return Err(node.wrong(format!("a {kind} has no such key (it has {})", used.join(", "))));
    }
    let length = |name: &str, default: f64| -> Result<f64, Error> {
        Ok(table.read(name, |node| node.number(LENGTH))?.unwrap_or(default))
    };
    let segments = table.read("segments", |node| node.integer(3..=1024))?.unwrap_or(48) as usize;
    let mesh = match kind {
        "plane" => shapes::plane(table.read("size", |node| node.numbers(LENGTH, "[x, z]"))?.unwrap_or([1.0; 2])),
        "box" => shapes::cuboid(table.read("size", |node| node.numbers(LENGTH, "[x, y, z]"))?.unwrap_or([1.0; 3])),
        "sphere" => shapes::sphere(length("radius", 0.5)?, segments),
        "torus" => shapes::torus(length("radius", 0.5)?, length("tube", 0.2)?, segments),
        "cylinder" => shapes::cylinder(length("radius", 0.5)?, length("height", 1.0)?, segments),
        _ => shapes::cone(length("radius", 0.5)?, length("height", 1.0)?, segments),
    };
    scene.meshes.push(mesh.finish(kind));
    scene.materials.push(Material::default());
    let (mesh, material) = (scene.meshes.len() - 1, scene.materials.len() - 1);
    Ok(vec![Object::new(kind, mesh, material, DAffine3::IDENTITY)])
}

/// Reads the model's keys about the faces that cast shadows and about shadows that fall on it.
fn shadow(table: &Table, objects: &mut [Object]) -> Result<(), Error> {
    if let Some(node) = table.get("casts_shadow") {
        let casts = match node.is_boolean() {
            true if node.boolean()? => CastsShadow::Yes,
            true => CastsShadow::No,
            false => {
                node.word(&["front"]).map_err(|_| node.wrong("must be true, false or \"front\""))?;
                CastsShadow::Front
            }
        };
        objects.iter_mut().for_each(|object| object.casts_shadow = casts);
    }
    if let Some(receives) = table.read("receives_shadow", KeyedValue::boolean)? {
        objects.iter_mut().for_each(|object| object.receives_shadow = receives);
    }
    Ok(())
}

/// The part of a look that a table sets.
#[derive(Clone, Copy, Default)]
struct LookPatch {
    cell: Option<u32>,
    tint: Option<Vec3>,
    selected: Option<bool>,
}

impl LookPatch {
    fn read(table: &Table) -> Result<Self, Error> {
        Ok(Self {
            cell: table.read("cell", |node| node.integer(0..=MAX_ATLAS_EDGE * MAX_ATLAS_EDGE - 1))?,
            tint: table.read("tint", |node| node.color(SHARE))?,
            selected: table.read("selected", KeyedValue::boolean)?,
        })
    }

    /// Takes values that this one does not set from the other.
    fn or(self, other: Self) -> Self {
        Self {
            cell: self.cell.or(other.cell),
            tint: self.tint.or(other.tint),
            selected: self.selected.or(other.selected),
        }
    }

    /// A look with the given values; none if none is given and the object had no look.
    fn over(self, look: Option<Look>) -> Option<Look> {
        let Self { cell, tint, selected } = self;
        if cell.is_none() && tint.is_none() && selected.is_none() {
            return look;
        }
        let before = look.unwrap_or_default();
        Some(Look {
            cell: cell.unwrap_or(before.cell),
            tint: tint.unwrap_or(before.tint),
            selected: selected.unwrap_or(before.selected),
        })
    }
}

/// Returns the places of the model's copies before its own transform, and their looks: the grid's, then the instances'.
fn places(table: &Table) -> Result<Vec<(DAffine3, LookPatch)>, Error> {
    let mut places = vec![(DAffine3::IDENTITY, LookPatch::default())];
    if let Some(node) = table.get("grid") {
        let steps = grid(&node)?.into_iter();
        places = steps.map(|step| (DAffine3::from_translation(step), LookPatch::default())).collect();
    }
    if let Some(node) = table.get("instances") {
        let instances = node.list()?;
        if instances.len().saturating_mul(places.len()) > MAX_OBJECTS {
            return Err(node.wrong(format!("makes more than {MAX_OBJECTS} objects")));
        }
        let read = |node: &KeyedValue| {
            let table = node.table(schema::INSTANCE)?;
            Ok((transform(&table)?, LookPatch::read(&table)?))
        };
        let instances = instances.iter().map(read).collect::<Result<Vec<_>, Error>>()?;
        let of_place = |&(place, _): &(DAffine3, LookPatch)| {
            instances.iter().map(move |&(instance, look)| (place * instance, look)).collect::<Vec<_>>()
        };
        places = places.iter().flat_map(of_place).collect();
    }
    Ok(places)
}

/// Steps along each axis, centred on the model's own place.
fn grid(node: &KeyedValue) -> Result<Vec<DVec3>, Error> {
    let table = node.table(schema::GRID)?;
    let count_node = table.get("count").ok_or_else(|| table.wrong("needs count: [x, y, z]"))?;
    let items = count_node.items::<3>("[x, y, z] copies")?;
    let mut count = [1u32; 3];
    for (count, item) in count.iter_mut().zip(&items) {
        *count = item.integer(1..=MAX_OBJECTS as u32)?;
    }
    if count.iter().map(|&n| n as usize).fold(1usize, usize::saturating_mul) > MAX_OBJECTS {
        return Err(count_node.wrong(format!("makes more than {MAX_OBJECTS} copies")));
    }
    let spacing: DVec3 = table
        .read("spacing", |node| node.numbers(COORDINATE, "[x, y, z]"))?
        .ok_or_else(|| table.wrong("needs spacing: [x, y, z] in metres"))?
        .into();
    let along = |axis: usize| (0..count[axis]).map(move |i| f64::from(i) - f64::from(count[axis] - 1) * 0.5);
    let steps = along(2).flat_map(|z| along(1).flat_map(move |y| along(0).map(move |x| DVec3::new(x, y, z))));
    Ok(steps.map(|step| step * spacing).collect())
}

impl ModelMaterials<'_> {
    /// Gives the model's objects the materials that the file names for them.
    pub fn put_on(&self, scene: &mut Scene) -> Result<(), Error> {
        if let Some(node) = self.table.get("material") {
            let material = find(&node, scene)?;
            scene.objects[self.objects.clone()].iter_mut().for_each(|object| object.material = material);
        }
        let Some(node) = self.table.get("materials") else { return Ok(()) };
        for (from, to) in node.entries()? {
            let material = find(&to, scene)?;
            let materials = &scene.materials;
            let mut worn = false;
            for object in &mut scene.objects[self.objects.clone()] {
                if materials[object.material].name == from {
                    (object.material, worn) = (material, true);
                }
            }
            if !worn {
                let mut names: Vec<&str> = scene.objects[self.objects.clone()]
                    .iter()
                    .map(|object| scene.materials[object.material].name.as_str())
                    .collect();
                names.sort_unstable();
                names.dedup();
                return Err(to.wrong(format!("the model has no such material: {}", unknown("material", from, &names))));
            }
        }
        Ok(())
    }
}

fn find(node: &KeyedValue, scene: &Scene) -> Result<usize, Error> {
    let name = node.string()?;
    // The last of a name is the file's own, when there are several.
    scene.materials.iter().rposition(|material| material.name == name).ok_or_else(|| {
        let names: Vec<&str> = scene.materials.iter().map(|material| material.name.as_str()).collect();
        node.wrong(unknown("material", name, &names))
    })
}
