//! Light from everywhere: two half-spheres, above and below the horizon.

use nalgebra::Vector3;

use super::brdf::Reflector;
use super::real::{Real, color};
use afterlight_scene::{Brdf, Environment};

/// Returns the ambient light that a surface reflects and lets through to the eye, in nits: by its base and by its lobe. `open` and `behind` are the shares that
/// other surfaces leave in front of it and behind it.
///
/// The base collects the half-spheres by the cosine, mean + tilt n.y, which is exact (Liu and Jordan 1963). The lobe is taken to do so
/// about the mirrored view. The base gets the light that the lobe leaves, so that together they never exceed the arriving light.
pub(super) fn ambient<R: Real>(
    reflector: &Reflector<R>,
    environment: &Environment,
    [open, behind]: [R; 2],
) -> [Vector3<R>; 2] {
    let (sky, ground): (Vector3<R>, Vector3<R>) = (color(environment.ambient), color(environment.ground()));
    let half = R::of(0.5);
    let (mean, tilt) = (sky * half + ground * half, sky * half - ground * half);
    // Not below zero where rounding makes a normal longer than 1.
    let collected = |up: R| (mean + tilt * up).map(|part| part.max(R::zero()));
    let Reflector { normal, view, .. } = reflector;
    let mirrored_up = R::of(2.0) * normal.dot(view) * normal.y - view.y;
    let share = lobe_share(reflector);
    let base = reflector.diffuse.component_mul(&share.map(|share| R::one() - share));
    let through = reflector.through.component_mul(&share.map(|share| R::one() - share));
    let through = through.component_mul(&collected(-normal.y)) * behind;
    let [base, lobe] = [base.component_mul(&collected(normal.y)), share.component_mul(&collected(mirrored_up))];
    let [base, lobe] = [base * open + through, lobe * open];
    let Some(fibres) = &reflector.fibres else { return [base, lobe] };
    // They are taken to collect the half-spheres as the base does.
    let scattered = fibres.scattered().component_mul(&collected(normal.y)) * open;
    [base * fibres.left(), lobe * fibres.left() + scattered]
}

/// Share of even light from everywhere that the lobe reflects: Karis's fit for GGX with Schlick's Fresnel ("Physically Based Shading on Mobile",
/// 2014), made for dielectrics: a white metal gets up to 0.2 less than GGX gives it. The Phong models have no such share: only their base reflects
/// ambient light.
fn lobe_share<R: Real>(reflector: &Reflector<R>) -> Vector3<R> {
    if reflector.brdf != Brdf::CookTorrance {
        return Vector3::zeros();
    }
    let (rough, smooth) = (reflector.roughness, R::one() - reflector.roughness);
    let number = R::of;
    let fit = |at_smooth: f64, at_rough: f64| number(at_smooth) * smooth + number(at_rough) * rough;
    // The fit is linear in roughness: each term by its values at roughness 0 and 1.
    let [x, y, z, w] = [fit(1.0, 0.0), fit(0.0425, 0.015), fit(1.04, 0.468), fit(-0.04, -0.018)];
    let a = (x * x).min((number(-9.28) * reflector.n_dot_v).exp2()) * x + y;
    let (scale, bias) = (z - number(1.04) * a, number(1.04) * a + w);
    reflector.even.map(|facing| (facing * scale + bias * reflector.grazing).max(R::zero()).min(R::one()))
}
