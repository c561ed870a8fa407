//! Shapes that a ball can be blown up to: sphere, blob, coral.

use super::ball::Ball;
use super::noise::{Field, fractal, ridges};
use crate::scene::description::MeshDescription;
use glam::Vec3;

/// A unit sphere.
pub fn sphere(triangles: u64) -> MeshDescription {
    mesh(Ball::new(triangles), |direction| (direction, direction))
}

/// A softly displaced sphere.
pub fn blob(triangles: u64, seed: u32) -> MeshDescription {
    displaced(triangles, |direction| {
        let field = fractal(direction * 1.4, seed, 2, 0.25);
        Field { value: 1.0 + 0.42 * field.value, gradient: field.gradient * (0.42 * 1.4) }
    })
}

/// A sphere with ridges over many octaves, deepest where a slow wave says so.
pub fn coral(triangles: u64, seed: u32) -> MeshDescription {
    // Ridges narrower than a few triangles would only be jagged. A triangle's side is about √(29 / triangles).
    let finest = (triangles as f32 / 29.0).sqrt() / 6.0;
    let octaves = ((finest / 3.2).log2() as u32).clamp(2, 6);
    displaced(triangles, move |direction| {
        let slow = fractal(direction * 1.1, seed ^ 0x5eed, 2, 0.5);
        let folds = ridges(direction * 3.2, seed, octaves, 0.36);
        // A product: high ground has high ridges.
        let (lift, height) = (0.26 + 0.14 * slow.value, folds.value - 0.9);
        Field {
            value: 0.95 + 0.2 * slow.value + lift * height,
            gradient: slow.gradient * (1.1 * (0.2 + 0.14 * height)) + folds.gradient * (3.2 * lift),
        }
    })
}

/// A ball whose radius by direction is a field.
fn displaced(triangles: u64, radius: impl Fn(Vec3) -> Field + Sync) -> MeshDescription {
    mesh(Ball::new(triangles), |direction| {
        let field = radius(direction);
        // The surface |p| = r(p/|p|) has the normal r·d − (∇r without its radial part).
        let along = field.gradient - direction * field.gradient.dot(direction);
        (direction * field.value, (direction * field.value - along).normalize())
    })
}

fn mesh(ball: Ball, surface: impl Fn(Vec3) -> (Vec3, Vec3) + Sync) -> MeshDescription {
    let (positions, normals) = ball.vertices(surface);
    MeshDescription { positions, normals, triangles: ball.triangles(), ..Default::default() }
}
