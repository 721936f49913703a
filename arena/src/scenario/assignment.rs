//! `[assignment]`: a task for a class, which the expectations test.

use super::keys::{ASSIGNMENT, ASSIGNMENT_FR};
use super::read::Section;

/// An assignment for a class.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assignment {
    pub task: Task,
    /// The task in French.
    pub french: Option<Task>,
}

/// A task in one language.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Task {
    pub title: String,
    /// The task in words; may be empty.
    pub text: String,
}

/// Reads the section. A mistake in it is reported, and the rest of the file is still read.
pub fn read(root: &Section<'_>) -> Option<Assignment> {
    let section = root.section("assignment", ASSIGNMENT)?;
    let french = section.section("fr", ASSIGNMENT_FR).and_then(|section| task(&section));
    Some(Assignment { task: task(&section)?, french })
}

fn task(section: &Section<'_>) -> Option<Task> {
    let title = section.required("title").and_then(|entry| entry.string());
    let text = section.get("text").and_then(|entry| entry.string()).unwrap_or_default();
    Some(Task { title: title?.to_owned(), text: text.trim().to_owned() })
}
