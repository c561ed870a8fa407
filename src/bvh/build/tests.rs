//! Every parallel or clever step of a build against its simple twin.

use glam::Vec3;

use super::binning::Bins;
use super::bvh2::{Binary, Node2};
use super::course::Course;
use super::fragment::{Extent, Fragment};
use super::linked::{Linked, NONE};
use super::reinsertion::{MUCH, best_move, improve};
use super::top_down::TopDown;
use crate::bvh::Bvh4;
use crate::bvh::aabb::Aabb;
use crate::options::{AccelOptions, Quality};
use crate::simd::Tier;

/// Small boxes and a few large ones in the unit cube.
fn random_fragments(count: u32) -> Vec<Fragment> {
    let mut state = 1u32;
    let mut random = || {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    let mut fragment = |prim| {
        let center = Vec3::new(random(), random(), random());
        let size = if prim % 500 == 0 { 0.5 } else { 0.01 };
        let half = size * Vec3::new(random(), random(), random());
        Fragment::new(prim, &Aabb { min: center - half, max: center + half })
    };
    (0..count).map(&mut fragment).collect()
}

fn silent() -> Course<'static> {
    Course::new(&|_, _| {}, 0, Quality::Default)
}

/// A tree over some, and how many of them are to be triangles.
pub fn random_tree(count: u32) -> (Binary, u32) {
    let (mut fragments, triangles) = (random_fragments(count), count - count / 10);
    let nodes = TopDown { triangles, scale: 1.0, tier: Tier::Baseline, course: &silent() }.build(&mut fragments, None);
    (Binary { nodes, order: fragments.iter().map(Fragment::prim).collect() }, triangles)
}

#[test]
fn builds_tell_how_far_they_have_come() {
    let soup = crate::scene::procedural::generate("proc:soup,tris=50k").unwrap();
    let shapes = crate::scene::Scene::build(soup, Default::default()).unwrap().shapes;
    for quality in [Quality::Fast, Quality::Default, Quality::Best] {
        let told = std::sync::Mutex::new(Vec::new());
        let tell = |done, all| told.lock().unwrap().push((done, all));
        Bvh4::build_watched(&shapes, &AccelOptions { quality, ..AccelOptions::default() }, &tell).unwrap();
        let told = told.into_inner().unwrap();
        let most = told.iter().map(|&(done, _)| done).max();
        assert_eq!(most, Some(told[0].1), "{quality:?}: all of it in the end");
        assert!(told.iter().all(|&(done, all)| done <= all && all == told[0].1), "{quality:?}");
        assert!(told.len() > 10, "{quality:?}: by and by");
    }
}

#[test]
fn many_fragments_are_split_like_few() {
    let fragments = random_fragments(200_000);
    let extent = Extent::of(&fragments);
    let few = Bins::new().best_split(&fragments, &extent, 1.0).unwrap();
    let many = Bins::best_split_of_many(&fragments, &extent, 1.0).unwrap();
    assert!(fragments.iter().all(|fragment| few.is_left(fragment) == many.is_left(fragment)));
}

#[test]
fn tiers_build_the_same_tree() {
    let build = |tier| {
        let mut fragments = random_fragments(20_000);
        let nodes = TopDown { triangles: 20_000, scale: 1.0, tier, course: &silent() }.build(&mut fragments, None);
        (format!("{nodes:?}"), fragments.iter().map(Fragment::prim).collect::<Vec<_>>())
    };
    let expected = build(Tier::Baseline);
    for tier in Tier::available() {
        assert_eq!(build(tier), expected, "{}", tier.name());
    }
}

/// Checks that boxes hold what is below them and counts are right; gives the sum of the areas of inner nodes.
fn checked_area(nodes: &[Node2]) -> f64 {
    let mut area = 0.0;
    for (index, node) in nodes.iter().enumerate() {
        if let Some((left, right)) = node.children(index) {
            assert_eq!(node.count, nodes[left].count + nodes[right].count);
            assert_eq!(node.aabb(), nodes[left].aabb().union(nodes[right].aabb()));
            area += f64::from(node.aabb().half_area(1.0));
        }
    }
    area
}

#[test]
fn reinsertion_keeps_all_primitives_and_makes_the_tree_smaller() {
    let (binary, _) = random_tree(20_000);
    let before = checked_area(&binary.nodes);
    let (nodes, mut prims) = (binary.nodes.len(), binary.order.clone());
    let better = improve(binary, &MUCH, 1.0, Tier::Baseline, &silent());
    let after = checked_area(&better.nodes);
    assert_eq!(better.nodes.len(), nodes);
    assert!(after < 0.95 * before, "{before} → {after}");
    let mut kept = better.order;
    prims.sort_unstable();
    kept.sort_unstable();
    assert_eq!(kept, prims);
}

#[test]
fn searches_find_the_best_place() {
    let (binary, _) = random_tree(150);
    let linked = || Linked::of_largest(&binary.nodes, usize::MAX, 1.0);
    let tree = linked();
    let before = tree.area(1.0);
    for node in 0..tree.len() as u32 {
        let parent = tree.parent(node);
        if parent == NONE || tree.parent(parent) == NONE {
            assert!(best_move(&tree, node, 1.0).is_none());
            continue;
        }
        // Every place there is.
        let gain_at = |to: u32| {
            let mut moved = linked();
            moved.reinsert(node, to);
            before - moved.area(1.0)
        };
        let allowed = |&to: &u32| to != 0 && to != parent && to != tree.sibling(node) && !tree.is_below(to, node);
        let best = (0..tree.len() as u32).filter(allowed).map(gain_at).fold(0.0, f64::max);
        let found = best_move(&tree, node, 1.0).map_or(0.0, gain_at);
        assert!((best - found).abs() < 1e-4, "node {node}: {found} found, {best} possible");
    }
}
