//! What `comber trade` prints.

use super::Traded;
use super::cells::{SLOPE_HEADINGS, headings, row, slope_row};
use crate::cli::report::{self, Facts, table};
use crate::measure::units;
use crate::trade::measure::End;

/// All that was found.
pub fn of(traded: &Traded) -> String {
    let knobs = traded.options.vary.len();
    let rows = (0..traded.configurations.len()).map(|number| row(traded, number));
    let mut text = format!("{}\n\n", table(headings(traded), knobs, rows));
    let slopes: Vec<[String; 4]> = traded.groups.iter().filter_map(|group| slope_row(traded, group)).collect();
    if !slopes.is_empty() {
        text += &format!("{}\n\n", table(SLOPE_HEADINGS, 1, slopes.into_iter()));
    }
    let mut facts = Facts::default();
    all_facts(traded).into_iter().for_each(|[name, value]| facts.add(&name, value));
    text + &facts.text() + "\n"
}

/// How it was measured.
pub fn all_facts(traded: &Traded) -> Vec<[String; 2]> {
    let plan = traded.plan;
    let mut facts = vec![
        ["scene".to_owned(), report::scene_line(traded.loaded)],
        ["picture".to_owned(), report::picture_line(&plan.options)],
        ["reference".to_owned(), reference(traded)],
        ["machine".to_owned(), format!("{}, {} threads, {}", crate::measure::processor::name(), plan.threads, plan.simd)],
        ["renders".to_owned(), renders(traded)],
        [
            "MSE".to_owned(),
            "mean squared error of a render ± its standard error; relMSE likewise, ε = 0.01; both without the noise of the \
             reference"
                .into(),
        ],
        [
            "bias".to_owned(),
            format!(
                "seen where bias², pixels weighted by 1 over the squared brightness around them, is more than {:.2} standard \
                 errors above 0 (α = 0.05 for all together, Šidák)",
                traded.limit
            ),
        ],
        [
            "front".to_owned(),
            "no other is as fast and as accurate and better in one; tie: none is so clearly".into(),
        ],
    ];
    let mut builds: Vec<f64> = traded.build.clone();
    builds.sort_by(f64::total_cmp);
    builds.dedup();
    let builds: Vec<String> = builds.into_iter().map(report::seconds).collect();
    facts.insert(5, ["tree".to_owned(), format!("built in {}, not part of times", builds.join(" to "))]);
    let left_out: u64 = traded.figures.iter().flatten().map(|f| f.non_finite).sum();
    if left_out > 0 {
        facts.push(["left out".to_owned(), format!("{} samples that are not finite", units::count(left_out))]);
    }
    let files = traded.options.html.iter().chain(&traded.options.csv);
    facts.extend(files.map(|path| ["file".to_owned(), path.display().to_string()]));
    facts
}

fn reference(traded: &Traded) -> String {
    let errors = if traded.known { "with standard errors" } else { "without standard errors: counts as exact" };
    format!("{}, {errors}", traded.reference)
}

/// How many there were, and why not more.
fn renders(traded: &Traded) -> String {
    let runs = traded.figures.iter().map(|f| f.map_or(0, |f| f.runs));
    let (fewest, most) = runs.clone().fold((usize::MAX, 0), |(low, high), n| (low.min(n), high.max(n)));
    let each = if fewest == most { most.to_string() } else { format!("{fewest} to {most}") };
    let disturbed: usize = traded.figures.iter().flatten().map(|f| f.disturbed).sum();
    let mut line = format!("{each} of each configuration, in turns");
    if disturbed > 0 {
        line += &format!("; {disturbed} of {} were disturbed by something else", runs.sum::<usize>());
    }
    line += match traded.end {
        End::Finished => "",
        End::Budget => "; then time was up",
        End::Stopped => "; then it was interrupted",
    };
    line
}
