//! Requests to the nRF51 about the one-wire memories of decks, and its answers.
//!
//! The nRF51 reads a memory bit by bit. Meanwhile its loop reads no frames, and its queue would drop
//! those that do not fit. All other frames therefore wait until it has answered.

use bittybuzz_comms::syslink::{MTU, SyslinkFrame};
use bittybuzz_memories::kind;
use bittybuzz_runtime::liveness::{BEAT, Pulse};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant, Timer, with_timeout};

/// The longest time for which other frames wait. A bit takes about 70 µs on the wire, the search of
/// four memories, whose content the nRF51 then copies, about 0.4 s (memory.c of
/// crazyflie2-nrf-firmware).
const BUSY: Duration = Duration::from_millis(500);
/// The time after which a request counts as lost.
const PATIENCE: Duration = Duration::from_millis(600);

/// The last answer.
static ANSWER: Signal<CriticalSectionRawMutex, Answer> = Signal::new();
/// Raised when the nRF51 reads frames again.
static IDLE: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// An answer of the nRF51.
pub struct Answer {
    kind: u8,
    bytes: [u8; MTU],
    length: usize,
}

impl Answer {
    /// Returns the type of the frame and its content.
    pub fn content(&self) -> (u8, &[u8]) {
        (self.kind, self.bytes.get(..self.length).unwrap_or_default())
    }
}

/// Returns true for the type of a request, which its answer has as well.
pub fn is_request(kind: u8) -> bool {
    matches!(kind, kind::SCAN | kind::READ)
}

/// Discards the last answer.
pub fn discard_answer() {
    ANSWER.reset();
}

/// Returns the next answer, which may be that of an earlier request; `None` if none arrives.
pub async fn answer() -> Option<Answer> {
    with_timeout(PATIENCE, ANSWER.wait()).await.ok()
}

/// Handles an answer of the nRF51.
pub fn receive(frame: SyslinkFrame<'_>) {
    IDLE.signal(());
    let mut answer = Answer { kind: frame.kind(), bytes: [0; MTU], length: frame.data().len() };
    answer.bytes.iter_mut().zip(frame.data()).for_each(|(to, from)| *to = *from);
    ANSWER.signal(answer);
}

/// Waits until the nRF51 has answered the request that was just sent, or has certainly finished.
pub async fn wait_for_answer(pulse: Pulse) {
    IDLE.reset();
    let end = Instant::now() + BUSY;
    while Instant::now() < end {
        pulse.beat();
        if with_timeout(BEAT, IDLE.wait()).await.is_ok() {
            return;
        }
    }
}

/// Waits for a sign that frames can be sent.
pub async fn wait_until_ready() {
    while !super::STATE.can_send() {
        Timer::after(BEAT).await;
    }
}
