//! The command line, as its users see it: arguments, messages, exit statuses, files.

use comber::film::exr_output;
use comber::film::picture::Picture;
use serde_json::{Value, json};
use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// `comber` in `directory`, with a fixed time in what it writes.
fn comber(directory: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_comber"));
    command.current_dir(directory).env("SOURCE_DATE_EPOCH", "1000000000").stdin(Stdio::null());
    command.env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"));
    command
}

fn run<S: AsRef<OsStr>>(directory: &Path, arguments: impl IntoIterator<Item = S>) -> Output {
    comber(directory).args(arguments).output().unwrap()
}

/// Runs a command line without quotes.
fn line(directory: &Path, line: &str) -> Output {
    run(directory, line.split_whitespace())
}

fn directory() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn names(directory: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(directory).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// A render that takes no time.
const TINY: &str = "render proc:cubes,tris=12 -r 16 12 -s 1";

/// A render that nobody waits for.
const ENDLESS: &str = "render proc:cubes,tris=12 -r 64 48 -s 2000000000 -o a.png -o a.exr";

#[test]
fn help_and_version_are_no_errors() {
    let dir = directory();
    for arguments in [
        "--help",
        "-h",
        "render -h",
        "render --help",
        "info --help",
        "bvh --help",
        "bench --help",
        "help render",
        "mesh --help",
        "diff --help",
        "cache --help",
    ] {
        let output = line(dir.path(), arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments}");
        assert!(String::from_utf8(output.stdout).unwrap().contains("Examples:"), "{arguments}");
    }
    for arguments in ["--version", "-V", "render --version"] {
        let output = line(dir.path(), arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments}");
        assert!(String::from_utf8(output.stdout).unwrap().trim().ends_with(env!("CARGO_PKG_VERSION")), "{arguments}");
    }
}

#[test]
fn misuse_says_what_is_allowed() {
    let dir = directory();
    for (arguments, message) in [
        ("", "Usage"),
        ("paint", "unrecognized subcommand 'paint'"),
        ("render a.dae b.dae", "unexpected argument 'b.dae'"),
        ("render --scene a.dae b.dae", "cannot be used with"),
        ("render --what", "unexpected argument '--what'"),
        ("render -s 0", "from 1 to 2147483647"),
        ("render -s -5", "from 1 to 2147483647"),
        ("render -s 99999999999999999999", "from 1 to 2147483647"),
        ("render -s 1.5", "from 1 to 2147483647"),
        ("render -l 0", "from 1 to 4096"),
        ("render -l 4097", "from 1 to 4096"),
        ("render -m -1", "from 0 to 65536"),
        ("render -m 65537", "from 0 to 65536"),
        ("render -t 0", "from 1 to 1024"),
        ("render -t 1025", "from 1 to 1024"),
        ("render --wave 0", "from 1 to 16777216"),
        ("render --seed -1", "from 0 to 4294967295"),
        ("render -r 0 5", "from 1 to 65536"),
        ("render -r 5 65537", "from 1 to 65536"),
        ("render -r 640", "2 values required"),
        ("render -p 1 2 3", "4 values required"),
        ("render -p 0 0 0 5", "the cell (-p) is empty"),
        ("render -r 10 10 -p 5 5 5 6", "the frame (-r) has 10 × 10 pixels"),
        ("render -a 16", "2 values required"),
        ("render -a 0 0.05", "'0', the BATCH of -a, must be a whole number from 1"),
        ("render -a 16 0", "'0', the TOLERANCE of -a, must be a finite number above 0"),
        ("render -a 16 nan", "must be a finite number above 0"),
        ("render -a 16 -0.1", "must be a finite number above 0"),
        ("render --confidence t", "--adaptive"),
        ("render -s 8 -a 4 0.1 --min-samples 9", "--min-samples 9 is more than the 8 samples"),
        ("render -H --direct mis", "-H asks for hemisphere sampling"),
        ("render --direct magic", "hemisphere, light, bsdf, mis"),
        ("render --integrator magic", "path, direct, zero-bounce, one-bounce, indirect-only, normals, bvh-cost"),
        ("render --roulette fixed:0", "above 0 and at most 1"),
        ("render --roulette fixed:1.5", "above 0 and at most 1"),
        ("render --roulette efficiency:0", "above 0 and at most 1000"),
        ("render --clamp-indirect 0", "finite number above 0"),
        ("render --clamp-indirect -1", "finite number above 0"),
        ("render --clamp-indirect nan", "finite number above 0"),
        ("render --roulette sometimes", "off, fixed:P, throughput[:START] or efficiency[:FACTOR]"),
        ("render --xfov 180", "above 0 and below 180"),
        ("render --yfov -10", "above 0 and below 180"),
        ("render --vp 1 2", "three finite numbers"),
        ("render --vp 1,2,inf", "three finite numbers"),
        ("render -c a.info --camera file", "cannot be used with"),
        ("render --exposure 65", "from -64 to 64"),
        ("render -o picture.jpg", "picture.jpg"),
        ("render -o picture", "picture"),
        ("render -o a.png -f a.png", "given twice"),
        ("render --rate a.exr", "must end in .png"),
        ("render -o a.png --rate a.png", "cannot be the same file"),
        ("render --bvh perfect", "fast, default, best"),
        ("render --accel brute --bvh best", "--accel brute builds none"),
        ("bvh --depth -1", "from 0 to 1024"),
        ("bvh --depth 2 -o a.jpg", "a.jpg"),
        ("bvh -s 4", "unexpected argument '-s'"),
    ] {
        let output = line(dir.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "comber {arguments}: {}", stderr(&output));
        assert!(stderr(&output).contains(message), "comber {arguments}: {}", stderr(&output));
        assert!(output.stdout.is_empty(), "comber {arguments}");
    }
    assert!(names(dir.path()).is_empty(), "misuse leaves nothing behind");
}

#[test]
fn frames_that_no_memory_holds_are_misuse() {
    let dir = directory();
    let output = line(dir.path(), "render -r 65536 65536");
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    for part in ["4,294,967,296 pixels", "GiB", "16384 × 16384", "-p"] {
        assert!(stderr(&output).contains(part), "{}", stderr(&output));
    }
}

#[test]
fn a_cell_of_such_a_frame_renders() {
    let dir = directory();
    let output = line(dir.path(), "render -r 65536 65536 -p 32000 32000 12 8 -s 1 -q -o a.exr -o a.png");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let picture = exr(&dir.path().join("a.exr"));
    assert_eq!((picture.x, picture.width, picture.height, picture.full), (32000, 12, 8, (65536, 65536)));
}

#[test]
fn a_wrong_source_date_is_misuse() {
    let dir = directory();
    for wrong in ["", "yesterday", "-1", "253402300800"] {
        let output = comber(dir.path()).arg("render").env("SOURCE_DATE_EPOCH", wrong).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{wrong}");
        assert!(stderr(&output).contains("SOURCE_DATE_EPOCH"), "{}", stderr(&output));
    }
}

/// That the arguments are accepted shows in the failure: it is about the file.
#[test]
fn command_lines_of_the_course_are_accepted() {
    let dir = directory();
    for arguments in [
        "-t 8 -s 64 -l 32 -m 6 -r 480 360 -f out.png missing.dae",
        "-t 8 -s 16 -l 8 -H -f out.png -r 480 360 missing.dae",
        "-t 8 -s 2048 -a 64 0.05 -l 1 -m 5 -r 480 360 -f out.png missing.dae",
        "-t8 -s64 -p 10 20 30 40 -f out.png missing.dae",
        "missing.dae -s 1",
        "-s 1 -s 2 -a 1 0.1 -a 2 0.2 -r 1 2 -r 3 4 missing.dae",
        "--vp -1 2 -3 --vi 0,0,0 --vu 0 1 0 --yfov 40 missing.dae",
        "--vp=-1,2,-3 --vi -1e-3,0,0 missing.dae",
        "--spp 1 --nthreads 2 --outfile out.exr --size 8 8 --exposure -1.5 --scene missing.dae",
        "-s 4 -- missing.dae",
    ] {
        for command in ["render", "info"] {
            let output = line(dir.path(), &format!("{command} {arguments}"));
            assert_eq!(output.status.code(), Some(1), "comber {command} {arguments}: {}", stderr(&output));
            assert!(stderr(&output).contains("missing.dae"), "comber {command} {arguments}: {}", stderr(&output));
        }
    }
    assert!(names(dir.path()).is_empty(), "a failure leaves nothing behind");
}

#[test]
fn a_render_leaves_a_png_and_an_exr() {
    let dir = directory();
    let output = line(dir.path(), TINY);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_eq!(names(dir.path()), ["comber.exr", "comber.png"]);
    let summary = String::from_utf8(output.stdout).unwrap();
    for word in ["cubes", "16 × 12", "camera", "bounce", "shadow", "ns/row", "comber.png", "comber.exr"] {
        assert!(summary.contains(word), "{word}: {summary}");
    }
}

#[test]
fn adaptive_renders_leave_a_map_of_the_rate() {
    let dir = directory();
    let output = line(dir.path(), &format!("{TINY} -s 8 -a 4 0.1 -f out.png"));
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_eq!(names(dir.path()), ["out.png", "out_rate.png"]);
}

#[test]
fn json_is_all_that_is_printed() {
    let dir = directory();
    for (arguments, keys) in [
        (TINY.to_owned(), ["plan", "stats", "seconds", "pictures"]),
        (TINY.replace("render", "info"), ["plan", "bvh", "scene", "camera"]),
        ("bvh proc:cubes,tris=12 -r 16 12 --depth 1".to_owned(), ["depth", "boxes", "bvh", "pictures"]),
    ] {
        let output = line(dir.path(), &format!("{arguments} --json"));
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        for key in keys {
            assert!(!report[key].is_null(), "comber {arguments}: {key}");
        }
    }
}

#[test]
fn quiet_is_quiet() {
    let dir = directory();
    let output = line(dir.path(), &format!("{TINY} -q"));
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(output.stdout.is_empty());
}

#[test]
fn info_and_bvh_do_what_they_say() {
    let dir = directory();
    let output = line(dir.path(), &TINY.replace("render", "info"));
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    for word in ["Stages", "Columns", "Memory", "Camera", "bytes a path"] {
        assert!(text.contains(word), "{word}: {text}");
    }
    assert!(names(dir.path()).is_empty(), "info writes nothing");
    let output = line(dir.path(), "bvh proc:cubes,tris=12 -r 16 12 --depth 0 -o tree.png");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_eq!(names(dir.path()), ["tree.png"]);
}

#[test]
fn files_that_cannot_be_written_fail_at_once() {
    let dir = directory();
    let start = Instant::now();
    let output = line(dir.path(), "render -s 2000000000 -o missing/a.png");
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("missing"), "{}", stderr(&output));
    assert!(start.elapsed() < Duration::from_secs(10));
}

#[test]
fn a_failure_leaves_the_earlier_result() {
    let dir = directory();
    std::fs::write(dir.path().join("a.png"), "earlier").unwrap();
    let output = line(dir.path(), "render -o a.png missing.dae");
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert_eq!(names(dir.path()), ["a.png"]);
    assert_eq!(std::fs::read(dir.path().join("a.png")).unwrap(), b"earlier");
}

#[test]
fn speed_options_change_no_byte() {
    let mut first: Option<Vec<Vec<u8>>> = None;
    for speed in ["-t 1", "-t 2", "-t 2 --wave 7", "--simd baseline", "-t 1 --wave 1000"] {
        let dir = directory();
        let output = line(dir.path(), &format!("{TINY} -s 4 {speed} -o a.png -o a.exr"));
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let bytes = ["a.png", "a.exr"].map(|name| std::fs::read(dir.path().join(name)).unwrap()).to_vec();
        assert!(*first.get_or_insert_with(|| bytes.clone()) == bytes, "{speed}");
    }
}

/// A scene of the project's own, whose path has no space in it for [`line`] to trip over.
fn scene(directory: &Path, name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    std::fs::copy(path, directory.join(name)).unwrap();
    name.to_owned()
}

fn exr(path: &Path) -> Picture {
    exr_output::read(path).unwrap()
}

/// Runs a render that must succeed, and gives its report.
fn report(directory: &Path, arguments: &str) -> Value {
    let output = line(directory, &format!("render --json {arguments}"));
    assert_eq!(output.status.code(), Some(0), "{arguments}: {}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn every_flag_of_the_course_reaches_the_picture() {
    let dir = directory();
    let scene = scene(dir.path(), "cornell_spheres.dae");
    let settings = "50 35 1.4286 0.1 100\n0 0 4 0 0 0\n1 1 4 0.1 10\n1 0 0 0 1 0 0 0 1\n36 24 40\n";
    std::fs::write(dir.path().join("view.info"), settings).unwrap();
    let options = |arguments: &str| report(dir.path(), &format!("{arguments} {scene}"))["plan"]["options"].clone();

    let all = options("-t 2 -s 5 -l 3 -m 2 -r 24 18 -f a.exr");
    for (name, value) in
        [("threads", 2), ("samples", 5), ("light_samples", 3), ("max_depth", 2), ("width", 24), ("height", 18)]
    {
        assert_eq!(all[name], json!(value), "{name}");
    }
    assert_eq!((all["direct"].as_str(), all["adaptive"].is_null()), (Some("mis"), true));
    let picture = exr(&dir.path().join("a.exr"));
    assert_eq!((picture.width, picture.height), (24, 18));
    assert!(picture.sample_count.unwrap().iter().all(|&n| n == 5));

    assert_eq!(options("-r 24 18 -s 1 -H -f a.png")["direct"], json!("hemisphere"));

    let adaptive = options("-r 24 18 -s 40 -a 8 0.5 -f b.png -f b.exr");
    for (name, value) in [("batch", json!(8)), ("tolerance", json!(0.5)), ("confidence", json!("t"))] {
        assert_eq!(adaptive["adaptive"][name], value);
    }
    let counts = exr(&dir.path().join("b.exr")).sample_count.unwrap();
    assert!(counts.iter().any(|&n| n < 40) && counts.iter().all(|&n| n % 8 == 0), "{counts:?}");
    assert!(dir.path().join("b_rate.png").exists());

    options("-r 24 18 -s 5 -p 4 3 10 8 -l 3 -m 2 -f c.exr");
    let cell = exr(&dir.path().join("c.exr"));
    assert_eq!((cell.x, cell.y, cell.width, cell.height, cell.full), (4, 3, 10, 8, (24, 18)));
    let row = |y: usize| &picture.beauty[(3 + y) * 24 + 4..][..10];
    assert!((0..8).all(|y| &cell.beauty[y * 10..][..10] == row(y)), "the pixels of the whole frame");

    let viewed = options("-s 1 -c view.info -f d.exr");
    assert_eq!((&viewed["width"], &viewed["height"]), (&json!(36), &json!(24)), "the settings' size");
    let camera = exr(&dir.path().join("d.exr")).provenance["camera"].clone();
    assert_eq!(camera["position"], json!([0.0, 0.0, 4.0]));
    assert_eq!(options("-s 1 -c view.info -r 12 8 -f d.exr")["width"], json!(12), "-r counts more");
}

#[test]
fn every_integrator_strategy_and_rule_renders_every_layer() {
    let dir = directory();
    let scene = scene(dir.path(), "cornell_quad_light.dae");
    let words = [
        ("--integrator", "path direct zero-bounce one-bounce indirect-only normals bvh-cost"),
        ("--direct", "hemisphere light bsdf mis"),
        ("--roulette", "off fixed:0.5 throughput throughput:1 efficiency efficiency:3"),
        ("--clamp-indirect", "0.5 1e30"),
        ("--normals", "smooth flat"),
        ("--accel", "bvh brute"),
        ("--bvh", "fast default best"),
        ("--camera", "course course-pixels file"),
    ];
    for (option, values) in words {
        for value in values.split(' ') {
            report(dir.path(), &format!("-r 16 12 -s 2 {option} {value} -o a.png -o a.exr {scene}"));
            let picture = exr(&dir.path().join("a.exr"));
            // Where only the way of rays is counted, nothing is known of what they hit.
            let hits = value != "bvh-cost";
            let layers = [picture.albedo.is_some(), picture.normal.is_some(), picture.depth.is_some()];
            assert_eq!(layers, [hits; 3], "{option} {value}");
            assert!(picture.variance.is_some(), "{option} {value}");
        }
    }
}

#[test]
fn other_words_for_the_same_give_the_same_bytes() {
    let dir = directory();
    let scene = scene(dir.path(), "cornell_spheres.dae");
    let bytes = |arguments: &str| {
        report(dir.path(), &format!("-r 16 12 -s 2 {arguments} -o a.png -o a.exr {scene}"));
        ["a.png", "a.exr"].map(|name| std::fs::read(dir.path().join(name)).unwrap())
    };
    for (one, other) in [
        ("-H", "--direct hemisphere"),
        ("-l 4", "--light-samples 4"),
        ("-m 2", "--depth 2"),
        ("--spp 3", "-s 3"),
        ("-t 1 --wave 5", "--nthreads 2"),
        ("--roulette throughput", "--roulette throughput:3"),
        ("--roulette efficiency", "--roulette efficiency:1"),
        ("", "--scene other.dae"),
    ] {
        if let Some((_, name)) = other.split_once("--scene ") {
            std::fs::copy(dir.path().join(&scene), dir.path().join(name)).unwrap();
            let [png, _] = bytes(one);
            report(dir.path(), "-r 16 12 -s 2 -o b.png --scene other.dae");
            assert!(std::fs::read(dir.path().join("b.png")).unwrap() == png, "{other}");
        } else {
            assert!(bytes(one) == bytes(other), "{one} and {other}");
        }
    }
    assert!(bytes("") != bytes("--seed 1"));
}

/// Files that cannot be used, with the place and words of the message.
fn hostile_files() -> Vec<(&'static str, Vec<u8>, &'static str)> {
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                  element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let ply = |body: &str| format!("{header}{body}").into_bytes();
    let binary = header.replace("ascii", "binary_little_endian").into_bytes();
    let noise: Vec<u8> = (0..3000u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8 | 0x80).collect();
    let huge = header.replace("vertex 3", "vertex 18446744073709551615").into_bytes();
    let nested = format!("<COLLADA>{}", "<node>".repeat(100_000)).into_bytes();
    vec![
        ("empty.dae", Vec::new(), "empty.dae:1:1: the file is empty"),
        ("broken.dae", b"<COLLADA>\n<mesh></COLLADA>".into(), "broken.dae:2:7: not well-formed XML"),
        ("noise.dae", noise.clone(), "noise.dae:1:1: a byte sequence that is not UTF-8"),
        ("deep.dae", nested, "deep.dae:"),
        ("other.dae", b"<html></html>".into(), "other.dae:1:1: "),
        ("empty.ply", Vec::new(), "empty.ply:1: the file is empty"),
        ("noise.ply", noise.clone(), "noise.ply:1: this is no PLY file"),
        ("word.ply", ply("0 0 0\n1 0 zero\n0 1 0\n3 0 1 2\n"), "word.ply:11: “zero”"),
        ("index.ply", ply("0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n"), "index.ply:13: "),
        ("short.ply", ply("0 0 0\n1 0 0\n"), "short.ply:"),
        ("cut.ply", [binary, vec![0; 17]].concat(), "cut.ply: byte "),
        ("huge.ply", huge, "huge.ply"),
        ("empty.obj", Vec::new(), "empty.obj: there are no faces"),
        ("noise.obj", noise, "noise.obj"),
        ("index.obj", b"v 0 0 0\nv 1 0 0\nf 1 2 9\n".into(), "index.obj:3: vertex index 9"),
        ("nan.obj", b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n".into(), "nan.obj:2: "),
    ]
}

#[test]
fn hostile_files_fail_with_their_place_and_leave_the_earlier_result() {
    let dir = directory();
    std::fs::write(dir.path().join("a.png"), "earlier").unwrap();
    for (name, bytes, message) in hostile_files() {
        std::fs::write(dir.path().join(name), bytes).unwrap();
        for arguments in [format!("render -o a.png {name}"), format!("info {name}"), format!("bvh -o a.png {name}")] {
            let output = line(dir.path(), &arguments);
            let said = stderr(&output);
            assert_eq!(output.status.code(), Some(1), "{arguments}: {said}");
            assert!(said.contains(message), "{arguments}: {said}");
            assert!(!said.contains("panicked") && !said.contains("bug in comber"), "{arguments}: {said}");
            assert!(said.len() < 1000, "{arguments}: {} bytes of message", said.len());
            assert!(output.stdout.is_empty(), "{arguments}");
        }
        std::fs::remove_file(dir.path().join(name)).unwrap();
    }
    assert_eq!(names(dir.path()), ["a.png"]);
    assert_eq!(std::fs::read(dir.path().join("a.png")).unwrap(), b"earlier");
}

#[test]
fn outputs_that_cannot_be_written_fail_before_the_render() {
    let dir = directory();
    std::fs::create_dir(dir.path().join("folder.png")).unwrap();
    std::fs::write(dir.path().join("file"), "earlier").unwrap();
    std::fs::write(dir.path().join("good.png"), "earlier").unwrap();
    for arguments in ["-o folder.png", "-o file/a.png", "-o good.png -o missing/a.exr", "-o a.png --rate missing/r.png"]
    {
        let start = Instant::now();
        let output = line(dir.path(), &format!("render proc:cubes,tris=12 -s 2000000000 {arguments}"));
        assert_eq!(output.status.code(), Some(1), "{arguments}: {}", stderr(&output));
        assert!(stderr(&output).contains("cannot"), "{arguments}: {}", stderr(&output));
        assert!(start.elapsed() < Duration::from_secs(10), "{arguments}");
        assert_eq!(names(dir.path()), ["file", "folder.png", "good.png"], "{arguments}");
        assert_eq!(std::fs::read(dir.path().join("good.png")).unwrap(), b"earlier");
    }
}

#[cfg(unix)]
#[test]
fn names_need_not_be_text() {
    use std::os::unix::ffi::OsStrExt as _;
    let dir = directory();
    let output = comber(dir.path()).args(TINY.split(' ')).arg("-o").arg(OsStr::from_bytes(b"a\xff.png")).output();
    let output = output.unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(dir.path().join(OsStr::from_bytes(b"a\xff.png")).exists());
}

#[cfg(unix)]
#[test]
fn a_reader_that_leaves_is_no_failure() {
    let dir = directory();
    let mut child = comber(dir.path()).args(TINY.split(' ')).stdout(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

#[cfg(unix)]
mod signals {
    use super::*;
    use std::process::Child;

    fn signal(child: &Child, name: &str) {
        let status = Command::new("kill").args(["-s", name, &child.id().to_string()]).status().unwrap();
        assert!(status.success());
    }

    /// An endless render that has begun, as far as one can tell from outside.
    fn endless(directory: &Path) -> Child {
        let child = comber(directory).args(ENDLESS.split(' ')).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        std::thread::sleep(Duration::from_secs(2));
        child.unwrap()
    }

    #[test]
    fn the_first_keeps_what_there_is() {
        for name in ["INT", "TERM"] {
            let dir = directory();
            let child = endless(dir.path());
            signal(&child, name);
            let output = child.wait_with_output().unwrap();
            assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
            assert!(stderr(&output).contains("the files hold"), "{}", stderr(&output));
            assert_eq!(names(dir.path()), ["a.exr", "a.png"]);
            let picture = exr(&dir.path().join("a.exr"));
            assert_eq!((picture.width, picture.height), (64, 48));
            assert!(picture.beauty.iter().flatten().all(|c| c.is_finite()));
            let counts = picture.sample_count.unwrap();
            let sum: u64 = counts.iter().map(|&n| u64::from(n)).sum();
            assert!(sum > 0);
            assert_eq!(picture.provenance["stopped"], json!(true));
            assert_eq!(picture.provenance["samples"], json!(sum), "the file says how many samples it holds");
            let png = image::open(dir.path().join("a.png")).unwrap();
            assert_eq!((png.width(), png.height()), (64, 48));
        }
    }

    #[test]
    fn adaptive_renders_keep_what_there_is() {
        let dir = directory();
        let arguments = "render proc:cubes,tris=12 -r 64 48 -s 2000000000 -a 16 1e-9 -o a.exr -o a.png";
        let child = comber(dir.path()).args(arguments.split(' ')).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        let child = child.unwrap();
        std::thread::sleep(Duration::from_secs(2));
        signal(&child, "INT");
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
        assert_eq!(names(dir.path()), ["a.exr", "a.png", "a_rate.png"]);
        assert!(exr(&dir.path().join("a.exr")).beauty.iter().flatten().all(|c| c.is_finite()));
    }

    #[test]
    fn the_second_ends_at_once_and_leaves_no_temporary_file() {
        let dir = directory();
        let child = endless(dir.path());
        signal(&child, "INT");
        signal(&child, "TERM");
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
        assert!(names(dir.path()).iter().all(|name| !name.ends_with(".tmp")), "{:?}", names(dir.path()));
    }
}
