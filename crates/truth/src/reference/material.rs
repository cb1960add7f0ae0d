//! A hit as a surface: its material with all textures looked up, its normals turned to the eye.

use glam::{DVec3, DVec4, Vec3, Vec4};

use super::geometry::{Geometry, Hit, TracedObject};
use super::surface::{ShadingPoint, SurfaceLobes};
use afterlight_scene::{AlphaMode, Brdf, HIGHLIGHT, HIGHLIGHT_SHARE, Scene, TextureSlot};

/// The code of a normal map that stands for 0, and how many steps lie between it and 1.
const NORMAL_ZERO: f64 = 128.0;
const NORMAL_STEPS: f64 = 127.0;

/// A place on a part.
struct SurfacePoint<'a> {
    scene: &'a Scene,
    part: &'a TracedObject<'a>,
    triangle: u32,
    weights: [f64; 3],
}

impl SurfacePoint<'_> {
    /// The value of a slot's texture, if there is one.
    fn texture(&self, slot: TextureSlot) -> Option<DVec4> {
        self.part.texel(self.scene, slot, self.triangle, self.weights)
    }

    /// The value of a slot's texture, or 1 without one.
    fn texel(&self, slot: TextureSlot) -> DVec4 {
        self.texture(slot).unwrap_or(DVec4::ONE)
    }

    fn blend<T: std::iter::Sum>(&self, value: impl Fn(usize, f64) -> T) -> T {
        self.part
            .vertices(self.triangle)
            .into_iter()
            .zip(self.weights)
            .map(|(vertex, weight)| value(vertex, weight))
            .sum()
    }

    /// The lobes beside base and highlight, if this model has them.
    fn lobes(&self, model: Brdf, normal: DVec3) -> SurfaceLobes {
        let material = self.part.material;
        if !material.has_lobes(model) {
            return SurfaceLobes::NONE;
        }
        let (anisotropy, across) = self.anisotropy(normal);
        let (sheen, film) = (self.texel(TextureSlot::Sheen), self.texel(TextureSlot::Film));
        let [least, most] = material.film.nanometres.map(f64::from);
        let through = self.texel(TextureSlot::DiffuseTransmission);
        SurfaceLobes {
            sheen: material.sheen.color.as_dvec3() * sheen.truncate(),
            sheen_roughness: f64::from(material.sheen.roughness) * sheen.w,
            film: f64::from(material.film.strength) * film.x,
            film_ior: f64::from(material.film.ior),
            film_nanometres: least + (most - least) * film.y,
            anisotropy,
            across,
            transmitting: f64::from(material.diffuse_transmission.strength) * through.w,
            transmission: material.diffuse_transmission.color.as_dvec3() * through.truncate(),
        }
    }

    /// The interpolated normal, not yet turned to the eye.
    fn normal(&self) -> DVec3 {
        let normal = self.blend(|vertex, weight| Vec3::from(self.part.mesh.normals[vertex]).as_dvec3() * weight);
        unit_or(self.part.normals * normal, DVec3::Y)
    }

    /// The interpolated tangent, and the bitangent on a normal; zero where the mesh has none.
    fn tangents(&self, normal: DVec3) -> [DVec3; 2] {
        let tangents = &self.part.mesh.tangents;
        let tangent = self.blend(|vertex, weight| {
            let tangent = tangents.get(vertex).map_or(DVec4::ZERO, |&tangent| Vec4::from(tangent).as_dvec4());
            unit_or(self.part.along * tangent.truncate(), DVec3::ZERO).extend(tangent.w) * weight
        });
        let along = tangent.truncate();
        [along, normal.cross(along) * (tangent.w * self.part.handedness)]
    }

    /// How anisotropic the highlight is, and the direction in which it is rougher. A mesh without tangents has neither.
    fn anisotropy(&self, normal: DVec3) -> (f64, DVec3) {
        let own = self.part.material.anisotropy;
        let texel = self.texture(TextureSlot::Anisotropy);
        let [x, y, strength] = texel.map_or([1.0, 0.0, 1.0], |texel| {
            let codes = texel.truncate() * 255.0 - NORMAL_ZERO;
            let [x, y, _] = codes.map(|code| if code.abs() < 0.01 { 0.0 } else { code / NORMAL_STEPS }).to_array();
            [x, y, texel.z]
        });
        let (sin, cos) = f64::from(own.rotation).sin_cos();
        let [along, bitangent] = self.tangents(normal);
        let across = along * (cos * x - sin * y) + bitangent * (sin * x + cos * y);
        let is_there = across.length_squared() > 1e-12;
        if is_there { (f64::from(own.strength) * strength, across) } else { (0.0, DVec3::X) }
    }

    /// The normal with its map. MikkTSpace: the frames of vertices are unit, and the interpolated one is used as it is, neither made orthogonal nor unit
    /// (Mikkelsen 2008).
    fn mapped_normal(&self, normal: DVec3) -> DVec3 {
        let Some(texel) = self.texture(TextureSlot::Normal) else { return normal };
        let codes = texel.truncate() * 255.0 - NORMAL_ZERO;
        let scale = f64::from(self.part.material.normal_scale);
        let DVec3 { x, y, z } = codes.map(|code| if code.abs() < 0.01 { 0.0 } else { code / NORMAL_STEPS });
        let [x, y] = [x * scale, y * scale];
        if x == 0.0 && y == 0.0 && z > 0.0 {
            return normal;
        }
        let [along, bitangent] = self.tangents(normal);
        unit_or(along * x + bitangent * y + normal * z, normal)
    }
}

/// Normalizes a vector of any length; one without a finite length gives the fallback, and so does zero.
fn unit_or(vector: DVec3, fallback: DVec3) -> DVec3 {
    let largest = vector.abs().max_element();
    if largest > 0.0 && largest.is_finite() { (vector / largest).normalize() } else { fallback }
}

/// Returns the surface of a hit, and its alpha mode. `position` is relative to the camera; `brdf`, if given, replaces the model of all materials.
pub fn surface(
    scene: &Scene,
    geometry: &Geometry,
    hit: &Hit,
    position: DVec3,
    brdf: Option<Brdf>,
) -> (ShadingPoint, AlphaMode) {
    let part = geometry.object(hit);
    let triangle = geometry.triangles[hit.triangle].id.triangle;
    let place = SurfacePoint { scene, part, triangle, weights: hit.crossing.weights };
    let material = part.material;
    let brdf = material.model(brdf);
    let is_phong = matches!(brdf, Brdf::Phong | Brdf::BlinnPhong);

    let facing = if hit.front { 1.0 } else { -1.0 };
    let geometric_normal = place.normal();
    let normal = place.mapped_normal(geometric_normal);
    let tinted = material.base_color.as_dvec3() * part.look.tint.as_dvec3();
    let mut base = tinted.extend(f64::from(material.alpha))
        * place.texel(TextureSlot::BaseColor)
        * part.color(triangle, place.weights);
    if part.look.selected {
        base = base.truncate().lerp(HIGHLIGHT.as_dvec3(), f64::from(HIGHLIGHT_SHARE)).extend(base.w);
    }
    let is_coat = material.alpha_mode == AlphaMode::Coat;
    // An unlit surface emits its colour and reflects nothing. A coat is a lobe that reflects all light, of which a share is shown.
    let (albedo, emissive) = match material.unlit {
        _ if is_coat => (DVec3::ONE, DVec3::ZERO),
        true => (DVec3::ZERO, base.truncate()),
        false => {
            let glow = material.emissive.as_dvec3() * place.texel(TextureSlot::Emissive).truncate();
            (base.truncate(), glow)
        }
    };
    let shape = place.texel(TextureSlot::MetallicRoughness);
    let strength = match material.reflectance_texture() {
        Some(_) => place.texel(TextureSlot::Specular),
        None => DVec4::ONE,
    };
    let ambient = if is_phong { f64::from(material.ambient) } else { 1.0 };
    let surface = ShadingPoint {
        position,
        ray: None,
        normal: normal * facing,
        geometric_normal: geometric_normal * facing,
        brdf,
        albedo,
        metallic: if is_coat { 1.0 } else { f64::from(material.metallic) * shape.z },
        roughness: f64::from(material.roughness) * shape.y,
        specular: material.specular.as_dvec3() * place.texel(TextureSlot::Specular).truncate(),
        reflectance: material.reflectance.as_dvec3() * strength.truncate() * strength.w,
        grazing: f64::from(material.grazing) * strength.w,
        shininess: f64::from(material.shininess) * place.texel(TextureSlot::Shininess).y,
        lobes: place.lobes(brdf, geometric_normal),
        occlusion: ambient * place.texel(TextureSlot::Occlusion).x,
        emissive,
        alpha: if material.is_transparent() { base.w.clamp(0.0, 1.0) } else { 1.0 },
        receives_shadow: part.receives_shadow,
    };
    (surface, material.alpha_mode)
}
