//! Allocator of the process: that of the system. If the system gives no memory,
//! [`dovetail::exhaustion`] ends the process.
//!
//! Without it the first failed allocation would end the process by a signal, and summary.json in
//! the folder of the run would still say that the run is under way.

#![expect(unsafe_code, reason = "an allocator hands out raw memory")]

use std::alloc::{GlobalAlloc, Layout, System};

use dovetail::exhaustion;

/// Allocator that passes all calls on to that of the system.
pub struct Watched;

fn check_allocation(memory: *mut u8, bytes: usize) -> *mut u8 {
    if memory.is_null() {
        exhaustion::exhausted(bytes);
    }
    memory
}

// SAFETY: everything is what the allocator of the system gives for the same arguments.
unsafe impl GlobalAlloc for Watched {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        exhaustion::wait_if_ending();
        // SAFETY: as this function's.
        check_allocation(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        exhaustion::wait_if_ending();
        // SAFETY: as this function's.
        check_allocation(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        exhaustion::wait_if_ending();
        // SAFETY: as this function's.
        check_allocation(unsafe { System.realloc(memory, layout, bytes) }, bytes)
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: as this function's.
        unsafe { System.dealloc(memory, layout) }
    }
}
