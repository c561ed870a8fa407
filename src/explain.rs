//! One sample, vertex by vertex: what to read when a pixel is not as it should be.
//!
//! The reference integrator tells a [`Witness`] of each step. Nobody watching costs nothing: the steps are closures that
//! are never called.

use crate::bvh::Accel;
use crate::bvh::ray::Hit;
use crate::film::tile::Sample;
use crate::light::LightSample;
use crate::options::RenderOptions;
use crate::reference;
use crate::sampling::v3::V3;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::scene::origin::Origin;
use crate::scene::surface::SurfacePoint;
use glam::Vec3;
use std::fmt::Write as _;

/// A step of a path.
#[derive(Clone, Copy, Debug)]
pub enum Event {
    /// A ray of the path was traced.
    Ray {
        /// Bounces before.
        depth: u32,
        /// From where.
        origin: Origin,
        /// Unit direction.
        direction: V3,
        /// Throughput.
        beta: V3,
        /// What it hit.
        hit: Hit,
    },
    /// What it hit, as a surface.
    Surface {
        /// Where rays leave, and normals.
        at: SurfacePoint<Origin>,
        /// Albedo.
        albedo: Vec3,
    },
    /// Emission that the path found, weighted; zero where nothing shines.
    Emission {
        /// What it adds.
        value: V3,
    },
    /// A light sample that the surface or the light is turned away from.
    FacesAway {
        /// The light.
        id: usize,
    },
    /// A light that was not asked: what it would add is not worth the ray, and others stand for it.
    NotAsked {
        /// The light.
        id: usize,
    },
    /// No light can arrive: the light tree has nothing to ask.
    NoLight,
    /// A light was asked.
    Light {
        /// Which.
        id: usize,
        /// Where on it.
        found: LightSample,
        /// What it adds if nothing is in the way.
        value: V3,
        /// Whether nothing is.
        free: bool,
    },
    /// A direction over the hemisphere was asked.
    Hemisphere {
        /// Which.
        direction: V3,
        /// What is there.
        hit: Hit,
        /// What it adds, if it shines.
        value: Option<V3>,
    },
    /// Where the path might go on.
    Bounce {
        /// Density of the direction drawn.
        pdf: f32,
        /// Throughput behind the bounce, before roulette.
        beta: V3,
        /// Probability to go on.
        survival: f32,
        /// The lot: below that it does.
        lot: f32,
        /// Whether nothing counts any more but emission, and no light is in the way.
        in_vain: bool,
    },
}

/// Who is told.
pub trait Witness {
    /// A step was taken.
    #[inline(always)]
    fn saw(&mut self, _event: impl FnOnce() -> Event) {}
}

impl Witness for () {}

/// All steps of a sample, in order.
#[derive(Clone, Debug, Default)]
pub struct Story {
    /// The steps.
    pub events: Vec<Event>,
    /// What came of them.
    pub sample: Sample,
}

impl Witness for &mut Vec<Event> {
    fn saw(&mut self, event: impl FnOnce() -> Event) {
        self.push(event());
    }
}

impl Story {
    /// Sample `index` of the pixel at `x`, `y` of the frame, as `options` have it rendered, by whichever integrator: waves and
    /// the reference draw the same numbers and get the same radiance.
    pub fn of(subject: (&Scene, &Accel, &Camera), options: &RenderOptions, x: u32, y: u32, index: u32) -> Story {
        let mut events = Vec::new();
        let sample = reference::witness(subject, options)([x, y, index], &mut events);
        Story { events, sample }
    }

    /// The story as text. `scene` has the names.
    pub fn text(&self, scene: &Scene) -> String {
        let mut text = String::new();
        let mut broken = false;
        for event in &self.events {
            let _ = writeln!(text, "{}", told(event, scene));
            if !broken && !is_finite(event) {
                broken = true;
                let _ = writeln!(text, "  ^ the first step with a number that is not finite");
            }
        }
        let [r, g, b] = self.sample.radiance;
        let _ = writeln!(text, "radiance  {}", show(V3::new(r, g, b)));
        if !broken && ![r, g, b].iter().all(|c| c.is_finite()) {
            let _ = writeln!(text, "  ^ the steps are finite, but their sum is not");
        }
        text
    }
}

impl Event {
    /// What the step adds to the sample's radiance.
    pub fn adds(&self) -> Option<V3> {
        match *self {
            Event::Emission { value } => Some(value),
            Event::Light { value, free, .. } => free.then_some(value),
            Event::Hemisphere { value, .. } => value,
            _ => None,
        }
    }
}

/// A step in words.
fn told(event: &Event, scene: &Scene) -> String {
    match event {
        Event::Ray { depth, origin, direction, beta, hit } => {
            let line =
                format!("bounce {depth}  β {}  from {}  along {}", show(*beta), show_point(origin), show(*direction));
            format!("{line}\n  hits    {}", hit_name(hit, scene))
        }
        Event::Surface { at, albedo } => {
            let (point, normal, flat) = (show_point(&at.origin), show(at.normal), show(at.geometric));
            format!("  at      {point}  normal {normal}  geometric {flat}  albedo {albedo}")
        }
        Event::Emission { value } => format!("  shines  + {}", show(*value)),
        Event::NoLight => "  light   none can arrive here".into(),
        Event::FacesAway { id } => format!("  light   {}: turned away", scene.lights[*id].name),
        Event::NotAsked { id } => format!("  light   {}: not asked, by roulette", scene.lights[*id].name),
        Event::Light { id, found, value, free } => {
            let name = &scene.lights[*id].name;
            let (towards, distance, pdf) = (show(found.direction), found.distance, found.pdf);
            let outcome = if *free { format!("+ {}", show(*value)) } else { format!("hidden, else {}", show(*value)) };
            format!("  light   {name}: towards {towards}, distance {distance}, pdf {pdf}: {outcome}")
        }
        Event::Hemisphere { direction, hit, value } => {
            let outcome = value.map_or("nothing shines there".into(), |value| format!("+ {}", show(value)));
            format!("  looks   {} at {}: {outcome}", show(*direction), hit_name(hit, scene))
        }
        Event::Bounce { pdf, beta, survival, lot, in_vain } => {
            let carries = beta.max_component() > 0.0;
            let fate = match (carries, *in_vain, lot < survival) {
                (false, ..) => "carries nothing: the path ends",
                (_, true, _) => "no light is in its way, and nothing else would count: the path ends",
                (.., true) => "goes on",
                (.., false) => "the path ends",
            };
            format!("  bounce  pdf {pdf}, β {}, survival {survival}, lot {lot}: {fate}", show(*beta))
        }
    }
}

fn hit_name(hit: &Hit, scene: &Scene) -> String {
    match scene.shapes.geometries.get(hit.geom as usize) {
        None => "nothing".into(),
        Some(geometry) => {
            format!("{}, primitive {}, t {}, u {}, v {}", geometry.name, hit.prim, hit.t, hit.u, hit.v)
        }
    }
}

/// Every digit that tells one number from its neighbours.
fn show(v: V3) -> String {
    format!("({}, {}, {})", v.x, v.y, v.z)
}

fn show_point(point: &Origin) -> String {
    match point.low {
        None => show(point.high),
        Some(_) => point.wide().to_string(),
    }
}

fn is_finite(event: &Event) -> bool {
    let finite = |v: &V3| v.x.is_finite() && v.y.is_finite() && v.z.is_finite();
    match event {
        Event::Ray { origin, direction, beta, .. } => finite(&origin.high) && finite(direction) && finite(beta),
        Event::Surface { at, .. } => finite(&at.origin.high) && finite(&at.normal) && finite(&at.geometric),
        Event::Emission { value } | Event::Light { value, .. } => finite(value),
        Event::FacesAway { .. } | Event::NotAsked { .. } | Event::NoLight => true,
        Event::Hemisphere { direction, value, .. } => finite(direction) && value.as_ref().is_none_or(finite),
        Event::Bounce { pdf, beta, survival, .. } => pdf.is_finite() && survival.is_finite() && finite(beta),
    }
}
