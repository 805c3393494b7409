//! Measures the time, and the time and memory that the process has used so far.

use std::time::{SystemTime, UNIX_EPOCH};

/// Time in universal time, to the second: `2004-02-29T23:59:59Z`.
pub fn universal_time(moment: SystemTime) -> String {
    let since = moment.duration_since(UNIX_EPOCH).unwrap_or_default();
    let (days, second) = (since.as_secs() / 86_400, since.as_secs() % 86_400);
    // Years begin in March, so that the day of a leap year is their last: 146,097 days are 400
    // years.
    let days = days + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    // 153 days are five months.
    let from_march = (5 * day + 2) / 153;
    let day = day - (153 * from_march + 2) / 5 + 1;
    let month = if from_march < 10 {
        from_march + 3
    } else {
        from_march - 9
    };
    let year = 400 * era + year + u64::from(month <= 2);
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

/// Processor time of the process so far, for all threads and the programs it waited for, s; `None`
/// if the system does not provide it. It continues to count if one program replaces another in the
/// same process.
pub fn processor_seconds() -> Option<f64> {
    let ticks = ticks_of_stat(&std::fs::read_to_string("/proc/self/stat").ok()?)?;
    Some(ticks / rustix::param::clock_ticks_per_second() as f64)
}

/// Sum of `utime`, `stime`, `cutime` and `cstime` of /proc/self/stat (Linux), in ticks of the
/// clock.
fn ticks_of_stat(stat: &str) -> Option<f64> {
    // The name of the program stands in brackets and may hold blanks.
    let (_, rest) = stat.rsplit_once(')')?;
    let mut ticks = rest.split_whitespace().skip(11);
    let mut next = || ticks.next()?.parse::<f64>().ok();
    Some(next()? + next()? + next()? + next()?)
}

/// Peak resident memory, `VmHWM` of /proc/self/status (Linux), MiB.
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

    /// The dates are those of `date -u -d @SECONDS`.
    #[test]
    fn seconds_since_1970_are_a_date() {
        for (seconds, date) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_399, "2000-02-28T23:59:59Z"),
            (951_782_400, "2000-02-29T00:00:00Z"),
            (951_868_800, "2000-03-01T00:00:00Z"),
            (1_078_099_199, "2004-02-29T23:59:59Z"),
            (1_735_689_599, "2024-12-31T23:59:59Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
        ] {
            let moment = UNIX_EPOCH + std::time::Duration::from_secs(seconds);
            assert_eq!(universal_time(moment), date);
        }
    }

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
