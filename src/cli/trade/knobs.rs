//! The knobs that can be varied. A new one is an entry of [`KNOBS`]; its values are parsed as the command line's are.

use super::args::Variation;
use crate::cli::args::{AREAS, CONFIDENCES, DIRECTS, INTERSECTIONS, LIGHT_SAMPLINGS, LIGHT_SELECTIONS, MAX_SAMPLES};
use crate::cli::args::{LEAF_FORMATS, NODE_FORMATS, PRECISIONS, QUALITIES, SAMPLERS, TESTS, TRUSTS};
use crate::cli::resolve::ADAPTIVE_REPLICATES;
use crate::cli::values::{self, chosen, whole_in};
use crate::error::{Error, Result};
use crate::options::{Accel, Adaptive, Area, Confidence, Intersection, NodeFormat, RenderOptions, Sampler, Trust};
use crate::trade::Configuration;

/// Something that can be varied.
pub struct Knob {
    /// As typed.
    pub name: &'static str,
    /// What it does and which way it trades, in a line.
    pub help: &'static str,
    /// Parses a value and applies it.
    set: fn(&mut RenderOptions, &str) -> std::result::Result<(), String>,
}

/// The knob along which errors have a slope, and which is scaled for pictures at equal time.
pub const SAMPLES: &str = "samples";

/// All of them, in the order in which they are applied.
pub const KNOBS: &[Knob] = &[
    Knob {
        name: SAMPLES,
        help: "samples a pixel (-s): time × 0.27 and error² × 5.5 at 16, × 4.0 and × 0.19 at 256, of those at 64",
        set: |options, text| put(&mut options.samples, whole_in(text, 1..=MAX_SAMPLES)),
    },
    Knob {
        name: "light-samples",
        help: "rays towards each light at each vertex (-l): 2 take × 1.22 for error² × 0.91, 4 × 1.60 for × 0.85",
        set: |options, text| put(&mut options.light_samples, whole_in(text, 1..=4096)),
    },
    Knob {
        name: "direct",
        help: "hemisphere, light, bsdf, mis: no bias; light × 0.96 the time of mis where lamps are small; bsdf, hemisphere error² × 130 to 220",
        set: |options, text| put(&mut options.direct, chosen(DIRECTS, text)),
    },
    Knob {
        name: "light-sampling",
        help: "corners, area, solid-angle: no bias; area × 0.91 the time for error² × 1.22, solid-angle × 1.06 for × 1.05",
        set: |options, text| put(&mut options.light_sampling, chosen(LIGHT_SAMPLINGS, text)),
    },
    Knob {
        name: "light-selection",
        help: "auto, each, power, tree: no bias; tree 2 to 20 times as efficient as power among many lights, × 1.4 the time for one",
        set: |options, text| put(&mut options.light_selection, chosen(LIGHT_SELECTIONS, text)),
    },
    Knob {
        name: "sampler",
        help: "independent, sobol, blue-noise: no time; error² of independent numbers × 3.0 of sobol",
        set: |options, text| put(&mut options.sampler, chosen(SAMPLERS, text)),
    },
    Knob {
        name: "replicates",
        help: "sequences a pixel: standard errors that are right, for error² × 1.36 (4) or × 2.1 (16) of sobol",
        set: |options, text| put(&mut options.replicates, values::power_of_two(text)),
    },
    Knob {
        name: "reuse",
        help: "pixels that share indirect light: 4 take × 1.4 the time for relMSE ÷ 2, 16 × 1.9 for ÷ 5, 64 × 3.7 for ÷ 8",
        set: |options, text| put(&mut options.reuse, values::block(text)),
    },
    Knob {
        name: "lamp-rays",
        help: "camera rays that look for lights in view: 16 take × 1.03 the time, for MSE ÷ 1.7 where lamps are seen",
        set: |options, text| put(&mut options.lamp_rays, whole_in(text, 1..=256)),
    },
    Knob {
        name: "roulette",
        help: "off, fixed:P, throughput[:START], efficiency[:FACTOR]: no bias; error² × rays of efficiency is 8 % less at depth 5, 25 % at 100",
        set: |options, text| put(&mut options.roulette, values::roulette(text)),
    },
    Knob {
        name: "clamp-indirect",
        help: "off, RADIANCE: fewer fireflies for bias, and no time; Cornell boxes have none (1: nothing; 0.1: error² × 7)",
        set: |options, text| {
            let value = if text == "off" { Ok(None) } else { values::positive(text).map(Some) };
            put(&mut options.clamp_indirect, value)
        },
    },
    Knob {
        name: "depth",
        help: "the most bounces (-m): time for bias; 2 take × 0.53 for error² × 22, 20 × 1.20 for × 0.87 of those of 5",
        set: |options, text| put(&mut options.max_depth, whole_in(text, 0..=65536)),
    },
    Knob {
        name: "adaptive",
        help: "off, BATCH:TOLERANCE: as -a; 16:0.1 takes × 0.89 the samples for error² × 1.12, × 0.94 that of as many spread evenly",
        set: |options, text| put(&mut options.adaptive, adaptive(text)),
    },
    Knob {
        name: "tolerance",
        help: "that of adaptive sampling: 0.05 takes × 1.12 the samples for error² × 0.89, 0.2 × 0.61 for × 1.8 of those of 0.1",
        set: |options, text| put(&mut rule(options)?.tolerance, values::positive(text)),
    },
    Knob {
        name: "confidence",
        help: "z, t: the quantile of adaptive sampling; they differ where few pixels are judged together",
        set: |options, text| put(&mut rule(options)?.confidence, chosen(CONFIDENCES, text)),
    },
    Knob {
        name: "batch",
        help: "samples between tests of adaptive sampling: 8 error² × 1.04, 32 × 0.96 of those of 16, for × 0.98 and × 1.06 the samples",
        set: |options, text| {
            let (rule, batch) = (rule(options)?, whole_in(text, 1..=MAX_SAMPLES)?);
            // Unless another least number of samples was asked for, it is the batch.
            if rule.min_samples == rule.batch.max(2) {
                rule.min_samples = batch.max(2);
            }
            rule.batch = batch;
            Ok(())
        },
    },
    Knob {
        name: "adaptive-tests",
        help: "batches, doubling: fewer tests, fewer passed by luck; × 1.06 the samples, error² × 0.96",
        set: |options, text| put(&mut rule(options)?.tests, chosen(TESTS, text)),
    },
    Knob {
        name: "adaptive-trust",
        help: "once, twice, halves: bias of stopping for samples; twice × 1.09 the samples, error² × 0.92; halves needs 16 replicates",
        set: |options, text| {
            put(&mut rule(options)?.trust, chosen(TRUSTS, text))?;
            several_sequences(options);
            Ok(())
        },
    },
    Knob {
        name: "adaptive-area",
        help: "pixel, tile: a tile's interval is known better, and stops it without bias; pixel needs 16 replicates, for error² × 2",
        set: |options, text| {
            put(&mut rule(options)?.area, chosen(AREAS, text))?;
            several_sequences(options);
            Ok(())
        },
    },
    Knob {
        name: "adaptive-floor",
        help: "luminance of which darker parts count as about as much: 0.01 takes × 1.10 the samples for error² × 0.91 of those of 0.1",
        set: |options, text| put(&mut rule(options)?.floor, values::positive(text)),
    },
    Knob {
        name: "intersection",
        help: "fast, watertight: fast takes × 0.96 the time, and a ray in a million slips through",
        set: |options, text| put(&mut options.accel.intersection, chosen(INTERSECTIONS, text)),
    },
    Knob {
        name: "precision",
        help: "f32, f64: positions of 48 bits for × 3.2 to 4.4 the time; the same picture but in scenes both huge and fine",
        set: |options, text| put(&mut options.accel.precision, chosen(PRECISIONS, text)),
    },
    Knob {
        name: "bvh",
        help: "fast, default, best: time to build for time to trace; × 1 on these scenes; the picture stays the same",
        set: |options, text| put(&mut tree(options)?.quality, chosen(QUALITIES, text)),
    },
    Knob {
        name: "nodes",
        help: "auto, full, compact: memory, and time × 1.04 with full ones; the picture stays the same",
        set: |options, text| put(&mut tree(options)?.nodes, chosen(NODE_FORMATS, text)),
    },
    Knob {
        name: "leaves",
        help: "auto, full, compact: compact ones take × 0.7 the tree's memory, and × 1.02 the instructions; the picture stays the same",
        set: |options, text| put(&mut tree(options)?.leaves, chosen(LEAF_FORMATS, text)),
    },
    Knob {
        name: "wave",
        help: "paths that advance together: 256 take × 1.35 the time of 8192; the picture stays the same",
        set: |options, text| put(&mut options.wave, whole_in(text, 1..=1 << 24).map(Some)),
    },
];

fn put<T>(field: &mut T, value: std::result::Result<T, String>) -> std::result::Result<(), String> {
    *field = value?;
    Ok(())
}

/// `off` or `BATCH:TOLERANCE`.
fn adaptive(text: &str) -> std::result::Result<Option<Adaptive>, String> {
    if text == "off" {
        return Ok(None);
    }
    let Some((batch, tolerance)) = text.split_once(':') else {
        return Err("must be off or BATCH:TOLERANCE, as in 16:0.05".into());
    };
    let batch = whole_in(batch, 1..=MAX_SAMPLES).map_err(|why| format!("the BATCH {why}, as in 16:0.05"))?;
    let tolerance = values::positive(tolerance).map_err(|why| format!("the TOLERANCE {why}"))?;
    Ok(Some(Adaptive {
        batch,
        tolerance,
        confidence: Confidence::default(),
        min_samples: batch.max(2),
        area: Area::default(),
        floor: Adaptive::FLOOR,
        ..Adaptive::COURSE
    }))
}

/// As the command line does: a pixel by itself, or a half by the other, is judged by how far sequences are apart.
fn several_sequences(options: &mut RenderOptions) {
    let each = options.adaptive.is_some_and(|rule| rule.area == Area::Pixel || rule.trust == Trust::Halves);
    if each && options.sampler != Sampler::Independent && options.replicates == 1 {
        options.replicates = ADAPTIVE_REPLICATES;
    }
}

fn rule(options: &mut RenderOptions) -> std::result::Result<&mut Adaptive, String> {
    options.adaptive.as_mut().ok_or_else(|| "goes with adaptive sampling: add -a, or --vary adaptive=…".into())
}

fn tree(options: &mut RenderOptions) -> std::result::Result<&mut crate::options::AccelOptions, String> {
    match options.accel.kind {
        Accel::Bvh => Ok(&mut options.accel),
        Accel::Brute => Err("is of a tree, and --accel brute builds none".into()),
    }
}

/// The knob of that name.
pub fn find(name: &str) -> Option<&'static Knob> {
    KNOBS.iter().find(|knob| knob.name == name)
}

/// Most configurations: more cannot be read in a table.
const MOST: usize = 1024;

/// Every combination of the values, the last knob changing fastest.
///
/// # Errors
/// [`Error::Options`] naming the knob and what it may be, or the combination that contradicts itself.
pub fn combinations(base: &RenderOptions, vary: &[Variation]) -> Result<Vec<Configuration>> {
    let misuse = |what: String| Err(Error::Options(what));
    for (index, variation) in vary.iter().enumerate() {
        if vary[..index].iter().any(|other| other.knob.name == variation.knob.name) {
            return misuse(format!("--vary {} is given twice: name all its values in one", variation.knob.name));
        }
    }
    let count = vary.iter().try_fold(1usize, |product, each| product.checked_mul(each.values.len()));
    if count.is_none_or(|count| count > MOST) {
        return misuse(format!("these are more than {MOST} combinations of values"));
    }
    let mut combinations: Vec<Vec<String>> = vec![Vec::new()];
    for variation in vary {
        combinations = combinations
            .iter()
            .flat_map(|values| variation.values.iter().map(|value| [&values[..], std::slice::from_ref(value)].concat()))
            .collect();
    }
    combinations.into_iter().map(|values| configuration(base, vary, values)).collect()
}

fn configuration(base: &RenderOptions, vary: &[Variation], values: Vec<String>) -> Result<Configuration> {
    let mut options = base.clone();
    let named = |name: &str| vary.iter().zip(&values).find(|(each, _)| each.knob.name == name);
    for knob in KNOBS {
        let Some((_, value)) = named(knob.name) else { continue };
        (knob.set)(&mut options, value)
            .map_err(|why| Error::Options(format!("--vary {}: '{value}' {why}", knob.name)))?;
    }
    if (options.accel.intersection, options.accel.nodes) == (Intersection::Fast, NodeFormat::Compact) {
        let what = "--vary: nodes compact goes with intersection watertight only";
        return Err(Error::Options(what.into()));
    }
    if options.accel.leaves.is_compact() {
        let other = match (options.accel.intersection, options.accel.nodes) {
            (Intersection::Fast, _) => Some("intersection fast"),
            (_, NodeFormat::Full) => Some("nodes full"),
            _ => None,
        };
        if let Some(other) = other {
            return Err(Error::Options(format!("--vary: leaves compact does not go with {other}")));
        }
    }
    if let Some(other) = options.not_in_reuse() {
        return Err(Error::Options(format!("--vary: reuse does not go with {other}")));
    }
    if let Some(other) = options.not_in_double() {
        return Err(Error::Options(format!("--vary: precision f64 does not go with {other}")));
    }
    Ok(Configuration { values, options })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::trade::args::variation;
    use crate::options::{Direct, Roulette};

    fn vary(texts: &[&str]) -> Result<Vec<Configuration>> {
        let vary: Vec<Variation> = texts.iter().map(|text| variation(text).unwrap()).collect();
        combinations(&RenderOptions::default(), &vary)
    }

    fn refused(texts: &[&str]) -> String {
        match vary(texts) {
            Err(Error::Options(why)) => why,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn combinations_are_all_there() {
        let all = vary(&["samples=1,4", "direct=light,mis,hemisphere"]).unwrap();
        assert_eq!(all.len(), 6);
        assert_eq!(all[4].values, ["4", "mis"]);
        assert_eq!((all[4].options.samples, all[4].options.direct), (4, Direct::Mis));
        assert_eq!(vary(&[]).unwrap().len(), 1);
    }

    /// Every knob changes something, and says what it may be.
    #[test]
    fn every_knob_turns() {
        let values = [
            ("samples", "7"),
            ("light-samples", "3"),
            ("direct", "hemisphere"),
            ("roulette", "fixed:0.5"),
            ("clamp-indirect", "2.5"),
            ("depth", "2"),
            ("adaptive", "4:0.1"),
            ("tolerance", "0.3"),
            ("confidence", "z"),
            ("batch", "5"),
            ("intersection", "fast"),
            ("bvh", "best"),
            ("nodes", "full"),
            ("leaves", "full"),
            ("precision", "f64"),
            ("wave", "512"),
            ("light-sampling", "solid-angle"),
            ("light-selection", "tree"),
            ("sampler", "independent"),
            ("replicates", "8"),
            ("adaptive-tests", "doubling"),
            ("adaptive-trust", "halves"),
            ("adaptive-area", "pixel"),
            ("adaptive-floor", "0.01"),
            ("reuse", "16"),
            ("lamp-rays", "8"),
        ];
        assert_eq!(values.len(), KNOBS.len());
        let adaptive = RenderOptions { adaptive: adaptive("8:0.2").unwrap(), ..RenderOptions::default() };
        for (name, value) in values {
            // What pixels share does not go with adaptive sampling.
            let base = if name == "reuse" { &RenderOptions::default() } else { &adaptive };
            let turn = |value: &str| combinations(base, &[variation(&format!("{name}={value}")).unwrap()]);
            let options = &turn(value).unwrap()[0].options;
            assert_ne!(format!("{options:?}"), format!("{base:?}"), "{name}");
            let Err(Error::Options(why)) = turn("absurd") else { panic!("{name}") };
            assert!(why.starts_with(&format!("--vary {name}: 'absurd' ")) && why.contains("must be"), "{why}");
        }
        let batch = &combinations(&adaptive, &[variation("batch=5").unwrap()]).unwrap()[0].options.adaptive.unwrap();
        assert_eq!((batch.batch, batch.min_samples), (5, 5));
        let roulette = &vary(&["roulette=throughput:1"]).unwrap()[0].options.roulette;
        assert_eq!(*roulette, Roulette::Throughput { start: 1 });
    }

    #[test]
    fn contradictions_are_refused() {
        assert!(refused(&["samples=1", "samples=2"]).contains("given twice"));
        assert!(refused(&["tolerance=0.1"]).contains("adaptive"));
        assert!(vary(&["tolerance=0.1,0.2", "adaptive=8:0.5"]).is_ok(), "whatever their order");
        assert!(refused(&["nodes=compact", "intersection=fast"]).contains("watertight"));
        assert!(refused(&["leaves=compact", "intersection=fast"]).contains("intersection fast"));
        assert!(refused(&["leaves=full,compact", "nodes=full"]).contains("nodes full"));
        assert!(refused(&["precision=f32,f64", "intersection=watertight,fast"]).contains("precision f64"));
        let many = |name: &str| format!("{name}={}", (1..=40).map(|n| n.to_string()).collect::<Vec<_>>().join(","));
        assert!(refused(&[&many("samples"), &many("depth")]).contains("1024"));
        let brute = RenderOptions { accel: crate::options::AccelOptions::of(Accel::Brute), ..RenderOptions::default() };
        assert!(combinations(&brute, &[variation("bvh=best").unwrap()]).is_err());
    }
}
