//! Colours as they are perceived at a distance, and their differences.

use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::f64::consts::PI;

use crate::compare::filter::separable;

/// Linear sRGB to CIE XYZ (IEC 61966-2-1, D65), from the exact chromaticities.
const TO_XYZ: [[f64; 3]; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
];

/// Exponent of colour differences (paper, section 4.1.3).
const COLOUR_EXPONENT: f64 = 0.7;
/// Share of the largest difference below which most of the range is spent (p_c), and that range (p_t).
const MEDIUM: [f64; 2] = [0.4, 0.95];

/// Contrast sensitivity of the channels: Gaussians of the frequency, amplitude and width (paper, table 1).
const SENSITIVITY: [&[[f64; 2]]; 3] = [&[[1.0, 0.0047]], &[[1.0, 0.0053]], &[[34.1, 0.04], [13.5, 0.025]]];
/// Largest width among them.
const WIDEST: f64 = 0.04;

/// Luminance, red–green, blue–yellow: YCxCz of linear sRGB.
pub fn opponent(rgb: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = relative(rgb);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// X, Y, Z over those of white.
fn relative(rgb: [f64; 3]) -> [f64; 3] {
    TO_XYZ.map(|row| (row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2]) / row.iter().sum::<f64>())
}

/// The inverse of [`opponent`].
struct FromOpponent {
    from_xyz: DMat3,
    white: DVec3,
}

impl FromOpponent {
    fn new() -> FromOpponent {
        let [x, y, z] = TO_XYZ.map(DVec3::from_array);
        let to_xyz = DMat3::from_cols(x, y, z).transpose();
        FromOpponent { from_xyz: to_xyz.inverse(), white: to_xyz * DVec3::ONE }
    }

    fn rgb(&self, [y, x, z]: [f64; 3]) -> [f64; 3] {
        let y = (y + 16.0) / 116.0;
        let relative = DVec3::new(y + x / 500.0, y, y - z / 200.0);
        (self.from_xyz * (relative * self.white)).to_array()
    }
}

/// CIE L*a*b* of linear sRGB, a* and b* after Hunt: less colour where there is less light.
fn hunt_lab(rgb: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let f = |t: f64| if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 };
    let [x, y, z] = relative(rgb).map(f);
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// The picture as the eye resolves it, as [`hunt_lab`]; `picture` is in [`opponent`] colours.
pub fn perceived(width: usize, picture: &[[f64; 3]], pixels_per_degree: f64) -> Vec<[f64; 3]> {
    let radius = (3.0 * (WIDEST / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil();
    let degrees = |i: usize| (i as f64 - radius) / pixels_per_degree;
    let channels: [Vec<f64>; 3] = std::array::from_fn(|c| {
        let channel: Vec<f64> = picture.iter().map(|pixel| pixel[c]).collect();
        let mut blurred = vec![0.0; channel.len()];
        let mut sum = 0.0;
        // The Fourier transform of a Gaussian of the frequency is one of the angle; each is separable.
        for [amplitude, b] in SENSITIVITY[c] {
            let weight = amplitude * (PI / b).sqrt();
            let kernel: Vec<f64> =
                (0..=2 * radius as usize).map(|i| (-PI * PI * degrees(i).powi(2) / b).exp()).collect();
            sum += weight * kernel.iter().sum::<f64>().powi(2);
            let part = separable(width, &channel, &kernel, &kernel);
            blurred.iter_mut().zip(part).for_each(|(blurred, part)| *blurred += weight * part);
        }
        blurred.iter_mut().for_each(|v| *v /= sum);
        blurred
    });
    let inverse = FromOpponent::new();
    let perceive = |at: usize| {
        let rgb = inverse.rgb([channels[0][at], channels[1][at], channels[2][at]]);
        hunt_lab(rgb.map(|c| c.clamp(0.0, 1.0)))
    };
    (0..picture.len()).into_par_iter().map(perceive).collect()
}

/// Differences of perceived colours.
pub struct Differences {
    /// That of green and blue, the largest that a display can show.
    most: f64,
}

impl Differences {
    /// As a display shows them.
    pub fn new() -> Differences {
        Differences { most: hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])) }
    }

    /// Difference of two colours from 0 to 1, compressed where it is large.
    pub fn of(&self, a: [f64; 3], b: [f64; 3]) -> f64 {
        let [share, range] = MEDIUM;
        let (error, medium) = (hyab(a, b), share * self.most);
        match error < medium {
            true => range / medium * error,
            false => range + (error - medium) / (self.most - medium) * (1.0 - range),
        }
    }
}

/// HyAB (S. Abasi, M. Amani Tehran, M. Fairchild 2020) to the power that FLIP takes it to.
fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    ((a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])).powf(COLOUR_EXPONENT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_colours() {
        let near = |got: [f64; 3], want: [f64; 3], by: f64| {
            got.into_iter().zip(want).for_each(|(g, w)| assert!((g - w).abs() < by, "{got:?} {want:?}"));
        };
        near(hunt_lab([1.0; 3]), [100.0, 0.0, 0.0], 1e-9);
        // Green in L*a*b* is 87.735, −86.183, 83.179.
        near(hunt_lab([0.0, 1.0, 0.0]), [87.735, -75.612, 72.977], 0.01);
        near(opponent([1.0; 3]), [100.0, 0.0, 0.0], 1e-9);
        for rgb in [[0.2, 0.7, 0.1], [0.0, 0.0, 1.0], [1.0, 0.5, 0.25]] {
            near(FromOpponent::new().rgb(opponent(rgb)), rgb, 1e-12);
        }
    }
}
