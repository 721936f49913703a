//! The nRF51, byte by byte on its line.

use super::*;

/// Sends a frame to the peer at the line's rate and returns when it has arrived.
fn tell(peer: &mut Nrf51, kind: u8, payload: &[u8], mut now: Time) -> Time {
    for byte in Frame::new(kind, payload).unwrap().to_bytes() {
        now = now + Time::from_micros(10);
        peer.receive(byte, BAUD, now);
    }
    now
}

/// All frames that the peer sends until `until`, and when each was complete.
fn listen(peer: &mut Nrf51, mut now: Time, until: Time) -> Vec<(Time, Frame)> {
    let mut parser = Parser::default();
    let mut frames = Vec::new();
    while now <= until {
        for output in peer.advance(now) {
            if let Output::Byte(byte) = output
                && let Some(arrived) = parser.push(byte)
            {
                assert!(arrived.first_sum_good && arrived.second_sum_good);
                frames.push((now, arrived.frame));
            }
        }
        match peer.next_event() {
            Some(at) => now = at,
            None => break,
        }
    }
    frames
}

fn kinds(frames: &[(Time, Frame)]) -> Vec<u8> {
    frames.iter().map(|(_, frame)| frame.kind()).collect()
}

#[test]
fn silent_until_the_first_good_frame() {
    let mut peer = Nrf51::new();
    peer.send_frame(&Frame::new(0x30, *b"hello").unwrap(), Time::ZERO);
    peer.receive(0x00, BAUD, Time::ZERO);
    assert_eq!(listen(&mut peer, Time::ZERO, Time::from_millis(100)), []);
    assert_eq!(peer.not_sent, 1);
    let now = tell(&mut peer, 0x01, &[80], Time::from_millis(100));
    let frames = listen(&mut peer, now, Time::from_millis(200));
    assert_eq!(kinds(&frames), [0x01], "the channel is echoed");
    // Seven bytes of 10 µs each.
    assert_eq!(frames[0].0, now + Time::from_micros(70));
}

#[test]
fn reports_every_ten_milliseconds_once_asked() {
    let mut peer = Nrf51::new();
    peer.set_battery(Battery { volts: 3.5, charging: true, usb_powered: false });
    let now = tell(&mut peer, 0x14, &[], Time::ZERO);
    let frames = listen(&mut peer, now, now + Time::from_millis(35));
    assert_eq!(kinds(&frames), [0x13, 0x04, 0x13, 0x04, 0x13, 0x04]);
    let mut state = vec![1];
    state.extend(3.5_f32.to_le_bytes());
    state.extend(500.0_f32.to_le_bytes());
    assert_eq!(frames[0].1.payload(), state);
    assert_eq!(frames[1].1.payload(), [RSSI]);
}

#[test]
fn radio_frames_wait_for_ready() {
    let mut peer = Nrf51::new();
    let p2p = Frame::new(0x0a, [0, 40, 1, 2, 3]).unwrap();
    let now = tell(&mut peer, 0x02, &[2], Time::ZERO);
    peer.send_frame(&p2p, now);
    assert_eq!(kinds(&listen(&mut peer, now, Time::from_millis(10))), [0x02]);
    let now = tell(&mut peer, 0x0b, &[], Time::from_millis(10));
    peer.send_frame(&p2p, now);
    assert_eq!(kinds(&listen(&mut peer, now, Time::from_millis(20))), [0x0b, 0x0a]);
}

#[test]
fn a_broadcast_keeps_the_radio_busy_and_fills_the_queue() {
    let mut peer = Nrf51::new();
    // At 250 kb/s 60 bytes take more than 2 ms on the air, time for over 200 bytes on the line.
    let mut now = tell(&mut peer, 0x02, &[0], Time::ZERO);
    now = tell(&mut peer, 0x0a, &[7; 60], now);
    let busy = peer.radio.busy_until();
    assert_eq!(busy - now, Time::from_micros(130 + 4 * (8 * 70 + 1)));
    for _ in 0..130 {
        now = now + Time::from_micros(10);
        peer.receive(0, BAUD, now);
        assert_eq!(peer.is_full(), peer.queue.len() >= 125);
    }
    assert_eq!((peer.queue.len(), peer.dropped), (128, 2));
    assert_eq!(peer.next_event(), Some(busy));
    peer.advance(busy);
    assert!(!peer.is_full());
}

#[test]
fn shutdown_is_acknowledged_or_runs_out() {
    for acknowledges in [true, false] {
        let mut peer = Nrf51::new();
        let now = tell(&mut peer, 0x0b, &[], Time::ZERO);
        peer.request_shutdown(now);
        let frames = listen(&mut peer, now, Time::from_millis(50));
        assert_eq!(kinds(&frames), [0x0b, 0x15]);
        assert!(peer.is_powered());
        if acknowledges {
            tell(&mut peer, 0x16, &[], Time::from_millis(50));
        } else {
            peer.advance(now + SHUTDOWN_AFTER);
        }
        assert!(!peer.is_powered());
        let (_, event) = peer.take_events().pop().unwrap();
        assert_eq!(event, Event::PowerOff { acknowledged: acknowledges });
    }
}

#[test]
fn the_probe_counts_bad_sums() {
    let mut peer = Nrf51::new();
    for byte in [0xbc, 0xcf, 0x14, 0x00, 0x15, 0x28, 0xbc, 0xcf, 0x14, 0x00, 0x14, 0x29] {
        peer.receive(byte, BAUD, Time::ZERO);
    }
    assert!(!peer.talks);
    let now = tell(&mut peer, 0xf0, &[], Time::ZERO);
    let frames = listen(&mut peer, now, Time::from_millis(10));
    assert_eq!(frames[0].1.payload(), [0, 0, 0, 0, 0, 0, 1, 1]);
}

#[test]
fn another_baud_rate_is_not_understood() {
    let mut peer = Nrf51::new();
    for byte in Frame::new(0x0b, []).unwrap().to_bytes() {
        peer.receive(byte, 950_000, Time::ZERO);
    }
    assert!(!peer.talks);
    assert_ne!(peer.framing_errors, 0);
}

/// Frames come from the air, wait while the line is busy, and go to the STM32 in order.
#[test]
fn frames_from_the_air_go_over_the_line() {
    let mut peer = Nrf51::new();
    let frame = |n: u8| P2pFrame::new(3, 60, vec![n; 60]).unwrap();
    let now = tell(&mut peer, 0x0b, &[], Time::ZERO);
    // Before the radio listens nothing is heard, also what began to arrive.
    let mut early = Nrf51::new();
    tell(&mut early, 0x02, &[2], Time::ZERO);
    early.hear(&frame(0), Time::from_millis(1));
    assert_eq!(kinds(&listen(&mut early, Time::ZERO, Time::from_millis(10))), [0x02]);
    assert_eq!(early.not_sent, 1);
    // Every 400 µs, and each takes 680 µs on the line.
    let start = now + Time::from_millis(1);
    for n in 0..5 {
        peer.hear(&frame(n), start + Time::from_micros(400 * u64::from(n)));
    }
    let frames = listen(&mut peer, now, now + Time::from_millis(10));
    assert_eq!(kinds(&frames), [0x0b, 0x0a, 0x0a, 0x0a, 0x0a, 0x0a]);
    for (n, (at, frame)) in (0..).zip(&frames[1..]) {
        assert_eq!(*at, start + Time::from_micros(680 * (u64::from(n) + 1)));
        assert_eq!(frame.payload(), [&[3, 60][..], &[n; 60]].concat());
    }
}

/// Who transmits is heard by nobody who transmits.
#[test]
fn a_broadcast_is_told_when_it_begins() {
    let mut peer = Nrf51::new();
    let now = tell(&mut peer, 0x0b, &[], Time::ZERO);
    listen(&mut peer, now, now + Time::from_millis(1));
    let now = tell(&mut peer, 0x0a, &[0xf3, 1, 2, 3], now + Time::from_millis(1));
    let event = peer.take_events().pop().unwrap();
    let air = Time::from_nanos(130_000 + (8 * 14 + 1) * 500);
    assert_eq!(event, (now, Event::P2p { port: 3, payload: vec![1, 2, 3], air }));
    peer.hear(&P2pFrame::new(3, 60, [9; 3]).unwrap(), now + Time::from_micros(100));
    peer.hear(&P2pFrame::new(3, 60, [8; 3]).unwrap(), now + air + Time::from_micros(100));
    let frames = listen(&mut peer, now, now + Time::from_millis(10));
    assert_eq!(frames.len(), 1);
    assert_eq!(frames[0].1.payload(), [3, 60, 8, 8, 8]);
    assert_eq!(peer.radio.unheard, 1);
}
