//! Steps through nodes.

use super::queue::Steps;
use super::slot::Slot;
use super::{IN_FLIGHT, fetch};
use crate::bvh::block::TriangleBlock;
use crate::bvh::grid_node8::WIDTH;
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
        wide.scatter(children, |ray, children| {
            slots[number[ray]].children[steps.top(first + ray) as usize..][..4].copy_from_slice(&children);
        });
        if !ANY {
            wide.scatter(keys, |ray, keys| {
                slots[number[ray]].keys[steps.top(first + ray) as usize..][..4].copy_from_slice(&keys);
            });
        }
        steps.climb(wide, first, wide.bits(met));
        for ray in 0..W::RAYS {
            let child = slots[number[ray]].child(steps.top(first + ray));
            fetch(tree, child, false);
            steps.set_child(first + ray, child);
        }
    }
}

/// The same through nodes of eight children, for rays that ask for any hit, one at a time: its eight boxes fill a vector. The children that the ray
/// meets stay in the order of the node, largest first, so that the smallest comes on top.
///
/// Tried: the largest on top, and pairs of nodes at the bottom joined where their box is smaller than the two are together; S on lucy100k then visits 8.80
/// nodes instead of 8.68, in the same time.
///
/// For rays that ask for the closest hit, which need the nearest child on top, 4.73 Mray/s instead of 5.9 (D on lucy100k, AVX-512): to find it among
/// eight takes as long as the boxes, and there is too little to do for other rays meanwhile.
#[inline(always)]
pub fn visit_widened<W: Wide, N: Node>(
    wide: W,
    tree: &Tree<'_, N, impl TriangleBlock>,
    steps: &mut Steps,
    len: usize,
    slots: &mut [Slot; IN_FLIGHT],
) {
    for step in 0..len.min(IN_FLIGHT) {
        let node = &tree.wide[steps.child(step).node()];
        let slot = &mut slots[steps.slot(step)];
        let top = steps.top(step);
        let [x, y, z, t_max] = wide.eights(&slot.ray.slab[0]);
        let [ox, oy, oz, t_min] = wide.eights(&slot.ray.slab[1]);
        let [x_near, x_far] = wide.planes8(node.words(0), x, ox);
        let [y_near, y_far] = wide.planes8(node.words(1), y, oy);
        let [z_near, z_far] = wide.planes8(node.words(2), z, oz);
        let entry = wide.max8(wide.max8(x_near, y_near), wide.max8(z_near, t_min));
        let exit = wide.min8(wide.min8(x_far, y_far), wide.min8(z_far, t_max));
        let met = wide.at_most8(entry, exit);
        wide.store8(wide.packed8(wide.load8(node.children()), met), &mut slot.children[top as usize..][..WIDTH]);
        let top = top.wrapping_add(met.count_ones() as u8).wrapping_sub(1);
        let child = slot.child(top);
        fetch(tree, child, true);
        steps.set_top(step, top);
        steps.set_child(step, child);
    }
}
