//! Scenes that change while frames go on: a move or a set value costs a write, any other change a plan and the objects that this plan needs anew.

use std::sync::Arc;

use glam::DAffine3;

use super::builder::RendererBuilder;
use super::{Error, Renderer, plan_for, rows};
use crate::gpu_scene::{CullingBuffers, VisibilityLookup};
use crate::plan;
use crate::scene::{Light, Look, Pose, Scene, Settings, SettingsPatch, exposure_scale};
use crate::visible::ShadowCache;

/// The part of a scene that has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Changed {
    /// The set of objects, lights and materials, and everything about them.
    Arrangement,
    /// Meshes or textures as well: their content is uploaded anew.
    Content,
}

impl Renderer {
    /// Moves an object of the scene, by its index, to where `transform` places it from the next frame on.
    ///
    /// # Errors
    /// When there is no such object, a number is not finite, or, where the moved one needs another plan, as [`Renderer::update`].
    pub fn move_object(&mut self, scene: &mut Scene, index: usize, transform: &DAffine3) -> Result<(), Error> {
        let moved = self.world.move_object(index, transform)?;
        if let Some(object) = scene.objects.get_mut(index) {
            object.transform = *transform;
        }
        if moved { Ok(()) } else { self.update(scene, Changed::Arrangement) }
    }

    /// Changes how an object of the scene looks, by its index, from the next frame on. It costs a write only where the plan has looks for objects of
    /// its material: as soon as one of them has [`Object::look`](crate::scene::Object::look), be it a plain one.
    ///
    /// # Errors
    /// When there is no such object, its material's atlas has no such cell, the tint is not from 0 to 1, or, where another plan is needed, as
    /// [`Renderer::update`].
    pub fn set_look(&mut self, scene: &mut Scene, index: usize, look: &Look) -> Result<(), Error> {
        let changed = self.world.set_look(index, look, &self.plan.textures)?;
        if let Some(object) = scene.objects.get_mut(index) {
            object.look = Some(*look);
        }
        if changed { Ok(()) } else { self.update(scene, Changed::Arrangement) }
    }

    /// Changes a light of the scene, by its index, from the next frame on.
    ///
    /// # Errors
    /// When there is no such light, a number is not finite, or, where the changed one needs another plan, as [`Renderer::update`].
    pub fn set_light(&mut self, scene: &mut Scene, index: usize, light: &Light) -> Result<(), Error> {
        let changed = self.world.set_light(index, light)?;
        if let Some(own) = scene.lights.get_mut(index) {
            own.clone_from(light);
        }
        if changed { Ok(()) } else { self.update(scene, Changed::Arrangement) }
    }

    /// Moves everything that nodes of the scene's motion carry to where a pose has it, from the next frame on: objects, the joints and shapes
    /// of deformed ones, and lights. Materials, lights and cells have the values that clips give them. The scene stays as it is.
    ///
    /// # Errors
    /// When a light of the pose needs other pipelines or maps than the light has at rest.
    pub fn pose(&mut self, scene: &Scene, pose: &Pose) -> Result<(), Error> {
        self.world.pose(&scene.motion, pose);
        let (materials, lights) = (Arc::clone(&self.world.pose.materials), Arc::clone(&self.world.pose.lights));
        for &index in &*materials {
            self.world.set_material(index, self.plan.materials.as_drawn(pose.material(scene, index)));
        }
        let cells = Arc::clone(&self.world.pose.cells);
        for &index in &*cells {
            if let Some(look) = pose.look(scene, index) {
                // A plan without looks, as for a view that counts, ignores them.
                self.world.set_look(index, &look, &self.plan.textures)?;
            }
        }
        for &index in &*lights {
            if !self.world.set_light(index, &pose.light(scene, index))? {
                let what = "its kind, whether it casts a shadow or has a range, and how wide a spot opens";
                let name = &scene.lights[index].name;
                return Err(
                    plan::PlanError::Change(format!("light {index} (`{name}`): {what} must stay in a clip")).into()
                );
            }
        }
        Ok(())
    }

    /// Draws the scene as it is now from the next frame on, whatever has changed: objects, lights, materials, textures, meshes. Uploads and the plan
    /// stay where they still serve; where another plan is needed, frames are made anew. Objects that a pose moved stand as at rest until the next
    /// pose.
    ///
    /// # Errors
    /// As [`Renderer::new`]; then frames stay as they were.
    pub fn update(&mut self, scene: &Scene, changed: Changed) -> Result<(), Error> {
        self.adopt(scene, &self.settings.clone(), changed)
    }

    /// Draws with other settings from the next frame on, and the scene as it is now, as [`Renderer::update`] does with [`Changed::Arrangement`].
    ///
    /// # Errors
    /// As [`Renderer::new`]; then frames stay as they were.
    pub fn change_settings(&mut self, scene: &Scene, settings: &Settings) -> Result<(), Error> {
        self.adopt(scene, settings, Changed::Arrangement)
    }

    fn adopt(&mut self, scene: &Scene, settings: &Settings, changed: Changed) -> Result<(), Error> {
        let plan = plan_for(&self.device, scene, settings)?;
        let keeps = changed == Changed::Arrangement;
        let uploaded = (keeps && plan.uploads_as(&self.plan)).then(|| Arc::clone(&self.scene));
        let serves = uploaded.is_some() && plan.has_structure_of(&self.plan);
        let rows = rows::table(&plan);
        let builder = RendererBuilder::new(&self.device, scene, settings, (plan, rows), uploaded)?;
        let halted = self.world.halted();
        let simulated = self.frame.simulation.as_ref().map(|own| own.missing);
        if serves {
            (self.world, self.plan) = builder.into_world();
            self.settings = settings.clone();
            self.shadow_cache = ShadowCache::default();
            self.posed = 0;
            self.cut();
            self.culling.iter_mut().for_each(CullingBuffers::forget);
            self.seen.iter_mut().for_each(VisibilityLookup::forget);
            self.frame.expose(&self.plan, &self.world);
        } else {
            *self = builder.finish(&[])?;
        }
        self.world.halt_after(halted);
        self.simulate(simulated.and_then(|own| own.simulation(&self.plan)))
    }

    /// Halts frames, from the next one on, after the first `lights` lights of [`FramePlan::light_numbers`](crate::plan::FramePlan::light_numbers), or
    /// after all if there are fewer, and before anything transparent is drawn: their picture shows the frame as lit so far. Shadow maps of other
    /// lights are not drawn. `None` gives whole frames again, bit-identical to frames that were never halted.
    pub fn halt_after(&mut self, lights: Option<usize>) {
        self.world.halt_after(lights);
    }

    /// Changes the exposure from the next frame on.
    ///
    /// # Errors
    /// When the value is not an EV100 from -100 to 100, or pictures are in nits.
    pub fn set_exposure(&mut self, ev100: f32) -> Result<(), Error> {
        let asked = SettingsPatch { exposure: Some(ev100), ..SettingsPatch::default() };
        asked.check().map_err(|error| plan::PlanError::Change(error.to_string()))?;
        if !self.plan.exposes {
            return Err(plan::PlanError::Change("light in nits has no exposure that could change".into()).into());
        }
        // Frames that are made anew have it as well.
        self.settings.exposure = Some(ev100);
        self.world.set_exposure(exposure_scale(ev100));
        self.frame.expose(&self.plan, &self.world);
        Ok(())
    }
}
