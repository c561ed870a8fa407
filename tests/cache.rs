//! Trees kept on disk: whatever lies in the folder, a render goes on, and shows the same picture.

use comber::bvh::{Accel, Bvh4, BvhStats};
use comber::cache::digest::digest;
use comber::cache::folder::Found;
use comber::cache::{Cache, Contents, Key};
use comber::options::{AccelOptions, LeafFormat, NodeFormat};
use comber::scene::Scene;
use comber::scene::description::SphereDescription;
use comber::scene::procedural;
use comber::scene::shapes::Shapes;
use comber::scene::stage::{self, Stage};
use glam::Vec3;
use serde_json::Value;
use std::fs::{self, File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, SystemTime};

mod common;
use common::rays::Random;

/// A mesh and some spheres in it: a scene of one part.
fn shapes(triangles: u32) -> Shapes {
    let mut scene = procedural::generate(&format!("proc:blob,tris={triangles}")).unwrap();
    scene.spheres = (0..7)
        .map(|i| SphereDescription {
            name: String::new(),
            at: Default::default(),
            center: Vec3::new(0.1 * i as f32 - 0.3, 0.0, 0.01 * (i * i) as f32),
            radius: 0.1,
            double: None,
            material: 0,
        })
        .collect();
    Scene::build(scene, Default::default()).unwrap().shapes
}

/// A mesh in a room: a scene of two parts.
fn in_a_room(triangles: u32) -> Shapes {
    let mesh = procedural::generate(&format!("proc:blob,tris={triangles}")).unwrap();
    let room = stage::place(mesh, Stage::Cornell, Default::default()).unwrap();
    Scene::build(room.description, Default::default()).unwrap().shapes
}

/// A folder with one tree in it.
struct Kept {
    _folder: tempfile::TempDir,
    cache: Cache,
    shapes: Shapes,
    options: AccelOptions,
    accel: Accel,
    key: Key,
    path: PathBuf,
}

/// A kept tree of full nodes.
fn kept(triangles: u32) -> Kept {
    kept_with(triangles, NodeFormat::Full, LeafFormat::Full)
}

fn kept_with(triangles: u32, nodes: NodeFormat, leaves: LeafFormat) -> Kept {
    let kept = kept_of(shapes(triangles), AccelOptions { nodes, leaves, ..Default::default() });
    assert!(matches!(kept.accel, Accel::Bvh(_)));
    kept
}

/// The tree of a room, and what stands beside it.
fn kept_in_a_room(triangles: u32) -> Kept {
    let options = AccelOptions { nodes: NodeFormat::Full, ..Default::default() };
    let kept = kept_of(in_a_room(triangles), options);
    assert!(matches!(kept.accel, Accel::Parted(_)));
    kept
}

fn kept_of(shapes: Shapes, options: AccelOptions) -> Kept {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache { folder: folder.path().join("trees"), limit: 1 << 30 };
    let (accel, key) = (Accel::build(&shapes, &options).unwrap(), Contents::of(&shapes).key(&options));
    let path = store(&cache, key, accel.tree().unwrap());
    Kept { _folder: folder, cache, shapes, options, accel, key, path }
}

fn store(cache: &Cache, key: Key, tree: &Bvh4) -> PathBuf {
    cache.store(key, tree, "a scene", &AccelOptions::default(), &|_, _| {}).unwrap()
}

impl Kept {
    fn load(&self) -> Found {
        self.cache.load(self.key, &self.shapes, &self.options)
    }

    /// What is wrong with the file; it must not be used.
    fn damage(&self) -> String {
        match self.load() {
            Found::Damaged(why) => why,
            other => panic!("{other:?}"),
        }
    }

    fn assert_sound(&self) {
        assert_eq!(fingerprint(&self.found()), fingerprint(&self.accel));
    }

    fn found(&self) -> Accel {
        match self.load() {
            Found::Tree(accel) => *accel,
            other => panic!("{other:?}"),
        }
    }

    fn tree(&self) -> &Bvh4 {
        self.accel.tree().unwrap()
    }

    fn bytes(&self) -> Vec<u8> {
        fs::read(&self.path).unwrap()
    }

    fn write(&self, bytes: &[u8]) {
        fs::write(&self.path, bytes).unwrap();
    }
}

/// Of the tree, and of how much stands beside it.
fn fingerprint(accel: &Accel) -> (u64, usize) {
    (accel.tree().unwrap().fingerprint(), accel.beside())
}

/// Figures, but for the time that building took, which is not kept phase by phase, and what stands beside the tree is built anew.
fn figures(accel: &Accel) -> BvhStats {
    BvhStats { build_seconds: 0.0, phase_seconds: Default::default(), ..accel.stats() }
}

/// Where the header keeps what.
const VERSION_AT: usize = 12;
const BOUNDS_AT: usize = 64;
const GRID_AT: usize = 88;
const SECTIONS_AT: usize = 128;
const SECTION: usize = 40;
const HEADER: usize = 4096;

fn word(bytes: &[u8], at: usize) -> usize {
    u64::from_ne_bytes(bytes[at..at + 8].try_into().unwrap()) as usize
}

/// Where a section begins, and how many bytes it has.
fn section(bytes: &[u8], number: usize) -> (usize, usize) {
    let at = SECTIONS_AT + number * SECTION;
    (word(bytes, at), word(bytes, at + 8))
}

/// Makes all checksums right, as someone does who knows how.
fn sign(bytes: &mut [u8]) {
    for number in 0..5 {
        let (start, length) = section(bytes, number);
        let end = (start + length).next_multiple_of(HEADER);
        let sum = digest(&[&bytes[start..start + length], &bytes[start + length..end]]);
        let at = SECTIONS_AT + number * SECTION + 24;
        bytes[at..at + 16].copy_from_slice(&sum.to_le_bytes());
    }
    let sum = digest(&[&bytes[..HEADER - 16]]);
    bytes[HEADER - 16..HEADER].copy_from_slice(&sum.to_le_bytes());
}

/// One 32-bit number of a section.
fn put(bytes: &mut [u8], number: usize, at: usize, value: u32) {
    let (start, length) = section(bytes, number);
    assert!(at + 4 <= length);
    bytes[start + at..start + at + 4].copy_from_slice(&value.to_ne_bytes());
}

fn get(bytes: &[u8], number: usize, at: usize) -> u32 {
    let start = section(bytes, number).0 + at;
    u32::from_ne_bytes(bytes[start..start + 4].try_into().unwrap())
}

#[test]
fn what_was_stored_is_found_and_nothing_else() {
    let kept = kept(3000);
    kept.assert_sound();
    let found = kept.found();
    assert_eq!(figures(&found), figures(&kept.accel));
    assert_eq!(found.stats().build_seconds, kept.accel.stats().build_seconds);
    assert_eq!(found.bounds(), kept.accel.bounds());
    assert!(matches!(kept.cache.load(Key(kept.key.0 ^ 1), &kept.shapes, &kept.options), Found::Nothing));
    let none = Cache { folder: kept.cache.folder.join("none"), limit: 0 };
    assert!(matches!(none.load(kept.key, &kept.shapes, &kept.options), Found::Nothing));
    fs::rename(&kept.path, kept.cache.path(Key(7))).unwrap();
    match kept.cache.load(Key(7), &kept.shapes, &kept.options) {
        Found::Damaged(why) => assert!(why.contains(&kept.key.to_string()), "{why}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn files_of_any_other_length_are_refused() {
    let kept = kept(60);
    let whole = kept.bytes();
    let lengths = (0..whole.len()).step_by(509).chain([1, 4095, 4096, 4097, whole.len() - 4096, whole.len() - 1]);
    for length in lengths {
        kept.write(&whole[..length]);
        let why = kept.damage();
        assert!(why.contains("bytes"), "{length}: {why}");
    }
    for more in [1, 4096] {
        kept.write(&[whole.clone(), vec![0; more]].concat());
        assert!(kept.damage().contains("expected"), "{more}");
    }
    kept.write(&whole);
    kept.assert_sound();
}

#[test]
fn every_byte_is_covered() {
    let kept = kept(60);
    let whole = kept.bytes();
    let mut changed = whole.clone();
    for at in 0..whole.len() {
        // All of the header, and a sample of the rest that meets every byte of a node and a block, and the padding.
        if at > 2 * HEADER && at % 7 != 0 {
            continue;
        }
        changed[at] ^= 1 << (at % 8);
        kept.write(&changed);
        kept.damage();
        changed[at] = whole[at];
    }
}

#[test]
fn other_versions_are_refused_and_replaced() {
    let kept = kept(60);
    let mut bytes = kept.bytes();
    bytes[VERSION_AT] += 1;
    sign(&mut bytes);
    kept.write(&bytes);
    assert!(kept.damage().contains("it has version"));
    store(&kept.cache, kept.key, kept.tree());
    kept.assert_sound();
}

/// Which sections hold the leaf blocks.
const TRIANGLES: usize = 2;
const SPHERES: usize = 3;
/// Offsets within a node: the six planes of four children, then the children.
const CHILDREN_AT: usize = 96;
/// Offsets within a triangle block: the corners, then primitives, then geometries.
const PRIM_AT: usize = 144;
const GEOM_AT: usize = 160;
const EMPTY: u32 = u32::MAX;

#[test]
fn trees_that_traversal_could_not_trust_are_refused() {
    let kept = kept(3000);
    let whole = kept.bytes();
    let nodes = section(&whole, 0).1 / 128;
    let child = |node: usize, lane: usize| get(&whole, 0, 128 * node + CHILDREN_AT + 4 * lane);
    let all = || (0..nodes).flat_map(|node| (0..4).map(move |lane| (node, lane)));
    let of_kind = |wanted: &dyn Fn(u32) -> bool| all().find(|&(node, lane)| wanted(child(node, lane))).unwrap();
    let inner = all().rfind(|&(node, lane)| node > 0 && child(node, lane) >> 31 == 0).unwrap();
    let leaf = of_kind(&|bits| bits >> 30 == 2);
    let spheres = of_kind(&|bits| bits >> 30 == 3 && bits != EMPTY);
    let empty = of_kind(&|bits| bits == EMPTY);
    let blocks = section(&whole, TRIANGLES).1 / 192;
    let unused =
        (0..blocks * 4).find(|&i| get(&whole, TRIANGLES, i / 4 * 192 + PRIM_AT + i % 4 * 4) == u32::MAX).unwrap();
    let (block, lane) = (unused / 4 * 192, unused % 4);
    let at = |(node, lane): (usize, usize)| 128 * node + CHILDREN_AT + 4 * lane;
    let edits: Vec<(&str, usize, usize, u32, &str)> = vec![
        ("a node is its own child", 0, at(inner), inner.0 as u32, "as its child"),
        ("a node has its parent below it", 0, at(inner), 0, "as its child"),
        ("a child beyond the end", 0, at(inner), nodes as u32, "as its child"),
        ("a child far beyond the end", 0, at(inner), 0x7fff_fffe, "as its child"),
        ("a child of two parents", 0, at(leaf), child(inner.0, inner.1), "as its child"),
        ("a child is lost", 0, at(inner), child(leaf.0, leaf.1), "no parent"),
        ("a leaf beyond the end", 0, at(leaf), 1 << 31 | blocks as u32, "leaf blocks"),
        ("a leaf across the end", 0, at(leaf), 1 << 31 | 1 << 27 | (blocks as u32 - 1), "leaf blocks"),
        ("a leaf of spheres beyond the end", 0, at(spheres), 3 << 30 | 0xffff, "leaf blocks"),
        ("no child, but a box", 0, 128 * empty.0 + 4 * empty.1, 0, "box for no child"),
        ("no child any more, but a box", 0, at(leaf), EMPTY, "box for no child"),
        ("a primitive that does not exist", TRIANGLES, PRIM_AT, kept.shapes.triangles.len() as u32, "primitives"),
        ("a sphere among the triangles", TRIANGLES, PRIM_AT, kept.shapes.prim_count() as u32 - 1, "primitives"),
        ("a geometry that does not exist", TRIANGLES, GEOM_AT, 1000, "primitives"),
        ("the geometry of another primitive", TRIANGLES, GEOM_AT, 1, "primitives"),
        ("an unused lane that can be hit", TRIANGLES, block + 4 * lane, 0, "primitives"),
        ("a primitive is lost", TRIANGLES, PRIM_AT, u32::MAX, "primitives"),
        ("a triangle among the spheres", SPHERES, 64, 0, "primitives"),
    ];
    for (what, number, at, value, expected) in edits {
        let mut bytes = whole.clone();
        put(&mut bytes, number, at, value);
        sign(&mut bytes);
        kept.write(&bytes);
        let why = kept.damage();
        assert!(why.contains(expected), "{what}: {why}");
    }
    // A chain of nodes, each the only child of the one before.
    let mut bytes = whole.clone();
    for node in 0..nodes {
        for word in 0..24 {
            put(&mut bytes, 0, 128 * node + 4 * word, f32::INFINITY.to_bits());
        }
        for lane in 0..4 {
            let child = if lane == 0 && node + 1 < nodes { node as u32 + 1 } else { EMPTY };
            put(&mut bytes, 0, 128 * node + CHILDREN_AT + 4 * lane, child);
        }
    }
    sign(&mut bytes);
    kept.write(&bytes);
    assert!(kept.damage().contains("deeper than"));
    // And without any change, signing is right.
    let mut bytes = whole.clone();
    sign(&mut bytes);
    assert!(bytes == whole);
}

#[test]
fn what_stands_beside_a_tree_is_found_again() {
    for (nodes, leaves) in [
        (NodeFormat::Full, LeafFormat::Full),
        (NodeFormat::Compact, LeafFormat::Full),
        (NodeFormat::Compact, LeafFormat::Compact),
    ] {
        let kept = kept_of(in_a_room(3000), AccelOptions { nodes, leaves, ..Default::default() });
        let found = kept.found();
        assert!(matches!(found, Accel::Parted(_)));
        assert_eq!(fingerprint(&found), fingerprint(&kept.accel));
        assert_eq!(figures(&found), figures(&kept.accel));
        assert_eq!(found.bounds(), kept.accel.bounds());
        assert_eq!((found.node_format(), found.leaf_format()), (kept.accel.node_format(), kept.accel.leaf_format()));
        assert_eq!(found.row_bytes(), kept.accel.row_bytes());
    }
}

#[test]
fn trees_of_other_parts_are_refused() {
    let kept = kept_in_a_room(3000);
    let whole = kept.bytes();
    let beside = kept.accel.beside() as u32;
    assert!(beside > 0 && kept.shapes.geometries.len() > 2);
    let geometry = |few: bool| {
        let found = kept.shapes.geometries.iter().position(|geometry| (geometry.prim_count <= beside) == few);
        found.unwrap()
    };
    let (wall, mesh) = (geometry(true), geometry(false));
    // A wall in the tree, in the place of one of its triangles.
    let mut bytes = whole.clone();
    put(&mut bytes, TRIANGLES, PRIM_AT, kept.shapes.geometries[wall].first_prim);
    put(&mut bytes, TRIANGLES, GEOM_AT, wall as u32);
    sign(&mut bytes);
    kept.write(&bytes);
    let why = kept.damage();
    assert!(why.contains("primitives that the tree should not hold"), "{why}");
    // A tree of one part over the same scene.
    store(&kept.cache, kept.key, &Bvh4::build(&kept.shapes, &kept.options).unwrap());
    let why = kept.damage();
    assert!(why.contains("primitives that the tree should not hold"), "{why}");
    // The tree of a part, where one of all is due: the same scene, were the walls one with the mesh.
    let all = &kept.shapes.geometries[mesh];
    let one =
        comber::scene::shapes::Geometry { first_prim: 0, prim_count: kept.shapes.prim_count() as u32, ..all.clone() };
    let joined = Shapes { geometries: vec![one], ..kept.shapes.clone() };
    assert!(matches!(Accel::build(&joined, &kept.options).unwrap(), Accel::Bvh(_)));
    let key = Contents::of(&joined).key(&kept.options);
    assert_ne!(key, kept.key);
    store(&kept.cache, key, kept.tree());
    match kept.cache.load(key, &joined, &kept.options) {
        Found::Damaged(why) => assert!(why.contains("primitives"), "{why}"),
        other => panic!("{other:?}"),
    }
    // A box that keeps rays from the tree.
    for value in [0f32, f32::NAN, f32::INFINITY] {
        let mut bytes = whole.clone();
        bytes[BOUNDS_AT..BOUNDS_AT + 4].copy_from_slice(&value.to_ne_bytes());
        sign(&mut bytes);
        kept.write(&bytes);
        let why = kept.damage();
        assert!(why.contains("its box"), "{value}: {why}");
    }
    for length in [0, 4096, whole.len() - 1, whole.len() - 4096] {
        kept.write(&whole[..length]);
        assert!(kept.damage().contains("bytes"), "{length}");
    }
    kept.write(&whole);
    kept.assert_sound();
}

#[test]
fn no_signed_file_makes_traversal_fail() {
    no_signed_file_fails(&kept(500));
    no_signed_file_fails(&kept_in_a_room(500));
    no_signed_file_fails(&kept_with(500, NodeFormat::Compact, LeafFormat::Full));
    no_signed_file_fails(&kept_with(500, NodeFormat::Compact, LeafFormat::Compact));
}

fn no_signed_file_fails(kept: &Kept) {
    let whole = kept.bytes();
    let sections: Vec<usize> = (0..5).filter(|&number| section(&whole, number).1 > 0).collect();
    let mut random = Random(1);
    let mut used = 0;
    for _ in 0..400 {
        let mut bytes = whole.clone();
        for _ in 0..1 + random.below(3) {
            let number = sections[random.below(sections.len())];
            let at = random.below(section(&bytes, number).1 / 4) * 4;
            let values = [0, 1, EMPTY, 1 << 31, random.next(), f32::NAN.to_bits(), get(&bytes, number, at) ^ 1];
            put(&mut bytes, number, at, values[random.below(values.len())]);
        }
        sign(&mut bytes);
        kept.write(&bytes);
        if let Found::Tree(accel) = kept.load() {
            used += 1;
            let mut single = accel.single();
            for _ in 0..50 {
                let (origin, direction) = (random.vector() * 3.0, random.vector());
                let ray = comber::bvh::ray::Ray::new(origin, direction);
                let hit = single.closest_hit(&ray);
                assert!(hit.prim == u32::MAX || (hit.prim as usize) < kept.shapes.prim_count());
                single.any_hit(&ray);
            }
        }
    }
    assert!(used > 40, "{used}: most edits of planes and corners make sense");
}

#[test]
fn what_is_no_file_is_refused() {
    let kept = kept(60);
    fs::remove_file(&kept.path).unwrap();
    fs::create_dir(&kept.path).unwrap();
    assert!(kept.damage().contains("not a regular file"));
    assert!(kept.cache.store(kept.key, kept.tree(), "", &AccelOptions::default(), &|_, _| {}).is_err());
    fs::remove_dir(&kept.path).unwrap();
    #[cfg(unix)]
    {
        assert!(Command::new("mkfifo").arg(&kept.path).status().unwrap().success());
        assert!(kept.damage().contains("not a regular file"));
        store(&kept.cache, kept.key, kept.tree());
        kept.assert_sound();
        let mut permissions = fs::metadata(&kept.path).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&kept.path, permissions).unwrap();
        store(&kept.cache, kept.key, kept.tree());
        kept.assert_sound();
    }
}

#[test]
fn threads_that_store_load_and_evict_do_not_meet() {
    let kept = kept(2000);
    let small = Cache { limit: kept.bytes().len() as u64 + 1, ..kept.cache.clone() };
    std::thread::scope(|scope| {
        for thread in 0..6u128 {
            let (kept, small) = (&kept, &small);
            scope.spawn(move || {
                for round in 0..12 {
                    match thread {
                        0 | 1 => drop(store(&kept.cache, kept.key, kept.tree())),
                        // Another name, for which there is not room enough.
                        2 => drop(store(small, Key(round), kept.tree())),
                        _ => match kept.load() {
                            Found::Tree(accel) => assert_eq!(fingerprint(&accel), fingerprint(&kept.accel)),
                            Found::Nothing => {}
                            Found::Damaged(why) => panic!("{why}"),
                        },
                    }
                }
            });
        }
    });
}

#[cfg(unix)]
#[test]
fn trees_outlive_their_files() {
    let kept = kept(2000);
    let found = kept.found();
    assert_eq!(kept.cache.clear(|_| true).unwrap().len(), 1);
    assert!(matches!(kept.load(), Found::Nothing));
    assert_eq!(fingerprint(&found), fingerprint(&kept.accel));
}

fn set_age(path: &Path, age: Duration) {
    let file = OpenOptions::new().append(true).open(path).unwrap();
    file.set_modified(SystemTime::now() - age).unwrap();
}

#[test]
fn what_was_used_longest_ago_goes_first() {
    let kept = kept(500);
    let bytes = kept.bytes().len() as u64;
    let hours = |hours: u64| Duration::from_secs(3600 * hours);
    for key in 1..=4 {
        set_age(&store(&kept.cache, Key(key), kept.tree()), hours(key as u64));
    }
    set_age(&kept.path, hours(10));
    // Loading is use.
    kept.assert_sound();
    let left_by_the_dead = kept.cache.folder.join(".comber-1-2.tmp");
    let being_written = kept.cache.folder.join(".comber-1-3.tmp");
    let foreign = kept.cache.folder.join("notes.bvh");
    for path in [&left_by_the_dead, &being_written, &foreign] {
        File::create(path).unwrap().write_all(b"half a tree").unwrap();
    }
    set_age(&left_by_the_dead, hours(2));
    let limited = Cache { limit: 4 * bytes, ..kept.cache.clone() };
    store(&limited, Key(5), kept.tree());
    let keys: Vec<Key> = limited.entries().unwrap().iter().map(|entry| entry.key).collect();
    assert_eq!(keys, [Key(5), kept.key, Key(1), Key(2)]);
    assert!(!left_by_the_dead.exists() && being_written.exists() && foreign.exists());
    let tiny = Cache { limit: bytes - 1, ..kept.cache.clone() };
    let refusal = tiny.store(Key(6), kept.tree(), "", &AccelOptions::default(), &|_, _| {}).unwrap_err();
    assert!(refusal.to_string().contains("--cache-limit"), "{refusal}");
    assert_eq!(limited.entries().unwrap().len(), 4, "a tree that does not fit evicts nothing");
}

/// `comber` in a folder, with a cache beside it that is the user's.
fn comber(folder: &Path, line: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_comber"));
    command.current_dir(folder).args(line.split_whitespace()).env("XDG_CACHE_HOME", folder.join("home"));
    command.env("SOURCE_DATE_EPOCH", "1000000000").output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

const RENDER: &str = "render proc:blob,tris=2k -r 40 30 -s 2 --json --cache trees -o a.png -o a.exr";

/// Renders; tells where the tree came from, its file, and what there was to warn of.
fn render(folder: &Path, line: &str) -> (String, Option<PathBuf>, String) {
    let output = comber(folder, line);
    assert!(output.status.success(), "{line}: {}", text(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(json["seconds"]["first_pixels"].as_f64().unwrap() > 0.0);
    let file = json["tree"]["file"].as_str().map(|file| folder.join(file));
    let said = text(&output.stderr).lines().filter(|line| !line.starts_with("note: ")).collect();
    (json["tree"]["source"].as_str().unwrap().to_owned(), file, said)
}

fn pictures(folder: &Path) -> [Vec<u8>; 2] {
    ["a.png", "a.exr"].map(|name| fs::read(folder.join(name)).unwrap())
}

#[test]
fn pictures_do_not_depend_on_where_the_tree_comes_from() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let (source, file, said) = render(folder, RENDER);
    assert_eq!((source.as_str(), said.as_str()), ("built", ""));
    let built = pictures(folder);
    let (source, same, said) = render(folder, RENDER);
    assert_eq!((source.as_str(), said.as_str()), ("cache", ""));
    assert_eq!(same, file);
    assert!(pictures(folder) == built);
    assert_eq!(render(folder, &RENDER.replace("--cache trees", "--cache off")).1, None);
    assert!(pictures(folder) == built);
    // The walls stand beside the tree, from the cache too.
    let [plan, cached] = ["off", "trees"].map(|cache| {
        let output = comber(folder, &format!("info proc:blob,tris=2k -r 40 30 -s 2 --json --cache {cache}"));
        let json: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(json["tree"]["source"], if cache == "off" { "built" } else { "cache" });
        json["plan"].clone()
    });
    assert!(plan.to_string().contains("beside the tree"), "{plan}");
    assert_eq!(plan, cached);
    // Another mesh, another camera, another number of threads.
    assert_eq!(render(folder, &RENDER.replace("2k", "2k,seed=2")).0, "built");
    assert_eq!(render(folder, &format!("{RENDER} --vp 0 1 3 -t 1")).0, "cache");
    assert_eq!(render(folder, &format!("{RENDER} --cache off")).1, None);
    assert_eq!(render(folder, &format!("{RENDER} --accel brute")).1, None);

    let file = file.unwrap();
    let whole = fs::read(&file).unwrap();
    let mut damaged = whole.clone();
    damaged[5000] ^= 1;
    fs::write(&file, damaged).unwrap();
    let (source, _, said) = render(folder, RENDER);
    assert_eq!(source, "built");
    let name = file.file_name().unwrap().to_str().unwrap();
    assert!(said.starts_with("warning: ") && said.contains(name) && said.contains("checksum"), "{said}");
    assert!(pictures(folder) == built);
    assert_eq!(render(folder, RENDER).0, "cache", "the damaged file was replaced");
}

#[test]
fn only_large_meshes_are_kept_unless_a_folder_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let line = RENDER.replace("--cache trees", "");
    assert_eq!(render(folder.path(), &line).1, None);
    assert!(!folder.path().join("home").exists());
    let file = render(folder.path(), &line.replace("2k", "1200k")).1.unwrap();
    #[cfg(target_os = "linux")]
    assert!(file.starts_with(folder.path().join("home/comber")), "{}", file.display());
    assert!(file.exists());
}

#[test]
fn two_processes_at_once_and_one_that_was_killed() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let names = ["a", "b", "c", "d"];
    let children: Vec<_> = names
        .iter()
        .map(|name| {
            let line = RENDER.replace("a.png", &format!("{name}.png")).replace("-o a.exr", "").replace("2k", "60k");
            let mut command = Command::new(env!("CARGO_BIN_EXE_comber"));
            command.current_dir(folder).args(line.split_whitespace()).stdout(std::process::Stdio::null());
            command.spawn().unwrap()
        })
        .collect();
    for (place, mut child) in children.into_iter().enumerate() {
        if place == 3 {
            // Wherever it is: what it leaves is not taken for a tree.
            std::thread::sleep(Duration::from_millis(20));
            let _ = child.kill();
            let _ = child.wait();
        } else {
            assert!(child.wait().unwrap().success());
        }
    }
    let pictures = names[..3].iter().map(|name| fs::read(folder.join(format!("{name}.png"))).unwrap());
    let pictures: Vec<_> = pictures.collect();
    assert!(pictures.windows(2).all(|two| two[0] == two[1]));
    assert_eq!(render(folder, &RENDER.replace("2k", "60k")).0, "cache");
    let trees = Cache { folder: folder.join("trees"), limit: 1 << 30 }.entries().unwrap();
    assert_eq!(trees.len(), 1);
}

#[test]
fn a_folder_that_cannot_be_used_is_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("file"), "").unwrap();
    let (source, file, said) = render(folder, &RENDER.replace("trees", "file/trees"));
    assert_eq!((source.as_str(), file), ("built", None));
    assert!(said.contains("warning: the tree is not kept: ") && said.contains("file/trees"), "{said}");
    let (_, file, said) = render(folder, &format!("{RENDER} --cache-limit 1k"));
    assert_eq!(file, None);
    assert!(said.contains("--cache-limit"), "{said}");

    let locked = folder.join("locked");
    fs::create_dir(&locked).unwrap();
    let mut permissions = fs::metadata(&locked).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&locked, permissions).unwrap();
    if File::create(locked.join("probe")).is_ok() {
        println!("skipped: this user may write to read-only folders");
        return;
    }
    let (_, file, said) = render(folder, &RENDER.replace("trees", "locked"));
    assert_eq!(file, None);
    assert!(said.contains("warning: the tree is not kept: "), "{said}");
}

#[test]
fn trees_are_listed_and_cleared() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let run = |line: &str| {
        let output = comber(folder, line);
        assert!(output.status.success(), "{line}: {}", text(&output.stderr));
        text(&output.stdout)
    };
    let refused = |line: &str, expected: &str| {
        let output = comber(folder, line);
        assert_eq!(output.status.code(), Some(2), "{line}");
        assert!(text(&output.stderr).contains(expected), "{line}: {}", text(&output.stderr));
    };
    #[cfg(target_os = "linux")]
    assert_eq!(run("cache path"), format!("{}\n", folder.join("home/comber").display()));
    assert_eq!(run("cache ls --cache trees"), "trees: no trees\n");
    let mut files: Vec<PathBuf> =
        (1..=3).map(|seed| render(folder, &RENDER.replace("2k", &format!("2k,seed={seed}"))).1.unwrap()).collect();
    set_age(&files[0], Duration::from_secs(50 * 3600));
    set_age(&files[1], Duration::from_secs(3 * 3600));
    let key = |file: &Path| file.file_stem().unwrap().to_str().unwrap().to_owned();
    let list = run("cache ls --cache trees");
    let place = |file: &Path| list.find(&key(file)[..12]).unwrap();
    assert!(place(&files[2]) < place(&files[1]) && place(&files[1]) < place(&files[0]), "{list}");
    for part in ["proc:blob,tris=2k,seed=3", "2 days ago", "3 h ago", "just now", "3 trees", "KiB in trees"] {
        assert!(list.contains(part), "{part}: {list}");
    }
    fs::write(&files[1], "half").unwrap();
    assert!(run("cache ls --cache trees").contains("damaged: it has 4 bytes"));
    let json: Value = serde_json::from_str(&run("cache ls --cache trees --json")).unwrap();
    let trees = json["trees"].as_array().unwrap();
    assert_eq!(trees.len(), 3);
    assert_eq!(trees.iter().filter(|tree| tree["damaged"].is_string()).count(), 1);
    assert!(trees.iter().any(|tree| tree["options"].as_str().is_some_and(|o| o.contains("\"kind\":\"bvh\""))));

    refused("cache clear --cache trees ffffffff", "no tree has the key");
    refused("cache clear --cache trees ../..", "hexadecimal");
    refused("cache clear --cache trees --older-than soon", "30d");
    refused("cache clear --cache trees abcd --older-than 1d", "cannot be used with");
    assert!(run("cache clear --cache trees --older-than 1d").starts_with("removed 1, "));
    assert!(!files.remove(0).exists());
    assert!(run(&format!("cache clear --cache trees {}", &key(&files[1])[..8])).starts_with("removed 1, "));
    assert!(!files.remove(1).exists() && files[0].exists());
    let json: Value = serde_json::from_str(&run("cache clear --cache trees --json")).unwrap();
    assert_eq!(json["removed"][0], key(&files[0]));
    assert_eq!(fs::read_dir(folder.join("trees")).unwrap().count(), 0);
}

#[test]
fn memory_limits_are_kept_to() {
    let folder = tempfile::tempdir().unwrap();
    let line = "render proc:blob,tris=400k -r 8 6 -s 1 --cache off -o a.png";
    for (limit, what) in [("1M", "reading the scene takes about"), ("40M", "building the tree over")] {
        let output = comber(folder.path(), &format!("{line} --memory-limit {limit}"));
        // Elsewhere the system does not say how much is in use.
        if cfg!(target_os = "linux") {
            assert_eq!(output.status.code(), Some(1), "{limit}: {}", text(&output.stderr));
            assert!(text(&output.stderr).contains(what), "{limit}: {}", text(&output.stderr));
            assert!(text(&output.stderr).contains("--memory-limit"), "{}", text(&output.stderr));
        }
    }
    assert!(comber(folder.path(), &format!("{line} --memory-limit 1GiB")).status.success());
    assert_eq!(comber(folder.path(), &format!("{line} --memory-limit much")).status.code(), Some(2));
}

#[cfg(target_os = "linux")]
#[test]
fn predictions_are_near_what_is_taken() {
    let folder = tempfile::tempdir().unwrap();
    let made = comber(folder.path(), "mesh proc:sphere,tris=40k --split 5 --noise 0.1 -o a.ply");
    assert!(made.status.success());
    let output = comber(folder.path(), "info a.ply --json --cache off");
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    for phase in ["read", "build"] {
        let bytes = |what: &str| json["memory"][phase][what].as_u64().unwrap() as f64;
        let ratio = bytes("predicted") / bytes("peak");
        assert!((0.8..2.0).contains(&ratio), "{phase}: {ratio}: {}", json["memory"]);
    }
}

#[test]
fn compact_nodes_that_traversal_could_not_trust_are_refused() {
    let kept = kept_with(3000, NodeFormat::Compact, LeafFormat::Full);
    kept.assert_sound();
    let whole = kept.bytes();
    let nodes = section(&whole, 1).1 / 64;
    let child = |node: usize, lane: usize| 64 * node + 48 + 4 * lane;
    let low = |node: usize, lane: usize| get(&whole, 1, 64 * node + lane / 2 * 4) >> (16 * (lane % 2)) & 0xffff;
    let all = || (0..nodes).flat_map(|node| (0..4).map(move |lane| (node, lane)));
    let empty = all().find(|&(node, lane)| low(node, lane) == 0xffff).unwrap();
    let inner = all().find(|&(node, lane)| get(&whole, 1, child(node, lane)) >> 31 == 0).unwrap();
    for (what, at, value, expected) in [
        ("an empty slot that leads to the root", child(empty.0, empty.1), 0, "box for no child"),
        ("a node is its own child", child(inner.0, inner.1), inner.0 as u32, "as its child"),
        ("a child beyond the end", child(inner.0, inner.1), nodes as u32, "as its child"),
    ] {
        let mut bytes = whole.clone();
        put(&mut bytes, 1, at, value);
        sign(&mut bytes);
        kept.write(&bytes);
        let why = kept.damage();
        assert!(why.contains(expected), "{what}: {why}");
    }
    for value in [0f32, f32::NAN, f32::INFINITY, -1.0] {
        let mut bytes = whole.clone();
        bytes[GRID_AT + 12..GRID_AT + 16].copy_from_slice(&value.to_ne_bytes());
        sign(&mut bytes);
        kept.write(&bytes);
        assert!(kept.damage().contains("no grid"), "{value}");
    }
}

/// Offsets within a compact triangle block: the numbers of corners, a byte each, then the first geometry, then primitives.
const SHARED: usize = 4;
const CORNERS_AT: usize = 64;
const SHARED_GEOM_AT: usize = 76;
const SHARED_PRIM_AT: usize = 80;

#[test]
fn compact_leaves_that_traversal_could_not_trust_are_refused() {
    let kept = kept_with(3000, NodeFormat::Compact, LeafFormat::Compact);
    kept.assert_sound();
    let whole = kept.bytes();
    assert_eq!(section(&whole, TRIANGLES).1, 0);
    let blocks = section(&whole, SHARED).1 / 128;
    let prim = |block: usize, lane: usize| get(&whole, SHARED, 128 * block + SHARED_PRIM_AT + 4 * lane);
    let partly = (0..blocks).find(|&block| prim(block, 3) == EMPTY).unwrap() * 128;
    let row = get(&whole, SHARED, CORNERS_AT);
    let unused_row = get(&whole, SHARED, partly + CORNERS_AT);
    // The last lane of a row of corners is its last byte.
    let with = |row: u32, lane: usize, vertex: u8| {
        let mut bytes = row.to_ne_bytes();
        bytes[lane] = vertex;
        u32::from_ne_bytes(bytes)
    };
    for (what, at, value) in [
        ("the geometry after the last, by its difference", CORNERS_AT, with(row, 0, row.to_ne_bytes()[0] | 0xf8)),
        ("an unused lane with vertices", partly + CORNERS_AT, with(unused_row, 3, 0)),
        ("an unused vertex that is somewhere", partly + 28, 0),
        ("a primitive that does not exist", SHARED_PRIM_AT, kept.shapes.triangles.len() as u32),
        ("a sphere among the triangles", SHARED_PRIM_AT, kept.shapes.prim_count() as u32 - 1),
        ("a geometry that does not exist", SHARED_GEOM_AT, 1000),
        ("the geometry of others", SHARED_GEOM_AT, 1),
        ("a primitive is lost", SHARED_PRIM_AT, EMPTY),
    ] {
        let mut bytes = whole.clone();
        put(&mut bytes, SHARED, at, value);
        sign(&mut bytes);
        kept.write(&bytes);
        let why = kept.damage();
        assert!(why.contains("primitives"), "{what}: {why}");
    }
    // Blocks of the other format behind a grid, and these behind full nodes: no row, no tree.
    let mut bytes = whole.clone();
    let at = |number: usize| SECTIONS_AT + number * SECTION;
    let compact = bytes[at(SHARED)..at(SHARED) + 16].to_vec();
    bytes[at(TRIANGLES)..at(TRIANGLES) + 16].copy_from_slice(&compact);
    sign(&mut bytes);
    kept.write(&bytes);
    assert!(!kept.damage().is_empty());
    kept.write(&whole);
    kept.assert_sound();
}

/// Where full leaves do not fit, compact ones are chosen, kept under a name of their own, and found again.
#[cfg(target_os = "linux")]
#[test]
fn memory_limits_choose_smaller_leaves() {
    let folder = tempfile::tempdir().unwrap();
    let info = |limit: u64| {
        let mesh = "proc:blob,tris=400k --stage none";
        comber(folder.path(), &format!("info {mesh} --cache trees --json --quiet --memory-limit {limit}M"))
    };
    // From so much that anything fits, down to where the tree is refused.
    let mut seen = Vec::new();
    for limit in (40..120).rev().step_by(2) {
        let output = info(limit);
        if !output.status.success() {
            assert_eq!(output.status.code(), Some(1));
            assert!(text(&output.stderr).contains("--memory-limit"), "{}", text(&output.stderr));
            break;
        }
        let json: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(json["tree"]["source"], "built", "{limit} MiB");
        let peak = json["memory"]["build"]["peak"].as_u64().unwrap();
        assert!(peak <= limit << 20, "{limit} MiB: {peak}");
        let leaves = &json["formats"]["leaves"];
        if leaves["bytes"] == 128 {
            let again: Value = serde_json::from_slice(&info(limit).stdout).unwrap();
            assert_eq!((&again["tree"]["source"], &again["formats"]), (&Value::from("cache"), &json["formats"]));
        }
        seen.push((leaves["bytes"].as_u64().unwrap(), leaves["why"].as_str().unwrap().to_owned()));
        // A tree of full leaves that is kept would be taken, whatever the limit.
        fs::remove_dir_all(folder.path().join("trees")).unwrap();
    }
    seen.dedup();
    let [(192, _), (128, why)] = &seen[..] else { panic!("{seen:?}") };
    assert!(why.contains("memory"), "{why}");
}
