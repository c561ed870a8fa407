//! Other ray tracers, loaded at run time where they are installed, to be measured beside comber on the same rays.

pub mod embree;
