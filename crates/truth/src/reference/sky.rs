//! Light of the sky in f64: integrals over all of it, or estimates by rays that may be blocked.
//!
//! The model: the lobe of Cook-Torrance mirrors the sky by its integral. Light that it does not reflect at once is scattered again, evenly
//! (Fdez-Aguera, "A Multiple-Scattering Microfacet Model for Real-Time Image-based Lighting", JCGT 2019), and the base has the rest: a surface that
//! absorbs nothing reflects an even sky whole. The Phong models' lobes have no share, as of other ambient light.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::light::{Collector, Collects};
use afterlight_scene::{Brdf, Sky};

/// Width of the image whose texels integrals add up: a texel is 1.4 degrees.
const SUMMED_WIDTH: u32 = 256;
/// Facets of a sum.
const FACETS: u32 = 4096;
/// Along each edge of the table of shares.
const TABLE: usize = 64;

/// A sky that is ready to light surfaces.
#[derive(Debug, Clone)]
pub struct SkySampler {
    sky: Sky,
    /// Directions of the world with their solid angles and radiances in nits.
    texels: Vec<(DVec3, f64, DVec3)>,
    /// Sums of the texels' weights up to each: the probability of a direction follows its light.
    sums: Vec<f64>,
    width: usize,
    /// Shares of lobes by roughness and the root of the cosine.
    shares: Vec<DVec2>,
}

impl SkySampler {
    /// Prepares a sky.
    pub fn of(sky: &Sky) -> Self {
        let mut image = (*sky.image).clone();
        while image.size[0] > SUMMED_WIDTH {
            image = image.halved();
        }
        let back = Sky { rotation_degrees: -sky.rotation_degrees, ..sky.clone() };
        let nits = f64::from(sky.nits);
        let texels: Vec<_> =
            image.directions().map(|(direction, share, value)| (back.turned(direction), share, value * nits)).collect();
        // A hundredth is even, so that no direction which is bright only at full size is never asked.
        let light = |value: &DVec3| value.dot(DVec3::new(0.2126, 0.7152, 0.0722));
        let mean = texels.iter().map(|(_, share, value)| share * light(value)).sum::<f64>() / (4.0 * PI);
        let floor = (0.01 * mean).max(f64::MIN_POSITIVE);
        let sums = texels
            .iter()
            .scan(0.0, |sum, (_, share, value)| {
                *sum += share * (light(value) + floor);
                Some(*sum)
            })
            .collect();
        Self { sky: sky.clone(), texels, sums, width: image.size[0] as usize, shares: shares_table() }
    }

    /// Returns the sky's radiance in a direction of length 1, in nits.
    pub fn seen(&self, direction: DVec3) -> DVec3 {
        self.sky.seen(direction)
    }

    /// An estimate by three directions: one where the sky is bright, one by the cosine, one by the lobe, together weighted by the balance heuristic
    /// (Veach and Guibas 1995); and a fourth by the cosine to the back, where light comes through. `points` are in the unit square; `arrives` gives
    /// the share of light that arrives from a direction.
    pub fn estimate(
        &self,
        surface: &Collector,
        points: [DVec2; 3],
        arrives: &mut dyn FnMut(DVec3) -> DVec3,
    ) -> [DVec3; 2] {
        let [again, body, through] = even_of(surface, self.share(surface.n_dot_v, surface.roughness));
        let has_lobe = surface.brdf == Brdf::CookTorrance;
        let transmits = surface.through != DVec3::ZERO;
        let candidates = [
            Some(self.bright(points[0])),
            Some(cosine_direction(surface.normal, points[1])),
            // A facet that is turned away from the eye mirrors to the back, with a density of 0.
            has_lobe
                .then(|| mirrored(surface, facet(points[2], surface.roughness)))
                .filter(|&direction| !transmits || mirrored_density(surface, direction) > 0.0),
            transmits.then(|| cosine_direction(-surface.normal, points[1])),
        ];
        let (mut base, mut lobe) = (DVec3::ZERO, DVec3::ZERO);
        for direction in candidates.into_iter().flatten() {
            let cosine = surface.normal.dot(direction);
            if cosine == 0.0 || cosine < 0.0 && !transmits {
                continue;
            }
            let arriving = arrives(direction);
            if arriving == DVec3::ZERO {
                continue;
            }
            let of_lobe = if has_lobe { mirrored_density(surface, direction) } else { 0.0 };
            let density = self.density(direction) + cosine.abs() / PI + of_lobe;
            let light = self.sky.radiance(direction) * (cosine.abs() / density) * arriving;
            let left = surface.left(direction);
            if cosine < 0.0 {
                base += through * light * left / PI;
                continue;
            }
            base += body * light * left / PI;
            if has_lobe {
                lobe += (surface.lobe(direction) + again * left / PI) * light;
            }
        }
        [base, lobe]
    }

    /// Looks up the table of shares, bilinear.
    fn share(&self, n_dot_v: f64, roughness: f64) -> DVec2 {
        tabulated(&self.shares, n_dot_v, roughness)
    }

    /// A direction, as often as the sky is bright there.
    fn bright(&self, point: DVec2) -> DVec3 {
        let all = self.sums.last().copied().unwrap_or(1.0);
        let target = point.x * all;
        let index = self.sums.partition_point(|&sum| sum < target).min(self.sums.len() - 1);
        let before = if index == 0 { 0.0 } else { self.sums[index - 1] };
        // Within the texel: across by the rest of the first number, down by the second, evenly over its solid angle.
        let across = ((target - before) / (self.sums[index] - before)).clamp(0.0, 1.0);
        let (column, row) = (index % self.width, index / self.width);
        let height = (self.width / 2) as f64;
        let [upper, lower] = [0.0, 1.0].map(|edge| ((row as f64 + edge) / height * PI).cos());
        let up = upper + (lower - upper) * point.y;
        let angle = ((column as f64 + across) / self.width as f64 - 0.5) * TAU;
        let level = (1.0 - up * up).max(0.0).sqrt();
        let own = DVec3::new(level * angle.sin(), up, -level * angle.cos());
        Sky { rotation_degrees: -self.sky.rotation_degrees, ..self.sky.clone() }.turned(own)
    }

    /// The texel in a direction of length 1.
    fn texel_at(&self, direction: DVec3) -> usize {
        let own = self.sky.turned(direction);
        let height = self.width / 2;
        let across = (0.5 + own.x.atan2(-own.z) / TAU) * self.width as f64;
        let down = own.y.clamp(-1.0, 1.0).acos() / PI * height as f64;
        (down as usize).min(height - 1) * self.width + (across as usize).min(self.width - 1)
    }

    /// Returns the density, per steradian, with which [`Self::bright`] gives a direction.
    fn density(&self, direction: DVec3) -> f64 {
        let index = self.texel_at(direction);
        let before = if index == 0 { 0.0 } else { self.sums[index - 1] };
        (self.sums[index] - before) / self.sums.last().copied().unwrap_or(1.0) / self.texels[index].1
    }
}

/// All of the sky, by sums.
impl Collects for SkySampler {
    fn collected(&self, surface: &Collector) -> [DVec3; 2] {
        let has_lobe = surface.brdf == Brdf::CookTorrance;
        let share = if has_lobe { share_of(surface.n_dot_v, surface.roughness, FACETS) } else { DVec2::ZERO };
        let (mut collected, mut behind, mut lobe) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        let transmits = surface.through != DVec3::ZERO;
        // The lobe by both, texels of the sky and facets, weighted by how close each lie to one another there (Veach and Guibas 1995).
        let facets = |direction| if has_lobe { f64::from(FACETS) * mirrored_density(surface, direction) } else { 0.0 };
        for &(direction, solid_angle, radiance) in &self.texels {
            let cosine = surface.normal.dot(direction);
            if cosine > 0.0 {
                let light = radiance * cosine;
                collected += light * solid_angle * surface.left(direction);
                if has_lobe {
                    lobe += surface.lobe(direction) * light / (facets(direction) + 1.0 / solid_angle);
                }
            } else if transmits {
                behind -= radiance * (cosine * solid_angle * surface.left(direction));
            }
        }
        for index in 0..if has_lobe { FACETS } else { 0 } {
            let direction = mirrored(surface, facet(spread(index), surface.roughness));
            let cosine = surface.normal.dot(direction);
            if cosine > 0.0 {
                let light = self.sky.radiance(direction) * cosine;
                let solid_angle = self.texels[self.texel_at(direction)].1;
                lobe += surface.lobe(direction) * light / (facets(direction) + 1.0 / solid_angle);
            }
        }
        let [again, body, through] = even_of(surface, share);
        [(body * collected + through * behind) / PI, lobe + again * collected / PI]
    }
}

/// Returns the light of an even sky of 1 beside the lobe's own share: light scattered again among facets, light that the base reflects, and light that comes through it.
fn even_of(surface: &Collector, share: DVec2) -> [DVec3; 3] {
    if surface.brdf != Brdf::CookTorrance {
        return [DVec3::ZERO, surface.diffuse, DVec3::ZERO];
    }
    let single = surface.even * share.x + DVec3::splat(surface.grazing * share.y);
    let missing = 1.0 - share.x - share.y;
    // The mean of Schlick's Fresnel over the cosine.
    let mean = surface.even + (DVec3::splat(surface.grazing) - surface.even) / 21.0;
    let again = single * mean * missing / (DVec3::ONE - mean * missing);
    let left = DVec3::ONE - single - again;
    [again, surface.diffuse * left, surface.through * left]
}

/// Point `index` of a sequence that covers the unit square evenly, whatever their number (M. Roberts, "The Unreasonable Effectiveness of Quasirandom
/// Sequences", 2018).
pub(super) fn spread(index: u32) -> DVec2 {
    const STEP: DVec2 = DVec2::new(0.754_877_666_246_692_8, 0.569_840_290_998_053_3);
    (DVec2::splat(0.5) + STEP * f64::from(index)).fract()
}

/// A half vector about +Z, as often as GGX has facets that face there (Walter et al. 2007).
fn facet(point: DVec2, roughness: f64) -> DVec3 {
    let alpha2 = roughness.powi(4);
    let cos2 = (1.0 - point.y) / (1.0 + (alpha2 - 1.0) * point.y);
    let (sin, cos) = (point.x * TAU).sin_cos();
    let sine = (1.0 - cos2).max(0.0).sqrt();
    DVec3::new(sine * cos, sine * sin, cos2.sqrt())
}

/// The view, mirrored at a facet that is given about +Z.
fn mirrored(surface: &Collector, facet: DVec3) -> DVec3 {
    let half = surface.half(facet);
    half * (2.0 * surface.view.dot(half)) - surface.view
}

/// Returns the density, per steradian, with which [`mirrored`] gives a direction.
fn mirrored_density(surface: &Collector, direction: DVec3) -> f64 {
    let half = (surface.view + direction).normalize_or_zero();
    let (cosine, v_dot_h) = (surface.normal.dot(half), surface.view.dot(half));
    if cosine <= 0.0 || v_dot_h <= 0.0 {
        return 0.0;
    }
    if let Some(density) = surface.stretched_density(half) {
        return density / (4.0 * v_dot_h);
    }
    let (alpha2, sine2) = (surface.roughness.powi(4), surface.normal.cross(half).length_squared());
    let facets = alpha2 / (PI * (cosine * cosine * alpha2 + sine2).powi(2));
    facets * cosine / (4.0 * v_dot_h)
}

/// A direction by the cosine to a normal.
fn cosine_direction(normal: DVec3, point: DVec2) -> DVec3 {
    let (x, y) = normal.any_orthonormal_pair();
    let (sin, cos) = (point.x * TAU).sin_cos();
    let radius = point.y.sqrt();
    x * (radius * cos) + y * (radius * sin) + normal * (1.0 - point.y).max(0.0).sqrt()
}

/// A half vector about +Z, as often as GGX has facets there that are seen from a direction (Heitz, "Sampling the GGX Distribution of Visible Normals", JCGT
/// 2018).
pub(super) fn visible_facet(view: DVec3, point: DVec2, roughness: f64) -> DVec3 {
    let alpha = roughness * roughness;
    let stretched = DVec3::new(alpha * view.x, alpha * view.y, view.z).normalize();
    let aside = DVec3::Z.cross(stretched).try_normalize().unwrap_or(DVec3::X);
    let other = stretched.cross(aside);
    let (sin, cos) = (point.x * TAU).sin_cos();
    let radius = point.y.sqrt();
    let (across, share) = (radius * cos, 0.5 * (1.0 + stretched.z));
    let along = (1.0 - share) * (1.0 - across * across).max(0.0).sqrt() + share * radius * sin;
    let ahead = (1.0 - across * across - along * along).max(0.0).sqrt();
    let facet = aside * across + other * along + stretched * ahead;
    DVec3::new(alpha * facet.x, alpha * facet.y, facet.z.max(0.0)).normalize()
}

/// Returns the factors of F0 and F90 in a lobe's share of even light: means over `facets` visible facets.
pub fn share_of(n_dot_v: f64, roughness: f64, facets: u32) -> DVec2 {
    let view = DVec3::new((1.0 - n_dot_v * n_dot_v).max(0.0).sqrt(), 0.0, n_dot_v);
    let alpha2 = roughness.powi(4);
    // Smith's term of a direction over its cosine.
    let hidden = |x: f64| (x * x + alpha2 * (1.0 - x * x)).sqrt() / x;
    let mut sum = DVec2::ZERO;
    for index in 0..facets {
        let half = visible_facet(view, spread(index), roughness);
        let v_dot_h = view.dot(half);
        let n_dot_l = 2.0 * v_dot_h * half.z - n_dot_v;
        if n_dot_l > 0.0 {
            // Height-correlated masking and shadowing over masking alone.
            let share = (hidden(n_dot_v) + 1.0) / (hidden(n_dot_v) + hidden(n_dot_l));
            let grazing = (1.0 - v_dot_h).clamp(0.0, 1.0).powi(5);
            sum += DVec2::new(share * (1.0 - grazing), share * grazing);
        }
    }
    sum / f64::from(facets)
}

/// Looks up a table of shares, bilinear.
pub(super) fn tabulated(shares: &[DVec2], n_dot_v: f64, roughness: f64) -> DVec2 {
    let last = (TABLE - 1) as f64;
    let (x, y) = (n_dot_v.clamp(0.0, 1.0).sqrt() * last, roughness.clamp(0.0, 1.0) * last);
    let (left, top) = (x.floor().min(last - 1.0), y.floor().min(last - 1.0));
    let at = |column: f64, row: f64| shares[row as usize * TABLE + column as usize];
    let row = |row: f64| at(left, row).lerp(at(left + 1.0, row), x - left);
    row(top).lerp(row(top + 1.0), y - top)
}

pub(super) fn shares_table() -> Vec<DVec2> {
    use rayon::prelude::*;
    let last = (TABLE - 1) as f64;
    let entry = |index: usize| {
        let root = ((index % TABLE) as f64 / last).max(super::light::MIN_N_DOT_V.sqrt());
        let roughness = ((index / TABLE) as f64 / last).max(super::light::MIN_ROUGHNESS);
        share_of(root * root, roughness, FACETS)
    };
    (0..TABLE * TABLE).into_par_iter().map(entry).collect()
}
