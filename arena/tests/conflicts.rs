//! Handlers of conflicts: whatever a script's handler chooses, the robots agree, and the air stays free.

use bittybuzz_arena::engine::Medium;

use crate::script::{folder, run};

/// Kinds of 25 robots, and the distance between two of them in mm.
const KINDS: [(&str, u32); 3] = [("kilobot", 50), ("zooids", 60), ("crazyflie", 500)];

/// Handlers, each with the value on which 25 robots that put their ids agree; `None` if it depends on the order of messages.
const HANDLERS: [(&str, Option<f64>); 6] = [
    ("return l", None),
    ("return r", None),
    ("return 5", None),
    ("return { .robot = r.robot, .data = l.data + r.data }", None),
    ("if(l.data > r.data) return l return r", Some(24.0)),
    ("if(l.data < r.data) return l return r", Some(0.0)),
];

/// Handlers that choose otherwise on each robot, or in circles, which only the limit of choices ends.
const ENDLESS: [&str; 2] =
    ["if(l.robot == id) return l return r", "if((l.data + 1) % 3 == r.data % 3) return l return r"];

/// The frames that 25 robots send in two minutes, and the least and the greatest value that they know after so many seconds.
fn outcome(robot: &str, spacing: u32, handler: &str, seed: u32, seconds: u32) -> (u64, [f64; 2]) {
    let script = format!(
        "s = stigmergy.create(1)
         v = 0
         {handler}
         function init() {{ s.put(\"k\", id) }}
         function step() {{ v = s.get(\"k\") }}"
    );
    let folder = folder("conflicts", &[("s.bzz", &script)]);
    let scenario = |seconds| {
        format!(
            "[world]\nsize = [4000, 4000]\nduration = {seconds}\nseed = {seed}\n\
             [[robots]]\nrobot = \"{robot}\"\nscript = \"s.bzz\"\ncount = 25\n\
             placement = \"grid\"\nspacing = {spacing}\n\
             [output]\nplot = [\"global.v\"]\n"
        )
    };
    let [_, least, greatest] =
        run(&folder, &scenario(seconds)).values[0].expect("the script has the global");
    let all = run(&folder, &scenario(120)).statistics;
    let media = [Medium::Infrared, Medium::Nrf24, Medium::P2p];
    (media.iter().map(|medium| all.link(*medium).sent).sum(), [least, greatest])
}

#[test]
fn robots_agree_within_ten_seconds_whatever_a_handler_chooses() {
    for (robot, spacing) in KINDS {
        for seed in [1, 2] {
            let (by_default, values) = outcome(robot, spacing, "", seed, 10);
            assert_eq!(values, [24.0; 2], "{robot}");
            for (choice, agreed) in HANDLERS {
                let handler = format!("s.onconflict(function(k, l, r) {{ {choice} }})");
                let (frames, [least, greatest]) = outcome(robot, spacing, &handler, seed, 10);
                let what =
                    format!("{robot}, seed {seed}, {choice}: {frames} frames of {by_default}");
                assert_eq!(least, greatest, "{what}");
                assert!(agreed.is_none_or(|agreed| agreed == least), "{what}: {least}");
                assert!(2 * frames <= 3 * by_default, "{what}");
            }
        }
    }
}

#[test]
fn choices_in_circles_end() {
    for (robot, spacing) in KINDS {
        let (by_default, _) = outcome(robot, spacing, "", 1, 1);
        for choice in ENDLESS {
            let handler = format!("s.onconflict(function(k, l, r) {{ {choice} }})");
            let (frames, [least, greatest]) = outcome(robot, spacing, &handler, 1, 119);
            assert_eq!(least, greatest, "{robot}: {choice}");
            assert!(frames <= 3 * by_default, "{robot}: {choice}: {frames} frames of {by_default}");
        }
    }
}
