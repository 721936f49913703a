//! Globals of scripts that events set, or that robots keep when another script is loaded.

use crate::robot::ScriptNumber;
use crate::scenario::{NewNumbers, Selection};

use super::{JOINED, Simulation};

/// Globals that hold numbers, by their names.
pub type Globals = Vec<(String, ScriptNumber)>;

impl Simulation {
    /// Sets a global in the scripts of robots, where the script has one of that name.
    pub(super) fn set(&mut self, robots: &Selection, name: &str, numbers: &NewNumbers) {
        for (position, number) in robots.iter().enumerate() {
            let Some(value) = numbers.at(position) else { continue };
            // A robot that has not joined, or whose script has no such global, is left out.
            let global = self.program(number).global(name);
            if let (Some(global), Some(id)) = (global, self.event_queue.id(number)) {
                self.world.brain_mut(id).expect(JOINED).set(global, value);
            }
        }
    }

    /// Returns the globals of robots that hold numbers, by their names.
    pub(super) fn globals_of(&self, robots: &Selection) -> Vec<(usize, Globals)> {
        let of_robot = |number: usize| {
            let brain = self.robot(number)?;
            let globals = self.program(number).globals().iter().zip(0..);
            let of_global =
                |(name, global): (&String, u16)| Some((name.clone(), brain.number(global)?));
            Some((number, globals.filter_map(of_global).collect()))
        };
        robots.iter().filter_map(of_robot).collect()
    }

    /// Sets the globals of a newly loaded script to the numbers that they had in the previous one.
    pub(super) fn keep(&mut self, number: usize, globals: &Globals) {
        let program = self.program(number);
        let known: Vec<(u16, ScriptNumber)> = globals
            .iter()
            .filter_map(|(name, value)| Some((program.global(name)?, *value)))
            .collect();
        let id = self.event_queue.id(number).expect("only robots that have joined keep globals");
        let brain = self.world.brain_mut(id).expect(JOINED);
        known.into_iter().for_each(|(global, value)| brain.keep(global, value));
    }
}
