//! How much memory this process holds, as the system sees it.

/// Largest resident set so far, in bytes; `None` where the system does not say (anything but Linux).
pub fn peak_resident() -> Option<u64> {
    from_status("VmHWM:")
}

/// Resident set now, in bytes; `None` where the system does not say (anything but Linux).
pub fn current_resident() -> Option<u64> {
    from_status("VmRSS:")
}

/// What the system could still give without swapping, in bytes; `None` where it does not say (anything but Linux).
pub fn available() -> Option<u64> {
    parse(&std::fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:")
}

/// One field of `/proc/self/status`, in bytes. Elsewhere there is no such file.
fn from_status(field: &str) -> Option<u64> {
    parse(&std::fs::read_to_string("/proc/self/status").ok()?, field)
}

/// Finds `field   1234 kB`; the kernel writes kB and means 1024 bytes (proc(5)).
fn parse(status: &str, field: &str) -> Option<u64> {
    let rest = status.lines().find_map(|line| line.strip_prefix(field))?;
    let kibibytes: u64 = rest.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parses_a_status_file() {
        let status = "Name:\tcomber\nVmPeak:\t   99 kB\nVmHWM:\t   1234 kB\nVmRSS:\t  oops kB\n";
        assert_eq!(parse(status, "VmHWM:"), Some(1234 * 1024));
        assert_eq!(parse(status, "VmRSS:"), None);
        assert_eq!(parse(status, "VmSwap:"), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_peak_grows_with_an_allocation() {
        let before = current_resident().unwrap();
        let block = std::hint::black_box(vec![1u8; 64 << 20]);
        let peak = peak_resident().unwrap();
        assert!(peak >= before + (48 << 20), "{before} {peak}");
        drop(block);
    }
}
