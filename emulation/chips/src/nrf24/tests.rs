//! Tests of two radios in range of each other, through their pins.

use super::*;

/// Returns a radio that has its clock, and the time 100 ms after power-on.
fn radio() -> (Nrf24, Time) {
    let mut radio = Nrf24::new();
    radio.set_clock(CLOCK_HZ, Time::ZERO);
    (radio, POWER_ON)
}

/// Sends a command and its data; returns the bytes after STATUS.
fn command(radio: &mut Nrf24, bytes: &[u8], now: Time) -> Vec<u8> {
    radio.select(true, now);
    let answer = bytes.iter().map(|byte| radio.transfer(*byte, now)).collect();
    radio.select(false, now);
    answer
}

fn set(radio: &mut Nrf24, register: u8, value: u8, now: Time) {
    command(radio, &[0x20 | register, value], now);
}

fn get(radio: &mut Nrf24, register: u8, now: Time) -> u8 {
    command(radio, &[register, 0xff], now)[1]
}

/// Powers the radio up as receiver or sender: no acknowledgement, 2 Mb/s, CRC of two bytes, eight
/// bytes on pipe 0.
fn start(radio: &mut Nrf24, is_receiver: bool, now: Time) -> Time {
    set(radio, 0x01, 0, now);
    set(radio, 0x04, 0, now);
    set(radio, 0x11, 8, now);
    set(radio, 0x00, 0x0e | u8::from(is_receiver), now);
    let standby = now + Time::from_micros(150);
    radio.advance(standby);
    standby
}

/// Runs `radio` alone until `until`, and returns its announcements.
fn run(radio: &mut Nrf24, until: Time) -> Vec<Transmission> {
    while let Some(at) = radio.next_event().filter(|at| *at <= until) {
        radio.advance(at);
    }
    radio.take_transmissions()
}

/// Delivers the announcements of `from` to `to`.
fn carry(from: Vec<Transmission>, to: &mut Nrf24) {
    for transmission in from {
        to.sense(transmission.packet.channel(), transmission.begin, transmission.end, Time::ZERO);
        to.receive(transmission, true);
    }
}

#[test]
fn registers_have_the_specifications_reset_values() {
    let (mut radio, now) = radio();
    for (register, value) in [
        (0x00, 0x08),
        (0x01, 0x3f),
        (0x02, 0x03),
        (0x03, 0x03),
        (0x04, 0x03),
        (0x05, 0x02),
        (0x06, 0x0e),
        (0x07, 0x0e),
        (0x08, 0x00),
        (0x09, 0x00),
        (0x0c, 0xc3),
        (0x11, 0x00),
        (0x17, 0x11),
        (0x1c, 0x00),
        (0x1d, 0x00),
    ] {
        assert_eq!(get(&mut radio, register, now), value, "register {register:#04x}");
    }
    assert_eq!(command(&mut radio, &[0x10, 0, 0, 0, 0, 0], now)[1..], [0xe7; 5]);
    assert_eq!(command(&mut radio, &[0xff], now), [0x0e], "NOP gives STATUS");
}

#[test]
fn spi_is_dead_before_the_power_on_reset_is_over() {
    let (mut radio, now) = radio();
    let early = now - Time::from_nanos(1);
    assert_eq!(command(&mut radio, &[0xff], early), [0]);
    assert_eq!(radio.statistics.too_early, 1);
}

#[test]
fn without_a_clock_nothing_is_transmitted() {
    for hz in [0, 8_000_000, 48_000_000] {
        let mut radio = Nrf24::new();
        radio.set_clock(hz, Time::ZERO);
        let now = start(&mut radio, false, POWER_ON);
        command(&mut radio, &[0xa0, 1, 2, 3, 4, 5, 6, 7, 8], now);
        radio.enable(true, now);
        assert_eq!(run(&mut radio, now + Time::from_millis(10)), [], "{hz} Hz");
        radio.set_clock(CLOCK_HZ, now + Time::from_millis(10));
        assert_eq!(run(&mut radio, now + Time::from_millis(11)).len(), 1);
    }
}

#[test]
fn a_packet_takes_the_time_of_its_bits() {
    let (mut sender, now) = radio();
    let now = start(&mut sender, false, now);
    let (mut receiver, _) = radio();
    start(&mut receiver, true, POWER_ON);
    receiver.enable(true, now);
    command(&mut sender, &[0xa0, 1, 2, 3, 4, 5, 6, 7, 8], now);
    sender.enable(true, now);
    let sent = run(&mut sender, now + Time::from_millis(1));
    let [Transmission { begin, end, .. }] = sent[..] else { panic!("{sent:?}") };
    // The fixed times of table 16, and 8 * (1 + 5 + 8 + 2) bits at 2 Mb/s.
    assert_eq!(begin, now + Time::from_micros(130));
    assert_eq!(end, begin + Time::from_micros(64));
    assert_eq!(get(&mut sender, 0x07, end) & 0x70, 0x20, "TX_DS");
    assert!(!sender.irq());
    // A receiver that was switched on at the same time was ready for the first bit.
    carry(sent, &mut receiver);
    run(&mut receiver, end);
    assert!(!receiver.irq());
    assert_eq!(get(&mut receiver, 0x07, end), 0x40, "RX_DR, pipe 0");
    let answer = command(&mut receiver, &[0x61, 0, 0, 0, 0, 0, 0, 0, 0], end);
    assert_eq!(answer[1..], [1, 2, 3, 4, 5, 6, 7, 8]);
    set(&mut receiver, 0x07, 0x40, end);
    assert!(receiver.irq());
    assert_eq!(get(&mut receiver, 0x07, end), 0x0e, "the FIFO is empty");
}

#[test]
fn air_time_follows_rate_and_format() {
    let (mut radio, now) = radio();
    start(&mut radio, false, now);
    for (rf_setup, micros) in [(0x0e, 1), (0x06, 2), (0x26, 8)] {
        set(&mut radio, 0x06, rf_setup, now);
        // Dynamic length, enhanced, address of 3 bytes, CRC of 1 byte: 8 * (1 + 3 + 20 + 1) + 9
        // bits.
        set(&mut radio, 0x01, 1, now);
        set(&mut radio, 0x03, 1, now);
        set(&mut radio, 0x00, 0x0a, now);
        command(&mut radio, &[0xe1], now);
        command(&mut radio, &[&[0xa0][..], &[7; 20]].concat(), now);
        let air = radio.transmission_time();
        assert_eq!(air, Time::from_nanos(209 * 500 * micros), "RF_SETUP {rf_setup:#04x}");
    }
}

impl Nrf24 {
    /// Returns the time that the waiting packet would be on the air.
    fn transmission_time(&mut self) -> Time {
        let mut copy = Nrf24::new();
        std::mem::swap(&mut copy.registers, &mut self.registers);
        std::mem::swap(&mut copy.transmit, &mut self.transmit);
        copy.set_clock(CLOCK_HZ, POWER_ON);
        copy.control(POWER_ON);
        copy.enable(true, POWER_ON);
        let sent = run(&mut copy, POWER_ON + Time::from_millis(1));
        self.registers = copy.registers;
        sent[0].end - sent[0].begin
    }
}

#[test]
fn a_short_pulse_sends_nothing_and_a_long_one_a_packet() {
    let (mut radio, now) = radio();
    let now = start(&mut radio, false, now);
    for payload in [1, 2] {
        command(&mut radio, &[0xa0, payload], now);
    }
    radio.enable(true, now);
    radio.enable(false, now + Time::from_micros(9));
    assert_eq!(run(&mut radio, now + Time::from_millis(1)), []);
    assert_eq!(radio.statistics.short_pulses, 1);
    let now = now + Time::from_millis(1);
    radio.enable(true, now);
    run(&mut radio, now + Time::from_micros(10));
    radio.enable(false, now + Time::from_micros(10));
    run(&mut radio, now + Time::from_millis(1));
    assert_eq!(get(&mut radio, 0x17, now) & 0x10, 0, "the second payload still waits");
    assert_eq!(radio.statistics.sent, 1);
}

#[test]
fn dynamic_payloads_without_acknowledgement() {
    let (mut sender, now) = radio();
    let (mut receiver, _) = radio();
    for radio in [&mut sender, &mut receiver] {
        set(radio, 0x1d, 0x05, now);
        set(radio, 0x1c, 0x3f, now);
        set(radio, 0x00, 0x0e, now);
    }
    set(&mut receiver, 0x00, 0x0f, now);
    receiver.enable(true, now);
    let now = now + Time::from_millis(1);
    run(&mut receiver, now);
    run(&mut sender, now);
    command(&mut sender, &[0xb0, 9, 8, 7], now);
    sender.enable(true, now);
    let sent = run(&mut sender, now + Time::from_millis(1));
    assert_eq!(get(&mut sender, 0x07, now) & 0x70, 0x20, "TX_DS at once");
    carry(sent, &mut receiver);
    let now = now + Time::from_millis(1);
    assert_eq!(run(&mut receiver, now), [], "no acknowledgement");
    assert_eq!(command(&mut receiver, &[0x60, 0], now)[1], 3);
    assert_eq!(command(&mut receiver, &[0x61, 0, 0, 0], now)[1..], [9, 8, 7]);
}

#[test]
fn w_tx_payload_noack_needs_its_feature() {
    let (mut radio, now) = radio();
    command(&mut radio, &[0xb0, 1], now);
    assert_eq!(get(&mut radio, 0x17, now) & 0x10, 0x10, "TX FIFO empty");
}

#[test]
fn acknowledged_packets_come_back_with_a_payload() {
    let (mut sender, now) = radio();
    let (mut receiver, _) = radio();
    for radio in [&mut sender, &mut receiver] {
        set(radio, 0x1d, 0x06, now);
        set(radio, 0x1c, 0x3f, now);
        set(radio, 0x04, 0x13, now);
        set(radio, 0x00, 0x0e, now);
    }
    set(&mut receiver, 0x00, 0x0f, now);
    command(&mut receiver, &[0xa8, 0x55, 0x66], now);
    receiver.enable(true, now);
    let now = now + Time::from_millis(1);
    run(&mut receiver, now);
    run(&mut sender, now);
    command(&mut sender, &[0xa0, 1], now);
    sender.enable(true, now);
    let sent = run(&mut sender, now + Time::from_micros(200));
    let end = sent[0].end;
    carry(sent, &mut receiver);
    let answer = run(&mut receiver, end + Time::from_micros(1));
    assert_eq!(answer[0].begin, end + Time::from_micros(130));
    let answered = answer[0].end;
    carry(answer, &mut sender);
    run(&mut sender, answered);
    assert_eq!(get(&mut sender, 0x07, answered) & 0x70, 0x60, "TX_DS and RX_DR");
    assert_eq!(command(&mut sender, &[0x61, 0, 0], answered)[1..], [0x55, 0x66]);
}

#[test]
fn unanswered_packets_are_repeated_and_given_up() {
    let (mut radio, now) = radio();
    set(&mut radio, 0x04, 0x12, now);
    set(&mut radio, 0x00, 0x0e, now);
    let now = now + Time::from_millis(1);
    run(&mut radio, now);
    command(&mut radio, &[0xa0, 1], now);
    radio.enable(true, now);
    let sent = run(&mut radio, now + Time::from_millis(10));
    assert_eq!(sent.len(), 3);
    // ARD is 500 µs, from the end of a packet to the beginning of the next.
    assert_eq!(sent[1].begin, sent[0].end + Time::from_micros(500));
    assert_eq!(get(&mut radio, 0x07, now) & 0x70, 0x10, "MAX_RT");
    assert_eq!(get(&mut radio, 0x08, now), 0x12, "one lost, two repetitions");
    assert_eq!(get(&mut radio, 0x17, now) & 0x10, 0, "the payload stays");
}

#[test]
fn the_receive_fifo_holds_three() {
    let (mut sender, now) = radio();
    let now = start(&mut sender, false, now);
    let (mut receiver, _) = radio();
    start(&mut receiver, true, POWER_ON);
    receiver.enable(true, now);
    for number in 0..4 {
        command(&mut sender, &[0xa0, number, 0, 0, 0, 0, 0, 0, 0], now);
        sender.enable(true, now);
        let sent = run(&mut sender, now + Time::from_millis(2 + u64::from(number)));
        carry(sent, &mut receiver);
        sender.enable(false, now);
        set(&mut sender, 0x07, 0x70, now);
    }
    run(&mut receiver, now + Time::from_millis(10));
    assert_eq!(receiver.statistics.received, 3);
    assert_eq!(receiver.statistics.overflown, 1);
    assert_eq!(get(&mut receiver, 0x17, now) & 0x03, 0x02, "RX_FULL");
}

#[test]
fn carrier_is_detected_while_it_lasts() {
    let (mut radio, now) = radio();
    let now = start(&mut radio, true, now);
    radio.enable(true, now);
    let listening = now + Time::from_micros(130);
    radio.advance(listening);
    radio.sense(2, listening, listening + Time::from_micros(100), listening);
    radio.sense(3, listening, listening + Time::from_millis(1), listening);
    // A signal that is announced long before it begins.
    let later = listening + Time::from_micros(500);
    radio.sense(2, later, later + Time::from_micros(100), listening);
    for (micros, detected) in [(39, 0), (40, 1), (99, 1), (100, 0), (540, 1)] {
        assert_eq!(get(&mut radio, 0x09, listening + Time::from_micros(micros)), detected);
    }
}

/// Reads RPD after a packet, 1 ms later, after CE was low, and once the radio listens again.
#[test]
fn a_packet_latches_the_detector_until_ce_goes_low_or_not_at_all() {
    for (reading, after) in [(PowerDetector::Latched, 1), (PowerDetector::Live, 0)] {
        let (mut sender, now) = radio();
        let now = start(&mut sender, false, now);
        let (mut receiver, _) = radio();
        receiver.set_power_detector(reading);
        start(&mut receiver, true, POWER_ON);
        receiver.enable(true, now);
        command(&mut sender, &[0xa0, 1, 2, 3, 4, 5, 6, 7, 8], now);
        sender.enable(true, now);
        let sent = run(&mut sender, now + Time::from_millis(1));
        let [Transmission { begin, end, .. }] = sent[..] else { panic!("{sent:?}") };
        carry(sent, &mut receiver);
        run(&mut receiver, begin + Time::from_micros(45));
        assert_eq!(get(&mut receiver, 0x09, begin + Time::from_micros(45)), 1, "while it comes");
        run(&mut receiver, end);
        assert_eq!(receiver.statistics.received, 1);
        let later = end + Time::from_millis(1);
        assert_eq!(get(&mut receiver, 0x09, later), after, "{reading:?}");
        receiver.enable(false, later);
        assert_eq!(get(&mut receiver, 0x09, later), after, "{reading:?}: kept in standby");
        receiver.enable(true, later);
        let listening = later + Time::from_micros(130);
        run(&mut receiver, listening);
        assert_eq!(get(&mut receiver, 0x09, listening), 0, "{reading:?}: released");
    }
}

#[test]
fn receivers_that_are_off_or_differ_get_nothing() {
    let (mut sender, now) = radio();
    let now = start(&mut sender, false, now);
    command(&mut sender, &[0xa0, 1, 2, 3, 4, 5, 6, 7, 8], now);
    sender.enable(true, now);
    let sent = run(&mut sender, now + Time::from_millis(1));
    for (register, value) in
        [(0x05, 3), (0x06, 0x06), (0x00, 0x0b), (0x03, 1), (0x0a, 1), (0x11, 7), (0x02, 0)]
    {
        let (mut receiver, _) = radio();
        start(&mut receiver, true, POWER_ON);
        set(&mut receiver, register, value, now);
        receiver.enable(true, now);
        carry(sent.clone(), &mut receiver);
        run(&mut receiver, now + Time::from_millis(2));
        assert_eq!(receiver.statistics.received, 0, "register {register:#04x}");
    }
    let (mut late, _) = radio();
    start(&mut late, true, POWER_ON);
    late.enable(true, now + Time::from_micros(1));
    carry(sent, &mut late);
    run(&mut late, now + Time::from_millis(2));
    assert_eq!(late.statistics.unheard, 1);
}
