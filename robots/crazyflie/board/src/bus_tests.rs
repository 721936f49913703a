//! Tests of the buses and of DMA, through the registers that a firmware writes.

use bittybuzz_chips::HardwareError;

use super::tests::{board, events, read, set_up, start_usart, write};
use super::*;

const RCC_AHB1ENR: u32 = 0x4002_3830;
const RCC_APB1ENR: u32 = 0x4002_3840;
const RCC_APB2ENR: u32 = 0x4002_3844;
const GPIOA: u32 = 0x4002_0000;
const GPIOB: u32 = 0x4002_0400;
const GPIOC: u32 = 0x4002_0800;
const I2C3: u32 = 0x4000_5c00;
const USART6: u32 = 0x4001_1400;
const SPI1: u32 = 0x4001_3000;
/// Streams 2 of DMA1 and 7 of DMA2.
const DMA1_S2: u32 = 0x4002_6040;
const DMA2_S7: u32 = 0x4002_64b8;
const RAM_BUFFER: u32 = 0x2000_0400;

/// The memory of a core without a core.
fn move_data(board: &mut CrazyflieBoard, memory: &mut [u8]) {
    while let Some(Transfer { from, to }) = board.next_transfer() {
        let at = |address: u32| address.checked_sub(RAM_BUFFER).map(|at| at as usize);
        match (at(from.0), at(to.0)) {
            (Some(at), _) if at < memory.len() => board.write(to.0, to.1, memory[at].into()),
            (_, Some(at)) if at < memory.len() => memory[at] = board.read(from.0, from.1) as u8,
            _ => panic!("a transfer outside of the buffer: {from:?} {to:?}"),
        }
    }
}

/// Lets time pass until the condition holds, or until the robot has nothing more to do.
fn wait(
    board: &mut CrazyflieBoard,
    memory: &mut [u8],
    until: impl Fn(&mut CrazyflieBoard) -> bool,
) {
    for _ in 0..10_000 {
        move_data(board, memory);
        if until(board) {
            return;
        }
        let Some(next) = board.next_event() else { break };
        board.advance(next);
    }
    panic!("the condition never holds");
}

/// Returns a board whose I2C3 runs at 400 kHz on PA8 and PC9.
fn board_with_i2c() -> CrazyflieBoard {
    let mut board = board();
    write(&mut board, RCC_AHB1ENR, 0xf | 3 << 21);
    write(&mut board, RCC_APB1ENR, 1 << 23);
    connect_i2c(&mut board);
    for (register, value) in [(0x04, 42), (0x1c, 1 << 15 | 35), (0x20, 13), (0x00, 1 | 1 << 10)] {
        write(&mut board, I2C3 + register, value);
    }
    // The sensors answer a millisecond after power-on.
    board.advance(Time::from_millis(5));
    board
}

fn connect_i2c(board: &mut CrazyflieBoard) {
    for (port, pin) in [(GPIOA, 8), (GPIOC, 9)] {
        write(board, port + 0x04, 1 << pin);
        write(board, port + 0x24, 4 << (4 * (pin - 8)));
        write(board, port, 2 << (2 * pin));
    }
}

/// Sends a start condition, a chip's address and one byte, each after its event.
fn point(board: &mut CrazyflieBoard, address: u8, register: u8) {
    write(board, I2C3, 1 | 1 << 10 | 1 << 8);
    wait(board, &mut [], |board| read(board, I2C3 + 0x14) & 1 != 0);
    write(board, I2C3 + 0x10, u32::from(address << 1));
    wait(board, &mut [], |board| read(board, I2C3 + 0x14) & 2 != 0);
    read(board, I2C3 + 0x18);
    write(board, I2C3 + 0x10, register.into());
    wait(board, &mut [], |board| read(board, I2C3 + 0x14) & 4 != 0);
}

/// Reads registers by DMA as Bitcraze's firmware does, into a buffer at this address.
fn read_registers(
    board: &mut CrazyflieBoard,
    (address, register): (u8, u8),
    buffer: u32,
    memory: &mut [u8],
) {
    point(board, address, register);
    for (offset, value) in [(0x04, memory.len() as u32), (0x08, I2C3 + 0x10), (0x0c, buffer)] {
        write(board, DMA1_S2 + offset, value);
    }
    // Channel 3, memory increment, interrupts of completion and error.
    write(board, DMA1_S2, 3 << 25 | 1 << 10 | 1 << 4 | 1 << 2 | 1);
    write(board, I2C3, 1 | 1 << 10 | 1 << 8);
    wait(board, memory, |board| read(board, I2C3 + 0x14) & 1 != 0);
    write(board, I2C3 + 0x10, u32::from(address << 1 | 1));
    wait(board, memory, |board| read(board, I2C3 + 0x14) & 2 != 0);
    write(board, I2C3 + 0x04, 42 | 1 << 11 | 1 << 12);
    read(board, I2C3 + 0x18);
    // The interrupt of stream 2.
    wait(board, memory, |board| board.interrupts().is_high(13));
    write(board, I2C3, 1 | 1 << 10 | 1 << 9);
    wait(board, memory, |board| read(board, I2C3 + 0x18) == 0);
}

#[test]
fn i2c3_reads_the_identities_of_the_sensors_by_dma() {
    let mut board = board_with_i2c();
    // The gyroscope's identity and the first data; the accelerometer needs a first access.
    for (chip, identity) in [((0x69, 0), 0x0f), ((0x18, 0), 0x1e), ((0x77, 0), 0x50)] {
        let mut memory = [0xaa; 4];
        read_registers(&mut board, chip, RAM_BUFFER, &mut memory);
        assert_eq!(memory[0], identity, "{chip:x?}");
        assert_eq!(read(&mut board, DMA1_S2) & 1, 0, "the stream is off");
        write(&mut board, 0x4002_6008, 0x3d << 16);
        write(&mut board, I2C3 + 0x04, 42);
    }
    assert_eq!(events(&mut board), []);
}

#[test]
fn dma_to_core_coupled_memory_is_an_error() {
    let mut board = board_with_i2c();
    read_registers(&mut board, (0x69, 0), 0x1000_0400, &mut [0; 4]);
    // TEIF2 is bit 19 of DMA1_LISR, TCIF2 bit 21.
    assert_eq!(read(&mut board, 0x4002_6000) >> 16 & 0x28, 0x08);
    let error = HardwareError::DmaOutOfReach { address: 0x1000_0400 };
    assert_eq!(events(&mut board), [BoardEvent::HardwareError(error)]);
}

#[test]
fn a_stop_and_a_start_by_hand_reach_the_sensors() {
    let mut board = board_with_i2c();
    // A read of zeros that the firmware leaves in its third bit: the gyroscope holds SDA low.
    point(&mut board, 0x69, 2);
    write(&mut board, I2C3, 1 | 1 << 10 | 1 << 8);
    wait(&mut board, &mut [], |board| read(board, I2C3 + 0x14) & 1 != 0);
    write(&mut board, I2C3 + 0x10, 0x69 << 1 | 1);
    wait(&mut board, &mut [], |board| read(board, I2C3 + 0x14) & 2 != 0);
    read(&mut board, I2C3 + 0x18);
    let now = board.now();
    board.advance(now + Time::from_nanos(6_000));
    write(&mut board, I2C3, 1 << 15);
    // Both lines by hand, open drain and high.
    for (port, pin) in [(GPIOA, 8), (GPIOC, 9)] {
        write(&mut board, port + 0x14, 1 << pin);
        write(&mut board, port, 1 << (2 * pin));
    }
    let sda = |board: &mut CrazyflieBoard| read(board, GPIOC + 0x10) >> 9 & 1 != 0;
    let clocks = (0..20)
        .take_while(|_| {
            let is_held = !sda(&mut board);
            if is_held {
                write(&mut board, GPIOA + 0x18, 1 << 24);
                write(&mut board, GPIOA + 0x18, 1 << 8);
            }
            is_held
        })
        .count();
    // The rest of the byte, which is zero; then SDA is free for the acknowledgement.
    assert_eq!(clocks, 6);
    // The bus works again.
    write(&mut board, I2C3, 0);
    connect_i2c(&mut board);
    for (register, value) in [(0x04, 42), (0x1c, 1 << 15 | 35), (0x00, 1 | 1 << 10)] {
        write(&mut board, I2C3 + register, value);
    }
    let mut memory = [0; 2];
    read_registers(&mut board, (0x69, 0), RAM_BUFFER, &mut memory);
    assert_eq!(memory[0], 0x0f);
}

#[test]
fn usart6_sends_a_frame_by_dma() {
    let mut board = board();
    write(&mut board, RCC_AHB1ENR, 0xf | 3 << 21);
    start_usart(&mut board, 84);
    // DMAT; the frame of RADIO_CHANNEL 80 after the nRF51 has started.
    board.advance(Time::from_millis(110));
    write(&mut board, USART6 + 0x14, 1 << 7);
    let mut memory = [0xbc, 0xcf, 0x01, 0x01, 0x50, 0x52, 0x55];
    for (offset, value) in [(0x04, 7), (0x08, USART6 + 4), (0x0c, RAM_BUFFER)] {
        write(&mut board, DMA2_S7 + offset, value);
    }
    // Channel 5, memory increment, to the peripheral, interrupt of completion.
    write(&mut board, DMA2_S7, 5 << 25 | 1 << 10 | 1 << 6 | 1 << 4 | 1);
    assert!(board.wants_memory());
    let begin = board.now();
    wait(&mut board, &mut memory, |board| board.interrupts().is_high(70));
    // The stream ends when the last byte is in the data register, a byte before it begins.
    assert_eq!(board.now() - begin, Time::from_micros(50));
    wait(&mut board, &mut memory, |board| read(board, USART6) & 1 << 6 != 0);
    assert_eq!(board.now() - begin, Time::from_micros(70));
    let frame = BoardEvent::Syslink { kind: 1, payload: vec![0x50], intact: true };
    assert!(events(&mut board).contains(&frame));
}

#[test]
fn the_data_ready_pulse_reaches_exti_14() {
    let mut board = board_with_i2c();
    // The interrupt of new data on, at pin INT3, active high and push-pull.
    for (register, value) in [(0x15, 0x80), (0x16, 0x01), (0x18, 0x01)] {
        point(&mut board, 0x69, register);
        write(&mut board, I2C3 + 0x10, value);
        wait(&mut board, &mut [], |board| read(board, I2C3 + 0x14) & 4 != 0);
        write(&mut board, I2C3, 1 | 1 << 9);
        wait(&mut board, &mut [], |board| read(board, I2C3 + 0x18) == 0);
    }
    // Line 14 from port C, rising edge.
    write(&mut board, 0x4001_3814, 2 << 8);
    write(&mut board, 0x4001_3c00, 1 << 14);
    write(&mut board, 0x4001_3c08, 1 << 14);
    let mut times = Vec::new();
    for _ in 0..3 {
        wait(&mut board, &mut [], |board| board.interrupts().is_high(40));
        times.push(board.now());
        write(&mut board, 0x4001_3c14, 1 << 14);
    }
    // After power-on the gyroscope samples at 2,000 Hz (data sheet BST-BMI088-DS001, GYRO_BANDWIDTH).
    assert_eq!(times[2] - times[1], Time::from_micros(500));
}

/// Exchanges a byte on SPI1 by polling, as Bitcraze's firmware does.
fn exchange(board: &mut CrazyflieBoard, byte: u8) -> u8 {
    write(board, SPI1 + 0x0c, byte.into());
    wait(board, &mut [], |board| read(board, SPI1 + 0x08) & 1 != 0);
    read(board, SPI1 + 0x0c) as u8
}

#[test]
fn the_flow_deck_is_selected_by_io_3_and_answers_on_spi1() {
    let variation =
        CrazyflieVariation { decks: vec![AttachedDeck::FlowV2], ..CrazyflieVariation::default() };
    let mut board = set_up(CrazyflieBoard::new(variation));
    write(&mut board, RCC_APB2ENR, 1 << 12 | 1 << 14);
    // PA5 to PA7 belong to SPI1; PB4 is an output and high.
    write(&mut board, GPIOA + 0x20, 5 << 20 | 5 << 24 | 5 << 28);
    write(&mut board, GPIOA, 0xa800_0000 | 2 << 10 | 2 << 12 | 2 << 14);
    write(&mut board, GPIOB + 0x18, 1 << 4);
    write(&mut board, GPIOB, 1 << 8);
    // Master in mode 3 at 84 MHz / 64, NSS by software.
    write(&mut board, SPI1, 1 << 9 | 1 << 8 | 1 << 6 | 5 << 3 | 1 << 2 | 3);
    board.advance(Time::from_millis(50));
    let product = |board: &mut CrazyflieBoard| {
        exchange(board, 0x00);
        let later = board.now() + Time::from_micros(500);
        board.advance(later);
        exchange(board, 0x00)
    };
    assert_eq!(product(&mut board), 0, "it is not selected, and MISO has no pull-up");
    write(&mut board, GPIOB + 0x18, 1 << 20);
    assert_eq!(product(&mut board), 0x49);
}
