//! Curves: the past of quantities, from the beginning of the run.
//!
//! A curve has a point every few ticks. The session records points while it passes their ticks. A
//! copy of the run, which advances next to the session, computes those that the session passed
//! before the client asked for the curve. Both give the same values, because a run is
//! deterministic; so a curve has no gap, however the client jumps in time.

use bittybuzz_arena::run::{Session, Simulation};
use bittybuzz_arena::scenario::Quantity;
use bittybuzz_arena::statistics::quartiles;

use crate::page_event::{PageEvent, SeriesEvent, SeriesProgressEvent};

/// The greatest number of curves. A page has no room for more.
pub const CURVES_MAX: usize = 12;

/// The greatest number of robots whose own values the client gets: the chosen one and those with
/// which it is compared.
pub const ROBOTS_MAX: usize = 12;

/// The greatest number of points of a curve: a page has about as many pixels.
const POINTS_MAX: u64 = 2000;

/// The greatest number of values of single robots that are kept, 32 MB. Points without room for
/// them are computed again when the client chooses another robot.
const VALUES_MAX: usize = 4_000_000;

/// The parts of a point that the client has.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Sent {
    Nothing,
    /// All but the values of the chosen robots.
    Five,
    All,
}

/// The values of single robots at a point. NaN stands for a robot without a number.
enum Values {
    /// The value of each robot, or the single one of the swarm.
    Every(Box<[f64]>),
    /// The numbers of some robots, with their values.
    Some(Vec<(usize, f64)>),
}

struct Point {
    /// The extremes, quartiles and median of all robots; `None` if no robot has a number.
    five: [Option<f64>; 5],
    values: Values,
    sent: Sent,
}

impl Point {
    /// Returns the value of a robot; `None` if it is not kept.
    fn value(&self, robot: usize) -> Option<f64> {
        match &self.values {
            Values::Every(values) => Some(values.get(robot).copied().unwrap_or(f64::NAN)),
            Values::Some(values) => {
                values.iter().find(|(known, _)| *known == robot).map(|(_, value)| *value)
            }
        }
    }
}

struct Curve {
    quantity: Quantity,
    /// By tick in steps of [`Series::every`].
    points: Vec<Option<Point>>,
}

impl Curve {
    fn is_complete(&self, index: usize, robots: &[usize]) -> bool {
        let point = self.points.get(index).and_then(Option::as_ref);
        point.is_some_and(|point| robots.iter().all(|robot| point.value(*robot).is_some()))
    }
}

/// The curves that a client asked for.
pub struct Series {
    /// The number of ticks from one point to the next.
    every: u64,
    /// The latest tick that the session has reached on its way.
    reached: u64,
    curves: Vec<Curve>,
    /// The numbers of the robots whose own values the client wants.
    robots: Vec<usize>,
    /// All points before this one are complete.
    first_gap: usize,
    /// The copy of the run that fills gaps, and the point for which it was made.
    copy: Option<(Simulation, usize)>,
    /// False until the client has asked for curves.
    is_asked: bool,
    /// True if gaps stay: the client wants no more computation, or the run cannot be taken back.
    is_idle: bool,
    /// The number of values that are kept in [`Values::Every`].
    kept: usize,
    problem: Option<String>,
    /// The progress that was last sent to the client; `None` if it waits for one.
    shown: Option<SeriesProgressEvent>,
}

impl Series {
    /// Returns no curves of a run.
    pub fn new(run: &Simulation) -> Self {
        Series {
            // The first point is that of tick 0.
            every: run.end().div_ceil(POINTS_MAX - 1).max(1),
            reached: run.now(),
            curves: Vec::new(),
            robots: Vec::new(),
            first_gap: 0,
            copy: None,
            is_asked: false,
            is_idle: true,
            kept: 0,
            problem: None,
            shown: None,
        }
    }

    /// Keeps all points for another client, which has none of them.
    pub fn restart(&mut self) {
        self.copy = None;
        self.is_asked = false;
        self.is_idle = true;
        self.problem = None;
        let points = self.curves.iter_mut().flat_map(|curve| &mut curve.points).flatten();
        points.for_each(|point| point.sent = Sent::Nothing);
    }

    /// Sets the curves of the client, and the robots whose own values it wants.
    pub fn subscribe(&mut self, quantities: Vec<Quantity>, robots: Vec<usize>, run: &Simulation) {
        self.curves.retain(|curve| quantities.contains(&curve.quantity));
        for quantity in quantities {
            if self.curves.iter().all(|curve| curve.quantity != quantity) {
                self.curves.push(Curve { quantity, points: Vec::new() });
            }
        }
        if self.robots != robots {
            self.robots = robots;
            let points = self.curves.iter_mut().flat_map(|curve| &mut curve.points).flatten();
            for point in points.filter(|point| point.sent == Sent::All) {
                point.sent = Sent::Five;
            }
        }
        self.count_kept();
        self.first_gap = 0;
        self.copy = None;
        self.is_asked = true;
        self.is_idle = false;
        self.problem = None;
        self.shown = None;
        self.record(run);
    }

    /// Gives up the points that are not known yet.
    pub fn stop(&mut self) {
        self.is_idle = true;
        self.copy = None;
    }

    /// Forgets the points after a tick, from which the run goes another way.
    pub fn cut(&mut self, tick: u64) {
        let count = (tick / self.every) as usize + 1;
        self.curves.iter_mut().for_each(|curve| curve.points.truncate(count));
        self.count_kept();
        self.reached = self.reached.min(tick);
        self.first_gap = self.first_gap.min(count);
        self.copy = None;
    }

    fn count_kept(&mut self) {
        let points = self.curves.iter().flat_map(|curve| &curve.points).flatten();
        let kept = points.map(|point| match &point.values {
            Values::Every(values) => values.len(),
            Values::Some(_) => 0,
        });
        self.kept = kept.sum();
    }

    /// Records the points at the tick of a run: that of the session, or a copy of it.
    pub fn record(&mut self, run: &Simulation) {
        let now = run.now();
        self.reached = self.reached.max(now);
        if !now.is_multiple_of(self.every) {
            return;
        }
        let index = (now / self.every) as usize;
        for curve in &mut self.curves {
            if curve.is_complete(index, &self.robots) {
                continue;
            }
            // Resolved again each time, because scripts may be loaded during a run. Before that no
            // script may have the global.
            let probe = run.setup().probe(&curve.quantity);
            let numbers = probe.map(|probe| run.numbers(&probe)).unwrap_or_default();
            let values: Box<[f64]> =
                numbers.into_iter().map(|number| number.unwrap_or(f64::NAN)).collect();
            let five = five(&values);
            let values = if self.kept + values.len() <= VALUES_MAX {
                self.kept += values.len();
                Values::Every(values)
            } else {
                let value = |robot: &usize| values.get(*robot).copied().unwrap_or(f64::NAN);
                Values::Some(self.robots.iter().map(|robot| (*robot, value(robot))).collect())
            };
            if curve.points.len() <= index {
                curve.points.resize_with(index + 1, || None);
            }
            let before = curve.points[index].as_ref().map(|point| point.sent);
            let sent = before.unwrap_or(Sent::Nothing);
            curve.points[index] = Some(Point { five, values, sent });
        }
    }

    /// Returns the first point up to the present that is not complete.
    fn find_gap(&mut self) -> Option<usize> {
        let last = (self.reached / self.every) as usize;
        let is_complete =
            |index| self.curves.iter().all(|curve| curve.is_complete(index, &self.robots));
        while self.first_gap <= last && is_complete(self.first_gap) {
            self.first_gap += 1;
        }
        (self.first_gap <= last).then_some(self.first_gap)
    }

    /// Computes points that are missing: simulates one tick of a copy, and further ticks as long as
    /// `has_time` returns true. Returns false if none is missing any more.
    pub fn advance(&mut self, session: &Session, has_time: &mut dyn FnMut() -> bool) -> bool {
        while !self.is_idle {
            let Some(gap) = self.find_gap() else {
                self.copy = None;
                return false;
            };
            let outcome = self.step(session, gap);
            if let Err(problem) = outcome {
                self.problem = Some(problem);
                self.stop();
            }
            if !has_time() {
                return !self.is_idle;
            }
        }
        false
    }

    /// Simulates a tick on the way to a point, or records it.
    fn step(&mut self, session: &Session, gap: usize) -> Result<(), String> {
        let mut run = match self.copy.take() {
            // The way to the next point is a short one. To a later point another copy may be nearer.
            Some((run, target)) if gap <= target + 1 => run,
            _ => {
                let tick = gap as u64 * self.every;
                session.copy_before(tick).map_err(|error| error.to_string())?
            }
        };
        if run.now() < gap as u64 * self.every {
            run.tick().map_err(|error| error.to_string())?;
            run.take_log();
        }
        self.record(&run);
        self.copy = Some((run, gap));
        Ok(())
    }

    /// Returns the events about points that the client does not have.
    pub fn take(&mut self) -> Vec<PageEvent> {
        let mut events = Vec::new();
        if self.curves.is_empty() || !self.is_asked {
            return events;
        }
        let Series { curves, robots, every, .. } = self;
        for curve in curves {
            for known in [Sent::Nothing, Sent::Five] {
                events.extend(event(curve, robots, *every, known));
            }
        }
        let progress = self.progress();
        if self.shown.as_ref() != Some(&progress) {
            events.push(PageEvent::SeriesProgress(progress.clone()));
            self.shown = Some(progress);
        }
        events
    }

    fn progress(&self) -> SeriesProgressEvent {
        let count = (self.reached / self.every) as usize + 1;
        let known = |curve: &Curve| {
            (0..count).filter(|index| curve.is_complete(*index, &self.robots)).count()
        };
        let known: usize = self.curves.iter().map(known).sum();
        let percent = 100 * known / (count * self.curves.len()).max(1);
        SeriesProgressEvent { percent, problem: self.problem.clone() }
    }
}

/// Returns the event with the points of which the client knows no more than `known`.
fn event(curve: &mut Curve, robots: &[usize], every: u64, known: Sent) -> Option<PageEvent> {
    let (mut ticks, mut five, mut own) = (Vec::new(), Vec::new(), Vec::new());
    let mut is_single = false;
    for (index, point) in curve.points.iter_mut().enumerate() {
        let Some(point) = point.as_mut().filter(|point| point.sent == known) else { continue };
        let values: Option<Vec<f64>> = robots.iter().map(|robot| point.value(*robot)).collect();
        if values.is_none() && known == Sent::Five {
            continue;
        }
        point.sent = if values.is_some() { Sent::All } else { Sent::Five };
        ticks.push(index as u64 * every);
        if known == Sent::Nothing {
            five.push(point.five);
        }
        is_single = curve.quantity.is_of_swarm();
        let values = values.unwrap_or_else(|| vec![f64::NAN; robots.len()]);
        own.push(values.into_iter().map(|value| Some(value).filter(|it| it.is_finite())).collect());
    }
    let has_nothing = ticks.is_empty() || (known == Sent::Five && robots.is_empty());
    let robots = if is_single { Vec::new() } else { robots.to_vec() };
    let own = if robots.is_empty() { Vec::new() } else { own };
    (!has_nothing).then(|| {
        PageEvent::Series(SeriesEvent {
            name: curve.quantity.to_string(),
            unit: curve.quantity.unit(),
            every,
            is_single,
            ticks,
            five,
            robots,
            own,
        })
    })
}

/// Returns the extremes, quartiles and median of the numbers among some values.
fn five(values: &[f64]) -> [Option<f64>; 5] {
    let known: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    quartiles(&known).map_or([None; 5], |five| five.map(Some))
}
