//! Scenes of a few triangles. Each kind of scene makes a frame need a particular feature.

use glam::{DAffine3, DQuat, DVec3, Vec3};

use afterlight::scene::builtin::shapes::{self, MeshBuilder, WHOLE_IMAGE};
use afterlight::scene::{
    AlphaMode, Brdf, Camera, Channel, ChannelTarget, Clip, ColorSpace, Environment, Falloff, Influences, Interpolation,
    Light, LightKind, Local, Material, Mesh, Morph, Motion, Node, Object, Placement, Projection, Scene, Skin, Texture,
    TextureSlot,
};

/// A square that faces +Z, from its centre to its edges so far.
fn square(half: f64) -> MeshBuilder {
    let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
    let mut mesh = MeshBuilder::new();
    mesh.quad(corners.map(|[x, y]| DVec3::new(x, y, 0.0)), WHOLE_IMAGE);
    mesh
}

/// Adds an object with its own mesh and material.
fn add(scene: &mut Scene, mesh: MeshBuilder, material: Material, transform: DAffine3) {
    let name = format!("object {}", scene.objects.len());
    scene.materials.push(material);
    scene.meshes.push(mesh.finish(&name));
    let (mesh, material) = (scene.meshes.len() - 1, scene.materials.len() - 1);
    scene.objects.push(Object::new(name, mesh, material, transform));
}

fn lambert(albedo: f32) -> Material {
    Material { name: "lambert".into(), brdf: Brdf::Lambert, base_color: Vec3::splat(albedo), ..Material::default() }
}

fn light(kind: LightKind, intensity: f32) -> Light {
    Light { name: "light".into(), kind, color: Vec3::ONE, intensity, casts_shadow: false, size: 0.0 }
}

fn sun() -> Light {
    let direction = -DVec3::new(0.5, 0.7, 1.0).normalize();
    Light { casts_shadow: true, ..light(LightKind::Directional { direction }, 3.0) }
}

/// The plane z = 0, as far as the camera sees it.
fn plane(lights: Vec<Light>) -> Scene {
    let camera = Camera {
        position: DVec3::new(0.0, 0.0, 2.0),
        rotation: DQuat::IDENTITY,
        projection: Projection::perspective(2.0 * 0.5f64.atan().to_degrees()),
        near: 0.125,
        ..Camera::default()
    };
    let mut scene = Scene { name: "stage".into(), camera, ..Scene::default() };
    add(&mut scene, square(4.0), lambert(0.7), DAffine3::IDENTITY);
    scene.lights = lights;
    scene
}

/// Surfaces under the sky's light.
pub(super) fn plain() -> Scene {
    let mut scene = plane(Vec::new());
    scene.environment = Environment { ambient: Vec3::splat(0.1), background: Vec3::splat(0.2), ground: None };
    scene
}

/// The first material emits light.
pub(super) fn glow(scene: &mut Scene) {
    if let Some(material) = scene.materials.first_mut() {
        material.emissive = Vec3::ONE;
    }
}

/// Puts a pane before it.
pub(super) fn glaze(scene: &mut Scene) {
    let pane = Material { alpha_mode: AlphaMode::Blend, alpha: 0.4, ..lambert(0.5) };
    add(scene, square(0.5), pane, DAffine3::from_translation(DVec3::Z * 0.5));
}

/// A box throws a shadow.
pub(super) fn sunlit() -> Scene {
    let mut scene = plane(vec![sun()]);
    add(&mut scene, shapes::cuboid([0.4; 3]), lambert(0.5), DAffine3::from_translation(DVec3::Z * 0.4));
    scene
}

/// A lamp that reaches everywhere, and one that does not.
pub(super) fn lamplit() -> Scene {
    let lamp = |x: f64, range| {
        let (position, falloff) = (DVec3::new(x, 0.3, 1.0), Falloff::InverseSquare);
        light(LightKind::Point { position, range, falloff }, 2.0)
    };
    plane(vec![lamp(-0.5, None), lamp(0.5, Some(3.0))])
}

/// No texel is like its neighbour.
pub(super) fn textured(edge: u32) -> Scene {
    let mut scene = plain();
    let texels = (0..edge * edge).flat_map(|index| [255, (index * 37) as u8, 64, 255]).collect();
    let (name, size) = ("checks".into(), [edge; 2]);
    scene.textures = vec![Texture { name, size, color_space: ColorSpace::Srgb, sampler: Default::default(), texels }];
    scene.materials[0].base_color_texture = Some(0);
    scene
}

/// A material with a texture in every slot; the textures differ from texel to texel.
fn covered() -> Material {
    let mut material = Material { specular: Vec3::splat(0.5), ..Material::default() };
    TextureSlot::ALL.into_iter().for_each(|slot| *material.texture_mut(slot) = Some(slot as usize));
    material
}

fn textures() -> Vec<Texture> {
    let texture = |slot: TextureSlot| Texture {
        name: slot.form().key.into(),
        size: [2, 2],
        color_space: slot.form().color_space,
        sampler: Default::default(),
        texels: [[255, 90, 200, 0], [10, 128, 250, 255], [0, 20, 128, 60], [99, 30, 180, 255]].concat().into(),
    };
    TextureSlot::ALL.into_iter().map(texture).collect()
}

/// The first of two squares hangs on a joint and blends to a shape, the second has holes. With plain surfaces in their place layer 1.4.309 misses two
/// mutants of `skin-reuse`.
pub(super) fn deformed() -> Scene {
    let mut mesh =
        Mesh::from_points("square", &[[0., 0.], [1., 0.], [1., 1.], [0., 1.]].map(|[x, y]| DVec3::new(x, y, 0.0)));
    mesh.indices = vec![0, 1, 2, 0, 2, 3];
    mesh.uvs = vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    mesh.compute_normals();
    mesh.compute_tangents();
    let vertices = mesh.positions.len();
    let weights = [1.0, 0.0, 0.0, 0.0].repeat(vertices);
    let influences = Some(Influences { per_vertex: 4, joints: vec![0; 4 * vertices], weights });
    let morphs = vec![Morph { positions: vec![[0.0, 0.0, 0.1]; vertices], ..Morph::default() }];
    let bent = Mesh { influences, morphs, ..mesh.clone() };
    let object = |material: usize| {
        let place = DAffine3::from_translation(DVec3::X * material as f64);
        Object::new(format!("square {material}"), 0, material, place)
    };
    let mask = AlphaMode::Mask { cutoff: 0.5 };
    let cut = Material { alpha_mode: mask, base_color_texture: Some(0), ..Material::default() };
    let direction = DVec3::new(0.3, -1.0, -0.5).normalize();
    let sun = Light { casts_shadow: true, ..light(LightKind::Directional { direction }, 100.0) };
    let mut scene = Scene {
        meshes: vec![mesh, bent],
        objects: vec![object(0), object(1)],
        materials: vec![covered(), cut],
        textures: textures(),
        lights: vec![sun],
        ..Scene::default()
    };
    let node = |name: &str, weights| {
        let local = Local::Parts(Placement::default());
        Node { name: name.into(), parent: None, local, weights }
    };
    let turn = Channel {
        target: ChannelTarget::Rotation(0),
        times: vec![0.0, 1.0],
        values: vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.6, 0.8],
        interpolation: Interpolation::Linear,
    };
    scene.motion = Motion {
        nodes: vec![node("joint", vec![]), node("plane", vec![0.5])],
        skins: vec![Skin { name: "skin".into(), joints: vec![0], inverse_bind: vec![DAffine3::IDENTITY] }],
        clips: vec![Clip { name: "turn".into(), channels: vec![turn] }],
        light_nodes: Vec::new(),
    };
    let object = &mut scene.objects[0];
    (object.mesh, object.node, object.skin) = (1, Some(1), Some(0));
    scene
}
