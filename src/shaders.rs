//! The compiled shaders: a module for each file of `shaders/`, written by `build.rs`. Pure data; nothing here knows Vulkan.
//!
//! Each module has its `Flags`, `VARIANTS` and `variant(flags)`, the ids of its specialization constants (`constants`), and the sizes and
//! offsets of its push constants (`push`) and of the structs in its buffers (`structs`), for assertions beside the Rust twins. `host` has the constants
//! that its source marks with `// host`, `shared` has the constants of the files in `shaders/shared/`, and `WORKGROUP_SIZE` holds for every variant. These
//! numbers are written in the shader alone.

#[cfg(feature = "hot-reload")]
pub mod exchange;

use std::ffi::CStr;
use std::ops::Range;
use std::sync::OnceLock;

/// Returns the edge of work groups that are as large along each axis (along two, where the third is 1). Others do not compile.
pub(crate) const fn group_edge(size: [u32; 3]) -> u32 {
    assert!(size[0] == size[1] && (size[2] == 1 || size[2] == size[0]), "work groups of another form");
    size[0]
}

/// The shader of a file.
#[derive(Debug)]
pub struct Shader {
    /// The file's name without `.wgsl`.
    pub name: &'static str,
    /// Every variant, ascending by its flags.
    pub variants: &'static [Variant],
    /// The facts that this program relies on and the variants do not list, one a line: flags, specialization constants, constants for the host, push
    /// constants, structs.
    pub interface: &'static str,
}

/// A shader with certain flags on.
#[derive(Debug)]
pub struct Variant {
    /// The flags, as bits.
    pub bits: u32,
    /// The entry points, in the order of the source.
    pub entry_points: &'static [&'static EntryPoint],
}

impl Variant {
    /// The first entry point of a stage.
    #[must_use]
    pub fn stage(&self, stage: Stage) -> Option<&'static EntryPoint> {
        self.entry_points.iter().copied().find(|entry| entry.stage == stage)
    }

    /// The vertex shader.
    #[must_use]
    pub fn vertex(&self) -> Option<&'static EntryPoint> {
        self.stage(Stage::Vertex)
    }

    /// The fragment shader.
    #[must_use]
    pub fn fragment(&self) -> Option<&'static EntryPoint> {
        self.stage(Stage::Fragment)
    }

    /// The compute shader.
    #[must_use]
    pub fn compute(&self) -> Option<&'static EntryPoint> {
        self.stage(Stage::Compute)
    }
}

/// A SPIR-V module with one entry point, and its inputs and outputs.
#[derive(Debug)]
pub struct EntryPoint {
    /// Name, for `VkPipelineShaderStageCreateInfo`.
    pub name: &'static CStr,
    /// Stage.
    pub stage: Stage,
    /// The module, in SPIR-V 1.3.
    pub spirv: Spirv,
    /// The resources that it uses, by set and binding.
    pub bindings: &'static [Binding],
    /// Vertex attributes, by location.
    pub vertex_inputs: &'static [VertexInput],
    /// Colours written, by location.
    pub fragment_outputs: &'static [FragmentOutput],
    /// Bytes of push constants that it uses, from offset 0.
    pub push_constant_size: u32,
    /// Invocations in a work group; zeros in other stages than compute.
    pub workgroup_size: [u32; 3],
}

/// A module's words, or their place.
#[derive(Clone, Copy, Debug)]
pub enum Spirv {
    /// Packed with the modules of other variants in the program.
    Packed {
        /// Index into the blocks of modules.
        block: usize,
        /// The first word in the block.
        start: usize,
        /// The number of words.
        words: usize,
    },
    /// Compiled while the program runs.
    Plain(&'static [u32]),
}

impl Spirv {
    /// The words. The first use of a block unpacks it, in about half a millisecond, and it stays unpacked until the program ends.
    #[must_use]
    pub fn words(self) -> &'static [u32] {
        match self {
            Self::Packed { block, start, words } => &BLOCKS[block].unpacked()[start..start + words],
            Self::Plain(words) => words,
        }
    }
}

/// Modules that are packed together.
struct Block {
    /// The block's bytes in `SPIRV`.
    range: Range<usize>,
    words: usize,
    unpacked: OnceLock<Vec<u32>>,
}

impl Block {
    const fn new(start: usize, end: usize, words: usize) -> Self {
        Self { range: start..end, words, unpacked: OnceLock::new() }
    }

    fn unpacked(&self) -> &[u32] {
        self.unpacked.get_or_init(|| {
            let mut words = vec![0; self.words];
            let packed = &SPIRV[self.range.clone()];
            let unpacked = zstd::bulk::decompress_to_buffer(packed, bytemuck::cast_slice_mut::<u32, u8>(&mut words));
            // No file and no user comes in between: the build packed it, and a test unpacks all of it.
            assert!(unpacked.is_ok_and(|bytes| bytes == 4 * words.len()), "the program's shaders are damaged");
            words
        })
    }
}

/// A shader stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// A vertex shader.
    Vertex,
    /// A fragment shader.
    Fragment,
    /// A compute shader.
    Compute,
}

/// A resource.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Binding {
    /// Name in the source.
    pub name: &'static str,
    /// Descriptor set.
    pub set: u32,
    /// Binding in the set.
    pub binding: u32,
    /// The kind of resource.
    pub kind: BindingKind,
    /// Descriptors; 0 for an array without a size.
    pub count: u32,
    /// The index of the module's word that holds the binding's number.
    pub word: u32,
}

/// The kinds of resources in bindings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BindingKind {
    /// A uniform buffer.
    UniformBuffer,
    /// A storage buffer.
    StorageBuffer {
        /// True if the shader only reads it.
        read_only: bool,
    },
    /// A texture without its sampler.
    SampledImage,
    /// A sampler.
    Sampler,
    /// A sampler that compares.
    ComparisonSampler,
    /// An input attachment of the subpass.
    InputAttachment {
        /// Index into `pInputAttachments`; without gaps in every variant.
        index: u32,
    },
    /// A texture that is written or read without a sampler.
    StorageImage,
}

/// A vertex attribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct VertexInput {
    /// Name in the source.
    pub name: &'static str,
    /// Location.
    pub location: u32,
    /// The type in the shader; the buffer's may be normalized.
    pub format: VertexFormat,
}

/// The type of a vertex attribute in the shader.
#[allow(missing_docs, reason = "the names say all")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum VertexFormat {
    Float32,
    Float32x2,
    Float32x3,
    Float32x4,
    Uint32,
    Uint32x2,
    Uint32x3,
    Uint32x4,
    Sint32,
    Sint32x2,
    Sint32x3,
    Sint32x4,
}

/// A colour that a fragment shader writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct FragmentOutput {
    /// Name in the source; empty for a plain return value.
    pub name: &'static str,
    /// Index of the colour attachment in the subpass.
    pub location: u32,
    /// Type of a component.
    pub kind: NumberKind,
    /// Components, 1 to 4.
    pub components: u32,
}

/// The numeric type of an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NumberKind {
    /// Float, normalized too.
    Float,
    /// Unsigned integer.
    Uint,
    /// Signed integer.
    Sint,
}

/// A specialization constant; each takes four bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpecConstant {
    /// Name in the source.
    pub name: &'static str,
    /// `constant_id`.
    pub id: u32,
    /// The value if a pipeline sets none.
    pub default: ConstantValue,
}

/// The value of a specialization constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ConstantValue {
    /// Four bytes, 0 or 1.
    Bool(bool),
    /// Unsigned.
    U32(u32),
    /// Signed.
    I32(i32),
    /// Float.
    F32(f32),
}

/// A hash of all modules as they are packed, in hexadecimal digits: it tells builds apart whose shaders are not the same.
#[must_use]
pub fn hash() -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(SPIRV);
    for Shader { name, variants, .. } in ALL {
        hasher.update(name.as_bytes());
        for variant in *variants {
            hasher.update(&variant.bits.to_le_bytes());
            for entry in variant.entry_points {
                hasher.update(entry.name.to_bytes_with_nul());
                hasher.update(format!("{:?}", entry.spirv).as_bytes());
            }
        }
    }
    hasher.finalize().to_hex().to_string()
}

/// The variant with these bits of a shader, in a table that ascends by them.
#[cfg_attr(not(feature = "hot-reload"), expect(unused_variables, reason = "a shader is what it was built as"))]
fn find(shader: &'static str, variants: &'static [Variant], bits: u32) -> Option<&'static Variant> {
    let own = built(variants, bits)?;
    #[cfg(feature = "hot-reload")]
    let own = exchange::current(shader, own);
    Some(own)
}

/// The one that the program was built with.
fn built(variants: &'static [Variant], bits: u32) -> Option<&'static Variant> {
    variants.binary_search_by_key(&bits, |variant| variant.bits).ok().map(|index| &variants[index])
}

/// Defines the flags of a shader.
macro_rules! flags {
    ($($name:ident = $bit:literal),*) => {
        /// A variant of the shader: a set of flags.
        #[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
        pub struct Flags(u32);

        #[allow(dead_code, missing_docs)]
        impl Flags {
            pub const NONE: Self = Self(0);
            $(pub const $name: Self = Self(1 << $bit);)*

            /// Each flag with its name.
            pub const ALL: &'static [(&'static str, Self)] = &[$((stringify!($name), Self::$name)),*];

            /// The set as a number.
            #[must_use]
            pub const fn bits(self) -> u32 {
                self.0
            }

            /// Returns true if all of `other` is in the set.
            #[must_use]
            pub const fn contains(self, other: Self) -> bool {
                self.0 & other.0 == other.0
            }

            /// The set if `on`, else the empty one.
            #[must_use]
            pub const fn when(self, on: bool) -> Self {
                if on { self } else { Self::NONE }
            }
        }

        impl std::ops::BitOr for Flags {
            type Output = Self;

            fn bitor(self, other: Self) -> Self {
                Self(self.0 | other.0)
            }
        }

        impl std::ops::BitOrAssign for Flags {
            fn bitor_assign(&mut self, other: Self) {
                self.0 |= other.0;
            }
        }

        impl std::fmt::Debug for Flags {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                let names: Vec<_> = Self::ALL.iter().filter(|(_, flag)| self.contains(*flag)).map(|(name, _)| *name).collect();
                if names.is_empty() { f.write_str("NONE") } else { f.write_str(&names.join(" | ")) }
            }
        }
    };
}

include!(concat!(env!("OUT_DIR"), "/shaders.rs"));

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_variant_is_found_and_embedded_whole() {
        for Shader { name, variants, .. } in ALL {
            assert!(variants.is_sorted_by(|a, b| a.bits < b.bits), "{name}");
            for variant in *variants {
                assert!(built(variants, variant.bits).is_some_and(|found| std::ptr::eq(found, variant)), "{name}");
                let entries = variant.entry_points;
                assert!(!entries.is_empty(), "{name} has no entry point in the variant {:b}", variant.bits);
                assert!(entries.iter().all(|entry| entry.spirv.words().first() == Some(&0x0723_0203)), "{name}");
            }
        }
    }
}
