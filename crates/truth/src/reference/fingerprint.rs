//! A hash of everything that a truth depends on.
//!
//! Structures are taken apart whole, so that a field that is added to the scene does not compile until it is hashed, or named here as one on
//! which no light depends.

use glam::{DAffine3, DVec2, DVec3, Vec3};

use super::render::Reference;
use super::{CameraView, Smith, TruthOptions};
use afterlight_scene::{
    AlphaMode, Anisotropy, Brdf, Camera, CastsShadow, ColorSpace, DiffuseTransmission, Environment, Light, Look,
    Material, Mesh, Object, Projection, Refraction, Sampler, Scene, Sky, SkyImage, SunDisc, Texels, Texture,
    TextureSlot, ThinFilm, ThinLens, UvMap,
};

#[cfg(test)]
mod tests;

/// The model: to be raised with every change of a formula, a sequence or a rule after which a picture may differ. A test has figures of it.
const MODEL: u64 = 2;

pub(super) struct Fingerprint(blake3::Hasher);

impl Fingerprint {
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.number(bytes.len() as u64);
        self.0.update(bytes);
    }

    pub fn number(&mut self, number: u64) {
        self.0.update(&number.to_le_bytes());
    }

    pub fn real(&mut self, real: f64) {
        self.number(real.to_bits());
    }

    pub fn single(&mut self, real: f32) {
        self.real(f64::from(real));
    }

    pub fn color(&mut self, color: Vec3) {
        color.to_array().into_iter().for_each(|channel| self.single(channel));
    }

    pub fn vector(&mut self, vector: DVec3) {
        vector.to_array().into_iter().for_each(|coordinate| self.real(coordinate));
    }

    pub fn slot(&mut self, slot: Option<usize>) {
        self.number(slot.map_or(0, |index| index as u64 + 1));
    }

    fn transform(&mut self, transform: &DAffine3) {
        transform.to_cols_array().into_iter().for_each(|entry| self.real(entry));
    }

    fn mesh(&mut self, mesh: &Mesh) {
        // The bounds follow from the positions. A scene at a time has its deformed meshes as plain ones.
        let Mesh { name: _, origin, positions, normals, uvs, tangents, uvs_1, colors, indices, is_strokes, .. } = mesh;
        self.vector(*origin);
        self.bytes(bytemuck::cast_slice(positions));
        self.bytes(bytemuck::cast_slice(normals));
        self.bytes(bytemuck::cast_slice(uvs));
        self.bytes(bytemuck::cast_slice(tangents));
        self.bytes(bytemuck::cast_slice(uvs_1));
        self.bytes(bytemuck::cast_slice(colors));
        self.bytes(bytemuck::cast_slice(indices));
        // Truths of triangles keep the hashes that they had before there were points and lines.
        if *is_strokes {
            self.bytes(b"strokes");
        }
    }

    fn object(&mut self, object: &Object) {
        let Object {
            name: _,
            mesh,
            material,
            transform,
            casts_shadow,
            receives_shadow,
            node: _,
            skin: _,
            movable: _,
            look,
        } = object;
        self.number(*mesh as u64);
        self.number(*material as u64);
        self.transform(transform);
        self.number(match casts_shadow {
            CastsShadow::No => 0,
            CastsShadow::Front => 1,
            CastsShadow::Yes => 2,
        });
        // Truths of objects that look plain have the hashes that they had before there were looks.
        let look = look.filter(|own| *own != Look::PLAIN);
        self.number(u64::from(*receives_shadow) | u64::from(look.is_some()) << 1);
        if let Some(Look { cell, tint, selected }) = look {
            self.number(u64::from(cell));
            self.color(tint);
            self.number(u64::from(selected));
        }
    }

    fn material(&mut self, material: &Material) {
        let Material {
            name: _,
            brdf,
            base_color,
            alpha,
            alpha_mode,
            metallic,
            roughness,
            specular,
            reflectance,
            grazing,
            shininess,
            ambient,
            emissive,
            normal_scale,
            two_sided,
            sheen,
            film,
            anisotropy,
            refraction,
            unlit,
            atlas,
            uv_maps,
            base_color_texture,
            normal_texture,
            metallic_roughness_texture,
            occlusion_texture,
            emissive_texture,
            specular_texture,
            shininess_texture,
            sheen_texture,
            film_texture,
            anisotropy_texture,
            diffuse_transmission,
            diffuse_transmission_texture,
        } = material;
        self.brdf(Some(*brdf));
        [base_color, specular, reflectance, emissive].into_iter().for_each(|color| self.color(*color));
        [alpha, metallic, roughness, grazing, shininess, ambient, normal_scale]
            .into_iter()
            .for_each(|factor| self.single(*factor));
        let (mode, cutoff) = match alpha_mode {
            AlphaMode::Opaque => (0, 0.0),
            AlphaMode::Mask { cutoff } => (1, *cutoff),
            AlphaMode::Blend => (2, 0.0),
            AlphaMode::Glass => (3, 0.0),
            AlphaMode::Coat => (4, 0.0),
        };
        self.number(mode);
        self.single(cutoff);
        self.number(u64::from(*two_sided));
        let has_atlas = *atlas != [1, 1];
        self.number(u64::from(*unlit) | u64::from(has_atlas) << 1);
        atlas.iter().filter(|_| has_atlas).for_each(|&edge| self.number(u64::from(edge)));
        uv_maps[..TextureSlot::STORED].iter().for_each(|map| self.uv_map(map));
        let slots = [base_color_texture, normal_texture, metallic_roughness_texture, occlusion_texture];
        slots
            .into_iter()
            .chain([emissive_texture, specular_texture, shininess_texture])
            .for_each(|slot| self.slot(*slot));
        // Truths that were kept before there were lobes stay true.
        if sheen.is_seen() {
            self.number(1);
            self.color(sheen.color);
            self.single(sheen.roughness);
            self.uv_map(&uv_maps[TextureSlot::Sheen as usize]);
            self.slot(*sheen_texture);
        }
        if film.is_seen() {
            self.number(2);
            let ThinFilm { strength, ior, nanometres: [least, most] } = film;
            [strength, ior, least, most].into_iter().for_each(|value| self.single(*value));
            self.uv_map(&uv_maps[TextureSlot::Film as usize]);
            self.slot(*film_texture);
        }
        if anisotropy.is_seen() {
            self.number(3);
            let Anisotropy { strength, rotation } = anisotropy;
            [strength, rotation].into_iter().for_each(|value| self.single(*value));
            self.uv_map(&uv_maps[TextureSlot::Anisotropy as usize]);
            self.slot(*anisotropy_texture);
        }
        if let Some(Refraction { ior, thickness, color, distance, dispersion }) = refraction {
            self.number(4);
            self.color(*color);
            // The truth finds the thickness by rays, and asks only if there is any.
            [*ior, f32::from(*thickness > 0.0), *distance, *dispersion]
                .into_iter()
                .for_each(|value| self.single(value));
        }
        if diffuse_transmission.is_seen() {
            self.number(5);
            let DiffuseTransmission { strength, color } = diffuse_transmission;
            self.single(*strength);
            self.color(*color);
            self.uv_map(&uv_maps[TextureSlot::DiffuseTransmission as usize]);
            self.slot(*diffuse_transmission_texture);
        }
    }

    fn uv_map(&mut self, UvMap { set, offset, rotation, scale }: &UvMap) {
        self.number(u64::from(*set));
        [offset.x, offset.y, *rotation, scale.x, scale.y].into_iter().for_each(|value| self.real(value));
    }

    fn brdf(&mut self, brdf: Option<Brdf>) {
        self.number(match brdf {
            None => 0,
            Some(Brdf::CookTorrance) => 1,
            Some(Brdf::Phong) => 2,
            Some(Brdf::BlinnPhong) => 3,
            Some(Brdf::Lambert) => 4,
        });
    }

    fn texture(&mut self, texture: &Texture) {
        let Texture { name: _, size, color_space, sampler, texels } = texture;
        let Sampler { wrap, magnify, minify, levels } = sampler;
        wrap.iter().for_each(|&wrap| self.number(wrap as u64));
        [Some(*magnify), Some(*minify), *levels]
            .iter()
            .for_each(|filter| self.number(filter.map_or(0, |own| own as u64 + 1)));
        size.iter().for_each(|&edge| self.number(u64::from(edge)));
        self.number(u64::from(*color_space == ColorSpace::Srgb));
        match texels {
            Texels::Rgba8(texels) => self.bytes(texels),
            // The truth looks at level 0 alone.
            Texels::Rgba8Levels(levels) => self.bytes(&levels[0]),
            Texels::Blocks { format, levels } => {
                self.number(*format as u64);
                self.bytes(&levels[0]);
            }
        }
    }

    fn light(&mut self, light: &Light) {
        let Light { name: _, kind, color, intensity, casts_shadow, size } = light;
        let form = kind.form();
        self.number(form.number);
        form.numbers().into_iter().flat_map(|(_, numbers)| numbers).for_each(|number| self.real(number));
        if let Some(falloff) = form.falloff {
            self.number(u64::from(falloff.index()));
            falloff.terms().into_iter().for_each(|term| self.single(term));
        }
        self.color(*color);
        self.single(*intensity);
        self.number(u64::from(*casts_shadow));
        self.real(*size);
    }

    fn scene(&mut self, scene: &Scene) {
        // The view brings the camera; the settings are the renderer's.
        let Scene {
            name: _,
            meshes,
            objects,
            materials,
            textures,
            lights,
            environment,
            sky,
            camera: _,
            cameras: _,
            looks_through: _,
            motion: _,
            // The effect that shows them hashes them and the moment.
            emitters: _,
            moment: _,
            fitted: _,
            settings: _,
            warnings: _,
            files: _,
        } = scene;
        let counts = [meshes.len(), objects.len(), materials.len(), textures.len(), lights.len()];
        counts.into_iter().for_each(|count| self.number(count as u64));
        meshes.iter().for_each(|mesh| self.mesh(mesh));
        objects.iter().for_each(|object| self.object(object));
        materials.iter().for_each(|material| self.material(material));
        textures.iter().for_each(|texture| self.texture(texture));
        lights.iter().for_each(|light| self.light(light));
        let Environment { ambient, ground, background } = environment;
        self.color(*ambient);
        self.number(u64::from(ground.is_some()));
        self.color(ground.unwrap_or(Vec3::ZERO));
        self.color(*background);
        if let Some(sky) = sky {
            self.sky(sky);
        }
    }

    fn sky(&mut self, sky: &Sky) {
        let Sky { image, rotation_degrees, nits, lights, shown, sun } = sky;
        let SkyImage { name: _, size, texels, origin: _ } = &**image;
        size.iter().for_each(|&edge| self.number(u64::from(edge)));
        self.0.update(bytemuck::cast_slice(texels));
        self.real(*rotation_degrees);
        self.single(*nits);
        self.number(u64::from(*lights));
        // Truths that were kept before skies could be hidden stay true.
        if !shown {
            self.number(1);
        }
        if let Some(SunDisc { direction, degrees, radiance }) = sun {
            self.vector(*direction);
            self.real(*degrees);
            self.color(*radiance);
        }
    }

    fn view(&mut self, view: &CameraView) {
        let CameraView { camera, size } = view;
        let Camera { position, rotation, projection, near, shift } = camera;
        self.vector(*position);
        rotation.to_array().into_iter().for_each(|entry| self.real(entry));
        let (kind, extent) = match *projection {
            Projection::Perspective { fov_y_degrees } => (0, fov_y_degrees),
            Projection::Orthographic { height } => (1, height),
        };
        self.number(kind);
        self.real(extent);
        self.real(*near);
        size.iter().for_each(|&edge| self.number(u64::from(edge)));
        // Truths that were kept before there were lenses stay true.
        if *shift != DVec2::ZERO {
            shift.to_array().into_iter().for_each(|slope| self.real(slope));
        }
    }
}

/// The hash of a truth, the same for any number of samples: they go on from one another.
pub fn of(reference: &Reference, view: &CameraView, options: &TruthOptions) -> blake3::Hash {
    let mut fingerprint = Fingerprint(blake3::Hasher::new());
    fingerprint.number(MODEL);
    fingerprint.scene(reference.scene);
    fingerprint.brdf(reference.brdf);
    fingerprint.number(u64::from(reference.shadows));
    if reference.scene.sky.is_some() {
        fingerprint.number(u64::from(reference.sky_light));
        fingerprint.number(u64::from(reference.occludes_sky));
    }
    reference.effects.hash(reference.scene, &mut fingerprint);
    fingerprint.view(view);
    let TruthOptions { mode, smith } = options;
    fingerprint.number(u64::from(*mode == super::Mode::Point));
    fingerprint.number(match smith {
        Smith::HeightCorrelated => 0,
        Smith::Separable => 1,
    });
    if let Some(ThinLens { radius, focus }) = reference.lens {
        [radius, focus].into_iter().for_each(|metres| fingerprint.real(metres));
    }
    fingerprint.0.finalize()
}

impl Reference<'_> {
    /// A hash of all that a truth depends on, in hexadecimal digits.
    pub fn fingerprint(&self, view: &CameraView, options: &TruthOptions) -> String {
        of(self, view, options).to_hex().to_string()
    }
}
