//! `comber bvh`.

use super::args::BvhArgs;
use super::exit::Done;
use super::info;
use super::interrupt::Interrupt;
use super::load::{self, Loaded, print_notes};
use super::provenance::{creation_time, provenance};
use super::render::{render, use_threads};
use super::report::{self, Facts};
use super::resolve::BvhRequest;
use crate::error::{Error, Result};
use crate::film::output;
use crate::film::picture::Picture;
use crate::film::wireframe::{self, Wire};
use crate::measure::units;
use crate::plan::Plan;
use glam::Vec3;
use serde_json::json;
use std::f32::consts::TAU;
use std::path::PathBuf;

/// How bright the picture under the lines is.
const BACKGROUND: f32 = 0.25;

/// Draws the level of the tree that `args` ask for.
pub fn run(args: BvhArgs) -> anyhow::Result<Done> {
    let request = BvhRequest::new(args)?;
    let created = creation_time()?;
    print_notes(&request.notes, request.report);
    for path in &request.outputs {
        output::check(path)?;
    }
    let interrupt =
        Interrupt::watch(request.outputs.iter().map(PathBuf::as_path).chain(request.scene.storage.kept().as_deref()))?;
    use_threads(request.options.threads)?;
    let loaded = load::load(&request.scene, &request.view, &request.options, request.report)?;
    let wires = wires(&loaded, request.depth)?;
    let plan = Plan::new(&loaded.scene, &loaded.accel, &request.options)?;
    // A picture without its lines is of no use to anyone, so a signal ends the process.
    let (outcome, _) = render(&loaded, &plan, &interrupt, !request.report.quiet)?;
    let mut picture = outcome.picture;
    draw(&mut picture, &loaded, &wires);
    picture.provenance = provenance(&loaded, &request.options, outcome.stats.samples, false, &created);
    for path in &request.outputs {
        output::write(path, &picture, 0.0)?;
    }
    if request.report.json {
        report::print_json(&json!({
            "comber": env!("CARGO_PKG_VERSION"),
            "command": "bvh",
            "scene": report::scene_json(&loaded),
            "camera": loaded.camera,
            "bvh": loaded.accel.stats(),
            "tree": loaded.tree,
            "depth": request.depth,
            "boxes": wires.len(),
            "pictures": request.outputs.iter().map(|path| report::path_json(path)).collect::<Vec<_>>(),
            "notes": report::notes_json(&request.notes, &loaded),
        }))?;
    } else if !request.report.quiet {
        report::print(&summary(&request, &loaded, wires.len()))?;
    }
    Ok(Done::Finished)
}

/// The boxes of one level, each in a colour of its own.
fn wires(loaded: &Loaded, depth: u32) -> Result<Vec<Wire>> {
    let boxes = loaded.accel.boxes_at_depth(depth);
    if boxes.is_empty() {
        let deepest = loaded.accel.stats().depth;
        return Err(Error::Options(format!("the tree has no boxes at --depth {depth}; its deepest are at {deepest}")));
    }
    Ok(boxes
        .iter()
        .enumerate()
        .map(|(index, aabb)| Wire { min: aabb.min, max: aabb.max, color: color(index) })
        .collect())
}

/// Dims the picture and draws the boxes over it.
fn draw(picture: &mut Picture, loaded: &Loaded, wires: &[Wire]) {
    for pixel in picture.beauty.iter_mut() {
        *pixel = pixel.map(|channel| channel * BACKGROUND);
    }
    let lens = loaded.camera.lens(picture.width as u32, picture.height as u32);
    wireframe::draw(&mut picture.beauty, picture.width, &lens, wires);
}

/// Colours that differ most between boxes that follow each other: hues a golden section of the circle apart.
fn color(index: usize) -> Vec3 {
    let turn = (index as f64 * 0.618_033_988_749_895).fract() as f32;
    let hue = |shift: f32| 0.5 + 0.5 * (TAU * (turn + shift)).cos();
    // No channel is quite dark, so that lines stand out from any background.
    0.1 + 0.9 * Vec3::new(hue(0.0), hue(1.0 / 3.0), hue(2.0 / 3.0))
}

fn summary(request: &BvhRequest, loaded: &Loaded, boxes: usize) -> String {
    let mut facts = Facts::default();
    facts.add("scene", report::scene_line(loaded));
    facts.add("level", format!("{}: {} boxes", request.depth, units::count(boxes as u64)));
    for path in &request.outputs {
        facts.add("file", path.display().to_string());
    }
    format!("{}\n{}\n", info::accel(loaded), facts.text())
}
