//! The command line: arguments as typed, requests as resolved, and one file a subcommand.

pub mod args;
pub mod bench;
pub mod budget;
pub mod bvh;
pub mod cache;
pub mod camera;
pub mod diff;
pub mod exit;
pub mod explain;
mod html;
pub mod info;
pub mod interrupt;
pub mod load;
pub mod mesh;
pub mod profile;
pub mod provenance;
pub mod reference;
pub mod render;
pub mod report;
pub mod resolve;
pub mod trade;
pub mod tree;
pub mod values;

use args::Cli;
use clap::Parser as _;

/// The command line of this process.
///
/// # Errors
///
/// What clap has to say; to it, help and version are errors too, of exit status 0.
pub fn parse() -> anyhow::Result<Cli> {
    Ok(Cli::try_parse_from(values::join_vectors(std::env::args_os()))?)
}
