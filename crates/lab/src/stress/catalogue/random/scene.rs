//! A random scene, put together.

use glam::{DAffine3, DQuat, DVec3, Vec3};

use super::super::super::Subject;
use super::super::stage::{even_texture, waves};
use super::extremes::{Extremes, Falling};
use afterlight::scene::builtin::shapes;
use afterlight::scene::builtin::stage::SceneBuilder;
use afterlight::scene::{
    AlphaMode, Camera, Environment, Falloff, GbufferChoice, Light, LightKind, Material, Projection, SettingsPatch,
};

impl Extremes {
    /// The scene and its settings.
    pub fn subject(&self) -> Subject {
        let mut stage = SceneBuilder::default();
        self.add_surfaces(&mut stage);
        (0..self.lamps).for_each(|index| stage.light(self.lamp(index)));
        if self.sun_lux > 0.0 {
            stage.sun(DVec3::new(0.3, -1.0, -0.2), self.sun_lux as f32, Vec3::ONE, self.shadows);
        }
        stage.scene.environment = Environment {
            ambient: Vec3::splat(self.ambient * self.lux as f32),
            ground: None,
            background: Vec3::splat(self.background * self.lux as f32),
        };
        let (eye, target) = (self.at(DVec3::from(self.eye)), self.at(DVec3::new(0.0, 0.4, 0.0)));
        let mut camera = Camera {
            projection: Projection::perspective(self.fov_y_degrees),
            near: self.near * self.scale,
            ..Camera::looking_at(eye, target, DVec3::Y)
        };
        if self.parallel {
            camera.projection = Projection::orthographic(2.0 * camera.half_height() * eye.distance(target));
        }
        stage.scene.camera = camera;
        Subject::with(stage.scene, self.settings())
    }

    /// A place of the scene in the world.
    fn at(&self, place: DVec3) -> DVec3 {
        place * self.scale + DVec3::splat(self.offset)
    }

    fn add_surfaces(&self, stage: &mut SceneBuilder) {
        let material = self.material(stage);
        let opaque = Material { alpha_mode: AlphaMode::Opaque, ..material.clone() };
        let (of_floor, of_ball) = (stage.material(opaque), stage.material(material));
        let repeats = self.repeats.unwrap_or(1.0);
        let place = |turn: DQuat, stretch: DVec3, at: DVec3| {
            DAffine3::from_scale_rotation_translation(stretch * self.scale, turn, self.at(at))
        };
        let floor = stage.mesh("floor", shapes::plane([8.0, 8.0]).scale_uvs(8.0 * repeats), of_floor);
        stage.place(floor, of_floor, place(DQuat::IDENTITY, DVec3::ONE, DVec3::ZERO));
        let ball = stage.mesh("ball", shapes::sphere(0.5, 24).scale_uvs(repeats), of_ball);
        stage.place(ball, of_ball, place(DQuat::from_rotation_z(0.5), DVec3::from(self.stretch), DVec3::Y));
    }

    fn material(&self, stage: &mut SceneBuilder) -> Material {
        Material {
            name: "random".into(),
            brdf: self.brdf,
            base_color: self.base_color,
            alpha: self.alpha,
            alpha_mode: self.alpha_mode,
            metallic: self.metallic,
            roughness: self.roughness,
            specular: self.specular,
            shininess: self.shininess,
            emissive: Vec3::splat(self.glow * self.lux as f32),
            normal_scale: self.normal_scale,
            two_sided: self.two_sided,
            base_color_texture: self.repeats.and_then(|_| stage.texture(waves())),
            normal_texture: self.bump.and_then(|texel| stage.texture(even_texture(texel))),
            ..Material::default()
        }
    }

    /// One of the lamps, which stand in a spiral around the first.
    fn lamp(&self, index: u32) -> Light {
        let golden = f64::from(index) * 2.399_963;
        let around = DVec3::new(golden.cos(), 0.0, golden.sin()) * (0.4 * f64::from(index).sqrt());
        let position = self.at(DVec3::new(0.3, self.distance, 0.2) + around);
        let range = self.range.map(|range| range * self.scale);
        let falloff = match self.falloff {
            Falling::InverseSquare => Falloff::InverseSquare,
            Falling::Quadratic => Falloff::Quadratic,
            Falling::Polynomial => Falloff::Polynomial { constant: 1.0, linear: 1.0, quadratic: 1.0 },
        };
        let kind = match self.cone {
            None => LightKind::Point { position, range, falloff },
            Some([inner_angle_degrees, outer_angle_degrees]) => LightKind::Spot {
                position,
                direction: DVec3::NEG_Y,
                inner_angle_degrees,
                outer_angle_degrees,
                range,
                falloff,
            },
        };
        let [r, g, b] = self.lamp_color.to_array();
        // Each next one has the channels of the one before, moved on.
        let color = [Vec3::new(r, g, b), Vec3::new(g, b, r), Vec3::new(b, r, g)][index as usize % 3];
        Light {
            name: format!("lamp {index}"),
            kind,
            color,
            intensity: (self.lux * (self.distance * self.scale).powi(2)) as f32,
            casts_shadow: self.shadows,
            size: self.size * self.scale,
        }
    }

    fn settings(&self) -> SettingsPatch {
        // A white floor under the lamp is about mid-grey at 0 stops.
        let suits = ((self.lux + self.sun_lux) / 3.0).log2() as f32;
        SettingsPatch {
            size: Some(self.size_in_pixels),
            exposure: self.stops.map(|stops| suits - stops),
            gbuffer: Some(GbufferChoice { preset: self.gbuffer, ..GbufferChoice::default() }),
            light_path: Some(self.light_path),
            depth_prepass: self.depth_prepass,
            hdr_format: Some(self.hdr_format),
            transparency: Some(self.transparency),
            shadow_filter: Some(self.shadow_filter),
            shadow_size: Some(256),
            // Lavapipe's anisotropic filter looks at every texel that a pixel covers: 20 s a picture at 3000 repeats a metre.
            anisotropy: self.repeats.filter(|&repeats| repeats > 1.0).map(|_| 1),
            msaa: Some(self.msaa),
            samples: Some(self.samples),
            ..SettingsPatch::default()
        }
    }
}
