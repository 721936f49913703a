//! Pictures are XML and show what they should; tables are CSV; the same seed gives the same run.

use crate::script::{folder, read, run_with};
use bittybuzz_arena::output::recording::RecordingWriter;
use bittybuzz_arena::output::{History, Movie, RunRow, RunTable, chart, recorder, trajectories};

const WALK: &str = "math.rng.setseed(id)\nn = 0\nfunction step() { n = n + 1\n\
    if(rand() % 3 == 0) left() else forward()\nneighbors.broadcast(\"n\", n) led(n % 8) }\n\
    function init() { neighbors.listen(\"n\", function(t, v, r) { heard = v }) }\nheard = nil\n";

fn world(count: u32) -> String {
    format!(
        "[world]\nsize = [800, 600]\nduration = 5\nseed = 3\nobstacles = [{{ at = [200, 0], radius = 30 }},\n\
         {{ at = [-200, 0], size = [40, 90] }}, {{ at = [-200, 200], size = [40, 90], heading = 30 }},\n\
         {{ from = [0, 100], to = [50, 200] }}]\nlights = [[10, 20]]\n\
         ground = [{{ at = [-300, -200], size = [60, 300], heading = -20 }}, {{ at = [0, 0], radius = 50, brightness = 0.5 }}]\n\
         [[robots]]\nrobot = \"kilobot\"\nscript = \"walk.bzz\"\ncount = {count}\n\
         [output]\nplot = [\"global.heard\", \"x\"]\n"
    )
}

#[test]
fn pictures_are_xml() {
    let folder = folder("pictures", &[("walk.bzz", WALK)]);
    for count in [1, 20, 60] {
        let mut history = History::default();
        run_with(&folder, &world(count), 1, |simulation| history.sample(simulation));
        let (scenario, _) = read(&folder, &world(count));
        let picture = trajectories(&scenario.world, &history);
        let document = roxmltree::Document::parse(&picture).unwrap();
        let circles = document.descendants().filter(|node| node.has_tag_name("circle")).count();
        // Start and end of each robot, a lamp, a disc, painted ground.
        assert_eq!(circles, 2 * count as usize + 3);
        // In SVG a positive angle is clockwise. The world is drawn with 900 / 800 of its size, 10 from the rim, with y down.
        let turns: Vec<_> =
            document.descendants().filter_map(|node| node.attribute("transform")).collect();
        assert_eq!(turns, ["rotate(20 122.5 572.5)", "rotate(-30 235.0 122.5)"]);
        for ((quantity, _), values) in scenario.output.plot.iter().zip(&history.values) {
            let picture = chart(&quantity.to_string(), &history.times, values);
            let document = roxmltree::Document::parse(&picture).unwrap();
            let curves = document.descendants().filter(|node| {
                node.has_tag_name("path") && node.attribute("stroke-width").is_some()
            });
            let expected = if count <= 50 { count as usize } else { 5 };
            assert!(curves.count() <= expected, "{quantity}");
            assert!(document.descendants().any(|node| node.text() == Some(&quantity.to_string())));
        }
    }
}

/// Returns the values of an animated attribute.
fn animated<'a>(node: roxmltree::Node<'a, '_>, attribute: &str) -> Vec<&'a str> {
    let animation = node.children().find(|child| {
        child.has_tag_name("animate") && child.attribute("attributeName") == Some(attribute)
            || child.has_tag_name("animateTransform") && child.attribute("type") == Some(attribute)
    });
    let values = animation.map(|animation| animation.attribute("values").unwrap());
    values.unwrap_or_default().split(';').collect()
}

#[test]
fn a_movie_has_the_places_of_each_robot() {
    let folder = folder("movie", &[("walk.bzz", WALK)]);
    let text = world(3)
        + "[[robots]]\nrobot = \"kilobot\"\nscript = \"walk.bzz\"\ncount = 1\npositions = [[300, 250]]\npresent = false\n[[event]]\nat = 2\njoin = 3\n";
    let mut movie = Movie::default();
    let mut places = Vec::new();
    let summary = run_with(&folder, &text, 1, |simulation| {
        if simulation.now().is_multiple_of(10) {
            movie.add(simulation);
            let place = |robot| simulation.view(robot).map(|view| [view.pose.x, view.pose.y]);
            places.push((0..4).map(place).collect::<Vec<_>>());
        }
    });
    drop(summary);
    let (scenario, _) = read(&folder, &text);
    let picture = movie.draw(&scenario.world, 2.0);
    let document = roxmltree::Document::parse(&picture).unwrap();
    let robots: Vec<_> = document
        .descendants()
        .filter(|node| {
            node.attribute("transform").is_some_and(|text| text.starts_with("translate"))
        })
        .collect();
    assert_eq!(robots.len(), 4);
    // The world is drawn with 900 / 800 of its size, 10 from the rim, with y down.
    let drawn = |[x, y]: [f32; 2]| {
        format!("{:.1} {:.1}", 10.0 + (x + 400.0) * 1.125, 10.0 + (300.0 - y) * 1.125)
    };
    for (robot, node) in robots.iter().enumerate() {
        let ways: Vec<String> = places.iter().filter_map(|frame| frame[robot]).map(drawn).collect();
        let shown = animated(*node, "translate");
        assert_eq!(shown.len(), places.len());
        assert!(
            shown.iter().rev().zip(ways.iter().rev()).all(|(one, other)| one == other),
            "{shown:?}"
        );
    }
    let is_hidden = |node: &roxmltree::Node<'_, '_>| node.attribute("visibility") == Some("hidden");
    assert_eq!(robots.iter().map(is_hidden).collect::<Vec<_>>(), [false, false, false, true]);
    assert_eq!(animated(robots[3], "visibility"), ["hidden", "visible"]);
    // Half of five seconds from the first frame to the last one.
    let dur = robots[0].children().find_map(|child| child.attribute("dur")).unwrap();
    let seconds = (places.len() - 1) as f64 / 2.0;
    assert_eq!(dur, format!("{seconds:.3}s"));

    let mut still = Movie::default();
    run_with(&folder, &text, 1, |simulation| {
        if simulation.now() == 10 {
            still.add(simulation);
        }
    });
    let picture = still.draw(&scenario.world, 1.0);
    assert!(!picture.contains("animate"), "{picture}");
    assert_eq!(picture.matches("<g transform").count(), 3);
    roxmltree::Document::parse(&Movie::default().draw(&scenario.world, 1.0)).unwrap();
}

#[test]
fn charts_of_odd_values_are_xml() {
    for values in [
        vec![],
        vec![vec![]],
        vec![vec![None, None]; 3],
        vec![vec![Some(f64::NAN), Some(f64::INFINITY)]; 3],
        vec![vec![Some(1e300), Some(-1e300)]; 3],
        vec![vec![Some(7.0); 60]; 3],
    ] {
        let picture =
            chart("a < b & \"c\" \u{1}", &[0.0, 1.0, 2.0][..values.len().min(3)], &values);
        roxmltree::Document::parse(&picture).unwrap_or_else(|error| panic!("{error}\n{picture}"));
    }
}

#[test]
fn tables_are_csv() {
    let table = RunTable {
        parameters: vec!["robots.0.script".to_owned()],
        metrics: vec!["since.3".to_owned(), "mean distance(1, 2)".to_owned()],
        rows: vec![
            RunRow {
                seed: 1,
                parameters: ["a,\"b\"".to_owned()].into(),
                metrics: vec![Some(1.5), None],
                digest: Some(0xabc),
                error: None,
            },
            RunRow {
                seed: 2,
                parameters: [String::new()].into(),
                metrics: vec![Some(0.0), None],
                digest: None,
                error: Some("no, room".to_owned()),
            },
        ],
    };
    // RFC 4180: cells with commas or quotes are quoted, quotes doubled, lines end in CR LF.
    assert_eq!(
        table.to_csv(),
        "seed,robots.0.script,since.3,\"mean distance(1, 2)\",digest,error\r\n\
         1,\"a,\"\"b\"\"\",1.5,,0000000000000abc,\r\n2,,0,,,\"no, room\"\r\n"
    );
}

/// A recording of every tick, and the summary.
fn trace(threads: usize, seed: u32) -> (Vec<u8>, String) {
    let folder = folder("same", &[("walk.bzz", WALK)]);
    let text = world(150).replace("seed = 3", &format!("seed = {seed}"));
    let mut samples = Vec::new();
    let mut header = None;
    let summary = run_with(&folder, &text, threads, |simulation| {
        header.get_or_insert_with(|| recorder::header(simulation));
        let (robots, movables) = (recorder::robots(simulation), recorder::movables(simulation));
        samples.push((simulation.now(), robots, movables));
    });
    let mut file = Vec::new();
    let mut writer = RecordingWriter::new(&mut file, &header.unwrap()).unwrap();
    for (tick, robots, movables) in samples {
        writer.write(tick, &robots, &movables).unwrap();
    }
    writer.finish().unwrap();
    (file, format!("{summary:?}"))
}

#[test]
fn the_same_seed_gives_the_same_run_on_any_number_of_threads() {
    let one = trace(1, 3);
    for threads in [1, 2, 3, 7] {
        assert!(trace(threads, 3) == one, "{threads} threads");
    }
    assert!(trace(1, 4) != one);
}
