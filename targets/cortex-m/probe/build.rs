//! The probe is never run, so it may be larger than the memory of QEMU's machines.

fn main() {
    println!("cargo::rustc-link-arg=--defsym=__large_ram=1");
    println!("cargo::rerun-if-changed=build.rs");
}
