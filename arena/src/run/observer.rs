//! The events of a run that an observer sees: frames, faults, logs and calls of robot functions.
//!
//! A run records these events only in ticks that are observed
//! ([`Simulation::tick_observed`](super::Simulation::tick_observed)), and only those in which the
//! observer has an [`Interest`].

use crate::engine::{Arrival, Fate, FrameLog, LossCause, Medium, RobotId, SendAttempt, SentFrame};
use crate::robot::{FunctionCall, Interest, LogLine, PostMortem, SeenEvent};

/// A receiver of a run's events: a web page, a debugger or a recorder.
///
/// After each observed tick it receives the events of the tick, robot by robot in the order of
/// their numbers in the scenario. The events of each robot come in three parts:
/// 1. the fates of its frames that ended in the previous tick, by receiver and time;
/// 2. the faults, logs and calls of its script, and the frames that found its send queue full, in
///    the order in which they happened;
/// 3. its attempts to send, by time.
///
/// The order does not depend on the number of threads.
///
/// For robots that run their firmware in an emulator, it receives only the faults and logs that the
/// firmware reports. The emulator does not expose their frames and the calls of their scripts.
pub trait Observer {
    /// Returns the events that the observer uses in the next tick, besides log lines and faults.
    fn interest(&self) -> Interest;

    /// Receives an event.
    fn see(&mut self, event: ObservedEvent<'_>);
}

/// An event of an observed tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObservedEvent<'a> {
    /// Ticks since the run began. The event happened in the 100 ms that follow this tick.
    pub tick: u64,
    /// Number of the robot in the scenario: the sender of a frame, or the robot that runs the
    /// script. Adversaries are numbered after the robots of the scenario, in the order in which
    /// they appear; they only send.
    pub robot: usize,
    pub kind: EventKind<'a>,
}

/// A kind of event, with its data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EventKind<'a> {
    /// The robot began to send a frame.
    Sent(FrameOnAir<'a>),
    /// The robot tried to send, but the channel was busy.
    Postponed {
        /// The time of the attempt, in µs since the run began.
        at_us: u64,
        /// The number of frames that the robot sensed on the channel.
        sensed: usize,
    },
    /// A frame of the robot arrived at another one. The receiver's queue may still discard it, see
    /// [`LossCause::QueueFull`].
    Received {
        frame: FrameOnAir<'a>,
        /// Number of the receiver.
        receiver: usize,
        /// True if the frame arrived twice (`duplication` of the medium).
        is_duplicated: bool,
        /// The tick until which the link delays the frame (`reordering` of the medium).
        held_until: Option<u64>,
    },
    /// A frame of the robot did not reach the script of another robot in its range.
    Lost {
        frame: FrameOnAir<'a>,
        /// Number of the robot in range.
        receiver: usize,
        /// The reason.
        cause: LossCause,
    },
    /// The send queue of the robot was full when a frame came. The queue may have discarded another
    /// frame to take this one.
    Unsent {
        /// Type byte and payload.
        bytes: &'a [u8],
    },
    /// The script logged a line.
    Log(&'a LogLine),
    /// The script had a fault. The content of its machine is known if the run
    /// [keeps it](super::Simulation::keep_post_mortems).
    Fault(&'a PostMortem),
    /// The script called a function of the robot.
    Call(&'a FunctionCall),
}

/// A frame on the channel. Sender and start time identify it, because a robot sends one frame at a
/// time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameOnAir<'a> {
    /// The medium, which determines the duration of the frame.
    pub medium: Medium,
    /// The time at which the frame began, in µs since the run began.
    pub start_us: u64,
    /// Type byte and payload. A frame on infrared always has 10 bytes.
    pub bytes: &'a [u8],
}

impl<'a> FrameOnAir<'a> {
    fn new(sent: &'a SentFrame) -> Self {
        FrameOnAir { medium: sent.medium, start_us: sent.start_us, bytes: sent.bytes() }
    }
}

/// Passes the events of a tick to an observer. `number` returns the number of a sender, which is
/// below `count`. `robots` are the robots' events by id.
pub fn show(
    tick: u64,
    number: &dyn Fn(RobotId) -> usize,
    count: usize,
    FrameLog { mut arrivals, mut attempts }: FrameLog,
    seen: Vec<(RobotId, SeenEvent)>,
    observer: &mut dyn Observer,
) {
    let mut others: Vec<(usize, SeenEvent)> = Vec::new();
    for (id, event) in seen {
        match event {
            SeenEvent::Unread(frame, cause) => {
                arrivals.push(Arrival { frame, receiver: id, fate: Fate::Lost(cause) });
            }
            event => others.push((number(id), event)),
        }
    }
    // The sorts are stable: the arrival of a frame stays before its loss in a full queue, and
    // attempts stay ordered by time.
    arrivals.sort_by_key(|Arrival { frame, receiver, .. }| {
        (number(frame.sender), number(*receiver), frame.start_us)
    });
    attempts.sort_by_key(|attempt| number(sender(attempt)));
    others.sort_by_key(|(robot, _)| *robot);
    let mut arrivals = arrivals.iter().peekable();
    let mut others = others.iter().peekable();
    let mut attempts = attempts.iter().peekable();
    for robot in 0..count {
        let mut see = |kind| observer.see(ObservedEvent { tick, robot, kind });
        while let Some(arrival) = arrivals.next_if(|next| number(next.frame.sender) == robot) {
            see(arrived(arrival, number(arrival.receiver)));
        }
        while let Some((_, event)) = others.next_if(|(of, _)| *of == robot) {
            match event {
                SeenEvent::Log(line) => see(EventKind::Log(line)),
                SeenEvent::Fault(fault) => see(EventKind::Fault(fault)),
                SeenEvent::Call(call) => see(EventKind::Call(call)),
                SeenEvent::Unsent(bytes) => see(EventKind::Unsent { bytes }),
                // The loop above turned these into arrivals.
                SeenEvent::Unread(..) => {}
            }
        }
        while let Some(attempt) = attempts.next_if(|next| number(sender(next)) == robot) {
            see(match attempt {
                SendAttempt::Sent(frame) => EventKind::Sent(FrameOnAir::new(frame)),
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
    let frame = FrameOnAir::new(frame);
    match *fate {
        Fate::Received { is_duplicated, held_until } => {
            EventKind::Received { frame, receiver, is_duplicated, held_until }
        }
        Fate::Lost(cause) => EventKind::Lost { frame, receiver, cause },
    }
}
