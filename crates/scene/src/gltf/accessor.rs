//! Accessors as typed values. Counts, offsets, strides and sizes are checked before a byte is read, and all arithmetic with them. Of elements that reach
//! past the end of their bytes the ones before it are read.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

use super::buffers::{Buffers, StridedBytes};
use super::json::{Accessor, Document, Sparse, Whole, entry, named};

/// The most elements of an accessor without a view: nothing in the file stands behind them.
const MOST_ZEROS: usize = 1 << 22;

/// The type of an accessor's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(number: Whole) -> Result<Self, String> {
        Ok(match number.0 {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            other => return Err(format!("its component type is {other}, which does not exist")),
        })
    }

    const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

/// Accessors and their values.
pub(super) struct Accessors<'a> {
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    /// What was odd about the accessors that were read, a line each.
    odd: Mutex<BTreeSet<String>>,
}

/// An accessor whose layout has been checked.
struct Checked<'a> {
    index: Whole,
    accessor: &'a Accessor,
    component: Component,
    /// Numbers of an element.
    width: usize,
    /// The accessor's elements; `None` for zeros.
    elements: Option<Elements<'a>>,
    /// Elements that are there.
    count: usize,
}

/// Elements that all lie within `bytes`, one each `stride`.
#[derive(Clone, Copy)]
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    count: usize,
}

impl<'a> Elements<'a> {
    /// Takes `count` elements of a view. If the view has fewer, returns the elements that it has, with a warning.
    fn of(view: StridedBytes<'a>, offset: usize, count: usize, size: usize) -> Result<(Self, Option<String>), String> {
        let stride = view.stride.unwrap_or(size);
        if stride < size && count > 1 {
            return Err(format!("its elements of {size} bytes lie {stride} bytes apart"));
        }
        let short = || {
            format!(
                "its {count} elements of {size} bytes from byte {offset} on reach past their view of {} bytes",
                view.bytes.len()
            )
        };
        let bytes = view.bytes.get(offset..).filter(|bytes| bytes.len() >= size).ok_or_else(short)?;
        let there = (bytes.len() - size).checked_div(stride).map_or(count, |more| (more + 1).min(count));
        let odd = (there < count).then(|| format!("{}: the first {there} are read", short()));
        Ok((Self { bytes, stride, count: there }, odd))
    }

    /// Each element's bytes, and maybe more behind them.
    fn iter(self) -> impl Iterator<Item = &'a [u8]> {
        (0..self.count).map(move |index| &self.bytes[index * self.stride..])
    }
}

impl<'a> Accessors<'a> {
    pub fn new(document: &'a Document, buffers: &'a Buffers<'a>) -> Self {
        Self { document, buffers, odd: Mutex::default() }
    }

    /// Oddities of the accessors that were read so far, a line each.
    pub fn warnings(&self) -> Vec<String> {
        self.odd.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }

    fn note(&self, index: Whole, accessor: &Accessor, what: impl std::fmt::Display) {
        let line = format!("{}: {what}", named("accessor", index.0, accessor.name.as_ref()));
        self.odd.lock().unwrap_or_else(PoisonError::into_inner).insert(line);
    }

    /// Returns the number of elements that can be read of an accessor at most: fewer than it claims to have where its view ends before.
    pub fn count(&self, index: Whole) -> usize {
        let Some(accessor) = self.document.accessors.get(index.0) else { return 0 };
        let view = accessor.buffer_view.map(|view| self.document.buffer_views.get(view.0));
        let is_packed = view.flatten().is_some_and(|view| view.extensions.meshopt.is_some());
        match view {
            Some(view) if !is_packed => accessor.count.0.min(view.map_or(0, |view| view.byte_length.0)),
            _ => accessor.count.0,
        }
    }

    /// Elements of `N` numbers as floats; where the accessor has fewer, the others are `missing`. `kinds` are the types that it may have.
    pub fn floats<const N: usize>(&self, index: Whole, kinds: &[&str], missing: f32) -> Result<Vec<[f32; N]>, String> {
        self.within(index, kinds, |checked| checked.floats(self, missing))
    }

    /// Numbers as floats of 64 bits, one after the other.
    pub fn numbers<const N: usize>(&self, index: Whole, kinds: &[&str]) -> Result<Vec<[f64; N]>, String> {
        let floats = self.floats::<N>(index, kinds, 0.0)?;
        Ok(floats.into_iter().map(|element| element.map(f64::from)).collect())
    }

    /// Numbers of scalars.
    pub fn indices(&self, index: Whole) -> Result<Vec<u32>, String> {
        self.within(index, &["SCALAR"], |checked| {
            Ok(checked.whole::<1>(self)?.into_iter().map(|[index]| index).collect())
        })
    }

    /// Elements of four whole numbers.
    pub fn quadruples(&self, index: Whole) -> Result<Vec<[u32; 4]>, String> {
        self.within(index, &["VEC4"], |checked| checked.whole(self))
    }

    /// Returns true if an accessor's data begins where its components may (glTF 2.0, "Data Alignment"). It is read all the same.
    pub fn is_aligned(&self, index: Whole) -> bool {
        let Some(accessor) = self.document.accessors.get(index.0) else { return true };
        let Ok(component) = Component::of(accessor.component_type) else { return true };
        let view = accessor.buffer_view.and_then(|view| self.document.buffer_views.get(view.0));
        view.is_none_or(|view| {
            let start = view.byte_offset.0.checked_add(accessor.byte_offset.0);
            let stride = view.byte_stride.map_or(0, |stride| stride.0);
            start.is_some_and(|start| start.is_multiple_of(component.size())) && stride.is_multiple_of(component.size())
        })
    }

    fn within<T>(
        &self,
        index: Whole,
        kinds: &[&str],
        read: impl FnOnce(&Checked) -> Result<T, String>,
    ) -> Result<T, String> {
        let accessor = entry("accessor", &self.document.accessors, index)?;
        let checked = self.check((index, accessor), kinds).and_then(|checked| read(&checked));
        checked.map_err(|what| format!("{}: {what}", named("accessor", index.0, accessor.name.as_ref())))
    }

    fn check<'b>(&'b self, (index, accessor): (Whole, &'b Accessor), kinds: &[&str]) -> Result<Checked<'b>, String> {
        if !kinds.contains(&accessor.kind.as_str()) {
            return Err(format!("its type is {}, not {}", accessor.kind.escape_debug(), kinds.join(" or ")));
        }
        let width = match accessor.kind.as_str() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let component = Component::of(accessor.component_type)?;
        if width == 16 && component != Component::F32 {
            return Err("is of matrices whose numbers are no floats".into());
        }
        let count = accessor.count.0;
        if count == 0 {
            return Err("has no elements".into());
        }
        let elements = match accessor.buffer_view {
            Some(view) => {
                let view = self.buffers.view(view)?;
                let (elements, odd) = Elements::of(view, accessor.byte_offset.0, count, width * component.size())?;
                odd.into_iter().for_each(|odd| self.note(index, accessor, odd));
                Some(elements)
            }
            None if count > MOST_ZEROS => {
                return Err(format!("has {count} elements and no view: {MOST_ZEROS} at most are read of such"));
            }
            None => None,
        };
        let count = elements.map_or(count, |elements| elements.count);
        Ok(Checked { index, accessor, component, width, elements, count })
    }

    /// Returns the indices of the replaced elements, and their new values.
    fn sparse<'b>(&'b self, sparse: &Sparse, size: usize) -> Result<(Vec<usize>, Elements<'b>), String> {
        let component = Component::of(sparse.indices.component_type)?;
        if !matches!(component, Component::U8 | Component::U16 | Component::U32) {
            return Err("its indices are not of an unsigned type".into());
        }
        let [of_indices, of_values] = [sparse.indices.buffer_view, sparse.values.buffer_view];
        let view = |view: Option<Whole>| self.buffers.view(view.ok_or("names no buffer view")?);
        // Both are tightly packed: strides of their views, which may serve others as well, do not count.
        let packed = |view: StridedBytes<'b>| StridedBytes { stride: None, ..view };
        let count = sparse.count.0;
        let (indices, _) =
            Elements::of(packed(view(of_indices)?), sparse.indices.byte_offset.0, count, component.size())?;
        let indices: Vec<usize> = indices.iter().map(|bytes| whole(component, bytes) as usize).collect();
        let (values, _) = Elements::of(packed(view(of_values)?), sparse.values.byte_offset.0, count, size)?;
        Ok((indices, values))
    }
}

impl Checked<'_> {
    fn floats<const N: usize>(&self, accessors: &Accessors, missing: f32) -> Result<Vec<[f32; N]>, String> {
        let (width, normalized) = (self.width.min(N), self.accessor.normalized);
        macro_rules! read {
            ($kind:ty, $float:expr) => {
                self.gather(accessors, |bytes| {
                    let mut element = [missing; N];
                    for (number, bytes) in
                        element[..width].iter_mut().zip(bytes.as_chunks::<{ size_of::<$kind>() }>().0)
                    {
                        *number = $float(<$kind>::from_le_bytes(*bytes));
                    }
                    element
                })
            };
        }
        // Normalized numbers divide in f64, so that each is the f32 next to its value (glTF 2.0, "Animations": the equations).
        let share = |value: f64, most: f64| (value / most).max(-1.0) as f32;
        match (self.component, normalized) {
            (Component::F32, _) => read!(f32, |value: f32| value),
            (Component::I8, true) => read!(i8, |value: i8| share(value.into(), 127.0)),
            (Component::U8, true) => read!(u8, |value: u8| share(value.into(), 255.0)),
            (Component::I16, true) => read!(i16, |value: i16| share(value.into(), 32767.0)),
            (Component::U16, true) => read!(u16, |value: u16| share(value.into(), 65535.0)),
            (Component::U32, true) => read!(u32, |value: u32| share(value.into(), f64::from(u32::MAX))),
            (Component::I8, false) => read!(i8, f32::from),
            (Component::U8, false) => read!(u8, f32::from),
            (Component::I16, false) => read!(i16, f32::from),
            (Component::U16, false) => read!(u16, f32::from),
            (Component::U32, false) => read!(u32, |value: u32| value as f32),
        }
    }

    /// Unsigned numbers. A number of another type that is none becomes the largest, which nothing has.
    fn whole<const N: usize>(&self, accessors: &Accessors) -> Result<Vec<[u32; N]>, String> {
        let component = self.component;
        if matches!(component, Component::U8 | Component::U16 | Component::U32) {
            return self.gather(accessors, |bytes| {
                std::array::from_fn(|number| whole(component, &bytes[number * component.size()..]))
            });
        }
        accessors.note(self.index, self.accessor, "its numbers are not of an unsigned type, read all the same");
        let is_whole = |value: f32| value.fract() == 0.0 && (0.0..=16_777_216.0).contains(&value);
        let number = |value: f32| if is_whole(value) { value as u32 } else { u32::MAX };
        Ok(self.floats::<N>(accessors, 0.0)?.into_iter().map(|element| element.map(number)).collect())
    }

    /// The elements as `read` has them of their bytes.
    fn gather<T: Copy>(&self, accessors: &Accessors, read: impl Fn(&[u8]) -> T) -> Result<Vec<T>, String> {
        let size = self.width * self.component.size();
        let mut values: Vec<T> = match self.elements {
            Some(elements) => elements.iter().map(|bytes| read(&bytes[..size])).collect(),
            // All bits 0 is the number 0 of each type; a matrix of floats is the largest element.
            None => vec![read(&[0; 64][..size]); self.count],
        };
        let Some(sparse) = &self.accessor.sparse else { return Ok(values) };
        match accessors.sparse(sparse, size) {
            Ok((indices, elements)) => {
                let mut left_out = sparse.count.0 - indices.len().min(elements.count).min(sparse.count.0);
                for (index, bytes) in indices.into_iter().zip(elements.iter()) {
                    match values.get_mut(index) {
                        Some(value) => *value = read(&bytes[..size]),
                        None => left_out += 1,
                    }
                }
                if left_out > 0 {
                    let what = "sparse elements that are not there, or replace none of its own, are left out";
                    accessors.note(self.index, self.accessor, format!("{left_out} {what}"));
                }
            }
            Err(why) => accessors.note(self.index, self.accessor, format!("sparse: {why}: left out")),
        }
        Ok(values)
    }
}

/// An unsigned number; `bytes` has at least its own.
fn whole(component: Component, bytes: &[u8]) -> u32 {
    match (component, bytes) {
        (Component::U8, [a, ..]) => u32::from(*a),
        (Component::U16, [a, b, ..]) => u32::from(u16::from_le_bytes([*a, *b])),
        (_, [a, b, c, d, ..]) => u32::from_le_bytes([*a, *b, *c, *d]),
        _ => 0,
    }
}
