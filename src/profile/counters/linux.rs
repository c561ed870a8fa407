//! Counters from Linux: perf_event_open(2), by way of the crate `perf-event2`.

use std::io::{self, ErrorKind};

use perf_event::events::Event;
use perf_event::{Builder, Counter};

use super::Reading;

/// Events of one thread, counted together and read together.
pub struct Group<const N: usize> {
    group: perf_event::Group,
    /// Those that there are. They stop when dropped.
    counters: [Option<Counter>; N],
}

/// What a group has counted so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Totals<const N: usize> {
    /// Nanoseconds that the thread ran with the group open.
    pub enabled: u64,
    /// Nanoseconds of these that it was counted.
    pub running: u64,
    /// One number an event that there is.
    pub counts: [Option<u64>; N],
}

impl<const N: usize> Group<N> {
    /// Opens `events` for the calling thread, without what the kernel does for it, and starts counting.
    ///
    /// # Errors
    /// Why none of them is to be had.
    pub fn open<E: Event>(events: [E; N]) -> Result<Group<N>, String> {
        let mut group = perf_event::Group::new().map_err(|error| refused(&error, paranoid()))?;
        let mut first = None;
        let counters = events.map(|event| {
            let counter = group.add(&Builder::new(event));
            counter.map_err(|error| first.get_or_insert_with(|| refused(&error, paranoid())).clone()).ok()
        });
        if let Some(why) = first.filter(|_| counters.iter().all(Option::is_none)) {
            return Err(why);
        }
        group.enable().map_err(|error| refused(&error, paranoid()))?;
        Ok(Group { group, counters })
    }

    /// All of them at one moment; `None` if the system refuses.
    pub fn totals(&mut self) -> Option<Totals<N>> {
        let data = self.group.read().ok()?;
        let nanoseconds = |time: Option<std::time::Duration>| time.map_or(0, |time| time.as_nanos() as u64);
        // In the order in which they were added.
        let mut entries = data.iter();
        let next = |counter: &Option<Counter>| counter.as_ref().and_then(|_| Some(entries.next()?.value()));
        Some(Totals {
            enabled: nanoseconds(data.time_enabled()),
            running: nanoseconds(data.time_running()),
            counts: self.counters.each_ref().map(next),
        })
    }
}

impl Group<{ super::COUNT }> {
    /// All of them at one moment; empty if the system refuses.
    pub fn read(&mut self) -> Reading {
        self.totals().map_or(Reading::default(), |Totals { enabled, running, counts }| Reading {
            enabled,
            running,
            counts,
        })
    }
}

/// What `/proc/sys/kernel/perf_event_paranoid` says.
fn paranoid() -> Option<i32> {
    std::fs::read_to_string("/proc/sys/kernel/perf_event_paranoid").ok()?.trim().parse().ok()
}

/// Why the system refuses, given its error and how paranoid it is: 2 and less allow a thread to count its own user code.
fn refused(error: &io::Error, paranoid: Option<i32>) -> String {
    match (error.kind(), paranoid) {
        (ErrorKind::NotFound, _) => {
            "this machine has no hardware counters: most virtual machines have none".to_string()
        }
        (ErrorKind::PermissionDenied, Some(level)) if level > 2 => format!(
            "hardware counters are not permitted: /proc/sys/kernel/perf_event_paranoid is {level}; \
             `sudo sysctl kernel.perf_event_paranoid=2` permits them until the next start"
        ),
        (ErrorKind::PermissionDenied, _) => {
            let level = paranoid.map_or(String::new(), |level| format!("though perf_event_paranoid is {level}, "));
            format!(
                "hardware counters are not permitted: {level}a container or sandbox forbids perf_event_open ({error})"
            )
        }
        (ErrorKind::Unsupported, _) => {
            format!("this machine, its kernel or a sandbox has no hardware counters to give ({error})")
        }
        _ => format!("hardware counters cannot be opened: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use perf_event::events::{Hardware, Software};

    /// A page of x86-64; larger ones elsewhere are touched all the same.
    const PAGE: usize = 4096;

    #[test]
    fn events_are_counted_and_told_apart() {
        let events = [Software::TASK_CLOCK, Software::PAGE_FAULTS, Software::DUMMY];
        let mut group = match Group::open(events) {
            Ok(group) => group,
            Err(why) => return eprintln!("skipped: {why}"),
        };
        let before = group.totals().unwrap();
        let mut fresh = memmap2::MmapOptions::new().len(64 * PAGE).map_anon().unwrap();
        for page in fresh.chunks_mut(PAGE) {
            page[0] = 1;
        }
        let after = group.totals().unwrap();
        let [clock, faults, dummy] = std::array::from_fn(|i| after.counts[i].unwrap() - before.counts[i].unwrap());
        // One fault may map several pages. The upper bound tells them from the clock's nanoseconds.
        assert!((1..=1000).contains(&faults) && clock > faults, "{faults} faults, {clock} ns");
        assert_eq!(dummy, 0);
        assert!(after.enabled > before.enabled && after.running <= after.enabled, "{before:?} {after:?}");
    }

    #[test]
    fn each_thread_counts_for_itself() {
        let Ok(mut own) = Group::open([Software::PAGE_FAULTS]) else { return eprintln!("skipped: not permitted") };
        let before = own.totals().unwrap().counts[0].unwrap();
        let others = std::thread::spawn(|| {
            let mut group = Group::open([Software::PAGE_FAULTS]).unwrap();
            let before = group.totals().unwrap().counts[0].unwrap();
            let mut fresh = memmap2::MmapOptions::new().len(4096 * PAGE).map_anon().unwrap();
            // Small pages: each is a fault.
            let _ = fresh.advise(memmap2::Advice::NoHugePage);
            fresh.chunks_mut(PAGE).for_each(|page| page[0] = 1);
            group.totals().unwrap().counts[0].unwrap() - before
        });
        let others = others.join().unwrap();
        let own = own.totals().unwrap().counts[0].unwrap() - before;
        assert!(own < others, "{own} here, {others} there");
    }

    #[test]
    fn what_there_is_not_is_left_out() {
        // A number that no kernel has an event for.
        let unknown = Software(12345);
        let events = [unknown, Software::TASK_CLOCK, unknown, Software::DUMMY];
        let Ok(mut group) = Group::open(events) else { return eprintln!("skipped: not permitted") };
        std::hint::black_box((0..100_000u64).fold(0, |sum, i| std::hint::black_box(sum ^ i)));
        let reading = group.read();
        assert!(matches!(reading.counts, [None, Some(1..), None, Some(0)]), "{reading:?}");
        let why = Group::open([unknown, unknown]).err().unwrap();
        assert!(why.contains("hardware counters"), "{why}");
    }

    #[test]
    fn a_refusal_says_why_and_what_to_do() {
        let why = |errno, level| refused(&io::Error::from_raw_os_error(errno), level);
        let (eperm, enoent, eacces, enosys, eopnotsupp, emfile) = (1, 2, 13, 38, 95, 24);
        assert!(why(enoent, Some(2)).contains("this machine has no hardware counters"));
        for errno in [eperm, eacces] {
            let strict = why(errno, Some(4));
            assert!(
                strict.contains("perf_event_paranoid is 4") && strict.contains("perf_event_paranoid=2"),
                "{strict}"
            );
            let lax = why(errno, Some(1));
            assert!(lax.contains("though perf_event_paranoid is 1") && lax.contains("container"), "{lax}");
            assert!(why(errno, None).contains("container"));
        }
        for errno in [enosys, eopnotsupp] {
            assert!(why(errno, Some(2)).contains("has no hardware counters to give"), "{}", why(errno, Some(2)));
        }
        assert!(why(emfile, Some(2)).contains("Too many open files"));
    }

    #[test]
    fn hardware_events_take_the_same_way() {
        match Group::open([Hardware::INSTRUCTIONS]) {
            Ok(mut group) => assert!(group.totals().unwrap().counts[0].is_some()),
            Err(why) => assert!(why.contains("hardware counters"), "{why}"),
        }
    }
}
