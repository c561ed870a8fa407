//! Closed meshes of size 1 about the origin, in f64, and points inside them.

use crate::common::rays::Random;
use glam::{DMat3, DQuat, DVec3};

/// A closed mesh, its triangles wound counter-clockwise seen from outside.
pub struct Solid {
    pub name: &'static str,
    pub positions: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    turn: DMat3,
    inside: fn(&mut Random) -> DVec3,
}

impl Solid {
    /// A point inside, well away from the surface or very close to it.
    pub fn inside(&self, random: &mut Random) -> DVec3 {
        self.turn * (self.inside)(random)
    }

    fn turned(mut self, name: &'static str, turn: DQuat) -> Solid {
        self.turn = DMat3::from_quat(turn);
        self.name = name;
        self.positions.iter_mut().for_each(|p| *p = self.turn * *p);
        self
    }
}

/// A vector of f64, from [−1, 1]³.
pub fn vector(random: &mut Random) -> DVec3 {
    random.vector().as_dvec3()
}

/// All of them.
pub fn all() -> [Solid; 5] {
    let turn = DQuat::from_axis_angle(DVec3::new(0.48, -0.6, 0.64), 0.7);
    [
        grid_box(&[-1.0, 0.0, 1.0]).turned("cube", DQuat::IDENTITY),
        grid_box(&[-1.0, 0.0, 1.0]).turned("turned cube", turn),
        icosphere(2).turned("ball", turn),
        torus(24, 12).turned("torus", turn),
        // Strips of a millionth of its size: needles of aspect 10⁶ along every edge, and squares of a millionth where they cross.
        grid_box(&[-1.0, -1.0 + 1e-6, -1.0 + 3e-6, -0.2, -0.2 + 1e-6, 1.0 - 1e-6, 1.0]).turned("needle box", turn),
    ]
}

/// A box with every face cut at these coordinates.
fn grid_box(cuts: &[f64]) -> Solid {
    let mut numbers = std::collections::HashMap::new();
    let mut solid = empty(|random| {
        let mut point = vector(random) * 0.98;
        if random.below(3) == 0 {
            let axis = random.below(3);
            point[axis] = point[axis].signum() * (1.0 - 10f64.powi(-1 - random.below(5) as i32));
        }
        point
    });
    let last = cuts.len() - 1;
    for axis in 0..3 {
        for (end, outwards) in [(0, false), (last, true)] {
            let mut corner = |i: usize, j: usize| {
                let mut key = [end; 3];
                (key[(axis + 1) % 3], key[(axis + 2) % 3]) = (i, j);
                *numbers.entry(key).or_insert_with(|| {
                    solid.positions.push(DVec3::from_array(key.map(|cut| cuts[cut])));
                    solid.positions.len() as u32 - 1
                })
            };
            for i in 0..last {
                for j in 0..last {
                    let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
                    let quad = if outwards { [a, b, c, d] } else { [d, c, b, a] };
                    solid.triangles.extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
                }
            }
        }
    }
    solid
}

fn empty(inside: fn(&mut Random) -> DVec3) -> Solid {
    Solid { name: "", positions: Vec::new(), triangles: Vec::new(), turn: DMat3::IDENTITY, inside }
}

/// An icosahedron, its faces divided into four `levels` times.
fn icosphere(levels: u32) -> Solid {
    let mut solid = empty(|random| vector(random) * 0.5);
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    for (a, b) in [(1.0, g), (1.0, -g), (-1.0, g), (-1.0, -g)] {
        solid.positions.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)]);
    }
    // Edges have length 2; faces are the triples of corners that are so far apart.
    let at = |i: u32| solid.positions[i as usize];
    let near = |a: u32, b: u32| (at(a).distance(at(b)) - 2.0).abs() < 1e-3;
    let mut triangles = Vec::new();
    for (a, b, c) in (0..12).flat_map(|a| (a + 1..12).flat_map(move |b| (b + 1..12).map(move |c| (a, b, c)))) {
        if near(a, b) && near(b, c) && near(c, a) {
            let outwards = at(a).cross(at(b)).dot(at(c)) > 0.0;
            triangles.push(if outwards { [a, b, c] } else { [a, c, b] });
        }
    }
    for _ in 0..levels {
        let mut middles = std::collections::HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                solid.positions.push(solid.positions[a as usize] + solid.positions[b as usize]);
                solid.positions.len() as u32 - 1
            })
        };
        let divide = |[a, b, c]: [u32; 3]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        triangles = triangles.into_iter().flat_map(divide).collect();
        solid.positions.iter_mut().for_each(|p| *p = p.normalize());
    }
    solid.triangles = triangles;
    solid
}

/// A torus: radius 0.75, tube 0.25.
fn torus(around: u32, tube: u32) -> Solid {
    let mut solid = empty(|random| {
        let (angle, offset) = (f64::from(random.signed()) * 4.0, vector(random) * 0.08);
        DVec3::new(angle.cos(), angle.sin(), 0.0) * 0.75 + offset
    });
    let on_circle = |step: u32, of: u32| {
        let angle = std::f64::consts::TAU * f64::from(step) / f64::from(of);
        DVec3::new(angle.cos(), angle.sin(), 0.0)
    };
    for i in 0..around {
        for j in 0..tube {
            let (ring, section) = (on_circle(i, around), on_circle(j, tube) * 0.25);
            solid.positions.push(ring * (0.75 + section.x) + DVec3::Z * section.y);
            let corner = |i: u32, j: u32| (i % around) * tube + j % tube;
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            solid.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    solid
}
