//! glTF 2.0: `.gltf` and `.glb`, as the specification defines them and as real files deviate from it. This module needs the feature `readers`.
//!
//! serde reads the JSON into plain structs of [`json`](self); everything that they say is checked before it is used: numbers of things that do not
//! exist, counts and offsets beyond their buffers, cycles, values that are not finite. Whatever can be drawn is drawn; each part that is left out for a
//! fault is named by a warning, with its number and name, and only a file of which nothing can be drawn is an error.
//!
//! | Step | Module |
//! |---|---|
//! | bytes and JSON of a file | `container`, `odd_json`, `json`, `json_extensions`, `extensions` |
//! | buffers, views, accessors | `uri`, `buffers`, `meshopt`, `accessor` |
//! | the hierarchy, and its moving parts | `nodes`, `animation`, `pointer`, `material_keys`, `movement` |
//! | which meshes to make, and making them | `drawables`, `instances`, `source`, `draco`, `topology`, `primitive`, `influences`, `shapes` |
//! | materials and textures | `materials`, `textures`, `ktx`, `basis` |
//! | the scene | `assembly`, `lights`, `cameras`, `surroundings` |
//! | writing a scene | `write` |
//!
//! A primitive is read once however many nodes show it. Parts that no clip moves are placed, blended and hung on their joints while they are read,
//! and the [`Motion`](super::Motion) has no trace of them.

mod accessor;
mod animation;
mod assembly;
mod basis;
mod buffers;
mod cameras;
mod container;
mod draco;
mod drawables;
mod extensions;
mod influences;
mod instances;
mod json;
mod json_extensions;
mod ktx;
mod lights;
mod lobes;
mod material_keys;
mod materials;
mod meshopt;
mod movement;
mod nodes;
mod odd_json;
mod pointer;
mod primitive;
mod shapes;
mod sheets;
mod source;
mod strokes;
mod surroundings;
mod textures;
mod topology;
mod uri;
mod write;

#[cfg(test)]
mod tests;

use std::collections::{BTreeSet, HashMap};
use std::path::Path;

use self::accessor::Accessors;
use self::assembly::Assembly;
use self::buffers::Buffers;
use self::container::Container;
use self::drawables::{Drawables, Sources};
use self::json::Document;
use self::movement::Movement;
use self::nodes::Nodes;
use self::textures::{Images, ReadTextures, TextureRequest};
use self::uri::Resources;
pub use self::write::{Exported, ExportedView, write};
use super::{Error, Imported, LoadOptions};
use afterlight_files::regular_file::read_regular;

/// The parts of a glTF file to read.
#[derive(Default, Clone, Copy)]
pub struct GltfOptions<'a> {
    /// The scene, by its name or its number; `None` for the file's default scene.
    pub scene: Option<&'a str>,
    /// The material variant, by its name (KHR_materials_variants).
    pub variant: Option<&'a str>,
    /// True if buffers and images outside the file's folder are read.
    pub allow_outside: bool,
    /// The options of every model.
    pub load: LoadOptions<'a>,
}

/// Loads a glTF file, its buffers and its images.
///
/// # Errors
/// [`Error::Read`] when the file cannot be read; [`Error::Content`] for a fault that the module's documentation calls an error, for an unsupported
/// extension that the file requires, for a scene or a variant that does not exist, and for a file without a triangle to draw.
pub fn load(path: &Path, options: &GltfOptions) -> Result<Imported, Error> {
    // A binary file's header stores its length in 32 bits.
    let bytes = read_regular(path, u64::from(u32::MAX));
    let bytes = bytes.map_err(|error| Error::Read { path: path.to_owned(), cause: error.to_string() })?;
    parse(bytes, path, options)
}

/// Reads the bytes of a glTF file that stands, or would stand, at `path`.
///
/// # Errors
/// As [`load`].
pub fn parse(bytes: Vec<u8>, path: &Path, options: &GltfOptions) -> Result<Imported, Error> {
    let container = Container::parse(bytes);
    let container = container.map_err(|(line, what)| Error::Content { path: path.to_owned(), line, what })?;
    let resources = Resources::beside(path, options.allow_outside);
    let buffers = Buffers::new(&container.document, &resources, container.binary());
    let (document, odd) = (&container.document, container.warnings.as_slice());
    let reader = Reader { path, document, odd, resources: &resources, buffers: &buffers };
    let read = reader.read(options);
    read.map_err(|what| Error::Content { path: path.to_owned(), line: None, what })
}

struct Reader<'a> {
    path: &'a Path,
    document: &'a Document,
    /// Oddities of the file itself.
    odd: &'a [String],
    resources: &'a Resources,
    buffers: &'a Buffers<'a>,
}

impl Reader<'_> {
    fn read(&self, options: &GltfOptions) -> Result<Imported, String> {
        let document = self.document;
        extensions::check_required(document)?;
        let accessors = Accessors::new(document, self.buffers);
        let mut warnings = self.odd.to_vec();
        warnings.extend(extensions::not_drawn(document));
        let nodes = Nodes::of(document, options.scene, &mut warnings)?;
        let takes = animation::read(document, &accessors, &mut warnings);
        let movement = Movement::of(&takes, &nodes);
        let buffers = self.buffers;
        let sources = Sources { document, buffers, accessors: &accessors, nodes: &nodes, movement: &movement };
        let mut drawables = drawables::collect(&sources, options.variant)?;
        let requests = requests(&drawables);
        let images = Images { path: self.path, document, resources: self.resources, buffers };

        // Decoding textures and building meshes take about as long, and neither waits for the other.
        let (made, built) =
            rayon::join(|| images.make(&requests, &options.load), || drawables.build(&sources, &options.load));
        let (meshes, odd) = built;
        warnings.append(&mut drawables.warnings);
        warnings.extend(odd);
        if meshes.iter().all(Option::is_none) {
            return Err(self.nothing(&nodes, &drawables, &warnings));
        }
        let mut assembly = Assembly::default();
        let numbers = take_textures(&mut assembly.imported, &requests, made);
        assembly.dress(&mut drawables, |request| numbers.get(request).copied());
        assembly.nodes(&sources, &drawables);
        assembly.objects(&sources, &drawables, meshes, &mut warnings);
        assembly.lights_and_cameras(&sources, &mut warnings);
        assembly.clips(takes);
        sheets::part(&mut assembly.imported);
        assembly.imported.surroundings =
            nodes.scene.and_then(|scene| surroundings::read(document, scene, &mut warnings));
        warnings.extend(accessors.warnings());
        warnings.extend(self.buffers.warnings());
        warnings.extend(self.misaligned(&accessors));
        let mut imported = assembly.imported;
        let files: BTreeSet<_> = imported.files.drain(..).chain(self.buffers.files()).collect();
        imported.files = std::iter::once(self.path.to_owned()).chain(files).collect();
        let mut told = BTreeSet::new();
        warnings.retain(|what| told.insert(what.clone()));
        let told = warnings.into_iter().map(|what| format!("{}: {what}", self.path.display()));
        imported.warnings.extend(told);
        Ok(imported)
    }

    /// Explains why the file shows nothing.
    fn nothing(&self, nodes: &Nodes, drawables: &Drawables, warnings: &[String]) -> String {
        let with_mesh = nodes.shown.iter().filter(|&&node| self.document.nodes[node].mesh.is_some()).count();
        let (meshes, primitives) = (self.document.meshes.len(), drawables.list.len());
        let because = match warnings {
            [] => String::new(),
            [only] => format!("; {only}"),
            [first @ .., last] => format!("; {last} (and {} more)", first.len()),
        };
        format!(
            "has nothing to draw: of its {meshes} meshes, nodes of its scene show {with_mesh}, with {primitives} primitives{because}"
        )
    }

    /// A warning about all misaligned accessors.
    fn misaligned(&self, accessors: &Accessors) -> Option<String> {
        let odd = |&index: &usize| !accessors.is_aligned(json::Whole(index));
        let mut odd = (0..self.document.accessors.len()).filter(odd);
        let first = odd.next()?;
        let count = 1 + odd.count();
        Some(format!(
            "accessors ({count}, as {first}) do not begin at a multiple of their component's size, read all the same"
        ))
    }
}

/// The requested textures, each once.
fn requests(drawables: &Drawables) -> Vec<TextureRequest> {
    let pending = drawables.dresses.values().flat_map(|dress| std::iter::once(&dress.base).chain(&dress.coat));
    let mut seen = std::collections::HashSet::new();
    let all = pending.flat_map(|pending| &pending.requests).map(|(_, request)| *request);
    all.filter(|request| seen.insert(*request)).collect()
}

/// Adds the textures that could be made. Returns their indices by request.
fn take_textures(
    imported: &mut Imported,
    requests: &[TextureRequest],
    made: ReadTextures,
) -> HashMap<TextureRequest, usize> {
    let mut numbers = HashMap::new();
    for (request, texture) in requests.iter().zip(made.textures) {
        if let Some(texture) = texture {
            numbers.insert(*request, imported.textures.len());
            imported.textures.push(texture);
        }
    }
    imported.warnings.extend(made.warnings);
    imported.files.extend(made.files);
    numbers
}
