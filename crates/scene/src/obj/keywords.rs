//! The keywords of OBJ, in any case, and where its lines go on.

use std::borrow::Cow;

use super::text::{self, Backslash, Continuation};

/// Keywords of the format. Others are left out with a warning, and do not end a line that a backslash continues.
pub(super) const KEYWORDS: [&str; 40] = [
    "v",
    "vt",
    "vn",
    "vp",
    "f",
    "fo",
    "l",
    "p",
    "o",
    "g",
    "s",
    "mg",
    "usemtl",
    "mtllib",
    "usemap",
    "maplib",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "shadow_obj",
    "trace_obj",
    "cstype",
    "deg",
    "bmat",
    "step",
    "curv",
    "curv2",
    "surf",
    "parm",
    "trim",
    "hole",
    "scrv",
    "sp",
    "end",
    "con",
    "ctech",
    "stech",
    "call",
    "csh",
];

/// The rules of lines that end with a backslash.
pub(super) const CONTINUATION: Continuation = Continuation { backslash, is_statement };

fn backslash(begun: &str) -> Backslash {
    let (keyword, rest) = text::split_keyword(begun);
    match lower(keyword).as_ref() {
        "o" | "usemtl" | "usemap" => Backslash::Text,
        "g" | "mtllib" | "maplib" => Backslash::Names,
        comment if comment.starts_with('#') => Backslash::Text,
        _ if rest.split_whitespace().any(|word| word.starts_with('#')) => Backslash::Text,
        _ => Backslash::Numbers,
    }
}

fn is_statement(line: &str) -> bool {
    let (keyword, _) = text::split_keyword(line);
    keyword.is_empty() || keyword.starts_with('#') || KEYWORDS.contains(&lower(keyword).as_ref())
}

/// A keyword in lower case, in which tobj and this module know them.
pub(super) fn lower(keyword: &str) -> Cow<'_, str> {
    if keyword.bytes().any(|byte| byte.is_ascii_uppercase()) {
        keyword.to_ascii_lowercase().into()
    } else {
        keyword.into()
    }
}
