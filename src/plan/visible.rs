//! What one camera sees of a scene: culled, sorted, and the shadow maps fitted to it. What is decided once for all frames is in the modules beside this
//! one; what is worked out for each frame is in those below it.

use std::sync::Arc;

use std::collections::{BTreeMap, BTreeSet};

use glam::{DAffine3, DVec3, Vec3};

use self::frustum::Frustum;
use self::occlusion::Occluders;
use self::volumes::{LightRect, Volumes};
use super::levels::stretch;
use super::light_culling::{ActiveLights, IdleLights, Misplacement};
use super::light_path::{self, Cut};
use super::shadows::{Changes, add_cascades, lamp_views, widened};
use super::{
    Caster, Clusters, Depth, Error, FramePlan, GeometryKey, MapProjection, Reach, Receivers, Shading, ShadowPlan,
    ShadowView, falloff_index,
};
use crate::scene::check::fits;
use crate::scene::{
    Aabb, AlphaMode, Camera, CastsShadow, Environment, Light, LightKind, LightPath, Material, Mesh, OptionalPart,
    Scene, Settings, ShadowSettings, Transparency,
};

pub mod boxes;
pub mod clusters;
pub mod depth;
pub mod frustum;
pub mod occlusion;
pub mod volumes;

/// What of a scene a frame looks at again each time. No texels, and no vertices but where triangles are sorted.
#[derive(Debug, Clone)]
pub struct World {
    pub objects: Vec<WorldObject>,
    pub materials: Vec<Material>,
    /// Only those that shine and can reach an object, with directions of length 1: directional lights, then those that reach everywhere, then those whose reach is limited.
    pub lights: Vec<Light>,
    /// How far each light reaches, in metres.
    pub reaches: Vec<f64>,
    /// Where lights without a range are cut off.
    cut: Cut,
    /// What the record of each light says of its shadow maps; see `ShadowPlan::code`.
    pub shadow_codes: Vec<u32>,
    /// Maps that only change when something moves, by their index.
    lamps: Vec<Option<Arc<ShadowView>>>,
    pub environment: Environment,
    pub bounds: Aabb,
    /// Of the scene as it was at first: maps are scaled by it, and must not change when something far away moves.
    pub radius: f64,
    /// The same, widened in steps where objects have left it: cascades are never larger.
    pub extent: Aabb,
    at_first: Aabb,
    pub shadows: ShadowSettings,
    /// From nits to what is tone-mapped.
    pub exposure: f32,
    /// By mesh: triangles that are sorted for each frame, as they are transparent.
    pub sortable: BTreeMap<usize, Vec<SortableTriangle>>,
    /// By the scene's own numbers: which of [`World::objects`] and [`World::lights`] it is, if it is among them.
    object_of: Vec<Option<usize>>,
    light_of: Vec<Option<usize>>,
    /// What the plan left out.
    idle_lights: IdleLights,
    /// What can hide other objects, where the plan leaves out what is hidden.
    occluders: Option<Occluders>,
    /// After how many of [`World::lights`] frames are halted.
    pub(super) halted: Option<usize>,
    /// Counts the changes of objects and lights, and of which lights are lit.
    pub(super) generation: u64,
    /// What has moved since `lamps` and `bounds` were worked out, if anything has.
    changes: Option<Changes>,
}

/// A triangle of a mesh, as far as it is sorted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SortableTriangle {
    pub indices: [u32; 3],
    /// In mesh space.
    pub centroid: Vec3,
}

/// An object that can be drawn.
#[derive(Debug, Clone)]
pub struct WorldObject {
    /// Its index in the scene.
    pub number: usize,
    pub mesh: usize,
    pub material: usize,
    /// From the mesh's f32 vertices to the world.
    pub transform: DAffine3,
    pub bounds: Aabb,
    pub casts: CastsShadow,
    /// Counts how often it has moved.
    pub revision: u32,
    /// The mesh's own place and box.
    mesh_place: (DVec3, Aabb),
    pub key: GeometryKey,
    /// The most that its transform may stretch a length.
    stretch_limit: f64,
    pub triangles: usize,
    pub transparent: bool,
}

impl World {
    /// `exposure` is the factor from nits to what is tone-mapped.
    pub fn of(scene: &Scene, settings: &Settings, plan: &FramePlan, exposure: f32) -> Self {
        let drawn: Vec<usize> =
            (0..scene.objects.len()).filter(|&index| plan.draws(scene, &scene.objects[index])).collect();
        let world_object = |&index: &usize| {
            let object = &scene.objects[index];
            let mesh = &scene.meshes[object.mesh];
            let transparent = plan.materials.all[object.material].is_transparent();
            WorldObject {
                number: index,
                mesh: object.mesh,
                material: object.material,
                transform: object.transform * DAffine3::from_translation(mesh.origin),
                bounds: object.bounds(&scene.meshes),
                // Light goes through what the eye looks through.
                casts: if transparent { CastsShadow::No } else { object.casts_shadow },
                transparent,
                revision: 0,
                mesh_place: (mesh.origin, mesh.bounds),
                key: GeometryKey::of(object, settings, plan),
                stretch_limit: plan.stretch_limit(object.material, &object.transform),
                triangles: mesh.indices.len() / 3,
            }
        };
        let mut object_of = vec![None; scene.objects.len()];
        drawn.iter().enumerate().for_each(|(own, &index)| object_of[index] = Some(own));
        let lights = plan.light_order.order.clone();
        let mut light_of = vec![None; scene.lights.len()];
        lights.iter().enumerate().for_each(|(own, &index)| light_of[index] = Some(own));
        let cut = Cut::of(scene, settings, exposure);
        let objects: Vec<WorldObject> = drawn.iter().map(world_object).collect();
        let sorts = plan.transparency == Some(Transparency::Sorted);
        let sorted: BTreeSet<usize> =
            objects.iter().filter(|object| sorts && object.transparent).map(|object| object.mesh).collect();
        let mut world = Self {
            objects,
            sortable: sorted.into_iter().map(|mesh| (mesh, SortableTriangle::all(&scene.meshes[mesh]))).collect(),
            materials: plan.materials.all.clone(),
            shadow_codes: (0..lights.len())
                .map(|light| plan.shadow.as_ref().map_or(0, |shadow| shadow.code(light)))
                .collect(),
            light_of,
            idle_lights: plan.light_order.idle.clone(),
            reaches: lights.iter().map(|&index| cut.reach(&scene.lights[index])).collect(),
            cut,
            lights: lights.into_iter().map(|index| scene.lights[index].aimed()).collect(),
            lamps: Vec::new(),
            environment: scene.environment,
            bounds: Aabb::EMPTY,
            radius: 0.0,
            extent: Aabb::EMPTY,
            at_first: Aabb::EMPTY,
            shadows: settings.shadows,
            exposure,
            object_of,
            occluders: None,
            halted: None,
            generation: 0,
            changes: Some(Changes::default()),
        };
        world.occluders = occlusion::planned(scene, plan).ok().map(|_| Occluders::of(scene, &world.objects));
        world.bounds = world.union();
        world.radius = world.bounds.radius();
        world.at_first = world.bounds;
        world.refresh(plan);
        world
    }

    /// Works out what follows from where objects and lights are, if any has moved.
    pub fn refresh(&mut self, plan: &FramePlan) {
        let Some(changes) = self.changes.take() else { return };
        self.bounds = self.union();
        self.extent = widened(&self.at_first, &self.bounds);
        if let Some(shadow) = &plan.shadow {
            self.lamps = lamp_views(self, shadow, &self.lamps, &changes);
        }
    }

    fn union(&self) -> Aabb {
        self.objects.iter().fold(Aabb::EMPTY, |all, object| all.union(&object.bounds))
    }

    /// Moves an object, by its index in the scene, to where `transform` places it.
    ///
    /// # Errors
    /// When there is no such object, it would need another pipeline, or a number is not finite.
    pub fn move_object(&mut self, index: usize, transform: &DAffine3) -> Result<(), Error> {
        if !fits(transform) {
            return Err(Error::Change(format!("object {index}: its transform is not finite")));
        }
        let Some(own) = self.object_of.get(index) else {
            return Err(Error::Change(format!("there is no object {index}: the scene has {}", self.object_of.len())));
        };
        let Some(object) = own.map(|own| &mut self.objects[own]) else { return Ok(()) };
        if (transform.matrix3.determinant() < 0.0) != object.key.mirrored {
            return Err(Error::Change(format!("object {index} cannot be mirrored while it is drawn")));
        }
        if stretch(transform) > object.stretch_limit {
            let why = "levels of its textures were left out that would show on a larger one";
            let keep = "keep its size, or all levels with `--plan texture-levels`";
            return Err(Error::Change(format!("object {index} cannot grow: {why}: {keep}")));
        }
        let (origin, bounds) = object.mesh_place;
        let place = bounds.transformed(transform);
        if let Some(light) = self.idle_lights.reaching(&place) {
            let what = "which reached nothing when its scene was planned; `--plan idle-lights` keeps such lights";
            return Err(Error::Change(format!("object {index} cannot come into reach of light {light}, {what}")));
        }
        let before = std::mem::replace(&mut object.bounds, place);
        object.transform = *transform * DAffine3::from_translation(origin);
        object.revision += 1;
        self.generation += 1;
        let changes = self.changes.get_or_insert_default();
        if object.casts != CastsShadow::No {
            changes.boxes.extend([before, object.bounds]);
        }
        Ok(())
    }

    /// Changes a light, by its index in the scene.
    ///
    /// # Errors
    /// When there is no such light, frames of the changed one would need other pipelines or maps, or a number is not finite.
    pub fn set_light(&mut self, index: usize, light: &Light) -> Result<(), Error> {
        if let Some(fault) = light.fault() {
            return Err(Error::Change(format!("light {index}: {fault}")));
        }
        let light = &light.aimed();
        let Some(own) = self.light_of.get(index) else {
            return Err(Error::Change(format!("there is no light {index}: the scene has {}", self.light_of.len())));
        };
        if self.idle_lights.has(index) {
            if self.idle_lights.set(index, light, self.objects.iter().map(|object| object.bounds)) {
                return Ok(());
            }
            let why = "it reached nothing when its scene was planned; `--plan idle-lights` keeps such lights";
            return Err(Error::Change(format!("light {index} cannot come to reach an object: {why}")));
        }
        let Some(own_index) = *own else {
            return Err(Error::Change(format!("light {index} was dark when its scene was planned")));
        };
        let own = &mut self.lights[own_index];
        if structure(own, &self.shadows) != structure(light, &self.shadows) {
            let what = "its kind, whether it shines, casts a shadow or has a range, its fall-off's kind and how wide a spot opens";
            return Err(Error::Change(format!("light {index} is drawn as it was planned: {what} must stay")));
        }
        own.clone_from(light);
        self.reaches[own_index] = self.cut.reach(light);
        self.changes.get_or_insert_default().lights.insert(own_index);
        self.generation += 1;
        Ok(())
    }

    /// Changes the factor from nits to what is tone-mapped, and with it how far the certified cut-off lets lights reach.
    pub fn set_exposure(&mut self, exposure: f32) {
        self.exposure = exposure;
        self.cut = self.cut.exposed(exposure);
        self.reaches = self.lights.iter().map(|light| self.cut.reach(light)).collect();
    }

    /// Differs from what it was as soon as an object or a light has changed, or which lights are lit.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// Whether a light can add anything.
    pub fn shines(light: &Light) -> bool {
        light.intensity > 0.0 && light.color.max_element() > 0.0
    }

    /// How many of the first lights are directional.
    pub fn directional_count(&self) -> usize {
        self.lights.iter().take_while(|light| matches!(light.kind, LightKind::Directional { .. })).count()
    }
}

impl World {
    /// How many of the first lights reach everywhere.
    pub fn global_count(&self) -> usize {
        self.reaches.iter().take_while(|reach| reach.is_infinite()).count()
    }
}

/// What of a light a plan depends on.
fn structure(light: &Light, shadows: &ShadowSettings) -> impl PartialEq {
    let (range, falloff) = match light.kind {
        LightKind::Directional { .. } => (false, (0, false)),
        LightKind::Point { range, falloff, .. } | LightKind::Spot { range, falloff, .. } => {
            (range.is_some(), (falloff_index(falloff), light_path::weakens(falloff)))
        }
    };
    let projection = MapProjection::of(light, shadows.cascades);
    let kind = std::mem::discriminant(&light.kind);
    (kind, projection, range, falloff, light.casts_shadow, World::shines(light))
}

/// An alpha below the cut-off that no texture changes: nothing of the object is there.
pub(super) fn is_cut_away(material: &Material) -> bool {
    match material.alpha_mode {
        AlphaMode::Mask { cutoff } => material.base_color_texture.is_none() && material.alpha < cutoff,
        AlphaMode::Opaque => false,
        // Without a highlight nothing is left of it.
        AlphaMode::Blend => material.alpha <= 0.0,
        AlphaMode::Glass => false,
    }
}

impl SortableTriangle {
    fn all(mesh: &Mesh) -> Vec<Self> {
        let corner = |index: u32| Vec3::from(mesh.positions[index as usize]);
        let triangle = |indices: [u32; 3]| Self { indices, centroid: indices.map(corner).iter().sum::<Vec3>() / 3.0 };
        mesh.indices.chunks_exact(3).map(|indices| triangle([indices[0], indices[1], indices[2]])).collect()
    }
}

/// A reference to an object to be drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Draw {
    /// Index into [`World::objects`].
    pub object: usize,
}

/// What the light path does with lights beyond the loop over those that meet every pixel.
#[derive(Debug, Clone, Default)]
pub enum LightWork {
    #[default]
    Nothing,
    /// A draw each.
    Draws(Vec<LightRect>),
    Volumes(Volumes),
    /// Spheres, relative to the camera, that the tiles are tested against: every light from the first limited one on.
    Spheres(Vec<Reach>),
}

/// A transparent object to be drawn, and where its triangles lie from back to front.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SortedDraw {
    /// Index into [`World::objects`].
    pub object: usize,
    /// Where its indices begin in [`Visible::sorted_indices`]; none where the order does not matter.
    pub first_index: Option<u32>,
}

/// The lists of one frame.
#[derive(Debug, Clone)]
pub struct Visible {
    /// From near to far, so that early depth tests save the most: hidden fragments cost more than changes of state (Sponza's
    /// GEOMETRY takes a fifth less CPU on lavapipe than sorted by material). Equally near ones by pipeline and material.
    pub draws: Vec<Draw>,
    /// Transparent objects, the farthest first.
    pub transparent: Vec<SortedDraw>,
    /// Indices of the transparent objects' triangles, the farthest of each object first.
    pub sorted_indices: Vec<u32>,
    /// The plan's shadow maps; none in which nothing that is seen is looked up.
    pub shadows: Vec<Option<Arc<ShadowView>>>,
    /// What is seen and receives shadows, where casters are left out that shadow none of it.
    receivers: Option<Receivers>,
    /// The lights of limited reach by froxel, where the plan has such lists.
    pub clusters: Option<Clusters>,
    pub lights: LightWork,
    /// The lights that reach what is seen.
    pub active_lights: ActiveLights,
    /// Objects beside or behind the view.
    pub culled: usize,
    /// Objects in view that others hide.
    pub occluded: usize,
    /// What depths are told by.
    pub depth: Depth,
}

impl Visible {
    /// Of what an [`Eye`]'s camera sees.
    pub fn of(world: &World, camera: &Camera, plan: &FramePlan) -> Self {
        let aspect = f64::from(plan.size[0]) / f64::from(plan.size[1]);
        let frustum = Frustum::of(camera, aspect);
        let depth = Depth::of(world, plan, camera);
        let beside = Misplacement::of(plan, camera, &depth);
        let mut seen: Vec<(usize, f64)> = world
            .objects
            .iter()
            .enumerate()
            .filter(|(_, object)| plan.keep.has(OptionalPart::OffscreenObjects) || frustum.may_see(&object.bounds))
            .map(|(index, object)| (index, camera.order(object.bounds.center())))
            .collect();
        let in_view = seen.len();
        if let Some(occluders) = &world.occluders {
            let picture = occlusion::Picture::of(
                world,
                occluders,
                (camera, &depth),
                plan.size,
                seen.iter().map(|&(index, _)| index),
            );
            seen.retain(|&(index, _)| !picture.hides(&world.objects[index].bounds));
        }
        let state = |index: usize| (world.objects[index].key, world.objects[index].material, index);
        seen.sort_by(|a, b| a.1.total_cmp(&b.1).then_with(|| state(a.0).cmp(&state(b.0))));
        let boxes: Vec<Aabb> = seen.iter().map(|&(index, _)| world.objects[index].bounds).collect();
        let active = ActiveLights::of(world, plan, (camera, &frustum), &beside, &boxes);
        let mut shadows = world.lamps.clone();
        let leaves_casters = plan.seeks(OptionalPart::IdleCasters) && plan.shading != Shading::ShowShadowMap;
        let receivers = plan.shadow.as_ref().filter(|_| leaves_casters).map(|shadow| {
            let receiving = seen.iter().filter(|&&(index, _)| world.objects[index].key.receives);
            let boxes = receiving.map(|&(index, _)| world.objects[index].bounds);
            Receivers::of(boxes, (camera, &frustum), &beside, shadow, &world.shadows)
        });
        if let Some(shadow) = &plan.shadow {
            add_cascades(&mut shadows, world, shadow, camera, aspect, &boxes);
            for light in &shadow.lights {
                let is_lit = active.lights.binary_search(&light.light).is_ok();
                let looked_up = |view: &Arc<ShadowView>| receivers.as_ref().is_none_or(|seen| seen.look_into(view));
                for view in &mut shadows[light.first_view..light.first_view + light.projection.views()] {
                    *view = view.take().filter(|view| is_lit && looked_up(view));
                }
            }
        }
        let (mut transparent, opaque): (Vec<_>, Vec<_>) =
            seen.iter().map(|&(index, _)| index).partition(|&index| world.objects[index].transparent);
        if world.is_halted() {
            transparent.clear();
        }
        let (transparent, sorted_indices) = back_to_front(world, camera, transparent.into_iter().rev());
        Self {
            culled: world.objects.len() - in_view,
            occluded: in_view - seen.len(),
            draws: opaque.into_iter().map(|object| Draw { object }).collect(),
            transparent,
            sorted_indices,
            shadows,
            receivers,
            clusters: plan.has_clusters().then(|| {
                clusters::bin(&active.spheres(world, active.global), active.global as u32, (camera, &depth), plan.size)
            }),
            lights: light_work(world, camera, plan, &active),
            active_lights: active,
            depth,
        }
    }

    /// Casters of one of the maps, without those that shadow nothing that is seen.
    pub fn needed(&self, world: &World, plan: &ShadowPlan, view: &ShadowView) -> Vec<Caster> {
        match &self.receivers {
            Some(receivers) => receivers.needed(world, plan, view),
            None => view.casters.clone(),
        }
    }

    pub fn triangles(&self, world: &World) -> usize {
        let opaque = self.draws.iter().map(|draw| draw.object);
        let drawn = opaque.chain(self.transparent.iter().map(|draw| draw.object));
        drawn.map(|object| world.objects[object].triangles).sum()
    }
}

fn light_work(world: &World, camera: &Camera, plan: &FramePlan, active: &ActiveLights) -> LightWork {
    let first = active.looped;
    if first == active.lights.len() {
        return LightWork::Nothing;
    }
    match plan.light_path {
        LightPath::PerLight => {
            LightWork::Draws(volumes::rectangles(&active.spheres(world, first), first as u32, camera, plan.size))
        }
        LightPath::Volumes => LightWork::Volumes(Volumes::of(world, active, camera)),
        LightPath::Compute => {
            // A little larger, for the rounding of f32.
            let relative = |reach: Reach| {
                let center = reach.center - camera.position;
                Reach { center, radius: reach.radius + 1e-5 * (reach.radius + center.length()) }
            };
            LightWork::Spheres(active.spheres(world, first).into_iter().map(relative).collect())
        }
        LightPath::Auto | LightPath::Loop | LightPath::Clustered | LightPath::Forward | LightPath::ForwardNaive => {
            LightWork::Nothing
        }
    }
}

/// Sorts the triangles of each of these objects by where rays meet their centroid ([`Camera::order`]), the farthest first; equally far ones as
/// they lie in the mesh.
fn back_to_front(world: &World, camera: &Camera, objects: impl Iterator<Item = usize>) -> (Vec<SortedDraw>, Vec<u32>) {
    let mut indices = Vec::new();
    let draws = objects.map(|index| {
        let object = &world.objects[index];
        let Some(triangles) = world.sortable.get(&object.mesh) else {
            return SortedDraw { object: index, first_index: None };
        };
        // In f64: what is near must not take its order from how far the origin is.
        let distance =
            |triangle: &SortableTriangle| camera.order(object.transform.transform_point3(triangle.centroid.as_dvec3()));
        let mut order: Vec<(f64, usize)> =
            triangles.iter().enumerate().map(|(place, triangle)| (distance(triangle), place)).collect();
        order.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let first_index = indices.len() as u32;
        indices.extend(order.into_iter().flat_map(|(_, place)| triangles[place].indices));
        SortedDraw { object: index, first_index: Some(first_index) }
    });
    (draws.collect(), indices)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::samples;
    use crate::scene::{Falloff, Keep};

    #[test]
    fn draws_are_from_near_to_far_then_by_pipeline_and_material() {
        let mut scene = samples::scene(vec![samples::masked(), Material::default(), Material::default()], vec![]);
        // Two of each, the far one first.
        let objects = scene.objects.clone();
        scene.objects = [3.0, 1.0, 2.0]
            .into_iter()
            .flat_map(|depth| {
                objects.iter().cloned().map(move |mut object| {
                    object.transform = DAffine3::from_translation(DVec3::new(0.0, 0.0, -depth));
                    object
                })
            })
            .collect();
        let settings = Settings::default();
        let plan = FramePlan::of(&scene, &settings, &samples::device()).expect("a plan");
        let world = World::of(&scene, &settings, &plan, 1.0);
        let visible = Visible::of(&world, &Camera::default(), &plan);
        let order: Vec<_> = visible.draws.iter().map(|draw| &world.objects[draw.object]).collect();
        assert_eq!((order.len(), visible.culled, visible.triangles(&world)), (9, 0, 18));
        let near = |object: &WorldObject| (object.bounds.center() - Camera::default().position).length();
        for pair in order.windows(2) {
            let (a, b) = ((pair[0].key, pair[0].material), (pair[1].key, pair[1].material));
            assert!(near(pair[0]) < near(pair[1]) || (near(pair[0]) == near(pair[1]) && a <= b));
        }
    }

    #[test]
    fn what_its_alpha_cuts_away_and_what_has_no_triangles_is_not_drawn() {
        let cut = Material { alpha: 0.4, alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..Material::default() };
        let kept = Material { alpha: 0.5, ..cut.clone() };
        let mut scene = samples::scene(vec![cut, kept, Material::default()], vec![]);
        scene.meshes.push(Mesh::default());
        scene.objects[2].mesh = 1;
        let settings = Settings::default();
        let plan = FramePlan::of(&scene, &settings, &samples::device()).expect("a plan");
        let world = World::of(&scene, &settings, &plan, 1.0);
        assert_eq!(world.objects.iter().map(|object| object.material).collect::<Vec<_>>(), [1]);
    }

    #[test]
    fn lights_are_directional_then_the_unlimited_then_the_limited_and_only_those_that_shine() {
        let named = |name: &str, light: Light| Light { name: name.into(), ..light };
        let dark = Light { intensity: 0.0, ..samples::sun() };
        let lights = vec![
            named("lamp", samples::point(Falloff::Quadratic)),
            named("sky", samples::sky()),
            named("dark", dark),
            named("sun", samples::sun()),
            named("spot", samples::spot(Falloff::InverseSquare)),
            named("second sun", samples::sun()),
        ];
        let scene = samples::scene(vec![Material::default()], lights);
        let settings = Settings::default();
        let plan = FramePlan::of(&scene, &settings, &samples::device()).expect("a plan");
        let world = World::of(&scene, &settings, &plan, 1.0);
        let names: Vec<_> = world.lights.iter().map(|light| light.name.as_str()).collect();
        assert_eq!(names, ["sky", "sun", "second sun", "spot", "lamp"]);
        assert_eq!(world.directional_count(), 3);
    }
    #[test]
    fn numbers_that_are_not_finite_are_refused_by_name_in_a_plan_and_in_changes_of_it() {
        let mut scene = samples::scene(vec![Material::default()], vec![samples::sun()]);
        let settings = Settings::default();
        let plan = |scene: &Scene| FramePlan::of(scene, &settings, &samples::device());
        let mut world = World::of(&scene, &settings, &plan(&scene).expect("a plan"), 1.0);
        let bad = Light { color: Vec3::new(f32::NAN, 1.0, 1.0), ..samples::sun() };
        let refused = |error: Result<(), Error>| error.expect_err("refused").to_string();
        assert_eq!(refused(world.set_light(0, &bad)), "light 0: color is not finite");
        let moved = DAffine3::from_translation(DVec3::Y * f64::INFINITY);
        assert_eq!(refused(world.move_object(0, &moved)), "object 0: its transform is not finite");
        assert_eq!((world.generation(), &world.lights), (0, &scene.lights));
        (scene.name, scene.meshes[0].normals[2][1]) = ("made".into(), f32::INFINITY);
        let said = plan(&scene).expect_err("refused").to_string();
        assert!(said.starts_with("made: mesh 0 (") && said.ends_with("the normal of vertex 2 is not finite"), "{said}");
        // All parts kept, a plan is made twice, and the words are the same.
        let full = FramePlan::of(&scene, &Settings { keep: Keep::ALL, ..settings.clone() }, &samples::device());
        assert_eq!(full.expect_err("refused").to_string(), said);
    }
}
