//! Losses of power at every moment: of the changes that were not synced, any may be lost.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::path::PathBuf;
use std::rc::Rc;

use crate::support::{identity, key, number, outcome, plan};
use bittybuzz_chunks::{Disk, Plan, Store};

/// A change of a disk, in the order of the calls.
#[derive(Debug, Clone)]
enum Change {
    Create(String, Vec<u8>),
    Sync(String),
    Rename(String, String),
    SyncFolder,
    Remove(String),
    /// The store has said that these rows are written.
    Report(Vec<usize>),
}

/// A disk that remembers what was done with it.
#[derive(Clone, Default)]
struct Recorder {
    files: Rc<RefCell<BTreeMap<String, Vec<u8>>>>,
    changes: Rc<RefCell<Vec<Change>>>,
}

impl Recorder {
    fn with(files: BTreeMap<String, Vec<u8>>) -> Self {
        Recorder { files: Rc::new(RefCell::new(files)), changes: Rc::default() }
    }

    fn note(&self, change: Change) {
        self.changes.borrow_mut().push(change);
    }
}

impl Disk for Recorder {
    fn path(&self, name: &str) -> PathBuf {
        PathBuf::from(name)
    }

    fn names(&self) -> io::Result<Vec<String>> {
        Ok(self.files.borrow().keys().cloned().collect())
    }

    fn read(&self, name: &str) -> io::Result<Option<Vec<u8>>> {
        Ok(self.files.borrow().get(name).cloned())
    }

    fn create(&self, name: &str, bytes: &[u8]) -> io::Result<()> {
        if self.files.borrow().contains_key(name) {
            return Err(ErrorKind::AlreadyExists.into());
        }
        self.files.borrow_mut().insert(name.to_owned(), bytes.to_owned());
        self.note(Change::Create(name.to_owned(), bytes.to_owned()));
        Ok(())
    }

    fn sync(&self, name: &str) -> io::Result<()> {
        assert!(self.files.borrow().contains_key(name), "{name}");
        self.note(Change::Sync(name.to_owned()));
        Ok(())
    }

    fn rename(&self, from: &str, to: &str) -> io::Result<()> {
        let bytes = self.files.borrow_mut().remove(from).ok_or(ErrorKind::NotFound)?;
        self.files.borrow_mut().insert(to.to_owned(), bytes);
        self.note(Change::Rename(from.to_owned(), to.to_owned()));
        Ok(())
    }

    fn sync_folder(&self) -> io::Result<()> {
        self.note(Change::SyncFolder);
        Ok(())
    }

    fn remove(&self, name: &str) -> io::Result<()> {
        if self.files.borrow_mut().remove(name).is_some() {
            self.note(Change::Remove(name.to_owned()));
        }
        Ok(())
    }
}

/// The content of a file on a disk: that of an unsynced file may be lost, in part, too.
#[derive(Debug, Clone)]
struct Inode {
    bytes: Vec<u8>,
    is_synced: bool,
}

/// A disk that loses power.
#[derive(Debug, Clone, Default)]
struct Platter {
    inodes: Vec<Inode>,
    /// The names that survive, and their inodes.
    names: BTreeMap<String, usize>,
    /// Changes of names that may be lost: a name, and its inode or none.
    pending: Vec<Vec<(String, Option<usize>)>>,
    /// The names as the running system sees them.
    seen: BTreeMap<String, usize>,
}

impl Platter {
    fn of(files: &BTreeMap<String, Vec<u8>>) -> Self {
        let mut platter = Platter::default();
        for (name, bytes) in files {
            platter.names.insert(name.clone(), platter.inodes.len());
            platter.inodes.push(Inode { bytes: bytes.clone(), is_synced: true });
        }
        platter.seen.clone_from(&platter.names);
        platter
    }

    fn apply(&mut self, change: &Change) {
        match change {
            Change::Create(name, bytes) => {
                let inode = self.inodes.len();
                self.inodes.push(Inode { bytes: bytes.clone(), is_synced: false });
                self.seen.insert(name.clone(), inode);
                self.pending.push(vec![(name.clone(), Some(inode))]);
            }
            Change::Sync(name) => self.inodes[self.seen[name]].is_synced = true,
            Change::Rename(from, to) => {
                let inode = self.seen.remove(from).unwrap();
                self.seen.insert(to.clone(), inode);
                self.pending.push(vec![(from.clone(), None), (to.clone(), Some(inode))]);
            }
            Change::Remove(name) => {
                self.seen.remove(name);
                self.pending.push(vec![(name.clone(), None)]);
            }
            Change::SyncFolder => {
                self.names.clone_from(&self.seen);
                self.pending.clear();
            }
            Change::Report(_) => {}
        }
    }

    /// Returns every state that a loss of power may leave: any subset of the pending changes of names, and
    /// of each unsynced content all, a half or nothing.
    fn states(&self) -> Vec<BTreeMap<String, Vec<u8>>> {
        assert!(self.pending.len() < 14, "{} unsynced changes", self.pending.len());
        let mut states = Vec::new();
        for subset in 0..1_u32 << self.pending.len() {
            let mut names = self.names.clone();
            let kept = self.pending.iter().enumerate().filter(|(at, _)| subset >> at & 1 == 1);
            for (name, inode) in kept.flat_map(|(_, change)| change) {
                match inode {
                    Some(inode) => names.insert(name.clone(), *inode),
                    None => names.remove(name),
                };
            }
            for share in [0, 1, 2] {
                let content = |inode: &usize| {
                    let Inode { bytes, is_synced } = &self.inodes[*inode];
                    let length = if *is_synced { bytes.len() } else { bytes.len() * share / 2 };
                    bytes[..length].to_vec()
                };
                states.push(
                    names.iter().map(|(name, inode)| (name.clone(), content(inode))).collect(),
                );
            }
        }
        states
    }
}

/// Replays every prefix of the changes and every loss, and checks that each reported row is found. `plans`
/// are the plans that the folder may have.
fn check(
    before: &BTreeMap<String, Vec<u8>>,
    changes: &[Change],
    plans: &[Plan],
    known: &[usize],
) -> usize {
    let mut platter = Platter::of(before);
    let mut reported: Vec<usize> = known.to_vec();
    let mut states = 0;
    for end in 0..=changes.len() {
        if let Some(change) = end.checked_sub(1).map(|last| &changes[last]) {
            platter.apply(change);
            if let Change::Report(runs) = change {
                reported.extend(runs);
            }
        }
        for state in platter.states() {
            states += 1;
            let disk = Recorder::with(state);
            let Some(store) = Store::open(disk).unwrap() else {
                assert_eq!(reported, [0_usize; 0], "the plan is lost");
                continue;
            };
            assert!(plans.contains(store.plan()));
            let replicates = store.plan().replicates;
            let found = store.all(|run| key(replicates, run)).unwrap();
            assert_eq!(found.aside, [], "a file under its name is whole");
            let of_plan = reported.iter().map(|one| number(replicates, *one));
            for run in of_plan.filter(|run| *run < store.plan().runs()) {
                let (expected, found) = (outcome(replicates, run), found.outcomes.get(&run));
                assert!(found.is_some_and(|found| found.is_same(&expected)), "run {run} of {end}");
            }
        }
    }
    states
}

/// Carries out some chunks, and one of them twice, the first time in part.
fn carry_out(store: &Store<Recorder>, disk: &Recorder, chunks: &[usize]) {
    let replicates = store.plan().replicates;
    let key = |run| key(replicates, run);
    for (turn, chunk) in chunks.iter().enumerate() {
        let mut outcomes = store.chunk(*chunk, key).unwrap().outcomes;
        for run in store.plan().runs_of(*chunk) {
            outcomes.insert(run, outcome(replicates, run));
            if turn == 1 {
                store.write(*chunk, &outcomes, key).unwrap();
                let runs = outcomes.keys().map(|run| identity(replicates, *run));
                disk.note(Change::Report(runs.collect()));
            }
        }
        store.write(*chunk, &outcomes, key).unwrap();
        let runs = outcomes.keys().map(|run| identity(replicates, *run));
        disk.note(Change::Report(runs.collect()));
    }
}

#[test]
fn no_reported_row_is_lost_and_no_file_is_half() {
    let disk = Recorder::default();
    let small = plan(3, 4, 3);
    let (store, _) = Store::create(disk.clone(), small.clone(), |run| key(4, run)).unwrap();
    carry_out(&store, &disk, &[0, 2, 1, 0]);
    let changes = disk.changes.take();
    let states = check(&BTreeMap::new(), &changes, std::slice::from_ref(&small), &[]);
    assert!(states > 200, "{states}");
    // More replicates, more points and another size of the chunks.
    let before = disk.files.borrow().clone();
    let larger = plan(4, 7, 5);
    let (store, found) = Store::create(disk.clone(), larger.clone(), |run| key(7, run)).unwrap();
    assert_eq!(found.outcomes.len(), 9);
    carry_out(&store, &disk, &[3, 0, 3]);
    let changes = disk.changes.take();
    let known: Vec<usize> = (0..9).map(|run| identity(4, run)).collect();
    check(&before, &changes, &[small, larger], &known);
}

/// The model of the disk finds a store that does not sync: without this, the test above could not fail.
#[test]
fn the_model_loses_what_is_not_synced() {
    let named = |changes: &[Change]| {
        let mut platter = Platter::default();
        changes.iter().for_each(|change| platter.apply(change));
        let contents = platter.states().into_iter().map(|files| files.get("b").cloned());
        contents.collect::<Vec<Option<Vec<u8>>>>()
    };
    let create = Change::Create("a".to_owned(), b"rows".to_vec());
    let (sync, rename) =
        (Change::Sync("a".to_owned()), Change::Rename("a".to_owned(), "b".to_owned()));
    let half = named(&[create.clone(), rename.clone(), Change::SyncFolder]);
    assert!(half.contains(&Some(b"ro".to_vec())) && half.contains(&Some(Vec::new())));
    let lost = named(&[create.clone(), sync.clone(), rename.clone()]);
    assert!(lost.contains(&None) && lost.contains(&Some(b"rows".to_vec())) && lost.len() == 12);
    let kept = named(&[create, sync, rename, Change::SyncFolder]);
    assert!(kept.iter().all(|bytes| *bytes == Some(b"rows".to_vec())), "{kept:?}");
}
