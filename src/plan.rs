//! Features and options → stages, columns, bytes a path, wave size; and why each is there.

use crate::bvh::Accel;
use crate::error::Result;
use crate::options::RenderOptions;
use crate::scene::Scene;
use serde::Serialize;

/// A stage that will run.
#[derive(Clone, Debug, Serialize)]
pub struct PlannedStage {
    /// Its name.
    pub name: &'static str,
    /// Which of its kernels was chosen.
    pub kernel: String,
    /// Why it is there, or runs this kernel.
    pub why: String,
    /// Columns it reads.
    pub reads: Vec<String>,
    /// Columns it writes.
    pub writes: Vec<String>,
    /// Bytes read a row.
    pub bytes_read: usize,
    /// Bytes written a row.
    pub bytes_written: usize,
}

/// A column that will be allocated.
#[derive(Clone, Debug, Serialize)]
pub struct PlannedColumn {
    /// Table and field: `ray.ox`.
    pub name: String,
    /// Element type and unit.
    pub what: String,
    /// Bytes a row.
    pub bytes: usize,
    /// The feature that requires it.
    pub why: String,
}

/// What a render will do.
#[derive(Clone, Debug, Serialize)]
pub struct Plan {
    /// The options it was made from.
    pub options: RenderOptions,
    /// Stages in order.
    pub stages: Vec<PlannedStage>,
    /// Columns, by table.
    pub columns: Vec<PlannedColumn>,
    /// Bytes of columns a path.
    pub bytes_per_path: usize,
    /// Rows a wave.
    pub wave: usize,
    /// Why that many.
    pub wave_why: String,
    /// Worker threads.
    pub threads: usize,
    /// Instruction set.
    pub simd: &'static str,
    /// Predicted memory of waves (all workers), film, scene and acceleration structure, in bytes.
    pub memory: PlannedMemory,
}

/// Predicted memory, in bytes.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct PlannedMemory {
    /// Columns of all workers.
    pub waves: u64,
    /// Film.
    pub film: u64,
    /// Scene tables.
    pub scene: u64,
    /// Acceleration structure.
    pub accel: u64,
}

impl Plan {
    /// Plans a render of `scene`.
    pub fn new(scene: &Scene, accel: &Accel, options: &RenderOptions) -> Result<Plan> {
        let _ = (scene, accel, options);
        todo!()
    }
}
