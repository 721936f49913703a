//! The table of many flights, and the limits that they keep.

use std::ops::Range;

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::disturbances::disturbance::{CASES, DisturbanceKind, PositionSource, Scenario};
use crate::disturbances::flight::{Observations, fly};
use crate::flight_closed_loop::figures::{mean, rms, worst};
use crate::fresh::{print_count, print_worst};

/// Largest error in m, and that in gusts.
const ERROR_M_MAX: f64 = 0.3;
const GUST_ERROR_M_MAX: f64 = 0.4;
/// Largest error of the height above the floor in m.
const HEIGHT_ERROR_M_MAX: f64 = 0.1;
/// Largest mean NEES of nine states of a case.
const NEES_MAX: f64 = 20.0;
/// Largest ratio of the drift of a case, in m rms, to that without a disturbance.
const DRIFT_RATIO_MAX: f64 = 2.0;

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

    fn of_case(&self, case: usize) -> impl Iterator<Item = &Observations> {
        self.0.iter().filter(move |(scenario, _)| scenario.case == case).map(|(_, found)| found)
    }

    fn figures(&self, case: usize, figure: fn(&Observations) -> f64) -> Vec<f64> {
        self.of_case(case).map(figure).collect()
    }

    /// Returns the drift in m rms of the flights of a case.
    fn drift_m(&self, case: usize) -> f64 {
        rms(&self.figures(case, |found| found.drift_m))
    }

    /// Prints a line per case, and the flights that broke a limit.
    pub fn print(&self) {
        println!(
            "{:11} {:13} {:>7} {:>5} {:>8} {:>8} {:>9} {:>9} {:>6} {:>6}",
            "disturbance",
            "source",
            "flights",
            "lost",
            "mean mm",
            "worst mm",
            "height mm",
            "drift mm",
            "NEES",
            "worst"
        );
        for (case, (kind, source, ..)) in CASES.into_iter().enumerate() {
            let errors = self.figures(case, |found| found.worst_m);
            let nees = self.figures(case, |found| found.nees);
            println!(
                "{:11} {:13} {:7} {:5} {:8.0} {:8.0} {:9.0} {:9.0} {:6.1} {:6.1}",
                format!("{kind:?}"),
                format!("{source:?}"),
                errors.len(),
                self.of_case(case).filter(|found| found.lost.is_some()).count(),
                1e3 * mean(&errors),
                1e3 * worst(&errors),
                1e3 * worst(&self.figures(case, |found| found.height_error_m)),
                1e3 * self.drift_m(case),
                mean(&nees),
                worst(&nees),
            );
        }
        for (scenario, found) in &self.0 {
            let faults = broken(scenario, found);
            if !faults.is_empty() {
                println!("{faults:?} {scenario:?}\n    {found:?}");
            }
        }
    }

    /// Prints what `cargo xtask soak flights` keeps: worst figures and numbers of flights.
    pub fn print_figures(&self) {
        let values = |value: fn(&Observations) -> f64| {
            self.0.iter().map(move |(scenario, found)| (scenario, (value(found) * 1e3).round()))
        };
        for (case, (kind, source, ..)) in CASES.into_iter().enumerate() {
            // Some kinds have two cases of different strength.
            let errors = values(|found| found.worst_m).map(|(scenario, error_mm)| {
                (scenario.number, (scenario.case == case).then_some(error_mm))
            });
            print_worst(&format!("mm of error, {kind:?} with {source:?}"), errors);
        }
        let heights = values(|found| found.height_error_m).map(|(scenario, error_mm)| {
            let has_deck = scenario.source == PositionSource::FlowDeck;
            (scenario.number, has_deck.then_some(error_mm))
        });
        print_worst("mm of error of the height above the floor", heights);
        print_count("end early", self.0.iter().filter(|(_, found)| found.lost.is_some()).count());
    }

    /// Prints the table, then asserts the limits.
    pub fn check(&self) {
        self.print();
        for (scenario, found) in &self.0 {
            assert_eq!(broken(scenario, found), Vec::<&str>::new(), "{scenario:?} {found:?}");
        }
        let calm = (DisturbanceKind::Calm, PositionSource::FlowDeck);
        let calm_case = CASES.iter().position(|(kind, source, ..)| (*kind, *source) == calm);
        let calm_drift_m = self.drift_m(calm_case.expect("a case of its own"));
        for (case, (kind, source, ..)) in CASES.into_iter().enumerate() {
            let nees = mean(&self.figures(case, |found| found.nees));
            assert!(nees <= NEES_MAX, "{kind:?} {source:?}: {nees}");
            if source == PositionSource::FlowDeck {
                let ratio = self.drift_m(case) / calm_drift_m;
                assert!(ratio <= DRIFT_RATIO_MAX, "{kind:?}: {ratio}");
            }
        }
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
    let is_gusts = scenario.kind == DisturbanceKind::Gusts;
    let error_m_max = if is_gusts { GUST_ERROR_M_MAX } else { ERROR_M_MAX };
    require(found.lost.is_none(), "flies to the end");
    require(found.worst_m <= error_m_max, "follows its path");
    require(
        scenario.source == PositionSource::MotionCapture
            || found.height_error_m <= HEIGHT_ERROR_M_MAX,
        "knows its height",
    );
    broken
}
