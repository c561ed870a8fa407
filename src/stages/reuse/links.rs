//! Ways from second vertices to the first vertices of a block, and what comes along them.

use crate::bvh::RayColumns;
use crate::sampling::v3::V3;
use crate::simd::Kernel;
use crate::transport::reuse::{First, Link, MOST_PIXELS, Second, link};
use crate::wave::samples::Samples;
use crate::wave::vertices::Vertices;
use bumpalo::Bump;

/// Most pixels a block has.
const BLOCK: usize = MOST_PIXELS as usize;

/// Ways that are tried at once: those of a few blocks, or of the largest one.
pub const ROWS: usize = 4096;
const _: () = assert!(ROWS >= BLOCK * (BLOCK - 1));

/// A second vertex, and its ways to first ones.
#[derive(Clone, Copy, Default)]
struct Source {
    /// Whose path found it.
    slot: u32,
    /// Density with which it was found.
    density: f32,
    /// The row behind its last way.
    end: u32,
}

/// A table of ways, and of where they start. It lives as long as the stage.
pub struct Links<'a> {
    /// Rows in use.
    pub len: usize,
    origin: [&'a mut [f32]; 3],
    direction: [&'a mut [f32]; 3],
    /// Where they end, in units of their direction: 1.
    end: &'a mut [f32],
    density: &'a mut [f32],
    /// Where they lead: rows of the sample table.
    slot: &'a mut [u32],
    sources: &'a mut [Source],
    /// Sources in use.
    found: usize,
}

impl<'a> Links<'a> {
    /// An empty table.
    pub fn new(scratch: &'a Bump) -> Links<'a> {
        let column = || scratch.alloc_slice_fill_copy(ROWS, 0.0f32);
        Links {
            len: 0,
            origin: [column(), column(), column()],
            direction: [column(), column(), column()],
            end: scratch.alloc_slice_fill_copy(ROWS, 1.0f32),
            density: column(),
            slot: scratch.alloc_slice_fill_copy(ROWS, 0),
            // A source may have no way at all.
            sources: scratch.alloc_slice_fill_copy(ROWS, Source::default()),
            found: 0,
        }
    }

    /// Whether a block of so many pixels finds room.
    pub fn has_room(&self, pixels: usize) -> bool {
        self.len + pixels * pixels <= ROWS && self.found + pixels <= ROWS
    }

    /// The rays that ask whether a way is free.
    pub fn rays(&self) -> RayColumns<'_> {
        let [ox, oy, oz] = self.origin.each_ref().map(|column| &column[..self.len]);
        let [dx, dy, dz] = self.direction.each_ref().map(|column| &column[..self.len]);
        RayColumns { ox, oy, oz, dx, dy, dz, t_min: None, t_max: Some(&self.end[..self.len]), low: None }
    }

    /// Shares what each second vertex scatters out among the pixels that see it, and empties the table. `blocked` says of which ways
    /// something is in the way.
    pub fn settle(&mut self, blocked: &[bool], samples: &Samples, vertices: &mut Vertices) {
        let mut start = 0;
        for source in &self.sources[..self.found] {
            let ways = start..source.end as usize;
            start = ways.end;
            let free = || ways.clone().filter(|&row| !blocked[row]);
            let all = free().fold(source.density, |all, row| all + self.density[row]);
            let own = source.slot as usize;
            let scattered = V3::new(samples.r[own], samples.g[own], samples.b[own]);
            // What was found where rounding says it cannot be is its finder's.
            let kept = if source.density > 0.0 { source.density / all } else { f32::from(u8::from(all == 0.0)) };
            add(vertices, own, scattered * kept);
            for row in free() {
                add(vertices, self.slot[row] as usize, scattered * (self.density[row] / all));
            }
        }
        (self.len, self.found) = (0, 0);
    }
}

/// Adds what arrives at the first vertex of a slot and is scattered there.
fn add(vertices: &mut Vertices, slot: usize, arriving: V3) {
    vertices.direct_r[slot] += vertices.albedo_r[slot] * arriving.x;
    vertices.direct_g[slot] += vertices.albedo_g[slot] * arriving.y;
    vertices.direct_b[slot] += vertices.albedo_b[slot] * arriving.z;
}

/// Appends the ways of one block to the table: every second vertex that scatters anything to every first vertex but its finder's.
pub struct Find<'a, 's> {
    /// Rows of the sample table.
    pub slots: &'a [u32],
    /// What their second vertices scatter, if they have one.
    pub samples: &'a Samples,
    /// What they have met.
    pub vertices: &'a Vertices,
    /// Where ways go.
    pub links: &'a mut Links<'s>,
}

impl Kernel for Find<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Find { slots, samples, vertices, links } = self;
        let mut firsts = Firsts { len: 0, slot: [0; BLOCK], columns: [[0.0; BLOCK]; 9] };
        firsts.gather(slots, vertices);
        for i in 0..firsts.len {
            let slot = firsts.slot[i] as usize;
            let scatters = [samples.r[slot], samples.g[slot], samples.b[slot]] != [0.0; 3];
            if vertices.met[slot] == 2 && scatters {
                let v = vertices;
                let origin = V3::load([&v.second_ox, &v.second_oy, &v.second_oz], slot);
                let geometric = V3::load([&v.second_gx, &v.second_gy, &v.second_gz], slot);
                firsts.link(i, Second { origin, geometric }, links);
            }
        }
    }
}

/// The first vertices of a block, gathered.
struct Firsts {
    len: usize,
    slot: [u32; BLOCK],
    /// Origin, geometric normal, shading normal.
    columns: [[f32; BLOCK]; 9],
}

impl Firsts {
    #[inline(always)]
    fn gather(&mut self, slots: &[u32], v: &Vertices) {
        let from = [
            [&v.first_ox, &v.first_oy, &v.first_oz],
            [&v.first_gx, &v.first_gy, &v.first_gz],
            [&v.first_nx, &v.first_ny, &v.first_nz],
        ];
        for &slot in slots.iter().filter(|&&slot| v.met[slot as usize] > 0) {
            self.slot[self.len] = slot;
            for (to, from) in self.columns.iter_mut().zip(from.as_flattened()) {
                to[self.len] = from[slot as usize];
            }
            self.len += 1;
        }
    }

    #[inline(always)]
    fn first(&self, i: usize) -> First {
        let [ox, oy, oz, gx, gy, gz, nx, ny, nz] = &self.columns;
        First {
            origin: V3::new(ox[i], oy[i], oz[i]),
            geometric: V3::new(gx[i], gy[i], gz[i]),
            normal: V3::new(nx[i], ny[i], nz[i]),
        }
    }

    /// Appends the ways of `second`, which the path of row `own` has found.
    #[inline(always)]
    fn link(&self, own: usize, second: Second, links: &mut Links) {
        let scale = (self.first(own).origin - second.origin).abs().max_component();
        let (mut ways, mut density) = ([[0.0; BLOCK]; 3], [0.0; BLOCK]);
        let len = self.len.min(BLOCK);
        for i in 0..len {
            let Link { way, density: found } = link(self.first(i), second, scale);
            (ways[0][i], ways[1][i], ways[2][i], density[i]) = (way.x, way.y, way.z, found);
        }
        let mut wanted = [0u8; BLOCK];
        let mut count = 0;
        for (i, &density) in density[..len].iter().enumerate() {
            wanted[count] = i as u8;
            count += usize::from(i != own && density > 0.0);
        }
        let (wanted, first) = (&wanted[..count], links.len);
        links.len += count;
        let [x, y, z] = &mut links.direction;
        for (to, from) in [(x, &ways[0]), (y, &ways[1]), (z, &ways[2]), (&mut links.density, &density)] {
            to[first..links.len].iter_mut().zip(wanted).for_each(|(to, &i)| *to = from[i as usize % BLOCK]);
        }
        links.slot[first..links.len].iter_mut().zip(wanted).for_each(|(to, &i)| *to = self.slot[i as usize % BLOCK]);
        for (column, from) in links.origin.iter_mut().zip([second.origin.x, second.origin.y, second.origin.z]) {
            column[first..links.len].fill(from);
        }
        links.sources[links.found] = Source { slot: self.slot[own], density: density[own], end: links.len as u32 };
        links.found += 1;
    }
}
