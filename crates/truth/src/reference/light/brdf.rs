//! The reflection models, as base (light that enters the surface and comes out anywhere) and lobe (light that it mirrors).
//!
//! Limits: reflection at one point, without polarization and without light that is scattered several times between facets. The
//! base is uncoupled: together with the lobe it may reflect more than it gets, up to 1.26 for a white dielectric at grazing angles.

use glam::DVec3;
use nalgebra::Vector3;

use super::film::Film;
use super::grooves::{Grooves, grooves};
use super::real::{Real, unit, vector, widened};
use super::sheen::Fibres;
use super::transmission::split;
use crate::reference::{ShadingPoint, Smith, SurfaceLobes};
use afterlight_scene::Brdf;

/// Least perceptual roughness, part of the model.
pub const MIN_ROUGHNESS: f64 = 0.01;
/// Least cosine between normal and view, part of the model: mapped normals may face away.
pub const MIN_N_DOT_V: f64 = 1e-4;
/// Least base of the powers of the Phong models, part of the model: a power of 0 is 1 on the far side too.
pub const MIN_PHONG_COSINE: f64 = 1e-30;
/// Reflectance of a dielectric that faces the eye, part of the model.
pub const DIELECTRIC: f64 = 0.04;

/// In inverse steradians: times the arriving light and the cosine at the surface it is radiance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reflectance<R: Real> {
    /// The reflectance of the body.
    pub base: Vector3<R>,
    /// The reflectance of the specular lobe.
    pub lobe: Vector3<R>,
}

/// A surface that is seen from one direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Reflector<R: Real> {
    pub(super) brdf: Brdf,
    pub(super) normal: Vector3<R>,
    /// Unit vector towards the eye.
    pub(super) view: Vector3<R>,
    pub(super) n_dot_v: R,
    /// Diffuse albedo, without the metallic and the transmitting share.
    pub(super) diffuse: Vector3<R>,
    /// Diffuse albedo for light that arrives at the back.
    pub(super) through: Vector3<R>,
    /// F0 of Cook-Torrance, Ks of the Phong models.
    pub(super) specular: Vector3<R>,
    /// F90 of Cook-Torrance.
    pub(super) grazing: R,
    /// Perceptual, no less than [`MIN_ROUGHNESS`].
    pub(super) roughness: R,
    shininess: R,
    smith: Smith,
    pub(super) fibres: Option<Fibres<R>>,
    film: Option<Film>,
    grooves: Option<Grooves>,
    /// F0 for light from everywhere.
    pub(super) even: Vector3<R>,
    lobes: SurfaceLobes,
}

/// A [`Reflector`] in f64, for light from all directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Collector {
    /// The reflection model.
    pub brdf: Brdf,
    /// Unit vector.
    pub normal: DVec3,
    /// Unit vector towards the eye.
    pub view: DVec3,
    /// No less than [`MIN_N_DOT_V`].
    pub n_dot_v: f64,
    /// Diffuse albedo, without the metallic and the transmitting share.
    pub diffuse: DVec3,
    /// Diffuse albedo for light that arrives at the back.
    pub through: DVec3,
    /// F0 of Cook-Torrance.
    pub specular: DVec3,
    /// F0 for light from everywhere: under a thin film, the value with which Schlick's Fresnel gives the film's reflectance at the angle of the eye.
    pub even: DVec3,
    /// F90 of Cook-Torrance.
    pub grazing: f64,
    /// Perceptual, no less than [`MIN_ROUGHNESS`].
    pub roughness: f64,
    /// The lobes beside base and highlight.
    pub lobes: SurfaceLobes,
    film: Option<Film>,
    grooves: Option<Grooves>,
}

impl Collector {
    /// The lobes of Cook-Torrance for light from a direction, a unit vector on the normal's side, in inverse steradians.
    pub fn lobe(&self, light: DVec3) -> DVec3 {
        widened(self.reflector().reflect(&vector(light)).lobe)
    }

    /// The share of light that passes a facet below, by the cosine of its angle: a film lets the same share of all colours pass, or they would have the opposite colours.
    pub fn passed(&self, v_dot_h: f64) -> DVec3 {
        let rise = (1.0 - v_dot_h).max(0.0).powi(5);
        let fresnel = self.specular + (DVec3::splat(self.grazing) - self.specular) * rise;
        match &self.film {
            Some(film) => DVec3::splat(1.0 - film.reflectance(v_dot_h, fresnel).max_element()),
            None => DVec3::ONE - fresnel,
        }
    }

    /// A half vector about the normal, given for GGX about +Z.
    pub fn half(&self, facet: DVec3) -> DVec3 {
        if let Some(grooves) = &self.grooves {
            return grooves.stretched(facet, self.normal);
        }
        let (x, y) = self.normal.any_orthonormal_pair();
        x * facet.x + y * facet.y + self.normal * facet.z
    }

    /// Returns the density, per steradian, of half vectors where the highlight's facets are stretched; `None` where they are not.
    pub fn stretched_density(&self, half: DVec3) -> Option<f64> {
        self.grooves.as_ref().map(|grooves| grooves.density(half, self.normal))
    }

    /// The share of light from a direction, on either side, that other lobes leave to the base.
    pub fn left(&self, light: DVec3) -> f64 {
        let fibres = Fibres::<f64>::of(&self.lobes, self.n_dot_v);
        fibres.map_or(1.0, |fibres| fibres.left_of(self.normal.dot(light).abs()))
    }

    fn reflector(&self) -> Reflector<f64> {
        Reflector {
            brdf: self.brdf,
            normal: vector(self.normal),
            view: vector(self.view),
            n_dot_v: self.n_dot_v,
            diffuse: vector(self.diffuse),
            through: vector(self.through),
            specular: vector(self.specular),
            grazing: self.grazing,
            roughness: self.roughness,
            shininess: 0.0,
            smith: Smith::HeightCorrelated,
            fibres: Fibres::of(&self.lobes, self.n_dot_v),
            film: self.film,
            grooves: self.grooves,
            even: vector(self.even),
            lobes: self.lobes,
        }
    }
}

impl<R: Real> Reflector<R> {
    /// As light from all directions takes it.
    pub fn collector(&self) -> Collector {
        Collector {
            brdf: self.brdf,
            normal: widened(self.normal),
            view: widened(self.view),
            n_dot_v: self.n_dot_v.wide(),
            diffuse: widened(self.diffuse),
            through: widened(self.through),
            specular: widened(self.specular),
            even: widened(self.even),
            grazing: self.grazing.wide(),
            roughness: self.roughness.wide(),
            lobes: self.lobes,
            film: self.film,
            grooves: self.grooves,
        }
    }

    /// Returns the reflector of a surface as seen from the camera, to which its position is relative. A surface at the camera itself is seen from
    /// straight above.
    pub fn new(surface: &ShadingPoint, smith: Smith) -> Self {
        let normal: Vector3<R> = vector(surface.normal);
        let view = unit(&-vector::<R>(surface.ray.unwrap_or(surface.position))).unwrap_or(normal);
        let (albedo, metallic) = (vector::<R>(surface.albedo), R::of(surface.metallic));
        let (diffuse, specular) = match surface.brdf {
            Brdf::CookTorrance => {
                let dielectric = vector::<R>(surface.reflectance);
                (albedo * (R::one() - metallic), dielectric + (albedo - dielectric) * metallic)
            }
            Brdf::Phong | Brdf::BlinnPhong => (albedo, vector(surface.specular)),
            Brdf::Lambert => (albedo, Vector3::zeros()),
        };
        let n_dot_v = normal.dot(&view).max(R::of(MIN_N_DOT_V));
        let lobes = if surface.brdf == Brdf::CookTorrance { surface.lobes } else { SurfaceLobes::NONE };
        let (diffuse, through) = split(diffuse, &lobes, metallic);
        let grazing = R::one() - (R::one() - R::of(surface.grazing)) * (R::one() - metallic);
        let film = Film::of(&lobes, surface.reflectance, (surface.albedo, surface.metallic));
        let even = match &film {
            Some(film) => vector(film.even(n_dot_v.wide(), widened(specular), grazing.wide())),
            None => specular,
        };
        let roughness = R::of(surface.roughness).max(R::of(MIN_ROUGHNESS));
        Self {
            brdf: surface.brdf,
            grooves: grooves(&lobes, &normal, roughness),
            film,
            even,
            fibres: Fibres::of(&lobes, n_dot_v),
            lobes,
            n_dot_v,
            normal,
            view,
            diffuse,
            through,
            specular,
            grazing,
            roughness,
            shininess: R::of(surface.shininess),
            smith,
        }
    }

    /// Evaluates the surface for light from a direction, a unit vector on the normal's side.
    pub fn reflect(&self, light: &Vector3<R>) -> Reflectance<R> {
        let lambert = self.diffuse / R::PI();
        match self.brdf {
            Brdf::Lambert => Reflectance { base: lambert, lobe: Vector3::zeros() },
            Brdf::CookTorrance => {
                let fresnel = self.fresnel(light);
                let base = lambert.component_mul(&self.left_by_highlight(&fresnel));
                let below = Reflectance { base, lobe: fresnel * self.microfacets(light) };
                match &self.fibres {
                    Some(fibres) => fibres.over(below, (&self.normal, &self.view, self.n_dot_v), light),
                    None => below,
                }
            }
            Brdf::Phong => Reflectance { base: lambert, lobe: self.specular * self.phong(light) },
            Brdf::BlinnPhong => Reflectance { base: lambert, lobe: self.specular * self.blinn_phong(light) },
        }
    }

    /// Evaluates the surface for light from a direction, a unit vector on the other side than the normal's: the extension's `diffuse_btdf`, which is
    /// lambert's. The highlight leaves it the share that it leaves of light from the direction mirrored at the surface.
    pub fn transmit(&self, light: &Vector3<R>) -> Vector3<R> {
        let cosine = self.normal.dot(light);
        let mirrored = light - self.normal * (R::of(2.0) * cosine);
        let left = self.left_by_highlight(&self.fresnel(&mirrored));
        let base = (self.through / R::PI()).component_mul(&left);
        match &self.fibres {
            Some(fibres) => base * fibres.left_of(-cosine),
            None => base,
        }
    }

    /// The share of light that a highlight with this reflectance leaves to the base.
    fn left_by_highlight(&self, fresnel: &Vector3<R>) -> Vector3<R> {
        // The brightest channel of a film's reflectance darkens the base, or the base would have the opposite colour.
        let most = fresnel.x.max(fresnel.y).max(fresnel.z);
        let taken = if self.film.is_some() { Vector3::repeat(most) } else { *fresnel };
        taken.map(|share| R::one() - share)
    }

    /// Schlick's Fresnel, F0 + (F90 - F0)(1 - v.h)^5 (Schlick 1994, "An Inexpensive BRDF Model for Physically-based Rendering").
    fn fresnel(&self, light: &Vector3<R>) -> Vector3<R> {
        // |l + v|^2 = 2 + 2 l.v = 4 (v.h)^2 for unit vectors.
        let v_dot_h = super::real::length(&(light + self.view)) / R::of(2.0);
        let share = (R::one() - v_dot_h).max(R::zero()).powi(5);
        let bare = self.specular.map(|facing| facing + (self.grazing - facing) * share);
        match &self.film {
            Some(film) => vector(film.reflectance(v_dot_h.wide().min(1.0), widened(bare))),
            None => bare,
        }
    }

    /// D V of GGX: distribution of facets by Walter et al. 2007 ("Microfacet Models for Refraction through Rough Surfaces"), their
    /// masking and shadowing by Smith, divided by 4 n.l n.v.
    fn microfacets(&self, light: &Vector3<R>) -> R {
        if let Some(grooves) = &self.grooves {
            return grooves.microfacets((&self.normal, &self.view, self.n_dot_v), light);
        }
        // Light from the direction opposite to the view has no half vector, and the lobe does not reach there.
        let Some(half) = unit(&(light + self.view)) else { return R::zero() };
        let alpha = self.roughness * self.roughness;
        let across = self.normal.cross(&half);
        let (cosine, sine2) = (self.normal.dot(&half), across.dot(&across));
        distribution(alpha, cosine, sine2) * masking(alpha, self.normal.dot(light), self.n_dot_v, self.smith)
    }

    /// (r.v)^n (n + 2) / 2 pi, r the mirrored direction of the light (Phong 1975, "Illumination for Computer Generated Pictures"),
    /// scaled to an albedo of 1 where light and view face the surface (Akenine-Möller et al., Real-Time Rendering, section 9.8).
    fn phong(&self, light: &Vector3<R>) -> R {
        let two = R::of(2.0);
        let mirrored = self.normal * (two * self.normal.dot(light)) - light;
        power(mirrored.dot(&self.view), self.shininess) * (self.shininess + two) / (two * R::PI())
    }

    /// (n.h)^n (n + 8) / 8 pi (Blinn 1977, "Models of Light Reflection for Computer Synthesized Pictures"), scaled likewise.
    fn blinn_phong(&self, light: &Vector3<R>) -> R {
        let eight = R::of(8.0);
        let n_dot_h = unit(&(light + self.view)).map_or(R::zero(), |half| self.normal.dot(&half));
        power(n_dot_h, self.shininess) * (self.shininess + eight) / (eight * R::PI())
    }
}

/// alpha^2 / (pi (cos^2 alpha^2 + sin^2)^2) of the angle between normal and half vector: GGX, with the sine by itself so that nothing
/// cancels where the lobe is sharp.
fn distribution<R: Real>(alpha: R, cosine: R, sine2: R) -> R {
    let alpha2 = alpha * alpha;
    alpha2 / (R::PI() * (cosine * cosine * alpha2 + sine2).powi(2))
}

/// G / (4 n.l n.v) of Smith for GGX, where x + sqrt(x^2 + alpha^2 (1 - x^2)) is the part of one direction.
///
/// Height-correlated: Heitz 2014, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", equation 99. Separable: the
/// product of both directions' G1, as in Walter et al. 2007.
fn masking<R: Real>(alpha: R, n_dot_l: R, n_dot_v: R, smith: Smith) -> R {
    let root = |x: R| (x * x + alpha * alpha * (R::one() - x * x)).sqrt();
    match smith {
        Smith::HeightCorrelated => R::of(0.5) / (n_dot_l * root(n_dot_v) + n_dot_v * root(n_dot_l)),
        Smith::Separable => R::one() / ((n_dot_l + root(n_dot_l)) * (n_dot_v + root(n_dot_v))),
    }
}

fn power<R: Real>(cosine: R, exponent: R) -> R {
    // Rounding may take a cosine above 1, and a large power of that anywhere.
    cosine.max(R::of(MIN_PHONG_COSINE)).min(R::one()).powf(exponent)
}
