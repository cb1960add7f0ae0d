//! Looks of instances: the part of [`Look`] that shaders read, and its changes between frames.

use super::{MapDraw, Visible, World, WorldObject};
use crate::plan::{PlanError, TexturePlan};
use crate::scene::{CastsShadow, Look, Material};

/// A look as shaders have it (`Vertex.look` in `shaders/geometry.wgsl`): the tint in 65535ths, so that no channel of a picture is off by more than
/// a 128th of a code; then the layer of the cell in its sheet, and in the highest bit whether the object is selected.
pub type PackedLook = [u16; 4];

/// The bit of selected objects.
const SELECTED: u16 = 1 << 15;

/// A look with its consequences in a plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlannedLook {
    pub look: Look,
    /// The sheet of its material's atlas that has its cell.
    pub sheet: u32,
    pub packed: PackedLook,
}

impl PlannedLook {
    pub(super) fn of(look: Look, material: &Material, textures: &TexturePlan) -> Self {
        let (sheet, layer) = if material.has_atlas() { textures.place_of_cell(look.cell) } else { (0, 0) };
        let [red, green, blue] = look.tint.to_array().map(|share| (share * 65535.0).round() as u16);
        let selected = if look.selected { SELECTED } else { 0 };
        // A plan has at most 2^15 layers a sheet.
        Self { look, sheet, packed: [red, green, blue, layer as u16 | selected] }
    }
}

impl Visible {
    /// Returns the look of each instance.
    pub fn looks(&self, world: &World) -> Vec<PackedLook> {
        self.instances.iter().map(|&index| world.objects[index as usize].look.packed).collect()
    }

    /// Returns the look of each caster of a shadow map.
    pub fn caster_looks(&self, world: &World, map: &MapDraw) -> impl Iterator<Item = PackedLook> {
        let casters = self.shadows[map.map].as_ref().map(|_| map.casters.iter().map(|own| &world.objects[own.object]));
        casters.into_iter().flatten().map(|object| object.look.packed)
    }
}

impl World {
    /// Returns the look of the instance at a place of the list.
    pub fn look_at(&self, place: usize) -> PackedLook {
        self.objects[self.instances.object(place)].look.packed
    }

    /// Changes how an object looks, by its index in the scene. Returns false where that needs another plan: nothing in this one says how objects of
    /// its material look.
    ///
    /// # Errors
    /// When there is no such object, its material has no such cell, or the tint is not from 0 to 1.
    pub fn set_look(&mut self, index: usize, look: &Look, textures: &TexturePlan) -> Result<bool, PlanError> {
        let own = self.place_of(index)?;
        let Some(own) = own else { return Ok(true) };
        let object = &self.objects[own];
        if let Some(fault) = look.fault(&self.materials[object.material]) {
            return Err(PlanError::Change(format!("object {index}: {fault}")));
        }
        if object.look.look == *look {
            return Ok(true);
        }
        if !object.key.extras.looks {
            return Ok(false);
        }
        let planned = PlannedLook::of(*look, &self.materials[object.material], textures);
        self.wear(own, planned);
        Ok(true)
    }

    fn wear(&mut self, own: usize, look: PlannedLook) {
        let object = &mut self.objects[own];
        let before = std::mem::replace(&mut object.look, look);
        self.generation += 1;
        let changes = self.changes.get_or_insert_default();
        // Lists on the device have it anew.
        changes.moved.push(own as u32);
        changes.rearranged |= before.sheet != look.sheet;
        // Another cell cuts other holes into its shadow.
        if before.look.cell != look.look.cell && object.cuts.extras.cells && object.casts != CastsShadow::No {
            object.revision += 1;
            changes.boxes.extend([object.bounds]);
        }
    }
}

impl WorldObject {
    /// The material and the sheet of its atlas, which together have a descriptor set.
    pub fn material_set(&self) -> (usize, u32) {
        (self.material, self.look.sheet)
    }
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DVec3, Vec3};

    use super::*;
    use crate::plan::{Capabilities, FramePlan, samples};
    use crate::scene::{Camera, Light, LightPath, Scene, Settings};

    /// So many squares of one material, each with the next cell of an atlas of 8 x 8.
    fn squares(count: u32, lights: Vec<Light>) -> Scene {
        let material = Material { atlas: [8, 8], ..samples::masked() };
        let mut scene = samples::scene(vec![material], lights);
        scene.textures[0].size = [8, 16];
        scene.textures[0].texels = (0..512u32).map(|byte| (byte * 37) as u8).collect();
        let square = scene.objects[0].clone();
        scene.objects = (0..count)
            .map(|index| {
                let mut object = square.clone();
                let place = DVec3::new(f64::from(index % 16), f64::from(index / 16), -f64::from(index));
                object.transform = DAffine3::from_translation(place);
                object.look =
                    Some(Look { cell: index % 64, tint: Vec3::splat(0.5), selected: index.is_multiple_of(2) });
                object
            })
            .collect();
        scene.camera = Camera::looking_at(DVec3::new(8.0, 2.0, 60.0), DVec3::new(8.0, 2.0, 0.0), DVec3::Y);
        scene
    }

    fn seen(scene: &Scene, settings: &Settings, device: &Capabilities) -> (World, FramePlan, Visible) {
        let plan = FramePlan::of(scene, settings, device).expect("a plan");
        let world = World::of(scene, settings, &plan, 1.0);
        let visible = Visible::of(&world, &scene.camera, &plan);
        (world, plan, visible)
    }

    #[test]
    fn objects_of_one_mesh_and_material_are_one_command_whatever_they_look_like() {
        let scene = squares(64, vec![samples::sun()]);
        for light_path in [LightPath::Loop, LightPath::Forward] {
            let settings = Settings { light_path, ..Settings::default() };
            let (world, plan, visible) = seen(&scene, &settings, &samples::device());
            assert_eq!((visible.draws.len(), visible.draws[0].count), (1, 64));
            assert_eq!(plan.keys().count(), 1);
            for (packed, &own) in visible.looks(&world).iter().zip(&visible.instances) {
                let number = world.objects[own as usize].number as u16;
                assert_eq!(*packed, [32768, 32768, 32768, number | u16::from(number.is_multiple_of(2)) << 15]);
            }
        }
    }

    /// If arrays have fewer layers than an atlas has cells, each array's cells are drawn by a separate command.
    #[test]
    fn cells_beyond_an_array_are_in_another_sheet() {
        let scene = squares(64, vec![]);
        let device = Capabilities { max_layers: 20, ..samples::device() };
        let (mut world, plan, visible) = seen(&scene, &Settings::default(), &device);
        assert_eq!(plan.textures.sheet, 20);
        let counts = |visible: &Visible| {
            let mut counts: Vec<u32> = visible.draws.iter().map(|draw| draw.count).collect();
            counts.sort_unstable();
            counts
        };
        assert_eq!(counts(&visible).iter().sum::<u32>(), 64);
        let sheets: std::collections::BTreeSet<u32> = world.objects.iter().map(|object| object.look.sheet).collect();
        assert_eq!(sheets.len(), 4);
        // All in one sheet again: one command.
        for index in 0..64 {
            assert!(world.set_look(index, &Look { cell: 59, ..Look::PLAIN }, &plan.textures).expect("a cell"));
        }
        world.refresh(&plan);
        assert_eq!(counts(&Visible::of(&world, &scene.camera, &plan)), [64]);
        assert!(world.objects.iter().all(|object| object.look.packed[3] == 19));
    }

    #[test]
    fn a_plan_without_looks_has_no_trace_of_them() {
        let mut scene = squares(4, vec![samples::sun()]);
        scene.materials[0].atlas = [1, 1];
        scene.objects.iter_mut().for_each(|object| object.look = None);
        let (_, plain, _) = seen(&scene, &Settings::default(), &samples::device());
        assert!(!plain.has_looks() && !plain.has_caster_looks());
        assert!(plain.keys().all(|key| !key.extras.any()) && plain.textures.images[0].cells.is_none());
        scene.objects[2].look = Some(Look::PLAIN);
        let (_, told, _) = seen(&scene, &Settings::default(), &samples::device());
        assert!(told.has_looks() && !told.has_caster_looks() && told.textures.images[0].cells.is_none());
        scene.materials[0].atlas = [2, 2];
        let (_, cells, _) = seen(&scene, &Settings::default(), &samples::device());
        assert!(cells.has_looks() && cells.has_caster_looks());
        assert_eq!((cells.textures.images[0].cells, cells.textures.images[0].size), (Some(4), [4, 8]));
        // 4x8, 2x4, 1x2, 1x1, four times.
        assert_eq!(cells.textures.bytes(), 4 * 4 * (32 + 8 + 2 + 1));
    }

    #[test]
    fn a_look_that_the_plan_cannot_tell_asks_for_another_plan() {
        let mut scene = squares(2, vec![samples::sun()]);
        scene.materials[0].atlas = [1, 1];
        scene.objects.iter_mut().for_each(|object| object.look = None);
        let (mut world, plan, _) = seen(&scene, &Settings::default(), &samples::device());
        let selected = Look { selected: true, ..Look::PLAIN };
        assert!(!world.set_look(0, &selected, &plan.textures).expect("a look"));
        assert!(world.set_look(0, &Look::PLAIN, &plan.textures).expect("nothing is asked for"));
        assert!(world.set_look(9, &selected, &plan.textures).is_err());
        scene.objects[1].look = Some(Look::PLAIN);
        let (mut world, plan, _) = seen(&scene, &Settings::default(), &samples::device());
        let (before, revision) = (world.generation(), world.objects[0].revision);
        assert!(world.set_look(0, &selected, &plan.textures).expect("a look"));
        assert!(world.generation() != before);
        assert_eq!(world.objects[0].revision, revision, "its shadow is the same");
    }
}
