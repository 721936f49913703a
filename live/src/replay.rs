//! A recording that a client plays.
//!
//! Recordings are exchanged between people, so a file of any content takes memory in proportion to
//! its length: one state of the robots that changes in place, and copies of it within a budget.

use std::time::Duration;

use bittybuzz_arena::output::recording::{
    RecordedBody, RecordedMovable, RecordedObstacle, RecordedOutline, RecordedPatch, RecordedShape,
    RecordingError, RecordingReader,
};

use crate::pace::{Pace, RATES};
use crate::page_event::{
    BeginEvent, GlyphName, GroupDescription, MovableDescription, ObstacleDescription, PageEvent,
    PatchDescription, RecordingDescription, StateEvent,
};
use crate::request::Request;
use crate::samples::Samples;
use crate::source::Source;

/// The greatest number of positions in a recording from which it can be read again after a step
/// back.
const KEYS_MAX: usize = 256;

/// The memory of all these positions, in bytes for each byte of the recording. The state of the
/// robots and the header take 12 more at most, as a robot has two bytes in the file, 8 in the header
/// and 16 in the state; a step back copies the state once.
const KEY_BYTES_PER_BYTE: usize = 32;

/// A recording that a client plays and watches. Its ticks are those of its samples: it has no data
/// between two of them.
pub struct Replay<'a> {
    /// The reader after the shown sample, whose state it has.
    reader: RecordingReader<'a>,
    /// Copies of the reader after some samples, the first among them, in ascending order.
    keys: Vec<RecordingReader<'a>>,
    /// The number of samples that can be read.
    count: u64,
    /// The tick of the last sample.
    end: u64,
    /// The error that ends the recording early; `None` if it is complete.
    cut: Option<RecordingError>,
    /// The name of its file.
    name: Option<String>,
    pace: Pace,
    samples: Samples,
    events: Vec<PageEvent>,
}

impl<'a> Replay<'a> {
    /// Reads a whole recording, and shows its first sample. A truncated or damaged recording ends
    /// where it cannot be read.
    pub fn new(bytes: &'a [u8]) -> Result<Self, RecordingError> {
        let mut reader = RecordingReader::new(bytes)?;
        let budget = KEY_BYTES_PER_BYTE.saturating_mul(bytes.len());
        let keys_max = (budget / reader.clone_bytes()).clamp(1, KEYS_MAX);
        let (mut keys, mut apart) = (Vec::new(), 1);
        let (mut count, mut end, mut cut) = (0, 0, None);
        loop {
            match reader.advance() {
                Ok(Some(tick)) => end = tick,
                Ok(None) => break,
                Err(error) if count == 0 => return Err(error),
                Err(error) => {
                    cut = Some(error);
                    break;
                }
            }
            // With half as many keys, every second of the later samples has none.
            while keys.len() == keys_max && count % apart == 0 {
                keep_every_second(&mut keys);
                apart *= 2;
            }
            if count % apart == 0 {
                keys.push(reader.clone());
            }
            count += 1;
        }
        let first = keys.first().ok_or(RecordingError::Empty)?;
        let reader = first.clone();
        let mut replay = Replay {
            reader,
            keys,
            count,
            end,
            cut,
            name: None,
            pace: Pace::Paused,
            samples: Samples::NEW,
            events: Vec::new(),
        };
        replay.begin();
        Ok(replay)
    }

    /// Gives the recording the name of its file, which clients show.
    pub fn with_name(mut self, name: String) -> Self {
        self.name = Some(name);
        self.begin();
        self
    }

    /// Returns the tick of the shown sample.
    fn shown_tick(&self) -> u64 {
        self.reader.tick()
    }

    /// Returns true if the last sample is shown.
    fn is_at_end(&self) -> bool {
        self.reader.samples() == self.count
    }

    /// Returns true if the next sample is at or before a tick.
    fn is_due(&self, tick: u64) -> bool {
        // The data after the last sample may look like one, but cannot be read.
        !self.is_at_end() && self.reader.next_tick().is_some_and(|next| next <= tick)
    }

    /// Shows the next sample. Returns false at the last one; `cut` has the error that follows it.
    fn step(&mut self) -> bool {
        if self.is_at_end() {
            return false;
        }
        let tick = self.reader.advance().expect("this sample was read before");
        tick.is_some()
    }

    /// Shows the last sample at or before a tick, or the first sample of the recording.
    fn go_to(&mut self, tick: u64) {
        if tick < self.shown_tick() {
            let at = self.keys.partition_point(|key| key.tick() <= tick).saturating_sub(1);
            let key = self.keys.get(at).expect("the first sample always has a copy");
            self.reader = key.clone();
        }
        while self.is_due(tick) {
            self.step();
        }
    }

    fn ticks_per_second(&self) -> f64 {
        // A damaged recording may have ticks of 0 ms.
        1000.0 / f64::from(self.reader.header().tick_ms.max(1))
    }

    fn add_state(&mut self) {
        let rate = match self.pace {
            Pace::Rate { rate, .. } => Some(rate),
            _ => None,
        };
        self.events.push(PageEvent::State(StateEvent {
            tick: self.shown_tick(),
            plays: self.pace != Pace::Paused,
            rate,
            over: self.is_at_end(),
        }));
    }

    fn refuse(&mut self, text: &str) {
        self.events.push(PageEvent::refused(text, None));
    }
}

/// Removes the second key, the fourth, and so on.
fn keep_every_second(keys: &mut Vec<RecordingReader<'_>>) {
    let mut number = 0;
    keys.retain(|_| {
        number += 1;
        number % 2 == 1
    });
}

/// Describes successive robots of one size as a group.
fn group(bodies: &[RecordedBody]) -> GroupDescription {
    let first = bodies.first().expect("`chunk_by` returns no empty chunk");
    GroupDescription {
        name: None,
        robot: None,
        script: None,
        glyph: GlyphName::Disc,
        count: bodies.len() as u32,
        first_id: first.id,
        radius: mm(first.radius.into()),
        link: None,
        slots: None,
        wind: None,
        surroundings: Vec::new(),
        fence: None,
    }
}

fn patch(patch: &RecordedPatch) -> PatchDescription {
    let brightness = f64::from(patch.brightness) / 1000.0;
    match patch.shape {
        RecordedShape::Disc(numbers) => {
            let (at, radius) = disc(numbers);
            PatchDescription::Disc { at, radius, brightness }
        }
        RecordedShape::Block(numbers) => {
            let (at, size, heading) = block(numbers);
            PatchDescription::Block { at, size, heading, brightness }
        }
    }
}

fn obstacle(obstacle: &RecordedObstacle) -> ObstacleDescription {
    let height = obstacle.height.map(|height| mm(height.into()));
    match obstacle.outline {
        RecordedOutline::Shape(RecordedShape::Disc(numbers)) => {
            let (at, radius) = disc(numbers);
            ObstacleDescription::Disc { at, radius, height }
        }
        RecordedOutline::Shape(RecordedShape::Block(numbers)) => {
            let (at, size, heading) = block(numbers);
            ObstacleDescription::Block { at, size, heading, height }
        }
        RecordedOutline::Wall(numbers) => {
            let [x, y, to_x, to_y] = numbers.map(|tenths| mm(tenths.into()));
            ObstacleDescription::Wall { from: [x, y], to: [to_x, to_y], height }
        }
    }
}

fn movable(movable: &RecordedMovable) -> MovableDescription {
    MovableDescription {
        radius: mm(movable.radius.into()),
        height: movable.height.map(|height| mm(height.into())),
    }
}

/// Returns the center of a disc and its radius.
fn disc(numbers: [i32; 3]) -> ([f64; 2], f64) {
    let [x, y, radius] = numbers.map(|tenths| mm(tenths.into()));
    ([x, y], radius)
}

/// Returns the center of a box, its size, and the direction of its width in degrees.
fn block([x, y, width, height, turn]: [i32; 5]) -> ([f64; 2], [f64; 2], f64) {
    let [x, y, width, height] = [x, y, width, height].map(|tenths| mm(tenths.into()));
    ([x, y], [width, height], f64::from(turn) * 360.0 / 65_536.0)
}

/// Converts tenths of a millimeter to millimeters.
fn mm(tenths: i64) -> f64 {
    tenths as f64 / 10.0
}

impl Source for Replay<'_> {
    fn begin(&mut self) {
        let header = self.reader.header();
        let groups = header.bodies.chunk_by(|one, next| one.radius == next.radius);
        let cut = self.cut.map(|error| error.to_string());
        let begin = BeginEvent {
            recording: Some(RecordingDescription { name: self.name.clone(), cut }),
            size: header.size.map(f64::from),
            ticks_per_second: self.ticks_per_second(),
            end: self.end,
            groups: groups.map(group).collect(),
            ground: header.ground.iter().map(patch).collect(),
            obstacles: header.obstacles.iter().map(obstacle).collect(),
            movables: header.movables.iter().map(movable).collect(),
            ..BeginEvent::default()
        };
        self.samples.restart();
        self.events = vec![PageEvent::Begin(Box::new(begin))];
        self.add_state();
    }

    fn request(&mut self, text: &str, now: Duration) {
        match serde_json::from_str(text) {
            Ok(Request::Play { rate: Some(rate) }) if !RATES.contains(&rate) => {
                return self.refuse(&Pace::refusal(rate));
            }
            Ok(Request::Play { rate }) => {
                if self.is_at_end() {
                    self.go_to(0);
                }
                self.pace = Pace::play(rate, now, self.shown_tick());
            }
            Ok(Request::Pause) => self.pace = Pace::Paused,
            Ok(Request::Step { ticks }) => {
                self.pace = Pace::Paused;
                for _ in 0..ticks {
                    if !self.step() {
                        break;
                    }
                }
            }
            Ok(Request::GoTo { tick }) => {
                self.pace = Pace::Paused;
                self.go_to(tick);
            }
            Ok(_) => return self.refuse("a recording has places, LEDs and states alone"),
            Err(error) => return self.refuse(&format!("the request makes no sense: {error}")),
        }
        self.add_state();
    }

    fn advance(&mut self, now: Duration, has_time: &mut dyn FnMut() -> bool) -> bool {
        let due = self.pace.due(self.shown_tick(), now, self.ticks_per_second());
        if due == 0 {
            return false;
        }
        let wanted = self.shown_tick().saturating_add(due);
        while self.is_due(wanted) && has_time() {
            self.step();
        }
        if self.is_at_end() {
            self.pace = Pace::Paused;
            self.add_state();
        }
        let is_late = self.is_due(wanted);
        if is_late {
            self.pace.passed(0, due, self.shown_tick(), now);
        }
        is_late
    }

    fn tick(&self) -> u64 {
        self.shown_tick()
    }

    fn take_events(&mut self) -> Vec<PageEvent> {
        std::mem::take(&mut self.events)
    }

    fn take_sample(&mut self) -> Vec<u8> {
        let Replay { reader, samples, .. } = self;
        let header = || reader.header().clone();
        samples.take(reader.tick(), reader.robots(), reader.movables(), header)
    }
}
