//! The size of pages: what is asked for, and what was given.

use serde::{Deserialize, Serialize};

/// A size of pages. On x86-64, 4 KiB and 2 MiB.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pages {
    /// The processor's smallest.
    Small,
    /// The next larger size, where the system has such pages to give.
    Huge,
}

impl Pages {
    /// Both.
    pub const ALL: [Pages; 2] = [Pages::Small, Pages::Huge];

    /// For reports.
    pub fn name(self) -> &'static str {
        match self {
            Pages::Small => "small",
            Pages::Huge => "huge",
        }
    }
}

/// How much of the touched memory of the mapping that `address` lies in is on huge pages, from 0 to 1: the system may not have
/// them to give. `None` where it does not tell (anything but Linux).
pub fn share_on_huge_pages(address: usize) -> Option<f64> {
    share_in(&std::fs::read_to_string("/proc/self/smaps").ok()?, address)
}

/// The same, from the text of `/proc/PID/smaps` (proc_pid_smaps(5)): a line `start-end …` for each mapping, and its fields.
fn share_in(smaps: &str, address: usize) -> Option<f64> {
    let holds = |line: &str| {
        let range = line.split(' ').next()?.split_once('-')?;
        let [start, end] = [range.0, range.1].map(|number| usize::from_str_radix(number, 16));
        Some((start.ok()?..end.ok()?).contains(&address))
    };
    let mut fields = smaps.lines().skip_while(|line| holds(line) != Some(true)).skip(1);
    let mut resident = None;
    let kibibytes = |text: &str| text.trim().strip_suffix("kB")?.trim().parse::<f64>().ok();
    // `Rss` comes before `AnonHugePages`, which every mapping has.
    fields.find_map(|line| {
        if let Some(text) = line.strip_prefix("Rss:") {
            resident = kibibytes(text);
        }
        let huge = kibibytes(line.strip_prefix("AnonHugePages:")?)?;
        Some(resident.filter(|&resident| resident > 0.0).map_or(0.0, |resident| (huge / resident).min(1.0)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mapping_of_an_address_is_found() {
        let smaps = "1000-2000 rw-p 00000000 00:00 0 \nSize: 4 kB\nRss:  4 kB\nAnonHugePages:  0 kB\n\
                     ff00000-ff80000 rw-p 00000000 00:00 0 [heap]\nSize: 512 kB\nRss:  400 kB\nAnonHugePages: 100 kB\n\
                     ff80000-ff90000 rw-p 00000000 00:00 0\nRss: 0 kB\nAnonHugePages: 0 kB\n";
        assert_eq!(share_in(smaps, 0x1800), Some(0.0));
        assert_eq!(share_in(smaps, 0xff0_0000), Some(0.25));
        assert_eq!(share_in(smaps, 0xff8_0000), Some(0.0), "nothing is resident");
        assert_eq!(share_in(smaps, 0x2000), None, "the end of a mapping is not in it");
        assert_eq!(share_in("oops", 0), None);
    }
}
