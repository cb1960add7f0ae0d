//! A point of a surface with all that light asks of it.

use glam::DVec3;

use afterlight_scene::Brdf;

/// The lobes that a lit point has beside its base and its highlight; Cook-Torrance alone has them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SurfaceLobes {
    /// Colour of a sheen, 0 to 1; black is none.
    pub sheen: DVec3,
    /// Perceptual roughness of the sheen, 0 to 1.
    pub sheen_roughness: f64,
    /// Share of a thin film's reflectance in the surface's, 0 to 1.
    pub film: f64,
    /// The film's index of refraction, 1 and up.
    pub film_ior: f64,
    /// The film's thickness.
    pub film_nanometres: f64,
    /// How much rougher an anisotropic highlight is across its grooves: 0 to 1.
    pub anisotropy: f64,
    /// The direction in which it is rougher, of any length but 0; not yet in the surface.
    pub across: DVec3,
    /// Share of the base that lets light through in place of reflecting it, 0 to 1.
    pub transmitting: f64,
    /// Colour of the light that comes through, 0 to 1.
    pub transmission: DVec3,
}

impl SurfaceLobes {
    /// No lobe beside the usual ones.
    pub const NONE: Self = Self {
        sheen: DVec3::ZERO,
        sheen_roughness: 0.0,
        film: 0.0,
        film_ior: 1.0,
        film_nanometres: 0.0,
        anisotropy: 0.0,
        across: DVec3::X,
        transmitting: 0.0,
        transmission: DVec3::ONE,
    };

    /// Returns true if light that arrives at the back is seen in front.
    pub fn transmits(&self) -> bool {
        self.transmitting > 0.0 && self.transmission != DVec3::ZERO
    }
}

/// A lit point, in the terms of its material with its textures looked up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadingPoint {
    /// Relative to the camera, in metres, along the axes of the world.
    pub position: DVec3,
    /// Along which it is seen from the camera, of any length; `None`: straight, from the camera to the place. A place that was rounded lies beside
    /// the ray that found it.
    pub ray: Option<DVec3>,
    /// Shading normal, turned to the side that is seen; unit length.
    pub normal: DVec3,
    /// The interpolated normal without the normal map, turned likewise; unit length.
    pub geometric_normal: DVec3,
    /// The reflection model.
    pub brdf: Brdf,
    /// Linear RGB, 0 to 1.
    pub albedo: DVec3,
    /// 0 to 1.
    pub metallic: f64,
    /// Perceptual, 0 to 1.
    pub roughness: f64,
    /// Ks of the Phong models.
    pub specular: DVec3,
    /// Reflectance of the dielectric share of Cook-Torrance facing the eye, 0 to 1.
    pub reflectance: DVec3,
    /// Reflectance at grazing angles, 0 to 1.
    pub grazing: f64,
    /// Ns of the Phong models.
    pub shininess: f64,
    /// The surface's other lobes.
    pub lobes: SurfaceLobes,
    /// Share of the ambient light that arrives, 0 to 1.
    pub occlusion: f64,
    /// Emitted radiance in nits.
    pub emissive: DVec3,
    /// Share of the light from behind that it hides, 0 to 1; 1 for opaque surfaces.
    pub alpha: f64,
    /// True if shadows fall on it.
    pub receives_shadow: bool,
}
