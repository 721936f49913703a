//! Streams, limits, special files, the environment, and journals of sweeps.

use bittybuzz_random::Random;

use super::Entry;
use crate::bases::{Bases, SCENARIO, SCRIPT};
use crate::case::{Case, Special, Streams};
use crate::mutation::{below, mutated, noise, one};

pub const KINDS: &[Entry] = &[
    ("streams-full", |bases, random, seed| {
        let full = [">/dev/full", "2>/dev/full", ">/dev/full 2>&1", "</dev/full >/dev/full"];
        redirected(bases, random, full[seed as usize % full.len()])
    }),
    ("streams-closed", |bases, random, seed| {
        let closed = [">&-", "2>&-", "<&-", ">&- 2>&-", "<&- >&- 2>&-"];
        redirected(bases, random, closed[seed as usize % closed.len()])
    }),
    ("limits", |bases, random, _| {
        let limit = one(
            random,
            &["-v 262144", "-v 524288", "-f 0", "-f 1", "-n 12", "-n 24", "-s 512", "-t 5"],
        );
        let mut case = command(bases, random);
        case.limits.push(limit.to_owned());
        case
    }),
    ("environment", |bases, random, seed| {
        let mut case = command(bases, random);
        let odd = ["", "/dev/null", "\u{1b}[2J", ":::", "/no/such/folder", "dumb", "0"];
        for name in
            ["HOME", "TERM", "PATH", "LANG", "TMPDIR", "BUZZ_INCLUDE_PATH", "COLUMNS", "NO_COLOR"]
        {
            let value = (random.below(3) > 0).then(|| one(random, &odd).into());
            if seed % 3 != 0 || random.chance(0.4) {
                case.variables.push((name.to_owned(), value));
            }
        }
        case
    }),
    ("outputs-special", |_, random, seed| {
        let arguments: &[&str] = one(random, WRITERS);
        let case = Case::new(arguments).with("s.toml", SCENARIO).with("s.bzz", SCRIPT);
        let special = match seed % 6 {
            0 => Special::Pipe,
            1 => Special::Socket,
            2 => Special::Folder,
            3 => Special::Link("/dev/full".to_owned()),
            4 => Special::Link("/no/such/folder/x".to_owned()),
            _ => Special::Link("out".to_owned()),
        };
        case.with_special("out", special).writing("out").writing("out.bbi").writing("out.sym")
    }),
    ("outputs-inputs", |_, random, _| {
        let input = one(random, &["s.toml", "s.bzz", "./s.bzz", "x/../s.toml", "link"]);
        let mut arguments = one(random, WRITERS).to_vec();
        let replaced = arguments.iter_mut().filter(|word| **word == "out");
        replaced.for_each(|word| *word = input);
        let case =
            Case::new(arguments).with("s.toml", SCENARIO).with("s.bzz", SCRIPT).with("x/y", "");
        case.with_special("link", Special::Link("s.bzz".to_owned()))
            .writing("s.bbi")
            .writing("s.sym")
            .writing("s.bzz.bbi")
            .writing("s.bzz.sym")
            .writing("s.toml.bbi")
            .writing("s.toml.sym")
            .writing("link.bbi")
            .writing("link.sym")
    }),
    ("inputs-special", |_, random, seed| {
        let special = match seed % 7 {
            0 => Special::Pipe,
            1 => Special::Socket,
            2 => Special::Folder,
            3 => Special::Link("/dev/zero".to_owned()),
            4 => Special::Link("/dev/full".to_owned()),
            5 => Special::Link("/proc/self/mem".to_owned()),
            _ => Special::Link("/proc/kmsg".to_owned()),
        };
        let (name, arguments): (&str, &[&str]) = READERS[below(random, READERS.len())];
        let case =
            Case::new(arguments).with_special(name, special).writing("out.bbi").writing("out.sym");
        ["s.bzz", "s.toml"].into_iter().filter(|file| *file != name).fold(case, |case, file| {
            case.with(file, if file == "s.bzz" { SCRIPT } else { SCENARIO })
        })
    }),
    ("journal-damaged", damaged_journal),
    ("sweep-damaged", damaged_sweep),
];

/// Commands that write the file `out`.
const WRITERS: &[&[&str]] = &[
    &["sim", "s.toml", "--headless", "--record", "out"],
    &["sim", "s.toml", "--headless", "--csv", "out"],
    &["sim", "s.toml", "--headless", "--svg", "out"],
    &["build", "s.bzz", "--robot", "kilobot", "-o", "out"],
    &["grade", ".", "--csv", "out"],
];

/// Commands, and a file that each of them reads.
const READERS: &[(&str, &[&str])] = &[
    ("s.bzz", &["check", "s.bzz"]),
    ("s.bzz", &["sim", "s.toml", "--headless"]),
    ("s.toml", &["sim", "s.toml", "--headless"]),
    ("s.toml", &["grade", "."]),
    ("a.json", &["grade", "."]),
    ("i.bbi", &["disasm", "i.bbi"]),
    ("o.bo", &["check", "o.bo"]),
    ("i.sym", &["trace", "-", "--script", "i.sym"]),
    ("r.toml", &["robots", "r.toml"]),
    ("r.bbr", &["view", "r.bbr", "--no-browser"]),
    ("e.argos", &["import", "e.argos"]),
    ("f.elf", &["build", "s.bzz", "--robot", "crazyflie", "--firmware", "f.elf", "-o", "out"]),
];

/// Returns a call that succeeds with usual surroundings.
fn command(bases: &Bases, random: &mut Random) -> Case {
    let arguments: &[&str] = one(
        random,
        &[
            &["check", "s.bzz"][..],
            &["check", "s.bzz", "--json"],
            &["build", "s.bzz", "--robot", "kilobot", "-o", "out"],
            &["run", "s.bzz", "--steps", "3"],
            &["disasm", "s.bzz"],
            &["sim", "s.toml"],
            &["sim", "s.toml", "--json"],
            &["sim", "s.toml", "--headless", "--record", "out.bbr", "--svg", "pictures"],
            &["sim", "s.toml", "--runs", "3", "--csv", "out.csv"],
            &["grade", "."],
            &["robots"],
            &["robots", "kilobot"],
            &["explain"],
            &["guide"],
            &["completions", "bash"],
            &["import", "e.argos"],
            &["stubs", "s.bzz"],
            &["--help"],
            &["check", "missing.bzz"],
            &["sim", "s.toml", "--set", "x=1"],
        ],
    );
    let case = Case::new(arguments).with("s.toml", SCENARIO).with("s.bzz", SCRIPT);
    let case = case.with("e.argos", crate::bases::EXPERIMENT).with("a.json", bases.hand_in.clone());
    ["out.bbi", "out.sym", "out.bbr", "out.csv", "pictures"].into_iter().fold(case, Case::writing)
}

fn redirected(bases: &Bases, random: &mut Random, streams: &'static str) -> Case {
    Case { streams: Streams::Redirected(streams), ..command(bases, random) }
}

/// Returns the journal of a batch with a damaged file.
fn damaged(bases: &Bases, random: &mut Random, seed: u64) -> Vec<(String, Vec<u8>)> {
    let mut files = bases.journal.clone();
    let at = below(random, files.len());
    let bytes = files[at].1.clone();
    match seed % 8 {
        0 => files[at].1 = mutated(random, &bytes),
        1 => files[at].1.truncate(below(random, bytes.len() + 1)),
        2 => files[at].1 = vec![0; bytes.len()],
        3 => drop(files.remove(at)),
        4 => {
            let other = below(random, files.len());
            files[at].1 = files[other].1.clone();
        }
        5 => files.push((format!("{}-99999999999999999999.runs", "0".repeat(16)), bytes)),
        6 => files.push((format!("{}-000007.known", "0".repeat(16)), noise(random, 100))),
        _ => files.push(("strange".to_owned(), noise(random, 100))),
    }
    files
}

/// The folder of a sweep with a damaged file. Its plan is that of the journal.
fn damaged_sweep(bases: &Bases, random: &mut Random, seed: u64) -> Case {
    let commands: &[&[&str]] = &[
        &["sweep", "run", "s.sweep"],
        &["sweep", "status", "s.sweep"],
        &["sweep", "merge", "s.sweep", "-o", "out.csv"],
        &["sweep", "plan", "s.toml", "--runs", "160"],
        &["sweep", "run", "s.sweep", "--chunk", "3", "--retry"],
        &["sweep", "report", "s.sweep", "-o", "out.html"],
    ];
    let case = Case::new(one(random, commands).iter().copied()).with("s.toml", SCENARIO);
    let case = case.with("s.bzz", SCRIPT).writing("s.sweep").writing("out.csv").writing("out.html");
    damaged(bases, random, seed)
        .into_iter()
        .filter(|(name, _)| name != "lock")
        .fold(case, |case, (name, bytes)| case.with(format!("s.sweep/{name}"), bytes))
}

/// A batch of which a part is kept. The others of its 150 runs take well below a second each.
fn damaged_journal(bases: &Bases, random: &mut Random, seed: u64) -> Case {
    let files = damaged(bases, random, seed);
    let arguments = ["sim", "s.toml", "--runs", "150", "--csv", "runs.csv"];
    let resume = (!seed.is_multiple_of(5)).then_some("--resume");
    let case = Case::new(arguments.into_iter().chain(resume)).with("s.toml", SCENARIO);
    let case = case.with("s.bzz", SCRIPT).writing("runs.csv");
    files
        .into_iter()
        .fold(case, |case, (name, bytes)| case.with(format!("runs.csv.parts/{name}"), bytes))
}
