//! Two pictures laid over each other, and which of their pixels count.

use serde::Serialize;

use super::{Channels, luminance};
use crate::error::{Error, Note, Result};
use crate::film::read::Found;
use crate::options::Cell;

/// The part of two pictures that is compared. Layers have `width · height` entries, top row first.
#[derive(Clone, Debug, Default)]
pub struct Pair {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Left edge within the frame.
    pub x: usize,
    /// Top edge within the frame.
    pub y: usize,
    /// The picture.
    pub a: Vec<[f32; 3]>,
    /// The reference.
    pub b: Vec<[f32; 3]>,
    /// Variance of the mean of each channel of A, if known.
    pub variance_a: Option<Vec<[f32; 3]>>,
    /// Variance of the mean of each channel of B, if known.
    pub variance_b: Option<Vec<[f32; 3]>>,
    /// Both pixels are finite.
    pub usable: Vec<bool>,
    /// Pixels that are not.
    pub left_out: LeftOut,
}

/// Pixels with a NaN or an infinity, which no metric counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// Of A.
    pub a: usize,
    /// Of B.
    pub b: usize,
    /// Of either.
    pub either: usize,
}

impl Pair {
    /// Lays the pictures over each other and cuts out what both have, or the part of that which `crop` asks for (in pixels
    /// of the frame).
    ///
    /// # Errors
    /// [`Error::Pictures`] if their frames are of different sizes or their parts do not overlap, or if no pixel is finite
    /// in both; [`Error::Options`] if `crop` leaves what both have.
    pub fn new(a: &Found, b: &Found, crop: Option<Cell>) -> Result<(Pair, Vec<Note>)> {
        if a.full != b.full {
            let [a, b] = [a.full, b.full].map(|(w, h)| format!("{w} × {h}"));
            return Err(Error::Pictures(format!("the pictures differ in size: A has {a} pixels, B has {b}")));
        }
        let [window_a, window_b] = [a, b].map(|p| Window { from: [p.x, p.y], to: [p.x + p.width, p.y + p.height] });
        let common = window_a.and(window_b).ok_or_else(|| {
            Error::Pictures(format!(
                "the parts that the pictures hold do not overlap: A has {window_a}, B has {window_b}"
            ))
        })?;
        let mut notes = Vec::new();
        if window_a != window_b {
            notes.push(Note::warning(format!(
                "A holds {window_a} of the frame, B {window_b}: what both hold is compared, {common}"
            )));
        }
        let window = match crop {
            None => common,
            Some(cell) => {
                let [x, y] = [cell.x as usize, cell.y as usize];
                let wanted = Window { from: [x, y], to: [x + cell.width as usize, y + cell.height as usize] };
                common.and(wanted).filter(|inside| *inside == wanted).ok_or_else(|| {
                    Error::Options(format!("--crop asks for {wanted}, but both pictures hold {common}"))
                })?
            }
        };
        let pair = Pair::of(
            window,
            [window.cut(&a.colours, window_a), window.cut(&b.colours, window_b)],
            [(&a.variance, window_a), (&b.variance, window_b)]
                .map(|(layer, held)| layer.as_ref().map(|layer| window.cut(layer, held))),
        );
        if pair.count() == 0 {
            return Err(Error::Pictures("no pixel is finite in both pictures: there is nothing to compare".into()));
        }
        if pair.left_out.either > 0 {
            let LeftOut { a, b, either } = pair.left_out;
            notes.push(Note::warning(format!(
                "{either} of {} pixels are left out, as they are not finite ({a} of A, {b} of B); SSIM and FLIP see them \
                 black in both",
                pair.usable.len()
            )));
        }
        Ok((pair, notes))
    }

    fn of(window: Window, [a, b]: [Vec<[f32; 3]>; 2], [variance_a, variance_b]: [Option<Vec<[f32; 3]>>; 2]) -> Pair {
        let finite = |pixel: &[f32; 3]| pixel.iter().all(|c| c.is_finite());
        let usable: Vec<bool> = a.iter().zip(&b).map(|(a, b)| finite(a) && finite(b)).collect();
        let bad = |layer: &[[f32; 3]]| layer.iter().filter(|pixel| !finite(pixel)).count();
        let left_out = LeftOut { a: bad(&a), b: bad(&b), either: usable.iter().filter(|usable| !**usable).count() };
        let [width, height] = window.size();
        let [x, y] = window.from;
        Pair { width, height, x, y, a, b, variance_a, variance_b, usable, left_out }
    }

    /// How many pixels count.
    pub fn count(&self) -> usize {
        self.usable.len() - self.left_out.either
    }

    /// Indices of the pixels that count, in order.
    pub fn indices(&self) -> impl Iterator<Item = usize> + '_ {
        self.usable.iter().enumerate().filter(|(_, usable)| **usable).map(|(at, _)| at)
    }

    /// Colours of a pixel: A, B.
    pub fn pixel(&self, at: usize) -> [[f64; 3]; 2] {
        [self.a[at].map(f64::from), self.b[at].map(f64::from)]
    }

    /// Mean of a number of each pixel that counts.
    pub fn mean_of(&self, f: impl Fn(usize) -> f64) -> f64 {
        self.indices().map(f).sum::<f64>() / self.count() as f64
    }

    /// Mean of a function of A's and B's channels.
    pub fn mean(&self, f: impl Fn(f64, f64) -> f64) -> Channels {
        let n = self.count() as f64;
        let sum = self.fold(f, |sum, value| sum + value);
        let each = [sum[0] / n, sum[1] / n, sum[2] / n];
        Channels { rgb: each.iter().sum::<f64>() / 3.0, each, luminance: sum[3] / n }
    }

    /// Folds a function of A's and B's channels over pixels, from 0: red, green, blue, luminance.
    pub(super) fn fold(&self, f: impl Fn(f64, f64) -> f64, mut with: impl FnMut(f64, f64) -> f64) -> [f64; 4] {
        let mut folded = [0.0; 4];
        for at in self.indices() {
            let [a, b] = self.pixel(at);
            for c in 0..3 {
                folded[c] = with(folded[c], f(a[c], b[c]));
            }
            folded[3] = with(folded[3], f(luminance(a), luminance(b)));
        }
        folded
    }

    /// Variance of the difference of each channel, if that of A or of B is known; a picture without counts as exact.
    ///
    /// None for a pixel where one is negative or not finite: one sample says nothing of its variance.
    pub fn variance(&self, at: usize) -> Option<[f64; 3]> {
        let mut sum = [0.0; 3];
        for layer in [&self.variance_a, &self.variance_b].into_iter().flatten() {
            sum.iter_mut().zip(layer[at]).for_each(|(sum, v)| *sum += if v >= 0.0 { f64::from(v) } else { f64::NAN });
        }
        sum.iter().all(|v| v.is_finite()).then_some(sum)
    }

    /// Whether the variance of A or of B is known.
    pub fn has_variance(&self) -> bool {
        self.variance_a.is_some() || self.variance_b.is_some()
    }
}

/// Pixels of a frame.
#[derive(Clone, Copy, PartialEq)]
struct Window {
    /// Left, top.
    from: [usize; 2],
    /// Right, bottom: the first that are not part of it.
    to: [usize; 2],
}

impl Window {
    fn size(&self) -> [usize; 2] {
        [self.to[0] - self.from[0], self.to[1] - self.from[1]]
    }

    fn and(self, other: Window) -> Option<Window> {
        let [from, to] = [[0, 1].map(|i| self.from[i].max(other.from[i])), [0, 1].map(|i| self.to[i].min(other.to[i]))];
        (from[0] < to[0] && from[1] < to[1]).then_some(Window { from, to })
    }

    /// These pixels of a layer of `held`, which holds all of them.
    fn cut(&self, layer: &[[f32; 3]], held: Window) -> Vec<[f32; 3]> {
        let across = held.size()[0];
        let left = self.from[0] - held.from[0];
        let rows = layer.chunks_exact(across).skip(self.from[1] - held.from[1]).take(self.size()[1]);
        rows.flat_map(|row| row[left..left + self.size()[0]].iter().copied()).collect()
    }
}

impl std::fmt::Display for Window {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [width, height] = self.size();
        write!(f, "{width} × {height} pixels at ({}, {})", self.from[0], self.from[1])
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A pair of whole pictures.
    pub fn pair(width: usize, a: Vec<[f32; 3]>, b: Vec<[f32; 3]>) -> Pair {
        let height = a.len() / width;
        let found = |colours| Found { width, height, full: (width, height), colours, ..Found::default() };
        Pair::new(&found(a), &found(b), None).unwrap().0
    }

    /// A picture of whole-number arithmetic that others can repeat: `k` of `0..`, 48 × 36 by default.
    pub fn pattern(k: usize, width: usize, height: usize) -> Vec<[f32; 3]> {
        let value = |x: usize, y: usize, c: usize| {
            ((x * (3 + c) + y * (5 - c) * k + x * y * (c + k)) % (31 + 7 * c)) as f32 / (30 + 7 * c) as f32
        };
        (0..width * height).map(|i| [0, 1, 2].map(|c| value(i % width, i / width, c))).collect()
    }

    #[test]
    fn parts_are_compared_where_both_are() {
        let full = (6, 4);
        let colours: Vec<[f32; 3]> = (0..24).map(|i| [i as f32; 3]).collect();
        let whole = Found { width: 6, height: 4, full, colours, ..Found::default() };
        let part = Found { width: 2, height: 2, x: 3, y: 1, full, colours: vec![[0.0; 3]; 4], ..Found::default() };
        let (pair, notes) = Pair::new(&whole, &part, None).unwrap();
        assert_eq!((pair.width, pair.height, pair.x, pair.y), (2, 2, 3, 1));
        assert_eq!(pair.a.iter().map(|p| p[0]).collect::<Vec<_>>(), [9.0, 10.0, 15.0, 16.0]);
        assert!(notes[0].text.contains("2 × 2 pixels at (3, 1)"), "{notes:?}");

        let cell = |x, y, width, height| Some(Cell { x, y, width, height });
        let (cropped, _) = Pair::new(&whole, &part, cell(4, 2, 1, 1)).unwrap();
        assert_eq!(cropped.a, [[16.0; 3]]);
        assert!(matches!(Pair::new(&whole, &part, cell(2, 2, 2, 1)), Err(Error::Options(_))));
        let apart = Found { x: 0, y: 0, ..part.clone() };
        assert!(Pair::new(&apart, &part, None).unwrap_err().to_string().contains("do not overlap"));
        let other = Found { full: (6, 5), ..part.clone() };
        assert!(Pair::new(&other, &part, None).unwrap_err().to_string().contains("A has 6 × 5 pixels, B has 6 × 4"));
    }

    #[test]
    fn pixels_that_are_not_finite_are_counted_and_left_out() {
        let [one, nan, inf] = [[1.0; 3], [1.0, f32::NAN, 1.0], [f32::INFINITY, 1.0, 1.0]];
        let pair = pair(4, vec![one, nan, one, nan], vec![[3.0; 3], one, inf, inf]);
        assert_eq!(pair.left_out, LeftOut { a: 2, b: 2, either: 3 });
        assert_eq!(pair.mean(|a, b| b - a).each, [2.0; 3]);
        let found = |colours| Found { width: 1, height: 1, full: (1, 1), colours, ..Found::default() };
        assert!(Pair::new(&found(vec![nan]), &found(vec![one]), None).is_err());
    }
}
