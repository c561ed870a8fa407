//! `comber reference`: errors that are as stated, pictures that do not depend on how they came about.

mod common;

use comber::film::exr_output;
use common::command::{comber, expect, number, stderr, with_scene};
use common::own;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

fn json(directory: &Path, arguments: &str) -> Value {
    serde_json::from_slice(&expect(directory, &format!("{arguments} --json"), 0).stdout).unwrap()
}

/// The stated error is the one that a much better picture shows, and standard errors tell it from bias.
#[test]
fn errors_are_as_stated() {
    let dir = with_scene();
    let report = json(dir.path(), "reference box.dae -r 32 24 --rel-error 0.03 -o a.exr");
    let stated = number(&report, "/relative_error");
    assert!(stated <= 0.03 && report["reached"] == true && number(&report, "/rounds") >= 16.0);
    expect(dir.path(), "render box.dae -r 32 24 -s 8192 --seed 77 -o truth.exr -q", 0);
    let diff = json(dir.path(), "diff a.exr truth.exr");
    let shown = number(&diff, "/figures/relmse/rgb").sqrt();
    println!("stated {stated:.5}, shown {shown:.5}");
    assert!((stated / shown - 1.0).abs() < 0.1, "stated {stated}, shown {shown}");
    let z = ["/figures/bias/bias2/value", "/figures/bias/bias2/error"].map(|at| number(&diff, at));
    assert!((z[0] / z[1]).abs() < 4.0, "{z:?}");
    let square = number(&diff, "/figures/z_test/mean_square/value");
    assert!((0.85..1.3).contains(&square), "mean z² {square}");
    let samples = number(&report, "/samples") as u32;
    let picture = exr_output::read(&dir.path().join("a.exr")).unwrap();
    assert!(picture.sample_count.unwrap().iter().all(|&count| count == samples));
    assert_eq!(picture.provenance["reference"]["rounds"], report["rounds"]);
}

#[test]
fn threads_and_waves_change_no_byte() {
    let mut first: Option<Vec<Vec<u8>>> = None;
    for speed in ["-t 1", "-t 2", "-t 2 --wave 7", "--simd baseline"] {
        let dir = with_scene();
        expect(dir.path(), &format!("reference box.dae -r 16 12 --rel-error 0.2 -q {speed}"), 0);
        let bytes = ["reference.exr", "reference.sums"].map(|name| fs::read(dir.path().join(name)).unwrap()).to_vec();
        assert!(*first.get_or_insert_with(|| bytes.clone()) == bytes, "{speed}");
    }
}

const LINE: &str = "reference box.dae -r 32 24 -q";

#[test]
fn resumed_is_uninterrupted() {
    let dir = with_scene();
    let picture = |name: &str| fs::read(dir.path().join(name)).unwrap();
    expect(dir.path(), &format!("{LINE} --rel-error 0.04 -o whole.exr"), 0);
    expect(dir.path(), &format!("{LINE} --rel-error 0.2 -o parts.exr"), 0);
    assert!(picture("parts.exr") != picture("whole.exr"));
    expect(dir.path(), &format!("{LINE} --rel-error 0.04 -o parts.exr --resume"), 0);
    assert!(picture("parts.exr") == picture("whole.exr"));
    expect(dir.path(), &format!("{LINE} --rel-error 0.04 -o parts.exr --resume"), 0);
    assert!(picture("parts.exr") == picture("whole.exr"), "nothing is left to do");

    // Time is up in the middle of something: the picture so far, or none yet.
    let output =
        comber(dir.path(), &format!("{LINE} --rel-error 0.0001 --max-time 150ms -o timed.exr")).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("time is up"), "{}", stderr(&output));
    expect(dir.path(), &format!("{LINE} --rel-error 0.04 -o timed.exr --resume"), 0);
    // Had more been rendered than 0.04 takes, that would have been kept.
    let rounds =
        |name: &str| exr_output::read(&dir.path().join(name)).unwrap().provenance["reference"]["rounds"].clone();
    assert!(rounds("timed.exr") != rounds("whole.exr") || picture("timed.exr") == picture("whole.exr"));
    // Without --resume all begins anew.
    expect(dir.path(), &format!("{LINE} --rel-error 0.04 -o timed.exr"), 0);
    assert!(picture("timed.exr") == picture("whole.exr"));
}

#[cfg(unix)]
#[test]
fn an_interruption_leaves_the_picture_so_far() {
    use std::time::{Duration, Instant};
    let dir = with_scene();
    let long = format!("{LINE} --rel-error 0.0001 -o a.exr");
    let child = comber(dir.path(), &long).stderr(Stdio::piped()).spawn().unwrap();
    // Long enough for a few rounds of 12 thousand paths.
    std::thread::sleep(Duration::from_millis(1500));
    let start = Instant::now();
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert!(start.elapsed() < Duration::from_secs(60));
    assert!(stderr(&output).contains("--resume goes on"), "{}", stderr(&output));
    let rounds = exr_output::read(&dir.path().join("a.exr")).unwrap().provenance["reference"]["rounds"].clone();
    assert!(rounds.as_u64().unwrap() >= 2);
    let report = json(dir.path(), &format!("{LINE} --rel-error 0.5 -o a.exr --resume").replace(" -q", ""));
    assert_eq!(report["earlier_rounds"], rounds);
}

#[test]
fn sums_that_cannot_be_gone_on_from_are_refused() {
    let dir = with_scene();
    let line = format!("{LINE} --rel-error 0.3 -o a.exr");
    expect(dir.path(), &line, 0);
    let refused = |line: &str, said: &str| {
        let output = expect(dir.path(), line, 1);
        assert!(stderr(&output).contains("a.sums") && stderr(&output).contains(said), "{}", stderr(&output));
    };
    refused(&format!("{line} --resume --seed 4"), "options.seed is 0 there and 4 here");
    refused(&format!("{line} --resume -m 2"), "options.max_depth is 5 there and 2 here");
    fs::copy(own("cornell_spheres.dae"), dir.path().join("other.dae")).unwrap();
    refused(&format!("{line} --resume").replace("box.dae", "other.dae"), "contents is");
    let sums = dir.path().join("a.sums");
    let bytes = fs::read(&sums).unwrap();
    for (end, flip) in [(bytes.len() - 1, 0), (100, 0), (0, 0), (bytes.len(), 200)] {
        let mut damaged = bytes[..end].to_vec();
        if flip > 0 {
            damaged[flip] ^= 1;
        }
        fs::write(&sums, damaged).unwrap();
        refused(&format!("{line} --resume"), "sums of renders");
    }
    fs::remove_file(&sums).unwrap();
    expect(dir.path(), &format!("{line} --resume"), 0);
}

#[test]
fn misuse_is_named() {
    let dir = with_scene();
    for (arguments, said) in [
        ("box.dae", "--rel-error"),
        ("box.dae --rel-error 0", "must be a number"),
        ("box.dae --rel-error 2", "must be a number"),
        ("box.dae --rel-error 0.1 -o a.png", ".exr"),
        ("box.dae --rel-error 0.1 --max-time 5", "as in 500ms"),
        ("box.dae --rel-error 0.1 --integrator bvh-cost", "bvh-cost"),
        ("box.dae --rel-error 0.1 -a 4 0.1", "-a"),
    ] {
        let output = expect(dir.path(), &format!("reference {arguments}"), 2);
        assert!(stderr(&output).contains(said), "{arguments}: {}", stderr(&output));
    }
    let output = expect(dir.path(), "reference missing.dae --rel-error 0.1", 1);
    assert!(stderr(&output).contains("missing.dae"), "{}", stderr(&output));
    let names: Vec<_> = fs::read_dir(dir.path()).unwrap().map(|f| f.unwrap().file_name()).collect();
    assert_eq!(names, ["box.dae"]);
}
