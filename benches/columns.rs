//! Streamed against indexed columns: after each bounce, do the survivors' rows move together, or stay where they are and be
//! read through a queue of row numbers?
//!
//! `cargo bench --bench columns [-- SCENE…]` takes the queues of one wave of a real scene, from bounce to bounce, and runs
//! on them, both ways,
//!
//! - *columns*: all column traffic of a bounce and next to no arithmetic: decide who goes on, read the ray as traverse does,
//!   read the row and write the next one as shade does;
//! - *traverse*: deciding, and the real traversal, which reads contiguous rows or blocks of rows gathered on read.
//!
//! Streamed, deciding includes the copy. Both ways must produce the same bits. Nanoseconds are a live row's.

mod common;

use comber::bench::statistics::Quartiles;
use comber::bvh::{HitColumnsMut, Query, RayColumns};
use comber::simd::{Kernel, Tier};
use comber::wave::hits::Hits;
use comber::wave::paths::Paths;
use common::pipeline::Pipeline;
use common::{Args, Ready};
use std::hint::black_box;
use std::time::Instant;

/// Columns of a path, in the order of `wave/paths.rs` without the slot: the ray's six, throughput, density, lot.
const COLUMNS: usize = 11;
const RAY: usize = 6;
const BETA: std::ops::Range<usize> = 6..9;
const LOT: usize = 10;

/// Rows that traversal takes at a time here, gathered or not.
const BLOCK: usize = 64;

type Table = [Vec<f32>; COLUMNS];

fn main() {
    let args = Args::parse();
    let repeats = if args.measure { 401 } else { 1 };
    println!(
        "| scene | depth | rows before | live | columns: streamed ns | indexed ns | streamed ÷ indexed | traverse: streamed ns | indexed ns | streamed ÷ indexed |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    let scenes = args.scenes();
    for ready in scenes.into_iter().filter_map(common::load) {
        for (depth, queues) in record(&ready).iter().enumerate() {
            measure(&ready, depth, queues, repeats);
        }
    }
}

/// What shade left at one vertex of a wave, and who went on.
struct Queues {
    /// Rows in use when nothing moves: those of the camera.
    rows: usize,
    /// Columns as shade wrote them, dead rows among them.
    next: Table,
    /// Where each of those rows would be if nothing moved.
    slots: Vec<u32>,
    /// Probability to go on, for each row: the rule is the transport's, and not what is measured.
    survival: Vec<f32>,
    /// How many go on.
    live: usize,
}

/// Follows one wave to its end.
fn record(ready: &Ready) -> Vec<Queues> {
    let tier = *Tier::available().last().expect("there is always a tier");
    let mut pipeline = Pipeline::new(ready, &common::render_options(), tier);
    let rows = pipeline.generate();
    let (mut live, mut queues) = (rows, Vec::new());
    for depth in 0.. {
        pipeline.traverse(depth, live);
        let n = pipeline.shade(depth, live).next;
        if n == 0 {
            break;
        }
        let (next, slots) = (table(&pipeline.wave.next, n), pipeline.wave.next.slot[..n].to_vec());
        let beta = |row: usize| comber::sampling::v3::V3::new(next[6][row], next[7][row], next[8][row]);
        let survival = (0..n).map(|row| pipeline.context.transport.survival(depth, 0.0, beta(row))).collect();
        live = pipeline.roulette(depth, n);
        queues.push(Queues { rows, next, slots, survival, live });
    }
    queues
}

fn table(paths: &Paths, n: usize) -> Table {
    let Paths { ox, oy, oz, dx, dy, dz, beta_r, beta_g, beta_b, pdf, roulette, .. } = paths;
    [ox, oy, oz, dx, dy, dz, beta_r, beta_g, beta_b, pdf, roulette].map(|column| column[..n].to_vec())
}

fn measure(ready: &Ready, depth: usize, queues: &Queues, repeats: usize) {
    let mut streamed = Streamed::new(queues);
    let mut indexed = Indexed::new(queues);
    let tier = *Tier::available().last().expect("there is always a tier");

    let columns = race(repeats, queues.live, [&mut || tier.run(&mut streamed), &mut || tier.run(&mut indexed)]);
    assert_eq!(streamed.live, queues.live, "the queue is not the one that roulette made");
    assert!(streamed.results() == indexed.results(), "streamed and indexed columns disagree");

    let mut hits = [(); 2].map(|()| Hits::allocate(queues.rows, comber::wave::features::Features::HITS));
    let [streamed_hits, indexed_hits] = &mut hits;
    let traverse = race(
        repeats,
        queues.live,
        [&mut || streamed.traverse(ready, tier, streamed_hits), &mut || indexed.traverse(ready, tier, indexed_hits)],
    );
    assert!(hits[0].prim[..queues.live] == hits[1].prim[..queues.live], "the hits disagree");
    println!(
        "| {} | {depth} | {} | {} | {:.2} | {:.2} | {:.2} | {:.1} | {:.1} | {:.2} |",
        ready.name,
        queues.slots.len(),
        queues.live,
        columns.0,
        columns.1,
        columns.2,
        traverse.0,
        traverse.1,
        traverse.2,
    );
}

/// Nanoseconds a row of both, in turns, and the median ratio of the turns.
fn race(repeats: usize, rows: usize, [a, b]: [&mut dyn FnMut(); 2]) -> (f64, f64, f64) {
    let time = |run: &mut dyn FnMut()| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64() * 1e9 / rows.max(1) as f64
    };
    let turns: Vec<_> = (0..repeats).map(|_| (time(a), time(b))).collect();
    let median = |values: &dyn Fn(&(f64, f64)) -> f64| Quartiles::of(turns.iter().map(values)).median;
    (median(&|t| t.0), median(&|t| t.1), median(&|t| t.0 / t.1))
}

/// Whether a row goes on: as `stages/roulette.rs` has it.
#[inline(always)]
fn goes_on(next: &Table, row: usize, survival: f32) -> bool {
    let brightest = BETA.map(|c| next[c][row]).fold(0.0, f32::max);
    brightest > 0.0 && next[LOT][row] < survival
}

/// What stands for tracing a ray: a number that depends on all of it.
#[inline(always)]
fn trace(ray: [f32; RAY]) -> f32 {
    let [ox, oy, oz, dx, dy, dz] = ray;
    ox * dx + oy * dy + oz * dz
}

/// Rows move: survivors are copied together, and all later reads and writes run from end to end.
struct Streamed<'a> {
    queues: &'a Queues,
    survivors: Vec<u32>,
    scales: Vec<f32>,
    paths: Table,
    hits: Vec<f32>,
    next: Table,
    live: usize,
}

impl<'a> Streamed<'a> {
    fn new(queues: &'a Queues) -> Self {
        let column = || vec![0.0; queues.rows];
        Streamed {
            queues,
            survivors: vec![0; queues.rows],
            scales: column(),
            paths: std::array::from_fn(|_| column()),
            hits: column(),
            next: std::array::from_fn(|_| column()),
            live: 0,
        }
    }

    #[inline(always)]
    fn decide(&mut self) {
        let Queues { next, survival, .. } = self.queues;
        let mut live = 0;
        for (row, &survival) in survival.iter().enumerate() {
            self.survivors[live] = row as u32;
            self.scales[live] = 1.0 / survival;
            live += usize::from(goes_on(next, row, survival));
        }
        let survivors = &self.survivors[..live];
        // The lot is used up: it does not move.
        for (to, from) in self.paths[..LOT].iter_mut().zip(next) {
            to.iter_mut().zip(survivors).for_each(|(to, &row)| *to = from[row as usize]);
        }
        for column in &mut self.paths[BETA] {
            column.iter_mut().zip(&self.scales[..live]).for_each(|(beta, scale)| *beta *= scale);
        }
        self.live = live;
    }

    fn traverse(&mut self, ready: &Ready, tier: Tier, hits: &mut Hits) {
        self.decide();
        for start in (0..self.live).step_by(BLOCK) {
            let rows = start..(start + BLOCK).min(self.live);
            let rays: [&[f32]; RAY] = std::array::from_fn(|c| &self.paths[c][rows.clone()]);
            closest(ready, tier, rays, hits, start);
        }
    }

    fn results(&self) -> Vec<u32> {
        self.next.iter().flat_map(|column| column[..self.live].iter().map(|x| x.to_bits())).collect()
    }
}

impl Kernel for &mut Streamed<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.decide();
        let n = self.live;
        for row in 0..n {
            self.hits[row] = trace(std::array::from_fn(|c| self.paths[c][row]));
        }
        for (to, from) in self.next[..LOT].iter_mut().zip(&self.paths) {
            to[..n].iter_mut().zip(&from[..n]).zip(&self.hits).for_each(|((to, from), hit)| *to = from + hit);
        }
        black_box(&self.next);
    }
}

/// Rows stay: whoever works on survivors reads and writes through a queue of their row numbers.
struct Indexed<'a> {
    queues: &'a Queues,
    paths: Table,
    survival: Vec<f32>,
    queue: Vec<u32>,
    scales: Vec<f32>,
    hits: Vec<f32>,
    next: Table,
    live: usize,
}

impl<'a> Indexed<'a> {
    fn new(queues: &'a Queues) -> Self {
        let column = || vec![0.0; queues.rows];
        let in_place = |from: &[f32]| {
            let mut column = column();
            queues.slots.iter().zip(from).for_each(|(&slot, &value)| column[slot as usize] = value);
            column
        };
        Indexed {
            queues,
            paths: std::array::from_fn(|c| in_place(&queues.next[c])),
            survival: in_place(&queues.survival),
            queue: vec![0; queues.rows],
            scales: column(),
            hits: column(),
            next: std::array::from_fn(|_| column()),
            live: 0,
        }
    }

    #[inline(always)]
    fn decide(&mut self) {
        let mut live = 0;
        for &slot in &self.queues.slots {
            let survival = self.survival[slot as usize];
            self.queue[live] = slot;
            self.scales[live] = 1.0 / survival;
            live += usize::from(goes_on(&self.paths, slot as usize, survival));
        }
        self.live = live;
    }

    fn traverse(&mut self, ready: &Ready, tier: Tier, hits: &mut Hits) {
        self.decide();
        let mut block = [[0.0; BLOCK]; RAY];
        for (b, rows) in self.queue[..self.live].chunks(BLOCK).enumerate() {
            for (to, from) in block.iter_mut().zip(&self.paths) {
                to.iter_mut().zip(rows).for_each(|(to, &row)| *to = from[row as usize]);
            }
            closest(ready, tier, block.each_ref().map(|column| &column[..rows.len()]), hits, b * BLOCK);
        }
    }

    fn results(&self) -> Vec<u32> {
        let live = &self.queue[..self.live];
        self.next.iter().flat_map(|column| live.iter().map(|&row| column[row as usize].to_bits())).collect()
    }
}

impl Kernel for &mut Indexed<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.decide();
        let queue = &self.queue[..self.live];
        for (hit, &row) in self.hits.iter_mut().zip(queue) {
            *hit = trace(std::array::from_fn(|c| self.paths[c][row as usize]));
        }
        for (c, (to, from)) in self.next[..LOT].iter_mut().zip(&self.paths).enumerate() {
            for ((hit, scale), &row) in self.hits.iter().zip(&self.scales).zip(queue) {
                // Throughput is divided by the probability to survive where it is read: nobody has copied it.
                let scale = if BETA.contains(&c) { *scale } else { 1.0 };
                to[row as usize] = from[row as usize] * scale + hit;
            }
        }
        black_box(&self.next);
    }
}

/// Traces up to a block of rays, to the rows of `hits` from `start` on.
fn closest(ready: &Ready, tier: Tier, rays: [&[f32]; RAY], hits: &mut Hits, start: usize) {
    let [ox, oy, oz, dx, dy, dz] = rays;
    let rows = start..start + ox.len();
    let Hits { t, u, v, prim, geom } = hits;
    let hits = HitColumnsMut {
        t: &mut t[rows.clone()],
        u: &mut u[rows.clone()],
        v: &mut v[rows.clone()],
        prim: &mut prim[rows.clone()],
        geom: &mut geom[rows],
    };
    ready.accel.closest_hits(
        ready.accel.suited(Query::Closest, false),
        tier,
        RayColumns { ox, oy, oz, dx, dy, dz, t_min: None, t_max: None, low: None },
        hits,
    );
}
