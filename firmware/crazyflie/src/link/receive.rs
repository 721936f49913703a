//! The receiving task: turns bytes from the nRF51 into frames, and handles the frames.

use core::sync::atomic::Ordering;

use bittybuzz_comms::syslink::{RadioSettings, SWARM_PORT, SyslinkPacket, SyslinkParser};
use bittybuzz_runtime::liveness::{BEAT, Pulse};
use embassy_time::with_timeout;

use super::one_wire;
use super::send::send;
use super::setup::RadioSetup;
use super::swarm::SwarmReceiver;
use super::uart::Receiver;
use super::{STATE, station};
use crate::motors;

/// Runs the receiving task.
#[embassy_executor::task]
pub async fn receive_frames(
    mut uart: Receiver,
    radio: RadioSettings,
    robot_id: u16,
    pulse: Pulse,
) -> ! {
    let mut parser = SyslinkParser::new();
    let mut radio_setup = RadioSetup::new(radio, robot_id);
    let mut swarm_receiver = SwarmReceiver::new(robot_id);
    let mut buffer = [0; 64];
    loop {
        pulse.beat();
        radio_setup.poll();
        let Ok(count) = with_timeout(BEAT, uart.read(&mut buffer)).await else { continue };
        for byte in buffer.iter().take(count) {
            parser.push(*byte, |frame| {
                STATE.received.fetch_add(1, Ordering::Relaxed);
                if one_wire::is_request(frame.kind()) {
                    return one_wire::receive(frame);
                }
                // Packets of types that this firmware does not use are ignored.
                if let Ok(packet) = SyslinkPacket::received(frame) {
                    radio_setup.process(&packet);
                    act(&packet, &mut swarm_receiver);
                }
            });
        }
        STATE.rejected.store(parser.rejected(), Ordering::Relaxed);
    }
}

fn act(packet: &SyslinkPacket<'_>, swarm_receiver: &mut SwarmReceiver) {
    match packet {
        SyslinkPacket::Raw(data) => station::receive(data),
        SyslinkPacket::Rssi(dbm) => STATE.rssi.store(*dbm, Ordering::Relaxed),
        SyslinkPacket::P2pReceived { port, rssi, data } => {
            STATE.rssi.store(*rssi, Ordering::Relaxed);
            STATE.heard.fetch_add(1, Ordering::Relaxed);
            if *port == SWARM_PORT {
                swarm_receiver.process(data);
            }
        }
        SyslinkPacket::Battery(battery) => {
            // The parser checks that the voltage is at most 6 V.
            let mv = (battery.volts * 1000.0) as u16;
            STATE.battery_mv.store(mv, Ordering::Relaxed);
            STATE.usb_powered.store(battery.usb_powered, Ordering::Relaxed);
        }
        SyslinkPacket::ShutdownRequest => {
            motors::cut_power();
            send(&SyslinkPacket::ShutdownAck);
        }
        _ => {}
    }
}
