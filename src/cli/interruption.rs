//! Ends the process with a last action: on Ctrl-C, on SIGTERM, or when standard input ends.

use std::io;
use std::process::exit;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::Builder;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::exit::ExitStatus;

/// Action before the process ends; its argument is the name of the cause.
type LastWord = Arc<dyn Fn(&str) + Send + Sync>;

/// Begins to catch Ctrl-C and SIGTERM; they wait until [`handle_signals`] is called.
///
/// # Errors
/// The system does not permit the handling of signals.
pub(super) fn signals() -> io::Result<Signals> {
    Signals::new([SIGINT, SIGTERM])
}

/// Executes `last_word` on Ctrl-C or SIGTERM, and ends the process. A second signal ends it at
/// once.
///
/// # Errors
/// The system starts no thread.
pub(super) fn handle_signals(mut signals: Signals, last_word: LastWord) -> io::Result<()> {
    let waiting = Builder::new().spawn(move || {
        let again = AtomicBool::new(false);
        for signal in signals.forever() {
            if again.swap(true, Ordering::Relaxed) {
                exit_process();
            }
            let name = if signal == SIGINT {
                "Ctrl-C"
            } else {
                "SIGTERM"
            };
            let last_word_copy = Arc::clone(&last_word);
            // The last word may have to wait for a file that is being written.
            if Builder::new()
                .spawn(move || end(&last_word_copy, name))
                .is_err()
            {
                end(&last_word, name);
            }
        }
    });
    waiting.map(drop)
}

/// Executes `last_word` when standard input ends, as it does when the process at its other end
/// dies, and ends the process.
///
/// # Errors
/// The system starts no thread.
pub(super) fn handle_end_of_stdin(last_word: LastWord) -> io::Result<()> {
    let waiting = Builder::new().spawn(move || {
        let _ = io::copy(&mut io::stdin(), &mut io::sink());
        end(&last_word, "the end of standard input");
    });
    waiting.map(drop)
}

/// Executes the last action and ends the process, even if the action panics.
fn end(last_word: &LastWord, name: &str) {
    struct Leaving;
    impl Drop for Leaving {
        fn drop(&mut self) {
            exit_process();
        }
    }
    let _leaving = Leaving;
    last_word(name);
}

fn exit_process() -> ! {
    exit(i32::from(ExitStatus::Interrupted.code()))
}
