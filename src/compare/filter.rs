//! Separable filters over pictures of one number a pixel.

use rayon::prelude::*;

/// Filters `image`, `width` pixels across, by `across` in rows and by `down` in columns. Both kernels have an odd length;
/// beyond the edge, the pixel at the edge goes on.
pub fn separable(width: usize, image: &[f64], across: &[f64], down: &[f64]) -> Vec<f64> {
    let height = image.len() / width;
    // `at` holds places along a line of `length`, of which the first lies `radius` before the pixel.
    let clamped = |place: usize, radius: usize, length: usize| place.saturating_sub(radius).min(length - 1);
    let mut rows = vec![0.0; image.len()];
    rows.par_chunks_mut(width).zip(image.par_chunks(width)).for_each(|(out, row)| {
        let radius = across.len() / 2;
        for (x, out) in out.iter_mut().enumerate() {
            *out = match x >= radius && x + radius < width {
                true => row[x - radius..].iter().zip(across).map(|(v, k)| v * k).sum(),
                false => across.iter().enumerate().map(|(i, k)| row[clamped(x + i, radius, width)] * k).sum(),
            };
        }
    });
    let mut filtered = vec![0.0; image.len()];
    filtered.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        for (i, k) in down.iter().enumerate() {
            let row = &rows[clamped(y + i, down.len() / 2, height) * width..][..width];
            out.iter_mut().zip(row).for_each(|(out, v)| *out += v * k);
        }
    });
    filtered
}

/// exp(−x² / 2σ²) at −radius..=radius.
pub fn gaussian(sigma: f64, radius: usize) -> Vec<f64> {
    let at = |i: usize| i as f64 - radius as f64;
    (0..=2 * radius).map(|i| (-at(i) * at(i) / (2.0 * sigma * sigma)).exp()).collect()
}

/// Scaled so that the sum is 1.
pub fn normalised(kernel: &[f64]) -> Vec<f64> {
    let sum: f64 = kernel.iter().sum();
    kernel.iter().map(|k| k / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The simple twin: one sum over both dimensions.
    #[test]
    fn the_same_as_a_filter_of_two_dimensions() {
        let (width, height) = (9, 7);
        let image: Vec<f64> = (0..width * height).map(|i| ((i * 37) % 17) as f64).collect();
        let (across, down) = ([0.5, 1.0, -2.0, 0.25, 3.0], [1.0, 2.0, -0.5]);
        let got = separable(width, &image, &across, &down);
        for y in 0..height {
            for x in 0..width {
                let mut sum = 0.0;
                for (j, d) in down.iter().enumerate() {
                    for (i, a) in across.iter().enumerate() {
                        let at = |place: usize, offset: usize, radius: i64, length: usize| {
                            (place as i64 + offset as i64 - radius).clamp(0, length as i64 - 1) as usize
                        };
                        sum += a * d * image[at(y, j, 1, height) * width + at(x, i, 2, width)];
                    }
                }
                assert!((got[y * width + x] - sum).abs() < 1e-9, "{x} {y}");
            }
        }
    }
}
