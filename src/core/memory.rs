//! Sizes checked before memory is taken.

/// What a piece of work would need is more than the machine can give.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected {what} to fit in memory, found that it takes {} where {} are free; \
     close other programs, or {}",
    human_bytes(*needed_bytes),
    human_bytes(*free_bytes),
    if what.starts_with(PICTURE) { "ask for fewer pixels" } else { "open a smaller or subsampled volume" }
)]
pub struct TooLarge {
    /// What was to be held, in words.
    pub what: String,
    /// Bytes it takes.
    pub needed_bytes: u64,
    /// Bytes that may be taken.
    pub free_bytes: u64,
}

/// What the words for a picture begin with, and for several: their size is not their volume's.
pub const PICTURE: &str = "the picture";

/// The product of sizes, or `None` where it exceeds 64 bits.
pub fn checked_product(sizes: &[u64]) -> Option<u64> {
    sizes.iter().try_fold(1_u64, |product, &size| product.checked_mul(size))
}

/// Bytes that may be taken now without pushing the machine into swap: the system's own estimate,
/// or no limit on a system that gives none.
pub fn free_bytes() -> u64 {
    let Ok(mut system) = sysinfo::System::new() else { return u64::MAX };
    system.refresh_memory();
    // In a container the machine's figure is not ours to spend.
    let free = system.available_memory();
    let free = system.cgroup_limits().map_or(free, |limits| free.min(limits.free_memory));
    free_addresses(&mut system).map_or(free, |addresses| free.min(addresses))
}

/// Bytes of addresses that a limit of the shell's or a batch system's (`ulimit -v`) leaves to this process; `None` where
/// there is no such limit.
#[cfg(unix)]
fn free_addresses(system: &mut sysinfo::System) -> Option<u64> {
    use rustix::process::{Resource, getrlimit};
    use sysinfo::{ProcessRefreshKind, ProcessesToUpdate};

    let limit = getrlimit(Resource::As).current?;
    let own = sysinfo::get_current_pid().ok()?;
    let kind = ProcessRefreshKind::nothing().with_memory();
    system.refresh_processes_specifics(ProcessesToUpdate::Some(&[own]), false, kind);
    let taken = system.process(own)?.virtual_memory();
    Some(limit.saturating_sub(taken.saturating_add(KEPT_BACK)))
}

#[cfg(not(unix))]
fn free_addresses(_: &mut sysinfo::System) -> Option<u64> {
    None
}

/// Addresses for threads and for what is not counted.
#[cfg(unix)]
const KEPT_BACK: u64 = 64 << 20;

/// Refuses `needed_bytes` for `what` unless `free_bytes` covers it.
///
/// # Errors
/// [`TooLarge`] with both figures.
pub fn require(what: &str, needed_bytes: u64, free_bytes: u64) -> Result<(), TooLarge> {
    if needed_bytes <= free_bytes {
        return Ok(());
    }
    Err(TooLarge { what: what.to_owned(), needed_bytes, free_bytes })
}

/// A byte count for people: `16.8 MB`.
pub fn human_bytes(bytes: u64) -> String {
    const UNITS: [&str; 6] = ["kB", "MB", "GB", "TB", "PB", "EB"];
    if bytes < 1000 {
        return format!("{bytes} bytes");
    }
    let mut value = bytes as f64 / 1e3;
    let mut unit = 0;
    while value >= 999.95 && unit + 1 < UNITS.len() {
        value /= 1e3;
        unit += 1;
    }
    format!("{value:.1} {}", UNITS[unit])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_beyond_64_bits_are_none() {
        assert_eq!(checked_product(&[1 << 32, 1 << 31]), Some(1 << 63));
        assert_eq!(checked_product(&[1 << 32, 1 << 32]), None);
        assert_eq!(checked_product(&[]), Some(1));
    }

    #[test]
    fn what_does_not_fit_is_refused_with_both_figures() {
        assert_eq!(require("a volume", 10, 10), Ok(()));
        let refusal = require("a volume", 2_000_000, 1_500).unwrap_err().to_string();
        assert!(refusal.contains("2.0 MB") && refusal.contains("1.5 kB"), "{refusal}");
    }

    #[test]
    fn this_machine_has_some_memory() {
        assert!(free_bytes() > 1 << 20);
    }

    #[test]
    fn bytes_are_written_for_people() {
        assert_eq!(human_bytes(999), "999 bytes");
        assert_eq!(human_bytes(16_777_216), "16.8 MB");
        assert_eq!(human_bytes(999_999), "1.0 MB");
        assert_eq!(human_bytes(u64::MAX), "18.4 EB");
    }
}
