//! Medians and quartiles.

use serde::{Deserialize, Serialize};

/// Median and quartiles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quartiles {
    /// A quarter of the values are below.
    pub low: f64,
    /// Half of the values are below.
    pub median: f64,
    /// Three quarters of the values are below.
    pub high: f64,
}

impl Quartiles {
    /// Of `values`, between neighbours by weight; not a number if there are none.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Quartiles {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let at = |fraction: f64| {
            let Some(last) = values.len().checked_sub(1) else { return f64::NAN };
            let place = fraction * last as f64;
            let (below, part) = (place.floor() as usize, place.fract());
            // Not as a weighted sum, which is not a number beside an infinite neighbour of weight 0.
            let step = values[(below + 1).min(last)] - values[below];
            if part > 0.0 { values[below] + step * part } else { values[below] }
        };
        Quartiles { low: at(0.25), median: at(0.5), high: at(0.75) }
    }

    /// Neither is clearly larger: the median of one lies within the quartiles of the other.
    pub fn ties(&self, other: &Quartiles) -> bool {
        let within = |median: f64, of: &Quartiles| (of.low..=of.high).contains(&median);
        within(self.median, other) || within(other.median, self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_lie_between_neighbours() {
        let of = |values: &[f64]| {
            let q = Quartiles::of(values.iter().copied());
            (q.low, q.median, q.high)
        };
        assert_eq!(of(&[3.0]), (3.0, 3.0, 3.0));
        assert_eq!(of(&[2.0, 1.0]), (1.25, 1.5, 1.75));
        assert_eq!(of(&[5.0, 1.0, 4.0, 2.0, 3.0]), (2.0, 3.0, 4.0));
        assert!(Quartiles::of([]).median.is_nan());
        assert_eq!(of(&[1.0, 2.0, f64::INFINITY]).1, 2.0);
    }

    #[test]
    fn a_tie_is_a_median_within_the_others_quartiles() {
        let q = |low, median, high| Quartiles { low, median, high };
        assert!(q(1.0, 2.0, 3.0).ties(&q(1.9, 2.5, 4.0)));
        assert!(q(1.0, 2.0, 5.0).ties(&q(4.0, 4.5, 4.6)), "the narrow one lies within the wide one");
        assert!(!q(1.0, 2.0, 3.0).ties(&q(2.5, 3.5, 4.0)), "overlapping quartiles alone are no tie");
    }
}
