//! The smaller and the larger of two numbers, as one comparison says.
//!
//! `f32::min` and `f32::max` give the number where the other is none, which takes more than one instruction, and do not say which zero they give.
//! Where that matters, or where a loop is to become vectors, these are used.

/// `a < b ? a : b`: the second if one is NaN.
#[inline(always)]
pub fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// `a > b ? a : b`: the second if one is NaN.
#[inline(always)]
pub fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_is_taken_where_neither_is_less() {
        assert_eq!((min(1.0, 2.0), min(2.0, 1.0), max(1.0, 2.0), max(2.0, 1.0)), (1.0, 1.0, 2.0, 2.0));
        assert_eq!((min(f32::NAN, 1.0), max(f32::NAN, 1.0)), (1.0, 1.0));
        assert!(min(1.0, f32::NAN).is_nan() && max(1.0, f32::NAN).is_nan());
        assert!(min(0.0, -0.0).is_sign_negative() && max(-0.0, 0.0).is_sign_positive());
        assert!(min(-0.0, 0.0).is_sign_positive() && max(0.0, -0.0).is_sign_negative());
    }
}
