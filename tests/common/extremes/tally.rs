//! What is counted, and how it is printed.

use super::subjects::NAMES;
use serde_json::{Value, json};

/// Counts of one subject in one cell of the grid.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Rays aimed at the scene.
    pub rays: u64,
    /// Questions asked about them: closest hit and any hit.
    pub traced: u64,
    /// Rays that certainly hit, of which the tracer says nothing, or something that lies behind.
    pub misses: u64,
    /// Rays that truly hit, but by less than the bound, of which the tracer says nothing.
    pub grazed: u64,
    /// Hits whose point lies farther from the primitive than the bound; occlusion where nothing is within the bound.
    pub false_hits: u64,
    /// Rays that left a surface.
    pub left: u64,
    /// Of these, those that hit the surface that they left.
    pub self_hits: u64,
    /// Rays that left a surface of a closed mesh through a neighbouring face, by less than the bound: what follows of them is not counted.
    pub outside: u64,
    /// The first failure, for people.
    pub first: Option<String>,
}

impl Tally {
    /// Adds the counts of `other`.
    pub fn add(&mut self, other: &Tally) {
        self.rays += other.rays;
        self.traced += other.traced;
        self.misses += other.misses;
        self.grazed += other.grazed;
        self.false_hits += other.false_hits;
        self.left += other.left;
        self.self_hits += other.self_hits;
        self.outside += other.outside;
        if self.first.is_none() {
            self.first.clone_from(&other.first);
        }
    }

    /// Notes a failure.
    pub fn fail(&mut self, what: impl FnOnce() -> String) {
        self.first.get_or_insert_with(what);
    }

    /// Misses, false hits and self-hits together.
    pub fn failures(&self) -> u64 {
        self.misses + self.false_hits + self.self_hits
    }
}

/// One subject in one cell.
#[derive(Clone, Debug)]
pub struct Row {
    pub case: &'static str,
    pub scale: f64,
    pub distance: f64,
    /// Whether positions have 48 bits.
    pub fine: bool,
    pub subject: usize,
    /// Whether its rays are its own: a walk, by no other tracer.
    pub walk: bool,
    pub tally: Tally,
}

impl Row {
    /// For `--json`.
    pub fn json(&self) -> Value {
        let Tally { rays, traced, misses, grazed, false_hits, left, self_hits, outside, first } = &self.tally;
        json!({
            "case": self.case, "scale": self.scale, "distance": self.distance, "fine": self.fine, "walk": self.walk, "subject": NAMES[self.subject],
            "rays": rays, "traced": traced, "misses": misses, "misses_within_bound": grazed,
            "false_hits": false_hits, "left": left, "self_hits": self_hits, "outside": outside, "first": first,
        })
    }

    /// The head of `--csv`.
    pub const CSV: &'static str = "case,scale,distance,fine,walk,subject,rays,traced,misses,misses_within_bound,false_hits,left,self_hits,outside";

    /// A line for `--csv`.
    pub fn csv(&self) -> String {
        let Tally { rays, traced, misses, grazed, false_hits, left, self_hits, outside, .. } = &self.tally;
        format!(
            "\"{}\",{:e},{:e},{},{},\"{}\",{rays},{traced},{misses},{grazed},{false_hits},{left},{self_hits},{outside}",
            self.case, self.scale, self.distance, self.fine, self.walk, NAMES[self.subject],
        )
    }
}

/// A share of rays: exactly 0, or in scientific notation.
fn rate(count: u64, of: u64) -> String {
    match (count, of) {
        (_, 0) => "–".into(),
        (0, _) => "0".into(),
        _ => format!("{:.1e}", count as f64 / of as f64),
    }
}

/// A table of the rows with equal `key`, a line each, and three columns for each subject that has any: rates of misses, false hits and self-hits.
pub fn table(title: &str, rows: &[Row], key: impl Fn(&Row) -> String) -> String {
    let mut keys: Vec<String> = Vec::new();
    for row in rows {
        let key = key(row);
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    let subjects: Vec<usize> =
        (0..NAMES.len()).filter(|&subject| rows.iter().any(|row| row.subject == subject)).collect();
    let mut lines = vec![vec![title.to_owned(), "rays".to_owned()]];
    lines[0].extend(subjects.iter().map(|&subject| format!("{}: miss / false / self", NAMES[subject])));
    for wanted in &keys {
        let sum = |subject: usize| {
            let mut sum = Tally::default();
            rows.iter().filter(|row| row.subject == subject && key(row) == *wanted).for_each(|row| sum.add(&row.tally));
            sum
        };
        let sums: Vec<Tally> = subjects.iter().map(|&subject| sum(subject)).collect();
        let mut line = vec![wanted.clone(), format!("{:.1e}", sums[0].rays as f64)];
        line.extend(sums.iter().map(|sum| match sum.rays {
            0 => "–".into(),
            rays => {
                let rates = [(sum.misses, rays), (sum.false_hits, rays), (sum.self_hits, sum.left)];
                rates.map(|(count, of)| rate(count, of)).join(" / ")
            }
        }));
        lines.push(line);
    }
    aligned(&lines)
}

/// Columns of equal width.
pub fn aligned(lines: &[Vec<String>]) -> String {
    let width = |column: usize| lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..lines[0].len()).map(width).collect();
    let mut text = String::new();
    for line in lines {
        for (column, (cell, width)) in line.iter().zip(&widths).enumerate() {
            let room = " ".repeat(width - cell.chars().count());
            text += &if column == 0 { format!("{cell}{room}") } else { format!("  {room}{cell}") };
        }
        text = text.trim_end().to_owned() + "\n";
    }
    text
}
