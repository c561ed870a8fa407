//! Where rays leave, in single or in double precision.

use crate::sampling::v3::V3;
use glam::{DVec3, Vec3};

/// A point in single precision, or in double precision as the sum of two numbers for each axis: 48 bits, and so that tables of 32-bit
/// columns hold it (Dekker, "A floating-point technique for extending the available precision", 1971).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Origin {
    /// The point, rounded.
    pub high: V3,
    /// What rounding left, itself rounded; `None` in single precision.
    pub low: Option<V3>,
}

impl Origin {
    /// In double precision.
    #[inline(always)]
    pub fn double(point: DVec3) -> Origin {
        let (high, low) = split(point);
        Origin { high: high.into(), low: Some(low.into()) }
    }

    /// The point, exactly.
    #[inline(always)]
    pub fn wide(self) -> DVec3 {
        let high = Vec3::from(self.high).as_dvec3();
        self.low.map_or(high, |low| high + Vec3::from(low).as_dvec3())
    }
}

impl From<V3> for Origin {
    #[inline(always)]
    fn from(high: V3) -> Origin {
        Origin { high, low: None }
    }
}

impl From<Vec3> for Origin {
    #[inline(always)]
    fn from(high: Vec3) -> Origin {
        V3::from(high).into()
    }
}

/// A point as the sum of two vectors, the second no longer than half a unit in the last place of the first. The sum is a number of 48 bits, and
/// the same when split again.
#[inline(always)]
pub fn split(point: DVec3) -> (Vec3, Vec3) {
    let high = point.as_vec3();
    (high, (point - high.as_dvec3()).as_vec3())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn two_numbers_hold_48_bits(x in -1e9f64..1e9, y in prop::num::f64::NORMAL, z in -1e-9f64..1e-9) {
            let y = if y.abs() < 1e30 && y.abs() > 1e-20 { y } else { 0.0 };
            let point = DVec3::new(x, y, z);
            let origin = Origin::double(point);
            for (sum, exact) in origin.wide().to_array().into_iter().zip(point.to_array()) {
                prop_assert!((sum - exact).abs() <= exact.abs() * 0.5f64.powi(48) + 1e-45);
            }
            prop_assert_eq!(Origin::double(origin.wide()).wide(), origin.wide());
        }
    }

    #[test]
    fn single_precision_has_no_lower_part() {
        let origin = Origin::from(V3::new(1.0, -2.5, 3e7));
        assert_eq!((origin.low, origin.wide()), (None, DVec3::new(1.0, -2.5, 3e7)));
    }
}
