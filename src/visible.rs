//! The part of a scene that one camera sees, found anew for each frame: culled, sorted, and the shadow maps fitted to it. It follows from a
//! [`FramePlan`], which is decided once, and changes nothing of it: no pipeline, no target, no buffer.

pub(crate) mod active_lights;
mod air;
mod bodies;
pub(crate) mod clusters;
#[cfg(test)]
mod corrupted;
pub(crate) mod depth;
mod emitters;
mod frustum;
mod instances;
mod levels;
mod looks;
mod occlusion;
mod pose;
mod previous;
mod projection;
mod shadows;
mod volumes;
mod world;

use std::sync::Arc;

pub use active_lights::ActiveLights;
pub use clusters::Clusters;
pub use depth::{DepthMapping, Eye};
pub use emitters::{EmitterRecord, Emitters};
pub use instances::{CullView, Draw, InstanceList, InstanceTransform, STEPS};
pub use levels::{LevelChoice, squared_error};
pub use looks::PackedLook;
pub use previous::Reprojection;
pub use projection::{FrameProjection, clip_from_world};
pub use shadows::{Caster, MapDraw, Receivers, ShadowCache, ShadowView};
pub use volumes::{LightRect, VolumeRecord, cone_mesh, sphere_mesh};
pub use world::{World, WorldObject};

use active_lights::Misplacement;
use frustum::Frustum;
use shadows::add_cascades;
use volumes::Volumes;
use world::SortableTriangle;

use crate::plan::effect::LitAir;
use crate::plan::{FramePlan, GeometryKey, Opacity, Reach, Shading, ShadowPlan, effects};
use crate::scene::{Aabb, Camera, LightPath, OptionalPart};

/// The light path's work beyond the loop over lights that reach every pixel.
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

/// A transparent object to be drawn, and the place of its triangles, sorted back to front.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SortedDraw {
    /// The draw of one instance.
    pub draw: Draw,
    /// The first index in [`Visible::sorted_indices`]; `None` if the order does not matter.
    pub first_index: Option<u32>,
}

/// The lists of one frame.
#[derive(Debug, Clone)]
pub struct Visible {
    /// Indices into [`World::objects`] of everything that is drawn: the instances of `draws`, of `shaded`, of `occluders`, and of `transparent`.
    pub instances: Vec<u32>,
    /// CULL's input if the device culls opaque objects; `draws` then has no opaque objects.
    pub culling: Option<CullView>,
    /// The choice of levels of detail; `None` if no mesh has levels.
    pub levels: Option<LevelChoice>,
    /// Draws from near to far by the far ends of boxes, so that early depth tests save the most: hidden fragments cost more than state changes
    /// (Sponza's GEOMETRY takes a fifth less CPU time on lavapipe than sorted by material). Equally near draws are sorted by pipeline and material.
    pub draws: Vec<Draw>,
    /// The draws that shade after a depth pre-pass: `draws` from far to near. Of coplanar surfaces the last drawn wins after a pre-pass, and the
    /// first without one.
    pub shaded: Vec<Draw>,
    /// Opaque objects whose depth the device draws first if it does occlusion culling.
    pub occluders: Vec<Draw>,
    /// Transparent objects, the farthest first.
    pub transparent: Vec<SortedDraw>,
    /// Indices of the transparent objects' triangles, the farthest of each object first.
    pub sorted_indices: Vec<u32>,
    /// The plan's shadow maps; `None` for maps that no visible surface samples.
    pub shadows: Vec<Option<Arc<ShadowView>>>,
    /// The visible receivers, if casters that shadow none of them are left out.
    receivers: Option<Receivers>,
    /// The lights of limited reach by froxel, if the plan has light lists.
    pub clusters: Option<Clusters>,
    pub lights: LightWork,
    /// The lights that reach something visible.
    pub active_lights: ActiveLights,
    /// The scene's emitters at this moment, if the plan draws particles.
    pub emitters: Emitters,
    /// Objects beside or behind the view.
    pub culled: usize,
    /// Objects in view that others hide.
    pub occluded: usize,
    /// The mapping from distances to depths.
    pub depth: DepthMapping,
}

impl Visible {
    /// The lists for an [`Eye`]'s camera.
    pub fn of(world: &World, camera: &Camera, plan: &FramePlan) -> Self {
        let aspect = f64::from(plan.size[0]) / f64::from(plan.size[1]);
        let frustum = Frustum::of(camera, aspect);
        let depth = DepthMapping::of(world, plan, camera);
        let beside = Misplacement::of(plan, camera, &depth);
        let list = &world.instances;
        let culling = plan.culls_on_device.then(|| list.cull_view(&frustum, camera, world));
        let mut seen = match plan.keep.has(OptionalPart::OffscreenObjects) {
            true => vec![true; world.objects.len()],
            // Only the device knows which opaque objects are in view, so the CPU counts all of them as seen.
            false if culling.is_some() => list.transparent_in_view(world, &frustum),
            false => list.in_view(&frustum),
        };
        let in_view = seen.iter().filter(|&&seen| seen).count();
        if let Some(occluders) = &world.occluders {
            let places = (0..seen.len()).filter(|&place| seen[place]).map(|place| list.object(place));
            let picture = occlusion::OcclusionBuffer::of(world, occluders, (camera, &depth), plan.size, places);
            if picture.hides_something() {
                for (place, seen) in seen.iter_mut().enumerate().filter(|(_, seen)| **seen) {
                    *seen = !picture.hides(&world.objects[list.object(place)].bounds);
                }
            }
        }
        let (mut instances, draws) = match culling {
            Some(_) => Default::default(),
            None => list.near_to_far(world, camera, &seen),
        };
        let levels = LevelChoice::of(world, camera, plan);
        let split = |draws: Vec<Draw>, instances: &mut Vec<u32>| match &levels {
            Some(levels) => levels::split(levels, world, instances, &draws),
            None => draws,
        };
        let draws = split(draws, &mut instances);
        let transparent = list.transparent(&seen);
        let drawn = instances.len() + transparent.len();
        let may_be_seen = |place: usize| seen[place] || culling.is_some();
        let active = ActiveLights::of(world, plan, (camera, &frustum), &beside, &may_be_seen);
        let objects = || instances.iter().chain(&transparent).map(|&index| &world.objects[index as usize]);
        let mut shadows = world.lamps.clone();
        let in_air = effects::lit_air(plan) == LitAir::Shadowed;
        let leaves_casters = culling.is_none()
            && !in_air
            && plan.may_leave_out(OptionalPart::IdleCasters)
            && plan.shading != Shading::ShowShadowMap;
        let receivers = plan.shadow.as_ref().filter(|_| leaves_casters).map(|shadow| {
            let receiving = objects().filter(|object| object.key.receives);
            let boxes = receiving.map(|object| object.bounds).chain(world.emitter_boxes(plan));
            Receivers::of(boxes, (camera, &frustum), &beside, shadow, &world.shadows)
        });
        if let Some(shadow) = &plan.shadow {
            let mut boxes: Vec<Aabb> = match culling {
                Some(_) => vec![world.bounds],
                None => objects().map(|object| object.bounds).collect(),
            };
            // Particles receive shadows, too.
            boxes.extend(world.emitter_boxes(plan));
            boxes.extend(in_air.then(|| world.air_around(camera)));
            add_cascades(&mut shadows, world, shadow, camera, aspect, &boxes);
            let looked_up = |view: &Arc<ShadowView>| receivers.as_ref().is_none_or(|seen| seen.look_into(view));
            for view in &mut shadows[shadow.sky_views()] {
                *view = view.take().filter(looked_up);
            }
            for light in &shadow.lights {
                let is_lit = active.lights.binary_search(&light.light).is_ok();
                for view in &mut shadows[light.first_view..light.first_view + light.projection.views()] {
                    *view = view.take().filter(|view| is_lit && looked_up(view));
                }
            }
        }
        let shaded = match plan.depth_prepass {
            true => instances::reversed(&mut instances, &draws),
            false => Vec::new(),
        };
        let occluders = match plan.hides_on_device {
            true => list.draws_at(&occlusion::largest(world, (camera, &frustum, &depth), plan.size), &mut instances),
            false => Vec::new(),
        };
        let occluders = split(occluders, &mut instances);
        let first = instances.len() as u32;
        if !world.is_halted() {
            instances.extend(far_to_near(world, camera, &transparent));
        }
        let (transparent, sorted_indices) = back_to_front(world, camera, first, &instances[first as usize..]);
        Self {
            culled: if culling.is_some() { 0 } else { world.objects.len() - in_view },
            occluded: in_view - drawn,
            instances,
            culling,
            levels,
            draws,
            shaded,
            occluders,
            transparent,
            sorted_indices,
            shadows,
            receivers,
            clusters: plan.has_clusters().then(|| {
                clusters::bin(&active.spheres(world, active.global), active.global as u32, (camera, &depth), plan.size)
            }),
            lights: light_work(world, camera, plan, &active),
            active_lights: active,
            emitters: Emitters::of(world, camera, plan),
            depth,
        }
    }

    /// The casters of a map that shadow something visible.
    pub fn needed(&self, world: &World, plan: &ShadowPlan, view: &ShadowView) -> Vec<Caster> {
        match &self.receivers {
            Some(receivers) => receivers.needed(world, plan, view),
            None => view.casters.clone(),
        }
    }

    /// The number of opaque objects that are drawn, without objects that the device culls by itself.
    pub fn opaque_count(&self) -> usize {
        self.draws.iter().map(|draw| draw.count as usize).sum()
    }

    pub fn triangles(&self, world: &World) -> usize {
        let drawn = self.draws.iter().chain(self.transparent.iter().map(|own| &own.draw));
        drawn.map(|draw| world.triangles_of(draw)).sum()
    }
}

/// Transparent objects from far to near, and equally far ones by pipeline and material. Coats follow the surfaces that they lie on.
fn far_to_near(world: &World, camera: &Camera, seen: &[u32]) -> impl Iterator<Item = u32> {
    let placed = |&index: &u32| (camera.order(world.objects[index as usize].bounds.center()), index);
    let mut order: Vec<(f64, u32)> = seen.iter().map(placed).collect();
    let is_coat = |key: GeometryKey| key.forward.is_some_and(|forward| forward.opacity == Opacity::Coat);
    let state = |index: u32| {
        let object = &world.objects[index as usize];
        (!is_coat(object.key), object.key, object.material, index)
    };
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| state(a.1).cmp(&state(b.1))));
    order.into_iter().rev().map(|(_, index)| index)
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
        LightPath::Compute | LightPath::Visibility => {
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
/// they lie in the mesh. `first` is the number of the first instance.
fn back_to_front(world: &World, camera: &Camera, first: u32, instances: &[u32]) -> (Vec<SortedDraw>, Vec<u32>) {
    let mut indices = Vec::new();
    let draws = (first..).zip(instances).map(|(first, &index)| {
        let object = &world.objects[index as usize];
        let draw = Draw { object: index as usize, level: 0, first, count: 1 };
        let triangles = match object.deform {
            Some(deform) => world.deformed_triangles.get(&deform),
            None => world.sortable.get(&object.mesh),
        };
        let Some(triangles) = triangles else {
            return SortedDraw { draw, first_index: None };
        };
        // ANCHOR: sort-triangles
        // In f64: far from the origin, f32 would round near distances until their order is lost.
        let distance =
            |triangle: &SortableTriangle| camera.order(object.transform.transform_point3(triangle.centroid.as_dvec3()));
        let mut order: Vec<(f64, usize)> =
            triangles.iter().enumerate().map(|(place, triangle)| (distance(triangle), place)).collect();
        order.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        // ANCHOR_END: sort-triangles
        let first_index = indices.len() as u32;
        indices.extend(order.into_iter().flat_map(|(_, place)| triangles[place].indices));
        SortedDraw { draw, first_index: Some(first_index) }
    });
    (draws.collect(), indices)
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DVec3};

    use super::*;
    use crate::plan::samples;
    use crate::scene::{Material, Settings};

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
        let plan = samples::plan(&scene, &settings);
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
    fn what_reaches_far_is_drawn_after_what_stands_before_its_far_end() {
        // A deep box whose middle is nearer than a flat one's, and a flat one behind both.
        let mut scene = samples::scene(vec![Material::default(); 3], vec![]);
        scene.meshes[0].bounds = Aabb { min: DVec3::ZERO, max: DVec3::ONE };
        for (object, (depth, begin)) in scene.objects.iter_mut().zip([(20.0, 2.0), (1.0, 15.0), (1.0, 30.0)]) {
            let (size, place) = (DVec3::new(1.0, 1.0, depth), DVec3::Z * -(begin + depth));
            object.transform = DAffine3::from_scale_rotation_translation(size, glam::DQuat::IDENTITY, place);
        }
        let settings = Settings::default();
        let plan = samples::plan(&scene, &settings);
        let world = World::of(&scene, &settings, &plan, 1.0);
        let visible = Visible::of(&world, &Camera::default(), &plan);
        assert_eq!(visible.instances[..3], [1, 0, 2]);
    }
}
