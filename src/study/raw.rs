//! Mirror of a study file, as [`crate::scene::raw`] is that of a scene.

use serde::Deserialize;
use serde_spanned::Spanned;
use toml::Value;

use crate::scene::raw::{Located, Number};

/// Words for the kinds of a parameter.
pub(super) const KIND_WORDS: [&str; 3] = ["numerical", "load", "design"];

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawStudy {
    pub name: Located<String>,
    pub scene: Located<String>,
    #[serde(default)]
    pub set: Vec<Spanned<String>>,
    pub mode: Located<String>,
    pub quantities: Located<Vec<Spanned<String>>>,
    #[serde(default)]
    pub fields: bool,
    #[serde(default)]
    pub parameter: Vec<Spanned<RawParameter>>,
    #[serde(default)]
    pub minimise: Vec<Spanned<RawMinimum>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawMinimum {
    pub quantity: Located<String>,
}

/// Mirror of the table.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawParameter {
    pub name: Located<String>,
    pub key: Located<String>,
    pub is: Located<String>,
    pub values: Located<Vec<Spanned<Value>>>,
    pub base: Located<Value>,
    pub size: Located<Value>,
    pub order: Located<Number>,
}
