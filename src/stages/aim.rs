//! Camera rays: what generate and lamps share.

use super::Context;
use crate::sampling::lanes::Lanes;
use glam::Vec4;

/// Rows whose random numbers are drawn at once.
const ROWS: usize = 64;

/// Turns the corners of pixels, which stand in the columns of x and y, into directions through points of those pixels, drawn for the decision
/// `dimension` of each row's sample. Columns of directions have room for a vector beyond the last row.
#[inline(always)]
pub fn aim(context: &Context, dimension: u32, pixel: &[u32], index: &[u32], [dx, dy, dz]: [&mut [f32]; 3]) {
    let n = pixel.len();
    let columns = dx[..n].chunks_mut(ROWS).zip(dy[..n].chunks_mut(ROWS));
    for ((pixels, indices), (x, y)) in pixel.chunks(ROWS).zip(index.chunks(ROWS)).zip(columns) {
        // The last chunk is filled up with rows that nobody reads.
        let (mut pixel, mut index, mut jitter) = ([0; ROWS], [0; ROWS], [[0.0; ROWS]; 2]);
        pixel[..pixels.len()].copy_from_slice(pixels);
        index[..indices.len()].copy_from_slice(indices);
        context.sampler.draw_rows(&pixel, &index, dimension, &mut jitter);
        x.iter_mut().zip(&jitter[0]).for_each(|(x, u)| *x += u);
        y.iter_mut().zip(&jitter[1]).for_each(|(y, v)| *y += v);
    }
    for i in (0..n).step_by(Vec4::WIDTH) {
        let (x, y) = (Vec4::load(&dx[i..]), Vec4::load(&dy[i..]));
        context.lens.direction(x, y).store([dx, dy, dz], i);
    }
}
