//! A world in which everything goes on that a run consists of, and all that can be seen of it.

use std::path::Path;
use std::sync::Arc;

use bittybuzz_arena::robot::LogLine;
use bittybuzz_arena::run::{Setup, Simulation};

use super::script::{folder, program, read};

/// Everything that a script can have going on: messages, shared memory, swarms, chance, tables, pauses, a fault and a restart.
const SCRIPT: &str = "n = 0 heard = 0 far = {} vs = stigmergy.create(1) s = swarm.create(1)\n\
    function init() {\n\
      neighbors.listen(\"n\", function(topic, value, robot) { heard = heard + 1 far[robot % 8] = value })\n\
      s.select(id % 2 == 0)\n\
    }\n\
    function step() {\n\
      n = n + 1\n\
      led(n % 8)\n\
      neighbors.broadcast(\"n\", math.rng.uniform(100))\n\
      vs.put(n % 3, n)\n\
      s.exec(function() { heard = heard + size(far) })\n\
      if(n == 20 + id) log(\"step \", n, \" heard \", heard)\n\
      if(id == 3 and n == 40) n = nothing + 1\n\
      MOVE\n\
    }\n";

const WORLD: &str = "[world]\nsize = [1000, 1000]\nduration = 12\nseed = 5\nlights = [[100, 100]]\n\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"kilobot.bzz\"\ncount = 9\nplacement = \"grid\"\nspacing = 60\n\n\
    [[robots]]\nrobot = \"zooids\"\nscript = \"zooids.bzz\"\ncount = 4\nfirst_id = 20\narea = [400, 400]\nat = [250, -250]\n\n\
    [[robots]]\nrobot = \"crazyflie\"\nscript = \"crazyflie.bzz\"\ncount = 3\nfirst_id = 30\nplacement = \"line\"\nat = [-200, 350]\nspacing = 250\n\n\
    [body.kilobot]\nheading_bias = 20\n\n[body.crazyflie]\narmed = true\n\n\
    [[event]]\nat = 2\nfail = 1\n\n[[event]]\nat = 3\nlight = [[0, 0]]\n\n[[event]]\nat = 4\nblock = [20, 21]\n\n\
    [[event]]\nat = 5\nrestart = [1, 22]\n\n[[event]]\nat = 6\npartition = [[0, 2], [4, 5]]\n\n[[event]]\nat = 8\nheal = true\n\n\
    [[event]]\nat = 9\nmove = 30\nby = [10, 10]\n";

/// The robots' motion in this test.
const MOVES: [(&str, &str); 3] = [
    ("kilobot.bzz", "if(n % 20 < 10) left() else right()"),
    ("zooids.bzz", "goto(n, 0 - n)"),
    ("crazyflie.bzz", "if(n == 1) takeoff(500, 500) else goto(n * 2, 0)"),
];

/// Scripts that commands may load, for robots of each kind.
const OTHERS: [(&str, &str); 2] = [
    ("quiet.bzz", "function step() { if(rand() % 50 == 0) log(\"quiet \", id) }\n"),
    (
        "loud.bzz",
        "n = 100 function step() { n = n + 1 neighbors.broadcast(\"n\", n) led(n % 3) }\n",
    ),
];

/// The setup of that world, with more at the end of its scenario.
pub fn setup(name: &str, more: &str) -> Arc<Setup> {
    let scripts = MOVES.map(|(name, moves)| (name, SCRIPT.replace("MOVE", moves)));
    let scripts = scripts.each_ref().map(|(name, text)| (*name, text.as_str()));
    let folder = folder(name, &[&scripts[..], &OTHERS].concat());
    let (scenario, programs) = read(Path::new(&folder), &[WORLD, more].concat());
    let setup = Setup::new(scenario, programs).unwrap();
    Arc::new(setup.with_compiler(Arc::new(program)))
}

/// All that a tick leaves to be seen.
pub type Seen = (u64, Vec<(usize, LogLine)>);

/// Runs to the end.
pub fn rest(simulation: &mut Simulation) -> Vec<Seen> {
    let mut seen = Vec::new();
    while !simulation.is_over() {
        simulation.tick().unwrap();
        seen.push((simulation.digest(), simulation.take_log()));
    }
    seen
}
