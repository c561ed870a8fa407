//! What only the operating system can give: huge pages, mapped files.
#![allow(unsafe_code)]

mod buffer;
mod mapped;

pub use buffer::Buffer;
pub use mapped::MappedFile;
