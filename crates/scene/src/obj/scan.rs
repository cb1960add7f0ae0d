//! The first reading of an OBJ: checks every number and index while its line is known, and writes the text that tobj then reads. A face that
//! cannot be drawn is left out with a warning, and all others are drawn.
//!
//! tobj stops at the first odd line without saying which, reads one `mtllib` name a line, has no smoothing groups, and makes
//! uneven arrays of faces that carry texture coordinates only here and there. So the scan hands it a text of `v`, `vt`, `vn`
//! and `f` with absolute indices, its faces sorted into parts that are alike in group, material, smoothing and in what their
//! corners carry: each part is one tobj object, named by its number.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::colors::Colors;
use super::keywords::{CONTINUATION, KEYWORDS, lower};
use super::numbers::{Odd, index, number};
use super::text;
use super::tobj_text::{push_number, write_face};
use crate::Error;

/// Faces of more corners keep their line, because cutting them may take too long: up to the cube of their corners in steps.
const LARGE: usize = 256;

/// The rule for making normals that a file does not give.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Smoothing {
    /// The file never said.
    Unstated,
    /// `s off`: every face is flat.
    Off,
    /// `s n`: smooth within the group, with hard edges to all others.
    Group(u32),
}

/// Faces that are alike; indices into `Scan`'s tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct FaceKey {
    pub group: usize,
    pub material: usize,
    pub smoothing: Smoothing,
    pub has_uvs: bool,
    pub has_normals: bool,
}

/// An OBJ file, checked.
#[derive(Debug, Default)]
pub(super) struct Scan {
    /// The text that tobj reads.
    pub text: String,
    pub parts: Vec<FaceKey>,
    /// Names of groups; the first stands for faces before any.
    pub groups: Vec<String>,
    /// Names that `usemtl` gave and the line of the first; an empty one stands for faces before any.
    pub materials: Vec<(String, usize)>,
    /// The text after each `mtllib`, and its line.
    pub libraries: Vec<(String, usize)>,
    /// sRGB colours of vertices; empty where the file has none. In its text a vertex's number then stands where tobj looks for red.
    pub colors: Vec<[f32; 3]>,
    /// Faces of many corners: the index of its part, how many corners, and its line.
    pub large: Vec<(usize, usize, usize)>,
    /// Warnings about lines that are not drawn, a line each.
    pub warnings: Vec<String>,
}

/// Reads `text`, the content of `path`.
///
/// # Errors
/// `Error::Content` for a file of which no face can be drawn, with the line of the first fault, if there is one.
pub(super) fn scan(path: &Path, text: &str) -> Result<Scan, Error> {
    let exists = ["v", "vt", "vn"].map(|keyword| {
        text.lines().any(|line| {
            let (found, rest) = text::split_keyword(line.trim_start());
            found.eq_ignore_ascii_case(keyword) && !rest.is_empty()
        })
    });
    let mut scanner = Scanner { text: String::with_capacity(text.len()), exists, ..Scanner::default() };
    for (line, statement) in text::statements(text, &CONTINUATION) {
        let (keyword, rest) = text::split_keyword(&statement);
        scanner.statement(line, &lower(keyword), rest);
    }
    scanner.finish().map_err(|(line, what)| Error::Content { path: path.to_owned(), line, what })
}

/// Numbers for names, in order of appearance.
#[derive(Default)]
struct Interner {
    ids: HashMap<String, usize>,
    names: Vec<(String, usize)>,
}

impl Interner {
    fn id(&mut self, name: &str, line: usize) -> usize {
        if let Some(&id) = self.ids.get(name) {
            return id;
        }
        self.names.push((name.to_owned(), line));
        self.ids.insert(name.to_owned(), self.names.len() - 1);
        self.names.len() - 1
    }
}

#[derive(Default)]
struct Scanner {
    /// The `v`, `vt` and `vn` lines so far, as tobj shall read them.
    text: String,
    /// The `f` lines of each part, as tobj shall read them.
    faces: Vec<String>,
    parts: Vec<FaceKey>,
    part_ids: HashMap<FaceKey, usize>,
    groups: Interner,
    materials: Interner,
    object_name: String,
    group_name: String,
    group: Option<usize>,
    material: Option<usize>,
    smoothing: Option<Smoothing>,
    libraries: Vec<(String, usize)>,
    /// True for each of positions, texture coordinates and normals that the file has.
    exists: [bool; 3],
    /// The number of each so far.
    counts: [usize; 3],
    /// Positions that are none.
    no_places: HashSet<usize>,
    /// Faces that name what only comes later, or never.
    early: Vec<Early>,
    large: Vec<(usize, usize, usize)>,
    colors: Colors,
    /// True once its text has the vertices' numbers.
    is_numbered: bool,
    lines: usize,
    points: usize,
    odd: OddLines,
    corners: Vec<[usize; 3]>,
}

/// Lines that are not drawn as they are written.
#[derive(Default)]
struct OddLines {
    /// Numbers of each kind that are none.
    numbers: [Odd; 3],
    /// Faces that are left out.
    faces: Odd,
    /// Indices of texture coordinates and normals that are left out.
    indices: Odd,
    /// Corners that name an attribute of which the file has none at all.
    dangling: Odd,
    /// Corners without the attribute that others of their face have.
    partial: Odd,
    unknown: Odd,
}

/// A face's line, and the state that earlier statements set for it.
#[derive(Clone, Copy)]
struct FaceState {
    line: usize,
    group: usize,
    material: usize,
    smoothing: Smoothing,
}

/// A face that names a vertex before it is there.
struct Early {
    place: FaceState,
    corners: Vec<[usize; 3]>,
}

impl Scanner {
    fn statement(&mut self, line: usize, keyword: &str, rest: &str) {
        match keyword {
            "v" => self.vertex(line, rest),
            "vt" => self.numbers(line, 1, rest, 1, 2),
            "vn" => self.numbers(line, 2, rest, 3, 3),
            "f" | "fo" => self.face(line, rest),
            "l" => self.lines += 1,
            "p" => self.points += rest.split_whitespace().count(),
            "o" => (self.object_name, self.group_name, self.group) = (rest.to_owned(), String::new(), None),
            "g" => (self.group_name, self.group) = (rest.to_owned(), None),
            "s" => self.smoothing = Some(smoothing(rest)),
            "usemtl" => self.material = Some(self.materials.id(rest, line)),
            "mtllib" => self.libraries.push((rest.to_owned(), line)),
            "#mrgb" => {
                self.number_vertices();
                self.colors.paint(rest);
            }
            // Display attributes that change nothing here.
            "" | "mg" | "bevel" | "c_interp" | "d_interp" | "lod" | "shadow_obj" | "trace_obj" | "usemap"
            | "maplib" => {}
            _ if keyword.starts_with('#') => {}
            // Curves and surfaces, among others.
            _ if KEYWORDS.contains(&keyword) => self.odd.unknown.add(line, || format!("`{keyword}` is not supported")),
            _ => self.odd.unknown.add(line, || format!("`{keyword}` is not known")),
        }
    }

    /// Takes a vertex: its place, perhaps a weight, which polygons do not use, and perhaps a colour.
    fn vertex(&mut self, line: usize, rest: &str) {
        self.numbers(line, 0, rest, 3, 3);
        let mut words = rest.split_whitespace().take_while(|word| !word.starts_with('#')).skip(3);
        let more: [Option<&str>; 5] = std::array::from_fn(|_| words.next());
        let more: Vec<&str> = more.into_iter().map_while(|word| word).collect();
        let is_numbered = self.is_numbered;
        if (3..5).contains(&more.len()) {
            self.number_vertices();
            self.colors.set(self.counts[0] - 1, &more);
        }
        if is_numbered {
            // The number goes before the line's end.
            self.text.pop();
            push_number(&mut self.text, self.counts[0] - 1);
            self.text.push('\n');
        }
    }

    /// Copies the `wanted` numbers of a `v`, `vt` or `vn` line. Only the first `needed` must be there; the others default to 0.
    fn numbers(&mut self, line: usize, kind: usize, rest: &str, needed: usize, wanted: usize) {
        let keyword = ["v", "vt", "vn"][kind];
        let before = self.text.len();
        self.text.push_str(keyword);
        let mut words = rest.split_whitespace().take_while(|word| !word.starts_with('#'));
        let fault = (0..wanted).find_map(|found| {
            let word = match words.next() {
                Some(word) => word,
                None if found >= needed => "0",
                None => return Some(format!("`{keyword}` has {found} numbers instead of {wanted}")),
            };
            match number(word) {
                Ok(word) => {
                    self.text.push(' ');
                    self.text.push_str(&word);
                    None
                }
                Err(fault) => Some(fault),
            }
        });
        self.counts[kind] += 1;
        if kind == 2 && fault.is_none() && self.text[before + keyword.len()..].split_whitespace().all(is_zero) {
            self.odd.numbers[kind].add(line, || "a normal without a length".into());
        }
        if let Some(fault) = fault {
            self.text.truncate(before);
            self.text.push_str(keyword);
            self.text.push_str(&" 0"[..].repeat(wanted));
            self.odd.numbers[kind].add(line, || fault);
            if kind == 0 {
                self.no_places.insert(self.counts[0]);
            }
        }
        self.text.push('\n');
    }

    /// Starts to append each vertex's number to its line, at the first colour. Lines that are already written get theirs now.
    fn number_vertices(&mut self) {
        if std::mem::replace(&mut self.is_numbered, true) {
            return;
        }
        let text = std::mem::take(&mut self.text);
        let mut vertex = 0;
        for line in text.lines() {
            self.text.push_str(line);
            // The last vertex may be the one whose colour has just been found.
            if line.starts_with("v ") {
                push_number(&mut self.text, vertex);
                vertex += 1;
            }
            self.text.push('\n');
        }
    }

    fn face(&mut self, line: usize, rest: &str) {
        self.corners.clear();
        for word in rest.split_whitespace().take_while(|word| !word.starts_with('#')) {
            match self.corner(line, word) {
                Ok(corner) => self.corners.push(corner),
                Err(fault) => return self.odd.faces.add(line, || fault),
            }
        }
        match self.corners.len() {
            0 => return self.odd.faces.add(line, || "a face without corners".into()),
            1 => return self.points += 1,
            2 => return self.lines += 1,
            _ => {}
        }
        let place = FaceState {
            line,
            group: self.group(line),
            material: *self.material.get_or_insert_with(|| self.materials.id("", line)),
            smoothing: self.smoothing.unwrap_or(Smoothing::Unstated),
        };
        let counts = self.counts;
        let is_there = |corner: &[usize; 3]| corner.iter().zip(counts).all(|(&index, count)| index <= count);
        if self.corners.iter().all(is_there) {
            let corners = std::mem::take(&mut self.corners);
            self.push_face(place, &corners);
            self.corners = corners;
        } else {
            self.early.push(Early { place, corners: self.corners.clone() });
        }
    }

    /// Reads a corner: one-based indices of position, texture coordinate and normal; 0 for an absent one.
    ///
    /// # Errors
    /// The fault of the position's index.
    fn corner(&mut self, line: usize, word: &str) -> Result<[usize; 3], String> {
        let mut indices = [0; 3];
        for (kind, part) in word.split('/').enumerate() {
            let Some(slot) = indices.get_mut(kind) else {
                self.odd.indices.add(line, || format!("`{word}` has more than three indices"));
                break;
            };
            if part.is_empty() {
                continue;
            }
            if kind > 0 && !self.exists[kind] {
                // Exporters that dropped a whole attribute leave its indices behind; nothing is lost by letting them go.
                self.odd.dangling.add(line, String::new);
                continue;
            }
            match index(part, word, self.counts[kind]) {
                Ok(index) => *slot = index,
                Err(fault) if kind == 0 => return Err(fault),
                Err(fault) => self.odd.indices.add(line, || fault),
            }
        }
        if indices[0] == 0 { Err(format!("`{word}` names no vertex")) } else { Ok(indices) }
    }

    fn group(&mut self, line: usize) -> usize {
        if let Some(group) = self.group {
            return group;
        }
        let separator = if self.object_name.is_empty() || self.group_name.is_empty() { "" } else { "/" };
        let id = self.groups.id(&format!("{}{separator}{}", self.object_name, self.group_name), line);
        *self.group.insert(id)
    }

    /// Writes a face whose indices are all in range.
    fn push_face(&mut self, place: FaceState, corners: &[[usize; 3]]) {
        let FaceState { line, group, material, smoothing } = place;
        let is_nowhere = |corner: &&[usize; 3]| self.no_places.contains(&corner[0]);
        if !self.no_places.is_empty()
            && let Some([vertex, ..]) = corners.iter().find(is_nowhere)
        {
            return self.odd.faces.add(line, || format!("vertex {vertex} has no place"));
        }
        let [has_uvs, has_normals] = [1, 2].map(|kind| corners.iter().all(|corner| corner[kind] > 0));
        for (kind, is_whole) in [(1, has_uvs), (2, has_normals)] {
            if !is_whole && corners.iter().any(|corner| corner[kind] > 0) {
                let what = ["texture coordinates", "normals"][kind - 1];
                self.odd.partial.add(line, || format!("{what} at some corners of a face only"));
            }
        }
        let part = FaceKey {
            group,
            material,
            // Beside normals of the file, smoothing changes nothing and would only split the mesh.
            smoothing: if has_normals { Smoothing::Unstated } else { smoothing },
            has_uvs,
            has_normals,
        };
        let id = *self.part_ids.entry(part).or_insert_with(|| {
            self.parts.push(part);
            self.faces.push(String::new());
            self.parts.len() - 1
        });
        if corners.len() > LARGE {
            self.large.push((id, corners.len(), line));
        }
        write_face(&mut self.faces[id], corners, &part);
    }

    /// Writes the faces that named what came later.
    fn push_early_faces(&mut self) {
        for Early { place, mut corners } in std::mem::take(&mut self.early) {
            let mut fault = None;
            for (kind, what) in ["vertices", "texture coordinates", "normals"].into_iter().enumerate() {
                let count = self.counts[kind];
                for index in corners.iter_mut().map(|corner| &mut corner[kind]).filter(|index| **index > count) {
                    let told = format!("index {index} is out of range: the file has {count} {what}");
                    if kind == 0 {
                        fault.get_or_insert(told);
                    } else {
                        self.odd.indices.add(place.line, || told);
                        *index = 0;
                    }
                }
            }
            match fault {
                Some(fault) => self.odd.faces.add(place.line, || fault),
                None => self.push_face(place, &corners),
            }
        }
    }

    fn finish(mut self) -> Result<Scan, (Option<usize>, String)> {
        self.push_early_faces();
        if self.parts.is_empty() {
            // The first fault is the reason, rather than that nothing was left.
            let faults = [&self.odd.numbers[0], &self.odd.faces].into_iter().filter_map(|odd| odd.first.clone());
            if let Some((line, what)) = faults.min() {
                return Err((Some(line), what));
            }
            let (points, lines) = (self.points, self.lines);
            let vertices = self.counts[0];
            let what = format!("has no faces to draw ({vertices} vertices, {lines} lines, {points} points)");
            return Err((None, what));
        }
        let mut warnings = self.warnings();
        let mut colors = Vec::new();
        if !self.colors.is_empty() {
            let (decided, odd) = std::mem::take(&mut self.colors).decided(self.counts[0]);
            colors = decided;
            warnings.extend(odd);
        }
        let mut text = self.text;
        for (id, faces) in self.faces.iter().enumerate() {
            text.push_str(&format!("o {id}\n"));
            text.push_str(faces);
        }
        let groups = self.groups.names.into_iter().map(|(name, _)| name).collect();
        Ok(Scan {
            text,
            parts: self.parts,
            groups,
            materials: self.materials.names,
            libraries: self.libraries,
            colors,
            large: self.large,
            warnings,
        })
    }

    fn warnings(&self) -> Vec<String> {
        let OddLines { numbers: [places, uvs, normals], faces, indices, dangling, partial, unknown } = &self.odd;
        let drawn = (self.lines + self.points > 0)
            .then(|| format!("lines ({}) and points ({}) are not drawn", self.lines, self.points));
        let dangling = dangling.first.as_ref().map(|(line, _)| {
            format!("line {line}: indices of texture coordinates or normals, but the file has none of them")
        });
        let all = [
            drawn,
            places.warning("the vertex has no place", "vertices"),
            uvs.warning("taken for 0", "texture coordinates"),
            normals.warning("the normal is made from the faces", "normals"),
            faces.warning("the face is left out", "faces"),
            indices.warning("drawn without that", "indices"),
            partial.warning("drawn without them", "faces"),
            dangling,
            unknown.warning("left out", "lines"),
        ];
        all.into_iter().flatten().collect()
    }
}

/// Returns true if a number that has been read is 0.
fn is_zero(number: &str) -> bool {
    number.parse() == Ok(0.0_f64)
}

fn smoothing(rest: &str) -> Smoothing {
    match rest.split_whitespace().next() {
        None | Some("off" | "0" | "null") => Smoothing::Off,
        Some("on") => Smoothing::Group(1),
        // A name instead of a number still names one group.
        Some(group) => Smoothing::Group(group.parse().unwrap_or(1)),
    }
}
