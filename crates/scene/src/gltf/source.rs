//! The data of a primitive, from accessors or from its compressed block.

use std::cell::RefCell;

use super::accessor::Accessors;
use super::buffers::Buffers;
use super::draco;
use super::json::{Attributes, Document, Primitive, Whole, entry};

/// The source of a primitive's attributes and indices.
pub(super) struct PrimitiveSource<'a> {
    document: &'a Document,
    accessors: &'a Accessors<'a>,
    primitive: &'a Primitive,
    packed: Option<(draco_core::Mesh, &'a Attributes)>,
    odd: RefCell<Vec<String>>,
}

impl<'a> PrimitiveSource<'a> {
    pub fn open(
        document: &'a Document,
        buffers: &'a Buffers<'a>,
        accessors: &'a Accessors<'a>,
        primitive: &'a Primitive,
    ) -> Result<Self, String> {
        let mut odd = Vec::new();
        let position = primitive.attributes.get("POSITION").and_then(|own| document.accessors.get(own.0));
        let is_plain = position.is_some_and(|accessor| accessor.buffer_view.is_some());
        let packed = match &primitive.extensions.draco {
            Some(packed) => {
                let view = packed.buffer_view.ok_or_else(|| "its Draco data has no buffer view".to_owned());
                let mesh = view.and_then(|view| draco::decode(buffers.view(view)?.bytes));
                match mesh {
                    Ok(mesh) => Some((mesh, &packed.attributes)),
                    // The accessors hold the same data, for readers that cannot decompress.
                    Err(why) if is_plain => {
                        odd.push(format!("{why}, its accessors are read in its place"));
                        None
                    }
                    Err(why) => return Err(why),
                }
            }
            None => None,
        };
        Ok(Self { document, accessors, primitive, packed, odd: odd.into() })
    }

    /// Takes the oddities that reading has found.
    pub fn take_warnings(&self) -> Vec<String> {
        self.odd.take()
    }

    /// Elements of an attribute, if the primitive has it.
    pub fn floats<const N: usize>(
        &self,
        semantic: &str,
        kinds: &[&str],
        missing: f32,
    ) -> Result<Option<Vec<[f32; N]>>, String> {
        let Some(&accessor) = self.primitive.attributes.get(semantic) else { return Ok(None) };
        let read = match self.packed(semantic) {
            Some((mesh, id)) => self.unpacked(mesh, (semantic, id), accessor, missing),
            None => self.accessors.floats(accessor, kinds, missing).map(|found| self.shares(semantic, accessor, found)),
        };
        read.map(Some).map_err(|what| format!("{semantic}: {what}"))
    }

    /// Treats integer colours above 1 as shares of the type's largest value, even if their accessor is not marked as normalized.
    fn shares<const N: usize>(&self, semantic: &str, accessor: Whole, mut found: Vec<[f32; N]>) -> Vec<[f32; N]> {
        let Some(accessor) = self.document.accessors.get(accessor.0) else { return found };
        let most = match (accessor.normalized, accessor.component_type.0) {
            (false, 5121) => 255.0,
            (false, 5123) => 65535.0,
            _ => return found,
        };
        let is_share = |element: &[f32; N]| element.iter().all(|number| *number <= 1.0);
        if !semantic.starts_with("COLOR_") || found.iter().all(is_share) {
            return found;
        }
        self.odd.borrow_mut().push(format!("{semantic}: {NOT_NORMALIZED}"));
        // A missing fourth component is 1 already.
        let width = if accessor.kind == "VEC3" { N.min(3) } else { N };
        found.iter_mut().flat_map(|element| &mut element[..width]).for_each(|number| *number /= most);
        found
    }

    /// Returns true if the primitive has an attribute.
    pub fn has(&self, semantic: &str) -> bool {
        self.primitive.attributes.contains_key(semantic)
    }

    /// Returns the number of its morph targets.
    pub fn targets(&self) -> usize {
        self.primitive.targets.len()
    }

    /// Elements of an attribute of a morph target, if it has it. They are never compressed with the primitive.
    pub fn of_target<const N: usize>(
        &self,
        target: usize,
        semantic: &str,
        kinds: &[&str],
    ) -> Result<Option<Vec<[f32; N]>>, String> {
        let accessor = self.primitive.targets.get(target).and_then(|target| target.get(semantic));
        let read = accessor.map(|&accessor| self.accessors.floats(accessor, kinds, 0.0)).transpose();
        read.map_err(|what| format!("{semantic}: {what}"))
    }

    /// Elements of four whole numbers.
    pub fn quadruples(&self, semantic: &str) -> Result<Option<Vec<[u32; 4]>>, String> {
        let Some(&accessor) = self.primitive.attributes.get(semantic) else { return Ok(None) };
        let read = match self.packed(semantic) {
            // The numbers are at most 65535, which f32 holds exactly.
            Some((mesh, id)) => {
                let four = |four: &[f32; 4]| four.map(|n| n as u32);
                draco::of_width(mesh, id, 4).map(|own| own.numbers.as_chunks::<4>().0.iter().map(four).collect())
            }
            None => self.accessors.quadruples(accessor),
        };
        read.map(Some).map_err(|what| format!("{semantic}: {what}"))
    }

    /// The vertex indices; `None` if the primitive is not indexed.
    pub fn indices(&self) -> Result<Option<Vec<u32>>, String> {
        if let Some((mesh, _)) = &self.packed {
            return Ok(Some(draco::indices(mesh)));
        }
        let read = self.primitive.indices.map(|accessor| self.accessors.indices(accessor)).transpose();
        read.map_err(|what| format!("indices: {what}"))
    }

    /// Returns the mode of the indices; compressed ones are always single triangles.
    pub fn mode(&self) -> usize {
        if self.packed.is_some() { 4 } else { self.primitive.mode.map_or(4, |mode| mode.0) }
    }

    fn packed(&self, semantic: &str) -> Option<(&draco_core::Mesh, usize)> {
        let (mesh, attributes) = self.packed.as_ref()?;
        attributes.get(semantic).map(|id| (mesh, id.0))
    }

    fn unpacked<const N: usize>(
        &self,
        mesh: &draco_core::Mesh,
        (semantic, id): (&str, usize),
        accessor: Whole,
        missing: f32,
    ) -> Result<Vec<[f32; N]>, String> {
        let accessor = entry("accessor", &self.document.accessors, accessor)?;
        let width = match accessor.kind.as_str() {
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        let most = match (accessor.normalized, accessor.component_type.0) {
            (true, 5120) => 127.0,
            (true, 5121) => 255.0,
            (true, 5122) => 32767.0,
            (true, 5123) => 65535.0,
            _ => 1.0,
        };
        let own = if semantic.starts_with("COLOR_") {
            draco::read_attribute(mesh, id)?
        } else {
            draco::of_width(mesh, id, width)?
        };
        let mut most = most;
        if own.width != width {
            let words =
                format!("{semantic}: its Draco data has {} numbers an element, but its accessor {width}", own.width);
            self.odd.borrow_mut().push(format!("{words}: the ones in both are read"));
        }
        // Integers of another type than the accessor's would all be nearly white or nearly black.
        let is_color = semantic.starts_with("COLOR_");
        if let Some(largest) = own.largest.filter(|&largest| largest != most && (accessor.normalized || is_color)) {
            let words = match accessor.component_type.0 {
                5126 => "its Draco data is of whole numbers, but its accessor of floats: read as shares of the largest",
                _ if accessor.normalized => {
                    "its Draco data is of another type than its accessor: read as shares of the data's largest"
                }
                _ => NOT_NORMALIZED,
            };
            self.odd.borrow_mut().push(format!("{semantic}: {words}"));
            most = largest;
        }
        let element = |numbers: &[f32]| {
            let numbers = &numbers[..width.min(numbers.len())];
            std::array::from_fn(|index| numbers.get(index).map_or(missing, |number| (number / most).max(least(most))))
        };
        Ok(own.numbers.chunks_exact(own.width.max(1)).map(element).collect())
    }
}

/// The warning about colours of whole numbers.
const NOT_NORMALIZED: &str = "its whole numbers are not marked as normalized: read as shares of the largest";

/// The least value after a division by `most`: normalized numbers end at -1.
fn least(most: f32) -> f32 {
    if most > 1.0 { -1.0 } else { f32::NEG_INFINITY }
}
