//! Parts of OBJ and MTL files that cannot be drawn: each is left out or mended and named once, and all others are drawn.

use std::fs;

use afterlight::scene::{
    AlphaMode, Imported, Material, OpenOptions, Scene, SkyChoice, Wrap, exposure_scale, metered_ev100, open, put_sky,
};
use image::{DynamicImage, ImageBuffer, Luma, Rgb, Rgb32FImage};

use super::obj::{TRIANGLE, folder, load, load_text, with_material, write_image};

/// A square, without faces.
const CORNERS: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n";

fn triangles(imported: &Imported) -> usize {
    imported.meshes.iter().map(|mesh| mesh.indices.len() / 3).sum()
}

/// Asserts the number of triangles, and that the only warning has these words (or that no warning is there, for "").
fn assert_reads(text: &str, count: usize, words: &str) -> Imported {
    let imported = load_text(text);
    assert_eq!(triangles(&imported), count, "{text:?}: {:?}", imported.warnings);
    match words {
        "" => assert_eq!(imported.warnings, Vec::<String>::new(), "{text:?}"),
        _ => assert!(
            imported.warnings.len() == 1 && imported.warnings[0].contains(words),
            "{text:?}: {:?}",
            imported.warnings
        ),
    }
    imported
}

#[test]
fn a_backslash_continues_numbers_and_neither_comments_nor_names() {
    for (text, count) in [
        (format!("# exported to D:\\models\\\n{CORNERS}f 1 2 3 4\n"), 2),
        (format!("{CORNERS}f 1 2 3\n# see \\\\server\\share\\\nf 1 3 4\n"), 2),
        (format!("{CORNERS}f 1 2 3 # see \\\nf 1 3 4\n"), 2),
        (format!("{CORNERS}f 1 2 3 \\\nf 1 3 4 \\"), 2),
        (format!("{CORNERS}g walls\\\nf 1 2 3 4\no C:\\\nf 1 2 3"), 3),
        (format!("{CORNERS}f 1 2 \\  \n 3 \\\n 4\\"), 2),
    ] {
        assert_reads(&text, count, "");
    }
    // Names of materials are one thing in both files, whatever bytes they are made of.
    let folder = folder(
        &format!("mtllib m.mtl\\\n{CORNERS}usemtl Solid\\\nf 1 2 3 4\n"),
        &[("m.mtl", "newmtl Solid\\\nKd 1 0 0\n")],
    );
    let imported = load(&folder).unwrap();
    assert_eq!((triangles(&imported), imported.materials[0].base_color.to_array()), (2, [1.0, 0.0, 0.0]));
    let bytes = [b"mtllib m.mtl\n", CORNERS.as_bytes(), b"usemtl \x95\x5c\nf 1 2 3 4\n"].concat();
    fs::write(folder.path().join("model.obj"), bytes).unwrap();
    fs::write(folder.path().join("m.mtl"), b"newmtl \x95\x5c\nKd 0 1 0\n").unwrap();
    assert_eq!(load(&folder).unwrap().materials[0].base_color.to_array(), [0.0, 1.0, 0.0]);
}

#[test]
fn a_normal_without_a_length_and_values_beyond_their_range_are_told() {
    let text = format!("{CORNERS}vn 0 0 1\nvn 0 -0.0 0e5\nf 1//2 2//2 3//2 4//2\n");
    let found = assert_reads(&text, 2, "line 6: a normal without a length; the normal is made from the faces");
    assert!(found.meshes[0].normals.iter().all(|normal| *normal == [0.0, 0.0, 1.0]));
    let folder = folder("", &[]);
    for (statement, keyword) in [("d 7", "d"), ("Tr -3", "Tr"), ("Pr -3", "Pr"), ("Pm 4", "Pm"), ("Kd 2 0 0", "Kd")] {
        let found = with_material(&folder, statement);
        let words = format!("m.mtl:2: material `m`: {keyword} is not from 0 to 1, taken for the nearest");
        assert!(found.warnings.len() == 1 && found.warnings[0].ends_with(&words), "{:?}", found.warnings);
        assert_eq!(found.materials[0].alpha_mode, AlphaMode::Opaque, "{statement}");
    }
}

#[test]
fn line_ends_encodings_and_letter_forms_change_nothing() {
    let text = format!("{CORNERS}vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1 4/1/1\n");
    let folder = folder("", &[]);
    let wide: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    for bytes in [
        text.replace('\n', "\r\n").into_bytes(),
        text.replace('\n', "\r").into_bytes(),
        text.replacen('\n', "\r\n", 3).replacen("\nvn", "\rvn", 1).into_bytes(),
        text.trim_end().to_owned().into_bytes(),
        format!("\u{feff}{text}").into_bytes(),
        [b"\xff\xfe".as_slice(), &wide].concat(),
        text.replace(' ', "\t \u{c}").into_bytes(),
        text.to_uppercase().into_bytes(),
        format!("{text}\u{1a}").into_bytes(),
        format!("{text}\0\0\0").into_bytes(),
        text.replace("-1 -1 0", "-1,0 -1,0 0,0").into_bytes(),
    ] {
        fs::write(folder.path().join("model.obj"), &bytes).unwrap();
        let imported = load(&folder).unwrap_or_else(|error| panic!("{error}: {:?}", String::from_utf8_lossy(&bytes)));
        let mesh = &imported.meshes[0];
        assert_eq!(
            (mesh.indices.len(), mesh.bounds.min.x, mesh.uvs.len()),
            (6, -1.0, 4),
            "{:?}",
            String::from_utf8_lossy(&bytes)
        );
        assert_eq!((mesh.normals[0], &imported.warnings), ([0.0, 0.0, 1.0], &Vec::new()));
    }
}

#[test]
fn a_face_that_cannot_be_drawn_is_left_out_and_the_others_are_drawn() {
    for (line, words) in [
        ("f 1 2 9", "line 6: index 9 is out of range: the file has 4 vertices; the face is left out"),
        ("f 1 2 -9", "index -9 is out of range"),
        ("f 0 1 2", "index 0 in `0`: OBJ counts from 1"),
        ("f 1 2 x", "`x` is not an index"),
        ("f //1 1 2", "names no vertex"),
        ("f", "a face without corners"),
        ("f 1 2", "lines (1) and points (0) are not drawn"),
        ("v 1 2\nf 1 2 5", "`v` has 2 numbers instead of 3"),
        ("v nan 0 0", "line 6: `nan` is not a finite number; the vertex has no place"),
        ("vn 0 0 nan", "the normal is made from the faces"),
        ("vt inf", "taken for 0"),
        ("curv 0 1 1 2", "`curv` is not supported; left out"),
        ("quad 1 2 3 4", "`quad` is not known; left out"),
    ] {
        let text = format!("{CORNERS}f 1 2 3 4\n{line}\nf 1 2 3\n");
        let imported = load_text(&text);
        assert_eq!(triangles(&imported), 3, "{line}");
        let told = imported.warnings.iter().filter(|warning| warning.contains(words)).count();
        assert!(told == 1 && imported.warnings.len() <= 2, "{line}: {:?}", imported.warnings);
    }
    // Each kind is named once.
    let many = format!("{CORNERS}f 1 2 3 4\n{}", "f 1 2 9\n".repeat(1000));
    assert_reads(&many, 2, "the face is left out, and 999 more such faces");
    // A vertex that comes later is no fault.
    assert_reads(&format!("f 1 2 3 4\n{CORNERS}"), 2, "");
}

#[test]
fn attributes_that_are_none_leave_the_face_where_it_is() {
    let up = [[0.0, 0.0, 1.0]; 4];
    for odd in ["nan nan nan", "-1.#IND00 0 0", "-nan(ind) 0 0", "inf 0 0", "0 0 1e400", "0 0", "0 0 0"] {
        for face in ["f 1//1 2//1 3//2 4//1", "f 1//2 2//2 3//2 4//2", "f 1//1 2//1 3//1 4//1"] {
            let imported = load_text(&format!("{CORNERS}vn 0 0 1\nvn {odd}\n{face}\n"));
            assert_eq!((triangles(&imported), &imported.meshes[0].normals[..]), (2, &up[..]), "{odd}: {face}");
            assert_eq!(imported.warnings.len(), 1, "{odd}: {:?}", imported.warnings);
        }
    }
    // Without a normal that is one, edges are found as in a file without normals: the roof's ridge is hard.
    let roof = "v 0 0 0\nv 1 0 0\nv 1 1 -1\nv 0 1 -1\nv 1 0 -2\nv 0 0 -2\nvn 0 0 0\nf 1//1 2//1 3//1 4//1\nf 4//1 3//1 5//1 6//1\n";
    let imported = load_text(roof);
    assert!(imported.meshes[0].normals.iter().all(|normal| normal[1] < 0.9) && imported.materials[0].two_sided);
    for (text, words) in [
        ("vt nan nan\nf 1/1 2/1 3/1", "`nan` is not a finite number; taken for 0"),
        ("vt 0 0\nf 1/9 2/1 3/1", "index 9 is out of range: the file has 1 texture coordinates; drawn without that"),
        ("vt 0 0\nf 1/0 2/0 3/0", "OBJ counts from 1; drawn without that"),
        ("vt 0 0\nf 1/1/1/1 2/1 3/1", "`1/1/1/1` has more than three indices"),
        ("vt 0 0\nf 1/1 2 3/1", "texture coordinates at some corners of a face only"),
    ] {
        let imported = load_text(&format!("{CORNERS}{text}\n"));
        assert_eq!(triangles(&imported), 1, "{text}");
        assert!(imported.warnings.iter().any(|warning| warning.contains(words)), "{text}: {:?}", imported.warnings);
        assert!(imported.meshes[0].uvs.iter().flatten().all(|uv| uv.is_finite()), "{text}");
    }
}

#[test]
fn colours_of_vertices_are_drawn_as_srgb() {
    let square = |colors: [&str; 4]| {
        let lines = CORNERS.lines().zip(colors).map(|(line, color)| format!("{line} {color}\n"));
        lines.collect::<String>() + "f 1 2 3 4\n"
    };
    // 188 of 255 is half of the light.
    for colors in [["1 0 0", "0 1 0", "0 0 1", "0.7372549 1 1"], ["255 0 0", "0 255 0", "0 0 255", "188 255 255"]] {
        let imported = assert_reads(&square(colors), 2, "");
        let colors = &imported.meshes[0].colors;
        assert_eq!(colors[..3], [[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]]);
        assert!((colors[3][0] - 0.5029).abs() < 1e-3, "{colors:?}");
        assert_eq!(imported.materials[0].base_color.to_array(), [1.0; 3], "a surface without a colour of its own");
    }
    let weighted = assert_reads("v -1 -1 0 1 1 0 0\nv 1 -1 0 1 1 0 0\nv 1 1 0 1 1 0 0\nf 1 2 3\n", 1, "");
    assert_eq!(weighted.meshes[0].colors, [[1.0, 0.0, 0.0, 1.0]; 3]);
    // Each vertex keeps its own, also where the first has none and faces come in another order.
    let some = assert_reads(
        &square(["", "", "1 0 0", "0 0 0.5"]).replace("f 1 2 3 4", "f 4 3 2"),
        1,
        "(2) are missing beside others",
    );
    assert_eq!(some.meshes[0].colors[1..], [[1.0, 0.0, 0.0, 1.0], [1.0; 4]]);
    let painted = assert_reads(&format!("{CORNERS}#MRGB ff0000ffff00ff00ffff0000ffffffff\nf 1 2 3 4\n"), 2, "");
    assert_eq!(painted.meshes[0].colors[0], [0.0, 0.0, 1.0, 1.0]);
    assert!(
        load_text(&format!("{CORNERS}f 1 2 3 4\n").replace(" 0\n", " 0 1\n")).meshes[0].colors.is_empty(),
        "weights"
    );
    // A factor counts, a texture stands in their place.
    let folder = folder("", &[("m.mtl", "newmtl m\nKd 0.5 0.5 0.5\n")]);
    write_image(&folder, "c.png", 1, |_, _| [255; 4]);
    let colored = format!("mtllib m.mtl\nusemtl m\n{}", square(["1 0 0"; 4]));
    fs::write(folder.path().join("model.obj"), colored).unwrap();
    let imported = load(&folder).unwrap();
    assert_eq!((imported.meshes[0].colors.len(), imported.materials[0].base_color.to_array()), (4, [0.5; 3]));
    fs::write(folder.path().join("m.mtl"), "newmtl m\nmap_Kd c.png\n").unwrap();
    let imported = load(&folder).unwrap();
    assert!(imported.meshes[0].colors.is_empty());
    assert!(
        imported.warnings[0].contains("vertex colours (4) are not used beside textures"),
        "{:?}",
        imported.warnings
    );
}

#[test]
fn a_texture_that_cannot_be_read_is_left_out_with_all_that_it_would_change() {
    let folder = folder("", &[("page.png", "<!DOCTYPE html><html></html>"), ("empty.png", "")]);
    write_image(&folder, "c.png", 8, |x, y| [x as u8 * 30, y as u8 * 30, 200, 255]);
    let png = fs::read(folder.path().join("c.png")).unwrap();
    fs::write(folder.path().join("cut.png"), &png[..png.len() / 2]).unwrap();
    fs::create_dir(folder.path().join("folder")).unwrap();
    let factors = "Kd 0.25 0.5 1\nNs 30\nKs 0 0.5 0\nKe 0 0 0\n";
    let plain = with_material(&folder, factors).materials.remove(0);
    for (name, words) in [
        ("page.png", "page.png: is not an image"),
        ("empty.png", "empty.png: is not an image"),
        ("cut.png", "cut.png: cannot be decoded"),
        ("folder", "texture `folder` is a folder"),
        (".", "texture `.` is a folder"),
        ("none.png", "texture `none.png` is missing"),
    ] {
        let imported = with_material(
            &folder,
            &format!(
                "{factors}map_Kd {name}\nmap_d {name}\nmap_Ks {name}\nmap_Ke {name}\nbump {name}\nmap_Ns {name}\nmap_Pm {name}"
            ),
        );
        assert_eq!((triangles(&imported), imported.textures.len()), (1, 0), "{name}");
        let as_plain = Material { normal_scale: plain.normal_scale, ..imported.materials[0].clone() };
        assert_eq!(format!("{as_plain:?}"), format!("{plain:?}"), "{name}");
        assert_eq!(
            imported.warnings.iter().filter(|warning| warning.contains(words)).count(),
            if name.contains("png") && name != "none.png" { 1 } else { 7 },
            "{name}: {:?}",
            imported.warnings
        );
    }
    // The other image of a pair stays.
    let imported =
        with_material(&folder, "Kd 0.25 0.5 1\nmap_Kd page.png\nmap_d c.png\nPr 0.3\nmap_Pr page.png\nmap_Pm c.png");
    let material = &imported.materials[0];
    assert_eq!((material.base_color.to_array(), material.roughness, material.metallic), ([0.25, 0.5, 1.0], 0.3, 1.0));
    assert_eq!(imported.textures.len(), 2);
    // Black beside a map is an exporter's habit, also where the map is lost.
    assert_ne!(with_material(&folder, "Kd 0 0 0\nmap_Kd page.png").materials[0].base_color.to_array(), [0.0; 3]);
}

#[test]
fn a_library_that_cannot_be_read_leaves_the_surface_plain() {
    let folder = folder(&format!("mtllib m.mtl\n{TRIANGLE}"), &[]);
    let warnings = |imported: &Imported| imported.warnings.join("\n");
    fs::write(folder.path().join("m.mtl"), b"\x89PNG\0\0\0\rIHDR").unwrap();
    let told = warnings(&load(&folder).unwrap());
    assert!(told.contains("m.mtl: is no text file") && told.contains("drawn without its materials"), "{told}");
    fs::remove_file(folder.path().join("m.mtl")).unwrap();
    fs::create_dir(folder.path().join("m.mtl")).unwrap();
    assert!(warnings(&load(&folder).unwrap()).contains("material library `m.mtl` is missing"));
    // One that has the model's name stands in.
    fs::write(folder.path().join("model.mtl"), "newmtl M\nKd 1 0 0\nnewmtl m2\nnewmtl M\nKd 0 1 0\n").unwrap();
    let imported = load(&folder).unwrap();
    assert_eq!(imported.materials[0].base_color.to_array(), [0.0, 1.0, 0.0]);
    let told = warnings(&imported);
    assert!(
        told.contains("model.mtl") && told.contains("material `M` is defined again; its last definition is used"),
        "{told}"
    );
}

#[test]
fn opacity_of_a_map_is_a_mask_glass_or_nothing() {
    let folder = folder("", &[]);
    let modes = |statements: &str, alpha: &dyn Fn(u32, u32) -> u8| {
        write_image(&folder, "c.png", 8, |x, y| [90, 90, 90, alpha(x, y)]);
        let imported = with_material(&folder, statements);
        (imported.materials[0].alpha_mode, imported.textures[0].rgba8(0)[3], imported.warnings)
    };
    let mask = AlphaMode::Mask { cutoff: 0.5 };
    assert_eq!(modes("map_Kd c.png", &|_, _| 255), (AlphaMode::Opaque, 255, vec![]));
    assert_eq!(modes("map_Kd c.png", &|x, _| if x < 4 { 0 } else { 255 }), (mask, 0, vec![]));
    assert_eq!(modes("map_Kd c.png", &|_, _| 100), (AlphaMode::Blend, 100, vec![]));
    assert_eq!(modes("map_Kd c.png", &|_, _| 200), (AlphaMode::Blend, 200, vec![]));
    let (mode, alpha, warnings) = modes("map_Kd c.png", &|_, _| 0);
    assert_eq!((mode, alpha, warnings.len()), (AlphaMode::Opaque, 255, 1));
    assert!(warnings[0].contains("c.png: its opacity is 0 everywhere"), "{warnings:?}");
}

#[test]
fn heights_of_16_bits_make_a_gentle_slope_and_no_terraces() {
    let folder = folder("", &[]);
    // 4 codes of 8 bits over 256 texels: each step is 64 texels wide.
    let ramp = ImageBuffer::from_fn(256, 4, |x, _| Luma([(x * 4) as u16]));
    DynamicImage::ImageLuma16(ramp).save(folder.path().join("h.png")).unwrap();
    let imported = with_material(&folder, "bump -bm 100 h.png");
    let normals = imported.textures[0].rgba8(0);
    let leans: Vec<u8> = normals.chunks(4).take(250).skip(4).map(|texel| texel[0]).collect();
    assert!(leans.iter().all(|lean| lean.abs_diff(leans[0]) <= 1) && leans[0] < 127, "{leans:?}");
}

#[test]
fn options_behind_a_name_count_and_a_clamped_map_is_there_once() {
    let folder = folder("", &[]);
    write_image(&folder, "wall-1.png", 1, |_, _| [255; 4]);
    let imported = with_material(&folder, "map_Kd wall-1.png -s 2 3 -clamp on # the wall");
    assert_eq!(imported.warnings, Vec::<String>::new());
    assert_eq!(imported.textures[0].sampler.wrap, [Wrap::Clamp; 2]);
    assert_eq!(imported.meshes[0].uvs, [[0.0, 1.0], [2.0, 1.0], [0.0, -2.0]]);
    // Coordinates far from a clamped map mean its edge, and not another repeat.
    let far = with_material(&folder, "map_Kd -o 100 0 -clamp on wall-1.png");
    assert_eq!(far.meshes[0].uvs[0], [100.0, 1.0]);
    assert_eq!(with_material(&folder, "map_Kd -clamp off wall-1.png").textures[0].sampler.wrap, [Wrap::Repeat; 2]);
}

#[test]
fn emission_of_a_bare_model_is_a_share_of_white() {
    let folder = folder(&format!("mtllib m.mtl\n{TRIANGLE}"), &[("m.mtl", "newmtl m\nKd 0 0 0\nKe 1 0.5 0\n")]);
    let path = folder.path().join("model.obj");
    let mut scene = open(path.to_str().unwrap(), &OpenOptions::default()).unwrap();
    let shown = |scene: &Scene| {
        let ev100 = scene.settings.exposure.unwrap_or_else(|| metered_ev100(scene));
        (scene.materials[0].emissive * exposure_scale(ev100)).to_array()
    };
    let assert_orange = |scene: &Scene| {
        let error =
            shown(scene).iter().zip([1.0, 0.5, 0.0]).map(|(own, share)| (own - share).abs()).fold(0.0, f32::max);
        assert!(error < 1e-4, "{:?}", shown(scene));
    };
    assert_orange(&scene);
    // A sky in place of the sun is metered otherwise, and emission follows.
    let picture: Rgb32FImage = ImageBuffer::from_pixel(8, 4, Rgb([1.0; 3]));
    picture.save(folder.path().join("sky.hdr")).unwrap();
    put_sky(&mut scene, &SkyChoice::Picture(folder.path().join("sky.hdr"))).unwrap();
    assert_orange(&scene);
    // A scene file's emission is in nits.
    let placed = folder.path().join("scene.toml");
    fs::write(&placed, "[[models]]\npath = \"model.obj\"\n").unwrap();
    let scene = open(placed.to_str().unwrap(), &OpenOptions::default()).unwrap();
    assert_eq!(scene.materials[0].emissive.to_array(), [1.0, 0.5, 0.0]);
}
