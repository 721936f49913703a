//! Frames to the nRF51, one after the other.

use core::sync::atomic::Ordering;

use bittybuzz_comms::syslink::{Bytes, MTU, Packet};
use bittybuzz_runtime::liveness::{BEAT, Pulse};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::with_timeout;

use super::STATE;
use super::uart::Sender;

/// Frames that wait to be sent.
static OUT: Channel<CriticalSectionRawMutex, Bytes, 8> = Channel::new();

/// The nRF51 never needs so many beats to make room. A frame that waits longer is dropped, so that a dead neighbour does
/// not block the robot. What of it is in the ring already is cut off by the start of the next.
const PATIENCE: u32 = 2;

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
    loop {
        pulse.beat();
        let Ok(frame) = with_timeout(BEAT, OUT.receive()).await else { continue };
        if !deliver(&mut uart, frame.as_slice(), pulse).await {
            STATE.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// Whether the nRF51 has taken, or has room for, the whole frame.
async fn deliver(uart: &mut Sender, mut bytes: &[u8], pulse: Pulse) -> bool {
    let mut waited = 0;
    while !bytes.is_empty() {
        match with_timeout(BEAT, uart.write(bytes)).await {
            Ok(written) => {
                bytes = bytes.get(written..).unwrap_or(&[]);
                waited = 0;
            }
            Err(_) if waited < PATIENCE => {
                pulse.beat();
                waited += 1;
            }
            Err(_) => return false,
        }
    }
    true
}
