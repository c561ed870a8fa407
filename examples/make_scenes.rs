//! Writes the `.dae` files in `scenes/`: `cargo run --example make_scenes`.
//!
//! Five Cornell boxes of comber's own, around the origin so that the course's placement of the camera and the camera
//! node's own agree. Between them they use what COLLADA allows to say the same thing in different ways; which file
//! uses what stands in `scenes/README.md`.

use comber::scene::procedural::generate;
use std::fmt::Write;
use std::path::Path;

/// Half the room's width, depth and height.
const WIDTH: f64 = 1.2;
const DEPTH: f64 = 1.2;
const HEIGHT: f64 = 0.9;
/// Camera to centre: 1.5 × the room's diagonal.
const CAMERA_DISTANCE: f64 = 5.762812;
/// The lamp's height and sides.
const LAMP: [f64; 3] = [0.895, 0.9, 0.7];
const LAMP_RADIANCE: &str = "9.5 8.7 7.6";

fn main() -> std::io::Result<()> {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for (name, text) in files() {
        let path = directory.join(name);
        std::fs::write(&path, text)?;
        println!("{}", path.display());
    }
    Ok(())
}

/// Names and contents of all files.
pub fn files() -> [(&'static str, String); 5] {
    [
        ("cornell_empty.dae", empty()),
        ("cornell_spheres.dae", spheres()),
        ("cornell_mesh.dae", mesh()),
        ("cornell_transforms.dae", transforms()),
        ("cornell_quad_light.dae", quad_light()),
    ]
}

/// Walls by `<polylist>` of triangles with normals; nodes by matrix.
fn empty() -> String {
    let mut file = Collada::new("Z_UP");
    walls(&mut file, Style::PolylistTriangles);
    lamp_and_camera(&mut file);
    file.finish()
}

/// Walls by `<triangles>` without normals; nodes by translation.
fn spheres() -> String {
    let mut file = Collada::new("Z_UP");
    walls(&mut file, Style::Triangles);
    for (name, albedo, radius, place) in [
        ("large", [0.75, 0.7, 0.62], 0.42, [-0.45, 0.4, -0.48]),
        ("small", [0.55, 0.16, 0.12], 0.3, [0.5, -0.35, -0.6]),
    ] {
        file.material(name, albedo, None);
        file.sphere(name, radius);
        file.instance(name, &translate(place), name, name);
    }
    lamp_and_camera(&mut file);
    file.finish()
}

/// A trefoil with vertex normals, whose node scales, turns and moves it.
fn mesh() -> String {
    let mut file = Collada::new("Z_UP");
    walls(&mut file, Style::PolylistTriangles);
    let knot = generate("proc:knot,tris=5k,seed=1").expect("the specification is sound").meshes.remove(0);
    // From +y up to the file's +z up: the inverse of (x, y, z) → (−x, z, y).
    let turned = |vectors: &[glam::Vec3]| vectors.iter().map(|v| [-v.x, v.z, v.y].map(f64::from)).collect::<Vec<_>>();
    let indices: Vec<[u32; 3]> = knot.triangles;
    file.material("knot", [0.78, 0.74, 0.66], None);
    file.triangles("knot", &turned(&knot.positions), &turned(&knot.normals), &indices);
    let pose = format!("{}<rotate>0 0 1 30</rotate><scale>0.44 0.44 0.44</scale>", translate([0.0, 0.1, -0.13]));
    file.instance("knot", &pose, "knot", "knot");
    lamp_and_camera(&mut file);
    file.finish()
}

/// The room of [`empty`], said in another way: `Y_UP`; one quad, instanced five times under nested nodes that
/// translate, rotate and scale; vertices, normals and texture coordinates at offsets 2, 0 and 1.
fn transforms() -> String {
    let mut file = Collada::new("Y_UP");
    file.quad(
        "unit",
        &[[-1., 0., -1.], [-1., 0., 1.], [1., 0., 1.], [1., 0., -1.]],
        [0., 1., 0.],
        Style::PolylistQuads,
    );
    // A wall is the unit quad, scaled and laid `away` below the origin as a floor would be, then turned.
    let turned = [
        ("floor", "", [WIDTH, DEPTH, HEIGHT]),
        ("ceiling", "<rotate>0 0 1 180</rotate>", [WIDTH, DEPTH, HEIGHT]),
        ("back", "<rotate>1 0 0 -90</rotate>", [WIDTH, HEIGHT, DEPTH]),
        ("left", "<rotate>0 0 1 90</rotate>", [HEIGHT, DEPTH, WIDTH]),
        ("right", "<rotate>0 0 1 -90</rotate>", [HEIGHT, DEPTH, WIDTH]),
    ];
    for ((name, albedo), (_, turn, [x, z, away])) in COLOURS.into_iter().zip(turned) {
        file.material(name, albedo, None);
        let inner = format!(
            "<node><translate>0 {} 0</translate><node><scale>{} 1 {}</scale>{}</node></node>",
            number(-away),
            number(x),
            number(z),
            instance_geometry("unit", name)
        );
        file.node(name, turn, &inner);
    }
    file.light();
    let [height, x, z] = LAMP;
    // An area light shines along −z of its node with sides x and y: turned about x, it shines down.
    let lamp = format!(
        "{}<rotate>1 0 0 -90</rotate><scale>{} {} 1</scale>",
        translate([0.0, height, 0.0]),
        number(x),
        number(z)
    );
    file.node("lamp", &lamp, "<instance_light url=\"#lamp-light\"/>");
    let camera = format!("<rotate>0 1 0 180</rotate>{}", translate([0.0, 0.0, CAMERA_DISTANCE]));
    file.node("camera", &camera, "<instance_camera url=\"#camera-camera\"/>");
    file.finish()
}

/// Lit by a quad whose material emits, without a light object; walls by `<polylist>` of quads.
fn quad_light() -> String {
    let mut file = Collada::new("Z_UP");
    walls(&mut file, Style::PolylistQuads);
    let [z, x, y] = [LAMP[0], LAMP[1] / 2.0, LAMP[2] / 2.0];
    file.material("glow", [0.0; 3], Some(LAMP_RADIANCE));
    file.quad("glow", &[[-x, -y, z], [-x, y, z], [x, y, z], [x, -y, z]], [0., 0., -1.], Style::PolylistTriangles);
    file.instance("glow", IDENTITY, "glow", "glow");
    file.material("ball", [0.6, 0.6, 0.6], None);
    file.sphere("ball", 0.5);
    file.instance("ball", &translate([0.1, 0.1, -0.4]), "ball", "ball");
    file.camera_node();
    file.finish()
}

const COLOURS: [(&str, [f64; 3]); 5] = [
    ("floor", [0.62, 0.6, 0.57]),
    ("ceiling", [0.72, 0.72, 0.72]),
    ("back", [0.7, 0.69, 0.66]),
    ("left", [0.68, 0.36, 0.13]),
    ("right", [0.1, 0.42, 0.45]),
];

const IDENTITY: &str = "<matrix sid=\"transform\">1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix>";

/// The five walls in a Z_UP file whose camera looks along +y, with +x to the right; corners counter-clockwise seen
/// from inside.
fn walls(file: &mut Collada, style: Style) {
    let (w, d, h) = (WIDTH, DEPTH, HEIGHT);
    let walls = [
        ([[-w, -d, -h], [w, -d, -h], [w, d, -h], [-w, d, -h]], [0., 0., 1.]),
        ([[-w, -d, h], [-w, d, h], [w, d, h], [w, -d, h]], [0., 0., -1.]),
        ([[-w, d, -h], [w, d, -h], [w, d, h], [-w, d, h]], [0., -1., 0.]),
        ([[-w, -d, -h], [-w, d, -h], [-w, d, h], [-w, -d, h]], [1., 0., 0.]),
        ([[w, -d, -h], [w, -d, h], [w, d, h], [w, d, -h]], [-1., 0., 0.]),
    ];
    for ((name, albedo), (corners, normal)) in COLOURS.into_iter().zip(walls) {
        file.material(name, albedo, None);
        file.quad(name, &corners, normal, style);
        file.instance(name, IDENTITY, name, name);
    }
}

fn lamp_and_camera(file: &mut Collada) {
    file.light();
    let [z, x, y] = LAMP.map(number);
    let matrix = format!("<matrix sid=\"transform\">{x} 0 0 0 0 {y} 0 0 0 0 1 {z} 0 0 0 1</matrix>");
    file.node("lamp", &matrix, "<instance_light url=\"#lamp-light\"/>");
    file.camera_node();
}

/// How a quad is written.
#[derive(Clone, Copy, PartialEq)]
enum Style {
    PolylistTriangles,
    PolylistQuads,
    Triangles,
}

/// A file in the making: the bodies of its libraries.
struct Collada {
    up_axis: &'static str,
    effects: String,
    materials: String,
    geometries: String,
    lights: String,
    nodes: String,
}

impl Collada {
    fn new(up_axis: &'static str) -> Collada {
        let empty = String::new;
        Collada { up_axis, effects: empty(), materials: empty(), geometries: empty(), lights: empty(), nodes: empty() }
    }

    fn material(&mut self, name: &str, albedo: [f64; 3], radiance: Option<&str>) {
        let colour = numbers(&[albedo]);
        let extra = radiance.map_or(String::new(), |radiance| {
            format!(
                "\n      <extra><technique profile=\"CGL\"><emission><radiance>{radiance}</radiance></emission></technique></extra>"
            )
        });
        put(
            &mut self.effects,
            &format!(
                "    <effect id=\"{name}-effect\">\n      <profile_COMMON><technique sid=\"common\"><phong>\n        \
                 <emission><color>0 0 0 1</color></emission>\n        <diffuse><color>{colour} 1</color></diffuse>\n      \
                 </phong></technique></profile_COMMON>{extra}\n    </effect>"
            ),
        );
        let material =
            format!("    <material id=\"{name}-material\"><instance_effect url=\"#{name}-effect\"/></material>");
        put(&mut self.materials, &material);
    }

    fn sphere(&mut self, name: &str, radius: f64) {
        put(
            &mut self.geometries,
            &format!(
                "    <geometry id=\"{name}-geometry\">\n      <extra><technique profile=\"CGL\"><sphere><radius>{}</radius>\
                 </sphere></technique></extra>\n    </geometry>",
                number(radius)
            ),
        );
    }

    fn quad(&mut self, name: &str, corners: &[[f64; 3]; 4], normal: [f64; 3], style: Style) {
        let (inputs, body) = match style {
            Style::PolylistTriangles => (
                input("VERTEX", name, 0) + &input("NORMAL", name, 1),
                "<vcount>3 3</vcount><p>0 0 1 0 2 0 0 0 2 0 3 0</p>",
            ),
            Style::PolylistQuads => (
                input("NORMAL", name, 0) + &input("TEXCOORD", name, 1) + &input("VERTEX", name, 2),
                "<vcount>4</vcount><p>0 0 0 0 1 1 0 2 2 0 3 3</p>",
            ),
            Style::Triangles => (input("VERTEX", name, 0), "<p>0 1 2 0 2 3</p>"),
        };
        let mut sources = source(name, "positions", "XYZ", &numbers(corners), 4);
        if style != Style::Triangles {
            sources += &source(name, "normals", "XYZ", &numbers(&[normal]), 1);
        }
        if style == Style::PolylistQuads {
            sources += &source(name, "map", "ST", "0 0 0 1 1 1 1 0", 4);
        }
        let (element, count) = match style {
            Style::PolylistTriangles => ("polylist", 2),
            Style::PolylistQuads => ("polylist", 1),
            Style::Triangles => ("triangles", 2),
        };
        self.geometry(name, &sources, element, count, &inputs, body);
    }

    fn triangles(&mut self, name: &str, positions: &[[f64; 3]], normals: &[[f64; 3]], triangles: &[[u32; 3]]) {
        let sources = source(name, "positions", "XYZ", &numbers(positions), positions.len())
            + &source(name, "normals", "XYZ", &numbers(normals), normals.len());
        let corners: Vec<String> = triangles.iter().flatten().map(|i| format!("{i} {i}")).collect();
        let body = format!("<p>{}</p>", corners.join(" "));
        let inputs = input("VERTEX", name, 0) + &input("NORMAL", name, 1);
        self.geometry(name, &sources, "triangles", triangles.len(), &inputs, &body);
    }

    fn geometry(&mut self, name: &str, sources: &str, element: &str, count: usize, inputs: &str, body: &str) {
        put(
            &mut self.geometries,
            &format!(
                "    <geometry id=\"{name}-geometry\"><mesh>\n{sources}      <vertices id=\"{name}-vertices\">\
                 <input semantic=\"POSITION\" source=\"#{name}-positions\"/></vertices>\n      \
                 <{element} material=\"surface\" count=\"{count}\">\n{inputs}        {body}\n      </{element}>\n    </mesh></geometry>"
            ),
        );
    }

    fn light(&mut self) {
        put(
            &mut self.lights,
            &format!(
                "    <light id=\"lamp-light\">\n      <technique_common><point><color>{LAMP_RADIANCE}</color></point></technique_common>\n      \
                 <extra><technique profile=\"CGL\"><area><color>{LAMP_RADIANCE}</color></area></technique></extra>\n    </light>"
            ),
        );
    }

    fn node(&mut self, name: &str, placement: &str, content: &str) {
        put(
            &mut self.nodes,
            &format!("      <node id=\"{name}\">\n        {placement}\n        {content}\n      </node>"),
        );
    }

    fn instance(&mut self, name: &str, placement: &str, geometry: &str, material: &str) {
        self.node(name, placement, &instance_geometry(geometry, material));
    }

    /// A camera before the open side of a Z_UP room, looking along +y.
    fn camera_node(&mut self) {
        let matrix =
            format!("<matrix sid=\"transform\">1 0 0 0 0 0 -1 {} 0 1 0 0 0 0 0 1</matrix>", number(-CAMERA_DISTANCE));
        self.node("camera", &matrix, "<instance_camera url=\"#camera-camera\"/>");
    }

    fn finish(self) -> String {
        let Collada { up_axis, effects, materials, geometries, lights, nodes } = self;
        let lights =
            if lights.is_empty() { lights } else { format!("  <library_lights>\n{lights}  </library_lights>\n") };
        format!(
            "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n\
             <COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\n  \
             <asset>\n    <contributor><authoring_tool>comber, examples/make_scenes.rs</authoring_tool></contributor>\n    \
             <unit name=\"meter\" meter=\"1\"/>\n    <up_axis>{up_axis}</up_axis>\n  </asset>\n  \
             <library_cameras>\n    <camera id=\"camera-camera\"><optics><technique_common><perspective>\n      \
             <xfov>49</xfov><aspect_ratio>1.333333</aspect_ratio><znear>0.1</znear><zfar>100</zfar>\n    \
             </perspective></technique_common></optics></camera>\n  </library_cameras>\n\
             {lights}  <library_effects>\n{effects}  </library_effects>\n  <library_materials>\n{materials}  </library_materials>\n  \
             <library_geometries>\n{geometries}  </library_geometries>\n  <library_visual_scenes>\n    \
             <visual_scene id=\"scene\">\n{nodes}    </visual_scene>\n  </library_visual_scenes>\n  \
             <scene><instance_visual_scene url=\"#scene\"/></scene>\n</COLLADA>\n"
        )
    }
}

fn put(text: &mut String, line: &str) {
    writeln!(text, "{line}").expect("a string takes any text");
}

fn source(geometry: &str, what: &str, axes: &str, values: &str, count: usize) -> String {
    let stride = axes.len();
    let params: String = axes.chars().map(|axis| format!("<param name=\"{axis}\" type=\"float\"/>")).collect();
    let id = format!("{geometry}-{what}");
    format!(
        "      <source id=\"{id}\">\n        <float_array id=\"{id}-array\" count=\"{}\">{values}</float_array>\n        \
         <technique_common><accessor source=\"#{id}-array\" count=\"{count}\" stride=\"{stride}\">{params}</accessor></technique_common>\n      \
         </source>\n",
        count * stride
    )
}

fn input(semantic: &str, geometry: &str, offset: u32) -> String {
    let source = match semantic {
        "VERTEX" => "vertices",
        "NORMAL" => "normals",
        _ => "map",
    };
    format!("        <input semantic=\"{semantic}\" source=\"#{geometry}-{source}\" offset=\"{offset}\"/>\n")
}

fn instance_geometry(geometry: &str, material: &str) -> String {
    format!(
        "<instance_geometry url=\"#{geometry}-geometry\"><bind_material><technique_common>\
         <instance_material symbol=\"surface\" target=\"#{material}-material\"/></technique_common></bind_material></instance_geometry>"
    )
}

fn translate(place: [f64; 3]) -> String {
    format!("<translate>{}</translate>", numbers(&[place]))
}

fn numbers(vectors: &[[f64; 3]]) -> String {
    let words: Vec<String> = vectors.iter().flatten().map(|&v| number(v)).collect();
    words.join(" ")
}

/// Up to six digits after the point: few enough that every platform's sines agree.
fn number(value: f64) -> String {
    let text = format!("{value:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}
