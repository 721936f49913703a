//! Tests of the facts that all shipped robot files must fulfill, and of `find`.

use bittybuzz_robot_files::{all_shipped, find, shipped};
use bittybuzz_robot_spec::{Robot, takes_count};
use bittybuzz_vm_core::message::{FULL_FRAME, TINY_FRAME};

/// Uses the memory of the Kilobot's file from before there were places for several long messages.
#[test]
fn a_file_of_an_earlier_version_gets_the_required_memory_as_help() {
    let now = shipped().iter().find(|file| file.name == "kilobot").unwrap().text;
    assert!(now.contains("memory = 1765"));
    let error =
        Robot::parse(&now.replace("memory = 1765", "memory = 1676"), "old.toml").unwrap_err();
    let text = error.to_string();
    assert!(text.contains("339 slots of 3 bytes do not fit in 1676 bytes"), "{text}");
    assert!(text.contains("set `memory` to 1765 or more: earlier versions needed less"), "{text}");
}

#[test]
fn shipped_robots_are_named_as_their_files() {
    for (file, robot) in shipped().iter().zip(all_shipped()) {
        assert_eq!(file.name, robot.name);
    }
}

#[test]
fn robots_with_a_chip_have_a_budget() {
    for robot in all_shipped() {
        assert_eq!(robot.chip.is_some(), robot.budget.is_some(), "{}", robot.name);
    }
}

#[test]
fn machines_fit_in_ram() {
    for robot in all_shipped() {
        if let Some(budget) = robot.budget {
            assert!(robot.vm.memory < budget.ram_bytes, "{}", robot.name);
            if let Some(layout) = robot.layout {
                assert!(budget.flash_bytes <= layout.application.size, "{}", robot.name);
                assert!(budget.ram_bytes <= layout.ram.size, "{}", robot.name);
            }
        }
    }
}

/// Returns the robots of this project. Those that only a description defines are robots of other
/// hosts.
fn own_robots() -> Vec<Robot> {
    all_shipped().into_iter().filter(|robot| robot.body.is_none()).collect()
}

/// A function that several robots have waits and returns in the same way on each, so that one
/// script works on all of them. Robots of other hosts keep the functions of their hosts.
#[test]
fn shared_functions_agree() {
    let robots = own_robots();
    for robot in &robots {
        for function in &robot.functions {
            for other in robots.iter().filter_map(|other| other.function(&function.name)) {
                assert_eq!(other.waits, function.waits, "{}: {}", robot.name, function.name);
                assert_eq!(other.returns, function.returns, "{}: {}", robot.name, function.name);
            }
        }
    }
}

/// The functions that the behaviors shipped with the C BittyBuzz call on each robot, with the
/// number of arguments; `delay`, `rand`, `math.min` and `print` are built-ins here.
#[test]
fn robots_have_the_functions_of_the_reference_behaviors() {
    let calls: [(&str, &[(&str, usize)]); 3] = [
        ("kilobot", &[("led", 1), ("forward", 0), ("left", 0), ("right", 0), ("set_motor", 2)]),
        (
            "zooids",
            &[
                ("led", 1),
                ("forward", 0),
                ("left", 0),
                ("right", 0),
                ("set_motor", 2),
                ("goto", 2),
                ("greyCode", 1),
            ],
        ),
        (
            "crazyflie",
            &[
                ("led", 1),
                ("led", 2),
                ("set_motor", 2),
                ("takeoff", 1),
                ("takeoff", 2),
                ("land", 0),
                ("land", 2),
                ("hover", 1),
                ("spin", 2),
                ("goTo", 3),
                ("show", 1),
                ("start", 0),
                ("go", 0),
                ("move_toward", 2),
                ("get_up", 0),
                ("get_left", 0),
                ("get_right", 0),
                ("get_front", 0),
                ("get_back", 0),
                ("get_z", 0),
                ("rand_bbz", 0),
                ("forward", 0),
                ("left", 0),
                ("right", 0),
            ],
        ),
    ];
    for (robot, functions) in calls {
        let robot = find(robot).unwrap();
        for (name, count) in functions {
            let function = robot.function(name).unwrap_or_else(|| panic!("{name}"));
            let mut lists = function.accepts.iter();
            assert!(lists.any(|list| takes_count(list, *count)), "{}: {name}", robot.name);
        }
    }
    let zooids = find("zooids").unwrap();
    let fields = &zooids.table("pos").unwrap().fields;
    let has = |name: &str| fields.iter().any(|field| field.name == name);
    assert!(has("x") && has("y") && has("orientation"));
}

#[test]
fn find_by_name_and_by_path() {
    assert_eq!(find("kilobot").unwrap().chip.as_deref(), Some("ATmega328P"));
    assert_eq!(
        find("killobot").unwrap_err().to_string(),
        "no robot is named `killobot`\n\
         help: did you mean `kilobot`? (a file of your own: a path that ends in .toml)"
    );
    assert!(find("spot").unwrap_err().to_string().contains("kilobot, zooids, crazyflie, footbot"));
    assert!(find("").is_err());
    let here = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/zooids/robot.toml");
    assert_eq!(find(here).unwrap(), find("zooids").unwrap());
    let missing = find("no/such/robot.toml").unwrap_err();
    assert!(missing.to_string().starts_with("cannot read `no/such/robot.toml`: "), "{missing}");
}

/// Scripts get all remaining memory, and the bench robot has the same figures as the Kilobot.
#[test]
fn shipped_robots_leave_no_memory_unused() {
    for robot in own_robots() {
        let most = robot.most_slots();
        assert_eq!(robot.vm.slots, most, "{}", robot.name);
    }
    let [kilobot, bench] = ["kilobot", "bench"].map(|name| find(name).unwrap());
    assert_eq!((kilobot.vm, kilobot.message_bytes), (bench.vm, bench.message_bytes));
}

/// The declared memory is the sum of the queues' sizes.
#[test]
fn queues_are_counted() {
    use bittybuzz_comms::queue::{Inbox, Outbox};
    use bittybuzz_vm_core::{Sighting, number};

    type TinyIn<E, const FRAMES: usize, const LONG: usize> =
        Inbox<number::Tiny, E, TINY_FRAME, FRAMES, LONG>;
    type TinyOut<const FRAMES: usize, const LONG: usize> =
        Outbox<number::Tiny, TINY_FRAME, FRAMES, LONG>;
    type FullIn = Inbox<number::Full, Sighting<number::Full>, FULL_FRAME, 32, 16>;
    type FullOut = Outbox<number::Full, FULL_FRAME, 10, 8>;
    /// Padding on this computer that an AVR does not have: the 16 frames and the queues are aligned
    /// to 4 bytes here.
    const UNALIGNED: usize = 16 + 8;
    /// Additional memory on Cortex-M: each queue has a guard count, a word has the unwanted topics, and
    /// three words wake a task.
    const GUARDS: usize = 2 * 4 + 4 + 12;
    let kilobot = size_of::<TinyIn<u8, 8, 2>>() + size_of::<TinyOut<8, 1>>() - UNALIGNED;
    let zooid =
        size_of::<TinyIn<Sighting<number::Tiny>, 15, 6>>() + size_of::<TinyOut<15, 4>>() + GUARDS;
    let crazyflie = size_of::<FullIn>() + size_of::<FullOut>() + GUARDS;
    for (name, queues, needed) in [
        ("kilobot", (8, 8), kilobot),
        // The lengths are equal, because the code of a queue exists once per length.
        ("zooids", (15, 15), zooid),
        ("crazyflie", (32, 10), crazyflie),
    ] {
        let robot = find(name).unwrap();
        assert_eq!((robot.vm.in_queue, robot.vm.out_queue), queues, "{name}");
        let counted = robot.queue_memory() as usize;
        assert!((needed..needed + 8).contains(&counted), "{name}: {counted}, not {needed}");
    }
}
