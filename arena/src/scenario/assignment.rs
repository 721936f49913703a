//! `[assignment]`: what somebody who learns is to reach, with the expectations as the test of it.

use super::keys::ASSIGNMENT;
use super::read::Section;

/// An assignment of a class.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assignment {
    /// Its title.
    pub title: String,
    /// What is to be done, for people; may be empty.
    pub text: String,
}

/// Reads the section. A mistake in it is reported, and the rest of the file is read all the same.
pub fn read(root: &Section<'_>) -> Option<Assignment> {
    let section = root.section("assignment", ASSIGNMENT)?;
    let title = section.required("title").and_then(|entry| entry.string());
    let text = section.get("text").and_then(|entry| entry.string()).unwrap_or_default();
    Some(Assignment { title: title?.to_owned(), text: text.trim().to_owned() })
}
