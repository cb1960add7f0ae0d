//! The lobe of fibres that stand on a surface (KHR_materials_sheen), after Estevez and Kulla, "Production Friendly Microfacet Sheen BRDF", 2017.
//!
//! Limits: F = 1. Below a roughness of about 0.2 the fit of the visibility reflects more than the light that arrives at grazing angles.

use std::f64::consts::PI;
use std::sync::OnceLock;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::brdf::{MIN_N_DOT_V, Reflectance};
use super::real::{Real, unit};
use crate::reference::SurfaceLobes;

/// Least perceptual roughness of a sheen, part of the model.
pub const MIN_SHEEN_ROUGHNESS: f64 = 0.07;

/// Fibres that are seen from one direction.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fibres<R: Real> {
    color: Vector3<R>,
    roughness: R,
    /// The largest channel of the colour.
    most: R,
    /// The share of even light that they scatter to the eye.
    at_view: R,
}

impl<R: Real> Fibres<R> {
    /// Returns the fibres of these lobes; `None` without a sheen.
    pub fn of(lobes: &SurfaceLobes, n_dot_v: R) -> Option<Self> {
        let most = lobes.sheen.max_element();
        (most > 0.0).then(|| {
            let roughness = lobes.sheen_roughness.max(MIN_SHEEN_ROUGHNESS);
            Self {
                color: super::vector(lobes.sheen),
                roughness: R::of(roughness),
                most: R::of(most),
                at_view: R::of(sheen_share(n_dot_v.wide(), roughness)),
            }
        })
    }

    /// The share of even light that the fibres scatter to the eye, by channel.
    pub fn scattered(&self) -> Vector3<R> {
        self.color * self.at_view
    }

    /// Share of light that the fibres leave to the layers below, by the angle to the eye alone.
    pub fn left(&self) -> R {
        left(self.most, self.at_view)
    }

    /// Share of light that the fibres leave by the angles to the eye and to the light: the lesser of the two, which keeps it reciprocal.
    pub fn left_of(&self, n_dot_l: R) -> R {
        let at_light = R::of(sheen_share(n_dot_l.wide().max(MIN_N_DOT_V), self.roughness.wide()));
        self.left().min(left(self.most, at_light))
    }

    /// f of the fibres for light from a direction.
    pub fn scatter(&self, (normal, view, n_dot_v): (&Vector3<R>, &Vector3<R>, R), light: &Vector3<R>) -> Vector3<R> {
        let Some(half) = unit(&(light + view)) else { return Vector3::zeros() };
        let across = normal.cross(&half);
        let alpha = self.roughness * self.roughness;
        self.color * (distribution(alpha, across.dot(&across)) * visibility(alpha, normal.dot(light), n_dot_v))
    }

    /// The surface with the fibres over it.
    pub fn over(
        &self,
        below: Reflectance<R>,
        seen: (&Vector3<R>, &Vector3<R>, R),
        light: &Vector3<R>,
    ) -> Reflectance<R> {
        let left = self.left_of(seen.0.dot(light));
        Reflectance { base: below.base * left, lobe: below.lobe * left + self.scatter(seen, light) }
    }
}

fn left<R: Real>(most: R, share: R) -> R {
    (R::one() - most * share).max(R::zero())
}

/// (2 + 1 / alpha) sin^(1 / alpha) / 2 pi of the angle between normal and half vector: equation 2, "Charlie".
fn distribution<R: Real>(alpha: R, sine2: R) -> R {
    let inverse = R::one() / alpha;
    (R::of(2.0) + inverse) * sine2.min(R::one()).powf(inverse / R::of(2.0)) / (R::of(2.0) * R::PI())
}

/// 1 / ((1 + lambda(v) + lambda(l)) 4 n.l n.v): section 3, without its terminator softening, as KHR_materials_sheen has it.
fn visibility<R: Real>(alpha: R, n_dot_l: R, n_dot_v: R) -> R {
    R::one() / ((R::one() + lambda(n_dot_v, alpha) + lambda(n_dot_l, alpha)) * R::of(4.0) * n_dot_l * n_dot_v)
}

/// Equation 3, with the numbers of table 1 between alpha 0 and 1.
fn lambda<R: Real>(cosine: R, alpha: R) -> R {
    let smooth = (R::one() - alpha) * (R::one() - alpha);
    let fitted = |at_rough: f64, at_smooth: f64| R::of(at_rough) + (R::of(at_smooth) - R::of(at_rough)) * smooth;
    let (a, b, c) = (fitted(21.5473, 25.3245), fitted(3.82987, 3.32435), fitted(0.19823, 0.16801));
    let (d, e) = (fitted(-1.97760, -1.27393), fitted(-4.32054, -4.85967));
    let curve = |x: R| a / (R::one() + b * x.powf(c)) + d * x + e;
    let half = R::of(0.5);
    match cosine < half {
        true => curve(cosine).exp(),
        false => (R::of(2.0) * curve(half) - curve((R::one() - cosine).max(R::zero()))).exp(),
    }
}

/// Along each edge of the table of shares.
const TABLE: usize = 64;
/// Steps of the sums along each angle.
const STEPS: u32 = 64;

/// The share of even light that fibres of colour 1 scatter to a direction, from a table, bilinear in roughness and the root of the cosine.
pub fn sheen_share(cosine: f64, roughness: f64) -> f64 {
    static SHARES: OnceLock<Vec<f64>> = OnceLock::new();
    let last = (TABLE - 1) as f64;
    let shares = SHARES.get_or_init(|| {
        let entry = |index: usize| {
            let root = ((index % TABLE) as f64 / last).max(MIN_N_DOT_V.sqrt());
            let roughness = ((index / TABLE) as f64 / last).max(MIN_SHEEN_ROUGHNESS);
            summed_sheen_share(root * root, roughness, STEPS)
        };
        (0..TABLE * TABLE).into_par_iter().map(entry).collect()
    });
    let (x, y) = (cosine.clamp(0.0, 1.0).sqrt() * last, roughness.clamp(0.0, 1.0) * last);
    let (left, top) = (x.floor().min(last - 1.0), y.floor().min(last - 1.0));
    let at = |column: f64, row: f64| shares[row as usize * TABLE + column as usize];
    let row = |row: f64| at(left, row) + (at(left + 1.0, row) - at(left, row)) * (x - left);
    row(top) + (row(top + 1.0) - row(top)) * (y - top)
}

/// Computes [`sheen_share`] by a sum over `steps` steps of each angle.
pub fn summed_sheen_share(n_dot_v: f64, roughness: f64, steps: u32) -> f64 {
    let alpha = roughness * roughness;
    let aside = (1.0 - n_dot_v * n_dot_v).max(0.0).sqrt();
    let count = f64::from(steps);
    let mut sum = 0.0;
    for across in 0..steps {
        // Steps are denser at grazing angles, which contribute most.
        let root = (f64::from(across) + 0.5) / count;
        let (n_dot_l, solid) = (root * root, 2.0 * root / count * 2.0 * PI / count);
        let level = (1.0 - n_dot_l * n_dot_l).sqrt();
        let share = visibility(alpha, n_dot_l, n_dot_v) * n_dot_l * solid;
        for around in 0..steps {
            let (sin, cos) = ((f64::from(around) + 0.5) / count * PI).sin_cos();
            let (x, y, z) = (level * cos + aside, level * sin, n_dot_l + n_dot_v);
            let flat = x * x + y * y;
            sum += distribution(alpha, flat / (flat + z * z)) * share;
        }
    }
    sum
}
