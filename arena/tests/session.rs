//! Sessions that are taken back, and go on as they have gone.

use crate::busy::{rest, setup};
use bittybuzz_arena::run::{NoWayBack, NotReplaced, Session, Simulation};
use bittybuzz_random::Random;

/// Commands of all kinds that change what happens later.
const COMMANDS: [&str; 6] = [
    "fail = 3",
    "restart = \"all\"",
    "move = 5\nto = [300, 300]",
    "load = [2, 21]\nscript = \"loud.bzz\"",
    "loss = 0.5\nmedium = \"ir\"",
    "brown_out = \"zooids\"",
];

fn begin(name: &str, most: usize) -> Session {
    Session::new(Simulation::new(setup(name, ""), 5, 1).unwrap(), most)
}

/// Plays to the end and returns the digest at each tick, with the commands that act then.
fn play(session: &mut Session, mut act: impl FnMut(&mut Session)) -> Vec<u64> {
    let mut digests = Vec::new();
    while !session.run().is_over() {
        act(session);
        digests.push(session.run().digest());
        session.tick().unwrap();
    }
    digests.push(session.run().digest());
    digests
}

#[test]
fn going_back_to_any_tick_restores_its_state() {
    let mut chance = Random::new(1);
    // Two copies leave long ways, 500 none. Without room for any, the run is built again.
    for (most, bytes) in [(2, usize::MAX), (7, usize::MAX), (500, usize::MAX), (500, 0), (0, 500)] {
        let run = Simulation::new(setup("session_seek", ""), 5, 1).unwrap();
        let mut session = Session::with_bytes(run, most, bytes);
        let digests = play(&mut session, |session| {
            if session.run().now() % 17 == 3 {
                session.command(COMMANDS[chance.below(COMMANDS.len() as u32) as usize]).unwrap();
            }
        });
        let commands = session.run().commands();
        let results = format!("{:?}", session.summary());
        for _ in 0..40 {
            let tick = u64::from(chance.below(session.run().end() as u32 + 1));
            session.go_to(tick).unwrap();
            assert_eq!(session.run().now(), tick);
            assert_eq!(session.run().digest(), digests[tick as usize], "{most} copies, {tick}");
            assert_eq!(session.run().commands(), commands);
        }
        session.go_to(30).unwrap();
        assert_eq!(play(&mut session, |_| {}), digests[30..], "{most} copies");
        assert_eq!(format!("{:?}", session.summary()), results);
    }
}

/// A way may end earlier, and another one may begin there.
#[test]
fn a_way_may_be_left() {
    let mut session = begin("session_left", 2);
    let digests = play(&mut session, |_| {});
    for (to, then) in [(90, 30), (30, 90), (100, 99), (0, 100)] {
        session.approach(to).unwrap();
        let start = session.run().now();
        assert!(start <= to);
        (start..to.min(start + 3)).for_each(|_| session.advance_unseen().unwrap());
        session.go_to(then).unwrap();
        assert_eq!(session.run().digest(), digests[then as usize], "{to}, {then}");
    }
}

/// The end of the run is the end of all ways.
#[test]
fn a_session_cannot_go_beyond_its_end() {
    let mut session = begin("session_end", 4);
    session.go_to(u64::MAX).unwrap();
    assert_eq!(session.run().now(), session.run().end());
}

#[test]
fn a_command_in_the_past_discards_the_later_ones() {
    let mut session = begin("session_branch", 5);
    play(&mut session, |session| match session.run().now() {
        20 => session.command("fail = 4").unwrap(),
        70 => session.command("fail = 5").unwrap(),
        _ => {}
    });
    session.go_to(50).unwrap();
    session.command("move = 6\nto = [0, -300]").unwrap();
    let expected = "[[event]]\nat = 2\nfail = 4\n\n[[event]]\nat = 5\nmove = 6\nto = [0, -300]\n\n";
    assert_eq!(session.run().commands(), expected);
    let digests = play(&mut session, |_| {});
    // Copies of the discarded future are not gone to.
    session.go_to(100).unwrap();
    assert_eq!(session.run().digest(), digests[50]);
    let setup = setup("session_branch_again", &format!("\n{expected}"));
    let mut again = Simulation::new(setup, 5, 1).unwrap();
    let seen = rest(&mut again);
    // The first digest has a command that waits; a replay has an event, which never does.
    let after: Vec<u64> = seen[50..].iter().map(|(digest, _)| *digest).collect();
    assert_eq!(digests[1..], after);
}

/// A command at the tick of another one that waits comes after it.
#[test]
fn commands_at_the_same_tick_keep_their_order() {
    let mut session = begin("session_same", 3);
    play(&mut session, |session| {
        if session.run().now() == 10 {
            session.command("fail = 4").unwrap();
        }
    });
    session.go_to(10).unwrap();
    session.command("restart = 4").unwrap();
    let expected = "[[event]]\nat = 1\nfail = 4\n\n[[event]]\nat = 1\nrestart = 4\n\n";
    assert_eq!(session.run().commands(), expected);
}

/// A script that has changed on disk since it was loaded is not asked for again.
#[test]
fn going_back_does_not_compile_again() {
    let mut session = begin("session_script", 2);
    let digests = play(&mut session, |session| {
        if session.run().now() == 40 {
            session.command("load = 2\nscript = \"quiet.bzz\"").unwrap();
        }
    });
    let script = session.run().setup().scenario.folder.join("quiet.bzz");
    std::fs::write(script, "this is no script").unwrap();
    session.go_to(20).unwrap();
    session.go_to(90).unwrap();
    assert_eq!(session.run().digest(), digests[90]);
}

#[test]
fn a_session_cannot_go_before_its_start() {
    let mut run = Simulation::new(setup("session_late", ""), 5, 1).unwrap();
    (0..30).for_each(|_| run.tick().unwrap());
    let mut session = Session::new(run, 4);
    assert!(matches!(session.go_to(29), Err(NoWayBack::BeforeBeginning(30))));
    session.go_to(30).unwrap();
}

/// A copy goes the way of the session, which stays where it is.
#[test]
fn a_copy_before_a_tick_goes_the_way_of_the_session() {
    for bytes in [usize::MAX, 0] {
        let run = Simulation::new(setup("session_copy", ""), 5, 1).unwrap();
        let mut session = Session::with_bytes(run, 5, bytes);
        let digests = play(&mut session, |session| {
            if session.run().now() % 17 == 3 {
                session.command("move = 5\nto = [300, 300]").unwrap();
            }
        });
        session.go_to(70).unwrap();
        for tick in [0, 3, 50, 70, 95] {
            let mut copy = session.copy_before(tick).unwrap();
            assert!(copy.now() <= tick);
            while copy.now() < tick {
                copy.tick().unwrap();
            }
            assert_eq!(copy.digest(), digests[tick as usize], "{bytes} bytes, {tick}");
        }
        assert_eq!(session.run().digest(), digests[70]);
    }
}

/// Plays to the end, and gives each command at its tick.
fn play_with(session: &mut Session, commands: &[(u64, String)]) -> Vec<u64> {
    play(session, |session| {
        let now = session.run().now();
        let due = commands.iter().filter(|(tick, _)| *tick == now);
        due.for_each(|(_, text)| session.command(text).unwrap());
    })
}

fn commands_of(session: &Session) -> Vec<(u64, String)> {
    session.run().command_list().map(|(tick, text)| (tick, text.to_owned())).collect()
}

/// A run from which a command of any kind was deleted is the run that never had it.
#[test]
fn a_deleted_command_leaves_no_trace() {
    let more = ["load = [2, 21]\nscript = \"quiet.bzz\"", "fail = 7"];
    let texts = COMMANDS.into_iter().chain(more);
    let all: Vec<(u64, String)> =
        texts.enumerate().map(|(number, text)| (10 + 8 * number as u64, text.to_owned())).collect();
    for (most, bytes) in [(5, usize::MAX), (500, 0)] {
        for deleted in 0..all.len() {
            let fresh = |name: &str| {
                let run = Simulation::new(setup(name, ""), 5, 1).unwrap();
                Session::with_bytes(run, most, bytes)
            };
            let mut others = all.clone();
            others.remove(deleted);
            let expected = play_with(&mut fresh("session_never"), &others);
            let mut session = fresh("session_deleted");
            let before = play_with(&mut session, &all);
            let end = session.run().now();
            session.replace_commands(&others).unwrap();
            session.go_to(end).unwrap();
            let deleted = &all[deleted].1;
            assert_eq!(session.run().digest(), expected[end as usize], "{deleted}");
            assert_eq!(commands_of(&session), others);
            for tick in [5, 40, 70, end] {
                session.go_to(tick).unwrap();
                // A command that waits is in the digest, but not before it was given.
                if all.iter().all(|(at, _)| *at != tick) {
                    assert_eq!(
                        session.run().digest(),
                        expected[tick as usize],
                        "{deleted}, {tick}"
                    );
                }
            }
            // Undone.
            session.replace_commands(&all).unwrap();
            session.go_to(end).unwrap();
            assert_eq!(session.run().digest(), before[end as usize], "{deleted}");
        }
    }
}

#[test]
fn commands_that_do_not_fit_leave_the_session_as_it_is() {
    let mut session = begin("session_misfit", 5);
    let all = [(10, COMMANDS[3].to_owned()), (20, "fail = 4".to_owned())];
    play_with(&mut session, &all);
    session.go_to(50).unwrap();
    let digest = session.run().digest();
    let wrong =
        [(10, "fail = 4".to_owned()), (20, "set = 2\nglobal = \"none\"\nnumber = 1".to_owned())];
    assert!(matches!(session.replace_commands(&wrong), Err(NotReplaced::Refused(_))));
    assert_eq!((session.run().now(), session.run().digest()), (50, digest));
    assert_eq!(commands_of(&session), all);
    session.replace_commands(&all).unwrap();
    assert_eq!(session.run().now(), 50);
}

#[test]
fn a_session_that_began_later_keeps_its_first_commands() {
    let mut run = Simulation::new(setup("session_first", ""), 5, 1).unwrap();
    run.command("fail = 3").unwrap();
    (0..30).for_each(|_| run.tick().unwrap());
    let mut session = Session::new(run, 4);
    session.command("fail = 4").unwrap();
    session.go_to(60).unwrap();
    let without_first = [(30, "fail = 4".to_owned())];
    let refused = session.replace_commands(&without_first);
    assert!(matches!(refused, Err(NotReplaced::NoWay(NoWayBack::BeforeBeginning(30)))));
    session.replace_commands(&[(0, "fail = 3".to_owned())]).unwrap();
    assert_eq!(session.run().now(), 30);
}
