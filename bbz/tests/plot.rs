//! `bbz plot`: figures of tables. python/tests compares quartiles with NumPy, and reads tables of other programs.

use std::path::Path;

use roxmltree::{Document, Node};

use crate::support::Folder;

const SCENARIO: &str = r#"
[world]
size = [1000, 1000]
duration = 3

[[robots]]
name = "walkers"
robot = "kilobot"
script = "s.bzz"
count = 4
globals = { GROUP = 1 }

[[measure]]
name = "far"
value = "max(x)"

[output.data]
quantities = ["x", "global.n", "global.word", "mean(global.n)"]
every = 0.5
"#;

const SCRIPT: &str =
    "GROUP = 1\nn = 0\nword = \"on\"\nfunction step() { n = n + GROUP\n forward() }\n";

/// The tables of two runs each of three values of a parameter.
fn study(test: &str) -> Folder {
    let folder = Folder::with(test, "s.toml", SCENARIO);
    folder.write("s.bzz", SCRIPT);
    let set = ["--set", "robots.walkers.globals.GROUP=1,2,5", "--runs", "2"];
    let data = ["--data", "study", "--csv", "runs.csv"];
    let outcome = folder.bbz(&[&["sim", "s.toml", "--headless"], &set[..], &data[..]].concat());
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    folder
}

/// Returns the figure of a command line.
fn plot(folder: &Folder, arguments: &[&str]) -> String {
    let outcome = folder.bbz(&[&["plot"], arguments].concat());
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""), "{arguments:?}");
    outcome.stdout
}

fn texts<'a>(document: &'a Document<'a>) -> Vec<&'a str> {
    let texts = document.descendants().filter(|node| node.has_tag_name("text"));
    texts.map(|node| node.text().unwrap_or("")).collect()
}

/// Returns the paths of the medians, and those of the legend after them.
fn lines<'a>(document: &'a Document<'a>) -> Vec<&'a str> {
    let lines = document.descendants().filter(|node| node.has_attribute("stroke-dasharray"));
    lines.map(|node| node.attribute("d").unwrap()).collect()
}

/// Returns the points of a path.
fn points(path: &str) -> Vec<[f64; 2]> {
    let points = path.trim_end_matches('Z').split(['M', 'L']).filter(|point| !point.is_empty());
    let point = |point: &str| {
        let (x, y) = point.split_once(' ').unwrap();
        [x, y].map(|number| number.parse().unwrap())
    };
    points.map(point).collect()
}

/// Returns the number that the vertical axis of a figure with one panel has at a place, by two of its
/// ticks.
fn value(document: &Document<'_>, y: f64) -> f64 {
    let tick = |node: Node<'_, '_>| {
        let at: f64 = node.attribute("y")?.parse().ok()?;
        // Numbers stand four points below their ticks.
        Some([at - 4.0, node.text()?.parse().ok()?])
    };
    let ticks = document.descendants().filter(|node| node.attribute("text-anchor") == Some("end"));
    let ticks: Vec<[f64; 2]> = ticks.filter_map(tick).collect();
    let [first, .., last] = ticks[..] else { panic!("{ticks:?}") };
    first[1] + (y - first[0]) / (last[0] - first[0]) * (last[1] - first[1])
}

#[test]
fn a_study_becomes_curves_with_labels() {
    let folder = study("plot_study");
    let text = plot(&folder, &["study", "mean(global.n)", "x", "--by", "GROUP"]);
    let document = Document::parse(&text).unwrap();
    let texts = texts(&document);
    for text in [
        "mean(global.n)",
        "x in mm",
        "time in s",
        "GROUP",
        "Median and quartiles of 2 runs each",
        "Median and quartiles of 8 robots in 2 runs each",
    ] {
        assert_eq!(texts.iter().filter(|found| **found == text).count(), 1, "{text}: {texts:?}");
    }
    let legend: Vec<&&str> = texts.iter().filter(|text| ["1", "2", "5"].contains(text)).collect();
    assert!(legend.len() >= 3);
    // Three curves in two panels, and the legend. From 0 to 3 s, twice a second; before the first step a global is nil.
    let lines = lines(&document);
    assert_eq!(lines.len(), 3 * 2 + 3);
    assert_eq!(points(lines[0]).len(), 6);
    assert_eq!(points(lines[3]).len(), 7);
    // The name of a column is as good.
    let same = plot(&folder, &["study", "mean(global.n)", "x_tenths_mm", "--by", "GROUP"]);
    assert_eq!(same, text);
    let outcome = folder.bbz(&["plot", "study", "x", "-o", "x.svg"]);
    outcome.succeeds_with("");
    let text = String::from_utf8(folder.read("x.svg")).unwrap();
    let caption = "Median and quartiles of 24 robots in 6 runs, of all values of GROUP";
    assert!(text.contains(caption), "{text}");
    let by_robot = plot(&folder, &["study", "x", "--by", "robot"]);
    assert!(by_robot.contains("of 6 robots in 6 runs each, of all values of GROUP"), "{by_robot}");
    assert!(plot(&folder, &["study", "x", "--by", "seed"]).contains(">seed<"));
}

#[test]
fn numbers_of_runs_stand_against_a_parameter() {
    let folder = study("plot_runs");
    let from_folder = plot(&folder, &["study", "far", "success", "--x", "GROUP"]);
    let document = Document::parse(&from_folder).unwrap();
    let found = texts(&document);
    for text in ["far", "success", "GROUP"] {
        assert!(found.contains(&text), "{text}: {found:?}");
    }
    assert_eq!(
        found.iter().filter(|text| **text == "Median and quartiles of 2 runs each").count(),
        2
    );
    let dots = document.descendants().filter(|node| node.has_tag_name("circle"));
    assert_eq!(dots.count(), 3 * 2);
    // The table of --csv has the same numbers, and its only parameter is clear.
    assert_eq!(plot(&folder, &["runs.csv", "far", "success"]), from_folder);
    let by = plot(&folder, &["runs.csv", "far", "--x", "seed", "--by", "GROUP"]);
    assert_eq!(lines(&Document::parse(&by).unwrap()).len(), 3 + 3);
    folder.write(
        "some.csv",
        "seed,GROUP,success,since.all\r\n1,3,1,5\r\n2,3,1,\r\n3,3,0,\r\n4,9,1,7\r\n5,9,1,8\r\n",
    );
    let text = plot(&folder, &["some.csv", "since.all"]);
    let sentence = "Median and quartiles of 1 to 2 runs each; 2 runs without a value are left out";
    assert!(text.contains(sentence) && text.contains(">since.all in s<"), "{text}");
}

/// numpy.quantile([1, 2, 4, 8], [0.25, 0.5, 0.75]) is [1.75, 3, 5].
#[test]
fn quartiles_are_those_of_numpy() {
    let folder = Folder::new("plot_quartiles");
    let rows: Vec<String> = [4, 1, 8, 2]
        .iter()
        .enumerate()
        .flat_map(|(robot, x)| [format!("0,0,{robot},{x}0\r\n"), format!("0,10,{robot},{x}0\r\n")])
        .collect();
    folder.write("run.csv", format!("run,tick,robot,x_tenths_mm\r\n{}", rows.concat()));
    let text = plot(&folder, &["run.csv", "x"]);
    let document = Document::parse(&text).unwrap();
    assert!(texts(&document).contains(&"Median and quartiles of 4 robots"), "{text}");
    let median = points(lines(&document)[0])[0][1];
    assert!((value(&document, median) - 3.0).abs() < 0.02, "{text}");
    let band = document.descendants().find(|node| node.has_attribute("fill-opacity")).unwrap();
    let band = points(band.attribute("d").unwrap());
    for (place, expected) in [(0, 1.75), (1, 1.75), (2, 5.0), (3, 5.0)] {
        let found = value(&document, band[place][1]);
        assert!((found - expected).abs() < 0.02, "{found}, not {expected}: {text}");
    }
}

#[test]
fn missing_values_leave_a_gap_and_runs_that_have_ended_are_left_out() {
    let folder = Folder::new("plot_gap");
    let row = |run: u32, tick: u32, value: &str| format!("{run},{tick},1,{value}\r\n");
    let mut table = "run,tick,robot,global.n\r\n".to_owned();
    for tick in [0, 10, 20, 30, 40, 50] {
        for run in 0..3 {
            // Run 2 has ended after 3 s, and at 2 s no run has a value.
            match (run, tick) {
                (2, 40..) => {}
                (_, 20) => table += &row(run, tick, ""),
                _ => table += &row(run, tick, &(run + tick).to_string()),
            }
        }
    }
    folder.write("run.csv", table);
    let text = plot(&folder, &["run.csv", "global.n"]);
    let document = Document::parse(&text).unwrap();
    let lines = lines(&document);
    assert_eq!(lines.iter().map(|line| points(line).len()).collect::<Vec<_>>(), [2, 3]);
    let found = texts(&document);
    let caption =
        "Median and quartiles of 2 to 3 robots in 3 runs: those that have a value at the time";
    assert!(found.contains(&caption), "{found:?}");
    // Of the two runs that still go on, 50 and 51.
    let last = points(lines[1])[2][1];
    assert!((value(&document, last) - 50.5).abs() < 0.3, "{text}");
}

#[test]
fn messages_name_the_table_and_the_remedy() {
    let folder = study("plot_messages");
    std::fs::create_dir(folder.path("empty")).unwrap();
    let fails = |arguments: &[&str], expected: &str| {
        let outcome = folder.bbz(&[&["plot"], arguments].concat());
        assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(3), expected), "{arguments:?}");
    };
    fails(&["nowhere", "x"], "error: there is no file `nowhere`\n");
    fails(
        &["empty", "x"],
        "error: `empty` has no tables\nhelp: name the folder that `bbz sim --data` wrote; while a run \
         goes on, its first tables come after at most a minute\n",
    );
    fails(
        &["study/robots", "x"],
        "error: `study/robots` is a single table\nhelp: name the folder of all tables: `study`\n",
    );
    fails(
        &["study", "global.m"],
        "error: `study` has no quantity `global.m`\nhelp: did you mean `global.n`? it has `x`, \
         `global.n`, `global.word` and `mean(global.n)`; `quantities` in [output.data] of the \
         scenario chooses those over time\n",
    );
    fails(
        &["study", "far"],
        "error: `study` has no quantity `far`\nhelp: it is a number of each run: draw it against a \
         parameter with --x PARAMETER\n",
    );
    fails(
        &["study", "x", "--x", "GROUP"],
        "error: `study` has no quantity `x`\nhelp: it is a quantity over time: leave out --x\n",
    );
    fails(
        &["study", "x", "--by", "GROPU"],
        "error: `study` has no parameter `GROPU`\nhelp: did you mean `GROUP`? it has `GROUP`, `seed`, \
         `run` and `robot`\n",
    );
    fails(
        &["study", "global.word"],
        "error: `global.word` has no number in `study/robots`\nhelp: name a quantity with numbers\n",
    );
    fails(
        &["study", "x", "-o", "x.png"],
        "error: `x.png` would be no SVG\nhelp: name `x.svg`; browsers, Inkscape and LaTeX's package \
         svg convert it\n",
    );
    fails(
        &["runs.csv", "far", "-o", "runs.csv"],
        "error: `runs.csv` is read by this command, and would be replaced\nhelp: name another file\n",
    );
    fails(
        &["runs.csv", "far", "--by", "GROUP"],
        "error: the runs of `runs.csv` have no parameter\n\
         help: vary one with `--set KEY=V1,V2` or [sweep], or choose --x seed\n",
    );
    folder.write("words.csv", "seed,rule,success\r\n1,voter,1\r\n");
    fails(
        &["words.csv", "success"],
        "error: the values of `rule` are no numbers: `voter`\nhelp: --by rule draws a curve for each\n",
    );
    let robots = "run,tick,robot,x_tenths_mm,state\r\n0,0,1,5,running\r\n";
    folder.write("run.csv", robots);
    fails(
        &["run.csv", "state"],
        "error: cannot read `run.csv`: column `state` has the text `running`\n\
         help: name a quantity with numbers\n",
    );
    fails(
        &["run.csv", "x", "--by", "GROUP"],
        "error: `run.csv` has no table of runs, and so no parameters\nhelp: name a folder of `bbz sim \
         --data`, whose last table has the runs, or a file of `--csv`\n",
    );
    folder.write("run.csv", "run,tick,robot,x_tenths_mm\r\n");
    fails(
        &["run.csv", "x"],
        "error: `x` has no number in `run.csv`\nhelp: name a quantity with numbers\n",
    );
    folder.write("run.csv", "run,tick,robot,x_tenths_mm\r\n0,0,1,5\r\n0,10,1,");
    fails(
        &["run.csv", "x"],
        "error: cannot read `run.csv`: it ends in the middle of a line\nhelp: wait until the command \
         that writes it has ended; if it has, simulate again\n",
    );
    folder.write("run.csv", "run,tick,robot,x_tenths_mm\r\n0,,1,5\r\n");
    fails(
        &["run.csv", "x"],
        "error: `run.csv` has a row without `tick`\nhelp: simulate again with `bbz sim`\n",
    );
    let rows: String = (0..15).map(|robot| format!("0,0,{robot},5\r\n")).collect();
    folder.write("run.csv", format!("run,tick,robot,x_tenths_mm\r\n{rows}"));
    fails(
        &["run.csv", "x", "--by", "robot"],
        "error: `robot` has 15 values, and a figure shows at most 14 curves\n\
         help: leave out --by: median and quartiles show all of them\n",
    );
}

#[test]
fn tables_that_are_being_written_have_a_message() {
    let folder = study("plot_unfinished");
    let file = "study/robots/00000.parquet";
    let rename = |from: &str, to: &str| {
        std::fs::rename(folder.path(from), folder.path(to)).unwrap();
    };
    for number in 1..6 {
        std::fs::remove_file(folder.path(&format!("study/robots/{number:05}.parquet"))).unwrap();
    }
    // The other runs are not there yet, and the figure has those that are.
    let text = plot(&folder, &["study", "x", "--by", "GROUP"]);
    assert!(text.contains("Median and quartiles of 4 robots"), "{text}");
    rename(file, "study/robots/00000.parquet.unfinished-bbz-a1B2c3D4");
    let outcome = folder.bbz(&["plot", "study", "x"]);
    outcome.fails_with(3, &["`study/robots` has no complete file", "at most a minute"]);
    // The parameters of runs without a row are unknown.
    rename("study/robots/00000.parquet.unfinished-bbz-a1B2c3D4", file);
    std::fs::remove_file(folder.path("study/runs/00000.parquet")).unwrap();
    let outcome = folder.bbz(&["plot", "study", "x", "--by", "GROUP"]);
    outcome.fails_with(3, &["1 run of `study` not in the table of runs", "`x` has no number"]);
}

/// The library for Parquet panics at some of these files, which is no defect of `bbz`.
#[test]
fn damaged_tables_are_errors_and_no_defects() {
    let folder = study("plot_damaged");
    let file = "study/swarm/00000.parquet";
    let whole = folder.read(file);
    let mut damaged: Vec<Vec<u8>> =
        (0..whole.len()).step_by(29).map(|n| whole[..n].to_vec()).collect();
    damaged.extend((0..whole.len()).step_by(7).map(|place| {
        let mut bytes = whole.clone();
        bytes[place] ^= 1 << (place % 8);
        bytes
    }));
    let mut errors = 0;
    for bytes in damaged {
        folder.write(file, &bytes);
        let outcome = folder.bbz(&["plot", "study", "mean(global.n)"]);
        match outcome.status {
            Some(0) => assert_eq!(outcome.stderr, ""),
            Some(3) => {
                outcome.reports(&["error: ", "`study", "help: "]);
                assert!(!outcome.stderr.contains("defect"), "{}", outcome.stderr);
                errors += 1;
            }
            other => panic!("{other:?}: {}", outcome.stderr),
        }
    }
    assert!(errors > whole.len() / 29, "{errors} errors");
}

/// The commands of docs/data.md, with fewer and shorter runs.
#[test]
fn the_commands_of_the_book_draw_the_opinion_curve() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folder = Folder::new("plot_book");
    std::fs::create_dir_all(folder.path("examples/study")).unwrap();
    for name in ["examples/study/best_of_n.toml", "examples/study/best_of_n.bzz"] {
        folder.write(name, std::fs::read(root.join(name)).unwrap());
    }
    let page = std::fs::read_to_string(root.join("docs/data.md")).unwrap();
    let (_, section) = page.split_once("\n## Figures\n").unwrap();
    let commands: Vec<&str> =
        section.lines().filter_map(|line| line.strip_prefix("$ bbz ")).collect();
    // The command that simulates, and the two that keep the tables.
    assert_eq!(commands.len(), 3, "{commands:?}");
    let mut figures = Vec::new();
    for command in commands {
        let short = command.replace("--runs 30", "--runs 3 --set world.duration=60");
        // Every second piece is in quotes.
        let pieces = short.split('"').enumerate().flat_map(|(number, piece)| match number % 2 {
            0 => piece.split_whitespace().collect(),
            _ => vec![piece],
        });
        let outcome = folder.bbz(&pieces.collect::<Vec<&str>>());
        assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
        if command.ends_with("-o opinion.svg") {
            figures.push(String::from_utf8(folder.read("opinion.svg")).unwrap());
        }
    }
    let [one, text] = &figures[..] else { panic!("{} figures", figures.len()) };
    assert_eq!(one, text);
    let document = Document::parse(text).unwrap();
    assert!(texts(&document).contains(&"Median and quartiles of 3 runs"), "{text}");
    // Every 10 s; at the start the scripts have not run.
    assert_eq!(points(lines(&document)[0]).len(), 6);
}

/// A figure of runs that are simulated for it is that of the tables of the same runs.
#[test]
fn a_scenario_is_simulated_for_its_figure() {
    let folder =
        Folder::with("plot_scenario", "s.bzz", "n = 0\nG = 1\nfunction step() { n = n + G }\n");
    folder.write(
        "s.toml",
        "[world]\nsize = [300, 300]\nduration = 5\n\
        [[robots]]\nname = \"w\"\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 3\n\
        [[measure]]\nname = \"total\"\nvalue = \"sum(global.n)\"\n",
    );
    let set = ["--runs", "4", "--set", "robots.w.globals.G=1,3"];
    let figure = |words: &[&str], name: &str| {
        let outcome = folder.bbz(&[&["plot"], words, &["-o", name]].concat());
        outcome.succeeds_with("");
        String::from_utf8(folder.read(name)).unwrap()
    };
    let quantity = "mean(global.n)";
    let one = figure(&[&["s.toml", quantity, "--by", "G"], &set[..]].concat(), "one.svg");
    let quantities = format!("output.data.quantities=[\"{quantity}\"]");
    let words = ["sim", "s.toml", "--headless", "--data", "study", "--set", &*quantities];
    assert_eq!(folder.bbz(&[&words[..], &set].concat()).status, Some(0));
    assert_eq!(one, figure(&["study", quantity, "--by", "G"], "two.svg"));
    assert!(one.contains("Median and quartiles of 4 runs each"), "{one}");
    // Numbers of runs against a parameter.
    let one = figure(&[&["s.toml", "total", "--x", "G"], &set[..]].concat(), "three.svg");
    assert_eq!(
        folder.bbz(&[&["sim", "s.toml", "--csv", "runs.csv"], &set[..]].concat()).status,
        Some(0)
    );
    assert_eq!(one, figure(&["runs.csv", "total", "--x", "G"], "four.svg"));
    // Mistakes come before the runs, and name the files of the user.
    folder
        .bbz(&["plot", "s.toml", "totl", "--x", "G"])
        .fails_with(3, &["`s.toml`", "`totl`", "`total`"]);
    folder.bbz(&["plot", "s.toml", "meen(x)"]).fails_with(2, &["no quantity `meen(x)`"]);
    folder
        .bbz(&["plot", "study", quantity, "--runs", "3"])
        .fails_with(3, &["`study` has tables already"]);
    for file in ["s.toml", "s.bzz"] {
        let before = folder.read(file);
        folder.bbz(&["plot", "s.toml", quantity, "-o", file]).fails_with(3, &[file]);
        assert_eq!(folder.read(file), before, "{file}");
    }
    let unknown = folder.bbz(&["plot", "s.toml", quantity, "--by", "H", "--runs", "2"]);
    unknown.fails_with(3, &["`s.toml` has no parameter `H`"]);
}
