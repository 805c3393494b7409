//! Interface of those who hear of a run from the [reporter](crate::reporter): the console of the
//! program, or a program around this library.

use std::ops::ControlFlow;

use dovetail_export::manifest::StageSummary;
use dovetail_export::warning::Warning;
use dovetail_solver::run::Event;

/// Piece of news of a run.
#[derive(Debug, Clone, Copy)]
pub enum News<'a> {
    /// A stage begins; its title.
    StageBegins(&'a str),
    /// The stage that began last has ended, with its time and memory.
    StageEnds(&'a StageSummary),
    /// A finding, in words.
    Note(&'a str),
    /// A warning to the user.
    Warning(&'a Warning),
    /// Any other event of the library, after the notes and warnings about it.
    Event(&'a Event<'a>),
}

/// Receiver of the news of a run. The calls come one after the other, from any thread.
pub trait Listener: Send {
    /// Receives a piece of news. [`ControlFlow::Break`] ends the run at its next event.
    fn on_news(&mut self, news: News<'_>) -> ControlFlow<()>;
}
