//! A recording that a client plays.

use std::time::Duration;

use bittybuzz_arena::output::recording::{
    RecordedBody, RecordedMovable, RecordedObstacle, RecordedOutline, RecordedPatch, RecordedRobot,
    RecordedShape, RecordingError, RecordingReader, RecordingSample,
};

use crate::pace::{Pace, RATES};
use crate::page_event::{
    BeginEvent, GroupDescription, MovableDescription, ObstacleDescription, PageEvent,
    PatchDescription, RecordingDescription, StateEvent,
};
use crate::request::Request;
use crate::samples::Samples;
use crate::source::Source;

/// The greatest number of positions in a recording from which it can be read again after a step
/// back.
const KEYS_MAX: usize = 256;

/// A recording that a client plays and watches. Its ticks are those of its samples: it has no data
/// between two of them.
pub struct Replay<'a> {
    /// The reader of the samples after `next`.
    reader: RecordingReader<'a>,
    shown: RecordingSample,
    /// The sample after the shown one; `None` at the last.
    next: Option<RecordingSample>,
    /// Copies of the reader before some samples, with the ticks of these samples, in ascending
    /// order.
    keys: Vec<(u64, RecordingReader<'a>)>,
    /// The tick of the last sample.
    end: u64,
    /// The error that ends the recording early; `None` if it is complete.
    cut: Option<RecordingError>,
    pace: Pace,
    samples: Samples,
    events: Vec<PageEvent>,
}

impl<'a> Replay<'a> {
    /// Reads a whole recording, and shows its first sample. A truncated or damaged recording ends
    /// where it cannot be read.
    pub fn new(bytes: &'a [u8]) -> Result<Self, RecordingError> {
        let start = RecordingReader::new(bytes)?;
        let mut reader = start.clone();
        let (mut keys, mut apart, mut count) = (Vec::new(), 1, 0);
        let (mut end, mut cut) = (0, None);
        loop {
            let here = reader.clone();
            match reader.next() {
                None => break,
                Some(Err(error)) => {
                    cut = Some(error);
                    break;
                }
                Some(Ok(sample)) => {
                    end = sample.tick;
                    if count % apart == 0 {
                        keys.push((sample.tick, here));
                    }
                    count += 1;
                    if keys.len() > KEYS_MAX {
                        let mut number = 0;
                        keys.retain(|_| {
                            number += 1;
                            number % 2 == 1
                        });
                        apart *= 2;
                    }
                }
            }
        }
        let mut reader = start;
        let first = reader.next().ok_or(RecordingError::Empty)??;
        let next = reader.next().and_then(Result::ok);
        let mut replay = Replay {
            reader,
            shown: first,
            next,
            keys,
            end,
            cut,
            pace: Pace::Paused,
            samples: Samples::NEW,
            events: Vec::new(),
        };
        replay.begin();
        Ok(replay)
    }

    /// Shows the next sample. Returns false at the last one; `cut` has the error that follows it.
    fn step(&mut self) -> bool {
        let Some(next) = self.next.take() else { return false };
        self.shown = next;
        self.next = self.reader.next().and_then(Result::ok);
        true
    }

    /// Shows the last sample at or before a tick, or the first sample of the recording.
    fn go_to(&mut self, tick: u64) {
        if tick < self.shown.tick {
            let at = self.keys.partition_point(|(of, _)| *of <= tick).saturating_sub(1);
            let (_, key) = self.keys.get(at).expect("the first sample always has a copy");
            self.reader = key.clone();
            self.next = self.reader.next().and_then(Result::ok);
            self.step();
        }
        while self.next.as_ref().is_some_and(|next| next.tick <= tick) {
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
            tick: self.shown.tick,
            plays: self.pace != Pace::Paused,
            rate,
            over: self.next.is_none(),
        }));
    }

    fn refuse(&mut self, text: &str) {
        self.events.push(PageEvent::refused(text, None));
    }
}

/// Describes successive robots of one size as a group.
fn group(bodies: &[RecordedBody]) -> GroupDescription {
    let first = bodies.first().expect("`chunk_by` returns no empty chunk");
    GroupDescription {
        name: None,
        robot: None,
        script: None,
        count: bodies.len() as u32,
        first_id: first.id,
        radius: mm(first.radius.into()),
        slots: None,
        wind: None,
        surroundings: Vec::new(),
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
            recording: Some(RecordingDescription { cut }),
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
                if self.next.is_none() {
                    self.go_to(0);
                }
                self.pace = Pace::play(rate, now, self.shown.tick);
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
        let due = self.pace.due(self.shown.tick, now, self.ticks_per_second());
        if due == 0 {
            return false;
        }
        let wanted = self.shown.tick.saturating_add(due);
        let is_due =
            |next: &Option<RecordingSample>| next.as_ref().is_some_and(|next| next.tick <= wanted);
        while is_due(&self.next) && has_time() {
            self.step();
        }
        if self.next.is_none() {
            self.pace = Pace::Paused;
            self.add_state();
        }
        let is_late = is_due(&self.next);
        if is_late {
            self.pace.passed(0, due, self.shown.tick, now);
        }
        is_late
    }

    fn tick(&self) -> u64 {
        self.shown.tick
    }

    fn take_events(&mut self) -> Vec<PageEvent> {
        std::mem::take(&mut self.events)
    }

    fn take_sample(&mut self) -> Vec<u8> {
        let robots: &[Option<RecordedRobot>] = &self.shown.robots;
        let header = || self.reader.header().clone();
        self.samples.take(self.shown.tick, robots, &self.shown.movables, header)
    }
}
