//! Maps of casters whose materials clips change.

use super::*;
use crate::scene::{AlphaMode, Brdf, Material};

#[test]
fn a_material_that_changes_has_the_maps_drawn_again_that_show_it() {
    let boxes = [(DVec3::ZERO, DVec3::ONE), (DVec3::X * 3.0, DVec3::ONE), (DVec3::X * 6.0, DVec3::ONE)];
    let mut scene = scene(&boxes, vec![sun(DVec3::NEG_Y), lamp(DVec3::Y * 4.0, None)]);
    let veil = Material { alpha_mode: AlphaMode::Blend, alpha: 0.5, ..samples::material(Brdf::Lambert) };
    scene.materials = vec![samples::material(Brdf::Lambert), samples::masked(), veil];
    scene.textures = samples::scene(vec![samples::masked()], Vec::new()).textures;
    for (index, object) in scene.objects.iter_mut().enumerate() {
        object.material = index;
    }
    let tinted = ShadowSettings { tinted: true, cascades: 1, ..ShadowSettings::default() };
    let (mut world, plan) = planned(&scene, tinted, &samples::device());
    let camera = Camera::looking_at(DVec3::new(0.0, 8.0, 20.0), DVec3::ZERO, DVec3::Y);
    let mut cache = ShadowCache::default();
    let mut redrawn = |world: &mut World| {
        world.refresh(&plan);
        let visible = Visible::of(world, &camera, &plan);
        let stale = cache.stale(world, plan.shadow.as_ref().expect("maps"), &camera, &visible);
        cache.keep(world, &camera, &visible, &stale);
        stale.len()
    };
    assert!(redrawn(&mut world) > 1, "at first there is nothing");
    assert_eq!(redrawn(&mut world), 0, "a still frame");
    for (index, is_shown) in [false, true, true].into_iter().enumerate() {
        let changed = Material { alpha: 0.25, ..world.materials[index].clone() };
        world.set_material(index, changed.clone());
        let count = redrawn(&mut world);
        assert!(if is_shown { count > 1 } else { count == 0 }, "material {index}: {count}");
        world.set_material(index, changed);
        assert_eq!(redrawn(&mut world), 0, "material {index} as it was");
    }
}
