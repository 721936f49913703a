//! What is kept of a run beside its summary: a recording, pictures.

use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use bittybuzz_arena::output::recording::Writer;
use bittybuzz_arena::output::{History, chart, recorder, trajectories};
use bittybuzz_arena::run::{Setup, Simulation, TICKS_PER_SECOND};

use crate::problem::Problem;

use super::Arguments;

/// Takes samples as often as the scenario says.
pub struct Keeper {
    recording: Option<(PathBuf, Writer<BufWriter<File>>)>,
    pictures: Option<(PathBuf, History)>,
    /// Ticks between two samples.
    every: u64,
}

impl Keeper {
    /// Creates the files that the command line asks for.
    pub fn new(arguments: &Arguments, simulation: &Simulation<'_>) -> Result<Self, Problem> {
        let recording = match &arguments.record {
            Some(path) => {
                let create = || {
                    let file = BufWriter::new(File::create(path)?);
                    Writer::new(file, &recorder::header(simulation))
                };
                Some((path.clone(), create().map_err(|error| Problem::unwritable(path, error))?))
            }
            None => None,
        };
        let pictures = match &arguments.svg {
            Some(folder) => {
                fs::create_dir_all(folder).map_err(|error| Problem::unwritable(folder, error))?;
                Some((folder.clone(), History::default()))
            }
            None => None,
        };
        let seconds = simulation.setup().scenario.output.every;
        Ok(Keeper { recording, pictures, every: (seconds * TICKS_PER_SECOND).round() as u64 })
    }

    /// Takes a sample, if it is time to.
    pub fn sample(&mut self, simulation: &Simulation<'_>) -> Result<(), Problem> {
        if !simulation.now().is_multiple_of(self.every.max(1)) {
            return Ok(());
        }
        if let Some((path, writer)) = &mut self.recording {
            writer
                .write(simulation.now(), &recorder::robots(simulation))
                .map_err(|error| Problem::unwritable(path, error))?;
        }
        if let Some((_, history)) = &mut self.pictures {
            history.sample(simulation);
        }
        Ok(())
    }

    /// Ends the recording and draws the pictures.
    pub fn finish(self, setup: &Setup<'_>) -> Result<(), Problem> {
        if let Some((path, writer)) = self.recording {
            writer.finish().map_err(|error| Problem::unwritable(&path, error))?;
        }
        let Some((folder, history)) = self.pictures else { return Ok(()) };
        let write = |name: &str, text: String| {
            let path = folder.join(name);
            write(&path, text).map_err(|error| Problem::unwritable(&path, error))
        };
        write("trajectories.svg", trajectories(&setup.scenario.world, &history))?;
        for ((quantity, _), values) in setup.scenario.output.plot.iter().zip(&history.values) {
            let title = quantity.to_string();
            write(&file_name(&title), chart(&title, &history.times, values))?;
        }
        Ok(())
    }
}

fn write(path: &Path, text: String) -> io::Result<()> {
    fs::write(path, text)
}

/// `distance(0, 0)` to `distance-0-0.svg`: a name that every file system takes.
fn file_name(title: &str) -> String {
    let words = title.split(|c: char| !c.is_alphanumeric() && c != '_' && c != '-');
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    format!("{}.svg", words.join("-"))
}
