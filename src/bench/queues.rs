//! The renderer's own queues of rays, recorded while it renders: set Q has those that ask for the closest hit, set QS those
//! that ask for any, batch by batch as the stages trace them.

use super::rays::{Batch, RaySet, Rays};
use crate::bvh::{Accel, Query};
use crate::drive;
use crate::error::Result;
use crate::observer::{self, Observer};
use crate::options::RenderOptions;
use crate::plan::Plan;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use std::sync::{Mutex, PoisonError};

/// Names of the two sets.
pub const NAMES: [&str; 2] = ["Q", "QS"];

/// Records both sets from a render as `options` say, but on one thread, so that it is the same every time. Of the waves
/// that the render has, evenly spread ones are kept, with about `most` camera rays in all.
///
/// # Errors
/// What the render reports.
pub fn record(
    scene: &Scene,
    accel: &Accel,
    camera: &Camera,
    options: &RenderOptions,
    most: u64,
) -> Result<[RaySet; 2]> {
    let options = RenderOptions { threads: Some(1), ..options.clone() };
    let plan = Plan::new(scene, accel, &options)?;
    let all = u64::from(options.width) * u64::from(options.height) * u64::from(options.samples);
    let recorder = Recorder { every: all.div_ceil(most.max(1)).max(1), state: Mutex::default() };
    drive::render(scene, accel, camera, &plan, &recorder)?;
    let [closest, any] = recorder.state.into_inner().unwrap_or_else(PoisonError::into_inner).queues;
    let set =
        |name: &str, query, queue: Queue| RaySet { name: name.into(), query, rays: queue.rays, batches: queue.batches };
    Ok([set(NAMES[0], Query::Closest, closest), set(NAMES[1], Query::Any, any)])
}

struct Recorder {
    /// One wave of so many is kept.
    every: u64,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    /// Waves begun.
    waves: u64,
    /// What asks for the closest hit, and what for any.
    queues: [Queue; 2],
}

#[derive(Default)]
struct Queue {
    rays: Rays,
    batches: Vec<Batch>,
}

impl Observer for Recorder {
    fn queue(&self, queue: &observer::Queue<'_>) {
        let observer::Queue { query, depth, rays, .. } = *queue;
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if query == Query::Closest && depth == 0 {
            state.waves += 1;
        }
        if state.waves % self.every != 1 % self.every {
            return;
        }
        let queue = &mut state.queues[usize::from(query == Query::Any)];
        // As the stages have it: rays from the camera are coherent, all others are not.
        queue.batches.push(Batch { rays: rays.len() as u32, coherent: query == Query::Closest && depth == 0 });
        queue.rays.extend(rays);
    }
}
