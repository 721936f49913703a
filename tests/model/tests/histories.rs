//! All histories of a few events: stores that are too small, robots that lose their memory, tables, forged clocks.

use bittybuzz_model::history::{Class, Event, Histories};
use bittybuzz_vm_core::message::CLOCK_MAX;
use stateright::{Checker, Model};

fn check(histories: Histories) {
    let name = format!("{histories:?}");
    let checker = histories.checker().threads(2).spawn_bfs().join();
    println!("{name}: {} histories", checker.unique_state_count());
    checker.assert_properties();
}

/// Puts of both ends of the row under three keys, where there is room for two.
fn small_stores(length: usize) -> Histories {
    let ends = [0, 2].into_iter();
    let put = |robot| (0..3).map(move |key| Event::Put(robot, key, Class::Number));
    let events = ends.flat_map(put).chain([Event::Delete(0, 1)]);
    Histories { length, events: events.collect(), cuts: vec![1], room: 2 }
}

/// Robots that put and are switched off and on, with and without the others.
fn restarts(length: usize, class: Class) -> Histories {
    let events = |robot| [Event::Put(robot, 0, class), Event::Restart(robot)];
    Histories {
        length,
        events: [0, 1].into_iter().flat_map(events).collect(),
        cuts: vec![0],
        room: 2,
    }
}

/// Robots that are away for longer than deletions keep their places, with room for one key or for both.
fn absences(length: usize, room: usize) -> Histories {
    let put = |robot, key| Event::Put(robot, key, Class::Number);
    let events = vec![put(0, 0), put(2, 1), put(0, 1), Event::Delete(0, 0), Event::Absence];
    Histories { length, events, cuts: vec![2], room }
}

/// Entries that are forged with any clock, among puts.
fn forged(length: usize) -> Histories {
    let clocks = [1, 1000, CLOCK_MAX / 2, CLOCK_MAX / 2 + 1, CLOCK_MAX / 3 * 2, CLOCK_MAX];
    let forged = clocks.map(Event::Forge);
    let puts = [0, 2].map(|robot| Event::Put(robot, 0, Class::Number));
    Histories { length, events: [&forged[..], &puts].concat(), cuts: vec![0], room: 2 }
}

#[test]
fn stores_that_are_too_small() {
    check(small_stores(3));
}

#[test]
fn numbers_survive_restarts() {
    check(restarts(4, Class::Number));
}

#[test]
fn tables_survive_restarts() {
    check(restarts(4, Class::Table));
}

#[test]
fn absences_longer_than_deletions_are_remembered() {
    check(absences(4, 1));
    check(absences(3, 2));
}

#[test]
fn forged_clocks() {
    check(forged(3));
}

#[test]
#[ignore = "minutes"]
fn longer_histories() {
    check(small_stores(4));
    check(restarts(5, Class::Number));
    check(restarts(5, Class::Table));
    check(forged(4));
    check(absences(5, 1));
    check(absences(5, 2));
}
