//! The figures that tests of this crate measure for docs/performance.md. `bench/hil.json` has them.
//!
//! The emulators are deterministic, so the same image gives the same figures. Images are not always
//! the same: the order of their functions depends on the folder of the sources. On a Kilobot, squeeze
//! shares other ends of functions then.

use std::fs;
use std::sync::Mutex;

use bittybuzz_builds::cargo_test::{CHECK, FIGURES};
use bittybuzz_builds::shell::root;
use serde_json::Value;

/// The parts of a thousand by which most figures may differ.
pub const TOLERANCE: u64 = 20;

/// The parts of a thousand by which the longest slice may differ. The order of the image's functions
/// decides which of them is under way when a message comes: 282 and 303 µs were seen of one Zooid,
/// 259 and 268 µs of one Crazyflie. `bench/costs.json` holds the costs of each operation exactly.
pub const SLICE_TOLERANCE: u64 = 100;

const FILE: &str = "bench/hil.json";

/// Held while the file is rewritten, because the tests are threads of one process.
static WRITER: Mutex<()> = Mutex::new(());

/// Compares figures of a robot with the recorded ones, or records them, as the variable [`FIGURES`] says.
/// Without it, nothing happens: mutants of the firmware have other figures. A figure may differ from the
/// recorded one by `tolerance` parts of a thousand.
/// [`TOLERANCE`] is for figures of more than slices, which small changes of the firmware move.
pub fn check(robot: &str, group: &str, measured: &[(&str, u64)], tolerance: u64) {
    let Ok(wanted) = std::env::var(FIGURES) else { return };
    let path = root().join(FILE);
    let figure = |(name, figure): &(&str, u64)| ((*name).to_owned(), Value::from(*figure));
    let figures = Value::Object(measured.iter().map(figure).collect());
    let read = || -> Value { serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap() };
    if wanted != CHECK {
        let _held = WRITER.lock().unwrap();
        let mut record = read();
        record["date"] = wanted.into();
        record[group][robot] = figures;
        fs::write(&path, serde_json::to_string_pretty(&record).unwrap() + "\n").unwrap();
        return;
    }
    let recorded = read()[group][robot].take();
    let is_close = |(name, figure): &(&str, u64)| {
        let recorded = recorded[name].as_u64();
        recorded.is_some_and(|recorded| 1000 * recorded.abs_diff(*figure) <= tolerance * recorded)
    };
    assert!(
        recorded.as_object().is_some_and(|recorded| recorded.len() == measured.len())
            && measured.iter().all(is_close),
        "{robot}: {figures} instead of {recorded} in {FILE}; `cargo xtask bench slices --update` records them"
    );
}
