//! Keeps the first two vertices of paths, for neighbours to share.

use super::block::{Block, get};
use crate::wave::samples::Samples;
use crate::wave::vertices::Vertices;

/// Keeps the rows of the block as first vertices.
#[inline(always)]
pub fn first(block: &Block, to: &mut Vertices) {
    for (i, &slot) in block.slot[..block.len].iter().enumerate() {
        let slot = slot as usize;
        to.met[slot] = 1;
        let (origin, geometric) = (get(&block.origin, i), get(&block.geometric, i));
        let (normal, albedo) = (get(&block.normal, i), get(&block.albedo, i));
        (to.first_ox[slot], to.first_oy[slot], to.first_oz[slot]) = (origin.x, origin.y, origin.z);
        (to.first_gx[slot], to.first_gy[slot], to.first_gz[slot]) = (geometric.x, geometric.y, geometric.z);
        (to.first_nx[slot], to.first_ny[slot], to.first_nz[slot]) = (normal.x, normal.y, normal.z);
        (to.albedo_r[slot], to.albedo_g[slot], to.albedo_b[slot]) = (albedo.x, albedo.y, albedo.z);
    }
}

/// Keeps the rows of the block as second vertices. From here on their paths gather what the second vertex scatters towards whatever
/// sees it, so they carry 1, and their samples begin again from 0.
#[inline(always)]
pub fn second(block: &mut Block, samples: &mut Samples, to: &mut Vertices) {
    for (i, &slot) in block.slot[..block.len].iter().enumerate() {
        let slot = slot as usize;
        to.met[slot] = 2;
        let (origin, geometric) = (get(&block.origin, i), get(&block.geometric, i));
        (to.second_ox[slot], to.second_oy[slot], to.second_oz[slot]) = (origin.x, origin.y, origin.z);
        (to.second_gx[slot], to.second_gy[slot], to.second_gz[slot]) = (geometric.x, geometric.y, geometric.z);
        for (to, from) in
            [(&mut to.direct_r, &mut samples.r), (&mut to.direct_g, &mut samples.g), (&mut to.direct_b, &mut samples.b)]
        {
            to[slot] = std::mem::take(&mut from[slot]);
        }
    }
    for column in &mut block.beta {
        column[..block.len].fill(1.0);
    }
}

/// Forgets what earlier paths of the first `n` slots have met.
pub fn nothing(n: usize, to: &mut Vertices) {
    to.met[..n].fill(0);
    for column in [&mut to.direct_r, &mut to.direct_g, &mut to.direct_b] {
        column[..n].fill(0.0);
    }
}
