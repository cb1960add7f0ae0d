//! Emitters of scene files: every key, and refusals.

use glam::{DVec3, Vec3};
use image::RgbaImage;

use super::{read, refusal};

/// Every key.
pub const EMITTERS: &str = "\
[[emitters]]
name = 'smoke'
position = [1, 2, 3]
extent = [0.5, 0, 0.5]
rate = 50
life = 2
start = -1
end = 8
velocity = [0, 1, 0]
spread = [0.1, 0.2, 0.3]
gravity = [0, -1, 0]
drag = 0.5
size = [0.1, 0.5, 0.2]
color = [[1, 0.5, 0.25, 0.5], '#ff0000', [0, 0, 1]]
emission = [[100, 50, 0], [0, 0, 0]]
lit = false
turn_degrees = 180
spin_degrees = 90
softness = 0.25
texture = 'puff.png'
frames = [4, 2]
frame = 'random'
seed = 4294967295

[[emitters]]
position = [0, 0, 0]
rate = 1
life = 1
color = '#00ff00'
size = 3
";

#[test]
fn every_key_of_an_emitter_does_what_it_says() {
    let folder = tempfile::tempdir().unwrap();
    RgbaImage::new(8, 4).save(folder.path().join("puff.png")).unwrap();
    let scene = read(&folder, EMITTERS).unwrap();
    let [smoke, plain] = &scene.emitters[..] else { panic!("{:?}", scene.emitters) };
    assert_eq!((smoke.name.as_str(), plain.name.as_str()), ("smoke", "emitter 1"));
    assert_eq!((smoke.position, smoke.extent), (DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.5, 0.0, 0.5)));
    assert_eq!((smoke.rate, smoke.life, smoke.start, smoke.end), (50.0, 2.0, Some(-1.0), Some(8.0)));
    assert_eq!((smoke.velocity, smoke.spread), (DVec3::Y, DVec3::new(0.1, 0.2, 0.3)));
    assert_eq!((smoke.gravity, smoke.drag, smoke.softness), (DVec3::NEG_Y, 0.5, 0.25));
    assert_eq!(smoke.size, [0.1, 0.5, 0.2]);
    assert_eq!(smoke.color, [[1.0, 0.5, 0.25, 0.5], [1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]]);
    assert_eq!(smoke.emission, [Vec3::new(100.0, 50.0, 0.0), Vec3::ZERO]);
    assert_eq!((smoke.lit, smoke.turn_degrees, smoke.spin_degrees), (false, 180.0, 90.0));
    assert_eq!((smoke.texture, smoke.frames, smoke.picks_frame, smoke.seed), (Some(0), [4, 2], true, u32::MAX));
    assert_eq!(scene.files, [folder.path().join("puff.png")]);
    assert_eq!(
        (&plain.color[..], &plain.size[..], plain.seed, plain.lit),
        (&[[0.0, 1.0, 0.0, 1.0]][..], &[3.0][..], 1, true)
    );
    assert!(scene.check().is_ok() && scene.moves());
    // They come with a base, and stand still in a scene that does.
    let still = scene.into_still(&afterlight::scene::Playing::at(7.0));
    assert_eq!((still.moment, still.moves(), still.emitters.len()), (Some(7.0), false, 2));
}

#[test]
fn emitters_that_cannot_be_are_refused_at_their_line() {
    let emitter = |keys: &str| format!("[[emitters]]\nposition = [0, 0, 0]\nrate = 10\nlife = 1\n{keys}");
    for (text, words) in [
        ("[[emitters]]\nrate = 1\nlife = 1".to_owned(), "emitters[0]: needs position"),
        ("[[emitters]]\nposition = [0, 0, 0]\nrate = 1".to_owned(), "emitters[0]: needs life"),
        (
            "[[emitters]]\nposition = [0, 0, 0]\nrate = 1\nlife = 0".to_owned(),
            "scene.toml:4: emitters[0].life = 0: must be from 1e-6 to 1e6",
        ),
        (
            "[[emitters]]\nname = 'jet'\nposition = [0, 0, 0]\nrate = 1e9\nlife = 1".to_owned(),
            "1000000001 particles alive at once (rate times life; most are of `jet`)",
        ),
        (
            "[[emitters]]\nposition = [0, 0, 0]\nrate = nan\nlife = 1".to_owned(),
            "emitters[0].rate = nan: must be from 1e-6 to 1e9",
        ),
        (emitter("size = -1"), "emitters[0].size = -1: must be from 0 to 1e9"),
        (emitter("size = [1, 2, 3, 4, 5]"), "must be one value, or up to 4 over life"),
        (emitter("size = []"), "must be one value, or up to 4 over life"),
        (emitter("color = [[1, 1, 1, 2]]"), "must be from 0 to 1"),
        (emitter("drag = -1"), "must be from 0 to 1e6"),
        (emitter("texture = 'none.png'"), "none.png"),
        (emitter("frames = [2, 2]"), "it has frames, but no texture that has them"),
        (emitter("frames = [17, 1]"), "must be a whole number from 1 to 16"),
        (emitter("frame = 'all'"), "unknown word"),
        (emitter("seed = -1"), "must be a whole number from 0 to 4294967295"),
        (emitter("velocty = [0, 1, 0]"), "did you mean \"velocity\"?"),
        (emitter("node = 'a'"), "unknown key \"node\""),
    ] {
        let error = refusal(&text);
        assert!(error.contains(words), "{text:?}:\n  {error}\n  lacks {words:?}");
    }
}
