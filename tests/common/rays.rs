//! What tests of traversal share: random numbers, and every kernel there is.

use comber::bvh::Traversal;
use comber::options::Quality;
use comber::simd::Tier;
use glam::Vec3;

/// PCG-XSH-RR: the tests' own random numbers.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((((self.0 >> 18) ^ self.0) >> 27) as u32).rotate_right((self.0 >> 59) as u32)
    }

    /// In [−1, 1].
    pub fn signed(&mut self) -> f32 {
        self.next() as i32 as f32 / (1u32 << 31) as f32
    }

    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }

    pub fn below(&mut self, n: usize) -> usize {
        self.next() as usize % n
    }
}

/// Every way through the tree on every tier.
pub fn kernels() -> Vec<(Traversal, Tier)> {
    let ways = Traversal::ALL;
    ways.into_iter().flat_map(|way| Tier::available().into_iter().map(move |tier| (way, tier))).collect()
}

/// Every way to build the tree.
pub const QUALITIES: [Quality; 3] = [Quality::Fast, Quality::Default, Quality::Best];
