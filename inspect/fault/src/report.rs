//! A run-time error as a message for terminals, as JSON for programs, and as data for pages.

use annotate_snippets::{Group, Level};
use bittybuzz_inspect::{Inspection, ScriptMemory};
use bittybuzz_vm_core::{Fault, FaultCode};
use serde_json::{Value, json};

use crate::backtrace::Backtrace;
use crate::code::code;
use crate::description::{FaultDescription, FaultValue};
use crate::words::{Words, describe};
use crate::{memory, printable, values};

/// A run-time error with its place in the script.
pub struct FaultReport<'a> {
    cause: FaultCode,
    words: Words,
    backtrace: Backtrace<'a>,
    /// The use of a memory that was full.
    memory: Option<String>,
    /// The values that the instruction used; `None` if the machine was not inspected.
    values: Option<Vec<FaultValue>>,
}

impl<'a> FaultReport<'a> {
    /// Describes a fault. `accepted` lists the arguments that the robot function accepts, if it
    /// refused those of the call.
    #[must_use]
    pub fn new(fault: &Fault, backtrace: Backtrace<'a>, accepted: Option<&str>) -> Self {
        let marked = backtrace.marked();
        let words = describe(fault, backtrace.program(), marked.as_deref(), accepted);
        FaultReport { cause: fault.code, words, backtrace, memory: None, values: None }
    }

    /// Adds the use of the memory, if the script ran out of it.
    #[must_use]
    pub fn with_memory(mut self, memory: Option<&ScriptMemory>) -> Self {
        let program = self.backtrace.program();
        self.memory = memory.map(|memory| memory::text(memory, program));
        self
    }

    /// Adds the values that the instruction used, from the content of the machine at the fault.
    #[must_use]
    pub fn with_content(mut self, content: Option<&Inspection>) -> Self {
        let marked = self.backtrace.marked();
        self.values = content.map(|content| match marked {
            Some(marked) => values::of(&marked, content),
            None => Vec::new(),
        });
        self
    }

    /// Returns the message for a terminal, with place, source line, calls and help. `notes` add the
    /// circumstances.
    pub fn message(&self, notes: &[String]) -> Group<'static> {
        let Words { headline, help } = self.words.clone();
        let title = Level::ERROR.primary_title(headline).id(code(self.cause));
        let notes = notes.iter().chain(&self.memory);
        let notes = notes.map(|note| Level::NOTE.message(printable(note)));
        let help = help.map(|help| Level::HELP.message(help));
        title.elements(self.backtrace.elements()).elements(notes).elements(help)
    }

    /// Returns code, message, help, and the places of the calls, innermost first; with the values
    /// if the machine was inspected.
    pub fn json(&self) -> Value {
        let Words { headline, help } = &self.words;
        let mut object = json!({
            "code": code(self.cause), "message": headline, "help": help, "calls": self.backtrace.places(),
        });
        if let Some(values) = &self.values {
            object["values"] = json!(values);
        }
        object
    }

    /// Returns the error as data.
    pub fn description(&self) -> FaultDescription {
        let Words { headline, help } = self.words.clone();
        let (places, left_out) = self.backtrace.described();
        FaultDescription {
            code: code(self.cause),
            message: headline,
            help,
            notes: self.memory.iter().cloned().collect(),
            values: self.values.clone().unwrap_or_default(),
            places,
            left_out,
        }
    }
}
