//! `[[clips]]`: keys move models with all their copies, lights and the camera, and an error in them names its line.

use afterlight::scene::{ClipChoice, LightKind, Playing, Scene, builtin};
use glam::{DQuat, DVec3};

use super::{folder, read, refusal};

/// Every key of clips and their channels.
pub const CLIPS: &str = r##"
[[models]]
name = "box"
shape = { kind = "box" }
translation = [0, 0, -2]
scale = 0.5
grid = { count = [2, 1, 1], spacing = [4, 0, 0] }

[[models]]
name = "weed"
builtin = "seaweed?count=1&joints=3"
instances = [{ translation = [0, 0, 0] }, { translation = [5, 0, 0] }]

[[lights]]
name = "lamp"
kind = "spot"
position = [0, 4, 0]
direction = [0, -1, 0]
intensity = 100
inner_angle_degrees = 10
outer_angle_degrees = 30

[camera]
position = [0, 0, 9]
target = [0, 0, 0]

[[clips]]
name = "turn"
channels = [
    { target = "models.box", property = "rotation", axis = [0, 1, 0], times = [0, 4], values = [0, 720] },
    { target = "models.box", property = "scale", times = [0, 2], values = [1, [2, 2, 4]], interpolation = "step" },
    { target = "models.weed", property = "translation", times = [0, 1, 2], values = [[0, 0, 0], [0, 1, 0], [0, 0, 0]], interpolation = "cubic", in_tangents = [[0, 0, 0], [0, 0, 0], [0, 0, 0]], out_tangents = [[0, 8, 0], [0, 0, 0], [0, 0, 0]] },
    { target = "lights.lamp", property = "translation", times = [0, 4], values = [[0, 4, 0], [4, 4, 0]] },
    { target = "lights.lamp", property = "rotation", times = [0, 1], values = [{ axis = [1, 0, 0], degrees = -90 }, [0, 0, 0, 1]] },
    { target = "lights.lamp", property = "color", times = [0, 4], values = ["#000000", [1, 0.5, 0]] },
    { target = "lights.lamp", property = "outer_angle_degrees", times = [0, 4], values = [30, 50] },
    { target = "camera", property = "translation", times = [0, 2, 4], values = [[0, 0, 9], [1, 0, 9], [4, 0, 9]], interpolation = "cubic" },
    { target = "camera", property = "fov_y_degrees", times = [0, 4], values = [60, 20] },
]
"##;

fn at(scene: &Scene, time: f64) -> Scene {
    let clips = scene.motion.choose(&["turn".to_owned()]).expect("a clip");
    scene.at(&Playing { clips, ..Playing::at(time) }).into_owned()
}

fn places(scene: &Scene, name: &str) -> Vec<DVec3> {
    let named = scene.objects.iter().filter(|object| object.name == name);
    named.map(|object| object.transform.translation).collect()
}

fn near(a: DVec3, b: DVec3) -> bool {
    a.distance(b) < 1e-9
}

#[test]
fn keys_move_models_with_their_copies_lights_and_the_camera() {
    let scene = read(&folder(), CLIPS).unwrap();
    scene.check().unwrap();
    let (begin, middle) = (at(&scene, 0.0), at(&scene, 1.0));
    // The clips are the file's own and the built-in model's, whose lights and cameras are not taken.
    assert_eq!(
        scene.motion.clips.iter().map(|clip| clip.name.as_str()).collect::<Vec<_>>(),
        ["sway", "swim", "turn", "turn"]
    );
    let own = |scene: &Scene, time: f64| {
        let clips = ClipChoice::Only(vec![3]);
        scene.at(&Playing { clips, looped: false, ..Playing::at(time) }).into_owned()
    };
    let boxes = places(&own(&scene, 0.0), "box");
    assert!(
        boxes.len() == 2 && near(boxes[0], DVec3::new(-2.0, 0.0, -2.0)) && near(boxes[1], DVec3::new(2.0, 0.0, -2.0))
    );
    // Half a turn after a second, as two whole ones take four; twice as large from two seconds on.
    let turned = places(&own(&scene, 1.0), "box");
    assert!(near(turned[0], DVec3::new(2.0, 0.0, -2.0)) && near(turned[1], DVec3::new(-2.0, 0.0, -2.0)), "{turned:?}");
    let quarter = places(&own(&scene, 2.5), "box");
    assert!(
        near(quarter[0], DVec3::new(0.0, 0.0, -2.0 + 4.0)) || near(quarter[0], DVec3::new(0.0, 0.0, -2.0 - 4.0)),
        "{quarter:?}"
    );
    // The tangent of the first key carries the model above its linear way: 1 + 0.125 * 8 * 0.5 seconds in.
    let height = |time: f64| {
        let scene = own(&scene, time);
        let weeds = scene.objects.iter().filter(|object| object.name == "weed" && object.transform.translation.x > 4.0);
        weeds.map(|object| object.transform.translation.y).fold(f64::INFINITY, f64::min)
    };
    assert!((height(0.5) - height(0.0) - (0.5 + 0.125 * 8.0)).abs() < 1e-9, "{}", height(0.5) - height(0.0));
    let LightKind::Spot { position, direction, outer_angle_degrees, .. } = middle.lights[0].kind else {
        panic!("a spot")
    };
    assert!(near(position, DVec3::new(1.0, 4.0, 0.0)) && near(direction, DVec3::NEG_Z));
    assert!((outer_angle_degrees - 35.0).abs() < 1e-9 && middle.lights[0].color.x == 0.25);
    let LightKind::Spot { direction, .. } = begin.lights[0].kind else { panic!("a spot") };
    assert!(near(direction, DVec3::NEG_Y));
    // Through its keys, with a velocity of 1 m/s at the second one.
    assert!(near(at(&scene, 2.0).camera.position, DVec3::new(1.0, 0.0, 9.0)) && middle.camera.position.x < 0.5);
    assert!(begin.camera.rotation.dot(DQuat::IDENTITY).abs() > 1.0 - 1e-9);
}

#[test]
fn what_is_wrong_with_a_channel_has_its_line() {
    // Seaweed takes long to grow, and any model will do.
    let clips = CLIPS.replacen("seaweed?count=1&joints=3", "triangle", 1);
    let refused = |from: &str, to: &str, what: &str| {
        assert!(clips.contains(from), "{from}");
        let error = refusal(&clips.replacen(from, to, 1));
        assert!(error.starts_with("scene.toml:") && error.contains(what), "{error}\n{what}");
    };
    refused("models.box", "models.bax", "no model of this file has this name");
    refused("lights.lamp", "lights.lump", "unknown light of this file \"lump\": did you mean \"lamp\"?");
    refused("\"camera\", property", "\"eye\", property", "must be \"models.NAME\", \"lights.NAME\" or \"camera\"");
    refused("fov_y_degrees\", times", "fov\", times", "unknown property \"fov\"");
    refused("times = [0, 4], values = [0, 720]", "times = [0, 0], values = [0, 720]", "must be after the 0 before it");
    refused("values = [0, 720]", "values = [0]", "has 1 items for 2 times: expected as many");
    refused("values = [0, 720]", "values = [0, 1e15]", "the turns take more than");
    refused("values = [60, 20]", "values = [60, 200]", "must be from 0.001 to 179.999 degrees");
    refused("interpolation = \"step\"", "interpolation = \"stepp\"", "did you mean \"step\"");
    refused("axis = [0, 1, 0], times", "axis = [0, 0, 0], times", "must not be zero");
    refused("interpolation = \"step\"", "in_tangents = []", "goes with interpolation = \"cubic\"");
    refused("[0, 0, 0, 1]]", "[0, 0, 0, 0]]", "must not be zero");
    refused("property = \"scale\"", "property = \"rotation\"", "must be ");
    refused("[[0, 8, 0], [0", "[[0, 8], [0", "must be 3 numbers a second");
    let twice = "\n    { target = \"camera\", property = \"fov_y_degrees\", times = [0], values = [60] },\n]\n";
    let error = refusal(&clips.replacen("\n]\n", twice, 1));
    assert!(error.contains("another channel of this clip moves the same"), "{error}");
    let point = clips.replacen("kind = \"spot\"", "kind = \"point\"", 1).replacen("direction = [0, -1, 0]\n", "", 1);
    let point = point.replacen("inner_angle_degrees = 10\nouter_angle_degrees = 30\n", "", 1);
    assert!(refusal(&point).contains("shines all around: it has no rotation"));
}

#[test]
fn a_base_keeps_its_clips_and_without_its_lights_those_that_move_none() {
    let with = |lights: &str| read(&folder(), &format!("base = \"builtin:seaweed?count=1\"\n{lights}")).unwrap();
    let whole = builtin::open("seaweed?count=1").unwrap().motion;
    assert_eq!(with("").motion, whole);
    let dark = with("base_lights = false\n[[lights]]\nkind = \"directional\"\ndirection = [0, -1, 0]\nintensity = 9\n");
    dark.check().unwrap();
    assert_eq!(dark.motion.clips[1].channels.len() + 1, whole.clips[1].channels.len());
}
