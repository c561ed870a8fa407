//! The `comber` command.

use comber::cli::args::Command;
use comber::cli::{self, bench, bvh, cache, diff, exit, info, mesh, profile, reference, render, trade};
use std::process::ExitCode;
use std::time::Instant;

fn main() -> ExitCode {
    let started = Instant::now();
    exit::guard(|| match cli::parse()?.command {
        Command::Render(args) => render::run(args, started),
        Command::Info(args) => info::run(args),
        Command::Bvh(args) => bvh::run(args),
        Command::Bench(args) => bench::run(args),
        Command::Profile(args) => profile::run(args),
        Command::Diff(args) => diff::run(args),
        Command::Reference(args) => reference::run(args),
        Command::Trade(args) => trade::run(args),
        Command::Mesh(args) => mesh::run(args),
        Command::Cache(args) => cache::run(args),
    })
}
