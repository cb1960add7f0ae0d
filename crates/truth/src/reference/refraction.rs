//! The way of light through glass (KHR_materials_transmission, KHR_materials_volume, KHR_materials_dispersion), by rays.
//!
//! A ray that meets glass goes on from a facet of its surface: mirrored to the other side of a thin wall, else refracted into the body (Walter et
//! al., "Microfacet Models for Refraction through Rough Surfaces", 2007). In the body it is absorbed on its way (Beer's law). At each surface of the
//! body one part goes on outside and one inside, by Schlick's Fresnel at the outer angle; beyond the critical angle all of it stays. Both parts are
//! followed for as long as they count. The base colour tints light once, as it enters.
//!
//! Light behind glass comes from everything that a picture shows elsewhere: opaque surfaces with their usual light, other glass, surfaces blended
//! over them, and the background. Left out are particles behind glass, blended surfaces and coats within a body, the bending between two bodies that
//! touch, and light that lamps without a size send through a rough surface.

use glam::{DVec2, DVec3};

use super::geometry::Hit;
use super::intersect::Ray;
use super::light::{Collector, Reflector};
use super::render::{Points, Reference};
use super::sky::{self, visible_facet};
use super::{ShadingPoint, Smith, sampling};
use afterlight_scene::AlphaMode;

/// Facets of a point that is asked for whole.
const FACETS: u32 = 64;
/// Parts of light below that share of it are followed no further.
const LEAST_SHARE: f64 = 1e-3;
/// The most surfaces that one ray meets. Light that is mirrored on and on within a wall of glass is then taken to come from the background.
const MOST_SURFACES: u32 = 24;

/// The body of a glass surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// Indices of refraction of red, green and blue; one where light is bent alike.
    pub iors: [f64; 3],
    /// Colour of white light after `distance` metres.
    pub color: DVec3,
    /// Infinite where nothing is absorbed.
    pub distance: f64,
    /// It bends no light.
    pub is_thin: bool,
}

impl Body {
    /// The share of light that is left after some metres (KHR_materials_volume).
    pub(super) fn left_after(&self, metres: f64) -> DVec3 {
        if self.distance.is_infinite() { DVec3::ONE } else { self.color.powf(metres / self.distance) }
    }
}

/// A ray in glass, or in the air on its way between bodies.
#[derive(Debug, Clone, Copy)]
struct Way<'a> {
    smith: Smith,
    points: Points,
    body: &'a Body,
    ior: f64,
}

/// The direction of light beyond a facet, seen from `view` on the facet's side; `None` beyond the critical angle. `eta`: the index of refraction here over that beyond.
pub fn refracted(view: DVec3, facet: DVec3, eta: f64) -> Option<DVec3> {
    let cosine = view.dot(facet);
    let square = 1.0 - eta * eta * (1.0 - cosine * cosine);
    (square > 0.0).then(|| facet * (eta * cosine - square.sqrt()) - view * eta)
}

impl Reference<'_> {
    /// Returns the body of a hit's glass, if it is drawn as refracting.
    pub(super) fn body_of(&self, hit: &Hit) -> Option<Body> {
        let own = self.geometry().object(hit).material;
        let glass = own.refracts(own.model(self.brdf))?;
        // KHR_materials_dispersion.
        let (ior, apart) = (f64::from(glass.ior), (f64::from(glass.ior) - 1.0) * 0.025 * f64::from(glass.dispersion));
        Some(Body {
            iors: [(ior - apart).max(1.0), ior, ior + apart],
            color: glass.color.as_dvec3(),
            distance: f64::from(glass.distance),
            is_thin: glass.thickness <= 0.0,
        })
    }

    /// Returns the light that passes through glass at a hit, towards the origin of the ray: with its tint and its losses.
    pub(super) fn passed(
        &self,
        hit: &Hit,
        body: &Body,
        ray: &Ray,
        (smith, points): (Smith, Points),
        met: u32,
    ) -> DVec3 {
        let (surface, _) = self.surface_of(hit, ray);
        let view = -ray.direction.normalize();
        let tint = surface.albedo * ((1.0 - surface.metallic) * (1.0 - surface.alpha));
        if tint == DVec3::ZERO || met >= MOST_SURFACES {
            return tint * self.background(ray.direction);
        }
        let own = Reflector::<f64>::new(&self.facing(&surface, hit, view), smith).collector();
        let chosen = facets(surface.roughness, points, met);
        let through = |channel: usize| {
            let way = Way { smith, points, body, ior: body.iors[channel] };
            let light = chosen.iter().map(|facet| self.beyond(hit, ray, (&own, view), *facet, &way, met));
            light.sum::<DVec3>() / chosen.len() as f64
        };
        let is_grey = body.is_thin || body.iors[0] == body.iors[2];
        let light = if is_grey { through(1) } else { DVec3::new(through(0).x, through(1).y, through(2).z) };
        light * tint
    }

    /// Light from beyond one facet of a surface that is seen from outside.
    fn beyond(
        &self,
        hit: &Hit,
        ray: &Ray,
        (own, view): (&Collector, DVec3),
        point: Option<DVec2>,
        way: &Way,
        met: u32,
    ) -> DVec3 {
        let facet = facet_of(own, view, point);
        let v_dot_h = view.dot(facet);
        let normal = own.normal;
        let direction = if way.body.is_thin {
            let mirrored = facet * (2.0 * v_dot_h) - view;
            Some(mirrored - normal * (2.0 * mirrored.dot(normal)))
        } else {
            refracted(view, facet, if hit.front { 1.0 / way.ior } else { way.ior })
        };
        let Some(direction) = direction.filter(|own| own.dot(normal) < 0.0 && v_dot_h > 0.0) else {
            return DVec3::ZERO;
        };
        let share = own.passed(v_dot_h) * shadowed(own.n_dot_v, -direction.dot(normal), own.roughness, point.is_some());
        let next = Ray::new(self.behind(hit, ray, direction), direction);
        let light = match way.body.is_thin || !hit.front {
            true => self.arriving(&next, (way.smith, way.points), met + 1),
            false => self.within(&next, way, DVec3::ONE, met + 1),
        };
        share * light
    }

    /// The surface with a normal that faces the viewer. Interpolated normals at a rim and normals of a map at grazing angles may face away, and light
    /// could not leave there.
    fn facing(&self, surface: &ShadingPoint, hit: &Hit, view: DVec3) -> ShadingPoint {
        let [a, b, c] = self.geometry().triangles[hit.triangle].corners;
        let plane = (b - a).cross(c - a).normalize_or_zero();
        let all = [surface.normal, surface.geometric_normal, plane, -plane];
        let normal = all.into_iter().find(|own| own.dot(view) > 0.0).unwrap_or(surface.normal);
        ShadingPoint { normal, ray: Some(-view), ..*surface }
    }

    /// The place of a hit, moved a little along a direction off its triangle.
    fn behind(&self, hit: &Hit, ray: &Ray, direction: DVec3) -> DVec3 {
        let place = ray.at(hit.crossing.distance);
        let lift = super::shadow::Receiver::of(self.geometry(), hit, ray).start - place;
        if lift.dot(direction) > 0.0 { place + lift } else { place - lift }
    }

    /// Light that comes along a ray through the air, from whatever it meets.
    fn arriving(&self, ray: &Ray, (smith, points): (Smith, Points), met: u32) -> DVec3 {
        let mut layers = Vec::new();
        let nearest = self.geometry().seen(ray, 0.0, &mut layers);
        let glass = layers.iter().rposition(|hit| self.body_of(hit).is_some());
        let (mut radiance, mut from) = match nearest {
            Some(hit) if glass.is_none() => {
                (self.shown(&hit, (ray, None), smith, points, DVec3::ZERO), hit.crossing.distance)
            }
            _ if glass.is_none() => (self.background(ray.direction), f64::INFINITY),
            // All behind it comes through it.
            _ => (DVec3::ZERO, f64::INFINITY),
        };
        let first = glass.unwrap_or(0);
        for hit in layers.iter().skip(first) {
            let near = hit.crossing.distance;
            let behind = match self.body_of(hit) {
                Some(body) => self.passed(hit, &body, ray, (smith, points), met),
                None => self.passage(ray, [near, std::mem::replace(&mut from, near)], points).of(radiance),
            };
            from = near;
            radiance = self.shown(hit, (ray, None), smith, points, behind);
        }
        self.passage(ray, [0.0, from], points).of(radiance)
    }

    /// Light that comes along a ray within a body; `share` of it counts.
    fn within(&self, ray: &Ray, way: &Way, share: DVec3, met: u32) -> DVec3 {
        let is_met = |hit: &Hit| {
            let own = self.geometry().object(hit).material;
            // Blended surfaces, coats, and the backs of one-sided opaque surfaces are not met.
            let is_glass = self.body_of(hit).is_some_and(|body| !body.is_thin);
            is_glass || !own.is_transparent() && (hit.front || own.two_sided)
        };
        let Some(hit) = self.geometry().nearest(ray, &is_met) else {
            // The body has no other side.
            return self.background(ray.direction) * way.body.left_after(f64::INFINITY);
        };
        let left = way.body.left_after(hit.crossing.distance);
        let share = share * left;
        if share.max_element() < LEAST_SHARE {
            return DVec3::ZERO;
        }
        if met >= MOST_SURFACES {
            return left * self.background(ray.direction);
        }
        let (surface, mode) = self.surface_of(&hit, ray);
        if mode != AlphaMode::Glass {
            return left * self.shown(&hit, (ray, None), way.smith, way.points, DVec3::ZERO);
        }
        if hit.front {
            // Another body within this one: straight on.
            let next = Ray::new(self.behind(&hit, ray, ray.direction), ray.direction);
            return left * self.within(&next, way, share, met + 1);
        }
        // The surface's normal is turned to the inside.
        let view = -ray.direction;
        let turned = self.facing(&surface, &hit, view);
        let own = Reflector::<f64>::new(&turned, way.smith).collector();
        let point = facets(surface.roughness, way.points, met).first().copied().flatten();
        let facet = facet_of(&own, view, point);
        let mirrored = facet * (2.0 * view.dot(facet)) - view;
        let out = refracted(view, facet, way.ior).filter(|out| out.dot(own.normal) < 0.0);
        let passed = out.map_or(DVec3::ZERO, |out| own.passed((-out.dot(facet)).clamp(0.0, 1.0)));
        let mut light = DVec3::ZERO;
        if let Some(out) = out.filter(|_| (share * passed).max_element() >= LEAST_SHARE) {
            let next = Ray::new(self.behind(&hit, ray, out), out);
            light += passed * self.arriving(&next, (way.smith, way.points), met + 1);
        }
        let kept = DVec3::ONE - passed;
        if mirrored.dot(own.normal) > 0.0 && (share * kept).max_element() >= LEAST_SHARE {
            let next = Ray::new(self.behind(&hit, ray, mirrored), mirrored);
            light += kept * self.within(&next, way, share * kept, met + 1);
        }
        left * light
    }
}

/// Points of the unit square that choose the facets of a surface of this roughness: a single one in each of a pixel's many samples. Polished glass
/// has a single `None`, which stands for the surface itself.
fn facets(roughness: f64, points: Points, met: u32) -> Vec<Option<DVec2>> {
    match points {
        _ if roughness < SMOOTH => vec![None],
        Points::All => (0..FACETS).map(|index| Some(sky::spread(index))).collect(),
        Points::One { sample, pixel } => {
            vec![Some(sampling::on_lobe(sample, sampling::hash(pixel ^ (u64::from(met) << 40))))]
        }
    }
}

/// Below this perceptual roughness a surface is taken for polished.
const SMOOTH: f64 = 0.01;

/// A facet that is seen from `view`, in the world.
fn facet_of(own: &Collector, view: DVec3, point: Option<DVec2>) -> DVec3 {
    let Some(point) = point else { return own.normal };
    let (x, y) = own.normal.any_orthonormal_pair();
    let seen = DVec3::new(view.dot(x), view.dot(y), own.n_dot_v).normalize();
    let facet = visible_facet(seen, point, own.roughness);
    x * facet.x + y * facet.y + own.normal * facet.z
}

/// The share of light from a visible facet that is not masked on its way out, by the cosines of both directions.
fn shadowed(seen: f64, out: f64, roughness: f64, is_rough: bool) -> f64 {
    if !is_rough {
        return 1.0;
    }
    let alpha2 = roughness.powi(4);
    let hidden = |cosine: f64| (cosine * cosine + alpha2 * (1.0 - cosine * cosine)).sqrt() / cosine.max(1e-6);
    (hidden(seen) + 1.0) / (hidden(seen) + hidden(out))
}

#[cfg(test)]
pub(super) mod tests {
    use glam::{DAffine3, Vec3};

    use super::*;
    use crate::reference::{CameraView, Mode, TruthOptions};
    use afterlight_scene::builtin::shapes;
    use afterlight_scene::builtin::stage::SceneBuilder;
    use afterlight_scene::{Camera, Environment, Material, Projection, Refraction, Scene};

    /// A body before a white background, with no light on it, seen from two metres.
    pub(in crate::reference) fn alone(mesh: shapes::MeshBuilder, material: Material) -> Scene {
        let mut stage = SceneBuilder::default();
        let number = stage.material(material);
        let mesh = stage.mesh("body", mesh, number);
        stage.place(mesh, number, DAffine3::IDENTITY);
        let environment = Environment { background: Vec3::ONE, ..Environment::default() };
        let camera = Camera {
            position: DVec3::new(0.0, 0.0, 2.0),
            rotation: glam::DQuat::IDENTITY,
            projection: Projection::perspective(30.0),
            near: 0.1,
            ..Camera::default()
        };
        Scene { environment, camera, ..stage.scene }
    }

    fn middle(scene: &Scene, mode: Mode) -> DVec3 {
        let view = CameraView { camera: scene.camera, size: [9, 9] };
        let options = TruthOptions { mode, smith: Smith::HeightCorrelated };
        let truth = Reference::new(scene).expect("a scene").render(&view, &options, &|_, _| {});
        DVec3::from_array(truth.radiance[40])
    }

    #[test]
    fn light_is_bent_by_snells_law_and_not_beyond_the_critical_angle() {
        let facet = DVec3::Z;
        for degrees in [0.0f64, 20.0, 41.0, 80.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let view = DVec3::new(sin, 0.0, cos);
            let into = refracted(view, facet, 1.0 / 1.5).expect("denser");
            assert!((into.x + sin / 1.5).abs() < 1e-12 && (into.length() - 1.0).abs() < 1e-12 && into.z < 0.0);
            // 41.8 degrees.
            assert_eq!(refracted(view, facet, 1.5).is_some(), sin * 1.5 < 1.0, "{degrees}");
        }
    }

    #[test]
    fn in_even_light_a_clear_body_gives_back_all_that_it_lets_in() {
        for (mesh, thickness) in [(shapes::cuboid([1.0, 1.0, 0.3]), 0.3), (shapes::sphere(0.4, 64), 0.8)] {
            let scene = alone(mesh, Material::clear_glass(Refraction { thickness, ..Refraction::THIN }));
            let found = middle(&scene, Mode::Point);
            // The front mirrors 0.04, of nothing. Parts below a thousandth are left.
            assert!((found - DVec3::splat(0.96)).abs().max_element() < 3e-3, "{found}");
        }
        let rough =
            Material { roughness: 0.5, ..Material::clear_glass(Refraction { thickness: 0.3, ..Refraction::THIN }) };
        let found = middle(&alone(shapes::cuboid([1.0, 1.0, 0.3]), rough), Mode::Converged { samples: 256 });
        assert!(found.max_element() < 0.965 && found.min_element() > 0.85, "{found}");
    }

    #[test]
    fn a_body_absorbs_by_the_length_of_the_way_and_tints_once() {
        let green = Refraction { thickness: 0.3, color: Vec3::new(0.25, 1.0, 0.5), distance: 0.3, ..Refraction::THIN };
        let material = Material { base_color: Vec3::new(1.0, 0.5, 1.0), alpha: 0.2, ..Material::clear_glass(green) };
        let found = middle(&alone(shapes::cuboid([1.0, 1.0, 0.3]), material), Mode::Point);
        // Straight through, with inter-reflections: (1 - R)^2 A / (1 - R^2 A^2) of the light that alpha lets pass. A fifth of the light is the
        // body's, which is black without a light.
        let through = |left: f64, tint: f64| 0.8 * tint * 0.96 * 0.96 * left / (1.0 - 0.0016 * left * left);
        let back = |left: f64, tint: f64| 0.8 * tint * 0.96 * 0.04 * left * left * 0.96 / (1.0 - 0.0016 * left * left);
        let expected = DVec3::new(through(0.25, 1.0), through(1.0, 0.5), through(0.5, 1.0))
            + DVec3::new(back(0.25, 1.0), back(1.0, 0.5), back(0.5, 1.0));
        assert!((found - expected).abs().max_element() < 3e-3, "{found} {expected}");
    }

    #[test]
    fn a_thin_wall_bends_nothing_and_dispersion_bends_blue_more() {
        let iors = Refraction { ior: 1.5, dispersion: 4.0, ..Refraction::THIN }.iors();
        assert!(iors[0] < iors[1] && iors[1] < iors[2], "{iors:?}");
        let red = Material { base_color: Vec3::new(0.5, 0.0, 1.0), ..Material::clear_glass(Refraction::THIN) };
        let found = middle(&alone(shapes::cuboid([0.5, 0.5, 0.1]), red), Mode::Point);
        assert!((found - DVec3::new(0.48, 0.0, 0.96)).abs().max_element() < 1e-6, "{found}");
    }
}
