//! Exceptions of the package, whose classes stand in `dovetail/_errors.py`.

use std::error::Error;

use miette::Diagnostic;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use dovetail::error::RunError;
use dovetail::scene::SceneError;
use dovetail_solver::run;

/// Exception of a class of `dovetail._errors`, made of its arguments.
fn class_error<'py, A>(py: Python<'py>, class: &str, arguments: A) -> PyErr
where
    A: pyo3::call::PyCallArgs<'py>,
{
    let made = || {
        let class = py.import("dovetail._errors")?.getattr(class)?;
        class.call1(arguments)
    };
    match made() {
        Ok(exception) => PyErr::from_value(exception),
        Err(error) => error,
    }
}

/// Message of an error with those of its causes.
fn message_with_causes(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(inner) = cause {
        let words = inner.to_string();
        if !text.contains(&words) {
            text = format!("{text}: {words}");
        }
        cause = inner.source();
    }
    text
}

/// `dovetail.SceneError` with each problem: its key, what is wrong, and the remedy.
pub fn scene_error(py: Python<'_>, error: &SceneError) -> PyErr {
    let remedy = error.help().map(|help| help.to_string());
    let problems = match error {
        SceneError::Read { .. } => Vec::new(),
        SceneError::Invalid { problems } => problems
            .iter()
            .map(|p| (p.fault.key(), p.fault.to_string(), p.fault.remedy()))
            .collect(),
    };
    class_error(
        py,
        "SceneError",
        (message_with_causes(error), remedy, problems),
    )
}

/// `dovetail.RunError` with its remedy.
pub fn run_error(py: Python<'_>, error: &RunError) -> PyErr {
    let remedy = error.help().map(|help| help.to_string());
    class_error(py, "RunError", (message_with_causes(error), remedy))
}

/// `dovetail.RunError` of an error of the library.
pub fn library_error(py: Python<'_>, error: impl Into<run::Error>) -> PyErr {
    run_error(py, &RunError::from(error.into()))
}

/// `dovetail.RunError` of words alone.
pub fn remedy_error(py: Python<'_>, message: &str, remedy: &str) -> PyErr {
    class_error(py, "RunError", (message, Some(remedy)))
}

/// Exception of a thread that panicked, which no input should cause.
pub fn panic_error(payload: &(dyn std::any::Any + Send)) -> PyErr {
    let words = (payload.downcast_ref::<&str>().map(|s| (*s).to_owned()))
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_default();
    PyRuntimeError::new_err(format!(
        "dovetail has an error of its own: {words}; please report it with the input"
    ))
}

/// `ValueError` of a remedy and of what is wrong.
pub fn value(message: impl Into<String>) -> PyErr {
    PyValueError::new_err(message.into())
}
