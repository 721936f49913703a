//! Tests of the board, through the registers that a firmware writes.

use std::collections::HashSet;

use bittybuzz_chips::{Air, LOOKAHEAD, PacketSource};

use super::*;

const RCC: u32 = 0x4002_1000;
const FLASH_ACR: u32 = 0x4002_2000;
const GPIOA: u32 = 0x4800_0000;
const GPIOB: u32 = 0x4800_0400;
const TIM1: u32 = 0x4001_2c00;
const TIM2: u32 = 0x4000_0000;
const SPI1: u32 = 0x4001_3000;
const I2C2: u32 = 0x4000_5800;
const EXTI: u32 = 0x4001_0400;
const SYSCFG: u32 = 0x4001_0000;
const ADC: u32 = 0x4001_2400;

fn write(board: &mut ZooidBoard, address: u32, value: u32) {
    board.write(address, Width::Word, value);
}

fn read(board: &mut ZooidBoard, address: u32) -> u32 {
    board.read(address, Width::Word)
}

/// A brown-out is a short fall of the supply voltage.
#[test]
fn only_a_brown_out_changes_memory() {
    let noise = MemoryContent::Noise { seed: 7 };
    for (memory, values) in
        [(MemoryContent::Kept, None), (MemoryContent::Zeroed, Some(1)), (noise, Some(256))]
    {
        let mut board = ZooidBoard::power_on(0);
        board.set_chip(ChipProperties { lsi_hz: 40_000, memory, ..ChipProperties::default() });
        board.reset(ResetCause::BrownOut);
        let content = board.start(0x0800_0000).memory;
        let found = content.first().map(|(address, bytes)| {
            (*address, bytes.len(), bytes.iter().collect::<HashSet<_>>().len())
        });
        assert_eq!(found, values.map(|values| (0x2000_0000, 8192, values)), "{memory:?}");
        board.reset(ResetCause::Software);
        assert_eq!(board.start(0x0800_0000).memory, []);
    }
}

fn events(board: &mut ZooidBoard) -> Vec<BoardEvent> {
    board.take_events().into_iter().map(|(_, event)| event).collect()
}

fn wait(board: &mut ZooidBoard, micros: u64) {
    board.advance(board.now() + Time::from_micros(micros));
}

/// Returns a board that is set up as by a firmware: 48 MHz, all clocks on, SPI1 at 6 MHz, 16 MHz
/// for the radio.
fn board(number: usize) -> ZooidBoard {
    let mut board = ZooidBoard::power_on(number);
    write(&mut board, FLASH_ACR, 0x11);
    write(&mut board, RCC, 0x0001_0083);
    write(&mut board, RCC + 0x2c, 1);
    write(&mut board, RCC + 0x04, 4 << 18 | 1 << 16 | 1 << 17 | 6 << 24);
    write(&mut board, RCC, 0x0101_0083);
    let cfgr = read(&mut board, RCC + 0x04);
    write(&mut board, RCC + 0x04, cfgr | 2);
    for (register, bits) in
        [(0x14, 1 | 7 << 17), (0x18, 1 | 1 << 9 | 1 << 11 | 1 << 12), (0x1c, 1 | 1 << 22)]
    {
        write(&mut board, RCC + register, bits);
    }
    // Port A: motors and LED alternate 2, CSN output, SPI and MCO alternate 0.
    write(&mut board, GPIOA + 0x20, 0x0000_2222);
    write(&mut board, GPIOA + 0x24, 0x0000_2220);
    write(&mut board, GPIOA + 0x18, 1 << 4);
    write(&mut board, GPIOA, 0x2800_0000 | 0b10_10_10_10_10_10_10_01_10_10_10_10);
    // Port B: CE output, I2C alternate 1.
    write(&mut board, GPIOB + 0x24, 0x0000_1100);
    write(&mut board, GPIOB, 0b01 | 0b10 << 20 | 0b10 << 22);
    write(&mut board, SPI1 + 0x04, 0x1700);
    write(&mut board, SPI1, 0x0354);
    assert_eq!(board.core_clock_hz(), 48_000_000);
    board.advance(Time::from_millis(100));
    assert_eq!(events(&mut board), []);
    board
}

/// Sends a command to the radio, and polls as a driver does.
fn command(board: &mut ZooidBoard, bytes: &[u8]) -> Vec<u8> {
    write(board, GPIOA + 0x28, 1 << 4);
    let mut answer = Vec::new();
    for byte in bytes {
        board.write(SPI1 + 0x0c, Width::Byte, u32::from(*byte));
        while read(board, SPI1 + 0x08) & 1 == 0 {
            board.advance(board.now() + Time::from_nanos(100));
        }
        answer.push(board.read(SPI1 + 0x0c, Width::Byte) as u8);
    }
    write(board, GPIOA + 0x18, 1 << 4);
    answer
}

#[test]
fn the_radio_uses_spi1_and_its_clock_is_on_pa8() {
    let mut board = board(0);
    let begin = board.now();
    assert_eq!(command(&mut board, &[0x05, 0xff]), [0x0e, 0x02]);
    // Two bytes at 6 MHz.
    assert!(board.now() - begin >= Time::of_ticks(16, 6_000_000));
    command(&mut board, &[0x20, 0x0e]);
    command(&mut board, &[0x21, 0]);
    command(&mut board, &[0xa0, 1, 2, 3]);
    write(&mut board, GPIOB + 0x18, 1);
    wait(&mut board, 1_000);
    let sent = board.take_transmissions();
    assert_eq!(sent.len(), 1);
    assert_eq!(sent[0].packet.payload(), [1, 2, 3]);
    assert!(matches!(&events(&mut board)[..], [BoardEvent::Radio { channel: 2, .. }]));
}

#[test]
fn without_mco_the_radio_stays_silent() {
    let mut board = board(0);
    let cfgr = read(&mut board, RCC + 0x04);
    write(&mut board, RCC + 0x04, cfgr & !(7 << 24));
    command(&mut board, &[0x20, 0x0e]);
    command(&mut board, &[0xa0, 1, 2, 3]);
    write(&mut board, GPIOB + 0x18, 1);
    wait(&mut board, 10_000);
    assert_eq!(board.take_transmissions(), []);
}

#[test]
fn too_fast_an_spi_is_reported_once() {
    let mut board = board(0);
    write(&mut board, SPI1, 0x0304 | 1 << 3 | 1 << 6);
    for _ in 0..2 {
        command(&mut board, &[0xff]);
    }
    let error = HardwareError::RadioSpiTooFast { hz: 12_000_000, limit_hz: 10_000_000 };
    assert_eq!(events(&mut board), [BoardEvent::HardwareError(error)]);
}

/// A packet from one board reaches the other through the air.
#[test]
fn a_packet_reaches_the_other_boards_irq() {
    let mut boards = [board(0), board(1)];
    for board in &mut boards {
        for bytes in [&[0x21, 0][..], &[0x24, 0], &[0x31, 3], &[0x25, 22]] {
            command(board, bytes);
        }
    }
    let [sender, receiver] = &mut boards;
    command(receiver, &[0x20, 0x0f]);
    write(receiver, GPIOB + 0x18, 1);
    // Falling edge of PA15: line 15.
    write(receiver, EXTI, 1 << 15);
    write(receiver, EXTI + 0x0c, 1 << 15);
    command(sender, &[0x20, 0x0e]);
    command(sender, &[0xa0, 1, 2, 3]);
    let now = sender.now().max(receiver.now()) + Time::from_millis(1);
    sender.advance(now);
    receiver.advance(now);
    write(sender, GPIOB + 0x18, 1);
    let mut air = Air::new();
    let mut now = now;
    for _ in 0..5 {
        now = now + LOOKAHEAD;
        air.carry(now, 2, |robot, event| boards[robot].receive(event));
        for (number, board) in boards.iter_mut().enumerate() {
            board.advance(now);
            for transmission in board.take_transmissions() {
                air.add(PacketSource::Robot(number), transmission);
            }
        }
    }
    assert_eq!(air.statistics.carried, 1);
    let receiver = &mut boards[1];
    assert!(receiver.interrupts().is_high(7), "EXTI4_15");
    assert_eq!(command(receiver, &[0x61, 0, 0, 0])[1..], [1, 2, 3]);
}

#[test]
fn photodiodes_show_the_code_and_raise_their_interrupts() {
    let mut board = board(0);
    // Lines 1 and 9, port B, both edges.
    write(&mut board, SYSCFG + 0x08, 1 << 4);
    write(&mut board, SYSCFG + 0x10, 1 << 4);
    for register in [0x00, 0x08, 0x0c] {
        write(&mut board, EXTI + register, 1 << 1 | 1 << 9);
    }
    wait(&mut board, 100_000);
    assert_eq!(board.interrupts().bits(), 0, "it is nowhere");
    board.place(Some(TablePose::at(460.0, 460.0, 0.0)));
    wait(&mut board, 100_000);
    assert!(board.interrupts().is_high(5), "EXTI0_1");
    assert!(board.interrupts().is_high(7), "EXTI4_15");
    assert_eq!(read(&mut board, EXTI + 0x14), 1 << 1 | 1 << 9);
}

#[test]
fn led_and_motors_follow_their_timers() {
    let mut board = board(0);
    // TIM1: 2 MHz, 10000; PWM mode 1 on channels 2 to 4, active low.
    for (register, value) in [
        (0x28, 23),
        (0x2c, 9_999),
        (0x18, 6 << 12),
        (0x1c, 6 << 4 | 6 << 12),
        (0x20, 0x3330),
        (0x44, 1 << 15),
        (0x14, 1),
        (0x00, 1),
    ] {
        write(&mut board, TIM1 + register, value);
    }
    assert_eq!(events(&mut board), []);
    write(&mut board, TIM1 + 0x3c, 1_250);
    assert_eq!(events(&mut board), [BoardEvent::Led { led: BoardLed::Red, on: true }]);
    write(&mut board, TIM1 + 0x3c, 0);
    assert_eq!(events(&mut board), [BoardEvent::Led { led: BoardLed::Red, on: false }]);
    // TIM2: 4 MHz, 100: 40 kHz.
    for (register, value) in
        [(0x28, 11), (0x2c, 99), (0x18, 6 << 4 | 6 << 12), (0x20, 0x0011), (0x14, 1), (0x00, 1)]
    {
        write(&mut board, TIM2 + register, value);
    }
    write(&mut board, TIM2 + 0x38, 60);
    let motor = BoardEvent::Motor { number: 2, duty: 0.6, frequency_hz: 40_000.0 };
    assert_eq!(events(&mut board), [motor]);
}

#[test]
fn touch_controller_and_motion_sensor_are_on_i2c2() {
    let mut board = board(0);
    // Wait until the touch controller answers.
    wait(&mut board, 125_000);
    write(&mut board, I2C2 + 0x10, 0x0090_1850);
    write(&mut board, I2C2, 1);
    for (address, register, identity) in [(0x1b, 0x00, 0x2e), (0x6a, 0x0f, 0x69)] {
        write(&mut board, I2C2 + 4, address << 1 | 1 << 16 | 1 << 13);
        let wait_for = |board: &mut ZooidBoard, flag: u32| {
            for _ in 0..100 {
                if read(board, I2C2 + 0x18) & flag != 0 {
                    return;
                }
                wait(board, 5);
            }
            panic!("no flag {flag:#x}");
        };
        wait_for(&mut board, 1 << 1);
        write(&mut board, I2C2 + 0x28, register);
        wait_for(&mut board, 1 << 6);
        write(&mut board, I2C2 + 4, address << 1 | 1 << 10 | 1 << 16 | 1 << 25 | 1 << 13);
        wait_for(&mut board, 1 << 2);
        assert_eq!(read(&mut board, I2C2 + 0x24), identity);
        wait_for(&mut board, 1 << 5);
        write(&mut board, I2C2 + 0x1c, 1 << 5);
    }
}

#[test]
fn battery_and_charger() {
    let mut board = board(0);
    board.set_battery(4.0, true);
    assert_eq!(read(&mut board, GPIOB + 0x10) >> 13 & 1, 0);
    write(&mut board, ADC + 0x10, 2 << 30);
    write(&mut board, ADC + 0x08, 1);
    write(&mut board, ADC + 0x308, 1 << 24);
    write(&mut board, ADC + 0x28, 1 << 18);
    write(&mut board, ADC + 0x14, 7);
    write(&mut board, ADC + 0x08, 1 << 2);
    wait(&mut board, 100);
    assert_eq!(read(&mut board, ADC + 0x40), 2482, "2.0 V of 3.3 V");
    board.set_battery(4.0, false);
    assert_eq!(read(&mut board, GPIOB + 0x10) >> 13 & 1, 1);
}

#[test]
fn the_watchdog_requests_a_reset() {
    let mut board = board(0);
    write(&mut board, 0x4000_3000, 0xcccc);
    wait(&mut board, 409_000);
    assert_eq!(board.take_reset_request(), None);
    // RM0091 table "min/max IWDG timeout": PR 0, RL 0xfff at 40 kHz: 409.6 ms.
    wait(&mut board, 1_000);
    assert_eq!(board.take_reset_request(), Some(ResetCause::IndependentWatchdog));
}
