//! Commands to a running world, and the scenarios that they are written as.

use crate::busy::{rest, setup};
use bittybuzz_arena::run::Simulation;
use bittybuzz_random::Random;

/// Robots of the world: ids of Kilobots, Zooids and Crazyflies.
const IDS: [u16; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 20, 21, 22, 23, 30, 31, 32];

/// A command of any kind, as a person might give it.
fn command(chance: &mut Random) -> String {
    let id = |chance: &mut Random| IDS[chance.below(IDS.len() as u32) as usize];
    let place = |chance: &mut Random| {
        // The largest body, of 60 mm, has room everywhere.
        let [x, y] = [0, 1].map(|_| chance.below(881) as i32 - 440);
        format!("[{x}, {y}]")
    };
    let (one, other) = (id(chance), id(chance));
    match chance.below(20) {
        0 => format!("fail = {one}"),
        1 => format!("stop = [{one}, {other}]"),
        2 => "resume = \"all\"".to_owned(),
        3 => format!("restart = {one}"),
        4 => format!("move = {one}\nto = {}", place(chance)),
        5 => {
            format!("move = \"0..8\"\nby = [3, -2.5]\nheading = {}", chance.below(720) as i32 - 360)
        }
        6 => format!("battery = {one}\nvolts = {}", f64::from(chance.below(50)) / 10.0),
        7 => format!("light = [{}, {{ at = {}, brightness = 300 }}]", place(chance), place(chance)),
        8 => format!("loss = 0.{}\nmedium = \"ir\"", chance.below(10)),
        9 => format!("loss = [0, 1]\nmedium = \"{}\"", ["nrf24", "p2p"][chance.below(2) as usize]),
        10 => format!("block = [{one}, {other}]"),
        11 => format!("restore = [{one}, \"all\"]"),
        12 => format!("brown_out = [{one}, {other}]"),
        13 => {
            let kind = ["jam", "babble", "replay", "poison"][chance.below(4) as usize];
            let group = ["kilobot", "zooids", "crazyflie"][chance.below(3) as usize];
            let at = place(chance);
            format!(
                "adversary = {{ kind = \"{kind}\", group = \"{group}\", at = {at}, until = 11, rate = 20 }}"
            )
        }
        14 => format!("load = [{one}, {other}]\nscript = \"quiet.bzz\""),
        17 => format!(
            "set = [{one}, {other}]\nglobal = \"n\"\nnumber = {}",
            chance.below(1001) as i32 - 500
        ),
        18 => "set = \"all\"\nglobal = \"heard\"\nnumber = 0.5".to_owned(),
        15 => {
            let robots = ["kilobot", "zooids", "all", "3..6"][chance.below(4) as usize];
            let keep = chance.chance(0.5);
            format!("load = \"{robots}\"\nscript = \"loud.bzz\"\nkeep = {keep}")
        }
        16 if one != other => format!("partition = [{one}, {other}] # an edge"),
        _ => "heal = true".to_owned(),
    }
}

/// Plays a session, and the scenario that it is written as.
fn replay(seed: u64, folder: &str) {
    let mut chance = Random::new(seed);
    let mut session = Simulation::new(setup(folder, ""), 5, 1).unwrap();
    let mut seen = Vec::new();
    while !session.is_over() {
        for _ in 0..chance.below(5).saturating_sub(2) {
            let text = command(&mut chance);
            session.command(&text).unwrap_or_else(|errors| panic!("{text}: {errors:#?}"));
        }
        session.tick().unwrap();
        seen.push((session.digest(), session.take_log()));
    }
    let commands = session.commands();
    let mut again = Simulation::new(setup(folder, &format!("\n{commands}")), 5, 1).unwrap();
    assert_eq!(rest(&mut again), seen, "session {seed}:\n{commands}");
    assert_eq!(again.commands(), "");
    let summaries = [&mut session, &mut again].map(|run| format!("{:?}", run.summary()));
    assert_eq!(summaries[0], summaries[1]);
}

/// Copies a session at a random time; the copy gets the same commands from then on.
fn copy(seed: u64, folder: &str) {
    let mut chance = Random::new(seed);
    let mut session = Simulation::new(setup(folder, ""), 5, 1).unwrap();
    let at = u64::from(chance.below(session.end() as u32));
    let mut copied: Option<Simulation> = None;
    while !session.is_over() {
        if session.now() == at {
            copied = session.snapshot();
            assert_eq!(copied.as_ref().unwrap().commands(), session.commands());
        }
        let texts: Vec<String> =
            (0..chance.below(5).saturating_sub(2)).map(|_| command(&mut chance)).collect();
        let mut seen = Vec::new();
        for run in [Some(&mut session), copied.as_mut()].into_iter().flatten() {
            texts.iter().for_each(|text| run.command(text).unwrap());
            run.tick().unwrap();
            seen.push((run.digest(), run.take_log()));
        }
        assert!(seen.iter().all(|other| *other == seen[0]), "session {seed}, copied at {at}");
    }
}

#[test]
fn a_session_equals_the_scenario_of_its_commands() {
    for seed in 0..20 {
        replay(seed, "session");
    }
}

#[test]
fn a_copied_session_continues_equally() {
    for seed in 0..20 {
        copy(seed, "copied");
    }
}

/// Half a minute: `cargo test --locked --release -p bittybuzz-arena --test arena commands:: -- --ignored`.
#[test]
#[ignore = "takes half a minute with optimization"]
fn a_thousand_random_sessions_equal_their_scenarios() {
    for seed in 0..1000 {
        replay(seed, "sessions");
    }
}

/// As long, by the same command.
#[test]
#[ignore = "takes half a minute with optimization"]
fn a_thousand_copied_sessions_continue_equally() {
    for seed in 1000..2000 {
        copy(seed, "copies");
    }
}

#[test]
fn commands_change_the_run() {
    let setup = setup("commanded", "");
    let quiet = rest(&mut Simulation::new(setup.clone(), 5, 1).unwrap());
    let mut run = Simulation::new(setup, 5, 1).unwrap();
    run.command("move = 5\nto = [300, 300]").unwrap();
    assert_eq!(run.commands(), "[[event]]\nat = 0\nmove = 5\nto = [300, 300]\n\n");
    assert_ne!(rest(&mut run), quiet);
}

#[test]
fn bad_commands_are_refused_and_change_nothing() {
    let setup = setup("refused", "");
    let mut run = Simulation::new(setup.clone(), 5, 1).unwrap();
    for (text, reason) in [
        ("fail = 99", "there is no robot 99"),
        ("move = 1\nto = [600, 0]", "outside"),
        ("fial = 1", "did you mean `fail`?"),
        ("fail = 1\nat = 3", "`at`"),
        ("battery = 1\nvolts = 9", "cannot be 9"),
        ("loss = 0.5", "`medium`"),
        ("", "the command"),
        ("fail = 1\n[world]\nseed = 2", "`world`"),
        ("fail = ", "not TOML"),
    ] {
        let errors = run.command(text).unwrap_err();
        let printed: String =
            errors.iter().map(|error| format!("{error}\n{:?}\n", error.help())).collect();
        assert!(printed.contains(reason), "{text}: {printed}");
    }
    assert_eq!(run.commands(), "");
    let mut untouched = Simulation::new(setup, 5, 1).unwrap();
    assert_eq!(rest(&mut run), rest(&mut untouched));
    let errors = run.command("fail = 1").unwrap_err();
    assert!(errors[0].to_string().contains("the run is over"), "{errors:?}");
}
