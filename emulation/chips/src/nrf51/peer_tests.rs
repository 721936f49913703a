//! Tests of the nRF51, byte by byte on its line.

use super::*;

/// Sends a frame to the peer at the line's rate and returns the time at which it has arrived.
fn send(peer: &mut Nrf51, kind: u8, payload: &[u8], now: Time) -> Time {
    deliver(peer, &LinkFrame::new(kind, payload).unwrap().to_bytes(), now)
}

fn deliver(peer: &mut Nrf51, bytes: &[u8], mut now: Time) -> Time {
    for byte in bytes {
        let next = now + Time::from_micros(10);
        while let Some(at) = peer.next_event(now).filter(|at| *at < next) {
            peer.advance(at);
            now = at;
        }
        now = next;
        peer.receive(*byte, BAUD, now);
    }
    now
}

/// Returns a peer whose radio is ready and whose Bluetooth is off, and the time.
fn ready_peer() -> (Nrf51, Time) {
    let mut peer = Nrf51::new();
    let now = send(&mut peer, 0x0b, &[], Time::ZERO);
    let now = send(&mut peer, 0x0a, &[0], now);
    let end = Time::from_millis(10);
    listen(&mut peer, now, end);
    peer.take_events();
    (peer, end)
}

/// Returns all frames that the peer sends until `until`, and the time at which each was complete.
fn listen(peer: &mut Nrf51, mut now: Time, until: Time) -> Vec<(Time, LinkFrame)> {
    let mut parser = Nrf51Parser::default();
    let mut frames = Vec::new();
    while now <= until {
        for output in peer.advance(now) {
            if let PeerAction::Byte(byte) = output
                && let Some(arrived) = parser.push(byte)
            {
                assert!(arrived.first_sum_good && arrived.second_sum_good);
                frames.push((now, arrived.frame));
            }
        }
        match peer.next_event(now) {
            Some(at) => now = at,
            None => break,
        }
    }
    frames
}

fn kinds(frames: &[(Time, LinkFrame)]) -> Vec<u8> {
    frames.iter().map(|(_, frame)| frame.kind()).collect()
}

#[test]
fn silent_until_the_first_good_frame() {
    let mut peer = Nrf51::new();
    peer.send_frame(&LinkFrame::new(0x30, *b"hello").unwrap(), Time::ZERO);
    peer.receive(0x00, BAUD, Time::ZERO);
    assert_eq!(listen(&mut peer, Time::ZERO, Time::from_millis(100)), []);
    assert_eq!(peer.not_sent, 1);
    let now = send(&mut peer, 0x01, &[80], Time::from_millis(100));
    let frames = listen(&mut peer, now, Time::from_millis(200));
    assert_eq!(kinds(&frames), [0x01], "the channel is echoed");
    // Seven bytes of 10 µs each.
    assert_eq!(frames[0].0, now + Time::from_micros(70));
}

#[test]
fn reports_every_ten_milliseconds_after_a_request() {
    let mut peer = Nrf51::new();
    peer.set_battery(Battery { volts: 3.5, charging: true, usb_powered: false });
    let now = send(&mut peer, 0x14, &[], Time::ZERO);
    // The first report comes a second after the reset, which was 100 ms before the start.
    let frames = listen(&mut peer, now, Time::from_millis(925));
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
    let p2p = LinkFrame::new(0x0a, [0, 40, 1, 2, 3]).unwrap();
    let now = send(&mut peer, 0x02, &[2], Time::ZERO);
    peer.send_frame(&p2p, now);
    assert_eq!(kinds(&listen(&mut peer, now, Time::from_millis(10))), [0x02]);
    let now = send(&mut peer, 0x0b, &[], Time::from_millis(10));
    peer.send_frame(&p2p, now);
    assert_eq!(kinds(&listen(&mut peer, now, Time::from_millis(20))), [0x0b, 0x0a]);
}

/// The loop does not read the queue during Bluetooth's shutdown. RTS does not show this, and bytes
/// are lost.
#[test]
fn a_full_queue_drops_silently() {
    let mut peer = Nrf51::new();
    let now = send(&mut peer, 0x0a, &[7; 60], Time::ZERO);
    assert_eq!(peer.take_events().len(), 1, "read, and not yet transmitted");
    let bytes: Vec<u8> =
        (0..14).flat_map(|_| LinkFrame::new(0x01, [1; 4]).unwrap().to_bytes()).collect();
    for (number, byte) in (1..).zip(&bytes) {
        peer.receive(*byte, BAUD, now + Time::from_micros(10 * number));
        assert!(!peer.is_full(now));
    }
    assert_eq!((peer.state.queue.len(), peer.dropped, peer.overruns), (127, 13, 0));
    let end = now + Nrf51Settings::default().ble_shutdown;
    listen(&mut peer, now, end);
    assert_eq!(peer.state.queue.len(), 0);
    let kinds: Vec<BoardEvent> = peer.take_events().into_iter().map(|(_, event)| event).collect();
    assert!(matches!(kinds[0], BoardEvent::P2p { port: 7, .. }), "{kinds:?}");
    assert_eq!(kinds.len(), 1 + 12, "twelve whole frames");
}

/// Interrupts are off during the shutdown, so the FIFO fills: RTS rises, and a sender that ignores
/// it loses bytes.
#[test]
fn rts_follows_the_fifo() {
    for rts_bytes in [1, 2, 4] {
        let mut peer = Nrf51::new();
        peer.set(Nrf51Settings { rts_bytes, ble_masks: true, ..Nrf51Settings::default() });
        let now = send(&mut peer, 0x0a, &[7; 60], Time::ZERO);
        for count in 1..=8 {
            peer.receive(0, BAUD, now);
            assert_eq!(peer.is_full(now), count >= rts_bytes, "{count} bytes");
        }
        assert_eq!((peer.overruns, peer.dropped, peer.state.queue.len()), (2, 0, 0));
        let end = peer.next_event(now).unwrap();
        assert_eq!(end, now + Nrf51Settings::default().ble_shutdown);
        peer.advance(end);
        assert!(!peer.is_full(end));
    }
}

/// The loop sends a frame byte by byte and reads one frame in each of its turns.
#[test]
fn packets_of_the_radio_keep_the_loop_from_the_queue() {
    let (mut peer, start) = ready_peer();
    // Each frame takes 68 bytes on the line.
    (0..3).for_each(|_| peer.add_frame(&P2pFrame::new(3, 60, [9; 60]).unwrap(), start));
    peer.advance(start);
    let now = deliver(&mut peer, &LinkFrame::new(0x17, []).unwrap().to_bytes().repeat(4), start);
    assert_eq!(peer.state.queue.len(), 24);
    for (after_us, left) in [(670, 24), (690, 18), (1370, 12), (2050, 0)] {
        listen(&mut peer, now, start + Time::from_micros(after_us));
        assert_eq!(peer.state.queue.len(), left, "after {after_us} us");
    }
}

/// The radio has one buffer for P2P frames.
#[test]
fn a_frame_on_the_air_is_cut_off_by_the_next() {
    let (mut peer, start) = ready_peer();
    let now = send(&mut peer, 0x0a, &[1; 30], start);
    let now = send(&mut peer, 0x0a, &[2], now);
    assert_eq!(peer.radio().cut, 1);
    // The next byte's frame would be on the air for 175 us and more.
    let now = send(&mut peer, 0x01, &[80], now);
    assert_eq!(peer.radio().cut, 2);
    let now = send(&mut peer, 0x0a, &[3], now);
    send(&mut peer, 0x0a, &[4], now + Time::from_millis(1));
    assert_eq!(peer.radio().cut, 2);
}

#[test]
fn a_restart_forgets_everything() {
    let (mut peer, now) = ready_peer();
    let counted = peer.received;
    peer.restart(now);
    assert!(peer.is_full(now), "only a pull-up drives the line");
    send(&mut peer, 0x01, &[80], now);
    let up = now + BOOT;
    assert_eq!(listen(&mut peer, now, up), []);
    assert!(!peer.is_full(up));
    assert_eq!((peer.received, peer.state.queue.len()), (counted, 0));
    peer.send_frame(&LinkFrame::new(0x0a, [3, 60, 1]).unwrap(), up);
    assert_eq!(peer.not_sent, 1, "the radio's gate is closed");
    let now = send(&mut peer, 0x0b, &[], up);
    assert_eq!(kinds(&listen(&mut peer, now, up + Time::from_millis(5))), [0x0b]);
}

/// Firmware from before October 2025 ignores RADIO_READY.
#[test]
fn old_firmware_sends_no_ready_and_has_no_gate() {
    let mut peer = Nrf51::new();
    peer.set(Nrf51Settings { knows_ready: false, ..Nrf51Settings::default() });
    let now = send(&mut peer, 0x0b, &[], Time::ZERO);
    assert_eq!(listen(&mut peer, now, Time::from_millis(5)), []);
    peer.send_frame(&LinkFrame::new(0x0a, [3, 60, 1]).unwrap(), Time::from_millis(5));
    let frames = listen(&mut peer, Time::from_millis(5), Time::from_millis(20));
    assert_eq!(kinds(&frames), [0x0a]);
}

#[test]
fn shutdown_is_acknowledged_or_runs_out() {
    for acknowledges in [true, false] {
        let mut peer = Nrf51::new();
        let now = send(&mut peer, 0x0b, &[], Time::ZERO);
        peer.request_shutdown(now);
        let frames = listen(&mut peer, now, Time::from_millis(999));
        assert_eq!(kinds(&frames), [0x0b, 0x15]);
        assert!(peer.is_powered());
        if acknowledges {
            send(&mut peer, 0x16, &[], Time::from_millis(999));
        } else {
            peer.advance(now + SHUTDOWN_AFTER);
        }
        assert!(!peer.is_powered());
        let (_, event) = peer.take_events().pop().unwrap();
        assert_eq!(event, BoardEvent::PowerOff { acknowledged: acknowledges });
    }
}

#[test]
fn the_probe_counts_bad_sums() {
    let mut peer = Nrf51::new();
    for byte in [0xbc, 0xcf, 0x14, 0x00, 0x15, 0x28, 0xbc, 0xcf, 0x14, 0x00, 0x14, 0x29] {
        peer.receive(byte, BAUD, Time::ZERO);
    }
    assert!(!peer.state.talks);
    let now = send(&mut peer, 0xf0, &[], Time::ZERO);
    let frames = listen(&mut peer, now, Time::from_millis(10));
    assert_eq!(frames[0].1.payload(), [0, 0, 0, 0, 0, 0, 1, 1]);
}

#[test]
fn another_baud_rate_is_not_understood() {
    let mut peer = Nrf51::new();
    for byte in LinkFrame::new(0x0b, []).unwrap().to_bytes() {
        peer.receive(byte, 950_000, Time::ZERO);
    }
    assert!(!peer.state.talks);
    assert_ne!(peer.framing_errors, 0);
}

/// Frames come from the air, wait while the line is busy, and go to the STM32 in order.
#[test]
fn frames_from_the_air_go_over_the_line() {
    let frame = |n: u8| P2pFrame::new(3, 60, vec![n; 60]).unwrap();
    let (mut peer, now) = ready_peer();
    // A frame is not received if its arrival began before the radio listened.
    let mut early = Nrf51::new();
    send(&mut early, 0x02, &[2], Time::ZERO);
    early.add_frame(&frame(0), Time::from_millis(1));
    assert_eq!(kinds(&listen(&mut early, Time::ZERO, Time::from_millis(10))), [0x02]);
    assert_eq!(early.not_sent, 1);
    // The frames arrive every 400 µs, and each takes 680 µs on the line.
    let start = now + Time::from_millis(1);
    for n in 0..5 {
        peer.add_frame(&frame(n), start + Time::from_micros(400 * u64::from(n)));
    }
    let frames = listen(&mut peer, now, now + Time::from_millis(10));
    assert_eq!(kinds(&frames), [0x0a; 5]);
    for (n, (at, frame)) in (0..).zip(&frames) {
        assert_eq!(*at, start + Time::from_micros(680 * (u64::from(n) + 1)));
        assert_eq!(frame.payload(), [&[3, 60][..], &[n; 60]].concat());
    }
}

/// A transmitting radio receives nothing.
#[test]
fn a_broadcast_is_reported_when_it_begins() {
    let (mut peer, now) = ready_peer();
    let now = send(&mut peer, 0x0a, &[0xf3, 1, 2, 3], now + Time::from_millis(1));
    let event = peer.take_events().pop().unwrap();
    let air = Time::from_nanos(130_000 + (8 * 14 + 1) * 500);
    assert_eq!(event, (now, BoardEvent::P2p { port: 3, payload: vec![1, 2, 3], air }));
    peer.add_frame(&P2pFrame::new(3, 60, [9; 3]).unwrap(), now + Time::from_micros(100));
    peer.add_frame(&P2pFrame::new(3, 60, [8; 3]).unwrap(), now + air + Time::from_micros(100));
    let frames = listen(&mut peer, now, now + Time::from_millis(10));
    assert_eq!(frames.len(), 1);
    assert_eq!(frames[0].1.payload(), [3, 60, 8, 8, 8]);
    assert_eq!(peer.radio().unheard, 1);
}
