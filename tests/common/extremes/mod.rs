//! Extremes of scale, distance and shape: how often tracers miss, lie, or hit what rays just left.
//!
//! A grid: scenes of a scale from 10⁻⁹ to 10⁹, at a distance from the origin of 0 to 10⁷ times their size, of many kinds. Loose triangles
//! and spheres are judged ray by ray with exact arithmetic ([`judged`]), closed meshes by that no ray may leave them ([`closed`]). See [`tally::Tally`] for
//! what counts as a failure. What only `--precision f64` can hold – positions of 48 bits, far from the origin – is a grid of its own ([`fine`]).
#![allow(dead_code)] // The bench and the test use parts of their own.

pub mod closed;
pub mod exact;
pub mod judged;
pub mod oracle;
pub mod scenes;
pub mod solids;
pub mod subjects;
pub mod tally;

use comber::peer::embree::library::Device;
use rayon::prelude::*;
use scenes::{CASES, Place};
use std::sync::Arc;
use tally::Row;

/// Sizes of scenes.
pub const SCALES: [f64; 7] = [1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e9];
/// Distances from the origin, in sizes of the scene.
pub const DISTANCES: [f64; 6] = [0.0, 1.0, 1e1, 1e3, 1e5, 1e7];

/// Distances from the origin where positions have 48 bits: in single precision, that much would be lost as 3·10⁻⁵ … 30 sizes of the scene.
pub const FINE_DISTANCES: [f64; 4] = [1e3, 1e5, 1e7, 1e9];

/// All places of the grid.
pub fn places(scales: &[f64], distances: &[f64]) -> Vec<Place> {
    let at = |scale: f64| distances.iter().map(move |&distance| Place { scale, distance, fine: false });
    scales.iter().flat_map(|&scale| at(scale)).collect()
}

/// The places of the fine grid.
pub fn fine() -> Vec<Place> {
    places(&SCALES, &FINE_DISTANCES).into_iter().map(|place| Place { fine: true, ..place }).collect()
}

/// How many cells the judged grid has.
pub fn cells(places: &[Place]) -> u64 {
    ((CASES.len() + solids::all().len()) * places.len()) as u64
}

/// A number for each cell, from which its random numbers start.
fn seed(run: u64, case: usize, at: Place) -> u64 {
    let mixed = at.scale.to_bits().rotate_left(17) ^ at.distance.to_bits() ^ (case as u64 + 1) << 7;
    let mixed = mixed ^ u64::from(at.fine) << 33 ^ run.wrapping_mul(0xd134_2543_de82_ef95);
    mixed.wrapping_mul(0x9e37_79b9_7f4a_7c15)
}

/// The judged grid: about `count` rays a cell, by every subject that can be asked; `done` is told of the rays of each cell. Other rays for another `run`.
pub fn judged(
    run: u64,
    places: &[Place],
    count: u64,
    embree: Option<&Arc<Device>>,
    done: impl Fn(u64) + Sync,
) -> Vec<Row> {
    let solids = solids::all();
    let cells: Vec<(usize, Place)> =
        (0..CASES.len() + solids.len()).flat_map(|case| places.iter().map(move |&at| (case, at))).collect();
    let work = |&(case, at): &(usize, Place)| {
        let rows = match CASES.get(case) {
            Some(loose) => judged::cell(loose, at, count, seed(run, case, at), embree),
            None => {
                let solid = &solids[case - CASES.len()];
                closed::cell(solid, at, count, seed(run, case, at), closed::everyone(at, embree))
            }
        };
        done(count);
        rows
    };
    cells.par_iter().with_max_len(1).flat_map_iter(work).collect()
}

/// The long walk: `count` rays in all inside closed meshes, by the watertight test with nodes of both formats.
pub fn closed(run: u64, places: &[Place], count: u64, done: impl Fn(u64) + Sync) -> Vec<Row> {
    let solids = solids::all();
    let cells: Vec<(usize, Place)> =
        (0..solids.len()).flat_map(|solid| places.iter().map(move |&at| (solid, at))).collect();
    let each = count.div_ceil(2 * cells.len() as u64);
    let work = |&(solid, at): &(usize, Place)| {
        let mut rows = closed::cell(&solids[solid], at, each, !seed(run, solid, at), closed::watertight);
        rows.iter_mut().for_each(|row| row.walk = true);
        done(rows.iter().map(|row| row.tally.rays).sum());
        rows
    };
    cells.par_iter().with_max_len(1).flat_map_iter(work).collect()
}
