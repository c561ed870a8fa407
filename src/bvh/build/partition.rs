//! Putting fragments on their side of a split, in place.

use rayon::prelude::*;

use super::fragment::{CHUNK, Extent, Fragment};

/// Moves those for which `is_left` holds to the front, and says how many they are.
///
/// Every fragment is written whether it has to move or not: a branch would be mispredicted every other time, which
/// costs more.
#[inline(always)]
pub fn partition(fragments: &mut [Fragment], is_left: impl Fn(&Fragment) -> bool) -> usize {
    let mut lefts = 0;
    for i in 0..fragments.len() {
        let left = is_left(&fragments[i]);
        fragments.swap(i, lefts);
        lefts += usize::from(left);
    }
    lefts
}

/// As [`partition`], in parallel: chunks on their own, and then what is on the wrong side of the border changes
/// places. The order depends on the chunks, which do not depend on the number of threads.
pub fn partition_many(fragments: &mut [Fragment], is_left: impl Fn(&Fragment) -> bool + Sync) -> usize {
    let counts: Vec<usize> = fragments.par_chunks_mut(CHUNK).map(|chunk| partition(chunk, &is_left)).collect();
    let middle = counts.iter().sum();
    // Runs of right ones before the border, and of left ones behind it: as many fragments here as there.
    let (front, back) = fragments.split_at_mut(middle);
    let mut strays = (Vec::new(), Vec::new());
    for (chunk, &lefts) in front.chunks_mut(CHUNK).zip(&counts) {
        let lefts = lefts.min(chunk.len());
        strays.0.push(&mut chunk[lefts..]);
    }
    let mut chunk = middle / CHUNK;
    let mut rest = back;
    while !rest.is_empty() {
        let start = middle.max(chunk * CHUNK);
        let (run, behind) = rest.split_at_mut(((chunk + 1) * CHUNK - start).min(rest.len()));
        let lefts = (chunk * CHUNK + counts[chunk]).saturating_sub(start);
        strays.1.push(&mut run[..lefts]);
        (rest, chunk) = (behind, chunk + 1);
    }
    pairs(strays.0, strays.1).into_par_iter().for_each(|(a, b)| a.swap_with_slice(b));
    middle
}

/// Cuts two lists of slices of the same length in all so that they pair up.
fn pairs<'a, T>(a: Vec<&'a mut [T]>, b: Vec<&'a mut [T]>) -> Vec<(&'a mut [T], &'a mut [T])> {
    let (mut a, mut b) = (a.into_iter().filter(|s| !s.is_empty()), b.into_iter().filter(|s| !s.is_empty()));
    let mut pairs = Vec::new();
    let (mut x, mut y): (&mut [T], &mut [T]) = (&mut [], &mut []);
    loop {
        if x.is_empty() {
            let Some(next) = a.next() else { return pairs };
            x = next;
        }
        if y.is_empty() {
            let Some(next) = b.next() else { return pairs };
            y = next;
        }
        let len = x.len().min(y.len());
        let (x_now, y_now);
        (x_now, x) = x.split_at_mut(len);
        (y_now, y) = y.split_at_mut(len);
        pairs.push((x_now, y_now));
    }
}

/// Sets are halved in multiples of this, so that blocks are full.
const BLOCK: usize = 4;

/// The median split along the widest axis, in whole blocks; any half will do if all centres coincide. Says how many
/// come first.
pub fn halve(fragments: &mut [Fragment], extent: &Extent) -> usize {
    let middle = fragments.len().div_ceil(2 * BLOCK) * BLOCK;
    let size = extent.centers.max - extent.centers.min;
    let axis = size.truncate().max_position();
    if size[axis] > 0.0 {
        fragments.select_nth_unstable_by(middle, |a, b| {
            a.center()[axis].total_cmp(&b.center()[axis]).then(a.prim().cmp(&b.prim()))
        });
    }
    middle
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::aabb::Aabb;
    use glam::Vec3;

    #[test]
    fn both_partitions_separate() {
        let mut state = 1u32;
        for count in [0, 1, 5, CHUNK - 1, CHUNK, CHUNK + 1, 3 * CHUNK + 77] {
            for share in [0u32, 1, 128, 255, 256] {
                let fragments: Vec<Fragment> = (0..count as u32)
                    .map(|i| {
                        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
                        let point = Vec3::splat((state >> 24) as f32);
                        Fragment::new(i, &Aabb { min: point, max: point })
                    })
                    .collect();
                let is_left = |f: &Fragment| f.center().x < 2.0 * share as f32 - 0.5;
                let lefts = fragments.iter().filter(|f| is_left(f)).count();
                let (mut one, mut many) = (fragments.clone(), fragments);
                assert_eq!(partition(&mut one, is_left), lefts);
                assert_eq!(partition_many(&mut many, is_left), lefts);
                for sorted in [one, many] {
                    assert!(sorted[..lefts].iter().all(is_left) && !sorted[lefts..].iter().any(is_left));
                    let mut prims: Vec<u32> = sorted.iter().map(Fragment::prim).collect();
                    prims.sort_unstable();
                    assert!(prims.into_iter().eq(0..count as u32));
                }
            }
        }
    }
}
