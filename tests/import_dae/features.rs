//! Axes, transforms, hierarchies, primitives, normals, cameras, spheres.

use super::*;
use glam::{DVec3, Vec3};

fn close(a: Vec3, b: Vec3) {
    assert!((a - b).length() < 1e-5, "{a} is not {b}");
}

/// Where the first vertex of the only mesh is.
fn first_position(scene: &SceneDescription) -> Vec3 {
    scene.meshes[0].positions[0]
}

fn corners(scene: &SceneDescription) -> Vec<[Vec3; 3]> {
    let of_mesh = |mesh: &comber::scene::description::MeshDescription| {
        let positions = mesh.positions.clone();
        mesh.triangles.iter().map(move |t| t.map(|index| positions[index as usize])).collect::<Vec<_>>()
    };
    scene.meshes.iter().flat_map(of_mesh).collect()
}

fn geometric_normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a).normalize()
}

#[test]
fn a_plain_triangle() {
    let text = document(&triangle(), &shown(""));
    let scene = parse(&text);
    assert_eq!(scene.name, "scene.dae");
    assert!(!scene.course_profile);
    let mesh = &scene.meshes[0];
    assert_eq!((mesh.name.as_str(), mesh.at), ("shown", At::Line(line_of(&text, "<triangles") as u64)));
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!((&mesh.triangles[..], mesh.normals.len()), (&[[0, 1, 2]][..], 0));
    assert_note(&scene, false, "no material is bound");
    assert_eq!(scene.materials[0].name, "(default)");
}

#[test]
fn axes_become_y_up_by_a_rotation() {
    let place = "<translate>1 2 3</translate>";
    let text = document(&triangle(), &shown(place));
    for (axis, expected) in [("Y_UP", [1.0, 2.0, 3.0]), ("Z_UP", [-1.0, 3.0, 2.0]), ("X_UP", [-2.0, 1.0, 3.0])] {
        let scene = parse(&text.replace("Y_UP", axis));
        assert_eq!(first_position(&scene), Vec3::from(expected), "{axis}");
        // A rotation keeps the handedness: the front stays the front.
        let front = if axis == "Z_UP" { Vec3::Y } else { Vec3::Z };
        close(geometric_normal(corners(&scene)[0]), front);
    }
    assert_eq!(first_position(&parse(&text.replace("<up_axis>Y_UP</up_axis>", ""))), Vec3::new(1.0, 2.0, 3.0));
    let error = refuse(text.replace("Y_UP", "W_UP").as_bytes());
    assert!(error.contains(":3:") && error.contains("W_UP") && error.contains("Z_UP"), "{error}");
}

#[test]
fn unit_and_version_are_noted() {
    let text = document(&triangle(), &shown(""));
    let scene = parse(&text.replace("meter=\"1\"", "meter=\"0.01\""));
    assert_note(&scene, false, "0.01 metres");
    assert_eq!(first_position(&scene), Vec3::ZERO);
    assert_note(&parse(&text.replace("1.4.1", "1.5.0")), true, "1.5.0");
}

#[test]
fn transforms_multiply_in_document_order() {
    for (transforms, expected) in [
        (
            "<translate>1 0 0</translate><rotate>0 0 1 90</rotate><scale>2 3 4</scale><translate>1 0 0</translate>",
            [1.0, 2.0, 0.0],
        ),
        ("<scale>2 2 2</scale><translate>1 0 0</translate>", [2.0, 0.0, 0.0]),
        ("<translate>1 0 0</translate><scale>2 2 2</scale>", [1.0, 0.0, 0.0]),
        (
            "<matrix>1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1</matrix><matrix>1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1</matrix>",
            [10.0, 12.0, 14.0],
        ),
        ("<rotate>0 0 0 0</rotate><rotate>1 0 0 90</rotate><translate>0 1 0</translate>", [0.0, 0.0, 1.0]),
        ("<lookat>1 2 3  5 2 3  0 1 0</lookat><translate>0 0.5 -2</translate>", [3.0, 2.5, 3.0]),
    ] {
        close(first_position(&parse(&document(&triangle(), &shown(transforms)))), Vec3::from(expected));
    }
}

#[test]
fn transforms_that_cannot_be_used_are_refused() {
    for (transforms, message) in [
        ("<skew>45 0 1 0 1 0 0</skew>", "skew"),
        ("<matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1</matrix>", "perspective"),
        ("<matrix>1 0 0</matrix>", "only 3 numbers"),
        ("<translate>1 2 3 4</translate>", "more than 3"),
        ("<rotate>0 0 0 90</rotate>", "0 0 0"),
        ("<lookat>1 1 1 1 1 1 0 1 0</lookat>", "no frame"),
        ("<lookat>0 0 0 0 1 0 0 1 0</lookat>", "no frame"),
        ("<scale>1 nan 1</scale>", "\"nan\""),
        ("<scale>1e200 1 1</scale><scale>1e200 1 1</scale>", "beyond the range"),
        ("<translate>0 1e300 0</translate>", "beyond the range"),
    ] {
        let error = refuse(document(&triangle(), &shown(&format!("\n{transforms}"))).as_bytes());
        assert!(error.contains(message), "{error}");
    }
}

#[test]
fn hierarchies_and_node_instances() {
    let library = "<library_nodes><node id=\"L\" name=\"leaf\"><translate>0 0 1</translate>\
                   <instance_geometry url=\"#g\"/></node></library_nodes>";
    let nodes = "<node><translate>1 0 0</translate><node><translate>0 1 0</translate><instance_node url=\"#L\"/></node>\
                 <instance_node url=\"#L\"/></node><node><instance_geometry url=\"#g\"/></node>";
    let scene = parse(&document(&format!("{library}{}", triangle()), nodes));
    let first: Vec<Vec3> = scene.meshes.iter().map(|mesh| mesh.positions[0]).collect();
    assert_eq!(first, [Vec3::new(1.0, 1.0, 1.0), Vec3::new(1.0, 0.0, 1.0), Vec3::ZERO]);
    assert_eq!(scene.meshes[0].name, "leaf");
}

#[test]
fn a_document_without_scene_shows_the_first_visual_scene() {
    let text = document(&triangle(), &shown(""));
    let scene = parse(&text.replace("<scene><instance_visual_scene url=\"#S\"/></scene>", ""));
    assert_eq!(scene.meshes.len(), 1);
    assert_note(&scene, false, "no <scene>");
}

#[test]
fn primitives_of_all_kinds() {
    let square = "0 0 0 1 0 0 1 1 0 0 1 0";
    let (a, b, c, d) = (Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y);
    let far = "<input semantic=\"VERTEX\" source=\"#v\" offset=\"2\"/><input semantic=\"TEXCOORD\" source=\"#x\" offset=\"3\"/>";
    for primitive in [
        format!("<triangles count=\"2\">{VERTEX}<p>0 1 2 0 2 3</p></triangles>"),
        format!("<triangles>{VERTEX}<p>0 1 <!-- between --> 2 0 2 3</p></triangles>"),
        format!("<triangles count=\"2\">{far}<p>9 9 0 9 9 9 1 9 9 9 2 9 9 9 0 9 9 9 2 9 9 9 3 9</p></triangles>"),
        format!("<polylist count=\"1\">{VERTEX}<vcount>4</vcount><p>0 1 2 3</p></polylist>"),
        format!("<polylist count=\"2\">{VERTEX}<vcount>3 3</vcount><p>0 1 2 0 2 3</p></polylist>"),
        format!("<polygons count=\"1\">{VERTEX}<p>0 1 2 3</p></polygons>"),
        format!("<polygons count=\"2\">{VERTEX}<p>0 1 2</p><p>0 2 3</p></polygons>"),
        format!("<trifans count=\"1\">{VERTEX}<p>0 1 2 3</p></trifans>"),
    ] {
        let scene = parse(&document(&geometry(square, "", &primitive), &shown("")));
        assert_eq!(corners(&scene), [[a, b, c], [a, c, d]], "{primitive}");
    }
    let strip = format!("<tristrips count=\"1\">{VERTEX}<p>0 1 3 2</p></tristrips>");
    let scene = parse(&document(&geometry(square, "", &strip), &shown("")));
    assert_eq!(corners(&scene), [[a, b, d], [d, b, c]]);
    for empty in ["<triangles count=\"0\"/>", "<polylist count=\"0\"/>", "<polygons count=\"0\"/>", ""] {
        assert!(parse(&document(&geometry(square, "", empty), &shown(""))).meshes.is_empty());
    }
    let lines = format!("<lines count=\"1\">{VERTEX}<p>0 1</p></lines>");
    let scene = parse(&document(&geometry(square, "", &lines), &shown("")));
    assert_note(&scene, true, "<lines>");
}

#[test]
fn accessors_with_offset_stride_and_padding() {
    let mesh = "<library_geometries><geometry id=\"g\"><mesh><source id=\"p\">\
        <float_array id=\"pa\" count=\"14\">7 7  9 0 0 0  9 1 0 0  9 0 1 0</float_array><technique_common>\
        <accessor source=\"#pa\" count=\"3\" offset=\"2\" stride=\"4\"><param type=\"float\"/><param name=\"X\"/>\
        <param name=\"Y\"/><param name=\"Z\"/></accessor></technique_common></source><vertices id=\"v\">\
        <input semantic=\"POSITION\" source=\"#p\"/></vertices><triangles count=\"1\">VERTEX<p>0 1 2</p></triangles>\
        </mesh></geometry></library_geometries>"
        .replace("VERTEX", VERTEX);
    let scene = parse(&document(&mesh, &shown("")));
    assert_eq!(scene.meshes[0].positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
}

#[test]
fn concave_polygons_are_not_fanned() {
    // An arrow head: its notch must stay empty.
    let primitive = format!("<polygons count=\"1\">{VERTEX}<p>0 1 2 3</p></polygons>");
    let scene = parse(&document(&geometry("0 0 0 2 -1 0 0 3 0 -2 -1 0", "", &primitive), &shown("")));
    let area: f32 = corners(&scene).iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).z / 2.0).sum();
    assert_eq!(area, 6.0);
    assert!(corners(&scene).iter().all(|triangle| geometric_normal(*triangle) == Vec3::Z));
    // Starting elsewhere, so that a fan would overlap itself.
    let primitive = format!("<polygons count=\"1\">{VERTEX}<p>1 2 3 0</p></polygons>");
    let scene = parse(&document(&geometry("0 0 0 2 -1 0 0 3 0 -2 -1 0", "", &primitive), &shown("")));
    assert!(corners(&scene).iter().all(|triangle| geometric_normal(*triangle) == Vec3::Z));
}

#[test]
fn holes_are_refused() {
    let primitive = format!("<polygons count=\"1\">{VERTEX}\n<ph><p>0 1 2</p><h>0 1 2</h></ph></polygons>");
    let text = document(&geometry(TRIANGLE, "", &primitive), &shown(""));
    let error = refuse(text.as_bytes());
    assert!(error.contains(&format!(":{}:", line_of(&text, "<ph>"))) && error.contains("holes"), "{error}");
}

#[test]
fn separately_indexed_normals_make_one_vertex_a_pair() {
    let square = "0 0 0 1 0 0 1 1 0 0 1 0";
    let primitive = format!("<triangles count=\"2\">{VERTEX}{NORMAL}<p>0 0 1 0 2 0 0 0 2 1 3 1</p></triangles>");
    let scene = parse(&document(&geometry(square, "0 0 2 0 3 0", &primitive), &shown("")));
    let mesh = &scene.meshes[0];
    assert_eq!((mesh.positions.len(), &mesh.triangles[..]), (5, &[[0, 1, 2], [0, 3, 4]][..]));
    assert_eq!(mesh.normals, [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::Y, Vec3::Y]);
    assert_eq!(mesh.positions[2], mesh.positions[3]);
}

#[test]
fn normals_of_vertices_share_their_index() {
    let shared = "<input semantic=\"POSITION\" source=\"#p\"/><input semantic=\"NORMAL\" source=\"#n\"/></vertices>";
    let plain =
        geometry(TRIANGLE, "0 0 1 0 1 0 1 0 0", &format!("<triangles count=\"1\">{VERTEX}<p>2 1 0</p></triangles>"));
    let scene =
        parse(&document(&plain.replace("<input semantic=\"POSITION\" source=\"#p\"/></vertices>", shared), &shown("")));
    assert_eq!(scene.meshes[0].normals, [Vec3::X, Vec3::Y, Vec3::Z]);
}

#[test]
fn normals_that_are_none_become_zero() {
    let primitive = format!("<triangles count=\"1\">{VERTEX}{NORMAL}<p>0 0 1 1 2 2</p></triangles>");
    let scene = parse(&document(&geometry(TRIANGLE, "0 0 0 NaN 0 1 0 1e999 0", &primitive), &shown("")));
    assert_eq!(scene.meshes[0].normals, [Vec3::ZERO; 3]);
}

#[test]
fn normals_take_the_inverse_transpose_and_mirrors_keep_the_front() {
    let primitive = format!("<triangles count=\"1\">{VERTEX}{NORMAL}<p>0 0 1 0 2 0</p></triangles>");
    let mesh = geometry("0 0 0 1 0 1 0 1 0", "-1 0 1", &primitive);
    for scale in ["1 1 4", "3 0.5 1", "-2 1 1", "1 1 -3", "-1 -1 -1"] {
        let scene = parse(&document(&mesh, &shown(&format!("<rotate>1 2 3 40</rotate><scale>{scale}</scale>"))));
        close(scene.meshes[0].normals[0], geometric_normal(corners(&scene)[0]));
    }
}

#[test]
fn degenerate_triangles_are_dropped_with_one_warning() {
    let primitive = format!("<triangles count=\"4\">{VERTEX}<p>0 1 2 0 0 1 0 1 3 0 1 2</p></triangles>");
    let polygons = format!("<polylist count=\"2\">{VERTEX}<vcount>2 0</vcount><p>0 1</p></polylist>");
    let text = document(&geometry("0 0 0 1 0 0 0 1 0 2 0 0", "", &format!("{primitive}{polygons}")), &shown(""));
    let scene = parse(&text);
    // The duplicate stays: it is a triangle like any other.
    assert_eq!(corners(&scene).len(), 2);
    let notes: Vec<_> = scene.notes.iter().filter(|note| note.warning).collect();
    assert_eq!(notes.len(), 1);
    let expected = format!(
        "4 triangles without area are left out; the first in the mesh at line {}",
        line_of(&text, "<triangles")
    );
    assert_eq!(notes[0].text, expected);
}

#[test]
fn cameras() {
    let camera = |lens: &str| {
        format!(
            "<library_cameras><camera id=\"c\" name=\"eye\"><optics><technique_common>{lens}</technique_common></optics></camera></library_cameras>"
        )
    };
    let node = "<node name=\"stand\"><translate>1 2 3</translate><instance_camera url=\"#c\"/></node>";
    let lens = "<perspective>\n<xfov>50</xfov><aspect_ratio>1.5</aspect_ratio></perspective>";
    let found = parse(&document(&camera(lens), node).replace("Y_UP", "Z_UP")).camera.unwrap();
    assert_eq!(
        (found.name.as_str(), found.xfov, found.yfov, found.aspect_ratio),
        ("stand", Some(50.0), None, Some(1.5))
    );
    assert_eq!(found.to_world.transform_point3(DVec3::ZERO), DVec3::new(-1.0, 3.0, 2.0));
    assert_eq!(found.to_world.transform_vector3(DVec3::NEG_Z), DVec3::NEG_Y);
    let found = parse(&document(&camera("<perspective><yfov>40</yfov></perspective>"), node)).camera.unwrap();
    assert_eq!((found.xfov, found.yfov, found.aspect_ratio), (None, Some(40.0), None));

    let scene = parse(&document(&camera("<orthographic><xmag>1</xmag></orthographic>"), node));
    assert!(scene.camera.is_none());
    assert_note(&scene, false, "eye is not a perspective camera");
    let scene = parse(&document(&camera(lens), &format!("{node}{}", node.replace("1 2 3", "9 9 9"))));
    assert_note(&scene, false, "2 cameras");
    assert_eq!(scene.camera.unwrap().to_world.w_axis.x, 1.0);
    for bad in ["0", "180", "-10", "nan", "1e999", "", "1 2"] {
        let lens = format!("<perspective>\n<xfov>{bad}</xfov></perspective>");
        let error = refuse(document(&camera(&lens), node).as_bytes());
        assert!(error.starts_with("folder/scene.dae:5:"), "{error}");
    }
}

fn sphere(profile: &str, radius: &str) -> String {
    let extra = extra(profile, &format!("<sphere>\n<radius>{radius}</radius></sphere>"));
    format!("<library_geometries><geometry id=\"g\">{extra}</geometry></library_geometries>")
}

#[test]
fn spheres_of_both_profiles() {
    for profile in ["CGL", "CMU462"] {
        let place = "<translate>1 2 3</translate><rotate>1 1 0 30</rotate><scale>2 -2 2</scale>";
        let scene = parse(&document(&sphere(profile, ".25"), &shown(place)));
        assert!(scene.course_profile);
        let sphere = &scene.spheres[0];
        assert_eq!((sphere.center, sphere.name.as_str()), (Vec3::new(1.0, 2.0, 3.0), "shown"));
        assert!((sphere.radius - 0.5).abs() < 1e-6);
    }
    let scene = parse(&document(&sphere("blender", ".25"), &shown("")));
    assert!(scene.spheres.is_empty() && !scene.course_profile);
    assert_note(&scene, true, "holds no <mesh>");
}

#[test]
fn spheres_that_are_none() {
    for (radius, place) in [
        ("0", ""),
        ("-1", ""),
        ("nan", ""),
        ("", ""),
        ("1", "<scale>1 2 1</scale>"),
        ("1", "<scale>0 0 0</scale>"),
        ("1", "<matrix>1 0.5 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix>"),
        ("1e300", ""),
        ("1e-300", ""),
    ] {
        refuse(document(&sphere("CGL", radius), &shown(place)).as_bytes());
    }
}
