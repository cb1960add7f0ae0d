//! Imports and preprocessing through naga_oil, and its errors turned into places in the files as they were written.

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

use naga::valid::Capabilities;
use naga_oil::compose::{
    ComposableModuleDescriptor, Composer, ComposerError, ComposerErrorInner, NagaModuleDescriptor, ShaderDefValue,
};

use crate::error::{Error, SourceSpan};
use crate::scan;
use crate::source::Source;

/// The features that shaders may use: Vulkan 1.1 core features, per-sample inputs, which need `sampleRateShading`, the index of a triangle, which
/// needs `geometryShader`, and arrays of textures with an index for each invocation (`VK_EXT_descriptor_indexing`).
pub const CAPABILITIES: Capabilities = Capabilities::IMMEDIATES
    .union(Capabilities::MULTISAMPLED_SHADING)
    .union(Capabilities::CUBE_ARRAY_TEXTURES)
    .union(Capabilities::TEXTURE_AND_SAMPLER_BINDING_ARRAY)
    .union(Capabilities::TEXTURE_AND_SAMPLER_BINDING_ARRAY_NON_UNIFORM_INDEXING)
    .union(Capabilities::PRIMITIVE_INDEX)
    .union(Capabilities::EARLY_DEPTH_TEST)
    // Vulkan packs half floats on every device.
    .union(Capabilities::SHADER_FLOAT16_IN_FLOAT32);

/// naga_oil stores the module's number above this bit of a source position.
const PLACE_BITS: u32 = 21;
const DECORATION: &str = "X_naga_oil_mod_X";

/// The name in the source: naga_oil appends the module's path, in base 32, to a module's exports.
#[must_use]
pub fn source_name(name: &str) -> &str {
    name.split_once(DECORATION).map_or(name, |(name, _)| name)
}

/// The name that naga_oil gives to the item `name` of `source`.
#[must_use]
pub fn composed_name(source: &Source, name: &str) -> String {
    Composer::decorated_name(source.import_path.as_deref(), name)
}

/// The modules that shaders can import, ordered so that each comes after its imports.
#[derive(Clone, Debug, Default)]
pub struct Library {
    /// The files.
    pub modules: Vec<Source>,
}

impl Library {
    /// Orders `sources`.
    ///
    /// # Errors
    /// A file without an import path, two with the same one, an import of nothing, imports in a circle.
    pub fn new(mut sources: Vec<Source>) -> Result<Self, Error> {
        for (index, source) in sources.iter().enumerate() {
            let Some(path) = &source.import_path else {
                return Err(Error::in_file(
                    &source.path,
                    "a shared shader file needs a line `#define_import_path name`",
                ));
            };
            if let Some(twin) = sources[..index].iter().find(|twin| twin.import_path.as_ref() == Some(path)) {
                return Err(Error::in_file(&source.path, format!("`{path}` is also the import path of {}", twin.path)));
            }
        }
        let mut library = Self::default();
        for source in &sources {
            check_imports(source, &sources)?;
        }
        while !sources.is_empty() {
            let ready =
                sources.iter().position(|source| source.imports.iter().all(|path| library.module(path).is_some()));
            let Some(ready) = ready else {
                let circle: Vec<_> = sources.iter().map(|source| source.path.as_str()).collect();
                return Err(Error::in_file(
                    &sources[0].path,
                    format!("shared shader files import each other in a circle: {}", circle.join(", ")),
                ));
            };
            library.modules.push(sources.remove(ready));
        }
        Ok(library)
    }

    /// The module with this import path.
    #[must_use]
    pub fn module(&self, import_path: &str) -> Option<&Source> {
        self.modules.iter().find(|module| module.import_path.as_deref() == Some(import_path))
    }

    /// All that `shader` imports, directly or not, each after its own imports, and then the shader.
    #[must_use]
    pub fn closure<'a>(&'a self, shader: &'a Source) -> Vec<&'a Source> {
        fn visit<'a>(library: &'a Library, source: &'a Source, out: &mut Vec<&'a Source>) {
            if out.iter().any(|seen| std::ptr::eq(*seen, source)) {
                return;
            }
            for module in source.imports.iter().filter_map(|path| library.module(path)) {
                visit(library, module, out);
            }
            out.push(source);
        }
        let mut out = Vec::new();
        visit(self, shader, &mut out);
        out
    }
}

/// Points at the import of a module that is not among `modules`.
pub fn check_imports(source: &Source, modules: &[Source]) -> Result<(), Error> {
    for import in &source.imports {
        if modules.iter().any(|module| module.import_path.as_ref() == Some(import)) {
            continue;
        }
        let message = format!("no shared shader file has the import path `{import}`");
        let clean = scan::without_comments(&source.text);
        return Err(match clean.find(import.as_str()) {
            Some(start) => Error::at(SourceSpan::of(&source.path, &source.text, start, import.len()), message),
            None => Error::in_file(&source.path, message),
        });
    }
    Ok(())
}

/// Composes shaders with the modules of a library. It caches modules by the flags that concern them, so keep one for a thread.
pub struct Composing<'a> {
    composer: Composer,
    library: &'a Library,
}

impl<'a> Composing<'a> {
    /// Takes in the library's modules.
    ///
    /// # Errors
    /// A module that cannot be preprocessed.
    pub fn new(library: &'a Library) -> Result<Self, Error> {
        let mut composing = Self { composer: Composer::default().with_capabilities(CAPABILITIES), library };
        for module in &library.modules {
            let descriptor =
                ComposableModuleDescriptor { source: &module.rewritten, file_path: &module.path, ..Default::default() };
            if let Err(error) = composing.composer.add_composable_module(descriptor) {
                return Err(composing.translate(&error, module));
            }
        }
        Ok(composing)
    }

    /// The naga module of `shader` with the given flags defined.
    ///
    /// # Errors
    /// Any fault of the shader or of its imports.
    pub fn compose(&mut self, shader: &Source, flags: &[&str]) -> Result<naga::Module, Error> {
        let defines: HashMap<_, _> =
            flags.iter().map(|flag| ((*flag).to_owned(), ShaderDefValue::Bool(true))).collect();
        let descriptor = NagaModuleDescriptor {
            source: &shader.rewritten,
            file_path: &shader.path,
            shader_defs: defines,
            ..Default::default()
        };
        // naga_oil asserts on some inputs instead of returning an error.
        match catch_unwind(AssertUnwindSafe(|| self.composer.make_naga_module(descriptor).map_err(Box::new))) {
            Ok(Ok(module)) => Ok(module),
            Ok(Err(error)) => Err(self.translate(&error, shader)),
            Err(_) => Err(Error::in_file(
                &shader.path,
                "naga_oil failed on this shader without saying where (its message is above)",
            )),
        }
    }

    fn translate(&self, error: &ComposerError, shader: &Source) -> Error {
        let path = error.source.path(&self.composer).clone();
        let composed = error.source.source(&self.composer);
        let (message, mut span, mut notes) = describe(&error.inner, error.source.offset());
        if let (ComposerErrorInner::InvalidIdentifier { original, .. }, Some((start, _))) = (&error.inner, span) {
            // naga_oil points at the item, but the invalid name may be a member's.
            let clean = scan::without_comments(&composed);
            let named = scan::tokens(&clean).into_iter().find(|token| token.start >= start && token.text == original);
            span = named.map(|token| (token.start, token.text.len())).or(span);
        }
        let file = self.library.modules.iter().chain([shader]).find(|file| file.path == path);
        let located = span.zip(file).map(|((start, length), file)| original_place(file, &composed, start, length));
        let mut out = match located {
            Some(location) => Error::at(location, undecorate(&message)),
            None => Error::in_file(&path, undecorate(&message)),
        };
        out.notes.extend(notes.drain(..).map(|note| undecorate(&note)));
        out
    }
}

type Described = (String, Option<(usize, usize)>, Vec<String>);

/// The message of an error, its place in the composed text that begins at `offset`, and its causes.
fn describe(error: &ComposerErrorInner, offset: usize) -> Described {
    use ComposerErrorInner as E;
    let place = |span: naga::Span| {
        let range = span.to_range()?;
        let low = |at: usize| (at & ((1 << PLACE_BITS) - 1)).checked_sub(offset);
        Some((low(range.start)?, low(range.end)?.saturating_sub(low(range.start)?)))
    };
    match error {
        E::WgslParseError(parse) => {
            let labels: Vec<_> = parse.labels().collect();
            let span = labels.iter().find_map(|(span, _)| place(*span));
            let mut notes: Vec<_> =
                labels.iter().map(|(_, label)| (*label).to_owned()).filter(|label| !label.is_empty()).collect();
            notes.extend(parse.notes().map(str::to_owned));
            notes.retain(|note| *note != parse.message());
            (parse.message().to_owned(), span, notes)
        }
        E::HeaderValidationError(invalid) | E::ShaderValidationError(invalid) => {
            let span = invalid.spans().filter_map(|(span, _)| place(*span)).last();
            let mut messages = vec![invalid.as_inner().to_string()];
            let mut cause = std::error::Error::source(invalid.as_inner());
            while let Some(error) = cause {
                messages.push(error.to_string());
                cause = error.source();
            }
            // The innermost cause names the fault, the outer ones its place.
            let message = messages.pop().unwrap_or_default();
            messages.reverse();
            (message, span, messages)
        }
        E::InvalidIdentifier { original, at } => {
            let message = format!(
                "`{original}` cannot be exported: a name that modules share cannot end in a digit or `_`, nor be a keyword of WGSL"
            );
            (message, place(*at), Vec::new())
        }
        other => (other.to_string(), position(other).map(|at| (at, 1)), Vec::new()),
    }
}

fn position(error: &ComposerErrorInner) -> Option<usize> {
    use ComposerErrorInner as E;
    match error {
        E::NotEnoughEndIfs(at) | E::TooManyEndIfs(at) | E::ElseWithoutCondition(at) | E::DefineInModule(at) => {
            Some(*at)
        }
        E::ImportParseError(_, at) | E::ImportNotFound(_, at) => Some(*at),
        E::UnknownShaderDef { pos, .. }
        | E::UnknownShaderDefOperator { pos, .. }
        | E::InvalidShaderDefComparisonValue { pos, .. }
        | E::OverrideNotVirtual { pos, .. }
        | E::InvalidShaderDefDefinitionValue { pos, .. } => Some(*pos),
        E::DecorationInSource(range) => Some(range.start),
        _ => None,
    }
}

/// The place in `file` of the text at `start` in `composed`, its preprocessed text. Preprocessing keeps lines, but makes imported names and overrides
/// longer within a line. So this looks for the same occurrence of the same word.
fn original_place(file: &Source, composed: &str, start: usize, length: usize) -> SourceSpan {
    let inside = SourceSpan::of("", composed, start, length);
    let line_start: usize = file.text.split_inclusive('\n').take(inside.line - 1).map(str::len).sum();
    let line = file.text[line_start..].lines().next().unwrap_or("");
    let before: String = inside.text.chars().take(inside.column - 1).collect();
    let marked: String = inside.text.chars().skip(inside.column - 1).take(inside.length).collect();
    let (whole, before, marked) =
        (undecorate_words(&inside.text), undecorate_words(&before), undecorate_words(&marked));
    let at = |found: usize| SourceSpan::of(&file.path, &file.text, line_start + found, marked.len());
    let words = scan::tokens(&whole);
    let Some(word) = words.iter().find(|word| word.end() > before.len()) else {
        // The end of the line, or of the file.
        return SourceSpan::of(&file.path, &file.text, line_start + line.len(), 1);
    };
    let earlier = words.iter().filter(|other| other.start < word.start && other.text == word.text).count();
    match scan::tokens(line).iter().filter(|other| other.text == word.text).nth(earlier) {
        Some(same) => at(same.start),
        None => at(before.len().min(line.len())),
    }
}

/// Drops the decoration from every name.
fn undecorate_words(text: &str) -> String {
    replace_decorations(text, |name, _| name.to_owned())
}

/// Writes every decorated name as `module::name`.
fn undecorate(text: &str) -> String {
    replace_decorations(text, |name, module| format!("{module}::{name}"))
}

fn replace_decorations(text: &str, write: impl Fn(&str, &str) -> String) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once(DECORATION) {
        let name_at = before
            .rfind(|c: char| c != '_' && !c.is_alphanumeric())
            .map_or(0, |at| at + before[at..].chars().next().map_or(0, char::len_utf8));
        // Base 32 also uses X, so the closing X is the last one before the next character outside its alphabet.
        let coded = after.find(|c: char| !c.is_ascii_uppercase() && !c.is_ascii_digit()).unwrap_or(after.len());
        let module = base32(after[..coded].strip_suffix('X').unwrap_or(&after[..coded]));
        out.push_str(&before[..name_at]);
        out.push_str(&write(&before[name_at..], &module));
        rest = &after[coded..];
    }
    out + rest
}

/// Decodes RFC 4648 base 32 without padding; invalid bytes become a replacement character.
fn base32(coded: &str) -> String {
    let (mut bits, mut held, mut bytes) = (0_u32, 0_u32, Vec::new());
    for digit in coded.bytes() {
        let value = match digit {
            b'A'..=b'Z' => digit - b'A',
            b'2'..=b'7' => digit - b'2' + 26,
            _ => continue,
        };
        bits = (bits << 5) | u32::from(value);
        held += 5;
        if held >= 8 {
            held -= 8;
            bytes.push((bits >> held) as u8);
            bits &= (1 << held) - 1;
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lose_and_keep_their_module() {
        let name = Composer::decorated_name(Some("afterlight::brdf"), "specular");
        assert_eq!(source_name(&name), "specular");
        assert_eq!(undecorate(&format!("no `{name}` here")), "no `afterlight::brdf::specular` here");
        assert_eq!(undecorate_words(&format!("a({name}, {name})")), "a(specular, specular)");
    }
}
