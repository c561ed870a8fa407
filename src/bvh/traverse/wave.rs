//! Many rays in flight at once.
//!
//! A ray alone waits: for the node it is at, for the comparison that says where to go next. With many rays in flight
//! there is always another to step, and what a ray will read next is fetched while the others take their turns
//! (asynchronous memory access chaining: Kocberber, Falsafi and Grot 2015). Rays at nodes and rays at leaves stand in
//! two queues, so that each loop does one kind of work and no branch asks which.
//!
//! Against one ray at a time, with the same tests (one thread, trees of 6 and 58 MB): diffuse rays 1.05 and 1.3 times
//! as fast, those of the second bounce 1.15 and 1.65, occlusion 1.1 and 1.45; camera rays 0.9. It ran 1.85 times the
//! instructions then (2643 a diffuse ray); joining distances and children by two shuffles has since taken 5 % off. What
//! shortens [`Flight::visit_node`] shows.
//!
//! Tried: eight rays in flight without queues, each a step in turn, whatever the step. As fast for diffuse rays, 2–6 %
//! slower for the second bounce.

use super::flight::Flight;
use crate::bvh::Bvh4;
use crate::bvh::child::Child;
use crate::bvh::columns::{RayColumns, TraversalCounts};
use crate::bvh::ray::Hit;
use crate::simd::{Address, prefetch};

/// Rays in flight. Tried: 16, which is 2–8 % slower.
pub const IN_FLIGHT: usize = 32;

/// Flights waiting for the same kind of work, by number.
#[derive(Clone, Copy, Debug)]
struct Queue {
    flights: [u8; IN_FLIGHT],
    len: usize,
}

impl Queue {
    const EMPTY: Queue = Queue { flights: [0; IN_FLIGHT], len: 0 };

    /// Adds a flight if `wanted`, without a branch. There is room: the flight stands in no queue.
    #[inline(always)]
    fn push_if(&mut self, flight: u8, wanted: bool) {
        self.flights[self.len % IN_FLIGHT] = flight;
        self.len += usize::from(wanted);
    }
}

/// Traces all rays, and calls `finish` with the row and the hit of each, in no particular order. For the const
/// parameters see [`Flight`].
#[inline(always)]
pub fn trace<const ANY: bool, const SPHERES: bool, const COUNT: bool>(
    bvh: &Bvh4,
    rays: RayColumns<'_>,
    mut finish: impl FnMut(usize, Hit),
) -> TraversalCounts {
    let mut counts = TraversalCounts { rays: rays.len() as u64, ..Default::default() };
    let mut flights: [Flight; IN_FLIGHT] = std::array::from_fn(|_| Flight::new());
    let mut rows = [0; IN_FLIGHT];
    let mut next_row = 0;
    let (mut nodes, mut leaves) = (Queue::EMPTY, Queue::EMPTY);
    let mut idle = Queue { flights: std::array::from_fn(|i| i as u8), len: IN_FLIGHT };
    loop {
        // Launch.
        while idle.len > 0 && next_row < rays.len() {
            let row = next_row;
            next_row += 1;
            let ray = rays.ray(row);
            if ray.is_traceable() && !bvh.nodes.is_empty() {
                idle.len -= 1;
                let flight = idle.flights[idle.len % IN_FLIGHT];
                flights[flight as usize % IN_FLIGHT].launch(&ray);
                rows[flight as usize % IN_FLIGHT] = row;
                nodes.push_if(flight, true);
            } else {
                finish(row, Hit::NONE);
            }
        }
        let in_flight = nodes.len + leaves.len;
        if in_flight == 0 {
            return counts;
        }
        let done_before = idle.len;
        let mut sort = |flight: u8, child: Child, nodes: &mut Queue, leaves: &mut Queue| {
            let done = child == Child::EMPTY;
            nodes.push_if(flight, !child.is_leaf());
            leaves.push_if(flight, child.is_leaf() && !done);
            idle.push_if(flight, done);
            // Both addresses, so that the choice is no branch. (Leaves of spheres fetch in vain.)
            let node = Address::of(&bvh.nodes, child.node());
            let leaf = Address::of(&bvh.triangles, child.blocks().start);
            prefetch(if child.is_leaf() { leaf } else { node });
        };
        // Nodes, until half of the flights wait for something else.
        while 2 * nodes.len > in_flight || leaves.len == 0 && nodes.len > 0 {
            let queue = nodes;
            nodes.len = 0;
            for &number in &queue.flights[..queue.len.min(IN_FLIGHT)] {
                let flight = &mut flights[number as usize % IN_FLIGHT];
                flight.visit_node::<ANY, COUNT>(bvh, &mut counts);
                sort(number, flight.child(), &mut nodes, &mut leaves);
            }
        }
        // Leaves.
        let queue = leaves;
        leaves.len = 0;
        for &number in &queue.flights[..queue.len.min(IN_FLIGHT)] {
            let flight = &mut flights[number as usize % IN_FLIGHT];
            flight.visit_leaf::<ANY, SPHERES, COUNT>(bvh, &mut counts);
            sort(number, flight.child(), &mut nodes, &mut leaves);
        }
        for &number in &idle.flights[done_before..idle.len.min(IN_FLIGHT)] {
            finish(rows[number as usize % IN_FLIGHT], flights[number as usize % IN_FLIGHT].hit());
        }
    }
}
