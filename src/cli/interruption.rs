//! Ends the process with a last word: on Ctrl-C, on SIGTERM, or when standard input ends.

use std::io;
use std::process::exit;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::Builder;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::exit::ExitStatus;

/// What is done before the process ends; it is given the name of what ends it.
type LastWord = Arc<dyn Fn(&str) + Send + Sync>;

/// Ctrl-C and SIGTERM from now on; they wait until [`on_signals`] is called.
///
/// # Errors
/// The system refuses to tell of signals.
pub(super) fn signals() -> io::Result<Signals> {
    Signals::new([SIGINT, SIGTERM])
}

/// Has `last_word` done when Ctrl-C or SIGTERM comes, and ends the process. A second one ends it at once.
///
/// # Errors
/// The system starts no thread.
pub(super) fn on_signals(mut signals: Signals, last_word: LastWord) -> io::Result<()> {
    let waiting = Builder::new().spawn(move || {
        let again = AtomicBool::new(false);
        for signal in signals.forever() {
            if again.swap(true, Ordering::Relaxed) {
                leave();
            }
            let name = if signal == SIGINT {
                "Ctrl-C"
            } else {
                "SIGTERM"
            };
            let own = Arc::clone(&last_word);
            // The last word may have to wait for a file that is being written.
            if Builder::new().spawn(move || end(&own, name)).is_err() {
                end(&last_word, name);
            }
        }
    });
    waiting.map(drop)
}

/// The same when standard input ends, which the death of whoever holds its other end brings about.
///
/// # Errors
/// The system starts no thread.
pub(super) fn on_end_of_stdin(last_word: LastWord) -> io::Result<()> {
    let waiting = Builder::new().spawn(move || {
        let _ = io::copy(&mut io::stdin(), &mut io::sink());
        end(&last_word, "the end of standard input");
    });
    waiting.map(drop)
}

/// The process ends even where the last word panics.
fn end(last_word: &LastWord, name: &str) {
    struct Leaving;
    impl Drop for Leaving {
        fn drop(&mut self) {
            leave();
        }
    }
    let _leaving = Leaving;
    last_word(name);
}

fn leave() -> ! {
    exit(i32::from(ExitStatus::Interrupted.code()))
}
