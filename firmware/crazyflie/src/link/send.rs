//! Frames to the nRF51, one after the other, and never more than it reads.
//!
//! Flow control follows the FIFO of the nRF51's UART. The queue after that has 127 bytes and silently drops those that find no
//! room (crazyflie2-nrf-firmware, src/uart.c). The nRF51's loop reads one frame in each turn, and nothing while it sends one.
//! So each frame here waits until the one before has surely been read.

use core::sync::atomic::Ordering;

use bittybuzz_comms::syslink::{Bytes, MTU, Packet, kind};
use bittybuzz_runtime::liveness::{BEAT, Pulse};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Duration, Timer, with_timeout};

use super::STATE;
use super::uart::Sender;

/// Frames that wait to be sent.
static OUT: Channel<CriticalSectionRawMutex, Bytes, 8> = Channel::new();

/// The longest turn of the nRF51's loop, if Bluetooth is off: it passes on a P2P frame (68 bytes), echoes one of ours (11) and
/// reports battery and signal strength (26), 10 us each, and a margin of a seventh.
const TURN: Duration = Duration::from_micros(1_200);

/// Its radio has a buffer for one P2P frame, and the next one cuts it off: 415 us for the longest at 2 Mbit/s.
const AIR: Duration = Duration::from_micros(500);

/// Queues a packet. Where there is no room, or the packet is too long, it is dropped and counted.
pub fn send(packet: &Packet<'_>) {
    let mut buffer = [0; MTU];
    let queued = match packet.frame(&mut buffer) {
        Ok(frame) => OUT.try_send(frame.bytes()).is_ok(),
        Err(_) => false,
    };
    if !queued {
        STATE.dropped.fetch_add(1, Ordering::Relaxed);
    }
}

/// The task.
#[embassy_executor::task]
pub async fn send_frames(mut uart: Sender, pulse: Pulse) -> ! {
    let mut pause = Duration::MIN;
    loop {
        pulse.beat();
        // Flow control may stop a frame for long; others wait, or find no room.
        if with_timeout(BEAT, uart.flush()).await.is_err() {
            continue;
        }
        Timer::after(pause).await;
        pause = Duration::MIN;
        if let Ok(frame) = with_timeout(BEAT, OUT.receive()).await {
            uart.write(frame.as_slice());
            let is_p2p = frame.as_slice().get(2) == Some(&kind::RADIO_P2P_BROADCAST);
            pause = if is_p2p { TURN + AIR } else { TURN };
        }
    }
}
