//! Messages of the compiler.

use std::path::Path;

use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::include::{IncludeLoader, MemoryFiles};
use bittybuzz_compiler::render::Renderer;
use bittybuzz_live::CompilerMessage;

#[test]
fn a_client_gets_the_messages_of_bbz_check() {
    let files = MemoryFiles::default();
    let text =
        "include \"none.bzz\"\nvalue = 1\nvaleu = value\nlog(\"a\" + 1)\nif(value = 2) log(1)\n";
    let loader = IncludeLoader::new(&files);
    let compiled = compile(Path::new("a.bzz"), text.to_owned(), &loader, &Options::default());
    let renderer = Renderer::new(&compiled.sources);
    assert!(compiled.diagnostics.len() > 2, "{:?}", compiled.diagnostics);
    assert!(compiled.diagnostics.iter().any(|one| !one.edits.is_empty()));
    for one in &compiled.diagnostics {
        let message = serde_json::to_value(CompilerMessage::of_diagnostic(&renderer, one)).unwrap();
        assert_eq!(message, renderer.json(one));
    }
}
