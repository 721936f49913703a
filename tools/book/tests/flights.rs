//! Compares what docs/flight.md says of flights with fresh numbers with the figures that `cargo xtask
//! soak flights` keeps. `UPDATE_DOCS=1 cargo test --locked -p bittybuzz-book` writes the page again.

use crate::generated::{check, path};
use crate::performance::number;
use fs_err as fs;
use toml::{Table, Value};

/// Sensors with the names of their three faults: stuck, noisy and silent.
const SENSORS: [(&str, &str); 4] =
    [("inertial sensors", "Imu"), ("poses", "Capture"), ("flow", "Flow"), ("range", "Range")];

#[test]
fn flights_are_those_of_the_recorded_figures() {
    let text = fs::read_to_string(path("tests/soak/flights.toml")).unwrap();
    let recorded: Table = text.parse().unwrap();
    let [disturbances, faults] =
        ["disturbances", "faults"].map(|suite| recorded[suite].as_table().unwrap());
    let parts = [
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
