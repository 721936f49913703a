//! A scenario in memory is the one on disk.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bittybuzz_arena::run::{Program, Setup, Simulation};
use bittybuzz_arena::scenario::{Scenario, ScenarioError, file_sections};
use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::include::{DiskFiles, Files, IncludeLoader, MemoryFiles, SOURCE_BYTES_MAX};

/// An example, and robots of a user with an include.
const FILES: [(&str, &str); 5] = [
    (
        "worlds/mixed.toml",
        "[world]\nsize = [2000, 2000]\nduration = 20\n\n\
         [[robots]]\nrobot = \"kilobot\"\nscript = \"../swarm/gradient.bzz\"\ncount = 5\nplacement = \"line\"\nspacing = 60\n\n\
         [[robots]]\nrobot = \"rover.toml\"\nscript = \"drive.bzz\"\ncount = 4\nat = [0, 500]\narea = [800, 400]\n",
    ),
    (
        "worlds/rover.toml",
        "name = \"rover\"\n\n[body]\nradius_mm = 30\ndrive = \"differential\"\nwheel_distance_mm = 40\nspeed_mm_s = 100\n\n\
         [[function]]\nname = \"wheels\"\naccepts = [\"left: number, right: number\"]\n\
         sets = { left_wheel = \"left mm/s\", right_wheel = \"right mm/s\" }\nhelp = \"Drives.\"\n",
    ),
    ("worlds/drive.bzz", "include \"parts/speed.bzz\"\nfunction step() { wheels(speed, 30) }\n"),
    ("worlds/parts/speed.bzz", "speed = 40\n"),
    ("swarm/gradient.bzz", include_str!("../../examples/swarm/gradient.bzz")),
];

/// Writes these files to a folder, and keeps them in memory by the same paths.
fn both(test: &str, files: &[(&str, &str)]) -> (PathBuf, MemoryFiles) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    let mut memory = MemoryFiles::default();
    for (name, text) in files {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, text).unwrap();
        memory = memory.with(path, *text);
    }
    (folder, memory)
}

fn open(files: &dyn Files, path: &Path) -> Result<Scenario, Vec<ScenarioError>> {
    Scenario::open_in(files, path, &[], &bittybuzz_robot_models::all())
}

/// Returns the digest of a run after 10 s.
fn digest(files: &dyn Files, path: &Path) -> u64 {
    let scenario = open(files, path).unwrap_or_else(|errors| panic!("{errors:#?}"));
    let embedded = Arc::clone(&scenario.embedded);
    let files = &embedded.over(files);
    let compiled = scenario.groups.iter().map(|group| {
        let robots = bittybuzz_robot_files::all_shipped();
        let options = Options { robot: Some((*group.robot).clone()), robots, ..Options::default() };
        let script = group.script.as_ref().unwrap();
        let text = files.read(script, SOURCE_BYTES_MAX).unwrap();
        let text = String::from_utf8(text).unwrap();
        let folders = embedded.include_folder().map(Path::to_owned).into_iter().collect();
        let loader = IncludeLoader { folders, ..IncludeLoader::new(files) };
        let compiled = compile(script, text, &loader, &options);
        let image = compiled.image.unwrap_or_else(|| panic!("{:#?}", compiled.diagnostics));
        Program::new(image, compiled.symbols, Arc::new(compiled.sources))
    });
    let programs: Vec<Program> = compiled.collect();
    let setup = Arc::new(Setup::new(scenario, programs).unwrap());
    let mut run = Simulation::new(setup, 7, 1).unwrap();
    while run.now() < 100 {
        run.tick().unwrap();
    }
    run.digest()
}

#[test]
fn files_in_memory_give_the_same_run() {
    let (folder, memory) = both("memory", &FILES);
    let path = folder.join("worlds/mixed.toml");
    assert_eq!(digest(&memory, &path), digest(&DiskFiles, &path));
}

/// The scenario above as one file, which stands anywhere.
#[test]
fn files_in_the_scenario_give_the_same_run() {
    let (_, memory) = both("memory-embedded", &FILES);
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("memory-embedded");
    let [(_, scenario), others @ ..] = &FILES;
    let names = ["rover.toml", "drive.bzz", "parts/speed.bzz", "../swarm/gradient.bzz"];
    let texts = names.into_iter().zip(others.iter().map(|(_, text)| *text));
    let one = format!("{scenario}{}", file_sections(texts));
    let alone = MemoryFiles::default().with("one.toml", one.as_str());
    let path = folder.join("worlds/mixed.toml");
    assert_eq!(digest(&alone, Path::new("one.toml")), digest(&memory, &path));
    // An included file is also found in the folder of the scenario.
    let moved = one.replace("parts/speed.bzz", "speed.bzz");
    let moved = moved.replace("path = \"drive.bzz\"", "path = \"sub/drive.bzz\"");
    let moved = moved.replace("script = \"drive.bzz\"", "script = \"sub/drive.bzz\"");
    assert_ne!(moved, one);
    let alone = MemoryFiles::default().with("a/one.toml", moved);
    assert_eq!(digest(&alone, Path::new("a/one.toml")), digest(&memory, &path));
    // A file of the scenario is taken instead of one on disk.
    let other = one.replace("speed = 40", "speed = 10");
    let beside = memory.with(folder.join("worlds/one.toml"), other);
    assert_ne!(digest(&beside, &folder.join("worlds/one.toml")), digest(&beside, &path));
}

/// Returns errors as people read them: message, file, line and help.
fn printed(files: &dyn Files, path: &Path) -> Vec<String> {
    let Err(errors) = open(files, path) else { panic!("a mistake was not found") };
    let printed = errors.iter().map(|error| {
        let place = error.place.as_ref().map(|place| (place.path.clone(), place.line));
        format!("{error} {place:?} {:?}", error.help())
    });
    printed.collect()
}

#[test]
fn files_in_memory_give_the_same_errors() {
    let (folder, memory) = both("memory-mistakes", &FILES);
    let changed = [
        // A script that is missing, with one beside it that may be meant; a folder.
        ("worlds/mixed.toml", "drive.bzz", "drvie.bzz", 1),
        ("worlds/mixed.toml", "drive.bzz", "parts", 1),
        // A mistake in a robot file.
        ("worlds/rover.toml", "radius_mm = 30", "radius = 30", 2),
    ];
    for (name, old, new, count) in changed {
        let (_, text) = FILES.iter().find(|(file, _)| *file == name).unwrap();
        let text = text.replace(old, new);
        fs::write(folder.join(name), &text).unwrap();
        let memory = memory.clone().with(folder.join(name), text);
        let path = folder.join("worlds/mixed.toml");
        let (here, there) = (printed(&memory, &path), printed(&DiskFiles, &path));
        assert_eq!(here, there, "{new}");
        assert!((1..=count).contains(&here.len()), "{here:#?}");
        both("memory-mistakes", &FILES);
    }
    let nowhere = folder.join("worlds/nothing.toml");
    let (here, there) = (printed(&memory, &nowhere), printed(&DiskFiles, &nowhere));
    let before_reason = |printed: &[String]| printed[0].split(": ").next().unwrap().to_owned();
    assert_eq!(before_reason(&here), before_reason(&there), "the system gives the reason");
}
