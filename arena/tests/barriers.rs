//! Barriers, roll calls and shared lists: the number of a stigmergy costs no time.

use std::fmt::Write as _;

use crate::script::{folder, run};

/// Robots on a circle on which all hear each other, as many as the store of each has entries for.
struct Circle {
    robot: &'static str,
    count: usize,
    radius: u16,
}

const CIRCLES: [Circle; 3] = [
    Circle { robot: "kilobot", count: 4, radius: 45 },
    Circle { robot: "zooids", count: 12, radius: 600 },
    Circle { robot: "crazyflie", count: 12, radius: 600 },
];

/// Scripts that end when each robot has the entries of all robots. `wall` is their stigmergy.
const TASKS: [(&str, &str); 3] = [
    // Each robot puts its number and waits for all.
    (
        "barrier",
        "function step() {
           t = t + 1
           if(t == START) wall.put(id, 1)
           if(passed == 0 and t > START and wall.size() >= COUNT) passed = t - START
         }",
    ),
    // Robot 0 calls, and the others answer when they hear it.
    (
        "roll call",
        "answered = 0
         function step() {
           t = t + 1
           if(t == START and id == 0) wall.put(0, 1)
           if(answered == 0 and id != 0 and t > START and wall.size() > 0) { answered = 1 wall.put(id, 1) }
           if(passed == 0 and t > START and wall.size() >= COUNT) passed = t - START
         }",
    ),
    // Robots put their values in turn, in a list in which each takes the next place.
    (
        "shared list",
        "function step() {
           t = t + 1
           if(t > START and wall.size() == id and put == 0) { put = 1 wall.put(id, 1) }
           if(passed == 0 and t > START and wall.size() >= COUNT) passed = t - START
         }",
    ),
];

/// The mean over the seeds of the steps until the last robot has all entries. `others` are the stigmergies that the script
/// creates before.
fn steps(circle: &Circle, task: &str, others: &[u16], number: u16, seeds: u32) -> f64 {
    let Circle { robot, count, radius, .. } = circle;
    let others: String = others.iter().map(|other| format!("stigmergy.create({other}) ")).collect();
    let script = format!(
        "t = 0 put = 0 passed = 0 {others} wall = stigmergy.create({number})\n{}",
        task.replace("START", "20").replace("COUNT", &count.to_string())
    );
    let folder = folder(&format!("barriers-{robot}"), &[("s.bzz", &script)]);
    let mut sum = 0.0;
    for seed in 1..=seeds {
        let summary = run(
            &folder,
            &format!(
                "[world]\nsize = [4000, 4000]\nduration = 300\nseed = {seed}\n\
                 [[robots]]\nrobot = \"{robot}\"\nscript = \"s.bzz\"\ncount = {count}\n\
                 placement = \"circle\"\nradius = {radius}\n\
                 [[expect]]\nwithin = 300\nvalue = \"global.passed\"\nabove = 0\n\
                 [output]\nplot = [\"global.passed\"]\n"
            ),
        );
        let [_, first, last] = summary.values[0].expect("the script has the global");
        assert!(first > 0.0, "{robot}, seed {seed}: a robot never passes:\n{script}");
        sum += last;
    }
    sum / f64::from(seeds)
}

/// A number among the first three stigmergies takes at most 1.1 times the steps of number 0.
fn check(seeds: u32, numbers: &[u16]) {
    let mut slow = String::new();
    for circle in &CIRCLES {
        for (name, task) in TASKS {
            let zero = steps(circle, task, &[], 0, seeds);
            for number in numbers {
                for others in [&[][..], &[301], &[301, 302]] {
                    let steps = steps(circle, task, others, *number, seeds);
                    if steps > 1.1 * zero {
                        let robot = circle.robot;
                        let place = others.len() + 1;
                        writeln!(
                            slow,
                            "{robot} {name}: number {number} in place {place} takes {steps:.1} \
                             steps, number 0 {zero:.1}"
                        )
                        .unwrap();
                    }
                }
            }
        }
    }
    assert_eq!(slow, "");
}

#[test]
fn the_number_of_a_stigmergy_costs_no_time() {
    check(5, &[101]);
}

#[test]
#[ignore = "takes minutes"]
fn no_number_of_a_stigmergy_costs_time() {
    check(20, &[1, 2, 3, 5, 20, 101, 200, 65_535]);
}
