//! Groups that a file may give one name: each keeps a name that says which of them it is.

use std::collections::BTreeMap;

use super::content::Content;
use crate::{Group, MeshError};

/// Origin of a group. Of groups with one name the first in this order keeps it, and the others get
/// their [`Origin::suffix`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Origin {
    Instance,
    Solids,
    Part,
    Surface,
    Shells,
    Lines,
    NodeSet,
    NodeSurface,
}

impl Origin {
    fn suffix(self) -> &'static str {
        match self {
            Self::Instance => " (instance)",
            Self::Solids => " (elements)",
            Self::Part => " (part)",
            Self::Surface => " (surface)",
            Self::Shells => " (shells)",
            Self::Lines => " (lines)",
            Self::NodeSet => " (nodes)",
            Self::NodeSurface => " (node surface)",
        }
    }
}

/// Groups by name and origin. Names that differ only in the case of the letters A to Z are one
/// name, spelled as at its first place.
#[derive(Debug, Default)]
pub(super) struct NamedGroups {
    found: BTreeMap<String, (String, BTreeMap<Origin, Group>)>,
}

impl NamedGroups {
    /// Adds a group; it replaces one of the same name and origin.
    pub fn keep(&mut self, name: &str, origin: Origin, group: Group) {
        let (_, groups) = self
            .found
            .entry(name.to_ascii_uppercase())
            .or_insert_with(|| (name.to_owned(), BTreeMap::new()));
        groups.insert(origin, group);
    }

    /// Moves the groups to the content of the file.
    ///
    /// # Errors
    /// A name with the word of an origin behind it is the name of another group.
    pub fn move_to(&mut self, content: &mut Content) -> Result<(), MeshError> {
        for (name, origins) in std::mem::take(&mut self.found).into_values() {
            for (place, (origin, group)) in origins.into_iter().enumerate() {
                let name = match place {
                    0 => name.clone(),
                    _ => format!("{name}{}", origin.suffix()),
                };
                content.add_group(name, group)?;
            }
        }
        Ok(())
    }
}
