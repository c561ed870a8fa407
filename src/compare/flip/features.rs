//! Edges and points.

use crate::compare::filter::{gaussian, normalised, separable};

/// Width of the features that count, in degrees of the visual angle (paper, section 4.2).
const WIDTH: f64 = 0.082;
/// Exponent of differences of features.
const EXPONENT: f64 = 0.5;

/// Strength of the edge and of the point at each pixel: lengths of the gradient and of the vector of second derivatives of
/// luminance at the scale of [`WIDTH`]. `picture` is in [`opponent`](super::colour::opponent) colours.
pub fn strengths(width: usize, picture: &[[f64; 3]], pixels_per_degree: f64) -> Vec<[f64; 2]> {
    let sigma = 0.5 * WIDTH * pixels_per_degree;
    let radius = (3.0 * sigma).ceil() as usize;
    let place = |i: usize| i as f64 - radius as f64;
    let bell = gaussian(sigma, radius);
    let derivative = |f: &dyn Fn(f64) -> f64| balanced(bell.iter().enumerate().map(|(i, g)| f(place(i)) * g).collect());
    let first = derivative(&|x| -x);
    let second = derivative(&|x| x * x / (sigma * sigma) - 1.0);
    let smooth = normalised(&bell);
    // Luminance from 0 to 1.
    let light: Vec<f64> = picture.iter().map(|pixel| (pixel[0] + 16.0) / 116.0).collect();
    let lengths = |kernel: &[f64]| {
        let across = separable(width, &light, kernel, &smooth);
        let down = separable(width, &light, &smooth, kernel);
        across.into_iter().zip(down).map(|(x, y)| x.hypot(y)).collect::<Vec<f64>>()
    };
    lengths(&first).into_iter().zip(lengths(&second)).map(|(edge, point)| [edge, point]).collect()
}

/// Scaled so that what is above zero adds up to 1, and what is below to −1.
fn balanced(kernel: Vec<f64>) -> Vec<f64> {
    let above: f64 = kernel.iter().filter(|k| **k > 0.0).sum();
    let below: f64 = kernel.iter().filter(|k| **k < 0.0).sum();
    // A kernel of one pixel is zero, and stays it.
    kernel
        .into_iter()
        .map(|k| {
            if k > 0.0 {
                k / above
            } else if k < 0.0 {
                k / -below
            } else {
                0.0
            }
        })
        .collect()
}

/// Difference of the features of two pixels, from 0 to 1.
pub fn difference(a: [f64; 2], b: [f64; 2]) -> f64 {
    let most = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
    (most / std::f64::consts::SQRT_2).powf(EXPONENT)
}
