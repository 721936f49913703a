//! The controller and its copy are on the stack, next to the simulated quadrotor.

fn main() {
    println!("cargo::rustc-link-arg=--defsym=__large_ram=1");
    println!("cargo::rerun-if-changed=build.rs");
}
