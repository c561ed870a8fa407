//! `comber info`.

use super::args::InfoArgs;
use super::exit::Done;
use super::interrupt::Interrupt;
use super::load::{self, Loaded, print_notes};
use super::render::use_threads;
use super::report::{self, Facts, table};
use super::resolve::RenderRequest;
use crate::bvh::PhaseSeconds;
use crate::measure::units;
use crate::options::Precision;
use crate::plan::Plan;
use glam::DVec3;
use serde_json::{Value, json};

/// Explains the render that `args` ask for.
pub fn run(args: InfoArgs) -> anyhow::Result<Done> {
    let request = RenderRequest::new(args.render)?.is_a_render()?;
    print_notes(&request.notes, request.report);
    Interrupt::watch(request.scene.storage.kept().as_deref())?;
    use_threads(request.options.threads)?;
    let loaded = load::load(&request.scene, &request.view, &request.options, request.report)?;
    let plan = Plan::new(&loaded.scene, &loaded.accel, &request.options)?;
    if request.report.json {
        report::print_json(&as_json(&request, &loaded, &plan))?;
    } else {
        report::print(&as_text(&loaded, &plan))?;
    }
    Ok(Done::Finished)
}

fn as_json(request: &RenderRequest, loaded: &Loaded, plan: &Plan) -> Value {
    json!({
        "comber": env!("CARGO_PKG_VERSION"),
        "command": "info",
        "scene": report::scene_json(loaded),
        "camera": loaded.camera,
        "bvh": loaded.accel.stats(),
        "formats": formats(loaded),
        "plan": plan,
        "seconds": loaded.seconds,
        "tree": loaded.tree,
        "memory": report::memory_json(loaded),
        "notes": report::notes_json(&request.notes, loaded),
    })
}

/// How nodes and leaves are stored, and why; `null` where there are none.
fn formats(loaded: &Loaded) -> Value {
    let [node_bytes, block_bytes] = loaded.accel.row_bytes();
    let format =
        |bytes: usize, format: Option<(&str, &str)>| format.map(|(_, why)| json!({"bytes": bytes, "why": why}));
    json!({
        "nodes": format(node_bytes, loaded.accel.node_format()),
        "leaves": format(block_bytes, loaded.accel.leaf_format()),
    })
}

fn as_text(loaded: &Loaded, plan: &Plan) -> String {
    let sections = [
        ("Scene", scene(loaded)),
        ("Camera", camera(loaded, plan)),
        ("Acceleration structure", accel(loaded)),
        ("Stages", stages(plan)),
        ("Columns", columns(plan)),
        ("Memory", memory(plan)),
    ];
    sections.map(|(title, body)| format!("{title}\n{body}\n")).join("\n")
}

fn scene(loaded: &Loaded) -> String {
    let scene = &loaded.scene;
    let (min, max) = scene.bounds();
    let mut facts = Facts::default();
    facts.add("scene", report::scene_line(loaded));
    facts.add("vertices", units::count(scene.shapes.positions.len() as u64));
    facts.add("geometries", units::count(scene.shapes.geometries.len() as u64));
    facts.add("materials", units::count(scene.materials.len() as u64));
    for light in &scene.lights {
        let (kind, radiance) = (light.shape.kind(), light.radiance);
        facts.add("light", format!("{}: {kind}, area {:.4}, radiance {radiance}", light.name, light.area()));
    }
    if scene.origin == DVec3::ZERO {
        facts.add("bounds", format!("{min} to {max}"));
    } else {
        let size = f64::from((max - min).max_element());
        let far = scene.origin.abs().max_element() / size;
        facts.add("origin", format!("{}: the scene lies {far:.0} times its size from the file's", scene.origin));
        facts.add("bounds", format!("{min} to {max} around it"));
    }
    facts.add("precision", precision(loaded));
    facts.add("tables", units::bytes(scene.bytes() as u64));
    facts.text()
}

fn camera(loaded: &Loaded, plan: &Plan) -> String {
    let camera = loaded.camera;
    let (x, y) = camera.shown(plan.options.width, plan.options.height);
    let degrees = |tan_half: f32| 2.0 * tan_half.atan().to_degrees();
    let mut facts = Facts::default();
    let around = if loaded.scene.origin == DVec3::ZERO { "" } else { " around the scene's origin" };
    facts.add("position", format!("{}{around}", camera_place(loaded)));
    facts.add("looks along", camera.forward.to_string());
    facts.add("up", camera.up.to_string());
    facts.add("shows", format!("{:.2}° × {:.2}°", degrees(x), degrees(y)));
    facts.add("picture", report::picture_line(&plan.options));
    facts.text()
}

/// As exactly as it is known.
fn camera_place(loaded: &Loaded) -> String {
    match loaded.accel.precision() {
        Precision::F32 => loaded.camera.position.to_string(),
        Precision::F64 => loaded.camera.place().to_string(),
    }
}

/// How exactly positions are known, and what follows.
fn precision(loaded: &Loaded) -> String {
    let (min, max) = loaded.scene.bounds();
    let largest = min.abs().max(max.abs()).max_element();
    let step = f64::from(largest.next_up() - largest);
    match loaded.accel.precision() {
        Precision::F32 => format!("single, as by default: positions farthest from the origin are {step:.1e} apart"),
        Precision::F64 => {
            let step = step / f64::from(1 << 24);
            format!("double, as asked: positions farthest from the origin are {step:.1e} apart")
        }
    }
}

/// The acceleration structure in numbers.
pub fn accel(loaded: &Loaded) -> String {
    let stats = loaded.accel.stats();
    let mut facts = Facts::default();
    if let Some(quality) = stats.quality {
        facts.add("quality", quality.name());
    }
    facts.add("primitives", units::count(stats.primitives as u64));
    facts.add("inner nodes", format!("{} in {} levels", units::count(stats.nodes as u64), stats.depth));
    facts.add("leaf blocks", units::count(stats.leaf_blocks as u64));
    if let Some((bytes, why)) = loaded.accel.node_format() {
        facts.add("a node", format!("{bytes}: {why}"));
    }
    if let Some((bytes, why)) = loaded.accel.leaf_format() {
        facts.add("a leaf block", format!("{bytes}: {why}"));
    }
    facts.add("SAH cost", format!("{:.2} nodes and blocks a ray that meets the scene's box", stats.sah_cost));
    let (bytes, each) = (units::bytes(stats.bytes as u64), stats.bytes_per_primitive);
    facts.add("memory", format!("{bytes}, {each:.1} B a primitive"));
    facts.add("built in", report::seconds(stats.build_seconds));
    if stats.quality.is_some() && loaded.tree.source == "built" {
        let PhaseSeconds { fragments, binary, reinsertion, collapse, emit } = stats.phase_seconds;
        let phases = [
            ("boxes", fragments),
            ("binary tree", binary),
            ("reinsertion", reinsertion),
            ("collapse", collapse),
            ("nodes and leaves", emit),
        ];
        facts.add("of this", phases.map(|(name, seconds)| format!("{name} {}", report::seconds(seconds))).join(", "));
    }
    if loaded.tree.source == "cache" {
        facts.add("from the cache in", report::seconds(loaded.tree.seconds.load));
    }
    facts.text()
}

fn stages(plan: &Plan) -> String {
    let rows = plan.stages.iter().map(|stage| {
        [
            stage.name.to_owned(),
            stage.kernel.clone(),
            stage.bytes_read.to_string(),
            stage.bytes_written.to_string(),
            stage.why.clone(),
        ]
    });
    let costs = table(["stage", "kernel", "B read/row", "B written/row", "why"], 5, rows);
    let access = plan.stages.iter().map(|s| [s.name.to_owned(), by_table(&s.reads), by_table(&s.writes)]);
    format!("{costs}\n\n{}", table(["stage", "reads", "writes"], 3, access))
}

/// Columns, a line for each table: `path: ox oy oz`.
fn by_table(columns: &[String]) -> String {
    let mut lines: Vec<String> = Vec::new();
    let mut current = "";
    for (table, field) in columns.iter().filter_map(|column| column.split_once('.')) {
        match lines.last_mut() {
            Some(line) if table == current => *line += &format!(" {field}"),
            _ => lines.push(format!("{table}: {field}")),
        }
        current = table;
    }
    lines.join("\n")
}

fn columns(plan: &Plan) -> String {
    let rows = plan
        .columns
        .iter()
        .map(|column| [column.name.clone(), column.what.clone(), column.bytes.to_string(), column.why.clone()]);
    let mut facts = Facts::default();
    facts.add("bytes a path", plan.bytes_per_path.to_string());
    facts.add("paths a wave", format!("{}: {}", units::count(plan.wave as u64), plan.wave_why));
    facts.add("threads", plan.threads.to_string());
    facts.add("instruction set", plan.simd);
    format!("{}\n\n{}", table(["column", "what", "B/path", "why"], 4, rows), facts.text())
}

fn memory(plan: &Plan) -> String {
    let memory = plan.memory;
    let mut facts = Facts::default();
    facts.add("waves", units::bytes(memory.waves));
    facts.add("film and picture", units::bytes(memory.film));
    facts.add("scene", units::bytes(memory.scene));
    facts.add("acceleration structure", units::bytes(memory.accel));
    facts.add("choice of lights", units::bytes(memory.lights));
    facts.add("in all", units::bytes(memory.total()));
    facts.text()
}
