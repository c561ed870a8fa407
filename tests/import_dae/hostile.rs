//! Documents that are broken or mean harm: a located error or a scene, soon, and nothing else.

use super::*;
use proptest::prelude::*;
use std::fmt::Write;
use std::time::{Duration, Instant};

/// Longest that any of these small documents may take, on a busy machine.
const SOON: Duration = Duration::from_secs(20);

/// A document that uses most of what the reader knows.
fn rich() -> String {
    let primitive = format!(
        "<polylist material=\"s\" count=\"2\">{VERTEX}{NORMAL}<vcount>4 3</vcount><p>0 0 1 0 2 0 3 0 0 0 1 0 3 0</p></polylist>"
    );
    let light = extra("CGL", "<area><color>1 1 1</color></area>");
    let libraries = format!(
        "{}{}<library_lights><light id=\"l\">{light}</light></library_lights>\
         <library_cameras><camera id=\"c\"><optics><technique_common><perspective><xfov>50</xfov></perspective>\
         </technique_common></optics></camera></library_cameras>\
         <library_nodes><node id=\"L\"><rotate>0 1 0 30</rotate><instance_light url=\"#l\"/></node></library_nodes>",
        material(&format!(
            "{}{}",
            profile("<phong/>"),
            extra("CGL", "<emission><radiance>1 2 3</radiance></emission>")
        )),
        geometry("0 0 0 2 -1 0 0 3 0 -2 -1 0", "0 0 1", &primitive),
    );
    document(
        &libraries,
        &format!("{}<node><instance_camera url=\"#c\"/><instance_node url=\"#L\"/></node>", painted("")),
    )
}

#[test]
fn what_is_no_collada_document() {
    for bytes in [
        &b""[..],
        b" \n\t ",
        b"\xef\xbb\xbf",
        b"not xml",
        b"<",
        b"<COLLADA",
        b"<COLLADA>",
        b"<COLLADA></collada>",
        b"<html></html>",
        b"<COLLADA/>",
        b"<COLLADA/><COLLADA/>",
        b"ply\nformat ascii 1.0\n",
        b"\0\0\0\0",
        b"<COLLADA>\xff\xfe</COLLADA>",
        b"\xff\xfe<\0C\0",
        b"<COLLADA>&unknown;</COLLADA>",
        b"<COLLADA a='1' a='2'/>",
        b"<x:COLLADA/>",
    ] {
        refuse(bytes);
    }
    let error = refuse(b"<COLLADA>\n<a>\n caf\xe9</a></COLLADA>");
    assert!(error.contains(":3:5: ") && error.contains("UTF-8"), "{error}");
}

#[test]
fn truncation_at_each_percent() {
    let text = rich();
    parse(&text);
    let closed = text.trim_end().len();
    for percent in 0..100 {
        refuse(&text.as_bytes()[..closed * percent / 100]);
    }
    for length in 0..closed {
        refuse(&text.as_bytes()[..length]);
    }
}

#[test]
fn counts_that_lie() {
    let text = rich();
    for (from, to) in [
        ("count=\"12\"", "count=\"999999999999\""),
        ("count=\"12\"", "count=\"11\""),
        ("count=\"12\"", "count=\"-12\""),
        ("count=\"12\"", "count=\"99999999999999999999999999\""),
        ("count=\"4\"", "count=\"5\""),
        ("count=\"4\"", "count=\"18446744073709551615\""),
        ("count=\"4\" stride=\"3\"", "count=\"4\" stride=\"0\""),
        ("count=\"4\" stride=\"3\"", "count=\"4\" stride=\"2\""),
        ("count=\"4\" stride=\"3\"", "count=\"4\" stride=\"18446744073709551615\""),
        ("count=\"4\" stride=\"3\"", "count=\"4\" offset=\"18446744073709551615\" stride=\"3\""),
        ("count=\"2\">", "count=\"999999999999\">"),
        ("count=\"2\">", "count=\"1\">"),
        ("<vcount>4 3", "<vcount>4 4"),
        ("<vcount>4 3", "<vcount>4"),
        ("<vcount>4 3", "<vcount>4294967295 4294967295"),
        ("<vcount>4 3", "<vcount>4 -3"),
        ("<vcount>4 3</vcount>", ""),
        ("source=\"#v\" offset=\"0\"", "source=\"#v\" offset=\"4294967295\""),
        ("source=\"#v\" offset=\"0\"", "source=\"#v\" offset=\"7\""),
    ] {
        assert!(text.contains(from), "{from}");
        let error = refuse(text.replacen(from, to, 1).as_bytes());
        assert!(error.len() < 500, "{error}");
    }
}

#[test]
fn indices_that_point_nowhere() {
    let text = rich().replace("<p>", "<p>\n");
    let list = "0 0 1 0 2 0 3 0 0 0 1 0 3 0";
    let line = line_of(&text, list);
    for (bad, column, message) in [
        ("0 0 1 0 2 0 3 0 0 0 1 0 4 0", 25, "position index 4 is out of range; expected 0 to 3"),
        ("0 0 1 0 2 0 3 0 0 0 1 0 3 1", 27, "normal index 1 is out of range; expected 0 to 0"),
        ("0 0 1 0 -2 0 3 0 0 0 1 0 3 0", 9, "\"-2\""),
        ("0 0 1 0 2 0 3 0 0 0 1 0 4294967295 0", 25, "out of range"),
        ("0 0 1 0 2 0 3 0 0 0 1 0 4294967296 0", 25, "whole number"),
        ("0 0 1 0 2 0 3 0 0 0 1 x 3 0", 23, "\"x\""),
    ] {
        let error = refuse(text.replace(list, bad).as_bytes());
        assert!(error.contains(&format!(":{line}:{column}: ")) && error.contains(message), "{error}");
    }
    for (bad, message) in
        [("0 0 1 0 2 0 3 0 0 0 1 0 3", "multiple of 2"), ("0 0 1 0", "adds up to 7"), ("", "adds up to 7")]
    {
        let error = refuse(text.replace(list, bad).as_bytes());
        assert!(error.contains(message), "{error}");
    }
}

#[test]
fn coordinates_that_are_no_numbers() {
    let text = rich();
    for bad in ["nan", "-inf", "1e999", "-1e999", "1.#QNAN", "0x10", "1,5", "--1", "∞"] {
        let broken = text.replace("0 0 0 2 -1 0", &format!("0 0 0 2\n {bad} 0"));
        let line = line_of(&broken, &format!(" {bad} 0"));
        let error = refuse(broken.as_bytes());
        assert!(error.contains(&format!(":{line}:2: ")) && error.contains(bad), "{error}");
    }
    // Finite in the file, but beyond single precision.
    refuse(text.replace("0 0 0 2 -1 0", "0 0 0 2 1e39 0").as_bytes());
    // So small that nothing is left: no area, no crash.
    parse(&text.replace("0 0 0 2 -1 0 0 3 0 -2 -1 0", "0 0 0 1e-320 0 0 0 1e-320 0 1e-320 1e-320 0"));
}

#[test]
fn references_that_lead_nowhere() {
    let text = rich();
    for (from, to) in [
        ("url=\"#g\"", "url=\"#nowhere\""),
        ("url=\"#g\"", "url=\"#m\""),
        ("url=\"#g\"", "url=\"g\""),
        ("url=\"#g\"", "url=\"other.dae#g\""),
        ("url=\"#g\"", ""),
        ("url=\"#S\"", "url=\"#N\""),
        ("url=\"#c\"", "url=\"#\""),
        ("url=\"#l\"", "url=\"#c\""),
        ("url=\"#L\"", "url=\"#S\""),
        ("target=\"#m\"", "target=\"#e\""),
        ("source=\"#v\"", "source=\"#p\""),
        ("source=\"#p\"", "source=\"#v\""),
        ("source=\"#pa\"", "source=\"#p\""),
    ] {
        assert!(text.contains(from), "{from}");
        refuse(text.replacen(from, to, 1).as_bytes());
    }
    let long = refuse(text.replace("url=\"#g\"", &format!("url=\"#{}\"", "x".repeat(50_000))).as_bytes());
    assert!(long.len() < 300, "{long}");
}

#[test]
fn ids_used_twice() {
    // Between kinds an id may repeat; of one kind it may as long as nothing refers to it.
    let text = rich();
    parse(&text.replace("id=\"c\"", "id=\"g\"").replace("url=\"#c\"", "url=\"#g\""));
    let twice = text.replace("<library_nodes>", "<library_nodes><node id=\"N\"/><node id=\"N\"/>");
    parse(&twice);
    let error = refuse(text.replace("<library_nodes>", "<library_nodes>\n<node id=\"L\"/>").as_bytes());
    assert!(error.contains("two <node> elements have the id \"L\": lines"), "{error}");
}

#[test]
fn node_cycles() {
    for (nodes, library) in [
        ("<node id=\"a\"><instance_node url=\"#a\"/></node>", ""),
        ("<instance_node url=\"#a\"/>", "<node id=\"a\"><node id=\"b\"><instance_node url=\"#a\"/></node></node>"),
        (
            "<node><instance_node url=\"#a\"/></node>",
            "<node id=\"a\"><instance_node url=\"#b\"/></node><node id=\"b\"><instance_node url=\"#a\"/></node>",
        ),
    ] {
        let error = refuse(document(&format!("<library_nodes>{library}</library_nodes>"), nodes).as_bytes());
        assert!(error.contains("contains itself"), "{error}");
    }
}

#[test]
fn a_million_nested_elements() {
    let start = Instant::now();
    for tag in ["node", "a", "COLLADA"] {
        let deep = format!("<COLLADA>\n{}", format!("<{tag}>").repeat(1_000_000));
        let error = refuse(deep.as_bytes());
        assert!(error.contains("nested more than 1024 deep"), "{error}");
        let closed = format!("{deep}{}</COLLADA>", format!("</{tag}>").repeat(1_000_000));
        assert!(refuse(closed.as_bytes()).contains("nested"));
    }
    assert!(start.elapsed() < SOON);
}

#[test]
fn a_long_chain_of_instances() {
    let mut library = String::new();
    for i in 0..100_000 {
        write!(library, "<node id=\"n{i}\"><instance_node url=\"#n{}\"/></node>", i + 1).unwrap();
    }
    let text = document(
        &format!("<library_nodes>{library}<node id=\"n100000\"/></library_nodes>"),
        "<node><instance_node url=\"#n0\"/></node>",
    );
    assert!(refuse(text.as_bytes()).contains("nodes are nested more than 1024 deep"));
}

/// Nodes of which each holds the next ten times, the last holding `leaf`.
fn fan_out(levels: usize, leaf: &str) -> String {
    let mut library = format!("<node id=\"n0\">{leaf}</node>");
    for level in 1..=levels {
        let instances = format!("<instance_node url=\"#n{}\"/>", level - 1).repeat(10);
        write!(library, "<node id=\"n{level}\">{instances}</node>").unwrap();
    }
    let light =
        "<library_lights><light id=\"l\"><technique_common><point/></technique_common></light></library_lights>";
    document(
        &format!("<library_nodes>{library}</library_nodes>{}{light}", triangle()),
        &format!("<node><instance_node url=\"#n{levels}\"/></node>"),
    )
}

#[test]
fn exponential_fan_out() {
    let start = Instant::now();
    let geometry = "<instance_geometry url=\"#g\"/>";
    for (leaf, message) in [("", "elements"), (geometry, "meshes"), ("<instance_light url=\"#l\"/>", "lights")] {
        let error = refuse(fan_out(30, leaf).as_bytes());
        assert!(error.contains("more than") && error.contains(message), "{error}");
    }
    assert_eq!(parse(&fan_out(3, geometry)).meshes.len(), 1000);
    assert!(start.elapsed() < SOON);
}

#[test]
fn instanced_triangles_are_counted() {
    let many = format!("<triangles count=\"10000\">{VERTEX}<p>{}</p></triangles>", "0 1 2 ".repeat(10_000));
    let text = fan_out(5, "<instance_geometry url=\"#g\"/>").replace(&triangle(), &geometry(TRIANGLE, "", &many));
    let error = refuse(text.as_bytes());
    assert!(error.contains("triangles"), "{error}");
}

#[test]
fn entities_are_not_expanded() {
    let laughs =
        "<!DOCTYPE COLLADA [<!ENTITY a \"ha\"><!ENTITY b \"&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;\">]>\n<COLLADA>&b;</COLLADA>";
    let error = refuse(laughs.as_bytes());
    assert!(error.contains("document type declaration"), "{error}");
    refuse(b"<!DOCTYPE COLLADA SYSTEM \"file:///etc/passwd\"><COLLADA/>");
}

#[test]
fn many_attributes_namespaces_and_long_tags() {
    let attributes: String = (0..50_000).map(|i| format!(" a{i}=\"\"")).collect();
    refuse(format!("<COLLADA{}/>", &attributes[..60_000].trim_end_matches(|c| c != ' ')).as_bytes());
    refuse(format!("<COLLADA{attributes}/>").as_bytes());
    let namespaces: String = (0..1000).map(|i| format!("<a xmlns:n{i}=\"u{i}\">")).collect();
    refuse(format!("<COLLADA>{namespaces}").as_bytes());
}

#[test]
fn tortuous_polygons_end() {
    let start = Instant::now();
    // A comb of many teeth, as one polygon: concave, and simple.
    let teeth = 3000;
    let mut positions = String::new();
    for i in 0..teeth {
        write!(positions, "{i} {} 0 ", if i % 2 == 0 { 1 } else { 5 }).unwrap();
    }
    write!(positions, "{} 0 0 0 0 0", teeth - 1).unwrap();
    let indices: Vec<String> = (0..teeth + 2).map(|i| i.to_string()).collect();
    let polygon = format!("<p>{}</p>", indices.join(" "));
    let one = format!("<polygons count=\"1\">{VERTEX}{polygon}</polygons>");
    let scene = parse(&document(&geometry(&positions, "", &one), &shown("")));
    assert_eq!(scene.meshes[0].triangles.len(), teeth as usize);
    // Ever more of them run into the limit.
    let many = format!("<polygons count=\"2000\">{VERTEX}{}</polygons>", polygon.repeat(2000));
    let error = refuse(document(&geometry(&positions, "", &many), &shown("")).as_bytes());
    assert!(error.contains("concave polygons"), "{error}");
    assert!(start.elapsed() < SOON, "{:?}", start.elapsed());
}

#[test]
fn a_large_mesh_is_read_quickly() {
    let (mut positions, mut indices) = (String::new(), String::new());
    for i in 0..300_000 {
        write!(positions, "{} {} {} ", f64::from(i) * 0.001, f64::from(i % 2) * 0.37, f64::from(i % 3) * 1.7).unwrap();
    }
    for i in 0..299_998 {
        write!(indices, "{i} 0 {} 0 {} 0 ", i + 1, i + 2).unwrap();
    }
    let primitive = format!("<triangles>{VERTEX}{NORMAL}<p>{indices}</p></triangles>");
    let text = document(&geometry(&positions, "0 1 0", &primitive), &shown(""));
    let start = Instant::now();
    let scene = parse(&text);
    assert!(start.elapsed() < SOON, "{:?}", start.elapsed());
    assert_eq!((scene.meshes[0].positions.len(), scene.meshes[0].triangles.len()), (300_000, 299_998));
}

/// What can happen to a document on its way.
#[derive(Clone, Debug)]
enum Damage {
    Flip(usize, u8),
    Delete(usize, usize),
    Truncate(usize),
    Repeat(usize, usize),
    Number(usize, usize),
}

const NUMBERS: [&str; 12] =
    ["", "-1", "0", "nan", "1e999", "1e308", "-1e-320", "4294967296", "99999999999999999999", "1.5", "x", "3"];

fn damage() -> impl Strategy<Value = Damage> {
    prop_oneof![
        (any::<usize>(), any::<u8>()).prop_map(|(at, byte)| Damage::Flip(at, byte)),
        (any::<usize>(), 1..40_usize).prop_map(|(at, length)| Damage::Delete(at, length)),
        any::<usize>().prop_map(Damage::Truncate),
        (any::<usize>(), 1..400_usize).prop_map(|(at, length)| Damage::Repeat(at, length)),
        (any::<usize>(), 0..NUMBERS.len()).prop_map(|(which, number)| Damage::Number(which, number)),
    ]
}

/// The byte ranges that are runs of digits.
fn numbers(bytes: &[u8]) -> Vec<std::ops::Range<usize>> {
    let mut runs: Vec<std::ops::Range<usize>> = Vec::new();
    for at in (0..bytes.len()).filter(|at| bytes[*at].is_ascii_digit()) {
        match runs.last_mut() {
            Some(run) if run.end == at => run.end += 1,
            _ => runs.push(at..at + 1),
        }
    }
    runs
}

fn apply(bytes: &mut Vec<u8>, damage: &Damage) {
    if bytes.is_empty() {
        return;
    }
    let range = |at: usize, length: usize| {
        let start = at % bytes.len();
        start..(start + length).min(bytes.len())
    };
    match *damage {
        Damage::Flip(at, byte) => {
            let at = at % bytes.len();
            bytes[at] ^= byte;
        }
        Damage::Delete(at, length) => drop(bytes.drain(range(at, length))),
        Damage::Truncate(at) => bytes.truncate(at % bytes.len()),
        Damage::Repeat(at, length) => {
            let chunk = bytes[range(at, length)].to_vec();
            let at = at % bytes.len();
            drop(bytes.splice(at..at, chunk));
        }
        Damage::Number(which, number) => {
            let runs = numbers(bytes);
            if !runs.is_empty() {
                drop(bytes.splice(runs[which % runs.len()].clone(), NUMBERS[number].bytes()));
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damage_ends_in_a_scene_or_a_located_error(damages in prop::collection::vec(damage(), 1..6)) {
        let mut bytes = rich().into_bytes();
        damages.iter().for_each(|damage| apply(&mut bytes, damage));
        let start = Instant::now();
        match try_parse(&bytes) {
            Err(error) => {
                prop_assert!(matches!(error, Error::Import { at: At::LineColumn(..), .. }), "{}", error);
                prop_assert!(error.to_string().len() < 2000);
            }
            Ok(scene) => {
                for mesh in &scene.meshes {
                    prop_assert!(mesh.triangles.iter().flatten().all(|index| (*index as usize) < mesh.positions.len()));
                    prop_assert!(mesh.positions.iter().chain(&mesh.normals).all(|vector| vector.is_finite()));
                    prop_assert!(mesh.normals.is_empty() || mesh.normals.len() == mesh.positions.len());
                    prop_assert!((mesh.material as usize) < scene.materials.len());
                }
                prop_assert!(scene.spheres.iter().all(|sphere| sphere.radius > 0.0 && sphere.radius.is_finite()));
            }
        }
        prop_assert!(start.elapsed() < SOON);
    }
}
