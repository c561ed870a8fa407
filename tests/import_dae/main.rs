//! COLLADA documents, good and bad, through `comber::import::dae::parse`.

mod course;
mod features;
mod hostile;
mod lamps;
mod materials;

use comber::error::{At, Error, Note};
use comber::scene::description::SceneDescription;
use std::path::Path;

/// A document with libraries and the content of its visual scene.
fn document(libraries: &str, nodes: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n\
         <COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\n\
         <asset><unit meter=\"1\"/><up_axis>Y_UP</up_axis></asset>\n\
         {libraries}\n\
         <library_visual_scenes><visual_scene id=\"S\">\n{nodes}\n</visual_scene></library_visual_scenes>\n\
         <scene><instance_visual_scene url=\"#S\"/></scene>\n\
         </COLLADA>\n"
    )
}

/// A geometry `g` with positions (and normals, unless empty) and a primitive.
fn geometry(positions: &str, normals: &str, primitive: &str) -> String {
    let source = |id: &str, values: &str| {
        let count = values.split_whitespace().count();
        format!(
            "<source id=\"{id}\"><float_array id=\"{id}a\" count=\"{count}\">{values}</float_array><technique_common>\
             <accessor source=\"#{id}a\" count=\"{}\" stride=\"3\"><param name=\"X\"/><param name=\"Y\"/>\
             <param name=\"Z\"/></accessor></technique_common></source>\n",
            count / 3
        )
    };
    let normals = if normals.is_empty() { String::new() } else { source("n", normals) };
    format!(
        "<library_geometries><geometry id=\"g\" name=\"shape\"><mesh>\n{}{normals}\
         <vertices id=\"v\"><input semantic=\"POSITION\" source=\"#p\"/></vertices>\n{primitive}\n\
         </mesh></geometry></library_geometries>",
        source("p", positions)
    )
}

const VERTEX: &str = "<input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/>";
const NORMAL: &str = "<input semantic=\"NORMAL\" source=\"#n\" offset=\"1\"/>";
const TRIANGLE: &str = "0 0 0 1 0 0 0 1 0";

/// A geometry `g` of one triangle, without normals.
fn triangle() -> String {
    geometry(TRIANGLE, "", &format!("<triangles count=\"1\">{VERTEX}<p>0 1 2</p></triangles>"))
}

/// A node that shows the geometry `g` below some transforms.
fn shown(transforms: &str) -> String {
    format!("<node id=\"N\" name=\"shown\">{transforms}<instance_geometry url=\"#g\"/></node>")
}

/// A material `m` whose effect has this content.
fn material(effect: &str) -> String {
    format!(
        "<library_effects><effect id=\"e\">{effect}</effect></library_effects>\n\
         <library_materials><material id=\"m\" name=\"paint\"><instance_effect url=\"#e\"/></material></library_materials>\n"
    )
}

/// The common profile with a shader.
fn profile(shader: &str) -> String {
    format!("<profile_COMMON><technique sid=\"common\">{shader}</technique></profile_COMMON>")
}

/// An `<extra>` of a course profile.
fn extra(profile: &str, content: &str) -> String {
    format!("<extra><technique profile=\"{profile}\">{content}</technique></extra>")
}

/// A node that shows the geometry `g` with the material `m` bound to the symbol `s`.
fn painted(transforms: &str) -> String {
    format!(
        "<node id=\"N\" name=\"shown\">{transforms}<instance_geometry url=\"#g\"><bind_material><technique_common>\
         <instance_material symbol=\"s\" target=\"#m\"/></technique_common></bind_material></instance_geometry></node>"
    )
}

fn try_parse(bytes: &[u8]) -> Result<SceneDescription, Error> {
    comber::import::dae::parse(Path::new("folder/scene.dae"), bytes)
}

fn parse(text: &str) -> SceneDescription {
    try_parse(text.as_bytes()).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// The error of a document: always located, with what was expected. Returns its message.
fn refuse(bytes: &[u8]) -> String {
    let error = try_parse(bytes).expect_err("the document should be refused");
    let Error::Import { path, at, expected, .. } = &error else { panic!("no import error: {error}") };
    assert_eq!(path, Path::new("folder/scene.dae"));
    assert!(matches!(at, At::LineColumn(line, column) if *line > 0 && *column > 0), "no place: {error}");
    assert!(expected.is_some(), "no expectation: {error}");
    error.to_string()
}

/// The line of the only place where `needle` stands in `text`.
fn line_of(text: &str, needle: &str) -> usize {
    assert_eq!(text.matches(needle).count(), 1, "{needle}");
    text[..text.find(needle).unwrap()].matches('\n').count() + 1
}

/// Asserts that there is a note with a text, and whether it warns.
fn assert_note(scene: &SceneDescription, warning: bool, text: &str) {
    let found = |note: &&Note| note.text.contains(text);
    let note = scene.notes.iter().find(found).unwrap_or_else(|| panic!("no \"{text}\" in {:?}", scene.notes));
    assert_eq!(note.warning, warning, "{note:?}");
}
