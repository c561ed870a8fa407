//! FLIP: how different two pictures look to someone who flips between them.
//!
//! P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. Fairchild, "FLIP: A Difference Evaluator for
//! Alternating Images", Proceedings of the ACM on Computer Graphics and Interactive Techniques 3(2), 2020: the LDR metric. Each
//! picture is blurred as the eye does at the distance (`colour.rs`); colours are compared in a perceptually uniform space; where
//! edges and points differ (`features.rs`), errors weigh more.

mod colour;
mod features;

use rayon::prelude::*;

/// Pixels a degree of the visual angle that the authors assume: a display 0.7 m wide with 3840 pixels, seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f64 = 67.0;

/// FLIP error of each pixel, from 0 (the same) to 1. Pictures are linear, from 0 to 1, `width · height` pixels.
///
/// # Panics
/// If a picture has another length.
pub fn map(width: usize, height: usize, a: &[[f64; 3]], b: &[[f64; 3]], pixels_per_degree: f64) -> Vec<f64> {
    assert!(a.len() == width * height && b.len() == a.len(), "pictures of {width} × {height} pixels");
    let [a, b] = [a, b].map(|picture| picture.par_iter().map(|&rgb| colour::opponent(rgb)).collect::<Vec<_>>());
    let colours = [&a, &b].map(|picture| colour::perceived(width, picture, pixels_per_degree));
    let features = [&a, &b].map(|picture| features::strengths(width, picture, pixels_per_degree));
    let differences = colour::Differences::new();
    let error = |at: usize| {
        let colour = differences.of(colours[0][at], colours[1][at]);
        let feature = features::difference(features[0][at], features[1][at]);
        colour.powf(1.0 - feature)
    };
    (0..a.len()).into_par_iter().map(error).collect()
}

#[cfg(test)]
mod tests {
    use super::super::pair::tests::pattern;
    use super::*;

    fn linear(k: usize, scale: f64) -> Vec<[f64; 3]> {
        pattern(k, 48, 36).iter().map(|p| p.map(|c| f64::from(c) * scale)).collect()
    }

    fn mean(map: &[f64]) -> f64 {
        map.iter().sum::<f64>() / map.len() as f64
    }

    /// The authors' own program, flip-evaluator 1.7 from PyPI: `evaluate(reference, test, "LDR", inputsRGB=False)`, which
    /// computes in single precision, on the same pictures: mean, and the pixels (20, 10) and (0, 0).
    #[test]
    fn the_same_as_the_authors_program() {
        let near = |got: f64, want: f64| assert!((got - want).abs() < 1e-4, "{got} instead of {want}");
        let map_of = |a: &[[f64; 3]], b: &[[f64; 3]], ppd| map(48, 36, a, b, ppd);
        let map_1 = map_of(&linear(1, 1.0), &linear(2, 1.0), 67.0);
        near(mean(&map_1), 0.379_456_01);
        near(map_1[10 * 48 + 20], 0.247_338_6);
        near(map_1[0], 0.340_701_3);
        near(mean(&map_of(&linear(1, 1.0), &linear(1, 0.9), 67.0)), 0.162_496_43);
        near(mean(&map_of(&linear(3, 0.5), &linear(2, 1.0), 20.0)), 0.82978868);
        let flat = |v: [f64; 3]| vec![v; 48 * 36];
        near(mean(&map_of(&flat([0.0; 3]), &flat([1.0; 3]), 67.0)), 0.967_395_37);
        near(mean(&map_of(&flat([0.5; 3]), &flat([0.6; 3]), 67.0)), 0.196_272_88);
    }

    #[test]
    fn nothing_from_nothing_green_from_blue_is_all() {
        let a = linear(1, 1.0);
        assert_eq!(mean(&map(48, 36, &a, &a, 67.0)), 0.0);
        // The largest difference there is, by which the metric is scaled.
        let flat = |v: [f64; 3]| vec![v; 64];
        let most = map(8, 8, &flat([0.0, 1.0, 0.0]), &flat([0.0, 0.0, 1.0]), 67.0);
        assert!((mean(&most) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn symmetric() {
        let (a, b) = (linear(1, 1.0), linear(2, 0.7));
        assert_eq!(map(48, 36, &a, &b, 67.0), map(48, 36, &b, &a, 67.0));
    }

    /// Grain that the eye cannot resolve from afar is no difference.
    #[test]
    fn distance_blurs() {
        let grain = |k: usize| -> Vec<[f64; 3]> {
            (0..48 * 36).map(|i| [if (i % 48 + i / 48 + k).is_multiple_of(2) { 0.4 } else { 0.6 }; 3]).collect()
        };
        let at = |ppd| mean(&map(48, 36, &grain(0), &grain(1), ppd));
        assert!(at(300.0) < 0.5 * at(30.0), "{} {}", at(300.0), at(30.0));
    }
}
