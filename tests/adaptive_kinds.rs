//! What becomes of each kind of pixels under the default rule of adaptive sampling: dark, black, rarely lit, with fireflies, at edges, beside lamps. Their
//! samples are drawn from known distributions, so the truth is known, with independent numbers and with one sequence of Sobol points each.

#[path = "common/known_pixels.rs"]
mod known_pixels;

use comber::film::convergence::zeros_needed;
use comber::options::{Adaptive, Area, Confidence, Sampler};
use known_pixels::{Known, Rule, kind, known};

/// The default rule, as `-a 64 0.05` says it.
const TILE: Adaptive = Adaptive {
    batch: 64,
    min_samples: 64,
    confidence: Confidence::T,
    area: Area::Tile,
    floor: Adaptive::FLOOR,
    ..Adaptive::COURSE
};
const PIXEL: Adaptive = Adaptive { area: Area::Pixel, ..TILE };
const SAMPLERS: [Sampler; 2] = [Sampler::Independent, Sampler::Sobol];

fn run(name: &str, adaptive: Adaptive, sampler: Sampler, tiles: u32, most: u32) -> Known {
    let rule = Rule { name: String::new(), adaptive, sampler, replicates: 1 };
    let known = known(kind(name), &rule, tiles, most);
    let ((bias, z), samples) = (known.bias(), known.samples());
    println!(
        "{name}, {:?}, {sampler:?}: {samples:.0} samples, {:.1} % stopped, of them {:.1} % within the tolerance, bias {:+.2} % (z {z:+.1})",
        adaptive.area,
        100.0 * known.stopped(),
        100.0 * known.within(),
        100.0 * bias
    );
    known
}

#[test]
fn edges_are_as_good_as_they_say_and_not_biased() {
    for sampler in SAMPLERS {
        let edges = run("edge: 0.2 or 1.8", TILE, sampler, 24, 4096);
        assert_eq!(edges.stopped(), 1.0, "{sampler:?}");
        assert!(edges.within() > 0.94, "95 % are promised, within 1 %: {}", edges.within());
        assert!(edges.bias().0.abs() < 2e-3, "{:?}", edges.bias());
        // σ = 0.8: (1.96 · 0.8 / 0.05)² / 1.01 = 974 independent samples, and hardly more than a batch of Sobol points.
        let expected = if sampler == Sampler::Independent { 900.0..1100.0 } else { 60.0..200.0 };
        assert!(expected.contains(&edges.samples()), "{sampler:?}: {}", edges.samples());
    }
}

#[test]
fn dark_pixels_take_few_samples_unless_the_floor_is_low() {
    for sampler in SAMPLERS {
        let dark = run("dark: exponential, 0.002", TILE, sampler, 8, 1024);
        assert_eq!((dark.samples(), dark.within()), (64.0, 1.0), "{sampler:?}: as shown, nobody sees their noise");
        assert!(dark.bias().0.abs() < 0.01, "{:?}", dark.bias());
        let low = run("dark: exponential, 0.002", Adaptive { floor: Adaptive::DARK, ..TILE }, sampler, 8, 1024);
        let least = if sampler == Sampler::Independent { 1000.0 } else { 100.0 };
        assert!(low.samples() >= least, "{sampler:?}: {}", low.samples());
    }
}

#[test]
fn black_tiles_stop_when_they_are_surely_black() {
    for (sampler, batch) in SAMPLERS.into_iter().flat_map(|sampler| [(sampler, 8), (sampler, 64)]) {
        let rule = Adaptive { batch, min_samples: batch, ..TILE };
        let black = run("black", rule, sampler, 2, 1024);
        assert_eq!(black.samples(), f64::from(zeros_needed(&rule).next_multiple_of(batch)));
        assert_eq!((black.stopped(), black.within()), (1.0, 1.0));
    }
}

#[test]
fn a_lamp_does_not_hide_the_noise_beside_it() {
    for sampler in SAMPLERS {
        let half = run("a lamp beside noise", TILE, sampler, 16, 4096);
        // Beside the mean of the tile, 10, noise of 0.5 would pass the first test.
        if sampler == Sampler::Independent {
            assert!(half.samples() > 600.0, "{}", half.samples());
        }
        // Half of the pixels have no error, so the others may have √2 of it: 83 % of them are within the tolerance.
        assert!(half.within() > 0.90, "{sampler:?}: {}", half.within());
    }
}

#[test]
fn rarely_lit_tiles_go_on() {
    for sampler in SAMPLERS {
        let tile = run("lit once in 50", TILE, sampler, 24, 512);
        assert_eq!(tile.stopped(), 0.0, "{sampler:?}: 75,000 samples would be enough");
        assert!(tile.bias().1.abs() < 4.0, "{sampler:?}: {:?}", tile.bias());
    }
    // By itself, a pixel that has met no light in 256 samples is black: 0.98²⁵⁶ of them.
    let alone = run("lit once in 50", PIXEL, Sampler::Independent, 240, 512);
    let (bias, z) = alone.bias();
    let expected = -(0.98f64.powi(256));
    assert!((bias - expected).abs() < 4.0 * (bias / z).abs() && z < -1.0, "{bias} (z {z}) beside {expected}");
}

/// What no sample of a tile has met is not waited for; what one pixel has met keeps its tile going.
#[test]
fn bright_samples_once_in_ten_thousand_are_missed_by_no_more_tiles_than_chance_says() {
    for sampler in SAMPLERS {
        for (name, samples, share) in [("firefly once in 10⁴, over 0.5", 64.0, 0.5), ("lit once in 10⁴", 256.0, 1.0)]
        {
            let (tiles, most) = (160u32, 320);
            let tile = run(name, TILE, sampler, tiles, most);
            // 256 pixels of so many samples each meet none with this probability.
            let none = (-1e-4f64 * 256.0 * samples).exp();
            let error = (none * (1.0 - none) / f64::from(tiles)).sqrt();
            assert!((tile.stopped() - none).abs() < 4.0 * error, "{name}, {sampler:?}: {} {none}", tile.stopped());
            let (bias, z) = tile.bias();
            // And by so much is the mean too low; the luck of those that go on is the rest.
            let spread = (bias / z).abs();
            assert!((bias + share * none).abs() < 4.0 * spread, "{name}, {sampler:?}: {bias} beside {}", share * none);
            assert!(bias > if share < 1.0 { -0.2 } else { -0.1 }, "{name}, {sampler:?}: {bias}");
        }
    }
    // A pixel by itself misses nearly all of it.
    let alone = run("lit once in 10⁴", PIXEL, Sampler::Independent, 16, 4096);
    assert!(alone.bias().0 < -0.88 && alone.stopped() > 0.9, "{:?}", alone.bias());
}
