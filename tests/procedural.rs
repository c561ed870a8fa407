//! Claims about procedural meshes: how many triangles, closed, facing outwards, the same for any number of threads.

use comber::scene::description::MeshDescription;
use comber::scene::procedural::{Family, generate};
use glam::DVec3;
use std::collections::HashMap;

fn mesh(spec: &str) -> MeshDescription {
    generate(spec).unwrap().meshes.remove(0)
}

const CLOSED: [&str; 6] = ["sphere", "torus", "knot", "blob", "coral", "cubes"];

#[test]
fn counts_are_within_two_percent_and_noted() {
    for (name, _) in Family::ALL {
        for (text, wanted) in [("300", 300), ("1k", 1000), ("12345", 12_345), ("0.2M", 200_000)] {
            let description = generate(&format!("proc:{name},tris={text}")).unwrap();
            let made = description.meshes[0].triangles.len();
            assert!(made.abs_diff(wanted) * 50 <= wanted, "{name}: {made} for {wanted}");
            assert!(description.notes.iter().any(|note| note.text.contains(&made.to_string())), "{name}");
        }
    }
    assert_eq!(mesh("proc:cubes,tris=12").triangles.len(), 12);
    for (name, _) in Family::ALL {
        assert!(mesh(&format!("proc:{name},tris=12")).triangles.len() >= 12, "{name}");
    }
}

#[test]
fn closed_meshes_share_every_edge_between_two_triangles_of_one_winding() {
    for name in CLOSED {
        for count in ["12", "50", "998", "20k"] {
            let mesh = mesh(&format!("proc:{name},tris={count},seed=3"));
            let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
            for &[a, b, c] in &mesh.triangles {
                assert!(a != b && b != c && c != a);
                for edge in [(a, b), (b, c), (c, a)] {
                    *edges.entry(edge).or_default() += 1;
                }
            }
            for (&(a, b), &times) in &edges {
                assert_eq!(times, 1, "{name} {count}: edge {a}-{b} is used twice in one direction");
                assert!(edges.contains_key(&(b, a)), "{name} {count}: edge {a}-{b} is open");
            }
        }
    }
}

#[test]
fn closed_meshes_face_outwards() {
    for name in CLOSED {
        for count in ["12", "5k"] {
            let mesh = mesh(&format!("proc:{name},tris={count}"));
            let volume: f64 = mesh
                .triangles
                .iter()
                .map(|t| t.map(|i| mesh.positions[i as usize].as_dvec3()))
                .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
                .sum();
            assert!(volume > 0.0, "{name} {count}: {volume}");
        }
    }
    let sphere = mesh("proc:sphere,tris=100k");
    let volume: f64 = sphere
        .triangles
        .iter()
        .map(|t| t.map(|i| sphere.positions[i as usize].as_dvec3()))
        .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
        .sum();
    assert!((volume - 4.0 / 3.0 * std::f64::consts::PI).abs() < 1e-3, "{volume}");
}

#[test]
fn everything_is_finite_in_range_and_normals_are_unit() {
    for (name, _) in Family::ALL {
        for count in ["12", "2k", "50k"] {
            let mesh = mesh(&format!("proc:{name},tris={count},seed=9"));
            assert!(mesh.positions.iter().all(|p| p.is_finite() && p.length() < 3.0), "{name}");
            assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5), "{name}");
            assert!(mesh.normals.is_empty() || mesh.normals.len() == mesh.positions.len(), "{name}");
            assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < mesh.positions.len()), "{name}");
        }
    }
}

/// The vertex normals come from formulas: they must agree with the triangles, nearly everywhere and nearly exactly.
#[test]
fn vertex_normals_agree_with_the_surface() {
    for name in ["sphere", "torus", "knot", "blob", "coral", "terrain"] {
        let mesh = mesh(&format!("proc:{name},tris=400k"));
        let mut worst_mean: f64 = 0.0;
        let mut against = 0usize;
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize].as_dvec3());
            let face = (b - a).cross(c - a).normalize_or_zero();
            let mean: DVec3 = t.iter().map(|&i| mesh.normals[i as usize].as_dvec3()).sum();
            let cosine = face.dot(mean.normalize());
            worst_mean += 1.0 - cosine;
            against += usize::from(cosine < 0.7);
        }
        worst_mean /= mesh.triangles.len() as f64;
        assert!(worst_mean < 5e-3, "{name}: mean 1 − cos is {worst_mean}");
        assert!(against * 1000 < mesh.triangles.len(), "{name}: {against} triangles disagree");
    }
}

#[test]
fn meshes_are_the_same_for_any_number_of_threads() {
    let make = |threads: usize, spec: &str| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| mesh(spec))
    };
    for (name, _) in Family::ALL {
        let spec = format!("proc:{name},tris=30k,seed=5");
        let (one, five) = (make(1, &spec), make(5, &spec));
        assert!(bits(&one) == bits(&five), "{name}");
    }
}

#[test]
fn seeds_change_what_is_random() {
    for name in ["knot", "terrain", "blob", "coral", "soup", "cubes"] {
        let spec = |seed| format!("proc:{name},tris=1k,seed={seed}");
        assert!(bits(&mesh(&spec(0))) != bits(&mesh(&spec(1))), "{name}");
    }
}

fn bits(mesh: &MeshDescription) -> (Vec<u32>, Vec<u32>, &[[u32; 3]]) {
    let words = |vectors: &[glam::Vec3]| vectors.iter().flat_map(|v| v.to_array()).map(f32::to_bits).collect();
    (words(&mesh.positions), words(&mesh.normals), &mesh.triangles)
}
