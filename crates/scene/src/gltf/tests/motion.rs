//! Clips move only their targets; parts that no clip moves keep no trace of it.

use serde_json::{Value, json};

use super::{GltfBuilder, push};
use crate::{Channel, ChannelTarget, Imported, Interpolation, LightValue, Local, MaterialValue};

/// Adds an animation of one channel whose keys are at 0 and 1 s.
fn animate(file: &mut GltfBuilder, target: Value, kind: &str, values: &[f32]) {
    let (input, output) = (file.floats("SCALAR", &[0.0, 1.0]), file.floats(kind, values));
    let channel = json!({"sampler": 0, "target": target});
    let animation = json!({"name": "wave", "channels": [channel], "samplers": [{"input": input, "output": output}]});
    push(&mut file.json["animations"], animation);
}

/// A moving root with a triangle, a light and a camera below it, and a triangle beside it.
fn moving() -> GltfBuilder {
    let mut file = GltfBuilder::triangle();
    file.json["scenes"][0]["nodes"] = json!([0, 2]);
    file.json["nodes"] = json!([
        {"children": [1, 3], "name": "root"},
        {"mesh": 0, "translation": [1, 0, 0]},
        {"mesh": 0},
        {"camera": 0, "name": "eye", "extensions": {"KHR_lights_punctual": {"light": 0}}},
    ]);
    file.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}]);
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "point"}]}});
    animate(&mut file, json!({"node": 0, "path": "translation"}), "VEC3", &[0.0, 0.0, 0.0, 0.0, 2.0, 0.0]);
    file
}

#[test]
fn nodes_of_the_motion_are_those_that_move_with_what_is_below() {
    let found = moving().read();
    let motion = &found.motion;
    assert_eq!(motion.nodes.len(), 3);
    assert_eq!(motion.nodes.iter().map(|node| node.parent).collect::<Vec<_>>(), [None, Some(0), Some(0)]);
    assert_eq!(found.objects.iter().map(|object| object.node).collect::<Vec<_>>(), [Some(1), None]);
    assert_eq!((found.cameras[0].node, &motion.light_nodes), (Some(2), &vec![Some(2)]));
    let channel = &motion.clips[0].channels[0];
    assert_eq!((channel.target, channel.interpolation), (ChannelTarget::Translation(0), Interpolation::Linear));
    assert_eq!(
        (channel.times.as_slice(), channel.values.as_slice()),
        (&[0.0, 1.0][..], &[0.0, 0.0, 0.0, 0.0, 2.0, 0.0][..])
    );
    assert_eq!((motion.clips[0].name.as_str(), found.cameras[0].name.as_str()), ("wave", "eye"));
}

#[test]
fn what_moves_with_nothing_below_leaves_no_trace() {
    let mut file = GltfBuilder::triangle();
    push(&mut file.json["nodes"], json!({"name": "empty"}));
    animate(&mut file, json!({"node": 1, "path": "scale"}), "VEC3", &[1.0; 6]);
    animate(&mut file, json!({"path": "scale"}), "VEC3", &[1.0; 6]);
    let found = file.read();
    assert!(found.motion.is_empty() && found.warnings.is_empty(), "{:?}", found.warnings);
}

/// A triangle that a channel with these keys moves, and the channel, if any is left.
fn keyed(path: &str, kind: &str, times: &[f32], values: &[f32]) -> (Option<Channel>, Vec<String>) {
    let mut file = GltfBuilder::triangle();
    animate(&mut file, json!({"node": 0, "path": path}), kind, values);
    let input = file.floats("SCALAR", times);
    file.json["animations"][0]["samplers"][0]["input"] = json!(input);
    let Imported { motion, warnings, .. } = file.read();
    (motion.clips.first().map(|clip| clip.channels[0].clone()), warnings)
}

#[test]
fn bad_channels_are_left_out_by_name() {
    let turns = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    for (times, values, words) in [
        (&[f32::NAN, f32::NAN][..], turns, "the time of key 0 is not finite: 2 keys are left out"),
        (&[0.0, 1.0], [0.0; 8], "the rotation of key 0 is 0: 2 keys are left out"),
        (&[0.0, 1.0], [f32::INFINITY; 8], "a value of key 0 is not from -1e18 to 1e18: 2 keys"),
    ] {
        let (channel, warnings) = keyed("rotation", "VEC4", times, &values);
        assert_eq!((channel, warnings.len()), (None, 2), "{warnings:?}");
        assert!(
            warnings[0].contains("animation 0 (`wave`), channel 0: ") && warnings[0].contains(words),
            "{warnings:?}"
        );
        assert!(warnings[1].contains("has no key that can be played, left out"), "{warnings:?}");
    }
}

#[test]
fn the_other_keys_play_where_one_cannot() {
    const NAN: f32 = f32::NAN;
    let jump = 1.0f64.next_up();
    // Each value is ten times the number of its key.
    for (times, kept, played) in [
        (&[0.0, 1.0, NAN][..], &[0, 1][..], &[0.0, 1.0][..]),
        (&[NAN, 1.0, 2.0], &[1, 2], &[1.0, 2.0]),
        (&[0.0, 1.0, 0.5, 2.0], &[0, 2, 3], &[0.0, 0.5, 2.0]),
        (&[0.0, 5.0, 1.0, 2.0, 3.0], &[0, 2, 3, 4], &[0.0, 1.0, 2.0, 3.0]),
        (&[0.0, 1.0, 1.0, 2.0], &[0, 1, 2, 3], &[0.0, 1.0, jump, 2.0]),
        (&[0.0, 1.0, 1.0, 1.0, 2.0], &[0, 1, 3, 4], &[0.0, 1.0, jump, 2.0]),
        (&[0.0, 1.0, 1.0], &[0, 1, 2], &[0.0, 1.0, jump]),
        (&[0.0, 0.0, 1.0], &[1, 2], &[0.0, 1.0]),
        (&[0.0, 0.0], &[1], &[0.0]),
        (&[3.0, 2.0, 1.0], &[2], &[1.0]),
    ] {
        let values: Vec<f32> = (0..times.len()).flat_map(|key| [10.0 * key as f32, 0.0, 0.0]).collect();
        let (channel, warnings) = keyed("translation", "VEC3", times, &values);
        let channel = channel.unwrap_or_else(|| panic!("{times:?}: {warnings:?}"));
        let found: Vec<usize> = channel.values.iter().step_by(3).map(|value| (*value / 10.0) as usize).collect();
        assert_eq!((found.as_slice(), channel.times.as_slice()), (kept, played), "{times:?}");
        assert!(warnings.len() == 1 && warnings[0].contains("channel 0: the time of key"), "{times:?}: {warnings:?}");
    }
    for times in [&[-0.5, 0.0, 1.0][..], &[10.0, 11.0], &[0.0]] {
        let (channel, warnings) = keyed("translation", "VEC3", times, &vec![1.0; times.len() * 3]);
        assert_eq!((channel.map(|own| own.times.len()), warnings.len()), (Some(times.len()), 0), "{warnings:?}");
    }
}

#[test]
fn keys_without_values_and_weights_of_other_counts_are_fitted() {
    let (channel, warnings) = keyed("translation", "VEC3", &[0.0, 1.0, 2.0], &[1.0; 6]);
    assert_eq!(channel.map(|own| own.times.len()), Some(2));
    assert!(warnings[0].contains("has 6 numbers for 3 keys of 3 each: the first 2 keys play"), "{warnings:?}");
    let weights = |values: &[f32]| {
        let mut file = GltfBuilder::triangle();
        let more = file.floats("VEC3", &[1.0; 9]);
        file.primitive("targets", json!([{"POSITION": more}, {"POSITION": more}]));
        animate(&mut file, json!({"node": 0, "path": "weights"}), "SCALAR", values);
        let Imported { motion, warnings, .. } = file.read();
        assert!(warnings.iter().any(|own| own.contains("but its mesh has 2")), "{warnings:?}");
        motion.clips[0].channels[0].values.clone()
    };
    assert_eq!(weights(&[0.25, 0.5]), [0.25, 0.0, 0.5, 0.0]);
    assert_eq!(weights(&[0.25, 0.5, 1.0, 2.0, 3.0, 4.0]), [0.25, 0.5, 2.0, 3.0]);
    let mut file = GltfBuilder::triangle();
    animate(&mut file, json!({"node": 0, "path": "translation"}), "VEC3", &[0.0; 6]);
    file.json["animations"][0]["samplers"][0]["interpolation"] = json!("BEZIER");
    let found = file.read();
    assert_eq!(found.motion.clips[0].channels[0].interpolation, Interpolation::Linear);
    assert!(found.warnings[0].contains("its interpolation is `BEZIER`, played as LINEAR"), "{:?}", found.warnings);
}

#[test]
fn pointers_move_lights_and_materials() {
    let mut file = moving();
    file.json["materials"] = json!([{}]);
    file.primitive("material", json!(0));
    let pointer = |to: &str| json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": to}}});
    animate(&mut file, pointer("/extensions/KHR_lights_punctual/lights/0/intensity"), "SCALAR", &[1.0, 2.0]);
    animate(&mut file, pointer("/materials/0/emissiveFactor"), "VEC3", &[0.0; 6]);
    animate(&mut file, pointer("/materials/0/occlusionTexture/strength"), "SCALAR", &[0.0; 2]);
    let found = file.read();
    let targets: Vec<ChannelTarget> = found.motion.clips[1..].iter().map(|clip| clip.channels[0].target).collect();
    assert_eq!(
        targets,
        [ChannelTarget::Light(0, LightValue::Intensity), ChannelTarget::Material(0, MaterialValue::Emissive)]
    );
    assert_eq!(found.motion.clips[1].name, "wave (2)");
    assert!(
        found.warnings[0].contains("occlusionTexture/strength` leads to nothing that is drawn"),
        "{:?}",
        found.warnings
    );
}

/// Adds an animation of a value of the first material.
fn animate_material(file: &mut GltfBuilder, to: &str, kind: &str, values: &[f32]) {
    let pointer = json!({"pointer": format!("/materials/0/{to}")});
    animate(file, json!({"path": "pointer", "extensions": {"KHR_animation_pointer": pointer}}), kind, values);
}

/// A file with this material, a value of which a pointer moves, and that channel.
fn moved(material: Value, (to, kind, values): (&str, &str, &[f32])) -> (Imported, Channel) {
    let mut file = GltfBuilder::triangle();
    file.json["materials"] = json!([material]);
    file.primitive("material", json!(0));
    animate_material(&mut file, to, kind, values);
    let found = file.read();
    let channel = found.motion.clips[0].channels[0].clone();
    (found, channel)
}

#[test]
fn emission_moves_with_its_colour_or_strength_times_the_other_of_the_file() {
    let strong = "KHR_materials_emissive_strength";
    let material = json!({"emissiveFactor": [1, 0.5, 0], "extensions": {strong: {"emissiveStrength": 3}}});
    let emissive = ChannelTarget::Material(0, MaterialValue::Emissive);
    let color: &[f32] = &[0.0, 0.0, 0.0, 0.5, 1.0, 0.25];
    let (_, channel) = moved(material.clone(), ("emissiveFactor", "VEC3", color));
    assert_eq!((channel.target, channel.values.as_slice()), (emissive, &[0.0, 0.0, 0.0, 1.5, 3.0, 0.75][..]));
    let to = format!("extensions/{strong}/emissiveStrength");
    let (_, channel) = moved(material, (&to, "SCALAR", &[2.0, 4.0]));
    assert_eq!((channel.target, channel.values.as_slice()), (emissive, &[2.0, 1.0, 0.0, 4.0, 2.0, 0.0][..]));
}

#[test]
fn a_texture_of_what_begins_to_glow_is_read() {
    let pixel = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4z8AAAAMBAQDJ/pLvAAAAAElFTkSuQmCC";
    let mut file = GltfBuilder::triangle();
    file.json["materials"] = json!([{"emissiveTexture": {"index": 0}}]);
    file.json["textures"] = json!([{"source": 0}]);
    file.json["images"] = json!([{"uri": pixel}]);
    file.primitive("material", json!(0));
    assert_eq!(file.read().textures.len(), 0);
    animate_material(&mut file, "emissiveFactor", "VEC3", &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    assert_eq!(file.read().textures.len(), 1);
}

#[test]
fn alpha_of_glass_moves_with_what_it_lets_through_and_of_what_is_opaque_stays() {
    let alphas = |material: Value| {
        let color: &[f32] = &[1.0, 1.0, 1.0, 0.5, 1.0, 1.0, 1.0, 0.25];
        let (found, channel) = moved(material, ("pbrMetallicRoughness/baseColorFactor", "VEC4", color));
        (found.materials[0].alpha, [channel.values[3], channel.values[7]])
    };
    let glass = json!({"KHR_materials_transmission": {"transmissionFactor": 0.75}});
    assert_eq!(alphas(json!({})), (1.0, [1.0, 1.0]));
    assert_eq!(alphas(json!({"extensions": glass})), (0.25, [0.25, 0.25]));
    assert_eq!(alphas(json!({"alphaMode": "BLEND", "extensions": glass})), (0.25, [0.125, 0.0625]));
    assert_eq!(alphas(json!({"alphaMode": "MASK"})), (1.0, [0.5, 0.25]));
}

#[test]
fn shapes_whose_weights_move_stay_and_others_do_not() {
    let mut file = GltfBuilder::triangle();
    let more = file.floats("VEC3", &[0.0, 0.0, 4.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0]);
    file.primitive("targets", json!([{"POSITION": more}, {"POSITION": more}]));
    file.json["meshes"][0]["weights"] = json!([0.25, 0]);
    file.json["meshes"][0]["extras"] = json!({"targetNames": ["smile", "frown"]});
    animate(&mut file, json!({"node": 0, "path": "weights"}), "SCALAR", &[0.0, 1.0, 0.5, 0.25]);
    let found = file.read();
    let (mesh, node) = (&found.meshes[0], &found.motion.nodes[0]);
    assert_eq!((mesh.positions[0], mesh.morphs.len(), mesh.morphs[1].name.as_str()), ([0.0; 3], 2, "frown"));
    assert_eq!((node.weights.as_slice(), found.objects[0].node), (&[0.25, 0.0][..], Some(0)));
    assert_eq!(found.motion.clips[0].channels[0].target, ChannelTarget::Weights(0));
    // The triangle tilts, and its own normal with it.
    assert_eq!((mesh.normals.len(), mesh.morphs[0].normals.len()), (3, 3));
}

/// A triangle on two joints, one below the other, of which the second turns.
fn skinned() -> GltfBuilder {
    let mut file = GltfBuilder::triangle();
    let joints = file.shorts("VEC4", 3, &[0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0]);
    let weights = file.floats("VEC4", &[1.0, 0.0, 0.0, 0.0, 0.49, 0.49, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0]);
    file.attribute("JOINTS_0", joints).attribute("WEIGHTS_0", weights);
    file.json["skins"] = json!([{"joints": [1, 2], "name": "rig"}]);
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    let lower = json!({"children": [2], "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,2,1]});
    file.json["nodes"] = json!([{"mesh": 0, "skin": 0, "translation": [9, 0, 0]}, lower, {"translation": [0, 1, 0]}]);
    animate(&mut file, json!({"node": 2, "path": "rotation"}), "VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
    file
}

#[test]
fn a_skin_whose_joints_move_keeps_them_and_its_weights_sum_to_one() {
    let found = skinned().read();
    let (motion, object) = (&found.motion, &found.objects[0]);
    assert_eq!((motion.nodes.len(), motion.skins[0].joints.as_slice()), (2, &[0, 1][..]));
    assert!(matches!(motion.nodes[0].local, Local::Fixed(_)) && matches!(motion.nodes[1].local, Local::Parts(_)));
    assert_eq!((object.skin, object.node, object.transform), (Some(0), None, glam::DAffine3::IDENTITY));
    let influences = found.meshes[0].influences.as_ref().expect("joints");
    assert_eq!(influences.weights, [1.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    assert_eq!(influences.joints[8..12], [1, 0, 0, 0]);
}

#[test]
fn a_joint_that_moves_may_be_flat() {
    let axes = |x: f64, y: f64, z: f64| json!([x, 0, 0, 0, 0, y, 0, 0, 0, 0, z, 0, 0, 0, 2, 1]);
    for matrix in [axes(0.0, 1.0, 1.0), axes(2.0, 0.0, -1.0), axes(0.0, 0.0, -3.0), axes(0.0, 0.0, 0.0)] {
        let mut file = skinned();
        file.json["nodes"][1]["matrix"] = matrix.clone();
        animate(&mut file, json!({"node": 1, "path": "translation"}), "VEC3", &[0.0, 0.0, 2.0, 0.0, 0.0, 2.0]);
        let found = file.read();
        let Local::Parts(own) = &found.motion.nodes[0].local else { panic!("it moves") };
        let transform = glam::DAffine3::from_scale_rotation_translation(own.scale, own.rotation, own.translation);
        let expected: Vec<f64> = matrix.as_array().expect("a matrix").iter().filter_map(Value::as_f64).collect();
        let expected = glam::DAffine3::from_mat4(glam::DMat4::from_cols_slice(&expected));
        assert!(transform.abs_diff_eq(expected, 1e-12), "{transform} {expected}");
    }
}

#[test]
fn a_skin_that_cannot_be_and_a_joint_too_many_are_left_out() {
    let mut file = skinned();
    file.json["skins"][0]["joints"] = json!([]);
    let found = file.read();
    assert!(found.warnings[0].contains("skin 0 (`rig`): has no joints"), "{:?}", found.warnings);
    assert_eq!((found.objects[0].skin, found.objects[0].transform.translation.x), (None, 9.0));
    file.json["skins"][0]["joints"] = json!([1]);
    let found = file.read();
    let words = "vertex 1 hangs on joint 1, but its skin has 1 joints: such weights are left out";
    assert!(found.warnings.iter().any(|own| own.contains(words)), "{:?}", found.warnings);
}

/// The skinned triangle. Of each vertex's twelve weights only the last, `last`, is on the second joint.
fn of_twelve(last: f32) -> GltfBuilder {
    let mut file = skinned();
    let share = (1.0 - last) / 11.0;
    for set in 0..3u16 {
        let joints = file.shorts("VEC4", 3, &[0, 0, 0, u16::from(set == 2)].repeat(3));
        let heaviest = if set == 2 { last } else { share };
        let weights = file.floats("VEC4", &[share, share, share, heaviest].repeat(3));
        file.attribute(&format!("JOINTS_{set}"), joints).attribute(&format!("WEIGHTS_{set}"), weights);
    }
    file
}

#[test]
fn the_heaviest_of_twelve_joints_move_a_vertex() {
    let found = of_twelve(0.9).read();
    let own = found.meshes[0].influences.as_ref().expect("joints");
    assert_eq!(own.per_vertex, 8);
    let of_second: f32 =
        own.joints[..8].iter().zip(&own.weights).filter(|(joint, _)| **joint == 1).map(|(_, own)| own).sum();
    let expected = 0.9 / (0.9 + 7.0 * 0.1 / 11.0);
    assert!((of_second - expected).abs() < 1e-6, "{of_second}");
    let words = "3 vertices hang on more than 8 joints, of which the heaviest move them; vertex 0 loses the most, 3.6%";
    assert!(found.warnings.iter().any(|warning| warning.contains(words)), "{:?}", found.warnings);
    // If only the last set has weights, nothing is lost.
    let found = of_twelve(1.0).read();
    assert_eq!(found.warnings, Vec::<String>::new());
    let own = found.meshes[0].influences.as_ref().expect("joints");
    assert_eq!(
        (own.per_vertex, &own.joints[..4], &own.weights[..4]),
        (4, &[0, 0, 0, 1][..], &[0.0, 0.0, 0.0, 1.0][..])
    );
}

#[test]
fn joints_that_cannot_be_read_hang_a_mesh_on_the_first() {
    let mut file = skinned();
    let short = file.floats("VEC4", &[1.0; 4]);
    file.attribute("WEIGHTS_0", short);
    let found = file.read();
    let own = found.meshes[0].influences.as_ref().expect("joints");
    assert_eq!((own.joints.as_slice(), &own.weights[..5]), (&[0; 12][..], &[1.0, 0.0, 0.0, 0.0, 1.0][..]));
    assert!(found.warnings.iter().any(|warning| warning.contains("skin's first joint")), "{:?}", found.warnings);
    // Numbers of joints as floats are read.
    let mut file = skinned();
    let joints = file.floats("VEC4", &[1.0, 0.0, 0.0, 0.0].repeat(3));
    file.attribute("JOINTS_0", joints);
    let found = file.read();
    assert_eq!(found.meshes[0].influences.as_ref().expect("joints").joints[0], 1);
    assert!(found.warnings.iter().any(|own| own.contains("not of an unsigned type")), "{:?}", found.warnings);
}

#[test]
fn shapes_on_moving_joints_have_a_node_of_their_own_in_the_world() {
    let mut file = skinned();
    let more = file.floats("VEC3", &[1.0; 9]);
    file.primitive("targets", json!([{"POSITION": more}]));
    animate(&mut file, json!({"node": 0, "path": "weights"}), "SCALAR", &[0.0, 1.0]);
    let found = file.read();
    let node = found.objects[0].node.expect("a node");
    let own = &found.motion.nodes[node];
    assert_eq!((own.parent, own.weights.as_slice()), (None, &[0.0][..]));
    assert_eq!(own.local, Local::Fixed(glam::DAffine3::IDENTITY));
    assert_eq!(found.motion.clips[1].channels[0].target, ChannelTarget::Weights(node));
}
