//! Options as resolved: what a render does, with every default filled in. The command line fills these.

use serde::Serialize;

/// Which transport a render estimates: a range of bounces, or something simpler than light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// All light up to the depth limit.
    #[default]
    Path,
    /// Emission and direct light: bounces 0 and 1.
    Direct,
    /// Emission seen directly: bounce 0.
    ZeroBounce,
    /// Direct light alone: bounce 1.
    OneBounce,
    /// Indirect light alone: bounces 2 and up.
    IndirectOnly,
    /// Shading normals as colours, `(n + 1) / 2`.
    Normals,
    /// BVH nodes visited by the camera ray, as a heat map.
    BvhCost,
}

impl Integrator {
    /// The bounces that count, given the depth limit `max_depth`; `None` where no light is simulated.
    ///
    /// Bounce 0 is emission seen by the camera, bounce 1 direct light, and so on: the course's `-m`.
    pub fn bounces(self, max_depth: u32) -> Option<(u32, u32)> {
        match self {
            Integrator::Path => Some((0, max_depth)),
            Integrator::Direct => Some((0, max_depth.min(1))),
            Integrator::ZeroBounce => Some((0, 0)),
            Integrator::OneBounce => Some((1, max_depth.min(1))),
            Integrator::IndirectOnly => Some((2, max_depth)),
            Integrator::Normals | Integrator::BvhCost => None,
        }
    }
}

/// How direct light is estimated at each vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Direct {
    /// Uniform directions over the hemisphere, as in the course.
    Hemisphere,
    /// Points on the lights.
    Light,
    /// The ray that continues the path, nothing else.
    Bsdf,
    /// Lights and continuing ray, weighted by the power heuristic (Veach 1997, §9.2).
    #[default]
    Mis,
}

/// Where random numbers come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sampler {
    /// A hash: numbers that know nothing of each other.
    Independent,
    /// Owen-scrambled Sobol points, for each pixel its own.
    #[default]
    Sobol,
    /// Owen-scrambled Sobol points that the pixels share, so that errors of neighbours cancel.
    BlueNoise,
}

/// How a point on a light is drawn. Spheres are drawn by the cone that they fill, whatever this says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LightSampling {
    /// Parallelograms more often where more light would come from, by their corners; triangles uniform by area.
    #[default]
    Corners,
    /// Uniform by area.
    Area,
    /// Rectangles and triangles uniform by solid angle, unless that is tiny.
    SolidAngle,
}

/// Which lights are asked at each vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LightSelection {
    /// Each if they are few, else by the tree.
    #[default]
    Auto,
    /// Each light.
    Each,
    /// Lights drawn in proportion to their power.
    Power,
    /// Parts of lights drawn by a tree, in proportion to a bound of what arrives.
    Tree,
}

/// When a path ends early.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Roulette {
    /// Never: paths run to the depth limit.
    Off,
    /// Continue with this probability, as in the course.
    Fixed(f32),
    /// Continue with probability `min(max(β), 0.95)` once `start` bounces are done.
    Throughput {
        /// Bounces before the first chance to end.
        start: u32,
    },
    /// Rays, of paths and towards lights, with the probability at which they are worth their work: see [`crate::worth`].
    Efficiency {
        /// What a ray must be worth, times what theory says.
        factor: f32,
    },
}

impl Roulette {
    /// By throughput, once three bounces are done.
    pub const THROUGHPUT: Roulette = Roulette::Throughput { start: 3 };
    /// By efficiency, with the factor that measured best: see [`crate::worth`].
    pub const EFFICIENCY: Roulette = Roulette::Efficiency { factor: 1.0 };
}

impl Default for Roulette {
    fn default() -> Self {
        Roulette::EFFICIENCY
    }
}

/// Which quantile a confidence interval uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Confidence {
    /// Normal: 1.96, as in the course.
    Z,
    /// Student's t with n − 1 degrees of freedom.
    #[default]
    T,
}

/// What it takes to believe a test that says a pixel has samples enough.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Trust {
    /// One test, as in the course.
    #[default]
    Once,
    /// Two tests in succession.
    Twice,
    /// Half of the samples decides for the other half, which knows nothing of the decision.
    Halves,
}

/// When tests are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tests {
    /// After every batch, as in the course.
    #[default]
    Batches,
    /// After one batch, two, four, eight.
    Doubling,
}

/// What stops together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Area {
    /// Every pixel by itself, as in the course.
    Pixel,
    /// The pixels of a tile, when the root mean square of their intervals, each beside its mean, is narrow enough: the rule that keeps its promise,
    /// see `benches/adaptive.rs`.
    #[default]
    Tile,
}

/// Adaptive sampling: a pixel retires when its 95 % interval is narrow enough.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Adaptive {
    /// Samples between tests.
    pub batch: u32,
    /// When tests are made.
    pub tests: Tests,
    /// What a test must be.
    pub trust: Trust,
    /// What stops together.
    pub area: Area,
    /// Largest half-width of the interval, as a fraction of the mean luminance (see [`Adaptive::floor`]).
    pub tolerance: f32,
    /// Linear luminance of which parts that are darker count as about as much: a mean m as √(m² + floor²).
    pub floor: f32,
    /// Quantile.
    pub confidence: Confidence,
    /// No pixel retires with fewer samples.
    pub min_samples: u32,
}

impl Adaptive {
    /// The course's rule: after every 32 samples, at a tolerance of 5 %, by the normal quantile.
    pub const COURSE: Adaptive = Adaptive {
        batch: 32,
        tests: Tests::Batches,
        trust: Trust::Once,
        area: Area::Pixel,
        tolerance: 0.05,
        floor: Adaptive::DARK,
        confidence: Confidence::Z,
        min_samples: 2,
    };

    /// Half the first step of 8-bit sRGB as linear luminance: the floor of the course's rule here.
    ///
    /// A darker pixel is shown as 0. Its interval may be `tolerance · DARK` wide, so at a tolerance of 0.05 it stays
    /// within half a step of the display even when the picture is later exposed up by four stops.
    pub const DARK: f32 = 0.5 / 255.0 / 12.92;

    /// The floor where nothing is said: that of the relative error by which pictures are judged, about 35 % of the way from black to white as shown.
    pub const FLOOR: f32 = 0.1;

    /// How many samples lie between the tests behind `done` samples.
    pub fn step(&self, done: u32) -> u32 {
        match self.tests {
            Tests::Batches => self.batch,
            Tests::Doubling => done.max(self.batch),
        }
    }
}

/// Which structure answers ray queries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Accel {
    /// Four-wide BVH.
    #[default]
    Bvh,
    /// Test every primitive: the oracle, and a show of what the BVH gains.
    Brute,
}

/// How rays are tested against triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Intersection {
    /// No ray slips between triangles that share an edge or a corner (Woop et al. 2013).
    #[default]
    Watertight,
    /// Fewer operations (Möller and Trumbore 1997).
    Fast,
}

/// How exactly positions are known: those of the scene, and of where rays start. Directions are single precision in both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Precision {
    /// Single: 24 bits, of which a scene read around its own centre needs few.
    #[default]
    F32,
    /// Double: for a scene both huge and fine, as a detailed thing of size 1 that stands 10⁷ from the scene's centre.
    F64,
}

/// How the inner nodes of the tree are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NodeFormat {
    /// Compact where that makes boxes hardly larger, full elsewhere.
    #[default]
    Auto,
    /// 128 bytes: planes in single precision.
    Full,
    /// 64 bytes: planes as 16-bit numbers on a grid around the scene.
    Compact,
}

/// How the leaves of the tree are stored. Hits, and so the picture, are the same to the bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LeafFormat {
    /// Full, unless there is no memory for them.
    #[default]
    Auto,
    /// 192 bytes a block: all corners of four triangles.
    Full,
    /// 128 bytes a block: up to eight vertices, and which of them the corners of up to four triangles are.
    Compact,
    /// As compact, because there is no memory for full ones: what `--memory-limit` makes of `Auto`. Building fails if it turns out that
    /// triangles share too few corners for that.
    Limited,
}

impl LeafFormat {
    /// Whether compact leaves are required.
    pub fn is_compact(self) -> bool {
        matches!(self, LeafFormat::Compact | LeafFormat::Limited)
    }
}

/// How much time the tree is worth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quality {
    /// For previews: clustered along a space-filling curve.
    Fast,
    /// Binned surface area heuristic, collapsed optimally.
    #[default]
    Default,
    /// For long renders: as by default, and then every subtree is moved to its best place.
    Best,
}

/// The acceleration structure: which, and how it is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct AccelOptions {
    /// Which structure.
    pub kind: Accel,
    /// The triangle test.
    pub intersection: Intersection,
    /// The format of the nodes.
    pub nodes: NodeFormat,
    /// The format of the leaves.
    pub leaves: LeafFormat,
    /// How good the tree has to be. The picture stays the same.
    pub quality: Quality,
    /// How exactly it knows what it holds, and where rays start.
    pub precision: Precision,
}

impl Quality {
    /// As typed.
    pub fn name(self) -> &'static str {
        match self {
            Quality::Fast => "fast",
            Quality::Default => "default",
            Quality::Best => "best",
        }
    }
}

impl AccelOptions {
    /// Whether the four-wide tree is asked for: of all structures it alone has a file format, parts and compact leaves, and tells how far its
    /// building has come.
    pub fn is_four_wide(&self) -> bool {
        (self.kind, self.precision) == (Accel::Bvh, Precision::F32)
    }

    /// A structure of this kind, all else as by default.
    pub fn of(kind: Accel) -> AccelOptions {
        AccelOptions { kind, ..AccelOptions::default() }
    }
}

/// Normals used for shading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Normals {
    /// Interpolated vertex normals, where the file has them.
    #[default]
    Smooth,
    /// The triangle's own normal.
    Flat,
}

/// Instruction sets that kernels are compiled for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Simd {
    /// The best that this processor has.
    #[default]
    Auto,
    /// What every processor of the architecture has (SSE2, NEON).
    Baseline,
    /// AVX2 and FMA.
    Avx2,
    /// AVX-512 in the kernels that trace rays, AVX2 in the others.
    Avx512,
}

/// A rectangle of pixels, from the top left of the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Cell {
    /// Left edge.
    pub x: u32,
    /// Top edge.
    pub y: u32,
    /// Width.
    pub width: u32,
    /// Height.
    pub height: u32,
}

/// Everything about a render but the scene.
#[derive(Clone, Debug, Serialize)]
pub struct RenderOptions {
    /// Frame width in pixels.
    pub width: u32,
    /// Frame height in pixels.
    pub height: u32,
    /// Part of the frame to render; all of it if `None`.
    pub cell: Option<Cell>,
    /// Samples a pixel (the most, when adaptive).
    pub samples: u32,
    /// Rays towards each light at each vertex.
    pub light_samples: u32,
    /// Depth limit: 0 emission only, 1 direct light too, ….
    pub max_depth: u32,
    /// What to estimate.
    pub integrator: Integrator,
    /// How direct light is estimated.
    pub direct: Direct,
    /// How points on lights are drawn.
    pub light_sampling: LightSampling,
    /// Which lights are asked.
    pub light_selection: LightSelection,
    /// When paths end early.
    pub roulette: Roulette,
    /// The most radiance (brightest channel) that a light may add to a sample at once after two bounces or more; all of it if `None`.
    pub clamp_indirect: Option<f32>,
    /// Adaptive sampling, or every pixel gets all its samples.
    pub adaptive: Option<Adaptive>,
    /// Where random numbers come from.
    pub sampler: Sampler,
    /// Independent sequences that the samples of a pixel are dealt to in turn: a power of two.
    pub replicates: u32,
    /// Pixels that share what their paths find behind the first surface: a power of two of at most 64; 1: none do.
    pub reuse: u32,
    /// Camera rays of each sample that look for lights, where one may be seen; 1: that of the path.
    pub lamp_rays: u32,
    /// Seed of all random numbers.
    pub seed: u32,
    /// What answers ray queries.
    pub accel: AccelOptions,
    /// Accumulate albedo, normal and depth of the first hit too.
    pub aovs: bool,
    /// Rows a wave; `None`: the plan chooses. Changes speed only.
    pub wave: Option<u32>,
    /// Worker threads; `None`: all processors. Changes speed only.
    pub threads: Option<u32>,
    /// Instruction set. Changes speed only.
    pub simd: Simd,
}

impl RenderOptions {
    /// What of the options does not go with double precision, as typed, if any of it was asked for.
    pub fn not_in_double(&self) -> Option<&'static str> {
        let AccelOptions { intersection, nodes, leaves, quality, precision, .. } = self.accel;
        match precision {
            Precision::F32 => None,
            Precision::F64 if intersection == Intersection::Fast => Some("intersection fast"),
            Precision::F64 if nodes != NodeFormat::Auto => Some("a choice of nodes"),
            Precision::F64 if leaves != LeafFormat::Auto => Some("a choice of leaves"),
            Precision::F64 if quality != Quality::Default => Some("a choice of bvh"),
            // Its bounds of what arrives would be of another place than the one at hand, and could be 0 where light does arrive.
            Precision::F64 if self.light_selection == LightSelection::Tree => Some("light-selection tree"),
            Precision::F64 if self.lamp_rays > 1 => Some("lamp-rays"),
            Precision::F64 if self.reuse > 1 => Some("reuse"),
            Precision::F64 => None,
        }
    }

    /// Whether samples are more than one path each, as they are in the depth-first reference.
    pub fn shares(&self) -> bool {
        self.reuse > 1 || self.lamp_rays > 1
    }

    /// The same, each sample a path.
    pub fn alone(&self) -> RenderOptions {
        RenderOptions { reuse: 1, lamp_rays: 1, ..self.clone() }
    }

    /// What of the options does not go with path reuse, as typed, if that was asked for.
    pub fn not_in_reuse(&self) -> Option<&'static str> {
        match self.reuse {
            1 => None,
            // What the noise of a tile's pixels has in common, its interval would take for exactness.
            _ if self.adaptive.is_some() => Some("adaptive"),
            // The bound is on what a light adds to one sample; here it adds to many.
            _ if self.clamp_indirect.is_some() => Some("clamp-indirect"),
            _ => None,
        }
    }

    /// What is rendered of the frame: the cell that was asked for, or all of it.
    pub fn rendered(&self) -> Cell {
        self.cell.unwrap_or(Cell { x: 0, y: 0, width: self.width, height: self.height })
    }
}

impl Default for RenderOptions {
    fn default() -> Self {
        RenderOptions {
            width: 480,
            height: 360,
            cell: None,
            samples: 64,
            light_samples: 1,
            max_depth: 5,
            integrator: Integrator::Path,
            direct: Direct::Mis,
            light_sampling: LightSampling::default(),
            light_selection: LightSelection::default(),
            roulette: Roulette::default(),
            clamp_indirect: None,
            adaptive: None,
            sampler: Sampler::default(),
            replicates: 1,
            reuse: 1,
            lamp_rays: 1,
            seed: 0,
            accel: AccelOptions::default(),
            aovs: false,
            wave: None,
            threads: None,
            simd: Simd::Auto,
        }
    }
}
