//! Generates bindings for the parts of simavr that are used.

use std::path::PathBuf;

const HEADER: &str = "
#include <simavr/sim_avr.h>
#include <simavr/sim_io.h>
#include <simavr/sim_core.h>
";

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    // pkg-config is not used: Debian's file for simavr requires libelf, which nothing here uses.
    println!("cargo:rustc-link-lib=simavr");
    let bindings = bindgen::Builder::default()
        .header_contents("simavr.h", HEADER)
        .clang_arg("-I/usr/include/simavr")
        .allowlist_function("avr_run_one|avr_global_logger_set")
        .allowlist_type("avr_t|avr_io_t")
        .allowlist_var("cpu_Running|cpu_Sleeping|cpu_Crashed|S_I|LOG_ERROR")
        .default_enum_style(bindgen::EnumVariation::Consts)
        .layout_tests(false)
        .generate();
    let bindings = bindings.unwrap_or_else(|error| {
        panic!("simavr's headers are missing: `cargo xtask setup`, or `apt-get install libsimavr-dev`\n{error}")
    });
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets it"));
    bindings.write_to_file(out.join("simavr.rs")).expect("the output folder is writable");
}
