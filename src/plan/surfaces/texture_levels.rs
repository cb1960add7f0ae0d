//! Levels of textures that no pixel can sample, wherever the camera stands and looks.
//!
//! A sampler chooses its level by how many texels lie between neighbouring pixels. No point that is seen is nearer than the near plane, where
//! a pixel covers some least length of a surface ([`least_footprint`]), and each triangle has a least number of texels to a metre
//! ([`texels_per_metre`]). Their product bounds the level from below.

use std::collections::BTreeMap;

use glam::{DAffine3, DMat3, DVec2, DVec3, Vec2, Vec3};

use super::textures::TextureSource;
use super::{GeometryKey, SurfaceRules};
use crate::plan::{Error, FramePlan};
use crate::scene::{Camera, Mesh, Scene};

/// The least distance in metres on any surface between what two neighbouring pixels of a quad see, along the rows or along the columns,
/// whichever is larger: a sampler's derivatives are no smaller.
///
/// Rays d1 and d2 = d1 + (pixel, 0, 0) through neighbouring pixels, with z = 1, meet a plane at depths t1 and t2. Their meeting points are
/// no nearer to each other than t1 d1 is to the line along d2: t1 |d1 x d2| / |d2| >= t1 pixel / sqrt(1 + X^2) for the picture's half
/// width X at depth 1; across the rows likewise with its half height Y. The larger of both counts, hence the smaller of X and Y.
///
/// What is seen has t >= near, but a derivative may be taken between two other pixels of the quad, where the plane goes on nearer to the
/// eye. Its inverse depth is linear in the picture: if that grows by at most 1 / near from pixel to pixel, t >= near / 3. If it grows faster,
/// by G, the depths themselves are G / (1 / near + 2 G)^2 apart, which is no less while the eye is farther from the plane than
/// 3 near pixel^2. A triangle whose plane is nearer (a micrometre at a near plane of 0.1 m, 65 degrees and 720 rows) is seen edge-on, less
/// than 3 pixel of a pixel thick: 0.005, which is about the grid that rasterizers snap to. This is the one case that the bound leaves out.
///
/// An anisotropic sampler takes a level that is finer by its anisotropy at most (Vulkan, "Scale Factor Operation"), and several texels of it:
/// the footprint is smaller by as much. There is no bias of levels (`src/gpu_scene/material.rs`).
///
/// Parallel rays meet a plane at places that are a pixel apart at least, in front of the eye and behind it.
pub fn least_footprint(camera: &Camera, size: [u32; 2], anisotropy: u32) -> f64 {
    let half_height = camera.half_height();
    let [width, height] = size.map(f64::from);
    let pixel = 2.0 * half_height / height;
    if camera.is_orthographic() {
        return pixel / f64::from(anisotropy);
    }
    // Quads reach a pixel beyond the picture, and jitter moves it by half of one.
    let half = half_height.min(half_height * width / height) + 2.0 * pixel;
    camera.near * pixel / (1.0 + half * half).sqrt() / 3.0 / f64::from(anisotropy)
}

/// How much longer a length can become by a transform: its largest singular value.
pub(crate) fn stretch(transform: &DAffine3) -> f64 {
    let matrix = transform.matrix3;
    // The largest eigenvalue of a symmetric matrix of 3 by 3, by the trigonometric solution of its cubic (O. K. Smith, "Eigenvalues of a
    // symmetric 3x3 matrix", 1961).
    let squared = matrix.transpose() * matrix;
    let mean = (squared.x_axis.x + squared.y_axis.y + squared.z_axis.z) / 3.0;
    let centred = squared - DMat3::from_diagonal(DVec3::splat(mean));
    let spread =
        ((centred.x_axis.length_squared() + centred.y_axis.length_squared() + centred.z_axis.length_squared()) / 6.0)
            .sqrt();
    if spread <= mean * 1e-12 {
        return mean.max(0.0).sqrt();
    }
    let half_determinant = ((centred * (1.0 / spread)).determinant() / 2.0).clamp(-1.0, 1.0);
    (mean + 2.0 * spread * (half_determinant.acos() / 3.0).cos()).max(0.0).sqrt()
}

/// The least number of texels to a metre of a mesh, in any direction on any of its triangles; none if it has no area.
fn texels_per_metre(points: [Vec3; 3], uvs: [Vec2; 3], size: [u32; 2]) -> Option<f64> {
    let edges = [points[1], points[2]].map(|point| point.as_dvec3() - points[0].as_dvec3());
    let texels = DVec2::new(f64::from(size[0]), f64::from(size[1]));
    let steps = [uvs[1], uvs[2]].map(|uv| (uv.as_dvec2() - uvs[0].as_dvec2()) * texels);
    // Coordinates in the triangle's plane: along the first edge, and across it.
    let along = edges[0].try_normalize()?;
    let length = edges[0].dot(along);
    let across = edges[1] - along * edges[1].dot(along);
    let height = across.length();
    if height <= 0.0 {
        return None;
    }
    let first = steps[0] / length;
    let second = (steps[1] - first * edges[1].dot(along)) / height;
    // Singular values of the matrix of these columns: their product is its determinant, the sum of their squares that of its entries.
    let (sum, product) = (first.length_squared() + second.length_squared(), first.perp_dot(second).abs());
    let largest = ((sum + (sum * sum - 4.0 * product * product).max(0.0).sqrt()) / 2.0).sqrt();
    // Where the UVs are not finite or have no area, texels may be as large as they like.
    let least = product / largest;
    Some(if least.is_finite() { least } else { 0.0 })
}

/// The finest level that can be sampled of a texture of this size on a mesh where a pixel covers `footprint` metres.
fn finest(mesh: &Mesh, size: [u32; 2], footprint: f64, most: u32) -> u32 {
    let mut finest = most;
    let largest_uv = mesh.uvs.iter().flatten().fold(0.0f32, |largest, uv| largest.max(uv.abs()));
    // Interpolated UVs are off by some roundings of f32, 16 of which are granted.
    let rounding = f64::from(largest_uv) * f64::from(size[0].max(size[1])) * f64::from(f32::EPSILON) * 16.0;
    for corners in mesh.indices.as_chunks::<3>().0 {
        let corner = |index: u32| {
            let uv = mesh.uvs.get(index as usize).copied().unwrap_or_default();
            (Vec3::from(mesh.positions[index as usize]), Vec2::from(uv))
        };
        let [a, b, c] = corners.map(corner);
        let Some(density) = texels_per_metre([a.0, b.0, c.0], [a.1, b.1, c.1], size) else { continue };
        // For the length of a derivative, its larger component may be taken, which is up to sqrt 2 shorter (Vulkan, "Scale Factor Operation,
        // LOD Operation and Image Level(s) Selection"). Half a level is for what devices are off in its logarithm.
        let level = ((density * footprint - rounding).max(0.0) / 2.0f64.sqrt()).log2() - 0.5;
        finest = finest.min(level.max(0.0) as u32);
        if finest == 0 {
            break;
        }
    }
    finest
}

/// The first level of each of the scene's textures that has to be there, where that is not the largest. A pixel covers `footprint` metres of a
/// surface at least.
pub(super) fn first_levels(scene: &Scene, rules: &SurfaceRules, footprint: f64) -> BTreeMap<usize, u32> {
    let mut levels: BTreeMap<usize, u32> = BTreeMap::new();
    // A shadow map may look as closely as it likes.
    levels.extend(rules.drawn(scene).filter_map(|object| rules.holes_of(object)).map(|texture| (texture, 0)));
    for object in rules.drawn(scene) {
        let material = rules.material(object);
        let own = GeometryKey::own_textures(object, rules);
        for index in own.slots().filter_map(|slot| material.texture(slot)) {
            let Some(texture) = scene.textures.get(index) else { continue };
            let level = levels.entry(index).or_insert_with(|| most_to_drop(texture.size));
            if *level > 0 {
                let footprint = footprint / stretch(&object.transform);
                let needed = finest(&scene.meshes[object.mesh], texture.size, footprint, *level);
                *level = halvings(texture.size).min(needed);
            }
        }
    }
    levels.retain(|_, level| *level > 0);
    levels
}

/// Levels that a texture can begin without: two stay, so that its upload is like any other's.
fn most_to_drop(size: [u32; 2]) -> u32 {
    size[0].max(size[1]).max(1).ilog2().saturating_sub(1).min(halvings(size))
}

/// How often both edges can be halved exactly: only then is the coarser level as large in UVs as the texture.
fn halvings(size: [u32; 2]) -> u32 {
    size.map(u32::trailing_zeros).into_iter().min().unwrap_or(0)
}

impl FramePlan {
    /// How large an object of a material may become, where a larger one would show levels that are not there: no lengths of it may be
    /// stretched more than by the transform that it is planned with.
    pub(crate) fn stretch_limit(&self, material: usize, transform: &DAffine3) -> f64 {
        let dropped = |&image: &usize| self.textures.images[image].first_level > 0;
        let limited = self.textures.sets.get(&material).is_some_and(|set| set.values().any(dropped));
        if limited { stretch(transform) * (1.0 + 1e-9) } else { f64::INFINITY }
    }

    /// Refuses a camera that looks more closely at things than the one that the plan was made for.
    ///
    /// # Errors
    /// When it would see levels of textures that are not there.
    pub fn check_camera(&self, camera: &Camera) -> Result<(), Error> {
        if let Some(fault) = camera.fault() {
            return Err(Error::Change(format!("the camera: {fault}")));
        }
        if camera.is_orthographic() != self.orthographic {
            let [own, planned] = [camera.is_orthographic(), self.orthographic].map(|parallel| match parallel {
                true => "orthographic",
                false => "perspective",
            });
            return Err(Error::Change(format!("this camera is {own}, and the frames are planned for a {planned} one")));
        }
        let Some(planned) = self.footprint else { return Ok(()) };
        let footprint = least_footprint(camera, self.size, self.anisotropy);
        if footprint >= planned * (1.0 - 1e-9) {
            return Ok(());
        }
        Err(Error::Change(format!(
            "this camera sees {footprint:.2e} m in a pixel, and levels of textures were left out that show only below {planned:.2e} m: keep its near plane and what it shows, or all levels with `--plan texture-levels`",
        )))
    }
}

impl TextureSource {
    /// Which level of the scene's texture is the first.
    pub(super) fn first_level(self, levels: &BTreeMap<usize, u32>) -> u32 {
        match self {
            Self::Scene(index) => levels.get(&index).copied().unwrap_or(0),
            Self::White | Self::Flat => 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::plan::samples::{self, plan, vector};
    use crate::scene::{Keep, Material, OptionalPart, Projection, Settings, Texture, View};

    proptest! {
        #[test]
        fn no_two_pixels_of_a_quad_see_places_nearer_to_each_other_than_the_footprint(
            leaning in vector(1.0), log_facing in -30.0..0.0f64, log_depth in 0.0..12.0f64, fov in 5.0..120.0f64,
            width in 8..2000u32, height in 8..2000u32, x in 0.0..1.0f64, y in 0.0..1.0f64,
            row in 0..2u32, column in 0..2u32, seen in (0..2u32, 0..2u32),
        ) {
            let camera = Camera { projection: Projection::perspective(fov), near: 0.1, ..Camera::default() };
            let tan = (fov.to_radians() * 0.5).tan();
            let pixel = 2.0 * tan / f64::from(height);
            let aspect = f64::from(width) / f64::from(height);
            let corner = DVec2::new((x * 2.0 - 1.0) * tan * aspect, (y * 2.0 - 1.0) * tan);
            let ray = |(column, row): (u32, u32)| {
                DVec3::new(corner.x + pixel * f64::from(column), corner.y + pixel * f64::from(row), 1.0)
            };
            // A plane that is met at this depth in one of the pixels, head-on to all but edge-on.
            let seen_depth = camera.near * log_depth.exp2();
            let toward = ray(seen).normalize();
            let edge_on = leaning - toward * leaning.dot(toward);
            prop_assume!(edge_on.length() > 0.01);
            let normal = edge_on.normalize() + toward * log_facing.exp2();
            let normal = normal.normalize();
            let distance = seen_depth * normal.dot(ray(seen));
            prop_assume!(distance > 3.0 * camera.near * pixel * pixel);
            // Where the plane is met by the others, on either side of the eye.
            let place = |at| ray(at) * (distance / normal.dot(ray(at)));
            let along = place((0, row)).distance(place((1, row)));
            let across = place((column, 0)).distance(place((column, 1)));
            let least = least_footprint(&camera, [width, height], 1);
            prop_assert!(along.max(across) >= least * (1.0 - 1e-6), "{along} {across} {least}");
        }

        #[test]
        fn a_step_on_a_triangle_crosses_at_least_its_texels(
            points in [vector(3.0), vector(3.0), vector(3.0)], uvs in [[-2.0..2.0f32, -2.0..2.0f32], [-2.0..2.0f32, -2.0..2.0f32], [-2.0..2.0f32, -2.0..2.0f32]],
            steps in proptest::collection::vec((-1.0..1.0f64, -1.0..1.0f64), 16), width in 1..300u32, height in 1..300u32,
        ) {
            let points = points.map(|point| point.as_vec3());
            let uvs = uvs.map(Vec2::from);
            let [a, b] = [1, 2].map(|corner| (points[corner] - points[0]).as_dvec3());
            prop_assume!(a.cross(b).length() > 0.01);
            let Some(density) = texels_per_metre(points, uvs, [width, height]) else { return Err(TestCaseError::fail("it has an area")) };
            let texels = DVec2::new(f64::from(width), f64::from(height));
            let [u, v] = [1, 2].map(|corner| (uvs[corner].as_dvec2() - uvs[0].as_dvec2()) * texels);
            let mut least = f64::INFINITY;
            for (s, t) in steps {
                let (metres, crossed) = ((a * s + b * t).length(), (u * s + v * t).length());
                prop_assert!(crossed >= density * metres * (1.0 - 1e-4) - 1e-3, "{crossed} in {metres} m of {density}");
                least = least.min(crossed / metres);
            }
            prop_assert!(least >= density * 0.999 - 1e-3);
        }

        #[test]
        fn nothing_is_stretched_more_than_by_the_largest_singular_value(
            rows in [vector(5.0), vector(5.0), vector(5.0)], directions in proptest::collection::vec(vector(1.0), 32),
        ) {
            let transform = DAffine3::from_mat3(DMat3::from_cols(rows[0], rows[1], rows[2]));
            let most = stretch(&transform);
            for direction in directions.into_iter().filter(|direction| direction.length() > 0.01) {
                let longer = transform.transform_vector3(direction).length() / direction.length();
                prop_assert!(longer <= most * (1.0 + 1e-9), "{longer} {most}");
            }
            let longest = rows.into_iter().map(DVec3::length).fold(0.0, f64::max);
            prop_assert!(most >= longest * (1.0 - 1e-9) && most <= longest * 3.0f64.sqrt() * (1.0 + 1e-9));
        }
    }

    #[test]
    fn a_stretch_of_known_matrices_is_exact() {
        let of = |matrix| stretch(&DAffine3::from_mat3(matrix));
        assert_eq!(of(DMat3::from_diagonal(DVec3::splat(-2.0))), 2.0);
        assert!((of(DMat3::from_diagonal(DVec3::new(1.0, -3.0, 2.0))) - 3.0).abs() < 1e-12);
        assert!(
            (of(DMat3::from_rotation_y(0.3) * DMat3::from_diagonal(DVec3::new(4.0, 1.0, 1.0))) - 4.0).abs() < 1e-12
        );
        assert_eq!(of(DMat3::ZERO), 0.0);
    }

    /// A square of 1 m under a texture of so many texels, repeated `times`; the near plane is far away, so that a pixel covers much.
    fn scene(edge: u32, times: f32) -> Scene {
        let colored = Material { base_color_texture: Some(0), ..Material::default() };
        let mut scene = samples::scene(vec![colored], vec![samples::sky()]);
        let texels = (0..edge * edge).flat_map(|i| [(i % 251) as u8, 0, 0, 255]).collect();
        scene.textures = vec![Texture { size: [edge, edge], texels, ..scene.textures[0].clone() }];
        scene.meshes[0].uvs.iter_mut().flatten().for_each(|uv| *uv *= times);
        scene.camera.near = 10.0;
        scene
    }

    fn settings() -> Settings {
        Settings { size: [100, 100], anisotropy: 1, ..Settings::default() }
    }

    fn first(scene: &Scene, settings: &Settings) -> u32 {
        plan(scene, settings).textures.images[0].first_level
    }

    #[test]
    fn levels_begin_where_the_nearest_pixel_can_sample() {
        // 60 degrees at 10 m: 0.1155 m a pixel before it is divided by 3 and by sqrt(1 + 0.6^2).
        let footprint = least_footprint(&scene(256, 1.0).camera, [100, 100], 1);
        assert!((footprint - 0.115_47 / 3.0 / 1.36f64.sqrt()).abs() < 1e-3, "{footprint}");
        for (edge, times, expected) in [
            // 256 texels to a metre are 8.5 texels: log2(8.5 / sqrt 2) - 0.5 is 2.08.
            (256, 1.0, 2),
            (256, 2.0, 3),
            (256, 0.5, 1),
            (256, 0.1, 0),
            (32, 64.0, 4),
            // Two levels stay.
            (4, 1000.0, 1),
            (2, 1000.0, 0),
            // 96 halves five times, 100 twice, 99 never.
            (100, 1000.0, 2),
            (99, 1000.0, 0),
        ] {
            let scene = scene(edge, times);
            let textures = plan(&scene, &settings()).textures;
            let image = &textures.images[0];
            assert_eq!(image.first_level, expected, "{edge} texels, {times} times");
            assert_eq!(image.size, [edge >> expected; 2]);
            assert_eq!(image.levels, 1 + edge.ilog2() - expected);
            assert_eq!(
                first(&scene, &Settings { keep: Keep::NONE.with(OptionalPart::TextureLevels), ..settings() }),
                0
            );
        }
    }

    #[test]
    fn every_level_stays_where_something_may_look_closely() {
        let lean = settings();
        assert_eq!(first(&scene(256, 1.0), &lean), 2);
        assert_eq!(first(&scene(256, 1.0), &Settings { msaa: 4, ..lean.clone() }), 0, "centroids");
        for (anisotropy, level) in [(2, 1), (4, 0), (16, 0)] {
            assert_eq!(
                first(&scene(256, 1.0), &Settings { anisotropy, ..lean.clone() }),
                level,
                "the short side counts"
            );
        }
        let mut near = scene(256, 1.0);
        near.camera.near = 0.1;
        assert_eq!(first(&near, &lean), 0);
        let mut narrow = scene(256, 1.0);
        narrow.camera.projection = Projection::perspective(2.0);
        assert_eq!(first(&narrow, &lean), 0);
        let mut large = scene(256, 1.0);
        large.objects[0].transform = DAffine3::from_scale(DVec3::new(1.0, 8.0, 1.0));
        assert_eq!(first(&large, &lean), 0);
        let mut sliver = scene(256, 1.0);
        sliver.meshes[0].uvs[2] = sliver.meshes[0].uvs[0];
        assert_eq!(first(&sliver, &lean), 0, "a line of texels over an area");
        // A texture that cuts holes into shadows is seen by the lights as well.
        let mut masked = scene(256, 1.0);
        masked.lights = vec![samples::sun()];
        masked.materials[0] = samples::masked();
        masked.textures[0].texels.iter_mut().step_by(4).skip(3).for_each(|texel| *texel = 0);
        masked.textures[0].texels[3] = 0;
        assert_eq!(first(&masked, &lean), 0);
        masked.lights = vec![samples::sky()];
        assert_eq!(first(&masked, &lean), 2);
        // Of two objects with a texture the closer look counts.
        let mut two = scene(256, 1.0);
        let mut bigger = two.objects[0].clone();
        bigger.transform = DAffine3::from_scale(DVec3::splat(2.0));
        two.objects.push(bigger);
        assert_eq!(first(&two, &lean), 1);
    }

    #[test]
    fn what_would_show_dropped_levels_is_refused() {
        let scene = scene(256, 1.0);
        let plan = plan(&scene, &settings());
        plan.check_camera(&scene.camera).expect("the planned camera");
        plan.check_camera(&Camera { near: 12.0, position: DVec3::ONE, ..scene.camera }).expect("a coarser look");
        for closer in
            [Camera { near: 9.0, ..scene.camera }, Camera { projection: Projection::perspective(50.0), ..scene.camera }]
        {
            let error = plan.check_camera(&closer).expect_err("a closer look").to_string();
            assert!(error.contains("--plan texture-levels"), "{error}");
        }
        let kept = Settings { keep: Keep::NONE.with(OptionalPart::TextureLevels), ..settings() };
        samples::plan(&scene, &kept)
            .check_camera(&Camera { near: 0.01, ..scene.camera })
            .expect("all levels are there");
        assert_eq!(first(&scene, &Settings { view: View::Albedo, ..settings() }), 2);
    }
}
