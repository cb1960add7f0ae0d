//! The scene's triangles in the world, in f64, and their intersections with rays.
//!
//! A ray sees the surfaces that the rasterizer would draw: one-sided materials only from the front, which a mirrored transform turns over; no holes
//! of masks; nothing before the near plane. If opaque surfaces are coplanar, it sees the scene's first. A coat lies on the surface that is coplanar
//! with it.

use glam::{DAffine3, DMat3, DVec2, DVec3, DVec4, Vec2, Vec3, Vec4};

use super::bvh::Bvh;
use super::intersect::{Crossing, Ray};
use super::texture::{self, TextureRegion};
use afterlight_scene::{Aabb, AlphaMode, CastsShadow, Look, Material, Mesh, Scene, TextureSlot, TriangleId, UvMap};

/// The fourth powers of larger coordinates overflow f64: triangles that reach farther are not drawn.
const LARGEST: f64 = 1e75;

/// A triangle in world space.
#[derive(Debug, Clone, Copy)]
pub struct Triangle {
    pub corners: [DVec3; 3],
    pub id: TriangleId,
}

/// The properties shared by all triangles of an object.
#[derive(Debug, Clone, Copy)]
pub struct TracedObject<'a> {
    pub mesh: &'a Mesh,
    pub material: &'a Material,
    pub look: Look,
    pub receives_shadow: bool,
    pub(super) casts_shadow: CastsShadow,
    mirrored: bool,
    cutoff: Option<f64>,
    /// From mesh space to the world, for directions along surfaces and for normals.
    pub along: DMat3,
    pub normals: DMat3,
    /// -1 where the transform swaps left and right.
    pub handedness: f64,
}

/// A triangle that is met, and where.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Index in [`Geometry::triangles`].
    pub triangle: usize,
    pub crossing: Crossing,
    /// The side that is met is the front.
    pub front: bool,
}

/// Everything that rays can meet.
#[derive(Debug)]
pub struct Geometry<'a> {
    scene: &'a Scene,
    pub triangles: Vec<Triangle>,
    /// Indexed by object.
    pub objects: Vec<TracedObject<'a>>,
    /// The first triangle of each point and line. It has no area, so that only a picture's own rays meet it, by [`Strokes`](super::strokes::Strokes).
    pub strokes: Vec<usize>,
    tree: Bvh,
    has_transparent: bool,
}

impl<'a> TracedObject<'a> {
    fn of(scene: &'a Scene, index: usize) -> Self {
        let object = &scene.objects[index];
        let material = &scene.materials[object.material];
        let along = object.transform.matrix3;
        let [x, y, z] = [along.row(0), along.row(1), along.row(2)];
        let handedness = if along.determinant() >= 0.0 { 1.0 } else { -1.0 };
        // Normals go by the cofactors, which are right for any scale.
        let normals = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)).transpose() * handedness;
        Self {
            mesh: &scene.meshes[object.mesh],
            material,
            look: object.shown_look(),
            receives_shadow: object.receives_shadow,
            casts_shadow: object.casts_shadow,
            mirrored: handedness < 0.0,
            cutoff: match material.alpha_mode {
                AlphaMode::Mask { cutoff } => Some(f64::from(cutoff)),
                AlphaMode::Opaque | AlphaMode::Blend | AlphaMode::Glass | AlphaMode::Coat => None,
            },
            along,
            normals,
            handedness,
        }
    }

    /// The vertices of a triangle.
    pub fn vertices(&self, triangle: u32) -> [usize; 3] {
        let first = triangle as usize * 3;
        let indices = &self.mesh.indices[first..first + 3];
        [indices[0] as usize, indices[1] as usize, indices[2] as usize]
    }

    /// Returns the texture coordinates of a slot on a triangle; 0 for a mesh without any.
    fn uv(&self, slot: TextureSlot, triangle: u32, weights: [f64; 3]) -> DVec2 {
        let map = &self.material.uv_maps[slot as usize];
        let uvs = if map.set == 1 { &self.mesh.uvs_1 } else { &self.mesh.uvs };
        let uv = |vertex: usize| uvs.get(vertex).map_or(DVec2::ZERO, |&uv| Vec2::from(uv).as_dvec2());
        let own: DVec2 = weights.into_iter().zip(self.vertices(triangle)).map(|(weight, at)| uv(at) * weight).sum();
        match *map {
            UvMap::IDENTITY => own,
            _ => DVec2::from(map.rows().map(|row| row.dot(own.extend(1.0)))),
        }
    }

    /// Returns the texel of a slot's texture at a point of a triangle, from the atlas cell of the object; `None` without a texture.
    pub fn texel(&self, scene: &Scene, slot: TextureSlot, triangle: u32, weights: [f64; 3]) -> Option<DVec4> {
        let texture = &scene.textures[self.material.texture(slot)?];
        let cell = TextureRegion::cell(texture, self.material.atlas, self.look.cell);
        Some(texture::sample(texture, cell, self.uv(slot, triangle, weights)))
    }

    /// The vertices' own colour and alpha.
    pub fn color(&self, triangle: u32, weights: [f64; 3]) -> DVec4 {
        if self.mesh.colors.is_empty() {
            return DVec4::ONE;
        }
        let color = |vertex: usize| Vec4::from(self.mesh.colors[vertex]).as_dvec4();
        weights.into_iter().zip(self.vertices(triangle)).map(|(weight, vertex)| color(vertex) * weight).sum()
    }
}

/// The triangle's corners in the world.
fn corners(mesh: &Mesh, transform: &DAffine3, triangle: usize) -> [DVec3; 3] {
    [0, 1, 2].map(|corner| {
        let position = mesh.positions[mesh.indices[triangle * 3 + corner] as usize];
        transform.transform_point3(mesh.origin + Vec3::from(position).as_dvec3())
    })
}

impl<'a> Geometry<'a> {
    pub fn of(scene: &'a Scene) -> Self {
        let mut triangles = Vec::with_capacity(scene.triangle_count());
        for (index, object) in scene.objects.iter().enumerate() {
            let mesh = &scene.meshes[object.mesh];
            for triangle in 0..mesh.indices.len() / 3 {
                let corners = corners(mesh, &object.transform, triangle);
                let id = TriangleId { object: index as u32, triangle: triangle as u32 };
                // False for a NaN.
                if corners.iter().all(|corner| corner.abs().max_element() <= LARGEST) {
                    triangles.push(Triangle { corners, id });
                }
            }
        }
        let is_stroke = |triangle: &Triangle| {
            let TriangleId { object, triangle } = triangle.id;
            scene.meshes[scene.objects[object as usize].mesh].is_strokes && triangle % 2 == 0
        };
        let strokes = triangles.iter().enumerate().filter(|(_, own)| is_stroke(own)).map(|(index, _)| index).collect();
        let tree = Bvh::of(triangles.iter().map(|triangle| Aabb::of_points(triangle.corners)));
        let parts: Vec<TracedObject> = (0..scene.objects.len()).map(|index| TracedObject::of(scene, index)).collect();
        let has_transparent = parts.iter().any(|part| part.material.is_transparent());
        Self { scene, triangles, objects: parts, strokes, tree, has_transparent }
    }

    pub fn object(&self, hit: &Hit) -> &TracedObject<'a> {
        &self.objects[self.triangles[hit.triangle].id.object as usize]
    }

    /// The base colour's alpha at a place.
    pub fn alpha(&self, object: &TracedObject, triangle: u32, weights: [f64; 3]) -> f64 {
        let texel = object.texel(self.scene, TextureSlot::BaseColor, triangle, weights).map_or(1.0, |texel| texel.w);
        f64::from(object.material.alpha) * texel * object.color(triangle, weights).w
    }

    fn is_hole(&self, object: &TracedObject, triangle: u32, weights: [f64; 3]) -> bool {
        object.cutoff.is_some_and(|cutoff| self.alpha(object, triangle, weights) < cutoff)
    }

    /// Finds the surfaces along a ray from `near` on: the nearest opaque surface, and through `transparent` each transparent one before
    /// it, from back to front.
    pub fn seen(&self, ray: &Ray, near: f64, transparent: &mut Vec<Hit>) -> Option<Hit> {
        self.seen_with(ray, near, |_| (), transparent)
    }

    /// Finds surfaces like [`Self::seen`], and also the points and lines that `strokes` passes on, which the ray meets from `near` on.
    pub fn seen_with(
        &self,
        ray: &Ray,
        near: f64,
        strokes: impl FnOnce(&mut dyn FnMut(Hit)),
        transparent: &mut Vec<Hit>,
    ) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        transparent.clear();
        self.tree.walk(ray, f64::INFINITY, |index, limit| {
            let Triangle { corners, id } = &self.triangles[index];
            let Some(crossing) = ray.crossing(corners) else { return limit };
            if crossing.distance < near || crossing.distance > limit {
                return limit;
            }
            let part = &self.objects[id.object as usize];
            let front = crossing.counter_clockwise != part.mirrored;
            if !front && !part.material.two_sided {
                return limit;
            }
            let hit = Hit { triangle: index, crossing, front };
            if part.material.is_transparent() {
                transparent.push(hit);
                return limit;
            }
            let ties = nearest.is_some_and(|nearest| crossing.distance == limit && nearest.triangle < index);
            if ties || self.is_hole(part, id.triangle, crossing.weights) {
                return limit;
            }
            nearest = Some(hit);
            crossing.distance
        });
        strokes(&mut |hit| {
            let part = self.object(&hit);
            if part.material.is_transparent() {
                transparent.push(hit);
                return;
            }
            let id = self.triangles[hit.triangle].id;
            let is_behind = nearest.is_some_and(|nearest| hit.crossing.distance >= nearest.crossing.distance);
            if !is_behind && !self.is_hole(part, id.triangle, hit.crossing.weights) {
                nearest = Some(hit);
            }
        });
        if self.has_transparent {
            let limit = nearest.map_or(f64::INFINITY, |nearest| nearest.crossing.distance);
            let is_coat = |hit: &Hit| self.object(hit).material.alpha_mode == AlphaMode::Coat;
            // As by the depth test: of surfaces coplanar with an opaque one, only coats pass, which lie on it.
            transparent.retain(|hit| {
                let distance = hit.crossing.distance;
                distance < limit || distance == limit && is_coat(hit)
            });
            let order = |a: &Hit, b: &Hit| {
                let far_first = b.crossing.distance.total_cmp(&a.crossing.distance);
                far_first.then(is_coat(a).cmp(&is_coat(b))).then(a.triangle.cmp(&b.triangle))
            };
            transparent.sort_unstable_by(order);
        }
        nearest
    }

    /// Finds the nearest surface along a ray that is `met`, from whichever side; no holes of masks.
    pub fn nearest(&self, ray: &Ray, met: &dyn Fn(&Hit) -> bool) -> Option<Hit> {
        let mut nearest = None;
        self.tree.walk(ray, f64::INFINITY, |index, limit| {
            let Triangle { corners, id } = &self.triangles[index];
            let Some(crossing) = ray.crossing(corners) else { return limit };
            if !(0.0..limit).contains(&crossing.distance) {
                return limit;
            }
            let part = &self.objects[id.object as usize];
            let hit = Hit { triangle: index, crossing, front: crossing.counter_clockwise != part.mirrored };
            if !met(&hit) || self.is_hole(part, id.triangle, crossing.weights) {
                return limit;
            }
            nearest = Some(hit);
            crossing.distance
        });
        nearest
    }

    /// Returns the distance to the nearest opaque surface along a ray, on whichever side it is met, if that is before `limit`.
    pub fn nearest_opaque(&self, ray: &Ray, limit: f64) -> Option<f64> {
        let mut nearest = None;
        self.tree.walk(ray, limit, |index, limit| {
            let Triangle { corners, id } = &self.triangles[index];
            let part = &self.objects[id.object as usize];
            if part.material.is_transparent() {
                return limit;
            }
            let Some(crossing) = ray.crossing(corners) else { return limit };
            let is_met = (0.0..limit).contains(&crossing.distance);
            if !is_met || self.is_hole(part, id.triangle, crossing.weights) {
                return limit;
            }
            nearest = Some(crossing.distance);
            crossing.distance
        });
        nearest
    }

    /// Transparent surfaces that cast shadows, on the ray before `limit`, from whichever side they are met.
    pub fn veils(&self, ray: &Ray, limit: f64) -> Vec<Hit> {
        let mut met = Vec::new();
        if !self.has_transparent {
            return met;
        }
        self.tree.walk(ray, limit, |index, limit| {
            let Triangle { corners, id } = &self.triangles[index];
            let part = &self.objects[id.object as usize];
            let lets_through = matches!(part.material.alpha_mode, AlphaMode::Blend | AlphaMode::Glass);
            if part.casts_shadow == CastsShadow::No || !lets_through {
                return limit;
            }
            if let Some(crossing) = ray.crossing(corners).filter(|own| (0.0..limit).contains(&own.distance)) {
                met.push(Hit { triangle: index, crossing, front: crossing.counter_clockwise != part.mirrored });
            }
            limit
        });
        met
    }

    /// Returns true if something that casts shadows lies on the ray before `limit`, as seen from a receiver that looks to the light.
    pub fn is_blocked(&self, ray: &Ray, limit: f64) -> bool {
        let mut blocked = false;
        self.tree.walk(ray, limit, |index, limit| {
            let Triangle { corners, id } = &self.triangles[index];
            let part = &self.objects[id.object as usize];
            if part.casts_shadow == CastsShadow::No || part.material.is_transparent() {
                return limit;
            }
            let Some(crossing) = ray.crossing(corners) else { return limit };
            // A face whose front is turned to the light shows its back to the receiver behind it.
            let turned_to_light = crossing.counter_clockwise == part.mirrored;
            let is_met = (0.0..limit).contains(&crossing.distance)
                && (turned_to_light || part.casts_shadow == CastsShadow::Yes)
                && !self.is_hole(part, id.triangle, crossing.weights);
            blocked |= is_met;
            if is_met { f64::NEG_INFINITY } else { limit }
        });
        blocked
    }
}
