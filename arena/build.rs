//! Generates the machines of the robots that ship: types as large as their files say.
//!
//! `src/robot/machine/shipped.rs` includes the list.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;
use std::{env, fs, io};

use bittybuzz_robot_spec::NumberProfile;

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=build.rs");
    let mut sizes = BTreeSet::new();
    // A robot with the memory of a computer takes it only as far as its script uses it. A machine as
    // large as its file says would take all.
    let robots = bittybuzz_robot_files::all_shipped().into_iter();
    for robot in robots.filter(|robot| robot.body.is_none()) {
        let vm = &robot.vm;
        let slots = vm.slots as usize + robot.sizes().slots();
        // If the number of slots is a power of two, the machine needs no checks to access one.
        let rounded = slots.next_power_of_two();
        let places = if 7 * rounded <= 8 * slots { rounded } else { slots };
        let mut profiles = vec!["Tiny"];
        // A robot with room for long frames can also run the small profile.
        if robot.profile == NumberProfile::Full {
            profiles.push("Full");
        }
        for profile in profiles {
            let queues = [vm.in_queue, vm.out_queue, vm.in_long, vm.out_long];
            sizes.insert((slots, places, profile, queues));
        }
    }
    let (_, smallest, ..) = sizes.first().expect("robots ship");
    let mut text = format!(
        "/// Slots of the smallest machine of a robot that ships.\n\
         #[cfg(test)]\npub const SMALLEST_SLOTS: usize = {smallest};\n\n\
         /// Loads the machine of a robot that ships, if one has this number of slots and the queues of the group.\n\
         pub fn load(\n    context: &GroupContext,\n    slots: usize,\n    id: u16,\n    seed: u32,\n\
         ) -> Option<Loaded> {{\n    Some(match (context.profile, slots, context.queues) {{\n"
    );
    for &(slots, places, profile, [inbox, outbox, in_long, out_long]) in &sizes {
        let frame = format!("{}_FRAME", profile.to_uppercase());
        writeln!(
            text,
            "        (NumberProfile::{profile}, {slots}, [{inbox}, {outbox}, {in_long}, {out_long}]) => \
             load_exact::<{profile}, {{ {frame} }}, {places}, {inbox}, {outbox}, {in_long}, {out_long}>(context, id, seed),"
        )
        .expect("a text takes any line");
    }
    text += "        _ => return None,\n    })\n}\n";
    let out = env::var_os("OUT_DIR").ok_or_else(|| io::Error::other("cargo sets OUT_DIR"))?;
    fs::write(Path::new(&out).join("machines.rs"), text)
}
