//! Compiles and runs the generated source: its numbers must be those of the robot file.

use bittybuzz_robot_files::all_shipped;
use bittybuzz_robot_spec::{Layout, OnFault, Robot, generate_rust, name_hash};
use std::fs;
use std::io;
use std::path::Path;
use std::process::Command;

/// A `main` that prints what the generated module holds.
const PRINT: &str = r#"
#![deny(warnings)]
#[allow(dead_code)]
mod robot {
    include!("robot.rs");
}
const LED: u16 = robot::function::LED;
fn main() {
    let is_led = matches!(robot::FUNCTIONS[0], LED);
    println!("{} {} {} {}", robot::NAME, robot::PROFILE, robot::MATHS, is_led);
    println!("on fault: {}", if robot::ON_FAULT_STOPS { "stop" } else { "restart" });
    println!(
        "{} {} {} {} {} {} {} {} {} {} {} {}",
        robot::TICK_HZ, robot::MESSAGE_BYTES, robot::MEMORY, robot::QUEUE_MEMORY, robot::SLOTS, robot::NEIGHBORS,
        robot::IN_QUEUE, robot::OUT_QUEUE, robot::IN_LONG, robot::OUT_LONG, robot::STIGMERGY_ENTRIES, robot::SWARMS,
    );
    for hash in robot::FUNCTIONS {
        println!("{hash}");
    }
    layout();
}
"#;

/// Returns code that prints the regions and settings of a robot.
fn print_layout(robot: &Robot) -> String {
    let mut out = "fn layout() {\n".to_owned();
    for (name, _) in robot.layout.iter().flat_map(Layout::regions) {
        out += &format!(
            "println!(\"{name} {{}} {{}}\", robot::{name}_ADDRESS, robot::{name}_SIZE);\n"
        );
    }
    for setting in &robot.settings {
        let name = setting.name.to_uppercase();
        out += &format!("println!(\"{name} {{}}\", robot::setting::{name});\n");
    }
    out + "}\n"
}

fn expected(robot: &Robot) -> String {
    let vm = robot.vm;
    let mut out = format!("{} {} {} true\n", robot.name, robot.profile.name(), vm.maths);
    out += match robot.on_fault {
        OnFault::Restart => "on fault: restart\n",
        OnFault::Stop => "on fault: stop\n",
    };
    let sizes = [
        robot.tick_hz,
        robot.message_bytes,
        vm.memory,
        robot.queue_memory(),
        vm.slots,
        vm.neighbors,
        vm.in_queue,
        vm.out_queue,
        vm.in_long,
        vm.out_long,
        vm.stigmergy_entries,
        vm.swarms,
    ];
    out += &sizes.map(|size| size.to_string()).join(" ");
    out += "\n";
    for function in &robot.functions {
        out += &format!("{}\n", name_hash(&function.name));
    }
    for (name, region) in robot.layout.iter().flat_map(Layout::regions) {
        out += &format!("{name} {} {}\n", region.address, region.size);
    }
    for (place, setting) in robot.settings.iter().enumerate() {
        out += &format!("{} {place}\n", setting.name.to_uppercase());
    }
    out
}

fn compile_and_run(robot: &Robot, folder: &Path) -> io::Result<String> {
    fs::create_dir_all(folder)?;
    fs::write(folder.join("robot.rs"), generate_rust(robot))?;
    fs::write(folder.join("main.rs"), [PRINT, &print_layout(robot)].concat())?;
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned());
    let binary = folder.join("main");
    let compiled = Command::new(rustc)
        .args(["--edition", "2024", "-o"])
        .arg(&binary)
        .arg(folder.join("main.rs"))
        .output()?;
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let run = Command::new(binary).output()?;
    Ok(String::from_utf8_lossy(&run.stdout).into_owned())
}

#[test]
fn generated_source_compiles_to_the_values_of_the_robot_file() {
    // A robot that only a description defines has no firmware.
    for robot in all_shipped().into_iter().filter(|robot| robot.body.is_none()) {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(&robot.name);
        for on_fault in [OnFault::Restart, OnFault::Stop] {
            let robot = Robot { on_fault, ..robot.clone() };
            assert_eq!(compile_and_run(&robot, &folder).unwrap(), expected(&robot));
        }
    }
}
