//! Mends scripts: applies the edits of compiler messages that are certain.

use std::collections::BTreeMap;
use std::path::Path;

use bittybuzz_compiler::diagnostic::{Diagnostic, Edit};
use bittybuzz_compiler::source::{FileId, SourceMap};

use crate::problem::Problem;
use crate::program;
use crate::whole_file;

/// `--fix` without a file to change.
#[derive(Debug, thiserror::Error)]
#[error("standard input cannot be mended in its place")]
struct FixStandardInput;

impl Problem for FixStandardInput {
    fn help(&self) -> Option<String> {
        Some("with --json each message carries its changes as `edits`".to_owned())
    }
}

/// Mends the files of a script and returns the number of mistakes mended. Changes that overlap others are left for the next run.
pub fn mend(
    main: &Path,
    sources: &SourceMap,
    diagnostics: &[Diagnostic],
) -> Result<usize, Box<dyn Problem>> {
    if program::is_standard_input(main) {
        return Err(FixStandardInput.into());
    }
    let mut edits: BTreeMap<FileId, Vec<&Edit>> = BTreeMap::new();
    let mut mended = 0;
    for diagnostic in diagnostics {
        let parts = &diagnostic.edits;
        let is_ours = |edit: &Edit| !sources.path(edit.span.file).starts_with("<library>");
        let is_free = |edit: &Edit| {
            let planned = edits.get(&edit.span.file);
            planned.is_none_or(|planned| planned.iter().all(|other| !overlap(edit, other)))
        };
        let is_certain = parts.iter().all(|edit| edit.is_certain && is_ours(edit) && is_free(edit));
        if parts.is_empty() || !is_certain {
            continue;
        }
        for edit in parts {
            edits.entry(edit.span.file).or_default().push(edit);
        }
        mended += 1;
    }
    for (file, mut edits) in edits {
        let source = sources.file(file);
        let mut text = source.text.clone();
        // Changes go from the end to the start, so that earlier spans stay valid.
        edits.sort_by_key(|edit| std::cmp::Reverse(edit.span.start));
        for edit in edits {
            text.replace_range(edit.span.start as usize..edit.span.end as usize, &edit.text);
        }
        whole_file::write(&source.path, text.as_bytes())?;
    }
    Ok(mended)
}

fn overlap(a: &Edit, b: &Edit) -> bool {
    a.span.start < b.span.end.max(b.span.start + 1)
        && b.span.start < a.span.end.max(a.span.start + 1)
}
