//! The hierarchy of nodes: their transforms, and the nodes that a scene shows. Walks are loops, so that no depth is too deep.

use std::collections::BTreeSet;

use glam::{DAffine3, DMat4, DQuat, DVec3};

use super::json::{Document, Node, Whole, named};
use crate::check::fits;
use crate::{Local, Placement, unknown};

/// All nodes of a file.
pub(super) struct Nodes {
    pub parent: Vec<Option<usize>>,
    /// The transform of each node in its parent.
    pub local: Vec<Local>,
    /// The transform of each node to the world at rest.
    pub world: Vec<DAffine3>,
    /// All nodes, parents before their children.
    pub order: Vec<usize>,
    /// The nodes that the chosen scene shows, in the sequence of `order`.
    pub shown: Vec<usize>,
    /// The chosen scene, if the file has one.
    pub scene: Option<usize>,
}

impl Nodes {
    /// Repairs the hierarchy and places its nodes. Links to nodes that do not exist, to a second parent and back to an ancestor are left out. Nodes
    /// whose transform in the world is not finite are left out with all their descendants.
    ///
    /// # Errors
    /// A scene that was asked for and does not exist.
    pub fn of(document: &Document, scene: Option<&str>, warnings: &mut Vec<String>) -> Result<Self, String> {
        let nodes = &document.nodes;
        let Links { parent, children, order } = Links::of(nodes, warnings);
        let mut local: Vec<Local> =
            nodes.iter().enumerate().map(|(index, node)| self::local(index, node, warnings)).collect();
        let mut world = vec![DAffine3::IDENTITY; nodes.len()];
        let mut is_lost = vec![false; nodes.len()];
        for &node in &order {
            let above = parent[node].map_or(DAffine3::IDENTITY, |parent| world[parent]);
            world[node] = above * local[node].to_affine();
            is_lost[node] = parent[node].is_some_and(|parent| is_lost[parent]);
            if !fits(&world[node]) {
                let name = self::name(nodes, node);
                warnings.push(format!("{name}: its transform in the world is not finite: left out with all below it"));
                (world[node], local[node]) = (DAffine3::IDENTITY, Local::Fixed(DAffine3::IDENTITY));
                is_lost[node] = true;
            }
        }
        let roots: Vec<usize> = (0..nodes.len()).filter(|&node| parent[node].is_none()).collect();
        let (scene, chosen) = roots_of_scene(document, scene, roots, warnings)?;
        let is_visible = |node: usize| {
            !is_lost[node] && nodes[node].extensions.visibility.as_ref().is_none_or(|own| own.visible != Some(false))
        };
        let mut is_shown = vec![false; nodes.len()];
        let mut shown = below(&children, &chosen, is_visible);
        // A scene may name both a node and its ancestor.
        shown.retain(|&node| !std::mem::replace(&mut is_shown[node], true));
        for &node in chosen.iter().filter(|&&node| parent[node].is_some()) {
            let (name, above) = (self::name(nodes, node), parent[node].map(|above| self::name(nodes, above)));
            let above = above.unwrap_or_default();
            warnings.push(format!("its scene names {name}, which is no root, but a child of {above}: it stands there"));
        }
        Ok(Self { parent, local, world, order, shown, scene })
    }
}

/// The links between nodes, a forest.
struct Links {
    parent: Vec<Option<usize>>,
    children: Vec<Vec<usize>>,
    /// All nodes, parents before their children.
    order: Vec<usize>,
}

impl Links {
    fn of(nodes: &[Node], warnings: &mut Vec<String>) -> Self {
        let (parent, children) = parents(nodes, warnings);
        let mut links = Self { parent, children, order: Vec::new() };
        let roots: Vec<usize> = (0..nodes.len()).filter(|&node| links.parent[node].is_none()).collect();
        links.order = below(&links.children, &roots, |_| true);
        let mut is_reached = vec![false; nodes.len()];
        links.order.iter().for_each(|&node| is_reached[node] = true);
        // Nodes that no root leads to are in a cycle, or below one.
        for lost in 0..nodes.len() {
            if is_reached[lost] {
                continue;
            }
            let mut first = lost;
            let mut seen = BTreeSet::new();
            while let Some(above) = links.parent[first].filter(|_| seen.insert(first)) {
                first = above;
            }
            let name = self::name(nodes, first);
            warnings.push(format!("{name} is its own ancestor: the link to it from below is left out"));
            if let Some(above) = links.parent[first].take() {
                links.children[above].retain(|child| *child != first);
            }
            let found = below(&links.children, &[first], |_| true);
            found.iter().for_each(|&node| is_reached[node] = true);
            links.order.extend(found);
        }
        links
    }
}

/// Returns the name of a node in messages.
pub(super) fn name(nodes: &[Node], index: usize) -> String {
    named("node", index, nodes.get(index).and_then(|node| node.name.as_ref()))
}

/// Returns the name of a node's object.
pub(super) fn object_name(document: &Document, index: usize) -> String {
    let node = &document.nodes[index];
    let of_mesh = || node.mesh.and_then(|mesh| document.meshes.get(mesh.0)?.name.clone());
    let own = node.name.clone().filter(|name| !name.is_empty()).or_else(of_mesh);
    own.filter(|name| !name.is_empty()).unwrap_or_else(|| format!("node {index}"))
}

/// The first parent of each node, and its children.
fn parents(nodes: &[Node], warnings: &mut Vec<String>) -> (Vec<Option<usize>>, Vec<Vec<usize>>) {
    let mut parent: Vec<Option<usize>> = vec![None; nodes.len()];
    let mut children = vec![Vec::new(); nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        for child in &node.children {
            let Some(own) = parent.get_mut(child.0) else {
                let (name, count) = (name(nodes, index), nodes.len());
                warnings.push(format!("{name}: its child {} does not exist: the file has {count} nodes", child.0));
                continue;
            };
            if let Some(first) = *own {
                let [child, a, b] = [child.0, first, index].map(|node| name(nodes, node));
                warnings.push(format!(
                    "{child} is a child of {a} and of {b}: the first is taken, as a node has one parent"
                ));
                continue;
            }
            *own = Some(index);
            children[index].push(child.0);
        }
    }
    (parent, children)
}

/// Returns nodes and their descendants, parents first. A node that `enters` rejects is left out with its descendants. Each node has one parent at
/// most.
fn below(children: &[Vec<usize>], roots: &[usize], enters: impl Fn(usize) -> bool) -> Vec<usize> {
    let mut found = Vec::new();
    let mut open: Vec<usize> = roots.iter().rev().copied().collect();
    while let Some(node) = open.pop() {
        if enters(node) {
            found.push(node);
            open.extend(children[node].iter().rev());
        }
    }
    found
}

/// The roots of the scene that is requested by number or name, else of the file's default scene, else of the first. A file without scenes, or whose
/// scene names no node, shows all its nodes.
fn roots_of_scene(
    document: &Document,
    asked: Option<&str>,
    all: Vec<usize>,
    warnings: &mut Vec<String>,
) -> Result<(Option<usize>, Vec<usize>), String> {
    let (scenes, nodes) = (&document.scenes, &document.nodes);
    let index = match (asked, document.scene) {
        (Some(asked), _) => scene_called(document, asked)?,
        (None, Some(Whole(index))) if index >= scenes.len() => {
            let words = format!("opens with scene {index}, but it has {}", scenes.len());
            warnings
                .push(format!("{words}: {} shown", if scenes.is_empty() { "all nodes are" } else { "the first is" }));
            0
        }
        (None, Some(Whole(index))) => index,
        (None, None) => 0,
    };
    let Some(own) = scenes.get(index) else { return Ok((None, all)) };
    let scene = named("scene", index, own.name.as_ref());
    let mut roots = Vec::new();
    let mut is_taken = vec![false; nodes.len()];
    for root in &own.nodes {
        match is_taken.get_mut(root.0) {
            None => warnings.push(format!("{scene}: node {} does not exist: the file has {}", root.0, nodes.len())),
            Some(true) => {}
            Some(is_taken) => {
                *is_taken = true;
                roots.push(root.0);
            }
        }
    }
    if roots.is_empty() && asked.is_none() && !all.is_empty() {
        warnings.push(format!("{scene} names no node: all nodes are shown"));
        return Ok((Some(index), all));
    }
    Ok((Some(index), roots))
}

fn scene_called(document: &Document, asked: &str) -> Result<usize, String> {
    let scenes = &document.scenes;
    let by_name = scenes.iter().position(|scene| scene.name.as_deref() == Some(asked));
    let by_number = || asked.parse().ok().filter(|&index| index < scenes.len());
    by_name.or_else(by_number).ok_or_else(|| {
        if scenes.is_empty() {
            return format!("has no scenes, so that there is no {asked:?}");
        }
        let name =
            |(index, scene): (usize, &super::json::Scene)| scene.name.clone().unwrap_or_else(|| index.to_string());
        let names: Vec<String> = scenes.iter().enumerate().map(name).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        unknown("scene", asked, &names)
    })
}

/// Reads a node's transform in its parent. Invalid parts are ignored.
fn local(index: usize, node: &Node, warnings: &mut Vec<String>) -> Local {
    let name = || named("node", index, node.name.as_ref());
    let mut infinite = |what: &str| warnings.push(format!("{}: its {what} is not finite, taken for none", name()));
    if let Some(matrix) = node.matrix {
        let columns = DMat4::from_cols_array(&matrix);
        if columns.is_finite() {
            if columns.row(3) != glam::DVec4::W {
                warnings.push(format!("{}: the last row of its matrix is not 0 0 0 1, taken for that", name()));
            }
            return Local::Fixed(DAffine3::from_mat4(columns));
        }
        infinite("matrix");
    }
    let mut placement = Placement::default();
    let mut vector = |what: &str, own: Option<[f64; 3]>, instead: DVec3| {
        let own = own.map_or(instead, DVec3::from);
        if own.is_finite() {
            return own;
        }
        infinite(what);
        instead
    };
    placement.translation = vector("translation", node.translation, DVec3::ZERO);
    placement.scale = vector("scale", node.scale, DVec3::ONE);
    if let Some(rotation) = node.rotation {
        let rotation = DQuat::from_array(rotation);
        let length = rotation.length();
        if length.is_nan() || length.is_infinite() {
            infinite("rotation");
        } else if length < 1e-12 {
            warnings.push(format!("{}: its rotation is 0, taken for none", name()));
        } else {
            placement.rotation = rotation;
        }
    }
    Local::Parts(placement)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nodes(json: &str) -> Result<Nodes, String> {
        let document: Document = serde_json::from_str(json).unwrap();
        Nodes::of(&document, None, &mut Vec::new())
    }

    #[test]
    fn cycles_second_parents_and_strangers_are_left_out_by_name() {
        for (json, words, shown) in [
            (r#"{"nodes":[{"children":[1]},{"children":[0]}]}"#, "node 0 is its own ancestor", &[0, 1][..]),
            (r#"{"nodes":[{"children":[0],"name":"a"}]}"#, "node 0 (`a`) is its own ancestor", &[0]),
            (r#"{"nodes":[{},{"children":[2]},{"children":[3]},{"children":[2]}]}"#, "and of node 3", &[0, 1, 2, 3]),
            (
                r#"{"nodes":[{"children":[2]},{"children":[2]},{}]}"#,
                "node 2 is a child of node 0 and of node 1",
                &[0, 2, 1],
            ),
            (r#"{"nodes":[{"children":[1,1]},{}]}"#, "node 1 is a child of node 0 and of node 0", &[0, 1]),
            (r#"{"nodes":[{"children":[7]}]}"#, "node 0: its child 7 does not exist", &[0]),
            (r#"{"nodes":[{}],"scenes":[{"nodes":[1,0]}]}"#, "scene 0: node 1 does not exist", &[0]),
            (r#"{"nodes":[{"children":[1]},{}],"scenes":[{"nodes":[1]}]}"#, "is no root", &[1]),
            (r#"{"nodes":[{"children":[1]},{}],"scenes":[{"nodes":[0,1]}]}"#, "is no root", &[0, 1]),
            (r#"{"nodes":[{}],"scene":3}"#, "opens with scene 3, but it has 0: all nodes are shown", &[0]),
            (r#"{"nodes":[{},{}],"scene":3,"scenes":[{"nodes":[1]}]}"#, "but it has 1: the first is shown", &[1]),
            (r#"{"nodes":[{},{}],"scenes":[{}]}"#, "scene 0 names no node: all nodes are shown", &[0, 1]),
            (r#"{"nodes":[{"scale":[1e300,1,1],"children":[1]},{},{}]}"#, "is not finite", &[2]),
        ] {
            let document: Document = serde_json::from_str(json).unwrap();
            let mut warnings = Vec::new();
            let found = Nodes::of(&document, None, &mut warnings).unwrap();
            assert!(warnings.len() == 1 && warnings[0].contains(words), "{json}: {warnings:?}");
            assert_eq!((found.shown.as_slice(), found.order.len()), (shown, document.nodes.len()), "{json}");
        }
        // A cycle beside the tree that leads into it.
        let tailed = nodes(r#"{"nodes":[{"children":[1]},{"children":[2]},{"children":[1]},{}]}"#).unwrap();
        assert_eq!(tailed.parent, [None, Some(0), Some(1), None]);
    }

    #[test]
    fn a_chain_of_any_depth_is_walked() {
        let count = 200_000;
        let chain: Vec<String> =
            (1..count).map(|child| format!(r#"{{"children":[{child}],"translation":[1,0,0]}}"#)).collect();
        let found = nodes(&format!(r#"{{"nodes":[{},{{}}]}}"#, chain.join(","))).unwrap();
        assert_eq!((found.order.len(), found.shown.len()), (count, count));
        assert_eq!(found.world[count - 1].translation.x, (count - 1) as f64);
    }

    #[test]
    fn a_scene_is_chosen_by_name_number_and_what_the_file_says() {
        let json =
            r#"{"nodes":[{},{},{}],"scene":1,"scenes":[{"nodes":[0]},{"nodes":[1,1]},{"name":"0","nodes":[2]}]}"#;
        let document: Document = serde_json::from_str(json).unwrap();
        let shown = |asked| Nodes::of(&document, asked, &mut Vec::new()).map(|nodes| nodes.shown);
        assert_eq!(shown(None), Ok(vec![1]));
        assert_eq!((shown(Some("0")), shown(Some("1"))), (Ok(vec![2]), Ok(vec![1])));
        assert!(shown(Some("x")).unwrap_err().contains("unknown scene \"x\""));
    }

    #[test]
    fn what_a_hidden_node_holds_is_hidden_with_it() {
        let hidden = r#"{"children":[1],"extensions":{"KHR_node_visibility":{"visible":false}}}"#;
        assert_eq!(nodes(&format!(r#"{{"nodes":[{hidden},{{}},{{}}]}}"#)).unwrap().shown, [2]);
    }
}
