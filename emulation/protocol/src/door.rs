//! The door of an emulated Crazyflie for ground stations: CRTP packets in UDP datagrams on this computer,
//! as cflib's driver for `udp://` exchanges them.
//!
//! A datagram is one packet: its header and at most 30 bytes. A ground station looks for robots with a null
//! packet, which gets one as the answer. The door passes at most one packet to the robot in a millisecond of
//! its time, about as fast as a Crazyradio; others wait in the socket, as in a radio's queue, and are lost
//! when that is full. Bitcraze's firmware sends a packet only as the answer to one, so the door polls the robot
//! with null packets, as a Crazyradio does.

use std::io;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};

/// Type of the link frames that carry packets of ground stations, in both directions.
pub(crate) const PACKET: u8 = 0x00;
/// Bytes of the longest packet.
const PACKET_MAX: usize = 31;
/// The header of a null packet: port 15, channel 3, without the two bits that a link may use.
const NULL_HEADER: u8 = 0xf3;
const NULL_PACKET: [u8; 1] = [0xff];

/// A door that is open.
#[derive(Debug)]
pub(crate) struct Door {
    socket: UdpSocket,
    port: u16,
    /// The ground station that sent the last packet.
    station: Option<SocketAddr>,
    /// Calls of [`Door::poll`] without a packet since the last one.
    idle: u32,
}

/// Milliseconds without a packet after which the robot is polled.
const POLL_MS: u32 = 2;

impl Door {
    /// Opens a door at a port of this computer.
    pub fn open(port: u16) -> io::Result<Self> {
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, port))?;
        socket.set_nonblocking(true)?;
        Ok(Door { socket, port, station: None, idle: 0 })
    }

    /// Returns the port at which it was opened.
    pub fn port(&self) -> u16 {
        self.port
    }

    /// Returns the packet that the robot gets in this millisecond, if any.
    pub fn poll(&mut self) -> Option<Vec<u8>> {
        if let Some(packet) = self.receive() {
            self.idle = 0;
            return Some(packet);
        }
        self.idle += 1;
        let is_due = self.station.is_some() && self.idle >= POLL_MS;
        is_due.then(|| {
            self.idle = 0;
            NULL_PACKET.to_vec()
        })
    }

    /// Returns the next packet of a station, and answers null packets before it. Datagrams that are no
    /// packets are dropped.
    fn receive(&mut self) -> Option<Vec<u8>> {
        let mut room = [0; PACKET_MAX + 1];
        loop {
            let (length, from) = match self.socket.recv_from(&mut room) {
                Ok(received) => received,
                // Linux reports here that a station is gone, to which a packet was sent before.
                Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => continue,
                Err(_) => return None,
            };
            match room.get(..length) {
                Some([header, ..]) if header & NULL_HEADER == NULL_HEADER => {
                    // A station that does not wait for the answer misses nothing.
                    let _ = self.socket.send_to(&NULL_PACKET, from);
                }
                Some(packet @ [_, ..]) if length <= PACKET_MAX => {
                    self.station = Some(from);
                    return Some(packet.to_vec());
                }
                _ => {}
            }
        }
    }

    /// Sends a packet of the robot to the ground station, if there is one. A packet is lost when the station
    /// does not read, as on the air.
    pub fn send(&self, packet: &[u8]) {
        if let Some(station) = self.station {
            let _ = self.socket.send_to(packet, station);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn station() -> UdpSocket {
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        socket.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
        socket
    }

    fn open() -> (Door, SocketAddr) {
        let door = Door::open(0).unwrap();
        let address = door.socket.local_addr().unwrap();
        (door, address)
    }

    /// Waits for a packet, because datagrams take a while.
    fn received(door: &mut Door) -> Vec<u8> {
        loop {
            if let Some(packet) = door.receive() {
                return packet;
            }
        }
    }

    #[test]
    fn packets_pass_in_both_directions() {
        let ((mut door, address), station) = (open(), station());
        door.send(&[1, 2]);
        station.send_to(&[0x3c, 7, 8], address).unwrap();
        assert_eq!(received(&mut door), [0x3c, 7, 8]);
        door.send(&[0x5c, 9]);
        let mut room = [0; 40];
        let length = station.recv(&mut room).unwrap();
        // Before the first packet of a station, those of the robot reach nobody.
        assert_eq!(room[..length], [0x5c, 9]);
    }

    /// cflib's scan sends 0xff and waits for any answer; it does not become the station.
    #[test]
    fn a_scan_is_answered() {
        let ((mut door, address), station, scanner) = (open(), station(), station());
        station.send_to(&[0x3c], address).unwrap();
        assert_eq!(received(&mut door), [0x3c]);
        scanner.send_to(&[0xff], address).unwrap();
        station.send_to(&[0x3d], address).unwrap();
        assert_eq!(received(&mut door), [0x3d]);
        let mut room = [0; 40];
        assert_eq!(scanner.recv(&mut room).unwrap(), 1);
        assert_eq!(room[0], 0xff);
        door.send(&[0x11]);
        assert_eq!((station.recv(&mut room).unwrap(), room[0]), (1, 0x11));
    }

    #[test]
    fn a_robot_with_a_station_is_polled() {
        let ((mut door, address), station) = (open(), station());
        assert!((0..10).all(|_| door.poll().is_none()), "nobody reads the answers");
        station.send_to(&[0x3c], address).unwrap();
        let mut polls = std::iter::repeat_with(|| door.poll()).skip_while(Option::is_none);
        assert_eq!(polls.next(), Some(Some(vec![0x3c])));
        assert_eq!([polls.next(), polls.next()], [Some(None), Some(Some(vec![0xff]))]);
    }

    #[test]
    fn other_datagrams_are_dropped() {
        let ((mut door, address), station) = (open(), station());
        station.send_to(&[], address).unwrap();
        station.send_to(&[0x3c; 32], address).unwrap();
        station.send_to(&[0x3c; 31], address).unwrap();
        assert_eq!(received(&mut door), [0x3c; 31]);
    }

    #[test]
    fn a_station_that_is_gone_does_not_close_the_door() {
        let ((mut door, address), gone) = (open(), station());
        gone.send_to(&[0x3c], address).unwrap();
        received(&mut door);
        drop(gone);
        door.send(&[1]);
        let station = station();
        station.send_to(&[0x4c], address).unwrap();
        assert_eq!(received(&mut door), [0x4c]);
    }
}
