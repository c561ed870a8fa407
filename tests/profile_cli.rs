//! `comber profile`, as its users see it: tables, files, comparisons, and what goes wrong.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

const TINY: &str = "profile proc:cubes,tris=200 -r 32 24 -s 4 --repeats 2 --threads 2";

fn line(directory: &Path, line: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_comber"));
    command.current_dir(directory).stdin(Stdio::null()).args(line.split_whitespace());
    command.env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR")).env("XDG_DATA_HOME", directory.join("data"));
    command.output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn succeeds(directory: &Path, arguments: &str) -> Output {
    let output = line(directory, arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments}: {}", stderr(&output));
    output
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", stdout(output)))
}

fn directory() -> TempDir {
    tempfile::tempdir().unwrap()
}

#[test]
fn the_table_names_all_stages_and_where_the_rest_went() {
    let dir = directory();
    let text = stdout(&succeeds(dir.path(), TINY));
    let parts = [
        "generate",
        "traverse",
        "shade",
        "shadow",
        "roulette",
        "retire",
        "bounce 1",
        "ns/row",
        "depth first",
        "not accounted for",
        "bound by",
        "lanes active",
        "queue full",
        "B read/row",
    ];
    for part in parts {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(std::fs::read_dir(dir.path()).unwrap().next().is_none(), "no picture without -o");
}

#[test]
fn json_has_every_number_and_counts_agree_with_rays() {
    let dir = directory();
    let value = json(&succeeds(dir.path(), &format!("{TINY} --json")));
    let (rays, profile) = (&value["stats"]["rays"], &value["profile"]);
    let row = |name: &str| {
        let rows = profile["stages"].as_array().unwrap();
        rows.iter().find(|row| row["stage"] == name).unwrap_or_else(|| panic!("{name}")).clone()
    };
    assert_eq!(row("shadow")["rows_in"], rays["shadow"]);
    let traced = row("traverse")["rows_in"].as_u64().unwrap();
    assert_eq!(traced, rays["camera"].as_u64().unwrap() + rays["bounce"].as_u64().unwrap());
    assert!(row("traverse")["visits"]["nodes"].as_f64().unwrap() > 0.0);
    assert!(value["control"]["ratio"]["rate"]["median"].as_f64().unwrap() > 0.0);
    assert!(value["ceilings"]["memory"].as_array().unwrap().len() >= 4);
    assert_eq!(value["bounds"].as_array().unwrap().len(), profile["stages"].as_array().unwrap().len());
    // Either there are counters, or there is a reason.
    assert_eq!(value["no_counters"].is_string(), row("shade")["counters"].is_null());
}

#[test]
fn files_are_whole_and_need_no_others() {
    let dir = directory();
    let out = succeeds(dir.path(), &format!("{TINY} --html r.html --trace t.json --folded f.txt --maps m -o p.png"));
    for name in
        ["r.html", "t.json", "f.txt", "m_time.png", "m_visits.png", "m_bounces.png", "m_samples.png", "m.exr", "p.png"]
    {
        assert!(dir.path().join(name).metadata().unwrap().len() > 0, "{name}");
        assert!(stdout(&out).contains(name), "{name} is reported");
    }
    let html = std::fs::read_to_string(dir.path().join("r.html")).unwrap();
    for part in ["http://", "https://", "<script", "<link", "@import", "url("] {
        let found = html.replace("http://www.w3.org/2000/svg", "").contains(part);
        assert!(!found, "the report refers to something else: {part}");
    }
    assert!(html.contains("--trace t.json"), "the exact command");
    let trace: Vec<Value> = serde_json::from_str(&std::fs::read_to_string(dir.path().join("t.json")).unwrap()).unwrap();
    let tracks = trace.iter().filter(|event| event["name"] == "thread_name").count();
    assert_eq!(tracks, 3, "two workers and the main thread");
    let folded = std::fs::read_to_string(dir.path().join("f.txt")).unwrap();
    assert!(
        folded
            .lines()
            .all(|line| line.starts_with("comber;") && line.rsplit(' ').next().unwrap().parse::<u64>().is_ok())
    );
}

#[test]
fn runs_are_kept_and_compared_stage_by_stage() {
    let dir = directory();
    succeeds(dir.path(), &format!("{TINY} --save before"));
    let text = stdout(&succeeds(dir.path(), &format!("{TINY} --against before")));
    for part in ["traverse/0, waves", "shade/1, waves", "render, depth-first", "before", "ratio"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let unknown = line(dir.path(), &format!("{TINY} --against nothing"));
    assert_eq!(unknown.status.code(), Some(1));
    assert!(stderr(&unknown).contains("nothing.json"));
    assert_eq!(line(dir.path(), &format!("{TINY} --save ../x")).status.code(), Some(2));
}

#[test]
fn a_profile_that_cannot_be_written_does_not_cost_the_picture() {
    let dir = directory();
    for (option, says) in [("--html no/such/r.html", "no/such/r.html"), ("--trace /dev/full", "/dev/full")] {
        if option.contains("/dev/full") && !Path::new("/dev/full").exists() {
            println!("skipped: no /dev/full here");
            continue;
        }
        let output = line(dir.path(), &format!("{TINY} {option} --folded f.txt -o p.png"));
        assert_eq!(output.status.code(), Some(1), "{option}");
        assert!(stderr(&output).contains(says), "{}", stderr(&output));
        assert!(!stderr(&output).contains("panicked"));
        for name in ["p.png", "f.txt"] {
            let path = dir.path().join(name);
            assert!(path.metadata().unwrap().len() > 0, "{name} is there all the same");
            std::fs::remove_file(path).unwrap();
        }
    }
}

#[test]
fn misuse_is_told_apart() {
    let dir = directory();
    for arguments in ["profile --repeats 0", "profile --html", "profile --nonsense", "profile --save a/b"] {
        assert_eq!(line(dir.path(), arguments).status.code(), Some(2), "{arguments}");
    }
    let help = stdout(&succeeds(dir.path(), "profile --help"));
    assert!(help.contains("--against") && help.contains("Examples:"));
}

/// Normals, costs of the tree, parts of the frame, adaptive sampling: each has stages of its own.
#[test]
fn any_render_can_be_profiled() {
    let dir = directory();
    for more in
        ["--integrator normals", "--integrator bvh-cost", "-p 3 4 5 6", "-a 4 0.5 -s 32", "-m 0", "--accel brute", "-H"]
    {
        let value = json(&succeeds(dir.path(), &format!("{TINY} {more} --json --maps m")));
        assert!(value["profile"]["stages"].as_array().unwrap().len() >= 3, "{more}");
        assert!(value["profile"]["unaccounted"].is_f64(), "{more}");
    }
}
