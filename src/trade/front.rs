//! Which configurations no other beats in both time and error.

use crate::bench::statistics::Quartiles;
use crate::compare::bias::Estimate;
use serde::Serialize;

/// Where a configuration stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Place {
    /// On the Pareto front: none is as fast and as right, and better in one.
    Front,
    /// Behind the front, but not clearly so: who beats it ties with it in time, or differs in error by less than two standard errors.
    Tie,
    /// Another is both faster and more accurate.
    Behind,
    /// Its time or error is not known.
    Unknown,
}

/// Of points of time and error, in their order.
pub fn places(points: &[Option<(Quartiles, Estimate)>]) -> Vec<Place> {
    let known: Vec<&(Quartiles, Estimate)> = points.iter().flatten().filter(|p| is_known(p)).collect();
    points
        .iter()
        .map(|point| {
            let Some(point) = point.as_ref().filter(|p| is_known(p)) else { return Place::Unknown };
            let better: Vec<_> = known.iter().filter(|other| beats(other, point)).collect();
            match better.is_empty() {
                true => Place::Front,
                false if better.iter().any(|other| clearly(other, point)) => Place::Behind,
                false => Place::Tie,
            }
        })
        .collect()
}

fn is_known((time, error): &(Quartiles, Estimate)) -> bool {
    time.median.is_finite() && error.value.is_finite()
}

fn beats(a: &(Quartiles, Estimate), b: &(Quartiles, Estimate)) -> bool {
    let (times, errors) = ([a.0.median, b.0.median], [a.1.value, b.1.value]);
    times[0] <= times[1] && errors[0] <= errors[1] && (times[0] < times[1] || errors[0] < errors[1])
}

fn clearly(a: &(Quartiles, Estimate), b: &(Quartiles, Estimate)) -> bool {
    let apart = (b.1.value - a.1.value) / a.1.error.hypot(b.1.error);
    // Without errors nothing is clear.
    !a.0.ties(&b.0) && apart > 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(seconds: f64, mse: f64) -> Option<(Quartiles, Estimate)> {
        let time = Quartiles { low: 0.95 * seconds, median: seconds, high: 1.05 * seconds };
        Some((time, Estimate { value: mse, error: 0.01 * mse }))
    }

    #[test]
    fn the_front_is_what_nothing_beats() {
        let points = [
            point(1.0, 8.0),
            point(2.0, 4.0),
            point(2.2, 5.0),
            point(2.01, 4.02),
            point(4.0, 4.01),
            point(8.0, 1.0),
            point(9.0, 6.0),
            None,
            point(f64::NAN, 1.0),
        ];
        let want = [
            Place::Front,
            Place::Front,
            Place::Behind,
            Place::Tie,
            Place::Tie,
            Place::Front,
            Place::Behind,
            Place::Unknown,
            Place::Unknown,
        ];
        assert_eq!(places(&points), want);
    }

    #[test]
    fn equals_are_all_on_the_front() {
        assert_eq!(places(&[point(1.0, 1.0), point(1.0, 1.0)]), [Place::Front; 2]);
        assert_eq!(places(&[]), []);
    }
}
