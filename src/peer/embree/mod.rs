//! Embree, version 3 or 4, through its C interface.
//!
//! comber does not link to it. [`library`] finds and loads what is installed, [`scene`] builds Embree's tree of a scene,
//! [`modes`] names the ways in which Embree can be asked, [`records`] lays rays out as each of them wants them, and [`trace`]
//! asks and times the calls alone. `ffi` has the interface as the headers of Embree 3.13 and 4.4 declare it.
//!
//! This module and `simd` are the only homes of `unsafe`: calls into a C library cannot be checked. What can be checked is:
//! [`library`] traces a triangle in every mode when it loads a library, and refuses one that writes outside of what
//! [`records`] has room for.

#![allow(unsafe_code)]

mod denormals;
mod ffi;
pub mod library;
pub mod modes;
pub mod records;
pub mod scene;
pub mod trace;
