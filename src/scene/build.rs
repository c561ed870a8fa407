//! From description to tables: checks that everything can be rendered, concatenates meshes, finds the lights.

use super::description::{AreaLightDescription, MaterialDescription, SceneDescription, Surface};
use super::shapes::{Geometry, NO_LIGHT, Shapes, Sphere, SphereInDouble};
use super::surface::triangle_normal;
use super::{Scene, SceneOptions};
use crate::error::{Error, Note, Result};
use crate::light::Light;
use crate::light::shape::{EmissiveMesh, EmissiveSphere, LightShape, Parallelogram};
use crate::material::Material;
use crate::options::Normals;
use crate::sampling::v3::V3;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Albedo of the stand-in for a material that cannot be rendered.
const STAND_IN: Vec3 = Vec3::splat(0.5);

impl Scene {
    /// Checks a description and lays it out in tables.
    ///
    /// # Errors
    /// A material in use that cannot be rendered (unless substitution is allowed), coordinates that are not finite,
    /// indices out of range, more primitives than 32-bit numbers can name, or nothing to render at all.
    pub fn build(description: SceneDescription, options: SceneOptions) -> Result<Scene> {
        let mut scene = Scene { notes: description.notes, origin: description.origin, ..Scene::default() };
        let name = &description.name;
        let smooth = options.normals == Normals::Smooth && description.meshes.iter().any(|m| !m.normals.is_empty());

        let users = description.meshes.iter().map(|m| (&m.name, m.material));
        let users: Vec<_> = users.chain(description.spheres.iter().map(|s| (&s.name, s.material))).collect();
        for (index, material) in description.materials.iter().enumerate() {
            let user = users.iter().find(|(_, m)| *m as usize == index).map(|(n, _)| n.as_str());
            let resolved = resolve(name, material, user, options.substitute_materials, &mut scene.notes)?;
            scene.materials.push(resolved);
        }
        if let Some((user, index)) = users.iter().find(|(_, m)| *m as usize >= description.materials.len()) {
            let count = description.materials.len();
            return Err(Error::Scene(format!("{name}: '{user}' names material {index}, but there are {count}")));
        }

        let vertices: usize = description.meshes.iter().map(|m| m.positions.len()).sum();
        let triangles: usize = description.meshes.iter().map(|m| m.triangles.len()).sum();
        let prims = triangles + description.spheres.len() + 2 * description.area_lights.len();
        let limit = (1usize << 31) - 1;
        if vertices > limit || prims > limit {
            return Err(Error::Scene(format!(
                "{name}: {prims} primitives with {vertices} vertices; at most {limit} of each can be rendered"
            )));
        }

        for mesh in description.meshes {
            let place = format!("{name}{}: mesh '{}'", mesh.at, mesh.name);
            if let Some(i) = find(&mesh.positions, |p| !p.is_finite()) {
                return Err(Error::Scene(format!(
                    "{place}: vertex {i} is {}; expected finite numbers",
                    mesh.positions[i]
                )));
            }
            let count = mesh.positions.len() as u32;
            if let Some(i) = find(&mesh.triangles, |t| t.iter().any(|&v| v >= count)) {
                let t = mesh.triangles[i];
                return Err(Error::Scene(format!("{place}: triangle {i} names vertices {t:?}, but there are {count}")));
            }
            if mesh.triangles.is_empty() {
                continue;
            }
            let material = scene.materials[mesh.material as usize];
            if !mesh.double.is_empty() && mesh.double.len() != mesh.positions.len() {
                let (some, all) = (mesh.double.len(), mesh.positions.len());
                return Err(Error::Scene(format!("{place}: {some} of {all} positions are in double precision")));
            }
            let light = if material.emission == Vec3::ZERO {
                NO_LIGHT
            } else {
                let corners = mesh.triangles.iter().map(|t| t.map(|i| mesh.position(i)));
                let shape = EmissiveMesh::in_double(corners, !mesh.double.is_empty()).map(LightShape::Mesh);
                scene.add_light(&mesh.name, shape, material.emission)
            };
            scene.shapes.add_mesh(
                mesh.name,
                (mesh.positions, mesh.double),
                smooth.then_some(mesh.normals),
                mesh.triangles,
                mesh.material,
                light,
            );
        }
        for area_light in &description.area_lights {
            scene.add_area_light(name, area_light, smooth)?;
        }
        // Whether any sphere is more than single precision holds.
        let mut in_double = false;
        for sphere in description.spheres {
            if !(sphere.center.is_finite() && sphere.radius > 0.0 && sphere.radius.is_finite()) {
                return Err(Error::Scene(format!(
                    "{name}{}: sphere '{}' has centre {} and radius {}; expected finite numbers and a radius above 0",
                    sphere.at, sphere.name, sphere.center, sphere.radius
                )));
            }
            let emission = scene.materials[sphere.material as usize].emission;
            let light = if emission == Vec3::ZERO {
                NO_LIGHT
            } else {
                let place = sphere.double.map_or(sphere.center.as_dvec3(), |(center, _)| center);
                let shape = EmissiveSphere::new(sphere.center, sphere.radius);
                let shape = shape.map(|shape| LightShape::Sphere(shape.placed(place)));
                scene.add_light(&sphere.name, shape, emission)
            };
            let first_prim = scene.shapes.prim_count() as u32;
            scene.shapes.spheres.push(Sphere { center: sphere.center, radius: sphere.radius });
            let single = (sphere.center.as_dvec3(), sphere.radius.into());
            let (center, radius) = sphere.double.unwrap_or(single);
            in_double |= (center, radius) != single;
            scene.shapes.spheres_double.push(SphereInDouble { center, radius });
            let geometry = Geometry { name: sphere.name, first_prim, prim_count: 1, material: sphere.material, light };
            scene.shapes.geometries.push(geometry);
        }
        if !in_double {
            scene.shapes.spheres_double = Vec::new();
        }
        if scene.shapes.normals_are_those_of_triangles() {
            scene.shapes.normals = Vec::new();
        }
        if scene.shapes.prim_count() == 0 {
            return Err(Error::Scene(format!("{name}: nothing to render: no triangle and no sphere")));
        }
        if scene.lights.is_empty() {
            scene.notes.push(Note::warning(format!("{name}: nothing emits light: the picture will be black")));
        }
        Ok(scene)
    }

    fn add_light(&mut self, name: &str, shape: Option<LightShape>, radiance: Vec3) -> u32 {
        let Some(shape) = shape else {
            self.notes.push(Note::warning(format!("light '{name}' has no area: it emits nothing")));
            return NO_LIGHT;
        };
        self.lights.push(Light { name: name.to_owned(), shape, radiance });
        self.lights.len() as u32 - 1
    }

    /// A parallelogram light: two black, emitting triangles and a light.
    fn add_area_light(&mut self, scene: &str, light: &AreaLightDescription, smooth: bool) -> Result<()> {
        let place = format!("{scene}{}: area light '{}'", light.at, light.name);
        let numbers = [light.center, light.side_u, light.side_v, light.direction, light.radiance];
        if numbers.iter().any(|v| !v.is_finite()) {
            return Err(Error::Scene(format!("{place} has a coordinate or radiance that is not finite")));
        }
        // Emission goes to side_u × side_v: swap the sides if that is not where the light points.
        let out = light.side_u.as_dvec3().cross(light.side_v.as_dvec3()).dot(light.direction.as_dvec3());
        let (u, v) = if out < 0.0 { (light.side_v, light.side_u) } else { (light.side_u, light.side_v) };
        let corner = light.center - u * 0.5 - v * 0.5;
        let place = light.double.map(|center| center - u.as_dvec3() * 0.5 - v.as_dvec3() * 0.5);
        let shape = Parallelogram::new(corner, u, v)
            .map(|shape| LightShape::Parallelogram(shape.placed(place.unwrap_or(corner.as_dvec3()))));
        let id = self.add_light(&light.name, shape, light.radiance);
        if id == NO_LIGHT {
            return Ok(());
        }
        let material = self.materials.len() as u32;
        self.materials.push(Material { albedo: Vec3::ZERO, emission: light.radiance });
        let positions = vec![corner, corner + u, corner + u + v, corner + v];
        let double = place.map_or(Vec::new(), |corner| {
            let (u, v) = (u.as_dvec3(), v.as_dvec3());
            vec![corner, corner + u, corner + u + v, corner + v]
        });
        let triangles = vec![[0, 1, 2], [0, 2, 3]];
        self.shapes.add_mesh(light.name.clone(), (positions, double), smooth.then(Vec::new), triangles, material, id);
        Ok(())
    }
}

impl Shapes {
    /// Whether no corner's normal differs from its triangle's own by more than 10⁻⁵: files often carry normals for what is flat, and
    /// shading need not look at them.
    fn normals_are_those_of_triangles(&self) -> bool {
        const MOST: f32 = 1e-5;
        let flat = |prim: u32, triangle: &[u32; 3]| {
            let own = Vec3::from(triangle_normal(self.corners(prim).map(V3::from)));
            triangle.iter().all(|&corner| own.cross(self.normals[corner as usize]).length() <= MOST)
        };
        !self.normals.is_empty()
            && (0..self.triangles.len() as u32)
                .into_par_iter()
                .zip(&self.triangles)
                .all(|(prim, triangle)| flat(prim, triangle))
    }

    /// Appends a mesh. `double` may be empty. `normals`: `None` when the scene is flat; an empty vector stands for "none here".
    fn add_mesh(
        &mut self,
        name: String,
        (positions, mut double): (Vec<Vec3>, Vec<DVec3>),
        normals: Option<Vec<Vec3>>,
        triangles: Vec<[u32; 3]>,
        material: u32,
        light: u32,
    ) {
        debug_assert!(self.spheres.is_empty(), "triangles come first: spheres are numbered after them");
        let first_vertex = self.positions.len() as u32;
        let first_prim = self.triangles.len() as u32;
        let prim_count = triangles.len() as u32;
        if let Some(mut normals) = normals {
            normals.resize(positions.len(), Vec3::ZERO);
            append(&mut self.normals, normals);
        }
        // All positions have a row in double precision, or none has.
        if !(double.is_empty() && self.double.is_empty()) {
            self.double.extend(self.positions[self.double.len()..].iter().map(|p| p.as_dvec3()));
            if double.is_empty() {
                double.extend(positions.iter().map(|p| p.as_dvec3()));
            }
            append(&mut self.double, double);
        }
        append(&mut self.positions, positions);
        let mut triangles = triangles;
        if first_vertex > 0 {
            triangles.iter_mut().flatten().for_each(|i| *i += first_vertex);
        }
        append(&mut self.triangles, triangles);
        self.geometries.push(Geometry { name, first_prim, prim_count, material, light });
    }
}

/// The first item for which `wrong` holds.
fn find<T: Sync>(items: &[T], wrong: impl Fn(&T) -> bool + Sync) -> Option<usize> {
    const PIECE: usize = 1 << 16;
    let pieces = items.par_chunks(PIECE).enumerate();
    pieces.find_map_first(|(number, piece)| piece.iter().position(&wrong).map(|place| number * PIECE + place))
}

/// Appends without copying when there is nothing to append to: a scene of one huge mesh is never held twice.
fn append<T>(to: &mut Vec<T>, mut from: Vec<T>) {
    if to.is_empty() {
        *to = from;
    } else {
        to.append(&mut from);
    }
}

fn resolve(
    scene: &str,
    material: &MaterialDescription,
    user: Option<&str>,
    substitute: bool,
    notes: &mut Vec<Note>,
) -> Result<Material> {
    let emission = material.emission;
    let place = format!("{scene}{}: material '{}'", material.at, material.name);
    if !(emission.is_finite() && emission.min_element() >= 0.0) {
        return Err(Error::Scene(format!("{place} emits {emission}; expected finite numbers of at least 0")));
    }
    match (&material.surface, user) {
        (Surface::Diffuse { albedo }, _) => {
            if !(albedo.is_finite() && albedo.min_element() >= 0.0) {
                return Err(Error::Scene(format!("{place} has albedo {albedo}; expected numbers from 0 to 1")));
            }
            if albedo.max_element() > 1.0 {
                notes.push(Note::warning(format!(
                    "{place} reflects more light than it receives: albedo {albedo}, clamped to 1"
                )));
            }
            Ok(Material { albedo: albedo.min(Vec3::ONE), emission })
        }
        (_, None) => Ok(Material { albedo: STAND_IN, emission }),
        (surface, Some(_)) if substitute => {
            let kind = surface.kind();
            notes.push(Note::warning(format!(
                "{place} is {kind}, which cannot be rendered yet: a diffuse grey of 0.5 stands in"
            )));
            Ok(Material { albedo: STAND_IN, emission })
        }
        (surface, Some(user)) => Err(Error::Scene(format!(
            "{place}, used by '{user}', is {}, which cannot be rendered yet; expected a diffuse material (--substitute-materials puts one in its place)",
            surface.kind()
        ))),
    }
}
