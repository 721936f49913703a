//! Recordings: the place and the visible state of every robot, and the places of the discs that
//! robots push, sample by sample.
//! `docs/recording.md` describes the format.
//!
//! ```
//! use bittybuzz_arena::output::recording::{
//!     RecordedBody, RecordedMovable, RecordedRobot, RecordingHeader, RecordingReader,
//!     RecordingWriter, RobotStatus,
//! };
//!
//! let bodies = vec![RecordedBody { id: 0, radius: 165 }, RecordedBody { id: 1, radius: 165 }];
//! let (ground, obstacles) = (Vec::new(), Vec::new());
//! let movables = vec![RecordedMovable { at: [500, 0], radius: 1500, height: None }];
//! let header =
//!     RecordingHeader { size: [2000, 1000], tick_ms: 100, bodies, ground, obstacles, movables };
//! let mut file = Vec::new();
//! let mut writer = RecordingWriter::new(&mut file, &header)?;
//! let robot = RecordedRobot { x: -120, y: 5, z: 0, heading: 0x4000, led: 4, state: RobotStatus::Running };
//! writer.write(0, &[Some(robot), None], &[[510, 0]])?;
//! writer.finish()?;
//!
//! let mut reader = RecordingReader::new(&file)?;
//! assert_eq!(reader.header(), &header);
//! let sample = reader.next().unwrap()?;
//! assert_eq!((sample.tick, sample.robots[0]), (0, Some(robot)));
//! assert_eq!(sample.movables, [[510, 0]]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::io::{self, Write};

mod cursor;
mod error;
mod reader;

pub use error::RecordingError;
pub use reader::RecordingReader;

/// The first bytes of a recording.
const MAGIC: &[u8; 6] = b"bbzrec";

/// Version of the format.
pub const VERSION: u8 = 4;

/// The greatest number of robots in a recording: one for each id.
const ROBOTS_MAX: u32 = 1 << 16;

/// The data that hold for a whole recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordingHeader {
    /// Width and height of the world in mm.
    pub size: [u32; 2],
    /// Length of a tick in ms.
    pub tick_ms: u32,
    /// The robots.
    pub bodies: Vec<RecordedBody>,
    /// The painted parts of the ground, later ones over earlier ones. The rest is white.
    pub ground: Vec<RecordedPatch>,
    /// The obstacles, which never move.
    pub obstacles: Vec<RecordedObstacle>,
    /// The discs that robots push.
    pub movables: Vec<RecordedMovable>,
}

/// The properties of a robot that no sample changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordedBody {
    /// The robot's id.
    pub id: u16,
    /// Radius in tenths of mm.
    pub radius: u32,
}

/// An obstacle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordedObstacle {
    /// Its outline on the ground.
    pub outline: RecordedOutline,
    /// Height in tenths of mm; robots at this height and above pass over the obstacle. `None` if
    /// the height is unlimited.
    pub height: Option<u32>,
}

/// A disc that robots push.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordedMovable {
    /// Its center at the start, in tenths of mm from the middle of the world.
    pub at: [i32; 2],
    /// Radius in tenths of mm.
    pub radius: u32,
    /// Height in tenths of mm, as that of an obstacle.
    pub height: Option<u32>,
}

/// A painted part of the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordedPatch {
    pub shape: RecordedShape,
    /// Thousandths, from 0 (black) to 1000 (white).
    pub brightness: u32,
}

/// The outline of an obstacle, in tenths of mm from the middle of the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordedOutline {
    Shape(RecordedShape),
    /// A thin wall: x and y of both ends.
    Wall([i32; 4]),
}

/// A shape on the ground, in tenths of mm from the middle of the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordedShape {
    /// A disc: x and y of its center, and its radius.
    Disc([i32; 3]),
    /// A box: x and y of its center, width, height, and the direction of the width in 1/65536 of a
    /// full turn, 0 along x, anticlockwise.
    Block([i32; 5]),
}

impl RecordedOutline {
    fn put(&self, bytes: &mut Vec<u8>) {
        match self {
            RecordedOutline::Shape(shape) => shape.put(bytes),
            RecordedOutline::Wall(numbers) => put_form(bytes, WALL, numbers),
        }
    }
}

impl RecordedShape {
    fn put(&self, bytes: &mut Vec<u8>) {
        match self {
            RecordedShape::Disc(numbers) => put_form(bytes, DISC, numbers),
            RecordedShape::Block(numbers) => put_form(bytes, BLOCK, numbers),
        }
    }
}

/// Writes the byte that encodes a form, and the numbers of the form.
fn put_form(bytes: &mut Vec<u8>, form: u8, numbers: &[i32]) {
    bytes.push(form);
    numbers.iter().for_each(|number| put_signed(bytes, i64::from(*number)));
}

/// Bytes that encode the forms of outlines.
const DISC: u8 = 0;
const BLOCK: u8 = 1;
const WALL: u8 = 2;

/// A robot in a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordedRobot {
    /// Tenths of mm, to the right of the middle of the world.
    pub x: i32,
    /// Tenths of mm, up from the middle.
    pub y: i32,
    /// Tenths of mm over the ground.
    pub z: i32,
    /// 1/65536 of a full turn, 0 along x, anticlockwise.
    pub heading: u16,
    /// Color: the sum of 1 red, 2 green, 4 blue.
    pub led: u8,
    pub state: RobotStatus,
}

/// The state of a robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RobotStatus {
    /// Its script runs.
    Running = 0,
    /// Stopped by an event.
    Stopped = 1,
    /// Failed.
    Failed = 2,
    /// Its script had a fault and is halted.
    Faulted = 3,
}

/// The states of all robots at one tick.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordingSample {
    pub tick: u64,
    /// Each robot, in the order of the header; `None` before it joins.
    pub robots: Vec<Option<RecordedRobot>>,
    /// The center of each movable disc, in the order of the header, in tenths of mm.
    pub movables: Vec<[i32; 2]>,
}

/// The state from which the first change of a robot is the difference.
const ORIGIN: RecordedRobot =
    RecordedRobot { x: 0, y: 0, z: 0, heading: 0, led: 0, state: RobotStatus::Running };

/// Bits of a change, which announce the fields that follow.
const PLACE: u8 = 1;
const HEIGHT: u8 = 2;
const HEADING: u8 = 4;
const SHOWN: u8 = 8;

/// Writes a recording.
pub struct RecordingWriter<W: Write> {
    output: W,
    last: Vec<Option<RecordedRobot>>,
    movables: Vec<[i32; 2]>,
    tick: u64,
    samples: u64,
}

impl<W: Write> RecordingWriter<W> {
    /// Writes the header.
    pub fn new(mut output: W, header: &RecordingHeader) -> io::Result<Self> {
        let mut bytes = MAGIC.to_vec();
        bytes.push(VERSION);
        put(&mut bytes, u64::from(header.size[0]));
        put(&mut bytes, u64::from(header.size[1]));
        put(&mut bytes, u64::from(header.tick_ms));
        put(&mut bytes, header.bodies.len() as u64);
        put_differences(&mut bytes, header.bodies.iter().map(|body| i64::from(body.id)));
        put_differences(&mut bytes, header.bodies.iter().map(|body| i64::from(body.radius)));
        put(&mut bytes, header.ground.len() as u64);
        for RecordedPatch { shape, brightness } in &header.ground {
            shape.put(&mut bytes);
            put(&mut bytes, u64::from(*brightness));
        }
        put(&mut bytes, header.obstacles.len() as u64);
        for RecordedObstacle { outline, height } in &header.obstacles {
            outline.put(&mut bytes);
            put_height(&mut bytes, *height);
        }
        put(&mut bytes, header.movables.len() as u64);
        for RecordedMovable { at: [x, y], radius, height } in &header.movables {
            [*x, *y].iter().for_each(|axis| put_signed(&mut bytes, i64::from(*axis)));
            put(&mut bytes, u64::from(*radius));
            put_height(&mut bytes, *height);
        }
        output.write_all(&bytes)?;
        let last = vec![None; header.bodies.len()];
        let movables = header.movables.iter().map(|movable| movable.at).collect();
        Ok(RecordingWriter { output, last, movables, tick: 0, samples: 0 })
    }

    /// Writes a sample: the state of each robot, and the center of each movable disc. Ticks must
    /// ascend. Robots and discs that are not in the header are left out.
    pub fn write(
        &mut self,
        tick: u64,
        robots: &[Option<RecordedRobot>],
        movables: &[[i32; 2]],
    ) -> io::Result<()> {
        let mut changes = Vec::new();
        let mut unchanged = 0;
        for (last, robot) in self.last.iter_mut().zip(robots) {
            // `None` counts as unchanged, because a robot that has joined stays.
            let Some(robot) = robot.filter(|robot| *last != Some(*robot)) else {
                unchanged += 1;
                continue;
            };
            put(&mut changes, unchanged);
            unchanged = 0;
            change(&mut changes, last.unwrap_or(ORIGIN), robot);
            *last = Some(robot);
        }
        // The discs are numbered after the robots.
        unchanged += self.last.len().saturating_sub(robots.len()) as u64;
        for (last, at) in self.movables.iter_mut().zip(movables) {
            if last == at {
                unchanged += 1;
                continue;
            }
            put(&mut changes, unchanged);
            unchanged = 0;
            changes.push(PLACE);
            put_way(&mut changes, *last, *at);
            *last = *at;
        }
        let mut head = Vec::new();
        // The length is stored plus 1, because 0 is the end of the recording.
        put(&mut head, 1 + changes.len() as u64);
        put(&mut head, tick.saturating_sub(self.tick));
        self.output.write_all(&head)?;
        self.output.write_all(&changes)?;
        self.tick = tick;
        self.samples += 1;
        Ok(())
    }

    /// Returns the output. The caller may take bytes from it that are already written.
    pub fn output_mut(&mut self) -> &mut W {
        &mut self.output
    }

    /// Writes the end, and returns the output.
    pub fn finish(mut self) -> io::Result<W> {
        let mut end = vec![0];
        put(&mut end, self.samples);
        self.output.write_all(&end)?;
        self.output.flush()?;
        Ok(self.output)
    }
}

fn change(bytes: &mut Vec<u8>, from: RecordedRobot, to: RecordedRobot) {
    let mut fields = 0;
    for (field, differs) in [
        (PLACE, (from.x, from.y) != (to.x, to.y)),
        (HEIGHT, from.z != to.z),
        (HEADING, from.heading != to.heading),
        (SHOWN, (from.led, from.state) != (to.led, to.state)),
    ] {
        if differs {
            fields |= field;
        }
    }
    bytes.push(fields);
    if fields & PLACE != 0 {
        put_way(bytes, [from.x, from.y], [to.x, to.y]);
    }
    if fields & HEIGHT != 0 {
        put_signed(bytes, i64::from(to.z) - i64::from(from.z));
    }
    if fields & HEADING != 0 {
        // The difference goes the shorter way round.
        put_signed(bytes, i64::from(to.heading.wrapping_sub(from.heading) as i16));
    }
    if fields & SHOWN != 0 {
        bytes.push(to.led & 7 | (to.state as u8) << 3);
    }
}

/// Writes the differences of two places.
fn put_way(bytes: &mut Vec<u8>, from: [i32; 2], to: [i32; 2]) {
    for (from, to) in from.into_iter().zip(to) {
        put_signed(bytes, i64::from(to) - i64::from(from));
    }
}

/// Writes the height of an obstacle.
fn put_height(bytes: &mut Vec<u8>, height: Option<u32>) {
    put(bytes, height.map_or(0, |height| 1 + u64::from(height)));
}

/// Writes a number with seven bits per byte, the lowest first; the top bit marks that more bytes
/// follow (LEB128).
fn put(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

/// Writes each number as the difference from the one before, the first from 0.
fn put_differences(bytes: &mut Vec<u8>, numbers: impl Iterator<Item = i64>) {
    let mut last = 0;
    for number in numbers {
        put_signed(bytes, number - last);
        last = number;
    }
}

/// Writes a number with its sign in the lowest bit.
fn put_signed(bytes: &mut Vec<u8>, value: i64) {
    put(bytes, (value << 1 ^ value >> 63) as u64);
}
