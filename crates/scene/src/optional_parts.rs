//! The parts that a plan may leave out, with the names that the plan, the reports and the command line share.

use std::fmt;
use std::str::FromStr;

use super::{Error, unknown};

/// Declares the parts, each with its name, in the order of a frame's reports.
macro_rules! optional_parts {
    ($($(#[$doc:meta])* $part:ident = $name:literal,)+) => {
        /// A part that a frame has only if the scene needs it. If it is kept without need, it gets a neutral input; the picture then differs only by
        /// the rounding of the formats that it is stored in: tests/scenes/leave_out.rs has the bounds.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum OptionalPart {
            $($(#[$doc])* $part,)+
        }

        impl OptionalPart {
            /// Every part with its name.
            pub const NAMES: &'static [(&'static str, Self)] = &[$(($name, Self::$part)),+];

            /// The part's name, as `--plan` takes it.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$part => $name,)+
                }
            }
        }
    };
}

optional_parts! {
    /// The HDR target, and the TONEMAP subpass that reads it. Light is rounded to its format; with several samples a pixel, their shown values are
    /// averaged before they are rounded to 8 bits, and not after. With floats of 16 or 32 bits either is one code of 8 bits at most; `b10g11r11` has wider steps.
    HdrTarget = "hdr-target",
    /// A render pass of GEOMETRY's own, which stores the G-buffer for the next one to load: it shows the cost of a frame without subpasses.
    StoredGbuffer = "stored-gbuffer",
    /// The subpass for transparent surfaces.
    Transparent = "transparent",
    /// GEOMETRY's output location for emitted light.
    Emissive = "emissive",
    /// The G-buffer's target for roughness and other material values.
    MaterialTarget = "material-target",
    /// The channel of the material target for metals.
    MetallicChannel = "metallic-channel",
    /// The channels of the material target for the geometric normal, by which shadows are biased.
    GeometricNormalChannels = "geometric-normal-channels",
    /// The G-buffer's target for Phong's terms and the BRDF's index.
    SpecularTarget = "specular-target",
    /// A BRDF that is chosen for each pixel.
    BrdfByPixel = "brdf-by-pixel",
    /// Normals of vertices.
    Normals = "normals",
    /// Texture coordinates of vertices.
    Uvs = "uvs",
    /// Tangents of vertices.
    Tangents = "tangents",
    /// Second texture coordinates of vertices.
    SecondUvs = "second-uvs",
    /// Colours of vertices.
    VertexColors = "vertex-colors",
    /// Looks of instances, if no object has one: tints, highlights, and cells of atlases.
    Looks = "looks",
    /// 32 bits for each index, where 16 suffice.
    WideIndices = "wide-indices",
    /// Meshes that no drawn object has.
    UnusedMeshes = "unused-meshes",
    /// The sampling of base-colour textures by materials that have none.
    BaseColorTextures = "base-color-textures",
    /// The sampling of normal maps by materials that have none.
    NormalMaps = "normal-maps",
    /// The sampling of textures of metallic and roughness by materials that have none.
    MetallicRoughnessTextures = "metallic-roughness-textures",
    /// The sampling of ambient occlusion by materials that have none.
    OcclusionTextures = "occlusion-textures",
    /// The sampling of emitted colours by materials that have none.
    EmissiveTextures = "emissive-textures",
    /// The sampling of specular colours of the Phong models by materials that have none.
    SpecularTextures = "specular-textures",
    /// Textures of the power of the Phong models.
    ShininessTextures = "shininess-textures",
    /// The sampling of textures of a sheen by materials that have a sheen and no such texture.
    SheenTextures = "sheen-textures",
    /// The sampling of textures of a thin film by materials that have a film and no such texture.
    FilmTextures = "film-textures",
    /// The sampling of textures of an anisotropy by materials that have an anisotropy and no such texture.
    AnisotropyTextures = "anisotropy-textures",
    /// The sampling of textures of diffuse transmission by materials that transmit and have no such texture.
    DiffuseTransmissionTextures = "diffuse-transmission-textures",
    /// Textures of materials that no drawn object has, and textures that no pipeline samples.
    UnusedTextures = "unused-textures",
    /// The texels of textures that the device can sample in the blocks of their files.
    DecodedTextures = "decoded-textures",
    /// Textures of one colour, which the material's factor can hold.
    ConstantTextures = "constant-textures",
    /// The discarding of fragments by alpha, if nothing is masked.
    AlphaMasks = "alpha-masks",
    /// Masks that cut nothing, and surfaces that masks cut away whole.
    OpaqueMasks = "opaque-masks",
    /// Code for the ambient light of the environment.
    AmbientLight = "ambient-light",
    /// Code for directional lights.
    DirectionalLights = "directional-lights",
    /// Point and spot lights.
    PunctualLights = "punctual-lights",
    /// The cutting of lights to cones, in shaders.
    SpotCones = "spot-cones",
    /// Beams of parallel light.
    Beams = "beams",
    /// A fall-off that is chosen for each light.
    Falloffs = "falloffs",
    /// Ranges of lights.
    LightRanges = "light-ranges",
    /// Lists of lights by froxel.
    LightLists = "light-lists",
    /// Lights that reach nothing.
    IdleLights = "idle-lights",
    /// The atlas of shadow maps, and its lookups.
    ShadowMaps = "shadow-maps",
    /// Casters whose shadow falls on nothing that is seen.
    IdleCasters = "idle-casters",
    /// Objects beside or behind the view.
    OffscreenObjects = "offscreen-objects",
    /// Objects behind others.
    OccludedObjects = "occluded-objects",
}

impl OptionalPart {
    /// All parts, in the order of reports.
    pub fn all() -> impl Iterator<Item = Self> {
        Self::NAMES.iter().map(|&(_, part)| part)
    }
}

impl fmt::Display for OptionalPart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// The parts that stay in a plan although nothing needs them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Keep(u64);

impl Keep {
    /// Only the parts that a scene needs.
    pub const NONE: Self = Self(0);
    /// Every part, to compare with.
    pub const ALL: Self = Self((1 << OptionalPart::NAMES.len()) - 1);

    /// Returns true if the part stays.
    pub const fn has(self, part: OptionalPart) -> bool {
        self.0 & (1 << part as u64) != 0
    }

    /// Adds a part.
    #[must_use]
    pub const fn with(self, part: OptionalPart) -> Self {
        Self(self.0 | 1 << part as u64)
    }

    /// Removes a part.
    #[must_use]
    pub const fn without(self, part: OptionalPart) -> Self {
        Self(self.0 & !(1 << part as u64))
    }

    /// The kept parts, in the order of reports.
    pub fn parts(self) -> impl Iterator<Item = OptionalPart> {
        OptionalPart::all().filter(move |&part| self.has(part))
    }
}

impl FromIterator<OptionalPart> for Keep {
    fn from_iter<I: IntoIterator<Item = OptionalPart>>(parts: I) -> Self {
        parts.into_iter().fold(Self::NONE, Self::with)
    }
}

/// `lean`, `full`, or the names of the parts that stay: `hdr-target,tangents`.
impl FromStr for Keep {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let lower = text.trim().to_lowercase().replace('_', "-");
        match lower.as_str() {
            "lean" => return Ok(Self::NONE),
            "full" => return Ok(Self::ALL),
            _ => {}
        }
        let part = |name: &str| {
            let found = OptionalPart::NAMES.iter().find(|(own, _)| *own == name);
            found.map(|&(_, part)| part).ok_or_else(|| {
                let names = OptionalPart::NAMES.iter().map(|&(own, _)| own);
                let known: Vec<_> = ["lean", "full"].into_iter().chain(names).collect();
                Error::Setting(unknown("part of the plan", name, &known))
            })
        };
        lower.split(',').map(|name| part(name.trim())).collect()
    }
}

impl fmt::Display for Keep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NONE => f.pad("lean"),
            Self::ALL => f.pad("full"),
            some => f.pad(&some.parts().map(OptionalPart::name).collect::<Vec<_>>().join(",")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_is_lean_or_full_or_a_list_of_parts() {
        let some = Keep::NONE.with(OptionalPart::HdrTarget).with(OptionalPart::Tangents);
        for (text, keep) in [("lean", Keep::NONE), ("FULL", Keep::ALL), ("tangents, hdr_target", some)] {
            assert_eq!(text.parse::<Keep>().expect(text), keep);
            assert_eq!(keep.to_string().parse::<Keep>().expect("its own name"), keep);
        }
        assert_eq!(some.without(OptionalPart::Tangents).to_string(), "hdr-target");
        for (text, says) in [("tangent", "tangents"), ("", "lean"), ("lean,full", "lean")] {
            let error = text.parse::<Keep>().expect_err(text).to_string();
            assert!(error.contains(says), "{error}");
        }
    }
}
