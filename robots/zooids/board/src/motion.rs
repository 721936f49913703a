//! LSM6DS3 accelerometer and gyroscope on I2C (data sheet DocID026899): identity, output rates, and
//! the readings of a robot that drives on a level table. Taps, tilt, FIFO and noise have no model.

use bittybuzz_chips::Time;

use super::device::Device;

const WHO_AM_I: u8 = 0x0f;
const CTRL1_XL: u8 = 0x10;
const CTRL2_G: u8 = 0x11;
const CTRL3_C: u8 = 0x12;
const STATUS: u8 = 0x1e;
/// Output registers: temperature, then three axes of the gyroscope and three of the accelerometer,
/// two bytes each.
const OUTPUTS: u8 = 0x20;
const OUTPUTS_END: u8 = 0x2e;
const CTRL3_C_SW_RESET: u8 = 1 << 0;
const CTRL3_C_IF_INC: u8 = 1 << 2;
/// Sensitivities per unit at the smallest ranges: 0.061 mg and 8.75 mdps. The range bits select a
/// factor for the other ranges.
const MICRO_G: f64 = 61.0;
const MICRO_DPS: f64 = 8750.0;

pub(super) struct ZooidMotion {
    registers: [u8; 128],
    pointer: u8,
    /// Rate of turn in degrees per second, around the axis that points up.
    pub turn_degrees_s: f64,
}

impl ZooidMotion {
    /// 7-bit address, with SA0 low.
    pub const ADDRESS: u8 = 0x6a;

    pub fn new() -> Self {
        let mut registers = [0; 128];
        registers[usize::from(WHO_AM_I)] = 0x69;
        registers[usize::from(CTRL3_C)] = CTRL3_C_IF_INC;
        ZooidMotion { registers, pointer: 0, turn_degrees_s: 0.0 }
    }

    /// Sets the state after power-on; the robot's rotation stays.
    pub fn restart(&mut self) {
        *self = ZooidMotion { turn_degrees_s: self.turn_degrees_s, ..ZooidMotion::new() };
    }

    fn get(&self, register: u8) -> u8 {
        self.registers[usize::from(register & 0x7f)]
    }

    /// Returns true if the sensor with this control register is on: its output rate is not 0.
    fn is_on(&self, control: u8) -> bool {
        self.get(control) >> 4 != 0
    }

    fn output(&self, word: u8) -> i16 {
        match word {
            // Rate around z.
            3 if self.is_on(CTRL2_G) => {
                // Ranges of 245, 500, 1000 and 2000 dps.
                let factor = [1.0, 2.0, 4.0, 8.0][usize::from(self.get(CTRL2_G) >> 2 & 3)];
                (self.turn_degrees_s * 1e6 / (MICRO_DPS * factor)) as i16
            }
            // Acceleration along z is 1 g, because the table supports the robot.
            6 if self.is_on(CTRL1_XL) => {
                // Ranges of 2, 16, 4 and 8 g.
                let factor = [1.0, 8.0, 2.0, 4.0][usize::from(self.get(CTRL1_XL) >> 2 & 3)];
                (1e6 / (MICRO_G * factor)) as i16
            }
            _ => 0,
        }
    }
}

impl Device for ZooidMotion {
    fn is_awake(&self, _: Time) -> bool {
        true
    }

    fn point(&mut self, register: u8) {
        self.pointer = register & 0x7f;
    }

    fn write(&mut self, byte: u8, _now: Time) {
        match self.pointer {
            CTRL3_C if byte & CTRL3_C_SW_RESET != 0 => {
                self.restart();
                self.pointer = CTRL3_C;
            }
            WHO_AM_I | STATUS | OUTPUTS..OUTPUTS_END => {}
            pointer => self.registers[usize::from(pointer)] = byte,
        }
        self.next();
    }

    fn read(&mut self, _now: Time) -> u8 {
        let byte = match self.pointer {
            STATUS => u8::from(self.is_on(CTRL1_XL)) | u8::from(self.is_on(CTRL2_G)) << 1,
            pointer @ OUTPUTS..OUTPUTS_END => {
                let word = self.output((pointer - OUTPUTS) / 2).to_le_bytes();
                word[usize::from(pointer & 1)]
            }
            pointer => self.get(pointer),
        };
        self.next();
        byte
    }
}

impl ZooidMotion {
    fn next(&mut self) {
        if self.get(CTRL3_C) & CTRL3_C_IF_INC != 0 {
            self.pointer = self.pointer.wrapping_add(1) & 0x7f;
        }
    }
}
