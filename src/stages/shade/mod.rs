//! # shade: what each vertex adds, and where its path goes
//!
//! | | |
//! |---|---|
//! | reads | `path.*`, `hit.*`, `sample.pixel/index/r/g/b` (through `path.slot`) |
//! | writes | `sample.r/g/b` (emission), `shadow.*`, `next.*`; at depth 0 the first-hit columns of `sample`; for path reuse, `vertex.*` |
//! | consumes | one row a live path |
//! | produces | shadow rays; next paths, dead ones among them |
//! | cost | 68 bytes read a row, 44 written a shadow ray, 44 written a next path (diffuse, MIS) |
//!
//! First the rows that hit an emitter add its light; the rows that scatter go to a queue, and the queue is worked off in
//! blocks that stay in the first-level cache: gather corners and throughput, then compute rows by vectors: surface, direct light,
//! continuing ray.

mod ahead;
mod block;
mod direct;
mod double;
mod emit;
mod first_hit;
mod keep;
mod scatter;
mod surface;

use super::{Context, Stage};
use crate::simd::Kernel;
use crate::wave::features::Features;
use crate::wave::hits::Hits;
use crate::wave::paths::Paths;
use crate::wave::samples::Samples;
use crate::wave::shadows::Shadows;
use crate::wave::vertices::Vertices;
use ahead::Ahead;
pub use block::ROWS;
use block::{Block, Outgoing};
use bumpalo::Bump;

/// Its facts.
pub const STAGE: Stage = Stage {
    name: "shade",
    reads: &[
        ("path.*", Features::SCATTER),
        ("path.slot", Features::ALWAYS),
        ("hit.*", Features::ALWAYS),
        ("sample.pixel", Features::SCATTER),
        ("sample.index", Features::SCATTER),
        ("sample.rate", Features::EFFICIENCY),
        ("sample.r", Features::ALWAYS),
        ("sample.g", Features::ALWAYS),
        ("sample.b", Features::ALWAYS),
    ],
    writes: &[
        ("sample.r", Features::ALWAYS),
        ("sample.g", Features::ALWAYS),
        ("sample.b", Features::ALWAYS),
        ("sample.albedo*", Features::AOVS),
        ("sample.normal*", Features::AOVS),
        ("sample.depth", Features::AOVS),
        ("shadow.*", Features::SHADOW),
        ("next.*", Features::CONTINUE),
        ("vertex.*", Features::REUSE),
    ],
    requires: Features::HITS,
};

/// What it reads.
pub struct In<'a> {
    /// Live paths.
    pub paths: &'a Paths,
    /// What they hit.
    pub hits: &'a Hits,
}

/// What it writes.
pub struct Out<'a> {
    /// Radiance is added here.
    pub samples: &'a mut Samples,
    /// Shadow rays.
    pub shadows: &'a mut Shadows,
    /// Paths as they go on, dead ones among them.
    pub next: &'a mut Paths,
    /// What paths have met.
    pub vertices: &'a mut Vertices,
}

/// Rows produced, and rows that went through the blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Shadow rays.
    pub shadows: usize,
    /// Next paths.
    pub next: usize,
    /// Rows that were shaded in blocks, because their surface scatters.
    pub scattering: usize,
}

/// Shades the first `n` rows, all at vertex `depth`.
pub fn run(context: &Context, depth: u32, n: usize, input: In, out: Out, scratch: &Bump) -> Counts {
    context.tier.run(Shade { context, depth, n, input, out, scratch })
}

struct Shade<'a, 'c> {
    context: &'a Context<'c>,
    depth: u32,
    n: usize,
    input: In<'a>,
    out: Out<'a>,
    scratch: &'a Bump,
}

impl Kernel for Shade<'_, '_> {
    type Output = Counts;

    #[inline(always)]
    fn run(self) -> Counts {
        let Shade { context, depth, n, input, out, scratch } = self;
        let transport = &context.transport;
        let (direct, continues) = (transport.counts_direct(depth), transport.continues(depth));
        let light = context.features.has(Features::TRANSPORT);
        let blocks = light && (direct || continues);
        if depth == 0 {
            first_hit::run(context, n, &input, out.samples, blocks);
        }
        if depth == 0 && context.features.has(Features::REUSE) {
            keep::nothing(n, out.vertices);
        }
        let mut counts = Counts::default();
        if !light {
            return counts;
        }
        let queue = scratch.alloc_slice_fill_copy(n, 0u32);
        let scattering = emit::run(context, depth, n, &input, out.samples, queue);
        if !blocks {
            return counts;
        }
        let first_hits = depth == 0 && context.features.has(Features::AOVS);
        let keeps = context.features.has(Features::REUSE) && depth < 2;
        counts.scattering = scattering;
        let (block, rays) = (scratch.alloc(Block::default()), scratch.alloc(Outgoing::default()));
        let queue = &queue[..scattering];
        let later = |blocks: usize, at: usize| queue.chunks(block::ROWS).nth(at + blocks);
        let ahead = Ahead::new(&context.scene.shapes, context.features.has(Features::SMOOTH));
        (0..2).for_each(|at| ahead.triangles(&input, later(0, at)));
        ahead.corners(&input, later(0, 0));
        for (at, rows) in queue.chunks(block::ROWS).enumerate() {
            ahead.triangles(&input, later(2, at));
            ahead.corners(&input, later(1, at));
            block.gather(context, rows, &input, out.samples);
            if context.features.has(Features::DOUBLE) {
                double::surfaces(context, block, rows, &input);
            } else {
                surface::run(context, block, rows.len());
            }
            if first_hits {
                first_hit::normals(block, out.samples);
            }
            if keeps && depth == 0 {
                keep::first(block, out.vertices);
            } else if keeps {
                keep::second(block, out.samples, out.vertices);
            }
            if direct {
                counts.shadows = direct::run(context, depth, block, rays, out.shadows, counts.shadows);
            }
            if continues {
                counts.next = scatter::run(context, depth, block, rays, out.next, counts.next);
            }
        }
        counts
    }
}
