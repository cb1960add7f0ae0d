//! Bounds of a light of limited reach, on the screen and in space: rectangles for `per-light`, spheres and cones for `volumes`.

use glam::{DMat3, DVec3, Vec4};

use super::clusters::{axis_pixel, screen_span};
use super::{ActiveLights, World};
use crate::plan::Reach;
use crate::scene::{Camera, Solid};

/// A light and the pixels that it can reach.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LightRect {
    pub light: u32,
    /// Upper left corner, width and height in pixels; inside the picture and not empty.
    pub offset: [u32; 2],
    pub extent: [u32; 2],
}

/// `Volume` of `shaders/per_light.wgsl`: rows of the map from a unit shape to the world around the camera, and the light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VolumeRecord {
    pub rows: [Vec4; 3],
    pub light: u32,
}

/// The volumes of one frame: spheres, then cones.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Volumes {
    pub records: Vec<VolumeRecord>,
    pub spheres: usize,
}

/// Share by which a volume is larger than its light, for the rounding of f32.
const SLACK: f64 = 1e-3;

/// The pixels that each light can reach; lights that reach none are left out.
pub(super) fn rectangles(reaches: &[Reach], first: u32, camera: &Camera, size: [u32; 2]) -> Vec<LightRect> {
    let axes = DMat3::from_cols(camera.right(), -camera.up(), camera.forward()).transpose();
    let scale = f64::from(size[1]) * 0.5 / camera.half_height();
    let middle = axis_pixel(camera, size, scale);
    let rectangle = |(light, reach): (u32, &Reach)| {
        let center = axes * (reach.center - camera.position);
        let radius = reach.radius * (1.0 + SLACK);
        if center.z + radius <= camera.near {
            return None;
        }
        let (near, far) = ((center.z - radius).max(camera.near), center.z + radius);
        let span = |axis: usize| {
            let edge = f64::from(size[axis]);
            let across = (center[axis] - radius, center[axis] + radius);
            let (low, high) = screen_span(across, (camera.w(near), camera.w(far)), scale, middle[axis]);
            let (from, to) = (low.floor().clamp(0.0, edge), high.ceil().clamp(0.0, edge));
            // An infinite reach has no finite span: all of it.
            let (from, to) = if radius.is_finite() { (from, to) } else { (0.0, edge) };
            (from < to).then_some((from as u32, (to - from) as u32))
        };
        let ((x, width), (y, height)) = (span(0)?, span(1)?);
        Some(LightRect { light, offset: [x, y], extent: [width, height] })
    };
    (first..).zip(reaches).filter_map(rectangle).collect()
}

impl Volumes {
    /// The volumes of the lights outside the loop, without volumes wholly behind the camera.
    pub(super) fn of(world: &World, active: &ActiveLights, camera: &Camera) -> Self {
        let mut volumes = Self::default();
        let mut cones = Vec::new();
        for (index, &own) in active.lights.iter().enumerate().skip(active.looped) {
            let (light, reach) = (&world.lights[own], world.reaches[own] * (1.0 + SLACK));
            let form = light.kind.form();
            let Some(place) = form.place.map(|place| place - camera.position) else { continue };
            if place.dot(camera.forward()) + form.extent(reach) < camera.near {
                continue;
            }
            let (solid, columns, zero) = form.volume(reach);
            let record = VolumeRecord { rows: rows(columns, place + zero), light: index as u32 };
            match solid {
                Solid::Sphere => volumes.records.push(record),
                Solid::Cone => cones.push(record),
            }
        }
        volumes.spheres = volumes.records.len();
        volumes.records.append(&mut cones);
        volumes
    }
}

fn rows(columns: DMat3, offset: DVec3) -> [Vec4; 3] {
    let rows = columns.transpose();
    [rows.x_axis.extend(offset.x), rows.y_axis.extend(offset.y), rows.z_axis.extend(offset.z)].map(|row| row.as_vec4())
}

/// Triangles around the unit sphere: an icosahedron, each face cut in four, pushed out until its faces touch the sphere. Counter-clockwise
/// from outside.
pub fn sphere_mesh() -> Vec<[f32; 3]> {
    let golden = (1.0 + 5f64.sqrt()) * 0.5;
    let corners: Vec<DVec3> = [(-1.0, 1.0), (1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
        .into_iter()
        .flat_map(|(a, b)| {
            let (short, long) = (a, golden * b);
            [DVec3::new(short, long, 0.0), DVec3::new(0.0, short, long), DVec3::new(long, 0.0, short)]
        })
        .collect();
    let edge = 2.0;
    let near = |a: DVec3, b: DVec3| (a.distance(b) - edge).abs() < 1e-9;
    let mut faces = Vec::new();
    for (i, &a) in corners.iter().enumerate() {
        for (j, &b) in corners.iter().enumerate().skip(i + 1) {
            for &c in corners.iter().skip(j + 1).filter(|&&c| near(a, b) && near(b, c) && near(a, c)) {
                // Outwards.
                faces.push(if (b - a).cross(c - a).dot(a) > 0.0 { [a, b, c] } else { [a, c, b] });
            }
        }
    }
    let halved = faces.into_iter().flat_map(|[a, b, c]| {
        let [a, b, c] = [a, b, c].map(DVec3::normalize);
        let (ab, bc, ca) = ((a + b).normalize(), (b + c).normalize(), (c + a).normalize());
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    });
    let faces: Vec<[DVec3; 3]> = halved.collect();
    let distance = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).normalize().dot(a);
    let inside = faces.iter().map(|&face| distance(face)).fold(f64::INFINITY, f64::min);
    faces.into_iter().flatten().map(|corner| (corner / inside).as_vec3().to_array()).collect()
}

/// Triangles around the unit cone: apex at zero, axis +Z, base at z = 1 with radius 1. Counter-clockwise from outside.
pub fn cone_mesh() -> Vec<[f32; 3]> {
    const SIDES: usize = 16;
    let step = std::f64::consts::TAU / SIDES as f64;
    // The sides' middles, not their corners, touch the cone.
    let rim = |i: usize| {
        let angle = i as f64 * step;
        DVec3::new(angle.cos(), angle.sin(), 0.0) / (step * 0.5).cos() + DVec3::Z
    };
    let side = |i: usize| [DVec3::ZERO, rim(i + 1), rim(i), DVec3::Z, rim(i), rim(i + 1)];
    (0..SIDES).flat_map(side).map(|corner| corner.as_vec3().to_array()).collect()
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;
    use crate::scene::Projection;

    fn faces(mesh: &[[f32; 3]]) -> Vec<[DVec3; 3]> {
        mesh.chunks_exact(3).map(|face| [0, 1, 2].map(|i| Vec3::from(face[i]).as_dvec3())).collect()
    }

    /// Returns true if every face, seen from outside, has the point behind it.
    fn holds(mesh: &[[f32; 3]], point: DVec3) -> bool {
        faces(mesh).iter().all(|[a, b, c]| (*b - *a).cross(*c - *a).dot(point - *a) <= 1e-6)
    }

    fn unit() -> impl Strategy<Value = DVec3> {
        [-1.0..1.0f64, -1.0..1.0, -1.0..1.0]
            .prop_map(DVec3::from)
            .prop_filter_map("too short", |v| (v.length() > 0.1).then(|| v.normalize()))
    }

    #[test]
    fn meshes_are_closed() {
        for mesh in [sphere_mesh(), cone_mesh()] {
            let key = |p: DVec3| (p * 1e4).round().to_array().map(|v| v as i64);
            let edges: Vec<_> = faces(&mesh)
                .into_iter()
                .flat_map(|[a, b, c]| [(key(a), key(b)), (key(b), key(c)), (key(c), key(a))])
                .collect();
            assert!(edges.iter().all(|&(a, b)| edges.iter().filter(|&&edge| edge == (b, a)).count() == 1));
        }
        assert_eq!((sphere_mesh().len(), cone_mesh().len()), (240, 96));
    }

    proptest! {
        #[test]
        fn the_sphere_and_the_cone_lie_inside_their_meshes(direction in unit(), share in 0.0..=1.0f64, turn in 0.0..6.2f64) {
            prop_assert!(holds(&sphere_mesh(), direction * share));
            let at = share.sqrt();
            prop_assert!(holds(&cone_mesh(), DVec3::new(turn.cos() * at, turn.sin() * at, 1.0)));
        }

        #[test]
        fn a_rectangle_holds_every_pixel_that_its_light_reaches(
            center in [-9.0..9.0f64, -9.0..9.0, -20.0..5.0], radius in 0.01..6.0f64, fov in 20.0..120.0f64,
            direction in unit(), share in 0.0..1.0f64, parallel in any::<bool>(),
        ) {
            let projection = if parallel { Projection::orthographic(fov * 0.1) } else { Projection::perspective(fov) };
            let camera = Camera { projection, near: 0.1, position: DVec3::ZERO, ..Camera::default() };
            let center = DVec3::from(center);
            let point = center + direction * radius * share;
            let size = [640, 360];
            let half = camera.half_height() * camera.w(-point.z);
            let x = (point.x / half * 360.0 / 640.0 + 1.0) * 320.0;
            let y = (1.0 - point.y / half) * 180.0;
            prop_assume!(-point.z > 0.1 && (0.0..640.0).contains(&x) && (0.0..360.0).contains(&y));
            let all = rectangles(&[Reach { center, radius }], 3, &camera, size);
            prop_assert_eq!(all.len(), 1);
            let LightRect { light, offset, extent } = all[0];
            prop_assert_eq!(light, 3);
            prop_assert!(x >= f64::from(offset[0]) && x <= f64::from(offset[0] + extent[0]), "{x} {all:?}");
            prop_assert!(y >= f64::from(offset[1]) && y <= f64::from(offset[1] + extent[1]), "{y} {all:?}");
            prop_assert!(offset[0] + extent[0] <= 640 && offset[1] + extent[1] <= 360);
        }
    }

    #[test]
    fn a_light_without_a_limit_covers_the_picture_and_one_behind_the_camera_nothing() {
        let camera = Camera { position: DVec3::ZERO, near: 0.1, ..Camera::default() };
        let reach = |z: f64, radius| Reach { center: DVec3::Z * z, radius };
        let all = rectangles(&[reach(5.0, f64::INFINITY), reach(5.0, 1.0), reach(5.0, 20.0)], 0, &camera, [64, 36]);
        let whole = |light| LightRect { light, offset: [0, 0], extent: [64, 36] };
        assert_eq!(all, [whole(0), whole(2)]);
    }
}
