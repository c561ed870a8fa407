//! The `comber` command.

use comber::cli::args::Command;
use comber::cli::{self, bvh, exit, info, mesh, render};
use std::process::ExitCode;

fn main() -> ExitCode {
    exit::guard(|| match cli::parse()?.command {
        Command::Render(args) => render::run(args),
        Command::Info(args) => info::run(args),
        Command::Bvh(args) => bvh::run(args),
        Command::Mesh(args) => mesh::run(args),
    })
}
