//! Chunks in folders: growth, copies, damage and other experiments.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::support::{key, outcome, plan};
use bittybuzz_chunks::{Folder, Outcome, PLAN, Plan, Store, StoreError};
use tempfile::TempDir;

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn create(path: &Path, plan: Plan) -> Result<(Store<Folder>, usize), StoreError> {
    let replicates = plan.replicates;
    let created = Store::create(Folder(path.to_owned()), plan, |run| key(replicates, run));
    created.map(|(store, found)| (store, found.outcomes.len()))
}

fn carry_out(store: &Store<Folder>, chunk: usize) {
    let replicates = store.plan().replicates;
    let outcomes = store.plan().runs_of(chunk).map(|run| (run, outcome(replicates, run))).collect();
    store.write(chunk, &outcomes, |run| key(replicates, run)).unwrap();
}

/// Returns the runs that are finished, after checking their results.
fn finished(store: &Store<Folder>) -> Vec<usize> {
    let replicates = store.plan().replicates;
    let found = store.all(|run| key(replicates, run)).unwrap();
    for (run, found) in &found.outcomes {
        assert!(found.is_same(&outcome(replicates, *run)), "{run}: {found:?}");
    }
    found.outcomes.into_keys().collect()
}

fn row_files(path: &Path) -> Vec<String> {
    let names =
        fs::read_dir(path).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.filter(|name| name != PLAN).collect();
    names.sort();
    names
}

#[test]
fn more_replicates_points_and_other_chunks_keep_every_run() {
    let folder = folder();
    let (store, _) = create(folder.path(), plan(3, 30, 7)).unwrap();
    (0..store.plan().chunks()).for_each(|chunk| carry_out(&store, chunk));
    assert_eq!(finished(&store).len(), 90);
    let (store, known) = create(folder.path(), plan(5, 60, 11)).unwrap();
    assert_eq!((known, finished(&store).len()), (90, 90));
    // The files of the old plan are gone; the new plan has them as whole chunks or parts of chunks.
    let names = row_files(folder.path());
    let ids: BTreeSet<&str> = names.iter().map(|name| &name[..16]).collect();
    assert_eq!(ids.len(), 1, "{names:?}");
    assert!(names.iter().any(|name| name.ends_with(".known")), "{names:?}");
    // A chunk of the new plan knows the runs of the old one.
    let known = store.chunk(3, |run| key(60, run)).unwrap().outcomes;
    assert_eq!(known.into_keys().collect::<Vec<usize>>(), [] as [usize; 0]);
    let known = store.chunk(2, |run| key(60, run)).unwrap().outcomes;
    assert_eq!(known.into_keys().collect::<Vec<usize>>(), (22..30).collect::<Vec<usize>>());
    // Fewer runs lose none of the others.
    let (store, known) = create(folder.path(), plan(1, 5, 11)).unwrap();
    assert_eq!((known, finished(&store).len()), (5, 5));
    let (store, known) = create(folder.path(), plan(5, 60, 11)).unwrap();
    assert_eq!((known, finished(&store).len()), (90, 90));
}

#[test]
fn folders_are_joined_by_a_copy() {
    let [one, other] = [folder(), folder()];
    let (first, _) = create(one.path(), plan(2, 6, 3)).unwrap();
    let (second, _) = create(other.path(), plan(2, 6, 3)).unwrap();
    [0, 2].into_iter().for_each(|chunk| carry_out(&first, chunk));
    [1, 2, 3].into_iter().for_each(|chunk| carry_out(&second, chunk));
    // Both have chunk 2, with the same bytes.
    for name in row_files(other.path()) {
        let bytes = fs::read(other.path().join(&name)).unwrap();
        if let Ok(old) = fs::read(one.path().join(&name)) {
            assert_eq!(old, bytes);
        }
        fs::write(one.path().join(name), bytes).unwrap();
    }
    assert_eq!(finished(&first), (0..12).collect::<Vec<usize>>());
}

#[test]
fn every_damage_of_a_file_is_found_and_set_aside() {
    let folder = folder();
    let (store, _) = create(folder.path(), plan(1, 4, 4)).unwrap();
    carry_out(&store, 0);
    let name = row_files(folder.path()).remove(0);
    let path = folder.path().join(&name);
    let bytes = fs::read(&path).unwrap();
    let mut damages: Vec<Vec<u8>> =
        (0..bytes.len()).map(|length| bytes[..length].to_vec()).collect();
    for at in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1 << (at % 8);
        damages.push(damaged);
    }
    for damaged in damages {
        fs::write(&path, &damaged).unwrap();
        let found = store.chunk(0, |run| key(4, run)).unwrap();
        assert!(found.outcomes.is_empty(), "{}", String::from_utf8_lossy(&damaged));
        let [aside] = &found.aside[..] else { panic!("{:?}", found.aside) };
        assert_eq!((&aside.path, path.exists()), (&path, false));
        assert_eq!(fs::read(&aside.now).unwrap(), damaged);
        fs::remove_file(&aside.now).unwrap();
    }
    carry_out(&store, 0);
    assert_eq!(fs::read(&path).unwrap(), bytes);
}

#[test]
fn other_experiments_are_refused_by_name() {
    let folder = folder();
    let (store, _) = create(folder.path(), plan(1, 4, 4)).unwrap();
    carry_out(&store, 0);
    let refused = |change: &dyn Fn(&mut Plan), parts: &[&str]| {
        let mut other = plan(1, 8, 4);
        change(&mut other);
        let error = create(folder.path(), other).map(|_| ()).unwrap_err().to_string();
        parts.iter().for_each(|part| assert!(error.contains(part), "{error}"));
    };
    refused(&|plan| plan.experiment.program = "1.1 def".to_owned(), &["1.0 abc", "1.1 def", PLAN]);
    refused(&|plan| plan.experiment.scenario = "other".to_owned(), &["the scenario", PLAN]);
    refused(&|plan| plan.experiment.metrics.truncate(1), &["the metrics"]);
    let option =
        |plan: &mut Plan| drop(plan.experiment.options.insert("--robot".into(), "a".into()));
    refused(&option, &["--robot"]);
    let script = |plan: &mut Plan| drop(plan.files.insert("s.bzz".into(), "0".into()));
    refused(&script, &["not as they were: `s.bzz`"]);
    // A file that only one of them reads is no contradiction.
    let mut more = plan(1, 8, 4);
    more.files.insert("t.bzz".to_owned(), "0".to_owned());
    assert_eq!(create(folder.path(), more).unwrap().1, 4);
    // A file of another program that was copied here.
    let [mixed, elsewhere] = [self::folder(), self::folder()];
    let (own, _) = create(mixed.path(), plan(1, 4, 4)).unwrap();
    let mut other = plan(1, 4, 4);
    other.experiment.program = "1.1 def".to_owned();
    let (other, _) = create(elsewhere.path(), other).unwrap();
    carry_out(&other, 0);
    let name = row_files(elsewhere.path()).remove(0);
    fs::copy(elsewhere.path().join(&name), mixed.path().join(&name)).unwrap();
    let error = own.all(|run| key(4, run)).unwrap_err().to_string();
    for part in [&name, "1.0 abc", "1.1 def"] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn two_results_of_one_run_are_refused() {
    let folder = folder();
    let (store, _) = create(folder.path(), plan(1, 4, 2)).unwrap();
    carry_out(&store, 0);
    let other = Outcome::Complete { metrics: vec![Some(7.0), None], digest: 1 };
    let key_of = |run: usize| key(4, run % 2);
    store.write(1, &[(2, other), (3, outcome(4, 1))].into(), key_of).unwrap();
    let error = store.all(|run| key(4, run)).unwrap_err().to_string();
    for part in ["-000000.runs", "-000001.runs", "a=0, seed 1"] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn a_point_that_a_plan_has_twice_is_finished_twice() {
    let folder = folder();
    let mut twice = plan(1, 2, 2);
    twice.points.push(twice.points[0].clone());
    let key_of = |run: usize| key(2, run % 2);
    let (store, _) = Store::create(Folder(folder.path().to_owned()), twice, key_of).unwrap();
    let outcomes = (0..2).map(|run| (run, outcome(2, run))).collect();
    store.write(0, &outcomes, key_of).unwrap();
    let found = store.all(key_of).unwrap().outcomes;
    assert_eq!(found.into_keys().collect::<Vec<usize>>(), [0, 1, 2, 3]);
}

#[test]
fn a_plan_that_is_none_is_refused() {
    let folder = folder();
    assert!(Store::open(Folder(folder.path().to_owned())).unwrap().is_none());
    let (_, _) = create(folder.path(), plan(2, 2, 2)).unwrap();
    let text = fs::read_to_string(folder.path().join(PLAN)).unwrap();
    for (old, new, part) in [
        ("\"chunk\": 2", "\"chunk\": 0", "`chunk` is 0"),
        ("\"replicates\": 2", "\"replicates\": 0", "`replicates` is 0"),
        ("\"replicates\": 2", "\"replicates\": -2", "-2"),
        ("\"replicates\": 2", "\"replicates\": 500001", "more than 1000000 runs"),
        ("\"seed\"", "\"sed\"", "sed"),
        ("\"a\"", "\"b\", \"c\"", "plan.json"),
        ("{", "", "plan.json"),
    ] {
        assert!(text.contains(old), "{old}");
        fs::write(folder.path().join(PLAN), text.replacen(old, new, 1)).unwrap();
        let error = Store::open(Folder(folder.path().to_owned())).map(|_| ()).unwrap_err();
        assert!(error.to_string().contains(part), "{error}");
    }
}
