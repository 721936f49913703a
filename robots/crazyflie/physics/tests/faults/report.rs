//! The table of many flights, and the limits that they keep.

use std::ops::Range;

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::faults::fault::{FaultKind, Scenario};
use crate::faults::flight::{Observations, fly};
use crate::fresh::{print_count, print_worst};

/// Largest distance outside the fence in m of a robot that knows its position.
const EXCURSION_M_MAX: f64 = 0.3;
/// Longest time in ms until motors are off after a fault of the IMU.
const IMU_OFF_MS: u64 = 50;
/// Longest time in ms until motors are off after a crash.
const CRASH_OFF_MS: u64 = 200;
/// Longest time in ms for which a robot may follow its path without a position.
const BLIND_MS: u64 = 2;
/// Least share of flights that land upright in spite of a fault of anything but the IMU.
const LANDED_MIN: f64 = 0.95;

/// Flights and their observations.
pub struct Report(Vec<(Scenario, Observations)>);

impl Report {
    /// Flies the scenarios of these numbers on all cores.
    pub fn of(numbers: Range<usize>) -> Self {
        let flown = numbers.into_par_iter().map(|number| {
            let scenario = Scenario::new(number);
            let observations = fly(&scenario);
            (scenario, observations)
        });
        Report(flown.collect())
    }

    fn of_kind(&self, kind: FaultKind) -> impl Iterator<Item = &Observations> {
        self.0.iter().filter(move |(scenario, _)| scenario.kind == kind).map(|(_, found)| found)
    }

    /// Prints a line per kind of fault, and the flights that broke a limit.
    fn print(&self) {
        println!(
            "{:14} {:>7} {:>6} {:>7} {:>6} {:>10} {:>9} {:>8} {:>9} {:>6} {:>5} {:>8}",
            "fault",
            "flights",
            "landed",
            "crashes",
            "shocks",
            "excursion",
            "(whole)",
            "off ms",
            "crash ms",
            "blind",
            "found",
            "found ms"
        );
        for kind in FaultKind::ALL {
            let flights = || self.of_kind(kind);
            let worst = |value: fn(&Observations) -> f64| flights().map(value).fold(0.0, f64::max);
            println!(
                "{:14} {:7} {:6} {:7} {:6} {:10.2} {:9.2} {:8} {:9} {:6} {:5} {:8}",
                format!("{kind:?}"),
                flights().count(),
                flights().filter(|found| found.has_landed()).count(),
                flights().filter(|found| found.has_crashed).count(),
                flights().filter(|found| found.has_false_crash).count(),
                worst(|found| found.excursion_m),
                worst(|found| found.whole_excursion_m),
                flights().map(|found| found.off_after_ms.unwrap_or(u64::MAX)).max().unwrap_or(0),
                flights().filter_map(|found| found.off_after_crash_ms).max().unwrap_or(0),
                flights().map(|found| found.blind_following_ms).max().unwrap_or(0),
                flights().filter_map(Observations::found_ms).count(),
                flights().filter_map(Observations::found_ms).max().unwrap_or(0),
            );
        }
        for (scenario, found) in &self.0 {
            let faults = broken(scenario, found);
            if !faults.is_empty() || (!scenario.kind.is_imu_fault() && !found.has_landed()) {
                println!("{faults:?} {scenario:?}\n    {found:?}");
            }
        }
    }

    /// Prints what `cargo xtask soak flights` keeps: worst figures and numbers of flights.
    pub fn print_figures(&self) {
        let worst = |figure: &str, value: &dyn Fn(&Scenario, &Observations) -> Option<f64>| {
            let values = self.0.iter();
            print_worst(
                figure,
                values.map(|(scenario, found)| (scenario.number, value(scenario, found))),
            );
        };
        worst("mm outside the fence", &|_, found| Some((found.excursion_m * 1e3).round()));
        worst("ms until motors are off after a crash", &|_, found| {
            found.off_after_crash_ms.map(|ms| ms as f64)
        });
        for kind in FaultKind::ALL {
            worst(&format!("ms until {kind:?} is found"), &|scenario, found| {
                let ms = found.found_ms().filter(|_| scenario.kind == kind)?;
                Some(ms as f64)
            });
        }
        let others = || self.0.iter().filter(|(scenario, _)| !scenario.kind.is_imu_fault());
        print_count("can land", others().count());
        print_count("land upright", others().filter(|(_, found)| found.has_landed()).count());
        print_count(
            "landings taken for a crash",
            self.0.iter().filter(|(_, found)| found.has_false_crash).count(),
        );
    }

    /// Prints the table, then asserts the limits.
    pub fn check(&self) {
        self.print();
        for (scenario, found) in &self.0 {
            assert_eq!(broken(scenario, found), Vec::<&str>::new(), "{scenario:?} {found:?}");
        }
        let others = || self.0.iter().filter(|(scenario, _)| !scenario.kind.is_imu_fault());
        let landed = others().filter(|(_, found)| found.has_landed()).count();
        let share = landed as f64 / others().count() as f64;
        println!("{landed} of {} landed upright", others().count());
        assert!(share >= LANDED_MIN, "{share}");
    }
}

/// Returns the limits that a flight broke.
fn broken(scenario: &Scenario, found: &Observations) -> Vec<&'static str> {
    let mut broken = Vec::new();
    let mut require = |holds: bool, limit: &'static str| {
        if !holds {
            broken.push(limit);
        }
    };
    require(found.fault_height_m > 0.3, "flies at the time of the fault");
    require(found.excursion_m <= EXCURSION_M_MAX, "stays in the fence");
    require(found.blind_following_ms <= BLIND_MS, "follows no path without a position");
    require(found.off_after_ms.is_some(), "motors off in the end");
    require(found.forbidden_ms == 0, "motors off while crashed or locked");
    if found.has_crashed {
        require(
            found.off_after_crash_ms.is_some_and(|ms| ms <= CRASH_OFF_MS),
            "motors off after a crash",
        );
    }
    if scenario.kind.is_imu_fault() {
        require(
            found.off_after_ms.is_some_and(|ms| ms <= IMU_OFF_MS),
            "motors off after IMU fault",
        );
    }
    broken
}
