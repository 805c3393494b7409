//! Memory that the system leaves to this process.

use std::fs;
use std::path::{Path, PathBuf};

/// Requests below this number of bytes are granted without a check of the system.
const LITTLE: u64 = 64 << 20;

/// Error of a request for more memory than is available.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "about {:.2} GiB of memory are needed, and {:.2} GiB are available: refine the mesh less, end other programs, or raise the \
     limit of memory",
    gib(*.needed),
    gib(*.available)
)]
#[non_exhaustive]
pub struct TooLittle {
    /// Approximate number of bytes needed.
    pub needed: u64,
    /// Number of bytes available.
    pub available: u64,
}

fn gib(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1u32 << 30)
}

/// Checks that so many more bytes are available to the process.
///
/// # Errors
/// [`TooLittle`]. Where the system gives no information, the memory counts as sufficient.
pub fn check_available(needed: u64) -> Result<(), TooLittle> {
    if needed < LITTLE {
        return Ok(());
    }
    match available() {
        Some(available) if available < needed => Err(TooLittle { needed, available }),
        _ => Ok(()),
    }
}

/// Number of bytes that the process may still take: the least of what the system has
/// (`MemAvailable`), of what its control groups leave, and of the limit of its address space
/// (Linux).
pub fn available() -> Option<u64> {
    let read = |path: &str| fs::read_to_string(path).unwrap_or_default();
    let system = kib(&read("/proc/meminfo"), "MemAvailable:");
    let address_space = limit_of_address_space(&read("/proc/self/limits")).map(|limit| {
        let used = kib(&read("/proc/self/status"), "VmSize:").unwrap_or(0);
        limit.saturating_sub(used)
    });
    let groups = groups(&read("/proc/self/cgroup"));
    let of_groups = groups.iter().filter_map(|folder| group_rest_bytes(folder));
    of_groups.chain(system).chain(address_space).min()
}

/// Number of bytes in a line such as `MemAvailable:   123 kB`.
fn kib(text: &str, key: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kib.checked_mul(1024)
}

/// Limit of the address space in /proc/self/limits, bytes; `None` where there is none.
fn limit_of_address_space(limits: &str) -> Option<u64> {
    let line = limits
        .lines()
        .find_map(|l| l.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// Folders of the control groups that limit memory, with their parents: of version 2 and version 1.
fn groups(memberships: &str) -> Vec<PathBuf> {
    let mut groups = Vec::new();
    for line in memberships.lines() {
        let mut parts = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(path)) = (parts.next(), parts.next()) else {
            continue;
        };
        let root = match controllers {
            "" => Path::new("/sys/fs/cgroup"),
            list if list.split(',').any(|c| c == "memory") => Path::new("/sys/fs/cgroup/memory"),
            _ => continue,
        };
        let group_folder = root.join(path.trim_start_matches('/'));
        let above = group_folder
            .ancestors()
            .take_while(|folder| folder.starts_with(root));
        groups.extend(above.map(Path::to_path_buf));
    }
    groups
}

/// Limit minus use of a control group, without files that nobody reads any more; `None` where
/// nothing is limited.
fn group_rest_bytes(folder: &Path) -> Option<u64> {
    let number = |file: &str| -> Option<u64> {
        let text = fs::read_to_string(folder.join(file)).ok()?;
        text.trim().parse().ok()
    };
    let limit = number("memory.max").or_else(|| number("memory.limit_in_bytes"))?;
    let used = number("memory.current").or_else(|| number("memory.usage_in_bytes"))?;
    let stat = fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
    let idle = |key: &str| {
        let line = stat.lines().find_map(|line| line.strip_prefix(key))?;
        line.trim().parse::<u64>().ok()
    };
    let idle = idle("total_inactive_file ").or_else(|| idle("inactive_file "));
    Some(limit.saturating_sub(used.saturating_sub(idle.unwrap_or(0))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_testkit::folder::Folder;

    #[test]
    fn what_the_system_says_is_read() {
        let meminfo = "MemTotal: 10 kB\nMemAvailable:    2048 kB\n";
        assert_eq!(kib(meminfo, "MemAvailable:"), Some(2 << 20));
        assert_eq!(kib("MemAvailable: many kB\n", "MemAvailable:"), None);
        let limits =
            "Max locked memory 1 2 bytes\nMax address space         4096    unlimited   bytes\n";
        assert_eq!(limit_of_address_space(limits), Some(4096));
        let unlimited =
            "Max address space         unlimited            unlimited            bytes\n";
        assert_eq!(limit_of_address_space(unlimited), None);
        if cfg!(target_os = "linux") {
            assert!(available().unwrap() > 1 << 20);
        }
    }

    #[test]
    fn the_groups_of_both_versions_are_looked_at_up_to_their_root() {
        let found = groups("9:name=systemd:/a\n4:cpu,memory:/x/y\n0::/z\n");
        let names: Vec<String> = found.iter().map(|p| p.display().to_string()).collect();
        let v1 = "/sys/fs/cgroup/memory";
        assert_eq!(
            names,
            [
                &format!("{v1}/x/y"),
                &format!("{v1}/x"),
                v1,
                "/sys/fs/cgroup/z",
                "/sys/fs/cgroup"
            ]
        );
    }

    #[test]
    fn what_a_group_leaves_is_its_limit_less_its_use() {
        let folder = Folder::new("group");
        folder.write("memory.max", "max\n");
        folder.write("memory.current", "700\n");
        assert_eq!(group_rest_bytes(&folder), None);
        folder.write("memory.max", "1000\n");
        folder.write("memory.stat", "anon 5\ninactive_file 200\n");
        assert_eq!(group_rest_bytes(&folder), Some(500));
        folder.write("memory.current", "5000\n");
        assert_eq!(group_rest_bytes(&folder), Some(0));
    }

    #[test]
    fn more_than_there_is_is_refused() {
        assert_eq!(check_available(LITTLE - 1), Ok(()));
        if cfg!(target_os = "linux") {
            let refused = check_available(u64::MAX).unwrap_err();
            assert!(refused.needed == u64::MAX && refused.available < u64::MAX);
        }
    }
}
