//! Motion: a hierarchy of nodes, the clips that move them, the skins that hang meshes on them, and shapes that meshes blend to.
//!
//! Everything is f64 and a pure function of time. [`Scene::at`](super::Scene::at) gives the scene as it is at a time, its deformed meshes as
//! plain ones: rays, exports and tests take that. Frames on a device deform on the device, from [`Pose`].

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

/// A place by its parts, as clips move it: scaled, then turned, then moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// In metres of the parent.
    pub translation: DVec3,
    /// Of any length but 0.
    pub rotation: DQuat,
    /// Along the node's own axes. May mirror.
    pub scale: DVec3,
}

impl Default for Placement {
    fn default() -> Self {
        Self { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: DVec3::ONE }
    }
}

impl Placement {
    /// From the node's space to its parent's.
    pub fn to_affine(&self) -> DAffine3 {
        DAffine3::from_scale_rotation_translation(self.scale, unit_rotation(self.rotation), self.translation)
    }
}

/// A node's transform in its parent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Local {
    /// By its parts: clips can move it.
    Parts(Placement),
    /// As one transform, which nothing moves.
    Fixed(DAffine3),
}

impl Local {
    /// From the node's space to its parent's.
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
    /// For messages and reports.
    pub name: String,
    /// Index in [`Motion::nodes`], lower than the node's own; `None` in the world.
    pub parent: Option<usize>,
    /// Its transform when no clip plays.
    pub local: Local,
    /// The weights of the mesh's shapes for the objects of this node when no clip plays; empty where the mesh has none.
    pub weights: Vec<f64>,
}

/// The joints that a mesh hangs on.
#[derive(Debug, Clone, PartialEq)]
pub struct Skin {
    /// For messages and reports.
    pub name: String,
    /// Indices in [`Motion::nodes`].
    pub joints: Vec<usize>,
    /// From mesh space to each joint's space where the mesh was bound; as many as joints.
    pub inverse_bind: Vec<DAffine3>,
}

/// Interpolation between keys (glTF 2.0, "Animation Sampler").
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Interpolation {
    /// The value of the last key.
    Step,
    /// Even, rotations along the shorter great circle.
    #[default]
    Linear,
    /// A cubic through the keys with their tangents: each key has three values, the incoming tangent, its value and the outgoing tangent,
    /// tangents in units a second.
    CubicSpline,
}

/// The target of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ChannelTarget {
    /// Of a node by its index: three values.
    Translation(usize),
    /// Of a node by its index: the four of a quaternion, x y z w.
    Rotation(usize),
    /// Of a node by its index: three values.
    Scale(usize),
    /// Of a node by its index: as many values as shapes.
    Weights(usize),
    /// Of a light by its index in `Scene::lights`.
    Light(usize, LightValue),
    /// Of a camera by its index in `Scene::cameras`.
    Camera(usize, CameraValue),
    /// Of a material by its index in `Scene::materials`.
    Material(usize, MaterialValue),
    /// The cell that an object shows, by its index in `Scene::objects`: one whole number, from key to key at once.
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
    /// Radians, of a perspective one.
    FovY,
    /// Half the height of an orthographic one's picture, in metres.
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
    /// Multiplies the emitted colour: that of [`MaterialValue::Emissive`] where a clip moves it, else the material's own. So it is a multiple of
    /// the strength that these two hold already.
    EmissiveStrength,
    /// Of the normal map.
    NormalScale,
    /// 0 to 1.
    AlphaCutoff,
    /// Of a slot by its number: two values.
    UvOffset(u8),
    /// Of a slot by its number: radians.
    UvRotation(u8),
    /// Of a slot by its number: two values.
    UvScale(u8),
}

/// Keys of one value.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// The value that they move.
    pub target: ChannelTarget,
    /// In seconds, each after the one before it.
    pub times: Vec<f64>,
    /// For each time as many as the target has, three times as many where the interpolation is cubic.
    pub values: Vec<f64>,
    /// Between the keys.
    pub interpolation: Interpolation,
}

/// Channels that play together.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Clip {
    /// As `--clip` takes it.
    pub name: String,
    /// At most one for each target.
    pub channels: Vec<Channel>,
}

/// The motion of a scene; empty in one that stands still.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Motion {
    /// Parents before their children.
    pub nodes: Vec<Node>,
    /// `Object::skin` indexes it.
    pub skins: Vec<Skin>,
    /// In the order of their files.
    pub clips: Vec<Clip>,
    /// By light, the node that it hangs on and looks along the -Z of; shorter than the list of lights where the last ones hang on none.
    pub light_nodes: Vec<Option<usize>>,
}

/// The joints of a skin that move each vertex of a mesh, and their weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Influences {
    /// For each vertex: 4 or 8.
    pub per_vertex: usize,
    /// Indices in [`Skin::joints`]; `per_vertex` for each vertex.
    pub joints: Vec<u16>,
    /// Not negative, those of a vertex sum to 1; as many as `joints`.
    pub weights: Vec<f32>,
}

/// A shape that a mesh blends to: the differences of its vertices' values at a weight of 1. Each list is empty or as long as the mesh's
/// positions.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Morph {
    /// For messages and reports.
    pub name: String,
    /// Metres.
    pub positions: Vec<[f32; 3]>,
    /// Of unit normals.
    pub normals: Vec<[f32; 3]>,
    /// Of tangents, without the bitangent's sign.
    pub tangents: Vec<[f32; 3]>,
    /// Of the first set.
    pub uvs: Vec<[f32; 2]>,
    /// Linear RGB and alpha.
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

    /// A material that asks for all that it does at some key: plans are made for it.
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

    /// The lights that hang on nodes, and those that clips change.
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
