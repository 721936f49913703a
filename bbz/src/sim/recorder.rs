//! The files of a run in addition to its summary: a recording and pictures.

use std::fs;
use std::path::PathBuf;

use bittybuzz_arena::output::recording::RecordingWriter;
use bittybuzz_arena::output::{History, chart, recorder, trajectories};
use bittybuzz_arena::run::{Setup, Simulation, TICKS_PER_SECOND};

use crate::file_error::FileError;
use crate::problem::Problem;
use crate::whole_file::{self, Inputs, WholeFile};

use super::arguments::SimArguments;

/// The file name of the picture with the trajectories of all robots.
const TRAJECTORIES: &str = "trajectories.svg";

/// Takes samples at the interval of the scenario.
pub struct Recorder {
    recording: Option<(PathBuf, RecordingWriter<WholeFile>)>,
    pictures: Option<(PathBuf, History)>,
    /// Ticks between two samples.
    every: u64,
}

impl Recorder {
    /// Creates the files that the command line asks for, none of which may be an input.
    pub fn new(
        arguments: &SimArguments,
        simulation: &Simulation,
        inputs: &Inputs,
    ) -> Result<Self, Box<dyn Problem>> {
        let recording = match &arguments.record {
            Some(path) => {
                inputs.refuse(path)?;
                let writer =
                    RecordingWriter::new(WholeFile::create(path)?, &recorder::header(simulation));
                Some((path.clone(), writer.map_err(|error| FileError::writing(path, error))?))
            }
            None => None,
        };
        let pictures = match &arguments.svg {
            Some(folder) => {
                fs::create_dir_all(folder).map_err(|error| FileError::writing(folder, error))?;
                let plot = &simulation.setup().scenario.output.plot;
                let charts = plot.iter().map(|(quantity, _)| file_name(&quantity.to_string()));
                for name in charts.chain([TRAJECTORIES.to_owned()]) {
                    inputs.refuse(&folder.join(name))?;
                }
                Some((folder.clone(), History::default()))
            }
            None => None,
        };
        let seconds = simulation.setup().scenario.output.every;
        Ok(Recorder { recording, pictures, every: (seconds * TICKS_PER_SECOND).round() as u64 })
    }

    /// Takes a sample, if one is due.
    pub fn sample(&mut self, simulation: &Simulation) -> Result<(), Box<dyn Problem>> {
        if !simulation.now().is_multiple_of(self.every.max(1)) {
            return Ok(());
        }
        if let Some((path, writer)) = &mut self.recording {
            let (robots, movables) = (recorder::robots(simulation), recorder::movables(simulation));
            writer
                .write(simulation.now(), &robots, &movables)
                .map_err(|error| FileError::writing(path, error))?;
        }
        if let Some((_, history)) = &mut self.pictures {
            history.sample(simulation);
        }
        Ok(())
    }

    /// Ends the recording and draws the pictures.
    pub fn finish(self, setup: &Setup) -> Result<(), Box<dyn Problem>> {
        if let Some((path, writer)) = self.recording {
            let file = writer.finish().map_err(|error| FileError::writing(&path, error))?;
            file.finish()?;
        }
        let Some((folder, history)) = self.pictures else { return Ok(()) };
        let write =
            |name: &str, text: String| whole_file::write(&folder.join(name), text.as_bytes());
        write(TRAJECTORIES, trajectories(&setup.scenario.world, &history))?;
        for ((quantity, _), values) in setup.scenario.output.plot.iter().zip(&history.values) {
            let title = quantity.to_string();
            write(&file_name(&title), chart(&title, &history.times, values))?;
        }
        Ok(())
    }
}

/// Converts a title to a name that every file system accepts: `distance(0, 0)` to
/// `distance-0-0.svg`.
fn file_name(title: &str) -> String {
    let words = title.split(|c: char| !c.is_alphanumeric() && c != '_' && c != '-');
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    format!("{}.svg", words.join("-"))
}
