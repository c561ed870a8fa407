//! What the qualities of a tree cost and gain.
//!
//! `cargo bench --bench build [-- MESH…]` prints a table in Markdown. Each mesh is built by each quality in turn, on all
//! threads; then the trees take turns at tracing the same rays, on one thread: first bounces from what the camera sees,
//! diffuse. Hits must be the same, or the bench fails.
//!
//! Columns: median build time; cost by the surface area heuristic; memory of the tree a primitive; nodes and leaf blocks
//! visited a ray; rays a second and build time, both against the default quality (above 1: faster), medians of the ratios of
//! runs that were neighbours in time.

use std::path::Path;
use std::time::Instant;

use comber::bvh::{Accel, HitColumnsMut, Query, RayColumns};
use comber::options::{AccelOptions, Quality, Simd};
use comber::scene::camera::Camera;
use comber::scene::stage::{Stage, UpAxis, place};
use comber::scene::{Scene, SceneOptions, procedural};
use comber::simd::Tier;
use glam::Vec3;

const QUALITIES: [Quality; 3] = [Quality::Fast, Quality::Default, Quality::Best];
/// The one that others are compared to.
const DEFAULT: usize = 1;
/// Builds and batches of rays that each median is made of.
const ROUNDS: usize = 7;

/// What is built: name, file or specification, and the stage it stands on.
const MESHES: [(&str, &str, Stage); 5] = [
    ("dragon", "dragon_vrip.ply", Stage::None),
    ("dragon in the Cornell box", "dragon_vrip.ply", Stage::Cornell),
    ("lucy100k", "lucy100k.obj", Stage::None),
    ("proc:coral,tris=1M in the studio", "proc:coral,tris=1M", Stage::Studio),
    ("proc:soup,tris=200k", "proc:soup,tris=200k", Stage::None),
];

fn main() {
    let (flags, words): (Vec<_>, Vec<_>) = std::env::args().skip(1).partition(|arg| arg.starts_with("--"));
    // `cargo test` does not say `--bench`, and wants to see the bench run once, quickly.
    let measure = flags.iter().any(|flag| flag == "--bench");
    println!(
        "| mesh | `--bvh` | build ms | SAH cost | B a triangle | nodes a ray | leaves a ray | rays ÷ default | build ÷ default |"
    );
    println!("|---|---|--:|--:|--:|--:|--:|--:|--:|");
    if !measure {
        return compare("proc:blob", "proc:blob,tris=2k", Stage::None, 1);
    }
    for (name, source, stage) in MESHES {
        if words.is_empty() || words.iter().any(|word| name.contains(word.as_str())) {
            compare(name, source, stage, ROUNDS);
        }
    }
}

/// Prints the rows of one mesh; a word instead if it is not here.
fn compare(name: &str, source: &str, stage: Stage, rounds: usize) {
    let Some((scene, camera)) = load(source, stage) else {
        return eprintln!("skipped: {source} is not here (scenes/fetch.sh fetches it)");
    };
    let build = |quality| {
        Accel::build(&scene.shapes, &AccelOptions { quality, ..AccelOptions::default() }).expect("a mesh that fits")
    };
    let mut seconds = vec![[0.0; 3]; rounds];
    let mut trees = QUALITIES.map(build);
    for round in &mut seconds {
        for (i, quality) in QUALITIES.into_iter().enumerate() {
            trees[i] = build(quality);
            round[i] = trees[i].stats().build_seconds;
        }
    }
    let rays = first_bounces(&scene, &camera, &trees[DEFAULT]);
    let expected = rays.trace(&trees[DEFAULT]);
    let mut trace_seconds = vec![[0.0; 3]; rounds];
    for round in &mut trace_seconds {
        for (i, tree) in trees.iter().enumerate() {
            let start = Instant::now();
            let hits = rays.trace(tree);
            round[i] = start.elapsed().as_secs_f64();
            assert!(hits == expected, "{name}: {:?} hits something else", QUALITIES[i]);
        }
    }
    for (i, quality) in QUALITIES.into_iter().enumerate() {
        let stats = trees[i].stats();
        let [nodes, leaves] = rays.visits(&trees[i]);
        println!(
            "| {name} | {} | {:.0} | {:.2} | {:.1} | {nodes:.2} | {leaves:.2} | {:.2} | {:.2} |",
            quality.name(),
            median(seconds.iter().map(|round| 1e3 * round[i])),
            stats.sah_cost,
            stats.bytes_per_primitive,
            median(trace_seconds.iter().map(|round| round[DEFAULT] / round[i])),
            median(seconds.iter().map(|round| round[DEFAULT] / round[i])),
        );
    }
}

fn load(source: &str, stage: Stage) -> Option<(Scene, Camera)> {
    let description = match source.starts_with("proc:") {
        true => procedural::generate(source),
        false => {
            let folders = ["scenes/models", "../shared/models"].map(|f| Path::new(env!("CARGO_MANIFEST_DIR")).join(f));
            comber::import::load(&folders.iter().map(|folder| folder.join(source)).find(|file| file.exists())?)
        }
    };
    let staged = description.and_then(|mesh| place(mesh, stage, UpAxis::Y)).expect("a sound mesh");
    Some((Scene::build(staged.description, SceneOptions::default()).expect("a sound scene"), staged.camera))
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Rays in columns.
#[derive(Default)]
struct Rays([Vec<f32>; 6]);

/// Distances and primitives.
type Hits = (Vec<f32>, Vec<u32>);

impl Rays {
    fn push(&mut self, origin: Vec3, direction: Vec3) {
        for (column, value) in self.0.iter_mut().zip(origin.to_array().into_iter().chain(direction.to_array())) {
            column.push(value);
        }
    }

    /// Asks for closest hits, a wave at a time.
    fn ask(&self, mut answer: impl FnMut(RayColumns, HitColumnsMut)) -> Hits {
        /// Rays a wave.
        const WAVE: usize = 8192;
        let n = self.0[0].len();
        let [mut t, mut u, mut v] = [(); 3].map(|()| vec![0.0; n]);
        let [mut prim, mut geom] = [(); 2].map(|()| vec![0; n]);
        for start in (0..n).step_by(WAVE) {
            let rows = start..(start + WAVE).min(n);
            let [ox, oy, oz, dx, dy, dz] = self.0.each_ref().map(|column| &column[rows.clone()]);
            let [t, u, v] = [&mut t, &mut u, &mut v].map(|column| &mut column[rows.clone()]);
            let [prim, geom] = [&mut prim, &mut geom].map(|column| &mut column[rows.clone()]);
            let rays = RayColumns { ox, oy, oz, dx, dy, dz, t_min: None, t_max: None, low: None };
            answer(rays, HitColumnsMut { t, u, v, prim, geom });
        }
        (t, prim)
    }

    fn trace(&self, accel: &Accel) -> Hits {
        let (way, tier) = (accel.suited(Query::Closest, false), tier());
        self.ask(|rays, hits| {
            accel.closest_hits(way, tier, rays, hits);
        })
    }

    /// Nodes and leaf blocks a ray.
    fn visits(&self, accel: &Accel) -> [f64; 2] {
        let (way, tier) = (accel.suited(Query::Closest, false), tier());
        let mut visits = [0, 0];
        self.ask(|rays, hits| {
            let counts = accel.closest_hits_counted(way, tier, rays, hits);
            visits = [visits[0] + counts.node_visits, visits[1] + counts.leaf_visits];
        });
        visits.map(|count| count as f64 / self.0[0].len().max(1) as f64)
    }
}

fn tier() -> Tier {
    Tier::detect(Simd::Auto).expect("there is always one")
}

/// From what the camera sees, in cosine-distributed directions.
fn first_bounces(scene: &Scene, camera: &Camera, accel: &Accel) -> Rays {
    const SIDE: u32 = 512;
    let lens = camera.lens(SIDE, SIDE);
    let mut seen = Rays::default();
    for pixel in 0..SIDE * SIDE {
        let direction = lens.direction((pixel % SIDE) as f32 + 0.5, (pixel / SIDE) as f32 + 0.5);
        seen.push(lens.origin, Vec3::new(direction.x, direction.y, direction.z));
    }
    let mut state = 1u32;
    let mut random = move || {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
        ((word >> 22) ^ word) as f32 / u32::MAX as f32
    };
    let (t, prim) = seen.trace(accel);
    let mut rays = Rays::default();
    for row in (0..t.len()).filter(|&row| t[row].is_finite() && (prim[row] as usize) < scene.shapes.triangles.len()) {
        let at = |column: usize| seen.0[column][row];
        let direction = Vec3::new(at(3), at(4), at(5));
        let [a, b, c] = scene.shapes.corners(prim[row]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        let (z, phi) = (2.0 * random() - 1.0, std::f32::consts::TAU * random());
        let r = (1.0 - z * z).max(0.0).sqrt();
        let point = Vec3::new(at(0), at(1), at(2)) + direction * t[row] + normal * (1e-4 * t[row]);
        rays.push(point, (normal + 0.999 * Vec3::new(r * phi.cos(), r * phi.sin(), z)).normalize_or_zero());
    }
    rays
}
