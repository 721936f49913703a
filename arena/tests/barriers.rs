//! Barriers, roll calls and shared lists: neither the number of a stigmergy nor a lost frame costs much time, and values of k
//! frames cost at most k + 2 times the time of single frames.

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
           if(t == START) wall.put(id, VALUE)
           if(passed == 0 and t > START and wall.size() >= COUNT) passed = t - START
         }",
    ),
    // Robot 0 calls, and the others answer when they hear it.
    (
        "roll call",
        "answered = 0
         function step() {
           t = t + 1
           if(t == START and id == 0) wall.put(0, VALUE)
           if(answered == 0 and id != 0 and t > START and wall.size() > 0) { answered = 1 wall.put(id, VALUE) }
           if(passed == 0 and t > START and wall.size() >= COUNT) passed = t - START
         }",
    ),
    // Robots put their values in turn, in a list in which each takes the next place.
    (
        "shared list",
        "function step() {
           t = t + 1
           if(t > START and wall.size() == id and put == 0) { put = 1 wall.put(id, VALUE) }
           if(passed == 0 and t > START and wall.size() >= COUNT) passed = t - START
         }",
    ),
];

/// The mean over the seeds of the steps until the last robot has all entries. `others` are the stigmergies that the script
/// creates before.
fn steps(circle: &Circle, task: &str, others: &[u16], number: u16, seeds: u32) -> f64 {
    let steps = all_steps(circle, task, others, number, seeds);
    steps.iter().sum::<f64>() / f64::from(seeds)
}

/// The steps until the last robot has all entries, for each seed, in ascending order. `START` of the task is step 20, and `VALUE`
/// is 1.
fn all_steps(circle: &Circle, task: &str, others: &[u16], number: u16, seeds: u32) -> Vec<f64> {
    let Circle { robot, count, radius, .. } = circle;
    let others: String = others.iter().map(|other| format!("stigmergy.create({other}) ")).collect();
    let script = format!(
        "function answer(a) {{ return a }}\nt = 0 put = 0 passed = 0 {others} wall = stigmergy.create({number})\n{}",
        task.replace("START", "20").replace("COUNT", &count.to_string()).replace("VALUE", "1")
    );
    let folder = folder(&format!("barriers-{robot}"), &[("s.bzz", &script)]);
    // With the standard loss more than half of the barriers of single frames lose none.
    let link = if *robot == "kilobot" { "link = { loss = 0.1 }\n" } else { "" };
    let mut all = Vec::new();
    for seed in 1..=seeds {
        let summary = run(
            &folder,
            &format!(
                "[world]\nsize = [4000, 4000]\nduration = 60\nseed = {seed}\n\
                 [[robots]]\nrobot = \"{robot}\"\nscript = \"s.bzz\"\ncount = {count}\n\
                 placement = \"circle\"\nradius = {radius}\n{link}\
                 [[expect]]\nwithin = 60\nvalue = \"global.passed\"\nabove = 0\n\
                 [output]\nplot = [\"global.passed\"]\n"
            ),
        );
        let [_, first, last] = summary.values[0].expect("the script has the global");
        assert!(first > 0.0, "{robot}, seed {seed}: a robot never passes:\n{script}");
        all.push(last);
    }
    all.sort_by(f64::total_cmp);
    all
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

/// A put whose frame is lost everywhere is sent again within three steps, and on a Kilobot with its next frame, half a second later:
/// three losses in a row take 10 and 20 steps. All Kilobots together need 4 frames of each, or 20 steps. More losses in a row are
/// rare: 95 of 100 seeds take no longer.
#[test]
fn a_lost_frame_does_not_delay_a_barrier() {
    for (circle, most) in CIRCLES.iter().zip([40.0, 10.0, 10.0]) {
        let (_, barrier) = TASKS[0];
        let steps = all_steps(circle, barrier, &[], 0, 100);
        assert!(steps[94] <= most, "{}: {steps:?}", circle.robot);
    }
}

/// Values, each with the frames of its entry. In `tiny` the content of an entry has 12 bytes before the key, of 3 bytes, and a
/// fragment 6 bytes: a function takes 3 bytes, a table 2 and 6 for each pair. In `full` the key takes 5 bytes, a table 2 and 10 for
/// each pair, and a fragment has 45 bytes.
const TINY: [(u32, &str); 3] = [(3, "answer"), (4, "{ .x = 1 }"), (5, "{ .x = 1, .y = 2 }")];
const FULL: [(u32, &str); 3] = [
    (2, "{ .a = 1, .b = 1, .c = 1 }"),
    (3, "{ .a = 1, .b = 1, .c = 1, .d = 1, .e = 1, .f = 1, .g = 1, .h = 1 }"),
    (
        4,
        "{ .a = 1, .b = 1, .c = 1, .d = 1, .e = 1, .f = 1, .g = 1, .h = 1, .i = 1, .j = 1, .k = 1, .l = 1 }",
    ),
];

/// Values of k frames take at most k + 2 times the steps of single frames, medians over the seeds.
fn check_frames(seeds: u32) {
    let median = |circle: &Circle, task: &str| {
        let steps = all_steps(circle, task, &[], 0, seeds);
        steps[steps.len() / 2]
    };
    let mut slow = String::new();
    for circle in &CIRCLES {
        let values = if circle.robot == "crazyflie" { FULL } else { TINY };
        for (name, task) in TASKS {
            for start in ["1", "20"] {
                let task = task.replace("START", start);
                let single = median(circle, &task);
                for (frames, value) in values {
                    let steps = median(circle, &task.replace("VALUE", value));
                    let of = format!(
                        "{} {name} from step {start}: {frames} frames {steps} steps, one frame {single}",
                        circle.robot
                    );
                    if steps > f64::from(frames + 2) * single {
                        writeln!(slow, "{of}").unwrap();
                    }
                }
            }
        }
    }
    assert_eq!(slow, "");
}

#[test]
fn values_of_k_frames_take_at_most_k_plus_2_times_the_steps_of_single_frames() {
    check_frames(21);
}

/// A long entry crosses a hop in two or three steps: robots that receive it do not all send it at once.
#[test]
fn long_entries_cross_a_line_of_robots() {
    let script = "t = 0 got = 0 wall = stigmergy.create(0)
         function step() {
           t = t + 1
           if(t == 20 and id == 0) wall.put(1, { .x = 1, .y = 2 })
           if(got == 0 and t > 20 and wall.size() > 0) got = t - 20
         }";
    let folder = folder("line-of-zooids", &[("s.bzz", script)]);
    for seed in 1..=10 {
        run(
            &folder,
            &format!(
                "[world]\nsize = [9000, 4000]\nduration = 10\nseed = {seed}\n\
                 [[robots]]\nrobot = \"zooids\"\nscript = \"s.bzz\"\ncount = 8\nplacement = \"line\"\nspacing = 300\n\
                 link = {{ range = 400 }}\n\
                 [[expect]]\nat = 10\nvalue = \"global.got\"\nabove = 0\n\
                 [[expect]]\nat = 10\nvalue = \"global.got\"\nbelow = 22\n"
            ),
        );
    }
}
