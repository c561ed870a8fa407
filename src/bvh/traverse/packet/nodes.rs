//! Nodes of a packet's way.

use super::rays::{Packet, first_of, vector};
use crate::bvh::node::Node;
use crate::bvh::traverse::child_of;
use crate::bvh::traverse::stack::Entry;
use crate::simd::wide::Wide;
use glam::Vec4;

impl Packet {
    /// Pushes the children that any ray in `mask` meets, the nearest last. Gives how many.
    #[inline(always)]
    pub fn visit_node<W: Wide, N: Node>(&mut self, wide: W, node: &N, mask: u64) -> usize {
        let planes = node.planes();
        let near = [0, 1, 2].map(|axis| planes[self.near[axis] & 1][axis]);
        let far = [0, 1, 2].map(|axis| planes[1 - (self.near[axis] & 1)][axis]);
        let (entry, exit) = self.interval.enter(near, far);
        let words = |lanes: Vec4| lanes.to_array().map(f32::to_bits);
        let (entry, exit) = (wide.repeat(&words(entry)), wide.repeat(&words(exit)));
        let met = wide.at_most(entry, exit);
        let count = (wide.bits(met) & 15).count_ones() as usize;
        if count == 0 {
            return 0;
        }
        // The nearest last.
        let mut keys = [0; 4];
        wide.scatter(wide.sorted(wide.keys(entry, met)), |quad, words| {
            if quad == 0 {
                keys = words
            }
        });
        let numbers = |planes: [Vec4; 3]| planes.map(|planes| N::lane_numbers(wide, planes).to_array());
        let (near, far) = (numbers(near), numbers(far));
        let mut meeting = [0u64; 4];
        let mut left = mask;
        while left != 0 {
            let first = first_of::<W>(left);
            let slab = self.slab_lanes(wide, first);
            for (key, meeting) in keys.iter().zip(&mut meeting).take(count) {
                let lane = *key as usize & 3;
                let near = [near[0][lane], near[1][lane], near[2][lane]];
                let far = [far[0][lane], far[1][lane], far[2][lane]];
                let (enter, leave) = N::enter_box(wide, near, far, &slab);
                *meeting |= u64::from(wide.bits(wide.at_most(enter, leave))) << first;
            }
            left &= !(vector::<W>() << first);
        }
        let before = self.stack.len();
        for (&key, meeting) in keys.iter().zip(meeting).take(count) {
            let child = child_of(node, key as usize);
            self.stack.push_if(Entry::new(f32::from_bits(key & !3), child), meeting & mask);
        }
        self.stack.len() - before
    }
}
