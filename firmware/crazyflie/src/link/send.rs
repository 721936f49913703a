//! The sending task: sends frames to the nRF51 one by one, at the rate at which it reads them.
//!
//! Flow control follows the FIFO of the nRF51's UART. The queue after that FIFO has 127 bytes and
//! silently drops bytes that find no room (crazyflie2-nrf-firmware, src/uart.c). The nRF51's loop
//! reads one frame per iteration, and nothing while it sends one. Each frame therefore waits here
//! until the previous one was certainly read.

use core::sync::atomic::Ordering;

use bittybuzz_comms::syslink::{Bytes, MTU, SyslinkFrame, SyslinkPacket, kind};
use bittybuzz_runtime::liveness::{BEAT, Pulse};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Duration, Timer, with_timeout};

use super::uart::Sender;
use super::{STATE, one_wire};

/// The frames that wait to be sent.
static OUT: Channel<CriticalSectionRawMutex, Bytes, 8> = Channel::new();

/// The longest iteration of the nRF51's loop while Bluetooth is off. It passes on a P2P frame (68
/// bytes), echoes one of our frames (11) and reports battery and signal strength (26), 10 us for
/// each byte. The margin is a seventh.
const TURN: Duration = Duration::from_micros(1_200);

/// The additional time for a P2P frame. The nRF51's radio has a buffer for one such frame, and the
/// next one would cut it off: the longest takes 415 us at 2 Mbit/s.
const AIR: Duration = Duration::from_micros(500);

/// Queues a packet. If the queue is full or the packet is too long, the packet is dropped and
/// counted.
pub fn send(packet: &SyslinkPacket<'_>) {
    let mut buffer = [0; MTU];
    match packet.frame(&mut buffer) {
        Ok(frame) => send_frame(frame),
        Err(_) => count_dropped(),
    }
}

/// Returns true if a frame can be queued.
pub fn has_room() -> bool {
    !OUT.is_full()
}

/// Queues a frame. If the queue is full, the frame is dropped and counted.
pub fn send_frame(frame: SyslinkFrame<'_>) {
    if OUT.try_send(frame.bytes()).is_err() {
        count_dropped();
    }
}

/// Counts a frame or packet that found no room.
pub fn count_dropped() {
    STATE.dropped.fetch_add(1, Ordering::Relaxed);
}

/// Runs the sending task.
#[embassy_executor::task]
pub async fn send_frames(mut uart: Sender, pulse: Pulse) -> ! {
    let mut pause = Duration::MIN;
    loop {
        pulse.beat();
        // Flow control may stop a frame for long. Other frames wait meanwhile, or are dropped.
        if with_timeout(BEAT, uart.flush()).await.is_err() {
            continue;
        }
        Timer::after(pause).await;
        pause = Duration::MIN;
        if let Ok(frame) = with_timeout(BEAT, OUT.receive()).await {
            uart.write(frame.as_slice());
            pause = TURN;
            match frame.as_slice().get(2) {
                Some(&kind::RADIO_P2P_BROADCAST) => pause += AIR,
                Some(kind) if one_wire::is_request(*kind) => one_wire::wait_for_answer(pulse).await,
                _ => {}
            }
        }
    }
}
