//! The same picture, to the bit and to the byte of its files, however the work is cut: by threads, waves, instruction sets,
//! the structure that answers rays, or cells.

mod common;

use comber::film::output;
use comber::film::picture::Picture;
use comber::options::{
    self, AccelOptions, Adaptive, Cell, Confidence, Direct, Normals, Precision, RenderOptions, Roulette, Simd,
};
use comber::simd::Tier;
use common::{Ready, assert_same, own};

const WAVES: [u32; 6] = [1, 7, 256, 1000, 4096, 1 << 17];

/// A frame whose sides are no multiples of a tile's, with samples that are no multiple of a pass.
fn small() -> RenderOptions {
    RenderOptions {
        width: 37,
        height: 21,
        samples: 19,
        aovs: true,
        threads: Some(1),
        wave: Some(256),
        simd: Simd::Baseline,
        ..RenderOptions::default()
    }
}

/// Spheres; and triangles with corner normals.
fn scenes() -> [Ready; 2] {
    ["cornell_spheres.dae", "cornell_mesh.dae"].map(|name| Ready::course(&own(name), Normals::Smooth))
}

fn tiers() -> Vec<Simd> {
    let all = Tier::available();
    println!("instruction sets: {:?}", all.iter().map(|t| t.name()).collect::<Vec<_>>());
    if all.len() > 1 { vec![Simd::Baseline, Simd::Avx2] } else { vec![Simd::Baseline] }
}

fn rule() -> Option<Adaptive> {
    Some(Adaptive { batch: 4, tolerance: 0.2, confidence: Confidence::T, min_samples: 8, ..Adaptive::COURSE })
}

/// The bytes of an EXR and of a PNG file of the picture.
fn files(picture: &Picture) -> [Vec<u8>; 2] {
    let directory = tempfile::tempdir().expect("directory");
    ["a.exr", "a.png"].map(|name| {
        let path = directory.path().join(name);
        output::write(&path, picture, 0.0).expect("written");
        std::fs::read(&path).expect("read")
    })
}

#[test]
fn speed_options_change_no_bit_of_any_layer_and_no_byte_of_any_file() {
    let ready = Ready::course(&own("cornell_spheres.dae"), Normals::Smooth);
    for adaptive in [None, rule()] {
        let options = RenderOptions { adaptive, ..small() };
        let expected = ready.render(&options);
        let expected_files = files(&expected.picture);
        for threads in [1, 2, 5] {
            for wave in WAVES {
                for &simd in &tiers() {
                    let varied = RenderOptions { threads: Some(threads), wave: Some(wave), simd, ..options.clone() };
                    let what = format!("{threads} threads, waves of {wave}, {simd:?}, {adaptive:?}");
                    let outcome = ready.render(&varied);
                    assert_same(&outcome.picture, &expected.picture, &what);
                    assert!(files(&outcome.picture) == expected_files, "{what}: files");
                    assert_eq!(outcome.stats.rays, expected.stats.rays, "{what}: rays");
                    assert_eq!(outcome.stats.converged_pixels, expected.stats.converged_pixels, "{what}: retired");
                }
            }
        }
    }
}

#[test]
fn neither_do_they_with_any_direct_strategy_and_scene() {
    // Each speed option takes each of its values, not each combination of them.
    let cuts = [(2, 7, Simd::Auto), (5, 1000, Simd::Baseline), (2, 4096, Simd::Auto), (1, 1 << 17, Simd::Auto)];
    for ready in scenes() {
        for direct in [Direct::Mis, Direct::Light, Direct::Hemisphere, Direct::Bsdf] {
            for (adaptive, light_samples) in [(None, 1), (None, 3), (rule(), 1)] {
                let options = RenderOptions { direct, adaptive, light_samples, ..small() };
                let expected = ready.render(&options).picture;
                for (threads, wave, simd) in cuts {
                    let varied = RenderOptions { threads: Some(threads), wave: Some(wave), simd, ..options.clone() };
                    let what = format!("{} {direct:?} -l {light_samples} {adaptive:?}: {threads} {wave}", ready.name);
                    assert_same(&ready.render(&varied).picture, &expected, &what);
                }
            }
        }
    }
}

#[test]
fn neither_do_they_in_double_precision() {
    let accel = AccelOptions { precision: Precision::F64, ..AccelOptions::default() };
    for name in ["cornell_spheres.dae", "cornell_mesh.dae"] {
        let ready = Ready::course_in(&own(name), Normals::Smooth, accel);
        for (direct, adaptive) in [(Direct::Mis, None), (Direct::Hemisphere, rule())] {
            let options = RenderOptions { direct, adaptive, accel, ..small() };
            let expected = ready.render(&options).picture;
            for (threads, wave, simd) in
                [(2, 7, Simd::Auto), (5, 1000, Simd::Baseline), (2, 4096, Simd::Auto), (1, 1 << 17, Simd::Auto)]
            {
                let varied = RenderOptions { threads: Some(threads), wave: Some(wave), simd, ..options.clone() };
                assert_same(&ready.render(&varied).picture, &expected, &format!("{name} {direct:?}: {threads} {wave}"));
            }
        }
    }
}

#[test]
fn the_tree_and_the_test_of_every_primitive_give_the_same_picture() {
    for name in ["cornell_spheres.dae", "cornell_mesh.dae", "cornell_quad_light.dae"] {
        for normals in [Normals::Smooth, Normals::Flat] {
            let tree = Ready::course(&own(name), normals);
            let brute = Ready::course(&own(name), normals).with_accel(options::Accel::Brute);
            for direct in [Direct::Mis, Direct::Hemisphere] {
                let options = RenderOptions { direct, samples: 2, threads: None, simd: Simd::Auto, ..small() };
                let by_brute =
                    RenderOptions { accel: options::AccelOptions::of(options::Accel::Brute), ..options.clone() };
                let (a, b) = (tree.render(&options), brute.render(&by_brute));
                assert_same(&a.picture, &b.picture, &format!("{name} {normals:?} {direct:?}"));
                assert_eq!(a.stats.rays, b.stats.rays);
            }
        }
    }
}

/// The pixels of `cell` out of a layer of the whole frame.
fn cut<T: Copy>(layer: &[T], width: u32, cell: Cell) -> Vec<T> {
    let row = |y: u32| ((y * width + cell.x) as usize..(y * width + cell.x + cell.width) as usize).map(|i| layer[i]);
    (cell.y..cell.y + cell.height).flat_map(row).collect()
}

#[test]
fn a_cell_has_the_pixels_of_the_whole_frame() {
    for ready in scenes() {
        for (adaptive, roulette) in [(None, Roulette::EFFICIENCY), (rule(), Roulette::Fixed(0.7))] {
            let options = RenderOptions { adaptive, roulette, threads: Some(2), wave: None, ..small() };
            let whole = ready.render(&options).picture;
            for (x, y, width, height) in
                [(0, 0, 37, 21), (5, 3, 20, 17), (36, 20, 1, 1), (0, 16, 37, 1), (16, 0, 1, 21)]
            {
                let cell = Cell { x, y, width, height };
                let part = ready.render(&RenderOptions { cell: Some(cell), ..options.clone() }).picture;
                assert_eq!((part.width, part.height), (width as usize, height as usize));
                assert_eq!((part.x, part.y, part.full), (x as usize, y as usize, (37, 21)));
                let cut3 = |layer: &Option<Vec<[f32; 3]>>| layer.as_ref().map(|l| cut(l, 37, cell));
                let expected = Picture {
                    beauty: cut(&whole.beauty, 37, cell),
                    albedo: cut3(&whole.albedo),
                    normal: cut3(&whole.normal),
                    variance: cut3(&whole.variance),
                    depth: whole.depth.as_ref().map(|l| cut(l, 37, cell)),
                    sample_count: whole.sample_count.as_ref().map(|l| cut(l, 37, cell)),
                    ..part.clone()
                };
                assert_same(&part, &expected, &format!("{} {cell:?} {adaptive:?}", ready.name));
            }
        }
    }
}
