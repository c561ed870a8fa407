//! A picture of every group of configurations, each with as many samples as take the same time.

use super::Traded;
use crate::bench::probe::Probe;
use crate::bench::statistics::Quartiles;
use crate::cli::args::MAX_SAMPLES;
use crate::cli::interrupt::Interrupt;
use crate::error::Result;
use crate::measure::progress::Progress;
use crate::observer::Observer;
use crate::options::RenderOptions;
use crate::trade::measure::{EXTRA_RUN, Subject, render};
use crate::trade::truth::Truth;
use crate::trade::{Configuration, Run};

/// Most pictures: a page of more takes long to load.
const MOST: usize = 24;

/// The pictures.
pub struct EqualTime {
    /// Seconds that each was to take.
    pub seconds: f64,
    /// In the order of groups.
    pub pictures: Vec<Thumbnail>,
}

/// A picture of a group.
pub struct Thumbnail {
    /// Number of the group.
    pub group: usize,
    /// Time and errors.
    pub run: Run,
    /// Linear colours.
    pub pixels: Vec<[f32; 3]>,
}

impl EqualTime {
    /// Renders them: at the median time of all configurations. None if it was interrupted.
    pub fn render(
        traded: &Traded,
        subject: Subject,
        truth: &Truth,
        interrupt: &Interrupt,
        show: bool,
    ) -> Result<Option<EqualTime>> {
        let seconds = Quartiles::of(traded.figures.iter().flatten().map(|figures| figures.seconds.median)).median;
        let progress = Progress::new("pictures at equal time", traded.groups.len() as u64, show);
        let (mut pictures, mut probe) = (Vec::new(), Probe::new());
        for (number, group) in traded.groups.iter().enumerate().take(MOST) {
            // The configuration whose time is nearest needs the least scaling.
            let distance = |number: usize| {
                traded.figures[number].map_or(f64::INFINITY, |f| (f.seconds.median / seconds).ln().abs())
            };
            let nearest = group.members.iter().copied().min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
            let Some((nearest, figures)) = nearest.and_then(|number| Some((number, traded.figures[number]?))) else {
                continue;
            };
            let options = &traded.configurations[nearest].options;
            // Adaptive sampling ends when it ends.
            let scale = if options.adaptive.is_some() { 1.0 } else { seconds / figures.seconds.median };
            let samples = (f64::from(options.samples) * scale).round().clamp(1.0, f64::from(MAX_SAMPLES)) as u32;
            let configuration =
                Configuration { values: Vec::new(), options: RenderOptions { samples, ..options.clone() } };
            let watch = Watch { interrupt };
            let Some((run, pixels)) = render(subject, &configuration, nearest, EXTRA_RUN, truth, &mut probe, &watch)?
            else {
                return Ok(None);
            };
            pictures.push(Thumbnail { group: number, run, pixels });
            progress.set(number as u64 + 1);
        }
        progress.finish();
        Ok(Some(EqualTime { seconds, pictures }))
    }
}

struct Watch<'a> {
    interrupt: &'a Interrupt,
}

impl Observer for Watch<'_> {
    fn stop(&self) -> bool {
        self.interrupt.stop_requested()
    }
}
