//! A digest stands for everything that decides how a run goes on.

use std::sync::Arc;

use crate::script::{folder, read};
use bittybuzz_arena::run::{Setup, Simulation};

/// Two Kilobots apart from each other. At 1 s the lamp flashes for a tick, after which the world is as it was.
const FLASH: &str = "[world]\nsize = [1000, 1000]\nduration = 4\nlights = [{ at = [0, 0], brightness = 300 }]\n\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"script.bzz\"\npositions = [[-300, 0], [300, 0]]\nheading = 0\ncount = 2\n\n\
    [[event]]\nat = 1\nlight = { at = [0, 0], brightness = BRIGHTNESS }\n\n\
    [[event]]\nat = 1.1\nlight = { at = [0, 0], brightness = 300 }\n";

/// Scripts by which robot 0 alone notes the flash, each in another part of its machine.
const SCRIPTS: [(&str, &str); 5] = [
    ("global", "n = 0\nfunction step() { if(id == 0 and light() > 200) n = 1 }\n"),
    ("heap", "t = {.n = 0}\nfunction step() { if(id == 0 and light() > 200) t.n = 1 }\n"),
    ("chance", "function step() { if(id == 0 and light() > 200) math.rng.uniform(2) }\n"),
    // It waits with the reading in a local variable until the run is over.
    (
        "stack",
        "n = 0\nfunction step() {\nn = n + 1\nif(id == 0 and n == 10) {\nvar seen = light()\ndelay(20000)\nn = seen\n}\n}\n",
    ),
    // Nobody is near enough to hear it.
    (
        "stigmergy",
        "vs = stigmergy.create(1)\nfunction init() { vs.put(1, 5) }\nfunction step() { if(id == 0 and light() > 200) vs.put(1, 6) }\n",
    ),
];

/// Returns a run after a flash of that brightness.
fn run(name: &str, script: &str, brightness: u32) -> Simulation {
    let folder = folder(&format!("digest-{name}"), &[("script.bzz", script)]);
    let text = FLASH.replace("BRIGHTNESS", &brightness.to_string());
    let (scenario, programs) = read(&folder, &text);
    let setup = Arc::new(Setup::new(scenario, programs).unwrap());
    let mut run = Simulation::new(setup, 1, 1).unwrap();
    while run.now() < 30 {
        run.tick().unwrap();
    }
    run
}

#[test]
fn the_digest_depends_on_script_memory() {
    for (name, script) in SCRIPTS {
        let [dark, again, bright] = [300, 300, 900].map(|brightness| run(name, script, brightness));
        let views = |run: &Simulation| [0, 1].map(|robot| run.view(robot));
        assert_eq!(views(&dark), views(&bright), "{name}");
        assert_eq!(dark.digest(), again.digest(), "{name}");
        assert_ne!(dark.digest(), bright.digest(), "{name}");
    }
}

/// A command that waits decides the ticks after it.
#[test]
fn the_digest_depends_on_a_waiting_command() {
    let (name, script) = SCRIPTS[0];
    let mut run = run(name, script, 300);
    let before = run.digest();
    run.command("fail = 1").unwrap();
    assert_ne!(run.digest(), before);
}
