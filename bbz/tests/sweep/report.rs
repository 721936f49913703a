//! `bbz sweep report`: curves, maps and the runs at both ends, as HTML.

use std::collections::BTreeMap;

use bittybuzz_live::sha256;

use crate::support::Folder;

use super::succeeds;

/// A swarm whose counter says the values of both globals and the seed apart.
const SCENARIO: &str = "[world]\nsize = [500, 500]\nduration = 2\n\
    [[robots]]\nname = \"walkers\"\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 3\n\
    [[measure]]\nname = \"total\"\nvalue = \"sum(global.n)\"\n\
    [[measure]]\nname = \"high\"\nvalue = \"mean(global.n)\"\nabove = 55\nat = \"end\"\n\
    [[measure]]\nname = \"when\"\nvalue = \"sum(global.n)\"\nabove = 120\n\
    [sweep]\nseeds = 3\nchance = \"common\"\n\
    [[sweep.parameter]]\nkey = \"robots.walkers.globals.G\"\nvalues = [1, 2, 4]\n\
    [[sweep.parameter]]\nkey = \"robots.walkers.globals.H\"\nvalues = [0, 5]\n\
    [[sweep.parameter]]\nkey = \"robots.walkers.script\"\nname = \"script\"\nvalues = [\"s.bzz\", \"a&<b>.bzz\"]\n";

const SCRIPT: &str =
    "n = 0\nG = 1\nH = 0\nfunction step() { n = n + G + H + math.rng.uniform(2) }\n";

fn planned(test: &str) -> Folder {
    let folder = Folder::with(test, "s.bzz", SCRIPT);
    folder.write("a&<b>.bzz", SCRIPT.replace("+ G", "+ G + 1"));
    folder.write("s.toml", SCENARIO);
    succeeds(&folder, &["sweep", "plan", "s.toml", "--chunk", "10"]);
    folder
}

fn study(test: &str) -> Folder {
    let folder = planned(test);
    succeeds(&folder, &["sweep", "run", "s.sweep"]);
    folder
}

/// Returns the text between two texts.
fn between<'a>(text: &'a str, from: &str, to: &str) -> &'a str {
    let (_, rest) = text.split_once(from).unwrap_or_else(|| panic!("no {from}"));
    rest.split_once(to).unwrap_or_else(|| panic!("no {to} after {from}")).0
}

#[test]
fn numbers_are_those_of_the_table() {
    let folder = study("report_numbers");
    succeeds(&folder, &["sweep", "report", "s.sweep", "-o", "r.html"]);
    let html = String::from_utf8(folder.read("r.html")).unwrap();
    let table = succeeds(&folder, &["sweep", "merge", "s.sweep"]);
    let mut lines = table.lines();
    let columns: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at = |name: &str| columns.iter().position(|column| *column == name).unwrap();
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let mut totals: Vec<f64> = rows.iter().map(|row| row[at("total")].parse().unwrap()).collect();
    totals.sort_by(f64::total_cmp);
    assert_eq!(totals.len(), 36);
    // 36 runs: the median is between the 18th and the 19th.
    let median = (totals[17] + totals[18]) / 2.0;
    let row = between(&html, ">total</a>", "</tr>");
    let cells: Vec<&str> = row.split("<td>").skip(1).collect();
    assert_eq!(cells[..2], ["36", "0"]);
    assert_eq!(cells[3].parse::<f64>().unwrap(), median);
    let ends = [cells[5], cells[6]].map(|cell| cell.parse::<f64>().unwrap());
    assert_eq!(ends, [totals[0], totals[35]]);
    let high = rows.iter().filter(|row| row[at("high")] == "1").count();
    assert!(
        between(&html, ">high</a>", "</tr>").contains(&format!("{:.1} % true", high as f64 / 0.36))
    );
    let missing = rows.iter().filter(|row| row[at("when")].is_empty()).count();
    assert!(between(&html, ">when</a>", "</tr>").starts_with(&format!("<td>36<td>{missing}<td>")));
    // The first run of those with the least total, by its command.
    let section = between(&html, "<h2 id=\"metric-2\">total</h2>", "<h2");
    let number = |total: f64| {
        rows.iter().position(|row| row[at("total")].parse::<f64>().unwrap() == total).unwrap()
    };
    assert!(
        section.contains(&format!("<code>bbz sweep view s.sweep {}</code>", number(totals[0])))
    );
    // A curve for each number, a map for each pair, and a table of the texts.
    assert_eq!(section.matches("<svg").count(), 2 + 3);
    for (script, rows) in by_script(&rows, at("script")) {
        let cells = between(
            section,
            &format!("<tr><td>{}<td>", script.replace("&<b>", "&amp;&lt;b&gt;")),
            "</tr>",
        );
        assert!(cells.starts_with(&format!("{rows}<td>0<td>")), "{cells}");
    }
    assert!(!html.contains("a&<b>"));
    assert!(!html.contains("<script") && html.ends_with("</html>\n"));
}

fn by_script<'a>(rows: &[Vec<&'a str>], column: usize) -> BTreeMap<&'a str, usize> {
    let mut counts = BTreeMap::new();
    rows.iter().for_each(|row| *counts.entry(row[column]).or_default() += 1);
    counts
}

#[test]
fn metrics_and_parameters_are_chosen() {
    let folder = study("report_chosen");
    let html =
        succeeds(&folder, &["sweep", "report", "s.sweep", "--metric", "sent", "--parameter", "G"]);
    assert_eq!((html.matches("<h2").count(), html.matches("<svg").count()), (1, 1));
    assert!(html.contains("<code>script</code>"), "the parameters of no picture are named");
    let unknown = folder.bbz(&["sweep", "report", "s.sweep", "--metric", "totl"]);
    unknown.fails_with(3, &["no metric `totl`", "total"]);
    let unknown = folder.bbz(&["sweep", "report", "s.sweep", "--parameter", "F"]);
    unknown.fails_with(3, &["no parameter `F`", "G, H, script"]);
    let inside = folder.bbz(&["sweep", "report", "s.sweep", "-o", "s.sweep/r.html"]);
    inside.fails_with(3, &["in the folder of the sweep"]);
    // No result takes the place of a file of the user.
    for (command, file) in
        [("report", "s.toml"), ("report", "a&<b>.bzz"), ("merge", "s.bzz"), ("merge", "s.toml")]
    {
        let before = folder.read(file);
        folder.bbz(&["sweep", command, "s.sweep", "-o", file]).fails_with(3, &[file]);
        assert_eq!(folder.read(file), before, "{command} {file}");
    }
}

#[test]
fn a_sweep_that_is_not_finished_says_so() {
    let folder = planned("report_begun");
    let html = succeeds(&folder, &["sweep", "report", "s.sweep"]);
    assert!(html.contains("0 of 36 runs are finished, 36 are not finished"), "{html}");
    succeeds(&folder, &["sweep", "run", "s.sweep", "--chunk", "2-3"]);
    let html = succeeds(&folder, &["sweep", "report", "s.sweep"]);
    assert!(html.contains("16 of 36 runs are finished, 20 are not finished"), "{html}");
}

#[test]
fn runs_that_could_not_go_on_are_listed() {
    // In this world, six robots of ten have room.
    let folder = Folder::with("report_failed", "s.bzz", "function step() { forward() }\n");
    folder.write(
        "s.toml",
        "[world]\nsize = [120, 120]\nduration = 1\n\
        [[robots]]\nname = \"w\"\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 1\n\
        [sweep]\nseeds = 2\nchance = \"common\"\n[[sweep.parameter]]\nkey = \"robots.w.count\"\nvalues = [1, 2, 60]\n\
        [output]\nplot = [\"x\"]\n",
    );
    succeeds(&folder, &["sweep", "plan", "s.toml"]);
    assert_eq!(folder.bbz(&["sweep", "run", "s.sweep"]).status, Some(1));
    let html = succeeds(&folder, &["sweep", "report", "s.sweep"]);
    assert!(html.contains("6 of 6 runs are finished, 2 of them could not go on"), "{html}");
    assert_eq!(between(&html, "could not go on</h2>", "</ul>").matches("<li>").count(), 2);
}

/// Makes the rows of a sweep those of another program.
fn change_program(folder: &Folder) -> [String; 2] {
    let plan = String::from_utf8(folder.read("s.sweep/plan.json")).unwrap();
    let own = plan.split('"').nth(5).unwrap().to_owned();
    let other = format!("{} 0123456789abcdef", env!("CARGO_PKG_VERSION"));
    for file in std::fs::read_dir(folder.path("s.sweep")).unwrap() {
        let name = format!("s.sweep/{}", file.unwrap().file_name().to_str().unwrap());
        let text = String::from_utf8(folder.read(&name)).unwrap().replace(&own, &other);
        let text = match text.rsplit_once("sha256 ") {
            Some((rows, _)) => format!("{rows}sha256 {}\n", sha256(rows.as_bytes())),
            None => text,
        };
        folder.write(&name, text);
    }
    [own, other]
}

/// A study may be years old.
#[test]
fn rows_of_another_program_are_reported() {
    let folder = study("report_program");
    let html = succeeds(&folder, &["sweep", "report", "s.sweep"]);
    let [own, other] = change_program(&folder);
    let report = folder.bbz(&["sweep", "report", "s.sweep"]);
    assert_eq!(report.status, Some(0), "{}", report.stderr);
    assert!(report.stdout == html.replace(&own, &other));
    assert!(report.stderr.starts_with("warning: "), "{}", report.stderr);
    assert!([&own, &other].iter().all(|name| report.stderr.contains(*name)), "{}", report.stderr);
    // Rows of two programs are never mixed.
    folder.bbz(&["sweep", "run", "s.sweep"]).fails_with(3, &[&other, "not mixed"]);
}
