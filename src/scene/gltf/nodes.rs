//! The hierarchy of nodes: which there are, where they stand, and which of them a scene shows. Walks are loops, so that no depth is too deep.

use glam::{DAffine3, DMat4, DQuat, DVec3};

use super::json::{Document, Node, Whole, named};
use crate::scene::check::fits;
use crate::scene::{Local, Placement, unknown};

/// All nodes of a file.
pub(super) struct Nodes {
    pub parent: Vec<Option<usize>>,
    /// The transform of each in its parent.
    pub local: Vec<Local>,
    /// From each node's space to the world, when nothing moves it.
    pub world: Vec<DAffine3>,
    /// All of them, parents before their children.
    pub order: Vec<usize>,
    /// Those that the chosen scene shows, in `order`.
    pub shown: Vec<usize>,
}

impl Nodes {
    /// Checks the hierarchy and places it.
    ///
    /// # Errors
    /// A node that does not exist, has two parents, is its own ancestor, or stands nowhere; a scene that does not exist.
    pub fn of(document: &Document, scene: Option<&str>, warnings: &mut Vec<String>) -> Result<Self, String> {
        let nodes = &document.nodes;
        let parent = parents(nodes)?;
        let roots: Vec<usize> = (0..nodes.len()).filter(|&node| parent[node].is_none()).collect();
        let order = below(nodes, &roots, |_| true);
        if order.len() < nodes.len() {
            let mut is_reached = vec![false; nodes.len()];
            order.iter().for_each(|&node| is_reached[node] = true);
            let lost = is_reached.iter().position(|reached| !reached).unwrap_or_default();
            return Err(format!("{} is its own ancestor", self::name(nodes, lost)));
        }
        let local = nodes.iter().enumerate().map(|(index, node)| local(index, node, warnings));
        let local = local.collect::<Result<Vec<_>, _>>()?;
        let mut world = vec![DAffine3::IDENTITY; nodes.len()];
        for &node in &order {
            let above = parent[node].map_or(DAffine3::IDENTITY, |parent| world[parent]);
            world[node] = above * local[node].to_affine();
            if !fits(&world[node]) {
                return Err(format!("{}: its transform in the world is not finite", self::name(nodes, node)));
            }
        }
        let chosen = roots_of_scene(document, scene, &parent, roots)?;
        let is_visible =
            |node: usize| nodes[node].extensions.visibility.as_ref().is_none_or(|own| own.visible != Some(false));
        let shown = below(nodes, &chosen, is_visible);
        Ok(Self { parent, local, world, order, shown })
    }
}

/// Returns the name of a node in messages.
pub(super) fn name(nodes: &[Node], index: usize) -> String {
    named("node", index, nodes.get(index).and_then(|node| node.name.as_ref()))
}

/// Returns the name of an object of a node.
pub(super) fn object_name(document: &Document, index: usize) -> String {
    let node = &document.nodes[index];
    let of_mesh = || node.mesh.and_then(|mesh| document.meshes.get(mesh.0)?.name.clone());
    let own = node.name.clone().filter(|name| !name.is_empty()).or_else(of_mesh);
    own.filter(|name| !name.is_empty()).unwrap_or_else(|| format!("node {index}"))
}

fn parents(nodes: &[Node]) -> Result<Vec<Option<usize>>, String> {
    let mut parent = vec![None; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        for child in &node.children {
            let Some(own) = parent.get_mut(child.0) else {
                let (name, count) = (name(nodes, index), nodes.len());
                return Err(format!("{name}: its child {} does not exist: the file has {count} nodes", child.0));
            };
            if let Some(other) = own.replace(index) {
                let [child, a, b] = [child.0, other, index].map(|node| name(nodes, node));
                return Err(format!("{child} is a child of {a} and of {b}: a node has one parent"));
            }
        }
    }
    Ok(parent)
}

/// Nodes and all below them, parents first; those that `enters` says no to are left out with all below. Each has one parent at most.
fn below(nodes: &[Node], roots: &[usize], enters: impl Fn(usize) -> bool) -> Vec<usize> {
    let mut found = Vec::new();
    let mut open: Vec<usize> = roots.iter().rev().copied().collect();
    while let Some(node) = open.pop() {
        if enters(node) {
            found.push(node);
            open.extend(nodes[node].children.iter().rev().map(|child| child.0));
        }
    }
    found
}

/// The roots of the scene that is asked for by its number or name, else of the one that the file opens with, else of the first. A file without
/// scenes shows all its nodes.
fn roots_of_scene(
    document: &Document,
    asked: Option<&str>,
    parent: &[Option<usize>],
    all: Vec<usize>,
) -> Result<Vec<usize>, String> {
    let (scenes, nodes) = (&document.scenes, &document.nodes);
    let index = match (asked, document.scene) {
        (Some(asked), _) => scene_called(document, asked)?,
        (None, Some(Whole(index))) if index >= scenes.len() => {
            return Err(format!("opens with scene {index}, but it has {}", scenes.len()));
        }
        (None, Some(Whole(index))) => index,
        (None, None) if scenes.is_empty() => return Ok(all),
        (None, None) => 0,
    };
    let mut roots = Vec::new();
    let mut is_taken = vec![false; nodes.len()];
    for root in &scenes[index].nodes {
        let scene = named("scene", index, scenes[index].name.as_ref());
        match parent.get(root.0) {
            None => return Err(format!("{scene}: node {} does not exist: the file has {}", root.0, nodes.len())),
            Some(Some(above)) => {
                let [root, above] = [root.0, *above].map(|node| name(nodes, node));
                return Err(format!("{scene}: {root} is no root, but a child of {above}"));
            }
            Some(None) if is_taken[root.0] => {}
            Some(None) => {
                is_taken[root.0] = true;
                roots.push(root.0);
            }
        }
    }
    Ok(roots)
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

/// Reads a node's transform in its parent.
fn local(index: usize, node: &Node, warnings: &mut Vec<String>) -> Result<Local, String> {
    let name = || named("node", index, node.name.as_ref());
    let infinite = |what: &str| format!("{}: its {what} is not finite", name());
    if let Some(matrix) = node.matrix {
        let columns = DMat4::from_cols_array(&matrix);
        if !columns.is_finite() {
            return Err(infinite("matrix"));
        }
        if columns.row(3) != glam::DVec4::W {
            warnings.push(format!("{}: the last row of its matrix is not 0 0 0 1, taken for that", name()));
        }
        return Ok(Local::Fixed(DAffine3::from_mat4(columns)));
    }
    let mut placement = Placement::default();
    if let Some(translation) = node.translation {
        placement.translation = DVec3::from(translation);
    }
    if let Some(rotation) = node.rotation {
        let rotation = DQuat::from_array(rotation);
        let length = rotation.length();
        if length.is_nan() || length.is_infinite() {
            return Err(infinite("rotation"));
        }
        if length < 1e-12 {
            warnings.push(format!("{}: its rotation is 0, taken for none", name()));
        } else {
            placement.rotation = rotation;
        }
    }
    if let Some(scale) = node.scale {
        placement.scale = DVec3::from(scale);
    }
    match (placement.translation.is_finite(), placement.scale.is_finite()) {
        (false, _) => Err(infinite("translation")),
        (_, false) => Err(infinite("scale")),
        _ => Ok(Local::Parts(placement)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nodes(json: &str) -> Result<Nodes, String> {
        let document: Document = serde_json::from_str(json).unwrap();
        Nodes::of(&document, None, &mut Vec::new())
    }

    #[test]
    fn cycles_second_parents_and_strangers_are_named() {
        for (json, words) in [
            (r#"{"nodes":[{"children":[1]},{"children":[0]}]}"#, "node 0 is its own ancestor"),
            (r#"{"nodes":[{"children":[0],"name":"a"}]}"#, "node 0 (`a`) is its own ancestor"),
            (r#"{"nodes":[{"children":[2]},{"children":[2]},{}]}"#, "node 2 is a child of node 0 and of node 1"),
            (r#"{"nodes":[{"children":[1,1]},{}]}"#, "node 1 is a child of node 0 and of node 0"),
            (r#"{"nodes":[{"children":[7]}]}"#, "node 0: its child 7 does not exist"),
            (r#"{"nodes":[{}],"scenes":[{"nodes":[1]}]}"#, "scene 0: node 1 does not exist"),
            (r#"{"nodes":[{"children":[1]},{}],"scenes":[{"nodes":[1]}]}"#, "is no root"),
            (r#"{"nodes":[{}],"scene":3}"#, "opens with scene 3, but it has 0"),
            (r#"{"nodes":[{"scale":[1e300,1,1]}]}"#, "is not finite"),
        ] {
            let error = nodes(json).err().unwrap_or_else(|| panic!("{json}"));
            assert!(error.contains(words), "{error}");
        }
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
