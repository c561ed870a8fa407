//! Lamps that a file holds twice, and lights that cannot be rendered.
//!
//! The course's files show one lamp as a light object and as an emissive quad in the same plane, and exporters write
//! the light object as a point light when they do not know the course's profile.

use crate::error::{At, Note};
use crate::scene::description::{AreaLightDescription, MeshDescription, SceneDescription};
use glam::{DVec2, DVec3, Vec3};
use smallvec::SmallVec;

/// Distance from a lamp's plane that counts as in it, relative to the lamp's larger side.
const PLANE_TOLERANCE: f64 = 1e-3;
/// Cosine above which two axes are the same.
const SAME_AXIS: f64 = 0.9999;
/// Part of the larger of two rectangles that both have to cover to be the same lamp.
const SAME_RECTANGLE: f64 = 0.5;

/// A light without extent.
pub(super) struct Lamp {
    /// The light's name.
    pub light: String,
    /// The node's name.
    pub node: String,
    /// `point`, `spot`, `directional`, `ambient`, ….
    pub kind: String,
    /// The line of the instance.
    pub line: u64,
    /// Where the node puts it, world space.
    pub position: DVec3,
}

/// Drops the second copy of each lamp, and all lights without extent, with a note for each.
pub(super) fn count_once(scene: &mut SceneDescription, lamps: Vec<Lamp>) {
    drop_quads_of_area_lights(scene);
    let quads = scene.meshes.iter().filter(|mesh| emits(scene, mesh));
    let quads = quads.filter_map(|mesh| Some((mesh.name.as_str(), mesh.at, Patch::of_quad(mesh)?)));
    let lights =
        scene.area_lights.iter().filter_map(|light| Some((light.name.as_str(), light.at, Patch::of_light(light)?)));
    let patches: Vec<(&str, At, Patch)> = lights.chain(quads).collect();
    let notes: Vec<Note> = lamps
        .iter()
        .map(|lamp| {
            let Lamp { light, node, kind, line, position } = lamp;
            match patches.iter().find(|(_, _, patch)| patch.contains(*position)) {
                Some((name, at, _)) => Note::info(format!(
                    "line {line}: {kind} light {light} (node {node}) stands in the emissive quad {name} (line {}): \
                     one lamp, and the quad emits",
                    line_of(*at)
                )),
                None => Note::warning(format!(
                    "line {line}: light {light} (node {node}) is a {kind} light, which cannot be rendered: left out"
                )),
            }
        })
        .collect();
    scene.notes.extend(notes);
}

/// Drops emissive quads that coincide with an area light, which emits instead.
fn drop_quads_of_area_lights(scene: &mut SceneDescription) {
    let lights: Vec<Patch> = scene.area_lights.iter().filter_map(Patch::of_light).collect();
    let twin_of = |mesh: &MeshDescription| {
        let quad = emits(scene, mesh).then(|| Patch::of_quad(mesh)).flatten()?;
        lights.iter().position(|light| light.coincides(&quad))
    };
    let twins: Vec<Option<usize>> = scene.meshes.iter().map(twin_of).collect();
    let mut kept = Vec::new();
    for (mesh, twin) in std::mem::take(&mut scene.meshes).into_iter().zip(twins) {
        let Some(light) = twin.map(|twin| &scene.area_lights[twin]) else {
            kept.push(mesh);
            continue;
        };
        scene.notes.push(Note::info(format!(
            "the emissive quad {} (line {}) lies in the area light {} (line {}): one lamp, and the light emits",
            mesh.name,
            line_of(mesh.at),
            light.name,
            line_of(light.at)
        )));
    }
    scene.meshes = kept;
}

fn emits(scene: &SceneDescription, mesh: &MeshDescription) -> bool {
    scene.materials.get(mesh.material as usize).is_some_and(|material| material.emission != Vec3::ZERO)
}

fn line_of(at: At) -> u64 {
    match at {
        At::Line(line) | At::LineColumn(line, _) => line,
        At::File | At::Byte(_) => 0,
    }
}

/// A flat four-sided emitter.
struct Patch {
    origin: DVec3,
    /// Unit.
    normal: DVec3,
    /// Unit, perpendicular to the normal: along a side.
    along: DVec3,
    corners: SmallVec<[DVec3; 6]>,
    /// Bounds of the corners in `along` and `normal × along`.
    low: DVec2,
    high: DVec2,
}

impl Patch {
    fn of_light(light: &AreaLightDescription) -> Option<Patch> {
        let center = light.double.unwrap_or(light.center.as_dvec3());
        let (u, v) = (light.side_u.as_dvec3(), light.side_v.as_dvec3());
        let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(s, t)| center + u * s + v * t);
        Patch::new(u.cross(v), u, SmallVec::from_slice(&corners))
    }

    /// The quad that a mesh of two triangles is; nothing if it is not flat.
    fn of_quad(mesh: &MeshDescription) -> Option<Patch> {
        let [first, second] = mesh.triangles[..] else { return None };
        let corner = |index: u32| mesh.position(index);
        let corners: SmallVec<[DVec3; 6]> = first.iter().chain(&second).map(|index| corner(*index)).collect();
        let (edge1, edge2) = (corners[1] - corners[0], corners[2] - corners[0]);
        let edge3 = edge2 - edge1;
        // The longest edge is the diagonal of a rectangle.
        let mut edges = [edge1, edge2, edge3];
        edges.sort_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
        let patch = Patch::new(edge1.cross(edge2), edges[0], corners)?;
        let flat = patch.corners.iter().all(|corner| patch.in_plane(*corner));
        flat.then_some(patch)
    }

    fn new(normal: DVec3, along: DVec3, corners: SmallVec<[DVec3; 6]>) -> Option<Patch> {
        let (normal, along) = (normal.try_normalize()?, along.try_normalize()?);
        let origin = *corners.first()?;
        let mut patch = Patch { origin, normal, along, corners, low: DVec2::ZERO, high: DVec2::ZERO };
        (patch.low, patch.high) = patch.bounds(&patch.corners);
        Some(patch)
    }

    fn flat(&self, point: DVec3) -> DVec2 {
        let offset = point - self.origin;
        DVec2::new(offset.dot(self.along), offset.dot(self.normal.cross(self.along)))
    }

    fn bounds(&self, points: &[DVec3]) -> (DVec2, DVec2) {
        let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        points.iter().map(|point| self.flat(*point)).fold(start, |(low, high), p| (low.min(p), high.max(p)))
    }

    fn in_plane(&self, point: DVec3) -> bool {
        let larger_side = (self.high - self.low).max_element();
        (point - self.origin).dot(self.normal).abs() <= PLANE_TOLERANCE * larger_side
    }

    fn contains(&self, point: DVec3) -> bool {
        let flat = self.flat(point);
        self.in_plane(point) && flat.cmpge(self.low).all() && flat.cmple(self.high).all()
    }

    /// Whether `quad` lies in this light's plane, faces along the same axis and covers the same place.
    fn coincides(&self, quad: &Patch) -> bool {
        if self.normal.dot(quad.normal).abs() < SAME_AXIS || !quad.corners.iter().all(|corner| self.in_plane(*corner)) {
            return false;
        }
        let (low, high) = self.bounds(&quad.corners);
        let area = |low: DVec2, high: DVec2| (high - low).max(DVec2::ZERO).element_product();
        let common = area(self.low.max(low), self.high.min(high));
        common >= SAME_RECTANGLE * area(low, high).max(area(self.low, self.high))
    }
}
