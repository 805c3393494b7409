//! Ends the process with a last message if the system gives it no more memory.
//!
//! After a failed allocation nothing more can be allocated, and locks may be held by other threads.
//! Therefore another thread, which was started before, writes the last message, using a reserve of
//! memory that it first releases. All other threads wait at their next allocation for the end of
//! the process.

use std::cell::Cell;
use std::fmt;
use std::hint::black_box;
use std::io;
use std::io::IsTerminal;
use std::panic::{self, PanicHookInfo};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::thread::{self, Thread};
use std::time::Duration;

use miette::Diagnostic;
use thiserror::Error;

use crate::exit::ExitStatus;
use crate::terminal;

/// Memory reserved for the last message.
const RESERVE_BYTES: usize = 8 << 20;
/// Stack of the thread that writes the last message, and what the first thread has from the start.
const STACK_BYTES: usize = 1 << 20;
/// Memory without which the program does not start: what the system allocates by itself, such as
/// data of threads, ends a program without a word.
const HEADROOM_BYTES: usize = 4 << 20;
/// Time after which the process ends without a last message.
const LONGEST_WORD: Duration = Duration::from_secs(10);

/// The system gave no more memory.
#[derive(Debug, Error)]
#[error("there is no more memory: {:.1} MiB more were asked for{}", *.asked_bytes as f64 / f64::from(1u32 << 20), reading_word(*.reads))]
pub struct OutOfMemory {
    /// Size of the failed allocation.
    pub asked_bytes: usize,
    /// True if files were being read: nothing was computed.
    pub reads: bool,
}

impl Diagnostic for OutOfMemory {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        Some(Box::new(if self.reads {
            "the files of the scene (meshes, matrices, fields) are too large for it: take a coarser mesh, or matrices that \
             were reduced; or raise the limit of memory (`ulimit -v`, the container, the batch system)"
        } else {
            "take fewer threads (--threads 1), fewer response.harmonics or response.samples, fewer pairs, or a coarser mesh; or \
             raise the limit of memory (`ulimit -v`, the container, the batch system)"
        }))
    }
}

fn reading_word(reads: bool) -> &'static str {
    if reads { " while files were read" } else { "" }
}

/// Action before the process ends.
type LastWord = Box<dyn Fn(OutOfMemory) + Send>;

static SPEAKER: OnceLock<Thread> = OnceLock::new();
static LAST_WORD: Mutex<Option<LastWord>> = Mutex::new(None);
static ENDING: AtomicBool = AtomicBool::new(false);
/// True once the thread of the last message runs.
static STARTED: AtomicBool = AtomicBool::new(false);
/// True until the first stage that computes.
static READS: AtomicBool = AtomicBool::new(true);
static ASKED_BYTES: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    static SPEAKS: Cell<bool> = const { Cell::new(false) };
}

/// Touches the stack that the first thread will need. The system grows it on demand, and ends a
/// program by a signal where a limit of memory does not let it.
#[inline(never)]
fn grow_stack() {
    // A constant would not stand on the stack.
    let pages = [black_box(0_u8); STACK_BYTES];
    black_box(&pages);
}

/// Starts the thread that writes the last message, which is also written if a thread panics because
/// it cannot be started.
///
/// # Errors
/// The system starts no thread, or has no memory for the message.
pub fn prepare() -> io::Result<()> {
    let mut reserve: Vec<u8> = Vec::new();
    reserve.try_reserve_exact(RESERVE_BYTES)?;
    Vec::<u8>::new().try_reserve_exact(HEADROOM_BYTES)?;
    grow_stack();
    let speaker = thread::Builder::new().stack_size(STACK_BYTES);
    let speaker = speaker.spawn(move || {
        STARTED.store(true, Ordering::Release);
        while !ENDING.load(Ordering::Acquire) {
            thread::park();
        }
        SPEAKS.set(true);
        drop(reserve);
        announce();
    })?;
    // A thread allocates while it starts: it would wait for its own last message.
    while !STARTED.load(Ordering::Acquire) {
        if speaker.is_finished() {
            return Err(io::ErrorKind::OutOfMemory.into());
        }
        thread::yield_now();
    }
    SPEAKER.get_or_init(|| speaker.thread().clone());
    let usual = panic::take_hook();
    panic::set_hook(Box::new(move |panic| {
        if lacks_memory(panic) {
            exhausted(0);
        }
        usual(panic);
    }));
    Ok(())
}

/// Returns `true` for the panic of the standard library in a thread that it starts without memory for
/// a stack of signals.
fn lacks_memory(panic: &PanicHookInfo<'_>) -> bool {
    let message = panic.payload().downcast_ref::<String>();
    message.is_some_and(|m| m.contains("alternative stack") && m.contains("os error 12"))
}

/// Tells whether a stage reads files or computes, which the last message depends on.
pub fn reads_files(reads: bool) {
    READS.store(reads, Ordering::Relaxed);
}

/// Sets the action, besides the message, before the process ends for lack of memory.
pub fn set_exhaustion_action(last_word: impl Fn(OutOfMemory) + Send + 'static) {
    *LAST_WORD.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(last_word));
}

fn announce() -> ! {
    let error = OutOfMemory {
        asked_bytes: ASKED_BYTES.load(Ordering::Relaxed),
        reads: READS.load(Ordering::Relaxed),
    };
    let told = terminal::rendered(&error, io::stderr().is_terminal());
    write_stderr(&told);
    // A thread that waits may hold the lock.
    if let Ok(Some(last_word)) = LAST_WORD.try_lock().as_deref() {
        last_word(error);
    }
    end()
}

/// Writes to stderr without its lock, which a waiting thread may hold.
fn write_stderr(text: &str) {
    let mut left = text.as_bytes();
    while let Ok(written @ 1..) = rustix::io::write(rustix::stdio::stderr(), left) {
        left = &left[written..];
        if left.is_empty() {
            break;
        }
    }
}

/// Waits for the end if the process is ending for lack of memory. An allocator calls it before it
/// allocates.
#[inline]
pub fn wait_if_ending() {
    if ENDING.load(Ordering::Relaxed) && !is_announcing() {
        wait_for_the_end();
    }
}

/// Ends the process for lack of memory. An allocator calls it if the system gave nothing for this
/// number of bytes. Returns only if no thread was prepared for the last message.
#[cold]
pub fn exhausted(bytes: usize) {
    let Some(speaker) = SPEAKER.get() else {
        return;
    };
    if is_announcing() {
        write_stderr("there is no more memory, not even to say so in full\n");
        end();
    }
    if !ENDING.swap(true, Ordering::AcqRel) {
        ASKED_BYTES.store(bytes, Ordering::Relaxed);
    }
    speaker.unpark();
    wait_for_the_end();
}

fn is_announcing() -> bool {
    SPEAKS.try_with(Cell::get).unwrap_or(false)
}

#[cold]
fn wait_for_the_end() -> ! {
    thread::sleep(LONGEST_WORD);
    end()
}

/// Ends the process at once. `std::process::exit` would first clean up, for which it takes locks
/// that a waiting thread may hold.
fn end() -> ! {
    signal_hook::low_level::exit(i32::from(ExitStatus::Failed.code()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_advice_concerns_what_needs_the_memory() {
        for (reads, said, advised, not_advised) in [
            (true, "while files were read", "matrices", "harmonics"),
            (false, "were asked for", "response.harmonics", "files"),
        ] {
            let error = OutOfMemory {
                asked_bytes: 3 << 20,
                reads,
            };
            let (words, help) = (error.to_string(), error.help().unwrap().to_string());
            assert!(words.starts_with("there is no more memory: 3.0 MiB more"));
            assert!(words.ends_with(said), "{words}");
            assert!(
                help.contains(advised) && !help.contains(not_advised),
                "{help}"
            );
        }
    }
}
