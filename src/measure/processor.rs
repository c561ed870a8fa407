//! The processor: its name, and how much of its time this process has used.

/// What it calls itself; `unknown` where the system does not tell.
pub fn name() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let name = line.map_or(std::env::consts::ARCH, |(_, name)| name.trim());
    name.into()
}

/// Processors that this process may run on.
pub fn count() -> usize {
    std::thread::available_parallelism().map_or(1, |count| count.get())
}

/// Processor time in seconds that this process has used, on all its threads; not a number where the system has no `/proc`.
pub fn seconds() -> f64 {
    /// Linux counts for users in hundredths, whatever the kernel does.
    const TICKS: f64 = 100.0;
    let Ok(stat) = std::fs::read_to_string("/proc/self/stat") else { return f64::NAN };
    // The second field is the program's name in parentheses, and may hold spaces. Fields 14 and 15 are wanted.
    let Some((_, fields)) = stat.rsplit_once(')') else { return f64::NAN };
    let fields: Vec<f64> = fields.split_whitespace().skip(11).take(2).filter_map(|field| field.parse().ok()).collect();
    if let [user, system] = fields[..] { (user + system) / TICKS } else { f64::NAN }
}

/// Seconds that this thread was ready to run while something else had its processor; `None` where the system does not tell.
pub fn waited() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds: f64 = stat.split_whitespace().nth(1)?.parse().ok()?;
    Some(nanoseconds * 1e-9)
}
