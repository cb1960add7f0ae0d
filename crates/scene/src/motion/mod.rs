//! Motion: a hierarchy of nodes, the clips that move them, the skins that deform meshes by them, and shapes that meshes blend to.
//!
//! Everything is f64 and a pure function of time. [`Scene::at`](super::Scene::at) gives the scene at a time, with deformed meshes as plain ones, for
//! rays, exports and tests. Frames on a device deform on the device, from [`Pose`].

#[cfg(feature = "readers")]
mod append;
mod at;
mod bounds;
mod check;
mod deform;
mod playing;
mod pose;
mod sample;
#[cfg(test)]
mod tests;
mod values;

#[cfg(feature = "readers")]
pub(super) use append::FirstIndices;
pub use bounds::DeformBounds;
pub use deform::deform;
pub use deform::deform_frame;
pub use playing::{ClipChoice, Playing};
pub use pose::Pose;

use std::collections::BTreeSet;

use glam::{DAffine3, DQuat, DVec3};

use super::Material;

use sample::unit_rotation;

/// A transform as clips move it: scale, then rotation, then translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// The translation in metres of the parent.
    pub translation: DVec3,
    /// The rotation, of any length but 0.
    pub rotation: DQuat,
    /// The scale along the node's own axes. May mirror.
    pub scale: DVec3,
}

impl Default for Placement {
    fn default() -> Self {
        Self { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: DVec3::ONE }
    }
}

impl Placement {
    /// Returns the transform from the node's space to its parent's.
    pub fn to_affine(&self) -> DAffine3 {
        DAffine3::from_scale_rotation_translation(self.scale, unit_rotation(self.rotation), self.translation)
    }
}

/// A node's transform in its parent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Local {
    /// Translation, rotation and scale, which clips can move.
    Parts(Placement),
    /// One transform, which nothing moves.
    Fixed(DAffine3),
}

impl Local {
    /// Returns the transform from the node's space to its parent's.
    pub fn to_affine(&self) -> DAffine3 {
        match self {
            Self::Parts(placement) => placement.to_affine(),
            Self::Fixed(transform) => *transform,
        }
    }
}

/// A node of the hierarchy.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// The name in messages and reports.
    pub name: String,
    /// Index in [`Motion::nodes`], lower than the node's own; `None` in the world.
    pub parent: Option<usize>,
    /// The transform when no clip plays.
    pub local: Local,
    /// The weights of the mesh's shapes for the objects of this node when no clip plays; empty if the mesh has none.
    pub weights: Vec<f64>,
}

/// The joints that deform a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Skin {
    /// The name in messages and reports.
    pub name: String,
    /// Indices in [`Motion::nodes`].
    pub joints: Vec<usize>,
    /// The transform from mesh space to each joint's space at binding; as many as joints.
    pub inverse_bind: Vec<DAffine3>,
}

/// Interpolation between keys (glTF 2.0, "Animation Sampler").
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Interpolation {
    /// Holds the value of the last key.
    Step,
    /// Interpolates linearly, rotations along the shorter great circle.
    #[default]
    Linear,
    /// A cubic through the keys with their tangents: each key has three values, the incoming tangent, its value and the outgoing tangent,
    /// tangents in units a second.
    CubicSpline,
}

/// The target of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ChannelTarget {
    /// The translation of the node with this index: three values.
    Translation(usize),
    /// The rotation of the node with this index: a quaternion's four values, x y z w.
    Rotation(usize),
    /// The scale of the node with this index: three values.
    Scale(usize),
    /// The weights of the node with this index: one value for each shape.
    Weights(usize),
    /// A value of a light, by its index in `Scene::lights`.
    Light(usize, LightValue),
    /// A value of a camera, by its index in `Scene::cameras`.
    Camera(usize, CameraValue),
    /// A value of a material, by its index in `Scene::materials`.
    Material(usize, MaterialValue),
    /// The cell that an object shows, by its index in `Scene::objects`: one whole number, which changes at each key without interpolation.
    Cell(usize),
}

/// The values of a light that move, besides its node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum LightValue {
    /// Linear RGB.
    Color,
    /// Lux or candela.
    Intensity,
    /// Metres.
    Range,
    /// Radians from the axis.
    InnerAngle,
    /// Radians from the axis.
    OuterAngle,
}

/// The values of a camera that move, besides its node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum CameraValue {
    /// The vertical field of view of a perspective camera, in radians.
    FovY,
    /// Half the height of an orthographic camera's picture, in metres.
    HalfHeight,
    /// Metres.
    Near,
}

/// The values of a material that move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum MaterialValue {
    /// Linear RGB and alpha.
    BaseColor,
    /// 0 to 1.
    Metallic,
    /// 0 to 1.
    Roughness,
    /// Linear RGB, without its strength.
    Emissive,
    /// A factor of the emitted colour: of [`MaterialValue::Emissive`] if a clip moves it, else of the material's own. It multiplies the strength that
    /// this colour already contains.
    EmissiveStrength,
    /// The scale of the normal map.
    NormalScale,
    /// 0 to 1.
    AlphaCutoff,
    /// The texture offset of the slot with this number: two values.
    UvOffset(u8),
    /// The texture rotation of the slot with this number: radians.
    UvRotation(u8),
    /// The texture scale of the slot with this number: two values.
    UvScale(u8),
}

/// Keys of one value.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// The value that they move.
    pub target: ChannelTarget,
    /// The times of the keys in seconds, ascending.
    pub times: Vec<f64>,
    /// The values of the keys: for each time as many as the target has, three times as many for a cubic.
    pub values: Vec<f64>,
    /// The interpolation between the keys.
    pub interpolation: Interpolation,
}

/// Channels that play together.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Clip {
    /// The name, as `--clip` takes it.
    pub name: String,
    /// The channels, at most one for each target.
    pub channels: Vec<Channel>,
}

/// The motion of a scene; empty if it stands still.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Motion {
    /// The nodes, parents before their children.
    pub nodes: Vec<Node>,
    /// `Object::skin` indexes it.
    pub skins: Vec<Skin>,
    /// The clips, in the order of their files.
    pub clips: Vec<Clip>,
    /// For each light, the node that it is attached to; it shines along the node's -Z. The list may be shorter than the list of lights: the others
    /// have none.
    pub light_nodes: Vec<Option<usize>>,
}

/// The joints of a skin that move each vertex of a mesh, and their weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Influences {
    /// The number of joints for each vertex: 4 or 8.
    pub per_vertex: usize,
    /// Indices in [`Skin::joints`]; `per_vertex` for each vertex.
    pub joints: Vec<u16>,
    /// The weights of the joints, as many as `joints`. They are not negative, and the weights of a vertex sum to 1.
    pub weights: Vec<f32>,
}

/// A shape that a mesh blends to: the differences of its vertices' values at a weight of 1. Each list is empty or as long as the mesh's
/// positions.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Morph {
    /// The name in messages and reports.
    pub name: String,
    /// The offsets of positions, in metres.
    pub positions: Vec<[f32; 3]>,
    /// The differences of unit normals.
    pub normals: Vec<[f32; 3]>,
    /// The differences of tangents, without the bitangent's sign.
    pub tangents: Vec<[f32; 3]>,
    /// The offsets of the first set of texture coordinates.
    pub uvs: Vec<[f32; 2]>,
    /// The differences of colours: linear RGB and alpha.
    pub colors: Vec<[f32; 4]>,
}

impl Motion {
    /// Returns true if nothing moves or deforms.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty() && self.clips.is_empty()
    }

    /// The materials that clips change.
    pub fn moved_materials(&self) -> BTreeSet<usize> {
        let material = |channel: &Channel| match channel.target {
            ChannelTarget::Material(material, _) => Some(material),
            _ => None,
        };
        self.clips.iter().flat_map(|clip| &clip.channels).filter_map(material).collect()
    }

    /// Returns the material with the largest values that it has at any key. Plans are made for it.
    pub fn widest(&self, index: usize, material: &Material) -> Material {
        let mut widest = material.clone();
        for channel in self.clips.iter().flat_map(|clip| &clip.channels) {
            let ChannelTarget::Material(own, kind) = channel.target else { continue };
            for &time in channel.times.iter().filter(|_| own == index) {
                let mut value = [0.0; 4];
                let count = values::count(channel.target).min(value.len());
                if channel.sample(time, &mut value[..count]) {
                    let then = values::changed_material(material, std::iter::once((kind, &value)));
                    widest.base_color = widest.base_color.max(then.base_color);
                    widest.emissive = widest.emissive.max(then.emissive);
                    widest.metallic = widest.metallic.max(then.metallic);
                    widest.alpha = widest.alpha.max(then.alpha);
                }
            }
        }
        widest
    }

    /// The objects whose cells clips change.
    pub fn moved_cells(&self) -> BTreeSet<usize> {
        let object = |channel: &Channel| match channel.target {
            ChannelTarget::Cell(object) => Some(object),
            _ => None,
        };
        self.clips.iter().flat_map(|clip| &clip.channels).filter_map(object).collect()
    }

    /// The lights that are attached to nodes, and the lights that clips change.
    pub fn moved_lights(&self) -> BTreeSet<usize> {
        let hung = self.light_nodes.iter().enumerate().filter_map(|(light, node)| node.map(|_| light));
        let changed = self.clips.iter().flat_map(|clip| &clip.channels).filter_map(|channel| match channel.target {
            ChannelTarget::Light(light, _) => Some(light),
            _ => None,
        });
        hung.chain(changed).collect()
    }

    /// Returns true if some node, key or joint mirrors.
    pub fn mirrors(&self) -> bool {
        let negative = |node: &Node| node.local.to_affine().matrix3.determinant() < 0.0;
        let keyed = |channel: &Channel| {
            matches!(channel.target, ChannelTarget::Scale(_)) && channel.values.iter().any(|&value| value < 0.0)
        };
        let bound = |skin: &Skin| skin.inverse_bind.iter().any(|bind| bind.matrix3.determinant() < 0.0);
        self.nodes.iter().any(negative)
            || self.clips.iter().flat_map(|clip| &clip.channels).any(keyed)
            || self.skins.iter().any(bound)
    }
}
