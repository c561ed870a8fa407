//! A few samples before a render, from which it learns what rays must be worth ([`Worth`]). They have numbers of their own, so the
//! render's samples do not depend on them, and they are taken by the reference integrator: waves and reference learn the same.

use crate::bvh::Accel;
use crate::explain::Event;
use crate::options::{RenderOptions, Roulette, Sampler};
use crate::reference;
use crate::sampling::random::mix;
use crate::sampling::v3::V3;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::worth::{Parts, Worth};
use rayon::prelude::*;

/// Pixels of a part of the frame that are looked at, two samples each: at most 6,000 samples in all, some milliseconds. However many the
/// render takes, and of whatever part of the frame: a sample does not depend on that.
const PIXELS: u32 = 12;

/// What the samples of a part, or of all, have shown.
#[derive(Clone, Debug, Default)]
struct Seen {
    /// Variance of a sample, by pixel.
    variances: Vec<f64>,
    samples: u64,
    rays: u64,
    /// Σ throughput of paths behind each bounce.
    throughput: f64,
    /// Σ radiance that they found.
    found: f64,
}

/// What rays must be worth in a render; nothing where its roulette does not ask. Runs on the rayon pool that it is called in; the result
/// does not depend on its threads.
pub fn measure(scene: &Scene, accel: &Accel, camera: &Camera, options: &RenderOptions) -> Option<Worth> {
    let Roulette::Efficiency { factor } = options.roulette else { return None };
    // Nothing is left to chance where no light bounces.
    let (_, last) = options.integrator.bounces(options.max_depth)?;
    if last == 0 {
        return None;
    }
    let parts = Parts::of(options);
    let count = parts.across * parts.down;
    let pilot = RenderOptions {
        roulette: Roulette::THROUGHPUT,
        sampler: Sampler::Independent,
        seed: mix(!options.seed),
        ..options.clone()
    };
    let sample = reference::witness((scene, accel, camera), &pilot);
    let look = |part: u32| {
        let mut seen = Seen::default();
        let [left, top] = parts.corner(part);
        let (right, bottom) = ((left + parts.side()).min(options.width), (top + parts.side()).min(options.height));
        for k in 0..PIXELS {
            // Spread over the part by the plastic number's sequence (Roberts 2018).
            let along = |from: u32, to: u32, step: f64| {
                from + (((f64::from(k) + 0.5) * step).fract() * f64::from(to - from)) as u32
            };
            let (x, y) = (along(left, right, 0.754_877_666_246_692_7), along(top, bottom, 0.569_840_290_998_053_3));
            let pair = [2 * k, 2 * k + 1].map(|index| {
                let mut events = Vec::new();
                let radiance = sample([x, y, index], &mut events).radiance.map(f64::from);
                if radiance.iter().all(|c| c.is_finite()) {
                    seen.add(&events);
                }
                radiance
            });
            let variance = (0..3).map(|c| (pair[0][c] - pair[1][c]).powi(2) / 2.0).sum::<f64>() / 3.0;
            if variance.is_finite() {
                seen.variances.push(variance);
            }
        }
        seen
    };
    let seen: Vec<Seen> = (0..count).into_par_iter().map(look).collect();
    Some(worth(parts, &seen, factor))
}

impl Seen {
    fn add(&mut self, events: &[Event]) {
        let mean = |v: V3| f64::from(v.x + v.y + v.z) / 3.0;
        let mut bounces = 0u32;
        self.samples += 1;
        for event in events {
            match event {
                Event::Bounce { beta, .. } => {
                    bounces += 1;
                    self.throughput += mean(*beta);
                }
                Event::Ray { .. } | Event::Light { .. } | Event::Hemisphere { .. } => self.rays += 1,
                _ => {}
            }
            if let Some(value) = event.adds() {
                self.found += f64::from(bounces) * mean(value);
            }
        }
    }
}

/// 1 / δ of each part from its own samples and its neighbours'.
fn worth(parts: Parts, seen: &[Seen], factor: f32) -> Worth {
    let sum = |of: fn(&Seen) -> f64| seen.iter().map(of).sum::<f64>();
    let rays = sum(|s| s.rays as f64) / sum(|s| s.samples as f64).max(1.0);
    let rate = |part: u32| {
        let (x, y) = (part % parts.across, part / parts.across);
        let mut around = Vec::new();
        for ny in y.saturating_sub(1)..=(y + 1).min(parts.down - 1) {
            for nx in x.saturating_sub(1)..=(x + 1).min(parts.across - 1) {
                around.extend_from_slice(&seen[(ny * parts.across + nx) as usize].variances);
            }
        }
        // Pixels with much more variance than others – edges of lamps – would have all others traced too little.
        around.sort_by(f64::total_cmp);
        around.truncate(around.len().div_ceil(4) * 3);
        let variance = around.iter().sum::<f64>() / (around.len() as f64).max(1.0);
        (1.0 / (f64::from(factor) * (variance / rays.max(1.0)).sqrt())) as f32
    };
    let rates = (0..parts.across * parts.down).map(rate).collect();
    let throughput = sum(|s| s.throughput);
    let incoming = if throughput > 0.0 { (sum(|s| s.found) / throughput) as f32 } else { 0.0 };
    Worth { parts, rates, incoming }
}
