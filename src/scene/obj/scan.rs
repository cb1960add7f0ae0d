//! The first reading of an OBJ: checks every number and index while its line is known, and writes the text that tobj then reads.
//!
//! tobj stops at the first odd line without saying which, reads one `mtllib` name a line, has no smoothing groups, and makes
//! uneven arrays of faces that carry texture coordinates only here and there. So the scan hands it a text of `v`, `vt`, `vn`
//! and `f` with absolute indices, its faces sorted into parts that are alike in group, material, smoothing and in what their
//! corners carry: each part is one tobj object, named by its number.

use std::collections::HashMap;
use std::path::Path;

use super::text;
use crate::scene::Error;

/// Largest magnitude of any number: f64 still tells an eighth of a metre apart there, and squares stay finite in f32.
const LARGEST: f64 = 1e15;

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
pub(super) struct Part {
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
    pub parts: Vec<Part>,
    /// Names of groups; the first stands for faces before any.
    pub groups: Vec<String>,
    /// Names that `usemtl` gave and the line of the first; an empty one stands for faces before any.
    pub materials: Vec<(String, usize)>,
    /// The text after each `mtllib`, and its line.
    pub libraries: Vec<(String, usize)>,
    /// Warnings of what is not drawn, a line each.
    pub warnings: Vec<String>,
}

/// Reads `text`, the content of `path`.
///
/// # Errors
/// `Error::Content` with the line for a number that is none, not finite or too large, for an index that is none or points
/// nowhere; without one for a file that has no faces.
pub(super) fn scan(path: &Path, text: &str) -> Result<Scan, Error> {
    let exists = ["v", "vt", "vn"].map(|keyword| {
        text.lines().any(|line| {
            let after = line.trim_start().strip_prefix(keyword);
            after.is_some_and(|rest| rest.starts_with(char::is_whitespace))
        })
    });
    let mut scanner = Scanner { text: String::with_capacity(text.len()), exists, ..Scanner::default() };
    for (line, statement) in text::statements(text) {
        let (keyword, rest) = text::split_keyword(&statement);
        scanner.statement(line, keyword, rest).map_err(|what| Error::Content {
            path: path.to_owned(),
            line: Some(line),
            what,
        })?;
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
    /// `v`, `vt` and `vn` so far, as tobj shall read them.
    text: String,
    /// The same for each part's faces.
    faces: Vec<String>,
    parts: Vec<Part>,
    part_ids: HashMap<Part, usize>,
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
    /// The largest index into each, and its line: a face may name vertices that only come later.
    furthest: [(usize, usize); 3],
    lines: usize,
    points: usize,
    colors: usize,
    /// First line whose corners name an attribute of which the file has none at all.
    dangling: Option<usize>,
    unknown: Option<(usize, String)>,
    unknown_count: usize,
    corners: Vec<[usize; 3]>,
}

impl Scanner {
    fn statement(&mut self, line: usize, keyword: &str, rest: &str) -> Result<(), String> {
        match keyword {
            "v" => {
                let more = self.numbers("v", rest, 3)?;
                self.counts[0] += 1;
                // One more is a weight, which polygons do not use; three more are a colour.
                self.colors += usize::from(more >= 3);
            }
            "vt" => {
                self.texture_coordinate(rest)?;
                self.counts[1] += 1;
            }
            "vn" => {
                self.numbers("vn", rest, 3)?;
                self.counts[2] += 1;
            }
            "f" | "fo" => self.face(line, rest)?,
            "l" => self.lines += 1,
            "p" => self.points += rest.split_whitespace().count(),
            "o" => (self.object_name, self.group_name, self.group) = (rest.to_owned(), String::new(), None),
            "g" => (self.group_name, self.group) = (rest.to_owned(), None),
            "s" => self.smoothing = Some(smoothing(rest)),
            "usemtl" => self.material = Some(self.materials.id(rest, line)),
            "mtllib" => self.libraries.push((rest.to_owned(), line)),
            // Display attributes that change nothing here.
            "" | "mg" | "bevel" | "c_interp" | "d_interp" | "lod" | "shadow_obj" | "trace_obj" | "usemap"
            | "maplib" => {}
            _ if keyword.starts_with('#') => {}
            _ => {
                self.unknown_count += 1;
                self.unknown.get_or_insert_with(|| (line, keyword.to_owned()));
            }
        }
        Ok(())
    }

    /// Copies `wanted` numbers, checked. Returns how many words were left over.
    fn numbers(&mut self, keyword: &str, rest: &str, wanted: usize) -> Result<usize, String> {
        self.text.push_str(keyword);
        let mut words = rest.split_whitespace();
        for found in 0..wanted {
            let word = words.next().filter(|word| !word.starts_with('#'));
            let word = word.ok_or_else(|| format!("`{keyword}` has {found} numbers instead of {wanted}"))?;
            check_number(word)?;
            self.text.push(' ');
            self.text.push_str(word);
        }
        self.text.push('\n');
        Ok(words.take_while(|word| !word.starts_with('#')).count())
    }

    fn texture_coordinate(&mut self, rest: &str) -> Result<(), String> {
        let mut words = rest.split_whitespace();
        let u = words.next().ok_or("`vt` has no numbers")?;
        // A one-dimensional texture's V.
        let v = words.next().filter(|word| !word.starts_with('#')).unwrap_or("0");
        check_number(u)?;
        check_number(v)?;
        self.text.extend(["vt ", u, " ", v, "\n"]);
        Ok(())
    }

    fn face(&mut self, line: usize, rest: &str) -> Result<(), String> {
        self.corners.clear();
        for word in rest.split_whitespace().take_while(|word| !word.starts_with('#')) {
            let corner = self.corner(line, word)?;
            self.corners.push(corner);
        }
        match self.corners.len() {
            0 => return Err("a face without corners".into()),
            1 => self.points += 1,
            2 => self.lines += 1,
            _ => {}
        }
        for (kind, furthest) in self.furthest.iter_mut().enumerate() {
            let last = self.corners.iter().map(|corner| corner[kind]).max().unwrap_or(0);
            if last > furthest.0 {
                *furthest = (last, line);
            }
        }
        if self.corners.len() > 2 {
            self.push_face(line);
        }
        Ok(())
    }

    /// One-based indices of position, texture coordinate and normal; 0 where there is none.
    fn corner(&mut self, line: usize, word: &str) -> Result<[usize; 3], String> {
        let mut indices = [0; 3];
        for (kind, part) in word.split('/').enumerate() {
            let slot = indices.get_mut(kind).ok_or_else(|| format!("`{word}` has more than three indices"))?;
            if part.is_empty() {
                continue;
            }
            if kind > 0 && !self.exists[kind] {
                // Exporters that dropped a whole attribute leave its indices behind; nothing is lost by letting them go.
                self.dangling.get_or_insert(line);
                continue;
            }
            let index: i64 = part.parse().map_err(|_| format!("`{part}` is not an index"))?;
            *slot = match index {
                0 => return Err(format!("index 0 in `{word}`: OBJ counts from 1")),
                1.. => usize::try_from(index).unwrap_or(usize::MAX),
                _ => usize::try_from(index.unsigned_abs())
                    .ok()
                    .and_then(|back| (self.counts[kind] + 1).checked_sub(back))
                    .filter(|&index| index > 0)
                    .ok_or_else(|| {
                        format!("index {index} is out of range: {} have been defined so far", self.counts[kind])
                    })?,
            };
        }
        if indices[0] == 0 { Err(format!("`{word}` names no vertex")) } else { Ok(indices) }
    }

    fn push_face(&mut self, line: usize) {
        let group = match self.group {
            Some(group) => group,
            None => {
                let separator = if self.object_name.is_empty() || self.group_name.is_empty() { "" } else { "/" };
                let id = self.groups.id(&format!("{}{separator}{}", self.object_name, self.group_name), line);
                *self.group.insert(id)
            }
        };
        let material = *self.material.get_or_insert_with(|| self.materials.id("", line));
        let has_normals = self.corners.iter().all(|corner| corner[2] > 0);
        let part = Part {
            group,
            material,
            // Beside normals of the file, smoothing changes nothing and would only split the mesh.
            smoothing: if has_normals { Smoothing::Unstated } else { self.smoothing.unwrap_or(Smoothing::Unstated) },
            has_uvs: self.corners.iter().all(|corner| corner[1] > 0),
            has_normals,
        };
        let id = *self.part_ids.entry(part).or_insert_with(|| {
            self.parts.push(part);
            self.faces.push(String::new());
            self.parts.len() - 1
        });
        write_face(&mut self.faces[id], &self.corners, &part);
    }

    fn finish(self) -> Result<Scan, (Option<usize>, String)> {
        for ((index, line), (count, what)) in
            self.furthest.into_iter().zip(self.counts.into_iter().zip(["vertices", "texture coordinates", "normals"]))
        {
            if index > count {
                return Err((Some(line), format!("index {index} is out of range: the file has {count} {what}")));
            }
        }
        if self.parts.is_empty() {
            let (points, lines) = (self.points, self.lines);
            let vertices = self.counts[0];
            let what = format!("has no faces to draw ({vertices} vertices, {lines} lines, {points} points)");
            return Err((None, what));
        }
        let warnings = self.warnings();
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
            warnings,
        })
    }

    fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.lines + self.points > 0 {
            warnings.push(format!("lines ({}) and points ({}) are not drawn", self.lines, self.points));
        }
        if self.colors > 0 {
            warnings.push(format!("vertex colours ({}) are not used", self.colors));
        }
        if let Some(line) = self.dangling {
            warnings
                .push(format!("line {line}: indices of texture coordinates or normals, but the file has none of them"));
        }
        if let Some((line, keyword)) = &self.unknown {
            let others = match self.unknown_count - 1 {
                0 => String::new(),
                n => format!(", and {n} more such lines"),
            };
            warnings.push(format!("line {line}: `{keyword}` is not known and left out{others}"));
        }
        warnings
    }
}

fn smoothing(rest: &str) -> Smoothing {
    match rest.split_whitespace().next() {
        None | Some("off" | "0" | "null") => Smoothing::Off,
        Some("on") => Smoothing::Group(1),
        // A name instead of a number still names one group.
        Some(group) => Smoothing::Group(group.parse().unwrap_or(1)),
    }
}

pub(super) fn check_number(word: &str) -> Result<(), String> {
    let number: f64 = word.parse().map_err(|_| format!("`{word}` is not a number"))?;
    if !number.is_finite() {
        return Err(format!("`{word}` is not a finite number"));
    }
    if number.abs() > LARGEST {
        return Err(format!("{word} is out of range: at most {LARGEST:e}"));
    }
    Ok(())
}

fn write_face(out: &mut String, corners: &[[usize; 3]], part: &Part) {
    let mut push = |separator: char, index: Option<usize>| {
        out.push(separator);
        if let Some(index) = index {
            push_decimal(out, index);
        }
    };
    for (number, &[position, uv, normal]) in corners.iter().enumerate() {
        if number == 0 {
            push('f', None);
        }
        push(' ', Some(position));
        if part.has_uvs || part.has_normals {
            push('/', part.has_uvs.then_some(uv));
        }
        if part.has_normals {
            push('/', Some(normal));
        }
    }
    out.push('\n');
}

/// Appends a number's digits; `write!` takes a third of the whole scan's time.
fn push_decimal(out: &mut String, mut number: usize) {
    let mut digits = [0_u8; 20];
    let mut first = digits.len();
    loop {
        first -= 1;
        digits[first] = b'0' + (number % 10) as u8;
        number /= 10;
        if number == 0 {
            break;
        }
    }
    out.extend(digits[first..].iter().map(|&digit| char::from(digit)));
}
