//! Steps through nodes.

use super::IN_FLIGHT;
use super::queue::{Steps, vectors};
use super::slot::Slot;
use crate::bvh::node::Node;
use crate::simd::wide::Wide;

/// Each of the first `len` steps visits its node: the topmost child of its slot makes way for those of the node that the ray
/// meets, the nearest on top. No branch depends on the data: such a branch is mispredicted every other time, and costs more
/// than sorting four children of which one is met.
#[inline(always)]
pub fn visit<W: Wide, N: Node, const ANY: bool>(
    wide: W,
    nodes: &[N],
    steps: &mut Steps,
    len: usize,
    slots: &mut [Slot; IN_FLIGHT],
) {
    for steps in vectors(steps, len, W::RAYS) {
        let slot = |ray: usize| steps[ray].slot();
        let node = |ray: usize| &nodes[steps[ray].child().node()];
        let (entry, exit) = N::enter(wide, node, |ray, row| &slots[slot(ray)].ray.slab[row]);
        let met = wide.at_most(entry, exit);
        let keys = wide.sorted(wide.keys(entry, met));
        let children = wide.permuted(wide.gather(|ray| node(ray).children()), keys);
        let met = wide.bits(met);
        // Read before any is written: a slot may stand in the vector twice.
        let tops: [u8; 4] = std::array::from_fn(|ray| if ray < W::RAYS { slots[slot(ray)].top } else { 0 });
        wide.scatter(children, |ray, children| {
            slots[slot(ray)].children[tops[ray] as usize..][..4].copy_from_slice(&children);
        });
        if !ANY {
            wide.scatter(keys, |ray, keys| slots[slot(ray)].keys[tops[ray] as usize..][..4].copy_from_slice(&keys));
        }
        for ray in 0..W::RAYS {
            let met = (met >> (4 * ray) & 15).count_ones() as u8;
            slots[slot(ray)].top = tops[ray].wrapping_add(met).wrapping_sub(1);
        }
    }
}
