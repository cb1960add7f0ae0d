//! Motion of a model that becomes a part of a scene's.

use glam::DAffine3;

use super::{Channel, ChannelTarget, Local, Motion, Node};

/// The numbers that the first light, camera and object of something that is appended get.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FirstIndices {
    pub light: usize,
    pub camera: usize,
    pub object: usize,
}

impl ChannelTarget {
    fn moved(self, first_node: usize, first: FirstIndices) -> Self {
        match self {
            Self::Translation(node) => Self::Translation(node + first_node),
            Self::Rotation(node) => Self::Rotation(node + first_node),
            Self::Scale(node) => Self::Scale(node + first_node),
            Self::Weights(node) => Self::Weights(node + first_node),
            Self::Light(light, value) => Self::Light(light + first.light, value),
            Self::Camera(camera, value) => Self::Camera(camera + first.camera, value),
            Self::Cell(object) => Self::Cell(object + first.object),
            Self::Material(..) => self,
        }
    }
}

impl Motion {
    /// Counts materials from `first` on.
    pub(crate) fn move_materials(&mut self, first: usize) {
        for channel in self.clips.iter_mut().flat_map(|clip| &mut clip.channels) {
            if let ChannelTarget::Material(material, _) = &mut channel.target {
                *material += first;
            }
        }
    }

    /// Puts the channels of the last `count` clips into as many from `first` on. Channels of materials, which copies share, are put in once.
    pub(crate) fn merge_clips(&mut self, first: usize, count: usize) {
        let last = self.clips.split_off(self.clips.len().saturating_sub(count));
        for (clip, more) in self.clips.iter_mut().skip(first).zip(last) {
            let is_material = |channel: &Channel| matches!(channel.target, ChannelTarget::Material(..));
            clip.channels.extend(more.channels.into_iter().filter(|channel| !is_material(channel)));
        }
    }

    /// Drops the channels that move lights, where these do not come along.
    pub(crate) fn forget_lights(&mut self) {
        self.light_nodes.clear();
        self.clips
            .iter_mut()
            .for_each(|own| own.channels.retain(|own| !matches!(own.target, ChannelTarget::Light(..))));
    }

    /// Drops the channels that move cameras.
    pub(crate) fn forget_cameras(&mut self) {
        self.clips
            .iter_mut()
            .for_each(|own| own.channels.retain(|own| !matches!(own.target, ChannelTarget::Camera(..))));
    }

    /// Adds the motion of a model that stands at `transform`: its nodes hang on a new one there.
    pub(crate) fn append(&mut self, other: Self, transform: DAffine3, first: FirstIndices) {
        let root = self.nodes.len();
        let Self { nodes, skins, clips, light_nodes } = other;
        let clips = clips.into_iter().map(|mut clip| {
            clip.channels.iter_mut().for_each(|channel| channel.target = channel.target.moved(root + 1, first));
            clip
        });
        self.clips.extend(clips);
        if nodes.is_empty() {
            return;
        }
        self.nodes.push(Node {
            name: String::new(),
            parent: None,
            local: Local::Fixed(transform),
            weights: Vec::new(),
        });
        self.nodes.extend(
            nodes
                .into_iter()
                .map(|node| Node { parent: Some(node.parent.map_or(root, |parent| parent + root + 1)), ..node }),
        );
        self.skins.extend(skins.into_iter().map(|mut skin| {
            skin.joints.iter_mut().for_each(|joint| *joint += root + 1);
            skin
        }));
        if light_nodes.iter().any(Option::is_some) {
            self.light_nodes.resize(first.light, None);
            self.light_nodes.extend(light_nodes.into_iter().map(|node| node.map(|node| node + root + 1)));
        }
    }
}
