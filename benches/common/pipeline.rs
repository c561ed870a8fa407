//! One wave of a real scene, stopped before any stage.

use super::Ready;
use comber::film::tile::{FilmLayout, Tile, tiles};
use comber::light::in_view::InView;
use comber::options::{Cell, RenderOptions};
use comber::pilot;
use comber::plan::Plan;
use comber::sampling::sampler::Sampler;
use comber::simd::Tier;
use comber::stages::{self, Context, shade};
use comber::transport::Transport;
use comber::wave::Wave;
use comber::wave::span::Span;

/// A wave, and what surrounds it in a render.
pub struct Pipeline<'a> {
    pub context: Context<'a>,
    pub wave: Wave,
    pub spans: Vec<Span>,
    pub tiles: Vec<Tile>,
}

impl<'a> Pipeline<'a> {
    /// A wave of blocks of 4×4 pixels with 16 samples each, from all over the frame: nearby rows are as coherent as in a
    /// render, and the wave as a whole sees the whole picture.
    pub fn new(ready: &'a Ready, options: &RenderOptions, tier: Tier) -> Self {
        const SAMPLES: u32 = 16;
        const BLOCK: usize = 16;
        let plan = Plan::new(&ready.scene, &ready.accel, options).expect("a sound plan");
        let worth = pilot::measure(&ready.scene, &ready.accel, &ready.camera, options);
        let context = Context {
            scene: &ready.scene,
            accel: &ready.accel,
            lens: ready.camera.lens(options.width, options.height),
            width: options.width,
            in_view: InView::default(),
            lamp_rays: 1,
            transport: Transport { worth, ..Transport::new(options, &ready.scene.lights) },
            features: plan.features,
            sampler: Sampler::new(options),
            tier,
            counts: false,
        };
        let cell = Cell { x: 0, y: 0, width: options.width, height: options.height };
        let tiles = tiles(cell, FilmLayout::default());
        let blocks = (plan.wave / (SAMPLES as usize * BLOCK)).min(tiles.len());
        let span = |tile: usize, local: usize| {
            let (x, y) = (tiles[tile].x[local], tiles[tile].y[local]);
            let pixel = y * options.width + x;
            Span { x, y, pixel, first: 0, stride: 1, count: SAMPLES, tile: tile as u32, local: local as u32 }
        };
        let chosen = (0..blocks).map(|block| block * tiles.len() / blocks);
        // Pixels of a tile are in Morton order, so the first sixteen are a square.
        let spans = chosen.flat_map(|tile| (0..BLOCK).map(move |local| span(tile, local))).collect();
        let wave = Wave::allocate(plan.wave, context.transport.shadow_samples, plan.features);
        Pipeline { context, wave, spans, tiles }
    }

    pub fn generate(&mut self) -> usize {
        let Wave { samples, paths, .. } = &mut self.wave;
        stages::generate::run(&self.context, &self.spans, stages::generate::Out { samples, paths })
    }

    pub fn traverse(&mut self, depth: u32, n: usize) {
        stages::traverse::run(&self.context, depth, n, &self.wave.paths, &mut self.wave.hits);
    }

    pub fn shade(&mut self, depth: u32, n: usize) -> shade::Counts {
        let Wave { samples, paths, next, vertices, hits, shadows, scratch, .. } = &mut self.wave;
        scratch.reset();
        shade::run(
            &self.context,
            depth,
            n,
            shade::In { paths, hits },
            shade::Out { samples, shadows, next, vertices },
            scratch,
        )
    }

    pub fn shadow(&mut self, depth: u32, n: usize) {
        let Wave { samples, shadows, shadow_hits, scratch, .. } = &mut self.wave;
        scratch.reset();
        let out = stages::shadow::Out { samples, hits: shadow_hits };
        stages::shadow::run(&self.context, depth, n, shadows, out, scratch);
    }

    pub fn roulette(&mut self, depth: u32, n: usize) -> usize {
        let Wave { samples, paths, next, scratch, .. } = &mut self.wave;
        scratch.reset();
        stages::roulette::run(&self.context, depth, n, stages::roulette::In { next, samples }, paths, scratch)
    }

    pub fn retire(&mut self) {
        stages::retire::run(&self.spans, &self.wave.samples, &mut self.tiles);
    }
}
