// Reflection models word for word, as papers and textbooks have them: exact in real numbers, wrong or no number at all in single floats where
// highlights are sharpest or light and eye are opposite. brdf.wgsl's replacements for them, and the cost of these, are measured beside them:
// `--textbook on` draws with these, and the tests of the stress catalogue plant them and demand that they are found.
#define_import_path afterlight::textbook
#import afterlight::brdf::{lambert, schlick, smith_root, Surface, COOK_TORRANCE, PHONG, BLINN_PHONG, PI}

// As `reflect_light` of brdf.wgsl.
fn textbook_light(s: Surface, brdf: u32, light: vec3<f32>, n_dot_l: f32) -> vec3<f32> {
    switch brdf {
        case COOK_TORRANCE: { return textbook_cook_torrance(s, light, n_dot_l); }
        case PHONG: { return textbook_power(s, dot(reflect(-light, s.normal), s.view)); }
        case BLINN_PHONG: { return textbook_power(s, dot(s.normal, normalize(light + s.view))); }
        default: { return lambert(s); }
    }
}

// ANCHOR: difference
// 1 - NdotH^2 as a difference, which cancels where the lobe is sharpest, and a half vector without a guard.
fn textbook_cook_torrance(s: Surface, light: vec3<f32>, n_dot_l: f32) -> vec3<f32> {
    let half = normalize(light + s.view);
    let n_dot_h = dot(s.normal, half);
    let fresnel = schlick(s.specular, s.grazing, dot(s.view, half));
    let d = n_dot_h * n_dot_h * (s.alpha_squared - 1.0) + 1.0;
    let distribution = s.alpha_squared / (PI * d * d);
    let visibility = 0.5 / (n_dot_l * s.smith_v + s.n_dot_v * smith_root(n_dot_l, s.alpha_squared));
    return s.diffuse * (vec3(1.0) - fresnel) + fresnel * distribution * visibility;
// ANCHOR_END: difference
}

// The power of a cosine, which is rounded where the lobe is sharpest.
fn textbook_power(s: Surface, cosine: f32) -> vec3<f32> {
    return s.diffuse + s.specular * (pow(max(cosine, 0.0), s.shininess) * s.lobe_scale);
}
