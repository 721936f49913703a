//! CSV (RFC 4180), with a line of names first. A value that is missing is an empty cell.

use std::fmt::Write as _;
use std::io::{self, Write};

use crate::block::{Block, Cells};
use crate::schema::Schema;

/// Writes the line of names.
pub fn write_names(output: &mut dyn Write, schema: &Schema) -> io::Result<()> {
    let mut line = String::new();
    for (number, column) in schema.columns().iter().enumerate() {
        add_separator(&mut line, number);
        add_text(&mut line, &column.name);
    }
    line.push_str("\r\n");
    output.write_all(line.as_bytes())
}

/// Writes a line for each row. Numbers have as many digits as they need.
pub fn write_rows(output: &mut dyn Write, block: &Block) -> io::Result<()> {
    let mut line = String::new();
    for row in 0..block.rows() {
        line.clear();
        for (number, cells) in block.cells().iter().enumerate() {
            add_separator(&mut line, number);
            let written = match cells {
                Cells::Integers(values) => write!(line, "{}", values[row]),
                Cells::OptionalIntegers(values) => add(&mut line, values[row]),
                Cells::OptionalNumbers(values) => add(&mut line, values[row]),
                Cells::OptionalTexts(values) => {
                    if let Some(text) = &values[row] {
                        add_text(&mut line, text);
                    }
                    Ok(())
                }
            };
            written.expect("a text takes all characters");
        }
        line.push_str("\r\n");
        output.write_all(line.as_bytes())?;
    }
    Ok(())
}

fn add(line: &mut String, value: Option<impl std::fmt::Display>) -> std::fmt::Result {
    value.map_or(Ok(()), |value| write!(line, "{value}"))
}

fn add_separator(line: &mut String, number: usize) {
    if number > 0 {
        line.push(',');
    }
}

/// Appends a text, in quotes if a reader would not take it for one cell, or for a missing value.
fn add_text(line: &mut String, text: &str) {
    if text.is_empty() || text.contains([',', '"', '\n', '\r']) {
        line.push('"');
        line.push_str(&text.replace('"', "\"\""));
        line.push('"');
    } else {
        line.push_str(text);
    }
}
