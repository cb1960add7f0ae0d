//! The records of a frame's data in shaders' form: the camera, lights, volumes of lights.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Mat4, Vec2, Vec3, Vec4};

use super::air::AirRecord;
use crate::plan::{FramePlan, Grid, ShadowPlan};
use crate::scene::{Camera, Light};
use crate::visible::{DepthMapping, Eye, Visible, VolumeRecord, World, clip_from_world};

/// `Frame` of `shaders/shared/frame.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct FrameUniform {
    pub clip_from_world: Mat4,
    pub ray_center: Vec3,
    pub near: f32,
    pub ray_x: Vec3,
    pub exposure: f32,
    pub ray_y: Vec3,
    pub pixel_width: f32,
    pub ambient: Vec3,
    pub pixel_height: f32,
    pub ambient_tilt: Vec3,
    pub shadow_normal_offset: f32,
    pub shadow_size: f32,
    pub directional_count: u32,
    pub light_count: u32,
    pub looped_count: u32,
    pub forward: Vec3,
    pub global_count: u32,
    pub cluster_columns: u32,
    pub cluster_rows: u32,
    pub shadow_layers: u32,
    pub shadow_view_count: u32,
    pub camera_in_scene: Vec3,
    pub scene_radius: f32,
    pub depth_range: f32,
    pub eye_ahead: f32,
    pub sky_turn: Vec2,
    pub sun_direction: Vec3,
    pub sky_scale: f32,
    pub sun_radiance: Vec3,
    pub sun_sine: f32,
    pub jitter: [f32; 2],
    pub _padding: [f32; 2],
    pub air: AirRecord,
}

/// `Light` of `shaders/shared/lights.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct LightRecord {
    pub position: Vec3,
    pub inverse_range_squared: f32,
    pub color: Vec3,
    pub falloff: u32,
    pub direction: Vec3,
    pub edge_scale: f32,
    pub polynomial: Vec3,
    pub edge_offset: f32,
}

impl FrameUniform {
    /// `jitter`: where in each pixel the scene is seen, in pixels to the right and down from its centre.
    pub fn of(world: &World, visible: &Visible, eye: &Eye, plan: &FramePlan, jitter: [f64; 2]) -> Self {
        let camera = &eye.camera;
        let [width, height] = plan.size.map(f64::from);
        let half_y = camera.half_height();
        let half_x = half_y * width / height;
        let (right, up, forward) = (camera.right(), camera.up(), camera.forward());
        let grid = Grid::of(plan.size);
        // Both the projection and the view rays get this offset, so that projected positions agree with positions rebuilt from depth.
        let (offset_x, offset_y) =
            (jitter[0] * 2.0 / width + camera.shift.x / half_x, jitter[1] * 2.0 / height - camera.shift.y / half_y);
        let (ambient, ambient_tilt) = world.environment.hemispheres();
        let shadow = plan.shadow.as_ref();
        let aside = right * (half_x * offset_x) - up * (half_y * offset_y);
        let sky = world.sky.unwrap_or_default();
        let (near, depth_range) = match visible.depth {
            DepthMapping::Reciprocal { near } => (near, 0.0),
            DepthMapping::Linear { begin, end } => (begin, end - begin),
        };
        Self {
            clip_from_world: clip_from_world(camera, &visible.depth, [half_x, half_y], [offset_x, offset_y]).as_mat4(),
            ray_center: if camera.is_orthographic() { aside } else { forward + aside }.as_vec3(),
            near: near as f32,
            ray_x: (right * half_x).as_vec3(),
            exposure: world.exposure,
            // Rows of a picture go down.
            ray_y: (-up * half_y).as_vec3(),
            pixel_width: (2.0 / width) as f32,
            ambient,
            pixel_height: (2.0 / height) as f32,
            ambient_tilt,
            shadow_normal_offset: world.shadows.normal_offset * shadow.map_or(0.0, ShadowPlan::bias_scale),
            shadow_size: shadow.map_or(0, |shadow| shadow.size) as f32,
            directional_count: visible.active_lights.directional as u32,
            light_count: visible.active_lights.lights.len() as u32,
            forward: forward.as_vec3(),
            looped_count: visible.active_lights.looped as u32,
            global_count: visible.active_lights.global as u32,
            cluster_columns: grid.columns,
            cluster_rows: grid.rows,
            shadow_layers: shadow.map_or(0, |shadow| shadow.layers),
            shadow_view_count: shadow.map_or(0, |shadow| shadow.tiles.len() as u32),
            camera_in_scene: (camera.position - world.bounds.center()).as_vec3(),
            scene_radius: (world.bounds.radius() as f32).max(f32::MIN_POSITIVE),
            depth_range: depth_range as f32,
            eye_ahead: eye.ahead as f32,
            sky_turn: sky.turn,
            sun_direction: sky.sun_direction,
            sky_scale: sky.scale,
            sun_radiance: sky.sun_radiance,
            sun_sine: sky.sun_sine,
            jitter: jitter.map(|offset| offset as f32),
            _padding: [0.0; 2],
            air: AirRecord::of(world, plan, eye),
        }
    }
}

impl LightRecord {
    /// `shadow_code` is the plan's code of the light's maps.
    pub fn of(light: &Light, shadow_code: u32, camera: &Camera) -> Self {
        let form = light.kind.form();
        let direction = form.direction.unwrap_or(DVec3::ZERO);
        let [edge_scale, edge_offset] = form.edge().map(|value| value as f32);
        let inverse_square = |range: f64| (1.0 / (range * range)).min(f64::from(f32::MAX)) as f32;
        Self {
            position: form.place.map_or(-direction, |place| place - camera.position).as_vec3(),
            inverse_range_squared: form.range.map_or(0.0, inverse_square),
            // Infinity times a surface that reflects nothing would be no number.
            color: (light.color * light.intensity).min(Vec3::splat(f32::MAX)),
            falloff: shadow_code | form.formula(),
            direction: direction.as_vec3(),
            edge_scale,
            polynomial: form.falloff.map_or([0.0; 3], |falloff| falloff.terms()).into(),
            edge_offset,
        }
    }
}

/// `Volume` of `shaders/per_light.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct VolumeData {
    pub rows: [Vec4; 3],
    pub light: u32,
    _padding: [u32; 3],
}

impl From<&VolumeRecord> for VolumeData {
    fn from(&VolumeRecord { rows, light }: &VolumeRecord) -> Self {
        Self { rows, light, _padding: [0; 3] }
    }
}

const _: () = {
    use crate::shaders::lighting::structs::{frame as wgsl, light};
    use std::mem::offset_of;
    assert!(size_of::<FrameUniform>() == wgsl::SIZE);
    assert!(offset_of!(FrameUniform, clip_from_world) == wgsl::CLIP_FROM_WORLD);
    assert!(offset_of!(FrameUniform, ray_center) == wgsl::RAY_CENTER);
    assert!(offset_of!(FrameUniform, near) == wgsl::NEAR);
    assert!(offset_of!(FrameUniform, ray_x) == wgsl::RAY_X);
    assert!(offset_of!(FrameUniform, exposure) == wgsl::EXPOSURE);
    assert!(offset_of!(FrameUniform, ray_y) == wgsl::RAY_Y);
    assert!(offset_of!(FrameUniform, pixel_width) == wgsl::PIXEL_WIDTH);
    assert!(offset_of!(FrameUniform, ambient) == wgsl::AMBIENT);
    assert!(offset_of!(FrameUniform, pixel_height) == wgsl::PIXEL_HEIGHT);
    assert!(offset_of!(FrameUniform, ambient_tilt) == wgsl::AMBIENT_TILT);
    assert!(offset_of!(FrameUniform, shadow_normal_offset) == wgsl::SHADOW_NORMAL_OFFSET);
    assert!(offset_of!(FrameUniform, shadow_size) == wgsl::SHADOW_SIZE);
    assert!(offset_of!(FrameUniform, directional_count) == wgsl::DIRECTIONAL_COUNT);
    assert!(offset_of!(FrameUniform, light_count) == wgsl::LIGHT_COUNT);
    assert!(offset_of!(FrameUniform, forward) == wgsl::FORWARD);
    assert!(offset_of!(FrameUniform, looped_count) == wgsl::LOOPED_COUNT);
    assert!(offset_of!(FrameUniform, global_count) == wgsl::GLOBAL_COUNT);
    assert!(offset_of!(FrameUniform, cluster_columns) == wgsl::CLUSTER_COLUMNS);
    assert!(offset_of!(FrameUniform, cluster_rows) == wgsl::CLUSTER_ROWS);
    assert!(offset_of!(FrameUniform, eye_ahead) == wgsl::EYE_AHEAD);
    assert!(offset_of!(FrameUniform, depth_range) == wgsl::DEPTH_RANGE);
    assert!(offset_of!(FrameUniform, sky_turn) == wgsl::SKY_TURN);
    assert!(offset_of!(FrameUniform, sun_direction) == wgsl::SUN_DIRECTION);
    assert!(offset_of!(FrameUniform, sky_scale) == wgsl::SKY_SCALE);
    assert!(offset_of!(FrameUniform, sun_radiance) == wgsl::SUN_RADIANCE);
    assert!(offset_of!(FrameUniform, sun_sine) == wgsl::SUN_SINE);
    assert!(offset_of!(FrameUniform, jitter) == wgsl::JITTER && offset_of!(FrameUniform, air) == wgsl::AIR);
    assert!(offset_of!(FrameUniform, camera_in_scene) == wgsl::CAMERA_IN_SCENE);
    assert!(offset_of!(FrameUniform, scene_radius) == wgsl::SCENE_RADIUS);
    assert!(size_of::<VolumeData>() == crate::shaders::per_light::structs::volume::SIZE);
    assert!(offset_of!(VolumeData, rows) == crate::shaders::per_light::structs::volume::ROW_X);
    assert!(offset_of!(VolumeData, light) == crate::shaders::per_light::structs::volume::LIGHT);
    assert!(offset_of!(FrameUniform, shadow_layers) == wgsl::SHADOW_LAYERS);
    assert!(offset_of!(FrameUniform, shadow_view_count) == wgsl::SHADOW_VIEW_COUNT);
    assert!(size_of::<LightRecord>() == light::SIZE);
    assert!(offset_of!(LightRecord, position) == light::POSITION);
    assert!(offset_of!(LightRecord, inverse_range_squared) == light::INVERSE_RANGE_SQUARED);
    assert!(offset_of!(LightRecord, color) == light::COLOR);
    assert!(offset_of!(LightRecord, falloff) == light::FALLOFF);
    assert!(offset_of!(LightRecord, direction) == light::DIRECTION);
    assert!(offset_of!(LightRecord, edge_scale) == light::EDGE_SCALE);
    assert!(offset_of!(LightRecord, polynomial) == light::POLYNOMIAL);
    assert!(offset_of!(LightRecord, edge_offset) == light::EDGE_OFFSET);
};

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::plan::samples::{self, vector};
    use crate::scene::{Falloff, LightKind, Material, Projection, Settings};

    /// The uniform of a scene with an object at `place`, relative to the camera.
    fn uniform_of(camera: &Camera, size: [u32; 2], jitter: [f64; 2], place: DVec3) -> FrameUniform {
        let mut scene = samples::scene(vec![Material::default()], vec![samples::sky()]);
        scene.objects[0].transform.translation = camera.position + place;
        scene.camera = *camera;
        let settings = Settings { size, ..Settings::default() };
        let plan = FramePlan::of(&scene, &settings, &samples::device()).expect("a plan");
        let world = World::of(&scene, &settings, &plan, 1.0);
        FrameUniform::of(
            &world,
            &Visible::of(&world, camera, &plan),
            &Eye { camera: *camera, ahead: 0.0 },
            &plan,
            jitter,
        )
    }

    proptest! {
        /// `position_at` of `shaders/shared/frame.wgsl`, in f32 as on the device.
        #[test]
        fn a_point_that_is_projected_and_rebuilt_from_its_depth_is_the_point(
            position in vector(1e6), toward in vector(1.0), fov in 10.0..150.0f64, parallel in any::<bool>(), near in 0.001..1.0f64,
            x in -0.99..0.99f64, y in -0.99..0.99f64, log_distance in 0.1..15.0f64,
            width in 1..4000u32, height in 1..4000u32, jitter in [-0.5..=0.5f64, -0.5..=0.5],
        ) {
            prop_assume!(toward.length() > 0.1);
            let projection = if parallel { Projection::orthographic(fov * 0.1) } else { Projection::perspective(fov) };
            let looking = Camera::looking_at(position, position + toward, DVec3::Y);
            let camera = Camera { projection, near, ..looking };
            // A point in view at some distance along the axis, relative to the camera.
            let half_y = camera.half_height();
            let half_x = half_y * f64::from(width) / f64::from(height);
            let distance = near * log_distance.exp2();
            let aside = camera.right() * half_x * x + camera.up() * half_y * y;
            let point = camera.forward() * distance + aside * camera.w(distance);
            let frame = uniform_of(&camera, [width, height], jitter, point);
            let clip = frame.clip_from_world * point.as_vec3().extend(1.0);
            let depth = clip.z / clip.w;
            // Rounding grows with the angle to the axis, and with how small an angle fills the picture.
            let narrow = 1.0 / f64::from(width.min(height));
            let [tan_x, tan_y] = [half_x, half_y].map(|half| if parallel { half / distance } else { half });
            let steep = (1.0 + narrow) * (1.0 + tan_x + tan_y + 1.0 / tan_x + 1.0 / tan_y);
            let (clip_x, clip_y) = (clip.x / clip.w, clip.y / clip.w);
            // X to the right; Vulkan's Y goes down.
            // A frame that looks to the right of the pixels' centres shows everything further left.
            let moved = [jitter[0] * 2.0 / f64::from(width), jitter[1] * 2.0 / f64::from(height)];
            prop_assert!((f64::from(clip_x) + moved[0] - x).abs() < 1e-6 * steep, "{clip_x} {x}");
            prop_assert!((f64::from(clip_y) + moved[1] + y).abs() < 1e-6 * steep, "{clip_y} {y}");
            let pixel_x = (clip_x + 1.0) / frame.pixel_width;
            let pixel_y = (clip_y + 1.0) / frame.pixel_height;
            let (ray_x, ray_y) = (pixel_x * frame.pixel_width - 1.0, pixel_y * frame.pixel_height - 1.0);
            let across = frame.ray_center + frame.ray_x * ray_x + frame.ray_y * ray_y;
            let rebuilt = match parallel {
                true => across + frame.forward * (frame.near + (1.0 - depth) * frame.depth_range),
                false => across * (frame.near / depth),
            };
            let error = (rebuilt.as_dvec3() - point).length() / point.length();
            prop_assert!(error < 2e-6 * steep, "{point} {rebuilt} {error}");
            prop_assert!(depth > 0.0 && depth <= 1.0, "{depth}");
            if !parallel {
                prop_assert!((f64::from(depth) * distance / near - 1.0).abs() < 1e-6 * steep, "{depth}");
            }
        }

        #[test]
        fn what_lies_behind_the_camera_has_no_positive_w(toward in vector(1.0), behind in 0.1..1e6f64) {
            prop_assume!(toward.length() > 0.1);
            let camera = Camera::looking_at(DVec3::ZERO, toward, DVec3::Y);
            let clip = uniform_of(&camera, [64, 48], [0.0; 2], DVec3::ZERO).clip_from_world * (camera.forward() * -behind).as_vec3().extend(1.0);
            prop_assert!(clip.w < 0.0);
        }

        #[test]
        fn a_spot_is_whole_at_its_inner_angle_and_gone_at_its_outer_one(inner in 0.0..170.0f64, wider in 3.0..60.0f64) {
            let outer = (inner + wider).min(180.0);
            let record = LightRecord::of(&spot(inner, outer), 0, &Camera::default());
            let cone = |degrees: f64| f64::from(record.edge_scale) * degrees.to_radians().cos() + f64::from(record.edge_offset);
            // The guard of KHR_lights_punctual takes over where the cosines lie within 0.001 of each other.
            prop_assume!(inner.to_radians().cos() - outer.to_radians().cos() > 0.001);
            let rounding = 1e-6 * f64::from(record.edge_scale);
            prop_assert!((cone(inner) - 1.0).abs() < rounding && cone(outer).abs() < rounding);
            prop_assert!(cone((inner + outer) * 0.5) > 0.0 && cone((inner + outer) * 0.5) < 1.0);
        }
    }

    fn spot(inner_angle_degrees: f64, outer_angle_degrees: f64) -> Light {
        let kind = LightKind::Spot {
            position: DVec3::new(1.0, 2.0, 3.0),
            direction: DVec3::NEG_Y,
            inner_angle_degrees,
            outer_angle_degrees,
            range: Some(4.0),
            falloff: Falloff::Polynomial { constant: 1.0, linear: 2.0, quadratic: 3.0 },
        };
        Light { kind, color: Vec3::new(1.0, 0.5, 0.25), intensity: 8.0, ..samples::spot(Falloff::InverseSquare) }
    }

    #[test]
    fn a_cone_without_a_soft_edge_is_finite() {
        for angle in [0.0, 30.0, 180.0] {
            let record = LightRecord::of(&spot(angle, angle), 0, &Camera::default());
            assert!(record.edge_scale.is_finite() && record.edge_offset.is_finite());
            let at = |degrees: f32| degrees.to_radians().cos() * record.edge_scale + record.edge_offset;
            assert!(at(angle as f32).abs() < 1e-3 && (angle < 10.0 || at(angle as f32 - 5.0) >= 1.0), "{angle}");
        }
    }

    #[test]
    fn a_record_holds_its_light_relative_to_the_camera() {
        let camera = Camera { position: DVec3::new(1.0, 1.0, 1.0), ..Camera::default() };
        let record = LightRecord::of(&spot(10.0, 20.0), 0, &camera);
        assert_eq!(record.position, Vec3::new(0.0, 1.0, 2.0));
        assert_eq!((record.direction, record.color), (Vec3::NEG_Y, Vec3::new(8.0, 4.0, 2.0)));
        assert_eq!((record.inverse_range_squared, record.falloff), (1.0 / 16.0, 2));
        assert_eq!(record.polynomial, Vec3::new(1.0, 2.0, 3.0));
        // Far from zero the difference is taken before it is rounded.
        let far = DVec3::splat(1e9);
        let kind = LightKind::Point { position: far + DVec3::X * 0.25, range: None, falloff: Falloff::InverseSquare };
        let lamp = LightRecord::of(&Light { kind, ..spot(0.0, 1.0) }, 0, &Camera { position: far, ..camera });
        assert_eq!((lamp.position, lamp.inverse_range_squared), (Vec3::X * 0.25, 0.0));
        // No cone: saturate(0 x + 1) is 1 everywhere.
        assert_eq!((lamp.edge_scale, lamp.edge_offset), (0.0, 1.0));
        let sun = LightRecord::of(&samples::sun(), 0, &camera);
        assert!((sun.position + Vec3::new(0.3, -1.0, -0.5).normalize()).length() < 1e-6, "towards the light");
    }
}
