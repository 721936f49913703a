//! The reset of the peripheral, and the clearing of a bus that a chip holds.
//!
//! A chip that was interrupted while it sent a zero drives SDA low until it sees the clock of the
//! rest of its byte. Meanwhile there is no start condition. Up to nine clock pulses by hand bring
//! the chip to the point where the master does not acknowledge, and a stop condition ends its
//! transfer (UM10204 3.1.16; crazyflie-firmware, i2c_drv.c).

use embassy_stm32::gpio::{AfType, Flex, OutputType, Speed};
use embassy_stm32::pac::i2c::I2c;
use embassy_stm32::pac::i2c::vals::{Duty, FS};
use embassy_stm32::peripherals::I2C3;
use embassy_stm32::rcc;
use embassy_time::{Duration, Timer};

use super::BusError;

/// The alternate function of I2C1 on PB6 and PB7, and of I2C3 on PA8 and PC9 (data sheet, table 9).
const AF: u8 = 4;

const BUS_HZ: u32 = 400_000;
/// The longest rise of a line in fast mode, in ns (UM10204, table 10).
const RISE_NS: u32 = 300;

/// The pulses that bring any chip to the end of its byte and its acknowledgement.
const PULSES: usize = 9;
/// Half the period of a clock by hand.
const HALF: Duration = Duration::from_micros(10);
/// The halves of a period for which a chip may hold SCL low.
const STRETCH: usize = 50;

/// The two lines of a bus, and the peripheral that drives them.
pub struct Lines {
    pub i2c: I2c,
    pub scl: Flex<'static>,
    pub sda: Flex<'static>,
}

impl Lines {
    /// Resets the peripheral and clears the bus. This takes 40 µs if no chip holds a line, 220 µs if
    /// one needs nine pulses, and 0.5 ms if one never lets SCL go.
    ///
    /// The peripheral stays in reset until the bus is free (RM0090 27.6.1, SWRST).
    pub async fn reset(&mut self) -> Result<(), BusError> {
        self.i2c.cr1().write(|w| w.set_swrst(true));
        let outcome = self.clear().await;
        self.connect();
        outcome
    }

    /// Sends clock pulses until SDA is high, and then a stop condition.
    async fn clear(&mut self) -> Result<(), BusError> {
        for line in [&mut self.scl, &mut self.sda] {
            line.set_high();
            line.set_as_input_output(Speed::Medium);
        }
        self.wait_for_scl().await?;
        for _ in 0..PULSES {
            if self.sda.is_high() {
                break;
            }
            self.scl.set_low();
            Timer::after(HALF).await;
            self.scl.set_high();
            self.wait_for_scl().await?;
        }
        // A start and a stop condition: SDA falls and rises while SCL is high.
        self.sda.set_low();
        Timer::after(HALF).await;
        self.sda.set_high();
        Timer::after(HALF).await;
        if self.sda.is_high() { Ok(()) } else { Err(BusError::SdaLow) }
    }

    /// Waits half a period, and as long as a chip holds SCL low.
    async fn wait_for_scl(&mut self) -> Result<(), BusError> {
        for _ in 0..STRETCH {
            Timer::after(HALF).await;
            if self.scl.is_high() {
                return Ok(());
            }
        }
        Err(BusError::SclLow)
    }

    /// Gives the pins to the peripheral, and turns it on.
    fn connect(&mut self) {
        let function = AfType::output(OutputType::OpenDrain, Speed::Medium);
        self.scl.set_as_af_unchecked(AF, function);
        self.sda.set_as_af_unchecked(AF, function);
        let i2c = self.i2c;
        i2c.cr1().write(|_| {});
        // Both peripherals are on APB1.
        let clock_hz = rcc::frequency::<I2C3>().0;
        let clock_mhz = clock_hz / 1_000_000;
        i2c.cr2().write(|w| w.set_freq(clock_mhz as u8));
        // SCL is low for two thirds of its period, which takes three times CCR cycles (27.6.8).
        i2c.ccr().write(|w| {
            w.set_f_s(FS::FAST);
            w.set_duty(Duty::DUTY2_1);
            w.set_ccr((clock_hz / (3 * BUS_HZ)) as u16);
        });
        // The cycles of the longest rise, plus one (27.6.9).
        i2c.trise().write(|w| w.set_trise((clock_mhz * RISE_NS / 1_000 + 1) as u8));
        i2c.cr1().write(|w| w.set_pe(true));
    }
}
