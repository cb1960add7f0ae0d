//! Reduces a scene to the part that glTF, with this program's extras, can express: still, lit by punctual lights only, with the metallic-roughness
//! materials that the reader supports.

use glam::Vec3;

use super::{emitters, surfaces};
use crate::{
    CastsShadow, Environment, Falloff, FittedParts, Light, LightKind, Look, Material, Mesh, NamedCamera, Object,
    Playing, Scene, SettingsPatch, TextureSlot, luminance,
};

/// The widest cone of KHR_lights_punctual, from its axis.
const WIDEST_DEGREES: f64 = 90.0;
/// The ratio to which inner angles are lowered: cones open from their inner to their outer angle, which has to be larger. No formula distinguishes so
/// small a difference from none.
const NARROWER: f64 = 1.0 - 1e-9;

/// The scene without the parts that glTF lacks, and a line for each kind of thing that is left out or simplified.
pub(super) fn expressible(scene: Scene) -> (Scene, Vec<String>) {
    let mut left_out = Vec::new();
    let mut scene = scene.into_still(&Playing::default());
    surroundings(&mut scene, &mut left_out);
    objects(&mut scene, &mut left_out);
    surfaces::express(&mut scene, &mut left_out);
    lights(&mut scene.lights, &mut left_out);
    if scene.lights.is_empty() {
        left_out.push("no light is left: whoever opens the file lights it as suits a bare model".into());
    }
    cameras(&mut scene);
    used(&mut scene);
    (scene, left_out)
}

/// Adds a line about left-out parts, unless their count is 0.
pub(super) fn tell(left_out: &mut Vec<String>, count: usize, what: &str, words: &str) {
    match count {
        0 => {}
        1 => left_out.push(format!("1 {what}: {words}")),
        _ => left_out.push(format!("{count} {what}s: {words}")),
    }
}

fn surroundings(scene: &mut Scene, left_out: &mut Vec<String>) {
    let Environment { background, .. } = scene.environment;
    let color = |color: Vec3| color.to_array().map(|channel| channel.to_string()).join(", ");
    if scene.environment.is_lit() {
        let nits = color(scene.environment.ambient);
        left_out.push(format!("ambient light of {nits} nits: the scene's extras have it, which afterlight reads"));
    }
    if luminance(background) > 0.0 {
        let nits = color(background);
        left_out.push(format!("the background of {nits} nits: the scene's extras have it, which afterlight reads"));
    }
    if scene.sky.is_some() {
        left_out.push("the sky, and its light".into());
    }
    scene.sky = None;
    emitters::leave_out(scene, left_out);
    scene.settings = SettingsPatch::default();
    scene.fitted = FittedParts::default();
}

fn objects(scene: &mut Scene, left_out: &mut Vec<String>) {
    for mesh in &mut scene.meshes {
        mesh.remove_degenerate_triangles();
        if mesh.colors.iter().all(|color| *color == [1.0; 4]) {
            mesh.colors.clear();
        }
    }
    let meshes = &scene.meshes;
    scene.objects.retain(|object| meshes.get(object.mesh).is_some_and(|mesh| !mesh.indices.is_empty()));
    let (mut unshadowed, mut cells) = (0, 0);
    for object in &mut scene.objects {
        let is_coat = scene.materials.get(object.material).is_some_and(surfaces::is_coat);
        // Points and lines cast no shadow.
        let is_strokes = meshes.get(object.mesh).is_some_and(|mesh| mesh.is_strokes);
        let casts = if is_coat || is_strokes { CastsShadow::No } else { CastsShadow::Yes };
        unshadowed += usize::from((object.casts_shadow != casts && !is_coat) || !object.receives_shadow);
        (object.casts_shadow, object.receives_shadow, object.movable) = (casts, true, false);
        let look = object.look.take().unwrap_or_default();
        cells += usize::from(look.cell > 0 || look.selected);
        if look.tint != Vec3::ONE {
            tint(object, &look, &mut scene.materials);
        }
    }
    tell(left_out, unshadowed, "object", "that some or all shadows leave out, written as any other");
    tell(left_out, cells, "object", "cells of atlases and selections are left out");
}

/// Gives an object a separate material, tinted by its look.
fn tint(object: &mut Object, look: &Look, materials: &mut Vec<Material>) {
    let Some(own) = materials.get(object.material) else { return };
    let tinted = Material { base_color: own.base_color * look.tint, ..own.clone() };
    object.material = materials.iter().position(|other| *other == tinted).unwrap_or_else(|| {
        materials.push(tinted);
        materials.len() - 1
    });
}

fn lights(lights: &mut Vec<Light>, left_out: &mut Vec<String>) {
    let before = lights.len();
    lights.retain(|light| !matches!(light.kind, LightKind::Beam { .. }));
    tell(left_out, before - lights.len(), "beam", "parallel light from a disc is left out");
    let (mut other, mut wide) = (0, 0);
    for light in lights {
        // glTF limits the channels of a colour to 0 to 1. Moving a power of 2 between the two factors rounds nothing.
        let share = power_of_two_above(light.color.max_element());
        if share > 1.0 && (light.intensity * share).is_finite() {
            (light.color, light.intensity) = (light.color / share, light.intensity * share);
        }
        match &mut light.kind {
            LightKind::Point { falloff, .. } => other += usize::from(take(falloff)),
            LightKind::Spot { falloff, inner_angle_degrees, outer_angle_degrees, .. } => {
                other += usize::from(take(falloff));
                wide += usize::from(*outer_angle_degrees > WIDEST_DEGREES);
                *outer_angle_degrees = outer_angle_degrees.min(WIDEST_DEGREES);
                *inner_angle_degrees = inner_angle_degrees.min(*outer_angle_degrees * NARROWER);
            }
            LightKind::Directional { .. } | LightKind::Beam { .. } => {}
        }
    }
    tell(left_out, other, "light", "a fall-off other than inverse-square is written as that");
    tell(left_out, wide, "spot light", "cones wider than 90 degrees from their axis end there");
}

/// Replaces a fall-off by the only one that glTF has. Returns true if it was another.
fn take(falloff: &mut Falloff) -> bool {
    std::mem::replace(falloff, Falloff::InverseSquare) != Falloff::InverseSquare
}

/// The least power of 2 that is not below a value; 1 for less.
pub(super) fn power_of_two_above(value: f32) -> f32 {
    if !(1.0..=1e38).contains(&value) {
        return 1.0;
    }
    let power = value.log2().ceil().exp2();
    // The logarithm may have been rounded down to a whole number.
    if power < value { 2.0 * power } else { power }
}

/// Lists the scene's camera first: a bare file is viewed through its first camera.
fn cameras(scene: &mut Scene) {
    let own = scene.cameras.iter().position(|own| own.camera == scene.camera);
    let name = own.map_or_else(|| "camera".to_owned(), |own| scene.cameras.remove(own).name);
    let mut names = vec![name.clone()];
    scene.cameras.retain(|own| {
        !own.name.is_empty() && !names.contains(&own.name) && {
            names.push(own.name.clone());
            true
        }
    });
    scene.cameras.insert(0, NamedCamera { name, camera: scene.camera, node: None });
    scene.looks_through = Some(0);
}

/// Leaves out meshes, materials and textures that no object has, and lists the rest in the order of objects.
fn used(scene: &mut Scene) {
    let mut meshes = Compaction::of(&mut scene.meshes);
    let mut materials = Compaction::of(&mut scene.materials);
    let mut textures = Compaction::of(&mut scene.textures);
    for object in &mut scene.objects {
        (object.mesh, object.material) = (meshes.keep(object.mesh), materials.keep(object.material));
    }
    scene.meshes = meshes.list();
    scene.materials = materials.list();
    for material in &mut scene.materials {
        for slot in TextureSlot::ALL {
            let texture = material.texture_mut(slot);
            *texture = texture.map(|own| textures.keep(own));
        }
    }
    scene.textures = textures.list();
    scene.meshes.iter_mut().for_each(|mesh: &mut Mesh| mesh.levels = Default::default());
}

/// The kept entries of a list, in the order of their first use.
struct Compaction<T> {
    list: Vec<Option<T>>,
    numbers: Vec<Option<usize>>,
    order: Vec<usize>,
}

impl<T> Compaction<T> {
    fn of(list: &mut Vec<T>) -> Self {
        let list: Vec<_> = std::mem::take(list).into_iter().map(Some).collect();
        Self { numbers: vec![None; list.len()], list, order: Vec::new() }
    }

    /// Keeps an entry, and returns its new number. The entry exists, since the scene was checked.
    fn keep(&mut self, index: usize) -> usize {
        *self.numbers[index].get_or_insert_with(|| {
            self.order.push(index);
            self.order.len() - 1
        })
    }

    fn list(mut self) -> Vec<T> {
        self.order.iter().filter_map(|&index| self.list[index].take()).collect()
    }
}
