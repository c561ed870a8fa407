//! From sums to a picture.

use super::picture::Picture;
use super::tile::Tile;
use crate::film::interval::Interval;
use crate::options::Cell;

/// Averages the tiles of `cell` in a frame of `full` pixels. Layers exist for which the tiles keep sums.
pub fn develop(tiles: &[Tile], cell: Cell, full: (u32, u32)) -> Picture {
    let (width, height) = (cell.width as usize, cell.height as usize);
    let n = width * height;
    let layer = |present: bool| present.then(|| vec![[0.0f32; 3]; n]);
    let variance = tiles.iter().any(|t| !t.m2.is_empty());
    let aovs = tiles.iter().any(|t| !t.first_hits.is_empty());
    let mut picture = Picture {
        width,
        height,
        x: cell.x as usize,
        y: cell.y as usize,
        full: (full.0 as usize, full.1 as usize),
        beauty: vec![[0.0; 3]; n],
        albedo: layer(aovs),
        normal: layer(aovs),
        depth: aovs.then(|| vec![f32::INFINITY; n]),
        variance: layer(variance),
        sample_count: Some(vec![0; n]),
        ..Picture::default()
    };
    for tile in tiles {
        for local in 0..tile.x.len() {
            let at = (tile.y[local] - cell.y) as usize * width + (tile.x[local] - cell.x) as usize;
            let count = f64::from(tile.count[local]);
            let (mean, variance) = estimate(tile, local);
            picture.beauty[at] = mean.map(|c| c as f32);
            if let Some(counts) = &mut picture.sample_count {
                counts[at] = tile.count[local];
            }
            if let Some(layer) = &mut picture.variance {
                layer[at] = variance.map(|v| v as f32);
            }
            let Some(first) = tile.first_hits.get(local) else { continue };
            if let Some(layer) = &mut picture.albedo {
                layer[at] = first.albedo.map(|a| (a / count.max(1.0)) as f32);
            }
            if let Some(layer) = &mut picture.normal {
                layer[at] = first.normal.map(|a| (a / count.max(1.0)) as f32);
            }
            if let (Some(layer), true) = (&mut picture.depth, first.hits > 0) {
                layer[at] = (first.depth / f64::from(first.hits)) as f32;
            }
        }
    }
    picture
}

/// Mean of a pixel, and variance of that mean where the tile keeps sums for it. One sample says nothing of its variance: infinite,
/// not zero.
///
/// Samples of a sequence whose points avoid each other are taken for independent here unless there are replicates: what comes out
/// is an upper bound.
fn estimate(tile: &Tile, local: usize) -> ([f64; 3], [f64; 3]) {
    let (count, sequences) = (f64::from(tile.count[local]), &tile.sequences);
    let channels = [0, 1, 2];
    let spread = tile
        .m2
        .get(local)
        .map_or([f64::INFINITY; 3], |m2| m2.map(|m| if count > 1.0 { m / (count - 1.0) } else { f64::INFINITY }));
    if sequences.is_empty() {
        return (tile.mean[local], spread.map(|s| s / count.max(1.0)));
    }
    let square = |interval: Interval| interval.error * interval.error;
    if !sequences.halves {
        return (tile.mean[local], channels.map(|c| square(sequences.channel(local, None, c))));
    }
    // Each half has stopped by what the other knew: both count as much, however many samples they have.
    let halves = channels.map(|c| [0, 1].map(|half| sequences.channel(local, Some(half), c)));
    if halves[0].iter().any(|half| half.samples == 0) {
        return (tile.mean[local], [f64::INFINITY; 3]);
    }
    let mean = halves.map(|[a, b]| (a.mean + b.mean) / 2.0);
    let variance = channels.map(|c| {
        let of =
            |half: Interval| if sequences.independent() { spread[c] / f64::from(half.samples) } else { square(half) };
        (of(halves[c][0]) + of(halves[c][1])) / 4.0
    });
    (mean, variance)
}
