//! Plans: every column has a reader, a writer and a reason; what a render does not need is not there; predicted bytes are
//! those that are allocated.

mod common;

use comber::film::develop::develop;
use comber::film::tile;
use comber::options::{Adaptive, Confidence, Direct, Integrator, Normals, RenderOptions, Roulette, Simd};
use comber::plan::Plan;
use comber::scene::description::SceneDescription;
use comber::transport::Transport;
use comber::wave::Wave;
use common::{Ready, make, own};
use glam::Vec3;
use std::mem::size_of_val;

const INTEGRATORS: [Integrator; 7] = [
    Integrator::Path,
    Integrator::Direct,
    Integrator::ZeroBounce,
    Integrator::OneBounce,
    Integrator::IndirectOnly,
    Integrator::Normals,
    Integrator::BvhCost,
];
const DIRECTS: [Direct; 4] = [Direct::Mis, Direct::Light, Direct::Hemisphere, Direct::Bsdf];
const ROULETTES: [Roulette; 4] =
    [Roulette::Off, Roulette::Fixed(0.7), Roulette::Throughput { start: 3 }, Roulette::EFFICIENCY];
const RULE: Adaptive =
    Adaptive { batch: 8, tolerance: 0.1, confidence: Confidence::T, min_samples: 16, ..Adaptive::COURSE };

/// Triangles alone, flat and smooth; spheres alone; both; nothing that emits.
fn scenes() -> Vec<Ready> {
    let file = |name, normals| Ready::course(&own(name), normals);
    let camera = make::camera(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 0.5, 0.4);
    let mut spheres = SceneDescription { name: "spheres alone".into(), ..Default::default() };
    let lit = make::grey(&mut spheres, 0.5, 1.0);
    make::sphere(&mut spheres, Vec3::ZERO, 1.0, lit);
    let mut dark = SceneDescription { name: "dark".into(), ..Default::default() };
    let grey = make::grey(&mut dark, 0.5, 0.0);
    make::inward_box(&mut dark, Vec3::ZERO, 9.0, grey);
    vec![
        file("cornell_empty.dae", Normals::Flat),
        file("cornell_mesh.dae", Normals::Smooth),
        file("cornell_spheres.dae", Normals::Flat),
        Ready::new(spheres, camera, Normals::Flat),
        Ready::new(dark, camera, Normals::Flat),
    ]
}

/// A grid of options.
fn grid() -> Vec<RenderOptions> {
    let mut grid = Vec::new();
    for integrator in INTEGRATORS {
        for direct in DIRECTS {
            for roulette in ROULETTES {
                for max_depth in [0, 1, 2, 3, 4, 9] {
                    for (aovs, adaptive, light_samples) in [(false, None, 1), (true, Some(RULE), 3)] {
                        let wave = Some(100);
                        grid.push(RenderOptions {
                            width: 40,
                            height: 30,
                            integrator,
                            direct,
                            roulette,
                            max_depth,
                            aovs,
                            adaptive,
                            light_samples,
                            wave,
                            threads: Some(2),
                            ..RenderOptions::default()
                        });
                    }
                }
            }
        }
    }
    grid
}

fn plan(ready: &Ready, options: &RenderOptions) -> Plan {
    Plan::new(&ready.scene, &ready.accel, options).unwrap_or_else(|e| panic!("{} {options:?}: {e}", ready.name))
}

fn each(mut check: impl FnMut(&Ready, &RenderOptions, &Plan)) {
    let grid = grid();
    for ready in scenes() {
        grid.iter().for_each(|options| check(&ready, options, &plan(&ready, options)));
    }
}

fn has(plan: &Plan, column: &str) -> bool {
    plan.columns.iter().any(|c| c.name == column)
}

fn has_table(plan: &Plan, table: &str) -> bool {
    plan.columns.iter().any(|c| c.name.split('.').next() == Some(table))
}

#[test]
fn every_column_is_read_and_written_and_has_a_reason() {
    let mut plans = 0;
    each(|ready, options, plan| {
        plans += 1;
        for column in &plan.columns {
            let what = format!("{} {options:?}: {}", ready.name, column.name);
            assert!(plan.stages.iter().any(|s| s.reads.contains(&column.name)), "{what} is never read");
            assert!(plan.stages.iter().any(|s| s.writes.contains(&column.name)), "{what} is never written");
            assert!(!column.why.is_empty() && !column.what.is_empty(), "{what}");
        }
        for stage in &plan.stages {
            for name in stage.reads.iter().chain(&stage.writes) {
                assert!(has(plan, name), "{} {options:?}: {} uses {name}", ready.name, stage.name);
            }
            assert_eq!((stage.bytes_read, stage.bytes_written), (4 * stage.reads.len(), 4 * stage.writes.len()));
            assert!(!stage.why.is_empty() && !stage.kernel.is_empty());
        }
        let sum: usize = plan.columns.iter().map(|c| c.bytes).sum();
        assert_eq!(plan.bytes_per_path, sum, "{} {options:?}", ready.name);
    });
    println!("{plans} plans");
}

/// What a column's presence must be worth, worked out from the options and not from the plan's own features.
#[test]
fn what_is_not_needed_is_not_there() {
    each(|ready, options, plan| {
        let what = format!("{} {options:?}", ready.name);
        let bounces = options.integrator.bounces(options.max_depth);
        let last = bounces.map_or(0, |(_, last)| last);
        let lights = !ready.scene.lights.is_empty();
        // Shadow rays from vertex d serve bounce d + 1; the continuing ray serves bounce d + 1 itself where it looks for
        // light, and those after it where it does not.
        let shadows = lights && options.direct != Direct::Bsdf && last >= 1;
        let looks = matches!(options.direct, Direct::Mis | Direct::Bsdf);
        let continues = last >= if looks { 1 } else { 2 };
        // The rule has a say at vertices from which paths go on.
        let steps = if looks { last } else { last.saturating_sub(1) };
        let roulette = continues
            && match options.roulette {
                Roulette::Off => false,
                Roulette::Fixed(_) => steps > 1,
                Roulette::Throughput { start } => steps > start,
                Roulette::Efficiency { .. } => true,
            };
        let cost = options.integrator == Integrator::BvhCost;
        assert_eq!(has_table(plan, "shadow"), shadows, "{what}: shadow.*");
        assert_eq!(has_table(plan, "shadow_hit"), shadows && options.direct == Direct::Hemisphere, "{what}");
        assert_eq!(has_table(plan, "next"), continues, "{what}: next.*");
        assert_eq!(has_table(plan, "hit"), !cost, "{what}: hit.*");
        let mis = shadows && continues && options.direct == Direct::Mis;
        assert_eq!((has(plan, "path.pdf"), has(plan, "next.pdf")), (mis, mis), "{what}: pdf");
        assert_eq!(has(plan, "next.roulette"), roulette, "{what}: roulette");
        let asks = continues || shadows && options.direct != Direct::Hemisphere;
        let by_worth = asks && matches!(options.roulette, Roulette::Efficiency { .. });
        assert_eq!(has(plan, "sample.rate"), by_worth, "{what}: what rays must be worth");
        assert!(!has(plan, "path.roulette"), "{what}: used up before");
        assert_eq!(has(plan, "path.beta_r"), shadows || continues, "{what}: β");
        let first_hits = options.aovs && !cost;
        assert_eq!((has(plan, "sample.depth"), has(plan, "sample.albedo_g")), (first_hits, first_hits), "{what}");
        let stage = |name| plan.stages.iter().any(|s| s.name == name);
        assert_eq!((stage("shadow"), stage("roulette"), stage("shade")), (shadows, continues, !cost), "{what}");
    });
}

#[test]
fn shapes_that_a_scene_lacks_are_not_mentioned() {
    each(|ready, options, plan| {
        let text: String = plan.stages.iter().map(|s| format!("{} {};", s.kernel, s.why)).collect();
        let shapes = &ready.scene.shapes;
        assert_eq!(text.contains("sphere"), !shapes.spheres.is_empty(), "{} {options:?}: {text}", ready.name);
        assert_eq!(text.contains("triangle"), !shapes.triangles.is_empty(), "{} {options:?}: {text}", ready.name);
    });
}

#[test]
fn a_diffuse_scene_plans_the_same_columns_with_spheres_as_without() {
    // Spheres and triangles share their columns; only kernels differ.
    let [without, with] =
        ["cornell_empty.dae", "cornell_spheres.dae"].map(|name| Ready::course(&own(name), Normals::Flat));
    for options in grid() {
        let [a, b] = [&without, &with].map(|ready| plan(ready, &options));
        let names = |plan: &Plan| plan.columns.iter().map(|c| c.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&a), names(&b));
        assert_eq!(a.bytes_per_path, b.bytes_per_path);
        let kernel = |plan: &Plan| plan.stages.iter().find(|s| s.name == "traverse").map(|s| s.kernel.clone());
        assert!(kernel(&a) != kernel(&b));
    }
}

/// The columns of a wave that have rows, by name, and their bytes.
fn allocated(wave: &Wave) -> Vec<(String, usize)> {
    macro_rules! columns {
        ($($name:literal, $table:expr => $($field:ident)*;)*) => {
            vec![$($((format!("{}.{}", $name, stringify!($field)), size_of_val(&$table.$field[..])),)*)*]
        };
    }
    let mut all = columns! {
        "sample", wave.samples => pixel index rate r g b albedo_r albedo_g albedo_b normal_x normal_y normal_z depth;
        "path", wave.paths => ox oy oz dx dy dz slot beta_r beta_g beta_b pdf nx ny nz roulette;
        "next", wave.next => ox oy oz dx dy dz slot beta_r beta_g beta_b pdf nx ny nz roulette;
        "hit", wave.hits => t u v prim geom;
        "shadow", wave.shadows => ox oy oz dx dy dz t_max slot direct_r direct_g direct_b;
        "shadow_hit", wave.shadow_hits => t u v prim geom;
    };
    all.retain(|(_, bytes)| *bytes > 0);
    all.sort();
    all
}

#[test]
fn what_is_planned_is_allocated() {
    each(|ready, options, plan| {
        let what = format!("{} {options:?}", ready.name);
        let shadow_samples = Transport::new(options, &ready.scene.lights).shadow_samples;
        let rows = 112;
        let mut planned: Vec<_> = plan.columns.iter().map(|c| (c.name.clone(), c.bytes * rows)).collect();
        planned.sort();
        assert_eq!(allocated(&Wave::allocate(rows, shadow_samples, plan.features)), planned, "{what}");
        assert_eq!(plan.memory.waves, 2 * 100 * plan.bytes_per_path as u64, "{what}");
        assert_eq!(plan.memory.scene, ready.scene.bytes() as u64);
        assert_eq!(plan.memory.accel, ready.accel.stats().bytes as u64);
    });
}

#[test]
fn film_and_picture_take_the_bytes_that_are_predicted() {
    let ready = Ready::course(&own("cornell_empty.dae"), Normals::Flat);
    for aovs in [false, true] {
        for adaptive in [None, Some(RULE)] {
            let options = RenderOptions { width: 70, height: 45, aovs, adaptive, ..RenderOptions::default() };
            let plan = plan(&ready, &options);
            let tiles = tile::tiles(plan.cell, plan.film);
            let picture = develop(&tiles, plan.cell, (70, 45));
            let colors =
                [Some(&picture.beauty), picture.albedo.as_ref(), picture.normal.as_ref(), picture.variance.as_ref()];
            let developed = colors.into_iter().flatten().map(|l| size_of_val(&l[..])).sum::<usize>()
                + picture.depth.as_ref().map_or(0, |l| size_of_val(&l[..]))
                + picture.sample_count.as_ref().map_or(0, |l| size_of_val(&l[..]));
            let bytes: usize = tiles
                .iter()
                .map(|t| {
                    size_of_val(&t.x[..])
                        + size_of_val(&t.y[..])
                        + size_of_val(&t.active[..])
                        + size_of_val(&t.open[..])
                        + size_of_val(&t.passed[..])
                        + t.sequences.bytes()
                        + size_of_val(&t.count[..])
                        + size_of_val(&t.mean[..])
                        + size_of_val(&t.m2[..])
                        + size_of_val(&t.luminance[..])
                        + size_of_val(&t.first_hits[..])
                })
                .sum();
            assert_eq!(plan.memory.film, (bytes + developed) as u64, "aovs {aovs}, adaptive {}", adaptive.is_some());
        }
    }
}

#[test]
fn the_wave_is_as_asked_or_fits_its_budget() {
    let ready = Ready::course(&own("cornell_spheres.dae"), Normals::Smooth);
    for light_samples in [1, 2, 8, 64, 4096] {
        let options = RenderOptions { light_samples, ..RenderOptions::default() };
        let chosen = plan(&ready, &options);
        assert!((256..=8192).contains(&chosen.wave) && chosen.wave.is_power_of_two());
        assert!(chosen.wave == 256 || chosen.wave * chosen.bytes_per_path <= 2 << 20, "{}", chosen.wave);
        assert_eq!(plan(&ready, &RenderOptions { wave: Some(77), ..options }).wave, 77);
    }
}

#[test]
fn what_cannot_be_planned_says_why() {
    let ready = Ready::course(&own("cornell_empty.dae"), Normals::Flat);
    let base = RenderOptions { width: 64, height: 48, ..RenderOptions::default() };
    let cell = |x, y, width, height| Some(comber::options::Cell { x, y, width, height });
    for (options, words) in [
        (RenderOptions { cell: cell(0, 0, 0, 5), ..base.clone() }, "0×5"),
        (RenderOptions { cell: cell(60, 0, 5, 5), ..base.clone() }, "64×48"),
        (RenderOptions { cell: cell(u32::MAX, u32::MAX, 2, 2), ..base.clone() }, "64×48"),
        (RenderOptions { wave: Some(1 << 24), light_samples: 4096, ..base.clone() }, "more shadow rays"),
        (RenderOptions { reuse: 0, ..base.clone() }, "1 to 64"),
        (RenderOptions { reuse: 65, ..base.clone() }, "1 to 64"),
        (RenderOptions { lamp_rays: 0, ..base.clone() }, "1 or more"),
    ] {
        let error = Plan::new(&ready.scene, &ready.accel, &options).expect_err("refused").to_string();
        assert!(error.contains(words), "{error}");
    }
    for simd in [Simd::Auto, Simd::Baseline] {
        assert!(Plan::new(&ready.scene, &ready.accel, &RenderOptions { simd, ..base.clone() }).is_ok());
    }
}
