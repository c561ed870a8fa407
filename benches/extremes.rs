//! Misses, false hits and self-hits at the extremes of scale, distance and shape: comber beside Embree.
//!
//! `cargo bench --bench extremes -- [--rays 1e9] [--judged 5e7] [--run N] [--threads N] [--csv FILE] [--json FILE]`. Of the rays, those of `--judged` are traced by
//! every tracer and judged exactly, shared out among the cells of the grid (`tests/common/extremes`), and a quarter as many at positions of 48 bits by the tree in double
//! precision alone; the others walk inside closed meshes, each traced by
//! comber's watertight test through one of its kernels, in turn. Without `--rays`, a million. Rays differ from `--run` to run: counts of several add up.

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/common/extremes/mod.rs"]
mod extremes;

use comber::film::atomic_file;
use comber::measure::progress::Progress;
use extremes::tally::{Row, Tally, aligned, table};
use extremes::{DISTANCES, SCALES, places, subjects};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

struct Arguments {
    rays: u64,
    judged: u64,
    run: u64,
    threads: usize,
    csv: Option<PathBuf>,
    json: Option<PathBuf>,
}

impl Arguments {
    fn parse() -> Result<Arguments, String> {
        let mut arguments = Arguments { rays: 1_000_000, judged: 0, run: 0, threads: 0, csv: None, json: None };
        let mut judged = None;
        let mut words = std::env::args().skip(1);
        while let Some(word) = words.next() {
            let mut value = || words.next().ok_or(format!("{word} needs a value"));
            let number = |text: String| match text.parse::<f64>() {
                Ok(number) if (0.0..=1e15).contains(&number) => Ok(number as u64),
                _ => Err(format!("{text} is no number of rays; expected 0 to 1e15, as in 1e9")),
            };
            match word.as_str() {
                "--rays" => arguments.rays = number(value()?)?,
                "--judged" => judged = Some(number(value()?)?),
                "--run" => arguments.run = number(value()?)?,
                "--threads" => arguments.threads = number(value()?)? as usize,
                "--csv" => arguments.csv = Some(value()?.into()),
                "--json" => arguments.json = Some(value()?.into()),
                // What cargo says.
                "--bench" => {}
                _ => return Err(format!("{word}: expected --rays, --judged, --run, --threads, --csv or --json")),
            }
        }
        arguments.judged = judged.unwrap_or(arguments.rays / 20).min(arguments.rays);
        Ok(arguments)
    }
}

fn main() {
    let arguments = Arguments::parse().unwrap_or_else(|why| {
        eprintln!("{why}");
        std::process::exit(2);
    });
    if let Err(why) = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads).build_global() {
        eprintln!("{why}");
        std::process::exit(1);
    }
    match run(&arguments) {
        Ok(0) => {}
        Ok(failures) => {
            eprintln!("{failures} failures of the watertight test or of double precision");
            std::process::exit(1);
        }
        Err(why) => {
            eprintln!("{why}");
            std::process::exit(1);
        }
    }
}

/// Runs all, and gives the number of failures of what comber promises not to fail.
fn run(arguments: &Arguments) -> comber::error::Result<u64> {
    let places = places(&SCALES, &DISTANCES);
    let embree = subjects::embree();
    if let Some(device) = &embree {
        println!("beside Embree {}", device.version);
    }
    let start = Instant::now();
    let progress = Progress::new("judged rays", arguments.judged, true);
    let done = std::sync::atomic::AtomicU64::new(0);
    let told = |progress: &Progress, rays: u64| {
        progress.set(done.fetch_add(rays, std::sync::atomic::Ordering::Relaxed) + rays);
    };
    let each = arguments.judged.div_ceil(extremes::cells(&places));
    let judged = extremes::judged(arguments.run, &places, each, embree.as_ref(), |rays| told(&progress, rays));
    progress.finish();
    println!("\nShares of the rays that miss what they certainly hit / hit what they miss / hit what they left\n");
    println!("{}", table("case", &judged, |row| row.case.to_owned()));
    println!(
        "{}",
        table("distance from the origin, in sizes of the scene", &judged, |row| format!("{:e}", row.distance))
    );
    println!("{}", table("scale", &judged, |row| format!("{:e}", row.scale)));

    let fine_places = extremes::fine();
    let fine_rays = arguments.judged / 4;
    let progress = Progress::new("rays at positions of 48 bits", fine_rays, true);
    done.store(0, std::sync::atomic::Ordering::Relaxed);
    let each = fine_rays.div_ceil(extremes::cells(&fine_places));
    let fine = extremes::judged(arguments.run, &fine_places, each, None, |rays| told(&progress, rays));
    progress.finish();
    println!("The same, where positions have 48 bits, as only --precision f64 has them\n");
    println!("{}", table("case", &fine, |row| row.case.to_owned()));
    println!(
        "{}",
        table("distance from the origin, in sizes of the scene", &fine, |row| format!("{:e}", row.distance))
    );

    let progress = Progress::new("rays in closed meshes", arguments.rays - arguments.judged, true);
    done.store(0, std::sync::atomic::Ordering::Relaxed);
    let closed =
        extremes::closed(arguments.run, &places, arguments.rays - arguments.judged, |rays| told(&progress, rays));
    progress.finish();
    println!("Walks in closed meshes by the watertight test, each ray through one of the kernels in turn\n");
    println!("{}", walks(&closed));

    let rows: Vec<Row> = judged.into_iter().chain(fine).chain(closed).collect();
    let distinct: u64 = rows.iter().filter(|row| row.subject == 0 || row.fine).map(|row| row.tally.rays).sum::<u64>()
        + rows.iter().filter(|row| row.subject == 1 && row.walk).map(|row| row.tally.rays).sum::<u64>();
    let traced: u64 = rows.iter().map(|row| row.tally.traced + row.tally.left * u64::from(!row.walk)).sum();
    println!("{distinct} rays, {traced} questions, {:.0} s", start.elapsed().as_secs_f64());
    let own = |row: &&Row| subjects::promised(row.subject) && row.tally.failures() > 0;
    for row in rows.iter().filter(own).take(10) {
        let first = row.tally.first.as_deref().unwrap_or_default();
        println!("{} at scale {:e}, distance {:e}: {first}", row.case, row.scale, row.distance);
    }
    if let Some(path) = &arguments.csv {
        let lines = std::iter::once(Row::CSV.to_owned()).chain(rows.iter().map(Row::csv));
        write(path, &(lines.collect::<Vec<_>>().join("\n") + "\n"))?;
    }
    if let Some(path) = &arguments.json {
        let rows: Vec<_> = rows.iter().map(Row::json).collect();
        write(path, &format!("{:#}\n", serde_json::Value::from(rows)))?;
    }
    Ok(rows.iter().filter(own).map(|row| row.tally.failures()).sum())
}

/// The table of closed meshes.
fn walks(rows: &[Row]) -> String {
    let mut lines = vec![
        ["mesh", "nodes", "rays", "misses", "within the bound", "false hits", "left", "self-hits", "left outside"]
            .map(str::to_owned)
            .to_vec(),
    ];
    let mut sums: Vec<((&str, usize), Tally)> = Vec::new();
    for row in rows {
        let key = (row.case, row.subject);
        match sums.iter_mut().find(|(known, _)| *known == key) {
            Some((_, sum)) => sum.add(&row.tally),
            None => sums.push((key, row.tally.clone())),
        }
    }
    for ((case, subject), t) in sums {
        let numbers = [t.rays, t.misses, t.grazed, t.false_hits, t.left, t.self_hits, t.outside];
        let mut line = vec![case.to_owned(), ["full", "compact"][subject].to_owned()];
        line.extend(numbers.map(|number| number.to_string()));
        lines.push(line);
    }
    aligned(&lines)
}

fn write(path: &Path, text: &str) -> comber::error::Result<()> {
    atomic_file::write(path, |out| {
        out.write_all(text.as_bytes()).map_err(|e| comber::error::Error::io(path, "write", e))
    })
}
