//! What a tree depends on, in 128 bits.

use super::digest::digest;
use super::file::VERSION;
use crate::bvh::stored::ROWS;
use crate::options::AccelOptions;
use crate::scene::shapes::Shapes;
use std::fmt;
use std::str::FromStr;

/// Names a tree: two trees that may differ in a byte have different keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Key(pub u128);

/// What trees over a scene depend on, besides their options: the scene is gone through once for all of them.
#[derive(Clone, Copy, Debug)]
pub struct Contents(u128);

impl Contents {
    /// Of these shapes.
    pub fn of(shapes: &Shapes) -> Contents {
        let ranges: Vec<u32> = shapes.geometries.iter().flat_map(|g| [g.first_prim, g.prim_count]).collect();
        Contents(digest(&[
            bytemuck::cast_slice(&shapes.positions),
            bytemuck::cast_slice(&shapes.triangles),
            bytemuck::cast_slice(&shapes.spheres),
            bytemuck::cast_slice(&ranges),
        ]))
    }

    /// Names the tree that this version of comber builds of them with these options on this kind of machine.
    pub fn key(self, options: &AccelOptions) -> Key {
        let machine = [VERSION, u32::from(cfg!(target_endian = "big"))];
        Key(digest(&[
            &self.0.to_le_bytes(),
            describe(options).as_bytes(),
            bytemuck::cast_slice(&machine),
            bytemuck::cast_slice(&ROWS),
        ]))
    }
}

/// All options, in words.
pub fn describe(options: &AccelOptions) -> String {
    serde_json::to_string(options).expect("options are plain data")
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:032x}", self.0)
    }
}

impl FromStr for Key {
    type Err = String;

    fn from_str(text: &str) -> Result<Key, String> {
        let digits = text.len() == 32 && text.bytes().all(|c| matches!(c, b'0'..=b'9' | b'a'..=b'f'));
        match u128::from_str_radix(text, 16) {
            Ok(key) if digits => Ok(Key(key)),
            _ => Err("must be a key of 32 hexadecimal digits, as `comber cache ls` prints them".into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::Accel;
    use crate::scene::shapes::{Geometry, NO_LIGHT, Sphere};
    use glam::Vec3;

    fn shapes() -> Shapes {
        let geometry = |first_prim, prim_count| Geometry {
            name: "a".into(),
            first_prim,
            prim_count,
            material: 0,
            light: NO_LIGHT,
        };
        Shapes {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            triangles: vec![[0, 1, 2], [0, 1, 3]],
            spheres: vec![Sphere { center: Vec3::ONE, radius: 1.0 }],
            geometries: vec![geometry(0, 2), geometry(2, 1)],
            ..Shapes::default()
        }
    }

    #[test]
    fn keys_change_with_all_that_the_tree_depends_on() {
        let options = AccelOptions::default();
        let key = Contents::of(&shapes()).key(&options);
        assert_eq!(key, Contents::of(&shapes()).key(&options));
        let changes: [fn(&mut Shapes); 6] = [
            |s| s.positions[3].z = f32::from_bits(s.positions[3].z.to_bits() + 1),
            |s| s.triangles[1] = [1, 3, 0],
            |s| s.triangles.swap(0, 1),
            |s| s.spheres[0].radius = 2.0,
            |s| (s.geometries[0].prim_count, s.geometries[1].first_prim, s.geometries[1].prim_count) = (1, 1, 2),
            |s| s.spheres.clear(),
        ];
        let mut keys = vec![key];
        for change in changes {
            let mut other = shapes();
            change(&mut other);
            keys.push(Contents::of(&other).key(&options));
        }
        keys.push(Contents::of(&shapes()).key(&AccelOptions::of(Accel::Brute)));
        keys.sort();
        keys.dedup();
        assert_eq!(keys.len(), 8);
    }

    #[test]
    fn keys_do_not_change_with_what_it_does_not_depend_on() {
        let mut other = shapes();
        other.geometries[0].name = "b".into();
        other.geometries[0].material = 7;
        other.normals = vec![Vec3::X; 4];
        let options = AccelOptions::default();
        assert_eq!(Contents::of(&other).key(&options), Contents::of(&shapes()).key(&options));
    }

    #[test]
    fn keys_are_written_and_read() {
        for key in [Key(0), Key(1), Key(u128::MAX)] {
            assert_eq!(key.to_string().parse(), Ok(key));
        }
        for wrong in
            ["", "0", "+0000000000000000000000000000000", "0000000000000000000000000000000G", "../../etc/passwd"]
        {
            assert!(wrong.parse::<Key>().is_err(), "{wrong}");
        }
    }
}
