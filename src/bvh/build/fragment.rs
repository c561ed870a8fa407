//! What the builder knows of a primitive while it sorts: its box and its number, 32 bytes.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use crate::bvh::aabb::Aabb;
use crate::scene::shapes::Shapes;

/// A primitive's box, padded for traversal.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct Fragment {
    min: Vec3,
    /// The primitive.
    pub prim: u32,
    max: Vec3,
    unused: u32,
}

const _: () = assert!(size_of::<Fragment>() == 32);

impl Fragment {
    /// Low corner; w is 0.
    #[inline(always)]
    pub fn min(&self) -> Vec4 {
        self.min.extend(0.0)
    }

    /// High corner; w is 0.
    #[inline(always)]
    pub fn max(&self) -> Vec4 {
        self.max.extend(0.0)
    }

    /// Twice the centre of the box; w is 0. Splits compare centres only with each other.
    #[inline(always)]
    pub fn center(&self) -> Vec4 {
        self.min() + self.max()
    }
}

/// A box that is grown four lanes at a time; w means nothing.
#[derive(Clone, Copy, Debug)]
pub struct WideBox {
    /// Low corner.
    pub min: Vec4,
    /// High corner.
    pub max: Vec4,
}

impl WideBox {
    /// Contains nothing.
    pub const EMPTY: WideBox = WideBox { min: Vec4::INFINITY, max: Vec4::NEG_INFINITY };

    /// Grows to hold a box.
    #[inline(always)]
    pub fn grow(&mut self, min: Vec4, max: Vec4) {
        self.min = self.min.min(min);
        self.max = self.max.max(max);
    }

    /// The smallest box around both.
    #[inline(always)]
    pub fn union(self, other: WideBox) -> WideBox {
        WideBox { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Half the surface area of the box scaled by `scale`.
    #[inline(always)]
    pub fn half_area(&self, scale: f32) -> f32 {
        let e = (self.max - self.min) * scale;
        e.x * e.y + e.y * e.z + e.z * e.x
    }

    /// Without w.
    pub fn aabb(&self) -> Aabb {
        Aabb { min: self.min.truncate(), max: self.max.truncate() }
    }
}

/// What a subtree is built from: the boxes of its fragments and of their centres.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    /// Around the fragments.
    pub bounds: WideBox,
    /// Around their centres, doubled like [`Fragment::center`].
    pub centers: WideBox,
}

impl Extent {
    /// Of nothing.
    pub const EMPTY: Extent = Extent { bounds: WideBox::EMPTY, centers: WideBox::EMPTY };

    /// Of some fragments; of many in parallel, which gives the same.
    pub fn of(fragments: &[Fragment]) -> Extent {
        const PARALLEL: usize = 1 << 16;
        if fragments.len() > PARALLEL {
            return fragments.par_chunks(PARALLEL).map(Extent::of).reduce(|| Extent::EMPTY, Extent::union);
        }
        let mut extent = Extent::EMPTY;
        for fragment in fragments {
            extent.bounds.grow(fragment.min(), fragment.max());
            extent.centers.grow(fragment.center(), fragment.center());
        }
        extent
    }

    /// Of both.
    pub fn union(self, other: Extent) -> Extent {
        Extent { bounds: self.bounds.union(other.bounds), centers: self.centers.union(other.centers) }
    }
}

/// A fragment for each primitive, in order, and the box of all of them, not padded.
pub fn fragments(shapes: &Shapes) -> (Vec<Fragment>, Aabb) {
    let triangles = shapes.triangles.len();
    let tight = |prim: usize| {
        if prim < triangles {
            Aabb::around(shapes.corners(prim as u32))
        } else {
            Aabb::of_sphere(&shapes.spheres[prim - triangles])
        }
    };
    let fragments = (0..shapes.prim_count())
        .into_par_iter()
        .map(|prim| {
            let tight = tight(prim);
            debug_assert!(tight.min.is_finite() && tight.max.is_finite(), "primitive {prim} is not finite");
            let Aabb { min, max } = tight.padded();
            Fragment { min, prim: prim as u32, max, unused: 0 }
        })
        .collect();
    let bounds = (0..shapes.prim_count()).into_par_iter().map(tight).reduce(|| Aabb::EMPTY, Aabb::union);
    (fragments, bounds)
}
