//! A short run of the grid of extremes. The long one is `cargo bench --bench extremes`.

mod common;
#[path = "common/extremes/mod.rs"]
mod extremes;

use extremes::tally::{Row, table};
use extremes::{DISTANCES, SCALES, places, subjects};

/// The first few failures.
fn failures(rows: &[&Row]) -> String {
    let failed = rows.iter().filter(|row| row.tally.failures() > 0).take(12);
    let told = failed.map(|row| {
        let (t, name) = (&row.tally, subjects::NAMES[row.subject]);
        format!(
            "{name}, {}, scale {:e}, distance {:e}: {} misses, {} false, {} self of {}: {}\n",
            row.case,
            row.scale,
            row.distance,
            t.misses,
            t.false_hits,
            t.self_hits,
            t.rays,
            t.first.as_deref().unwrap_or("")
        )
    });
    told.collect()
}

#[test]
fn neither_the_watertight_test_nor_double_precision_misses_lies_or_hits_what_rays_left() {
    let rows = extremes::judged(0, &places(&SCALES, &DISTANCES), 2048, None, |_| ());
    println!("{}", table("case", &rows, |row| row.case.to_owned()));
    let promised: Vec<&Row> = rows.iter().filter(|row| subjects::promised(row.subject)).collect();
    let failed: u64 = promised.iter().map(|row| row.tally.failures()).sum();
    assert_eq!(failed, 0, "\n{}", failures(&promised));
}

/// Positions of 48 bits, far from the origin: only the tree in double precision knows them.
#[test]
fn double_precision_holds_where_single_precision_has_no_place_for_the_scene() {
    let rows = extremes::judged(0, &extremes::fine(), 2048, None, |_| ());
    println!("{}", table("case", &rows, |row| row.case.to_owned()));
    println!("{}", table("distance", &rows, |row| format!("{:e}", row.distance)));
    let failed: u64 = rows.iter().map(|row| row.tally.failures()).sum();
    assert!(rows.iter().all(|row| row.fine && subjects::promised(row.subject)) && rows.len() > 400);
    assert_eq!(failed, 0, "\n{}", failures(&rows.iter().collect::<Vec<_>>()));
}

#[test]
fn no_ray_leaves_a_closed_mesh_nor_hits_what_it_left() {
    let rows = extremes::closed(0, &places(&SCALES, &DISTANCES), 10_000_000, |_| ());
    println!("{}", table("case", &rows, |row| row.case.to_owned()));
    let failed: u64 = rows.iter().map(|row| row.tally.failures()).sum();
    assert_eq!(failed, 0, "\n{}", failures(&rows.iter().collect::<Vec<_>>()));
}
