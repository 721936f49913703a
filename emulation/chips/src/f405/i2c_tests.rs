use super::*;
use crate::Width;

const BIT: Time = Time::from_nanos(2_500);

fn write(i2c: &mut I2c, offset: u32, value: u32, now: Time) {
    assert!(i2c.write(offset, Write::new(offset, Width::Word, value), now));
}

/// An I2C at 42 MHz / 3 / 35 = 400 kHz with all interrupts but those of the buffer.
fn i2c() -> I2c {
    let mut i2c = I2c::new(42_000_000);
    write(&mut i2c, CR2, 42 | CR2_ITERREN | CR2_ITEVTEN, Time::ZERO);
    write(&mut i2c, CCR, CCR_FAST | 35, Time::ZERO);
    write(&mut i2c, CR1, CR1_PE | CR1_ACK, Time::ZERO);
    i2c
}

fn bits(bits: u64) -> Time {
    Time::from_picos(bits * BIT.picos())
}

/// Sends a start condition and an address, as a firmware does that waits for SB. Returns the time
/// after the acknowledgement.
fn address(i2c: &mut I2c, byte: u8, acknowledged: bool, now: Time) -> Time {
    let ack = i2c.read(CR1, now) & CR1_ACK;
    write(i2c, CR1, CR1_PE | CR1_START | ack, now);
    assert_eq!(i2c.next_event(), Some(now + BIT));
    let now = now + BIT;
    assert_eq!(i2c.advance(now), None, "a start condition has no answer");
    assert_eq!(i2c.read(CR1, now) & CR1_START, 0, "it was on the bus");
    assert_eq!(i2c.read(SR1, now), SR1_SB);
    assert!(i2c.interrupts()[0]);
    write(i2c, DR, u32::from(byte), now);
    assert_eq!(i2c.read(SR1, now), 0);
    let action = BusAction::Start { address: byte >> 1, read: byte & 1 != 0 };
    let now = now + bits(9);
    assert_eq!(i2c.advance(now), Some((now, action)));
    i2c.acknowledge(action, acknowledged, now);
    now
}

fn send(i2c: &mut I2c, byte: u8, now: Time) -> Time {
    let now = now + bits(9);
    assert_eq!(i2c.advance(now), Some((now, BusAction::Write(byte))));
    i2c.acknowledge(BusAction::Write(byte), true, now);
    now
}

fn receive(i2c: &mut I2c, byte: u8, now: Time) -> Time {
    let now = now + bits(9);
    assert_eq!(i2c.advance(now), Some((now, BusAction::Read)));
    i2c.receive(byte, now);
    now
}

fn stop(i2c: &mut I2c, now: Time) -> Time {
    let now = now + BIT;
    assert_eq!(i2c.advance(now), Some((now, BusAction::Stop)));
    now
}

#[test]
fn the_clock_is_the_manuals() {
    // RM0090 27.6.8: in standard mode, 100 kHz at 8 MHz need CCR 0x28 (5000 ns / 125 ns).
    let mut i2c = I2c::new(8_000_000);
    write(&mut i2c, CCR, 0x28, Time::ZERO);
    assert_eq!(i2c.bits(1), Time::from_micros(10));
    // In fast mode with DUTY, 400 kHz are 25 * CCR periods of 10 MHz: CCR 1.
    i2c.set_clock(10_000_000);
    write(&mut i2c, CCR, CCR_FAST | CCR_DUTY | 1, Time::ZERO);
    assert_eq!(i2c.bits(1), BIT);
}

#[test]
fn a_register_is_read_in_the_order_of_events_of_the_manual() {
    // RM0090 figure 242 (transmitter), then figure 243 (receiver) with DMA (27.3.7).
    let mut i2c = i2c();
    let now = address(&mut i2c, 0x18 << 1, true, Time::ZERO);
    assert_eq!(i2c.read(SR1, now), SR1_ADDR, "EV6");
    assert_eq!(i2c.read(SR2, now), SR2_MSL | SR2_BUSY | SR2_TRA);
    assert_eq!(i2c.read(SR1, now), SR1_TXE, "EV8_1");
    assert!(!i2c.interrupts()[0], "ITBUFEN is off");
    write(&mut i2c, DR, 0x12, now);
    assert_eq!(i2c.read(SR1, now), SR1_TXE, "EV8: the shift register took it");
    let now = send(&mut i2c, 0x12, now);
    assert_eq!(i2c.read(SR1, now), SR1_TXE | SR1_BTF, "EV8_2");
    // A repeated start, and the address for a read.
    let now = address(&mut i2c, 0x18 << 1 | 1, true, now);
    assert_eq!(now, bits(1 + 9 + 9 + 1 + 9));
    write(&mut i2c, CR2, 42 | CR2_DMAEN | CR2_LAST, now);
    assert_eq!(i2c.next_event(), None, "SCL is low until ADDR is cleared");
    assert_eq!(i2c.read(SR1, now), SR1_ADDR);
    assert_eq!(i2c.read(SR2, now), SR2_MSL | SR2_BUSY);
    let mut now = now;
    for byte in 1..=6 {
        now = receive(&mut i2c, byte, now);
        assert_eq!(i2c.dma_requests(), [false, true]);
        assert_eq!(i2c.read(DR, now), u32::from(byte));
        if byte == 5 {
            i2c.expect_last();
        }
    }
    assert_eq!(i2c.next_event(), None, "the sixth byte was not acknowledged");
    write(&mut i2c, CR1, CR1_PE | CR1_STOP, now);
    assert_eq!(i2c.read(CR1, now) & CR1_STOP, CR1_STOP);
    let now = stop(&mut i2c, now);
    assert_eq!(i2c.read(CR1, now) & CR1_STOP, 0);
    assert_eq!(i2c.read(SR2, now), 0);
    // 29 bits of address and register, 54 of data, one stop.
    assert_eq!(now, bits(29 + 54 + 1));
}

#[test]
fn flags_need_both_accesses() {
    let mut i2c = i2c();
    write(&mut i2c, CR1, CR1_PE | CR1_START, Time::ZERO);
    i2c.advance(BIT);
    write(&mut i2c, DR, 0x30, BIT);
    assert_eq!(i2c.read(SR1, BIT), SR1_SB, "SR1 had not been read before DR");
    write(&mut i2c, DR, 0x30, BIT);
    let now = BIT + bits(9);
    let (_, action) = i2c.advance(now).unwrap();
    i2c.acknowledge(action, true, now);
    i2c.read(SR2, now);
    assert_eq!(i2c.read(SR1, now), SR1_ADDR, "SR1 had not been read before SR2");
}

#[test]
fn one_byte_ends_with_ack_off_and_stop_set_early() {
    // RM0090 27.3.3, reception of a single byte: ACK = 0, ADDR cleared, STOP = 1.
    let mut i2c = i2c();
    let now = address(&mut i2c, 0x77 << 1 | 1, true, Time::ZERO);
    write(&mut i2c, CR1, CR1_PE, now);
    i2c.read(SR1, now);
    i2c.read(SR2, now);
    write(&mut i2c, CR1, CR1_PE | CR1_STOP, now);
    let now = receive(&mut i2c, 0x50, now);
    assert_eq!(i2c.read(SR1, now), SR1_RXNE);
    let now = stop(&mut i2c, now);
    assert_eq!(i2c.read(DR, now), 0x50);
    assert_eq!(i2c.read(SR1, now), 0);
}

#[test]
fn two_bytes_with_pos_wait_for_btf() {
    // RM0090 27.3.3, reception of two bytes: POS and ACK set, ACK off after ADDR, BTF, STOP.
    let mut i2c = i2c();
    write(&mut i2c, CR1, CR1_PE | CR1_ACK | CR1_POS, Time::ZERO);
    write(&mut i2c, CR1, CR1_PE | CR1_ACK | CR1_POS | CR1_START, Time::ZERO);
    i2c.advance(BIT);
    i2c.read(SR1, BIT);
    write(&mut i2c, DR, 0x31, BIT);
    let now = BIT + bits(9);
    let (_, action) = i2c.advance(now).unwrap();
    i2c.acknowledge(action, true, now);
    i2c.read(SR1, now);
    i2c.read(SR2, now);
    write(&mut i2c, CR1, CR1_PE | CR1_POS, now);
    let now = receive(&mut i2c, 1, now);
    let now = receive(&mut i2c, 2, now);
    assert_eq!(i2c.read(SR1, now), SR1_RXNE | SR1_BTF);
    assert_eq!(i2c.next_event(), None, "SCL is low, and the second byte was not acknowledged");
    write(&mut i2c, CR1, CR1_PE | CR1_POS | CR1_STOP, now);
    let now = stop(&mut i2c, now);
    assert_eq!([i2c.read(DR, now), i2c.read(DR, now)], [1, 2]);
    assert_eq!(i2c.read(SR1, now), 0);
}

#[test]
fn an_unread_byte_holds_the_clock() {
    let mut i2c = i2c();
    let now = address(&mut i2c, 0x31, true, Time::ZERO);
    i2c.read(SR1, now);
    i2c.read(SR2, now);
    let now = receive(&mut i2c, 1, now);
    let now = receive(&mut i2c, 2, now);
    assert_eq!((i2c.next_event(), i2c.read(SR1, now)), (None, SR1_RXNE | SR1_BTF));
    let later = now + Time::from_millis(1);
    assert_eq!(i2c.read(DR, later), 1);
    assert_eq!(i2c.read(SR1, later), SR1_RXNE);
    assert_eq!(i2c.next_event(), Some(later + bits(9)));
}

#[test]
fn a_missing_device_sets_af_until_it_is_cleared() {
    let mut i2c = i2c();
    let now = address(&mut i2c, 0x42 << 1 | 1, false, Time::ZERO);
    assert_eq!((i2c.read(SR1, now), i2c.interrupts()), (SR1_AF, [false, true]));
    assert_eq!(i2c.next_event(), None);
    // Bits are cleared by writing 0, and the transfer is not resumed by that.
    write(&mut i2c, SR1, !SR1_AF & 0xffff, now);
    assert_eq!((i2c.read(SR1, now), i2c.next_event()), (0, None));
    write(&mut i2c, CR1, CR1_PE | CR1_STOP, now);
    stop(&mut i2c, now);
}

#[test]
fn a_start_during_the_stop_follows_it() {
    let mut i2c = i2c();
    let now = address(&mut i2c, 0x42 << 1, false, Time::ZERO);
    write(&mut i2c, SR1, 0, now);
    write(&mut i2c, CR1, CR1_PE | CR1_STOP, now);
    write(&mut i2c, CR1, CR1_PE | CR1_START, now + Time::from_micros(1));
    let now = stop(&mut i2c, now);
    assert_eq!(i2c.advance(now + BIT), None);
    assert_eq!(i2c.read(SR1, now + BIT), SR1_SB);
}

#[test]
fn a_start_waits_until_the_bus_is_free() {
    let mut i2c = i2c();
    i2c.set_held(true, Time::ZERO);
    write(&mut i2c, CR1, CR1_PE | CR1_START, Time::ZERO);
    assert_eq!((i2c.next_event(), i2c.read(SR2, Time::ZERO)), (None, SR2_BUSY));
    assert_eq!(i2c.read(CR1, Time::ZERO), CR1_PE | CR1_START);
    let later = Time::from_millis(1000);
    i2c.set_held(false, later);
    assert_eq!(i2c.next_event(), Some(later + BIT));
}

#[test]
fn a_reset_leaves_the_device_with_the_rest_of_its_byte() {
    let mut i2c = i2c();
    let now = address(&mut i2c, 0x31, true, Time::ZERO);
    i2c.read(SR1, now);
    i2c.read(SR2, now);
    // The fourth of nine bits is not complete.
    write(&mut i2c, CR1, CR1_SWRST, now + bits(3) + Time::from_nanos(1));
    assert_eq!(i2c.take_release(), Some(BusRelease(Some((BusAction::Read, 6)))));
    assert_eq!((i2c.next_event(), i2c.read(CCR, now)), (None, 0));
    write(&mut i2c, CR1, 0, now);
    assert_eq!(i2c.take_release(), None);
}

#[test]
fn a_read_of_the_data_register_clears_the_end_of_a_byte() {
    // RM0090 27.6.6, BTF: a read of SR1, then a read or write of DR.
    let mut i2c = i2c();
    let now = address(&mut i2c, 0x18 << 1, true, Time::ZERO);
    i2c.read(SR1, now);
    i2c.read(SR2, now);
    write(&mut i2c, DR, 0x12, now);
    i2c.read(SR1, now);
    let now = send(&mut i2c, 0x12, now);
    i2c.read(DR, now);
    assert!(i2c.interrupts()[0], "SR1 was not read since");
    assert_eq!(i2c.read(SR1, now), SR1_TXE | SR1_BTF);
    i2c.read(DR, now);
    assert!(!i2c.interrupts()[0]);
    assert_eq!(i2c.read(SR1, now), SR1_TXE);
}

#[test]
fn an_unread_byte_is_not_sent_in_the_next_transfer() {
    let mut i2c = i2c();
    let now = address(&mut i2c, 0x31, true, Time::ZERO);
    write(&mut i2c, CR1, CR1_PE, now);
    i2c.read(SR1, now);
    i2c.read(SR2, now);
    let now = receive(&mut i2c, 7, now);
    let now = address_after_data(&mut i2c, 0x30, now);
    i2c.read(SR1, now);
    i2c.read(SR2, now);
    assert_eq!((i2c.read(SR1, now), i2c.next_event()), (SR1_TXE, None));
}

/// Sends a repeated start condition and an address while RXNE is set.
fn address_after_data(i2c: &mut I2c, byte: u8, now: Time) -> Time {
    write(i2c, CR1, CR1_PE | CR1_START, now);
    let now = now + BIT;
    i2c.advance(now);
    assert_eq!(i2c.read(SR1, now), SR1_SB | SR1_RXNE);
    write(i2c, DR, byte.into(), now);
    let now = now + bits(9);
    let (_, action) = i2c.advance(now).unwrap();
    i2c.acknowledge(action, true, now);
    now
}
