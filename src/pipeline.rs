//! placeholder
use std::path::PathBuf;

use crate::error::Error;
use crate::progress::Progress;
use crate::scene::Scene;

pub struct Options {
    pub out: PathBuf,
}
pub fn run(_: &Scene, _: &Options, _: &Progress) -> Result<(), Error> {
    Ok(())
}
pub fn mesh(_: &Scene, _: &Options, _: &Progress) -> Result<(), Error> {
    Ok(())
}
pub fn modes(_: &Scene, _: &Options, _: &Progress) -> Result<(), Error> {
    Ok(())
}
pub fn static_state(_: &Scene, _: &Options, _: &Progress) -> Result<(), Error> {
    Ok(())
}
pub fn check(_: &Scene, _: &Options, _: &Progress) -> Result<(), Error> {
    Ok(())
}
