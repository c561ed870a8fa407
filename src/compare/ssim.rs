//! Structural similarity.

use super::filter::{gaussian, normalised, separable};
use super::pair::Pair;
use super::seen::{Seen, grey};

/// Pixels from the middle of a window to its edge: windows are 11 × 11.
const RADIUS: usize = 5;

/// Mean SSIM of luminance: clamped to 0..1, then sRGB-encoded, so that the range L is 1. None for pictures that no window
/// fits into.
///
/// Z. Wang, A. Bovik, H. Sheikh, E. Simoncelli, "Image Quality Assessment: From Error Visibility to Structural Similarity", IEEE
/// Transactions on Image Processing 13(4), 2004: Gaussian windows of 11 × 11, σ = 1.5, K₁ = 0.01, K₂ = 0.03. Windows lie
/// wholly within the picture, as in the authors' program; those around a pixel that does not count are left out.
pub fn of(pair: &Pair, seen: &Seen) -> Option<f64> {
    const C1: f64 = 0.01 * 0.01;
    const C2: f64 = 0.03 * 0.03;
    let (width, height) = (pair.width, pair.height);
    let [a, b] = [&seen.a, &seen.b].map(|layer| layer.iter().map(|&colour| grey(colour)).collect::<Vec<f64>>());
    let window = normalised(&gaussian(1.5, RADIUS));
    let mean = |f: &dyn Fn(f64, f64) -> f64| {
        let product: Vec<f64> = a.iter().zip(&b).map(|(&a, &b)| f(a, b)).collect();
        separable(width, &product, &window, &window)
    };
    let (mean_a, mean_b) = (mean(&|a, _| a), mean(&|_, b| b));
    let (aa, bb, ab) = (mean(&|a, _| a * a), mean(&|_, b| b * b), mean(&|a, b| a * b));
    let (mut sum, mut count) = (0.0, 0usize);
    for y in RADIUS..height.saturating_sub(RADIUS) {
        for at in y * width + RADIUS..(y * width + width).saturating_sub(RADIUS) {
            if !pair.usable[at] {
                continue;
            }
            let (ma, mb) = (mean_a[at], mean_b[at]);
            let (va, vb, covariance) = (aa[at] - ma * ma, bb[at] - mb * mb, ab[at] - ma * mb);
            sum += (2.0 * ma * mb + C1) * (2.0 * covariance + C2) / ((ma * ma + mb * mb + C1) * (va + vb + C2));
            count += 1;
        }
    }
    (count > 0).then(|| sum / count as f64)
}

#[cfg(test)]
mod tests {
    use super::super::pair::tests::{pair, pattern};
    use super::*;

    fn ssim(width: usize, a: Vec<[f32; 3]>, b: Vec<[f32; 3]>) -> Option<f64> {
        let pair = pair(width, a, b);
        of(&pair, &Seen::new(&pair, 0.0))
    }

    /// scikit-image 0.26.0: `structural_similarity(a, b, gaussian_weights=True, sigma=1.5, use_sample_covariance=False,
    /// data_range=1)` of the same pictures.
    #[test]
    fn the_same_as_scikit_image() {
        let (one, two) = (pattern(1, 48, 36), pattern(2, 48, 36));
        let dim: Vec<_> = one.iter().map(|p| p.map(|c| 0.9 * c)).collect();
        assert!((ssim(48, one.clone(), two).unwrap() - -0.003_699_160_273).abs() < 1e-6);
        assert!((ssim(48, one, dim).unwrap() - 0.997_934_314_500).abs() < 1e-6);
    }

    #[test]
    fn identity_symmetry_and_flat_pictures() {
        let (a, b) = (pattern(1, 48, 36), pattern(2, 48, 36));
        assert!((ssim(48, a.clone(), a.clone()).unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(ssim(48, a.clone(), b.clone()), ssim(48, b, a));
        // Without structure, means remain: black against white.
        let flat = |v| vec![[v; 3]; 20 * 20];
        assert!((ssim(20, flat(0.0), flat(1.0)).unwrap() - 1e-4 / 1.0001).abs() < 1e-9);
        assert_eq!(ssim(10, pattern(1, 10, 40), pattern(2, 10, 40)), None);
        assert!(ssim(11, pattern(1, 11, 11), pattern(2, 11, 11)).is_some());
    }
}
