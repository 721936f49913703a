//! Compiles the script that `BBZ_SCRIPT` names (an empty one without it) for the bench robot.

use std::path::{Path, PathBuf};

use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::include::{DiskFiles, Loader};
use bittybuzz_compiler::render::{Color, Renderer};

fn main() {
    println!("cargo:rerun-if-env-changed=BBZ_SCRIPT");
    let path = std::env::var("BBZ_SCRIPT").unwrap_or_else(|_| "empty.bzz".into());
    println!("cargo:rerun-if-changed={path}");
    let robot = bittybuzz_robots::find("bench").unwrap_or_else(|error| panic!("{error}"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
    let options = Options {
        profile: None,
        robots: bittybuzz_robots::all_shipped(),
        robot: Some(robot.clone()),
    };
    let compiled = compile(Path::new(&path), text, &Loader::new(&DiskFiles), &options);
    let renderer = Renderer::new(&compiled.sources);
    for diagnostic in &compiled.diagnostics {
        eprintln!("{}", renderer.text(diagnostic, Color::Never));
    }
    let (Some(image), Some(symbols)) = (compiled.image, compiled.symbols) else {
        panic!("{path}: see the errors above");
    };
    let result = symbols.globals.iter().position(|name| name == "r").unwrap_or(0xffff);
    let out = PathBuf::from(std::env::var("OUT_DIR").expect("cargo sets it"));
    let source = format!(
        "const SLOTS: usize = {};\nconst RESULT_GLOBAL: u16 = {result};\nconst IMAGE: &[u8; {}] = &{image:?};\n",
        robot.vm.slots,
        image.len(),
    );
    std::fs::write(out.join("script.rs"), source).expect("the output folder is writable");
}
