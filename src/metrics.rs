//! Reads the time and memory that the process has used so far from the system.

/// Processor time of the process so far, all threads and the programs it waited for, s; `None`
/// where the system does not tell. It goes on counting where one program takes the place of another
/// in the same process.
pub fn processor_seconds() -> Option<f64> {
    let ticks = ticks_of_stat(&std::fs::read_to_string("/proc/self/stat").ok()?)?;
    Some(ticks / rustix::param::clock_ticks_per_second() as f64)
}

/// Sum of `utime`, `stime`, `cutime` and `cstime` of /proc/self/stat (Linux), in ticks of the clock.
fn ticks_of_stat(stat: &str) -> Option<f64> {
    // The name of the program stands in brackets and may hold blanks.
    let (_, rest) = stat.rsplit_once(')')?;
    let mut ticks = rest.split_whitespace().skip(11);
    let mut next = || ticks.next()?.parse::<f64>().ok();
    Some(next()? + next()? + next()? + next()?)
}

/// `VmHWM` of /proc/self/status (Linux), MiB.
pub fn peak_rss_mib() -> Option<f64> {
    peak_of_status(&std::fs::read_to_string("/proc/self/status").ok()?)
}

fn peak_of_status(status: &str) -> Option<f64> {
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib / 1024.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn processor_time_is_read_from_the_status_of_the_process() {
        let stat = "7 (a b) c) R 1 2 3 4 5 6 7 8 9 10 150 30 15 5 20 0 4";
        assert_eq!(ticks_of_stat(stat), Some(200.0));
        assert_eq!(ticks_of_stat("7 (a) R 1"), None);
        if cfg!(target_os = "linux") {
            assert!(processor_seconds().is_some());
        }
    }

    #[test]
    fn peak_memory_is_read_from_the_status_of_the_process() {
        assert_eq!(
            peak_of_status("Name:\tx\nVmHWM:\t   2048 kB\nVmRSS:\t 1 kB\n"),
            Some(2.0)
        );
        assert_eq!(peak_of_status("VmRSS:\t 1 kB\n"), None);
        assert_eq!(peak_of_status("VmHWM:\t many kB\n"), None);
    }
}
