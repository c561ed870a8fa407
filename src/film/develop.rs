//! From sums to a picture.

use super::picture::Picture;
use super::tile::Tile;
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
            picture.beauty[at] = tile.mean[local].map(|c| c as f32);
            if let Some(counts) = &mut picture.sample_count {
                counts[at] = tile.count[local];
            }
            if let (Some(layer), Some(m2)) = (&mut picture.variance, tile.m2.get(local)) {
                // Of the mean. One sample says nothing of its variance: infinite, not zero.
                layer[at] = m2.map(|m| if count > 1.0 { (m / ((count - 1.0) * count)) as f32 } else { f32::INFINITY });
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
