//! Compares what docs/flight.md says of flights with fresh numbers with the figures that `cargo xtask
//! soak flights` keeps. `UPDATE_DOCS=1 cargo test --locked -p bittybuzz-book` writes the page again.

use crate::generated::{check, path};
use crate::performance::number;
use fs_err as fs;
use toml::{Table, Value};

/// Sensors with the names of their three faults: stuck, noisy and silent.
const SENSORS: [(&str, &str); 4] =
    [("inertial sensors", "Imu"), ("poses", "Capture"), ("flow", "Flow"), ("range", "Range")];

/// Figures of the image's accuracy.
const LEGS: [&str; 5] = ["hover", "1 m", "3 m", "5 m", "square of 1 m"];
/// Disturbances with their names in docs/flight.md.
const DISTURBANCES: [(&str, &str); 12] = [
    ("none", "Calm"),
    ("side acceleration", "SideForce"),
    ("touches", "Bump"),
    ("wind with gusts", "Gusts"),
    ("poses displaced", "PoseJump"),
    ("room's frame turned", "FrameTurn"),
    ("markers turned", "MarkerTurn"),
    ("latency", "Latency"),
    ("floor steps", "FloorStep"),
    ("other flow noise", "QuietFlow"),
    ("other noise of poses", "PoseNoise"),
    ("other noise of ranges", "RangeNoise"),
];

/// Returns the values of a map in all items, such as those of `worst` with a name.
fn values<'a>(items: &'a Table, map: &'a str, name: &'a str) -> impl Iterator<Item = &'a Value> {
    items.values().filter_map(move |item| item[map].get(name))
}

fn sum(items: &Table, name: &str) -> i64 {
    values(items, "counts", name).filter_map(Value::as_integer).sum()
}

fn largest(items: &Table, name: &str) -> Option<f64> {
    values(items, "worst", name).filter_map(Value::as_float).reduce(f64::max)
}

/// Returns the values of a figure in all flights.
fn figures(items: &Table, name: &str) -> Vec<f64> {
    let flights = values(items, "figures", name).filter_map(Value::as_array).flatten();
    flights.filter_map(Value::as_float).collect()
}

fn image_text(items: &Table) -> String {
    let date = items.values().filter_map(|item| item["date"].as_str()).max().unwrap_or("never");
    let mut text = format!(
        "As far as they were flown (until {date}):\n\n\
         | Flight, error in mm rms | Seeds | Mean | Worst |\n|---|---|---|---|\n"
    );
    for name in LEGS {
        let figures = figures(items, &format!("mm rms, {name}"));
        if !figures.is_empty() {
            let mean = figures.iter().sum::<f64>() / figures.len() as f64;
            let worst = figures.iter().copied().fold(0.0, f64::max);
            text += &format!("| {name} | {} | {mean:.1} | {worst:.1} |\n", figures.len());
        }
    }
    let [early, landed, can_land] =
        ["end early", "land upright", "can land"].map(|name| sum(items, name));
    text += &format!("\n{landed} of {can_land} flights with a fault landed upright.\n");
    let off = "ms until motors are off after a fault of the inertial sensors, the bus or a reset";
    if let Some(ms) = largest(items, off) {
        text += &format!(
            "The motors were off within {ms} ms of a fault after which a robot falls: of the inertial sensors, of their bus, or a reset.\n"
        );
    }
    let [usual, most] = ["us to the compare registers, 99.9 %", "us to the compare registers"]
        .map(|name| largest(items, name));
    if let (Some(usual), Some(most)) = (usual, most) {
        text += &format!(
            "In five minutes of flight 99.9 % of the samples reached the motors within {usual} µs and all within {most} µs.\n"
        );
    }
    if !items.is_empty() {
        let missed = sum(items, "pulses unanswered before the next");
        let samples = number(sum(items, "samples") as f64);
        text += &format!(
            "In that flight and 1,000 s of an armed robot on the ground, {missed} of {samples} pulses were unanswered before the next one.\n"
        );
    }
    let apart = figures(items, "mm between the nearest robots");
    if let Some(least) = apart.iter().copied().reduce(f64::min) {
        text += &format!(
            "The robots of the exhibition stayed {least} mm or more apart in the {} of its seeds that were flown.\n",
            apart.len()
        );
    }
    if !items.keys().any(|name| name.starts_with("disturbances ")) {
        return text + "No flight under a disturbance is recorded yet.\n\n";
    }
    text += &format!(
        "\n{early} flights under disturbances ended early.\n\n\
         | Disturbance | Flights | Poses: mean, worst | Flights | Deck: mean, worst |\n|---|---|---|---|---|\n"
    );
    for (title, kind) in DISTURBANCES {
        let cells = ["MotionCapture", "FlowDeck"].map(|source| {
            let name = format!("{kind} with {source}");
            let flights = sum(items, &format!("flights, {name}"));
            match largest(items, &format!("mm of error, {name}")) {
                Some(worst) => {
                    let sum_mm = sum(items, &format!("sum of mm of error, {name}"));
                    format!("{flights} | {:.0}, {worst} mm", sum_mm as f64 / flights as f64)
                }
                None => " | ".to_owned(),
            }
        });
        text += &format!("| {title} | {} |\n", cells.join(" | "));
    }
    text + "\n"
}

#[test]
fn flights_are_those_of_the_recorded_figures() {
    let text = fs::read_to_string(path("tests/soak/flights.toml")).unwrap();
    let recorded: Table = text.parse().unwrap();
    let [disturbances, faults] =
        ["disturbances", "faults"].map(|suite| recorded[suite].as_table().unwrap());
    let text = fs::read_to_string(path("tests/soak/image_flights.toml")).unwrap();
    let image: Table = text.parse().unwrap();
    let parts = [
        ("image flights", image_text(&image)),
        ("fresh disturbances", disturbances_text(disturbances)),
        ("fresh faults", faults_text(faults)),
    ];
    check("docs/flight.md", "flights.rs", &parts);
}

fn count(suite: &Table, name: &str) -> String {
    number(suite["counts"][name].as_integer().unwrap() as f64)
}

/// Returns the flights of a suite and the day of the last.
fn flown(suite: &Table) -> (String, &str) {
    (number(suite["flown"].as_integer().unwrap() as f64), suite["date"].as_str().unwrap())
}

/// Returns the worst value of the figures whose names contain a text.
fn worst(suite: &Table, figure: &str) -> f64 {
    let worst = suite["worst"].as_table().unwrap().iter();
    let values = worst.filter(|(name, _)| name.contains(figure)).map(|(_, worst)| value(worst));
    values.reduce(f64::max).unwrap_or_else(|| panic!("no figure {figure:?}"))
}

fn value(worst: &Value) -> f64 {
    worst["value"].as_float().unwrap()
}

fn disturbances_text(suite: &Table) -> String {
    let (flights, date) = flown(suite);
    let end_early = count(suite, "end early");
    let [capture_mm, deck_mm] = ["MotionCapture", "FlowDeck"].map(|source| worst(suite, source));
    let height_mm = worst(suite, "height above the floor");
    format!(
        "Of {flights} flights whose numbers no limit was chosen with (until {date}), {end_early} ended early.\n\
         Their largest errors were {capture_mm} mm with poses, {deck_mm} mm with a deck, and {height_mm} mm of the height \
         above the floor.\n"
    )
}

fn faults_text(suite: &Table) -> String {
    let (flights, date) = flown(suite);
    let [upright, can_land, shocks] =
        ["land upright", "can land", "landings taken for a crash"].map(|name| count(suite, name));
    let fence_m = worst(suite, "mm outside the fence") / 1000.0;
    let mut text = format!(
        "`cargo xtask soak flights` has flown {flights} flights whose numbers no limit was chosen with (until {date}).\n\
         No robot with a position left its fence by more than {fence_m:.2} m, {upright} of {can_land} landed upright, and \
         {shocks} landings were taken for a crash.\n\
         The flight controller stopped following the script at the latest this long after a fault:\n\n\
         | Sensor | Stuck | Noise of 5 to 50 times | Silent |\n|---|---|---|---|\n"
    );
    for (title, sensor) in SENSORS {
        let times = ["Stuck", "Noisy", "Silent"].map(|fault| {
            let ms = worst(suite, &format!("until {sensor}{fault} is found"));
            if ms < 100.0 { format!("{ms} ms") } else { format!("{:.1} s", ms / 1000.0) }
        });
        text += &format!("| {title} | {} |\n", times.join(" | "));
    }
    text + "\n"
}
