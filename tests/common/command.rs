//! The command, as its users run it.

use super::own;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

/// `comber` with these arguments, in this directory.
pub fn comber(directory: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_comber"));
    command.current_dir(directory).stdin(Stdio::null()).env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"));
    command.args(line.split_whitespace()).env("SOURCE_DATE_EPOCH", "1");
    command
}

/// What it said of errors.
pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Runs a line that must end with this status.
pub fn expect(directory: &Path, arguments: &str, status: i32) -> Output {
    let output = comber(directory, arguments).output().unwrap();
    assert_eq!(output.status.code(), Some(status), "comber {arguments}: {}", stderr(&output));
    output
}

/// The number at a place in a report.
pub fn number(value: &Value, at: &str) -> f64 {
    value.pointer(at).and_then(Value::as_f64).unwrap_or_else(|| panic!("{at} in {value:#}"))
}

/// A directory with a scene of the project's own, `box.dae`.
pub fn with_scene() -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::copy(own("cornell_quad_light.dae"), dir.path().join("box.dae")).unwrap();
    dir
}
