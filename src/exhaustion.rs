//! Ends the process with a last word where the system gives it no more memory.
//!
//! Where an allocation has failed nothing more can be allocated, and locks may be held. Another thread, which was started
//! before, therefore speaks the last word, on a reserve that it gives back first. All others wait at their next
//! allocation for the end of the process.

use std::cell::Cell;
use std::io;
use std::io::IsTerminal;
use std::process::exit;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::thread::{self, Thread};
use std::time::Duration;

use miette::Diagnostic;
use thiserror::Error;

use crate::exit::ExitStatus;
use crate::terminal;

/// What the last word may take.
const RESERVE_BYTES: usize = 8 << 20;
/// Of the thread that speaks it.
const STACK_BYTES: usize = 1 << 20;
/// After this time the process ends without a last word.
const LONGEST_WORD: Duration = Duration::from_secs(10);

/// The system gave no more memory.
#[derive(Debug, Error, Diagnostic)]
#[error("there is no more memory: {:.1} MiB more were asked for", *.asked_bytes as f64 / f64::from(1u32 << 20))]
#[diagnostic(help(
    "take fewer threads (--threads 1), fewer response.harmonics or response.samples, fewer pairs, or a coarser mesh; or raise the \
     limit of memory (`ulimit -v`, the container, the batch system)"
))]
pub struct OutOfMemory {
    /// By the allocation that failed.
    pub asked_bytes: usize,
}

/// What is done before the process ends.
type LastWord = Box<dyn Fn(OutOfMemory) + Send>;

static SPEAKER: OnceLock<Thread> = OnceLock::new();
static LAST_WORD: Mutex<Option<LastWord>> = Mutex::new(None);
static ENDING: AtomicBool = AtomicBool::new(false);
static ASKED_BYTES: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    static SPEAKS: Cell<bool> = const { Cell::new(false) };
}

/// Starts the thread that speaks the last word.
///
/// # Errors
/// The system starts no thread.
pub fn prepare() -> io::Result<()> {
    let reserve: Vec<u8> = Vec::with_capacity(RESERVE_BYTES);
    let speaker = thread::Builder::new().stack_size(STACK_BYTES);
    let speaker = speaker.spawn(move || {
        while !ENDING.load(Ordering::Acquire) {
            thread::park();
        }
        SPEAKS.set(true);
        drop(reserve);
        speak();
    })?;
    SPEAKER.get_or_init(|| speaker.thread().clone());
    Ok(())
}

/// What is done, besides a message, before the process ends for want of memory.
pub fn on_exhaustion(last_word: impl Fn(OutOfMemory) + Send + 'static) {
    *LAST_WORD.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(last_word));
}

fn speak() -> ! {
    let error = OutOfMemory {
        asked_bytes: ASKED_BYTES.load(Ordering::Relaxed),
    };
    let told = terminal::rendered(&error, io::stderr().is_terminal());
    say(&told);
    // A thread that waits may hold the lock.
    if let Ok(Some(last_word)) = LAST_WORD.try_lock().as_deref() {
        last_word(error);
    }
    exit(i32::from(ExitStatus::Failed.code()))
}

/// To stderr, past its lock, which a thread that waits may hold.
fn say(text: &str) {
    let mut left = text.as_bytes();
    while let Ok(written @ 1..) = rustix::io::write(rustix::stdio::stderr(), left) {
        left = &left[written..];
        if left.is_empty() {
            break;
        }
    }
}

/// For an allocator, before it allocates: waits for the end where the process is ending for want of memory.
#[inline]
pub fn wait_if_ending() {
    if ENDING.load(Ordering::Relaxed) && !speaks() {
        wait_for_the_end();
    }
}

/// For an allocator whose system gave nothing for so many bytes. Returns where nobody is there to speak a last word.
#[cold]
pub fn exhausted(bytes: usize) {
    let Some(speaker) = SPEAKER.get() else {
        return;
    };
    if speaks() {
        say("there is no more memory, not even to say so in full\n");
        exit(i32::from(ExitStatus::Failed.code()));
    }
    if !ENDING.swap(true, Ordering::AcqRel) {
        ASKED_BYTES.store(bytes, Ordering::Relaxed);
    }
    speaker.unpark();
    wait_for_the_end();
}

fn speaks() -> bool {
    SPEAKS.try_with(Cell::get).unwrap_or(false)
}

#[cold]
fn wait_for_the_end() -> ! {
    thread::sleep(LONGEST_WORD);
    exit(i32::from(ExitStatus::Failed.code()))
}
