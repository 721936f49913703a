//! The script's region of a Zooid's flash: a Zooid has no verifier, so it runs only images that are sealed for it.

use bittybuzz_compiler::fit;
use bittybuzz_hil::table::{layout, robot};
use bittybuzz_hil::{Place, Table, image_for, image_of, is_lit, resets};
use bittybuzz_robot_spec::Robot;
use bittybuzz_vm_core::seal;

const SCRIPT: &str = "function step() { log(1)  set_motor(40, 40) }";

/// A Zooid that drives, switched on with this content of the script's region.
fn with_section(section: &[u8]) -> Table {
    let mut table = Table::new(SCRIPT, &[7]);
    table.put(0, Place::at(0.0, 0.0, 0.0));
    table.write(0, layout().script.address, section);
    table.run_ms(500);
    table
}

/// A Zooid with this image, whose section is sound.
fn with_image(image: &[u8]) -> Table {
    with_section(&layout().script_section(image).expect("a short script"))
}

/// The script does not run, the LED says so, and the firmware goes on.
fn assert_refused(table: &Table, name: &str) {
    let zooid = &table.zooids()[0];
    assert_eq!(zooid.trace_log.records, ["Refused(Seal)"], "{name}");
    assert!(zooid.trace_log.log.is_empty(), "{name}: {:?}", zooid.trace_log.log);
    assert!(is_lit(&zooid.events, "red"), "{name}");
    assert_eq!(zooid.motors(), [0.0; 2], "{name}");
    assert_eq!(resets(&zooid.events), [], "{name}");
}

fn assert_runs(table: &Table, name: &str) {
    let zooid = &table.zooids()[0];
    assert!(zooid.trace_log.log.len() >= 4, "{name}: {:?}", zooid.trace_log.records);
    assert!(zooid.motors()[0] > 0.3, "{name}");
}

#[test]
fn an_image_without_its_seal_is_refused() {
    let image = image_for("zooids", SCRIPT);
    let sealed = fit::sealed(&image, &robot()).unwrap();
    assert_runs(&with_image(&sealed), "sealed");
    assert_refused(&with_image(&image), "no seal");
    assert_refused(&with_image(&sealed[..sealed.len() - 1]), "a byte less");
    assert_refused(&with_image(&[&sealed[..], &[0]].concat()), "a byte more");
}

/// The section's own checksum is right, so only the seal can tell.
#[test]
fn an_altered_image_is_refused() {
    let sealed = fit::sealed(&image_for("zooids", SCRIPT), &robot()).unwrap();
    let image = sealed.len() - seal::LENGTH;
    for at in [0, 1, image / 2, image - 1, image, image + 7, sealed.len() - 1] {
        let mut altered = sealed.clone();
        altered[at] ^= 0x10;
        assert_refused(&with_image(&altered), &format!("byte {at}"));
    }
}

/// The firmware was built for another robot file than the image.
#[test]
fn an_image_for_another_robot_is_refused() {
    let image = image_for("zooids", SCRIPT);
    let changed = |change: &dyn Fn(&mut Robot)| {
        let mut robot = robot();
        change(&mut robot);
        fit::sealed(&image, &robot).expect("a sound image")
    };
    let kilobot = bittybuzz_robot_files::find("kilobot").expect("a shipped robot");
    for (name, image) in [
        ("less memory", changed(&|robot| robot.vm.slots -= 1)),
        ("fewer neighbors", changed(&|robot| robot.vm.neighbors = 0)),
        ("one function less", changed(&|robot| drop(robot.functions.pop()))),
        ("functions in another order", changed(&|robot| robot.functions.reverse())),
        ("no math", changed(&|robot| robot.vm.maths = false)),
        ("a Kilobot", fit::sealed(&image_for("kilobot", SCRIPT), &kilobot).unwrap()),
    ] {
        assert_refused(&with_image(&image), name);
    }
}

#[test]
fn a_section_without_a_script_is_safe() {
    let sealed = fit::sealed(&image_for("zooids", SCRIPT), &robot()).unwrap();
    let whole = layout().script_section(&sealed).unwrap();
    let size = layout().script.size as usize;
    for (name, section) in [
        ("erased", vec![0xff; size]),
        ("empty", vec![0; size]),
        ("longer than its place", [&0xffff_u16.to_le_bytes()[..], &whole[2..]].concat()),
        ("cut off", [&10_u16.to_le_bytes()[..], &whole[2..]].concat()),
        ("without a checksum", [&whole[..2], &[0xff; 2], &whole[4..]].concat()),
        ("noise", whole.iter().map(|byte| byte.wrapping_mul(167) ^ 0x5a).collect()),
    ] {
        assert_refused(&with_section(&section), name);
    }
}

#[test]
fn the_longest_image_that_tools_accept_runs() {
    let most = layout().most_script() as usize;
    let image = image_of("zooids", SCRIPT, most);
    let sealed = fit::sealed(&image, &robot()).unwrap();
    assert_runs(&with_image(&sealed), "the longest");
    assert_eq!(layout().script_section(&[&sealed[..], &[0]].concat()), None);
}
