//! How fast the error falls with the number of samples.

use crate::compare::bias::Estimate;

/// Slope of log y against log x, with its error: −1 where samples are independent, nearer to 0 where bias is all that is left.
///
/// Weighted least squares: log y is as uncertain as the error of y says. Where points lie further from the line than that, the error
/// of the slope grows by the root of χ² by degree of freedom, for then no single slope fits. None if there are not two different x,
/// or a y is not above 0 or has no error.
pub fn slope(points: &[(f64, Estimate)]) -> Option<Estimate> {
    let logs: Vec<[f64; 3]> = points
        .iter()
        .map(|(x, y)| (x.ln(), y.value.ln(), y.value / y.error))
        .map(|(x, y, certainty)| [x, y, certainty * certainty])
        .collect();
    if logs.iter().flatten().any(|v| !v.is_finite()) {
        return None;
    }
    let sum = |f: &dyn Fn(&[f64; 3]) -> f64| logs.iter().map(|p| p[2] * f(p)).sum::<f64>();
    let all = sum(&|_| 1.0);
    let (x, y) = (sum(&|p| p[0]) / all, sum(&|p| p[1]) / all);
    let spread = sum(&|p| (p[0] - x).powi(2));
    if spread.is_nan() || spread <= 0.0 {
        return None;
    }
    let value = sum(&|p| (p[0] - x) * (p[1] - y)) / spread;
    let chi2 = sum(&|p| (p[1] - y - value * (p[0] - x)).powi(2));
    let degrees = logs.len().saturating_sub(2) as f64;
    let misfit = if degrees > 0.0 { (chi2 / degrees).sqrt().max(1.0) } else { 1.0 };
    Some(Estimate { value, error: misfit / spread.sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, value: f64, share: f64) -> (f64, Estimate) {
        (x, Estimate { value, error: share * value })
    }

    #[test]
    fn a_power_law_has_its_exponent() {
        for exponent in [-1.0, -1.5, 0.0] {
            let points: Vec<_> = [1.0f64, 4.0, 16.0, 64.0].map(|x| at(x, 3.0 * x.powf(exponent), 0.01)).to_vec();
            let slope = slope(&points).unwrap();
            assert!((slope.value - exponent).abs() < 1e-12, "{slope:?}");
            // σ / √Σ(x − x̄)²: the logarithms are 0, 1, 2, 3 times ln 4.
            assert!((slope.error - 0.01 / (4f64.ln() * 5f64.sqrt())).abs() < 1e-12, "{slope:?}");
        }
    }

    #[test]
    fn uncertain_points_weigh_little_and_a_bad_fit_is_uncertain() {
        let bent = slope(&[at(1.0, 1.0, 0.01), at(10.0, 0.1, 0.01), at(100.0, 0.1, 10.0)]).unwrap();
        assert!((bent.value + 1.0).abs() < 1e-3, "{bent:?}");
        let [fits, misfits] =
            [0.01, 0.1].map(|y| slope(&[at(1.0, 1.0, 0.01), at(10.0, 0.1, 0.01), at(100.0, y, 0.01)]));
        assert!(misfits.unwrap().error > 10.0 * fits.unwrap().error);
    }

    #[test]
    fn what_has_no_slope_has_none() {
        assert_eq!(slope(&[]), None);
        assert_eq!(slope(&[at(1.0, 1.0, 0.1)]), None);
        assert_eq!(slope(&[at(2.0, 1.0, 0.1), at(2.0, 3.0, 0.1)]), None);
        assert_eq!(slope(&[at(1.0, 1.0, 0.1), at(2.0, -1.0, 0.1)]), None);
        assert_eq!(slope(&[at(1.0, 1.0, 0.1), (2.0, Estimate { value: 0.5, error: f64::NAN })]), None);
    }
}
