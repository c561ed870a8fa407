//! `comber trade`: what it finds of errors that are known otherwise, and how it behaves.

mod common;

use comber::bench::probe::Reading;
use comber::film::exr_output;
use comber::film::read::Found;
use comber::options::{Cell, Normals, RenderOptions};
use comber::trade::figures::Figures;
use comber::trade::measure::{Effort, End, Measured, Subject, Watcher};
use comber::trade::truth::Truth;
use comber::trade::{Configuration, Run};
use common::command::{comber, expect, number, stderr, with_scene};
use common::statistics::student;
use common::{Ready, own};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

fn trade(directory: &Path, arguments: &str) -> Value {
    let output = expect(directory, &format!("trade {arguments} --json"), 0);
    serde_json::from_slice(&output.stdout).unwrap()
}

/// An estimate and its error.
fn estimate(value: &Value, number_of: usize, name: &str) -> [f64; 2] {
    ["value", "error"].map(|part| number(value, &format!("/configurations/{number_of}/figures/{name}/{part}")))
}

/// The variance between short renders is that which a long one states for its pixels.
#[test]
fn variance_is_that_of_a_long_render() {
    let dir = with_scene();
    expect(dir.path(), "render box.dae -r 40 30 -s 2048 --sampler independent --seed 5 -o long.exr -q", 0);
    let long = exr_output::read(&dir.path().join("long.exr")).unwrap();
    let of_mean: Vec<f64> = long.variance.unwrap().iter().flatten().map(|&v| f64::from(v)).collect();
    let of_one = 2048.0 * of_mean.iter().sum::<f64>() / of_mean.len() as f64;
    let found = trade(dir.path(), "box.dae --sampler independent --vary samples=1,8 --reference long.exr --runs 48");
    for (index, samples) in [1.0, 8.0].into_iter().enumerate() {
        let [variance, error] = estimate(&found, index, "variance");
        let z = (variance - of_one / samples) / error;
        println!("{samples} samples: variance {variance:.5} ± {error:.5}, expected {:.5}", of_one / samples);
        // The long render's own variance is known to a percent.
        assert!(z.abs() < 4.0 && error < 0.05 * variance, "z {z}");
        let [mse, bias2] = ["mse", "bias2"].map(|name| estimate(&found, index, name)[0]);
        assert!((bias2 + variance - mse).abs() < 1e-12 + 1e-9 * mse);
    }
    let [slope, error] = ["value", "error"].map(|part| number(&found, &format!("/groups/0/slope/{part}")));
    assert!((slope + 1.0).abs() < 4.0 * error && error < 0.05, "slope {slope} ± {error}");
}

/// A depth that is too small is bias; another way to the same light is none.
#[test]
fn bias_is_seen_where_there_is_some() {
    let dir = with_scene();
    let line =
        "box.dae -r 32 24 --vary depth=1,5 --vary direct=light,mis --vary samples=4 --runs 24 --reference-error 0.02";
    let found = trade(dir.path(), line);
    for (index, biased) in [true, true, false, false].into_iter().enumerate() {
        let configuration = &found["configurations"][index];
        assert_eq!(configuration["bias_is_in_the_noise"], !biased, "{configuration:#}");
        let [test, error] = estimate(&found, index, "bias_test");
        println!("bias test {test:.5} ± {error:.5}");
        assert!(if biased { test > 10.0 * error } else { test.abs() < 4.0 * error }, "{test} ± {error}");
    }
}

struct Silent;

impl Watcher for Silent {
    fn part(&self, _: usize, _: u64, _: u64) {}

    fn finished(&self, _: &Run, _: &comber::accumulate::Spread) -> comber::error::Result<()> {
        Ok(())
    }

    fn stop(&self) -> bool {
        false
    }
}

/// MSE is as uncertain as stated: over many small trades with other seeds, beside one of many renders.
#[test]
fn error_bars_cover() {
    let ready = Ready::course(&own("cornell_quad_light.dae"), Normals::Smooth);
    let base = RenderOptions { width: 24, height: 18, samples: 2, ..RenderOptions::default() };
    let long = ready.render(&RenderOptions { samples: 4096, aovs: true, seed: 9, ..base.clone() }).picture;
    let (width, height) = (long.width, long.height);
    let found = Found {
        width,
        height,
        full: (width, height),
        colours: long.beauty,
        variance: long.variance,
        ..Found::default()
    };
    let cell = Cell { x: 0, y: 0, width: 24, height: 18 };
    let (truth, _) = Truth::new(&found, cell, (24, 18)).unwrap();
    let measure = |seed: u32, runs: u32| {
        let configurations = [Configuration { values: Vec::new(), options: RenderOptions { seed, ..base.clone() } }];
        let subject = Subject { scene: &ready.scene, camera: &ready.camera, trees: &[&ready.accel], tree_of: &[0] };
        let mut measured = Measured::new(1, width * height);
        let effort = Effort { runs, budget: None };
        let end = comber::trade::measure(subject, &configurations, &truth, effort, &mut measured, &Silent).unwrap();
        assert_eq!(end, End::Finished);
        let still = Reading { compute: f64::INFINITY, memory: f64::INFINITY };
        Figures::of(&measured.runs[0], &measured.spreads[0], &truth, still).unwrap()
    };
    let exact = measure(1000, 600).mse;
    const TRADES: u32 = 60;
    let (mut covered, mut squares) = (0, 0.0);
    for seed in 0..TRADES {
        let mse = measure(seed, 8).mse;
        let z = (mse.value - exact.value) / mse.error.hypot(exact.error);
        covered += u32::from(z.abs() < student(0.025, 8));
        squares += z * z / f64::from(TRADES);
    }
    println!("{covered} of {TRADES} 95 % intervals cover; mean z² {squares:.2} (1.4 for Student's t)");
    // 57 are expected, and 52 are fewer than in 99 % of all programs that are right.
    assert!(covered >= 52 && (0.7..2.4).contains(&squares), "{covered}, {squares}");
}

const SMALL: &str = "box.dae -r 24 18 --vary samples=1,2 --vary direct=light,mis";

/// What does not depend on the clock.
fn timeless(found: &Value) -> String {
    let configurations = found["configurations"].as_array().unwrap().iter().map(|configuration| {
        let f = &configuration["figures"];
        format!(
            "{} {} {} {} {} {}\n",
            configuration["knobs"], f["runs"], f["mse"], f["relmse"], f["variance"], f["bias2"]
        )
    });
    configurations.collect()
}

#[test]
fn resumed_is_uninterrupted() {
    let dir = with_scene();
    let at =
        |name: &str, rest: &str| trade(dir.path(), &format!("{SMALL} --csv {name}.csv --reference-error 0.05 {rest}"));
    let whole = timeless(&at("whole", "--runs 6"));
    at("parts", "--runs 2");
    assert_eq!(timeless(&at("parts", "--runs 6 --resume")), whole);
    assert_eq!(timeless(&at("parts", "--runs 6 --resume")), whole, "nothing is left to do");

    // A journal whose last line is cut off.
    let journal = dir.path().join("parts.trade/journal.jsonl");
    let bytes = fs::read(&journal).unwrap();
    fs::write(&journal, &bytes[..bytes.len() - 20]).unwrap();
    assert_eq!(timeless(&at("parts", "--runs 6 --resume")), whole);

    // Threads are part of what is measured, but change no error.
    assert_eq!(timeless(&at("one", "--runs 6 -t 1")), whole);
}

#[cfg(unix)]
#[test]
fn a_killed_process_loses_one_render_at_most() {
    let dir = with_scene();
    let line = format!("trade {SMALL} --csv a.csv --reference-error 0.05 -q");
    let mut child = comber(dir.path(), &format!("{line} --runs 100000")).spawn().unwrap();
    let journal = dir.path().join("a.trade/journal.jsonl");
    let lines = || fs::read_to_string(&journal).map_or(0, |text| text.lines().count());
    let start = Instant::now();
    while lines() < 10 && start.elapsed() < Duration::from_secs(120) {
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let kept = lines() - 1;
    assert!(kept >= 9, "{kept} renders");
    let runs = kept.div_ceil(4) + 2;
    let resumed = trade(dir.path(), &format!("{SMALL} --csv a.csv --reference-error 0.05 --resume --runs {runs}"));
    fs::remove_dir_all(dir.path().join("a.trade")).unwrap();
    let whole = trade(dir.path(), &format!("{SMALL} --csv a.csv --reference-error 0.05 --runs {runs}"));
    assert_eq!(timeless(&resumed), timeless(&whole));
}

#[test]
fn a_journal_of_something_else_is_refused() {
    let dir = with_scene();
    let line = format!("trade {SMALL} --csv a.csv --reference-error 0.1 --runs 2 -q");
    expect(dir.path(), &line, 0);
    for (change, said) in [("--seed 3", "options.seed is 0 there and 3 here"), ("-m 3", "max_depth")] {
        let output = expect(dir.path(), &format!("{line} --resume {change}"), 1);
        assert!(stderr(&output).contains(said), "{}", stderr(&output));
    }
    let journal = dir.path().join("a.trade/journal.jsonl");
    let text = fs::read_to_string(&journal).unwrap();
    fs::write(&journal, text.replacen("\"mse\":", "\"mes\":", 1)).unwrap();
    let output = expect(dir.path(), &format!("{line} --resume"), 1);
    assert!(stderr(&output).contains("journal.jsonl:2: "), "{}", stderr(&output));
}

#[test]
fn a_budget_is_shared_in_turns_and_kept() {
    let dir = with_scene();
    let found = trade(dir.path(), &format!("{SMALL} --reference-error 0.1 --budget 700ms"));
    assert_eq!(found["ended"], "budget");
    let runs: Vec<f64> = (0..4).map(|i| number(&found, &format!("/configurations/{i}/figures/runs"))).collect();
    assert!(runs[0] >= 2.0 && runs[0] - runs[3] <= 1.0 && runs.windows(2).all(|pair| pair[0] >= pair[1]), "{runs:?}");
    let few = trade(dir.path(), &format!("{SMALL} --reference-error 0.1 --budget 1h --runs 2"));
    assert_eq!((&few["ended"], number(&few, "/configurations/3/figures/runs")), (&"finished".into(), 2.0));
    expect(dir.path(), "render box.dae -r 24 18 -s 16 -o r.exr -q", 0);
    let output = expect(dir.path(), "trade box.dae --reference r.exr --vary samples=1000000 --budget 1ms", 1);
    assert!(stderr(&output).contains("the budget is too small"), "{}", stderr(&output));
}

#[test]
fn tables_say_the_same() {
    let dir = with_scene();
    let line =
        format!("{SMALL} --vary roulette=off,fixed:0.7 --reference-error 0.1 --runs 3 --csv a.csv --html a.html");
    let found = trade(dir.path(), &line);
    let text = fs::read_to_string(dir.path().join("a.csv")).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!((rows.len(), &rows[0][..3]), (9, &["knob_samples", "knob_direct", "knob_roulette"][..]));
    for (index, row) in rows[1..].iter().enumerate() {
        assert_eq!(row.len(), rows[0].len());
        let cell = |name: &str| row[rows[0].iter().position(|heading| *heading == name).unwrap()];
        assert_eq!(found["configurations"][index]["knobs"]["roulette"], cell("knob_roulette"));
        for (name, at) in [("mse", "mse/value"), ("bias2_stderr", "bias2/error"), ("seconds", "seconds/median")] {
            let expected = number(&found, &format!("/configurations/{index}/figures/{at}"));
            assert_eq!(cell(name).parse::<f64>().unwrap(), expected, "{name}");
        }
    }
    let html = fs::read_to_string(dir.path().join("a.html")).unwrap();
    for part in ["http://", "https://", "<script", "<link", "@import", "url("] {
        let found = html.replace("http://www.w3.org/2000/svg", "").contains(part);
        assert!(!found, "the report refers to something else: {part}");
    }
    for part in ["Error against time", "At equal time", "data:image/png", "slope of MSE", "fixed:0.7", "on the front"] {
        assert!(html.contains(part), "{part}");
    }
    let printed = expect(dir.path(), &format!("trade {SMALL} --reference a.trade/reference.exr --runs 2"), 0);
    let printed = String::from_utf8(printed.stdout).unwrap();
    for part in ["samples", "direct", "MSE", "bias²", "front", "slope of MSE", "with standard errors"] {
        assert!(printed.contains(part), "{part}: {printed}");
    }
}

/// The kept reference is used again where it is of the same, and only there.
#[test]
fn references_are_kept_and_reused() {
    let dir = with_scene();
    let kept = dir.path().join("a.trade/reference.exr");
    let mut line = format!("trade {SMALL} --csv a.csv --runs 1 --reference-error 0.1");
    let say = |line: &str| String::from_utf8(expect(dir.path(), line, 0).stdout).unwrap();
    assert!(say(&line).contains("reference.exr, rendered to"));
    let bytes = fs::read(&kept).unwrap();
    assert!(say(&line).contains("rendered earlier"));
    assert!(fs::read(&kept).unwrap() == bytes);
    line += " -m 2";
    assert!(say(&line).contains("reference.exr, rendered to"), "of another depth");
    assert!(say(&line.replace("0.1", "0.05")).contains("reference.exr, rendered to"), "of a larger error");
}

#[test]
fn misuse_is_named() {
    let dir = with_scene();
    for (arguments, said) in [
        ("box.dae", "--vary"),
        ("box.dae --vary samples", "KNOB=V1,V2"),
        ("box.dae --vary colour=red", "there is no knob 'colour', but samples, light-samples"),
        ("box.dae --vary samples=1,0", "--vary samples: '0' must be a whole number from 1"),
        ("box.dae --vary direct=mis,best", "must be hemisphere, light, bsdf or mis"),
        ("box.dae --vary samples=1,1", "twice"),
        ("box.dae --vary samples=1 --vary samples=2", "given twice"),
        ("box.dae --vary tolerance=0.1", "--vary adaptive"),
        ("box.dae --vary nodes=compact --vary intersection=fast", "watertight"),
        ("box.dae --vary samples=1 --resume", "--html or --csv"),
        ("box.dae --vary samples=1 --budget 5", "as in 500ms"),
        ("box.dae --vary samples=1 --integrator bvh-cost", "bvh-cost"),
        ("box.dae --vary samples=1 --reference-stderr a.exr", "--reference"),
    ] {
        let output = expect(dir.path(), &format!("trade {arguments}"), 2);
        assert!(stderr(&output).contains(said), "{arguments}: {}", stderr(&output));
    }
    let output = expect(dir.path(), "trade box.dae --vary samples=1 --reference missing.exr", 1);
    assert!(stderr(&output).contains("missing.exr"), "{}", stderr(&output));
    expect(dir.path(), "render box.dae -r 24 18 -s 2 -o r.exr -q", 0);
    let output = expect(dir.path(), "trade box.dae -r 32 24 --vary samples=1 --reference r.exr", 1);
    assert!(stderr(&output).contains("-r 24 18"), "{}", stderr(&output));
}
