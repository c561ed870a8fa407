//! Asking Embree, and timing nothing but its calls.

use super::denormals::AsZero;
use super::ffi::{Arguments4, Calls as Functions, Columns, Context3, One, Packet};
use super::library::Device;
use super::modes::{Calls, Mode};
use super::records::{HIT, LARGEST_HIT, Layout, RAY, Records};
use super::scene::{Quality, Tree};
use crate::bvh::{Query, RayColumns};
use crate::scene::shapes::Shapes;
use glam::Vec3;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A thread's means to trace rays in one mode: its records.
pub struct Tracer<'a> {
    tree: &'a Tree,
    query: Query,
    mode: Mode,
    records: Records,
}

impl<'a> Tracer<'a> {
    /// For up to `rays` rays.
    pub fn new(tree: &'a Tree, query: Query, mode: Mode, rays: usize) -> Tracer<'a> {
        let rays = mode.batch.unwrap_or(rays).min(rays);
        let width = match mode.calls {
            Calls::Single | Calls::Stream => 1,
            Calls::Packets(width) => width,
            Calls::StreamColumns => rays,
        };
        let hits = (query == Query::Closest).then(|| tree.device().hit_words());
        Tracer { tree, query, mode, records: Records::allocate(Layout::new(width, hits), rays) }
    }

    /// Traces `rays`, as many as lie ready at a time; gives the time of Embree's calls. What the records hold after each
    /// batch is told to `seen`.
    pub fn trace(&mut self, rays: RayColumns<'_>, mut seen: impl FnMut(&Records)) -> Duration {
        let _zero = AsZero::new();
        let mut time = Duration::ZERO;
        let batch = self.mode.batch.unwrap_or(rays.len()).max(1);
        for start in (0..rays.len()).step_by(batch) {
            self.records.fill(rays.rows(start..(start + batch).min(rays.len())));
            time += self.timed();
            seen(&self.records);
        }
        time
    }

    /// What is measured. A function of its own, so that `profiling/callgrind.sh` can count its instructions alone.
    #[inline(never)]
    fn timed(&mut self) -> Duration {
        let begin = Instant::now();
        self.call();
        begin.elapsed()
    }

    /// The hits of `rays`: distance and primitive, as [`Records::closest`] has them.
    pub fn closest_hits(&mut self, rays: RayColumns<'_>) -> Vec<(f32, u32)> {
        let first = &self.tree.first;
        let mut hits = Vec::with_capacity(rays.len());
        self.trace(rays, |records| hits.extend(records.closest(first)));
        hits
    }

    /// Whether each of `rays` is occluded.
    pub fn any_hits(&mut self, rays: RayColumns<'_>) -> Vec<bool> {
        let mut occluded = Vec::with_capacity(rays.len());
        self.trace(rays, |records| occluded.extend(records.occluded()));
        occluded
    }

    /// All calls that the records need.
    fn call(&mut self) {
        let functions = match self.query {
            Query::Closest => &self.tree.device().api().closest,
            Query::Any => &self.tree.device().api().any,
        };
        let mut context = Context3::new(self.mode.coherent);
        let mut arguments = Arguments4::new(self.mode.coherent);
        match self.mode.calls {
            Calls::Single => self.singles(functions, &mut context, &mut arguments),
            Calls::Packets(width) => {
                self.packets(functions.packets[width.ilog2() as usize - 2], &mut context, &mut arguments);
            }
            Calls::Stream | Calls::StreamColumns => self.stream(functions, &mut context),
        }
    }

    fn singles(&mut self, functions: &Functions, context: &mut Context3, arguments: &mut Arguments4) {
        let (scene, rays, words) = (self.tree.handle(), self.records.rays, self.records.layout.words);
        let blocks = self.records.words.chunks_exact_mut(words).take(rays);
        match functions.one {
            // SAFETY: the scene is committed; each block is a record of this version, 16-byte aligned, as `hit_words` found.
            One::V3(trace) => blocks.for_each(|ray| unsafe { trace(scene, context, ray.as_mut_ptr()) }),
            // SAFETY: as above.
            One::V4(trace) => blocks.for_each(|ray| unsafe { trace(scene, ray.as_mut_ptr(), arguments) }),
        }
    }

    fn packets(&mut self, packet: Packet, context: &mut Context3, arguments: &mut Arguments4) {
        let Records { words, valid, layout, rays } = &mut self.records;
        let (scene, count) = (self.tree.handle(), layout.blocks(*rays));
        let [full, last] = valid.each_ref().map(|valid| valid.as_ptr());
        let blocks = words.chunks_exact_mut(layout.words).take(count).enumerate();
        let blocks = blocks.map(|(block, words)| (if block + 1 == count { last } else { full }, words.as_mut_ptr()));
        match packet {
            // SAFETY: the scene is committed; each block is a record of this version and width, aligned to its width in
            // floats because blocks are multiples of that and the first is 64-byte aligned; `valid` has at least 16 words.
            Packet::V3(trace) => blocks.for_each(|(valid, rays)| unsafe { trace(valid, scene, context, rays) }),
            // SAFETY: as above.
            Packet::V4(trace) => blocks.for_each(|(valid, rays)| unsafe { trace(valid, scene, rays, arguments) }),
        }
    }

    fn stream(&mut self, functions: &Functions, context: &mut Context3) {
        let Some((many, spread)) = functions.streams else { return };
        let Records { words, layout, rays, .. } = &mut self.records;
        let scene = self.tree.handle();
        let first = words.as_mut_ptr();
        if self.mode.calls == Calls::Stream {
            // SAFETY: as for single rays; the records follow each other at the stride given.
            unsafe { many(scene, context, first, *rays as u32, layout.words * 4) };
            return;
        }
        let has_hits = layout.words >= (RAY + HIT) * layout.width;
        let columns = std::array::from_fn(|word| match word < RAY || has_hits {
            true => first.wrapping_add(word * layout.width),
            false => std::ptr::null_mut(),
        });
        // SAFETY: each pointer that the call reads (12 of a ray, 20 with its hit) leads to a column of at least `rays` words.
        unsafe { spread(scene, context, &Columns(columns), *rays as u32) };
    }
}

/// How many words a hit has in the records of `device`: found by tracing at a triangle in every mode and looking at what
/// was written.
///
/// # Errors
/// Hits that are missing, or words written where no known version writes any.
pub(super) fn hit_words(device: &Arc<Device>) -> Result<usize, String> {
    /// What nothing that Embree writes looks like.
    const CANARY: u32 = 0x5eed_c0de;
    const RAYS: usize = 21;
    let shapes = Shapes {
        positions: vec![Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 4.0],
        triangles: vec![[0, 1, 2]],
        ..Shapes::default()
    };
    let tree = Tree::build(device, &shapes, Quality::Medium, false).map_err(|error| error.to_string())?;
    let [zero, one] = [[0.0f32; RAYS], [1.0; RAYS]];
    let rays = RayColumns {
        ox: &one,
        oy: &one,
        oz: &one,
        dx: &zero,
        dy: &zero,
        dz: &[-2.0; RAYS],
        t_min: None,
        t_max: None,
        low: None,
    };
    let mut ninth = Vec::new();
    for mode in Mode::all(device, 16) {
        let mode = Mode { batch: None, ..mode };
        for query in [Query::Closest, Query::Any] {
            let mut tracer = Tracer::new(&tree, query, mode, RAYS);
            tracer.records.fill(rays);
            let Layout { width, words, .. } = tracer.records.layout;
            let used = width * if query == Query::Closest { RAY + HIT } else { RAY };
            let blocks = tracer.records.layout.blocks(RAYS);
            let (records, spare) = tracer.records.words.split_at_mut(blocks * words);
            records.chunks_exact_mut(words).for_each(|block| block[used..].fill(CANARY));
            spare.fill(CANARY);
            tracer.call();
            device.error()?;
            let right = match query {
                // Embree approximates reciprocals, as each processor does in its own way.
                Query::Closest => {
                    tracer.records.closest(&tree.first).all(|(t, prim)| (t - 0.5).abs() < 1e-5 && prim == 0)
                }
                Query::Any => tracer.records.occluded().all(|occluded| occluded),
            };
            let (records, spare) = tracer.records.words.split_at(blocks * words);
            let mut beyond = spare.iter();
            let mut written = false;
            for block in records.chunks_exact(words) {
                let room = if query == Query::Closest { width * (RAY + LARGEST_HIT) } else { used };
                written |= block[used..room].iter().any(|&word| word != CANARY);
                if block[room..].iter().chain(beyond.by_ref()).any(|&word| word != CANARY) {
                    return Err(format!("Embree {} writes records of an unknown shape ({mode})", device.version));
                }
            }
            if !right {
                return Err(format!("Embree {} misses a triangle that it was shown ({mode})", device.version));
            }
            if query == Query::Closest && mode.calls != Calls::StreamColumns {
                ninth.push(written);
            }
        }
    }
    match ninth.iter().filter(|&&written| written).count() {
        0 => Ok(HIT),
        all if all == ninth.len() => Ok(LARGEST_HIT),
        _ => Err(format!("Embree {} writes records of different shapes", device.version)),
    }
}
