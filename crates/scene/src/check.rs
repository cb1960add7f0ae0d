//! Checks that a scene can be drawn: indices are in range, arrays have matching lengths, and values lie in their documented ranges. Readers of files
//! check their input themselves; a scene that code puts together has no other gate before the device.

use std::ops::RangeInclusive;

use glam::{DAffine3, DVec2, DVec3, Vec3};

use super::camera::{FOV_Y_DEGREES, HEIGHT};
use super::texture::MAX_TEXTURE_EDGE;
use super::{
    AlphaMode, Camera, Environment, Error, Falloff, Light, Material, Mesh, Object, Projection, Scene, Texels, Texture,
    TextureSlot, UvMap, level_size, most_levels,
};

/// Vertices of all meshes together: a draw adds a signed offset of 32 bits to its indices.
const MOST_VERTICES: usize = i32::MAX as usize;
/// The steepest slope of a camera's shift. A projection in f32 holds it, and the widest lens with the nearest focus does not reach it.
const MOST_SHIFT: f64 = 1e9;
/// Indices of all meshes together, which a draw counts in 32 bits.
const MOST_INDICES: usize = u32::MAX as usize;

impl Scene {
    /// Checks every index, array length and value of the scene. Renderer and reference call this first.
    ///
    /// # Errors
    /// [`Error::Scene`] with the first fault, as "mesh 2 (`floor`): index 7 is 9, but there are only 4 positions".
    pub fn check(&self) -> Result<(), Error> {
        self.fault().map_or(Ok(()), |fault| {
            Err(Error::Scene(if self.name.is_empty() { fault } else { format!("{}: {fault}", self.name) }))
        })
    }

    fn fault(&self) -> Option<String> {
        first_of("mesh", &self.meshes, |mesh| (&mesh.name, mesh.fault()))
            .or_else(|| too_many("vertices", MOST_VERTICES, self.meshes.iter().map(|mesh| mesh.positions.len())))
            .or_else(|| too_many("indices", MOST_INDICES, self.meshes.iter().map(|mesh| mesh.indices.len())))
            .or_else(|| first_of("object", &self.objects, |object| (&object.name, object.fault(self))))
            .or_else(|| first_of("material", &self.materials, |own| (&own.name, own.fault(self))))
            .or_else(|| first_of("texture", &self.textures, |texture| (&texture.name, texture.fault())))
            .or_else(|| first_of("light", &self.lights, |light| (&light.name, light.fault())))
            .or_else(|| first_of("emitter", &self.emitters, |own| (&own.name, own.fault(self))))
            .or_else(|| self.emitters_fault())
            .or_else(|| self.environment.fault())
            .or_else(|| self.sky.as_ref()?.fault().map(|fault| format!("the sky: {fault}")))
            .or_else(|| self.camera.fault().map(|fault| format!("the camera: {fault}")))
            .or_else(|| self.motion_fault())
    }
}

/// The first of several things that has a fault, with its number and name.
pub(super) fn first_of<T>(what: &str, all: &[T], fault: impl Fn(&T) -> (&String, Option<String>)) -> Option<String> {
    all.iter().enumerate().find_map(|(index, one)| {
        let (name, fault) = fault(one);
        fault.map(|fault| format!("{what} {index} (`{name}`): {fault}"))
    })
}

fn too_many(what: &str, most: usize, counts: impl Iterator<Item = usize>) -> Option<String> {
    let all = counts.fold(0usize, usize::saturating_add);
    (all > most).then(|| format!("its meshes have {all} {what} together, but at most {most} can be drawn"))
}

/// A fault of an index beyond the end of its list.
pub(super) fn dangling(what: &str, number: usize, count: usize) -> Option<String> {
    (number >= count).then(|| format!("its {what} is number {number}, but the scene has {count}, counted from 0"))
}

pub(super) fn infinite(value: &str) -> String {
    format!("{value} is not finite")
}

impl Mesh {
    fn fault(&self) -> Option<String> {
        let vertices = self.positions.len();
        let lengths = [
            ("normals", self.normals.len(), false),
            ("texture coordinates", self.uvs.len(), true),
            ("tangents", self.tangents.len(), true),
            ("second texture coordinates", self.uvs_1.len(), true),
            ("colours", self.colors.len(), true),
        ];
        for (what, length, optional) in lengths {
            if length != vertices && !(optional && length == 0) {
                let or_none = if optional { ", or none" } else { "" };
                return Some(format!("it has {length} {what} for {vertices} positions: expected as many{or_none}"));
            }
        }
        if !self.indices.len().is_multiple_of(3) {
            return Some(format!("its {} indices are not three a triangle", self.indices.len()));
        }
        // Without an early exit compilers look at several numbers at once; most meshes have nothing to find.
        let last = self.indices.iter().fold(0, |most, &index| most.max(index));
        if last as usize >= vertices
            && let Some(at) = self.indices.iter().position(|&index| index as usize >= vertices)
        {
            let wrong = self.indices[at];
            return Some(format!("index {at} is {wrong}, but there are only {vertices} positions"));
        }
        if self.is_strokes
            && let Some(fault) = self.strokes_fault()
        {
            return Some(fault);
        }
        if !self.origin.is_finite() {
            return Some(infinite("its origin"));
        }
        let fault = self.places_fault().or_else(|| not_finite("normal", &self.normals));
        fault
            .or_else(|| not_finite("texture coordinate", &self.uvs))
            .or_else(|| not_finite("tangent", &self.tangents))
            .or_else(|| not_finite("second texture coordinate", &self.uvs_1))
            .or_else(|| not_finite("colour", &self.colors))
            .or_else(|| self.colors_fault())
            .or_else(|| self.motion_fault())
    }

    fn colors_fault(&self) -> Option<String> {
        let is_share = |color: &[f32; 4]| color.iter().all(|channel| (0.0..=1.0).contains(channel));
        let vertex = self.colors.iter().position(|color| !is_share(color))?;
        Some(format!("the colour of vertex {vertex} is not from 0 to 1"))
    }

    /// A fault of the positions or of the box around them. Larger boxes only cull less.
    fn places_fault(&self) -> Option<String> {
        let stated = self.bounds;
        if !stated.is_empty() && !stated.size().is_finite() {
            return Some(infinite("its bounds"));
        }
        // One pass in f32 answers for all meshes but wrong ones, as fast as a search for values that are not finite. A box that is too small by
        // rounding does no harm.
        let slack = stated.size() * 1e-7 + self.origin.abs() * 1e-15;
        let [low, high] =
            [stated.min - slack, stated.max + slack].map(|corner| (corner - self.origin).as_vec3().to_array());
        let within = |place: &[f32; 3], axis: usize| (place[axis] >= low[axis]) & (place[axis] <= high[axis]);
        let fits = |place: &[f32; 3]| within(place, 0) & within(place, 1) & within(place, 2);
        let bounded = low.iter().chain(&high).all(|limit| limit.is_finite());
        if bounded && self.positions.iter().fold(true, |all, place| all & fits(place)) {
            return None;
        }
        not_finite("position", &self.positions).or_else(|| {
            let holds = stated.union(&self.compute_bounds()) == stated;
            (!holds).then(|| "its bounds do not hold its positions: set them with `compute_bounds`".into())
        })
    }
}

pub(super) fn not_finite<const N: usize>(what: &str, values: &[[f32; N]]) -> Option<String> {
    if !values.as_flattened().iter().fold(false, |found, number| found | !number.is_finite()) {
        return None;
    }
    let vertex = values.iter().position(|value| !value.iter().all(|number| number.is_finite()))?;
    Some(infinite(&format!("the {what} of vertex {vertex}")))
}

/// Finite, also as f32.
pub fn fits(transform: &DAffine3) -> bool {
    let columns = transform.matrix3.to_cols_array();
    columns.iter().all(|value| (*value as f32).is_finite()) && transform.translation.is_finite()
}

impl Object {
    fn fault(&self, scene: &Scene) -> Option<String> {
        let transform = (!fits(&self.transform)).then(|| infinite("its transform"));
        transform
            .or_else(|| dangling("mesh", self.mesh, scene.meshes.len()))
            .or_else(|| dangling("material", self.material, scene.materials.len()))
            .or_else(|| self.look_fault(scene))
    }
}

const SHARE: RangeInclusive<f32> = 0.0..=1.0;
const POSITIVE: RangeInclusive<f32> = 0.0..=f32::MAX;
const FINITE: RangeInclusive<f32> = f32::MIN..=f32::MAX;

/// The first of some values that is not finite, or not in its range.
fn out_of_range(values: &[(&str, Vec3, RangeInclusive<f32>)]) -> Option<String> {
    let (name, value, range) =
        values.iter().find(|(_, value, range)| !value.to_array().iter().all(|v| range.contains(v)))?;
    if !value.is_finite() {
        return Some(infinite(name));
    }
    Some(match *range.start() {
        _ if *range == SHARE => format!("{name} is not from 0 to 1"),
        1.0 => format!("{name} is below 1"),
        _ => format!("{name} is negative"),
    })
}

impl Material {
    fn fault(&self, scene: &Scene) -> Option<String> {
        let textures = scene.textures.len();
        let cutoff = if let AlphaMode::Mask { cutoff } = self.alpha_mode { cutoff } else { 0.0 };
        let number = |name, value, range| (name, Vec3::splat(value), range);
        let glass = self.refraction.unwrap_or_default();
        let values = [
            ("base_color", self.base_color, SHARE),
            ("specular", self.specular, SHARE),
            ("reflectance", self.reflectance, SHARE),
            number("grazing", self.grazing, SHARE),
            ("sheen_color", self.sheen.color, SHARE),
            number("sheen_roughness", self.sheen.roughness, SHARE),
            number("film", self.film.strength, SHARE),
            number("film_ior", self.film.ior, 1.0..=f32::MAX),
            number("film_thickness", self.film.nanometres[0], POSITIVE),
            number("film_thickness", self.film.nanometres[1], POSITIVE),
            number("anisotropy", self.anisotropy.strength, SHARE),
            number("anisotropy_rotation", self.anisotropy.rotation, FINITE),
            number("thickness", glass.thickness, POSITIVE),
            number("refraction's ior", glass.ior, 1.0..=f32::MAX),
            ("attenuation_color", glass.color, SHARE),
            // Infinite where nothing is absorbed.
            number("attenuation_distance", glass.distance.min(f32::MAX), f32::MIN_POSITIVE..=f32::MAX),
            number("dispersion", glass.dispersion, POSITIVE),
            number("diffuse_transmission", self.diffuse_transmission.strength, SHARE),
            ("diffuse_transmission_color", self.diffuse_transmission.color, SHARE),
            ("emissive", self.emissive, POSITIVE),
            number("alpha", self.alpha, SHARE),
            number("alpha_cutoff", cutoff, SHARE),
            number("metallic", self.metallic, SHARE),
            number("roughness", self.roughness, SHARE),
            number("shininess", self.shininess, POSITIVE),
            number("ambient", self.ambient, SHARE),
            number("normal_scale", self.normal_scale, FINITE),
        ];
        let slot =
            || self.textures().find_map(|(slot, texture)| dangling(&format!("{slot:?} texture"), texture, textures));
        let map = || TextureSlot::ALL.into_iter().find_map(|slot| self.uv_maps[slot as usize].fault(slot));
        out_of_range(&values).or_else(slot).or_else(map).or_else(|| self.atlas_fault(scene))
    }
}

impl UvMap {
    fn fault(&self, slot: TextureSlot) -> Option<String> {
        let Self { set, offset, rotation, scale } = *self;
        if set > 1 {
            return Some(format!(
                "its {slot:?} texture lies on texture coordinates {set}, but meshes have sets 0 and 1"
            ));
        }
        // Products of these numbers are uploaded as f32.
        let fits = |value: f64| value.abs() <= 1e15;
        let values = [offset.x, offset.y, scale.x, scale.y];
        let is_fit = values.into_iter().all(fits) && fits(rotation);
        (!is_fit).then(|| format!("the UV map of its {slot:?} texture has a number that is not from -1e15 to 1e15"))
    }
}

impl Texture {
    fn fault(&self) -> Option<String> {
        let [width, height] = self.size;
        if !self.size.iter().all(|edge| (1..=MAX_TEXTURE_EDGE).contains(edge)) {
            return Some(format!("it is {width}x{height} texels, but each edge must have 1 to {MAX_TEXTURE_EDGE}"));
        }
        match &self.texels {
            Texels::Rgba8(texels) => {
                let (bytes, length) = (4 * width as usize * height as usize, texels.len());
                (length != bytes)
                    .then(|| format!("it has {length} bytes, but {width}x{height} texels of 4 bytes are {bytes}"))
            }
            Texels::Rgba8Levels(levels) => faulty_levels("of 4 bytes", self.size, levels, |[width, height]| {
                4 * u64::from(width) * u64::from(height)
            }),
            Texels::Blocks { format, levels } => {
                faulty_levels(&format!("in {format}"), self.size, levels, |size| format.level_bytes(size))
            }
        }
    }
}

/// Returns the fault of the levels of a texture of this size, in words.
fn faulty_levels(form: &str, size: [u32; 2], levels: &[Vec<u8>], bytes: impl Fn([u32; 2]) -> u64) -> Option<String> {
    let most = most_levels(size);
    if !(1..=most as usize).contains(&levels.len()) {
        let [width, height] = size;
        return Some(format!("it has {} levels, but {width}x{height} texels have 1 to {most}", levels.len()));
    }
    (0..).zip(levels).find_map(|(level, blocks)| {
        let [width, height] = level_size(size, level);
        let (bytes, length) = (bytes([width, height]), blocks.len());
        (length as u64 != bytes)
            .then(|| format!("its level {level} has {length} bytes, but {width}x{height} texels {form} are {bytes}"))
    })
}

impl Light {
    /// Returns why the light could not be drawn, in words.
    pub fn fault(&self) -> Option<String> {
        let values = [
            ("color", self.color, POSITIVE),
            ("intensity", Vec3::splat(self.intensity), POSITIVE),
            // The product is uploaded.
            ("color times intensity", self.color * self.intensity, POSITIVE),
        ];
        let fault = out_of_range(&values).or_else(|| length("size", self.size));
        let form = self.kind.form();
        fault
            .or_else(|| form.place.and_then(place))
            .or_else(|| form.direction.and_then(aimless))
            .or_else(|| form.outline.fault())
            .or_else(|| form.range.and_then(|range| length("range", range)))
            .or_else(|| form.falloff.and_then(|falloff| weakening(form.range, falloff)))
    }
}

fn length(what: &str, value: f64) -> Option<String> {
    match value.is_finite() {
        true => (value < 0.0).then(|| format!("{what} is negative")),
        false => Some(infinite(what)),
    }
}

fn place(position: DVec3) -> Option<String> {
    (!position.is_finite()).then(|| infinite("position"))
}

fn aimless(direction: DVec3) -> Option<String> {
    let none = || (direction == DVec3::ZERO).then(|| "its direction has no length".into());
    if direction.is_finite() { none() } else { Some(infinite("direction")) }
}

fn weakening(range: Option<f64>, falloff: Falloff) -> Option<String> {
    match falloff {
        Falloff::Quadratic => range.is_none().then(|| "a quadratic fall-off needs a range".into()),
        Falloff::InverseSquare | Falloff::Polynomial { .. } => {
            out_of_range(&[("falloff", falloff.terms().into(), POSITIVE)])
        }
    }
}

impl Environment {
    fn fault(&self) -> Option<String> {
        let values = [
            ("ambient", self.ambient, POSITIVE),
            ("ground", self.ground(), POSITIVE),
            ("background", self.background, POSITIVE),
        ];
        out_of_range(&values).map(|fault| format!("the environment: {fault}"))
    }
}

impl Camera {
    /// Returns why the camera would see nothing, in words.
    pub fn fault(&self) -> Option<String> {
        let Self { position, rotation, projection, near, shift } = *self;
        if !position.is_finite() {
            return Some(infinite("position"));
        }
        if !rotation.is_normalized() {
            return Some("its rotation is not a quaternion of length 1".into());
        }
        let (what, value, range) = match projection {
            Projection::Perspective { fov_y_degrees } => ("field of view in degrees", fov_y_degrees, FOV_Y_DEGREES),
            Projection::Orthographic { height } => ("height in metres", height, HEIGHT),
        };
        if !range.contains(&value) {
            return Some(format!("its {what} is {value}, not from {} to {}", range.start(), range.end()));
        }
        let fits = shift.is_finite() && shift.abs().max_element() <= MOST_SHIFT;
        if !fits || self.is_orthographic() && shift != DVec2::ZERO {
            return Some(format!("its picture is shifted by {shift}"));
        }
        (!(near > 0.0 && near.is_finite())).then(|| format!("its near plane is at {near} m, not beyond 0"))
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, Vec3};

    use super::super::{BlockFormat, ColorSpace, LightKind, builtin};
    use super::*;

    fn checks() -> Scene {
        let mut scene = builtin::open("builtin:spheres").unwrap();
        scene.textures.push(Texture {
            name: "grey".into(),
            size: [2, 2],
            color_space: ColorSpace::Srgb,
            sampler: Default::default(),
            texels: vec![128; 16].into(),
        });
        scene.materials[1].normal_texture = Some(0);
        scene
    }

    /// The sentence about a scene that is changed so.
    fn fault(change: impl FnOnce(&mut Scene)) -> String {
        let mut scene = checks();
        change(&mut scene);
        scene.check().expect_err("a fault").to_string()
    }

    #[test]
    fn a_number_that_is_not_finite_is_named_with_its_place() {
        assert!(checks().check().is_ok());
        type FieldEdit = fn(&mut Scene, f32);
        let changes: [(FieldEdit, &str); 16] = [
            (
                |scene, bad| {
                    let mesh = &mut scene.meshes[0];
                    mesh.uvs_1 = vec![[0.0, bad]; mesh.positions.len()];
                },
                "the second texture coordinate of vertex 0 is not finite",
            ),
            (
                |scene, bad| {
                    let mesh = &mut scene.meshes[0];
                    mesh.colors = vec![[1.0, bad, 0.0, 1.0]; mesh.positions.len()];
                },
                "the colour of vertex 0 is not finite",
            ),
            (|scene, bad| scene.materials[1].reflectance.y = bad, "reflectance is not finite"),
            (
                |scene, bad| scene.materials[1].uv_maps[1].rotation = bad.into(),
                "the UV map of its Normal texture has a number that is not from -1e15 to 1e15",
            ),
            (|scene, bad| scene.meshes[0].positions[7][1] = bad, "the position of vertex 7 is not finite"),
            (|scene, bad| scene.meshes[0].normals[2][0] = bad, "the normal of vertex 2 is not finite"),
            (|scene, bad| scene.meshes[0].uvs[3][0] = bad, "the texture coordinate of vertex 3 is not finite"),
            (|scene, bad| scene.meshes[0].origin.x = f64::from(bad), "its origin is not finite"),
            (|scene, bad| scene.objects[1].transform.matrix3.x_axis.z = f64::from(bad), "object 1 ("),
            (|scene, bad| scene.materials[1].roughness = bad, "roughness is not finite"),
            (|scene, bad| scene.materials[1].emissive = Vec3::new(0.0, bad, 0.0), "emissive is not finite"),
            (|scene, bad| scene.lights[0].intensity = bad, "light 0 ("),
            (|scene, bad| scene.lights[0].size = bad.into(), "size is not finite"),
            (|scene, bad| scene.environment.background.x = bad, "the environment: background is not finite"),
            (|scene, bad| scene.camera.position.y = bad.into(), "the camera: position is not finite"),
            (|scene, bad| scene.camera.near = f64::from(bad), "its near plane is at"),
        ];
        for (change, expected) in changes {
            for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let error = fault(|scene| change(scene, bad));
                assert!(error.contains(expected), "{error}");
            }
        }
    }

    fn shorten<T>(values: &mut Vec<T>) {
        values.truncate(values.len() - 1);
    }

    #[test]
    fn each_index_length_and_range_has_its_sentence() {
        let spot = |inner, outer, falloff| LightKind::Spot {
            position: DVec3::ZERO,
            direction: DVec3::X,
            inner_angle_degrees: inner,
            outer_angle_degrees: outer,
            range: None,
            falloff,
        };
        let (position, direction) = (DVec3::ZERO, DVec3::X);
        let beam = |radius, edge, range| LightKind::Beam { position, direction, radius, edge, range };
        type SceneEdit<'a> = &'a dyn Fn(&mut Scene);
        let changes: &[(SceneEdit, &str)] = &[
            (&|scene| scene.meshes[0].indices[4] = 60_000, "mesh 0 (`sphere`): index 4 is 60000, but there are only"),
            (&|scene| shorten(&mut scene.meshes[0].indices), "indices are not three a triangle"),
            (
                &|scene| scene.meshes[0] = Mesh { indices: vec![0; 3], ..Mesh::default() },
                "index 0 is 0, but there are only 0 positions",
            ),
            (&|scene| shorten(&mut scene.meshes[0].normals), "positions: expected as many"),
            (&|scene| scene.meshes[0].uvs_1 = vec![[0.0; 2]], "it has 1 second texture coordinates for"),
            (&|scene| scene.meshes[0].colors = vec![[1.0; 4]; 2], "it has 2 colours for"),
            (
                &|scene| scene.meshes[0].colors = vec![[1.0, 0.0, 1.5, 1.0]; scene.meshes[0].positions.len()],
                "the colour of vertex 0 is not from 0 to 1",
            ),
            (&|scene| scene.materials[1].grazing = 1.5, "grazing is not from 0 to 1"),
            (&|scene| scene.materials[1].uv_maps[4].set = 2, "its Emissive texture lies on texture coordinates 2"),
            (&|scene| scene.meshes[0].normals.clear(), "it has 0 normals for"),
            (&|scene| shorten(&mut scene.meshes[0].uvs), "texture coordinates for"),
            (&|scene| scene.meshes[0].tangents.push([0.0; 4]), "positions: expected as many, or none"),
            (&|scene| scene.meshes[0].bounds.max.x -= 0.1, "its bounds do not hold its positions"),
            (&|scene| scene.objects[1].mesh = 99, "its mesh is number 99, but the scene has"),
            (&|scene| scene.objects[1].material = 99, "its material is number 99, but the scene has"),
            (
                &|scene| scene.materials[1].normal_texture = Some(1),
                "its Normal texture is number 1, but the scene has 1,",
            ),
            (&|scene| scene.materials[0].metallic = 1.5, "material 0 (`"),
            (
                &|scene| scene.materials[0].alpha_mode = AlphaMode::Mask { cutoff: 2.0 },
                "alpha_cutoff is not from 0 to 1",
            ),
            (&|scene| scene.materials[0].shininess = -1.0, "shininess is negative"),
            (&|scene| scene.textures[0].size = [2, 0], "texture 0 (`grey`): it is 2x0 texels"),
            (&|scene| scene.textures[0].size = [1 << 16, 1 << 16], "each edge must have 1 to 16384"),
            (
                &|scene| scene.textures[0].texels = Texels::Rgba8Levels(vec![vec![0; 16], vec![0; 3]]),
                "its level 1 has 3 bytes, but 1x1 texels of 4 bytes are 4",
            ),
            (
                &|scene| {
                    let (format, levels) = (BlockFormat::Etc2Rgb8, vec![vec![0; 8]; 3]);
                    scene.textures[0].texels = Texels::Blocks { format, levels };
                },
                "it has 3 levels, but 2x2 texels have 1 to 2",
            ),
            (
                &|scene| {
                    let (format, levels) = (BlockFormat::Bc7, vec![vec![0; 8]]);
                    scene.textures[0].texels = Texels::Blocks { format, levels };
                },
                "its level 0 has 8 bytes, but 2x2 texels in BC7 are 16",
            ),
            (&|scene| shorten(scene.textures[0].rgba8_mut()), "it has 15 bytes, but 2x2 texels of 4 bytes are 16"),
            (&|scene| scene.lights[0].color.y = -1.0, "color is negative"),
            (&|scene| scene.lights[0].size = -1.0, "size is negative"),
            (
                &|scene| scene.lights[0].kind = spot(30.0, 20.0, Falloff::InverseSquare),
                "30 to 20 degrees: expected 0 <=",
            ),
            (
                &|scene| scene.lights[0].kind = spot(0.0, 181.0, Falloff::InverseSquare),
                "0 to 181 degrees: expected 0 <=",
            ),
            (&|scene| scene.lights[0].kind = spot(0.0, 20.0, Falloff::Quadratic), "a quadratic fall-off needs a range"),
            (
                &|scene| scene.lights[0].kind = beam(0.0, 0.5, None),
                "its disc has a radius of 0 m: expected more than 0",
            ),
            (&|scene| scene.lights[0].kind = beam(f64::NAN, 0.5, None), "disc is not finite"),
            (
                &|scene| scene.lights[0].kind = beam(1.0, 1.5, None),
                "its soft edge is 1.5 of its radius: expected 0 to 1",
            ),
            (&|scene| scene.lights[0].kind = beam(1.0, 1.0, Some(-1.0)), "range is negative"),
            (&|scene| scene.environment.ground = Some(Vec3::NEG_ONE), "the environment: ground is negative"),
            (&|scene| scene.camera.rotation = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), "its rotation is not a quaternion"),
            (&|scene| scene.camera.projection = Projection::perspective(180.0), "degrees is 180, not from 0.001 to"),
            (&|scene| scene.camera.projection = Projection::orthographic(0.0), "height in metres is 0, not from"),
            (&|scene| scene.camera.near = 0.0, "its near plane is at 0 m"),
        ];
        for (change, expected) in changes {
            let error = fault(change);
            assert!(error.starts_with("builtin:spheres: ") && error.contains(expected), "{error}");
        }
    }

    #[test]
    fn counts_that_a_draw_cannot_hold_are_refused() {
        assert_eq!(too_many("vertices", 10, [4, 6].into_iter()), None);
        let error = too_many("vertices", 10, [4, 7].into_iter()).expect("too many");
        assert_eq!(error, "its meshes have 11 vertices together, but at most 10 can be drawn");
    }

    #[test]
    fn a_direction_without_a_length_is_found() {
        let directed = |direction| {
            let mut scene = checks();
            scene.lights[0].kind = LightKind::Directional { direction };
            scene.check()
        };
        assert!(directed(DVec3::Y * 5e-324).is_ok());
        let error = directed(DVec3::new(0.0, -0.0, 0.0)).expect_err("refused").to_string();
        assert!(error.contains(": light 0 (") && error.ends_with("its direction has no length"), "{error}");
    }

    #[test]
    fn a_product_that_overflows_is_found_too() {
        let error = fault(|scene| (scene.lights[0].color, scene.lights[0].intensity) = (Vec3::splat(1e20), 1e20));
        assert!(error.contains("color times intensity"), "{error}");
        assert!(fault(|scene| scene.objects[0].transform.matrix3.y_axis.y = 1e39).contains("its transform"));
    }
}
