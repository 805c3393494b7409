//! The memory of the process: the system's, and where the system gives none the end that [`dovetail::exhaustion`] makes.
//!
//! Without it the first allocation that fails ends the process by a signal, and what stands in the folder of the run
//! still says that the run is going on.

#![expect(unsafe_code, reason = "an allocator hands out raw memory")]

use std::alloc::{GlobalAlloc, Layout, System};

use dovetail::exhaustion;

/// Hands on to the allocator of the system.
pub struct Watched;

fn given(memory: *mut u8, bytes: usize) -> *mut u8 {
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
        given(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        exhaustion::wait_if_ending();
        // SAFETY: as this function's.
        given(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        exhaustion::wait_if_ending();
        // SAFETY: as this function's.
        given(unsafe { System.realloc(memory, layout, bytes) }, bytes)
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: as this function's.
        unsafe { System.dealloc(memory, layout) }
    }
}
