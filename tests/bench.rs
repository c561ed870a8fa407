//! `comber bench`, as its users see it. Tests that need Embree say so where it is missing.

use comber::bvh::Traversal;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

/// A mesh and a frame that take no time.
const QUICK: &str = "bench proc:torus,tris=2k --stage none -r 64 64 --repeats 2 --time 0 --turn 0";

fn comber(directory: &Path, line: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_comber"));
    // Records of other runs are none of a test's business.
    command.current_dir(directory).env("XDG_DATA_HOME", directory.join("data")).env("HOME", directory);
    command.args(line.split_whitespace()).stdin(Stdio::null()).output().unwrap()
}

fn directory() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs `line`, which must do well, and gives what it prints.
fn good(directory: &Path, line: &str) -> String {
    let output = comber(directory, line);
    assert_eq!(output.status.code(), Some(0), "{line}: {}", text(&output.stderr));
    text(&output.stdout)
}

/// Runs `line`, which must end with `status`, and gives what it complains of.
fn bad(directory: &Path, line: &str, status: i32) -> String {
    let output = comber(directory, line);
    assert_eq!(output.status.code(), Some(status), "{line}: {}", text(&output.stderr));
    text(&output.stderr)
}

fn json(directory: &Path, line: &str) -> Value {
    serde_json::from_str(&good(directory, &format!("{line} --json"))).unwrap()
}

/// The names of a list of objects.
fn names<'a>(list: &'a Value, key: &str) -> Vec<&'a str> {
    list.as_array().unwrap().iter().map(|item| item[key].as_str().unwrap()).collect()
}

#[test]
fn every_set_and_kernel_is_measured() {
    let dir = directory();
    let report = json(dir.path(), QUICK);
    assert_eq!(report["command"], "bench");
    let scene = &report["scenes"][0];
    assert_eq!(names(&scene["sets"], "set"), ["P", "Pt", "PH", "S", "D", "D2", "Q", "QS"]);
    for set in scene["sets"].as_array().unwrap() {
        let kernels = names(&set["contestants"], "name");
        let expected: Vec<&str> =
            std::iter::once("suited").chain(comber::bvh::Traversal::THROUGH_A_TREE.map(|way| way.name())).collect();
        assert_eq!(kernels, expected, "{}", set["set"]);
        assert!(set["hits"].as_u64().unwrap() <= set["rays"].as_u64().unwrap());
        for contestant in set["contestants"].as_array().unwrap() {
            assert!(contestant["rate"]["rate"]["median"].as_f64().unwrap() > 0.0);
            assert_eq!(contestant["samples"].as_array().unwrap().len(), 2);
            assert!(contestant["counts"]["node_visits"].as_u64().unwrap() > 0);
        }
    }
    let hits = |set: usize| scene["sets"][set]["hits"].as_u64().unwrap();
    assert_eq!(scene["sets"][2]["rays"].as_u64(), Some(hits(1)), "PH are the rays of Pt that hit");
    assert_eq!((hits(0), hits(2)), (hits(1), hits(1)), "P and Pt are the same rays");
    assert!(scene["spot_checked"].as_u64().unwrap() > 100);
    assert!(scene["bvh"]["sah_cost"].as_f64().unwrap() > 0.0);
    let render = &scene["render"][0];
    assert_eq!(render["paths"], 16 * 16 * 16);
    assert!(render["ratio"]["rate"]["median"].as_f64().unwrap() > 0.0);
}

#[test]
fn threads_sets_and_parts_are_chosen() {
    let dir = directory();
    let report = json(dir.path(), &format!("{QUICK} --sets S,D --threads 1,2 --only kernels --kernel single"));
    let scene = &report["scenes"][0];
    let sets: Vec<_> = scene["sets"]
        .as_array()
        .unwrap()
        .iter()
        .map(|set| (set["set"].as_str().unwrap(), set["threads"].as_u64().unwrap()))
        .collect();
    assert_eq!(sets, [("S", 1), ("S", 2), ("D", 1), ("D", 2)]);
    assert_eq!(names(&scene["sets"][0]["contestants"], "name"), ["single"]);
    assert_eq!(scene["render"], Value::Array(Vec::new()));
    let report = json(dir.path(), &format!("{QUICK} --only render"));
    assert_eq!(report["scenes"][0]["sets"], Value::Array(Vec::new()));
    assert_eq!(report["scenes"][0]["render"].as_array().unwrap().len(), 1);
    let text = good(dir.path(), &format!("{QUICK} --sets PH"));
    for word in ["Mray/s", "nodes a ray", "bytes a primitive", "SAH", "waves ÷ depth-first"] {
        assert!(text.contains(word), "{text}");
    }
    assert_eq!(good(dir.path(), &format!("{QUICK} --sets PH --quiet")), "");
}

#[test]
fn misuse_is_told() {
    let dir = directory();
    for (line, expected) in [
        ("bench --sets D,Z", "no set of rays 'Z'"),
        ("bench --kernel fast", "no kernel 'fast'; there are suited, single"),
        ("bench --only peer", "add --peer embree"),
        ("bench --peer nothing", "embree"),
        ("bench --peer-mode single", "--peer"),
        ("bench --once D --save x", "--once"),
        ("bench --passes 2", "--once"),
        ("bench --threads 0", "0"),
        ("bench --repeats 0", "0"),
        ("bench --save ../x", "cannot name a record"),
        ("bench --rays a.rays b.ply c.ply", "rays of one scene"),
        ("bench --peer embree --peer-isa a,b=c", "word"),
    ] {
        let message = bad(dir.path(), line, 2);
        assert!(message.contains(expected), "{line}: {message}");
    }
    for (line, expected) in [
        ("bench missing.ply", "missing.ply: cannot read"),
        ("bench --rays missing.rays proc:cubes,tris=12", "missing.rays: cannot read"),
        ("bench --against missing.json", "missing.json: cannot read"),
    ] {
        let message = bad(dir.path(), line, 1);
        assert!(message.contains(expected), "{line}: {message}");
    }
}

#[test]
fn without_embree_it_says_how_to_get_it() {
    let dir = directory();
    std::fs::write(dir.path().join("bogus.so"), "not a library").unwrap();
    for library in ["missing.so", "bogus.so"] {
        let message = bad(dir.path(), &format!("{QUICK} --peer embree --peer-library {library}"), 1);
        for word in [library, "libembree-dev", "embreex", "--peer-library"] {
            assert!(message.contains(word), "{message}");
        }
    }
    // A library of something else.
    let Some(other) =
        ["/lib/x86_64-linux-gnu/libm.so.6", "/lib64/libm.so.6"].into_iter().find(|lib| Path::new(lib).exists())
    else {
        return;
    };
    let message = bad(dir.path(), &format!("{QUICK} --peer embree --peer-library {other}"), 1);
    assert!(message.contains("no Embree"), "{message}");
}

/// The libraries that are installed; the reason, if there are none.
fn embree() -> Option<Vec<PathBuf>> {
    comber::peer::embree::library::find(None).map_err(|error| eprintln!("skipped: {error}")).ok()
}

#[test]
fn embree_agrees_in_every_mode() {
    let Some(libraries) = embree() else { return };
    let dir = directory();
    for library in libraries {
        let line = format!("{QUICK} --only peer --peer embree --all-modes --peer-library {}", library.display());
        for rest in ["--peer-robust on", "--peer-robust off --peer-quality both --threads 2"] {
            let report = json(dir.path(), &format!("{line} {rest}"));
            let scene = &report["scenes"][0];
            assert!(scene["peer"][0]["bytes"].as_u64().unwrap() > 0);
            for set in scene["sets"].as_array().unwrap() {
                let contestants = set["contestants"].as_array().unwrap();
                assert_eq!(contestants[0]["name"], "suited");
                assert_eq!(contestants.len(), 1 + set["modes"].as_array().unwrap().len());
                assert!(contestants.len() >= 6, "single, and packets of 4 and 8 both ways");
                assert!(contestants.iter().all(|c| c["ratio"]["rate"]["median"].as_f64().unwrap() > 0.0));
                assert!(set["best_peer"].as_u64().unwrap() >= 1);
            }
        }
    }
}

#[test]
fn embree_traces_spheres_and_stages_too() {
    let Some(_) = embree() else { return };
    let dir = directory();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_spheres.dae");
    let line = format!("bench {scene} -r 64 64 --repeats 1 --time 0 --turn 0 --only peer --peer embree --all-modes");
    good(dir.path(), &line);
}

#[test]
fn once_traces_and_measures_nothing() {
    let dir = directory();
    let line = format!("{QUICK} --once D --kernel in-flight --passes 3");
    let report = json(dir.path(), &line);
    let once = &report["scenes"][0]["once"];
    assert_eq!((&once["set"], &once["who"], &once["passes"]), (&"D".into(), &"in-flight".into(), &3.into()));
    assert!(once["rays"].as_u64().unwrap() > 0);
    assert_eq!(report["scenes"][0]["sets"], Value::Array(Vec::new()));
    if embree().is_some() {
        let report = json(dir.path(), &format!("{QUICK} --once S --peer embree --peer-mode single"));
        assert!(report["scenes"][0]["once"]["who"].as_str().unwrap().starts_with("Embree"));
        bad(dir.path(), &format!("{QUICK} --once S --peer embree --peer-mode sextuple"), 2);
    }
}

#[test]
fn figures_are_kept_and_compared() {
    let dir = directory();
    let line = format!("{QUICK} --sets D --only kernels");
    good(dir.path(), &format!("{line} --save before"));
    assert!(dir.path().join("data/comber/bench/before.json").exists() || !cfg!(target_os = "linux"));
    let compared = good(dir.path(), &format!("{line} --against before --save here.json"));
    assert!(compared.contains("before") && ["tie", "faster", "slower"].iter().any(|word| compared.contains(word)));
    let report = json(dir.path(), &format!("{line} --against here.json"));
    // The renderer's choice, and each way by itself.
    assert_eq!(report["against"].as_array().unwrap().len(), 1 + Traversal::THROUGH_A_TREE.len());
    assert!(report["against"][0]["ratio"].as_f64().unwrap() > 0.0);
    let nothing = good(dir.path(), &format!("{QUICK} --sets PH --only kernels --against here.json"));
    assert!(nothing.contains("nothing to compare"), "{nothing}");
    std::fs::write(dir.path().join("broken.json"), "{\"format\":").unwrap();
    assert!(bad(dir.path(), &format!("{line} --against broken.json"), 1).contains("broken.json:1:"));
}

/// Writes the rays of the quick scene, and gives the file's bytes.
fn dumped(dir: &Path) -> Vec<u8> {
    good(dir, &format!("{QUICK} --sets PH,S,D --only kernels --kernel single --dump-rays a.rays"));
    std::fs::read(dir.join("a.rays")).unwrap()
}

#[test]
fn rays_come_back_from_their_file() {
    let dir = directory();
    let bytes = dumped(dir.path());
    // Reading and writing again gives the same file: rays, batches, answers.
    let line = format!("{QUICK} --only kernels --rays a.rays");
    let report = json(dir.path(), &format!("{line} --dump-rays b.rays"));
    assert_eq!(std::fs::read(dir.path().join("b.rays")).unwrap(), bytes);
    assert_eq!(names(&report["scenes"][0]["sets"], "set"), ["PH", "S", "D"]);
    // Rays from a file and rays just made are the same.
    let fresh = json(dir.path(), &format!("{QUICK} --only kernels --sets PH,S,D"));
    let counts = |report: &Value| -> Vec<Value> {
        let sets = report["scenes"][0]["sets"].as_array().unwrap();
        sets.iter().map(|set| set["contestants"][1]["counts"].clone()).collect()
    };
    assert_eq!(counts(&report), counts(&fresh));
    // A folder gets a file named after the scene.
    std::fs::create_dir(dir.path().join("folder")).unwrap();
    good(dir.path(), &format!("{QUICK} --sets D --only kernels --dump-rays folder"));
    assert_eq!(std::fs::read_dir(dir.path().join("folder")).unwrap().count(), 1);
    // Another scene has other hits: that is a disagreement, and the warning says why.
    let message = bad(dir.path(), "bench proc:cubes,tris=12 --stage none --only kernels --rays a.rays", 1);
    assert!(message.contains("made for another scene") && message.contains("disagrees"), "{message}");
    let message = bad(dir.path(), &format!("{QUICK} --rays a.rays --once Z"), 2);
    assert!(message.contains("no set 'Z' in the file"), "{message}");
}

/// Makes the checksum right again.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let sum = crc32fast::hash(&bytes[16..]);
    bytes[12..16].copy_from_slice(&sum.to_le_bytes());
    bytes
}

#[test]
fn wrong_answers_in_a_file_fail_the_bench() {
    let dir = directory();
    let mut bytes = dumped(dir.path());
    // The last set is D; the file ends with the primitives of its answers.
    let end = bytes.len();
    for hit in [end - 4, end - 8, end - 12] {
        let old = u32::from_le_bytes(bytes[hit..hit + 4].try_into().unwrap());
        let new = if old == u32::MAX { 7 } else { u32::MAX };
        bytes[hit..hit + 4].copy_from_slice(&new.to_le_bytes());
    }
    std::fs::write(dir.path().join("a.rays"), sealed(bytes)).unwrap();
    let message = bad(dir.path(), &format!("{QUICK} --only kernels --rays a.rays"), 1);
    assert!(message.contains("the file disagrees with the reference about 3 of"), "{message}");
    assert!(message.contains("D ray") && message.contains("a miss"), "{message}");
}

#[test]
fn damaged_ray_files_are_refused_with_the_place() {
    let dir = directory();
    let bytes = dumped(dir.path());
    let refused = |bytes: Vec<u8>, expected: &str| {
        std::fs::write(dir.path().join("a.rays"), bytes).unwrap();
        let message = bad(dir.path(), &format!("{QUICK} --only kernels --rays a.rays"), 1);
        assert!(message.contains("a.rays") && message.contains(expected), "{expected}: {message}");
    };
    let at = |offset: usize, new: &[u8]| {
        let mut bytes = bytes.clone();
        bytes[offset..offset + new.len()].copy_from_slice(new);
        bytes
    };
    refused(Vec::new(), "byte 0: the file ends");
    refused(b"COMBRAYS".to_vec(), "byte 8: the file ends");
    refused(at(0, b"X"), "not a file of rays");
    refused(at(8, &[2]), "version 2; expected version 1");
    refused(at(bytes.len() / 2, &[!bytes[bytes.len() / 2]]), "damaged");
    refused(bytes[..bytes.len() - 1].to_vec(), "cut short");
    // From here on the checksum is right, and the content lies.
    refused(sealed(bytes[..bytes.len() - 1].to_vec()), "the file ends");
    refused(sealed([&bytes[..], &[0]].concat()), "1 bytes after the last set");
    let name = u32::from_le_bytes(bytes[32..36].try_into().unwrap()) as usize;
    let sets = 36 + name;
    refused(sealed(at(32, &u32::MAX.to_le_bytes())), "the scene's name is");
    refused(sealed(at(36, &[0xff])), "not UTF-8");
    refused(sealed(at(sets, &[255, 255, 255, 255])), "the file ends");
    let first = sets + 4;
    refused(sealed(at(first, &[200, 0, 0, 0])), "at most 64");
    refused(sealed(at(first + 4, b"/")), "other characters");
    refused(sealed(at(first + 6, &[9])), "neither 0 nor 1");
    refused(sealed(at(first + 7, &[0xf0])), "unknown flags");
    refused(sealed(at(first + 8, &[0, 0, 0, 0, 0, 0, 0, 1])), "more than a set can have");
    refused(sealed(at(first + 8, &[255, 255, 255])), "batches of");
    refused(sealed(at(first + 16, &[255, 255, 255, 127])), "the file ends");
    refused(sealed(at(first + 20, &[0, 0, 0, 0])), "none may be empty");
    let batches = u32::from_le_bytes(bytes[first + 16..first + 20].try_into().unwrap()) as usize;
    refused(sealed(at(first + 20 + 4 * batches, &f32::NAN.to_le_bytes())), "ray 0 cannot be traced");
}

#[test]
fn the_same_rays_are_made_whatever_the_threads() {
    let dir = directory();
    for threads in [1, 2] {
        let line = format!("{QUICK} --threads {threads} --only kernels --kernel single --dump-rays {threads}.rays");
        good(dir.path(), &line);
    }
    let file = |name: &str| std::fs::read(dir.path().join(name)).unwrap();
    assert_eq!(file("1.rays"), file("2.rays"));
}
