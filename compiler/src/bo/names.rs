//! The numbering of a program's global names.

use std::collections::HashMap;

use crate::bo::error::BoCause;
use crate::check::tree::NameId;

/// A global name.
#[derive(Debug, Default)]
pub struct GlobalName {
    pub text: String,
    /// True if any code reads it.
    pub is_read: bool,
    /// Chunks of the named functions of that name, of which the last one counts.
    pub functions: Vec<usize>,
}

/// All global names.
#[derive(Debug, Default)]
pub struct Names {
    names: Vec<GlobalName>,
    numbers: HashMap<String, NameId>,
}

impl Names {
    /// Returns the entry of a name, which is created if it does not exist.
    pub fn entry(&mut self, text: &str) -> (NameId, &mut GlobalName) {
        let next = NameId(self.names.len());
        let id = *self.numbers.entry(text.to_owned()).or_insert(next);
        if id == next {
            self.names.push(GlobalName { text: text.to_owned(), ..GlobalName::default() });
        }
        (id, &mut self.names[id.0])
    }

    /// Returns the text of a name.
    pub fn text(&self, id: NameId) -> &str {
        self.names.get(id.0).map_or("", |name| &name.text)
    }

    /// Returns all names with their numbers.
    pub fn iter(&self) -> impl Iterator<Item = (NameId, &GlobalName)> {
        self.names.iter().enumerate().map(|(number, name)| (NameId(number), name))
    }
}

/// Returns an error if a script could not use the text as a name.
pub fn check_name(text: &str) -> Result<(), BoCause> {
    let mut characters = text.chars();
    let is_identifier = characters.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
        && characters.all(|c| c.is_ascii_alphanumeric() || c == '_');
    if is_identifier { Ok(()) } else { Err(BoCause::NotAnIdentifier) }
}
