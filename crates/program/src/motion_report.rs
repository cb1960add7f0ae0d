//! The motion of a scene, as `inspect` tells it.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use afterlight::scene::{ChannelTarget, Clip, ClipChoice, Interpolation, Motion, Node, Skin, counted, decimal};
use serde::Serialize;

use super::table::TextTable;

/// Rows of a table that are printed without -v; the others are counted.
const MOST_ROWS: usize = 20;

/// The motion's part of the output of `--json`.
#[derive(Serialize)]
pub struct MotionReport {
    /// Duration of the longest clip.
    duration_s: f64,
    clips: Vec<ClipReport>,
    nodes: Vec<NodeReport>,
    skins: Vec<SkinReport>,
}

#[derive(Serialize)]
struct ClipReport {
    name: String,
    duration_s: f64,
    channels: usize,
    keys: usize,
    /// The kinds of things that it moves.
    moves: Vec<&'static str>,
    /// Interpolations between keys.
    interpolations: Vec<&'static str>,
}

#[derive(Serialize)]
struct NodeReport {
    name: String,
    parent: Option<usize>,
    /// True if a clip moves it, or a node above it.
    moves: bool,
    shapes: usize,
}

#[derive(Serialize)]
struct SkinReport {
    name: String,
    joints: usize,
}

impl MotionReport {
    /// Returns `None` for a scene that stands still.
    pub fn of(motion: &Motion) -> Option<Self> {
        if motion.is_empty() {
            return None;
        }
        let mut moves: Vec<bool> = vec![false; motion.nodes.len()];
        for channel in motion.clips.iter().flat_map(|clip| &clip.channels) {
            if let ChannelTarget::Translation(node) | ChannelTarget::Rotation(node) | ChannelTarget::Scale(node) =
                channel.target
                && let Some(moves) = moves.get_mut(node)
            {
                *moves = true;
            }
        }
        for (index, node) in motion.nodes.iter().enumerate() {
            moves[index] |= node.parent.is_some_and(|parent| moves.get(parent) == Some(&true));
        }
        let node = |(Node { name, parent, weights, .. }, moves): (&Node, bool)| NodeReport {
            name: name.clone(),
            parent: *parent,
            moves,
            shapes: weights.len(),
        };
        let skin = |Skin { name, joints, .. }: &Skin| SkinReport { name: name.clone(), joints: joints.len() };
        Some(Self {
            duration_s: motion.duration(&ClipChoice::All),
            clips: motion.clips.iter().map(clip).collect(),
            nodes: motion.nodes.iter().zip(moves).map(node).collect(),
            skins: motion.skins.iter().map(skin).collect(),
        })
    }

    /// Tables of clips and skins, and with -v of nodes.
    pub fn text(&self, is_verbose: bool) -> String {
        let mut text = String::new();
        let most = if is_verbose { usize::MAX } else { MOST_ROWS };
        let mut list = |title: &str, count: usize, row: &dyn Fn(usize) -> Vec<String>| {
            if count == 0 {
                return;
            }
            let mut table = TextTable::new();
            for index in 0..count.min(most) {
                table.row(row(index));
            }
            let _ = write!(text, "{title}\n{}", table.render());
            if count > most {
                let _ = writeln!(text, "  and {} more: -v prints all", count - most);
            }
            text.push('\n');
        };
        list("Clips (--clip takes the number or the name)", self.clips.len(), &|index| {
            let ClipReport { name, duration_s, channels, keys, moves, interpolations } = &self.clips[index];
            let seconds = format!("{} s", decimal(*duration_s, 3));
            let counts = [counted(*channels, "channel"), counted(*keys, "key"), interpolations.join(", ")].join(", ");
            vec![index.to_string(), name.clone(), seconds, counts, moves.join(", ")]
        });
        list("Skins", self.skins.len(), &|index| {
            let SkinReport { name, joints } = &self.skins[index];
            vec![index.to_string(), name.clone(), counted(*joints, "joint")]
        });
        if is_verbose {
            list("Nodes", self.nodes.len(), &|index| {
                let NodeReport { name, parent, moves, shapes } = &self.nodes[index];
                let parent = parent.map_or_else(|| "in the world".to_owned(), |parent| format!("in {parent}"));
                let moves = if *moves { "moves" } else { "rests" }.to_owned();
                vec![index.to_string(), name.clone(), parent, moves, counted(*shapes, "shape")]
            });
        } else {
            let moving = self.nodes.iter().filter(|node| node.moves).count();
            let _ =
                writeln!(text, "{}, {moving} of which clips move: -v lists them.\n", counted(self.nodes.len(), "node"));
        }
        text
    }
}

fn clip(clip: &Clip) -> ClipReport {
    let channels = clip.channels.iter();
    let moves: BTreeSet<&str> = channels.clone().map(|channel| kind(channel.target)).collect();
    let between: BTreeSet<&str> = channels.clone().map(|channel| between(channel.interpolation)).collect();
    ClipReport {
        name: clip.name.clone(),
        duration_s: clip.duration(),
        channels: clip.channels.len(),
        keys: channels.map(|channel| channel.times.len()).sum(),
        moves: moves.into_iter().collect(),
        interpolations: between.into_iter().collect(),
    }
}

fn kind(target: ChannelTarget) -> &'static str {
    match target {
        ChannelTarget::Translation(_) => "translation",
        ChannelTarget::Rotation(_) => "rotation",
        ChannelTarget::Scale(_) => "scale",
        ChannelTarget::Weights(_) => "shapes",
        ChannelTarget::Light(..) => "lights",
        ChannelTarget::Camera(..) => "cameras",
        ChannelTarget::Material(..) => "materials",
        ChannelTarget::Cell(_) => "cells",
    }
}

fn between(interpolation: Interpolation) -> &'static str {
    match interpolation {
        Interpolation::Step => "step",
        Interpolation::Linear => "linear",
        Interpolation::CubicSpline => "cubic spline",
    }
}

#[cfg(test)]
mod tests {
    use afterlight::scene::builtin;

    use super::*;

    #[test]
    fn clips_and_skins_are_listed_with_what_moves() {
        let motion = builtin::open("builtin:seaweed?count=30&joints=4").expect("built in").motion;
        let report = MotionReport::of(&motion).expect("it moves");
        assert_eq!((report.duration_s, report.skins.len(), report.clips.len()), (12.0, 30, 3));
        assert!(report.nodes.iter().filter(|node| node.moves).count() == 30 * 4 + 3);
        let text = report.text(false);
        assert!(text.contains("swim") && text.contains("lights, materials, shapes, translation"), "{text}");
        assert!(text.contains("and 10 more: -v prints all"), "{text}");
        assert!(report.text(true).contains("jellyfish"));
        assert!(MotionReport::of(&Motion::default()).is_none());
    }
}
