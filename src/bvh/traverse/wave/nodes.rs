//! Steps through nodes.

use super::queue::Steps;
use super::slot::Slot;
use super::{IN_FLIGHT, next};
use crate::bvh::block::TriangleBlock;
use crate::bvh::node::Node;
use crate::bvh::traverse::Tree;
use crate::simd::wide::Wide;

/// Each of the first `len` steps visits its node: the topmost child of its slot makes way for those of the node that the ray
/// meets, the nearest on top, and that is what the step visits next. No branch depends on the data: such a branch is
/// mispredicted every other time, and costs more than sorting four children of which one is met.
#[inline(always)]
pub fn visit<W: Wide, N: Node, const ANY: bool>(
    wide: W,
    tree: &Tree<'_, N, impl TriangleBlock>,
    steps: &mut Steps,
    len: usize,
    slots: &mut [Slot; IN_FLIGHT],
) {
    let end = steps.fill(len, W::RAYS);
    for first in (0..end).step_by(W::RAYS) {
        let number: [usize; 4] = std::array::from_fn(|ray| steps.slot(first + ray));
        let visited: [usize; 4] = std::array::from_fn(|ray| steps.child(first + ray).node());
        let node = |ray: usize| &tree.nodes[visited[ray]];
        let (entry, exit) = N::enter(wide, node, |ray, row| &slots[number[ray]].ray.slab[row]);
        let met = wide.at_most(entry, exit);
        let keys = wide.sorted(wide.keys(entry, met));
        let children = wide.permuted(wide.gather(|ray| node(ray).children()), keys);
        let met = wide.bits(met);
        // Read before any is written: a slot may stand in the vector twice.
        let tops: [u8; 4] = std::array::from_fn(|ray| if ray < W::RAYS { slots[number[ray]].top } else { 0 });
        wide.scatter(children, |ray, children| {
            slots[number[ray]].children[tops[ray] as usize..][..4].copy_from_slice(&children);
        });
        if !ANY {
            wide.scatter(keys, |ray, keys| slots[number[ray]].keys[tops[ray] as usize..][..4].copy_from_slice(&keys));
        }
        for ray in 0..W::RAYS {
            let met = (met >> (4 * ray) & 15).count_ones() as u8;
            let slot = &mut slots[number[ray]];
            slot.top = tops[ray].wrapping_add(met).wrapping_sub(1);
            steps.set_child(first + ray, next(tree, slot));
        }
    }
}
