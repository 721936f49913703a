//! All handlers that choose between three values, with and without merged ones: whatever they choose, also in circles or
//! otherwise on each robot, three robots agree, and are quiet then.

use bittybuzz_testkit::Swarm;
use bittybuzz_vm_core::number::Tiny;

/// Pairs of different values, as a handler sees them: `local`, `remote`.
const PAIRS: [[usize; 2]; 6] = [[0, 1], [0, 2], [1, 0], [1, 2], [2, 0], [2, 1]];

/// What a handler may return for each of them.
const CHOICES: [&str; 3] = ["l", "r", "{ .robot = id, .data = l.data + r.data }"];

/// Steps after which the robots agree, and in which they are quiet then.
const SETTLE: usize = 500;
const QUIET: usize = 100;

/// Asserts that robots which put 0, 1 and 2 at one clock agree.
fn agrees(handler: &str, is_row: bool) {
    let script = format!(
        "function init() {{
           s = stigmergy.create(1)
           s.onconflict(function(k, l, r) {{ {handler} return r }})
           s.put(0, id - 1)
         }}
         function step() {{ log(s.get(0)) }}"
    );
    let mut swarm: Swarm<Tiny> = Swarm::new(3, &script);
    if is_row {
        swarm.air.reaches = Box::new(|from, to| from.abs_diff(to) == 1);
    }
    for _ in 0..SETTLE {
        swarm.try_step();
    }
    let sent: usize = (0..QUIET).map(|_| swarm.try_step()).sum();
    let known = swarm.last();
    let what = format!("{handler}, in a row: {is_row}");
    assert!(known.iter().all(|value| *value == known[0]), "{what}: {known:?}");
    // Each robot sends a beacon in nine or ten steps.
    assert!(sent <= 3 * QUIET.div_ceil(9), "{what}: {sent} frames");
}

#[test]
fn all_choices_between_three_values_end() {
    let mut handlers = 0;
    for number in 0..CHOICES.len().pow(PAIRS.len() as u32) {
        let mut rest = number;
        let handler: String = PAIRS
            .map(|[local, remote]| {
                let choice = CHOICES[rest % CHOICES.len()];
                rest /= CHOICES.len();
                format!("if(l.data == {local} and r.data == {remote}) return {choice}\n")
            })
            .concat();
        agrees(&handler, false);
        agrees(&handler, true);
        handlers += 1;
    }
    assert_eq!(handlers, 729);
}
