//! The points whose pictures a report shows, and the names of the pictures' files.

use std::collections::BTreeSet;

use super::model::{Against, Metric, SceneReport};

/// Points with pictures, at most: a report stays of a size that can be sent.
const MOST: usize = 24;
/// The longest edge of a picture in a report, in pixels.
pub const LONGEST_EDGE: u32 = 480;
/// The folder of pictures, beside the report.
pub const FOLDER: &str = "pictures";

/// The kinds of a point's files.
pub const KINDS: [&str; 2] = ["picture", "difference"];

/// Indices of the points whose pictures are shown: the default settings, the fronts by FLIP and relMSE against the converged truth, and
/// of each family the best and the worst.
pub fn shown(scene: &SceneReport) -> BTreeSet<usize> {
    let error = |index: &usize| scene.points[*index].errors.converged.flip;
    let fronts = [Metric::Flip, Metric::RelMse].into_iter().flat_map(|metric| {
        let is_it = move |front: &&super::model::Front| front.metric == metric && front.truth == Against::Converged;
        scene.fronts.iter().filter(is_it).flat_map(|front| front.points.iter().copied())
    });
    let extremes = scene.families.iter().flat_map(|family| {
        let members = || family.members.iter().map(|member| member.point);
        let worst = members().max_by(|a, b| error(a).total_cmp(&error(b)));
        let best = members().min_by(|a, b| error(a).total_cmp(&error(b)));
        worst.into_iter().chain(best)
    });
    let mut shown = BTreeSet::new();
    for index in std::iter::once(scene.default).chain(fronts).chain(extremes) {
        if shown.len() < MOST {
            shown.insert(index);
        }
    }
    shown
}

/// A file's name, relative to the report: the same whichever part of a report has drawn it.
pub fn file(scene: &SceneReport, point: &str, kind: &str) -> String {
    let plain = |text: &str| -> String {
        let kept = text.chars().map(|c| match c {
            c if c.is_ascii_alphanumeric() || matches!(c, '.' | '_') => c,
            ' ' => '_',
            _ => '-',
        });
        kept.collect()
    };
    // Scenes are told apart by a hash of their names, as the characters that a file's name may have can be the same.
    let hash = blake3::hash(scene.name.as_bytes()).to_hex();
    format!("{FOLDER}/{}-{}-{}-{kind}.png", plain(&scene.name), &hash[..6], plain(point))
}

/// Returns true if a file in the folder of pictures has a name as [`file`] gives it.
pub fn is_file(name: &str) -> bool {
    let is_hash = |part: &str| part.len() == 6 && part.chars().all(|c| c.is_ascii_hexdigit());
    let parts: Vec<&str> = name.split('-').collect();
    // A scene, its hash, a point, and the kind of picture.
    let has_hash = parts.len() >= 4 && parts[1..parts.len() - 2].iter().any(|part| is_hash(part));
    has_hash && KINDS.iter().any(|kind| parts.last().and_then(|last| last.strip_suffix(".png")) == Some(kind))
}

#[cfg(test)]
mod tests {
    use super::super::run::samples;
    use super::*;

    #[test]
    fn files_of_pictures_are_known_by_their_names() {
        let scene = &samples::report().scenes[0];
        for point in &scene.points {
            for kind in KINDS {
                let name = file(scene, &point.name, kind);
                assert!(name.strip_prefix("pictures/").is_some_and(is_file), "{name}");
            }
        }
        for name in ["cat.png", "my-holiday-in-a-picture.png", "a-0a1b2c-b-picture.jpg", ""] {
            assert!(!is_file(name), "{name}");
        }
    }
}
