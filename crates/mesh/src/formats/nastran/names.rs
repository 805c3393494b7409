//! Names that preprocessors write into comments.

use std::collections::BTreeMap;

/// Kinds of items with names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Named {
    Property,
    Material,
    Set,
}

/// Names by numbers, and names of the card that follows.
#[derive(Debug, Default)]
pub(super) struct Names {
    known: BTreeMap<(Named, u64), String>,
    /// Name of the next card of a kind.
    next: BTreeMap<Named, String>,
    /// Number of which the next comment has the name (ANSA).
    split: Option<(Named, u64)>,
    /// Components of HyperMesh: names, and ranges of elements.
    components: BTreeMap<u64, (String, Vec<(u64, u64)>)>,
    /// Component of which the next comments list the elements.
    moved: Option<u64>,
}

/// First whole number of a text, and the text behind it.
fn number(text: &str) -> Option<(u64, &str)> {
    let start = text.find(|c: char| c.is_ascii_digit())?;
    let rest = &text[start..];
    let end = rest
        .find(|c: char| !c.is_ascii_digit())
        .unwrap_or(rest.len());
    Some((rest[..end].parse().ok()?, &rest[end..]))
}

/// Text between quotation marks, or the whole text.
fn unquoted(text: &str) -> &str {
    let inner = text
        .split_once('"')
        .and_then(|(_, rest)| rest.split_once('"'));
    inner.map_or(text, |(inner, _)| inner).trim()
}

impl Names {
    /// Reads a comment, without its `$`. `open` is the kind of the card before it, and its number.
    pub fn comment(&mut self, comment: &str, open: Option<(Named, u64)>) {
        if let Some(key) = self.split.take() {
            self.set(key, comment.trim());
            return;
        }
        if let Some(component) = self.moved {
            if self.add_ranges(component, comment) {
                return;
            }
            self.moved = None;
        }
        if let Some(rest) = comment.strip_prefix("HMNAME ") {
            self.hypermesh(rest);
        } else if let Some(rest) = comment.strip_prefix("HMMOVE") {
            self.moved = number(rest).map(|(component, _)| component);
        } else if let Some(rest) = comment.strip_prefix("HMSET") {
            if let Some((set, rest)) = number(rest).filter(|(_, rest)| rest.contains('"')) {
                self.set((Named::Set, set), unquoted(rest));
            }
        } else if let Some(rest) = comment.strip_prefix("ANSA_NAME") {
            self.ansa(rest);
        } else if let Some((_, name)) = comment.split_once("Element Properties for region :") {
            self.next.insert(Named::Property, unquoted(name).to_owned());
        } else if let Some((_, name)) = comment.split_once("Material Record :") {
            self.next.insert(Named::Material, unquoted(name).to_owned());
        } else if let Some((_, name)) = comment.split_once("Pset: ") {
            if let Some(key @ (Named::Property, _)) = open {
                self.set(key, unquoted(name));
            }
        } else {
            self.femap(comment);
        }
    }

    /// `HMNAME PROP 1"blade" 4`, `HMNAME COMP 1"blade" 1 "PSOLID"`, `HMNAME MAT 1"steel"`.
    fn hypermesh(&mut self, rest: &str) {
        let kind = rest.split_whitespace().next().unwrap_or_default();
        let Some((id, after)) = number(rest).filter(|(_, after)| after.contains('"')) else {
            return;
        };
        let name = unquoted(after);
        match kind {
            "PROP" => self.set((Named::Property, id), name),
            "MAT" | "MATS" => self.set((Named::Material, id), name),
            "COMP" | "COMPS" => {
                self.components.insert(id, (name.to_owned(), Vec::new()));
            }
            _ => {}
        }
    }

    /// `ANSA_NAME_COMMENT;1;PSOLID;blade;` or `ANSA_NAME;1;PSOLID;~` before a comment of the name.
    fn ansa(&mut self, rest: &str) {
        let mut fields = rest.split(';').map(str::trim).skip(1);
        let id = fields.next().and_then(|id| id.parse().ok());
        let card = fields.next().unwrap_or_default();
        let kind = match card {
            card if card.starts_with('P') => Named::Property,
            card if card.starts_with("MAT") => Named::Material,
            card if card.starts_with("SET") => Named::Set,
            _ => return,
        };
        let Some(id) = id else { return };
        match fields.next().unwrap_or_default() {
            "" | "~" => self.split = Some((kind, id)),
            name => self.set((kind, id), name),
        }
    }

    /// `Femap Property 1 : blade`, `* Property: blade`.
    fn femap(&mut self, comment: &str) {
        for (word, kind) in [("Property", Named::Property), ("Material", Named::Material)] {
            let Some((before, after)) = comment.split_once(word) else {
                continue;
            };
            if before.contains("Femap") {
                let found = number(after).and_then(|(id, rest)| Some((id, rest.split_once(':')?)));
                if let Some((id, (_, name))) = found {
                    self.set((kind, id), name.trim());
                }
            } else if let Some(name) = after.strip_prefix(':').filter(|_| comment.starts_with('*'))
            {
                self.next.insert(kind, name.trim().to_owned());
            }
        }
    }

    /// Adds `1THRU 5 8` to a component. `false` for another comment.
    fn add_ranges(&mut self, component: u64, comment: &str) -> bool {
        let spaced = comment.replace("THRU", " THRU ");
        let words: Vec<&str> = spaced.split_whitespace().collect();
        let is_number = |word: &&str| word.parse::<u64>().is_ok();
        if words.is_empty() || !words.iter().all(|word| *word == "THRU" || is_number(word)) {
            return false;
        }
        let Some((_, ranges)) = self.components.get_mut(&component) else {
            return true;
        };
        let mut is_end = false;
        for word in words {
            match (word.parse::<u64>(), ranges.last_mut()) {
                (Ok(end), Some(last)) if is_end => last.1 = end,
                (Ok(single), _) => ranges.push((single, single)),
                (Err(_), _) => {}
            }
            is_end = word == "THRU";
        }
        true
    }

    fn set(&mut self, key: (Named, u64), name: &str) {
        if !name.is_empty() {
            self.known.insert(key, name.to_owned());
        }
    }

    /// Gives the name that a comment has for the next card of a kind to the card of this number.
    pub fn follow(&mut self, kind: Named, id: u64) {
        if let Some(name) = self.next.remove(&kind) {
            self.set((kind, id), &name);
        }
    }

    /// Name of a property, a material or a set.
    pub fn get(&self, kind: Named, id: u64) -> Option<&str> {
        self.known.get(&(kind, id)).map(String::as_str)
    }

    /// Components with their elements.
    pub fn components(&self) -> impl Iterator<Item = (&str, &[(u64, u64)])> {
        let components = self.components.values();
        components.map(|(name, ranges)| (name.as_str(), ranges.as_slice()))
    }
}
