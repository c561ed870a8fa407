//! `comber render --explain`: one sample, vertex by vertex.

use super::exit::Done;
use super::interrupt::Interrupt;
use super::load::{self, print_notes};
use super::render::use_threads;
use super::report;
use super::resolve::RenderRequest;
use crate::explain::Story;
use serde_json::json;

/// Tells what sample number `sample` of the pixel at `x`, `y` does.
pub fn run(request: &RenderRequest, [x, y]: [u32; 2], sample: u32) -> anyhow::Result<Done> {
    print_notes(&request.notes, request.report);
    Interrupt::watch(request.scene.storage.kept().as_deref())?;
    use_threads(request.options.threads)?;
    let loaded = load::load(&request.scene, &request.view, &request.options, request.report)?;
    let subject = (&loaded.scene, &loaded.accel, &loaded.camera);
    let story = Story::of(subject, &request.options, x, y, sample);
    let text = story.text(&loaded.scene);
    if request.report.json {
        report::print_json(&json!({
            "comber": env!("CARGO_PKG_VERSION"),
            "command": "explain",
            "scene": report::scene_json(&loaded),
            "pixel": [x, y],
            "sample": sample,
            "radiance": story.sample.radiance,
            "finite": story.sample.radiance.iter().all(|c| c.is_finite()),
            "steps": text.lines().collect::<Vec<_>>(),
        }))?;
    } else {
        report::print(&format!("{}: pixel {x}, {y}, sample {sample}\n{text}", loaded.name))?;
    }
    Ok(Done::Finished)
}
