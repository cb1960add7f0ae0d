//! The part of a scene that frames read: its objects, lights and materials as the plan has them, which a program may move and change between frames.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3, Vec2, Vec3};

use super::bodies::shape;
use super::instances::InstanceList;
use super::looks::PlannedLook;
use super::occlusion::Occluders;
use super::pose::WorldPose;
use super::previous::PreviousTransforms;
use super::shadows::{Changes, ShadowView, lamp_views, widened};
use crate::plan::{
    Cuts, ForwardKey, FramePlan, GeometryKey, IdleLights, LightCutoff, LightOrder, MapProjection, PlanError,
    PlannedLevel, SurfaceRules, weakens,
};
use crate::scene::check::fits;
use crate::scene::{
    Aabb, CastsShadow, ClipChoice, Emitter, Environment, Light, Material, Mesh, Playing, Scene, Settings,
    ShadowSettings, Sky, SkyDirection, SkyDistribution, Transparency,
};

/// The part of a scene that every frame reads again: no texels, and no vertices but the centroids of sorted triangles.
#[derive(Debug, Clone)]
pub struct World {
    pub objects: Vec<WorldObject>,
    /// The objects as instances, in draw order.
    pub instances: InstanceList,
    pub materials: Vec<Material>,
    /// The lights that shine and can reach an object, with directions of length 1: directional, unbounded, then bounded lights.
    pub lights: Vec<Light>,
    /// The reach of each light, in metres.
    pub reaches: Vec<f64>,
    /// The cut-off of lights without a range.
    cut: LightCutoff,
    /// The code of each light's shadow maps in its record; see `ShadowPlan::code`.
    pub shadow_codes: Vec<u32>,
    /// Maps that only change when something moves, by their index.
    pub(super) lamps: Vec<Option<Arc<ShadowView>>>,
    pub environment: Environment,
    /// The sky; `None` in a scene without sky.
    pub sky: Option<WorldSky>,
    /// The sky's light, if frames draw directions from it.
    sky_light: Option<SkyDistribution>,
    /// Directional lights of the next frame, drawn from the sky.
    pub sky_directions: Vec<SkyDirection>,
    /// Mean radiance of the sky that lights the scene, in nits.
    pub sky_mean: Vec3,
    /// Sources of particles.
    pub emitters: Vec<Emitter>,
    /// The moment of motion at which particles are seen, in seconds.
    pub moment: f64,
    pub bounds: Aabb,
    /// The radius of the scene as it was at first. Maps are scaled by it, and must not change when something far away moves.
    pub radius: f64,
    /// The box of the scene as it was at first, widened in steps if objects have left it. Cascades are never larger.
    pub extent: Aabb,
    at_first: Aabb,
    pub shadows: ShadowSettings,
    /// The factor from nits to exposed light, which is tone-mapped.
    pub exposure: f32,
    /// The transparent triangles that are sorted for each frame, by mesh.
    pub sortable: BTreeMap<usize, Vec<SortableTriangle>>,
    /// The transparent triangles of deformed meshes that are sorted for each frame, by the plan's deformed mesh.
    pub deformed_triangles: BTreeMap<usize, Vec<SortableTriangle>>,
    /// The index into [`World::objects`] and [`World::lights`] by the scene's own numbers; `None` if left out.
    object_of: Vec<Option<usize>>,
    light_of: Vec<Option<usize>>,
    /// The lights that the plan left out.
    idle_lights: IdleLights,
    /// The levels of detail of each mesh; empty if no mesh has any.
    pub(super) levels: Vec<Vec<PlannedLevel>>,
    /// The occluders, if the CPU does occlusion culling.
    pub(super) occluders: Option<Occluders>,
    /// The number of [`World::lights`] after which frames are halted.
    halted: Option<usize>,
    /// Counts the changes of objects and lights, and of the lights that are lit.
    pub(super) generation: u64,
    /// The deformed meshes in SKIN's form.
    pub pose: WorldPose,
    /// The objects' transforms in the previous frame.
    pub previous: PreviousTransforms,
    /// The changes since `lamps` and `bounds` were computed; `None` if nothing has moved.
    pub(super) changes: Option<Changes>,
}

/// The shaders' parameters of a sky.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct WorldSky {
    /// Cosine and sine of the rotation from the world to the sky.
    pub turn: Vec2,
    /// The factor from the texels' values on the device to nits.
    pub scale: f32,
    pub sun_direction: Vec3,
    pub sun_radiance: Vec3,
    /// Sine of the sun's angular radius.
    pub sun_sine: f32,
    /// The mean radiance over all directions, in nits.
    pub mean: Vec3,
}

impl WorldSky {
    fn of(sky: &Sky) -> Self {
        let (sin, cos) = sky.rotation_degrees.to_radians().sin_cos();
        Self {
            turn: DVec2::new(cos, sin).as_vec2(),
            scale: sky.nits / sky.image.half_scale(),
            sun_direction: sky.sun.map_or(Vec3::ZERO, |sun| sun.direction.as_vec3()),
            sun_radiance: sky.sun.map_or(Vec3::ZERO, |sun| sun.radiance),
            sun_sine: sky.sun.map_or(0.0, |sun| (sun.degrees / 2.0).to_radians().sin()) as f32,
            mean: sky.mean(),
        }
    }
}

/// A triangle of a mesh, for sorting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SortableTriangle {
    pub indices: [u32; 3],
    /// The centroid in mesh space.
    pub centroid: Vec3,
}

/// An object that can be drawn.
#[derive(Debug, Clone)]
pub struct WorldObject {
    /// The index in the scene.
    pub number: usize,
    pub mesh: usize,
    /// The index of its mesh among the plan's deformed meshes.
    pub deform: Option<usize>,
    pub material: usize,
    /// The map from the mesh's f32 vertices to the world.
    pub transform: DAffine3,
    pub bounds: Aabb,
    pub casts: CastsShadow,
    /// Counts how often it has moved.
    pub revision: u32,
    /// The origin and the box of the mesh itself.
    pub(super) mesh_place: (DVec3, Aabb),
    /// True if its motion can mirror it.
    pub may_mirror: bool,
    pub key: GeometryKey,
    /// The key with which it is lit again as it is drawn, if LIGHTING's light is incomplete.
    pub relit: Option<ForwardKey>,
    /// The holes in its shadow.
    pub(crate) cuts: Cuts,
    pub triangles: usize,
    pub transparent: bool,
    pub look: PlannedLook,
    /// Properties of a glass body: the share of its surface that is round, and 1 over the longest edge of its mesh's box.
    pub round: f32,
    pub slender: f32,
}

impl World {
    /// `exposure` is the factor from nits to exposed light.
    pub fn of(scene: &Scene, settings: &Settings, plan: &FramePlan, exposure: f32) -> Self {
        let rules = plan.surface_rules();
        let mirrors = scene.motion.mirrors();
        let drawn = (0..scene.objects.len()).filter(|&index| rules.draws(scene, &scene.objects[index]));
        let objects: Vec<WorldObject> =
            drawn.map(|index| WorldObject::of(scene, (plan, &rules), mirrors, index)).collect();
        let LightOrder { order, idle, .. } = &plan.light_order;
        let cut = LightCutoff::of(scene, settings, exposure);
        let sorts = plan.transparency == Some(Transparency::Sorted);
        let sorted: BTreeSet<usize> =
            objects.iter().filter(|own| sorts && own.transparent && own.deform.is_none()).map(|own| own.mesh).collect();
        let bounds = union(&objects);
        let object_of = places(objects.iter().map(|object| object.number), scene.objects.len());
        let mut world = Self {
            pose: WorldPose::of(scene, plan, &object_of, |index| sorts && rules.sorts(scene, &scene.objects[index])),
            deformed_triangles: BTreeMap::new(),
            object_of,
            light_of: places(order.iter().copied(), scene.lights.len()),
            levels: levels_of(plan, scene.meshes.len()),
            occluders: (plan.finds_hidden(scene).is_ok() && !plan.hides_on_device)
                .then(|| Occluders::of(scene, plan, &objects)),
            instances: InstanceList::default(),
            objects,
            sortable: sorted
                .into_iter()
                .map(|mesh| (mesh, SortableTriangle::all(&scene.meshes[mesh], &DAffine3::IDENTITY)))
                .collect(),
            materials: at_rest(scene, plan),
            shadow_codes: (0..order.len())
                .map(|light| plan.shadow.as_ref().map_or(0, |shadow| shadow.code(light)))
                .collect(),
            idle_lights: idle.clone(),
            reaches: order.iter().map(|&index| cut.reach(&scene.lights[index])).collect(),
            cut,
            lights: order.iter().map(|&index| scene.lights[index].aimed()).collect(),
            lamps: Vec::new(),
            environment: scene.environment,
            sky: scene.sky.as_ref().map(WorldSky::of),
            sky_light: match (&scene.sky, &plan.shadow) {
                (Some(sky), Some(shadow)) if shadow.sky.is_some() => SkyDistribution::of(sky),
                _ => None,
            },
            sky_directions: Vec::new(),
            sky_mean: match (&scene.sky, plan.is_lit_by_sky()) {
                (Some(sky), true) => sky.mean(),
                _ => Vec3::ZERO,
            },
            emitters: scene.emitters.clone(),
            moment: scene.moment.unwrap_or(0.0),
            bounds,
            radius: bounds.radius(),
            extent: bounds,
            at_first: bounds,
            shadows: settings.shadows,
            exposure,
            halted: None,
            generation: 0,
            previous: PreviousTransforms::default(),
            changes: Some(Changes { rearranged: true, ..Changes::default() }),
        };
        if plan.deforms() {
            world.pose(&scene.motion, &scene.motion.pose(&Playing { clips: ClipChoice::None, ..Playing::default() }));
            // A deformed object is not where its mesh is.
            let bounds = union(&world.objects);
            (world.bounds, world.extent, world.at_first, world.radius) = (bounds, bounds, bounds, bounds.radius());
        }
        world.refresh(plan);
        world.aim_sky(plan, 0);
        world.previous = PreviousTransforms::new(plan.lists_moving());
        world
    }

    /// Brings everything up to date that depends on the places of objects and lights, if any has moved.
    pub fn refresh(&mut self, plan: &FramePlan) {
        let Some(changes) = self.changes.take() else { return };
        match changes.rearranged {
            true => self.instances = InstanceList::of(&self.objects, self.instances.arranged() + 1),
            false => self.instances.refresh(&self.objects, &changes.moved),
        }
        self.bounds = self.instances.bounds();
        self.extent = widened(&self.at_first, &self.bounds);
        if let Some(shadow) = &plan.shadow {
            self.lamps = lamp_views(self, shadow, &self.lamps, &changes);
        }
    }

    /// Draws the directions of the sky that light frame `index` of a picture. The mean of all frames is lit by all of the sky.
    pub fn aim_sky(&mut self, plan: &FramePlan, index: u32) {
        if let (Some(light), Some(sky)) = (&self.sky_light, plan.shadow.as_ref().and_then(|shadow| shadow.sky)) {
            self.sky_directions = light.of_frame(index, sky.count);
        }
    }

    /// Moves an object, by its index in the scene, to where `transform` places it. Returns false where that needs another plan: it would be
    /// mirrored, or come into reach of a light that the plan has left out.
    ///
    /// # Errors
    /// When there is no such object, or a number is not finite.
    pub fn move_object(&mut self, index: usize, transform: &DAffine3) -> Result<bool, PlanError> {
        if !fits(transform) {
            return Err(PlanError::Change(format!("object {index}: its transform is not finite")));
        }
        let Some(own) = self.place_of(index)? else { return Ok(true) };
        let object = &self.objects[own];
        let (origin, bounds) = object.mesh_place;
        let place = bounds.transformed(transform);
        let mirrors = (transform.matrix3.determinant() < 0.0) != object.key.mirrored && !object.may_mirror;
        // A deformed object stands where its pose has it.
        if mirrors || object.deform.is_some() || self.idle_lights.reaching(&place).is_some() {
            return Ok(false);
        }
        self.stand(own, *transform * DAffine3::from_translation(origin), place, false);
        Ok(true)
    }

    /// Returns the index into [`World::objects`] of an object, by its index in the scene; `None` if it is not drawn.
    pub(super) fn place_of(&self, index: usize) -> Result<Option<usize>, PlanError> {
        let count = self.object_of.len();
        let none = || PlanError::Change(format!("there is no object {index}: the scene has {count}"));
        self.object_of.get(index).copied().ok_or_else(none)
    }

    /// Changes a light, by its index in the scene. Returns false if this needs another plan: the light was left out because it was dark or reached
    /// nothing, or the changed light needs other pipelines or maps.
    ///
    /// # Errors
    /// When there is no such light, or a number is not finite.
    pub fn set_light(&mut self, index: usize, light: &Light) -> Result<bool, PlanError> {
        if let Some(fault) = light.fault() {
            return Err(PlanError::Change(format!("light {index}: {fault}")));
        }
        let light = &light.aimed();
        let Some(own) = self.light_of.get(index) else {
            return Err(PlanError::Change(format!("there is no light {index}: the scene has {}", self.light_of.len())));
        };
        if self.idle_lights.has(index) {
            return Ok(self.idle_lights.set(index, light, self.objects.iter().map(|object| object.bounds)));
        }
        let &Some(own) = own else { return Ok(!light.shines()) };
        if structure(&self.lights[own], &self.shadows) != structure(light, &self.shadows) {
            return Ok(false);
        }
        self.lights[own].clone_from(light);
        self.reaches[own] = self.cut.reach(light);
        self.changes.get_or_insert_default().lights.insert(own);
        self.generation += 1;
        Ok(true)
    }

    /// Changes a material that clips may change.
    pub fn set_material(&mut self, index: usize, material: Material) {
        if let Some(own) = self.materials.get_mut(index)
            && *own != material
        {
            *own = material;
            self.generation += 1;
            // Masks may cut other holes into shadows, and transparent surfaces may let other light through.
            let shows = |object: &WorldObject| object.transparent || object.cuts.any();
            let cast = |object: &&mut WorldObject| {
                object.material == index && object.casts != CastsShadow::No && shows(object)
            };
            for object in self.objects.iter_mut().filter(cast) {
                object.revision += 1;
                self.changes.get_or_insert_default().boxes.push(object.bounds);
            }
        }
    }

    /// Changes the factor from nits to exposed light, and with it the reach of lights by the certified cut-off.
    pub fn set_exposure(&mut self, exposure: f32) {
        self.exposure = exposure;
        self.cut = self.cut.exposed(exposure);
        self.reaches = self.lights.iter().map(|light| self.cut.reach(light)).collect();
    }

    /// A number that changes with any object, any light, and the choice of lights that are lit.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// The number of directional lights; they come first.
    pub fn directional_count(&self) -> usize {
        self.lights.iter().take_while(|light| light.kind.is_directional()).count()
    }

    /// The number of lights that reach everywhere; they come first, the directional ones among them.
    pub fn global_count(&self) -> usize {
        self.reaches.iter().take_while(|reach| reach.is_infinite()).count()
    }

    /// Halts frames after the first `lights` of [`World::lights`], or after all if there are fewer, before anything transparent is drawn. The plan
    /// does not change. Frames are complete again with `None`.
    pub fn halt_after(&mut self, lights: Option<usize>) {
        if self.halted != lights {
            self.halted = lights;
            // A shadow map that nothing sampled may lack casters that the camera needs now.
            self.generation += 1;
        }
    }

    /// The number of lights after which frames are halted.
    pub fn halted(&self) -> Option<usize> {
        self.halted
    }

    pub(super) fn is_halted(&self) -> bool {
        self.halted.is_some()
    }

    /// The number of lights that a frame may show: the first ones, where frames are halted.
    pub(super) fn lit_count(&self) -> usize {
        self.halted.map_or(self.lights.len(), |lights| lights.min(self.lights.len()))
    }
}

impl WorldObject {
    fn of(scene: &Scene, (plan, rules): (&FramePlan, &SurfaceRules), mirrors: bool, number: usize) -> Self {
        let object = &scene.objects[number];
        let mesh = &scene.meshes[object.mesh];
        let transparent = rules.material(object).is_transparent();
        let [round, slender] = if rules.material(object).refraction.is_some() { shape(mesh) } else { [0.0; 2] };
        Self {
            number,
            mesh: object.mesh,
            deform: plan.meshes.deforms.find(number),
            material: object.material,
            transform: object.transform * DAffine3::from_translation(mesh.origin),
            bounds: object.bounds(&scene.meshes),
            casts: rules.shadow_of(object),
            transparent,
            revision: 0,
            mesh_place: (mesh.origin, mesh.bounds),
            may_mirror: mirrors && object.moves(),
            key: GeometryKey::of(object, rules),
            relit: rules.relit(object),
            cuts: rules.cuts(object),
            triangles: mesh.indices.len() / 3,
            look: PlannedLook::of(object.shown_look(), rules.material(object), &plan.textures),
            round,
            slender,
        }
    }
}

/// By mesh of the scene, of which there are `count`; nothing where no mesh has levels of detail.
fn levels_of(plan: &FramePlan, count: usize) -> Vec<Vec<PlannedLevel>> {
    if plan.lod <= 0.0 {
        return Vec::new();
    }
    let mut levels = vec![Vec::new(); count];
    plan.meshes.meshes.iter().for_each(|planned| levels[planned.mesh].clone_from(&planned.levels));
    levels
}

fn union(objects: &[WorldObject]) -> Aabb {
    objects.iter().fold(Aabb::EMPTY, |all, object| all.union(&object.bounds))
}

/// The place of each number among the numbers in use, for the scene's `count` numbers.
fn places(numbers: impl Iterator<Item = usize>, count: usize) -> Vec<Option<usize>> {
    let mut places = vec![None; count];
    numbers.enumerate().for_each(|(place, number)| places[number] = Some(place));
    places
}

/// The materials of a plan. Materials that clips change are in their rest state, with nothing folded.
fn at_rest(scene: &Scene, plan: &FramePlan) -> Vec<Material> {
    let mut materials = plan.materials.all.clone();
    for index in scene.motion.moved_materials() {
        materials[index] = plan.materials.as_drawn(scene.materials[index].clone());
    }
    materials
}

/// Returns the part of a light that a plan depends on.
fn structure(light: &Light, shadows: &ShadowSettings) -> impl PartialEq {
    let form = light.kind.form();
    let falloff = form.falloff.map(|falloff| (falloff.index(), weakens(falloff)));
    let projection = MapProjection::of(light, shadows.cascades);
    // A light that goes dark adds nothing, and may shine again.
    (form.number, projection, form.traits(), falloff, light.casts_shadow)
}

impl SortableTriangle {
    /// All triangles of a mesh, with their centroids transformed.
    pub(super) fn all(mesh: &Mesh, transform: &DAffine3) -> Vec<Self> {
        let corner = |index: u32| Vec3::from(mesh.positions[index as usize]);
        let place = |centroid: Vec3| transform.transform_point3(centroid.as_dvec3()).as_vec3();
        let triangle =
            |indices: [u32; 3]| Self { indices, centroid: place(indices.map(corner).iter().sum::<Vec3>() / 3.0) };
        mesh.indices.chunks_exact(3).map(|indices| triangle([indices[0], indices[1], indices[2]])).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::samples;
    use crate::scene::{AlphaMode, Brdf, Falloff, Keep, Tonemap};

    #[test]
    fn what_its_alpha_cuts_away_and_what_has_no_triangles_is_not_drawn() {
        let cut = Material { alpha: 0.4, alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..Material::default() };
        let kept = Material { alpha: 0.5, ..cut.clone() };
        let mut scene = samples::scene(vec![cut, kept, Material::default()], vec![]);
        scene.meshes.push(Mesh::default());
        scene.objects[2].mesh = 1;
        let settings = Settings::default();
        let plan = samples::plan(&scene, &settings);
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
        let plan = samples::plan(&scene, &settings);
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
        let refused = |error: Result<bool, PlanError>| error.expect_err("refused").to_string();
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

    #[test]
    fn a_world_that_is_exposed_anew_has_the_reaches_of_that_exposure() {
        let lamp = Light { intensity: 10.0, ..samples::spot(Falloff::InverseSquare) };
        let scene = samples::scene(vec![samples::material(Brdf::Lambert)], vec![lamp; 4]);
        let settings = Settings { light_cutoff: true, tonemap: Tonemap::None, ..Settings::default() };
        let plan = samples::plan(&scene, &settings);
        let world = |exposure: f32| World::of(&scene, &settings, &plan, exposure);
        let (mut brighter, darker) = (world(2.0), world(0.25));
        let cut = LightCutoff::of(&scene, &settings, 2.0);
        assert_eq!(brighter.reaches, scene.lights.iter().map(|light| cut.reach(light)).collect::<Vec<_>>());
        assert!(brighter.reaches[0] > 2.0 * darker.reaches[0]);
        brighter.set_exposure(0.25);
        assert_eq!((brighter.exposure, brighter.reaches), (0.25, darker.reaches));
    }
}
