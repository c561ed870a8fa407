//! Who is judged: comber's triangle tests and node formats, through every kernel in turn, its tree in double precision, and Embree's two modes.

use super::exact::{edge_sign, triple};
use super::oracle;
use super::scenes::Place;
use crate::common::rays::kernels;
use comber::bench::rays::Rays;
use comber::bvh::ray::{Hit, MISS, Ray};
use comber::bvh::{Accel, HitColumnsMut, Query, RayColumns, Traversal};
use comber::options::{AccelOptions, Intersection, LeafFormat, NodeFormat, Precision};
use comber::peer::embree::library::{self, Device};
use comber::peer::embree::modes::Mode;
use comber::peer::embree::scene::{Quality, Tree};
use comber::peer::embree::trace::Tracer;
use comber::scene::origin::Origin;
use comber::scene::shapes::Shapes;
use comber::simd::Tier;
use std::sync::Arc;

/// Names, as the tables have them: full nodes and leaves, or compact ones. Compact nodes with the fast test are refused by comber itself.
pub const NAMES: [&str; 6] =
    ["watertight, full", "watertight, compact", "fast, full", "double", "Embree robust", "Embree fast"];

/// Of [`NAMES`], the tree of `--precision f64`.
const DOUBLE: usize = 3;

/// How many of [`NAMES`] are comber's.
pub const OWN: usize = 4;

/// Whether comber promises of a subject that it neither misses nor lies.
pub fn promised(number: usize) -> bool {
    matches!(number, 0 | 1 | DOUBLE)
}

/// A tracer of one scene.
pub enum Subject {
    Comber { number: usize, accel: Box<Accel>, kernels: Vec<(Traversal, Tier)> },
    Embree { number: usize, tree: Tree, modes: Vec<Mode> },
}

/// The first Embree that is installed; `None`, with a word, if there is none.
pub fn embree() -> Option<Arc<Device>> {
    let device = library::find(None).and_then(|found| Device::open(&found[0], 1, None));
    device.map_err(|why| println!("Embree is left out: {why}")).ok()
}

/// A tree of `shapes`; `None` where compact nodes cannot hold the scene, which comber says when they are asked for.
pub fn comber(shapes: &Shapes, number: usize) -> Option<Subject> {
    let (intersection, nodes, leaves, precision) = [
        (Intersection::Watertight, NodeFormat::Full, LeafFormat::Full, Precision::F32),
        (Intersection::Watertight, NodeFormat::Compact, LeafFormat::Compact, Precision::F32),
        (Intersection::Fast, NodeFormat::Full, LeafFormat::Full, Precision::F32),
        (Intersection::Watertight, NodeFormat::Auto, LeafFormat::Auto, Precision::F64),
    ][number];
    let options = AccelOptions { intersection, nodes, leaves, precision, ..AccelOptions::default() };
    let accel = Accel::build(shapes, &options);
    accel.ok().map(|accel| Subject::Comber { number, accel: Box::new(accel), kernels: kernels() })
}

/// All that can trace `shapes`: where positions are fine, only the tree in double precision.
pub fn all(shapes: &Shapes, at: Place, embree: Option<&Arc<Device>>) -> Vec<Subject> {
    if at.fine {
        return comber(shapes, DOUBLE).into_iter().collect();
    }
    let own = (0..OWN).filter_map(|number| comber(shapes, number));
    let peers = embree.into_iter().flat_map(|device| {
        [(OWN, true), (OWN + 1, false)].map(|(number, robust)| {
            let tree = Tree::build(device, shapes, Quality::Medium, robust).expect("Embree builds a small tree");
            Subject::Embree { number, tree, modes: Mode::all(device, 256) }
        })
    });
    own.chain(peers).collect()
}

impl Subject {
    /// Which of [`NAMES`].
    pub fn number(&self) -> usize {
        match self {
            Subject::Comber { number, .. } | Subject::Embree { number, .. } => *number,
        }
    }

    /// Where a ray starts, as precisely as the subject knows it: it leaves what it hits accordingly.
    pub fn starts(&self, ray: &Ray) -> Origin {
        let low = (self.number() == DOUBLE).then_some(ray.low.into());
        Origin { high: ray.origin.into(), low }
    }

    /// The kernel that traces batch `turn`, for messages.
    pub fn kernel(&self, turn: usize) -> String {
        match self {
            Subject::Comber { kernels, .. } => {
                let (way, tier) = kernels[turn % kernels.len()];
                format!("{}, {}", way.name(), tier.name())
            }
            Subject::Embree { modes, .. } => modes[turn % modes.len()].to_string(),
        }
    }

    /// The closest hits of a batch, by the kernel whose turn it is.
    pub fn closest(&self, rays: &[Ray], shapes: &Shapes, turn: usize) -> Vec<Hit> {
        let (n, columns) = (rays.len(), Columns::of(rays));
        match self {
            Subject::Comber { accel, kernels, .. } => {
                let (way, tier) = kernels[turn % kernels.len()];
                let [mut t, mut u, mut v] = [(); 3].map(|()| vec![0.0; n]);
                let [mut prim, mut geom] = [(); 2].map(|()| vec![0; n]);
                let hits = HitColumnsMut { t: &mut t, u: &mut u, v: &mut v, prim: &mut prim, geom: &mut geom };
                accel.closest_hits(way, tier, columns.all(), hits);
                (0..n).map(|i| Hit { t: t[i], u: u[i], v: v[i], prim: prim[i], geom: geom[i] }).collect()
            }
            Subject::Embree { tree, modes, .. } => {
                let mut tracer = Tracer::new(tree, Query::Closest, modes[turn % modes.len()], n);
                let found = tracer.closest_hits(columns.all());
                let hit = |(row, (t, prim)): (usize, (f32, u32))| {
                    let [u, v] = weights(&rays[row], shapes, prim);
                    Hit { t, u, v, prim, geom: 0 }
                };
                found.into_iter().enumerate().map(hit).collect()
            }
        }
    }

    /// Whether each ray of a batch hits anything, by the kernel whose turn it is.
    pub fn any(&self, rays: &[Ray], turn: usize) -> Vec<bool> {
        let columns = Columns::of(rays);
        match self {
            Subject::Comber { accel, kernels, .. } => {
                let (way, tier) = kernels[turn % kernels.len()];
                let mut occluded = vec![false; rays.len()];
                accel.any_hits(way, tier, columns.all(), &mut occluded);
                occluded
            }
            Subject::Embree { tree, modes, .. } => {
                Tracer::new(tree, Query::Any, modes[turn % modes.len()], rays.len()).any_hits(columns.all())
            }
        }
    }
}

/// Rays as kernels take them.
struct Columns {
    rays: Rays,
    /// What single precision leaves of the origins.
    low: [Vec<f32>; 3],
}

impl Columns {
    fn of(rays: &[Ray]) -> Columns {
        let mut columns = Rays::default();
        rays.iter().for_each(|ray| columns.push(*ray));
        Columns { rays: columns, low: [0, 1, 2].map(|axis| rays.iter().map(|ray| ray.low[axis]).collect()) }
    }

    fn all(&self) -> RayColumns<'_> {
        RayColumns { low: Some(self.low.each_ref().map(Vec::as_slice)), ..self.rays.all() }
    }
}

/// The weights of a triangle's second and third corner where a ray truly crosses it, or nearly does.
fn weights(ray: &Ray, shapes: &Shapes, prim: u32) -> [f32; 2] {
    if prim == MISS || prim as usize >= shapes.triangles.len() {
        return [0.0; 2];
    }
    let corners = shapes.corners_in_double(prim);
    let (o, d) = (oracle::origin(ray), ray.direction.as_dvec3());
    let volume = |p: usize, q: usize| match edge_sign(o, ray.direction, corners[p], corners[q]) {
        0 => 0.0,
        _ => triple(d, corners[p] - o, corners[q] - o).0,
    };
    let volumes = [volume(1, 2), volume(2, 0), volume(0, 1)];
    let sum: f64 = volumes.iter().sum();
    [1, 2].map(|corner| (volumes[corner] / sum).clamp(0.0, 1.0) as f32)
}
