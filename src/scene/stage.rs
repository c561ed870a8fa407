//! Puts a bare mesh on a stage: a room or a studio around it, light, and a camera that looks at it.

mod cornell;
mod plain;
mod studio;

use crate::error::{At, Error, Note, Result};
use crate::scene::bounds::geometry_bounds;
use crate::scene::camera::Camera;
use crate::scene::description::{
    AreaLightDescription, MaterialDescription, MeshDescription, SceneDescription, Surface,
};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// What surrounds a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stage {
    /// The course's Cornell box, its light and its camera; the mesh 1.2 large on the floor.
    #[default]
    Cornell,
    /// A seamless backdrop with key, fill and rim light, and a three-quarter view.
    Studio,
    /// Nothing but light, if the mesh emits none itself.
    None,
}

/// Which axis of the mesh points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// +x: (x, y, z) → (−y, x, z).
    X,
    /// +y: as it is.
    #[default]
    Y,
    /// +z: (x, y, z) → (−x, z, y), the conversion that `.dae` files marked `Z_UP` get.
    Z,
}

/// A scene that is lit, and the camera that looks at it.
#[derive(Clone, Debug)]
pub struct Staged {
    /// The scene; its own `camera` is `None`.
    pub description: SceneDescription,
    /// The camera.
    pub camera: Camera,
}

/// Turns `description` so that `up` points to +y and puts it on `stage`.
///
/// Materials of the mesh stay; a mesh without any gets a diffuse one of albedo 0.5. On `Cornell` and `Studio` the
/// mesh is moved and scaled, and lights apart from the mesh are left out with a warning. A camera of the file is
/// replaced. It is an error if the geometry has no extent or is not finite.
pub fn place(mut description: SceneDescription, stage: Stage, up: UpAxis) -> Result<Staged> {
    description.camera = None;
    description.course_profile = false;
    ensure_material(&mut description);
    turn_up(&mut description, up);
    let (min, max) = geometry_bounds(&description)
        .filter(|(min, max)| min.is_finite() && max.is_finite() && (*max - *min).max_element() > 0.0)
        .ok_or_else(|| {
            Error::Scene(format!("{}: no geometry with a finite extent to put on a stage", description.name))
        })?;
    let camera = match stage {
        Stage::Cornell => cornell::build(&mut description, min, max),
        Stage::Studio => studio::build(&mut description, min, max),
        Stage::None => plain::build(&mut description, min, max),
    }
    .map_err(Error::Scene)?;
    Ok(Staged { description, camera })
}

fn ensure_material(description: &mut SceneDescription) {
    if description.materials.is_empty() {
        description.materials.push(diffuse("default", Vec3::splat(0.5)));
    }
}

/// Rotates everything so that `up` points to +y. The rotations permute and negate: nothing is rounded.
fn turn_up(description: &mut SceneDescription, up: UpAxis) {
    let turn: fn(Vec3) -> Vec3 = match up {
        UpAxis::X => |v| Vec3::new(-v.y, v.x, v.z),
        UpAxis::Y => return,
        UpAxis::Z => |v| Vec3::new(-v.x, v.z, v.y),
    };
    let turn_double = |DVec3 { x, y, z }: DVec3| match up {
        UpAxis::X => DVec3::new(-y, x, z),
        UpAxis::Y => DVec3::new(x, y, z),
        UpAxis::Z => DVec3::new(-x, z, y),
    };
    for mesh in &mut description.meshes {
        mesh.positions.par_iter_mut().chain(&mut mesh.normals).for_each(|v| *v = turn(*v));
        mesh.double.par_iter_mut().for_each(|v| *v = turn_double(*v));
    }
    for sphere in &mut description.spheres {
        sphere.center = turn(sphere.center);
        sphere.double = sphere.double.map(|(center, radius)| (turn_double(center), radius));
    }
    for light in &mut description.area_lights {
        light.center = turn(light.center);
        light.double = light.double.map(turn_double);
        light.side_u = turn(light.side_u);
        light.side_v = turn(light.side_v);
        light.direction = turn(light.direction);
    }
    description.origin = turn_double(description.origin);
}

/// Scales the geometry in the box from `min` to `max` so that its largest side is `side`, and moves it so that the
/// middle of its base is at `foot`; returns the new box. What its file had for an origin is nowhere then.
fn put(description: &mut SceneDescription, min: DVec3, max: DVec3, side: f64, foot: DVec3) -> (DVec3, DVec3) {
    let scale = side / (max - min).max_element();
    let base = DVec3::new((min.x + max.x) / 2.0, min.y, (min.z + max.z) / 2.0);
    let moved = |p: DVec3| (p - base) * scale + foot;
    for mesh in &mut description.meshes {
        mesh.double.par_iter_mut().for_each(|p| *p = moved(*p));
        match mesh.double.is_empty() {
            true => mesh.positions.par_iter_mut().for_each(|p| *p = moved(p.as_dvec3()).as_vec3()),
            false => mesh.positions.par_iter_mut().zip(&mesh.double).for_each(|(p, q)| *p = q.as_vec3()),
        }
    }
    for sphere in &mut description.spheres {
        sphere.center = moved(sphere.center.as_dvec3()).as_vec3();
        sphere.radius = (f64::from(sphere.radius) * scale) as f32;
        sphere.double = sphere.double.map(|(center, radius)| (moved(center), radius * scale));
    }
    description.origin = DVec3::ZERO;
    (moved(min), moved(max))
}

/// Leaves out the lights that a file has apart from its meshes, and says so.
fn drop_lights(description: &mut SceneDescription) {
    if !description.area_lights.is_empty() {
        let count = description.area_lights.len();
        let text = format!("{}: {count} light(s) of the file left out: the stage has its own", description.name);
        description.notes.push(Note::warning(text));
        description.area_lights.clear();
    }
}

fn diffuse(name: &str, albedo: Vec3) -> MaterialDescription {
    MaterialDescription { name: name.into(), at: At::File, surface: Surface::Diffuse { albedo }, emission: Vec3::ZERO }
}

/// Appends a diffuse wall with the corners `corners`, counter-clockwise seen from inside.
fn add_wall(description: &mut SceneDescription, name: &str, albedo: Vec3, corners: [Vec3; 4]) {
    description.meshes.push(MeshDescription {
        name: name.into(),
        positions: corners.to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: description.materials.len() as u32,
        ..Default::default()
    });
    description.materials.push(diffuse(name, albedo));
}

/// The five walls of a room that is open towards −z.
pub(super) struct Room {
    /// Corner with the smallest coordinates.
    pub min: Vec3,
    /// Corner with the largest coordinates.
    pub max: Vec3,
    /// Albedo of floor, ceiling and back wall (at the largest z).
    pub neutral: [Vec3; 3],
    /// Albedo of the wall at the largest x: to the left for who looks in.
    pub left: Vec3,
    /// Albedo of the wall at the smallest x.
    pub right: Vec3,
}

/// Appends the walls of `room`, facing inwards.
pub(super) fn add_room(description: &mut SceneDescription, room: &Room) {
    let (low, high) = (room.min, room.max);
    let at = |x: f32, y: f32, z: f32| low + (high - low) * Vec3::new(x, y, z);
    let (o, i) = (0.0, 1.0);
    let floor = [at(o, o, o), at(o, o, i), at(i, o, i), at(i, o, o)];
    let ceiling = [at(o, i, o), at(i, i, o), at(i, i, i), at(o, i, i)];
    let back = [at(o, o, i), at(o, i, i), at(i, i, i), at(i, o, i)];
    let left = [at(i, o, o), at(i, o, i), at(i, i, i), at(i, i, o)];
    let right = [at(o, o, o), at(o, i, o), at(o, i, i), at(o, o, i)];
    let [floor_albedo, ceiling_albedo, back_albedo] = room.neutral;
    add_wall(description, "floor", floor_albedo, floor);
    add_wall(description, "ceiling", ceiling_albedo, ceiling);
    add_wall(description, "back wall", back_albedo, back);
    add_wall(description, "left wall", room.left, left);
    add_wall(description, "right wall", room.right, right);
}

/// A square light at `center` that faces `target`, `side` wide.
fn softbox(name: &str, center: DVec3, target: DVec3, side: f64, radiance: Vec3) -> AreaLightDescription {
    let direction = (target - center).normalize();
    let (side_u, side_v) = direction.any_orthonormal_pair();
    AreaLightDescription {
        name: name.into(),
        at: At::File,
        center: center.as_vec3(),
        double: None,
        side_u: (side_u * side).as_vec3(),
        side_v: (side_v * side).as_vec3(),
        direction: direction.as_vec3(),
        radiance,
    }
}

/// The radiance that a square lamp of side `side` needs so that a white surface facing it from `distance` away gets
/// the radiance `exposure`; for lamps that are small by their distance.
fn radiance_for(exposure: f64, side: f64, distance: f64) -> f64 {
    exposure * std::f64::consts::PI * (distance / side).powi(2)
}

#[cfg(test)]
mod tests;
