//! Which points show their pictures, and what these files are called.

use std::collections::BTreeSet;

use super::model::{Against, Metric, SceneReport};

/// Points with pictures, at most: a report stays of a size that can be sent.
const MOST: usize = 24;
/// The longest edge of a picture in a report, in pixels.
pub const LONGEST_EDGE: u32 = 480;
/// The folder of pictures, beside the report.
pub const FOLDER: &str = "pictures";

/// What a point's files show.
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
    // Names of scenes are told apart by their hash where what is left of them is the same.
    let hash = blake3::hash(scene.name.as_bytes()).to_hex();
    format!("{FOLDER}/{}-{}-{}-{kind}.png", plain(&scene.name), &hash[..6], plain(point))
}
