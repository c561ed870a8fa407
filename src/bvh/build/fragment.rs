//! What the builder knows of a primitive while it sorts: its box and its number, 32 bytes.

use glam::Vec4;
use rayon::prelude::*;
use std::ops::Range;

use crate::bvh::aabb::Aabb;
use crate::bvh::child::Child;
use crate::scene::shapes::Shapes;

/// A primitive's box, padded for traversal.
///
/// Corners are whole vectors, which load in one instruction where three floats and a number would take three.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct Fragment {
    /// The low corner; w holds the primitive in the low bits of a number from 2 up ([`TAG`]).
    low: Vec4,
    /// The high corner; w is 0.
    high: Vec4,
}

const _: () = assert!(size_of::<Fragment>() == 32);

/// The bits of 2.0, set in all primitives as fragments hold them. Primitives alone would be the bits of denormal
/// numbers, and multiplying those takes a hundred cycles (measured: 2.5 times the time of a whole build).
const TAG: u32 = 0x4000_0000;
const _: () = assert!(Child::MAX_INDEX < TAG);

impl Fragment {
    /// Of a primitive and its box, not padded yet.
    #[inline(always)]
    pub fn new(prim: u32, tight: &Aabb) -> Fragment {
        debug_assert!(tight.min.is_finite() && tight.max.is_finite(), "primitive {prim} is not finite");
        let Aabb { min, max } = tight.padded();
        Fragment { low: min.extend(f32::from_bits(TAG | prim)), high: max.extend(0.0) }
    }

    /// The primitive.
    #[inline(always)]
    pub fn prim(&self) -> u32 {
        self.low.w.to_bits() ^ TAG
    }

    /// Low corner; w means nothing.
    #[inline(always)]
    pub fn min(&self) -> Vec4 {
        self.low
    }

    /// High corner; w means nothing.
    #[inline(always)]
    pub fn max(&self) -> Vec4 {
        self.high
    }

    /// Twice the centre of the box; w is 0. Splits compare centres only with each other.
    #[inline(always)]
    pub fn center(&self) -> Vec4 {
        (self.low + self.high).with_w(0.0)
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

/// Sets this large are gone through in parallel, in chunks of this many. Chunks do not depend on the number of
/// threads; results are exact, and so do not depend on the chunks either.
pub const CHUNK: usize = 1 << 15;

impl Extent {
    /// Of nothing.
    pub const EMPTY: Extent = Extent { bounds: WideBox::EMPTY, centers: WideBox::EMPTY };

    /// Of some fragments; of many in parallel.
    pub fn of(fragments: &[Fragment]) -> Extent {
        Extent { bounds: in_chunks(fragments, bounds), centers: centers(fragments) }
    }
}

/// The box around the centres of fragments, doubled like [`Fragment::center`].
pub fn centers(fragments: &[Fragment]) -> WideBox {
    in_chunks(fragments, centers_of_chunk)
}

/// The box around some fragments.
#[inline(always)]
pub fn bounds(fragments: &[Fragment]) -> WideBox {
    let mut bounds = WideBox::EMPTY;
    for fragment in fragments {
        bounds.grow(fragment.min(), fragment.max());
    }
    bounds
}

/// As [`centers`], on this thread.
#[inline(always)]
pub fn centers_of_chunk(fragments: &[Fragment]) -> WideBox {
    let mut centers = WideBox::EMPTY;
    for fragment in fragments {
        let center = fragment.center();
        centers.grow(center, center);
    }
    centers
}

fn in_chunks(fragments: &[Fragment], of: impl Fn(&[Fragment]) -> WideBox + Sync + Send) -> WideBox {
    if fragments.len() <= CHUNK {
        return of(fragments);
    }
    fragments.par_chunks(CHUNK).map(of).reduce(|| WideBox::EMPTY, WideBox::union)
}

/// The box of a primitive, not padded.
#[inline(always)]
pub fn tight(shapes: &Shapes, prim: u32) -> Aabb {
    match (prim as usize).checked_sub(shapes.triangles.len()) {
        None => Aabb::around(shapes.corners(prim)),
        Some(sphere) => Aabb::of_sphere(&shapes.spheres[sphere]),
    }
}

/// A fragment for each of some primitives, in order.
pub fn fragments(shapes: &Shapes, prims: &[Range<u32>]) -> Vec<Fragment> {
    let mut fragments = Vec::new();
    for prims in prims {
        fragments.par_extend(prims.clone().into_par_iter().map(|prim| Fragment::new(prim, &tight(shapes, prim))));
    }
    fragments
}

/// The box of some primitives, not padded.
pub fn tight_bounds(shapes: &Shapes, prims: &[Range<u32>]) -> Aabb {
    let bounds = |prims: &Range<u32>| {
        prims.clone().into_par_iter().map(|prim| tight(shapes, prim)).reduce(|| Aabb::EMPTY, Aabb::union)
    };
    prims.iter().map(bounds).fold(Aabb::EMPTY, Aabb::union)
}
