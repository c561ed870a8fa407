//! # roulette: which paths go on
//!
//! | | |
//! |---|---|
//! | reads | `next.*`, and `sample.rate` through `next.slot` where roulette is by efficiency |
//! | writes | `path.*` |
//! | consumes | paths as shade left them, dead ones among them |
//! | produces | live paths, dense and in the same order |
//! | cost | the row's bytes read and written once |
//!
//! Rows move (a *streamed* queue): the stages behind read columns from end to end. The alternative, rows that stay and a queue
//! of row numbers, was measured on the queues of six scenes (`cargo bench --bench columns`,
//! `profiling/runs/2026-11-22-xeon-2c/columns.md`): moving rows takes 0.63–0.89 of the time for all column traffic of a
//! bounce. Traversal, which reads six columns once, is 0–4 % slower for the copy, 2 to 5 ns of 70 to 370 a row; shade,
//! which reads all, gains more. Keeping the order keeps what coherence the pixels' order gave.

use super::{Context, Stage};
use crate::sampling::v3::V3;
use crate::wave::features::Features;
use crate::wave::paths::Paths;
use crate::wave::samples::Samples;
use bumpalo::Bump;

/// Its facts.
pub const STAGE: Stage = Stage {
    name: "roulette",
    reads: &[("next.*", Features::ALWAYS), ("sample.rate", Features::EFFICIENCY)],
    writes: &[("path.*", Features::ALWAYS)],
    requires: Features::CONTINUE,
};

/// What it reads.
pub struct In<'a> {
    /// Paths as shade left them.
    pub next: &'a Paths,
    /// Whose samples they are.
    pub samples: &'a Samples,
}

/// Moves those of the first `n` rows of `next` that go on from vertex `depth` to `paths`; returns how many.
pub fn run(context: &Context, depth: u32, n: usize, input: In, paths: &mut Paths, scratch: &Bump) -> usize {
    let In { next, samples } = input;
    let survivors = scratch.alloc_slice_fill_copy(n, 0u32);
    let scales = scratch.alloc_slice_fill_copy(n, 1.0f32);
    let mut live = 0;
    let random = context.features.has(Features::ROULETTE);
    let efficiency = context.features.has(Features::EFFICIENCY);
    for row in 0..n {
        let beta = V3::new(next.beta_r[row], next.beta_g[row], next.beta_b[row]);
        let brightest = beta.max_component();
        let rate = if efficiency { samples.rate[next.slot[row] as usize] } else { 0.0 };
        let survival = context.transport.survival(depth, rate, beta);
        let goes_on = brightest > 0.0 && !(random && next.roulette[row] >= survival);
        survivors[live] = row as u32;
        scales[live] = 1.0 / survival;
        live += usize::from(goes_on);
    }
    let (survivors, scales) = (&survivors[..live], &scales[..live]);
    for (to, from) in [
        (&mut paths.ox, &next.ox),
        (&mut paths.oy, &next.oy),
        (&mut paths.oz, &next.oz),
        (&mut paths.lx, &next.lx),
        (&mut paths.ly, &next.ly),
        (&mut paths.lz, &next.lz),
        (&mut paths.dx, &next.dx),
        (&mut paths.dy, &next.dy),
        (&mut paths.dz, &next.dz),
        (&mut paths.pdf, &next.pdf),
        (&mut paths.nx, &next.nx),
        (&mut paths.ny, &next.ny),
        (&mut paths.nz, &next.nz),
    ] {
        if !from.is_empty() {
            gather(&mut to[..live], from, survivors);
        }
    }
    gather(&mut paths.slot[..live], &next.slot, survivors);
    for (to, from) in
        [(&mut paths.beta_r, &next.beta_r), (&mut paths.beta_g, &next.beta_g), (&mut paths.beta_b, &next.beta_b)]
    {
        gather(&mut to[..live], from, survivors);
        if random {
            to[..live].iter_mut().zip(scales).for_each(|(b, s)| *b *= s);
        }
    }
    live
}

/// Column by column: each is one stream out and one nearly sequential stream in. Few paths die before roulette begins, so most
/// rows move in whole blocks.
fn gather<T: Copy>(to: &mut [T], from: &[T], rows: &[u32]) {
    const BLOCK: usize = 64;
    for (to, rows) in to.chunks_mut(BLOCK).zip(rows.chunks(BLOCK)) {
        let first = rows[0] as usize;
        // Rows ascend: as many as the numbers between the first and the last are neighbours all.
        if rows[rows.len() - 1] as usize - first == rows.len() - 1 {
            to.copy_from_slice(&from[first..first + rows.len()]);
        } else {
            to.iter_mut().zip(rows).for_each(|(to, &row)| *to = from[row as usize]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::Roulette;
    use crate::stages::tests::Fixture;
    use crate::wave::Wave;

    #[test]
    fn live_rows_stay_in_order_and_carry_what_the_dead_would_have() {
        let fixture = Fixture::new();
        let mut context = fixture.contexts().remove(0);
        context.transport.roulette = Roulette::Fixed(0.25);
        let n = 4000;
        let mut wave = Wave::allocate(n, 1, context.features);
        for row in 0..n {
            let alive = row % 5 != 0;
            wave.next.slot[row] = row as u32;
            wave.next.ox[row] = row as f32;
            wave.next.beta_r[row] = if alive { 0.5 } else { 0.0 };
            wave.next.roulette[row] = (row as f32 * 0.618_034).fract();
        }
        let Wave { next, paths, samples, scratch, .. } = &mut wave;
        // Before its start, the rule lets every path go on that carries anything.
        let live = run(&context, 0, n, In { next, samples }, paths, scratch);
        assert_eq!(live, n - n / 5);
        assert!(paths.beta_r[..live].iter().all(|&b| b == 0.5));

        let live = run(&context, 1, n, In { next, samples }, paths, scratch);
        assert!(paths.slot[..live].is_sorted_by(|a, b| a < b), "compaction is stable");
        for (row, &slot) in paths.slot[..live].iter().enumerate() {
            assert!(slot % 5 != 0 && next.roulette[slot as usize] < 0.25);
            assert_eq!((paths.ox[row], paths.beta_r[row]), (slot as f32, 2.0));
        }
        let expected = (0..n).filter(|row| row % 5 != 0 && next.roulette[*row] < 0.25).count();
        assert_eq!(live, expected);
    }
}
