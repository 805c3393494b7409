//! Limit of the memory that an input may need, shared by the targets.

use peak_alloc::PeakAlloc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Bytes that any input may need, and bytes for each byte of the input.
const MOST: usize = 100_000_000;
const MOST_PER_BYTE: usize = 100;

/// Runs `target` on an input.
///
/// # Panics
/// If more memory was allocated at one time than the limit allows.
pub fn hold(bytes: &[u8], target: fn(&[u8])) {
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    target(bytes);
    let needed = MEMORY.peak_usage().saturating_sub(before);
    let most = MOST + MOST_PER_BYTE * bytes.len();
    assert!(
        needed <= most,
        "{needed} bytes of memory for an input of {} bytes, at most {most} are allowed",
        bytes.len()
    );
}
