//! What renders are compared with.

use crate::compare::pair::Pair;
use crate::compare::relative::EPSILON;
use crate::error::{Error, Note, Result};
use crate::film::read::Found;
use crate::film::tile::luminance;
use crate::options::Cell;

/// A reference, cut to what is rendered.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Linear colours.
    pub colours: Vec<[f64; 3]>,
    /// Variance of each; none if nothing is known of it, and then the reference counts as exact.
    pub variance: Option<Vec<[f64; 3]>>,
    /// Pixels that count: colours are finite, and so are variances where there are any.
    pub usable: Vec<bool>,
    /// How many.
    pub count: usize,
    /// Weight of each pixel in the search for bias: 1 / (b² + ε), b being the mean luminance of its neighbours. Not its own, so that the
    /// weight does not depend on the noise that it multiplies.
    pub weights: Vec<f64>,
}

impl Truth {
    /// The part of `reference` that renders of `cell` in a frame of `full` pixels show.
    ///
    /// # Errors
    /// [`Error::Pictures`] if it has another size, does not hold all of the cell, or has no usable pixel.
    pub fn new(reference: &Found, cell: Cell, full: (u32, u32)) -> Result<(Truth, Vec<Note>)> {
        let [width, height] = [cell.width, cell.height].map(|n| n as usize);
        let full = (full.0 as usize, full.1 as usize);
        if reference.full != full {
            let [there, here] = [reference.full, full].map(|(w, h)| format!("{w} × {h}"));
            let hint = format!("-r {} {}", reference.full.0, reference.full.1);
            return Err(Error::Pictures(format!(
                "the reference has {there} pixels, and renders have {here}: render with {hint}"
            )));
        }
        let colours = vec![[0.0; 3]; width * height];
        let render = Found { width, height, x: cell.x as usize, y: cell.y as usize, full, colours, ..Found::default() };
        let (pair, _) = Pair::new(&render, reference, None)?;
        if (pair.width, pair.height) != (width, height) {
            let Pair { x, y, width, height, .. } = pair;
            return Err(Error::Pictures(format!(
                "the reference holds only a part of what is rendered: render that, -p {x} {y} {width} {height}"
            )));
        }
        let usable: Vec<bool> = (0..pair.usable.len())
            .map(|at| pair.usable[at] && (!pair.has_variance() || pair.variance(at).is_some()))
            .collect();
        let count = usable.iter().filter(|usable| **usable).count();
        if count == 0 {
            return Err(Error::Pictures("no pixel of the reference is finite and has a finite standard error".into()));
        }
        let mut notes = Vec::new();
        if count < usable.len() {
            let out = usable.len() - count;
            notes.push(Note::warning(format!(
                "{out} of {} pixels do not count: the reference or its standard error is not finite there",
                usable.len()
            )));
        }
        if !pair.has_variance() {
            notes.push(Note::warning(
                "the reference has no standard errors and counts as exact: its own noise shows as bias",
            ));
        }
        let wide = |layer: &[[f32; 3]]| layer.iter().map(|pixel| pixel.map(f64::from)).collect::<Vec<_>>();
        let variance = pair.variance_b.as_deref().map(wide);
        let colours = wide(&pair.b);
        let weights = weights(&colours, &usable, width);
        Ok((Truth { colours, variance, usable, count, weights }, notes))
    }

    /// Pixels that count, in order.
    pub fn pixels(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        self.usable.iter().enumerate().filter(|(_, usable)| **usable).map(|(at, _)| at)
    }

    /// Mean over pixels and channels of a number of each.
    pub fn mean(&self, number: impl Fn(usize, usize) -> f64) -> f64 {
        self.pixels().map(|at| (0..3).map(|c| number(at, c)).sum::<f64>()).sum::<f64>() / (3 * self.count) as f64
    }

    /// MSE and relMSE (ε = 0.01) of a picture, the noise of the reference included.
    pub fn errors(&self, picture: &[[f32; 3]]) -> [f64; 2] {
        let squared = |at: usize, c: usize| (f64::from(picture[at][c]) - self.colours[at][c]).powi(2);
        [self.mean(squared), self.mean(|at, c| squared(at, c) * self.weight(at, c))]
    }

    /// What relMSE multiplies a squared difference by.
    pub fn weight(&self, at: usize, c: usize) -> f64 {
        1.0 / (self.colours[at][c] * self.colours[at][c] + EPSILON)
    }

    /// Variance of a channel of a pixel; 0 if unknown.
    pub fn noise(&self, at: usize, c: usize) -> f64 {
        self.variance.as_ref().map_or(0.0, |variance| variance[at][c])
    }
}

/// See [`Truth::weights`]; a pixel without usable neighbours has none.
fn weights(colours: &[[f64; 3]], usable: &[bool], width: usize) -> Vec<f64> {
    let height = colours.len() / width;
    let weight = |at: usize| {
        let (x, y) = (at % width, at / width);
        let (mut sum, mut count) = (0.0, 0.0);
        for y in y.saturating_sub(1)..(y + 2).min(height) {
            for other in (x.saturating_sub(1)..(x + 2).min(width)).map(|x| y * width + x) {
                if other != at && usable[other] {
                    sum += luminance(colours[other]);
                    count += 1.0;
                }
            }
        }
        if count > 0.0 { 1.0 / ((sum / count).powi(2) + EPSILON) } else { 0.0 }
    };
    (0..colours.len()).map(weight).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(values: &[f32], width: usize) -> Found {
        let colours: Vec<[f32; 3]> = values.iter().map(|&v| [v; 3]).collect();
        let height = values.len() / width;
        Found { width, height, full: (width, height), colours, ..Found::default() }
    }

    #[test]
    fn errors_are_those_of_the_definition_over_pixels_that_count() {
        let reference = found(&[1.0, 2.0, f32::NAN, 0.0], 2);
        let cell = Cell { x: 0, y: 0, width: 2, height: 2 };
        let (truth, notes) = Truth::new(&reference, cell, (2, 2)).unwrap();
        assert_eq!((truth.count, notes.len()), (3, 2));
        let [mse, relmse] = truth.errors(&[[1.5; 3], [2.0; 3], [9.0; 3], [0.1; 3]]);
        assert!((mse - (0.25 + 0.01) / 3.0).abs() < 1e-8);
        assert!((relmse - (0.25 / 1.01 + 0.01 / 0.01) / 3.0).abs() < 1e-6);
    }

    #[test]
    fn weights_follow_the_neighbours() {
        let reference = found(&[1.0, 2.0, f32::NAN, 4.0, 7.0, 0.5], 3);
        let (truth, _) = Truth::new(&reference, Cell { x: 0, y: 0, width: 3, height: 2 }, (3, 2)).unwrap();
        let around = [13.0 / 3.0, 12.5 / 4.0, 9.5 / 3.0, 10.0 / 3.0, 7.5 / 4.0, 4.5];
        for (at, (weight, b)) in truth.weights.iter().zip(around).enumerate() {
            assert!((weight * (b * b + 0.01) - 1.0f64).abs() < 1e-6, "pixel {at}: {weight}");
        }
    }

    #[test]
    fn references_of_another_size_are_refused() {
        let cell = |x, y, width, height| Cell { x, y, width, height };
        let said = |reference: &Found, cell, full| Truth::new(reference, cell, full).unwrap_err().to_string();
        let whole = found(&[1.0; 6], 3);
        assert!(said(&whole, cell(0, 0, 4, 2), (4, 2)).contains("-r 3 2"));
        let part = Found { full: (6, 2), ..whole.clone() };
        assert!(said(&part, cell(2, 0, 4, 2), (6, 2)).contains("-p 2 0 1 2"));
        let (truth, _) = Truth::new(&whole, cell(1, 1, 2, 1), (3, 2)).unwrap();
        assert_eq!(truth.colours.len(), 2);
        let black_hole = Found { variance: Some(vec![[f32::INFINITY; 3]; 6]), ..whole };
        assert!(said(&black_hole, cell(0, 0, 3, 2), (3, 2)).contains("finite standard error"));
    }
}
