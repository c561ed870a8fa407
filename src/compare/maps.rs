//! Differences to look at: a number for each pixel, NaN where a pixel does not count.

use super::luminance;
use super::pair::Pair;
use super::z_test;

/// A − B of luminance.
pub fn signed(pair: &Pair) -> Vec<f32> {
    of(pair, |at| {
        let [a, b] = pair.pixel(at).map(luminance);
        Some(a - b)
    })
}

/// |A − B| / (|B| + ε) of luminance.
pub fn relative(pair: &Pair, epsilon: f64) -> Vec<f32> {
    of(pair, |at| {
        let [a, b] = pair.pixel(at).map(luminance);
        Some((a - b).abs() / (b.abs() + epsilon))
    })
}

/// The z of the channel where it is largest; zero where neither picture has variance and both are the same.
pub fn z(pair: &Pair) -> Vec<f32> {
    of(pair, |at| {
        let channels = z_test::z(pair, at)?;
        Some(channels.into_iter().flatten().fold(0.0, |most: f64, z| if z.abs() > most.abs() { z } else { most }))
    })
}

/// The value that a `share` of all sizes stays below: an end for a colour bar that a few outliers do not spoil. Zero if
/// there is none.
pub fn bound(map: &[f32], share: f64) -> f64 {
    let mut sizes: Vec<f32> = map.iter().filter(|v| v.is_finite()).map(|v| v.abs()).collect();
    sizes.sort_unstable_by(f32::total_cmp);
    let place = (share * sizes.len().saturating_sub(1) as f64).ceil() as usize;
    sizes.get(place).map_or(0.0, |&v| f64::from(v))
}

fn of(pair: &Pair, f: impl Fn(usize) -> Option<f64>) -> Vec<f32> {
    let value = |(at, usable): (usize, &bool)| usable.then(|| f(at)).flatten().map_or(f32::NAN, |v| v as f32);
    pair.usable.iter().enumerate().map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::super::pair::tests::pair;
    use super::*;

    #[test]
    fn maps_show_what_is_there() {
        let mut pair = pair(2, vec![[1.0; 3], [f32::NAN; 3]], vec![[0.5, 2.0, 1.0], [1.0; 3]]);
        let light = 0.2126 * 0.5 - 0.7152;
        assert!((signed(&pair)[0] - light).abs() < 1e-6 && signed(&pair)[1].is_nan());
        let b = 0.2126 * 0.5 + 0.7152 * 2.0 + 0.0722;
        assert!((relative(&pair, 0.01)[0] - light.abs() / (b + 0.01)).abs() < 1e-6);
        pair.variance_a = Some(vec![[0.25; 3]; 2]);
        assert_eq!(z(&pair)[0], -2.0);
    }

    #[test]
    fn bounds_leave_outliers_out() {
        let mut map: Vec<f32> = (0..1000).map(|i| -(i as f32)).collect();
        map.extend([1e9, f32::NAN, f32::INFINITY]);
        assert_eq!(bound(&map, 0.99), 990.0);
        assert_eq!(bound(&map, 1.0), 1e9);
        assert_eq!(bound(&[f32::NAN], 0.5), 0.0);
    }
}
