//! Tests of the board, through the registers that a firmware writes.

use bittybuzz_chips::HardwareError;

use super::*;

const RCC: u32 = 0x4002_3800;
const FLASH_ACR: u32 = 0x4002_3c00;
const GPIOA: u32 = 0x4002_0000;
const GPIOB: u32 = 0x4002_0400;
const GPIOC: u32 = 0x4002_0800;
const GPIOD: u32 = 0x4002_0c00;
const TIM2: u32 = 0x4000_0000;
const TIM4: u32 = 0x4000_0800;
const TIM5: u32 = 0x4000_0c00;
const USART6: u32 = 0x4001_1400;
const EXTI: u32 = 0x4001_3c00;
const IWDG: u32 = 0x4000_3000;

/// Returns a board with the clocks that a firmware for the Crazyflie sets, all of them on.
pub(super) fn board() -> CrazyflieBoard {
    set_up(CrazyflieBoard::new(CrazyflieVariation::default()))
}

/// Sets the clocks that a firmware for the Crazyflie sets, all of them on.
pub(super) fn set_up(mut board: CrazyflieBoard) -> CrazyflieBoard {
    write(&mut board, FLASH_ACR, 5);
    write(&mut board, RCC, 0x0001_0083);
    write(&mut board, RCC + 0x04, 8 | 336 << 6 | 1 << 22 | 7 << 24);
    write(&mut board, RCC, 0x0101_0083);
    write(&mut board, RCC + 0x08, 2 | 0b101 << 10 | 0b100 << 13);
    for (register, bits) in [(0x30, 0xf), (0x40, 0xf), (0x44, 1 << 5 | 1 << 14)] {
        write(&mut board, RCC + register, bits);
    }
    assert_eq!(board.core_clock_hz(), 168_000_000);
    assert_eq!(events(&mut board), []);
    board
}

pub(super) fn write(board: &mut CrazyflieBoard, address: u32, value: u32) {
    board.write(address, Width::Word, value);
}

pub(super) fn read(board: &mut CrazyflieBoard, address: u32) -> u32 {
    board.read(address, Width::Word)
}

pub(super) fn events(board: &mut CrazyflieBoard) -> Vec<BoardEvent> {
    board.take_events().into_iter().map(|(_, event)| event).collect()
}

/// Starts USART6 on PC6 and PC7 at 84 MHz / `divider`, with its receive interrupt.
pub(super) fn start_usart(board: &mut CrazyflieBoard, divider: u32) {
    write(board, GPIOC, 2 << 12 | 2 << 14);
    write(board, GPIOC + 0x20, 8 << 24 | 8 << 28);
    write(board, USART6 + 0x08, divider);
    write(board, USART6 + 0x0c, 1 << 13 | 1 << 5 | 1 << 3 | 1 << 2);
}

/// Sends bytes as a driver does, and returns the bytes that came meanwhile.
fn talk(board: &mut CrazyflieBoard, bytes: &[u8], until: Time) -> Vec<u8> {
    let mut bytes = bytes.iter();
    let mut received = Vec::new();
    loop {
        let status = read(board, USART6);
        if status & 1 << 5 != 0 {
            received.push(read(board, USART6 + 4) as u8);
        }
        if status & 1 << 7 != 0
            && let Some(byte) = bytes.next()
        {
            write(board, USART6 + 4, u32::from(*byte));
        }
        match board.next_event() {
            Some(at) if at <= until => board.advance(at),
            _ => return received,
        }
    }
}

#[test]
fn leds_follow_their_pins() {
    let mut board = board();
    // Red and green of the left are active low, blue is active high.
    write(&mut board, GPIOC + 0x14, 0b1111);
    write(&mut board, GPIOC, 0b01_01_01_01);
    write(&mut board, GPIOD, 1 << 4);
    assert_eq!(events(&mut board), []);
    write(&mut board, GPIOC + 0x18, 1 << 16);
    write(&mut board, GPIOD + 0x18, 1 << 2);
    let on = |led| BoardEvent::Led { led, on: true };
    assert_eq!(events(&mut board), [on(BoardLed::RedLeft), on(BoardLed::BlueLeft)]);
    write(&mut board, GPIOC, 0);
    assert_eq!(events(&mut board), [BoardEvent::Led { led: BoardLed::RedLeft, on: false }]);
}

#[test]
fn each_motor_has_its_pin() {
    // Motor, port and pin, alternate function, timer, channel from 1: the table of the board.
    for (number, port, pin, function, timer, channel) in [
        (1, GPIOA, 1, 1, TIM2, 2),
        (2, GPIOB, 11, 1, TIM2, 4),
        (3, GPIOA, 15, 1, TIM2, 1),
        (4, GPIOB, 9, 2, TIM4, 4),
    ] {
        let mut board = board();
        write(&mut board, timer + 0x2c, 255);
        write(&mut board, timer + 0x18, 0x6868);
        write(&mut board, timer + 0x1c, 0x6868);
        write(&mut board, timer + 0x34 + 4 * (channel - 1), 64);
        write(&mut board, timer + 0x20, 0x1111);
        write(&mut board, timer, 1);
        write(&mut board, port, 2 << (2 * pin));
        assert_eq!(events(&mut board), [], "alternate function 0 is not the timer");
        write(&mut board, port + 0x20 + 4 * (pin / 8), function << (4 * (pin % 8)));
        let motor = |duty, frequency_hz| BoardEvent::Motor { number, duty, frequency_hz };
        assert_eq!(events(&mut board), [motor(0.25, 328_125.0)]);
        write(&mut board, timer + 0x20, 0);
        assert_eq!(events(&mut board), [motor(0.0, 0.0)], "CCxE");
        // As an output the pin is constantly high.
        write(&mut board, port + 0x18, 1 << pin);
        write(&mut board, port, 1 << (2 * pin));
        assert_eq!(events(&mut board), [motor(1.0, 0.0)]);
        board.reset(ResetCause::Software);
        assert_eq!(events(&mut board), [motor(0.0, 0.0)]);
    }
}

#[test]
fn frames_pass_in_both_directions_at_one_megabaud() {
    let mut board = board();
    start_usart(&mut board, 84);
    let channel = [0xbc, 0xcf, 0x01, 0x01, 0x50, 0x52, 0x55];
    let echo = talk(&mut board, &channel, Time::from_millis(10));
    assert_eq!(echo, channel);
    let [(at, event)] = &board.take_events()[..] else { panic!("one event") };
    assert_eq!(*event, BoardEvent::Syslink { kind: 1, payload: vec![0x50], intact: true });
    assert_eq!(*at, Time::from_micros(70));
    assert_eq!(board.statistics().peer_received, 7);
}

#[test]
fn frames_at_a_wrong_baud_rate_or_pin_are_lost() {
    let channel = [0xbc, 0xcf, 0x01, 0x01, 0x50, 0x52, 0x55];
    for divider in [80, 88] {
        let mut board = board();
        start_usart(&mut board, divider);
        assert_eq!(talk(&mut board, &channel, Time::from_millis(10)), [0_u8; 0]);
    }
    for (register, value) in [(GPIOC, 2 << 14), (GPIOC + 0x20, 7 << 24 | 8 << 28)] {
        let mut board = board();
        start_usart(&mut board, 84);
        write(&mut board, register, value);
        assert_eq!(talk(&mut board, &channel, Time::from_millis(10)), [0_u8; 0]);
        assert_eq!(board.statistics().peer_received, 0);
    }
    let mut board = board();
    start_usart(&mut board, 84);
    write(&mut board, GPIOC + 0x20, 8 << 24);
    assert_eq!(
        talk(&mut board, &channel, Time::from_millis(10)),
        [0_u8; 0],
        "PC7 is not connected"
    );
    assert_eq!(board.statistics().peer_received, 7);
}

#[test]
fn flow_control_interrupts_through_exti4() {
    let mut board = board();
    write(&mut board, EXTI, 1 << 4);
    write(&mut board, EXTI + 0x08, 1 << 4);
    write(&mut board, EXTI + 0x0c, 1 << 4);
    assert_eq!(read(&mut board, GPIOA + 0x10) >> 4 & 1, 0);
    board.set_flow_control(true);
    assert_eq!(read(&mut board, GPIOA + 0x10) >> 4 & 1, 1);
    assert_eq!(board.interrupts().bits(), 1 << 10);
    write(&mut board, EXTI + 0x14, 1 << 4);
    assert_eq!(board.interrupts().bits(), 0);
    board.set_flow_control(false);
    assert_eq!(board.interrupts().bits(), 1 << 10, "the falling edge, too");
}

#[test]
fn a_timer_interrupts_at_its_line_and_time() {
    let mut board = board();
    for (offset, value) in
        [(0x28, 83), (0x2c, 0xffff), (0x14, 1), (0x10, 0), (0x34, 1000), (0x0c, 2)]
    {
        write(&mut board, TIM5 + offset, value);
    }
    write(&mut board, TIM5, 1);
    assert_eq!(board.next_event(), Some(Time::from_millis(1)));
    board.advance(Time::from_millis(2));
    assert!(board.interrupts().is_high(50));
    assert_eq!(read(&mut board, TIM5 + 0x24), 2000);
}

#[test]
fn a_peripheral_without_clock_reports_one_error() {
    let mut board = CrazyflieBoard::new(CrazyflieVariation::default());
    write(&mut board, TIM2 + 0x2c, 255);
    assert_eq!(read(&mut board, TIM2 + 0x2c), 0);
    let error = BoardEvent::HardwareError(HardwareError::NoClock { base: TIM2 });
    assert_eq!(events(&mut board), [error]);
    assert_eq!(board.statistics().accesses_without_clock, 2);
    write(&mut board, RCC + 0x40, 1);
    assert_eq!(read(&mut board, TIM2 + 0x2c), 0xffff_ffff);
    write(&mut board, TIM2 + 0x2c, 255);
    write(&mut board, RCC + 0x20, 1);
    assert_eq!(read(&mut board, TIM2 + 0x2c), 0xffff_ffff, "reset by RCC_APB1RSTR");
}

#[test]
fn a_fast_clock_without_wait_states_is_an_error() {
    let mut board = board();
    write(&mut board, FLASH_ACR, 4);
    let error = HardwareError::FlashTooSlow { hz: 168_000_000, wait_states: 4, needed: 5 };
    assert_eq!(events(&mut board), [BoardEvent::HardwareError(error)]);
}

#[test]
fn without_a_clock_sleep_does_not_end() {
    let mut board = board();
    for (offset, value) in [(0x34, 1000), (0x0c, 2), (0x00, 1)] {
        write(&mut board, TIM5 + offset, value);
    }
    assert!(board.next_event().is_some());
    // HSE off: the PLL that makes the system clock gets nothing.
    write(&mut board, RCC, 0x0100_0083);
    assert_eq!(board.core_clock_hz(), 0);
    assert_eq!(board.next_event(), None);
    let error = HardwareError::PllOutOfRange { input_hz: 0, vco_hz: 0 };
    assert_eq!(events(&mut board), [BoardEvent::HardwareError(error)]);
}

#[test]
fn the_watchdog_resets_the_chip_and_the_cause_is_kept() {
    let mut board = board();
    write(&mut board, IWDG, 0x5555);
    write(&mut board, IWDG + 0x08, 799);
    write(&mut board, IWDG, 0xcccc);
    board.advance(Time::from_millis(99));
    assert_eq!(board.take_reset_request(), None);
    board.advance(Time::from_millis(100));
    assert_eq!(board.take_reset_request(), Some(ResetCause::IndependentWatchdog));
    board.reset(ResetCause::IndependentWatchdog);
    assert_eq!(read(&mut board, RCC + 0x74) >> 29 & 1, 1);
    assert_eq!(board.core_clock_hz(), 16_000_000);
    board.advance(Time::from_millis(1_000));
    assert_eq!(board.take_reset_request(), None, "a reset stops it");
}

#[test]
fn registers_without_model_are_storage_and_listed() {
    let mut board = board();
    write(&mut board, RCC + 0x40, 1 << 25);
    // CAN1_BTR.
    write(&mut board, 0x4000_641c, 0x1234_5678);
    board.write(0x4000_641d, Width::Byte, 0xff);
    assert_eq!(read(&mut board, 0x4000_641c), 0x1234_ff78);
    assert_eq!(board.read(0x4000_641e, Width::Half), 0x1234);
    assert_eq!(board.statistics().unknown, [0x4000_641c]);
}

/// Returns the voltage that the radio's processor reports last.
fn reported_volts(board: &mut CrazyflieBoard) -> f32 {
    start_usart(board, 84);
    // SYSLINK_PM_BATTERY_AUTOUPDATE; the first report comes a second after power-on.
    let received = talk(board, &[0xbc, 0xcf, 0x14, 0x00, 0x14, 0x28], Time::from_millis(1_200));
    let begins = |frame: &&[u8]| frame.starts_with(&[0xbc, 0xcf, 0x13]);
    let report = received.windows(9).rev().find(begins).expect("a report");
    f32::from_le_bytes(report[5..].try_into().expect("four bytes"))
}

#[test]
fn a_body_discharges_only_a_battery_that_was_not_set() {
    let battery = Battery { volts: 3.1, charging: false, usb_powered: false };
    let body = BodySettings { seed: 1, place_m: [0.0; 2], yaw_rad: 0.0, poses: None };
    let mut board = self::board();
    board.set_body(&body);
    let full = reported_volts(&mut board);
    assert!((4.1..4.3).contains(&full), "{full}");
    let mut board = self::board();
    board.set_body(&body);
    board.set_battery(battery);
    assert_eq!(reported_volts(&mut board), 3.1);
}

#[test]
fn cutting_the_power_turns_everything_off() {
    let mut board = board();
    start_usart(&mut board, 84);
    write(&mut board, GPIOD, 1 << 4);
    write(&mut board, GPIOD + 0x18, 1 << 2);
    talk(&mut board, &[0xbc, 0xcf, 0x0b, 0x00, 0x0b, 0x16], Time::from_millis(1));
    events(&mut board);
    board.request_shutdown();
    board.advance(Time::from_millis(1_000));
    assert!(board.is_powered());
    board.advance(Time::from_millis(1_002));
    assert!(!board.is_powered());
    let off = BoardEvent::Led { led: BoardLed::BlueLeft, on: false };
    assert_eq!(events(&mut board), [BoardEvent::PowerOff { acknowledged: false }, off]);
}
