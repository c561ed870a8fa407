//! Lights, emissive meshes, and lamps that a file holds twice.

use super::*;
use glam::Vec3;

/// An area light `l` with a point light as its common form.
fn area_light(profile: &str) -> String {
    let extra = extra(profile, "<area><color>10 9 8</color></area>");
    format!(
        "<library_lights><light id=\"l\" name=\"bulb\"><technique_common><point/></technique_common>{extra}</light></library_lights>"
    )
}

const PLACED: &str = "<node name=\"lamp\"><translate>0 2 0</translate><rotate>1 0 0 -90</rotate><scale>0.6 0.8 1</scale>\
                      <instance_light url=\"#l\"/></node>";

/// A material that emits.
fn glow() -> String {
    material(&extra("CGL", "<emission><radiance>10 10 10</radiance></emission>"))
}

/// A horizontal 0.8 × 0.6 quad at y = 2 that faces down, as its normals do; `order` winds its triangles.
fn quad(order: &str) -> String {
    let primitive = format!("<triangles material=\"s\" count=\"2\">{VERTEX}{NORMAL}<p>{order}</p></triangles>");
    geometry("-0.4 2 -0.3 0.4 2 -0.3 0.4 2 0.3 -0.4 2 0.3", "0 -1 0", &primitive)
}

const DOWN: &str = "0 0 1 0 2 0 0 0 2 0 3 0";
const UP: &str = "0 0 2 0 1 0 0 0 3 0 2 0";

fn front(scene: &SceneDescription) -> Vec3 {
    let mesh = &scene.meshes[0];
    let [a, b, c] = mesh.triangles[0].map(|index| mesh.positions[index as usize]);
    (b - a).cross(c - a).normalize()
}

#[test]
fn area_lights_of_both_profiles() {
    for profile in ["CGL", "CMU462"] {
        let scene = parse(&document(&area_light(profile), PLACED));
        let light = &scene.area_lights[0];
        assert!(scene.course_profile && scene.notes.is_empty());
        assert_eq!((light.name.as_str(), light.center), ("lamp", Vec3::new(0.0, 2.0, 0.0)));
        assert!((light.side_u - Vec3::new(0.6, 0.0, 0.0)).length() < 1e-6);
        assert!((light.side_v - Vec3::new(0.0, 0.0, -0.8)).length() < 1e-6);
        assert!((light.direction - Vec3::NEG_Y).length() < 1e-6);
        assert_eq!(light.radiance, Vec3::new(10.0, 9.0, 8.0));
    }
}

#[test]
fn area_lights_that_are_none() {
    let text = document(&area_light("CGL"), PLACED);
    for (from, to) in [
        ("0.6 0.8 1", "0.6 0 1"),
        ("0.6 0.8 1", "0.6 0.8 0"),
        ("0.6 0.8 1", "1e60 1 1"),
        ("10 9 8", "10 9"),
        ("10 9 8", "10 9 -8"),
        ("<color>10 9 8</color>", ""),
        ("url=\"#l\"", "url=\"#x\""),
    ] {
        refuse(text.replace(from, to).as_bytes());
    }
}

#[test]
fn lights_without_extent_are_left_out_with_a_warning() {
    for kind in ["point", "spot", "directional", "ambient"] {
        let light = format!(
            "<library_lights><light id=\"l\" name=\"bulb\"><technique_common><{kind}><color>1 1 1</color></{kind}></technique_common></light></library_lights>"
        );
        let text = document(&light, PLACED);
        let scene = parse(&text);
        assert!(scene.area_lights.is_empty());
        let line = line_of(&text, "<instance_light");
        assert_note(&scene, true, &format!("line {line}: light bulb (node lamp) is a {kind} light"));
    }
}

#[test]
fn an_emissive_quad_in_an_area_light_is_the_same_lamp() {
    for order in [DOWN, UP] {
        let text =
            document(&format!("{}{}{}", area_light("CGL"), glow(), quad(order)), &format!("{PLACED}{}", painted("")));
        let scene = parse(&text);
        assert_eq!((scene.meshes.len(), scene.area_lights.len()), (0, 1));
        assert_note(&scene, false, "the emissive quad shown");
        assert_note(&scene, false, "in the area light lamp");
    }
}

#[test]
fn other_quads_stay() {
    let paint = material(&profile("<phong><diffuse><color>1 1 1</color></diffuse></phong>"));
    for (material, place) in [
        (glow(), "<translate>0 -0.01 0</translate>"),
        (glow(), "<translate>0.7 0 0</translate>"),
        (glow(), "<scale>3 1 3</scale>"),
        (glow(), "<rotate>1 0 0 90</rotate>"),
        (paint, ""),
    ] {
        let text =
            document(&format!("{}{material}{}", area_light("CGL"), quad(DOWN)), &format!("{PLACED}{}", painted(place)));
        let scene = parse(&text);
        assert_eq!((scene.meshes.len(), scene.area_lights.len()), (1, 1), "{place}");
    }
}

#[test]
fn a_point_light_in_an_emissive_quad_is_the_same_lamp() {
    let light = area_light("none");
    for (place, same) in
        [("", true), ("<translate>0 0.01 0</translate>", false), ("<translate>1 0 0</translate>", false)]
    {
        let text = document(&format!("{light}{}{}", glow(), quad(DOWN)), &format!("{PLACED}{}", painted(place)));
        let scene = parse(&text);
        assert_eq!((scene.meshes.len(), scene.area_lights.len()), (1, 0));
        match same {
            true => assert_note(&scene, false, "stands in the emissive quad shown"),
            false => assert_note(&scene, true, "is a point light"),
        }
    }
}

#[test]
fn emissive_meshes_face_where_their_normals_point() {
    for (order, noted) in [(DOWN, false), (UP, true)] {
        for mirror in ["", "<scale>-1 1 1</scale>", "<scale>1 1 -2</scale>"] {
            let scene = parse(&document(&format!("{}{}", glow(), quad(order)), &painted(mirror)));
            assert!((front(&scene) - Vec3::NEG_Y).length() < 1e-6, "{order} {mirror}");
            assert_eq!(scene.notes.iter().any(|note| note.text.contains("is turned")), noted);
        }
    }
    // Without normals, and without emission, the winding stands.
    let bare = quad(UP).replace(NORMAL, "<input semantic=\"TEXCOORD\" source=\"#n\" offset=\"1\"/>");
    assert_eq!(front(&parse(&document(&format!("{}{bare}", glow()), &painted("")))), Vec3::Y);
    assert_eq!(front(&parse(&document(&quad(UP), &shown("")))), Vec3::Y);
}
