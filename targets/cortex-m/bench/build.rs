//! The machine of a Crazyflie takes more than the 16 KiB of the smaller of QEMU's machines. It runs on the other one.

fn main() {
    let target = std::env::var("TARGET").expect("cargo sets it");
    if target.starts_with("thumbv7em") {
        println!("cargo::rustc-link-arg=--defsym=__large_ram=1");
    }
    println!("cargo::rerun-if-changed=build.rs");
}
