//! The values that settings choose among, except choices that belong to a single effect. Each is declared once, with its name.

/// Makes an enum of named values, as a command line, a scene file and JSON spell them: `NAMES`, `name()`, `Display`, and `FromStr`, whose errors list
/// the possible names. Names are kebab-case; a command line and a scene file may use underscores and upper case as well. A replaced name is given
/// after the new one: it is still read, but neither listed nor written.
macro_rules! choice {
    (
        $(#[$about:meta])*
        pub enum $type:ident: $what:literal {
            $($(#[$about_value:meta])* $value:ident $(= $number:literal)? => $name:literal $(| $replaced:literal)*,)+
        }
    ) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        pub enum $type {
            $($(#[$about_value])* #[cfg_attr(feature = "serde", serde(rename = $name $(, alias = $replaced)*))] $value $(= $number)?,)+
        }

        impl $type {
            /// Every value with its name.
            pub const NAMES: &'static [(&'static str, Self)] = &[$(($name, Self::$value)),+];

            /// The value's name, as its parser takes it.
            pub fn name(self) -> &'static str {
                match self { $(Self::$value => $name),+ }
            }
        }

        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.name())
            }
        }

        impl std::str::FromStr for $type {
            type Err = $crate::Error;

            fn from_str(text: &str) -> Result<Self, $crate::Error> {
                match text.trim().to_lowercase().replace('_', "-").as_str() {
                    $($name $(| $replaced)* => Ok(Self::$value),)+
                    _ => Err($crate::Error::Setting($crate::unknown($what, text, &[$($name),+]))),
                }
            }
        }

        $crate::settings::setting::plain_text! {
            $type: $crate::settings::ValueKind::Names(&[$($name),+]);
        }
    };
}
pub(crate) use choice;

choice! {
    /// The form of a picture's pixels.
    #[derive(Default)]
    pub enum Output: "output" {
        /// Tone-mapped, 8 bits a channel, sRGB-encoded.
        #[default]
        Srgb8 => "srgb8",
        /// Linear scene light in nits, as 32-bit floats; of a view its values, as docs/SCENES.md says.
        Nits => "nits",
        /// The exposed light that the tone-mapped frame of the same settings would tone-map, as 32-bit floats; at 1 the sensor saturates.
        /// It shows the effect of that frame on light: if the frame has an HDR target, light goes through that target's format here too. Several
        /// samples are averaged as light, with any [`Resolve`]. A view is the same as in `Nits`.
        Exposed => "exposed",
    }
}

impl Output {
    /// Returns true if pixels are floats, and not tone-mapped.
    pub fn is_linear(self) -> bool {
        self != Self::Srgb8
    }
}

choice! {
    /// The format that light is kept in until it is tone-mapped, with the error of storing it: a driver may truncate.
    #[derive(Default)]
    pub enum HdrFormat: "HDR format" {
        /// 8 bytes a pixel, 10 bits of mantissa: an error of at most 0.1%. Blends everywhere.
        #[default]
        Rgba16f => "rgba16f",
        /// 4 bytes a pixel, without sign and alpha. 6 bits of mantissa in red and green, 5 in blue: 1.6% and 3.1%, each time that
        /// something is added.
        B10g11r11 => "b10g11r11",
        /// 16 bytes a pixel, 23 bits of mantissa.
        Rgba32f => "rgba32f",
    }
}

choice! {
    /// The way that transparent surfaces are laid over one another.
    #[derive(Default)]
    pub enum Transparency: "transparency" {
        /// From back to front, by object and by triangle within one: exact where surfaces do not pass through each other.
        #[default]
        Sorted => "sorted",
        /// Weighted blended, in any order (McGuire and Bavoil 2013): an estimate where surfaces overlap, exact for a single surface.
        Oit => "oit",
    }
}

choice! {
    /// The processor that culls opaque objects. The picture is the same.
    #[derive(Default)]
    pub enum Culling: "culling" {
        /// The plan chooses by a rule, and says which and why.
        #[default]
        Auto => "auto",
        /// The CPU, by a tree of boxes.
        Cpu => "cpu",
        /// The device, by compute passes that write the commands which draw.
        Gpu => "gpu",
    }
}

choice! {
    /// The way in which the passes that draw follow each other. The picture is the same.
    #[derive(Default)]
    pub enum Passes: "passes" {
        /// Render passes with subpasses, and dependencies between these.
        #[default]
        Subpasses => "subpasses",
        /// Rendering without render passes, with barriers inside it (VK_KHR_dynamic_rendering_local_read).
        LocalRead => "local-read",
        /// A render pass for each subpass: all that a later one reads is stored, and loaded again.
        Stored => "stored",
    }
}

choice! {
    /// The API of barriers, render passes and submissions. The picture is the same.
    #[derive(Default)]
    pub enum SyncApi: "synchronization" {
        /// The API of Vulkan 1.0.
        #[default]
        One => "1",
        /// VK_KHR_synchronization2, with its finer stages and accesses.
        Two => "2",
    }
}

choice! {
    /// The queues that a frame's work goes to. The picture is the same.
    #[derive(Default)]
    pub enum Queues: "queues" {
        /// One queue for all work.
        #[default]
        One => "one",
        /// Ambient occlusion and copies on separate queues, if the device has them.
        All => "all",
    }
}

choice! {
    /// The layouts that images are used in. The picture is the same.
    #[derive(Default)]
    pub enum ImageLayouts: "layouts" {
        /// The layout of each kind of use.
        #[default]
        Optimal => "optimal",
        /// GENERAL for all but presentation (VK_KHR_unified_image_layouts).
        Unified => "unified",
    }
}

choice! {
    /// The way that pixels meet their lights. All give the same picture, at different costs.
    #[derive(Default)]
    pub enum LightPath: "light path" {
        /// The plan chooses by a rule, and says which and why.
        #[default]
        Auto => "auto",
        /// One full-screen draw, every light on every pixel.
        Loop => "loop",
        /// A draw for each light, cut to the rectangle that it reaches, added by blending.
        PerLight => "per-light",
        /// A sphere or cone for each light, drawn where surfaces lie before its back, added by blending.
        Volumes => "volumes",
        /// Lists of lights for each froxel, made on the CPU.
        Clustered => "clustered",
        /// The G-buffer is stored and a compute pass lights tiles with lists in shared memory.
        Compute => "compute",
        /// No G-buffer: which triangle each pixel shows is stored, and the compute pass looks surfaces up and lights them as `Compute` does.
        Visibility => "visibility",
        /// No G-buffer: surfaces are lit as they are drawn, with the lists of `Clustered`.
        Forward => "forward",
        /// No G-buffer, no lists, no depth pre-pass: every fragment meets every light.
        ForwardNaive => "forward-naive",
    }
}

choice! {
    /// The curve from exposed light, where 1 saturates the sensor, to display values.
    #[derive(Default)]
    pub enum Tonemap: "tonemap" {
        /// Khronos PBR Neutral.
        #[default]
        Neutral => "neutral",
        /// Troy Sobotka's AgX, in the polynomial fit of Benjamin Wrensch.
        Agx => "agx",
        /// Stephen Hill's fit of the ACES reference and output transforms.
        Aces => "aces",
        /// Clamp only.
        None => "none",
    }
}

choice! {
    /// The scale on which the samples of a pixel are averaged.
    #[derive(Default)]
    pub enum Resolve: "resolve" {
        /// As scene light, as a sensor does. An edge against something far too bright stays jagged.
        Linear => "linear",
        /// As display light, after tone mapping: no sample counts for more than white.
        #[default]
        ToneMapped => "tone-mapped",
    }
}

choice! {
    /// The filter that makes a share of light of a shadow map's texels.
    #[derive(Default)]
    pub enum ShadowFilter: "shadow filter" {
        /// The nearest texel: lit or not.
        None = 0 => "none",
        /// Percentage-closer filtering of two by two texels, bilinearly weighted.
        #[default]
        Box2 = 1 => "2x2",
        /// Three by three.
        Box3 = 2 => "3x3",
        /// Five by five.
        Box5 = 3 => "5x5",
        /// Sixteen texels on a disc that is turned from pixel to pixel.
        Poisson = 4 => "poisson",
        /// Percentage-closer soft shadows (Fernando 2005): the disc is as wide as the penumbra of a light that has a size.
        Pcss = 5 => "pcss",
    }
}

/// Samples a pixel that multisampling can have; a device may have fewer.
pub const MSAA: [u32; 4] = [1, 2, 4, 8];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Brdf, View};

    #[test]
    fn every_name_parses_to_its_value_and_back() {
        for &(name, value) in View::NAMES {
            assert_eq!((name.parse::<View>().unwrap(), value.to_string().as_str()), (value, name));
        }
        for &(name, value) in Tonemap::NAMES {
            assert_eq!(name.parse::<Tonemap>().unwrap(), value);
        }
        assert_eq!("Cook_Torrance".parse::<Brdf>().unwrap(), Brdf::CookTorrance);
    }

    #[test]
    fn a_wrong_name_is_answered_with_a_suggestion() {
        let error = "blin-phong".parse::<Brdf>().unwrap_err().to_string();
        assert!(error.contains("did you mean \"blinn-phong\""), "{error}");
    }
}
