//! The sizes of the caches, and of the working sets that they lead to.

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::Level;

/// Bytes that the first processor's caches hold; `None` for what it does not have, or the system does not tell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct CacheSizes {
    /// First level, data.
    pub l1: Option<u64>,
    /// Second level.
    pub l2: Option<u64>,
    /// Third level.
    pub l3: Option<u64>,
}

/// Where nothing is known: what most processors have at least.
const USUAL: CacheSizes = CacheSizes { l1: Some(32 << 10), l2: Some(512 << 10), l3: Some(16 << 20) };
/// Working sets beyond this take too long to prepare: a virtual machine's host may have to find every page first.
const MOST: u64 = 512 << 20;
/// Working sets below this say nothing of memory.
const LEAST: u64 = 64 << 20;

impl CacheSizes {
    /// Those of this machine.
    pub fn detect() -> CacheSizes {
        CacheSizes::read(Path::new("/sys/devices/system/cpu/cpu0/cache"))
    }

    /// From a folder with a folder `index…` for each cache (Linux, Documentation/ABI/testing/sysfs-devices-system-cpu).
    fn read(folder: &Path) -> CacheSizes {
        let mut sizes = CacheSizes::default();
        for cache in fs::read_dir(folder).into_iter().flatten().flatten() {
            let field = |name| fs::read_to_string(cache.path().join(name)).ok().map(|text| text.trim().to_string());
            let Some(size) = field("size").and_then(|text| text.strip_suffix('K')?.parse::<u64>().ok()) else {
                continue;
            };
            let bytes = Some(size.saturating_mul(1024)).filter(|&bytes| bytes > 0);
            match (field("level").as_deref(), field("type").as_deref()) {
                (Some("1"), Some("Data" | "Unified")) => sizes.l1 = bytes,
                (Some("2"), Some("Data" | "Unified")) => sizes.l2 = bytes,
                (Some("3"), Some("Data" | "Unified")) => sizes.l3 = bytes,
                _ => {}
            }
        }
        sizes
    }

    /// Working sets that lie in each level, and well outside the level before: powers of two, growing. `available` is the memory that
    /// may be used, a quarter of it at most for one set; less than that may leave memory smaller than the third level.
    pub(super) fn working_sets(&self, available: Option<u64>) -> Vec<(Level, u64)> {
        let known = if *self == CacheSizes::default() { USUAL } else { *self };
        let two_thirds = |bytes: u64| floor(bytes * 2 / 3);
        let first = known.l1.map(two_thirds);
        let second = known.l2.map(|bytes| floor(bytes / 2));
        // Third levels are shared: by other processors, other virtual machines. A few times the second is as far as it takes.
        let third = known.l3.map(|bytes| floor(bytes / 2).min(second.map_or(u64::MAX, |second| 16 * second)));
        let last = known.l3.or(known.l2).or(known.l1).unwrap_or(0);
        // Random lines of a set four times as large miss the last level three times in four; of one just larger than a third
        // level of hundreds of megabytes, more often than its size tells: that is shared.
        let most = available.map_or(MOST, |bytes| floor(bytes / 4).min(MOST));
        let memory = Some(floor(last.saturating_mul(4)).max(LEAST).min(most));
        let mut sets: Vec<(Level, u64)> = Vec::new();
        for (level, bytes) in [(Level::L1, first), (Level::L2, second), (Level::L3, third), (Level::Dram, memory)] {
            let larger = |bytes: &u64| *bytes >= 4096 && sets.last().is_none_or(|(_, before)| bytes > before);
            sets.extend(bytes.filter(larger).map(|bytes| (level, bytes)));
        }
        sets
    }
}

/// The largest power of two that is not above `bytes`; 0 of 0.
fn floor(bytes: u64) -> u64 {
    bytes.checked_ilog2().map_or(0, |log| 1 << log)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sizes(l1: u64, l2: u64, l3: u64) -> CacheSizes {
        let known = |kibibytes: u64| Some(kibibytes << 10).filter(|&bytes| bytes > 0);
        CacheSizes { l1: known(l1), l2: known(l2), l3: known(l3) }
    }

    #[test]
    fn caches_are_read_as_linux_tells_them() {
        let folder = tempfile::tempdir().unwrap();
        let caches =
            [("Instruction", 1, "64K"), ("Data", 1, "48K"), ("Unified", 2, "2048K"), ("Unified", 3, "266240K")];
        for (i, (kind, level, size)) in caches.into_iter().enumerate() {
            let cache = folder.path().join(format!("index{i}"));
            fs::create_dir(&cache).unwrap();
            fs::write(cache.join("type"), format!("{kind}\n")).unwrap();
            fs::write(cache.join("level"), format!("{level}\n")).unwrap();
            fs::write(cache.join("size"), format!("{size}\n")).unwrap();
        }
        assert_eq!(CacheSizes::read(folder.path()), sizes(48, 2048, 266_240));
        fs::write(folder.path().join("index1/size"), "many").unwrap();
        fs::write(folder.path().join("index2/size"), "0K").unwrap();
        assert_eq!(CacheSizes::read(folder.path()), sizes(0, 0, 266_240));
        assert_eq!(CacheSizes::read(&folder.path().join("missing")), CacheSizes::default());
    }

    #[test]
    fn working_sets_fit_their_level_and_exceed_the_one_before() {
        let plenty = Some(64 << 30);
        let of = |sizes: CacheSizes, available| sizes.working_sets(available);
        assert_eq!(
            of(sizes(48, 2048, 266_240), plenty),
            [(Level::L1, 32 << 10), (Level::L2, 1 << 20), (Level::L3, 16 << 20), (Level::Dram, 512 << 20)]
        );
        assert_eq!(
            of(sizes(32, 512, 32 << 10), None),
            [(Level::L1, 16 << 10), (Level::L2, 256 << 10), (Level::L3, 4 << 20), (Level::Dram, 128 << 20)]
        );
        assert_eq!(
            of(sizes(64, 1024, 0), plenty),
            [(Level::L1, 32 << 10), (Level::L2, 512 << 10), (Level::Dram, 64 << 20)],
            "no third level"
        );
        assert_eq!(of(CacheSizes::default(), plenty), of(USUAL, plenty));
        assert_eq!(
            of(sizes(48, 2048, 266_240), Some(100 << 20)).last(),
            Some(&(Level::L3, 16 << 20)),
            "no more than that may be had"
        );
        for available in [0, 1, 5000, 1 << 20, 1 << 40] {
            let sets = sizes(48, 2048, 266_240).working_sets(Some(available));
            assert!(sets.is_sorted_by(|a, b| a.1 < b.1) && sets.iter().all(|set| set.1.is_power_of_two()));
            assert!(sets.iter().all(|set| set.0 != Level::Dram || set.1 <= available / 4));
        }
    }
}
