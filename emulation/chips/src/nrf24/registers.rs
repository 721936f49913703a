//! The register map (product specification, 9.1).

pub const CONFIG: u8 = 0x00;
pub const EN_AA: u8 = 0x01;
pub const EN_RXADDR: u8 = 0x02;
pub const SETUP_AW: u8 = 0x03;
pub const SETUP_RETR: u8 = 0x04;
pub const RF_CH: u8 = 0x05;
pub const RF_SETUP: u8 = 0x06;
pub const STATUS: u8 = 0x07;
pub const OBSERVE_TX: u8 = 0x08;
pub const RPD: u8 = 0x09;
pub const RX_ADDR_P0: u8 = 0x0a;
pub const RX_ADDR_P1: u8 = 0x0b;
const RX_ADDR_P5: u8 = 0x0f;
pub const TX_ADDR: u8 = 0x10;
pub const RX_PW_P0: u8 = 0x11;
pub const FIFO_STATUS: u8 = 0x17;
pub const DYNPD: u8 = 0x1c;
pub const FEATURE: u8 = 0x1d;
const COUNT: usize = 0x1e;

pub const CONFIG_PRIM_RX: u8 = 1 << 0;
pub const CONFIG_PWR_UP: u8 = 1 << 1;
pub const CONFIG_CRCO: u8 = 1 << 2;
pub const CONFIG_EN_CRC: u8 = 1 << 3;
/// RX_DR, TX_DS and MAX_RT have the same positions in STATUS as their masks in CONFIG.
pub const RX_DR: u8 = 1 << 6;
pub const TX_DS: u8 = 1 << 5;
pub const MAX_RT: u8 = 1 << 4;
pub const INTERRUPTS: u8 = RX_DR | TX_DS | MAX_RT;
pub const FEATURE_EN_DPL: u8 = 1 << 2;
pub const FEATURE_EN_ACK_PAY: u8 = 1 << 1;
pub const FEATURE_EN_DYN_ACK: u8 = 1 << 0;
const RF_DR_LOW: u8 = 1 << 5;
const RF_DR_HIGH: u8 = 1 << 3;
/// The number of pipes on which a receiver listens.
pub const PIPES: usize = 6;

/// An address on the air, most significant byte first; 3 to 5 bytes.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Address(Vec<u8>);

impl Address {
    /// Returns the width in bytes.
    pub fn width(&self) -> usize {
        self.0.len()
    }
}

/// The registers that hold written values.
pub struct Nrf24Registers {
    bytes: [u8; COUNT],
    /// RX_ADDR_P0, RX_ADDR_P1, TX_ADDR, least significant byte first.
    long: [[u8; 5]; 3],
}

impl Nrf24Registers {
    pub fn new() -> Self {
        let mut bytes = [0; COUNT];
        for (register, value) in [
            (CONFIG, 0x08),
            (EN_AA, 0x3f),
            (EN_RXADDR, 0x03),
            (SETUP_AW, 0x03),
            (SETUP_RETR, 0x03),
            (RF_CH, 0x02),
            (RF_SETUP, 0x0e),
            (0x0c, 0xc3),
            (0x0d, 0xc4),
            (0x0e, 0xc5),
            (RX_ADDR_P5, 0xc6),
        ] {
            bytes[usize::from(register)] = value;
        }
        Nrf24Registers { bytes, long: [[0xe7; 5], [0xc2; 5], [0xe7; 5]] }
    }

    pub fn get(&self, register: u8) -> u8 {
        self.bytes.get(usize::from(register)).copied().unwrap_or(0)
    }

    fn long(register: u8) -> Option<usize> {
        match register {
            RX_ADDR_P0 => Some(0),
            RX_ADDR_P1 => Some(1),
            TX_ADDR => Some(2),
            _ => None,
        }
    }

    /// Returns byte `index` of a register. A register of one byte returns the same byte for every
    /// index.
    pub fn read(&self, register: u8, index: usize) -> u8 {
        match Self::long(register) {
            Some(long) => self.long[long].get(index).copied().unwrap_or(0),
            None => self.get(register),
        }
    }

    /// Writes byte `index` of a register. Reserved bits stay 0.
    pub fn write(&mut self, register: u8, index: usize, value: u8) {
        if let Some(long) = Self::long(register) {
            if let Some(byte) = self.long[long].get_mut(index) {
                *byte = value;
            }
            return;
        }
        let writable = match register {
            CONFIG | RF_CH => 0x7f,
            EN_AA | EN_RXADDR | DYNPD | 0x11..=0x16 => 0x3f,
            SETUP_AW => 0x03,
            FEATURE => 0x07,
            RF_SETUP => 0xbe,
            SETUP_RETR | 0x0c..=0x0f => 0xff,
            _ => return,
        };
        if index == 0 {
            self.bytes[usize::from(register)] = value & writable;
        }
    }

    /// Returns the width of an address in bytes (SETUP_AW). The value 0 is illegal and read as 2
    /// bytes; no driver sets it.
    pub fn address_width(&self) -> usize {
        usize::from(self.get(SETUP_AW)) + 2
    }

    fn address(&self, bytes: [u8; 5]) -> Address {
        Address(bytes[..self.address_width()].iter().rev().copied().collect())
    }

    pub fn transmit_address(&self) -> Address {
        self.address(self.long[2])
    }

    /// Returns the address of a pipe. Pipes 2 to 5 have only the lowest byte of their own (9.1,
    /// RX_ADDR_P2).
    pub fn pipe_address(&self, pipe: usize) -> Address {
        let bytes = match pipe {
            0 => self.long[0],
            1 => self.long[1],
            _ => {
                let mut bytes = self.long[1];
                bytes[0] = self.get(RX_ADDR_P0 + pipe as u8);
                bytes
            }
        };
        self.address(bytes)
    }

    pub fn bits_per_second(&self) -> u64 {
        match self.get(RF_SETUP) & (RF_DR_LOW | RF_DR_HIGH) {
            RF_DR_LOW => 250_000,
            RF_DR_HIGH => 2_000_000,
            // Both bits together are reserved.
            _ => 1_000_000,
        }
    }

    /// Returns the size of the checksum in bytes. Acknowledgement on any pipe enables the checksum
    /// (9.1, CONFIG).
    pub fn crc_bytes(&self) -> usize {
        let config = self.get(CONFIG);
        if config & CONFIG_EN_CRC == 0 && self.get(EN_AA) == 0 {
            0
        } else if config & CONFIG_CRCO == 0 {
            1
        } else {
            2
        }
    }

    /// Returns true if packets have the control field of Enhanced ShockBurst. It is absent only if
    /// neither acknowledgement nor retransmission is on (7.10).
    pub fn is_enhanced(&self) -> bool {
        self.get(EN_AA) != 0 || self.get(SETUP_RETR) & 0xf != 0
    }

    pub fn is_set(&self, register: u8, bit: usize) -> bool {
        self.get(register) >> bit & 1 != 0
    }

    pub fn has_feature(&self, bit: u8) -> bool {
        self.get(FEATURE) & bit != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reset_values_are_the_specifications() {
        let registers = Nrf24Registers::new();
        assert_eq!(registers.transmit_address(), Address(vec![0xe7; 5]));
        assert_eq!(registers.pipe_address(1), Address(vec![0xc2; 5]));
        assert_eq!(registers.pipe_address(5), Address(vec![0xc2, 0xc2, 0xc2, 0xc2, 0xc6]));
        assert_eq!(registers.bits_per_second(), 2_000_000);
        assert_eq!(registers.crc_bytes(), 1);
    }

    #[test]
    fn addresses_are_sent_most_significant_byte_first() {
        let mut registers = Nrf24Registers::new();
        registers.write(SETUP_AW, 0, 1);
        for (index, byte) in [0x0c, 0xd0, 0xf0].into_iter().enumerate() {
            registers.write(TX_ADDR, index, byte);
        }
        assert_eq!(registers.transmit_address(), Address(vec![0xf0, 0xd0, 0x0c]));
    }
}
