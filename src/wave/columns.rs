//! The one declaration of a column: name, type, meaning and the feature that requires it.
//!
//! The macro `columns!` turns a list of those into a table: a struct of [`Aligned`] columns, their allocation (a column that
//! the plan does not require has no rows), and [`ColumnInfo`]s from which byte counts, reports and the
//! plan's checks derive.

use super::features::Features;
pub use crate::simd::aligned::Aligned;

/// A column, as data.
#[derive(Clone, Copy, Debug)]
pub struct ColumnInfo {
    /// Table and field: `ray.ox`.
    pub name: &'static str,
    /// `f32` or `u32`.
    pub ty: &'static str,
    /// Meaning and unit.
    pub meaning: &'static str,
    /// It exists if the plan has all of these.
    pub requires: Features,
}

impl ColumnInfo {
    /// Bytes a row. Every column is a 32-bit number.
    pub const BYTES: usize = 4;
}

/// Declares a table of columns.
macro_rules! columns {
    (
        $(#[$attribute:meta])*
        pub struct $Table:ident = $table:literal {
            $(#[doc = $meaning:literal] $field:ident: $ty:ident => $requires:expr;)*
        }
    ) => {
        $(#[$attribute])*
        pub struct $Table {
            $(#[doc = $meaning] pub $field: $crate::wave::columns::Aligned<$ty>,)*
        }

        impl $Table {
            /// Its columns, as data.
            pub const COLUMNS: &'static [$crate::wave::columns::ColumnInfo] = &[
                $($crate::wave::columns::ColumnInfo {
                    name: concat!($table, ".", stringify!($field)),
                    ty: stringify!($ty),
                    meaning: $meaning.trim_ascii(),
                    requires: $requires,
                },)*
            ];

            /// Room for `rows` rows of the columns that `features` require; the others stay empty.
            pub fn allocate(rows: usize, features: $crate::wave::features::Features) -> Self {
                $Table {
                    $($field: $crate::wave::columns::Aligned::zeroed(if features.has($requires) { rows } else { 0 }),)*
                }
            }
        }
    };
}
pub(crate) use columns;
