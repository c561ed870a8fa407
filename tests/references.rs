//! Pictures against independent renders with known standard errors: every pixel by a z-test, and the mean.

mod common;

use comber::film::exr_output;
use comber::film::picture::Picture;
use comber::options::{Cell, Direct, Normals, RenderOptions, Roulette};
use common::statistics::{ALPHA, sidak};
use common::{Ready, shared};

/// A picture against a reference: two-sided z-tests at α = 0.01 over all pixels and channels, Šidák-corrected.
struct ZTest {
    /// Fraction of pixels all of whose channels pass.
    passing: f64,
    /// z² over all channels with variance, averaged: 1 if both sides state their errors rightly.
    mean_square_z: f64,
    /// Difference of the means over its standard error, by channel.
    mean_z: [f64; 3],
}

fn z_test(ours: &Picture, reference: &Picture, errors: &Picture) -> ZTest {
    let variance = ours.variance.as_ref().expect("variance layer");
    let n = ours.beauty.len() * 3;
    let limit = sidak(ALPHA, n);
    let (mut passing, mut squares, mut counted) = (0, 0.0, 0u32);
    let (mut difference, mut squared_error) = ([0.0f64; 3], [0.0f64; 3]);
    for (((ours, variance), reference), errors) in
        ours.beauty.iter().zip(variance).zip(&reference.beauty).zip(&errors.beauty)
    {
        let mut agrees = true;
        for c in 0..3 {
            let d = f64::from(ours[c]) - f64::from(reference[c]);
            let v = f64::from(variance[c]) + f64::from(errors[c]).powi(2);
            difference[c] += d;
            squared_error[c] += v;
            // Both sides black without variance agree; any other difference without variance does not.
            agrees &= if v > 0.0 { d.abs() <= limit * v.sqrt() } else { d == 0.0 };
            if v > 0.0 {
                squares += d * d / v;
                counted += 1;
            }
        }
        passing += usize::from(agrees);
    }
    let mean_z = [0, 1, 2].map(|c| difference[c] / squared_error[c].sqrt());
    let passing = passing as f64 / ours.beauty.len() as f64;
    ZTest { passing, mean_square_z: squares / f64::from(counted), mean_z }
}

fn compare(ready: &Ready, reference: &str, options: &RenderOptions, what: &str) {
    let Some(path) = shared(&format!("reference/{reference}.exr")) else { return };
    let expected = exr_output::read(&path).expect("reference");
    let errors = exr_output::read(&path.with_extension("stderr.exr")).expect("standard errors");
    let options = RenderOptions { width: 240, height: 180, aovs: true, ..options.clone() };
    let ours = ready.render(&options);
    let cell = options.cell.unwrap_or(Cell { x: 0, y: 0, width: 240, height: 180 });
    let test = z_test(&ours.picture, &cut(&expected, cell), &cut(&errors, cell));
    let means = test.mean_z.map(|z| format!("{z:+.2}")).join(" ");
    let (passing, z2) = (test.passing * 100.0, test.mean_square_z);
    println!("{reference} {what}: {passing:.3} % of pixels pass, mean z² {z2:.3}, mean off by {means} standard errors");
    assert!(test.passing >= 0.9975, "{reference} {what}: only {passing:.3} % pass");
    assert!(test.mean_z.iter().all(|z| z.abs() <= 3.0), "{reference} {what}: mean off by {means} standard errors");
}

/// The pixels of `cell`.
fn cut(picture: &Picture, cell: Cell) -> Picture {
    let row = |y: u32| {
        let start = y as usize * picture.width + cell.x as usize;
        picture.beauty[start..start + cell.width as usize].to_vec()
    };
    Picture { beauty: (cell.y..cell.y + cell.height).flat_map(row).collect(), ..Picture::default() }
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
    for roulette in [Roulette::default(), Roulette::Fixed(0.7), Roulette::Off] {
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

#[test]
fn sidak_limits() {
    assert!((sidak(0.05, 1) - 1.959_964).abs() < 1e-5);
    // 1 − 0.99^(1/100), half of it in each tail.
    assert!((sidak(0.01, 100) - 3.888_8).abs() < 1e-3, "{}", sidak(0.01, 100));
}
