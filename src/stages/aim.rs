//! Camera rays: what generate and lamps share.

use super::Context;

/// Rows whose random numbers are drawn, and whose directions are computed, at once.
pub const ROWS: usize = 64;

/// Turns the corners of pixels, which stand in the columns of x and y, into directions through points of those pixels, drawn for the decision
/// `dimension` of each row's sample.
#[inline(always)]
pub fn aim(context: &Context, dimension: u32, pixel: &[u32], index: &[u32], [dx, dy, dz]: [&mut [f32]; 3]) {
    let n = pixel.len();
    let columns = dx[..n].chunks_mut(ROWS).zip(dy[..n].chunks_mut(ROWS)).zip(dz[..n].chunks_mut(ROWS));
    for ((pixels, indices), ((dx, dy), dz)) in pixel.chunks(ROWS).zip(index.chunks(ROWS)).zip(columns) {
        // The last chunk is filled up with rows that nobody reads: loops over whole blocks become vectors.
        let len = pixels.len();
        let (mut pixel, mut index, mut jitter) = ([0; ROWS], [0; ROWS], [[0.0; ROWS]; 2]);
        pixel[..len].copy_from_slice(pixels);
        index[..len].copy_from_slice(indices);
        context.sampler.draw_rows(&pixel, &index, dimension, &mut jitter);
        let (mut x, mut y, mut z) = ([0.0; ROWS], [0.0; ROWS], [0.0; ROWS]);
        x[..len].copy_from_slice(dx);
        y[..len].copy_from_slice(dy);
        for i in 0..ROWS {
            let direction = context.lens.direction(x[i] + jitter[0][i], y[i] + jitter[1][i]);
            (x[i], y[i], z[i]) = (direction.x, direction.y, direction.z);
        }
        dx.copy_from_slice(&x[..len]);
        dy.copy_from_slice(&y[..len]);
        dz.copy_from_slice(&z[..len]);
    }
}
