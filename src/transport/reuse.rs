//! Path reuse: what the second vertex of one path is worth to the first vertex of another.
//!
//! Bekaert, Sbert and Halton, *Accelerating Path Tracing by Re-Using Paths*, EGWR 2002. Paths of neighbouring pixels meet the scene at first
//! vertices 1…N and go on to second vertices. Each second vertex y, found from first vertex j with density p_j(y) per area,
//! is seen from first vertex i as well, if nothing is in the way. By the balance heuristic it adds
//! ρ_i · p_i(y) / Σ_k p_k(y) · L(y) to pixel i, where L(y) is the radiance that y was found to scatter; the sum is over all first vertices that
//! see y. As diffuse surfaces draw directions by cosine, f·cos θ is ρ_i · p_i exactly, so no contribution exceeds ρ_i · L.

use crate::sampling::v3::V3;

/// Most pixels that share paths.
pub const MOST_PIXELS: u32 = 64;

/// A first vertex.
#[derive(Clone, Copy, Debug)]
pub struct First {
    /// Where rays leave it.
    pub origin: V3,
    /// Unit geometric normal, on the side of the arriving ray.
    pub geometric: V3,
    /// Unit shading normal, on the same side.
    pub normal: V3,
}

/// A second vertex.
#[derive(Clone, Copy, Debug)]
pub struct Second {
    /// Where rays leave it.
    pub origin: V3,
    /// Unit geometric normal, on the side of the arriving ray.
    pub geometric: V3,
}

/// The way from a second vertex to a first one.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    /// From end to end.
    pub way: V3,
    /// The density, per area and but for a constant, with which paths that leave the first vertex come to the second, were nothing between
    /// them; 0 where one faces away from the other.
    pub density: f32,
}

/// Links `second` to `first`. Densities are per area in units of `scale`, and can be compared only if that is the same: with a length of
/// the order of those at hand, no square is out of range.
#[inline(always)]
pub fn link(first: First, second: Second, scale: f32) -> Link {
    let way = first.origin - second.origin;
    let scaled = way * (1.0 / scale);
    let squared = scaled.dot(scaled);
    let leaves = -scaled.dot(first.normal);
    let arrives = scaled.dot(second.geometric);
    // Nothing is greater than NaN: vertices in one place are not linked.
    let sees = (leaves > 0.0) & (-scaled.dot(first.geometric) > 0.0) & (arrives > 0.0);
    let density = leaves * arrives / (squared * squared);
    Link { way, density: if sees { density } else { 0.0 } }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::diffuse;

    fn v(x: f32, y: f32, z: f32) -> V3 {
        V3::new(x, y, z)
    }

    /// The density is that of the sampling routine, brought from solid angle to area.
    #[test]
    fn densities_are_those_of_the_directions_drawn() {
        let normal = v(0.36, 0.48, 0.8);
        let first = First { origin: v(0.2, -0.4, 1.0), geometric: v(0.0, 0.0, 1.0), normal };
        for (u, t) in [([0.1, 0.3], 0.01f32), ([0.7, 0.9], 3.0), ([0.5, 0.2], 1e6)] {
            let drawn = diffuse::sample(v(1.0, 1.0, 1.0), normal, first.geometric, u[0], u[1]);
            let geometric = v(-0.8, 0.0, -0.6);
            let second = Second { origin: first.origin + drawn.direction * t, geometric };
            let link = link(first, second, t);
            let cos = -geometric.dot(drawn.direction);
            let expected = std::f32::consts::PI * drawn.pdf * cos.max(0.0);
            assert!((link.density - expected).abs() <= 1e-4 * expected, "{link:?}: {expected}");
            assert!((link.way + drawn.direction * t).abs().max_component() <= 1e-6 * t.max(1.0), "{link:?}");
        }
    }

    #[test]
    fn what_faces_away_or_is_in_the_same_place_is_not_linked() {
        let up = v(0.0, 0.0, 1.0);
        let first = First { origin: v(0.0, 0.0, 0.0), geometric: up, normal: up };
        let second = |origin, geometric| Second { origin, geometric };
        let density = |s| link(first, s, 1.0).density;
        assert!(density(second(v(0.0, 0.0, 2.0), -up)) > 0.0);
        for (origin, geometric) in [(v(0.0, 0.0, 2.0), up), (v(0.0, 0.0, -2.0), up), (v(0.0, 0.0, 0.0), -up)] {
            assert_eq!(density(second(origin, geometric)), 0.0);
        }
    }

    #[test]
    fn scale_and_distance_from_it_do_not_matter() {
        let up = v(0.0, 0.0, 1.0);
        let at = |scale: f32| {
            let first = First { origin: v(0.1, 0.2, 0.0) * scale, geometric: up, normal: up };
            link(first, Second { origin: v(0.3, -0.1, 0.7) * scale, geometric: -up }, scale).density
        };
        for scale in [1e-30, 1e-12, 1e12, 1e30] {
            assert!((at(scale) / at(1.0) - 1.0).abs() < 1e-5, "{scale:e}");
        }
    }
}
