//! What only the operating system can give: huge pages, mapped files.
#![allow(unsafe_code)]

mod buffer;
mod mapped;
mod pages;

pub use buffer::{Buffer, HUGE_FROM};
pub use mapped::MappedFile;
pub use pages::{Pages, share_on_huge_pages};
