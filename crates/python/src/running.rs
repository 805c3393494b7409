//! Work on a thread of its own, while the thread of Python hears of its events and of Ctrl-C.
//!
//! Python handles signals on its main thread alone, and a callback of a user may do anything: both
//! belong to the thread that called. The work sends its news through a channel, and looks before
//! each event whether it is to end.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors;
use dovetail::listener::{Listener, News};
use dovetail_solver::dlft::{Stop, SweepProgress};
use dovetail_solver::run::Event;

/// Time between two looks for signals.
const LOOK: Duration = Duration::from_millis(50);
/// Stack of the thread of the work, bytes: that of a main thread.
const STACK: usize = 8 << 20;

/// Piece of news on its way to Python.
enum Message {
    StageBegins(String),
    StageEnds {
        title: String,
        seconds: f64,
        memory_mib: Option<f64>,
        from_cache: bool,
    },
    Note(String),
    Warning(String),
    LoopBegins {
        label: String,
        steps: usize,
    },
    LoopExpects(usize),
    LoopAdvances(usize),
    LoopEnds,
    Frequency {
        frequency_hz: f64,
        amplitude_m: Vec<f64>,
        outcome: String,
    },
}

impl Message {
    fn from_news(news: News<'_>) -> Option<Self> {
        Some(match news {
            News::StageBegins(title) => Self::StageBegins(title.to_owned()),
            News::StageEnds(stage) => Self::StageEnds {
                title: stage.name.clone(),
                seconds: stage.seconds,
                memory_mib: stage.peak_memory_mib,
                from_cache: stage.from_cache,
            },
            News::Note(text) => Self::Note(text.to_owned()),
            News::Warning(warning) => Self::Warning(warning.text.clone()),
            News::Event(Event::LoopBegins { label, steps }) => Self::LoopBegins {
                label: (*label).to_owned(),
                steps: *steps,
            },
            News::Event(Event::LoopExpects(steps)) => Self::LoopExpects(*steps),
            News::Event(Event::LoopAdvances(steps)) => Self::LoopAdvances(*steps),
            News::Event(Event::LoopEnds) => Self::LoopEnds,
            News::Event(Event::Frequency(solved)) => Self::Frequency {
                frequency_hz: solved.orbit.frequency_hz,
                amplitude_m: solved.orbit.observed_amplitude.clone(),
                outcome: solved.orbit.outcome.to_string(),
            },
            News::Event(_) => return None,
        })
    }

    /// Event as a dictionary, with its kind.
    fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let dict = PyDict::new(py);
        let kind = match self {
            Self::StageBegins(title) => {
                dict.set_item("title", title)?;
                "stage_begins"
            }
            Self::StageEnds {
                title,
                seconds,
                memory_mib,
                from_cache,
            } => {
                dict.set_item("title", title)?;
                dict.set_item("seconds", seconds)?;
                dict.set_item("memory_mib", memory_mib)?;
                dict.set_item("from_cache", from_cache)?;
                "stage_ends"
            }
            Self::Note(text) => {
                dict.set_item("text", text)?;
                "note"
            }
            Self::Warning(text) => {
                dict.set_item("text", text)?;
                "warning"
            }
            Self::LoopBegins { label, steps } => {
                dict.set_item("label", label)?;
                dict.set_item("steps", steps)?;
                "loop_begins"
            }
            Self::LoopExpects(steps) => {
                dict.set_item("steps", steps)?;
                "loop_expects"
            }
            Self::LoopAdvances(steps) => {
                dict.set_item("steps", steps)?;
                "loop_advances"
            }
            Self::LoopEnds => "loop_ends",
            Self::Frequency {
                frequency_hz,
                amplitude_m,
                outcome,
            } => {
                dict.set_item("frequency_hz", frequency_hz)?;
                dict.set_item("amplitude_m", amplitude_m)?;
                dict.set_item("outcome", outcome)?;
                "frequency"
            }
        };
        dict.set_item("kind", kind)?;
        Ok(dict)
    }
}

/// End of the channel that the work holds.
pub struct Wire {
    sender: Sender<Message>,
    is_ended: Arc<AtomicBool>,
}

impl Wire {
    fn send(&self, message: Message) {
        // Nobody listens where the thread of Python is gone, which waits for the work.
        let _ = self.sender.send(message);
    }

    /// True once the work is to end.
    pub fn is_ended(&self) -> bool {
        self.is_ended.load(Ordering::Relaxed)
    }

    /// Tells of a loop, whose steps [`Wire::on_progress`] counts.
    pub fn start_bar(&self, label: &str, steps: usize) {
        let label = label.to_owned();
        self.send(Message::LoopBegins { label, steps });
    }

    /// Tells of the end of that loop.
    pub fn ends(&self) {
        self.send(Message::LoopEnds);
    }

    /// Tells of the progress of a sweep outside of a run, and stops it where it is to end.
    pub fn on_progress(&self, told: SweepProgress<'_>) {
        match told {
            SweepProgress::Solved(solved) => {
                self.send(Message::Frequency {
                    frequency_hz: solved.orbit.frequency_hz,
                    amplitude_m: solved.orbit.observed_amplitude.clone(),
                    outcome: solved.orbit.outcome.to_string(),
                });
                self.send(Message::LoopAdvances(usize::from(!solved.again)));
            }
            SweepProgress::Next(stop) => self.set_stop(stop),
            SweepProgress::Tries(_) | SweepProgress::Apart => {}
        }
    }

    fn set_stop(&self, stop: &Stop) {
        if self.is_ended() {
            stop.stop();
        }
    }
}

impl Listener for Wire {
    fn on_news(&mut self, news: News<'_>) -> ControlFlow<()> {
        if let Some(message) = Message::from_news(news) {
            self.send(message);
        }
        if self.is_ended() {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }
}

/// What Python hears: its callback, if any, and the warnings so far.
struct Hearer<'py> {
    callback: Option<Bound<'py, PyAny>>,
    warnings: Vec<String>,
}

impl Hearer<'_> {
    fn handle_message(&mut self, py: Python<'_>, message: Message) -> PyResult<()> {
        if let Message::Warning(text) = &message {
            self.warnings.push(text.clone());
        }
        if let Some(callback) = &self.callback {
            callback.call1((message.into_dict(py)?,))?;
        }
        Ok(())
    }
}

/// Does `work` on a thread of its own, and returns its result with the warnings that it gave.
/// `progress` is what a user gave: `True` for the bar of the package, a callable that hears each
/// event as a dictionary, or `False` or `None`.
///
/// # Errors
/// `KeyboardInterrupt` by Ctrl-C, and what the callback raises: the work has ended then.
pub fn watched<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(Wire) -> T + Send,
) -> PyResult<(T, Vec<String>)> {
    let chosen = py.import("dovetail._progress")?.getattr("chosen")?;
    let chosen = chosen.call1((progress,))?;
    let mut hearer = Hearer {
        callback: (!chosen.is_none()).then_some(chosen),
        warnings: Vec::new(),
    };
    let (sender, receiver) = channel();
    let is_ended = Arc::new(AtomicBool::new(false));
    let wire = Wire {
        sender,
        is_ended: Arc::clone(&is_ended),
    };
    let receiver = Mutex::new(receiver);
    let mut failed: Option<PyErr> = None;
    let done = std::thread::scope(|scope| {
        let builder = std::thread::Builder::new().stack_size(STACK);
        let thread = builder.spawn_scoped(scope, move || work(wire))?;
        loop {
            let message = match py.detach(|| next(&receiver)) {
                Ok(message) => Some(message),
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => break,
            };
            let mut heard = py.check_signals();
            if let (Some(message), true) = (message, failed.is_none()) {
                heard = heard.and_then(|()| hearer.handle_message(py, message));
            }
            if let Err(error) = heard {
                is_ended.store(true, Ordering::Relaxed);
                failed.get_or_insert(error);
            }
        }
        py.detach(|| thread.join())
            .map_err(|payload| errors::panic_error(payload.as_ref()))
    });
    if let Some(callback) = &hearer.callback
        && let Ok(close) = callback.getattr("close")
    {
        close.call0()?;
    }
    match failed {
        Some(error) => Err(error),
        None => Ok((done?, hearer.warnings)),
    }
}

fn next(receiver: &Mutex<Receiver<Message>>) -> Result<Message, RecvTimeoutError> {
    let receiver = receiver.lock().unwrap_or_else(PoisonError::into_inner);
    receiver.recv_timeout(LOOK)
}
