//! Boxes drawn over a picture as lines.

use crate::scene::camera::Lens;
use glam::{Vec2, Vec3};

/// Distance from the centre of a line to where it begins to fade, and to where it is gone, in pixels.
const SOLID: f32 = 0.2;
const FADED: f32 = 1.2;

/// A box and the colour of its edges, linear Rec. 709.
#[derive(Clone, Copy, Debug)]
pub struct Wire {
    /// Smallest corner.
    pub min: Vec3,
    /// Largest corner.
    pub max: Vec3,
    /// Colour.
    pub color: Vec3,
}

/// Draws the edges of all boxes over `pixels`, `width` to a row, as `lens` sees them. Lines that are nearer on average
/// cover farther ones; what stands in the picture already covers nothing.
pub fn draw(pixels: &mut [[f32; 3]], width: usize, lens: &Lens, boxes: &[Wire]) {
    if width == 0 || pixels.is_empty() {
        return;
    }
    let projection = Projection::new(lens);
    let size = Vec2::new(width as f32, (pixels.len() / width) as f32);
    let mut lines: Vec<Line> = boxes
        .iter()
        .flat_map(|wire| edges(wire).map(move |ends| (ends, wire.color)))
        .filter_map(|(ends, color)| projection.line(ends, color))
        .filter_map(|line| line.within(size))
        .collect();
    lines.sort_by(|a, b| b.depth.total_cmp(&a.depth));
    for line in &lines {
        line.paint(pixels, width);
    }
}

/// The twelve edges of a box.
fn edges(wire: &Wire) -> impl Iterator<Item = [Vec3; 2]> + use<> {
    let (min, max) = (wire.min, wire.max);
    let corner = move |bits: usize| {
        let pick = |axis: usize| if bits >> axis & 1 == 0 { min[axis] } else { max[axis] };
        Vec3::new(pick(0), pick(1), pick(2))
    };
    (0..3).flat_map(move |axis| {
        (0..8).filter(move |bits| bits >> axis & 1 == 0).map(move |bits| [corner(bits), corner(bits | 1 << axis)])
    })
}

/// From world space to pixels: the inverse of [`Lens`].
struct Projection {
    lens: Lens,
    forward: Vec3,
}

impl Projection {
    fn new(lens: &Lens) -> Self {
        // Steps right and down span the image plane; the way into the picture is across both.
        Projection { lens: *lens, forward: lens.dx.cross(lens.dy).normalize() }
    }

    /// The part of an edge that is before the camera, in pixels.
    fn line(&self, ends: [Vec3; 2], color: Vec3) -> Option<Line> {
        let [mut a, mut b] = ends.map(|end| end - self.lens.origin);
        let (da, db) = (a.dot(self.forward), b.dot(self.forward));
        // The near plane is relative to the edge, as scenes come in all sizes.
        let near = 1e-4 * da.abs().max(db.abs());
        if !(near > 0.0 && da.max(db) > near) {
            return None;
        }
        let at_near = a + (b - a) * ((near - da) / (db - da));
        if da < near {
            a = at_near;
        } else if db < near {
            b = at_near;
        }
        let depth = 0.5 * (a.dot(self.forward) + b.dot(self.forward));
        Some(Line { ends: [self.pixel(a), self.pixel(b)], depth, color })
    }

    /// The pixel position of a point that is given relative to the camera and lies before it.
    fn pixel(&self, point: Vec3) -> Vec2 {
        let scale = self.lens.corner.dot(self.forward) / point.dot(self.forward);
        let from_corner = point * scale - self.lens.corner;
        let along = |step: Vec3| from_corner.dot(step) / step.dot(step);
        Vec2::new(along(self.lens.dx), along(self.lens.dy))
    }
}

/// An edge on the image.
#[derive(Clone, Copy, Debug)]
struct Line {
    ends: [Vec2; 2],
    depth: f32,
    color: Vec3,
}

impl Line {
    /// The part that can touch an image of `size` (Liang and Barsky 1984, "A new concept and method for line
    /// clipping").
    fn within(self, size: Vec2) -> Option<Line> {
        let [a, b] = self.ends;
        let step = b - a;
        let (mut enter, mut leave) = (0.0_f32, 1.0_f32);
        for axis in 0..2 {
            let (low, high) = (-FADED - a[axis], size[axis] + FADED - a[axis]);
            if step[axis] == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return None;
                }
                continue;
            }
            let (first, second) = (low / step[axis], high / step[axis]);
            enter = enter.max(first.min(second));
            leave = leave.min(first.max(second));
        }
        // Also false for ends that are not finite.
        (enter <= leave).then(|| Line { ends: [a + step * enter, a + step * leave], ..self })
    }

    /// Blends the line into the image: for each pixel along its longer axis, those near it on the other.
    fn paint(&self, pixels: &mut [[f32; 3]], width: usize) {
        let height = pixels.len() / width;
        let [a, b] = self.ends;
        let major = usize::from((b - a).y.abs() > (b - a).x.abs());
        let minor = 1 - major;
        let limits = if major == 0 { [width, height] } else { [height, width] };
        let (from, to) = if a[major] <= b[major] { (a, b) } else { (b, a) };
        let slope = if to[major] > from[major] { (to[minor] - from[minor]) / (to[major] - from[major]) } else { 0.0 };
        // A step across a steep line is longer than its distance from it.
        let reach = FADED * (1.0 + slope * slope).sqrt();
        for along in range(from[major] - FADED, to[major] + FADED, limits[0]) {
            let center = from[minor] + slope * (along as f32 + 0.5 - from[major]);
            for across in range(center - reach, center + reach, limits[1]) {
                let [x, y] = if major == 0 { [along, across] } else { [across, along] };
                let distance = self.distance(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
                let opacity = ((FADED - distance) / (FADED - SOLID)).clamp(0.0, 1.0);
                let pixel = &mut pixels[y * width + x];
                *pixel = Vec3::from(*pixel).lerp(self.color, opacity).into();
            }
        }
    }

    /// Distance of a point from the line, which ends at its ends.
    fn distance(&self, point: Vec2) -> f32 {
        let [a, b] = self.ends;
        let along = ((point - a).dot(b - a) / (b - a).length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        point.distance(a.lerp(b, along))
    }
}

/// The pixels between two positions, as far as there are any.
fn range(from: f32, to: f32, limit: usize) -> std::ops::Range<usize> {
    let bound = |position: f32| (position.max(0.0) as usize).min(limit);
    bound(from.floor())..bound(to.ceil())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::camera::Camera;
    use glam::DVec3;

    const SIZE: usize = 64;

    fn lens() -> Lens {
        let camera = Camera::look(DVec3::Z * 4.0, DVec3::NEG_Z, DVec3::Y, 0.5, 0.5).unwrap();
        camera.lens(SIZE as u32, SIZE as u32)
    }

    fn drawn(boxes: &[Wire]) -> Vec<[f32; 3]> {
        let mut pixels = vec![[0.0; 3]; SIZE * SIZE];
        draw(&mut pixels, SIZE, &lens(), boxes);
        pixels
    }

    fn cube(half: f32, color: Vec3) -> Wire {
        Wire { min: Vec3::splat(-half), max: Vec3::splat(half), color }
    }

    #[test]
    fn projection_inverts_the_lens() {
        let lens = lens();
        for (x, y) in [(0.0, 0.0), (10.5, 3.25), (64.0, 64.0)] {
            let seen = Projection::new(&lens).pixel(glam::Vec3::from(lens.direction(x, y)) * 7.0);
            assert!((seen - Vec2::new(x, y)).length() < 1e-3, "{seen}");
        }
    }

    #[test]
    fn a_cube_has_its_front_edge_where_it_should() {
        let pixels = drawn(&[cube(1.0, Vec3::ONE)]);
        // The front face is 3 away, where the frame is 3 wide: its edge is at 1/6 of the frame.
        let row = |x: usize| pixels[(SIZE / 2 - 5) * SIZE + x][0];
        assert!(row(10) > 0.8 && row(11) > 0.0 && row(7) == 0.0 && row(14) == 0.0);
        assert_eq!(pixels[SIZE / 2 * SIZE + SIZE / 2], [0.0; 3], "the middle is empty");
    }

    #[test]
    fn nearer_lines_cover_farther_ones_in_any_order() {
        let near = Wire { min: Vec3::new(-1.0, 0.0, 2.0), max: Vec3::new(1.0, 0.0, 2.0), color: Vec3::X };
        let far = Wire { min: Vec3::new(-1.0, 0.0, -2.0), max: Vec3::new(1.0, 0.0, -2.0), color: Vec3::Y };
        for boxes in [[near, far], [far, near]] {
            let [red, green, _] = drawn(&boxes)[SIZE / 2 * SIZE + SIZE / 2];
            assert!(red > 0.5 && green < 0.5);
        }
    }

    #[test]
    fn what_is_behind_or_degenerate_does_no_harm() {
        let behind = Wire { min: Vec3::splat(5.0), max: Vec3::splat(6.0), color: Vec3::ONE };
        assert!(drawn(&[behind]).iter().all(|pixel| *pixel == [0.0; 3]));
        let around = cube(100.0, Vec3::ONE);
        let at_camera = Wire { min: Vec3::Z * 4.0, max: Vec3::Z * 4.0, color: Vec3::ONE };
        let endless = cube(f32::INFINITY, Vec3::ONE);
        let pixels = drawn(&[around, at_camera, endless, cube(1e30, Vec3::ONE)]);
        assert!(pixels.iter().flatten().all(|value| value.is_finite()));
    }
}
