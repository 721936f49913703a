//! Quantities of a run, and the expectations and measures that are taken from them after each tick.

use std::sync::Arc;

use super::super::TICKS_PER_SECOND;
use super::super::condition::{against, aggregate, is_true, passes, reduce};
use super::super::measure::BoundMeasure;
use super::super::program::Program;
use super::super::quantity::{AggregateProbe, QuantityProbe, QuantityReading};
use super::super::swarm::measure;
use super::{JOINED, Simulation};
use crate::engine::{Pose, RobotView};
use crate::robot::{ProgramId, SimRobot};
use crate::scenario::{Condition, MeasureTime, Of, Reduction};

/// A robot that has joined, between two ticks.
pub struct JoinedRobot<'s> {
    /// Its number in the scenario.
    pub number: usize,
    of: ProgramId,
    program: &'s Program,
    robot: &'s SimRobot,
    view: RobotView,
}

impl Simulation {
    /// Reads a quantity of a robot.
    ///
    /// # Panics
    /// If the scenario has no robot of that number.
    pub fn read(&self, probe: &QuantityProbe, number: usize) -> QuantityReading<'_> {
        // Robots that have not joined have no values.
        let joined = self.joined_robot(number);
        joined.map_or(QuantityReading::Nil, |robot| self.read_joined(probe, &robot))
    }

    /// Returns the robots that have joined, in the order of their numbers, to read several quantities of
    /// each.
    pub fn joined(&self) -> impl Iterator<Item = JoinedRobot<'_>> {
        (0..self.robot_count()).filter_map(|number| self.joined_robot(number))
    }

    /// Reads a quantity of a robot that has joined.
    pub fn read_joined<'s>(
        &'s self,
        probe: &QuantityProbe,
        robot: &JoinedRobot<'s>,
    ) -> QuantityReading<'s> {
        let JoinedRobot { number, of, program, robot, ref view } = *robot;
        match probe {
            QuantityProbe::Displacement(since) => {
                let distance = self.displacement(*since, number, view.pose);
                distance.map_or(QuantityReading::Nil, QuantityReading::Number)
            }
            probe => probe.read(of, program, robot, view),
        }
    }

    #[inline]
    fn joined_robot(&self, number: usize) -> Option<JoinedRobot<'_>> {
        let id = self.event_queue.id(number)?;
        let robot = self.world.brain(id).expect(JOINED);
        let view = self.world.robot(id).expect(JOINED);
        let of = self.event_queue.program(number);
        let program = &self.setup.loaded(of).program;
        Some(JoinedRobot { number, of, program, robot, view })
    }

    /// Returns the current numbers of a quantity: one for each robot, or a single one for a measure
    /// of the swarm. `None` stands for a value that is not a number.
    pub fn numbers(&self, probe: &QuantityProbe) -> Vec<Option<f64>> {
        let robots = 0..self.robot_count();
        match self.read_swarm(probe, robots.clone()) {
            Some(reading) => vec![reading.number()],
            None => robots.map(|robot| self.read(probe, robot).number()).collect(),
        }
    }

    /// Reads a quantity that robots have together; `None` for a quantity of single robots.
    fn read_swarm(
        &self,
        probe: &QuantityProbe,
        robots: impl Iterator<Item = usize> + Clone,
    ) -> Option<QuantityReading<'_>> {
        let number = match probe {
            QuantityProbe::Swarm(of) => {
                let ids = robots.filter_map(|number| self.event_queue.id(number));
                measure(*of, &self.world, ids)
            }
            QuantityProbe::Aggregate(of) => {
                let AggregateProbe { rule, value, among } = &**of;
                let is_among = |robot: &usize| match among {
                    Some((probe, test)) => passes(test, &self.read(probe, *robot), 0.0),
                    None => true,
                };
                let readings = robots.filter(is_among).map(|robot| self.read(value, robot));
                aggregate(rule, readings)
            }
            _ => return None,
        };
        Some(number.map_or(QuantityReading::Nil, QuantityReading::Number))
    }

    /// Returns the distance in mm from a robot's place at a tick, or from its start, to where it is now;
    /// `None` if the robot was absent then.
    fn displacement(&self, since: Option<u64>, number: usize, pose: Pose) -> Option<f64> {
        let [x, y] = match since {
            Some(tick) => (*self.places.get(&tick)?.get(number)?)?,
            None => {
                let start = self.event_queue.start_of(number);
                [start.x, start.y]
            }
        };
        let [dx, dy] =
            [(pose.x, x), (pose.y, y)].map(|(now, then)| f64::from(now) - f64::from(then));
        Some(libm::hypot(dx, dy))
    }

    /// Returns the mean, the smallest and the largest number of a quantity now.
    pub(super) fn spread(&self, probe: &QuantityProbe) -> Option<[f64; 3]> {
        let numbers = self.numbers(probe);
        let readings = numbers.iter().flatten().map(|number| QuantityReading::Number(*number));
        let of = |reduction| reduce(reduction, readings.clone());
        Some([of(Reduction::Mean)?, of(Reduction::Min)?, of(Reduction::Max)?])
    }

    /// Keeps the places of the robots if a quantity refers to this tick, checks the expectations,
    /// and takes the measures.
    pub(super) fn observe(&mut self) {
        let tick = self.world.now();
        let setup = self.setup.clone();
        if setup.keeps_places_at(tick) {
            let place = |number| self.view(number).map(|view| [view.pose.x, view.pose.y]);
            let places: Arc<[Option<[f32; 2]>]> = (0..self.robot_count()).map(place).collect();
            self.places.insert(tick, places);
        }
        for (index, bound) in setup.expects().iter().enumerate() {
            let condition = &bound.expect.condition;
            let is_true = self.is_true(condition, &bound.probe);
            let mut convergence = self.convergences[index];
            bound.update(&mut convergence, tick, is_true);
            if convergence.failed_at == Some(tick) {
                let read = |robot| (robot, self.read(&bound.probe, robot));
                convergence.against = against(condition, condition.robots.iter().map(read));
            }
            self.convergences[index] = convergence;
        }
        for (index, bound) in setup.measures().iter().enumerate() {
            if self.measures[index].is_none() {
                self.measures[index] = self.take(bound);
            }
        }
    }

    /// Returns the current number of a measure, if this is its time.
    fn take(&self, bound: &BoundMeasure) -> Option<f64> {
        let tick = self.world.now();
        match bound.measure.time {
            MeasureTime::First => {
                let is_true = self.is_true(&bound.measure.condition, &bound.probe);
                is_true.then(|| tick as f64 / TICKS_PER_SECOND)
            }
            MeasureTime::At(_) if bound.tick == Some(tick) => self.number(bound),
            MeasureTime::At(_) | MeasureTime::End => None,
        }
    }

    /// Returns the measures of the scenario that are known, in the order of the file. Those of the end are
    /// known when the run is over.
    pub fn measures(&self) -> Vec<Option<f64>> {
        if self.is_over() { self.measures_now() } else { self.measures.clone() }
    }

    /// Returns the current measures. Those of the end have the numbers of now.
    pub(super) fn measures_now(&self) -> Vec<Option<f64>> {
        let measures = self.setup.measures().iter().zip(&self.measures);
        let now = measures.map(|(bound, taken)| match bound.measure.time {
            MeasureTime::End => self.number(bound),
            MeasureTime::At(_) | MeasureTime::First => *taken,
        });
        now.collect()
    }

    /// Returns the current number of a measure, or the truth of its condition as 1 or 0.
    fn number(&self, bound: &BoundMeasure) -> Option<f64> {
        let (probe, condition) = (&bound.probe, &bound.measure.condition);
        if bound.measure.is_of_condition() {
            return Some(f64::from(u8::from(self.is_true(condition, probe))));
        }
        let robots = condition.robots.iter();
        match (self.read_swarm(probe, robots.clone()), condition.of) {
            (Some(reading), _) => reading.number(),
            (None, Of::Reduced(by)) => reduce(by, Readings { simulation: self, probe, robots }),
            // The reader accepts only numbers.
            (None, _) => None,
        }
    }

    fn is_true(&self, condition: &Condition, probe: &QuantityProbe) -> bool {
        let robots = condition.robots.iter();
        match self.read_swarm(probe, robots.clone()) {
            Some(reading) => is_true(condition, std::iter::once(reading)),
            None => is_true(condition, Readings { simulation: self, probe, robots }),
        }
    }
}

/// The readings of some robots.
#[derive(Clone)]
struct Readings<'a, I> {
    simulation: &'a Simulation,
    probe: &'a QuantityProbe,
    robots: I,
}

impl<'a, I: Iterator<Item = usize>> Iterator for Readings<'a, I> {
    type Item = QuantityReading<'a>;

    fn next(&mut self) -> Option<QuantityReading<'a>> {
        let number = self.robots.next()?;
        Some(self.simulation.read(self.probe, number))
    }
}
