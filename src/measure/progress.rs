//! A progress bar on the terminal.

use std::io::IsTerminal as _;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

use crate::measure::units;

/// How far a long task has come, shown as one line on standard error that goes away at the end.
///
/// Nothing is shown if standard error is not a terminal, so logs and pipes stay clean. The time left follows from
/// the rate of roughly the last 15 seconds (indicatif's doubly smoothed exponential average), not from the average
/// since the start: parts of a picture cost very different amounts, and a stalled task shows a growing time.
///
/// Shared between threads by reference; an update costs a few atomic operations, and a thread of the bar's own redraws
/// it twice a second.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
    furthest: AtomicU64,
}

impl Progress {
    /// A bar for `total` units of work, titled `label`; a silent one unless `enabled`.
    pub fn new(label: &str, total: u64, enabled: bool) -> Self {
        Self::with_style(label, Some(total), enabled, style)
    }

    /// A line for work of which nobody knows how much is left: its title and the time spent.
    pub fn busy(label: &str, enabled: bool) -> Self {
        Self::with_style(label, None, enabled, busy_style)
    }

    fn with_style(label: &str, total: Option<u64>, enabled: bool, style: fn() -> ProgressStyle) -> Self {
        let target = if enabled && std::io::stderr().is_terminal() {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(total, target);
        if !bar.is_hidden() {
            bar.set_style(style());
            bar.set_message(label.to_string());
            // Redraws without updates too, so that a long wave does not look like a hang.
            bar.enable_steady_tick(Duration::from_millis(500));
        }
        Progress { bar, furthest: AtomicU64::new(0) }
    }

    /// `done` units are complete. A smaller number than one already given changes nothing: threads may report late.
    pub fn set(&self, done: u64) {
        if self.furthest.fetch_max(done, Ordering::Relaxed) < done {
            self.bar.set_position(done);
        }
    }

    /// As [`Progress::set`], and all there is to do has become `total` units.
    pub fn set_of(&self, done: u64, total: u64) {
        self.bar.set_length(total);
        self.set(done);
    }

    /// Titles the line anew, where the title tells how far things are.
    pub fn relabel(&self, label: String) {
        self.bar.set_message(label);
    }

    /// Removes the bar from the terminal; dropping the value does the same.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.finish();
    }
}

/// The line: title, bar, percentage, time spent and left.
fn style() -> ProgressStyle {
    ProgressStyle::with_template("{msg} {wide_bar} {percent:>3} %  {spent}{left}")
        .expect("the template is a constant that a test parses")
        .with_key("spent", spent)
        .with_key("left", left)
}

/// The line of [`Progress::busy`].
fn busy_style() -> ProgressStyle {
    ProgressStyle::with_template("{spinner} {msg}  {spent}")
        .expect("the template is a constant that a test parses")
        .with_key("spent", spent)
}

/// Time since the start.
fn spent(state: &ProgressState, out: &mut dyn std::fmt::Write) {
    let _ = write!(out, "{}", coarse(state.elapsed()));
}

/// Time left, once there is a rate to tell it from.
fn left(state: &ProgressState, out: &mut dyn std::fmt::Write) {
    if state.pos() > 0 && state.per_sec() > 0.0 {
        let _ = write!(out, ", {} left", coarse(state.eta()));
    }
}

/// Whole seconds below a minute: finer digits would only flicker.
fn coarse(time: Duration) -> String {
    let seconds = time.as_secs_f64().round();
    if seconds < 60.0 { format!("{seconds} s") } else { units::duration(time) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io;
    use std::sync::{Arc, Mutex};

    /// A terminal that remembers what was written to it.
    #[derive(Clone, Debug, Default)]
    struct Recorder(Arc<Mutex<String>>);

    impl indicatif::TermLike for Recorder {
        fn width(&self) -> u16 {
            80
        }
        fn move_cursor_up(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_down(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_right(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_left(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn write_line(&self, line: &str) -> io::Result<()> {
            self.write_str(line)
        }
        fn write_str(&self, text: &str) -> io::Result<()> {
            self.0.lock().unwrap().push_str(text);
            Ok(())
        }
        fn clear_line(&self) -> io::Result<()> {
            self.0.lock().unwrap().clear();
            Ok(())
        }
        fn flush(&self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn the_line_tells_how_far_and_how_long() {
        let recorder = Recorder::default();
        let target = ProgressDrawTarget::term_like(Box::new(recorder.clone()));
        let bar = ProgressBar::with_draw_target(Some(4), target);
        bar.set_style(style());
        bar.set_message("render");
        std::thread::sleep(Duration::from_millis(20));
        bar.set_position(2);
        bar.force_draw();
        let text = recorder.0.lock().unwrap().clone();
        assert!(text.starts_with("render ") && text.contains(" 50 %"), "{text}");
        assert!(text.trim_end().ends_with(" left"), "{text}");
    }

    #[test]
    fn threads_share_it_and_late_reports_do_not_go_back() {
        let progress = Progress::new("test", 1000, true);
        std::thread::scope(|scope| {
            for first in 0..4 {
                let progress = &progress;
                scope.spawn(move || (first..=1000).step_by(4).for_each(|done| progress.set(done)));
            }
        });
        progress.set(3);
        assert_eq!(progress.bar.position(), 1000);
        progress.finish();
        progress.finish();
    }
}
