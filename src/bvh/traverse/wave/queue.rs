//! Slots that wait for the same kind of work.

use super::IN_FLIGHT;
use crate::bvh::child::Child;

/// A ray's slot and what it visits next, in one word so that a queue takes both by one store.
#[derive(Clone, Copy, Debug)]
pub struct Step(u64);

impl Step {
    /// The ray in `slot` visits `child`.
    #[inline(always)]
    pub fn new(slot: usize, child: Child) -> Step {
        Step(u64::from(child.bits()) << 32 | slot as u64)
    }

    /// The ray's slot.
    #[inline(always)]
    pub fn slot(self) -> usize {
        self.0 as usize % IN_FLIGHT
    }

    /// What it visits.
    #[inline(always)]
    pub fn child(self) -> Child {
        Child::from_bits((self.0 >> 32) as u32)
    }
}

/// Room for [`IN_FLIGHT`] steps and to fill the last vector up. How many there are is kept beside it, by who uses it: in
/// one structure with the array it would be a number in memory, and not in a register.
pub type Steps = [Step; IN_FLIGHT + 4];

/// No steps.
pub const NO_STEPS: Steps = [Step(0); IN_FLIGHT + 4];

/// Adds a step if `wanted`, without a branch. There is room: each slot stands in one queue at most.
#[inline(always)]
pub fn push_if(steps: &mut Steps, len: &mut usize, step: Step, wanted: bool) {
    steps[*len % IN_FLIGHT] = step;
    *len += usize::from(wanted);
}

/// The first `len` steps in vectors of `rays`: the last vector is filled up with its last step, whose work is then done
/// twice, alike.
#[inline(always)]
pub fn vectors(steps: &mut Steps, len: usize, rays: usize) -> impl Iterator<Item = &[Step]> {
    let last = steps[len.wrapping_sub(1) % IN_FLIGHT];
    let len = len % (IN_FLIGHT + 1);
    steps[len..len + 4].fill(last);
    steps[..len.next_multiple_of(rays)].chunks_exact(rays)
}
