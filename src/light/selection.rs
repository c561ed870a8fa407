//! Which part of which light a shadow sample asks.

use super::Light;
use super::tree::LightTree;
use crate::measure::units;
use crate::options::{Direct, LightSelection, Precision, RenderOptions};
use crate::sampling::v3::V3;
use std::sync::Arc;

/// Scenes with more lights than this are not asked for each of them, unless that is what the options say; and no more shadow rays
/// than this leave a vertex for each of `--light-samples`.
pub const MOST_LIGHTS_EACH: usize = 16;

/// An emissive mesh of more triangles than this is worth a tree.
///
/// By efficiency, 1 / (variance × processor time), in direct light (`cargo bench --bench lights`): the tree ÷ drawing by power has 3.3 for
/// 100 lamps and 2.2 for 10⁴; the tree ÷ triangles by power has 16, 20, 9 and 5 for a mesh of 4, 16, 100 and 10⁴. Asking each of 1, 4, 16 and 100
/// lamps ÷ the tree has 1.4, 2.2, 6.8 and 2.1, for as many rays as lamps.
const MOST_TRIANGLES_BY_POWER: u32 = 2;

/// Of more emitters than this no tree is built unless it is asked for: some 300 MiB.
const MOST_EMITTERS: usize = 1 << 22;

/// Which lights shadow samples ask.
#[derive(Clone, Debug)]
pub enum Selection {
    /// Each light, so many times.
    Each(u32),
    /// A light in proportion to its power.
    Power {
        /// Each light's share of the power of all.
        shares: Vec<f32>,
        /// Running sums of those.
        sums: Vec<f32>,
    },
    /// A part of a light in proportion to a bound of what arrives from it.
    Tree(Arc<LightTree>),
}

/// A part of a light.
#[derive(Clone, Copy, Debug)]
pub struct Chosen {
    /// Number of the light.
    pub id: usize,
    /// Which part of it.
    pub part: u32,
    /// Expected number of samples of it at the vertex.
    pub rate: f32,
}

impl Selection {
    /// How the options and the number of lights choose among them.
    pub fn new(options: &RenderOptions, lights: &[Light]) -> Selection {
        let each = Selection::Each(options.light_samples);
        let asks = matches!(options.direct, Direct::Light | Direct::Mis);
        let last = options.integrator.bounces(options.max_depth).map_or(0, |(_, last)| last);
        if !asks || last == 0 {
            return each;
        }
        match options.light_selection {
            LightSelection::Each => each,
            LightSelection::Auto if few(lights) => each,
            // The tree measures distances in single precision.
            LightSelection::Auto if options.accel.precision == Precision::F64 => match lights.len() {
                ..=MOST_LIGHTS_EACH => each,
                _ => by_power(lights),
            },
            LightSelection::Auto if emitters(lights) > MOST_EMITTERS => by_power(lights),
            LightSelection::Power => by_power(lights),
            LightSelection::Auto | LightSelection::Tree => Selection::Tree(Arc::new(LightTree::new(lights))),
        }
    }

    /// Shadow rays a vertex.
    pub fn rays(&self, options: &RenderOptions, lights: &[Light]) -> u32 {
        let count = lights.len() as u32;
        match (options.direct, self) {
            (Direct::Bsdf, _) => 0,
            // The plan refuses what is too much.
            (Direct::Light | Direct::Mis, Selection::Each(each)) => each.saturating_mul(count).min(u32::MAX - 1),
            _ => options.light_samples * count.min(MOST_LIGHTS_EACH as u32),
        }
    }

    /// The part that number `k` of `rays` samples asks from a point of a surface with unit `normal`, by two numbers in [0, 1); `None`
    /// where no light can arrive.
    #[inline(always)]
    pub fn choose(
        &self,
        lights: &[Light],
        [k, rays]: [u32; 2],
        [u, v]: [f32; 2],
        from: V3,
        normal: V3,
    ) -> Option<Chosen> {
        let (id, rate) = match self {
            Selection::Each(each) => ((k / each) as usize, *each as f32),
            Selection::Power { shares, sums } => {
                let id = sums.partition_point(|&sum| sum <= v).min(sums.len() - 1);
                (id, shares[id] * rays as f32)
            }
            Selection::Tree(tree) => {
                // Two numbers of 24 bits make one of 48: among 10⁷ emitters each still has its share.
                let digits = f64::from(v) + f64::from(u) * (1.0 / f64::from(1 << 24));
                let picked = tree.pick(from, normal, digits)?;
                let rate = picked.probability * rays as f32;
                return Some(Chosen { id: picked.light, part: picked.part, rate });
            }
        };
        let part = lights[id].pick(u);
        Some(Chosen { id, part, rate: rate * lights[id].share(part) })
    }

    /// The rate that [`Selection::choose`] gives to a part of light `id`.
    #[inline(always)]
    pub fn rate(&self, light: &Light, [id, part]: [u32; 2], rays: u32, from: V3, normal: V3) -> f32 {
        match self {
            Selection::Each(each) => *each as f32 * light.share(part),
            Selection::Power { shares, .. } => shares[id as usize] * rays as f32 * light.share(part),
            Selection::Tree(tree) => tree.probability(id as usize, part, from, normal) * rays as f32,
        }
    }

    /// The words for it in plans.
    pub fn kernel(&self) -> &'static str {
        match self {
            Selection::Each(_) => "each light",
            Selection::Power { .. } => "lights by power",
            Selection::Tree(_) => "light tree",
        }
    }

    /// Why it is that one.
    pub fn why(&self, asked: LightSelection, lights: &[Light]) -> String {
        let emitters = emitters(lights);
        match (self, asked) {
            (Selection::Tree(tree), _) => {
                let bytes = units::bytes(tree.bytes() as u64);
                let reason = if asked == LightSelection::Tree { "as asked" } else { "there are many" };
                format!("{reason}; the tree of {emitters} emitters takes {bytes}")
            }
            (Selection::Power { .. }, LightSelection::Auto) if emitters > MOST_EMITTERS => {
                format!("more than {MOST_EMITTERS} emitters")
            }
            (Selection::Power { .. }, LightSelection::Auto) => {
                format!("more than {MOST_LIGHTS_EACH} lights; the tree is not for double precision")
            }
            (_, LightSelection::Auto) => format!("few enough to ask each, with {emitters} emitters"),
            _ => "as asked".into(),
        }
    }

    /// Bytes it takes.
    pub fn bytes(&self) -> usize {
        match self {
            Selection::Each(_) => 0,
            Selection::Power { shares, sums } => size_of_val(&shares[..]) + size_of_val(&sums[..]),
            Selection::Tree(tree) => tree.bytes(),
        }
    }
}

/// Whether all lights can be asked, and none has parts among which it matters which is.
fn few(lights: &[Light]) -> bool {
    lights.len() <= MOST_LIGHTS_EACH && lights.iter().all(|light| light.parts() <= MOST_TRIANGLES_BY_POWER)
}

/// Emitters: parts of all lights.
fn emitters(lights: &[Light]) -> usize {
    lights.iter().map(|light| light.parts() as usize).sum()
}

fn by_power(lights: &[Light]) -> Selection {
    let powers: Vec<f64> = lights.iter().map(|light| f64::from(light.power())).collect();
    let total: f64 = powers.iter().sum();
    let share = |power: &f64| if total > 0.0 { power / total } else { 1.0 / lights.len() as f64 };
    let sums = powers.iter().map(share).scan(0.0, |sum, share| {
        *sum += share;
        Some(*sum as f32)
    });
    Selection::Power { sums: sums.collect(), shares: powers.iter().map(|power| share(power) as f32).collect() }
}
