//! Everything that an observer of a run sees: frames, faults, logs, calls of robot functions.
//!
//! A run notes nothing of this but in ticks that are observed ([`Simulation::tick_observed`](super::Simulation::tick_observed)).

use crate::engine::{Arrival, Fate, FrameLog, LossCause, Medium, RobotId, SendAttempt, SentFrame};
use crate::robot::{FaultRecord, FunctionCall, LogLine, RobotEvent};

/// Something that looks at a run: a page, a debugger, a recording.
///
/// After each observed tick it sees the events of the tick, robot by robot in the order of their numbers in the scenario. Of each robot
/// come first the fates of its frames that ended in the tick before, by receiver and time; then the faults, logs and calls of its
/// script and the frames without room in its queue for the link, in the order in which they happened; then its attempts to send, in
/// the order of time. The order does not depend on the number of threads.
///
/// Of robots that run their firmware in an emulator it sees the faults and logs that the firmware reports. Their frames are in the
/// emulator's air, and the calls of their scripts in its memory.
pub trait Observer {
    /// Sees an event.
    fn see(&mut self, event: Event<'_>);
}

/// An event of an observed tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event<'a> {
    /// Ticks since the run began; the event is of the 100 ms that follow.
    pub tick: u64,
    /// Number of the robot in the scenario: the sender of a frame, or the robot whose script it is. Adversaries follow the robots of the
    /// scenario, in the order in which they come; they only send.
    pub robot: usize,
    /// The event.
    pub kind: EventKind<'a>,
}

/// A kind of event, with its data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EventKind<'a> {
    /// The robot began to send a frame.
    Sent(FrameOnAir<'a>),
    /// The robot wanted to send and found the channel busy.
    Postponed {
        /// The time of the attempt, in µs since the run began.
        at_us: u64,
        /// The number of frames that it sensed.
        sensed: usize,
    },
    /// A frame of the robot arrived at another one. Its queue may still refuse it: [`LossCause::QueueFull`].
    Heard {
        /// The frame.
        frame: FrameOnAir<'a>,
        /// Number of the robot that heard it.
        receiver: usize,
        /// It arrived twice (`duplication` of the medium).
        is_duplicated: bool,
        /// The tick until which the link holds it back (`reordering` of the medium).
        held_until: Option<u64>,
    },
    /// A frame of the robot did not get to the script of another one in its reach.
    Lost {
        /// The frame.
        frame: FrameOnAir<'a>,
        /// Number of the robot in its reach.
        receiver: usize,
        /// The reason.
        cause: LossCause,
    },
    /// A frame of the robot found its queue for the link full. The queue may have discarded another frame to take this one.
    Unsent {
        /// The frame.
        bytes: &'a [u8],
    },
    /// The script logged a line.
    Log(&'a LogLine),
    /// The script had a fault.
    Fault(&'a FaultRecord),
    /// The script called a function of the robot.
    Call(&'a FunctionCall),
}

/// A frame on the air. Its sender and its beginning name it, because a robot sends one frame at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameOnAir<'a> {
    /// The medium that carried it, which knows its time on the air.
    pub medium: Medium,
    /// The time at which it began, in µs since the run began.
    pub start_us: u64,
    /// Type byte and payload; on infrared always 10 bytes.
    pub bytes: &'a [u8],
}

impl<'a> FrameOnAir<'a> {
    fn of(sent: &'a SentFrame) -> Self {
        FrameOnAir { medium: sent.medium, start_us: sent.start_us, bytes: sent.bytes() }
    }
}

/// Shows a tick. `number` gives the number of a sender, which is below `count`, and `robots` are the robots' events by id.
pub fn show(
    tick: u64,
    number: &dyn Fn(RobotId) -> usize,
    count: usize,
    FrameLog { mut arrivals, mut attempts }: FrameLog,
    robots: Vec<Vec<RobotEvent>>,
    observer: &mut dyn Observer,
) {
    let mut others: Vec<(usize, RobotEvent)> = Vec::new();
    for (id, events) in (0..).map(RobotId).zip(robots) {
        for event in events {
            match event {
                RobotEvent::Unread(frame, cause) => {
                    arrivals.push(Arrival { frame, receiver: id, fate: Fate::Lost(cause) });
                }
                event => others.push((number(id), event)),
            }
        }
    }
    // Stable: a frame arrives before it finds a queue full, and attempts stay in the order of time.
    arrivals.sort_by_key(|Arrival { frame, receiver, .. }| {
        (number(frame.sender), number(*receiver), frame.start_us)
    });
    attempts.sort_by_key(|attempt| number(sender(attempt)));
    others.sort_by_key(|(robot, _)| *robot);
    let mut arrivals = arrivals.iter().peekable();
    let mut others = others.iter().peekable();
    let mut attempts = attempts.iter().peekable();
    for robot in 0..count {
        let mut see = |kind| observer.see(Event { tick, robot, kind });
        while let Some(arrival) = arrivals.next_if(|next| number(next.frame.sender) == robot) {
            see(arrived(arrival, number(arrival.receiver)));
        }
        while let Some((_, event)) = others.next_if(|(of, _)| *of == robot) {
            match event {
                RobotEvent::Log(line) => see(EventKind::Log(line)),
                RobotEvent::Fault(record) => see(EventKind::Fault(record)),
                RobotEvent::Call(call) => see(EventKind::Call(call)),
                RobotEvent::Unsent(bytes) => see(EventKind::Unsent { bytes }),
                // Among the arrivals.
                RobotEvent::Unread(..) => {}
            }
        }
        while let Some(attempt) = attempts.next_if(|next| number(sender(next)) == robot) {
            see(match attempt {
                SendAttempt::Sent(frame) => EventKind::Sent(FrameOnAir::of(frame)),
                SendAttempt::Postponed { at_us, sensed, .. } => {
                    EventKind::Postponed { at_us: *at_us, sensed: *sensed }
                }
            });
        }
    }
}

fn sender(attempt: &SendAttempt) -> RobotId {
    match attempt {
        SendAttempt::Sent(frame) => frame.sender,
        SendAttempt::Postponed { sender, .. } => *sender,
    }
}

fn arrived(Arrival { frame, fate, .. }: &Arrival, receiver: usize) -> EventKind<'_> {
    let frame = FrameOnAir::of(frame);
    match *fate {
        Fate::Heard { is_duplicated, held_until } => {
            EventKind::Heard { frame, receiver, is_duplicated, held_until }
        }
        Fate::Lost(cause) => EventKind::Lost { frame, receiver, cause },
    }
}
