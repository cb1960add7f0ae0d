//! Mistakes in a scene file, and the errors about them.

use std::fs;
use std::path::PathBuf;

use afterlight::scene::file::load_settings;
use afterlight::scene::{OpenOptions, open};
use proptest::prelude::*;

use super::{EVERYTHING, folder, read, refusal};

/// Each must be refused at its line with these words.
fn all_refused(table: &[(&str, &str)]) {
    for (text, words) in table {
        let error = refusal(text);
        assert!(error.contains(words), "{text:?}:\n  {error}\n  lacks {words:?}");
    }
}

#[test]
fn looks_and_atlases_that_cannot_be_are_refused() {
    let sprite = "shape={kind='plane'}\nmaterial='fire'\n[[materials]]\nname='fire'\n";
    let clip = |keys: &str| {
        format!(
            "[[models]]\nname='a'\n{sprite}atlas=[2,4]\n[[clips]]\nchannels=[{{target='models.a', property='cell', {keys}}}]"
        )
    };
    all_refused(&[
        (
            "[[models]]\nshape={kind='box'}\ncell = -1",
            "scene.toml:3: models[0].cell = -1: must be a whole number from 0 to 65535",
        ),
        ("[[models]]\nshape={kind='box'}\ntint = [1, 2, 0]", "must be from 0 to 1"),
        ("[[models]]\nshape={kind='box'}\nselected = 1", "must be true or false"),
        ("[[materials]]\nname='a'\natlas = [1, 257]", "must be a whole number from 1 to 256"),
        ("[[materials]]\nname='a'\natlas = 4", "must be an array"),
        ("[[materials]]\nname='a'\natlas = [4]", "must be [rows, columns]"),
        (&clip("times=[0, 1], values=[0, 1.5]"), "must be a whole number"),
        (&clip("times=[0, 1], values=[0, 1], interpolation='linear'"), "its interpolation is \"step\""),
    ]);
    let scene = read(&folder(), &clip("times=[0, 1], values=[0, 7]")).unwrap();
    assert!(scene.check().is_ok() && scene.objects[0].node.is_none());
    let scene = read(&folder(), &clip("times=[0, 1], values=[0, 8]")).unwrap();
    let error = scene.check().unwrap_err().to_string();
    assert!(error.contains("key 1 is cell 8, but the atlas of material `fire` is 2x4: expected 0 to 7"), "{error}");
}

#[test]
fn an_unknown_key_is_refused_at_its_line_with_the_one_that_was_meant() {
    all_refused(&[
        ("\n[cameras]\n", "scene.toml:2: unknown key \"cameras\": did you mean \"camera\"?"),
        ("[camera]\n\nfov = 3", "scene.toml:3: camera: unknown key \"fov\": did you mean \"fov_y_degrees\"?"),
        (
            "[[lights]]\nkind='point'\nintensty=3",
            "scene.toml:3: lights[0]: unknown key \"intensty\": did you mean \"intensity\"?",
        ),
        (
            "[[models]]\nshape={kind='box', sizes=[1,1,1]}",
            "scene.toml:2: models[0].shape: unknown key \"sizes\": did you mean \"size\"?",
        ),
        (
            "[settings.shadows]\nsise = 3",
            "scene.toml:2: settings.shadows: unknown key \"sise\": did you mean \"size\"?",
        ),
        (
            "[settings]\n\ntonemap = 'agxx'",
            "scene.toml:3: settings.tonemap = 'agxx': unknown tonemap \"agxx\": did you mean \"agx\"?",
        ),
        ("[settings]\ngbuffer = 'lean,norml=oct16'", "did you mean \"normal\"?"),
        ("[[models]]\nshape = {kind = 'sphare'}", "did you mean \"sphere\"?"),
        (
            "base = 'builtin:hal'",
            "scene.toml:1: base = 'builtin:hal': unknown built-in scene \"hal\": did you mean \"hall\"?",
        ),
        (
            "[[models]]\nbuiltin = 'field?object=1'",
            "scene.toml:2: models[0].builtin = 'field?object=1': builtin:field: unknown parameter \"object\"",
        ),
        (
            "[[models]]\nshape={kind='box'}\nmaterial='steel'\n[[materials]]\nname='steal'",
            "scene.toml:3: models[0].material = 'steel': unknown material \"steel\": did you mean \"steal\"?",
        ),
        (
            "\n[[models]]\npath='crate.obj'\nmaterials={plank='planks'}",
            "scene.toml:4: models[0].materials.plank = 'planks': the model has no such material: unknown material \"plank\": did you mean \"planks\"?",
        ),
        ("\"a\\nb\\u001b\" = 1", "scene.toml:1: unknown key \"a\\nb"),
    ]);
}

#[test]
fn a_wrong_settings_file_is_told_at_its_line_or_at_the_key_that_names_it() {
    let folder = folder();
    let refused = |text: &str, words: &str| {
        fs::write(folder.path().join("wrong.toml"), text).unwrap();
        let error = read(&folder, "\nsettings.from = 'wrong.toml'").unwrap_err();
        assert!(error.contains(words), "{text:?}:\n  {error}\n  lacks {words:?}");
        let bare = load_settings(&folder.path().join("wrong.toml")).unwrap_err().to_string();
        assert_eq!(bare, error);
    };
    refused("[settings]\nsise = 3", "wrong.toml:2: settings: unknown key \"sise\": did you mean \"size\"?");
    refused("\n[settings.shadows]\nsize = 3", "wrong.toml:3: settings.shadows.size = 3: must be a whole number");
    refused("[settings]\nfrom = 'tuned.toml'", "wrong.toml:2: settings.from = 'tuned.toml': only a scene file");
    refused("[settings]\n[camera]\nnear = 1", "wrong.toml:2: unknown key \"camera\" (possible: settings, evidence)");
    refused("[evidence]\nerror = 0.1", "wrong.toml:1: a settings file needs [settings]");
    refused("[settings", "wrong.toml:1: ");
    all_refused(&[
        ("\nsettings.from = 'no.toml'", "scene.toml:2: settings.from = 'no.toml': cannot read no.toml"),
        ("settings.from = 3", "scene.toml:1: settings.from = 3: must be a string"),
    ]);
}

#[test]
fn a_value_of_the_wrong_type_is_refused() {
    all_refused(&[
        ("lights = 3", "scene.toml:1: lights = 3: must be an array"),
        ("lights = [3]", "lights[0] = 3: must be a table of name, kind"),
        ("camera = 'x'", "camera = 'x': must be a table"),
        ("base = 3", "base = 3: must be a string"),
        ("base = 'builtin:quad'\nbase_lights = 1", "scene.toml:2: base_lights = 1: must be true or false"),
        ("[camera]\nnear = '1'", "camera.near = '1': must be from"),
        ("[camera]\nposition = [1, 2]", "camera.position = [1, 2]: must be 3 numbers, [x, y, z]"),
        ("[camera]\nposition = [1, true, 2]", "camera.position[1] = true: must be a number"),
        ("[camera]\nposition = 1979-05-27", "camera.position = 1979-05-27: must be 3 numbers"),
        ("[environment]\nambient = '#12345g'", "environment.ambient = '#12345g': must be \"#rrggbb\""),
        ("[environment]\nambient = 4", "must be 3 numbers, linear [r, g, b]"),
        ("[settings]\nsize = '12'", "must be WIDTHxHEIGHT"),
        ("[settings]\nsize = [1.5, 2]", "settings.size[0] = 1.5: must be a whole number from 1"),
        ("[settings]\nbrdf = 7", "settings.brdf = 7: must be a string"),
        ("[[models]]\nshape={kind='box'}\nmaterials = 'x'", "must be a table"),
        ("[[models]]\nshape={kind='box'}\nrotation = 3", "must be 3 numbers, [x, y, z] in degrees, or a table"),
        ("[[models]]\nshape={kind='box'}\nscale = 'big'", "must be 3 numbers"),
    ]);
}

#[test]
fn each_value_of_a_beam_is_refused_that_is_none() {
    let whole = [("position", "[0, 3, 0]"), ("direction", "[0, -1, 0]"), ("intensity", "1"), ("radius", "0.5")];
    let beam = |key: &str, value: &str| {
        let line = |(key, value): &(&str, &str)| format!("\n{key} = {value}");
        let others: String = whole.iter().filter(|(own, _)| *own != key).map(line).collect();
        let own = if value.is_empty() { String::new() } else { line(&(key, value)) };
        format!("[[lights]]\nkind='beam'{others}{own}")
    };
    for (key, value, says) in [
        ("position", "", "scene.toml:1: lights[0]: needs position"),
        ("position", "[0, inf, 0]", "scene.toml:6: lights[0].position[1] = inf: must be a number from -1e15 to 1e15"),
        ("direction", "", "scene.toml:1: lights[0]: needs either direction or target"),
        ("direction", "[0, 0, 0]", "must not be zero: it is a direction"),
        ("target", "[0, 1, 0]", "scene.toml:1: lights[0]: needs either direction or target"),
        ("intensity", "", "scene.toml:1: lights[0]: needs intensity, in lux or candela"),
        ("intensity", "-1", "scene.toml:6: lights[0].intensity = -1: must be from 0 to 1e18"),
        ("radius", "", "scene.toml:1: lights[0]: needs radius, of the disc in metres"),
        ("radius", "0", "scene.toml:6: lights[0].radius = 0: must be from 1e-12 to 1e15"),
        ("edge", "1.5", "scene.toml:7: lights[0].edge = 1.5: must be from 0 to 1"),
        ("edge", "-0.1", "scene.toml:7: lights[0].edge = -0.1: must be from 0 to 1"),
        ("range", "0", "scene.toml:7: lights[0].range = 0: must be from 1e-12 to 1e15"),
        ("angular_diameter_degrees", "91", "angular_diameter_degrees = 91: must be from 0 to 90 degrees"),
        ("falloff", "'quadratic'", "scene.toml:7: lights[0].falloff = 'quadratic': a beam light has no such key"),
        ("inner_angle_degrees", "1", "lights[0].inner_angle_degrees = 1: a beam light has no such key"),
        ("casts_shadow", "1", "lights[0].casts_shadow = 1: must be true or false"),
    ] {
        all_refused(&[(&beam(key, value), says)]);
    }
}

#[test]
fn a_number_out_of_range_is_refused_with_the_range() {
    let light = |line: &str| format!("[[lights]]\nkind='point'\nposition=[0,0,0]\nintensity=1\n{line}");
    let refused = |line: &str, words: &str| all_refused(&[(&light(line), &format!("scene.toml:5: {words}"))]);
    refused("range = 0", "lights[0].range = 0: must be from 1e-12 to 1e15");
    refused("range = -1", "lights[0].range = -1: must be");
    refused("range = 1e-300", "lights[0].range = 1e-300: must be");
    refused("color = [1, -1, 1]", "lights[0].color[1] = -1: must be from 0");
    refused("temperature = 999", "lights[0].temperature = 999: must be from 1000 to 40000 kelvin");
    refused("temperature = 2700\ncolor = [1, 1, 1]", "lights[0].temperature = 2700: a light has either color or temp");
    refused("falloff = 'quadratic'", "lights[0].falloff = 'quadratic': a quadratic fall-off needs a range");
    refused("falloff = {}", "lights[0].falloff = {}: needs at least one of constant");
    refused("falloff = { linear = 1, cutoff = -1 }", "lights[0].falloff.cutoff = -1: must be from 0 to 1e18");
    refused(
        "falloff = { linear = 1, cutoff = 1 }\nrange = 3",
        "lights[0].falloff = { linear = 1, cutoff = 1 }: a light has",
    );
    refused("falloff = { linear = -1 }", "lights[0].falloff.linear = -1: must not be negative");
    refused("direction = [0, 1, 0]", "lights[0].direction = [0, 1, 0]: a point light has no such key");
    all_refused(&[
        (
            "[[lights]]\nkind='point'\nposition=[0,0,0]\nintensity=-1",
            "scene.toml:4: lights[0].intensity = -1: must be from 0 to 1e18",
        ),
        ("[[lights]]\nkind='point'\nposition=[0,0,0]\nintensity=nan", "lights[0].intensity = nan: must be"),
        ("[[lights]]\nkind='directional'\ndirection=[0,0.0,-0.0]\nintensity=1", "must not be zero: it is a direction"),
        (
            "[[lights]]\nkind='spot'\nposition=[0,1,0]\ntarget=[0,1,0]\nintensity=1",
            "must not be the light's own position",
        ),
        (
            "[[lights]]\nkind='spot'\nposition=[0,1,0]\ntarget=[0,0,0]\nintensity=1\ninner_angle_degrees=50",
            "scene.toml:6: lights[0].inner_angle_degrees = 50: must not be above outer_angle_degrees, which is 45",
        ),
        ("[[lights]]\nkind='bean'", "did you mean"),
        ("[[lights]]\nintensity=1", "lights[0]: needs kind: directional, point, spot or beam"),
        ("[[scattered_lights]]\ncount=0", "scattered_lights[0].count = 0: must be a whole number from 1 to 1000000"),
        ("[camera]\nfov_y_degrees = 0", "must be from 0.001 to 179.999 degrees"),
        ("[camera]\nfov_y_degrees = 180", "must be from 0.001 to 179.999 degrees"),
        ("[camera]\northographic_height = 0", "camera.orthographic_height = 0: must be from 1e-12 to 1e15"),
        (
            "[camera]\nfov_y_degrees = 60\northographic_height = 2",
            "scene.toml:3: camera.orthographic_height = 2: a camera has either fov_y_degrees or orthographic_height",
        ),
        ("[camera]\nposition = [0, inf, 0]", "camera.position[1] = inf: must be a number from -1e15 to 1e15"),
        (
            "[camera]\nposition = [1, 2, 3]\ntarget = [1, 2, 3.0]",
            "scene.toml:3: camera.target = [1, 2, 3.0]: must not be the camera's own position",
        ),
        ("[camera]\nnear = 0.0", "camera.near = 0.0: must be from 1e-12"),
        ("[camera]\nexposure = 101", "must be a number from -100 to 100 (EV100)"),
        ("[settings]\nexposure = -inf", "must be a number from -100 to 100 (EV100)"),
        ("[settings]\nsamples = 4097", "must be a whole number from 1 to 4096"),
        ("[settings]\nmsaa = 3", "must be 1, 2, 4 or 8"),
        ("[settings]\nanisotropy = 17", "must be a whole number from 1 to 16"),
        ("[settings]\nresolve = 'gamma'", "possible: linear, tone-mapped"),
        ("[settings]\nsize = [0, 720]", "settings.size[0] = 0: must be a whole number from 1"),
        ("[settings]\nsize = '0x720'", "must be WIDTHxHEIGHT, each at least 1"),
        ("[settings]\nshadows = { size = 0 }", "must be a whole number from 32 to 16384"),
        ("[settings.shadows]\nfilter = '7x7'", "possible: none, 2x2, 3x3, 5x5, poisson, pcss"),
        ("[settings.shadows]\ncascades = 5", "must be a whole number from 1 to 4"),
        ("[settings.shadows]\nlambda = 1.5", "must be a number from 0 to 1"),
        ("[settings.shadows]\nbudget = 0", "must be a whole number from 1"),
        ("[[models]]\nshape = { kind = 'box' }\ncasts_shadow = 'back'", "must be true, false or \"front\""),
        (
            "[[models]]\nshape = { kind = 'box' }\nmovable = 1",
            "scene.toml:3: models[0].movable = 1: must be true or false",
        ),
        ("[[lights]]\nkind = 'point'\nangular_diameter_degrees = 1", "a point light has no such key"),
        ("[[lights]]\nkind = 'directional'\nradius = 1", "a directional light has no such key"),
        ("[settings.shadows]\nsize = 16385", "must be a whole number from 32 to 16384"),
        ("[settings.shadows]\nslope_bias = -0.1", "must be a number from 0 to 1000"),
        (
            "[[materials]]\nname='a'\nroughness = 1.01",
            "scene.toml:3: materials[0].roughness = 1.01: must be from 0 to 1",
        ),
        ("[[materials]]\nname='a'\nfilm_ior = 0.5", "materials[0].film_ior = 0.5: must be from 1 to 100"),
        ("[[materials]]\nname='a'\nfilm_thickness = [1]", "materials[0].film_thickness = [1]: must be [least, most]"),
        ("[[materials]]\nname='a'\nanisotropy = -0.5", "materials[0].anisotropy = -0.5: must be from 0 to 1"),
        (
            "[[materials]]\nname='a'\ndiffuse_transmission = 1.5",
            "materials[0].diffuse_transmission = 1.5: must be from 0 to 1",
        ),
        (
            "[[materials]]\nname='a'\ndiffuse_transmission_color = [0, 2, 0]",
            "materials[0].diffuse_transmission_color[1] = 2: must be from 0 to 1",
        ),
        ("[[materials]]\nname='a'\nbase_color = [0, 0, 2]", "materials[0].base_color[2] = 2: must be from 0 to 1"),
        (
            "[[materials]]\nname='a'\nshininess_texture = 'no.png'",
            "scene.toml:3: materials[0].shininess_texture = 'no.png': ",
        ),
        (
            "[[materials]]\nname='a'\nshininess_texture = { wrap = 'clamp' }",
            "scene.toml:3: materials[0].shininess_texture: needs file",
        ),
        (
            "[[materials]]\nname='a'\nnormal_texture = { file = 'no.png', wrap = ['clamp'] }",
            "scene.toml:3: materials[0].normal_texture.wrap = ['clamp']: must be a word, or two, [u, v]",
        ),
        (
            "[[materials]]\nname='a'\nnormal_texture = { file = 'planks.png', uv_set = 2 }",
            "scene.toml:3: materials[0].normal_texture.uv_set = 2: must be a whole number from 0 to 1",
        ),
        ("[[materials]]\nname='a'\nior = 0.5", "scene.toml:3: materials[0].ior = 0.5: must be from 1 to 100"),
        (
            "[[materials]]\nname='a'\nshininess_texture = 3",
            "scene.toml:3: materials[0].shininess_texture = 3: must be a string",
        ),
        ("[[materials]]\nname='a'\nalpha_cutoff = 0.3", "alpha_cutoff goes with alpha_mode = \"mask\""),
        ("[[models]]\nshape={kind='box'}\nscale = 0", "must not be 0"),
        ("[[models]]\nshape={kind='sphere', radius=-1}", "models[0].shape.radius = -1: must be from 1e-12"),
        ("[[models]]\nshape={kind='sphere', size=[1,1]}", "a sphere has no such key (it has radius, segments)"),
        ("[[models]]\nshape={kind='sphere', segments=2}", "must be a whole number from 3 to 1024"),
        ("[[models]]\nshape={kind='box'}\nrotation={axis=[0,0,0],degrees=1}", "must not be zero"),
        ("[[models]]\nshape={kind='box'}\nrotation={quaternion=[0,0,0,0]}", "must not be zero"),
        ("[[models]]\nshape={kind='box'}\nrotation={degrees=1}", "must have either quaternion, or axis and degrees"),
        (
            "[[models]]\nshape={kind='box'}\ngrid={count=[2000,2001,1],spacing=[1,1,1]}",
            "makes more than 4000000 copies",
        ),
        (
            "\n[[models]]\nshape={kind='box'}\ntranslation=[9e14,0,0]\ninstances=[{translation=[9e14,0,0]}]",
            "scene.toml:2: models[0]: reaches farther than 1e15 metres",
        ),
    ]);
}

#[test]
fn what_is_missing_or_does_not_go_together_is_told_where_its_table_starts() {
    all_refused(&[
        ("\n\n[[lights]]", "scene.toml:3: lights[0]: needs kind: directional, point, spot or beam"),
        (
            "\n[[lights]]\nintensity=1\nkind='spot'\nposition=[0,0,0]",
            "scene.toml:2: lights[0]: needs either direction or target",
        ),
        ("[[lights]]\nkind='point'", "needs intensity"),
        ("[[lights]]\nkind='point'\nintensity=1", "needs position"),
        ("[[materials]]\nroughness=1", "scene.toml:1: materials[0]: needs name"),
        ("\n[[models]]\nname='x'", "scene.toml:2: models[0]: needs exactly one of path, builtin, shape"),
        ("[[models]]\npath='a.obj'\nbuiltin='hall'", "needs exactly one of"),
        ("[[models]]\nshape={kind='box'}\ngrid={count=[1,1,1]}", "scene.toml:3: models[0].grid: needs spacing"),
        ("[camera]\nup=[0,1,0]", "up goes with target"),
        (
            "[camera]\ntarget=[0,0,0]\nrotation=[0,0,0]",
            "scene.toml:3: camera.rotation = [0,0,0]: a camera has either target or rotation",
        ),
        ("base_lights = false", "base_lights goes with base"),
        ("\n[[scattered_lights]]\ncount=2", "scene.toml:2: scattered_lights[0]: needs min"),
        (
            "[[scattered_lights]]\ncount=2\nmin=[0,0,0]\nmax=[1,-1,1]",
            "scene.toml:4: scattered_lights[0].max = [1,-1,1]: must not be below min in any coordinate",
        ),
        (
            "[[scattered_lights]]\ncount=2\nmin=[0,0,0]\nmax=[1,1,1]\nintensity=1\nfalloff='quadratic'",
            "scattered_lights[0].falloff = 'quadratic': a quadratic fall-off needs a range",
        ),
        (
            "[environment]\nambient_strength = 2\nground = [1, 1, 1]",
            "scene.toml:3: environment.ground = [1, 1, 1]: an environment has either ambient, or sky and ground",
        ),
    ]);
}

#[test]
fn text_that_is_no_toml_names_the_line() {
    all_refused(&[
        ("\n\n[camera\n", "scene.toml:3: "),
        ("a = 1\na = 2", "scene.toml:2: "),
        ("[camera]\r\nnear = \r\n", "scene.toml:2: "),
        ("\u{feff}x = 1", "scene.toml:1: unknown key \"x\""),
        ("x", "scene.toml:1: "),
    ]);
    // Depth ends in an error, not at the end of the stack.
    for text in ["[".repeat(100_000), format!("a={}", "[".repeat(100_000)), format!("a={}", "{a=".repeat(100_000))] {
        refusal(&text);
    }
    refusal(&format!("{}a=1", "a.".repeat(100_000)));
}

#[test]
fn files_that_cannot_be_read_are_told_at_the_line_that_names_them() {
    all_refused(&[
        ("[[models]]\n\npath='no.obj'", "scene.toml:3: models[0].path = 'no.obj': cannot read no.obj: "),
        (
            "[[models]]\npath='everything.toml'",
            "scene.toml:2: models[0].path = 'everything.toml': everything.toml: a scene file is not a model",
        ),
        (
            "[[models]]\npath='planks.png'",
            ".png is not a format that is read; afterlight reads models from .gltf, .glb and .obj files",
        ),
        ("[[models]]\npath='.'", "scene.toml:2: models[0].path = '.': "),
        ("[[models]]\npath='a\\u0000b.obj'", "scene.toml:2: "),
        ("[[models]]\npath=\"a\\nb.obj\"", "scene.toml:2: "),
        (
            "[[materials]]\nname='a'\nnormal_texture='no.png'",
            "scene.toml:3: materials[0].normal_texture = 'no.png': cannot read no.png: ",
        ),
        ("[[materials]]\nname='a'\nnormal_texture='crate.obj'", "crate.obj: is not an image"),
        ("[[materials]]\nname='a'\nnormal_texture=''", "scene.toml:3: "),
        ("base = 'no.toml'", "scene.toml:1: base = 'no.toml': cannot read no.toml: "),
        ("base = 'crate.mtl'", ".mtl is not a format that is read"),
        ("base = ''", "it is a directory"),
    ]);
    let folder = folder();
    let says = |path: PathBuf| open(path.to_str().unwrap(), &OpenOptions::default()).unwrap_err().to_string();
    fs::write(folder.path().join("latin1.toml"), b"# caf\xe9\n").unwrap();
    assert!(says(folder.path().join("latin1.toml")).contains("not UTF-8 text (byte 5)"));
    fs::create_dir(folder.path().join("folder.toml")).unwrap();
    assert!(says(folder.path().join("folder.toml")).contains("it is a directory"));
    assert!(says(folder.path().join("none.toml")).starts_with("cannot read "));
}

#[test]
#[cfg(unix)]
fn a_pipe_and_a_device_in_the_place_of_a_file_are_refused_at_once() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    let pipes = ["png", "obj", "glb", "hdr", "bin", "toml"].map(|kind| path(&format!("pipe.{kind}")));
    let made = std::process::Command::new("mkfifo").args(pipes).status();
    assert!(made.is_ok_and(|status| status.success()), "mkfifo");
    for kind in ["png", "obj", "gltf", "exr"] {
        std::os::unix::fs::symlink("/dev/zero", path(&format!("zero.{kind}"))).expect("linked");
    }
    let buffer = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"uri":"pipe.bin","byteLength":36}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,1]}]}"#;
    fs::write(path("of_pipe.gltf"), buffer).expect("written");
    for text in [
        "[[materials]]\nname='a'\nnormal_texture='pipe.png'",
        "[[materials]]\nname='a'\nnormal_texture='zero.png'",
        "[[models]]\npath='pipe.obj'",
        "[[models]]\npath='zero.obj'",
        "[[models]]\npath='pipe.glb'",
        "[[models]]\npath='zero.gltf'",
        "[[models]]\npath='of_pipe.gltf'",
        "base='pipe.toml'",
        "[settings]\nfrom='pipe.toml'",
        "[sky]\nfile='pipe.hdr'",
        "[sky]\nfile='zero.exr'",
    ] {
        let error = read(&folder, text).expect_err(text);
        assert!(error.contains("it is not a regular file"), "{text}: {error}");
    }
    // A shell makes a pipe of `<(command)`, and settings and paths may come from one. A device may have no end.
    std::os::unix::fs::symlink("/dev/zero", path("zero.toml")).expect("linked");
    let endless = load_settings(&path("zero.toml")).expect_err("no end").to_string();
    assert!(endless.contains("it is not a regular file"), "{endless}");
}

/// Changes of a text: the place (as a share of its length), the number of bytes that go, and the text that comes.
fn edits() -> impl Strategy<Value = Vec<(f64, usize, &'static str)>> {
    let pieces =
        ["", "\n", "=", "\"", "'", "[", "]", "{}", ",", "#", ".", "-", "nan", "1e999", "true", "é", "\u{0}", "9"];
    prop::collection::vec((0.0..1.0f64, 0..8usize, prop::sample::select(pieces.to_vec())), 0..4)
}

fn boundary(text: &str, at: f64) -> usize {
    text.floor_char_boundary((text.len() as f64 * at) as usize)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_damaged_file_is_read_or_refused_in_one_line(cut in 0.0..1.5f64, edits in edits()) {
        let mut text = EVERYTHING.to_owned();
        for (at, length, piece) in edits {
            let start = boundary(&text, at);
            let end = text.ceil_char_boundary((start + length).min(text.len()));
            text.replace_range(start..end, piece);
        }
        text.truncate(boundary(&text, cut.min(1.0)));
        let folder = folder();
        match read(&folder, &text) {
            Ok(scene) => prop_assert!(scene.objects.iter().all(|object| object.material < scene.materials.len())),
            Err(error) => {
                prop_assert!(error.starts_with(folder.path().to_str().unwrap()), "{}", error);
                prop_assert_eq!(error.lines().count(), 1, "{:?}", error);
            }
        }
    }
}
