//! What is traced: shapes of size 1, put somewhere at some scale and rounded to f32, or to 48 bits, and rays at them.

use super::solids::{Solid, vector};
use crate::common::rays::Random;
use comber::bvh::ray::Ray;
use comber::scene::origin::Origin;
use comber::scene::shapes::{Geometry, NO_LIGHT, Shapes, Sphere, SphereInDouble};
use glam::{DVec3, Vec3};

/// What rays are aimed at, and from where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aim {
    /// At vertices.
    Vertex,
    /// At points on edges.
    Edge,
    /// At points of faces.
    Interior,
    /// At points of faces, 89.9999° from their normals.
    Grazing,
    /// Along axes, in the faces of the boxes around triangles, with components that are 0, −0 or denormal.
    Axes,
    /// At a sphere, from inside, near and far, its outline often.
    Sphere,
}

/// Triangles, and spheres by centre and radius.
pub type Loose = (Vec<[DVec3; 3]>, Vec<(DVec3, f64)>);

/// A case of the grid: a name, shapes of size 1, and how rays are aimed.
pub struct Case {
    pub name: &'static str,
    pub aim: Aim,
    pub make: fn(&mut Random) -> Loose,
}

/// Those of loose triangles and spheres; [`super::solids`] has the closed meshes.
pub const CASES: [Case; 12] = [
    Case { name: "vertex", aim: Aim::Vertex, make: |random| (fat(random), vec![]) },
    Case { name: "edge", aim: Aim::Edge, make: |random| (fat(random), vec![]) },
    Case { name: "interior", aim: Aim::Interior, make: |random| (fat(random), vec![]) },
    Case { name: "grazing 89.9999°", aim: Aim::Grazing, make: |random| (fat(random), vec![]) },
    Case { name: "needles 10⁶", aim: Aim::Interior, make: |random| (thin(random, true), vec![]) },
    Case { name: "slivers 10⁶", aim: Aim::Interior, make: |random| (thin(random, false), vec![]) },
    Case { name: "tips of slivers", aim: Aim::Vertex, make: |random| (tips(random), vec![]) },
    Case { name: "layers 10⁻⁶ apart", aim: Aim::Interior, make: |random| (layers(random), vec![]) },
    Case { name: "axes, zeros, −0", aim: Aim::Axes, make: |_| (blocks(), vec![]) },
    Case { name: "sphere 10⁻⁶", aim: Aim::Sphere, make: |_| (vec![], vec![(DVec3::new(0.3, -0.2, 0.1), 1e-6)]) },
    Case { name: "sphere 1", aim: Aim::Sphere, make: |_| (vec![], vec![(DVec3::new(0.3, -0.2, 0.1), 1.0)]) },
    Case { name: "sphere 10⁸", aim: Aim::Sphere, make: |_| (vec![], vec![(DVec3::new(0.3, -0.2, 0.1), 1e8)]) },
];

/// Twelve triangles here and there.
fn fat(random: &mut Random) -> Vec<[DVec3; 3]> {
    let triangle = |_| {
        let center = vector(random) * 0.7;
        [(); 3].map(|()| center + vector(random) * 0.3)
    };
    (0..12).map(triangle).collect()
}

/// Twelve triangles a million times as long as high: one short edge, or none.
fn thin(random: &mut Random, needle: bool) -> Vec<[DVec3; 3]> {
    let triangle = |_| {
        let (center, along) = (vector(random) * 0.5, vector(random).normalize());
        let across = along.any_orthonormal_vector() * 1e-6;
        let tip = if needle { center + along * 0.5 } else { center + along * (0.3 * f64::from(random.signed())) };
        [center - along * 0.5, tip, if needle { tip + across } else { center + along * 0.5 }]
            .map(|corner| if !needle && corner == tip { corner + across } else { corner })
    };
    (0..12).map(triangle).collect()
}

/// Slivers of which the tip lies near the middle of the scene, where coordinates are small and those of the other corners are not.
fn tips(random: &mut Random) -> Vec<[DVec3; 3]> {
    let mut triangles = thin(random, false);
    for corners in &mut triangles {
        let by = vector(random) * 10f64.powi(-(random.below(8) as i32)) - corners[1];
        corners.iter_mut().for_each(|corner| *corner += by);
    }
    triangles
}

/// Eight squares, each a little higher and tilted a little.
fn layers(random: &mut Random) -> Vec<[DVec3; 3]> {
    let layer = |number: usize| {
        let mut corner =
            |x: f64, y: f64| DVec3::new(x, y, 1e-6 * (number as f64 - 4.0 + 0.4 * f64::from(random.signed())));
        let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        [[a, b, c], [a, c, d]]
    };
    (0..8).flat_map(layer).collect()
}

/// Triangles in the faces of their own boxes: two steps of a staircase.
fn blocks() -> Vec<[DVec3; 3]> {
    let mut triangles = Vec::new();
    for step in [-0.5, 0.25] {
        for axis in 0..3 {
            let mut corners = [(-0.75, -0.5), (0.5, -0.5), (0.5, 0.75), (-0.75, 0.75)].map(|(x, y)| {
                let mut corner = DVec3::splat(step);
                (corner[(axis + 1) % 3], corner[(axis + 2) % 3]) = (x, y);
                corner
            });
            corners.rotate_left(axis);
            let [a, b, c, d] = corners;
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    triangles
}

/// Where a scene is: how large, and how far from the origin, in units of its size; and how finely its positions are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    pub scale: f64,
    pub distance: f64,
    /// In 48 bits, as `--precision f64` has them.
    pub fine: bool,
}

impl Place {
    /// Where the middle of the scene is.
    pub fn center(self) -> DVec3 {
        DVec3::new(0.6, -0.64, 0.48) * (self.distance * self.scale)
    }

    /// A point of the scene of size 1.
    pub fn put(self, p: DVec3) -> DVec3 {
        self.center() + p * self.scale
    }

    /// A point as it is stored there.
    pub fn round(self, p: DVec3) -> DVec3 {
        if self.fine { Origin::double(p).wide() } else { p.as_vec3().as_dvec3() }
    }
}

fn of_one_geometry(mut shapes: Shapes) -> Shapes {
    let prim_count = shapes.prim_count() as u32;
    shapes.geometries = vec![Geometry { name: String::new(), first_prim: 0, prim_count, material: 0, light: NO_LIGHT }];
    shapes
}

/// Shapes of size 1, in place.
fn in_place(at: Place, positions: &[DVec3], triangles: Vec<[u32; 3]>, spheres: &[(DVec3, f64)]) -> Shapes {
    let double: Vec<DVec3> = positions.iter().map(|&p| at.round(at.put(p))).collect();
    let spheres_double = spheres.iter().map(|&(center, radius)| SphereInDouble {
        center: at.round(at.put(center)),
        radius: at.round(DVec3::splat(radius * at.scale)).x,
    });
    let spheres_double: Vec<SphereInDouble> = spheres_double.collect();
    let single = |sphere: &SphereInDouble| Sphere { center: sphere.center.as_vec3(), radius: sphere.radius as f32 };
    let shapes = Shapes {
        positions: double.iter().map(|p| p.as_vec3()).collect(),
        triangles,
        spheres: spheres_double.iter().map(single).collect(),
        ..Shapes::default()
    };
    of_one_geometry(if at.fine { Shapes { double, spheres_double, ..shapes } } else { shapes })
}

/// The shapes of a case, in place.
pub fn place(case: &Case, at: Place, random: &mut Random) -> Shapes {
    let (triangles, spheres) = (case.make)(random);
    let numbers = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    in_place(at, triangles.as_flattened(), numbers, &spheres)
}

/// A solid, in place.
pub fn place_solid(solid: &Solid, at: Place) -> Shapes {
    in_place(at, &solid.positions, solid.triangles.clone(), &[])
}

/// From a point to another, as the renderer would: the direction of unit length, rounded. `None` if they coincide.
pub fn onwards(origin: Origin, target: DVec3) -> Option<Ray> {
    let direction = (target - origin.wide()).try_normalize()?.as_vec3();
    Some(Ray::leaving(origin, direction.into()))
}

/// As [`onwards`], from a point that is rounded first.
pub fn towards(at: Place, origin: DVec3, target: DVec3) -> Option<Ray> {
    onwards(Origin::double(at.round(origin)), target)
}

/// A random point of a triangle, or of an edge of it, or a vertex: of the rounded triangle, in f64.
pub fn target([a, b, c]: [DVec3; 3], aim: Aim, random: &mut Random) -> DVec3 {
    let mut weight = || f64::from(random.signed().abs());
    match aim {
        Aim::Vertex => a,
        Aim::Edge => a.lerp(b, weight()),
        _ => {
            let (u, v) = (weight(), weight());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            a + (b - a) * u + (c - a) * v
        }
    }
}

/// A ray at shapes in place.
pub fn aimed(shapes: &Shapes, aim: Aim, place: Place, random: &mut Random) -> Option<Ray> {
    if aim == Aim::Sphere {
        return at_sphere(shapes.sphere_in_double(0), place, random);
    }
    let mut corners = shapes.corners_in_double(random.below(shapes.triangles.len()) as u32);
    corners.rotate_left(random.below(3));
    if aim == Aim::Axes {
        return along_axis(corners, place, random);
    }
    let mut target = target(corners, aim, random);
    // Half of them exactly, the others by a little or by much beside it.
    if random.below(2) == 0 {
        target += vector(random) * (place.scale * 10f64.powi(-(random.below(9) as i32)));
    }
    let [a, b, c] = corners;
    let far = if random.below(8) == 0 { 1e3 } else { 1.0 + f64::from(random.signed().abs()) };
    let away = if aim == Aim::Grazing {
        let normal = (b - a).cross(c - a).try_normalize()?;
        let flat = normal.cross(vector(random)).try_normalize()?;
        flat + normal * (std::f64::consts::FRAC_PI_2 - 89.9999f64.to_radians())
    } else {
        vector(random).try_normalize()?
    };
    towards(place, target + away * (far * place.scale), target)
}

/// Along an axis or nearly so, through a vertex, in a face of the triangle's box, or anywhere.
fn along_axis(corners: [DVec3; 3], place: Place, random: &mut Random) -> Option<Ray> {
    const TINY: [f32; 6] = [0.0, -0.0, 1e-40, -1e-40, 1e-45, 1e-30];
    let axis = random.below(3);
    let target = target(corners, [Aim::Vertex, Aim::Edge, Aim::Interior][random.below(3)], random);
    let mut direction = Vec3::ZERO;
    for other in 0..3 {
        direction[other] = TINY[random.below(TINY.len())];
    }
    direction[axis] = if random.below(2) == 0 { -1.0 } else { 1.0 };
    if random.below(4) == 0 {
        direction[(axis + 1) % 3] = random.signed();
    }
    let back = place.scale * (0.5 + f64::from(random.signed().abs()));
    let origin = place.round(place.round(target) - direction.as_dvec3() * back);
    Some(Ray::leaving(Origin::double(origin), direction.into()))
}

/// From inside, near or far, at a point of it, of its outline, or beside it.
fn at_sphere((center, radius): (DVec3, f64), at: Place, random: &mut Random) -> Option<Ray> {
    let place = vector(random).try_normalize()?;
    let origin = match random.below(4) {
        0 => center + place * (radius * f64::from(random.signed())),
        1 => center + place * (radius * (1.0 + 10f64.powi(-(random.below(7) as i32)))),
        2 => center + place * (radius * 3.0),
        _ => center + place * (radius * 10f64.powi(random.below(8) as i32)),
    };
    let origin = at.round(origin);
    let across = vector(random).cross(center - origin).try_normalize()?;
    let target = match random.below(3) {
        0 => center + vector(random).try_normalize()? * radius,
        1 => center + across * (radius * (1.0 + 1e-7 * f64::from(random.signed()))),
        _ => center + across * (radius * 1.5 * f64::from(random.signed())),
    };
    towards(at, origin, target)
}
