//! Work on a given number of threads.

/// Result of `work` in a thread pool of its own with `threads` threads.
pub fn run_on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("the system has threads").install(work)
}
