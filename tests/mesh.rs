//! `comber mesh`: meshes split, closed, and read back.

use comber::import;
use comber::scene::description::MeshDescription;
use comber::scene::procedural;
use serde_json::Value;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn comber(directory: &Path, line: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_comber")).current_dir(directory).args(line.split_whitespace()).output().unwrap()
}

/// Runs a line that must succeed, and reads the mesh that it leaves.
fn mesh(directory: &Path, line: &str) -> MeshDescription {
    let output = comber(directory, line);
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    read(&directory.join("out.ply"))
}

fn read(path: &Path) -> MeshDescription {
    let description = import::load(path).unwrap();
    assert!(description.notes.is_empty(), "{:?}", description.notes);
    description.meshes.into_iter().next().unwrap()
}

/// Each edge belongs to two triangles, which run along it in opposite directions.
fn assert_closed(mesh: &MeshDescription) {
    let mut edges: HashMap<[u32; 2], [u32; 2]> = HashMap::new();
    for &[a, b, c] in &mesh.triangles {
        for (a, b) in [(a, b), (b, c), (c, a)] {
            edges.entry([a.min(b), a.max(b)]).or_default()[usize::from(a < b)] += 1;
        }
    }
    assert!(edges.values().all(|runs| *runs == [1, 1]));
}

fn bits(positions: &[glam::Vec3]) -> Vec<[u32; 3]> {
    positions.iter().map(|p| p.to_array().map(f32::to_bits)).collect()
}

#[test]
fn split_meshes_stay_closed() {
    let folder = tempfile::tempdir().unwrap();
    let coarse = procedural::generate("proc:sphere,tris=300").unwrap().meshes.remove(0);
    assert_closed(&coarse);
    for n in [1, 2, 3, 7] {
        let fine = mesh(folder.path(), &format!("mesh proc:sphere,tris=300 --split {n} --noise 0.2 -o out.ply"));
        assert_eq!(fine.triangles.len(), coarse.triangles.len() * n * n);
        // A closed mesh has three edges to two triangles; Euler.
        assert_eq!(fine.positions.len(), fine.triangles.len() / 2 + 2);
        assert_closed(&fine);
    }
}

#[test]
fn every_encoding_brings_back_the_same_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let line = "mesh proc:blob,tris=2k --split 2 --noise 0.1 -o out.ply";
    let big = mesh(folder.path(), line);
    let header = std::fs::read(folder.path().join("out.ply")).unwrap();
    assert!(header.starts_with(b"ply\nformat binary_big_endian 1.0\n"));
    for encoding in ["--ascii", "--little-endian", "-t 1"] {
        let other = mesh(folder.path(), &format!("{line} {encoding}"));
        assert_eq!(bits(&other.positions), bits(&big.positions), "{encoding}");
        assert_eq!(other.triangles, big.triangles, "{encoding}");
    }
}

#[test]
fn without_splitting_it_converts() {
    let folder = tempfile::tempdir().unwrap();
    let source = procedural::generate("proc:torus,tris=1k").unwrap().meshes.remove(0);
    let first = mesh(folder.path(), "mesh proc:torus,tris=1k -o out.ply");
    assert_eq!((bits(&first.positions), &first.triangles), (bits(&source.positions), &source.triangles));
    std::fs::rename(folder.path().join("out.ply"), folder.path().join("in.ply")).unwrap();
    let second = mesh(folder.path(), "mesh in.ply --ascii -o out.ply");
    assert_eq!((bits(&second.positions), &second.triangles), (bits(&first.positions), &first.triangles));
    assert_eq!(second.normals.len(), first.normals.len());
}

#[test]
fn meshes_of_a_scene_become_one_and_the_rest_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let scene: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell_spheres.dae");
    let output = Command::new(env!("CARGO_BIN_EXE_comber"))
        .current_dir(folder.path())
        .args(["mesh", "-o", "out.ply", "--split", "3", "--json"])
        .arg(&scene)
        .output()
        .unwrap();
    assert!(output.status.success());
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let walls: usize = import::load(&scene).unwrap().meshes.iter().map(|mesh| mesh.triangles.len()).sum();
    assert_eq!(json["triangles"], 9 * walls);
    assert_eq!(read(&folder.path().join("out.ply")).triangles.len(), 9 * walls);
    let note = json["notes"].as_array().unwrap().iter().map(|note| note["text"].as_str().unwrap()).next_back().unwrap();
    assert!(note.contains("2 spheres") && note.contains("camera"), "{note}");
}

#[test]
fn misuse_and_failures_leave_no_file() {
    let folder = tempfile::tempdir().unwrap();
    for (line, status, message) in [
        ("mesh proc:sphere", 2, "--output"),
        ("mesh proc:sphere -o a.obj", 2, "written as .ply"),
        ("mesh proc:sphere -o a.ply --split 0", 2, "from 1 to 1024"),
        ("mesh proc:sphere -o a.ply --split 1025", 2, "from 1 to 1024"),
        ("mesh proc:sphere -o a.ply --noise 2", 2, "from 0 to 1"),
        ("mesh proc:sphere -o a.ply --noise nan", 2, "from 0 to 1"),
        ("mesh proc:sphere -o a.ply --ascii --little-endian", 2, "cannot be used with"),
        ("mesh proc:sphere,tris=10k -o a.ply --split 1024", 2, "at most 2,147,483,647"),
        ("mesh missing.ply -o a.ply", 1, "missing.ply: cannot read"),
        ("mesh proc:sphere -o missing/a.ply", 1, "there is no directory"),
    ] {
        let output = comber(folder.path(), line);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(status), "{line}: {text}");
        assert!(text.contains(message), "{line}: {text}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
