//! The moving parts of a scene: the nodes that clips move, and everything attached to them. A part that nothing moves keeps no trace of its node.

use std::collections::{BTreeMap, BTreeSet};

use glam::DAffine3;

use super::accessor::Accessors;
use super::animation::FileAnimation;
use super::json::{Document, Whole, named};
use super::nodes::Nodes;
use super::pointer::Aim;
use crate::{MaterialValue, deform_frame};

/// A skin of the file, if it can be used.
pub(super) struct Joints {
    pub joints: Vec<usize>,
    pub inverse_bind: Vec<DAffine3>,
    /// True if a clip moves any of them.
    pub moves: bool,
}

impl Joints {
    /// The transform of each joint at rest, from mesh space to [`Joints::frame`].
    pub fn pose(&self, nodes: &Nodes) -> Vec<DAffine3> {
        let frame = self.frame(nodes);
        self.in_world(nodes).map(|joint| frame * joint).collect()
    }

    /// Returns the transform to the world for a mesh that is made in this pose.
    pub fn frame(&self, nodes: &Nodes) -> DAffine3 {
        deform_frame(&self.in_world(nodes).take(1).collect::<Vec<_>>())
    }

    fn in_world(&self, nodes: &Nodes) -> impl Iterator<Item = DAffine3> {
        self.joints.iter().zip(&self.inverse_bind).map(|(&joint, bind)| nodes.world[joint] * *bind)
    }
}

/// The nodes and values that clips move.
pub(super) struct Movement {
    /// True for each node whose place in the world moves.
    pub places: Vec<bool>,
    /// True for each node whose shape weights move.
    pub weights: Vec<bool>,
    /// The moving values of each material, by its index in the file.
    pub materials: BTreeMap<usize, BTreeSet<MaterialValue>>,
}

impl Movement {
    pub fn of(takes: &[FileAnimation], nodes: &Nodes) -> Self {
        let count = nodes.world.len();
        let materials = BTreeMap::new();
        let mut movement = Self { places: vec![false; count], weights: vec![false; count], materials };
        for keys in takes.iter().flat_map(|take| &take.keys) {
            match keys.aim {
                Aim::Translation(node) | Aim::Rotation(node) | Aim::Scale(node) => movement.places[node] = true,
                Aim::Weights(node) => movement.weights[node] = true,
                Aim::Material(material, value) => {
                    movement.materials.entry(material).or_default().insert(value);
                }
                Aim::Light(..) | Aim::Camera(..) => {}
            }
        }
        for &node in &nodes.order {
            movement.places[node] |= nodes.parent[node].is_some_and(|parent| movement.places[parent]);
        }
        movement
    }
}

/// Reads a skin.
///
/// # Errors
/// The reason why no mesh can use the skin.
pub(super) fn skin(
    document: &Document,
    accessors: &Accessors,
    index: usize,
    movement: &Movement,
) -> Result<Joints, String> {
    let json = document
        .skins
        .get(index)
        .ok_or_else(|| format!("skin {index} does not exist: the file has {}", document.skins.len()))?;
    let within = |what: String| format!("{}: {what}", named("skin", index, json.name.as_ref()));
    if json.joints.is_empty() {
        return Err(within("has no joints".into()));
    }
    let count = document.nodes.len();
    if let Some(joint) = json.joints.iter().find(|joint| joint.0 >= count) {
        return Err(within(format!("its joint {} does not exist: the file has {count} nodes", joint.0)));
    }
    let joints: Vec<usize> = json.joints.iter().map(|joint| joint.0).collect();
    let inverse_bind = match json.inverse_bind_matrices {
        Some(accessor) => binds(accessors, accessor, joints.len()).map_err(within)?,
        None => vec![DAffine3::IDENTITY; joints.len()],
    };
    let moves = joints.iter().any(|&joint| movement.places[joint]);
    Ok(Joints { joints, inverse_bind, moves })
}

fn binds(accessors: &Accessors, accessor: Whole, joints: usize) -> Result<Vec<DAffine3>, String> {
    let matrices = accessors.numbers::<16>(accessor, &["MAT4"])?;
    if matrices.len() < joints {
        return Err(format!("has {joints} joints, but {} inverse bind matrices", matrices.len()));
    }
    if let Some(joint) = matrices.iter().position(|matrix| !matrix.iter().all(|number| number.is_finite())) {
        return Err(format!("the inverse bind matrix of joint {joint} is not finite"));
    }
    let affine = |matrix: &[f64; 16]| DAffine3::from_mat4(glam::DMat4::from_cols_array(matrix));
    Ok(matrices[..joints].iter().map(affine).collect())
}
