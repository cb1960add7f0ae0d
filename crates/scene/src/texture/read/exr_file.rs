//! Colour out of OpenEXR files, whatever program wrote them: names of channels, layers, windows, kinds of numbers and primaries.

use std::io::Cursor;

use exr::meta::MetaData;
use exr::meta::attribute::{ChannelList, Chromaticities, Text};
use exr::meta::header::Header;
use exr::prelude::{ReadChannels, ReadLayers, ReadSpecificChannel, Vec2, read};
use glam::{DMat3, DVec2, DVec3};
use image::{Rgba, Rgba32FImage};

use super::exr_rates;

/// Words in a layer's name that say it is the picture, and no pass of it.
const BEAUTY: [&str; 4] = ["combined", "beauty", "rgba", "composite"];

/// The primaries of tristimulus values.
const XYZ: Chromaticities = Chromaticities {
    red: Vec2(1.0, 0.0),
    green: Vec2(0.0, 1.0),
    blue: Vec2(0.0, 0.0),
    white: Vec2(1.0 / 3.0, 1.0 / 3.0),
};

/// The primaries of a file that does not say which.
const REC709: Chromaticities =
    Chromaticities { red: Vec2(0.64, 0.33), green: Vec2(0.3, 0.6), blue: Vec2(0.15, 0.06), white: Vec2(0.3127, 0.329) };

/// An optional channel that no file has.
const NO_CHANNEL: &str = "no such channel";

/// The channels that make the picture.
#[derive(Debug, PartialEq)]
enum Channels {
    /// Red, then green, blue and alpha, of which a file may lack some.
    Color([Option<Text>; 4]),
    /// Tristimulus values, and alpha.
    Xyz([Option<Text>; 4]),
    /// Luminance Y, chroma (R - Y) / Y and (B - Y) / Y, and alpha.
    Chroma([Option<Text>; 4]),
    /// Luminance, or a channel alone, and alpha.
    Grey(Text, Option<Text>),
}

/// A rectangle of texels.
#[derive(Clone, Copy)]
struct TexelRect {
    left: i64,
    top: i64,
    size: [u32; 2],
}

impl TexelRect {
    fn new(position: Vec2<i32>, size: Vec2<usize>) -> Self {
        let edge = |edge: usize| u32::try_from(edge).unwrap_or(u32::MAX);
        Self { left: position.0.into(), top: position.1.into(), size: [edge(size.0), edge(size.1)] }
    }
}

/// Reads a file's picture in linear Rec. 709. It has the size of the display window, or of the data window where `fault` finds fault with the
/// first alone; texels without data are 0.
///
/// # Errors
/// The fault of its size, or why it cannot be read.
pub(super) fn read_exr(bytes: &[u8], fault: &dyn Fn([u32; 2]) -> Option<String>) -> Result<Rgba32FImage, String> {
    let (bytes, rates) = exr_rates::whole(bytes);
    let meta = MetaData::read_from_buffered(&*bytes, false).map_err(|error| error.to_string())?;
    if !rates.is_empty() && meta.headers.len() > 1 {
        return Err("it has several parts, and channels of fewer samples than pixels, which is not read".into());
    }
    let (header, channels) = choose(&meta.headers)?;
    let display = header.shared_attributes.display_window;
    let data = TexelRect::new(header.own_attributes.layer_position, header.layer_size);
    let windows = [TexelRect::new(display.position, display.size), data];
    let fits = |window: &&TexelRect| fault(window.size).is_none();
    let window = match windows.iter().find(fits) {
        Some(&window) => window,
        None => return Err(fault(windows[0].size).unwrap_or_default()),
    };
    let own = header.shared_attributes.chromaticities;
    let to_rec709 = match channels {
        Channels::Color(_) | Channels::Chroma(_) => own.and_then(to_rec709),
        Channels::Xyz(_) => to_rec709(XYZ),
        Channels::Grey(..) => None,
    };
    let weights = matches!(channels, Channels::Chroma(_)).then(|| luminance_of(own.unwrap_or(REC709)));
    let texels = match rates.is_empty() {
        true => pixels(&bytes, channels, (data, window))?,
        // Planes of sampled channels have the size of the data window.
        false => match fault(data.size) {
            Some(why) => return Err(why),
            None => sampled_pixels(&bytes, (header, &channels), &rates, (data, window))?,
        },
    };
    let mut image = Rgba32FImage::from_raw(window.size[0], window.size[1], texels.into_flattened())
        .ok_or("its windows do not agree")?;
    if let Some(weights) = weights {
        for Rgba([red, green, blue, _]) in image.pixels_mut() {
            let [y, along, up] = [*red, *green, *blue].map(f64::from);
            let (own_red, own_blue) = ((along + 1.0) * y, (up + 1.0) * y);
            let own_green = (y - weights.x * own_red - weights.z * own_blue) / weights.y;
            [*red, *green, *blue] = [own_red, own_green, own_blue].map(|value| value as f32);
        }
    }
    if let Some(to_rec709) = to_rec709 {
        for Rgba([red, green, blue, _]) in image.pixels_mut() {
            let own = DVec3::new((*red).into(), (*green).into(), (*blue).into());
            [*red, *green, *blue] = (to_rec709 * own).as_vec3().to_array();
        }
    }
    Ok(image)
}

/// Returns where a texel of the data window is in the other one, if it is.
fn place((data, window): (TexelRect, TexelRect), Vec2(x, y): Vec2<usize>) -> Option<usize> {
    let [width, height] = window.size.map(|edge| edge as usize);
    let at = |at: usize, offset: i64, end: usize| usize::try_from(at as i64 + offset).ok().filter(|&place| place < end);
    Some(at(y, data.top - window.top, height)? * width + at(x, data.left - window.left, width)?)
}

/// Decodes channels of which some have fewer samples than texels.
fn sampled_pixels(
    bytes: &[u8],
    (header, channels): (&Header, &Channels),
    rates: &exr_rates::Rates,
    windows: (TexelRect, TexelRect),
) -> Result<Vec<[f32; 4]>, String> {
    let planes = exr_rates::planes(bytes, header, rates)?;
    let plane = |name: Option<&Text>| {
        let at = header.channels.list.iter().position(|channel| Some(&channel.name) == name)?;
        planes.get(at)
    };
    let names = match channels {
        Channels::Color(names) | Channels::Xyz(names) | Channels::Chroma(names) => names.each_ref().map(Option::as_ref),
        Channels::Grey(grey, alpha) => [Some(grey), Some(grey), Some(grey), alpha.as_ref()],
    };
    let planes = names.map(plane);
    let Vec2(width, height) = header.layer_size;
    let [columns, rows] = windows.1.size.map(|edge| edge as usize);
    let mut texels = vec![[0.0; 4]; columns * rows];
    for at in (0..height).flat_map(|y| (0..width).map(move |x| Vec2(x, y))) {
        if let Some(place) = place(windows, at) {
            let value = |slot: usize, missing: f32| planes[slot].map_or(missing, |plane| plane.at(at.0, at.1));
            texels[place] = [value(0, 0.0), value(1, 0.0), value(2, 0.0), value(3, 1.0)];
        }
    }
    Ok(texels)
}

/// Decodes the channels of the data window into the other one.
fn pixels(bytes: &[u8], channels: Channels, (data, window): (TexelRect, TexelRect)) -> Result<Vec<[f32; 4]>, String> {
    let [width, height] = window.size.map(|edge| edge as usize);
    let put = move |texels: &mut Vec<[f32; 4]>, at: Vec2<usize>, texel: [f32; 4]| {
        if let Some(place) = place((data, window), at) {
            texels[place] = texel;
        }
    };
    let or_none = |name: Option<Text>, index: usize| {
        name.unwrap_or_else(|| Text::new_or_panic(format!("{NO_CHANNEL} {index}").as_str()))
    };
    let reader = read().no_deep_data().largest_resolution_level().specific_channels();
    let empty = move || vec![[0.0; 4]; width * height];
    let read = match channels {
        Channels::Color([red, green, blue, alpha])
        | Channels::Xyz([red, green, blue, alpha])
        | Channels::Chroma([red, green, blue, alpha]) => reader
            .required(or_none(red, 0))
            .optional(or_none(green, 1), 0.0_f32)
            .optional(or_none(blue, 2), 0.0_f32)
            .optional(or_none(alpha, 3), 1.0_f32)
            .collect_pixels(
                move |_, _| empty(),
                move |texels, at, (red, green, blue, alpha): (f32, f32, f32, f32)| {
                    put(texels, at, [red, green, blue, alpha])
                },
            )
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(bytes))
            .map(|image| image.layer_data.channel_data.pixels),
        Channels::Grey(grey, alpha) => reader
            .required(grey)
            .optional(or_none(alpha, 3), 1.0_f32)
            .collect_pixels(
                move |_, _| empty(),
                move |texels, at, (grey, alpha): (f32, f32)| put(texels, at, [grey, grey, grey, alpha]),
            )
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(bytes))
            .map(|image| image.layer_data.channel_data.pixels),
    };
    read.map_err(|error| error.to_string())
}

/// Finds the part and the channels of the picture. Layers named as the picture come first, then channels without a layer, then the first
/// other layer; colour comes before luminance.
fn choose(headers: &[Header]) -> Result<(&Header, Channels), String> {
    let flat = || headers.iter().filter(|header| !header.deep);
    let mut best: Option<(usize, &Header, Channels)> = None;
    for header in flat() {
        for (layer, channels) in layers(&header.channels) {
            let part = header.own_attributes.layer_name.as_ref().map(Text::to_string).unwrap_or_default();
            let name = format!("{part}.{layer}").to_lowercase();
            let is_grey = matches!(channels, Channels::Grey(..));
            let rank = match () {
                () if BEAUTY.iter().any(|word| name.contains(word)) => 0,
                () if layer.is_empty() => 1,
                () => 2,
            };
            let rank = rank + if is_grey { 3 } else { 0 };
            if best.as_ref().is_none_or(|(other, ..)| rank < *other) {
                best = Some((rank, header, channels));
            }
        }
    }
    if let Some((_, header, channels)) = best {
        return Ok((header, channels));
    }
    let names = flat().flat_map(|header| header.channels.list.iter().map(|channel| channel.name.to_string()));
    Err(format!("it has no channels of colour or luminance (it has {})", names.collect::<Vec<_>>().join(", ")))
}

/// The layers of a part that have colour or luminance, with their names, which stand before the last point of a channel's. A part of one channel
/// is grey.
fn layers(list: &ChannelList) -> Vec<(String, Channels)> {
    let mut found: Vec<(String, [Option<Text>; 9])> = Vec::new();
    for channel in &list.list {
        let name = channel.name.to_string();
        let (layer, own) = name.rsplit_once('.').unwrap_or(("", &name));
        let slot = match own.to_lowercase().as_str() {
            "r" | "red" => 0,
            "g" | "green" => 1,
            "b" | "blue" => 2,
            "a" | "alpha" => 3,
            "y" | "l" | "luminance" => 4,
            // Within a layer they are rather a direction, and Z alone is a depth.
            "x" if layer.is_empty() => 5,
            "z" if layer.is_empty() => 6,
            "ry" => 7,
            "by" => 8,
            _ => continue,
        };
        let at = found.iter().position(|(other, _)| other == layer).unwrap_or_else(|| {
            found.push((layer.to_owned(), Default::default()));
            found.len() - 1
        });
        found[at].1[slot].get_or_insert_with(|| channel.name.clone());
    }
    if let [only] = list.list.as_slice() {
        return vec![(String::new(), Channels::Grey(only.name.clone(), None))];
    }
    let channels = |[red, green, blue, alpha, grey, x, z, to_red, to_blue]: [Option<Text>; 9]| match (red, grey) {
        (Some(red), _) if green.is_some() || blue.is_some() => Some(Channels::Color([Some(red), green, blue, alpha])),
        (None, Some(y)) if x.is_some() && z.is_some() => Some(Channels::Xyz([x, Some(y), z, alpha])),
        (None, Some(y)) if to_red.is_some() && to_blue.is_some() => {
            Some(Channels::Chroma([Some(y), to_red, to_blue, alpha]))
        }
        (_, Some(grey)) | (Some(grey), None) => Some(Channels::Grey(grey, alpha)),
        (None, None) => None,
    };
    found.into_iter().filter_map(|(layer, own)| Some((layer, channels(own)?))).collect()
}

/// The matrix from a file's primaries to Rec. 709, with its white adapted to D65 (Bradford); `None` for Rec. 709 itself. With X, Y and Z as
/// primaries the texels are tristimulus values, which need no adaptation.
fn to_rec709(own: Chromaticities) -> Option<DMat3> {
    let place = |Vec2(x, y): Vec2<f32>| DVec2::new(x.into(), y.into());
    let own = [own.red, own.green, own.blue, own.white].map(place);
    let rec709 = [[0.64, 0.33], [0.3, 0.6], [0.15, 0.06], [0.3127, 0.329]].map(DVec2::from);
    if own.iter().zip(rec709).all(|(own, other)| own.distance(other) < 1e-3) {
        return None;
    }
    let white = |place: DVec2| lift(place) / place.y;
    let is_xyz = own[0].distance(DVec2::X) + own[1].distance(DVec2::Y) + own[2].length() < 1e-3;
    let cones = DMat3::from_cols_array(&[0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296]);
    let adapted = match is_xyz {
        true => DMat3::IDENTITY,
        false => {
            let gain = (cones * white(rec709[3])) / (cones * white(own[3]));
            cones.inverse() * DMat3::from_diagonal(gain) * cones
        }
    };
    let all = to_xyz(rec709).inverse() * adapted * to_xyz(own);
    // Primaries on a line, or a white without luminance.
    all.is_finite().then_some(all)
}

fn lift(place: DVec2) -> DVec3 {
    DVec3::new(place.x, place.y, 1.0 - place.x - place.y)
}

/// The matrix from primaries and a white to tristimulus values.
fn to_xyz([red, green, blue, white]: [DVec2; 4]) -> DMat3 {
    let primaries = DMat3::from_cols(lift(red), lift(green), lift(blue));
    primaries * DMat3::from_diagonal(primaries.inverse() * (lift(white) / white.y))
}

/// The share of each primary in the luminance of white.
fn luminance_of(own: Chromaticities) -> DVec3 {
    let place = |Vec2(x, y): Vec2<f32>| DVec2::new(x.into(), y.into());
    let weights = to_xyz([own.red, own.green, own.blue, own.white].map(place)).row(1);
    if weights.is_finite() && weights.y > 0.0 { weights } else { luminance_of(REC709) }
}

#[cfg(test)]
mod tests {
    use exr::prelude::*;

    use super::*;

    /// A file of parts that have channels of these names; a channel's texels all have its number.
    fn file(parts: &[&[(&str, f32)]], compression: Compression, change: impl FnOnce(&mut ImageAttributes)) -> Vec<u8> {
        let size = Vec2(4, 2);
        let layer = |(index, channels): (usize, &&[(&str, f32)])| {
            let channel =
                |(name, value): &(&str, f32)| AnyChannel::new(*name, FlatSamples::F32(vec![*value; size.area()]));
            let mut attributes = LayerAttributes::named(format!("part{index}").as_str());
            attributes.layer_position = Vec2(1, 0);
            let encoding = Encoding { compression, ..Encoding::UNCOMPRESSED };
            Layer::new(size, attributes, encoding, AnyChannels::sort(channels.iter().map(channel).collect()))
        };
        let mut attributes = ImageAttributes::new(IntegerBounds::new((0, 0), (6, 3)));
        change(&mut attributes);
        let layers: SmallVec<[_; 2]> = parts.iter().enumerate().map(layer).collect();
        let mut bytes = Cursor::new(Vec::new());
        Image::from_layers(attributes, layers).write().to_buffered(&mut bytes).expect("written");
        bytes.into_inner()
    }

    fn texel(bytes: &[u8]) -> [f32; 4] {
        let image = read_exr(bytes, &|_| None).expect("read");
        assert_eq!(image.dimensions(), (6, 3));
        // The data window begins at the second column and ends before the last row and column.
        for (x, y) in [(0, 0), (5, 0), (2, 2)] {
            assert_eq!(image.get_pixel(x, y).0, [0.0; 4]);
        }
        image.get_pixel(4, 1).0
    }

    #[test]
    fn the_picture_is_found_among_channels_and_layers() {
        for (parts, expected) in [
            (&[&[("B", 3.0), ("G", 2.0), ("R", 1.0)][..]][..], [1.0, 2.0, 3.0, 1.0]),
            (&[&[("a", 0.5), ("b", 3.0), ("g", 2.0), ("r", 1.0)]], [1.0, 2.0, 3.0, 0.5]),
            (&[&[("blue", 3.0), ("green", 2.0), ("red", 1.0)]], [1.0, 2.0, 3.0, 1.0]),
            (&[&[("Y", 7.0)]], [7.0, 7.0, 7.0, 1.0]),
            (&[&[("A", 0.5), ("Y", 7.0)]], [7.0, 7.0, 7.0, 0.5]),
            (&[&[("A", 0.5), ("Y", 7.0), ("Z", 9.0)]], [7.0, 7.0, 7.0, 0.5]),
            // (R - Y) / Y = 1 and (B - Y) / Y = -1, so that green is (Y - 0.2126 2 Y) / 0.7152.
            (&[&[("BY", -1.0), ("RY", 1.0), ("Y", 0.7152)]], [1.4304, 0.57475, 0.0, 1.0]),
            (&[&[("density", 7.0)]], [7.0, 7.0, 7.0, 1.0]),
            (&[&[("G", 2.0), ("R", 1.0)]], [1.0, 2.0, 0.0, 1.0]),
            (&[&[("beauty.B", 3.0), ("beauty.G", 2.0), ("beauty.R", 1.0), ("Z", 9.0)]], [1.0, 2.0, 3.0, 1.0]),
            (
                &[&[
                    ("L.Albedo.B", 9.0),
                    ("L.Albedo.G", 9.0),
                    ("L.Albedo.R", 9.0),
                    ("L.Combined.B", 3.0),
                    ("L.Combined.G", 2.0),
                    ("L.Combined.R", 1.0),
                ]],
                [1.0, 2.0, 3.0, 1.0],
            ),
            (&[&[("Z", 9.0)], &[("B", 3.0), ("G", 2.0), ("R", 1.0)]], [1.0, 2.0, 3.0, 1.0]),
        ] {
            let found = texel(&file(parts, Compression::Uncompressed, |_| {}));
            let error = found.iter().zip(expected).map(|(own, other)| (own - other).abs()).fold(0.0, f32::max);
            assert!(error < 1e-4, "{parts:?}: {found:?} instead of {expected:?}");
        }
        let bytes = file(&[&[("U", 1.0), ("V", 1.0)]], Compression::Uncompressed, |_| {});
        let error = read_exr(&bytes, &|_| None).expect_err("no colour");
        assert!(error.contains("(it has U, V)"), "{error}");
    }

    #[test]
    fn chroma_of_fewer_samples_is_spread_over_the_picture() {
        let size = [8, 36];
        let luminance = |x: usize, y: usize| 0.25 + x as f32 / 16.0 + y as f32 / 64.0;
        let to_red = |x: usize, _: usize| x as f32 / 8.0;
        let to_blue = |_: usize, y: usize| y as f32 / -64.0;
        for compression in [
            (0, Compression::Uncompressed),
            (1, Compression::RLE),
            (2, Compression::ZIP1),
            (3, Compression::ZIP16),
            (4, Compression::PIZ),
        ] {
            let channels: [exr_rates::tests::ExrChannel; 3] =
                [("BY", 2, &to_blue), ("RY", 2, &to_red), ("Y", 1, &luminance)];
            let bytes = exr_rates::tests::sampled(size, &channels, compression);
            let image = read_exr(&bytes, &|_| None).unwrap_or_else(|why| panic!("{compression:?}: {why}"));
            assert_eq!(image.dimensions(), (8, 36));
            // Chroma is linear between samples, and constant behind the last one.
            for (x, y) in [(0, 0), (4, 2), (3, 3), (6, 34), (5, 20)] {
                let Rgba([red, _, blue, alpha]) = *image.get_pixel(x as u32, y as u32);
                let own = luminance(x, y);
                let error = (red - (to_red(x, y) + 1.0) * own).abs().max((blue - (to_blue(x, y) + 1.0) * own).abs());
                assert!(error < 2e-3 && alpha == 1.0, "{compression:?} {x} {y}: {red} {blue}");
            }
            let Rgba([red, green, blue, _]) = *image.get_pixel(4, 2);
            assert!((0.2126 * red + 0.7152 * green + 0.0722 * blue - luminance(4, 2)).abs() < 2e-3);
        }
    }

    #[test]
    fn every_compression_is_read() {
        use Compression::*;
        for compression in [RLE, ZIP1, ZIP16, PIZ, PXR24, B44, B44A, DWAA(None), DWAB(None)] {
            let [red, green, blue, alpha] = texel(&file(&[&[("B", 4.0), ("G", 2.0), ("R", 1.0)]], compression, |_| {}));
            let error = (red - 1.0).abs().max((green - 2.0).abs()).max((blue - 4.0).abs());
            assert!(error < 0.02 && alpha == 1.0, "{compression:?}: {red} {green} {blue}");
        }
    }

    #[test]
    fn colours_of_other_primaries_become_those_of_rec_709() {
        let change = |[red, green, blue, white]: [[f32; 2]; 4], rgb: [f32; 3]| {
            let place = |[x, y]: [f32; 2]| Vec2(x, y);
            let own = Chromaticities { red: place(red), green: place(green), blue: place(blue), white: place(white) };
            let channels = [("B", rgb[2]), ("G", rgb[1]), ("R", rgb[0])];
            texel(&file(&[&channels], Compression::Uncompressed, |image| image.chromaticities = Some(own)))
        };
        let near = |found: [f32; 4], expected: [f32; 3]| {
            let error = found.iter().zip(expected).map(|(own, other)| (own - other).abs()).fold(0.0, f32::max);
            assert!(error < 2e-3, "{found:?} instead of {expected:?}");
        };
        // White stays white whatever the primaries are: ACES 2065-1, and Rec. 2020.
        let aces = [[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077], [0.32168, 0.33767]];
        let rec2020 = [[0.708, 0.292], [0.17, 0.797], [0.131, 0.046], [0.3127, 0.329]];
        near(change(aces, [2.0; 3]), [2.0; 3]);
        near(change(rec2020, [0.5; 3]), [0.5; 3]);
        // Rec. ITU-R BT.2407-0, table 3: red of Rec. 2020.
        near(change(rec2020, [1.0, 0.0, 0.0]), [1.6605, -0.1246, -0.0182]);
        // Tristimulus values: D65 is white.
        near(change([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [1.0 / 3.0; 2]], [0.9505, 1.0, 1.0888]), [1.0; 3]);
        let [red, green, blue, _] =
            texel(&file(&[&[("X", 0.9505), ("Y", 1.0), ("Z", 1.0888)]], Compression::Uncompressed, |image| {
                image.chromaticities = Some(XYZ)
            }));
        near([red, green, blue, 1.0], [1.0; 3]);
        near(change([[0.64, 0.33], [0.3, 0.6], [0.15, 0.06], [0.3127, 0.329]], [0.1, 0.2, 0.3]), [0.1, 0.2, 0.3]);
        near(change([[0.5, 0.5]; 4], [0.1, 0.2, 0.3]), [0.1, 0.2, 0.3]);
    }

    #[test]
    fn the_data_window_stands_in_where_the_display_window_does_not_fit() {
        let bytes = file(&[&[("B", 3.0), ("G", 2.0), ("R", 1.0)]], Compression::Uncompressed, |_| {});
        let image = read_exr(&bytes, &|size| (size == [6, 3]).then(|| "no panorama".into())).expect("read");
        assert_eq!((image.dimensions(), image.get_pixel(0, 0).0), ((4, 2), [1.0, 2.0, 3.0, 1.0]));
        assert_eq!(read_exr(&bytes, &|size| Some(format!("{size:?}"))).expect_err("a fault"), "[6, 3]");
    }
}
