//! `comber diff`, as its users see it; and what it says of renders that differ by noise alone, or by more.

use comber::film::exr_output;
use comber::film::picture::Picture;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

fn line(directory: &Path, line: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_comber"));
    command.current_dir(directory).stdin(Stdio::null()).env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"));
    command.args(line.split_whitespace()).output().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Runs a line that must end with this status.
fn expect(directory: &Path, arguments: &str, status: i32) -> Output {
    let output = line(directory, arguments);
    assert_eq!(output.status.code(), Some(status), "comber {arguments}: {}", stderr(&output));
    output
}

fn figures(directory: &Path, arguments: &str) -> Value {
    let output = expect(directory, &format!("diff {arguments} --json"), 0);
    serde_json::from_str(&stdout(&output)).unwrap()
}

fn number(value: &Value, at: &str) -> f64 {
    value.pointer(at).unwrap_or_else(|| panic!("{at} in {value:#}")).as_f64().unwrap_or_else(|| panic!("{at}"))
}

/// A picture of one colour.
fn flat(width: usize, height: usize, value: f32) -> Picture {
    Picture { width, height, full: (width, height), beauty: vec![[value; 3]; width * height], ..Picture::default() }
}

/// A directory with flat pictures `a.exr` of 0.5 and `b.exr` of 0.25, 16 × 12.
fn two() -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    exr_output::write(&dir.path().join("a.exr"), &flat(16, 12, 0.5)).unwrap();
    exr_output::write(&dir.path().join("b.exr"), &flat(16, 12, 0.25)).unwrap();
    dir
}

#[test]
fn statuses_follow_limits() {
    let dir = two();
    for (arguments, status, message) in [
        ("a.exr b.exr", 0, ""),
        ("a.exr a.exr --max mse=0 --max flip=0 --min psnr=100 --min ssim=0.999999", 0, ""),
        ("a.exr b.exr --max rmse=0.25", 0, ""),
        ("a.exr b.exr --max rmse=0.2499", 1, "rmse is 0.25, more than 0.2499"),
        ("a.exr b.exr --max mse=1 --max relmse=0.5 -q", 1, "relmse is"),
        ("a.exr b.exr --min psnr=20", 1, "psnr is"),
        ("a.exr b.exr --max rmse=0.1 --min ssim=0.999", 1, "ssim is"),
        ("a.exr b.exr --max failing=1", 1, "cannot be known"),
        ("a.exr b.exr --crop 0 0 5 5 --min ssim=0", 1, "cannot be known"),
    ] {
        let output = expect(dir.path(), &format!("diff {arguments}"), status);
        assert!(stderr(&output).contains(message), "{arguments}: {}", stderr(&output));
    }
}

#[test]
fn misuse_says_what_is_allowed() {
    let dir = two();
    for (arguments, message) in [
        ("a.exr", "required"),
        ("a.exr b.exr c.exr", "unexpected argument"),
        ("a.exr b.exr --max beauty=1", "there is no metric 'beauty', but mse, rmse"),
        ("a.exr b.exr --max rmse", "METRIC=VALUE"),
        ("a.exr b.exr --max rmse=nan", "finite number"),
        ("a.exr b.exr --max rmse=", "finite number"),
        ("a.exr b.exr --max ssim=0.9", "use --min ssim=0.9"),
        ("a.exr b.exr --min rmse=0.9", "use --max rmse=0.9"),
        ("a.exr b.exr --crop 0 0 4", "4 values required"),
        ("a.exr b.exr --crop 0 0 0 4", "--crop is empty"),
        ("a.exr b.exr --crop 10 0 7 4", "both pictures hold 16 × 12 pixels at (0, 0)"),
        ("a.exr b.exr --regions 0 3", "from 1 to 64"),
        ("a.exr b.exr --exposure 99", "from -64 to 64"),
        ("a.exr b.exr --epsilon 0", "from 1e-30"),
        ("a.exr b.exr --ppd 0", "from 1 to 1000"),
        ("a.exr b.exr --what", "unexpected argument"),
    ] {
        let output = expect(dir.path(), &format!("diff {arguments}"), 2);
        assert!(stderr(&output).contains(message), "{arguments}: {}", stderr(&output));
        assert!(output.stdout.is_empty(), "{arguments}");
    }
}

#[test]
fn what_cannot_be_compared_fails() {
    let dir = two();
    exr_output::write(&dir.path().join("large.exr"), &flat(17, 12, 0.5)).unwrap();
    exr_output::write(&dir.path().join("nan.exr"), &flat(16, 12, f32::NAN)).unwrap();
    let corner = |x| Picture { x, y: 0, full: (16, 12), ..flat(4, 4, 0.5) };
    exr_output::write(&dir.path().join("left.exr"), &corner(0)).unwrap();
    exr_output::write(&dir.path().join("right.exr"), &corner(12)).unwrap();
    fs::write(dir.path().join("junk.exr"), b"v/1\x01junk").unwrap();
    for (arguments, message) in [
        ("a.exr missing.exr", "missing.exr: cannot read"),
        ("junk.exr b.exr", "junk.exr: "),
        ("a.exr large.exr", "A has 16 × 12 pixels, B has 17 × 12"),
        ("a.exr nan.exr", "no pixel is finite"),
        ("left.exr right.exr", "do not overlap"),
        ("a.exr b.exr --layer Albedo", "no layer or channel 'Albedo'"),
        ("a.exr b.exr --stderr-a large.exr", "large.exr does not hold the same pixels as a.exr"),
        ("a.exr b.exr --html missing/report.html", "there is no directory"),
        ("a.exr b.exr -o missing/", "there is no directory"),
    ] {
        let output = expect(dir.path(), &format!("diff {arguments}"), 1);
        assert!(stderr(&output).contains(message), "{arguments}: {}", stderr(&output));
    }
}

#[test]
fn figures_are_closed_forms() {
    let dir = two();
    let json = figures(dir.path(), "a.exr b.exr");
    for (at, want) in [
        ("/figures/mse/rgb", 0.0625),
        ("/figures/rmse/luminance", 0.25),
        ("/figures/max_abs/each/1", 0.25),
        ("/figures/relmse/rgb", 0.0625 / 0.0725),
        ("/figures/mrse/rgb", 0.0625 / (0.26 * 0.26)),
        ("/figures/mean_a/rgb", 0.5),
        ("/figures/regions/11/difference", 0.25),
        ("/compared/size/0", 16.0),
    ] {
        assert!((number(&json, at) - want).abs() < 1e-7, "{at}: {} instead of {want}", number(&json, at));
    }
    assert_eq!(json["figures"]["regions"].as_array().unwrap().len(), 12);
    assert_eq!(json["figures"]["bias"], Value::Null);
    // Exposure changes what is seen, and nothing else.
    let brighter = figures(dir.path(), "a.exr b.exr --exposure 3");
    assert_eq!(brighter["figures"]["mse"], json["figures"]["mse"]);
    assert_eq!(number(&brighter, "/figures/flip"), 0.0, "both are white");
    let same = figures(dir.path(), "a.exr a.exr");
    assert_eq!((&same["figures"]["identical"], &same["figures"]["psnr"]["rgb"]), (&Value::Bool(true), &Value::Null));
}

#[test]
fn parts_and_pixels_that_are_not_finite_are_reported() {
    let dir = two();
    let mut bad = flat(16, 12, 0.5);
    bad.beauty[5][1] = f32::INFINITY;
    bad.beauty[9][0] = f32::NAN;
    exr_output::write(&dir.path().join("bad.exr"), &bad).unwrap();
    let output = expect(dir.path(), "diff bad.exr b.exr", 0);
    assert!(stderr(&output).contains("warning: 2 of 192 pixels are left out"), "{}", stderr(&output));
    assert!(stdout(&output).contains("2 of them left out"));
    expect(dir.path(), "diff bad.exr b.exr -q --max rmse=0.25", 0);
    expect(dir.path(), "diff bad.exr b.exr -q --max left-out=0", 1);

    let cell = Picture { x: 12, y: 2, full: (16, 12), ..flat(4, 4, 0.25) };
    exr_output::write(&dir.path().join("cell.exr"), &cell).unwrap();
    let output = expect(dir.path(), "diff a.exr cell.exr", 0);
    assert!(stderr(&output).contains("what both hold is compared, 4 × 4 pixels at (12, 2)"), "{}", stderr(&output));
}

#[test]
fn pictures_and_report_are_written() {
    let dir = two();
    fs::create_dir(dir.path().join("out")).unwrap();
    let output = expect(dir.path(), "diff a.exr b.exr -o out --html out/report.html", 0);
    assert!(stdout(&output).contains("out/diff_flip.png"), "{}", stdout(&output));
    for name in ["signed", "relative", "flip"] {
        let picture = image::open(dir.path().join(format!("out/diff_{name}.png"))).unwrap().into_rgb8();
        assert!(picture.width() >= 16 && picture.height() > 12, "{name}");
        if name == "signed" {
            let [red, _, blue] = picture.get_pixel(3, 3).0;
            assert!(red > blue, "A is brighter");
        }
    }
    assert!(!dir.path().join("out/diff_z.png").exists(), "no standard errors are known");
    let page = fs::read_to_string(dir.path().join("out/report.html")).unwrap();
    for part in ["prefers-color-scheme: dark", "data:image/png;base64,", "relMSE", "a.exr beside b.exr", "Made by:"] {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("<script") && !page.contains("http:") && !page.contains("https:"), "needs no other file");
    // A name and not a directory.
    expect(dir.path(), "diff a.exr b.exr -o out/x -q", 0);
    assert!(dir.path().join("out/x_signed.png").exists());
}

#[test]
fn formats_meet() {
    let dir = two();
    image::save_buffer(dir.path().join("a.png"), &[188u8; 16 * 12 * 3], 16, 12, image::ColorType::Rgb8).unwrap();
    let header = b"PF\n16 12\n-1.0\n".to_vec();
    let pfm: Vec<u8> = header.into_iter().chain((0..16 * 12 * 3).flat_map(|_| 0.5f32.to_le_bytes())).collect();
    fs::write(dir.path().join("a.pfm"), pfm).unwrap();
    expect(dir.path(), "diff a.pfm a.exr --max max-abs=0", 0);
    // 188/255 is the nearest that PNG has to 0.5.
    expect(dir.path(), "diff a.png a.exr --max max-abs=0.005 --min psnr=54", 0);
}

/// Two renders with other random numbers differ as their standard errors say, and a picture that is 2 % brighter by more.
#[test]
fn noise_is_told_from_bias() {
    told("--sampler independent");
}

/// Samples of one Sobol sequence avoid each other: their spread is an upper bound, and diff says so of each such picture. It says too where
/// pixels share paths.
#[test]
fn standard_errors_that_are_not_all_they_seem_are_told() {
    let dir = tempfile::tempdir().unwrap();
    for (name, options) in
        [("sobol", ""), ("independent", "--sampler independent"), ("four", "--replicates 4"), ("shared", "--reuse 4")]
    {
        let render = "render proc:torus,tris=500 -r 16 12 -s 8 --quiet";
        expect(dir.path(), &format!("{render} {options} -o {name}.exr"), 0);
    }
    for (pictures, bounds, alike) in [
        ("sobol.exr sobol.exr", 2, 0),
        ("four.exr sobol.exr", 1, 0),
        ("four.exr independent.exr", 0, 0),
        ("shared.exr independent.exr", 1, 1),
    ] {
        let output = expect(dir.path(), &format!("diff {pictures}"), 0);
        let told = ["upper bounds", "share paths"].map(|what| stderr(&output).matches(what).count());
        assert_eq!(told, [bounds, alike], "{pictures}: {}", stderr(&output));
    }
}

/// So do renders by points that avoid each other, if they come in sequences that do not.
#[test]
fn replicates_make_standard_errors_right() {
    told("--replicates 128");
}

fn told(sampler: &str) {
    let dir = tempfile::tempdir().unwrap();
    for seed in [1, 2] {
        let arguments =
            format!("render proc:torus,tris=2k -r 48 36 -s 1024 -m 2 {sampler} --seed {seed} -o {seed}.exr -q");
        expect(dir.path(), &arguments, 0);
    }
    let json = figures(dir.path(), "1.exr 2.exr");
    let test = &json["figures"]["z_test"];
    let (mean, error) = (number(test, "/mean_square/value"), number(test, "/mean_square/error"));
    let z = |c: usize| number(&json, &format!("/figures/bias/z/{c}"));
    let bias2 = number(&json, "/figures/bias/bias2/value") / number(&json, "/figures/bias/bias2/error");
    println!(
        "mean z² {mean:.3} ± {error:.3}, bias² {bias2:+.2} standard errors, means {:+.2} {:+.2} {:+.2}",
        z(0),
        z(1),
        z(2)
    );
    assert!((mean - 1.0).abs() < 3.0 * error && error < 0.1, "mean z² {mean} ± {error}");
    assert!(bias2.abs() < 3.0, "bias² {bias2} standard errors from 0");
    assert!((0..3).all(|c| z(c).abs() < 3.5));
    expect(dir.path(), "diff 1.exr 2.exr -q --max failing=0.002 --max mean-z=3.5 --max bias2-z=3 --max z2-z=3", 0);
    expect(dir.path(), "diff 1.exr 2.exr -q -o d", 0);
    assert!(dir.path().join("d_z.png").exists());

    let mut brighter = exr_output::read(&dir.path().join("1.exr")).unwrap();
    brighter.beauty.iter_mut().flatten().for_each(|c| *c *= 1.02);
    brighter.variance.as_mut().unwrap().iter_mut().flatten().for_each(|v| *v *= 1.02 * 1.02);
    exr_output::write(&dir.path().join("brighter.exr"), &brighter).unwrap();
    let output = expect(dir.path(), "diff brighter.exr 2.exr -q --max mean-z=3.5", 1);
    assert!(stderr(&output).contains("mean-z is"), "{}", stderr(&output));
    let json = figures(dir.path(), "brighter.exr 2.exr");
    assert!((0..3).all(|c| number(&json, &format!("/figures/bias/z/{c}")) > 5.0), "{:#}", json["figures"]["bias"]);
}
