//! What the renders of a configuration say.

use super::Run;
use super::truth::Truth;
use crate::accumulate::Spread;
use crate::bench::probe::Reading;
use crate::bench::statistics::Quartiles;
use crate::compare::bias::Estimate;
use serde::Serialize;

/// Figures of one configuration. A number that cannot be known is NaN.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// Renders.
    pub runs: usize,
    /// Seconds of a render: of those that nothing disturbed, or of all if hardly any was undisturbed.
    pub seconds: Quartiles,
    /// Renders that something else on the machine disturbed.
    pub disturbed: usize,
    /// Rays a second, of the same renders.
    pub rays_a_second: Quartiles,
    /// Mean samples a pixel.
    pub samples: f64,
    /// Samples left out because they were not finite.
    pub non_finite: u64,
    /// Mean squared error of a render, the noise of the reference taken off.
    pub mse: Estimate,
    /// relMSE (ε = 0.01), likewise.
    pub relmse: Estimate,
    /// The part of `mse` that more samples do not take away; it may come out below 0.
    pub bias2: Estimate,
    /// As `bias2`, each pixel weighted by 1 over the squared brightness around it ([`Truth::weights`]), so that noise where it is bright
    /// hides no bias elsewhere: what tells whether there is any.
    pub bias_test: Estimate,
    /// The part of `mse` that differs from seed to seed.
    pub variance: Estimate,
    /// Mean squared error that the reference's own noise adds to every render, taken off above; 0 if unknown.
    pub reference_noise: f64,
    /// 1 / (MSE × seconds).
    pub efficiency: Estimate,
}

impl Figures {
    /// Of the renders of a configuration; none if there are none. `best`: of all probes, see [`best_reading`].
    ///
    /// With x the renders, m their mean, s² the variance between them, r the reference and v its variance, E (x − r)² =
    /// bias² + s² + v in every channel of every pixel, and (m − r)² − s²/N − v estimates bias² without bias. The error of MSE and
    /// variance is that of a mean over renders, which supposes nothing; that of bias² follows from its spread over pixels, which
    /// supposes that pixels are independent.
    pub fn of(runs: &[Run], spread: &Spread, truth: &Truth, best: Reading) -> Option<Figures> {
        let n = runs.len();
        if n == 0 {
            return None;
        }
        let undisturbed: Vec<&Run> = runs.iter().filter(|run| !run.probe.is_disturbed(best)).collect();
        let disturbed = n - undisturbed.len();
        let timed: Vec<&Run> = if undisturbed.len() < FEWEST { runs.iter().collect() } else { undisturbed };
        let seconds = Quartiles::of(timed.iter().map(|run| run.seconds));

        let noise = truth.mean(|at, c| truth.noise(at, c));
        let relative_noise = truth.mean(|at, c| truth.noise(at, c) * truth.weight(at, c));
        let raw = Estimate::of_mean(runs.iter().map(|run| run.mse));
        let relative = Estimate::of_mean(runs.iter().map(|run| run.relmse));
        // The reference's squared errors are what their variances say only on average: χ² of each pixel, whose channels depend on
        // each other.
        let pixels = truth.count as f64;
        let squares = |weight: &dyn Fn(usize, usize) -> f64| {
            let pixel = |at: usize| (0..3).map(|c| truth.noise(at, c) * weight(at, c)).sum::<f64>() / 3.0;
            (2.0 * truth.pixels().map(|at| pixel(at).powi(2)).sum::<f64>()).sqrt() / pixels
        };
        let mse = Estimate { value: raw.value - noise, error: raw.error.hypot(squares(&|_, _| 1.0)) };
        let relmse = Estimate {
            value: relative.value - relative_noise,
            error: relative.error.hypot(squares(&|at, c| truth.weight(at, c))),
        };
        let left = |at: usize| {
            let variance = spread.variance(at);
            let channel = |c: usize| {
                (spread.mean[at][c] - truth.colours[at][c]).powi(2) - variance[c] / n as f64 - truth.noise(at, c)
            };
            (0..3).map(channel).sum::<f64>() / 3.0
        };
        let unknown = Estimate { value: f64::NAN, error: f64::NAN };
        let several = n > 1;
        let bias2 = if several { Estimate::of_mean(truth.pixels().map(left)) } else { unknown };
        let bias_test = match several {
            true => Estimate::of_mean(truth.pixels().map(|at| truth.weights[at] * left(at))),
            false => unknown,
        };
        let variance = match several {
            true => Estimate { value: truth.mean(|at, c| spread.variance(at)[c]), error: raw.error },
            false => unknown,
        };
        let efficiency = 1.0 / (mse.value * seconds.median);
        let relative_error = (mse.error / mse.value).hypot(error_of_median(seconds, timed.len()) / seconds.median);
        Some(Figures {
            runs: n,
            seconds,
            disturbed,
            rays_a_second: Quartiles::of(timed.iter().map(|run| run.rays as f64 / run.seconds)),
            samples: runs.iter().map(|run| run.samples as f64).sum::<f64>() / (n * truth.colours.len()) as f64,
            non_finite: runs.iter().map(|run| run.non_finite).sum(),
            mse,
            relmse,
            bias2,
            bias_test,
            variance,
            reference_noise: noise,
            efficiency: Estimate { value: efficiency, error: (efficiency * relative_error).abs() },
        })
    }

    /// Whether bias cannot be told from 0: its test is no more than `limit` standard errors above.
    pub fn bias_is_in_the_noise(&self, limit: f64) -> bool {
        // What is not a number tells nothing.
        let z = self.bias_test.z();
        z.is_nan() || z <= limit
    }
}

/// With fewer undisturbed renders than this all count: one has no spread.
const FEWEST: usize = 2;

/// The best reading of all probes: what the machine does when nothing else runs on it.
pub fn best_reading<'a>(runs: impl Iterator<Item = &'a Run>) -> Reading {
    let none = Reading { compute: f64::INFINITY, memory: f64::INFINITY };
    runs.fold(none, |best, run| best.min(run.probe))
}

/// Standard error of a median of `n` numbers: that of normal ones with such quartiles, whose distance is 1.349 standard deviations;
/// the median of many has 1.2533 times the error of their mean.
fn error_of_median(quartiles: Quartiles, n: usize) -> f64 {
    1.2533 * (quartiles.high - quartiles.low) / 1.349 / (n as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::read::Found;
    use crate::options::Cell;

    const STILL: Reading = Reading { compute: 1.0, memory: 1.0 };

    fn truth(values: Vec<[f32; 3]>, variance: Option<f32>) -> Truth {
        let n = values.len();
        let variance = variance.map(|v| vec![[v; 3]; n]);
        let found = Found { width: n, height: 1, full: (n, 1), colours: values, variance, ..Found::default() };
        Truth::new(&found, Cell { x: 0, y: 0, width: n as u32, height: 1 }, (n as u32, 1)).unwrap().0
    }

    /// Numbers of mean 0 and variance 1, normal but for their tails: sums of twelve from a congruential generator, the same in every run.
    fn noise(state: &mut u64) -> f64 {
        let mut even = || {
            *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (*state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        (0..12).map(|_| even()).sum()
    }

    /// Figures of `n` renders of `pixels` grey pixels of 0.5, with noise of standard deviation `sigma` and an offset.
    fn figures(pixels: usize, n: u32, sigma: f64, offset: f64, reference_sigma: f64, state: &mut u64) -> Figures {
        let reference: Vec<[f32; 3]> =
            (0..pixels).map(|_| [(0.5 + reference_sigma * noise(state)) as f32; 3]).collect();
        let truth = truth(reference, Some((reference_sigma * reference_sigma) as f32));
        let mut spread = Spread::new(pixels);
        let runs: Vec<Run> = (0..n)
            .map(|run| {
                let picture: Vec<[f32; 3]> =
                    (0..pixels).map(|_| [(0.5 + offset + sigma * noise(state)) as f32; 3]).collect();
                spread.add(&picture, 1.0).unwrap();
                let [mse, relmse] = truth.errors(&picture);
                let (rays, samples) = (1000, pixels as u64 * 4);
                let seconds = 0.5;
                Run {
                    configuration: 0,
                    run,
                    seed: run,
                    seconds,
                    rays,
                    samples,
                    non_finite: 0,
                    mse,
                    relmse,
                    probe: STILL,
                }
            })
            .collect();
        Figures::of(&runs, &spread, &truth, STILL).unwrap()
    }

    #[test]
    fn a_known_variance_and_a_known_bias_are_told_apart() {
        let mut state = 1;
        let f = figures(4000, 16, 0.2, 0.1, 0.05, &mut state);
        for (what, got, want) in [("mse", f.mse, 0.05), ("bias²", f.bias2, 0.01), ("variance", f.variance, 0.04)] {
            let z = (got.value - want) / got.error;
            assert!(z.abs() < 4.0 && got.error < 0.05 * want, "{what}: {got:?}, z {z}");
        }
        assert!((f.reference_noise - 0.0025).abs() < 1e-8);
        // The parts add up, exactly.
        assert!((f.bias2.value + f.variance.value - f.mse.value).abs() < 1e-12);
        assert!((f.efficiency.value - 1.0 / (f.mse.value * 0.5)).abs() < 1e-9);
        assert_eq!((f.runs, f.samples, f.disturbed, f.rays_a_second.median), (16, 4.0, 0, 2000.0));
        assert!(!f.bias_is_in_the_noise(3.0));
    }

    /// Error bars are those of normal errors: over many trades, z has mean 0 and variance 1.
    #[test]
    fn error_bars_cover() {
        let (mut state, trials) = (7, 300);
        let mut z = [[0.0; 2]; 3];
        for _ in 0..trials {
            let f = figures(150, 8, 0.2, 0.0, 0.1, &mut state);
            for (z, (got, want)) in z.iter_mut().zip([(f.mse, 0.04), (f.bias2, 0.0), (f.bias_test, 0.0)]) {
                let value = (got.value - want) / got.error;
                *z = [z[0] + value, z[1] + value * value];
            }
        }
        for (what, [sum, squares]) in ["mse", "bias²", "bias test"].iter().zip(z) {
            let (mean, variance) = (sum / f64::from(trials), squares / f64::from(trials));
            println!("{what}: z of mean {mean:.3} and mean square {variance:.3}");
            // Student's t of 7 degrees of freedom has a variance of 1.4; 300 trials have an error of 0.06 and 0.15.
            assert!(mean.abs() < 0.25, "{what}: {mean}");
            assert!((0.6..2.0).contains(&variance), "{what}: {variance}");
        }
    }

    #[test]
    fn a_bias_below_the_noise_is_said_to_be() {
        let mut state = 3;
        let f = figures(2000, 12, 0.2, 0.0, 0.02, &mut state);
        assert!(f.bias_is_in_the_noise(3.0), "{:?}", f.bias2);
    }

    #[test]
    fn one_render_says_nothing_of_its_error() {
        let f = figures(50, 1, 0.2, 0.0, 0.0, &mut 5);
        assert!(
            f.mse.value > 0.0
                && f.mse.error.is_nan()
                && f.bias2.value.is_nan()
                && f.bias_test.value.is_nan()
                && f.variance.value.is_nan()
        );
        assert!(f.bias_is_in_the_noise(3.0));
        assert_eq!(Figures::of(&[], &Spread::new(1), &truth(vec![[1.0; 3]], None), STILL), None);
    }
}
