//! How results become exit statuses and messages.

use crate::error::Error;
use std::io::{self, Write as _};
use std::panic::{self, AssertUnwindSafe, PanicHookInfo};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit status of a run that failed.
const FAILED: u8 = 1;
/// Exit status of a command that makes no sense.
const MISUSED: u8 = 2;
/// Exit status after a signal: 128 + SIGINT, as shells have it.
pub const INTERRUPTED: u8 = 130;

/// How a command ended that did not fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Done {
    /// All of it was done.
    Finished,
    /// A signal stopped it; what was done until then is kept.
    Interrupted,
}

/// Runs a command: prints what went wrong, a panic included, and tells the exit status.
pub fn guard(command: impl FnOnce() -> anyhow::Result<Done>) -> ExitCode {
    panic::set_hook(Box::new(report_panic));
    // Nothing of the command is used after a panic, so nothing half-changed can be seen.
    let status = panic::catch_unwind(AssertUnwindSafe(command)).map_or(FAILED, status);
    ExitCode::from(status)
}

/// The exit status of a command that came to an end.
fn status(result: anyhow::Result<Done>) -> u8 {
    match result {
        Ok(Done::Finished) => 0,
        Ok(Done::Interrupted) => INTERRUPTED,
        Err(error) => report_error(&error),
    }
}

/// Prints an error and tells its exit status.
fn report_error(error: &anyhow::Error) -> u8 {
    if let Some(usage) = error.downcast_ref::<clap::Error>() {
        // A reader that is gone does not miss the help text.
        let _ = usage.print();
        return u8::try_from(usage.exit_code()).unwrap_or(MISUSED);
    }
    let misused = matches!(error.downcast_ref::<Error>(), Some(Error::Options(_)));
    // Messages of the library hold their cause, so the chain would say it twice.
    complain(&format!("error: {error}"));
    if misused { MISUSED } else { FAILED }
}

/// Prints one message for the first panic; other workers may panic for the same reason.
fn report_panic(panic: &PanicHookInfo) {
    static SAID: AtomicBool = AtomicBool::new(false);
    if !SAID.swap(true, Ordering::Relaxed) {
        let payload = panic.payload();
        let text = payload.downcast_ref::<&str>().copied().or(payload.downcast_ref::<String>().map(String::as_str));
        let what = text.unwrap_or("no message");
        let place = panic.location().map(|place| format!(" ({}:{})", place.file(), place.line())).unwrap_or_default();
        complain(&format!("error: this is a bug in comber: {what}{place}"));
    }
}

/// Prints a line on standard error, if anyone still reads it.
pub fn complain(line: &str) {
    let _ = writeln!(io::stderr(), "{line}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_end_has_its_status() {
        assert_eq!(status(Ok(Done::Finished)), 0);
        assert_eq!(status(Ok(Done::Interrupted)), 130);
        assert_eq!(status(Err(Error::Options("no".into()).into())), 2);
        assert_eq!(status(Err(Error::Scene("no".into()).into())), 1);
        assert_eq!(status(Err(anyhow::anyhow!("no"))), 1);
    }
}
