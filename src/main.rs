//! The `comber` command.

use comber::cli::args::Command;
use comber::cli::{self, bench, bvh, exit, info, render};
use std::process::ExitCode;

fn main() -> ExitCode {
    exit::guard(|| match cli::parse()?.command {
        Command::Render(args) => render::run(args),
        Command::Info(args) => info::run(args),
        Command::Bvh(args) => bvh::run(args),
        Command::Bench(args) => bench::run(args),
    })
}
