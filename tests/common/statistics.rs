//! Means with standard errors, and how far they may lie from what they should be.

pub use comber::compare::z_test::sidak;
use comber::film::picture::Picture;
use comber::options::Cell;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Chance that a family of tests rejects a program that is right.
pub const ALPHA: f64 = 0.01;

/// An estimate.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    pub mean: f64,
    pub error: f64,
}

impl Estimate {
    /// Of independent observations.
    pub fn of(observations: &[f64]) -> Estimate {
        let n = observations.len() as f64;
        let mean = observations.iter().sum::<f64>() / n;
        let squares: f64 = observations.iter().map(|x| (x - mean).powi(2)).sum();
        Estimate { mean, error: (squares / (n - 1.0) / n).sqrt() }
    }

    /// Mean of a channel over `cell` of a picture with variances: pixels are independent.
    pub fn of_pixels(picture: &Picture, cell: Cell, channel: usize) -> Estimate {
        let variance = picture.variance.as_ref().expect("variance layer");
        let (mut mean, mut squared) = (0.0, 0.0);
        for y in cell.y..cell.y + cell.height {
            for x in cell.x..cell.x + cell.width {
                let i = y as usize * picture.width + x as usize;
                mean += f64::from(picture.beauty[i][channel]);
                squared += f64::from(variance[i][channel]);
            }
        }
        let n = f64::from(cell.width * cell.height);
        Estimate { mean: mean / n, error: squared.sqrt() / n }
    }

    /// Distance from `expected` in standard errors; where there is no error, there may be no distance.
    pub fn z(self, expected: f64) -> f64 {
        let distance = self.mean - expected;
        if distance == 0.0 { 0.0 } else { distance / self.error }
    }

    /// Distance from another, independent estimate in standard errors of the difference (Welch).
    pub fn z_from(self, other: Estimate) -> f64 {
        Estimate { mean: self.mean - other.mean, error: self.error.hypot(other.error) }.z(0.0)
    }
}

/// The cells of a grid over a picture.
pub fn regions(width: u32, height: u32, across: u32, down: u32) -> Vec<Cell> {
    let cell = |x: u32, y: u32| {
        let (left, right) = (width * x / across, width * (x + 1) / across);
        let (top, bottom) = (height * y / down, height * (y + 1) / down);
        Cell { x: left, y: top, width: right - left, height: bottom - top }
    };
    (0..down).flat_map(|y| (0..across).map(move |x| cell(x, y))).collect()
}

/// Two-sided tests of one claim, judged together: the largest of all is compared with the limit that all stay below with
/// probability 1 − α if the claim is true (Šidák 1967).
#[derive(Debug)]
pub struct Family {
    claim: String,
    tests: usize,
    worst: (f64, String),
}

impl Family {
    pub fn new(claim: impl Into<String>) -> Family {
        Family { claim: claim.into(), tests: 0, worst: (0.0, String::new()) }
    }

    /// Adds the outcome of one test.
    pub fn add(&mut self, z: f64, what: impl Into<String>) {
        self.tests += 1;
        // A test that is not a number is the worst of all, and stays it.
        if z.is_nan() || z.abs() > self.worst.0.abs() {
            self.worst = (z, what.into());
        }
    }

    /// Prints the figures, and fails if the claim is not tenable.
    pub fn check(self) {
        let limit = sidak(ALPHA, self.tests);
        let (worst, at) = &self.worst;
        println!("{}: {} tests, largest z {worst:+.2} of {limit:.2} ({at})", self.claim, self.tests);
        assert!(worst.abs() <= limit, "{}: z = {worst:+.2} beyond {limit:.2} at {at}", self.claim);
    }
}

/// The t that Student's variable of `n − 1` degrees of freedom stays below with probability 1 − `alpha`.
pub fn student(alpha: f64, n: usize) -> f64 {
    StudentsT::new(0.0, 1.0, n as f64 - 1.0).expect("n > 1").inverse_cdf(1.0 - alpha)
}
