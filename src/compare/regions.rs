//! Differences by regions of the frame.

use serde::Serialize;

use super::bias::Estimate;
use super::luminance;
use super::pair::Pair;

/// A part of the picture. Means and errors are of luminance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Region {
    /// Left edge within the frame.
    pub x: usize,
    /// Top edge within the frame.
    pub y: usize,
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Pixels that count. Without any, the numbers below are not numbers.
    pub pixels: usize,
    /// Mean of A.
    pub mean_a: f64,
    /// Mean of B.
    pub mean_b: f64,
    /// A − B.
    pub difference: f64,
    /// (A − B) / B.
    pub relative: f64,
    /// Root of the mean squared error.
    pub rmse: f64,
    /// Mean of (a − b)² / (b² + ε).
    pub relmse: f64,
    /// Mean difference of each channel over its standard error, if variances are known.
    pub z: Option<[f64; 3]>,
}

/// The regions of a grid of `across` and `down`, row by row; no more of them than there are pixels.
pub fn of(pair: &Pair, [across, down]: [usize; 2], epsilon: f64) -> Vec<Region> {
    let (across, down) = (across.clamp(1, pair.width), down.clamp(1, pair.height));
    let edge = |length: usize, i: usize, parts: usize| length * i / parts;
    let mut regions = Vec::with_capacity(across * down);
    for row in 0..down {
        for column in 0..across {
            let x = [edge(pair.width, column, across), edge(pair.width, column + 1, across)];
            let y = [edge(pair.height, row, down), edge(pair.height, row + 1, down)];
            regions.push(region(pair, x, y, epsilon));
        }
    }
    regions
}

fn region(pair: &Pair, x: [usize; 2], y: [usize; 2], epsilon: f64) -> Region {
    let [mut a, mut b, mut squared, mut relative] = [0.0; 4];
    let (mut difference, mut variance) = ([0.0; 3], [0.0; 3]);
    let (mut pixels, mut tested) = (0usize, 0usize);
    for row in y[0]..y[1] {
        for at in (row * pair.width + x[0]..row * pair.width + x[1]).filter(|&at| pair.usable[at]) {
            let colours = pair.pixel(at);
            let [light_a, light_b] = colours.map(luminance);
            let error = (light_a - light_b).powi(2);
            a += light_a;
            b += light_b;
            squared += error;
            relative += error / (light_b * light_b + epsilon);
            pixels += 1;
            if let Some(of_pixel) = pair.variance(at) {
                tested += 1;
                for c in 0..3 {
                    difference[c] += colours[0][c] - colours[1][c];
                    variance[c] += of_pixel[c];
                }
            }
        }
    }
    let n = pixels as f64;
    let z = || [0, 1, 2].map(|c| Estimate { value: difference[c], error: variance[c].sqrt() }.z());
    Region {
        x: pair.x + x[0],
        y: pair.y + y[0],
        width: x[1] - x[0],
        height: y[1] - y[0],
        pixels,
        mean_a: a / n,
        mean_b: b / n,
        difference: (a - b) / n,
        relative: (a - b) / b,
        rmse: (squared / n).sqrt(),
        relmse: relative / n,
        z: (pair.has_variance() && tested > 0).then(z),
    }
}

#[cfg(test)]
mod tests {
    use super::super::pair::tests::pair;
    use super::*;

    #[test]
    fn regions_cover_every_pixel_once() {
        let whole = pair(7, vec![[1.0; 3]; 35], vec![[0.5; 3]; 35]);
        for grid in [[4, 3], [1, 1], [7, 5], [100, 100]] {
            let regions = of(&whole, grid, 0.01);
            assert_eq!(regions.len(), grid[0].min(7) * grid[1].min(5));
            assert_eq!(regions.iter().map(|r| r.pixels).sum::<usize>(), 35);
            assert!(regions.iter().all(|r| r.pixels == r.width * r.height && (r.relative - 1.0).abs() < 1e-9));
        }
    }

    #[test]
    fn the_region_that_differs_shows() {
        let b = vec![[0.5; 3]; 8 * 6];
        let a = (0..48).map(|i| [if i % 8 >= 4 && i / 8 >= 3 { 0.75 } else { 0.5 }; 3]).collect();
        let mut pair = pair(8, a, b);
        pair.variance_b = Some(vec![[0.01; 3]; 48]);
        let regions = of(&pair, [2, 2], 0.01);
        for (i, region) in regions.iter().enumerate() {
            let off = if i == 3 { 0.25 } else { 0.0 };
            assert!((region.difference - off).abs() < 1e-9 && (region.rmse - off).abs() < 1e-9);
            assert!((region.relmse - off * off / 0.26).abs() < 1e-9);
            let z = region.z.unwrap()[1];
            assert!((z - off * 12.0 / (0.12f64).sqrt()).abs() < 1e-5, "{z}");
        }
        assert_eq!((regions[3].x, regions[3].y), (4, 3));
    }
}
