//! `comber bench`.

pub mod args;
mod request;
mod subject;
mod text;

use super::exit::Done;
use super::load::print_notes;
use super::render::use_threads;
use super::report;
use crate::bench::probe::Probe;
use crate::bench::record::Record;
use crate::error::Result;
use crate::film::atomic_file;
use crate::measure::processor;
use crate::peer::embree::library::{self, Device};
use args::BenchArgs;
use request::{BenchRequest, PeerRequest};
use serde_json::json;
use std::sync::Arc;

/// Measures what `args` ask for.
pub fn run(args: BenchArgs) -> anyhow::Result<Done> {
    let request = BenchRequest::new(args)?;
    print_notes(&request.notes, request.report);
    let earlier = request.against.as_deref().map(Record::read).transpose()?;
    request.save.iter().filter(|path| path.parent().is_some_and(|p| p.is_dir())).try_for_each(|path| {
        // Not to find out after minutes of measuring.
        atomic_file::check_writable(path)
    })?;
    use_threads(request.options.threads)?;
    let devices = request.peer.as_ref().map(|peer| devices(peer, &request)).transpose()?.unwrap_or_default();
    let mut probe = Probe::new();
    let mut record = Record::new();
    let mut scenes = Vec::new();
    for scene in &request.scenes {
        let measured = subject::measure(&request, scene, &devices, &mut probe, &mut record)?;
        if !request.report.json && !request.report.quiet {
            report::print(&text::of(&measured))?;
        }
        scenes.push(measured);
    }
    let changes = earlier.as_ref().map(|earlier| record.against(earlier));
    if request.report.json {
        report::print_json(&json!({
            "comber": env!("CARGO_PKG_VERSION"),
            "command": "bench",
            "machine": { "processor": processor::name(), "processors": processor::count() },
            "scenes": scenes,
            "against": changes,
        }))?;
    } else if let (Some(changes), Some(earlier), false) = (&changes, &earlier, request.report.quiet) {
        report::print(&text::changes(changes, earlier))?;
    }
    if let Some(path) = &request.save {
        record.write(path)?;
    }
    Ok(Done::Finished)
}

/// The peer's libraries.
fn devices(peer: &PeerRequest, request: &BenchRequest) -> Result<Vec<Arc<Device>>> {
    let threads = request.threads.iter().copied().max().unwrap_or(1);
    let libraries = library::find(peer.library.as_deref())?;
    libraries.iter().map(|path| Device::open(path, threads, peer.isa.as_deref())).collect()
}
