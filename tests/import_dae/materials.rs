//! Effects of the common profile and of the course's, and how they are bound.

use super::*;
use comber::scene::description::{MaterialDescription, Surface};
use glam::Vec3;

fn bound_triangle() -> String {
    geometry(TRIANGLE, "", &format!("<triangles material=\"s\" count=\"1\">{VERTEX}<p>0 1 2</p></triangles>"))
}

fn with_effect(effect: &str) -> String {
    document(&format!("{}{}", material(effect), bound_triangle()), &painted(""))
}

fn read(effect: &str) -> MaterialDescription {
    let scene = parse(&with_effect(effect));
    assert_eq!(scene.meshes[0].material, 0);
    scene.materials[0].clone()
}

fn diffuse(albedo: [f32; 3]) -> Surface {
    Surface::Diffuse { albedo: Vec3::from(albedo) }
}

#[test]
fn common_shaders() {
    for shader in ["phong", "lambert", "blinn"] {
        let text = profile(&format!("<{shader}><diffuse><color>0.1 0.2 0.3 1</color></diffuse></{shader}>"));
        let material = read(&text);
        assert_eq!((material.name.as_str(), material.at), ("paint", At::Line(4)));
        assert_eq!((material.surface, material.emission), (diffuse([0.1, 0.2, 0.3]), Vec3::ZERO));
    }
    let constant = read(&profile("<constant><emission><color>1 2 3</color></emission></constant>"));
    assert_eq!((constant.surface, constant.emission), (diffuse([0.0; 3]), Vec3::new(1.0, 2.0, 3.0)));
    let lit = read(&profile(
        "<phong><emission><color>1 0 0 1</color></emission><diffuse><color>0.5 0.5 0.5 1</color></diffuse></phong>",
    ));
    assert_eq!((lit.surface, lit.emission), (diffuse([0.5; 3]), Vec3::X));
}

#[test]
fn colors_by_parameter() {
    let parameter = "<newparam sid=\"tint\"><float4>0.1 0.2 0.3 1</float4></newparam>";
    let shader = "<lambert><diffuse><param ref=\"tint\"/></diffuse></lambert>";
    let text = profile(shader).replace("<technique", &format!("{parameter}<technique"));
    assert_eq!(read(&text).surface, diffuse([0.1, 0.2, 0.3]));
    let error = refuse(with_effect(&text.replace("sid=\"tint\"", "sid=\"hue\"")).as_bytes());
    assert!(error.contains("no parameter \"tint\""), "{error}");
}

#[test]
fn textures_become_grey_with_a_warning() {
    let text = with_effect(&profile("<phong>\n<diffuse><texture texture=\"t\" texcoord=\"uv\"/></diffuse></phong>"));
    let scene = parse(&text);
    assert_eq!(scene.materials[0].surface, diffuse([0.5; 3]));
    assert_note(&scene, true, &format!("line {}: material paint has a texture", line_of(&text, "<texture")));
}

#[test]
fn course_surfaces_under_both_profiles() {
    let one = Vec3::ONE;
    for name in ["CGL", "CMU462"] {
        let read = |content: &str| read(&format!("{}{}", profile("<phong/>"), extra(name, content)));
        let emission = read("<emission><radiance>5 6 7</radiance></emission>");
        assert_eq!((emission.surface, emission.emission), (diffuse([0.0; 3]), Vec3::new(5.0, 6.0, 7.0)));
        let mirror = read("<mirror><reflectance>1 1 1</reflectance></mirror>");
        assert_eq!(mirror.surface, Surface::Mirror { reflectance: one });
        let glass = "<glass><reflectance>1 1 1</reflectance><transmittance>1 1 1</transmittance>\
                     <roughness>0</roughness><ior>1.45</ior></glass>";
        assert_eq!(read(glass).surface, Surface::Glass { reflectance: one, transmittance: one, ior: 1.45 });
        let water =
            "<refraction><transmittance>1 1 1</transmittance><roughness>0</roughness><ior>1.33</ior></refraction>";
        assert_eq!(read(water).surface, Surface::Refraction { transmittance: one, ior: 1.33 });
        for roughness in ["alpha", "roughness"] {
            let gold = format!("<microfacet><{roughness}>0.05</{roughness}><eta>1 2 3</eta><k>4 5 6</k></microfacet>");
            let (eta, k) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0));
            assert_eq!(read(&gold).surface, Surface::Microfacet { alpha: 0.05, eta, k });
        }
    }
    // Another program's extra changes nothing.
    let other = format!("{}{}", profile("<phong/>"), extra("blender", "<mirror/>"));
    assert_eq!(read(&other).surface, diffuse([0.0; 3]));
}

#[test]
fn what_is_not_modelled_is_named() {
    let rough = "<glass>\n<reflectance>1 1 1</reflectance><transmittance>1 1 1</transmittance>\
                 <roughness>0.5</roughness><ior>1.45</ior></glass>";
    assert_note(&parse(&with_effect(&extra("CGL", rough))), true, "rough <glass>");
    assert_note(&parse(&with_effect(&extra("CGL", "<glossy/>"))), true, "<glossy>");
    let scene = parse(&with_effect("<profile_GLSL/>"));
    assert_note(&scene, true, "no phong");
    assert_eq!(scene.materials[0].surface, diffuse([0.5; 3]));
}

#[test]
fn surfaces_with_missing_or_impossible_values_are_refused() {
    for content in [
        "<mirror/>",
        "<mirror><reflectance>1 1</reflectance></mirror>",
        "<mirror><reflectance>1 1 1 1 1</reflectance></mirror>",
        "<mirror><reflectance>1 -1 1</reflectance></mirror>",
        "<mirror><reflectance>1 1e39 1</reflectance></mirror>",
        "<mirror><reflectance>1 red 1</reflectance></mirror>",
        "<emission><radiance>nan 1 1</radiance></emission>",
        "<refraction><transmittance>1 1 1</transmittance></refraction>",
        "<refraction><transmittance>1 1 1</transmittance><ior>0</ior></refraction>",
        "<glass><reflectance>1 1 1</reflectance><ior>1</ior></glass>",
        "<microfacet><alpha>-1</alpha><eta>1 1 1</eta><k>1 1 1</k></microfacet>",
    ] {
        refuse(with_effect(&extra("CGL", &format!("\n{content}"))).as_bytes());
    }
}

#[test]
fn symbols_are_bound_to_targets() {
    let paint = material(&profile("<phong><diffuse><color>1 0 0</color></diffuse></phong>"));
    // No symbol on the mesh: the first binding. Another symbol: none.
    for (mesh, is_painted) in
        [(triangle(), true), (bound_triangle(), true), (bound_triangle().replace("\"s\"", "\"z\""), false)]
    {
        let scene = parse(&document(&format!("{paint}{mesh}"), &painted("")));
        let material = &scene.materials[scene.meshes[0].material as usize];
        assert_eq!(material.name == "paint", is_painted);
        assert_eq!(material.surface == diffuse([1.0, 0.0, 0.0]), is_painted);
        if !is_painted {
            assert_note(&scene, false, "no material is bound to \"z\"");
        }
    }
    for (from, to) in
        [("target=\"#m\"", "target=\"#x\""), ("url=\"#e\"", "url=\"#x\""), ("target=\"#m\"", "target=\"m\"")]
    {
        refuse(document(&format!("{paint}{}", bound_triangle()), &painted("")).replace(from, to).as_bytes());
    }
}
