//! The wave: paths as rows, their components as columns.

pub mod columns;
pub mod features;
pub mod hits;
pub mod paths;
pub mod samples;
pub mod shadows;
pub mod span;
pub mod vertices;

use bumpalo::Bump;
use columns::ColumnInfo;
use features::Features;
use hits::Hits;
use paths::Paths;
use samples::Samples;
use shadows::Shadows;
use vertices::Vertices;

/// All tables of one wave, owned by one worker at a time and allocated once a render.
pub struct Wave {
    /// Most rows.
    pub rows: usize,
    /// One row a camera path.
    pub samples: Samples,
    /// One row a live path.
    pub paths: Paths,
    /// Paths as shade leaves them: dead ones among them.
    pub next: Paths,
    /// One row a path.
    pub hits: Hits,
    /// Up to `shadow_samples` rows a path.
    pub shadows: Shadows,
    /// One row a shadow ray.
    pub shadow_hits: Hits,
    /// One row a camera path.
    pub vertices: Vertices,
    /// Scratch of a stage: queues of row numbers, flags. Emptied before each stage.
    pub scratch: Bump,
}

/// A table that a plan allocates.
#[derive(Clone, Copy, Debug)]
pub struct Table {
    /// Name, as columns are listed: `path`.
    pub name: &'static str,
    /// Its columns. Their own names carry the name of the struct, which two tables may share.
    pub columns: &'static [ColumnInfo],
    /// Features under which its columns are allocated.
    pub features: Features,
    /// What the table as a whole is there for.
    pub requires: Features,
    /// Rows for each path of the wave.
    pub rows_per_path: usize,
}

impl Table {
    /// The columns that exist.
    pub fn allocated(self) -> impl Iterator<Item = (String, &'static ColumnInfo)> {
        self.columns
            .iter()
            .filter(move |c| self.rows_per_path > 0 && self.features.has(c.requires))
            .map(move |c| (format!("{}.{}", self.name, c.name.rsplit('.').next().unwrap_or(c.name)), c))
    }

    /// Bytes of the table for each path of the wave.
    pub fn bytes_per_path(self) -> usize {
        self.allocated().count() * ColumnInfo::BYTES * self.rows_per_path
    }
}

/// The tables of a wave whose paths cast up to `shadow_samples` shadow rays a vertex.
pub fn tables(shadow_samples: u32, features: Features) -> [Table; 7] {
    let shadow_rows = shadow_samples as usize * usize::from(features.has(Features::SHADOW));
    let continues = usize::from(features.has(Features::CONTINUE));
    let probes = usize::from(features.has(Features::HEMISPHERE));
    let table = |name, columns, requires, rows_per_path| Table { name, columns, features, requires, rows_per_path };
    // A path's lot is drawn by shade and used up by roulette: only `next` carries it.
    let path = table("path", Paths::COLUMNS, Features::ALWAYS, 1);
    [
        table("sample", Samples::COLUMNS, Features::ALWAYS, 1),
        Table { features: features.without(Features::ROULETTE), ..path },
        table("hit", Hits::COLUMNS, Features::ALWAYS, 1),
        table("shadow", Shadows::COLUMNS, Features::SHADOW, shadow_rows),
        table("shadow_hit", Hits::COLUMNS, Features::HEMISPHERE, shadow_rows * probes),
        table("next", Paths::COLUMNS, Features::CONTINUE, continues),
        table("vertex", Vertices::COLUMNS, Features::REUSE, usize::from(features.has(Features::REUSE))),
    ]
}

impl Wave {
    /// Allocates `rows` rows of [`tables`].
    pub fn allocate(rows: usize, shadow_samples: u32, features: Features) -> Wave {
        let [sample, path, hit, shadow, shadow_hit, next, vertex] = tables(shadow_samples, features);
        Wave {
            rows,
            samples: Samples::allocate(rows * sample.rows_per_path, sample.features),
            paths: Paths::allocate(rows * path.rows_per_path, path.features),
            next: Paths::allocate(rows * next.rows_per_path, next.features),
            hits: Hits::allocate(rows * hit.rows_per_path, hit.features),
            shadows: Shadows::allocate(rows * shadow.rows_per_path, shadow.features),
            shadow_hits: Hits::allocate(rows * shadow_hit.rows_per_path, shadow_hit.features),
            vertices: Vertices::allocate(rows * vertex.rows_per_path, vertex.features),
            scratch: Bump::new(),
        }
    }
}
