//! Trees kept on disk, so that a large mesh is built once.
//!
//! A folder of files, one a tree, named after the key of what the tree was built from ([`key`]). A tree is mapped into
//! memory, not read ([`mod@file`]): its pages are the system's, shared by all processes, and of a tree in the system's cache
//! nothing is copied.
//!
//! **Damage.** A file is used only if its size, header and checksums are right and the tree is sound
//! ([`crate::bvh`] checks it node by node). Anything else is an error for the caller to tell, and the next
//! [`Cache::store`] replaces the file.
//!
//! **Many processes.** Files appear by renaming, whole, and are never written to afterwards. Two processes may build the
//! same tree; the last to rename wins. A file that is evicted or replaced lives on without a name for as long as a process
//! has it mapped. So no lock is needed. What remains is someone who truncates a cache file in place while it is mapped: the
//! system then kills the process that reads it (SIGBUS), against which there is no safe defence. The folder belongs
//! on a local disk and to its user alone; it is made so.

pub mod digest;
pub mod file;
pub mod folder;
pub mod key;

pub use folder::Cache;
pub use key::{Contents, Key};
