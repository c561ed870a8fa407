//! What a scene and its options ask of a wave: the reasons for which columns and kernels exist.

use serde::Serialize;
use std::ops::{BitOr, BitOrAssign};

/// A set of requirements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features(u32);

/// One requirement: its bit, its name and the sentence that explains it.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Feature {
    #[serde(skip)]
    /// The set that holds just this one.
    pub set: Features,
    /// Short name.
    pub name: &'static str,
    /// Why something that requires it is there.
    pub why: &'static str,
}

macro_rules! features {
    ($($constant:ident = $bit:literal, $name:literal, $why:literal;)*) => {
        impl Features {
            /// No requirement: what every plan has.
            pub const ALWAYS: Features = Features(0);
            $(#[doc = concat!("`", $name, "`: ", $why, ".")] pub const $constant: Features = Features(1 << $bit);)*

            /// Every requirement there is.
            pub const ALL: &'static [Feature] =
                &[$(Feature { set: Features::$constant, name: $name, why: $why },)*];
        }
    };
}

features! {
    TRANSPORT = 0, "transport", "light is simulated, not only geometry shown";
    SCATTER = 1, "scatter", "some surface scatters light that the depth limit lets through";
    TRIANGLES = 2, "triangles", "the scene has triangles";
    SPHERES = 3, "spheres", "the scene has spheres";
    SMOOTH = 4, "smooth normals", "corner normals are interpolated";
    CONTINUE = 5, "continuing rays", "paths go on beyond their first surface";
    MIS = 6, "MIS", "light and BSDF samples share direct light by the power heuristic";
    SHADOW = 7, "shadow rays", "direct light is sampled at each vertex";
    HEMISPHERE = 8, "hemisphere sampling", "shadow rays must learn which emitter they hit";
    ROULETTE = 9, "roulette", "paths may end before the depth limit";
    AOVS = 10, "AOVs", "albedo, normal and depth of the first hit were asked for";
    COST = 11, "traversal cost", "nodes visited are the picture";
    HITS = 12, "hits", "what rays hit is looked at, not only how they got there";
    LOOK_BACK = 13, "light tree", "emission that a ray finds is weighed by what the light tree would have picked on the surface that the ray left";
    EFFICIENCY = 14, "roulette by efficiency", "rays are traced with the probability at which they are worth their work";
    DOUBLE = 15, "double precision", "positions in double precision were asked for";
    REUSE = 16, "path reuse", "pixels next to each other share what their paths find behind the first surface";
    LAMPS = 17, "lamp rays", "lights that the camera sees were to be looked at more closely";
}

impl Features {
    /// Whether all of `required` is here.
    pub fn has(self, required: Features) -> bool {
        self.0 & required.0 == required.0
    }

    /// All of `self` that is not in `other`.
    pub fn without(self, other: Features) -> Features {
        Features(self.0 & !other.0)
    }

    /// `self` if `condition`, else nothing.
    pub fn when(self, condition: bool) -> Features {
        if condition { self } else { Features(0) }
    }

    /// The sentence for why something that requires `self` is there.
    pub fn why(self) -> String {
        let reasons: Vec<_> = Features::ALL.iter().filter(|f| self.has(f.set)).map(|f| f.why).collect();
        if reasons.is_empty() { "every render needs it".into() } else { reasons.join("; ") }
    }
}

impl BitOr for Features {
    type Output = Features;
    fn bitor(self, other: Features) -> Features {
        Features(self.0 | other.0)
    }
}

impl BitOrAssign for Features {
    fn bitor_assign(&mut self, other: Features) {
        self.0 |= other.0;
    }
}
