//! Particles of the truth: each at the place that its closed form gives in f64, lit at its middle by rays, and blended in exact order.
//!
//! A particle is a square that faces the view, so all of it is equally far along the view: particles never cross, and the order of their centres is
//! right for every pixel. It scatters light evenly to all sides: light of 1 lux becomes 1 / (4 pi) nits, and an even sky keeps its nits.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use glam::{DVec2, DVec3};

use super::fingerprint::Fingerprint;
use super::intersect::Ray;
use super::light::arriving;
use super::rays::CameraRays;
use super::render::{Points, Reference};
use super::shadow::Receiver;
use super::texture::{self, TextureRegion};
use afterlight_scene::emitter::on_square;
use afterlight_scene::{Emitter, Scene};

/// A particle that is lit, wherever it is seen from.
#[derive(Debug, Clone)]
pub(super) struct Lit {
    /// World position.
    position: DVec3,
    /// Half its edge in metres.
    half: f64,
    angle: f64,
    /// Nits, not times alpha.
    radiance: DVec3,
    alpha: f64,
    softness: f64,
    /// Texture, the columns and rows of its atlas, and the cell.
    texture: Option<(usize, [u32; 2], u32)>,
}

/// The particles before a camera, from the farthest to the nearest.
pub(super) struct Billboards<'a> {
    scene: &'a Scene,
    all: Vec<(f64, &'a Lit)>,
    /// For each row of the picture, the particles that may be visible there; `None` if any particle may be visible in any row.
    rows: Option<Vec<Vec<u32>>>,
    right: DVec3,
    up: DVec3,
    near: f64,
}

/// A particle that a ray meets.
pub(super) struct Layer {
    /// Along the view, in metres.
    pub distance: f64,
    pub radiance: DVec3,
    /// Alpha before the fade near surfaces.
    alpha: f64,
    softness: f64,
}

/// Adds the emitters and the moment.
pub(super) fn hash(scene: &Scene, fingerprint: &mut Fingerprint) {
    fingerprint.bytes(b"particles");
    fingerprint.real(scene.moment.unwrap_or(0.0));
    fingerprint.number(scene.emitters.len() as u64);
    for emitter in &scene.emitters {
        let Emitter {
            name: _,
            position,
            extent,
            rate,
            life,
            start,
            end,
            velocity,
            spread,
            gravity,
            drag,
            size,
            color,
            emission,
            lit,
            turn_degrees,
            spin_degrees,
            softness,
            texture,
            frames,
            picks_frame,
            seed,
        } = emitter;
        [position, extent, velocity, spread, gravity].into_iter().for_each(|own| fingerprint.vector(*own));
        [rate, life, drag, turn_degrees, spin_degrees, softness].into_iter().for_each(|own| fingerprint.real(*own));
        for moment in [start, end] {
            fingerprint.number(u64::from(moment.is_some()));
            fingerprint.real(moment.unwrap_or(0.0));
        }
        [size.len(), color.len(), emission.len()].into_iter().for_each(|count| fingerprint.number(count as u64));
        size.iter().chain(color.as_flattened()).for_each(|own| fingerprint.single(*own));
        emission.iter().for_each(|own| fingerprint.color(*own));
        fingerprint.slot(*texture);
        let numbers = [u32::from(*lit), frames[0], frames[1], u32::from(*picks_frame), *seed];
        numbers.into_iter().for_each(|own| fingerprint.number(u64::from(own)));
    }
}

impl Reference<'_> {
    /// The scene's particles as these rays see them.
    pub(super) fn billboards(&self, rays: &CameraRays) -> Billboards<'_> {
        Billboards::of(self.scene, self.lit_particles(), rays, rays.size.y as u32)
    }

    /// The scene's particles that one of these rays meets.
    pub(super) fn billboards_on(&self, ray: &Ray, rays: &CameraRays) -> Billboards<'_> {
        Billboards::met_by(self.scene, self.lit_particles(), rays, ray)
    }

    /// The scene's particles at its moment, where they are shown: lit once, when somebody looks.
    fn lit_particles(&self) -> &[Lit] {
        self.lit.get_or_init(|| self.light_particles())
    }

    fn light_particles(&self) -> Vec<Lit> {
        if !self.effects.particles {
            return Vec::new();
        }
        let time = self.scene.moment.unwrap_or(0.0);
        let alive = self.scene.emitters.iter().flat_map(|emitter| {
            let alive = emitter.alive(time);
            (alive.first..alive.first + i64::from(alive.count))
                .map(move |number| (emitter, emitter.particle(number, time)))
        });
        let lit = alive.filter(|(_, own)| own.size > 0.0 && own.alpha > 0.0).map(|(emitter, own)| {
            let light = if emitter.lit { own.color * self.scattered(own.position) } else { DVec3::ZERO };
            Lit {
                position: own.position,
                half: own.size * 0.5,
                angle: own.angle,
                radiance: light + own.emission,
                alpha: own.alpha,
                softness: emitter.softness,
                texture: emitter.texture.map(|texture| (texture, emitter.frames, own.frame)),
            }
        });
        lit.collect()
    }

    /// Returns the light that a white particle scatters.
    fn scattered(&self, position: DVec3) -> DVec3 {
        let (even, _) = self.scene.environment.hemispheres();
        let sky = self.scene.sky.as_ref().filter(|sky| sky.lights && self.sky_light);
        let around = even.as_dvec3() + sky.map_or(DVec3::ZERO, |sky| sky.mean().as_dvec3());
        let receiver = Receiver::floating(position);
        self.lights.iter().enumerate().fold(around, |sum, (index, light)| {
            let (_, strength) = arriving(light, position);
            let casts = self.shadows && light.casts_shadow && strength > 0.0;
            let visible = if casts { self.share(&receiver, index, Points::All) } else { DVec3::ONE };
            sum + light.color.as_dvec3() * (f64::from(light.intensity) * strength * visible / (4.0 * PI))
        })
    }
}

impl<'a> Billboards<'a> {
    /// Seen by these rays. `height`: rows of the picture.
    pub fn of(scene: &'a Scene, lit: &'a [Lit], rays: &CameraRays, height: u32) -> Self {
        let mut own = Self::before(scene, lit, rays);
        own.sort();
        let eye = rays.axes()[3];
        own.rows = rays.sees_through_a_point().then(|| {
            let mut rows = vec![Vec::new(); height as usize];
            for (index, (distance, lit)) in (0u32..).zip(&own.all) {
                let reach = lit.half / FRAC_1_SQRT_2;
                let middle = rays.seen_at(lit.position - eye).y;
                let pixels = reach * rays.pixels_a_metre(*distance) + 1.0;
                let first = (middle - pixels).clamp(0.0, f64::from(height)) as usize;
                let last = (middle + pixels).ceil().clamp(0.0, f64::from(height)) as usize;
                rows[first..last].iter_mut().for_each(|row| row.push(index));
            }
            rows
        });
        own
    }

    /// Returns only the particles that one ray meets.
    pub fn met_by(scene: &'a Scene, lit: &'a [Lit], rays: &CameraRays, ray: &Ray) -> Self {
        let mut own = Self::before(scene, lit, rays);
        let met: Vec<_> =
            (0..own.all.len()).filter(|&index| own.layer(index, ray).is_some()).map(|index| own.all[index]).collect();
        own.all = met;
        own.sort();
        own
    }

    /// Returns the particles beyond the near plane, in the order of the emitters.
    fn before(scene: &'a Scene, lit: &'a [Lit], rays: &CameraRays) -> Self {
        let [right, up, forward, eye] = rays.axes();
        let all = lit.iter().map(|own| ((own.position - eye).dot(forward), own));
        let all = all.filter(|(distance, _)| *distance > rays.near).collect();
        Self { scene, all, rows: None, right, up, near: rays.near }
    }

    /// A stable sort: of equally far particles, the first emitter's and the oldest lie behind, as in the renderer.
    fn sort(&mut self) {
        self.all.sort_by(|a, b| b.0.total_cmp(&a.0));
    }

    pub fn near(&self) -> f64 {
        self.near
    }

    /// Returns the particles on a ray through this row of the picture, from the farthest to the nearest.
    pub fn met(&self, ray: &Ray, row: usize) -> impl Iterator<Item = Layer> {
        let of_row = self.rows.as_ref().map_or(&[][..], |rows| &rows[row]);
        let all = if self.rows.is_some() { 0..0 } else { 0..self.all.len() as u32 };
        of_row.iter().copied().chain(all).filter_map(|index| self.layer(index as usize, ray))
    }

    fn layer(&self, index: usize, ray: &Ray) -> Option<Layer> {
        let (distance, own) = self.all[index];
        // Rays are one metre long along the view.
        let off = ray.origin + ray.direction * distance - own.position;
        let across = DVec2::new(off.dot(self.right), off.dot(self.up)) / own.half;
        let square = on_square(across, own.angle);
        if square.abs().max_element() > 1.0 {
            return None;
        }
        let texel = match own.texture {
            Some((index, [columns, rows], cell)) => {
                let texture = &self.scene.textures[index];
                let uv = DVec2::new(square.x, -square.y) * 0.5 + 0.5;
                texture::sample(texture, TextureRegion::cell(texture, [rows, columns], cell), uv)
            }
            None => DVec3::ONE.extend((1.0 - square.length_squared()).max(0.0).powi(2)),
        };
        let radiance = own.radiance * texel.truncate();
        Some(Layer { distance, radiance, alpha: own.alpha * texel.w, softness: own.softness })
    }

    /// Blends a layer over the light behind it; the layer fades before a surface at the distance `surface` along the view.
    pub fn over(&self, layer: &Layer, surface: f64, behind: DVec3) -> DVec3 {
        let room = (surface - layer.distance).min(layer.distance - self.near);
        let fade = match layer.softness > 0.0 {
            true => (room / layer.softness).clamp(0.0, 1.0),
            false => f64::from(u8::from(room > 0.0)),
        };
        let alpha = (layer.alpha * fade).clamp(0.0, 1.0);
        layer.radiance * alpha + behind * (1.0 - alpha)
    }
}
