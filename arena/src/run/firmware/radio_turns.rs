//! The turns in which robots with an emulator process each run, and exchange frames in between.
//!
//! An exchange costs two process switches for each robot, so a turn is as long as it may be. A radio
//! transmits the first bit of a frame [`RAMP`] after the decision to transmit, and a frame is
//! received with its last bit. Each robot states a time before which it decides nothing, because
//! its core sleeps and because its firmware needs time to pass a frame to the radio. Until [`RAMP`]
//! after the earliest of these times, all frames on the channel are known, and so are all that
//! overlap with them. The robots' events are therefore the same as with the shortest turns.

use std::time::Duration;

use bittybuzz_chips::nrf51::P2P_COMMAND_TIME_MIN;
use bittybuzz_emulation::message::{Command, EmulatorEvent, RobotEvent};
use bittybuzz_emulation::{ClientError, Emulator};

use super::p2p::{P2pAir, RAMP};
use super::pace::Pace;

/// The shortest time from the command or the frame that wakes a robot to its decision to transmit.
const RESPONSE: Duration = Duration::from_nanos(P2P_COMMAND_TIME_MIN.nanos());
/// The longest time by which a core is late when it stops, at the end of a block of instructions.
const OVERSHOOT: Duration = Duration::from_micros(2);

/// The length of a turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TurnLength {
    /// The longest for which all frames that end within the turn are known.
    Exact,
    /// Always the same; frames may be late by it.
    Fixed(Duration),
}

/// The turns of robots, and the radio channel between them.
pub struct RadioTurns {
    /// The channel.
    pub air: P2pAir,
    length: TurnLength,
    now: Duration,
    /// No robot decides to transmit before this time, unless a command or a frame wakes it.
    silent_until: Duration,
    /// The pace of robots with doors for ground stations.
    pub(super) pace: Option<Pace>,
    /// The number of turns since the robots were powered on.
    pub turns: u64,
}

impl RadioTurns {
    /// Creates an empty channel between robots that were just powered on.
    pub fn new(length: TurnLength) -> Self {
        let (now, silent_until) = (Duration::ZERO, Duration::ZERO);
        RadioTurns { air: P2pAir::default(), length, now, silent_until, pace: None, turns: 0 }
    }

    /// Runs the robots until a time, and passes their events to `on_event`. `receives` returns true
    /// if its first robot can receive the second one.
    pub fn run(
        &mut self,
        robots: &mut [&mut Emulator],
        until: Duration,
        receives: impl Fn(usize, usize) -> bool,
        mut on_event: impl FnMut(RobotEvent),
    ) -> Result<(), ClientError> {
        self.wake();
        while self.now < until {
            if let Some(pace) = &mut self.pace {
                pace.wait(self.now);
            }
            let Turn { end, commands } = self.begin(until, robots.len(), &receives);
            for (emulator, commands) in robots.iter_mut().zip(&commands) {
                emulator.begin_run(commands, end)?;
            }
            let mut silent_until = Duration::MAX;
            // The events of the first robot come first, whichever is ready first.
            for (robot, (emulator, commands)) in robots.iter_mut().zip(&commands).enumerate() {
                let air = &mut self.air;
                let silent =
                    emulator.finish_run(commands.len(), |RobotEvent { timed, .. }| {
                        if let EmulatorEvent::P2p { port, payload, air: long } = &timed.event {
                            air.send(robot, timed.at, *long, *port, payload.clone());
                        }
                        on_event(RobotEvent { robot, timed });
                    })?;
                silent_until = silent_until.min(silent);
            }
            self.finish(end, silent_until);
        }
        // The caller may cut robots off from each other before the next call.
        for (receiver, command) in self.air.carry(until + RAMP, robots.len(), &receives) {
            robots[receiver].execute(&command)?;
        }
        Ok(())
    }

    /// Notes that commands may have woken robots since the last turn.
    fn wake(&mut self) {
        self.silent_until = self.silent_until.min(self.now + RESPONSE);
    }

    /// Begins a turn that ends at `until` at the latest.
    fn begin(
        &mut self,
        until: Duration,
        robots: usize,
        receives: impl Fn(usize, usize) -> bool,
    ) -> Turn {
        let (end, known) = match self.length {
            TurnLength::Fixed(length) => (until.min(self.now + length), self.now + RAMP),
            // A robot alone has nothing to wait for.
            TurnLength::Exact if robots == 1 => (until, until),
            TurnLength::Exact => {
                // A robot may answer the frame that ends next.
                let woken = self.air.next_end(self.now).map(|end| end + RESPONSE);
                let silent_until = woken.into_iter().fold(self.silent_until, Duration::min);
                let end = until.min(silent_until.max(self.now) + RAMP - OVERSHOOT);
                (end, end + OVERSHOOT)
            }
        };
        let mut commands = vec![Vec::new(); robots];
        for (receiver, command) in self.air.carry(known, robots, receives) {
            commands[receiver].push((0, command));
        }
        self.air.forget(self.now);
        Turn { end, commands }
    }

    /// Ends a turn. No robot decides to transmit before `silent_until`, unless a command or a frame
    /// wakes it.
    fn finish(&mut self, end: Duration, silent_until: Duration) {
        if self.length == TurnLength::Exact {
            self.air.sort();
        }
        (self.now, self.silent_until) = (end, silent_until);
        self.turns += 1;
    }
}

/// A turn.
struct Turn {
    end: Duration,
    /// The commands for each robot, which precede the turn.
    commands: Vec<Vec<(usize, Command)>>,
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use crate::engine::Stream;

    use super::*;

    const ROBOTS: usize = 4;
    const END: Duration = Duration::from_millis(100);
    /// Longer than a frame and the command to transmit it, so that no frame is cut off.
    const PAUSE: Duration = Duration::from_micros(600);

    /// A robot that transmits at given times, and as soon as possible after some receptions.
    #[derive(Clone, Default)]
    struct Scripted {
        decisions: BTreeSet<Duration>,
        receptions: BTreeSet<(Duration, Vec<u8>)>,
        received: Vec<(Duration, Vec<u8>)>,
    }

    impl Scripted {
        fn is_free(&self, at: Duration) -> bool {
            self.decisions.range(at.saturating_sub(PAUSE)..at + PAUSE).next().is_none()
        }

        /// Runs up to a time, and returns the times at which it decided to transmit.
        fn run(&mut self, begin: Duration, end: Duration) -> Vec<Duration> {
            while let Some((at, payload)) = self.receptions.pop_first() {
                assert!(begin < at, "received {at:?} after {begin:?}");
                if at > end {
                    self.receptions.insert((at, payload));
                    break;
                }
                let answer = at + RESPONSE;
                if payload[0] % 2 == 0 && self.is_free(answer) {
                    self.decisions.insert(answer);
                }
                self.received.push((at, payload));
            }
            let decisions = self.decisions.iter().copied();
            decisions.filter(|at| (begin..end).contains(at)).collect()
        }

        fn silent_until(&self, now: Duration) -> Duration {
            self.decisions.range(now..).next().copied().unwrap_or(END)
        }
    }

    fn scripted(seed: u64) -> Vec<Scripted> {
        let mut stream = Stream::for_emulated(seed);
        let mut robots = vec![Scripted::default(); ROBOTS];
        for robot in &mut robots {
            for step in 0..END.as_micros() as u64 / 50 {
                let at = Duration::from_micros(50 * step + 7 * seed);
                if stream.chance(0.02) && robot.is_free(at) {
                    robot.decisions.insert(at);
                }
            }
        }
        robots
    }

    /// Passes a robot's decisions to the channel. The frame's content and duration depend on the
    /// time.
    fn send(air: &mut P2pAir, robot: usize, decisions: Vec<Duration>) {
        for at in decisions {
            let content = (at.as_micros() % 251) as u8;
            let long = RAMP + Duration::from_micros(45 + u64::from(content));
            air.send(robot, at, long, 11, vec![content, robot as u8]);
        }
    }

    fn receive(robot: &mut Scripted, command: Command) {
        let Command::P2p { at, payload, .. } = command else { panic!("{command:?}") };
        robot.receptions.insert((at, payload));
    }

    type Outcome = (Vec<Vec<(Duration, Vec<u8>)>>, [u64; 3]);

    fn outcome(robots: Vec<Scripted>, air: &P2pAir) -> Outcome {
        let received = robots.into_iter().map(|robot| robot.received);
        (received.collect(), [air.carried, air.lost, air.collided])
    }

    fn in_exact_turns(seed: u64) -> (Outcome, u64) {
        let (mut robots, mut turns) = (scripted(seed), RadioTurns::new(TurnLength::Exact));
        turns.air.lose(0.1, seed);
        while turns.now < END {
            let begin = turns.now;
            let Turn { end, commands } = turns.begin(END, ROBOTS, |_, _| true);
            let mut silent_until = Duration::MAX;
            for (number, (robot, commands)) in robots.iter_mut().zip(commands).enumerate() {
                commands.into_iter().for_each(|(_, command)| receive(robot, command));
                send(&mut turns.air, number, robot.run(begin, end));
                silent_until = silent_until.min(robot.silent_until(end));
            }
            turns.finish(end, silent_until);
        }
        (outcome(robots, &turns.air), turns.turns)
    }

    fn in_short_turns(seed: u64) -> (Outcome, u64) {
        let (mut robots, mut air, mut now) = (scripted(seed), P2pAir::default(), Duration::ZERO);
        air.lose(0.1, seed);
        let mut turns = 0;
        while now < END {
            let end = END.min(now + RAMP);
            for (receiver, command) in air.carry(end, ROBOTS, |_, _| true) {
                receive(&mut robots[receiver], command);
            }
            air.forget(now);
            for (number, robot) in robots.iter_mut().enumerate() {
                send(&mut air, number, robot.run(now, end));
            }
            air.sort();
            now = end;
            turns += 1;
        }
        (outcome(robots, &air), turns)
    }

    #[test]
    fn a_frame_arrives_late_after_a_fixed_turn() {
        let ms = Duration::from_millis;
        let mut turns = RadioTurns::new(TurnLength::Fixed(ms(5)));
        assert_eq!(turns.begin(ms(8), 2, |_, _| true).end, ms(5));
        send(&mut turns.air, 0, vec![ms(1)]);
        turns.finish(ms(5), ms(5));
        let Turn { end, commands } = turns.begin(ms(8), 2, |_, _| true);
        assert_eq!((end, commands[0].len(), commands[1].len()), (ms(8), 0, 1));
    }

    #[test]
    fn robots_receive_in_long_turns_as_in_short_ones() {
        for seed in 1..=50 {
            let (exact, turns) = in_exact_turns(seed);
            let (expected, most_turns) = in_short_turns(seed);
            let (received, counts) = &expected;
            assert!(received.iter().all(|of_robot| !of_robot.is_empty()), "{counts:?}");
            assert!(counts.iter().all(|count| *count > 0), "{counts:?}");
            assert!(exact == expected, "seed {seed}: {:?} instead of {counts:?}", exact.1);
            assert!(turns < most_turns, "{turns} of {most_turns}");
        }
    }
}
