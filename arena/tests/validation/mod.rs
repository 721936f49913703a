//! Figures of publications beside those of the simulator.
//!
//! The tables of docs/validation.md are those of these tests: `UPDATE_DOCS=1` writes them. `cargo xtask soak claims` repeats the
//! tests, which take minutes. Runs are deterministic, so the numbers in the document are compared as they are.

mod diffusion;
mod infrared;
mod motion;
mod opinions;
mod walk_model;

use std::path::Path;
use std::{env, fs};

const DOCS: &str = "../docs/validation.md";

/// Compares a table with the one of that name in the document, or writes it there.
fn check(name: &str, table: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(DOCS);
    let text = fs::read_to_string(&path).unwrap();
    let (begin, end) = (format!("<!-- {name} -->\n"), format!("<!-- end of {name} -->\n"));
    let (before, rest) = text.split_once(&begin).expect("docs/validation.md has this table");
    let (shown, after) = rest.split_once(&end).expect("the table has an end");
    let table = format!("\n{table}\n");
    if env::var_os("UPDATE_DOCS").is_some() {
        // The tests must run one after the other for this.
        fs::write(&path, [before, &begin, &table, &end, after].concat()).unwrap();
    } else {
        assert_eq!(shown, table, "docs/validation.md: write the table with UPDATE_DOCS=1");
    }
}
