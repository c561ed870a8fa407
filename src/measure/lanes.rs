//! How full the vectors of a loop are.

use serde::Serialize;

/// Lanes of a vector loop: what Embree's statistics call active and total (`common/stat.h`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Lanes {
    /// Vectors computed: how often the loop's body was reached.
    pub reached: u64,
    /// Their lanes that held something to compute.
    pub active: u64,
    /// All their lanes.
    pub total: u64,
}

impl Lanes {
    /// A loop over `rows` rows, `width` at a time.
    pub fn over(rows: usize, width: usize) -> Lanes {
        let reached = rows.div_ceil(width) as u64;
        Lanes { reached, active: rows as u64, total: reached * width as u64 }
    }

    /// Share of lanes that were active; `None` if the loop was never reached.
    pub fn share(&self) -> Option<f64> {
        (self.total > 0).then(|| self.active as f64 / self.total as f64)
    }
}

impl std::ops::AddAssign for Lanes {
    fn add_assign(&mut self, other: Lanes) {
        self.reached += other.reached;
        self.active += other.active;
        self.total += other.total;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_vector_may_be_part_empty() {
        let mut lanes = Lanes::over(9, 4);
        assert_eq!(lanes, Lanes { reached: 3, active: 9, total: 12 });
        lanes += Lanes::over(0, 4);
        assert_eq!(lanes.share(), Some(0.75));
        assert_eq!(Lanes::default().share(), None);
    }
}
