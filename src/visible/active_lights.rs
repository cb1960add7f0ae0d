//! A frame's lights: the plan's lights that can reach something visible.

use ash::vk;

use super::frustum::Frustum;
use super::{DepthMapping, World};
use crate::plan::effect::LitAir;
use crate::plan::{FramePlan, Reach, Shading, effects, range_of, shows_all, sphere_of};
use crate::scene::{Camera, LightPath, OptionalPart};

/// The largest offset at which a surface is lit, as a share of its distance from the camera: f32 and the interpolation of depth over large triangles
/// round.
const ROUNDING: f64 = 1e-4;
/// The largest offset with linear depth, as a share of the distance at which the depth range ends.
const LINEAR_ROUNDING: f64 = 1e-5;
/// The largest offset with positions in half floats, which have 11 bits, as a share of the distance.
const HALF_ROUNDING: f64 = 2e-3;

/// The greatest distance between a surface and the place at which it is lit.
#[derive(Debug, Clone, Copy)]
pub(super) struct Misplacement {
    /// A share of the surface's distance from the camera.
    share: f64,
    metres: f64,
}

impl Misplacement {
    pub(super) fn of(plan: &FramePlan, camera: &Camera, depth: &DepthMapping) -> Self {
        let half = plan.gbuffer.is_some_and(|gbuffer| gbuffer.position == Some(vk::Format::R16G16B16A16_SFLOAT));
        let rounding = if half { HALF_ROUNDING } else { ROUNDING };
        // A pixel, where samples of several are shaded once, in its middle.
        let pixel = if plan.msaa > 1 { 2.0 * camera.half_height() / f64::from(plan.size[1]) } else { 0.0 };
        match *depth {
            DepthMapping::Reciprocal { .. } => Self { share: pixel + rounding, metres: 0.0 },
            // A linear depth is equally coarse everywhere.
            DepthMapping::Linear { end, .. } => Self { share: rounding, metres: pixel + LINEAR_ROUNDING * end },
        }
    }

    /// The offset in metres at a distance from the camera.
    pub(super) fn at(&self, distance: f64) -> f64 {
        self.share * distance + self.metres
    }
}

/// The lights of a frame, in the order of [`World::lights`]. Shaders number lights by their places in this list.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ActiveLights {
    /// Indices into [`World::lights`], ascending.
    pub lights: Vec<usize>,
    /// Directional lights; they come first.
    pub directional: usize,
    /// Lights that reach everywhere, at the start of the list; the directional ones are among them.
    pub global: usize,
    /// Lights at the start of the list that every pixel loops over; the light path has lists or separate draws for the others.
    pub looped: usize,
}

impl ActiveLights {
    /// The lights that reach the box of an instance that is `seen`, within the frustum; all lights if the plan does not search for idle ones.
    pub(super) fn of(
        world: &World,
        plan: &FramePlan,
        (camera, frustum): (&Camera, &Frustum),
        beside: &Misplacement,
        seen: &dyn Fn(usize) -> bool,
    ) -> Self {
        let shows_all = match plan.shading {
            Shading::ShowGbuffer(view) => shows_all(view),
            shading => shading == Shading::ShowShadowMap,
        };
        let lit_air = effects::lit_air(plan);
        let keeps = plan.keep.has(OptionalPart::IdleLights) || shows_all || lit_air >= LitAir::All;
        let lights: Vec<usize> = if !keeps && !(0..world.objects.len()).any(seen) {
            let in_air = if lit_air == LitAir::Directional { world.directional_count() } else { 0 };
            (0..world.lit_count().min(in_air)).collect()
        } else if keeps || !plan.may_leave_out(OptionalPart::IdleLights) {
            (0..world.lit_count()).collect()
        } else {
            let reaches = |index: &usize| {
                let light = &world.lights[*index];
                let Some(range) = range_of(light) else { return true };
                let reach = sphere_of(light, range);
                let slack = beside.at(reach.radius + reach.center.distance(camera.position));
                let reach = Reach { radius: reach.radius + slack, ..reach };
                frustum.may_reach(&reach) && world.instances.touches(seen, &reach)
            };
            (0..world.lit_count()).filter(reaches).collect()
        };
        let first = |count: usize| lights.partition_point(|&light| light < count);
        let (directional, global) = (first(world.directional_count()), first(world.global_count()));
        let looped = match plan.light_path {
            LightPath::PerLight => directional,
            LightPath::Volumes
            | LightPath::Clustered
            | LightPath::Forward
            | LightPath::Compute
            | LightPath::Visibility => global,
            LightPath::Auto | LightPath::Loop | LightPath::ForwardNaive => lights.len(),
        };
        Self { lights, directional, global, looped }
    }

    /// Spheres around the reach of the lights from place `first` on, with the light path's own limit.
    pub(super) fn spheres(&self, world: &World, first: usize) -> Vec<Reach> {
        self.lights[first..].iter().map(|&light| sphere_of(&world.lights[light], world.reaches[light])).collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DVec3};
    use proptest::prelude::*;

    use super::*;
    use crate::plan::samples::{self, lamp, vector};
    use crate::scene::{Falloff, Keep, Light, LightKind, Material, Projection, Scene, Settings};
    use crate::visible::{LightWork, Visible};

    fn planned(scene: &Scene, settings: &Settings) -> (World, FramePlan) {
        let plan = FramePlan::of(scene, settings, &samples::software()).expect("a plan");
        (World::of(scene, settings, &plan, 1.0), plan)
    }

    /// Squares in a row along X, of which the camera sees some.
    fn row(count: usize, lights: Vec<Light>) -> Scene {
        samples::scene(vec![Material::default(); count], lights)
    }

    proptest! {
        #[test]
        fn no_light_is_missing_that_reaches_a_point_in_view(
            lamps in proptest::collection::vec((vector(6.0), 0.1..3.0f64), 1..12), position in vector(8.0), target in vector(3.0),
            points in proptest::collection::vec((0..5usize, 0.0..=1.0f64, 0.0..=1.0f64), 64), angle in 1.0..170.0f64, to in vector(1.0),
        ) {
            prop_assume!(position.distance(target) > 0.01 && to.length() > 0.1);
            let spot = |(position, range): (DVec3, f64)| LightKind::Spot {
                position, direction: to.normalize(), inner_angle_degrees: 0.0, outer_angle_degrees: angle, range: Some(range),
                falloff: Falloff::Quadratic,
            };
            let spots = lamps.iter().map(|&at| Light { kind: spot(at), ..samples::spot(Falloff::Quadratic) });
            let beam = |(position, range): (DVec3, f64)| LightKind::Beam {
                position, direction: to.normalize(), radius: 0.01 * angle, edge: 0.0, range: Some(range),
            };
            let beams = lamps.iter().map(|&at| Light { kind: beam(at), ..samples::beam(None) });
            let points_around = lamps.iter().map(|&(at, range)| lamp(at, Some(range)));
            let lights: Vec<Light> = points_around.chain(spots).chain(beams).collect();
            let scene = row(5, lights.clone());
            let (world, plan) = planned(&scene, &Settings::default());
            let camera = Camera::looking_at(position, target, DVec3::Y);
            let visible = Visible::of(&world, &camera, &plan);
            prop_assert!(visible.active_lights.lights.is_sorted());
            let aspect = f64::from(plan.size[0]) / f64::from(plan.size[1]);
            for (square, x, y) in points {
                let point = DVec3::new(square as f64 + x, y, 0.0);
                let offset = point - camera.position;
                let (depth, tan_y) = (offset.dot(camera.forward()), camera.half_height());
                let seen = depth > camera.near
                    && offset.dot(camera.up()).abs() < depth * tan_y
                    && offset.dot(camera.right()).abs() < depth * tan_y * aspect;
                for light in lights.iter().filter(|_| seen) {
                    let reached = match light.kind {
                        LightKind::Point { position, range, .. } => position.distance(point) < range.unwrap_or(0.0),
                        LightKind::Spot { position, direction, range, .. } => {
                            let ray = point - position;
                            ray.length() < range.unwrap_or(0.0) && ray.angle_between(direction).to_degrees() < angle
                        }
                        LightKind::Beam { position, direction, radius, range, .. } => {
                            let (ray, along) = (point - position, (point - position).dot(direction));
                            (0.0..range.unwrap_or(0.0)).contains(&along) && ray.cross(direction).length() < radius
                        }
                        LightKind::Directional { .. } => false,
                    };
                    let listed = visible.active_lights.lights.iter().any(|&own| world.lights[own].kind == light.kind);
                    prop_assert!(!reached || listed, "{light:?} at {point}");
                }
            }
        }
    }

    #[test]
    fn lights_out_of_view_and_out_of_reach_are_in_no_list_and_the_others_keep_their_order() {
        // Three squares at x = 0 to 3; the camera sees the first two.
        let lights = vec![
            lamp(DVec3::new(0.5, 0.5, 0.5), Some(1.0)),
            lamp(DVec3::new(2.5, 0.5, 0.2), Some(0.3)),
            samples::sky(),
            lamp(DVec3::new(0.0, 0.0, 4.0), None),
            lamp(DVec3::new(1.2, 0.5, 1.0), Some(0.5)),
            lamp(DVec3::new(0.8, 0.5, 0.5), Some(0.9)),
        ];
        let camera = Camera {
            projection: Projection::perspective(20.0),
            ..Camera::looking_at(DVec3::new(0.8, 0.5, 4.0), DVec3::new(0.8, 0.5, 0.0), DVec3::Y)
        };
        let scene = row(3, lights);
        for &(name, light_path) in LightPath::NAMES {
            let settings = Settings { light_path, size: [64, 64], ..Settings::default() };
            let (world, plan) = planned(&scene, &settings);
            // The fifth hangs before all squares without reaching any.
            assert_eq!(world.lights.len(), 5, "{name}");
            let visible = Visible::of(&world, &camera, &plan);
            assert_eq!(
                (&visible.active_lights.lights[..], visible.active_lights.directional, visible.active_lights.global),
                (&[0, 1, 2, 4][..], 1, 2),
                "{name}"
            );
            let numbers: Vec<u32> = match &visible.lights {
                LightWork::Draws(rects) => rects.iter().map(|rect| rect.light).collect(),
                LightWork::Volumes(volumes) => volumes.records.iter().map(|record| record.light).collect(),
                LightWork::Spheres(spheres) => (2..).take(spheres.len()).collect(),
                LightWork::Nothing => (visible.active_lights.looped as u32..4).collect(),
            };
            assert_eq!(numbers, (visible.active_lights.looped as u32..4).collect::<Vec<_>>(), "{name}");
            if let Some(clusters) = &visible.clusters {
                assert!(clusters.lights.iter().all(|light| (2..4).contains(light)), "{name}");
            }
            let kept = Settings { keep: Keep::NONE.with(OptionalPart::IdleLights), ..settings };
            let (world, plan) = planned(&scene, &kept);
            let visible = Visible::of(&world, &camera, &plan);
            assert_eq!((world.lights.len(), visible.active_lights.lights.len()), (6, 6), "{name}");
            // Where nothing is seen, nothing is lit.
            let (world, plan) = planned(&scene, &settings);
            let away = Camera::looking_at(DVec3::Z * 4.0, DVec3::Z * 9.0, DVec3::Y);
            assert_eq!(Visible::of(&world, &away, &plan).active_lights, ActiveLights::default(), "{name}");
        }
    }

    #[test]
    fn a_light_that_reaches_no_object_is_not_planned_and_what_comes_into_its_reach_needs_another_plan() {
        let idle = Light { casts_shadow: true, ..lamp(DVec3::new(0.5, 0.5, 9.0), Some(2.0)) };
        let scene = row(2, vec![samples::sky(), idle.clone()]);
        let (mut world, plan) = planned(&scene, &Settings::default());
        assert!(plan.lights.directional && !plan.lights.punctual && plan.shadow.is_none());
        assert_eq!(world.lights.len(), 1);
        let said = plan.parts().iter().find(|part| part.name == "lights that reach nothing").expect("a part");
        assert!(!said.included && said.reason.starts_with("1 light"), "{said:?}");
        // Aside, but not into reach.
        let to = |z: f64| DAffine3::from_translation(DVec3::Z * z);
        assert!(world.move_object(0, &to(5.0)).expect("an object"), "out of reach");
        assert!(!world.move_object(0, &to(7.5)).expect("an object"), "into reach");
        assert_eq!(world.objects[0].bounds.min.z, 5.0, "it stays where it was");
        assert!(
            world.set_light(1, &lamp(DVec3::new(0.5, 0.5, 20.0), Some(2.0))).expect("a light"),
            "it reaches nothing"
        );
        assert!(world.move_object(0, &to(7.5)).expect("an object"), "the light is gone");
        for reaching in [lamp(DVec3::new(0.5, 0.5, 8.0), Some(2.0)), lamp(DVec3::ZERO, None), samples::sky()] {
            assert!(!world.set_light(1, &reaching).expect("a light"), "it would reach something");
        }
        let kept = Settings { keep: Keep::NONE.with(OptionalPart::IdleLights), ..Settings::default() };
        let (mut world, plan) = planned(&scene, &kept);
        assert!(plan.lights.punctual && plan.shadow.is_some());
        assert!(world.move_object(0, &to(7.5)).expect("an object"), "the light is planned");
        let near = Light { kind: lamp(DVec3::ZERO, Some(3.0)).kind, ..idle };
        assert!(world.set_light(1, &near).expect("a light"), "the light is planned");
    }
}
