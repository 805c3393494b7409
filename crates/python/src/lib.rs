//! Module `dovetail._dovetail` of the Python package `dovetail`: scenes and their runs, reduced
//! models, and the balance of one frequency, with numpy arrays for results and inputs.
//!
//! Nothing is computed here. `scene.rs` has the scenes of the program, which `running.rs` runs on a
//! thread of their own, so that the thread of Python hears of their events and of Ctrl-C. `run.rs`,
//! `response.rs`, `motion.rs`, `statics.rs` and `pairs.rs` are results. `problem.rs` has reduced
//! models, which `matrices.rs` makes of matrices, and `balance.rs` the residual and the Jacobian of
//! one frequency. `arrays.rs` checks and makes arrays, `errors.rs` makes exceptions.
//!
//! The classes of exceptions, the bar of progress and the reader of output folders are Python
//! (`crates/python/python/dovetail`), and so are the types of all that is defined here
//! (`_dovetail.pyi`): a change here is a change there.

mod arrays;
mod balance;
mod errors;
mod matrices;
mod motion;
mod pairs;
mod problem;
mod response;
mod run;
mod running;
mod scene;
mod stability;
mod statics;
mod subject;

use pyo3::prelude::*;

#[pymodule]
fn _dovetail(module: &Bound<'_, PyModule>) -> PyResult<()> {
    // `RUST_LOG` asks for logs. The program that imports the module may have another logger.
    let _ = env_logger::try_init();
    // Results are then those of the program to the bit.
    dovetail_solver::run::factorise_on_one_thread();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<scene::PyScene>()?;
    module.add_class::<run::PyRun>()?;
    module.add_class::<run::PyPeaks>()?;
    module.add_class::<response::PyResponse>()?;
    module.add_class::<response::PyPeak>()?;
    module.add_class::<motion::PyMotion>()?;
    module.add_class::<stability::PyStability>()?;
    module.add_class::<statics::PyStaticState>()?;
    module.add_class::<pairs::PyPairs>()?;
    module.add_class::<problem::PyProblem>()?;
    module.add_class::<matrices::PyPair>()?;
    module.add_class::<balance::PyBalance>()?;
    Ok(())
}
