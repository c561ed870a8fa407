//! Pictures against independent renders with known standard errors: every pixel by a z-test, and the mean.

mod common;

use comber::compare::bias::Bias;
use comber::compare::pair::Pair;
use comber::compare::z_test::ZTest;
use comber::film::exr_output;
use comber::film::picture::Picture;
use comber::film::read::Found;
use comber::options::{Cell, Direct, Normals, RenderOptions, Roulette};
use common::statistics::ALPHA;
use common::{Ready, shared};

fn compare(ready: &Ready, reference: &str, options: &RenderOptions, what: &str) {
    let Some(path) = shared(&format!("reference/{reference}.exr")) else { return };
    let expected = exr_output::read(&path).expect("reference");
    let errors = exr_output::read(&path.with_extension("stderr.exr")).expect("standard errors");
    let options = RenderOptions { width: 240, height: 180, aovs: true, ..options.clone() };
    let ours = ready.render(&options);
    let cell = options.cell.unwrap_or(Cell { x: 0, y: 0, width: 240, height: 180 });
    let ours = of_cell(&ours.picture.beauty, ours.picture.variance, cell);
    let squares = cut(&errors, cell).into_iter().map(|error| error.map(|e| e * e)).collect();
    let expected = of_cell(&cut(&expected, cell), Some(squares), cell);
    let (pair, _) = Pair::new(&ours, &expected, None).expect("pictures of the same cell");
    let (test, bias) = (ZTest::of(&pair, ALPHA).expect("variances"), Bias::of(&pair).expect("variances"));
    let means = bias.z.map(|z| format!("{z:+.2}")).join(" ");
    let (passing, z2) = (test.passing * 100.0, test.mean_square.value);
    println!("{reference} {what}: {passing:.3} % of pixels pass, mean z² {z2:.3}, mean off by {means} standard errors");
    assert!(test.passing >= 0.9975, "{reference} {what}: only {passing:.3} % pass");
    assert!(bias.z.iter().all(|z| z.abs() <= 3.0), "{reference} {what}: mean off by {means} standard errors");
}

/// A picture of `cell` alone.
fn of_cell(colours: &[[f32; 3]], variance: Option<Vec<[f32; 3]>>, cell: Cell) -> Found {
    let (width, height) = (cell.width as usize, cell.height as usize);
    Found { width, height, full: (width, height), colours: colours.to_vec(), variance, ..Found::default() }
}

/// The pixels of `cell`.
fn cut(picture: &Picture, cell: Cell) -> Vec<[f32; 3]> {
    let row = |y: u32| {
        let start = y as usize * picture.width + cell.x as usize;
        picture.beauty[start..start + cell.width as usize].to_vec()
    };
    (cell.y..cell.y + cell.height).flat_map(row).collect()
}

fn course(name: &str) -> Option<Ready> {
    Some(Ready::course(&shared(&format!("scenes/cs184/{name}.dae"))?, Normals::Flat))
}

#[test]
fn spheres_match_for_every_direct_strategy() {
    let Some(ready) = course("CBspheres_lambertian") else { return };
    for direct in [Direct::Mis, Direct::Light] {
        let options = RenderOptions { direct, samples: 64, max_depth: 5, seed: 11, ..RenderOptions::default() };
        compare(&ready, "CBspheres_lambertian_d6", &options, &format!("{direct:?}"));
    }
    // Directions that know nothing of the light find it rarely: a standard error estimated from a few hundred samples is
    // then no use. Many samples of a part of the picture (floor, wall, a sphere and its shadow) are.
    let cell = Some(Cell { x: 40, y: 120, width: 60, height: 40 });
    for direct in [Direct::Hemisphere, Direct::Bsdf] {
        let options = RenderOptions { direct, cell, samples: 4096, max_depth: 5, seed: 11, ..RenderOptions::default() };
        compare(&ready, "CBspheres_lambertian_d6", &options, &format!("{direct:?}"));
    }
}

#[test]
fn deep_paths_match_for_every_roulette_rule() {
    let Some(ready) = course("CBspheres_lambertian") else { return };
    for roulette in [Roulette::EFFICIENCY, Roulette::THROUGHPUT, Roulette::Fixed(0.7), Roulette::Off] {
        let options = RenderOptions { roulette, samples: 64, max_depth: 100, seed: 5, ..RenderOptions::default() };
        compare(&ready, "CBspheres_lambertian_d101", &options, &format!("{roulette:?}"));
    }
}

#[test]
fn the_bunny_matches() {
    let Some(ready) = course("CBbunny") else { return };
    let options = RenderOptions { samples: 64, max_depth: 5, seed: 3, ..RenderOptions::default() };
    compare(&ready, "CBbunny_d6", &options, "Mis");
}

#[test]
fn the_dragon_on_the_cornell_stage_matches() {
    use comber::scene::stage::{Stage, UpAxis, place};
    let mesh = common::own("models/dragon_vrip.ply");
    if !mesh.exists() {
        println!("skipped: {} is not here; scenes/fetch.sh gets it", mesh.display());
        return;
    }
    let staged = place(comber::import::load(&mesh).expect("dragon"), Stage::Cornell, UpAxis::Y).expect("stage");
    let ready = Ready::new(staged.description, staged.camera, Normals::Flat);
    let options = RenderOptions { samples: 64, max_depth: 5, seed: 7, ..RenderOptions::default() };
    compare(&ready, "CBdragon871k_d6", &options, "Mis");
}
