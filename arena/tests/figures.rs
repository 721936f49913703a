//! Figures are XML, and show the numbers that they are given.

use bittybuzz_arena::output::{CURVES_MAX, CurvePoint, Figure, Panel};
use roxmltree::{Document, Node};

fn figure(curves: Vec<Vec<CurvePoint>>) -> Figure {
    let names = (0..curves.len()).map(|number| format!("value {number}")).collect();
    let panel = |label: &str| Panel {
        y_label: label.to_owned(),
        caption: "Median <of> some & \"others\" \u{1}".to_owned(),
        curves: curves.clone(),
    };
    Figure {
        x_label: "time in s".to_owned(),
        parameter: Some("GROUP".to_owned()),
        curves: names,
        panels: vec![panel("x in mm"), panel("y in mm")],
        has_marks: false,
    }
}

fn point(x: f64, median: f64) -> CurvePoint {
    CurvePoint { x, quartiles: Some([median - 1.0, median, median + 1.0]) }
}

fn texts(document: &Document<'_>) -> Vec<String> {
    let texts = document.descendants().filter(|node| node.has_tag_name("text"));
    texts.map(|node| node.text().unwrap_or("").to_owned()).collect()
}

/// Returns the lines of the medians, and those of the legend.
fn lines<'a>(document: &'a Document<'a>) -> Vec<Node<'a, 'a>> {
    let lines = document.descendants().filter(|node| node.has_attribute("stroke-dasharray"));
    lines.collect()
}

#[test]
fn each_panel_has_each_curve_and_its_band() {
    let curve = |shift: f64| (0..20).map(|n| point(f64::from(n), f64::from(n) + shift)).collect();
    let text = figure(vec![curve(0.0), curve(5.0), curve(9.0)]).draw();
    let document = Document::parse(&text).unwrap();
    let texts = texts(&document);
    for label in ["x in mm", "y in mm", "time in s", "GROUP", "value 0", "value 1", "value 2"] {
        assert_eq!(texts.iter().filter(|text| *text == label).count(), 1, "{label}");
    }
    assert_eq!(texts.iter().filter(|text| text.starts_with("Median <of> some")).count(), 2);
    // Three curves in two panels, and the legend.
    assert_eq!(lines(&document).len(), 3 * 2 + 3);
    let bands = document.descendants().filter(|node| node.has_attribute("fill-opacity"));
    assert_eq!(bands.count(), 3 * 2);
}

#[test]
fn every_curve_has_a_look_of_its_own() {
    let curve = vec![point(0.0, 0.0), point(1.0, 1.0)];
    let text = figure(vec![curve; CURVES_MAX]).draw();
    let document = Document::parse(&text).unwrap();
    let look = |node: &Node<'_, '_>| {
        ["stroke", "stroke-dasharray"].map(|name| node.attribute(name).unwrap().to_owned())
    };
    let mut looks: Vec<_> = lines(&document).iter().map(look).collect();
    looks.sort();
    looks.dedup();
    assert_eq!(looks.len(), CURVES_MAX);
    // On a print without colors, dashes tell apart the seven first ones.
    let mut dashes: Vec<_> =
        lines(&document)[..7].iter().map(|node| look(node)[1].clone()).collect();
    dashes.sort();
    dashes.dedup();
    assert_eq!(dashes.len(), 7);
}

#[test]
fn a_missing_point_is_a_gap_and_a_lonely_one_a_dot() {
    let gap = |x: f64| CurvePoint { x, quartiles: None };
    let curve = vec![
        point(0.0, 1.0),
        point(1.0, 2.0),
        gap(2.0),
        point(3.0, 2.0),
        gap(4.0),
        point(5.0, 2.0),
        point(6.0, f64::INFINITY),
    ];
    let mut figure = figure(vec![curve]);
    figure.panels.truncate(1);
    figure.parameter = None;
    let text = figure.draw();
    let document = Document::parse(&text).unwrap();
    let [line] = lines(&document)[..] else { panic!("{text}") };
    assert_eq!(line.attribute("d").unwrap().matches(['M', 'L']).count(), 2);
    let dots = document.descendants().filter(|node| node.has_tag_name("circle"));
    assert_eq!(dots.count(), 2);
}

#[test]
fn figures_of_odd_numbers_are_xml() {
    let curves = [
        vec![],
        vec![CurvePoint { x: 0.0, quartiles: None }],
        vec![CurvePoint { x: f64::NAN, quartiles: Some([f64::NAN; 3]) }],
        vec![CurvePoint { x: 0.0, quartiles: Some([f64::NEG_INFINITY, 0.0, f64::INFINITY]) }],
        vec![point(-1e300, -1e300), point(1e300, 1e300)],
        vec![point(5.0, 1e-300)],
        (0..100_000).map(|n| point(f64::from(n), 1e9)).collect(),
    ];
    for curve in curves {
        let mut figure = figure(vec![curve]);
        figure.parameter = Some("a".repeat(1000));
        figure.curves = vec!["ü".repeat(1000)];
        let text = figure.draw();
        Document::parse(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
        assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
        assert!(text.len() < 200_000);
    }
}
