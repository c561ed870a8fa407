//! Pictures of differences.

use super::Diffed;
use crate::compare::maps;
use crate::compare::pair::Pair;
use crate::film::heatmap::{Colours, HeatMap, Scale};

/// Ends of the names of files.
pub const ENDS: [&str; 4] = ["signed", "relative", "flip", "z"];

/// Share of pixels whose colours are told apart; a few outliers shall not make all else one colour.
const SHARE: f64 = 0.99;

/// A map to be drawn.
pub struct Map {
    /// End of the file's name.
    pub end: &'static str,
    /// What it shows, in the picture.
    pub title: String,
    /// What it shows, under the picture.
    pub caption: &'static str,
    /// A value a pixel.
    pub values: Vec<f32>,
    colours: Colours,
    range: [f64; 2],
}

impl Map {
    /// The whole map.
    pub fn heat_map(&self, pair: &Pair) -> HeatMap<'_> {
        self.of(pair.width, pair.height, &self.values)
    }

    /// Other values in the colours of this.
    pub fn of<'a>(&'a self, width: usize, height: usize, values: &'a [f32]) -> HeatMap<'a> {
        let (colours, range) = (self.colours, Some(self.range));
        HeatMap { width, height, values, title: &self.title, unit: "", scale: Scale::Linear, colours, range }
    }
}

/// All maps that can be made.
pub fn all(diffed: &Diffed) -> Vec<Map> {
    let (pair, figures) = (diffed.pair, &diffed.compared.figures);
    let epsilon = figures.settings.epsilon;
    let bound = |values: &[f32]| {
        let bounds = [SHARE, 1.0].map(|share| maps::bound(values, share));
        bounds.into_iter().find(|&bound| bound > 0.0).unwrap_or(1.0)
    };
    let signed = maps::signed(pair);
    let most = bound(&signed);
    let relative = maps::relative(pair, epsilon);
    let most_relative = bound(&relative);
    let flip = diffed.compared.flip_map.iter().zip(&pair.usable);
    let mut all = vec![
        Map {
            end: ENDS[0],
            title: "A - B, luminance (red: A is brighter)".into(),
            caption: "A − B of luminance: red where A is brighter, blue where B is. 99 % of pixels lie within the colours.",
            values: signed,
            colours: Colours::Signed,
            range: [-most, most],
        },
        Map {
            end: ENDS[1],
            title: format!("|A - B| / (|B| + {epsilon}), luminance"),
            caption: "Relative difference of luminance. 99 % of pixels lie within the colours.",
            values: relative,
            colours: Colours::Viridis,
            range: [0.0, most_relative],
        },
        Map {
            end: ENDS[2],
            title: format!("FLIP error, {} pixels a degree", figures.settings.pixels_per_degree),
            caption: "How different the pictures look to someone who flips between them: 0 not at all, 1 as green and blue.",
            values: flip.map(|(&error, &usable)| if usable { error } else { f32::NAN }).collect(),
            colours: Colours::Magma,
            range: [0.0, 1.0],
        },
    ];
    if let Some(test) = &figures.z_test {
        all.push(Map {
            end: ENDS[3],
            title: format!("z of the worst channel (limit {:.2})", test.limit),
            caption: "Difference in standard errors, of the channel where it is largest. The colours end at the limit of the \
                      test: what has the last colour fails.",
            values: maps::z(pair),
            colours: Colours::Signed,
            range: [-test.limit, test.limit],
        });
    }
    all
}
