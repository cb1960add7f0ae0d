//! The frame that the device at hand makes, step by step: surfaces as its G-buffer holds them, light as its formats hold it, and the
//! picture. Measured, not modelled: rounding is the driver's own.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use afterlight::frame::{self, Pixels, Renderer};
use afterlight::gpu::Device;
use afterlight::scene::{
    Brdf, Environment, GbufferChoice, GbufferPreset, HdrFormat, LightPath, Material, Output, Scene, Settings, View,
};
use afterlight_truth::reference::{CameraView, TriangleId, tonemap::decode_srgb};

/// A surface as a G-buffer holds it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GbufferTexel {
    /// Relative to the camera, in metres.
    pub position: DVec3,
    pub normal: DVec3,
    pub albedo: DVec3,
    pub metallic: f64,
    /// Perceptual, or as [`shininess`] takes it.
    pub roughness: f64,
    /// Share of the ambient light that arrives; 1 in a scene without any.
    pub occlusion: f64,
    /// The emitted light in nits. No G-buffer holds it: it is added to the light.
    pub emissive: DVec3,
}

/// A frame's pictures, each at the chosen pixels only.
#[derive(Debug, Clone, PartialEq)]
pub struct Captured {
    /// Light as the frame tone-maps it, exposed.
    pub exposed: Vec<DVec3>,
    /// The light as `exposed`, kept in 32 bits; `None` if the frame keeps it in 32 bits anyway, or the device cannot.
    pub unrounded: Option<Vec<DVec3>>,
    /// The light with all that reaches a surface, however little it is; `None` if the frame cuts off nothing.
    pub uncut: Option<Vec<DVec3>>,
    /// The light as `uncut`, without light of the sky; `None` if no sky lights the scene.
    pub without_sky: Option<Vec<DVec3>>,
    /// The picture, decoded to linear, 0 to 1.
    pub shown: Vec<DVec3>,
    /// The texels of the frame's own G-buffer.
    pub own: Vec<GbufferTexel>,
    /// The texels of a G-buffer with 32 bits a channel.
    pub unquantized: Vec<GbufferTexel>,
    /// The triangle that is seen; `None` where the device does not number them.
    pub triangles: Option<Vec<Option<TriangleId>>>,
}

/// Ns of the Phong models from its encoding in a G-buffer: 20 doublings of 1 + Ns over 0 to 1.
pub fn shininess(stored: f64) -> f64 {
    (stored * 20.0).exp2() - 1.0
}

/// A device that is to draw a scene.
#[derive(Clone, Copy)]
pub struct PixelCapture<'a> {
    pub device: &'a Arc<Device>,
    pub scene: &'a Scene,
    pub view: &'a CameraView,
    /// The indices of the chosen pixels, row by row.
    pub pixels: &'a [usize],
}

impl PixelCapture<'_> {
    /// The chosen pixels of a picture.
    pub fn draw(&self, settings: &Settings) -> Result<Vec<DVec3>, frame::Error> {
        self.read(&mut Renderer::new(self.device, self.scene, settings)?)
    }

    /// The chosen pixels of a picture by an existing renderer.
    pub fn read(&self, renderer: &mut Renderer) -> Result<Vec<DVec3>, frame::Error> {
        let picture = renderer.picture(&self.view.camera, || ())?;
        let value = |index: usize| match &picture.pixels {
            Pixels::LinearF32(rgba) => f64::from(rgba[index]),
            Pixels::Srgb8(codes) => decode_srgb(f64::from(codes[index]) / 255.0),
        };
        let texel = |&pixel: &usize| DVec3::from_array([0, 1, 2].map(|channel| value(pixel * 4 + channel)));
        Ok(self.pixels.iter().map(texel).collect())
    }

    /// Everything that is asked of a frame. `settings` draw one sample a pixel.
    ///
    /// # Errors
    /// When the frame cannot be planned on the device, or it fails.
    pub fn capture(&self, settings: &Settings) -> Result<Captured, frame::Error> {
        let exposed = Settings { output: Output::Exposed, ..settings.clone() };
        let float32 = GbufferChoice { preset: GbufferPreset::Float32, ..GbufferChoice::default() };
        let emission = self.emission(settings)?;
        let unquantized = self.stored(settings, float32, &emission)?;
        // Without a G-buffer surfaces are lit as they are drawn, and nothing is stored.
        let own = match frame::plan_for(self.device, self.scene, settings)?.gbuffer {
            None => unquantized.clone(),
            Some(_) => self.stored(settings, settings.gbuffer, &emission)?,
        };
        let single = Settings { hdr_format: HdrFormat::Rgba32f, ..exposed.clone() };
        let is_rounded = self.keeps_light_otherwise(&exposed, &single)?;
        let unrounded = if is_rounded { &single } else { &exposed };
        let uncut = Settings { light_cutoff: false, ..unrounded.clone() };
        let is_lit_by_sky = frame::plan_for(self.device, self.scene, settings)?.is_lit_by_sky();
        Ok(Captured {
            unrounded: is_rounded.then(|| self.draw(unrounded)).transpose()?,
            without_sky: is_lit_by_sky
                .then(|| self.draw(&Settings { sky_light: false, ..uncut.clone() }))
                .transpose()?,
            uncut: settings.light_cutoff.then(|| self.draw(&uncut)).transpose()?,
            exposed: self.draw(&exposed)?,
            shown: self.draw(&Settings { output: Output::Srgb8, ..settings.clone() })?,
            own,
            unquantized,
            triangles: frame::triangles(self.device, (self.scene, None), &self.view.camera, settings)?
                .map(|seen| self.pixels.iter().map(|&pixel| seen[pixel]).collect()),
        })
    }

    /// Returns true if the light's target changes with the settings, and the device has both.
    fn keeps_light_otherwise(&self, own: &Settings, other: &Settings) -> Result<bool, frame::Error> {
        let plan = |settings| frame::plan_for(self.device, self.scene, settings);
        let own = plan(own)?;
        Ok(plan(other).is_ok_and(|other| other.hdr != own.hdr))
    }

    fn stored(
        &self,
        settings: &Settings,
        gbuffer: GbufferChoice,
        emission: &[DVec3],
    ) -> Result<Vec<GbufferTexel>, frame::Error> {
        let shown = |view| self.draw(&Settings { gbuffer, ..buffer(settings, view) });
        let positions = shown(View::Position)?.into_iter().zip(shown(View::Normal)?);
        let colors = shown(View::Albedo)?.into_iter().zip(shown(View::Metallic)?).zip(shown(View::Roughness)?);
        let rest = self.occlusion(settings, gbuffer)?.into_iter().zip(emission);
        let stored = positions.zip(colors).zip(rest).map(|(((position, normal), colors), (occlusion, &emissive))| {
            let ((albedo, metallic), roughness) = colors;
            GbufferTexel { position, normal, albedo, metallic: metallic.x, roughness: roughness.x, occlusion, emissive }
        });
        Ok(stored.collect())
    }

    /// Returns the occlusion of each pixel: its lighting where all light is white ambient light of 1 nit.
    fn occlusion(&self, settings: &Settings, gbuffer: GbufferChoice) -> Result<Vec<f64>, frame::Error> {
        if !self.scene.environment.is_lit() {
            return Ok(vec![1.0; self.pixels.len()]);
        }
        let mut scene = without_emission(self.scene);
        scene.sky = None;
        scene.lights.clear();
        scene.environment = Environment { ambient: Vec3::ONE, ..Environment::default() };
        let settings = Settings { gbuffer, ..buffer(settings, View::Lighting) };
        let shown = PixelCapture { scene: &scene, ..*self }.draw(&settings)?;
        Ok(shown.into_iter().map(|white| white.x).collect())
    }

    /// Returns the emission of each pixel: surfaces drawn in the dark.
    fn emission(&self, settings: &Settings) -> Result<Vec<DVec3>, frame::Error> {
        if !self.scene.materials.iter().any(Material::is_emissive) {
            return Ok(vec![DVec3::ZERO; self.pixels.len()]);
        }
        let dark = Scene { lights: Vec::new(), environment: Environment::default(), sky: None, ..self.scene.clone() };
        PixelCapture { scene: &dark, ..*self }.draw(&buffer(settings, View::Final))
    }
}

/// A view of a frame as values.
fn buffer(settings: &Settings, view: View) -> Settings {
    // Paths without a G-buffer have no buffer to show, and the buffers of the others do not depend on the path.
    let light_path = LightPath::Loop;
    Settings { view, output: Output::Nits, light_path, light_cutoff: false, ..settings.clone() }
}

/// A scene whose surfaces only reflect.
pub fn without_emission(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    for material in &mut scene.materials {
        (material.emissive, material.emissive_texture) = (Vec3::ZERO, None);
    }
    scene
}

/// Returns true if a G-buffer holds a shininess in place of a roughness.
pub fn stores_shininess(brdf: Brdf) -> bool {
    matches!(brdf, Brdf::Phong | Brdf::BlinnPhong)
}
