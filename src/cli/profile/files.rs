//! The files that a profile leaves.

use super::Profiled;
use super::args::ProfileOptions;
use super::html;
use crate::error::Result;
use crate::film::heatmap::{self, HeatMap};
use crate::film::layers;
use crate::profile::pixel_cost::PixelCost;
use std::path::{Path, PathBuf};

/// Where to leave what.
pub struct Files<'a> {
    options: &'a ProfileOptions,
}

/// Ends of the names of maps, what they show and in which unit.
const MAPS: [(&str, &str, &str); 4] = [
    ("time", "thread time a pixel", "microseconds"),
    ("visits", "nodes and leaf blocks visited for a pixel", ""),
    ("bounces", "bounces a sample", ""),
    ("samples", "samples a pixel", ""),
];

impl<'a> Files<'a> {
    /// As `options` ask.
    pub fn new(options: &'a ProfileOptions) -> Files<'a> {
        Files { options }
    }

    /// All of them.
    pub fn paths(&self) -> Vec<PathBuf> {
        let ProfileOptions { html, trace, folded, maps, .. } = self.options;
        let single = [html, trace, folded].into_iter().flatten().cloned();
        let maps = maps.iter().flat_map(|name| {
            MAPS.iter().map(|(end, ..)| ending(name, &format!("_{end}.png"))).chain([ending(name, ".exr")])
        });
        single.chain(maps).collect()
    }

    /// Writes all of them. One that fails does not keep the others from being written; the first failure is returned.
    pub fn write(&self, profiled: &Profiled) -> Result<Vec<PathBuf>> {
        let ProfileOptions { html, trace, folded, maps, .. } = self.options;
        let mut results: Vec<Result<()>> = html.iter().map(|path| html::write(path, profiled)).collect();
        if let Some(timeline) = &profiled.measured.timeline {
            results.extend(trace.iter().map(|path| timeline.write_trace(path)));
            results.extend(folded.iter().map(|path| timeline.write_folded(path)));
        }
        let pixels = profiled.measured.pixels.iter();
        results.extend(maps.iter().zip(pixels).map(|(name, pixels)| write_maps(name, pixels)));
        results.into_iter().collect::<Result<()>>()?;
        Ok(self.paths())
    }
}

fn ending(name: &Path, end: &str) -> PathBuf {
    let mut path = name.as_os_str().to_owned();
    path.push(end);
    path.into()
}

fn write_maps(name: &Path, cost: &PixelCost) -> Result<()> {
    let [width, height] = cost.size;
    let layers = cost.layers();
    for ((end, title, unit), values) in MAPS.iter().zip(layers) {
        let map = HeatMap { width, height, values, title, unit, ..HeatMap::default() };
        heatmap::write(&ending(name, &format!("_{end}.png")), &map)?;
    }
    let channels: Vec<(&str, &[f32])> = MAPS.iter().map(|(end, ..)| *end).zip(layers).collect();
    layers::write(&ending(name, ".exr"), width, height, &channels)
}
