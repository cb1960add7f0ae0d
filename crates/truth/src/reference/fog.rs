//! Fog in f64. At a height h it removes the share density exp(-(h - base) / height) of the light per metre, and scatters `albedo` of the removed
//! light. Light from everywhere counts as its mean, and directional light reaches the fog without loss.
//!
//! Fog of the kind `height` ignores shadows, so the light that a ray gains in endless fog is proportional to the light that it loses: both are closed
//! forms.

use std::f64::consts::PI;

use glam::DVec3;

use super::fingerprint::Fingerprint;
use afterlight_scene::{Environment, Fog, Light, LightForm, Settings, Sky};

/// The fog of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Medium {
    /// Never `Off`.
    pub kind: Fog,
    /// Extinction at `base`, in 1/m.
    pub density: f64,
    /// Metres of height over which the extinction falls by a factor of e.
    pub height: f64,
    /// Metres above the world's origin.
    pub base: f64,
    /// The share of the lost light that is scattered.
    pub albedo: f64,
    /// The mean cosine of the angle of scattering.
    pub anisotropy: f64,
}

/// The effect of a part of a ray on light that comes along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passage {
    /// The share of the light that is left.
    pub left: f64,
    /// The light scattered into the ray that arrives, in nits.
    pub gained: DVec3,
}

impl Medium {
    /// As the settings say; none where the air is clear.
    pub fn of(settings: &Settings) -> Option<Self> {
        let own = Self {
            kind: settings.fog,
            density: f64::from(settings.fog_density),
            height: f64::from(settings.fog_height),
            base: f64::from(settings.fog_base),
            albedo: f64::from(settings.fog_albedo),
            anisotropy: f64::from(settings.fog_anisotropy),
        };
        (own.kind != Fog::Off && own.density > 0.0).then_some(own)
    }

    /// Adds all of it.
    pub(super) fn hash(&self, fingerprint: &mut Fingerprint) {
        let Self { kind, density, height, base, albedo, anisotropy } = *self;
        fingerprint.bytes(kind.name().as_bytes());
        [density, height, base, albedo, anisotropy].into_iter().for_each(|number| fingerprint.real(number));
    }

    /// Returns the extinction at a height, in 1/m.
    pub fn extinction(&self, height: f64) -> f64 {
        self.density * (-(height - self.base) / self.height).exp()
    }

    /// Returns the optical depth of `metres` of a ray that begins at the height `from` and climbs by `climb` per metre. The depth of an endless ray
    /// is finite only if the ray climbs.
    pub fn optical_depth(&self, from: f64, climb: f64, metres: f64) -> f64 {
        if metres <= 0.0 {
            return 0.0;
        }
        if metres == f64::INFINITY {
            return if climb > 0.0 { self.extinction(from) * self.height / climb } else { f64::INFINITY };
        }
        let scales = climb * metres / self.height;
        // Begins at the lower end: the depth is the same either way, and no intermediate term overflows unless the result does.
        let lower = if scales < 0.0 { from + climb * metres } else { from };
        let scales = scales.abs();
        let mean = if scales == 0.0 { 1.0 } else { -(-scales).exp_m1() / scales };
        self.extinction(lower) * metres * mean
    }

    /// The share of scattered light that leaves by an angle of this cosine for each steradian (Henyey and Greenstein 1941).
    pub fn phase(&self, cosine: f64) -> f64 {
        let g = self.anisotropy;
        (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5))
    }

    /// Returns the radiance of endless fog without shadows against a direction of length 1, in nits. `sky` is the one that lights the scene.
    pub fn light(&self, direction: DVec3, environment: &Environment, sky: Option<&Sky>, lights: &[Light]) -> DVec3 {
        let everywhere = self.from_everywhere(environment, sky);
        let suns = lights.iter().filter_map(|light| match light.kind.form() {
            LightForm { place: None, direction: Some(travels), .. } => {
                let color = light.color.as_dvec3() * f64::from(light.intensity);
                Some(color * self.phase(-travels.normalize().dot(direction)))
            }
            _ => None,
        });
        everywhere + suns.sum::<DVec3>() * self.albedo
    }

    /// Returns the light that it scatters of ambient light and the sky's.
    pub fn from_everywhere(&self, environment: &Environment, sky: Option<&Sky>) -> DVec3 {
        let below = environment.ground.unwrap_or(environment.ambient).as_dvec3();
        let mean =
            (environment.ambient.as_dvec3() + below) / 2.0 + sky.map_or(DVec3::ZERO, |sky| sky.mean().as_dvec3());
        mean * self.albedo
    }

    /// Of a part of a ray without shadows, of this optical depth, where endless fog sends `light`.
    pub fn passage(depth: f64, light: DVec3) -> Passage {
        Passage { left: (-depth).exp(), gained: light * -(-depth).exp_m1() }
    }
}

impl Passage {
    /// Nothing is lost or gained.
    pub const CLEAR: Self = Self { left: 1.0, gained: DVec3::ZERO };

    /// Returns the outgoing light for this incoming light.
    pub fn of(&self, light: DVec3) -> DVec3 {
        light * self.left + self.gained
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn medium(density: f64, height: f64) -> Medium {
        Medium { kind: Fog::Height, density, height, base: 3.0, albedo: 1.0, anisotropy: 0.6 }
    }

    /// Gauss and Legendre's five points on each of many parts.
    fn integral(from: f64, to: f64, parts: u32, value: impl Fn(f64) -> f64) -> f64 {
        const POINTS: [(f64, f64); 5] = [
            (0.0, 128.0 / 225.0),
            (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
            (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
            (0.906_179_845_938_664, 0.236_926_885_056_189_1),
            (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
        ];
        let half = (to - from) / f64::from(parts) / 2.0;
        let middle = |part: u32| from + (f64::from(part) * 2.0 + 1.0) * half;
        let at = |part, (place, weight): (f64, f64)| weight * value(middle(part) + place * half);
        (0..parts).flat_map(|part| POINTS.map(|point| at(part, point))).sum::<f64>() * half
    }

    #[test]
    fn the_closed_form_is_the_integral_of_the_extinction() {
        let mut tried = 0;
        for height in [0.5, 20.0, 5000.0] {
            for climb in [-1.0, -0.3, -1e-3, -1e-9, 0.0, 1e-12, 1e-6, 0.01, 0.7, 1.0] {
                for from in [-2.0, 3.0, 40.0] {
                    for metres in [0.0, 1e-6, 1.0, 30.0, 900.0] {
                        let fog = medium(0.02, height);
                        let found = fog.optical_depth(from, climb, metres);
                        // A part for each half of a scale height, at least.
                        let parts = 16 + (2.0 * metres * climb.abs() / height) as u32;
                        let wanted = integral(0.0, metres, parts, |t| fog.extinction(from + climb * t));
                        let error = if found == wanted { 0.0 } else { (found / wanted - 1.0).abs() };
                        assert!(error < 1e-6, "{height} {climb} {from} {metres}: {found} instead of {wanted}");
                        tried += 1;
                    }
                }
            }
        }
        assert_eq!(tried, 450);
    }

    #[test]
    fn endless_rays_are_what_long_ones_come_to() {
        let fog = medium(0.02, 20.0);
        for climb in [1e-3, 0.1, 1.0] {
            let (long, endless) = [1e7, f64::INFINITY].map(|metres| fog.optical_depth(5.0, climb, metres)).into();
            assert!(((long - endless) / endless).abs() < 1e-9 && endless.is_finite(), "{climb}: {long} {endless}");
        }
        for climb in [0.0, -1e-9, -1.0] {
            assert_eq!(fog.optical_depth(5.0, climb, f64::INFINITY), f64::INFINITY);
        }
        // Far above the fog and far below its base nothing is no number.
        for from in [-1e6, 1e6] {
            for climb in [-1.0, 0.0, 1.0] {
                for metres in [0.0, 1.0, 1e12, f64::INFINITY] {
                    let depth = fog.optical_depth(from, climb, metres);
                    let Passage { left, gained } = Medium::passage(depth, DVec3::ONE);
                    assert!(
                        (0.0..=1.0).contains(&left) && (left + gained.x - 1.0).abs() < 1e-15,
                        "{from} {climb} {metres}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_phase_has_all_of_the_light_and_the_mean_cosine_that_is_asked_for() {
        for anisotropy in [-0.9, -0.3, 0.0, 0.6, 0.9] {
            let fog = Medium { anisotropy, ..medium(1.0, 1.0) };
            let share = integral(-1.0, 1.0, 4000, |cosine| 2.0 * PI * fog.phase(cosine));
            let mean = integral(-1.0, 1.0, 4000, |cosine| 2.0 * PI * cosine * fog.phase(cosine));
            assert!((share - 1.0).abs() < 1e-9 && (mean - anisotropy).abs() < 1e-9, "{anisotropy}: {share} {mean}");
        }
    }

    #[test]
    fn two_parts_of_a_ray_are_the_whole_of_it() {
        let (fog, light) = (medium(0.05, 20.0), DVec3::new(100.0, 50.0, 20.0));
        let part = |from: f64, to: f64| {
            let depth = fog.optical_depth(1.0 + 0.2 * from, 0.2, to - from);
            Medium::passage(depth, light)
        };
        let behind = DVec3::new(3.0, 400.0, 0.0);
        let (whole, parted) = (part(0.0, 60.0).of(behind), part(0.0, 17.0).of(part(17.0, 60.0).of(behind)));
        assert!((whole - parted).abs().max_element() < 1e-12 * 400.0);
    }
}
