//! Packets by the table of Bitcraze's protocol: every type, and the rejected data.

use bittybuzz_comms::syslink::{
    Battery, DataRate, FrameError, MTU, P2P_MAX, PacketError, SyslinkFrame, SyslinkPacket, kind,
};

fn received(kind: u8, data: &[u8]) -> Result<SyslinkPacket<'_>, PacketError> {
    SyslinkPacket::received(SyslinkFrame::new(kind, data).expect("it fits"))
}

#[test]
fn packets_from_the_nrf51() {
    assert_eq!(received(0x00, &[0xff, 1, 2]), Ok(SyslinkPacket::Raw(&[0xff, 1, 2])));
    assert_eq!(received(0x01, &[80]), Ok(SyslinkPacket::Channel(80)));
    assert_eq!(received(0x02, &[2]), Ok(SyslinkPacket::DataRate(DataRate::Megabits2)));
    assert_eq!(received(0x04, &[42]), Ok(SyslinkPacket::Rssi(-42)));
    assert_eq!(received(0x05, &[1, 2, 3, 4, 5]), Ok(SyslinkPacket::Address([1, 2, 3, 4, 5])));
    assert_eq!(received(0x07, &[0xf4]), Ok(SyslinkPacket::Power(-12)));
    assert_eq!(received(0x0b, &[]), Ok(SyslinkPacket::Ready));
    assert_eq!(
        received(0x0a, &[0, 55, 9, 8]),
        Ok(SyslinkPacket::P2pReceived { port: 0, rssi: -55, data: &[9, 8] })
    );
    assert_eq!(received(0x15, &[]), Ok(SyslinkPacket::ShutdownRequest));
    // The data are flags, 3.7 V as binary32 and the charger current; newer boards add a
    // temperature.
    let state = [0b011, 0xcd, 0xcc, 0x6c, 0x40, 0, 0, 0, 0];
    let battery = SyslinkPacket::Battery(Battery { charging: true, usb_powered: true, volts: 3.7 });
    assert_eq!(received(0x13, &state), Ok(battery));
    assert_eq!(received(0x13, &[&state[..], &[0; 4]].concat()), Ok(battery));
}

#[test]
fn the_greatest_and_the_least_values_are_accepted() {
    let crtp = [7; 31];
    assert_eq!(received(0x00, &crtp), Ok(SyslinkPacket::Raw(&crtp)));
    assert_eq!(received(0x00, &crtp[..1]), Ok(SyslinkPacket::Raw(&crtp[..1])));
    for channel in [0, 125] {
        assert_eq!(received(0x01, &[channel]), Ok(SyslinkPacket::Channel(channel)));
    }
    for rate in [DataRate::Kilobits250, DataRate::Megabit1, DataRate::Megabits2] {
        assert_eq!(received(0x02, &[rate as u8]), Ok(SyslinkPacket::DataRate(rate)));
    }
    let frame = [&[0xfb, 255][..], &[9; P2P_MAX]].concat();
    let longest = SyslinkPacket::P2pReceived { port: 11, rssi: -255, data: &frame[2..] };
    assert_eq!(received(0x0a, &frame), Ok(longest));
    assert_eq!(
        received(0x0a, &[15, 0]),
        Ok(SyslinkPacket::P2pReceived { port: 15, rssi: 0, data: &[] })
    );
    let battery = |volts: f32| received(0x13, &state(0, volts)).map(|_| ());
    for (volts, result) in [
        (0.0, Ok(())),
        (6.0, Ok(())),
        (0.0_f32.next_down(), Err(PacketError::Value(0x13))),
        (6.0_f32.next_up(), Err(PacketError::Value(0x13))),
        (f32::NAN, Err(PacketError::Value(0x13))),
    ] {
        assert_eq!(battery(volts), result, "{volts} V");
    }
}

/// Returns the data of a battery's state without a charger current.
fn state(flags: u8, volts: f32) -> [u8; 9] {
    let [v0, v1, v2, v3] = volts.to_le_bytes();
    [flags, v0, v1, v2, v3, 0, 0, 0, 0]
}

#[test]
fn values_out_of_range_and_wrong_lengths_are_rejected() {
    assert_eq!(received(0x99, &[]), Err(PacketError::UnknownKind(0x99)));
    assert_eq!(received(0x01, &[126]), Err(PacketError::Value(0x01)));
    assert_eq!(received(0x02, &[3]), Err(PacketError::Value(0x02)));
    for (kind, length) in [
        (0x00, 0),
        (0x00, 32),
        (0x01, 0),
        (0x04, 2),
        (0x05, 4),
        (0x0a, 1),
        (0x0a, 63),
        (0x0b, 1),
        (0x11, 1),
        (0x13, 8),
        (0x15, 1),
    ] {
        let data = [0; MTU];
        assert_eq!(
            received(kind, &data[..length]),
            Err(PacketError::Length(kind)),
            "{length} bytes"
        );
    }
}

#[test]
fn packets_to_the_nrf51() {
    let mut buffer = [0; MTU];
    let mut written = |packet: SyslinkPacket<'_>| {
        packet.frame(&mut buffer).map(|frame| frame.bytes().as_slice().to_vec())
    };
    assert_eq!(
        written(SyslinkPacket::BatteryAutoupdate),
        Ok(vec![0xbc, 0xcf, 0x14, 0, 0x14, 0x28])
    );
    assert_eq!(written(SyslinkPacket::Channel(80)), Ok(vec![0xbc, 0xcf, 1, 1, 0x50, 0x52, 0x55]));
    assert_eq!(
        written(SyslinkPacket::P2pSend { port: 0, data: &[1, 2, 3] }),
        Ok(vec![0xbc, 0xcf, 0x0a, 4, 0, 1, 2, 3, 0x14, 0x5a])
    );
    assert_eq!(
        written(SyslinkPacket::ShutdownAck),
        Ok(vec![0xbc, 0xcf, kind::PM_SHUTDOWN_ACK, 0, 0x16, 0x2c])
    );
    assert_eq!(
        written(SyslinkPacket::SwitchOff),
        Ok(vec![0xbc, 0xcf, kind::PM_ONOFF_SWITCHOFF, 0, 0x11, 0x22])
    );
    assert_eq!(
        written(SyslinkPacket::Rssi(-300)),
        Ok(vec![0xbc, 0xcf, kind::RADIO_RSSI, 1, 255, 4, 13])
    );
    // The data of a frame is a port and at most 63 bytes.
    assert!(written(SyslinkPacket::P2pSend { port: 0, data: &[0; 63] }).is_ok());
    assert_eq!(
        written(SyslinkPacket::P2pSend { port: 0, data: &[0; 64] }),
        Err(FrameError::TooLong)
    );
}
